//! Products of powers among which identifiable functions are sought.

use super::function_factors::ModelFactors;
use super::judge::verdicts::Judgement;
use super::model::compiled::Role;
use super::quotients::QuotientPowers;
use super::symmetry::{Symmetries, integers};

/// Largest number of products of a family; it decides the work.
const PRODUCTS: usize = 800;
/// Largest number of products that are listed before those with a weight are removed.
const LISTED: usize = 200_000;

/// Products of some factors.
pub(super) struct ProductFamily {
    pub(super) factors: Vec<usize>,
    /// Largest sum of the absolute exponents.
    pub(super) degree: u32,
    /// True if exponents may be negative.
    pub(super) negative: bool,
}

/// Effect of a scaling on the unknowns, as integer exponents.
pub(super) type ScalingExponents = Vec<(usize, i64)>;

/// Effects of the scalings of a model.
pub(super) fn weights(symmetries: &Symmetries) -> Vec<ScalingExponents> {
    let plain = symmetries.found.iter().filter(|s| s.translation.is_empty());
    let weights = plain.map(|s| {
        let numbers: Vec<(i64, i64)> = s.scaling.iter().map(|t| t.1).collect();
        s.scaling.iter().map(|t| t.0).zip(integers(&numbers)).collect()
    });
    weights.collect()
}

/// Families in the order of the search: parameters alone first, then with states, then with observable
/// unknowns and functions of unknowns; polynomials first.
pub(super) fn families(
    judged: &Judgement,
    factors: &ModelFactors,
    shown: &[bool],
    weights: &[ScalingExponents],
) -> Vec<ProductFamily> {
    let degrees = &judged.findings.degrees;
    let all: Vec<usize> =
        (0..judged.layout.unknowns.len()).filter(|&c| degrees.excited[c] && shown[c]).collect();
    let is_moved = |c: &usize| degrees.degree[*c].is_none();
    let is_parameter = |c: &usize| matches!(judged.layout.unknowns[*c].role, Role::Parameter(_));
    let moved: Vec<usize> = all.iter().copied().filter(is_moved).collect();
    let every_parameter: Vec<usize> = all.iter().copied().filter(is_parameter).collect();
    let parameters: Vec<usize> = moved.iter().copied().filter(is_parameter).collect();
    // a function of a scaled unknown has no weight
    let scaled = |unknown: usize| weights.iter().flatten().any(|w| w.0 == unknown);
    let functions =
        factors.of_functions().filter(|&c| factors.unknown(c).is_some_and(|unknown| !scaled(unknown)));
    let functions: Vec<usize> = functions.collect();
    let with_functions: Vec<usize> = all.iter().copied().chain(functions.iter().copied()).collect();
    let family = |factors: &Vec<usize>, degree, negative| {
        let factors = factors.clone();
        ProductFamily { factors, degree, negative }
    };
    let mut out = vec![
        family(&parameters, 2, false),
        family(&parameters, 3, true),
        family(&parameters, 4, false),
        family(&parameters, 5, false),
        family(&moved, 2, false),
        family(&moved, 3, true),
        family(&moved, 3, false),
        family(&all, 2, false),
        family(&every_parameter, 3, false),
        family(&all, 3, true),
        family(&all, 3, false),
        family(&moved, 4, true),
        family(&all, 4, false),
    ];
    if !functions.is_empty() {
        out.extend([2, 3].map(|degree| family(&with_functions, degree, false)));
    }
    out
}

impl ProductFamily {
    /// Products of weight zero that contain at least one unknown, short ones first, and among them those with
    /// few divisors; none if there are too many.
    pub(super) fn products(&self, weights: &[ScalingExponents]) -> Vec<QuotientPowers> {
        let mut out: Vec<(u32, QuotientPowers)> = vec![(0, Vec::new())];
        for &v in &self.factors {
            let mut longer = Vec::new();
            for (size, powers) in &out {
                let left = (self.degree - size) as i32;
                for e in (if self.negative { -left } else { 0 })..=left {
                    let mut powers = powers.clone();
                    if e != 0 {
                        powers.push((v, e));
                    }
                    longer.push((size + e.unsigned_abs(), powers));
                }
                if longer.len() > LISTED {
                    return Vec::new();
                }
            }
            out = longer;
        }
        let weightless = |powers: &[(usize, i32)]| {
            let weight = |w: &ScalingExponents| -> i64 {
                let own = |v: usize| w.iter().find(|t| t.0 == v).map_or(0, |t| t.1);
                powers.iter().map(|&(v, e)| own(v) * i64::from(e)).sum()
            };
            !powers.is_empty() && weights.iter().all(|w| weight(w) == 0)
        };
        out.retain(|p| weightless(&p.1));
        let below = |powers: &[(usize, i32)]| powers.iter().map(|p| (-p.1).max(0)).sum::<i32>();
        out.sort_by_cached_key(|(size, powers)| (*size, below(powers), powers.clone()));
        let products: Vec<QuotientPowers> = out.into_iter().map(|p| p.1).collect();
        if products.len() > PRODUCTS { Vec::new() } else { products }
    }
}

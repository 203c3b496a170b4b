//! Scaling and translation symmetries: directions `c_i x_i + d_i` with rational `c_i`, `d_i` that no output sees, at any point.

use obsdeg_exact::{Echelon, Field, SplitMix64};

use super::judge::{At, Judgement, climb_at};
use super::model::{Compiled, ModelError, SystemModel};
use crate::degree::sparse::{extend_by_short_vectors, support};

/// Points at which a direction must vanish, at most.
const POINTS: usize = 8;
/// Largest numerator of a coefficient.
const NUMERATOR: u64 = 1000;
/// Largest denominator of a coefficient.
const DENOMINATOR: i64 = 24;

/// A rational coefficient of an unknown.
pub type Term = (usize, (i64, i64));

/// A direction in which nothing changes: `x_i` grows by `c_i x_i + d_i`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symmetry {
    /// The `c_i` that are not zero.
    pub scaling: Vec<Term>,
    /// The `d_i` that are not zero.
    pub translation: Vec<Term>,
}

/// What stays the same: a product of powers, or a sum.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invariant {
    /// Integer exponents (or, of a sum, coefficients).
    pub terms: Vec<(usize, i64)>,
    /// A product of powers, not a sum.
    pub product: bool,
    /// Its degree.
    pub degree: usize,
}

/// The symmetries of a system, and the invariant combinations that they leave observable.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Symmetries {
    /// Independent ones.
    pub found: Vec<Symmetry>,
    /// The number of unobservable directions (among unknowns that are excited) that they do not explain.
    pub unexplained: usize,
    /// Observable combinations of unobservable unknowns.
    pub invariants: Vec<Invariant>,
}

/// A small rational number that a field element stands for.
fn ratio(f: &Field, x: u64) -> Option<(i64, i64)> {
    (1..=DENOMINATOR).find_map(|d| {
        let y = f.to_u64(f.mul(x, f.from_i64(d)));
        if y <= NUMERATOR {
            Some((y as i64, d))
        } else {
            (f.modulus() - y <= NUMERATOR).then(|| (-((f.modulus() - y) as i64), d))
        }
    })
}

/// The vector as small rationals, one at its first entry.
fn rationals(f: &Field, v: &[u64]) -> Option<Vec<(i64, i64)>> {
    let lead = v.iter().find(|x| **x != 0)?;
    let inverse = f.inv(*lead);
    v.iter().map(|&x| ratio(f, f.mul(x, inverse))).collect()
}

/// Rationals times their common denominator.
fn integers(v: &[(i64, i64)]) -> Vec<i64> {
    let gcd = |mut a: i64, mut b: i64| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a.abs()
    };
    let common = v.iter().filter(|x| x.0 != 0).fold(1, |l, x| l / gcd(l, x.1) * x.1);
    let scaled: Vec<i64> = v.iter().map(|x| x.0 * (common / x.1)).collect();
    let divisor = scaled.iter().fold(0, |g, x| gcd(g, *x)).max(1);
    scaled.iter().map(|x| x / divisor).collect()
}

/// The symmetries of a judged model.
///
/// # Errors
/// [`ModelError`] when a point cannot be had.
pub fn symmetries(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    seed: u64,
) -> Result<Symmetries, ModelError> {
    let n = judged.layout.unknowns.len();
    let excited = &judged.degrees.excited;
    let silent = excited.iter().filter(|e| !**e).count();
    let defect = n - judged.degrees.rank() - silent;
    if defect == 0 {
        return Ok(Symmetries::default());
    }
    let f = judged.fields[0];
    let mut rng = SplitMix64::new(seed ^ 0x0073_796d_6d65_7472);
    let mut basis = Echelon::new(f, 2 * n);
    // an unknown that no output sees is said so by itself; an observable one never moves
    for c in (0..n).filter(|&c| !excited[c] || judged.degrees.degree[c].is_some()) {
        for column in [c, n + c] {
            let unit: Vec<u64> = (0..2 * n).map(|j| if j == column { f.one() } else { 0 }).collect();
            basis.insert(&unit);
        }
    }
    let (mut last, mut at): (usize, Option<At>) = (0, None);
    for point in 0..POINTS {
        let here = climb_at(model, compiled, &judged.layout, f, &mut rng)?;
        if let Some(span) = here.stairs.last() {
            for i in 0..span.rank() {
                let row = span.row(i);
                let scaled = row.iter().zip(&here.values).map(|(&r, &x)| f.mul(r, x));
                let both: Vec<u64> = scaled.chain(row.iter().copied()).collect();
                basis.insert(&both);
            }
        }
        at = Some(here);
        if point >= 2 && basis.rank() == last {
            break;
        }
        last = basis.rank();
    }
    let Some(at) = at else { return Ok(Symmetries::default()) };
    let mut span = Echelon::new(f, 2 * n);
    let short = extend_by_short_vectors(&basis.null_space(), &mut span);
    let mut tangents = Echelon::new(f, n);
    let mut out = Symmetries::default();
    for v in short {
        let tangent: Vec<u64> = (0..n).map(|c| f.add(f.mul(v[c], at.values[c]), v[n + c])).collect();
        let Some(k) = rationals(&f, &v).filter(|_| tangents.insert(&tangent)) else { continue };
        let terms = |half: &[(i64, i64)]| -> Vec<Term> {
            half.iter().copied().enumerate().filter(|(_, k)| k.0 != 0).collect()
        };
        out.found.push(Symmetry { scaling: terms(&k[..n]), translation: terms(&k[n..]) });
    }
    out.unexplained = defect.saturating_sub(out.found.len());
    out.invariants = invariants(&f, n, &out.found, &at);
    Ok(out)
}

/// Products of powers that every scaling leaves alone, and sums that every translation does, as far as they are observable.
fn invariants(f: &Field, n: usize, found: &[Symmetry], at: &At) -> Vec<Invariant> {
    let mut out = Vec::new();
    let scalings: Vec<&Symmetry> = found.iter().filter(|s| s.translation.is_empty()).collect();
    let translations: Vec<&Symmetry> = found.iter().filter(|s| s.scaling.is_empty()).collect();
    for (product, list) in [(true, scalings), (false, translations)] {
        let terms = |s: &Symmetry| if product { s.scaling.clone() } else { s.translation.clone() };
        let mut rows = Echelon::new(*f, n);
        let mut moved = vec![false; n];
        for s in &list {
            let mut row = vec![0; n];
            for (c, (p, q)) in terms(s) {
                row[c] = f.from_ratio(p, q);
                moved[c] = true;
            }
            rows.insert(&row);
        }
        let kept: Vec<Vec<u64>> =
            rows.null_space().into_iter().filter(|v| support(v).iter().all(|&c| moved[c])).collect();
        // the null vectors of what is not moved are units
        let mut span = Echelon::new(*f, n);
        for m in extend_by_short_vectors(&kept, &mut span) {
            let Some(k) = rationals(f, &m) else { continue };
            let exponents = integers(&k);
            // d(prod x^m) = prod x^m sum m_i dx_i / x_i
            let gradient: Vec<u64> = exponents
                .iter()
                .zip(&at.values)
                .map(|(&m, &x)| f.mul(f.from_i64(m), if product { f.inv(x) } else { f.one() }))
                .collect();
            if let Some(degree) = at.stairs.iter().position(|v| v.contains(&gradient)) {
                let terms = exponents.iter().copied().enumerate().filter(|t| t.1 != 0).collect();
                out.push(Invariant { terms, product, degree });
            }
        }
    }
    out
}

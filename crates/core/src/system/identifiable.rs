//! Identifiable functions of unknowns that are not observable: sums of products of powers that no
//! unobservable direction changes.
//!
//! `f = sum_j a_j m_j` is observable at generic points iff its differential vanishes on every unobservable
//! direction there. This is a linear system for the `a_j` from several random points, modulo a prime.
//! Rational `a_j` are reconstructed, and the result is verified modulo the other prime. A scaling symmetry
//! takes `f` to a sum of parts of one weight each, so products of weight zero suffice. What is still missing
//! is taken from ratios of the coefficients of relations among output derivatives, then from these
//! derivatives themselves.

use obsdeg_exact::groebner::RemainingWork;
use obsdeg_exact::{Echelon, Field, SplitMix64};

use super::error::ModelError;
use super::functions::gcd;
use super::global::functions_of_constants;
use super::judge::{Judgement, PointDegrees, climb_at};
use super::lie::{lie_derivatives, terms_of_quotient};
use super::model::{Compiled, Role, SystemModel};
use super::quotients::{QuotientPowers, Terms};
use super::symmetry::{Invariant, Symmetries, integers, rationals};
use super::work::Spent;
use crate::degree::sparse::{extend_by_short_vectors, support};

/// Largest number of products of a family; it decides the work.
const PRODUCTS: usize = 800;
/// Largest number of products that are listed before those with a weight are removed.
const LISTED: usize = 200_000;
/// Largest number of points.
const POINTS: usize = 250;
/// Number of points with other verdicts before one is taken nevertheless: its results do not hold at the
/// first point.
const ELSEWHERE: usize = 24;
/// Limit of operations of all points and eliminations of a search.
const OPERATIONS: u64 = 200_000_000;
/// Limit of the work of relations.
const RELATIONS: u64 = 200_000_000;
/// Largest number of terms of a function that is kept.
const TERMS: usize = 40;
/// Highest degree among the unknowns that the functions found before do not express.
const RESTRICTED: u32 = 4;

/// Identifiable function of unknowns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct IdentifiableFunction {
    /// Integer coefficients and products of powers.
    pub(super) terms: Terms,
    /// Observable degree of the function.
    pub(super) degree: usize,
}

/// Products among which functions are sought.
struct ProductFamily {
    variables: Vec<usize>,
    /// Largest sum of the absolute exponents.
    degree: u32,
    /// True if exponents may be negative.
    negative: bool,
}

/// Functions beyond the invariants of the symmetries, and the number of missing ones.
///
/// # Errors
/// [`ModelError`] if no point is found.
pub(super) fn identifiable_functions(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    symmetries: &Symmetries,
    seed: u64,
) -> Result<(Vec<IdentifiableFunction>, usize), ModelError> {
    let degrees = &judged.findings.degrees;
    let shown: Vec<bool> = (0..degrees.degree.len()).map(|c| judged.shown(model, c)).collect();
    let observable = degrees.degree.iter().zip(&shown).filter(|(d, shown)| d.is_some() && **shown).count();
    let listed = symmetries.invariants.len();
    let all = judged.span.as_ref().map_or(degrees.rank(), |span| of_shown(span, &shown));
    let missing = all.saturating_sub(observable + listed);
    let Some([f, other]) = judged.fields else { return Ok((Vec::new(), missing)) };
    if missing == 0 {
        return Ok((Vec::new(), 0));
    }
    let mut search = FunctionSearch::new(model, compiled, judged, f, seed)?;
    (search.all, search.shown) = (all, shown);
    let listed: Vec<Terms> = symmetries.invariants.iter().map(terms_of).collect();
    for terms in &listed {
        let gradient = search.gradient(terms, search.first());
        search.known.insert(&gradient);
    }
    let weights = weights(symmetries);
    for family in families(judged, &search.shown) {
        if search.missing() == 0 {
            break;
        }
        let products = family.products(&weights);
        if !products.is_empty() {
            search.among(&products)?;
        }
    }
    for degree in 2..=RESTRICTED {
        for negative in [false, true] {
            if search.missing() > 0 {
                let variables = search.not_expressed(&listed);
                search.among(&ProductFamily { variables, degree, negative }.products(&weights))?;
            }
        }
    }
    if search.missing() > 0 {
        search.of_relations();
    }
    if search.missing() > 0 {
        for terms in lie_derivatives(model, compiled, judged, f) {
            search.keep(terms);
        }
    }
    let missing = search.missing();
    let found = search.verified(other)?;
    Ok((found.0, missing + found.1))
}

/// Number of independent functionals in a span that contain only the unknowns in `shown`.
fn of_shown(span: &Echelon, shown: &[bool]) -> usize {
    let hidden: Vec<usize> = (0..shown.len()).filter(|&c| !shown[c]).collect();
    let mut part = Echelon::new(span.field(), hidden.len());
    for i in 0..span.rank() {
        let row = span.row(i);
        part.insert(&hidden.iter().map(|&c| row[c]).collect::<Vec<_>>());
    }
    span.rank() - part.rank()
}

/// Invariant of the symmetries as a sum of products of powers.
pub(super) fn terms_of(i: &Invariant) -> Terms {
    match i.product {
        true => vec![(1, i.terms.iter().map(|&(c, m)| (c, m as i32)).collect())],
        false => i.terms.iter().map(|&(c, m)| (m, vec![(c, 1)])).collect(),
    }
}

/// Effect of a scaling on the unknowns, as integer exponents.
fn weights(symmetries: &Symmetries) -> Vec<Vec<(usize, i64)>> {
    let plain = symmetries.found.iter().filter(|s| s.translation.is_empty());
    let weights = plain.map(|s| {
        let numbers: Vec<(i64, i64)> = s.scaling.iter().map(|t| t.1).collect();
        s.scaling.iter().map(|t| t.0).zip(integers(&numbers)).collect()
    });
    weights.collect()
}

/// Families in the order of the search: parameters alone first, then with states, then with observable
/// unknowns; polynomials first.
fn families(judged: &Judgement, shown: &[bool]) -> Vec<ProductFamily> {
    let degrees = &judged.findings.degrees;
    let all: Vec<usize> =
        (0..judged.layout.unknowns.len()).filter(|&c| degrees.excited[c] && shown[c]).collect();
    let moved: Vec<usize> = all.iter().copied().filter(|&c| degrees.degree[c].is_none()).collect();
    let is_parameter = |c: &usize| matches!(judged.layout.unknowns[*c].role, Role::Parameter(_));
    let parameters: Vec<usize> = moved.iter().copied().filter(is_parameter).collect();
    let family = |variables: &Vec<usize>, degree, negative| {
        let variables = variables.clone();
        ProductFamily { variables, degree, negative }
    };
    vec![
        family(&parameters, 2, false),
        family(&parameters, 3, true),
        family(&parameters, 4, false),
        family(&parameters, 5, false),
        family(&moved, 2, false),
        family(&moved, 3, true),
        family(&all, 2, false),
        family(&all, 3, true),
        family(&moved, 4, true),
        family(&all, 4, false),
    ]
}

impl ProductFamily {
    /// Products of weight zero that contain at least one unknown, short ones first; none if there are too
    /// many.
    fn products(&self, weights: &[Vec<(usize, i64)>]) -> Vec<QuotientPowers> {
        let mut out: Vec<(u32, QuotientPowers)> = vec![(0, Vec::new())];
        for &v in &self.variables {
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
            let weight = |w: &Vec<(usize, i64)>| -> i64 {
                let own = |v: usize| w.iter().find(|t| t.0 == v).map_or(0, |t| t.1);
                powers.iter().map(|&(v, e)| own(v) * i64::from(e)).sum()
            };
            !powers.is_empty() && weights.iter().all(|w| weight(w) == 0)
        };
        out.retain(|p| weightless(&p.1));
        out.sort();
        let products: Vec<QuotientPowers> = out.into_iter().map(|p| p.1).collect();
        if products.len() > PRODUCTS { Vec::new() } else { products }
    }
}

/// Search at points of one field.
struct FunctionSearch<'a> {
    model: &'a SystemModel,
    compiled: &'a Compiled,
    judged: &'a Judgement,
    f: Field,
    rng: SplitMix64,
    /// Points, with the unobservable directions there.
    points: Vec<(PointDegrees<Field>, Vec<Vec<u64>>)>,
    /// Differentials of functions known to be identifiable, at the first point.
    known: Echelon,
    /// Number of independent identifiable functions of the unknowns in `shown`.
    all: usize,
    /// True for unknowns that functions may contain.
    shown: Vec<bool>,
    /// Operations so far.
    spent: Spent,
    found: Vec<IdentifiableFunction>,
}

impl<'a> FunctionSearch<'a> {
    fn new(
        model: &'a SystemModel,
        compiled: &'a Compiled,
        judged: &'a Judgement,
        f: Field,
        seed: u64,
    ) -> Result<Self, ModelError> {
        let n = judged.layout.unknowns.len();
        let rng = model.random(seed, "identifiable functions");
        let known = Echelon::new(f, n);
        let mut out = Self {
            model,
            compiled,
            judged,
            f,
            rng,
            points: Vec::new(),
            known,
            all: 0,
            shown: Vec::new(),
            spent: Spent::default(),
            found: Vec::new(),
        };
        out.draw()?;
        for c in (0..n).filter(|&c| judged.findings.degrees.degree[c].is_some() && judged.shown(model, c)) {
            let unit: Vec<u64> = (0..n).map(|j| if j == c { f.one() } else { 0 }).collect();
            out.known.insert(&unit);
        }
        Ok(out)
    }

    fn draw(&mut self) -> Result<(), ModelError> {
        let spent = &mut self.spent;
        let mut at = climb_at(self.model, self.compiled, &self.judged.layout, self.f, &mut self.rng, spent)?;
        for _ in 0..ELSEWHERE {
            // constraints that can hold in several ways have points with other verdicts
            if self.model.constraints.is_empty() || at.degrees == self.judged.findings.degrees {
                break;
            }
            at = climb_at(self.model, self.compiled, &self.judged.layout, self.f, &mut self.rng, spent)?;
        }
        let directions = at.span.null_space();
        self.points.push((at, directions));
        Ok(())
    }

    fn first(&self) -> &PointDegrees<Field> {
        &self.points[0].0
    }

    fn missing(&self) -> usize {
        self.all.saturating_sub(self.known.rank())
    }

    fn gradient(&self, terms: &[(i64, QuotientPowers)], at: &PointDegrees<Field>) -> Vec<u64> {
        gradient(&at.span.field(), self.judged.layout.unknowns.len(), terms, at)
    }

    /// Adds the functions among sums of products.
    fn among(&mut self, products: &[QuotientPowers]) -> Result<(), ModelError> {
        let f = self.f;
        let mut basis = Echelon::new(f, products.len());
        let (mut rank, mut still, mut k) = (0, 0, 0);
        while still < 2 {
            if k == POINTS || self.spent.operations > OPERATIONS {
                return Ok(());
            }
            if k == self.points.len() {
                self.draw()?;
            }
            let (at, directions) = &self.points[k];
            let inverses: Vec<u64> = at.values.iter().map(|&x| f.inv(x)).collect();
            let values: Vec<u64> = products.iter().map(|p| product(&f, p, &at.values, &inverses)).collect();
            for v in directions {
                // m sum_c e_c v_c / x_c
                let entry = |(powers, &m): (&QuotientPowers, &u64)| {
                    let along = powers.iter().fold(0, |s, &(c, e)| {
                        f.add(s, f.mul(f.from_i64(e.into()), f.mul(v[c], inverses[c])))
                    });
                    f.mul(m, along)
                };
                self.spent.operations += (products.len() * (2 + basis.rank())) as u64;
                basis.insert(&products.iter().zip(&values).map(entry).collect::<Vec<_>>());
            }
            still = if basis.rank() == rank { still + 1 } else { 0 };
            (rank, k) = (basis.rank(), k + 1);
        }
        for v in extend_by_short_vectors(&f, &basis.null_space(), &mut Echelon::new(f, products.len())) {
            if self.missing() == 0 {
                break;
            }
            let places = support(&v);
            let Some(numbers) = rationals(&f, &v).filter(|_| places.len() <= TERMS) else { continue };
            let numbers = integers(&numbers);
            self.keep(places.iter().map(|&j| (numbers[j], products[j].clone())).collect());
        }
        Ok(())
    }

    /// Adds ratios of the coefficients of relations among output derivatives.
    fn of_relations(&mut self) {
        let at = self.first().values.clone();
        let system = (self.model, self.compiled, self.judged);
        let work = &mut RemainingWork::new(RELATIONS);
        for quotient in functions_of_constants(system, (self.f, &at), &mut self.rng, work) {
            if let Some(terms) = terms_of_quotient(&self.f, &quotient) {
                self.keep(terms);
            }
        }
    }

    /// Keeps a function if it is identifiable and independent of those before it.
    fn keep(&mut self, terms: Terms) {
        if !terms.iter().flat_map(|t| &t.1).all(|p| self.shown[p.0]) {
            return;
        }
        let gradient = self.gradient(&terms, self.first());
        if let Some(degree) = self.first().degree(&gradient)
            && self.known.insert(&gradient)
        {
            self.found.push(IdentifiableFunction { terms, degree });
        }
    }

    /// Unknowns without one for each function found so far, as the function expresses it by the others.
    fn not_expressed(&self, listed: &[Terms]) -> Vec<usize> {
        let degrees = &self.judged.findings.degrees;
        let mut left: Vec<usize> =
            (0..degrees.degree.len()).filter(|&c| degrees.excited[c] && self.shown[c]).collect();
        for terms in listed.iter().chain(self.found.iter().map(|f| &f.terms)) {
            let holds = |c: usize| terms.iter().filter(|t| t.1.iter().any(|p| p.0 == c)).count();
            let alone = |c: &usize| {
                degrees.degree[*c].is_none()
                    && holds(*c) == 1
                    && terms.iter().flat_map(|t| &t.1).all(|p| p.0 != *c || p.1.abs() == 1)
            };
            if let Some(place) = left.iter().rposition(alone) {
                left.remove(place);
            }
        }
        left
    }

    /// Functions that are identifiable at a point of another field too, and the number of those that are
    /// not.
    fn verified(self, other: Field) -> Result<(Vec<IdentifiableFunction>, usize), ModelError> {
        let mut rng = self.rng.clone();
        let spent = &mut Spent::default();
        let at = climb_at(self.model, self.compiled, &self.judged.layout, other, &mut rng, spent)?;
        let all = self.found.len();
        let n = self.judged.layout.unknowns.len();
        let holds = |i: &IdentifiableFunction| at.span.contains(&gradient(&other, n, &i.terms, &at));
        let found: Vec<IdentifiableFunction> = self.found.into_iter().filter(holds).collect();
        let lost = all - found.len();
        Ok((found, lost))
    }
}

/// Value of a product of powers.
fn product(f: &Field, powers: &[(usize, i32)], values: &[u64], inverses: &[u64]) -> u64 {
    powers.iter().fold(f.one(), |x, &(c, e)| {
        let base = if e < 0 { inverses[c] } else { values[c] };
        f.mul(x, f.pow(base, e.unsigned_abs().into()))
    })
}

/// Differential of a function at a point (shape: unknowns).
fn gradient(f: &Field, n: usize, terms: &[(i64, QuotientPowers)], at: &PointDegrees<Field>) -> Vec<u64> {
    let inverses: Vec<u64> = at.values.iter().map(|&x| f.inv(x)).collect();
    let mut out = vec![0; n];
    for (number, powers) in terms {
        let m = f.mul(f.from_i64(*number), product(f, powers, &at.values, &inverses));
        for &(c, e) in powers.iter().filter(|p| p.0 < n) {
            out[c] = f.add(out[c], f.mul(f.from_i64(e.into()), f.mul(m, inverses[c])));
        }
    }
    out
}

impl IdentifiableFunction {
    /// Function in words: `S*w`, `U*w + I*w`, `beta/(N*w)`; common factors stand before brackets.
    pub(super) fn text(&self, name: &dyn Fn(usize) -> String) -> String {
        let common: QuotientPowers = match self.terms.len() {
            0 | 1 => Vec::new(),
            _ => self.terms[0]
                .1
                .iter()
                .copied()
                .filter(|p| self.terms.iter().all(|t| t.1.contains(p)))
                .collect(),
        };
        let divisor = self.terms.iter().fold(0, |g, t| gcd(g, t.0)).max(1);
        let mut sum = String::new();
        for (number, powers) in &self.terms {
            let rest: QuotientPowers = powers.iter().copied().filter(|p| !common.contains(p)).collect();
            let number = number / divisor;
            sum.push_str(match (sum.is_empty(), number < 0) {
                (true, true) => "-",
                (true, false) => "",
                (false, true) => " - ",
                (false, false) => " + ",
            });
            sum.push_str(&quotient(number.unsigned_abs(), &rest, name));
        }
        if common.is_empty() {
            return sum;
        }
        let factor = quotient(1, &common, name);
        match factor.strip_prefix("1/") {
            Some(below) => format!("({sum})/{below}"),
            None => match factor.split_once('/') {
                Some((above, below)) => format!("{above}*({sum})/{below}"),
                None => format!("{factor}*({sum})"),
            },
        }
    }
}

/// Text `2*a*b^2/(c*d)`.
fn quotient(number: u64, powers: &[(usize, i32)], name: &dyn Fn(usize) -> String) -> String {
    let power = |&(c, e): &(usize, i32)| match e.unsigned_abs() {
        1 => name(c),
        e => format!("{}^{e}", name(c)),
    };
    let mut above: Vec<String> = powers.iter().filter(|p| p.1 > 0).map(power).collect();
    if number != 1 || above.is_empty() {
        above.insert(0, number.to_string());
    }
    let below: Vec<String> = powers.iter().filter(|p| p.1 < 0).map(power).collect();
    match below.len() {
        0 => above.join("*"),
        1 => format!("{}/{}", above.join("*"), below[0]),
        _ => format!("{}/({})", above.join("*"), below.join("*")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_written_with_their_common_factors() {
        let name = |c: usize| ["w", "U", "I", "b", "N"][c].to_string();
        let text = |terms: Vec<(i64, QuotientPowers)>| IdentifiableFunction { terms, degree: 0 }.text(&name);
        assert_eq!(text(vec![(1, vec![(3, 1), (4, -1), (0, -1)])]), "b/(N*w)");
        assert_eq!(text(vec![(2, vec![(0, 1), (1, 1)]), (-4, vec![(0, 1), (2, 2)])]), "w*(U - 2*I^2)");
        assert_eq!(text(vec![(1, vec![(1, 1), (4, -1)]), (1, vec![(2, 1), (4, -1)])]), "(U + I)/N");
        assert_eq!(text(vec![(3, vec![(1, 1)]), (1, vec![])]), "3*U + 1");
    }
}

//! Identifiable functions of unknowns that are not observable: sums of products of powers that no
//! unobservable direction changes.
//!
//! `f = sum_j a_j m_j` is observable at generic points iff its differential vanishes on every unobservable
//! direction there. This is a linear system for the `a_j` from several random points, modulo a prime.
//! Rational `a_j` are reconstructed, and the result is verified modulo the other prime. A scaling symmetry
//! takes `f` to a sum of parts of one weight each, so products of weight zero suffice. What is still missing
//! is taken from ratios of the coefficients of relations among output derivatives, then sought among the
//! terms of derivatives of known functions along the motion.

use obsdeg_exact::groebner::RemainingWork;
use obsdeg_exact::{Echelon, Field, SplitMix64};

use super::addition::written_apart;
use super::error::ModelError;
use super::families::{ProductFamily, families, weights};
use super::function_factors::ModelFactors;
use super::functions::gcd;
use super::global::functions_of_constants;
use super::judge::point_degrees::{PointDegrees, climb_at};
use super::judge::verdicts::{Judgement, SystemCertainty};
use super::lie::{FactorRates, LaurentPolynomial, terms_of_quotient, variable};
use super::model::SystemModel;
use super::model::compiled::Compiled;
use super::quotients::{QuotientPowers, QuotientTerms};
use super::symmetry::{Invariant, Symmetries, integers, rationals};
use super::work::Spent;
use crate::degree::sparse::{extend_by_short_vectors, support};

/// Largest number of points.
const POINTS: usize = 250;
/// Number of points with other verdicts before one is taken nevertheless: its results do not hold at the
/// first point.
const ELSEWHERE: usize = 24;
/// Limit of operations of all points and eliminations of a search among products, and of one among
/// derivatives.
const OPERATIONS: u64 = 200_000_000;
/// Limit of the work of relations.
const RELATIONS: u64 = 200_000_000;
/// Largest number of terms of a function that is kept.
const TERMS: usize = 40;
/// Largest number of terms of a derivative among which functions are sought.
const PARTS: usize = 300;
/// Highest degree among the unknowns that the functions found before do not express.
const RESTRICTED: u32 = 4;

/// Identifiable function of unknowns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct IdentifiableFunction {
    /// Integer coefficients and products of powers.
    pub(super) terms: QuotientTerms,
    /// Observable degree of the function.
    pub(super) degree: usize,
}

/// Identifiable functions beyond the invariants of the symmetries.
pub(super) struct IdentifiableFunctions {
    pub(super) found: Vec<IdentifiableFunction>,
    /// Number of independent ones that were not found.
    pub(super) missing: usize,
    /// Factors of the functions.
    pub(super) factors: ModelFactors,
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
) -> Result<IdentifiableFunctions, ModelError> {
    let degrees = &judged.findings.degrees;
    let shown: Vec<bool> = (0..degrees.degree.len()).map(|c| judged.shown(model, c)).collect();
    let observable = degrees.degree.iter().zip(&shown).filter(|(d, shown)| d.is_some() && **shown).count();
    let missing = judged.shown_rank.saturating_sub(observable + symmetries.invariants.len());
    // values of functions in a field are independent of each other if functions of sums are written apart
    let apart = if judged.fields.is_some() { None } else { written_apart(compiled) };
    let compiled = apart.as_ref().unwrap_or(compiled);
    let Some([f, other]) = fields(judged).filter(|_| missing > 0) else {
        let factors = ModelFactors::new(model, compiled, &judged.layout);
        return Ok(IdentifiableFunctions { found: Vec::new(), missing, factors });
    };
    let mut search = FunctionSearch::new(model, compiled, judged, f, seed)?;
    (search.all, search.shown) = (judged.shown_rank, shown);
    let listed: Vec<QuotientTerms> = symmetries.invariants.iter().map(terms_of).collect();
    for terms in &listed {
        let gradient = search.gradient(terms, search.first());
        search.known.insert(&gradient);
    }
    let weights = weights(symmetries);
    for family in families(judged, &search.factors, &search.shown, &weights) {
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
                let factors = search.not_expressed(&listed);
                search.among(&ProductFamily { factors, degree, negative }.products(&weights))?;
            }
        }
    }
    if search.missing() > 0 && judged.fields.is_some() {
        search.of_relations();
    }
    if search.missing() > 0 {
        search.among_derivatives(&listed)?;
    }
    search.verified(other)
}

/// The two prime fields of the verdicts; `None` if real numbers decided.
fn fields(judged: &Judgement) -> Option<[Field; 2]> {
    match judged.certainty {
        SystemCertainty::Primes(by) => Some(by.primes.map(Field::new)),
        SystemCertainty::Digits(_) => None,
    }
}

/// Invariant of the symmetries as a sum of products of powers.
pub(super) fn terms_of(i: &Invariant) -> QuotientTerms {
    match i.product {
        true => vec![(1, i.terms.iter().map(|&(c, m)| (c, m as i32)).collect())],
        false => i.terms.iter().map(|&(c, m)| (m, vec![(c, 1)])).collect(),
    }
}

/// Search at points of one field.
struct FunctionSearch<'a> {
    model: &'a SystemModel,
    compiled: &'a Compiled,
    judged: &'a Judgement,
    factors: ModelFactors,
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
            factors: ModelFactors::new(model, compiled, &judged.layout),
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
        gradient(&at.span.field(), &self.factors, terms, at)
    }

    /// True if a function may contain the factor.
    fn is_shown(&self, factor: usize) -> bool {
        factor >= self.factors.unknowns || self.shown[factor]
    }

    /// Adds the functions among sums of products.
    fn among(&mut self, products: &[QuotientPowers]) -> Result<(), ModelError> {
        let f = self.f;
        // more conditions than points can give
        if products.len() > POINTS * self.points[0].1.len() {
            return Ok(());
        }
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
            let slopes: Vec<Option<(usize, u64)>> =
                (0..self.factors.len()).map(|c| self.factors.slope(c, &f, &at.values)).collect();
            for v in directions {
                // m sum_c e_c v_c / x_c
                let moved = |c: usize| slopes[c].map_or(0, |(unknown, slope)| f.mul(slope, v[unknown]));
                let entry = |(powers, &m): (&QuotientPowers, &u64)| {
                    let along = powers.iter().fold(0, |s, &(c, e)| {
                        f.add(s, f.mul(f.from_i64(e.into()), f.mul(moved(c), inverses[c])))
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

    /// Adds functions among the terms of derivatives along the motion: of the outputs, of observable
    /// unknowns, and of the functions found. The derivative of an identifiable function is identifiable, and
    /// so is the coefficient of every product of inputs in it.
    fn among_derivatives(&mut self, listed: &[QuotientTerms]) -> Result<(), ModelError> {
        self.spent = Spent::default();
        for experiment in 0..self.model.experiments.max(1) {
            let system = (self.model, self.compiled, self.judged);
            let motion = FactorRates::new(system, &self.factors, self.f, experiment);
            self.among_derivatives_along(&motion, listed)?;
        }
        Ok(())
    }

    fn among_derivatives_along(
        &mut self,
        motion: &FactorRates,
        listed: &[QuotientTerms],
    ) -> Result<(), ModelError> {
        let degrees = &self.judged.findings.degrees.degree;
        let observable = (0..degrees.len()).filter(|&c| degrees[c].is_some() && self.shown[c]);
        let mut open: Vec<LaurentPolynomial> = observable.map(|c| variable(&self.f, c)).collect();
        open.extend(listed.iter().map(|terms| motion.polynomial(terms)));
        for output in &motion.outputs {
            for part in motion.coefficients(output) {
                self.among_terms(&part)?;
                open.push(part);
            }
        }
        let mut taken = 0;
        while self.missing() > 0 {
            open.extend(self.found[taken..].iter().map(|found| motion.polynomial(&found.terms)));
            taken = self.found.len();
            let Some(shortest) = (0..open.len()).min_by_key(|&i| open[i].len()) else { break };
            let Some(derivative) = motion.derivative(&open.remove(shortest)) else { continue };
            for part in motion.coefficients(&derivative) {
                self.among_terms(&part)?;
            }
        }
        Ok(())
    }

    /// Adds functions among the terms of a polynomial.
    fn among_terms(&mut self, p: &LaurentPolynomial) -> Result<(), ModelError> {
        let products: Vec<QuotientPowers> = p.keys().filter(|powers| !powers.is_empty()).cloned().collect();
        let is_shown = products.iter().flatten().all(|p| self.is_shown(p.0));
        if self.missing() == 0 || products.is_empty() || products.len() > PARTS || !is_shown {
            return Ok(());
        }
        self.among(&products)
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
    fn keep(&mut self, mut terms: QuotientTerms) {
        // known factors of all terms say nothing
        let known = common_factor(&terms).into_iter().filter(|p| self.factors.unknown(p.0).is_none());
        let known: QuotientPowers = known.collect();
        terms.iter_mut().for_each(|t| t.1 = without(&t.1, &known));
        if !terms.iter().flat_map(|t| &t.1).all(|p| self.is_shown(p.0)) {
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
    fn not_expressed(&self, listed: &[QuotientTerms]) -> Vec<usize> {
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

    /// Functions that are identifiable at a point of another field too; the others count as missing.
    fn verified(self, other: Field) -> Result<IdentifiableFunctions, ModelError> {
        let mut rng = self.rng.clone();
        let spent = &mut Spent::default();
        let at = climb_at(self.model, self.compiled, &self.judged.layout, other, &mut rng, spent)?;
        let all = self.missing() + self.found.len();
        let holds =
            |i: &IdentifiableFunction| at.span.contains(&gradient(&other, &self.factors, &i.terms, &at));
        let found: Vec<IdentifiableFunction> = self.found.into_iter().filter(holds).collect();
        let missing = all - found.len();
        Ok(IdentifiableFunctions { found, missing, factors: self.factors })
    }
}

/// Powers that divide all terms.
fn common_factor(terms: &QuotientTerms) -> QuotientPowers {
    let Some((first, others)) = terms.split_first() else { return Vec::new() };
    let smallest = |&(c, e): &(usize, i32)| {
        let exponents = others.iter().map(|t| t.1.iter().find(|p| p.0 == c).map_or(0, |p| p.1));
        let least = exponents.map(|x| x * e.signum()).fold(e.abs(), i32::min);
        (least > 0).then(|| (c, least * e.signum()))
    };
    first.1.iter().filter_map(smallest).collect()
}

/// Product of powers divided by another one.
fn without(powers: &[(usize, i32)], divisor: &[(usize, i32)]) -> QuotientPowers {
    let own = |c: usize| divisor.iter().find(|p| p.0 == c).map_or(0, |p| p.1);
    powers.iter().map(|&(c, e)| (c, e - own(c))).filter(|p| p.1 != 0).collect()
}

/// Value of a product of powers.
fn product(f: &Field, powers: &[(usize, i32)], values: &[u64], inverses: &[u64]) -> u64 {
    powers.iter().fold(f.one(), |x, &(c, e)| {
        let base = if e < 0 { inverses[c] } else { values[c] };
        f.mul(x, f.pow(base, e.unsigned_abs().into()))
    })
}

/// Differential of a function at a point (shape: unknowns).
fn gradient(
    f: &Field,
    factors: &ModelFactors,
    terms: &[(i64, QuotientPowers)],
    at: &PointDegrees<Field>,
) -> Vec<u64> {
    let inverses: Vec<u64> = at.values.iter().map(|&x| f.inv(x)).collect();
    let mut out = vec![0; factors.unknowns];
    for (number, powers) in terms {
        let m = f.mul(f.from_i64(*number), product(f, powers, &at.values, &inverses));
        for &(c, e) in powers {
            let Some((unknown, slope)) = factors.slope(c, f, &at.values) else { continue };
            let along = f.mul(f.from_i64(e.into()), f.mul(m, inverses[c]));
            out[unknown] = f.add(out[unknown], f.mul(slope, along));
        }
    }
    out
}

impl IdentifiableFunction {
    /// Function in words: `S*w`, `U*w + I*w`, `beta/(N*w)`; common factors stand before brackets.
    pub(super) fn text(&self, name: &dyn Fn(usize) -> String) -> String {
        let common = if self.terms.len() > 1 { common_factor(&self.terms) } else { Vec::new() };
        let divisor = self.terms.iter().fold(0, |g, t| gcd(g, t.0)).max(1);
        let mut sum = String::new();
        for (number, powers) in &self.terms {
            let rest = without(powers, &common);
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
        assert_eq!(text(vec![(1, vec![(0, 1), (1, 1)]), (1, vec![(0, 2)])]), "w*(U + w)");
        assert_eq!(
            text(vec![(1, vec![(3, 1), (4, -2)]), (1, vec![(4, -1)]), (1, vec![(4, -3)])]),
            "(b/N + 1 + 1/N^2)/N"
        );
        assert_eq!(text(vec![(1, vec![(1, 1), (4, -1)]), (1, vec![(2, 1), (4, -1)])]), "(U + I)/N");
        assert_eq!(text(vec![(3, vec![(1, 1)]), (1, vec![])]), "3*U + 1");
    }
}

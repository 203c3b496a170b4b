//! Scaling and translation symmetries: directions `c_i x_i + d_i` with rational `c_i`, `d_i` that no output
//! sees, at any point.

use obsdeg_exact::{Reals, RowSpace};

use super::error::ModelError;
use super::functions::gcd;
use super::judge::{At, Judgement, climb_at};
use super::model::{Compiled, SystemModel};
use super::values::Values;
use super::work::{Spent, WorkLimit, product};
use crate::degree::sparse::{extend_by_short_vectors, products_of_short_vectors, support_in};

/// Points at which a direction must vanish, at most.
const POINTS: usize = 8;
/// Points with other verdicts, where constraints hold in several ways, before no more are drawn.
const ELSEWHERE: usize = 24;
/// Most unknowns among which directions that are polynomials in them are sought.
const MOVED: usize = 16;
/// Verdicts on changes for which work is left, where they take no more than a tenth of it.
const RESERVED: u64 = 40;
/// Points that these take, at most.
const POLYNOMIAL_POINTS: usize = 400;
/// Their highest degree.
pub const POLYNOMIAL_DEGREE: usize = 4;

/// A rational coefficient of an unknown.
pub(crate) type Term = (usize, (i64, i64));

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

/// The factors of a product, and its rational coefficient.
pub(crate) type PolynomialTerm = (Vec<usize>, (i64, i64));

/// A direction whose components are polynomials in the unknowns and the known constants:
/// `(unknown, [(factors, coefficient)])`; a factor is an unknown or a known constant (counted on behind the
/// unknowns).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PolynomialDirection {
    /// Of every unknown that it moves.
    pub components: Vec<(usize, Vec<PolynomialTerm>)>,
}

/// The symmetries of a system, and the invariant combinations that they leave observable.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Symmetries {
    /// Independent ones.
    pub found: Vec<Symmetry>,
    /// Directions beyond these that are polynomials in the unknowns: turns, for instance.
    pub polynomial: Vec<PolynomialDirection>,
    /// What each direction beyond all of these moves: of unobservable directions among unknowns that are
    /// excited.
    pub unexplained: Vec<Vec<usize>>,
    /// Observable combinations of unobservable unknowns.
    pub invariants: Vec<Invariant>,
    /// Where the search ended before its end: what was too much, and the option that allows more.
    pub stopped: Option<String>,
    /// Operations of the points of the search.
    pub(super) work: u64,
}

/// Operations that a search for symmetries may still take: all points together as many as one verdict, and
/// all searches for short vectors as many again.
struct Budget {
    limit: WorkLimit,
    /// Operations that the changes that are tried afterwards may need.
    reserved: u64,
    spent: u64,
    /// Operations of the searches for short vectors.
    short: u64,
    /// True once something was refused.
    over: bool,
}

impl Budget {
    /// Counts operations before they are done; false if they are beyond the limit.
    fn spend(&mut self, operations: u64) -> bool {
        let most = self.limit.operations().saturating_sub(self.reserved);
        self.over |= self.spent.saturating_add(operations) > most;
        if !self.over {
            self.spent += operations;
        }
        !self.over
    }

    /// Puts a row into a space, and counts what that took beyond an elimination; false if it is beyond the
    /// limit.
    fn insert<S: Values>(&mut self, space: &mut S::Space, row: &[S::Element]) -> bool {
        let before = space.refined();
        space.insert(row);
        self.spend((space.refined() - before).saturating_mul(product::<S::Element>()))
    }

    /// Independent vectors of the span of `rows` as short as possible, beyond what `span` holds; none where
    /// they are beyond the limit. `from` is the space that the rows are from.
    fn short_vectors<S: Values>(
        &mut self,
        f: &S,
        rows: &[Vec<S::Element>],
        from: &S::Space,
        span: &mut S::Space,
    ) -> Vec<Vec<S::Element>> {
        // what was made anew there is made anew here, row by row
        let again = if from.refined() > 0 { rows.len() as u64 } else { 1 };
        let products = products_of_short_vectors(rows.len(), span.columns()).saturating_mul(again);
        let short = self.short.saturating_add(products.saturating_mul(product::<S::Element>()));
        if short > self.limit.operations() {
            self.over = true;
            return Vec::new();
        }
        self.short = short;
        extend_by_short_vectors(f, rows, span)
    }

    /// Why the search ended.
    fn stopped(&self) -> Option<String> {
        let limit = self.limit.0;
        self.over.then(|| {
            format!(
                "not all symmetries were sought: with the changes tried after it the search takes more operations than one verdict may, beyond \
                 --work-limit {limit} ({:.1e} operations); a larger --work-limit allows more",
                self.limit.operations() as f64
            )
        })
    }
}

/// Operations of a point and of the elimination of its rows, `columns` numbers each.
fn cost_of_point<S: Values>(verdict: u64, rows: usize, columns: usize) -> u64 {
    let [rows, columns] = [rows, columns].map(|n| n as u64);
    let elimination =
        rows.saturating_mul(columns).saturating_mul(columns).saturating_mul(product::<S::Element>());
    verdict.saturating_add(elimination)
}

/// The vector as small rationals, one at its first entry.
pub(super) fn rationals<S: Values>(f: &S, v: &[S::Element]) -> Option<Vec<(i64, i64)>> {
    let lead = v.iter().find(|x| !f.is_zero(x))?;
    let inverse = f.inverse(lead)?;
    v.iter().map(|x| f.rational(&f.mul(x, &inverse))).collect()
}

/// Rationals times their common denominator.
pub(super) fn integers(v: &[(i64, i64)]) -> Vec<i64> {
    let common = v.iter().filter(|x| x.0 != 0).fold(1, |l, x| l / gcd(l, x.1) * x.1);
    let scaled: Vec<i64> = v.iter().map(|x| x.0 * (common / x.1)).collect();
    let divisor = scaled.iter().fold(0, |g, x| gcd(g, *x)).max(1);
    scaled.iter().map(|x| x / divisor).collect()
}

/// The symmetries of a judged model: of a rational one in a prime field, of one with functions in many
/// digits.
///
/// # Errors
/// [`ModelError`] when a point cannot be had.
pub fn symmetries(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    seed: u64,
) -> Result<Symmetries, ModelError> {
    match judged.fields {
        Some([field, _]) => symmetries_in(field, model, compiled, judged, seed),
        None => symmetries_in(Reals::<8>, model, compiled, judged, seed),
    }
}

fn symmetries_in<S: Values>(
    f: S,
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    seed: u64,
) -> Result<Symmetries, ModelError> {
    let n = judged.layout.unknowns.len();
    let excited = &judged.findings.degrees.excited;
    let silent = excited.iter().filter(|e| !**e).count();
    let defect = n - judged.findings.degrees.rank() - silent;
    if defect == 0 {
        return Ok(Symmetries::default());
    }
    let mut rng = model.random(seed, "symmetries");
    let space = |columns: usize| <S::Space as RowSpace>::new(f.clone(), columns);
    let mut basis = space(2 * n);
    // an unknown that no output sees is said so by itself; an observable one never moves
    for c in (0..n).filter(|&c| !excited[c] || judged.findings.degrees.degree[c].is_some()) {
        for column in [c, n + c] {
            let unit: Vec<_> = (0..2 * n).map(|j| if j == column { f.one() } else { f.zero() }).collect();
            basis.insert(&unit);
        }
    }
    let (mut last, mut at): (usize, Option<At<S>>) = (0, None);
    let rank = judged.findings.degrees.rank();
    let reserved = judged.work.saturating_mul(RESERVED).min(model.work_limit.operations() / 10);
    let mut budget = Budget { limit: model.work_limit, reserved, spent: 0, short: 0, over: false };
    // a verdict rests on two points
    let mut verdict = judged.work / 2;
    // constraints that hold in several ways have points with other verdicts
    let alike = |at: &At<S>| model.constraints.is_empty() || at.degrees == judged.findings.degrees;
    let (mut point, mut elsewhere) = (0, 0);
    while point < POINTS && elsewhere < ELSEWHERE {
        if !budget.spend(cost_of_point::<S>(verdict, rank, 2 * n)) {
            break;
        }
        let mut spent = Spent::default();
        let here = climb_at(model, compiled, &judged.layout, f.clone(), &mut rng, &mut spent)?;
        if !alike(&here) {
            elsewhere += 1;
            continue;
        }
        for i in 0..here.span.rank() {
            let row = here.span.row(i);
            let scaled = row.iter().zip(&here.values).map(|(r, x)| f.mul(r, x));
            let both: Vec<_> = scaled.chain(row.iter().copied()).collect();
            if !budget.insert::<S>(&mut basis, &both) {
                break;
            }
        }
        verdict = spent.operations;
        at = Some(here);
        if point >= 2 && basis.rank() == last {
            break;
        }
        last = basis.rank();
        point += 1;
    }
    let Some(at) = at else {
        return Ok(Symmetries { stopped: budget.stopped(), work: budget.spent, ..Symmetries::default() });
    };
    let mut tangents = space(n);
    let mut out = Symmetries::default();
    let short = match !budget.over && basis.gap().is_decisive(S::BITS) {
        true => budget.short_vectors(&f, &basis.null_space(), &basis, &mut space(2 * n)),
        false => Vec::new(),
    };
    for v in short {
        let tangent: Vec<_> = (0..n).map(|c| f.add(&f.mul(&v[c], &at.values[c]), &v[n + c])).collect();
        let Some(k) = rationals(&f, &v).filter(|_| tangents.insert(&tangent)) else { continue };
        let terms = |half: &[(i64, i64)]| -> Vec<Term> {
            half.iter().copied().enumerate().filter(|(_, k)| k.0 != 0).collect()
        };
        out.found.push(Symmetry { scaling: terms(&k[..n]), translation: terms(&k[n..]) });
    }
    if out.found.len() < defect {
        let moved: Vec<usize> =
            (0..n).filter(|&c| excited[c] && judged.findings.degrees.degree[c].is_none()).collect();
        let mut draw = |budget: &mut Budget, columns: usize| {
            for _ in 0..=ELSEWHERE {
                if !budget.spend(cost_of_point::<S>(verdict, rank, columns)) {
                    break;
                }
                let mut spent = Spent::default();
                let here = climb_at(model, compiled, &judged.layout, f.clone(), &mut rng, &mut spent)?;
                if alike(&here) {
                    return Ok(Some(here));
                }
            }
            Ok(None)
        };
        // constants that every segment and experiment shares may be factors too
        let changed =
            model.segments.iter().map(|s| &s.constants).chain(model.own.iter().map(|e| &e.constants));
        let changed: Vec<&String> = changed.flatten().map(|(name, _)| name).collect();
        let shared = |name: &String| !changed.contains(&name);
        let constants = model.constants.iter().enumerate().filter(|(_, c)| shared(&c.0.name));
        let unknowns = if n <= MOVED { (0..n).collect() } else { moved.clone() };
        let factors: Vec<usize> = unknowns.into_iter().chain(constants.map(|(i, _)| n + i)).collect();
        for degree in 1..=POLYNOMIAL_DEGREE {
            let products = products(&factors, degree);
            if out.found.len() + out.polynomial.len() == defect
                || moved.len() > MOVED
                || moved.len() * products.len() > S::COEFFICIENTS
            {
                break;
            }
            out.polynomial.extend(directions(
                &f,
                &moved,
                &products,
                &mut tangents,
                &at,
                (&mut budget, &mut draw),
            )?);
        }
    }
    if out.found.len() + out.polynomial.len() < defect {
        let among_excited = |v: &Vec<S::Element>| support_in(&f, v).iter().all(|&c| excited[c]);
        let rest: Vec<Vec<S::Element>> = at.span.null_space().into_iter().filter(among_excited).collect();
        let moving = budget.short_vectors(&f, &rest, &at.span, &mut tangents);
        out.unexplained = moving.iter().map(|v| support_in(&f, v)).collect();
    }
    out.invariants = invariants(&f, n, &out.found, &at, &mut budget);
    (out.stopped, out.work) = (budget.stopped(), budget.spent);
    Ok(out)
}

/// All products of up to `degree` of the factors.
fn products(factors: &[usize], degree: usize) -> Vec<Vec<usize>> {
    let mut out: Vec<Vec<usize>> = vec![Vec::new()];
    let mut last = 0;
    for _ in 0..degree {
        let end = out.len();
        for i in last..end {
            let from = out[i].last().and_then(|l| factors.iter().position(|f| f == l)).unwrap_or(0);
            let longer = factors[from..].iter().map(|&f| [&out[i][..], &[f]].concat());
            let longer: Vec<_> = longer.collect();
            out.extend(longer);
        }
        last = end;
    }
    out
}

/// A verdict at one more random point, for rows of this many columns; none once the work is used up.
type Draw<'a, S> = dyn FnMut(&mut Budget, usize) -> Result<Option<At<S>>, ModelError> + 'a;

/// Directions `v_i = sum_j a_ij m_j` over the unknowns that move, m_j products of unknowns and known
/// constants: a linear system for the a_ij from rows at several points, which `draw` makes as long as work is
/// left.
fn directions<S: Values>(
    f: &S,
    moved: &[usize],
    products: &[Vec<usize>],
    tangents: &mut S::Space,
    at: &At<S>,
    (budget, draw): (&mut Budget, &mut Draw<'_, S>),
) -> Result<Vec<PolynomialDirection>, ModelError> {
    let width = products.len();
    let value =
        |at: &At<S>, product: &Vec<usize>| product.iter().fold(f.one(), |x, &j| f.mul(&x, &at.values[j]));
    let space = |columns: usize| <S::Space as RowSpace>::new(f.clone(), columns);
    let mut basis = space(moved.len() * width);
    let (mut rank, mut still) = (0, 0);
    for _ in 0..POLYNOMIAL_POINTS {
        let Some(here) = draw(budget, moved.len() * width)? else { break };
        let values: Vec<S::Element> = products.iter().map(|p| value(&here, p)).collect();
        for i in 0..here.span.rank() {
            let row = here.span.row(i);
            let entries = moved.iter().flat_map(|&m| values.iter().map(move |x| f.mul(&row[m], x)));
            if !budget.insert::<S>(&mut basis, &entries.collect::<Vec<_>>()) {
                return Ok(Vec::new());
            }
        }
        still = if basis.rank() == rank { still + 1 } else { 0 };
        if still == 2 {
            break;
        }
        rank = basis.rank();
    }
    if still < 2 || !basis.gap().is_decisive(S::BITS) {
        return Ok(Vec::new());
    }
    let here: Vec<S::Element> = products.iter().map(|p| value(at, p)).collect();
    let mut out = Vec::new();
    for v in budget.short_vectors(f, &basis.null_space(), &basis, &mut space(moved.len() * width)) {
        let mut tangent = vec![f.zero(); tangents.columns()];
        for (part, &m) in v.chunks_exact(width).zip(moved) {
            tangent[m] = f.dot(&f.zero(), part.iter().zip(&here));
        }
        let Some(k) = rationals(f, &v).filter(|_| tangents.insert(&tangent)) else { continue };
        let component = |(part, &m): (&[(i64, i64)], &usize)| {
            let terms = products.iter().cloned().zip(part.iter().copied());
            let terms: Vec<_> = terms.filter(|(_, k)| k.0 != 0).collect();
            (!terms.is_empty()).then_some((m, terms))
        };
        let components = k.chunks_exact(width).zip(moved).filter_map(component).collect();
        out.push(PolynomialDirection { components });
    }
    Ok(out)
}

/// Products of powers that every scaling leaves alone, and sums that every translation does, as far as they
/// are observable.
fn invariants<S: Values>(
    f: &S,
    n: usize,
    found: &[Symmetry],
    at: &At<S>,
    budget: &mut Budget,
) -> Vec<Invariant> {
    let mut out = Vec::new();
    let scalings: Vec<&Symmetry> = found.iter().filter(|s| s.translation.is_empty()).collect();
    let translations: Vec<&Symmetry> = found.iter().filter(|s| s.scaling.is_empty()).collect();
    for (product, list) in [(true, scalings), (false, translations)] {
        let terms = |s: &Symmetry| if product { s.scaling.clone() } else { s.translation.clone() };
        let space = || <S::Space as RowSpace>::new(f.clone(), n);
        let mut rows = space();
        let mut moved = vec![false; n];
        for s in &list {
            let mut row = vec![f.zero(); n];
            for (c, (p, q)) in terms(s) {
                row[c] = f.inverse(&f.integer(q)).map_or(f.zero(), |below| f.mul(&f.integer(p), &below));
                moved[c] = true;
            }
            rows.insert(&row);
        }
        // the null vectors of what is not moved are units
        let kept: Vec<Vec<S::Element>> =
            rows.null_space().into_iter().filter(|v| support_in(f, v).iter().all(|&c| moved[c])).collect();
        for m in budget.short_vectors(f, &kept, &rows, &mut space()) {
            let Some(k) = rationals(f, &m) else { continue };
            let exponents = integers(&k);
            // d(prod x^m) = prod x^m sum m_i dx_i / x_i
            let factor = |x| if product { f.inverse(x) } else { Some(f.one()) };
            let gradient: Option<Vec<S::Element>> = (exponents.iter().zip(&at.values))
                .map(|(&m, x)| if m == 0 { Some(f.zero()) } else { Some(f.mul(&f.integer(m), &factor(x)?)) })
                .collect();
            if let Some(degree) = gradient.and_then(|g| at.degree(&g)) {
                let terms = exponents.iter().copied().enumerate().filter(|t| t.1 != 0).collect();
                out.push(Invariant { terms, product, degree });
            }
        }
    }
    out
}

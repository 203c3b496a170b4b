//! Scaling and translation symmetries: directions `c_i x_i + d_i` with rational `c_i`, `d_i` that change no
//! output, at any point.

use obsdeg_exact::{Reals, RowSpace};

use super::error::ModelError;
use super::functions::gcd;
use super::judge::{Judgement, PointDegrees, climb_at};
use super::model::{Compiled, SystemModel};
use super::values::Values;
use super::work::{Spent, WorkLimit, product};
use crate::degree::sparse::{extend_by_short_vectors, products_of_short_vectors, support_in};

/// Largest number of points at which a direction must vanish.
const POINTS: usize = 8;
/// Number of points with other verdicts, if constraints hold in several ways, before no more are drawn.
const ELSEWHERE: usize = 24;
/// Largest number of unknowns among which polynomial directions are sought.
const MOVED: usize = 16;
/// Number of verdicts on changes for which work is reserved, if they take at most a tenth of it.
const RESERVED: u64 = 40;
/// Largest number of points of polynomial directions.
const POLYNOMIAL_POINTS: usize = 400;
/// Highest degree of polynomial directions.
pub const POLYNOMIAL_DEGREE: usize = 4;

/// Rational coefficient of an unknown.
pub(crate) type RationalTerm = (usize, (i64, i64));

/// Direction that changes no output: `x_i` grows by `c_i x_i + d_i`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symmetry {
    /// Coefficients `c_i` other than zero.
    pub scaling: Vec<RationalTerm>,
    /// Constants `d_i` other than zero.
    pub translation: Vec<RationalTerm>,
}

/// Invariant of the symmetries: a product of powers, or a sum.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invariant {
    /// Integer exponents of a product, or coefficients of a sum.
    pub terms: Vec<(usize, i64)>,
    /// True for a product of powers, false for a sum.
    pub product: bool,
    /// Observable degree of the invariant.
    pub degree: usize,
}

/// Factors of a product, and its rational coefficient.
pub(crate) type PolynomialTerm = (Vec<usize>, (i64, i64));

/// Direction whose components are polynomials in the unknowns and the known constants:
/// `(unknown, [(factors, coefficient)])`. A factor is an unknown or a known constant (numbered after the
/// unknowns).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PolynomialDirection {
    /// Component of every unknown that the direction changes.
    pub components: Vec<(usize, Vec<PolynomialTerm>)>,
}

/// Symmetries of a system, and the invariant combinations that remain observable.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Symmetries {
    /// Independent scalings and translations.
    pub found: Vec<Symmetry>,
    /// Polynomial directions beyond these: rotations, for instance.
    pub polynomial: Vec<PolynomialDirection>,
    /// Unknowns that each remaining unobservable direction changes, among excited unknowns.
    pub unexplained: Vec<Vec<usize>>,
    /// Observable combinations of unobservable unknowns.
    pub invariants: Vec<Invariant>,
    /// Reason why the search ended early: the exceeded limit, and the option that allows more; `None` if it
    /// was complete.
    pub stopped: Option<String>,
    /// Operations of the points of the search.
    pub(super) work: u64,
}

/// Operations that remain for a search for symmetries: all points together take at most the limit of one
/// verdict, and all searches for short vectors as much again.
struct Budget {
    limit: WorkLimit,
    /// Operations that are reserved for the changes that are tried afterwards.
    reserved: u64,
    spent: u64,
    /// Operations that remain for the searches for short vectors.
    short: u64,
    /// True once an operation was refused.
    over: bool,
}

impl Budget {
    /// Counts operations before they are done; false if they exceed the limit.
    fn spend(&mut self, operations: u64) -> bool {
        let most = self.limit.operations().saturating_sub(self.reserved);
        self.over |= self.spent.saturating_add(operations) > most;
        if !self.over {
            self.spent += operations;
        }
        !self.over
    }

    /// Inserts a row into a space, and counts the work beyond an elimination; false if it exceeds the limit.
    fn insert<S: Values>(&mut self, space: &mut S::Space, row: &[S::Element]) -> bool {
        let before = space.refined();
        space.insert(row);
        self.spend((space.refined() - before).saturating_mul(product::<S::Element>()))
    }

    /// Independent vectors of the span of `rows`, as short as possible, outside of `span`; empty if they
    /// exceed the limit. `from` is the space of the rows.
    fn short_vectors<S: Values>(
        &mut self,
        f: &S,
        rows: &[Vec<S::Element>],
        from: &S::Space,
        span: &mut S::Space,
    ) -> Vec<Vec<S::Element>> {
        // rows that were recomputed there are recomputed here, row by row
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

    /// Reason why the search ended; `None` if it did not end early.
    fn stopped(&self) -> Option<String> {
        let limit = self.limit.0;
        self.over.then(|| {
            format!(
                "not all symmetries were sought: with the changes tried after it the search takes more \
                 operations than one verdict may, beyond --work-limit {limit} ({:.1e} operations); a \
                 larger --work-limit allows more",
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

/// Vector as small rationals, scaled to one at its first non-zero entry.
pub(super) fn rationals<S: Values>(f: &S, v: &[S::Element]) -> Option<Vec<(i64, i64)>> {
    let lead = v.iter().find(|x| !f.is_zero(x))?;
    let inverse = f.inverse(lead)?;
    v.iter().map(|x| f.rational(&f.mul(x, &inverse))).collect()
}

/// Rationals multiplied by their common denominator.
pub(super) fn integers(v: &[(i64, i64)]) -> Vec<i64> {
    let common = v.iter().filter(|x| x.0 != 0).fold(1, |l, x| l / gcd(l, x.1) * x.1);
    let scaled: Vec<i64> = v.iter().map(|x| x.0 * (common / x.1)).collect();
    let divisor = scaled.iter().fold(0, |g, x| gcd(g, *x)).max(1);
    scaled.iter().map(|x| x / divisor).collect()
}

/// Symmetries of a judged model: in a prime field for a rational one, in many digits for one with functions.
///
/// # Errors
/// [`ModelError`] if no point is found.
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
    // an unknown that is not excited is reported separately; an observable one never changes
    for c in (0..n).filter(|&c| !excited[c] || judged.findings.degrees.degree[c].is_some()) {
        for column in [c, n + c] {
            let unit: Vec<_> = (0..2 * n).map(|j| if j == column { f.one() } else { f.zero() }).collect();
            basis.insert(&unit);
        }
    }
    let (mut last, mut at): (usize, Option<PointDegrees<S>>) = (0, None);
    let rank = judged.findings.degrees.rank();
    let reserved = judged.work.saturating_mul(RESERVED).min(model.work_limit.operations() / 10);
    let mut budget = Budget { limit: model.work_limit, reserved, spent: 0, short: 0, over: false };
    // a verdict takes two points
    let mut verdict = judged.work / 2;
    // constraints that can hold in several ways have points with other verdicts
    let alike = |at: &PointDegrees<S>| model.constraints.is_empty() || at.degrees == judged.findings.degrees;
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
        let terms = |half: &[(i64, i64)]| -> Vec<RationalTerm> {
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
        // constants that all segments and experiments share may be factors too
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

/// Draws one more random point with its verdict, for rows of this many columns; `None` once the work is used
/// up.
type Draw<'a, S> = dyn FnMut(&mut Budget, usize) -> Result<Option<PointDegrees<S>>, ModelError> + 'a;

/// Directions `v_i = sum_j a_ij m_j` over the unknowns that change, with m_j products of unknowns and known
/// constants. The a_ij solve a linear system of rows at several points, which `draw` provides as long as
/// work remains.
fn directions<S: Values>(
    f: &S,
    moved: &[usize],
    products: &[Vec<usize>],
    tangents: &mut S::Space,
    at: &PointDegrees<S>,
    (budget, draw): (&mut Budget, &mut Draw<'_, S>),
) -> Result<Vec<PolynomialDirection>, ModelError> {
    let width = products.len();
    let value = |at: &PointDegrees<S>, product: &Vec<usize>| {
        product.iter().fold(f.one(), |x, &j| f.mul(&x, &at.values[j]))
    };
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

/// Products of powers that every scaling leaves unchanged, and sums that every translation leaves unchanged,
/// as far as they are observable.
fn invariants<S: Values>(
    f: &S,
    n: usize,
    found: &[Symmetry],
    at: &PointDegrees<S>,
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
        // null vectors of unknowns that do not change are unit vectors
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

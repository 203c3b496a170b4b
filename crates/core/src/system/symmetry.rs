//! Scaling and translation symmetries: directions `c_i x_i + d_i` with rational `c_i`, `d_i` that change no
//! output, at any point.

use obsdeg_exact::{Reals, RowSpace, SplitMix64};

use super::error::ModelError;
use super::functions::gcd;
use super::judge::point_degrees::{PointDegrees, climb_at};
use super::judge::verdicts::Judgement;
use super::model::SystemModel;
use super::model::compiled::{Compiled, Role};
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
struct WorkBudget {
    limit: WorkLimit,
    /// Operations that are reserved for the changes that are tried afterwards.
    reserved: u64,
    spent: u64,
    /// Operations that remain for the searches for short vectors.
    short: u64,
    /// True once an operation was refused.
    over: bool,
}

impl WorkBudget {
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
    let mut search = SymmetrySearch::new(f, model, compiled, judged, seed);
    let mut basis = search.still_unknowns();
    let Some(at) = search.sample(&mut basis)? else {
        let (stopped, work) = (search.budget.stopped(), search.budget.spent);
        return Ok(Symmetries { stopped, work, ..Symmetries::default() });
    };
    let mut tangents = search.space(n);
    let mut out = Symmetries { found: search.linear(&basis, &at, &mut tangents), ..Symmetries::default() };
    if out.found.len() < defect {
        out.polynomial = search.polynomial(defect - out.found.len(), &at, &mut tangents)?;
    }
    if out.found.len() + out.polynomial.len() < defect {
        out.unexplained = search.unexplained(&at, &mut tangents);
    }
    let is_parameter: Vec<bool> =
        judged.layout.unknowns.iter().map(|u| matches!(u.role, Role::Parameter(_))).collect();
    out.invariants = invariants(&search.f, &is_parameter, &out.found, &at, &mut search.budget);
    out.invariants.retain(|i| i.terms.iter().all(|t| judged.shown(model, t.0)));
    (out.stopped, out.work) = (search.budget.stopped(), search.budget.spent);
    Ok(out)
}

/// Search for the symmetries of a judged model in a field.
struct SymmetrySearch<'a, S: Values> {
    f: S,
    model: &'a SystemModel,
    compiled: &'a Compiled,
    judged: &'a Judgement,
    rng: SplitMix64,
    budget: WorkBudget,
    /// Operations of a point.
    point_work: u64,
}

impl<'a, S: Values> SymmetrySearch<'a, S> {
    fn new(f: S, model: &'a SystemModel, compiled: &'a Compiled, judged: &'a Judgement, seed: u64) -> Self {
        let reserved = judged.work.saturating_mul(RESERVED).min(model.work_limit.operations() / 10);
        Self {
            f,
            model,
            compiled,
            judged,
            rng: model.random(seed, "symmetries"),
            budget: WorkBudget { limit: model.work_limit, reserved, spent: 0, short: 0, over: false },
            // a verdict takes two points
            point_work: judged.work / 2,
        }
    }

    /// Number of unknowns.
    fn unknowns(&self) -> usize {
        self.judged.layout.unknowns.len()
    }

    fn space(&self, columns: usize) -> S::Space {
        <S::Space as RowSpace>::new(self.f.clone(), columns)
    }

    /// True if an unknown can change without a change of an output: it is excited and not observable.
    fn can_move(&self, unknown: usize) -> bool {
        let degrees = &self.judged.findings.degrees;
        degrees.excited[unknown] && degrees.degree[unknown].is_none()
    }

    /// Unit vectors of the scalings and translations of unknowns that do not change.
    fn still_unknowns(&self) -> S::Space {
        let (f, n) = (&self.f, self.unknowns());
        let mut basis = self.space(2 * n);
        // an unknown that is not excited is reported separately; an observable one never changes
        for c in (0..n).filter(|&c| !self.can_move(c)) {
            for column in [c, n + c] {
                let unit: Vec<_> = (0..2 * n).map(|j| if j == column { f.one() } else { f.zero() }).collect();
                basis.insert(&unit);
            }
        }
        basis
    }

    /// True if a point has the verdicts of the model. Constraints that can hold in several ways have points
    /// with other verdicts.
    fn is_alike(&self, at: &PointDegrees<S>) -> bool {
        self.model.constraints.is_empty() || at.degrees == self.judged.findings.degrees
    }

    /// Random point with its verdict, and the operations that it took.
    fn point(&mut self) -> Result<(PointDegrees<S>, u64), ModelError> {
        let mut spent = Spent::default();
        let layout = &self.judged.layout;
        let here = climb_at(self.model, self.compiled, layout, self.f.clone(), &mut self.rng, &mut spent)?;
        Ok((here, spent.operations))
    }

    /// Adds the conditions on scalings and translations at random points to `basis`, until a point adds
    /// nothing. Returns the last point; `None` if the work allows none.
    fn sample(&mut self, basis: &mut S::Space) -> Result<Option<PointDegrees<S>>, ModelError> {
        let f = self.f.clone();
        let (n, rank) = (self.unknowns(), self.judged.findings.degrees.rank());
        let (mut last, mut at): (usize, Option<PointDegrees<S>>) = (0, None);
        let (mut point, mut elsewhere) = (0, 0);
        while point < POINTS && elsewhere < ELSEWHERE {
            if !self.budget.spend(cost_of_point::<S>(self.point_work, rank, 2 * n)) {
                break;
            }
            let (here, operations) = self.point()?;
            if !self.is_alike(&here) {
                elsewhere += 1;
                continue;
            }
            for i in 0..here.span.rank() {
                let row = here.span.row(i);
                let scaled = row.iter().zip(&here.values).map(|(r, x)| f.mul(r, x));
                let both: Vec<_> = scaled.chain(row.iter().copied()).collect();
                if !self.budget.insert::<S>(basis, &both) {
                    break;
                }
            }
            self.point_work = operations;
            at = Some(here);
            if point >= 2 && basis.rank() == last {
                break;
            }
            last = basis.rank();
            point += 1;
        }
        Ok(at)
    }

    /// Scalings and translations: short null vectors of `basis` whose tangents at a point are independent.
    fn linear(&mut self, basis: &S::Space, at: &PointDegrees<S>, tangents: &mut S::Space) -> Vec<Symmetry> {
        let (f, n) = (self.f.clone(), self.unknowns());
        let short = match !self.budget.over && basis.gap().is_decisive(S::BITS) {
            true => {
                let mut span = self.space(2 * n);
                self.budget.short_vectors(&f, &basis.null_space(), basis, &mut span)
            }
            false => Vec::new(),
        };
        let mut found = Vec::new();
        for v in short {
            let tangent: Vec<_> = (0..n).map(|c| f.add(&f.mul(&v[c], &at.values[c]), &v[n + c])).collect();
            let Some(k) = rationals(&f, &v).filter(|_| tangents.insert(&tangent)) else { continue };
            let terms = |half: &[(i64, i64)]| -> Vec<RationalTerm> {
                half.iter().copied().enumerate().filter(|(_, k)| k.0 != 0).collect()
            };
            found.push(Symmetry { scaling: terms(&k[..n]), translation: terms(&k[n..]) });
        }
        found
    }

    /// Polynomial directions, low degrees first, until `missing` are found.
    fn polynomial(
        &mut self,
        missing: usize,
        at: &PointDegrees<S>,
        tangents: &mut S::Space,
    ) -> Result<Vec<PolynomialDirection>, ModelError> {
        let moved: Vec<usize> = (0..self.unknowns()).filter(|&c| self.can_move(c)).collect();
        let factors = self.factors(&moved);
        let mut out = Vec::new();
        for degree in 1..=POLYNOMIAL_DEGREE {
            let products = products(&factors, degree);
            if out.len() == missing || moved.len() > MOVED || moved.len() * products.len() > S::COEFFICIENTS {
                break;
            }
            out.extend(self.directions(&moved, &products, at, tangents)?);
        }
        Ok(out)
    }

    /// Factors of polynomial directions: unknowns, of many only those that change, and constants that all
    /// segments and experiments share.
    fn factors(&self, moved: &[usize]) -> Vec<usize> {
        let (n, model) = (self.unknowns(), self.model);
        let changed =
            model.segments.iter().map(|s| &s.constants).chain(model.own.iter().map(|e| &e.constants));
        let changed: Vec<&String> = changed.flatten().map(|(name, _)| name).collect();
        let shared = |name: &String| !changed.contains(&name);
        let constants = model.constants.iter().enumerate().filter(|(_, c)| shared(&c.0.name));
        let unknowns = if n <= MOVED { (0..n).collect() } else { moved.to_vec() };
        unknowns.into_iter().chain(constants.map(|(i, _)| n + i)).collect()
    }

    /// One more random point with the verdicts of the model, for rows of this many columns; `None` once the
    /// work is used up.
    fn draw(&mut self, columns: usize) -> Result<Option<PointDegrees<S>>, ModelError> {
        let rank = self.judged.findings.degrees.rank();
        for _ in 0..=ELSEWHERE {
            if !self.budget.spend(cost_of_point::<S>(self.point_work, rank, columns)) {
                break;
            }
            let (here, _) = self.point()?;
            if self.is_alike(&here) {
                return Ok(Some(here));
            }
        }
        Ok(None)
    }

    /// Directions `v_i = sum_j a_ij m_j` over the unknowns that change, with m_j products of unknowns and
    /// known constants. The a_ij solve a linear system of rows at several points, which are drawn as long as
    /// work remains.
    fn directions(
        &mut self,
        moved: &[usize],
        products: &[Vec<usize>],
        at: &PointDegrees<S>,
        tangents: &mut S::Space,
    ) -> Result<Vec<PolynomialDirection>, ModelError> {
        let f = self.f.clone();
        let width = products.len();
        let Some(basis) = self.sample_products(moved, products)? else { return Ok(Vec::new()) };
        let here = values_of(&f, products, at);
        let mut span = self.space(moved.len() * width);
        let mut out = Vec::new();
        for v in self.budget.short_vectors(&f, &basis.null_space(), &basis, &mut span) {
            let mut tangent = vec![f.zero(); tangents.columns()];
            for (part, &m) in v.chunks_exact(width).zip(moved) {
                tangent[m] = f.dot(&f.zero(), part.iter().zip(&here));
            }
            let Some(k) = rationals(&f, &v).filter(|_| tangents.insert(&tangent)) else { continue };
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

    /// Conditions on the coefficients a_ij at random points; `None` if the work or the digits do not suffice
    /// for all of them.
    fn sample_products(
        &mut self,
        moved: &[usize],
        products: &[Vec<usize>],
    ) -> Result<Option<S::Space>, ModelError> {
        let f = self.f.clone();
        let columns = moved.len() * products.len();
        let mut basis = self.space(columns);
        let (mut rank, mut still) = (0, 0);
        for _ in 0..POLYNOMIAL_POINTS {
            let Some(here) = self.draw(columns)? else { break };
            let values = values_of(&f, products, &here);
            for i in 0..here.span.rank() {
                let row = here.span.row(i);
                let entries = moved.iter().flat_map(|&m| values.iter().map(move |x| (m, x)));
                let entries: Vec<_> = entries.map(|(m, x)| f.mul(&row[m], x)).collect();
                if !self.budget.insert::<S>(&mut basis, &entries) {
                    return Ok(None);
                }
            }
            still = if basis.rank() == rank { still + 1 } else { 0 };
            if still == 2 {
                break;
            }
            rank = basis.rank();
        }
        Ok((still >= 2 && basis.gap().is_decisive(S::BITS)).then_some(basis))
    }

    /// Unknowns that each remaining direction changes, among excited unknowns.
    fn unexplained(&mut self, at: &PointDegrees<S>, tangents: &mut S::Space) -> Vec<Vec<usize>> {
        let f = self.f.clone();
        let excited = &self.judged.findings.degrees.excited;
        let among_excited = |v: &Vec<S::Element>| support_in(&f, v).iter().all(|&c| excited[c]);
        let rest: Vec<Vec<S::Element>> = at.span.null_space().into_iter().filter(among_excited).collect();
        let moving = self.budget.short_vectors(&f, &rest, &at.span, tangents);
        moving.iter().map(|v| support_in(&f, v)).collect()
    }
}

/// Values of products of unknowns and constants at a point.
fn values_of<S: Values>(f: &S, products: &[Vec<usize>], at: &PointDegrees<S>) -> Vec<S::Element> {
    let value = |product: &Vec<usize>| product.iter().fold(f.one(), |x, &j| f.mul(&x, &at.values[j]));
    products.iter().map(value).collect()
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

/// Products of powers that every scaling leaves unchanged, and sums that every translation leaves unchanged,
/// as far as they are observable: those of parameters alone first.
fn invariants<S: Values>(
    f: &S,
    is_parameter: &[bool],
    found: &[Symmetry],
    at: &PointDegrees<S>,
    budget: &mut WorkBudget,
) -> Vec<Invariant> {
    let n = is_parameter.len();
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
        let mut of_parameters = rows.clone();
        for c in (0..n).filter(|&c| !is_parameter[c]) {
            let unit: Vec<_> = (0..n).map(|j| if j == c { f.one() } else { f.zero() }).collect();
            of_parameters.insert(&unit);
        }
        let invariant = |m: &[S::Element]| -> Option<Invariant> {
            let exponents = integers(&rationals(f, m)?);
            // d(prod x^m) = prod x^m sum m_i dx_i / x_i
            let factor = |x| if product { f.inverse(x) } else { Some(f.one()) };
            let gradient: Option<Vec<S::Element>> = (exponents.iter().zip(&at.values))
                .map(|(&m, x)| if m == 0 { Some(f.zero()) } else { Some(f.mul(&f.integer(m), &factor(x)?)) })
                .collect();
            let degree = at.degree(&gradient?)?;
            let terms = exponents.iter().copied().enumerate().filter(|t| t.1 != 0).collect();
            Some(Invariant { terms, product, degree })
        };
        let mut span = space();
        for rows in [&of_parameters, &rows] {
            // null vectors of unknowns that do not change are unit vectors
            let is_moved = |v: &Vec<S::Element>| support_in(f, v).iter().all(|&c| moved[c]);
            let kept: Vec<Vec<S::Element>> = rows.null_space().into_iter().filter(is_moved).collect();
            for m in budget.short_vectors(f, &kept, rows, &mut span.clone()) {
                if let Some(found) = invariant(&m) {
                    span.insert(&m);
                    out.push(found);
                }
            }
        }
    }
    out
}

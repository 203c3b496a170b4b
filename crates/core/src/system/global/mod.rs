//! Consequences of relations among derivatives of outputs for the constants: those that are unique, and
//! equations that every solution satisfies.
//!
//! A relation `sum_i c_i(theta) m_i(y, y', ..., u, u', ...) = 0` holds for every solution. If one trajectory
//! determines its coefficients up to a factor, every ratio `c_i/c_j` is a function of the output. Ratios of
//! low degree are interpolated; setting them to their values at the base point gives a system in the
//! constants alone. A constant with one value among its solutions is unique, whatever other ratios are. If
//! amounts are conserved, one trajectory does not determine the coefficients of the relations that all have.
//! Then relations are sought along one trajectory; their ratios are functions of the constants and of the
//! start. Several values from some ratios prove nothing (Ollivier 1990; Ljung, Glad 1994,
//! doi:10.1016/0005-1098(94)90029-9; relations by evaluation instead of elimination).
//!
//! Constants that a symmetry changes keep their values: the solutions for all others are conjugate over
//! them.

mod integrals;
mod jets;
mod ratios;
mod relation;

use obsdeg_exact::groebner::{GroebnerBasis, OverLimit, RemainingWork};
use obsdeg_exact::multivariate::Polynomial;
use obsdeg_exact::{Echelon, Field, SplitMix64, polynomial};

use super::judge::verdicts::Judgement;
use super::model::compiled::Compiled;
use super::model::{StateStart, SystemModel};
use integrals::relations_along;
use jets::JetSource;
use ratios::{CoefficientRatio, Pool, ratios};
use relation::{Relation, relations};

/// Largest numbers of evaluations of a relation for one ratio, in steps: results of a cheap step make the
/// next ratios cheaper.
const EVALUATIONS: [usize; 5] = [30, 100, 300, 700, 1500];
/// Largest number of evaluations for a ratio that is given as a function.
const FUNCTION: usize = 700;
/// Number of ratios at each step beyond those that raise the rank.
const EXTRAS: usize = 6;
/// Limit of the work of one Groebner basis in the constants.
const BASIS: u64 = 20_000_000;
/// Highest degree of a minimal polynomial of a constant that is computed.
const SOLUTIONS: usize = 24;

/// Consequences of relations for the unknowns at a point.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct RelationConsequences {
    /// Unknowns with one value among all points with the same outputs.
    pub(super) unique: Vec<usize>,
    /// Polynomials in the unknowns (numbered as in the layout) that are zero at all those points.
    pub(super) zero: Vec<Polynomial>,
}

/// Relations of a model, the same at every point and in every field.
#[derive(Debug, Default)]
pub(super) struct ModelRelations {
    /// Relations of all trajectories, and true if others need several; `None` before they were sought.
    of_all: Option<(Vec<Relation>, bool)>,
    /// Relations along one trajectory; `None` before they were sought.
    along: Option<Vec<Relation>>,
}

/// True if relations among derivatives can decide anything: one experiment and segment, generic starts and
/// inputs, no function. Relations hold whatever the start, so it may be known.
pub(super) fn applies(model: &SystemModel, compiled: &Compiled, judged: &Judgement) -> bool {
    let starts = model.states.iter().all(|s| matches!(s.start, StateStart::Unknown | StateStart::Known));
    let generic = starts && compiled.segments.len() <= 1 && compiled.constraints.is_empty();
    // a relation that contains the time would hold at one time only
    let autonomous = compiled.dag.is_rational() && !compiled.uses_time();
    generic
        && autonomous
        && model.experiments <= 1
        && model.unknown_inputs.is_empty()
        && judged.fields.is_some()
}

/// Consequences of relations for the unknowns at the point `at` (values of the unknowns, then of the known
/// constants), given unknowns that are unique.
pub(super) fn known(
    (model, compiled, judged): (&SystemModel, &Compiled, &Judgement),
    (f, at, single): (Field, &[u64], &[usize]),
    found: &mut ModelRelations,
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> RelationConsequences {
    let source = JetSource::new(model, compiled, &judged.layout, f);
    let Some(span) = &judged.span else { return RelationConsequences::default() };
    let is_observable = |unknown: &usize| judged.findings.degrees.degree[*unknown].is_some();
    let ModelRelations { of_all, along } = found;
    let mut out = RelationConsequences::default();
    let (relations, several) = of_all.get_or_insert_with(|| {
        let structure = source.structure(at, rng);
        structure.map_or_else(Default::default, |s| relations(&source, &s, at, rng, work))
    });
    let mut narrow =
        |unknowns: &[usize], relations: &[Relation], work: &mut RemainingWork, rng: &mut SplitMix64| {
            let unknowns: Vec<usize> =
                unknowns.iter().copied().filter(|l| !single.contains(l) && !out.unique.contains(l)).collect();
            let (open, added) = open_constants(span, &unknowns);
            let mut fibre =
                ConstantFibre { f, at: at.to_vec(), variables: open.clone(), open, equations: Vec::new() };
            // results found before the work ended are valid
            let _ended = fibre.narrow(&source, relations, rng, work);
            let found = fibre.variables.iter().copied().filter(|v| !fibre.open.contains(v));
            out.unique.extend(found.filter(is_observable));
            // if additional constants were fixed, the equations hold only together with these
            if !added {
                out.zero.extend(fibre.zero());
            }
            fibre.open.iter().any(is_observable)
        };
    let open = narrow(&source.constants, relations, work, rng);
    if open && *several && !source.has_inputs() {
        let relations = along.get_or_insert_with(|| {
            let structure = source.structure(at, rng);
            structure.map_or_else(Vec::new, |s| relations_along(&source, &s, at, rng, work))
        });
        let all: Vec<usize> = (0..judged.layout.unknowns.len()).collect();
        narrow(&all, relations, work, rng);
    }
    out
}

/// Ratios of coefficients of relations, as functions of the constants (numbered as in the layout): numerator
/// and denominator of each, independent ones of low degree. Contains what was found when the work ended.
pub(super) fn functions_of_constants(
    (model, compiled, judged): (&SystemModel, &Compiled, &Judgement),
    (f, at): (Field, &[u64]),
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> Vec<[Polynomial; 2]> {
    if !applies(model, compiled, judged) {
        return Vec::new();
    }
    let source = JetSource::new(model, compiled, &judged.layout, f);
    let Some(structure) = source.structure(at, rng) else { return Vec::new() };
    let (relations, _) = relations(&source, &structure, at, rng, work);
    let variables = source.constants.clone();
    let mut all: Vec<CoefficientRatio> = Vec::new();
    for numbered in relations.iter().enumerate() {
        all.extend(ratios(&source, numbered, at, &variables, rng, work).unwrap_or_default());
    }
    let places: Vec<usize> = (0..variables.len()).collect();
    all.sort_by_cached_key(|r| r.cost(&places));
    let mut space = Echelon::new(f, variables.len());
    all.retain(|r| r.cost(&places) <= FUNCTION && space.insert(&r.gradient));
    let mut pool = Pool::new(&source, &relations, at, variables);
    let function = |r: &CoefficientRatio| pool.function(r, &places, rng, work).ok().flatten();
    all.iter().filter_map(function).collect()
}

/// The constants without as many as there are symmetry directions (first those that are no pivots of the
/// span, then any that is independent of it); true if any of the latter were fixed.
fn open_constants(span: &Echelon, constants: &[usize]) -> (Vec<usize>, bool) {
    let mut space = span.clone();
    let (mut open, mut added) = (Vec::new(), false);
    let is_pivot = |c: &usize| span.pivot_row(*c).is_some();
    let unit =
        |c: usize, one: u64| (0..span.columns()).map(|i| if i == c { one } else { 0 }).collect::<Vec<_>>();
    for &c in constants.iter().filter(|c| !is_pivot(c)) {
        space.insert(&unit(c, span.field().one()));
    }
    for &c in constants.iter().filter(|c| is_pivot(c)) {
        match space.insert(&unit(c, span.field().one())) {
            true => added = true,
            false => open.push(c),
        }
    }
    (open, added)
}

/// Constants with the same values of ratios.
struct ConstantFibre {
    f: Field,
    at: Vec<u64>,
    /// All constants that were open at first.
    variables: Vec<usize>,
    /// Constants that are not yet known to be unique.
    open: Vec<usize>,
    /// Ratios as functions, with their gradients.
    equations: Vec<RatioEquation>,
}

/// Ratio that has its value at the base point.
struct RatioEquation {
    above: Polynomial,
    below: Polynomial,
    gradient: Vec<u64>,
}

impl ConstantFibre {
    /// Interpolates ratios, cheap ones first, as long as they make constants unique.
    fn narrow(
        &mut self,
        source: &JetSource<'_>,
        relations: &[Relation],
        rng: &mut SplitMix64,
        work: &mut RemainingWork,
    ) -> Result<(), OverLimit> {
        let mut all: Vec<CoefficientRatio> = Vec::new();
        for numbered in relations.iter().enumerate() {
            all.extend(ratios(source, numbered, &self.at, &self.variables, rng, work)?);
        }
        for limit in EVALUATIONS {
            while !self.open.is_empty() {
                let chosen = self.chosen(&mut all, limit, rng);
                let mut pool = Pool::new(source, relations, &self.at, self.open.clone());
                let places = self.places();
                for ratio in &chosen {
                    if let Some([above, below]) = pool.function(ratio, &places, rng, work)? {
                        let gradient = ratio.gradient.clone();
                        self.equations.push(RatioEquation { above, below, gradient });
                    }
                }
                let unique = if chosen.is_empty() { Vec::new() } else { self.unique(work) };
                if unique.is_empty() {
                    break;
                }
                self.fix(&unique);
            }
        }
        Ok(())
    }

    /// Indices of the open constants among the variables.
    fn places(&self) -> Vec<usize> {
        let open = |k: &usize| self.open.contains(&self.variables[*k]);
        (0..self.variables.len()).filter(open).collect()
    }

    /// Span of the gradients of the equations, by the open constants.
    fn space(&self, places: &[usize]) -> Echelon {
        let mut space = Echelon::new(self.f, places.len());
        for e in &self.equations {
            space.insert(&places.iter().map(|&k| e.gradient[k]).collect::<Vec<_>>());
        }
        space
    }

    /// Removes from the list the ratios of at most `limit` evaluations that are used: those that raise the
    /// rank, the cheapest first, and some others at random.
    fn chosen(
        &self,
        all: &mut Vec<CoefficientRatio>,
        limit: usize,
        rng: &mut SplitMix64,
    ) -> Vec<CoefficientRatio> {
        let places = self.places();
        let depends = |r: &CoefficientRatio| places.iter().any(|&k| r.gradient[k] != 0);
        let mut left: Vec<(usize, usize)> = (all.iter().enumerate())
            .filter(|(_, r)| depends(r))
            .map(|(i, r)| (r.cost(&places), i))
            .filter(|r| r.0 <= limit)
            .collect();
        left.sort_unstable();
        let mut space = self.space(&places);
        let mut taken = Vec::new();
        left.retain(|&(_, i)| {
            let row: Vec<u64> = places.iter().map(|&k| all[i].gradient[k]).collect();
            let new = space.insert(&row);
            if new {
                taken.push(i);
            }
            !new
        });
        // random extras: without a ratio of few constants alone the others would be sought in vain
        for _ in 0..EXTRAS.min(left.len()) {
            let at = rng.below(left.len() as u64) as usize;
            taken.push(left.swap_remove(at).1);
        }
        taken.sort_unstable();
        let mut out: Vec<CoefficientRatio> = taken.into_iter().rev().map(|i| all.remove(i)).collect();
        out.reverse();
        out
    }

    /// Polynomials that are zero: every ratio minus its value.
    fn zero(&self) -> Vec<Polynomial> {
        let f = self.f;
        let less = |e: &RatioEquation| {
            let mut out = e.above.scaled(&f, e.below.at(&f, &self.at));
            out.add_scaled(&f, &e.below, f.neg(e.above.at(&f, &self.at)));
            out
        };
        self.equations.iter().map(less).filter(|p| !p.is_empty()).collect()
    }

    /// Open constants with one value.
    fn unique(&self, work: &mut RemainingWork) -> Vec<usize> {
        let f = self.f;
        let places = self.places();
        let space = self.space(&places);
        let name = |v: u32| self.open.iter().position(|&o| o == v as usize).map(|i| i as u32);
        let mut ideal: Vec<Polynomial> = self.zero().iter().filter_map(|p| p.renamed(name)).collect();
        // no divisor is zero
        let mut below: Vec<&Polynomial> = Vec::new();
        for e in self.equations.iter().filter(|e| e.below.as_constant().is_none()) {
            if !below.contains(&&e.below) {
                below.push(&e.below);
            }
        }
        for (k, p) in below.iter().enumerate() {
            let Some(p) = p.renamed(name) else { continue };
            let mut zero = Polynomial::constant(f.neg(f.one()));
            let inverse = Polynomial::variable(&f, (self.open.len() + k) as u32);
            zero.add_product(&f, &inverse, &p);
            ideal.push(zero);
        }
        let weights = vec![1; self.open.len() + below.len()];
        let mut own = RemainingWork::new(work.left.min(BASIS));
        let before = own.left;
        let mut basis = GroebnerBasis::new(&f, &weights, &ideal, &mut own);
        let mut out = Vec::new();
        for (i, &v) in self.open.iter().enumerate().filter(|(i, _)| space.has_unit(*i)) {
            let x = Polynomial::variable(&f, i as u32);
            let one = match basis.is_complete() {
                true => match basis.minimal_polynomial(&x, SOLUTIONS, &mut own) {
                    Ok(Some(minimal)) => polynomial::distinct_roots(&f, &minimal) == 1,
                    _ => false,
                },
                false => basis.remainder(&x, &mut own).is_ok_and(|r| r.as_constant().is_some()),
            };
            if one {
                out.push(v);
            }
        }
        work.left -= before - own.left;
        out
    }

    /// Sets constants to their values.
    fn fix(&mut self, unique: &[usize]) {
        for &v in unique {
            let value = Polynomial::constant(self.at[v]);
            for e in &mut self.equations {
                e.above = e.above.replaced(&self.f, v as u32, &value);
                e.below = e.below.replaced(&self.f, v as u32, &value);
            }
        }
        self.open.retain(|v| !unique.contains(v));
    }
}

//! Suspects: errors that the scheme does not estimate and that would explain the residuals of the fit.
//!
//! Residuals and the column of every omitted error pass through the same filter with a diffuse start. Its
//! whitened innovations are residuals without the part that changes of the unknowns explain, with the random
//! drift of the run. Columns are those at the estimated attitudes: with a tilt of degrees, columns at the
//! scheme's attitudes would no longer be the combinations of the unknowns that the true ones are. Where
//! labels leave the beginning of the scheme open, it is one more unknown. Each of several records has
//! unknowns of its own.

use nalgebra::DMatrix;
use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{OmittedModel, OmittedTerm, Platform};
use obsdeg_core::omitted::{OmittedClass, OmittedVerdicts, omitted_verdicts};
use obsdeg_ekf::linear::{covariance_pass, state_pass};
use obsdeg_ekf::{Covariance, CovarianceForm, EkfError, Gains};
use obsdeg_evidence::simulation::omitted::{
    Bench, ChangePerUnit, OmittedColumns, ResidualExplanation, ScoreSums, SuspectedChange, SuspectedError,
    Suspicion,
};
use obsdeg_evidence::simulation::{
    Attained, Conditions, SegmentKind, SimulationError, Tilt, is_rate, shown_unit, si_per_shown,
};

use super::CalibrationError;
use super::estimate::LinearisedRecord;
use super::estimate::{PlatformEstimate, PlatformProblem};
use super::offset::Later;
use super::run::{MeasurementKey, RecordedRun};
use crate::answer::{Estimated, Omitted, SilentError};
use crate::least_squares::Linearised;
use crate::levels;

/// Factor by which the start of the filter is wider than the prior.
const WIDE: f64 = 1e4;
/// Most estimates whose change is listed.
const CHANGES: usize = 3;

/// Uncertainty of the coefficients by omitted errors, in their shown units, by the weights of the first
/// record.
#[derive(Debug, Clone, Default)]
pub(super) struct Outside {
    /// Contribution of a bench to the sigma of every coefficient, by name (root of the sum of squares).
    pub bench: Vec<(String, f64)>,
    /// Largest change of every coefficient by a suspected error.
    pub suspected: Vec<(String, f64)>,
    /// Families that the bench does not state in full.
    pub families: Vec<FamilyChange>,
}

impl Outside {
    /// True if a bench or a suspected error adds to the uncertainty of this coefficient.
    pub(super) fn adds_to(&self, name: &str) -> bool {
        self.bench.iter().chain(&self.suspected).any(|(own, x)| own == name && *x != 0.0)
    }
}

/// Change of every coefficient by a family of errors, all terms one unit large (root of the sum of squares).
#[derive(Debug, Clone)]
pub(super) struct FamilyChange {
    /// Name of the family.
    pub family: &'static str,
    /// Unit of its sizes.
    pub unit: &'static str,
    /// True if the bench does not state one of its terms.
    pub open: bool,
    /// Changes by name, in shown units per unit of the size.
    pub changes: Vec<(String, f64)>,
}

/// Omitted errors of a calibration: those that explain residuals, and those that no record of the scheme
/// shows. Also returns the uncertainty of the coefficients by omitted errors.
///
/// # Errors
/// [`CalibrationError`] for a number that is not finite.
pub(super) fn omitted(
    problem: &PlatformProblem<'_>,
    estimate: &PlatformEstimate,
    quantities: &[Estimated],
    later: &[Option<Later>],
    (bench, seed): (&[Assignment], u64),
) -> Result<(Omitted, Outside), CalibrationError> {
    let Some(first) = problem.runs.first() else { return Ok(Default::default()) };
    let platform = &first.plan.platform;
    let model = OmittedModel::new(platform);
    let classes = omitted_verdicts(platform, &model, seed).ok();
    let class = |j: usize| classes.as_ref().map(|v| v.terms[j].class);
    let shown = (0..model.terms().len()).map(|j| class(j).is_none_or(|c| c == OmittedClass::Visible));
    let tested = tested(problem, estimate, &model, shown.collect(), later)?;
    let exact = Silent::of(&first.plan.platform, &model, classes.as_ref(), seed).ok();
    let silent = classes.iter().flat_map(|v| v.terms.iter().enumerate());
    let silent = silent.filter(|(_, t)| t.class == OmittedClass::Silent).map(|(j, t)| SilentError {
        name: t.name.clone(),
        unit: model.terms()[j].unit.into(),
        changes: t.changes.clone(),
        sensitivities: exact.as_ref().map_or_else(
            || tested.per_unit(j, model.terms()[j].unit, &t.changes),
            |of| of.per_unit(j, &t.changes),
        ),
    });
    let suspected =
        tested.score.explanation(levels::SUSPECT).map(|found| suspicion(&found, &model, &tested, quantities));
    let (suspicion, moved) = suspected.map_or((None, Vec::new()), |(s, moved)| (Some(s), moved));
    let found = Omitted {
        tried: tested.score.tried().len(),
        suspicion,
        limits: Vec::new(),
        silent: silent.filter(|s| s.changes.iter().any(|c| !c.starts_with("psi"))).collect(),
    };
    let scheme = platform.scheme();
    Bench::check(bench, scheme.positions.len(), scheme.rotates()).map_err(SimulationError::from)?;
    let size =
        |t: &OmittedTerm| Bench::size_of(bench, t.family, &t.name).unwrap_or(0.0) * si_per_shown(t.unit);
    let sizes: Vec<f64> = model.terms().iter().map(size).collect();
    let added =
        |changes: &[f64]| changes.iter().zip(&sizes).map(|(b, s)| (b * s).powi(2)).sum::<f64>().sqrt();
    let added = tested.changes.iter().map(|(name, unit, of)| (name.clone(), added(of) / si_per_shown(unit)));
    let enters = |j: usize| class(j) != Some(OmittedClass::NoEffect);
    let families = families(&model, &tested, &enters, bench);
    let outside = Outside { bench: added.collect(), suspected: moved, families };
    Ok((found, outside))
}

/// Largest changes per unit of families that a bench does not state in full.
fn families(
    model: &OmittedModel,
    tested: &Tested,
    enters: &dyn Fn(usize) -> bool,
    bench: &[Assignment],
) -> Vec<FamilyChange> {
    let mut out: Vec<FamilyChange> = Vec::new();
    for (j, t) in model.terms().iter().enumerate().filter(|(j, _)| enters(*j)) {
        let open = Bench::size_of(bench, t.family, &t.name).is_none();
        let at = out.iter().position(|f| f.family == t.family).unwrap_or_else(|| {
            let changes = tested.changes.iter().map(|(name, ..)| (name.clone(), 0.0)).collect();
            out.push(FamilyChange { family: t.family, unit: t.unit, open: false, changes });
            out.len() - 1
        });
        let family = &mut out[at];
        family.open |= open;
        for ((_, change), (_, unit, of)) in family.changes.iter_mut().zip(&tested.changes) {
            *change = change.hypot(of[j] * si_per_shown(t.unit) / si_per_shown(unit));
        }
    }
    out.retain(|f| f.open);
    out
}

/// Changes by errors that no record shows: they depend neither on the weights nor on a prior.
struct Silent<'a> {
    platform: &'a Platform,
    /// Change of every unknown per unit of every error, in shown units.
    changes: Vec<Vec<f64>>,
}

impl<'a> Silent<'a> {
    fn of(
        platform: &'a Platform,
        model: &OmittedModel,
        classes: Option<&OmittedVerdicts>,
        seed: u64,
    ) -> Result<Self, SimulationError> {
        let attained = Attained::new(platform.scheme(), &Conditions::default(), seed)?;
        let changes = attained.influence(model)?.shown(platform.units(), &attained.sigmas, model, classes);
        Ok(Self { platform, changes })
    }

    /// Changes of the unknowns `of` per unit of error `j`.
    fn per_unit(&self, j: usize, of: &[String]) -> Vec<ChangePerUnit> {
        let own = self.platform.names().iter().enumerate().filter(|(c, name)| {
            of.contains(name) && is_rate(self.platform.units()[*c]) && self.changes[*c][j] != 0.0
        });
        own.map(|(c, name)| ChangePerUnit {
            unknown: name.clone(),
            unit: shown_unit(self.platform.units()[c]).into(),
            per_unit: self.changes[c][j],
        })
        .collect()
    }
}

/// Sums over all runs, and the change of every coefficient of the platform per SI unit of every error.
struct Tested {
    score: ScoreSums,
    /// Changes by coefficient: name, unit, and one change per error.
    changes: Vec<(String, &'static str, Vec<f64>)>,
}

impl Tested {
    /// Changes of the coefficients `of` per unit of error `j`.
    fn per_unit(&self, j: usize, unit: &str, of: &[String]) -> Vec<ChangePerUnit> {
        let own = self.changes.iter().filter(|(name, ..)| of.contains(name));
        own.map(|(name, of, changes)| ChangePerUnit {
            unknown: name.clone(),
            unit: shown_unit(of).into(),
            per_unit: changes[j] * si_per_shown(unit) / si_per_shown(of),
        })
        .collect()
    }
}

fn tested(
    problem: &PlatformProblem<'_>,
    estimate: &PlatformEstimate,
    model: &OmittedModel,
    shown: Vec<bool>,
    later: &[Option<Later>],
) -> Result<Tested, CalibrationError> {
    let m = model.terms().len();
    let mut score = ScoreSums {
        products: DMatrix::zeros(m, m),
        against: vec![0.0; m],
        chi_square: 0.0,
        degrees_of_freedom: 0.0,
        shown,
    };
    let mut changes = Vec::new();
    for (r, (run, LinearisedRecord { run: linear, keys })) in
        problem.runs.iter().zip(&estimate.at.runs).enumerate()
    {
        let columns = columns(run, model, keys, run.tilts(problem.conditions, &estimate.at.x[r])?)?;
        let filter = DiffuseFilter::new(problem, r, linear)?;
        let (_, mut own) = filter.through(&linear.residuals)?;
        let mut passed = columns.iter().map(|z| filter.through(z)).collect::<Result<Vec<_>, _>>()?;
        score.chi_square += dot(&own, &own);
        let unknowns = run.plan.unknowns() + usize::from(later[r].is_some());
        score.degrees_of_freedom += own.len() as f64 - unknowns as f64;
        if let Some(later) = &later[r] {
            let of_beginning = filter.through(&later.column)?;
            without_beginning(&mut own, &mut passed, of_beginning, later.weight);
        }
        add_products(&mut score, &own, &passed);
        if r == 0 {
            let platform = &run.plan.platform;
            let coefficients = run.plan.unknowns() - platform.coefficients()..run.plan.unknowns();
            changes = coefficients
                .map(|c| {
                    let of = passed.iter().map(|(x, _)| x[c]).collect();
                    (platform.names()[c].clone(), platform.units()[c], of)
                })
                .collect();
        }
    }
    Ok(Tested { score, changes })
}

/// Filter with a diffuse start along a linearised run: its gains.
struct DiffuseFilter<'a> {
    linear: &'a Linearised,
    gains: Gains,
    /// Number of states.
    n: usize,
}

/// Estimates at the end of a filter, and whitened innovations.
type Passed = (Vec<f64>, Vec<f64>);

impl<'a> DiffuseFilter<'a> {
    /// Filter along the run `r`.
    fn new(problem: &PlatformProblem<'_>, r: usize, linear: &'a Linearised) -> Result<Self, EkfError> {
        let own = problem.runs[r].plan.unknowns();
        let prior = problem.unknowns.index[r]
            .iter()
            .enumerate()
            .map(|(s, &i)| problem.unknowns.prior[i] * if s < own { WIDE } else { 1.0 });
        let prior: Vec<f64> = prior.collect();
        let n = prior.len();
        let variances = nalgebra::DVector::from_iterator(n, prior.iter().map(|s| s * s));
        let covariance = Covariance::new("P0", &DMatrix::from_diagonal(&variances), CovarianceForm::Ud)?;
        let gains = covariance_pass(&linear.stages, covariance, |_, _| {})?;
        Ok(Self { linear, gains, n })
    }

    /// Passes the measurements `z` through the filter.
    fn through(&self, z: &[f64]) -> Result<Passed, EkfError> {
        let (mut x, mut whitened, mut next) = (vec![0.0; self.n], Vec::with_capacity(z.len()), 0);
        let measure = |_: usize, _: usize, out: &mut [f64]| {
            out.copy_from_slice(&z[next..next + out.len()]);
            next += out.len();
        };
        state_pass(&self.linear.stages, &self.gains, &mut x, measure, |_, _, w| {
            whitened.extend_from_slice(w);
        })?;
        Ok((x, whitened))
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()
}

/// Takes the beginning of the scheme, as one more unknown, out of the residuals `own` and the passed columns.
/// `weight` is that of the labels.
fn without_beginning(own: &mut Vec<f64>, passed: &mut [Passed], (x, mut of_beginning): Passed, weight: f64) {
    // one more measurement, of the beginning by the labels; the fit has settled with it
    let known = weight.sqrt();
    let beginning = -dot(&of_beginning, own) / known;
    own.push(beginning);
    of_beginning.push(known);
    let squares = dot(&of_beginning, &of_beginning);
    for (of, column) in passed {
        column.push(0.0);
        let share = dot(column, &of_beginning) / squares;
        column.iter_mut().zip(&of_beginning).for_each(|(c, w)| *c -= share * w);
        of.iter_mut().zip(&x).for_each(|(c, x)| *c -= share * x);
    }
}

/// Adds the products of the passed columns with the residuals `own` and with each other.
fn add_products(score: &mut ScoreSums, own: &[f64], passed: &[Passed]) {
    for (j, (_, column)) in passed.iter().enumerate() {
        score.against[j] += dot(column, own);
        for (k, (_, other)) in passed.iter().enumerate().take(j + 1) {
            let product = dot(column, other);
            score.products[(j, k)] += product;
            if k < j {
                score.products[(k, j)] += product;
            }
        }
    }
}

/// Columns of all errors in the measurements of a run, in their order, at these tilts.
fn columns(
    run: &RecordedRun,
    model: &OmittedModel,
    keys: &[MeasurementKey],
    tilts: Vec<Tilt>,
) -> Result<Vec<Vec<f64>>, CalibrationError> {
    let m = model.terms().len();
    let mut of_bins: Vec<Vec<f64>> = Vec::new();
    let mut columns = OmittedColumns::of_tilted(&run.plan, model, tilts);
    for (segment, bin) in run.plan.segments.iter().zip(&run.bins) {
        let mut last = Vec::new();
        for _ in 0..segment.steps {
            last = columns.step()?.unwrap_or_default().to_vec();
        }
        if bin.is_some() && !matches!(segment.kind, SegmentKind::Slew(_)) {
            of_bins.push(last);
        }
    }
    let entry = |j: usize, key: &MeasurementKey| {
        of_bins.get(key.bin).and_then(|b| b.get(key.channel * m + j)).copied()
    };
    Ok((0..m).map(|j| keys.iter().map(|k| entry(j, k).unwrap_or(0.0)).collect()).collect())
}

/// The suspicion in names and units, and the largest change of each coefficient by it, in its shown unit.
fn suspicion(
    found: &ResidualExplanation,
    model: &OmittedModel,
    tested: &Tested,
    quantities: &[Estimated],
) -> (Suspicion, Vec<(String, f64)>) {
    let terms = model.terms();
    let names = |of: &[usize]| of.iter().map(|&j| terms[j].name.clone()).collect::<Vec<_>>();
    let errors = found.errors.iter().zip(&found.estimates).zip(&found.groups);
    let errors = errors.map(|((&j, [estimate, sigma]), group)| {
        let scale = si_per_shown(terms[j].unit);
        SuspectedError {
            name: terms[j].name.clone(),
            unit: terms[j].unit.into(),
            estimate: estimate / scale,
            sigma: sigma / scale,
            indistinguishable: names(group),
        }
    });
    let changes = suspected_changes(found, tested, quantities);
    let moved = changes.iter().map(|c| {
        let most = (c.lowest - c.estimate).abs().max((c.highest - c.estimate).abs());
        (c.unknown.clone(), most)
    });
    let moved = moved.collect();
    let suspicion = Suspicion {
        errors: errors.collect(),
        indistinguishable: names(&found.groups[0]),
        explained: found.explained,
        chi_square_fall: found.fall,
        probability: found.probability,
        changes: changes.into_iter().take(CHANGES).collect(),
    };
    (suspicion, moved)
}

/// Changes of the estimates by suspected errors, the largest in sigma first.
fn suspected_changes(
    found: &ResidualExplanation,
    tested: &Tested,
    quantities: &[Estimated],
) -> Vec<SuspectedChange> {
    // each error of a group explains the residuals as well, and may change the estimates differently
    let alone = |&j: &usize| vec![(j, tested.score.against[j] / tested.score.products[(j, j)])];
    let best: Vec<(usize, f64)> =
        found.errors.iter().zip(&found.estimates).map(|(&j, e)| (j, e[0])).collect();
    // for a pair the other members of its groups are named, without a range of changes
    let group = if found.errors.len() == 1 { &found.groups[0][..] } else { &[] };
    let members: Vec<Vec<(usize, f64)>> = std::iter::once(best).chain(group.iter().map(alone)).collect();
    let mut changes: Vec<(f64, SuspectedChange)> = Vec::new();
    for (name, unit, per_unit) in &tested.changes {
        let Some(q) = quantities.iter().find(|q| q.name == *name) else { continue };
        let (Some(estimate), Some(sigma)) = (q.estimate, q.sigma) else { continue };
        let moved = |of: &Vec<(usize, f64)>| of.iter().map(|(j, size)| per_unit[*j] * size).sum::<f64>();
        let moved: Vec<f64> = members.iter().map(|of| moved(of) / si_per_shown(unit)).collect();
        let unit = shown_unit(unit).to_string();
        let lowest = moved.iter().map(|m| estimate - m).fold(f64::INFINITY, f64::min);
        let highest = moved.iter().map(|m| estimate - m).fold(f64::NEG_INFINITY, f64::max);
        let change = SuspectedChange {
            unknown: name.clone(),
            unit,
            estimate,
            with: estimate - moved[0],
            lowest,
            highest,
        };
        let most = moved.iter().fold(0.0, |most: f64, m| most.max(m.abs()));
        changes.push((most / sigma, change));
    }
    changes.sort_by(|a, b| b.0.total_cmp(&a.0));
    changes.into_iter().map(|(_, change)| change).collect()
}

//! Cross-check of the exact verdicts with a filter: two independent paths, item by item.
//!
//! Evidence a: the slope of sigma against the dwell is -(accuracy order + 1/2). b: a larger prior does not
//! change the sigmas of observable functionals, and the unobservable directions are those of the information
//! matrix. c: the filter's covariance is the inverse information. d: errors and innovations match the
//! filter's covariances. e: predicted and measured orders rank alike. f: deliberately wrong filters are
//! detected.

pub(crate) mod answer;
mod asymptotics;
mod equations;
pub(crate) mod monte_carlo;
mod precise;
mod ranking;
mod resolution;
pub(crate) mod rules;
pub(crate) mod slopes;
mod spaces;
mod structure;
mod summary;

pub use answer::*;
pub use monte_carlo::{MonteCarloExperiment, PreparedExperiment, Totals};
pub use ranking::kendall_tau_b;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::settings::Truth;
use obsdeg_core::model::{Carry, Latitude, Matrix3, Platform, Position, Scheme};
use obsdeg_ekf::consistency::chi_square_band;
use obsdeg_ekf::{CovarianceForm, SquareRootInformation};
use obsdeg_exact::parallel;

use crate::prediction::Prediction;
use crate::simulation::batch::{batch, each_row};
use crate::simulation::plan::timeline::SegmentKind;
use crate::simulation::record::{RunStart, largest_psi};
use crate::simulation::{
    Conditions, GyroNoise, Plan, SimulationError, Validity, conditions_report, timeline_report,
};
use asymptotics::method;
use structure::{last_covariance, still, structure};
use summary::{disagreements, misfits, outcomes, unresolved};

/// Largest relative difference of covariances that rounding causes; P itself has half the digits of its root.
const COVARIANCE_LIMITS: [(CovarianceForm, &str, f64); 2] =
    [(CovarianceForm::Ud, "UD form", 1e-6), (CovarianceForm::Joseph, "Joseph form", 1e-4)];
/// Statements of an analysis that the cross-check does not test.
const NOT_TESTED: [&str; 7] = [
    "solving expressions (the analysis verifies them by substitution) and formulas of Z",
    "that the coefficients printed are exact: numbers are held against samples, to seven digits",
    "that the words of a combination or a direction say its numbers, which are what is tested",
    "the conditions on angles under which verdicts change",
    "verdicts under the other carries, at other latitudes and angles: a cross-check of those schemes does that",
    "that the bound on the probability of a wrong verdict is right",
    "that the equations of the paper, their signs and axes, are those of the platform: they are written here \
     several times, as the paper has them",
];
/// Length of the unexplained rest of a unit column below which the other columns explain it.
const UNEXPLAINED: f64 = 1e-7;
/// Smallest change of a control, in deg, that must show: a filter with a smaller one may agree with its data.
const OFF_DEG: f64 = 1.0;
/// Number of runs of a control that [`CONTROL_RUNS`] runs have not detected.
const MANY_RUNS: usize = 2000;
/// Largest product of samples and unknowns of a control for which [`must_show`] computes an answer.
const MOST_NUMBERS: usize = 4_000_000;
/// Number of runs of a control.
const CONTROL_RUNS: usize = 16;

/// Deliberate difference of the filter from the truth.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FilterChange {
    /// Carry of the filter; `None`: that of the truth.
    pub carry: Option<Carry>,
    /// Latitude of the filter; `None`: that of the truth.
    pub latitude: Option<Latitude>,
    /// Index of a position unknown to the filter, which assumes that the platform stays where it was.
    pub dropped: Option<usize>,
}

impl FilterChange {
    fn is_none(&self) -> bool {
        *self == Self::default()
    }

    fn words(&self, scheme: &Scheme) -> String {
        let mut out = Vec::new();
        if let Some(carry) = self.carry {
            out.push(format!("with {carry} carry"));
        }
        if let Some(latitude) = self.latitude {
            out.push(format!("at latitude {latitude} deg"));
        }
        if let Some(i) = self.dropped {
            out.push(format!("without position {}", scheme.positions[i].name));
        }
        out.join(", ")
    }

    fn apply(&self, scheme: &Scheme) -> Scheme {
        let mut out = scheme.clone();
        out.carry = self.carry.unwrap_or(out.carry);
        out.latitude = self.latitude.or(out.latitude);
        if let Some(i) = self.dropped.filter(|_| scheme.positions.len() > 1) {
            out.positions[i].angles = scheme.positions[if i == 0 { 1 } else { i - 1 }].angles.clone();
            out.positions.iter_mut().skip(i).take(2).for_each(Position::take_shortest_way);
        }
        out
    }
}

/// Options of a cross-check.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossCheckOptions {
    /// Number of Monte Carlo runs.
    pub runs: usize,
    /// Seed of all random choices.
    pub seed: u64,
    /// Deliberate error of the filter.
    pub filter: FilterChange,
}

impl Default for CrossCheckOptions {
    /// 200 runs of an unchanged filter, seed 1.
    fn default() -> Self {
        Self { runs: 200, seed: 1, filter: FilterChange::default() }
    }
}

/// Compares the exact verdicts on `scheme` with a filter. `progress` gets the number of finished runs and
/// returns false to stop.
///
/// # Errors
/// [`SimulationError`]; `Interrupted` when `progress` returns false.
pub fn crosscheck(
    scheme: &Scheme,
    conditions: &Conditions,
    options: &CrossCheckOptions,
    progress: &dyn Fn(usize) -> bool,
) -> Result<CrossCheck, SimulationError> {
    let conditions = &every_sample(conditions);
    let truth = truth(scheme, conditions, options)?;
    let rates = [truth.point.w_n, truth.point.w_u];
    let prediction = Prediction::new(&truth.platform, rates, options.seed)?;
    against(&prediction, &truth, scheme, conditions, options, progress)
}

/// Compares `prediction` on `scheme` with a filter, as [`crosscheck`] does with the prediction of the exact
/// engine.
///
/// # Errors
/// [`SimulationError`]; `Interrupted` when `progress` returns false.
pub fn crosscheck_against(
    prediction: &Prediction,
    scheme: &Scheme,
    conditions: &Conditions,
    options: &CrossCheckOptions,
    progress: &dyn Fn(usize) -> bool,
) -> Result<CrossCheck, SimulationError> {
    let conditions = &every_sample(conditions);
    let truth = truth(scheme, conditions, options)?;
    against(prediction, &truth, scheme, conditions, options, progress)
}

/// Conditions without a time at the start of positions whose samples are left out: exact verdicts are those
/// of whole dwells, and so are the slopes that check them.
fn every_sample(conditions: &Conditions) -> Conditions {
    Conditions { settle_s: 0.0, ..conditions.clone() }
}

/// Plan of the truth.
fn truth(
    scheme: &Scheme,
    conditions: &Conditions,
    options: &CrossCheckOptions,
) -> Result<Plan, SimulationError> {
    if scheme.rotates() {
        return Err(SimulationError::CrosscheckRotation);
    }
    conditions.check_truth()?;
    if let Some(filter) = conditions.filter.filter(|_| !options.filter.is_none())
        && conditions.has_full_attitudes()
    {
        return Err(SimulationError::WrongOnPurpose { filter: filter.name() });
    }
    if options.filter.dropped.is_some() && scheme.positions.len() < 2 {
        return Err(SimulationError::DroppedOnly);
    }
    let truth = Plan::new(scheme, conditions)?;
    let slews = truth.segments.iter().any(|s| matches!(s.kind, SegmentKind::Slew(_)));
    if slews && options.filter.dropped.is_some() {
        return Err(SimulationError::DroppedSlew);
    }
    Ok(truth)
}

fn against(
    prediction: &Prediction,
    truth: &Plan,
    scheme: &Scheme,
    conditions: &Conditions,
    options: &CrossCheckOptions,
    progress: &dyn Fn(usize) -> bool,
) -> Result<CrossCheck, SimulationError> {
    let filter_scheme = options.filter.apply(scheme);
    // another carry has other unknowns
    let filter_conditions = conditions.within(&Platform::new(filter_scheme.clone())?);
    let filter = Plan::new(&filter_scheme, &filter_conditions)?;
    let structure = structure(truth, prediction, &filter_scheme, &filter_conditions)?;
    let mut covariance = covariances(&filter_scheme, &filter_conditions)?;
    covariance.extend(equations::difference(truth, conditions)?);

    let experiment = MonteCarloExperiment {
        filter: &filter,
        truth,
        conditions,
        null_space: prediction.whole_null_space(),
        seed: options.seed,
    };
    let (monte_carlo, errors) = evidence_of_runs(experiment, options.runs, progress)?;
    let controls = controls(scheme, conditions, prediction, options)?;
    let validity = validity(truth, conditions, options.seed)?;
    let mut out = CrossCheck {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        carry: scheme.carry,
        bench: conditions.bench_in_words(),
        filter: (!options.filter.is_none()).then(|| options.filter.words(scheme)),
        conditions: conditions_report(scheme, truth, conditions),
        timeline: timeline_report(truth),
        passed: false,
        verdicts_agree: false,
        disagreements: Vec::new(),
        unresolved: Vec::new(),
        counts: Counts::default(),
        method: method().into_iter().chain([filter_method()]).collect(),
        not_tested: NOT_TESTED.map(String::from).to_vec(),
        spaces: structure.spaces,
        ranking: ranking(&structure.quantities, prediction, &errors),
        slopes: structure.slopes,
        orders: Measured::count(structure.quantities.iter().map(|q| (&q.slope, q.accuracy_order.is_some()))),
        quantities: structure.quantities,
        null_space: structure.null_space,
        defect: structure.defect,
        covariance,
        monte_carlo,
        controls,
        validity,
        correlation: structure.correlation,
        seed: options.seed,
        error_bound: prediction.error_bound,
    };
    conclude(&mut out, structure.unresolved);
    Ok(out)
}

/// Evidence d, and the errors of the runs.
///
/// # Errors
/// [`SimulationError`]; `Interrupted` when `progress` returns false.
fn evidence_of_runs(
    experiment: MonteCarloExperiment<'_>,
    runs: usize,
    progress: &dyn Fn(usize) -> bool,
) -> Result<(MonteCarlo, Vec<f64>), SimulationError> {
    let prepared = PreparedExperiment::new(experiment)?;
    let totals = prepared.run(runs, progress);
    if totals.runs < runs {
        return Err(SimulationError::Interrupted);
    }
    let whiteness_probability = prepared.whiteness(&totals);
    let monte_carlo = MonteCarlo {
        filter: prepared.filter(),
        about_the_truth: prepared.is_about_the_truth(),
        runs: totals.runs,
        unsettled: totals.unsettled,
        statistics: prepared.statistics(&totals),
        whiteness_probability,
        white: whiteness_probability > 1e-3,
        history: prepared.history(&totals),
    };
    Ok((monte_carlo, totals.errors))
}

/// Validity of the small-angle model for the truth.
fn validity(truth: &Plan, conditions: &Conditions, seed: u64) -> Result<Validity, SimulationError> {
    let start = RunStart::new(truth, conditions)?;
    let largest_psi = largest_psi(truth, conditions, &start, seed)?;
    Validity::of(truth, conditions, &start.truth, largest_psi)
}

/// Concludes from the outcomes of all checks; `by_structure` has reasons of checks that are not resolvable.
fn conclude(out: &mut CrossCheck, by_structure: Vec<String>) {
    out.unresolved = unresolved(out, by_structure);
    out.disagreements = disagreements(out);
    out.verdicts_agree = out.disagreements.is_empty();
    let misfits = misfits(out);
    out.disagreements.extend(misfits);
    out.passed = out.disagreements.is_empty();
    out.counts = Counts::of(outcomes(out));
}

/// Conditions under which evidence b, c and f in doubles is not resolvable, in words.
fn filter_method() -> String {
    format!(
        "b: by many digits first, then in doubles; what fails in doubles is not resolvable where many digits \
         say that the diffuse prior is \
         too narrow to show it, or that moving the numbers of the model by 2^{} hides it; c: where rounding \
         may make a tenth of the limit; f: where \
         the filter is off by less than {OFF_DEG} deg, \
         or where what it cannot explain of the truths drawn need not show in {MANY_RUNS} runs",
        resolution::ROUNDING
    )
}

/// Evidence c: differences of the filter's covariances from the inverse information.
fn covariances(
    scheme: &Scheme,
    conditions: &Conditions,
) -> Result<Vec<CovarianceDifference>, SimulationError> {
    let still = still(conditions);
    let plan = Plan::new(scheme, &still)?;
    let start = RunStart::new(&plan, &still)?;
    let batch = batch(&plan, SquareRootInformation::prior(&start.sigma)?)?;
    let root = &batch.to_end * batch.information.inverse_root()?;
    let expected = &root * root.transpose();
    let steps: usize = plan.segments.iter().map(|s| s.steps).sum();
    let mut out = Vec::new();
    let wider = start.sigma.iter().enumerate().map(|(i, s)| s * s / expected[(i, i)]).fold(0.0, f64::max);
    for (form, name, limit) in COVARIANCE_LIMITS {
        let p = last_covariance(&plan, &start, form)?.matrix();
        let n = plan.unknowns();
        let scale = |i: usize, j: usize| (expected[(i, i)] * expected[(j, j)]).sqrt();
        let relative = |k: usize| (p[(k / n, k % n)] - expected[(k / n, k % n)]).abs() / scale(k / n, k % n);
        // NaN stays
        let difference =
            (0..n * n).map(relative).fold(0.0, |a: f64, b| if b <= a || a.is_nan() { a } else { b });
        // P loses, step by step, the digits by which the largest variance, that of the prior, exceeds the
        // smallest
        let coarse = form == CovarianceForm::Joseph && wider * f64::EPSILON * steps as f64 > limit / 10.0;
        let outcome = match difference <= limit {
            true => Agreement::Agrees,
            false if coarse => Agreement::NotResolvable,
            false => Agreement::Disagrees,
        };
        out.push(CovarianceDifference {
            name: format!("{name} against the inverse information"),
            difference,
            limit,
            outcome,
        });
    }
    Ok(out)
}

/// Evidence e: rank correlation of the predicted accuracy orders with those of the slopes (unobservable
/// last), and with the `errors` of runs.
fn ranking(quantities: &[QuantityEvidence], prediction: &Prediction, errors: &[f64]) -> Ranking {
    const LAST: i64 = 1000;
    let unknowns = prediction.unknowns.iter();
    let at_end: Vec<i64> = unknowns.map(|u| u.order_at_end.map_or(LAST, |d| d as i64)).collect();
    // ranks: logarithms of the errors in bins of 0.2
    let found: Vec<i64> = errors.iter().map(|e| (e.ln() / 0.2).round() as i64).collect();
    // an order without a resolved slope has no rank
    let ranked = || quantities.iter().filter(|q| q.slope.outcome.is_resolved());
    let predicted: Vec<i64> = ranked().map(|q| q.accuracy_order.map_or(LAST, |d| d as i64)).collect();
    let order = |slope: f64| if slope < -0.25 { (-slope - 0.5).round() as i64 } else { LAST };
    let measured: Vec<i64> = ranked().filter_map(|q| q.slope.measured).map(order).collect();
    let kendall_tau = kendall_tau_b(&predicted, &measured);
    Ranking {
        kendall_tau,
        pass: kendall_tau.map_or(predicted == measured, |t| t > 1.0 - 1e-12),
        errors: (!errors.is_empty()).then(|| kendall_tau_b(&at_end, &found)).flatten(),
    }
}

/// Evidence f: filters with another carry, at another latitude, or without a position, against the truth of
/// the linear model. An exact truth with large drifts would add errors that hide these. Repositioning is
/// instantaneous: a filter that does not know a position does not know its slew either. There are
/// none where the options make the filter wrong.
fn controls(
    scheme: &Scheme,
    conditions: &Conditions,
    prediction: &Prediction,
    options: &CrossCheckOptions,
) -> Result<Vec<Control>, SimulationError> {
    if !options.filter.is_none() {
        return Ok(Vec::new());
    }
    let seed = options.seed;
    let conditions = &Conditions { slews: false, truth: Truth::Linear, ..conditions.clone() };
    let truth = Plan::new(scheme, conditions)?;
    let changes = control_changes(scheme, &truth);
    let counted = parallel::map(changes.len(), |i| -> Result<(usize, usize), SimulationError> {
        let change = &changes[i].0;
        let filter_scheme = change.apply(scheme);
        let filter_conditions = conditions.within(&Platform::new(filter_scheme.clone())?);
        // an outcome that the numbers of a wrong filter do not resolve is no check of it
        match structure(&truth, prediction, &filter_scheme, &filter_conditions) {
            Ok(structure) => {
                let counts = structure.counts();
                Ok((counts.disagree, counts.agree + counts.disagree))
            }
            Err(e) if e.is_numeric() => Ok((0, 0)),
            Err(e) => Err(e),
        }
    });
    let mut out = Vec::new();
    for ((change, off_deg), counts) in changes.iter().zip(counted) {
        let filter_scheme = change.apply(scheme);
        let filter_conditions = conditions.within(&Platform::new(filter_scheme.clone())?);
        let filter = Plan::new(&filter_scheme, &filter_conditions)?;
        // the change has no effect, for instance at a repeated position
        if filter.stages == truth.stages {
            continue;
        }
        let name = format!("filter {}", change.words(scheme));
        let experiment =
            MonteCarloExperiment { filter: &filter, truth: &truth, conditions, null_space: None, seed };
        out.extend(control(name, *off_deg, counts?, experiment)?);
    }
    Ok(out)
}

/// Wrong filters of the controls, with the size of each change in deg.
fn control_changes(scheme: &Scheme, truth: &Plan) -> Vec<(FilterChange, f64)> {
    let other = if scheme.carry == Carry::Platform { Carry::Inertial } else { Carry::Platform };
    // far away: a filter at a latitude close by is hardly wrong
    let latitude = truth.platform.scheme().latitude.map_or(0.0, |l| l.degrees().abs());
    let elsewhere: Option<Latitude> = if latitude > 45.0 { "0" } else { "90" }.parse().ok();
    let far = elsewhere.map_or(0.0, |l| (l.degrees() - latitude).abs());
    let apart = |i: usize, j: usize| angle_deg(&truth.attitudes[i], &truth.attitudes[j]);
    let positions = 1..scheme.positions.len();
    // platform and inertial carry differ by the turn of the platform; the dropped position is the one
    // farthest from the position before it
    let turned = positions.clone().map(|i| apart(0, i)).fold(0.0, f64::max);
    let farthest = positions.map(|i| (i, apart(i - 1, i))).max_by(|a, b| a.1.total_cmp(&b.1));
    let changes = [
        Some((FilterChange { carry: Some(other), ..FilterChange::default() }, turned))
            .filter(|_| farthest.is_some()),
        Some((FilterChange { latitude: elsewhere, ..FilterChange::default() }, far)),
        farthest.map(|(i, off)| (FilterChange { dropped: Some(i), ..FilterChange::default() }, off)),
    ];
    changes.into_iter().flatten().collect()
}

/// Control by a wrong filter, of whose checks `failed` out of `checks` fail; `None` without a statistic of
/// its innovations.
fn control(
    name: String,
    off_deg: f64,
    (failed, checks): (usize, usize),
    experiment: MonteCarloExperiment<'_>,
) -> Result<Option<Control>, SimulationError> {
    let MonteCarloExperiment { truth, filter, conditions, .. } = experiment;
    let prepared = PreparedExperiment::new(experiment)?;
    let by_data = |runs| prepared.statistics(&prepared.run(runs, &|_| true)).pop();
    let Some(mut nis) = by_data(CONTROL_RUNS) else { return Ok(None) };
    if failed == 0 && nis.pass {
        nis = by_data(MANY_RUNS).unwrap_or(nis);
    }
    Ok(Some(Control {
        name,
        failed,
        checks,
        nis: nis.measured,
        band: nis.wide_band,
        off_deg,
        outcome: match failed > 0 || !nis.pass {
            true => Agreement::Agrees,
            false if off_deg < OFF_DEG || !must_show(truth, filter, conditions)? => Agreement::NotResolvable,
            false => Agreement::Disagrees,
        },
    }))
}

/// True if the innovations of a wrong filter must reveal it in [`MANY_RUNS`]: by the part of the drawn truths
/// that no state of the filter explains, unless random drift hides the samples.
fn must_show(truth: &Plan, filter: &Plan, conditions: &Conditions) -> Result<bool, SimulationError> {
    let samples: usize = truth.stages.iter().map(|s| s.steps * s.outputs.len()).sum();
    let many = samples * truth.unknowns().max(filter.unknowns()) > MOST_NUMBERS;
    // random drift or bias instability of the sensors may hide more
    let wander =
        conditions.gyro_noise != GyroNoise::default() || conditions.accelerometer_instability_ug > 0.0;
    if many || wander {
        return Ok(false);
    }
    let rows = |plan: &Plan| -> Result<DMatrix<f64>, SimulationError> {
        let mut out = Vec::new();
        each_row(plan, |row| {
            out.extend(row);
            Ok(())
        })?;
        Ok(DMatrix::from_row_slice(out.len() / plan.unknowns(), plan.unknowns(), &out))
    };
    let drawn = RunStart::new(truth, conditions)?.sigma;
    let mut signal = rows(truth)?;
    signal.column_iter_mut().zip(&drawn).for_each(|(mut c, sigma)| c *= *sigma);
    // orthonormal basis of the columns that the filter explains, twice since Gram-Schmidt loses digits once
    let mut explained: Vec<DVector<f64>> = Vec::new();
    for column in rows(filter)?.column_iter() {
        let length = column.norm();
        let mut v = column.clone_owned() / if length > 0.0 { length } else { 1.0 };
        for b in explained.iter().chain(&explained) {
            v.axpy(-b.dot(&v), b, 1.0);
        }
        if v.norm() > UNEXPLAINED {
            explained.push(v.normalize());
        }
    }
    for mut column in signal.column_iter_mut() {
        for b in explained.iter().chain(&explained) {
            let part = b.dot(&column);
            column.axpy(-part, b, 1.0);
        }
    }
    // psi is a random walk: its variance grows step by step, beside that of a sample
    let finest = truth.stages.iter().flat_map(|s| &s.outputs).map(|o| o.r).fold(f64::MAX, f64::min);
    let walked: f64 = truth
        .segments
        .iter()
        .map(|s| s.steps as f64 * (conditions.drift_noise.held_rad_s(s.dt) * s.dt).powi(2))
        .sum();
    let drowned = 1.0 + samples as f64 * walked / finest;
    let excess = signal.norm_squared() / drowned - filter.unknowns() as f64;
    // five standard deviations of the sum of all normalised innovations squared, per run
    Ok(excess > 5.0 * (2.0 * samples as f64 / MANY_RUNS as f64).sqrt())
}

/// Angle of the turn from one attitude to another, in degrees.
fn angle_deg(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    let trace: f64 = (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| a[i][j] * b[i][j]).sum();
    ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Band of the mean of `count` chi-square variables of `dof` degrees of freedom, at 95 % confidence.
pub fn mean_band(dof: usize, count: usize) -> (f64, f64) {
    chi_square_band(dof as f64, count as f64, obsdeg_ekf::consistency::CONFIDENCE)
}

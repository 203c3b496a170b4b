//! The exact verdicts against a filter: two independent paths, item by item.
//!
//! a. the slope of sigma against the dwell is -(accuracy order + 1/2); b. a larger prior leaves what is observable as
//! it is; the directions that Z does not see are those of the information; c. the filter's covariance is the inverse
//! information; d. errors and innovations are what the filter believes; e. predicted and measured orders rank alike; f.
//! filters that are wrong on purpose are found out.

pub(crate) mod answer;
pub(crate) mod monte_carlo;
mod ranking;
pub(crate) mod rules;
pub(crate) mod slopes;
mod structure;

pub use answer::*;
pub use monte_carlo::{Experiment, Prepared, Totals};
pub use ranking::kendall_tau_b;

use obsdeg_core::model::{Carry, Latitude, Platform, Scheme};
use obsdeg_ekf::consistency::chi_square_band;
use obsdeg_ekf::{Form, SquareRootInformation};

use crate::prediction::Prediction;
use crate::simulation::batch::batch;
use crate::simulation::plan::SegmentKind;
use crate::simulation::record::{RunStart, largest_psi};
use crate::simulation::{Conditions, Plan, SimulationError, Validity, conditions_report, timeline_report};
use structure::{last_covariance, still, structure};

/// Relative difference of covariances that is rounding; P itself holds half the digits of its root.
const COVARIANCE_LIMITS: [(Form, &str, f64); 2] =
    [(Form::Ud, "UD form", 1e-6), (Form::Joseph, "Joseph form", 1e-4)];
/// Runs of a control.
const CONTROL_RUNS: usize = 16;

/// How the filter is made to differ from the truth.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FilterChange {
    /// Another carry.
    pub carry: Option<Carry>,
    /// Another latitude.
    pub latitude: Option<Latitude>,
    /// A position (its index) that the filter does not know of: it believes the platform stays where it was.
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
        }
        out
    }
}

/// What is to be checked, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossCheckOptions {
    /// Monte Carlo runs.
    pub runs: usize,
    /// Seed of all random choices.
    pub seed: u64,
    /// A filter that is wrong on purpose.
    pub filter: FilterChange,
}

/// Holds the exact verdicts on `scheme` against a filter. `progress` hears how many of the
/// runs are done and says whether to go on.
///
/// # Errors
/// [`SimulationError`]; `Interrupted` when `progress` wants no more.
pub fn crosscheck(
    scheme: &Scheme,
    conditions: &Conditions,
    options: &CrossCheckOptions,
    progress: &dyn Fn(usize) -> bool,
) -> Result<CrossCheck, SimulationError> {
    if scheme.rotates() {
        return Err(SimulationError::CrosscheckRotation);
    }
    if options.filter.dropped.is_some() && scheme.positions.len() < 2 {
        return Err(SimulationError::DroppedOnly);
    }
    let truth = Plan::new(scheme, conditions)?;
    let slews = truth.segments.iter().any(|s| matches!(s.kind, SegmentKind::Slew(_)));
    if slews && options.filter.dropped.is_some() {
        return Err(SimulationError::DroppedSlew);
    }
    let filter_scheme = options.filter.apply(scheme);
    // another carry has other unknowns
    let filter_conditions = conditions.within(&Platform::new(filter_scheme.clone())?);
    let filter = Plan::new(&filter_scheme, &filter_conditions)?;
    let rates = [truth.point.w_n, truth.point.w_u];
    let prediction = Prediction::new(&truth.platform, rates, options.seed)?;
    let structure = structure(&truth, &prediction, &filter_scheme, &filter_conditions)?;
    let covariance = covariances(&filter_scheme, &filter_conditions)?;

    let experiment = Experiment {
        filter: &filter,
        truth: &truth,
        conditions,
        null_space: prediction.whole_null_space(),
        seed: options.seed,
    };
    let prepared = Prepared::new(experiment)?;
    let totals = prepared.run(options.runs, progress);
    if totals.runs < options.runs {
        return Err(SimulationError::Interrupted);
    }
    let whiteness_probability = prepared.whiteness(&totals);
    let monte_carlo = MonteCarlo {
        runs: totals.runs,
        statistics: prepared.statistics(&totals),
        whiteness_probability,
        white: whiteness_probability > 1e-3,
        history: prepared.history(&totals),
    };
    let controls = if options.filter.is_none() {
        controls(scheme, conditions, &prediction, options.seed)?
    } else {
        Vec::new()
    };

    let start = RunStart::new(&truth, conditions)?;
    let largest_psi = largest_psi(&truth, conditions, &start, options.seed)?;
    let mut out = CrossCheck {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        carry: scheme.carry,
        filter: (!options.filter.is_none()).then(|| options.filter.words(scheme)),
        conditions: conditions_report(scheme, &truth, conditions),
        timeline: timeline_report(&truth),
        passed: false,
        verdicts_agree: false,
        disagreements: Vec::new(),
        ranking: ranking(&structure.quantities),
        slopes: structure.slopes,
        orders: Measured::count(structure.quantities.iter().map(|q| (&q.slope, q.accuracy_order.is_some()))),
        quantities: structure.quantities,
        null_space: structure.null_space,
        defect: structure.defect,
        covariance,
        monte_carlo,
        controls,
        validity: Validity::of(&truth, conditions, &start.truth, largest_psi)?,
        correlation: structure.correlation,
        seed: options.seed,
        error_bound: prediction.error_bound,
    };
    out.disagreements = disagreements(&out);
    out.verdicts_agree = out.disagreements.is_empty();
    out.disagreements.extend(misfits(&out));
    out.passed = out.disagreements.is_empty();
    Ok(out)
}

/// Evidence c.
fn covariances(scheme: &Scheme, conditions: &Conditions) -> Result<Vec<Difference>, SimulationError> {
    let still = still(conditions);
    let plan = Plan::new(scheme, &still)?;
    let start = RunStart::new(&plan, &still)?;
    let batch = batch(&plan, SquareRootInformation::prior(&start.sigma)?)?;
    let root = &batch.to_end * batch.information.inverse_root()?;
    let expected = &root * root.transpose();
    let mut out = Vec::new();
    let wider = start.sigma.iter().enumerate().map(|(i, s)| s * s / expected[(i, i)]).fold(0.0, f64::max);
    for (form, name, limit) in COVARIANCE_LIMITS {
        // the digits of P that rounding takes are those of the largest variance, the prior's, beside the smallest
        if form == Form::Joseph && wider * f64::EPSILON > limit / 10.0 {
            continue;
        }
        let p = last_covariance(&plan, &start, form)?.matrix();
        let n = plan.unknowns();
        let scale = |i: usize, j: usize| (expected[(i, i)] * expected[(j, j)]).sqrt();
        let relative = |k: usize| (p[(k / n, k % n)] - expected[(k / n, k % n)]).abs() / scale(k / n, k % n);
        // NaN stays
        let difference =
            (0..n * n).map(relative).fold(0.0, |a: f64, b| if b <= a || a.is_nan() { a } else { b });
        out.push(Difference {
            name: format!("{name} against the inverse information"),
            difference,
            limit,
            pass: difference <= limit,
        });
    }
    Ok(out)
}

/// Evidence e: the predicted accuracy orders against those read off the slopes, unobservable last.
fn ranking(quantities: &[QuantityEvidence]) -> Ranking {
    const LAST: i64 = 1000;
    // an order that no slope shows has no rank
    let quantities = || quantities.iter().filter(|q| q.slope.measured.is_none() || q.slope.pass.is_some());
    // determined at the start and at the end
    let both = |q: &&QuantityEvidence| q.inflation.predicted < 5.0;
    let predicted = |q| Some(q).filter(both).and_then(|q| q.accuracy_order).map_or(LAST, |d| d as i64);
    let predicted: Vec<i64> = quantities().map(predicted).collect();
    let measured: Vec<i64> = quantities()
        .map(|q| match (q.slope.measured, q.inflation.measured) {
            (Some(slope), Some(ratio)) if ratio < 5.0 && slope < -0.25 => (-slope - 0.5).round() as i64,
            _ => LAST,
        })
        .collect();
    let kendall_tau = kendall_tau_b(&predicted, &measured);
    Ranking { kendall_tau, pass: kendall_tau.map_or(predicted == measured, |t| t > 1.0 - 1e-12) }
}

/// Evidence f: filters with another carry, at another latitude, without a position. Repositioning is instantaneous,
/// since a filter that does not know of a position does not know of a slew either.
fn controls(
    scheme: &Scheme,
    conditions: &Conditions,
    prediction: &Prediction,
    seed: u64,
) -> Result<Vec<Control>, SimulationError> {
    let conditions = &Conditions { slews: false, ..conditions.clone() };
    let truth = Plan::new(scheme, conditions)?;
    let other = if scheme.carry == Carry::Platform { Carry::Inertial } else { Carry::Platform };
    // far away: a filter at a latitude close by is hardly wrong
    let latitude = truth.platform.scheme().latitude.map_or(0.0, |l| l.degrees().abs());
    let elsewhere = if latitude > 45.0 { "0" } else { "90" };
    let last = scheme.positions.len() - 1;
    let many = last > 0;
    let changes = [
        FilterChange { carry: many.then_some(other), ..FilterChange::default() },
        FilterChange { latitude: elsewhere.parse().ok(), ..FilterChange::default() },
        FilterChange { dropped: many.then_some(last), ..FilterChange::default() },
    ];
    let mut out = Vec::new();
    for change in changes.iter().filter(|c| !c.is_none()) {
        let filter_scheme = change.apply(scheme);
        let filter_conditions = conditions.within(&Platform::new(filter_scheme.clone())?);
        let filter = Plan::new(&filter_scheme, &filter_conditions)?;
        // a repeated position, say: the change changes nothing
        if filter.stages == truth.stages {
            continue;
        }
        // what a wrong filter's numbers do not resolve is no check of it
        let (failed, checks) = match structure(&truth, prediction, &filter_scheme, &filter_conditions) {
            Ok(structure) => structure.failures(),
            Err(e) if e.is_numeric() => (0, 0),
            Err(e) => return Err(e),
        };
        let experiment = Experiment { filter: &filter, truth: &truth, conditions, null_space: None, seed };
        let prepared = Prepared::new(experiment)?;
        let statistics = prepared.statistics(&prepared.run(CONTROL_RUNS, &|_| true));
        let Some(nis) = statistics.last() else { continue };
        out.push(Control {
            name: format!("filter {}", change.words(scheme)),
            failed,
            checks,
            nis: nis.measured,
            band: nis.wide_band,
            pass: failed > 0 || !nis.pass,
        });
    }
    Ok(out)
}

/// What failed of d, in words.
fn misfits(c: &CrossCheck) -> Vec<String> {
    let mut out = Vec::new();
    for s in c.monte_carlo.statistics.iter().filter(|s| !s.pass) {
        let (low, high) = s.wide_band;
        out.push(format!("{} is {:.4}, outside {low:.3}..{high:.3}", s.name, s.measured));
    }
    if !c.monte_carlo.white {
        out.push("innovations are not white".into());
    }
    out
}

/// What failed of a, b, c, e and f, in words.
fn disagreements(c: &CrossCheck) -> Vec<String> {
    let mut out = Vec::new();
    let failed = |c: &Check| c.measured.filter(|_| c.fails());
    for q in &c.quantities {
        if !q.modelled {
            out.push(format!("{}: the filter has no such unknown", q.name));
        }
        if let Some(found) = failed(&q.slope) {
            out.push(format!("{}: slope {found:.3} instead of {:.1}", q.name, q.slope.predicted));
        }
        if let Some(found) = failed(&q.inflation) {
            let expected = q.inflation.predicted;
            out.push(format!("{}: prior inflation {found:.3} instead of {expected:.0}", q.name));
        }
    }
    for v in &c.null_space {
        if v.seen.fails() {
            out.push(format!("{}: the filter sees this direction", v.direction));
        }
        if v.correlation.is_some_and(|k| k.fails()) {
            out.push(format!("{}: correlation is not +-1", v.direction));
        }
    }
    if !c.defect.pass {
        out.push(format!("{} directions unseen instead of {}", c.defect.measured, c.defect.predicted));
    }
    out.extend(c.covariance.iter().filter(|d| !d.pass).map(|d| format!("{}: {:.1e}", d.name, d.difference)));
    if !c.ranking.pass {
        out.push("predicted and measured orders rank differently".into());
    }
    for control in c.controls.iter().filter(|k| !k.pass) {
        out.push(format!("{} was not found out", control.name));
    }
    out
}

/// The band of the mean of `count` chi-square variables of `dof` degrees of freedom, 95 %.
pub fn mean_band(dof: usize, count: usize) -> (f64, f64) {
    chi_square_band(dof as f64, count as f64, obsdeg_ekf::consistency::CONFIDENCE)
}

//! Simulation of a scheme: one run, and its summary.

use nalgebra::DMatrix;
use obsdeg_core::degree::Status;
use obsdeg_core::model::Scheme;
use obsdeg_core::model::settings::FilterKind;

use super::answer::{
    Estimate, LinearEstimate, Outcome, RunDiffers, RunRequirements, SCHEMA, SigmaRatio, Simulation,
};
use super::attained::{Attained, added_to, run_contributions};
use super::carries::other_carries;
use super::conditions::{Conditions, PRIOR, REQUIRED, resolve, shown_unit, si_per_shown};
use super::consistency::{Consistency, Outcomes};
use super::error::SimulationError;
use super::floor::noise_floor;
use super::plan::Plan;
use super::record::{RunRecord, run};
use super::reports::{conditions_report, timeline_report};
use super::seen::predict_run;
use super::start::RunStart;
use crate::prediction::{PredictedCombination, Prediction};
use crate::requirements::{Miss, RequirementClaim, Requirements, SigmaSource, meets};
use crate::simulation::omitted::omitted_effects;

/// Simulates one run of `scheme`: the summary and the time series.
///
/// # Errors
/// [`SimulationError`].
pub fn simulate(
    scheme: &Scheme,
    conditions: &Conditions,
    seed: u64,
) -> Result<(Simulation, RunRecord), SimulationError> {
    let plan = Plan::new(scheme, conditions)?;
    let start = RunStart::new(&plan, conditions)?;
    let prediction = predict_run(&plan, &start.sigma[..plan.unknowns()], seed)?;
    let record = run(&plan, conditions, &start, &prediction, seed)?;
    let bench = run_contributions(&plan, conditions, &start)?;
    let summary = summary((scheme, &plan, conditions), &prediction, &record, &bench, seed)?;
    Ok((summary, record))
}

fn summary(
    (scheme, plan, conditions): (&Scheme, &Plan, &Conditions),
    prediction: &Prediction,
    record: &RunRecord,
    bench: &DMatrix<f64>,
    seed: u64,
) -> Result<Simulation, SimulationError> {
    let requirements = resolve(REQUIRED, &plan.platform, &conditions.requirements, f64::NAN)?;
    let attained = Attained::new(scheme, conditions, seed)?;
    let estimates = RunEstimates { plan, prediction, record, bench, requirements, attained: &attained };
    let quantities = estimates.unknowns();
    let combinations = estimates.combinations()?;
    let consistency = Consistency::of(Outcomes {
        whitened: &record.whitened,
        outputs: plan.components.len(),
        error: record.last_error.clone(),
        covariance: &record.last_covariance,
        normalised: quantities.iter().map(|q| (q.name.as_str(), q.error_over_sigma)).collect(),
        free: None,
        resolution: 0.0,
    })?;
    let noise_floor = noise_floor(scheme, conditions, prediction)?;
    Ok(Simulation {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        carry: scheme.carry,
        conditions: conditions_report(scheme, plan, conditions),
        timeline: timeline_report(plan),
        requirements: attained.requirements(conditions)?,
        run: run_requirements((plan, bench), conditions, &quantities, record)?,
        other_carries: other_carries(scheme, conditions, seed)?,
        omitted: omitted_effects(&attained, conditions, seed)?,
        quantities,
        combinations,
        consistency,
        filter: record.filter,
        validity: record.validity.clone(),
        noise_floor,
        gimbals: scheme.gimbal_report(),
        seed,
    })
}

/// Estimates of a run, with the required and the predicted sigmas.
struct RunEstimates<'a> {
    plan: &'a Plan,
    prediction: &'a Prediction,
    record: &'a RunRecord,
    /// Contributions of a bench.
    bench: &'a DMatrix<f64>,
    /// Required sigma by unknown; NaN where none is stated.
    requirements: Vec<f64>,
    attained: &'a Attained,
}

impl RunEstimates<'_> {
    /// Required sigma of the unknown `c`.
    fn required(&self, c: usize) -> Option<f64> {
        Some(self.requirements[c]).filter(|r| !r.is_nan())
    }

    /// Estimates of the unknowns.
    fn unknowns(&self) -> Vec<Estimate> {
        let (names, units) = (self.plan.platform.names(), self.plan.platform.units());
        let unknowns = self.prediction.unknowns.iter().enumerate().map(|(c, u)| {
            let verdict = (u.status, u.degree, u.accuracy_order, u.determined_at_end);
            let wanted = [self.required(c), self.attained.sigmas[c]];
            let bench = added_to(self.bench, &[(c, 1.0)]) / si_per_shown(units[c]);
            estimate(&names[c], units[c], verdict, (c, self.record), wanted, bench)
        });
        let mut out: Vec<Estimate> = unknowns.collect();
        let predicted = &self.prediction.unknowns;
        for (q, u) in out.iter_mut().zip(predicted).filter(|(q, _)| q.outcome == Outcome::PriorOnly) {
            let unseen = u.partners.iter().filter(|&&p| !predicted[p].determined_at_end);
            q.prior_of = unseen.map(|&p| names[p].clone()).collect();
        }
        out
    }

    /// Estimates of the combinations.
    ///
    /// # Errors
    /// [`SimulationError`].
    fn combinations(&self) -> Result<Vec<Estimate>, SimulationError> {
        let (n, units) = (self.plan.unknowns(), self.plan.platform.units());
        let of = |(i, c): (usize, &PredictedCombination)| -> Result<Estimate, SimulationError> {
            let verdict = (c.status, c.degree, c.accuracy_order, c.determined_at_end);
            let lead = c.terms[0].0;
            let predicted = self.attained.sigma_of(&c.terms)? / si_per_shown(units[lead]);
            let wanted = [self.required(lead), c.determined_at_end.then_some(predicted)];
            let bench = added_to(self.bench, &c.terms) / si_per_shown(units[lead]);
            Ok(estimate(&c.expression, units[lead], verdict, (n + i, self.record), wanted, bench))
        };
        self.prediction.combinations.iter().enumerate().map(of).collect()
    }
}

/// Outcome of the requirements in the run, and the reasons why its sigmas may differ from the predicted ones.
fn run_requirements(
    (plan, bench): (&Plan, &DMatrix<f64>),
    conditions: &Conditions,
    quantities: &[Estimate],
    record: &RunRecord,
) -> Result<RunRequirements, SimulationError> {
    let units = plan.platform.units();
    let claims = quantities.iter().enumerate().map(|(c, q)| {
        // the truth of the run has no errors of the bench: their contribution is added to its sigma
        let total = q.sigma.hypot(added_to(bench, &[(c, 1.0)]) / si_per_shown(units[c]));
        // an unknown that a stated prior bounds counts, as in the prediction
        let sigma = match q.outcome.miss() {
            Some(Miss::NotObservable) if q.predicted_sigma.is_some() => Ok(total),
            Some(why) => Err(why),
            None => Ok(total),
        };
        RequirementClaim { name: &q.name, required: q.required_sigma, sigma }
    });
    let mut requirements = Requirements::of(SigmaSource::Run, claims);
    requirements.with_bench = bench.ncols() > 0;
    let ratio = |q: &Estimate| {
        let ratio = q.sigma / q.predicted_sigma?;
        ratio.is_finite().then(|| SigmaRatio { name: q.name.clone(), ratio })
    };
    let by_ratio = |a: &SigmaRatio, b: &SigmaRatio| a.ratio.total_cmp(&b.ratio);
    let priors = resolve(PRIOR, &plan.platform, conditions.stated_priors(), f64::NAN)?;
    let differs = [
        (RunDiffers::RandomDrift, !conditions.states().drift_noise && conditions.drift_noise.amount() > 0.0),
        (RunDiffers::Prior, priors.iter().any(|p| p.is_nan())),
        (RunDiffers::FullAttitudes, record.filter.kind != FilterKind::Linear),
    ];
    Ok(RunRequirements {
        requirements,
        largest_ratio: quantities.iter().filter_map(ratio).max_by(by_ratio),
        smallest_ratio: quantities.iter().filter_map(ratio).min_by(by_ratio),
        differs: differs.into_iter().filter_map(|(reason, here)| here.then_some(reason)).collect(),
    })
}

/// Estimate of series `i` at the end. `verdict` is the exact one, with a flag that is true if samples
/// determine the quantity. The last arguments are the required and the predicted sigma, and the contribution
/// of a bench to sigma.
fn estimate(
    name: &str,
    unit: &str,
    verdict: (Status, Option<usize>, Option<usize>, bool),
    (i, record): (usize, &RunRecord),
    [required_sigma, predicted_sigma]: [Option<f64>; 2],
    bench: f64,
) -> Estimate {
    let (status, degree, accuracy_order, determined) = verdict;
    let (series, scale) = (&record.traces.series[i], si_per_shown(unit));
    let last = |v: &[f64]| v.last().map_or(f64::NAN, |x| x / scale);
    let (truth, estimate, sigma) = (last(&series.truth), last(&series.estimate), last(&series.sigma));
    let prior_sigma = series.sigma[0] / scale;
    let linear = record.traces.linear.as_ref().map(|all| {
        let s = &all[i];
        LinearEstimate { error: last(&s.estimate) - truth, sigma: last(&s.sigma) }
    });
    let error = estimate - truth;
    let error_over_sigma = if error == 0.0 { 0.0 } else { error / sigma };
    // first time from which sigma meets the requirement to the end; the contribution of the bench is known at
    // the end only
    let total = sigma.hypot(bench);
    let reached = required_sigma.and_then(|r| {
        let missed = series.sigma.iter().rposition(|s| !meets(s / scale, r));
        missed.map_or(Some(0), |i| (i + 1 < series.sigma.len()).then_some(i + 1))
    });
    Estimate {
        name: name.into(),
        unit: shown_unit(unit).into(),
        status,
        degree,
        accuracy_order,
        truth,
        estimate,
        error,
        sigma,
        predicted_sigma,
        error_over_sigma,
        linear,
        prior_sigma,
        required_sigma,
        time_to_requirement_s: reached
            .filter(|_| determined && required_sigma.is_some_and(|r| meets(total, r)))
            .map(|i| record.traces.time[i]),
        outcome: Outcome::of(
            determined,
            record.filter.kind,
            error_over_sigma,
            // a smaller sigma of the linear filter without samples is no effect of large angles
            [linear.filter(|_| !determined).map_or(prior_sigma, |l| l.sigma.min(prior_sigma)), sigma],
            required_sigma.map(|r| (r, total)),
        ),
        prior_of: Vec::new(),
    }
}

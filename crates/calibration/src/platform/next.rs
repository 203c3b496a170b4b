//! Further runs that would bring a coefficient to its requirement, each of them computed.
//!
//! A run is a dwell at one attitude, calibrated with this answer as prior information on the coefficients,
//! and a psi of its own. Attitudes are the 24 cardinal ones and those of the scheme. Sigmas are those of the
//! linear model with all coefficients zero, with the noise and the random drift of this answer, and the
//! sampling density of its records.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::{Dwell, Euler, Position, Scheme, cardinal, cardinal_name, cardinal_names};
use obsdeg_evidence::simulation::{Plan, PlanSegment, RunStart, predict, si_per_shown};

use super::diagnose::data::AnswerData;
use super::estimate::{RunUnknowns, WEAK};
use super::run::noise_root;
use super::{CalibrationError, known};
use crate::answer::{Calibration, CovarianceTable, Estimated, NextRun};
use crate::least_squares::{LeastSquaresSolution, Linearised, StackedRows, StartInformation};

/// Longest dwell, in longest dwells of the scheme.
const LONGEST: f64 = 16.0;
/// Number of steps of a dwell: sample noise and random drift are those of the mean over a step.
const STEPS: usize = 100;
/// Largest relative error of a dwell.
const EXACT: f64 = 0.01;

/// Attitudes that are tried, with their names.
fn candidates(scheme: &Scheme) -> Vec<(String, Euler)> {
    let mut out: Vec<(String, Euler)> =
        cardinal_names().into_iter().filter_map(|n| cardinal(&n).map(|a| (n, a))).collect();
    for p in &scheme.positions {
        if cardinal_name(&p.angles).is_none() && out.iter().all(|(_, a)| *a != p.angles) {
            out.push((p.name.clone(), p.angles.clone()));
        }
    }
    out.retain(|(_, angles)| scheme.gimbals.reach(angles));
    out
}

/// Covariance of the coefficients, and the conditions of a further run.
struct Further<'p, 'a> {
    parts: &'p AnswerData<'a>,
    table: CovarianceTable,
    /// Variance of a mean over one second, by channel, as the fit has it.
    variances: Vec<f64>,
}

impl AnswerData<'_> {
    /// Further runs, one per missed requirement: the attitude that brings the coefficient closest to it, and
    /// the dwell that meets it. `bench` has the contributions of a bench by name, which no run reduces.
    ///
    /// # Errors
    /// [`CalibrationError`] when a number is not finite.
    pub(super) fn next_runs(
        &self,
        of: &Calibration,
        bench: &[(String, f64)],
    ) -> Result<Vec<NextRun>, CalibrationError> {
        let added = |name: &str| bench.iter().find(|(of, _)| of == name).map_or(0.0, |(_, added)| *added);
        // sigma that is required of the records, and the requirements that they miss
        let target = |e: &Estimated| {
            let sigma = (e.required_sigma?.powi(2) - added(&e.name).powi(2)).max(0.0).sqrt();
            let own = e.sigma_rescaled.zip(e.sigma).map(|(r, s)| r.max(s));
            own.is_none_or(|s| s > sigma).then_some(sigma)
        };
        let missed: Vec<(&Estimated, f64)> =
            of.quantities.iter().filter_map(|e| Some((e, target(e)?))).collect();
        if missed.is_empty() || self.interrupted || !self.estimate.converged {
            return Ok(Vec::new());
        }
        let further = self.further(of);
        let dwells =
            self.scheme.positions.iter().map(|p| p.dwell.map_or(self.conditions.dwell_s, |d| d.seconds()));
        let dwell = dwells.fold(0.0, f64::max);
        let mut sigmas: Vec<(&Euler, Vec<f64>)> = Vec::new();
        let all = candidates(self.scheme);
        for (_, angles) in &all {
            // skip attitudes that no plan accepts
            let Ok(solution) = further.with(angles, dwell) else { continue };
            sigmas.push((angles, missed.iter().map(|(e, _)| further.sigma(&solution, &e.name)).collect()));
        }
        let mut out = Vec::new();
        for (k, &(e, required)) in missed.iter().enumerate() {
            // the contribution of the bench exceeds the requirement: no run helps
            if required == 0.0 {
                out.push(no_run(e));
                continue;
            }
            let Some((angles, own)) = sigmas.iter().min_by(|a, b| a.1[k].total_cmp(&b.1[k])) else {
                continue;
            };
            let name = all.iter().find(|(_, a)| a == *angles).map_or_else(String::new, |(n, _)| n.clone());
            let (dwell_s, sigma) = further.dwell(angles, &e.name, required, (dwell, own[k]))?;
            let improves = e.sigma_rescaled.is_none_or(|s| sigma < 0.99 * s) && sigma.is_finite();
            out.push(NextRun {
                required_sigma: required,
                attitude: improves.then_some(name),
                dwell_s: improves.then_some(dwell_s),
                sigma_then: improves.then_some(sigma),
                met: sigma <= required,
                ..no_run(e)
            });
        }
        Ok(out)
    }

    /// Conditions of a further run after the answer `of`.
    fn further(&self, of: &Calibration) -> Further<'_, '_> {
        let interval = self.problem.runs.iter().map(|run| run.reading.interval).fold(f64::INFINITY, f64::min);
        let factor = of.fit.factor.max(1.0);
        let variances = self.problem.sigmas.iter().map(|s| s * s * factor * factor * interval).collect();
        let rescaled = of.covariance.rescaled.clone();
        let table = CovarianceTable { covariance: rescaled, ..of.covariance.clone() };
        Further { parts: self, table, variances }
    }
}

/// No further run for a coefficient, whose requirement no run meets.
fn no_run(e: &Estimated) -> NextRun {
    NextRun {
        unknown: e.name.clone(),
        unit: e.unit.clone(),
        sigma: e.sigma_rescaled,
        required_sigma: 0.0,
        attitude: None,
        dwell_s: None,
        sigma_then: None,
        met: false,
    }
}

impl Further<'_, '_> {
    /// Coefficients by this answer and a dwell of `dwell_s` at an attitude.
    fn with(&self, angles: &Euler, dwell_s: f64) -> Result<LeastSquaresSolution, CalibrationError> {
        let (scheme, conditions) = (self.parts.scheme, self.parts.conditions);
        let own = Position {
            name: "p1".into(),
            angles: angles.clone(),
            dwell: Dwell::from_seconds(dwell_s),
            rotation: None,
            slew: None,
        };
        let scheme = Scheme { positions: vec![own], ..scheme.clone() };
        let conditions = super::run::conditions(conditions);
        let step = dwell_s / STEPS as f64;
        let plan = Plan::derived(&scheme, &conditions)?
            .in_steps(&conditions, |_: &PlanSegment| vec![(STEPS, step)])?;
        let prediction = predict(&plan, self.parts.options.seed)?;
        let start = RunStart::new(&plan, &conditions)?;
        let (n, coefficients, biases) = (plan.unknowns(), plan.platform.coefficients(), plan.biases.len());
        let unknowns = RunUnknowns::new(
            1,
            [n - coefficients, coefficients, biases],
            &start.sigma,
            &start.estimate,
            &[],
            &vec![false; n + biases],
        );
        let information = StartInformation::of(&self.run(&plan, step))?;
        let mut rows = StackedRows::new(unknowns.n);
        let mut wide = DMatrix::zeros(information.root.nrows(), unknowns.n);
        for (s, &i) in unknowns.index[0].iter().enumerate() {
            wide.set_column(i, &information.root.column(s));
        }
        rows.add(&wide, &DVector::zeros(wide.nrows()));
        let (before, _) = known(&self.table, &plan, &prediction, &unknowns)?;
        rows.add(&before.rows, &DVector::zeros(before.rows.nrows()));
        // random biases have priors of their own
        let pull = unknowns.prior.iter().enumerate();
        let pull = pull.map(|(i, s)| 1.0 / if unknowns.biases.contains(&i) { *s } else { WEAK * s });
        let pull = DVector::from_iterator(unknowns.n, pull);
        rows.add(&DMatrix::from_diagonal(&pull), &DVector::zeros(unknowns.n));
        Ok(rows.solve()?)
    }

    /// Plan linearised at zero unknowns, with a measurement at the end of every step.
    fn run(&self, plan: &Plan, step: f64) -> Linearised {
        let mut out = Linearised::default();
        for (segment, stage) in plan.stages.iter().enumerate() {
            let mut one = stage.clone();
            one.steps = 1;
            one.outputs.iter_mut().zip(&self.variances).for_each(|(o, v)| o.r = v / step);
            for _ in 0..stage.steps {
                out.residuals.extend(one.outputs.iter().map(|_| 0.0));
                out.roots.push(noise_root(plan, segment, plan.states()));
                out.stages.push(one.clone());
            }
        }
        out
    }

    /// Sigma of a coefficient, in its shown unit.
    fn sigma(&self, of: &LeastSquaresSolution, name: &str) -> f64 {
        let platform = &self.parts.planned.platform;
        // a run of one position has the psi of the scheme: the coefficients follow it
        let coefficients = platform.coefficients();
        let first = platform.names().len() - coefficients;
        let Some(k) = platform.names().iter().position(|n| n == name).and_then(|k| k.checked_sub(first))
        else {
            return f64::INFINITY;
        };
        let n = of.x.len();
        of.sigma(&[(n - coefficients + k, 1.0)]) / si_per_shown(platform.units()[first + k])
    }

    /// Shortest dwell at an attitude with which a coefficient has a sigma of at most `required`, and that
    /// sigma; the longest dwell if none has. `from` is a dwell with its sigma.
    fn dwell(
        &self,
        angles: &Euler,
        name: &str,
        required: f64,
        from: (f64, f64),
    ) -> Result<(f64, f64), CalibrationError> {
        let at =
            |dwell: f64| Ok::<_, CalibrationError>((dwell, self.sigma(&self.with(angles, dwell)?, name)));
        let (mut short, mut long) = (0.0, from);
        while long.1 > required && long.0 < 0.99 * LONGEST * from.0 {
            (short, long) = (long.0, at(2.0 * long.0)?);
        }
        while long.1 <= required && long.0 - short > EXACT * long.0 && long.0 > 1.0 {
            let middle = at((short + long.0) / 2.0)?;
            if middle.1 <= required { long = middle } else { short = middle.0 }
        }
        // a whole number of seconds
        at(long.0.ceil())
    }
}

//! Accuracy that a scheme attains at its end under the stated conditions: the one figure for requirements.
//!
//! All samples count, with the stated noise, random drift and biases. The only prior knowledge is that of the
//! stated priors. Coefficients are constants. psi is that of the end of the scheme, with which the platform
//! is used. Under reset carry each position has a psi of its own, that of its end.

use nalgebra::{DMatrix, RowDVector};
use obsdeg_core::model::{OmittedModel, Scheme};
use obsdeg_ekf::linear::last_covariance;
use obsdeg_ekf::{Covariance, CovarianceForm, EkfError, SquareRootInformation};

use super::batch::{Batch, batch};
use super::conditions::{Conditions, PRIOR, REQUIRED, is_rate, resolve, si_per_shown};
use super::error::SimulationError;
use super::floor::wide_prior;
use super::known::KnownCovariance;
use super::plan::Plan;
use super::seen::{no_prior, predict};
use super::start::RunStart;
use crate::prediction::Prediction;
use crate::requirements::{Miss, RequirementClaim, Requirements, Worst};
use crate::simulation::omitted::bench::Bench;
use crate::simulation::omitted::weights::{self, Influence};

/// Factor by which a second diffuse prior is narrower. If it narrows the sigma of an unknown, only the prior
/// bounds that unknown.
const NARROWER: f64 = 100.0;
/// Largest ratio of the sigmas under both priors for an unknown that samples and stated priors bound.
const BOUNDED: f64 = 1.05;

/// Accuracy of a scheme at its end.
#[derive(Debug, Clone)]
pub struct Attained {
    /// Plan of the scheme, without random drift that is not stated.
    pub plan: Plan,
    /// Exact verdicts on the scheme.
    pub prediction: Prediction,
    /// Sigma of every unknown in its shown unit (deg, deg/h, ...); `None` where neither samples nor stated
    /// priors bound the unknown.
    pub sigmas: Vec<Option<f64>>,
    /// Total uncertainty of every unknown in its shown unit: sigma and the contribution of the errors of the
    /// bench. It equals sigma where no bench is stated.
    pub totals: Vec<Option<f64>>,
    /// True for an unknown that the samples do not determine and stated priors bound.
    pub by_prior: Vec<bool>,
    known: EndCovariance,
    /// Prior standard deviations of the unknowns, in SI units: stated, or so wide that they do not matter.
    prior: Vec<f64>,
    /// Rows of information known beforehand with its covariance (m x n, SI units).
    rows: DMatrix<f64>,
    /// True if random drift, biases or such rows require a filter.
    noisy: bool,
    /// Changes of the estimates by one sigma of every error of the bench (n x errors, SI units); no columns
    /// without a bench.
    contributions: DMatrix<f64>,
}

/// Covariance of the unknowns at the end in SI units, as a root. An unbounded unknown has a huge variance; in
/// a determined combination of such unknowns these cancel before squaring only.
#[derive(Debug, Clone)]
enum EndCovariance {
    /// A root of the covariance (n x n).
    Root(DMatrix<f64>),
    /// The covariance of a filter as `U diag(d) U^T`; biases behind the unknowns.
    Filter(Covariance),
}

impl EndCovariance {
    /// Variance of a combination of unknowns, `(unknown, coefficient)`.
    fn variance(&self, terms: &[(usize, f64)]) -> Result<f64, EkfError> {
        match self {
            Self::Root(root) => {
                let zero = RowDVector::zeros(root.ncols());
                Ok(terms.iter().fold(zero, |sum, &(c, k)| sum + root.row(c) * k).norm_squared())
            }
            Self::Filter(p) => p.variance(terms),
        }
    }
}

impl Attained {
    /// Accuracy of `scheme` under the stated `conditions`.
    ///
    /// # Errors
    /// [`SimulationError`].
    pub fn new(scheme: &Scheme, conditions: &Conditions, seed: u64) -> Result<Self, SimulationError> {
        Self::beside(scheme, conditions, None, seed)
    }

    /// Accuracy of `scheme` under `conditions`, with a covariance that is known beforehand.
    ///
    /// # Errors
    /// [`SimulationError`].
    pub fn beside(
        scheme: &Scheme,
        conditions: &Conditions,
        beforehand: Option<&KnownCovariance>,
        seed: u64,
    ) -> Result<Self, SimulationError> {
        let conditions = conditions.as_stated();
        Self::of_plan(Plan::new(scheme, &conditions)?, &conditions, beforehand, seed)
    }

    /// Accuracy of a plan made of `conditions` without random drift that is not stated.
    fn of_plan(
        plan: Plan,
        conditions: &Conditions,
        beforehand: Option<&KnownCovariance>,
        seed: u64,
    ) -> Result<Self, SimulationError> {
        let prediction = predict(&plan, seed)?;
        let stated = stated_prior(&plan, conditions)?;
        let rows = match beforehand {
            Some(known) => known.rows(&plan, &prediction)?,
            None => DMatrix::zeros(0, plan.unknowns()),
        };
        let noisy = conditions.drift_noise.amount() > 0.0 || plan.is_noisy() || beforehand.is_some();
        let wide = if noisy { wide_prior(&plan, conditions)? } else { no_prior(&plan)? };
        let prior = |narrower: f64| -> Vec<f64> {
            stated.iter().zip(&wide).map(|(s, w)| s.unwrap_or(w / narrower)).collect()
        };
        let with = |narrower: f64| -> Result<EndCovariance, SimulationError> {
            let sigma = prior(narrower);
            if noisy { filtered(&plan, sigma, &rows) } else { by_information(&plan, sigma) }
        };
        let known = with(1.0)?;
        let determined: Vec<bool> = prediction.unknowns.iter().map(|u| u.determined_at_end).collect();
        let n = determined.len();
        let mut by_prior = vec![false; n];
        let some_prior = stated.iter().any(Option::is_some) || beforehand.is_some();
        if some_prior && determined.contains(&false) {
            let narrow = with(NARROWER)?;
            for c in (0..n).filter(|&c| !determined[c]) {
                let [wide, narrow] = [known.variance(&[(c, 1.0)])?, narrow.variance(&[(c, 1.0)])?];
                by_prior[c] = wide <= BOUNDED * BOUNDED * narrow;
            }
        }
        let units = plan.platform.units();
        let mut sigmas = vec![None; n];
        for c in (0..n).filter(|&c| determined[c] || by_prior[c]) {
            sigmas[c] = Some(known.variance(&[(c, 1.0)])?.max(0.0).sqrt() / si_per_shown(units[c]));
        }
        let (totals, prior) = (sigmas.clone(), prior(1.0));
        let contributions = DMatrix::zeros(n, 0);
        let mut out =
            Self { prior, rows, plan, prediction, sigmas, totals, by_prior, known, noisy, contributions };
        if !conditions.bench.is_empty() {
            out.add_bench(conditions)?;
        }
        Ok(out)
    }

    /// Computes the total uncertainties with the bench of `conditions`.
    fn add_bench(&mut self, conditions: &Conditions) -> Result<(), SimulationError> {
        let model = OmittedModel::new(&self.plan.platform);
        let bench = Bench::of(&conditions.bench, &model)?;
        if bench.is_empty() {
            return Ok(());
        }
        let influence = self.influence(&model)?;
        let changes = influence.shown(self.plan.platform.units(), &self.sigmas, &model, None);
        self.totals = bench.totals(&self.sigmas, &changes);
        let units = self.plan.platform.units();
        let size = |j: usize| bench.sizes[j].unwrap_or(0.0);
        let entry = |c: usize, j: usize| changes[c][j] * size(j) * si_per_shown(units[c]);
        self.contributions = DMatrix::from_fn(units.len(), bench.sizes.len(), entry);
        Ok(())
    }

    /// Standard deviations of the unknowns before the scheme (SI): stated ones, else wide ones.
    pub fn priors(&self) -> &[f64] {
        &self.prior
    }

    /// Influence of omitted errors on the estimates, by the weights of the sigmas.
    ///
    /// # Errors
    /// [`SimulationError`].
    pub fn influence(&self, model: &OmittedModel) -> Result<Influence, SimulationError> {
        if self.noisy {
            weights::by_filter(&self.plan, model, filter_prior(&self.plan, self.prior.clone(), &self.rows)?)
        } else {
            weights::by_information(&self.plan, model, &self.prior)
        }
    }

    /// Sigma, in SI units, of a combination of unknowns, `(unknown, coefficient)` in SI units.
    ///
    /// # Errors
    /// [`EkfError`] for a coefficient that is not finite, or an index beyond the unknowns.
    pub fn sigma_of(&self, terms: &[(usize, f64)]) -> Result<f64, EkfError> {
        Ok(self.known.variance(terms)?.max(0.0).sqrt())
    }

    /// True if the stated bench has a size for an omitted error.
    pub fn has_bench(&self) -> bool {
        self.contributions.ncols() > 0
    }

    /// Covariance of some unknowns in SI units, in the given order, with the errors of a stated bench.
    ///
    /// # Errors
    /// [`EkfError`] for an index beyond the unknowns.
    pub fn covariance_of(&self, unknowns: &[usize]) -> Result<DMatrix<f64>, EkfError> {
        let n = unknowns.len();
        let mut out = DMatrix::zeros(n, n);
        for (i, &a) in unknowns.iter().enumerate() {
            for (j, &b) in unknowns.iter().enumerate() {
                let [sum, difference] = [1.0, -1.0].map(|k| self.known.variance(&[(a, 0.5), (b, 0.5 * k)]));
                let bench = self.contributions.row(a).dot(&self.contributions.row(b));
                out[(i, j)] = sum? - difference? + bench;
            }
        }
        Ok(out)
    }

    /// Outcome of the requirements that `conditions` state; those on unknowns that the scheme does not have
    /// are left out.
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`] for a requirement on a name that no scheme has.
    pub fn requirements(&self, conditions: &Conditions) -> Result<Requirements, SimulationError> {
        let conditions = conditions.within(&self.plan.platform);
        let required = resolve(REQUIRED, &self.plan.platform, &conditions.requirements, f64::NAN)?;
        let names = self.plan.platform.names();
        let claims = (0..names.len()).map(|c| RequirementClaim {
            name: &names[c],
            required: Some(required[c]).filter(|r| !r.is_nan()),
            sigma: self.totals[c].ok_or(Miss::NotObservable),
        });
        let mut out = Requirements::of(conditions.basis(), claims);
        out.with_bench = self.has_bench();
        let rests = |c: &usize| self.by_prior[*c] && !required[*c].is_nan();
        out.on_prior = (0..names.len()).filter(rests).map(|c| names[c].clone()).collect();
        Ok(out)
    }

    /// Largest sigma (total uncertainty with a bench) of the drift coefficients that satisfy `counts`; `None`
    /// if one of these has none. Other coefficients have other units and do not count.
    pub fn worst_of(&self, counts: &dyn Fn(&String) -> bool) -> Option<Worst> {
        let (units, names) = (self.plan.platform.units(), self.plan.platform.names());
        let mut worst: Option<Worst> = None;
        for c in (0..units.len()).filter(|c| is_rate(units[*c]) && counts(&names[*c])) {
            let sigma_dph = self.totals[c]?;
            if worst.as_ref().is_none_or(|w| sigma_dph > w.sigma_dph) {
                worst = Some(Worst { name: names[c].clone(), sigma_dph });
            }
        }
        worst
    }
}

/// Root sum of squares of the contributions of the columns of `contributions` (unknowns x errors) to a
/// combination of unknowns, `(unknown, coefficient)`.
pub(crate) fn added_to(contributions: &DMatrix<f64>, terms: &[(usize, f64)]) -> f64 {
    let change = |e: usize| terms.iter().map(|(c, k)| k * contributions[(*c, e)]).sum::<f64>();
    (0..contributions.ncols()).map(|e| change(e).powi(2)).sum::<f64>().sqrt()
}

/// Changes of the estimates of a run's filter by one sigma of every error of the bench (unknowns x errors, SI
/// units), by its own gains at small angles; no columns without a bench.
pub(crate) fn run_contributions(
    plan: &Plan,
    conditions: &Conditions,
    start: &RunStart,
) -> Result<DMatrix<f64>, SimulationError> {
    let model = OmittedModel::new(&plan.platform);
    let sizes = Bench::of(&conditions.bench, &model)?.sizes;
    let kept: Vec<usize> = (0..sizes.len()).filter(|&j| sizes[j].is_some_and(|s| s > 0.0)).collect();
    let n = plan.platform.names().len();
    if kept.is_empty() {
        return Ok(DMatrix::zeros(n, 0));
    }
    let own = model.only(&kept);
    let changes = weights::by_filter(plan, &own, start.covariance(CovarianceForm::Ud)?)?.changes;
    let size = |e: usize| sizes[kept[e]].unwrap_or(0.0) * si_per_shown(own.terms()[e].unit);
    Ok(DMatrix::from_fn(n, kept.len(), |c, e| changes[(c, e)] * size(e)))
}

/// Standard deviations of the stated priors in SI units (shape n); `None` where none is stated.
fn stated_prior(plan: &Plan, conditions: &Conditions) -> Result<Vec<Option<f64>>, SimulationError> {
    let sigmas = resolve(PRIOR, &plan.platform, conditions.stated_priors(), f64::INFINITY)?;
    let scale = |unit: &str| si_per_shown(unit) * if is_rate(unit) { conditions.drift_scale } else { 1.0 };
    let units = plan.platform.units().iter();
    Ok(sigmas.iter().zip(units).map(|(s, unit)| s.is_finite().then(|| s * scale(unit))).collect())
}

/// Covariance at the end by the information of all samples, with white noise of the samples only.
fn by_information(plan: &Plan, prior: Vec<f64>) -> Result<EndCovariance, SimulationError> {
    let Batch { information, to_end } = batch(plan, SquareRootInformation::prior(&prior)?)?;
    let root = information.inverse_root()?;
    let n = root.nrows();
    // sums in the same order on every machine: no product whose instructions depend on the processor
    let entry = |i: usize, j: usize| (0..n).map(|k| to_end[(i, k)] * root[(k, j)]).sum::<f64>();
    Ok(EndCovariance::Root(DMatrix::from_fn(n, n, entry)))
}

/// Covariance at the end of a filter, with random drift and biases.
fn filtered(plan: &Plan, sigma: Vec<f64>, rows: &DMatrix<f64>) -> Result<EndCovariance, SimulationError> {
    Ok(EndCovariance::Filter(last_covariance(&plan.stages, filter_prior(plan, sigma, rows)?)?))
}

/// Covariance of a filter at its start, biases behind the unknowns; `rows` are the information known
/// beforehand.
fn filter_prior(
    plan: &Plan,
    mut sigma: Vec<f64>,
    rows: &DMatrix<f64>,
) -> Result<Covariance, SimulationError> {
    let n = sigma.len();
    sigma.extend(plan.bias_sigmas());
    if rows.nrows() > 0 {
        let mut information = SquareRootInformation::prior(&sigma)?;
        let mut wide = DMatrix::zeros(rows.nrows(), sigma.len());
        wide.view_mut((0, 0), (rows.nrows(), n)).copy_from(rows);
        information.add(&wide)?;
        return Ok(Covariance::new("P0", &information.covariance()?, CovarianceForm::Ud)?);
    }
    RunStart { truth: Vec::new(), estimate: Vec::new(), sigma }.covariance(CovarianceForm::Ud)
}

#[cfg(test)]
mod tests {
    use obsdeg_core::model::scheme_file;

    use super::super::plan::timeline::{PlanSegment, SegmentKind, left_out};
    use super::*;

    /// Samples that are left out count as samples of a noise a million times larger do, also for the bench:
    /// errors that are not estimated enter the samples that remain at their own times. So by the information
    /// of all samples, and by a filter with random drift.
    #[test]
    fn left_out_samples_are_samples_of_great_noise() {
        let names = ["NUE", "USE", "EDN", "WND", "DNE"].map(|n| format!("[[position]]\nattitude = '{n}'\n"));
        for drift in ["", "drift_noise = '0.001 deg/sqrt(h)'\n"] {
            let text = format!(
                "carry = 'inertial'\nlatitude_deg = 40\n[simulation]\nslew_rate_deg_s = 2\ndwell_s = 300\n{drift}\
                 [bench]\nK0 = 20\nM = 5\nlatitude = 10\n[requirements]\nD = 0.1\n{}",
                names.concat()
            );
            let scheme = scheme_file::read(&text).expect("a scheme");
            let all = Conditions::of(&scheme).as_stated();
            for settle_s in [20.0, 47.0, 150.0] {
                let settling = Conditions { settle_s, ..all.clone() };
                let found = Attained::new(&scheme, &settling, 1).expect("sigmas");
                let parts = |s: &PlanSegment| {
                    let first = left_out(settle_s, s.dt);
                    vec![(first, s.dt), (s.steps - first, s.dt)]
                };
                let plan = Plan::new(&scheme, &all).expect("a plan").in_steps(&all, parts);
                let mut noisy = plan.expect("a plan");
                let mut before = None;
                for k in 0..noisy.segments.len() {
                    let s = &noisy.segments[k];
                    if s.kind == SegmentKind::Dwell && before != Some(s.position) {
                        before = Some(s.position);
                        noisy.stages[k].outputs.iter_mut().for_each(|o| o.r *= 1e12);
                    }
                }
                let noisy = Attained::of_plan(noisy, &all, None, 1).expect("sigmas");
                assert!(found.totals.iter().flatten().count() > 10);
                for (a, b) in found.totals.iter().zip(&noisy.totals) {
                    let (Some(a), Some(b)) = (a, b) else { panic!("{a:?} {b:?}") };
                    assert!((a / b - 1.0).abs() < 1e-4, "{drift} {settle_s} s: {a} {b}");
                }
            }
        }
    }
}

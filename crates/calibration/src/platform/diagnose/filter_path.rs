//! Residuals of a fit, each with its redundancy, and the filter as second path.

use std::cell::RefCell;
use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::linear::{SmoothedStart, filter_pass, smoothed_start};
use obsdeg_ekf::{Covariance, CovarianceForm, EkfError};
use obsdeg_evidence::prediction::Prediction;

use super::super::estimate::{LinearisedRecord, PlatformEstimate, PlatformProblem};
use super::super::run::MeasurementKey;
use crate::answer::SecondPath;
use crate::least_squares::{Linearised, RunState, StackedRows, StartInformation};

/// Factor by which the prior of the filter is wider than that of the scheme.
const WIDE: f64 = 100.0;

/// Measurement with its residual.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeasurementResidual {
    pub run: usize,
    pub key: MeasurementKey,
    /// Measurement minus estimate.
    pub residual: f64,
    /// Variance of the measurement as given.
    pub r: f64,
    /// Variance of the residual: `r D`.
    pub free: f64,
    /// Difference from the prediction by all other measurements, normalised.
    pub normalised: f64,
    /// Innovation: difference from the prediction by the measurements before it, normalised. With a right
    /// model innovations are independent unit normals, also after an estimate from the same record; nearly
    /// zero if the measurements before it do not predict it.
    pub innovation: f64,
}

impl MeasurementResidual {
    /// Square of the residual in units of sigma.
    fn square(&self) -> f64 {
        self.residual * self.residual / self.r
    }
}

/// Residuals of all measurements, and the second path.
pub(crate) struct Diagnosed {
    pub all: Vec<MeasurementResidual>,
    pub second: SecondPath,
    /// Sum of squares of each run alone, by least squares with the wide prior.
    pub alone: Vec<f64>,
    /// Probabilities of whiteness that were computed, by run and channel.
    pub white: RefCell<BTreeMap<(usize, usize), Option<f64>>>,
}

/// Prior standard deviations of the states of run `r`, wider than those of the scheme. Random biases have
/// priors of their own.
fn wide_prior(problem: &PlatformProblem<'_>, r: usize) -> Vec<f64> {
    let own = &problem.runs[r].plan;
    let wide =
        |(s, &i): (usize, &usize)| problem.unknowns.prior[i] * if s < own.unknowns() { WIDE } else { 1.0 };
    problem.unknowns.index[r].iter().enumerate().map(wide).collect()
}

/// Filter along a linearised run.
struct FilterPath {
    /// Correction and standard deviations of the state at the end.
    end: Option<(Vec<f64>, Vec<f64>)>,
    whitened: Vec<f64>,
    smoothed: SmoothedStart,
}

impl FilterPath {
    /// Filter along a run with these prior standard deviations.
    fn along(run: &Linearised, prior: &[f64]) -> Result<Self, EkfError> {
        let n = prior.len();
        let p0 = DMatrix::from_diagonal(&DVector::from_iterator(n, prior.iter().map(|s| s * s)));
        let (mut delta, mut whitened) = (vec![0.0; n], Vec::with_capacity(run.residuals.len()));
        let mut end: Option<(Vec<f64>, Vec<f64>)> = None;
        let mut first = 0;
        let mut measure = |_: usize, _: usize, z: &mut [f64]| {
            z.copy_from_slice(&run.residuals[first..first + z.len()]);
            first += z.len();
        };
        let covariance = Covariance::new("P0", &p0, CovarianceForm::Ud)?;
        let steps = run.stages.len();
        let gains = filter_pass(&run.stages, covariance, &mut delta, &mut measure, |step, x, p, w| {
            whitened.extend_from_slice(w);
            if step + 1 == steps {
                end = Some((x.to_vec(), p.sigmas()));
            }
        })?;
        let smoothed = smoothed_start(&run.stages, &gains, &whitened, &p0)?;
        Ok(Self { end, whitened, smoothed })
    }
}

impl Diagnosed {
    /// Diagnosis of an estimate.
    ///
    /// # Errors
    /// [`EkfError`].
    pub(crate) fn of(
        problem: &PlatformProblem<'_>,
        estimate: &PlatformEstimate,
        prediction: &Prediction,
    ) -> Result<Self, EkfError> {
        let mut out = Self {
            all: Vec::new(),
            second: SecondPath { difference: 0.0, sigma_difference: 0.0 },
            alone: Vec::new(),
            white: RefCell::default(),
        };
        for (r, LinearisedRecord { run, keys }) in estimate.at.runs.iter().enumerate() {
            let prior = wide_prior(problem, r);
            let path = FilterPath::along(run, &prior)?;
            out.add(r, run, keys, &path);
            out.compare(run, &estimate.at.information[r], (&prior[..], &path), prediction)?;
        }
        Ok(out)
    }

    /// Adds the residuals of run `r`.
    fn add(&mut self, r: usize, run: &Linearised, keys: &[MeasurementKey], path: &FilterPath) {
        let variances = run.stages.iter().flat_map(|s| &s.outputs).map(|o| o.r);
        let each = path.smoothed.left_out.iter().zip(variances).zip(keys).zip(&path.whitened);
        for (((left, r_of), key), innovation) in each {
            self.all.push(MeasurementResidual {
                run: r,
                key: *key,
                residual: r_of * left.u,
                r: r_of,
                free: r_of * left.variance,
                normalised: left.normalised(),
                innovation: *innovation,
            });
        }
    }

    /// Compares the end of a filter along a run with that of least squares with the same prior.
    fn compare(
        &mut self,
        run: &Linearised,
        information: &StartInformation,
        (prior, path): (&[f64], &FilterPath),
        prediction: &Prediction,
    ) -> Result<(), EkfError> {
        let n = prior.len();
        let mut rows = StackedRows::new(n);
        rows.add(&information.root, &information.right);
        let pull = DVector::from_iterator(n, prior.iter().map(|s| 1.0 / s));
        rows.add(&DMatrix::from_diagonal(&pull), &DVector::zeros(n));
        let batch = rows.solve()?;
        self.alone.push(information.left + batch.left);
        let start = RunState { correction: batch.x.clone(), root: batch.inverse_root.clone() };
        let states = information.states(run, start)?;
        if let (Some((x, sigmas)), Some(last)) = (&path.end, states.last()) {
            let determined = |s: usize| prediction.unknowns.get(s).is_some_and(|u| u.determined_at_end);
            let second = &mut self.second;
            for (i, (x, sigma)) in x.iter().zip(sigmas).enumerate().filter(|(s, _)| determined(*s)) {
                let own = last.sigma(i);
                second.difference = second.difference.max((x - last.correction[i]).abs() / sigma);
                second.sigma_difference = second.sigma_difference.max((own / sigma - 1.0).abs());
            }
        }
        Ok(())
    }

    /// Factors on the sigmas, by channel.
    pub(crate) fn channel_factors(&self, channels: usize) -> Vec<f64> {
        let of = |c| {
            let (chi, free) = self.sums(|l| l.key.channel == c);
            if free > 0.0 && chi > 0.0 { (chi / free).sqrt() } else { 1.0 }
        };
        (0..channels).map(of).collect()
    }

    /// Sum of squares and degrees of freedom of some measurements.
    pub(in crate::platform) fn sums(&self, of: impl Fn(&MeasurementResidual) -> bool) -> (f64, f64) {
        let some = self.all.iter().filter(|l| of(l));
        some.fold((0.0, 0.0), |(chi, free), l| (chi + l.square(), free + l.free))
    }

    /// Measurements farther off than `gate`, in units of the usual size of residuals if that exceeds one.
    pub(crate) fn beyond(&self, gate: f64) -> Vec<(usize, MeasurementKey)> {
        let mut sizes: Vec<f64> = self.all.iter().map(|l| l.normalised.abs()).collect();
        if sizes.is_empty() {
            return Vec::new();
        }
        let middle = sizes.len() / 2;
        let usual = (*sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745).max(1.0);
        let off = self.all.iter().filter(|l| l.normalised.abs() > gate * usual);
        off.map(|l| (l.run, l.key)).collect()
    }
}

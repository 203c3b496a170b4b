//! Curvature of an estimate: a test of the linear model of its covariance, and mean and covariance without
//! that model.
//!
//! Unknowns that a prior alone determines may be far from their estimates, and bend into the others: drifts
//! times angles enter at second order. The gate is `kappa = max |r(x +- a) - r(x) +- J a|` in sigma over the
//! longest axes a of the posterior. Below 0.4 the covariance of the linear model holds. Above, mean and
//! covariance are those of weighted samples of the posterior ([`super::posterior`]).
//!
//! Beyond `MOST`, where another minimum is nearly as low, or where few samples have most of the weight, no
//! covariance describes the errors, and all estimates are left open. So are they where a sample is not
//! found, since the posterior goes on there (one such record of 3,000 had a NEES of 520 on 12). Nothing is
//! wrong with such a record: with the priors it is not informative enough at these drifts. Attempts to keep
//! some of the estimates failed. They used the change of each estimate from the linear model, and the
//! scatter of repeated estimates. In a test with 20 records of p1 p2 at three times the paper's drifts, one
//! record had 14 estimates that moved by less than a quarter of a sigma. Together they were off by 160.

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::Manifold;
use obsdeg_evidence::simulation::{Noise, PlatformState};

use super::CalibrationError;
use super::estimate::LinearisedRecord;
use super::estimate::{PlatformEstimate, PlatformProblem};
use super::posterior::{PosteriorSample, normal_pairs};
use crate::least_squares::{Linearised, StartInformation};

/// Number of the longest axes of the posterior that are tried.
const AXES: usize = 8;
/// Threshold of an axis in sigmas of all measurements: the square of the angle by which the axis turns the
/// platform must exceed it to count.
const SEEN: f64 = 0.1;
/// Curvature from which on the posterior is sampled: it grows with the square of the distance, so that of 0.4
/// at one sigma is 3.6 sigma at three (a record of p1 p2 with 0.82 had a NEES of 81 on 15 by the linear
/// model).
const SAMPLED: f64 = 0.4;
/// Curvature from which on no estimate stands without samples, and other minima are sought.
pub(super) const BENT: f64 = 1.0;
/// Largest curvature, in sigma, at which records and priors determine the estimates.
const MOST: f64 = 20.0;
/// Fewest samples, and their number per unknown.
const SAMPLES: (usize, usize) = (120, 4);
/// Fraction of that number which the effective one must reach, by up to `MORE` times as many samples.
const MOSTLY: f64 = 0.8;
const MORE: usize = 4;
/// Least effective number of samples beside the number of unknowns.
const LEAST: f64 = 30.0;
/// Largest product of bins, squared unknowns and samples.
const WORK: f64 = 2e9;

/// Mean and covariance of samples.
#[derive(Debug, Clone)]
pub(crate) struct SampleMoments {
    /// Mean of the samples (shape n).
    pub mean: DVector<f64>,
    /// Root of their covariance (n x any).
    pub root: DMatrix<f64>,
}

/// Curvature of an estimate, with mean and covariance of the posterior where it matters.
#[derive(Debug, Clone)]
pub(crate) struct CurvatureResult {
    /// Curvature in sigma; infinite where the run cannot be followed along an axis, or another minimum is
    /// nearly as low.
    pub kappa: f64,
    /// Number of samples; `failed` of them were not found.
    pub samples: usize,
    pub failed: usize,
    /// Moments of the samples about the estimate.
    pub found: Option<SampleMoments>,
}

impl CurvatureResult {
    /// True if no covariance describes the errors of the estimates.
    pub(super) fn leaves_open(&self) -> bool {
        self.kappa.is_nan() || self.kappa > BENT && self.found.is_none()
    }
}

/// Weights of samples, with sum one, and their effective number (Kish).
fn weighed(all: &[PosteriorSample]) -> (Vec<f64>, f64) {
    let most = all.iter().map(|s| s.weight).fold(f64::NEG_INFINITY, f64::max);
    let own: Vec<f64> = all.iter().map(|s| (s.weight - most).exp()).collect();
    let sum: f64 = own.iter().sum();
    let squares: f64 = own.iter().map(|w| w * w).sum();
    (own.iter().map(|w| w / sum).collect(), if squares > 0.0 { sum * sum / squares } else { 0.0 })
}

impl PlatformProblem<'_> {
    /// Curvature of an estimate.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    pub(super) fn bent(
        &self,
        estimate: &PlatformEstimate,
        seed: u64,
    ) -> Result<CurvatureResult, CalibrationError> {
        let kappa = if estimate.rivals > 0 { f64::INFINITY } else { self.kappa(estimate)? };
        let mut out = CurvatureResult { kappa, samples: 0, failed: 0, found: None };
        let n = self.unknowns.n;
        let wanted = SAMPLES.0.max(SAMPLES.1 * n);
        let bins: usize = self.runs.iter().map(|run| run.len()).sum();
        let work = (bins * n * n * wanted) as f64;
        if !(SAMPLED..=MOST).contains(&kappa) || work > WORK || !estimate.converged || self.stopped.get() {
            return Ok(out);
        }
        let Some(equation) = self.equation(estimate)? else { return Ok(out) };
        let mut noise = Noise::new(seed, 0);
        let mut all: Vec<PosteriorSample> = Vec::with_capacity(wanted);
        let (mut weights, mut effective) = (Vec::new(), 0.0);
        while out.samples == 0 || (effective < MOSTLY * wanted as f64 && out.samples < MORE * wanted) {
            let Some(half) = normal_pairs(n, wanted / 2, &mut noise) else { return Ok(out) };
            for eps in half.column_iter().flat_map(|eps| [eps.into_owned(), -eps]) {
                if self.stopped.get() {
                    return Ok(out);
                }
                out.samples += 1;
                let Some(sample) = self.sample(&equation, estimate, &eps) else {
                    out.failed += 1;
                    return Ok(out);
                };
                all.push(sample);
            }
            (weights, effective) = weighed(&all);
        }
        if effective < n as f64 + LEAST {
            return Ok(out);
        }
        let mean = all.iter().zip(&weights).fold(DVector::zeros(n), |s, (x, w)| s + &x.x * *w);
        let root = DMatrix::from_fn(n, all.len(), |i, j| (all[j].x[i] - mean[i]) * weights[j].sqrt());
        out.found = Some(SampleMoments { mean, root });
        Ok(out)
    }

    /// Local coordinates of the starts `to`, relative to the starts `from`.
    pub(super) fn between(&self, from: &[PlatformState], to: &[PlatformState]) -> DVector<f64> {
        let mut out = DVector::zeros(self.unknowns.n);
        for ((from, to), index) in from.iter().zip(to).zip(&self.unknowns.index) {
            index.iter().zip(to.local(from)).for_each(|(&i, d)| out[i] = d);
        }
        out
    }

    /// Longest axes of the posterior that can cause curvature, one standard deviation long.
    pub(super) fn axes(&self, estimate: &PlatformEstimate) -> Vec<DVector<f64>> {
        let (n, prior) = (self.unknowns.n, &self.unknowns.prior);
        let root = &estimate.solution.inverse_root;
        let scaled = DMatrix::from_fn(n, root.ncols(), |i, j| root[(i, j)] / prior[i]);
        let eigen = (&scaled * scaled.transpose()).symmetric_eigen();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let outputs = estimate.at.runs.iter().flat_map(|r| &r.run.stages).flat_map(|s| &s.outputs);
        let least = SEEN / outputs.map(|o| 1.0 / o.r).sum::<f64>().sqrt();
        let axis = |&k: &usize| {
            let length = eigen.eigenvalues[k].max(0.0).sqrt();
            DVector::from_fn(n, |i, _| eigen.eigenvectors[(i, k)] * length * prior[i])
        };
        let all = order.iter().take(AXES).map(axis);
        all.filter(|a| self.turn(&estimate.at, a).powi(2) > least).collect()
    }

    /// Largest curvature along these axes, in both directions.
    pub(super) fn kappa(&self, estimate: &PlatformEstimate) -> Result<f64, CalibrationError> {
        let mut kappa: f64 = 0.0;
        for axis in self.axes(estimate) {
            for a in [axis.clone(), -axis] {
                kappa = kappa.max(self.bend(estimate, &a)?);
            }
        }
        Ok(kappa)
    }

    /// Length in sigma of the residuals beyond the linear model, for a start moved by `a`.
    fn bend(&self, estimate: &PlatformEstimate, a: &DVector<f64>) -> Result<f64, CalibrationError> {
        let x = self.moved(&estimate.at.x, a);
        let mut sum = 0.0;
        for (r, (own, LinearisedRecord { run, .. })) in self.runs.iter().zip(&estimate.at.runs).enumerate() {
            let Ok((there, _)) = own.along(self.conditions, &self.sigmas, &x[r]) else {
                return Ok(f64::INFINITY);
            };
            let start: Vec<f64> = self.unknowns.index[r].iter().map(|&i| a[i]).collect();
            let mut seen = Vec::with_capacity(run.residuals.len());
            run.carried(&start, |step, d| {
                let outputs = run.stages[step].outputs.iter();
                seen.extend(outputs.map(|o| o.h.iter().map(|&(j, c)| c * d[j]).sum::<f64>()));
            });
            let beside = there.residuals.iter().zip(&run.residuals).zip(&seen);
            let residuals = beside.map(|((there, here), seen)| there - here + seen).collect();
            let bend = Linearised { residuals, ..run.clone() };
            sum += StartInformation::of(&bend).map_or(f64::INFINITY, |i| i.at_zero());
        }
        Ok(sum.sqrt())
    }
}

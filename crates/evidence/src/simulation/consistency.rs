//! Consistency of a run: innovations and errors compared with the covariances of the filter.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::span::Span;
use obsdeg_ekf::consistency::{CONFIDENCE, Nees, autocorrelation, chi_square_band, ljung_box};
use obsdeg_ekf::{Covariance, EkfError};
use schemars::JsonSchema;
use serde::Serialize;

/// Largest error of a credible estimate, in sigma.
pub(crate) const CREDIBLE: f64 = 4.0;
/// Probability with which a consistent filter stays inside the bands that decide.
const STRICT: f64 = 0.999;
/// Largest lag of the autocorrelation, in samples.
const LAGS: usize = 20;

/// Statistical evidence against a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Doubt {
    /// Statistic, estimate or sigma that is not a finite number.
    NoNumber,
    /// Mean NIS outside its acceptance band of 99.9 %.
    Nis,
    /// NEES above its acceptance band of 99.9 %.
    Nees,
    /// Error beyond four sigma of the filter.
    Error,
    /// Innovations that are not white.
    Correlated,
}

/// Consistency statistics of one run: NIS, NEES, whiteness and errors.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Consistency {
    /// Mean normalised innovation squared (NIS), dimensionless; its expectation is the number of outputs.
    pub nis: f64,
    /// Band of 95 % of the mean NIS, dimensionless.
    pub nis_band: Span<f64>,
    /// Acceptance band of 99.9 % of the mean NIS, dimensionless.
    pub nis_wide_band: Span<f64>,
    /// Normalised estimation error squared (NEES) at the end, dimensionless. Its expectation is the number of
    /// states (unknowns, and gyro biases that are states) without the directions left out.
    pub nees: f64,
    /// Number of directions that the NEES leaves out: a filter linearised at its estimates claims to know
    /// them more than a million times better than the unknowns themselves. 0 for a linear model.
    pub unresolved_directions: usize,
    /// Number of directions that the NEES leaves out because constraints of the model hold them: nothing is
    /// estimated there. 0 for a platform.
    pub held_directions: usize,
    /// Band of 95 % of the NEES, dimensionless.
    pub nees_band: Span<f64>,
    /// Upper end of the acceptance band of 99.9 % of the NEES, dimensionless. A small NEES is no evidence:
    /// true values are given, not drawn.
    pub nees_limit: f64,
    /// Probability that white noise has autocorrelations as large as the innovations', smallest over outputs.
    pub whiteness_probability: f64,
    /// Unknowns with an error beyond four sigma.
    pub beyond: Vec<String>,
    /// Evidence against the run; empty if there is none.
    pub doubts: Vec<Doubt>,
    /// True if NIS, NEES, whiteness and errors all pass.
    pub consistent: bool,
}

/// Results of a run that its consistency is judged by.
pub(crate) struct Outcomes<'a> {
    /// Whitened innovations, one per output and sampled step.
    pub whitened: &'a [f64],
    pub outputs: usize,
    /// Estimate minus truth of all states of the filter, in its units (shape n).
    pub error: Vec<f64>,
    /// Covariance of the error, by the filter.
    pub covariance: &'a Covariance,
    /// Names of the reported quantities, with their errors over sigma.
    pub normalised: Vec<(&'a str, f64)>,
    /// Columns T (shape n x k): T' error is the part that constraints leave free; `None`: the whole error.
    pub free: Option<DMatrix<f64>>,
    /// Smallest sigma of a direction that counts in the NEES, relative to the unknowns' own sigmas.
    pub resolution: f64,
}

impl Consistency {
    /// Judges the consistency of a run.
    ///
    /// # Errors
    /// [`EkfError`] for a covariance that is not positive definite.
    pub(crate) fn of(mut run: Outcomes<'_>) -> Result<Self, EkfError> {
        let (states, outputs) = (run.error.len(), run.outputs as f64);
        let samples = run.whitened.len() / run.outputs;
        let count = samples as f64;
        let nis = run.whitened.iter().map(|v| v * v).sum::<f64>() / count;
        let (of, free) = match &run.free {
            None => (Nees::of_covariance(run.covariance)?, states),
            Some(free) => {
                run.error = (free.transpose() * DVector::from_column_slice(&run.error)).as_slice().to_vec();
                (Nees::new(&(free.transpose() * run.covariance.matrix() * free))?, free.ncols())
            }
        };
        let (nees, n) = match run.resolution {
            0.0 => (of.of(&mut run.error)?, free),
            least => of.resolved(&run.error, least)?,
        };
        let lags = LAGS.min(samples / 4).max(1);
        let whiteness = (0..run.outputs)
            .map(|j| {
                let one: Vec<f64> = run.whitened.iter().skip(j).step_by(run.outputs).copied().collect();
                ljung_box(&autocorrelation(&one, lags), one.len())
            })
            // NaN stays NaN
            .fold(1.0, |least: f64, p| if p.is_nan() { p } else { least.min(p) });
        let nis_wide_band: Span<f64> = chi_square_band(outputs, count, STRICT).into();
        let (_, nees_limit) = chi_square_band(n as f64, 1.0, STRICT);
        let beyond = run.normalised.iter().filter(|(_, x)| x.abs() > CREDIBLE);
        let beyond: Vec<String> = beyond.map(|(name, _)| name.to_string()).collect();
        let numbers = run.normalised.iter().map(|(_, x)| *x).chain([nis, nees, whiteness]);
        let found = [
            (Doubt::NoNumber, !numbers.into_iter().all(f64::is_finite)),
            (Doubt::Nis, !nis_wide_band.contains(&nis)),
            (Doubt::Nees, nees > nees_limit),
            (Doubt::Error, !beyond.is_empty()),
            // smallest probability over the outputs
            (Doubt::Correlated, whiteness * outputs < 1.0 - STRICT),
        ];
        let doubts: Vec<Doubt> = found.into_iter().filter(|(_, there)| *there).map(|(d, _)| d).collect();
        Ok(Self {
            nis,
            nis_band: chi_square_band(outputs, count, CONFIDENCE).into(),
            nis_wide_band,
            nees,
            unresolved_directions: free - n,
            held_directions: states - free,
            nees_band: chi_square_band(n as f64, 1.0, CONFIDENCE).into(),
            nees_limit,
            whiteness_probability: whiteness,
            beyond,
            consistent: doubts.is_empty(),
            doubts,
        })
    }
}

#[cfg(test)]
mod tests {
    use obsdeg_ekf::CovarianceForm;
    use obsdeg_exact::SplitMix64;

    use super::*;
    use crate::simulation::truth::Noise;

    /// Consistency of a run of two outputs and two states, with errors given in sigma.
    fn judged(whitened: &[f64], error: [f64; 2]) -> Consistency {
        let p = Covariance::new("P", &DMatrix::identity(2, 2), CovarianceForm::Ud).expect("a covariance");
        let run = Outcomes {
            whitened,
            outputs: 2,
            error: error.to_vec(),
            covariance: &p,
            normalised: vec![("a", error[0]), ("b", error[1])],
            free: None,
            resolution: 0.0,
        };
        Consistency::of(run).expect("judged")
    }

    fn white(seed: u64) -> Vec<f64> {
        let mut noise = Noise::new(seed, 0);
        (0..400).map(|_| noise.normal()).collect()
    }

    #[test]
    fn each_doubt_by_itself() {
        let right = white(1);
        assert_eq!(judged(&right, [0.5, -0.5]).doubts, []);
        // two degrees of freedom: the band of 99.9 % ends at -2 ln 0.0005
        let limit = judged(&right, [0.0, 0.0]).nees_limit;
        assert!((limit + 2.0 * 0.0005f64.ln()).abs() < 1e-9, "{limit}");
        assert_eq!(judged(&right, [2.7, 2.7]).doubts, []);
        assert_eq!(judged(&right, [2.8, 2.8]).doubts, [Doubt::Nees]);
        assert_eq!(judged(&right, [0.0, 4.1]).doubts, [Doubt::Nees, Doubt::Error]);
        assert_eq!(judged(&right, [0.0, 4.1]).beyond, ["b"]);
        // neither a zero error nor a small one is a doubt
        assert_eq!(judged(&right, [0.0, 0.0]).doubts, []);
        for factor in [0.8, 1.2] {
            let scaled: Vec<f64> = right.iter().map(|x| x * factor).collect();
            assert_eq!(judged(&scaled, [0.0, 0.0]).doubts, [Doubt::Nis], "{factor}");
        }
        // a moving mean of unit variance
        let slow: Vec<f64> = right.windows(5).map(|w| (w[0] + w[2] + w[4]) / 3f64.sqrt()).collect();
        assert!(judged(&slow[..396], [0.0, 0.0]).doubts.contains(&Doubt::Correlated));
        assert!(judged(&right, [f64::NAN, 0.0]).doubts.contains(&Doubt::NoNumber));
        let mut broken = right.clone();
        broken[7] = f64::INFINITY;
        assert!(judged(&broken, [0.0, 0.0]).doubts.contains(&Doubt::NoNumber));
        assert!(!judged(&broken, [0.0, 0.0]).consistent);
    }

    /// Consistent runs are doubted as often as the bands say: of 2000 NIS 2, NEES 1, errors 0.2. The
    /// statistic of Ljung and Box has a heavier tail than its chi-square with 200 samples: more than 2.
    #[test]
    fn right_runs_are_consistent() {
        let mut rng = SplitMix64::new(11);
        let (mut bands, mut correlated) = (0, 0);
        for _ in 0..2000 {
            let seed = rng.next_u64();
            let mut noise = Noise::new(seed, 1);
            let doubts = judged(&white(seed), [noise.normal(), noise.normal()]).doubts;
            bands += usize::from(doubts.iter().any(|d| *d != Doubt::Correlated));
            correlated += usize::from(doubts.contains(&Doubt::Correlated));
        }
        assert!((1..=9).contains(&bands) && correlated <= 25, "{bands} and {correlated} of 2000");
    }
}

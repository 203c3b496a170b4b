//! Probabilities of false alarms: a right record is called inconsistent in at most one case of a hundred.
//!
//! Each test of an answer has a share of that probability. A test of several records, positions or components
//! divides its share by their number (Bonferroni), so that the sum of all shares bounds the probability that
//! any test fails. The table stands in the book, too, in the chapter on calibration.

use obsdeg_core::span::Span;
use obsdeg_ekf::consistency::chi_square_band;

/// Acceptance band of chi-square per degree of freedom, dimensionless: a right one is outside with this
/// probability.
pub(crate) fn band(degrees_of_freedom: f64, probability: f64) -> Span<f64> {
    Span::from(chi_square_band(degrees_of_freedom, 1.0, 1.0 - probability)).over(degrees_of_freedom)
}

/// Probability that any test fails on a right record.
pub const FAMILY: f64 = 0.01;

pub(crate) const FORCE: f64 = 5e-4;
pub(crate) const STUCK: f64 = 5e-4;
pub(crate) const CLOCK: f64 = 1e-3;
pub(crate) const POSITION: f64 = 5e-4;
pub(crate) const NOISE: f64 = 1e-3;
pub(crate) const CHANNEL: f64 = 1e-3;
pub(crate) const CORRELATED: f64 = 1e-3;
pub(crate) const TEMPERATURE: f64 = 1e-3;
pub(crate) const REPEATABILITY: f64 = 5e-4;
pub(crate) const KNOWN: f64 = 5e-4;
/// Probability of a suspicion of errors that are not estimated.
pub const SUSPECT: f64 = 2e-3;
pub(crate) const OUTLIER: f64 = 1e-3;

/// Tests of the calibration of a scheme, each with its share of [`FAMILY`].
pub const OF_SCHEME: [(&str, f64); 11] = [
    ("length of the specific force", FORCE),
    ("stuck output", STUCK),
    ("clock", CLOCK),
    ("position", POSITION),
    ("noise", NOISE),
    ("component", CHANNEL),
    ("correlated residuals", CORRELATED),
    ("temperature", TEMPERATURE),
    ("several records", REPEATABILITY),
    ("prior calibration", KNOWN),
    ("errors that are not estimated", SUSPECT),
];

/// Tests of the calibration of a model, each with its share of [`FAMILY`].
pub const OF_MODEL: [(&str, f64); 3] =
    [("noise", NOISE), ("correlated residuals", CORRELATED), ("outlier", OUTLIER)];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_at_most_the_whole() {
        for table in [&OF_SCHEME[..], &OF_MODEL[..]] {
            let sum: f64 = table.iter().map(|t| t.1).sum();
            assert!(sum <= FAMILY * (1.0 + 1e-12) && table.iter().all(|t| t.1 > 0.0), "{sum}");
        }
    }
}

//! Constraints of a scheme besides observability: times, sigmas, degrees.

use obsdeg_evidence::requirements::meets;

use crate::design::measure::criterion::{Criterion, SigmaLimits};
use crate::design::measure::evaluator::{Evaluator, SequenceState};
use crate::design::measure::stop::Stop;

/// Constraints on a scheme besides observability.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Constraints {
    /// Largest total time with turns, in s; `None` without a limit.
    pub total_s: Option<f64>,
    /// Longest turn between successive positions, in s; `None` without a limit.
    pub slew_s: Option<f64>,
    /// Largest sigmas; `None` without limits.
    pub sigmas: Option<SigmaLimits>,
    /// Largest degree of every required coefficient; `None` without caps.
    pub degrees: Option<Vec<usize>>,
}

impl Constraints {
    /// True if the degrees of the required coefficients are within the caps.
    pub(crate) fn cap(&self, degrees: &[usize]) -> bool {
        self.degrees.as_ref().is_none_or(|caps| degrees.iter().zip(caps).all(|(d, cap)| d <= cap))
    }

    /// Relative violation of the limits by times and sigmas of a sequence with the state `state`,
    /// dimensionless; 0 when kept.
    pub(crate) fn violation(
        &self,
        evaluator: &Evaluator,
        sequence: &[Stop],
        state: &SequenceState,
        root: &mut Vec<f64>,
    ) -> f64 {
        let slew = |w: &[Stop]| evaluator.slew_s(w[0].candidate, w[1].candidate);
        let slews = sequence.windows(2).map(|w| beyond(slew(w), self.slew_s)).sum::<f64>();
        let margin = |limits: &SigmaLimits| {
            // a margin has no unit: largest sigma over requirement
            let over = evaluator.value(state, &Criterion::Margin(limits.clone()), root);
            if meets(over, 1.0) { 0.0 } else { over - 1.0 }
        };
        let over = slews + beyond(state.seconds, self.total_s) + self.sigmas.as_ref().map_or(0.0, margin);
        over + evaluator.not_immune(state, root)
    }

    /// True if times and sigmas of a sequence are within the limits.
    pub(crate) fn keep(&self, evaluator: &Evaluator, sequence: &[Stop]) -> bool {
        self.violation(evaluator, sequence, &evaluator.state_of(sequence), &mut Vec::new()) == 0.0
    }
}

/// Relative excess over a limit, dimensionless; 0 within rounding.
pub(crate) fn beyond(found: f64, limit: Option<f64>) -> f64 {
    limit.map(|l| found / l - 1.0).filter(|over| *over > 1e-9).unwrap_or(0.0)
}

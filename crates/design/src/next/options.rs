//! Options of a comparison of extensions, and properties of schemes that it uses.

use obsdeg_core::model::{Angle, Carry, Position, Scheme};
use obsdeg_evidence::simulation::{Conditions, KnownCovariance};

use crate::design::Candidates;

/// Longest dwell tried in the search for the shortest dwell that meets the requirements, as a multiple of the
/// stated dwell.
pub(super) const LONGEST: f64 = 16.0;
/// Relative difference up to which two uncertainties are the same.
pub(super) const SAME: f64 = 1e-9;

/// Options of a comparison of extensions.
#[derive(Debug, Clone, PartialEq)]
pub struct NextOptions {
    /// Candidates for the added positions.
    pub candidates: Candidates,
    /// Number of added positions: 1 or 2.
    pub added: usize,
    /// Coefficients or families that must be observable; empty for all.
    pub required: Vec<String>,
    /// Largest total time, in s.
    pub total_s: Option<f64>,
    /// Longest turn to an added position, in s.
    pub slew_s: Option<f64>,
    /// Number of extensions that are listed.
    pub keep: usize,
    /// Covariance of a calibration: the added positions are then a run of their own, with a psi of its own.
    pub beforehand: Option<KnownCovariance>,
    /// Days since the calibration, ascending: the coefficients age as the scheme states. The answer
    /// holds for the last one.
    pub days: Vec<f64>,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Any single position, for properties that do not depend on the attitude.
pub(super) fn any_position() -> Vec<Position> {
    Scheme::of_angles([std::array::from_fn(|_| Angle::from_degrees(0))]).positions
}

/// True if the order of the positions matters.
pub(super) fn is_ordered(scheme: &Scheme, conditions: &Conditions) -> bool {
    let as_stated = conditions.as_stated();
    let noisy = !conditions.gyro_noise.is_none() || as_stated.drift_noise.amount() > 0.0;
    scheme.carry != Carry::Reset || noisy || !conditions.accelerometer().states().is_empty()
}

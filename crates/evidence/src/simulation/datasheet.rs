//! Random drift of the gyros by their datasheet.

use obsdeg_core::model::{GYROS, PerGyro, ranges};
use obsdeg_ekf::SensorNoise;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::SimulationError;

/// Noise of the gyros X, Y, Z by their datasheet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GyroNoise {
    /// Angle random walk of each gyro, in deg/sqrt(h).
    pub angle_random_walk_deg_sqrt_h: PerGyro,
    /// Rate random walk of each gyro, in deg/h/sqrt(h).
    pub rate_random_walk_dph_sqrt_h: PerGyro,
    /// Bias instability of each gyro, in deg/h: the coefficient B of IEEE Std 952, whose Allan floor is 0.664
    /// B.
    pub bias_instability_dph: PerGyro,
    /// Correlation time, in s, of the Gauss-Markov process that represents the bias instability.
    pub correlation_time_s: f64,
}

impl Default for GyroNoise {
    fn default() -> Self {
        let none = PerGyro::default();
        Self {
            angle_random_walk_deg_sqrt_h: none,
            rate_random_walk_dph_sqrt_h: none,
            bias_instability_dph: none,
            correlation_time_s: 3600.0,
        }
    }
}

impl GyroNoise {
    fn lists(&self) -> [(&'static str, PerGyro); 3] {
        [
            ("angle_random_walk_deg_sqrt_h", self.angle_random_walk_deg_sqrt_h),
            ("rate_random_walk_dph_sqrt_h", self.rate_random_walk_dph_sqrt_h),
            ("bias_instability_dph", self.bias_instability_dph),
        ]
    }

    /// True if the datasheet states no noise.
    pub fn is_none(&self) -> bool {
        self.lists().iter().all(|(_, x)| x.is_none())
    }

    /// Checks that every number is in its range.
    ///
    /// # Errors
    /// [`SimulationError::Range`] with the name of the number.
    pub(crate) fn validate(&self) -> Result<(), SimulationError> {
        for (what, x) in self.lists() {
            x.check(what)?;
        }
        Ok(ranges::CORRELATION_S.check("correlation_time_s", self.correlation_time_s)?)
    }

    /// Noise of the gyros X, Y, Z in SI units.
    pub fn sensors(&self) -> [SensorNoise; GYROS.len()] {
        let [angle, rate, bias] = self.lists().map(|(_, x)| x.0);
        std::array::from_fn(|g| SensorNoise::gyro(angle[g], rate[g], bias[g], self.correlation_time_s))
    }
}

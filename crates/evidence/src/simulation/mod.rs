//! Torquing scheme run through the filter: one run against one truth, and its results.

pub(crate) mod answer;
pub(crate) mod attained;
pub(crate) mod batch;
mod biases;
pub(crate) mod carries;
pub(crate) mod conditions;
pub(crate) mod consistency;
mod curvature;
mod datasheet;
mod error;
pub(crate) mod extended;
pub(crate) mod floor;
mod gyro_noise;
pub(crate) mod iterated;
mod known;
pub(crate) mod limits;
mod noise;
pub mod omitted;
pub(crate) mod plan;
pub(crate) mod record;
mod reports;
mod seen;
mod sensitivities;
mod simulate;
mod start;
pub(crate) mod state;
mod trajectory;
pub(crate) mod truth;
mod validity;

pub use answer::*;
pub use attained::Attained;
pub(crate) use batch::each_row;
pub use batch::{Batch, batch, diffuse_prior};
pub use biases::{Bias, Sensor};
pub use carries::{OtherCarry, other_carries};
pub use conditions::{
    Conditions, PRIOR, Stated, general_first, is_rate, latitude_of, required_sigmas, resolve, shown_unit,
    si_per_shown,
};
pub use consistency::{Consistency, Doubt};
pub use datasheet::GyroNoise;
pub use error::SimulationError;
pub use extended::motion::{PlatformMotion, Tilt};
pub use extended::{ExtendedFilter, FilterResult};
pub use floor::{CoefficientFloor, NoiseFloor, Reached, noise_floor, sigmas_without_prior};
pub use iterated::iterated;
pub use known::KnownCovariance;
pub use noise::Noise;
pub use plan::Plan;
pub use plan::process::PlatformProcess;
pub use plan::timeline::{PlanSegment, SegmentKind, left_out, steps};
pub use record::{RunRecord, Series, Traces, run};
pub(crate) use reports::{conditions_report, timeline_report};
#[cfg(test)]
pub(crate) use seen::no_prior;
pub use seen::predict;
pub use sensitivities::{SchemeAnalysis, Sensitivities, sensitivities};
pub use simulate::simulate;
pub use start::RunStart;
pub use state::PlatformState;
pub use truth::TruthModel;

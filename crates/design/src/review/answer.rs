//! What a review holds: plain data.

use obsdeg_core::analysis::Analysis;
use obsdeg_core::model::Pose;
use obsdeg_core::model::slew::Turn;
use obsdeg_core::system::SystemAnalysis;
use obsdeg_evidence::compare::Comparison;
use obsdeg_evidence::crosscheck::CrossCheck;
use obsdeg_evidence::simulation::{Simulation, SimulationError, Traces};
use obsdeg_evidence::system::{RunError, SystemEvidence, SystemRun};

use crate::design::DesignError;
use crate::design::answer::{Certificate, Found, Minimum};

/// A review of schemes and models.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignReview {
    /// Version of the program.
    pub version: String,
    /// The schemes, in the order given.
    pub schemes: Vec<SchemeReview>,
    /// Schemes with generic angles, in the order given.
    pub generic: Vec<GenericReview>,
    /// The models, in the order given.
    pub models: Vec<ModelReview>,
    /// Predicted sigmas, drop-one and sensitivity of all schemes.
    pub comparison: Comparison,
    /// Monte Carlo runs of the evidence.
    pub runs: usize,
    /// Seed of all random choices.
    pub seed: u64,
}

/// One scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct SchemeReview {
    /// Its name.
    pub name: String,
    /// What it is for.
    pub description: String,
    /// The exact verdicts.
    pub analysis: Analysis,
    /// Its positions.
    pub positions: Vec<PositionReview>,
    /// The platform at each of them, and the turns between them.
    pub poses: Vec<Pose>,
    /// The way of gravity through the platform.
    pub attitudes: Vec<Attitude>,
    /// One run of the filter.
    pub simulation: Simulation,
    /// The same, sample by sample.
    pub traces: Traces,
    /// Verdicts against the filter, or why they cannot be held against it.
    pub evidence: Result<CrossCheck, SimulationError>,
    /// Predicted sigma, with a bench the total uncertainty, against the latitude in degrees.
    pub latitudes: Sweep,
    /// Predicted sigma, with a bench the total uncertainty, against the factor on all dwells.
    pub dwells: Sweep,
    /// Smaller and other schemes.
    pub alternatives: Alternatives,
}

/// A scheme whose angles have no numbers: exact verdicts, without predictions.
#[derive(Debug, Clone, PartialEq)]
pub struct GenericReview {
    /// Its name.
    pub name: String,
    /// What it is for.
    pub description: String,
    /// The exact verdicts.
    pub analysis: Analysis,
    /// The platform at each of its positions, as far as these have numbers.
    pub poses: Vec<Pose>,
    /// The generic angles.
    pub angles: Vec<String>,
    /// The latitude at which the earth rate is drawn, in degrees.
    pub latitude_deg: f64,
}

/// One position in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionReview {
    /// Its name.
    pub name: String,
    /// When it begins, in s.
    pub start_s: f64,
    /// How long it lasts, in s.
    pub dwell_s: f64,
    /// How long the way there takes, in s; `None`: no time.
    pub slew_s: Option<f64>,
    /// How it turns.
    pub turn: Option<Turn>,
    /// Components of g along I, O, S of gyro X, Y, Z, in g.
    pub g: [[f64; 3]; 3],
}

/// Gravity in the platform at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Attitude {
    /// The time in s.
    pub t_s: f64,
    /// The position, or the one that a slew goes to.
    pub position: usize,
    /// Components along X_p, Y_p, Z_p, in g.
    pub g: [f64; 3],
}

/// A condition, and every unknown's sigma there.
pub(super) type Point = (f64, Vec<(String, Option<f64>)>);

/// Predicted sigmas over a condition, with a bench total uncertainties.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sweep {
    /// The unknowns.
    pub names: Vec<String>,
    /// The condition.
    pub x: Vec<f64>,
    /// Per condition and unknown; `None` where it is not observable.
    pub sigmas: Vec<Vec<Option<f64>>>,
}

impl Sweep {
    pub(super) fn of(points: Vec<Point>) -> Self {
        let mut out = Self::default();
        for (x, of) in points {
            let (names, sigmas) = of.into_iter().unzip();
            out.names = names;
            out.x.push(x);
            out.sigmas.push(sigmas);
        }
        out
    }

    /// The largest sigma of a coefficient among `of` at every condition at which all are observable.
    pub fn worst(&self, of: &[String]) -> Vec<(f64, f64)> {
        let columns: Vec<usize> = (0..self.names.len()).filter(|&c| of.contains(&self.names[c])).collect();
        let at = |row: &Vec<Option<f64>>| -> Option<f64> {
            let all: Option<Vec<f64>> = columns.iter().map(|&c| row[c]).collect();
            all?.into_iter().reduce(f64::max)
        };
        self.x.iter().zip(&self.sigmas).filter_map(|(&x, row)| Some((x, at(row)?))).collect()
    }
}

/// Smaller and other schemes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Alternatives {
    /// The coefficients that the scheme makes observable.
    pub required: Vec<String>,
    /// The fewest of its positions that keep them so.
    pub kept: Option<Minimum>,
    /// The fewest cardinal attitudes that make every coefficient observable.
    pub all: Option<Minimum>,
    /// Schemes of `front_positions` cardinal attitudes that none found beats in both total time and the
    /// largest sigma of these.
    pub front: Vec<Found>,
    /// Their number of positions.
    pub front_positions: usize,
    /// How good the best of so many cardinal attitudes can be; `None` where no bound is known.
    pub certificate: Option<Certificate>,
    /// Why some of these were not searched for.
    pub refused: Vec<DesignError>,
}

/// One model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelReview {
    /// The exact verdicts.
    pub analysis: SystemAnalysis,
    /// One run of the filter, sample by sample.
    pub run: Option<(SystemRun, Traces)>,
    /// Verdicts against the information of the samples.
    pub evidence: Option<SystemEvidence>,
    /// Why there is no run, or no evidence.
    pub refused: Option<RunError>,
}

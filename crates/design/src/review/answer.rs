//! Contents of a design review: plain data.

use obsdeg_core::analysis::Analysis;
use obsdeg_core::model::Pose;
use obsdeg_core::model::slew::Turn;
use obsdeg_core::system::SystemAnalysis;
use obsdeg_core::title_block::TitleBlock;
use obsdeg_evidence::compare::Comparison;
use obsdeg_evidence::crosscheck::CrossCheck;
use obsdeg_evidence::simulation::{Simulation, SimulationError, Traces};
use obsdeg_evidence::system::{RunError, SystemEvidence, SystemRun};

use crate::design::DesignError;
use crate::design::answer::{Certificate, Found, Minimum};

/// Design review of schemes and models.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignReview {
    /// Version of the program.
    pub version: String,
    /// Schemes in the order given.
    pub schemes: Vec<SchemeReview>,
    /// Schemes with generic angles, in the order given.
    pub generic: Vec<GenericReview>,
    /// Models in the order given.
    pub models: Vec<ModelReview>,
    /// Predicted sigmas, drop-one and sensitivity of all schemes.
    pub comparison: Comparison,
    /// Number of Monte Carlo runs of the evidence.
    pub runs: usize,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Review of one scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct SchemeReview {
    /// Name of the scheme.
    pub name: String,
    /// Purpose of the scheme.
    pub description: String,
    /// Title block, as the file states it.
    pub document: TitleBlock,
    /// Exact verdicts.
    pub analysis: Analysis,
    /// Positions of the scheme in numbers.
    pub positions: Vec<PositionReview>,
    /// Platform at each position, with the turns between positions.
    pub poses: Vec<Pose>,
    /// Gravity in platform axes over time.
    pub attitudes: Vec<GravitySample>,
    /// One run of the filter.
    pub simulation: Simulation,
    /// Same run, sample by sample.
    pub traces: Traces,
    /// Verdicts against the filter, or the reason why they cannot be compared.
    pub evidence: Result<CrossCheck, SimulationError>,
    /// Predicted sigma, with a bench the total uncertainty, against the latitude in degrees.
    pub latitudes: Sweep,
    /// Predicted sigma, with a bench the total uncertainty, against the factor on all dwells.
    pub dwells: Sweep,
    /// Smaller and other schemes.
    pub alternatives: Alternatives,
}

/// Review of a scheme with generic angles: exact verdicts, without predictions.
#[derive(Debug, Clone, PartialEq)]
pub struct GenericReview {
    /// Name of the scheme.
    pub name: String,
    /// Purpose of the scheme.
    pub description: String,
    /// Title block, as the file states it.
    pub document: TitleBlock,
    /// Exact verdicts.
    pub analysis: Analysis,
    /// Platform at each position, as far as its angles are numbers.
    pub poses: Vec<Pose>,
    /// Names of the generic angles.
    pub angles: Vec<String>,
    /// Latitude at which the earth rate is drawn, in degrees.
    pub latitude_deg: f64,
}

/// Position of a scheme in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionReview {
    /// Name of the position.
    pub name: String,
    /// Start of the position, in s.
    pub start_s: f64,
    /// Dwell of the position, in s.
    pub dwell_s: f64,
    /// Duration of the slew to the position, in s; `None` for instantaneous repositioning.
    pub slew_s: Option<f64>,
    /// Turn of a rotating segment; `None` for a position.
    pub turn: Option<Turn>,
    /// Components of g along I, O, S of gyro X, Y, Z, in g.
    pub g: [[f64; 3]; 3],
}

/// Gravity in platform axes at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct GravitySample {
    /// Time in s.
    pub t_s: f64,
    /// Index of the position, during a slew of the one that it goes to.
    pub position: usize,
    /// Components along X_p, Y_p, Z_p, in g.
    pub g: [f64; 3],
}

/// Value of a condition, with the predicted sigma of every unknown.
pub(super) type CurvePoint = (f64, Vec<(String, Option<f64>)>);

/// Predicted sigmas against a condition, with a bench total uncertainties.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sweep {
    /// Names of the unknowns.
    pub names: Vec<String>,
    /// Values of the condition.
    pub x: Vec<f64>,
    /// Sigmas by condition and unknown; `None` where it is not observable.
    pub sigmas: Vec<Vec<Option<f64>>>,
}

impl Sweep {
    pub(super) fn of(points: Vec<CurvePoint>) -> Self {
        let mut out = Self::default();
        for (x, of) in points {
            let (names, sigmas) = of.into_iter().unzip();
            out.names = names;
            out.x.push(x);
            out.sigmas.push(sigmas);
        }
        out
    }

    /// Largest sigma among the coefficients `of`, with the condition, for conditions at which all are
    /// observable.
    pub fn worst(&self, of: &[String]) -> Vec<(f64, f64)> {
        let columns: Vec<usize> = (0..self.names.len()).filter(|&c| of.contains(&self.names[c])).collect();
        let at = |row: &Vec<Option<f64>>| -> Option<f64> {
            let all: Option<Vec<f64>> = columns.iter().map(|&c| row[c]).collect();
            all?.into_iter().reduce(f64::max)
        };
        self.x.iter().zip(&self.sigmas).filter_map(|(&x, row)| Some((x, at(row)?))).collect()
    }
}

/// Smaller and other schemes than the one reviewed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Alternatives {
    /// Coefficients that the scheme makes observable.
    pub required: Vec<String>,
    /// Fewest of its positions that keep these observable; `None` if not searched.
    pub kept: Option<Minimum>,
    /// Fewest cardinal attitudes that make every coefficient observable; `None` if not searched.
    pub all: Option<Minimum>,
    /// Schemes of `front_positions` cardinal attitudes that no scheme found beats in both total time
    /// and the largest sigma of these coefficients.
    pub front: Vec<Found>,
    /// Number of positions of the schemes in `front`.
    pub front_positions: usize,
    /// Bound on the best scheme of `front_positions` cardinal attitudes; `None` where no bound is
    /// known.
    pub certificate: Option<Certificate>,
    /// Errors of searches that were not possible.
    pub refused: Vec<DesignError>,
}

/// Run of the filter of a model, sample by sample.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelRun {
    /// Estimates and consistency.
    pub run: SystemRun,
    /// Estimates and sigmas over the samples.
    pub traces: Traces,
}

/// Review of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelReview {
    /// Title block, as the file states it.
    pub document: TitleBlock,
    /// Exact verdicts.
    pub analysis: SystemAnalysis,
    /// One run of the filter, sample by sample; `None` without one.
    pub run: Option<ModelRun>,
    /// Verdicts against the information of the samples; `None` without them.
    pub evidence: Option<SystemEvidence>,
    /// Reason why there is no run, or no evidence; `None` if there are both.
    pub refused: Option<RunError>,
    /// Verdicts without each of its outputs, in their order; empty for a single output, `None` for a model of
    /// many outputs or unknowns, where they are not computed.
    pub outputs: Option<Vec<WithoutOutput>>,
}

/// Change of the verdicts of a model without one of its outputs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WithoutOutput {
    /// Name of the output; that of a vector stands for all of its entries.
    pub name: String,
    /// Unknowns that are observable with the output and not without it.
    pub lost: Vec<String>,
    /// Unknowns that are observable without it too, by derivatives of a higher order.
    pub higher: Vec<String>,
    /// Number of independent combinations that are observable without it.
    pub rank: usize,
    /// Largest degree of an unknown that is observable with and without it; 0 if there is none.
    pub largest: usize,
}

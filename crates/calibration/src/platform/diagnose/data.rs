//! Data that the answer is made of: inputs, reported functionals and their solutions.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::degree::Status;
use obsdeg_core::model::Scheme;
use obsdeg_evidence::prediction::Prediction;
use obsdeg_evidence::simulation::{Conditions, Plan};

use super::super::Options;
use super::super::curvature::CurvatureResult;
use super::super::estimate::{PlatformEstimate, PlatformProblem};
use super::super::jump::Jump;
use super::super::offset::{Later, Offset};
use super::filter_path::Diagnosed;
use crate::least_squares::LeastSquaresSolution;
use crate::setup;

/// Data of an answer.
pub(crate) struct AnswerData<'a> {
    pub scheme: &'a Scheme,
    pub conditions: &'a Conditions,
    pub options: &'a Options,
    pub planned: &'a Plan,
    pub prediction: &'a Prediction,
    pub problem: &'a PlatformProblem<'a>,
    pub estimate: &'a PlatformEstimate,
    /// Last step by the linear model: the covariance of the estimate may be that of samples.
    pub linear: &'a LeastSquaresSolution,
    pub bent: &'a CurvatureResult,
    pub found: &'a Diagnosed,
    /// Beginning of the scheme by run; `None` where it was not estimated.
    pub offsets: &'a [Option<Offset>],
    /// Change of the measurements with the beginning, by run; `None` unless labels leave the beginning open.
    pub later: &'a [Option<Later>],
    /// Jump of a clock that explains most of an inconsistent fit.
    pub jump: Option<Jump>,
    pub too_many: Option<usize>,
    pub known: Vec<String>,
    pub rests_on: Vec<setup::SourceRecord>,
    pub interrupted: bool,
}

/// A functional that is reported.
pub(in crate::platform) struct ReportedFunctional {
    pub(super) name: String,
    pub(super) unit: &'static str,
    pub(super) status: Status,
    pub(super) degree: Option<usize>,
    /// True if scheme and records determine it.
    pub determined: bool,
    /// True if they do so only with a prior that is stated.
    pub(super) from_prior: bool,
    /// True if no covariance describes its error, because undetermined unknowns cause too much curvature.
    pub(super) left_open: bool,
    /// On the unknowns, in SI.
    pub terms: Vec<(usize, f64)>,
    /// Coefficients in local coordinates at the estimate, with the platform at the attitudes of the scheme.
    pub(super) local: Vec<(usize, f64)>,
    pub(super) planned: Vec<(usize, f64)>,
}

/// Solutions that the reported numbers come from.
pub(super) struct ReportedSolutions {
    /// Values of the unknowns, in SI.
    pub(super) values: DVector<f64>,
    /// Solution with the prior of the scheme on everything.
    pub(super) with_prior: LeastSquaresSolution,
    /// Solution in which the undetermined directions count as known.
    pub(super) tight: LeastSquaresSolution,
    /// Solution with the platform at the attitudes of the scheme.
    pub(super) planned: LeastSquaresSolution,
    /// Rows of the prior calibration, which no factor changes.
    pub(super) known: DMatrix<f64>,
    /// Factor on the standard deviations of the measurements by the fit, at least one.
    pub(super) factor: f64,
}

impl ReportedFunctional {
    /// True if there is an estimate with a sigma.
    pub(super) fn stands(&self) -> bool {
        self.determined && !self.left_open
    }
}

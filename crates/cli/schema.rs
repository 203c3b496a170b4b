//! `obsdeg schema`: JSON Schemas, generated from the types.

use clap::{Args, ValueEnum};
use obsdeg_calibration::{Calibration, SystemCalibration};
use obsdeg_core::analysis::Analysis;
use obsdeg_core::model::scheme_file::SchemeFile;
use obsdeg_core::system::SystemAnalysis;
use obsdeg_core::system::model_file::ModelFile;
use obsdeg_design::design::{Design, Part};
use obsdeg_evidence::audit::Audit;
use obsdeg_evidence::compare::Comparison;
use obsdeg_evidence::crosscheck::CrossCheck;
use obsdeg_evidence::simulation::Simulation;
use obsdeg_evidence::system::{SystemEvidence, SystemRun};
use schemars::schema_for;

use crate::failure::Failure;
use crate::output;

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    /// The JSON of `obsdeg analyze`
    Analysis,
    /// The JSON of `obsdeg paper`
    Audit,
    /// The JSON of `obsdeg simulate`
    Simulation,
    /// The JSON of `obsdeg crosscheck`
    Crosscheck,
    /// The JSON of `obsdeg calibrate`
    Calibration,
    /// The JSON of `obsdeg compare`
    Comparison,
    /// The JSON of `obsdeg design`
    Design,
    /// The JSON of `obsdeg design --part`
    Part,
    /// Scheme files
    Scheme,
    /// The JSON of `obsdeg analyze --model`
    System,
    /// The JSON of `obsdeg simulate --model`
    Run,
    /// The JSON of `obsdeg calibrate --model`
    SystemCalibration,
    /// The JSON of `obsdeg crosscheck --model`
    Evidence,
    /// Model files
    Model,
}

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// What the schema describes
    kind: Kind,
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    let schema = match a.kind {
        Kind::Analysis => schema_for!(Analysis),
        Kind::Audit => schema_for!(Audit),
        Kind::Simulation => schema_for!(Simulation),
        Kind::Crosscheck => schema_for!(CrossCheck),
        Kind::Calibration => schema_for!(Calibration),
        Kind::Comparison => schema_for!(Comparison),
        Kind::Design => schema_for!(Design),
        Kind::Part => schema_for!(Part),
        Kind::Scheme => schema_for!(SchemeFile),
        Kind::System => schema_for!(SystemAnalysis),
        Kind::Run => schema_for!(SystemRun),
        Kind::SystemCalibration => schema_for!(SystemCalibration),
        Kind::Evidence => schema_for!(SystemEvidence),
        Kind::Model => schema_for!(ModelFile),
    };
    let text = serde_json::to_string_pretty(&schema).map_err(|e| Failure::internal(e.to_string()))?;
    output::print((text + "\n").as_bytes())
}

//! `obsdeg schema`: JSON Schemas, generated from the types.

use clap::{Args, ValueEnum};
use obsdeg_calibration::noise::SensorNoiseReport;
use obsdeg_calibration::{Calibration, SystemCalibration};
use obsdeg_core::certificate::{Certificate, ModelCertificate};
use obsdeg_core::model::scheme_file::SchemeFile;
use obsdeg_core::system::SystemAnalysis;
use obsdeg_core::system::model_file::ModelFile;
use obsdeg_design::design::{Design, OptimumCertificate, Part, ShortestSlewSequence};
use obsdeg_design::next::NextPositions;
use obsdeg_design::procedure::Procedure;
use obsdeg_design::sensors::Sensors;
use obsdeg_evidence::audit::Audit;
use obsdeg_evidence::compare::Comparison;
use obsdeg_evidence::crosscheck::CrossCheck;
use obsdeg_evidence::simulation::SchemeAnalysis;
use obsdeg_evidence::simulation::Simulation;
use obsdeg_evidence::system::{SystemEvidence, SystemRun};
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema, schema_for};

use crate::failure::Failure;
use crate::output;

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SchemaKind {
    /// The JSON of `obsdeg allan`
    Allan,
    /// The JSON of `obsdeg analyze`
    Analysis,
    /// The JSON of `obsdeg analyze --certificate`
    Certificate,
    /// The JSON of `obsdeg analyze --certificate` of a model
    ModelCertificate,
    /// The JSON of `obsdeg design --certificate`
    OptimumCertificate,
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
    /// The JSON of `obsdeg design --minimum` where torquer errors make schemes walks
    Walks,
    /// The JSON of `obsdeg design` of a model
    Sensors,
    /// The JSON of `obsdeg design --next`
    Next,
    /// The JSON of `obsdeg procedure`
    Procedure,
    /// Scheme files
    Scheme,
    /// The JSON of `obsdeg analyze` of a model
    System,
    /// The JSON of `obsdeg simulate` of a model
    #[value(alias = "run")]
    SystemRun,
    /// The JSON of `obsdeg calibrate` of a model
    SystemCalibration,
    /// The JSON of `obsdeg crosscheck` of a model
    #[value(alias = "evidence")]
    SystemEvidence,
    /// Model files
    Model,
}

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Answer or file that the schema describes
    kind: SchemaKind,
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    let mut schema = match a.kind {
        SchemaKind::Allan => written::<SensorNoiseReport>(),
        SchemaKind::Analysis => written::<SchemeAnalysis>(),
        SchemaKind::Certificate => written::<Certificate>(),
        SchemaKind::ModelCertificate => written::<ModelCertificate>(),
        SchemaKind::OptimumCertificate => written::<OptimumCertificate>(),
        SchemaKind::Audit => written::<Audit>(),
        SchemaKind::Simulation => written::<Simulation>(),
        SchemaKind::Crosscheck => written::<CrossCheck>(),
        SchemaKind::Calibration => written::<Calibration>(),
        SchemaKind::Comparison => written::<Comparison>(),
        SchemaKind::Design => written::<Design>(),
        SchemaKind::Part => written::<Part>(),
        SchemaKind::Walks => written::<ShortestSlewSequence>(),
        SchemaKind::Sensors => written::<Sensors>(),
        SchemaKind::Next => written::<NextPositions>(),
        SchemaKind::Procedure => written::<Procedure>(),
        SchemaKind::Scheme => schema_for!(SchemeFile),
        SchemaKind::System => written::<SystemAnalysis>(),
        SchemaKind::SystemRun => written::<SystemRun>(),
        SchemaKind::SystemCalibration => written::<SystemCalibration>(),
        SchemaKind::SystemEvidence => written::<SystemEvidence>(),
        SchemaKind::Model => schema_for!(ModelFile),
    };
    let name = a.kind.to_possible_value();
    let name = name.as_ref().map_or("", |v| v.get_name());
    // version 2: layouts whose keys have changed since version 1
    let version = if ["comparison", "design", "part", "simulation"].contains(&name) { 2 } else { 1 };
    schema.insert("$id".into(), format!("urn:obsdeg:{name}:{version}").into());
    let text = serde_json::to_string_pretty(&schema).map_err(|e| Failure::internal(e.to_string()))?;
    output::print((text + "\n").as_bytes())
}

/// Schema of written JSON: keys that the program may leave out are not required.
fn written<T: JsonSchema>() -> Schema {
    SchemaSettings::default().for_serialize().into_generator().into_root_schema_for::<T>()
}

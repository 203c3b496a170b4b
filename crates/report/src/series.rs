//! The time series of a run as CSV and Parquet, with units in the column names.

use std::sync::Arc;

use obsdeg_evidence::simulation::Traces;
use parquet::basic::{Compression, Type as Physical};
use parquet::data_type::{DoubleType, Int32Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

use crate::figures::file_name;
use crate::{Answer, Format, ReportError, TerminalLayout, written};

/// A unit as a part of a column name: `deg/h/g` is `dph_per_g`, `mg/l` is `mg_per_l`.
fn suffix(unit: &str) -> String {
    let short = unit.replace("deg/h", "dph").replace("g^2", "g2").replace('/', "_per_");
    let plain: String = short.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
    if plain.is_empty() { plain } else { format!("_{plain}") }
}

/// Column of a time series.
struct SeriesColumn {
    name: String,
    unit: String,
    values: Vec<f64>,
}

fn columns(record: &Traces) -> Vec<SeriesColumn> {
    let name = format!("t{}", suffix(&record.time_unit));
    let mut out = vec![SeriesColumn { name, unit: record.time_unit.clone(), values: record.time.clone() }];
    for (i, name) in record.names.iter().enumerate() {
        let (series, scale) = (&record.series[i], record.scales[i]);
        for (what, values) in
            [("true", &series.truth), ("estimate", &series.estimate), ("sigma", &series.sigma)]
        {
            let unit = record.units[i].clone();
            let name = format!("{}_{what}{}", file_name(name), suffix(&unit));
            out.push(SeriesColumn { name, unit, values: values.iter().map(|x| x / scale).collect() });
        }
    }
    out
}

/// Run as CSV: one row per sample, with the number of the position from 1.
///
/// # Errors
/// [`ReportError::Csv`].
pub fn series_csv(record: &Traces) -> Result<String, ReportError> {
    let columns = columns(record);
    let header =
        std::iter::once("position".to_string()).chain(columns.iter().map(|c| c.name.clone())).collect();
    let rows = (0..record.time.len()).map(|k| {
        let position = (record.position[k] + 1).to_string();
        std::iter::once(position).chain(columns.iter().map(|c| c.values[k].to_string())).collect()
    });
    crate::csv_text::write(std::iter::once(header).chain(rows))
}

/// Run as Parquet (snappy). Its metadata are `obsdeg.version`, `obsdeg.seed`, `obsdeg.units` (JSON, unit by
/// column) and `obsdeg.summary_sha256`: the digest of the run's summary as JSON, which has all its
/// conditions.
///
/// # Errors
/// [`ReportError::Parquet`], [`ReportError::Json`].
pub fn series_parquet(record: &Traces, summary: &impl Answer) -> Result<Vec<u8>, ReportError> {
    let columns = columns(record);
    let field = |name: &str, kind| {
        Type::primitive_type_builder(name, kind)
            .with_repetition(parquet::basic::Repetition::REQUIRED)
            .build()
            .map(Arc::new)
    };
    let mut fields = vec![field("position", Physical::INT32)?];
    for column in &columns {
        fields.push(field(&column.name, Physical::DOUBLE)?);
    }
    let schema = Arc::new(Type::group_type_builder("series").with_fields(fields).build()?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(metadata(&columns, summary)?))
        .set_created_by(concat!("obsdeg ", env!("CARGO_PKG_VERSION")).into())
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    let positions: Vec<i32> = record.position.iter().map(|&p| p as i32 + 1).collect();
    if let Some(mut column) = group.next_column()? {
        column.typed::<Int32Type>().write_batch(&positions, None, None)?;
        column.close()?;
    }
    for SeriesColumn { values, .. } in &columns {
        if let Some(mut column) = group.next_column()? {
            column.typed::<DoubleType>().write_batch(values, None, None)?;
            column.close()?;
        }
    }
    group.close()?;
    Ok(writer.into_inner()?)
}

fn metadata(columns: &[SeriesColumn], summary: &impl Answer) -> Result<Vec<KeyValue>, ReportError> {
    let text = written(summary, Format::Json, TerminalLayout::default())?;
    let digest: String = Sha256::digest(&text).iter().map(|byte| format!("{byte:02x}")).collect();
    let json: Value = serde_json::from_str(&text)?;
    let units: Map<String, Value> =
        columns.iter().map(|c| (c.name.clone(), Value::from(c.unit.clone()))).collect();
    Ok([
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("seed", json["seed"].to_string()),
        ("units", Value::Object(units).to_string()),
        ("summary_sha256", digest),
    ]
    .map(|(key, value): (&str, String)| KeyValue::new(format!("obsdeg.{key}"), value))
    .into())
}

//! Report on how records are read, before anything is estimated.

use obsdeg_core::model::Scheme;
use obsdeg_core::span::Span;
use obsdeg_evidence::simulation::{Conditions, Plan};
use schemars::JsonSchema;
use serde::Serialize;

use super::gross::GrossReason;
use super::gross::LeftOutCell;
use super::observe::observe;
use super::placed::Reading;
use super::{CalibrationError, Options, run};
use crate::CalibrationProgress;
use crate::answer::{ColumnRead, EmptyCells, Gap, PositionsBy};
use crate::record::Record;

/// Reading of records, as `calibrate --dry-run` shows it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RecordsRead {
    /// Layout of this answer: `obsdeg.records/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Records, in the order in which they are given.
    pub records: Vec<RecordRead>,
}

/// Reading of one record.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RecordRead {
    /// Name of the record.
    pub record: String,
    /// Separator of columns and decimal mark; null for commas and points, and for Parquet.
    pub written: Option<String>,
    /// Columns that are used.
    pub columns: Vec<ColumnRead>,
    /// Headers of the columns that are not used.
    pub ignored: Vec<String>,
    /// Number of rows.
    pub samples: usize,
    /// Number of rows at no position of the scheme.
    pub unused: usize,
    /// Usual interval between rows, in s.
    pub interval_s: f64,
    /// First and last time, in s as they are in the record.
    pub span_s: Span<f64>,
    /// Source of the position of each sample: labels, timeline, both, or intervals at rest.
    pub positions_by: PositionsBy,
    /// Time of the record, in s, at time 0 of the timeline: the start of the scheme, or the first row at a
    /// position if only rows show when positions begin.
    pub origin_s: f64,
    /// Earliest and latest time 0 of the timeline, in s, if the labels leave it open; `calibrate` estimates
    /// it. Null if they do not.
    pub origin_open_s: Option<Span<f64>>,
    /// Positions of the scheme.
    pub positions: Vec<PositionRead>,
    /// Intervals of more than three usual ones without rows, beyond the time of the slew where one lies
    /// between.
    pub gaps: Vec<Gap>,
    /// Number of empty cells at positions, by column.
    pub empty_cells: Vec<EmptyCells>,
    /// Cells that are left out.
    pub left_out: Vec<CellRead>,
    /// Mean length of the specific force, in g; null where the record has none.
    pub force_g: Option<f64>,
    /// Largest angle between the gimbals and the attitudes of the scheme, in deg; null where the record has
    /// no gimbal angles.
    pub gimbals_deg: Option<f64>,
}

/// A position of a record.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PositionRead {
    /// Name of the position.
    pub position: String,
    /// Time of its first row, in s as it is in the record.
    pub from_s: f64,
    /// Time of its last row, in s as it is in the record.
    pub to_s: f64,
    /// Number of bins that its rows are taken together in.
    pub bins: usize,
    /// Length of the specific force, in g, a median; null where the record has none.
    pub force_g: Option<f64>,
}

/// A cell that is left out.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CellRead {
    /// First and last line; more than one where a dense bin is left out as a whole.
    pub lines: Span<u64>,
    /// The header of its column.
    pub column: String,
    /// Its value, as it is written.
    pub value: f64,
    /// Reason to leave it out: `far` from the rows beside it, a `code` of missing values, `stuck`.
    pub why: &'static str,
}

/// Reads records as [`super::calibrate`] does, without an estimate.
///
/// # Errors
/// [`CalibrationError`].
pub fn read_records(
    scheme: &Scheme,
    conditions: &Conditions,
    records: Vec<Record>,
    options: &Options,
    progress: &dyn Fn(CalibrationProgress<'_>) -> bool,
) -> Result<RecordsRead, CalibrationError> {
    super::concern(scheme, &records)?;
    let own = run::conditions(conditions);
    let plan = Plan::new(scheme, &own)?;
    let sigmas: Vec<f64> = plan.components.iter().map(|&c| Plan::output_sigma(c, &own)).collect();
    let read = |record| {
        let reading =
            observe(record, &plan, options.gravity_m_s2, conditions.step_s, sigmas.clone(), progress)?;
        Ok(of(&reading, scheme))
    };
    let records = records.into_iter().map(read).collect::<Result<_, CalibrationError>>()?;
    Ok(RecordsRead { schema: "obsdeg.records/1".into(), version: env!("CARGO_PKG_VERSION").into(), records })
}

fn of(r: &Reading, scheme: &Scheme) -> RecordRead {
    let position = |(p, stay): (usize, &Span<f64>)| PositionRead {
        position: scheme.positions[p].name.clone(),
        from_s: r.origin + stay.from,
        to_s: r.origin + stay.to,
        bins: r.bins[p].len(),
        force_g: r.lengths[p].map(|l| l.length),
    };
    let cell = |LeftOutCell { cell, column }: &LeftOutCell| CellRead {
        lines: cell.lines,
        column: column.clone(),
        value: cell.value,
        why: match cell.why {
            GrossReason::Far => "far",
            GrossReason::Code => "code",
            GrossReason::Stuck => "stuck",
        },
    };
    RecordRead {
        record: r.name.clone(),
        written: r.written.clone(),
        columns: r.columns.clone(),
        ignored: r.ignored.clone(),
        samples: r.samples,
        unused: r.unused,
        interval_s: r.interval,
        span_s: r.span,
        positions_by: r.by.into(),
        origin_s: r.origin,
        origin_open_s: r.open,
        positions: r.stays.iter().enumerate().map(position).collect(),
        gaps: r.gaps(scheme),
        empty_cells: r.missing.clone(),
        left_out: r.cells.iter().map(cell).collect(),
        force_g: r.force,
        gimbals_deg: r.gimbals,
    }
}

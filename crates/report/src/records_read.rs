//! Report on how records are read, before any estimate.

use obsdeg_calibration::platform::{RecordRead, RecordsRead};
use obsdeg_core::span::Span;

use crate::Answer;
use crate::calibration::{by_what, gaps, tenths};
use crate::document::{Document, DocumentBlock, left, number, right};

/// Largest number of listed cells.
const LISTED: usize = 20;

/// Sentences on a record: rows, times, positions.
fn read(r: &RecordRead) -> Vec<String> {
    let mut out = vec![
        format!(
            "{} rows from {} to {} s, {} s apart as a rule; {} of them at no position",
            r.samples,
            tenths(r.span_s.from),
            tenths(r.span_s.to),
            number(r.interval_s),
            r.unused
        ),
        format!("positions by {}", by_what(r.positions_by)),
    ];
    out.extend(r.written.clone());
    let columns: Vec<String> =
        r.columns.iter().map(|c| format!("`{}` (times {})", c.column, number(c.factor))).collect();
    out.push(format!("columns, in s, g, g s, rad or degC by the factor behind each: {}", columns.join(", ")));
    if !r.ignored.is_empty() {
        out.push(format!("columns that are not used: {}", r.ignored.join(", ")));
    }
    out.push(match r.origin_open_s {
        Some(Span { from, to }) => format!(
            "the scheme begins between {from:.3} and {to:.3} s of the record's clock; calibrate estimates when"
        ),
        None => format!("the timeline begins at {:.3} s of the record's clock", r.origin_s),
    });
    out.extend(gaps(&r.gaps));
    let empty: Vec<String> = r.empty_cells.iter().map(|e| format!("{} of `{}`", e.count, e.column)).collect();
    if !empty.is_empty() {
        out.push(format!("empty cells at positions: {}", empty.join(", ")));
    }
    out.extend(r.force_g.map(|f| format!("the specific force is {f:.6} g long on average")));
    out.extend(r.gimbals_deg.map(|off| format!("the gimbals are within {} deg of the scheme", number(off))));
    out
}

impl Answer for RecordsRead {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let mut blocks = Vec::new();
        for r in &self.records {
            blocks.push(DocumentBlock::list(r.record.clone(), read(r)));
            let columns = [
                left("position"),
                right("first row [s]"),
                right("last row [s]"),
                right("bins"),
                right("force [g]"),
            ];
            let rows = r.positions.iter().map(|p| {
                vec![
                    p.position.clone(),
                    tenths(p.from_s),
                    tenths(p.to_s),
                    p.bins.to_string(),
                    p.force_g.map_or_else(|| "-".into(), |f| format!("{f:.6}")),
                ]
            });
            blocks.push(DocumentBlock::table("Positions (times of the record)", columns, rows));
            if !r.left_out.is_empty() {
                let columns = [left("lines"), left("column"), right("value"), left("why")];
                let rows = r.left_out.iter().take(LISTED).map(|c| {
                    let Span { from, to } = c.lines;
                    let lines = if from == to { from.to_string() } else { format!("{from}-{to}") };
                    vec![lines, c.column.clone(), c.value.to_string(), c.why.to_string()]
                });
                let heading = match r.left_out.len() {
                    n if n > LISTED => format!("Cells left out: {n}, of which the first {LISTED}"),
                    n => format!("Cells left out: {n}"),
                };
                blocks.push(DocumentBlock::table(heading, columns, rows));
            }
        }
        let title = "Records as they are read".into();
        Document { title, lead: vec!["nothing was estimated".into()], blocks }
    }

    fn main_table(&self) -> &'static str {
        "records.positions"
    }
}

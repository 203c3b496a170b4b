//! Noise of sensors by the Allan deviation of a static record.

use obsdeg_calibration::noise::{ColumnNoise, NoiseCoefficient, SensorNoiseReport};
use obsdeg_core::span::Span;

use crate::calibration::tenths;
use crate::document::{Document, DocumentBlock, left, number, right};
use crate::figure::{BLUE, Band, Figure, FigureError, ORANGE, SKY, Stroke, grid};
use crate::figures::{File, line, picture};
use crate::{Answer, words};

/// Table row of one coefficient.
fn row(column: &ColumnNoise, c: &NoiseCoefficient) -> Vec<String> {
    let text = |x: Option<f64>| x.map_or_else(|| "-".into(), number);
    vec![
        column.column.clone(),
        c.name.clone(),
        c.unit.clone(),
        text(c.value),
        text(c.sigma),
        if c.resolved {
            "resolved".into()
        } else {
            format!("not resolved: below {} (95 %)", number(c.limit))
        },
        number(c.least_resolved),
    ]
}

/// The first sentence on a column.
fn resolved(c: &ColumnNoise) -> String {
    let names = |resolved: bool| -> Vec<&str> {
        c.coefficients.iter().filter(|k| k.resolved == resolved).map(|k| k.name.as_str()).collect()
    };
    let (found, open) = (names(true), names(false));
    let not = if open.is_empty() {
        String::new()
    } else {
        format!("; not resolved by this record: {}", words::names(open))
    };
    format!("`{}`: resolved: {}{not}.", c.column, words::names(found))
}

/// Statements on the record and the fits.
fn statements(r: &SensorNoiseReport) -> Vec<String> {
    let Span { from, to } = r.span_s;
    let mut out = vec![format!(
        "{} rows from {} to {} s, {} s apart; {} gap{}; other intervals differ by up to {} %.",
        r.samples,
        tenths(from),
        tenths(to),
        number(r.interval_s),
        r.gaps,
        if r.gaps == 1 { "" } else { "s" },
        number(100.0 * r.jitter)
    )];
    for c in &r.columns {
        if c.empty_cells > 0 {
            out.push(format!("`{}`: {} empty cells were skipped.", c.column, c.empty_cells));
        }
        if c.left_out > 0 {
            let lines: Vec<String> = c.left_out_lines.iter().map(u64::to_string).collect();
            out.push(format!(
                "`{}`: {} cells far from both neighbours were left out (lines {}{}).",
                c.column,
                c.left_out,
                lines.join(", "),
                if c.left_out > lines.len() { ", ..." } else { "" }
            ));
        }
        out.push(format!(
            "`{}`: mean {} {}; fit: chi-square {} on {} degrees of freedom (probability {}).",
            c.column,
            number(c.mean),
            c.unit,
            number(c.chi_square),
            c.degrees_of_freedom,
            number(c.probability)
        ));
    }
    if !r.ignored.is_empty() {
        out.push(format!("Columns that are not used: {}.", r.ignored.join(", ")));
    }
    out
}

impl Answer for SensorNoiseReport {
    fn document(&self) -> Document {
        let mut lead: Vec<String> = self.columns.iter().map(resolved).collect();
        lead.extend(self.columns.iter().filter(|c| !c.explained).map(|c| {
            format!(
                "NOT explained: white noise, flicker noise and a random walk do not give the deviations of \
                 `{}` (probability {}). Do not use its coefficients; look for a trend, vibration, \
                 temperature or a coarse resolution of the output.",
                c.column,
                number(c.probability)
            )
        }));
        let columns = [
            left("column"),
            left("noise"),
            left("unit"),
            right("coefficient"),
            right("sigma"),
            left("by this record"),
            right("least it resolves"),
        ];
        let rows = self.columns.iter().flat_map(|c| c.coefficients.iter().map(move |k| row(c, k)));
        let mut blocks = vec![DocumentBlock::table("Noise coefficients (IEEE Std 952-1997)", columns, rows)];
        if !self.simulation_table.is_empty() {
            let lines = self.simulation_table.lines().map(Into::into).collect();
            blocks.push(DocumentBlock::list("For a scheme file", lines));
        }
        blocks.extend(DocumentBlock::list_if_any("How noise maps to settings", self.notes.clone()));
        blocks.push(DocumentBlock::list("Record and fits", statements(self)));
        for c in &self.columns {
            let columns = [
                right("cluster time [s]"),
                right("deviation"),
                right("low"),
                right("high"),
                right("degrees of freedom"),
                right("fitted"),
            ];
            let rows = c.deviations.iter().map(|d| {
                [d.tau_s, d.deviation, d.low, d.high, d.degrees_of_freedom, d.fitted].map(number).to_vec()
            });
            let heading = format!("Overlapping Allan deviation of {}, in {}", c.column, c.unit);
            blocks.push(DocumentBlock::table(heading, columns, rows));
        }
        Document { title: format!("Noise of the sensors in {}", self.record), lead, blocks }
    }

    fn main_table(&self) -> &'static str {
        "columns.coefficients"
    }
}

/// Allan deviations of all columns with their bands, and the fitted noise.
///
/// # Errors
/// [`FigureError`].
pub fn sensor_noise_figures(r: &SensorNoiseReport) -> Result<Vec<File>, FigureError> {
    let figure = |c: &ColumnNoise| Figure {
        title: format!("{}: overlapping Allan deviation", c.column),
        x_label: "cluster time [s]".into(),
        y_label: format!("deviation [{}]", c.unit),
        bands: vec![Band {
            color: SKY,
            points: c.deviations.iter().map(|d| (d.tau_s, d.low, d.high)).collect(),
        }],
        lines: vec![
            line(
                "deviation, with its band",
                BLUE,
                Stroke::Solid,
                c.deviations.iter().map(|d| (d.tau_s, d.deviation)).collect(),
            ),
            line(
                "fitted noise",
                ORANGE,
                Stroke::Dashed,
                c.deviations.iter().map(|d| (d.tau_s, d.fitted)).collect(),
            ),
        ],
        log: true,
        ..Figure::default()
    };
    let figures: Vec<Figure> = r.columns.iter().map(figure).collect();
    let title = format!("Allan deviations, {}", crate::calibration_figures::file_name(&r.record));
    Ok(picture("allan", grid(&figures, figures.len().min(2), &title))?.into())
}

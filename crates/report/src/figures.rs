//! Which figures a result has.

use obsdeg_core::simulation::Record;
use obsdeg_core::simulation::conditions::{shown_unit, si_per_shown};
use obsdeg_core::simulation::record::Series;

use crate::figure::{BLACK, BLUE, Band, Figure, FigureError, Line, SKY, Stroke, grid, png};

/// A file: its name and its bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Name inside the folder.
    pub name: String,
    /// Contents.
    pub bytes: Vec<u8>,
}

impl File {
    pub(crate) fn new(name: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { name: name.into(), bytes: bytes.into() }
    }
}

/// An SVG and the PNG made of it.
pub(crate) fn picture(name: &str, svg: String) -> Result<[File; 2], FigureError> {
    let png = png(&svg)?;
    Ok([File::new(format!("{name}.svg"), svg), File::new(format!("{name}.png"), png)])
}

/// At most this many points a curve: more cannot be seen.
const POINTS: usize = 1000;

/// A name that any file system takes.
pub(crate) fn file_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "_-".contains(c) { c } else { '_' };
    name.replace(" - ", "-").replace('*', "").chars().map(plain).collect()
}

/// The curve of one series: truth, estimate and the band of three sigma around it (figures 2-10 of the paper).
fn curve(record: &Record, i: usize) -> Figure {
    let (series, unit) = (&record.series[i], &record.units[i]);
    let scale = si_per_shown(unit);
    let stride = record.time_s.len().div_ceil(POINTS);
    let samples = || (0..record.time_s.len()).filter(|k| k % stride == 0 || k + 1 == record.time_s.len());
    let points = |values: &[f64]| samples().map(|k| (record.time_s[k], values[k] / scale)).collect();
    let estimate = &series.estimate;
    // the prior would hide what the data say
    let settled: Vec<usize> = samples().filter(|&k| k > 0).collect();
    let span = |k: usize| {
        let width = 3.0 * series.sigma[k] / scale;
        (record.time_s[k], estimate[k] / scale - width, estimate[k] / scale + width)
    };
    let marks = (1..record.position.len())
        .filter(|&k| record.position[k] != record.position[k - 1])
        .map(|k| record.time_s[k - 1])
        .collect();
    let line = |label: &str, color, stroke, points| Line { label: label.into(), color, stroke, points };
    Figure {
        title: record.names[i].clone(),
        x_label: "t [s]".into(),
        y_label: format!("{} [{}]", record.names[i], shown_unit(unit)),
        bands: vec![Band { color: SKY, points: settled.into_iter().map(span).collect() }],
        lines: vec![
            line("truth", BLACK, Stroke::Solid, points(&series.truth)),
            line("estimate, band of 3 sigma", BLUE, Stroke::Dashed, points(estimate)),
        ],
        marks,
        x_range: record.time_s.last().map(|&end| (0.0, end)),
        y_range: Some(window(series, scale)),
        log: false,
    }
}

/// The truth and the estimate with some air: the band of the prior would hide them.
fn window(series: &Series, scale: f64) -> (f64, f64) {
    let values = || series.truth.iter().chain(&series.estimate).map(|x| x / scale);
    let (low, high) = values().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    let last = 6.0 * series.sigma.last().copied().unwrap_or(0.0) / scale;
    let air = (0.35 * (high - low)).max(last.min(3.0 * (high - low))).max(1e-9);
    (low - air, high + air)
}

/// A figure per unknown and combination, and all of them in one.
///
/// # Errors
/// [`FigureError`].
pub fn simulation_figures(record: &Record) -> Result<Vec<File>, FigureError> {
    let figures: Vec<Figure> = (0..record.names.len()).map(|i| curve(record, i)).collect();
    let mut files = Vec::new();
    for (figure, name) in figures.iter().zip(&record.names) {
        files.extend(picture(&file_name(name), figure.svg())?);
    }
    let unknowns = record.names.iter().filter(|n| !n.contains(' ')).count();
    files.extend(picture("all", grid(&figures[..unknowns.min(30)], 3, "Truth, estimate and +-3 sigma"))?);
    Ok(files)
}

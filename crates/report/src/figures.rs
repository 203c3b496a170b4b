//! Which figures a result has.

use obsdeg_evidence::simulation::{Series, Traces};

use crate::figure::{
    BLACK, BLUE, Band, Figure, FigureError, GREEN, GREY, Line, ORANGE, SKY, Stroke, grid, heat, png,
};
use obsdeg_evidence::crosscheck::{CrossCheck, HistoryPoint, SlopeCurve};

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

/// At most this many figures in the grid of all.
const GRID: usize = 30;

/// A name that any file system takes.
pub(crate) fn file_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "_-".contains(c) { c } else { '_' };
    name.replace(" - ", "-").replace('*', "").chars().map(plain).collect()
}

/// The curve of one series: truth, estimate and the band of three sigma around it (figures 2-10 of the paper).
fn curve(record: &Traces, i: usize) -> Figure {
    let (series, unit, scale) = (&record.series[i], &record.units[i], record.scales[i]);
    let bracketed = |unit: &str| if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
    let stride = record.time.len().div_ceil(POINTS);
    let samples = || (0..record.time.len()).filter(|k| k % stride == 0 || k + 1 == record.time.len());
    let points = |values: &[f64]| samples().map(|k| (record.time[k], values[k] / scale)).collect();
    let estimate = &series.estimate;
    // the prior would hide what the data say
    let settled: Vec<usize> = samples().filter(|&k| k > 0).collect();
    let span = |k: usize| {
        let width = 3.0 * series.sigma[k] / scale;
        (record.time[k], estimate[k] / scale - width, estimate[k] / scale + width)
    };
    let marks = (1..record.position.len())
        .filter(|&k| record.position[k] != record.position[k - 1])
        .map(|k| record.time[k - 1])
        .collect();
    let line = |label: &str, color, stroke, points| Line { label: label.into(), color, stroke, points };
    Figure {
        title: series_title(record, i),
        x_label: format!("t{}", bracketed(&record.time_unit)),
        y_label: format!("{}{}", record.names[i], bracketed(unit)),
        bands: vec![Band { color: SKY, points: settled.into_iter().map(span).collect() }],
        lines: vec![
            line("truth", BLACK, Stroke::Solid, points(&series.truth)),
            line("estimate, band of 3 sigma", BLUE, Stroke::Dashed, points(estimate)),
        ],
        marks,
        x_range: record.time.last().map(|&end| (0.0, end)),
        y_range: Some(window(series, scale)),
        ..Figure::default()
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

/// The name of a series, and whether it shows the prior alone.
pub(crate) fn series_title(record: &Traces, i: usize) -> String {
    let determined = record.determined.get(i).copied().unwrap_or(false);
    let prior = if determined { "" } else { ", known from the prior only" };
    format!("{}{prior}", record.names[i])
}

/// A figure per unknown and combination, and all of them in one.
///
/// # Errors
/// [`FigureError`].
pub fn simulation_figures(record: &Traces) -> Result<Vec<File>, FigureError> {
    let figures: Vec<Figure> = (0..record.names.len()).map(|i| curve(record, i)).collect();
    let mut files = Vec::new();
    for (figure, name) in figures.iter().zip(&record.names) {
        files.extend(picture(&file_name(name), figure.svg())?);
    }
    let unknowns = record.names.iter().filter(|n| !n.contains(' ')).count();
    let part =
        if unknowns > GRID { format!(" (the first {GRID} of {unknowns} unknowns)") } else { String::new() };
    let title = format!("Truth, estimate and +-3 sigma{part}");
    files.extend(picture("all", grid(&figures[..unknowns.min(GRID)], 3, &title))?);
    Ok(files)
}

/// Colours of the accuracy orders 0, 1, 2 and beyond, and of what is not observable.
fn order_color(order: Option<usize>) -> &'static str {
    match order {
        Some(0) => GREEN,
        Some(1) => BLUE,
        Some(_) => ORANGE,
        None => GREY,
    }
}

/// Sigma against the dwell for unknowns of one unit, with a reference slope per order.
pub(crate) fn slope_figure(curves: &[&SlopeCurve], unit: &str) -> Figure {
    let mut orders: Vec<Option<usize>> = curves.iter().map(|c| c.accuracy_order).collect();
    orders.sort_unstable();
    orders.dedup();
    let mut lines = Vec::new();
    for &order in &orders {
        for c in curves.iter().filter(|c| c.accuracy_order == order) {
            let what = order.map_or_else(|| "not observable (prior)".into(), |d| format!("order {d}"));
            lines.push(Line {
                label: format!("{}, {what}", c.name),
                color: order_color(order),
                stroke: Stroke::Solid,
                points: c.points.clone(),
            });
        }
        // the reference goes through the middle of the first curve
        let first = curves.iter().find(|c| c.accuracy_order == order).map(|c| &c.points);
        if let (Some(d), Some(points)) = (order, first) {
            let (t0, s0) = points[points.len() / 2];
            let slope = -(d as f64 + 0.5);
            let reference = points.iter().map(|&(t, _)| (t, 2.0 * s0 * (t / t0).powf(slope)));
            lines.push(Line {
                label: format!("slope {slope:.1}"),
                color: BLACK,
                stroke: Stroke::Dotted,
                points: reference.collect(),
            });
        }
    }
    // what stays at a diffuse prior would squeeze the rest
    lines.retain(|l| l.color != GREY || lines_are_all_grey(curves));
    Figure {
        title: format!("Sigma against dwell [{unit}]"),
        x_label: "dwell of a position [s]".into(),
        y_label: format!("sigma [{unit}]"),
        lines,
        log: true,
        ..Figure::default()
    }
}

fn lines_are_all_grey(curves: &[&SlopeCurve]) -> bool {
    curves.iter().all(|c| c.accuracy_order.is_none())
}

/// A mean over time with the bands in which a right filter's stays.
pub(crate) fn history_figure(
    c: &CrossCheck,
    title: &str,
    dof: usize,
    value: impl Fn(&HistoryPoint) -> f64,
    count: impl Fn(&HistoryPoint) -> usize,
) -> Figure {
    let history = &c.monte_carlo.history;
    let band = |p: &HistoryPoint| {
        let (low, high) = obsdeg_evidence::crosscheck::mean_band(dof, count(p));
        (p.t_s, low, high)
    };
    let end = history.last().map_or(1.0, |p| p.t_s);
    let line = |label: &str, color, stroke, points| Line { label: label.into(), color, stroke, points };
    Figure {
        title: title.into(),
        x_label: "t [s]".into(),
        y_label: format!("mean {title}"),
        bands: vec![Band { color: SKY, points: history.iter().map(band).collect() }],
        lines: vec![
            line("expected, band of 95 %", BLACK, Stroke::Dotted, vec![(0.0, dof as f64), (end, dof as f64)]),
            line("measured", BLUE, Stroke::Solid, history.iter().map(|p| (p.t_s, value(p))).collect()),
        ],
        marks: c.timeline.iter().skip(1).map(|t| t.start_s).collect(),
        x_range: Some((0.0, end)),
        ..Figure::default()
    }
}

/// The figures of a cross-check: slopes per unit, NEES and NIS over time, the correlations.
///
/// # Errors
/// [`FigureError`].
pub fn crosscheck_figures(c: &CrossCheck) -> Result<Vec<File>, FigureError> {
    let mut files = Vec::new();
    let mut units: Vec<&str> = c.slopes.iter().map(|s| s.unit.as_str()).collect();
    units.dedup();
    units.sort_unstable();
    units.dedup();
    let mut figures = Vec::new();
    for unit in units {
        let curves: Vec<&SlopeCurve> = c.slopes.iter().filter(|s| s.unit == unit).collect();
        figures.push(slope_figure(&curves, unit));
    }
    files.extend(picture(
        "slopes",
        grid(&figures, figures.len().min(3), "Sigma against dwell, no drift noise"),
    )?);
    let outputs = c.monte_carlo.statistics.last().map_or(2, |s| s.expected as usize);
    let n = c.correlation.names.len();
    let runs = c.monte_carlo.runs;
    let comparable = c.monte_carlo.statistics.len() > 1;
    if comparable {
        files.extend(picture("nees", history_figure(c, "NEES", n, |p| p.nees, |_| runs).svg())?);
    }
    files.extend(picture("nis", history_figure(c, "NIS", outputs, |p| p.nis, |p| p.samples).svg())?);
    let title = "Correlation under a diffuse prior";
    let (names, values) = (&c.correlation.names, c.correlation.values.clone());
    files.extend(picture("correlation", heat(title, names, names, values, -1.0))?);
    Ok(files)
}

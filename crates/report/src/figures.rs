//! Figures of simulated runs and cross-checks.

use obsdeg_evidence::simulation::{Series, Traces};
use obsdeg_exact::parallel;

use crate::document::number;
use crate::figure::{
    AMBER, BLACK, BLUE, Band, Curve, Figure, FigureError, ORANGE, SKY, Stroke, grid, heat, png, style,
};
use obsdeg_evidence::crosscheck::{CrossCheck, HistoryPoint, SlopeCurve};

/// Name and content of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Name inside the folder.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
}

impl File {
    /// File of this name and content.
    pub fn new(name: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { name: name.into(), bytes: bytes.into() }
    }
}

/// SVG of a figure, and the PNG made from it.
pub(crate) fn picture(name: &str, svg: String) -> Result<[File; 2], FigureError> {
    let png = png(&svg)?;
    Ok([File::new(format!("{name}.svg"), svg), File::new(format!("{name}.png"), png)])
}

/// Picture before it is drawn.
enum UndrawnPicture {
    One(Figure),
    /// Figures in three columns under a title.
    Grid(Vec<Figure>, String),
}

/// Pictures with their names as files, in this order, drawn on all threads.
fn drawn(all: &[(String, UndrawnPicture)]) -> Result<Vec<File>, FigureError> {
    let files = parallel::try_map(all.len(), |i| {
        let (name, planned) = &all[i];
        picture(
            name,
            match planned {
                UndrawnPicture::One(figure) => figure.svg(),
                UndrawnPicture::Grid(figures, title) => grid(figures, 3, title),
            },
        )
    })?;
    Ok(files.into_iter().flatten().collect())
}

/// Largest number of points of a curve: no screen shows more.
const POINTS: usize = 1000;

/// Largest number of figures in the grid of all.
const GRID: usize = 30;

/// File name that every file system accepts.
pub(crate) fn file_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "_-".contains(c) { c } else { '_' };
    name.replace(" - ", "-").replace('*', "").chars().map(plain).collect()
}

/// Unknowns of the paper's figures 2 to 10, in their order.
const PAPER: [&str; 9] = ["psi_x", "psi_y", "psi_z", "D_FX", "D_FY", "D_FZ", "D_SX", "D_IY", "D_SZ"];

/// Indices of at most `most` samples after the start, the last sample included. The start is left out: the
/// prior there would hide the rest.
fn settled(record: &Traces, most: usize) -> Vec<usize> {
    let stride = record.time.len().div_ceil(most).max(1);
    (1..record.time.len()).filter(|k| k % stride == 0 || k + 1 == record.time.len()).collect()
}

/// Times at which positions end.
fn boundaries(record: &Traces) -> Vec<f64> {
    (1..record.position.len())
        .filter(|&k| record.position[k] != record.position[k - 1])
        .map(|k| record.time[k - 1])
        .collect()
}

fn bracketed(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" [{unit}]") }
}

pub(crate) fn line(
    label: impl Into<String>,
    color: &'static str,
    stroke: Stroke,
    points: Vec<(f64, f64)>,
) -> Curve {
    Curve { label: label.into(), color, stroke, points }
}

/// The curve of one series: truth, estimate and the band of three sigma around it.
fn curve(record: &Traces, i: usize) -> Figure {
    let (series, scale) = (&record.series[i], record.scales[i]);
    let settled = settled(record, POINTS);
    let points = |values: &[f64]| {
        std::iter::once(0)
            .chain(settled.iter().copied())
            .map(|k| (record.time[k], values[k] / scale))
            .collect()
    };
    let estimate = &series.estimate;
    let span = |&k: &usize| {
        let width = 3.0 * series.sigma[k] / scale;
        (record.time[k], estimate[k] / scale - width, estimate[k] / scale + width)
    };
    // the title alone has a long name
    let name = &record.names[i];
    let shown = if name.len() > 16 { "value" } else { name };
    Figure {
        title: series_title(record, i),
        x_label: format!("t{}", bracketed(&record.time_unit)),
        y_label: format!("{shown}{}", bracketed(&record.units[i])),
        bands: vec![Band { color: SKY, points: settled.iter().map(span).collect() }],
        lines: vec![
            line("truth", BLACK, Stroke::Solid, points(&series.truth)),
            line("estimate, band of +-3 sigma", BLUE, Stroke::Dashed, points(estimate)),
        ],
        marks: boundaries(record),
        x_range: record.time.last().map(|&end| (0.0, end)),
        y_range: Some(window(series, scale)),
        ..Figure::default()
    }
}

/// Smallest error of a picture, as a fraction of the smallest 3 sigma: smaller ones are drawn there.
const LEAST_ERROR: f64 = 0.03;

/// Absolute error of one series (estimate minus truth) beside 3 sigma, on a logarithmic axis; those of the
/// linear filter on the same measurements, and the offset that an unknown psi leaves.
pub(crate) fn error_figure(record: &Traces, i: usize, most: usize) -> Figure {
    let (scale, unit) = (record.scales[i], &record.units[i]);
    let settled = settled(record, most);
    let end = record.time.last().copied().unwrap_or(0.0);
    let mut all = vec![(&record.series[i], "", BLUE, SKY)];
    all.extend(record.linear.as_ref().map(|linear| (&linear[i], " of the linear filter", ORANGE, AMBER)));
    let widths =
        |series: &Series| -> Vec<f64> { settled.iter().map(|&k| 3.0 * series.sigma[k] / scale).collect() };
    let positive = all.iter().flat_map(|(series, ..)| widths(series)).filter(|w| *w > 0.0);
    let (least, largest) = positive.fold((f64::MAX, 0.0f64), |(l, m), w| (l.min(w), m.max(w)));
    let (least, largest) = if largest > 0.0 { (least * LEAST_ERROR, 2.0 * largest) } else { (1e-3, 1.0) };
    let along = |y: Vec<f64>| settled.iter().map(|&k| record.time[k]).zip(y).collect::<Vec<(f64, f64)>>();
    let mut lines = Vec::new();
    for (series, whose, color, soft) in all {
        let error = |&k: &usize| ((series.estimate[k] - series.truth[k]) / scale).abs().clamp(least, largest);
        let widths = widths(series).into_iter().map(|w| w.max(least)).collect();
        lines.push(line(format!("3 sigma{whose}"), soft, Stroke::Dashed, along(widths)));
        lines.push(line(
            format!("|error|{whose}"),
            color,
            Stroke::Solid,
            along(settled.iter().map(error).collect()),
        ));
    }
    if let Some((what, offset)) = offset(record, i) {
        let label = format!("|{what}| = {} {unit}", number(offset.abs()));
        let at = offset.abs().clamp(least, largest);
        lines.push(line(label, BLACK, Stroke::Dotted, vec![(0.0, at), (end, at)]));
    }
    Figure {
        title: format!("Error of {}", series_title(record, i)),
        x_label: format!("t{}", bracketed(&record.time_unit)),
        y_label: format!("|error|{}", bracketed(unit)),
        lines,
        marks: boundaries(record),
        x_range: Some((0.0, end)),
        y_range: Some((least, largest)),
        log_y: true,
        ..Figure::default()
    }
}

/// Offset of an unknown that outputs determine only together with a psi: the error of psi at the start,
/// transferred by their combination. In the paper D_FZ is off by `wN*psi_y(0)`.
fn offset(record: &Traces, i: usize) -> Option<(String, f64)> {
    if record.determined.get(i).copied().unwrap_or(true) {
        return None;
    }
    let (j, sign, term) = record.names.iter().enumerate().find_map(|(j, name)| {
        let rest = name.strip_prefix(&record.names[i])?;
        let (sign, term) =
            rest.strip_prefix(" - ").map(|t| ("", t)).or(rest.strip_prefix(" + ").map(|t| ("-", t)))?;
        (record.determined.get(j).copied().unwrap_or(false) && !term.contains(' ')).then_some((j, sign, term))
    })?;
    let (factor, psi) =
        term.rsplit_once('*').map_or((String::new(), term), |(f, psi)| (format!("{f}*"), psi));
    let at_start = |j: usize| {
        let s = &record.series[j];
        Some((s.estimate.first()? - s.truth.first()?) / record.scales[i])
    };
    let offset = at_start(i)? - at_start(j)?;
    psi.starts_with("psi_").then(|| (format!("{sign}{factor}(error of {psi} at t = 0)"), offset))
}

/// Range of truth and estimate with a margin; the band of the prior would hide them.
fn window(series: &Series, scale: f64) -> (f64, f64) {
    let values = || series.truth.iter().chain(&series.estimate).map(|x| x / scale);
    let (low, high) = values().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    let last = 6.0 * series.sigma.last().copied().unwrap_or(0.0) / scale;
    let air = (0.35 * (high - low)).max(last.min(3.0 * (high - low))).max(1e-9);
    (low - air, high + air)
}

/// Name of a series, with a remark if it shows the prior alone. A filter with full attitudes may determine
/// such an unknown from large angles.
pub(crate) fn series_title(record: &Traces, i: usize) -> String {
    let determined = record.determined.get(i).copied().unwrap_or(false);
    let prior = match (determined, &record.linear) {
        (true, _) => "",
        (false, None) => ", known from the prior only",
        (false, Some(_)) => ", not determined at small angles",
    };
    format!("{}{prior}", record.names[i])
}

/// Two figures per unknown and combination, the estimate and its error. Grids show the figures of all
/// unknowns, and those of the paper's figures 2 to 10 in its order.
///
/// # Errors
/// [`FigureError`].
pub fn simulation_figures(record: &Traces) -> Result<Vec<File>, FigureError> {
    let all = || 0..record.names.len();
    let unknowns: Vec<usize> = all().filter(|&i| !record.names[i].contains(' ')).collect();
    let count = unknowns.len();
    let part = if count > GRID { format!(" (the first {GRID} of {count} unknowns)") } else { String::new() };
    let papers: Option<Vec<usize>> =
        PAPER.iter().map(|name| record.names.iter().position(|n| n == name)).collect();
    let estimates: Vec<Figure> = all().map(|i| curve(record, i)).collect();
    let errors: Vec<Figure> = all().map(|i| error_figure(record, i, POINTS)).collect();
    let mut planned = Vec::new();
    // names of unknowns have no dot
    for (figures, end, title) in [
        (estimates, "", "Truth, estimate and +-3 sigma"),
        (errors, ".error", "Error (absolute value of estimate minus truth) and 3 sigma"),
    ] {
        for (figure, name) in figures.iter().zip(&record.names) {
            planned.push((format!("{}{end}", file_name(name)), UndrawnPicture::One(figure.clone())));
        }
        let some: Vec<Figure> = unknowns.iter().take(GRID).map(|&i| figures[i].clone()).collect();
        planned.push((format!("all{end}"), UndrawnPicture::Grid(some, format!("{title}{part}"))));
        let numbered = |(k, &i): (usize, &usize)| Figure {
            title: format!("{}: {}", k + 2, figures[i].title),
            ..figures[i].clone()
        };
        if let Some(papers) = &papers {
            let some: Vec<Figure> = papers.iter().enumerate().map(numbered).collect();
            let title = format!("{title}: the unknowns of the paper's figures 2 to 10");
            planned.push((format!("figures-2-to-10{end}"), UndrawnPicture::Grid(some, title)));
        }
    }
    // the largest first, so that no thread is left with one at the end
    planned.sort_by_key(|(_, what)| matches!(what, UndrawnPicture::One(_)));
    drawn(&planned)
}

/// Sigma against the dwell for unknowns of one unit, with a reference slope per order. Styles are numbered
/// from `first`.
pub(crate) fn slope_figure(curves: &[&SlopeCurve], unit: &str, first: usize) -> Figure {
    // without unknowns that stay at a diffuse prior, which would compress the rest
    let any = curves.iter().any(|c| c.accuracy_order.is_some());
    let mut curves: Vec<&SlopeCurve> =
        curves.iter().copied().filter(|c| c.accuracy_order.is_some() || !any).collect();
    curves.sort_by_key(|c| c.accuracy_order);
    let mut lines = Vec::new();
    for (i, c) in curves.iter().enumerate() {
        let what = c.accuracy_order.map_or_else(|| "not observable (prior)".into(), |d| format!("order {d}"));
        let (color, stroke) = style(first + i);
        lines.push(line(
            format!("{}, {what}", c.name),
            color,
            stroke,
            c.points.iter().map(|p| (p.dwell_s, p.sigma)).collect(),
        ));
        let ends = curves.get(i + 1).is_none_or(|next| next.accuracy_order != c.accuracy_order);
        let Some(d) = c.accuracy_order.filter(|_| ends) else { continue };
        // twice as high as the middle of the first curve of this order
        let Some(of) = curves.iter().find(|of| of.accuracy_order == c.accuracy_order) else { continue };
        let middle = of.points[of.points.len() / 2];
        let slope = -(d as f64 + 0.5);
        let reference = of
            .points
            .iter()
            .map(|p| (p.dwell_s, 2.0 * middle.sigma * (p.dwell_s / middle.dwell_s).powf(slope)));
        lines.push(line(format!("slope {slope:.1}"), BLACK, Stroke::Dotted, reference.collect()));
    }
    Figure {
        title: format!("Sigma against dwell [{unit}]"),
        x_label: "dwell of a position [s]".into(),
        y_label: format!("1 sigma [{unit}]"),
        lines,
        log: true,
        ..Figure::default()
    }
}

/// Mean over time with the bands that a right filter's mean stays in.
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
    Figure {
        title: title.into(),
        x_label: "t [s]".into(),
        y_label: format!("mean {title} [-]"),
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
    let (mut figures, mut before) = (Vec::new(), 0);
    for unit in units {
        let curves: Vec<&SlopeCurve> = c.slopes.iter().filter(|s| s.unit == unit).collect();
        figures.push(slope_figure(&curves, unit, before));
        before += curves.iter().filter(|c| c.accuracy_order.is_some()).count();
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

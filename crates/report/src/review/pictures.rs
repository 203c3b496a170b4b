//! The pictures of a review.

use obsdeg_core::analysis::Analysis;
use obsdeg_core::model::Pose;
use obsdeg_core::system::SystemAnalysis;
use obsdeg_design::review::{SchemeReview, Sweep};
use obsdeg_evidence::compare::{ComparedQuantity, ComparedScheme};
use obsdeg_evidence::crosscheck::{CrossCheck, SlopeCurve};
use obsdeg_evidence::simulation::Traces;

use crate::design::bound_steps;
use crate::document::{DocumentBlock, Drawing, Picture};
use crate::figure::{BLACK, BLUE, Curve, Figure, GREEN, ORANGE, Stroke, heat, style};
use crate::figures::{error_figure, file_name, history_figure, series_title, slope_figure};
use crate::poses::{caption, panels};

/// Largest number of points of a curve.
const POINTS: usize = 160;
/// Largest number of pictures of errors.
const ERRORS: usize = 40;

fn curves(name: &str, caption: impl Into<String>, figure: Figure) -> DocumentBlock {
    let drawing = Drawing::Curves(Box::new(figure));
    DocumentBlock::Picture(Picture { name: name.into(), caption: caption.into(), drawing })
}

pub(super) fn still(name: &str, caption: impl Into<String>, svg: String) -> DocumentBlock {
    DocumentBlock::Picture(Picture {
        name: name.into(),
        caption: caption.into(),
        drawing: Drawing::Still(svg),
    })
}

fn line(label: &str, color: &'static str, stroke: Stroke, points: Vec<(f64, f64)>) -> Curve {
    Curve { label: label.into(), color, stroke, points }
}

fn map(name: &str, caption: impl Into<String>, svg: String) -> DocumentBlock {
    DocumentBlock::Picture(Picture { name: name.into(), caption: caption.into(), drawing: Drawing::Map(svg) })
}

/// The rank over the order of derivatives, as steps.
fn stairs(profile: &[usize], unknowns: usize) -> Figure {
    let last = profile.len().max(1) as f64;
    let mut points = Vec::new();
    for (k, &rank) in profile.iter().enumerate() {
        points.push((k as f64, rank as f64));
        points.push((k as f64 + 1.0, rank as f64));
    }
    Figure {
        title: "Degree staircase".into(),
        x_label: "order of derivatives".into(),
        y_label: "rank".into(),
        lines: vec![
            line("rank", BLUE, Stroke::Solid, points),
            line("unknowns", BLACK, Stroke::Dotted, vec![(0.0, unknowns as f64), (last, unknowns as f64)]),
        ],
        x_range: Some((0.0, last)),
        y_range: Some((0.0, unknowns as f64 + 1.0)),
        orders: true,
        ..Figure::default()
    }
}

pub(super) fn staircase(a: &Analysis, name: &str) -> DocumentBlock {
    let mut names: Vec<Vec<&str>> = vec![Vec::new(); a.rank_profile.len()];
    for q in &a.quantities {
        if let Some(slot) = q.degree.and_then(|k| names.get_mut(k)) {
            slot.push(&q.name);
        }
    }
    let steps = names.iter().enumerate().filter(|(_, n)| !n.is_empty());
    let text: Vec<String> = steps.map(|(k, n)| format!("order {k} solves {}", n.join(", "))).collect();
    let caption = format!("Rank over the order of derivatives: {}", text.join("; "));
    curves(name, caption, stairs(&a.rank_profile, a.unknowns.len()))
}

pub(super) fn model_staircase(a: &SystemAnalysis, name: &str) -> DocumentBlock {
    curves(name, "Rank over the order of derivatives", stairs(&a.rank_profile, a.unknowns))
}

/// Largest number of positions drawn, and of positions in one picture.
const POSES: usize = 96;
const PANELS: usize = 12;

/// Pictures of the platform at every position.
pub(super) fn poses(poses: &[Pose], latitude_deg: f64, by_default: bool, id: &str) -> Vec<DocumentBlock> {
    let drawn = &poses[..poses.len().min(POSES)];
    let of = |(i, some): (usize, &[Pose])| {
        let caption = match (i, some) {
            (0, _) => caption(poses, latitude_deg, by_default),
            (_, [first, .., last]) => format!("The same at {} to {}", first.name, last.name),
            (_, others) => format!("The same at {}", others[0].name),
        };
        let drawing = Drawing::Panels(panels(some, latitude_deg));
        DocumentBlock::Picture(Picture { name: format!("{id}_positions_{}", i + 1), caption, drawing })
    };
    let mut out: Vec<DocumentBlock> = drawn.chunks(PANELS).enumerate().map(of).collect();
    if drawn.len() < poses.len() {
        out.push(DocumentBlock::Text(format!("The first {POSES} of {} positions are drawn.", poses.len())));
    }
    out
}

/// Gravity along the platform axes over time.
pub(super) fn attitudes(s: &SchemeReview, name: &str) -> DocumentBlock {
    let axis = |k: usize| s.attitudes.iter().map(|a| (a.t_s, a.g[k])).collect();
    let figure = Figure {
        title: "Attitude: components of g".into(),
        x_label: "t [s]".into(),
        y_label: "component of g [g]".into(),
        lines: vec![
            line("X_p", BLUE, Stroke::Solid, axis(0)),
            line("Y_p", ORANGE, Stroke::Dashed, axis(1)),
            line("Z_p", GREEN, Stroke::Dotted, axis(2)),
        ],
        marks: s.positions.iter().skip(1).map(|p| p.start_s).collect(),
        x_range: s.attitudes.last().map(|a| (0.0, a.t_s)),
        y_range: Some((-1.15, 1.15)),
        ..Figure::default()
    };
    let starts: Vec<String> = s
        .positions
        .iter()
        .map(|p| format!("{} from {} s", p.name, super::sections::seconds(p.start_s)))
        .collect();
    curves(
        name,
        format!("Attitude over time, as gravity along the platform axes: {}", starts.join(", ")),
        figure,
    )
}

/// Map of the drift that each coefficient causes at each position.
pub(super) fn excitation(
    coefficients: &[&ComparedQuantity],
    positions: &[String],
    name: &str,
) -> DocumentBlock {
    let rows: Vec<String> = coefficients.iter().map(|q| q.name.clone()).collect();
    let values =
        coefficients.iter().map(|q| q.excitation.iter().map(|x| x.abs().min(1.0)).collect()).collect();
    let svg = heat("Excitation", &rows, positions, values, 0.0);
    map(
        name,
        "Excitation map: how each coefficient moves the drift, or Z, at each position (0 blank, 1 blue; a \
         torquer by the earth rate)",
        svg,
    )
}

/// Curves of the observable unknowns in `of`, one each.
fn sweep(s: &Sweep, of: &[String], x: impl Fn(f64) -> f64) -> Vec<Curve> {
    let columns: Vec<usize> = (0..s.names.len()).filter(|&c| of.contains(&s.names[c])).collect();
    let curve = |(i, &c): (usize, &usize)| {
        let points = s.x.iter().zip(&s.sigmas).filter_map(|(&t, row)| Some((x(t), row[c]?)));
        let (color, stroke) = style(i);
        line(&s.names[c], color, stroke, points.collect())
    };
    columns.iter().enumerate().map(curve).filter(|l| l.points.len() > 1).collect()
}

/// Largest number of curves of a sweep.
const WORST: usize = 6;

/// Names of the drift coefficients of a sweep with the largest last values, in the order of the sweep.
fn drifts(s: &Sweep) -> Vec<String> {
    let last = |c: usize| s.sigmas.iter().rev().find_map(|row| row[c]).unwrap_or(0.0);
    let mut order: Vec<usize> = (0..s.names.len()).filter(|&c| s.names[c].starts_with("D_")).collect();
    order.sort_by(|&a, &b| last(b).total_cmp(&last(a)));
    order.truncate(WORST);
    order.sort_unstable();
    order.into_iter().map(|c| s.names[c].clone()).collect()
}

/// Note on coefficients without a curve; empty if each has one.
fn not_shown(s: &Sweep) -> String {
    let all = s.names.iter().filter(|n| n.starts_with("D_")).count();
    if all > WORST {
        format!(" ({WORST} of {all} coefficients, those with the largest)")
    } else {
        String::new()
    }
}

/// Name of the quantity of the sweeps.
fn predicted(s: &SchemeReview) -> &'static str {
    if s.simulation.requirements.with_bench { "total uncertainty with the bench" } else { "sigma" }
}

pub(super) fn latitudes(s: &SchemeReview, name: &str) -> Option<DocumentBlock> {
    let lines = sweep(&s.latitudes, &drifts(&s.latitudes), |x| x);
    let what = predicted(s);
    let figure = Figure {
        title: format!("Predicted {what} against latitude"),
        x_label: "latitude [deg]".into(),
        y_label: "1 sigma [deg/h, deg/h/g]".into(),
        x_range: Some((0.0, 90.0)),
        y_range: logarithmic_window(&lines),
        log_y: true,
        lines,
        ..Figure::default()
    };
    let caption = format!(
        "Predicted {what} of the coefficients against the latitude; a curve ends where its coefficient is \
         not observable{}",
        not_shown(&s.latitudes)
    );
    (!figure.lines.is_empty()).then(|| curves(name, caption, figure))
}

pub(super) fn dwells(s: &SchemeReview, review: &ComparedScheme, name: &str) -> Option<DocumentBlock> {
    let (total, what) = (review.total_s, predicted(s));
    let slews: f64 = s.positions.iter().filter_map(|p| p.slew_s).sum();
    let mut lines = sweep(&s.dwells, &drifts(&s.dwells), |factor| (total - slews) * factor + slews);
    let (first, last) = (lines.first()?.points.first()?.0, lines.first()?.points.last()?.0);
    let mut required: Vec<f64> = (review.quantities.iter())
        .filter(|q| q.name.starts_with("D_"))
        .filter_map(|q| q.requirement)
        .collect();
    required.sort_by(f64::total_cmp);
    required.dedup();
    for r in &required {
        lines.push(line(&format!("required {r}"), BLACK, Stroke::Dotted, vec![(first, *r), (last, *r)]));
    }
    let figure = Figure {
        title: format!("Predicted {what} against time"),
        x_label: "total time, dwells scaled alike [s]".into(),
        y_label: "1 sigma [deg/h, deg/h/g]".into(),
        lines,
        log: true,
        ..Figure::default()
    };
    let required = if required.is_empty() { "" } else { ", with the required sigma" };
    let caption = format!(
        "What longer dwells buy: predicted {what} against the total time{required}{}",
        not_shown(&s.dwells)
    );
    Some(curves(name, caption, figure))
}

/// Range of the positive values of curves with a margin; `None` without positive values.
fn logarithmic_window(lines: &[Curve]) -> Option<(f64, f64)> {
    let values = lines.iter().flat_map(|l| l.points.iter().map(|p| p.1)).filter(|y| *y > 0.0);
    let (low, high) = values.fold((f64::MAX, 0.0f64), |(l, h), y| (l.min(y), h.max(y)));
    (high > 0.0).then_some((low / 1.5, high * 1.5))
}

/// Total time against the largest sigma: schemes at other dwells, and the front of the found schemes; `None`
/// if no dwell determines the unknowns.
pub(super) fn time_against_sigma(schemes: &[SchemeReview], name: &str) -> Option<DocumentBlock> {
    let mut lines = Vec::new();
    for (i, s) in schemes.iter().enumerate() {
        let slews: f64 = s.positions.iter().filter_map(|p| p.slew_s).sum();
        let dwell: f64 = s.positions.iter().map(|p| p.dwell_s).sum();
        let worst = s.dwells.worst(&s.alternatives.required);
        let points: Vec<(f64, f64)> = worst.into_iter().map(|(f, y)| (dwell * f + slews, y)).collect();
        let (color, _) = style(i);
        // the legend of a page shows colours, not strokes, so each line of a single scheme has its own colour
        let (found, least) = if schemes.len() == 1 { (ORANGE, BLACK) } else { (color, color) };
        if points.len() > 1 {
            lines.push(line(&s.name, color, Stroke::Solid, points));
        }
        let points: Vec<(f64, f64)> = s.alternatives.front.iter().map(|f| (f.total_s, f.value)).collect();
        if points.len() > 1 {
            let label = format!("best {} of 24 ({})", s.alternatives.front_positions, s.name);
            lines.push(line(&label, found, Stroke::Dotted, points));
        }
        let bound = s.alternatives.certificate.as_ref().map_or(&[][..], |c| &c.front);
        if bound.len() > 1 {
            let label = format!("bound, {} of 24 ({})", s.alternatives.front_positions, s.name);
            lines.push(line(&label, least, Stroke::DashDot, bound_steps(bound)));
        }
    }
    let bench = schemes.iter().any(|s| s.simulation.requirements.with_bench);
    let figure = Figure {
        title: "Pareto front".into(),
        x_label: "total time [s]".into(),
        y_label: format!("largest {} [deg/h, deg/h/g]", if bench { "total" } else { "1 sigma" }),
        lines,
        log: true,
        ..Figure::default()
    };
    let largest = if bench { "largest total uncertainty with the bench" } else { "largest predicted sigma" };
    let caption = format!(
        "Total time against the {largest} of what the scheme determines: the scheme \
                   at other dwells, and the best of as many cardinal attitudes (five at most; under reset \
                   carry twelve, with their bound)"
    );
    (!figure.lines.is_empty()).then(|| curves(name, caption, figure))
}

/// Errors of the estimate beside three sigma, a picture each, with the name of the unknown. Unknowns in
/// `flat` are not drawn, since nothing affects them.
pub(super) fn errors(traces: &Traces, flat: &[&str], id: &str) -> Vec<(String, DocumentBlock)> {
    let beside = traces.linear.as_ref().map_or("", |_| ", and of the linear filter on the same measurements");
    let of = |i: usize| {
        let name = format!("{id}_error_{}_{}", i + 1, file_name(&traces.names[i]));
        let caption = format!(
            "Error of the estimate of {}, its absolute value, and 3 sigma{beside}",
            series_title(traces, i)
        );
        (traces.names[i].clone(), curves(&name, caption, error_figure(traces, i, POINTS)))
    };
    let moves = (0..traces.names.len()).filter(|&i| !flat.contains(&traces.names[i].as_str()));
    moves.take(ERRORS).map(of).collect()
}

/// Sentence on the unknowns whose errors are not drawn; `None` without any.
pub(super) fn not_drawn(flat: &[&str]) -> Option<DocumentBlock> {
    let names = flat.join(", ");
    let text = format!("Not drawn, not excited and known from the prior only: {names}.");
    (!flat.is_empty()).then_some(DocumentBlock::Text(text))
}

pub(super) fn slopes(c: &CrossCheck, id: &str) -> Vec<DocumentBlock> {
    let mut units: Vec<&str> = c.slopes.iter().map(|s| s.unit.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    let of = |(i, unit): (usize, &&str)| {
        let curves_: Vec<&SlopeCurve> = c.slopes.iter().filter(|s| s.unit == *unit).collect();
        let caption = format!(
            "Sigma against the dwell for unknowns in {unit}, with reference slopes -(accuracy order + 1/2)"
        );
        curves(&format!("{id}_slopes_{}", i + 1), caption, slope_figure(&curves_, unit, 0))
    };
    units.iter().enumerate().map(of).collect()
}

pub(super) fn consistency(c: &CrossCheck, id: &str) -> Vec<DocumentBlock> {
    let outputs = c.monte_carlo.statistics.last().map_or(2, |s| s.expected as usize);
    let (n, runs) = (c.correlation.names.len(), c.monte_carlo.runs);
    let mut out = Vec::new();
    if c.monte_carlo.statistics.len() > 1 {
        let figure = history_figure(c, "NEES", n, |p| p.nees, |_| runs);
        out.push(curves(
            &format!("{id}_nees"),
            "Normalised estimation error squared, mean of all runs, with its band",
            figure,
        ));
    }
    let figure = history_figure(c, "NIS", outputs, |p| p.nis, |p| p.samples);
    out.push(curves(
        &format!("{id}_nis"),
        "Normalised innovation squared, mean of all runs, with its band",
        figure,
    ));
    out
}

pub(super) fn correlation(c: &CrossCheck, name: &str) -> DocumentBlock {
    let names = &c.correlation.names;
    let svg = heat("Correlation under a diffuse prior", names, names, c.correlation.values.clone(), -1.0);
    map(
        name,
        "Correlation of the estimates under a diffuse prior: +-1 (orange, blue) along directions that Z does not see",
        svg,
    )
}

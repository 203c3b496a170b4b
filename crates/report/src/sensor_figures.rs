//! Figures of sets of outputs: the front, and the degrees with each candidate.

use obsdeg_design::sensors::{SensorCandidate, SensorUnknown, Sensors};

use crate::ReportError;
use crate::cells::{CellColumn, Cells};
use crate::figure::{BLUE, Curve, Figure, NamedPoint, Stroke};
use crate::figures::{File, picture};
use crate::sensors::{about, has_costs, set};

/// Largest number of characters of a set at its point.
const LONGEST: usize = 44;

/// The figures of sets of outputs, each as SVG and PNG: `front`, number of outputs or cost against the
/// largest degree (left out without a set), and `degrees`, the degree of each unknown with each candidate.
///
/// # Errors
/// [`ReportError`] when a figure cannot be drawn.
pub fn sensor_figures(s: &Sensors) -> Result<Vec<File>, ReportError> {
    let mut files = Vec::new();
    if !s.front.is_empty() {
        files.extend(picture("front", front(s).svg())?);
    }
    files.extend(picture("degrees", degrees(s))?);
    Ok(files)
}

/// Set of a point; of a long one the first outputs.
fn name(outputs: &[String]) -> String {
    let whole = set(outputs);
    if whole.chars().count() <= LONGEST {
        return whole;
    }
    let fits = |k: &usize| set(&outputs[..*k]).chars().count() + 10 <= LONGEST;
    match (1..outputs.len()).rev().find(fits) {
        Some(k) => format!("{} and {} more", set(&outputs[..k]), outputs.len() - k),
        None => format!("{} outputs", outputs.len()),
    }
}

/// Front as steps: a set with a degree also has every larger one.
fn front(s: &Sensors) -> Figure {
    let at: Vec<(f64, f64)> = s.front.iter().map(|f| (f.degree as f64, f.cost)).collect();
    let costs = has_costs(s);
    let end = |of: fn(&(f64, f64)) -> f64| at.iter().map(of).fold(0.0, f64::max);
    let (right, top) = (end(|p| p.0), end(|p| p.1));
    // names are at the right of their points
    let last = (1.25 * right).max(right + 1.0).ceil();
    let mut steps = vec![(last, at[0].1)];
    for (i, p) in at.iter().enumerate() {
        steps.push(*p);
        steps.extend(at.get(i + 1).map(|next| (p.0, next.1)));
    }
    Figure {
        title: format!("Cheapest sets of outputs for {}", about(s)),
        x_label: "largest degree [derivatives of the outputs]".into(),
        y_label: format!(
            "{} {}outputs{}",
            if costs { "cost of the" } else { "number of" },
            if s.own_outputs.is_empty() { "" } else { "further " },
            if s.candidates.iter().any(|c| c.experiment) { " and the experiment" } else { "" }
        ),
        lines: vec![Curve { label: String::new(), color: BLUE, stroke: Stroke::Solid, points: steps }],
        points: s.front.iter().zip(&at).map(|(f, &at)| NamedPoint { name: name(&f.outputs), at }).collect(),
        x_range: Some((0.0, last)),
        y_range: Some((0.0, if costs { 1.15 * top } else { top + 1.0 })),
        orders: !costs,
        ..Figure::default()
    }
}

/// Degrees of the unknowns with each candidate, beside those with none and with all.
fn degrees(s: &Sensors) -> String {
    let of = |f: fn(&SensorUnknown) -> Option<usize>| -> Vec<Option<usize>> {
        s.quantities.iter().map(f).collect()
    };
    let (own, all) = (of(|q| q.own_degree), of(|q| q.least_degree));
    let beside = !s.own_outputs.is_empty();
    let mut columns = Vec::new();
    // a search that ended early may have judged neither the model nor a candidate
    let judged: Vec<&SensorCandidate> = s.candidates.iter().filter(|c| !c.degrees.is_empty()).collect();
    if beside && !judged.is_empty() {
        columns.push(CellColumn { name: "none", degrees: &own, is_apart: false });
    }
    columns.extend(judged.iter().enumerate().map(|(i, c)| CellColumn {
        name: &c.name,
        degrees: &c.degrees,
        is_apart: beside && i == 0,
    }));
    columns.push(CellColumn { name: "all", degrees: &all, is_apart: true });
    let case = match beside {
        true => format!("with one more output beside {}", s.own_outputs.join(", ")),
        false => "with a single output in place of those of the model".into(),
    };
    Cells {
        title: vec!["Degree of each unknown by candidate".into(), case],
        rows: s.quantities.iter().map(|q| q.name.as_str()).collect(),
        row_label: "unknown",
        columns,
        column_label: "measured candidate".into(),
        note: String::new(),
    }
    .svg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_sets_are_shortened() {
        let outputs: Vec<String> = (1..=12).map(|k| format!("concentration_{k}")).collect();
        assert_eq!(name(&outputs[..2]), "concentration_1, concentration_2");
        assert_eq!(name(&outputs), "concentration_1, concentration_2 and 10 more");
        assert_eq!(name(&["x".repeat(50), "y".into()]), "2 outputs");
    }
}

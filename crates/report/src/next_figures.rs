//! Figures of a next position: attitudes on a globe, and the degrees with each candidate.

use obsdeg_core::model::{Matrix3, c_n_f64, parse_attitude};
use obsdeg_design::next::{CandidateGain, NextPositions};

use crate::cells::{CellColumn, Cells};
use crate::figure::shade;
use crate::figures::{File, picture};
use crate::globe::{Globe, ScaleStep, Spot};
use crate::{ReportError, stated};

/// Largest number of candidates of a table of degrees.
const MOST_COLUMNS: usize = 48;
/// Number of colours of a continuous scale.
const STEPS: usize = 40;

/// The figures of a next position, each as SVG and PNG: `attitudes`, a map of what every candidate gives, and
/// `degrees`, the degree of each coefficient with each candidate (of at most 48 candidates). No figure where
/// two positions are added.
///
/// # Errors
/// [`ReportError`] when a figure cannot be drawn.
pub fn next_figures(n: &NextPositions) -> Result<Vec<File>, ReportError> {
    if n.by_candidate.is_empty() {
        return Ok(Vec::new());
    }
    let mut files: Vec<File> = picture("attitudes", attitudes(n).svg())?.into();
    if n.by_candidate.len() <= MOST_COLUMNS {
        files.extend(picture("degrees", degrees(n))?);
    }
    Ok(files)
}

/// Attitude of angles as text; `None` for angles by name.
fn attitude(angles: &str) -> Option<Matrix3<f64>> {
    Some(c_n_f64(&parse_attitude(angles).ok()?))
}

/// Quantity that colours the map.
enum MapQuantity {
    /// Number of undetermined coefficients.
    Undetermined,
    /// Largest ratio of uncertainty to requirement.
    Ratio,
    /// Largest uncertainty of a coefficient.
    Sigma,
}

impl MapQuantity {
    /// Verdicts if they differ; uncertainty otherwise.
    fn of(n: &NextPositions) -> Self {
        let open = |c: &CandidateGain| c.not_observable;
        let first = n.by_candidate.first().map(open);
        if n.by_candidate.iter().any(|c| Some(open(c)) != first) {
            return Self::Undetermined;
        }
        match n.by_candidate.iter().any(|c| c.ratio.is_some()) {
            true => Self::Ratio,
            false => Self::Sigma,
        }
    }

    fn value(&self, c: &CandidateGain) -> Option<f64> {
        match self {
            Self::Undetermined => Some(c.not_observable as f64),
            Self::Ratio => c.ratio,
            Self::Sigma => c.worst.as_ref().map(|w| w.sigma_dph),
        }
    }

    /// Value as text in a wedge.
    fn word(&self, c: &CandidateGain) -> String {
        match (self, self.value(c)) {
            (Self::Undetermined, _) => c.not_observable.to_string(),
            (_, Some(value)) => short(value),
            (_, None) => "-".into(),
        }
    }

    fn label(&self, n: &NextPositions) -> String {
        let requirements = n.found.first().map(|e| &e.then.requirements);
        let total = requirements.map_or("worst sigma", stated::worst);
        match self {
            Self::Undetermined => format!("undetermined of {}", n.required.len()),
            Self::Ratio => format!("{total} / requirement"),
            Self::Sigma => format!("{total} [deg/h, per g]"),
        }
    }
}

/// Number with two significant digits.
fn short(x: f64) -> String {
    let exponent = format!("{:.1e}", x.abs()).split_once('e').and_then(|(_, e)| e.parse::<i32>().ok());
    match exponent {
        Some(e @ -3..=2) => format!("{x:.*}", (1 - e).max(0) as usize),
        _ => format!("{x:.1e}"),
    }
}

/// Place of a value on a scale from the best (1, dark) to the worst (0, light).
struct Scale {
    low: f64,
    high: f64,
    is_log: bool,
}

impl Scale {
    fn of(criterion: &MapQuantity, all: &[CandidateGain]) -> Self {
        let values = all.iter().filter_map(|c| criterion.value(c));
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        Self { low, high, is_log: !matches!(criterion, MapQuantity::Undetermined) && low > 0.0 }
    }

    fn place(&self, x: f64) -> f64 {
        let on = |x: f64| if self.is_log { x.ln() } else { x };
        let span = on(self.high) - on(self.low);
        // equal values are all the best
        if span > 1e-9 { 1.0 - (on(x) - on(self.low)) / span } else { 1.0 }
    }

    /// Value at a share of the scale, from the lowest.
    fn at(&self, share: f64) -> f64 {
        match self.is_log {
            true => self.low * (self.high / self.low).powf(share),
            false => self.low + (self.high - self.low) * share,
        }
    }

    fn steps(&self, criterion: &MapQuantity) -> Vec<ScaleStep> {
        if self.low > self.high {
            return Vec::new();
        }
        if matches!(criterion, MapQuantity::Undetermined) {
            let whole = self.low as usize..=self.high as usize;
            let step = |k: usize| ScaleStep { color: shade(self.place(k as f64)), label: k.to_string() };
            return whole.map(step).collect();
        }
        if self.high <= self.low * (1.0 + 1e-6) {
            return vec![ScaleStep { color: shade(1.0), label: short(self.low) }];
        }
        let step = |k: usize| ScaleStep {
            color: shade(1.0 - k as f64 / (STEPS - 1) as f64),
            label: match k {
                0 => short(self.low),
                k if k == STEPS / 2 => short(self.at(0.5)),
                k if k + 1 == STEPS => short(self.high),
                _ => String::new(),
            },
        };
        (0..STEPS).map(step).collect()
    }
}

/// Title of both figures: what is added to what.
fn subject(n: &NextPositions) -> String {
    match (n.after_calibration, n.positions.len()) {
        (true, _) => format!("one position after a calibration, {} carry", n.carry),
        (false, 0) => format!("a single position, {} carry", n.carry),
        (false, k) => format!("one more position after {k}, {} carry", n.carry),
    }
}

fn attitudes(n: &NextPositions) -> Globe {
    let criterion = MapQuantity::of(n);
    let scale = Scale::of(&criterion, &n.by_candidate);
    let best = n.found.first().and_then(|e| e.positions.first()).map(|p| &p.candidate);
    let spot = |c: &CandidateGain| {
        let color = criterion.value(c).map_or([255; 3], |x| shade(scale.place(x)));
        let (name, value) = (c.candidate.clone(), criterion.word(c));
        Some(Spot { name, value, attitude: attitude(&c.angles)?, color, is_best: Some(&c.candidate) == best })
    };
    let positions = n.positions.iter().zip(&n.position_angles);
    let before = n.before.as_ref().map(|b| match criterion {
        MapQuantity::Undetermined => b.not_observable.len().to_string(),
        MapQuantity::Ratio => {
            let worst = b.requirements.worst.as_ref();
            worst.map_or_else(|| "-".into(), |w| format!("{} ({})", short(1.0 / w.margin), w.name))
        }
        MapQuantity::Sigma => b.worst.as_ref().map_or_else(|| "-".into(), stated::worst_sigma),
    });
    let mut notes = vec![
        "Point: direction of Up in the platform's axes. Wedge: opens towards North, as seen from the platform."
            .into(),
        "Amber border: the best, by verdicts, then degrees, then uncertainty.".into(),
    ];
    if !n.positions.is_empty() {
        notes.push("Black: positions of the scheme, each with a tick towards North.".into());
    }
    let missing = n.candidates.len() - n.by_candidate.len();
    if missing > 0 {
        let or = if n.interrupted { ", or not compared before the interruption" } else { "" };
        notes.push(format!("Not drawn: {missing} candidates beyond the limits of time{or}."));
    }
    Globe {
        title: [format!("What {} gives", subject(n))]
            .into_iter()
            .chain(before.map(|b| format!("{}; without a further position: {b}", criterion.label(n))))
            .collect(),
        spots: n.by_candidate.iter().filter_map(spot).collect(),
        positions: positions.filter_map(|(name, a)| Some((name.clone(), attitude(a)?))).collect(),
        scale: (criterion.label(n), scale.steps(&criterion)),
        notes,
    }
}

/// Degrees of the coefficients with each candidate, best first, beside those without it.
fn degrees(n: &NextPositions) -> String {
    let mut columns = Vec::new();
    if !n.degrees_before.is_empty() {
        columns.push(CellColumn { name: "nothing", degrees: &n.degrees_before, is_apart: false });
    }
    let before = !columns.is_empty();
    let open = |c: &CandidateGain| c.degrees.iter().filter(|d| d.is_none()).count();
    let more = n.by_candidate.iter().any(|c| c.not_observable < open(c));
    let note = match (more, n.after_calibration) {
        (false, _) => "",
        (true, true) => "Degrees by the added position alone, without the calibration.",
        (true, false) => "Degrees by the positions: neither samples during slews nor prior knowledge count.",
    };
    columns.extend(n.by_candidate.iter().enumerate().map(|(i, c)| CellColumn {
        name: &c.candidate,
        degrees: &c.degrees,
        is_apart: before && i == 0,
    }));
    Cells {
        title: vec!["Degree of each coefficient by candidate".into(), subject(n)],
        rows: n.required.iter().map(String::as_str).collect(),
        row_label: "coefficient",
        columns,
        column_label: "added position (X_p Y_p Z_p), best first".into(),
        note: note.into(),
    }
    .svg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_digits() {
        let texts = [0.012_34, 0.1, 0.0999, 1.26, 12.6, 345.0, 4567.0, 0.000_12].map(short);
        assert_eq!(texts, ["0.012", "0.10", "0.10", "1.3", "13", "345", "4.6e3", "1.2e-4"]);
    }

    /// The best value is dark, the worst light; equal values are all dark.
    #[test]
    fn a_scale_goes_from_the_best_to_the_worst() {
        let scale = Scale { low: 0.1, high: 10.0, is_log: true };
        assert!((scale.place(1.0) - 0.5).abs() < 1e-12 && (scale.at(0.5) - 1.0).abs() < 1e-12);
        assert_eq!([scale.place(0.1), scale.place(10.0)], [1.0, 0.0]);
        let steps = scale.steps(&MapQuantity::Sigma);
        let labels: Vec<&str> = steps.iter().map(|s| s.label.as_str()).filter(|l| !l.is_empty()).collect();
        assert_eq!(labels, ["0.10", "1.0", "10"]);
        let equal = Scale { low: 2.0, high: 2.0, is_log: true };
        assert_eq!((equal.place(2.0), equal.steps(&MapQuantity::Sigma).len()), (1.0, 1));
    }
}

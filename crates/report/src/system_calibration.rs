//! A calibration of any system.

use obsdeg_calibration::system::TriedStarts;
use obsdeg_calibration::system::{
    OtherSolution, OtherStarts, OutputFit, Profile, StatesStart, SystemCalibration, SystemEstimated,
    SystemFinding,
};

use crate::calibration::{COEFFICIENTS, with_coefficients};
use crate::document::{Document, DocumentBlock, estimate, left, number, optional, right};
use crate::figure::{BLACK, BLUE, Band, FigureError, SKY, Stroke, grid};
use crate::figures::{File, line, picture};
use crate::{Answer, ReportError, Table, words};

/// Largest number of listed items.
const LISTED: usize = 20;

fn finding(f: &SystemFinding) -> String {
    match f {
        SystemFinding::Interrupted => {
            "interrupted: the estimates are where the best iteration was then, from the starts that were \
             tried so far"
                .into()
        }
        SystemFinding::NotSettled => {
            "no start settled: the estimates are where the iteration was given up".into()
        }
        SystemFinding::Noise { chi_square, factor } if *factor >= 1.0 => {
            format!(
                "chi-square is {} per degree of freedom: sigmas are {factor:.2} times too small, or the \
                 model leaves something out",
                number(*chi_square)
            )
        }
        SystemFinding::Noise { chi_square, factor } => format!(
            "chi-square is {} per degree of freedom: sigmas are {:.2} times too large",
            number(*chi_square),
            1.0 / factor
        ),
        SystemFinding::Correlated { output, probability } => format!(
            "the residuals of {output} are not independent of each other (probability {}): the model leaves \
             something out, or sigmas are too small",
            number(*probability)
        ),
        SystemFinding::Outlier { output, line, sigmas } => {
            format!(
                "{output} at line {line} is {sigmas:+.1} sigma from what all others say (it was not left out)"
            )
        }
    }
}

fn row(e: &SystemEstimated) -> Vec<String> {
    let verdict = match (e.determined, e.status, e.degree) {
        (true, ..) => "estimated".into(),
        (false, _, Some(_)) => "observable by the model, not determined by these data".into(),
        (false, Some(status), None) => status.to_string(),
        (false, None, None) => "-".into(),
    };
    vec![
        e.name.clone(),
        e.unit.clone(),
        words::degree(e.degree),
        estimate(e.estimate, e.sigma),
        optional(e.sigma),
        optional(e.sigma_rescaled),
        verdict,
    ]
}

/// Sentence on the starts that did not lead to the solution; `None` if all did.
fn other_starts(of: &OtherStarts) -> Option<String> {
    let mut out = Vec::new();
    let mut say = |count: usize, what: String| {
        if count > 0 {
            out.push(format!("{count} {what}"));
        }
    };
    say(of.near, "led to other solutions that fit nearly as well".into());
    let least = of.least_higher_chi_square.map_or_else(String::new, |c| format!(" ({} or more)", number(c)));
    say(of.higher, format!("ended at minima with a larger chi-square{least}"));
    say(of.unsettled, "did not settle".into());
    say(of.failed, "gave no numbers: the model cannot be followed from there".into());
    (!out.is_empty()).then(|| format!("of the other starts, {}", out.join("; ")))
}

/// First lines: consistency and the first findings.
fn lead(c: &SystemCalibration) -> Vec<String> {
    let mut lead = vec![match (c.consistent, c.findings.is_empty()) {
        (Some(true), _) => "consistent: the model and its noise explain the data".to_string(),
        (Some(false), _) => "NOT consistent: sigmas are not to be relied upon as they are".into(),
        (None, _) => {
            "no noise was given: it is estimated from what is left, so chi-square says nothing of the model"
                .into()
        }
    }];
    lead.extend(c.findings.iter().take(LISTED).map(finding));
    if c.findings.len() > LISTED {
        lead.push(format!("and {} findings more", c.findings.len() - LISTED));
    }
    lead
}

/// Tables of the estimates of unknowns and of combinations.
fn estimates(c: &SystemCalibration) -> Vec<DocumentBlock> {
    let columns = [
        left("unknown"),
        left("unit"),
        right("degree"),
        right("estimate"),
        right("sigma"),
        right("rescaled"),
        left("status"),
    ];
    let mut blocks = vec![DocumentBlock::table(
        "Estimates (degree: exact verdict; states: at the start)",
        columns.clone(),
        c.quantities.iter().map(row),
    )];
    if !c.combinations.is_empty() {
        blocks.push(DocumentBlock::table(
            "Combinations of what is not told apart, and those asked for",
            columns,
            c.combinations.iter().map(row),
        ));
    }
    blocks
}

/// Sentences on chi-square and on the starts of the iteration.
fn fit(c: &SystemCalibration) -> Vec<String> {
    let per = c.factor * c.factor;
    let mut out = vec![format!(
        "chi-square {} on {} degrees of freedom: {} each (band of 99.9 % {:.4} to {:.4})",
        number(c.chi_square),
        c.degrees_of_freedom,
        number(per),
        c.band.from,
        c.band.to
    )];
    if c.starts.tried < c.starts_at_most {
        out.push(format!(
            "{} of {} starts were made: no other solution was to be expected by then (Boender and \
             Rinnooy Kan 1987)",
            c.starts.tried, c.starts_at_most
        ));
    }
    out.push(match c.starts {
        TriedStarts { tried, led } if c.others.is_empty() => {
            format!(
                "{led} of {tried} starts led to this solution; no other that fits nearly as well was found"
            )
        }
        TriedStarts { tried, led } => {
            format!("{led} of {tried} starts led to this solution; OTHERS fit nearly as well, see below")
        }
    });
    out.extend(other_starts(&c.other_starts));
    out
}

/// Table of the outputs: noise, residuals and outliers.
fn outputs(c: &SystemCalibration) -> DocumentBlock {
    let columns = [
        left("output"),
        right("measured"),
        right("sigma"),
        left("from"),
        right("chi-square"),
        right("rms left"),
        right("expected"),
        right("whiteness"),
        right("outlier beyond"),
    ];
    let rows = c.outputs.iter().map(|o| {
        vec![
            o.output.clone(),
            o.measurements.to_string(),
            o.sigma.map_or_else(|| "by row".into(), number),
            if o.estimated { "what is left" } else { "given" }.into(),
            number(o.chi_square),
            number(o.rms),
            number(o.expected_rms),
            optional(o.whiteness_probability),
            o.outlier_gate.map_or_else(|| "too few to tell".into(), number),
        ]
    });
    DocumentBlock::table(
        "Outputs (root mean squares of what is left, and of what sigmas let expect; outlier: in sigma as \
         all others have it)",
        columns,
        rows,
    )
}

/// Other solutions that fit nearly as well; `None` without any.
fn other_solutions(c: &SystemCalibration) -> Option<DocumentBlock> {
    let names: Vec<&str> = c.quantities.iter().map(|u| u.name.as_str()).collect();
    let of = |o: &OtherSolution| {
        let values: Vec<String> =
            names.iter().zip(&o.values).map(|(n, v)| format!("{n} = {}", number(*v))).collect();
        format!("chi-square {} from {} starts: {}", number(o.chi_square), o.starts, values.join(", "))
    };
    DocumentBlock::list_if_any("Other solutions", c.others.iter().map(of).collect())
}

/// Table of chi-square along one unknown.
fn profile(p: &Profile) -> DocumentBlock {
    let flat = if p.flat { ": FLAT, the data say nothing of it" } else { "" };
    DocumentBlock::table(
        format!("Profile of {}{flat}", p.name),
        [right("value"), right("chi-square more")],
        p.points.iter().map(|p| vec![number(p.value), number(p.rise)]),
    )
}

/// Sentences on what was read from the record.
fn read(c: &SystemCalibration) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    out.extend(c.intervals.map(|n| {
        format!(
            "{} samples; {n} intervals at rest were found, a mean of each is measured, with the noise of \
             its samples",
            c.samples
        )
    }));
    let t = c.begins.unwrap_or(0.0);
    let starts = match (c.states_start, c.before_first_row) {
        (StatesStart::FarRows, _) => {
            format!("with the first row of a run (at t = {t}), since the record begins long after 0")
        }
        (StatesStart::Rows, _) => format!("with the first row of a run (at t = {t}), as `time` asks for"),
        (StatesStart::Model, None) => format!("at t = {t}"),
        (StatesStart::Model, Some(before)) => {
            format!("at t = {t}, {before} before the first row (`time` in the file sets where a run begins)")
        }
    };
    out.push(format!(
        "{} rows; inputs that are columns are held from a row to the next; states start {starts}; {} \
         times the usual steps of integration; seed {}",
        c.rows, c.substeps, c.seed
    ));
    if !c.ignored.is_empty() {
        out.push(format!("nothing was made of the columns {}", c.ignored.join(", ")));
    }
    if c.shared {
        out.push(
            "the calibration before rests on the same record, by another model: what both models take of \
             it counts twice"
                .into(),
        );
    }
    out
}

impl Answer for SystemCalibration {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let mut blocks = estimates(self);
        blocks.push(DocumentBlock::list("Fit", fit(self)));
        blocks.push(outputs(self));
        blocks.extend(other_solutions(self));
        blocks.extend(self.profiles.iter().map(profile));
        blocks.push(DocumentBlock::list("Read", read(self)));
        Document { title: format!("Calibration: {}", self.name), lead: lead(self), blocks }
    }

    /// Lists of the JSON, then coefficients and covariance of all estimates.
    fn tables(&self) -> Result<Vec<Table>, serde_json::Error> {
        Ok(with_coefficients(crate::tables::of_json(&serde_json::to_value(self)?), &self.covariance))
    }

    /// Table of unknowns and combinations.
    fn main_table(&self) -> &'static str {
        COEFFICIENTS
    }
}

/// Residuals of all measurements as CSV.
///
/// # Errors
/// [`ReportError::Csv`].
pub fn system_residuals_csv(c: &SystemCalibration) -> Result<String, ReportError> {
    let head = ["experiment", "output", "line", "t", "measured", "residual", "sigma", "left out, in sigma"];
    let rows = c.residuals.iter().map(|r| {
        let numbers = [r.t, r.measured, r.residual, r.sigma, r.normalised].map(|x| x.to_string());
        let first = [(r.experiment + 1).to_string(), c.outputs[r.output].output.clone(), r.line.to_string()];
        first.into_iter().chain(numbers).collect()
    });
    crate::csv_text::write(std::iter::once(head.map(String::from).to_vec()).chain(rows))
}

/// The residuals of every output over time, with bands of three sigma.
///
/// # Errors
/// [`FigureError`].
pub fn system_calibration_figures(c: &SystemCalibration) -> Result<Vec<File>, FigureError> {
    let figure = |(k, o): (usize, &OutputFit)| {
        let mut some: Vec<_> = c.residuals.iter().filter(|r| r.output == k).collect();
        some.sort_by(|a, b| a.t.total_cmp(&b.t));
        let points: Vec<(f64, f64)> = some.iter().map(|r| (r.t, r.residual)).collect();
        let (first, last) = (points.first().map_or(0.0, |p| p.0), points.last().map_or(1.0, |p| p.0));
        let largest = some.iter().map(|r| r.residual.abs().max(3.0 * r.sigma)).fold(0.0, f64::max);
        let half = if largest > 0.0 { 1.15 * largest } else { 1.0 };
        crate::figure::Figure {
            title: format!("{}: measurement minus estimate", o.output),
            x_label: "t".into(),
            y_label: "residual".into(),
            bands: vec![Band {
                color: SKY,
                points: some.iter().map(|r| (r.t, -3.0 * r.sigma, 3.0 * r.sigma)).collect(),
            }],
            lines: vec![
                line("zero", BLACK, Stroke::Dotted, vec![(first, 0.0), (last, 0.0)]),
                line("residual, band of +-3 sigma", BLUE, Stroke::Solid, points),
            ],
            x_range: Some((first, last)),
            y_range: Some((-half, half)),
            ..crate::figure::Figure::default()
        }
    };
    let figures: Vec<_> = c.outputs.iter().enumerate().map(figure).collect();
    let title = format!("Residuals, {}", c.name);
    Ok(picture("residuals", grid(&figures, figures.len().min(2), &title))?.into())
}

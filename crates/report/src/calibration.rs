//! Documents, tables and CSV of a calibration from recorded data.

use obsdeg_calibration::Calibration;
use obsdeg_calibration::answer::HeldUnknown;
use obsdeg_calibration::answer::{
    Assumed, CovarianceTable, Curvature, Estimated, Gap, NextRun, PositionFit, PositionsBy, RecordReport,
};
use obsdeg_core::span::Span;

use crate::calibration_findings::{clock, finding};
use crate::document::{Document, DocumentBlock, estimate, left, number, optional, right};
use crate::{Answer, ReportError, Table, acceptance, omitted, stated, words};

/// Largest number of listed outliers.
const LISTED: usize = 20;

/// Sentence that the record leaves all unknowns open at its drifts, so that no estimate is given; `None` if
/// estimates are given. Nothing else is wrong with such a record.
fn left_open(c: &Calibration) -> Option<String> {
    if !c.quantities.iter().chain(&c.combinations).any(|e| e.left_open) {
        return None;
    }
    let who = match (c.assumed.priors.is_empty(), c.records.len() > 1) {
        (true, false) => "this record alone leaves",
        (true, true) => "these records alone leave",
        (false, false) => "this record and the stated priors leave",
        (false, true) => "these records and the stated priors leave",
    };
    let Curvature { kappa, samples, failed, .. } = c.curvature;
    let why = match kappa {
        Some(_) if failed > 0 => format!("of {samples} samples of the posterior {failed} is not found"),
        Some(k) => format!("the run differs from its linear model by {} sigma", number(k)),
        None => "other values fit nearly as well, or the run cannot be followed".into(),
    };
    Some(format!(
        "at these drifts {who} all unknowns open: over what the positions determine weakly or not at all, \
         {why}. No sigma describes the errors then, so no estimate is given. State priors of psi and of the \
         drifts as small as is true (`priors` under [simulation]), or add positions"
    ))
}

/// Factor of sigma from which the effect of unknowns that are left open is printed.
const CONSTRAINED: f64 = 1.05;

/// Verdict on an unknown: the source of its estimate, or the reason why there is none.
fn verdict(e: &Estimated) -> String {
    let bent = e.open_sigma.filter(|_| e.determined && e.constrained_factor.is_some_and(|f| f > CONSTRAINED));
    match (e.determined, e.degree) {
        (true, _) if e.from_prior => "estimated from a stated prior and the record".into(),
        (true, _) if bent.is_some() => {
            format!("estimated; +-{} {} by what is left open", number(bent.unwrap_or(0.0)), e.unit)
        }
        (true, Some(_)) => "estimated".into(),
        (true, None) => "estimated; not by derivatives alone".into(),
        (false, _) if e.left_open => "left open at these drifts".into(),
        (false, Some(_)) => "observable by the scheme, not determined by these records".into(),
        (false, None) => e.status.to_string(),
    }
}

fn row(e: &Estimated, totals: bool) -> Vec<String> {
    let influence =
        e.prior_shift.zip(e.prior_factor).filter(|(s, f)| s.abs() >= 0.005 || (f - 1.0).abs() >= 0.005);
    let mut out = vec![
        e.name.clone(),
        e.unit.clone(),
        words::degree(e.degree),
        estimate(e.estimate, e.sigma),
        optional(e.sigma),
        optional(e.sigma_rescaled),
    ];
    out.extend(totals.then(|| optional(e.total)));
    out.extend([
        optional(e.predicted_sigma),
        match (influence, e.determined) {
            (Some((shift, factor)), _) => format!("{shift:+.2}, x{factor:.2}"),
            (None, true) => "none".into(),
            (None, false) => "-".into(),
        },
        verdict(e),
    ]);
    out
}

/// Index of the specific force among the columns of a position.
const FORCE: usize = 4;

fn position(p: &PositionFit, record: Option<usize>, force: bool) -> Vec<String> {
    let mut out = vec![
        format!("{}{}", p.position, record.map_or_else(String::new, |r| format!(" (record {})", r + 1))),
        format!("{:.1}", p.start_s),
        format!("{:.1}", p.end_s),
        p.measurements.to_string(),
        p.force_g.map_or_else(|| "-".into(), |f| format!("{f:.6}")),
        number(p.chi_square),
        p.moves.as_ref().map_or_else(|| "-".into(), |m| format!("{} by {:+.1} sigma", m.name, m.sigmas)),
        if p.loses.is_empty() { "-".into() } else { p.loses.join(", ") },
    ];
    if !force {
        out.remove(FORCE);
    }
    out
}

/// Largest number of listed gaps.
const GAPS: usize = 5;

/// The longest gaps between rows, in the order of time; `None` without gaps.
pub(crate) fn gaps(of: &[Gap]) -> Option<String> {
    let mut all: Vec<&Gap> = of.iter().collect();
    let length = |g: &Gap| g.to_s - g.from_s;
    all.sort_by(|a, b| length(b).total_cmp(&length(a)));
    let more = match all.len().saturating_sub(GAPS) {
        0 => String::new(),
        n => format!(", and {n} shorter gaps"),
    };
    all.truncate(GAPS);
    all.sort_by_key(|g| g.line);
    let each: Vec<String> = all
        .iter()
        .map(|g| {
            format!(
                "{} s from {} s on ({}, before line {})",
                tenths(length(g)),
                tenths(g.from_s),
                g.place,
                g.line
            )
        })
        .collect();
    (!each.is_empty()).then(|| format!("rows are missing for {}{more}", each.join(", ")))
}

/// Source of the times at which positions begin and end.
pub(crate) fn by_what(by: PositionsBy) -> &'static str {
    match by {
        PositionsBy::Labels => {
            "the column `position`: one ends behind its last sample, the next begins when the slew is over"
        }
        PositionsBy::Timeline => "the timeline of the scheme",
        PositionsBy::Both => {
            "the column `position`, which agrees with the timeline of the scheme: that says when they begin and end"
        }
        PositionsBy::Static => {
            "intervals at rest that were found, as many as the scheme has: a turn is in the middle of what \
             is between two"
        }
    }
}

/// Sentence on each record: its rows, times and positions.
fn records(c: &Calibration) -> Vec<String> {
    let of = |r: &RecordReport| {
        let mut out = format!(
            "{}: {} samples from {} to {} s, taken together in {} bins; positions by {}",
            r.name,
            r.samples,
            tenths(r.span_s.from),
            tenths(r.span_s.to),
            r.bins,
            by_what(r.positions_by)
        );
        if let Some(open) = r.change_open_s {
            out += &format!(
                "; the rows leave the time of a change open within {} s, which is part of the sigmas",
                number(open)
            );
        }
        out += &gaps(&r.gaps).map_or_else(String::new, |gaps| format!("; {gaps}"));
        let empty: Vec<String> =
            r.empty_cells.iter().map(|e| format!("{} of `{}`", e.count, e.column)).collect();
        if !empty.is_empty() {
            out += &format!("; empty cells that were skipped: {}", empty.join(", "));
        }
        if r.waiting > 0 {
            out += &format!("; {} samples of waits for rest (settle) were left out", r.waiting);
        }
        if r.unused > 0 {
            out += &format!("; {} samples at no position were not used", r.unused);
        }
        if let Some(f) = r.force_g {
            out += &format!("; the specific force is {f:.6} g long on average");
        }
        if let Some(off) = r.gimbals_deg {
            out += &format!("; the gimbals are within {} deg of the scheme", number(off));
        }
        out += &clock(&r.clock);
        if !r.ignored.is_empty() {
            out += &format!("; nothing was made of the columns {}", r.ignored.join(", "));
        }
        out
    };
    c.records.iter().map(of).collect()
}

/// Assumptions of a calibration, one sentence each.
pub(crate) fn assumed(c: &Calibration) -> Vec<String> {
    let a = &c.assumed;
    let mut out = vec![
        format!(
            "latitude {} deg{}",
            a.latitude_deg,
            if a.latitude_by_default { " (chosen here: the scheme names none)" } else { "" }
        ),
        match a.noise_estimated {
            true => format!(
                "noise of a sample estimated from the residuals (first taken as {:e} g)",
                a.accelerometer_noise_g
            ),
            false => format!(
                "noise of a sample {:e} g, white, per axis; sigmas given in a record are taken as they are",
                a.accelerometer_noise_g
            ),
        },
        format!("white drift {} deg/sqrt(h)", number(a.drift_noise_deg_sqrt_h)),
        format!("samples within {} s are one measurement: the value of a line at their middle", a.bin_s),
        format!("one g is {} m/s^2", a.gravity_m_s2),
        format!("psi is that of {}; full attitudes; seed {}", moment(&c.records), a.seed),
    ];
    if !a.known.is_empty() {
        out.push(format!("known from a calibration before: {}", a.known.join(", ")));
        if !a.known_differs.is_empty() {
            out.push(format!(
                "that calibration has {}: its estimates hold what other terms would explain",
                a.known_differs.join(", ")
            ));
        }
    }
    out
}

/// Time at which the estimated psi holds.
fn moment(records: &[RecordReport]) -> String {
    let by_rows = |r: &RecordReport| matches!(r.positions_by, PositionsBy::Labels | PositionsBy::Static);
    let start = "the start of the scheme's first position";
    let first = "the first row at the first position";
    match (records.iter().any(by_rows), records.iter().all(by_rows)) {
        (false, _) => start.into(),
        (true, true) => first.into(),
        _ => format!("{start} ({first} where rows alone say when positions begin)"),
    }
}

/// Further runs for requirements that are missed; one sentence for all that the bench alone uses up.
fn next_runs(all: &[NextRun]) -> Vec<String> {
    let (used_up, open): (Vec<&NextRun>, Vec<&NextRun>) = all.iter().partition(|n| n.required_sigma == 0.0);
    let mut out: Vec<String> = open.into_iter().map(next_run).collect();
    if !used_up.is_empty() {
        out.push(format!(
            "{}: the bench alone uses up the requirement, so no run can meet it. Estimate the errors of the bench \
             too, or make them smaller.",
            words::names(used_up.iter().map(|n| n.unknown.as_str()))
        ));
    }
    out
}

/// A further run for a requirement that is missed.
fn next_run(n: &NextRun) -> String {
    let now = n.sigma.map_or_else(
        || format!("{} is not determined", n.unknown),
        |s| format!("sigma of {} is {} {}", n.unknown, number(s), n.unit),
    );
    let required = format!("{now}, required {} {}", number(n.required_sigma), n.unit);
    let (Some(attitude), Some(dwell), Some(then)) = (&n.attitude, n.dwell_s, n.sigma_then) else {
        return format!(
            "{required}: no run at one attitude makes it smaller by 1 %. Add positions or reduce the noise."
        );
    };
    let then = format!("{} {}", number(then), n.unit);
    if n.met {
        format!(
            "{required}: a run of {dwell} s at {attitude} with rows as often as here, calibrated with this answer \
             (--prior), makes it {then}."
        )
    } else {
        format!(
            "{required}: even a run of {dwell} s at {attitude} with rows as often as here, calibrated with this \
             answer (--prior), makes it {then} only."
        )
    }
}

/// Mode of the estimates: data alone or with stated priors, the unknowns that are left open and their effect,
/// the curvature.
fn mode(c: &Calibration) -> Vec<String> {
    let listed = |of: &[HeldUnknown]| {
        of.iter().map(|h| format!("{} {} {}", h.name, number(h.sigma), h.unit)).collect::<Vec<_>>().join(", ")
    };
    let what = if c.curvature.from_samples { "means" } else { "the most probable values" };
    let mut out = vec![if c.assumed.priors.is_empty() {
        "Data alone: no prior is stated, so none is in an estimate that the record determines.".to_string()
    } else {
        format!(
            "Priors as stated: estimates are {what} by the record and these priors (1 sigma): {}.",
            listed(&c.assumed.priors)
        )
    }];
    if !c.assumed.constrained.is_empty() {
        out.push(format!(
            "Left open: {} (box of 1 sigma about the first estimate; a truth of k boxes bends up to k^2 \
             times as much into the others).",
            listed(&c.assumed.constrained)
        ));
        let shows = |e: &&Estimated| e.determined && e.constrained_factor.is_some_and(|f| f > CONSTRAINED);
        let all: Vec<String> = c
            .quantities
            .iter()
            .chain(&c.combinations)
            .filter(shows)
            .map(|e| format!("{} +-{} {}", e.name, number(e.open_sigma.unwrap_or(0.0)), e.unit))
            .collect();
        out.push(if all.is_empty() {
            format!("What is left open adds at most {:.0} % to any sigma.", 100.0 * (CONSTRAINED - 1.0))
        } else {
            format!(
                "What is left open bends into these estimates (1 sigma, in their sigmas): {}. Smaller priors \
                 under [simulation] or more positions make it smaller.",
                all.join(", ")
            )
        });
    }
    out.push(match c.curvature.kappa {
        Some(k) if c.curvature.from_samples => format!(
            "Curvature {} sigma: estimates and sigmas are mean and covariance of {} samples of the posterior. \
             Each holds by itself; errors of several together are not normally distributed.",
            number(k),
            c.curvature.samples - c.curvature.failed
        ),
        Some(k) => format!("Curvature {} sigma (the linear covariance holds below 0.4).", number(k)),
        None => "Curvature: the run cannot be followed over what is left open.".into(),
    });
    out
}

/// Number, at least 1e-9: smaller differences are rounding.
fn rounding(x: f64) -> String {
    if x < 1e-9 { "1e-9".into() } else { number(x) }
}

fn is_whole(x: f64) -> bool {
    (x - x.round()).abs() < 0.05
}

/// Number with one decimal, or without if that is zero.
pub(crate) fn tenths(x: f64) -> String {
    if is_whole(x) { format!("{x:.0}") } else { format!("{x:.1}") }
}

fn fit(c: &Calibration) -> Vec<String> {
    let f = &c.fit;
    let per = f.factor * f.factor;
    let mut out = vec![
        format!(
            "chi-square {} on {} degrees of freedom{}: {} each (band of 99.9 % {:.4} to {:.4}); rescaled \
             sigmas are times {:.3}{}",
            number(f.chi_square),
            tenths(f.degrees_of_freedom),
            if is_whole(f.degrees_of_freedom) {
                ""
            } else {
                " (measurements less what the estimate takes of them, where random drift takes parts)"
            },
            number(per),
            f.band.from,
            f.band.to,
            f.factor.max(1.0),
            if c.assumed.known.is_empty() { "" } else { ", but for what was known before" }
        ),
        format!("{} linearisations along the whole run", f.passes),
        format!(
            "second path, a filter with the same wide prior: at the end of a record within {} sigma, its \
             sigmas within {} of themselves",
            rounding(c.second_path.difference),
            rounding(c.second_path.sigma_difference)
        ),
    ];
    if let Some(r) = &c.repeatability {
        out.push(format!(
            "run to run: chi-square {} per degree of freedom on {:.0} (band of 99.9 % {:.3} to {:.3})",
            number(r.chi_square),
            r.degrees_of_freedom,
            r.band.from,
            r.band.to
        ));
    }
    out
}

/// Values of the conditions that are not stated but affect sigmas and requirements; `None` if all are stated.
pub(crate) fn values_by_default(a: &Assumed) -> Option<String> {
    let value = |key: &String| match key.as_str() {
        "latitude_deg" => format!("latitude {} deg", a.latitude_deg),
        "accelerometer_noise_g" => format!("noise of a sample {:e} g", a.accelerometer_noise_g),
        "drift_noise" => format!("white drift {} deg/sqrt(h)", number(a.drift_noise_deg_sqrt_h)),
        other => other.into(),
    };
    let listed: Vec<String> = a.by_default.iter().map(value).collect();
    (!listed.is_empty()).then(|| listed.join(", "))
}

/// First lines: consistency, requirements, conditions that are not stated, findings.
fn lead(c: &Calibration) -> Vec<String> {
    let mut lead = vec![match c.consistent {
        true => format!(
            "consistent: the model and its sigmas explain the record, as far as it can tell{}",
            omitted::calibration::silent(&c.omitted)
        ),
        false => "NOT consistent: sigmas are not to be relied upon as they are".into(),
    }];
    lead.extend(c.requirements.as_ref().map(|r| {
        let psi = "; those on psi are not judged, since psi here is that of the start of a record";
        let said = stated::requirements(r);
        match said.strip_prefix("by this record ").filter(|_| !c.consistent) {
            Some(rest) => format!("By these sigmas, which a finding contradicts, {rest}{psi}."),
            None => format!("{}{psi}.", stated::capital(&said)),
        }
    }));
    let accepted = c.acceptance.as_ref().and_then(acceptance::sentence);
    lead.extend(accepted.map(|text| format!("{}.", stated::capital(&text))));
    lead.extend(omitted::calibration::of_requirements(c));
    lead.extend(left_open(c));
    let chosen = values_by_default(&c.assumed);
    lead.extend(chosen.map(|listed| format!("not stated, chosen by the program: {listed}")));
    lead.extend(c.findings.iter().map(|f| finding(f, &c.records)));
    lead
}

/// Tables of the estimates of unknowns and of combinations.
fn estimates(c: &Calibration) -> Vec<DocumentBlock> {
    let totals = c.quantities.iter().any(|e| e.total.is_some());
    let mut columns = vec![
        left("unknown"),
        left("unit"),
        right("degree"),
        right("estimate"),
        right("sigma"),
        right("rescaled"),
    ];
    columns.extend(totals.then(|| right("total")));
    columns.extend([right("predicted"), right("prior"), left("status")]);
    let total = if totals { "total: with the bench and what a suspected error changes; " } else { "" };
    let heading = format!(
        "Estimates (degree: exact verdict; {total}predicted: sigma by the linear model, at the times and \
         with the noise of the record; prior: what that of the program would do, in sigma and to sigma, \
         where none is stated)"
    );
    let mut blocks =
        vec![DocumentBlock::table(heading, columns.clone(), c.quantities.iter().map(|e| row(e, totals)))];
    if !c.combinations.is_empty() {
        let rows = c.combinations.iter().map(|e| row(e, totals));
        blocks.push(DocumentBlock::table(
            "Combinations of what is not told apart, and those asked for",
            columns,
            rows,
        ));
    }
    blocks
}

/// Table of the positions of all records.
fn positions(c: &Calibration) -> DocumentBlock {
    let each = c.positions.len() / c.records.len().max(1);
    let force = c.positions.iter().any(|p| p.force_g.is_some());
    let mut columns = vec![
        left("position"),
        right("from [s]"),
        right("to [s]"),
        right("measured"),
        right("force [g]"),
        right("chi-square"),
        left("without it moves most"),
        left("without it not determined"),
    ];
    if !force {
        columns.remove(FORCE);
    }
    DocumentBlock::table(
        "Positions (times of the record; chi-square per degree of freedom)",
        columns,
        c.positions
            .iter()
            .enumerate()
            .map(|(i, p)| position(p, (c.records.len() > 1).then(|| i / each), force)),
    )
}

/// Table of the components of Z.
fn channels(c: &Calibration) -> DocumentBlock {
    let columns = [
        left("component"),
        left("unit"),
        right("sigma"),
        right("scatter"),
        right("chi-square"),
        right("whiteness"),
        right("temperature"),
    ];
    let rows = c.channels.iter().map(|c| {
        vec![
            c.channel.clone(),
            c.unit.clone(),
            number(c.sigma),
            optional(c.scatter),
            number(c.chi_square),
            optional(c.whiteness_probability),
            c.temperature
                .map_or_else(|| "-".into(), |w| format!("{:+.2} ({})", w.correlation, number(w.probability))),
        ]
    });
    DocumentBlock::table(
        "Components of Z (sigma: of a sample, as used; scatter: of samples within a bin; whiteness: \
         probability of correlations like these; temperature: correlation with it, and the probability \
         of that)",
        columns,
        rows,
    )
}

/// Table of the first outliers; `None` without any.
fn outliers(c: &Calibration) -> Option<DocumentBlock> {
    if c.outliers.is_empty() {
        return None;
    }
    let columns = [left("record"), left("lines"), right("t [s]"), left("component"), right("off by [sigma]")];
    let lines =
        |Span { from, to }: Span<u64>| if from == to { from.to_string() } else { format!("{from}-{to}") };
    let rows = c.outliers.iter().take(LISTED).map(|o| {
        vec![o.record.clone(), lines(o.lines), number(o.t_s), o.channel.clone(), format!("{:+.1}", o.sigmas)]
    });
    let heading = match c.outlier_count {
        n if n > LISTED => format!("Left out as outliers: {n}, of which the first {LISTED}"),
        n => format!("Left out as outliers: {n}"),
    };
    Some(DocumentBlock::table(heading, columns, rows))
}

impl Answer for Calibration {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let mut blocks = estimates(self);
        if let Some(a) = &self.acceptance {
            blocks.push(acceptance::table("Acceptance", a));
            blocks.push(DocumentBlock::list("Decision rule", acceptance::rule(a)));
        }
        blocks.push(DocumentBlock::list("Mode", mode(self)));
        blocks.push(DocumentBlock::list("Fit", fit(self)));
        blocks.extend(DocumentBlock::list_if_any("Next runs", next_runs(&self.next_runs)));
        blocks.push(DocumentBlock::list("Not estimated", omitted::calibration::calibration(&self.omitted)));
        blocks.push(positions(self));
        blocks.push(channels(self));
        blocks.extend(outliers(self));
        blocks.push(DocumentBlock::list("Read", records(self)));
        blocks.push(DocumentBlock::list("Assumed", assumed(self)));
        let count = self.records.len();
        Document {
            title: format!("Calibration from {count} record{}", if count == 1 { "" } else { "s" }),
            lead: lead(self),
            blocks,
        }
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

/// Name of the table of unknowns and combinations.
pub(crate) const COEFFICIENTS: &str = "coefficients";

/// Adds two tables to those of a calibration: unknowns with combinations below them, and the covariance.
pub(crate) fn with_coefficients(mut tables: Vec<Table>, covariance: &CovarianceTable) -> Vec<Table> {
    let of = |name: &str| tables.iter().find(|t| t.name == name);
    // `quantities` and `combinations` are lists of the same objects
    let both: Vec<&Table> = ["quantities", "combinations"].into_iter().filter_map(of).collect();
    let columns = both.first().map(|t| t.columns.clone()).unwrap_or_default();
    let rows = both.iter().flat_map(|t| t.rows.clone()).collect();
    tables.push(Table { name: COEFFICIENTS.into(), columns, rows });
    tables.push(covariance_table(covariance));
    tables
}

/// The covariance of all that has an estimate, as CSV: a row and a column for each, after name, unit,
/// estimate and sigma.
///
/// # Errors
/// [`ReportError::Csv`].
pub fn covariance_csv(t: &CovarianceTable) -> Result<String, ReportError> {
    let Table { columns, rows, .. } = covariance_table(t);
    crate::csv_text::write(std::iter::once(columns).chain(rows))
}

/// Table of estimates, sigmas and their covariance.
fn covariance_table(t: &CovarianceTable) -> Table {
    let head = ["name", "unit", "estimate", "sigma"].map(String::from).into_iter();
    let columns = head.chain(t.names.iter().map(|n| format!("covariance with {n}"))).collect();
    let row = |i: usize| {
        let own = [t.estimates[i], t.covariance[i][i].sqrt()].map(|x| x.to_string());
        let texts = [t.names[i].clone(), t.units[i].clone()].into_iter().chain(own);
        texts.chain(t.covariance[i].iter().map(f64::to_string)).collect()
    };
    Table { name: "covariance".into(), columns, rows: (0..t.names.len()).map(row).collect() }
}

/// Residuals of all measurements as CSV.
///
/// # Errors
/// [`ReportError::Csv`].
pub fn residuals_csv(c: &Calibration) -> Result<String, ReportError> {
    let head = ["record", "position", "component", "t [s]", "residual", "sigma", "left out, in sigma"]
        .map(String::from);
    let rows = c.residuals.iter().map(|r| {
        let position = &c.positions[r.record * (c.positions.len() / c.records.len()) + r.position].position;
        vec![
            c.records[r.record].name.clone(),
            position.clone(),
            c.channels[r.channel].channel.clone(),
            r.t_s.to_string(),
            r.residual.to_string(),
            r.sigma.to_string(),
            r.normalised.to_string(),
        ]
    });
    crate::csv_text::write(std::iter::once(head.to_vec()).chain(rows))
}

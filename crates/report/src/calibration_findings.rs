//! Sentences on findings of a calibration and on the clocks of its records.

use obsdeg_calibration::answer::{
    CalibrationFinding, CellKind, Clock, ClockRate, ForceCause, ForceError, ForceLength, RecordReport,
};
use obsdeg_core::span::Span;

use crate::document::number;

/// Sentence part on sigmas that are wrong by a factor.
fn sigmas(factor: f64) -> String {
    if factor >= 1.0 {
        format!("sigmas are {factor:.2} times too small")
    } else {
        format!("sigmas are {:.2} times too large", 1.0 / factor)
    }
}

/// ` of FILE` if there are several records, else empty.
fn of(record: &str, records: &[RecordReport]) -> String {
    if records.len() > 1 { format!(" of {record}") } else { String::new() }
}

/// Error of one axis that explains the lengths of the specific force.
fn cause(c: &ForceCause) -> String {
    let besides = c.besides.map_or_else(String::new, |b| {
        format!(", beside {} too long at all positions alike (scale or gravity)", number(b))
    });
    let sigma = number(c.sigma);
    match c.error {
        ForceError::Scale if c.by < 0.0 => {
            format!("{} is {} too short (scale, sigma {sigma}; K1){besides}", c.axis, number(-c.by))
        }
        ForceError::Scale => {
            format!("{} is {} too long (scale, sigma {sigma}; K1){besides}", c.axis, number(c.by))
        }
        ForceError::Zero => {
            let by = format!("{}{}", if c.by < 0.0 { "" } else { "+" }, number(c.by));
            format!("{} has a zero of {by} g (sigma {sigma} g; K0){besides}", c.axis)
        }
    }
}

/// Relative rate error of a clock in percent, with `fast` or `slow`.
fn part(fast: f64) -> String {
    let digits = if fast.abs() < 1e-3 { 4 } else { 2 };
    format!("{:.digits$} % {}", 100.0 * fast.abs(), if fast < 0.0 { "slow" } else { "fast" })
}

/// Relative rate error from which a clock error is large.
const CLOCK: f64 = 0.1;

/// True if durations and rates show the same clock. Drifts that follow the clock take up a quarter of its
/// error, so the two may differ by that.
pub(crate) fn is_clock(by_durations: Option<&ClockRate>, by_earth: Option<&ClockRate>) -> bool {
    let both = by_durations.zip(by_earth);
    both.is_some_and(|(d, e)| (e.fast - d.fast).abs() <= 3.0 * e.sigma.hypot(d.sigma) + d.fast.abs() / 4.0)
}

/// Rate of a clock by the durations of positions. Answers of before have no sigma: it is 0 then.
pub(crate) fn durations(fast: Option<f64>, sigma: Option<f64>) -> Option<ClockRate> {
    fast.map(|fast| ClockRate { fast, sigma: sigma.unwrap_or(0.0) })
}

/// Sigma in parentheses, with a unit or without; empty for 0.
fn sigma(value: f64, unit: &str) -> String {
    if value > 0.0 { format!(" (sigma {}{unit})", number(value)) } else { String::new() }
}

/// Sentence on the offset and the rate of a record's clock.
pub(crate) fn clock(c: &Clock) -> String {
    let begins = match (c.offset_s, c.offset_sigma_s) {
        (Some(at), Some(sigma)) => format!(
            "; the scheme begins at {at:.3} s of its clock (estimated, sigma {} s; labels leave it open)",
            number(sigma)
        ),
        (Some(at), None) if at.abs() >= 5e-4 => format!("; the scheme begins at {at:.3} s of its clock"),
        _ => String::new(),
    };
    format!("{begins}{}", rates(c))
}

/// Sentence on the rate of a record's clock.
fn rates(c: &Clock) -> String {
    let held = durations(c.by_durations, c.by_durations_sigma).map_or_else(String::new, |held| {
        let times = 1.0 + held.fast;
        format!("; positions last {times:.4} times as long as in the scheme{}", sigma(held.sigma, ""))
    });
    let sharper = |e: &&ClockRate| c.by_earth.as_ref().is_none_or(|by| e.sigma < by.sigma);
    if let Some(e) = c.by_changes.as_ref().filter(sharper).filter(|e| 3.0 * e.sigma < CLOCK) {
        return format!(
            "; by its changes of position its clock is {} (sigma {} %)",
            part(e.fast),
            number(100.0 * e.sigma)
        );
    }
    match &c.by_earth {
        Some(e) if 3.0 * e.sigma < CLOCK && e.fast.abs() > CLOCK => {
            format!(
                "; no rate of its clock makes the rates of the earth and of turns those of the scheme{held}"
            )
        }
        Some(e) if 3.0 * e.sigma < CLOCK => format!(
            "; by the rates of the earth and of turns its clock is {} (sigma {} %){held}",
            part(e.fast),
            number(100.0 * e.sigma)
        ),
        Some(e) => format!(
            "; a clock that is wrong by less than {:.0} % does not show in it, and would make drifts wrong \
             by as much or more{held}",
            300.0 * e.sigma
        ),
        None => format!(
            "; a wrong clock does not show in it, and would make drifts wrong by as much or more{held}"
        ),
    }
}
/// Sentence on a finding.
pub(crate) fn finding(f: &CalibrationFinding, records: &[RecordReport]) -> String {
    let of = |record: &str| of(record, records);
    match f {
        CalibrationFinding::Interrupted => {
            "interrupted: the estimates are where the iteration was then".into()
        }
        CalibrationFinding::NotSettled => not_settled(),
        CalibrationFinding::Force { record, length_g, alike: true, causes, .. } => {
            force_alike(&of(record), *length_g, causes)
        }
        CalibrationFinding::Force { record, least, most, causes, .. } => {
            force_differs(&of(record), least, most, causes)
        }
        CalibrationFinding::Cells { record, column, kind_of_cells, value, count, lines } => {
            cells(&place_of_cells(column, &of(record), *lines), *kind_of_cells, *value, *count)
        }
        CalibrationFinding::Succession { record, position, channel, count, lines, span_s, sigmas } => {
            let place = place_of_succession(position, *span_s, *lines);
            succession(*count, &format!("{channel}{}", of(record)), &place, *sigmas)
        }
        CalibrationFinding::Clock { record, by_durations, by_durations_sigma, by_changes, by_earth } => {
            let by_durations = durations(*by_durations, *by_durations_sigma);
            clock_error(&of(record), by_durations.as_ref(), by_changes.as_ref(), by_earth.as_ref())
        }
        CalibrationFinding::ClockJump { record, line, place, from_s, by_s, chi_square, explains } => {
            let behind = format!("{from_s:.3} s ({place}, before line {line})");
            clock_jump(&of(record), *by_s, &behind, *chi_square, *explains)
        }
        CalibrationFinding::Copy { record, other, correlation } => format!(
            "{record} has the noise of {other} (correlation {correlation:.2} of their residuals): it is a \
             copy, and counts twice"
        ),
        CalibrationFinding::Turns { record, factor, slew_rate_deg_s } => {
            turns(&of(record), *factor, *slew_rate_deg_s)
        }
        CalibrationFinding::Position { record, position, chi_square, factor } => {
            unexplained_position(&of(record), position, *chi_square, *factor)
        }
        CalibrationFinding::Noise { chi_square, factor } => unexplained_scatter(*chi_square, *factor),
        CalibrationFinding::Channel { channel, chi_square, factor } => {
            unexplained_channel(channel, *chi_square, *factor)
        }
        CalibrationFinding::Correlated { record, channel, probability } => {
            correlated(&format!("{channel}{}", of(record)), *probability)
        }
        CalibrationFinding::Temperature { record, channel, correlation, probability } => {
            with_temperature(&format!("{channel}{}", of(record)), *correlation, *probability)
        }
        CalibrationFinding::Outliers { count, of } => format!(
            "{count} of {of} measurements are far off, too many to be outliers: none of them was left out"
        ),
        CalibrationFinding::Repeatability { chi_square } => records_disagree(*chi_square),
        CalibrationFinding::SecondPath { difference } => paths_differ(*difference),
        CalibrationFinding::Suspect { errors, chi_square_fall } => suspect(errors, *chi_square_fall),
        CalibrationFinding::Known { chi_square } => format!(
            "the calibration before does not agree with these records (chi-square {} per degree of freedom)",
            number(*chi_square)
        ),
    }
}

/// Sentence on an iteration that did not settle.
fn not_settled() -> String {
    "the iteration did NOT settle: the estimates are where it was given up. Check the times and \
     attitudes of the scheme against the run (--dry-run shows how the record is read); state priors \
     of the drifts under [simulation]; add positions"
        .into()
}

/// Sentence on a specific force that has the same wrong length at all positions.
fn force_alike(of: &str, length_g: f64, causes: &[ForceCause]) -> String {
    let or = causes.iter().map(|c| format!(" (or of {} alone: these positions do not tell)", c.axis));
    format!(
        "the specific force{of} is {length_g:.6} g long at all positions alike: a scale error of \
         {}{}, or another gravity, which no unknown of the scheme explains (K1 would)",
        number(length_g - 1.0),
        or.collect::<String>()
    )
}

/// Sentence on a specific force whose length differs from position to position.
fn force_differs(of: &str, least: &ForceLength, most: &ForceLength, causes: &[ForceCause]) -> String {
    let lengths = format!(
        "the specific force{of} is {:.6} g long at {} and {:.6} g at {}",
        least.length_g, least.position, most.length_g, most.position
    );
    if causes.is_empty() {
        return format!(
            "{lengths}: no scale or zero of one axis makes such lengths (they are among the \
             positions), and no unknown of the scheme explains them (K0 and K1 would)"
        );
    }
    let each: Vec<String> = causes.iter().map(cause).collect();
    let ambiguous = if causes.len() > 1 { " (these positions do not tell which)" } else { "" };
    format!("{lengths}: {}{ambiguous}, which no unknown of the scheme explains", each.join(", or "))
}

/// Column and lines of cells.
fn place_of_cells(column: &str, of: &str, Span { from: first, to: last }: Span<u64>) -> String {
    let lines = if first == last { format!("line {first}") } else { format!("lines {first} to {last}") };
    format!("column `{column}`{of}, {lines}")
}

/// Sentence on cells that hold one value again and again.
fn cells(place: &str, kind: CellKind, value: f64, count: usize) -> String {
    let (cells, hold, repeat, them, were) = if count == 1 {
        ("cell", "holds", "repeats", "it", "was")
    } else {
        ("cells", "hold", "repeat", "them", "were")
    };
    match kind {
        CellKind::Code => format!(
            "{place}: {count} {cells} {hold} exactly {value}, far from the rows beside {them}, and \
             {were} left out; if that is a code of missing values, state `missing = [{value}]` under \
             [record]"
        ),
        CellKind::Stuck => format!(
            "{place}: {count} {cells} {repeat} the value {value} of the row before to the last \
             digit, and {were} left out; check whether the output is stuck"
        ),
    }
}

/// Position, time in s and lines of measurements in succession.
fn place_of_succession(position: &str, span_s: Span<f64>, lines: Span<u64>) -> String {
    format!(
        "position {position}, {} to {} s, lines {} to {}",
        number(span_s.from),
        number(span_s.to),
        lines.from,
        lines.to
    )
}

/// Sentence on measurements in succession that lie to one side.
fn succession(count: usize, channel: &str, place: &str, sigmas: Span<f64>) -> String {
    format!(
        "{count} measurements of {channel} in succession ({place}) lie {:+.1} to {:+.1} sigma off, and were \
         left out: no outliers, but a step of an output at either end of them, or a platform that moved; a \
         step also changes what comes before or after",
        sigmas.from, sigmas.to
    )
}

/// Sentence on a clock that is fast or slow, by the changes of position if these show it.
fn clock_error(
    of: &str,
    by_durations: Option<&ClockRate>,
    by_changes: Option<&ClockRate>,
    by_earth: Option<&ClockRate>,
) -> String {
    match by_changes {
        Some(e) => format!(
            "the clock{of} is {} by its changes of position, and drifts are off by that part; \
             positions held so much longer or shorter than in the scheme look the same",
            rate(e)
        ),
        None => clock_by_rates(of, by_durations, by_earth),
    }
}

/// Rate of a clock in percent with its sigma.
fn rate(e: &ClockRate) -> String {
    format!("{}{}", part(e.fast), sigma(100.0 * e.sigma, " %"))
}

/// Sentence on a clock by the durations of positions and by the rates of the earth and of turns.
fn clock_by_rates(of: &str, by_durations: Option<&ClockRate>, by_earth: Option<&ClockRate>) -> String {
    let held = by_durations.map(|d| format!("positions begin and end as by a clock that is {}", rate(d)));
    match (held, by_earth.map(rate)) {
        (Some(held), Some(rates)) if is_clock(by_durations, by_earth) => format!(
            "the clock{of}: {held}, by the rates of the earth and of turns it is {rates}; drifts are \
             off by that part, those that the earth rate tells by more"
        ),
        (held, Some(rates)) => format!(
            "the rates of the earth and of turns{of} are not those of the scheme: they fit best as \
             by a clock that is {rates}{}; another latitude or rate of turns, or an error that no \
             unknown explains, look the same, and are likelier where positions last as in the \
             scheme",
            held.map_or_else(String::new, |held| format!(", while {held}"))
        ),
        (held, None) => format!(
            "the clock{of}: {}; the rates of the earth and of turns do not tell a clock from \
             positions that were held so much longer or shorter: by a clock drifts are off by that \
             part or more, else the scheme has other times than its run",
            held.unwrap_or_default()
        ),
    }
}

/// Sentence on a clock that was set forward; `behind` is the time and the row before the jump.
fn clock_jump(of: &str, by_s: f64, behind: &str, chi_square: f64, explains: bool) -> String {
    format!(
        "the clock{of} was set forward by {by_s:.1} s behind {behind}: with \
         the times from there on less by that, {} (chi-square {} per degree of freedom)",
        match explains {
            true => "the model explains the records",
            false => "the records fit far better, but something else is wrong besides",
        },
        number(chi_square)
    )
}

/// Sentence on turns that last longer or shorter than in the scheme, by a factor.
fn turns(of: &str, factor: f64, slew_rate_deg_s: Option<f64>) -> String {
    format!(
        "the turns{of} last {factor:.3} times as long as in the scheme, while positions do not{}",
        slew_rate_deg_s.map_or_else(String::new, |rate| {
            format!(": they were made at about {rate:.2} deg/s (`slew_rate_deg_s`)")
        })
    )
}

/// Sentence on a position that the model does not explain.
fn unexplained_position(of: &str, position: &str, chi_square: f64, factor: f64) -> String {
    format!(
        "the model does not explain position {position}{of} (chi-square {} per degree of freedom): {} there",
        number(chi_square),
        sigmas(factor)
    )
}

/// Sentence on the scatter of all positions together.
fn unexplained_scatter(chi_square: f64, factor: f64) -> String {
    format!(
        "chi-square is {} per degree of freedom over all positions together: {}",
        number(chi_square),
        sigmas(factor)
    )
}

/// Sentence on the scatter of one component of Z.
fn unexplained_channel(channel: &str, chi_square: f64, factor: f64) -> String {
    format!(
        "{channel} has a chi-square of {} per degree of freedom: its {}",
        number(chi_square),
        sigmas(factor)
    )
}

/// Sentence on residuals that are not white.
fn correlated(channel: &str, probability: f64) -> String {
    format!(
        "the residuals of {channel} are not independent of each other (probability {}): sigmas are too \
         small by what that hides",
        number(probability)
    )
}

/// Sentence on residuals that follow the temperature.
fn with_temperature(channel: &str, correlation: f64, probability: f64) -> String {
    format!(
        "the residuals of {channel} go with the temperature (correlation {correlation:+.2}, \
         probability {}), which no unknown of the scheme explains",
        number(probability)
    )
}

/// Sentence on records that do not agree on the coefficients.
fn records_disagree(chi_square: f64) -> String {
    format!(
        "the records do not agree on the coefficients (chi-square {} per degree of freedom): they \
         changed between the runs, or sigmas are too small",
        number(chi_square)
    )
}

/// Sentence on a filter that differs from least squares, in sigma.
fn paths_differ(difference: f64) -> String {
    format!(
        "filter and least squares differ by {} sigma: these numbers are not resolved in double precision",
        number(difference)
    )
}

/// Sentence on errors outside the model that would explain the residuals.
fn suspect(errors: &[String], chi_square_fall: f64) -> String {
    format!(
        "with {} among the unknowns chi-square would fall by {}, more than by chance: see Not estimated",
        errors.join(" and "),
        number(chi_square_fall)
    )
}

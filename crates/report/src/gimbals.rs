//! Gimbal limits in words: angles beyond them, and gimbal angles during turns.

use obsdeg_core::model::{GimbalReport, GimbalStop, GimbalTurn};

use crate::document::{DocumentBlock, short as deg};
use crate::words;

/// Names of the Euler angles, with the axis of each gimbal.
pub(crate) const NAMES: [&str; 3] =
    ["alpha (outer, about North)", "beta (middle)", "gamma (inner, about Z_p)"];

/// `angles beyond the gimbal limits: p2`: for the first lines of an answer.
pub(crate) fn lead(report: Option<&GimbalReport>) -> Option<String> {
    let report = report?;
    let each: Vec<String> = (report.beyond.iter())
        .map(|b| format!("{} ({}): the same attitude within them is {}", b.position, b.angles, b.within))
        .collect();
    let angles = format!("angles beyond the gimbal limits ({}): {}", report.limits, each.join("; "));
    let leave = |t: &&GimbalTurn| !t.stays;
    let turns: Vec<&str> = report.turns.iter().filter(leave).map(|t| t.position.as_str()).collect();
    let turns = format!(
        "turns that do NOT stay within the gimbal limits: to {}",
        words::names(turns.iter().copied())
    );
    match (each.is_empty(), report.turns.iter().any(|t| !t.stays)) {
        (true, false) => None,
        (false, false) => Some(angles),
        (true, true) => Some(format!("{turns} (see Gimbals)")),
        (false, true) => Some(format!("{angles}; {turns} (see Gimbals)")),
    }
}

/// `alpha by -180, gamma by 90 deg`.
fn by_gimbals(change: &[f64; 3]) -> String {
    let moved = ["alpha", "beta", "gamma"].iter().zip(change).filter(|(_, x)| **x != 0.0);
    let moved: Vec<String> = moved.map(|(name, x)| format!("{name} by {}", deg(*x))).collect();
    if moved.is_empty() { "nothing turns".into() } else { format!("{} deg", moved.join(", ")) }
}

/// `the turn to p2 (180 deg about N)`.
fn named(t: &GimbalTurn) -> String {
    let what = if t.rotation { "the rotation of" } else { "the turn to" };
    let turn = t.turn.as_ref();
    let turn =
        turn.map(|turn| format!(" ({} deg about {})", deg(turn.angle_deg), words::direction(&turn.about)));
    format!("{what} {}{}", t.position, turn.unwrap_or_default())
}

/// Sentence on a turn that leaves the limits or ends at other angles; `None` for any other.
fn turn(t: &GimbalTurn) -> Option<String> {
    let instead = t.gimbals_deg.as_ref().filter(|_| !t.by_gimbals);
    let instead = instead.map_or_else(String::new, |change| {
        format!(
            "; gimbal by gimbal, between angles within the limits, it stays within them: {}",
            by_gimbals(change)
        )
    });
    let what = match (&t.stop, t.ends_deg) {
        (Some(GimbalStop { gimbal: Some(gimbal), at_deg, after_deg }), _) => format!(
            "does NOT stay within the limits: {gimbal} reaches {} deg after {} deg of it{instead}",
            deg(*at_deg),
            deg(*after_deg)
        ),
        (Some(GimbalStop { gimbal: None, at_deg, after_deg }), _) => format!(
            "cannot be made: after {} deg of it, at beta = {} deg, alpha and gamma would have to turn more \
             than 100 times as fast as the platform{instead}",
            deg(*after_deg),
            deg(*at_deg)
        ),
        (None, Some(ends)) => format!(
            "stays within the limits and ends at {}, other angles of the same attitude than those listed{instead}",
            ends.map(deg).join(",")
        ),
        (None, None) if !t.stays => {
            "gimbal by gimbal, as the angles are written, does NOT stay within the limits".into()
        }
        (None, None) => return None,
    };
    Some(format!("{} {what}", named(t)))
}

/// Gimbal limits and turns of a scheme; `None` without limits.
pub(crate) fn block(report: Option<&GimbalReport>) -> Option<DocumentBlock> {
    DocumentBlock::list_if_any("Gimbals", lines(report))
}

/// Lines on limits and turns; empty without limits.
pub(crate) fn lines(report: Option<&GimbalReport>) -> Vec<String> {
    let Some(report) = report else { return Vec::new() };
    let mut lines = vec![format!("limits: {}; gimbals: {}", report.limits, NAMES.join(", "))];
    let listed: Vec<String> = report.turns.iter().filter_map(turn).collect();
    let stay = |rotation: bool, by: bool| -> Vec<&str> {
        let stays = |t: &&GimbalTurn| (t.rotation, t.by_gimbals) == (rotation, by) && turn(t).is_none();
        report.turns.iter().filter(stays).map(|t| t.position.as_str()).collect()
    };
    for (what, names) in [
        ("turns about one axis that stay within the limits on their way: to", stay(false, false)),
        ("turns gimbal by gimbal, within the limits: to", stay(false, true)),
        ("rotations that stay within the limits: of", stay(true, false)),
    ] {
        lines.extend((!names.is_empty()).then(|| format!("{what} {}", words::names(names))));
    }
    let instead = report.turns.iter().any(|t| turn(t).is_some() && !t.by_gimbals && t.gimbals_deg.is_some());
    lines.extend(listed);
    lines.extend(instead.then(|| {
        match report.beyond.is_empty() {
            true => "Write `path = \"gimbals\"` in the scheme file to turn gimbal by gimbal: alpha, beta, \
                     gamma one after another"
                .into(),
            false => "Write the angles within the limits (first lines) and `path = \"gimbals\"` in the \
                      scheme file to turn gimbal by gimbal: alpha, beta, gamma one after another"
                .into(),
        }
    }));
    lines
}

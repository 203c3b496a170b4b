//! Parts that the sections of a review share: headings, lists of names, times.

use crate::document::DocumentBlock;

pub(super) fn section(level: usize, title: impl Into<String>) -> DocumentBlock {
    DocumentBlock::Section { level, title: title.into() }
}

pub(super) fn is_list(block: &DocumentBlock, name: &str) -> bool {
    matches!(block, DocumentBlock::List { heading, .. } if heading == name)
}

pub(super) fn joined<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

/// `with derivatives up to order 2 (D_FY, D_IY)`: names if only some unknowns need that order.
pub(super) fn derivatives<'a>(worst: usize, all: impl Iterator<Item = (&'a str, Option<usize>)>) -> String {
    let all: Vec<_> = all.collect();
    let names: Vec<&str> = all.iter().filter(|q| q.1 == Some(worst)).map(|q| q.0).collect();
    match (worst, names.len() == all.len()) {
        (0, _) => "without any derivative".into(),
        (k, true) => format!("with derivatives up to order {k}"),
        (k, false) => format!("with derivatives up to order {k} ({})", names.join(", ")),
    }
}

/// A time in s, to a tenth.
pub(super) fn seconds(t: f64) -> String {
    let text = format!("{t:.1}");
    text.strip_suffix(".0").map_or(text.clone(), String::from)
}

/// A time in s, and in minutes, hours or days if it is long: `2628.1 s (44 min)`, `5000 s (1 h 23 min)`.
pub(super) fn duration(t_s: f64) -> String {
    let minutes = (t_s / 60.0).round() as u64;
    let (hours, days) = (minutes / 60, minutes / 1440);
    let long = match (days, hours) {
        (2.., _) => format!(" ({days} d {} h)", hours % 24),
        (_, 1..) => format!(" ({hours} h {} min)", minutes % 60),
        _ if minutes >= 2 => format!(" ({minutes} min)"),
        _ => String::new(),
    };
    format!("{} s{long}", seconds(t_s))
}

//! Changes that would meet every requirement, where no scheme does: plain data, and its words.

use std::fmt;

use obsdeg_evidence::requirements::Miss;

use crate::design::answer::Found;

/// Changes that would meet every requirement, where no scheme does.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Nearest {
    /// Scheme with the largest worst margin of those evaluated; `None` if none determines the required
    /// coefficients.
    pub scheme: Option<Found>,
    /// Same scheme with the shortest dwell that meets every requirement, to three digits; `None` if
    /// none was found.
    pub dwell: Option<Found>,
    /// Largest dwell that was tried, in s.
    pub longest_s: f64,
    /// Scheme with the fewest positions, of those tried, that meets every requirement; `None` if none
    /// does.
    pub positions: Option<Found>,
    /// Largest number of positions that was tried.
    pub most: usize,
    /// Other candidates that were tried, as `--candidates` names them, with their best scheme of the
    /// same number of positions.
    pub candidates: Vec<TriedCandidates>,
    /// Number of sequences that were evaluated.
    pub examined: u64,
    /// True if the search was interrupted or reached its limit of work before all was tried.
    pub unfinished: bool,
}

/// Other candidates that were tried, with their best scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct TriedCandidates {
    /// Candidates, as `--candidates` names them.
    pub name: String,
    /// Best scheme of the same number of positions; `None` if none was found.
    pub best: Option<Found>,
}

/// Text `margin 0.71 (D_SX)`, or the coefficients that are not determined.
fn margin(of: &Found) -> String {
    let r = &of.requirements;
    let unseen: Vec<&str> =
        r.missed.iter().filter(|m| m.why != Miss::TooLarge).map(|m| m.name.as_str()).collect();
    match &r.worst {
        _ if !unseen.is_empty() => format!("{} not determined", unseen.join(", ")),
        Some(worst) => format!("worst margin {:.4} ({})", worst.margin, worst.name),
        None => "no margin".into(),
    }
}

/// One line per change that meets the requirements, or that was tried.
impl fmt::Display for Nearest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.scheme {
            Some(s) => writeln!(
                f,
                "nearest scheme found: {}, {} of {} requirements met, {}",
                route(s),
                s.requirements.met,
                s.requirements.stated,
                margin(s)
            )?,
            None => writeln!(f, "no scheme found determines what is required")?,
        }
        match &self.dwell {
            Some(found) => writeln!(
                f,
                "dwell: with --dwell {} this scheme meets all ({})",
                found.dwell_s,
                margin(found)
            )?,
            None if self.scheme.is_some() => writeln!(
                f,
                "dwell: up to {} s at each position this scheme does not meet all",
                self.longest_s
            )?,
            None => {}
        }
        match &self.positions {
            Some(found) => writeln!(
                f,
                "positions: with --positions {} this scheme meets all: {} ({})",
                found.positions.len(),
                route(found),
                margin(found)
            )?,
            None => writeln!(f, "positions: no scheme of up to {} was found that meets all", self.most)?,
        }
        for tried in &self.candidates {
            write_candidates(f, &tried.name, tried.best.as_ref())?;
        }
        let ended = if self.unfinished { "; not all was tried" } else { "" };
        write!(
            f,
            "by exchange, {} sequences evaluated{ended}: there may be nearer schemes, and shorter dwells or \
             fewer positions that do",
            self.examined
        )
    }
}

/// Positions of a scheme in order.
fn route(of: &Found) -> String {
    of.positions.join(" ")
}

/// Writes the line of other candidates that were tried, with their best scheme.
fn write_candidates(f: &mut fmt::Formatter<'_>, name: &str, found: Option<&Found>) -> fmt::Result {
    match found {
        Some(found) if found.requirements.all_met() => writeln!(
            f,
            "candidates: with --candidates {name} this scheme meets all: {} ({})",
            route(found),
            margin(found)
        ),
        Some(found) => writeln!(
            f,
            "candidates: with --candidates {name} the best found does not meet all: {}",
            margin(found)
        ),
        None => writeln!(f, "candidates: with --candidates {name} none was found"),
    }
}

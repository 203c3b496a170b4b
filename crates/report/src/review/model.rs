//! The part of a model in a review.

use obsdeg_core::analysis::Status;
use obsdeg_core::review::ModelReview;

use super::{derivatives, is_list, pictures, section};
use crate::document::Block;
use crate::system;

/// The verdict on a model in two sentences.
fn verdict(m: &ModelReview) -> String {
    let a = &m.analysis;
    let seen: Vec<_> = a.quantities.iter().filter(|q| q.status == Status::Observable).collect();
    let worst = seen.iter().filter_map(|q| q.degree).max();
    let derivatives = worst.map_or_else(String::new, |k| {
        format!(", {}", derivatives(k, seen.iter().map(|q| (q.name.as_str(), q.degree))))
    });
    let lost = match a.unobservable_directions {
        0 => "nothing is lost".to_string(),
        1 => "one direction changes no output".into(),
        n => format!("{n} independent directions change no output"),
    };
    let filter = match &m.evidence {
        None => "No filter was run",
        Some(e) if e.passed => "The information of a simulated run confirms the verdicts",
        Some(_) => "The information of a simulated run DISAGREES with the verdicts",
    };
    format!(
        "{} of {} unknowns are locally observable{derivatives}; {lost}. {filter}.",
        seen.len(),
        a.quantities.len()
    )
}

/// Verdict, unknowns, equations and evidence.
pub(super) fn part(blocks: &mut Vec<Block>, m: &ModelReview, level: usize, id: &str) {
    let a = &m.analysis;
    let document = system::document(a);
    blocks.push(section(level, "Verdict"));
    blocks.extend((!a.description.is_empty()).then(|| Block::Text(a.description.clone())));
    blocks.push(Block::Text(verdict(m)));
    blocks.push(section(level, "Unknowns and equations"));
    blocks.extend(document.blocks);
    blocks.push(pictures::model_staircase(a, &format!("{id}_staircase")));
    blocks.push(section(level, "Evidence by a filter"));
    blocks.extend(m.note.iter().map(|n| Block::Text(format!("{n}."))));
    if let Some(e) = &m.evidence {
        let document = system::evidence(e);
        blocks.extend(document.lead.into_iter().map(Block::Text));
        blocks.extend(document.blocks);
    }
    if let Some((run, traces)) = &m.run {
        let document = system::run(run);
        blocks.extend(document.blocks.into_iter().filter(|b| !is_list(b, "Assumed")));
        blocks.extend(pictures::errors(traces, id));
    }
}

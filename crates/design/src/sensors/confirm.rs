//! Confirmation of sets by the verdicts of a model with these outputs.

use std::collections::HashSet;

use obsdeg_core::system::{Candidate, judge};

use super::cuts::members;
use super::ranks::Set;
use super::{SensorError, SensorTask, degree, names};

/// Largest number of sets that are judged again.
const MOST: usize = 48;

/// Result of the confirmation.
pub(super) struct Confirmation {
    /// Number of sets judged again.
    pub(super) sets: usize,
}

impl Confirmation {
    /// Judges sets again in their order, as far as the limit of work of one verdict goes. Empty sets
    /// without own outputs have no model and are skipped.
    pub(super) fn of(task: &mut SensorTask<'_>, sets: Vec<Set>) -> Result<Self, SensorError> {
        let (mut seen, mut left, mut alike) = (HashSet::new(), task.model.work_limit.operations(), 0);
        for set in sets.into_iter().filter(|set| *set != 0 || task.options.own_outputs) {
            if seen.len() >= MOST || left == 0 {
                break;
            }
            if !seen.insert(set) {
                continue;
            }
            let Ok(found) = task.search.degrees(set).map(<[u16]>::to_vec) else { break };
            // a set without a verdict of its own is not counted
            let Some(work) = judged_alike(task, set, &found)? else { continue };
            left = left.saturating_sub(work);
            alike += 1;
        }
        Ok(Self { sets: alike })
    }
}

/// Compares the degrees under a set with those of a model with these outputs. Returns the number of
/// operations; `None` if that model is not judged.
fn judged_alike(task: &SensorTask<'_>, set: Set, found: &[u16]) -> Result<Option<u64>, SensorError> {
    let options = task.options;
    let chosen: Vec<Candidate> = members(set).map(|c| options.candidates[c].clone()).collect();
    let (model, _) = task.model.measuring(&chosen, options.own_outputs);
    let Ok(judged) = judge(&model, options.seed, options.order) else { return Ok(None) };
    for (u, &found) in task.asked.iter().zip(found) {
        let name = u.name_in(task.model, &model);
        let own = judged.verdict(&model, &name).and_then(|v| v.degree);
        if own != degree(found) {
            let word = |d: Option<usize>| d.map_or_else(|| "none".to_string(), |d| d.to_string());
            let reason = format!(
                "under the set {} the degree of {} is {} by its rows and {} by the verdict: please report this model",
                names(set, options).join(", "),
                u.name,
                word(degree(found)),
                word(own)
            );
            return Err(SensorError::Undecided { reason });
        }
    }
    Ok(Some(judged.work.max(1)))
}

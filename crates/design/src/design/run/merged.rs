//! Merge of the parts of an exhaustive search into the answer of the whole.

use obsdeg_core::model::Scheme;
use obsdeg_evidence::simulation::Conditions;
use obsdeg_exact::SplitMix64;

use crate::design::answer::{Design, PartsReport};
use crate::design::request::error::{DesignError, PartError};
use crate::design::request::options::DesignOptions;
use crate::design::run::driver::answered;
use crate::design::run::inputs::Inputs;
use crate::design::run::part::{MOST_PARTS, Part};
use crate::design::run::part_check::{BlockIndex, WholeSearch};
use crate::design::run::prepared::PreparedSearch;
use crate::design::search::best::Best;
use crate::design::search::progress::Progress;

/// Part with its name.
type NamedPart = (String, Part);

/// Merges all parts of an exhaustive search into the answer of the whole, valid if the parts were
/// searched as they state. The parts are named and may come in any order. All listed sequences are
/// evaluated again, starts and counts must add up to the whole, and `check` of the blocks, chosen at
/// random, are searched again.
///
/// # Errors
/// [`DesignError::Part`] for a part that is foreign, changed, doubled or not done,
/// [`DesignError::MissingParts`]; [`DesignError`].
pub fn design_merged(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    parts: &[NamedPart],
    check: usize,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Design, DesignError> {
    if options.free.is_some() {
        return Err(DesignError::Parts);
    }
    let sorted = in_order(parts, &Inputs::new(base, conditions, options))?;
    let together = |prepared: &PreparedSearch<'_>, k: usize| {
        let whole = WholeSearch::new(prepared, k, progress)?;
        for (name, part) in &sorted {
            whole.check(part).map_err(|why| DesignError::Part { name: name.clone(), why })?;
        }
        let (all, levels) = merged(&sorted, options.keep)?;
        let blocks = blocks(&sorted, levels);
        let mut report = PartsReport {
            parts: sorted.len(),
            versions: versions(&sorted),
            blocks: blocks.len(),
            searched_again: 0,
        };
        let random = &mut choice(&sorted, options.seed);
        report.searched_again = whole.search_again(&sorted, blocks, check, random)?;
        Ok((all, report))
    };
    answered(base, conditions, options, progress, Some(&together))
}

/// Parts by number, each once.
fn in_order<'a>(parts: &'a [NamedPart], inputs: &Inputs) -> Result<Vec<&'a NamedPart>, DesignError> {
    let Some((_, first)) = parts.first() else { return Err(DesignError::Parts) };
    let of = first.part[1];
    let mut sorted: Vec<Option<&NamedPart>> = vec![None; of.min(MOST_PARTS)];
    for named in parts {
        let (name, part) = named;
        let named_error = |why: PartError| DesignError::Part { name: name.clone(), why };
        part.check(inputs).map_err(named_error)?;
        if part.part[1] != of {
            return Err(named_error(PartError::Division { found: part.part, expected: of }));
        }
        if !part.complete {
            return Err(named_error(PartError::Unfinished { part: part.part }));
        }
        let slot = sorted.get_mut(part.part[0] - 1);
        let Some(slot) = slot else { return Err(DesignError::PartNumber { found: part.part }) };
        if let Some((other, _)) = slot {
            return Err(named_error(PartError::Doubled { part: part.part, other: other.clone() }));
        }
        *slot = Some(named);
    }
    let missing: Vec<usize> = (1..=sorted.len()).filter(|i| sorted[i - 1].is_none()).collect();
    match missing.is_empty() {
        true => Ok(sorted.into_iter().flatten().collect()),
        false => Err(DesignError::MissingParts { missing, of }),
    }
}

/// Results of all parts together, and the number of worst degrees that they had to search.
fn merged(sorted: &[&NamedPart], keep: usize) -> Result<(Best, usize), DesignError> {
    let mut all = Best { complete: true, ..Best::default() };
    let most = sorted.iter().map(|(_, part)| part.levels.len()).max().unwrap_or(0);
    for i in 0..most {
        for (name, part) in sorted {
            // a part ends early only if it has found enough by itself
            let unfinished =
                || DesignError::Part { name: name.clone(), why: PartError::Unfinished { part: part.part } };
            all.merge(keep, part.levels.get(i).ok_or_else(unfinished)?.best.clone());
        }
        if all.found.len() >= keep.max(1) {
            return Ok((all, i + 1));
        }
    }
    Ok((all, most))
}

/// All blocks that the answer rests on.
fn blocks(sorted: &[&NamedPart], levels: usize) -> Vec<BlockIndex> {
    let mut out = Vec::new();
    for (i, (_, part)) in sorted.iter().enumerate() {
        for (j, level) in part.levels.iter().take(levels).enumerate() {
            out.extend((0..level.blocks.len()).map(|k| [i, j, k]));
        }
    }
    out
}

/// Versions of the program that wrote the parts, each once.
fn versions(sorted: &[&NamedPart]) -> Vec<String> {
    let mut out: Vec<String> = sorted.iter().map(|(_, part)| part.version.clone()).collect();
    out.sort_unstable();
    out.dedup();
    out
}

/// Random numbers for the choice of blocks. They depend on every part, so no part can be written to
/// suit the choice.
fn choice(sorted: &[&NamedPart], seed: u64) -> SplitMix64 {
    let seals: Vec<&str> = sorted.iter().map(|(_, part)| part.seal.as_str()).collect();
    SplitMix64::of(seed, "blocks of parts", &seals)
}

//! Exhaustive searches in parts: ranges of the ordered starts, each searched by itself, in blocks of starts.

use std::collections::BTreeMap;
use std::ops::Range;

use obsdeg_core::model::Scheme;
use obsdeg_evidence::simulation::Conditions;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::design::measure::stop::Stop;
use crate::design::request::error::{DesignError, PartError};
use crate::design::request::options::DesignOptions;
use crate::design::run::inputs::{Inputs, differing, sha256};
use crate::design::run::prepared::PreparedSearch;
use crate::design::run::task::asked;
use crate::design::search::best::Best;
use crate::design::search::progress::{NOTHING_YET, Progress, watched};
use crate::design::search::scoring::SequenceSearch;

/// Name and version of the JSON layout.
pub(crate) const PART_SCHEMA: &str = "obsdeg.part/2";
/// Largest number of parts of a search.
pub(crate) const MOST_PARTS: usize = 1_000_000;
/// Number of starts of a block, which are searched at once: an interrupted part continues after its
/// last block.
pub(crate) const BLOCK: usize = 16;

/// Part of an exhaustive search, done or interrupted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Part {
    /// Layout of this answer: `obsdeg.part/2`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// SHA-256 of all inputs: the parts of one search have the same.
    pub digest: String,
    /// Inputs of the search as a user writes them: options by name, and lines of the scheme file that states
    /// all conditions as `section.key`. They show the difference if digests differ.
    pub inputs: BTreeMap<String, String>,
    /// Options and files of the command that wrote it, as the JSON text that the command reads: its merge
    /// needs no others; null if no command did.
    pub asked: Option<String>,
    /// Index of the part, from 1, then the number of parts.
    pub part: [usize; 2],
    /// Starts of the part: index of the first, index behind the last (both from 0), and the number of all
    /// starts.
    pub starts: [usize; 3],
    /// Sequences found, by worst degree, smallest first (under reset carry all degrees together).
    pub levels: Vec<Level>,
    /// True if all of its starts were searched, at as many worst degrees as the whole may need.
    pub complete: bool,
    /// SHA-256 over all other fields: a part that was changed after it was written is refused.
    pub seal: String,
}

/// Sequences found with one worst degree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Level {
    /// Index of the first start that is not yet searched.
    pub next: usize,
    /// Best sequences, the front and the counts at this worst degree.
    pub best: Best,
    /// Blocks of starts that were searched, in order: any can be searched again by itself.
    pub blocks: Vec<Block>,
}

/// Block of successive starts, and what its search found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Block {
    /// Starts of the block: index of the first, index behind the last (both from 0).
    pub starts: [usize; 2],
    /// Number of sequences examined, excluded by a bound, and lost to rounding.
    pub counts: [u64; 3],
    /// SHA-256 over the best sequences, the front, the ties and the counts of the block.
    pub digest: String,
}

impl Block {
    /// Block for the search of some starts, with its counts and digest.
    pub(crate) fn new(starts: &Range<usize>, best: &Best) -> Self {
        Self {
            starts: [starts.start, starts.end],
            counts: [best.examined, best.excluded, best.lost],
            digest: sha256(&format!("{best:?}")),
        }
    }
}

impl Part {
    /// Part before its search.
    fn begun(inputs: Inputs, part: [usize; 2], starts: [usize; 3]) -> Self {
        Self {
            schema: PART_SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            digest: inputs.digest,
            inputs: inputs.written,
            asked: None,
            part,
            starts,
            levels: Vec::new(),
            complete: false,
            seal: String::new(),
        }
    }

    /// Searches the starts of the part that are left, of `starts`, level by level; false if interrupted.
    fn searched(
        &mut self,
        prepared: &PreparedSearch<'_>,
        search: &SequenceSearch<'_>,
        k: usize,
        starts: &[Vec<Stop>],
    ) -> bool {
        let keep = prepared.task.options.keep;
        let [first, end, _] = self.starts;
        let pruning = prepared.pruning(search, k);
        let Some(levels) = search.levels_of(k) else { return false };
        let mut all = Best { complete: true, ..Best::default() };
        for (i, level) in levels.iter().enumerate() {
            if self.levels.len() == i {
                let best = Best { complete: true, ..Best::default() };
                self.levels.push(Level { next: first, best, blocks: Vec::new() });
            }
            let here = &mut self.levels[i];
            while here.next < end {
                let block = here.next..(here.next + BLOCK).min(end);
                let symmetry = &prepared.task.symmetry;
                let done =
                    search.exhaust_starts(&starts[block.clone()], symmetry, k, level, pruning.as_ref());
                if !done.complete {
                    return false;
                }
                here.blocks.push(Block::new(&block, &done));
                here.best.merge(keep, done);
                here.next = block.end;
            }
            all.merge(keep, here.best.clone());
            if all.found.len() >= keep.max(1) {
                break;
            }
        }
        true
    }

    /// Same part with the digest of its contents.
    #[must_use]
    pub fn sealed(mut self) -> Self {
        self.seal.clear();
        self.seal = sha256(&format!("{self:?}"));
        self
    }

    /// Checks the layout, and the contents against their digest.
    ///
    /// # Errors
    /// [`PartError::Layout`] for another layout, [`PartError::Changed`].
    pub fn unchanged(&self) -> Result<(), PartError> {
        if self.schema != PART_SCHEMA {
            let why = format!("schema {}; expected {PART_SCHEMA}", self.schema);
            return Err(PartError::Layout { why });
        }
        if self.clone().sealed().seal == self.seal { Ok(()) } else { Err(PartError::Changed) }
    }

    /// Checks that the part is unchanged and belongs to a search with these inputs.
    pub(crate) fn check(&self, inputs: &Inputs) -> Result<(), PartError> {
        self.unchanged()?;
        let [number, of] = self.part;
        if !(1..=of.min(MOST_PARTS)).contains(&number) {
            return Err(PartError::Layout { why: format!("part {number} of {of}") });
        }
        let own = &inputs.written;
        if self.digest != inputs.digest || self.inputs != *own || Some(&self.version) != own.get("version") {
            return Err(PartError::Foreign { why: differing(&self.inputs, own) });
        }
        Ok(())
    }
}

/// Starts of part `number` of `of`, counted from 1: all parts have about the same work.
pub(crate) fn range(work: &[f64], [number, of]: [usize; 2]) -> Range<usize> {
    let total: f64 = work.iter().sum();
    // middle of a start on the scale of work
    let mut behind = 0.0;
    let middles: Vec<f64> = work
        .iter()
        .map(|work| {
            behind += work;
            (behind - work / 2.0) / total * of as f64
        })
        .collect();
    let to =
        |part: usize| if part == of { work.len() } else { middles.partition_point(|m| *m < part as f64) };
    to(number - 1)..to(number)
}

/// Number of starts of an exhaustive search, which its parts divide. If parts outnumber starts, some
/// parts are empty.
///
/// # Errors
/// [`DesignError`].
pub fn design_starts(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
) -> Result<usize, DesignError> {
    let proceed = || true;
    let conditions = &asked(base, conditions, &options.required)?;
    let prepared = PreparedSearch::new(base, conditions, options, &proceed)?;
    let k = options.positions.filter(|_| options.free.is_none()).ok_or(DesignError::Parts)?;
    Ok(prepared.search(&|_| true).starts(&prepared.task.symmetry, k).len())
}

/// Part `number` of `of` of the exhaustive search, of any size; `resumed` is the result of an
/// interrupted run of the same part. The part is incomplete if interrupted again.
///
/// # Errors
/// [`DesignError`]; [`PartError`] for a part that cannot be continued.
pub fn design_part(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    part: [usize; 2],
    resumed: Option<Part>,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Part, DesignError> {
    let k = options.positions.filter(|_| options.free.is_none()).ok_or(DesignError::Parts)?;
    if !(1..=part[1]).contains(&part[0]) {
        return Err(DesignError::PartNumber { found: part });
    }
    let inputs = Inputs::new(base, conditions, options);
    if let Some(resumed) = &resumed {
        let number = (resumed.part != part)
            .then_some(PartError::Number { found: resumed.part, expected: part })
            .map_or(Ok(()), Err);
        let why = resumed.check(&inputs).and(number);
        why.map_err(|why| DesignError::Part { name: "the part to go on with".into(), why })?;
        if resumed.complete {
            return Ok(resumed.clone());
        }
    }
    let conditions = &asked(base, conditions, &options.required)?;
    watched(progress, |progress, _| {
        let proceed = || progress(NOTHING_YET);
        let prepared = PreparedSearch::new(base, conditions, options, &proceed)?;
        prepared.check(k)?;
        prepared.exhaustible(k)?;
        let search = prepared.search(progress);
        let starts = search.starts(&prepared.task.symmetry, k);
        let own = range(&search.work(&starts, k), part);
        let expected = [own.start, own.end, starts.len()];
        let mut out = resumed.unwrap_or_else(|| Part::begun(inputs, part, expected));
        if out.starts != expected {
            let why = PartError::Starts { found: out.starts, expected, part };
            return Err(DesignError::Part { name: "the part to go on with".into(), why });
        }
        out.complete = out.searched(&prepared, &search, k, &starts);
        Ok(out.sealed())
    })
}

#[cfg(test)]
mod tests {
    use obsdeg_core::model::Carry;

    use super::*;
    use crate::design::Candidates;
    use crate::design::search::exhaust::MOST_BEHIND;

    fn task(carry: Carry, candidates: usize, positions: usize) -> (Scheme, Conditions, DesignOptions) {
        let base = Scheme { carry, latitude: "28.2".parse().ok(), ..Scheme::default() };
        let mut all = Candidates::cardinals();
        all.names.truncate(candidates);
        all.attitudes.truncate(candidates);
        let options = DesignOptions {
            candidates: all,
            positions: Some(positions),
            keep: 5,
            everywhere: false,
            ..DesignOptions::default()
        };
        (base, Conditions::default(), options)
    }

    /// Longer starts give the same sequences and the same number examined.
    #[test]
    fn sequences_do_not_depend_on_the_length_of_starts() {
        for (carry, candidates, k) in [(Carry::Reset, 24, 6), (Carry::Reset, 24, 7), (Carry::Inertial, 24, 5)]
        {
            let (base, conditions, options) = task(carry, candidates, k);
            let prepared = PreparedSearch::new(&base, &conditions, &options, &|| true).expect("a task");
            let search = prepared.search(&|_| true);
            let levels = search.levels_of(k).expect("all sets");
            let symmetry = &prepared.task.symmetry;
            let of = |depth: usize| -> Vec<String> {
                let starts = search.starts_of(depth, symmetry);
                let found = levels.iter().map(|level| {
                    let best = search.exhaust_starts(&starts, symmetry, k, level, None);
                    format!("{} {:?}", best.examined, best.found)
                });
                found.collect()
            };
            let two = of(2);
            assert!(two.iter().any(|t| !t.starts_with("0 ")), "{carry}: {two:?}");
            for depth in [1, 3, 4] {
                assert_eq!(of(depth), two, "{carry} {depth}");
            }
        }
    }

    /// Every start has a bounded number of sequences, under every carry and for many positions.
    #[test]
    fn a_start_is_a_bounded_amount_of_work() {
        for (carry, k) in [(Carry::Reset, 8), (Carry::Reset, 12), (Carry::Reset, 15), (Carry::Inertial, 9)] {
            let (base, conditions, options) = task(carry, 24, k);
            let prepared = PreparedSearch::new(&base, &conditions, &options, &|| true).expect("a task");
            let search = prepared.search(&|_| true);
            let starts = search.starts(&prepared.task.symmetry, k);
            let most = match carry {
                Carry::Reset => search.work(&starts, k).into_iter().fold(0.0, f64::max),
                _ => 24f64.powi((k - starts[0].len()) as i32),
            };
            assert!(
                most <= MOST_BEHIND && starts.len() <= 1_000_000 * 24,
                "{carry} {k}: {most} {}",
                starts.len()
            );
        }
    }
}

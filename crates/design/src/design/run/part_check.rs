//! Checks of a part before it is merged: starts and counts add up, and listed sequences are evaluated
//! again.

use std::collections::BTreeSet;

use obsdeg_exact::SplitMix64;

use crate::design::measure::stop::Stop;
use crate::design::request::error::{DesignError, PartError};
use crate::design::run::part::{BLOCK, Block, Level, Part, range};
use crate::design::run::prepared::PreparedSearch;
use crate::design::search::best::Best;
use crate::design::search::exhaust::{Pruning, SearchLevel};
use crate::design::search::progress::Progress;
use crate::design::search::score::Scored;
use crate::design::search::scoring::{SequenceSearch, candidates};

/// Whole search that parts are compared with.
pub(crate) struct WholeSearch<'a> {
    prepared: &'a PreparedSearch<'a>,
    search: SequenceSearch<'a>,
    k: usize,
    starts: Vec<Vec<Stop>>,
    work: Vec<f64>,
    levels: Vec<SearchLevel>,
    /// True if a bound may exclude sequences.
    prunes: bool,
}

/// Block of a part: index of the part, of the level, of the block.
pub(crate) type BlockIndex = [usize; 3];

impl<'a> WholeSearch<'a> {
    /// Search of `k` positions, without the steps that take long.
    ///
    /// # Errors
    /// [`DesignError::Interrupted`]; [`DesignError`] where sequences are too many.
    pub(crate) fn new(
        prepared: &'a PreparedSearch<'a>,
        k: usize,
        progress: &'a (dyn Fn(Progress) -> bool + Sync),
    ) -> Result<Self, DesignError> {
        prepared.exhaustible(k)?;
        let search = prepared.search(progress);
        let starts = search.starts(&prepared.task.symmetry, k);
        let work = search.work(&starts, k);
        let levels = search.levels_of(k).ok_or(DesignError::Interrupted)?;
        Ok(Self { prepared, k, starts, work, levels, prunes: prepared.prunes(k), search })
    }

    /// Checks that a search of its starts can write this part.
    ///
    /// # Errors
    /// [`PartError`]: the first contradiction found.
    pub(crate) fn check(&self, part: &Part) -> Result<(), PartError> {
        let own = range(&self.work, part.part);
        let expected = [own.start, own.end, self.work.len()];
        if part.starts != expected {
            return Err(PartError::Starts { found: part.starts, expected, part: part.part });
        }
        let done = |level: &Level| level.next == own.end && level.best.complete;
        if !part.complete || !part.levels.iter().all(done) {
            return Err(PartError::Unfinished { part: part.part });
        }
        self.levels_suffice(part)?;
        let starts = &self.starts[own.clone()];
        let behind = starts.iter().map(|start| self.behind(start)).sum::<f64>();
        let mut examined = 0.0;
        for (level, of) in part.levels.iter().zip(&self.levels) {
            blocks_add_up(level, own.start, own.end)?;
            examined += level.best.examined as f64;
            self.lists_hold(level, starts, of)?;
            self.counts_add_up(level, behind)?;
        }
        if examined > behind * ROUNDING {
            return Err(counts(format!("{examined} sequences examined, {behind} exist")));
        }
        Ok(())
    }

    /// Checks that the part ends at the first worst degree with enough sequences, or at the last one.
    fn levels_suffice(&self, part: &Part) -> Result<(), PartError> {
        let enough = self.search.keep.max(1);
        let found = |levels: &[Level]| levels.iter().map(|l| l.best.found.len()).sum::<usize>();
        let count = part.levels.len();
        if count > self.levels.len() {
            return Err(counts(format!("{count} worst degrees; expected at most {}", self.levels.len())));
        }
        let ends = count == self.levels.len() || found(&part.levels) >= enough;
        if !ends {
            return Err(PartError::Unfinished { part: part.part });
        }
        let before = part.levels.split_last().map_or(0, |(_, before)| found(before));
        if before >= enough {
            return Err(counts("worst degrees behind those that suffice".into()));
        }
        Ok(())
    }

    /// Number of sequences that begin with a start; as multisets where order does not matter.
    fn behind(&self, start: &[Stop]) -> f64 {
        let (evaluator, left) = (&self.prepared.evaluator, self.k - start.len());
        let Some(last) = start.last() else { return 0.0 };
        if evaluator.ordered() {
            return evaluator.sequences(&[last.candidate], left + 1).map_or(f64::INFINITY, |n| n as f64);
        }
        let choices = self.search.rows.candidates() - last.candidate;
        (0..left).map(|i| (choices + i) as f64 / (i + 1) as f64).product()
    }

    fn counts_add_up(&self, level: &Level, behind: f64) -> Result<(), PartError> {
        let best = &level.best;
        let seen = best.examined as f64 + best.excluded as f64;
        if seen > behind * ROUNDING {
            return Err(counts(format!("{seen} sequences examined or excluded, {behind} exist")));
        }
        if best.excluded > 0 && !self.prunes {
            return Err(counts(format!("{} sequences excluded by a bound that is not used", best.excluded)));
        }
        let Some(valid) = best.examined.checked_sub(best.lost) else {
            return Err(counts(format!("{} of {} examined sequences lost", best.lost, best.examined)));
        };
        let (found, keep) = (best.found.len() as u64, self.search.keep as u64);
        if found > keep.min(valid) {
            return Err(counts(format!("{found} sequences listed of {valid}, with {keep} to keep")));
        }
        // without requirements and bounds, the list holds as many as there are
        let all_count = best.excluded == 0 && self.search.constraints.sigmas.is_none();
        if all_count && found < keep.min(valid) {
            return Err(counts(format!("{found} sequences listed, {valid} examined, {keep} to keep")));
        }
        let order = self.prepared.task.symmetry.order;
        let images = if self.search.evaluator.ordered() { 1 } else { order };
        let first = best.found.first().map(|f| (f.score.degree, f.score.value));
        let ties = best.ties.first();
        let equal = ties.map(|(degree, value, _)| (degree, value)) == first || keep == 0;
        if !(equal && best.ties.are_tidy(images) && ties.is_none_or(|(_, _, count)| count <= valid)) {
            return Err(counts("the sequences that tie with the first".into()));
        }
        Ok(())
    }

    /// Evaluates the listed sequences again.
    fn lists_hold(&self, level: &Level, starts: &[Vec<Stop>], of: &SearchLevel) -> Result<(), PartError> {
        let best = &level.best;
        let begins: BTreeSet<&[Stop]> = starts.iter().map(Vec::as_slice).collect();
        for scored in best.found.iter().chain(&best.front) {
            let why = self.why_not(scored, &begins, of);
            why.map_or(Ok(()), |why| Err(PartError::Listed { sequence: self.named(scored), why }))?;
        }
        let mut again = Best::default();
        for scored in best.found.iter().chain(&best.front) {
            again.add(self.search.keep, scored.clone());
        }
        if again.found != best.found || again.front != best.front {
            return Err(counts("the lists are not in the order of their criteria".into()));
        }
        Ok(())
    }

    /// Names of the candidates of a sequence.
    fn named(&self, scored: &Scored) -> String {
        let names = &self.prepared.task.candidates.names;
        let name = |s: &Stop| names.get(s.candidate).cloned().unwrap_or_else(|| s.candidate.to_string());
        let shown: Vec<String> = scored.sequence.iter().take(SHOWN).map(name).collect();
        let more = if scored.sequence.len() > SHOWN { " ..." } else { "" };
        format!("{}{more}", shown.join(" "))
    }

    /// Reason why a search of these starts does not list a sequence with this score; `None` if it does.
    fn why_not(&self, scored: &Scored, begins: &BTreeSet<&[Stop]>, level: &SearchLevel) -> Option<String> {
        let (sequence, search) = (&scored.sequence, &self.search);
        let evaluator = search.evaluator;
        if sequence.len() != self.k {
            return Some(format!("{} positions; expected {}", sequence.len(), self.k));
        }
        if let Some(stop) = sequence.iter().find(|s| s.candidate >= search.rows.candidates()) {
            let last = search.rows.candidates() - 1;
            return Some(format!("candidate {}; expected 0 to {last}", stop.candidate));
        }
        let mut tidy = sequence.clone();
        evaluator.tidy(&mut tidy);
        if !evaluator.ordered() {
            tidy.sort_unstable();
        }
        if tidy != *sequence {
            return Some("half turns or an order that the search does not try".into());
        }
        let begin = self.starts.first().map_or(0, Vec::len);
        if !begins.contains(&sequence[..begin]) {
            return Some("a start of another part".into());
        }
        let mut set = candidates(sequence);
        set.sort_unstable();
        set.dedup();
        let degree = search.only_degree().or_else(|| search.worst(search.rows.degrees(&set)));
        let expected = match level {
            SearchLevel::Degree(degree, sets) => Some(*degree).filter(|_| sets.contains(&set)),
            SearchLevel::Any => degree,
        };
        let score = &scored.score;
        if degree != expected || degree != Some(score.degree) {
            let again = degree.map_or_else(|| "none".into(), |d| d.to_string());
            return Some(format!("worst degree {}; judged again: {again}", score.degree));
        }
        let state = evaluator.state_of(sequence);
        let mut root = Vec::new();
        let value = evaluator.value(&state, search.criterion, &mut root);
        if value.to_bits() != score.value.to_bits() {
            return Some(format!("criterion {}; evaluated again: {value}", score.value));
        }
        if state.seconds.to_bits() != scored.seconds.to_bits() {
            return Some(format!("{} s in all; evaluated again: {} s", scored.seconds, state.seconds));
        }
        let violation = search.constraints.violation(evaluator, sequence, &state, &mut root);
        let kept = score.violation == 0.0 && violation == 0.0;
        (!kept).then(|| "a constraint that is not kept".into())
    }

    /// Searches `count` of the blocks again, chosen at random, and returns their number.
    ///
    /// # Errors
    /// [`DesignError::Part`] for a block with another result, [`DesignError::Interrupted`].
    pub(crate) fn search_again(
        &self,
        parts: &[&(String, Part)],
        blocks: Vec<BlockIndex>,
        count: usize,
        random: &mut SplitMix64,
    ) -> Result<usize, DesignError> {
        let chosen = chosen(blocks, count, random);
        if chosen.is_empty() {
            return Ok(0);
        }
        let pruning = self.prepared.pruning(&self.search, self.k);
        let of_one_level = |a: &BlockIndex, b: &BlockIndex| a[..2] == b[..2];
        for group in chosen.chunk_by(of_one_level) {
            let [part, level, _] = group[0];
            let (name, part) = parts[part];
            let (stated, level) = (&part.levels[level], &self.levels[level]);
            let blocks: Vec<&Block> = group.iter().map(|at| &stated.blocks[at[2]]).collect();
            let refused = |why| DesignError::Part { name: name.clone(), why };
            self.level_again(stated, level, &blocks, pruning.as_ref())?.map_err(refused)?;
        }
        Ok(chosen.len())
    }

    /// Searches some blocks of a level again.
    fn level_again(
        &self,
        stated: &Level,
        level: &SearchLevel,
        blocks: &[&Block],
        pruning: Option<&Pruning<'_>>,
    ) -> Result<Result<(), PartError>, DesignError> {
        let mut all = Best { complete: true, ..Best::default() };
        for block in blocks {
            let own = block.starts[0]..block.starts[1];
            let symmetry = &self.prepared.task.symmetry;
            let found =
                self.search.exhaust_starts(&self.starts[own.clone()], symmetry, self.k, level, pruning);
            if !found.complete {
                return Err(DesignError::Interrupted);
            }
            if let Some(why) = differs(block, &Block::new(&own, &found)) {
                return Ok(Err(PartError::Block { starts: block.starts, why }));
            }
            all.merge(self.search.keep, found);
        }
        let every = blocks.len() == stated.blocks.len();
        if (every && all != stated.best) || self.misses(&stated.best, all) {
            let starts = [blocks[0].starts[0], blocks[blocks.len() - 1].starts[1]];
            let why = "the part does not list what they hold".into();
            return Ok(Err(PartError::Block { starts, why }));
        }
        Ok(Ok(()))
    }

    /// True if a part would list other sequences with the results of a block added.
    fn misses(&self, of_part: &Best, of_block: Best) -> bool {
        let mut again = of_part.clone();
        for scored in of_block.found.into_iter().chain(of_block.front) {
            again.add(self.search.keep, scored);
        }
        again.found != of_part.found || again.front != of_part.front
    }
}

/// Relative tolerance of counts in doubles.
const ROUNDING: f64 = 1.0 + 1e-9;
/// Largest number of positions of a sequence in a message.
const SHOWN: usize = 12;

fn counts(why: String) -> PartError {
    PartError::Counts { why }
}

/// Difference in the counts or the digest of a block; `None` if they agree.
fn differs(stated: &Block, found: &Block) -> Option<String> {
    let names = ["examined", "excluded", "lost"].into_iter().zip(stated.counts).zip(found.counts);
    let count = names.into_iter().find(|((_, stated), found)| stated != found);
    let count = count.map(|((name, stated), found)| format!("{found} sequences were {name}, not {stated}"));
    count.or_else(|| (stated.digest != found.digest).then(|| "the best sequences are others".into()))
}

/// Checks that blocks follow each other from the first start to the last, with the counts of the level.
fn blocks_add_up(level: &Level, from: usize, to: usize) -> Result<(), PartError> {
    let (mut next, mut sum) = (from, [0u64; 3]);
    for block in &level.blocks {
        if block.starts != [next, (next + BLOCK).min(to)] || next == to {
            return Err(counts(format!("block of starts {:?} behind start {next}", block.starts)));
        }
        next = block.starts[1];
        for (sum, count) in sum.iter_mut().zip(block.counts) {
            *sum = sum.saturating_add(count);
        }
    }
    let best = &level.best;
    let all = [best.examined, best.excluded, best.lost];
    if next != to || sum != all {
        return Err(counts(format!("blocks up to start {next} with {sum:?}; expected {to}, {all:?}")));
    }
    Ok(())
}

/// Random choice of `count` of the blocks, in their order.
fn chosen(mut blocks: Vec<BlockIndex>, count: usize, random: &mut SplitMix64) -> Vec<BlockIndex> {
    while blocks.len() > count {
        let place = random.below(blocks.len() as u64) as usize;
        blocks.swap_remove(place);
    }
    blocks.sort_unstable();
    blocks
}

//! Finding schemes: the fewest positions, and the best of a number of positions.
//!
//! Sets of candidates are first judged exactly ([`observability`]); those that make the required unknowns observable are then
//! ranked by the largest sigma of a coefficient ([`information`]), in every order where the carry makes order matter.

pub mod answer;
pub mod information;
pub mod observability;

use std::collections::HashSet;
use std::sync::atomic::{AtomicU64, Ordering};

use obsdeg_ekf::EkfError;
use obsdeg_exact::SplitMix64;
use rayon::prelude::*;

pub use answer::Design;

use crate::degree::ensemble::{EnsembleError, judge};
use crate::model::attitude::Euler;
use crate::model::{Carry, Platform, Scheme, SchemeError};
use crate::simulation::conditions::Conditions;
use answer::{Found, Minimum, SCHEMA};
use information::{Criterion, Evaluator, State};
use observability::Rows;

/// Most sequences that are searched exhaustively.
pub const EXHAUSTIVE: u64 = 50_000_000;
/// Rounds of one exchange before it is given up.
const ROUNDS: usize = 50;

/// Why no scheme is found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// Nothing to choose from.
    #[error("{found} candidates; expected at least one and at most 64")]
    Candidates {
        /// Their number.
        found: usize,
    },
    /// A number of positions that cannot be.
    #[error("{found} positions; expected 1 to 100")]
    Positions {
        /// The number asked for.
        found: usize,
    },
    /// The drift itself is constant at one position only.
    #[error("a design needs coefficients; found the unknowns `drift` (use terms such as F,I,O,S)")]
    Drift,
    /// A generic angle has no sigma.
    #[error("the angle `{name}` is generic; expected numbers for a design")]
    GenericAngle {
        /// Its name.
        name: String,
    },
    /// Too many coefficients.
    #[error("{found} unknowns; expected at most {}", information::MAX)]
    TooManyUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// No set of that many candidates does.
    #[error("no scheme of {positions} of these candidates makes every coefficient observable")]
    Impossible {
        /// The number of positions.
        positions: usize,
    },
    /// The scheme.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// No verdict.
    #[error(transparent)]
    Verdict(#[from] EnsembleError),
    /// A number is not finite.
    #[error(transparent)]
    Filter(#[from] EkfError),
}

/// What is to be found.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Names of the candidates.
    pub names: Vec<String>,
    /// Their attitudes.
    pub candidates: Vec<Euler>,
    /// Number of positions; `None`: only the minimum is asked for.
    pub positions: Option<usize>,
    /// Dwell of each position, in s.
    pub dwell_s: f64,
    /// What makes one scheme better than another.
    pub criterion: Criterion,
    /// How many schemes are listed.
    pub keep: usize,
    /// Restarts of the exchange, where the space is too large for exhaustion.
    pub restarts: u64,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Finds schemes under the assumptions of `base` (its positions do not matter). `progress` hears `(done, total, best)`
/// and says whether to go on.
///
/// # Errors
/// [`DesignError`].
pub fn design(
    base: &Scheme,
    conditions: &Conditions,
    options: &Options,
    progress: &(dyn Fn(u64, u64, f64) -> bool + Sync),
) -> Result<Design, DesignError> {
    let found = options.candidates.len();
    if !(1..=64).contains(&found) {
        return Err(DesignError::Candidates { found });
    }
    if let Some(found) = options.positions.filter(|k| !(1..=100).contains(k)) {
        return Err(DesignError::Positions { found });
    }
    if base.unknowns == crate::model::Unknowns::Drift {
        return Err(DesignError::Drift);
    }
    let generic = options.candidates.iter().flatten().find_map(|a| a.generic());
    if let Some((name, _)) = generic {
        return Err(DesignError::GenericAngle { name: name.into() });
    }
    let rows = Rows::new(base, &options.candidates, options.seed)?;
    let minimum = minimum(&rows, options);
    let below = minimum.iter().flat_map(|m| &m.none_of).map(|[_, sets]| *sets as f64).sum::<f64>();
    let mut out = Design {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        carry: base.carry,
        latitude_deg: crate::simulation::conditions::latitude_of(base).map_or(0.0, |l| l.degrees()),
        candidates: options.names.clone(),
        minimum,
        positions: options.positions,
        dwell_s: options.dwell_s,
        criterion: options.criterion.name().into(),
        found: Vec::new(),
        examined: 0,
        proven: false,
        order_matters: base.carry != Carry::Reset,
        interrupted: false,
        error_bound: below * rows.miss,
        seed: options.seed,
    };
    let Some(k) = options.positions else { return Ok(out) };
    let evaluator = Evaluator::new(base, &options.candidates, conditions, options.dwell_s)?;
    let space = sequences(found as u64, k as u64, evaluator.ordered());
    let search = Search {
        evaluator: &evaluator,
        criterion: &options.criterion,
        progress,
        done: AtomicU64::new(0),
        keep: options.keep,
    };
    let best = match space {
        Some(total) if total <= EXHAUSTIVE => {
            out.proven = true;
            out.error_bound +=
                sequences(found as u64, k as u64, false).map_or(f64::INFINITY, |s| s as f64) * rows.miss;
            let sets = rows.observable_sets(k);
            search.exhaust(&sets, k)
        }
        _ => search.exchange(found, k, options),
    };
    out.examined = search.done.load(Ordering::Relaxed);
    out.interrupted = !best.complete;
    out.proven &= best.complete;
    for (value, sequence) in best.found {
        // rounding may call a sequence determined that is not: the exact verdict has the last word
        let Some(rank) = rank_of(base, options, &sequence)? else { continue };
        out.found.push(Found {
            positions: sequence.iter().map(|&c| options.names[c].clone()).collect(),
            value,
            worst_sigma_dph: evaluator.of_sequence(&sequence, &Criterion::Worst),
            rank,
        });
    }
    if out.found.is_empty() {
        return Err(DesignError::Impossible { positions: k });
    }
    Ok(out)
}

/// Rank and number of unknowns of a sequence, exactly; `None` when a coefficient is not observable.
fn rank_of(base: &Scheme, options: &Options, sequence: &[usize]) -> Result<Option<[usize; 2]>, DesignError> {
    let positions = Scheme::of_angles(sequence.iter().map(|&c| options.candidates[c].clone())).positions;
    let platform = Platform::new(Scheme { positions, combinations: Vec::new(), ..base.clone() })?;
    let degrees = judge(&platform, options.seed)?.degrees;
    let mut coefficients = platform.units().iter().zip(&degrees.degree).filter(|(unit, _)| **unit != "rad");
    let all = coefficients.all(|(_, degree)| degree.is_some());
    Ok(all.then(|| [degrees.rank(), platform.names().len()]))
}

/// The fewest candidates that do, with the proof.
fn minimum(rows: &Rows, options: &Options) -> Option<Minimum> {
    let bound = rows.counting_bound();
    let mut examined = Vec::new();
    for size in bound..=rows.candidates() {
        match rows.first_observable_set(size) {
            Some(set) => {
                return Some(Minimum {
                    positions: size,
                    witness: set.iter().map(|&c| options.names[c].clone()).collect(),
                    counting_bound: bound,
                    none_of: examined,
                });
            }
            None => examined.push([
                size as u64,
                sequences(rows.candidates() as u64, size as u64, false).unwrap_or(u64::MAX),
            ]),
        }
    }
    None
}

/// Ordered sequences or sets of `k` different ones of `n`; `None` beyond 2^64.
fn sequences(n: u64, k: u64, ordered: bool) -> Option<u64> {
    if k > n {
        return None;
    }
    let ordered_count = (0..k).try_fold(1u64, |product, i| product.checked_mul(n - i))?;
    Some(if ordered {
        ordered_count
    } else {
        ordered_count / (1..=k).try_fold(1u64, |p, i| p.checked_mul(i))?
    })
}

/// The candidates of a set as bits.
fn mask(set: &[usize]) -> u64 {
    set.iter().fold(0, |m, &c| m | 1 << c)
}

/// A depth-first walk over sequences.
struct Walk<'a> {
    evaluator: &'a Evaluator,
    criterion: &'a Criterion,
    masks: &'a HashSet<u64>,
    candidates: usize,
    k: usize,
    keep: usize,
    states: Vec<State>,
    root: Vec<f64>,
    sequence: Vec<usize>,
    best: Vec<(f64, Vec<usize>)>,
    examined: u64,
}

impl Walk<'_> {
    fn push(&mut self, candidate: usize) {
        let (before, after) = self.states.split_at_mut(self.sequence.len() + 1);
        self.evaluator.extend(&before[self.sequence.len()], candidate, &mut after[0]);
        self.sequence.push(candidate);
    }

    fn visit(&mut self, used: u64) {
        let depth = self.sequence.len();
        if depth == self.k {
            let sigma = self.evaluator.value(&self.states[depth], self.criterion, &mut self.root);
            self.examined += 1;
            let full = self.best.len() >= self.keep;
            if sigma.is_finite() && (!full || self.best.last().is_some_and(|b| sigma < b.0)) {
                let place = self.best.partition_point(|b| b.0 <= sigma);
                self.best.insert(place, (sigma, self.sequence.clone()));
                self.best.truncate(self.keep);
            }
            return;
        }
        let last = depth + 1 == self.k;
        for c in 0..self.candidates {
            let bit = 1u64 << c;
            if used & bit == 0 && (!last || self.masks.contains(&(used | bit))) {
                self.push(c);
                self.visit(used | bit);
                self.sequence.pop();
            }
        }
    }
}

struct Search<'a> {
    evaluator: &'a Evaluator,
    criterion: &'a Criterion,
    progress: &'a (dyn Fn(u64, u64, f64) -> bool + Sync),
    done: AtomicU64,
    keep: usize,
}

/// The best sequences, best first.
struct Best {
    found: Vec<(f64, Vec<usize>)>,
    /// Whether everything was searched.
    complete: bool,
}

impl Search<'_> {
    /// All observable sets: as they are, or in all their orders, with the information of every prefix computed once.
    fn exhaust(&self, sets: &[Vec<usize>], k: usize) -> Best {
        let masks: HashSet<u64> = sets.iter().map(|s| mask(s)).collect();
        // what a worker does: the sequences that start with these candidates
        let starts: Vec<Vec<usize>> = if !self.evaluator.ordered() {
            sets.to_vec()
        } else if k == 1 {
            (0..64).filter(|c| masks.contains(&(1 << c))).map(|c| vec![c]).collect()
        } else {
            let all: Vec<usize> = (0..64).filter(|c| sets.iter().any(|s| s.contains(c))).collect();
            all.iter().flat_map(|&a| all.iter().filter(move |&&b| a != b).map(move |&b| vec![a, b])).collect()
        };
        let candidates = sets.iter().flatten().max().map_or(0, |m| m + 1);
        let total = starts.len() as u64;
        let (mut found, mut complete, mut begun) = (Vec::new(), true, 0);
        for batch in starts.chunks(64) {
            let parts: Vec<Vec<(f64, Vec<usize>)>> = batch
                .par_iter()
                .map(|start| {
                    let mut walk = Walk {
                        evaluator: self.evaluator,
                        criterion: self.criterion,
                        masks: &masks,
                        candidates,
                        k,
                        keep: self.keep,
                        states: (0..=k).map(|_| self.evaluator.start()).collect(),
                        root: Vec::new(),
                        sequence: Vec::with_capacity(k),
                        best: Vec::new(),
                        examined: 0,
                    };
                    for &c in start {
                        walk.push(c);
                    }
                    walk.visit(mask(start));
                    self.done.fetch_add(walk.examined, Ordering::Relaxed);
                    walk.best
                })
                .collect();
            self.merge(&mut found, parts.into_iter().flatten());
            begun += batch.len() as u64;
            if !(self.progress)(begun, total, found.first().map_or(f64::INFINITY, |b| b.0)) && begun < total {
                complete = false;
                break;
            }
        }
        Best { found, complete }
    }

    /// Coordinate exchange from random starts: each place of the sequence takes the candidate that is best there, until
    /// none helps. Candidates may be repeated.
    fn exchange(&self, candidates: usize, k: usize, options: &Options) -> Best {
        let (mut found, mut complete) = (Vec::new(), true);
        let starts: Vec<u64> = (0..options.restarts).collect();
        for batch in starts.chunks(16) {
            let parts: Vec<(f64, Vec<usize>)> = batch
                .par_iter()
                .map(|&restart| {
                    let mut rng = SplitMix64::new(options.seed ^ restart.wrapping_mul(0x9e37_79b9_7f4a_7c15));
                    let mut now: Vec<usize> = (0..k).map(|_| rng.below(candidates as u64) as usize).collect();
                    let mut sigma = self.evaluator.of_sequence(&now, self.criterion);
                    for _ in 0..ROUNDS {
                        let before = sigma;
                        for place in 0..k {
                            let kept = now[place];
                            let mut best = kept;
                            for c in 0..candidates {
                                now[place] = c;
                                let other = self.evaluator.of_sequence(&now, self.criterion);
                                if other < sigma {
                                    (sigma, best) = (other, c);
                                }
                            }
                            now[place] = best;
                        }
                        self.done.fetch_add((k * candidates) as u64, Ordering::Relaxed);
                        if sigma >= before {
                            break;
                        }
                    }
                    (sigma, now)
                })
                .collect();
            self.merge(&mut found, parts.into_iter().filter(|p| p.0.is_finite()));
            let done = batch.last().map_or(0, |r| r + 1);
            let best = found.first().map_or(f64::INFINITY, |b| b.0);
            if !(self.progress)(done, options.restarts, best) && done < options.restarts {
                complete = false;
                break;
            }
        }
        Best { found, complete }
    }

    /// Keeps the best, ties in lexicographic order, each once.
    fn merge(&self, found: &mut Vec<(f64, Vec<usize>)>, more: impl Iterator<Item = (f64, Vec<usize>)>) {
        found.extend(more);
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
        found.dedup_by(|a, b| a.1 == b.1);
        found.truncate(self.keep);
    }
}

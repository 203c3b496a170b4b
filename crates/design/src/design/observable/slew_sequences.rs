//! Fewest positions where torquer errors act in every turn. A scheme is then a slew sequence over
//! candidates: the rows of a position depend on all turns before it.
//!
//! In n a position at `C_i`, with `J` the sum of the effects of all turns so far on `psi^n`, adds the
//! rows `[r_psi | r_psi J + B_i]` of the local chain, `B_i = r_eps E_i + r_a A_i`: six at most.
//! Sequences are enumerated depth first with the echelon bases of their beginnings. A branch ends where
//! even six more rows in every further position are not enough. A sequence that is found is exact for
//! any prime; the statement that no shorter one exists has a stated error bound.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use obsdeg_core::degree::{EnsembleError, local_chain};
use obsdeg_core::model::settings::concerns;
use obsdeg_core::model::slew::{rotation_vector, times, transpose};
use obsdeg_core::model::{
    Carry, ErrorSource, Euler, Gimbals, LOCAL, Matrix3, Path, Platform, RandomValues, Scheme, c_n_f64,
    parse_attitude,
};
use obsdeg_exact::certainty::{RankClaim, error_bound};
use obsdeg_exact::parallel;
use obsdeg_exact::{Echelon, Field, SplitMix64};
use schemars::JsonSchema;
use serde::Serialize;

use crate::design::request::candidates::Candidates;
use crate::design::request::error::DesignError;
use crate::design::request::limits::PROOF;

/// Name and version of the JSON layout.
const SLEW_SEQUENCE_SCHEMA: &str = "obsdeg.walks/1";
/// Largest number of slew sequences of one length that are examined.
const MOST_SEQUENCES: u64 = 100_000_000;
/// Largest number of candidates: every turn between two of them is a position of the tour.
const MOST_TURNS: usize = 900;
/// Beam width: sequences of each length that are extended in the search for a short one.
const BEAM: usize = 400;
/// Largest number of positions of a slew sequence.
const LONGEST: usize = 40;
/// Number of slew sequences between two calls of the cancellation callback.
const PATIENCE: u64 = 256;

/// Options of a search for the shortest slew sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct SlewSequenceOptions {
    /// Candidate attitudes.
    pub candidates: Candidates,
    /// Coefficients or families that must be observable; if empty, all coefficients.
    pub required: Vec<String>,
    /// Largest turn from one position to the next, in degrees.
    pub most_turn_deg: f64,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Shortest slew sequence that makes every required coefficient observable.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Walks")]
pub struct ShortestSlewSequence {
    /// Layout of this answer: `obsdeg.walks/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Terms of the error model that are unknown besides psi.
    pub terms: String,
    /// Candidate attitudes of the search.
    pub candidates: Vec<String>,
    /// Largest turn from one position to the next, in degrees, about one axis by the shortest path.
    pub most_turn_deg: f64,
    /// Number of turns between candidates up to this size.
    pub turns: usize,
    /// Coefficients that must be observable.
    pub required: Vec<String>,
    /// Number of positions of the shortest slew sequence that was found; null if none was.
    pub positions: Option<usize>,
    /// Slew sequence that makes all required coefficients observable: its candidates, in order; empty if none
    /// was found.
    #[serde(rename = "walk")]
    pub sequence: Vec<String>,
    /// Euler angles of its positions, in degrees.
    pub angles: Vec<String>,
    /// Rank of the slew sequence, then the number of unknowns.
    pub rank: [usize; 2],
    /// Latitude of the scheme in degrees; null when generic.
    pub latitude_deg: Option<f64>,
    /// Coefficients that even the tour of all turns leaves unobservable; then no slew sequence is searched.
    pub never: Vec<String>,
    /// Number of positions below which no slew sequence is enough: the required coefficients over the rows of
    /// a position, rounded up.
    pub counting_bound: usize,
    /// Largest number of independent rows that a position adds.
    pub rows_per_position: usize,
    /// Slew sequences excluded by exhaustion: `[positions, number of sequences]`, none of which is enough.
    pub none_of: Vec<[u64; 2]>,
    /// True if `positions` is proven minimal for these candidates and turns: no shorter sequence was left
    /// out, and the bound on the probability of an error is below 1e-12.
    pub proven: bool,
    /// True if the search was interrupted.
    pub interrupted: bool,
    /// Bound on the probability that a sufficient slew sequence was overlooked.
    pub error_bound: f64,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Rows of all candidates and turns in one field.
struct TourRows {
    field: Field,
    /// Rows of the local chain on psi (3 each), by candidate; `rows` are theirs on the coefficients.
    of_psi: Vec<[u64; 3]>,
    rows: Vec<Vec<Vec<u64>>>,
    /// Effect of a turn on `psi^n` (3 rows on the coefficients), by the index of the turn.
    turns: Vec<[Vec<u64>; 3]>,
    coefficients: usize,
}

/// Slew sequence with its echelon basis.
#[derive(Clone)]
struct SlewSequence {
    places: Vec<usize>,
    /// Sum `J` of the effects of the turns so far on `psi^n`.
    torqued: [Vec<u64>; 3],
    basis: Echelon,
}

impl TourRows {
    fn new(tour: &Platform, values: &RandomValues, first_visit: &[usize], turn_at: &[usize]) -> Self {
        let sample = values.sample(tour.scheme(), 1);
        let (f, point) = (sample.point.ring, &sample.point);
        let chain = local_chain(&f, point.w_n, point.w_u, tour.observed());
        let blocks = tour.blocks(point);
        let d = tour.coefficients();
        let rows = first_visit.iter().map(|&i| {
            let row = |row: &[u64; LOCAL]| -> Vec<u64> {
                let mut without_psi = *row;
                without_psi[..3].fill(0);
                (0..d).map(|k| blocks[i].entry(&f, &without_psi, 3 + k)).collect()
            };
            chain.iter().map(|local| row(&local.row)).collect()
        });
        let jump = |i: usize, r: usize| -> Vec<u64> {
            let (after, before) = (&blocks[i].rows[r][3..], &blocks[i - 1].rows[r][3..]);
            after.iter().zip(before).map(|(a, b)| f.sub(*a, *b)).collect()
        };
        Self {
            field: f,
            of_psi: chain.iter().map(|local| [local.row[0], local.row[1], local.row[2]]).collect(),
            rows: rows.collect(),
            turns: turn_at.iter().map(|&i| std::array::from_fn(|r| jump(i, r))).collect(),
            coefficients: d,
        }
    }

    fn start(&self, place: usize) -> SlewSequence {
        let zero = vec![0; self.coefficients];
        let torqued = [zero.clone(), zero.clone(), zero];
        let basis = Echelon::new(self.field, 3 + self.coefficients);
        let mut sequence = SlewSequence { places: Vec::new(), torqued, basis };
        self.arrive(&mut sequence, place);
        sequence
    }

    fn arrive(&self, sequence: &mut SlewSequence, place: usize) {
        let f = &self.field;
        sequence.places.push(place);
        let mut row = vec![0; 3 + self.coefficients];
        for (psi, rest) in self.of_psi.iter().zip(&self.rows[place]) {
            row[..3].copy_from_slice(psi);
            for (k, slot) in row[3..].iter_mut().enumerate() {
                *slot = f.dot(rest[k], (0..3).map(|r| (psi[r], sequence.torqued[r][k])));
            }
            sequence.basis.insert(&row);
        }
    }

    fn go(&self, sequence: &SlewSequence, turn: usize, to: usize) -> SlewSequence {
        let mut next = sequence.clone();
        for (sum, left) in next.torqued.iter_mut().zip(&self.turns[turn]) {
            for (x, y) in sum.iter_mut().zip(left) {
                *x = self.field.add(*x, *y);
            }
        }
        self.arrive(&mut next, to);
        next
    }
}

/// Data of a search, shared by all its branches.
struct SlewSequenceSearch {
    fields: [TourRows; 2],
    /// Candidates that one turn leads to, by candidate: `(turn, candidate)`.
    neighbours: Vec<Vec<(usize, usize)>>,
    required: Vec<usize>,
    /// Largest number of rows that a position adds.
    most: usize,
    /// Order of the roots of unity in the fields.
    order: u64,
}

impl SlewSequenceSearch {
    /// Search over the candidates that a tour visits; `neighbours` are the candidates that one turn leads to.
    ///
    /// # Errors
    /// [`DesignError`] if no random point was found.
    fn new(
        platform: &Platform,
        tour: &[usize],
        neighbours: &[Vec<usize>],
        required: Vec<usize>,
        seed: u64,
    ) -> Result<Self, DesignError> {
        let visit = |c: usize| tour.iter().position(|x| *x == c).unwrap_or(0);
        let first_visit: Vec<usize> = (0..neighbours.len()).map(visit).collect();
        let place = |from: usize, to: usize| tour.windows(2).position(|w| w == [from, to]).map(|i| i + 1);
        let pairs =
            neighbours.iter().enumerate().flat_map(|(from, list)| list.iter().map(move |to| (from, *to)));
        let turn_at: Vec<usize> = pairs.filter_map(|(from, to)| place(from, to)).collect();
        let mut number = 0;
        let mut numbered = |to: &usize| {
            number += 1;
            (number - 1, *to)
        };
        let neighbours: Vec<Vec<(usize, usize)>> =
            neighbours.iter().map(|list| list.iter().map(&mut numbered).collect()).collect();
        let mut rng = platform.scheme().random(seed, "walks");
        let values = [
            RandomValues::draw(platform.scheme(), &mut rng),
            RandomValues::draw(platform.scheme(), &mut rng),
        ];
        let [first, second] = values;
        let (first, second) = (first.map_err(EnsembleError::from)?, second.map_err(EnsembleError::from)?);
        let order = first.roots().order;
        let fields = [first, second].map(|v| TourRows::new(platform, &v, &first_visit, &turn_at));
        let most = fields[0].of_psi.len();
        Ok(Self { fields, neighbours, required, most, order })
    }

    /// Decision that no sequence of `length` positions is sufficient, for the bound on errors.
    fn claim(&self, length: usize) -> RankClaim {
        RankClaim {
            unknowns: 3 + self.fields[0].coefficients,
            decisions: self.required.len(),
            order: self.order,
            row_degree: 4,
            // as for a verdict, with turns given as multiples of half a turn
            row_bits: 60.0 + (length as f64).log2(),
        }
    }

    /// First sufficient slew sequence of these lengths, and true if no shorter one was left out. Lengths that
    /// are excluded, and an interruption, are noted in `out`.
    fn exhausted(
        &self,
        lengths: Range<usize>,
        out: &mut ShortestSlewSequence,
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> (Option<Vec<usize>>, bool) {
        for length in lengths {
            let count = self.sequences(length);
            if count > MOST_SEQUENCES {
                return (None, false);
            }
            let seen = AtomicU64::new(0);
            let stopped = AtomicBool::new(false);
            let proceed = || {
                let go = !stopped.load(Ordering::Relaxed) && proceed();
                stopped.fetch_or(!go, Ordering::Relaxed);
                go
            };
            let found = parallel::find_first(self.neighbours.len(), |c| {
                self.search(&self.fields[0].start(c), length, &seen, &proceed)
            });
            if found.is_some() {
                return (found, true);
            }
            if stopped.load(Ordering::Relaxed) {
                out.interrupted = true;
                return (None, false);
            }
            out.none_of.push([length as u64, count]);
            out.error_bound += count as f64 * error_bound(&self.claim(length), 2);
        }
        (None, true)
    }

    fn does(&self, basis: &Echelon) -> bool {
        self.required.iter().all(|c| basis.has_unit(3 + c))
    }

    /// First sufficient slew sequence of `length` positions that begins with `sequence`.
    fn search(
        &self,
        sequence: &SlewSequence,
        length: usize,
        seen: &AtomicU64,
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> Option<Vec<usize>> {
        if sequence.places.len() == length {
            if seen.fetch_add(1, Ordering::Relaxed).is_multiple_of(PATIENCE) && !proceed() {
                return None;
            }
            return (self.does(&sequence.basis) || self.does_elsewhere(&sequence.places))
                .then(|| sequence.places.clone());
        }
        let left = length - sequence.places.len();
        // every required coefficient needs a row of its own
        if sequence.basis.rank() + self.most * left < self.required.len() || !proceed() {
            return None;
        }
        let here = *sequence.places.last()?;
        let next = |&(turn, to): &(usize, usize)| {
            self.search(&self.fields[0].go(sequence, turn, to), length, seen, proceed)
        };
        if sequence.places.len() < 4 {
            let neighbours = &self.neighbours[here];
            parallel::find_first(neighbours.len(), |i| next(&neighbours[i]))
        } else {
            self.neighbours[here].iter().find_map(next)
        }
    }

    /// True if the sequence is sufficient in the second field.
    fn does_elsewhere(&self, places: &[usize]) -> bool {
        let field = &self.fields[1];
        let Some((&first, rest)) = places.split_first() else { return false };
        let mut sequence = field.start(first);
        for &to in rest {
            let here = sequence.places[sequence.places.len() - 1];
            let Some(&(turn, _)) = self.neighbours[here].iter().find(|n| n.1 == to) else { return false };
            sequence = field.go(&sequence, turn, to);
        }
        self.does(&sequence.basis)
    }

    /// Sequence through the given candidates in the first field; a candidate that no turn leads to
    /// begins a new one.
    fn along(&self, places: &[usize]) -> SlewSequence {
        let field = &self.fields[0];
        let mut sequence = field.start(places[0]);
        for &to in &places[1..] {
            let here = sequence.places[sequence.places.len() - 1];
            match self.neighbours[here].iter().find(|n| n.1 == to) {
                Some(&(turn, _)) => sequence = field.go(&sequence, turn, to),
                None => field.arrive(&mut sequence, to),
            }
        }
        sequence
    }

    /// Number of slew sequences of `length` positions.
    fn sequences(&self, length: usize) -> u64 {
        let n = self.neighbours.len();
        let mut ends = vec![1u64; n];
        for _ in 1..length {
            let mut next = vec![0u64; n];
            for (from, list) in self.neighbours.iter().enumerate() {
                list.iter().for_each(|(_, to)| next[*to] = next[*to].saturating_add(ends[from]));
            }
            ends = next;
        }
        ends.into_iter().fold(0, u64::saturating_add)
    }

    /// Short sufficient slew sequence, by beam search.
    fn short(&self, seed: u64, proceed: &(dyn Fn() -> bool + Sync)) -> Option<SlewSequence> {
        let mut rng = SplitMix64::new(seed);
        let mut beam: Vec<SlewSequence> =
            (0..self.neighbours.len()).map(|c| self.fields[0].start(c)).collect();
        for _ in 1..LONGEST {
            if let Some(done) = beam.iter().find(|w| self.does(&w.basis)) {
                return Some(done.clone());
            }
            if !proceed() {
                return None;
            }
            let grown = |sequence: &SlewSequence| -> Vec<SlewSequence> {
                let here = sequence.places[sequence.places.len() - 1];
                self.neighbours[here]
                    .iter()
                    .map(|&(turn, to)| self.fields[0].go(sequence, turn, to))
                    .collect()
            };
            let next: Vec<SlewSequence> = parallel::map(beam.len(), |i| grown(&beam[i])).concat();
            let mut order: Vec<(usize, u64, usize)> = next
                .iter()
                .enumerate()
                .map(|(i, w)| (usize::MAX - w.basis.rank(), rng.next_u64(), i))
                .collect();
            order.sort_unstable();
            beam = order.into_iter().take(BEAM).map(|(.., i)| next[i].clone()).collect();
        }
        None
    }
}

/// Finds the fewest positions of a slew sequence over candidates that makes the required coefficients
/// observable under the assumptions of `base`. Its carry must be inertial and its torquer errors
/// unknown. Stops when `proceed` returns false.
///
/// # Errors
/// [`DesignError`].
pub fn shortest_slew_sequence(
    base: &Scheme,
    options: &SlewSequenceOptions,
    proceed: &(dyn Fn() -> bool + Sync),
) -> Result<ShortestSlewSequence, DesignError> {
    let attitudes = &options.candidates.attitudes;
    let (neighbours, tour) = tour(attitudes, options.most_turn_deg);
    let turns: usize = neighbours.iter().map(Vec::len).sum();
    if turns == 0 || turns > MOST_TURNS {
        return Err(DesignError::Turns { found: turns, most: MOST_TURNS });
    }
    let platform = along_tour(base, attitudes, &tour)?;
    let all = &platform.names()[3..];
    let required = required(all, &options.required)?;
    let space = SlewSequenceSearch::new(&platform, &tour, &neighbours, required, options.seed)?;
    let whole = space.along(&tour);
    let lost = space.required.iter().filter(|c| !whole.basis.has_unit(3 + **c));
    let never: Vec<String> = lost.map(|&c| all[c].clone()).collect();
    let shortest = if never.is_empty() { space.short(options.seed, proceed) } else { None };
    let longest = shortest.as_ref().map_or(LONGEST, |w| w.places.len());
    let mut out = ShortestSlewSequence {
        schema: SLEW_SEQUENCE_SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        terms: base.unknowns.to_string(),
        candidates: options.candidates.names.clone(),
        most_turn_deg: options.most_turn_deg,
        turns,
        required: space.required.iter().map(|&c| all[c].clone()).collect(),
        positions: None,
        sequence: Vec::new(),
        angles: Vec::new(),
        rank: [0, 3 + space.fields[0].coefficients],
        latitude_deg: base.latitude.map(|l| l.degrees()),
        never,
        counting_bound: space.required.len().div_ceil(space.most).max(1),
        rows_per_position: space.most,
        none_of: Vec::new(),
        proven: false,
        interrupted: false,
        error_bound: 0.0,
        seed: options.seed,
    };
    let lengths = if out.never.is_empty() { out.counting_bound..longest } else { 0..0 };
    let (shorter, complete) = space.exhausted(lengths, &mut out, proceed);
    if let Some(places) = shorter.or(shortest.map(|w| w.places)) {
        out.positions = Some(places.len());
        out.rank[0] = space.along(&places).basis.rank();
        let angles = |&c: &usize| obsdeg_core::model::angles_text(&attitudes[c]);
        out.angles = places.iter().map(angles).collect();
        out.sequence = places.iter().map(|&c| options.candidates.names[c].clone()).collect();
    }
    out.proven = complete && out.positions.is_some() && out.error_bound < PROOF;
    Ok(out)
}

/// Platform at the candidates of a tour, one after the other.
fn along_tour(base: &Scheme, attitudes: &[Euler], tour: &[usize]) -> Result<Platform, DesignError> {
    let positions = Scheme::of_angles(tour.iter().map(|&c| attitudes[c].clone())).positions;
    let scheme = Scheme {
        positions,
        path: Some(Path::OneAxis),
        combinations: Vec::new(),
        gimbals: Gimbals::default(),
        ..base.clone()
    };
    Ok(Platform::new(scheme)?)
}

/// Indices of the coefficients that must be observable: those asked for, by default all.
fn required(all: &[String], asked_for: &[String]) -> Result<Vec<usize>, DesignError> {
    let asked = |name: &String| asked_for.is_empty() || asked_for.iter().any(|r| concerns(r, name));
    if let Some(found) = asked_for.iter().find(|r| !all.iter().any(|name| concerns(r, name))) {
        return Err(DesignError::UnknownName { found: found.clone(), known: all.join(", ") });
    }
    Ok((0..all.len()).filter(|&c| asked(&all[c])).collect())
}

/// Slew sequence as a scheme under the assumptions of `base`; `None` where none was found.
pub fn scheme_of_slew_sequence(found: &ShortestSlewSequence, base: &Scheme) -> Option<Scheme> {
    let attitudes: Result<Vec<Euler>, _> = found.angles.iter().map(|a| parse_attitude(a)).collect();
    let positions = Scheme::of_angles(attitudes.ok()?).positions;
    (!positions.is_empty()).then(|| Scheme { positions, path: Some(Path::OneAxis), ..base.clone() })
}

/// Candidates that a turn of at most `most_turn_deg` degrees leads to, by candidate, and a tour that
/// contains every such turn.
fn tour(attitudes: &[Euler], most_turn_deg: f64) -> (Vec<Vec<usize>>, Vec<usize>) {
    let matrices: Vec<Matrix3<f64>> = attitudes.iter().map(c_n_f64).collect();
    let angle = |i: usize, j: usize| {
        let v = rotation_vector(&times(&matrices[j], &transpose(&matrices[i])));
        v.iter().map(|x| x * x).sum::<f64>().sqrt().to_degrees()
    };
    let near = |i: usize| -> Vec<usize> {
        (0..attitudes.len()).filter(|&j| j != i && angle(i, j) <= most_turn_deg + 1e-6).collect()
    };
    let neighbours: Vec<Vec<usize>> = (0..attitudes.len()).map(near).collect();
    // Hierholzer: every candidate has as many turns to it as away from it
    let mut left = neighbours.clone();
    let mut tour = Vec::new();
    for start in 0..attitudes.len() {
        let (mut stack, mut circuit) = (vec![start], Vec::new());
        while let Some(&here) = stack.last() {
            match left[here].pop() {
                Some(to) => stack.push(to),
                None => circuit.extend(stack.pop()),
            }
        }
        if circuit.len() > 1 || !tour.contains(&start) {
            circuit.reverse();
            tour.extend(circuit);
        }
    }
    (neighbours, tour)
}

/// True if torquer errors act in the turns of `base`: then [`shortest_slew_sequence`] finds schemes, and no
/// search over sets does.
pub fn is_slew_sequence(base: &Scheme) -> bool {
    base.carry == Carry::Inertial && base.unknowns.have(ErrorSource::Rate)
}

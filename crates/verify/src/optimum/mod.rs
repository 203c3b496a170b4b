//! Certificates of optima: the best of all sequences of candidates, with blocks that any checker can
//! search again.

mod accuracy;
mod space;

use serde::Deserialize;

use crate::file::{RawGyro, RawProblem};
use crate::modular::{Randomness, chance};
use crate::problem::{Problem, known_carry};
use crate::{Refused, Replay, by_primes, need, parsed, refusal, same};
use accuracy::{Accuracy, BoundedValue, Criterion, Dwell, SURE_PIVOT, SequenceState};
use space::{SetVerdicts, multisets, power};

/// Layout of certificates of optima.
pub(crate) const LAYOUT: &str = "obsdeg.optimum-certificate/1";
/// Number of sequences up to which all blocks are searched again, unless a number of blocks is given.
const ALL_UP_TO: u64 = 2_000_000;
/// Relative margin by which a printed lower bound is reduced, so that printing does not round it up.
const DIGITS: f64 = 1e-6;
/// Relative tolerance of every value and bound; three times that for value, bound and found result
/// together.
const TOLERANCE: f64 = 1e-5;
/// Largest number of blocks of a certificate.
const MOST_BLOCKS: usize = 100_000;
/// Range of the dwell of a position, in s.
const DWELL_S: [f64; 2] = [10.0, 1e6];
/// Range of the noise of a sample of Z, in g.
const NOISE_G: [f64; 2] = [1e-9, 1e-2];
/// Range of the noise of a sample of the azimuth, in degrees.
const AZIMUTH_NOISE_DEG: [f64; 2] = [1e-6, 10.0];
/// Range of the required sigma of a coefficient, in its unit.
const LIMIT: [f64; 2] = [1e-12, 1e12];
/// Range of the latitude, north or south, in degrees.
const LATITUDE_DEG: [f64; 2] = [1.0, 89.0];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Optimum {
    #[serde(rename = "layout")]
    _layout: String,
    problem: RawSearch,
    degree: usize,
    best: Vec<RawBest>,
    sequences: u64,
    blocks: Vec<RawBlock>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSearch {
    carry: String,
    latitude_deg: String,
    measured_azimuth: bool,
    terms: Vec<String>,
    gyros: [RawGyro; 3],
    accelerometers: [String; 3],
    candidates: Vec<[String; 3]>,
    positions: usize,
    dwell_s: f64,
    samples: usize,
    noise_g: f64,
    #[serde(deserialize_with = "Option::deserialize")]
    azimuth_noise_deg: Option<f64>,
    criterion: String,
    required: Vec<Required>,
}

/// Coefficient that must be observable.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Required {
    name: String,
    #[serde(deserialize_with = "Option::deserialize")]
    max_degree: Option<usize>,
    #[serde(deserialize_with = "Option::deserialize")]
    limit: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBest {
    sequence: Vec<usize>,
    value: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBlock {
    start: Vec<usize>,
    sequences: u64,
    #[serde(deserialize_with = "Option::deserialize")]
    bound: Option<f64>,
}

/// Checked search.
struct CheckedSearch {
    problem: Problem,
    carry: String,
    positions: usize,
    accuracy: Accuracy,
    space: SetVerdicts,
    /// Bound on the probability that all primes give a wrong result for any set.
    error: f64,
    primes: usize,
    unit: &'static str,
}

/// Checks a certificate of an optimum.
pub(crate) fn verify(certificate: &[u8], scheme: bool, replay: &Replay) -> Result<Vec<String>, Refused> {
    need(
        !scheme,
        "scheme file",
        "no file beside the certificate of an optimum: compare its candidates",
        "one",
    )?;
    let file: Optimum = parsed(certificate)?;
    let mut search = CheckedSearch::new(&file.problem, certificate)?;
    let least = winners(&mut search, &file)?;
    let (firsts, depth) = search.cover(&file, least)?;
    let (chosen, seed) = chosen(&file, certificate, replay)?;
    let mut found = ReplayResult { at_least: f64::INFINITY, ..ReplayResult::default() };
    for &i in &chosen {
        let block = &file.blocks[i];
        let start: Vec<usize> = block.start.iter().map(|c| c - 1).collect();
        let here = search.replay(&start, &file)?;
        let place = format!("blocks.{i}");
        if let Some((sequence, value)) = &here.least {
            let bound = block.bound.unwrap_or(f64::INFINITY);
            let holds = value.at_least >= bound * (1.0 - TOLERANCE);
            let claimed = block.bound.map_or("none".into(), |b| b.to_string());
            let expected = format!("no sequence of degree {} below the bound {claimed}", file.degree);
            need(
                holds,
                &place,
                &expected,
                format!("{:.6e} of sequence {}", value.computed, listed(sequence)),
            )?;
        }
        found.add(here);
    }
    Ok(search.sentences(&file, (&firsts, depth), (chosen.len(), seed), &found))
}

/// Results of replays.
#[derive(Default)]
struct ReplayResult {
    sequences: u64,
    /// Number of sequences with the degree of the optimum within the caps.
    counted: u64,
    at_least: f64,
    least: Option<(Vec<usize>, BoundedValue)>,
}

impl ReplayResult {
    fn add(&mut self, other: Self) {
        self.sequences += other.sequences;
        self.counted += other.counted;
        if let Some((_, value)) = other.least {
            self.at_least = self.at_least.min(value.at_least);
        }
    }
}

/// Numbers of candidates, from 1.
fn listed(sequence: &[usize]) -> String {
    let numbers: Vec<String> = sequence.iter().map(|c| (c + 1).to_string()).collect();
    format!("[{}]", numbers.join(", "))
}

/// Checks the best sequences, and returns the value of the first.
fn winners(search: &mut CheckedSearch, file: &Optimum) -> Result<f64, Refused> {
    let (n, k) = (search.problem.positions.len(), search.positions);
    need((1..=1000).contains(&file.best.len()), "best", "1 to 1000 sequences", file.best.len())?;
    let mut before = 0.0;
    for (i, best) in file.best.iter().enumerate() {
        let place = format!("best.{i}");
        let known = best.sequence.len() == k && best.sequence.iter().all(|c| (1..=n).contains(c));
        need(known, &place, &format!("{k} candidates from 1 to {n}"), format!("{:?}", best.sequence))?;
        need(best.value >= before, &place, "values in ascending order", best.value)?;
        before = best.value;
        let sequence: Vec<usize> = best.sequence.iter().map(|c| c - 1).collect();
        let certain = search.space.certain(&sequence);
        let (degree, undetermined) = (certain.map(|c| c.0), certain.map_or(0, |c| c.1));
        same(&format!("{place}, worst degree"), &Some(file.degree), &degree)?;
        let place = format!("{place}.value");
        let value = search.value(&sequence);
        let near = (best.value / value.computed - 1.0).abs() <= TOLERANCE;
        need(near, &place, &format!("{:e}", value.computed), best.value)?;
        // decided by double precision
        let sure = value.pivot >= SURE_PIVOT && value.left_out <= undetermined;
        let expected = format!("pivots from {SURE_PIVOT:e} on, and {undetermined} unknowns left out at most");
        need(sure, &place, &expected, format!("{:e}, {} left out", value.pivot, value.left_out))?;
        let bounded = value.at_least <= value.computed * (1.0 + TOLERANCE);
        need(bounded, &place, &format!("at least {:e}, its own bound", value.at_least), best.value)?;
    }
    Ok(file.best[0].value)
}

/// Blocks that are searched again, and the seed of the choice if there is one.
fn chosen(file: &Optimum, certificate: &[u8], replay: &Replay) -> Result<(Vec<usize>, Option<u64>), Refused> {
    let all = file.blocks.len();
    let count = match replay.blocks {
        Some(count) => count.min(all),
        None if file.sequences <= ALL_UP_TO => all,
        None => {
            let largest = file.blocks.iter().map(|b| b.sequences).max().unwrap_or(1);
            usize::try_from(ALL_UP_TO / largest.max(1)).unwrap_or(all).min(all)
        }
    };
    if count == all {
        return Ok(((0..all).collect(), None));
    }
    let seed = replay.seed.unwrap_or_else(of_the_system);
    let mut random = Randomness::new(&[certificate, &seed.to_be_bytes()].concat());
    let mut places: Vec<usize> = (0..all).collect();
    for i in 0..count {
        let other = i + random.below((all - i) as u64) as usize;
        places.swap(i, other);
    }
    places.truncate(count);
    places.sort_unstable();
    Ok((places, Some(seed)))
}

/// Random number of the system, unknown when the certificate was written.
fn of_the_system() -> u64 {
    use std::hash::{BuildHasher, Hasher};
    std::collections::hash_map::RandomState::new().build_hasher().finish()
}

/// Number of a file, refused unless it is within limits.
fn between(place: &str, x: f64, [least, most]: [f64; 2]) -> Result<f64, Refused> {
    need((least..=most).contains(&x), place, &format!("a number from {least:e} to {most:e}"), x)?;
    Ok(x)
}

/// Refuses searches that double precision cannot decide. It decides those with cardinal candidates, all
/// coefficients required, and a latitude away from the equator and the poles. Elsewhere a sequence may
/// determine so little that rounding decides its value.
fn within_precision(raw: &RawSearch, problem: &Problem) -> Result<(), Refused> {
    let right = |text: &String| text.parse::<f64>().is_ok_and(|x| x % 90.0 == 0.0);
    let other = raw.candidates.iter().flatten().find(|text| !right(text));
    let found = other.map_or("", |text| text);
    need(other.is_none(), "problem.candidates", "multiples of 90 degrees", format!("`{found}`"))?;
    let latitude = raw.latitude_deg.parse::<f64>().unwrap_or(f64::NAN).abs();
    let away = (LATITUDE_DEG[0]..=LATITUDE_DEG[1]).contains(&latitude);
    need(away, "problem.latitude_deg", "a latitude of 1 to 89 degrees, north or south", &raw.latitude_deg)?;
    let (all, found) = (problem.names.len() - 3, raw.required.len());
    need(found == all, "problem.required", &format!("all {all} coefficients"), found)
}

/// Measurement at every position: dwell, samples and noise.
fn dwell(raw: &RawSearch) -> Result<Dwell, Refused> {
    need((5..=10_000).contains(&raw.samples), "problem.samples", "5 to 10000 samples", raw.samples)?;
    let azimuth = raw.azimuth_noise_deg;
    let expected = if raw.measured_azimuth { "a number" } else { "null" };
    need(
        azimuth.is_some() == raw.measured_azimuth,
        "problem.azimuth_noise_deg",
        expected,
        format!("{azimuth:?}"),
    )?;
    Ok(Dwell {
        seconds: between("problem.dwell_s", raw.dwell_s, DWELL_S)?,
        samples: raw.samples,
        noise_g: between("problem.noise_g", raw.noise_g, NOISE_G)?,
        azimuth_noise_deg: azimuth
            .map(|x| between("problem.azimuth_noise_deg", x, AZIMUTH_NOISE_DEG))
            .transpose()?,
    })
}

impl CheckedSearch {
    fn new(raw: &RawSearch, certificate: &[u8]) -> Result<Self, Refused> {
        known_carry(&raw.carry)?;
        // rows of the candidates; the carry acts when positions are combined
        let problem = Problem::new(&RawProblem {
            carry: "platform".into(),
            latitude_deg: Some(raw.latitude_deg.clone()),
            measured_azimuth: raw.measured_azimuth,
            terms: raw.terms.clone(),
            gyros: raw.gyros.clone(),
            accelerometers: raw.accelerometers.clone(),
            positions: raw.candidates.clone(),
            slews: None,
        })?;
        need(problem.names.len() <= 66, "problem.terms", "at most 63 coefficients", problem.names.len() - 3)?;
        need((1..=100).contains(&raw.positions), "problem.positions", "1 to 100 positions", raw.positions)?;
        let torqued = raw.carry == "inertial" && raw.positions > 1 && problem.is_torqued();
        need(!torqued, "problem.terms", "no torquer errors under inertial carry: they act in slews", "some")?;
        within_precision(raw, &problem)?;
        let dwell = dwell(raw)?;
        let (criterion, required) = required(raw, &problem)?;
        let columns: Vec<(usize, f64)> = required.iter().map(|r| (r.0, r.2)).collect();
        let (n, k) = (raw.candidates.len(), raw.positions);
        let unknowns = problem.names.len() + if raw.carry == "reset" { 3 * (k - 1) } else { 0 };
        let each = chance(&problem, unknowns, 4 * (1 + required.len()));
        let sets: f64 = (1..=k.min(n))
            .map(|size| (0..size).map(|i| (n - i) as f64 / (i + 1) as f64).product::<f64>())
            .sum();
        let primes = (2..=8).find(|&m| sets * each.powi(m) < 1e-12);
        let Some(primes) = primes else {
            return Err(refusal(
                "problem",
                "sets that eight primes decide with a probability of error below 1e-12",
                "more",
            ));
        };
        let alike = |i: usize, j: usize| {
            let of = |c: usize| required.iter().find(|r| r.0 == c).map(|r| (r.1, r.2.to_bits()));
            of(i) == of(j) && unit_of(&problem, i) == unit_of(&problem, j)
        };
        let caps = required.iter().map(|r| (r.0, r.1)).collect();
        let random = &mut Randomness::new(certificate);
        let space = SetVerdicts::new(&problem, &raw.carry, caps, primes as usize, random, &alike);
        Ok(Self {
            accuracy: Accuracy::new(&problem, &raw.carry, &dwell, criterion, &columns),
            unit: unit(&problem, criterion, &required)?,
            problem,
            carry: raw.carry.clone(),
            positions: k,
            space,
            error: sets * each.powi(primes),
            primes: primes as usize,
        })
    }

    fn value(&self, sequence: &[usize]) -> BoundedValue {
        let state = sequence.iter().fold(self.accuracy.start(), |s, &c| self.accuracy.extended(&s, c));
        self.accuracy.value(&state)
    }

    /// Number of sequences behind a start: n^left where order matters, otherwise multisets of
    /// candidates from its last one on.
    fn behind(&self, start: &[usize]) -> Option<u64> {
        let (n, left) = (self.problem.positions.len() as u64, (self.positions - start.len()) as u64);
        match (self.carry.as_str(), start.last()) {
            ("reset", Some(last)) => multisets(n + 1 - *last as u64, left),
            _ => power(n, left),
        }
    }

    /// Checks that the blocks cover all sequences up to turns of the platform axes. Returns the first
    /// candidates and the length of starts.
    fn cover(&self, file: &Optimum, least: f64) -> Result<(Vec<usize>, usize), Refused> {
        let n = self.problem.positions.len();
        let found = file.blocks.len();
        need((1..=MOST_BLOCKS).contains(&found), "blocks", &format!("1 to {MOST_BLOCKS} blocks"), found)?;
        let depth = file.blocks[0].start.len();
        let lengths = format!("1 to {} candidates", self.positions);
        need((1..=self.positions).contains(&depth), "blocks.0.start", &lengths, depth)?;
        let reset = self.carry == "reset";
        let (mut firsts, mut expected, mut total) = (Vec::new(), Vec::new(), 0u64);
        for (i, block) in file.blocks.iter().enumerate() {
            let place = format!("blocks.{i}");
            if expected.is_empty() {
                let first = block.start.first().copied().unwrap_or(0);
                let after = firsts.last().map_or(1, |last| last + 1);
                need(
                    (after..=n).contains(&first),
                    &place,
                    &format!("a first candidate from {after} to {n}"),
                    first,
                )?;
                firsts.push(first);
                expected = filled(vec![first], depth, reset);
            }
            same(&format!("{place}.start"), &block.start, &expected)?;
            let count = self.behind(&block.start).unwrap_or(u64::MAX);
            same(&format!("{place}.sequences"), &block.sequences, &count)?;
            total = total
                .checked_add(count)
                .ok_or_else(|| refusal("blocks", "fewer than 2^63 sequences", "more"))?;
            if let Some(bound) = block.bound {
                let holds = bound >= least * (1.0 - TOLERANCE) && bound.is_finite();
                need(
                    holds,
                    &format!("{place}.bound"),
                    &format!("at least the value {least:e} of the first of the best"),
                    bound,
                )?;
            }
            expected = next_start(expected, n, depth, reset);
        }
        need(
            expected.is_empty(),
            "blocks",
            &format!("a block that starts with {expected:?}"),
            "no more blocks",
        )?;
        let needed: Vec<usize> = self.space.firsts(n).iter().map(|c| c + 1).collect();
        if let Some(left_out) = needed.iter().find(|c| !firsts.contains(c)) {
            let expected = format!(
                "blocks that start with candidate {left_out}, which no turn of the platform axes makes of another"
            );
            return Err(refusal("blocks", &expected, format!("those of {firsts:?}")));
        }
        same("sequences", &file.sequences, &total)?;
        Ok((firsts, depth))
    }

    /// Searches all sequences of a block.
    fn replay(&mut self, start: &[usize], file: &Optimum) -> Result<ReplayResult, Refused> {
        let mut states = vec![self.accuracy.start()];
        for &c in start {
            states.push(self.accuracy.extended(&states[states.len() - 1], c));
        }
        let mut found = ReplayResult { at_least: f64::INFINITY, ..ReplayResult::default() };
        let state = states.swap_remove(start.len());
        self.visit(&mut start.to_vec(), &state, file.degree, &mut found)?;
        Ok(found)
    }

    fn visit(
        &mut self,
        sequence: &mut Vec<usize>,
        state: &SequenceState,
        degree: usize,
        found: &mut ReplayResult,
    ) -> Result<(), Refused> {
        if sequence.len() == self.positions {
            found.sequences += 1;
            match self.space.worst_degree(sequence) {
                Some(own) if own < degree => {
                    let place = format!("sequence {}", listed(sequence));
                    return Err(refusal(&place, &format!("a worst degree of at least {degree}"), own));
                }
                Some(own) if own == degree => {}
                _ => return Ok(()),
            }
            found.counted += 1;
            let value = self.accuracy.value(state);
            if found.least.as_ref().is_none_or(|(_, least)| value.at_least < least.at_least) {
                found.least = Some((sequence.clone(), value));
            }
            return Ok(());
        }
        let from = if self.carry == "reset" { sequence.last().copied().unwrap_or(0) } else { 0 };
        for c in from..self.problem.positions.len() {
            sequence.push(c);
            let whole = sequence.len() == self.positions;
            // sequences of a larger degree are not evaluated
            let counts = !whole || self.space.worst_degree(sequence).is_some_and(|own| own <= degree);
            if counts {
                let next = self.accuracy.extended(state, c);
                self.visit(sequence, &next, degree, found)?;
            } else {
                found.sequences += 1;
            }
            sequence.pop();
        }
        Ok(())
    }

    fn sentences(
        &self,
        file: &Optimum,
        (firsts, depth): (&[usize], usize),
        (replayed, seed): (usize, Option<u64>),
        found: &ReplayResult,
    ) -> Vec<String> {
        let mut out = vec![self.question(file)];
        out.extend(file.best.iter().take(3).map(|best| self.evaluated(file, best)));
        if file.best.len() > 3 {
            out.push(format!("{} more sequences of the list; evaluated again.", file.best.len() - 3));
        }
        out.push(format!(
            "Blocks: {} of starts of {depth}, {} sequences, stand for all: first candidates {}, {} turns of \
             the platform axes.",
            file.blocks.len(),
            file.sequences,
            listed(&firsts.iter().map(|c| c - 1).collect::<Vec<_>>()),
            self.space.maps.len()
        ));
        out.push(self.searched_again(file, (replayed, seed), found));
        out.push(match file.blocks.len() - replayed {
            0 => {
                format!(
                    "Proven: the first sequence is the best of all, to a part of {:.0e}.",
                    3.0 * TOLERANCE
                )
            }
            left => format!(
                "Believed only: the bounds of the other {left} blocks, {} sequences.",
                file.sequences - found.sequences
            ),
        });
        out.push(
            "Assumption: the model of book/src/certificate.md, white noise of Z, nothing known beforehand, \
             repositioning at once."
                .into(),
        );
        out
    }

    fn question(&self, file: &Optimum) -> String {
        let (n, k) = (self.problem.positions.len(), self.positions);
        let order = if self.carry == "reset" { ", order is of no account" } else { "" };
        let names: Vec<String> = file.problem.required.iter().map(|r| r.name.clone()).collect();
        format!(
            "Question: {k} positions of {n} candidates, carry {}, latitude {} deg{order}; {} of {}, dwell \
             {} s, {} samples.",
            self.carry,
            file.problem.latitude_deg,
            file.problem.criterion,
            names.join(", "),
            file.problem.dwell_s,
            file.problem.samples
        )
    }

    fn evaluated(&self, file: &Optimum, best: &RawBest) -> String {
        let attitudes: Vec<String> =
            best.sequence.iter().map(|c| file.problem.candidates[c - 1].join(",")).collect();
        format!(
            "Sequence {}: worst degree {}, criterion {:.6e}{}; evaluated again.",
            attitudes.join(" | "),
            file.degree,
            best.value,
            self.unit
        )
    }

    fn searched_again(
        &self,
        file: &Optimum,
        (replayed, seed): (usize, Option<u64>),
        found: &ReplayResult,
    ) -> String {
        let how = by_primes(self.primes, self.error);
        let chosen = seed.map_or_else(String::new, |seed| format!(", chosen by seed {seed}"));
        let least = match found.counted {
            0 => "none of this degree within the caps".into(),
            _ => format!("none below {:.6e}{}", found.at_least * (1.0 - DIGITS), self.unit),
        };
        match replayed {
            0 => format!(
                "No block searched again: each has more than {ALL_UP_TO} sequences; --blocks 1 searches one."
            ),
            _ => format!(
                "{replayed} of {} blocks searched again{chosen}: {} sequences, {} of worst degree {}, none of \
                 a smaller one, {least}; {} sets judged {how}.",
                file.blocks.len(),
                found.sequences,
                found.counted,
                file.degree,
                self.space.judged_sets()
            ),
        }
    }
}

/// First start of `depth` candidates that begins with `start`.
fn filled(mut start: Vec<usize>, depth: usize, reset: bool) -> Vec<usize> {
    while start.len() < depth {
        start.push(if reset { start[start.len() - 1] } else { 1 });
    }
    start
}

/// Next start in lexicographic order with the same first candidate; empty after the last.
fn next_start(mut start: Vec<usize>, n: usize, depth: usize, reset: bool) -> Vec<usize> {
    while let Some(last) = start.pop() {
        if last < n && !start.is_empty() {
            start.push(last + 1);
            return filled(start, depth, reset);
        }
    }
    start
}

/// Coefficients that count: column, largest degree, and the sigma that is 1 in the criterion.
type Counting = Vec<(usize, usize, f64)>;

fn required(raw: &RawSearch, problem: &Problem) -> Result<(Criterion, Counting), Refused> {
    let criterion = match raw.criterion.as_str() {
        "worst" => Criterion::Worst,
        "a" => Criterion::Mean,
        "d" => Criterion::Volume,
        "e" => Criterion::Principal,
        "margin" => Criterion::Margin,
        other => return Err(refusal("problem.criterion", "worst, a, d, e or margin", other)),
    };
    let mut out: Counting = Vec::new();
    need(!raw.required.is_empty(), "problem.required", "at least one coefficient", "none")?;
    for r in &raw.required {
        let column = problem.column(&r.name).and_then(|c| c.checked_sub(problem.psi));
        let after = out.last().map_or(0, |last| last.0 + 1);
        let Some(column) = column.filter(|c| *c >= after) else {
            return Err(refusal("problem.required", "names of coefficients in their order", &r.name));
        };
        let margin = criterion == Criterion::Margin;
        need(margin || r.limit.is_none(), &format!("problem.required.{}", r.name), "no limit", "one")?;
        let limit =
            r.limit.map(|x| between(&format!("problem.required.{}.limit", r.name), x, LIMIT)).transpose()?;
        let free = if margin { f64::INFINITY } else { 1.0 };
        out.push((column, r.max_degree.unwrap_or(usize::MAX), limit.unwrap_or(free)));
    }
    let some = criterion != Criterion::Margin || out.iter().any(|r| r.2.is_finite());
    need(some, "problem.required", "a limit", "none")?;
    Ok((criterion, out))
}

/// Unit of a criterion, after a blank; empty if it has none.
fn unit(problem: &Problem, criterion: Criterion, required: &Counting) -> Result<&'static str, Refused> {
    let of = |column: usize| unit_of(problem, column);
    let first = of(required[0].0);
    match criterion {
        Criterion::Margin => Ok(""),
        _ if required.iter().all(|r| of(r.0) == first) => Ok(first),
        Criterion::Volume => Ok(""),
        _ => Err(refusal(
            "problem.required",
            "coefficients of one unit, or the criterion d or margin",
            "several units",
        )),
    }
}

/// Unit of a coefficient, after a blank.
fn unit_of(problem: &Problem, column: usize) -> &'static str {
    match &problem.names[problem.psi + column] {
        name if name.starts_with("D_") => " deg/h",
        name if name.starts_with("GM_") || name.starts_with("M_") => " arcsec",
        name if name.starts_with("GS_") || name.starts_with("K1_") => " ppm",
        _ => " ug",
    }
}

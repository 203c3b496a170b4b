//! Order of a search (constraints, worst degree, criterion), against every sequence of small random tasks.

use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Angle, Carry, Euler, Scheme, c_n_f64, cardinal, parse_attitude};
use obsdeg_design::DegreeCap;
use obsdeg_design::design::{
    AttitudeRows, CandidateSymmetry, Candidates, Constraints, Criterion, CriterionName, Design, DesignError,
    DesignOptions, Evaluator, SequenceSearch, SigmaLimits, Stop, design,
};
use obsdeg_evidence::compare::predicted;
use obsdeg_evidence::simulation::{Conditions, Plan};
use obsdeg_exact::SplitMix64;
use rayon::prelude::*;

use super::{on, options, scheme_found};

/// Random element of a list.
fn pick<T: Clone>(rng: &mut SplitMix64, list: &[T]) -> T {
    list[rng.below(list.len() as u64) as usize].clone()
}

fn between(rng: &mut SplitMix64, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.below(1 << 30) as f64 / f64::from(1 << 30)
}

/// Random candidates: cardinal attitudes, with half turns and symmetric images, or others, with neither.
fn candidates(rng: &mut SplitMix64) -> Candidates {
    let cardinals = Candidates::cardinals();
    let cardinal = rng.below(3) > 0;
    let mut candidates = Candidates::default();
    for _ in 0..4 + rng.below(3) {
        candidates.add(match cardinal {
            true => pick(rng, &cardinals.attitudes),
            false => std::array::from_fn(|_| Angle::from_degrees(5 * rng.below(72) as i32 - 180)),
        });
    }
    candidates
}

struct Task {
    base: Scheme,
    conditions: Conditions,
    options: DesignOptions,
}

const NAMES: [&str; 12] =
    ["D_FX", "D_FY", "D_FZ", "D_IX", "D_IY", "D_IZ", "D_OX", "D_OY", "D_OZ", "D_SX", "D_SY", "D_SZ"];

/// Random task: four to six candidates, two to four positions, any carry, required coefficients that are
/// mostly observable, and any constraints.
fn task(seed: u64) -> Task {
    let mut rng = SplitMix64::new(seed ^ 0x0bd3_7a5c);
    let rng = &mut rng;
    let carry = pick(rng, &[Carry::Platform, Carry::Inertial, Carry::Inertial, Carry::Reset]);
    let mut base = Scheme { carry, latitude: "28.2".parse().ok(), ..Scheme::default() };
    if rng.below(5) == 0 {
        base.gimbals.limit("beta=-60:60").expect("limits");
    }
    let k = pick(rng, &[2, 3, 3, 4, 4]);
    let (candidates, required) = (0..50)
        .map(|_| {
            let candidates = candidates(rng);
            // no attitude may lie within the gimbal limits
            let attitudes = candidates.clone().within(&base.gimbals).0.attitudes;
            if attitudes.is_empty() {
                return (candidates, Vec::new());
            }
            let rows = AttitudeRows::new(&base, &candidates.attitudes, &super::ALL, 5).expect("rows");
            let few: Vec<usize> = (0..k).map(|_| rng.below(candidates.names.len() as u64) as usize).collect();
            let seen: Vec<&str> =
                NAMES.into_iter().zip(rows.degrees(&few)).filter_map(|(n, d)| d.map(|_| n)).collect();
            let wanted = seen.into_iter().filter(|_| rng.below(3) == 0).collect();
            (candidates, if rng.below(20) == 0 { vec!["D_F"] } else { wanted })
        })
        .find(|(_, required): &(Candidates, Vec<&str>)| !required.is_empty())
        .expect("something is seen");
    let turning = carry == Carry::Inertial && rng.below(3) > 0;
    let mut conditions = Conditions {
        step_s: 100.0,
        slew_rate_deg_s: turning.then(|| pick(rng, &[0.5, 1.0])),
        ..super::quiet()
    };
    let slews = 180.0 / conditions.slew_rate_deg_s.unwrap_or(f64::INFINITY);
    let some = |rng: &mut SplitMix64| rng.below(4) == 0;
    let cap = |name: &str, cap: usize| DegreeCap { name: Some(name.into()), cap };
    let degree_caps = match rng.below(8) {
        0 => vec![DegreeCap { name: None, cap: 1 }],
        1 => vec![cap(pick(rng, &required), 1)],
        2 => vec![cap(pick(rng, &required), 1), cap(required[0], 2)],
        _ => Vec::new(),
    };
    let meet = some(rng);
    let criterion = pick(
        rng,
        &[CriterionName::Worst, CriterionName::A, CriterionName::D, CriterionName::E, CriterionName::Margin],
    );
    if meet || criterion == CriterionName::Margin {
        let sigma = 10f64.powf(between(rng, -3.0, 1.0));
        conditions.requirements = vec![
            Assignment { name: "D".into(), value: sigma },
            Assignment { name: "D_FX".into(), value: sigma * between(rng, 0.2, 1.0) },
        ];
    }
    let options = DesignOptions {
        candidates,
        positions: Some(k),
        required: required.iter().map(ToString::to_string).collect(),
        degree_caps,
        meet,
        total_s: some(rng).then(|| k as f64 * 1000.0 + (between(rng, 0.0, k as f64) * slews).round()),
        // duration of a quarter turn: a slew as long as the limit is allowed
        slew_s: (turning && some(rng)).then(|| pick(rng, &[slews, slews / 2.0, slews / 1.7])),
        criterion,
        keep: 4,
        refine: carry == Carry::Platform && k == 4 || seed.is_multiple_of(10),
        ..options(None)
    };
    Task { base, conditions, options }
}

/// Limits of the coefficients, without requirements on psi.
fn limits_of(coefficients: &[f64]) -> SigmaLimits {
    SigmaLimits { coefficients: coefficients.to_vec(), psi: [f64::INFINITY; 3] }
}

/// Sequence that meets every constraint.
struct SequenceScore {
    degree: usize,
    value: f64,
    seconds: f64,
    names: Vec<String>,
}

/// Task with all its sequences evaluated.
struct EvaluatedTask {
    candidates: Candidates,
    rows: AttitudeRows,
    evaluator: Evaluator,
    criterion: Criterion,
    constraints: Constraints,
    floor: usize,
    kept: Vec<SequenceScore>,
    /// True if all candidates together leave a required coefficient unobservable.
    never: bool,
}

fn judged(t: &Task) -> EvaluatedTask {
    let (mut out, caps, limits) = prepared(t);
    out.kept = out.all(t, &caps, &limits);
    out
}

/// The task before any sequence is evaluated, with the caps on degrees and the limits of required
/// coefficients.
fn prepared(t: &Task) -> (EvaluatedTask, Vec<usize>, Vec<f64>) {
    let (reached, _) = t.options.candidates.clone().within(&t.base.gimbals);
    let mut candidates = Candidates::default();
    for (name, attitude) in reached.names.iter().zip(&reached.attitudes) {
        // different Euler angles may give the same attitude: only cardinal attitudes repeat here, and their
        // names tell
        if !candidates.names.contains(name) {
            candidates.add(attitude.clone());
        }
    }
    let asked = |name: &str| t.options.required.iter().any(|r| name.starts_with(r.as_str()));
    let required: Vec<usize> =
        (0..12).filter(|&c| t.options.required.is_empty() || asked(NAMES[c])).collect();
    let rows = AttitudeRows::new(&t.base, &candidates.attitudes, &required, 99).expect("rows");
    let evaluator =
        Evaluator::new(&t.base, &candidates.attitudes, &required, &t.conditions).expect("an evaluator");
    let limits: Vec<f64> = required
        .iter()
        .map(|&c| {
            let of = t.conditions.requirements.iter().rev().find(|r| r.name == NAMES[c] || r.name == "D");
            of.map_or(f64::NAN, |r| r.value)
        })
        .collect();
    let caps: Vec<usize> = required
        .iter()
        .map(|&c| {
            let mut cap = usize::MAX;
            for DegreeCap { name, cap: k } in &t.options.degree_caps {
                if name.as_ref().is_none_or(|n| NAMES[c].starts_with(n.as_str())) {
                    cap = *k;
                }
            }
            cap
        })
        .collect();
    let criterion = match t.options.criterion {
        CriterionName::Worst => Criterion::Worst,
        CriterionName::A => Criterion::A,
        CriterionName::D => Criterion::D,
        CriterionName::E => Criterion::E,
        CriterionName::Margin => Criterion::Margin(limits_of(&limits)),
    };
    let constraints = Constraints {
        total_s: t.options.total_s,
        slew_s: t.options.slew_s,
        sigmas: t.options.meet.then(|| limits_of(&limits)),
        degrees: caps.iter().any(|c| *c != usize::MAX).then(|| caps.clone()),
    };
    let every: Vec<usize> = (0..candidates.names.len()).collect();
    let best = rows.degrees(&every);
    let never = best.iter().any(Option::is_none);
    let floor = best.into_iter().flatten().max().unwrap_or(0);
    let out =
        EvaluatedTask { candidates, rows, evaluator, criterion, constraints, floor, kept: Vec::new(), never };
    (out, caps, limits)
}

impl EvaluatedTask {
    /// Evaluates all sequences, built position by position without any shortcut of a search.
    fn all(&self, t: &Task, caps: &[usize], limits: &[f64]) -> Vec<SequenceScore> {
        let k = t.options.positions.expect("a number");
        let mut sequences: Vec<Vec<Stop>> = vec![Vec::new()];
        for _ in 0..k {
            let longer = |s: &Vec<Stop>| -> Vec<Vec<Stop>> {
                let last = s.last().map(|s| s.candidate);
                let all = (0..self.candidates.names.len())
                    .filter(|&c| t.base.carry != Carry::Reset || last.is_none_or(|last| c >= last));
                all.flat_map(|c| self.evaluator.stops(last, c))
                    .map(|stop| [&s[..], &[stop]].concat())
                    .collect()
            };
            sequences = sequences.iter().flat_map(longer).collect();
        }
        sequences.iter().filter_map(|s| self.one(t, s, caps, limits)).collect()
    }

    fn one(&self, t: &Task, s: &[Stop], caps: &[usize], limits: &[f64]) -> Option<SequenceScore> {
        let mut set: Vec<usize> = s.iter().map(|s| s.candidate).collect();
        let names = set.iter().map(|&c| self.candidates.names[c].clone()).collect();
        let slews: Vec<f64> = set.windows(2).map(|w| self.evaluator.slew_s(w[0], w[1])).collect();
        set.sort_unstable();
        set.dedup();
        let degrees: Vec<usize> = self.rows.degrees(&set).into_iter().collect::<Option<_>>()?;
        let value = self.evaluator.of_sequence(s, &self.criterion);
        let seconds = s.len() as f64 * t.conditions.dwell_s + slews.iter().sum::<f64>();
        let margin = Criterion::Margin(limits_of(limits));
        let kept = degrees.iter().zip(caps).all(|(d, cap)| d <= cap)
            && slews.iter().all(|s| t.options.slew_s.is_none_or(|limit| *s <= limit + 1e-6))
            && t.options.total_s.is_none_or(|limit| seconds <= limit + 1e-6)
            && (!t.options.meet || self.evaluator.of_sequence(s, &margin) <= 1.0)
            && value.is_finite();
        let degree = degrees.into_iter().max()?;
        kept.then_some(SequenceScore { degree, value, seconds, names })
    }

    /// Worst degree and criterion of the best sequence.
    fn best(&self) -> Option<(usize, f64)> {
        let order = |a: &&SequenceScore, b: &&SequenceScore| {
            a.degree.cmp(&b.degree).then(a.value.total_cmp(&b.value))
        };
        self.kept.iter().min_by(order).map(|k| (k.degree, k.value))
    }
}

fn close(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() < 1e-8
}

impl EvaluatedTask {
    /// Candidate names of the positions. Gimbal limits may lead to other angles, and names, for the same
    /// attitude.
    fn named(&self, positions: &[String]) -> Vec<String> {
        let matrix = |e: &Euler| c_n_f64(e).map(|row| row.map(|x| (x * 1e9).round() as i64));
        let name = |position: &String| {
            let angles = cardinal(position).unwrap_or_else(|| parse_attitude(position).expect("angles"));
            let at = self.candidates.attitudes.iter().position(|c| matrix(c) == matrix(&angles));
            self.candidates.names[at.expect("a candidate")].clone()
        };
        positions.iter().map(name).collect()
    }
}

/// Checks that the result of exhaustion is the best of all sequences in the search order, and that its
/// statements hold.
fn hold_exhaustion(seed: u64, t: &Task, all: &EvaluatedTask, found: &Result<Design, DesignError>) {
    let Some((degree, value)) = all.best() else {
        let error = found.as_ref().expect_err("nothing is within the constraints").to_string();
        let expected = if all.never { "unobservable" } else { "every sequence was examined" };
        assert!(error.contains(expected), "{seed}: {error}");
        return;
    };
    let found = found.as_ref().unwrap_or_else(|e| panic!("{seed}: {e}"));
    let search = found.search.as_ref().expect("a search");
    assert!(search.proven, "{seed}");
    let plain: Vec<_> = found.found.iter().filter(|f| !f.refined).collect();
    assert!(
        plain[0].worst_degree == degree && close(plain[0].value, value),
        "{seed}: {degree} {value} {:?}",
        plain[0]
    );
    let ties = search.ties.expect("all were searched");
    let near = |k: &&SequenceScore| k.degree == degree && k.value <= value * (1.0 + ties.within);
    assert_eq!(ties.sequences, all.kept.iter().filter(near).count() as u64, "{seed}");
    for f in &plain {
        let names = all.named(&f.positions);
        let is = |k: &&SequenceScore| {
            k.names == names
                && k.degree == f.worst_degree
                && close(k.value, f.value)
                && close(k.seconds, f.total_s)
        };
        // under reset carry the positions are a set, listed in the order of the search
        let same = |k: &&SequenceScore| {
            t.base.carry == Carry::Reset && k.degree == f.worst_degree && close(k.value, f.value)
        };
        assert!(all.kept.iter().any(|k| is(&k) || same(&k)), "{seed}: {f:?}");
    }
    if found.symmetry == 1 {
        let mut expected: Vec<(usize, f64)> = all.kept.iter().map(|k| (k.degree, k.value)).collect();
        expected.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        expected.truncate(t.options.keep);
        assert_eq!(plain.len(), expected.len(), "{seed}");
        for (f, (degree, value)) in plain.iter().zip(expected) {
            assert!(f.worst_degree == degree && close(f.value, value), "{seed}: {degree} {value} {f:?}");
        }
    }
    // no sequence with the same dwell is better than the front
    for f in found.front.iter().filter(|f| f.worst_degree <= degree && f.positions.len() == search.positions)
    {
        let beats = |k: &SequenceScore| {
            f.dwell_s == t.conditions.dwell_s
                && k.degree == degree
                && k.seconds <= f.total_s + 1e-6
                && k.value < f.value * (1.0 - 1e-8)
        };
        assert!(f.refined || !all.kept.iter().any(beats), "{seed}: {f:?}");
    }
    for f in found.found.iter().filter(|f| f.refined) {
        hold_refinement(seed, t, all, f, (degree, value));
    }
}

/// Checks that refined angles meet every constraint and are better in the same order, by a comparison of
/// schemes.
fn hold_refinement(
    seed: u64,
    t: &Task,
    all: &EvaluatedTask,
    f: &obsdeg_design::design::Found,
    (degree, value): (usize, f64),
) {
    assert!(f.worst_degree <= degree && f.value < value, "{seed}: {f:?}");
    let scheme = scheme_found(f, &t.base);
    assert_eq!(scheme.validate(), Ok(()), "{seed}");
    let plan = Plan::new(&scheme, &t.conditions).expect("a plan");
    assert!((plan.duration_s() - f.total_s).abs() < 1e-6, "{seed}");
    assert!(t.options.total_s.is_none_or(|limit| f.total_s <= limit + 1e-3), "{seed}: {f:?}");
    let slews = plan.slews().map(|(_, turn)| turn.angle_deg / t.conditions.slew_rate_deg_s.expect("a rate"));
    assert!(
        slews.into_iter().all(|s| t.options.slew_s.is_none_or(|limit| s <= limit + 1e-3)),
        "{seed}: {f:?}"
    );
    let sigmas = predicted(&scheme, &t.conditions, 1).expect("predicted");
    let of = |c: usize| sigmas.iter().find(|s| s.0 == NAMES[c]).and_then(|s| s.1);
    let limits = all.constraints.sigmas.iter().flat_map(|l| &l.coefficients);
    let required = (0..12).filter(|&c| {
        t.options.required.is_empty() || t.options.required.iter().any(|r| NAMES[c].starts_with(r.as_str()))
    });
    for (c, limit) in required.zip(limits) {
        assert!(of(c).is_some_and(|s| s <= limit * (1.0 + 1e-6)), "{seed}: {} {f:?}", NAMES[c]);
    }
}

/// Both searches order schemes as a loop through every sequence does, and their statements hold.
#[test]
fn both_searches_order_as_brute_force() {
    searches_order_as_brute_force(12);
}

/// Both searches against all sequences, 200 tasks.
#[test]
#[ignore = "full length, for `.ci/run release`"]
fn both_searches_order_as_brute_force_at_length() {
    searches_order_as_brute_force(200);
}

fn searches_order_as_brute_force(tasks: usize) {
    let outcomes: Vec<(bool, bool, bool)> = (0..tasks as u64)
        .into_par_iter()
        .map(|seed| {
            let t = task(seed);
            let all = judged(&t);
            let found = design(&t.base, &t.conditions, &t.options, &on);
            hold_exhaustion(seed, &t, &all, &found);
            // exchange may miss the best sequence, but its values are correct and never better than the best
            let search = SequenceSearch {
                rows: &all.rows,
                slew_sequences: false,
                evaluator: &all.evaluator,
                criterion: &all.criterion,
                constraints: &all.constraints,
                keep: 1,
                floor: all.floor,
                progress: &on,
            };
            let exchanged = search.exchange(t.options.positions.expect("a number"), &[], 40, seed);
            let first = exchanged.found.first().map(|f| (f.score.degree, f.score.value));
            let agrees = match (first, all.best()) {
                (Some(found), Some(best)) => {
                    assert!(
                        found.0 == best.0 && found.1 >= best.1 * (1.0 - 1e-8),
                        "{seed}: {found:?} {best:?}"
                    );
                    assert!(found.1 < best.1 * 1.05, "{seed}: {found:?} {best:?}");
                    close(found.1, best.1)
                }
                (None, None) => true,
                (found, best) => panic!("{seed}: {found:?} {best:?}"),
            };
            let refined = found.as_ref().is_ok_and(|f| f.found[0].refined);
            (all.best().is_some(), agrees, refined)
        })
        .collect();
    let count = |of: fn(&(bool, bool, bool)) -> bool| outcomes.iter().filter(|o| of(o)).count();
    let (possible, agree, refined) = (count(|o| o.0), count(|o| o.1), count(|o| o.2));
    assert!(
        (tasks * 2 / 5..tasks * 3 / 4).contains(&possible)
            && agree * 20 > tasks * 19
            && refined * 50 >= tasks,
        "{possible} {agree} {refined}"
    );
}

/// Branch and bound returns the schemes, front and ties of exhaustion for every task, and excludes sequences.
#[test]
fn what_a_bound_leaves_out_is_not_missed() {
    bounds_miss_nothing(24);
}

/// Branch and bound against exhaustion, 400 tasks.
#[test]
#[ignore = "full length, for `.ci/run release`"]
fn what_a_bound_leaves_out_is_not_missed_at_length() {
    bounds_miss_nothing(400);
}

fn bounds_miss_nothing(tasks: u64) {
    let outcomes: Vec<(bool, u64)> = (0..tasks)
        .into_par_iter()
        .map(|seed| {
            let mut t = task(seed);
            // the prior counts in every prefix of a sequence
            let known =
                [("D", 0.3), ("psi", 1e-3), ("psi_z", 1e-4)].map(|(name, value)| (name.to_string(), value));
            let stated = known.into_iter().map(|(name, value)| Assignment { name, value });
            t.conditions.priors.extend(stated.take(seed as usize % 4));
            let all = prepared(&t).0;
            let search = SequenceSearch {
                rows: &all.rows,
                evaluator: &all.evaluator,
                criterion: &all.criterion,
                constraints: &all.constraints,
                keep: 1 + seed as usize % 4,
                floor: all.floor,
                slew_sequences: false,
                progress: &on,
            };
            let (symmetry, k) =
                (CandidateSymmetry::none(all.candidates.names.len()), t.options.positions.expect("a number"));
            let (whole, pruned) = (search.exhaust(&symmetry, k), search.exhaust_pruned(&symmetry, k, seed));
            assert_eq!(pruned.found, whole.found, "{seed}");
            assert_eq!(pruned.front, whole.front, "{seed}");
            assert_eq!(pruned.ties, whole.ties, "{seed}");
            assert!(
                pruned.complete && pruned.examined <= whole.examined && pruned.lost <= whole.lost,
                "{seed}"
            );
            assert!(pruned.excluded + pruned.examined >= whole.examined, "{seed}: {pruned:?}");
            (!whole.found.is_empty(), pruned.excluded)
        })
        .collect();
    let (found, excluded) =
        (outcomes.iter().filter(|o| o.0).count(), outcomes.iter().map(|o| o.1).sum::<u64>());
    assert!(found as u64 * 8 > tasks * 3 && excluded * 2 > tasks * 25, "{found} {excluded}");
}

/// Five of six candidates suffice, with slews of at most a quarter turn: six positions stay possible, since
/// repeating a position needs no slew.
#[test]
#[ignore = "seconds: .ci/run"]
fn a_position_more_is_never_impossible_when_repeating_costs_nothing() {
    let mut candidates = Candidates::default();
    for text in ["0,0,0", "30,10,5", "10,35,20", "-20,15,30", "15,-25,-30", "180,40,10"] {
        candidates.add(obsdeg_core::model::parse_attitude(text).expect("angles"));
    }
    let conditions = Conditions { slew_rate_deg_s: Some(1.0), ..super::quiet() };
    let found = |k: usize| {
        let required = ["D_F", "D_O", "D_S"].map(String::from).to_vec();
        let options = DesignOptions {
            candidates: candidates.clone(),
            required,
            slew_s: Some(90.0),
            ..options(Some(k))
        };
        let found = design(&super::base(Carry::Inertial), &conditions, &options, &on).expect("designed");
        (found.found[0].worst_degree, found.found[0].value)
    };
    assert!(found(6) <= found(5));
}

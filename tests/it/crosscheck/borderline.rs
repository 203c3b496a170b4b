//! Cross-checks at the edge of degeneracy: correct verdicts cause no disagreement, wrong ones do.

use obsdeg_core::degree::Status;
use obsdeg_core::model::{Angle, Carry, Scheme};
use obsdeg_evidence::crosscheck::{
    Agreement, CrossCheck, CrossCheckOptions, FilterChange, crosscheck, crosscheck_against,
};
use obsdeg_evidence::prediction::Prediction;
use obsdeg_evidence::simulation::{Conditions, Plan};
use obsdeg_exact::SplitMix64;

/// Scheme with positions that nearly coincide, are nearly opposite or nearly cardinal, or with a latitude
/// near a pole or the equator.
fn borderline(seed: u64) -> Scheme {
    const DEGREE: i64 = 1_000_000_000;
    let mut rng = SplitMix64::new(seed ^ 0x626f_7264_6572);
    let mut pick = |n: usize| rng.below(n as u64) as usize;
    let (kind, axis, carry) = (pick(4), pick(3), Carry::ALL[pick(3)]);
    let sign = 1 - 2 * pick(2) as i64;
    let near_zero = [10_000_000, 3_000_000, 1_000_000, 300_000, 100_000];
    let near_half = [1_000_000, 100_000, 10_000, 1000, 100, 10, 1];
    let cardinal = |k: usize| (k as i64 - 1) * 90 * DEGREE;
    let mut places = vec![[0; 3]; 2];
    let mut latitude = ["28.2", "0", "90", "-45"][pick(4)];
    match kind {
        0 => places[1][axis] = sign * near_zero[pick(5)],
        1 => places[1][axis] = sign * (180 * DEGREE - near_half[pick(7)] * (1 - 2 * pick(2) as i64)),
        2 => {
            places = (0..2 + pick(3)).map(|_| std::array::from_fn(|_| cardinal(pick(4)))).collect();
            let off = if pick(2) == 0 { near_zero[pick(5)] } else { near_half[pick(7)] };
            let place = pick(places.len());
            places[place][axis] += sign * off;
        }
        _ => {
            places = (0..2 + pick(3)).map(|_| std::array::from_fn(|_| cardinal(pick(4)))).collect();
            latitude = ["89.9999", "89.999999999", "-89.999", "0.0001", "-0.000000001", "0.01"][pick(6)];
        }
    }
    let terms = ["F,I,O,S", "F,I,O,S", "F,I", "F,S,IO", "I,II"][pick(5)];
    Scheme {
        carry,
        latitude: latitude.parse().ok(),
        unknowns: terms.parse().expect("terms"),
        ..Scheme::of_angles(places.into_iter().map(|p| p.map(Angle::from_nanodeg)))
    }
}

fn options(seed: u64) -> CrossCheckOptions {
    CrossCheckOptions { runs: 2, seed, filter: FilterChange::default() }
}

fn checked(seed: u64, scheme: &Scheme) -> CrossCheck {
    crosscheck(scheme, &Conditions::default(), &options(seed), &|_| true).expect("an answer")
}

/// Asserts that every check that is not resolvable states a reason.
fn explained(c: &CrossCheck) {
    assert_eq!(c.unresolved.len(), c.counts.not_resolvable, "{:?}", c.unresolved);
}

/// Correct verdicts on schemes at the edge: no check disagrees, and most are resolved.
#[expect(clippy::print_stdout, reason = "the figures of a long run")]
fn right_verdicts(seeds: std::ops::Range<u64>) {
    let (mut agree, mut open, mut wrong) = (0, 0, Vec::new());
    for seed in seeds {
        let s = borderline(seed);
        let c = checked(seed, &s);
        explained(&c);
        if !c.verdicts_agree {
            println!("{seed} {s:?}: {:?}", c.disagreements);
            wrong.push(seed);
        }
        (agree, open) = (agree + c.counts.agree, open + c.counts.not_resolvable);
    }
    println!("{agree} agree, {open} not resolvable");
    assert!(wrong.is_empty(), "{wrong:?} disagree");
    assert!(open * 10 <= agree, "{agree} agree, {open} not resolvable");
}

/// Falsified prediction, outcomes of the checks that must detect it, and the index of the change.
type Falsified = (Prediction, fn(&CrossCheck, usize) -> [Agreement; 2], usize);

/// Changes one degree by one.
fn another_degree(right: &Prediction, rng: &mut SplitMix64) -> Option<Falsified> {
    let of: Vec<usize> = (0..right.unknowns.len()).filter(|&i| right.unknowns[i].degree.is_some()).collect();
    let i = *of.get(rng.below(of.len().max(1) as u64) as usize)?;
    let mut wrong = right.clone();
    let degree = &mut wrong.unknowns[i].degree;
    *degree = degree.map(|d| if d > 0 && rng.below(2) == 0 { d - 1 } else { d + 1 });
    Some((wrong, |c, i| [c.quantities[i].degree_slope.outcome; 2], i))
}

/// Declares an unobservable unknown observable.
fn declared_observable(right: &Prediction, rng: &mut SplitMix64) -> Option<Falsified> {
    let of: Vec<usize> = (0..right.unknowns.len()).filter(|&i| right.unknowns[i].degree.is_none()).collect();
    let i = *of.get(rng.below(of.len().max(1) as u64) as usize)?;
    let mut wrong = right.clone();
    (wrong.unknowns[i].status, wrong.unknowns[i].degree) = (Status::Observable, Some(rng.below(3) as usize));
    Some((wrong, |c, i| [c.quantities[i].degree_slope.outcome, c.quantities[i].status_outcome], i))
}

/// Changes one entry of a null vector by a thousandth, in the null space of the derivatives or of the dwells.
fn another_entry(right: &Prediction, rng: &mut SplitMix64) -> Option<Falsified> {
    let mut wrong = right.clone();
    let dwells = rng.below(2) == 0;
    let vectors = if dwells { &mut wrong.null_space } else { wrong.unseen_by_derivatives.as_mut()? };
    let of: Vec<usize> = (0..vectors.len()).filter(|&i| vectors[i].len() > 1).collect();
    let vector = &mut vectors[*of.get(rng.below(of.len().max(1) as u64) as usize)?];
    let k = rng.below(vector.len() as u64) as usize;
    vector[k].1 *= 1.001;
    Some((wrong, |c, i| [c.spaces[i].outcome; 2], if dwells { 3 } else { 1 }))
}

/// Falsifies verdicts on schemes at the edge, `count` of each kind. Every resolved check catches its change,
/// and at least 95 % are resolved.
#[expect(clippy::print_stdout, reason = "the figures of a long run")]
fn wrong_verdicts(count: usize, scheme: impl Fn(u64) -> Scheme) {
    let kinds = [another_degree, declared_observable, another_entry];
    for (kind, falsify) in kinds.into_iter().enumerate() {
        let (mut caught, mut open) = (0, 0);
        for seed in 10_000.. {
            if caught + open == count {
                break;
            }
            let s = scheme(seed);
            let plan = Plan::new(&s, &Conditions::default()).expect("a plan");
            let rates = [plan.point.w_n, plan.point.w_u];
            let right = Prediction::new(&plan.platform, rates, 1).expect("a prediction");
            let Some((wrong, of, at)) = falsify(&right, &mut SplitMix64::new(seed)) else { continue };
            let c = crosscheck_against(&wrong, &s, &Conditions::default(), &options(seed), &|_| true);
            let c = c.expect("an answer");
            explained(&c);
            if c.passed || c.verdicts_agree {
                // an uncaught change is one whose check is not resolvable
                let outcomes = of(&c, at);
                assert!(outcomes.contains(&Agreement::NotResolvable), "{kind} {seed} {s:?} is not caught");
                open += 1;
            } else {
                caught += 1;
            }
        }
        println!("kind {kind}: {caught} caught, {open} not resolvable");
        assert!(caught * 20 >= count * 19, "kind {kind}: {caught} of {count}");
    }
}

#[test]
fn schemes_at_the_edge_agree() {
    right_verdicts(0..16);
    // the filter in doubles shows the values that many digits give for its own sample times
    for seed in [218, 329] {
        let c = checked(seed, &borderline(seed));
        assert!(c.verdicts_agree, "{seed}: {:?}", c.disagreements);
        for why in c.unresolved.iter().filter(|w| w.contains("too narrow to show")) {
            let after = |label: &str| {
                let number = why.split(label).nth(1)?.split([':', ' ']).next()?;
                number.parse::<f64>().ok()
            };
            let measured = after("inflation ").or_else(|| after("correlation ")).expect("a number");
            let exact = after("many digits ").expect("a number");
            assert!((measured - exact).abs() < 1e-3 * exact.abs(), "{seed}: {why}");
            assert!(why.contains("the filter in doubles shows the same"), "{seed}: {why}");
        }
    }
    // an ordinary gimbal readout, and separations on both sides of the prior's width
    for (angle, open) in [("180.001", 1), ("0.001", 6), ("179.99999", 5)] {
        let c = checked(1, &crate::schemes::scheme(&["0,0,0", &format!("{angle},0,0")], Carry::Platform));
        explained(&c);
        assert!(c.verdicts_agree && c.counts.not_resolvable == open, "{angle}: {:?}", c.unresolved);
        assert!(c.unresolved.iter().all(|w| w.contains("too narrow to show")), "{:?}", c.unresolved);
    }
}

#[test]
fn wrong_verdicts_at_the_edge_are_caught() {
    wrong_verdicts(8, borderline);
}

/// Minutes: `cargo test --test it -- --ignored many_schemes_at_the_edge --nocapture`.
#[test]
#[ignore = "minutes"]
fn many_schemes_at_the_edge_agree() {
    right_verdicts(0..500);
}

/// Minutes: `cargo test --test it -- --ignored many_wrong_verdicts --nocapture`.
#[test]
#[ignore = "minutes"]
fn many_wrong_verdicts_are_caught() {
    wrong_verdicts(200, borderline);
    wrong_verdicts(200, |seed| super::drawn::drawn(seed, false));
}

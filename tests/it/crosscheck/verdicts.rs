//! Deliberately wrong verdicts are caught by the cross-check.

use obsdeg_core::degree::Status;
use obsdeg_core::model::{Carry, Scheme};
use obsdeg_evidence::crosscheck::{CrossCheck, CrossCheckOptions, FilterChange, crosscheck_against};
use obsdeg_evidence::prediction::{PredictedUnknown, Prediction};
use obsdeg_evidence::simulation::{Conditions, Plan};

use crate::schemes::{paper, scheme};

/// Predicted verdicts of a scheme, as numbers.
fn predicted(scheme: &Scheme) -> Prediction {
    let plan = Plan::new(scheme, &Conditions::default()).expect("a plan");
    Prediction::new(&plan.platform, [plan.point.w_n, plan.point.w_u], 1).expect("a prediction")
}

/// Cross-checks a prediction against a scheme.
fn held(prediction: &Prediction, scheme: &Scheme) -> CrossCheck {
    let options = CrossCheckOptions { runs: 2, seed: 1, filter: FilterChange::default() };
    crosscheck_against(prediction, scheme, &Conditions::default(), &options, &|_| true).expect("checked")
}

/// Every field of a verdict is checked: one field after the other is changed, for the first unknown of every
/// kind.
#[test]
fn wrong_verdicts_are_caught() {
    wrong_words_are_caught(&scheme(&["0,0,0", "90,0,0", "0,90,0"], Carry::Inertial), false);
}

/// Every field of the verdicts on all unknowns of p1 p2 is checked.
#[test]
#[ignore = "a minute: .ci/run release"]
fn wrong_verdicts_on_every_unknown_are_caught() {
    wrong_words_are_caught(&paper(Carry::Platform), true);
}

fn wrong_words_are_caught(s: &Scheme, on_every_unknown: bool) {
    type Change = Box<dyn Fn(&mut Prediction)>;
    let right = predicted(s);
    let c = held(&right, s);
    assert!(c.passed && c.counts.not_resolvable == 0, "{:?}", c.disagreements);
    let mut wrong: Vec<(String, Change)> = Vec::new();
    let mut add = |what: String, change: Change| wrong.push((what, change));
    // the first unknown of every kind; the others are judged alike
    let kind = |u: &PredictedUnknown| (u.status, u.degree, u.accuracy_order, u.order_at_end);
    let is_first = |i: usize| right.unknowns[..i].iter().all(|u| kind(u) != kind(&right.unknowns[i]));
    let chosen = (0..right.unknowns.len()).filter(|&i| on_every_unknown || is_first(i));
    for (i, u) in chosen.map(|i| (i, &right.unknowns[i])) {
        if u.degree.is_some() {
            add(
                format!("degree {i} + 1"),
                Box::new(move |p| p.unknowns[i].degree = p.unknowns[i].degree.map(|d| d + 1)),
            );
            add(
                format!("not observable {i}"),
                Box::new(move |p| (p.unknowns[i].status, p.unknowns[i].degree) = (Status::Inseparable, None)),
            );
        } else {
            add(
                format!("observable {i}"),
                Box::new(move |p| {
                    (p.unknowns[i].status, p.unknowns[i].degree) = (Status::Observable, Some(1))
                }),
            );
            let other = [Status::Inseparable, Status::NotExcited];
            let swapped = other[usize::from(u.status == Status::Inseparable)];
            add(format!("status {i}"), Box::new(move |p| p.unknowns[i].status = swapped));
        }
        let others = u.partners.len();
        if others > 0 {
            add(
                format!("a partner of {i} less"),
                Box::new(move |p| p.unknowns[i].partners.truncate(others - 1)),
            );
            add(format!("no partners of {i}"), Box::new(move |p| p.unknowns[i].partners.clear()));
        }
        add(
            format!("a partner of {i} more"),
            Box::new(move |p| {
                let own = &mut p.unknowns[i].partners;
                let other = (0..).find(|c| *c != i && !own.contains(c)).expect("another");
                own.push(other);
            }),
        );
        if u.accuracy_order.is_some() {
            add(
                format!("order {i} + 1"),
                Box::new(move |p| p.unknowns[i].accuracy_order = p.unknowns[i].accuracy_order.map(|d| d + 1)),
            );
            add(format!("no order {i}"), Box::new(move |p| p.unknowns[i].accuracy_order = None));
        }
        add(
            format!("order at the end {i}"),
            Box::new(move |p| {
                p.unknowns[i].order_at_end = p.unknowns[i].order_at_end.map_or(Some(1), |d| Some(d + 1))
            }),
        );
        add(
            format!("determined at the end {i}"),
            Box::new(move |p| p.unknowns[i].determined_at_end = !p.unknowns[i].determined_at_end),
        );
    }
    add(
        "all degrees + 3".into(),
        Box::new(|p| {
            p.unknowns.iter_mut().for_each(|u| u.degree = u.degree.map(|d| d + 3));
        }),
    );
    add(
        "nothing excited".into(),
        Box::new(|p| {
            p.unknowns.iter_mut().for_each(|u| (u.status, u.degree) = (Status::NotExcited, None));
        }),
    );
    for (i, c) in right.combinations.iter().enumerate() {
        add(format!("without combination {i}"), Box::new(move |p| drop(p.combinations.remove(i))));
        add(
            format!("combination {i} twice"),
            Box::new(move |p| {
                let again = p.combinations[i].clone();
                p.combinations.push(again);
            }),
        );
        add(
            format!("degree of combination {i}"),
            Box::new(move |p| p.combinations[i].degree = p.combinations[i].degree.map(|d| d + 1)),
        );
        for k in 0..c.terms.len() {
            add(
                format!("coefficient {k} of combination {i}"),
                Box::new(move |p| p.combinations[i].terms[k].1 *= 1.001),
            );
        }
    }
    let vectors = right.unseen_by_derivatives.as_ref().expect("numbers");
    fn list(p: &mut Prediction) -> &mut Vec<obsdeg_evidence::prediction::Combination> {
        p.unseen_by_derivatives.as_mut().expect("numbers")
    }
    add("no null space".into(), Box::new(|p| list(p).clear()));
    for (i, v) in vectors.iter().enumerate() {
        add(format!("without null vector {i}"), Box::new(move |p| drop(list(p).remove(i))));
        add(
            format!("null vector {i} twice"),
            Box::new(move |p| {
                let again = list(p)[i].clone();
                list(p).push(again);
            }),
        );
        add(
            format!("null vector {i} for all"),
            Box::new(move |p| {
                let again = list(p)[i].clone();
                let (n, unknowns) = (list(p).len(), p.unknowns.len());
                // a single vector is replaced by an observable direction
                let other = vec![vec![(unknowns - 1, 1.0)]; n];
                *list(p) = if n > 1 { vec![again; n] } else { other };
            }),
        );
        for k in 0..v.len() {
            add(format!("component {k} of null vector {i}"), Box::new(move |p| list(p)[i][k].1 *= 1.001));
        }
    }
    for (i, v) in right.null_space.iter().enumerate().filter(|(_, v)| v.len() > 1) {
        for k in 0..v.len() {
            add(format!("component {k} with dwells {i}"), Box::new(move |p| p.null_space[i][k].1 *= 1.001));
        }
    }
    add("nothing unseen with dwells".into(), Box::new(|p| p.null_space.clear()));
    for i in 0..right.null_space.len() {
        add(format!("without {i} with dwells"), Box::new(move |p| drop(p.null_space.remove(i))));
        add(
            format!("{i} twice with dwells"),
            Box::new(move |p| {
                let last = p.null_space.len() - 1;
                let other = if i == last { 0 } else { last };
                p.null_space[other] = p.null_space[i].clone();
                if last == 0 {
                    p.null_space.push(p.null_space[0].clone());
                }
            }),
        );
    }
    add("rank + 1".into(), Box::new(|p| p.rank += 1));
    for k in 0..right.rank_profile.len() {
        add(format!("dim V_{k}"), Box::new(move |p| p.rank_profile[k] += 1));
    }
    assert!(wrong.len() > 40);
    // every day one change of three, of any unknown
    let step = if on_every_unknown { 1 } else { 3 };
    for (what, change) in wrong.into_iter().step_by(step) {
        let mut prediction = right.clone();
        change(&mut prediction);
        if prediction == right {
            continue;
        }
        let c = held(&prediction, s);
        // the conditions of exit code 1
        assert!(!c.passed && !c.verdicts_agree && c.counts.disagree > 0, "{what} is not caught");
    }
}

/// Verdicts on another carry, mounting, attitude or latitude are caught. Signs of S_i change two at a time,
/// so that the axes stay right-handed.
#[test]
fn verdicts_on_something_else_are_caught() {
    let s = scheme(&["0,0,0", "90,0,0", "0,90,0"], Carry::Platform);
    let mounted = |gyro: usize, kept: usize| {
        let mut geometry = s.geometry;
        let gyro = [&mut geometry.X, &mut geometry.Y, &mut geometry.Z].into_iter().nth(gyro).expect("a gyro");
        let axes = [&mut gyro.I, &mut gyro.O, &mut gyro.S];
        axes.into_iter().enumerate().filter(|(k, _)| *k != kept).for_each(|(_, a)| a.negative ^= true);
        Scheme { geometry, ..s.clone() }
    };
    let mut mountings = 0;
    for other in (0..9).map(|k| mounted(k / 3, k % 3)) {
        let (wrong, right) = (predicted(&other), predicted(&s));
        // mountings with the same verdicts are skipped
        if wrong != right {
            let c = held(&wrong, &s);
            assert!(!c.passed && !c.verdicts_agree, "{other:?}");
            mountings += 1;
        }
    }
    assert!(mountings >= 6, "{mountings}");
    for other in [
        Scheme { carry: Carry::Inertial, ..s.clone() },
        scheme(&["0,0,0", "90,0,0", "0,90,30"], Carry::Platform),
        Scheme { latitude: "90".parse().ok(), ..s.clone() },
    ] {
        let c = held(&predicted(&other), &s);
        assert!(!c.passed && !c.verdicts_agree, "{other:?}");
    }
}

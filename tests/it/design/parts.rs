//! Exhaustive searches in parts: the merged answer equals that of the whole search, byte for byte. A foreign
//! or changed part is refused with its name.

use std::sync::atomic::{AtomicU64, Ordering};

use obsdeg_design::design::{
    Candidates, CriterionName, Design, DesignError, DesignOptions, Part, PartError, PartsReport, design,
    design_merged, design_part, design_starts,
};

use super::*;

fn json<T: serde::Serialize>(what: &T) -> String {
    serde_json::to_string(what).expect("JSON")
}

fn read(part: &Part) -> Part {
    serde_json::from_str(&json(part)).expect("a part")
}

/// Splits a merged answer into the answer of the whole search and the report on the parts.
fn without_parts(merged: &Design) -> (Design, PartsReport) {
    let mut rest = merged.clone();
    let parts = rest.search.as_mut().and_then(|s| s.parts.take()).expect("parts");
    assert_eq!(parts.versions, [env!("CARGO_PKG_VERSION")]);
    (rest, parts)
}

/// Search tasks whose answers have fronts, ties and several worst degrees.
fn tasks() -> Vec<(Scheme, Conditions, DesignOptions)> {
    let all = Candidates::cardinals();
    let some = |names: &[&str]| {
        let place = |n: &&str| all.names.iter().position(|c| c == n).expect("a candidate");
        Candidates {
            names: names.iter().map(ToString::to_string).collect(),
            attitudes: names.iter().map(|n| all.attitudes[place(n)].clone()).collect(),
        }
    };
    let slews = Conditions { slew_rate_deg_s: Some(1.0), ..quiet() };
    let few = some(&["NUE", "NDW", "SUW", "UWS", "EDN", "DWN"]);
    let with = |candidates: Candidates, positions, keep| DesignOptions {
        candidates,
        keep,
        required: vec!["D_F".into()],
        ..options(Some(positions))
    };
    vec![
        (base(Carry::Inertial), slews.clone(), with(few.clone(), 4, 7)),
        (base(Carry::Inertial), slews, DesignOptions { total_s: Some(3300.0), ..with(few.clone(), 3, 400) }),
        (base(Carry::Platform), quiet(), DesignOptions { criterion: CriterionName::D, ..with(few, 4, 3) }),
        (base(Carry::Reset), quiet(), with(all.clone(), 4, 12)),
        (base(Carry::Reset), quiet(), with(all.clone(), 1, 4)),
    ]
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(work)
}

#[test]
#[ignore = "seconds: .ci/run"]
fn parts_together_are_the_whole() {
    parts_are_the_whole(&[3]);
}

/// Parts against the whole search, with more parts than some tasks have starts.
#[test]
#[ignore = "full length, for `.ci/run release`"]
fn parts_together_are_the_whole_at_length() {
    parts_are_the_whole(&[1, 2, 7, 64]);
}

fn parts_are_the_whole(numbers: &[usize]) {
    for (i, (base, conditions, options)) in tasks().iter().enumerate() {
        let whole = design(base, conditions, options, &on);
        let starts = design_starts(base, conditions, options).expect("starts");
        assert!(starts > 0);
        assert_eq!(whole.is_ok(), i < 4, "{i}");
        for &of in numbers {
            let part = |number: usize| {
                let part = on_threads(1 + number % 2, || {
                    design_part(base, conditions, options, [number, of], None, &on).expect("a part")
                });
                assert_eq!(part, read(&part));
                assert!(part.complete);
                (format!("part-{number}.json"), read(&part))
            };
            let mut parts: Vec<(String, Part)> = (1..=of).map(part).collect();
            let covered: usize = parts.iter().map(|(_, p)| p.starts[1] - p.starts[0]).sum();
            assert_eq!(covered, starts);
            for turn in 0..3 {
                match turn {
                    1 => parts.reverse(),
                    2 => parts.rotate_left(of / 3),
                    _ => {}
                }
                let merged = on_threads(1 + turn % 2, || {
                    design_merged(base, conditions, options, &parts, of % 3, &on)
                });
                match (&whole, &merged) {
                    (Ok(whole), Ok(merged)) => {
                        let (rest, parts) = without_parts(merged);
                        assert_eq!(json(whole), json(&rest), "{i} {of} {turn}");
                        assert_eq!(parts.parts, of);
                        assert_eq!(parts.searched_again, (of % 3).min(parts.blocks));
                    }
                    (Err(a), Err(b)) => assert_eq!(a, b, "{i} {of} {turn}"),
                    _ => panic!("{i} {of} {turn}: {whole:?} {merged:?}"),
                }
            }
        }
        if let Ok(whole) = whole {
            assert!(whole.search.as_ref().expect("a search").proven);
            assert_eq!(serde_json::from_str::<Design>(&json(&whole)).expect("an answer"), whole);
        }
    }
}

/// A part that is interrupted anywhere and resumed equals the uninterrupted part.
#[test]
fn an_interrupted_part_goes_on() {
    let (base, conditions, options) = &tasks()[0];
    let whole = design_part(base, conditions, options, [2, 3], None, &on).expect("a part");
    let mut interruptions = 0;
    for patience in [1, 2, 5, 17, 100] {
        let mut part = None;
        loop {
            let asked = AtomicU64::new(0);
            let some = |_: Progress| asked.fetch_add(1, Ordering::Relaxed) < patience * (1 + interruptions);
            match design_part(base, conditions, options, [2, 3], part.take(), &some) {
                Ok(found) if found.complete => {
                    assert_eq!(json(&found), json(&whole));
                    break;
                }
                Ok(found) => part = Some(read(&found)),
                Err(e) => assert_eq!(e, DesignError::Interrupted),
            }
            interruptions += 1;
        }
    }
    assert!(interruptions > 5, "{interruptions}");
    // an unfinished part is refused
    let unfinished = Part { complete: false, ..whole }.sealed();
    let error = design_merged(base, conditions, options, &[("a.json".into(), unfinished)], 0, &on);
    assert!(error.expect_err("unfinished").to_string().starts_with("a.json: part 2 of 3 was interrupted"));
}

#[test]
fn what_does_not_belong_is_refused_by_name() {
    let (base, conditions, options) = &tasks()[3];
    let part = |number, of| design_part(base, conditions, options, [number, of], None, &on).expect("a part");
    let named = |list: &[(&str, &Part)]| -> Vec<(String, Part)> {
        list.iter().map(|(name, part)| (name.to_string(), (*part).clone())).collect()
    };
    let refused = |list: &[(&str, &Part)]| {
        design_merged(base, conditions, options, &named(list), 0, &on).expect_err("refused").to_string()
    };
    let [one, two, three] = [1, 2, 3].map(|i| part(i, 3));
    assert_eq!(refused(&[("a", &one), ("c", &three)]), "missing of 3 parts: 2");
    assert_eq!(refused(&[("b", &two)]), "missing of 3 parts: 1, 3");
    assert_eq!(refused(&[("a", &one), ("b", &two), ("c", &one)]), "c: part 1 of 3 is in a too");
    let other = part(1, 2);
    let message = refused(&[("a", &one), ("b", &other), ("c", &three)]);
    assert_eq!(message, "b: it is part 1 of 2; expected a part of 3");
    // parts of a search with other inputs: the message names the difference
    let others = [
        (
            base.clone(),
            Conditions { dwell_s: 999.0, ..conditions.clone() },
            options.clone(),
            "simulation.dwell_s is 999, here 1000",
        ),
        (
            base.clone(),
            conditions.clone(),
            DesignOptions { keep: 11, ..options.clone() },
            "--keep is 11, here 12",
        ),
        (
            base.clone(),
            conditions.clone(),
            DesignOptions { criterion: CriterionName::E, seed: 3, ..options.clone() },
            "--criterion is e, here worst; --seed is 3, here 1",
        ),
        (
            Scheme { latitude: "30".parse().ok(), ..base.clone() },
            conditions.clone(),
            options.clone(),
            "latitude_deg is 30, here 28.2",
        ),
    ];
    for (base, conditions, options, why) in others {
        let foreign = design_part(&base, &conditions, &options, [2, 3], None, &on).expect("a part");
        let message = refused(&[("a", &one), ("b", &foreign), ("c", &three)]);
        assert_eq!(message, format!("b: it is a part of another search: {why}"));
    }
    // edited parts, with the old digest and with a new one
    let tampered = Part { digest: two.digest.replace(|c: char| c.is_ascii_digit(), "0"), ..two.clone() };
    let message = refused(&[("a", &one), ("b", &tampered), ("c", &three)]);
    assert!(message.starts_with("b: it was changed after it was written"), "{message}");
    let message = refused(&[("a", &one), ("b", &tampered.sealed()), ("c", &three)]);
    assert_eq!(message, "b: it is a part of another search: its digest is not that of these inputs");
    let tampered = Part { starts: [one.starts[0], one.starts[1] + 1, one.starts[2]], ..one.clone() }.sealed();
    assert!(refused(&[("a", &tampered), ("b", &two), ("c", &three)]).starts_with("a: it has the starts"));
    let mut tampered = two.clone();
    tampered.levels[0].next -= 1;
    let unfinished = "b: part 2 of 3 was interrupted";
    assert!(refused(&[("a", &one), ("b", &tampered.sealed()), ("c", &three)]).starts_with(unfinished));
    let tampered = Part { levels: Vec::new(), ..two.clone() }.sealed();
    assert!(refused(&[("a", &one), ("b", &tampered), ("c", &three)]).starts_with(unfinished));
    for wrong in [[0, 3], [4, 3], [1, 0]] {
        let tampered = Part { part: wrong, ..two.clone() }.sealed();
        assert!(
            refused(&[("a", &one), ("b", &tampered), ("c", &three)]).starts_with("b: it is no part"),
            "{wrong:?}"
        );
        assert!(design_part(base, conditions, options, wrong, None, &on).is_err());
    }
    let resumed = design_part(base, conditions, options, [1, 3], Some(two), &on).expect_err("another part");
    let why = PartError::Number { found: [2, 3], expected: [1, 3] };
    assert_eq!(resumed, DesignError::Part { name: "the part to go on with".into(), why });
}

/// Parts have similar amounts of work, even where most sequences begin with the first starts.
#[test]
fn parts_share_the_work() {
    let all = DesignOptions { criterion: CriterionName::D, keep: 1, ..options(Some(6)) };
    let tasks = [
        (base(Carry::Reset), DesignOptions { required: vec!["D_F".into()], ..all.clone() }),
        (base(Carry::Inertial), DesignOptions { positions: Some(4), required: vec!["D_F".into()], ..all }),
    ];
    for (base, options) in tasks {
        let examined = [1, 2, 3].map(|number| {
            let part = design_part(&base, &quiet(), &options, [number, 3], None, &on).expect("a part");
            part.levels.iter().map(|level| level.best.examined).sum::<u64>()
        });
        let (least, most) = (examined.iter().min(), examined.iter().max());
        assert!(most.zip(least).is_some_and(|(most, least)| *most < 2 * least), "{examined:?}");
    }
}

/// Changed parts with a new digest are refused: listed schemes are evaluated again, counts must add up, and a
/// repeated search of a block must give the same result.
#[test]
fn what_no_search_writes_is_refused() {
    let (base, conditions, options) = &tasks()[0];
    let part = |number| design_part(base, conditions, options, [number, 3], None, &on).expect("a part");
    let [one, two, three] = [1, 2, 3].map(part);
    let merged = |changed: &Part, check: usize| {
        let named =
            [("a", &one), ("b", changed), ("c", &three)].map(|(name, part)| (name.into(), part.clone()));
        design_merged(base, conditions, options, &named, check, &on)
    };
    let whole = merged(&two, 0).expect("the whole");
    assert!(!whole.search.as_ref().and_then(|s| s.parts.as_ref()).expect("parts").is_repeated());
    let repeated = merged(&two, usize::MAX).expect("the whole");
    assert!(repeated.search.as_ref().and_then(|s| s.parts.as_ref()).expect("parts").is_repeated());
    assert_eq!(without_parts(&repeated).0, without_parts(&whole).0);
    type Change = fn(&mut Part);
    let changes: [(Change, &str); 16] = [
        // the edit of a report: two positions of the first scheme swapped, and a criterion that no scheme has
        (
            |p| {
                p.levels[0].best.found[0].sequence.swap(1, 2);
                p.levels[0].best.found[0].score.value = 0.001;
            },
            "b: it lists ",
        ),
        (|p| p.levels[0].best.found[0].score.value = 0.001, "; evaluated again: "),
        (|p| p.levels[0].best.found[0].score.degree = 0, "judged again: "),
        (|p| p.levels[0].best.found[0].score.violation = 1.0, "a constraint that is not kept"),
        (|p| p.levels[0].best.found[0].seconds -= 1.0, " s in all; evaluated again: "),
        (|p| p.levels[0].best.found[0].sequence.truncate(3), "3 positions; expected 4"),
        (|p| p.levels[0].best.found[0].sequence[3].candidate = 9999, "candidate 9999; expected 0 to 5"),
        (|p| p.levels[0].best.found.clear(), "part 2 of 3 was interrupted"),
        (|p| p.levels[0].best.found.reverse(), "not in the order"),
        (|p| drop(p.levels[0].best.front.pop()), ""),
        (|p| p.levels[0].best.examined += 1, "blocks up to start"),
        (|p| p.levels[0].best.excluded += 1, "blocks up to start"),
        (
            |p| {
                p.levels[0].best.excluded += 1;
                p.levels[0].blocks[0].counts[1] += 1;
            },
            "excluded by a bound that is not used",
        ),
        (
            |p| {
                p.levels[0].best.examined += 1_000_000;
                p.levels[0].blocks[0].counts[0] += 1_000_000;
            },
            " exist",
        ),
        (|p| drop(p.levels[0].blocks.pop()), ""),
        (|p| p.levels[0].best.ties = Default::default(), "tie with the first"),
    ];
    for (change, expected) in changes {
        let mut changed = two.clone();
        change(&mut changed);
        let unsealed = merged(&changed, 0).expect_err("changed").to_string();
        assert!(unsealed.starts_with("b: it was changed after it was written"), "{unsealed}");
        let message = merged(&changed.sealed(), 0).expect_err(expected).to_string();
        assert!(message.starts_with("b: ") && message.contains(expected), "{message}; {expected}");
    }
    // sequences that were never searched: only a repeated search finds this
    let mut forged = two.clone();
    let best = &mut forged.levels[0].best;
    let left_out = best.examined / 2;
    best.examined -= left_out;
    forged.levels[0].blocks[0].counts[0] -= left_out;
    let forged = forged.sealed();
    let believed = merged(&forged, 0).expect("believed, as the answer says");
    assert!(!believed.search.as_ref().and_then(|s| s.parts.as_ref()).expect("parts").is_repeated());
    let message = merged(&forged, usize::MAX).expect_err("searched again").to_string();
    assert!(
        message.starts_with("b: its starts ") && message.contains("sequences were examined"),
        "{message}"
    );
}

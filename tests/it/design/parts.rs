//! Exhaustive searches in parts: put together they are the whole, byte for byte; what does not belong is refused by name.

use std::sync::atomic::{AtomicU64, Ordering};

use obsdeg_design::design::{
    Candidates, CriterionName, Design, DesignError, DesignOptions, Part, PartError, design, design_merged,
    design_part, design_starts,
};

use super::*;

fn json<T: serde::Serialize>(what: &T) -> String {
    serde_json::to_string(what).expect("JSON")
}

fn read(part: &Part) -> Part {
    serde_json::from_str(&json(part)).expect("a part")
}

/// Searches whose answers have fronts, ties and several worst degrees.
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
fn parts_together_are_the_whole() {
    for (i, (base, conditions, options)) in tasks().iter().enumerate() {
        let whole = design(base, conditions, options, &on);
        let starts = design_starts(base, conditions, options).expect("starts");
        assert!(starts > 0);
        assert_eq!(whole.is_ok(), i < 4, "{i}");
        for of in [1, 3, 7, 64] {
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
                let merged =
                    on_threads(1 + turn % 2, || design_merged(base, conditions, options, &parts, &on));
                match (&whole, &merged) {
                    (Ok(whole), Ok(merged)) => assert_eq!(json(whole), json(merged), "{i} {of} {turn}"),
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

/// Stopped anywhere and gone on with, a part is what it would have been.
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
    // it is not taken for the whole part meanwhile
    let unfinished = Part { complete: false, ..whole };
    let error = design_merged(base, conditions, options, &[("a.json".into(), unfinished)], &on);
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
        design_merged(base, conditions, options, &named(list), &on).expect_err("refused").to_string()
    };
    let [one, two, three] = [1, 2, 3].map(|i| part(i, 3));
    assert_eq!(refused(&[("a", &one), ("c", &three)]), "missing of 3 parts: 2");
    assert_eq!(refused(&[("b", &two)]), "missing of 3 parts: 1, 3");
    assert_eq!(refused(&[("a", &one), ("b", &two), ("c", &one)]), "c: part 1 of 3 is in a too");
    let other = part(1, 2);
    let message = refused(&[("a", &one), ("b", &other), ("c", &three)]);
    assert_eq!(message, "b: it is part 1 of 2; expected a part of 3");
    // of other inputs: what differs is named
    let others = [
        (
            base.clone(),
            Conditions { dwell_s: 999.0, ..conditions.clone() },
            options.clone(),
            "dwell is 999.0, here 1000.0",
        ),
        (
            base.clone(),
            conditions.clone(),
            DesignOptions { keep: 11, ..options.clone() },
            "keep is 11, here 12",
        ),
        (
            base.clone(),
            conditions.clone(),
            DesignOptions { criterion: CriterionName::E, seed: 3, ..options.clone() },
            "criterion is E, here Worst; seed is 3, here 1",
        ),
        (
            Scheme { latitude: "30".parse().ok(), ..base.clone() },
            conditions.clone(),
            options.clone(),
            "latitude differ",
        ),
    ];
    for (base, conditions, options, why) in others {
        let foreign = design_part(&base, &conditions, &options, [2, 3], None, &on).expect("a part");
        let message = refused(&[("a", &one), ("b", &foreign), ("c", &three)]);
        let expected = format!("b: it is a part of another search: {why}");
        assert!(message.starts_with(expected.trim_end_matches("differ")), "{message}");
    }
    // a digest that is not of the inputs
    let tampered = Part { digest: two.digest.replace(|c: char| c.is_ascii_digit(), "0"), ..two.clone() };
    let message = refused(&[("a", &one), ("b", &tampered), ("c", &three)]);
    assert_eq!(message, "b: it is a part of another search: its inputs are not those of its digest");
    // and what was tampered with
    let tampered = Part { starts: [one.starts[0], one.starts[1] + 1, one.starts[2]], ..one.clone() };
    assert!(refused(&[("a", &tampered), ("b", &two), ("c", &three)]).starts_with("a: it has the starts"));
    let mut tampered = two.clone();
    tampered.levels[0].next -= 1;
    assert!(
        refused(&[("a", &one), ("b", &tampered), ("c", &three)])
            .starts_with("b: part 2 of 3 was interrupted")
    );
    let tampered = Part { levels: Vec::new(), ..two.clone() };
    assert!(
        refused(&[("a", &one), ("b", &tampered), ("c", &three)])
            .starts_with("b: part 2 of 3 was interrupted")
    );
    for wrong in [[0, 3], [4, 3], [1, 0]] {
        let tampered = Part { part: wrong, ..two.clone() };
        assert!(
            refused(&[("a", &one), ("b", &tampered), ("c", &three)]).starts_with("b: it is no part"),
            "{wrong:?}"
        );
        assert!(design_part(base, conditions, options, wrong, None, &on).is_err());
    }
    let going_on = design_part(base, conditions, options, [1, 3], Some(two), &on).expect_err("another part");
    let why = PartError::Number { found: [2, 3], expected: [1, 3] };
    assert_eq!(going_on, DesignError::Part { name: "the part to go on with".into(), why });
}

/// Parts have about as much to do as each other, also where most sequences begin with the first starts.
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

//! Sentences on the time and on branches: verdicts hold where they are said to hold.

use obsdeg_core::degree::Status;
use obsdeg_core::language::{Names, evaluate_f64, parse_with};
use obsdeg_core::system::{SystemAnalysis, SystemOptions, analyze_system, model_file};

fn judged(text: &str) -> SystemAnalysis {
    let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    analyze_system(&model, SystemOptions::default()).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// The answer as printed, in one line.
fn printed(a: &SystemAnalysis) -> String {
    let text =
        obsdeg_report::written(a, obsdeg_report::Format::Table, obsdeg_report::TerminalLayout::default());
    text.expect("text").split_whitespace().collect::<Vec<_>>().join(" ")
}

fn value(text: &str, t: f64) -> f64 {
    evaluate_f64(&parse_with(text, Names::Plain).expect("an expression"), &|_| t)
}

/// x' = a + b u(t): b affects the output while u is not zero, and is separable from a while u changes. The
/// verdict holds at times on the printed side and not on the other side.
#[test]
fn verdicts_hold_on_the_side_that_is_said() {
    let model = |input: &str, time: &str| {
        format!(
            "name='m'\nparameters=['a', 'b']\n{time}\nknown_inputs={{u={{function='{input}'}}}}\n[states]\n\
             x='a + b*u'\n[outputs]\ny='x'"
        )
    };
    let times = [-9.3, -4.0, -1.7, 0.4, 2.2, 5.1, 8.3, 9.9];
    for (input, time, condition) in [
        ("1 + sign(t - 7)", "time = 'generic'", "t - 7 < 0"),
        ("1 + sign(t - 7)", "time = 8", "t - 7 > 0"),
        ("1 + sign(t - 7)", "", "t - 7 < 0"),
        ("abs(t + 3) + t + 3", "time = 'generic'", "t + 3 > 0"),
        ("abs(t + 3) + t + 3", "time = -5", "t + 3 < 0"),
        ("1 + sign(2*t^2 - 50)", "time = 'generic'", "2*t^2 - 50 < 0"),
    ] {
        let a = judged(&model(input, time));
        let said: Vec<&str> = a.branch_sides.iter().map(|s| s.condition.as_str()).collect();
        assert_eq!(said, [condition], "{input} {time}");
        assert!(a.branch_sides[0].of_time && a.equations.contains(&format!("u = {input}")));
        let text = printed(&a);
        assert!(text.contains(&format!("where {condition}")), "{text}");
        let almost_every = text.contains("almost every time where");
        assert_eq!(almost_every, time.contains("generic"), "{text}");
        let (argument, sign) = condition
            .rsplit_once(" < 0")
            .map_or_else(|| (condition.trim_end_matches(" > 0"), 1.0), |(argument, _)| (argument, -1.0));
        let mut sides = [0, 0];
        for t in times {
            let holds = value(argument, t) * sign > 0.0;
            let (u, later) = (value(input, t), value(input, t + 0.01));
            let expected = match (u == 0.0 && later == 0.0, u == later) {
                (true, _) => [Status::Observable, Status::NotExcited],
                (_, true) => [Status::Inseparable; 2],
                _ => [Status::Observable; 2],
            };
            // at a given time, an unknown that never affects the output has the status "not seen up to the
            // bound"
            let status = |n: &str| match a.quantities.iter().find(|q| q.name == n).expect("it").status {
                Status::NotSeen if expected[1] == Status::NotExcited => Status::NotExcited,
                Status::NotSeen => Status::Inseparable,
                status => status,
            };
            let found = ["a", "b"].map(status);
            assert_eq!(found == expected, holds, "{input} {time} at {t}: {found:?}");
            sides[usize::from(holds)] += 1;
        }
        assert!(sides[0] > 0 && sides[1] > 0);
    }
    // a model without branches names none
    let a = judged(&model("t^2", "time = 'generic'"));
    assert!(a.branch_sides.is_empty() && a.branches.is_empty());
    assert!(printed(&a).contains("(verdicts of almost every time)"));
}

/// Sides are printed for arguments of unknowns, of known inputs and of later segments too. An argument with a
/// given value has no side.
#[test]
fn sides_of_all_arguments_are_said() {
    let a = judged("name='m'\nparameters=['a']\n[states]\nx='-a*abs(x)'\n[outputs]\ny='x*sign(a - 9)'");
    let said: Vec<&str> = a.branch_sides.iter().map(|s| s.condition.as_str()).collect();
    assert_eq!(said, ["x > 0", "a - 9 < 0"]);
    assert!(a.branch_sides.iter().all(|s| !s.of_time));
    let text = printed(&a);
    assert!(text.contains("of one branch, where x > 0, a - 9 < 0 (chosen by unknowns near one"), "{text}");
    let a = judged(
        "name='m'\nparameters=['a']\n[states]\nx='a*sign(c)'\n[outputs]\ny='x + a*sign(t - 2)*e'\n[constants]\nc=2\n\
         e=0\n[[segment]]\n\
         [[segment]]\nconstants={e='1'}",
    );
    let said: Vec<&str> = a.branch_sides.iter().map(|s| s.condition.as_str()).collect();
    assert_eq!(said, ["t - 2 < 0"]);
}

fn judged_with(text: &str, seed: u64) -> SystemAnalysis {
    let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    let options = SystemOptions { seed, solutions: false, ..SystemOptions::default() };
    analyze_system(&model, options).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Later segments begin later. A parameter that affects the output only before the start is not observable (b
/// moves v only until t = 4), and a point in time that has passed stays passed.
#[test]
fn later_segments_begin_later() {
    let segments = "[[segment]]\n[[segment]]\n[[segment]]";
    for seed in 1..=6 {
        for (time, rank) in [("5", 1), ("0", 2)] {
            let a = judged_with(
                &format!(
                    "name='m'\ntime={time}\nparameters=['b']\n[states]\nv='b*(abs(t - 4) - t + 4)'\n[outputs]\ny='v'\n\
                     {segments}"
                ),
                seed,
            );
            assert_eq!(a.rank, rank, "{time} {seed}: {:?}", a.branch_sides);
        }
        for shift in ["1", "2", "3/2"] {
            let a = judged_with(
                &format!(
                    "name='m'\ntime='generic'\nparameters=['a', 'b']\n[states]\nx='a + b*sign(t - {shift})'\n\
                     [outputs]\ny='x'\n{segments}"
                ),
                seed,
            );
            let said = &a.branch_sides[0].condition;
            assert!(!said.contains("at the other"), "{shift} {seed}: {said}");
            let before = said.split("> 0").skip(1).any(|later| later.contains("< 0"));
            assert!(!before, "{shift} {seed}: {said}");
            // a and b are distinguished by both signs, not by one
            let both = said.contains("> 0") && said.contains("< 0");
            assert_eq!(a.rank, if both { 3 } else { 2 }, "{shift} {seed}: {said}");
        }
    }
}

/// Symmetries, combinations and remedies belong to the side on which the verdicts hold. By hand, for p > q: y
/// = 2 b (p - q) + p q, where one of b, p, q determines the other two. For p < q: y = p q without b. For x' =
/// a + b |x - y|: y and a are indistinguishable.
#[test]
fn all_that_is_said_is_of_one_side() {
    let mut seen = std::collections::BTreeSet::new();
    for seed in 1..=8 {
        let a = judged_with(
            "name='m'\nparameters=['p', 'q', 'b']\n[outputs]\ny='b*(abs(p - q) + p - q) + p*q'\nz='p - q'",
            seed,
        );
        let said = a.branch_sides[0].condition.as_str();
        seen.insert(said.to_string());
        let words: Vec<&str> = a.symmetries.iter().map(|s| s.words.as_str()).collect();
        let status = |n: &str| a.quantities.iter().find(|q| q.name == n).expect("it").status;
        match said {
            "p - q > 0" => {
                assert!(words.iter().all(|w| !w.contains("multiply b by c")), "{seed}: {words:?}");
                assert_eq!(status("b"), Status::Inseparable, "{seed}");
                let text = printed(&a);
                assert!(text.contains("To resolve p, q, b: know one of them"), "{text}");
            }
            "p - q < 0" => assert_eq!((status("b"), a.rank), (Status::NotExcited, 2), "{seed}"),
            other => panic!("{seed}: {other}"),
        }
        let a = judged_with(
            "name='m'\nparameters=['a', 'b']\n[states]\nx='a + b*abs(x - y)'\ny='-1'\n[outputs]\no='x'",
            seed,
        );
        assert!(a.other_directions.is_empty(), "{seed}: {:?}", a.branch_sides);
        assert_eq!(a.symmetries.len(), a.unobservable_directions, "{seed}");
    }
    assert_eq!(seen.len(), 2, "both sides: {seen:?}");
}

/// A function that is undefined at the start because of its time: the message names the key that chooses
/// another time.
#[test]
fn a_time_that_can_not_be_is_named() {
    for (input, time, named) in [
        ("log(t)", "", true),
        ("log(t - 3)", "time = 2", true),
        ("1/t", "", true),
        ("sqrt(t)", "", true),
        ("sign(t - 7)", "time = 7", true),
        ("log(-1 - t^2)", "time = 'generic'", false),
    ] {
        let text = format!(
            "name='m'\nparameters=['a', 'b']\n{time}\nknown_inputs={{u={{function='{input}'}}}}\n[states]\n\
             x='a + b*u'\n[outputs]\ny='x'"
        );
        let model = model_file::read(&text).expect("a model");
        let said = analyze_system(&model, SystemOptions::default()).expect_err(input).to_string();
        assert_eq!(said.contains("`time` in the file chooses another"), named, "{input}: {said}");
        if named {
            let other = model_file::read(&text.replace(&format!("\n{time}\n"), "\ntime = 9\n"));
            let found = analyze_system(&other.expect("a model"), SystemOptions::default());
            assert!(found.is_ok(), "{input} at 9: {:?}", found.err().map(|e| e.to_string()));
        }
    }
}

/// The section on the system defines every name in a solution that is neither an unknown nor an output,
/// inputs of single experiments included.
#[test]
fn solutions_rest_on_what_is_printed() {
    let a = judged(
        "name='m'\nparameters=['a', 'b']\ntime=2\nknown_inputs={u={function='t^2'}}\n[states]\nx='a + b*u'\n\
         [outputs]\ny='x'",
    );
    assert!(a.equations.contains(&"u = t^2".to_string()), "{:?}", a.equations);
    assert!(printed(&a).contains("The system u = t^2"), "{}", printed(&a));
    let solution = a.quantities.iter().find(|q| q.name == "b").and_then(|q| q.solution.clone());
    let solution = solution.expect("an expression");
    // y' = a + b t^2, y'' = 2 b t, at a = 0.7, b = 1.3
    let known = |name: &str| match name {
        "y" => 0.4,
        "y_" => 0.7 + 1.3 * 4.0,
        "y__" => 2.0 * 1.3 * 2.0,
        "u" => 4.0,
        "u_" => 4.0,
        "u__" => 2.0,
        "a" => 0.7,
        "t" => 2.0,
        _ => f64::NAN,
    };
    let text = solution.replace("''", "__").replace('\'', "_");
    let found = evaluate_f64(&parse_with(&text, Names::Plain).expect("an expression"), &known);
    assert!((found - 1.3).abs() < 1e-12, "{solution}: {found}");
    let a = judged(
        "name='m'\nparameters=['a']\nknown_inputs={u={function='t'}}\n[states]\nx='a*u'\n[outputs]\ny='x'\n\
         [[experiment]]\n[[experiment]]\n\
         known_inputs={u={function='t^3'}}",
    );
    for line in ["u in experiment 1 = t", "u in experiment 2 = t^3"] {
        assert!(a.equations.iter().any(|e| e == line), "{line}: {:?}", a.equations);
    }
}

/// A power with too large an exponent is refused as a power: the message mentions no logarithm, since the
/// model has none.
#[test]
fn powers_are_refused_as_powers() {
    let refused = |output: &str| {
        let text =
            format!("name='m'\nparameters=['a', 'b']\n[states]\nx='0'\n[outputs]\ny='{output}'\nz='x'");
        let model = model_file::read(&text);
        let found = model.and_then(|m| analyze_system(&m, SystemOptions::default()));
        found.err().unwrap_or_else(|| panic!("{output} is judged")).to_string()
    };
    for output in ["a^(10^40) + b", "a^(-10^40) + b", "a^1e30 + b", "a^1001 + b", "(a + b)^(3*10^39/3)"] {
        let said = refused(output);
        assert!(said.contains("an exponent above 1000") && !said.contains("log"), "{output}: {said}");
    }
    let said = refused("(-1 - a^2)^(1/3) + b");
    assert!(said.contains("a power whose exponent") && !said.contains("log"), "{said}");
    assert!(refused("log(-1 - a^2) + b").contains("log is not defined here"));
    for (output, exponent) in [("a^2.000 + b", 2.0), ("a^(3 - 1) + b", 2.0), ("a^(1/3) + b", 1.0 / 3.0)] {
        let text =
            format!("name='m'\nparameters=['a', 'b']\n[states]\nx='0'\n[outputs]\ny='{output}'\nz='b'");
        assert_eq!(judged(&text).quantities.iter().filter(|q| q.degree == Some(0)).count(), 2, "{exponent}");
    }
}

/// A side that follows from known starts is not attributed to "unknowns near one".
#[test]
fn known_starts_decide_sides() {
    for (start, side, said) in [
        (
            "x={equation='-a*x', initial=-3}",
            "x < 0",
            "where x < 0 (known starts and `time` in the file choose another)",
        ),
        (
            "x={equation='-a*x', initial=3}",
            "x > 0",
            "where x > 0 (known starts and `time` in the file choose another)",
        ),
        ("x='-a*x'", "x > 0", "where x > 0 (chosen by unknowns near one"),
    ] {
        let a = judged(&format!("name='m'\nparameters=['a']\n[states]\n{start}\n[outputs]\ny='a*abs(x)'"));
        assert_eq!(a.branch_sides[0].condition, side);
        assert!(printed(&a).contains(said), "{}", printed(&a));
    }
    let a = judged(
        "name='m'\nparameters=['a']\n[states]\nx={equation='-a*x', initial=-3}\n[outputs]\ny='abs(x)+abs(a)'",
    );
    assert!(
        printed(&a).contains("by known starts where these decide, else by unknowns near one"),
        "{}",
        printed(&a)
    );
}

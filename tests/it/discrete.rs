//! Models in discrete time: against published verdicts, linear algebra by hand, composition by hand, and a
//! map whose outputs stand still for a step before they add again.

use obsdeg_core::degree::Status;
use obsdeg_core::system::{
    Identifiability, NumberOfSolutions, SystemAnalysis, SystemOptions, analyze_system, judge, model_file,
};
use obsdeg_exact::SplitMix64;

fn analyzed(text: &str) -> SystemAnalysis {
    let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    analyze_system(&model, SystemOptions::default()).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Model in discrete time of these equations of states and outputs.
fn model(states: &[(&str, &str)], outputs: &[(&str, &str)], parameters: &[&str], more: &str) -> String {
    let list = |of: &[(&str, &str)]| of.iter().map(|(n, e)| format!("{n} = \"{e}\"\n")).collect::<String>();
    let parameters: String = parameters.iter().map(|p| format!("{p} = {{}}\n")).collect();
    format!(
        "name = \"m\"\ndiscrete = true\n{more}[states]\n{}[parameters]\n{parameters}[outputs]\n{}",
        list(states),
        list(outputs)
    )
}

fn degrees(a: &SystemAnalysis) -> Vec<(&str, Option<usize>)> {
    a.quantities.iter().map(|q| (q.name.as_str(), q.degree)).collect()
}

/// Verdicts of the tests of StructuralIdentifiability.jl on discrete systems (examples of
/// doi:10.1016/j.automatica.2008.03.019 and doi:10.1016/j.automatica.2016.01.054 among them), and that of its
/// tutorial, where the number removed from an epidemic has no effect on its output.
#[test]
fn published_verdicts() {
    let input = "known_inputs = { u = \"generic\" }\n";
    type Case<'a> = (String, Vec<(&'a str, bool)>, Vec<(&'a str, bool)>);
    let asked = |list: &str| format!("combinations = [{list}]\n");
    let cases: Vec<Case<'_>> = vec![
        (
            model(&[("a", "(b + c)*a + 1")], &[("y", "a")], &["b", "c"], &asked("\"b + c\"")),
            vec![("a", true), ("b", false), ("c", false)],
            vec![("b + c", true)],
        ),
        (
            model(&[("a", "b*a + c"), ("b", "d*a")], &[("y", "b")], &["c", "d"], &asked("\"d*a\", \"d*c\"")),
            vec![("b", true), ("a", false), ("c", false), ("d", false)],
            vec![("d*a", true), ("d*c", true)],
        ),
        (
            model(&[("x", "theta^3*x")], &[("y", "x")], &["theta"], ""),
            vec![("theta", true), ("x", true)],
            vec![],
        ),
        (
            model(&[("x1", "a*x1*x2"), ("x2", "b*x1")], &[("y", "x2")], &["a", "b"], &asked("\"b*x1\"")),
            vec![("a", true), ("b", false), ("x1", false), ("x2", true)],
            vec![("b*x1", true)],
        ),
        (
            model(
                &[("x1", "theta1*x1 + x2"), ("x2", "(1 - theta2)*x1 + x2^2 + u")],
                &[("y", "x1")],
                &["theta1", "theta2"],
                input,
            ),
            vec![("x1", true), ("x2", true), ("theta1", true), ("theta2", true)],
            vec![],
        ),
        (
            model(
                &[("x1", "theta1*x1^2 + theta2*x2 + u"), ("x2", "theta3*x1")],
                &[("y", "x1")],
                &["theta1", "theta2", "theta3"],
                input,
            ),
            vec![("x1", true), ("x2", false), ("theta1", true), ("theta2", false), ("theta3", false)],
            vec![],
        ),
        (
            model(
                &[("x1", "theta1*x1^2 + theta2*x2 + u"), ("x2", "theta3*x1")],
                &[("y", "x1"), ("y2", "x2")],
                &["theta1", "theta2", "theta3"],
                input,
            ),
            vec![("x1", true), ("x2", true), ("theta1", true), ("theta2", true), ("theta3", true)],
            vec![],
        ),
        (
            model(
                &[("S", "S - beta*S*I"), ("I", "I + beta*S*I - alpha*I"), ("R", "R + alpha*I")],
                &[("y", "I")],
                &["alpha", "beta"],
                &asked("\"beta*S\""),
            ),
            vec![("S", true), ("I", true), ("R", false), ("alpha", true), ("beta", true)],
            vec![("beta*S", true)],
        ),
    ];
    for (text, verdicts, combinations) in cases {
        let a = analyzed(&text);
        assert!(a.closed && !a.rests_on_bound && a.discrete, "{text}");
        for (name, observable) in verdicts {
            let q = a.quantities.iter().find(|q| q.name == name).expect("an unknown");
            assert_eq!(q.degree.is_some(), observable, "{name} of {text}");
            assert_eq!(q.status == Status::Observable, observable, "{name} of {text}");
        }
        for (expression, observable) in combinations {
            let c = a.combinations.iter().find(|c| c.expression == expression).expect("a combination");
            assert_eq!(c.degree.is_some(), observable, "{expression} of {text}");
        }
    }
}

/// Numbers of solutions, which that program does not give in discrete time: three of the cube root, one of
/// the others, by expressions in outputs of later steps.
#[test]
fn solutions_are_counted() {
    let a = analyzed(&model(&[("x", "theta^3*x")], &[("y", "x")], &["theta"], ""));
    let theta = a.quantities.iter().find(|q| q.name == "theta").expect("an unknown");
    assert_eq!(theta.identifiability, Identifiability::LocallyIdentifiable);
    assert!(
        matches!(&theta.number_of_solutions, Some(NumberOfSolutions::Undecided(why)) if why.starts_with("3 solutions")),
        "{theta:?}"
    );
    let a = analyzed(&model(&[("x", "a*x*(1 - x)")], &[("y", "x")], &["a"], ""));
    assert_eq!(degrees(&a), [("x", Some(0)), ("a", Some(1))]);
    let q = a.quantities.iter().find(|q| q.name == "a").expect("an unknown");
    assert_eq!(q.identifiability, Identifiability::GloballyIdentifiable);
    let solution = q.solution.as_deref().expect("an expression");
    assert!(solution.contains("y[t+1]") && solution.contains('y'), "{solution}");
}

/// Later steps leave fewer solutions than those that make all observable: no number above one is given.
#[test]
fn more_solutions_than_one_are_not_claimed() {
    // x = (y[t+1] - y - 1)/2; of the second, x follows from y[t+2] = (x + 1)^2 and z from a step more
    let unique = |a: &SystemAnalysis, name: &str| {
        let q = a.quantities.iter().find(|q| q.name == name).expect("an unknown");
        q.identifiability == Identifiability::GloballyIdentifiable
    };
    let first = analyzed(&model(&[("x", "x + 1")], &[("y", "x^2")], &[], ""));
    let second = analyzed(&model(&[("x", "z"), ("z", "x + 1")], &[("y", "x^2")], &[], ""));
    let third = analyzed(&model(&[("z", "2*z*z")], &[("y", "z/(2 + z*z)")], &[], ""));
    assert!(unique(&first, "x") && unique(&second, "x"));
    for a in [&first, &second, &third] {
        let several = |n: &NumberOfSolutions| matches!(n, NumberOfSolutions::Counted(2..));
        assert!(!a.quantities.iter().filter_map(|q| q.number_of_solutions.as_ref()).any(several));
        assert!(a.solution_maps.is_empty());
    }
}

/// Unobservable directions that contain later values of an input, or states of several experiments.
#[test]
fn combinations_of_later_names() {
    let a = analyzed(
        "name = \"m\"\ndiscrete = true\nunknown_inputs = { w = \"arbitrary\" }\n[states]\nx = \"x\"\n\
         [outputs]\ny = \"x + w\"\n",
    );
    assert_eq!(degrees(&a), [("x", None), ("w", None)]);
    let a = analyzed(
        "name = \"m\"\ndiscrete = true\nexperiments = 2\nparameters = [\"a\"]\n[states]\nx = \"x\"\n\
         [outputs]\ny = \"a*x\"\n",
    );
    assert_eq!(degrees(&a), [("x@1", None), ("x@2", None), ("a", None)]);
    assert!(a.quantities.iter().all(|q| q.status == Status::Inseparable), "{:?}", a.quantities);
}

/// Echelon form over the integers modulo a small prime: dimension and membership.
struct Span {
    rows: Vec<Vec<u64>>,
}

const P: u64 = 1_000_003;

impl Span {
    fn reduced(&self, row: &[u64]) -> Vec<u64> {
        let mut row = row.to_vec();
        for basis in &self.rows {
            let pivot = basis.iter().position(|x| *x != 0).expect("a row");
            let factor = row[pivot];
            for (x, b) in row.iter_mut().zip(basis) {
                *x = (*x + (P - factor) * b) % P;
            }
        }
        row
    }

    fn insert(&mut self, row: &[u64]) {
        let rest = self.reduced(row);
        if let Some(pivot) = rest.iter().position(|x| *x != 0) {
            let inverse = (0..20).fold((1, rest[pivot], P - 2), |(out, base, e), _| {
                (if e & 1 == 1 { out * base % P } else { out }, base * base % P, e >> 1)
            });
            self.rows.push(rest.iter().map(|x| x * inverse.0 % P).collect());
        }
    }

    fn contains(&self, row: &[u64]) -> bool {
        self.reduced(row).iter().all(|x| *x == 0)
    }
}

/// Linear systems, singular ones among them: the degree of a state is the smallest k such that its unit
/// row is a combination of the rows of C, CA, ..., CA^k (Kalman).
#[test]
fn linear_systems_by_kalman() {
    let mut rng = SplitMix64::new(20_261_128);
    let mut singular = 0;
    for case in 0..40 {
        let n = 2 + rng.below(4) as usize;
        let mut entry = |zeros: u64| if rng.below(10) < zeros { 0 } else { 1 + rng.below(3) };
        let mut a: Vec<Vec<u64>> = (0..n).map(|_| (0..n).map(|_| entry(6)).collect()).collect();
        if case % 3 == 0 {
            a[n - 1] = vec![0; n];
            singular += 1;
        }
        let c: Vec<u64> = (0..n).map(|_| entry(6)).collect();
        if c.iter().all(|x| *x == 0) {
            continue;
        }
        let sum = |row: &[u64]| {
            let terms: Vec<String> = row.iter().enumerate().map(|(i, k)| format!("{k}*x{i}")).collect();
            terms.join(" + ")
        };
        let names: Vec<String> = (0..n).map(|i| format!("x{i}")).collect();
        let equations: Vec<String> = a.iter().map(|row| sum(row)).collect();
        let states: Vec<(&str, &str)> =
            names.iter().zip(&equations).map(|(n, e)| (n.as_str(), e.as_str())).collect();
        let found = analyzed(&model(&states, &[("y", &sum(&c))], &[], ""));
        let (mut span, mut row) = (Span { rows: Vec::new() }, c.clone());
        let mut expected = vec![None; n];
        let mut ranks = Vec::new();
        for k in 0..=n + 1 {
            span.insert(&row);
            ranks.push(span.rows.len());
            for (i, degree) in expected.iter_mut().enumerate() {
                let unit: Vec<u64> = (0..n).map(|j| u64::from(i == j)).collect();
                *degree = degree.or(span.contains(&unit).then_some(k));
            }
            row = (0..n).map(|j| (0..n).map(|i| row[i] * a[i][j]).sum::<u64>() % P).collect();
        }
        let degrees: Vec<Option<usize>> = found.quantities.iter().map(|q| q.degree).collect();
        assert_eq!(degrees, expected, "case {case}: {equations:?}, y = {}", sum(&c));
        assert_eq!(found.rank, *ranks.last().expect("a rank"), "case {case}");
        assert_eq!(found.rank_profile, ranks[..found.rank_profile.len()], "case {case}");
    }
    assert!(singular > 10);
}

/// The outputs of this map add nothing at one step and something at the next: r is y3/y2, and s is seen two
/// steps later; the image of the map (p = 0) is smaller than the whole. To end at the first step that adds
/// nothing would be wrong; for a map that is invertible almost everywhere it is right.
#[test]
fn outputs_stand_still_for_a_step() {
    let states = [("p", "0"), ("q", "q"), ("r", "s"), ("s", "s"), ("u", "r")];
    let outputs = [("y1", "u"), ("y2", "p*q"), ("y3", "p*q*r")];
    let a = analyzed(&model(&states, &outputs, &[], ""));
    let expected = [("p", None), ("q", None), ("r", Some(0)), ("s", Some(2)), ("u", Some(0))];
    assert_eq!(degrees(&a), expected);
    assert_eq!(a.rank_profile[..3], [3, 3, 4]);
    assert!(a.closed);
    // p q is found, with its degree
    assert!(a.invariants.iter().any(|i| i.expression == "p*q" && i.degree == Some(0)), "{:?}", a.invariants);
}

/// The verdicts are those of a static model whose outputs are composed by hand.
#[test]
fn composition_by_hand() {
    let a =
        analyzed(&model(&[("x", "a*x + b*x*z"), ("z", "z/(1 + c*x)")], &[("y", "x")], &["a", "b", "c"], ""));
    let x1 = "(a*x + b*x*z)";
    let z1 = "(z/(1 + c*x))";
    let x2 = format!("(a*{x1} + b*{x1}*{z1})");
    let z2 = format!("({z1}/(1 + c*{x1}))");
    let x3 = format!("(a*{x2} + b*{x2}*{z2})");
    let z3 = format!("({z2}/(1 + c*{x2}))");
    let x4 = format!("(a*{x3} + b*{x3}*{z3})");
    let all = ["x".to_string(), x1.into(), x2, x3, x4];
    let mut seen: Vec<(String, Option<usize>)> =
        ["x", "z", "a", "b", "c"].map(|n| (n.to_string(), None)).into();
    for k in 0..all.len() {
        let outputs: String =
            all[..=k].iter().enumerate().map(|(i, e)| format!("y{i} = \"{e}\"\n")).collect();
        let text = format!(
            "name = \"m\"\n[states]\nx = \"0\"\nz = \"0\"\n[parameters]\na = {{}}\nb = {{}}\nc = {{}}\n[outputs]\n{outputs}"
        );
        let model = model_file::read(&text).expect("a model");
        let judged = judge(&model, 1, None).expect("a verdict");
        for (name, degree) in &mut seen {
            let found = judged.verdict(&model, name).expect("an unknown").degree;
            *degree = degree.or(found.map(|_| k));
        }
    }
    let found: Vec<(String, Option<usize>)> =
        a.quantities.iter().map(|q| (q.name.clone(), q.degree)).collect();
    assert_eq!(found, seen);
    assert!(
        a.quantities.iter().any(|q| q.degree.is_none()) && a.quantities.iter().any(|q| q.degree > Some(1))
    );
}

/// Inputs, the time, vectors, functions, known starts and experiments.
#[test]
fn all_parts_of_a_model() {
    // an unknown input is the difference of two outputs, known one step late
    let text = "name = \"m\"\ndiscrete = true\nunknown_inputs = { w = \"arbitrary\" }\n[states]\nx = \"x + w\"\n\
                [outputs]\ny = \"x\"\n";
    let a = analyzed(text);
    assert_eq!(degrees(&a), [("x", Some(0)), ("w", Some(1))]);
    // the time in steps: y = x (t + 1), so that x = y at t = 0, and nothing at t = -1
    let timed = |start: &str| {
        format!(
            "name = \"m\"\ndiscrete = true\ntime = {start}\n[states]\nx = \"x\"\n[outputs]\ny = \"x*(t + 1)\"\n"
        )
    };
    assert_eq!(degrees(&analyzed(&timed("0"))), [("x", Some(0))]);
    assert_eq!(degrees(&analyzed(&timed("-1"))), [("x", Some(1))]);
    assert_eq!(degrees(&analyzed(&timed("\"generic\""))), [("x", Some(0))]);
    // a known function of time
    let text = "name = \"m\"\ndiscrete = true\nknown_inputs = { u = { function = \"t\" } }\n[states]\nx = \"x\"\n\
                z = \"z\"\n[outputs]\ny = \"x + u*z\"\n";
    assert_eq!(degrees(&analyzed(text)), [("x", Some(0)), ("z", Some(1))]);
    // a vector, and a function: the angle after k steps is theta + k omega, seen by its sine
    let text = "name = \"m\"\ndiscrete = true\n[states]\n\"v[2]\" = [\"v[1] + v[2]\", \"v[2]\"]\n[outputs]\n\
                y = \"sin(v[1])\"\n";
    let a = analyzed(text);
    assert_eq!(degrees(&a), [("v[1]", Some(0)), ("v[2]", Some(1))]);
    // a known start leaves the parameter
    let text = "name = \"m\"\ndiscrete = true\nparameters = [\"a\"]\n[states]\n\
                x = { equation = \"a*x\", initial = \"known\" }\n[outputs]\ny = \"x\"\n";
    assert_eq!(degrees(&analyzed(text)), [("a", Some(1))]);
    // the parameter that two runs share is distinguished from their starts by one; the starts have names of
    // their own
    let text = "name = \"m\"\ndiscrete = true\nexperiments = 2\nparameters = [\"a\"]\n[states]\nx = \"a*x\"\n\
                [outputs]\ny = \"x\"\n";
    assert_eq!(degrees(&analyzed(text)), [("x@1", Some(0)), ("x@2", Some(0)), ("a", Some(1))]);
}

/// Other commands refuse such a model, and what cannot be in discrete time is named.
#[test]
fn refusals() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.toml");
    std::fs::write(&path, model(&[("x", "a*x")], &[("y", "x")], &["a"], "")).expect("a file");
    let run = |command: &str| crate::program::run(&[command, "--model", path.to_str().expect("a path")]);
    for command in ["simulate", "crosscheck"] {
        let out = run(command);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(2), "{said}");
        assert!(said.contains("discrete time") && said.contains("analyze"), "{command}: {said}");
    }
    for option in ["--why", "--certificate", "--reduced"] {
        let file = path.to_str().expect("a path");
        let out = crate::program::run(&["analyze", "--model", file, option, "x"]);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(2), "{said}");
        assert!(said.contains(&format!("{option}: the model is in discrete time")), "{said}");
    }
    let out = run("analyze");
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(
        out.status.success() && said.contains("x[t+1] = a*x") && said.contains("discrete time"),
        "{said}"
    );
    let refused = |text: &str, word: &str| {
        let error = model_file::read(text)
            .map_err(|e| e.to_string())
            .and_then(|m| analyze_system(&m, SystemOptions::default()).map_err(|e| e.to_string()));
        let error = error.expect_err(text);
        assert!(error.contains(word), "{error}: {text}");
    };
    let start = "name = \"m\"\ndiscrete = true\n";
    let end = "[states]\nx = \"x + u\"\n[outputs]\ny = \"x\"\n";
    refused(&format!("{start}known_inputs = {{ u = {{ polynomial = 2 }} }}\n{end}"), "polynomial");
    refused(&format!("{start}unknown_inputs = {{ u = {{ polynomial = 1 }} }}\n{end}"), "polynomial");
    refused(
        "name = \"m\"\ndiscrete = true\n[states]\nx = \"x\"\n[outputs]\ny = \"x\"\n[[segment]]\n[[segment]]\ncarry = { x = \"-x\" }\n",
        "one run",
    );
    refused(
        "name = \"m\"\ndiscrete = true\n[states]\nx = \"1/(x - x)\"\n[outputs]\ny = \"x\"\n",
        "division by zero",
    );
}

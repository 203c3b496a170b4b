//! Verdicts on 36 published systems, compared with those of another program (tests/data/identifiability).
#![allow(clippy::print_stdout, reason = "a table of systems")]

use std::time::Instant;

use obsdeg_core::system::{NumberOfSolutions, SystemOptions, analyze_system, model_file};
use serde_json::Value;

/// Limit of the work of relations, in millions of products at each point.
const LIMIT: u64 = 6000;

/// Number of unknowns with a decided number of solutions, within the default limits and with relations.
const DECIDED: usize = 331;
const DECIDED_BY_RELATIONS: usize = 393;

/// Comparison of the verdicts and numbers of a system.
#[derive(Default)]
struct Found {
    observable: usize,
    /// Number of unknowns with a decided number of solutions.
    decided: usize,
    /// Number of unknowns published as global that have one solution here.
    agree: usize,
    /// Number of unknowns published as global that are not decided here.
    open: usize,
    /// Contradictions to the published verdicts.
    differ: Vec<String>,
}

fn systems() -> Vec<Value> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/identifiability/published.json");
    let text = std::fs::read_to_string(path).expect("the published results");
    let all: Value = serde_json::from_str(&text).expect("JSON");
    all["models"].as_array().expect("a list").clone()
}

fn names(list: &Value) -> Vec<&str> {
    list.as_array().expect("a list").iter().map(|n| n.as_str().expect("a name")).collect()
}

fn compared(system: &Value, options: SystemOptions) -> Found {
    let model = model_file::read(system["toml"].as_str().expect("a model")).expect("a model");
    let a = analyze_system(&model, options).expect("a verdict");
    let (locally, globally) = (names(&system["locally"]), names(&system["globally"]));
    let mut out = Found::default();
    if a.rank != system["rank"].as_u64().expect("a number") as usize {
        out.differ.push(format!("rank {}", a.rank));
    }
    for q in &a.quantities {
        let name = q.name.as_str();
        if q.degree.is_some() != locally.contains(&name) {
            out.differ.push(format!("{name} locally"));
        }
        let number = match q.number_of_solutions {
            None => continue,
            Some(NumberOfSolutions::OneByExpression) => Some(1),
            Some(NumberOfSolutions::Counted(k)) => Some(k),
            Some(NumberOfSolutions::Undecided(_)) => None,
        };
        out.observable += 1;
        out.decided += usize::from(number.is_some());
        match (number, globally.contains(&name)) {
            (Some(1), true) => out.agree += 1,
            (Some(k), true) => out.differ.push(format!("{name}: {k} solutions")),
            (None, true) => out.open += 1,
            (_, false) => {}
        }
    }
    out
}

fn table(chosen: &dyn Fn(&str) -> bool, options: SystemOptions) -> Vec<(String, Found)> {
    let mut out = Vec::new();
    for system in systems() {
        let name = system["model"].as_str().expect("a name").to_string();
        if !chosen(&name) {
            continue;
        }
        let started = Instant::now();
        let found = compared(&system, options);
        println!(
            "{name:32} observable {:3} decided {:3} agree {:3} open {:3} differ {:?} {:.1} s",
            found.observable,
            found.decided,
            found.agree,
            found.open,
            found.differ,
            started.elapsed().as_secs_f64()
        );
        out.push((name, found));
    }
    out
}

fn sum(all: &[(String, Found)], of: impl Fn(&Found) -> usize) -> usize {
    all.iter().map(|f| of(&f.1)).sum()
}

fn nothing_differs(all: &[(String, Found)]) {
    for (name, found) in all {
        assert!(found.differ.is_empty(), "{name}: {:?}", found.differ);
    }
}

/// Compares all systems, within the default limits of work.
#[test]
fn nothing_contradicts_the_published_verdicts() {
    let all = table(&|_| true, SystemOptions::default());
    nothing_differs(&all);
    let found = (all.len(), sum(&all, |f| f.observable), sum(&all, |f| f.decided));
    assert_eq!(found, (36, 420, DECIDED));
}

/// Systems that relations decide, but equations in the unknowns do not within their limit. The states of
/// the last one have a constant sum: its relations hold along one trajectory only.
#[test]
fn relations_decide_what_counting_does_not() {
    relations_decide(&[("SLIQR", 50), ("SEIR 36 ref", 50)]);
}

#[test]
#[ignore = "a minute: .ci/run release"]
fn relations_decide_the_mapk_model() {
    relations_decide(&[("MAPK model (5 outputs)", 3000)]);
}

/// Compares the decided numbers of systems with and without relations among output derivatives.
fn relations_decide(systems: &[(&str, u64)]) {
    for &(name, limit) in systems {
        let found = |relation_limit: u64| {
            let mut all = table(&|n| n == name, SystemOptions { relation_limit, ..SystemOptions::default() });
            nothing_differs(&all);
            all.pop().expect("a published system").1
        };
        let (before, after) = (found(0), found(limit));
        assert!(after.decided > before.decided, "{name}");
        assert_eq!((after.open, after.decided), (0, after.observable), "{name}");
    }
}

/// Every published generator is observable here. Conversely, as their differentials span a space of the
/// dimension of the rank, every function found here depends on them.
#[test]
fn published_generators_are_identifiable() {
    let mut asked = 0;
    for system in systems() {
        let generators = names(&system["identifiable_functions"]);
        // the published files write quotients as `//`
        let quoted = |g: &&str| serde_json::to_string(&g.replace("//", "/")).expect("a text");
        let list = generators.iter().map(quoted).collect::<Vec<_>>();
        let text = system["toml"].as_str().expect("a model");
        let (first, rest) = text.split_once('\n').expect("lines");
        let text = format!("{first}\ncombinations = [{}]\n{rest}", list.join(", "));
        let model = model_file::read(&text).unwrap_or_else(|e| panic!("{}: {e}", system["model"]));
        let options = SystemOptions { solutions: false, ..SystemOptions::default() };
        let a = analyze_system(&model, options).expect("a verdict");
        assert_eq!(a.rank as u64, system["rank"].as_u64().expect("a number"));
        assert!(generators.len() >= a.rank, "{}", system["model"]);
        for c in &a.combinations {
            assert!(c.degree.is_some(), "{}: {}", system["model"], c.expression);
            asked += 1;
        }
    }
    assert!(asked > 490, "{asked}");
}

/// Verdicts that the tests, examples and texts of StructuralIdentifiability.jl and SIAN state, within the
/// default limits: also discrete systems, several experiments, known starts, and functions asked for.
#[test]
fn nothing_contradicts_the_tests_of_other_programs() {
    assert_eq!(compared_with_tests(3), (366, 21));
}

#[test]
#[ignore = "seconds: .ci/run release"]
fn nothing_contradicts_all_tests_of_other_programs() {
    assert_eq!(compared_with_tests(1), (1030, 128));
}

/// Compares each `step`-th system; returns the numbers of statements that agree and that are not decided.
fn compared_with_tests(step: usize) -> (usize, usize) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/identifiability/suites.json");
    let all: Value = serde_json::from_str(&std::fs::read_to_string(path).expect("the file")).expect("JSON");
    let (mut agree, mut open, mut differ) = (0, 0, Vec::new());
    for system in all["systems"].as_array().expect("a list").iter().step_by(step) {
        let (source, text) =
            (system["source"].as_str().expect("a text"), system["model"].as_str().expect("a model"));
        let list = |key: &str| system.get(key).map(names).unwrap_or_default();
        let model = model_file::read(text).unwrap_or_else(|e| panic!("{source}: {e}"));
        let keys = ["globally", "locally", "identifiable", "nonidentifiable", "functions"];
        let is_unknown = |n: &&str| {
            model.states.iter().any(|s| s.named.name == *n) || model.parameters.iter().any(|p| p.name == *n)
        };
        let mut asked: Vec<&str> = keys.iter().flat_map(|key| list(key)).filter(|n| !is_unknown(n)).collect();
        asked.sort_unstable();
        asked.dedup();
        let (first, rest) = text.split_once('\n').expect("lines");
        let asked = serde_json::to_string(&asked).expect("texts");
        let model = model_file::read(&format!("{first}\ncombinations = {asked}\n{rest}"))
            .unwrap_or_else(|e| panic!("{source}: {e}"));
        let a = analyze_system(&model, SystemOptions::default()).unwrap_or_else(|e| panic!("{source}: {e}"));
        // true if it is observable, and the number of its values if that is decided
        let number = |n: &Option<NumberOfSolutions>| match n {
            Some(NumberOfSolutions::OneByExpression) => Some(1),
            Some(NumberOfSolutions::Counted(k)) => Some(*k),
            _ => None,
        };
        let found = |name: &str| -> (bool, Option<usize>) {
            let own = |n: &str| n == name || n.strip_suffix("@1") == Some(name);
            if let Some(q) = a.quantities.iter().find(|q| own(&q.name)) {
                return (q.degree.is_some(), number(&q.number_of_solutions));
            }
            match a.combinations.iter().find(|c| c.expression == name) {
                Some(c) => (c.degree.is_some(), number(&c.number_of_solutions)),
                None => (true, Some(1)), // a known start
            }
        };
        for key in keys {
            for name in list(key) {
                match (key, found(name)) {
                    ("nonidentifiable", (false, _))
                    | ("globally" | "functions", (true, Some(1)))
                    | ("locally", (true, Some(2..)))
                    | ("identifiable", (true, _)) => agree += 1,
                    ("globally" | "functions" | "locally", (true, None)) => open += 1,
                    (_, other) => differ.push(format!("{source}: {name} is {key}, {other:?}")),
                }
            }
        }
    }
    assert!(differ.is_empty(), "{differ:#?}");
    (agree, open)
}

/// Prints a table of all systems:
/// `cargo test --release -p obsdeg-core --test published -- --ignored --nocapture`. `ONLY=name` selects
/// those with a similar name, `LIMIT=millions` limits the work.
#[test]
#[ignore = "minutes"]
fn all_published_systems() {
    let only = std::env::var("ONLY").unwrap_or_default();
    let limit = std::env::var("LIMIT").ok().and_then(|l| l.parse().ok());
    let options = SystemOptions { relation_limit: limit.unwrap_or(LIMIT), ..SystemOptions::default() };
    let all = table(&|name| name.contains(&only), options);
    println!(
        "{} systems: {} observable unknowns, {} decided, {} agree, {} open, {} differ",
        all.len(),
        sum(&all, |f| f.observable),
        sum(&all, |f| f.decided),
        sum(&all, |f| f.agree),
        sum(&all, |f| f.open),
        sum(&all, |f| f.differ.len())
    );
    nothing_differs(&all);
    if only.is_empty() && limit.is_none() {
        assert!(sum(&all, |f| f.decided) >= DECIDED_BY_RELATIONS);
    }
}

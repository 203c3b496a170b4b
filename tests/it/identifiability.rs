//! Numbers of solutions, maps between them, identifiable functions and reduced models.

use std::collections::BTreeMap;

use obsdeg_core::system::{
    Identifiability, NumberOfSolutions, ReducedError, SystemAnalysis, SystemOptions, analyze_system, json,
    judge, model_file, reduced,
};
use serde_json::Value;

use crate::models::{models, some_models};
use crate::program::cases;

fn analyzed(text: &str) -> SystemAnalysis {
    let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    analyze_system(&model, SystemOptions::default()).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn number(n: Option<&NumberOfSolutions>) -> Option<usize> {
    match n? {
        NumberOfSolutions::OneByExpression => Some(1),
        NumberOfSolutions::Counted(k) => Some(*k),
        NumberOfSolutions::Undecided(_) => None,
    }
}

/// Number of solutions of each decided unknown, by name.
fn numbers(a: &SystemAnalysis) -> BTreeMap<&str, usize> {
    let of = |q| number(Option::as_ref(q));
    a.quantities.iter().filter_map(|q| Some((q.name.as_str(), of(&q.number_of_solutions)?))).collect()
}

/// Random systems with their numbers of solutions (`tests/data/identifiability/oracle.py`); the sum of the
/// states of the latter is constant.
const COUNTS: &str = include_str!("../data/identifiability/counts.json");
const CONSERVED: &str = include_str!("../data/identifiability/conserved.json");

/// Compares numbers of solutions with Groebner bases of another program. Returns the numbers of decided and
/// undecided unknowns. All decided numbers must agree.
fn held_against_groebner_bases(
    text: &str,
    options: SystemOptions,
    chosen: impl Fn(usize) -> bool,
) -> (usize, usize) {
    let systems: Value = serde_json::from_str(text).expect("JSON");
    let (mut decided, mut open) = (0, 0);
    for (i, system) in systems.as_array().expect("a list").iter().enumerate().filter(|s| chosen(s.0)) {
        let texts = |key: &str| -> Vec<&str> {
            system[key].as_array().expect("a list").iter().map(|t| t.as_str().expect("a text")).collect()
        };
        let [rates, outputs, parameters] = ["rates", "outputs", "parameters"].map(texts);
        let outputs: String = outputs.iter().enumerate().map(|(i, y)| format!("y{i} = \"{y}\"\n")).collect();
        let text = format!(
            "name = \"s\"\nparameters = {parameters:?}\n[states]\nx1 = \"{}\"\nx2 = \"{}\"\n[outputs]\n{outputs}",
            rates[0], rates[1]
        );
        let model = model_file::read(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
        let a = analyze_system(&model, options).unwrap_or_else(|e| panic!("{e}: {text}"));
        let numbers = numbers(&a);
        for (unknown, expected) in system["numbers"].as_object().expect("numbers") {
            match numbers.get(unknown.as_str()) {
                Some(&k) => {
                    assert_eq!(k as u64, expected.as_u64().expect("a number"), "{i}: {unknown}, {system}")
                }
                None => open += 1,
            }
            decided += usize::from(numbers.contains_key(unknown.as_str()));
        }
    }
    (decided, open)
}

#[test]
fn numbers_are_those_of_groebner_bases() {
    let (decided, open) = held_against_groebner_bases(COUNTS, SystemOptions::default(), |i| i % 11 == 0);
    assert!(decided > 30 && open == 0, "{decided}, {open}");
}

#[test]
#[ignore = "full length: 110 systems"]
fn numbers_are_those_of_groebner_bases_of_all_systems() {
    let (decided, open) = held_against_groebner_bases(COUNTS, SystemOptions::default(), |_| true);
    assert!(decided > 380 && open * 20 <= decided, "{decided}, {open}");
}

/// Relations alone, without a count before, decide nothing else; also those along one trajectory, whose
/// coefficients contain a constant sum of states.
#[test]
fn relations_agree_with_groebner_bases() {
    let options = SystemOptions { count_limit: 0, relation_limit: 50, ..SystemOptions::default() };
    for text in [COUNTS, CONSERVED] {
        let (decided, open) = held_against_groebner_bases(text, options, |i| i % 3 == 0);
        assert!(decided > 60, "{decided}, {open}");
    }
}

/// System, numbers of solutions of its unknowns, and maps between the solutions.
type Case<'a> = (&'a str, &'a [(&'a str, usize)], &'a [&'a str]);

/// Several solutions with known starts, constraints or jumps; numbers and maps by hand.
#[test]
fn several_solutions_where_points_are_special() {
    let cases: [Case<'_>; 11] = [
        // q and -q are the same attitude
        (
            "constraints=['norm(q) = 1']\n[known_inputs]\n'w[3]'='generic'\n[states]\n'q[4]'='qdot(q, w)'\n[outputs]\n\
             y='R(q)'",
            &[("q[1]", 2), ("q[2]", 2), ("q[3]", 2), ("q[4]", 2)],
            &["negate q[1], q[2], q[3], q[4]"],
        ),
        (
            "constraints=['norm(v) = 1']\n[states]\n'v[3]'='0*v'\n[outputs]\ny1='v[1]'\ny2='v[2]'",
            &[("v[1]", 1), ("v[2]", 1), ("v[3]", 2)],
            &["negate v[3]"],
        ),
        (
            "constraints=['m1^2 + m2^2 + m3^2 = 4']\n[known_inputs]\nw='generic'\n[states]\nm1='w*m2'\nm2='-w*m1'\n\
             m3=0\n[outputs]\ny1='m1'\ny2='m2'",
            &[("m1", 1), ("m2", 1), ("m3", 2)],
            &["negate m3"],
        ),
        // a heading as cosine and sine, and the speed along it
        (
            "parameters=['v']\nconstraints=['c^2 + s^2 = 1']\n[known_inputs]\nw='generic'\n[states]\nx='v*c'\n\
             c='-w*s'\ns='w*c'\n[outputs]\ny='x'",
            &[("c", 2), ("s", 2), ("v", 2), ("x", 1)],
            &["negate c, s, v"],
        ),
        (
            "parameters=['a']\n[states]\nx={equation='a^2*x', initial='known'}\n[outputs]\ny='x'",
            &[("a", 2)],
            &["negate a"],
        ),
        (
            "parameters=['a']\n[states]\nx={equation='a^2*x', initial=1}\n[outputs]\ny='x'\n[[segment]]\n[[segment]]\n\
             carry={x='x + 1'}",
            &[("a", 2)],
            &["negate a"],
        ),
        (
            "parameters=['b']\n[constants]\nc=1\n[states]\nx={equation='c*b*z', initial=0}\n\
             z={equation='b*x', initial=1}\n[outputs]\ny='z'\n[[segment]]\n[[segment]]\nconstants={c=-1}",
            &[("b", 2)],
            &["negate x, b"],
        ),
        // absorption and elimination are exchangeable, with another volume: y = D ka/(V (ka - ke)) (e^(-ke t)
        // - e^(-ka t))
        (
            "parameters=['ka', 'ke', 'V']\n[states]\nx1={equation='-ka*x1', initial=10}\n\
             x2={equation='ka*x1 - ke*x2', initial=0}\n[outputs]\ny='x2/V'",
            &[("V", 2), ("ka", 2), ("ke", 2)],
            &["replace ka by ke, ke by ka, V by V*ke/ka"],
        ),
        (
            "parameters=['k1', 'k2']\n[states]\nx1={equation='-k1*x1', initial=1}\nx2={equation='-k2*x2', initial=1}\n\
             [outputs]\ny='x1 + x2'",
            &[("k1", 2), ("k2", 2)],
            &["swap x1 and x2, k1 and k2"],
        ),
        // the rates of three decays are exchangeable: each has three values
        (
            "parameters=['k1', 'k2', 'k3']\n[states]\nx1={equation='-k1*x1', initial=1}\n\
             x2={equation='-k2*x2', initial=1}\nx3={equation='-k3*x3', initial=1}\n[outputs]\ny='x1 + x2 + x3'",
            &[("k1", 3), ("k2", 3), ("k3", 3)],
            &["swap x1 and x2, k1 and k2", "swap x1 and x3, k1 and k3", "swap x2 and x3, k2 and k3"],
        ),
        (
            "parameters=['r1', 'r2']\n[states]\nx1={equation='r1*x1*(1 - x1 - x2)', initial='0.25'}\n\
             x2={equation='r2*x2*(1 - x1 - x2)', initial='0.25'}\n[outputs]\ny='x1 + x2'",
            &[("r1", 2), ("r2", 2)],
            &["swap x1 and x2, r1 and r2"],
        ),
    ];
    for (text, expected, maps) in cases {
        let a = analyzed(&format!("name='m'\n{text}"));
        assert_eq!(numbers(&a), expected.iter().copied().collect(), "{text}");
        assert_eq!(a.solution_maps, maps, "{text}");
    }
    // different starts distinguish the decays
    let one = "name='m'\nparameters=['k1', 'k2']\n[states]\nx1={equation='-k1*x1', initial=1}\n\
               x2={equation='-k2*x2', initial=2}\n[outputs]\ny='x1 + x2'";
    assert_eq!(numbers(&analyzed(one)), BTreeMap::from([("k1", 1), ("k2", 1)]));
}

/// Maps do not change a known start: the sign of its state stays, and no number of solutions rests on
/// changing it. By hand: the fifth derivative of the first model contains p x(0), lower ones only p^2.
#[test]
fn known_starts_are_not_mapped() {
    let cases: [(&str, &[&str]); 5] = [
        (
            "parameters=['p']\n[states]\nw={equation='p^2 + w^2', initial=0}\nx={equation='x^3', initial='known'}\n\
             z1={equation='z2', initial=0}\nz2={equation='z3', initial=0}\nz3={equation='z4', initial=0}\n\
             z4={equation='z5', initial=0}\nz5={equation='p*x', initial=0}\n[outputs]\ny='w + z1'",
            &[],
        ),
        (
            "parameters=['a', 'b']\n[states]\nx={equation='a', initial='known'}\n[outputs]\ny='(b*x)^2'",
            &["negate b"],
        ),
        (
            "parameters=['a', 'b']\n[states]\nx={equation='-a*x', initial='known'}\nz={equation='b^3*x', initial=0}\n\
             [outputs]\ny='z'",
            &[],
        ),
        (
            "parameters=['a', 'k']\n[states]\nx={equation='a*x^2', initial='known'}\n[outputs]\ny='k^2*x^2'",
            &["negate k"],
        ),
        (
            "parameters=['a', 'b']\n[states]\nx={equation='-a*x', initial='known'}\n\
             z={equation='-b*z', initial='known'}\n[outputs]\ny='x + z'",
            &[],
        ),
    ];
    for (text, maps) in cases {
        let a = analyzed(&format!("name='m'\n{text}"));
        assert_eq!(a.solution_maps, maps, "{text}");
        assert!(!numbers(&a).iter().any(|(name, n)| ["p", "a"].contains(name) && *n > 1), "{text}");
    }
}

/// The identifiability of each unknown follows from its verdict and its number of solutions.
#[test]
fn words_of_identifiability() {
    let a = analyzed(
        "name='m'\nparameters=['a', 'b', 'c', 'd']\n[states]\nx='a^2 + b*c'\n[outputs]\ny='x + 0*d'\nz='b^3*c^3'\n\
         w='a^2'",
    );
    let of = |name: &str| {
        let q = a.quantities.iter().find(|q| q.name == name).expect("an unknown");
        (q.identifiability, q.identifiability_words())
    };
    assert_eq!(of("x"), (Identifiability::GloballyIdentifiable, "globally identifiable".into()));
    assert_eq!(of("a"), (Identifiability::LocallyIdentifiable, "locally identifiable (2 solutions)".into()));
    assert_eq!(of("b"), (Identifiability::NotIdentifiable, "not identifiable".into()));
    assert_eq!(of("d"), (Identifiability::NotIdentifiable, "not identifiable".into()));
    let function = |text: &str| a.invariants.iter().find(|c| c.expression == text).expect("a function");
    // x' - a^2 equals b c: one value
    assert_eq!(number(function("b*c").number_of_solutions.as_ref()), Some(1));
}

/// Functions beyond scalings, with their numbers of values, by hand.
#[test]
fn functions_by_hand() {
    // only the square of f = a*b is observed: f has two values
    let a = analyzed("name='m'\nparameters=['a', 'b']\n[states]\nx='-x'\n[outputs]\ny='x'\nz='(a*b)^2 + 1'");
    let [f] = &a.invariants[..] else { panic!("{:?}", a.invariants) };
    assert_eq!((f.expression.as_str(), f.degree), ("a*b", Some(0)));
    assert_eq!(number(f.number_of_solutions.as_ref()), Some(2));
    // combinations of S, E, U, I in an epidemic with unknown transmission
    let (_, _, text) = models().into_iter().find(|m| m.0 == "seuir").expect("the model");
    let model = json::read(&text).expect("a model");
    let found = analyze_system(&model, SystemOptions::default()).expect("judged");
    let listed: Vec<(&str, Option<usize>, Option<usize>)> = found
        .invariants
        .iter()
        .map(|f| (f.expression.as_str(), f.degree, number(f.number_of_solutions.as_ref())))
        .collect();
    let six = |text| (text, Some(6), Some(1));
    assert_eq!(listed, [six("N*w/beta"), six("S*w"), six("E*w"), six("w*(U + I)")]);
}

/// Functions with sines, exponentials and known values, with an arbitrary input and with derivatives of one,
/// by hand.
#[test]
fn functions_of_other_factors_by_hand() {
    let (plane, sum) = (
        "x='v*cos(th)'\ny='v*sin(th)'\nth='w'\n[known_inputs]\nv='generic'\nw='generic'\n[outputs]\nr='x^2 + y^2'",
        "x='0'\nz='k*x + b*u'\n[parameters]\nk={}\nb={}\n[known_inputs]\nu='constant'\n[outputs]\ny='z'",
    );
    let derivatives = "x='w + a'\na='b'\nb='q'\n[parameters]\nq={}\n[unknown_inputs]\nw={ polynomial = 2 }\n\
                       [outputs]\ny='x'";
    let of = |states: &str| analyzed(&format!("name='m'\n[states]\n{states}"));
    let cases = [
        // a turn of the plane leaves the range and the projection on the heading
        (plane, vec![("x^2 + y^2", 0), ("x*cos(th) + y*sin(th)", 1)]),
        // z' = a exp(b)
        ("z='a*exp(b)'\n[parameters]\na={}\nb={}\n[outputs]\ny='z'", vec![("a*exp(b)", 1)]),
        // y' = k x + b u with the constant, known u
        (sum, vec![("x*k + b*u", 1)]),
        // y'' = g w + b, with the arbitrary input w and the known constant g
        (
            "x='a'\na='g*w + b'\nb='0'\n[constants]\ng='generic'\n[unknown_inputs]\nw='arbitrary'\n[outputs]\ny='x'",
            vec![("b + w*g", 2)],
        ),
        // y' = w + a, y'' = w' + b, y''' = w'' + q
        (derivatives, vec![("a + w", 1), ("b + w'", 2), ("q + w''", 3)]),
        // functions of a multiple are written by those of the unknown, in the answer too
        (
            "z='0'\n[parameters]\na={}\nc={}\nd={}\n[outputs]\ny='tanh(a)*c'\nv='exp(-a)*d'",
            vec![("c*tanh(a)", 0), ("d/exp(a)", 0)],
        ),
        // of an arbitrary input the signal itself, not its derivatives
        (
            "z='0'\n[parameters]\na={}\nb={}\n[unknown_inputs]\nw='arbitrary'\n[outputs]\ny='a*(b + w)'",
            vec![("a*(b + w)", 0)],
        ),
        // the fourth derivative is no power
        (
            "z='a*w'\n[parameters]\na={}\n[unknown_inputs]\nw={ polynomial = 4 }\n[outputs]\ny='z'",
            vec![("a*w", 1), ("a*w'", 2), ("a*w''", 3), ("a*w'''", 4), ("a*w''''", 5)],
        ),
        // a known input that is linear in time, and its derivative
        (
            "x='a*u + c*w'\n[parameters]\na={}\nc={}\n[known_inputs]\nu={ polynomial = 1 }\n[unknown_inputs]\n\
             w={ polynomial = 1 }\n[outputs]\ny='x'",
            vec![("a*u + c*w", 1), ("a*u' + c*w'", 2)],
        ),
        // an exponential of an unknown input
        (
            "x='k*exp(w)'\n[parameters]\nk={}\n[unknown_inputs]\nw='constant'\n[outputs]\ny='x'",
            vec![("k*exp(w)", 1)],
        ),
    ];
    for (text, functions) in cases {
        let a = of(text);
        let listed: Vec<(&str, usize)> =
            a.invariants.iter().map(|f| (f.expression.as_str(), f.degree.expect("a degree"))).collect();
        assert_eq!((listed, a.missing_functions), (functions, 0), "{text}");
    }
    assert_eq!(number(of(sum).invariants[0].number_of_solutions.as_ref()), Some(1));
    // in real numbers too, derivatives of an arbitrary input do not count: a*sqrt(x) + w alone is missing
    let root = of("x='a*sqrt(x) + w'\n[parameters]\na={}\n[unknown_inputs]\nw='arbitrary'\n[outputs]\ny='x'");
    assert_eq!((root.digits.is_some(), root.missing_functions), (true, 1));
    let moved = of(derivatives);
    let words: Vec<&str> = moved.symmetries.iter().map(|s| s.words.as_str()).collect();
    assert!(words.contains(&"add c to q; subtract c from w''"), "{words:?}");
}

/// Reference models: the rank equals the number of observable unknowns and functions. Each function is
/// observable with the same degree when requested as a combination.
#[test]
fn functions_are_complete() {
    let (mut missing, mut asked) = (Vec::new(), 0);
    for (name, reference, text) in some_models() {
        let model = json::read(&text).expect("a model");
        let options = SystemOptions { solutions: false, ..SystemOptions::default() };
        let a = analyze_system(&model, options).expect("judged");
        missing.extend((a.missing_functions > 0).then(|| name.clone()));
        if model.unknown_inputs.is_empty() {
            let observable = a.quantities.iter().filter(|q| q.degree.is_some()).count();
            assert_eq!(observable + a.invariants.len(), a.rank, "{name}");
        }
        // models with few functions, whose names are valid in a formula
        if a.invariants.is_empty() || a.invariants.len() > 8 {
            continue;
        }
        let mut asking = reference.clone();
        asking["observable_combinations"] = a.invariants.iter().map(|f| f.expression.as_str()).collect();
        let Ok(model) = json::read(&asking.to_string()) else { continue };
        let again = judge(&model, 1, None).expect("judged");
        for (verdict, f) in again.asked().zip(&a.invariants) {
            assert_eq!(verdict.degree, f.degree, "{name}: {}", f.expression);
            asked += 1;
        }
    }
    assert_eq!(missing, Vec::<String>::new());
    assert!(asked > cases(30, 100), "{asked}");
}

/// Reduced versions of reference models that are not fully observable: judged again they are fully
/// observable, with the same rank.
#[test]
fn reduced_models_are_fully_observable() {
    let (mut made, mut refused) = (0, 0);
    for (name, reference, text) in some_models() {
        let model = json::read(&text).expect("a model");
        match reduced(&model, 1, None) {
            Ok(found) => {
                let again = model_file::read(&found.text).unwrap_or_else(|e| panic!("{name}: {e}"));
                let judged = judge(&again, 7, None).expect("judged");
                let rank = judged.findings.degrees.rank();
                assert_eq!(rank, judged.layout.unknowns.len(), "{name}");
                assert_eq!(rank as u64, reference["expected_rank"].as_u64().unwrap_or(rank as u64), "{name}");
                made += 1;
            }
            Err(ReducedError::FullyObservable) => {}
            Err(ReducedError::NotCovered(_)) => refused += 1,
            Err(e) => panic!("{name}: {e}"),
        }
    }
    assert!(made >= cases(20, 71) && refused >= cases(4, 22), "{made} {refused}");
}

//! Solving expressions of models, tried with derivatives of the outputs from power series that this test
//! computes.

use std::collections::{BTreeMap, BTreeSet};

use obsdeg_core::language::{Expression, Names, Node, parse_with};
use obsdeg_core::system::{
    Constant, KnownInput, StateStart, SystemAnalysis, SystemModel, SystemOptions, analyze_system, json,
    model_file,
};
use obsdeg_exact::SplitMix64;

use crate::models::models;

/// Prime of 61 bits that the program does not use.
const P: u128 = (1 << 61) - 1;
/// Number of coefficients of a series, above the order of any derivative in an expression.
const ORDERS: usize = 22;

/// Power series modulo `P`, up to the last computed coefficient.
type Series = Vec<u128>;

fn power(mut x: u128, mut e: u128) -> u128 {
    let mut out = 1;
    while e > 0 {
        if e & 1 == 1 {
            out = out * x % P;
        }
        (x, e) = (x * x % P, e >> 1);
    }
    out
}

fn inverse(x: u128) -> u128 {
    assert_ne!(x % P, 0, "a point where nothing is divided by zero");
    power(x, P - 2)
}

fn product(a: &Series, b: &Series) -> Series {
    (0..a.len()).map(|k| (0..=k).fold(0, |sum, j| (sum + a[j] * b[k - j]) % P)).collect()
}

/// Quotient `a / b`.
fn quotient(a: &Series, b: &Series) -> Series {
    let first = inverse(b[0]);
    let mut out = Series::new();
    for k in 0..a.len() {
        let known = (0..k).fold(0, |sum, j| (sum + out[j] * b[k - j]) % P);
        out.push((a[k] + P - known) * first % P);
    }
    out
}

/// Series of an expression; `None` if it contains a function or a name without a value.
fn series(e: &Expression, at: &BTreeMap<String, Series>, length: usize) -> Option<Series> {
    let number = |x: u128| (0..length).map(|k| if k == 0 { x % P } else { 0 }).collect::<Series>();
    let mut all: Vec<Series> = Vec::new();
    for node in &e.nodes {
        let minus = |a: &Series| a.iter().map(|x| (P - x) % P).collect::<Series>();
        let sum = |a: &Series, b: &Series| a.iter().zip(b).map(|(x, y)| (x + y) % P).collect::<Series>();
        all.push(match node {
            Node::Number { mantissa, decimals } => {
                let ten = power(10, decimals.unsigned_abs().into());
                let size = mantissa.unsigned_abs() % P;
                let x = size * if *decimals > 0 { inverse(ten) } else { ten } % P;
                number(if *mantissa < 0 { P - x } else { x })
            }
            Node::Name(name) => at.get(name)?[..length].to_vec(),
            Node::Negate(a) => minus(&all[*a]),
            Node::Add(a, b) => sum(&all[*a], &all[*b]),
            Node::Subtract(a, b) => sum(&all[*a], &minus(&all[*b])),
            Node::Multiply(a, b) => product(&all[*a], &all[*b]),
            Node::Divide(a, b) => quotient(&all[*a], &all[*b]),
            Node::Power(a, b) => {
                let Node::Number { mantissa, decimals: 0 } = e.nodes[*b] else { return None };
                let times = usize::try_from(mantissa).ok()?;
                (0..times).fold(number(1), |out, _| product(&out, &all[*a]))
            }
            Node::Call { .. } => return None,
        });
    }
    all.pop()
}

/// Series of all names of a model at a random point, outputs included; `None` if the model has functions.
fn drawn(model: &SystemModel, a: &SystemAnalysis, rng: &mut SplitMix64) -> Option<BTreeMap<String, Series>> {
    let mut any = || u128::from(rng.next_u64()) % P;
    let constant = |x: u128| (0..ORDERS).map(|k| if k == 0 { x } else { 0 }).collect::<Series>();
    let mut at: BTreeMap<String, Series> = BTreeMap::new();
    for named in model.parameters.iter().chain(model.unknown_inputs.iter().map(|u| &u.0)) {
        at.insert(named.name.clone(), constant(any()));
    }
    for (named, value) in &model.constants {
        let own = match value {
            Constant::Generic => constant(any()),
            Constant::Value(e) => series(&e.expression, &BTreeMap::new(), ORDERS)?,
        };
        at.insert(named.name.clone(), own);
    }
    for (named, kind) in &model.known_inputs {
        let terms = match kind {
            KnownInput::Generic => ORDERS,
            KnownInput::Polynomial(degree) => degree + 1,
            KnownInput::Function(_) => return None,
        };
        at.insert(named.name.clone(), (0..ORDERS).map(|k| if k < terms { any() } else { 0 }).collect());
    }
    for s in &model.states {
        at.insert(s.named.name.clone(), constant(any()));
    }
    let mut lines: Vec<(String, Expression)> = Vec::new();
    for line in &a.equations {
        let (left, right) = line.split_once(" = ")?;
        lines.push((left.into(), parse_with(right, Names::Plain).ok()?));
    }
    // definitions are listed before their uses
    let is_output = |name: &str| model.outputs.iter().any(|o| o.0.name == name);
    lines.sort_by_key(|(left, _)| left.ends_with('\'') || is_output(left));
    // each pass adds one coefficient to every state
    for k in 0..ORDERS {
        let mut next = at.clone();
        for (left, e) in &lines {
            let found = series(e, &next, k + 1)?;
            match left.strip_suffix('\'') {
                Some(state) if k + 1 < ORDERS => {
                    let rate = found[k] * inverse(k as u128 + 1) % P;
                    at.get_mut(state).expect("a state")[k + 1] = rate;
                }
                Some(_) => {}
                None => {
                    let mut whole = found;
                    whole.resize(ORDERS, 0);
                    next.insert(left.clone(), whole.clone());
                    at.insert(left.clone(), whole);
                }
            }
        }
    }
    Some(at)
}

/// The text with `y''` and `y^(4)` written as `y_d2` and `y_d4`, and the values of these names.
fn with_derivatives(text: &str, at: &BTreeMap<String, Series>) -> (String, BTreeMap<String, Series>) {
    let (mut out, mut values) = (String::new(), BTreeMap::new());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        if !is_name(first) {
            out.push(first);
            rest = &rest[first.len_utf8()..];
            continue;
        }
        let (name, behind) = rest.split_at(rest.find(|c| !is_name(c)).unwrap_or(rest.len()));
        let primes = behind.len() - behind.trim_start_matches('\'').len();
        let (order, behind) = match behind.strip_prefix("^(").and_then(|b| b.split_once(')')) {
            Some((k, after)) => (k.parse().expect("an order"), after),
            None => (primes, &behind[primes..]),
        };
        rest = behind;
        let Some(own) = at.get(name) else {
            out.push_str(name);
            continue;
        };
        let factorial = (1..=order as u128).product::<u128>() % P;
        let shown = if order == 0 { name.to_string() } else { format!("{name}_d{order}") };
        out.push_str(&shown);
        values.insert(shown, vec![own[order] * factorial % P]);
    }
    (out, values)
}

/// Tries the expressions of a model and returns their number. Each gives the value of its unknown, and none
/// rests on itself.
fn tried(name: &str, model: &SystemModel, seed: u64) -> usize {
    let a = analyze_system(model, SystemOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
    let solved = || a.quantities.iter().filter_map(|q| Some((&q.name, q.solution.as_ref()?)));
    let words = |text: &str| -> BTreeSet<String> {
        text.split(|c: char| !c.is_alphanumeric() && c != '_').map(String::from).collect()
    };
    let held: BTreeMap<&String, BTreeSet<String>> = solved().map(|(n, e)| (n, words(e))).collect();
    for own in held.keys() {
        let (mut seen, mut left) = (BTreeSet::new(), vec![(*own).clone()]);
        while let Some(at) = left.pop() {
            left.extend(held.get(&at).into_iter().flatten().filter(|w| seen.insert((*w).clone())).cloned());
        }
        assert!(
            !seen.contains(*own),
            "{name}: {own} = {} rests on itself",
            a.quantities
                .iter()
                .find(|q| q.name == **own)
                .and_then(|q| q.solution.clone())
                .unwrap_or_default()
        );
    }
    let known = model.states.iter().any(|s| s.start != StateStart::Unknown);
    if known || model.experiments > 1 || !model.segments.is_empty() || !a.constraints.is_empty() {
        return 0;
    }
    let Some(at) = drawn(model, &a, &mut SplitMix64::new(seed)) else { return 0 };
    let mut count = 0;
    for (unknown, text) in solved() {
        let (text, values) = with_derivatives(text, &at);
        let e = parse_with(&text, Names::Plain).unwrap_or_else(|e| panic!("{name}: {text}: {e:?}"));
        let value = series(&e, &values, 1).unwrap_or_else(|| panic!("{name}: {text}"));
        assert_eq!(value[0], at[unknown][0], "{name}: {unknown} = {text}");
        count += 1;
    }
    count
}

/// Tries the expressions of every `step`th reference model and returns their number.
fn all_tried(step: usize) -> usize {
    let mut count = 0;
    for (name, _, text) in models().into_iter().step_by(step) {
        count += tried(&name, &json::read(&text).unwrap_or_else(|e| panic!("{name}: {e}")), 1);
    }
    count
}

#[test]
#[ignore = "seconds: .ci/run"]
fn expressions_of_models_solve_and_do_not_rest_on_themselves() {
    assert!(all_tried(4) > 70);
    for name in ["bruno2016", "two_state_feedforward_no_input"] {
        let (_, _, text) = models().into_iter().find(|m| m.0 == name).expect("a model");
        tried(name, &json::read(&text).expect("a model"), 1);
    }
    let mut examples = 0;
    for folder in std::fs::read_dir(format!("{}/examples", env!("CARGO_MANIFEST_DIR"))).expect("examples") {
        let folder = folder.expect("an entry").path();
        let files = std::fs::read_dir(&folder).into_iter().flatten();
        for file in
            files.map(|f| f.expect("a file").path()).filter(|f| f.extension() == Some("toml".as_ref()))
        {
            let text = std::fs::read_to_string(&file).expect("readable");
            let wrong = folder.ends_with("wrong-models");
            if let Some(model) = model_file::read(&text).ok().filter(|_| !wrong) {
                examples += tried(&file.display().to_string(), &model, 2);
            }
        }
    }
    assert!(examples > 10, "{examples}");
}

/// All reference models, in seconds: `cargo test --test it -- --ignored expressions::`.
#[test]
#[ignore = "seconds"]
fn expressions_of_all_reference_models() {
    let count = all_tried(1);
    assert!(count >= 300, "{count}");
}

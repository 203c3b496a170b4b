//! Sentences of answers, applied to systems that this test integrates.

use std::collections::BTreeMap;

use obsdeg_core::language::{Expression, Names, evaluate_f64, parse_with};
use obsdeg_core::system::{
    Constant, ModelError, SystemAnalysis, SystemModel, SystemOptions, analyze_system, json, model_file,
};

use crate::program::cases;

/// Values by name.
type Point = BTreeMap<String, f64>;

fn without_solutions(model: &SystemModel) -> Result<SystemAnalysis, ModelError> {
    analyze_system(model, SystemOptions { solutions: false, ..SystemOptions::default() })
}

fn read(text: &str) -> SystemModel {
    model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn expression(text: &str) -> Option<Expression> {
    parse_with(text, Names::Plain).ok()
}

fn value(e: &Expression, at: &Point) -> f64 {
    evaluate_f64(e, &|name| at.get(name).copied().unwrap_or(f64::NAN))
}

/// Printed equations of an answer, integrated by the method of Runge and Kutta.
struct Equations {
    definitions: Vec<(String, Expression)>,
    rates: Vec<(String, Expression)>,
    outputs: Vec<Expression>,
    inputs: Vec<String>,
}

impl Equations {
    /// Parses printed equations; `None` if they have another form than `x' = ...`, `d = ...` and `y = ...`.
    fn read(model: &SystemModel, printed: &[String]) -> Option<Self> {
        let inputs = model.known_inputs.iter().map(|i| i.0.name.clone()).collect();
        let mut out = Self { definitions: vec![], rates: vec![], outputs: vec![], inputs };
        for line in printed {
            let (left, right) = line.split_once(" = ")?;
            let right = expression(right)?;
            match left.strip_suffix('\'') {
                Some(state) => out.rates.push((state.into(), right)),
                None if model.outputs.iter().any(|o| o.0.name == left) => out.outputs.push(right),
                None => out.definitions.push((left.into(), right)),
            }
        }
        Some(out)
    }

    fn at(&self, t: f64, x: &Point) -> Point {
        let mut at = x.clone();
        at.insert("t".into(), t);
        for (i, name) in self.inputs.iter().enumerate() {
            at.insert(name.clone(), 1.2 + 0.4 * ((0.7 + i as f64) * t).sin());
        }
        for (name, e) in &self.definitions {
            let x = value(e, &at);
            at.insert(name.clone(), x);
        }
        at
    }

    fn moved(&self, x: &Point, slope: &[f64], h: f64) -> Point {
        let mut out = x.clone();
        for ((name, _), s) in self.rates.iter().zip(slope) {
            *out.get_mut(name).expect("a state") += h * s;
        }
        out
    }

    /// All outputs at several times.
    fn outputs(&self, mut x: Point) -> Vec<f64> {
        let h = 1e-3;
        let mut out = Vec::new();
        for k in 0..=150 {
            let t = h * f64::from(k);
            if k % 50 == 0 {
                let at = self.at(t, &x);
                out.extend(self.outputs.iter().map(|y| value(y, &at)));
            }
            let slope = |t: f64, x: &Point| -> Vec<f64> {
                let at = self.at(t, x);
                self.rates.iter().map(|(_, f)| value(f, &at)).collect()
            };
            let a = slope(t, &x);
            let b = slope(t + h / 2.0, &self.moved(&x, &a, h / 2.0));
            let c = slope(t + h / 2.0, &self.moved(&x, &b, h / 2.0));
            let d = slope(t + h, &self.moved(&x, &c, h));
            let sum = |i: usize| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0;
            let sum: Vec<f64> = (0..a.len()).map(sum).collect();
            x = self.moved(&x, &sum, h);
        }
        out
    }
}

/// Applies a sentence to a point, with `by` as the value of its letter.
fn applied(sentence: &str, by: f64, x: &Point) -> Point {
    let mut out = x.clone();
    let letter =
        ["c", "s", "k", "factor", "factor_"].into_iter().find(|n| !x.contains_key(*n)).expect("a letter");
    let with = |text: &str| {
        // for example `981/100 c`, `2 log(c)`
        let text = match text.split_once(' ') {
            Some((number, rest)) if rest.starts_with(letter) || rest.starts_with("log(") => {
                format!("{number}*{rest}")
            }
            _ => text.into(),
        };
        let mut at = x.clone();
        at.insert(letter.into(), by);
        value(&expression(&text).unwrap_or_else(|| panic!("{sentence}: {text}")), &at)
    };
    let list = |names: &str| names.split(", ").map(String::from).collect::<Vec<_>>();
    if let Some(rest) = sentence.strip_prefix("move ") {
        // flow along a polynomial direction
        let (names, speeds) = rest.split_once(" along ").expect("a direction");
        let speeds: Vec<Expression> =
            speeds.split(", ").map(|s| expression(s).unwrap_or_else(|| panic!("{s}"))).collect();
        let rates = list(names).into_iter().zip(speeds).collect();
        let flow = Equations { definitions: vec![], rates, outputs: vec![], inputs: vec![] };
        let steps = 200;
        let h = by.ln() / 4.0 / f64::from(steps);
        for _ in 0..steps {
            let slope = |x: &Point| flow.rates.iter().map(|(_, f)| value(f, x)).collect::<Vec<_>>();
            let half = flow.moved(&out, &slope(&out), h / 2.0);
            out = flow.moved(&out, &slope(&half), h);
        }
        return out;
    }
    for part in sentence.split("; ") {
        let (verb, rest) = part.split_once(' ').expect("a verb");
        let (names, change): (Vec<String>, Box<dyn Fn(f64) -> f64>) = match verb {
            "multiply" | "divide" => {
                let (names, factor) = rest.split_once(" by ").expect("a factor");
                let factor = if verb == "multiply" { with(factor) } else { 1.0 / with(factor) };
                (list(names), Box::new(move |x| x * factor))
            }
            "replace" => {
                let (name, new) = rest.split_once(" by ").expect("an expression");
                let new = with(new);
                (vec![name.into()], Box::new(move |_| new))
            }
            "add" => {
                let (amount, names) = rest.split_once(" to ").expect("an amount");
                let amount = with(amount);
                (list(names), Box::new(move |x| x + amount))
            }
            "subtract" => {
                let (amount, names) = rest.split_once(" from ").expect("an amount");
                let amount = with(amount);
                (list(names), Box::new(move |x| x - amount))
            }
            _ => panic!("{part}"),
        };
        for name in names {
            let x = out.get_mut(&name).unwrap_or_else(|| panic!("{sentence}: {name}"));
            *x = change(*x);
        }
    }
    out
}

/// Tries every symmetry of an answer from a point: outputs and constraints do not change, and only the named
/// unknowns do. Returns the number of symmetries; `None` if the system cannot be integrated.
fn symmetries_hold(model: &SystemModel, a: &SystemAnalysis, start: &Point) -> Option<usize> {
    let equations = Equations::read(model, &a.equations)?;
    let expected = equations.outputs(start.clone());
    if expected.iter().any(|y| !y.is_finite()) {
        return None;
    }
    for s in &a.symmetries {
        for by in [0.8, 1.3, 1.9] {
            let other = applied(&s.words, by, start);
            assert!(other != *start, "{}: {}", a.name, s.words);
            for (name, x) in start.iter().filter(|(name, _)| !s.unknowns.contains(name)) {
                assert_eq!(other[name], *x, "{}: {} moves {name}", a.name, s.words);
            }
            let found = equations.outputs(other.clone());
            let scale = expected.iter().fold(1e-3, |m: f64, y| m.max(y.abs()));
            for (a_y, b_y) in expected.iter().zip(&found) {
                assert!((a_y - b_y).abs() < 1e-6 * scale, "{}: {} by {by}: {a_y} {b_y}", a.name, s.words);
            }
            for c in &a.constraints {
                let (left, right) = c.split_once(" = ").expect("an equation");
                let side = |text: &str| value(&expression(text).expect("an expression"), &other);
                assert!((side(left) - side(right)).abs() < 1e-6, "{}: {} by {by}: {c}", a.name, s.words);
            }
        }
        // the identity
        let by = if s.words.contains("multiply") || s.words.contains("divide") { 1.0 } else { 0.0 };
        if !s.words.starts_with("move") {
            let same = applied(&s.words, by, start);
            let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-12;
            assert!(same.values().zip(start.values()).all(near), "{}: {} at {by}", a.name, s.words);
        }
    }
    Some(a.symmetries.len())
}

/// Point of a model with unknowns of about one.
fn point(model: &SystemModel) -> Point {
    let states = model.states.iter().map(|s| s.named.name.clone());
    let names = states.chain(model.parameters.iter().map(|p| p.name.clone()));
    let mut out: Point =
        names.enumerate().map(|(i, n)| (n, 0.6 + 0.37 * ((1.7 * i as f64).sin() + 1.0))).collect();
    for (i, (named, constant)) in model.constants.iter().enumerate() {
        let own = match constant {
            Constant::Value(e) => evaluate_f64(&e.expression, &|_| f64::NAN),
            Constant::Generic => 0.9 + 0.1 * i as f64,
        };
        out.insert(named.name.clone(), own);
    }
    out
}

const SIR: &str = "name='sir'\nparameters=['beta', 'gamma', 'k']\nconstraints=['S + I + R = 1']\n[states]\n\
                   S='-beta*S*I'\n\
                   I='beta*S*I - gamma*I'\nR='gamma*I'\n[outputs]\ny='k*I'";

/// Every printed symmetry, at several c: outputs and constraints do not change, and c = 1 (0 without scaling)
/// is the identity.
#[test]
fn symmetries_do_what_they_say() {
    let tried = |text: &str, start: &[(&str, f64)]| {
        let model = read(text);
        let a = without_solutions(&model).expect("judged");
        let start = start.iter().map(|(n, x)| (n.to_string(), *x)).collect();
        assert!(symmetries_hold(&model, &a, &start).is_some_and(|n| n > 0), "{text}");
        a.symmetries.into_iter().map(|s| s.words).collect::<Vec<_>>()
    };
    let rates = [("beta", 0.5), ("gamma", 0.2), ("k", 0.3)];
    assert_eq!(
        tried(SIR, &[&rates[..], &[("S", 0.7), ("I", 0.2), ("R", 0.1)]].concat()),
        ["multiply S, I by c; replace R by c*R + 1 - c; divide beta, k by c"]
    );
    let half = SIR.replace("S + I + R = 1", "S + I + 2*R = 3");
    assert_eq!(
        tried(&half, &[&rates[..], &[("S", 0.7), ("I", 0.3), ("R", 1.0)]].concat()),
        ["multiply S, I by c; replace R by c*R + 3/2*(1 - c); divide beta, k by c"]
    );
    // exponents are added where factors are multiplied
    assert_eq!(
        tried(
            "name='e'\nparameters=['a', 'b']\n[states]\nx='-x'\n[outputs]\ny='a*exp(2*b)*x'\nz='x'",
            &[("x", 1.0), ("a", 0.7), ("b", 0.3)]
        ),
        ["multiply a by c; subtract 1/2 log(c) from b"]
    );
    assert_eq!(
        tried(
            "name='s'\nparameters=['a', 'b']\n[states]\nx='a + b'\n[outputs]\ny='x'",
            &[("x", 1.0), ("a", 0.7), ("b", 0.3)]
        ),
        ["add c to a; subtract c from b"]
    );
}

/// Symmetries of the reference models from one point each, for models without known starts, segments and
/// unknown inputs.
#[test]
fn symmetries_of_the_reference_models() {
    let mut tried = 0;
    for (name, _, text) in crate::models::some_models() {
        let model = json::read(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
        let plain = model.segments.is_empty() && model.experiments < 2 && model.unknown_inputs.is_empty();
        if !plain || model.states.len() + model.parameters.len() > 40 {
            continue;
        }
        let a = without_solutions(&model).expect("judged");
        if a.known.is_empty() && a.constraints.is_empty() {
            tried += symmetries_hold(&model, &a, &point(&model)).unwrap_or(0);
        }
    }
    assert!(tried >= cases(20, 70), "{tried}");
}

/// Table of an answer, by the program.
fn table(text: &str) -> String {
    let a = without_solutions(&read(text)).expect("judged");
    obsdeg_report::written(&a, obsdeg_report::Format::Table, obsdeg_report::TerminalLayout::default())
        .expect("text")
}

/// Without a count no number is stated: the sine has infinitely many solutions, a square two.
#[test]
fn what_is_not_counted_has_no_number() {
    for output in ["sin(th)", "th^2"] {
        let text = table(&format!("name='m'\n[states]\nth='0'\n[outputs]\ny='{output}'"));
        assert!(
            text.contains("locally identifiable (solutions not counted)") && !text.contains("finitely many"),
            "{text}"
        );
        for k in [-1.0, 1.0] {
            // another value with the same output
            let (own, other) =
                if output == "th^2" { (0.3, 0.3 * k) } else { (0.3, 0.3 + k * std::f64::consts::TAU) };
            let y =
                |th: f64| value(&expression(output).expect("an output"), &[("th".to_string(), th)].into());
            assert!((y(own) - y(other)).abs() < 1e-12);
        }
    }
}

/// First lines mention "locally" exactly for unknowns that are determined only locally: other values give the
/// same outputs, or solutions were not counted.
#[test]
fn first_lines_say_local() {
    let said = |output: &str, solutions: bool| {
        let model = read(&format!("name='m'\n[states]\nth='0'\n[outputs]\ny='{output}'"));
        let a = analyze_system(&model, SystemOptions { solutions, ..SystemOptions::default() });
        let text = obsdeg_report::written(
            &a.expect("judged"),
            obsdeg_report::Format::Table,
            obsdeg_report::TerminalLayout::default(),
        );
        text.expect("text").lines().nth(1).expect("a first line").trim().to_string()
    };
    let determined = "th is determined by the outputs themselves";
    for (output, tail) in [
        ("th", ""),
        ("2*th - 1", ""),
        ("th^2", "; several solutions: th"),
        ("sin(th)", "; locally, number of solutions not decided: th"),
    ] {
        assert_eq!(said(output, true), format!("{determined}{tail}"), "{output}");
        assert_eq!(said(output, false), format!("{determined}; locally: solutions are not counted"));
    }
}

/// A constraint that determines an unknown is mentioned beside the outputs: no output contains y.
#[test]
fn constraints_are_named_beside_the_outputs() {
    let text = table("name='m'\nconstraints=['x + y = 3']\n[states]\nx='0'\ny='0'\n[outputs]\nz='x'");
    assert!(text.contains("are determined by the outputs and the constraints themselves"), "{text}");
    assert!(text.contains("from the outputs and the constraints themselves; "), "{text}");
    let text = table("name='m'\n[states]\nx='0'\ny='0'\n[outputs]\nz='x'\nw='y'");
    assert!(text.contains("are determined by the outputs themselves"), "{text}");
}

/// Beyond the bound on the order outputs may change: y = (a + b) t + a t^71/71 does so from t = 0.
#[test]
fn beyond_the_bound_no_output_is_said_to_stay() {
    let text = "name='m'\nparameters=['a', 'b']\nknown_inputs={u={function='t^70'}}\n[states]\nx='a + b + a*u'\n\
                [outputs]\ny='x'";
    let said = table(text);
    assert!(said.contains("add c to a; subtract c from b"), "{said}");
    let y = |a: f64, b: f64| (a + b) * 1.2 + a * 1.2f64.powi(71) / 71.0;
    assert!((y(0.7, 0.3) - y(0.7 + 1.0, 0.3 - 1.0)).abs() > 1.0);
    let heading = "No derivative up to order 60 changes at the start when you";
    assert!(said.contains(heading) && !said.contains("No output changes"), "{said}");
    // a proven end
    let said = table("name='m'\nparameters=['a', 'b']\n[states]\nx='-a*b*x'\n[outputs]\ny='x'");
    assert!(said.contains("No output changes when you") && !said.contains("No derivative up to"), "{said}");
    // an empty list has no heading
    let alone = text.replace("a + b + a*u", "a*u").replace("'a', 'b'", "'a'");
    let said = table(&alone);
    assert!(!said.contains("No output changes") && !said.contains("No derivative up to"), "{said}");
}

/// The cross-check of a model uses the information of samples: no filter runs, and none is mentioned.
#[test]
fn models_are_checked_without_a_filter() {
    let model = read(
        "name='m'\nparameters=['a']\n[states]\nx='-a*x'\n[outputs]\ny='x'\n[simulation]\nduration=2.0\nstep=0.1\n\
         noise={y=0.01}\nvalues={a=0.5, x=1.0}\npriors={a=1.0, x=1.0}",
    );
    let evidence = obsdeg_evidence::system::crosscheck_system(&model, 1).expect("evidence");
    let text = obsdeg_report::written(
        &evidence,
        obsdeg_report::Format::Table,
        obsdeg_report::TerminalLayout::default(),
    );
    let text = text.expect("text");
    assert!(text.contains("agrees with the exact verdicts") && text.contains("(no filter is run)"), "{text}");
    assert!(!text.contains("filter and exact verdicts"), "{text}");
}

/// Verdicts hold at the stated time: degrees of x' = a + b t^2 by hand at 0, at 2 and at almost every time.
#[test]
fn verdicts_are_those_of_the_time_that_is_said() {
    let model = |time: &str| {
        format!(
            "name='m'\nparameters=['a', 'b']\n{time}\nknown_inputs={{u={{function='t^2'}}}}\n[states]\nx='a + b*u'\n\
             [outputs]\ny='x'"
        )
    };
    for (time, said, degrees) in [
        ("", "judged at t = 0, where the run begins", [1, 3]),
        ("time = 0", "judged at t = 0, where the run begins", [1, 3]),
        ("time = 2", "judged at t = 2, where the run begins", [2, 2]),
        ("time = -0.5", "judged at t = -0.5, where the run begins", [2, 2]),
        ("time = 'generic'", "judged at a generic time", [2, 2]),
    ] {
        let text = model(time);
        let a = without_solutions(&read(&text)).expect("judged");
        let of = |name: &str| a.quantities.iter().find(|q| q.name == name).and_then(|q| q.degree);
        assert_eq!([of("a"), of("b")], degrees.map(Some), "{time}");
        assert!(table(&text).replace("\n      ", " ").contains(said), "{time}");
        // y' = a + b t^2, y'' = 2 b t, y''' = 2 b: at the stated time a and b follow from the stated number
        // of derivatives
        let t: f64 = said
            .split("t = ")
            .nth(1)
            .map_or(3.0, |rest| rest.split(',').next().expect("a number").parse().expect("a number"));
        let b = if t == 0.0 { 3 } else { 2 };
        assert_eq!(degrees, if t == 0.0 { [1, b] } else { [b, b] });
    }
    let without = "name='m'\nparameters=['a']\n[states]\nx='a'\n[outputs]\ny='x'";
    assert!(!table(without).contains("judged at"));
    // an output in the second segment only: the time is generic there, whatever the start of the first
    // segment
    let late = model("").replace("'a + b*u'", "'c*(a + b*u)'").replace("y='x'", "y='c*x'")
        + "\n[constants]\nc=0\n[[segment]]\nconstants={c='0'}\n[[segment]]\nconstants={c='1'}";
    let a = without_solutions(&read(&late)).expect("judged");
    let of = |name: &str| a.quantities.iter().find(|q| q.name == name).and_then(|q| q.degree);
    assert_eq!(["a", "b"].map(of), [Some(2), Some(2)]);
    assert!(
        table(&late)
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
            .contains("segments after the first, if there are any, at a generic time")
    );
    for wrong in ["time = 'later'", "time = [1]", "time = nan"] {
        let error = model_file::read(&model(wrong)).expect_err("refused");
        assert!(error.to_string().contains("expected a number or"), "{wrong}: {error}");
    }
}

/// Runs state their start time where it matters: a run of x' = a + b t^2 over 1 s from rest ends at `a + b
/// (1/3 + t + t^2)`.
#[test]
fn runs_say_when_they_begin() {
    let place = tempfile::tempdir().expect("a folder");
    let file = place.path().join("model.toml");
    for (time, begins) in [("", 0.0), ("time = 2", 2.0), ("time = 'generic'", 1.0)] {
        let text = format!(
            "name='m'\nparameters=['a', 'b']\n{time}\nknown_inputs={{u={{function='t^2'}}}}\n[states]\nx='a + b*u'\n\
             [outputs]\n\
             y='x'\n[simulation]\nduration=1.0\nstep=0.01\nnoise={{y=0.01}}\nvalues={{a=2.0, b=3.0, x=0.0}}"
        );
        std::fs::write(&file, text).expect("written");
        let file = file.to_str().expect("a path");
        for command in ["simulate", "crosscheck"] {
            let arguments = [command, file, "-q"];
            let said = crate::program::stdout(&crate::program::run(&arguments)).replace("\n  ", " ");
            let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(said.contains(&format!("the run begins at t = {begins} ")), "{command} {time}: {said}");
            let json = crate::program::run(&[&arguments[..], &["--format", "json"]].concat());
            let json: serde_json::Value = serde_json::from_str(&crate::program::stdout(&json)).expect("JSON");
            assert_eq!(json["time"], begins, "{command} {time}");
        }
        let run = crate::program::json(&["simulate", file, "-q", "--format", "json"]);
        let of = |name: &str| {
            let all = run["quantities"].as_array().expect("a list");
            let own = all.iter().find(|q| q["name"] == name).expect("an unknown");
            own["truth"].as_f64().expect("a number")
        };
        let expected = 2.0 + 3.0 * (1.0 / 3.0 + begins + begins * begins);
        assert!((of("x") - expected).abs() < 1e-6, "{time}: {}", of("x"));
    }
}

/// A state with a known start has no verdict, and its error is not attributed to an unobservable unknown.
#[test]
fn known_starts_are_not_called_unobservable() {
    use obsdeg_core::degree::Status;
    let model = read(
        "name='m'\nparameters=['a', 'b']\n[states]\nx={equation='a + b', initial='0'}\n[outputs]\ny='x'\n\
         [simulation]\nduration=1.0\n\
         step=0.1\nnoise={y=0.01}\nvalues={a=2.0, b=3.0}",
    );
    let (run, _) = obsdeg_evidence::system::simulate_system(&model, 1).expect("a run");
    let said = |status: Option<Status>| {
        let mut run = run.clone();
        let x = run.quantities.iter_mut().find(|q| q.name == "x").expect("the state");
        (x.status, x.error_over_sigma) = (status, 9.0);
        let text = obsdeg_report::written(
            &run,
            obsdeg_report::Format::Table,
            obsdeg_report::TerminalLayout::default(),
        );
        text.expect("text").contains("x: not observable, yet")
    };
    assert!(run.quantities.iter().any(|q| q.name == "x" && q.status.is_none()));
    assert_eq!([None, Some(Status::Observable), Some(Status::Inseparable)].map(said), [false, false, true]);
}

/// A trivial error bound leads to no verdict.
#[test]
fn no_verdict_without_certainty() {
    let power = |nested: usize| (0..nested).fold("p".to_string(), |p, _| format!("({p})^1000"));
    let text =
        |nested| format!("name='m'\nparameters=['p']\n[states]\nx='0'\n[outputs]\ny='x*{}'", power(nested));
    let error = without_solutions(&read(&text(12))).expect_err("undecided");
    assert!(error.to_string().contains("undecided") && error.to_string().contains("61 bits"), "{error}");
    for nested in 0..8 {
        if let Ok(a) = without_solutions(&read(&text(nested))) {
            assert!(a.error_bound.is_some_and(|b| b <= 1e-9), "{nested}: {:?}", a.error_bound);
        }
    }
    assert!(without_solutions(&read(&text(1))).is_ok());
}

/// Constraints without a real point are refused. An existing point is found, or the message asks for it.
#[test]
fn constraints_have_real_points() {
    let judged = |constraint: &str, values: &str| {
        let text = format!(
            "name='m'\nconstraints=['{constraint}']\n[states]\nx='0'\ny='0'\n[outputs]\nz='x'\n[simulation]\n\
             values={{{values}}}"
        );
        model_file::read(&text).and_then(|m| without_solutions(&m))
    };
    for (constraint, said) in [
        ("sqrt(x^2 + y^2) = -1", "not negative"),
        ("x^2 + y^2 = -1", "no real point meets it"),
        ("x^2 + x*y + y^2 = -1", "no real point was found"),
    ] {
        let error = judged(constraint, "").expect_err("refused").to_string();
        assert!(error.contains(said), "{constraint}: {error}");
    }
    let vector =
        "name='m'\nconstraints=['norm(q) = -1']\n[states]\n'q[4]'='[0, 0, 0, 0]'\n[outputs]\nz='q[1]'";
    let error = model_file::read(vector).expect_err("refused").to_string();
    assert!(error.contains("not negative") && !error.contains("end of the expression"), "{error}");
    for constraint in ["x^2 + y^2 = 1", "x^100 + y^100 + x*y = 3", "x^3 + y^3 = -1", "sqrt(x^2 + y^2) = 2"] {
        let a = judged(constraint, "").unwrap_or_else(|e| panic!("{constraint}: {e}"));
        assert_eq!(a.rank, 2, "{constraint}");
    }
    // far from the tried starts: the advice of the refusal works
    let far = "(x - 100000)^2 + (y - 100000)^2 + (x - 100000)^2*(y - 100000)^2 = 0.000001";
    if let Err(error) = judged(far, "") {
        assert!(error.to_string().contains("give it under [simulation.values]"), "{error}");
    }
    assert_eq!(judged(far, "x=100000.001, y=100000.0").expect("a point is given").rank, 2);
}

/// Comparisons of one position's psi with other carries state the compared quantity.
#[test]
fn other_carries_say_what_is_compared() {
    use obsdeg_core::model::Carry;
    let said = |attitudes: &[&str], carry| {
        let a = crate::schemes::judged(&crate::schemes::scheme(attitudes, carry));
        let text = obsdeg_report::written(
            &a,
            obsdeg_report::Format::Table,
            obsdeg_report::TerminalLayout::default(),
        );
        let of_one = a.carries.iter().flat_map(|c| &c.differs).any(|d| d.name.contains('@'));
        (of_one, text.expect("text").contains("is judged as a combination of its unknowns"))
    };
    let mut some = [0; 2];
    for attitudes in [&["0,0,0", "180,0,0"][..], &crate::schemes::S6[..3], &crate::schemes::S6[..4]] {
        for carry in Carry::ALL {
            let (of_one, compared) = said(attitudes, carry);
            assert_eq!(of_one, compared, "{attitudes:?} {carry}");
            some[usize::from(of_one)] += 1;
        }
    }
    assert!(some[0] > 0 && some[1] > 0, "{some:?}");
}

/// An extended filter is not trusted at large angles: its sigmas are too small there, although single runs
/// are called consistent. An iterated filter has no such sentence.
#[test]
fn the_extended_filter_is_not_trusted_at_large_drifts() {
    let arguments = |command: &'static str, filter: &'static str, more: &[&'static str]| {
        let run =
            [command, "--angles", "0,0,0", "--angles", "180,0,0", "--truth", "exact", "--filter", filter];
        [&run[..], &["-q"], more].concat()
    };
    let json = |arguments: &[&str]| -> serde_json::Value {
        let output = crate::program::run(&[arguments, &["--format", "json"]].concat());
        serde_json::from_str(&crate::program::stdout(&output)).expect("JSON")
    };
    let run = |filter, seed, scale| -> (bool, bool) {
        let arguments = arguments("simulate", filter, &["--seed", seed, "--drift-scale", scale]);
        let text = crate::program::stdout(&crate::program::run(&arguments)).replace("\n      ", " ");
        (
            text.contains("do not trust the sigmas of this filter"),
            json(&arguments)["consistency"]["consistent"].as_bool().expect("said"),
        )
    };
    let runs = ["1", "2", "3", "4", "5", "6"].map(|seed| run("extended", seed, "1"));
    assert!(runs.iter().all(|r| r.0) && runs.iter().any(|r| r.1), "{runs:?}");
    let many = json(&arguments("crosscheck", "extended", &["--runs", "40"]));
    let anees = &many["monte_carlo"]["statistics"][0];
    assert!(
        anees["name"].as_str().is_some_and(|n| n.starts_with("ANEES")) && anees["pass"] == false,
        "{anees}"
    );
    assert!(!run("extended", "1", "0.001").0 && !run("iterated", "1", "1").0);
}

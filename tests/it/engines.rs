//! Two engines, one verdict: models judged in prime fields are judged again in real numbers of many digits.
//! The engines share the graph and the observability filtration, but not arithmetic, elimination or values of
//! functions.

use std::fmt::Write as _;
use std::path::PathBuf;

use obsdeg_core::system::{
    Judgement, SystemCertainty, SystemModel, json, judge_compiled, judge_in_digits, model_file,
};
use obsdeg_exact::SplitMix64;

/// Compares everything that two judgements must have in common.
fn same(a: &Judgement, b: &Judgement) -> Result<(), String> {
    let of = |j: &Judgement| {
        (j.findings.degrees.clone(), j.findings.asked.clone(), j.findings.partners.clone(), j.rests_on_bound)
    };
    let (a, b) = (of(a), of(b));
    if a == b { Ok(()) } else { Err(format!("{a:?}\n{b:?}")) }
}

/// Numbers of models by outcome.
#[derive(Debug, Default, PartialEq, Eq)]
struct Count {
    agree: usize,
    /// Number of models that real numbers leave undecided, as their message says.
    undecided: usize,
    /// Number of models that both engines refuse.
    refused: usize,
    /// Number of models with equal verdicts that are not fully observable. `open` counts those whose chain
    /// has no proven end.
    deficient: usize,
    open: usize,
    /// Number of models that one engine judges in prime fields and the other in real numbers.
    apart: usize,
}

/// Judges a model with both engines and counts the outcome.
fn hold(model: &SystemModel, text: &str, order: Option<usize>, count: &mut Count) {
    let compiled = model.compile().unwrap_or_else(|e| panic!("{e}\n{text}"));
    let fields = judge_compiled(model, &compiled, 3, order);
    let digits = judge_in_digits(model, &compiled, 5, order);
    match (fields, digits) {
        (Ok(a), Ok(b)) => {
            if let Err(difference) = same(&a, &b) {
                panic!("{difference}\n{text}");
            }
            count.agree += 1;
            count.deficient += usize::from(a.findings.degrees.rank() < a.layout.unknowns.len());
            count.open += usize::from(a.rests_on_bound);
            count.apart += usize::from(matches!(a.certainty, SystemCertainty::Primes(_)));
        }
        (Ok(_), Err(e)) if e.to_string().contains("undecided, because") => count.undecided += 1,
        (Err(_), Err(_)) => count.refused += 1,
        (a, b) => panic!("{:?} {:?}\n{text}", a.map(|a| a.findings.degrees), b.map(|b| b.findings.degrees)),
    }
}

/// Generator of models: polynomials and quotients in states, parameters, inputs and constants of given value;
/// some with known starts, segments, jumps and experiments.
struct ModelGenerator {
    rng: SplitMix64,
    functions: bool,
}

impl ModelGenerator {
    fn below(&mut self, n: u64) -> u64 {
        self.rng.below(n)
    }

    fn one_of<'a>(&mut self, names: &'a [String]) -> &'a str {
        let i = self.below(names.len() as u64) as usize;
        &names[i]
    }

    fn term(&mut self, names: &[String], depth: u64) -> String {
        if depth == 0 || self.below(4) == 0 {
            return match self.below(5) {
                0 => (self.below(7) as i64 - 3).to_string(),
                _ => self.one_of(names).to_string(),
            };
        }
        let (a, b) = (self.term(names, depth - 1), self.term(names, depth - 1));
        if self.functions && self.below(3) == 0 {
            let function = ["sin", "cos", "tan", "exp", "log", "atan", "tanh", "sqrt"];
            return format!("{}({a} + 2)", function[self.below(8) as usize]);
        }
        match self.below(9) {
            0..=3 => format!("({a} + {b})"),
            4 => format!("({a} - {b})"),
            5..=7 => format!("({a})*({b})"),
            _ => format!("({a})/(2 + ({b})^2)"),
        }
    }

    fn model(&mut self) -> String {
        let list = |letter: &str, n: u64| (0..n).map(|i| format!("{letter}{i}")).collect::<Vec<_>>();
        let states = 1 + self.below(4);
        let (x, p) = (list("x", states), list("p", self.below(4)));
        let (c, u) = (list("c", self.below(2)), list("u", self.below(2)));
        let w = list("w", u64::from(self.below(6) == 0));
        let names = [&x[..], &p, &c, &u, &w].concat();
        let mut text = String::from("name='m'\n");
        let experiments = self.below(8) == 0;
        if experiments {
            text += "experiments=2\n";
        }
        let _ = writeln!(text, "parameters={p:?}");
        if !c.is_empty() {
            let _ = writeln!(text, "[constants]\nc0={}", self.below(4));
        }
        if !u.is_empty() {
            let kind = if self.below(2) == 0 { "'generic'" } else { "{polynomial=1}" };
            let _ = writeln!(text, "[known_inputs]\nu0={kind}");
        }
        if !w.is_empty() {
            let kind = if self.below(3) == 0 { "'arbitrary'" } else { "{polynomial=1}" };
            let _ = writeln!(text, "[unknown_inputs]\nw0={kind}");
        }
        text += "[states]\n";
        let special = self.below(4) == 0;
        for name in &x {
            let rate = self.term(&names, 2);
            let start = match (special, self.below(3)) {
                (true, 0) => format!(", initial={}", self.below(3)),
                (true, 1) => ", initial='known'".into(),
                _ => String::new(),
            };
            let _ = writeln!(text, "{name}={{equation='{rate}'{start}}}");
        }
        text += "[outputs]\n";
        for i in 0..1 + self.below(2) {
            let _ = writeln!(text, "y{i}='{}'", self.term(&names, 2));
        }
        if self.below(4) == 0 {
            text += "[[segment]]\n[[segment]]\n";
            if !c.is_empty() {
                let _ = writeln!(text, "constants={{c0='{}'}}", self.below(4));
            }
            if self.below(2) == 0 {
                let _ = writeln!(text, "carry={{x0='{}'}}", self.term(&x, 1));
            }
        }
        text
    }
}

fn random_models(functions: bool, seeds: std::ops::Range<u64>) -> Count {
    let mut count = Count::default();
    for seed in seeds {
        let text = ModelGenerator { rng: SplitMix64::of(seed, "random models", &[""; 0]), functions }.model();
        let model = model_file::read(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        hold(&model, &text, Some(12), &mut count);
    }
    count
}

#[test]
fn random_rational_models_in_both_engines() {
    let count = random_models(false, 0..100);
    assert!(count.agree > 95 && count.deficient > 15 && count.open > 0, "{count:?}");
}

/// `cargo test --release --test it -- --ignored a_thousand_random_rational_models`
#[test]
#[ignore = "minutes"]
fn a_thousand_random_rational_models_in_both_engines() {
    let count = random_models(false, 1000..2000);
    assert_eq!((count.agree, count.apart), (1000, 1000), "{count:?}");
}

/// Functions of independent arguments are judged in prime fields. With true values the verdicts must be the
/// same.
#[test]
fn random_function_models_in_both_engines() {
    let count = random_models(true, 0..60);
    assert!(count.agree > 40 && count.apart > 20, "{count:?}");
}

/// `cargo test --release --test it -- --ignored a_thousand_random_function_models`
#[test]
#[ignore = "minutes"]
fn a_thousand_random_function_models_in_both_engines() {
    let count = random_models(true, 1000..2000);
    assert_eq!((count.agree, count.refused, count.apart), (986, 14, 386), "{count:?}");
}

/// Judges the reference models of at most `largest` states and parameters.
fn references(largest: usize) -> Count {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/models");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("models").map(|e| e.expect("an entry").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "json"));
    files.sort();
    let mut count = Count::default();
    for file in files {
        let text = std::fs::read_to_string(&file).expect("readable");
        let model = json::read(&text).expect("a model");
        if model.states.len() + model.parameters.len() <= largest {
            hold(&model, &file.display().to_string(), None, &mut count);
        }
    }
    count
}

#[test]
fn small_reference_models_in_both_engines() {
    let count = references(8);
    assert!(count.undecided == 0 && count.refused == 0 && count.agree > 40, "{count:?}");
}

/// `cargo test --release --test it -- --ignored all_reference_models_in_both_engines`
#[test]
#[ignore = "minutes"]
fn all_reference_models_in_both_engines() {
    let count = references(usize::MAX);
    assert_eq!((count.agree, count.undecided), (141, 0), "{count:?}");
}

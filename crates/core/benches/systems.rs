//! Any system: verdicts on the reference models, and how they scale. One core.

use std::path::PathBuf;
use std::time::Instant;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use obsdeg_core::system::{
    SystemModel, SystemOptions, WorkLimit, analyze_system, json, judge, judge_in_digits, model_file,
};

fn main() {
    divan::main();
    growth();
}

/// Prints the growth of a chain's time: the exponent of the size between each size and its double, best of
/// three runs. It runs only when all benches run, without a filter or a test.
#[allow(clippy::print_stdout, reason = "what a bench is for")]
fn growth() {
    if !std::env::args().skip(1).eq(["--bench"]) {
        return;
    }
    for (name, functions, sizes) in
        [("chain_of", false, [16, 32, 64, 128, 256]), ("chain_of_functions", true, [8, 16, 32, 64, 128])]
    {
        let seconds = |n: usize| {
            let model = chain(n, functions);
            let run = |_| {
                let start = Instant::now();
                rank_of(&model);
                start.elapsed().as_secs_f64()
            };
            (0..3).map(run).fold(f64::INFINITY, f64::min)
        };
        let times = sizes.map(seconds);
        println!("{name}: growth");
        for (pair, n) in times.windows(2).zip(&sizes) {
            let exponent = (pair[1] / pair[0]).log2();
            println!("  {} to {} unknowns: {:.4} s, n^{exponent:.2}", 2 * n, 4 * n, pair[1]);
        }
    }
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/models")
}

/// The reference models.
fn references() -> Vec<String> {
    let entries = std::fs::read_dir(folder()).expect("the reference models");
    let mut files: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "json"));
    files.sort();
    files.iter().map(|f| std::fs::read_to_string(f).expect("readable")).collect()
}

/// Reads, compiles and judges all 141 reference models in two fields.
#[divan::bench]
fn all_references(bencher: Bencher<'_, '_>) {
    let texts = references();
    bencher.counter(ItemsCount::new(texts.len())).bench(|| {
        for text in &texts {
            let judged = json::read(text).and_then(|m| judge(&m, 1, None));
            black_box(judged.expect("judged").findings.degrees.rank());
        }
    });
}

/// Judges all 141 models and counts their solutions, with the default work limit and without solving
/// expressions.
#[divan::bench(sample_count = 1, sample_size = 1)]
fn all_references_counted() {
    for text in references() {
        let model = json::read(&text).expect("a model");
        black_box(analyze_system(&model, SystemOptions::default()).expect("judged").counting_order);
    }
}

/// Judges one of the largest models: MAPK (34 unknowns) or the rail vehicle (89 unknowns).
#[divan::bench(args = [
    "mapk_5out",
    "mapk_6out",
    "rail_vehicle_27dof_jothi2016",
    "jak_stat_bachmann",
    "ovarian_follicle",
    "tumor_hu2019",
])]
fn one_reference(bencher: Bencher<'_, '_>, name: &str) {
    let text = std::fs::read_to_string(folder().join(format!("{name}.json"))).expect("readable");
    let model = json::read(&text).expect("a model");
    bencher.bench(|| judge(black_box(&model), 1, None).expect("judged").findings.degrees.rank());
}

/// A chain of n states with n rates, x_i' = a_i (x_(i-1) - x_i) x_i. The last state is observed: full rank
/// needs order 2n-1. `functions` replaces the last factor by sin(x_i); `related` replaces the other one by
/// sin(x_(i-1) - x_i).
fn chain_of_links(n: usize, functions: bool, related: bool) -> SystemModel {
    let states: Vec<String> = (0..n).map(|i| format!("\"x{i}\"")).collect();
    let rates: Vec<String> = (0..n).map(|i| format!("\"a{i}\"")).collect();
    let factor = |i: usize| if functions { format!("sin(x{i})") } else { format!("x{i}") };
    let equation = |i: usize| match i {
        0 => format!("\"x0\": \"-a0*x0*{}\"", factor(0)),
        _ => format!(
            "\"x{i}\": \"a{i}*{}(x{} - x{i})*{}\"",
            if related { "sin" } else { "" },
            i - 1,
            factor(i)
        ),
    };
    let equations: Vec<String> = (0..n).map(equation).collect();
    let text = format!(
        "{{\"name\": \"chain\", \"states\": [{}], \"params\": [{}], \"equations\": {{{}}}, \"outputs\": \
         {{\"y\": \"x{}\"}}}}",
        states.join(","),
        rates.join(","),
        equations.join(","),
        n - 1
    );
    let mut model = json::read(&text).expect("a model");
    // The longest chains exceed the default work limit.
    model.work_limit = WorkLimit(1_000_000);
    model
}

fn chain(n: usize, functions: bool) -> SystemModel {
    chain_of_links(n, functions, false)
}

/// Rank of the model, which is full.
fn rank_of(model: &SystemModel) -> usize {
    let rank = judge(black_box(model), 1, None).expect("judged").findings.degrees.rank();
    assert_eq!(rank, model.states.len() + model.parameters.len());
    rank
}

/// Chains of 2n unknowns: the order grows with the number of unknowns.
#[divan::bench(args = [4, 8, 16, 32, 64], max_time = 3)]
fn chain_of(bencher: Bencher<'_, '_>, n: usize) {
    let model = chain(n, false);
    bencher.bench(|| rank_of(&model));
}

/// Chains of 250 and 500 unknowns, whose rows are computed backwards.
#[divan::bench(args = [125, 250], sample_count = 1, sample_size = 1)]
fn long_chain_of(bencher: Bencher<'_, '_>, n: usize) {
    let model = chain(n, false);
    bencher.bench(|| rank_of(&model));
}

/// Chains with a sine in every link: functions of independent arguments.
#[divan::bench(args = [4, 8, 16, 32, 64], max_time = 3)]
fn chain_of_functions(bencher: Bencher<'_, '_>, n: usize) {
    let model = chain(n, true);
    bencher.bench(|| rank_of(&model));
}

/// Chains with sines of differences of states, which the addition theorems take apart.
#[divan::bench(args = [4, 8, 16, 32], max_time = 3)]
fn chain_of_related_functions(bencher: Bencher<'_, '_>, n: usize) {
    let model = chain_of_links(n, true, true);
    bencher.bench(|| rank_of(&model));
}

/// Chains with a sine in every link, evaluated in real numbers.
#[divan::bench(args = [4, 8, 16], max_time = 3)]
fn chain_of_functions_in_digits(bencher: Bencher<'_, '_>, n: usize) {
    let model = chain(n, true);
    let compiled = model.compile().expect("a graph");
    bencher.bench(|| judge_in_digits(&model, &compiled, 1, None).expect("judged").findings.degrees.rank());
}

/// One unknown of a given degree: y = p x^k with x' = 1, x(0) = 0.
#[divan::bench(args = [8, 16, 32])]
fn of_degree(bencher: Bencher<'_, '_>, degree: usize) {
    let text = format!(
        "name='m'\nparameters=['p']\n[states]\nx={{equation='1', initial=0}}\n[outputs]\ny='p*x^{degree}'"
    );
    let model = model_file::read(&text).expect("a model");
    bencher.bench(|| {
        let found = judge(black_box(&model), 1, None).expect("judged").findings.degrees.degree;
        assert_eq!(found, [Some(degree)]);
    });
}

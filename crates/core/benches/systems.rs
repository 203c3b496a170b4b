//! Any system: verdicts on the reference models, and how they scale. One core.

use std::path::PathBuf;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use obsdeg_core::system::{SystemModel, SystemOptions, analyze_system, json, judge};

fn main() {
    divan::main();
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

/// All 141, read, compiled and judged in two fields.
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

/// All 141 with the numbers of solutions, by the default limit of work, without solving expressions.
#[divan::bench(sample_count = 1, sample_size = 1)]
fn all_references_counted() {
    for text in references() {
        let model = json::read(&text).expect("a model");
        black_box(analyze_system(&model, SystemOptions::default(), None).expect("judged").counting_order);
    }
}

/// MAPK (34 unknowns), the rail vehicle (89 unknowns), the largest others.
#[divan::bench(args = ["mapk_5out", "mapk_6out", "rail_vehicle_27dof_jothi2016", "jak_stat_bachmann", "ovarian_follicle", "tumor_hu2019"])]
fn one_reference(bencher: Bencher<'_, '_>, name: &str) {
    let text = std::fs::read_to_string(folder().join(format!("{name}.json"))).expect("readable");
    let model = json::read(&text).expect("a model");
    bencher.bench(|| judge(black_box(&model), 1, None).expect("judged").findings.degrees.rank());
}

/// A chain of n states with n rates, x_i' = a_i (x_(i-1) - x_i) x_i, of which the last is observed: full rank needs
/// order 2n-1.
fn chain(n: usize) -> SystemModel {
    let states: Vec<String> = (0..n).map(|i| format!("\"x{i}\"")).collect();
    let rates: Vec<String> = (0..n).map(|i| format!("\"a{i}\"")).collect();
    let equation = |i: usize| match i {
        0 => "\"x0\": \"-a0*x0^2\"".to_string(),
        _ => format!("\"x{i}\": \"a{i}*(x{} - x{i})*x{i}\"", i - 1),
    };
    let equations: Vec<String> = (0..n).map(equation).collect();
    let text = format!(
        "{{\"name\": \"chain\", \"states\": [{}], \"params\": [{}], \"equations\": {{{}}}, \"outputs\": {{\"y\": \"x{}\"}}}}",
        states.join(","),
        rates.join(","),
        equations.join(","),
        n - 1
    );
    json::read(&text).expect("a model")
}

/// Unknowns and order grow together.
#[divan::bench(args = [4, 8, 16, 32])]
fn chain_of(bencher: Bencher<'_, '_>, n: usize) {
    let model = chain(n);
    bencher.bench(|| judge(black_box(&model), 1, None).expect("judged").findings.degrees.rank());
}

/// Eight states and rates, observed to a given order whatever the rank.
#[divan::bench(args = [8, 16, 32, 64])]
fn to_order(bencher: Bencher<'_, '_>, order: usize) {
    let mut model = chain(8);
    // a start that is known keeps the first stagnation from being the end
    model.states[0].start = obsdeg_core::system::StateStart::Known;
    model.outputs[0].1 = model.states[0].equation.clone();
    bencher.bench(|| judge(black_box(&model), 1, Some(order)).expect("judged").findings.degrees.rank());
}

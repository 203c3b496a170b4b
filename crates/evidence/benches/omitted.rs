//! Time that the effects of errors outside the model take beyond that of the sigmas: 33 coefficients at seven
//! positions with slews, and the 12 coefficients at the paper's two positions.

use divan::{Bencher, black_box};
use obsdeg_core::model::{Scheme, scheme_file};
use obsdeg_evidence::simulation::omitted::omitted_effects;
use obsdeg_evidence::simulation::{Attained, Conditions};

const SCHEMES: [&str; 2] = ["paper-p1-p2", "self-calibration"];

fn main() {
    divan::main();
}

fn scheme(name: &str) -> (Scheme, Conditions) {
    let path = format!("{}/../../examples/{name}/scheme.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("an example");
    let scheme = scheme_file::read(&text).expect("a scheme");
    let conditions = Conditions { bench: Vec::new(), ..Conditions::of(&scheme) };
    (scheme, conditions)
}

/// Sigmas of all unknowns at the end.
#[divan::bench(args = SCHEMES)]
fn sigmas(bencher: Bencher<'_, '_>, name: &str) {
    let (scheme, conditions) = scheme(name);
    bencher.bench(|| Attained::new(black_box(&scheme), &conditions, 1).expect("sigmas").sigmas.len());
}

/// Table of all errors that are not estimated: classes, changes per unit and visible sizes.
#[divan::bench(args = SCHEMES)]
fn table(bencher: Bencher<'_, '_>, name: &str) {
    let (scheme, conditions) = scheme(name);
    let attained = Attained::new(&scheme, &conditions, 1).expect("sigmas");
    bencher.bench(|| omitted_effects(black_box(&attained), &conditions, 1).expect("effects").terms.len());
}

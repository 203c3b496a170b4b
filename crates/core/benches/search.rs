//! What a search repeats: exact verdicts of candidate sets, information of candidate sequences.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use obsdeg_core::design::information::{Criterion, Evaluator};
use obsdeg_core::design::observability::Rows;
use obsdeg_core::design::{Options, design};
use obsdeg_core::model::attitude::{Euler, cardinal, cardinal_names};
use obsdeg_core::model::{Carry, Scheme};
use obsdeg_core::simulation::conditions::Conditions;

fn main() {
    divan::main();
}

fn cardinals() -> (Vec<String>, Vec<Euler>) {
    let names = cardinal_names();
    let attitudes = names.iter().map(|n| cardinal(n).expect("an attitude")).collect();
    (names, attitudes)
}

fn base(carry: Carry) -> Scheme {
    Scheme { carry, latitude: "28.2".parse().ok(), ..Scheme::default() }
}

/// All sets of six of 24 judged exactly, on all cores; items are sets.
#[divan::bench(args = [Carry::Platform, Carry::Inertial, Carry::Reset])]
fn sets_of_six(bencher: Bencher<'_, '_>, carry: &Carry) {
    let rows = Rows::new(&base(*carry), &cardinals().1, 1).expect("rows");
    bencher.counter(ItemsCount::new(134_596usize)).bench(|| black_box(rows.observable_sets(6).len()));
}

/// The information of a sequence of five and its worst sigma, from nothing, on one core.
#[divan::bench]
fn sigma_of_five(bencher: Bencher<'_, '_>) {
    let candidates = cardinals().1;
    let evaluator = Evaluator::new(&base(Carry::Inertial), &candidates, &Conditions::default(), 1000.0)
        .expect("an evaluator");
    bencher
        .counter(ItemsCount::new(1usize))
        .bench(|| evaluator.of_sequence(black_box(&[1, 8, 22, 5, 10]), &Criterion::Worst));
}

/// The best five of 24 in all orders, proven, on all cores; items are sequences.
#[divan::bench(sample_count = 3)]
fn best_five_of_24(bencher: Bencher<'_, '_>) {
    let (names, candidates) = cardinals();
    let options = Options {
        names,
        candidates,
        positions: Some(5),
        dwell_s: 1000.0,
        criterion: Criterion::Worst,
        keep: 10,
        restarts: 1,
        seed: 1,
    };
    bencher.counter(ItemsCount::new(2_897_280usize)).bench(|| {
        design(&base(Carry::Inertial), &Conditions::default(), &options, &|_, _, _| true).expect("designed")
    });
}

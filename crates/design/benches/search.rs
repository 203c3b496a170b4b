//! Benchmarks of a search: exact verdicts of candidate sets, information of candidate sequences,
//! bounds.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use obsdeg_core::model::{Carry, Scheme};
use obsdeg_core::system::{OutputRows, gather, json};
use obsdeg_design::design::{
    AttitudeRows, Best, Candidates, Constraints, Criterion, CriterionName, Design, DesignOptions, Evaluator,
    SequenceSearch, design,
};
use obsdeg_design::sensors::{Ordered, Ranks, Set};
use obsdeg_evidence::simulation::Conditions;
use rayon::prelude::*;

fn main() {
    divan::main();
}

const ALL: [usize; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

fn base(carry: Carry) -> Scheme {
    Scheme { carry, latitude: "28.2".parse().ok(), ..Scheme::default() }
}

/// Exact verdicts of all sets of six of the 24 cardinal attitudes, on all cores; items are sets.
#[divan::bench(args = [Carry::Platform, Carry::Inertial, Carry::Reset])]
fn sets_of_six(bencher: Bencher<'_, '_>, carry: &Carry) {
    let rows = AttitudeRows::new(&base(*carry), &Candidates::cardinals().attitudes, &ALL, 1).expect("rows");
    bencher.counter(ItemsCount::new(134_596usize)).bench(|| black_box(rows.observable_sets(6).len()));
}

/// Certificate for twelve of the 24 cardinal attitudes under reset carry: optimal weights and their
/// bound.
#[divan::bench(args = ["D", "worst", "E"])]
fn certificate_of_twelve(bencher: Bencher<'_, '_>, criterion: &str) {
    let candidates = Candidates::cardinals();
    let evaluator = reset(&candidates);
    let criterion = match criterion {
        "D" => Criterion::D,
        "E" => Criterion::E,
        _ => Criterion::Worst,
    };
    bencher.bench(|| evaluator.bound(black_box(&criterion), 12, &[], &|| true).expect("a bound"));
}

/// Certificate for twelve positions over all attitudes, from a grid of 45 degrees, on all cores.
#[divan::bench(sample_count = 5)]
fn certificate_over_all_attitudes(bencher: Bencher<'_, '_>) {
    let evaluator = reset(&Candidates::grid(45_000_000_000).expect("a grid"));
    bencher.bench(|| evaluator.everywhere(black_box(&Criterion::D), 12, &|| true).expect("a bound"));
}

/// A scheme of twelve cardinal attitudes and its certificate, without a front, on all cores.
#[divan::bench(sample_count = 5)]
fn twelve_certified(bencher: Bencher<'_, '_>) {
    let candidates = Candidates::cardinals();
    let base = base(Carry::Reset);
    bencher.bench(|| {
        let rows = AttitudeRows::new(&base, &candidates.attitudes, &ALL, 1).expect("rows");
        let evaluator = reset(&candidates);
        let search = SequenceSearch {
            rows: &rows,
            slew_sequences: false,
            evaluator: &evaluator,
            criterion: &Criterion::D,
            constraints: &Constraints::default(),
            keep: 1,
            floor: 2,
            progress: &|_| true,
        };
        let found = search.exchange(12, &[], 200, 1);
        let bound = evaluator.bound(&Criterion::D, 12, &[], &|| true).expect("a bound");
        let efficiency = (bound.value / found.found[0].score.value).powi(2);
        assert!(efficiency > 0.9999, "{efficiency}");
        efficiency
    });
}

/// `design` of twelve of the 24 cardinal attitudes with all its parts: the front, its bound, and the
/// bound over all attitudes.
#[divan::bench(sample_count = 3, args = ["D", "worst"])]
fn the_command_for_twelve_of_24(criterion: &str) -> Design {
    let criterion = if criterion == "D" { CriterionName::D } else { CriterionName::Worst };
    let options =
        DesignOptions { positions: Some(12), criterion, everywhere: true, ..DesignOptions::default() };
    design(&base(Carry::Reset), &Conditions::default(), &options, &|_| true).expect("designed")
}

fn reset(candidates: &Candidates) -> Evaluator {
    let evaluator = Evaluator::new(&base(Carry::Reset), &candidates.attitudes, &ALL, &Conditions::default());
    evaluator.expect("an evaluator")
}

/// Worst sigma of a sequence of five where the noise of Z is correlated, on one core.
#[divan::bench]
fn sigma_of_five_correlated(bencher: Bencher<'_, '_>) {
    let conditions = Conditions { accelerometer_instability_ug: 3.0, ..Conditions::default() };
    let candidates = Candidates::cardinals().attitudes;
    let evaluator =
        Evaluator::new(&base(Carry::Inertial), &candidates, &ALL, &conditions).expect("an evaluator");
    bencher
        .counter(ItemsCount::new(1usize))
        .bench(|| evaluator.of_sequence(black_box(&[1, 8, 22, 5, 10]), &Criterion::Worst));
}

/// Information and worst sigma of a sequence of five, from no positions, on one core.
#[divan::bench]
fn sigma_of_five(bencher: Bencher<'_, '_>) {
    let candidates = Candidates::cardinals().attitudes;
    let evaluator = Evaluator::new(&base(Carry::Inertial), &candidates, &ALL, &Conditions::default())
        .expect("an evaluator");
    bencher
        .counter(ItemsCount::new(1usize))
        .bench(|| evaluator.of_sequence(black_box(&[1, 8, 22, 5, 10]), &Criterion::Worst));
}

/// Best five of the 24 cardinal attitudes in all orders, proven, without the front, on all cores; items
/// are the sequences covered.
#[divan::bench(sample_count = 10)]
fn best_five_of_24(bencher: Bencher<'_, '_>) {
    let base = base(Carry::Inertial);
    let candidates = Candidates::cardinals().attitudes;
    let rows = AttitudeRows::new(&base, &candidates, &ALL, 1).expect("rows");
    let evaluator = Evaluator::new(&base, &candidates, &ALL, &Conditions::default()).expect("an evaluator");
    let search = SequenceSearch {
        rows: &rows,
        slew_sequences: false,
        evaluator: &evaluator,
        criterion: &Criterion::Worst,
        constraints: &Constraints::default(),
        keep: 10,
        floor: 2,
        progress: &|_| true,
    };
    let symmetry = rows.symmetry(&|_, _| true);
    bencher.counter(ItemsCount::new(2_897_280usize)).bench(|| search.exhaust(&symmetry, 5));
}

/// Best five of 24 in all orders by branch and bound, with an incumbent by exchange; items are the
/// sequences covered.
#[divan::bench(sample_count = 10, args = [Carry::Platform, Carry::Inertial])]
fn best_five_of_24_pruned(bencher: Bencher<'_, '_>, carry: &Carry) {
    bencher.counter(ItemsCount::new(331_776usize)).bench(|| pruned(*carry, 5));
}

/// Best six of 24 in all orders by branch and bound; items are the sequences covered.
#[divan::bench(sample_count = 3, args = [Carry::Platform, Carry::Inertial])]
fn best_six_of_24_pruned(bencher: Bencher<'_, '_>, carry: &Carry) {
    bencher.counter(ItemsCount::new(7_962_624usize)).bench(|| pruned(*carry, 6));
}

fn pruned(carry: Carry, k: usize) -> Best {
    let base = base(carry);
    let candidates = Candidates::cardinals().attitudes;
    let rows = AttitudeRows::new(&base, &candidates, &ALL, 1).expect("rows");
    let evaluator = Evaluator::new(&base, &candidates, &ALL, &Conditions::default()).expect("an evaluator");
    let search = SequenceSearch {
        rows: &rows,
        evaluator: &evaluator,
        criterion: &Criterion::Worst,
        constraints: &Constraints::default(),
        keep: 10,
        floor: 2,
        slew_sequences: false,
        progress: &|_| true,
    };
    search.exhaust_pruned(&rows.symmetry(&|_, _| true), k, 1)
}

/// `design` of five of 24 with the front, as the command runs it.
#[divan::bench(sample_count = 3)]
fn the_command_for_five_of_24() -> Design {
    let options = DesignOptions { positions: Some(5), ..DesignOptions::default() };
    design(&base(Carry::Inertial), &Conditions::default(), &options, &|_| true).expect("designed")
}

/// `design` of five of 24 by total uncertainty, with a bench of two errors.
#[divan::bench(sample_count = 3)]
fn the_command_for_five_of_24_with_a_bench() -> Design {
    let options = DesignOptions { positions: Some(5), ..DesignOptions::default() };
    let bench = ["K0=20", "latitude=10"].map(|text| text.parse().expect("a size")).to_vec();
    let conditions = Conditions { bench, ..Conditions::default() };
    design(&base(Carry::Inertial), &conditions, &options, &|_| true).expect("designed")
}

/// Degrees of the 34 unknowns of the MAPK cascade under all 4,096 sets of its states, on all cores; items are
/// sets.
#[divan::bench]
fn sets_of_states(bencher: Bencher<'_, '_>) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/models/mapk_6out.json");
    let model = json::read(&std::fs::read_to_string(file).expect("a file")).expect("a model");
    let states = model.candidates_of("states").expect("states");
    let (whole, _) = model.measuring(&states, false);
    let gathered = gather(&whole, 1, None, 0).expect("rows");
    let OutputRows::Primes(points) = &gathered.rows else { return };
    let columns: Vec<usize> = (0..points[0].columns).collect();
    let owners: Vec<Set> = (0..states.len()).map(|c| 1 << c).collect();
    let ranks = Ordered::new(&points[0], &owners, &columns, true);
    let sets: Vec<Set> = (0..1 << states.len()).collect();
    bencher.counter(ItemsCount::new(sets.len())).bench(|| {
        let degrees = |set: &Set| ranks.degrees(*set).iter().map(|d| usize::from(*d)).max();
        black_box(sets.par_iter().map(degrees).max())
    });
}

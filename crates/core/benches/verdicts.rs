//! Exact six-position verdicts per second on one core.
//!
//! `cargo bench -p obsdeg-core` prints times per verdict; the counter column is verdicts per second.
//! A verdict is the full answer (rank profile, degrees of all 15 unknowns, excited unknowns) from the
//! cosines and sines of the attitudes, in one field. The certified verdict runs in two fields.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use obsdeg_core::analysis::{AnalysisOptions, analyze};
use obsdeg_core::degree::{PlatformRows, climb};
use obsdeg_core::model::{Carry, FieldSample, Path, Platform, RandomValues, Scheme, parse_attitude};
use obsdeg_exact::{Echelon, SplitMix64};

fn main() {
    divan::main();
}

const S6: [&str; 6] = ["10,25,40", "130,-50,70", "-95,33,-160", "60,80,15", "-20,-70,110", "170,15,-75"];

fn platform(carry: Carry) -> Platform {
    of_terms(carry, "F,I,O,S")
}

fn of_terms(carry: Carry, terms: &str) -> Platform {
    let angles = S6.iter().filter_map(|a| parse_attitude(a).ok());
    let unknowns = terms.parse().expect("terms");
    match Platform::new(Scheme { carry, unknowns, ..Scheme::of_angles(angles) }) {
        Ok(platform) => platform,
        Err(e) => panic!("{e}"),
    }
}

fn samples(platform: &Platform) -> Vec<FieldSample> {
    let mut rng = SplitMix64::new(1);
    (0..2)
        .filter_map(|_| RandomValues::draw(platform.scheme(), &mut rng).ok())
        .map(|v| v.sample(platform.scheme(), 1))
        .collect()
}

const CARRIES: [Carry; 3] = Carry::ALL;

/// Verdicts in one field.
#[divan::bench(args = CARRIES)]
fn six_positions_one_field(bencher: Bencher<'_, '_>, carry: Carry) {
    let platform = platform(carry);
    let sample = &samples(&platform)[0];
    let mut basis = Echelon::new(sample.point.ring, platform.names().len());
    bencher.counter(ItemsCount::new(1usize)).bench_local(|| {
        climb(&mut PlatformRows::new(black_box(&platform), black_box(sample)), &mut basis, |_, _| {})
    });
}

/// Verdicts in two fields that agree, as `analyze` prints them.
#[divan::bench(args = CARRIES)]
fn six_positions_two_fields(bencher: Bencher<'_, '_>, carry: Carry) {
    let platform = platform(carry);
    let samples = samples(&platform);
    let mut bases: Vec<Echelon> =
        samples.iter().map(|s| Echelon::new(s.point.ring, platform.names().len())).collect();
    bencher.counter(ItemsCount::new(1usize)).bench_local(|| {
        let mut verdicts = samples.iter().zip(&mut bases).map(|(sample, basis)| {
            climb(&mut PlatformRows::new(black_box(&platform), black_box(sample)), basis, |_, _| {})
        });
        verdicts.next() == verdicts.next()
    });
}

fn prepared(bencher: Bencher<'_, '_>, platform: &Platform) {
    let sample = &samples(platform)[0];
    let mut rows = PlatformRows::new(platform, sample);
    let mut basis = Echelon::new(sample.point.ring, platform.names().len());
    bencher
        .counter(ItemsCount::new(1usize))
        .bench_local(|| climb(black_box(&mut rows), &mut basis, |_, _| {}));
}

/// Verdicts in one field from prepared rows of each attitude, as a search over schemes of known attitudes
/// repeats them.
#[divan::bench(args = CARRIES)]
fn six_positions_prepared(bencher: Bencher<'_, '_>, carry: Carry) {
    prepared(bencher, &platform(carry));
}

/// Verdicts on drifts and accelerometer errors: 21 coefficients, Z of three components.
#[divan::bench(args = CARRIES)]
fn six_positions_of_21_unknowns(bencher: Bencher<'_, '_>, carry: Carry) {
    prepared(bencher, &of_terms(carry, "F,I,O,S,K0,K1,M3"));
}

/// Verdicts on drifts, torquers, accelerometers and mounting: 33 coefficients, seven positions with slews,
/// as `analyze` gives them without solutions.
#[divan::bench]
fn self_calibration(bencher: Bencher<'_, '_>) {
    let attitudes = ["DNE", "SDE", "USE", "WSU", "WUN", "SUW", "SWD"];
    let scheme = Scheme {
        carry: Carry::Inertial,
        unknowns: "all".parse().expect("terms"),
        path: Some(Path::OneAxis),
        ..Scheme::of_angles(attitudes.iter().filter_map(|a| parse_attitude(a).ok()))
    };
    let options = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
    bencher.bench_local(|| analyze(black_box(&scheme), options, None).map(|a| a.rank));
}

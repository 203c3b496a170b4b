//! False alarms: records of benches that are as the scheme has them are called inconsistent in at most one
//! case of a hundred, all tests of an answer together.

use std::collections::BTreeMap;

use obsdeg_calibration::answer::CalibrationFinding;
use obsdeg_calibration::record::Record;
use obsdeg_calibration::{Calibration, Options, calibrate, levels};
use obsdeg_core::model::settings::Assignment;
use obsdeg_ekf::consistency::chi_square_band;

use crate::faults::before;
use crate::omitted;
use crate::round_trip::{conditions, real, scheme, six, whole};
use crate::simulator::{AtOnce, Bench, Random, Sample, csv};

/// Kind of right records.
#[derive(Debug, Clone, Copy)]
enum Kind {
    /// Six positions, slews under inertial carry.
    Six,
    /// Six positions under platform carry, repositioned at once.
    Platform,
    /// Four positions under reset carry.
    Reset,
    /// The paper's two positions at a tenth of its drifts.
    Two,
    /// Quantised outputs, lost samples, random drift.
    Real,
    /// 33 coefficients.
    Whole,
    /// Z1 and Z3 at five cardinal attitudes.
    Cardinal,
    /// Two records of one platform.
    Twice,
    /// A record with the calibration by another as its prior.
    Known,
    /// A temperature that wanders.
    Warm,
}

const KINDS: [Kind; 10] = [
    Kind::Six,
    Kind::Platform,
    Kind::Reset,
    Kind::Two,
    Kind::Real,
    Kind::Whole,
    Kind::Cardinal,
    Kind::Twice,
    Kind::Known,
    Kind::Warm,
];

/// A platform drawn at random: drifts of 3 deg/h and 1 deg/h/g, psi of 0.1 deg (1 sigma).
fn drawn(seed: u64, bench: Bench) -> Bench {
    let mut random = Random::new(7_000_003 * (seed + 1));
    let mut three = |sigma: f64| -> [f64; 3] { std::array::from_fn(|_| sigma * random.normal()) };
    let drift = [three(3.0), three(1.0), three(1.0), three(1.0)];
    let psi = three(0.1f64.to_radians());
    let carry = match bench.carry {
        AtOnce::Reset(_) => {
            AtOnce::Reset((1..bench.positions.len()).map(|_| three(0.1f64.to_radians())).collect())
        }
        other => other,
    };
    Bench { seed: seed + 4_000, drift, psi, carry, ..bench }
}

fn read(name: &str, text: String) -> Record {
    Record::csv(name, Box::new(std::io::Cursor::new(text))).expect("a record")
}

/// Calibration of records of a bench, one for each seed.
fn of_records(bench: &Bench, terms: &str, seeds: &[u64]) -> Calibration {
    let name = |seed: u64| format!("run{seed}.csv");
    let record = |&seed: &u64| read(&name(seed), csv(&Bench { seed, ..bench.clone() }.record()));
    let records = seeds.iter().map(record).collect();
    calibrate(&scheme(bench, terms), &conditions(bench), records, &Options::default(), &|_| true)
        .expect("calibrated")
}

/// A record with a temperature (degC), a random walk of 0.05 degC per row.
fn warm(bench: &Bench) -> Calibration {
    let mut random = Random::new(bench.seed);
    let mut temperature = 25.0;
    let mut line = |s: &Sample| {
        temperature += 0.05 * random.normal();
        format!("{},{},{},{},{},{temperature}\n", s.t, s.label, s.f[0], s.f[1], s.f[2])
    };
    let mut text = String::from("t [s],position,fx [g],fy [g],fz [g],T [degC]\n");
    bench.record().iter().for_each(|s| text.push_str(&line(s)));
    let (of, record) = (scheme(bench, "F,I,O,S"), read("warm.csv", text));
    let c = calibrate(&of, &conditions(bench), vec![record], &Options::default(), &|_| true);
    let c = c.expect("calibrated");
    assert!(c.channels.iter().all(|c| c.temperature.is_some()), "{:?}", c.channels);
    c
}

fn known(bench: &Bench) -> Calibration {
    let first = of_records(bench, "F,I,O,S", &[bench.seed + 50_000]);
    let options = Options { prior: Some(before(&first)), ..Options::default() };
    let record = read("again.csv", csv(&bench.record()));
    calibrate(&scheme(bench, "F,I,O,S"), &conditions(bench), vec![record], &options, &|_| true)
        .expect("calibrated")
}

fn calibrated(kind: Kind, seed: u64) -> Calibration {
    let slews = || drawn(seed, Bench { slew_deg_s: Some(2.0), ..six() });
    let one = |bench: Bench| of_records(&bench, "F,I,O,S", &[bench.seed]);
    match kind {
        Kind::Six => one(slews()),
        Kind::Platform => one(drawn(seed, Bench { carry: AtOnce::Platform, ..six() })),
        Kind::Reset => {
            let mut bench = Bench { carry: AtOnce::Reset(Vec::new()), ..six() };
            bench.positions.truncate(4);
            one(drawn(seed, bench))
        }
        Kind::Two => one(drawn(seed, Bench::default())),
        Kind::Real => one(drawn(seed, real(seed))),
        Kind::Whole => {
            let bench = drawn(seed, whole(seed));
            of_records(&bench, "all", &[bench.seed])
        }
        Kind::Cardinal => omitted::calibrated(&omitted::five(0.0, seed + 4_000)),
        Kind::Twice => of_records(&slews(), "F,I,O,S", &[seed + 4_000, seed + 90_000]),
        Kind::Known => known(&slews()),
        Kind::Warm => warm(&slews()),
    }
}

/// Name of a finding without its figures.
fn name(finding: &CalibrationFinding) -> String {
    format!("{finding:?}").chars().take_while(|c| c.is_alphanumeric()).collect()
}

/// Number of records with a finding, of each kind so many; each finding is printed.
fn alarms(kinds: &[Kind], seeds: std::ops::Range<u64>) -> u64 {
    let (mut count, mut findings) = (0, BTreeMap::<String, u64>::new());
    let of_kind = seeds.end - seeds.start;
    for &kind in kinds {
        let mut own = 0;
        for seed in seeds.clone() {
            let c = calibrated(kind, seed);
            own += u64::from(!c.consistent);
            for finding in &c.findings {
                *findings.entry(name(finding)).or_default() += 1;
                println!("{kind:?} {seed}: {finding:?}");
            }
        }
        println!("{kind:?}: {own} of {of_kind} records have a finding");
        count += own;
    }
    println!("{count} of {} records have a finding: {findings:?}", of_kind * kinds.len() as u64);
    count
}

/// Largest number of false alarms of `records` that is no evidence (one in a thousand, normal bound) against
/// the stated probability.
pub(crate) fn most(records: u64) -> u64 {
    let expected = levels::FAMILY * records as f64;
    (expected + 3.1 * (expected * (1.0 - levels::FAMILY)).sqrt()).ceil() as u64
}

#[test]
fn right_records_raise_no_alarm() {
    assert!(alarms(&KINDS, 0..1) <= most(10));
}

/// All kinds, or as the environment says: `KIND=Two FROM=77 RECORDS=1`.
#[test]
#[ignore = "minutes"]
fn a_thousand_right_records_raise_few_alarms() {
    let only = std::env::var("KIND").unwrap_or_default();
    let number = |name: &str| std::env::var(name).ok().and_then(|n| n.parse::<u64>().ok());
    let (from, records) = (number("FROM").unwrap_or(0), number("RECORDS").unwrap_or(100));
    let kinds: Vec<Kind> = KINDS.into_iter().filter(|k| format!("{k:?}").contains(&only)).collect();
    assert!(alarms(&kinds, from..from + records) <= most(records * kinds.len() as u64));
}

/// With stated priors, and with a calibration before, chi-square is its degrees of freedom on average: of few
/// measurements priors are a part that counts (30 priors beside 120 measurements). Correlations of residuals
/// are those of chance, though the estimate has one unknown for four measurements: of 12 probabilities at
/// most 5 are below 0.1, of 48 at most 12 (binomial, 99.9 %).
#[test]
fn priors_count_in_chi_square() {
    priors_count(6, 5);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn priors_count_in_chi_square_at_length() {
    priors_count(24, 12);
}

fn priors_count(records: u64, most: usize) {
    let state = |name: &str, value: f64| Assignment { name: name.into(), value };
    let (mut with_priors, mut with_known, mut correlated) = (Vec::new(), Vec::new(), 0);
    for seed in 0..records {
        let few = Bench { step_s: 100.0, ..six() };
        let bench = drawn(seed, Bench { carry: AtOnce::Reset(Vec::new()), ..few.clone() });
        let mut stated = conditions(&bench);
        stated.priors.extend(
            [("psi", 0.1), ("D_F", 3.0), ("D_I", 1.0), ("D_O", 1.0), ("D_S", 1.0)].map(|p| state(p.0, p.1)),
        );
        let record = read("run.csv", csv(&bench.record()));
        let c = calibrate(&scheme(&bench, "F,I,O,S"), &stated, vec![record], &Options::default(), &|_| true);
        let c = c.expect("calibrated");
        let probabilities = c.channels.iter().map(|c| c.whiteness_probability.expect("of sixty residuals"));
        correlated += probabilities.filter(|p| *p < 0.1).count();
        with_priors.push(c.fit);
        with_known.push(known(&drawn(seed, few)).fit);
    }
    assert!(correlated <= most, "{correlated}");
    for fits in [with_priors, with_known] {
        let chi: f64 = fits.iter().map(|f| f.chi_square).sum();
        let dof: f64 = fits.iter().map(|f| f.degrees_of_freedom).sum();
        let (low, high) = chi_square_band(dof, 1.0, 0.999);
        println!("chi-square {chi:.1} of {dof:.1}, band {low:.1} to {high:.1}");
        assert!((low..=high).contains(&chi), "{chi} of {dof}: {low} to {high}");
    }
}

/// The table of the book is that of the program.
#[test]
fn the_book_states_the_shares() {
    let book = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../book/src/calibration.md"))
        .expect("the book");
    for (test, share) in levels::OF_SCHEME.into_iter().chain(levels::OF_MODEL) {
        let percent = 100.0 * share;
        let own = |line: &&str| line.starts_with(&format!("| {test} |"));
        let line = book.lines().find(own).unwrap_or_else(|| panic!("no line of {test}"));
        assert!(line.contains(&format!(" {percent:.2} % ")), "{line}: {percent}");
    }
}

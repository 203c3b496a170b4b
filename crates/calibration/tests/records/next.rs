//! Further runs: the computed run meets its requirement when it is made; a prior counts once, however many
//! records there are.

use obsdeg_calibration::record::Record;
use obsdeg_calibration::{Calibration, Options, calibrate};
use obsdeg_core::model::parse_attitude;
use obsdeg_core::model::settings::Assignment;

use crate::faults::before;
use crate::round_trip::{conditions, errors, scheme, six, truth};
use crate::simulator::{Bench, csv};

fn bench(seed: u64) -> Bench {
    let drift = [[1.1, -0.7, 1.3], [0.5, 0.2, -0.4], [0.3; 3], [-0.5, 0.1, 0.2]];
    Bench { seed, drift, walk_deg_sqrt_h: 1e-4, ..six() }
}

/// First estimates of these unknowns: their true values.
fn truths(bench: &Bench, of: &[Assignment]) -> Vec<Assignment> {
    let value = |name: &str| truth(bench, name).expect("a coefficient");
    of.iter().map(|a| Assignment { name: a.name.clone(), value: value(&a.name) }).collect()
}

fn calibrated(
    bench: &Bench,
    stated: &[(&str, f64)],
    priors: bool,
    first: Option<&Calibration>,
) -> Calibration {
    let mut conditions = conditions(bench);
    let of = |(name, value): &(&str, f64)| Assignment { name: (*name).into(), value: *value };
    let stated: Vec<Assignment> = stated.iter().map(of).collect();
    if priors {
        conditions.estimates.extend(truths(bench, &stated));
        conditions.priors.extend(stated);
    } else {
        conditions.requirements.extend(stated);
    }
    let record =
        Record::csv("run.csv", Box::new(std::io::Cursor::new(csv(&bench.record())))).expect("a record");
    let options = Options { prior: first.map(before), ..Options::default() };
    calibrate(&scheme(bench, "F,I,O,S"), &conditions, vec![record], &options, &|_| true).expect("calibrated")
}

fn sigma(c: &Calibration, name: &str) -> f64 {
    let own = c.quantities.iter().find(|u| u.name == name).expect("there");
    own.sigma.expect("determined")
}

/// Required sigmas are a fraction of those of the record. Each run that would meet one is simulated by the
/// simulator of the tests, and calibrated with the first. Its sigma is the predicted one, but for the effects
/// of attitudes and of the fit's factor, and the estimates are right.
#[test]
fn a_run_as_it_is_said_meets_the_requirement() {
    let first = bench(41);
    let free = calibrated(&first, &[], false, None);
    assert!(free.next_runs.is_empty());
    let required: Vec<(&str, f64)> =
        [("D_FY", 0.6), ("D_IX", 0.8), ("D_SZ", 2.0)].map(|(n, part)| (n, part * sigma(&free, n))).to_vec();
    let c = calibrated(&first, &required, false, None);
    // the third requirement is met
    assert_eq!(c.next_runs.iter().map(|n| n.unknown.as_str()).collect::<Vec<_>>(), ["D_FY", "D_IX"]);
    for n in &c.next_runs {
        let (attitude, dwell, then) =
            (n.attitude.as_ref().expect("one"), n.dwell_s.expect("one"), n.sigma_then.expect("one"));
        assert!(n.met && then <= n.required_sigma && then > 0.95 * n.required_sigma, "{n:?}");
        let own = first.positions.iter().find(|p| p.0 == attitude).map(|p| p.1);
        let cardinal =
            || parse_attitude(attitude).expect("an attitude").map(|a| a.degrees().expect("degrees"));
        let angles = own.unwrap_or_else(cardinal);
        let second = Bench {
            positions: vec![("p1", angles, dwell)],
            psi: [0.05, -0.02, 0.07].map(f64::to_radians),
            seed: 42,
            ..first.clone()
        };
        let both = calibrated(&second, &[], false, Some(&c));
        let own = sigma(&both, &n.unknown);
        assert!((own / then - 1.0).abs() < 0.1, "{n:?}: {own}");
        let worst = errors(&second, &both).into_iter().map(|e| e.1.abs()).fold(0.0, f64::max);
        assert!(worst < 3.5, "{worst}");
    }
}

/// A requirement beyond any run is reported as such, with the figure of the longest run.
#[test]
fn what_no_run_meets_is_said() {
    let first = bench(43);
    let c = calibrated(&first, &[("D_FX", 1e-9)], false, None);
    let [n] = &c.next_runs[..] else { panic!("{:?}", c.next_runs) };
    assert!(!n.met && n.dwell_s == Some(16_000.0), "{n:?}");
    assert!(n.sigma_then.is_some_and(|s| s > 1e-9 && s < sigma(&c, "D_FX")), "{n:?}");
}

/// Priors stated by a scheme are in the first calibration. The second, with the first as prior, does not
/// count them again: it equals the calibration of both records at once.
#[test]
fn a_prior_counts_once() {
    let (first, second) = (bench(44), bench(45));
    let free = calibrated(&first, &[], false, None);
    // as wide as the sigmas, so that counting it twice shows: by sqrt(3/4) in one and sqrt(2/3) in two
    // records
    let prior = [("D_FY", sigma(&free, "D_FY")), ("D_IX", sigma(&free, "D_IX"))];
    let a = calibrated(&first, &prior, true, None);
    let one_by_one = calibrated(&second, &prior, true, Some(&a));
    let read = |name: &str, b: &Bench| {
        Record::csv(name, Box::new(std::io::Cursor::new(csv(&b.record())))).expect("a record")
    };
    let records = vec![read("a.csv", &first), read("b.csv", &second)];
    let mut own = conditions(&first);
    let stated = prior.map(|(name, value)| Assignment { name: name.into(), value });
    own.estimates.extend(truths(&first, &stated));
    own.priors.extend(stated);
    let at_once = calibrate(&scheme(&first, "F,I,O,S"), &own, records, &Options::default(), &|_| true)
        .expect("calibrated");
    // by the linear covariance, not by repeated estimates
    for c in [&a, &one_by_one, &at_once] {
        assert!(!c.curvature.from_samples, "{:?}", c.curvature);
    }
    for (name, _) in prior {
        let (s, t) = (sigma(&one_by_one, name), sigma(&at_once, name));
        assert!((s / t - 1.0).abs() < 0.02, "{name}: {s} {t}");
    }
}

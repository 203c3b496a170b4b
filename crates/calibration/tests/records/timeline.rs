//! Records with times that differ slightly from those of the scheme: rows are lost, stamps are rounded, late,
//! or of another clock. The timeline of the scheme is used, and the estimate is that of the bench.

use obsdeg_calibration::Calibration;
use obsdeg_calibration::answer::PositionsBy;

use crate::round_trip::{errors, of_csv, six};
use crate::simulator::{Bench, Sample, csv};

fn bench(seed: u64) -> Bench {
    Bench { seed, slew_deg_s: Some(2.0), ..six() }
}

/// Independent generator for lost rows (Lehmer 1951).
fn lost(seed: u64) -> impl FnMut(f64) -> bool {
    let mut state = 48_271 * (seed + 1) % 0x7fff_ffff;
    move |part| {
        state = state * 48_271 % 0x7fff_ffff;
        (state as f64) < part * 2_147_483_647.0
    }
}

fn micro(samples: &[Sample]) -> Vec<Sample> {
    samples.iter().map(|s| Sample { t: (s.t * 1e6).round() / 1e6, ..s.clone() }).collect()
}

fn later(samples: &[Sample], by: f64) -> Vec<Sample> {
    samples.iter().map(|s| Sample { t: s.t + by, ..s.clone() }).collect()
}

/// Samples without the last one of three positions.
fn without_three(samples: &[Sample]) -> Vec<Sample> {
    let last = |k: usize| {
        ["p2", "p3", "p5"].contains(&samples[k].label)
            && samples.get(k + 1).is_none_or(|s| s.label != samples[k].label)
    };
    (0..samples.len()).filter(|&k| !last(k)).map(|k| samples[k].clone()).collect()
}

fn calibrated(bench: &Bench, samples: &[Sample]) -> Calibration {
    of_csv(bench, "F,I,O,S", csv(samples)).expect("calibrated")
}

/// Largest error in sigma.
fn worst(bench: &Bench, c: &Calibration) -> (String, f64) {
    let all = errors(bench, c).into_iter();
    all.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).expect("some")
}

#[test]
fn the_timeline_of_the_scheme_stands() {
    let bench = bench(31);
    let samples = bench.record();
    let bare: Vec<Sample> = samples.iter().filter(|s| !s.label.is_empty()).cloned().collect();
    let third: Vec<usize> = (0..samples.len()).filter(|&k| samples[k].label == "p3").collect();
    let half = third[third.len() / 2];
    let mut drop = lost(7);
    let cases: Vec<(&str, Vec<Sample>)> = vec![
        ("as it is", samples.clone()),
        ("30 % lost, rounded", micro(&samples).into_iter().filter(|_| !drop(0.3)).collect()),
        (
            "half of p3",
            micro(&samples).into_iter().filter(|s| s.label != "p3" || s.t < samples[half].t).collect(),
        ),
        ("10 ms late", without_three(&later(&samples, 0.01))),
        ("early", later(&samples, -2e-6)),
        ("3.7 s late", without_three(&later(&samples, 3.7))),
        ("1000 s late, at rest alone", without_three(&later(&bare, 1000.0))),
        ("Unix seconds", without_three(&later(&samples, 1_795_478_400.0))),
    ];
    for (name, samples) in cases {
        let c = calibrated(&bench, &samples);
        let (unknown, sigmas) = worst(&bench, &c);
        println!("{name}: {unknown} by {sigmas:.2} sigma, {:?}, {:?}", c.records[0].positions_by, c.findings);
        assert!(sigmas.abs() < 3.5 && c.consistent, "{name}: {unknown} by {sigmas} sigma, {:?}", c.findings);
        let r = &c.records[0];
        assert_eq!(r.positions_by, PositionsBy::Both, "{name}");
        let (at, sigma) = (r.clock.offset_s.expect("there"), r.clock.offset_sigma_s);
        let late = match name {
            "10 ms late" => 0.01,
            "3.7 s late" => 3.7,
            "1000 s late, at rest alone" => 1000.0,
            "Unix seconds" => 1_795_478_400.0,
            _ => 0.0,
        };
        // beyond the tolerance the delay is estimated
        assert_eq!(sigma.is_some(), late > 0.5, "{name}");
        assert!((at - late).abs() < 4.0 * sigma.unwrap_or(1e-6), "{name}: {at} {sigma:?}");
        let gaps: Vec<_> = r.gaps.iter().filter(|g| g.to_s - g.from_s > 400.0).collect();
        if name == "half of p3" {
            let [gap] = &gaps[..] else { panic!("{:?}", r.gaps) };
            assert!((gap.to_s - gap.from_s - 500.0).abs() < 20.0 && gap.place == "after p3", "{gap:?}");
        } else {
            assert!(gaps.is_empty(), "{name}: {gaps:?}");
        }
    }
}

/// A timeline late by less than an interval shows in the fit, if nothing else shows that rows are missing.
#[test]
fn a_beginning_shows_in_the_fit() {
    let bench = bench(8);
    let bare = |by: f64| csv(&later(&bench.record(), by)).replace("position", "note");
    let c = of_csv(&bench, "F,I,O,S", bare(2.4)).expect("calibrated");
    let (unknown, sigmas) = worst(&bench, &c);
    assert!(sigmas.abs() < 3.5 && c.consistent, "{unknown} by {sigmas}: {:?}", c.findings);
    let clock = &c.records[0].clock;
    let (at, sigma) = (clock.offset_s.expect("there"), clock.offset_sigma_s.expect("estimated"));
    assert!((at - 2.4).abs() < 4.0 * sigma && sigma < 0.2, "{clock:?}");
    // a right record is not changed
    let c = of_csv(&bench, "F,I,O,S", bare(0.0)).expect("calibrated");
    assert_eq!((c.records[0].clock.offset_s, c.records[0].clock.offset_sigma_s), (Some(0.0), None));
}

/// The stated tolerance decides whether stamps agree with the timeline.
#[test]
fn the_tolerance_is_stated() {
    let bench = bench(9);
    let text = csv(&later(&bench.record(), 0.3));
    for (tolerance, estimated) in [(None, false), (Some(0.01), true), (Some(0.1), false)] {
        let recording = obsdeg_core::model::Recording { tolerance, ..Default::default() };
        let c = crate::round_trip::with_recording(&bench, recording, text.clone()).expect("calibrated");
        assert_eq!(c.records[0].clock.offset_sigma_s.is_some(), estimated, "{tolerance:?}");
    }
}

/// Drifts that tilt the platform beyond any bound on single positions: each position begins where the one
/// before ended. A wrong position is still named.
#[test]
fn positions_are_known_at_any_tilt() {
    let tilted = |scale: f64| Bench {
        drift: [[11.0, 12.0, 13.0], [5.0; 3], [5.0; 3], [5.0; 3]].map(|d: [f64; 3]| d.map(|x| x * scale)),
        psi: [1.5, 0.1, 1.5].map(f64::to_radians),
        ..bench(5)
    };
    for scale in [1.0, 3.0] {
        let bench = tilted(scale);
        let samples = bench.record();
        if let Err(e) = of_csv(&bench, "F,I,O,S", csv(&samples)) {
            panic!("{scale}: {e}");
        }
        let mut other = bench.clone();
        (other.positions[1].1, other.positions[3].1) = (bench.positions[3].1, bench.positions[1].1);
        let e = of_csv(&other, "F,I,O,S", csv(&samples)).expect_err("another scheme").to_string();
        assert!(e.contains("at p2 the specific force is") && e.ends_with("it is that of p4"), "{e}");
        // the platform turned once more than in the scheme
        let mut other = bench.clone();
        other.positions[5].1 = other.positions[4].1;
        let e = of_csv(&other, "F,I,O,S", csv(&samples)).expect_err("another scheme").to_string();
        assert!(e.contains("at p6 the specific force is"), "{e}");
    }
}

//! Records with an error in their truth that the scheme does not estimate: is it named, and what is said
//! without one?

use obsdeg_calibration::answer::Finding;
use obsdeg_calibration::{Calibration, Options, calibrate, record::Record};

use obsdeg_core::model::settings::Assignment;

use crate::round_trip::{conditions, scheme};
use crate::simulator::{Bench, attitude, turned};

/// Five cardinal attitudes under inertial carry: NUE USE ENU EUS DSW.
fn five(k0_y_ug: f64, seed: u64) -> Bench {
    let attitudes = [
        ("NUE", [0.0, 0.0, 0.0]),
        ("USE", [0.0, 0.0, -90.0]),
        ("ENU", [90.0, 0.0, 90.0]),
        ("EUS", [0.0, 90.0, 0.0]),
        ("DSW", [180.0, 0.0, -90.0]),
    ];
    Bench {
        seed,
        positions: attitudes.map(|(n, a)| (n, a, 1000.0)).into(),
        psi: [1e-4, -2e-4, 1.5e-4],
        drift: [[0.05, -0.03, 0.04], [0.03, 0.02, -0.028], [0.01, -0.02, 0.015], [-0.04, 0.025, 0.02]],
        accelerometers: [[0.0, k0_y_ug * 1e-6, 0.0], [0.0; 3], [0.0; 3]],
        ..Bench::default()
    }
}

/// Z1 and Z3 of the record of a bench, `C_c^n f - (0, 1, 0)`.
fn calibrated(bench: &Bench) -> Calibration {
    required(bench, &[], &[])
}

/// The same with requirements and a bench, by names.
fn required(bench: &Bench, requirements: &[(&str, f64)], sizes: &[(&str, f64)]) -> Calibration {
    let mut text = String::from("t [s],position,Z1 [g],Z3 [g]\n");
    for s in bench.record() {
        let angles = bench.positions.iter().find(|p| p.0 == s.label).expect("a position").1;
        let z = turned(&attitude(&angles), &s.f);
        text += &format!("{},{},{},{}\n", s.t, s.label, z[0], z[2]);
    }
    let record = Record::csv("run.csv", Box::new(std::io::Cursor::new(text))).expect("a record");
    let named = |of: &[(&str, f64)]| -> Vec<Assignment> {
        of.iter().map(|(name, value)| Assignment { name: (*name).into(), value: *value }).collect()
    };
    let mut conditions = conditions(bench);
    conditions.requirements.extend(named(requirements));
    conditions.bench.extend(named(sizes));
    calibrate(&scheme(bench, "F,I,O,S"), &conditions, vec![record], &Options::default(), &|_| true)
        .expect("calibrated")
}

/// No requirement counts as met where a suspected error moves the estimate by more than it allows; without
/// one the answer says which size of each error would use it up. By the reference table 1 ug of every K0
/// changes D_IZ by 0.02985 deg/h/g. Where a bench alone is beyond the requirement, no further run is offered.
#[test]
fn requirements_count_what_is_suspected_and_say_what_is_not_stated() {
    let all = [("D", 0.1)];
    let c = required(&five(15.0, 3), &all, &[]);
    assert!(c.omitted.suspicion.is_some() && c.omitted.limits.is_empty());
    let missed = &c.requirements.as_ref().expect("requirements").missed;
    assert!(missed.iter().any(|m| m.name == "D_IZ"), "{missed:?}");
    let c = required(&five(0.0, 3), &all, &[]);
    assert!(c.requirements.as_ref().expect("requirements").all_met());
    let k0 = c.omitted.limits.iter().find(|l| l.family == "K0").expect("a limit of K0");
    let sigma = c.quantities.iter().find(|q| q.name == "D_IZ").and_then(|q| q.sigma).expect("a sigma");
    let expected = (0.01 - sigma * sigma).sqrt() / 0.02985;
    assert_eq!(k0.unknown, "D_IZ");
    assert!((k0.size / expected - 1.0).abs() < 0.02, "{} {expected}", k0.size);
    // of a bench the families that it states have no limit
    let c = required(&five(0.0, 3), &all, &[("K0", 0.1)]);
    assert!(c.omitted.limits.iter().all(|l| l.family != "K0") && c.omitted.limits.len() > 3);
    let c = required(&five(0.0, 3), &all, &[("K0", 20.0)]);
    let next = c.next_runs.iter().find(|n| n.unknown == "D_IZ").expect("a missed requirement");
    assert!(next.required_sigma == 0.0 && next.attitude.is_none() && !next.met, "{next:?}");
}

/// A zero of 15 ug of accelerometer Y: chi-square of the fit is within its band, D_IZ is many sigmas off, and
/// the score test names the error and what D_IZ is with it.
#[test]
fn an_accelerometer_zero_is_named() {
    let c = calibrated(&five(15.0, 3));
    println!("{:#?}\n{:?}", c.omitted, c.findings);
    let d_iz = c.quantities.iter().find(|q| q.name == "D_IZ").expect("D_IZ");
    let (estimate, sigma) = (d_iz.estimate.expect("an estimate"), d_iz.sigma.expect("a sigma"));
    assert!((estimate + 0.028).abs() > 5.0 * sigma, "{estimate} +- {sigma}");
    let found = c.omitted.suspicion.as_ref().expect("a suspicion");
    let named = found.errors.iter().map(|e| e.name.as_str());
    let group = found.indistinguishable.iter().map(String::as_str);
    assert!(named.chain(group).any(|n| n == "K0_Y"), "{found:?}");
    assert_eq!(found.errors.len(), 1, "{found:?}");
    let with = found.changes.iter().find(|s| s.unknown == "D_IZ").expect("D_IZ changes");
    assert_eq!(with.estimate, estimate);
    if found.errors[0].name == "K0_Y" {
        assert!((found.errors[0].estimate - 15.0).abs() < 4.0 * found.errors[0].sigma, "{found:?}");
        assert!((with.with + 0.028).abs() < 4.0 * sigma, "{with:?}");
    }
    assert!(c.findings.iter().any(|f| matches!(f, Finding::Suspect { .. })), "{:?}", c.findings);
    assert!(!c.consistent);
}

/// Members of a group explain the residuals equally and change the estimates in other ways: a range holds
/// what the estimate is with the true one, which is not the one named first.
#[test]
fn a_group_changes_estimates_by_a_range() {
    let (mut ranges, mut others) = (0, 0);
    for seed in 0..10 {
        let bench = five(8.0, seed);
        let c = calibrated(&bench);
        let Some(found) = c.omitted.suspicion.as_ref() else { continue };
        for s in &found.changes {
            assert!(s.lowest <= s.with && s.with <= s.highest, "{s:?}");
            ranges += usize::from(s.lowest < s.highest);
            let alone = found.indistinguishable.is_empty();
            assert!(!alone || s.lowest == s.highest, "{s:?}");
            others += usize::from(!alone);
        }
        let d_iz = found.changes.iter().find(|s| s.unknown == "D_IZ");
        let sigma = c.quantities.iter().find(|q| q.name == "D_IZ").and_then(|q| q.sigma).expect("a sigma");
        let near = |s: &obsdeg_evidence::simulation::omitted::SuspectedChange| {
            s.lowest - 4.0 * sigma < -0.028 && -0.028 < s.highest + 4.0 * sigma
        };
        println!("{seed}: {found:?}");
        let named = found.errors.iter().map(|e| &e.name).chain(&found.indistinguishable);
        if named.clone().any(|n| n == "K0_Y") {
            assert!(d_iz.is_some_and(near), "{seed}: {found:?}");
        }
    }
    assert!(ranges > 0 && others > 0, "{ranges} {others}");
}

/// Without an error nothing is suspected, in these ten records.
#[test]
fn nothing_is_suspected_without_an_error() {
    for seed in 0..10 {
        let c = calibrated(&five(0.0, seed));
        assert!(c.omitted.suspicion.is_none(), "{seed}: {:?}", c.omitted);
        assert!(c.consistent, "{seed}: {:?}", c.findings);
        assert!(c.omitted.tried > 20, "{}", c.omitted.tried);
    }
}

//! Records with an error in their truth that the scheme does not estimate: the error is named. Answers
//! without such an error.

use obsdeg_calibration::answer::CalibrationFinding;
use obsdeg_calibration::{Calibration, Options, calibrate, record::Record};

use obsdeg_core::model::settings::Assignment;

use crate::round_trip::{conditions, of_csv, scheme};
use crate::simulator::{Bench, attitude, csv, turned};

/// Five cardinal attitudes under inertial carry: NUE USE ENU EUS DSW.
pub(crate) fn five(k0_y_ug: f64, seed: u64) -> Bench {
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
pub(crate) fn calibrated(bench: &Bench) -> Calibration {
    required(bench, &[], &[])
}

/// Calibration with requirements and a bench, by names.
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

/// No requirement counts as met where a suspected error moves the estimate beyond it. Without a suspicion the
/// answer states the size of each error that would use the requirement up. By the reference table 1 ug of
/// every K0 changes D_IZ by 0.02985 deg/h/g. Where a bench alone exceeds the requirement, no further run is
/// offered.
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
    // families that a bench states have no limit
    let c = required(&five(0.0, 3), &all, &[("K0", 0.1)]);
    assert!(c.omitted.limits.iter().all(|l| l.family != "K0") && c.omitted.limits.len() > 3);
    let c = required(&five(0.0, 3), &all, &[("K0", 20.0)]);
    let next = c.next_runs.iter().find(|n| n.unknown == "D_IZ").expect("a missed requirement");
    assert!(next.required_sigma == 0.0 && next.attitude.is_none() && !next.met, "{next:?}");
}

/// A zero of 15 ug of accelerometer Y: chi-square of the fit is within its band and D_IZ is many sigmas off.
/// The score test names the error and the resulting D_IZ.
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
    assert!(c.findings.iter().any(|f| matches!(f, CalibrationFinding::Suspect { .. })), "{:?}", c.findings);
    assert!(!c.consistent);
}

/// Members of a group explain the residuals equally and change the estimates differently: a range holds the
/// estimate with the true error, which is not the one named first.
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

/// For a tilted platform, an error changes the estimates as a record with it does: the total of a bench of
/// one error, against the difference of two calibrations with the same noise, under platform and inertial
/// carry. Columns at the attitudes of the scheme gave 0.66 and 1.7 times the change there.
#[test]
fn a_bench_counts_as_much_as_its_error_changes() {
    use crate::simulator::AtOnce;
    // sizes in the units of the bench, and in those of the simulator
    type Set = fn(&mut Bench, f64);
    let errors: [(&str, f64, Set); 7] = [
        ("D_IIX", 0.05, |b, x| b.squares[0][0] = x),
        ("D_OOX", 0.05, |b, x| b.squares[1][0] = x),
        ("D_SSX", 0.05, |b, x| b.squares[2][0] = x),
        ("K0_X", 3.0, |b, x| b.accelerometers[0][0] = x * 1e-6),
        ("K1_Y", 20.0, |b, x| b.accelerometers[1][1] = x * 1e-6),
        ("GS_X", 500.0, |b, x| b.torquer[0][0] = x * 1e-6),
        ("GM_XY", 20.0, |b, x| b.torquer[0][1] = x * (std::f64::consts::PI / 648_000.0)),
    ];
    let mut seen = 0;
    for carry in [AtOnce::Platform, AtOnce::Inertial] {
        let drift = [[0.5, -0.3, 0.4], [0.3, 0.2, -0.28], [0.1, -0.2, 0.15], [-0.4, 0.25, 0.2]];
        let base = Bench { carry: carry.clone(), drift, ..five(0.0, 3) };
        let without = calibrated(&base);
        for (name, size, set) in errors {
            let mut bench = base.clone();
            set(&mut bench, size);
            let with = calibrated(&bench);
            let of = |c: &Calibration, name: &str| {
                let q = c.quantities.iter().find(|q| q.name == name).expect("a coefficient");
                [q.estimate.expect("an estimate"), q.sigma.expect("a sigma")]
            };
            let coefficients = without.quantities.iter().filter(|q| q.name.starts_with("D_"));
            let changes =
                coefficients.map(|q| (q.name.clone(), of(&with, &q.name)[0] - of(&without, &q.name)[0]));
            let (most, change) =
                changes.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).expect("coefficients");
            let c = required(&base, &[(&most, 1.0)], &[(name, size)]);
            let worst = c.requirements.as_ref().and_then(|r| r.worst.clone()).expect("a margin");
            let [_, sigma] = of(&c, &most);
            let own = c.quantities.iter().find(|q| q.name == most).and_then(|q| q.total);
            assert!(own.is_some_and(|t| (t * worst.margin - 1.0).abs() < 1e-9), "{own:?}");
            let total = 1.0 / worst.margin;
            let counted = (total * total - sigma * sigma).max(0.0).sqrt();
            println!("{carry:?} {name}: {most} {change} {counted} {sigma}");
            if change.abs() > 0.01 * sigma {
                seen += 1;
                let off = (counted / change.abs() - 1.0).abs();
                assert!(off < 0.03, "{carry:?} {name}: {most} changes by {change}, counted {counted}");
            }
        }
    }
    assert!(seen > 12, "{seen}");
}

/// A beginning of the scheme that labels leave open may explain residuals too. An error of five times its
/// visible size is still named, although a later beginning would explain most of it.
#[test]
fn an_error_is_distinguished_from_an_open_beginning() {
    use crate::simulator::AtOnce;
    let (mut named, mut open) = (0, 0);
    let count = if std::env::var_os("AT_LENGTH").is_some() { 12 } else { 5 };
    for seed in (0..).take(count) {
        let positions = vec![
            ("p1", [142.0, -13.0, 32.0], 600.0),
            ("p2", [-171.0, 29.0, 151.0], 600.0),
            ("p3", [118.0, 66.0, 58.0], 600.0),
            ("p4", [-92.0, 46.0, -104.0], 600.0),
            ("p5", [119.0, -74.0, 117.0], 600.0),
            ("p6", [-121.0, -21.0, -66.0], 600.0),
        ];
        // a beginning shows where drifts are large
        let drift = [[8.0, -6.0, 7.0], [3.0, 2.0, -2.8], [1.0, -2.0, 1.5], [-4.0, 2.5, 2.0]];
        let mut bench = Bench { carry: AtOnce::Platform, positions, drift, ..five(0.0, seed) };
        bench.accelerometers[0][0] = 19e-6;
        let c = of_csv(&bench, "F,I,O,S", csv(&bench.record())).expect("calibrated");
        open += usize::from(c.records[0].clock.offset_sigma_s.is_some());
        let found = c.omitted.suspicion.as_ref();
        let all = found.map_or_else(Vec::new, |s| {
            s.errors.iter().map(|e| e.name.clone()).chain(s.indistinguishable.iter().cloned()).collect()
        });
        println!("{seed}: {all:?} {:?}", c.records[0].clock);
        named += usize::from(all.iter().any(|n| n == "K0_X"));
    }
    assert!(named == count && open > count / 5, "{named} {open}");
}

/// Without an error nothing is suspected in these ten records.
#[test]
fn nothing_is_suspected_without_an_error() {
    for seed in 0..10 {
        let c = calibrated(&five(0.0, seed));
        assert!(c.omitted.suspicion.is_none(), "{seed}: {:?}", c.omitted);
        assert!(c.consistent, "{seed}: {:?}", c.findings);
        assert!(c.omitted.tried > 20, "{}", c.omitted.tried);
    }
}

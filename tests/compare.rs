//! Schemes side by side: what is predicted is what the filter does, and what each position is for.

use std::process::Command;

use obsdeg_core::compare::answer::Review;
use obsdeg_core::compare::{Entry, compare};
use obsdeg_core::model::scheme::parse_attitude;
use obsdeg_core::model::{Carry, Scheme};
use obsdeg_core::simulation::conditions::{Assignment, Conditions};
use obsdeg_core::simulation::simulate;

const S6: [&str; 6] = ["10,25,40", "130,-50,70", "-95,33,-160", "60,80,15", "-20,-70,110", "170,15,-75"];

fn scheme(attitudes: &[&str], carry: Carry) -> Scheme {
    Scheme { carry, ..Scheme::of_angles(attitudes.iter().map(|a| parse_attitude(a).expect("an attitude"))) }
}

fn review(scheme: &Scheme) -> Review {
    let entry = Entry { name: "it".into(), scheme: scheme.clone(), conditions: Conditions::default() };
    compare(&[entry], 1).expect("compared").schemes.remove(0)
}

/// The information of the batch against a filter with a prior that says nothing and no drift noise.
#[test]
fn the_predicted_sigma_is_that_of_a_filter() {
    for (attitudes, carry) in [
        (&S6[..5], Carry::Inertial),
        (&S6[..], Carry::Inertial),
        (&S6[..4], Carry::Platform),
        (&S6[..], Carry::Reset),
    ] {
        let scheme = scheme(attitudes, carry);
        let prior = |name: &str| Assignment { name: name.into(), value: 1e7 };
        let quiet = Conditions {
            drift_noise: "0 deg/h".parse().expect("a drift noise"),
            priors: vec![prior("psi"), prior("D")],
            ..Conditions::default()
        };
        let (filter, _) = simulate(&scheme, &quiet, 1).expect("simulated");
        for (q, f) in review(&scheme).quantities.iter().zip(&filter.quantities) {
            // psi of the filter is that of the end
            if q.name.starts_with("D_") {
                let sigma = q.sigma.expect("observable");
                assert!((sigma / f.sigma - 1.0).abs() < 1e-4, "{} {carry}: {sigma} {}", q.name, f.sigma);
            }
        }
    }
}

#[test]
fn what_each_position_is_for() {
    // five positions are the fewest under inertial carry, so none can go; of six, any one can
    let five = review(&scheme(&S6[..5], Carry::Inertial));
    assert!(five.drop_one.iter().all(|d| !d.lost.is_empty() && d.worst.is_none()));
    assert!(five.quantities.iter().all(|q| q.carried_by.len() == 5));
    let six = review(&scheme(&S6, Carry::Inertial));
    let worst = six.worst.clone().expect("all observable").sigma_dph;
    assert!(
        six.drop_one
            .iter()
            .all(|d| d.lost.is_empty() && d.worst.as_ref().is_some_and(|w| w.sigma_dph > worst))
    );
    // the paper's: D_FX is told from D_SX by the second position; D_OX is not excited at either
    let paper = review(&scheme(&["0,0,0", "180,0,0"], Carry::Platform));
    let of = |name: &str| paper.quantities.iter().find(|q| q.name == name).expect("an unknown");
    assert_eq!(of("D_FX").carried_by, ["p1", "p2"]);
    assert_eq!(
        (of("D_FX").excitation.as_slice(), of("D_OX").excitation.as_slice()),
        (&[1.0, 1.0][..], &[0.0, 0.0][..])
    );
    assert_eq!((of("D_FZ").sigma, of("D_OX").sigma, paper.worst.as_ref()), (None, None, None));
    assert!(!paper.meets_requirements);
}

#[test]
fn sensitivity_says_what_the_assumptions_are_worth() {
    let six = review(&scheme(&S6, Carry::Inertial));
    let at =
        |condition: &str| six.sensitivity.iter().find(|s| s.condition == condition).expect("a condition");
    let sigma = |condition: &str| at(condition).worst.as_ref().map(|w| w.sigma_dph);
    let here = six.worst.as_ref().map(|w| w.sigma_dph);
    // eps_y is seen through wN: worse towards the pole, lost at it
    assert!(sigma("latitude 30 deg") > here && sigma("latitude 75 deg") > sigma("latitude 30 deg"));
    assert_eq!((at("latitude 90 deg").worst.as_ref(), at("latitude 90 deg").rank[0] < 15), (None, true));
    // order 2: twice the dwell is 2^2.5 times better, a little less as the earth turns
    let gain = sigma("dwell x 0.5").expect("there") / here.expect("there");
    assert!((4.5..6.5).contains(&gain), "{gain}");
    assert_eq!(at("reset carry").rank, [30, 30]);
}

#[test]
fn files_are_named_and_wrong_ones_refused() {
    let run = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_obsdeg")).arg("compare").args(arguments).output().expect("it runs")
    };
    let files = ["examples/five-positions/scheme.toml", "examples/simulated-run/scheme.toml"];
    let output = run(&files);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    insta::with_settings!({ omit_expression => true, prepend_module_to_snapshot => false }, {
        insta::assert_snapshot!("compare_table", text);
    });
    for format in ["markdown", "latex", "csv", "json"] {
        let output = run(&[&files[..], &["--format", format]].concat());
        assert!(
            output.status.success() && String::from_utf8_lossy(&output.stdout).contains("five-positions")
        );
    }
    for (arguments, expected) in [
        (&["no/such.toml"][..], "no/such.toml"),
        (&["examples/wrong-gyro/scheme.toml"], "wrong-gyro"),
        (&["examples/generic-angles/scheme.toml"], "generic"),
        (&[files[0], "--requirement", "D_FW=1"], "D_FW"),
        (&[], "FILE"),
    ] {
        let output = run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}

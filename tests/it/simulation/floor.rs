//! The noise floor against closed forms and generalised least squares, and the output of the commands.

use nalgebra::Cholesky;
use obsdeg_core::model::PerGyro;
use obsdeg_evidence::simulation::{
    CoefficientFloor, GyroNoise, Reached, noise_floor, predict, sigmas_without_prior,
};

use super::*;
use crate::schemes::S6;

/// Scheme with X_p to the North at the equator: `psi_x' = D_FX + b + w` and no other term.
fn alone() -> Scheme {
    Scheme {
        latitude: "0".parse().ok(),
        unknowns: "F".parse().expect("terms"),
        ..scheme(&["0,0,0"], Carry::Platform)
    }
}

/// Conditions with angle random walk in deg/sqrt(h) and rate random walk in deg/h/sqrt(h).
fn with(angle: f64, rate: f64, accelerometer_noise_g: f64) -> Conditions {
    let gyro_noise = GyroNoise {
        angle_random_walk_deg_sqrt_h: PerGyro::all(angle),
        rate_random_walk_dph_sqrt_h: PerGyro::all(rate),
        ..GyroNoise::default()
    };
    // short steps, since the closed forms observe Z continuously
    Conditions {
        gyro_noise,
        accelerometer_noise_g,
        step_s: 1.0,
        ..Conditions::default().without_drift_noise()
    }
}

fn of_d_fx(scheme: &Scheme, conditions: &Conditions) -> CoefficientFloor {
    let plan = Plan::new(scheme, conditions).expect("a plan");
    let prediction = predict(&plan, 1).expect("a prediction");
    let found = noise_floor(scheme, conditions, &prediction).expect("a floor").expect("of noisy gyros");
    found.coefficients.into_iter().find(|c| c.name == "D_FX").expect("D_FX")
}

/// Sigma of D_FX after `dwell` s, in deg/h.
fn sigma(conditions: &Conditions, dwell: f64) -> f64 {
    let factor = dwell / conditions.dwell_s;
    let found = sigmas_without_prior(&alone(), conditions, factor).expect("sigmas");
    found[3].to_degrees() * 3600.0
}

/// Exact observations: sigma^2 = K N coth(K T/N), within 5 % of its floor from 1.530 N/K on. In deg and h: N
/// = 0.006, K = 0.06 give sqrt(K N) = 0.01897 deg/h and 0.1530 h.
#[test]
fn angle_and_rate_random_walk() {
    let (n, k) = (0.006f64, 0.06f64);
    let conditions = with(n, k, 1e-11);
    for t_h in [0.02, 0.1, 0.153, 0.5, 3.0] {
        let expected = (k * n / (k * t_h / n).tanh()).sqrt();
        let found = sigma(&conditions, t_h * 3600.0);
        assert!((found / expected - 1.0).abs() < 0.01, "{t_h} h: {found} instead of {expected}");
    }
    let found = of_d_fx(&alone(), &conditions);
    let (least, dwell) = (found.least_sigma.expect("a floor"), found.dwell_s.expect("a dwell"));
    assert!((least / 0.018_974 - 1.0).abs() < 0.01, "{least}");
    assert!((dwell / (0.1530 * 3600.0) - 1.0).abs() < 0.05, "{dwell}");
}

/// No angle random walk: sigma^2 = K^(3/2) R^(1/4) sqrt 2 (sinh a cosh a + sin a cos a)/(sinh^2 a - sin^2 a),
/// a = sqrt(K) R^(-1/4) T/sqrt 2.
#[test]
fn rate_random_walk_and_white_observations() {
    let conditions = with(0.0, 0.1, 3e-5);
    let k = (0.1f64 / 3600.0 / 60.0).to_radians();
    let r = 3e-5f64.powi(2) * conditions.step_s;
    let per_dph = 1f64.to_radians() / 3600.0;
    let closed = |t: f64| {
        let a = k.sqrt() * r.powf(-0.25) * t / 2f64.sqrt();
        let (s, c, sh, ch) = (a.sin(), a.cos(), a.sinh(), a.cosh());
        (k.powf(1.5) * r.powf(0.25) * 2f64.sqrt() * (sh * ch + s * c) / (sh * sh - s * s)).sqrt() / per_dph
    };
    let floor = (2f64.sqrt() * k.powf(1.5) * r.powf(0.25)).sqrt() / per_dph;
    for t in [300.0, 1000.0, 3000.0, 10_000.0] {
        let (found, expected) = (sigma(&conditions, t), closed(t));
        assert!((found / expected - 1.0).abs() < 0.02, "{t} s: {found} instead of {expected}");
    }
    // shortest dwell at which the closed form is within 5 % of its floor
    let (mut low, mut high) = (10.0, 1e5);
    while high - low > 1.0 {
        let middle = (low + high) / 2.0;
        if closed(middle) > 1.05 * floor { low = middle } else { high = middle }
    }
    let found = of_d_fx(&alone(), &conditions);
    let (least, dwell) = (found.least_sigma.expect("a floor"), found.dwell_s.expect("a dwell"));
    assert!((least / floor - 1.0).abs() < 0.02, "{least} {floor}");
    assert!((dwell / low - 1.0).abs() < 0.05, "{dwell} {low}");
}

/// No rate random walk: sigma^2 = N^2/(T - 2 tau tanh(T/(2 tau))) with tau = sqrt(R)/N falls without a floor.
#[test]
fn angle_random_walk_alone_has_no_floor() {
    let conditions = with(0.001, 0.0, 1e-5);
    let n = 0.001f64.to_radians() / 60.0;
    let tau = 1e-5 * conditions.step_s.sqrt() / n;
    for t in [200.0, 1000.0, 10_000.0, 100_000.0] {
        let expected = (n * n / (t - 2.0 * tau * (t / (2.0 * tau)).tanh())).sqrt().to_degrees() * 3600.0;
        let found = sigma(&conditions, t);
        assert!((found / expected - 1.0).abs() < 0.03, "{t} s: {found} instead of {expected}");
    }
    let found = of_d_fx(&alone(), &conditions);
    assert!(found.least_sigma < found.sigma && found.dwell_s.is_none(), "{found:?}");
    assert_eq!(found.reached, Some(Reached::StillFalls));
    // a bias with a short correlation time averages out too
    let forgets = GyroNoise {
        bias_instability_dph: PerGyro::all(0.01),
        correlation_time_s: 10.0,
        ..conditions.gyro_noise
    };
    let forgetful = Conditions { gyro_noise: forgets, ..conditions };
    assert_eq!(of_d_fx(&alone(), &forgetful).reached, Some(Reached::StillFalls));
    // no dwell is named if all dwells are long enough
    let long = of_d_fx(&alone(), &Conditions { dwell_s: 1e6, ..with(0.006, 0.06, 1e-5) });
    assert_eq!((long.reached, long.dwell_s), (Some(Reached::AtTheShortest), None));
}

/// Two positions turned about the North at the equator, psi carried inertially: `psi_x' = D_FX -+ D_SX + b +
/// w`. Reference: sigmas of D_FX and D_SX by generalised least squares with the covariance of all samples:
/// N^2 min(s, t), K^2 s^2 (3t - s)/6 for s <= t, and the noise of Z.
#[test]
fn two_positions_against_generalised_least_squares() {
    let scheme = Scheme {
        latitude: "0".parse().ok(),
        unknowns: "F,S".parse().expect("terms"),
        ..scheme(&["0,0,0", "180,0,0"], Carry::Inertial)
    };
    let conditions = Conditions { step_s: 20.0, dwell_s: 400.0, ..with(0.002, 0.3, 1e-5) };
    let (n, k) = ((0.002f64 / 60.0).to_radians(), (0.3f64 / 3600.0 / 60.0).to_radians());
    for factor in [0.5, 1.0, 2.0] {
        let dwell = 400.0 * factor;
        let count = (2.0 * dwell / 20.0) as usize;
        let time = |i: usize| 20.0 * (i as f64 + 1.0);
        let covariance = DMatrix::from_fn(count, count, |i, j| {
            let (s, t) = (time(i.min(j)), time(i.max(j)));
            let white = if i == j { 1e-10 } else { 0.0 };
            n * n * s + k * k * s * s * (3.0 * t - s) / 6.0 + white
        });
        // columns: psi, D_FX, D_SX (which changes sign)
        let design = DMatrix::from_fn(count, 3, |i, c| {
            let t = time(i);
            [1.0, t, if t <= dwell { -t } else { t - 2.0 * dwell }][c]
        });
        let weighted = Cholesky::new(covariance).expect("definite").solve(&design);
        let inverse = (design.transpose() * weighted).try_inverse().expect("observable");
        let found = sigmas_without_prior(&scheme, &conditions, factor).expect("sigmas");
        let plan = Plan::new(&scheme, &conditions).expect("a plan");
        let index = |name: &str| plan.platform.names().iter().position(|x| x == name).expect("an unknown");
        for (c, name) in [(1, "D_FX"), (2, "D_SX")] {
            let expected = inverse[(c, c)].sqrt();
            let found = found[index(name)];
            assert!(
                (found / expected - 1.0).abs() < 1e-3,
                "{factor} {name}: {found:e} instead of {expected:e}"
            );
        }
    }
}

/// With negligible random drift the sigmas are those of the information of all samples. No prior affects
/// them, whatever the scales of the unknowns. Samples taken together give the same sigmas within 0.5 %.
#[test]
fn without_drift_it_is_the_information() {
    for (attitudes, carry) in [
        (&S6[..], Carry::Inertial),
        (&S6, Carry::Reset),
        (&["0,0,0", "180,0,0"], Carry::Platform),
        (&S6, Carry::Platform),
    ] {
        let scheme = scheme(attitudes, carry);
        let faint = GyroNoise { rate_random_walk_dph_sqrt_h: PerGyro::all(1e-12), ..GyroNoise::default() };
        for (factor, close) in [(1.0, 1e-5), (8.0, 5e-3)] {
            let conditions = Conditions {
                gyro_noise: faint,
                dwell_s: 400.0,
                ..Conditions::default().without_drift_noise()
            };
            let found = sigmas_without_prior(&scheme, &conditions, factor).expect("sigmas");
            let long = Conditions { dwell_s: 400.0 * factor, ..conditions };
            let expected = obsdeg_evidence::compare::predicted(&scheme, &long, 1).expect("predicted");
            let mut counted = 0;
            for ((name, expected), found) in expected.iter().zip(found) {
                let Some(expected) = expected.filter(|_| name.starts_with("D_")) else { continue };
                let found = found.to_degrees() * 3600.0;
                assert!(
                    (found / expected - 1.0).abs() < close,
                    "{carry} {factor} {name}: {found:e} {expected:e}"
                );
                counted += 1;
            }
            assert!(counted >= 5, "{carry}");
        }
    }
}

/// Both commands show the floor in every format, exactly if the gyros have noise. An undetermined unknown has
/// no floor.
#[test]
fn simulate_and_compare_show_the_floor() {
    let place = tempfile::tempdir().expect("a folder");
    let file = place.path().join("two.toml");
    let text = "[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\nangles_deg = [180, 0, 0]\n";
    std::fs::write(&file, text).expect("written");
    let file = file.display().to_string();
    let noise = ["--rate-random-walk", "0.01,0.02,0.01", "--angle-random-walk", "0.001"];
    let json = |arguments: &[&str]| -> serde_json::Value {
        let output = run(&[arguments, &["--format", "json"]].concat());
        serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(&output)))
    };
    let simulated = json(&[&P1P2[..], &noise].concat());
    let compared = json(&[&["compare", &file][..], &noise].concat());
    let floor = &simulated["noise_floor"];
    assert_eq!(floor, &compared["schemes"][0]["noise_floor"], "one floor");
    assert_eq!(floor["gyro_noise"]["rate_random_walk_dph_sqrt_h"], serde_json::json!([0.01, 0.02, 0.01]));
    assert_eq!(floor["drift_noise_deg_sqrt_h"], 0.0);
    let of = |name: &str| {
        let list = floor["coefficients"].as_array().expect("a list");
        list.iter().find(|c| c["name"] == name).expect("a coefficient").clone()
    };
    assert!(
        of("D_FZ")["least_sigma"].is_null()
            && of("D_FZ")["reached"].is_null()
            && of("D_FZ")["dwell_s"].is_null()
            && of("D_FZ")["sigma"].is_null()
    );
    let number = |c: &serde_json::Value, key: &str| c[key].as_f64().expect("a number");
    let d_fx = of("D_FX");
    assert!(number(&d_fx, "least_sigma") <= number(&d_fx, "sigma") && d_fx["unit"] == "deg/h");
    for format in ["table", "markdown", "latex"] {
        for command in [[&P1P2[..], &noise].concat(), [&["compare", &file, "--details"][..], &noise].concat()]
        {
            let text = stdout(&run(&[&command[..], &["--format", format]].concat()));
            assert!(text.contains("Noise floor") && text.contains("no better beyond"), "{format}: {text}");
            assert!(text.contains("is the bias at the start"), "{format}: {text}");
        }
    }
    for quiet in [json(&P1P2), json(&["compare", &file])["schemes"][0].clone()] {
        assert!(quiet.get("noise_floor").is_none() && quiet["conditions"].get("gyro_noise").is_none());
    }
    // predicted sigmas include the stated noise of the gyros; at the scheme's dwells they equal those of the
    // floor
    let quiet = json(&["compare", &file]);
    let sigma = |answer: &serde_json::Value, name: &str| {
        let all = answer["schemes"][0]["quantities"].as_array().expect("a list");
        number(all.iter().find(|q| q["name"] == name).expect("an unknown"), "sigma")
    };
    assert!(sigma(&quiet, "D_FX") < sigma(&compared, "D_FX"));
    let ratio = sigma(&compared, "D_FX") / number(&d_fx, "sigma");
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
}

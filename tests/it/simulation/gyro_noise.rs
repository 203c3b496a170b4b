//! Random drift of the gyros as states: discretisation, Monte Carlo consistency, files and options.

use nalgebra::{Matrix3, SMatrix, Vector3};
use obsdeg_core::model::settings::{FilterKind, Settings, Truth};
use obsdeg_core::model::{PerGyro, Rotation};
use obsdeg_evidence::crosscheck::{MonteCarloExperiment, PreparedExperiment, Statistic};
use obsdeg_evidence::simulation::GyroNoise;

use super::*;

/// Gyro noise that is large against the noise of Z, and different for each gyro.
fn datasheet() -> GyroNoise {
    GyroNoise {
        angle_random_walk_deg_sqrt_h: PerGyro([0.002, 0.001, 0.004]),
        rate_random_walk_dph_sqrt_h: PerGyro([0.3, 0.1, 0.0]),
        bias_instability_dph: PerGyro([0.05, 0.0, 0.1]),
        correlation_time_s: 300.0,
    }
}

fn noisy(gyro_noise: GyroNoise) -> Conditions {
    Conditions { gyro_noise, ..Conditions::default().without_drift_noise() }
}

/// Attitude matrix from passive elementary rotations, as in the paper.
fn c_c_n([alpha, beta, gamma]: [f64; 3]) -> Matrix3<f64> {
    let [(sa, ca), (sb, cb), (sg, cg)] = [alpha, beta, gamma].map(|a| a.to_radians().sin_cos());
    Matrix3::new(1.0, 0.0, 0.0, 0.0, ca, sa, 0.0, -sa, ca)
        * Matrix3::new(cb, 0.0, -sb, 0.0, 1.0, 0.0, sb, 0.0, cb)
        * Matrix3::new(cg, sg, 0.0, -sg, cg, 0.0, 0.0, 0.0, 1.0)
}

/// Phi and Q of psi and the biases of [`datasheet`] over a step, at a position and during a rotation.
/// Reference: Runge-Kutta integration of `Phi' = F Phi`, `Q' = F Q + Q F^T + N` with F and N written here:
/// psi in n, then the biases X: K, B; Y: K; Z: B.
#[test]
#[ignore = "seconds: .ci/run release"]
fn steps_of_the_biases_against_integration() {
    type States = SMatrix<f64, 7, 7>;
    let (attitude, latitude) = ([10.0, 25.0, 40.0], 28.2f64.to_radians());
    let (w_n, w_u) = (7.292115e-5 * latitude.cos(), 7.292115e-5 * latitude.sin());
    let dph = 1f64.to_radians() / 3600.0;
    // [gyro, density, decay]; sigma of B is 0.664/0.6174 of its coefficient
    let markov = |b: f64| 2.0 * (b * dph * 0.664_282_470 / 0.617_364_283).powi(2) / 300.0;
    let walk = |k: f64| (k * dph / 60.0).powi(2);
    let biases = [
        (0, walk(0.3), 0.0),
        (0, markov(0.05), 1.0 / 300.0),
        (1, walk(0.1), 0.0),
        (2, markov(0.1), 1.0 / 300.0),
    ];
    let white = [0.002f64, 0.001, 0.004].map(|n| (n.to_radians() / 60.0).powi(2));
    for (turn, dt) in [(0.0, 10.0), (0.0, 900.0), (90.0, 100.0)] {
        let mut scheme = scheme(&["10,25,40"], Carry::Inertial);
        if turn != 0.0 {
            scheme.positions[0].rotation = Some(Rotation::new("Z_p", "90").expect("a rotation"));
        }
        let conditions = Conditions { step_s: dt, dwell_s: dt, ..noisy(datasheet()) };
        let plan = Plan::new(&scheme, &conditions).expect("a plan");
        assert_eq!((plan.unknowns(), plan.states()), (15, 19));
        let slope = |t: f64, phi: &States, q: &States| {
            // rotation about Z_p by `turn` over the step: n to platform by Rz(-angle) C_n^c
            let angle = turn * t / dt;
            let c = c_c_n(attitude) * c_c_n([0.0, 0.0, -angle]);
            let (mut f, mut n) = (States::zeros(), States::zeros());
            f[(0, 2)] = -w_u;
            f[(1, 2)] = w_n;
            f[(2, 0)] = w_u;
            f[(2, 1)] = -w_n;
            for (k, &(gyro, density, decay)) in biases.iter().enumerate() {
                for i in 0..3 {
                    f[(i, 3 + k)] = c[(i, gyro)];
                }
                f[(3 + k, 3 + k)] = -decay;
                n[(3 + k, 3 + k)] = density;
            }
            let spread = c * Matrix3::from_diagonal(&Vector3::from(white)) * c.transpose();
            n.fixed_view_mut::<3, 3>(0, 0).copy_from(&spread);
            (f * phi, f * q + q * f.transpose() + n)
        };
        let (mut phi, mut q) = (States::identity(), States::zeros());
        let parts = 4000;
        let h = dt / f64::from(parts);
        for i in 0..parts {
            let t = h * f64::from(i);
            let a = slope(t, &phi, &q);
            let b = slope(t + h / 2.0, &(phi + a.0 * (h / 2.0)), &(q + a.1 * (h / 2.0)));
            let c = slope(t + h / 2.0, &(phi + b.0 * (h / 2.0)), &(q + b.1 * (h / 2.0)));
            let d = slope(t + h, &(phi + c.0 * h), &(q + c.1 * h));
            phi += (a.0 + (b.0 + c.0) * 2.0 + d.0) * (h / 6.0);
            q += (a.1 + (b.1 + c.1) * 2.0 + d.1) * (h / 6.0);
        }
        // psi in axes of the first attitude
        let mut to_psi = States::identity();
        to_psi.fixed_view_mut::<3, 3>(0, 0).copy_from(&c_c_n(attitude).transpose());
        let to_psi = if plan.blocks[0].rows[0][0] == 1.0 { States::identity() } else { to_psi };
        let (phi, q) = (to_psi * phi * to_psi.transpose(), to_psi * q * to_psi.transpose());
        let last = plan.stages.len() - 1;
        let root = &plan.noise_roots[last];
        let found = root * root.transpose();
        let transition = plan.stages[last].transition.matrix();
        let at = |i: usize| if i < 3 { i } else { 12 + i };
        let tolerance = if turn == 0.0 { 1e-9 } else { 1e-4 };
        for i in 0..7 {
            for j in 3..7 {
                let expected = phi[(i, j)];
                assert!(
                    (transition[(at(i), at(j))] - expected).abs() < tolerance * (1.0 + expected.abs()),
                    "{turn} {dt} Phi {i} {j}"
                );
            }
            for j in 0..7 {
                let scale = (q[(i, i)] * q[(j, j)]).sqrt();
                assert!(
                    (found[(i, j)] - q[(i, j)]).abs() < tolerance * scale,
                    "{turn} {dt} Q {i} {j}: {} {}",
                    found[(i, j)],
                    q[(i, j)]
                );
            }
        }
    }
}

/// Number of Monte Carlo runs, daily and at full length.
const RUNS: [usize; 2] = [60, 200];

/// ANEES and NIS of `runs` runs.
fn statistics(filter: &Conditions, truth: &Conditions, scheme: &Scheme, runs: usize) -> Vec<Statistic> {
    let plan = |c: &Conditions| Plan::new(scheme, c).expect("a plan");
    let (filter_plan, truth_plan) = (plan(filter), plan(truth));
    let experiment = MonteCarloExperiment {
        filter: &filter_plan,
        truth: &truth_plan,
        conditions: truth,
        null_space: None,
        seed: 5,
    };
    let prepared = PreparedExperiment::new(experiment).expect("prepared");
    prepared.statistics(&prepared.run(runs, &|_| true))
}

/// With the noise states in filter and truth, ANEES and NIS lie in their 99.9 % bands; with the noise in the
/// truth only, both are far above. Cases: linear truth, exact truth (drifts small enough for the linear
/// filter), slews and a rotating segment.
#[test]
#[ignore = "seconds: .ci/run release"]
fn monte_carlo_with_the_states_in_filter_and_truth() {
    states_in_filter_and_truth(RUNS[0]);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn monte_carlo_at_length() {
    states_in_filter_and_truth(RUNS[1]);
    biases_of_the_accelerometers(RUNS[1]);
}

fn states_in_filter_and_truth(runs: usize) {
    let two = scheme(&["0,0,0", "180,0,0"], Carry::Platform);
    let mut turning = scheme(&["10,25,40", "130,-50,70"], Carry::Inertial);
    turning.positions[1].rotation = Some(Rotation::new("Y_p", "140").expect("a rotation"));
    let both = noisy(datasheet());
    let exact = Conditions {
        truth: Truth::Exact,
        drift_scale: 1e-3,
        priors: [both.priors.clone(), vec![Assignment { name: "psi".into(), value: 1e-4 }]].concat(),
        ..both.clone()
    };
    let slews = |c: &Conditions| Conditions { slew_rate_deg_s: Some(2.0), ..c.clone() };
    for (name, scheme, conditions) in [
        ("linear", &two, both.clone()),
        ("exact", &two, exact.clone()),
        ("linear, slews", &turning, slews(&both)),
        ("exact, slews", &turning, slews(&exact)),
    ] {
        let right = statistics(&conditions, &conditions, scheme, runs);
        assert_eq!(
            right.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(),
            ["ANEES, 15 unknowns and 4 biases", "NIS"]
        );
        assert!(right.iter().all(|s| s.pass), "{name}: {right:?}");
        let wrong = statistics(&conditions.clone().without_drift_noise(), &conditions, scheme, runs);
        assert!(wrong.iter().all(|s| s.measured > 2.0 * s.wide_band.to), "{name}: {wrong:?}");
    }
}

/// Monte Carlo runs with biases of the accelerometers that are large against their white noise.
#[test]
#[ignore = "seconds: .ci/run"]
fn monte_carlo_with_biases_of_the_accelerometers() {
    biases_of_the_accelerometers(RUNS[0]);
}

fn biases_of_the_accelerometers(runs: usize) {
    let two = scheme(&["0,0,0", "180,0,0"], Carry::Platform);
    let mut turning = scheme(&["10,25,40", "130,-50,70"], Carry::Inertial);
    turning.positions[1].rotation = Some(Rotation::new("Y_p", "140").expect("a rotation"));
    let quiet = Conditions::default().without_drift_noise();
    let both = Conditions {
        accelerometer_instability_ug: 30.0,
        accelerometer_correlation_s: 200.0,
        ..quiet.clone()
    };
    let exact = Conditions {
        truth: Truth::Exact,
        drift_scale: 1e-3,
        priors: [both.priors.clone(), vec![Assignment { name: "psi".into(), value: 1e-4 }]].concat(),
        ..both.clone()
    };
    let slews = |c: &Conditions| Conditions { slew_rate_deg_s: Some(2.0), ..c.clone() };
    for (name, scheme, conditions) in [
        ("linear", &two, both.clone()),
        ("exact", &two, exact.clone()),
        ("linear, slews", &turning, slews(&both)),
        ("exact, slews", &turning, slews(&exact)),
    ] {
        let right = statistics(&conditions, &conditions, scheme, runs);
        assert_eq!(
            right.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(),
            ["ANEES, 15 unknowns and 3 biases", "NIS"]
        );
        assert!(right.iter().all(|s| s.pass), "{name}: {right:?}");
        let wrong = statistics(&conditions.clone().without_drift_noise(), &conditions, scheme, runs);
        assert!(wrong.iter().all(|s| s.measured > 2.0 * s.wide_band.to), "{name}: {wrong:?}");
    }
    // a filter with full attitudes has the same sigmas for small psi and drifts, and consistent innovations
    let small = Conditions {
        values: [exact.values.clone(), vec![Assignment { name: "psi".into(), value: 1e-4 }]].concat(),
        ..slews(&exact)
    };
    let extended = Conditions { filter: Some(FilterKind::Extended), ..small.clone() };
    let linear = Conditions { filter: Some(FilterKind::Linear), ..small };
    let mut nis = 0.0f64;
    for seed in 0..20 {
        let (run, _) = simulate(&turning, &extended, seed).expect("simulated");
        let (other, _) = simulate(&turning, &linear, seed).expect("simulated");
        for (a, b) in run.quantities.iter().zip(&other.quantities) {
            assert!((a.sigma / b.sigma - 1.0).abs() < 1e-2, "{}: {} {}", a.name, a.sigma, b.sigma);
        }
        nis += run.consistency.nis / 20.0;
    }
    assert!((nis - 2.0).abs() < 0.1, "{nis}");
    let refused = Conditions { accelerometer_instability_ug: 1e10, ..quiet };
    let refused = simulate(&two, &refused, 1).expect_err("refused").to_string();
    assert!(refused.starts_with("accelerometer_bias_instability_ug is"), "{refused}");
}

/// Noise of a single gyro acts about its input axis only, whatever its mounting.
#[test]
fn noise_of_one_gyro_is_about_its_input_axis() {
    let mut mounted = scheme(&["0,0,0"], Carry::Platform);
    let axes = |i: &str, o: &str, s: &str| {
        let axis = |t: &str| t.parse().expect("an axis");
        obsdeg_core::model::GyroAxes { I: axis(i), O: axis(o), S: axis(s) }
    };
    mounted.geometry.X = axes("-y", "+x", "+z");
    mounted.geometry.Y = axes("+x", "-z", "+y");
    let of_x = GyroNoise { rate_random_walk_dph_sqrt_h: PerGyro([1.0, 0.0, 0.0]), ..GyroNoise::default() };
    let plan = Plan::new(&mounted, &noisy(of_x)).expect("a plan");
    assert_eq!(plan.biases.len(), 1);
    let phi = plan.stages[0].transition.matrix();
    let by_bias = [0, 1, 2].map(|i| phi[(i, 15)]);
    assert!(
        (by_bias[1] + 10.0).abs() < 1e-5 && by_bias[0].abs() < 1e-2 && by_bias[2].abs() < 1e-2,
        "{by_bias:?}"
    );
    // like D_FX
    for i in 0..3 {
        assert!((phi[(i, 3)] - by_bias[i]).abs() < 1e-12, "{i}");
    }
}

/// An angle random walk replaces the random drift unless both are given in the same place; settings that are
/// not given do not change.
#[test]
fn conditions_by_file_and_options() {
    let walk = Settings { angle_random_walk_deg_sqrt_h: Some(PerGyro::all(0.002)), ..Settings::default() };
    let drift = Settings { drift_noise: "0.01 deg/h".parse().ok(), ..Settings::default() };
    let of = |settings: &[&Settings]| {
        let mut out = Conditions::default();
        settings.iter().for_each(|s| out.apply(s));
        (out.drift_noise.amount(), out.gyro_noise.angle_random_walk_deg_sqrt_h.0[0])
    };
    assert_eq!(of(&[]), (0.01, 0.0));
    assert_eq!(of(&[&walk]), (0.0, 0.002));
    assert_eq!(of(&[&drift, &walk]), (0.0, 0.002));
    assert_eq!(of(&[&walk, &drift]), (0.01, 0.002));
    assert_eq!(of(&[&Settings { drift_noise: drift.drift_noise, ..walk.clone() }]), (0.01, 0.002));
    for wrong in [f64::NAN, -1.0, 1e7] {
        let conditions =
            noisy(GyroNoise { bias_instability_dph: PerGyro([0.0, wrong, 0.0]), ..GyroNoise::default() });
        let refused = simulate(&paper(Carry::Platform), &conditions, 1).expect_err("refused").to_string();
        assert!(refused.starts_with("bias_instability_dph is"), "{refused}");
    }
}

/// The white drift of a datasheet equals the random drift of the same density.
#[test]
fn angle_random_walk_is_white_drift() {
    let walk = noisy(GyroNoise { angle_random_walk_deg_sqrt_h: PerGyro::all(0.002), ..GyroNoise::default() });
    let drift =
        Conditions { drift_noise: "0.002 deg/sqrt(h)".parse().expect("a drift"), ..Conditions::default() };
    let (a, b) = (simulated(Carry::Inertial, &walk), simulated(Carry::Inertial, &drift));
    for (a, b) in a.quantities.iter().zip(&b.quantities) {
        assert!((a.sigma / b.sigma - 1.0).abs() < 1e-5, "{} {}", a.sigma, b.sigma);
    }
}

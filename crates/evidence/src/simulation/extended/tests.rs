//! Tests of the filter with full attitudes.

use nalgebra::DVector;
use obsdeg_core::model::settings::{DriftNoise, Truth};
use obsdeg_core::model::{Path, Rotation, Scheme, parse_attitude};
use obsdeg_ekf::Manifold;
use obsdeg_exact::SplitMix64;

use super::*;
use crate::simulation::truth::{Noise, TruthModel};
use obsdeg_ekf::Measurement;
use obsdeg_ekf::Motion;

/// Plan of three positions, the middle one rotating, with terms of every order, and slews if `slew` has a
/// rate.
fn plan((carry, slew, azimuth, terms): (Carry, Option<f64>, bool, &str)) -> (Plan, Conditions) {
    let attitudes =
        ["10,25,40", "130,-50,70", "-95,33,-160"].map(|a| parse_attitude(a).expect("an attitude"));
    let mut scheme = Scheme { carry, measured_azimuth: azimuth, ..Scheme::of_angles(attitudes) };
    scheme.unknowns = terms.parse().expect("terms");
    // torquer errors need exact turns
    scheme.path = (terms != GYROS).then_some(Path::Gimbals);
    if terms == GYROS {
        scheme.positions[1].rotation = Some(Rotation::new("Y_p", "140").expect("a rotation"));
    }
    let conditions = Conditions {
        truth: Truth::Exact,
        slew_rate_deg_s: slew,
        dwell_s: 300.0,
        step_s: 60.0,
        drift_noise: DriftNoise::OneStep(0.0),
        accelerometer_noise_g: 1e-15,
        azimuth_noise_deg: 1e-12,
        ..Conditions::default()
    };
    (Plan::new(&scheme, &conditions).expect("a plan"), conditions)
}

const GYROS: &str = "F,I,O,S,II,SS,IO";
const CASES: [(Carry, Option<f64>, bool, &str); 8] = [
    (Carry::Platform, None, false, GYROS),
    (Carry::Inertial, None, true, GYROS),
    (Carry::Reset, None, false, GYROS),
    (Carry::Inertial, Some(1.0), false, GYROS),
    (Carry::Inertial, Some(0.3), true, GYROS),
    (Carry::Inertial, Some(1.0), true, "F,I,O,S,GS,GM,K0,K1,M6,K2,K3,Kx"),
    (Carry::Platform, None, false, "all"),
    (Carry::Reset, None, true, "F,SS,GS,GM3,K0,M3,Kx"),
];

fn random(plan: &Plan, rng: &mut SplitMix64, psi: f64, drift: f64) -> Vec<f64> {
    let mut next = |scale: f64| scale * (2.0 * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 1.0);
    plan.platform.units().iter().map(|u| next(if *u == "rad" { psi } else { drift })).collect()
}

/// Phi and H are the derivatives of motion and output, far from zero, for every kind of segment.
#[test]
fn jacobians_are_derivatives() {
    let mut rng = SplitMix64::new(3);
    for case in CASES {
        let (carry, (plan, conditions)) = (case.0, plan(case));
        let filter = ExtendedFilter::new(&plan, &conditions, Update::default()).expect("coefficients");
        let n = plan.states();
        for segment in 0..plan.segments.len() {
            let motion = filter.motion(segment);
            let x = PlatformState::of_unknowns(&random(&plan, &mut rng, 0.3, 1e-4), plan.constants());
            let dt = plan.segments[segment].dt;
            let moved = |x: &PlatformState| {
                let mut y = x.clone();
                let phi = motion.advance(0.0, dt, &mut y).expect("finite").0;
                (y, phi)
            };
            let (end, phi) = moved(&x);
            let (phi, h) = (phi.matrix(), Measurement::jacobian(&motion, 0.0, &end));
            for j in 0..n {
                let size = if plan.platform.units()[j] == "rad" { 1e-5 } else { 1e-8 };
                let at = |from: &PlatformState, sign: f64| {
                    let mut delta = vec![0.0; n];
                    delta[j] = sign * size;
                    let mut y = from.clone();
                    y.retract(&delta);
                    y
                };
                let ends = [1.0, -1.0].map(|s| DVector::from_vec(moved(&at(&x, s)).0.local(&end)));
                let found = (&ends[0] - &ends[1]) / (2.0 * size);
                let scale = phi.column(j).amax().max(1.0);
                assert!((found - phi.column(j)).amax() < 1e-7 * scale, "{carry} {segment}: Phi, {j}");
                let seen = [1.0, -1.0].map(|s| motion.h(0.0, &at(&end, s)));
                let found = (&seen[0] - &seen[1]) / (2.0 * size);
                assert!((found - h.column(j)).amax() < 1e-8, "{carry} {segment}: H, {j}");
            }
        }
    }
}

/// At zero the Jacobians equal those of the linear model of the verdicts, which has its own code for
/// (1)-(6) and the carries.
#[test]
fn at_zero_it_is_the_linear_model() {
    for case in CASES {
        let (carry, (plan, conditions)) = (case.0, plan(case));
        let filter = ExtendedFilter::new(&plan, &conditions, Update::default()).expect("coefficients");
        let n = plan.states();
        let zero = PlatformState::of_unknowns(&vec![0.0; n], plan.constants());
        for (segment, stage) in plan.segments.iter().zip(&plan.stages).enumerate().map(|(i, (_, s))| (i, s)) {
            let motion = filter.motion(segment);
            let phi = motion.advance(0.0, plan.segments[segment].dt, &mut zero.clone()).expect("finite").0;
            let difference = phi.matrix() - stage.transition.matrix();
            assert!(difference.amax() < 1e-9, "{carry} {segment}: {:e}", difference.amax());
            let h = Measurement::jacobian(&motion, 0.0, &zero);
            for (i, output) in stage.outputs.iter().enumerate() {
                let mut row = DVector::zeros(n);
                output.h.iter().for_each(|&(j, c)| row[j] += c);
                assert!((row - h.row(i).transpose()).amax() < 1e-14, "{carry} {segment}: output {i}");
            }
        }
    }
}

/// Motion and output equal those of the exact truth, step by step, for large drifts.
#[test]
fn it_goes_with_the_exact_truth() {
    let mut rng = SplitMix64::new(5);
    for case in CASES {
        let (carry, (plan, conditions)) = (case.0, plan(case));
        let filter = ExtendedFilter::new(&plan, &conditions, Update::default()).expect("coefficients");
        let start = random(&plan, &mut rng, 0.02, 6e-5);
        let mut truth = TruthModel::new(&plan, &conditions, start.clone());
        let mut x = PlatformState::of_unknowns(&start, plan.constants());
        let mut noise = Noise::new(1, 0);
        for (segment, s) in plan.segments.iter().enumerate() {
            let motion = filter.motion(segment);
            for i in 0..s.steps {
                let mut z = vec![0.0; plan.stages[segment].outputs.len()];
                truth.step(segment, i, &mut noise, &mut z);
                motion.advance(i as f64 * s.dt, s.dt, &mut x).expect("finite");
                let far = x.unknowns().iter().zip(truth.x()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(far < 1e-11, "{carry} {segment}: {far:e}");
                for (z, h) in z.iter().zip(motion.h(0.0, &x).iter()) {
                    assert!((z - h).abs() < 1e-11, "{carry} {segment}: {z} {h}");
                }
            }
        }
        // with fewer drifts psi stays about constant
        assert!(truth.largest_psi > if case.3 == GYROS { 0.03 } else { 0.01 }, "something moved");
    }
}

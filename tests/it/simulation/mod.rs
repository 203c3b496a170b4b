//! The filter against a simulated truth: the paper's run, other carries, exact truth, slews.

mod command;
mod floor;
mod gyro_noise;
mod quaternion;

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::settings::{Assignment, DriftNoise, FilterKind, Propagation, Settings, Truth};
use obsdeg_core::model::{Carry, Rotation, Scheme};
use obsdeg_ekf::Process;
use obsdeg_ekf::model::central_difference;
use obsdeg_evidence::simulation::{
    Conditions, Doubt, Estimate, FilterReason, FilterReport, Noise, Outcome, Plan, PlatformProcess, RunStart,
    Simulation, SimulationError, TruthModel, simulate,
};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;

use crate::program::{run, stderr, stdout};
use crate::schemes::{paper, scheme};

const W_N_DPH: f64 = 7.292115e-5 * 180.0 / std::f64::consts::PI * 3600.0;

fn simulated(carry: Carry, conditions: &Conditions) -> Simulation {
    simulate(&paper(carry), conditions, 1).expect("simulated").0
}

fn of<'a>(s: &'a Simulation, name: &str) -> &'a Estimate {
    s.quantities.iter().find(|q| q.name == name).expect("an unknown")
}

#[test]
fn the_papers_run() {
    let s = simulated(Carry::Platform, &Conditions::default());
    let fast = ["D_FX", "D_SX", "D_SZ"].map(|name| of(&s, name));
    for q in fast {
        assert!(q.sigma < 0.005 && q.error_over_sigma.abs() < 4.0, "{q:?}");
    }
    for slow in ["D_FY", "D_IY"].map(|name| of(&s, name)) {
        for q in fast {
            let ratio = slow.sigma / q.sigma;
            assert!((10.0..1000.0).contains(&ratio), "{} over {}: {ratio}", slow.name, q.name);
        }
    }
    // D_FZ is off by wN psi_y(0), within four sigma of the observable combination
    let w_n = W_N_DPH * 28.2f64.to_radians().cos();
    let combination = s.combinations.iter().find(|c| c.name == "D_FZ - wN*psi_y").expect("a combination");
    let off = w_n * 0.1f64.to_radians();
    assert!((of(&s, "D_FZ").error + off).abs() < 4.0 * combination.sigma, "{combination:?}");
    assert!(s.consistency.consistent);
}

/// An undetermined unknown is never called reached or converging, even if a narrow prior makes its sigma
/// small: in the answer, in every format and in the figures.
#[test]
fn what_is_not_observable_is_known_from_the_prior_only() {
    // a prior that meets every requirement by itself
    let tight = |name: &str, value| Assignment { name: name.into(), value };
    let known = Conditions {
        priors: [Conditions::default().priors, vec![tight("psi", 0.001), tight("D", 0.01)]].concat(),
        values: vec![tight("D", 0.005)],
        ..Conditions::default()
    };
    // requirements stated as by an option, with and without stated priors
    let required =
        |c: Conditions| Conditions { requirements: vec![tight("D", 0.1), tight("psi", 0.01)], ..c };
    for conditions in [required(Conditions::default()), required(known)] {
        for carry in Carry::ALL {
            let s = simulated(carry, &conditions);
            let lost = s.quantities.iter().chain(&s.combinations).filter(|q| q.degree.is_none());
            for q in lost {
                assert_eq!(
                    (q.outcome, q.time_to_requirement_s),
                    (Outcome::PriorOnly, None),
                    "{carry}: {q:?}"
                );
            }
            for q in s.quantities.iter().filter(|q| q.degree.is_some()) {
                assert_ne!(q.outcome, Outcome::PriorOnly, "{carry}: {q:?}");
            }
            // the run misses their requirements, whatever sigma is
            let unseen = s.quantities.iter().filter(|q| q.degree.is_none()).count();
            let run = &s.run.requirements;
            assert_eq!(
                (run.stated, run.met),
                (15 + 3 * usize::from(carry == Carry::Reset), {
                    // a stated prior bounds undetermined unknowns, in the run as in the prediction
                    let by_prior = |q: &Estimate| {
                        q.outcome == Outcome::PriorOnly
                            && q.predicted_sigma.is_some()
                            && Some(q.sigma) <= q.required_sigma
                    };
                    s.quantities.iter().filter(|q| q.outcome == Outcome::Reached || by_prior(q)).count()
                })
            );
            let bounded =
                s.quantities.iter().filter(|q| q.degree.is_none() && q.predicted_sigma.is_some()).count();
            assert!(run.missed.len() + bounded >= unseen && unseen > 0);
            // missed by prediction too, unless stated priors bound them, which the answer says
            for q in s.quantities.iter().filter(|q| q.degree.is_none()) {
                let missed = s.requirements.missed.iter().any(|m| m.name == q.name);
                let on_prior = s.requirements.on_prior.contains(&q.name);
                assert_eq!((q.predicted_sigma.is_none(), on_prior), (missed, !missed), "{carry}: {q:?}");
            }
        }
    }
    // sigma of the paper's D_FZ meets its requirement only because of the prior of psi
    let d_fz = of(&simulated(Carry::Platform, &required(Conditions::default())), "D_FZ").clone();
    assert!(d_fz.required_sigma.is_some_and(|r| d_fz.sigma < r) && d_fz.outcome == Outcome::PriorOnly);
    let output = run(&[&P1P2[..], &["--requirement", "D=0.1", "--format", "json"]].concat());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let of_json = |name: &str| {
        let list = json["quantities"].as_array().expect("a list");
        list.iter().find(|q| q["name"] == name).expect("an unknown")["outcome"].clone()
    };
    assert_eq!((of_json("D_FZ"), of_json("D_FY")), ("prior_only".into(), "reached".into()));
    let (_, record) = simulate(&paper(Carry::Platform), &Conditions::default(), 1).expect("simulated");
    let files = obsdeg_report::simulation_figures(&record.traces).expect("figures");
    let title = |name: &str| {
        let file = files.iter().find(|f| f.name == format!("{name}.svg")).expect("a figure");
        String::from_utf8_lossy(&file.bytes).contains("known from the prior only")
    };
    assert_eq!(["D_FZ", "psi_y", "D_OX", "D_FX", "psi_x"].map(title), [true, true, true, false, false]);
}

/// At the pole, unobservable drift about the vertical turns psi: psi_z is observable at the start and lost at
/// the end. psi_y at the start is never determined although a derivative of order 0 shows it.
#[test]
fn psi_at_the_end_is_what_a_run_shows() {
    let pole =
        Scheme { latitude: "90".parse().ok(), ..scheme(&["0,0,0", "0,90,0", "45,0,0"], Carry::Platform) };
    let (s, _) = simulate(&pole, &Conditions::default(), 1).expect("simulated");
    let verdicts = ["psi_x", "psi_y", "psi_z"].map(|name| {
        let q = of(&s, name);
        (q.degree, q.accuracy_order, q.outcome)
    });
    assert_eq!(
        verdicts,
        [
            (Some(0), Some(0), Outcome::Determined),
            (Some(0), None, Outcome::PriorOnly),
            (Some(0), Some(0), Outcome::PriorOnly)
        ]
    );
}

/// A truth with six errors of three prior sigmas: each is plausible alone, together they are not.
#[test]
fn consistency_takes_all_errors_together() {
    let unseen = ["D_IX", "D_IZ", "D_OX", "D_OY", "D_OZ", "D_SY"];
    let far = |name: &&str| Assignment { name: name.to_string(), value: 30.0 };
    let values = [Conditions::default().values, unseen.iter().map(far).collect()].concat();
    let s = simulated(Carry::Platform, &Conditions { values, ..Conditions::default() });
    assert!(s.quantities.iter().all(|q| q.error_over_sigma.abs() <= 3.0));
    // six times nine, and the rest
    assert!(s.consistency.nees > 54.0 && s.consistency.doubts == [Doubt::Nees], "{:?}", s.consistency);
    assert!(!s.consistency.consistent);
    let given: Vec<String> = unseen.iter().map(|name| format!("--value={name}=30")).collect();
    let output = run(&P1P2.into_iter().chain(given.iter().map(String::as_str)).collect::<Vec<_>>());
    let text = stdout(&output).replace("\n      ", " ");
    assert!(text.contains("the filter is NOT consistent with this truth: NEES"), "{text}");
    assert!(text.contains("Do not use the filter's sigmas"), "{text}");
    // exact truth at the paper's drifts: every test fails
    let linear = Some(FilterKind::Linear);
    let exact = Conditions { truth: Truth::Exact, filter: linear, ..Conditions::default() };
    let exact = simulated(Carry::Platform, &exact);
    for doubt in [Doubt::Nis, Doubt::Nees, Doubt::Error, Doubt::Correlated] {
        assert!(exact.consistency.doubts.contains(&doubt), "{doubt:?}: {:?}", exact.consistency);
    }
}

/// A bias held for one step has another density with other steps: the answer states the density, and warns if
/// only the step was changed.
#[test]
fn random_drift_has_a_density() {
    let of = |settings: &[Settings]| {
        let mut conditions = Conditions::default();
        settings.iter().for_each(|s| conditions.apply(s));
        simulated(Carry::Platform, &conditions).conditions
    };
    let step = |step_s: f64| Settings { step_s: Some(step_s), ..Settings::default() };
    let noise = |text: &str| Settings { drift_noise: text.parse().ok(), ..Settings::default() };
    let near = |found: [f64; 2], expected: f64| found.iter().all(|x| (x / expected - 1.0).abs() < 1e-9);
    // an angle of 0.01 deg/h times 10 s, 360 of them per hour: 0.01/360 sqrt(360) deg
    let default = of(&[]);
    assert!(
        near(default.drift_noise_density_deg_sqrt_h, 0.01 / 360f64.sqrt()) && !default.drift_noise_differs
    );
    let finer = of(&[step(1.0)]);
    assert!(near(finer.drift_noise_density_deg_sqrt_h, 0.01 / 3600f64.sqrt()) && finer.drift_noise_differs);
    assert_eq!(finer.drift_noise_step_s, Some(10.0));
    // stated with its step, or after it: no warning; a later change of the step: a warning
    let both = Settings { drift_noise: "0.01 deg/h".parse().ok(), ..step(1.0) };
    assert!(!of(std::slice::from_ref(&both)).drift_noise_differs);
    assert!(!of(&[step(1.0), noise("0.01 deg/h")]).drift_noise_differs);
    assert!(of(&[both, step(2.0)]).drift_noise_differs);
    // a dwell that is no multiple of the step is divided into equal steps
    let uneven = Settings { dwell_s: Some(25.0), ..Settings::default() };
    assert!(of(&[uneven]).drift_noise_differs);
    // stated as a density
    let walk = of(&[noise("5.27e-4 deg/sqrt(h)"), step(1.0)]);
    assert!(near(walk.drift_noise_density_deg_sqrt_h, 5.27e-4) && !walk.drift_noise_differs);
    assert_eq!(walk.drift_noise_step_s, None);
    assert!(!of(&[noise("0 deg/h"), step(1.0)]).drift_noise_differs);
    for (arguments, warned) in
        [(&[][..], false), (&["--step", "1"], true), (&["--step", "1", "--drift-noise", "0.01 deg/h"], false)]
    {
        let output = run(&[&P1P2[..], arguments].concat());
        let text = stdout(&output);
        assert_eq!(text.contains("warning: the random drift"), warned, "{arguments:?}: {text}");
        assert!(text.contains("deg/sqrt(h)"));
    }
}

#[test]
fn inertial_carry_swaps_the_inseparable_coefficient() {
    let s = simulated(Carry::Inertial, &Conditions::default());
    assert!(of(&s, "D_FZ").sigma < 0.005 && of(&s, "D_SZ").sigma > 0.01);
    let p = simulated(Carry::Platform, &Conditions::default());
    assert!(of(&p, "D_SZ").sigma < 0.005 && of(&p, "D_FZ").sigma > 0.01);
}

#[test]
fn exact_truth_breaks_the_linear_filter_and_it_is_said_why() {
    let chosen = Conditions { truth: Truth::Exact, ..Conditions::default() };
    let exact = Conditions { filter: Some(FilterKind::Linear), ..chosen.clone() };
    for carry in [Carry::Platform, Carry::Inertial] {
        let s = simulated(carry, &exact);
        assert!(s.consistency.nis > 20.0 && !s.consistency.consistent && !s.validity.holds, "{carry}");
        assert!(s.validity.neglected_g > 100.0 * s.validity.accelerometer_noise_g);
    }
    assert!(of(&simulated(Carry::Platform, &exact), "D_FY").error.abs() > 5.0);
    let small = Conditions { drift_scale: 1e-3, ..exact.clone() };
    let s = simulated(Carry::Inertial, &small);
    assert!(s.consistency.consistent && s.validity.holds, "{:?} {:?}", s.consistency, s.validity);
    // by default the program chooses a filter that follows the truth, and shows the linear one beside it
    let FilterReport { kind, reason, .. } =
        simulated(Carry::Inertial, &Conditions { filter: None, ..small }).filter;
    assert_eq!((kind, reason), (FilterKind::Linear, FilterReason::Valid));
    let asked = simulated(Carry::Platform, &exact);
    assert!(
        asked.filter.reason == FilterReason::Given && asked.quantities.iter().all(|q| q.linear.is_none())
    );
    for carry in [Carry::Platform, Carry::Inertial] {
        let s = simulated(carry, &chosen);
        let FilterReport { kind, reason, passes, converged, trusted } = s.filter;
        assert_eq!((kind, reason, converged), (FilterKind::Iterated, FilterReason::NotValid, true));
        assert!(trusted);
        assert!(s.consistency.consistent && passes > 1, "{carry}: {:?}", s.consistency);
        let d_fy = of(&s, "D_FY");
        assert!(d_fy.error_over_sigma.abs() < 3.0 && (0.5..1.0).contains(&d_fy.sigma), "{carry}: {d_fy:?}");
        // the linear filter has a small sigma and a large error
        let linear = d_fy.linear.expect("beside it");
        let alone = simulated(carry, &exact);
        assert_eq!((linear.error, linear.sigma), (of(&alone, "D_FY").error, of(&alone, "D_FY").sigma));
        assert!(
            linear.error.abs() > 20.0 * linear.sigma && linear.sigma < d_fy.sigma / 5.0,
            "{carry}: {linear:?}"
        );
    }
    let s = simulated(Carry::Platform, &chosen);
    assert_eq!(of(&s, "D_IX").outcome, Outcome::LargeAnglesOnly);
    assert!(of(&s, "D_FX").sigma > 10.0 * of(&s, "D_FX").linear.expect("beside it").sigma);
}

/// For small drifts the three filters agree.
#[test]
fn for_small_drifts_all_filters_agree() {
    for carry in Carry::ALL {
        let small = Conditions { truth: Truth::Exact, drift_scale: 1e-3, ..Conditions::default() };
        let values = [small.values.clone(), vec![Assignment { name: "psi".into(), value: 1e-4 }]].concat();
        let priors = [small.priors.clone(), vec![Assignment { name: "psi".into(), value: 1e-4 }]].concat();
        let small = Conditions { values, priors, ..small };
        let [linear, extended, iterated] =
            FilterKind::ALL.map(|f| simulated(carry, &Conditions { filter: Some(f), ..small.clone() }));
        for other in [&extended, &iterated] {
            for (a, b) in linear.quantities.iter().zip(&other.quantities) {
                assert!(
                    (b.sigma / a.sigma - 1.0).abs() < 0.01,
                    "{carry} {}: {} {}",
                    a.name,
                    a.sigma,
                    b.sigma
                );
                assert!((b.estimate - a.estimate).abs() < 0.01 * a.sigma, "{carry} {}", a.name);
            }
            assert!((other.consistency.nis / linear.consistency.nis - 1.0).abs() < 0.01, "{carry}");
        }
    }
}

/// Without noise and for tiny angles, exact and linear truth agree, position by position and through slews,
/// under every carry: two independent derivations of (2), (6) and of the carries.
#[test]
fn exact_truth_is_the_linear_one_for_small_angles() {
    let attitudes = ["10,25,40", "130,-50,70", "-95,33,-160"];
    for (carry, slew) in
        [(Carry::Platform, None), (Carry::Inertial, None), (Carry::Reset, None), (Carry::Inertial, Some(2.0))]
    {
        let mut scheme = scheme(&attitudes, carry);
        // the middle position rotates
        scheme.positions[1].rotation = Some(Rotation::new("Y_p", "140").expect("a rotation"));
        let conditions = |truth| Conditions {
            truth,
            slew_rate_deg_s: slew,
            drift_noise: DriftNoise::OneStep(0.0),
            accelerometer_noise_g: 1e-15,
            drift_scale: 1e-4,
            values: [Conditions::default().values, vec![Assignment { name: "psi".into(), value: 1e-5 }]]
                .concat(),
            dwell_s: 500.0,
            ..Conditions::default()
        };
        let (linear, exact) = (conditions(Truth::Linear), conditions(Truth::Exact));
        let plan = Plan::new(&scheme, &linear).expect("a plan");
        let start = RunStart::new(&plan, &linear).expect("a start").truth;
        let mut truths = [&linear, &exact].map(|c| TruthModel::new(&plan, c, start.clone()));
        let mut largest = 0f64;
        for (i, segment) in plan.segments.iter().enumerate() {
            for step in 0..segment.steps {
                let mut z = [[0.0; 2]; 2];
                let outputs = plan.stages[i].outputs.len();
                for (truth, z) in truths.iter_mut().zip(&mut z) {
                    truth.step(i, step, &mut Noise::new(1, 0), &mut z[..outputs]);
                }
                for (a, b) in z[0].iter().zip(&z[1]) {
                    assert!((a - b).abs() < 3e-11, "{carry}: Z {a:e} {b:e}");
                    largest = largest.max(a.abs());
                }
                for (a, b) in truths[0].x().iter().zip(truths[1].x()) {
                    assert!(
                        (a - b).abs() < 3e-11,
                        "{carry} {slew:?} segment {i} step {step}: {a:e} {b:e} {:?} {:?}",
                        truths[0].x(),
                        truths[1].x()
                    );
                }
            }
        }
        assert!(largest > 1e-7, "something moved: {largest:e}");
    }
}

#[test]
fn jacobians_of_the_platform_are_derivatives() {
    let scheme = scheme(&["10,25,40", "130,-50,70"], Carry::Inertial);
    let conditions = Conditions { slew_rate_deg_s: Some(1.0), ..Conditions::default() };
    let plan = Plan::new(&scheme, &conditions).expect("a plan");
    let n = plan.unknowns();
    let x = DVector::from_fn(n, |i, _| (i as f64 + 1.0) * 1e-3);
    let step = DVector::from_element(n, 1e-4);
    for segment in 0..plan.segments.len() {
        let process = PlatformProcess { plan: &plan, segment };
        for t in [0.0, 17.0] {
            let by_differences = central_difference(|x| process.f(t, x), &x, &step);
            let difference: DMatrix<f64> = by_differences - process.jacobian(t, &x);
            assert!(difference.amax() < 1e-9, "segment {segment}");
        }
    }
}

#[test]
fn runge_kutta_and_the_exponential_agree() {
    let rk4 = Conditions { propagation: Propagation::Rk4, ..Conditions::default() };
    let (a, b) = (simulated(Carry::Platform, &rk4), simulated(Carry::Platform, &Conditions::default()));
    for (a, b) in a.quantities.iter().zip(&b.quantities) {
        assert!(
            (a.sigma / b.sigma - 1.0).abs() < 1e-6
                && (a.estimate - b.estimate).abs() < 1e-4 * a.sigma.max(1.0)
        );
    }
}

/// The noise of a drift held over a step is that of `(integral of exp(W t)) eps`, for any step length.
/// Reference: Simpson's rule on the closed form of a rotation.
#[test]
fn held_drift_noise_of_any_step() {
    for dt in [1.0, 10.0, 3000.0, 50_000.0] {
        let scheme = scheme(&["0,0,0"], Carry::Platform);
        let conditions = Conditions {
            drift_noise: DriftNoise::OneStep(1.0),
            step_s: dt,
            dwell_s: dt,
            ..Conditions::default()
        };
        let plan = Plan::new(&scheme, &conditions).expect("a plan");
        let w = plan.earth_rate();
        let rate = w.iter().map(|x| x * x).sum::<f64>().sqrt();
        let axis = w.map(|x| x / rate);
        // psi' = psi x w: exp(W t) turns by -w t
        let turned = |t: f64| -> [[f64; 3]; 3] {
            let (s, c) = (-rate * t).sin_cos();
            let cross = [[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]];
            std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    f64::from(u8::from(i == j)) * c + s * cross[i][j] + (1.0 - c) * axis[i] * axis[j]
                })
            })
        };
        let n = 2000;
        let mut integral = [[0.0; 3]; 3];
        for k in 0..=n {
            let weight = if k == 0 || k == n {
                1.0
            } else if k % 2 == 1 {
                4.0
            } else {
                2.0
            };
            let m = turned(dt * f64::from(k) / f64::from(n));
            for i in 0..3 {
                for j in 0..3 {
                    integral[i][j] += weight * m[i][j] * dt / f64::from(n) / 3.0;
                }
            }
        }
        let held = 1f64.to_radians() / 3600.0;
        let root = &plan.noise_roots[0];
        for i in 0..3 {
            for j in 0..3 {
                let found: f64 = (0..3).map(|k| root[(i, k)] * root[(j, k)]).sum();
                let expected: f64 =
                    (0..3).map(|k| integral[i][k] * integral[j][k]).sum::<f64>() * held * held;
                assert!(
                    (found - expected).abs() < 1e-9 * dt * dt * held * held,
                    "{dt}: {found:e} {expected:e}"
                );
            }
        }
    }
}

/// An exact truth uses as many integration steps as its drifts need; too many steps are refused.
#[test]
fn large_drifts_of_an_exact_truth() {
    let large = |d: f64| Conditions {
        truth: Truth::Exact,
        values: vec![Assignment { name: "D_FX".into(), value: d }],
        drift_noise: DriftNoise::OneStep(0.0),
        accelerometer_noise_g: 1e-12,
        step_s: 100.0,
        dwell_s: 1000.0,
        ..Conditions::default()
    };
    // D_FX turns the platform about X_p, N: after t seconds Z3 = -sin of the angle, for any step
    let (_, record) = simulate(&scheme(&["0,0,0"], Carry::Platform), &large(20_000.0), 1).expect("a run");
    let psi = record.traces.series[0].truth.last().copied().expect("an end");
    let drift = 20_000f64.to_radians() / 3600.0 * 1000.0;
    let turns = (drift - psi) / std::f64::consts::TAU;
    assert!((turns - turns.round()).abs() < 0.01, "{psi} {drift}");
    let scale = Conditions { drift_scale: 1e6, ..large(1e6) };
    let refused = simulate(&paper(Carry::Platform), &scale, 1).expect_err("too many");
    assert!(matches!(refused, SimulationError::TooManySteps { .. }), "{refused}");
}

/// Every number of steps is checked in floating point before its first use.
#[test]
fn counts_of_steps_that_cannot_be() {
    let refused = |scheme: &Scheme, step_s: f64| {
        let conditions = Conditions { step_s, ..Conditions::default() };
        Plan::derived(scheme, &conditions).expect_err("too many").to_string()
    };
    let mut turning = scheme(&["0,0,0"], Carry::Platform);
    turning.positions[0].rotation = Some(Rotation::new("X_p", "360").expect("a rotation"));
    // 2^64 steps and more: no number wraps around
    for step_s in [1e-6, 1.0842021724855044e-16, 1e-300, 0.0] {
        assert!(refused(&paper(Carry::Platform), step_s).contains("expected at most 1000000"));
        assert!(refused(&turning, step_s).contains("expected at most"));
    }
    assert!(refused(&turning, 0.005).contains("200000 steps of rotating segments; expected at most 100000"));
    let mut many = scheme(&["0,0,0"; 90], Carry::Reset);
    many.positions.iter_mut().for_each(|p| p.dwell = "1000".parse().ok());
    assert!(refused(&many, 0.5).contains("steps times unknowns"));
}

#[test]
fn what_cannot_be_simulated_is_refused_by_name() {
    let refused = |scheme: &Scheme, c: &Conditions| simulate(scheme, c, 1).expect_err("refused");
    let generic = scheme(&["alpha,0,0"], Carry::Platform);
    assert!(
        matches!(refused(&generic, &Conditions::default()), SimulationError::GenericAngle { name } if name == "alpha")
    );
    let slews = Conditions { slew_rate_deg_s: Some(1.0), ..Conditions::default() };
    assert!(matches!(refused(&paper(Carry::Platform), &slews), SimulationError::SlewCarry { .. }));
    let assigned = |name: &str| Conditions {
        values: vec![Assignment { name: name.into(), value: 1.0 }],
        ..Conditions::default()
    };
    assert!(refused(&paper(Carry::Platform), &assigned("D_FW")).to_string().contains("`D_FW`"));
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let c = Conditions { step_s: wrong, ..Conditions::default() };
        assert!(refused(&paper(Carry::Platform), &c).to_string().starts_with("step_s"));
    }
}

const P1P2: [&str; 5] = ["simulate", "--angles", "0,0,0", "--angles", "180,0,0"];

/// With slews of finite duration the exact verdict, which assumes instantaneous repositioning, does not
/// decide what samples determine, because psi changes during the slews. The sigmas are from an independent
/// computation without priors (information with integrated slews).
#[test]
fn with_slews_the_samples_decide() {
    let outcome = |arguments: &[&str]| {
        let output = run(&[&["simulate", "--format", "json", "--carry", "inertial"], arguments].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let of = |q: &serde_json::Value| {
            let text = |key: &str| q[key].as_str().expect("a text").to_string();
            (text("name"), (q["degree"].as_u64(), text("outcome"), q["sigma"].as_f64().expect("a number")))
        };
        json["quantities"].as_array().expect("a list").iter().map(of).collect::<BTreeMap<_, _>>()
    };
    let two = ["--angles", "NUE", "--angles", "NDW", "--latitude", "28.2"];
    // with instantaneous slews D_FZ is observable; with slower ones only its prior bounds it: tenfold priors
    // give a tenfold sigma
    let at_once = outcome(&two);
    assert_eq!((at_once["D_FZ"].0, at_once["D_FZ"].1.as_str()), (Some(1), "determined"));
    for prior in ["D=10", "D=1000"] {
        let slow = outcome(&[&two[..], &["--slew-rate", "0.5", "--prior", prior]].concat());
        assert_eq!((slow["D_FZ"].0, slow["D_FZ"].1.as_str()), (Some(1), "prior_only"), "{prior}");
        assert_eq!(slow["D_FX"].1, "determined");
    }
    let three = ["--angles", "EDN", "--angles", "UNW", "--angles", "SUW", "--latitude", "28.2"];
    let conditions =
        ["--slew-rate", "0.5", "--prior", "D=1000", "--prior", "psi=1000", "--drift-noise", "0 deg/h"];
    let slow = outcome(&[&three[..], &conditions].concat());
    for (name, sigma) in [
        ("D_FX", 0.1914),
        ("D_FZ", 0.02478),
        ("D_IX", 0.1346),
        ("D_OZ", 0.02516),
        ("D_SX", 0.1914),
        ("D_SZ", 0.02477),
    ] {
        let (degree, verdict, found) = &slow[name];
        assert_eq!(*degree, None, "{name}");
        assert!(["reached", "converging", "determined"].contains(&verdict.as_str()), "{name}: {verdict}");
        assert!((found / sigma - 1.0).abs() < 0.02, "{name}: {found} instead of {sigma}");
    }
}

//! Record of a handheld unit, written from its equations: its errors are found, with the right sigmas.

use obsdeg_calibration::record::Record;
use obsdeg_calibration::{Before, SystemCalibration, SystemCalibrationOptions, calibrate_system};
use obsdeg_core::system::model_file;
use obsdeg_exact::SplitMix64;

const G: f64 = 9.81744;
/// Errors of the unit: accelerometers (bias, scale, misalignment), then gyros, in the order of the files.
const TRUTH: [(&str, f64); 21] = [
    ("bx", 33124.0),
    ("by", 33275.0),
    ("bz", 32364.0),
    ("sx", 414.4),
    ("sy", 412.0),
    ("sz", 414.6),
    ("ayz", 0.0034),
    ("azy", -0.0092),
    ("azx", 0.0214),
    ("cx", 32777.0),
    ("cy", 32459.0),
    ("cz", 32512.0),
    ("kx", 4778.0),
    ("ky", 4764.0),
    ("kz", 4773.0),
    ("gyz", -0.006),
    ("gzy", 0.001),
    ("gxz", 0.008),
    ("gzx", 0.053),
    ("gxy", -0.025),
    ("gyx", -0.003),
];

fn truth(name: &str) -> f64 {
    TRUTH.iter().find(|(n, _)| *n == name).expect("a name").1
}

/// Solves `m x = y` (3 by 3) by Cramer's rule.
fn solved(m: [[f64; 3]; 3], y: [f64; 3]) -> [f64; 3] {
    let det = |m: &[[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = det(&m);
    std::array::from_fn(|j| {
        let mut with = m;
        (0..3).for_each(|i| with[i][j] = y[i]);
        det(&with) / whole
    })
}

/// Rests of 2 s (35 s at first) and turns of 1.5 s at rates that rise and fall, at 100 Hz. The force is
/// turned by Rodrigues' formula in steps of a millisecond.
fn record(rests: usize, seed: u64) -> String {
    let mut random = SplitMix64::new(seed);
    let mut uniform = move || ((random.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    let (mut f, mut text, mut t) =
        ([0.3 * G, -0.4 * G, 0.75f64.sqrt() * G], String::from("t [s],ax,ay,az,wx,wy,wz\n"), 0.0);
    let accelerometers = [[1.0, -truth("ayz"), truth("azy")], [0.0, 1.0, -truth("azx")], [0.0, 0.0, 1.0]];
    let gyros = [
        [1.0, -truth("gyz"), truth("gzy")],
        [truth("gxz"), 1.0, -truth("gzx")],
        [-truth("gxy"), truth("gyx"), 1.0],
    ];
    for k in 0..rests {
        let axis: [f64; 3] = std::array::from_fn(|_| 2.0 * uniform() - 1.0);
        let still = if k == 0 { 3500 } else { 200 };
        for i in 0..still + if k + 1 < rests { 150 } else { 0 } {
            let turning = i >= still;
            let w: [f64; 3] = if turning {
                let s = (std::f64::consts::PI * (i - still) as f64 / 150.0).sin();
                axis.map(|a| 3.0 * a * s * s)
            } else {
                [0.0; 3]
            };
            let (a, r) = (solved(accelerometers, f), solved(gyros, w));
            let mut line = format!("{t:.2}");
            for j in 0..3 {
                let normal = (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
                let [b, s] = [["bx", "by", "bz"][j], ["sx", "sy", "sz"][j]].map(truth);
                line += &format!(",{}", b + s * a[j] + 3.3 * normal);
            }
            for j in 0..3 {
                let normal = (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
                let [c, k] = [["cx", "cy", "cz"][j], ["kx", "ky", "kz"][j]].map(truth);
                line += &format!(",{}", c + k * r[j] + 27.0 * normal);
            }
            text += &line;
            text.push('\n');
            t += 0.01;
            // a vector at rest in n turns backwards in the unit; the rate is held from a sample to the next
            let rate = w.iter().map(|x| x * x).sum::<f64>().sqrt();
            if rate > 0.0 {
                let (u, angle) = (w.map(|x| -x / rate), rate * 0.01);
                let along: f64 = (0..3).map(|j| u[j] * f[j]).sum();
                let across =
                    [u[1] * f[2] - u[2] * f[1], u[2] * f[0] - u[0] * f[2], u[0] * f[1] - u[1] * f[0]];
                f = std::array::from_fn(|j| {
                    angle.cos() * f[j] + angle.sin() * across[j] + (1.0 - angle.cos()) * along * u[j]
                });
            }
        }
    }
    text
}

fn calibrated(file: &str, text: &str, options: &SystemCalibrationOptions) -> SystemCalibration {
    let path = format!("{}/../../examples/handheld/{file}", env!("CARGO_MANIFEST_DIR"));
    let model = std::fs::read_to_string(path).expect("the model");
    // turns of 1.5 s; no earth rate
    let model =
        model.replace("noise = { turn = 0.016, rate = 1e-4 }", "noise = { turn = 6e-3, rate = 1e-6 }");
    let record = Record::csv("hand.csv", Box::new(std::io::Cursor::new(text.to_string()))).expect("a record");
    calibrate_system(&model_file::read(&model).expect("a model"), record, options, &|_| true)
        .expect("calibrated")
}

/// Accelerometers by the length of the force; gyros by the turns between rests, with the first result as a
/// prior of the second.
#[test]
fn errors_of_a_unit_in_the_hand() {
    let text = record(16, 7);
    let options = SystemCalibrationOptions { starts: 1, profiles: vec![], prior: None, seed: 1 };
    let first = calibrated("accelerometers.toml", &text, &options);
    assert_eq!(
        (first.intervals, first.rows, first.consistent),
        (Some(16), 16, Some(true)),
        "{:?}",
        first.findings
    );
    let (estimates, rests_on) = (first.covariance.clone(), first.rests_on.clone());
    let prior = Some(Before { priors: Vec::new(), estimates, rests_on, of: first.model.clone() });
    let second = calibrated("gyros.toml", &text, &SystemCalibrationOptions { prior, ..options });
    assert_eq!(second.consistent, Some(true), "{:?}", second.findings);
    for c in [&first, &second] {
        for u in &c.quantities {
            let (x, s) = (u.estimate.expect("determined"), u.sigma.expect("determined"));
            assert!((x - truth(&u.name)).abs() < 4.0 * s, "{}: {x} +- {s}", u.name);
        }
    }
    // NEES of the gyros' fifteen errors with the prior on the others: 21 unknowns
    let p = nalgebra::DMatrix::from_fn(21, 21, |i, j| second.covariance.covariance[i][j]);
    let e = nalgebra::DVector::from_fn(21, |i, _| {
        second.covariance.estimates[i] - truth(&second.covariance.names[i])
    });
    let nees = e.dot(&p.cholesky().expect("definite").solve(&e));
    assert!((5.0..47.0).contains(&nees), "{nees} of 21");
}

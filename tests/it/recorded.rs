//! Published records against the results of other programs and of the literature.

use std::fs;

use serde_json::Value;

use crate::calibrate::crate_root;
use crate::program::{json, run, stderr};

/// Estimate and sigma of an unknown or combination, as the fit gives them.
fn found(v: &Value, name: &str) -> [f64; 2] {
    let all = v["quantities"]
        .as_array()
        .expect("unknowns")
        .iter()
        .chain(v["combinations"].as_array().expect("some"));
    let u = all.into_iter().find(|u| u["name"] == name).unwrap_or_else(|| panic!("{name}"));
    ["estimate", "sigma_rescaled"].map(|k| u[k].as_f64().unwrap_or(f64::NAN))
}

fn model(name: &str, more: &[&str]) -> Value {
    let [model, data] = ["model.toml", "data.csv"].map(|file| format!("examples/{name}/{file}"));
    let output = run(&[&["calibrate", "--model", &model, &data, "--format", "json"], more].concat());
    assert!(output.status.code().is_some_and(|c| c < 2), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Small series from the literature, with the published results.
#[test]
fn series_of_the_literature() {
    // J. D. Murray, Mathematical Biology (1989), 19.1: r = 2.18e-3 / d, rho = 202, a = 0.44 / d
    let flu = model("influenza", &[]);
    let ([beta, s], [gamma, t]) = (found(&flu, "beta"), found(&flu, "gamma"));
    assert!((beta / 2.18e-3 - 1.0).abs() < 0.03 && s < 1e-4, "{beta} +- {s}");
    assert!((gamma / 0.44 - 1.0).abs() < 0.03 && t < 0.02, "{gamma} +- {t}");
    // R, ?SSfol: lKe -2.9196 +- 0.1709, lKa 0.5752 +- 0.1728, lCl -3.9159 +- 0.1273; 0.732 on 8 degrees of
    // freedom
    let theo = model("theophylline", &[]);
    let of = |name| found(&theo, name)[0];
    let [ke, ka, v] = ["ke", "ka", "V"].map(of);
    let logarithms = [ke.ln() + 2.9196, ka.ln() - 0.5752, (v * ke).ln() + 3.9159];
    assert!(logarithms.iter().all(|x| x.abs() < 2e-4), "{logarithms:?}");
    assert!(
        (found(&theo, "ke")[1] / ke - 0.1709).abs() < 5e-4
            && (found(&theo, "ka")[1] / ka - 0.1728).abs() < 5e-4
    );
    assert_eq!(theo["degrees_of_freedom"], 8);
    // absorption and elimination are exchangeable
    let others = theo["others"].as_array().expect("others");
    let other = |k: usize| others[0]["values"][k].as_f64().expect("a number");
    assert!(
        others.len() == 1 && (other(0) / ke - 1.0).abs() < 1e-3 && (other(1) / ka - 1.0).abs() < 1e-3,
        "{others:?}"
    );
    let sigma = theo["outputs"][0]["sigma"].as_f64().expect("a number");
    assert!((sigma - 0.732).abs() < 1e-3, "{sigma}");
    // B. Carpenter, Predator-prey population dynamics (2018), with priors: 0.55, 0.028, 0.80, 0.024, 34.0,
    // 5.9; sigma 0.25
    let hares = model("hudson-bay", &[]);
    for (name, published, within) in [
        ("a", 0.55, 0.07),
        ("b", 0.028, 0.005),
        ("c", 0.80, 0.1),
        ("d", 0.024, 0.004),
        ("H", 34.0, 3.0),
        ("L", 5.9, 0.6),
    ] {
        let [x, s] = found(&hares, name);
        assert!((x - published).abs() < within && s < 2.0 * within, "{name}: {x} +- {s}");
    }
}

/// Unpacks a compressed record of the examples.
fn unpacked(record: &str, folder: &std::path::Path) -> String {
    let path = folder.join("record.csv");
    let unpacked = std::process::Command::new("gzip").arg("-dc").arg(crate_root(record)).output();
    fs::write(&path, unpacked.expect("gzip runs").stdout).expect("written");
    path.display().to_string()
}

/// Asserts that estimates agree with others within `most` sigma of the fit.
fn agrees(found_in: &Value, others: &[(&str, f64)], most: f64) {
    for &(name, other) in others {
        let [x, s] = found(found_in, name);
        assert!((x - other).abs() < most * s, "{name}: {x} +- {s}, {other}");
    }
}

/// A published record: the magnitude of the specific force at 38 unknown attitudes.
#[test]
fn a_record_by_hand() {
    let folder = tempfile::tempdir().expect("a folder");
    let record = unpacked("examples/handheld/record.csv.gz", folder.path());
    let model = "examples/handheld/accelerometers.toml";
    let output = run(&["calibrate", "--model", model, &record, "--format", "json"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let v: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        (&v["samples"], &v["intervals"], &v["degrees_of_freedom"]),
        (&51175.into(), &38.into(), &29.into())
    );
    let g = &v["outputs"][0];
    let [left, expected] = ["rms", "expected_rms"].map(|k| g[k].as_f64().expect("a number"));
    assert!((left / 1e-3 - 1.0).abs() < 0.15 && (expected / 3e-4 - 1.0).abs() < 0.15, "{left} {expected}");
    assert_eq!(v["findings"].as_array().map(Vec::len), Some(1), "{}", v["findings"]);
    assert_eq!(v["findings"][0]["kind"], "noise");
    // least squares with equal weights by another program; then the published results of the method's own
    // program for this record
    let plain = [33123.9, 33275.1, 32364.5, 414.42, 412.03, 414.62, 0.0034, -0.0092, 0.0214];
    let published =
        [33124.2, 33275.2, 32364.4, 414.459, 412.01, 414.649, 0.003_359_3, -0.008_906_39, 0.021_334_1];
    let names = ["bx", "by", "bz", "sx", "sy", "sz", "ayz", "azy", "azx"];
    for others in [plain, published] {
        agrees(&v, &names.into_iter().zip(others).collect::<Vec<_>>(), 4.0);
    }
    // other columns, and files that are no records
    let text = fs::read_to_string(crate_root(model)).expect("the model");
    let other = folder.path().join("other.toml");
    for (from, to, message) in [
        (
            "[record]\n",
            "[record]\ncolumns = { ax = \"accX\" }\n",
            "no column `accX`, which record.columns has as `ax`",
        ),
        ("by = [\"ax\"", "by = [\"a\"", "`a` is no known input of the model; expected one of ax, ay, az"),
        ("window = 1", "window = 60", "static.initial is 30; expected at least static.window, 60"),
        ("g = 9.81744", "G = 9.81744", "`G` is no output of the model; expected one of g"),
        ("shortest = 1", "shortest = 100", "intervals at rest; expected two at least"),
    ] {
        fs::write(&other, text.replace(from, to)).expect("written");
        let output = run(&["calibrate", "--model", &other.display().to_string(), &record]);
        let found = stderr(&output);
        assert!(output.status.code() == Some(2) && found.contains(message), "{message}: {found}");
    }
}

/// The gyros of the same record, from the turns between attitudes: `cargo test --release --test it --
/// --ignored gyros_by_hand` (a minute in debug).
#[test]
#[ignore = "a minute"]
fn gyros_by_hand() {
    let folder = tempfile::tempdir().expect("a folder");
    let record = unpacked("examples/handheld/record.csv.gz", folder.path());
    let before = folder.path().join("before").display().to_string();
    run(&["calibrate", "--model", "examples/handheld/accelerometers.toml", &record, "-o", &before, "-q"]);
    let prior = format!("{before}/calibration.json");
    let model = "examples/handheld/gyros.toml";
    let line =
        ["calibrate", "--model", model, &record, "--prior", &prior, "--starts", "1", "--format", "json"];
    let v: Value = serde_json::from_slice(&run(&line).stdout).expect("JSON");
    let published = [
        ("kx", 4777.96),
        ("ky", 4764.21),
        ("kz", 4773.66),
        ("gyz", -0.005_936_34),
        ("gzy", 0.001_111_01),
        ("gxz", 0.008_088_12),
        ("gzx", 0.053_556_9),
        ("gxy", -0.025_306_7),
        ("gyx", -0.002_551_3),
    ];
    agrees(&v, &published, 2.0);
}

/// Only prey are counted: the number of predators and their consumption rate are determined only as a
/// product, and the profile of each is flat.
#[test]
#[ignore = "seconds: .ci/run release"]
fn a_profile_is_flat_where_the_verdict_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let run_at = folder.path().join("run").display().to_string();
    let file = "examples/lotka-volterra/model.toml";
    assert!(run(&["simulate", "--model", file, "-o", &run_at, "-q"]).status.success());
    // integration of the equations with small steps
    let (mut x, mut text) = ([10.0, 5.0], String::from("t [a],y\n"));
    let rate = |x: &[f64; 2]| [1.1 * x[0] - 0.4 * x[0] * x[1], -0.4 * x[1] + 0.1 * x[0] * x[1]];
    for k in 0..=4000 {
        if k % 100 == 0 {
            // errors of a tenth with zero mean
            let noise = 0.1 * ((k as f64 * 0.7133).sin() + (k as f64 * 1.319).cos());
            text += &format!("{},{}\n", k as f64 * 5e-3, x[0] + noise);
        }
        let middle = [0, 1].map(|i| x[i] + 2.5e-3 * rate(&x)[i]);
        let next = [0, 1].map(|i| x[i] + 5e-3 * rate(&middle)[i]);
        x = next;
    }
    let data = folder.path().join("prey.csv").display().to_string();
    fs::write(&data, text).expect("written");
    let output =
        run(&["calibrate", "--model", file, &data, "--profile", "x2", "--profile", "a", "--format", "json"]);
    let v: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for name in ["x2", "b"] {
        let u =
            v["quantities"].as_array().expect("unknowns").iter().find(|u| u["name"] == name).expect("one");
        assert!(u["determined"] == false && u["estimate"].is_null() && u["status"] == "inseparable", "{u}");
    }
    let [product, sigma] = found(&v, "b*x2");
    assert!((product - 2.0).abs() < 4.0 * sigma && sigma < 0.1, "{product} +- {sigma}");
    for (name, truth) in [("x1", 10.0), ("a", 1.1), ("c", 0.4), ("d", 0.1)] {
        let [x, s] = found(&v, name);
        assert!((x - truth).abs() < 4.0 * s && s < 0.1 * truth, "{name}: {x} +- {s}");
    }
    assert_eq!(
        (&v["profiles"][0]["flat"], &v["profiles"][1]["flat"]),
        (&Value::Bool(true), &Value::Bool(false))
    );
    let ends = v["profiles"][1]["points"].as_array().expect("points");
    let rise = ends[0][1].as_f64().expect("a number");
    assert!((4.0..16.0).contains(&rise), "three sigma are nine: {rise}");
}

/// Sensitivities in counts per g from imucal 2.6.0 on the whole session (`FerrarisCalibration`, K_a R_a times
/// 9.81), and its biases in counts.
const IMUCAL: [(&str, f64); 9] = [
    ("kxx", 2045.6541),
    ("kxy", 14.5705),
    ("kxz", -22.8022),
    ("kyx", -16.2166),
    ("kyy", 2039.8560),
    ("kyz", 48.2554),
    ("kzx", 44.9703),
    ("kzy", -22.7178),
    ("kzz", 2106.4340),
];

/// The linear map agrees with imucal within a hundredth of a count per g. The biases, which imucal takes from
/// two positions each, agree within a third of the uncertainty of six positions.
#[test]
fn accelerometers_are_those_of_imucal() {
    let found = json(&[
        "calibrate",
        "--model",
        "examples/ferraris/model.toml",
        "examples/ferraris/record.csv",
        "--starts",
        "1",
        "--format",
        "json",
    ]);
    let of = |name: &str| {
        let all = found["quantities"].as_array().expect("quantities");
        all.iter().find(|q| q["name"] == name).expect("the unknown")["estimate"].as_f64().expect("a number")
    };
    for (name, expected) in IMUCAL {
        assert!((of(name) - expected).abs() < 0.01, "{name}: {}", of(name));
    }
    for (name, expected) in [("bx", -6.02), ("by", -48.29), ("bz", -28.97)] {
        assert!((of(name) - expected).abs() < 8.0, "{name}: {}", of(name));
    }
    assert_eq!(found["consistent"], true);
}

/// Output of the authors' program for its record (Example.ipynb of mikoff/imu-calib), to four decimals.
const IMU_CALIB: [(&str, f64); 9] = [
    ("sx", 0.0036),
    ("sy", 0.0032),
    ("sz", 0.0065),
    ("nx", 0.0021),
    ("ny", 0.0003),
    ("nz", 0.0055),
    ("bx", 0.1027),
    ("by", 0.0967),
    ("bz", 0.3444),
];

/// Raw counts of a MEMS unit at 23 unknown attitudes. The reference uses the same samples, so the results
/// differ by less than the noise allows: two sigma.
#[test]
fn accelerometers_are_those_of_imu_calib() {
    let folder = tempfile::tempdir().expect("a folder");
    let record = unpacked("examples/mpu9150/record.csv.gz", folder.path());
    let model = "examples/mpu9150/accelerometers.toml";
    let v = json(&["calibrate", "--model", model, &record, "--starts", "1", "--format", "json"]);
    assert_eq!((&v["samples"], &v["intervals"], &v["consistent"]), (&15969.into(), &23.into(), &true.into()));
    agrees(&v, &IMU_CALIB, 2.0);
    for (name, _) in IMU_CALIB {
        let [_, sigma] = found(&v, name);
        assert!(sigma < if name.starts_with('b') { 2e-3 } else { 4e-4 }, "{name}: {sigma}");
    }
}

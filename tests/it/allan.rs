//! `obsdeg allan`: noise coefficients of a static record, against allantools and against the values with
//! which the record was simulated.

use crate::program::{json, refused, run, scratch, stdout};

const RECORD: &str = "tests/data/static/imu.csv";

#[test]
fn deviations_are_those_of_allantools() {
    let found = json(&["allan", RECORD, "--format", "json"]);
    let figures = include_str!("../data/static/allantools.csv");
    let mut lines = 0;
    for line in figures.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let columns = found["columns"].as_array().expect("columns");
        let column = columns.iter().find(|c| c["column"].as_str().expect("a name").starts_with(cells[0]));
        let deviations = column.expect("the column")["deviations"].as_array().expect("deviations");
        let [tau, expected] = [1, 2].map(|i| cells[i].parse::<f64>().expect("a number"));
        let Some(own) = deviations.iter().find(|d| d["tau_s"] == tau) else { continue };
        let own = own["deviation"].as_f64().expect("a number");
        assert!((own / expected - 1.0).abs() < 1e-7, "{line}: {own}");
        lines += 1;
    }
    assert_eq!(lines, 20);
}

/// Coefficients agree with the README of the data within four sigma. The record has no flicker noise, and
/// none is resolved.
#[test]
fn coefficients_are_those_of_the_record() {
    let found = json(&["allan", RECORD, "--format", "json"]);
    let truth = [
        ("wx", "random_walk", Some(0.017_678)),
        ("wx", "bias_instability", None),
        ("wx", "rate_random_walk", Some(2.5456)),
        ("fx", "random_walk", Some(8.3211e-3)),
        ("fx", "bias_instability", None),
        ("fx", "rate_random_walk", None),
    ];
    for (column, noise, truth) in truth {
        let columns = found["columns"].as_array().expect("columns");
        let own = columns.iter().find(|c| c["column"].as_str().expect("a name").starts_with(column));
        let coefficients = own.expect("the column")["coefficients"].as_array().expect("coefficients");
        let c = coefficients.iter().find(|c| c["noise"] == noise).expect("the coefficient");
        assert_eq!(c["resolved"], truth.is_some(), "{column} {noise}: {c}");
        if let Some(truth) = truth {
            let [x, sigma] = ["value", "sigma"].map(|k| c[k].as_f64().expect("a number"));
            assert!((x - truth).abs() < 4.0 * sigma && sigma < 0.2 * x, "{column} {noise}: {x} +- {sigma}");
        }
    }
}

/// The printed table is accepted by schemes.
#[test]
fn the_table_is_one_of_a_scheme() {
    let found = json(&["allan", RECORD, "--format", "json"]);
    let table = found["simulation_table"].as_str().expect("a table");
    assert!(table.contains("angle_random_walk_deg_sqrt_h = [0.0"), "{table}");
    // 2e-5 g from 4096 samples: relative sigma 1/sqrt(2 4096)
    let key = table.lines().find_map(|l| l.strip_prefix("accelerometer_noise_g = ")).expect("the key");
    let noise: f64 = key.parse().expect("a number");
    assert!((noise / 2e-5 - 1.0).abs() < 4.0 / 8192f64.sqrt(), "{table}");
    let (folder, _) = scratch();
    let path = folder.path().join("scheme.toml").display().to_string();
    let scheme = "name = 's'\n[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\nangles_deg = [180, 0, 0]\n";
    std::fs::write(&path, format!("name = 's'\n{table}{}", &scheme["name = 's'\n".len()..]))
        .expect("written");
    let run = json(&["simulate", &path, "--format", "json"]);
    assert_eq!(run["schema"], "obsdeg.simulation/2");
}

#[test]
fn what_is_wrong_is_named() {
    refused(&["allan", RECORD, "--column", "wz"], &["no column `wz`", "`wx [deg/h]`, `fx [g]`"]);
    refused(&["allan", "examples/lotka-volterra/model.toml"], &["model.toml"]);
    let (folder, _) = scratch();
    let path = folder.path().join("short.csv").display().to_string();
    let rows: String = (0..50).map(|k| format!("{k},{}\n", f64::from(k).sin())).collect();
    std::fs::write(&path, format!("t [s],wx [deg/h]\n{rows}")).expect("written");
    refused(&["allan", &path], &["column `wx [deg/h]`: 50 samples", "expected 128 or more"]);
    let rows: String = (0..500).map(|k| format!("{k},2\n")).collect();
    std::fs::write(&path, format!("t [s],wx [deg/h]\n{rows}")).expect("written");
    refused(&["allan", &path], &["all samples are 2"]);
    // a straight line is not noise, and the answer says so
    let rows: String = (0..2000).map(|k| format!("{k},{}\n", f64::from(k) + f64::from(k).sin())).collect();
    std::fs::write(&path, format!("t [s],wx [deg/h]\n{rows}")).expect("written");
    let output = run(&["allan", &path]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).contains("NOT explained"), "{}", stdout(&output));
}

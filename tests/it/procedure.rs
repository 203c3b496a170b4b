//! `obsdeg procedure`: the sheet of a run, its files, and wrong inputs.

use std::fs;

use serde_json::Value;

use crate::program::{json, refused, run, scratch, stderr, stdout};

const SCHEME: &str = "examples/rate-table/scheme.toml";

fn text(value: &Value, key: &str) -> String {
    value[key].as_str().unwrap_or_default().to_string()
}

/// Files of the folder: the page, the steps for a controller, the scheme with all conditions, and the header
/// of the record.
#[test]
fn a_sheet_and_its_files() {
    let (kept, _) = scratch();
    let folder = kept.path().join("procedure");
    let path = folder.to_str().expect("UTF-8");
    let output = run(&["procedure", SCHEME, "--settle", "20", "--noise", "2e-5", "-o", path, "--force"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let names =
        ["controller.csv", "positions.svg", "procedure.html", "procedure.json", "record.csv", "scheme.toml"];
    for name in names {
        assert!(folder.join(name).exists(), "{name}");
    }
    let read = |name: &str| fs::read_to_string(folder.join(name)).expect("written");
    let sheet: Value = serde_json::from_str(&read("procedure.json")).expect("JSON");
    let steps = sheet["steps"].as_array().expect("steps");
    assert_eq!(read("controller.csv").lines().count(), steps.len() + 1);
    let header: Vec<String> = read("record.csv").lines().map(String::from).collect();
    assert!(header[0].starts_with("# record of rate table; position: p1, p2, p3, p4, p5, p6"), "{header:?}");
    assert_eq!(header[1..], ["t [s],position,fx [g],fy [g],fz [g]"]);
    // times follow each other, and the total is the end of the last step
    let mut now = 0.0;
    for step in steps {
        assert!((step["start_s"].as_f64().expect("a time") - now).abs() < 1e-9);
        now += step["duration_s"].as_f64().expect("a time");
    }
    assert!((sheet["total_s"].as_f64().expect("a time") - now).abs() < 1e-9);
    // the scheme of the folder gives the same sheet without options but the wait
    let own = folder.join("scheme.toml");
    let own = own.to_str().expect("UTF-8");
    let again = json(&["procedure", own, "--settle", "20", "--format", "json"]);
    assert_eq!(again["coefficients"], sheet["coefficients"]);
    assert_eq!(again["acceptance"], sheet["acceptance"]);
    // the wait is in the scheme
    let own_wait = json(&["procedure", own, "--format", "json"]);
    assert_eq!(own_wait["coefficients"], sheet["coefficients"]);
    // the uncertainties are those of the other commands
    let run = json(&["simulate", own, "--format", "json"]);
    for c in sheet["coefficients"].as_array().expect("coefficients") {
        let all = run["quantities"].as_array().expect("unknowns");
        let q = all.iter().find(|q| q["name"] == c["name"]).expect("the same unknown");
        assert_eq!(q["predicted_sigma"], c["uncertainty"], "{}", text(c, "name"));
    }
}

/// A record that somebody filled is kept, whatever `--force`; tables of another dialect are not.
#[test]
fn a_filled_record_is_kept() {
    let (kept, _) = scratch();
    let folder = kept.path().join("run");
    let path = folder.to_str().expect("UTF-8");
    let psins = ["procedure", SCHEME, "--dialect", "psins", "-o", path];
    assert!(run(&psins).status.success() && folder.join("controller.txt").exists());
    let forced = ["procedure", SCHEME, "-o", path, "--force"];
    assert!(run(&forced).status.success());
    assert!(folder.join("controller.csv").exists() && !folder.join("controller.txt").exists());
    let record = folder.join("record.csv");
    let filled = fs::read_to_string(&record).expect("written") + "4,p1,-0.5,0.8,0.1\n";
    fs::write(&record, &filled).expect("written");
    refused(&forced, &["record.csv holds the record of a run", "another folder"]);
    assert_eq!(fs::read_to_string(&record).expect("kept"), filled);
}

/// A rotation table read back gives the same turns, times and readings.
#[test]
fn rotation_tables_go_out_and_in() {
    let (kept, _) = scratch();
    let folder = kept.path().join("rotations");
    let path = folder.to_str().expect("UTF-8");
    let output = run(&["procedure", SCHEME, "--dialect", "psins", "-o", path, "--force"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let table = folder.join("controller.txt");
    let table = table.to_str().expect("UTF-8");
    let assumed = ["--latitude", "48.2", "--step", "4", "--format", "json"];
    let back = [&["procedure", "--rotations", table, "--start", "10,25,40"][..], &assumed].concat();
    let (there, back) = (json(&["procedure", SCHEME, "--format", "json"]), json(&back));
    assert_eq!(there["steps"].as_array().map(Vec::len), back["steps"].as_array().map(Vec::len));
    for (a, b) in
        there["steps"].as_array().expect("steps").iter().zip(back["steps"].as_array().expect("steps"))
    {
        let near = |a: &Value, b: &Value| match (a.as_f64(), b.as_f64()) {
            (Some(a), Some(b)) => (a - b).abs() < 1e-6,
            _ => a == b,
        };
        assert!(near(&a["start_s"], &b["start_s"]) && a["kind"] == b["kind"], "{a} {b}");
        for k in 0..3 {
            assert!(near(&a["force_g"][k], &b["force_g"][k]), "{a} {b}");
            assert!(near(&a["gimbals_deg"][k], &b["gimbals_deg"][k]), "{a} {b}");
        }
    }
    refused(&["procedure", "--rotations", table, SCHEME], &["--rotations beside another scheme"]);
    refused(
        &["procedure", "--rotations", table, "--start", "alpha,0,0"],
        &["expected three angles in degrees"],
    );
    refused(&["procedure", "--rotations", SCHEME], &["scheme.toml: line 1"]);
    refused(&["procedure", SCHEME, "--start", "0,0,0"], &["expected --rotations FILE"]);
}

/// The exit code is 1 where the gimbals cannot execute the sheet, which begins with that.
#[test]
fn what_the_gimbals_cannot_do() {
    let (kept, _) = scratch();
    let scheme = kept.path().join("procedure_gimbals.toml");
    let text = "carry = 'inertial'\n[simulation]\nslew_rate_deg_s = 2\n[gimbals]\nalpha_deg = [-90, 90]\n\
                [[position]]\nattitude = 'NUE'\n[[position]]\nattitude = 'NDW'\n";
    fs::write(&scheme, text).expect("written");
    let output = run(&["procedure", scheme.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(1));
    let said = stdout(&output);
    assert!(
        said.contains("NOT executable from these gimbal angles: p2: alpha stops at -90.00 deg"),
        "{said}"
    );
}

#[test]
fn wrong_inputs_are_named() {
    refused(
        &["procedure", SCHEME, "--settle", "400"],
        &["a wait of 400 s for rest leaves no sample of the dwell of `p1` (400 s)"],
    );
    refused(&["procedure", SCHEME, "--settle", "-1"], &["settle_s is -1", "0 to 1e6 s"]);
    refused(&["procedure", SCHEME, "--tilt", "0"], &["a tilt of 0"]);
    refused(&["procedure", "examples/sir/model.toml"], &["a model has no sheet"]);
    refused(&["procedure", "--angles", "alpha,0,0"], &["alpha"]);
    refused(&["procedure", "--angles", "NUE", "--dialect", "psins"], &["--slew-rate"]);
    refused(&["procedure", SCHEME, "-o", "sheet.html"], &["html"]);
}

/// Limits of the scheme file: names, numbers and the risk are checked with their place.
#[test]
fn wrong_limits_are_named() {
    let (kept, _) = scratch();
    let file = kept.path().join("limits.toml");
    for (table, expected) in [
        ("limits = { D_Q = 1 }", "no such unknown"),
        ("limits = { psi = 1 }", "limits are for coefficients"),
        ("limits = { D_F = [1, 1] }", "two ascending numbers"),
        ("limits = { D_F = -1 }", "a largest magnitude above 0"),
        ("limits = { K0 = 1 }", "limits of `K0`: no such unknown"),
        ("limits = { D_F = 'a' }", "limits"),
        ("risk = 0.7\nlimits = { D_F = 1 }", "expected 0.000001 to 0.5"),
        ("risk = 0.1", "a risk without limits"),
    ] {
        let text = format!("[acceptance]\n{table}\n[[position]]\nattitude = 'NUE'\n");
        fs::write(&file, text).expect("written");
        refused(&["analyze", file.to_str().expect("UTF-8")], &[expected, "limits.toml"]);
    }
}

//! Agreement between commands: `compare`, `simulate`, `report` and the engine of the page confirm what
//! `design` states of a scheme, from its file.

use std::path::Path;

use nalgebra::DMatrix;
use obsdeg_commands::{Host, call_json};
use serde_json::{Value, json as object};

use crate::program::{json, run, stdout};

/// A linear congruential generator (Knuth's MMIX constants).
struct Random(u64);

impl Random {
    /// Random number below `n`.
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) % n
    }

    /// Random element of a list.
    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len() as u64) as usize]
    }

    /// True with the given probability, in percent.
    fn percent(&mut self, probability: u64) -> bool {
        self.below(100) < probability
    }
}

/// Random design task, as options of a command line.
fn task(draw: &mut Random) -> Vec<String> {
    let carry = draw.of(&["platform", "inertial", "reset"]);
    let positions = if carry == "reset" { 6 + draw.below(2) } else { 5 + draw.below(2) };
    let mut out: Vec<String> =
        ["design", "--positions", &positions.to_string(), "--carry", carry].map(String::from).into();
    let mut add = |option: &str, value: &str| out.extend([option.to_string(), value.to_string()]);
    add("--keep", "3");
    add("--restarts", "4");
    if carry == "reset" {
        add("--within", "1");
    }
    if draw.percent(70) {
        add("--latitude", draw.of(&["0", "28.2", "45", "-60", "89"]));
    }
    if draw.percent(60) {
        add("--dwell", draw.of(&["300", "1000", "2000"]));
    }
    if draw.percent(50) {
        add("--noise", draw.of(&["1e-6", "2e-5"]));
    }
    if draw.percent(60) {
        add("--requirement", draw.of(&["D=0.02", "D=0.3", "D_F=0.004", "D_IX=0.1"]));
    }
    if draw.percent(40) {
        add("--requirement", draw.of(&["psi=0.004", "psi=0.2"]));
    }
    if draw.percent(30) {
        add("--prior", draw.of(&["D_F=0.01", "psi=0.05", "D_I=0.02"]));
    }
    if draw.percent(30) {
        add("--drift-noise", draw.of(&["0.001 deg/sqrt(h)", "0.002 deg/h", "0"]));
    }
    if carry == "inertial" && draw.percent(25) {
        add("--slew-rate", "2");
    }
    if draw.percent(25) {
        add("--gimbal", "alpha=-90:90");
    }
    if draw.percent(20) {
        add("--observable", "D_F,D_O");
    }
    let required = out.iter().any(|x| x == "--requirement");
    let criterion = draw.of(&["worst", "a", "d", "margin"]);
    let criterion = if criterion == "margin" && !required { "worst" } else { criterion };
    out.extend(["--criterion".into(), criterion.into(), "--format".into(), "json".into()]);
    out
}

/// True if two numbers are equal up to rounding; false if one of them is null.
fn same(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= 1e-6 * a.abs().max(b.abs()),
        _ => a == b,
    }
}

/// Outcome of the requirements, and the worst margin without its last digits.
fn decided(r: &Value) -> (Value, f64) {
    let mut out = r.clone();
    let margin = out["worst"]["margin"].as_f64().unwrap_or(0.0);
    if out["worst"].is_object() {
        out["worst"]["margin"] = object!(null);
    }
    (out, margin)
}

fn agree(task: &str, of: &str, found: &Value, other: &Value) {
    let ((a, x), (b, y)) = (decided(&found["requirements"]), decided(&other["requirements"]));
    assert_eq!(a, b, "{task}: {of}");
    assert!((x - y).abs() <= 1e-6 * x.abs(), "{task}: margin {x}, {of} {y}");
}

/// Checks one task with every command.
fn holds(seed: u64, with_report: bool) {
    let options = task(&mut Random(seed));
    let name = options.join(" ");
    let folder = tempfile::tempdir().expect("a folder");
    let written = folder.path().join("w").display().to_string();
    let arguments: Vec<&str> = options.iter().map(String::as_str).chain(["-o", &written]).collect();
    let output = run(&arguments);
    // no scheme may meet the task: the message says so, and nothing is written
    if !output.status.success() {
        return assert!(!Path::new(&written).exists(), "{name}");
    }
    let design: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    let first = &design["found"][0];
    let file = format!("{written}/winner.toml");
    let compared = &json(&["compare", &file, "--format", "json"])["schemes"][0];
    agree(&name, "compare", first, compared);
    // with --observable the worst sigma is that of the required unknowns
    if !name.contains("--observable") {
        assert!(
            same(&first["worst_sigma_dph"], &compared["worst"]["sigma_dph"]),
            "{name}: {first} {compared}"
        );
        let others = |a: &Value| a["other_carries"].as_array().expect("a list").clone();
        for (a, b) in others(&design).iter().zip(&others(compared)) {
            assert!(same(&a["worst"]["sigma_dph"], &b["worst"]["sigma_dph"]), "{name}: {a} {b}");
        }
    }
    let simulated = json(&["simulate", &file, "--format", "json"]);
    agree(&name, "simulate", first, &simulated);
    for (q, p) in simulated["quantities"]
        .as_array()
        .expect("a list")
        .iter()
        .zip(compared["quantities"].as_array().expect("a list"))
    {
        assert_eq!(q["name"], p["name"], "{name}");
        assert!(same(&q["predicted_sigma"], &p["sigma"]), "{name}: {q} {p}");
    }
    // the engine of the page reads the same text
    let text = std::fs::read_to_string(&file).expect("the winner");
    let asked = object!({ "sources": [{ "name": "winner.toml", "text": text }] });
    let page = call_json("compare", &asked.to_string(), &mut Host { worker: None, progress: &|_| true })
        .expect("an answer");
    let page: Value = serde_json::from_str(&page.text).expect("JSON");
    assert_eq!(&page["schemes"][0], compared, "{name}");
    // a search that reads the file uses its positions and conditions
    let stated = first["requirements"]["stated"].as_u64() > Some(0);
    let code = run(&["compare", &file, "--require-met"]).status.code();
    let expected = match (stated, compared["meets_requirements"] == true) {
        (false, _) => 2,
        (true, met) => i32::from(!met),
    };
    assert_eq!(code, Some(expected), "{name}");
    if with_report {
        let review = folder.path().join("r.md").display().to_string();
        assert!(run(&["report", &file, "-o", &review, "--runs", "2"]).status.success(), "{name}");
        let review = std::fs::read_to_string(&review).expect("a review").to_lowercase();
        let sentence = match (stated, first["requirements"]["missed"].as_array().map_or(0, Vec::len)) {
            (false, _) => "no requirement is stated, so none is judged".into(),
            (true, 0) => format!(
                "every requirement is met, {} of {}",
                first["requirements"]["met"], first["requirements"]["stated"]
            ),
            (true, n) => {
                format!("requirements are not met, {n} of {} missed", first["requirements"]["stated"])
            }
        };
        assert!(review.contains(&sentence), "{name}: {sentence}");
    }
}

#[test]
fn what_design_says_every_command_repeats() {
    (1..=2).for_each(|seed| holds(seed, seed == 1));
}

/// All commands on 200 tasks: some minutes.
#[test]
#[ignore = "full length: .ci/run release"]
fn what_design_says_every_command_repeats_in_200_tasks() {
    (1..=200).for_each(|seed| holds(1000 + seed, seed % 10 == 0));
}

/// Sigmas at the end with random drift and a prior, by normal equations of all samples with one more unknown
/// for the drift of each step; also without the samples of the first 20 s of each position. No filter takes
/// part.
#[test]
fn predicted_sigmas_are_those_of_least_squares() {
    for (settle, left_out) in [("", 0), ("[record]\nsettle = 20\n", 2)] {
        are_those_of_least_squares(settle, left_out);
    }
}

fn are_those_of_least_squares(settle: &str, left_out: usize) {
    let scheme = "carry = \"inertial\"\nlatitude_deg = 40\n[simulation]\ndwell_s = 60\nstep_s = 10\n\
                  accelerometer_noise_g = 2e-5\ndrift_noise = \"3 deg/h\"\n\
                  priors = { D_F = 20, D_I = 10, D_O = 10, D_S = 10, psi = 0.2 }\n[requirements]\npsi = 0.1\nD_F = 19\n\
                  [[position]]\nangles_deg = [10, 25, 40]\n[[position]]\nangles_deg = [130, -50, 70]\n[[position]]\n\
                  angles_deg = [-95, 33, -160]\n";
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scheme.toml");
    std::fs::write(&file, scheme.replace("[requirements]", &format!("{settle}[requirements]")))
        .expect("a file");
    let answer = json(&["compare", &file.display().to_string(), "--format", "json"]);
    let found: Vec<f64> = answer["schemes"][0]["quantities"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|q| q["sigma"].as_f64().expect("a sigma"))
        .collect();
    let expected = by_normal_equations(left_out);
    for (i, (a, b)) in found.iter().zip(&expected).enumerate() {
        assert!((a / b - 1.0).abs() < 2e-3, "unknown {i}: {a} against {b}");
    }
    assert_eq!(found.len(), 15);
    let met = found[..3].iter().all(|s| *s <= 0.1) && found[3..6].iter().all(|s| *s <= 19.0);
    assert_eq!(answer["schemes"][0]["meets_requirements"], met);
}

/// Reference computation: psi' = -[w x] psi + C E D + n in n, Z1 = psi_z, Z3 = -psi_x, steps of 0.1 s, n
/// constant over 10 s. Of each position the first `left_out` samples do not count.
fn by_normal_equations(left_out: usize) -> Vec<f64> {
    const STEPS: usize = 6;
    let (dph, deg) = (1f64.to_radians() / 3600.0, 1f64.to_radians());
    let w = 7.292115e-5;
    let (wn, wu) = (w * (40.0 * deg).cos(), w * (40.0 * deg).sin());
    let f = DMatrix::from_row_slice(3, 3, &[0.0, 0.0, -wu, 0.0, 0.0, wn, wu, -wn, 0.0]);
    let positions: [[f64; 3]; 3] = [[10.0, 25.0, 40.0], [130.0, -50.0, 70.0], [-95.0, 33.0, -160.0]];
    let n = 15 + 9 * STEPS;
    let attitude = |a: &[f64; 3]| {
        let [(sa, ca), (sb, cb), (sg, cg)] = a.map(|x| (x * deg).sin_cos());
        let mx = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, 0.0, ca, sa, 0.0, -sa, ca]);
        let my = DMatrix::from_row_slice(3, 3, &[cb, 0.0, -sb, 0.0, 1.0, 0.0, sb, 0.0, cb]);
        let mz = DMatrix::from_row_slice(3, 3, &[cg, sg, 0.0, -sg, cg, 0.0, 0.0, 0.0, 1.0]);
        mx * my * mz
    };
    let first = attitude(&positions[0]);
    // psi^n as a functional of psi in c of the first position, the coefficients and the drift of each step
    let mut psi = DMatrix::zeros(3, n);
    psi.view_mut((0, 0), (3, 3)).copy_from(&first);
    let mut information = DMatrix::<f64>::zeros(n, n);
    let (prior_psi, held) = ((0.2 * deg).powi(-2), (3.0 * dph).powi(-2));
    (0..3).for_each(|i| information[(i, i)] += prior_psi);
    for i in 3..15 {
        let sigma = if i < 6 { 20.0 } else { 10.0 };
        information[(i, i)] += (sigma * dph).powi(-2);
    }
    (15..n).for_each(|i| information[(i, i)] += held);
    for (p, angles) in positions.iter().enumerate() {
        let c = attitude(angles);
        let g = c.transpose() * DMatrix::from_column_slice(3, 1, &[0.0, -1.0, 0.0]);
        let (gx, gy, gz) = (g[0], g[1], g[2]);
        // D_F, D_I, D_O, D_S of X, Y, Z
        let mut e = DMatrix::zeros(3, 12);
        let rows = [[1.0, gx, -gz, gy], [1.0, gy, -gz, -gx], [1.0, gz, gx, gy]];
        let order = |gyro: usize, term: usize| 3 * term + gyro;
        for (gyro, row) in rows.iter().enumerate() {
            // order of (22), (23), (27), (28): I, O, S after F
            row.iter().enumerate().for_each(|(term, x)| e[(gyro, order(gyro, term))] = *x);
        }
        for step in 0..STEPS {
            let mut drift = DMatrix::zeros(3, n);
            drift.view_mut((0, 3), (3, 12)).copy_from(&(&c * &e));
            drift.view_mut((0, 15 + 3 * (p * STEPS + step)), (3, 3)).copy_from(&DMatrix::identity(3, 3));
            for _ in 0..100 {
                let slope = |x: &DMatrix<f64>| &f * x + &drift;
                let (k1, h) = (slope(&psi), 0.1);
                let k2 = slope(&(&psi + &k1 * (h / 2.0)));
                let k3 = slope(&(&psi + &k2 * (h / 2.0)));
                let k4 = slope(&(&psi + &k3 * h));
                psi += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
            }
            if step < left_out {
                continue;
            }
            for row in [psi.row(2).into_owned(), -psi.row(0).into_owned()] {
                information += row.transpose() * &row * 2e-5f64.powi(-2);
            }
        }
    }
    let covariance = information.try_inverse().expect("it is regular");
    let end = first.transpose() * psi;
    let sigma = |row: &DMatrix<f64>| (row * &covariance * row.transpose())[(0, 0)].sqrt();
    let unit = |i: usize| DMatrix::from_fn(1, n, |_, j| f64::from(u8::from(i == j)));
    let angles = (0..3).map(|k| sigma(&end.rows(k, 1).into_owned()) / deg);
    angles.chain((3..15).map(|i| sigma(&unit(i)) / dph)).collect()
}

/// Samples at the start of positions that the record leaves out count in no command: `simulate`, `compare`,
/// `procedure`, `design` and the engine of the page give the same uncertainty of every coefficient. Its sigma
/// is larger than with all samples; a total with a bench need not be.
#[test]
#[ignore = "seconds: .ci/run"]
fn samples_that_the_record_leaves_out_count_nowhere() {
    let positions = ["NUE", "USE", "EDN", "WND", "DNE"].map(|n| format!("[[position]]\nattitude = '{n}'\n"));
    let slews = "slew_rate_deg_s = 2\n";
    let cases = [
        ("inertial", slews, ""),
        ("inertial", "", "[bench]\nK0 = 20\nlatitude = 10\n"),
        ("platform", "accelerometer_bias_instability_ug = 2\n", ""),
    ];
    for (carry, conditions, bench) in cases {
        let with = |settle: &str| {
            let text = format!(
                "carry = '{carry}'\nlatitude_deg = 40\n[simulation]\ndwell_s = 300\n{conditions}\
                 priors = {{ psi = 0.1 }}\n{bench}[requirements]\nD = 0.1\n{settle}{}",
                positions.concat()
            );
            uncertainties(&text, &format!("{carry} {conditions}{bench}{settle}"))
        };
        // 200 s are more than half of a dwell, which `compare` tries too
        let waits = ["", "[record]\nsettle = 47\n", "[record]\nsettle = 200\n"];
        let waits = if bench.is_empty() { &waits[..2] } else { &waits };
        let found: Vec<_> = waits.iter().copied().map(with).collect();
        for (all, fewer) in found.windows(2).flat_map(|pair| pair[0].iter().zip(&pair[1])) {
            let (Some(all), Some(fewer)) = (all.as_f64(), fewer.as_f64()) else { continue };
            assert!(fewer > 1.01 * all, "{carry} {conditions}{bench}: {all} {fewer}");
        }
    }
}

/// Sigma of each coefficient, the same by every command, as is its uncertainty with the bench.
fn uncertainties(text: &str, name: &str) -> Vec<Value> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("settling.toml").display().to_string();
    std::fs::write(&file, text).expect("a file");
    let coefficients = |of: &Value| {
        let all = of.as_array().expect("a list").iter();
        all.filter(|q| q["name"].as_str().is_some_and(|n| n.starts_with("D_"))).cloned().collect::<Vec<_>>()
    };
    let compared = &json(&["compare", &file, "--format", "json"])["schemes"][0];
    let expected = coefficients(&compared["quantities"]);
    let simulated = json(&["simulate", &file, "--format", "json"]);
    let sheet = json(&["procedure", &file, "--format", "json"]);
    let total = |q: &Value| if q["total"].is_null() { q["sigma"].clone() } else { q["total"].clone() };
    for ((q, s), c) in
        expected.iter().zip(coefficients(&simulated["quantities"])).zip(coefficients(&sheet["coefficients"]))
    {
        assert!(same(&q["sigma"], &s["predicted_sigma"]), "{name}: {q} {s}");
        assert!(same(&total(q), &c["uncertainty"]), "{name}: {q} {c}");
    }
    agree(name, "procedure", compared, &sheet);
    let positions = compared["positions"].as_array().map_or(0, Vec::len).to_string();
    let winner = folder.path().join("w").display().to_string();
    let design = json(&["design", &file, "--positions", &positions, "--format", "json", "-o", &winner]);
    let found = &design["found"][0];
    let [best, own] = [&found["worst_sigma_dph"], &compared["worst"]["sigma_dph"]].map(Value::as_f64);
    assert!(best.is_some() && best <= own.map(|s| 1.000001 * s), "{name}: {best:?} {own:?}");
    let again = &json(&["compare", &format!("{winner}/winner.toml"), "--format", "json"])["schemes"][0];
    assert!(same(&found["worst_sigma_dph"], &again["worst"]["sigma_dph"]), "{name}: {found} {again}");
    let asked = object!({ "sources": [{ "name": "settling.toml", "text": text }] });
    let page = call_json("compare", &asked.to_string(), &mut Host { worker: None, progress: &|_| true });
    let page: Value = serde_json::from_str(&page.expect("an answer").text).expect("JSON");
    assert!(&page["schemes"][0] == compared, "{name}: the page");
    expected.iter().map(|q| q["sigma"].clone()).collect()
}

//! The program end to end: real processes, real files.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Output, Stdio};

use serde_json::Value;

use crate::program::{json, obsdeg, refused, run, scratch, stderr, stdout};

/// Scheme with solutions that contain the sine of 25 degrees.
const CONSTANT: [&str; 5] = ["analyze", "--angles", "25,0,0", "--angles", "NUE"];
const P1P2: [&str; 5] = ["analyze", "--angles", "0,0,0", "--angles", "180,0,0"];

#[test]
fn the_main_job_as_json() {
    let a = json(&[&P1P2[..], &["--format", "json"]].concat());
    assert_eq!(a["schema"], "obsdeg.analysis/1");
    assert_eq!(a["carry"], "platform");
    assert_eq!(a["latitude_deg"], Value::Null);
    assert_eq!(a["rank"], 8);
    assert_eq!(a["rank_profile"], serde_json::json!([2, 6, 8]));
    assert_eq!(a["unknowns"].as_array().map(Vec::len), Some(15));
    assert_eq!(a["positions"][1]["angles_deg"], serde_json::json!([180.0, 0.0, 0.0]));
    let quantity = |name: &str| {
        let list = a["quantities"].as_array().expect("a list");
        list.iter().find(|q| q["name"] == name).expect("it is there").clone()
    };
    assert_eq!(quantity("D_FX")["degree"], 1);
    assert_eq!(quantity("D_FX")["solution"]["text"], "1/2 [ wU (Z1@p1 + Z1@p2) - Z3'@p1 - Z3'@p2 ]");
    assert_eq!(quantity("psi_y")["status"], "inseparable");
    assert_eq!(quantity("psi_y")["partners"], serde_json::json!(["D_FZ"]));
    assert_eq!(quantity("D_IX")["status"], "not_excited");
    assert_eq!(a["combinations"][0]["expression"], "D_FZ - wN*psi_y");
    assert_eq!(a["null_space"][0][1], serde_json::json!({"name": "D_FZ", "coefficient": "wN"}));
    let carries: Vec<&Value> = a["carries"].as_array().expect("a list").iter().map(|c| &c["carry"]).collect();
    assert_eq!(carries, ["inertial", "reset"]);
    assert!(a["certainty"]["error_bound"].as_f64().expect("a number") < 1e-20);
}

/// Verbatim output of the paper's case, with and without the symbolic engine.
#[test]
fn the_main_job_as_text() {
    for format in ["table", "markdown", "csv", "latex"] {
        let output = run(&[&P1P2[..], &["--format", format, "--solutions", "off"]].concat());
        assert!(output.status.success() && output.stderr.is_empty());
        insta::assert_snapshot!(format!("p1p2_{format}"), stdout(&output));
    }
}

/// Solutions in rational numbers and square roots do not start the symbolic engine.
#[test]
fn solutions_of_the_fields_wait_for_no_engine() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = obsdeg(&[&P1P2[..], &["--format", "json"]].concat())
        .env("XDG_RUNTIME_DIR", folder.path())
        .output()
        .expect("it runs");
    assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
    let a: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let list = a["quantities"].as_array().expect("a list");
    let d_fx = list.iter().find(|q| q["name"] == "D_FX").expect("it is there");
    assert_eq!(d_fx["solution"]["text"], "1/2 [ wU (Z1@p1 + Z1@p2) - Z3'@p1 - Z3'@p2 ]");
    assert_eq!(d_fx["solution"]["form"], "exact");
    assert_eq!(d_fx["solution"]["found_by"], "prime_fields");
    assert_eq!(d_fx["solution"]["verification"], "modular");
    assert_eq!(a["notes"], serde_json::json!([]));
}

/// Solutions of quantities and combinations in an answer, by name or expression.
fn solutions_of(a: &Value) -> BTreeMap<String, Value> {
    let lists = ["quantities", "combinations"].map(|key| a[key].as_array().expect("a list"));
    let name = |q: &Value| q["name"].as_str().or(q["expression"].as_str()).expect("a name").to_string();
    lists.into_iter().flatten().map(|q| (name(q), q["solution"].clone())).collect()
}

/// A short product of sines and cosines needs no engine: what is in closed form without it is so with it, and
/// is recovered from its images in the prime fields.
#[test]
fn short_products_need_no_engine() {
    let scheme = ["analyze", "--angles", "0,0,0", "--angles", "40,0,0", "--format", "json"];
    let without = solutions_of(&json(&[&scheme[..], &["--symbolic-limit", "0"]].concat()));
    let with = solutions_of(&json(&scheme));
    let mut closed = 0;
    for (name, own) in without.iter().filter(|(_, own)| own["form"] == "symbolic") {
        closed += 1;
        assert_eq!(own["found_by"], "prime_fields", "{own}");
        assert_eq!(own["verification"], "modular", "{own}");
        assert!(own["text"].as_str().expect("a text").contains("(40 deg)"), "{own}");
        if let Some(other) = with.get(name).filter(|_| cfg!(feature = "symbolica")) {
            assert_eq!(other["form"], "symbolic", "{other}");
        }
    }
    assert!(closed >= 3, "{without:?}");
    assert_eq!(without["psi_y"]["text"], "(cos(40 deg)/sin(40 deg)) Z1@p1 - (1/sin(40 deg)) Z1@p2");
}

/// Solutions with sums of sines and cosines are printed with decimals if the engine is not available. A work
/// limit of zero stops the engine before its first answer.
#[test]
fn without_the_engine_solutions_are_decimals_and_it_is_said() {
    let refused = json(&[&CONSTANT[..], &["--format", "json", "--symbolic-limit", "0"]].concat());
    assert!(solutions_of(&refused).values().any(|s| s["found_by"] == "floating_point"), "{refused}");
    let note = refused["notes"].to_string();
    let reason = if cfg!(feature = "symbolica") { "switched off by a limit of 0" } else { "built without" };
    assert!(note.contains(reason), "{note}");
}

#[test]
fn eight_at_once_all_succeed_with_clean_output() {
    let children: Vec<Child> = (0..8)
        .map(|_| {
            let mut command = obsdeg(&[&CONSTANT[..], &["--format", "json"]].concat());
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
        })
        .collect();
    let outputs: Vec<Output> = children.into_iter().map(|c| c.wait_with_output().expect("it ends")).collect();
    for output in &outputs {
        assert!(output.status.success(), "{}", stderr(output));
        assert_eq!(output.stdout, outputs[0].stdout);
        let a: Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
        if cfg!(feature = "symbolica") {
            let list = a["quantities"].as_array().expect("a list");
            let by_engine = |q: &&Value| q["solution"]["found_by"] == "symbolic_engine";
            let found = list.iter().find(by_engine).expect("one has a sine");
            assert_eq!(found["solution"]["verification"], "symbolic");
        }
    }
}

#[test]
fn solutions_off_never_starts_the_engine() {
    let folder = tempfile::tempdir().expect("a folder");
    let with = |switch: &str| {
        let arguments = [&CONSTANT[..], &["--solutions", switch]].concat();
        let output = obsdeg(&arguments).env("XDG_RUNTIME_DIR", folder.path()).output().expect("it runs");
        assert!(output.status.success());
        output
    };
    let off = with("off");
    assert!(off.stderr.is_empty());
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
}

/// A row states in every format where the dwell changes a degree or leaves an unknown undetermined.
#[test]
fn rows_say_what_the_dwell_makes_of_a_degree() {
    let pole = ["--angles", "0,0,0", "--angles", "0,90,0", "--angles", "45,0,0", "--latitude", "90"];
    // four generic positions: psi has degree 0 and accuracy order 1
    let four =
        ["--angles", "10,25,40", "--angles", "130,-50,70", "--angles", "-95,33,-160", "--angles", "60,80,15"];
    for (scheme, unknown, latex, expected) in [
        (&pole[..], "psi_y", "$\\psi_{y}$", "not determined"),
        (&four[..], "psi_z", "$\\psi_{z}$", "order 1"),
    ] {
        let text = |format: &str| {
            stdout(&run(&[&["analyze", "--solutions", "off", "--format", format], scheme].concat()))
        };
        let row = |format: &str, begins: &str, cell: &str| {
            let text = text(format);
            let row = text.lines().map(str::trim_start).find(|l| l.starts_with(begins));
            let row = row.unwrap_or_else(|| panic!("no row {begins}: {text}")).to_string();
            assert!(row.contains(cell), "{format}: {row}");
            // a row whose degree does not change with dwell says nothing of it
            let other = text.lines().find(|l| l.contains("psi_x") || l.contains("psi_{x}")).expect("psi_x");
            assert!(!other.contains("not determined"), "{other}");
        };
        row("table", &format!("{unknown} "), expected);
        row("markdown", &format!("| `{unknown}` |"), &format!("| {expected} |"));
        row("latex", latex, &format!("& {expected} &"));
    }
    // the column is missing where all orders equal the degrees, and where orders are not computed
    let same = stdout(&run(&["analyze", "--angles", "0,0,0", "--angles", "180,0,0", "--solutions", "off"]));
    let turning =
        stdout(&run(&["analyze", "--scheme", "examples/tumbling/scheme.toml", "--solutions", "off"]));
    assert!(!same.contains("with dwell") && !turning.contains("with dwell"));
}

#[test]
fn bad_input_is_refused_by_name() {
    let angles = |text: &'static str| ["analyze", "--angles", text];
    refused(&angles("0,0"), &["0,0", "2 angle(s)", "expected three"]);
    refused(&angles("0,0,0,0"), &["4 angle(s)", "expected three"]);
    refused(&angles(""), &["0 angle(s)"]);
    refused(&angles("0,x y,0"), &["beta", "`x y` is not a number"]);
    refused(&angles("nan,0,0"), &["alpha", "`nan` is not finite"]);
    refused(&angles("0,0,-inf"), &["gamma", "is not finite"]);
    refused(&angles("0,0.1234567891,0"), &["10 decimals", "at most 9"]);
    refused(&angles("0,,0"), &["beta", "an angle is missing"]);
    refused(&angles("1e9,0,0"), &["is not a number"]);
    refused(&angles("2000000,0,0"), &["out of range"]);
    refused(&angles("NUW"), &["`NUW` is not an attitude", "right-handed"]);
    refused(&angles("nue"), &["small letters", "as in NUE"]);
    refused(&angles("0 0 0"), &["no commas", "as in 0,0,0"]);
    refused(&angles("--carry"), &["expected three angles", "`--carry`"]);
    refused(&[&P1P2[..], &["--carry", "sideways"]].concat(), &["'sideways'", "platform, inertial, reset"]);
    refused(&[&P1P2[..], &["--latitude", "91"]].concat(), &["latitude 91", "-90 to 90"]);
    refused(&[&P1P2[..], &["--latitude", "nan"]].concat(), &["latitude", "not finite"]);
    refused(&[&P1P2[..], &["--terms", "F,Q"]].concat(), &["`Q` is not a term"]);
    refused(&[&P1P2[..], &["--terms", "drift"]].concat(), &["single position", "found 2"]);
    refused(&[&P1P2[..], &["--format", "xml"]].concat(), &["'xml'", "table, json, markdown, csv, latex"]);
    refused(&[&P1P2[..], &["--combination", "D_FZ - D_IW"]].concat(), &["`D_IW`", "did you mean", "^^^^"]);
    refused(&[&P1P2[..], &["--combination", "D_FX*D_FY"]].concat(), &["not linear"]);
    for other in ["psi_y/D_FX", "1/D_FX", "D_FX + 1", "D_FX/(1 + psi_y)"] {
        refused(&[&P1P2[..], &["--combination", other]].concat(), &["not linear"]);
    }
    refused(&[&P1P2[..], &["--combination", "D_FX/(wN - wN)"]].concat(), &["division by zero"]);
    for zero in ["0*D_FX", "D_FX - D_FX", "(sin(180 deg))*psi_y", "0"] {
        refused(&[&P1P2[..], &["--combination", zero]].concat(), &["always zero"]);
        refused(&["simulate", "--angles", "180,0,0", "--combination", zero], &["always zero"]);
    }
    refused(&[&P1P2[..], &["--combination", "abs(D_FX)"]].concat(), &["known function", "found `abs`"]);
    refused(&[&P1P2[..], &["--combination", "D_FX +"]].concat(), &["end of the expression"]);
    refused(&["analyze", "--scheme", "no/such/file.toml"], &["no/such/file.toml"]);
    refused(&["analyze"], &["FILE", "--angles"]);
    refused(&["analyze", "--angles", "0,0,0", "--scheme", "x.toml"], &["cannot be used with"]);
    refused(&["frobnicate"], &["unrecognized subcommand"]);
}

/// Common mistakes in a first scheme file and in a first model are named.
#[test]
fn slips_of_a_first_file() {
    let (folder, _) = scratch();
    let file = folder.path().join("s.toml").display().to_string();
    let one = "[[position]]\nangles_deg = [0, 0, 0]\n";
    let top = "belongs at the top of the file";
    for (text, expected) in [
        (format!("latitude_deg = 48,5\n{one}"), "expected a decimal point, as in 48.5"),
        (one.replace(',', ""), "`0 0 0` has no commas"),
        (format!("latitude = 48\n{one}"), "did you mean `latitude_deg`?"),
        (format!("Latitude = 48\n{one}"), "did you mean `latitude_deg`?"),
        (one.replace("_deg", ""), "did you mean `angles_deg`?"),
        (format!("{one}[simulation]\nslew_rate = 1\n"), "did you mean `slew_rate_deg_s`?"),
        (format!("{one}latitude_deg = 48\n"), top),
        (format!("{one}latitude = 48\n"), top),
        (format!("{one}[requirements]\nD = 1\n[simulation]\ncarry = 'reset'\n"), top),
        (format!("dwell_s = 5\n{one}"), "`dwell_s` belongs in [simulation] or in [[position]]"),
        (format!("{one}[requirements]\nd_fx = 1\n"), "did you mean `D_FX`?"),
        (format!("{one}[simulation.priors]\nPsi = 1\n"), "did you mean `psi`?"),
    ] {
        std::fs::write(&file, &text).expect("written");
        refused(&["analyze", "--scheme", &file], &[expected, "s.toml:", "^"]);
    }
    let model =
        |equation: &str| format!("parameters = ['a']\n[states]\nx = \"{equation}\"\n[outputs]\ny = 'x'\n");
    for (text, expected) in [
        // a missing name is reported last, so that it hides no other error
        (model("-a*x"), "the key `name` is missing"),
        (model("-a*x +"), "the equation of x: expected"),
        (model("-a*y"), "`y` is"),
        (format!("name = 'n'\n{}", model("-arcsin(x)")), "found `arcsin`"),
        (format!("name = 'n'\n{}[simulation]\nstep = 0,5\n", model("-x")), "as in 0.5"),
        (format!("name = 'n'\nduration = 5\n{}", model("-x")), "`duration` belongs in [simulation]"),
    ] {
        std::fs::write(&file, &text).expect("written");
        refused(&["analyze", "--model", &file], &[expected, "s.toml:", "^"]);
    }
}

/// Zero drift noise needs no unit.
#[test]
fn no_drift_noise() {
    let run =
        |noise: &str| json(&["simulate", "--angles", "0,0,0", "--drift-noise", noise, "--format", "json"]);
    assert_eq!(run("0"), run("0 deg/h"));
    assert_ne!(run("0"), run("0.01 deg/h"));
    refused(
        &["simulate", "--angles", "0,0,0", "--drift-noise", "0.01"],
        &["expected 0, or a number with a unit"],
    );
}

/// Every command that reads a scheme file checks the whole file.
#[test]
fn every_command_checks_the_whole_scheme_file() {
    let (folder, _) = scratch();
    let file = folder.path().join("s.toml").display().to_string();
    let out = folder.path().join("r.html").display().to_string();
    let commands: [&[&str]; 6] = [
        &["analyze", "--scheme", &file],
        &["simulate", "--scheme", &file],
        &["crosscheck", "--scheme", &file],
        &["compare", &file],
        &["design", "--minimum", "--candidates", &file],
        &["report", &file, "-o", &out],
    ];
    for (keys, expected) in [
        ("[simulation]\ndwell_s = -5", "simulation.dwell_s is -5; expected 0.001 to 1e6 s"),
        ("[simulation]\nslew_rate_deg_s = 0", "simulation.slew_rate_deg_s is 0; expected"),
        ("[simulation.priors]\nD_F = nan", "simulation.priors.D_F is NaN; expected"),
        ("[requirements]\nD = -0.1", "requirements.D is -0.1; expected"),
        ("[requirements]\nD_QX = 0.1", "`D_QX`: no such unknown"),
        ("[[position]]\nname = \"p1\"\nattitude = \"NDW\"", "two positions are named `p1`"),
    ] {
        std::fs::write(&file, format!("[[position]]\nattitude = \"NUE\"\n{keys}\n")).expect("written");
        for command in commands {
            refused(command, &[expected, "s.toml:", "^"]);
        }
    }
    refused(
        &["crosscheck", "--angles", "0,0,0", "--filter-drop", "p1"],
        &["only position cannot be dropped"],
    );
}

#[test]
fn a_file_of_the_other_kind_is_named() {
    let (scheme, model) = ("examples/pole/scheme.toml", "examples/sir/model.toml");
    refused(&["analyze", "--model", scheme], &["is a scheme file; expected a model file"]);
    refused(&["analyze", "--scheme", model], &["is a model file; expected a scheme file"]);
    refused(&["compare", model], &["is a model file; expected scheme files"]);
    let (folder, _) = scratch();
    let file = folder.path().join("m.json").display().to_string();
    for (text, expected) in [
        (r#"{"name": 3}"#, &["found the number 3; expected a text in quotes", "m.json:1:10", "^"][..]),
        (r#"{"name": "x", "states": ["x"]}"#, &["`equations` is missing", "m.json:1:30"]),
        (
            "{\"name\": \"x\",\n \"states\": [\"x\"],\n \"equations\": {\"x\": \"y+\"}, \"outputs\": {\"y\": \"x\"}}",
            &["end of the expression", "m.json:3:24"],
        ),
        (
            "{\"name\": \"x\",\n \"states\": [\"x\"],\n \"equations\": {\"x\": 5}, \"outputs\": {\"y\": \"x\"}}",
            &["found a number; expected a text in quotes", "m.json:3:22"],
        ),
    ] {
        std::fs::write(&file, text).expect("written");
        refused(&["analyze", "--model", &file], expected);
    }
}

/// The help states the accepted ranges of numbers.
#[test]
fn the_help_states_the_ranges() {
    use obsdeg_core::model::ranges;
    let help = stdout(&run(&["simulate", "--help"])).split_whitespace().collect::<Vec<_>>().join(" ");
    for range in [
        ranges::DWELL_S,
        ranges::STEP_S,
        ranges::NOISE_G,
        ranges::AZIMUTH_NOISE_DEG,
        ranges::SLEW_RATE_DEG_S,
        ranges::DRIFT_NOISE,
        ranges::DRIFT_SCALE,
        ranges::PRIOR,
        ranges::VALUE,
        ranges::REQUIREMENT,
    ] {
        assert!(help.contains(&format!("{range})")), "{range}: {help}");
    }
}

#[test]
fn negative_angles_names_and_directions_are_accepted() {
    let a = json(&[
        "analyze",
        "--angles",
        "-90,0,0",
        "--latitude",
        "-28.2",
        "--format",
        "json",
        "--solutions",
        "off",
    ]);
    assert_eq!(a["positions"][0]["angles_deg"], serde_json::json!([-90.0, 0.0, 0.0]));
    assert_eq!(a["latitude_deg"], -28.2);
    let a =
        json(&["analyze", "--angles", "NUE", "--angles", "NDW", "--format", "json", "--solutions", "off"]);
    assert_eq!(a["rank_profile"], serde_json::json!([2, 6, 8]));
    let a = json(&["analyze", "--angles", "-alpha,0,gamma+90", "--format", "json", "--solutions", "off"]);
    assert_eq!(a["positions"][0]["angles_deg"], serde_json::json!(["-alpha", 0.0, "gamma+90"]));
    let a =
        json(&[&P1P2[..], &["--terms", "F,I,O,S,SS,IS", "--format", "json", "--solutions", "off"]].concat());
    assert_eq!(a["unknowns"].as_array().map(Vec::len), Some(21));
}

#[test]
fn four_hundred_positions_and_duplicates() {
    let list: Vec<String> =
        (0..400).map(|i| format!("{},{},{}", i % 90 * 4, i % 7 * 50, i / 2 % 36 * 10)).collect();
    let mut arguments = vec!["analyze", "--solutions", "off", "--format", "json"];
    for angles in &list {
        arguments.extend(["--angles", angles]);
    }
    assert_eq!(json(&arguments)["rank"], 15);
}

fn write_to(file: &Path, more: &[&str]) -> Output {
    let path = file.to_string_lossy();
    run(&[&P1P2[..], &["--solutions", "off", "--format", "json", "-o", &path], more].concat())
}

#[test]
fn files_are_written_whole_and_replaced_only_on_demand() {
    let (folder, file) = scratch();
    let output = write_to(&file, &[]);
    assert!(output.status.success() && output.stdout.is_empty());
    let first = std::fs::read(&file).expect("written");
    std::fs::write(&file, "mine").expect("writable");
    let output = write_to(&file, &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--force"));
    assert_eq!(std::fs::read(&file).expect("kept"), b"mine");
    assert!(write_to(&file, &["--force"]).status.success());
    assert_eq!(std::fs::read(&file).expect("replaced"), first);
    // bad input writes nothing and leaves no temporary file
    let missing = folder.path().join("other.json");
    assert_eq!(write_to(&missing, &["--latitude", "91"]).status.code(), Some(2));
    let unwritable = folder.path().join("no/such/folder/x.json");
    assert_eq!(write_to(&unwritable, &[]).status.code(), Some(2));
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
}

#[test]
fn same_command_same_bytes() {
    let arguments = [&P1P2[..], &["--format", "markdown"]].concat();
    assert_eq!(run(&arguments).stdout, run(&arguments).stdout);
}

#[test]
fn the_paper_is_audited() {
    let output = run(&["paper", "--format", "csv"]);
    assert!(output.status.success());
    insta::assert_snapshot!("paper", stdout(&output));
    let a = json(&["paper", "--format", "json", "--seed", "5"]);
    assert_eq!(a["schema"], "obsdeg.audit/1");
    let find = |place: &str| {
        let lines = a["lines"].as_array().expect("a list");
        lines.iter().find(|l| l["place"] == place).expect("a line")["finding"].clone()
    };
    assert_eq!(
        (find("(20)"), find("(21)"), find("conclusion 2")),
        ("agree".into(), "disagree".into(), "agree".into())
    );
    // every format lists the limitations, as many as the JSON
    let lines = a["lines"].as_array().expect("a list");
    let open = lines.iter().filter(|l| l["finding"] == "not_covered").count();
    assert!(open > 0);
    for format in ["table", "markdown", "latex", "csv"] {
        let text = stdout(&run(&["paper", "--format", format]));
        let (word, title) = if format == "csv" { ("not_covered", 0) } else { ("not covered", 1) };
        assert_eq!(text.matches(word).count(), open + title, "{format}: {text}");
        assert!(text.contains("eps"));
    }
    let counted = |finding: &str| lines.iter().filter(|l| l["finding"] == finding).count();
    let [agree, conditional, disagree] = ["agree", "conditional", "disagree"].map(counted);
    let title = stdout(&run(&["paper", "--format", "markdown"]));
    let expected =
        format!("{agree} agree, {conditional} with a condition, {disagree} disagree, {open} not covered");
    assert!(title.lines().next().is_some_and(|t| t.contains(&expected)), "{title}");
}

#[test]
fn help_shows_examples_and_exit_codes() {
    let help = stdout(&run(&["analyze", "--help"]));
    for command in ["simulate", "crosscheck"] {
        let help = stdout(&run(&[command, "--help"]));
        assert!(help.contains(&format!("obsdeg {command} --angles 0,0,0")) && help.contains("Exit codes"));
    }
    assert!(help.contains("obsdeg analyze --angles 0,0,0 --angles 180,0,0") && help.contains("Exit codes"));
    assert!(!stdout(&run(&["--help"])).contains("symbolic-worker"));
}

/// Solutions and degenerate angles that only the symbolic engine finds.
#[cfg(feature = "symbolica")]
#[test]
fn generic_angles_with_the_engine() {
    let output =
        run(&["analyze", "--scheme", "examples/generic-angles/scheme.toml", "--formulas", "--quiet"]);
    assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
    insta::assert_snapshot!("generic_angles", stdout(&output));
    let arguments = ["analyze", "--angles", "25,0,0", "--angles", "NUE", "--frame", "platform", "--quiet"];
    insta::assert_snapshot!("constant_angle_platform_frame", stdout(&run(&arguments)));
    let arguments = ["analyze", "--angles", "15,0,0", "--angles", "0,0,45", "--quiet", "--format", "csv"];
    insta::assert_snapshot!("radicals", stdout(&run(&arguments)));
}

/// The licence notice of the engine goes to stderr; --quiet suppresses it.
#[cfg(feature = "symbolica")]
#[test]
fn the_banner_stays_off_stdout() {
    let plain = run(&CONSTANT);
    assert!(!stdout(&plain).contains("restricted"));
    let quiet = run(&[&CONSTANT[..], &["--quiet"]].concat());
    assert_eq!(stdout(&plain), stdout(&quiet));
    assert!(quiet.stderr.is_empty());
}

/// The notice is printed if one of several answers needed the engine, whichever came last.
#[cfg(feature = "symbolica")]
#[test]
fn the_banner_is_kept_among_several() {
    let (model, scheme) = ("examples/lotka-volterra/model.toml", "examples/pole/scheme.toml");
    let alone = stderr(&run(&["analyze", model]));
    for files in [[model, scheme], [scheme, model]] {
        assert_eq!(stderr(&run(&["analyze", files[0], files[1]])), alone);
    }
    assert!(stderr(&run(&["analyze", scheme])).is_empty());
}

/// The positions of every scheme are drawn, each scheme in a folder of its own.
#[test]
fn positions_are_drawn() {
    let (folder, _) = scratch();
    let at = folder.path().join("pictures");
    let to = ["--solutions", "off", "--figures", at.to_str().expect("UTF-8")];
    let plain = stdout(&run(&[&P1P2[..], &["--solutions", "off"]].concat()));
    assert_eq!(stdout(&run(&[&P1P2[..], &to].concat())), plain);
    let svg = std::fs::read_to_string(at.join("positions.svg")).expect("written");
    assert!(svg.starts_with("<svg") && svg.contains("p2"), "{svg}");
    refused(&[&P1P2[..], &to].concat(), &["positions.svg exists; --force"]);
    let several = ["examples/pole/scheme.toml", "examples/six-positions/scheme.toml"];
    assert!(run(&[&["analyze"], &several[..], &to].concat()).status.success());
    assert!(at.join("pole-positions.svg").is_file() && at.join("six-positions-positions.svg").is_file());
    refused(&[&["analyze", "examples/sir/model.toml"], &to[2..]].concat(), &["--figures is about schemes"]);
    // a scheme that cannot be judged gets no pictures
    let none = folder.path().join("none");
    let to = ["--combination", "D_QQ", "--figures", none.to_str().expect("UTF-8")];
    refused(&[&P1P2[..], &to].concat(), &["D_QQ"]);
    assert!(!none.exists());
}

/// A scheme given by options and the same scheme in a file give the same answer.
#[test]
fn angles_and_a_file_mean_the_same() {
    let (folder, _) = scratch();
    let file = folder.path().join("same.toml");
    let text = r#"
carry = "inertial"
latitude_deg = 28.2
terms = ["F", "I", "S"]
combinations = ["D_IX - D_IY"]
[requirements]
D_F = 0.02
[[position]]
angles_deg = [0, 0, 0]
[[position]]
angles_deg = [-90, 12.5, 180]
[[position]]
attitude = "UEN"
rotation = { about = "Z_p", angle_deg = -120 }
"#;
    std::fs::write(&file, text).expect("written");
    let file = file.display().to_string();
    let angles = ["--angles", "0,0,0", "--angles", "-90,12.5,180", "--angles", "UEN@Z_p:-120"];
    let scheme =
        ["--carry", "inertial", "--latitude", "28.2", "--terms", "F,I,S", "--combination", "D_IX - D_IY"];
    for (command, more) in
        [("analyze", &["--solutions", "off"][..]), ("simulate", &["--requirement", "D_F=0.02"])]
    {
        let common = if command == "analyze" { more } else { &[][..] };
        let by_file = [&[command, "--scheme", &file, "--format", "json"][..], common].concat();
        let by_angles = [&[command, "--format", "json"][..], &angles, &scheme, more].concat();
        assert_eq!(json(&by_file), json(&by_angles), "{command}");
    }
}

/// Models from files: verdicts in every format, a run with its figures, and selected orders.
#[test]
fn models_from_files() {
    let model = "examples/lotka-volterra/model.toml";
    for format in ["table", "markdown", "latex", "csv", "json"] {
        let output = run(&["analyze", "--model", model, "--format", format]);
        assert!(output.status.success() && stdout(&output).contains("x2"), "{format}: {}", stderr(&output));
    }
    let a = json(&["analyze", "--model", model, "--format", "json"]);
    assert_eq!((&a["schema"], &a["rank"], &a["unknowns"]), (&"obsdeg.system/1".into(), &5.into(), &6.into()));
    assert_eq!(a["symmetries"][0]["words"], "multiply x2 by s; divide b by s");
    let (folder, _) = scratch();
    let out = folder.path().join("run").display().to_string();
    let r = json(&["simulate", "--model", model, "-o", &out, "--format", "json"]);
    assert_eq!(r["schema"], "obsdeg.system-run/1");
    for name in ["summary.json", "series.csv", "series.parquet", "all.svg", "x2.png"] {
        assert!(folder.path().join("run").join(name).is_file(), "{name}");
    }
    let text = stdout(&run(&["simulate", "--model", model]));
    assert!(text.contains("x2, b: not observable, yet the filter trusts"), "{text}");
    refused(&["analyze", "--model", model, "--angles", "0,0,0"], &["cannot be used with"]);
    refused(&["analyze", "--model", "no/such.toml"], &["cannot read the model file"]);
    refused(&["simulate", "--model", "examples/platform-as-model/model.toml"], &["[simulation.values]"]);
    let e = json(&["crosscheck", "--model", model, "--format", "json"]);
    assert_eq!((&e["schema"], &e["passed"]), (&"obsdeg.system-evidence/1".into(), &true.into()));
    refused(&["analyze"], &["--angles", "FILE"]);
}

/// A setting for one unknown takes precedence over a setting for its family, in any order. A setting that
/// concerns no unknown is refused.
#[test]
fn options_by_name_and_by_family() {
    const FIVE: &str = "examples/five-positions/scheme.toml";
    let single = ["--requirement", "D_FX=1e-6"];
    let family = ["--requirement", "D=10", "--requirement", "psi=10"];
    for command in [&["simulate", "--scheme", FIVE][..], &["compare", FIVE]] {
        let of = |order: [&[&str]; 2]| json(&[command, order[0], order[1], &["--format", "json"]].concat());
        let (one, other) = (of([&single, &family]), of([&family, &single]));
        assert_eq!(one, other);
        let requirements =
            if command[0] == "simulate" { &one["requirements"] } else { &one["schemes"][0]["requirements"] };
        assert_eq!(requirements["met"], 14, "{requirements}");
        assert_eq!(requirements["missed"][0]["name"], "D_FX");
    }
    for (option, given) in
        [("--requirement", "D_II=1"), ("--requirement", "D_IIX=1"), ("--requirement", "eps=1")]
            .into_iter()
            .chain([("--value", "D_IIX=3"), ("--prior", "D_SS=3"), ("--estimate", "psi_x@2=1")])
    {
        let output = run(&["simulate", "--scheme", FIVE, option, given]);
        assert_eq!(output.status.code(), Some(2), "{option} {given}");
        assert!(
            stderr(&output).contains(&format!("`{option} {given}`: no unknown here is")),
            "{}",
            stderr(&output)
        );
    }
    let refused = run(&["design", "--positions", "5", "--meet", "--requirement", "D_II=1e-9"]);
    assert_eq!(refused.status.code(), Some(2));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("s.toml").display().to_string();
    let scheme = "[requirements]\nD_II = 1e-9\n[[position]]\nangles_deg = [0, 0, 0]\n";
    std::fs::write(&path, scheme).expect("written");
    let output = run(&["analyze", "--scheme", &path]);
    assert!(stderr(&output).contains("`D_II`: no such unknown"), "{}", stderr(&output));
    std::fs::write(&path, format!("terms = [\"F\", \"II\"]\n{scheme}")).expect("written");
    assert!(run(&["analyze", "--scheme", &path, "--solutions", "off"]).status.success());
}

/// Under reset carry every position has a psi of its own: each is compared with the single psi of the other
/// carries.
#[test]
fn psi_under_the_other_carries() {
    let two =
        ["analyze", "--angles", "0,0,20", "--angles", "20,0,0", "--solutions", "off", "--format", "json"];
    let differing = |arguments: &[&str], carry: &str| -> Vec<String> {
        let a = json(arguments);
        let reports = a["carries"].as_array().expect("a list").clone();
        let report = reports.iter().find(|r| r["carry"] == carry).expect("the carry").clone();
        let names = report["differs"].as_array().expect("a list").iter();
        names.map(|d| d["name"].as_str().expect("a name").to_string()).collect()
    };
    let inseparable = ["psi_x@1", "psi_y@1", "psi_y@2", "psi_z@2"];
    assert_eq!(differing(&two, "reset"), inseparable);
    // the opposite comparison, then the verdicts under reset carry alone
    let reset = [&two[..], &["--carry", "reset"]].concat();
    assert_eq!(differing(&reset, "platform"), inseparable);
    let own = json(&reset);
    let quantities = own["quantities"].as_array().expect("a list");
    let unseen =
        quantities.iter().filter(|q| q["status"] == "inseparable").filter_map(|q| q["name"].as_str());
    let mut unseen: Vec<&str> = unseen.filter(|n| n.starts_with("psi")).collect();
    unseen.sort_unstable();
    assert_eq!(unseen, inseparable);
}

/// The exact verdict assumes instantaneous repositioning: a note says so if the slews of the file take time.
#[test]
fn slews_of_a_file_are_not_part_of_the_verdict() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("s.toml").display().to_string();
    let scheme = "carry = \"inertial\"\n[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\nangles_deg = [180, 0, 0]\n";
    for (rate, said) in [("", false), ("[simulation]\nslew_rate_deg_s = 0.5\n", true)] {
        std::fs::write(&path, scheme.replacen("[[position]]", &format!("{rate}[[position]]"), 1))
            .expect("written");
        let a = json(&["analyze", "--scheme", &path, "--solutions", "off", "--format", "json"]);
        assert_eq!(a["notes"].to_string().contains("of repositioning at once"), said);
    }
}

//! `obsdeg calibrate`, end to end.

use std::fs::{self, File};
use std::io::Write;
use std::process::Stdio;
use std::sync::Arc;

use parquet::basic::{Compression, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use serde_json::Value;

use crate::program::{json, obsdeg, run, stderr, stdout};

const SCHEME: &str = "examples/bench-day/scheme.toml";
const RECORD: &str = "examples/bench-day/record.csv";

#[test]
fn a_day_at_the_bench() {
    let output = run(&["calibrate", SCHEME, RECORD]);
    assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
    insta::assert_snapshot!("calibrate_bench_day", stdout(&output));
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path().join("day").display().to_string();
    assert!(run(&["calibrate", SCHEME, RECORD, "-o", &at, "-q"]).status.success());
    let mut names: Vec<String> = fs::read_dir(&at)
        .expect("written")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "allan.png",
            "allan.svg",
            "calibration.html",
            "calibration.json",
            "coefficients.csv",
            "covariance.csv",
            "estimates.png",
            "estimates.svg",
            "residuals.csv",
            "residuals.png",
            "residuals.svg",
            "whiteness.png",
            "whiteness.svg"
        ]
    );
    let found = json(&["calibrate", SCHEME, RECORD, "--format", "json"]);
    let text = fs::read_to_string(format!("{at}/calibration.json")).expect("written");
    assert_eq!(serde_json::from_str::<Value>(&text).expect("JSON"), found);
    let covariance = &found["covariance"];
    let n = covariance["names"].as_array().expect("names").len();
    assert_eq!((n, covariance["covariance"].as_array().expect("rows").len()), (15, 15));
    let csv = fs::read_to_string(format!("{at}/coefficients.csv")).expect("written");
    assert_eq!(csv.lines().count(), 16);
    assert!(csv.starts_with("name,unit,status,degree,determined,estimate,sigma,sigma_rescaled,"), "{csv}");
    assert_eq!(stdout(&run(&["calibrate", SCHEME, RECORD, "--format", "csv"])), csv);
    // a row has the values that the JSON has of this unknown
    let row: Vec<&str> = csv.lines().nth(4).expect("a row").split(',').collect();
    let of = |key: &str| found["quantities"][3][key].clone();
    assert_eq!((row[0], row[2], row[3]), ("D_FX", "observable", "1"));
    assert_eq!([row[5], row[6]], ["estimate", "sigma"].map(|k| of(k).to_string()));
    let csv = fs::read_to_string(format!("{at}/covariance.csv")).expect("written");
    assert_eq!(stdout(&run(&["calibrate", SCHEME, RECORD, "--format", "csv", "--table", "covariance"])), csv);
    assert!(csv.starts_with("name,unit,estimate,sigma,covariance with psi_x,"), "{csv}");
    let rows: Vec<Vec<&str>> = csv.lines().skip(1).map(|l| l.split(',').collect()).collect();
    for (i, row) in rows.iter().enumerate() {
        let number = |i: usize, j: usize| rows[i][j].parse::<f64>().expect("a number");
        assert_eq!(row.len(), 19);
        assert!((number(i, 3).powi(2) / number(i, 4 + i) - 1.0).abs() < 1e-12, "{row:?}");
        assert!((0..15).all(|j| number(i, 4 + j) == covariance["covariance"][i][j]), "{row:?}");
    }
    let residuals = fs::read_to_string(format!("{at}/residuals.csv")).expect("written");
    assert_eq!(residuals.lines().count(), 601);
    // a second run with the first calibration as prior: sigmas are smaller by about the square root of two
    let prior = format!("{at}/calibration.json");
    let other = folder.path().join("other.csv");
    fs::write(&other, another(&fs::read_to_string(crate_root(RECORD)).expect("the record")))
        .expect("written");
    let other = other.display().to_string();
    let again = json(&["calibrate", SCHEME, &other, "--format", "json", "--prior", &prior]);
    for (k, u) in again["quantities"].as_array().expect("unknowns").iter().enumerate().skip(3) {
        let sigma = |u: &Value| u["sigma"].as_f64().expect("a number");
        let factor = sigma(&found["quantities"][k]) / sigma(u);
        assert!((1.41..1.42).contains(&factor), "{u}: {factor}");
        let moved = u["estimate"].as_f64().expect("a number")
            - found["quantities"][k]["estimate"].as_f64().expect("a number");
        assert!(moved.abs() < 1e-3 * sigma(u), "{u}");
    }
    // the first record does not count twice, and other files are refused as calibrations
    for (record, prior, message) in [
        (RECORD, prior.as_str(), "which the calibration before rests on; expected records of different runs"),
        (
            &other,
            &format!("{at}/coefficients.csv"),
            "coefficients.csv: no JSON; expected the calibration.json",
        ),
        (&other, "crates/calibration/Cargo.toml", "Cargo.toml: no JSON; expected the calibration.json"),
    ] {
        let output = run(&["calibrate", SCHEME, record, "--prior", prior]);
        let found = stderr(&output);
        assert!(output.status.code() == Some(2) && found.contains(message), "{message}: {found}");
    }
    let output = run(&["calibrate", SCHEME, RECORD, RECORD]);
    assert!(stderr(&output).contains("expected records of different runs"), "{}", stderr(&output));
}

/// Record of another run with the same content: one number differs in its last digit.
fn another(text: &str) -> String {
    assert!(text.contains("-0.5758776999999999"));
    text.replacen("-0.5758776999999999", "-0.5758777", 1)
}

/// A review shows the calibration beside the predictions for the scheme, in every format. Files that are no
/// calibration are refused.
#[test]
#[ignore = "seconds: .ci/run"]
fn a_review_of_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let at = path("day");
    assert!(run(&["calibrate", SCHEME, RECORD, "-o", &at, "-q"]).status.success());
    for file in ["a.html", "b.md", "c.tex"] {
        let line = ["report", SCHEME, "--calibration", &at, "--runs", "2", "-o", &path(file), "-q"];
        let output = run(&line);
        assert!(output.status.success(), "{}", stderr(&output));
        let text = fs::read_to_string(path(file)).expect("written");
        for words in [
            "Calibration day",
            "consistent: the model and its sigmas explain the record",
            "15 of 15 unknowns",
            "Allan deviation",
        ] {
            assert!(text.contains(words), "{file}: {words}");
        }
    }
    // the small angles follow from the estimates: rates about the axes of at most 3.2, 4.1 and 3.2 deg/h (all
    // terms of one sign) for 3942 s
    let largest = |more: &[&str]| -> f64 {
        let to = path("d.md");
        let line = [&["report", SCHEME, "--runs", "2", "-o", &to, "-q", "--force"], more].concat();
        assert!(run(&line).status.success());
        let text = fs::read_to_string(to).expect("written");
        let after = text.split("psi").find_map(|t| t.split_once(" reaches ")).expect("the check").1;
        after.split(' ').next().and_then(|x| x.parse().ok()).expect("a number")
    };
    let (stated, estimated) = (largest(&[]), largest(&["--calibration", &at]));
    let bound = (3.2f64 * 3.2 + 4.1 * 4.1 + 3.2 * 3.2).sqrt() * 3942.0 / 3600.0 + 0.1;
    assert!((0.5..bound / 2.0).contains(&estimated) && stated > bound, "{stated} {estimated} {bound}");
    // the picture has the values of the file
    let v: Value =
        serde_json::from_str(&fs::read_to_string(format!("{at}/calibration.json")).expect("written"))
            .expect("JSON");
    let series = v["series"].as_array().expect("series");
    assert_eq!(series.len(), 2);
    let rows = fs::read_to_string(format!("{at}/residuals.csv")).expect("written");
    let z1: Vec<Vec<f64>> = rows
        .lines()
        .filter(|l| l.contains(",Z1,"))
        .map(|l| l.split(',').skip(3).map(|x| x.parse().expect("a number")).collect())
        .collect();
    assert_eq!(z1.len(), series[0]["points"].as_array().expect("points").len());
    for (row, point) in z1.iter().zip(series[0]["points"].as_array().expect("points")) {
        let of = |i: usize| point[i].as_f64().expect("a number");
        assert_eq!((row[0], row[1], row[2]), (of(0), of(1), of(2)));
    }
    fs::write(path("x.json"), "{}").expect("written");
    let output = run(&["report", SCHEME, "--calibration", &path("x.json"), "-o", &path("no.html")]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("expected what `obsdeg calibrate -o` wrote of a scheme"),
        "{}",
        stderr(&output)
    );
    // a calibration of another scheme, or of a model
    let other = fs::read_to_string(crate_root(SCHEME)).expect("the scheme");
    fs::write(path("other.toml"), other.replace("[60, 80, 15]", "[61, 80, 15]")).expect("written");
    let model = path("model");
    run(&[
        "calibrate",
        "--model",
        "examples/theophylline/model.toml",
        "examples/theophylline/data.csv",
        "-o",
        &model,
        "-q",
    ]);
    for (scheme, calibration, message) in [
        (path("other.toml").as_str(), &at, "(angles of p4 60,80,15 instead of 61,80,15)"),
        (SCHEME, &model, "the calibration of a model; expected what"),
        ("examples/theophylline/model.toml", &at, "no scheme is reviewed that it could be of"),
    ] {
        let output = run(&["report", scheme, "--calibration", calibration, "-o", &path("no.html")]);
        let found = stderr(&output);
        assert!(output.status.code() == Some(2) && found.contains(message), "{message}: {found}");
    }
    assert!(!folder.path().join("no.html").exists());
}

/// The same record as CSV, as Parquet, on stdin, and twice.
#[test]
fn the_same_from_everywhere() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("record.parquet");
    let text = fs::read_to_string(crate_root(RECORD)).expect("the record");
    fs::write(&path, parquet(&text)).expect("written");
    // CSV and Parquet give the same numbers, the same input gives the same bytes
    let estimates = |v: &Value| -> Vec<f64> {
        let all = v["covariance"]["estimates"].as_array().expect("estimates");
        all.iter().map(|x| x.as_f64().expect("a number")).collect()
    };
    let csv = json(&["calibrate", SCHEME, RECORD, "--format", "json"]);
    let name = path.display().to_string();
    let columns = json(&["calibrate", SCHEME, &name, "--format", "json"]);
    assert_eq!(estimates(&csv), estimates(&columns));
    let mut piped = obsdeg(&["calibrate", SCHEME, "-", "--format", "json"]);
    let mut child = piped.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it runs");
    child.stdin.take().expect("a pipe").write_all(text.as_bytes()).expect("written");
    let piped: Value =
        serde_json::from_slice(&child.wait_with_output().expect("it ends").stdout).expect("JSON");
    assert_eq!(estimates(&csv), estimates(&piped));
    let mut piped = obsdeg(&["calibrate", SCHEME, "-", "--format", "json"]);
    let mut child = piped.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it runs");
    child.stdin.take().expect("a pipe").write_all(&parquet(&text)).expect("written");
    let piped: Value =
        serde_json::from_slice(&child.wait_with_output().expect("it ends").stdout).expect("JSON");
    assert_eq!(estimates(&csv), estimates(&piped));
    // a record and its copy: coefficients as before, sigmas smaller by the square root of two, and one psi
    // for each record (a bad fit by chance counts twice, so one check fails)
    fs::write(&path, parquet(&another(&text))).expect("written");
    let twice = run(&["calibrate", SCHEME, RECORD, &name, "--format", "json"]);
    let twice: Value = serde_json::from_slice(&twice.stdout).expect("JSON");
    let find = |v: &Value, name: &str| -> [f64; 2] {
        let all = v["quantities"].as_array().expect("unknowns");
        let u = all.iter().find(|u| u["name"] == name).unwrap_or_else(|| panic!("{name}"));
        ["estimate", "sigma"].map(|k| u[k].as_f64().expect("a number"))
    };
    for name in ["D_FX", "D_IY", "D_SZ"] {
        let ([a, s], [b, t]) = (find(&csv, name), find(&twice, name));
        assert!((a - b).abs() < 1e-3 * s && (s / t - 2f64.sqrt()).abs() < 1e-3, "{name}: {a} {s} {b} {t}");
    }
    let ([_, s], [_, t]) = (find(&twice, "psi_y (record 1)"), find(&twice, "psi_y (record 2)"));
    assert!((s / t - 1.0).abs() < 1e-9);
    assert!(twice["repeatability"]["chi_square"].as_f64().expect("a number") < 1e-6);
    // a truncated file
    let bytes = fs::read(&path).expect("readable");
    fs::write(&path, &bytes[..bytes.len() / 2]).expect("written");
    let output = run(&["calibrate", SCHEME, &name]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).starts_with(&format!("error: cannot read the record {name}: ")),
        "{}",
        stderr(&output)
    );
}

pub(crate) fn crate_root(path: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Converts a record from CSV to Parquet: numbers and labels.
fn parquet(text: &str) -> Vec<u8> {
    compressed(text, Compression::UNCOMPRESSED)
}

/// Converts a record from CSV to Parquet with a codec.
fn compressed(text: &str, codec: Compression) -> Vec<u8> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let headers: Vec<String> = reader.headers().expect("a header").iter().map(String::from).collect();
    let rows: Vec<csv::StringRecord> = reader.records().map(|r| r.expect("a row")).collect();
    let field = |name: &String| {
        let kind = if name == "position" { Physical::BYTE_ARRAY } else { Physical::DOUBLE };
        let logical = (name == "position").then_some(parquet::basic::LogicalType::String);
        let builder = Type::primitive_type_builder(name, kind).with_repetition(Repetition::REQUIRED);
        Arc::new(builder.with_logical_type(logical).build().expect("a field"))
    };
    let fields = headers.iter().map(field).collect();
    let properties = Arc::new(WriterProperties::builder().set_compression(codec).build());
    let schema = Arc::new(Type::group_type_builder("record").with_fields(fields).build().expect("a schema"));
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, properties).expect("a writer");
    let mut group = writer.next_row_group().expect("a group");
    for (i, name) in headers.iter().enumerate() {
        let mut column = group.next_column().expect("a column").expect("a column");
        if name == "position" {
            let texts: Vec<ByteArray> = rows.iter().map(|r| r[i].into()).collect();
            column.typed::<ByteArrayType>().write_batch(&texts, None, None).expect("written");
        } else {
            let numbers: Vec<f64> = rows.iter().map(|r| r[i].parse().expect("a number")).collect();
            column.typed::<DoubleType>().write_batch(&numbers, None, None).expect("written");
        }
        column.close().expect("closed");
    }
    group.close().expect("closed");
    writer.into_inner().expect("closed")
}

/// The interpretation of a record is shown before any estimate, even where the estimate would fail.
#[test]
fn how_a_record_is_read() {
    let found = json(&["calibrate", SCHEME, RECORD, "--dry-run", "--format", "json"]);
    assert_eq!((found["schema"].as_str(), found.get("quantities")), (Some("obsdeg.records/1"), None));
    let read = &found["records"][0];
    assert_eq!(
        (&read["samples"], &read["positions_by"], &read["origin_s"]),
        (&963.into(), &"both".into(), &0.0.into())
    );
    assert_eq!(
        (&read["interval_s"], &read["gaps"], &read["left_out"]),
        (&4.0.into(), &Value::Array(vec![]), &Value::Array(vec![]))
    );
    let columns: Vec<&str> =
        read["columns"].as_array().expect("columns").iter().filter_map(|c| c["column"].as_str()).collect();
    assert_eq!(columns, ["t [s]", "fx [g]", "fy [g]", "fz [g]"]);
    let names: Vec<&str> = read["positions"]
        .as_array()
        .expect("positions")
        .iter()
        .filter_map(|p| p["position"].as_str())
        .collect();
    assert_eq!(names, ["p1", "p2", "p3", "p4", "p5", "p6"]);
    // German number format, a late start, a gap, an error code and an empty cell
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("record.csv");
    let text = fs::read_to_string(crate_root(RECORD)).expect("the record");
    let mut spoiled = String::new();
    for (k, line) in text.lines().enumerate() {
        let mut cells: Vec<String> = line.split(',').map(String::from).collect();
        if let Ok(t) = cells[0].parse::<f64>() {
            cells[0] = (t + 1000.0).to_string();
        }
        match k {
            20..40 => continue,
            60 => cells[2].clear(),
            70 | 71 => cells[3] = "-9999".into(),
            _ => {}
        }
        spoiled += &(cells.join(";").replace('.', ",") + "\n");
    }
    fs::write(&path, spoiled).expect("written");
    let output = run(&["calibrate", SCHEME, &path.display().to_string(), "--dry-run"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let said = stdout(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    for words in [
        "nothing was estimated",
        "columns are separated by semicolons, decimals by commas",
        "the scheme begins between",
        "rows are missing for 84 s from 1084 s on (p1, before line 21)",
        "empty cells at positions: 1 of `fx [g]`",
        "51 fy [g] -9999 code",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let output =
        run(&["calibrate", "examples/influenza/model.toml", "examples/influenza/data.csv", "--dry-run"]);
    assert!(
        output.status.code() == Some(2) && stderr(&output).contains("--dry-run is about schemes"),
        "{}",
        stderr(&output)
    );
}

/// Every codec of Parquet is read.
#[test]
fn codecs_of_parquet() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("record.csv");
    let text = fs::read_to_string(crate_root(RECORD)).expect("the record");
    let of = |bytes: &[u8]| {
        fs::write(&path, bytes).expect("written");
        run(&["calibrate", SCHEME, &path.display().to_string()])
    };
    let right = stdout(&of(text.as_bytes()));
    for codec in [
        Compression::SNAPPY,
        Compression::GZIP(Default::default()),
        Compression::BROTLI(Default::default()),
        Compression::LZ4_RAW,
        Compression::LZ4,
    ] {
        let bytes = compressed(&text, codec);
        assert!(bytes.len() != parquet(&text).len(), "{codec:?}");
        assert_eq!(stdout(&of(&bytes)), right, "{codec:?}");
    }
    // zstd files come from pyarrow, since the crate that writes the others has no pure Rust codec for it
    for version in ["1", "2"] {
        let name = format!("tests/data/parquet/bench-day-{version}.parquet");
        let bytes = fs::read(crate_root(&name)).expect("the record");
        assert_eq!(stdout(&of(&bytes)), right, "{name}");
    }
}

/// A file given in the place of another is named in the message, with the command in the right order.
#[test]
fn files_in_the_place_of_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let out = path("out");
    assert!(run(&["calibrate", SCHEME, RECORD, "-o", &out, "-q"]).status.success());
    let calibration = format!("{out}/calibration.json");
    let parquet_at = path("record.parquet");
    fs::write(&parquet_at, parquet(&fs::read_to_string(crate_root(RECORD)).expect("the record")))
        .expect("written");
    let (model, data) = ("examples/influenza/model.toml", "examples/influenza/data.csv");
    for (args, message) in [
        (
            vec![RECORD, SCHEME],
            format!(
                "{RECORD} is a record and {SCHEME} a scheme; expected `obsdeg calibrate {SCHEME} {RECORD}`"
            ),
        ),
        (
            vec![RECORD, SCHEME, &parquet_at],
            format!("expected `obsdeg calibrate {SCHEME} {RECORD} {parquet_at}`"),
        ),
        (vec![&parquet_at, SCHEME], format!("{parquet_at} is a record and {SCHEME} a scheme; expected")),
        (
            vec![data, model],
            format!("{data} is a record and {model} a model; expected `obsdeg calibrate {model} {data}`"),
        ),
        (
            vec![RECORD],
            format!(
                "{RECORD} is a record; expected a scheme or model file, then records: `obsdeg calibrate scheme.toml"
            ),
        ),
        (
            vec![&calibration, RECORD],
            format!(
                "{calibration} is a calibration, which `obsdeg calibrate` wrote; expected a scheme or model"
            ),
        ),
        (
            vec![SCHEME, &calibration],
            format!(
                "{calibration} is a calibration; expected a record, in CSV or Parquet (`--prior {calibration}`"
            ),
        ),
        (
            vec![SCHEME, model],
            format!(
                "{model} is a model; expected a record, in CSV or Parquet (one scheme or model, which is {SCHEME})"
            ),
        ),
        (vec!["--scheme", RECORD, SCHEME], format!("expected `obsdeg calibrate {SCHEME} {RECORD}`")),
        (vec!["--scheme", &calibration, RECORD], format!("{calibration} is a calibration, which")),
        (vec!["--scheme", model, data], format!("{model} is a model file; expected a scheme file")),
        (vec!["--model", SCHEME, data], format!("{SCHEME} is a scheme file; expected a model file")),
    ] {
        let output = run(&[&["calibrate"], &args[..]].concat());
        let found = stderr(&output);
        assert!(output.status.code() == Some(2) && found.contains(&message), "{args:?}: {message}: {found}");
        assert!(output.stdout.is_empty());
    }
}

/// A bad record is refused with line and column, and nothing is written.
#[test]
fn bad_records_are_refused_with_their_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bad.csv");
    let right = fs::read_to_string(crate_root(RECORD)).expect("the record");
    let line = |n: usize| right.lines().nth(n - 1).expect("a line").to_string();
    let third = line(3);
    let cells: Vec<&str> = third.split(',').collect();
    let with = |i: usize, cell: &str| {
        let mut cells = cells.clone();
        cells[i] = cell;
        right.replace(&third, &cells.join(","))
    };
    for (text, message) in [
        (right.replace("fz [g]", "gz [g]"), "bad.csv: no column `fz [g]`; found `t [s]`, `position`"),
        (
            right.replace("fz [g]", "fz [deg]"),
            "bad.csv: line 1, column `fz [deg]`: expected a unit, `fz [g]` or",
        ),
        (with(2, "nan"), "bad.csv: line 3, column `fx [g]`: found NaN, expected a finite number"),
        (with(2, "much"), "bad.csv: line 3, column `fx [g]`: expected a number, found `much`"),
        (with(0, "4"), "bad.csv: line 3, column `t [s]`: the time 4 is not after that of the row before, 4"),
        (with(1, "p7"), "bad.csv: line 3, column `position`: no position is called `p7`; expected p1, p2"),
        (with(1, "p2"), "bad.csv: line 4, column `position`: found `p1`, expected p3 (the scheme's"),
        (right.replace(",p6,", ",,"), "bad.csv: the position p6 of the scheme has no samples"),
        // swapped axes, and the sign of gravity instead of the sign of the specific force
        (
            right.replace("fx [g],fy [g]", "fy [g],fx [g]"),
            "no position of the scheme; with fy, fx, fz in the place of fx, fy, fz every position is where",
        ),
        (
            right.replace(",-", ",+").replace(",0.", ",-0.").replace(",+", ","),
            "no position of the scheme; with -fx, -fy, -fz in the place of fx, fy, fz every position is",
        ),
        (right.replace('\n', "\r"), "bad.csv: lines end with CR alone; expected LF or CR LF"),
        (format!("\0\u{1}{right}"), "bad.csv: line 1 has a byte 0x00 in it, which no text has"),
    ] {
        fs::write(&path, text).expect("written");
        let out = folder.path().join("out").display().to_string();
        let output = run(&["calibrate", SCHEME, &path.display().to_string(), "-o", &out]);
        let found = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}: {found}");
        assert!(found.contains(message), "{message}: {found}");
        assert!(output.stdout.is_empty() && !folder.path().join("out").exists(), "{message}");
    }
    File::create(&path).expect("made");
    assert_eq!(run(&["calibrate", SCHEME, &path.display().to_string()]).status.code(), Some(2));
    // a record that contradicts the model is still a readable record
    let output = run(&["calibrate", SCHEME, RECORD, "--noise", "3e-6"]);
    assert_eq!(output.status.code(), Some(1));
    let text = stdout(&output);
    assert!(
        text.contains("NOT consistent") && text.contains("over all positions together: sigmas are 3."),
        "{text}"
    );
}

/// Rates that do not fit are attributed to the clock only if the times of the positions confirm it.
#[test]
fn a_clock_is_blamed_where_times_say_so_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let right = fs::read_to_string(crate_root(RECORD)).expect("read");
    let fast: String = right
        .lines()
        .map(|line| match line.split_once(',') {
            Some((t, rest)) if t.parse::<f64>().is_ok() => {
                format!("{},{rest}\n", t.parse::<f64>().expect("a time") * 1.02)
            }
            _ => format!("{line}\n"),
        })
        .collect();
    let file = folder.path().join("fast.csv");
    fs::write(&file, fast).expect("written");
    let said = |arguments: &[&str]| {
        let output = run(&[&["calibrate", SCHEME], arguments].concat());
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        stdout(&output).split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let clock = said(&[&file.display().to_string()]);
    assert!(clock.contains("the clock: positions begin and end as by a clock that is 2.0"), "{clock}");
    assert!(clock.contains("those that the earth rate tells by more"), "{clock}");
    // a correct clock with a wrong latitude
    let rates = said(&[RECORD, "--latitude", "49"]);
    assert!(rates.contains("another latitude or rate of turns") && !rates.contains("the clock"), "{rates}");
    // and with a wrong slew rate: the gaps between positions say it
    let turns = said(&[RECORD, "--slew-rate", "3"]);
    assert!(
        turns.contains("the turns last 1.5")
            && turns.contains("at about 2.0")
            && !turns.contains("the clock"),
        "{turns}"
    );
}

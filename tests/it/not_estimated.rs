//! Errors that a scheme does not estimate: budgets in reports and files, against numbers computed by hand
//! from their lines.

use scraper::Html;

use crate::program::{json, run, stderr, stdout};
use crate::report::{report, table, texts};

const BENCH: &str = "examples/bench-errors/scheme.toml";

/// The scheme from a datasheet uses the noise that `allan` finds in the record beside it. The statement of
/// its README holds: the sigmas meet every requirement, the totals do not, because of the bias.
#[test]
fn a_record_at_rest_and_a_datasheet_make_a_bench() {
    let folder = "examples/bench-datasheet";
    let found = json(&["allan", &format!("{folder}/rest.csv"), "--format", "json"]);
    let table = found["simulation_table"].as_str().expect("a table");
    let key = |text: &str| text.lines().find(|l| l.starts_with("accelerometer_noise_g")).map(str::to_owned);
    let scheme = std::fs::read_to_string(format!("{folder}/scheme.toml")).expect("a scheme");
    assert!(key(table).is_some());
    assert_eq!(key(table), key(&scheme));
    let noise: f64 = number(key(table).expect("the key").split_once(" = ").expect("a value").1);
    // 5 ug from 2400 samples of three sensors, the largest of the three: four sigma
    assert!((noise / 5e-6 - 1.0).abs() < 4.0 / (2.0 * 2400f64).sqrt(), "{noise}");
    let answer = json(&["compare", &format!("{folder}/scheme.toml"), "--format", "json"]);
    let all = answer["schemes"][0]["quantities"].as_array().expect("quantities");
    let of = |q: &serde_json::Value, k: &str| q[k].as_f64().expect("a number");
    let coefficients = all.iter().filter(|q| q["name"].as_str().expect("a name").starts_with("D_"));
    let (mut missed, mut least, mut largest) = (0, f64::INFINITY, 0.0f64);
    for q in coefficients {
        least = least.min(of(q, "requirement") / of(q, "sigma"));
        largest = largest.max(of(q, "total") / of(q, "requirement"));
        missed += u32::from(of(q, "total") > of(q, "requirement"));
        assert!((of(q, "requirement") / of(q, "total") / of(q, "margin") - 1.0).abs() < 1e-12, "{q}");
    }
    assert!(least >= 15.0 && missed == 8 && (largest - 71.0).abs() < 0.5, "{least} {missed} {largest}");
    let terms = ["--terms", "F,I,O,S,K0,M6", "--format", "json", "-q"];
    let with = json(&[&["simulate", "--scheme", &format!("{folder}/scheme.toml")][..], &terms].concat());
    let margin = with["requirements"]["worst"]["margin"].as_f64().expect("a number");
    assert!((1.0 / margin - 10.0).abs() < 1.0, "{margin}");
    // the table shows the totals on which the margins rest
    let printed = stdout(&run(&["compare", &format!("{folder}/scheme.toml"), "--details"]));
    let row = printed.lines().find(|l| l.starts_with(" D_IZ ") && l.contains("0.01400")).expect("a row");
    assert!(row.contains("7.143") && row.contains("0.01400"), "{row}");
    assert!(printed.contains("margin: required over total"), "{printed}");
}

/// First number of a text that continues with a unit: `1.5 deg/h`.
fn number(text: &str) -> f64 {
    let first = text.split(' ').next().unwrap_or_default();
    first.parse().unwrap_or_else(|e| panic!("{text}: {e}"))
}

/// The report has a budget for every coefficient: the largest line first, squares that add up to the square
/// of the total, and the total of the JSON. The picture has a bar for each coefficient.
#[test]
#[ignore = "seconds: .ci/run release"]
fn the_report_has_a_budget_of_every_coefficient() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = Html::parse_document(&report(folder.path(), "bench.html", &[BENCH]).1);
    assert!(texts(&page, "h3").iter().any(|t| t == "What is not estimated"));
    // longer dwells do not lower the part of the bench: the recommended action was tried with the bench
    let front = texts(&page, "section.front").concat();
    assert!(front.contains("Estimate K0,M6 too") && !front.contains("Dwell "), "{front}");
    let answer = json(&["simulate", "--scheme", BENCH, "--format", "json", "-q"]);
    let budgets = answer["omitted"]["budgets"].as_array().expect("budgets");
    let coefficients = budgets.iter().filter(|b| !b["unknown"].as_str().expect("a name").starts_with("psi"));
    let mut seen = 0;
    for b in coefficients {
        let name = b["unknown"].as_str().expect("a name");
        let rows = table(&page, &format!("Uncertainty budget of {name}:"));
        let (total, lines) = rows.split_last().expect("rows");
        let contributions: Vec<f64> = lines.iter().map(|r| number(&r[4])).collect();
        let squared: f64 = contributions.iter().map(|x| x * x).sum();
        let expected = b["total"].as_f64().expect("a number");
        assert!((squared.sqrt() / expected - 1.0).abs() < 2e-3, "{name}: {rows:?}");
        assert!((number(&total[4]) / expected - 1.0).abs() < 1e-3, "{name}: {total:?}");
        let percent: f64 = lines.iter().map(|r| number(&r[5])).sum();
        assert!((percent - 100.0).abs() < 0.5, "{name}: {rows:?}");
        let named = lines.iter().filter(|r| r[1] != "-").map(|r| number(&r[4]));
        assert!(named.clone().zip(named.skip(1)).all(|(a, b)| a >= b), "{name}: {rows:?}");
        for r in lines.iter().filter(|r| r[1] == "B") {
            // size stated in the file, times sensitivity
            let stated = if r[0].starts_with("K0") {
                20.0
            } else if r[0].starts_with("M_") {
                5.0
            } else {
                10.0
            };
            assert_eq!(number(&r[2]), stated, "{r:?}");
            assert!((stated * number(&r[3]).abs() / number(&r[4]) - 1.0).abs() < 1e-3, "{r:?}");
        }
        seen += 1;
    }
    assert_eq!(seen, 12);
    let picture = texts(&page, "figure svg text").concat();
    for name in ["D_FX", "D_SZ", "samples", "K0", "latitude", "share of the squared total"] {
        assert!(picture.contains(name), "{name}: {picture}");
    }
}

/// `budget.csv` has one row for each line of every budget, with the numbers of the JSON. The table of
/// `--format csv` has the same, under the name of the unknown.
#[test]
fn budgets_are_files_of_rows() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let output = run(&["simulate", "--scheme", BENCH, "-q", "-o", &out.display().to_string()]);
    assert!(output.status.success(), "{}", stderr(&output));
    let answer = json(&["simulate", "--scheme", BENCH, "--format", "json", "-q"]);
    let mut expected = Vec::new();
    for b in answer["omitted"]["budgets"].as_array().expect("budgets") {
        for l in b["lines"].as_array().expect("lines") {
            let text = |x: &serde_json::Value| x.as_str().expect("a text").to_string();
            expected.push((text(&b["unknown"]), text(&l["source"]), l["contribution"].as_f64()));
        }
    }
    assert!(expected.len() > 50);
    let rows = |text: &[u8], columns: [&str; 3]| -> Vec<(String, String, Option<f64>)> {
        let mut reader = csv::Reader::from_reader(text);
        let header = reader.headers().expect("a header").clone();
        let at =
            columns.map(|c| header.iter().position(|h| h == c).unwrap_or_else(|| panic!("{c}: {header:?}")));
        let row = |r: csv::StringRecord| (r[at[0]].into(), r[at[1]].into(), r[at[2]].parse().ok());
        reader.records().map(|r| row(r.expect("a row"))).collect()
    };
    let written = std::fs::read(out.join("budget.csv")).expect("a file");
    assert_eq!(rows(&written, ["unknown", "source", "contribution"]), expected);
    let table = ["simulate", "--scheme", BENCH, "-q", "--format", "csv", "--table", "omitted.budgets.lines"];
    let printed = run(&table);
    assert!(printed.status.success(), "{}", stderr(&printed));
    assert_eq!(rows(&printed.stdout, ["omitted.budgets.name", "source", "contribution"]), expected);
}

/// Scheme of [`record_of_two_positions`]: under platform carry everything is determined except errors that
/// are equal at both positions.
const TWO: &str = "name = 'two'\ncarry = 'platform'\nlatitude_deg = 28.2\nterms = ['F']\n[simulation]\ndwell_s = 1000\n\
                   step_s = 10\naccelerometer_noise_g = 1e-6\ndrift_noise = '0'\n[[position]]\nname = 'p1'\n\
                   attitude = 'NUE'\n[[position]]\nname = 'p2'\nattitude = 'SUW'\n";

/// Earth rate at 28.2 deg N along North and Up, in deg/h.
fn earth_rate() -> [f64; 2] {
    let (sin, cos) = 28.2f64.to_radians().sin_cos();
    [15.041_067 * cos, 15.041_067 * sin]
}

/// Record of Z1 and Z3 at NUE, then SUW (half turn about Up) at 28.2 deg N, 1000 s each, by Runge and Kutta,
/// with noise of 1e-6 g. D_F of the gyros in deg/h, D_IY in deg/h/g (g along Y is -1 at both), zero of
/// accelerometer Z in ug.
fn record_of_two_positions(d_f: [f64; 3], d_iy: f64, k0_z_ug: f64) -> String {
    let dph = (1f64 / 3600.0).to_radians();
    let [w_n, w_u] = earth_rate().map(|w| w * dph);
    let drift = [d_f[0] * dph, (d_f[1] - d_iy) * dph, d_f[2] * dph];
    let along = |p: [f64; 3], k: [f64; 3], h: f64| std::array::from_fn(|i| p[i] + h * k[i]);
    let mut state = 7u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    };
    let mut normal = || (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
    let mut psi = [1e-4, -2e-4, 1.5e-4];
    let mut text = String::from("t [s],position,Z1 [g],Z3 [g]\n");
    for (p, level) in [("p1", 1.0), ("p2", -1.0)] {
        // X and Z point North and East, then South and West; psi is carried in platform axes
        let in_n = |v: [f64; 3]| [level * v[0], v[1], level * v[2]];
        let eps = in_n(drift);
        let slope =
            |p: [f64; 3]| [eps[0] - p[2] * w_u, eps[1] + p[2] * w_n, eps[2] + p[0] * w_u - p[1] * w_n];
        psi = in_n(psi);
        for i in 1..=100 {
            let k1 = slope(psi);
            let k2 = slope(along(psi, k1, 5.0));
            let k3 = slope(along(psi, k2, 5.0));
            let k4 = slope(along(psi, k3, 10.0));
            for (r, p) in psi.iter_mut().enumerate() {
                *p += (k1[r] + 2.0 * (k2[r] + k3[r]) + k4[r]) * (10.0 / 6.0);
            }
            let z = [psi[2] + 1e-6 * normal(), -psi[0] + level * k0_z_ug * 1e-6 + 1e-6 * normal()];
            let t = 10 * i + if p == "p1" { 0 } else { 1000 };
            text += &format!("{t},{p},{},{}\n", z[0], z[1]);
        }
        psi = in_n(psi);
    }
    text
}

/// A record with an error that it cannot reveal is called consistent. The sentence names the error and its
/// effect, and the estimate is off by that effect.
#[test]
fn a_silent_error_moves_the_estimate_by_what_the_sentence_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let scheme = folder.path().join("scheme.toml");
    std::fs::write(&scheme, TWO).expect("written");
    let calibrated = |of: &str, d_iy: f64, k0_z_ug: f64| -> (String, f64) {
        let record = folder.path().join("record.csv");
        std::fs::write(&record, record_of_two_positions([0.005, -0.003, 0.004], d_iy, k0_z_ug))
            .expect("written");
        let [scheme, record] = [&scheme, &record].map(|p| p.display().to_string());
        let arguments = ["calibrate", "--scheme", &scheme, &record, "-q"];
        let table = run(&arguments);
        assert!(table.status.success(), "{}", stderr(&table));
        let table = crate::program::stdout(&table).split_whitespace().collect::<Vec<_>>().join(" ");
        let answer = json(&[&arguments[..], &["--format", "json"]].concat());
        let own = answer["quantities"].as_array().expect("a list").iter().find(|q| q["name"] == of);
        (table, own.expect(of)["estimate"].as_f64().expect("an estimate"))
    };
    // by hand: g along Y is -1 at both positions; a zero of Z acts like psi_x, which turns into psi_z by wU
    // psi_x
    let w_u = earth_rate()[1];
    for (name, unit, of, [d_iy, k0_z], size, by_hand) in [
        ("D_IY", "deg/h/g", "D_FY", [0.005, 0.0], 0.005, -1.0),
        ("K0_Z", "ug", "D_FZ", [0.0, 1000.0], 1000.0, 1e-6 * w_u),
    ] {
        let (_, without) = calibrated(of, 0.0, 0.0);
        let (table, estimate) = calibrated(of, d_iy, k0_z);
        assert!(
            table.contains(
                "consistent: the model and its sigmas explain the record, as far as it can tell; \
                                silent here: "
            ),
            "{table}"
        );
        let said = format!("{name} (changes {of} by ");
        let behind = table.split(&said).nth(1).unwrap_or_else(|| panic!("no {said}: {table}"));
        let (per_unit, rest) = behind.split_once(' ').expect("a number");
        assert!(rest.starts_with(&format!("deg/h per {unit})")), "{rest}");
        let per_unit: f64 = per_unit.parse().expect("a number");
        assert!((per_unit / by_hand - 1.0).abs() < 1e-3, "{name}: {per_unit} {by_hand}");
        let expected = per_unit * size;
        // the number is printed with four digits; psi times drift adds 1e-3 of the drift
        assert!(
            (estimate - without - expected).abs() < 2e-3 * expected.abs(),
            "{estimate} {without} {expected}"
        );
    }
}

/// No answer says "met" where the bench uses up the margin: neither the prediction, nor the run and its
/// unknowns, nor a calibration. A zero of 3000 ug changes D_FZ by `wU 3e-3`, by hand 0.02132 deg/h.
#[test]
fn nothing_is_met_that_the_bench_uses_up() {
    let answer = json(&["simulate", "--scheme", BENCH, "--format", "json", "-q"]);
    let texts = |v: &serde_json::Value| -> Vec<String> {
        let names = v.as_array().expect("a list").iter().map(|m| m["name"].as_str().expect("a name").into());
        names.collect()
    };
    let missed = texts(&answer["requirements"]["missed"]);
    assert!(missed.len() > 3 && missed.len() < 12, "{missed:?}");
    // the sigmas of the run are within a percent of the predicted ones
    assert_eq!(texts(&answer["run"]["requirements"]["missed"]), missed);
    assert_eq!(answer["run"]["requirements"]["with_bench"], true);
    for q in
        answer["quantities"].as_array().expect("a list").iter().filter(|q| !q["required_sigma"].is_null())
    {
        let out = missed.iter().any(|m| *m == q["name"].as_str().expect("a name"));
        assert_eq!(q["outcome"], if out { "converging" } else { "reached" }, "{q}");
        assert_eq!(q["time_to_requirement_s"].is_null(), out, "{q}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let [scheme, record] = ["scheme.toml", "record.csv"].map(|n| folder.path().join(n).display().to_string());
    std::fs::write(&record, record_of_two_positions([0.005, -0.003, 0.004], 0.0, 0.0)).expect("written");
    for (required, bench, met) in [
        (0.02, "", true),
        (0.02, "K0_Z = 3000", false),
        (0.025, "K0_Z = 3000", true),
        (0.02, "gravity = 3000", true),
    ] {
        let text = TWO.replace(
            "[[position]]\nname = 'p1'",
            &format!("[requirements]\nD_FZ = {required}\n[bench]\n{bench}\n[[position]]\nname = 'p1'"),
        );
        std::fs::write(&scheme, text).expect("written");
        let found = json(&["calibrate", "--scheme", &scheme, &record, "-q", "--format", "json"]);
        let of = &found["requirements"];
        assert_eq!(
            (of["stated"].as_u64(), of["met"].as_u64()),
            (Some(1), Some(u64::from(met))),
            "{bench} {of}"
        );
        assert_eq!(of["with_bench"].as_bool().unwrap_or(false), !bench.is_empty(), "{of}");
        // options have the same effect on a scheme without a bench
        let plain = folder.path().join("plain.toml").display().to_string();
        std::fs::write(&plain, TWO).expect("written");
        let required_by = format!("D_FZ={required}");
        let bench_by = bench.replace(' ', "");
        let mut arguments =
            vec!["calibrate", &plain, &record, "--requirement", &required_by, "-q", "--format", "json"];
        if !bench.is_empty() {
            arguments.extend(["--bench", &bench_by]);
        }
        assert_eq!(json(&arguments)["requirements"], *of, "{bench}");
        if bench == "K0_Z = 3000" {
            let own = found["quantities"].as_array().expect("a list").iter().find(|q| q["name"] == "D_FZ");
            let [sigma, rescaled] = ["sigma", "sigma_rescaled"].map(|k| own.expect("D_FZ")[k].as_f64());
            let sigma = sigma.expect("a number").max(rescaled.unwrap_or(0.0));
            let margin = of["worst"]["margin"].as_f64().expect("a number");
            let expected = required / sigma.hypot(3e-3 * earth_rate()[1]);
            assert!((margin / expected - 1.0).abs() < 1e-3, "{margin} {expected}");
        }
    }
}

const FIVE: [&str; 14] = [
    "--angles",
    "NUE",
    "--angles",
    "USE",
    "--angles",
    "ENU",
    "--angles",
    "EUS",
    "--angles",
    "DSW",
    "--carry",
    "inertial",
    "--latitude",
    "28.2",
];

/// The bench of a run uses the weights of the run. By hand (dense least squares with noise and priors of the
/// run, in numpy): sigma of D_FY 8.298e-4 deg/h, total 0.004360; the predicted weights give 0.00582.
#[test]
fn the_bench_of_a_run_counts_by_its_own_weights() {
    let arguments =
        ["--bench", "K0=20,M=5,latitude=10", "--requirement", "D_FY=0.005", "--format", "json", "-q"];
    let answer = json(&[&["simulate"], &FIVE[..], &arguments[..]].concat());
    let margin = answer["run"]["requirements"]["worst"]["margin"].as_f64().expect("a margin");
    assert!((margin - 0.005 / 0.004360).abs() < 2e-3, "{margin}");
    // conditions stated for the run count in the prediction
    let mut stated = vec!["--drift-noise".to_string(), "0.01 deg/h".into()];
    for q in answer["quantities"].as_array().expect("a list") {
        let [name, prior] = [&q["name"], &q["prior_sigma"]];
        stated.extend(["--prior".into(), format!("{}={prior}", name.as_str().expect("a name"))]);
    }
    let stated: Vec<&str> = stated.iter().map(String::as_str).collect();
    let answer = json(&[&["simulate"], &FIVE[..], &arguments[..], &stated[..]].concat());
    let of = |r: &serde_json::Value| r["worst"]["margin"].as_f64().expect("a margin");
    let [run, predicted] = [of(&answer["run"]["requirements"]), of(&answer["requirements"])];
    assert!((run / predicted - 1.0).abs() < 1e-6, "{run} {predicted}");
}

/// Two values of one name in one option are refused, and the message shows both. A family and one of its
/// axes, or an option and the file, do not conflict.
#[test]
fn one_name_has_one_value() {
    for (option, twice) in [
        ("--bench", ["K0=20", "K0=30"]),
        ("--prior", ["D_F=20", "D_F=2"]),
        ("--requirement", ["D=0.1", "D=0.2"]),
        ("--value", ["D_FX=1", "D_FX=2"]),
        ("--estimate", ["D_FX=1", "D_FX=2"]),
    ] {
        let output = run(&["simulate", "--scheme", BENCH, option, twice[0], option, twice[1], "-q"]);
        assert_eq!(output.status.code(), Some(2), "{option}");
        let name = twice[0].split('=').next().expect("a name");
        let expected = format!("{option} {} and {}: expected one value of {name}", twice[0], twice[1]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains(&expected), "{said}");
    }
    let sizes = |bench: &str| -> Vec<f64> {
        let answer = json(&["simulate", "--scheme", BENCH, "--bench", bench, "-q", "--format", "json"]);
        let terms = answer["omitted"]["terms"].as_array().expect("a list").clone();
        let own = terms.iter().filter(|t| t["family"] == "K0");
        own.map(|t| t["size"].as_f64().expect("a size")).collect()
    };
    assert_eq!(sizes("K0=21,K0_Y=7"), [21.0, 7.0, 21.0]);
    assert_eq!(sizes("K0_Y=7,K0=21,K0=21"), [21.0, 7.0, 21.0]);
}

/// A size without a computed effect is refused, a size of an unknown is said to have no effect, and a
/// cross-check says that it has no bench.
#[test]
fn sizes_that_count_nothing_are_said() {
    let said = |arguments: &[&str]| -> String {
        let output = run(arguments);
        let text = format!("{}{}", crate::program::stdout(&output), stderr(&output));
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let five = |command: &str, rest: &[&str]| said(&[&[command], &FIVE[..], rest, &["-q"][..]].concat());
    let required = ["--requirement", "D=0.1", "--bench"];
    for command in ["simulate", "compare"] {
        let of = match command {
            "compare" => {
                said(&["compare", BENCH, "--requirement", "D=0.1", "--bench", "attitude_x@6=100", "-q"])
            }
            _ => five(command, &[&required[..], &["attitude_x@6=100"]].concat()),
        };
        assert!(of.contains("no error is `attitude_x@6`; the scheme has 5 positions"), "{of}");
    }
    let turning: Vec<&str> = FIVE.iter().map(|a| if *a == "NUE" { "NUE@X_p:360" } else { *a }).collect();
    let of = said(&[&["simulate"], &turning[..], &required[..], &["attitude=100", "-q"][..]].concat());
    assert!(of.contains("not computed where a position rotates"), "{of}");
    let of = said(&[&["simulate"], &turning[..], &["--requirement", "D=0.1", "-q"][..]].concat());
    assert!(of.contains("attitudes are not computed here"), "{of}");
    let of = five("simulate", &[&required[..], &["D_FX=100"]].concat());
    assert!(of.contains("No size of the bench counts: D_FX is estimated. Met while"), "{of}");
    assert!(!of.contains("With the bench every"), "{of}");
    let of = five("simulate", &[&required[..], &["D_FX=100,K1=1"]].concat());
    assert!(of.contains("Of the bench, D_FX is estimated: its size does not count."), "{of}");
    let of = said(&["crosscheck", BENCH, "-q"]);
    assert!(of.contains("the bench is no part of a cross-check"), "{of}");
    let of = said(&["design", "--positions", "4", "--bench", "attitude_x@7=50", "-q"]);
    assert!(of.contains("the scheme has 4 positions"), "{of}");
    for wrong in ["K0=x", "K0=20ug", "K0"] {
        let of = five("simulate", &["--bench", wrong]);
        assert!(of.contains("as in K0=20 or latitude=10"), "{of}");
    }
}

/// `analyze --sensitivities` gives the changes per unit of the reference table (normal equations with a
/// Taylor step, and expm with QR; four digits) at the stated conditions. Without the option there are none;
/// for a model it is refused.
#[test]
fn analyze_gives_the_changes_per_unit() {
    let solve = ["--solutions", "off"];
    let asked = [&["analyze"], &FIVE[..], &solve[..]].concat();
    let answer = json(&[&asked[..], &["--sensitivities", "--format", "json"]].concat());
    let of = &answer["sensitivities"];
    assert_eq!(of["conditions"]["accelerometer_noise_g"], 1e-5);
    let terms = of["effects"]["terms"].as_array().expect("terms");
    let worst = |family: &str, size: f64| -> f64 {
        let mut squares = std::collections::BTreeMap::<&str, f64>::new();
        for t in terms.iter().filter(|t| t["family"] == family) {
            for s in t["sensitivities"].as_array().expect("a list") {
                let name = s["unknown"].as_str().expect("a name");
                let change = s["per_unit"].as_f64().expect("a number") * size;
                *squares.entry(name).or_default() += change * change;
            }
        }
        let drifts = squares.iter().filter(|(name, _)| name.starts_with("D_"));
        drifts.map(|(_, x)| x.sqrt()).fold(0.0, f64::max)
    };
    let expected = [("K0", 100.0, 2.984), ("K1", 100.0, 0.0), ("M", 10.0, 1.246), ("GS", 100.0, 0.0121)];
    for (family, size, change) in
        expected.into_iter().chain([("GM", 10.0, 0.0058), ("latitude", 10.0, 0.0036)])
    {
        assert!((worst(family, size) - change).abs() < 6e-4f64.min(0.01 * change + 1e-12), "{family}");
    }
    assert!(json(&[&asked[..], &["--format", "json"]].concat()).get("sensitivities").is_none());
    let printed = stdout(&run(&[&asked[..], &["--sensitivities"]].concat()));
    assert!(printed.contains("0.02985 deg/h/g per ug") && printed.contains("noise of Z 1e-5 g"), "{printed}");
    let refused = stderr(&run(&["analyze", "examples/lotka-volterra/model.toml", "--sensitivities"]));
    assert!(refused.contains("--sensitivities"), "{refused}");
}

/// Families that the bench does not state get limits beside it; families that it states, zero included, get
/// none. The requirement is met just below the printed limit and missed just above it.
#[test]
fn a_partial_bench_leaves_limits_of_the_rest() {
    let asked = |bench: &str| {
        let rest = ["--requirement", "D=10", "--bench", bench, "-q"];
        let output = run(&[&["simulate"], &FIVE[..], &rest[..]].concat());
        stdout(&output).split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let said = asked("K0=100");
    let limits = said.split("Met while, of what the bench does not state").nth(1).expect(&said);
    let limits = limits.split('.').take(40).collect::<Vec<_>>().join(".");
    assert!(
        !limits.contains("K0 <")
            && limits.contains("no small size (up to 0.05 g, 5 %, 0.05 rad) of")
            && limits.contains("latitude"),
        "{limits}"
    );
    let limit = number(limits.split(", M < ").nth(1).expect(&limits));
    let sentence = |m: f64| asked(&format!("K0=100,M={m}"));
    let met = "With the bench every requirement is met";
    assert!(sentence(0.999 * limit).contains(met), "{}", sentence(0.999 * limit));
    assert!(!sentence(1.02 * limit).contains(met), "{}", sentence(1.02 * limit));
}

/// A report without a bench states the sizes of errors up to which the requirements are met. Schemes with
/// different benches are not compared. With a bench the table of unknowns shows the totals on which the
/// margins rest.
#[test]
#[ignore = "seconds: .ci/run release"]
fn a_report_says_what_its_met_rests_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(BENCH).expect("the example");
    let (start, rest) = text.split_once("[bench]").expect("a bench");
    let without = format!("{start}{}", &rest[rest.find("[[position]]").expect("positions")..]);
    let path = folder.path().join("without.toml");
    std::fs::write(&path, without).expect("written");
    let path = path.display().to_string();
    let page = Html::parse_document(&report(folder.path(), "without.html", &[&path]).1);
    let front = texts(&page, "section.front").concat();
    assert!(
        front.contains("No bench is stated (--bench). Met while") && front.contains("K0 < 3.1"),
        "{front}"
    );
    let page = Html::parse_document(&report(folder.path(), "both.html", &[BENCH, &path]).1);
    let front = texts(&page, "section.front").concat();
    assert!(front.contains("the schemes differ in bench") && !front.contains("the only one that"), "{front}");
    // margins in the picture and in the table are those of the total: a margin below one is missed
    let body = texts(&page, "table td, svg text").join("\n");
    assert!(body.contains("0.1158 MISSED") && !body.contains("0.1158 met"), "{body}");
    let page = Html::parse_document(&report(folder.path(), "bench.html", &[BENCH]).1);
    let rows = table(&page, "Every unknown");
    let row = rows.iter().find(|r| r[0] == "D_IZ").expect("D_IZ");
    let at = row.iter().position(|x| x == "0.1000").expect("the requirement");
    let [total, margin] = [number(&row[at - 1]), number(&row[at + 1])];
    assert!((0.1 / total / margin - 1.0).abs() < 2e-3 && total > 0.5, "{row:?}");
}

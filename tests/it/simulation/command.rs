//! The command `simulate`: words, formats, folder, refusals.

use sha2::{Digest, Sha256};

use super::*;

/// An unknown that rests on priors names them: in the paper's case D_FZ - wN psi_y is observable, neither of
/// the two alone.
#[test]
fn what_rests_on_a_prior_says_on_whose() {
    let s = simulated(Carry::Platform, &Conditions::default());
    assert_eq!(
        (of(&s, "D_FZ").prior_of.as_slice(), of(&s, "psi_y").prior_of.as_slice()),
        (&["psi_y".to_string()][..], &["D_FZ".to_string()][..])
    );
    // sigma follows from the prior of psi_y times wN, not from its own prior
    let w_n = W_N_DPH * 28.2f64.to_radians().cos();
    assert!((of(&s, "D_FZ").sigma / (w_n * 0.1f64.to_radians()) - 1.0).abs() < 0.05, "{:?}", of(&s, "D_FZ"));
    for q in &s.quantities {
        assert!(q.prior_of.is_empty() || q.outcome == Outcome::PriorOnly, "{q:?}");
        for other in &q.prior_of {
            assert!(of(&s, other).prior_of.contains(&q.name), "mutual: {} {other}", q.name);
        }
    }
    let text = stdout(&run(&P1P2));
    let line = "  psi_y, D_FZ: on the priors of psi_y, D_FZ together, which the outputs do not tell apart\n";
    assert!(text.contains(line), "{text}");
}

/// A combination with psi belongs to the unknowns of the scheme's own carry; the other carries are judged
/// beside it all the same.
#[test]
fn a_combination_with_psi_is_of_the_own_carry() {
    let combination = ["--combination", "D_FZ - wN*psi_y"];
    let output = run(&[&P1P2[..], &combination, &["--format", "json"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let asked = answer["combinations"].as_array().and_then(|all| all.last()).expect("a combination");
    assert_eq!((&asked["name"], &asked["degree"]), (&"D_FZ - wN*psi_y".into(), &1.into()), "{asked}");
}

/// The smallest margin is attributed to "the others" if some missed unknowns have no margin.
#[test]
fn a_margin_is_not_said_to_be_the_worst_of_what_it_leaves_out() {
    let attitudes = ["10,25,40", "130,-50,70", "-95,33,-160", "60,80,15", "-20,-70,110"];
    let angles = attitudes.map(|a| format!("--angles={a}"));
    let of = |more: &[&str]| {
        let mut arguments: Vec<&str> = vec!["simulate", "--carry", "inertial", "--requirement", "D_I=0.005"];
        arguments.extend(angles.iter().map(String::as_str));
        arguments.extend(more);
        stdout(&run(&arguments)).replace("\n      ", " ")
    };
    // psi_x and psi_y rest on their prior and have no margin, although they miss by more
    let text = of(&["--requirement", "psi=0.01", "--prior", "psi=0.02"]);
    let said = "(resting on the prior); smallest margin of the others 0.0";
    assert!(text.contains("In this run requirements are NOT met, ") && text.contains(said), "{text}");
    let text = of(&["--requirement", "psi=0.0001", "--prior", "psi=10"]);
    assert!(text.contains("missed: psi_x, psi_y, psi_z, D_IX, D_IY, D_IZ; smallest margin "), "{text}");
}

#[test]
fn the_papers_run_word_by_word() {
    let output = run(&P1P2);
    assert!(output.status.success() && output.stderr.is_empty());
    insta::with_settings!({
        omit_expression => true, prepend_module_to_snapshot => false, snapshot_path => "../snapshots"
    }, {
        insta::assert_snapshot!("simulate_p1p2_table", stdout(&output));
    });
}

/// The folder: a figure per unknown as SVG and PNG, one figure with all of them, CSV and Parquet with the
/// same numbers, the same bytes each time, and nothing overwritten without --force.
#[test]
fn the_folder_of_a_run() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = |name: &str| place.path().join(name).display().to_string();
    let (one, two) = (folder("one"), folder("two"));
    for target in [&one, &two] {
        let output = run(&[&P1P2[..], &["-o", target, "--quiet"]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let files = |folder: &str| -> Vec<(String, Vec<u8>)> {
        let entries = std::fs::read_dir(folder).expect("the folder").map(|e| e.expect("an entry").path());
        let mut all: Vec<_> = entries
            .map(|p| {
                (
                    p.file_name().expect("a name").to_string_lossy().into_owned(),
                    std::fs::read(&p).expect("readable"),
                )
            })
            .collect();
        all.sort();
        all
    };
    let written = files(&one);
    assert_eq!(written, files(&two));
    let file = |name: &str| &written.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("{name}")).1;
    // the paper's figures 2-10, the other unknowns, the grids, and the errors of each
    let papers = ["psi_x", "psi_y", "psi_z", "D_FX", "D_FY", "D_FZ", "D_SX", "D_IY", "D_SZ"];
    let names = papers.iter().chain(&["D_OX", "D_FZ-wNpsi_y", "all", "figures-2-to-10"]);
    for name in names.flat_map(|name| [name.to_string(), format!("{name}.error")]) {
        let svg = String::from_utf8_lossy(file(&format!("{name}.svg")));
        assert!(svg.starts_with("<svg") && svg.contains("[deg") && svg.contains("t [s]"), "{name}");
        assert!(svg.contains("3 sigma"), "{name}");
        if name.ends_with(".error") {
            assert!(svg.contains("|error| [deg") && !svg.contains("linear filter"), "{name}");
        }
        let png = file(&format!("{name}.png"));
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n") && png.len() > 10_000, "{name}");
    }
    let svg = String::from_utf8_lossy(file("D_FY.svg"));
    assert!(svg.contains("D_FY [deg/h]") && svg.contains("truth") && svg.contains("3 sigma"));
    assert!(svg.contains("stroke-dasharray"), "the estimate is dashed, boundaries are dotted");
    for (end, label) in [("", "{}"), (".error", "Error of {}")] {
        let svg = String::from_utf8_lossy(file(&format!("figures-2-to-10{end}.svg"))).into_owned();
        let places: Vec<Option<usize>> = (papers.iter().enumerate())
            .map(|(k, name)| svg.find(&format!(">{}: {}", k + 2, label.replace("{}", name))))
            .collect();
        assert!(places[0].is_some() && places.is_sorted(), "in the paper's order: {places:?}");
    }
    // the paper's offset of D_FZ, which the estimate omits: wN at 28.2 deg times psi_y(0) of 0.1 deg, 0.023
    // deg/h
    let offset = -15.041_067 * 28.2f64.to_radians().cos() * 0.1f64.to_radians();
    let label = format!("|wN*(error of psi_y at t = 0)| = {:.5} deg/h", offset.abs());
    let errors: Vec<&str> = (written.iter())
        .filter(|(n, bytes)| n.ends_with(".error.svg") && String::from_utf8_lossy(bytes).contains(&label))
        .map(|(n, _)| n.as_str())
        .collect();
    assert_eq!(errors, ["D_FZ.error.svg", "all.error.svg", "figures-2-to-10.error.svg"], "{label}");

    let mut csv = csv::Reader::from_reader(&file("series.csv")[..]);
    let header: Vec<String> = csv.headers().expect("a header").iter().map(String::from).collect();
    assert_eq!(header[..3], ["position", "t_s", "psi_x_true_deg"]);
    assert!(header.contains(&"D_SX_sigma_dph_per_g".into()) && header.contains(&"D_FX_estimate_dph".into()));
    let rows: Vec<Vec<f64>> = csv
        .records()
        .map(|r| r.expect("a row").iter().map(|x| x.parse().expect("a number")).collect())
        .collect();
    assert_eq!((rows.len(), rows[0][1], rows[200][1], rows[200][0]), (201, 0.0, 2000.0, 2.0));

    let parquet = bytes::Bytes::from(file("series.parquet").clone());
    let reader = SerializedFileReader::new(parquet).expect("Parquet");
    // metadata of the run
    let metadata = reader.metadata().file_metadata().key_value_metadata().expect("metadata");
    let of = |key: &str| {
        let found = metadata.iter().find(|m| m.key == format!("obsdeg.{key}"));
        found.and_then(|m| m.value.clone()).expect("it is there")
    };
    let digest: String = Sha256::digest(file("summary.json")).iter().map(|b| format!("{b:02x}")).collect();
    assert_eq!((of("summary_sha256"), of("seed")), (digest, "1".into()));
    let units: serde_json::Value = serde_json::from_str(&of("units")).expect("JSON");
    assert_eq!((&units["t_s"], &units["D_FX_sigma_dph"]), (&"s".into(), &"deg/h".into()), "{units}");
    let columns = reader.metadata().file_metadata().schema_descr().columns().to_vec();
    let names: Vec<String> = columns.iter().map(|c| c.name().to_string()).collect();
    assert_eq!(names, header);
    for (row, expected) in reader.get_row_iter(None).expect("rows").zip(&rows) {
        let row = row.expect("a row");
        for (i, x) in expected.iter().enumerate() {
            let found = if i == 0 {
                f64::from(row.get_int(0).expect("an int"))
            } else {
                row.get_double(i).expect("a double")
            };
            assert_eq!(found, *x, "{}", names[i]);
        }
    }

    let summary: serde_json::Value = serde_json::from_slice(file("summary.json")).expect("JSON");
    assert_eq!(summary["schema"], "obsdeg.simulation/2");
    let refused = run(&[&P1P2[..], &["-o", &one]].concat());
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("--force"));
    assert!(run(&[&P1P2[..], &["-o", &one, "--force", "--seed", "2"]].concat()).status.success());
    assert_ne!(files(&one), written);
    let nowhere = run(&[&P1P2[..], &["-o", &folder("no/such/place")]].concat());
    assert_eq!(nowhere.status.code(), Some(2));
    assert_eq!(std::fs::read_dir(place.path()).expect("the place").count(), 2, "nothing is left behind");
}

/// With another filter than the linear one, the figures overlay the errors of both, and the axis covers both.
#[test]
fn errors_of_two_filters() {
    let conditions = Conditions { truth: Truth::Exact, ..Conditions::default() };
    let (_, record) = simulate(&paper(Carry::Platform), &conditions, 1).expect("simulated");
    let files = obsdeg_report::simulation_figures(&record.traces).expect("figures");
    let svg = |name: &str| {
        let file = files.iter().find(|f| f.name == name).unwrap_or_else(|| panic!("{name}"));
        String::from_utf8_lossy(&file.bytes).into_owned()
    };
    for name in &record.traces.names[..15] {
        let error = svg(&format!("{name}.error.svg"));
        for label in ["3 sigma", "|error|", "3 sigma of the linear filter", "|error| of the linear filter"] {
            assert!(error.contains(label), "{name}");
        }
        assert!(!error.contains("known from the prior only"), "{name}: large angles may tell");
        assert!(!svg(&format!("{name}.svg")).contains("linear filter"), "{name}");
    }
    assert!(svg("D_OX.error.svg").contains("not determined at small angles"));
    assert!(!svg("D_FX.error.svg").contains("not determined"));
    // the linear filter is off by 10 deg/h at the end, where 3 sigma of the other filter is 2.3
    let figure = svg("D_FY.error.svg");
    let ticks: Vec<f64> =
        figure.split('>').filter_map(|t| t.split('<').next()?.trim().parse().ok()).collect();
    assert!(ticks.contains(&10.0), "{ticks:?}");
}

#[test]
fn wrong_arguments_name_the_place() {
    for (arguments, expected) in [
        (&["--step", "0"][..], "'--step <S>': expected 1e-6 to 1e6 s"),
        (&["--dwell", "-5"], "'--dwell <S>': expected"),
        (&["--drift-noise", "1e200 deg/h"], "0, or 1e-12 to 1e6 deg/h"),
        (&["--drift-scale", "1e-300"], "expected 1e-6 to 1e6"),
        (&["--noise", "1e-160"], "expected 1e-15 to 1000 g"),
        (&["--noise", "1e155"], "expected 1e-15 to 1000 g"),
        (&["--prior", "D=1e200"], "expected 1e-9 to 1e9"),
        (&["--slew-rate", "1e-6"], "expected 0.001 to 10000 deg/s"),
        (&["--value", "D_FX"], "NAME=NUMBER"),
        (&["--value", "D_FW=1"], "`D_FW`"),
        (&["--prior", "psi=0"], "'--prior <NAME=X>': expected 1e-9 to 1e9"),
        (&["--drift-noise", "0.01"], "unit"),
        (&["--slew-rate", "1"], "inertial"),
        (&["--truth", "rough"], "linear"),
        (&["--combination", "D_FX +"], "combination"),
        (&["--angles", "alpha,0,0"], "alpha"),
        (&["--dwell", "1e9"], "'--dwell <S>': expected 0.001 to 1e6 s"),
        (&["--step", "1e-6"], "steps"),
    ] {
        let output = run(&[&P1P2[..], arguments].concat());
        let stderr = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected) && output.stdout.is_empty(), "{arguments:?}: {stderr}");
    }
}

/// Every format states the verdict; the JSON follows its schema.
#[test]
fn formats() {
    for format in ["markdown", "latex", "csv", "json"] {
        let output = run(&[&P1P2[..], &["--format", format]].concat());
        let text = stdout(&output);
        assert!(
            output.status.success() && text.contains("FX") && text.contains("determined"),
            "{format}: {text}"
        );
    }
}

//! The command `crosscheck`: exit codes, bytes, words and figures.

use super::P1P2;
use crate::program::{obsdeg, run, stderr, stdout};

#[test]
fn exit_codes_and_the_same_bytes() {
    let run = |arguments: &[&str]| run(&[&P1P2[..], &["--runs", "40"], arguments].concat());
    let (first, second) = (run(&["--format", "json"]), run(&["--format", "json"]));
    assert_eq!(first.status.code(), Some(0));
    assert_eq!(first.stdout, second.stdout);
    assert!(first.stderr.is_empty());
    assert_eq!(run(&["--filter-carry", "inertial"]).status.code(), Some(1));
    assert_eq!(run(&["--truth", "exact", "--filter", "linear"]).status.code(), Some(1));
    assert_eq!(run(&["--truth", "exact"]).status.code(), Some(0));
    assert_eq!(run(&["--filter-drop", "p9"]).status.code(), Some(2));
    assert_eq!(run(&["--value", "D_FW=1"]).status.code(), Some(2));
    assert_eq!(run(&["--drift-noise", "0.01"]).status.code(), Some(2));
}

/// Verbatim output of the paper's case, without numbers that are rounding errors.
#[test]
fn the_papers_case_word_by_word() {
    let output = run(&P1P2);
    assert!(output.status.success() && output.stderr.is_empty());
    insta::with_settings!({
        omit_expression => true,
        prepend_module_to_snapshot => false,
        snapshot_path => "../snapshots",
        filters => vec![(r" *\d\.\de-?\d+   ", "   [rounding]   ")],
    }, {
        insta::assert_snapshot!("crosscheck_p1p2_table", stdout(&output));
    });
}

/// The folder contains the figures of the evidence and nothing else.
#[test]
fn the_folder_of_a_crosscheck() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("evidence");
    let arguments =
        ["crosscheck", "--angles", "0,0,0", "--angles", "180,0,0", "--runs", "16", "--quiet", "-o"];
    let output = obsdeg(&arguments).arg(&folder).output().expect("it runs");
    assert!(output.status.success(), "{}", stderr(&output));
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .expect("the folder")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let pictures = ["correlation", "nees", "nis", "slopes"]
        .iter()
        .flat_map(|n| [format!("{n}.png"), format!("{n}.svg")]);
    let mut expected: Vec<String> = pictures.chain(["evidence.json".into()]).collect();
    expected.sort();
    assert_eq!(names, expected);
    let slopes = std::fs::read_to_string(folder.join("slopes.svg")).expect("readable");
    for text in ["slope -0.5", "slope -1.5", "slope -2.5", "dwell of a position [s]", "1 sigma [deg/h/g]"] {
        assert!(slopes.contains(text), "{text}");
    }
    // curves differ in colour or dashes, also those of different orders; reference lines are black and dotted
    let value = |path: &str, key: &str| {
        let rest = path.split_once(&format!(" {key}=\""))?.1;
        rest.split_once('"').map(|(value, _)| value.to_string())
    };
    let paths = slopes.split("<path ").skip(1).filter_map(|p| p.split_once("/>").map(|(path, _)| path));
    let styles: Vec<_> = paths
        .map(|path| (value(path, "stroke"), value(path, "stroke-dasharray")))
        .filter(|(color, _)| color.as_deref() != Some("#000000"))
        .collect();
    let different: std::collections::BTreeSet<_> = styles.iter().collect();
    assert_eq!((styles.len(), different.len()), (8, 8), "{styles:?}");
}

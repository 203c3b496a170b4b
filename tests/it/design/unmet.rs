//! `--meet` where no scheme meets every requirement: the suggested changes do meet them, by other searches
//! and other commands.

use crate::program::{json, run, stderr};

/// Options of a search for five positions that no dwell of 600 s makes good enough.
const ASKED: [&str; 10] = [
    "design",
    "--carry",
    "inertial",
    "--dwell",
    "600",
    "--requirement",
    "D=0.05",
    "--requirement",
    "psi=5",
    "--meet",
];

fn asked<'o>(more: &[&'o str]) -> Vec<&'o str> {
    [&ASKED[..], more].concat()
}

/// Text of a message between two of its phrases.
fn between<'t>(text: &'t str, before: &str, behind: &str) -> &'t str {
    let at = text.find(before).unwrap_or_else(|| panic!("{before}: {text}")) + before.len();
    let end = text[at..].find(behind).unwrap_or_else(|| panic!("{behind}: {text}"));
    &text[at..at + end]
}

/// Every suggestion is tried with the printed options: the search finds a scheme, and a comparison confirms
/// that it meets every requirement.
#[test]
#[ignore = "seconds: .ci/run release"]
fn what_would_do_does() {
    let output = run(&asked(&["--positions", "5"]));
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.starts_with("error: no scheme of 5 of these candidates") && output.stdout.is_empty());
    let nearest = between(&message, "nearest scheme found: ", ",");
    let (dwell, positions) =
        (between(&message, "with --dwell ", " "), between(&message, "with --positions ", " "));
    // the nearest scheme has the best margin by exhaustion (rounded), and the message names its limiting
    // unknown
    let without: Vec<&str> = asked(&["--positions", "5", "--criterion", "margin", "--format", "json"]);
    let without: Vec<&str> = without.into_iter().filter(|o| *o != "--meet").collect();
    let best = json(&without);
    let worst = &best["found"][0]["requirements"]["worst"];
    let margin_and_name = between(&message, "requirements met, worst margin ", "\n");
    let (margin, name) = margin_and_name.split_once(' ').expect("a margin and a name");
    let (margin, least): (f64, f64) =
        (margin.parse().expect("a number"), worst["margin"].as_f64().expect("a number"));
    assert!(margin <= least + 1e-4 && margin > 0.8 * least && margin < 1.0, "{margin_and_name} {worst}");
    assert!(name.starts_with("(D_") || name.starts_with("(psi"), "{margin_and_name}");
    assert_eq!(nearest.split(' ').count(), 5);
    // the suggested dwell suffices for this scheme; one shorter by two percent does not
    let met = |arguments: &[&str]| {
        let found = json(&[arguments, &["--format", "json", "--restarts", "24"]].concat());
        let r = &found["found"][0]["requirements"];
        assert_eq!(
            (&r["met"], r["missed"].as_array().map(Vec::len)),
            (&r["stated"], Some(0)),
            "{arguments:?}"
        );
    };
    let with_dwell: Vec<&str> =
        asked(&["--positions", "5"]).into_iter().map(|o| if o == "600" { dwell } else { o }).collect();
    met(&with_dwell);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("nearest.toml");
    let scheme = |dwell: &str| {
        let positions: String =
            nearest.split(' ').map(|p| format!("[[position]]\nattitude = \"{p}\"\n")).collect();
        let conditions = "[requirements]\nD = 0.05\npsi = 5\n";
        std::fs::write(
            &file,
            format!("carry = \"inertial\"\n[simulation]\ndwell_s = {dwell}\n{conditions}{positions}"),
        )
        .expect("written");
        let path = file.display().to_string();
        json(&["compare", &path, "--format", "json"])["schemes"][0]["requirements"]["missed"]
            .as_array()
            .map(Vec::len)
    };
    let shorter = (dwell.parse::<f64>().expect("a number") * 0.98).to_string();
    assert_eq!(scheme(dwell), Some(0));
    assert!(scheme(&shorter) > Some(0) && scheme("600") > Some(0));
    met(&asked(&["--positions", positions]));
    if message.contains("with --candidates grid:45 this scheme meets all") {
        met(&asked(&["--positions", "5", "--candidates", "grid:45"]));
    }
    // the same command gives the same bytes
    assert_eq!(stderr(&run(&asked(&["--positions", "5"]))), message);
}

/// A scheme file sets the conditions of a search as options do, and its number of positions.
#[test]
fn conditions_are_those_of_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scheme.toml");
    let positions = "[[position]]\nattitude = \"NUE\"\n".repeat(3);
    std::fs::write(
        &file,
        format!(
            "carry = \"inertial\"\nlatitude_deg = 45\nterms = \"F,S\"\n[simulation]\ndwell_s = 700\n[requirements]\n\
             D = 0.5\npsi = 5\n[gimbals]\nbeta_deg = [-60, 60]\n{positions}"
        ),
    )
    .expect("written");
    let file = file.display().to_string();
    let by_file = json(&["design", &file, "--criterion", "margin", "--format", "json"]);
    let by_options = json(&[
        "design",
        "--positions",
        "3",
        "--carry",
        "inertial",
        "--latitude",
        "45",
        "--terms",
        "F,S",
        "--dwell",
        "700",
        "--requirement",
        "D=0.5",
        "--requirement",
        "psi=5",
        "--gimbal",
        "beta=-60:60",
        "--criterion",
        "margin",
        "--format",
        "json",
    ]);
    assert_eq!(by_file, by_options);
    // options override the number of positions and the candidates
    let other = ["--positions", "2", "--candidates", "grid:45", "--observable", "D_FX", "--format", "json"];
    let other = json(&[&["design", &file][..], &other].concat());
    assert_eq!((&other["search"]["positions"], &other["carry"]), (&2.into(), &"inertial".into()));
    assert!(other["candidates"].as_array().map_or(0, Vec::len) > 24);
}

//! Pictures of what to measure next, read back from their SVG and compared with the JSON beside them.

use std::collections::BTreeMap;
use std::path::Path;

use regex::Regex;
use serde_json::Value;

use crate::program::{run, stderr};

/// Answer and pictures that a command writes to a folder.
struct Drawn {
    answer: Value,
    svg: BTreeMap<String, String>,
}

/// Runs a command with `-o`, and reads the folder: every SVG has a PNG beside it.
fn drawn(arguments: &[&str], json: &str, names: &[&str]) -> Drawn {
    let scratch = tempfile::tempdir().expect("a folder");
    let folder = scratch.path().join("out");
    let target = folder.to_str().expect("UTF-8");
    let ran = run(&[arguments, &["-o", target, "--quiet"]].concat());
    assert!(ran.status.success(), "{}", stderr(&ran));
    let read = |path: &Path| std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut files: Vec<String> = std::fs::read_dir(&folder)
        .expect("a folder")
        .map(|e| e.expect("an entry").file_name().into_string().expect("UTF-8"))
        .collect();
    files.sort();
    let mut expected: Vec<String> =
        names.iter().flat_map(|n| [format!("{n}.png"), format!("{n}.svg")]).collect();
    expected.push(json.into());
    expected.sort();
    assert_eq!(files, expected);
    let mut svg = BTreeMap::new();
    for name in names {
        assert!(read(&folder.join(format!("{name}.png"))).starts_with(b"\x89PNG"), "{name}");
        let text = String::from_utf8(read(&folder.join(format!("{name}.svg")))).expect("UTF-8");
        svg.insert((*name).to_string(), text);
    }
    Drawn { answer: serde_json::from_slice(&read(&folder.join(json))).expect("JSON"), svg }
}

fn pattern(text: &str) -> Regex {
    Regex::new(text).expect("a pattern")
}

fn number(text: &str) -> f64 {
    text.parse().expect("a number")
}

/// Letters of the cells of a table, column by column, without the legend; `None` for a dash.
fn columns(svg: &str, rows: usize) -> Vec<Vec<Option<u64>>> {
    let cell =
        pattern(r#"<rect x="([\d.]+)" y="([\d.]+)" width="34" height="20"[^>]*/><text [^>]*>([^<]+)</text>"#);
    let cells: Vec<(f64, f64, Option<u64>)> =
        cell.captures_iter(svg).map(|c| (number(&c[1]), number(&c[2]), c[3].parse().ok())).collect();
    let mut heights: Vec<f64> = cells.iter().map(|c| c.1).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    assert_eq!(heights.len(), rows + 1, "rows and a legend");
    let mut places: Vec<f64> = cells.iter().filter(|c| c.1 == heights[0]).map(|c| c.0).collect();
    places.sort_by(f64::total_cmp);
    let at = |x: &f64| {
        let mut own: Vec<_> = cells.iter().filter(|c| c.0 == *x && c.1 < heights[rows]).collect();
        own.sort_by(|a, b| a.1.total_cmp(&b.1));
        own.into_iter().map(|c| c.2).collect()
    };
    places.iter().map(at).collect()
}

/// List of degrees in JSON.
fn degrees(list: &Value) -> Vec<Option<u64>> {
    list.as_array().expect("a list").iter().map(Value::as_u64).collect()
}

/// One entry of each element of a list in JSON.
fn each(list: &Value, key: &str) -> Vec<Option<u64>> {
    list.as_array().expect("a list").iter().map(|q| q[key].as_u64()).collect()
}

/// Texts of a picture with their places.
fn texts(svg: &str) -> Vec<([f64; 2], String)> {
    let text = pattern(r#"<text x="(-?[\d.]+)" y="(-?[\d.]+)"[^>]*>([^<]+)</text>"#);
    text.captures_iter(svg).map(|c| ([number(&c[1]), number(&c[2])], c[3].to_string())).collect()
}

/// Cells have the degrees of the answer: with no candidate, with each, with all.
#[test]
fn degrees_by_sensor_are_those_of_the_answer() {
    for own in [true, false] {
        let mut asked = vec!["design", "examples/sir/model.toml", "--measure", "states, beta, S + R"];
        asked.extend(own.then_some("--own-outputs"));
        let Drawn { answer, svg } = drawn(&asked, "sensors.json", &["front", "degrees"]);
        let unknowns = answer["quantities"].as_array().expect("a list").len();
        let candidates = answer["candidates"].as_array().expect("a list");
        let mut expected = Vec::new();
        expected.extend(own.then(|| each(&answer["quantities"], "own_degree")));
        expected.extend(candidates.iter().map(|c| degrees(&c["degrees"])));
        expected.push(each(&answer["quantities"], "least_degree"));
        let found = columns(&svg["degrees"], unknowns);
        assert_eq!(found, expected);
        assert!(found.iter().flatten().any(Option::is_none) && found.iter().flatten().any(Option::is_some));
        let words: Vec<String> = texts(&svg["degrees"]).into_iter().map(|t| t.1).collect();
        for name in candidates.iter().chain(answer["quantities"].as_array().expect("a list")) {
            let name = name["name"].as_str().expect("a name");
            assert!(words.iter().any(|w| w == name), "{name}: {words:?}");
        }
    }
}

/// Degrees with no more output are the degrees by `analyze`.
#[test]
fn degrees_without_a_candidate_are_those_of_the_model() {
    let model = "examples/sir/model.toml";
    let found =
        crate::program::json(&["design", model, "--measure", "beta", "--own-outputs", "--format", "json"]);
    let judged = crate::program::json(&["analyze", model, "--solutions", "off", "--format", "json"]);
    let names = |of: &Value| -> Vec<Value> {
        of["quantities"].as_array().expect("a list").iter().map(|q| q["name"].clone()).collect()
    };
    assert_eq!(names(&found), names(&judged));
    assert_eq!(each(&found["quantities"], "own_degree"), each(&judged["quantities"], "degree"));
    let alone = crate::program::json(&["design", model, "--measure", "states", "--format", "json"]);
    assert!(each(&alone["quantities"], "own_degree").iter().all(Option::is_none));
}

/// Every set of the front stands at the right of its point: the places are linear in degree and number.
#[test]
fn the_front_has_every_set_at_its_place() {
    let Drawn { answer, svg } =
        drawn(&["design", "examples/mapk/model.toml"], "sensors.json", &["front", "degrees"]);
    let front = answer["front"].as_array().expect("a list");
    assert!(front.len() >= 4);
    let points: Vec<[f64; 4]> = front
        .iter()
        .map(|f| {
            let outputs: Vec<&str> =
                f["outputs"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
            let name = outputs.join(", ");
            let all = texts(&svg["front"]);
            let ([x, y], _) = all.iter().find(|t| t.1 == name).unwrap_or_else(|| panic!("{name}"));
            [f["degree"].as_f64().expect("a degree"), outputs.len() as f64, *x, *y]
        })
        .collect();
    let (first, last) = (points[0], points[points.len() - 1]);
    for p in &points {
        for (value, place) in [(0, 2), (1, 3)] {
            let share = (p[value] - first[value]) / (last[value] - first[value]);
            let expected = first[place] + share * (last[place] - first[place]);
            assert!((p[place] - expected).abs() < 1.5, "{points:?}");
        }
    }
    // a larger degree lies to the right, more outputs above
    assert!(first[2] > last[2] && first[3] > last[3], "{points:?}");
}

/// Wedge of a candidate: centre of its point and of its text, and its colour.
struct Wedge {
    point: [f64; 2],
    text: [f64; 2],
    fill: String,
}

fn wedges(svg: &str) -> BTreeMap<String, Wedge> {
    let group = pattern(
        r#"<g transform="translate\((-?[\d.]+) (-?[\d.]+)\)">((?:<path|<circle|<text|<title)[\s\S]*?)</g>"#,
    );
    let path = pattern(r#"fill="(rgb[^"]+)"[^>]*><title>([^:<]+): "#);
    let mut out = BTreeMap::new();
    for c in group.captures_iter(svg) {
        let all = texts(&c[3]);
        for p in path.captures_iter(&c[3]) {
            let text = all.iter().find(|t| t.1 == p[2]).map_or([0.0; 2], |t| t.0);
            let point = [number(&c[1]), number(&c[2])];
            out.insert(p[2].to_string(), Wedge { point, text, fill: p[1].to_string() });
        }
    }
    out
}

/// The letters of a candidate say which axis is up, and where North lies: its wedge is at the name of this
/// axis, and opens to the side of North. A smaller uncertainty is darker.
#[test]
fn attitudes_are_where_their_letters_say() {
    let asked = ["design", "examples/bench-day/scheme.toml", "--next", "1"];
    let Drawn { answer, svg } = drawn(&asked, "next.json", &["attitudes", "degrees"]);
    let map = &svg["attitudes"];
    let (wedges, words) = (wedges(map), texts(map));
    assert_eq!(wedges.len(), 24);
    for (name, wedge) in &wedges {
        let letters: Vec<char> = name.chars().collect();
        let up = letters.iter().position(|l| "UD".contains(*l)).expect("a vertical axis");
        let word = if letters[up] == 'U' { "up" } else { "down" };
        let label = format!("{}_p {word}", ["X", "Y", "Z"][up]);
        let ([x, y], _) = words.iter().find(|t| t.1 == label).expect("a name of an axis");
        assert!(
            (x - wedge.point[0]).abs() < 0.2 && (y - wedge.point[1] - 60.0).abs() < 0.2,
            "{name} {label}"
        );
        // at X_p and Y_p the pole Z_p is at the top of the map
        if up < 2 && letters[2] == 'N' {
            assert!(wedge.text[1] < -20.0 && wedge.text[0].abs() < 1.0, "{name} {:?}", wedge.text);
        }
        if up < 2 && letters[2] == 'S' {
            assert!(wedge.text[1] > 20.0 && wedge.text[0].abs() < 1.0, "{name} {:?}", wedge.text);
        }
        // from outside, with Z_p upwards, Y_p is to the right of X_p, and -X_p to the right of Y_p
        let right = match (up, letters[up]) {
            (0, 'U') => Some((1, 'N')),
            (0, _) => Some((1, 'S')),
            (1, 'U') => Some((0, 'S')),
            (1, _) => Some((0, 'N')),
            _ => None,
        };
        if right.is_some_and(|(axis, letter)| letters[axis] == letter) {
            assert!(wedge.text[0] > 20.0, "{name} {:?}", wedge.text);
        }
    }
    let gains = answer["by_candidate"].as_array().expect("a list");
    assert_eq!(gains.len(), 24);
    let red = |g: &Value| -> f64 {
        let fill = &wedges[g["candidate"].as_str().expect("a name")].fill;
        number(fill.trim_start_matches("rgb(").split(',').next().expect("red"))
    };
    let ratio = |g: &Value| g["ratio"].as_f64().expect("a ratio");
    let open: Vec<u64> = gains.iter().filter_map(|g| g["not_observable"].as_u64()).collect();
    assert!(open.iter().all(|k| *k == open[0]));
    for a in gains {
        for b in gains {
            assert!(ratio(a) > ratio(b) || red(a) <= red(b), "{a} {b}");
        }
    }
    // the scheme's positions are marked, the best has a border of its own
    assert_eq!(map.matches("stroke-width=\"3\" />").count(), 6);
    assert_eq!(map.matches("stroke-width=\"3\" stroke-linejoin").count(), 1);
}

/// Columns of the table of degrees: nothing added, then the candidates, best first; the best is the answer.
#[test]
#[ignore = "seconds: .ci/run"]
fn degrees_by_position_are_those_of_the_answer() {
    // two positions leave coefficients open, so that verdicts differ
    let asked = ["design", "examples/year-of-storage/scheme.toml", "--next", "1", "--keep", "99"];
    let Drawn { answer, svg } = drawn(&asked, "next.json", &["attitudes", "degrees"]);
    let gains = answer["by_candidate"].as_array().expect("a list");
    let required = answer["required"].as_array().expect("a list").len();
    let mut expected = vec![degrees(&answer["degrees_before"])];
    expected.extend(gains.iter().map(|g| degrees(&g["degrees"])));
    assert_eq!(columns(&svg["degrees"], required), expected);
    // the entries are those of the listed extensions
    let found = answer["found"].as_array().expect("a list");
    for g in gains {
        let first = found.iter().find(|e| e["positions"][0]["candidate"] == g["candidate"]);
        let then = &first.expect("an extension")["then"];
        assert_eq!(
            then["not_observable"].as_array().map(Vec::len),
            g["not_observable"].as_u64().map(|k| k as usize)
        );
        assert_eq!(then["worst"], g["worst"]);
        assert_eq!(
            (&g["angles"], required),
            (&first.expect("one")["positions"][0]["angles"], degrees(&g["degrees"]).len())
        );
    }
    assert!(svg["attitudes"].contains(&format!(">undetermined of {required}<")));
    // two added positions are no single ones
    let two = ["design", "examples/year-of-storage/scheme.toml", "--next", "2", "--keep", "1"];
    let Drawn { answer, svg } = drawn(&two, "next.json", &[]);
    assert!(answer.get("by_candidate").is_none() && svg.is_empty());
}

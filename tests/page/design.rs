//! The search of the workbench: its limits, its errors and its results, against the command line.

use std::fs;

use serde_json::{Value, json};

use crate::browser::Browser;
use crate::opened::{choose, click, opened, quiet, scheme, wait, write, wrong};
use crate::program::{json as answer_of, run};

/// Condition that a search has ended and its schemes are listed.
const FOUND: &str = "document.querySelector('#found tbody tr') && document.getElementById('design-stop').disabled && \
                     !document.getElementById('found').classList.contains('stale')";

#[test]
fn the_best_positions_are_found() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    choose(b, "#carry", "inertial");
    click(b, "#tab-design");
    click(b, "#design-go");
    wait(
        b,
        "progress",
        "/\\d of \\d/.test(document.getElementById('design-said').textContent) || document.querySelector('#found td')",
    );
    wait(b, "found", FOUND);
    let value = b.value("document.querySelector('#found tbody tr').children[2].textContent");
    let answer = run(&["design", "--positions", "5", "--carry", "inertial", "--format", "json"]);
    let answer: Value = serde_json::from_slice(&answer.stdout).expect("JSON");
    let best = answer["found"][0]["value"].as_f64().expect("a number");
    assert!(value.as_str().is_some_and(|v| v.starts_with(&format!("{best:.5}")[..6])), "{value} {best}");
    click(b, "#found tbody tr:first-child button");
    wait(b, "five", "document.querySelectorAll('#positions li').length == 5");
    wait(b, "all", "document.getElementById('summary').textContent.startsWith('rank 15 of 15')");
    // another criterion, which needs a requirement, for some unknowns
    write(b, "#requirements", "D = 0.1");
    click(b, "#tab-design");
    write(b, "#design-k", "3");
    choose(b, "#design-criterion", "margin");
    write(b, "#design-observable", "D_F");
    click(b, "#design-go");
    wait(b, "margin", FOUND);
    let value = b.value("document.querySelector('#found tbody tr').children[2].textContent");
    let command =
        ["design", "--positions", "3", "--carry", "inertial", "--criterion", "margin", "--observable", "D_F"];
    let answer = run(&[&command[..], &["--requirement", "D=0.1", "--format", "json"]].concat());
    let answer: Value = serde_json::from_slice(&answer.stdout).expect("JSON");
    let best = answer["found"][0]["value"].as_f64().expect("a number");
    assert!(value.as_str().is_some_and(|v| v.starts_with(&best.to_string()[..4])), "{value} {best}");
    choose(b, "#design-criterion", "worst");
    // what was found under conditions that changed meanwhile says so
    click(b, "#design-go");
    choose(b, "#carry", "reset");
    wait(
        b,
        "of those before",
        "document.getElementById('design-stop').disabled && document.getElementById('found-old').textContent != ''",
    );
    choose(b, "#carry", "inertial");
    wait(b, "of these", FOUND);
    // a longer search is stopped, and the next one starts
    click(b, "#tab-design");
    write(b, "#design-observable", "");
    write(b, "#design-k", "9");
    click(b, "#design-go");
    wait(b, "under way", "!document.getElementById('design-stop').disabled");
    click(b, "#design-stop");
    wait(b, "ended", "document.getElementById('design-said').textContent == 'Stopped.'");
    // what was found before stays
    assert!(b.value("document.querySelectorAll('#found tbody tr').length").as_u64() > Some(0));
    write(b, "#design-observable", "D_F");
    write(b, "#design-k", "3");
    click(b, "#design-go");
    wait(b, "again", FOUND);
    quiet(b);
}

/// Gimbal limits, slew rate, times, requirements and a grid: the same schemes as on the command line; rows of
/// equal figures are folded, the winner is drawn, and a loaded scheme holds the limits of its search.
#[test]
fn a_search_has_limits() {
    let Some((mut browser, _)) = opened(1280) else { return };
    let b = &mut browser;
    choose(b, "#carry", "inertial");
    write(b, "#requirements", "D = 0.2");
    click(b, "#tab-design");
    write(b, "#design-k", "5");
    choose(b, "#design-candidates", "grid:45");
    choose(b, "#design-candidates", "cardinal");
    write(b, "#design-gimbals", "alpha = -100:100, beta=-100:100");
    write(b, "#design-slew-rate", "2");
    write(b, "#design-max-slew", "100");
    write(b, "#design-max-time", "5500");
    click(b, "#design-meet");
    click(b, "#design-go");
    wait(b, "found", FOUND);
    let command = [
        "design",
        "--positions",
        "5",
        "--carry",
        "inertial",
        "--requirement",
        "D=0.2",
        "--gimbal=alpha=-100:100",
        "--gimbal=beta=-100:100",
        "--slew-rate",
        "2",
        "--max-slew",
        "100",
        "--max-time",
        "5500",
        "--meet",
        "--keep",
        "300",
        "--format",
        "json",
    ];
    let answer = answer_of(&command);
    let found = answer["found"].as_array().expect("schemes");
    // every scheme is in the table once, in a row of its figures
    let shown = b.value(
        "[...document.querySelectorAll('#found tbody tr')].map(r => ({ value: r.cells[2].textContent, \
         loads: [...r.querySelectorAll('button')].map(x => Number(/scheme (\\d+)/.exec(x.ariaLabel)[1])), \
         more: r.querySelector('summary')?.textContent }))",
    );
    let rows = shown.as_array().expect("rows");
    let mut values: Vec<&str> = rows.iter().filter_map(|r| r["value"].as_str()).collect();
    values.dedup();
    assert!(rows.len() <= 10 && !rows.is_empty(), "{shown}");
    let mut listed = 0;
    for row in rows {
        let loads: Vec<usize> = row["loads"]
            .as_array()
            .expect("a list")
            .iter()
            .filter_map(|n| Some(n.as_u64()? as usize))
            .collect();
        let more = row["more"].as_str().map_or(0, |t| {
            let count = t.trim_start_matches("at least ").strip_suffix(" more with these figures");
            count.and_then(|n| n.parse().ok()).expect("a number")
        });
        assert_eq!(loads.len(), 1 + more.min(20), "{row}");
        listed += 1 + more;
        let number: f64 =
            row["value"].as_str().and_then(|v| v.split(' ').next()?.parse().ok()).expect("a number");
        for n in loads {
            let value = found[n - 1]["value"].as_f64().expect("a number");
            assert!((value / number - 1.0).abs() < 1e-3, "{row} {value}");
        }
    }
    assert!(rows.iter().any(|r| r["more"].is_string()), "{shown}");
    assert!(listed == found.len() || rows.len() == 10, "{listed} of {}", found.len());
    // the first lines of the answer: what the winner does not keep is said
    let said = b.value("document.getElementById('found-sentences').textContent");
    for part in ["every requirement is met, 12 of 12", "do NOT stay within the gimbal limits"] {
        assert!(said.as_str().is_some_and(|s| s.contains(part) && !s.contains("--")), "{said}");
    }
    // pictures of the winner, each drawn
    let drawn = b.value(
        "[...document.querySelectorAll('#winner figure')].map(f => { const c = f.querySelector('canvas'); \
         const data = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; \
         return [f.textContent, data.some(x => x)]; })",
    );
    let first = b.value(
        "(r => [r.cells[1].firstChild.firstChild.textContent, \
         r.cells[3].textContent])(document.querySelector('#found tbody tr'))",
    );
    let names = first[0].as_str().expect("names").split(' ').enumerate();
    let captions: Vec<Value> = names.map(|(i, name)| json!([format!("{}: {name}", i + 1), true])).collect();
    assert_eq!(drawn, json!(captions));
    // loaded, with the limits and the rate; the command line reads the file and gives the same figures
    click(b, "#found tbody tr:first-child button");
    wait(b, "loaded", "document.querySelectorAll('#positions li').length == 5");
    let text = scheme(b);
    for line in ["alpha_deg = [-100, 100]", "beta_deg = [-100, 100]", "slew_rate_deg_s = 2"] {
        assert!(text.contains(line), "{line}: {text}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scheme.toml");
    fs::write(&file, &text).expect("written");
    let judged = answer_of(&["simulate", file.to_str().expect("UTF-8"), "--format", "json", "-q"]);
    // equally good schemes may stand in another order than on the command line
    let worst = first[1].as_str().expect("a name");
    let quantity = judged["quantities"].as_array().expect("a list").iter().find(|q| q["name"] == worst);
    let sigma = quantity.expect("the worst")["predicted_sigma"].as_f64().expect("a number");
    let stated = found[0]["worst_sigma_dph"].as_f64().expect("a number");
    assert!((sigma / stated - 1.0).abs() < 0.02, "{sigma} {stated}");
    click(b, "#tab-design");
    // loading changes the conditions to those of the search, not away from them
    assert_eq!(b.value("document.getElementById('found-old').textContent"), json!(""));
    let limits = b.value("document.getElementById('design-limits').textContent");
    assert!(
        limits.as_str().is_some_and(|t| t.contains("alpha=-100:100, beta=-100:100, slews at 2 deg/s")),
        "{limits}"
    );
    quiet(b);
}

/// Errors of a search stand at the field that they are about, in words of the page, and nothing is searched.
#[test]
fn errors_of_a_search_stand_at_their_fields() {
    let Some((mut browser, _)) = opened(1280) else { return };
    let b = &mut browser;
    click(b, "#tab-design");
    let refused = |b: &mut Browser, field: &str, text: &str, said: &str| {
        write(b, &format!("#{field}"), text);
        click(b, "#design-go");
        wait(b, field, &wrong(field, said));
        let words = b.value(&format!("document.getElementById('{field}-wrong').textContent"));
        assert!(!words.as_str().expect("a text").contains("--"), "{words}");
        assert_eq!(b.value(&format!("document.getElementById({field:?}).value")), json!(text));
        write(b, &format!("#{field}"), if field == "design-k" { "3" } else { "" });
    };
    refused(b, "design-k", "0", "K: expected a whole number from 1 to 100, found \"0\"");
    refused(b, "design-gimbals", "alpha=3", "expected angles and degrees such as alpha=-90:90");
    refused(b, "design-gimbals", "alpha=20:10", "alpha");
    refused(
        b,
        "design-slew-rate",
        "fast",
        "Slew rate: expected a number of deg/s from 0.001 to 10000, found \"fast\"",
    );
    // slews that take time need inertial carry
    refused(b, "design-slew-rate", "2", "expected inertial");
    refused(b, "design-max-slew", "60", "Longest slew does nothing here");
    refused(b, "design-max-time", "-3", "Total time: expected a number of s");
    refused(b, "design-observable", "D_Q", "`D_Q` is no coefficient of this scheme");
    for (field, action) in [("design-meet", ""), ("design-criterion", "margin")] {
        match action {
            "" => click(b, "#design-meet"),
            value => choose(b, "#design-criterion", value),
        }
        click(b, "#design-go");
        wait(b, field, &wrong(field, "expected requirements under Positions"));
        match action {
            "" => click(b, "#design-meet"),
            _ => choose(b, "#design-criterion", "worst"),
        }
    }
    // a mended field is no longer marked
    write(b, "#design-k", "x");
    click(b, "#design-go");
    wait(b, "wrong", &wrong("design-k", "found \"x\""));
    assert_eq!(b.value("document.getElementById('design-said').textContent"), json!("Not searched."));
    write(b, "#design-k", "4");
    wait(b, "mended", "!document.querySelector('#panel-design .wrong')");
    // a mended request is searched
    write(b, "#design-k", "3");
    write(b, "#design-observable", "D_F");
    choose(b, "#carry", "inertial");
    click(b, "#design-go");
    wait(b, "found", FOUND);
    assert_eq!(b.value("document.querySelectorAll('#panel-design .wrong').length"), json!(0));
    quiet(b);
}

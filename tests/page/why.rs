//! Explanations of verdicts and the next position in the workbench, against the command line.

use std::fs;

use serde_json::{Value, json};

use crate::browser::Browser;
use crate::opened::{choose, click, opened, quiet, scheme, wait, write};
use crate::program::{json as answer_of, run, stdout};

/// Texts of the elements that a selector finds.
fn texts(b: &mut Browser, selector: &str) -> Vec<String> {
    let found = b.value(&format!("[...document.querySelectorAll({selector:?})].map(e => e.textContent)"));
    found.as_array().expect("a list").iter().filter_map(|t| Some(t.as_str()?.to_string())).collect()
}

/// Asserts that heading, sentences and changes of a box are those of the command line, in Markdown.
fn is_as_printed(b: &mut Browser, explained: &str, command: &[&str]) {
    let printed = stdout(&run(&[command, &["--solutions", "off", "--format", "markdown"]].concat()));
    let printed = printed.replace('\\', "");
    let heading = texts(b, &format!("{explained} h3"));
    assert_eq!(heading.len(), 1);
    let section = printed
        .split(&format!("# {}\n", heading[0]))
        .nth(1)
        .unwrap_or_else(|| panic!("{heading:?}: {printed}"));
    // sentences, then the changes under a heading of their own
    let parts: Vec<&str> = section.split("\n#").collect();
    let sentences: Vec<&str> = parts[0].trim_start().lines().filter(|l| l.starts_with("- ")).collect();
    let shown: Vec<String> = texts(b, &format!("{explained} li")).iter().map(|l| format!("- {l}")).collect();
    assert!(!shown.is_empty());
    assert_eq!(shown, sentences);
    let rows: Vec<Vec<String>> = parts[1]
        .lines()
        .filter(|l| l.starts_with('|'))
        .skip(2)
        .map(|l| l.trim_matches('|').split('|').map(|cell| cell.trim().to_string()).collect())
        .collect();
    assert_eq!(texts(b, &format!("{explained} tbody td:not(.changers td)")), rows.concat());
    if rows.is_empty() {
        let (title, reason) = parts[1].trim_start_matches('#').trim().split_once('\n').expect("a reason");
        let paragraph = format!("{title}: {}.", reason.trim().trim_start_matches("- "));
        assert_eq!(texts(b, &format!("{explained} p")), [paragraph]);
    }
}

fn heading(b: &mut Browser, explained: &str, text: &str) {
    let condition = format!(
        "document.querySelector('{explained} h3')?.textContent == {text:?} && \
         !document.querySelector('{explained}').classList.contains('stale')"
    );
    wait(b, text, &condition);
}

/// Clicks an unknown in the table of verdicts once everything has come: what comes later moves the rows.
fn click_row(b: &mut Browser, name: &str) {
    wait(b, "all", "document.querySelector('#verdicts table:not(.old-sigmas):not(.old-solutions)')");
    click(b, &format!("#verdicts tr[data-name={name}] button.why"));
}

#[test]
fn a_verdict_is_explained() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    let positions = ["analyze", "--angles", "0,0,0", "--angles", "180,0,0", "--why", "D_FZ"];
    click_row(b, "D_FZ");
    heading(b, "#why", "Why D_FZ is not observable");
    is_as_printed(b, "#why", &positions);
    // the explanation follows the scheme: what a change is said to give is what it gives
    let changes = texts(b, "#why tbody tr td:nth-child(1)");
    let degrees = texts(b, "#why tbody tr td:nth-child(2)");
    let inertial = changes.iter().position(|c| c == "take inertial carry").expect("a change");
    choose(b, "#carry", "inertial");
    heading(b, "#why", &format!("Why D_FZ has degree {}", degrees[inertial]));
    is_as_printed(b, "#why", &[&positions[..], &["--carry", "inertial"]].concat());
    // another unknown, then one that the scheme has not
    click_row(b, "psi_y");
    wait(b, "psi_y", "document.querySelector('#why h3').textContent.startsWith('Why psi_y ')");
    click_row(b, "D_FZ");
    wait(b, "D_FZ", "document.querySelector('#why h3').textContent.startsWith('Why D_FZ ')");
    write(b, "#terms", "S");
    wait(b, "no D_FZ", "document.getElementById('why').textContent.includes('no unknown `D_FZ`')");
    click(b, "#why button");
    assert_eq!(b.value("document.getElementById('why').hidden"), json!(true));
    // a combination has no explanation, and its row is no button
    write(b, "#terms", "F,I,O,S");
    wait(b, "again", "document.querySelector('#verdicts tr[data-name=D_FZ] button.why')");
    let rows = b.value(
        "[...document.querySelectorAll('#verdicts tbody tr')].every(r => \
         !!r.querySelector('button.why') == !r.querySelector('td.status').textContent.startsWith('combination'))",
    );
    assert_eq!(rows, json!(true));
    assert_eq!(b.value("document.getElementById('why').hidden"), json!(true));
    quiet(b);
}

#[test]
fn a_verdict_on_a_model_is_explained() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("chain.toml");
    let text =
        "name = 'chain'\nparameters = ['k']\n[states]\na = '-k*a'\nb = 'k*a - b'\n[outputs]\ny = 'b'\n";
    fs::write(&file, text).expect("written");
    click(b, "#tab-text");
    write(b, "#text", text);
    wait(b, "judged", "document.querySelectorAll('#text-verdicts button.why').length == 3");
    wait(b, "the chain", "document.querySelector('#text-verdicts').textContent.includes('rank 3 of 3')");
    b.value("[...document.querySelectorAll('#text-verdicts button.why')].find(e => e.textContent.startsWith('a')).click(), 1");
    heading(b, "#text-why", "Why a has degree 2");
    is_as_printed(b, "#text-why", &["analyze", file.to_str().expect("UTF-8"), "--why", "a"]);
    // while the text is wrong, the last answer and the explanation stay, and the page says of which text
    write(b, "#text", "name = ");
    wait(b, "wrong", "document.getElementById('text-problem').textContent != ''");
    for id in ["text-verdicts", "text-why"] {
        let shown = format!(
            "(e => e.checkVisibility() && e.classList.contains('stale') && e.textContent.length > \
             100)(document.getElementById({id:?}))"
        );
        assert_eq!(b.value(&shown), json!(true), "{id}");
    }
    let old = b.value("document.getElementById('text-old').textContent");
    assert_eq!(old, json!("The text is wrong: what follows is of the text before."));
    // another text has no explanation
    write(b, "#text", &text.replace("chain", "link"));
    wait(b, "judged", "!document.getElementById('text-verdicts').classList.contains('stale')");
    assert_eq!(b.value("document.getElementById('text-old').textContent"), json!(""));
    assert_eq!(b.value("document.getElementById('text-why').hidden"), json!(true));
    quiet(b);
}

#[test]
fn the_next_position_is_that_of_the_command_line() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    choose(b, "#carry", "inertial");
    click(b, "#next-position");
    wait(b, "offers", "document.querySelectorAll('#next tbody tr').length == 3");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scheme.toml");
    fs::write(&file, scheme(b)).expect("written");
    let file = file.to_str().expect("UTF-8");
    let found = answer_of(&["design", file, "--next", "1", "--keep", "3", "--format", "json"]);
    let best = &found["found"][0];
    let names = |of: &Value| -> Vec<String> {
        let candidate = |e: &Value| e["positions"][0]["candidate"].as_str().expect("a name").to_string();
        of.as_array().expect("a list").iter().map(candidate).collect()
    };
    assert_eq!(texts(b, "#next tbody tr td:nth-child(2)"), names(&found["found"]));
    let open = best["then"]["not_observable"].as_array().expect("a list").len();
    assert_eq!(texts(b, "#next tbody tr td:nth-child(4)")[0], open.to_string());
    // the first offer is added, and gives the verdicts that it says
    click(b, "#next tbody tr:first-child button");
    wait(b, "three", "document.querySelectorAll('#positions li').length == 3");
    assert_eq!(b.value("document.getElementById('next').hidden"), json!(true));
    let candidate = best["positions"][0]["candidate"].as_str().expect("a name");
    assert!(scheme(b).contains(&format!("attitude = {candidate:?}")), "{}", scheme(b));
    for r in best["resolves"].as_array().expect("a list") {
        let name = r["name"].as_str().expect("a name");
        let condition = format!(
            "document.querySelector('#verdicts tr[data-name={name}] td.degree')?.textContent.startsWith('{}')",
            r["degree"]
        );
        wait(b, name, &condition);
    }
    // a refusal of the engine is shown
    write(b, "#terms", "drift");
    click(b, "#next-position");
    wait(b, "refused", "document.querySelector('#next p:not(.soft)')?.textContent.length > 20");
    quiet(b);
}

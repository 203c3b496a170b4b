//! Fields of the workbench with wrong content, and what the page says beside its table: combinations,
//! remedies, errors that are not estimated.

use serde_json::{Value, json};

use crate::browser::Browser;
use crate::opened::{choose, click, key, opened, place, quiet, says, scheme, wait, write, wrong};
use crate::program::json as answer_of;

/// A text that the page refuses, or a value that the engine refuses, is named at its field; the last good
/// answer stays, faded where the scheme itself is wrong.
#[test]
fn errors_stand_at_their_fields() {
    let Some((mut browser, _)) = opened(1280) else { return };
    let b = &mut browser;
    let good = scheme(b);
    // refused by the page: the scheme and its verdicts stay, and so does the text
    for (field, text, said) in [
        ("dwell", "0x10", "Dwell: expected a number, found \"0x10\""),
        ("requirements", "D = 0.05 = 7", "Requirements: expected names and numbers"),
        ("requirements", "= 5", "Requirements: expected names and numbers"),
        ("requirements", "D = 1, D = 2", "Requirements: expected names and numbers"),
        ("gimbals", "alpha=3", "Gimbal limits: expected angles and degrees"),
        ("dwell", "long", "Dwell: expected a number, found \"long\""),
        ("own-dwell", "1 h", "Dwell: expected a number of seconds"),
        ("latitude-number", "north", "Latitude: expected a number"),
        ("requirements", "D = much", "Requirements: expected names and numbers such as D = 0.05"),
        ("bench", "K0 = some", "Bench: expected names and numbers such as K0 = 20"),
    ] {
        write(b, &format!("#{field}"), text);
        wait(b, field, &wrong(field, said));
        assert_eq!(b.value(&format!("document.getElementById({field:?}).value")), json!(text));
        assert_eq!(scheme(b), good);
    }
    assert_eq!(b.value("document.querySelectorAll('[aria-invalid=true]').length"), json!(6));
    assert_eq!(b.value("document.getElementById('verdicts').classList.contains('stale')"), json!(false));
    // another edit keeps them, a good value removes its own, undo and redo remove all
    write(b, "#name", "first");
    wait(b, "named", "obsdeg.scheme().includes('first')");
    assert_eq!(b.value("document.querySelectorAll('.wrong').length"), json!(6));
    write(b, "#dwell", "200");
    wait(b, "mended", "document.querySelectorAll('.wrong').length == 5");
    assert_eq!(b.value("document.getElementById('dwell').hasAttribute('aria-invalid')"), json!(false));
    click(b, "#undo");
    assert_eq!(b.value("document.querySelectorAll('.wrong, [aria-invalid=true]').length"), json!(0));
    assert_eq!(b.value("document.getElementById('bench').value"), json!(""));
    // refused by the engine: named at the field in the page's words, and the table is of the scheme before
    let rows = "document.querySelectorAll('#verdicts tbody tr').length";
    let before = b.value(rows);
    for (field, text, said) in [
        ("dwell", "-3", "Dwell is -3; expected 0.001 to 1e6 s"),
        ("noise", "0", "Noise of Z is 0"),
        ("drift-noise", "wind", "`wind` is no random drift"),
        ("terms", "F,Q", "`Q` is not a term"),
        ("latitude-number", "100", "latitude 100 is out of range"),
        ("requirements", "QQ = 3", "`QQ`: no such unknown"),
        ("bench", "QQ = 3", "`QQ`: no such error"),
        ("requirements", "D_F = 0.1, D_IX = -1", "Requirements: D_IX is -1"),
        ("own-dwell", "-1", "-1"),
        ("beta-number", "0.00000000001", "decimals"),
        ("gamma-number", "0.1234567891234", "13 decimals"),
        ("name", "p2", "two positions are named"),
    ] {
        write(b, &format!("#{field}"), text);
        wait(b, field, &wrong(field, said));
        wait(b, "stale", "document.getElementById('verdicts').classList.contains('stale')");
        assert_eq!(b.value(rows), before);
        assert_eq!(b.value("document.getElementById('notice').textContent"), json!(""), "{field}");
        key(b, "z", 90, 2);
        wait(b, "judged", "!document.getElementById('verdicts').classList.contains('stale')");
        wait(b, "no error", "!document.querySelector('.wrong')");
    }
    // an error of a position is at that position's fields, and above all by its name while another is
    // selected
    write(b, "#own-dwell", "-1");
    wait(b, "at the field", &wrong("own-dwell", "-1"));
    click(b, "#positions li:nth-child(2) .name");
    assert_eq!(b.value("document.getElementById('own-dwell').hasAttribute('aria-invalid')"), json!(false));
    assert_eq!(b.value("document.getElementById('notice').textContent.includes(': ')"), json!(true));
    click(b, "#positions li:nth-child(1) .name");
    wait(b, "again", &wrong("own-dwell", "-1"));
    assert_eq!(b.value("document.getElementById('notice').textContent"), json!(""));
    click(b, "#positions li:nth-child(2) .name");
    write(b, "#name", "second");
    wait(b, "by name", "/^(first|p1): /.test(document.getElementById('notice').textContent)");
    quiet(b);
}

/// Several wrong values stay marked until each is mended; a refused text stays with its position; a slew rate
/// under platform carry is named at its field, and angles by name are no error.
#[test]
fn errors_stay_until_they_are_mended() {
    let Some((mut browser, _)) = opened(1280) else { return };
    let b = &mut browser;
    write(b, "#dwell", "-5");
    wait(b, "the dwell", &wrong("dwell", "Dwell is -5"));
    write(b, "#noise", "-1");
    wait(b, "still", &wrong("dwell", "Dwell is -5"));
    write(b, "#dwell", "100");
    wait(b, "the noise", &wrong("noise", "Noise of Z is -1"));
    assert_eq!(b.value("document.getElementById('dwell').hasAttribute('aria-invalid')"), json!(false));
    // explanations name the field too
    click(b, "#verdicts tr[data-name=psi_y] button.why");
    wait(b, "why", "document.getElementById('why').textContent.includes('Noise of Z is -1')");
    write(b, "#noise", "1e-5");
    wait(b, "judged", "!document.querySelector('.wrong, #verdicts.stale')");
    // a text that was refused does not follow to another position
    for (field, action) in
        [("own-dwell", "#add"), ("gamma-number", "#duplicate"), ("own-dwell", "#remedies button")]
    {
        write(b, &format!("#{field}"), "zz");
        wait(b, field, &wrong(field, "zz"));
        click(b, action);
        wait(b, &format!("after {action} with {field}"), "!document.querySelector('.wrong')");
        assert_ne!(b.value(&format!("document.getElementById({field:?}).value")), json!("zz"));
        click(b, "#undo");
        // buttons that are about to be drawn anew take no click
        wait(b, "judged again", "!document.querySelector('.wrong, #verdicts.stale, #remedies.stale')");
    }
    write(b, "#slew-rate", "2");
    wait(b, "slews", &wrong("slew-rate", "expected inertial"));
    write(b, "#slew-rate", "");
    wait(b, "no slews", "!document.querySelector('.wrong')");
    // an attitude beyond the gimbal limits is named at the limits
    write(b, "#gimbals", "beta = -60:60");
    wait(b, "limits", "obsdeg.scheme().includes('beta_deg = [-60, 60]')");
    write(b, "#beta-number", "85");
    wait(b, "beyond", &wrong("gimbals", "the gimbals do not reach"));
    write(b, "#gimbals", "");
    wait(b, "free gimbals", "!obsdeg.scheme().includes('gimbals') && !document.querySelector('.wrong')");
    // an edit with an open explanation does not scroll the page
    b.value("Element.prototype.scrollIntoView = () => { window.scrolled = true; }, 1");
    b.value(
        "(e => { e.value = 35; e.dispatchEvent(new Event('input')); })(document.getElementById('alpha')), 1",
    );
    wait(b, "an edit", "obsdeg.scheme().includes('[35, ')");
    wait(b, "explained again", "!document.querySelector('#why.stale, #verdicts table.old-sigmas')");
    assert_eq!(b.value("window.scrolled ?? false"), json!(false));
    click(b, "#tab-text");
    write(
        b,
        "#text",
        "[document]\ndate = 2026-03-01\n[[position]]\nangles_deg = [\"alpha\", 0, 0]\n[[position]]\n\
         angles_deg = [0, 0, 0]\n",
    );
    wait(b, "judged", "document.getElementById('text-verdicts').textContent.includes(' of 15')");
    click(b, "#take");
    wait(b, "said beside the rank", "document.getElementById('summary').textContent.includes('no sigmas: ')");
    assert_eq!(b.value("document.getElementById('notice').dataset.problem ?? 'none'"), json!("none"));
    // a date of TOML is written as one
    assert!(scheme(b).contains("date = 2026-03-01\n"), "{}", scheme(b));
    quiet(b);
}

/// A combination that is not observable says so, in the table and in the list of a model.
#[test]
fn combinations_say_what_they_are() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    click(b, "#tab-text");
    write(
        b,
        "#text",
        "combinations = [\"D_FX - D_FY\", \"D_FZ\"]\n[[position]]\nattitude = \"NUE\"\n[[position]]\n\
         attitude = \"NDW\"\n",
    );
    let listed = "[...document.querySelectorAll('#text-verdicts li')].map(l => l.textContent)";
    wait(b, "a scheme", &format!("{listed}.includes('D_FZ: not observable')"));
    wait(b, "and", &format!("{listed}.includes('D_FX - D_FY: observable, degree 2')"));
    click(b, "#take");
    says(b, "D_FX - D_FY", 3, "asked for, observable");
    let row = "[...document.querySelectorAll('#verdicts tbody tr')].at(-1)";
    wait(
        b,
        "the row",
        &format!("{row}.dataset.name == 'D_FZ' && {row}.cells[3].textContent == 'asked for, not observable'"),
    );
    click(b, "#tab-text");
    write(
        b,
        "#text",
        "name = \"product\"\ncombinations = [\"b*x\", \"b + x\"]\n[states]\nx = \"-a*x\"\n\
         [parameters]\na = {}\nb = {}\n[outputs]\ny = \"b*x\"\n",
    );
    wait(b, "a model", &format!("{listed}.includes('b + x: not observable')"));
    wait(b, "and", &format!("{listed}.includes('b*x: observable, degree 0')"));
    quiet(b);
}

/// Remedies for unknowns that are not observable stand under a heading of their own. Each button gives the
/// degrees that its remedy states.
#[test]
fn remedies_are_applied() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    let answer = answer_of(&["analyze", "--angles", "0,0,0", "--angles", "180,0,0", "--format", "json"]);
    let heading = "document.querySelector('#sentences h3')?.textContent == 'To resolve'";
    wait(b, "a heading", heading);
    let remedies = answer["to_resolve"]["remedies"].as_array().expect("a list").clone();
    let mut tried = 0;
    for r in &remedies {
        let change = &r["changes"][0];
        let words = match change["kind"].as_str() {
            Some("attitude") => format!("Add {}", change["attitude"].as_str().expect("letters")),
            Some("carry") => format!("Take {} carry", change["carry"].as_str().expect("a word")),
            _ => continue,
        };
        tried += 1;
        b.value(&format!(
            "[...document.querySelectorAll('#remedies button')].find(e => e.textContent == {words:?}).click(), 1"
        ));
        for gain in r["resolves"].as_array().expect("a list") {
            says(b, gain["name"].as_str().expect("a name"), 2, &gain["degree"].to_string());
        }
        click(b, "#undo");
        says(b, "D_FZ", 3, "inseparable");
    }
    assert!(tried > 2, "{remedies:?}");
    // all is observable: nothing to resolve
    choose(b, "#carry", "inertial");
    write(b, "#terms", "F");
    wait(
        b,
        "nothing",
        "!document.querySelector('#sentences h3') && !document.querySelector('#remedies button')",
    );
    quiet(b);
}

/// A family of errors that are not estimated opens its terms, and an unknown what changes it: the figures of
/// the command line.
#[test]
fn omitted_terms_are_opened() {
    let Some((mut browser, _)) = opened(1280) else { return };
    let b = &mut browser;
    let command = ["simulate", "--angles", "0,0,0", "--angles", "180,0,0", "--format", "json", "-q"];
    let answer = answer_of(&[&command[..], &["--bench", "K0_X=20"]].concat());
    write(b, "#bench", "K0_X = 20");
    wait(b, "errors", "!document.getElementById('not-estimated').hidden");
    wait(b, "all", "document.querySelector('#verdicts table:not(.old-sigmas):not(.old-solutions)')");
    click(b, "#not-estimated summary");
    b.value("[...document.querySelectorAll('#omitted button.why')].find(e => e.textContent == 'K0 (3)').click(), 1");
    let terms = answer["omitted"]["terms"].as_array().expect("a list");
    let rows = b.value(
        "[...document.querySelectorAll('#omitted-terms tbody tr')].map(r => [...r.cells].map(c => c.textContent))",
    );
    let own: Vec<&Value> = terms.iter().filter(|t| t["family"] == "K0").collect();
    assert_eq!(rows.as_array().map(Vec::len), Some(own.len()));
    for (row, term) in rows.as_array().expect("rows").iter().zip(&own) {
        assert_eq!(row[0], term["name"]);
        assert_eq!(row[1], json!(if term["name"] == "K0_X" { "20 ug" } else { "\u{2013}" }));
        let changes = term["sensitivities"].as_array().expect("a list");
        assert_eq!(row[3].as_str().expect("a text") == "nothing", changes.is_empty(), "{row}");
        for x in changes {
            let (name, per_unit) =
                (x["unknown"].as_str().expect("a name"), x["per_unit"].as_f64().expect("a number"));
            let text = row[3].as_str().expect("a text");
            let said = text.split(", ").find_map(|t| t.strip_prefix(name)?.strip_prefix(' '));
            let said: f64 = said.and_then(|t| t.split(' ').next()?.parse().ok()).expect("a number");
            assert!((said / per_unit - 1.0).abs() < 6e-3, "{row} {x}");
        }
    }
    // the errors that change one unknown, the stated one first, with what its size makes
    let unknown = own
        .iter()
        .find(|t| t["name"] == "K0_X")
        .and_then(|t| t["sensitivities"][0]["unknown"].as_str())
        .expect("an unknown that K0_X changes");
    click(b, &format!("#verdicts tr[data-name={unknown}] button.why"));
    wait(b, "changers", "document.querySelector('#why .changers')");
    let changing =
        |t: &&Value| t["sensitivities"].as_array().is_some_and(|s| s.iter().any(|x| x["unknown"] == unknown));
    let count = terms.iter().filter(changing).count();
    let rows = b.value(
        "[...document.querySelectorAll('#why .changers tbody tr')].map(r => [...r.cells].map(c => c.textContent))",
    );
    assert_eq!(rows.as_array().map(Vec::len), Some(count));
    assert_eq!([&rows[0][0], &rows[0][2]], [&json!("K0_X"), &json!("20 ug")]);
    let per_unit =
        own.iter().find(|t| t["name"] == "K0_X").expect("K0_X")["sensitivities"][0]["per_unit"].as_f64();
    let made: f64 = rows[0][3].as_str().and_then(|t| t.split(' ').next()?.parse().ok()).expect("a number");
    assert!((made / (20.0 * per_unit.expect("a number").abs()) - 1.0).abs() < 0.05, "{rows}");
    quiet(b);
}

/// On a narrow screen the platform stands directly above its sliders: all of them are in sight together.
#[test]
fn the_platform_is_beside_its_sliders() {
    let Some((mut browser, _)) = opened(400) else { return };
    let b = &mut browser;
    let tops = |b: &mut Browser, id: &str| {
        place(b, "#view");
        let r = b.value(&format!(
            "(r => [r.top, r.bottom])(document.getElementById({id:?}).getBoundingClientRect())"
        ));
        [0, 1].map(|k| r[k].as_f64().expect("a number"))
    };
    b.size(400, 800);
    b.settle();
    let [view, gamma] = ["view", "gamma"].map(|id| tops(b, id));
    assert!(view[1] < gamma[0] && gamma[1] - view[0] < 700.0, "{view:?} {gamma:?}");
    b.size(800, 1000);
    b.settle();
    let [view, alpha] = ["view", "alpha"].map(|id| tops(b, id));
    assert!(alpha[0] < view[1] + 100.0 && alpha[1] > view[0], "{view:?} {alpha:?}");
    quiet(b);
}

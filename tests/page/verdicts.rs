//! The page of `crates/web` in a real browser, from disk: text, files, search and pictures, against the
//! command line.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use regex::Regex;
use serde_json::{Value, json};

use crate::browser::Browser;
use crate::opened::{choose, click, is_built, key, opened, quiet, root, save_in, says, scheme, wait, write};
use crate::program::{cases, run};

#[test]
fn the_page_is_small_and_asks_for_nothing() {
    let Some((mut browser, page)) = opened(1400) else { return };
    let text = fs::read_to_string(page).expect("the page");
    // 3.052 MB measured: 0.1 for multiple shooting, Allan deviations and zstd, 0.07 for identifiable
    // functions and relations, 0.04 for sets of outputs, 0.05 for reasons and next positions, 0.013 for
    // clocks, changes of position, successions and copies, 0.025 for a bound over all attitudes, clocks that
    // are set and starts of models, 0.047 for sheets, rotation tables and acceptance, 0.008 for errors at
    // fields and limits of searches, 0.018 for answers to a board and samples left out, 0.04 for discrete
    // time, algebraic equations and closed forms, 0.17 for a search and a filter compiled for speed, 0.02 for
    // combinations along the motion and rows by a Jacobian; examine the page before raising the bound
    assert!(!is_built(page) || text.len() < 3_430_000, "{} bytes", text.len());
    // a forbidden request is refused: the policy is in force
    let refused = browser.value("fetch('https://example.com').then(() => 'sent', () => 'refused')");
    assert_eq!(refused, json!("refused"));
    assert!(browser.events.iter().any(|e| e.to_string().contains("Content Security Policy")));
    assert!(text.contains("default-src 'none'") && !text.contains("'unsafe-inline'"));
    let private = browser.value("document.getElementById('private').checkVisibility()");
    assert_eq!(private, json!(true));
}

/// Every control of the page has a test that operates it.
#[test]
fn every_control_is_driven() {
    let page = include_str!("../../crates/web/page/page.html");
    let tests = [
        include_str!("verdicts.rs"),
        include_str!("positions.rs"),
        include_str!("why.rs"),
        include_str!("design.rs"),
        include_str!("fields.rs"),
    ]
    .concat();
    let control = Regex::new(r#"<(?:button|input|select|textarea|canvas)\b[^>]*\bid="([\w-]+)""#);
    let control = control.expect("a pattern");
    let ids: Vec<&str> = control.captures_iter(page).filter_map(|c| Some(c.get(1)?.as_str())).collect();
    assert!(ids.len() > 40, "{ids:?}");
    let untried = ids.iter().filter(|id| !["file", "tab-scheme", "tab-text"].contains(id));
    let untried: Vec<_> = untried.filter(|id| !tests.contains(&format!("\"#{id}\""))).collect();
    assert!(untried.is_empty(), "{untried:?}");
}

#[test]
fn its_json_is_that_of_the_command_line() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let examples = browser.value("JSON.parse(document.getElementById('data').textContent).examples");
    let examples = examples.as_array().expect("a list");
    assert!(examples.len() > 25, "{}", examples.len());
    for example in examples.iter().step_by(cases(4, 1)) {
        let (name, kind) =
            (example["name"].as_str().expect("a name"), example["kind"].as_str().expect("a kind"));
        let file = format!("examples/{name}/{kind}.toml");
        assert_eq!(example["text"], json!(fs::read_to_string(root().join(&file)).expect("readable")));
        // the page has no symbolic engine, so solutions are omitted on both sides
        let mut request = json!({ "sources": [{ "name": file, "text": example["text"] }] });
        let mut command = vec!["analyze", &file, "--format", "json"];
        if cfg!(feature = "symbolica") {
            request["solutions"] = json!(false);
            command.extend(["--solutions", "off"]);
        }
        let said = browser.value(&format!("obsdeg.call('analyze', {request})"));
        let printed = run(&command);
        let printed = String::from_utf8(printed.stdout).expect("text");
        assert!(printed.len() > 500 || said["problem"].is_object(), "{file}: {said}");
        assert!(said["text"].as_str().unwrap_or_default() == printed, "{file}: other bytes");
    }
    // another command with random numbers
    let file = "examples/six-positions/scheme.toml";
    let text = fs::read_to_string(root().join(file)).expect("readable");
    let request = json!({ "sources": [{ "name": file, "text": text }], "seed": 5 });
    let said = browser.value(&format!("obsdeg.call('simulate', {request})"));
    let printed = run(&["simulate", file, "--seed", "5", "--format", "json"]);
    assert!(said["text"].as_str().unwrap_or_default().as_bytes() == printed.stdout, "{said}");
    quiet(&browser);
}

#[test]
fn schemes_come_and_go() {
    let Some((mut browser, page)) = opened(1400) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    save_in(&mut browser, folder.path());
    let b = &mut browser;
    let whole = |name: &str| {
        let patience = Instant::now() + Duration::from_secs(60);
        loop {
            if let Ok(text) = fs::read_to_string(folder.path().join(name))
                && !text.is_empty()
            {
                return text;
            }
            assert!(Instant::now() < patience, "{name} is not saved");
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    let drop_file = |b: &mut Browser, file: &Path| {
        for kind in ["dragEnter", "dragOver", "drop"] {
            let data = json!({ "items": [], "files": [file], "dragOperationsMask": 1 });
            b.call("Input.dispatchDragEvent", json!({ "type": kind, "x": 300, "y": 300, "data": data }));
        }
    };
    // by the file chooser
    b.call("Page.setInterceptFileChooserDialog", json!({ "enabled": true }));
    click(b, "#open");
    let chooser = "Page.fileChooserOpened";
    let node = b.events.iter().find(|e| e["method"] == chooser).map(|e| e["params"]["backendNodeId"].clone());
    let six = root().join("examples/six-positions/scheme.toml");
    b.call("DOM.setFileInputFiles", json!({ "files": [six], "backendNodeId": node.expect("a chooser") }));
    wait(b, "six", "document.querySelectorAll('#positions li').length == 6");
    // a dropped file, saved again, is the same
    drop_file(b, &root().join("examples/twelve-positions/scheme.toml"));
    wait(b, "twelve", "document.querySelectorAll('#positions li').length == 12");
    click(b, "#save");
    let text = whole("scheme.toml");
    let file = folder.path().join("scheme.toml").display().to_string();
    let own =
        run(&["analyze", "examples/twelve-positions/scheme.toml", "--solutions", "off", "--format", "json"]);
    assert_eq!(
        run(&["analyze", &file, "--solutions", "off", "--format", "json"]).stdout,
        own.stdout,
        "{text}"
    );
    click(b, "#json");
    let answer: Value = serde_json::from_str(&whole("scheme.json")).expect("JSON");
    assert_eq!(answer["schema"], json!("obsdeg.analysis/1"));
    click(b, "#report");
    assert!(whole("scheme.html").contains("<math"));
    // a link contains the scheme
    click(b, "#link");
    wait(b, "link", "location.hash.length > 100");
    let link = b.value("location.href").as_str().expect("an address").to_string();
    let before = scheme(b);
    b.call("Page.navigate", json!({ "url": "about:blank" }));
    b.call("Page.navigate", json!({ "url": link }));
    wait(b, "the link is open", "window.obsdeg && document.querySelectorAll('#positions li').length == 12");
    assert_eq!(scheme(b), before);
    b.value("location.hash = 'scheme=%%%', 1");
    wait(b, "a damaged link", "document.getElementById('notice').textContent.includes('damaged')");
    assert_eq!(scheme(b), before);
    // wrong TOML: the message has its place, and no text is lost
    let wrong = folder.path().join("wrong.toml");
    fs::write(&wrong, "carry = \"platform\"\n[[position]]\nangles_deg = [0, 0, \"NUE\n").expect("written");
    drop_file(b, &wrong);
    wait(b, "wrong TOML", "document.getElementById('text-problem').textContent.startsWith('Line 3, column')");
    let marked = b.value("document.querySelector('#text-problem pre').textContent");
    assert!(marked.as_str().is_some_and(|m| m.starts_with("3 | angles_deg") && m.contains('^')), "{marked}");
    click(b, "#text-problem button");
    let place = b.value("document.getElementById('text').selectionStart").as_u64().expect("a place");
    assert!((36..=62).contains(&place), "{place}");
    assert_eq!(scheme(b), before);
    // a model and the gallery
    let models = b.value("[...document.querySelectorAll('#gallery option')].map(o => o.textContent)");
    let lotka = models
        .as_array()
        .expect("a list")
        .iter()
        .position(|m| m == "lotka-volterra (model)")
        .expect("a model");
    choose(b, "#gallery", &(lotka - 1).to_string());
    wait(
        b,
        "symmetries",
        "document.getElementById('text-verdicts').textContent.includes('multiply x2 by s; divide b by s')",
    );
    // a link contains a model too
    let model = b.value("document.getElementById('text').value");
    click(b, "#link");
    wait(b, "link of a text", "location.hash.startsWith('#text=')");
    let link = b.value("location.href").as_str().expect("an address").to_string();
    b.call("Page.navigate", json!({ "url": "about:blank" }));
    b.call("Page.navigate", json!({ "url": link }));
    wait(b, "the text is there", "window.obsdeg && document.getElementById('text').value.length > 100");
    assert_eq!(b.value("document.getElementById('text').value"), model);
    wait(b, "and judged", "document.getElementById('text-verdicts').textContent.includes('rank 5 of 6')");
    // typed text
    write(
        b,
        "#text",
        "name = \"decay\"\n\n[states]\nx = \"-k*x\"\n\n[parameters]\nk = {}\n\n[outputs]\ny = \"x\"\n",
    );
    wait(b, "judged", "document.getElementById('text-verdicts').textContent.includes('rank 2 of 2')");
    // typed text is kept while the positions are shown, which a model does not have
    click(b, "#tab-scheme");
    click(b, "#tab-text");
    assert!(b.value("document.getElementById('text').value").to_string().contains("decay"));
    click(b, "#take");
    wait(b, "no scheme", "document.getElementById('notice').textContent.includes('expected a scheme')");
    click(b, "#renew");
    wait(b, "the positions", "document.getElementById('text').value.includes('[[position]]')");
    // an angle given by name is kept when another angle changes, and small angles are decimals
    write(
        b,
        "#text",
        "[[position]]\nangles_deg = [\"alpha\", 0, 30]\n\n[[position]]\nangles_deg = [0, 0, 0]\n",
    );
    wait(b, "judged", "document.getElementById('text-verdicts').textContent.includes(' of 15')");
    click(b, "#take");
    wait(b, "taken", "obsdeg.scheme().includes('[\"alpha\", 0, 30]')");
    write(b, "#beta-number", "0.0000001");
    wait(b, "small", "obsdeg.scheme().includes('[\"alpha\", 0.0000001, 30]')");
    wait(b, "judged", "!document.getElementById('verdicts').classList.contains('stale')");
    click(b, "#tab-text");
    choose(b, "#gallery", "0");
    wait(b, "a scheme", "document.getElementById('text-verdicts').textContent.includes('rank 8 of 15')");
    click(b, "#take");
    wait(
        b,
        "taken",
        "document.querySelectorAll('#positions li').length == 2 && !document.getElementById('panel-scheme').hidden",
    );
    quiet(b);
    assert!(page.is_file());
}

/// The families of errors that are not estimated stand below the verdicts, with the numbers of the command
/// line. After an edit they belong to the new scheme.
#[test]
fn errors_that_are_not_estimated_are_shown() {
    let Some((mut browser, _)) = opened(1280) else { return };
    let b = &mut browser;
    let shown = |b: &mut Browser, carry: &str| {
        wait(b, "errors", "!document.getElementById('not-estimated').hidden");
        click(b, "#not-estimated summary");
        let rows = b.value(
            "[...document.querySelectorAll('#omitted tbody tr')].map(r => [...r.cells].map(c => c.textContent))",
        );
        let pair = ["--angles", "0,0,0", "--angles", "180,0,0", "--carry", carry, "--format", "json", "-q"];
        let output = run(&[&["simulate"], &pair[..]].concat());
        let answer: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let families = answer["omitted"]["families"].as_array().expect("families");
        let rows = rows.as_array().expect("rows");
        assert_eq!(rows.len(), families.len());
        for (row, f) in rows.iter().zip(families) {
            assert_eq!(row[0], json!(format!("{} ({})", f["family"].as_str().expect("a name"), f["terms"])));
            let Some(worst) = f["worst"]["per_unit"].as_f64() else {
                assert_eq!(row[2], json!("\u{2013}"), "{row}");
                continue;
            };
            let text = row[2].as_str().expect("a text");
            let number: f64 = text.split(' ').next().and_then(|n| n.parse().ok()).expect("a number");
            assert!((number / worst.abs() - 1.0).abs() < 1e-3 && text.contains(" per "), "{row} {f}");
            assert_eq!(row[3], f["worst"]["unknown"], "{row}");
        }
        let k0 = rows.iter().find(|r| r[0] == json!("K0 (3)")).expect("K0");
        k0[1].as_str().expect("a class").to_string()
    };
    assert_eq!(shown(b, "platform"), "1 no effect, 2 visible");
    choose(b, "#carry", "reset");
    // the previous table stays until the new scheme is simulated
    wait(
        b,
        "classes of the new scheme",
        "[...document.querySelectorAll('#omitted tbody tr')].some(r => r.cells[0].textContent == 'K0 (3)' && \
         r.cells[1].textContent == '1 no effect, 2 silent')",
    );
    b.value("document.getElementById('not-estimated').open = false, 1");
    assert_eq!(shown(b, "reset"), "1 no effect, 2 silent");
    quiet(b);
}

/// With a bench a requirement is compared with the total, in words, in the bar and beside sigma. Without a
/// bench the summary of met requirements states its condition, and the table the size that uses up a margin.
/// The totals are those of the command line.
#[test]
fn requirements_are_judged_by_the_total() {
    let Some((mut browser, _)) = opened(1280) else { return };
    let b = &mut browser;
    let summary = "document.getElementById('summary').textContent";
    write(b, "#requirements", "D_IY = 0.2");
    let met = "requirements met, 1 of 1, while no error uses up a margin (Errors that are not estimated)";
    wait(b, "met", &format!("{summary}.endsWith({met:?})"));
    click(b, "#not-estimated summary");
    let head = b.value("[...document.querySelectorAll('#omitted th')].at(-1).textContent");
    assert_eq!(head, json!("uses up a margin at"));
    let k0 = b.value(
        "[...document.querySelectorAll('#omitted tbody tr')].find(r => r.cells[0].textContent == 'K0 \
         (3)').cells[6].textContent",
    );
    let pair =
        ["--angles", "0,0,0", "--angles", "180,0,0", "--requirement", "D_IY=0.2", "--format", "json", "-q"];
    let of = |more: &[&str]| -> Value {
        serde_json::from_slice(&run(&[&["simulate"], &pair[..], more].concat()).stdout).expect("JSON")
    };
    let alone = of(&[]);
    let family =
        alone["omitted"]["families"].as_array().expect("families").iter().find(|f| f["family"] == "K0");
    let limit = family.expect("K0")["uses_up"]["size"].as_f64().expect("a size");
    let shown = k0.as_str().and_then(|t| t.strip_suffix(" ug (D_IY)")?.parse::<f64>().ok()).expect("a size");
    assert!((shown / limit - 1.0).abs() < 0.05, "{k0} {limit}");
    write(b, "#bench", "K0_X = 20");
    wait(b, "missed", &format!("{summary}.endsWith('requirements NOT met, 0 of 1')"));
    let row = "document.querySelector('#verdicts tr[data-name=D_IY]')";
    let label = b.value(&format!("{row}.querySelector('.against').getAttribute('aria-label')"));
    let said = b.value(&format!("{row}.querySelector('.against').parentNode.textContent"));
    let benched = of(&["--bench", "K0_X=20"]);
    let budget =
        benched["omitted"]["budgets"].as_array().expect("budgets").iter().find(|x| x["unknown"] == "D_IY");
    let total = budget.expect("D_IY")["total"].as_f64().expect("a total");
    let ratio = label.as_str().and_then(|l| {
        l.strip_prefix("misses its requirement: ")?.strip_suffix(" times")?.parse::<f64>().ok()
    });
    assert!((ratio.expect("a ratio") * 0.2 / total - 1.0).abs() < 0.05, "{label} {total}");
    let shown =
        said.as_str().and_then(|t| t.split_once(", total ")?.1.strip_suffix(" deg/h/g")?.parse::<f64>().ok());
    assert!((shown.expect("a total") / total - 1.0).abs() < 0.05, "{said} {total}");
    quiet(b);
}

/// The tour's statements agree with the table beside it.
#[test]
fn the_tour_shows_what_it_says() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    // a scheme of the reader's own, which is back at the end
    write(b, "#name", "mine");
    write(b, "#dwell", "321");
    let own = scheme(b);
    let lit = |b: &mut Browser, id: &str| {
        let lit = b.value("[...document.querySelectorAll('.lit')].map(e => e.id)");
        assert_eq!(lit, json!([id]));
        // in sight, and with the focus inside, after one click
        click(b, "#tour-show");
        let seen = format!(
            "(e => {{ const r = e.getBoundingClientRect(); return r.bottom > 0 && r.top < innerHeight && \
             e.contains(document.activeElement); }})(document.getElementById({id:?}))"
        );
        wait(b, id, &seen);
    };
    click(b, "#start-tour");
    says(b, "psi_y", 3, "inseparable");
    lit(b, "positions");
    says(b, "psi_y", 5, "not told from D_FZ");
    click(b, "#tour-next");
    says(b, "psi_y", 2, "0");
    lit(b, "alpha");
    // every multiple of 5 degrees except 0 and 180 gives degree 0, as stated
    wait(
        b,
        "marks",
        "document.getElementById('alpha').title.startsWith('Other verdicts at -180, 0, 180 deg (tried: multiples of \
         5)')",
    );
    click(b, "#tour-next");
    says(b, "psi_y", 3, "not excited");
    // the poles are the marked latitudes
    wait(
        b,
        "latitudes",
        "document.getElementById('latitude').title.startsWith('Other verdicts at -90, 90 deg (')",
    );
    // compared with the first step, not with the previous one
    for name in ["D_FY", "D_IY"] {
        says(b, name, 3, "not excited");
        says(b, name, 2, "\u{2013} was 2");
    }
    says(b, "psi_y", 2, "\u{2013} was inseparable");
    b.value("document.getElementById('latitude').focus(), 1");
    key(b, "ArrowLeft", 37, 0);
    for name in ["D_FY", "D_IY"] {
        says(b, name, 2, "2");
    }
    click(b, "#tour-next");
    wait(b, "all", "document.getElementById('summary').textContent.startsWith('rank 15 of 15')");
    for name in ["D_IX", "D_IY", "D_IZ"] {
        says(b, name, 2, "2");
    }
    click(b, "#tour-next");
    says(b, "D_IX - D_IY", 2, "1");
    says(b, "D_IX + D_IY + D_IZ", 2, "2");
    assert_eq!(b.value("document.getElementById('tour-next').disabled"), json!(true));
    click(b, "#tour-back");
    wait(b, "back", "document.getElementById('tour-count').textContent == 'step 4 of 5'");
    click(b, "#tour-end");
    assert_eq!(b.value("document.getElementById('tour').hidden"), json!(true));
    assert_eq!(b.value("document.querySelectorAll('.lit').length"), json!(0));
    assert_eq!(scheme(b), own);
    says(b, "D_FX", 2, "1");
    // a file that is opened during the tour ends it, and stays
    click(b, "#start-tour");
    b.value(
        "(() => { const held = new DataTransfer(); held.items.add(new File(['[[position]]\\nattitude = \"EUS\"'], \
         'other.toml')); document.dispatchEvent(new DragEvent('drop', { dataTransfer: held, bubbles: true, cancelable: \
         true })); })()",
    );
    wait(b, "no tour", "document.getElementById('tour').hidden && obsdeg.scheme().includes('EUS')");
    click(b, "#undo");
    click(b, "#undo");
    wait(b, "the own scheme", "obsdeg.scheme().includes('mine')");
    // undo brings the scheme of the tour back
    click(b, "#undo");
    wait(b, "the tour's scheme", "document.querySelectorAll('#positions li').length == 6");
    quiet(b);
}

#[test]
fn it_is_for_everyone() {
    let Some((mut browser, _)) = opened(1400) else { return };
    let b = &mut browser;
    let axe =
        fs::read_to_string(root().join("tests/data/axe/axe.min.js")).expect("tests/data/axe/axe.min.js");
    wait(
        b,
        "sigmas",
        "document.querySelector('#verdicts table:not(.old-sigmas):not(.old-solutions)') && \
         document.querySelectorAll('#verdicts td.sigma:not(:empty)').length == 15",
    );
    b.value("document.getElementById('not-estimated').open = true, 1");
    b.value(&format!("{axe};1"));
    click(b, "#start-tour");
    click(b, "#next-position");
    wait(b, "a next position", "document.querySelector('#next tbody tr')");
    click(b, "#verdicts tr[data-name=D_FZ] button.why");
    wait(b, "an explanation", "document.querySelector('#why tbody tr')");
    for scheme in ["dark", "light"].into_iter().take(cases(1, 2)) {
        let wanted = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        b.call("Emulation.setEmulatedMedia", wanted);
        for tab in ["text", "design", "scheme"] {
            b.value(&format!("document.getElementById('tab-{tab}').click(), 1"));
            for width in [400, 800, 1280, 1920, 2560] {
                b.size(width, 1000);
                b.settle();
                let beyond = b.value(
                    "(() => { const w = document.documentElement.clientWidth; \
                     const out = [...document.body.querySelectorAll('*')].filter(e => e.checkVisibility() && \
                     (!e.closest('.wide') || e.classList.contains('wide'))) \
                     .filter(e => e.getBoundingClientRect().right > w + 1).map(e => e.tagName + '#' + e.id); \
                     return document.documentElement.scrollWidth > w ? ['page', ...out] : out; })()",
                );
                assert_eq!(beyond, json!([]), "{tab} at {width} px");
                if [800, 1920].contains(&width) {
                    continue;
                }
                let found = b.value(
                    "axe.run().then(r => [r.passes.length, r.violations.map(v => v.impact + ' ' + v.id + ': ' + \
                     v.nodes[0].html.slice(0, 200))])",
                );
                assert!(
                    found[0].as_u64() > Some(10) && found[1] == json!([]),
                    "{tab} {scheme} {width}: {found}"
                );
            }
        }
    }
    // keyboard alone: arrow keys switch tabs, every control has a name
    b.value("document.getElementById('tab-scheme').focus(), 1");
    key(b, "ArrowRight", 39, 0);
    assert_eq!(b.value("document.activeElement.id"), json!("tab-design"));
}

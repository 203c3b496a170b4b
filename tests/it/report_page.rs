//! The page of a review: its beginning, and its behaviour in a real browser where one is installed.

use std::path::Path;

use obsdeg_core::degree::Status;
use obsdeg_core::system::{Constant, StateStart, SystemModel, SystemOptions, analyze_system, model_file};
use scraper::{Html, Selector};
use serde_json::json;

use crate::browser::Browser;
use crate::program::{cases, refused, run, stderr};
use crate::report::{MODEL, PAPER, assert_unique_ids, hostile, report, statuses, table, texts};

/// First box of a review of several schemes or of one, by its title.
fn findings(page: &Html, title: &str) -> Vec<[String; 2]> {
    let all = statuses(page);
    let titles = texts(page, ".front > .statuses > .status > .heading:first-child");
    let k = titles.iter().position(|t| t == title).unwrap_or_else(|| panic!("no {title}: {titles:?}"));
    all[k].iter().map(|[what, grade, text]| [what.clone(), format!("{grade}: {text}")]).collect()
}

/// The recommendation agrees with the numbers of the same page. Schemes with different tasks get no
/// recommendation.
#[test]
#[ignore = "seconds: .ci/run release"]
fn several_schemes_are_compared_first() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, dwell: u32, attitudes: &[&str], more: &str| -> String {
        let mut text = format!(
            "name = '{name}'\nterms = ['F', 'S']\ncarry = 'inertial'\nlatitude_deg = 48\n{more}\n[simulation]\n\
             dwell_s = {dwell}\n\
             drift_scale = 1e-4\npriors = {{ D = 1e5, psi = 10 }}\n[requirements]\nD = 0.05\npsi = 1\n"
        );
        attitudes.iter().for_each(|a| text.push_str(&format!("[[position]]\nattitude = '{a}'\n")));
        let path = folder.path().join(format!("{name}.toml"));
        std::fs::write(&path, text).expect("written");
        path.display().to_string()
    };
    let four = ["NUE", "UEN", "DNE", "ENU"];
    let long = write("long", 900, &four, "");
    let short = write("short", 600, &four, "");
    let one = write("one", 600, &["NUE", "NDW"], "");
    let page_of = |name: &str, inputs: &[&str]| Html::parse_document(&report(folder.path(), name, inputs).1);
    let page = page_of("three.html", &[&long, &short, &one]);
    let [recommended, alike] = &findings(&page, "Comparison of 3 schemes")[..] else { panic!("two rows") };
    assert_eq!(recommended[0], "Recommended");
    assert!(
        recommended[1]
            .contains("short: the shortest of 2 that meet every requirement by prediction, 2400 s (40 min)"),
        "{recommended:?}"
    );
    let same = "good: ok same conditions, unknowns and requirements; they take 1200 s (20 min) to 3600 s (1 h 0 min)";
    assert_eq!(alike[1], same);
    // one column per scheme; a margin is called met exactly if sigma meets the requirement
    let matrix = table(&page, "Margins (required over predicted sigma");
    let heads = texts(&page, ".front thead th");
    assert_eq!(heads[heads.len() - 3..], ["long", "short", "one"]);
    // a file without a title block has a row
    let titles = texts(&page, ".front .wide:first-child tbody tr");
    assert!(titles.len() == 3 && titles.iter().all(|t| t.contains("no document stated")), "{titles:?}");
    let side = table(&page, "By unknown");
    for row in matrix.iter().skip(3) {
        for (cell, scheme) in row[1..].iter().zip(["long", "short", "one"]) {
            let of = side.iter().find(|r| r[0] == row[0] && r[1] == scheme).expect("a row");
            match (of[4].parse::<f64>(), of[6].parse::<f64>()) {
                (Ok(sigma), Ok(required)) => {
                    assert_eq!(cell.ends_with(" met"), sigma <= required, "{row:?} {of:?}")
                }
                _ => assert_eq!(cell, "not determined", "{of:?}"),
            }
        }
    }
    assert_eq!(texts(&page, ".front .graded.missed").iter().filter(|t| *t == "not determined").count(), {
        matrix.iter().skip(3).flatten().filter(|c| *c == "not determined").count()
    });
    // schemes under other carries are not compared
    let other = write("other", 600, &four, "measured_azimuth = true");
    let text = std::fs::read_to_string(&other).expect("a file").replace("'inertial'", "'platform'");
    std::fs::write(&other, text).expect("written");
    let page = page_of("unlike.html", &[&short, &other]);
    let found = findings(&page, "Comparison of 2 schemes");
    assert!(found[0][1].starts_with("open: open none: schemes that differ in carry"), "{found:?}");
    assert!(found[1][1].starts_with("limited: LIMITED the schemes differ in carry"), "{found:?}");
    // no recommendation if no scheme meets its requirements
    let page = page_of("none.html", &[&one, &one]);
    let found = findings(&page, "Comparison of 2 schemes");
    assert!(
        found[0][1].starts_with("missed: NOT MET none: no scheme meets every requirement by prediction; "),
        "{found:?}"
    );
}

/// Generic angles have verdicts and no predictions, alone and beside other schemes.
#[test]
fn generic_angles_are_reported() {
    let folder = tempfile::tempdir().expect("a folder");
    let generic = "examples/generic-angles/scheme.toml";
    let page = Html::parse_document(&report(folder.path(), "generic.html", &[generic]).1);
    assert!(page.errors.is_empty(), "{:?}", page.errors);
    assert_unique_ids(&page);
    let answer = run(&["analyze", "--scheme", generic, "--solutions", "off", "--format", "json"]);
    let answer: serde_json::Value = serde_json::from_slice(&answer.stdout).expect("JSON");
    let all = answer["quantities"].as_array().expect("unknowns");
    let seen = all.iter().filter(|q| q["status"] == "observable").count();
    let status = &statuses(&page)[0];
    assert!(status[0][2].contains(&format!("{seen} of {} unknowns, for any ", all.len())), "{status:?}");
    let unknowns = table(&page, "Unknowns");
    for q in all {
        let row = unknowns
            .iter()
            .find(|r| q["name"] == r[0].as_str())
            .unwrap_or_else(|| panic!("no {}", q["name"]));
        assert_eq!(row[3], q["degree"].as_u64().map_or("-".into(), |k| k.to_string()), "{row:?}");
    }
    assert!(!texts(&page, "th").iter().any(|h| h.contains("sigma")));
    let page = Html::parse_document(&report(folder.path(), "both.html", &[generic, PAPER]).1);
    let schemes = texts(&page, "summary > h2").into_iter().filter(|t| t.starts_with("Scheme "));
    assert_eq!(schemes.count(), 2);
}

#[test]
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
#[ignore = "seconds: .ci/run"]
fn a_browser_shows_it() {
    let Some(mut browser) = Browser::start() else {
        eprintln!("skipped: no Chromium on this machine");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let (paper, _) = report(folder.path(), "paper.html", &[PAPER]);
    let scheme = hostile(folder.path(), 12).display().to_string();
    let (long, _) = report(folder.path(), "twelve.html", &[&scheme]);
    // formulas with dozens of terms are not cut at the edge of a sheet
    let (formulas, _) = report(folder.path(), "five.html", &["examples/five-positions/scheme.toml"]);
    browser.open(&formulas, 700, 900);
    browser.call("Emulation.setEmulatedMedia", json!({ "media": "print", "features": [] }));
    browser.settle();
    let cut = browser.value(
        "(() => { const all = [...document.querySelectorAll('.formulas math')], \
         w = document.documentElement.clientWidth; \
         return [all.length, all.filter(e => e.getBoundingClientRect().right > w + 1).length]; })()",
    );
    assert!(cut[0].as_u64() > Some(200) && cut[1] == json!(0), "{cut}");
    // tables are not cut either, nor positions with their slews
    browser.call("Emulation.setEmulatedMedia", json!({ "media": "", "features": [] }));
    for file in [&formulas, &long] {
        browser.open(file, 688, 900);
        browser.call("Emulation.setEmulatedMedia", json!({ "media": "print", "features": [] }));
        browser.settle();
        let cut = browser.value(
            "(() => { const w = document.documentElement.clientWidth; return [...document.querySelectorAll('.wide > \
             table')] \
             .filter(e => e.getBoundingClientRect().right > w + 1).map(e => e.innerText.slice(0, 80)); })()",
        );
        assert_eq!(cut, json!([]), "cut at the edge of a sheet");
        browser.call("Emulation.setEmulatedMedia", json!({ "media": "", "features": [] }));
    }
    browser.call("Emulation.setEmulatedMedia", json!({ "media": "", "features": [] }));
    // folded parts are printed on paper
    let (several, _) = report(folder.path(), "several.html", &[PAPER, MODEL]);
    browser.open(&several, 1280, 900);
    let visible = "[...document.querySelectorAll('details .wide > table')].filter(e => !e.closest('.unprinted')).map(e => \
                   e.checkVisibility({ contentVisibilityAuto: true }))";
    let seen = |browser: &mut Browser, all: bool| {
        let shown = browser.value(visible);
        let shown = shown.as_array().expect("a list");
        assert!(shown.len() > 5 && shown.iter().all(|v| *v == json!(all)), "{shown:?}");
    };
    seen(&mut browser, false);
    browser.call("Emulation.setEmulatedMedia", json!({ "media": "print", "features": [] }));
    browser.settle();
    seen(&mut browser, true);
    browser.call("Emulation.setEmulatedMedia", json!({ "media": "", "features": [] }));
    // accessibility rules for screen readers and keyboards, in light and dark mode
    let axe = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/axe/axe.min.js"));
    let axe = axe.expect("tests/data/axe/axe.min.js");
    let [procedure, calibration] = bench_pages(folder.path());
    for file in [&several, &paper, &procedure, &calibration] {
        for scheme in ["dark", "light"].into_iter().take(cases(1, 2)) {
            let wanted = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
            browser.call("Emulation.setEmulatedMedia", wanted);
            browser.open(file, 1280, 900);
            browser.value("document.querySelectorAll('details').forEach(d => { d.open = true; })");
            browser.value(&format!("{axe};1"));
            let found = browser.value(
                "axe.run().then(r => [r.passes.length, r.violations.map(v => v.impact + ' ' + v.id + ': ' + \
                 v.nodes[0].html.slice(0, 200))])",
            );
            assert!(found[0].as_u64() > Some(15) && found[1] == json!([]), "{scheme}: {found}");
        }
    }
    browser.call("Emulation.setEmulatedMedia", json!({ "media": "", "features": [] }));
    // D_FY: two positions need Z'', twelve do not
    for (file, degree_of_d_fy) in [(&paper, "2"), (&long, "1")] {
        browser.events.clear();
        browser.open(file, 1280, 900);
        // every figure with curves has an interactive drawing once it is unfolded, and the still picture is
        // hidden
        let folded = browser.value("document.querySelectorAll('details figure.curves canvas').length");
        assert_eq!(folded, json!(0));
        browser.value("document.querySelectorAll('details').forEach(d => { d.open = true; })");
        browser.settle();
        let counts = browser.value(
            "[document.querySelectorAll('figure.curves').length, document.querySelectorAll('figure.curves \
             canvas').length, \
             [...document.querySelectorAll('figure.curves > .still')].filter(e => e.checkVisibility()).length]",
        );
        assert!(counts[0].as_u64() > Some(10) && counts[0] == counts[1] && counts[2] == json!(0), "{counts}");
        for width in [1280, 400] {
            browser.size(width, 900);
            browser.settle();
            let beyond = browser.value(
                "(() => { const w = document.documentElement.clientWidth; \
                 const out = [...document.body.querySelectorAll('*')].filter(e => !e.closest('.wide') || \
                 e.classList.contains('wide')) \
                 .filter(e => e.getBoundingClientRect().right > w + 1 && !e.closest('svg, .u-wrap')) \
                 .map(e => e.tagName + '.' + e.className); \
                 return document.documentElement.scrollWidth > w ? ['page', ...out] : out; })()",
            );
            assert_eq!(beyond, json!([]), "at {width} px");
        }
        browser.size(1280, 900);
        browser.settle();
        // curves can be switched off and on, and values are read under the pointer
        let series = "#s1_attitude .u-legend .u-series:nth-child(2)";
        let off = format!("document.querySelector({series:?}).classList.contains('u-off')");
        assert_eq!(browser.value(&off), json!(false));
        browser.mouse(&format!("{series} .u-label"), true);
        assert_eq!(browser.value(&off), json!(true));
        browser.mouse(&format!("{series} .u-label"), true);
        assert_eq!(browser.value(&off), json!(false));
        browser.mouse("#s1_attitude .u-over", false);
        let shown = browser
            .value(&format!("document.querySelector({series:?}).querySelector('.u-value').textContent"));
        assert!(shown.as_str().is_some_and(|v| v.parse::<f64>().is_ok()), "{shown}");
        let degree = browser.value(
            "[...document.querySelectorAll('td')].find(c => c.textContent == \
             'D_FY').parentElement.children[3].textContent",
        );
        assert_eq!(degree, json!(degree_of_d_fy));
        // dark mode
        let paper = browser.value("getComputedStyle(document.body).backgroundColor");
        let dark = json!({ "features": [{ "name": "prefers-color-scheme", "value": "dark" }] });
        browser.call("Emulation.setEmulatedMedia", dark);
        browser.settle();
        assert_ne!(browser.value("getComputedStyle(document.body).backgroundColor"), paper);
        browser.call("Emulation.setEmulatedMedia", json!({ "media": "print", "features": [] }));
        browser.settle();
        let printed = browser.value(
            "[...document.querySelectorAll('figure .still')].every(e => !!e.closest('.unprinted') !== e.checkVisibility()) \
             && ![...document.querySelectorAll('.plot')].some(e => e.checkVisibility())",
        );
        assert_eq!(printed, json!(true), "on paper the still pictures");
        browser.call("Emulation.setEmulatedMedia", json!({ "media": "", "features": [] }));
        // no error, and no request except for the page itself
        for event in &browser.events {
            let (method, of) = (event["method"].as_str().unwrap_or_default(), &event["params"]);
            assert_ne!(method, "Runtime.exceptionThrown", "{of}");
            assert_ne!(method, "Log.entryAdded", "{of}");
            assert_ne!(method, "Runtime.consoleAPICalled", "{of}");
            if method == "Network.requestWillBeSent" {
                let url = of["request"]["url"].as_str().unwrap_or_default();
                assert!(url.starts_with("data:") || url.ends_with(".html"), "{url}");
            }
        }
    }
}

/// Pages of the bench: the sheet of a run with hostile names, and the report of a calibration.
fn bench_pages(folder: &Path) -> [std::path::PathBuf; 2] {
    let path = |name: &str| folder.join(name).display().to_string();
    let text = std::fs::read_to_string("examples/rate-table/scheme.toml").expect("an example");
    let text = text.replacen("rate table", "<b>rate</b> & table", 1);
    std::fs::write(folder.join("bench.toml"), text).expect("written");
    let sheet = run(&["procedure", &path("bench.toml"), "--settle", "20", "-o", &path("sheet"), "--quiet"]);
    assert!(sheet.status.success());
    let bench_day = ["examples/bench-day/scheme.toml", "examples/bench-day/record.csv"];
    let found = run(&["calibrate", bench_day[0], bench_day[1], "-o", &path("calibration"), "--quiet"]);
    assert!(found.status.success());
    [folder.join("sheet/procedure.html"), folder.join("calibration/calibration.html")]
}

/// The sheet of a run and the report of a calibration fit their pages and narrow screens; the decision of a
/// calibration comes first.
#[test]
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn pages_of_the_bench() {
    let folder = tempfile::tempdir().expect("a folder");
    let pages = bench_pages(folder.path());
    let [sheet, calibration] =
        pages.each_ref().map(|p| Html::parse_document(&std::fs::read_to_string(p).expect("written")));
    assert!(sheet.errors.is_empty() && calibration.errors.is_empty());
    assert_unique_ids(&sheet);
    assert_unique_ids(&calibration);
    assert_eq!(texts(&sheet, "h1"), ["Procedure: <b>rate</b> & table"]);
    assert_eq!(texts(&calibration, "h1"), ["Calibration: bench day"]);
    let heads = texts(&calibration, "h2");
    assert_eq!(heads[..3], ["Fit and findings", "Uncertainty", "Details"], "{heads:?}");
    // the status and the coefficients with their margins stand before the fit
    let body = texts(&calibration, "body").remove(0);
    let front = body.split("Fit and findings").next().unwrap_or_default();
    for answer in ["Requirements", "Consistent", "Recommended action", "D_FX", "margin", "sigma / predicted"]
    {
        assert!(front.contains(answer), "{answer}");
    }
    assert!(!body.contains("Design review"));
    let Some(mut browser) = Browser::start() else {
        eprintln!("skipped: no Chromium on this machine");
        return;
    };
    for (page, most) in pages.iter().zip([4, 7]) {
        let printed = printed_pages(&mut browser, page).0;
        assert!((1..=most).contains(&printed), "{}: {printed} pages", page.display());
        browser.open(page, 400, 900);
        browser.settle();
        let wide =
            browser.value("document.documentElement.scrollWidth > document.documentElement.clientWidth");
        assert_eq!(wide, json!(false), "{}", page.display());
        // every legend names its curves
        let unnamed = browser.value(
            "[...document.querySelectorAll('.u-legend .u-series')].filter(r => r.checkVisibility() && \
             !r.querySelector('.u-label').textContent.trim()).length",
        );
        assert_eq!(unnamed, json!(0));
    }
}

/// The report of a calibration names what changed since an earlier one, by two records and by the same one.
#[test]
fn changes_between_calibrations() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let bench_day = ["examples/bench-day/scheme.toml", "examples/bench-day/record.csv"];
    let done = run(&["calibrate", bench_day[0], bench_day[1], "-o", &path("one"), "--quiet"]);
    assert!(done.status.success());
    // another record, by which D_FX is larger by five sigma of the change
    let text = std::fs::read_to_string(path("one/calibration.json")).expect("written");
    let mut other: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let names = other["covariance"]["names"].as_array().expect("names");
    let k = names.iter().position(|n| n == "D_FX").expect("D_FX");
    let variance = other["covariance"]["rescaled"][k][k].as_f64().expect("a variance");
    let estimate = other["covariance"]["estimates"][k].as_f64().expect("an estimate");
    other["covariance"]["estimates"][k] = json!(estimate + 5.0 * (2.0 * variance).sqrt());
    other["rests_on"][0]["digest"] = json!("another");
    let save = |name: &str, value: &serde_json::Value| {
        std::fs::create_dir(path(name)).expect("a folder");
        std::fs::write(path(&format!("{name}/calibration.json")), value.to_string()).expect("written");
    };
    save("two", &other);
    other["consistent"] = json!(false);
    save("doubtful", &other);
    other["schema"] = json!("obsdeg.calibration/9");
    save("newer", &other);
    let page = |now: &str, before: &str, name: &str| {
        let (now, before) = (path(now), path(before));
        let output =
            run(&["report", "--calibration", &now, "--calibration", &before, "-o", &path(name), "--quiet"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Html::parse_document(&std::fs::read_to_string(path(name)).expect("written"))
    };
    let changed = page("two", "one", "a.html");
    let rows: Vec<Vec<String>> = table(&changed, "Changes since one");
    let row = rows.iter().find(|r| r[0] == "D_FX").expect("D_FX");
    assert_eq!(row[5], "5.000", "{row:?}");
    let other = texts(&changed, "body").remove(0);
    assert!(
        other.contains("Changes since one") && other.contains("The coefficients changed: chi-square"),
        "{other}"
    );
    let same = texts(&page("one", "one", "b.html"), "body").remove(0);
    assert!(
        same.contains("Both rest on examples/bench-day/record.csv, so that no change has a significance"),
        "{same}"
    );
    let doubtful = texts(&page("one", "doubtful", "e.html"), "body").remove(0);
    assert!(
        doubtful.contains("A calibration here is not consistent")
            && !doubtful.contains("coefficients changed")
    );
    refused(
        &["report", "--calibration", &path("newer"), "-o", &path("f.html")],
        &["a calibration of another version (obsdeg.calibration/9)"],
    );
    let with_conditions = ["report", "--calibration", &path("one"), "--noise", "1e-5", "-o", &path("c.html")];
    refused(&with_conditions, &["expected no conditions, --runs or --seed without a scheme"]);
    refused(&["report", "-o", &path("d.html")], &["<FILE>"]);
}

/// Number of A4 pages that a browser prints, and the words of the first two; without words where there is no
/// pdftotext.
fn printed_pages(browser: &mut Browser, file: &Path) -> (usize, Option<String>) {
    use base64::Engine;
    browser.open(file, 1280, 900);
    let answer =
        browser.call("Page.printToPDF", json!({ "preferCSSPageSize": true, "printBackground": false }));
    let pdf = base64::engine::general_purpose::STANDARD.decode(answer["data"].as_str().expect("data"));
    let pdf = pdf.expect("base64");
    let printed = file.with_extension("pdf");
    std::fs::write(&printed, &pdf).expect("written");
    let mut pdftotext = std::process::Command::new("pdftotext");
    let text = pdftotext.args(["-l", "2"]).arg(&printed).arg("-").output().ok().map(|out| {
        let text = String::from_utf8_lossy(&out.stdout).into_owned();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    });
    let pdf = String::from_utf8_lossy(&pdf).into_owned();
    (pdf.matches("/Type /Page").count() - pdf.matches("/Type /Pages").count(), text)
}

/// Questions of a board, as the table of answers names them.
const QUESTIONS: [&str; 9] = [
    "Carry",
    "Assumed",
    "Chosen by the program",
    "What limits it",
    "Accelerometers off by 20 ug",
    "Duration",
    "Position to drop",
    "Proven by",
    "Verified by",
];

/// Beginnings or parts of answers that every scheme of the examples below has.
const ANSWERS: [(&str, &str); 6] = [
    ("Assumed", " g per sample and axis; a sample at least every"),
    ("Accelerometers off by 20 ug", "K0 of 20 ug (1 sigma each) change D_"),
    ("Duration", " positions; "),
    ("Proven by", "a verdict is wrong with probability below"),
    ("Verified by", "Monte Carlo runs"),
    ("Verified by", "with its truth"),
];

/// Questions as a report names them: a model has outputs in place of positions.
pub(crate) fn questions(text: &str) -> [&'static str; 9] {
    QUESTIONS.map(|q| match q {
        "Position to drop" if !text.contains(q) => "Output to drop",
        q => q,
    })
}

/// Rows of the answers of `columns` subjects: what is the same for all of them has one cell.
fn answers_of(page: &Html, columns: usize) -> Vec<Vec<String>> {
    let mut rows = table(page, "Answers in brief");
    assert!(rows.iter().all(|row| row.len() == columns + 1), "{rows:?}");
    if columns > 1 && texts(page, "caption").iter().any(|c| c.starts_with("Answers in brief, the same")) {
        rows.extend(table(page, "Answers in brief, the same"));
        // nothing that all say is said by each
        assert!(rows.iter().all(|row| row.len() == 2 || row[1..].iter().any(|cell| *cell != row[1])));
    }
    rows
}

/// Asserts that the answers of a report have every question, each with an answer.
pub(crate) fn assert_questions(page: &Html, columns: usize, name: &str) {
    let answers = answers_of(page, columns);
    for question in questions(&texts(page, "body").remove(0)) {
        let row = answers.iter().find(|r| r[0] == question);
        let row = row.unwrap_or_else(|| panic!("{name}: {question}: {answers:?}"));
        assert!(row.iter().all(|cell| cell.len() > 1), "{name}: {row:?}");
    }
}

/// Asserts that the table of answers has every question, with an answer for each of `schemes` schemes.
fn assert_answers(page: &Html, schemes: usize, name: &str) {
    assert_questions(page, schemes, name);
    let answers = answers_of(page, schemes);
    let of = |question: &str| {
        let row = answers.iter().find(|r| r[0] == question);
        row.unwrap_or_else(|| panic!("{name}: {question}: {answers:?}"))
    };
    for (question, answer) in ANSWERS {
        assert!(of(question)[1..].iter().all(|cell| cell.contains(answer)), "{name}: {:?}", of(question));
    }
    let said =
        |cell: &String| ["Drop ", "You can drop ", "Keep all "].iter().any(|start| cell.starts_with(start));
    assert!(of("Position to drop")[1..].iter().all(said), "{name}: {:?}", of("Position to drop"));
    let body = texts(page, "body").remove(0);
    for part in ["Made by obsdeg", "Recommended action", "OPEN: not stated", "Margin: what is required"] {
        assert!(body.contains(part), "{name}: {part}");
    }
}

/// Asserts that the first two printed pages of a report have every question of a board, its origin and its
/// actions. Number of its pages.
pub(crate) fn assert_on_two_pages(browser: &mut Browser, file: &Path) -> usize {
    let (pages, first) = printed_pages(browser, file);
    let text = std::fs::read_to_string(file).expect("written");
    let drifts = "State the drifts of your gyros";
    let parts = ["Made by obsdeg", if text.contains(drifts) { drifts } else { "Recommended action" }];
    let missing = |first: &String| {
        questions(&text).iter().chain(&parts).find(|part| !first.contains(**part)).map(ToString::to_string)
    };
    let missing = first.as_ref().and_then(missing);
    assert_eq!(missing, None, "{}: not on page one or two", file.display());
    pages
}

/// Smallest text of the pictures outside folded details, in CSS pixels, at the width of a printed page.
fn smallest_text(browser: &mut Browser, file: &Path) -> f64 {
    browser.open(file, 695, 900);
    browser.call("Emulation.setEmulatedMedia", json!({ "media": "print", "features": [] }));
    browser.settle();
    let smallest = browser.value(
        "(() => { document.querySelectorAll('details').forEach(d => { d.open = true; }); \
          return Math.min(...[...document.querySelectorAll('svg text')].filter(t => \
          t.textContent.trim() && t.checkVisibility() && t.getBoundingClientRect().width > 0).map(t => \
          parseFloat(getComputedStyle(t).fontSize) * Math.hypot(t.getScreenCTM().a, t.getScreenCTM().b))); })()",
    );
    browser.call("Emulation.setEmulatedMedia", json!({ "media": "", "features": [] }));
    smallest.as_f64().expect("a size")
}

/// On paper one scheme takes at most eight pages with its appendix, three take at most twelve. The first
/// pages answer the questions of a board, and no text of a picture is smaller than 6 pt (8 pixels).
#[test]
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
#[ignore = "seconds: .ci/run"]
fn a_review_fits_its_pages() {
    let folder = tempfile::tempdir().expect("a folder");
    let example = |name: &str| format!("examples/{name}/scheme.toml");
    let mut files = Vec::new();
    for name in ["six-positions", "rate-table"] {
        let (file, text) = report(folder.path(), &format!("{name}.html"), &[&example(name)]);
        assert_answers(&Html::parse_document(&text), 1, name);
        files.push((file, 3, 8));
    }
    for name in ["hudson-bay/model.toml", "generic-angles/scheme.toml"] {
        let (file, text) = report(
            folder.path(),
            &format!("{}.html", name.replace('/', "-")),
            &[&format!("examples/{name}")],
        );
        assert_questions(&Html::parse_document(&text), 1, name);
        files.push((file, 2, 5));
    }
    let [_, calibration] = bench_pages(folder.path());
    let text = std::fs::read_to_string(&calibration).expect("written");
    assert_questions(&Html::parse_document(&text), 1, "calibration");
    files.push((calibration, 4, 6));
    let three = ["five-positions", "six-positions", "paper-p1-p2"].map(example);
    let (file, text) = report(folder.path(), "three.html", &three.each_ref().map(String::as_str));
    assert_answers(&Html::parse_document(&text), 3, "three");
    files.push((file, 4, 12));
    let Some(mut browser) = Browser::start() else {
        eprintln!("skipped: no Chromium on this machine");
        return;
    };
    for (file, least, most) in files {
        let pages = assert_on_two_pages(&mut browser, &file);
        assert!((least..=most).contains(&pages), "{}: {pages} pages", file.display());
        let smallest = smallest_text(&mut browser, &file);
        assert!(smallest > 7.9, "{}: {smallest} px", file.display());
    }
}

/// Outputs of a model that can be dropped are those without which `analyze` finds the same unknowns and the
/// same rank.
#[test]
fn an_output_to_drop_changes_no_verdict() {
    let folder = tempfile::tempdir().expect("a folder");
    // names with their degrees, and the rank
    let judged = |file: &str| -> (Vec<(String, Option<u64>)>, u64) {
        let out = run(&["analyze", "--model", file, "--format", "json"]);
        let answer: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
        let quantities = answer["quantities"].as_array().expect("quantities").clone();
        let degree =
            |q: &serde_json::Value| (q["name"].as_str().expect("a name").to_string(), q["degree"].as_u64());
        (quantities.iter().map(degree).collect(), answer["rank"].as_u64().expect("a rank"))
    };
    let own = |name: &str, body: &str| {
        let file = folder.path().join(format!("{name}.toml"));
        std::fs::write(&file, format!("name = '{name}'\n{body}")).expect("written");
        file.display().to_string()
    };
    // one of two outputs is the derivative of the other; two equal outputs
    let rate = own("rate", "[states]\nx = 'v'\nv = 'a'\n[parameters]\na = {}\n[outputs]\ny = 'x'\nz = 'v'\n");
    let equal = own("equal", "[states]\nx = '-k*x'\n[parameters]\nk = {}\n[outputs]\ny = 'x'\nz = '2*x'\n");
    let (mut dropped, mut kept) = (0, 0);
    // without a bearing combinations are lost, and no unknown, since none is observable
    let models = ["examples/hudson-bay/model.toml", "examples/bearing-slam/model.toml", &rate, &equal];
    for (i, model) in models.into_iter().enumerate() {
        let (_, page) = report(folder.path(), &format!("{i}.html"), &[model]);
        let answers = table(&Html::parse_document(&page), "Answers in brief");
        let said = &answers.iter().find(|r| r[0] == "Output to drop").expect("a row")[1];
        let text = std::fs::read_to_string(model).expect("a model");
        let outputs =
            text.split("[outputs]\n").nth(1).expect("outputs").split("\n[").next().expect("outputs");
        let (all, rank) = judged(model);
        let names = said.strip_prefix("You can drop ").and_then(|rest| rest.split(':').next());
        let names: Vec<&str> =
            names.map_or(Vec::new(), |n| n.trim_start_matches("one of ").split(", ").collect());
        for line in outputs.lines().filter(|l| l.contains('=')) {
            let name = line.split(" =").next().expect("a name");
            // numbers of a run belong to all outputs
            let rest =
                text.split("\n[simulation").next().expect("a model").replacen(&format!("{line}\n"), "", 1);
            let file = folder.path().join(format!("{i}-{name}.toml"));
            std::fs::write(&file, rest).expect("written");
            let (without, fewer) = judged(&file.display().to_string());
            let pairs: Vec<_> =
                all.iter().zip(&without).filter(|((_, degree), _)| degree.is_some()).collect();
            let lost: Vec<&str> =
                pairs.iter().filter(|(_, b)| b.1.is_none()).map(|(a, _)| a.0.as_str()).collect();
            let higher = pairs.iter().any(|(a, b)| b.1 > a.1);
            if names.contains(&name) {
                dropped += 1;
                let reported = said.contains("higher order");
                assert!(lost.is_empty() && fewer == rank && higher == reported, "{said}: {without:?}");
            } else if said.starts_with("Keep all outputs") {
                kept += 1;
                let part =
                    said.split(&format!("without {name} ")).nth(1).expect("the output").split(';').next();
                let expected = match lost.is_empty() {
                    true => format!("{} of {rank} independent combinations", rank - fewer),
                    false => lost.join(", "),
                };
                assert!(part == Some(&expected) && fewer < rank, "{said}: {expected}");
            }
        }
    }
    assert!(dropped == 3 && kept == 4, "{dropped} {kept}");
}

/// Answers hold for what was computed: a run that is not stated in full, equal schemes, a record that
/// determines nothing.
#[test]
#[ignore = "seconds: .ci/run"]
fn answers_say_no_more_than_was_computed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let answers = |page: &str, heading: &str| table(&Html::parse_document(page), heading);
    let of = |rows: &[Vec<String>], question: &str| {
        rows.iter().find(|r| r[0] == question).unwrap_or_else(|| panic!("{question}: {rows:?}"))[1].clone()
    };
    // the file states duration, step and values, and no noise
    let (_, page) = report(folder.path(), "influenza.html", &["examples/influenza/model.toml"]);
    let rows = answers(&page, "Answers in brief");
    assert!(
        of(&rows, "Duration").starts_with("No run: ") && of(&rows, "Duration").contains("noise"),
        "{rows:?}"
    );
    assert!(of(&rows, "Chosen by the program").contains("there is no run"), "{rows:?}");
    // with a bench and no requirement the largest figure is a total, by the sources of its budget
    let bench = "carry = 'inertial'\nlatitude_deg = 40\n[bench]\nK0 = 20\n";
    let positions = ["NUE", "USE", "EDN", "WND", "DNE"].map(|n| format!("[[position]]\nattitude = '{n}'\n"));
    std::fs::write(path("bench.toml"), format!("{bench}{}", positions.concat())).expect("written");
    let (_, page) = report(folder.path(), "bench.html", &[&path("bench.toml")]);
    let limits = of(&answers(&page, "Answers in brief"), "What limits it");
    assert!(
        limits.contains("orst total") && limits.contains("by K0_") && !limits.contains("noise"),
        "{limits}"
    );
    let scheme = "examples/rate-table/scheme.toml";
    let (_, page) = report(folder.path(), "equal.html", &[scheme, scheme]);
    let captions = texts(&Html::parse_document(&page), "caption");
    let brief: Vec<_> = captions.iter().filter(|c| c.starts_with("Answers in brief")).collect();
    assert_eq!(brief, ["Answers in brief, the same for all 2"]);
    // two of six positions, at drifts that bend the run: nothing is determined
    let text = std::fs::read_to_string("examples/bench-day/scheme.toml").expect("an example");
    let two = text.split("[[position]]\nname = \"p3\"").next().expect("two positions");
    std::fs::write(path("s.toml"), two).expect("written");
    let record = std::fs::read_to_string("examples/bench-day/record.csv").expect("an example");
    let early = record.lines().take_while(|line| !line.contains("p3")).collect::<Vec<_>>().join("\n");
    std::fs::write(path("r.csv"), early).expect("written");
    run(&["calibrate", &path("s.toml"), &path("r.csv"), "-o", &path("c"), "--quiet"]);
    let page = std::fs::read_to_string(path("c/calibration.html")).expect("written");
    let coefficients = answers(&page, "Coefficients");
    assert!(coefficients.iter().all(|r| r[2] == "-"), "{coefficients:?}");
    let rows = answers(&page, "Answers in brief");
    assert_eq!(of(&rows, "Verified by"), "Nothing to compare: no unknown is determined");
    assert_eq!(of(&rows, "Position to drop"), "None: no unknown is determined");
}

/// The effect of accelerometers that are off by 20 ug is that of 20 ug where the bench states another size:
/// changes are linear in the size.
#[test]
#[ignore = "seconds: .ci/run release"]
fn twenty_micro_g_whatever_the_bench_states() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string("examples/bench-errors/scheme.toml").expect("the example");
    let of = |size: &str| {
        let file = folder.path().join(format!("{size}.toml"));
        std::fs::write(&file, text.replace("K0 = 20", &format!("K0 = {size}"))).expect("written");
        let (_, page) = report(folder.path(), &format!("{size}.html"), &[&file.display().to_string()]);
        let answers = table(&Html::parse_document(&page), "Answers in brief");
        let row = answers.iter().find(|r| r[0].starts_with("Accelerometers")).expect("a row");
        row[1].clone()
    };
    let (stated, other) = (of("20"), of("5"));
    assert!(stated.ends_with("; the bench states this size"), "{stated}");
    let same = stated.trim_end_matches("; the bench states this size");
    assert!(other.starts_with(same) && other.contains("; 5 ug, as the bench states, by "), "{other}");
}

/// A title block is printed as it is stated, with a place for each signature, and never from the clock.
#[test]
fn a_title_block_is_that_of_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let written = |line: &str| {
        let file = folder.path().join("s.toml");
        let positions = "[[position]]\nattitude = 'NUE'\n[[position]]\nattitude = 'UEN'\n";
        std::fs::write(&file, format!("[document]\n{line}\n{positions}")).expect("written");
        file.display().to_string()
    };
    let all = "reference = 'GN-7'\nrevision = 'B <i>'\ndate = 2026-03-01\nauthor = 'A. N. Other'\n\
               signatures = ['Checked', 'Approved']";
    let (_, page) = report(folder.path(), "s.html", &[&written(all)]);
    let page = Html::parse_document(&page);
    let cells = texts(&page, ".front tbody tr:first-child td");
    assert_eq!(cells[1..5], ["GN-7", "B <i>", "2026-03-01", "A. N. Other"]);
    let heads = texts(&page, ".front thead th");
    assert_eq!(heads[5..7], ["Checked: name, date, signature", "Approved: name, date, signature"]);
    let (_, none) = report(folder.path(), "none.html", &[PAPER]);
    assert!(none.contains("are not stated (table [document] of the file)"));
    let to = folder.path().join("x.html").display().to_string();
    for (line, said) in [
        ("revison = 'B'", "revison"),
        ("signatures = 'B'", "signatures"),
        ("signatures = ['A', ' ']", "signatures is blank"),
        ("reference = '  '", "reference is blank"),
        ("signatures = ['a', 'b', 'c', 'd', 'e', 'f', 'g']", "7 signatures; expected at most 6"),
        (&format!("author = '{}'", "a".repeat(300)), "author has 300 characters"),
    ] {
        refused(&["report", &written(line), "-o", &to], &[said]);
    }
}

/// Recommended actions of a page, one list per box.
fn actions(page: &Html) -> Vec<Vec<String>> {
    let parse = |s: &str| Selector::parse(s).expect("a selector");
    let lines = |e: scraper::ElementRef<'_>| {
        e.select(&parse(".actions li")).map(|l| l.text().collect::<String>()).collect()
    };
    page.select(&parse("body > .front .status")).map(lines).collect()
}

/// The model with one unknown set to a known generic value.
fn knowing(model: &SystemModel, name: &str) -> SystemModel {
    let mut out = model.clone();
    if let Some(state) = out.states.iter_mut().find(|s| s.named.name == name) {
        state.start = StateStart::Known;
        return out;
    }
    let at = out.parameters.iter().position(|p| p.name == name).expect("a state or parameter");
    let known = out.parameters.remove(at);
    out.constants.push((known, Constant::Generic));
    out
}

/// Recommendations of the box of a model are tried: with any unknown of a group known, the others become
/// observable. A group for which one value does not suffice gets another recommendation.
#[test]
fn a_model_says_what_to_know_beforehand() {
    let folder = tempfile::tempdir().expect("a folder");
    let written = |name: &str, text: &str| {
        let file = folder.path().join(name);
        std::fs::write(&file, text).expect("written");
        file.display().to_string()
    };
    let page = |file: &str| {
        let (_, page) = report(folder.path(), "m.html", &[file, "--force"]);
        actions(&Html::parse_document(&page)).remove(0)
    };
    let two = "name='two'\nparameters=['a','b','c','d']\n[states]\nx='-a*b*x'\nw='-c*d*w'\n[outputs]\ny='x'\nv='w'\n";
    let examples = ["lotka-volterra", "sir", "two-compartment", "unicycle-range"];
    let examples = examples.map(|name| format!("examples/{name}/model.toml"));
    let mut groups = 0;
    for file in examples.into_iter().chain([written("two.toml", two)]) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(&file);
        let model = model_file::read(&std::fs::read_to_string(path).expect("read")).expect("a model");
        for line in page(&file) {
            let parts = line.strip_prefix("To resolve ").and_then(|l| l.split_once(": "));
            let said = |rest: &str| {
                ["know one of them", "know or measure one of them"].iter().any(|s| rest.starts_with(s))
            };
            let Some((list, _)) = parts.filter(|(_, rest)| said(rest)) else { continue };
            groups += 1;
            let names: Vec<&str> = list.split(", ").collect();
            for name in &names {
                let options = SystemOptions { solutions: false, ..SystemOptions::default() };
                let found = analyze_system(&knowing(&model, name), options).expect("judged");
                for other in names.iter().filter(|other| *other != name) {
                    let q = found.quantities.iter().find(|q| q.name == *other).expect("there");
                    assert_eq!(q.status, Status::Observable, "{file}: {other} with {name} known");
                }
            }
        }
    }
    assert_eq!(groups, 6);
    let three = "name='three'\nparameters=['a','b','c']\n[states]\nx='-a*b*c*x'\n[outputs]\ny='x'\n";
    let all = page(&written("three.toml", three));
    assert_eq!(all[0], "To resolve a: know b and c; degree 1", "{all:?}");
    let one = "name='one'\nparameters=['k']\n[states]\nx='-k*x'\n[outputs]\ny='x'\n[simulation]\nduration=10\n\
               step=0.1\n\
               values={x=1,k=0.5}\npriors={x=0.01,k=0.01}\nnoise={y=0.001}\n";
    let all = page(&written("one.toml", one));
    assert!(all.len() == 1 && all[0].starts_with("No action: every unknown is observable"), "{all:?}");
}

/// The box of a calibration recommends an action for each doubt, or says that none is needed.
#[test]
#[ignore = "seconds: .ci/run"]
fn a_calibration_says_what_to_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let record = "examples/bench-day/record.csv";
    let of = |scheme: &str, name: &str| {
        let at = folder.path().join(name);
        let path = at.display().to_string();
        let done = run(&["calibrate", scheme, record, "-q", "-o", &path]);
        assert!(done.status.code().is_some_and(|code| code < 2), "{}", stderr(&done));
        let page = report(folder.path(), &format!("{name}.html"), &[scheme, "--calibration", &path]).1;
        let json = std::fs::read_to_string(at.join("calibration.json")).expect("written");
        (actions(&Html::parse_document(&page)).remove(1), json)
    };
    let (none, json) = of("examples/bench-day/scheme.toml", "right");
    assert!(json.contains("\"findings\": []"));
    assert!(none.len() == 1 && none[0].starts_with("State the bench: without it"), "{none:?}");
    assert!(none[0].contains("K0 < 7.16 ug, M < 1.51 arcsec"), "{none:?}");
    // requirements by the record decide, whatever the prediction says
    let strict = folder.path().join("strict.toml").display().to_string();
    let text = std::fs::read_to_string("examples/bench-day/scheme.toml").expect("a scheme");
    let at = text.find("[requirements]").expect("requirements");
    let rest = text[at..].find("\n[").map_or("", |end| &text[at + end..]);
    std::fs::write(&strict, format!("{}[requirements]\nD = 1e-6\n{rest}", &text[..at])).expect("written");
    let (missed, _) = of(&strict, "missed");
    assert!(missed.iter().any(|l| l.contains("their requirements are NOT met")), "{missed:?}");
    let path = folder.path().join("missed.html");
    let status = statuses(&Html::parse_document(&std::fs::read_to_string(path).expect("a page")));
    assert_eq!((status[1][0][0].as_str(), status[1][0][1].as_str()), ("Requirements", "missed"));
    let (some, json) = of("examples/six-positions/scheme.toml", "wrong");
    assert!(json.contains("\"kind\": \"position\""));
    assert!(some.iter().any(|l| l.starts_with("Look at the record at ") && l.contains("p6")), "{some:?}");
    assert!(!some.iter().any(|l| l.starts_with("none")), "{some:?}");
}

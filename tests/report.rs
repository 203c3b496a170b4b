//! The design review as its reader sees it: valid, complete, escaped, the same each time; in a real browser where there is one.

mod browser;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use browser::Browser;
use scraper::{Html, Selector};
use serde_json::json;

/// Markup of every format, in names and descriptions.
const HOSTILE: &str = r#"<script>alert(1)</script> & "x" $a_b^c$ #let \end{document} *b* |c| `d` {{ e }} %"#;

fn obsdeg(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_obsdeg"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .expect("it runs")
}

/// Writes a report and gives its text.
fn report(folder: &Path, name: &str, inputs: &[&str]) -> (PathBuf, String) {
    let file = folder.join(name);
    let path = file.display().to_string();
    let arguments = [&["report", "--runs", "20", "-q", "-o", &path], inputs].concat();
    let output = obsdeg(&arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stdout.is_empty());
    let text = std::fs::read(&file).expect("written");
    (file, String::from_utf8_lossy(&text).into_owned())
}

/// Twelve positions, with slews, under names that try to be markup.
fn twelve(folder: &Path) -> PathBuf {
    let attitudes = ["NUE", "NED", "SUW", "SEU", "UNW", "UEN", "DNE", "DES", "ENU", "EUS", "WND", "WUN"];
    let mut text = format!(
        "name = '''{HOSTILE}'''\ndescription = '''{HOSTILE}'''\ncarry = \"inertial\"\nlatitude_deg = 48\n\
         [simulation]\ndwell_s = 300\nslew_rate_deg_s = 3\nstep_s = 10\n[requirements]\nD = 0.05\n"
    );
    for (i, attitude) in attitudes.iter().enumerate() {
        text.push_str(&format!("[[position]]\nname = \"q_{}\"\nattitude = \"{attitude}\"\n", i + 1));
    }
    let file = folder.join("twelve.toml");
    std::fs::write(&file, text).expect("written");
    file
}

const PAPER: &str = "examples/paper-p1-p2/scheme.toml";
const MODEL: &str = "examples/two-compartment/model.toml";

fn texts(page: &Html, selector: &str) -> Vec<String> {
    let selector = Selector::parse(selector).expect("a selector");
    page.select(&selector).map(|e| e.text().collect::<String>().trim().to_string()).collect()
}

/// Cells of the table whose caption begins so.
fn table(page: &Html, caption: &str) -> Vec<Vec<String>> {
    let parse = |s: &str| Selector::parse(s).expect("a selector");
    let table = page
        .select(&parse("table"))
        .find(|t| t.select(&parse("caption")).any(|c| c.text().collect::<String>().starts_with(caption)))
        .unwrap_or_else(|| panic!("no table {caption}"));
    let cells = |row: scraper::ElementRef<'_>| {
        row.select(&parse("td")).map(|c| c.text().collect::<String>()).collect()
    };
    table.select(&parse("tbody tr")).map(cells).collect()
}

fn assert_unique_ids(page: &Html) {
    let selector = Selector::parse("[id]").expect("a selector");
    let mut ids: Vec<&str> = page.select(&selector).filter_map(|e| e.attr("id")).collect();
    ids.sort_unstable();
    let twice: Vec<&str> = ids.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]).collect();
    assert!(twice.is_empty(), "{twice:?}");
}

#[test]
fn every_example_has_a_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut inputs: Vec<PathBuf> = (std::fs::read_dir(root).expect("a folder"))
        .map(|e| e.expect("an entry").path())
        .filter(|p| !p.ends_with("generic-angles") && !p.display().to_string().contains("wrong-"))
        .flat_map(|p| ["scheme.toml", "model.toml"].map(|name| p.join(name)))
        .filter(|p| p.is_file())
        .collect();
    inputs.sort();
    assert!(inputs.len() > 15);
    for (i, input) in inputs.iter().enumerate() {
        let (_, text) = report(folder.path(), &format!("{i}.html"), &[&input.display().to_string()]);
        let page = Html::parse_document(&text);
        assert!(page.errors.is_empty(), "{}: {:?}", input.display(), page.errors);
        assert_unique_ids(&page);
        assert!(text.len() < 2_000_000 && !text.contains("NaN"), "{}", input.display());
        let verdict = texts(&page, "main > p")
            .into_iter()
            .find(|p| p.starts_with("The scheme") || p.contains("locally"));
        assert!(verdict.is_some_and(|v| !v.contains("DISAGREES")), "{}", input.display());
        assert!(texts(&page, ".formulas code").is_empty(), "{}: a formula without MathML", input.display());
    }
}

#[test]
fn the_papers_case_is_one_valid_page_in_the_order_of_a_review() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, text) = report(folder.path(), "review.html", &[PAPER]);
    let (_, again) = report(folder.path(), "again.html", &[PAPER]);
    assert!(text == again, "the same command gives the same bytes");
    assert!(text.len() < 2_000_000, "{} bytes", text.len());
    let page = Html::parse_document(&text);
    assert!(page.errors.is_empty(), "{:?}", page.errors);
    assert_eq!(
        texts(&page, "h2"),
        [
            "Verdict",
            "Unknowns",
            "What cannot be told apart",
            "Positions",
            "How each is solved",
            "Sensitivity",
            "Fewest positions, and what each is for",
            "Evidence by a filter",
            "Validity of the small-angle model",
            "Assumptions and certainty",
            "About this report",
        ]
    );
    // method.md, section 9: two positions, platform carry
    let unknowns = table(&page, "Every unknown");
    let degree = |name: &str| {
        let row = unknowns.iter().find(|r| r[0] == name).unwrap_or_else(|| panic!("no {name}"));
        row[3].clone()
    };
    assert_eq!(["psi_x", "D_FX", "D_FY", "D_FZ"].map(degree), ["0", "1", "2", "-"]);
    let verdict = &texts(&page, "main > p")[0];
    assert!(verdict.starts_with("The scheme determines 5 of the 12 gyro coefficients"), "{verdict}");
    assert_eq!(verdict.matches(". ").count(), 1, "two sentences: {verdict}");
    // formulas are math, pictures are there without scripts, ids are unique, nothing is fetched
    assert!(texts(&page, "li math").len() >= 10);
    assert!(texts(&page, "figure svg").len() > 20);
    assert_unique_ids(&page);
    for fetched in ["src=\"http", "href=\"http", "@import", "url(http"] {
        assert!(!text.contains(fetched), "{fetched}");
    }
    let words: Vec<String> = texts(&page, "figcaption");
    for picture in [
        "Rank over",
        "Attitude",
        "Excitation",
        "Predicted sigma",
        "What longer dwells buy",
        "Total time",
        "Sigma against",
        "Normalised estimation",
        "Normalised innovation",
        "Correlation",
        "Error of the estimate of D_FX",
    ] {
        assert!(words.iter().any(|w| w.starts_with(picture)), "{picture}: {words:?}");
    }
}

#[test]
fn text_from_files_is_text_in_every_format() {
    let folder = tempfile::tempdir().expect("a folder");
    let scheme = twelve(folder.path()).display().to_string();
    let (_, text) = report(folder.path(), "review.html", &[&scheme, PAPER, MODEL]);
    assert!(text.len() < 2_000_000, "{} bytes", text.len());
    let page = Html::parse_document(&text);
    assert!(page.errors.is_empty(), "{:?}", page.errors);
    assert!(!text.contains("<script>alert"), "a script of the input");
    let title = texts(&page, "h1").remove(0);
    assert!(title.contains(HOSTILE), "{title}");
    assert!(texts(&page, "main > p").iter().any(|p| p == HOSTILE));
    assert!(texts(&page, "td").iter().any(|c| c == "q_3"));
    // several: parts of their own, and a comparison
    let parts = texts(&page, "h2");
    assert_eq!(parts.len(), 5, "{parts:?}");
    assert_eq!(parts[2], "Comparison of the schemes");
    assert!(table(&page, "Side by side").len() == 2);

    let (file, text) = report(folder.path(), "review.md", &[&scheme]);
    assert!(!text.contains("<script>") && text.contains("\\<script\\>"), "markup in Markdown");
    assert!(file.with_file_name("figures").join("s1_staircase.svg").is_file());
    let other = tempfile::tempdir().expect("a folder");
    let (file, text) = report(other.path(), "review.tex", &[&scheme]);
    assert_eq!(text.matches("\\end{document}").count(), 1);
    assert!(text.contains("\\$a\\_b\\textasciicircum{}c\\$ \\#let \\textbackslash{}end\\{document\\}"));
    assert!(file.with_file_name("figures").join("s1_staircase.png").is_file());
}

#[test]
fn what_cannot_be_reported_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let refused = |arguments: &[&str], what: &str| {
        let output = obsdeg(&[&["report"], arguments].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(what), "{said}");
        assert!(
            std::fs::read_dir(folder.path())
                .expect("a folder")
                .all(|f| f.expect("an entry").file_name() == "taken.html")
        );
    };
    std::fs::write(at("taken.html"), "mine").expect("written");
    refused(&[PAPER, "-o", &at("review.doc")], "expected a file that ends in .html, .pdf, .md or .tex");
    refused(&[PAPER, "-o", &at("taken.html")], "--force replaces it");
    refused(&["no-such-file.toml", "-o", &at("a.html")], "no-such-file.toml");
    refused(&["examples/generic-angles/scheme.toml", "-o", &at("a.html")], "the angle `alpha` is generic");
    refused(&["examples/wrong-models/unknown-name.toml", "-o", &at("a.html")], "did you mean");
    refused(&["examples/wrong-gimbals/scheme.toml", PAPER, "-o", &at("a.html")], "wrong-gimbals");
    assert_eq!(std::fs::read_to_string(at("taken.html")).expect("still there"), "mine");
    if cfg!(not(feature = "pdf")) {
        refused(&[PAPER, "-o", &at("a.pdf")], "without the feature `pdf`");
    }
}

#[test]
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn a_browser_shows_it() {
    let Some(mut browser) = Browser::start() else {
        eprintln!("skipped: no Chromium on this machine");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let (paper, _) = report(folder.path(), "paper.html", &[PAPER]);
    let scheme = twelve(folder.path()).display().to_string();
    let (long, _) = report(folder.path(), "twelve.html", &[&scheme]);
    // D_FY: two positions need Z'', twelve do not
    for (file, degree_of_d_fy) in [(&paper, "2"), (&long, "1")] {
        browser.events.clear();
        browser.open(file, 1280, 900);
        // every figure with curves has a drawing of its own, and the still one is out of the way
        let counts = browser.value(
            "[document.querySelectorAll('figure.curves').length, document.querySelectorAll('figure.curves canvas').length, \
             [...document.querySelectorAll('figure.curves > .still')].filter(e => e.checkVisibility()).length]",
        );
        assert!(counts[0].as_u64() > Some(10) && counts[0] == counts[1] && counts[2] == json!(0), "{counts}");
        for width in [1280, 400] {
            browser.size(width, 900);
            browser.settle();
            let beyond = browser.value(
                "(() => { const w = document.documentElement.clientWidth; \
                 const out = [...document.body.querySelectorAll('*')].filter(e => !e.closest('.wide') || e.classList.contains('wide')) \
                 .filter(e => e.getBoundingClientRect().right > w + 1 && !e.closest('svg, .u-wrap')) \
                 .map(e => e.tagName + '.' + e.className); \
                 return document.documentElement.scrollWidth > w ? ['page', ...out] : out; })()",
            );
            assert_eq!(beyond, json!([]), "at {width} px");
        }
        browser.size(1280, 900);
        browser.settle();
        // a curve is switched off and on, a value is read under the pointer
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
            "[...document.querySelectorAll('td')].find(c => c.textContent == 'D_FY').parentElement.children[3].textContent",
        );
        assert_eq!(degree, json!(degree_of_d_fy));
        // dark
        let paper = browser.value("getComputedStyle(document.body).backgroundColor");
        let dark = json!({ "features": [{ "name": "prefers-color-scheme", "value": "dark" }] });
        browser.call("Emulation.setEmulatedMedia", dark);
        browser.settle();
        assert_ne!(browser.value("getComputedStyle(document.body).backgroundColor"), paper);
        browser.call("Emulation.setEmulatedMedia", json!({ "media": "print", "features": [] }));
        browser.settle();
        let printed = browser.value(
            "[...document.querySelectorAll('figure .still')].every(e => e.checkVisibility()) \
             && ![...document.querySelectorAll('.plot')].some(e => e.checkVisibility())",
        );
        assert_eq!(printed, json!(true), "on paper the still pictures");
        browser.call("Emulation.setEmulatedMedia", json!({ "media": "", "features": [] }));
        // no error, no request but for the page itself
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

#[cfg(feature = "pdf")]
#[test]
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn the_pdf_holds_every_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let scheme = twelve(folder.path()).display().to_string();
    let inputs = [scheme.as_str(), PAPER, MODEL];
    let (file, _) = report(folder.path(), "review.pdf", &inputs);
    let (again, _) = report(folder.path(), "again.pdf", &inputs);
    let bytes = std::fs::read(&file).expect("written");
    assert!(bytes.starts_with(b"%PDF-"));
    assert!(bytes == std::fs::read(&again).expect("written"), "the same command gives the same bytes");
    let Ok(out) = Command::new("pdftotext").arg("-layout").arg(&file).arg("-").output() else {
        eprintln!("skipped: no pdftotext on this machine");
        return;
    };
    assert!(out.status.success());
    // hyphens and line breaks aside, every cell and heading of the page is in the PDF
    let squeezed =
        |text: &str| -> String { text.chars().filter(|c| !c.is_whitespace() && *c != '\u{ad}').collect() };
    let pages = squeezed(&String::from_utf8_lossy(&out.stdout));
    let (_, html) = report(folder.path(), "review.html", &inputs);
    let page = Html::parse_document(&html);
    let missing: Vec<String> = (["h2", "h3", "caption", "th", "td"].iter())
        .flat_map(|s| texts(&page, s))
        .filter(|t| !t.is_empty() && t.split_whitespace().any(|word| !pages.contains(&squeezed(word))))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
    assert!(texts(&page, "table").len() > 20);
}

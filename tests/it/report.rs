//! The design review in all formats: valid, complete, escaped, reproducible.

use std::path::{Path, PathBuf};

use crate::browser::Browser;
use crate::program::{run, stderr};
use crate::report_page::{assert_on_two_pages, assert_questions};
use scraper::{Html, Selector};

/// Markup of every format, in names and descriptions.
const HOSTILE: &str = r#"<script>alert(1)</script> & "x" $a_b^c$ #let \end{document} *b* |c| `d` {{ e }} %"#;

/// Writes a report and returns its path and its text.
pub(crate) fn report(folder: &Path, name: &str, inputs: &[&str]) -> (PathBuf, String) {
    let file = folder.join(name);
    let path = file.display().to_string();
    let arguments = [&["report", "--runs", "20", "-q", "-o", &path], inputs].concat();
    let output = run(&arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(output.stdout.is_empty());
    let text = std::fs::read(&file).expect("written");
    (file, String::from_utf8_lossy(&text).into_owned())
}

/// Writes a scheme with up to twelve positions and slews, whose names contain markup.
pub(crate) fn hostile(folder: &Path, positions: usize) -> PathBuf {
    let attitudes = ["NUE", "NED", "SUW", "SEU", "UNW", "UEN", "DNE", "DES", "ENU", "EUS", "WND", "WUN"];
    let mut text = format!(
        "name = '''{HOSTILE}'''\ndescription = '''{HOSTILE}'''\ncarry = \"inertial\"\nlatitude_deg = 48\n\
         [simulation]\ndwell_s = 300\nslew_rate_deg_s = 3\nstep_s = 10\n[requirements]\nD = 0.05\n"
    );
    for (i, attitude) in attitudes.iter().take(positions).enumerate() {
        text.push_str(&format!("[[position]]\nname = \"q_{}\"\nattitude = \"{attitude}\"\n", i + 1));
    }
    let file = folder.join(format!("{positions}.toml"));
    std::fs::write(&file, text).expect("written");
    file
}

pub(crate) const PAPER: &str = "examples/paper-p1-p2/scheme.toml";
pub(crate) const MODEL: &str = "examples/two-compartment/model.toml";

pub(crate) fn texts(page: &Html, selector: &str) -> Vec<String> {
    let selector = Selector::parse(selector).expect("a selector");
    page.select(&selector).map(|e| e.text().collect::<String>().trim().to_string()).collect()
}

/// Cells of the table whose caption begins with the given text.
pub(crate) fn table(page: &Html, caption: &str) -> Vec<Vec<String>> {
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

pub(crate) fn assert_unique_ids(page: &Html) {
    let selector = Selector::parse("[id]").expect("a selector");
    let mut ids: Vec<&str> = page.select(&selector).filter_map(|e| e.attr("id")).collect();
    ids.sort_unstable();
    let twice: Vec<&str> = ids.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]).collect();
    assert!(twice.is_empty(), "{twice:?}");
}

/// Rows of the boxes at the top: name, grade, text.
pub(crate) fn statuses(page: &Html) -> Vec<Vec<[String; 3]>> {
    let parse = |s: &str| Selector::parse(s).expect("a selector");
    let text = |e: scraper::ElementRef<'_>, s: &str| -> String {
        let found = e.select(&parse(s)).next().unwrap_or_else(|| panic!("no {s}"));
        found.text().collect::<Vec<_>>().concat().split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let row = |e: scraper::ElementRef<'_>| {
        [text(e, "dt"), e.attr("class").unwrap_or_default().to_string(), text(e, "dd")]
    };
    let of = |e: scraper::ElementRef<'_>| e.select(&parse("dl > div")).map(row).collect();
    page.select(&parse("body > .front > .statuses > .status")).map(of).collect()
}

/// Asserts that the box and the verdict of a page of one scheme or model agree, and that nothing below
/// contradicts them.
fn assert_status(page: &Html, verdict: &str) {
    let boxes = statuses(page);
    assert_eq!(boxes.len(), 1);
    let of = |what: &str| boxes[0].iter().find(|r| r[0] == what);
    let good = |what: &str| of(what).is_none_or(|r| r[1] == "good");
    let whole: String = texts(page, "main").concat();
    // by the rest of the page
    let consistent = !whole.contains("the filter is NOT consistent with this truth:");
    // drifts that are not stated do not limit the verdict
    let valid = !whole.contains("the small-angle model does NOT hold for these drifts: a real platform");
    let prior = whole.contains("known from the prior only") || whole.contains("rests on the prior");
    let limits = |what: &str| of(what).is_some_and(|r| r[1] == "limited");
    assert_eq!((!limits("Filter, one run"), !limits("Small-angle model")), (consistent, valid), "{verdict}");
    assert!(good("Resting on the prior") || prior, "{verdict}");
    let evidence = good("Filter and exact verdicts") && good("Samples and exact verdicts");
    let limited = !(consistent && valid && !prior && evidence);
    assert!(!limited || verdict.contains("Limited: "), "{verdict}");
    // a requirement missed anywhere on the page comes first, and is never a green ok
    let missed = whole.contains(" are NOT met, ");
    let leads = ["Requirements", "With the bench requirements"]
        .iter()
        .any(|who| verdict.starts_with(&format!("{who} are NOT met, ")));
    let graded = of("Requirements").is_some_and(|r| r[1] == "missed");
    assert_eq!(graded, leads, "{verdict}");
    assert!(missed || !leads, "{verdict}");
    assert!(leads || !limited || verdict.starts_with("Limited: "), "{verdict}");
    assert!(!(whole.contains("agrees with all verdicts") && limited), "{verdict}");
    let (confirms, limits) = (verdict.contains("agrees with all verdicts"), verdict.contains("Limited: "));
    let partly = verdict.contains("agrees with the verdicts as far as it shows them");
    assert!(!(confirms && (limits || partly)) && (confirms || limits || partly), "{verdict}");
}

#[test]
#[ignore = "seconds: .ci/run"]
fn every_eighth_example_has_a_report() {
    have_reports(8);
}

/// Reports of all examples: a minute.
#[test]
#[ignore = "full length: .ci/run release"]
fn every_example_has_a_report() {
    have_reports(1);
}

/// Every example answers the questions of a board on its first two pages.
#[test]
#[ignore = "full length: .ci/run release"]
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn every_example_has_a_report_of_two_pages() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(mut browser) = Browser::start() else {
        eprintln!("skipped: no Chromium on this machine");
        return;
    };
    for (i, input) in examples().iter().enumerate() {
        let (file, _) = report(folder.path(), &format!("{i}.html"), &[&input.display().to_string()]);
        assert_on_two_pages(&mut browser, &file);
    }
}

/// Schemes and models of the examples that have reports, in the order of their names.
fn examples() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut inputs: Vec<PathBuf> = (std::fs::read_dir(root).expect("a folder"))
        .map(|e| e.expect("an entry").path())
        .filter(|p| !p.display().to_string().contains("wrong-"))
        .flat_map(|p| ["scheme.toml", "model.toml"].map(|name| p.join(name)))
        .filter(|p| p.is_file())
        .collect();
    inputs.sort();
    assert!(inputs.len() > 15);
    inputs
}

/// Reads the reports of the examples, each `step`th of them in the order of their names.
fn have_reports(step: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut inputs = examples();
    // schemes without numbers or without noise are not simulated
    let bare = ["generic-angles", "influenza", "theophylline"];
    inputs.retain(|p| !bare.iter().any(|name| p.parent().is_some_and(|folder| folder.ends_with(name))));
    for (i, input) in inputs.iter().enumerate().step_by(step) {
        let (_, text) = report(folder.path(), &format!("{i}.html"), &[&input.display().to_string()]);
        let page = Html::parse_document(&text);
        assert!(page.errors.is_empty(), "{}: {:?}", input.display(), page.errors);
        assert_unique_ids(&page);
        assert_questions(&page, 1, &input.display().to_string());
        assert!(text.len() < 2_000_000 && !text.contains("NaN"), "{}", input.display());
        let verdict = texts(&page, "main > p")
            .into_iter()
            .find(|p| p.contains("The scheme determines") || p.contains(" unknowns are observable"))
            .unwrap_or_else(|| panic!("{}: no verdict", input.display()));
        assert!(
            !verdict.contains("DISAGREE") && !verdict.contains("do NOT fit"),
            "{}: {verdict}",
            input.display()
        );
        assert_status(&page, &verdict);
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
    // the command line without its folder
    let origin = texts(&page, "li");
    assert!(origin.contains(&format!("obsdeg report --runs 20 {PAPER}")), "{origin:?}");
    if let Ok(digest) = std::process::Command::new("sha256sum").arg(PAPER).output() {
        let digest = String::from_utf8_lossy(&digest.stdout);
        let digest = digest.split(' ').next().unwrap_or_default();
        assert!(origin.contains(&format!("sha256 of {PAPER}: {digest}")), "{origin:?} {digest}");
    }
    assert_eq!(
        texts(&page, "h2"),
        [
            "Verdict",
            "Positions",
            "What limits it, and what to change",
            "Appendix",
            "How to check this without obsdeg",
            "Notation",
            "About this report",
        ]
    );
    assert_eq!(
        texts(&page, "details.part > summary > h3"),
        [
            "Unknowns",
            "What cannot be told apart",
            "Positions in numbers",
            "How each is solved",
            "Sensitivity",
            "What is not estimated",
            "Evidence by a filter",
            "One run of the filter",
            "Validity of the small-angle model",
            "Assumptions and certainty",
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
    assert!(verdict.starts_with("Limited: 8 of 15 estimates rest on the prior (psi_y, "), "{verdict}");
    assert!(verdict.contains(". The scheme determines 5 of the 12 gyro coefficients"), "{verdict}");
    let required = statuses(&page)[0].iter().find(|r| r[0] == "Requirements").expect("a row").clone();
    assert_eq!(required[2], "open no requirement is stated, so none is judged");
    assert_eq!(verdict.matches(". ").count(), 2, "three sentences: {verdict}");
    // formulas are MathML, pictures need no scripts, ids are unique, no network request
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
#[ignore = "seconds: .ci/run"]
fn a_verdict_leads_with_what_limits_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let five = "examples/five-positions/scheme.toml";
    let page_of = |name: &str, inputs: &[&str]| {
        let page = Html::parse_document(&report(folder.path(), name, inputs).1);
        let verdict = texts(&page, "main > p").into_iter().find(|p| p.contains("The scheme determines"));
        let verdict = verdict.expect("a verdict");
        assert_status(&page, &verdict);
        (page, verdict)
    };
    let row = |page: &Html, what: &str| -> [String; 2] {
        let all = statuses(page).remove(0);
        let [_, grade, text] = all.into_iter().find(|r| r[0] == what).unwrap_or_else(|| panic!("no {what}"));
        [grade, text]
    };
    // psi misses its requirement although every coefficient meets its own
    let stated = ["--requirement", "D=0.1", "--requirement", "psi=0.001"];
    let (page, verdict) = page_of("five.html", &[&[five, "--carry", "inertial"][..], &stated].concat());
    assert!(!verdict.contains("every requirement"), "{verdict}");
    // the margin and the run stand once, in the status
    let missed = "NOT met, 3 of 15 missed: psi_x, psi_y, psi_z";
    assert!(verdict.contains(&format!("{missed}. ")), "{verdict}");
    assert!(row(&page, "Requirements")[1].contains(&format!("{missed}; smallest margin ")), "{verdict}");
    assert_eq!(row(&page, "Requirements")[0], "missed");
    assert_eq!(row(&page, "Observable"), ["good", "ok 12 of 12 gyro coefficients, 3 of 3 of psi"]);
    // met by prediction, missed in the run, whose random drift is not stated: the prediction decides, and the
    // run is mentioned with the reason
    let twelve = ["examples/twelve-positions/scheme.toml", "--requirement", "D=0.02"];
    let (page, _) = page_of("quiet.html", &twelve);
    let [grade, text] = row(&page, "Requirements");
    assert!(
        grade == "good" && text.contains("every requirement is met, 12 of 12; smallest margin "),
        "{grade} {text}"
    );
    assert!(text.contains("; in this run requirements are NOT met, "), "{text}");
    assert!(text.contains("since the run has a random drift of 0.01 deg/h (not stated)"), "{text}");
    // a stated random drift counts in the prediction
    let noisy = [&twelve[..], &["--drift-noise", "0.05 deg/h"]].concat();
    let (page, verdict) = page_of("noise.html", &noisy);
    assert!(verdict.starts_with("Requirements are NOT met, "), "{verdict}");
    assert_eq!(row(&page, "Requirements")[0], "missed");
    // sufficient positions, in the order of the scheme, and their purpose
    let few =
        texts(&page, "li").into_iter().find(|l| l.contains(" of the 12 positions (")).expect("the fewest");
    let names = few.split(['(', ')']).nth(1).expect("names");
    let order: Vec<u32> = names.split(", ").map(|n| n[1..].parse().expect("p1, p2, ...")).collect();
    assert!(order.len() == 5 && order.is_sorted(), "{few}");
    assert!(
        few.contains(") suffice to observe D_FX, ")
            && few.ends_with("meet the requirements is another question"),
        "{few}"
    );
    // small drifts and met requirements: no limits, and only then the filter confirms
    let file = |name: &str, text: &str| -> String {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        path.display().to_string()
    };
    let good = file(
        "good.toml",
        "terms = ['F']\ncarry = 'inertial'\n[simulation]\ndrift_scale = 1e-4\nvalues = { psi = 0.001 }\n\
         priors = { D = 1e5, psi = 10 }\n[requirements]\npsi = 1\n[[position]]\nattitude = 'NUE'\n\
         [[position]]\nattitude = 'UEN'\n",
    );
    let (page, verdict) = page_of("good.html", &[&good]);
    assert!(verdict.starts_with("The scheme determines every one"), "{verdict}");
    assert!(!verdict.contains("requirement"), "{verdict}");
    let [_, text] = row(&page, "Requirements");
    assert!(text.contains("every requirement is met, 3 of 3; smallest margin "), "{text}");
    assert!(text.contains("; in this run every requirement is met, 3 of 3; "), "{text}");
    assert!(statuses(&page)[0].iter().all(|r| r[1] == "good"), "{:?}", statuses(&page));
    // a truth that the linear filter cannot follow
    let (page, verdict) = page_of("exact.html", &[PAPER, "--truth", "exact", "--filter", "linear"]);
    for limit in [
        "is NOT consistent with its truth (mean NIS",
        "the Monte Carlo runs do NOT fit the filter (4 checks)",
    ] {
        let lead = verdict.split(". The scheme").next().unwrap_or_default();
        let lead = lead.strip_prefix("Limited: ").unwrap_or_default();
        assert!(lead.contains(limit), "{limit}: {verdict}");
    }
    assert!(
        row(&page, "Filter and exact verdicts")[1]
            .starts_with("LIMITED agree, but the Monte Carlo runs do NOT fit ")
    );
    assert!(
        !verdict.contains("DISAGREE") && !texts(&page, "main").concat().contains("DISAGREE"),
        "{verdict}"
    );
    // rejected evidence is mentioned at the top too; a rotating segment excites coefficients along its arc
    let turning = file(
        "turning.toml",
        "terms = ['F', 'S']\ncarry = 'inertial'\n[[position]]\nattitude = 'NUE'\n\
         rotation = { about = 'X_p', angle_deg = 90 }\n[[position]]\nattitude = 'UEN'\n",
    );
    let (page, verdict) = page_of("turning.html", &[&turning]);
    assert!(
        verdict.contains("not taken: ") && verdict.contains("accuracy orders are not computed"),
        "{verdict}"
    );
    let why = "this scheme has a rotating segment, and the evidence by a filter takes positions";
    assert_eq!(
        row(&page, "Filter and exact verdicts"),
        ["open".to_string(), format!("open not taken: {why}")]
    );
    let main = texts(&page, "main").concat();
    for sentence in [format!("None: {why}."), format!("note: {why}")] {
        assert!(main.contains(&sentence), "{sentence}: {main}");
    }
    // a model without numbers has no run, and the page says why
    let bare =
        file("bare.toml", "name = 'bare'\n[states]\nx = '-k*x'\n[parameters]\nk = {}\n[outputs]\ny = 'x'\n");
    let alone = Html::parse_document(&report(folder.path(), "bare.html", &[&bare]).1);
    let main = texts(&alone, "main").concat();
    assert!(
        main.contains("no run or no evidence: ") && main.contains("expected one under [simulation"),
        "{main}"
    );
    // of a file for a calibration, which states no noise of its outputs, likewise
    for name in ["influenza", "theophylline"] {
        let model = format!("examples/{name}/model.toml");
        let page = Html::parse_document(&report(folder.path(), &format!("{name}.html"), &[&model]).1);
        let main = texts(&page, "main").concat();
        assert!(main.contains("no run or no evidence: the noise of"), "{main}");
    }
    // D_SZ is excited neither at the start of the turn nor at the second position
    let excited: Vec<[String; 2]> = (table(&page, "Every unknown").iter())
        .filter(|r| r[0].starts_with("D_"))
        .map(|r| [r[0].clone(), r[r.len() - 1].clone()])
        .collect();
    assert!(excited.iter().all(|[_, at]| at != "-"), "{excited:?}");
    // at a pole the dwell determines unknowns that no derivative shows
    let (page, verdict) = page_of("dwell.html", &[five, "--latitude", "90"]);
    let said = "The scheme determines 0 of the 12 gyro coefficients by derivatives, and 12 of them with dwell, \
                during which psi moves. \
                The largest predicted sigma of those is ";
    assert!(
        verdict.contains(said) && !verdict.contains("None of them") && !verdict.contains("cannot tell"),
        "{verdict}"
    );
    let expected =
        "LIMITED by derivatives 0 of 12 gyro coefficients, 3 of 3 of psi; with dwell 12 of 12 and 3 of 3";
    assert_eq!(row(&page, "Observable"), ["limited", expected]);
    let unseen =
        texts(&page, "li").into_iter().filter(|l| l.starts_with("no derivative of Z changes when ")).count();
    assert_eq!(unseen, 2, "the rank by derivatives is 13 of 15");
    assert!(texts(&page, "li").iter().any(|l| {
        l.starts_with("with dwell, during which psi moves, these are determined nonetheless: D_FX, ")
    }));
    assert!(texts(&page, "th").contains(&"rank with dwell".to_string()));
    // the dwell also makes unknowns with a degree undetermined
    let pole = file(
        "pole.toml",
        "latitude_deg = 90\n[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\n\
         angles_deg = [0, 90, 0]\n[[position]]\nangles_deg = [45, 0, 0]\n",
    );
    let (page, verdict) = page_of("pole.html", &[&pole]);
    assert!(
        verdict.contains("with dwell, psi_y are not determined although they have a degree"),
        "{verdict}"
    );
    let psi_y = table(&page, "Every unknown").into_iter().find(|r| r[0] == "psi_y").expect("psi_y");
    assert_eq!([&psi_y[3], &psi_y[4], &psi_y[6]], ["0", "not with dwell", "-"]);
}

#[test]
#[ignore = "seconds: .ci/run"]
fn text_from_files_is_text_in_every_format() {
    let folder = tempfile::tempdir().expect("a folder");
    let scheme = hostile(folder.path(), 12).display().to_string();
    let (_, text) = report(folder.path(), "review.html", &[&scheme, PAPER, MODEL]);
    assert!(text.len() < 2_000_000, "{} bytes", text.len());
    let page = Html::parse_document(&text);
    assert!(page.errors.is_empty(), "{:?}", page.errors);
    assert!(!text.contains("<script>alert"), "a script of the input");
    let title = texts(&page, "h1").remove(0);
    assert!(title.contains(HOSTILE), "{title}");
    assert!(texts(&page, "main > details > p").iter().any(|p| p == HOSTILE));
    assert!(texts(&page, "td").iter().any(|c| c == "q_3"));
    // several inputs: a comparison, then a folded part for each
    let parts = texts(&page, "h2");
    assert_eq!(parts.len(), 7, "{parts:?}");
    assert_eq!(parts[0], "Comparison of the schemes");
    assert_eq!(texts(&page, "main > details:not([open]) > summary > h2"), parts);
    assert!(parts[1].starts_with("Scheme ") && parts[3].starts_with("Model "), "{parts:?}");
    assert!(table(&page, "Margins (required").len() > 5);
    assert!(texts(&page, ".front th").iter().any(|head| head == HOSTILE));
    // a box for each input at the top; tables in formats without boxes
    let titles = texts(&page, ".status > .heading");
    let titles: Vec<&String> = titles.iter().filter(|t| *t != "Recommended action").collect();
    assert_eq!(titles, ["Comparison of 2 schemes", HOSTILE, "paper-p1-p2", "two compartments, one sampled"]);
    assert!(text.find("class=\"statuses\"") < text.find("<main>"), "at the top");

    let scheme = hostile(folder.path(), 5).display().to_string();
    let (file, text) = report(folder.path(), "review.md", &[&scheme]);
    assert!(!text.contains("<script>") && text.contains("\\<script\\>"), "markup in Markdown");
    assert!(text.contains("\n## Status: ") && text.contains("| Small-angle model | "));
    let first =
        std::fs::read(file.with_file_name("review_figures").join("s1_staircase.svg")).expect("a picture");
    // a second report in the same folder has separate pictures, and both show all of theirs
    let (_, other) = report(folder.path(), "b.md", &["examples/simulated-run/scheme.toml"]);
    let shown = |text: &str| -> Vec<String> {
        let pictures = text.split("](").skip(1).filter_map(|t| t.split(')').next());
        pictures.filter(|p| p.ends_with(".svg")).map(str::to_string).collect()
    };
    // rounded times
    let starts: Vec<&str> = (other.split(" from ").skip(1).filter_map(|t| t.split_once(" s").map(|t| t.0)))
        .filter(|t| t.parse::<f64>().is_ok())
        .collect();
    assert!(starts.len() > 5, "{starts:?}");
    assert!(
        starts.iter().all(|t| t.split_once('.').is_none_or(|(_, digits)| digits.len() == 1)),
        "{starts:?}"
    );
    for (text, own) in [(&text, "review_figures/"), (&other, "b_figures/")] {
        let pictures = shown(text);
        assert!(
            pictures.len() > 10
                && pictures.iter().all(|p| p.starts_with(own) && folder.path().join(p).is_file())
        );
    }
    assert!(
        first == std::fs::read(folder.path().join("review_figures/s1_staircase.svg")).expect("still there")
    );
    assert!(first != std::fs::read(folder.path().join("b_figures/s1_staircase.svg")).expect("its own"));
    let other = tempfile::tempdir().expect("a folder");
    let scheme = hostile(folder.path(), 3).display().to_string();
    let (file, text) = report(other.path(), "review.tex", &[&scheme]);
    assert_eq!(text.matches("\\end{document}").count(), 1);
    assert!(text.contains("\\paragraph{Status: ") && text.contains("Small-angle model & "));
    assert!(text.contains("\\$a\\_b\\textasciicircum{}c\\$ \\#let \\textbackslash{}end\\{document\\}"));
    assert!(file.with_file_name("review_figures").join("s1_staircase.pdf").is_file());
}

#[test]
fn what_cannot_be_reported_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let refused = |arguments: &[&str], what: &str| {
        let output = run(&[&["report"], arguments].concat());
        let said = stderr(&output);
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
    refused(&["examples/wrong-models/unknown-name.toml", "-o", &at("a.html")], "did you mean");
    refused(&["examples/wrong-gimbals/scheme.toml", PAPER, "-o", &at("a.html")], "wrong-gimbals");
    assert_eq!(std::fs::read_to_string(at("taken.html")).expect("still there"), "mine");
    if cfg!(not(feature = "pdf")) {
        refused(&[PAPER, "-o", &at("a.pdf"), "--pdf-by", "typesetter"], "a build with `--features pdf`");
    }
    let nowhere = at("no-browser");
    refused(&[PAPER, "-o", &at("a.pdf"), "--pdf-by", &nowhere], "expected browser, typesetter, or the path");
    refused(&[PAPER, "-o", &at("a.html"), "--pdf-by", "browser"], "--pdf-by does nothing without a PDF");
}

/// The page as a browser of this computer prints it: the same bytes twice, with its texts, and the browser
/// named.
#[test]
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
#[ignore = "seconds: .ci/run release"]
fn a_browser_prints_the_pdf() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("review.pdf");
    let print = || {
        let path = file.display().to_string();
        run(&["report", PAPER, "--runs", "20", "--pdf-by", "browser", "--force", "-o", &path])
    };
    let printed = print();
    if stderr(&printed).contains("--pdf-by browser: none was found") {
        eprintln!("skipped: no browser on this machine");
        return;
    }
    assert!(printed.status.success() && stderr(&printed).contains("printed by "), "{}", stderr(&printed));
    let once = std::fs::read(&file).expect("written");
    assert!(once.starts_with(b"%PDF-"));
    assert!(print().status.success());
    assert!(once == std::fs::read(&file).expect("written"), "the same command gives the same bytes");
    let Ok(text) = std::process::Command::new("pdftotext").arg(&file).arg("-").output() else { return };
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    for part in ["Design review: paper-p1-p2", "What limits it, and what to change", "About this report"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[cfg(feature = "pdf")]
#[test]
#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn the_pdf_holds_every_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let scheme = hostile(folder.path(), 12).display().to_string();
    let inputs = [scheme.as_str(), PAPER, MODEL];
    let typeset = [&inputs[..], &["--pdf-by", "typesetter"]].concat();
    let (file, _) = report(folder.path(), "review.pdf", &typeset);
    let (again, _) = report(folder.path(), "again.pdf", &typeset);
    let bytes = std::fs::read(&file).expect("written");
    assert!(bytes.starts_with(b"%PDF-"));
    assert!(bytes == std::fs::read(&again).expect("written"), "the same command gives the same bytes");
    let pdftotext = &mut std::process::Command::new("pdftotext");
    let Ok(out) = pdftotext.arg("-layout").arg(&file).arg("-").output() else {
        eprintln!("skipped: no pdftotext on this machine");
        return;
    };
    assert!(out.status.success());
    // every cell and heading of the page is in the PDF, apart from hyphens and line breaks
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

/// A scheme whose coefficients no dwell determines has no curve of sigma against time.
#[test]
fn schemes_that_determine_nothing_have_no_front() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("one.toml");
    std::fs::write(&file, "terms = [\"F\", \"I\", \"O\", \"S\"]\n[[position]]\nangles_deg = [0, 0, 0]\n")
        .expect("written");
    let file = file.display().to_string();
    let (_, text) = report(folder.path(), "r.html", &[&file, &file]);
    assert!(!text.contains("Pareto front"), "nothing to draw");
    let (_, text) = report(folder.path(), "s.html", &[PAPER, PAPER]);
    assert!(text.contains("Pareto front"));
}

/// With one proven solution the box of a model does not call it local.
#[test]
fn a_model_says_how_many_solutions_there_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let observable = |name: &str, model: &str| {
        let (_, text) = report(folder.path(), name, &[model]);
        let boxes = statuses(&Html::parse_document(&text));
        boxes[0].iter().find(|r| r[0] == "Observable").expect("a row")[2].clone()
    };
    let one = folder.path().join("one.toml");
    std::fs::write(&one, "name='one'\nparameters=['k']\n[states]\nx='-k*x'\n[outputs]\ny='x'\n")
        .expect("written");
    assert_eq!(
        observable("one.html", &one.display().to_string()),
        "ok 2 of 2 unknowns: each with one solution"
    );
    std::fs::write(&one, "name='two'\n[states]\nx='0'\n[outputs]\ny='x^2'\n").expect("written");
    assert_eq!(observable("two.html", &one.display().to_string()), "ok 1 of 1 unknowns: locally");
    std::fs::write(&one, "name='both'\n[states]\nx='0'\nz='0'\n[outputs]\ny='x^2'\nv='z'\n")
        .expect("written");
    let both = observable("both.html", &one.display().to_string());
    assert_eq!(both, "ok 2 of 2 unknowns: 1 with one solution, the others locally");
}

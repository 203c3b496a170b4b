//! The page of `crates/web` in a real browser, from disk: actions of its tests.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::browser::Browser;

pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Page under test.
struct Page {
    path: PathBuf,
    /// Program that answers a draft's questions until its input, which it shares with the tests, ends.
    _engine: Option<Child>,
}

/// Builds the page from the current sources: as users have it if it was built here before (`cargo run -p
/// obsdeg-web`, minutes of compilation for another target), else a draft, whose engine is the program that
/// writes it.
fn page() -> Page {
    // with the features of the whole workspace and of tests (an example has them): nothing is compiled again
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let built = Command::new(cargo)
        .args(["build", "-q", "--workspace", "--bin", "workbench", "--example", "verdicts"])
        .current_dir(root())
        .status();
    assert!(built.expect("cargo runs").success(), "the builder of the page is built");
    let mut builder = Command::new(Path::new(env!("CARGO_BIN_EXE_obsdeg")).with_file_name("workbench"));
    builder.current_dir(root());
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    if root().join("target/workbench.html").is_file() {
        let path = folder.join("workbench.html");
        assert!(builder.arg(&path).status().expect("it runs").success(), "the page is built");
        return Page { path, _engine: None };
    }
    let path = folder.join("draft.html");
    let mut engine = builder
        .arg("--draft")
        .arg(&path)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the draft is written");
    let mut said = String::new();
    let out = engine.stdout.as_mut().expect("a pipe");
    BufReader::new(out).read_line(&mut said).expect("a line");
    assert!(said.contains("the engine is this program"), "{said}");
    Page { path, _engine: Some(engine) }
}

/// True if the page under test is the one that users have, with the engine as WebAssembly.
pub(crate) fn is_built(page: &Path) -> bool {
    page.file_name().is_some_and(|name| name == "workbench.html")
}

/// Opens the page. `None` without a browser.
#[expect(clippy::print_stderr, reason = "a skipped test says why")]
pub(crate) fn opened(width: u32) -> Option<(Browser, &'static Path)> {
    static PAGE: OnceLock<Page> = OnceLock::new();
    let Some(mut browser) = Browser::start() else {
        eprintln!("skipped: no Chromium on this machine");
        return None;
    };
    let page = &PAGE.get_or_init(page).path;
    browser.open(page, width, 1000);
    ready(&mut browser);
    Some((browser, page))
}

/// Saves downloads of the page in a folder.
pub(crate) fn save_in(browser: &mut Browser, folder: &Path) {
    let context = browser.context.clone();
    let saved = json!({ "behavior": "allow", "downloadPath": folder, "browserContextId": context });
    browser.call("Browser.setDownloadBehavior", saved);
}

pub(crate) fn wait(browser: &mut Browser, what: &str, condition: &str) {
    let patience = Instant::now() + Duration::from_secs(120);
    while browser.value(&format!("!!({condition})")) != json!(true) {
        if Instant::now() > patience {
            let page = browser.value("document.body.innerText.slice(0, 3000)");
            panic!("{what}: {condition} does not come true\n{}", page.as_str().unwrap_or_default());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

pub(crate) fn ready(browser: &mut Browser) {
    wait(browser, "start", "document.querySelector('#verdicts tbody tr')");
}

const CELL: &str = "(name, column) => document.querySelector(`#verdicts tr[data-name=\"${name}\"]`)\
                    ?.children[column]?.textContent";

/// Waits until a cell of the table of verdicts has the given text.
pub(crate) fn says(browser: &mut Browser, name: &str, column: usize, text: &str) {
    let condition = format!("({CELL})({name:?}, {column})?.startsWith({text:?})");
    wait(browser, name, &condition);
}

/// Condition that a field is marked as wrong, for a reason that contains `text`.
pub(crate) fn wrong(id: &str, text: &str) -> String {
    format!(
        "(f => f.getAttribute('aria-invalid') == 'true' && \
         f.getAttribute('aria-describedby').split(' ').includes('{id}-wrong') && \
         document.getElementById('{id}-wrong').textContent.includes({text:?}))(document.getElementById({id:?}))"
    )
}

pub(crate) fn click(browser: &mut Browser, selector: &str) {
    browser.mouse(selector, true);
}

/// Types into a field and leaves it.
pub(crate) fn write(browser: &mut Browser, selector: &str, text: &str) {
    browser.value(&format!(
        "document.querySelector({selector:?}).focus(), document.querySelector({selector:?}).select?.(), 1"
    ));
    browser.call("Input.insertText", json!({ "text": text }));
    browser.value(&format!("document.querySelector({selector:?}).blur(), 1"));
    browser.settle();
}

pub(crate) fn choose(browser: &mut Browser, selector: &str, value: &str) {
    browser.value(&format!(
        "(() => {{ const e = document.querySelector({selector:?}); e.value = {value:?}; e.dispatchEvent(new \
         Event('change', {{ bubbles: true }})); }})()"
    ));
}

pub(crate) fn key(browser: &mut Browser, key: &str, code: u32, modifiers: u32) {
    for kind in ["rawKeyDown", "keyUp"] {
        let event = json!({
            "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code, "modifiers": modifiers
        });
        browser.call("Input.dispatchKeyEvent", event);
    }
    browser.settle();
}

/// Drags the mouse from one point to another in `steps` steps.
pub(crate) fn drag(browser: &mut Browser, from: [f64; 2], to: [f64; 2], steps: usize, pause: Duration) {
    let mut event = |kind: &str, [x, y]: [f64; 2], buttons: u32| {
        let button = if buttons == 0 && kind == "mouseMoved" { "none" } else { "left" };
        let at =
            json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1 });
        browser.call("Input.dispatchMouseEvent", at);
    };
    event("mouseMoved", from, 0);
    event("mousePressed", from, 1);
    for i in 1..=steps {
        let part = i as f64 / steps as f64;
        event("mouseMoved", [0, 1].map(|k| from[k] + part * (to[k] - from[k])), 1);
        std::thread::sleep(pause);
    }
    event("mouseReleased", to, 0);
    browser.settle();
}

/// Moves a finger from one point to another.
pub(crate) fn swipe(browser: &mut Browser, from: [f64; 2], to: [f64; 2]) {
    let mut event = |kind: &str, points: Value| {
        browser.call("Input.dispatchTouchEvent", json!({ "type": kind, "touchPoints": points }));
    };
    let at = |part: f64| {
        let [x, y] = [0, 1].map(|k| from[k] + part * (to[k] - from[k]));
        json!([{ "x": x, "y": y }])
    };
    event("touchStart", at(0.0));
    for i in 1..=10 {
        event("touchMove", at(f64::from(i) / 10.0));
    }
    event("touchEnd", json!([]));
    browser.settle();
}

/// Left, top, width and height (pixels) of an element after scrolling to it.
pub(crate) fn place(browser: &mut Browser, selector: &str) -> [f64; 4] {
    let look = format!(
        "(() => {{ const e = document.querySelector({selector:?}); e.scrollIntoView({{ block: 'center' }}); \
         const r = e.getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; }})()"
    );
    // late answers move what is below them: the place is taken once it stays
    let mut place = browser.value(&look);
    for _ in 0..40 {
        browser.settle();
        let before = std::mem::replace(&mut place, browser.value(&look));
        if before == place {
            break;
        }
    }
    [0, 1, 2, 3].map(|k| place[k].as_f64().expect("a number"))
}

pub(crate) fn thumb(browser: &mut Browser, axis: &str, value: f64) -> [f64; 2] {
    let [x, y, w, h] = place(browser, &format!("#{axis}"));
    [x + 8.0 + (w - 16.0) * (value + 180.0) / 360.0, y + h / 2.0]
}

pub(crate) fn scheme(browser: &mut Browser) -> String {
    browser.value("obsdeg.scheme()").as_str().expect("TOML").into()
}

pub(crate) fn names(browser: &mut Browser) -> Value {
    browser.value("[...document.querySelectorAll('#positions .name')].map(b => b.textContent)")
}

/// Asserts that the page wrote nothing to the console and made no network request (a draft's worker asks its
/// engine, which the page itself does not).
pub(crate) fn quiet(browser: &Browser) {
    for event in &browser.events {
        let (method, of) = (event["method"].as_str().unwrap_or_default(), &event["params"]);
        for bad in ["Runtime.exceptionThrown", "Log.entryAdded", "Runtime.consoleAPICalled"] {
            assert_ne!(method, bad, "{of}");
        }
        if method == "Network.requestWillBeSent" {
            let url = of["request"]["url"].as_str().unwrap_or_default();
            let page = ["workbench.html", "draft.html"].iter().any(|name| url.contains(name));
            let own = url.starts_with("data:") || url.starts_with("blob:") || page;
            assert!(own, "{url}");
        }
    }
}

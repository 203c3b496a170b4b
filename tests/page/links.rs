//! Foreign links to the page: names, numbers, keys and sizes inject nothing into the page, and end in a
//! message or in a scheme.

use serde_json::{Value, json};

use crate::browser::Browser;
use crate::opened::{opened, quiet, scheme, wait};

/// Scheme file with two positions, `before` in front of them and `within` in the first.
fn file(before: &str, within: &str) -> String {
    format!(
        "{before}\n[[position]]\nangles_deg = [0, 0, 0]\n{within}\n[[position]]\nangles_deg = [180, 0, 0]\n"
    )
}

/// Texts of links with the expected text of the page.
fn hostile() -> Vec<(String, &'static str)> {
    const IMAGE: &str = "<img src=x onerror='window.hacked=1'>";
    let mut out = Vec::new();
    // names
    for name in [
        IMAGE,
        "</script><script>window.hacked=1</script>",
        "<svg onload=window.hacked=1>",
        "' onmouseover=window.hacked=1 x=`${window.hacked=1}`",
        "\\u202E\\u0000x",
        &"n".repeat(10_000),
    ] {
        out.push((file("", &format!("name = \"{name}\"")), "expected up to 64 letters"));
    }
    out.push((file(&format!("[requirements]\n\"{IMAGE}\" = 1"), ""), "no such unknown"));
    out.push((file(&format!("description = \"{IMAGE}\""), ""), "is open"));
    out.push((file(&format!("name = \"{IMAGE}\""), ""), "is open"));
    out.push((file("name = \"javascript:window.hacked=1\"", ""), "is open"));
    // numbers
    for (angle, said) in [
        ("nan", "is not finite"),
        ("inf", "is not finite"),
        ("1e308", "is not a number"),
        ("999999999999999999999999", "found the number"),
        ("\"<b>\"", "is not a number"),
    ] {
        out.push((format!("[[position]]\nangles_deg = [{angle}, 0, 0]\n"), said));
    }
    for dwell in ["-1", "1e300", "0.0000000001"] {
        out.push((file("", &format!("dwell_s = {dwell}")), "is not a dwell"));
    }
    out.push((file("latitude_deg = 1e400", ""), "overflowed"));
    // keys
    for key in ["__proto__", "constructor", "toString", "hasOwnProperty"] {
        out.push((file(&format!("{key} = {{ hacked = 1 }}"), ""), "unknown key"));
        out.push((file("", &format!("\"{key}\" = {{ hacked = 1 }}")), "unknown key"));
        out.push((file(&format!("[requirements]\n\"{key}\" = 1"), ""), "no such unknown"));
    }
    // sizes
    let one = "[[position]]\nangles_deg = [0, 0, 0]\n";
    out.push((one.repeat(1001), "expected at most 1000"));
    out.push((format!("x = {}{}", "[".repeat(5000), "]".repeat(5000)), "recur"));
    out.push((format!("[a{}]", ".a".repeat(5000)), "recursion"));
    out.push((format!("# {}\n{}", "x".repeat(400_000), file("", "")), "expected at most 400000"));
    let model = |equation: &str| format!("name = \"m\"\n[states]\n{equation}\n[outputs]\ny = \"1\"\n");
    out.push((model(&format!("x = \"{}\"", "(".repeat(5000))), "nested more than 200 deep"));
    out
}

/// Opens a link and waits for the expected text.
fn link(browser: &mut Browser, part: &str, said: &str) {
    browser.value("document.getElementById('notice').textContent = '', 1");
    browser.value(&format!("location.hash = 'scheme=' + {part}, 1"));
    let notice = "document.getElementById('notice').textContent";
    wait(browser, said, &format!("{notice}.includes({})", json!(said)));
    let inside = "[window.hacked ?? null, ({}).hacked ?? null, \
                  document.querySelectorAll('img, script[src], [onerror], [onload], [onmouseover]').length]";
    assert_eq!(browser.value(inside), json!([null, null, 0]), "{said}");
    assert!(scheme(browser).contains("[[position]]"), "{said}");
}

#[test]
fn links_of_others_put_nothing_into_the_page() {
    let Some((mut browser, _)) = opened(1200) else { return };
    let b = &mut browser;
    // the same encoding as the page's
    b.value(
        "window.packedText = (text) => btoa(Array.from(new TextEncoder().encode(text), (b) => String.fromCharCode(b))\
         .join(''))\
         .replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', ''), 1",
    );
    for (text, said) in hostile() {
        link(b, &format!("window.packedText({})", json!(text)), said);
    }
    for part in ["%%%", "!!!", "_w", "%00", "%F0%9F", "<script>"] {
        link(b, &json!(part).to_string(), "This link is damaged");
    }
    let dialogs = |event: &&Value| event["method"] == json!("Page.javascriptDialogOpening");
    assert_eq!(b.events.iter().filter(dialogs).count(), 0);
    quiet(b);
}

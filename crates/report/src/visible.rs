//! Texts with invisible characters written out.

use std::borrow::Cow;

/// Text on one line, with characters that a reader cannot see written out, as `\u{1b}`. These are control
/// characters, which may act on a terminal and are not allowed in pictures and pages; marks that change the
/// direction of writing; and code points that are no characters. Line breaks and tabs become blanks.
///
/// ```
/// use obsdeg_report::visible;
/// assert_eq!(visible("D_FX \u{1b}[31m"), "D_FX \\u{1b}[31m");
/// assert_eq!(visible("two\nlines"), "two lines");
/// ```
pub fn visible(text: &str) -> Cow<'_, str> {
    if !text.contains(hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\n' | '\r' | '\t' => out.push(' '),
            c if hidden(c) => out.extend(c.escape_unicode()),
            c => out.push(c),
        }
    }
    Cow::Owned(out)
}

/// Visible text of an SVG or a page, with its characters `&`, `<`, `>` written as entities.
pub(crate) fn escaped(text: &str) -> String {
    visible(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn hidden(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
        || matches!(c, '\u{fff9}'..='\u{fffb}' | '\u{fffe}' | '\u{ffff}')
}

/// JSON with the same characters as `\u001b`, which parses to the original text.
pub(crate) fn json(answer: &impl serde::Serialize) -> Result<String, serde_json::Error> {
    let text = serde_json::to_string_pretty(answer)?;
    let is_hidden = |c: char| c != '\n' && hidden(c);
    let mut out = String::with_capacity(text.len() + 1);
    for c in text.chars() {
        if is_hidden(c) {
            out.push_str(&format!("\\u{:04x}", u32::from(c)));
        } else {
            out.push(c);
        }
    }
    Ok(out + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stays_and_the_rest_is_written_out() {
        for text in ["D_FX", "µ ω ½ 惯性平台 é", "a\\u{1b}", "𝛼 \u{1f600}"] {
            assert_eq!(visible(text), text);
        }
        let characters = "\0\u{7}\u{8}\u{1b}\u{7f}\u{85}\u{9b}\u{9d}\u{61c}\u{200e}\u{200f}\u{2028}\u{202a}\u{202e}\
                          \u{2066}\u{2069}\u{ffff}";
        for c in characters.chars() {
            assert_eq!(visible(&format!("a{c}b")), format!("a\\u{{{:x}}}b", u32::from(c)));
        }
    }

    #[test]
    fn json_reads_as_what_it_was() {
        let nasty: String =
            (0..0x300).chain(0x2000..0x2070).chain([0xffff, 0x1f600]).filter_map(char::from_u32).collect();
        let text = json(&nasty).expect("JSON");
        assert_eq!(text.trim_end().chars().find(|&c| hidden(c)), None);
        assert_eq!(serde_json::from_str::<String>(&text).expect("JSON"), nasty);
    }
}

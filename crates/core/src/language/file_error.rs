//! Errors of TOML and JSON readers, in the words of the file's author.

use std::ops::Range;

use schemars::{JsonSchema, schema_for};

use super::expression::{goes_on, nearest};

/// Longest part of a file that is repeated in a message, in characters.
const SHOWN: usize = 40;

/// Message and byte range of the error in a TOML file of the layout `T`.
pub(crate) fn explain<T: JsonSchema>(text: &str, e: &toml::de::Error) -> (String, Option<Range<usize>>) {
    let span = e.span().filter(|s| text.get(s.clone()).is_some());
    let message = e.message().trim();
    if let Some(found) =
        span.clone().and_then(|s| decimal_comma(text, s.clone()).or_else(|| without_commas(text, s)))
    {
        return (found.0, Some(found.1));
    }
    if let Some((word, place)) = span.clone().and_then(|s| unquoted(text, s)) {
        return (
            format!("`{word}` has no quotes; expected a text such as \"{word}\", or a number"),
            Some(place),
        );
    }
    let header = |s: &Range<usize>| text[s.clone()].trim_matches(['[', ']']).trim().to_string();
    match &span {
        // `[position]`
        Some(s)
            if message.starts_with("invalid type: map, expected a sequence")
                && text[s.clone()].starts_with('[') =>
        {
            let name = header(s);
            (
                format!("`[{name}]` is one table; expected a list of tables, each beginning with [[{name}]]"),
                span,
            )
        }
        _ => (misplaced::<T>(message).unwrap_or_else(|| explain_message(message)), span),
    }
}

/// Message for a key that belongs to another table of the layout.
fn misplaced<T: JsonSchema>(message: &str) -> Option<String> {
    let (found, rest) = quoted(message.strip_prefix("unknown field ")?)?;
    let here = names(rest);
    let elsewhere = other_tables(schema_for!(T).as_value(), &here);
    let keys: Vec<String> = elsewhere.iter().map(|(key, _)| key.clone()).collect();
    let surely = |keys: &[String]| keys.iter().find(|k| *k == found || goes_on(found, k)).cloned();
    let key = match (surely(&here), surely(&keys)) {
        (None, Some(key)) => key,
        _ => nearest(found, &keys).filter(|_| nearest(found, &here).is_none())?,
    };
    let places: Vec<&str> = elsewhere.iter().filter(|(k, _)| *k == key).map(|(_, p)| p.as_str()).collect();
    let (found, places) = (shortened(found), places.join(" or "));
    Some(format!("unknown key `{found}` here; `{key}` belongs {places} (expected {})", here.join(", ")))
}

/// Keys of the tables of a layout, each with its place, except for the table with the keys `here`.
fn other_tables(schema: &serde_json::Value, here: &[String]) -> Vec<(String, String)> {
    let keys = |table: &serde_json::Value| -> Vec<String> {
        table["properties"].as_object().map(|p| p.keys().cloned().collect()).unwrap_or_default()
    };
    let table = |entry: &serde_json::Value| {
        let name = entry["$ref"].as_str()?.strip_prefix("#/$defs/")?;
        Some(&schema["$defs"][name])
    };
    let top = (keys(schema), "at the top of the file, before the first table".to_string());
    let parts = schema["properties"].as_object().into_iter().flatten().filter_map(|(name, entry)| {
        let one = table(entry).map(|t| (keys(t), format!("in [{name}]")));
        one.or_else(|| table(&entry["items"]).map(|t| (keys(t), format!("in [[{name}]]"))))
    });
    std::iter::once(top)
        .chain(parts)
        .filter(|(keys, _)| !keys.iter().all(|k| here.contains(k)))
        .flat_map(|(keys, place)| keys.into_iter().map(move |k| (k, place.clone())))
        .collect()
}

/// Message for `48,5` where one number is expected.
fn decimal_comma(text: &str, span: Range<usize>) -> Option<(String, Range<usize>)> {
    let number = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '_');
    let before = text[..span.start].trim_end_matches(number);
    let fraction = text[span.start..].strip_prefix(',')?;
    let digits = fraction.len() - fraction.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let end = span.start + 1 + digits;
    let whole = &text[before.len()..span.start];
    let alone = text[end..]
        .split('\n')
        .next()
        .is_some_and(|rest| matches!(rest.trim().chars().next(), None | Some('#')));
    let found = before.trim_end().ends_with('=') && !whole.is_empty() && digits > 0 && alone;
    found.then(|| {
        let point = format!("{whole}.{}", &fraction[..digits]);
        (
            format!("`{whole},{}` has a comma; expected a decimal point, as in {point}", &fraction[..digits]),
            before.len()..end,
        )
    })
}

/// Message for `0 0 0` in a list.
fn without_commas(text: &str, span: Range<usize>) -> Option<(String, Range<usize>)> {
    let list = text[..span.start].trim_end().ends_with(['[', ',']);
    let words: Vec<&str> = text[span.clone()].split_whitespace().collect();
    let numbers = words.len() > 1 && words.iter().all(|w| w.parse::<f64>().is_ok());
    (list && numbers).then(|| {
        let found = shortened(&text[span.clone()]);
        (
            format!("`{found}` has no commas; expected commas between the values of a list, as in [0, 0, 0]"),
            span,
        )
    })
}

/// Message of a reader about keys and kinds, in words.
pub fn explain_message(message: &str) -> String {
    unknown_key(message)
        .or_else(|| unknown_value(message))
        .or_else(|| missing(message))
        .or_else(|| wrong_kind(message))
        .unwrap_or_else(|| syntax(message))
}

/// Kind of a JSON value in words, by the beginning of its text.
pub(crate) fn json_kind(text: &str) -> &'static str {
    match text.as_bytes().first() {
        Some(b'"') => "a text",
        Some(b'{') => "an object",
        Some(b'[') => "a list",
        Some(b't' | b'f') => "true or false",
        Some(b'n') => "null",
        _ => "a number",
    }
}

/// Name in backquotes at the start of a text, and the text after it.
fn quoted(text: &str) -> Option<(&str, &str)> {
    text.strip_prefix('`')?.split_once('`')
}

/// Names in backquotes in a list.
fn names(list: &str) -> Vec<String> {
    list.split('`').skip(1).step_by(2).map(String::from).collect()
}

fn hint(found: &str, known: &[String]) -> String {
    nearest(found, known).map(|h| format!("; did you mean `{h}`?")).unwrap_or_default()
}

fn unknown_key(message: &str) -> Option<String> {
    let (found, rest) = quoted(message.strip_prefix("unknown field ")?)?;
    let known = names(rest);
    let hint = hint(found, &known);
    Some(format!("unknown key `{}`{hint} (expected {})", shortened(found), known.join(", ")))
}

fn unknown_value(message: &str) -> Option<String> {
    let (found, rest) = quoted(message.strip_prefix("unknown variant ")?)?;
    let known = names(rest);
    let hint = hint(found, &known);
    Some(format!("`{}` is no choice here{hint} (expected {})", shortened(found), known.join(", ")))
}

fn missing(message: &str) -> Option<String> {
    let (name, _) = quoted(message.strip_prefix("missing field ")?)?;
    Some(format!("the key `{name}` is missing; expected it in this table"))
}

/// Message for a value of the wrong kind: `invalid type: string "5", expected f64`.
fn wrong_kind(message: &str) -> Option<String> {
    let rest = ["invalid type: ", "invalid value: ", "invalid length "]
        .iter()
        .find_map(|p| message.strip_prefix(p))?;
    let (found, expected) = rest.rsplit_once(", expected ")?;
    let found = match found.split_once(' ') {
        Some(("string", text)) => format!("the text {}", shortened(text)),
        Some(("integer", x)) => format!("the number {}", x.trim_matches('`')),
        Some(("floating", x)) => format!("the number {}", x.trim_start_matches("point ").trim_matches('`')),
        Some(("boolean", x)) => x.trim_matches('`').to_string(),
        _ if found == "map" => "a table".into(),
        _ if found == "sequence" => "a list".into(),
        _ => shortened(found),
    };
    let expected = match expected {
        "f64" | "f32" => "a number".into(),
        "usize" | "u64" | "u32" | "u16" | "u8" => "a whole number, not negative".into(),
        "i64" | "i32" | "i16" => "a whole number".into(),
        "a string" | "string or map" => "a text in quotes".into(),
        "a boolean" => "true or false".into(),
        "a sequence" => "a list in [ ]".into(),
        "a map" => "a table".into(),
        other if other.starts_with("struct ") => "a table".into(),
        other => other.to_string(),
    };
    Some(format!("found {found}; expected {expected}"))
}

fn shortened(text: &str) -> String {
    if text.chars().count() <= SHOWN {
        return text.into();
    }
    text.chars().take(SHOWN).collect::<String>() + "..."
}

/// Message for a text that violates the grammar of TOML.
fn syntax(message: &str) -> String {
    if message.starts_with("string values must be quoted") {
        return "found neither a number nor a text in quotes; expected one of them".into();
    }
    let lines: Vec<&str> = message.lines().map(str::trim).collect();
    lines.join("; ")
}

/// Message for a bare word where a value is expected.
fn unquoted(text: &str, span: Range<usize>) -> Option<(String, Range<usize>)> {
    let line = text[..span.start].rfind('\n').map_or(0, |i| i + 1);
    let before = text[line..span.start].trim_end();
    if !before.ends_with(['=', '[', ',']) || before.starts_with('[') {
        return None;
    }
    let rest = text[span.start..].split(['\n', ',', ']', '}', '#']).next()?.trim_end();
    let known = ["true", "false", "inf", "nan"].contains(&rest.trim_start_matches(['+', '-']));
    let bare = rest.starts_with(char::is_alphabetic) && !known && !rest.contains(['"', '\'', '=']);
    bare.then(|| (shortened(rest), span.start..span.start + rest.len()))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "what is read does not matter here")]
    struct Inner {
        depth_m: f64,
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "what is read does not matter here")]
    struct ExampleFile {
        carry: String,
        #[serde(default)]
        step: f64,
        #[serde(default)]
        list: Vec<String>,
        #[serde(default)]
        table: BTreeMap<String, usize>,
        #[serde(default)]
        choice: Option<crate::model::Carry>,
        #[serde(default)]
        inner: Vec<Inner>,
    }

    #[test]
    fn complaints_are_in_words_and_know_their_place() {
        let said = |text: &str| {
            let e = toml::from_str::<ExampleFile>(text).expect_err("wrong");
            let (message, span) = explain::<ExampleFile>(text, &e);
            (message, span.map(|s| text[s].to_string()))
        };
        let at = |text: &str, message: &str, place: &str| {
            assert_eq!(said(text), (message.into(), Some(place.into())))
        };
        let quotes = |w: &str| format!("`{w}` has no quotes; expected a text such as \"{w}\", or a number");
        at("carry = inertial", &quotes("inertial"), "inertial");
        at("carry = 'a'\nlist = [NUE]", &quotes("NUE"), "NUE");
        at("carry = sideways # so\n", &quotes("sideways"), "sideways");
        at("carry = 'a'\nstep = '5'", "found the text \"5\"; expected a number", "'5'");
        at("carry = 5", "found the number 5; expected a text in quotes", "5");
        at("carry = true", "found true; expected a text in quotes", "true");
        at("carry = 'a'\nlist = 2", "found the number 2; expected a list in [ ]", "2");
        at(
            "carry = 'a'\ntable = {a = -1}",
            "found the number -1; expected a whole number, not negative",
            "-1",
        );
        at(
            "carry = 'a'\n[list]\na = 1",
            "`[list]` is one table; expected a list of tables, each beginning with [[list]]",
            "[list]",
        );
        at("carry = 'a'\ntable = []", "found a list; expected a table", "[]");
        at(
            "carry = 'a'\nchoice = 'inertal'",
            "`inertal` is no choice here; did you mean `inertial`? (expected platform, inertial, reset)",
            "'inertal'",
        );
        let keys = "carry, step, list, table, choice, inner";
        at(
            "carry = 'a'\nstp = 1",
            &format!("unknown key `stp`; did you mean `step`? (expected {keys})"),
            "stp",
        );
        at("carry = 'a'\nfoo = 1", &format!("unknown key `foo` (expected {keys})"), "foo");
        let misplaced = |found: &str, key: &str, place: &str, keys: &str| {
            format!("unknown key `{found}` here; `{key}` belongs {place} (expected {keys})")
        };
        let top = "at the top of the file, before the first table";
        at("[[inner]]\nstep = 1", &misplaced("step", "step", top, "depth_m"), "step");
        at("[[inner]]\nStp = 1", &misplaced("Stp", "step", top, "depth_m"), "Stp");
        at("depth = 1", &misplaced("depth", "depth_m", "in [[inner]]", keys), "depth");
        at("step = 48,5", "`48,5` has a comma; expected a decimal point, as in 48.5", "48,5");
        at("step = -1,25 # m\n", "`-1,25` has a comma; expected a decimal point, as in -1.25", "-1,25");
        let commas = |found: &str| {
            format!("`{found}` has no commas; expected commas between the values of a list, as in [0, 0, 0]")
        };
        at("list = [0 0 0]", &commas("0 0 0"), "0 0 0");
        at("list = [0, -9 1.5]", &commas("-9 1.5"), "-9 1.5");
        assert_eq!(said("step = 1").0, "the key `carry` is missing; expected it in this table");
        at("carry = 'a'\ncarry = 'b'", "duplicate key", "carry");
        at("carry = 'a'\nstep = nan x", &quotes("nan x"), "nan x");
        at(
            "carry = 'a'\nstep = 1 2",
            "found neither a number nor a text in quotes; expected one of them",
            "1 2",
        );
    }
}

//! JSON Schema (draft 2020-12), limited to the keywords of the program's schemas. Any other keyword is
//! refused, so that none is ignored.

use regex::Regex;
use serde_json::Value;

/// Keywords that only describe.
const ANNOTATIONS: [&str; 7] = ["$id", "$schema", "$defs", "title", "description", "default", "format"];

/// Faults of a value by a schema, each with its place; `root` holds the definitions.
pub(crate) fn faults(root: &Value, schema: &Value, value: &Value, place: &str) -> Vec<String> {
    let keywords = match schema {
        Value::Bool(true) => return Vec::new(),
        Value::Bool(false) => return vec![format!("{place}: nothing is allowed here")],
        Value::Object(keywords) => keywords,
        other => panic!("{place}: {other} is no schema"),
    };
    let mut out = Vec::new();
    for (keyword, of) in keywords {
        match keyword.as_str() {
            "$ref" => {
                let target =
                    of.as_str().and_then(|r| root.pointer(r.strip_prefix('#')?)).expect("a definition");
                out.extend(faults(root, target, value, place));
            }
            "anyOf" | "oneOf" => {
                let found = choices(root, of, value, place);
                if found == 0 || keyword == "oneOf" && found > 1 {
                    out.push(format!("{place}: {found} of {keyword}"));
                }
            }
            "type" | "const" | "enum" | "minimum" | "maximum" | "minItems" | "maxItems" | "minLength"
            | "maxLength" | "pattern" => {
                if !holds(keyword, of, value) {
                    out.push(format!("{place}: {keyword} is {of}, found {value}"));
                }
            }
            "required" => {
                let names = of.as_array().into_iter().flatten().filter_map(Value::as_str);
                let missing = names.filter(|name| value.is_object() && value.get(name).is_none());
                out.extend(missing.map(|name| format!("{place}: {name} is missing")));
            }
            "properties" => {
                for (name, schema) in of.as_object().expect("schemas by name") {
                    let found = value.get(name).filter(|_| value.is_object());
                    out.extend(
                        found.iter().flat_map(|v| faults(root, schema, v, &format!("{place}/{name}"))),
                    );
                }
            }
            "additionalProperties" => {
                let known = |name: &str| schema["properties"].get(name).is_some();
                let others = value.as_object().into_iter().flatten().filter(|(name, _)| !known(name));
                out.extend(others.flat_map(|(name, v)| faults(root, of, v, &format!("{place}/{name}"))));
            }
            "prefixItems" => {
                let pairs = of.as_array().into_iter().flatten().zip(value.as_array().into_iter().flatten());
                out.extend(
                    pairs.enumerate().flat_map(|(i, (s, v))| faults(root, s, v, &format!("{place}/{i}"))),
                );
            }
            "items" => {
                let before = schema["prefixItems"].as_array().map_or(0, Vec::len);
                let rest = value.as_array().into_iter().flatten().enumerate().skip(before);
                out.extend(rest.flat_map(|(i, v)| faults(root, of, v, &format!("{place}/{i}"))));
            }
            annotation if ANNOTATIONS.contains(&annotation) => {}
            other => panic!("{place}: the keyword {other} is not read here"),
        }
    }
    out
}

/// Number of alternatives that accept the value.
fn choices(root: &Value, of: &Value, value: &Value, place: &str) -> usize {
    let all = of.as_array().expect("alternatives").iter();
    all.filter(|schema| faults(root, schema, value, place).is_empty()).count()
}

/// True if a value satisfies one keyword: numeric keywords apply to numbers, lengths to lists or texts,
/// patterns to texts.
fn holds(keyword: &str, of: &Value, value: &Value) -> bool {
    let limit = || of.as_f64().expect("a number");
    let length = || of.as_u64().expect("a length") as usize;
    match keyword {
        "type" => match of {
            Value::Array(names) => names.iter().any(|name| is(name, value)),
            name => is(name, value),
        },
        "const" => value == of,
        "enum" => of.as_array().expect("values").contains(value),
        "minimum" => value.as_f64().is_none_or(|x| x >= limit()),
        "maximum" => value.as_f64().is_none_or(|x| x <= limit()),
        "minItems" => value.as_array().is_none_or(|list| list.len() >= length()),
        "maxItems" => value.as_array().is_none_or(|list| list.len() <= length()),
        "minLength" => value.as_str().is_none_or(|text| text.chars().count() >= length()),
        "maxLength" => value.as_str().is_none_or(|text| text.chars().count() <= length()),
        _ => {
            let pattern = Regex::new(of.as_str().expect("a pattern")).expect("a pattern");
            value.as_str().is_none_or(|text| pattern.is_match(text))
        }
    }
}

/// True if a value has the type of this name.
fn is(name: &Value, value: &Value) -> bool {
    match name.as_str() {
        Some("null") => value.is_null(),
        Some("boolean") => value.is_boolean(),
        Some("string") => value.is_string(),
        Some("number") => value.is_number(),
        Some("integer") => value.as_f64().is_some_and(|x| x.fract() == 0.0),
        Some("array") => value.is_array(),
        Some("object") => value.is_object(),
        _ => panic!("{name} is no type"),
    }
}

mod tests {
    use serde_json::{Value, json};

    use super::faults;

    /// Cases of the specification: accepted and refused values of every keyword.
    #[test]
    fn every_keyword_refuses() {
        let pair = json!({ "prefixItems": [{ "type": "string" }, { "type": "number" }], "items": false });
        let closed = json!({ "properties": { "a": { "type": "null" } }, "additionalProperties": false });
        for (schema, right, wrong) in [
            (json!(true), json!(1), Value::Null),
            (json!({ "type": "integer" }), json!(2.0), json!(2.5)),
            (json!({ "type": ["array", "null"] }), json!([]), json!({})),
            (json!({ "type": "boolean" }), json!(false), json!(0)),
            (json!({ "const": "a" }), json!("a"), json!("b")),
            (json!({ "enum": [1, "x"] }), json!("x"), json!(2)),
            (json!({ "minimum": 0 }), json!(0), json!(-1)),
            (json!({ "maximum": 90 }), json!("text"), json!(90.5)),
            (json!({ "minItems": 2 }), json!([1, 2]), json!([1])),
            (json!({ "maxItems": 1 }), json!([1]), json!([1, 2])),
            (json!({ "minLength": 1 }), json!("a"), json!("")),
            (json!({ "maxLength": 1 }), json!("a"), json!("aa")),
            (json!({ "pattern": "^a+$" }), json!("aa"), json!("ab")),
            (json!({ "required": ["a"] }), json!({ "a": 1 }), json!({ "b": 1 })),
            (json!({ "items": { "type": "string" } }), json!(["a"]), json!(["a", 1])),
            (json!({ "additionalProperties": { "type": "number" } }), json!({ "a": 1 }), json!({ "a": "b" })),
            (json!({ "anyOf": [{ "type": "null" }, { "type": "number" }] }), json!(1), json!("a")),
            (json!({ "oneOf": [{ "minimum": 0 }, { "maximum": 1 }] }), json!(2), json!(0.5)),
            (json!({ "$ref": "#/$defs/N", "$defs": { "N": { "type": "null" } } }), json!(null), json!(1)),
            (pair.clone(), json!(["a", 1]), json!([1, "a"])),
            (pair, json!(["a"]), json!(["a", 1, 2])),
            (closed.clone(), json!({ "a": null }), json!({ "a": 1 })),
            (closed, json!({}), json!({ "b": null })),
        ] {
            assert_eq!(faults(&schema, &schema, &right, ""), [""; 0], "{schema}");
            if schema != json!(true) {
                assert!(!faults(&schema, &schema, &wrong, "").is_empty(), "{schema}: {wrong}");
            }
        }
    }

    #[test]
    #[should_panic(expected = "the keyword not is not read here")]
    fn an_unknown_keyword_is_refused() {
        let schema = json!({ "not": {} });
        faults(&schema, &schema, &json!(1), "");
    }
}

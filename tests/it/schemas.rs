//! Inputs and outputs of the program against the JSON Schemas that it prints.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::program::{cases, json, run, stdout};
use crate::validator::faults;

/// Kinds of `obsdeg schema`.
const KINDS: [&str; 22] = [
    "allan",
    "analysis",
    "audit",
    "calibration",
    "certificate",
    "comparison",
    "crosscheck",
    "design",
    "model",
    "model-certificate",
    "next",
    "optimum-certificate",
    "part",
    "procedure",
    "scheme",
    "sensors",
    "simulation",
    "system",
    "system-calibration",
    "system-evidence",
    "system-run",
    "walks",
];

/// Schemas by the names that answers state.
fn schemas() -> BTreeMap<String, Value> {
    let of = |kind: &str| {
        let schema = json(&["schema", kind]);
        let version = if ["comparison", "design", "part", "simulation"].contains(&kind) { 2 } else { 1 };
        assert_eq!(schema["$id"], format!("urn:obsdeg:{kind}:{version}"));
        (format!("obsdeg.{kind}/{version}"), schema)
    };
    KINDS.map(of).into()
}

/// The published schemas (`schemas`) are those that the program prints; `UPDATE_SCHEMAS=1` writes them.
#[test]
fn published_schemas_are_what_the_program_prints() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas");
    for kind in KINDS {
        let (file, printed) = (folder.join(format!("{kind}.json")), stdout(&run(&["schema", kind])));
        if std::env::var_os("UPDATE_SCHEMAS").is_some() {
            std::fs::write(&file, &printed).expect("written");
        }
        let published = std::fs::read_to_string(&file).expect("a published schema");
        // shows only the first line that differs, since a schema is long
        let differs = published.lines().zip(printed.lines()).position(|(a, b)| a != b);
        assert!(published == printed, "{kind}: line {differs:?}; UPDATE_SCHEMAS=1 writes the file again");
    }
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    files.sort();
    let mut expected: Vec<String> = KINDS.iter().map(|kind| format!("{kind}.json")).collect();
    expected.sort();
    assert_eq!(files, expected);
}

fn check(schemas: &BTreeMap<String, Value>, name: &str, value: &Value, what: &str) {
    let found = faults(&schemas[name], &schemas[name], value, "");
    assert!(found.is_empty(), "{what}, {name}: {found:?}");
}

fn examples(ending: &str) -> Vec<String> {
    let mut found = Vec::new();
    for folder in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/examples")).expect("a folder") {
        let folder = folder.expect("an entry").path();
        let name = folder.file_name().expect("a name").to_string_lossy().into_owned();
        if !folder.is_dir() || name.starts_with("wrong-") {
            continue;
        }
        for file in std::fs::read_dir(&folder).expect("a folder") {
            let file = file.expect("an entry").file_name().to_string_lossy().into_owned();
            if file.ends_with(".toml") && (file == "scheme.toml") == (ending == "scheme") {
                found.push(format!("examples/{name}/{file}"));
            }
        }
    }
    found.sort();
    assert!(found.len() > 10);
    found
}

#[test]
#[ignore = "seconds: .ci/run"]
fn files_and_answers_are_as_their_schemas_say() {
    let schemas = schemas();
    let mut seen = BTreeMap::<String, usize>::new();
    let mut answer = |value: &Value, what: &str| {
        let name = value["schema"].as_str().expect("a schema").to_string();
        check(&schemas, &name, value, what);
        *seen.entry(name).or_default() += 1;
    };
    for (kind, files) in [("scheme", examples("scheme")), ("model", examples("model"))] {
        for file in files.iter().step_by(cases(4, 1)) {
            let text =
                std::fs::read_to_string(format!("{}/{file}", env!("CARGO_MANIFEST_DIR"))).expect("text");
            let value: toml::Value = toml::from_str(&text).expect("TOML");
            let value = serde_json::to_value(value).expect("JSON");
            check(&schemas, &format!("obsdeg.{kind}/1"), &value, file);
            answer(&json(&["analyze", file, "--solutions", "off", "--format", "json"]), file);
            // without numbers there is no run
            let run = run(&["simulate", file, "--format", "json"]);
            if run.status.success() {
                answer(&serde_json::from_str(&stdout(&run)).expect("JSON"), file);
            }
        }
    }
    let (five, six) = ("examples/five-positions/scheme.toml", "examples/six-positions/scheme.toml");
    let folder = tempfile::tempdir().expect("a folder");
    let part = folder.path().join("part.json").display().to_string();
    run(&["design", "--positions", "5", "--carry", "inertial", "--part", "1/40", "-o", &part]);
    answer(&serde_json::from_str(&std::fs::read_to_string(&part).expect("written")).expect("JSON"), "a part");
    for line in [
        &["analyze", "--angles", "0,0,0", "--angles", "180,0,0", "--formulas"][..],
        &["analyze", "--angles", "NUE@X_p:360", "--angles", "alpha,0,0", "--latitude", "90"],
        &["paper"],
        &["allan", "tests/data/static/imu.csv"],
        &["procedure", "examples/rate-table/scheme.toml"],
        &["compare", five, six],
        &["crosscheck", "--angles", "0,0,0", "--angles", "180,0,0", "--runs", "20"],
        &["crosscheck", "examples/lotka-volterra/model.toml"],
        &["calibrate", "examples/bench-day/scheme.toml", "examples/bench-day/record.csv"],
        &["calibrate", "examples/hudson-bay/model.toml", "examples/hudson-bay/data.csv", "--starts", "2"],
        &["design", "--positions", "4", "--observable", "D_F", "--carry", "inertial"],
        &["design", "--positions", "6", "--carry", "reset"],
        &["design", "--minimum"],
        &["design", "examples/lotka-volterra/model.toml", "--measure", "states, parameters"],
        &["design", "--minimum", "--terms", "gyros", "--carry", "inertial"],
        &["design", five, "--next", "1"],
    ] {
        answer(&json(&[line, &["--format", "json"]].concat()), &line.join(" "));
    }
    for line in [
        &["analyze", five, "--solutions", "off"][..],
        &["analyze", "examples/lotka-volterra/model.toml", "--solutions", "off"],
        &["design", "--positions", "3", "--terms", "F", "--carry", "inertial"],
    ] {
        let path = folder.path().join("c.json").display().to_string();
        stdout(&run(&[line, &["--certificate", &path, "--force"]].concat()));
        let mut value: Value =
            serde_json::from_str(&std::fs::read_to_string(&path).expect("written")).expect("JSON");
        // files that are no answers name their layout in another key
        value["schema"] = value["layout"].clone();
        answer(&value, &line.join(" "));
    }
    // every schema of an answer was used
    let unused: Vec<&String> = schemas
        .keys()
        .filter(|k| !seen.contains_key(*k) && !["obsdeg.scheme/1", "obsdeg.model/1"].contains(&k.as_str()))
        .collect();
    assert!(unused.is_empty(), "{unused:?}");
    // the schemas refuse a missing field and a field of another type
    let mut wrong = json(&["analyze", five, "--solutions", "off", "--format", "json"]);
    let analysis = &schemas["obsdeg.analysis/1"];
    wrong["rank"] = "eight".into();
    assert_eq!(faults(analysis, analysis, &wrong, ""), ["/rank: type is \"integer\", found \"eight\""]);
    wrong.as_object_mut().expect("an object").remove("rank");
    assert_eq!(faults(analysis, analysis, &wrong, ""), [": rank is missing"]);
}

/// Rules for descriptions that must be understood alone, as in an editor's hint.
mod descriptions {
    use serde_json::{Map, Value};

    use super::KINDS;
    use crate::program::{json, run, stdout};

    /// Smallest number of characters of a description.
    const SHORTEST: usize = 26;

    /// First words that point at something instead of naming it.
    const POINTING: [&str; 18] = [
        "What", "Whether", "How", "Which", "To", "Of", "Those", "That", "By", "When", "Where", "Why", "As",
        "It", "Its", "Their", "Under", "So",
    ];

    /// Units that may follow `in`.
    const UNITS: [&str; 11] = [
        "s",
        "deg",
        "degrees",
        "deg/s",
        "deg/h",
        "deg/sqrt(h)",
        "deg/h/sqrt(h)",
        "g",
        "ug",
        "m/s^2",
        "percent",
    ];

    /// Phrases for units that another field or file states.
    const STATED: [&str; 4] = ["unit of", "units of", "in its unit", "order and units"];

    /// Phrases for numbers without a unit.
    const WITHOUT: [&str; 7] =
        ["dimensionless", "number of", "number that", "line number", "index", "seed of", "probability"];

    /// Phrases for whole numbers without a unit.
    const COUNTED: [&str; 4] = ["rank", "order", "observable degree", "worst degree"];

    /// Kind of numbers in a value.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    enum Numbers {
        None,
        Whole,
        Real,
    }

    /// Kind of numbers in a value of this schema, including those in its lists and tables. Types referenced
    /// by name have separate descriptions.
    fn numbers(schema: &Value) -> Numbers {
        let types = match &schema["type"] {
            Value::Array(all) => all.iter().filter_map(Value::as_str).collect(),
            one => one.as_str().into_iter().collect::<Vec<_>>(),
        };
        let own = match (types.contains(&"number"), types.contains(&"integer")) {
            (true, _) => Numbers::Real,
            (false, true) => Numbers::Whole,
            (false, false) => Numbers::None,
        };
        let lists = ["prefixItems", "anyOf"].iter().filter_map(|key| schema[key].as_array()).flatten();
        let inner = ["items", "additionalProperties"].iter().filter_map(|key| schema.get(key));
        lists.chain(inner).map(numbers).max().map_or(own, |most| most.max(own))
    }

    /// Faults of a description.
    fn faults(text: &str, numbers: Numbers) -> Vec<&'static str> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let plain = words.join(" ").to_lowercase();
        let says = |of: &[&str]| of.iter().any(|w| plain.contains(w));
        let is_unit = |word: &str| UNITS.contains(&word.trim_end_matches([',', ';', ':', '.', ']']));
        let has_unit =
            words.windows(2).any(|w| w[0] == "in" && is_unit(w[1])) || says(&STATED) || says(&WITHOUT);
        let mut out = Vec::new();
        if text.chars().count() < SHORTEST {
            out.push("is short");
        }
        if words.first().is_none_or(|w| POINTING.contains(w)) {
            out.push("begins with a word that points");
        }
        if numbers == Numbers::Real && !has_unit || numbers == Numbers::Whole && !has_unit && !says(&COUNTED)
        {
            out.push("is of a number and has no unit");
        }
        out
    }

    /// Adds the faults of all descriptions of a schema to `out`, with the place of each.
    fn look(schema: &Value, place: &str, described: bool, out: &mut Vec<String>) {
        let none = Map::new();
        let table = |key: &str| schema[key].as_object().unwrap_or(&none);
        match schema["description"].as_str() {
            Some(text) => {
                let found = faults(text, numbers(schema));
                out.extend(found.iter().map(|fault| format!("{place}: {text:?} {fault}")));
            }
            None if described => out.push(format!("{place} has no description")),
            None => {}
        }
        for (name, of) in table("properties") {
            // the variant's description covers its tag, and the only key of a variant that is a table
            let tag = of.get("const").is_some();
            let only = schema.get("additionalProperties") == Some(&Value::Bool(false))
                && table("properties").len() == 1
                && place.contains('|');
            look(of, &format!("{place}/{name}"), !tag && !only, out);
        }
        for (name, of) in table("$defs") {
            look(of, name, true, out);
        }
        for key in ["oneOf", "anyOf"] {
            for (i, of) in schema[key].as_array().into_iter().flatten().enumerate() {
                let variant = of.get("const").is_some() || of.get("properties").is_some();
                look(of, &format!("{place}|{i}"), variant, out);
            }
        }
        if let Some(items) = schema.get("items") {
            look(items, &format!("{place}[]"), false, out);
        }
    }

    /// Every description stands alone: it names the thing, and the unit of a number.
    #[test]
    fn stand_alone() {
        let help = stdout(&run(&["schema", "--help"]));
        let kinds = help.lines().filter_map(|line| line.trim_start().strip_prefix("- ")?.split(':').next());
        let mut kinds: Vec<&str> = kinds.collect();
        kinds.sort_unstable();
        assert_eq!(kinds, KINDS);
        let mut out = Vec::new();
        for kind in KINDS {
            look(&json(&["schema", kind]), kind, true, &mut out);
        }
        out.sort();
        out.dedup();
        assert!(out.is_empty(), "{} faults:\n{}", out.len(), out.join("\n"));
    }

    /// Empty or pointing descriptions are refused, and so are keys and types without one.
    #[test]
    fn that_point_are_refused() {
        let (short, points, unit) =
            ("is short", "begins with a word that points", "is of a number and has no unit");
        for (text, numbers, expected) in [
            ("Whether it is.", Numbers::None, vec![short, points]),
            ("To when.", Numbers::Real, vec![short, points, unit]),
            ("Of so many.", Numbers::Whole, vec![short, points, unit]),
            ("A set that does.", Numbers::None, vec![short]),
            ("The criterion.", Numbers::Real, vec![short, unit]),
            ("What sigmas are to be multiplied by.", Numbers::Real, vec![points, unit]),
            ("Required over found sigma: at least 1 is met.", Numbers::Real, vec![unit]),
            ("Unknowns with a requirement.", Numbers::Whole, vec![unit]),
            ("Order that this number is in.", Numbers::Real, vec![unit]),
            ("End of the position, in strides.", Numbers::Real, vec![unit]),
            ("End of the position, in s.", Numbers::Real, vec![]),
            ("Factor to multiply the sigmas by, dimensionless.", Numbers::Real, vec![]),
            ("Highest order of derivatives that was examined.", Numbers::Whole, vec![]),
            ("Number of unknowns with a requirement.", Numbers::Whole, vec![]),
        ] {
            assert_eq!(faults(text, numbers), expected, "{text}");
        }
        let number = serde_json::json!({ "type": ["array", "null"], "items": { "type": "number" } });
        assert_eq!(numbers(&number), Numbers::Real);
        let schema = serde_json::json!({
            "description": "Schema with a key that nothing describes.",
            "properties": { "key": number },
            "$defs": { "Type": { "oneOf": [{ "const": "value" }] } },
        });
        let mut out = Vec::new();
        look(&schema, "schema", true, &mut out);
        let none = |place: &str| format!("{place} has no description");
        assert_eq!(out, ["schema/key", "Type", "Type|0"].map(none));
    }
}

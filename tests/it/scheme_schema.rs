//! The JSON Schema of scheme files against the shipped files: it accepts all of them, and refuses
//! deliberately wrong files if a schema can express the error.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

/// Violations of a schema by a value, each with its place; supports the keywords of the schema of scheme
/// files.
fn violations(root: &Value, schema: &Value, value: &Value, at: &str, out: &mut Vec<String>) {
    let Some(keys) = schema.as_object() else { return };
    for (key, rule) in keys {
        let mut here: Option<String> = None;
        let mut wrong = |what: String| here = Some(format!("{at}: {what}"));
        match key.as_str() {
            "$schema" | "$defs" | "title" | "description" | "default" | "format" => {}
            "$ref" => {
                let name = rule.as_str().and_then(|r| r.strip_prefix("#/$defs/")).expect("a definition");
                violations(root, &root["$defs"][name], value, at, out);
            }
            "type" => {
                let kinds: Vec<&str> = match rule {
                    Value::Array(list) => list.iter().filter_map(Value::as_str).collect(),
                    one => one.as_str().into_iter().collect(),
                };
                let is = |kind: &&str| match *kind {
                    "object" => value.is_object(),
                    "array" => value.is_array(),
                    "string" => value.is_string(),
                    "boolean" => value.is_boolean(),
                    "number" => value.is_number(),
                    "null" => value.is_null(),
                    other => panic!("the type {other}"),
                };
                if !kinds.iter().any(is) {
                    wrong(format!("not {}", kinds.join(" or ")));
                }
            }
            "enum" if !rule.as_array().is_some_and(|list| list.contains(value)) => {
                wrong(format!("none of {rule}"))
            }
            "const" if rule != value => wrong(format!("not {rule}")),
            "enum" | "const" => {}
            "minimum" if value.as_f64() < rule.as_f64() && value.is_number() => {
                wrong(format!("below {rule}"))
            }
            "maximum" if value.as_f64() > rule.as_f64() => wrong(format!("above {rule}")),
            "minItems"
                if value.as_array().is_some_and(|l| (l.len() as u64) < rule.as_u64().expect("a count")) =>
            {
                wrong(format!("fewer than {rule}"));
            }
            "maxItems"
                if value.as_array().is_some_and(|l| l.len() as u64 > rule.as_u64().expect("a count")) =>
            {
                wrong(format!("more than {rule}"));
            }
            "minimum" | "maximum" | "minItems" | "maxItems" => {}
            "pattern" => {
                let pattern =
                    regex::Regex::new(rule.as_str().expect("a pattern")).expect("a regular expression");
                if value.as_str().is_some_and(|s| !pattern.is_match(s)) {
                    wrong(format!("not like {rule}"));
                }
            }
            "anyOf" | "oneOf" => {
                let fits = |s: &Value| {
                    let mut inner = Vec::new();
                    violations(root, s, value, at, &mut inner);
                    inner.is_empty()
                };
                let fitting = rule.as_array().expect("a list").iter().filter(|s| fits(s)).count();
                if fitting == 0 || (key == "oneOf" && fitting > 1) {
                    wrong(format!("{fitting} of the {key} fit"));
                }
            }
            "items" => {
                for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                    violations(root, rule, item, &format!("{at}[{i}]"), out);
                }
            }
            "properties" => {
                for (name, rule) in rule.as_object().expect("an object") {
                    if let Some(inner) = value.get(name) {
                        violations(root, rule, inner, &format!("{at}.{name}"), out);
                    }
                }
            }
            "required" => {
                for name in rule.as_array().expect("a list").iter().filter_map(Value::as_str) {
                    if value.is_object() && value.get(name).is_none() {
                        wrong(format!("no {name}"));
                    }
                }
            }
            "additionalProperties" => {
                let known = schema["properties"].as_object();
                let others = value.as_object().into_iter().flatten();
                for (name, inner) in others.filter(|(name, _)| known.is_none_or(|k| !k.contains_key(*name))) {
                    match rule {
                        Value::Bool(false) => wrong(format!("the key {name}")),
                        rule => violations(root, rule, inner, &format!("{at}.{name}"), out),
                    }
                }
            }
            other => panic!("{at}: the keyword {other} is not checked here"),
        }
        out.extend(here);
    }
}

/// Converts TOML to JSON.
fn converted(value: toml::Value) -> Value {
    match value {
        toml::Value::String(s) => s.into(),
        toml::Value::Integer(i) => i.into(),
        toml::Value::Float(x) => x.into(),
        toml::Value::Boolean(b) => b.into(),
        toml::Value::Datetime(d) => d.to_string().into(),
        toml::Value::Array(list) => list.into_iter().map(converted).collect(),
        toml::Value::Table(table) => table.into_iter().map(|(k, v)| (k, converted(v))).collect(),
    }
}

fn schema() -> Value {
    let schema = schemars::schema_for!(obsdeg_core::model::scheme_file::SchemeFile);
    serde_json::to_value(schema).expect("JSON")
}

fn broken(text: &str) -> Vec<String> {
    let schema = schema();
    let mut out = Vec::new();
    violations(&schema, &schema, &converted(toml::from_str(text).expect("TOML")), "", &mut out);
    out
}

fn shipped() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let entries = std::fs::read_dir(folder).expect("examples");
    let files = entries.map(|e| e.expect("an entry").path().join("scheme.toml"));
    files.filter(|f| f.is_file()).collect()
}

#[test]
fn the_schema_accepts_every_shipped_scheme() {
    let files = shipped();
    assert!(files.len() > 15, "{}", files.len());
    for file in files {
        let found = broken(&std::fs::read_to_string(&file).expect("readable"));
        // the schema can express one of the errors: a missing unit
        let wrong = file.to_string_lossy().contains("wrong-noise");
        assert_eq!(found.is_empty(), !wrong, "{}: {found:?}", file.display());
    }
}

/// The schema refuses what the reader refuses because of kind, range or key, and the reader accepts every key
/// of the schema.
#[test]
fn schema_and_reader_agree() {
    use obsdeg_core::model::scheme_file::read;
    let position = "[[position]]\nangles_deg = [0, 0, 0]\n";
    for keys in [
        "[simulation]\nstep_s = 0",
        "[simulation]\ndwell_s = 1e7",
        "[simulation]\nslew_rate_deg_s = -1",
        "[simulation]\naccelerometer_noise_g = 1e-30",
        "[simulation]\naccelerometer_bias_instability_ug = 0",
        "[simulation]\naccelerometer_correlation_time_s = 0.1",
        "[simulation]\nazimuth_noise_deg = 1e4",
        "[simulation]\ndrift_scale = 0",
        "[simulation]\nangle_random_walk_deg_sqrt_h = -1",
        "[simulation]\nangle_random_walk_deg_sqrt_h = \"0.1\"",
        "[simulation]\nrate_random_walk_dph_sqrt_h = [1, 2]",
        "[simulation]\nbias_instability_dph = [0, 0, 1e7]",
        "[simulation]\ncorrelation_time_s = 0",
        "[simulation]\ntruth = \"rough\"",
        "[simulation]\nfilter = \"kalman\"",
        "[simulation.values]\nD_F = 1e7",
        "[simulation.priors]\nD_F = 0",
        "[requirements]\nD_F = -1",
        "[requirements]\nD_F = \"1\"",
        "dwell_s = 0",
        "rotation = { about = \"X\", angle_deg = 5 }",
        "rotation = { angle_deg = 5 }",
        "[[position]]\nangles_deg = [0, 0]",
        "[[position]]\nangles_deg = [0, 0, true]",
        "[[position]]\nattitude = \"nue\"",
        "[[position]]\nattitude = \"NUE\"\nslew = { rate_deg_s = 0 }",
        "[gimbals]\nalpha_deg = [1]",
        "[gimbals]\ndelta_deg = [0, 1]",
        "[record]\nvalues = { g = 1 }",
        "[record.static]\ninitial = 9\nwindow = 3",
        "[geometry]\nX = 5",
        "[document]\ntitle = \"t\"",
        "[document]\nsignatures = \"Checked\"",
    ] {
        let text = format!("{position}{keys}\n");
        assert!(read(&text).is_err(), "{keys}");
        assert!(!broken(&text).is_empty(), "{keys}");
    }
    let all = format!(
        "name = \"n\"\ndescription = \"d\"\ncarry = \"inertial\"\nlatitude_deg = -3.5\n\
         terms = [\"F\", \"I\", \"M6\"]\nframe = \"gyros\"\npath = \"one-axis\"\nmeasured_azimuth = true
combinations = [\"D_IX - D_IY\"]
geometry = {{ X = {{ I = \"+x\", O = \"-z\", S = \"+y\" }}, Y = {{ I = \"+y\", O = \"-z\", S = \"-x\" }}, Z = {{ I = \
\"+z\", O = \"+x\", S = \"+y\" }}, accelerometers = {{ X = \"+x\", Y = \"+y\", Z = \"+z\" }} }}
{position}name = \"a\"\ndwell_s = 5\nrotation = {{ about = \"N\", rate_deg_s = 1 }}
[[position]]\nattitude = \"NUE\"\nslew = {{ rate_deg_s = 1, about = \"X_p\", angle_deg = 90 }}
[simulation]\ntruth = \"exact\"\nfilter = \"extended\"\nstep_s = 1\ndwell_s = 2\nslew_rate_deg_s = 3\n\
accelerometer_noise_g = 1e-5\naccelerometer_bias_instability_ug = 1\naccelerometer_correlation_time_s = 60\n\
azimuth_noise_deg = 1
drift_noise = \"0.1 deg/sqrt(h)\"\nangle_random_walk_deg_sqrt_h = 0.001\nrate_random_walk_dph_sqrt_h = [0.1, 0, 0.1]
bias_instability_dph = 0\ncorrelation_time_s = 600\npropagation = \"rk4\"\ndrift_scale = 2\nvalues = {{ D = 1 }}\n\
estimates = {{ D = 1 }}\npriors = {{ D = 1 }}
[document]\nreference = \"r\"\nrevision = \"B\"\ndate = \"2026-03-01\"\nauthor = \"a\"\nsignatures = [\"Checked\"]
[requirements]\npsi = 1\n[bench]\nK0 = 20\n[ageing]\nD_F = 0.002\n[acceptance]\nrisk = 0.1\nlimits = {{ D_F = 9, D_I = [-1, 1] }}\n[record]\ncolumns = {{ t = \"Time\" }}\nunits = {{ fx = \"1e-5 g\" }}\n\
static = {{ initial = 9, window = 3, factor = 9, shortest = 9 }}\ntolerance = 0.1\nmissing = [-9999]\nsettle = 3\n[gimbals]\n\
alpha_deg = [0, 1]\nbeta_deg = [0, 1]\ngamma_deg = [0, 1]\n"
    );
    assert_eq!(broken(&all), Vec::<String>::new());
    let all = all.replace("[0, 1]", "[-180, 180]");
    // misalignments are judged at positions
    read(&all.replace("rotation = { about = \"N\", rate_deg_s = 1 }\n", "")).expect("a scheme");
    // the texts above contain every key of the schema
    let schema = schema();
    let mut keys: Vec<&String> = Vec::new();
    for object in schema["$defs"].as_object().expect("definitions").values().chain([&schema]) {
        keys.extend(object["properties"].as_object().into_iter().flat_map(|p| p.keys()));
    }
    assert!(keys.len() > 40, "{}", keys.len());
    for key in keys {
        assert!(
            all.contains(&format!("{key} ="))
                || all.contains(&format!("[{key}]"))
                || all.contains(&format!("[[{key}]]")),
            "{key}"
        );
    }
    assert!(!broken(&format!("{position}[simulation]\nstepp_s = 1")).is_empty());
    assert_eq!(converted(toml::Value::Integer(1)), json!(1));
}

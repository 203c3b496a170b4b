//! Requests in JSON, and the options and texts that they are read from.

use obsdeg_core::model::ranges;
use obsdeg_report::Format;
use serde_json::{Value, json};

use crate::arguments::{Given, InputOptions, whole};
use crate::call::{Answered, COMMANDS, call, call_json};
use crate::conditions::{RequirementOptions, assigned, within};
use crate::design::options::Search;
use crate::host::Host;
use crate::problem::{Problem, ProblemKind};
use crate::simulate::Simulate;
use crate::source::{Expected, Input, Source, title};

const DECAY: &str =
    "name = \"decay\"\nparameters = [\"a\", \"b\"]\n[states]\nx = \"-a*b*x\"\n[outputs]\ny = \"x\"\n";
const PAIR: &str = "[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\nangles_deg = [180, 0, 0]\n";

fn asked(command: &str, request: &Value) -> Result<Answered, Problem> {
    call(command, &request.to_string(), &mut Host::silent())
}

fn refused(command: &str, request: &Value) -> String {
    let Err(problem) = asked(command, request) else { panic!("{command} answers {request}") };
    assert_eq!(problem.kind, ProblemKind::Input, "{command} {request}");
    problem.message
}

fn text(answered: &Answered) -> Value {
    serde_json::from_str(&answered.text().expect("written")).expect("JSON")
}

#[test]
fn what_is_no_command_is_refused_with_their_names() {
    let message = refused("analyse", &json!({}));
    assert!(message.contains("`analyse`") && COMMANDS.iter().all(|name| message.contains(name)), "{message}");
    for name in COMMANDS {
        // each is known: what it lacks is a file
        let answered = asked(name, &json!({}));
        assert!(answered.is_ok() == (name == "paper"), "{name}");
    }
}

#[test]
fn requests_are_objects_of_known_options() {
    for (request, expected) in [("[]", "no JSON object"), ("{", "no JSON")] {
        let problem = call("analyze", request, &mut Host::silent()).err().expect("refused");
        assert!(problem.message.contains(expected), "{}", problem.message);
    }
    let message = refused("analyze", &json!({ "angels": ["0,0,0"] }));
    assert!(
        message.starts_with("there is no option `angels` here; expected one of seed, angles,"),
        "{message}"
    );
    let message = refused("analyze", &json!({ "angles": ["0,0,0"], "carry": "sideways" }));
    assert_eq!(message, "carry: `sideways` is no choice here (expected platform, inertial, reset)");
    let message = refused("analyze", &json!({ "angles": ["0,0"] }));
    assert!(message.starts_with("angles: "), "{message}");
    let message = refused("simulate", &json!({ "angles": ["0,0,0"], "step": -1 }));
    assert!(message.contains("step_s"), "{message}");
    let message = refused("design", &json!({ "positions": 5, "within": 200 }));
    assert_eq!(message, "within 200: expected 0 to 100 percent");
    let model = json!({ "sources": [{ "name": "decay.toml", "text": DECAY }], "carry": "reset" });
    let message = refused("analyze", &model);
    assert!(message.starts_with("carry is about schemes; decay.toml is a model file"), "{message}");
    let wrong = json!({ "sources": [{ "name": "a.toml", "text": "\n\ncarry = 3\n" }] });
    let place = asked("analyze", &wrong).err().expect("refused").place.expect("a place");
    assert_eq!((place.name.as_str(), place.line_and_column().0), ("a.toml", 3));
    // the option whose value is of another type, and what was expected
    let message = refused("simulate", &json!({ "noise": 1e-5, "seed": "one" }));
    assert!(message.starts_with("seed: "), "{message}");
    // options in messages have the names of JSON
    let message = refused("analyze", &json!({}));
    assert!(message.contains("angles A,B,G") && !message.contains("--"), "{message}");
}

/// The paper's two positions determine 7 of 15 unknowns; null is the same as no option, and a number the same
/// as its text.
#[test]
fn options_are_numbers_texts_or_null() {
    let angles = json!(["0,0,0", "180,0,0"]);
    let plain = asked("analyze", &json!({ "angles": angles, "solutions": false })).expect("judged");
    let answer = text(&plain);
    let quantities = answer["quantities"].as_array().expect("a list");
    let determined = quantities.iter().filter(|q| q["degree"].is_number()).count();
    assert_eq!((quantities.len(), determined), (15, 7));
    assert_eq!(plain.answer.layout(), answer["schema"].as_str());
    let null = json!({ "angles": angles, "solutions": false, "latitude": null, "terms": null });
    assert_eq!(text(&asked("analyze", &null).expect("judged")), answer);
    let at = |latitude: Value| {
        asked("analyze", &json!({ "angles": angles, "latitude": latitude, "solutions": false }))
    };
    assert_eq!(text(&at(json!(28.2)).expect("judged")), text(&at(json!("28.2")).expect("judged")));
    assert!(at(json!("north")).is_err());
}

#[test]
fn all_forms_of_an_answer_are_of_one_answer() {
    let request = json!({ "sources": [{ "name": "decay.toml", "text": DECAY }], "solutions": false });
    let whole = asked("analyze", &request).expect("judged");
    let in_json = call_json("analyze", &request.to_string(), &mut Host::silent()).expect("judged");
    assert_eq!(in_json.text, whole.text().expect("written"));
    assert!(in_json.passed && whole.passed && !in_json.sentences.is_empty());
    assert_eq!(in_json.text, whole.answer.written(Format::Json).expect("written"));
    assert!(whole.answer.fragment().expect("written").contains("<table"));
    let table = whole.answer.table(None).expect("a table");
    // a header, then x, a, b
    assert_eq!(table.lines().count(), 4, "{table}");
    assert!(whole.answer.table(Some("no such list")).is_err());
}

#[test]
fn kinds_of_texts_follow_from_their_content() {
    let kind = |source: Source| source.read().map(|(_, input)| matches!(input, Input::Model(_)));
    assert_eq!(kind(Source::new("a.txt", DECAY)), Ok(true));
    assert_eq!(kind(Source::new("a.txt", PAIR)), Ok(false));
    let must = |text: &str, must_be| {
        kind(Source { must_be, ..Source::new("a.toml", text) }).expect_err("refused").message
    };
    assert!(must(DECAY, Expected::Scheme).contains("a.toml is a model file; expected a scheme file"));
    assert!(must(PAIR, Expected::Model).contains("a.toml is a scheme file; expected a model file"));
    // an error is at its place in the text
    let wrong = DECAY.replace("-a*b*x", "-a*b*(x");
    let place = kind(Source::new("a.toml", &*wrong)).expect_err("refused").place.expect("a place");
    assert_eq!((place.name.as_str(), place.line_and_column().0), ("a.toml", 4));
    let message = kind(Source::new("a.xml", "<sbml/>")).expect_err("refused").message;
    assert!(message.contains("SBML") && message.contains("obsdeg.load(\"a.xml\")"), "{message}");
    assert_eq!(["a/b/scheme.toml", "a/b/c.toml", "scheme.toml"].map(title), ["b", "c", "scheme"]);
}

#[test]
fn options_of_the_other_kind_of_file_are_refused() {
    let read = |text: &str| Source::new("own.toml", text).read().expect("read");
    let given =
        Given::of([("carry", "--carry".into()), ("order", "--order".into()), ("seed", "--seed".into())]);
    let about = |text: &str| given.concern([&read(text)]).expect_err("refused").message;
    assert!(about(DECAY).starts_with("--carry is about schemes; own.toml"), "{}", about(DECAY));
    assert!(about(PAIR).starts_with("--order is about models; own.toml"), "{}", about(PAIR));
    // both kinds of file
    assert!(given.concern([&read(DECAY), &read(PAIR)]).is_ok());
    assert!(Given::of([("seed", "--seed".into())]).concern([&read(DECAY)]).is_ok());
    assert!(given.without("--carry").concern([&read(DECAY)]).is_ok());
}

#[test]
fn one_input_is_files_or_angles() {
    let source = |text: &str| Source::new("own.toml", text);
    let message = |options: &InputOptions, sources| options.read_one(sources).expect_err("refused").message;
    let none = InputOptions::default();
    assert!(none.read_one(vec![source(PAIR)]).is_ok());
    assert_eq!(
        message(&none, vec![source(PAIR), source(DECAY)]),
        "found 2 files; expected one scheme or model"
    );
    assert!(message(&none, Vec::new()).contains("--angles A,B,G once per position"));
    let angles = InputOptions { angles: vec!["0,0,0".parse().expect("angles")], ..InputOptions::default() };
    assert!(matches!(angles.read_one(Vec::new()), Ok(Input::Scheme(s)) if s.positions.len() == 1));
    assert!(message(&angles, vec![source(PAIR)]).contains("beside a file"));
}

#[test]
fn numbers_outside_their_range_are_refused_with_it() {
    let count = whole::<u32>(2..=9);
    assert_eq!((count("2"), count(" 9 ")), (Ok(2), Ok(9)));
    for wrong in ["1", "10", "2.5", "-3", "two", ""] {
        assert_eq!(count(wrong), Err(format!("expected a whole number 2 to 9, found {wrong}")));
    }
    let dwell = within(ranges::DWELL_S);
    assert_eq!(dwell("1e3"), Ok(1000.0));
    for wrong in ["0", "-1", "1e7", "nan", "inf", "1 h"] {
        let message = dwell(wrong).expect_err("refused");
        assert!(message.starts_with("expected ") && message.contains("0.001"), "{message}");
    }
    let requirement = assigned(ranges::REQUIREMENT);
    assert!(matches!(requirement("D_FX=0.01"), Ok(a) if a.name == "D_FX" && a.value == 0.01));
    for wrong in ["D_FX", "=1", "D_FX=", "D_FX=0", "D_FX=-1", "D_FX=nan"] {
        assert!(requirement(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn requirements_concern_an_unknown_and_are_stated_once() {
    let scheme = Source::new("own.toml", PAIR).scheme().expect("a scheme");
    let concern = |stated: &[&str]| {
        let requirement = stated.iter().map(|a| a.parse().expect("an assignment")).collect();
        RequirementOptions { requirement, ..RequirementOptions::default() }.concern([&scheme].into_iter())
    };
    for right in [&["D=1"][..], &["D_F=1", "D_FX=2"], &["psi=0.1"], &[]] {
        assert_eq!(concern(right), Ok(()), "{right:?}");
    }
    let message = concern(&["D_FW=1"]).expect_err("refused").message;
    assert!(message.contains("no unknown here is `D_FW`") && message.contains("D_F"), "{message}");
    assert!(concern(&["D=1", "D=2"]).is_err());
}

/// Option sets survive the documented way to write and read them.
#[test]
fn options_are_read_back() {
    let asked = json!({
        "seed": 4, "angles": ["0,0,0@X_p:360"], "latitude": "28.2", "carry": "reset", "requirement": ["D=0.05"]
    });
    let options: Simulate = serde_json::from_value(asked).expect("options");
    let written = serde_json::to_string(&options).expect("text");
    assert_eq!(serde_json::from_str::<Simulate>(&written).expect("options"), options);
    let search = Search { positions: Some(5), part: Some([1, 3]), ..Search::default() };
    let written = serde_json::to_string(&search).expect("text");
    assert_eq!(serde_json::from_str::<Search>(&written).expect("options"), search);
}

//! Sentences on runs, filters and searches, compared with the runs.

use obsdeg_core::system::{SystemModel, model_file};
use obsdeg_evidence::crosscheck::Agreement;
use obsdeg_report::{Format, TerminalLayout, written};
use serde_json::Value;

use crate::program::{json, run, stdout};

/// Output of a command, with its lines joined.
fn said(arguments: &[&str]) -> String {
    stdout(&run(arguments)).split_whitespace().collect::<Vec<_>>().join(" ")
}

fn joined(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

const P1_P2: [&str; 4] = ["--angles", "0,0,0", "--angles", "180,0,0"];

/// The latitude of an answer without one is that of the help: none, or 28.2 deg.
#[test]
fn help_says_which_latitude_is_taken() {
    let help = |command: &str| {
        let text = said(&[command, "--help"]);
        let own = text.split("--latitude <DEG>").nth(1).expect("the option").to_string();
        own.split(" --").next().expect("its help").to_string()
    };
    for (command, key) in [
        ("simulate", "/conditions/latitude_deg"),
        ("crosscheck", "/conditions/latitude_deg"),
        ("compare", "/schemes/0/conditions/latitude_deg"),
    ] {
        let more: &[&str] = if command == "crosscheck" { &["--runs", "2"] } else { &[] };
        let angles: &[&str] =
            if command == "compare" { &["examples/paper-p1-p2/scheme.toml"] } else { &P1_P2 };
        let answer = json(&[&[command, "-q", "--format", "json"], angles, more].concat());
        assert_eq!(answer.pointer(key), Some(&Value::from(28.2)), "{command}");
        assert!(help(command).contains("28.2") && !help(command).contains("generic"), "{command}");
    }
    let answer = json(&[&["analyze", "-q", "--format", "json"], &P1_P2[..]].concat());
    assert!(answer["latitude_deg"].is_null());
    assert!(help("analyze").contains("left out: generic"));
}

/// The drifts in sentences are those of the run, including their factor.
#[test]
fn drifts_are_named_with_their_factor() {
    for (scale, factor) in [("1", 1.0), ("0.001", 0.001), ("2", 2.0)] {
        let arguments = [&["simulate", "-q", "--drift-scale", scale], &P1_P2[..]].concat();
        let text = said(&arguments);
        let answer = json(&[&arguments[..], &["--format", "json"]].concat());
        let first = &answer["quantities"][3];
        assert_eq!(first["name"], "D_FX");
        let truth = first["truth"].as_f64().expect("a number");
        let times = if factor == 1.0 { String::new() } else { format!(" times {scale}") };
        for sentence in [
            format!("for the drifts of the paper{times} (11 to 13 deg/h; none are stated)"),
            format!("the paper's drifts{times} (D_F 11, 12, 13 deg/h, D_I D_O D_S 5 deg/h/g)"),
        ] {
            assert!(text.contains(&sentence), "{scale}: {text}");
        }
        assert!((truth - 11.0 * factor).abs() < 1e-9 * truth, "{scale}: {truth}");
        let prior = first["prior_sigma"].as_f64().expect("a number");
        assert!((prior - 20.0 * factor).abs() < 1e-9 * prior, "{scale}: {prior}");
        assert_eq!(text.contains("of drifts times"), factor != 1.0, "{text}");
    }
}

/// First lines name every condition that is not stated, also if it is stated for some unknowns.
#[test]
fn what_nothing_states_is_named() {
    let first = |more: &[&str]| {
        let arguments = [&["simulate", "-q"], &P1_P2[..], more].concat();
        let text = said(&arguments);
        let line = text.split("Estimates at the end").next().expect("first lines").to_string();
        (line, json(&[&arguments[..], &["--format", "json"]].concat()))
    };
    let (line, answer) = first(&["--terms", "F,K0"]);
    let all = answer["quantities"].as_array().expect("a list");
    let k0 = all.iter().find(|q| q["name"] == "K0_X").expect("an unknown");
    assert!(k0["truth"] != 0.0 && k0["prior_sigma"] != 0.0, "{k0}");
    assert!(line.contains("5 deg/h/g; others too)") && line.contains("10 deg/h/g; others too)"), "{line}");
    let (line, _) = first(&[]);
    assert!(!line.contains("others") && !line.contains("of the other unknowns"), "{line}");
    let (values, priors) = ("true values of the other unknowns", "priors of the other unknowns");
    for (more, expected) in [
        (&["--value", "D_FX=0.01"][..], [true, false]),
        (&["--prior", "D_FX=0.01"], [false, true]),
        (&["--value", "D_FX=0.01", "--prior", "psi=0.2"], [true, true]),
        (
            &["--value", "D=0.01", "--value", "psi=0.1", "--prior", "D=1", "--prior", "psi=0.2"],
            [false, false],
        ),
    ] {
        let (line, answer) = first(more);
        assert_eq!([values, priors].map(|w| line.contains(w)), expected, "{more:?}: {line}");
        let keys = answer["conditions"]["by_default"].to_string();
        assert_eq!(["other_values", "other_priors"].map(|k| keys.contains(k)), expected, "{keys}");
    }
}

/// First lines, JSON and advice name the filters with untrustworthy sigmas, although single runs of such a
/// filter are consistent.
#[test]
fn filters_that_are_not_to_be_trusted_are_named() {
    let first = "Do not trust the filter's sigmas, although this run is consistent";
    let decides = "this run of the filter is consistent with its truth";
    let mut consistent = 0;
    for (truth, filter, scale, trusted) in [
        ("exact", "extended", "1", false),
        ("exact", "linear", "1", false),
        ("exact", "iterated", "1", true),
        ("exact", "extended", "0.001", true),
        ("linear", "linear", "1", true),
    ] {
        for seed in ["1", "2", "3", "4"] {
            let options = ["--truth", truth, "--filter", filter, "--drift-scale", scale, "--seed", seed];
            let arguments = [&["simulate", "-q"], &P1_P2[..], &options].concat();
            let answer = json(&[&arguments[..], &["--format", "json"]].concat());
            let alone = answer["consistency"]["consistent"] == true;
            let text = said(&arguments);
            assert_eq!(answer["filter"]["trusted"], trusted, "{options:?}");
            assert_eq!(text.contains(first), alone && !trusted, "{options:?}: {text}");
            assert_eq!(text.contains(decides), alone && trusted, "{options:?}: {text}");
            assert_eq!(text.contains("do not trust the sigmas of this filter"), !trusted, "{options:?}");
            consistent += usize::from(alone && !trusted);
        }
    }
    assert!(consistent > 0, "a run that looks right");
}

/// A filter with full attitudes needs a truth with full attitudes: an unstated truth is exact, and is named.
/// A linear truth is refused, and so is a deliberate change of such a filter.
#[test]
fn the_truth_is_one_that_the_filter_can_follow() {
    for (filter, expected) in [("linear", "linear"), ("extended", "exact"), ("iterated", "exact")] {
        let arguments = [&["simulate", "-q"], &P1_P2[..], &["--filter", filter]].concat();
        let answer = json(&[&arguments[..], &["--format", "json"]].concat());
        assert_eq!(answer["conditions"]["truth"], expected, "{filter}");
        let named = said(&arguments).contains("truth exact, as a filter with full attitudes needs");
        assert_eq!(named, expected == "exact", "{filter}");
        let keys = answer["conditions"]["by_default"].to_string();
        assert_eq!(keys.contains("\"truth\""), expected == "exact", "{keys}");
    }
    let crosscheck = |more: &[&str]| {
        let arguments = [&["crosscheck", "-q", "--runs", "20"], &P1_P2[..], more].concat();
        // exit code 1: the evidence disagrees
        let output = run(&[&arguments[..], &["--format", "json"]].concat());
        serde_json::from_str::<Value>(&stdout(&output)).expect("JSON")
    };
    for (more, filter, passes) in [
        (&[][..], "linear", true),
        (&["--filter", "extended"], "extended", false),
        (&["--filter", "iterated"], "iterated", true),
    ] {
        let answer = crosscheck(more);
        assert_eq!(answer["monte_carlo"]["filter"], filter);
        let anees = &answer["monte_carlo"]["statistics"][0];
        assert!(anees["name"].as_str().is_some_and(|n| n.starts_with("ANEES")), "{anees}");
        assert_eq!(anees["pass"], passes, "{filter}: {anees}");
    }
    let refused = |command: &str, more: &[&str]| {
        let output = run(&[&[command, "-q"], &P1_P2[..], more].concat());
        assert!(!output.status.success() && stdout(&output).is_empty(), "{command} {more:?}");
        joined(&crate::program::stderr(&output))
    };
    for command in ["simulate", "crosscheck"] {
        for filter in ["extended", "iterated"] {
            let said = refused(command, &["--truth", "linear", "--filter", filter]);
            assert!(said.contains(&format!("the {filter} filter has full attitudes")), "{said}");
            assert!(said.contains("expected truth = \"exact\""), "{said}");
        }
    }
    for wrong in [["--filter-carry", "reset"], ["--filter-drop", "p2"], ["--filter-latitude", "10"]] {
        let said = refused("crosscheck", &[&wrong[..], &["--filter", "extended"]].concat());
        assert!(said.contains("wrong on purpose") && said.contains("found the extended filter"), "{said}");
    }
}

/// The report of such a run advises against its sigmas too.
#[test]
fn reports_do_not_call_untrusted_filters_right() {
    let place = tempfile::tempdir().expect("a folder");
    let file = place.path().join("report.md");
    let file = file.to_str().expect("a path");
    let options =
        ["--truth", "exact", "--filter", "extended", "--runs", "2", "--seed", "1", "-q", "-o", file];
    let output = run(&[&["report", "examples/paper-p1-p2/scheme.toml"], &options[..]].concat());
    assert!(output.status.success(), "{}", crate::program::stderr(&output));
    let text = std::fs::read_to_string(file).expect("a report");
    let consistent = text.contains("consistent with its truth") && !text.contains("NOT consistent");
    assert!(consistent, "the seed is of a run that looks right: {text}");
    assert!(text.contains("its sigmas are not to be trusted at these drifts"), "{text}");
    assert!(text.contains("Do not trust the filter's sigmas"), "{text}");
}

fn read(text: &str) -> SystemModel {
    model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Model with y = (a + b) t + a t^71/71 from t = 0: no derivative up to the bound shows a and b, a run does.
const BEYOND: &str = "name='m'\nparameters=['a', 'b']\nknown_inputs={u={function='t^70'}}\n[states]\nx='a + b + a*u'\n\
                      [outputs]\ny='x'\n\
                      [simulation]\nduration=1.5\nstep=0.1\nnoise={y=0.01}\nvalues={a=0.5, b=1.0, x=0.0}\n\
                      priors={a=1.0, b=1.0, x=1.0}";

/// Information beyond the bound contradicts no verdict, and the run does not call it unobservable.
#[test]
fn beyond_the_bound_samples_speak_for_themselves() {
    let model = read(BEYOND);
    let evidence = obsdeg_evidence::system::crosscheck_system(&model, 1).expect("evidence");
    assert!(evidence.passed && evidence.seen_up_to == Some(60), "{evidence:?}");
    let of = |name: &str| evidence.quantities.iter().find(|q| q.name == name).expect("an unknown");
    for name in ["a", "b"] {
        // the samples determine it
        assert!(of(name).inflation.measured.is_some_and(|x| x < 1.1), "{evidence:?}");
        assert_eq!(of(name).inflation.outcome, Agreement::NotResolvable);
    }
    let text = joined(&written(&evidence, Format::Table, TerminalLayout::default()).expect("text"));
    for sentence in
        ["Directions that no derivative up to order 60 sees", "1 up to order 60, 0 singular values"]
    {
        assert!(text.contains(sentence), "{text}");
    }
    assert!(!text.contains("no output sees") && !text.contains("1 exact"), "{text}");

    let (run, _) = obsdeg_evidence::system::simulate_system(&model, 1).expect("a run");
    let a = run.quantities.iter().find(|q| q.name == "a").expect("an unknown");
    assert!(a.sigma < 1e-9 * a.prior_sigma, "{a:?}");
    let text = joined(&written(&run, Format::Table, TerminalLayout::default()).expect("text"));
    assert!(!text.contains("known from the prior only"), "{text}");
    // a proof of unobservability still counts
    let text = BEYOND.replace("a + b + a*u", "a + b").replace("known_inputs={u={function='t^70'}}\n", "");
    let model = read(&text);
    let evidence = obsdeg_evidence::system::crosscheck_system(&model, 1).expect("evidence");
    assert!(evidence.passed && evidence.seen_up_to.is_none(), "{evidence:?}");
    let text = joined(&written(&evidence, Format::Table, TerminalLayout::default()).expect("text"));
    assert!(text.contains("Directions that no output sees") && text.contains("1 exact"), "{text}");
    let (run, _) = obsdeg_evidence::system::simulate_system(&model, 1).expect("a run");
    let text = joined(&written(&run, Format::Table, TerminalLayout::default()).expect("text"));
    assert!(text.contains("known from the prior only") || text.contains("rests on the prior"), "{text}");
}

/// A combination that is not resolved up to the bound is not called unobservable.
#[test]
fn combinations_beyond_the_bound_are_not_called_unobservable() {
    use obsdeg_core::system::{SystemOptions, analyze_system};
    let status = |text: &str| {
        let options = SystemOptions { solutions: false, ..SystemOptions::default() };
        let a = analyze_system(&read(text), options).expect("judged");
        let text = joined(&written(&a, Format::Table, TerminalLayout::default()).expect("text"));
        text.split("Combinations asked for").nth(1).expect("a table").to_string()
    };
    let asked = |text: &str| text.replace("[states]", "combinations=['a - b']\n[states]");
    let beyond = status(&asked(BEYOND));
    assert!(beyond.contains("not seen up to order 60"), "{beyond}");
    let proven = BEYOND.replace("a + b + a*u", "a + b").replace("known_inputs={u={function='t^70'}}\n", "");
    let proven = status(&asked(&proven));
    assert!(proven.contains("not observable") && !proven.contains("not seen"), "{proven}");
}

/// The first line of a search names the candidates and the order in which the best scheme is the best.
#[test]
fn the_best_is_that_of_the_candidates_in_their_order() {
    let arguments = ["design", "-q", "--positions", "2", "--observable", "D_FX", "--carry", "inertial"];
    let text = said(&arguments);
    let answer = json(&[&arguments[..], &["--format", "json"]].concat());
    assert_eq!(answer["search"]["proven"], true);
    assert!(answer["search"]["degree_floor"].is_u64());
    assert!(
        text.contains("Proven best of these candidates by worst degree, then the criterion worst: "),
        "{text}"
    );
    // other attitudes may be better: candidates turned by 45 degrees are
    let best = |answer: &Value| answer["found"][0]["value"].as_f64().expect("a number");
    let finer = json(&[&arguments[..], &["--candidates", "grid:45", "--format", "json"]].concat());
    assert!(best(&finer) <= best(&answer), "{} {}", best(&finer), best(&answer));
}

/// If no set of cardinal attitudes was examined completely, nothing is said about the fewest positions.
#[test]
fn nothing_is_said_of_sets_that_were_not_examined() {
    use obsdeg_design::design::Minimum;
    use obsdeg_design::review::{ReviewOptions, review};
    use obsdeg_evidence::compare::Entry;
    use obsdeg_evidence::simulation::Conditions;
    use obsdeg_report::{Origin, ReviewFormat};
    let scheme = crate::schemes::paper(obsdeg_core::model::Carry::Platform);
    let entry = Entry { name: "p".into(), scheme, conditions: Conditions::default() };
    let options = ReviewOptions { runs: 2, seed: 1 };
    let mut r = review(&[entry], &[], options, None, &|_, _| true).expect("a review");
    let mut said = |none_of: Vec<[u64; 2]>| {
        let all = Minimum {
            positions: None,
            witness: Vec::new(),
            counting_bound: 5,
            rows_per_position: 3,
            none_of,
            never: Vec::new(),
            proven: false,
        };
        r.schemes[0].alternatives.all = Some(all);
        let origin = Origin { command: String::new(), inputs: Vec::new(), certificates: Vec::new() };
        let files = obsdeg_report::review(&r, &[], &origin, ReviewFormat::Markdown, "f").expect("files");
        String::from_utf8(files[0].bytes.clone()).expect("UTF-8")
    };
    let examined = said(vec![[5, 42_504]]);
    assert!(
        examined.contains("no set of 5 of the 24 cardinal attitudes determines every coefficient"),
        "{examined}"
    );
    let none = said(Vec::new());
    assert!(!none.contains("cardinal attitudes determine") && !none.contains("few cardinal"), "{none}");
}

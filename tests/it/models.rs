//! The engine for any system against published systems with known verdicts.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use obsdeg_core::analysis::{AnalysisOptions, analyze};
use obsdeg_core::degree::{Status, Verdict};
use obsdeg_core::model::{Scheme, cardinal};
use obsdeg_core::system::{
    Judgement, NumberOfSolutions, SystemCertainty, SystemOptions, Unknown, analyze_system, json, judge,
    model_file,
};
use obsdeg_ekf::consistency::chi_square_band;
use obsdeg_ekf::model::central_difference;
use obsdeg_ekf::{Measurement, Process};
use obsdeg_evidence::crosscheck::Agreement;
use obsdeg_evidence::system::{Numeric, SystemEvidence, crosscheck_system, simulate_system};
use serde_json::Value;

use crate::program::cases;

/// Every third reference model, or all with `AT_LENGTH=1`.
pub(crate) fn some_models() -> impl Iterator<Item = (String, Value, String)> {
    models().into_iter().step_by(cases(3, 1))
}

/// Reference models: name, JSON value, JSON text.
pub(crate) fn models() -> Vec<(String, Value, String)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/models");
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "json"));
    files.sort();
    let read = |file: PathBuf| {
        let text = std::fs::read_to_string(&file).expect("readable");
        let name = file.file_stem().expect("a name").to_string_lossy().into_owned();
        (name, serde_json::from_str(&text).expect("JSON"), text)
    };
    files.into_iter().map(read).collect()
}

fn names(value: &Value) -> Vec<String> {
    value.as_array().into_iter().flatten().filter_map(|v| Some(v.as_str()?.to_string())).collect()
}

/// Degrees by name; for an unknown input the degree of the signal itself.
fn degrees(j: &Judgement) -> BTreeMap<String, Option<usize>> {
    let of = |(u, d): (&Unknown, &Option<usize>)| (u.derivative == 0).then(|| (u.name.clone(), *d));
    j.layout.unknowns.iter().zip(&j.findings.degrees.degree).filter_map(of).collect()
}

/// Differences between a verdict and the reference.
fn mismatches(reference: &Value, text: &str) -> Vec<String> {
    let mut out = Vec::new();
    let model = match json::read(text) {
        Ok(model) => model,
        Err(e) => return vec![e.to_string()],
    };
    let judged = match judge(&model, 1, None) {
        Ok(judged) => judged,
        Err(e) => return vec![e.to_string()],
    };
    let found = degrees(&judged);
    let expected = &reference["expected"];
    let known: Vec<String> = names(&reference["known_initial_conditions"])
        .into_iter()
        .chain(reference["known_initial_values"].as_object().into_iter().flatten().map(|(k, _)| k.clone()))
        .collect();
    for (list, wanted) in [("observable", true), ("unobservable", false)] {
        for name in names(&expected[list]) {
            let observable = known.contains(&name) || found.get(&name).is_some_and(Option::is_some);
            if observable != wanted {
                out.push(format!("{name} is {}observable", if observable { "" } else { "not " }));
            }
        }
    }
    for (name, order) in reference["min_order"].as_object().into_iter().flatten() {
        let order = order.as_u64().map(|k| k as usize);
        let own = found.get(name).copied().flatten();
        if own != order {
            out.push(format!("{name}: order {own:?}, expected {order:?}"));
        }
    }
    if let Some(ranks) = reference["rank_by_order"].as_array() {
        let ranks: Vec<usize> = ranks.iter().filter_map(|r| Some(r.as_u64()? as usize)).collect();
        let profile = &judged.findings.degrees.rank_profile;
        for (k, rank) in ranks.iter().enumerate() {
            let own = profile.get(k).or(profile.last()).copied().unwrap_or(0);
            if own != *rank {
                out.push(format!("rank {own} at order {k}, expected {rank}"));
            }
        }
    }
    for (text, verdict) in names(&reference["observable_combinations"]).iter().zip(&judged.findings.asked) {
        if verdict.status != Status::Observable {
            out.push(format!("{text} is not observable"));
        }
    }
    match judged.certainty {
        SystemCertainty::Primes(primes) if primes.error_bound > 1e-12 => {
            out.push(format!("error bound {:e}", primes.error_bound));
        }
        SystemCertainty::Digits(d) if d.zero > d.nonzero - 15.0 => out.push(format!("{d:?}")),
        _ => {}
    }
    out
}

#[test]
fn every_reference_verdict_and_order() {
    let models = models();
    assert_eq!(models.len(), 141);
    let mut table = Vec::new();
    for (name, reference, text) in &models {
        table.extend(mismatches(reference, text).into_iter().map(|m| format!("{name}: {m}")));
    }
    assert!(table.is_empty(), "{} mismatches\n{}", table.len(), table.join("\n"));
}

fn judged(text: &str) -> Judgement {
    let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    judge(&model, 7, None).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Degree of an unknown; `None` if it is not observable.
fn degree_of(j: &Judgement, name: &str) -> Option<usize> {
    degrees(j)[name]
}

/// The paper's two positions as a model file and as a scheme.
#[test]
fn the_platform_is_one_of_them() {
    let text = std::fs::read_to_string(
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/platform-as-model/model.toml"),
    );
    let model = judged(&text.expect("readable"));
    let positions = ["NUE", "NDW"].map(|n| cardinal(n).expect("an attitude"));
    let no_solutions = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
    let platform = analyze(&Scheme::of_angles(positions), no_solutions, None).expect("analysed");
    assert_eq!(model.findings.degrees.rank_profile[..3], platform.rank_profile[..]);
    let unknowns = &model.layout.unknowns;
    for q in &platform.quantities {
        let c = unknowns.iter().position(|u| u.name == q.name).expect("the same unknowns");
        let Verdict { status, degree } = model.findings.verdict(c);
        assert_eq!((status, degree), (q.status, q.degree), "{}", q.name);
        let partners: BTreeSet<&str> =
            model.findings.partners[c].iter().map(|&d| unknowns[d].name.as_str()).collect();
        assert_eq!(partners, q.partners.iter().map(String::as_str).collect(), "{}", q.name);
    }
    assert_eq!(model.findings.asked, [Verdict { status: Status::Observable, degree: Some(1) }]);
}

/// Primes are texts in the JSON of schemes and models, since readers with doubles keep only 53 bits.
#[test]
fn primes_are_text() {
    let text = "name = \"decay\"\n[states]\nx = \"-p*x\"\n[parameters]\np = {}\n[outputs]\nz = \"x\"\n";
    let model = model_file::read(text).expect("a model");
    let options = SystemOptions { solutions: false, ..SystemOptions::default() };
    let system = serde_json::to_value(analyze_system(&model, options).expect("analysed")).expect("JSON");
    let scheme = Scheme::of_angles([cardinal("NUE").expect("an attitude")]);
    let options = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
    let platform = serde_json::to_value(analyze(&scheme, options, None).expect("analysed")).expect("JSON");
    for primes in [&system["primes"], &platform["certainty"]["primes"]] {
        let of = |i: usize| primes[i].as_str().and_then(|p| p.parse::<u64>().ok()).expect("text of a number");
        assert!(of(0) != of(1) && (0..2).all(|i| of(i) >> 53 > 0), "{primes}");
    }
}

/// A known start is a special point: the rank may grow after orders without growth.
#[test]
fn stagnation_is_no_end_at_a_known_start() {
    let trap = |power: usize| {
        judged(&format!(
            "name='trap'\nparameters=['a']\n[states]\nx={{equation='1+a*x^{power}',initial=0}}\n[outputs]\ny='x'"
        ))
    };
    let found = trap(2);
    assert_eq!((degree_of(&found, "a"), found.layout.closed, found.rests_on_bound), (Some(3), false, false));
    assert_eq!(found.findings.degrees.rank_profile, [0, 0, 0, 1]);
    // an order far above the number of unknowns
    assert_eq!((degree_of(&trap(20), "a"), trap(20).rests_on_bound), (Some(21), false));
    // no claim beyond the bound
    let late = trap(90);
    assert!(degree_of(&late, "a").is_none() && late.rests_on_bound);
    let a = late.layout.unknowns.iter().position(|u| u.name == "a").expect("a");
    assert_eq!(late.verdict_on(a).status, Status::NotSeen);
    // with a generic start the first order without growth is the end
    let open = judged("name='open'\nparameters=['a']\n[states]\nx='1+a*x^2'\n[outputs]\ny='x'");
    assert_eq!((open.layout.closed, open.findings.degrees.rank_profile), (true, vec![1, 2]));
}

/// Identities between functions hold exactly at every order: cancelled terms affect no output.
#[test]
fn identities_of_functions_cancel() {
    for identity in [
        "sin(x)^2 + cos(x)^2",
        "sin(2*x) - 2*sin(x)*cos(x)",
        "sin(x + q) - sin(x)*cos(q) - cos(x)*sin(q)",
        "cos(x/2)^2 - (1 + cos(x))/2",
        "cos(3*x) - 4*cos(x)^3 + 3*cos(x)",
        "tan(x) - sin(x)/cos(x)",
        "exp(x + q) - exp(x)*exp(q)",
        "exp(x/3)^3 - exp(x)",
        "exp(log(x)) - x",
        "log(exp(x)) - x",
        "log(x*q) - log(x) - log(q)",
        "log(x^3/q) - 3*log(x) + log(q)",
        "sqrt(x)^2 - x",
        "sqrt(x^2 + q)^2 - x^2 - q",
        "x^(1/2) - sqrt(x)",
        "x^0.75 - sqrt(x)*x^(1/4)",
        "x^(1/3)*x^(2/3) - x",
        "x^(q + 1) - x^q*x",
        "x^(2*q) - (x^q)*x^q",
        "x^q - exp(q*log(x))",
        "asin(x) + acos(x)",
        "atan(x) + atan(1/x)",
        "atan(x) - asin(x/sqrt(1 + x^2))",
        "x^-2 - 1/x^2",
        "2^10*x - 1024*x",
        "x*1e-3 - x/1000",
    ] {
        let text = format!(
            "name='identity'\n[states]\nx='w*x + q'\nq='x - w'\nw='0'\nz='-z'\n[outputs]\ny='z + ({identity})'"
        );
        let found = judged(&text);
        assert_eq!(degree_of(&found, "z"), Some(0), "{identity}");
        assert_eq!(found.findings.degrees.rank(), 1, "{identity}: {:?}", found.findings.degrees);
    }
    // terms that do not cancel affect the output
    for different in ["sin(x)^2 - cos(x)^2", "exp(x) - x", "sqrt(x) + x", "asin(x) - acos(x)", "x^q"] {
        let text = format!(
            "name='no identity'\n[states]\nx='w*x + q'\nq='x - w'\nw='0'\nz='-z'\n[outputs]\ny='z + ({different})'"
        );
        assert_eq!(judged(&text).findings.degrees.rank(), 4, "{different}");
    }
}

/// Functions against the same system written with polynomials and one more known state.
#[test]
fn functions_give_the_orders_that_can_be_seen() {
    // exponent of a power law, Torricelli's outflow, Michaelis-Menten-Hill, an Arrhenius law
    for (equation, parameters, expected) in [
        ("-k*x^n", "['k', 'n']", vec![("x", Some(0)), ("k", Some(2)), ("n", Some(2))]),
        ("-k*sqrt(x)", "['k']", vec![("x", Some(0)), ("k", Some(1))]),
        ("-v*x^n/(m^n + x^n)", "['v', 'm', 'n']", vec![("v", Some(3)), ("m", Some(3)), ("n", Some(3))]),
        ("-a*exp(-e/x)", "['a', 'e']", vec![("a", Some(2)), ("e", Some(2))]),
        // from t = 0: a f, then a f^3
        ("a*sin(f*t)", "['a', 'f']", vec![("a", Some(4)), ("f", Some(4))]),
        ("-log(b)*x", "['b']", vec![("b", Some(1))]),
    ] {
        let text = format!("name='f'\nparameters={parameters}\n[states]\nx='{equation}'\n[outputs]\ny='x'");
        let found = judged(&text);
        for (name, degree) in expected {
            assert_eq!(degree_of(&found, name), degree, "{name} in {equation}");
        }
    }
}

/// Inputs of every kind, in TOML.
#[test]
fn inputs_constants_and_experiments() {
    let with = |inputs: &str, equation: &str| {
        judged(&format!(
            "name='i'\nparameters=['a', 'b']\n{inputs}\n[states]\nx='{equation}'\n[outputs]\ny='x'"
        ))
    };
    // with a constant input of known value b is indistinguishable from a, with a generic one it is not
    let generic = with("known_inputs={u='generic'}", "a + b*u");
    assert_eq!((degree_of(&generic, "a"), degree_of(&generic, "b")), (Some(2), Some(2)));
    let constant = with("known_inputs={u='constant'}", "a + b*u");
    assert_eq!((degree_of(&constant, "a"), constant.findings.degrees.rank()), (None, 2));
    let ramp = with("known_inputs={u={polynomial=1}}", "a + b*u");
    assert_eq!(degree_of(&ramp, "b"), Some(2));
    let known = with("known_inputs={u={function='exp(-t)'}}", "a + b*u");
    assert_eq!(degree_of(&known, "b"), Some(2));
    // an arbitrary unknown input leaves the rest unobservable, an unknown ramp does not
    let arbitrary = with("unknown_inputs={w='arbitrary'}", "a*x + w");
    assert_eq!((degree_of(&arbitrary, "a"), arbitrary.rests_on_bound), (None, true));
    let ramp = with("unknown_inputs={w={polynomial=1}}", "a*x + w");
    assert_eq!((degree_of(&ramp, "a"), degree_of(&ramp, "w")), (Some(3), Some(3)));
    // two experiments with different constant inputs distinguish a from b
    let twice = with("experiments=2\nknown_inputs={u='constant'}", "a + b*u");
    assert_eq!((degree_of(&twice, "a"), degree_of(&twice, "b")), (Some(1), Some(1)));
    assert_eq!(degree_of(&twice, "x@2"), Some(0));
    // known jump of the state
    let jump = judged(
        "name='jump'\nparameters=['a']\n[states]\nx='0'\nz='0'\n[outputs]\ny='x'\n[[segment]]\n[[segment]]\n\
         carry={x='x + a*z'}",
    );
    assert_eq!((degree_of(&jump, "a"), jump.findings.degrees.rank()), (None, 2));
}

/// The same system from JSON and from TOML.
#[test]
fn both_layouts_say_the_same() {
    let toml = "name='s'\nparameters=['p1', 'p2']\nknown_inputs={u='generic'}\n[states]\nx1='-p1*x1 + u'\n\
                x2='p2*x1 - x2'\n[outputs]\ny='x2'";
    let json = r#"{"name": "s", "states": ["x1", "x2"], "params": ["p1", "p2"], "known_inputs": ["u"],
        "equations": {"x1": "-p1*x1 + u", "x2": "p2*x1 - x2"}, "outputs": {"y": "x2"}}"#;
    let of_json = judge(&json::read(json).expect("a model"), 7, None).expect("judged");
    let of_toml = judged(toml);
    assert_eq!((of_json.layout, of_json.findings.degrees), (of_toml.layout, of_toml.findings.degrees));
}

/// Texts of ten megabytes are refused, or read, without harm.
#[test]
fn monsters_do_no_harm() {
    let model = |equation: &str| {
        format!("name='monster'\nparameters=['a']\n[states]\nx=\"{equation}\"\n[outputs]\ny='x'")
    };
    for piece in ["(", "-", "x^", "sin(", "((x)", ")"] {
        let text = model(&piece.repeat(10_000_000 / piece.len()));
        let error = model_file::read(&text).expect_err("refused");
        assert!(error.span.is_some() && error.to_string().len() < 300, "{piece}: {error}");
    }
    let long = model(&format!("{}x", "a*x + ".repeat(200_000)));
    let error = model_file::read(&long).and_then(|m| judge(&m, 1, None)).expect_err("too many operations");
    assert!(error.to_string().contains("operations"), "{error}");
    // 8 MB that would need 2 GB are refused before parsing
    let longer = model(&format!("{}x", "x+".repeat(4_000_000)));
    let error = model_file::read(&longer).expect_err("too many signs");
    assert_eq!(error.to_string(), "the model file: more than 400000 signs + - * / ^");
    // 4,000 entries with the same 8,000 operations each
    let long = "name='long'\n[states]\n'v[4000]' = '-v*dot(v,v)'\n[outputs]\ny='v[1]'";
    let error = model_file::read(long).expect_err("written out");
    assert!(error.to_string().contains("at most 4000000 names, numbers and operations"), "{error}");
    let sum = model(&format!("{}x", "a*x + ".repeat(20_000)));
    assert_eq!(judged(&sum).findings.degrees.rank(), 2);
    let error = model_file::read(&model("x^123456")).and_then(|m| judge(&m, 1, None)).expect_err("too high");
    assert!(error.to_string().contains("above 1000"), "{error}");
    for fraction in ["x^(a + 1/6666666666666)", "exp(x/99999)", "x^0.1234567", "cos(0.00001*x)"] {
        assert!(judged(&model(fraction)).findings.degrees.rank() > 0, "{fraction}");
    }
    let many: String = (0..200_000).map(|i| format!("x{i} = \"-x{i}\"\n")).collect();
    let error = model_file::read(&format!("name='many'\n[states]\n{many}[outputs]\ny='x0'"))
        .and_then(|m| judge(&m, 1, None))
        .expect_err("too many");
    assert!(error.to_string().contains("200000 states"), "{error}");
    let experiments = "{\"name\": \"e\", \"experiments\": 1000000000, \"states\": [\"x\"], \
                       \"equations\": {\"x\": \"x\"}, \"outputs\": {\"y\": \"x\"}}";
    assert!(json::read(experiments).expect_err("too many").to_string().contains("1 to 20"));
    for nested in ["sin(x + ", "exp(2*", "log(x + ", "sqrt(1 + "] {
        let text = model(&format!("{}x{}", nested.repeat(150), ")".repeat(150)));
        // judged or refused, without a panic
        let _ = model_file::read(&text).and_then(|m| judge(&m, 1, None));
    }
}

fn example(name: &str) -> obsdeg_core::system::SystemModel {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples").join(name).join("model.toml");
    model_file::read(&std::fs::read_to_string(file).expect("readable")).expect("a model")
}

/// The Jacobians of the filter match finite differences for every function.
#[test]
fn jacobians_against_differences() {
    let all = model_file::read(
        "name='all'\nparameters=['a', 'n']\nknown_inputs={u={function='exp(-t)'}, v='generic'}\n\
         unknown_inputs={w={polynomial=1}}\n[constants]\nk=2.5\n[states]\nx='-a*x^n + sin(2*x)*u + w'\n\
         y={equation='exp(-x/3) + log(x*y) - sqrt(x + y) + v*k', initial='2*a'}\n\
         [outputs]\np='atan(x/y) + asin(x/9) - acos(y/9)'\nq='tan(x/4)*cos(y)^3'\n\
         [simulation.inputs]\nv='cos(2*t)'",
    );
    let models = [all.expect("a model"), example("unicycle-range"), example("lotka-volterra")];
    for model in &models {
        let compiled = model.compile().expect("compiled");
        let numeric = Numeric::new(model, &compiled).expect("numbers");
        let n = numeric.states.len();
        let x = nalgebra::DVector::from_iterator(n, (0..n).map(|i| 0.8 + 0.23 * i as f64));
        let step = nalgebra::DVector::from_element(n, 1e-5);
        let sigmas = vec![1.0; model.outputs.len()];
        let (process, outputs) = (numeric.process(0), numeric.measurement(0, &sigmas));
        for (own, differences) in [
            (process.jacobian(0.7, &x), central_difference(|x| process.f(0.7, x), &x, &step)),
            (outputs.jacobian(0.7, &x), central_difference(|x| outputs.h(0.7, x), &x, &step)),
        ] {
            assert!(own.iter().all(|d| d.is_finite()), "{}", model.name);
            assert!(
                (&own - &differences).amax() < 1e-8 * own.amax().max(1.0),
                "{} {own} {differences}",
                model.name
            );
        }
    }
}

/// A linearised filter believes that it knows a forgotten start to any precision. No figure of the run rests
/// on such a direction.
#[test]
fn a_filter_is_not_asked_what_it_cannot_know() {
    let of = |name: &str| simulate_system(&example(name), 1).expect("a run").0.consistency;
    let forgotten = of("two-compartment");
    // seven states; the fast mode of the start is a function of the rates; NEES over all seven would be 1e39
    assert_eq!(forgotten.unresolved_directions, 1);
    assert!(forgotten.nees > forgotten.nees_limit && forgotten.nees < 1e12, "{forgotten:?}");
    let (_, limit) = chi_square_band(6.0, 1.0, 0.999);
    assert_eq!(forgotten.nees_limit, limit);
    for name in ["bearing-only", "sir", "unicycle-range"] {
        assert_eq!(of(name).unresolved_directions, 0, "{name}");
    }
}

/// Errors along the gradient of a constraint are not judged, since the constraint is known. The run is as
/// consistent as without it, with one degree of freedom less, for narrow priors too.
#[test]
fn what_a_constraint_holds_is_not_judged() {
    const RUNS: u64 = 12;
    let text = |constraint: &str, prior: f64| {
        format!(
            "name='attitude'\n{constraint}\n[constants]\ng=[0, 0, 1]\nm=[1, 0, 0]\n[known_inputs]\n'w[3]'='generic'\n\
             [parameters]\n'b[3]'={{unit='rad/s'}}\n[states]\n'q[4]'='qdot(q, w - b)'\n\
             [outputs]\nacc='transpose(R(q))*g'\nmag='transpose(R(q))*m'\n\
             [simulation]\nduration=20\nstep=0.2\nvalues={{q=[0.5, 0.5, 0.5, 0.5], b=[0.01, 0.02, -0.01]}}\n\
             priors={{q={prior}, b={prior}}}\nnoise={{acc=0.001, mag=0.01}}\n\
             inputs={{w=['0.1*sin(t)', '0.2', '0.1*cos(t)']}}"
        )
    };
    for prior in [5e-4, 5e-6] {
        for (constraint, held) in [("constraints=['norm(q) = 1']", 1), ("", 0)] {
            let model = model_file::read(&text(constraint, prior)).expect("a model");
            let runs = (1..=RUNS).map(|seed| simulate_system(&model, seed).expect("a run").0.consistency);
            let runs: Vec<_> = runs.collect();
            let free = (7 - held) as f64;
            for c in &runs {
                assert_eq!((c.held_directions, c.unresolved_directions), (held, 0), "{prior}");
                assert_eq!(c.nees_limit, chi_square_band(free, 1.0, 0.999).1);
            }
            let mean = runs.iter().map(|c| c.nees).sum::<f64>() / RUNS as f64;
            let band = chi_square_band(free, RUNS as f64, 0.9999);
            assert!((band.0..=band.1).contains(&mean), "{prior} {constraint}: {mean}, {band:?}");
        }
    }
}

/// Slopes, prior inflation and null vectors of the information confirm the exact verdicts on every example
/// with numbers.
#[test]
fn the_information_confirms_the_verdicts() {
    let mut slopes = 0;
    for name in [
        "bearing-only",
        "drift-product",
        "lotka-volterra",
        "sir",
        "stationary-alignment",
        "two-compartment",
        "two-position-alignment",
        "unicycle-range",
    ] {
        let e = crosscheck_system(&example(name), 1).expect("evidence");
        assert!(e.passed && e.checks > 3, "{name}: {e:?}");
        // every unobservable direction is printed, and the samples do not resolve it either
        assert_eq!(e.symmetries.len() + usize::from(name == "sir"), e.defect.predicted, "{name}");
        assert!(e.symmetries.iter().all(|s| s.seen.measured.is_some_and(|x| x < 1e-9)), "{name}: {e:?}");
        for q in &e.quantities {
            let Some(measured) = q.slope.measured else { continue };
            let degree = q.degree.expect("observable") as f64;
            assert!((measured + degree + 0.5).abs() < 0.06, "{name}: {q:?}");
            slopes += 1;
        }
    }
    // degrees from 0 to 4
    assert!(slopes >= 15, "{slopes}");
    // verdicts hold for generic inputs: a robot at rest determines less, and the check says so
    let text = std::fs::read_to_string(
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/unicycle-range/model.toml"),
    );
    let still = text.expect("readable").replace("1 + 0.5*sin(0.3*t)", "0").replace("0.2*cos(0.17*t)", "0");
    let refuted = crosscheck_system(&model_file::read(&still).expect("a model"), 1).expect("evidence");
    assert!(!refuted.passed && (refuted.defect.predicted, refuted.defect.measured) == (1, 2), "{refuted:?}");
}

/// With jumps no slope is measured, and the degrees are not called confirmed by other evidence.
#[test]
fn what_is_not_measured_is_no_agreement() {
    let orders = |e: &SystemEvidence| (e.orders.measured, e.orders.of);
    let e = crosscheck_system(&example("two-position-alignment"), 1).expect("evidence");
    assert_eq!((e.passed, orders(&e)), (true, (0, 10)));
    assert!(
        e.quantities
            .iter()
            .all(|q| !q.slope.outcome.is_resolved() && q.inflation.outcome == Agreement::Agrees)
    );
    // three states in closed form: degrees 0, 1, 2
    let chain = "name='c'\n[states]\nx='y'\ny='z'\nz='0'\n[outputs]\no='x'\n[simulation]\nduration=1\nstep=0.1\n\
                 noise={o=0.01}\nvalues={x=1, y=1, z=1}";
    let e = crosscheck_system(&model_file::read(chain).expect("a model"), 1).expect("evidence");
    assert!(e.passed && orders(&e) == (3, 3) && e.checks == 7, "{e:?}");
    assert!(e.quantities.iter().all(|q| q.slope.outcome == Agreement::Agrees));
}

/// A pendulum that starts at rest: the slopes rise and fall with the horizon until rounding dominates. Two
/// horizons that agree by chance refute nothing.
#[test]
fn slopes_that_do_not_settle_are_not_measured() {
    for (theta, input) in [("0.5", "sin(t)"), ("1", "0.5*cos(3*t)")] {
        let text = format!(
            "name='pendulum'\nparameters=['k', 'c', 'b', 's', 'o']\nknown_inputs={{u='generic'}}\n[states]\n\
             theta='omega'\n\
             omega='-k*sin(theta) - c*omega + b*u'\n[outputs]\ny='s*cos(theta) + o'\n[simulation]\nduration=10\n\
             step=0.01\n\
             noise={{y=1e-3}}\ninputs={{u='{input}'}}\nvalues={{theta={theta}, omega=0, k=20, c=0.3, b=1, s=1.2, \
             o=0.1}}"
        );
        let e = crosscheck_system(&model_file::read(&text).expect("a model"), 1).expect("evidence");
        assert!(e.passed && (e.orders.measured, e.orders.of) == (0, 7), "{e:?}");
    }
}

/// The filter of a model is consistent if all unknowns are observable. A relinearised filter gains false
/// information along unobservable directions, and the run names the unknowns.
#[test]
fn filters_of_models() {
    let (run, traces) = simulate_system(&example("two-position-alignment"), 1).expect("a run");
    assert!(run.consistency.consistent, "{run:?}");
    for e in &run.quantities {
        assert!(e.sigma < e.prior_sigma && e.error_over_sigma.abs() < 4.0, "{e:?}");
    }
    assert_eq!((traces.time.len(), traces.series.len()), (1201, 10));
    // phE and bN are indistinguishable in the first half, and known afterwards
    let sigma = |name: &str, k: usize| {
        traces.series[traces.names.iter().position(|n| n == name).expect("a state")].sigma[k]
    };
    assert!(sigma("bN", 600) > 100.0 * sigma("bN", 1200));
    let (prey, _) = simulate_system(&example("lotka-volterra"), 1).expect("a run");
    let beyond: Vec<&str> =
        prey.quantities.iter().filter(|e| e.error_over_sigma.abs() > 4.0).map(|e| e.name.as_str()).collect();
    assert_eq!((beyond, prey.consistency.consistent), (vec!["x2", "b"], false));
    // the observable product is estimated correctly
    let of = |name: &str| prey.quantities.iter().find(|e| e.name == name).expect("an unknown");
    let product = of("b").estimate * of("x2").estimate / (of("b").truth * of("x2").truth);
    assert!((product - 1.0).abs() < 0.03, "{product}");
    // the same seed gives the same run; a missing value is named
    assert_eq!(simulate_system(&example("lotka-volterra"), 1).expect("a run").0, prey);
    let error = simulate_system(&example("platform-as-model"), 1).map(|r| r.0).expect_err("no numbers");
    assert!(error.to_string().contains("no value; expected one under [simulation.values]"), "{error}");
}

/// Solving expressions against derivatives by hand (chain rule, in floating point), and through the whole
/// program.
#[cfg(feature = "symbolica")]
#[test]
fn solving_expressions() {
    use obsdeg_core::language::{Names, evaluate_f64, parse_with};
    let solved = |file: &str| -> (BTreeMap<String, String>, Value) {
        let answer = crate::program::json(&["analyze", "--format", "json", "--model", file]);
        let of = |q: &Value| Some((q["name"].as_str()?.to_string(), q["solution"].as_str()?.to_string()));
        (
            answer["quantities"].as_array().into_iter().flatten().filter_map(of).collect(),
            answer["note"].clone(),
        )
    };
    let at = |text: &str, values: &[(&str, f64)]| {
        // the parser does not accept `y''`
        let text = text.replace("'''", "_3").replace("''", "_2").replace('\'', "_1");
        let parsed = parse_with(&text, Names::Plain).expect("an expression");
        evaluate_f64(&parsed, &|name| {
            values.iter().find(|v| v.0 == name).unwrap_or_else(|| panic!("{name}")).1
        })
    };

    // y = k I; I'/I = a, a' = beta S', S' = -beta S I
    let (s, i, beta, gamma, k) = (0.9f64, 0.1, 0.5, 0.2, 0.3);
    let a = beta * s - gamma;
    let s1 = -beta * s * i;
    let (a1, a2) = (beta * s1, -beta * beta * (s1 * i + s * a * i));
    let y: Vec<f64> = [1.0, a, a * a + a1, a.powi(3) + 3.0 * a * a1 + a2].iter().map(|x| k * i * x).collect();
    let (sir, note) = solved("examples/sir/model.toml");
    assert_eq!((sir.keys().map(String::as_str).collect::<Vec<_>>(), note), (vec!["gamma"], Value::Null));
    let found = at(&sir["gamma"], &[("y", y[0]), ("y_1", y[1]), ("y_2", y[2]), ("y_3", y[3])]);
    assert!((found - gamma).abs() < 1e-9, "{found}");

    // an input: y' = -(p/V) y + u/V, so that y'' and u' solve for both
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("m.toml");
    let text = "name = \"m\"\n[states]\nx = \"-p*x/V + u/V\"\n[parameters]\np = {}\nV = {}\n[known_inputs]\n\
                u = \"generic\"\n[outputs]\ny = \"x\"\n";
    std::fs::write(&file, text).expect("written");
    let (clearance, _) = solved(&file.display().to_string());
    let (x, p, v, u, u1) = (0.7, 0.4, 2.5, 1.3, -0.6);
    let y1 = (u - p * x) / v;
    let y2 = (u1 - p * y1) / v;
    let values = [("y", x), ("y_1", y1), ("y_2", y2), ("u", u), ("u_1", u1), ("p", p), ("V", v), ("x", x)];
    for (name, truth) in [("p", p), ("V", v), ("x", x)] {
        let found = at(&clearance[name], &values);
        assert!((found - truth).abs() < 1e-9, "{name} = {}: {found}", clearance[name]);
    }
    // the note says why an unknown has no expression
    let (none, note) = solved("examples/bearing-only/model.toml");
    assert!(none.is_empty() && note.as_str().is_some_and(|n| n.contains("without functions")), "{note}");
}

/// 1/x grows by 2k in time and y = s1/(1/x + s2), so 1/x and s2 can be shifted against each other. A
/// three-digit number in a direction is recovered exactly.
#[test]
fn directions_that_are_polynomials() {
    let read = |states: &str, parameters: &str, y: &str| {
        let text =
            format!("name = \"m\"\n[states]\n{states}\n[parameters]\n{parameters}\n[outputs]\ny = \"{y}\"\n");
        let model = model_file::read(&text).expect("a model");
        let options = SystemOptions { solutions: false, ..SystemOptions::default() };
        let a = analyze_system(&model, options).expect("judged");
        assert!(a.other_directions.is_empty(), "{:?}", a.other_directions);
        a.symmetries.into_iter().map(|s| s.words).collect::<Vec<_>>()
    };
    let clock = read("x = \"-2*k*x^2\"", "k = {}\ns1 = {}\ns2 = {}", "s1*x/(1 + s2*x)");
    assert_eq!(clock, ["multiply x by c; divide k, s1, s2 by c", "move x, s2 along x^2, 1"]);
    let tilt = read("v = \"9.81*phi + b\"\nphi = \"0\"\nb = \"0\"", "", "v");
    assert_eq!(tilt, ["add c to phi; subtract 981/100 c from b"]);
}

/// Printed primes allow a model in which they divide a factor: such a model gets other primes.
#[test]
fn nobody_aims_at_the_primes() {
    // the primes of seed 1 from a version in which they did not depend on the input
    let mut product = "1806122528306898383*1665232801720708243".to_string();
    let mut seen: Vec<u64> = Vec::new();
    for _ in 0..4 {
        let text = format!("name='aimed'\n[states]\nx='-x'\n[outputs]\nz='x*{product}'");
        let judged = judge(&model_file::read(&text).expect("a model"), 1, None).expect("judged");
        assert_eq!((judged.findings.degrees.rank(), degree_of(&judged, "x")), (1, Some(0)), "{product}");
        let [p, q] = judged.fields.expect("a rational model").map(|f| f.modulus());
        seen.extend([p, q]);
        product = format!("{product}*{p}*{q}");
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 8);
}

/// The choice of primes depends on everything that affects a verdict, and on nothing else.
#[test]
fn the_input_chooses_the_primes() {
    let first = |text: &str| {
        let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
        model.random(1, "verdicts").next_u64()
    };
    let plain = "name='m'\nparameters=['a', 'b']\nknown_inputs={u='generic'}\nunknown_inputs={w='arbitrary'}\n\
                 [constants]\nc=2\n\
                 [states]\nx='-a*x + u'\ny={equation='c*x + w', initial=1}\n[outputs]\nz='b*y'\n";
    let words = plain.replace("name='m'", "name='another'\ndescription='words'");
    assert_eq!(first(plain), first(&words));
    let mut seen = vec![first(plain)];
    for (old, new) in [
        ("-a*x", "-2*a*x"),
        ("z='b*y'", "q='b*y'"),
        ("z='b*y'", "z='b*y'\nq='x'"),
        ("u='generic'", "u='constant'"),
        ("u='generic'", "u={function='t'}"),
        ("w='arbitrary'", "w={polynomial=1}"),
        ("initial=1", "initial=2"),
        (", initial=1", ""),
        ("c=2", "c=3"),
        ("name='m'", "name='m'\nexperiments=2"),
        ("name='m'", "name='m'\ncombinations=['a*b']"),
        ("[states]", "[definitions]\nd='a'\n[states]"),
        ("z='b*y'\n", "z='b*y'\n[[segment]]\n[[segment]]\n"),
        ("z='b*y'\n", "z='b*y'\n[[segment]]\n[[segment]]\nconstants={c=5}\n"),
        ("z='b*y'\n", "z='b*y'\n[[segment]]\n[[segment]]\ncarry={x='x + 1'}\n"),
    ] {
        assert!(plain.contains(old));
        seen.push(first(&plain.replace(old, new)));
    }
    let all = seen.len();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), all);
}

/// Three solutions for w2 and c of `hiv_latent`, by hand: y2 = x4 obeys
/// `(D + c)(D + w2)(D + K) x4 = k2 q2 (D + K) u + k1 k2 q1 u` with K = k1 + w1 and the known u = b x1 x4. So
/// c, w2 and K are the roots of one polynomial, in any order, and the right side is attainable with each
/// order. Numerical integration with all six orders gives the same outputs.
#[test]
fn three_solutions_that_give_the_same_outputs() {
    let (_, _, text) = models().into_iter().find(|m| m.0 == "hiv_latent").expect("a reference");
    let model = json::read(&text).expect("a model");
    let found = analyze_system(&model, SystemOptions::default()).expect("judged");
    for name in ["w2", "c"] {
        let q = found.quantities.iter().find(|q| q.name == name).expect("an unknown");
        assert_eq!(q.number_of_solutions, Some(NumberOfSolutions::Counted(3)), "{name}");
    }
    let (b, d, s, k1) = (0.3, 0.2, 1.5, 0.1);
    // k2 q2 and k2 q2 K + k1 k2 q1; x4 and its derivatives at the start
    let (alpha, beta) = (0.7, 1.3);
    let (x1, x4, v4, a4) = (2.0, 1.0, 0.4, -0.3);
    let outputs = |c: f64, w2: f64, k: f64| {
        let (k2, q2, w1) = (1.0, alpha, k - k1);
        let q1 = (beta - alpha * k) / k1;
        let x3 = v4 + c * x4;
        let x2 = (a4 + c * v4 - b * q2 * x1 * x4 + w2 * x3) / k1;
        let f = |x: [f64; 4]| {
            let [x1, x2, x3, x4] = x;
            [
                -b * x1 * x4 - d * x1 + s,
                b * q1 * x1 * x4 - k1 * x2 - w1 * x2,
                b * q2 * x1 * x4 + k1 * x2 - w2 * x3,
                -c * x4 + k2 * x3,
            ]
        };
        let step = |x: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|i| x[i] + h * k[i]);
        let (mut x, h) = ([x1, x2, x3, x4], 0.005);
        let mut seen = Vec::new();
        for _ in 0..1000 {
            let a = f(x);
            let b = f(step(x, a, h / 2.0));
            let c = f(step(x, b, h / 2.0));
            let d = f(step(x, c, h));
            x = std::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
            seen.extend([x[0], x[3]]);
        }
        seen
    };
    let (p, q, r) = (0.4, 0.9, 1.6);
    let first = outputs(p, q, r);
    for (c, w2, k) in [(p, r, q), (q, p, r), (q, r, p), (r, p, q), (r, q, p)] {
        let other = outputs(c, w2, k);
        assert!(first.iter().zip(&other).all(|(x, y)| (x - y).abs() < 1e-8), "{c} {w2} {k}");
    }
    // another value of c changes the outputs
    let wrong = outputs(0.5, q, r);
    assert!(first.iter().zip(&wrong).any(|(x, y)| (x - y).abs() > 1e-3));
}

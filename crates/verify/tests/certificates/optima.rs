//! Certificates of proven optima of random searches, and changed ones, compared by both checkers and
//! with the simulation of every sequence.

use nalgebra::DMatrix;
use obsdeg_core::degree::judge;
use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Carry, Platform, Scheme};
use obsdeg_design::DegreeCap;
use obsdeg_design::design::{
    Candidates, CriterionName, DesignError, DesignOptions, OptimumCertificate, certify_optimum, design,
};
use obsdeg_evidence::simulation::{Attained, Conditions};
use obsdeg_exact::SplitMix64;
use obsdeg_verify::{Replay, verify, verify_with};
use serde_json::{Value, json};

use crate::python::Python;
use crate::schemes::pick;

/// Search for the best sequence.
struct Task {
    base: Scheme,
    conditions: Conditions,
    options: DesignOptions,
}

const CRITERIA: [CriterionName; 5] =
    [CriterionName::Worst, CriterionName::A, CriterionName::D, CriterionName::E, CriterionName::Margin];

/// Random cardinal candidates.
fn candidates(rng: &mut SplitMix64, count: usize) -> Candidates {
    let mut out = Candidates::default();
    while out.attitudes.len() < count {
        let angles = Candidates::cardinals().attitudes[rng.below(24) as usize].clone();
        if !out.attitudes.contains(&angles) {
            out.names.push(format!("c{}", out.names.len() + 1));
            out.attitudes.push(angles);
        }
    }
    out
}

/// Random search with few sequences; carries and criteria alternate.
fn draw(rng: &mut SplitMix64, i: usize) -> Task {
    let carry = [Carry::Platform, Carry::Inertial, Carry::Reset][i % 3];
    let criterion = CRITERIA[i / 3 % CRITERIA.len()];
    let terms = *pick(rng, &["F", "F,I", "F,S", "F,O,S", "F,I,O,S", "K0", "F,K0", "K0,K1"]);
    let mixed =
        ["F,K0", "K0,K1"].contains(&terms) && !matches!(criterion, CriterionName::D | CriterionName::Margin);
    let terms = if mixed { "F" } else { terms };
    let base = Scheme {
        carry,
        latitude: pick(rng, &["28.2", "28.2", "45", "-33.868", "70"]).parse().ok(),
        unknowns: terms.parse().expect("terms"),
        measured_azimuth: rng.below(6) == 0,
        ..Scheme::default()
    };
    let families: Vec<String> =
        terms.split(',').map(|t| if t.starts_with('K') { t.into() } else { format!("D_{t}") }).collect();
    let mut conditions = Conditions {
        dwell_s: *pick(rng, &[500.0, 1000.0, 1234.5]),
        step_s: *pick(rng, &[10.0, 50.0, 100.0]),
        ..Conditions::default()
    };
    if criterion == CriterionName::Margin {
        for name in families.iter().take(1 + rng.below(2) as usize) {
            conditions
                .requirements
                .push(Assignment { name: name.clone(), value: *pick(rng, &[0.01, 0.1, 3.0]) });
        }
    }
    let options = DesignOptions {
        positions: Some(1 + rng.below(4) as usize),
        degree_caps: match rng.below(4) {
            0 => vec![DegreeCap { name: None, cap: 1 + rng.below(2) as usize }],
            _ => Vec::new(),
        },
        criterion,
        keep: 3,
        candidates: {
            let count = 3 + rng.below(3) as usize;
            candidates(rng, count)
        },
        ..DesignOptions::default()
    };
    Task { base, conditions, options }
}

/// Certificate of a search, and its text; `None` if no sequence is sufficient.
fn certified(task: &Task) -> Option<(OptimumCertificate, String)> {
    let Task { base, conditions, options } = task;
    let found = match design(base, conditions, options, &|_| true) {
        Err(DesignError::Impossible { .. }) => return None,
        found => found.expect("a search"),
    };
    match certify_optimum(base, conditions, options, &found, &|_| true) {
        // sequences that double precision does not determine
        Err(DesignError::NoCertificate { found }) if found.contains("double precision") => None,
        certificate => {
            let certificate = certificate.expect("a certificate");
            let written = serde_json::to_string(&certificate).expect("JSON");
            Some((certificate, written))
        }
    }
}

/// Smallest worst degree and criterion of all sequences by the simulation's information filter,
/// independent of the search and the checkers.
fn best_by_simulation(task: &Task, required: &[String]) -> Option<(usize, f64)> {
    let Task { base, conditions, options } = task;
    let (n, k) = (options.candidates.attitudes.len(), options.positions.unwrap_or(1));
    let mut best: Option<(usize, f64)> = None;
    for code in 0..n.pow(k as u32) {
        let attitudes = (0..k as u32).map(|j| options.candidates.attitudes[code / n.pow(j) % n].clone());
        let scheme = Scheme { positions: Scheme::of_angles(attitudes).positions, ..base.clone() };
        let platform = Platform::new(scheme.clone()).expect("a scheme");
        let column = |name: &String| platform.names().iter().position(|n| n == name).expect("a name");
        let columns: Vec<usize> = required.iter().map(column).collect();
        let degrees = judge(&platform, 3).expect("verdicts").degrees.degree;
        let degrees: Option<Vec<usize>> = columns.iter().map(|&c| degrees[c]).collect();
        let cap = options.degree_caps.first().map_or(usize::MAX, |c| c.cap);
        let Some(degree) = degrees.and_then(|d| d.into_iter().max()).filter(|d| *d <= cap) else { continue };
        if best.is_some_and(|b| b.0 < degree) {
            continue;
        }
        let attained = Attained::new(&scheme, conditions, 1).expect("sigmas");
        let sigmas: Option<Vec<f64>> = columns.iter().map(|&c| attained.sigmas[c]).collect();
        let Some(sigmas) = sigmas else { continue };
        let covariance = attained.covariance_of(&columns).expect("a covariance");
        let scale: Vec<f64> = sigmas.iter().enumerate().map(|(i, s)| s / covariance[(i, i)].sqrt()).collect();
        let shown =
            DMatrix::from_fn(columns.len(), columns.len(), |i, j| covariance[(i, j)] * scale[i] * scale[j]);
        let count = columns.len() as f64;
        let limit = |name: &String| {
            let own = conditions.requirements.iter().find(|r| name.starts_with(&r.name));
            own.map_or(f64::INFINITY, |r| r.value)
        };
        let value = match options.criterion {
            CriterionName::Worst => sigmas.iter().copied().fold(0.0, f64::max),
            CriterionName::A => (shown.trace() / count).sqrt(),
            CriterionName::D => {
                shown.symmetric_eigenvalues().iter().map(|x| x.ln() / (2.0 * count)).sum::<f64>().exp()
            }
            CriterionName::E => shown.symmetric_eigenvalues().max().sqrt(),
            CriterionName::Margin => {
                sigmas.iter().zip(required).map(|(s, name)| s / limit(name)).fold(0.0, f64::max)
            }
        };
        if best.is_none_or(|b| degree < b.0 || value < b.1) {
            best = Some((degree, value));
        }
    }
    best
}

fn said(sentences: &[String], part: &str) -> bool {
    sentences.iter().any(|s| s.contains(part))
}

/// Both checkers accept the certificates of `count` random searches, with all blocks searched again.
/// For every tenth the simulation finds the same optimum among all sequences.
fn accept(count: usize, seed: u64, simulated: usize) {
    let mut rng = SplitMix64::new(seed);
    let mut python = Python::start();
    let (mut done, mut drawn, mut sequences, mut compared) = (0, 0, 0, 0);
    while done < count {
        let task = draw(&mut rng, drawn);
        drawn += 1;
        let Some((certificate, json)) = certified(&task) else { continue };
        let all = Replay { blocks: Some(usize::MAX), seed: None };
        let sentences = verify_with(json.as_bytes(), None, &all).unwrap_or_else(|e| panic!("{e}\n{json}"));
        assert!(said(&sentences, "Proven: ") && !said(&sentences, "Believed"), "{sentences:?}");
        if let Some(python) = &mut python {
            let (accepted, said) = python.asks(&json, None);
            assert!(accepted && said.contains("Proven: "), "{said}\n{json}");
            // the sets judged, the turns of the axes and the counts are the same
            let plain = |s: &str| s.replace("e-0", "e-").replace("e+00", "e0");
            let counts = |s: &str| s.split(" of worst degree").next().map(plain);
            let blocks = |text: &mut dyn Iterator<Item = &str>| {
                text.filter(|s| s.contains("locks")).filter_map(counts).collect::<Vec<_>>()
            };
            assert_eq!(
                blocks(&mut said.lines()),
                blocks(&mut sentences.iter().map(String::as_str)),
                "{json}"
            );
        }
        if compared < simulated
            && certificate.problem.candidates.len().pow(certificate.problem.positions as u32) <= 130
        {
            let required: Vec<String> = certificate.problem.required.iter().map(|r| r.name.clone()).collect();
            let (degree, value) = best_by_simulation(&task, &required).expect("an optimum");
            // the covariance of the simulation is a difference of variances, and its determinant
            // magnifies rounding
            let within = if task.options.criterion == CriterionName::D { 2e-3 } else { 1e-5 };
            let claimed = certificate.best[0].value;
            assert!(
                degree == certificate.degree && (value / claimed - 1.0).abs() < within,
                "{degree} {value} {claimed}\n{json}"
            );
            compared += 1;
        }
        sequences += certificate.sequences;
        done += 1;
    }
    println!("{count} certificates of {drawn} searches, {sequences} sequences, {compared} simulated");
    assert!(compared == simulated && drawn < 4 * count && sequences > 20 * count as u64);
}

#[test]
fn both_checkers_accept_optima_of_random_searches() {
    accept(10, 42, 3);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn both_checkers_accept_optima_of_200_random_searches() {
    accept(200, 4242, 40);
}

/// Changes that make a false claim, and the place that a refusal must name.
const CHANGES: [(&str, &str); 15] = [
    ("a value lowered", "best.0.value"),
    ("a winner swapped", "best.0"),
    ("a degree", "worst degree"),
    ("a bound raised", "blocks."),
    ("a bound below the best", "bound"),
    ("no bound", "blocks."),
    ("a block left out", "blocks"),
    ("a block twice", "blocks"),
    ("a count", "sequences"),
    ("the sum of the counts", "sequences"),
    ("a candidate", ": "),
    ("the carry", ": "),
    ("the criterion", ": "),
    ("the samples", "best.0.value"),
    ("the noise", "best.0.value"),
];

/// Change of a certificate; `None` if there is no place for it, or the claim stays true.
fn changed(rng: &mut SplitMix64, what: &str, value: &Value) -> Option<Value> {
    let mut out = value.clone();
    let blocks = value["blocks"].as_array()?;
    let least = value["best"][0]["value"].as_f64()?;
    let bounds: Vec<(usize, f64)> =
        blocks.iter().enumerate().filter_map(|(i, b)| Some((i, b["bound"].as_f64()?))).collect();
    let (block, bound) = *pick(rng, &bounds);
    let any = rng.below(blocks.len() as u64) as usize;
    let problem = &value["problem"];
    match what {
        "a value lowered" => out["best"][0]["value"] = json!(least * 0.999),
        "a winner swapped" => {
            let n = problem["candidates"].as_array()?.len() as u64;
            let sequence = out["best"][0]["sequence"].as_array_mut()?;
            let before = sequence.clone();
            sequence[0] = json!(1 + sequence[0].as_u64()? % n);
            // an image or another order may be as good
            let alone = problem["carry"] != "reset" || before.len() == 1;
            if !alone || verify(out.to_string().as_bytes(), None).is_ok() {
                return None;
            }
        }
        "a degree" => out["degree"] = json!((value["degree"].as_u64()? + 1) % 3),
        // a bound is nine tenths of the way from the best to the least value, or to the cap
        "a bound raised" if bound < 8.9 * least => {
            let value = least + (bound - least) / 0.9;
            out["blocks"][block]["bound"] = json!(value * 1.01);
        }
        "a bound below the best" => out["blocks"][block]["bound"] = json!(least * 0.999),
        "no bound" => out["blocks"][block]["bound"] = Value::Null,
        "a block left out" => drop(out["blocks"].as_array_mut()?.remove(any)),
        "a block twice" => out["blocks"].as_array_mut()?.insert(any, blocks[any].clone()),
        "a count" => out["blocks"][any]["sequences"] = json!(blocks[any]["sequences"].as_u64()? + 1),
        "the sum of the counts" => out["sequences"] = json!(value["sequences"].as_u64()? + 1),
        // one attitude alone may be as good as any other
        "a candidate" if value["best"][0]["sequence"].as_array()?.windows(2).any(|w| w[0] != w[1]) => {
            let used = value["best"][0]["sequence"][0].as_u64()? as usize - 1;
            out["problem"]["candidates"][used] = json!(["12.3", "-45.6", "78.9"]);
        }
        // one position has one carry
        "the carry" if problem["positions"].as_u64()? > 2 => {
            out["problem"]["carry"] = json!(if problem["carry"] == "reset" { "platform" } else { "reset" });
        }
        "the criterion" if problem["criterion"] != "margin" && problem["required"].as_array()?.len() > 1 => {
            let other = if problem["criterion"] == "a" { "worst" } else { "a" };
            out["problem"]["criterion"] = json!(other);
        }
        "the samples" => out["problem"]["samples"] = json!(2 * problem["samples"].as_u64()?),
        // beside a measured azimuth this noise may have no effect
        "the noise" if problem["measured_azimuth"] == false => {
            out["problem"]["noise_g"] = json!(problem["noise_g"].as_f64()? * 1.01)
        }
        _ => return None,
    }
    Some(out)
}

/// Both checkers refuse `count` changes of every kind, with all blocks searched again.
fn refuse(count: usize, seed: u64) {
    let mut rng = SplitMix64::new(seed);
    let mut python = Python::start();
    let mut done = [0; CHANGES.len()];
    let mut drawn = 0;
    while done.iter().any(|d| *d < count) {
        let task = draw(&mut rng, drawn);
        drawn += 1;
        assert!(drawn < 200 * count, "{done:?}");
        let Some((_, json)) = certified(&task) else { continue };
        let value: Value = serde_json::from_str(&json).expect("JSON");
        for (done, (what, place)) in done.iter_mut().zip(CHANGES) {
            let Some(changed) = changed(&mut rng, what, &value).filter(|_| *done < count) else { continue };
            let changed = changed.to_string();
            let refused = match verify(changed.as_bytes(), None) {
                // all coefficients alike: every criterion has one value
                Ok(_) if what == "the criterion" => continue,
                accepted => accepted.expect_err(&format!("{what}\n{json}\n{changed}")).to_string(),
            };
            assert!(refused.contains(place), "{what}: {refused}");
            if let Some(python) = &mut python {
                let (accepted, said) = python.asks(&changed, None);
                assert!(!accepted && said.contains(place), "{what}: {said}\n{changed}");
            }
            *done += 1;
        }
    }
}

#[test]
fn both_checkers_refuse_changed_optima() {
    refuse(3, 7);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn both_checkers_refuse_100_changes_of_optima_of_every_kind() {
    refuse(100, 77);
}

fn cardinals(carry: Carry, positions: usize) -> Task {
    let base = Scheme { carry, latitude: "28.2".parse().ok(), ..Scheme::default() };
    let options = DesignOptions { positions: Some(positions), ..DesignOptions::default() };
    Task { base, conditions: Conditions { step_s: 50.0, ..Conditions::default() }, options }
}

/// The cardinal attitudes: one first candidate represents all, since all 24 turns of the platform axes
/// map the attitudes to themselves. Without the image of a start a block is missing. The number of
/// blocks searched again is the number asked for.
#[test]
fn symmetry_and_a_choice_of_blocks() {
    let (certificate, json) = certified(&cardinals(Carry::Platform, 4)).expect("an optimum");
    assert_eq!((certificate.blocks.len(), certificate.sequences), (24, 24 * 24 * 24));
    let some = Replay { blocks: Some(2), seed: Some(5) };
    let sentences = verify_with(json.as_bytes(), None, &some).expect("accepted");
    assert!(said(&sentences, "24 turns of the platform axes"), "{sentences:?}");
    assert!(
        said(&sentences, "2 of 24 blocks searched again, chosen by seed 5: 1152 sequences"),
        "{sentences:?}"
    );
    assert!(
        said(&sentences, "Believed only: the bounds of the other 22 blocks, 12672 sequences."),
        "{sentences:?}"
    );
    // the same blocks again, and others by another seed
    assert_eq!(sentences, verify_with(json.as_bytes(), None, &some).expect("accepted"));
    let mut python = Python::start();
    if let Some(python) = &mut python {
        let (accepted, said) = python.replays(&json, 1, 5);
        assert!(
            accepted && said.contains("1 of 24 blocks searched again, chosen by seed 5: 576 sequences"),
            "{said}"
        );
    }
    // with one candidate less the symmetry is lost, and every first candidate needs blocks
    let mut value: Value = serde_json::from_str(&json).expect("JSON");
    value["problem"]["candidates"].as_array_mut().expect("candidates").pop();
    let refused = verify(value.to_string().as_bytes(), None).expect_err("no symmetry").to_string();
    assert!(refused.starts_with("b"), "{refused}");
}

/// Both checkers refuse searches that double precision cannot decide, and name the place: candidates
/// that are nearly alike, only some of the coefficients, a latitude near the equator, and numbers
/// without any measurement.
#[test]
fn searches_beyond_double_precision_are_refused() {
    let (_, json) = certified(&cardinals(Carry::Platform, 4)).expect("a certificate");
    let mut python = Python::start();
    let problem = |key: &str, to: Value| {
        let mut value: Value = serde_json::from_str(&json).expect("JSON");
        value["problem"][key] = to;
        (format!("problem.{key}"), value)
    };
    let mut candidates = problem("candidates", Value::Null);
    candidates.1["problem"]["candidates"] =
        serde_json::from_str::<Value>(&json).expect("JSON")["problem"]["candidates"].clone();
    candidates.1["problem"]["candidates"][2][2] = json!("0.01");
    let mut required = problem("required", Value::Null);
    required.1["problem"]["required"] =
        serde_json::from_str::<Value>(&json).expect("JSON")["problem"]["required"].clone();
    required.1["problem"]["required"].as_array_mut().expect("a list").pop();
    let cases = [
        candidates,
        required,
        problem("latitude_deg", json!("0.5")),
        problem("dwell_s", json!(1e-300)),
        problem("noise_g", json!(1e-160)),
        problem("noise_g", json!(6e-153)),
        problem("samples", json!(1)),
        problem("samples", json!(100_000)),
    ];
    for (place, value) in cases {
        let text = value.to_string();
        let refused = verify(text.as_bytes(), None).expect_err(&place).to_string();
        assert!(refused.starts_with(&place), "{place}: {refused}");
        if let Some(python) = &mut python {
            let (accepted, said) = python.replays(&text, 1, 5);
            assert!(!accepted && said.contains(&place), "{place}: {said}");
        }
    }
}

/// Near a pole, with a dwell of seconds, the value of a sequence is rounding. A claim that agrees with
/// the checker's own value to all digits is refused by the pivots.
#[test]
fn values_that_are_rounding_are_refused() {
    let (_, json) = certified(&cardinals(Carry::Platform, 4)).expect("a certificate");
    let mut python = Python::start();
    type Checker<'a> = Box<dyn FnMut(&str) -> String + 'a>;
    let mut checkers: Vec<Checker<'_>> =
        vec![Box::new(|text| verify(text.as_bytes(), None).expect_err("refused").to_string())];
    if let Some(python) = &mut python {
        checkers.push(Box::new(|text| {
            let (accepted, said) = python.replays(text, 1, 5);
            assert!(!accepted, "{said}");
            said
        }));
    }
    for said in &mut checkers {
        let mut value: Value = serde_json::from_str(&json).expect("JSON");
        value["best"].as_array_mut().expect("a list").truncate(1);
        let problem = &mut value["problem"];
        (problem["latitude_deg"], problem["dwell_s"], problem["samples"]) =
            (json!("89"), json!(10), json!(5));
        let first = said(&value.to_string());
        let computed = first.split("best.0.value: expected ").nth(1).expect(&first);
        let computed: f64 = computed.split([';', ',']).next().expect("a number").parse().expect(computed);
        value["best"][0]["value"] = json!(computed);
        let second = said(&value.to_string());
        assert!(second.contains("best.0.value: expected pivots from"), "{second}");
    }
}

/// Searches that certificates do not cover are refused, and the sentence names the uncovered part.
#[test]
fn what_certificates_of_optima_do_not_cover() {
    let plain = || cardinals(Carry::Inertial, 4);
    let with = |change: &dyn Fn(&mut Task)| {
        let mut task = plain();
        change(&mut task);
        task
    };
    let cases = [
        (with(&|t| t.options.positions = None), "a search for the fewest positions"),
        (with(&|t| t.options.refine = true), "--refine"),
        (with(&|t| t.options.required.push("D_F".into())), "some of the coefficients alone"),
        (
            with(&|t| t.options.candidates.attitudes[0][0] = obsdeg_core::model::Angle::from_degrees(10)),
            "candidates that are not cardinal",
        ),
        (with(&|t| t.options.divide = true), "--divide"),
        (with(&|t| t.options.meet = true), "--meet"),
        (with(&|t| t.options.total_s = Some(1e5)), "--max-time"),
        (with(&|t| t.options.slew_s = Some(1e5)), "--max-slew"),
        (with(&|t| t.options.free = Some(5)), "--candidates free"),
        (with(&|t| t.conditions.slew_rate_deg_s = Some(1.0)), "slews that take time"),
        (with(&|t| t.conditions.bench.push(Assignment { name: "K0".into(), value: 1.0 })), "a bench"),
        (
            with(&|t| t.conditions.priors.push(Assignment { name: "psi".into(), value: 1.0 })),
            "a stated prior",
        ),
        (with(&|t| t.conditions.accelerometer_instability_ug = 10.0), "a bias instability"),
        (
            with(&|t| {
                t.conditions.drift_noise = obsdeg_core::model::settings::DriftNoise::OneStep(0.01);
                t.conditions.stated.drift_noise = true;
            }),
            "random drift (--drift-noise",
        ),
        (with(&|t| t.conditions.dwell_s = 1.0), "a dwell outside 10 s"),
        (with(&|t| t.conditions.step_s = 0.01), "samples outside 5 to 10,000"),
        (with(&|t| t.conditions.accelerometer_noise_g = 0.1), "noise outside 1e-9 g"),
    ];
    for (Task { base, conditions, options }, what) in cases {
        let refused = obsdeg_design::design::check_certifiable(&base, &conditions, &options);
        let refused = refused.expect_err(what).to_string();
        assert!(refused.starts_with(&format!("no certificate: found {what}")), "{refused}");
    }
    // eight of the cardinal attitudes are not searched exhaustively
    let Task { base, conditions, options } = cardinals(Carry::Reset, 12);
    let found = design(&base, &conditions, &options, &|_| true).expect("a scheme");
    let refused = certify_optimum(&base, &conditions, &options, &found, &|_| true).expect_err("not proven");
    assert!(refused.to_string().contains("an answer that is not proven to be the best"), "{refused}");
}

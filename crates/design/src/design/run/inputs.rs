//! Inputs of a search in parts: their digest, and the options and file that a user writes to state them.

use std::collections::BTreeMap;
use std::fmt::Debug;

use obsdeg_core::model::Scheme;
use obsdeg_core::model::angles_text;
use obsdeg_core::model::scheme_file::write;
use obsdeg_evidence::simulation::Conditions;
use sha2::{Digest, Sha256};

use crate::design::request::candidates::Candidates;
use crate::design::request::options::{CriterionName, DesignOptions};
use crate::design::run::winner::under;

/// Inputs of a search in parts.
pub(crate) struct Inputs {
    /// Options by name, and lines of the scheme file that states all conditions: `section.key` and its value.
    /// Options that are not given are left out.
    pub(crate) written: BTreeMap<String, String>,
    /// SHA-256 of all inputs, exactly.
    pub(crate) digest: String,
}

impl Inputs {
    pub(crate) fn new(base: &Scheme, conditions: &Conditions, options: &DesignOptions) -> Self {
        let mut written = options_written(options);
        written.insert("version".into(), env!("CARGO_PKG_VERSION").into());
        let file = write(&under(base, conditions, Vec::new(), Some(conditions.dwell_s)));
        written.extend(lines(&file));
        Self { written, digest: sha256(&everything(base, conditions, options)) }
    }
}

/// SHA-256 of a text, in hexadecimal digits.
pub(crate) fn sha256(text: &str) -> String {
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Options by name as a user writes them; those that are not given are left out.
fn options_written(options: &DesignOptions) -> BTreeMap<String, String> {
    let caps = options.degree_caps.iter().map(ToString::to_string);
    let criterion = match options.criterion {
        CriterionName::Worst => "worst",
        CriterionName::A => "a",
        CriterionName::D => "d",
        CriterionName::E => "e",
        CriterionName::Margin => "margin",
    };
    let joined = |list: Vec<String>| (!list.is_empty()).then(|| list.join(","));
    let number = |x: Option<f64>| x.map(|x| x.to_string());
    let flag = |given: bool| given.then(|| "true".to_string());
    let written = [
        ("--candidates", Some(candidates_written(&options.candidates))),
        ("--positions", options.positions.map(|k| k.to_string())),
        ("--observable", joined(options.required.clone())),
        ("--max-degree", joined(caps.collect())),
        ("--immune", joined(options.immune.iter().map(ToString::to_string).collect())),
        ("--meet", flag(options.meet)),
        ("--max-time", number(options.total_s)),
        ("--max-slew", number(options.slew_s)),
        ("--criterion", Some(criterion.into())),
        ("--keep", Some(options.keep.to_string())),
        ("--restarts", Some(options.restarts.to_string())),
        ("--refine", flag(options.refine)),
        ("--divide", flag(options.divide)),
        ("--front", joined(options.front.iter().map(ToString::to_string).collect())),
        ("--seed", Some(options.seed.to_string())),
    ];
    written.into_iter().filter_map(|(name, value)| Some((name.into(), value?))).collect()
}

/// `cardinal`, or `p1 0,0,0; p2 180,0,0`.
fn candidates_written(candidates: &Candidates) -> String {
    if *candidates == Candidates::cardinals() {
        return "cardinal".into();
    }
    let named = candidates.names.iter().zip(&candidates.attitudes).map(|(name, attitude)| {
        let angles = angles_text(attitude);
        if *name == angles { angles } else { format!("{name} {angles}") }
    });
    named.collect::<Vec<_>>().join("; ")
}

/// The lines of a scheme file: `section.key` and its value.
fn lines(file: &str) -> Vec<(String, String)> {
    let (mut section, mut out) = (String::new(), Vec::new());
    for line in file.lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            section = format!("{name}.");
        } else if let Some((key, value)) = line.split_once(" = ") {
            out.push((format!("{section}{key}"), value.into()));
        }
    }
    out
}

/// Text of all inputs that a search of parts depends on, exactly; an unlisted input does not compile.
fn everything(base: &Scheme, conditions: &Conditions, options: &DesignOptions) -> String {
    let version: [(&str, &dyn Debug); 1] = [("version", &env!("CARGO_PKG_VERSION"))];
    [text(&version), of_scheme(base), of_options(options), of_conditions(conditions)].concat()
}

/// Names and values, a line each.
fn text(of: &[(&str, &dyn Debug)]) -> String {
    of.iter().map(|(name, value)| format!("{name}\n{value:?}\n")).collect()
}

/// Inputs by the scheme.
fn of_scheme(base: &Scheme) -> String {
    let Scheme {
        // a design uses only the assumptions of a scheme
        name: _,
        description: _,
        document: _,
        positions: _,
        combinations: _,
        recording: _,
        ageing: _,
        acceptance: _,
        carry,
        latitude,
        geometry,
        unknowns,
        measured_azimuth,
        simulation,
        requirements,
        bench: bench_of_scheme,
        gimbals,
        path,
    } = base;
    let of: [(&str, &dyn Debug); 10] = [
        ("carry", carry),
        ("latitude", latitude),
        ("geometry", geometry),
        ("terms", unknowns),
        ("measured azimuth", measured_azimuth),
        ("settings of the scheme", simulation),
        ("requirements of the scheme", requirements),
        ("bench of the scheme", bench_of_scheme),
        ("gimbals", gimbals),
        ("path", path),
    ];
    text(&of)
}

/// Inputs by the options.
fn of_options(options: &DesignOptions) -> String {
    let DesignOptions {
        // a part searches all sequences
        within: _,
        everywhere: _,
        candidates,
        positions,
        required,
        degree_caps,
        immune,
        meet,
        total_s,
        slew_s,
        criterion,
        keep,
        restarts,
        refine,
        divide,
        front,
        free,
        seed,
    } = options;
    // files of before hold the digest of these pairs
    let degree_caps: Vec<_> = degree_caps.iter().map(|c| (&c.name, c.cap)).collect();
    let of: [(&str, &dyn Debug); 17] = [
        ("candidates", &candidates.names),
        ("angles of candidates", &candidates.attitudes),
        ("positions", positions),
        ("observable", required),
        ("max-degree", &degree_caps),
        ("immune", immune),
        ("meet", meet),
        ("max-time", total_s),
        ("max-slew", slew_s),
        ("criterion", criterion),
        ("keep", keep),
        ("restarts", restarts),
        ("refine", refine),
        ("divide", divide),
        ("front", front),
        ("free", free),
        ("seed", seed),
    ];
    text(&of)
}

/// Inputs by the conditions.
fn of_conditions(conditions: &Conditions) -> String {
    let Conditions {
        truth,
        filter,
        step_s,
        dwell_s,
        settle_s,
        slew_rate_deg_s,
        slews,
        accelerometer_noise_g,
        accelerometer_instability_ug,
        accelerometer_correlation_s,
        azimuth_noise_deg,
        drift_noise,
        drift_noise_step_s,
        gyro_noise,
        propagation,
        values,
        drift_scale,
        estimates,
        priors,
        requirements: required_sigmas,
        bench,
        stated,
    } = conditions;
    let of: [(&str, &dyn Debug); 21] = [
        ("truth", truth),
        ("filter", filter),
        ("step", step_s),
        ("dwell", dwell_s),
        ("slew-rate", slew_rate_deg_s),
        ("slews", slews),
        ("noise", accelerometer_noise_g),
        ("accelerometer-instability", accelerometer_instability_ug),
        ("accelerometer-correlation-time", accelerometer_correlation_s),
        ("azimuth-noise", azimuth_noise_deg),
        ("drift noise", drift_noise),
        ("step of drift noise", drift_noise_step_s),
        ("noise of gyros", gyro_noise),
        ("propagation", propagation),
        ("values", values),
        ("drift scale", drift_scale),
        ("estimates", estimates),
        ("prior", priors),
        ("requirement", required_sigmas),
        ("bench", bench),
        ("stated conditions", stated),
    ];
    // parts of searches of before know no such time
    let settle = (*settle_s > 0.0).then_some(("settle", settle_s as &dyn Debug));
    text(&of) + text(settle.as_slice()).as_str()
}

/// Text `simulation.dwell_s is 999.0, here 1000.0`: inputs that differ; long values are left out.
pub(crate) fn differing(found: &BTreeMap<String, String>, expected: &BTreeMap<String, String>) -> String {
    const LONGEST: usize = 60;
    let value = |of: &BTreeMap<String, String>, name: &String| {
        of.get(name).cloned().unwrap_or_else(|| "not given".into())
    };
    let mut names: Vec<&String> = expected.keys().chain(found.keys()).collect();
    names.sort_unstable();
    names.dedup();
    let differs = names.into_iter().filter_map(|name| {
        let (there, here) = (value(found, name), value(expected, name));
        let short = there.len().max(here.len()) <= LONGEST;
        (there != here)
            .then(|| if short { format!("{name} is {there}, here {here}") } else { format!("{name} differ") })
    });
    let listed: Vec<String> = differs.collect();
    if listed.is_empty() { "its digest is not that of these inputs".into() } else { listed.join("; ") }
}

//! Published systems with known verdicts: the engine for any system against all of them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use obsdeg_core::system::rows::Unknown;
use obsdeg_core::system::{Judgement, json, judge};
use serde_json::Value;

/// The reference models, where they are beside the checkout.
fn models() -> Option<Vec<(String, Value, String)>> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/models");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: no reference models at ../shared/models");
        return None;
    };
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "json"));
    files.sort();
    let read = |file: PathBuf| {
        let text = std::fs::read_to_string(&file).expect("readable");
        let name = file.file_stem().expect("a name").to_string_lossy().into_owned();
        (name, serde_json::from_str(&text).expect("JSON"), text)
    };
    Some(files.into_iter().map(read).collect())
}

fn names(value: &Value) -> Vec<String> {
    value.as_array().into_iter().flatten().filter_map(|v| Some(v.as_str()?.to_string())).collect()
}

/// Degrees by name; of an unknown input that of the signal itself.
fn degrees(j: &Judgement) -> BTreeMap<String, Option<usize>> {
    let of = |(u, d): (&Unknown, &Option<usize>)| (u.derivative == 0).then(|| (u.name.clone(), *d));
    j.layout.unknowns.iter().zip(&j.degrees.degree).filter_map(of).collect()
}

/// What differs from the reference.
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
        let profile = &judged.degrees.rank_profile;
        for (k, rank) in ranks.iter().enumerate() {
            let own = profile.get(k).or(profile.last()).copied().unwrap_or(0);
            if own != *rank {
                out.push(format!("rank {own} at order {k}, expected {rank}"));
            }
        }
    }
    for (text, degree) in names(&reference["observable_combinations"]).iter().zip(&judged.combinations) {
        if degree.is_none() {
            out.push(format!("{text} is not observable"));
        }
    }
    if judged.error_bound > 1e-12 {
        out.push(format!("error bound {:e}", judged.error_bound));
    }
    out
}

#[test]
fn every_reference_verdict_and_order() {
    let Some(models) = models() else { return };
    assert!(models.len() >= 141, "{} models", models.len());
    let mut table = Vec::new();
    for (name, reference, text) in &models {
        table.extend(mismatches(reference, text).into_iter().map(|m| format!("{name}: {m}")));
    }
    assert!(table.is_empty(), "{} mismatches\n{}", table.len(), table.join("\n"));
}

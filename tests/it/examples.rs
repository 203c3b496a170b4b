//! Degree tables of every example as snapshots, under each carry.

use std::fmt::Write;
use std::path::Path;

use obsdeg_core::analysis::{AnalysisOptions, analyze};
use obsdeg_core::model::{Carry, Scheme, Unknowns, scheme_file};
use obsdeg_core::system::{SystemAnalysis, SystemOptions, analyze_system, model_file};

use crate::program::{run, stderr};

fn table(scheme: &Scheme) -> String {
    let options = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
    let a = analyze(scheme, options, None).expect("the example is analysed");
    let profile: Vec<String> = a.rank_profile.iter().map(ToString::to_string).collect();
    let mut out = format!("{} carry: rank profile {} of {}\n", a.carry, profile.join(" "), a.unknowns.len());
    for q in &a.quantities {
        let degree = q.degree.map_or_else(|| "-".to_string(), |k| k.to_string());
        let partners =
            if q.partners.is_empty() { String::new() } else { format!("  with {}", q.partners.join(" ")) };
        writeln!(out, "  {:<9} {degree}  {}{partners}", q.name, q.status).expect("text");
    }
    for c in &a.combinations {
        let degree = c.degree.map_or_else(|| "-".to_string(), |k| k.to_string());
        writeln!(out, "  [{}] {degree}{}", c.expression, if c.requested { "  asked for" } else { "" })
            .expect("text");
    }
    out
}

#[test]
fn degree_tables() {
    insta::with_settings!({ omit_expression => true, prepend_module_to_snapshot => false }, {
        insta::glob!("../../examples", "*/scheme.toml", |path| {
            let name = folder(path);
            if name.starts_with("wrong-") {
                return;
            }
            let text = std::fs::read_to_string(path).expect("readable");
            let scheme = scheme_file::read(&text).expect("a scheme");
            let mut out = String::new();
            for carry in Carry::ALL {
                if scheme.unknowns != Unknowns::Drift || carry == scheme.carry {
                    out.push_str(&table(&Scheme { carry, ..scheme.clone() }));
                }
            }
            insta::assert_snapshot!(format!("degrees_{name}"), out);
        });
    });
}

#[test]
fn wrong_examples_are_refused_with_their_place() {
    insta::with_settings!({ omit_expression => true, prepend_module_to_snapshot => false }, {
        insta::glob!("../../examples", "wrong-*/scheme.toml", |path| {
            let name = folder(path);
                        let relative = format!("examples/{name}/scheme.toml");
            let run = run(&["analyze", "--scheme", &relative]);
            assert_eq!(run.status.code(), Some(2));
            assert!(run.stdout.is_empty());
            insta::assert_snapshot!(format!("refused_{name}"), stderr(&run));
        });
    });
}

fn model_table(a: &SystemAnalysis) -> String {
    let profile: Vec<String> = a.rank_profile.iter().map(ToString::to_string).collect();
    let mut out = format!("rank profile {} of {}\n", profile.join(" "), a.unknowns);
    let degree = |d: Option<usize>| d.map_or_else(|| "-".to_string(), |k| k.to_string());
    for q in &a.quantities {
        let partners =
            if q.partners.is_empty() { String::new() } else { format!("  with {}", q.partners.join(" ")) };
        writeln!(out, "  {:<9} {}  {}{partners}", q.name, degree(q.degree), q.status).expect("text");
    }
    for c in a.combinations.iter().chain(&a.invariants) {
        writeln!(out, "  [{}] {}", c.expression, degree(c.degree)).expect("text");
    }
    for s in &a.symmetries {
        writeln!(out, "  {}", s.words).expect("text");
    }
    for moved in &a.other_directions {
        writeln!(out, "  another direction moves {}", moved.join(", ")).expect("text");
    }
    out
}

#[test]
fn models() {
    insta::with_settings!({ omit_expression => true, prepend_module_to_snapshot => false }, {
        insta::glob!("../../examples", "*/*.toml", |path| {
            // a folder may hold its model under several conditions
            let stem = path.file_stem().expect("a name").to_string_lossy();
            let name = if stem == "model" { folder(path) } else { format!("{}_{stem}", folder(path)) };
            if stem == "scheme" || name.starts_with("wrong-") {
                return;
            }
            let text = std::fs::read_to_string(path).expect("readable");
            let model = model_file::read(&text).expect("a model");
            let no_solutions = SystemOptions { solutions: false, ..SystemOptions::default() };
            let a = analyze_system(&model, no_solutions).expect("judged");
            insta::assert_snapshot!(format!("model_{name}"), model_table(&a));
        });
    });
}

#[test]
fn wrong_models_are_refused_with_their_place() {
    insta::with_settings!({ omit_expression => true, prepend_module_to_snapshot => false }, {
        insta::glob!("../../examples", "wrong-models/*.toml", |path| {
            let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
            let run = run(&["analyze", "--model", &format!("examples/wrong-models/{name}.toml")]);
            assert!(run.status.code() == Some(2) && run.stdout.is_empty());
            insta::assert_snapshot!(format!("refused_model_{name}"), stderr(&run));
        });
    });
}

/// Every example has a README.
#[test]
fn every_example_is_explained() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    for entry in std::fs::read_dir(folder).expect("examples") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            assert!(path.join("README.md").is_file(), "{}", path.display());
        }
    }
}

fn folder(path: &Path) -> String {
    path.parent().and_then(Path::file_name).expect("a folder").to_string_lossy().into_owned()
}

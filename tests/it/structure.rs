//! The house: crates and the modules in them import only from what lies below them, as crates/README.md draws it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use regex::Regex;

type Imports = BTreeMap<String, BTreeSet<String>>;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn sources(place: &Path) -> Vec<PathBuf> {
    if place.is_file() {
        return vec![place.into()];
    }
    let entries = fs::read_dir(place).expect("a folder").map(|e| e.expect("an entry").path());
    let mut out: Vec<PathBuf> = entries
        .filter(|p| p.is_dir() || p.extension().is_some_and(|e| e == "rs"))
        .flat_map(|p| sources(&p))
        .collect();
    out.sort();
    out
}

/// What a place names behind `prefix`, comments and unit tests apart.
fn named(place: &Path, prefix: &str) -> BTreeSet<String> {
    let comment = Regex::new(r"//[^\n]*").expect("a pattern");
    let one = Regex::new(&format!(r"\b{prefix}(\w+)")).expect("a pattern");
    let several = Regex::new(&format!(r"\b{prefix}\{{")).expect("a pattern");
    let mut out = BTreeSet::new();
    for file in sources(place) {
        let text = fs::read_to_string(&file).expect("readable");
        let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        let text = comment.replace_all(text, "");
        out.extend(one.captures_iter(&text).map(|c| c[1].to_string()));
        assert!(!several.is_match(&text), "{}: imports in braces are not read here", file.display());
    }
    out
}

/// Modules of a crate and what they import from it.
fn modules_of(name: &str) -> Imports {
    let source = root().join("crates").join(name).join("src");
    let places: Vec<(String, PathBuf)> = fs::read_dir(source)
        .expect("a folder")
        .map(|e| e.expect("an entry").path())
        .map(|p| (p.file_stem().expect("a name").to_string_lossy().into_owned(), p))
        .filter(|(name, _)| name != "lib")
        .collect();
    let known: BTreeSet<String> = places.iter().map(|p| p.0.clone()).collect();
    let imports = |(module, place): &(String, PathBuf)| {
        let all = named(place, "crate::").into_iter().filter(|m| known.contains(m) && m != module);
        (format!("{name}/{module}"), all.map(|m| format!("{name}/{m}")).collect())
    };
    places.iter().map(imports).collect()
}

/// Modules of the crates that have more than a page of them.
fn modules() -> Imports {
    ["core", "evidence", "calibration", "design"].into_iter().flat_map(modules_of).collect()
}

/// Crates of the workspace and what they import from it.
fn crates() -> Imports {
    let names = [
        "exact",
        "ekf",
        "symbolic",
        "core",
        "evidence",
        "calibration",
        "design",
        "report",
        "commands",
        "python",
        "library",
        "cli",
        "verify",
        "web",
    ];
    let imports = |name: &&str| {
        let place = root().join("crates").join(name);
        let place = if place.join("src").is_dir() { place.join("src") } else { place };
        let all = named(&place, "obsdeg_").into_iter().filter(|m| names.contains(&m.as_str()) && m != name);
        ((*name).to_string(), all.collect())
    };
    names.iter().map(imports).collect()
}

/// A way from a place back to it.
fn circle(imports: &Imports) -> Option<Vec<String>> {
    fn climb(imports: &Imports, way: &mut Vec<String>, done: &mut BTreeSet<String>) -> bool {
        let here = way.last().cloned().unwrap_or_default();
        for next in imports.get(&here).into_iter().flatten() {
            if way.contains(next) {
                way.push(next.clone());
                return true;
            }
            if done.contains(next) {
                continue;
            }
            way.push(next.clone());
            if climb(imports, way, done) {
                return true;
            }
            way.pop();
        }
        done.insert(here);
        false
    }
    let mut done = BTreeSet::new();
    imports.keys().find_map(|start| {
        let mut way = vec![start.clone()];
        climb(imports, &mut way, &mut done).then_some(way)
    })
}

#[test]
fn nothing_imports_from_above() {
    for imports in [crates(), modules()] {
        assert_eq!(circle(&imports), None);
    }
    // the search for circles finds one
    let edge = |a: &str, b: &str| (a.to_string(), BTreeSet::from([b.to_string()]));
    let knot = Imports::from([edge("a", "b"), edge("b", "c"), edge("c", "b")]);
    assert_eq!(circle(&knot), Some(["a", "b", "c", "b"].map(String::from).to_vec()));
}

#[test]
fn the_drawing_is_what_is_there() {
    let text = fs::read_to_string(root().join("crates/README.md")).expect("readable");
    let drawn = text.split("```imports\n").nth(1).and_then(|t| t.split("```").next()).expect("a drawing");
    let line = |(name, all): (String, BTreeSet<String>)| {
        let all: Vec<String> = all.into_iter().collect();
        if all.is_empty() { name } else { format!("{name}: {}", all.join(", ")) }
    };
    let found: BTreeSet<String> = crates().into_iter().chain(modules()).map(line).collect();
    let drawn: BTreeSet<String> = drawn.lines().map(String::from).collect();
    assert_eq!(drawn, found, "crates/README.md draws other imports than there are");
}

//! Crates, their modules and files import only from below, as crates/README.md draws it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

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

/// Names behind `prefix` in the files of a place, without comments and unit tests.
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

/// Modules of a crate with their imports from the same crate.
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

/// Modules of the crates that the code map lists module by module.
fn modules() -> Imports {
    ["core", "evidence", "calibration", "design"].into_iter().flat_map(modules_of).collect()
}

/// Crates of the workspace with the folders of their sources.
fn all_crates() -> Vec<(&'static str, PathBuf)> {
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
    let place = |name: &'static str| {
        let place = root().join("crates").join(name);
        (name, if place.join("src").is_dir() { place.join("src") } else { place })
    };
    names.into_iter().map(place).collect()
}

/// Crates of the workspace with their imports from each other.
fn crates() -> Imports {
    let all = all_crates();
    let known: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    let imports = |(name, place): &(&str, PathBuf)| {
        let named = named(place, "obsdeg_").into_iter();
        ((*name).to_string(), named.filter(|m| known.contains(&m.as_str()) && m != name).collect())
    };
    all.iter().map(imports).collect()
}

/// Circular import: a path from a place back to it.
fn circle(imports: &Imports) -> Option<Vec<String>> {
    fn climb(imports: &Imports, path: &mut Vec<String>, done: &mut BTreeSet<String>) -> bool {
        let here = path.last().cloned().unwrap_or_default();
        for next in imports.get(&here).into_iter().flatten() {
            if path.contains(next) {
                path.push(next.clone());
                return true;
            }
            if done.contains(next) {
                continue;
            }
            path.push(next.clone());
            if climb(imports, path, done) {
                return true;
            }
            path.pop();
        }
        done.insert(here);
        false
    }
    let mut done = BTreeSet::new();
    imports.keys().find_map(|start| {
        let mut path = vec![start.clone()];
        climb(imports, &mut path, &mut done).then_some(path)
    })
}

#[test]
fn nothing_imports_from_above() {
    for imports in [crates(), modules()] {
        assert_eq!(circle(&imports), None);
    }
    // the search finds a circular import
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

/// Files of a crate by module path: text without comments and unit tests.
type Files = BTreeMap<Vec<String>, String>;

fn files_of(folder: &Path) -> Files {
    let module = |file: &Path| -> Vec<String> {
        let inside = file.strip_prefix(folder).expect("a file of the folder").with_extension("");
        let mut out: Vec<String> = inside.iter().map(|s| s.to_string_lossy().into_owned()).collect();
        if out.last().is_some_and(|l| ["mod", "lib", "main"].contains(&l.as_str())) {
            out.pop();
        }
        out
    };
    let text = |file: &Path| -> String {
        let text = fs::read_to_string(file).expect("readable");
        let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        text.lines().map(|l| l.split("//").next().unwrap_or_default().to_string() + "\n").collect()
    };
    sources(folder).iter().map(|file| (module(file), text(file))).collect()
}

/// Identifier at the start of a text; empty if there is none.
fn identifier(text: &str) -> &str {
    &text[..text.find(|c: char| c != '_' && !c.is_alphanumeric()).unwrap_or(text.len())]
}

/// Paths in the text of a module that begin with `crate::`, `super::` or `self::`, relative to the root of
/// the crate.
fn paths(module: &[String], text: &str) -> Vec<Vec<String>> {
    let mut out = Vec::new();
    for root in ["crate::", "super::", "self::"] {
        for (at, _) in text.match_indices(root) {
            if text[..at].ends_with(|c: char| c == '_' || c == ':' || c.is_alphanumeric()) {
                continue;
            }
            let mut path = if root == "crate::" { Vec::new() } else { module.to_vec() };
            let mut rest = &text[at + if root == "super::" { 0 } else { root.len() }..];
            while let Some(above) = rest.strip_prefix("super::") {
                path.pop();
                rest = above;
            }
            loop {
                let name = identifier(rest);
                rest = &rest[name.len()..];
                match rest.strip_prefix("::") {
                    Some(below) if !name.is_empty() => {
                        path.push(name.to_string());
                        rest = below;
                    }
                    _ if name.is_empty() && rest.starts_with('{') => {
                        let list = &rest[1..rest.find('}').expect("an end of the list")];
                        assert!(!list.contains('{'), "{module:?}: lists in lists are not read here: {list}");
                        let names = list.split(',').map(str::trim).filter(|name| !name.is_empty());
                        let segments =
                            |name: &str| name.split("::").map(|s| identifier(s).to_string()).collect();
                        out.extend(names.map(|name| [path.clone(), segments(name)].concat()));
                        break;
                    }
                    _ => {
                        path.push(name.to_string());
                        out.push(path);
                        break;
                    }
                }
            }
        }
    }
    out
}

/// Module whose file defines the name of a path: the longest module of the path, or a module below it from
/// which it exports the name.
fn defined_in(files: &Files, path: &[String]) -> Option<Vec<String>> {
    let module = (0..=path.len()).rev().map(|n| &path[..n]).find(|m| files.contains_key(*m))?;
    let Some(name) = path.get(module.len()) else { return Some(module.to_vec()) };
    let defines = |text: &str| {
        ["fn", "struct", "enum", "trait", "type", "const", "static"].iter().any(|kind| {
            let start = format!("{kind} {name}");
            text.match_indices(&start).any(|(at, _)| identifier(&text[at + kind.len() + 1..]) == name)
        })
    };
    if defines(&files[module]) {
        return Some(module.to_vec());
    }
    // `super::` in an inline module may mean its own file: a name that the module does not contain is no
    // import
    let exports = |(at, _): (usize, &str)| identifier(&files[module][at..]) == name;
    if !files[module].match_indices(name.as_str()).any(exports) {
        return None;
    }
    let below = files.iter().find(|(m, text)| m.starts_with(module) && defines(text));
    Some(below.map_or_else(|| module.to_vec(), |(m, _)| m.clone()))
}

/// Files of a crate with their imports from each other.
fn imports_of_files(files: &Files) -> Imports {
    let imports = |(module, text): (&Vec<String>, &String)| {
        let all = paths(module, text).into_iter().filter_map(|path| defined_in(files, &path));
        (module.join("/"), all.filter(|m| m != module).map(|m| m.join("/")).collect())
    };
    files.iter().map(imports).collect()
}

#[test]
fn no_files_import_each_other() {
    for (name, place) in all_crates() {
        assert_eq!(circle(&imports_of_files(&files_of(&place))), None, "of {name}");
    }
    // the search finds a circle through a list, a re-export and a path in an expression
    let file =
        |module: &[&str], text: &str| (module.iter().map(|m| (*m).to_string()).collect(), text.to_string());
    let mut files = Files::from([
        file(&[], "mod a; mod b;"),
        file(&["a"], "use crate::b::{Other, Made};\npub struct Seen;"),
        file(&["b"], "mod c; pub use c::Made;\npub struct Other;"),
        file(&["b", "c"], "pub struct Made; fn f() { super::super::a::Seen::new(); }"),
    ]);
    let found = circle(&imports_of_files(&files));
    assert_eq!(found, Some(["a", "b/c", "a"].map(String::from).to_vec()));
    files.insert(vec!["b".into(), "c".into()], "pub struct Made;".into());
    assert_eq!(circle(&imports_of_files(&files)), None);
}

/// Public fields that may be pairs of numbers or tuples of three: their names say both parts, or they map an
/// index to another.
const PAIRS: [&str; 7] = [
    "calibration/src/platform/diagnose/filter_path.rs: white",
    "core/src/model/platform.rs: cos_sin",
    "core/src/solution/local.rs: row",
    "core/src/solution/problem.rs: equations",
    "core/src/solution/problem.rs: of",
    "core/src/system/model/compiled.rs: carry",
    "core/src/system/model/compiled.rs: constants",
];

/// Public fields of a file that hold tuples of three or more, or of two numbers of one kind.
fn fields_without_names(text: &str) -> Vec<String> {
    static FIELD: LazyLock<Regex> =
        LazyLock::new(|| Regex::new(r"(?m)^ +pub (\w+): (.*\(.*),$").expect("a pattern"));
    static TUPLE: LazyLock<Regex> =
        LazyLock::new(|| Regex::new(r"\(((?:[^()]|\([^()]*\))*)\)").expect("a pattern"));
    let has_no_names = |of: &str| {
        TUPLE.captures_iter(of).any(|c| {
            let parts: Vec<&str> = c[1].split(", ").collect();
            let is_number = |part: &str| ["f64", "u64", "usize", "i64"].contains(&part);
            parts.len() > 2 || parts.len() == 2 && parts[0] == parts[1] && is_number(parts[0])
        })
    };
    let all = FIELD.captures_iter(text).filter(|c| !c[2].contains("Fn(") && !c[2].contains("fn("));
    all.filter(|c| has_no_names(&c[2])).map(|c| c[1].into()).collect()
}

#[test]
fn parts_of_fields_have_names() {
    let crates = root().join("crates");
    let mut found = Vec::new();
    // the checker of certificates reads files by a reader of its own, which is short
    let all = sources(&crates).into_iter().filter(|path| !path.starts_with(crates.join("verify")));
    for path in all.filter(|path| path.components().any(|c| c.as_os_str() == "src")) {
        let name = path.strip_prefix(&crates).expect("below").display().to_string();
        let text = fs::read_to_string(&path).expect("readable");
        found.extend(fields_without_names(&text).into_iter().map(|field| format!("{name}: {field}")));
    }
    found.sort();
    found.dedup();
    assert_eq!(found, PAIRS);
    let wrong = "struct A {\n    pub a: (f64, f64),\n    pub b: Vec<(String, f64, String)>,\n    \
                 pub c: Vec<Option<(usize, usize)>>,\n    pub d: Vec<(usize, f64)>,\n}\n";
    assert_eq!(fields_without_names(wrong), ["a", "b", "c"]);
}

/// Largest number of columns of a comment line, including indentation, outside code and formulas between
/// fences.
const COLUMNS: usize = 110;

/// Numbers of the comment lines that are longer than [`COLUMNS`].
fn long_comments(text: &str) -> Vec<usize> {
    let mut fenced = false;
    let mut out = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let own = line.trim_start();
        let Some(said) = own.strip_prefix("//") else {
            fenced = false;
            continue;
        };
        fenced ^= said.trim_start_matches(['/', '!']).trim_start().starts_with("```");
        if !fenced && line.chars().count() > COLUMNS {
            out.push(i + 1);
        }
    }
    out
}

#[test]
fn comments_fit_their_columns() {
    let long = "x".repeat(COLUMNS);
    assert_eq!(long_comments(&format!("// {long}\nlet x = 1; // {long}\n    //! {long}")), [1, 3]);
    assert!(long_comments(&format!("/// ```\n/// {long}\n/// ```\n")).is_empty());
    let mut found = Vec::new();
    for file in ["crates", "tests"].iter().flat_map(|folder| sources(&root().join(folder))) {
        let text = fs::read_to_string(&file).expect("a source file");
        found.extend(long_comments(&text).iter().map(|line| format!("{}:{line}", file.display())));
    }
    assert!(found.is_empty(), "longer than {COLUMNS} columns: {found:#?}");
}

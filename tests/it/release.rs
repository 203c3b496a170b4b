//! Requirements of a release besides a working program: texts with valid links, crates that can be packaged,
//! one version.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use regex::Regex;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Folders of all crates, with that of the program first.
fn crates() -> Vec<PathBuf> {
    let manifest: toml::Table = read("Cargo.toml").parse().expect("TOML");
    let members = manifest["workspace"]["members"].as_array().expect("a list").iter();
    std::iter::once(PathBuf::new()).chain(members.map(|m| m.as_str().expect("a folder").into())).collect()
}

/// Files below a folder with one of these extensions.
fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut out = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() && !name.starts_with('.') && name != "target" && name != "snapshots" {
            out.extend(files(&path, extensions));
        } else if path.extension().is_some_and(|e| extensions.iter().any(|of| e == *of)) {
            out.push(path);
        }
    }
    out
}

/// Text files for readers, below a folder.
fn texts(folder: &Path) -> Vec<PathBuf> {
    let mut out = files(folder, &["md"]);
    out.retain(|path| !path.ends_with("Symbolica-License.md"));
    out
}

/// Text without code blocks and inline code.
fn prose(text: &str) -> String {
    let outside: Vec<&str> = text.split("\n```").step_by(2).collect();
    Regex::new(r"`[^`\n]*`").expect("a pattern").replace_all(&outside.join("\n"), "code").into_owned()
}

/// Anchors of the headings of a text.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.split("\n```").step_by(2).flat_map(str::lines).filter(|l| l.starts_with('#'));
    let anchor = |line: &str| {
        let words = line.trim_start_matches('#').trim().to_lowercase();
        words
            .chars()
            .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
            .collect::<String>()
            .replace(' ', "-")
    };
    headings.map(anchor).collect()
}

#[test]
fn links_lead_somewhere() {
    let link = Regex::new(r"\]\(([^)\s]+)\)").expect("a pattern");
    let mut count = 0;
    for path in texts(root()) {
        let text = read(&path);
        for found in link.captures_iter(&prose(&text)) {
            let target = &found[1];
            if target.starts_with("https://") {
                continue;
            }
            count += 1;
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let leads = if file.is_empty() { path.clone() } else { path.with_file_name("").join(file) };
            let link = format!("{}: {target}", path.display());
            assert!(leads.exists(), "{link} leads nowhere");
            assert!(anchor.is_empty() || anchors(&read(&leads)).contains(anchor), "{link}: no such heading");
            // the book contains links to files outside it
            let book = root().join("book/src");
            assert!(
                !path.starts_with(&book) || file.is_empty() || !file.contains('/'),
                "{link} leaves the book"
            );
        }
    }
    assert!(count > 50, "only {count} links were seen");
    assert_eq!(
        anchors("# A b-c, d: (e)\n\n```sh\n# no heading\n```\n"),
        BTreeSet::from(["a-b-c-d-e".to_string()])
    );
}

/// Names that a text places in a file (`` `name` in `file.rs` ``), each with that file.
fn placed_names(text: &str) -> Vec<(String, String)> {
    let names = r"((?:`[A-Za-z_][\w:]*`(?:,? and|,)?\s+)+)";
    let placed =
        Regex::new(&format!(r"{names}(?:(?:of|in)\s+|\()`([\w/.-]+\.(?:rs|py|js))`")).expect("a pattern");
    let name = Regex::new(r"`([\w:]+)`").expect("a pattern");
    let each = placed.captures_iter(text).flat_map(|c| {
        let all = name.captures_iter(c.get(1).expect("names").as_str());
        all.map(|n| (n[1].to_string(), c[2].to_string())).collect::<Vec<_>>()
    });
    each.collect()
}

/// True if the text of a file defines a name: an item, a variant, a field or an argument. A path may also be
/// used there.
fn defines(text: &str, name: &str) -> bool {
    if name.contains("::") {
        return text.contains(name) || name.split("::").all(|part| defines(text, part));
    }
    let item = "fn|struct|enum|trait|impl|type|const|static|mod|def|class|let|let mut";
    let pattern = format!(r"(?m)\b(?:{item})\s+{name}\b|^\s*(?:pub(?:\([^)]*\))? )?{name}\s*[:,({{=]");
    Regex::new(&pattern).expect("a pattern").is_match(text)
}

#[test]
fn names_stand_in_the_files_that_are_named() {
    let folders = ["crates", "tests", "python", "tools"];
    let all: Vec<PathBuf> =
        folders.iter().flat_map(|folder| files(&root().join(folder), &["rs", "py", "js"])).collect();
    let mut count = 0;
    for text in ["CONTRIBUTING.md", "crates/README.md"] {
        for (name, file) in placed_names(&read(text)) {
            let there = all.iter().filter(|path| path.ends_with(&file)).map(read);
            assert!(there.into_iter().any(|file| defines(&file, &name)), "{text}: no `{name}` in {file}");
            count += 1;
        }
    }
    assert!(count > 40, "{count}");
    let code = "pub enum AuditFinding {\n    Agree,\n}\nimpl AuditFinding {\n    fn words(self) {}\n}\n";
    let found = ["AuditFinding", "Agree", "AuditFinding::words", "Finding", "AuditFinding::Differ"];
    assert_eq!(found.map(|name| defines(code, name)), [true, true, true, false, false]);
    let text = "`A` and `b` in `x.rs`, `C` (`y/z.py`: more)";
    assert_eq!(
        placed_names(text).iter().map(|(n, f)| format!("{n} {f}")).collect::<Vec<_>>(),
        ["A x.rs", "b x.rs", "C y/z.py"]
    );
}

#[test]
fn crates_can_be_packaged() {
    for folder in crates() {
        let manifest: toml::Table = read(folder.join("Cargo.toml")).parse().expect("TOML");
        let package = manifest["package"].as_table().expect("a package");
        // parts of the page
        if package.get("publish").is_some_and(|p| p.as_bool() == Some(false)) {
            continue;
        }
        let of = |key: &str| package.get(key).unwrap_or_else(|| panic!("{}: no {key}", folder.display()));
        let list = |key: &str| of(key).as_array().expect("a list").clone();
        assert!(of("description").as_str().is_some_and(|d| d.len() > 20));
        for key in ["version", "edition", "rust-version", "license"] {
            assert_eq!(of(key)["workspace"].as_bool(), Some(true), "{}: {key}", folder.display());
        }
        let (keywords, categories) = (list("keywords"), list("categories"));
        assert!(
            (1..=5).contains(&keywords.len()) && (1..=5).contains(&categories.len()),
            "{}",
            folder.display()
        );
        assert!(keywords.iter().all(|k| k.as_str().is_some_and(|k| k.len() <= 20)), "{keywords:?}");
        assert!(read(folder.join(of("readme").as_str().expect("a file"))).len() > 200);
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            assert_eq!(read(folder.join(licence)), read(licence), "{}", folder.display());
        }
        // each published library has examples; the Python module has none in Rust
        if package.get("publish").and_then(toml::Value::as_bool) == Some(false) {
            continue;
        }
        let source = root().join(&folder).join("examples");
        let examples = fs::read_dir(&source).unwrap_or_else(|e| panic!("{}: {e}", source.display()));
        let programs =
            examples.filter(|e| e.as_ref().is_ok_and(|e| e.path().extension().is_some_and(|x| x == "rs")));
        assert!(programs.count() > 0, "{}", source.display());
    }
}

#[test]
fn there_is_one_version() {
    let version = env!("CARGO_PKG_VERSION");
    let manifest: toml::Table = read("Cargo.toml").parse().expect("TOML");
    let dependencies = manifest["workspace"]["dependencies"].as_table().expect("a table");
    let own = dependencies.iter().filter(|(name, _)| name.starts_with("obsdeg-"));
    for (name, dependency) in own {
        assert_eq!(dependency["version"].as_str(), Some(version), "{name}");
    }
    let changelog = read("CHANGELOG.md");
    let newest = changelog.lines().find(|l| l.starts_with("## ")).expect("a version");
    assert!(newest.starts_with(&format!("## [{version}] - ")), "{newest}");
    assert!(read("CITATION.cff").lines().any(|l| l == format!("version: {version}")));
}

/// Required contents of the first page, in lines that fit a window.
#[test]
fn the_first_page() {
    let readme = read("README.md");
    for command in
        ["cargo run --release -- analyze --angles 0,0,0 --angles 180,0,0", "cargo test --workspace --test it"]
    {
        assert!(readme.lines().any(|l| l.trim().trim_start_matches("$ ") == command), "{command}");
    }
    let long: Vec<&str> = readme.lines().filter(|l| l.chars().count() > 100).collect();
    assert!(long.is_empty(), "{long:#?}");
}

/// Rust source files below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path());
    let below = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
    entries.flat_map(below).filter(|p| p.extension().is_some_and(|e| e == "rs")).collect()
}

/// Long tests are listed in CONTRIBUTING.md; the gate reads those of every day there, and the release gate
/// runs those that it lists for a release.
#[test]
fn long_tests_are_listed() {
    let ignored = Regex::new(r"\n *#\[ignore = [^\n]*\n *(?:#\[[^\n]*\n *)*fn (\w+)").expect("a pattern");
    let row = Regex::new(r"(?m)^\| `(\w+)` \|.*\| (daily|release|by hand) \|$").expect("a pattern");
    let files: Vec<PathBuf> = ["tests", "crates"].iter().flat_map(|f| sources(&root().join(f))).collect();
    let texts: Vec<String> = files.iter().map(read).collect();
    // module of each test
    let mut found = BTreeMap::new();
    for (file, text) in files.iter().zip(&texts).filter(|(_, text)| text.contains("#[ignore")) {
        let names = ignored.captures_iter(text).filter_map(|c| Some(c.get(1)?.as_str()));
        found.extend(names.map(|name| (name, file.file_stem().expect("a name").to_string_lossy())));
    }
    let (list, gate) = (read("CONTRIBUTING.md"), read(".ci/run"));
    let rows: Vec<(&str, &str)> =
        row.captures_iter(&list).map(|c| c.extract()).map(|(_, [name, place])| (name, place)).collect();
    assert_eq!(rows.iter().map(|(name, _)| *name).collect::<BTreeSet<_>>(), found.keys().copied().collect());
    // the gate names a test, or its module, or reads the table: every row whose test has no daily form
    let long = gate.lines().filter_map(|l| l.split("--ignored").nth(1)?.split(';').next());
    let words: Vec<&str> = long.flat_map(str::split_whitespace).collect();
    assert!(gate.contains("daily |$") && gate.contains("--ignored --skip at_length $daily"));
    assert!(gate.contains("| | as it is | release |$") && gate.contains("--ignored --skip at_length $only"));
    for (name, place) in rows {
        if place == "daily" {
            // the gate finds it by its name, and nothing else
            let others = found.keys().filter(|n| n.contains(name) && !n.contains("at_length")).count();
            assert_eq!(others, 1, "{name}");
            continue;
        }
        let part = |part: &str| !part.is_empty() && (name.starts_with(part) || part == found[name]);
        let reads = list.contains(&format!("| `{name}` | | as it is | release |"));
        let runs = reads || words.iter().any(|word| word.split("::").any(part));
        assert_eq!(runs, place == "release", "{name}");
    }
}

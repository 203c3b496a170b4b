//! Third-party packages in every build: the table of licences against the graphs that cargo resolves and the
//! texts in the sources. `UPDATE_LICENCES=1 cargo test --test it licences::` renews the table, the texts for
//! the wheel and the workbench, and the wheel's SBOM. It needs `cargo fetch` for all platforms first.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use regex::Regex;
use serde_json::{Value, json};

use crate::program::{refused, run, stdout};
use third_party::{PLATFORMS, Package, ThirdParty};

#[path = "../../crates/cli/third_party.rs"]
mod third_party;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Names of the builds in the table, and cargo's options for each.
const BUILDS: [(&str, &[&str]); 5] = [
    ("program", &["-p", "obsdeg", "--no-default-features"]),
    ("symbolica", &["-p", "obsdeg", "--no-default-features", "--features", "symbolica"]),
    ("pdf", &["-p", "obsdeg", "--no-default-features", "--features", "pdf"]),
    ("wheel", &["-p", "obsdeg-python"]),
    ("workbench", &["-p", "obsdeg-web", "-p", "obsdeg-unpack"]),
];

/// Target triple of a platform.
fn triple(platform: &str) -> &'static str {
    match platform {
        "linux-x86_64" => "x86_64-unknown-linux-gnu",
        "linux-aarch64" => "aarch64-unknown-linux-gnu",
        "macos-x86_64" => "x86_64-apple-darwin",
        "macos-aarch64" => "aarch64-apple-darwin",
        "windows-x86_64" => "x86_64-pc-windows-msvc",
        "windows-aarch64" => "aarch64-pc-windows-msvc",
        _ => "wasm32-unknown-unknown",
    }
}

fn host() -> String {
    format!("{}-{}", std::env::consts::OS, std::env::consts::ARCH)
}

fn cargo(arguments: &[&str]) -> Result<String, String> {
    let mut command = Command::new(env!("CARGO"));
    let out = command.args(arguments).args(["--offline", "--locked"]).current_dir(root()).output();
    let out = out.expect("cargo runs");
    match out.status.success() {
        true => Ok(String::from_utf8(out.stdout).expect("UTF-8")),
        false => Err(String::from_utf8_lossy(&out.stderr).into_owned()),
    }
}

/// Name and version of a crate.
type Crate = (String, String);

/// Crates that are linked into a build, each (obsdeg's own too) with its dependencies.
fn graph(asked: &[&str], triple: &str) -> Result<BTreeMap<Crate, BTreeSet<Crate>>, String> {
    let form = ["-e", "normal,no-proc-macro", "--prefix", "depth", "-f", " {p}", "--target", triple];
    let tree = cargo(&[&["tree"], asked, &form].concat())?;
    let mut out: BTreeMap<Crate, BTreeSet<Crate>> = BTreeMap::new();
    let mut above: Vec<Crate> = Vec::new();
    for line in tree.lines().filter(|l| !l.is_empty()) {
        let mut words = line.split(' ');
        let mut next = || words.next().unwrap_or_default().to_string();
        let depth: usize = next().parse().expect("a depth");
        let found = (next(), next().trim_start_matches('v').to_string());
        above.truncate(depth);
        if let Some(parent) = above.last() {
            out.entry(parent.clone()).or_default().insert(found.clone());
        }
        out.entry(found.clone()).or_default();
        above.push(found);
    }
    Ok(out)
}

fn is_ours((name, _): &Crate) -> bool {
    name == "obsdeg" || name.starts_with("obsdeg-")
}

/// Data of a crate's manifest.
struct Source {
    folder: PathBuf,
    licence: String,
    address: String,
}

fn sources(with: &[&str]) -> Result<BTreeMap<Crate, Source>, String> {
    let metadata = cargo(&[&["metadata", "--format-version", "1"], with].concat())?;
    let metadata: Value = serde_json::from_str(&metadata).expect("JSON");
    let text = |v: &Value| v.as_str().unwrap_or_default().to_string();
    let source = |p: &Value| {
        let folder = Path::new(&text(&p["manifest_path"])).with_file_name("");
        let licence = match (p["name"].as_str(), p["license"].as_str()) {
            (_, Some(licence)) => licence.replace('/', " OR ").replace("MPL-2.0+", "MPL-2.0"),
            // licence files of its own instead of an expression: book/src/licences.md
            (Some("symbolica"), None) => "LicenseRef-Symbolica".into(),
            (Some("cobyla"), None) => "MIT".into(),
            (name, None) => panic!("{name:?} names no licence"),
        };
        let address = match text(&p["repository"]) {
            none if none.is_empty() => {
                format!("https://crates.io/crates/{}", p["name"].as_str().unwrap_or_default())
            }
            address => address,
        };
        ((text(&p["name"]), text(&p["version"])), Source { folder, licence, address })
    };
    Ok(metadata["packages"].as_array().expect("a list").iter().map(source).collect())
}

/// Licence texts of crates whose packages have none: from their repositories, or the standard text of an
/// applicable licence.
fn without_text(name: &str, licence: &str) -> &'static [&'static str] {
    match name {
        "alloc-stdlib" => &["licenses/alloc-stdlib-License.txt"],
        "astro-float-num" => &["licenses/astro-float-License.txt"],
        "block2" | "dispatch2" | "objc2" | "objc2-encode" => &["licenses/objc2-License.txt"],
        _ if name.starts_with("malachite-") => {
            &["licenses/malachite-LGPL-3.0.txt", "licenses/malachite-GPL-3.0.txt"]
        }
        _ if licence.split(" OR ").any(|l| l == "Apache-2.0") => &["LICENSE-APACHE"],
        _ if licence.contains("CC0-1.0") => &["licenses/CC0-1.0.txt"],
        _ => panic!("{name} ({licence}) holds no text of its licence; expected one to be named here"),
    }
}

/// Licence texts in a package.
fn texts(name: &str, source: &Source) -> Vec<String> {
    let named = Regex::new(r"(?i)^(licen[cs]e|copying|notice|copyright|unlicense|ofl)").expect("a pattern");
    let entries = fs::read_dir(&source.folder).unwrap_or_else(|e| panic!("{}: {e}", source.folder.display()));
    let files = entries.map(|e| e.expect("an entry").path()).filter(|path| {
        path.is_file() && path.file_name().is_some_and(|n| named.is_match(&n.to_string_lossy()))
    });
    let mut files: Vec<PathBuf> = files.collect();
    files.sort();
    if files.is_empty() {
        files = without_text(name, &source.licence).iter().map(|f| root().join(f)).collect();
    }
    if name == "symbolica" {
        files.push(root().join("licenses/NOTICE-Symbolica.md"));
    }
    let read = |path: &PathBuf| fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    files.iter().map(|path| String::from_utf8_lossy(&read(path)).replace("\r\n", "\n")).collect()
}

/// Third-party files that are no crates: name, version, licence, address, texts, and the crate whose builds
/// contain them.
const ASSETS: [[&str; 6]; 4] = [
    [
        "DejaVu Sans (font)",
        "2.37",
        "Bitstream-Vera",
        "https://dejavu-fonts.github.io",
        "licenses/DejaVu-License.txt",
        "dejavu",
    ],
    [
        "New Computer Modern Math (font)",
        "",
        "LicenseRef-GUST-Font-License",
        "https://ctan.org/pkg/newcomputermodern",
        "licenses/GUST-Font-License.txt",
        "obsdeg-report",
    ],
    [
        "Rust standard library",
        "",
        "(MIT OR Apache-2.0) AND Unicode-3.0 AND Zlib",
        "https://github.com/rust-lang/rust",
        "licenses/Rust-standard-library.txt LICENSE-APACHE",
        "obsdeg-exact",
    ],
    [
        "uPlot",
        "1.6.32",
        "MIT",
        "https://github.com/leeoniya/uPlot",
        "licenses/uPlot-License.txt",
        "obsdeg-report",
    ],
];

/// Table of licences from the graphs of all builds on all platforms.
fn table() -> ThirdParty {
    let with_pdf = sources(&["--features", "pdf"]).expect("all crates are downloaded: cargo fetch");
    let mut held: BTreeMap<Crate, (BTreeSet<&str>, BTreeSet<&str>)> = BTreeMap::new();
    let mut cells: Vec<(&str, &str, BTreeSet<Crate>)> = Vec::new();
    for (build, asked) in BUILDS {
        for platform in PLATFORMS {
            let platform = if build == "workbench" { "web" } else { platform };
            let found: BTreeSet<Crate> =
                graph(asked, triple(platform)).expect("cargo tree").into_keys().collect();
            for package in &found {
                let (builds, platforms) = held.entry(package.clone()).or_default();
                builds.insert(build);
                platforms.insert(platform);
            }
            cells.push((build, platform, found));
            if build == "workbench" {
                break;
            }
        }
    }
    let mut out = ThirdParty::default();
    let mut known: BTreeMap<String, usize> = BTreeMap::new();
    let mut written: Vec<String> = Vec::new();
    let mut add = |all: Vec<String>| -> Vec<usize> {
        let index = |text: String| {
            // texts with equal words are the same text
            let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
            *known.entry(words).or_insert_with(|| {
                written.push(text);
                written.len() - 1
            })
        };
        let mut indices: Vec<usize> = all.into_iter().map(index).collect();
        indices.dedup();
        indices
    };
    let in_order = |builds: &BTreeSet<&str>| -> Vec<String> {
        // the program with features contains everything that it contains without
        let more = |b: &&str| !(builds.contains("program") && (*b == "symbolica" || *b == "pdf"));
        BUILDS.iter().map(|b| b.0).filter(|b| builds.contains(b)).filter(more).map(String::from).collect()
    };
    for [name, version, licence, source, files, holder] in ASSETS {
        let holder = held.iter().find(|((name, _), _)| name == holder).expect("a crate that holds it");
        let read = |f: &str| fs::read_to_string(root().join(f)).unwrap_or_else(|e| panic!("{f}: {e}"));
        out.packages.push(Package {
            name: name.into(),
            version: version.into(),
            licence: licence.into(),
            source: source.into(),
            builds: in_order(&holder.1.0),
            platforms: Vec::new(),
            texts: add(files.split(' ').map(read).collect()),
        });
    }
    for (id, (builds, platforms)) in held.iter().filter(|(id, _)| !is_ours(id)) {
        let source = with_pdf.get(id).unwrap_or_else(|| panic!("{id:?} is not in the metadata"));
        let everywhere =
            PLATFORMS.iter().all(|p| platforms.contains(p)) || *builds == BTreeSet::from(["workbench"]);
        let limited = PLATFORMS.iter().filter(|p| !everywhere && platforms.contains(*p));
        out.packages.push(Package {
            name: id.0.clone(),
            version: id.1.clone(),
            licence: source.licence.clone(),
            source: source.address.clone(),
            builds: in_order(builds),
            platforms: limited.map(|p| (*p).to_string()).collect(),
            texts: add(texts(&id.0, source)),
        });
    }
    // similar texts stand side by side, which compresses best
    let mut order: Vec<usize> = (0..written.len()).collect();
    order.sort_by_key(|&i| written[i].split_whitespace().collect::<String>().to_lowercase());
    for package in &mut out.packages {
        for text in &mut package.texts {
            *text = order.iter().position(|i| i == text).expect("one of them");
        }
    }
    out.texts = order.iter().map(|&i| written[i].clone()).collect();
    out.packages.sort_by_key(|p| (p.name.to_lowercase(), p.version.clone()));
    // the table reproduces the crates of every build on every platform
    for (build, platform, expected) in cells {
        let parts = if build == "symbolica" || build == "pdf" { vec!["program", build] } else { vec![build] };
        let expected: BTreeSet<Crate> = expected.into_iter().filter(|id| !is_ours(id)).collect();
        assert_eq!(crates_of(&out.of(&parts, platform)), expected, "{build}, {platform}");
    }
    out
}

/// Crates of a table.
fn crates_of(table: &ThirdParty) -> BTreeSet<Crate> {
    let is_crate = |p: &&Package| ASSETS.iter().all(|a| a[0] != p.name);
    table.packages.iter().filter(is_crate).map(|p| (p.name.clone(), p.version.clone())).collect()
}

/// Packages of the wheel as a bill of materials (CycloneDX 1.5).
fn sbom(table: &ThirdParty) -> Value {
    let lock: toml::Table =
        fs::read_to_string(root().join("Cargo.lock")).expect("a lock").parse().expect("TOML");
    let checksum = |name: &str, version: &str| {
        let is =
            |p: &&toml::Value| p["name"].as_str() == Some(name) && p["version"].as_str() == Some(version);
        let found = lock["package"].as_array().expect("a list").iter().find(is)?;
        found.get("checksum").and_then(toml::Value::as_str).map(String::from)
    };
    let reference = |name: &str, version: &str| match checksum(name, version) {
        Some(_) => format!("pkg:cargo/{name}@{version}"),
        None => format!("{name} {version}").trim_end().replace(' ', "-"),
    };
    let component = |p: &Package| {
        let mut out = json!({
            "type": if p.name.ends_with("(font)") { "data" } else { "library" },
            "bom-ref": reference(&p.name, &p.version),
            "name": p.name,
            "version": p.version,
            "scope": if p.platforms.is_empty() { "required" } else { "optional" },
            "licenses": [{ "expression": p.licence }],
            "externalReferences": [{ "type": "vcs", "url": p.source }],
        });
        if let Some(checksum) = checksum(&p.name, &p.version) {
            out["purl"] = reference(&p.name, &p.version).into();
            out["hashes"] = json!([{ "alg": "SHA-256", "content": checksum }]);
        }
        if !p.platforms.is_empty() {
            out["properties"] = json!([{ "name": "obsdeg:platforms", "value": p.platforms.join(" ") }]);
        }
        out
    };
    // dependencies on any platform; the crates of obsdeg are one component
    let us = format!("pkg:pypi/obsdeg@{}", env!("CARGO_PKG_VERSION"));
    let name = |id: &Crate| if is_ours(id) { us.clone() } else { reference(&id.0, &id.1) };
    let mut needs: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for platform in PLATFORMS {
        for (id, of) in graph(BUILDS[3].1, triple(platform)).expect("cargo tree") {
            let of = of.iter().filter(|other| !is_ours(other)).map(&name);
            needs.entry(name(&id)).or_default().extend(of);
        }
    }
    let assets = table.packages.iter().filter(|p| checksum(&p.name, &p.version).is_none());
    needs.entry(us.clone()).or_default().extend(assets.map(|p| reference(&p.name, &p.version)));
    json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": { "component": {
            "type": "library", "bom-ref": us, "name": "obsdeg", "version": env!("CARGO_PKG_VERSION"), "purl": us,
            "licenses": [{ "expression": "MIT OR Apache-2.0" }],
        } },
        "components": table.packages.iter().map(component).collect::<Vec<_>>(),
        "dependencies": needs.iter().map(|(of, on)| json!({ "ref": of, "dependsOn": on })).collect::<Vec<_>>(),
    })
}

/// Generated files below `licenses`, by name.
fn written(table: &ThirdParty) -> Vec<(&'static str, Vec<u8>)> {
    let json = serde_json::to_vec(table).expect("JSON");
    let page = |what: &str, build: &str| {
        let of = table.of(&[build], "");
        let head = format!(
            "obsdeg is under MIT or Apache-2.0, as you like. {what} holds {} packages of others:\n\n",
            of.packages.len()
        );
        format!("{head}{}\n{}", of.list(), of.words(&[])).into_bytes()
    };
    let bill = serde_json::to_string_pretty(&sbom(&table.of(&["wheel"], ""))).expect("JSON") + "\n";
    vec![
        ("third-party.z", miniz_oxide::deflate::compress_to_vec_zlib(&json, 10)),
        ("wheel.txt", page("The Python package", "wheel")),
        ("workbench.txt", page("The workbench", "workbench")),
        ("wheel.cdx.json", bill.into_bytes()),
    ]
}

/// Table of licences that the program reads.
fn read() -> ThirdParty {
    let packed = fs::read(root().join("licenses/third-party.z")).expect("a table");
    let json = miniz_oxide::inflate::decompress_to_vec_zlib(&packed).expect("deflated");
    serde_json::from_slice(&json).expect("a table")
}

/// Generates all files and compares every byte. Needs the crates of all platforms and features: `cargo
/// fetch`.
fn renewed() {
    for (name, bytes) in written(&table()) {
        let path = root().join("licenses").join(name);
        if std::env::var_os("UPDATE_LICENCES").is_some() {
            fs::write(&path, bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        } else {
            let found = fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            assert!(found == bytes, "{} is not of these graphs: UPDATE_LICENCES=1", path.display());
        }
    }
}

#[test]
#[ignore = "reads the crates of all platforms: cargo fetch"]
fn all_platforms_and_features() {
    renewed();
}

#[test]
#[expect(clippy::print_stderr, reason = "a skipped build says so")]
fn the_table_is_that_of_the_graphs() {
    if std::env::var_os("UPDATE_LICENCES").is_some() {
        renewed();
    }
    let table = read();
    let mut compared = 0;
    for (build, asked) in BUILDS {
        let platform = if build == "workbench" { "web".into() } else { host() };
        if build != "workbench" && !PLATFORMS.contains(&platform.as_str()) {
            continue;
        }
        // crates of the page and of the typesetter may be missing on this machine
        let graph = match graph(asked, triple(&platform)) {
            Err(e) if ["pdf", "workbench"].contains(&build) => {
                eprintln!("skipped: {build}: {e}");
                continue;
            }
            graph => graph.expect("cargo tree"),
        };
        let parts = if build == "symbolica" || build == "pdf" { vec!["program", build] } else { vec![build] };
        let expected: BTreeSet<Crate> = graph.into_keys().filter(|id| !is_ours(id)).collect();
        assert_eq!(crates_of(&table.of(&parts, &platform)), expected, "{build}: UPDATE_LICENCES=1 renews it");
        compared += expected.len();
    }
    assert!(compared > 300, "{compared}");
    // the texts, word for word
    let here = sources(&["--filter-platform", triple(&host())]).expect("the crates that were built");
    let same = |a: &str, b: &str| a.split_whitespace().eq(b.split_whitespace());
    let mut read = 0;
    for p in &table.of(&["program", "symbolica", "wheel"], &host()).packages {
        let Some(source) = here.get(&(p.name.clone(), p.version.clone())) else { continue };
        assert_eq!(p.licence, source.licence, "{}", p.name);
        for text in texts(&p.name, source) {
            read += 1;
            let is =
                |i: &usize| same(&table.of(&["program", "symbolica", "wheel"], &host()).texts[*i], &text);
            assert!(p.texts.iter().any(is), "{}: UPDATE_LICENCES=1 renews its texts", p.name);
        }
    }
    assert!(read > 200, "{read}");
}

/// The metadata of the wheel state its licences: all are free and set no conditions on the source of users.
#[test]
fn the_wheel_holds_what_its_files_say() {
    let table = read().of(&["wheel"], "");
    let strict = ["LGPL", "GPL", "MPL", "Symbolica"];
    for p in &table.packages {
        let choice = p.licence.contains(" OR ");
        assert!(choice || strict.iter().all(|s| !p.licence.contains(s)), "{}: {}", p.name, p.licence);
        assert!(!p.name.contains("malachite") && !p.texts.is_empty(), "{}", p.name);
    }
    let page = fs::read_to_string(root().join("licenses/wheel.txt")).expect("a text");
    for words in ["Bitstream Vera", "GUST Font License", "Leon Sorokin", "UNICODE LICENSE V3", "Zlib"] {
        assert!(page.contains(words), "{words}");
    }
    let bill = fs::read_to_string(root().join("licenses/wheel.cdx.json")).expect("a text");
    let bill: Value = serde_json::from_str(&bill).expect("JSON");
    let name = |c: &Value| (c["name"].as_str().expect("a name").to_string(), c["version"].clone());
    let listed: Vec<_> = bill["components"].as_array().expect("a list").iter().map(name).collect();
    let held: Vec<_> =
        table.packages.iter().map(|p| (p.name.clone(), Value::from(p.version.as_str()))).collect();
    assert_eq!(listed, held);
    // every reference points to a component
    let of = |v: &Value, key: &str| v[key].as_str().expect("a reference").to_string();
    let mut known: BTreeSet<String> =
        bill["components"].as_array().expect("a list").iter().map(|c| of(c, "bom-ref")).collect();
    assert_eq!(known.len(), listed.len());
    known.insert(of(&bill["metadata"]["component"], "bom-ref"));
    for entry in bill["dependencies"].as_array().expect("a list") {
        assert!(known.contains(&of(entry, "ref")), "{entry}");
        assert!(
            entry["dependsOn"]
                .as_array()
                .expect("a list")
                .iter()
                .all(|d| known.contains(d.as_str().expect("text")))
        );
    }
}

#[test]
fn the_program_prints_licences() {
    let list = stdout(&run(&["licences"]));
    let symbolica = cfg!(feature = "symbolica");
    for (name, held) in [
        ("nalgebra ", true),
        ("uPlot ", true),
        ("DejaVu Sans (font)", true),
        ("symbolica ", symbolica),
        ("malachite-nz ", symbolica),
        ("typst ", cfg!(feature = "pdf")),
    ] {
        assert_eq!(list.lines().any(|l| l.starts_with(name)), held, "{name}");
    }
    let one = stdout(&run(&["licences", "uPlot"]));
    assert!(one.contains("Copyright (c) 2022 Leon Sorokin") && one.lines().count() < 40, "{one}");
    let all = stdout(&run(&["licences", "--texts"]));
    for words in [
        "Leon Sorokin",
        "UNICODE LICENSE V3",
        "GUST Font License",
        "Bitstream Vera",
        "Boost Software License",
    ] {
        assert!(all.contains(words), "{words}");
    }
    assert_eq!(all.contains("GNU LESSER GENERAL PUBLIC LICENSE"), symbolica);
    // each text once
    assert_eq!(all.matches("Leon Sorokin").count(), 1);
    refused(&["licences", "left-pad"], &["holds no package `left-pad`", "expected one of"]);
}

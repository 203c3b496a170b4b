//! Build of the page: the compiled and packed engine, with the page around it.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use lzma_rust2::{LzmaOptions, LzmaWriter};
use minijinja::{Environment, context};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use wasm_bindgen_cli_support::Bindgen;

use crate::link::{LinkError, linked};

const TEMPLATE: &str = include_str!("../page/page.html");
const STYLE: &str = include_str!("../page/page.css");
const WORKER: &str = include_str!("../page/worker.js");
/// Script that stands for the engine in a draft.
const DRAFT: &str = include_str!("../page/draft.js");
macro_rules! scripts {
    ($($file:literal)*) => { &[$(($file, include_str!(concat!("../page/", $file)))),*] };
}
/// Scripts of the page, each a file and its text.
pub(crate) const SCRIPTS: &[(&str, &str)] = scripts!["dom.js" "geometry.js" "engine.js" "scheme.js"
    "fields.js" "notice.js" "view.js" "positions.js" "conditions.js" "verdicts.js" "table.js" "sweep.js"
    "why.js" "ask.js" "tabs.js" "design.js" "text.js" "tour.js" "main.js"];

/// Error that ends the build of the page.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BuildError {
    /// A file that cannot be read or written.
    #[error("{path}: {reason}")]
    File { path: String, reason: std::io::Error },
    /// The compiler failed; its own message says more.
    #[error(
        "the engine was not compiled; expected the target wasm32-unknown-unknown (rustup target add \
         wasm32-unknown-unknown)"
    )]
    Compiler,
    /// The script between page and engine could not be made.
    #[error("no glue: {0}")]
    Glue(String),
    /// The scripts of the page do not fit together.
    #[error("no script: {0}")]
    Script(#[from] LinkError),
    /// The template of the page could not be filled in.
    #[error("no page: {0}")]
    Page(#[from] minijinja::Error),
}

/// WebAssembly and the script that calls it.
struct WasmModule {
    wasm: Vec<u8>,
    script: String,
}

/// Engine of a page, as its worker takes it.
struct PageEngine {
    /// Script that the worker calls the engine by.
    script: String,
    /// Module that unpacks the engine, as text.
    unpack: String,
    /// Packed engine, as text.
    packed: String,
    /// Source beside `blob:` and `data:` that the page may ask, for its content security policy.
    connect: Option<String>,
}

/// Writes the page; returns its path and sizes in words.
pub(crate) fn page(asked: Option<PathBuf>) -> Result<String, BuildError> {
    let compiled = compile(&root())?;
    let engine = glued(&compiled, "obsdeg_web")?;
    let unpack = glued(&compiled, "obsdeg_unpack")?;
    let packed = packed(&engine.wasm)?;
    let [whole, small] = [engine.wasm.len(), packed.len()].map(|n| n as f64 / 1e6);
    let (path, length) = written(
        asked,
        "workbench.html",
        &PageEngine {
            script: format!("{}\n{}", unpack.script, engine.script),
            unpack: as_text(&unpack.wasm),
            packed: as_text(&packed),
            connect: None,
        },
    )?;
    let all = length as f64 / 1e6;
    Ok(format!("{}: {all:.2} MB; the engine {whole:.2} MB, packed {small:.2} MB", path.display()))
}

/// Writes a draft of the page, which asks the program at `address`; returns its path.
pub(crate) fn draft(asked: Option<PathBuf>, address: &str) -> Result<PathBuf, BuildError> {
    let mut environment = Environment::new();
    environment.add_template("draft", DRAFT)?;
    let engine = PageEngine {
        script: environment.get_template("draft")?.render(context! { address })?,
        unpack: as_text(&[]),
        packed: as_text(&[]),
        connect: Some(address.into()),
    };
    Ok(written(asked, "draft.html", &engine)?.0)
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Writes a page with an engine; returns its path and number of bytes.
fn written(asked: Option<PathBuf>, name: &str, engine: &PageEngine) -> Result<(PathBuf, usize), BuildError> {
    let root = root();
    let script = format!("'use strict';(() => {{\n{}}})();", linked(SCRIPTS)?);
    let data = json!({
        "worker": format!("{}\n{WORKER}", engine.script),
        "unpack": engine.unpack,
        "engine": engine.packed,
        "version": env!("CARGO_PKG_VERSION"),
        "examples": examples(&root)?,
    });
    let mut environment = Environment::new();
    environment.add_template("page", TEMPLATE)?;
    let text = environment.get_template("page")?.render(context! {
        style => STYLE,
        style_digest => digest(STYLE),
        script => &script,
        script_digest => digest(&script),
        connect => &engine.connect,
        version => env!("CARGO_PKG_VERSION"),
        // without `<`, no text in the data ends the script element
        data => data.to_string().replace('<', "\\u003c"),
    })?;
    let path = asked.unwrap_or_else(|| root.join("target").join(name));
    fs::write(&path, &text)
        .map_err(|reason| BuildError::File { path: path.display().to_string(), reason })?;
    Ok((path, text.len()))
}

/// Compiles the engine and the unpacking module; returns the paths of the WebAssembly files.
fn compile(root: &Path) -> Result<Vec<PathBuf>, BuildError> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let done = Command::new(cargo)
        .args(["build", "--lib", "-p", "obsdeg-web", "-p", "obsdeg-unpack", "--profile", "web"])
        .args(["--target", "wasm32-unknown-unknown", "--message-format", "json-render-diagnostics"])
        .current_dir(root)
        // not what a gate compiles the workspace with (Clippy), so that the page is compiled once
        .env_remove("RUSTC_WORKSPACE_WRAPPER")
        .stderr(Stdio::inherit())
        .output();
    let done = done.ok().filter(|d| d.status.success()).ok_or(BuildError::Compiler)?;
    let messages = String::from_utf8_lossy(&done.stdout);
    let artifacts = messages.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let files = artifacts.filter_map(|m| m["filenames"].as_array().cloned()).flatten();
    let paths = files.filter_map(|f| f.as_str().map(PathBuf::from));
    Ok(paths.filter(|p| p.extension().is_some_and(|e| e == "wasm")).collect())
}

/// The compiled module of that name, with the script that calls it.
fn glued(compiled: &[PathBuf], name: &str) -> Result<WasmModule, BuildError> {
    let file =
        compiled.iter().find(|p| p.file_stem().is_some_and(|s| s == name)).ok_or(BuildError::Compiler)?;
    let glue = || {
        let mut bindgen = Bindgen::new();
        bindgen.input_path(file).no_modules(true)?.no_modules_global(name)?;
        bindgen.typescript(false).remove_name_section(true).remove_producers_section(true).generate_output()
    };
    let mut output = glue().map_err(|e| BuildError::Glue(format!("{e:#}")))?;
    Ok(WasmModule { wasm: output.wasm_mut().emit_wasm(), script: output.js().into() })
}

/// Bytes packed with LZMA.
fn packed(bytes: &[u8]) -> Result<Vec<u8>, BuildError> {
    let options =
        LzmaOptions { nice_len: 273, dict_size: 1 << 24, lc: 4, pb: 0, ..LzmaOptions::with_preset(9) };
    let write = || {
        let mut writer = LzmaWriter::new_use_header(Vec::new(), &options, Some(bytes.len() as u64))?;
        writer.write_all(bytes)?;
        writer.finish()
    };
    write().map_err(|reason| BuildError::File { path: "packing".into(), reason })
}

/// Bytes as text, two characters for 13 bits (base64: 2.17). Bits are taken least significant first; each 13
/// are a number, whose two digits to the base 91 follow, least significant first. Digits are the printable
/// characters from `!` on without `"`, `<` and the backslash. The number of bytes stands before them.
fn as_text(bytes: &[u8]) -> String {
    let mut out = format!("{} ", bytes.len());
    let digit = |number: u32| {
        let code = number as u8 + b'!';
        char::from([b'"', b'<', b'\\'].iter().fold(code, |code, not| code + u8::from(code >= *not)))
    };
    let (mut held, mut bits) = (0u32, 0);
    // zeros complete the last number
    for byte in bytes.iter().copied().chain([0, 0]) {
        held |= u32::from(byte) << bits;
        bits += 8;
        if bits >= 13 {
            let number = held & 0x1fff;
            out.extend([digit(number % 91), digit(number / 91)]);
            held >>= 13;
            bits -= 13;
        }
    }
    out
}

/// Schemes and models of the repository's examples, each with its description in the list of examples.
fn examples(root: &Path) -> Result<Vec<Value>, BuildError> {
    let read = |path: &Path| {
        fs::read_to_string(path)
            .map_err(|reason| BuildError::File { path: path.display().to_string(), reason })
    };
    let folder = root.join("examples");
    let list = read(&folder.join("README.md"))?;
    let mut out = Vec::new();
    for row in list.lines().filter_map(|l| l.strip_prefix("| [")) {
        let Some((names, about)) = row.trim_end_matches(" |").split_once(" | ") else { continue };
        for name in names.split('(').skip(1).filter_map(|n| n.split(')').next()) {
            for kind in ["scheme", "model"] {
                let file = folder.join(name).join(format!("{kind}.toml"));
                if file.is_file() {
                    out.push(json!({ "name": name, "kind": kind, "about": about, "text": read(&file)? }));
                }
            }
        }
    }
    Ok(out)
}

/// Digest of a script or style, as a content security policy names it.
fn digest(text: &str) -> String {
    STANDARD.encode(Sha256::digest(text))
}

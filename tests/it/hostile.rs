//! Texts from hostile files, paths and arguments are printed as plain text in every format and on the
//! terminal.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use obsdeg_report::Format;
use serde_json::Value;

use crate::program::obsdeg;

/// Colour, bell, backspace, end of text, window title, C1 controls, reversed writing direction, and
/// characters with a meaning in markup and spreadsheets.
const NASTY: &str = "\u{1b}[31m\u{7}\u{8}\u{0}\u{1b}]0;\
                     t\u{7}\u{9b}2J\u{85}\u{202e}\u{2066}\u{200f}\u{2028}\u{7f}\u{ffff}`<b>|$^{}\\\"'&%#_*[x](y)";

/// The hostile text in a string of TOML or JSON.
fn escaped() -> String {
    let hidden = |c: char| c.is_control() || c > '\u{7f}' || "\"\\".contains(c);
    NASTY
        .chars()
        .map(|c| if hidden(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() })
        .collect()
}

/// Asserts that a text has no character that terminals or pages must not receive.
fn assert_text(text: &str, about: &str) {
    for (i, line) in text.lines().enumerate() {
        let raw = |c: char| c.is_control() || "\u{202e}\u{2066}\u{200f}\u{2028}\u{ffff}".contains(c);
        // tabs occur in our own scripts
        let found = line.chars().find(|&c| c != '\t' && raw(c));
        assert_eq!(found, None, "{about}, line {}: {line:?}", i + 1);
    }
}

struct Files {
    folder: tempfile::TempDir,
}

impl Files {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let text = escaped();
        let scheme = format!(
            "name = \"={text}\"\ndescription = \"{text}\"\n[[position]]\nangles_deg = [0, 0, 0]\ndwell_s = 100\n\
             [[position]]\nangles_deg = [180, 0, 0]\ndwell_s = 100\n"
        );
        let model = format!(
            "name = \"={text}\"\ndescription = \"{text}\"\n[states]\nx = {{ equation = \"-k*x\", unit = \"=cmd|' /C \
             calc'!A0\", description = \"{text}\" }}\n\
             [parameters]\nk = {{ unit = \"{text}\" }}\n[outputs]\ny = {{ expression = \"x\", unit = \"@SUM(1)\", \
             description = \"-{text}\" }}\n\
             [simulation]\nduration = 10\nstep = 0.1\nvalues = {{ x = 1, k = 0.5 }}\npriors = {{ x = 0.1, k = 0.1 }}\n\
             noise = {{ y = 0.01 }}\n"
        );
        let files = Self { folder };
        fs::write(files.path("scheme.toml"), scheme).expect("written");
        fs::write(files.path("model.toml"), model).expect("written");
        files
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs a command in the folder and checks its output.
    fn run(&self, arguments: &[&str]) -> Output {
        let output = obsdeg(arguments).current_dir(self.folder.path()).output().expect("it runs");
        let about = format!("{arguments:?}");
        assert!(output.status.code().is_some_and(|code| code < 3), "{about}: {:?}", output.status);
        for stream in [&output.stdout, &output.stderr] {
            assert_text(std::str::from_utf8(stream).expect("UTF-8"), &about);
        }
        output
    }

    fn done(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        // a short run of two positions may fail its checks
        assert!(output.status.code().is_some_and(|code| code < 2), "{arguments:?}: {output:?}");
        String::from_utf8(output.stdout).expect("UTF-8")
    }
}

/// Asserts that every text file below a folder is plain text; returns the number of files.
fn assert_files(folder: &Path) -> usize {
    let mut n = 0;
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            n += assert_files(&path);
            continue;
        }
        let bytes = fs::read(&path).expect("readable");
        if !path.extension().is_some_and(|e| ["png", "parquet", "pdf"].iter().any(|binary| e == *binary)) {
            assert_text(std::str::from_utf8(&bytes).expect("UTF-8"), &path.display().to_string());
        }
        n += 1;
    }
    n
}

#[test]
fn results_in_every_format() {
    let files = Files::new();
    for command in [
        &["analyze", "--solutions", "off", "--scheme", "scheme.toml"][..],
        &["analyze", "--solutions", "off", "--model", "model.toml"],
        &["simulate", "--scheme", "scheme.toml"],
        &["simulate", "--model", "model.toml"],
        &["crosscheck", "--model", "model.toml"],
        &["compare", "scheme.toml"],
    ] {
        for format in Format::ALL.map(|(_, name)| name) {
            let text = files.done(&[command, &["--format", format]].concat());
            match format {
                "json" => {
                    let json: Value = serde_json::from_str(&text).expect("JSON");
                    // JSON contains the text verbatim
                    if command.contains(&"analyze") && command.contains(&"--model") {
                        assert_eq!(json["name"], format!("={NASTY}"));
                        assert_eq!(json["quantities"][1]["unit"], NASTY);
                    }
                }
                "csv" => {
                    let mut reader = csv::Reader::from_reader(text.as_bytes());
                    for field in reader
                        .records()
                        .flat_map(|r| r.expect("a record").iter().map(String::from).collect::<Vec<_>>())
                    {
                        let other_program =
                            field.starts_with('-') && field.contains(['|', '!', '"', '&', '<']);
                        assert!(
                            !field.starts_with(['=', '+', '@']) && !other_program,
                            "{command:?}: {field}"
                        );
                    }
                }
                _ => {}
            }
        }
    }
}

#[test]
fn files_and_pictures() {
    let files = Files::new();
    fs::create_dir(files.path("out")).expect("made");
    files.done(&["simulate", "--model", "model.toml", "-q", "-o", "out/run"]);
    for name in ["out/r.html", "out/r.tex"] {
        files.done(&["report", "-q", "--runs", "2", "scheme.toml", "model.toml", "-o", name]);
    }
    assert!(assert_files(&files.path("out")) > 20);
    let page =
        scraper::Html::parse_document(&fs::read_to_string(files.path("out/r.html")).expect("readable"));
    let all = scraper::Selector::parse("body").expect("a selector");
    let text: String = page.select(&all).flat_map(|b| b.text()).collect();
    assert!(text.contains("\\u{1b}[31m\\u{7}"), "names are there, written out");
}

/// Keys, values, paths and arguments in messages.
#[test]
fn messages() {
    let files = Files::new();
    let text = escaped();
    for (i, wrong) in [
        format!("\"{text}\" = 1\n"),
        format!("carry = \"{text}\"\n"),
        format!("[requirements]\n\"{text}\" = 1\n"),
        format!("[[position]]\nname = \"{text}\"\nangles_deg = [0, 0, 0]\n"),
        format!("[[position]]\nangles_deg = [\"{text}\", 0, 0]\n"),
        format!("combinations = [\"{text}\"]\n[[position]]\nangles_deg = [0, 0, 0]\n"),
        format!("name = \"m\"\n[states]\n\"{text}\" = \"1\"\n[outputs]\ny = \"x\"\n"),
        format!("name = \"m\"\n[states]\nx = \"{text}\"\n[outputs]\ny = \"x\"\n"),
        format!("name = {NASTY}\n"),
        NASTY.to_string(),
    ]
    .iter()
    .enumerate()
    {
        let name = format!("{i}.toml");
        fs::write(files.path(&name), wrong).expect("written");
        for command in
            [&["analyze", "--scheme"][..], &["analyze", "--model"], &["compare"], &["report", "-o", "r.md"]]
        {
            let output = files.run(&[command, &[&name]].concat());
            assert_eq!(output.status.code(), Some(2), "{command:?} {wrong:?}");
        }
    }
    let argument = NASTY.replace('\0', "");
    // without a slash: a file name
    let path = format!("{}.toml", argument.replace('/', ""));
    for arguments in [
        &["analyze", "--angles", &argument][..],
        &["analyze", "--carry", &argument],
        &["analyze", &argument],
        &[&argument],
        &["analyze", "--scheme", &argument],
        &["analyze", "--angles", "0,0,0", "--combination", &argument],
        &["compare", &argument],
        &["simulate", "--angles", "0,0,0", "--value", &format!("{argument}=1")],
        &["design", "--candidates", &argument, "--positions", "2"],
        &["report", "scheme.toml", "-o", &argument],
        &["paper", "-o", &format!("no-such-folder/{argument}")],
    ] {
        assert_eq!(files.run(arguments).status.code(), Some(2), "{arguments:?}");
    }
    fs::copy(files.path("scheme.toml"), files.path(&path)).expect("copied");
    let renamed = fs::read_to_string(files.path(&path)).expect("readable").replacen("name", "nmae", 1);
    fs::write(files.path(&path), &renamed).expect("written");
    assert_eq!(files.run(&["analyze", "--scheme", &path]).status.code(), Some(2));
    // a scheme without a name is named after its file
    let unnamed = renamed.split_once("description").expect("there").1;
    fs::write(files.path(&path), format!("description{unnamed}")).expect("written");
    for format in Format::ALL.map(|(_, name)| name) {
        files.done(&["compare", &path, "--format", format]);
    }
}

//! The commands in the book and in the README run and print what the text shows.
//!
//! A `console` block shows commands (`$ ...`) and their output on stdout. A line `...` stands for any lines.
//! A `sh` block is a script that must succeed. The comment `<!-- file NAME -->` before a block writes the
//! block to that file. The comment `<!-- exit code N -->` states the exit code of the block's commands; their
//! stderr is then shown after their stdout. Commands run one after the other in a folder of their own that
//! contains the examples. `python/tests/test_readme.py` runs the `pycon` blocks. `UPDATE_BOOK=1` writes the
//! printed output into the texts; between two lines `...` it takes the most similar printed lines.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Code block between fences: info string behind the first fence, comment before it, number of the first line
/// (from 0) and lines.
#[derive(Debug, Default)]
struct Block<'a> {
    info: &'a str,
    comment: &'a str,
    start: usize,
    lines: Vec<&'a str>,
}

fn blocks(text: &str) -> Vec<Block<'_>> {
    let mut out: Vec<Block<'_>> = Vec::new();
    let (mut open, mut before) = (false, "");
    for (n, line) in text.lines().enumerate() {
        match line.strip_prefix("```") {
            Some(_) if open => open = false,
            Some(info) => {
                let comment = before.strip_prefix("<!-- ").and_then(|c| c.strip_suffix(" -->")).unwrap_or("");
                out.push(Block { info, comment, start: n + 1, lines: Vec::new() });
                open = true;
            }
            None if open => out.last_mut().expect("a block").lines.push(line),
            None => {}
        }
        before = line;
    }
    assert!(!open, "a block has no end");
    out
}

fn same(shown: &str, printed: &str) -> bool {
    let rule = |line: &str| !line.is_empty() && line.chars().all(|c| c == '─');
    shown.trim_end() == printed.trim_end() || rule(shown) && rule(printed)
}

/// True if the shown lines match the printed ones; `...` matches any number of lines.
fn agree(shown: &[&str], printed: &[&str]) -> bool {
    match shown.split_first() {
        None => printed.is_empty(),
        Some((&"...", rest)) => (0..=printed.len()).any(|n| agree(rest, &printed[n..])),
        Some((line, rest)) => {
            printed.split_first().is_some_and(|(first, others)| same(line, first) && agree(rest, others))
        }
    }
}

/// Fraction of words that two lines share, from 0 to 1.
fn likeness(a: &str, b: &str) -> f64 {
    let (mut ours, theirs): (Vec<&str>, Vec<&str>) =
        (a.split_whitespace().collect(), b.split_whitespace().collect());
    let (all, mut common) = (ours.len().max(theirs.len()), 0);
    for word in theirs {
        if let Some(at) = ours.iter().position(|w| *w == word) {
            ours.swap_remove(at);
            common += 1;
        }
    }
    if same(a, b) || all == 0 { 1.0 } else { f64::from(common) / all as f64 }
}

/// Shown lines with the printed text in their place. Each run of shown lines is replaced by the most similar
/// run of as many printed lines, in order.
fn renewed(shown: &[&str], printed: &[&str]) -> Vec<String> {
    if !shown.contains(&"...") {
        return printed.iter().map(|l| l.trim_end().to_string()).collect();
    }
    let runs = shown.split(|l| *l == "...").filter(|run| !run.is_empty());
    let (mut out, mut from) = (Vec::new(), 0);
    for run in runs {
        let score = |at: usize| -> f64 { run.iter().zip(&printed[at..]).map(|(a, b)| likeness(a, b)).sum() };
        let places = from..=printed.len().saturating_sub(run.len()).max(from);
        let best = places.max_by(|&a, &b| score(a).total_cmp(&score(b)).then(b.cmp(&a))).unwrap_or(from);
        if best > from {
            out.push("...".to_string());
        }
        from = (best + run.len()).min(printed.len());
        // a horizontal rule keeps its length
        let lines = run.iter().zip(&printed[best..from]);
        out.extend(lines.map(|(old, new)| if same(old, new) { *old } else { new.trim_end() }.to_string()));
    }
    if from < printed.len() {
        out.push("...".to_string());
    }
    out
}

#[test]
fn what_is_shown_is_renewed_line_by_line() {
    let printed = ["head", "", "name verdict", "a 1", "b 2", "", "end"];
    let shown = ["...", "name status", "a 1", "...", "end of it"];
    assert_eq!(renewed(&shown, &printed), ["...", "name verdict", "a 1", "...", "end"]);
    assert_eq!(renewed(&["head", "...", "b 3", "..."], &printed), ["head", "...", "b 2", "..."]);
    assert_eq!(renewed(&["old"], &printed[..2]), ["head", ""]);
    assert_eq!(renewed(&["──", "...", "a 2"], &["────", "b", "a 1"]), ["──", "...", "a 1"]);
}

#[test]
fn what_is_left_out_is_any_lines_and_nothing_else() {
    let printed = ["a", "b", "───", "c "];
    for shown in [&["a", "...", "c"][..], &["...", "b", "─", "c"], &["a", "b", "...", "───", "c", "..."]]
    {
        assert!(agree(shown, &printed), "{shown:?}");
    }
    for shown in [&["a", "...", "b"][..], &["a", "b"], &["b", "..."], &["a", "...", "d", "..."], &[]] {
        assert!(!agree(shown, &printed), "{shown:?}");
    }
}

/// Folder in which the commands of one text run.
struct CommandFolder {
    folder: tempfile::TempDir,
}

impl CommandFolder {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        symlink(root().join("examples"), folder.path().join("examples")).expect("a link");
        Self { folder }
    }

    /// Stdout of a command, followed by its stderr if `code` is not 0. Error: another exit code.
    fn run(&self, script: &str, code: i32) -> Result<String, String> {
        let program = Path::new(env!("CARGO_BIN_EXE_obsdeg")).parent().expect("a folder");
        let path = std::env::var_os("PATH").unwrap_or_default();
        let places = std::iter::once(PathBuf::from(program)).chain(std::env::split_paths(&path));
        let output = Command::new("sh")
            .args(["-e", "-c", script])
            .current_dir(self.folder.path())
            .env("PATH", std::env::join_paths(places).expect("a path"))
            .env("HOME", self.folder.path())
            .envs([("LC_ALL", "C.UTF-8"), ("TERM", "xterm"), ("NO_COLOR", "1")])
            .env_remove("COLUMNS")
            .stdin(Stdio::null())
            .output()
            .expect("a shell");
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
        let (printed, errors) = (text(&output.stdout), text(&output.stderr));
        if output.status.code() != Some(code) {
            return Err(format!(
                "ends with {}, not with exit code {code}:\n{printed}{errors}",
                output.status
            ));
        }
        Ok(if code == 0 { printed } else { format!("{printed}{errors}") })
    }
}

/// Command as the test runs it, with the program already built; `None` for a command that only builds.
fn as_run(command: &str) -> Option<String> {
    match command.strip_prefix("cargo run --release -- ") {
        Some(rest) => Some(format!("obsdeg {rest}")),
        None => (!command.starts_with("cargo ")).then(|| command.to_string()),
    }
}

/// Runs the commands of a text. Returns the mismatches and the text with the printed output in place.
fn held(name: &str, text: &str) -> (Vec<String>, String) {
    let desk = CommandFolder::new();
    let mut wrong = Vec::new();
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    // applied from the last to the first, so that line numbers stay valid
    let mut exchanges: Vec<(usize, usize, Vec<String>)> = Vec::new();
    for block in blocks(text) {
        let place = |n: usize| format!("{name}:{}", block.start + n + 1);
        if let Some(file) = block.comment.strip_prefix("file ") {
            fs::write(desk.folder.path().join(file), block.lines.join("\n") + "\n").expect("written");
        }
        let code = block.comment.strip_prefix("exit code ").map_or(0, |n| n.parse().expect("a number"));
        match block.info {
            "console" => {
                let starts: Vec<usize> =
                    (0..block.lines.len()).filter(|&n| block.lines[n].starts_with("$ ")).collect();
                assert_eq!(starts.first(), Some(&0), "{}: no command", place(0));
                for (i, &n) in starts.iter().enumerate() {
                    let end = starts.get(i + 1).copied().unwrap_or(block.lines.len());
                    let (command, shown) = (&block.lines[n][2..], &block.lines[n + 1..end]);
                    let Some(script) = as_run(command) else { continue };
                    match desk.run(&script, code) {
                        Err(reason) => wrong.push(format!("{}: `{command}` {reason}", place(n))),
                        Ok(printed) => {
                            let found: Vec<&str> = printed.trim_end().lines().collect();
                            if agree(shown, &found) {
                                continue;
                            }
                            exchanges.push((block.start + n + 1, block.start + end, renewed(shown, &found)));
                            wrong.push(format!("{}: `{command}` prints\n{printed}", place(n)));
                        }
                    }
                }
            }
            "sh" => {
                let script: Vec<String> = block.lines.iter().filter_map(|l| as_run(l)).collect();
                if let Err(reason) = desk.run(&script.join("\n"), 0) {
                    wrong.push(format!("{}: {reason}", place(0)));
                }
            }
            other => {
                let known = ["toml", "text", "math", "pycon"].contains(&other);
                let hidden = block.lines.iter().any(|l| l.trim_start().starts_with("obsdeg "));
                assert!(known && !hidden, "{}: a block of {other:?} is not run", place(0));
            }
        }
    }
    for (from, to, new) in exchanges.into_iter().rev() {
        lines.splice(from..to, new);
    }
    (wrong, lines.join("\n") + "\n")
}

fn chapters() -> Vec<PathBuf> {
    let folder = root().join("book/src");
    let mut out: Vec<PathBuf> =
        fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path()).collect();
    out.retain(|path| path.extension().is_some_and(|e| e == "md"));
    out.sort();
    out
}

/// The shown expressions need the symbolic engine.
#[cfg(feature = "symbolica")]
#[test]
#[ignore = "seconds: .ci/run"]
fn every_command_runs_and_prints_what_is_shown() {
    let texts: Vec<PathBuf> = std::iter::once(root().join("README.md")).chain(chapters()).collect();
    let wrong: Vec<String> = std::thread::scope(|scope| {
        let threads: Vec<_> = texts
            .iter()
            .map(|path| {
                scope.spawn(move || {
                    let text = fs::read_to_string(path).expect("readable");
                    let name = path.strip_prefix(root()).expect("of the repository").display().to_string();
                    let (wrong, new) = held(&name, &text);
                    if std::env::var_os("UPDATE_BOOK").is_some() && new != text {
                        fs::write(path, new).expect("written");
                    }
                    wrong
                })
            })
            .collect();
        threads.into_iter().flat_map(|t| t.join().expect("no panic")).collect()
    });
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// Deliberate errors in a text are found, and corrected where possible.
#[test]
fn a_text_that_is_wrong_is_reported() {
    let of = |text: &str| held("here", text);
    let shown = |lines: &str| format!("```console\n$ printf 'a\\nb\\nc\\n'\n{lines}```\n");
    assert!(of(&shown("a\nb\nc\n")).0.is_empty() && of(&shown("a\n...\n")).0.is_empty());
    let (wrong, new) = of(&shown("a\nc\n"));
    assert!(wrong[0].starts_with("here:2: `printf") && new == shown("a\nb\nc\n"), "{wrong:?} {new}");
    let (wrong, new) = of(&shown("...\nd\n"));
    assert!(wrong.len() == 1 && new == shown("a\n...\n"), "{new}");
    let file = "<!-- file x.toml -->\n```toml\nx = 1\n```\n\n<!-- exit code 2 -->\n```console\n";
    let refused = format!("{file}$ obsdeg analyze --scheme x.toml\n```\n");
    assert!(
        of(&refused).0[0].contains("unknown field `x`") || of(&refused).0[0].contains("`x`"),
        "{:?}",
        of(&refused)
    );
    assert!(of("```console\n$ obsdeg nothing\n```\n").0[0].contains("not with exit code 0"));
    assert!(of("```sh\nobsdeg --version\nfalse\ntrue\n```\n").0.len() == 1);
}

/// Pictures of the book: the command that draws each, and its name.
const PICTURES: [(&str, &str); 4] = [
    ("obsdeg crosscheck --angles 0,0,0 --angles 180,0,0", "slopes"),
    ("obsdeg design examples/mapk/model.toml", "front"),
    ("obsdeg design examples/nfkb/model.toml --own-outputs", "degrees"),
    ("obsdeg design examples/bench-day/scheme.toml --next 1", "attitudes"),
];

/// Pictures of the book are identical to those that their commands draw.
#[test]
fn pictures_are_those_that_are_drawn() {
    let desk = CommandFolder::new();
    for (command, name) in PICTURES {
        desk.run(&format!("{command} -o drawn-{name}"), 0).expect("drawn");
        let drawn = desk.folder.path().join(format!("drawn-{name}/{name}.svg"));
        let drawn = fs::read_to_string(drawn).expect("readable");
        let shown = root().join(format!("book/src/{name}.svg"));
        if std::env::var_os("UPDATE_BOOK").is_some() {
            fs::write(&shown, &drawn).expect("written");
        }
        // a plain assertion: `assert_eq` would print the whole picture
        assert!(
            fs::read_to_string(&shown).expect("readable") == drawn,
            "UPDATE_BOOK=1 draws {shown:?} again"
        );
    }
}

/// The summary lists every chapter exactly once and nothing else.
#[test]
fn the_summary_lists_the_chapters() {
    let summary = fs::read_to_string(root().join("book/src/SUMMARY.md")).expect("readable");
    let mut listed: Vec<&str> =
        summary.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(file, _)| file).collect();
    let count = listed.len();
    listed.sort_unstable();
    listed.dedup();
    assert_eq!(count, listed.len());
    let names = chapters().into_iter().filter_map(|p| Some(p.file_name()?.to_string_lossy().into_owned()));
    let there: BTreeSet<String> = names.filter(|n| n != "SUMMARY.md").collect();
    assert_eq!(there, listed.into_iter().map(String::from).collect());
}

//! Help and messages: `-h` in lines, `--help` in full, models of other tools, colours.

use obsdeg_core::system::WorkLimit;

use crate::program::{obsdeg, refused, run, scratch, stderr, stdout};

/// The commands, each with the largest number of lines of its `-h`.
const COMMANDS: [(&str, usize); 15] = [
    ("analyze", 51),
    ("simulate", 65),
    ("crosscheck", 70),
    ("procedure", 72),
    ("calibrate", 51),
    ("allan", 24),
    ("compare", 47),
    ("design", 84),
    ("report", 61),
    ("paper", 18),
    ("verify", 15),
    ("licences", 12),
    ("completions", 12),
    ("man", 14),
    ("schema", 10),
];

/// `-h` has one line per option, without ranges, with inputs first. `--help` lists the same number of
/// options, with ranges and words.
#[test]
fn help_is_in_lines() {
    let text = |arguments: &[&str]| {
        let output = run(arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        stdout(&output)
    };
    let is_option = |line: &str| {
        let indented = line.len() - line.trim_start().len();
        (2..=6).contains(&indented)
            && ["--", "-h,", "-o,", "-q,", "<", "["].iter().any(|s| line.trim_start().starts_with(s))
    };
    for (command, most) in COMMANDS {
        let (short, long) = (text(&[command, "-h"]), text(&[command, "--help"]));
        let mut sections = Vec::new();
        for line in short.lines().skip(1) {
            assert!(line.chars().count() <= 100, "{command}: {line}");
            assert!(!line.contains(" to 1e") && !line.contains("[possible values"), "{command}: {line}");
            let other = ["Usage: ", "Examples, ranges"].iter().any(|start| line.starts_with(start));
            match line.strip_suffix(':').filter(|l| !l.starts_with(' ')) {
                Some(section) => sections.push(section.to_string()),
                None => assert!(line.is_empty() || other || is_option(line), "{command}: {line}"),
            }
        }
        assert!(["Arguments", "Options"].contains(&&*sections[0]), "{command}: {sections:?}");
        let options = |text: &str| text.lines().filter(|line| is_option(line)).count();
        assert_eq!(options(&short), options(&long), "{command}");
        assert!(short.lines().count() <= most, "{command}: {} lines", short.lines().count());
    }
    let design = text(&["design", "--help"]);
    for part in ["0.001 to 1e6 s", "- inertial:", "- grid:45:", "Exit codes: 0 done"] {
        assert!(design.contains(part), "{part}");
    }
    let lines: Vec<String> = text(&["design", "-h"]).lines().map(Into::into).collect();
    let place = |of: &str| lines.iter().position(|l| l.trim_start().starts_with(of)).expect("a line");
    assert!(place("[SCHEME]") < place("--positions") && place("--positions") < place("--carry"));
    assert!(place("--candidates") < place("--carry"));
    // latitude of these commands if none is given
    for command in ["simulate", "crosscheck"] {
        for help in ["-h", "--help"] {
            let text = text(&[command, help]);
            assert!(text.contains("28.2") && !text.contains("left out: generic"), "{command}");
        }
    }
    assert!(text(&["analyze", "-h"]).contains("left out: generic"));
    for help in ["-h", "--help"] {
        let text = text(&["analyze", help]).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            text.contains(&format!("operations (default: {}", WorkLimit::DEFAULT.0))
                || text.contains(&format!("(default: {}, some seconds)", WorkLimit::DEFAULT.0)),
            "{text}"
        );
    }
    // verdicts of a report are generic without a latitude
    assert!(text(&["report", "-h"]).contains("28.2 for numbers"));
    // a busy engine is reported on stderr even with --quiet (tests/symbolic.rs)
    assert!(text(&["analyze", "-h"]).contains("nothing on stderr but errors and what is missing"));
}

/// A model of another tool is refused with the command line of the Python package that reads it. A file with
/// such a name and a model of obsdeg is read.
#[test]
fn models_of_other_tools_are_named() {
    let (folder, _) = scratch();
    let ode = "using StructuralIdentifiability\node = @ODEmodel(x'(t) = a*x(t), y(t) = x(t))\n";
    for (name, text, kind) in [
        ("model.jl", ode, "@ODEmodel of StructuralIdentifiability.jl"),
        ("model.txt", ode, "@ODEmodel of StructuralIdentifiability.jl"),
        ("model.xml", "<?xml version=\"1.0\"?><sbml/>", "SBML"),
        ("model.m", "syms x a\n", "a script of STRIKE-GOLDD"),
        ("problem.yaml", "format_version: 1\n", "a PEtab problem"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        let path = path.display().to_string();
        let line = format!("python -c 'import obsdeg; print(obsdeg.analyze(obsdeg.load(\"{path}\")))'");
        for command in ["analyze", "simulate", "compare"] {
            refused(&[command, &path], &[kind, &line]);
        }
    }
    let odd = folder.path().join("a'$(x).jl");
    std::fs::write(&odd, ode).expect("written");
    refused(&["analyze", &odd.display().to_string()], &["obsdeg.load(\"FILE\")"]);
    let own = folder.path().join("own.yaml");
    let model = "[states]\nx = \"-a*x\"\n[parameters]\na = {}\n[outputs]\ny = \"x\"\n";
    std::fs::write(&own, model).expect("written");
    let message = stderr(&run(&["analyze", &own.display().to_string()]));
    assert!(!message.contains("seems to be"), "{message}");
}

/// Messages of the program have the colours of clap's messages on a terminal with colours.
#[test]
fn messages_have_colours_on_a_terminal() {
    let said = |arguments: &[&str], variable: &str| {
        let output = obsdeg(arguments).env(variable, "1").output().expect("it runs");
        assert_eq!(output.status.code(), Some(2));
        stderr(&output)
    };
    let red = "\u{1b}[1m\u{1b}[31merror:\u{1b}[0m ";
    let wrong = ["analyze", "examples/wrong-angle/scheme.toml"];
    for arguments in [&["analyze", "no-such-file.toml"][..], &["analyze", "--carrie", "x"], &wrong] {
        assert!(said(arguments, "CLICOLOR_FORCE").starts_with(red), "{arguments:?}");
        let plain = said(arguments, "NO_COLOR");
        assert!(!plain.contains('\u{1b}') && plain.starts_with("error: "), "{arguments:?} {plain}");
    }
}

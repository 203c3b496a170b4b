//! Conventions of command lines: names of files, formats, ASCII output, the manual, completions.

use std::path::Path;

use serde_json::Value;

use crate::program::{json, obsdeg, refused, run, scratch, stderr, stdout};

const P1P2: [&str; 5] = ["analyze", "--angles", "0,0,0", "--angles", "180,0,0"];

/// Every command recognises the kind of a file by its content; `-` is stdin and stdout.
#[test]
fn one_way_to_name_files() {
    let (scheme, model) = ("examples/pole/scheme.toml", "examples/sir/model.toml");
    let plain = |arguments: &[&str]| stdout(&run(arguments));
    let off = ["--solutions", "off", "--quiet"];
    let alone = |file| plain(&[&["analyze", file], &off[..]].concat());
    assert_eq!(alone(scheme), plain(&[&["analyze", "--scheme", scheme], &off[..]].concat()));
    assert_eq!(alone(model), plain(&[&["analyze", "--model", model], &off[..]].concat()));
    let mut piped = obsdeg(&[&["analyze", "-", "-o", "-"], &off[..]].concat());
    piped
        .stdin(std::fs::File::open(Path::new(env!("CARGO_MANIFEST_DIR")).join(scheme)).expect("it is there"));
    assert_eq!(String::from_utf8_lossy(&piped.output().expect("it runs").stdout), alone(scheme));
    refused(&["analyze", "-", scheme, "-"], &["- is given twice"]);
    // several files are judged one after another
    let both = plain(&[&["analyze", scheme, model], &off[..]].concat());
    let (a, b) = (alone(scheme), alone(model));
    let lines =
        |text: &str| text.lines().skip(1).filter(|l| !l.is_empty()).map(String::from).collect::<Vec<_>>();
    let all = lines(&both);
    assert!(lines(&a).iter().chain(&lines(&b)).all(|l| all.contains(l)), "{both}");
    assert!(both.contains(&format!("{scheme}: ")) && both.contains(&format!("{model}: ")), "{both}");
    let list = json(&[&["analyze", scheme, model, "--format", "json"], &off[..]].concat());
    let one = json(&[&["analyze", model, "--format", "json"], &off[..]].concat());
    assert_eq!((&list[1]["file"], &list[1]["answer"]), (&Value::from(model), &one));
    // options of schemes with a model, and the reverse
    refused(&["analyze", model, "--carry", "inertial"], &["--carry is about schemes", model]);
    refused(&["analyze", scheme, "--order", "3"], &["--order is about models", scheme]);
    refused(&["analyze", "--angles", "NUE", "--order", "3"], &["--order is about models"]);
    refused(&["simulate", scheme, scheme], &["no more were expected"]);
    refused(&["report", model, "-o", "x.html", "--carry", "reset"], &["--carry is about schemes"]);
    refused(&["calibrate", scheme], &["no record"]);
    refused(&["design", scheme, scheme], &["unexpected argument"]);
    // options that every kind accepts
    let compared = plain(&["compare", scheme, "examples/six-positions/scheme.toml"]);
    assert_eq!(plain(&["compare", scheme, "--scheme", "examples/six-positions/scheme.toml"]), compared);
    refused(&["compare", "--scheme", model], &["is a model file; expected a scheme file"]);
    refused(&["compare", "--model", model], &["is a model file; expected scheme files"]);
    refused(&["compare", "-", "--scheme", "-"], &["- is given twice"]);
    refused(&["compare"], &["<FILE>..."]);
    let (folder, _) = scratch();
    let page = |arguments: &[&str], name: &str| {
        let at = folder.path().join(name);
        let to = ["--runs", "2", "-q", "-o", at.to_str().expect("UTF-8")];
        assert!(run(&[&["report"], arguments, &to].concat()).status.success());
        // the file names the command that wrote it
        let text = std::fs::read_to_string(at).expect("written");
        text.replace("--scheme ", "").replace("--model ", "")
    };
    assert_eq!(page(&["--model", model], "a.md"), page(&[model], "a2.md").replace("a2_figures", "a_figures"));
    refused(&["report", "--model", scheme, "-o", "x.html"], &["is a scheme file; expected a model file"]);
    refused(
        &["report", model, "--order", "3", "-o", "x.html"],
        &["--order is an option of `obsdeg analyze`"],
    );
}

/// The format follows the file extension, `--format` takes precedence, and CSV is one of the lists of the
/// JSON.
#[test]
fn formats_follow_the_ending() {
    let (folder, _) = scratch();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let off = ["--solutions", "off"];
    for (name, format) in
        [("a.json", "json"), ("a.md", "markdown"), ("a.CSV", "csv"), ("a.tex", "latex"), ("a.txt", "table")]
    {
        let path = at(name);
        assert!(run(&[&P1P2[..], &off, &["-o", &path]].concat()).status.success());
        let expected = stdout(&run(&[&P1P2[..], &off, &["--format", format]].concat()));
        assert_eq!(std::fs::read_to_string(&path).expect("written"), expected, "{name}");
    }
    let path = at("b.csv");
    assert!(run(&[&P1P2[..], &["-o", &path, "--format", "json"]].concat()).status.success());
    assert!(std::fs::read_to_string(&path).expect("written").starts_with('{'));
    refused(&[&P1P2[..], &["-o", &at("c.html")]].concat(), &["no format for .html", "obsdeg report"]);
    // an unknown extension is an error, even where a folder would be accepted
    refused(&[&P1P2[..], &["-o", &at("c.xlsx")]].concat(), &["no format for .xlsx", ".csv", "--format"]);
    refused(
        &[&["simulate"], &P1P2[1..], &["-o", &at("c.xlsx")]].concat(),
        &["no format for .xlsx", "--format"],
    );
    assert!(!folder.path().join("c.xlsx").exists());
    let path = at("d.dat");
    assert!(run(&[&P1P2[..], &["-o", &path, "--format", "csv"]].concat()).status.success());
    assert!(std::fs::read_to_string(&path).expect("written").starts_with("name,unit"));
    let positions = stdout(&run(&[&P1P2[..], &off, &["--table", "positions"]].concat()));
    assert_eq!(positions.lines().nth(1), Some("p1,0.0; 0.0; 0.0,NUE,,0.0; -1.0; 0.0"), "{positions}");
    refused(&[&P1P2[..], &["--table", "latitude_deg"]].concat(), &["error: no table `latitude_deg`"]);
    refused(&[&P1P2[..], &["--table", "x"]].concat(), &["error: no table `x`", "quantities", "combinations"]);
    refused(&[&P1P2[..], &["--table", "x", "--format", "json"]].concat(), &["--table x is about CSV"]);
    refused(&["simulate", "--angles", "NUE", "-o", "-"], &["-o - is stdout; expected a folder"]);
    // where a folder would be accepted, a file extension means a file
    let path = at("run.json");
    assert!(run(&["simulate", "--angles", "NUE", "-o", &path]).status.success());
    let alone = stdout(&run(&["simulate", "--angles", "NUE", "--format", "json"]));
    assert_eq!(std::fs::read_to_string(&path).expect("written"), alone);
    refused(&["simulate", "--angles", "NUE", "-o", &path], &["run.json exists; --force"]);
    // an empty list is no error
    let none = [
        "calibrate",
        "examples/bench-day/scheme.toml",
        "examples/bench-day/record.csv",
        "--table",
        "outliers",
    ];
    assert_eq!(stdout(&run(&none)), "");
}

/// Output is ASCII on request, and where the locale supports nothing else.
#[test]
fn tables_in_ascii() {
    let off = [&P1P2[..], &["--solutions", "off"]].concat();
    let usual = stdout(&run(&off));
    assert!(!usual.is_ascii());
    let asked = stdout(&run(&[&off[..], &["--ascii"]].concat()));
    assert_eq!(asked, usual.replace('─', "-"));
    let of = |key: &str, value: &str| {
        let mut command = obsdeg(&off);
        ["LC_ALL", "LC_CTYPE", "LANG"].iter().for_each(|k| {
            command.env_remove(k);
        });
        String::from_utf8(command.env(key, value).output().expect("it runs").stdout).expect("UTF-8")
    };
    assert_eq!(of("LANG", "C"), asked);
    assert_eq!(of("LC_ALL", "de_DE.ISO-8859-1"), asked);
    assert_eq!(of("LANG", "C.UTF-8"), usual);
    assert_eq!(of("LANG", ""), usual);
    // messages are ASCII too
    let strange = |arguments: &[&str]| stderr(&run(&[&["analyze", "\u{e9}.toml"], arguments].concat()));
    assert!(strange(&[]).contains("\u{e9}.toml"));
    assert!(strange(&["--ascii"]).contains("\\u{e9}.toml"));
    let wrong = stderr(&run(&["analyze", "--ascii", "--carry", "\u{e9}"]));
    assert!(wrong.is_ascii() && wrong.contains("[possible values: platform, inertial, reset]"), "{wrong}");
}

/// Completions and manual pages.
#[test]
fn completions_and_manual() {
    for shell in ["bash", "zsh", "fish"] {
        let script = stdout(&run(&["completions", shell]));
        // candidate words that are not exhaustive, and the names of manual pages
        for words in ["cardinal", "grid", "crosscheck"] {
            assert!(script.contains(words), "{shell}: {words}");
        }
    }
    let bash = stdout(&run(&["completions", "bash"]));
    assert!(bash.contains(r#"compgen -W "cardinal free grid:45""#), "{bash}");
    assert!(bash.contains("--output --force --help analyze simulate crosscheck"), "{bash}");
    let missing = ["design", "--positions", "5", "--candidates", "foo"];
    refused(&missing, &["--candidates foo", "cardinal", "free", "grid:45", "a scheme file that exists"]);
    let manual = stdout(&run(&["man"]));
    assert!(manual.contains(".TH obsdeg") && manual.contains("obsdeg\\-analyze"), "{manual}");
    assert!(!manual.contains("obsdeg\\-help") && manual.contains("obsdeg\\-man"), "{manual}");
    let page = stdout(&run(&["man", "analyze"]));
    // one example per line, not filled
    let example = ".SH EXAMPLES\n.nf\n  obsdeg analyze \\-\\-angles 0,0,0 \\-\\-angles 180,0,0 ";
    assert!(page.contains(example) && page.contains("\n  obsdeg analyze model.toml "), "{page}");
    assert!(page.contains(".TH obsdeg-analyze") && page.contains(".SH \"EXIT STATUS\""), "{page}");
    let (folder, _) = scratch();
    let at = folder.path().join("man1");
    let write = ["man", "-o", at.to_str().expect("UTF-8")];
    assert!(run(&write).status.success());
    assert_eq!(std::fs::read_to_string(at.join("obsdeg-analyze.1")).expect("written"), page);
    assert_eq!(std::fs::read_to_string(at.join("obsdeg.1")).expect("written"), manual);
    refused(&write, &["exists; --force"]);
    refused(&["man", "nothing"], &["possible values: analyze, simulate"]);
}

/// An invalid or out-of-range whole number is refused with the range and the value given.
#[test]
fn whole_numbers() {
    let seeds = ["analyze", "simulate", "crosscheck", "calibrate", "compare", "design", "report", "paper"];
    for command in seeds {
        refused(&[command, "--seed", "-1"], &["--seed", "expected a whole number 0 to 2^64-1, found -1"]);
    }
    refused(&["design", "--positions", "x"], &["expected a whole number 1 to 100, found x"]);
    refused(&["design", "--positions", "5", "--front", "3,0"], &["1 to 100, found 0"]);
    refused(&["crosscheck", "--runs", "1"], &["expected a whole number 2 to 10000000, found 1"]);
    refused(&[&P1P2[..], &["--order", "99999999999999999999"]].concat(), &["0 to 1000, found 9999"]);
}

/// Wrong inputs of every kind: the message gives the place, the expected and the found input, and advice.
#[test]
fn wrong_inputs_are_reported_with_a_hint() {
    let (folder, _) = scratch();
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("file.txt"), "text").expect("written");
    let scheme = "examples/pole/scheme.toml";
    // a number with an exponent is accepted as a number
    refused(&["simulate", scheme, "--noise", "-1e-5"], &["--noise", "'-1e-5'", "expected 1e-15 to 1000 g"]);
    refused(&["simulate", scheme, "--noise", "--step", "5"], &["--noise", "'--step'", "expected 1e-15"]);
    // folders and files
    refused(&["analyze", "examples"], &["examples is a folder", "expected a scheme or model file"]);
    for command in [&["man", "-o"][..], &[&["analyze", scheme, "--figures"][..]].concat()] {
        refused(&[command, &[&at("file.txt")]].concat(), &["file.txt is a file; expected a folder"]);
    }
    // an undeclared name, and an incomplete name
    let undeclared = at("undeclared.toml");
    std::fs::write(&undeclared, "[states]\nx='-k*x'\n[outputs]\ny='x'\n").expect("written");
    let said =
        ["`k` is not known here; expected one of t, x; new names are declared as parameters, constants"];
    refused(&["analyze", &undeclared], &said);
    let short = at("short.toml");
    std::fs::write(&short, "latitud = 48\n[[position]]\nangles_deg=[0,0,0]\n").expect("written");
    refused(&["analyze", &short], &["unknown key `latitud`; did you mean `latitude_deg`?"]);
    // output of another command as input
    let part = ["design", "--positions", "5", "--merge", scheme];
    refused(&part, &["scheme.toml: it is no part", "expected the file that `obsdeg design --part` wrote"]);
    let calibration = ["report", scheme, "-o", &at("x.html"), "--calibration", scheme];
    refused(&calibration, &["scheme.toml: no JSON; expected what `obsdeg calibrate -o` wrote"]);
    // options of other commands, and file options without a file name
    refused(&["schema", "model", "-o", "x"], &["-o is an option of `obsdeg analyze`"]);
    refused(&[scheme], &["a scheme or model is judged by `obsdeg analyze examples/pole/scheme.toml`"]);
    assert!(!stderr(&run(&["schema", "--kind", "model"])).contains("-- --kind"));
}

/// The message on `--axes` explains the option where there are no terms, and for a model.
#[test]
fn axes_without_terms() {
    refused(&[&P1P2[..], &["--axes", "body"]].concat(), &["--axes body does nothing here", "--terms"]);
    let model = ["analyze", "examples/sir/model.toml", "--axes", "body"];
    refused(&model, &["--axes is about schemes", "is a model file"]);
}

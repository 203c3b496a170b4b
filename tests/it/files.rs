//! Reading and writing of files, and interrupts, on the real system.

use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, symlink};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::program::{obsdeg, run, stderr};

const SCHEME: &str = "[[position]]\nangles_deg = [0, 0, 0]\ndwell_s = 100\n[[position]]\nangles_deg = [180, 0, 0]\n\
                      dwell_s = 100\n";

/// Runs a shell command in which `$0` is the program.
fn shell(script: &str) -> Output {
    let mut command = Command::new("/bin/sh");
    command.args(["-c", script, env!("CARGO_BIN_EXE_obsdeg")]).output().expect("it runs")
}

fn folder() -> (tempfile::TempDir, impl Fn(&str) -> String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_path_buf();
    fs::write(path.join("scheme.toml"), SCHEME).expect("written");
    (folder, move |name: &str| path.join(name).display().to_string())
}

/// All files and folders below a folder, without the folder itself.
fn below(folder: &Path) -> Vec<PathBuf> {
    let mut out = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            out.extend(below(&path));
        }
        out.push(path);
    }
    out
}

/// Every command that writes creates files with the permissions of the user's umask.
#[test]
fn files_have_the_usual_permissions() {
    let (folder, at) = folder();
    fs::remove_file(at("scheme.toml")).expect("removed");
    let scheme = tempfile::NamedTempFile::new().expect("a file");
    fs::write(scheme.path(), SCHEME).expect("written");
    for command in [
        "analyze --scheme SCHEME --solutions off -o DIR/a.json",
        "paper -o DIR/p.txt",
        "compare SCHEME -o DIR/c.md",
        "simulate --scheme SCHEME -o DIR/simulated",
        "crosscheck --scheme SCHEME --runs 2 -o DIR/checked",
        "design --positions 2 --observable D_FX --dwell 100 -o DIR/designed",
        "report SCHEME --runs 2 -o DIR/review.html",
        "report SCHEME --runs 2 -o DIR/written/review.md",
    ] {
        let command = command.replace("SCHEME", &scheme.path().display().to_string()).replace("DIR", &at(""));
        fs::create_dir_all(at("written")).expect("made");
        let output = shell(&format!("umask 027; exec \"$0\" {command} -q > /dev/null"));
        let failed = output.status.code().is_none_or(|code| code > 1);
        assert!(!failed, "{command}: {}", stderr(&output));
    }
    fs::set_permissions(at("written"), fs::Permissions::from_mode(0o750)).expect("set");
    let all = below(folder.path());
    assert!(all.len() > 60, "{all:?}");
    for path in all {
        let mode = fs::metadata(&path).expect("there").mode() & 0o777;
        assert_eq!(mode, if path.is_dir() { 0o750 } else { 0o640 }, "{}", path.display());
    }
    // a replaced file keeps its permissions
    let private = at("p.txt");
    fs::set_permissions(&private, fs::Permissions::from_mode(0o600)).expect("set");
    assert!(run(&["paper", "-o", &private, "--force"]).status.success());
    assert_eq!(fs::metadata(&private).expect("there").mode() & 0o777, 0o600);
}

/// Devices, pipes and folders are not replaced, not even with --force. A link to a file is followed.
#[test]
fn only_files_are_replaced() {
    let (_folder, at) = folder();
    assert!(Command::new("mkfifo").arg(at("pipe")).status().expect("mkfifo").success());
    symlink("/dev/full", at("device")).expect("made");
    symlink(at("pipe"), at("to-pipe")).expect("made");
    symlink(at("nowhere"), at("dangling")).expect("made");
    fs::create_dir(at("folder")).expect("made");
    for (name, kind) in [
        ("pipe", "a pipe"),
        ("device", "a device"),
        ("to-pipe", "a pipe"),
        ("dangling", "a symbolic link to nothing"),
        ("folder", "a folder"),
    ] {
        for force in [&[][..], &["--force"]] {
            let output = run(&[&["paper", "-o", &at(name)], force].concat());
            assert_eq!(output.status.code(), Some(2), "{name}");
            let expected = format!("it is {kind}; expected a file");
            assert!(stderr(&output).contains(&expected), "{}", stderr(&output));
        }
    }
    assert!(fs::symlink_metadata(at("pipe")).expect("there").file_type().is_fifo());
    for link in ["device", "to-pipe", "dangling"] {
        assert!(fs::symlink_metadata(at(link)).expect("there").is_symlink());
    }
    assert!(!Path::new(&at("nowhere")).exists());
    // a folder of results does not replace a folder either
    fs::create_dir_all(at("run/summary.json")).expect("made");
    let scheme = at("scheme.toml");
    let output = run(&["simulate", "--scheme", &scheme, "-q", "-o", &at("run"), "--force"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(fs::read_dir(at("run")).expect("a folder").count(), 1);

    fs::create_dir(at("elsewhere")).expect("made");
    fs::write(at("elsewhere/file"), "old").expect("written");
    symlink(at("elsewhere/file"), at("link")).expect("made");
    assert_eq!(run(&["paper", "-o", &at("link")]).status.code(), Some(2), "it exists");
    assert!(run(&["paper", "-o", &at("link"), "--force"]).status.success());
    assert!(fs::symlink_metadata(at("link")).expect("there").is_symlink());
    assert!(fs::read_to_string(at("elsewhere/file")).expect("readable").contains("disagree"));
    assert_eq!(fs::read_dir(at("elsewhere")).expect("a folder").count(), 1);
}

/// Pipes and devices are read up to the size limit of files. A pipe without a writer does not block.
#[test]
fn input_from_anywhere_is_limited() {
    let (_folder, at) = folder();
    assert!(Command::new("mkfifo").arg(at("pipe")).status().expect("mkfifo").success());
    for (file, reason) in [
        (at("pipe").as_str(), "nothing comes out of it"),
        ("/dev/null", "nothing comes out of it"),
        ("/dev/zero", "has more than 50000000 bytes; expected at most 50000000"),
        (&at(""), "is a folder; expected a "),
    ] {
        for command in [
            &["analyze", "--scheme"][..],
            &["analyze", "--model"],
            &["compare"],
            &["report", "-o", &at("r.md")],
        ] {
            let output = run(&[command, &[file]].concat());
            assert_eq!(output.status.code(), Some(2), "{command:?} {file}");
            assert!(stderr(&output).contains(reason), "{command:?} {file}: {}", stderr(&output));
        }
    }
    let file = run(&["analyze", "--scheme", &at("scheme.toml"), "--solutions", "off"]);
    assert!(file.status.success());
    for script in [
        "cat SCHEME | \"$0\" analyze --solutions off --scheme /dev/stdin",
        "cat SCHEME | \"$0\" analyze --solutions off --scheme /dev/fd/0",
        "(cat SCHEME > PIPE &) ; \"$0\" analyze --solutions off --scheme /dev/fd/3 3< PIPE",
        "\"$0\" analyze --solutions off --scheme /dev/stdin < SCHEME",
    ] {
        let output = shell(&script.replace("SCHEME", &at("scheme.toml")).replace("PIPE", &at("pipe")));
        assert_eq!(output.stdout, file.stdout, "{script}: {}", stderr(&output));
    }
    // a report reads its input once
    let script =
        format!("cat {} | \"$0\" report -q --runs 2 -o {} /dev/stdin", at("scheme.toml"), at("review.html"));
    let output = shell(&script);
    assert!(output.status.success(), "{}", stderr(&output));
}

/// The content decides whether a file is a scheme or a model: JSON from a pipe has no extension, and an
/// extension may be wrong.
#[test]
fn a_file_is_what_it_says() {
    let (_folder, at) = folder();
    let json = r#"{"name": "m", "states": ["x"], "equations": {"x": "-x"}, "outputs": {"y": "x"}}"#;
    let toml = "name = \"m\"\n[states]\nx = \"-x\"\n[outputs]\ny = \"x\"\n";
    for (name, text) in [("m.json", json), ("m", json), ("toml.json", toml), ("s.json", SCHEME)] {
        fs::write(at(name), text).expect("written");
    }
    let analyzed = |option: &str, name: &str| {
        let output = run(&["analyze", "--solutions", "off", option, &at(name)]);
        assert!(output.status.success(), "{option} {name}: {}", stderr(&output));
        output.stdout
    };
    let model = analyzed("--model", "m.json");
    assert_eq!(analyzed("--model", "m"), model);
    assert_eq!(analyzed("--model", "toml.json"), model);
    assert_eq!(analyzed("--scheme", "s.json"), analyzed("--scheme", "scheme.toml"));
    let piped = shell(&format!("cat {} | \"$0\" analyze --solutions off --model /dev/stdin", at("m.json")));
    assert_eq!(piped.stdout, model, "{}", stderr(&piped));
    let written = |name: &str| {
        let review = at(&format!("{name}.md"));
        let script = format!("cat {} | \"$0\" report -q --runs 2 -o {review} /dev/stdin", at(name));
        let output = shell(&script);
        assert!(output.status.success(), "{name}: {}", stderr(&output));
        let given = run(&["report", &at(name), "-q", "--runs", "2", "-o", &review, "--force"]);
        assert!(given.status.success(), "{name}: {}", stderr(&given));
        fs::read_to_string(review).expect("written")
    };
    assert!(written("m.json").contains("x' = -x"));
    assert!(written("s.json").contains("2 positions"));
    let other = run(&["analyze", "--model", &at("s.json")]);
    assert!(stderr(&other).contains("is a scheme file; expected a model file"), "{}", stderr(&other));
}

/// An interrupted command prints no evidence, writes no file and ends with the exit code of an interrupt.
#[test]
fn an_interrupt_ends_with_its_code() {
    let (folder, at) = folder();
    let scheme = at("scheme.toml");
    for arguments in [
        &["crosscheck", "--scheme", &scheme, "--runs", "10000000", "-o", &at("evidence")][..],
        &["report", &scheme, "--runs", "10000000", "-o", &at("review.html")],
    ] {
        let child =
            obsdeg(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
        // at any point of its work
        std::thread::sleep(std::time::Duration::from_millis(700));
        let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
        assert!(sent.success());
        let output = child.wait_with_output().expect("it ends");
        // exit code 130, or the signal itself before the program handles it
        let code = output.status.code().or(output.status.signal().map(|s| 128 + s));
        assert_eq!(
            (code, output.stdout.as_slice()),
            (Some(130), &[][..]),
            "{arguments:?}: {}",
            stderr(&output)
        );
    }
    assert_eq!(below(folder.path()).len(), 1);
}

/// Model of one state, with figures that are drawn quickly.
const SMALL: &str = "name = 'm'\n[states]\nx = '-x'\n[outputs]\ny = 'x'\n[simulation]\nduration = 5\nstep = 0.5\n\
                     values = { x = 1 }\npriors = { x = 0.5 }\nnoise = { y = 0.1 }\n";

/// Runs that are interrupted at random times leave the previous state or the complete folder, and no other
/// file. One run in ten draws the figures of a scheme, the others those of a small model.
#[expect(clippy::print_stderr, reason = "what was measured")]
fn interruptions_leave_nothing(count: u64) {
    let (_folder, at) = folder();
    let inputs = [["--scheme", &at("scheme.toml")], ["--model", &at("small.toml")]];
    fs::write(at("small.toml"), SMALL).expect("written");
    let command = |input: [&str; 2], to: &str| {
        obsdeg(&["simulate", input[0], input[1], "-q", "-o", &at(to), "--seed", "1"])
    };
    let whole = inputs.map(|input| {
        let begun = std::time::Instant::now();
        let to = format!("whole{}", input[0]);
        assert!(command(input, &to).output().expect("it runs").status.success());
        (begun.elapsed(), to)
    });
    let names_in = |folder: &str| -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
    };
    let mut random = obsdeg_exact::SplitMix64::new(37);
    let mut interrupted = 0;
    for i in 0..count {
        let kind = usize::from(i % 10 > 0);
        let to = format!("run-{i}");
        let mut child = command(inputs[kind], &to)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        // in most runs while files are written
        let part = 0.5 + 0.6 * random.below(1000) as f64 / 1000.0;
        std::thread::sleep(whole[kind].0.mul_f64(part));
        // Ctrl-C, and the signals for the end of a program and for a closed terminal
        let signal = ["-INT", "-TERM", "-HUP"][i as usize % 3];
        Command::new("kill").args([signal, &child.id().to_string()]).output().expect("kill");
        interrupted += u64::from(!child.wait().expect("it ends").success());
        let names = names_in(&at(""));
        let hidden: Vec<&String> = names.iter().filter(|name| name.starts_with('.')).collect();
        assert!(hidden.is_empty(), "{i}: {hidden:?}");
        // an existing folder is complete
        if names.contains(&to) {
            let files = [&to, &whole[kind].1].map(|name| names_in(&at(name)).len());
            assert_eq!(files[0], files[1], "{i}");
        }
    }
    eprintln!("{interrupted} of {count} interrupted");
    assert!(interrupted > 0);
}

#[test]
fn interruptions_leave_no_litter() {
    interruptions_leave_nothing(8);
}

#[test]
#[ignore = "full length, for `.ci/run release`"]
fn three_hundred_interruptions_leave_no_litter() {
    interruptions_leave_nothing(300);
}

/// A limit on the size of files (SIGXFSZ) leads to a message and leaves no file.
#[test]
fn a_limit_on_files_leaves_no_litter() {
    let (folder, at) = folder();
    for (blocks, command) in [
        (0, "analyze --scheme SCHEME --solutions off -o DIR/a.json"),
        (1, "analyze --scheme SCHEME --solutions off -o DIR/b.json --format json"),
        (8, "simulate --scheme SCHEME -o DIR/simulated"),
        (16, "report SCHEME --runs 2 -o DIR/review.html"),
    ] {
        let command = command.replace("SCHEME", &at("scheme.toml")).replace("DIR", &at(""));
        let output = shell(&format!("ulimit -f {blocks}; exec \"$0\" {command} -q 2>&1 | cat >&2"));
        let said = stderr(&output);
        assert!(said.contains("the system allows") && said.contains("ulimit -f"), "{command}: {said}");
        assert_eq!(below(folder.path()).len(), 1, "{command}");
    }
}

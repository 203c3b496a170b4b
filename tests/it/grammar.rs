//! Random command lines from the grammar of the program: each succeeds, is refused as bad input or fails a
//! check. None reveals a defect.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::sync::OnceLock;

use obsdeg_exact::SplitMix64;

use crate::program::{obsdeg, run, stdout};

/// Number of random command lines per command.
const DRAWN: usize = 16;

const SCHEME: &str = "name = 's'\ncarry = 'platform'\ncombinations = ['D_IX - D_IY']\n[simulation]\nstep_s = 50\n\
                      [requirements]\nD_F = 0.1\n\
    [[position]]\nname = 'p1'\nangles_deg = [0, 0, 0]\ndwell_s = 300\n[[position]]\nname = 'p2'\n\
    angles_deg = [180, 0, 90]\n";
const TURNING: &str = "name = 't'\nlatitude_deg = 45\n[[position]]\nangles_deg = [10, 20, 30]\n\
                       rotation = { about = 'X_p', angle_deg = 90 }\n\
    [[position]]\nangles_deg = [0, 40, 0]\n";
const MODEL: &str = "name = 'm'\n[states]\nx = '-k*x'\n[parameters]\nk = {}\n[outputs]\ny = 'x'\n[simulation]\n\
                     duration = 10\nstep = 0.5\n\
    values = { x = 1, k = 0.5 }\npriors = { x = 0.1, k = 0.1 }\nnoise = { y = 0.01 }\n";

/// Values of an option: plausible ones first, then extreme and invalid ones; `None` for a flag.
fn values(option: &str) -> Option<&'static [&'static str]> {
    let number: &[&str] =
        &["1", "0.5", "30", "0", "-5", "1e-300", "1e200", "nan", "inf", "1e-6", "1e6", "x", "0,5"];
    Some(match option {
        "angles" => &[
            "0,0,0",
            "180,0,0",
            "NUE",
            "SEU",
            "NUE@X_p:360",
            "30,40,50@Z_n:-90",
            "10,-20,30@Y_p:1e-9",
            "0,90,45",
            "beta,0,0",
            "360,-360,0",
            "1e-9,0,0",
            "0 0 0",
            "nue",
            "0,0",
            "1e300,0,0",
        ],
        "scheme" => &["s.toml", "t.toml", "m.toml", "none.toml", ".", "/dev/null"],
        "model" => &["m.toml", "s.toml", "none.json", "."],
        "carry" => &["inertial", "platform", "reset", "none"],
        "latitude" => &["28.2", "0", "90", "-90", "-60", "45.000000001", "91", "x"],
        "terms" => &[
            "F",
            "F,I,O,S",
            "drift",
            "I,II",
            "F,I,O,S,II,OO,SS,IO,IS,OS",
            "accelerometers",
            "all",
            "F,GS,GM,K0,K3,Kx",
            "GM,GM3",
            "F,F",
            "Q",
            "",
        ],
        "axes" => &["accelerometers", "gyros", "body", "x"],
        "path" => &["one-axis", "gimbals", "x"],
        "max-turn" => &["90", "180", "0.001", "0", "x"],
        "why" => &["D_FX", "psi_y", "x", "nothing", ""],
        "next" => &["1", "2", "3", "x"],
        "combination" => &[
            "D_IX - D_IY",
            "psi_y + D_FX",
            "D_FX",
            "sqrt(2)*D_FX - D_FY",
            "1/0*D_FX",
            "D_FX*D_FY",
            "0*D_FX",
            "((",
            "D_FX + 1",
        ],
        "table" => &["quantities", "answer", "x"],
        "order" => &["0", "1", "5", "40", "-1", "x"],
        "count-limit" => &["0", "1", "18446744073709551615", "-1"],
        "work-limit" => &["1", "700", "0", "1000000001", "x"],
        "check" => &["0", "1", "-1", "x"],
        "solutions" | "omitted" => &["off", "maybe"],
        "relation-limit" => &["0", "1", "-1", "x"],
        "frame" => &["n", "p", "q"],
        "seed" => &["0", "1", "18446744073709551615", "18446744073709551616", "-1"],
        "symbolic-limit" => &["0", "1", "1000", "18446744073709551615", "-1"],
        "engine-wait" => &["0", "1", "86401", "-1", "x"],
        "format" => &["table", "json", "markdown", "csv", "latex", "html", "pdf", "xml"],
        "dwell" => &["100", "300", "0.001", "1e6", "0", "-5", "nan", "inf", "1e300", "1e-300"],
        "step" => &[
            "50",
            "100",
            "20",
            "1e-6",
            "1e6",
            "10",
            "1.0842021724855044e-16",
            "0",
            "-1",
            "inf",
            "nan",
            "1e300",
        ],
        "noise" => &["1e-5", "1e-15", "1", "1e-30", "1e-160", "1e155", "0", "-1", "nan"],
        "azimuth-noise" => &["0.001", "1e-12", "1e200", "0", "nan"],
        "requirement" => &["D_F=0.1", "psi=1e-9", "D_FX=1e-300", "D=-0.1", "D_QX=1", "D_F", "=1", "D_F=nan"],
        "truth" => &["linear", "exact", "other"],
        "filter" => &["linear", "extended", "iterated", "other"],
        "slew-rate" => &["0.5", "10", "1e-6", "1e300", "0", "-1", "nan"],
        "drift-noise" => {
            &["0.01 deg/h", "0.001 deg/sqrt(h)", "1e200 deg/h", "0 deg/h", "0.01", "1e-300 deg/h", "x deg/h"]
        }
        "angle-random-walk" | "rate-random-walk" | "bias-instability" => {
            &["0.001", "0.01,0,0.02", "0", "1,2", "1e-300", "-1", "x"]
        }
        "accelerometer-instability" => &["5", "1e-9", "1e9", "1e-300", "0", "-1", "nan"],
        "correlation-time" | "accelerometer-correlation-time" => &["600", "1e9", "1", "0", "nan"],
        "propagation" => &["exponential", "rk4", "euler"],
        "value" | "estimate" => {
            &["D_FX=11", "psi=0.1", "D=1e200", "D=1e-300", "psi=-1e6", "D_F=nan", "D_QX=1"]
        }
        "prior" => &["D=1", "psi=1e-12", "D=1e-300", "D=1e200", "psi=1e8", "D_F=0", "D_F=-1"],
        "bench" => &["K0=20", "K0_X=3,latitude=10", "azimuth=0", "K0=-1", "Q=1", "x"],
        "immune" => &["K0", "K0=20", "M_XY=5,K0_X=3", "latitude", "K0=0", "Q=1", "psi"],
        "drift-scale" => &["1", "1e-6", "1e6", "1e-300", "0", "nan"],
        "runs" => &["3", "2", "1", "0", "-1", "1e3"],
        "filter-carry" => &["inertial", "reset", "x"],
        "filter-latitude" => &["30", "90", "100", "x"],
        "filter-drop" => &["p1", "p2", "p9", ""],
        "positions" => &["5", "4", "3", "6", "2", "1", "0", "101", "x"],
        "candidates" => &[
            "cardinal",
            "s.toml",
            "t.toml",
            "grid:90",
            "free",
            "grid:0",
            "grid:7",
            "grid:1e-9",
            "grid:1",
            "none.toml",
            "x",
        ],
        "measure" => {
            &["states", "x", "x, k", "x + k", "outputs", "parameters", "inputs", "candidates", "x +", "q", ""]
        }
        "cost" => &["x=2", "k=0.5", "x=0", "q=1", "x=nan", "x"],
        "keep" => &["1", "3", "0", "-1", "18446744073709551615"],
        "restarts" => &["2", "1", "0", "-1"],
        "round" => &["5", "0", "x"],
        "starts" => &["2", "1", "0", "x"],
        "profile" => &["x", "D_FX", ""],
        "calibration" => &["c.json", "none.json", "s.toml", "out", ""],
        "gravity" => &["9.81744", "9.80665", "9", "10.5", "1", "nan"],
        "column" => &["wx", "fx", "t", ""],
        "confidence" => &["0.95", "0.683", "0.5", "0", "1", "nan"],
        "gate" => &["0.999", "1", "0.5", "0", "2", "nan"],
        "within" => &["0.01", "0", "x"],
        "front" => &["1", "3", "0", "2:4", "1,2", "x"],
        "observable" => &["D_F,D_O,D_S", "D_F", "D_FX", "psi", "D_Q", ""],
        "max-degree" => &["1", "2", "D_F=1", "D_Q=1", "0", "-1"],
        "criterion" => &["worst", "a", "d", "e", "margin", "x"],
        "max-time" => &["1e4", "300", "10", "0", "nan", "1e300"],
        "max-slew" => &["90", "200", "0", "-1", "nan"],
        "gimbal" => &[
            "alpha=-180:180",
            "beta=-80:80",
            "gamma=10:10",
            "alpha=5:-5",
            "delta=0:1",
            "beta=nan:1",
            "beta=-1e300:1e300",
        ],
        "figures" => &["pictures", ".", "s.toml"],
        "certificate" | "reduced" => &["new.json", "s.toml", ".", ""],
        "output" => &["o.html", "o.md", "out/x/y", "o.tex", "out", "out/x/y", ".", "s.toml", "/dev/full", ""],
        "measured-azimuth" | "formulas" | "sensitivities" | "minimum" | "refine" | "divide" | "meet"
        | "require-met" | "force" | "quiet" | "help" | "estimate-noise" | "own-outputs" | "unique"
        | "details" | "dry-run" | "ascii" | "texts" => {
            return None;
        }
        _ => number,
    })
}

/// Options of a design that concern models.
const OF_MODELS: [&str; 10] = [
    "cost",
    "own-outputs",
    "unique",
    "order",
    "work-limit",
    "keep",
    "observable",
    "max-degree",
    "seed",
    "format",
];

/// Arguments without an option name.
fn operands(command: &str) -> &'static [&'static str] {
    match command {
        "analyze" | "simulate" | "crosscheck" | "procedure" => &["s.toml", "m.toml", "none.toml"],
        "compare" | "report" => &["s.toml", "t.toml", "m.toml", "none.toml"],
        "calibrate" => &["s.toml"],
        "allan" => &["n.csv", "n.csv", "r.csv", "none.csv"],
        "verify" => &["v.json", "s.toml", "none.json"],
        "schema" => &["analysis", "scheme", "model", "comparison", "design", "sensors", "nothing"],
        "completions" => &["bash", "zsh", "nothing"],
        "licences" => &["uPlot", "nalgebra", "nothing"],
        _ => &[],
    }
}

fn done(folder: &Path, arguments: &[String]) -> (Option<i32>, String) {
    let output =
        obsdeg(&[]).current_dir(folder).args(arguments).stdout(Stdio::null()).output().expect("it runs");
    (output.status.code(), String::from_utf8(output.stderr).expect("UTF-8"))
}

/// Long options of a command as its help lists them; true if the option takes a value.
fn options(command: &str) -> BTreeMap<String, bool> {
    let help = stdout(&run(&[command, "--help"]));
    let line = |l: &str| {
        // continued texts are indented further, or not at all
        let indent = l.len() - l.trim_start().len();
        let l = l.trim_start();
        if !(1..8).contains(&indent) {
            return None;
        }
        let l = if l.starts_with("--") { l } else { l.strip_prefix('-')?.get(3..)? };
        let mut words = l.strip_prefix("--")?.split_whitespace();
        Some((words.next()?.to_string(), words.next().is_some_and(|w| w.starts_with('<'))))
    };
    help.lines().filter_map(line).collect()
}

#[test]
#[ignore = "seconds: .ci/run"]
fn no_command_line_of_the_grammar_meets_a_defect() {
    let commands = [
        "analyze",
        "simulate",
        "crosscheck",
        "calibrate",
        "compare",
        "design",
        "report",
        "paper",
        "verify",
        "schema",
        "completions",
        "licences",
        "man",
        "allan",
        "procedure",
    ];
    let codes = std::thread::scope(|scope| {
        let draw = |(i, command)| scope.spawn(move || draws(i as u64, command));
        let threads: Vec<_> = commands.into_iter().enumerate().map(draw).collect();
        threads.into_iter().map(|t| t.join().expect("no defect")).collect::<Vec<_>>()
    });
    // of every command some lines succeed and some are refused
    assert!(codes.iter().all(|of| of.get(&0).is_some_and(|n| *n > 1)), "{codes:?}");
    assert!(codes.iter().any(|of| of.contains_key(&2)), "{codes:?}");
}

/// Creates a folder with the files of the command lines.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let record = record();
    for (name, text) in
        [("s.toml", SCHEME), ("t.toml", TURNING), ("m.toml", MODEL), ("r.csv", &record), ("n.csv", &noise())]
    {
        fs::write(folder.path().join(name), text).expect("written");
    }
    fs::write(folder.path().join("v.json"), certificate()).expect("written");
    folder
}

/// Record of a gyro and an accelerometer at rest, with uniformly distributed noise.
fn noise() -> String {
    let mut rng = SplitMix64::new(3);
    let mut next = || (rng.below(1 << 20) as f64) / f64::from(1 << 20) - 0.5;
    let line = |k: u32| format!("{k},{},{}\n", next(), 1.0 + 1e-4 * next());
    let lines: String = (0..2000).map(line).collect();
    format!("t [s],wx [deg/h],fx [g]\n{lines}")
}

/// Certificate of a scheme with two positions.
fn certificate() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("v.json");
        let mut asked =
            obsdeg(&["analyze", "--angles", "NUE", "--angles", "NDW", "--solutions", "off", "--certificate"]);
        assert!(asked.arg(&path).stdout(Stdio::null()).status().expect("it runs").success());
        fs::read_to_string(path).expect("a certificate")
    })
}

/// Record of s.toml with noise as the only error.
fn record() -> String {
    let mut rng = SplitMix64::new(5);
    // approximately normal: sum of twelve uniform numbers
    let mut noise =
        || (0..12).map(|_| (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64).sum::<f64>() - 6.0;
    let mut line = |t: usize| {
        let position = if t <= 300 { "p1" } else { "p2" };
        format!("{t},{position},{:e},{:e}\n", 1e-5 * noise(), 1e-5 * noise())
    };
    let lines: String = (1..=130).map(|k| line(10 * k)).collect();
    format!("t [s],position,Z1 [g],Z3 [g]\n{lines}")
}

/// With a model, an option either concerns models or is refused; no option is ignored.
#[test]
fn a_model_refuses_what_is_about_schemes() {
    const TAKEN: [&str; 17] = [
        "ascii",
        "certificate",
        "count-limit",
        "engine-wait",
        "force",
        "format",
        "order",
        "output",
        "quiet",
        "reduced",
        "relation-limit",
        "seed",
        "solutions",
        "symbolic-limit",
        "table",
        "why",
        "work-limit",
    ];
    let folder = folder();
    for command in ["analyze", "simulate", "crosscheck"] {
        let mut taken = Vec::new();
        let listed = options(command);
        for name in listed.keys().filter(|name| !["help", "model"].contains(&name.as_str())) {
            let value = values(name).map(|from| from[0].to_string());
            let line = [command, "--model", "m.toml"].map(Into::into).into_iter();
            let line: Vec<String> = line.chain([format!("--{name}")]).chain(value).collect();
            let (code, stderr) = done(folder.path(), &line);
            match ["is about schemes", "cannot be used with", "were not provided"]
                .iter()
                .any(|w| stderr.contains(w))
            {
                true => assert_eq!(code, Some(2), "{line:?}"),
                false => taken.push(name.as_str()),
            }
        }
        let own = TAKEN.iter().filter(|name| listed.contains_key(**name));
        assert!(own.eq(&taken), "{command}: {taken:?}");
    }
}

/// Number of command lines of one command by exit code.
fn draws(stream: u64, command: &str) -> BTreeMap<i32, usize> {
    let mut rng = SplitMix64::new(0x6772_616d ^ stream << 40);
    let options = options(command);
    let fair = ["man", "schema", "completions", "licences", "verify"].contains(&command);
    assert!(fair || options.len() > 3, "{command}: {options:?}");
    let mut codes = BTreeMap::new();
    // most lines of `design` are refused
    let drawn = if command == "design" { 2 * DRAWN } else { DRAWN };
    for _ in 0..if fair { 4 } else { drawn } {
        let folder = folder();
        let arguments = line(command, &options, &mut rng);
        let (code, stderr) = done(folder.path(), &arguments);
        let code = code.unwrap_or(-1);
        assert!((0..3).contains(&code), "obsdeg {arguments:?}: {code}\n{stderr}");
        assert!(!stderr.contains("panicked"), "obsdeg {arguments:?}: {stderr}");
        *codes.entry(code).or_insert(0) += 1;
    }
    codes
}

/// Random element of a list, mostly from its first third, which holds plausible values.
fn pick(rng: &mut SplitMix64, from: &[&str]) -> String {
    let n = if rng.below(15) == 0 { from.len() } else { from.len().div_ceil(3) };
    from[rng.below(n as u64) as usize].to_string()
}

/// Random command line: the required options of the command, then some others.
fn line(command: &str, options: &BTreeMap<String, bool>, rng: &mut SplitMix64) -> Vec<String> {
    let mut out = vec![command.to_string()];
    // one `design` in four selects outputs of a model
    let of_model = command == "design" && rng.below(4) == 0;
    let of_next = command == "design" && rng.below(6) == 0;
    let always: &[&str] = match command {
        "design" if of_model => &["measure"],
        "design" if of_next => &["next", "step"],
        "design" => &["positions", "restarts", "step"],
        "report" => &["output", "runs"],
        _ => &[],
    };
    // parts need files of their own
    let left_out = |name: &&str| {
        let schemes = of_model && !OF_MODELS.contains(name);
        ["help", "part", "merge"].contains(name) || always.contains(name) || schemes
    };
    let some = options.keys().map(String::as_str).filter(|name| !left_out(name));
    // the expected number of options does not grow with their list
    let one_of = (options.len() as u64 / 3).max(10);
    let some: Vec<&str> = some.filter(|_| rng.below(one_of) == 0).collect();
    for name in always.iter().copied().chain(some) {
        let value = values(name).map(|from| pick(rng, from));
        assert_eq!(value.is_some(), options[name], "--{name} of {command}");
        out.push(format!("--{name}"));
        out.extend(value);
    }
    let several = if ["compare", "report"].contains(&command) { 2 } else { 1 };
    let operands = operands(command);
    out.extend((0..several.min(operands.len())).map(|_| pick(rng, operands)));
    if of_model {
        out.push(pick(rng, &["m.toml", "m.toml", "s.toml"]));
    }
    if of_next && !of_model {
        out.push(pick(rng, &["s.toml", "t.toml", "m.toml"]));
    }
    if command == "calibrate" {
        out.push(pick(rng, &["r.csv", "-", "none.csv"]));
    }
    out
}

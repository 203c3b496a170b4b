//! Small random models: each needs at most 10 s of processor time and 1 GB of memory, or the answer refuses
//! it and says why. A debug build has twice the time.

use std::io::Write;
use std::process::Command;

use obsdeg_exact::SplitMix64;

/// Number of models in everyday runs; `.ci/run release` judges ten thousand.
const DAILY: u64 = 12;
const RELEASE: u64 = 10_000;
/// Limit of processor time, in s.
const SECONDS: u64 = if cfg!(debug_assertions) { 20 } else { 10 };
/// Limit of address space, in KiB: 1 GB plus that of an idle process.
const KIB: u64 = 1_500_000;

/// Random element of a list of texts.
fn one<'a>(random: &mut SplitMix64, of: &[&'a str]) -> &'a str {
    of[random.below(of.len() as u64) as usize]
}

fn chance(random: &mut SplitMix64, percent: u64) -> bool {
    random.below(100) < percent
}

/// Random expression in some names.
fn expression(random: &mut SplitMix64, names: &[String], depth: u64) -> String {
    let kind = random.below(12);
    if depth == 0 || kind < 3 {
        return match random.below(10) {
            0 => "t".into(),
            1..=3 => one(random, &["1", "2", "3", "10", "1000", "0.1", "1e9"]).into(),
            _ => names[random.below(names.len() as u64) as usize].clone(),
        };
    }
    let [a, b] = [0, 1].map(|_| expression(random, names, depth - 1));
    match kind {
        3 | 4 => format!("({a} + {b})"),
        5..=7 => format!("{a}*{b}"),
        8 => format!("({a})/({b} + 1)"),
        9 => format!("({a})^{}", one(random, &["2", "3", "5", "20", "100", "1000"])),
        10 => format!("{}({a})", one(random, &["sin", "exp", "sqrt", "tanh", "log", "abs"])),
        _ => format!("({a} - {b})"),
    }
}

/// Random model with a vector or a matrix.
fn of_vectors(random: &mut SplitMix64) -> String {
    let n = one(random, &["2", "3", "4", "5"]);
    let (shape, entry, rate) = match chance(random, 60) {
        true => {
            let rates = ["A*A", "A*transpose(A)", "inverse(A)", "A*A*A", "-A", "det(A)*A"];
            (format!("{n},{n}"), "1,1", one(random, &rates))
        }
        false => (n.to_string(), "1", one(random, &["-A", "A*norm(A)", "dot(A,A)*A", "p*A"])),
    };
    format!("[states]\n\"A[{shape}]\" = \"{rate}\"\n[parameters]\np = {{}}\n[outputs]\ny = \"A[{entry}]\"\n")
}

/// Random small model.
fn model(random: &mut SplitMix64) -> String {
    let mut out = String::from("name = \"m\"\n");
    if chance(random, 15) {
        out += &format!("experiments = {}\n", one(random, &["2", "5", "20"]));
    }
    if chance(random, 20) {
        out += &of_vectors(random);
        return out;
    }
    let states: Vec<String> = (0..=random.below(5)).map(|i| format!("x{i}")).collect();
    let parameters: Vec<String> = (0..random.below(6)).map(|i| format!("p{i}")).collect();
    let input = one(random, &["", "", "known_inputs", "unknown_inputs"]);
    let mut names = [states.clone(), parameters.clone()].concat();
    names.extend((!input.is_empty()).then(|| "u".to_string()));
    let depth = 1 + random.below(5);
    out += "[states]\n";
    for state in &states {
        out += &format!("{state} = \"{}\"\n", expression(random, &names, depth));
    }
    if !parameters.is_empty() {
        out += "[parameters]\n";
        parameters.iter().for_each(|p| out += &format!("{p} = {{}}\n"));
    }
    if !input.is_empty() {
        out += &format!("[{input}]\nu = {{}}\n");
    }
    out += "[outputs]\n";
    for i in 0..=random.below(2) {
        let depth = random.below(3);
        out += &format!("y{i} = \"{}\"\n", expression(random, &names, depth));
    }
    out
}

/// Outcome of a model: true if judged, false if refused with a sentence; otherwise an error.
fn ended(text: &str) -> Result<bool, String> {
    let mut file = tempfile::NamedTempFile::new().expect("a file");
    file.write_all(text.as_bytes()).expect("written");
    let limits = format!("ulimit -t {SECONDS}; ulimit -v {KIB}; exec \"$0\" analyze --model \"$1\"");
    let done = Command::new("sh")
        .args(["-c", &limits, env!("CARGO_BIN_EXE_obsdeg")])
        .arg(file.path())
        .output()
        .expect("a shell");
    let stderr = String::from_utf8_lossy(&done.stderr);
    match done.status.code() {
        Some(0) if !done.stdout.is_empty() => Ok(true),
        Some(2) if stderr.starts_with("error: ") => Ok(false),
        _ => Err(format!("{:?}: {stderr}", done.status)),
    }
}

#[expect(clippy::print_stderr, reason = "what was measured")]
fn all_end(seeds: std::ops::Range<u64>) {
    let (mut judged, mut wrong) = (0, Vec::new());
    let count = seeds.end - seeds.start;
    for seed in seeds {
        let text = model(&mut SplitMix64::of(seed, "small models", &["any"]));
        match ended(&text) {
            Ok(answered) => judged += u64::from(answered),
            Err(why) => wrong.push(format!("seed {seed}: {why}\n{text}")),
        }
    }
    eprintln!("{judged} of {count} models judged, {} neither judged nor refused", wrong.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(judged > count / 4, "{judged}");
}

#[test]
fn small_models_end() {
    all_end(0..DAILY);
}

#[test]
#[ignore = "ten thousand models, for `.ci/run release`"]
fn ten_thousand_small_models_end() {
    all_end(0..RELEASE);
}

/// Model of one square matrix with its entry (1,1) as output.
fn of_a_square(n: usize) -> String {
    format!("name = \"m\"\n[states]\n\"A[{n},{n}]\" = \"A*A\"\n[outputs]\ny = \"A[1,1]\"\n")
}

/// JSON answer of `analyze` within the limits of processor time and memory, or its error.
fn answered(text: &str, options: &[&str]) -> Result<serde_json::Value, String> {
    let mut file = tempfile::NamedTempFile::new().expect("a file");
    file.write_all(text.as_bytes()).expect("written");
    let limits = format!(
        "ulimit -t {SECONDS}; ulimit -v {KIB}; exec \"$0\" analyze --format json \"$@\" --model \"$FILE\""
    );
    let done = Command::new("sh")
        .args(["-c", &limits, env!("CARGO_BIN_EXE_obsdeg")])
        .args(options)
        .env("FILE", file.path())
        .output()
        .expect("a shell");
    match done.status.code() {
        Some(0) => Ok(serde_json::from_slice(&done.stdout).expect("JSON")),
        Some(2) => Err(String::from_utf8_lossy(&done.stderr).into_owned()),
        _ => panic!("{:?}: {}", done.status, String::from_utf8_lossy(&done.stderr)),
    }
}

/// Matrices: the output is a generating function of its first row and column in powers of the start, `A(t) =
/// A0 (1 - t A0)^-1`. So it contains the moments `(A0^k)[1,1]`, k = 1, 2, ... These are the moments of a
/// strictly proper transfer function of order n with a first moment of one: 2n - 1 numbers are free, and as
/// many orders show them.
#[test]
fn matrices_are_judged_within_the_limits() {
    squares(&[3, 5]);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn large_matrices_are_judged_within_the_limits() {
    squares(&[8, 10]);
}

fn squares(sizes: &[usize]) {
    for &n in sizes {
        let answer = answered(&of_a_square(n), &["--solutions", "off"]).expect("judged");
        assert_eq!(answer["rank"], 2 * n - 1, "{n}");
        let profile: Vec<usize> = serde_json::from_value(answer["rank_profile"].clone()).expect("a profile");
        assert!(profile.iter().take(2 * n - 1).copied().eq(1..2 * n), "{n}: {profile:?}");
    }
}

/// Matrices beyond a limit are refused at once. The message names the exceeded limit and the option that
/// raises it.
#[test]
fn matrices_beyond_the_limits_are_refused() {
    let chain = "name = \"m\"\n[states]\n\"A[10,10]\" = \"A*B\"\n\"B[10,10]\" = \"B*C\"\n\"C[10,10]\" = \"C*A\"\n\
                 [outputs]\ny = \"A[1,1]\"\n";
    for (text, limit, expected) in [
        (of_a_square(16), "100", "derivatives of order"),
        (of_a_square(32), "600", "gradients of its operations take 5.3e8 bytes"),
        (chain.into(), "600", "derivatives of order"),
    ] {
        let error = answered(&text, &["--work-limit", limit]).expect_err(expected);
        assert!(error.contains(expected), "{expected}: {error}");
        let option = format!("beyond --work-limit {limit} ");
        assert!(error.contains(&option) && error.contains("a larger --work-limit allows more"), "{error}");
    }
}

/// If solutions are not counted, the sentence names the option that allows more work, and with more work they
/// are counted.
#[test]
fn solutions_beyond_the_limit_name_their_option() {
    let text = "name = \"m\"\n[states]\nx = \"-a*x^2 + b*y\"\ny = \"a*b*x - c*y\"\n\
                [parameters]\na = {}\nb = {}\nc = {}\n[outputs]\nz = \"x\"\n";
    let says = |options: &[&str], words: &str| {
        answered(text, &[&["--count-limit"], options].concat()).expect("judged").to_string().contains(words)
    };
    assert!(says(
        &["0", "--relation-limit", "0"],
        "--relation-limit 6000, which takes up to half a minute, may decide"
    ));
    assert!(!says(&["0"], "may decide"));
    assert!(!says(&["30"], "may decide"));
}

/// Adversarial texts: each is refused, and the message names the exceeded limit.
#[test]
#[ignore = "seconds: .ci/run release"]
fn small_texts_that_ask_for_too_much_are_refused() {
    let powers = (0..12).fold("p".to_string(), |inner, _| format!("({inner})^1000"));
    let long = "n".repeat(1_000_000);
    for (text, expected) in [
        (
            format!(
                "name = \"m\"\n[states]\nx = \"-({powers})*x\"\n[parameters]\np = {{}}\n[outputs]\ny = \"x\"\n"
            ),
            "the powers in it are too high",
        ),
        (
            format!("name = \"m\"\n[states]\n{long} = \"-{long}\"\n[outputs]\ny = \"{long}\"\n"),
            "a name of at most 256 characters",
        ),
        (
            format!("name = \"m\"\n[states]\n{long} = \"-1\"\n[outputs]\ny = \"1\"\n"),
            "a name of 1000000 characters; expected at most 256",
        ),
        (
            format!("name = \"m\"\n[states]\nx = \"-x\"\n[outputs]\n{long} = \"x\"\n"),
            "a name of 1000000 characters; expected at most 256",
        ),
        (
            format!("name = \"m\"\n[states]\nx = \"-{long}*x\"\n[outputs]\ny = \"x\"\n"),
            "a name of at most 256 characters",
        ),
        (
            format!("name = \"{long}\"\n[states]\nx = \"-x\"\n[outputs]\ny = \"x\"\n"),
            "a name of a model of 1000000 characters; expected at most 4000",
        ),
        (
            format!(
                "name = \"m\"\n[states]\nx = {{ equation = \"-x\", unit = \"{long}\" }}\n[outputs]\ny = \"x\"\n"
            ),
            "a unit of 1000000 characters; expected at most 256",
        ),
        (
            format!(
                "name = \"m\"\n[states]\nx = {{ equation = \"-x\", description = \"{long}\" }}\n[outputs]\ny = \"x\"\n"
            ),
            "a description of 1000000 characters; expected at most 4000",
        ),
        // 64 choices of factors without real points: their total work is bounded
        (
            format!(
                "name = \"m\"\nconstraints = [{}]\nparameters = [\"x\", \"y\"]\n[outputs]\ns = \"x + y\"\n",
                (1..=6).map(|k| format!("\"(x^2+x+{k})*(y^2+y+{k}) = 0\"")).collect::<Vec<_>>().join(", ")
            ),
            "beyond --work-limit 600",
        ),
    ] {
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(text.as_bytes()).expect("written");
        let done = Command::new(env!("CARGO_BIN_EXE_obsdeg"))
            .args(["analyze", "--model"])
            .arg(file.path())
            .output()
            .expect("runs");
        let stderr = String::from_utf8_lossy(&done.stderr);
        let beginning: String = stderr.chars().take(400).collect();
        assert!(done.status.code() == Some(2) && stderr.contains(expected), "{expected}: {beginning}");
        assert!(stderr.len() < 10_000, "{expected}: {} bytes: {beginning}", stderr.len());
    }
}

/// Models of the generator whose work once was not counted: an elimination of long polynomials, remedies of a
/// model in many digits, and rows that lose so many digits that every row needs a new computation of all of
/// them.
#[test]
#[ignore = "seconds: .ci/run release"]
fn models_that_took_too_long_end() {
    let drawn = |seed: u64| model(&mut SplitMix64::of(seed, "small models", &["any"]));
    let long = answered(&drawn(2684), &[]).expect("judged");
    assert!(long["note"].as_str().expect("a note").contains("beyond its limit of work"), "{}", long["note"]);
    // the output is the time and determines no unknown
    let blind = answered(&drawn(2747), &[]).expect("judged");
    assert_eq!(blind["rank"], 0);
    let all =
        |text: &str| blind["quantities"].as_array().expect("unknowns").iter().all(|q| q["status"] == text);
    assert!(all("not_excited"), "{blind}");
    let resolve = blind["to_resolve"].to_string();
    assert!(resolve.contains("a larger --work-limit allows more"), "{resolve}");
    for seed in [7447, 5332] {
        let lossy = answered(&drawn(seed), &[]).expect("judged");
        let note = lossy["note"].as_str().expect("a note");
        assert!(note.contains("not all symmetries were sought"), "{seed}: {note}");
    }
}

/// Constraints, functions and powers whose work grows faster than their text: each ends within the limits,
/// judged or refused with the option that allows more.
#[test]
fn work_beside_the_rows_is_counted() {
    let states = |n: usize, rate: &str| (0..n).map(|i| format!("x{i} = \"{rate}\"\n")).collect::<String>();
    // twelve polynomials of degree 390 in each of 20 experiments
    let circles: Vec<String> = (0..12).map(|i| format!("\"(x{i} + x{})^390 = x{i}^2 + 2\"", i + 1)).collect();
    let polynomials = format!(
        "name = \"m\"\nexperiments = 20\nconstraints = [{}]\n[states]\n{}[outputs]\ny = \"x0\"\n",
        circles.join(", "),
        states(13, "0")
    );
    let vector = "name = \"m\"\nconstraints = [\"norm(A) = 1\", \"A[1] = 2\"]\n[states]\n\"A[300]\" = \"-A\"\n\
                  [outputs]\ny = \"A[1]\"\n";
    for (text, expected) in
        [(polynomials.as_str(), "points at which its constraints hold"), (vector, "beyond --work-limit 600 ")]
    {
        let error = answered(text, &[]).expect_err(expected);
        assert!(error.contains(expected) && error.contains("a larger --work-limit allows more"), "{error}");
    }
    // a sum of 1,200 sines: the proof of independence is refused, real numbers judge it; 1,199 directions are
    // unobservable
    let sines: Vec<String> = (0..1200).map(|i| format!("sin(x{i}*x{})", (i + 1) % 1200)).collect();
    let sines =
        format!("name = \"m\"\n[states]\n{}[outputs]\ny = \"{}\"\n", states(1200, "0"), sines.join(" + "));
    let answer = answered(&sines, &[]).expect("judged");
    assert_eq!((&answer["rank"], &answer["unobservable_directions"]), (&1.into(), &1199.into()));
    assert!(
        answer["note"].as_str().expect("a note").contains("a larger --work-limit allows more"),
        "{}",
        answer["note"]
    );
    // powers beyond 32 bits: x is an output, x'/x is the power of p; no expression is formed
    let high = "name = \"m\"\n[states]\nx = \"-((((p^1000)^1000)^1000)^10)*x\"\n[parameters]\np = {}\n\
                [outputs]\ny = \"x\"\n";
    let answer = answered(high, &[]).expect("judged");
    assert_eq!(answer["rank_profile"], serde_json::json!([1, 2]));
}

/// Texts with many names end within the limits. 20,000 outputs are judged, with solutions. Values of 2,000
/// unknowns are not tried, and the sentence names the option. More unknowns than allowed are refused.
#[test]
fn many_names_end_within_the_limits() {
    let names = |letter: &str, n: usize, value: &str| {
        (0..n).map(|i| format!("{letter}{i} = {value}\n")).collect::<String>()
    };
    let state = "name = \"m\"\n[states]\nx = \"-x\"\n";
    let outputs = format!("{state}[outputs]\n{}", names("y", 20_000, "\"x\""));
    let answer = answered(&outputs, &[]).expect("judged");
    assert_eq!(answer["rank_profile"], serde_json::json!([1]));
    let parameters = |n: usize| format!("{state}[parameters]\n{}[outputs]\ny = \"x\"\n", names("p", n, "{}"));
    let answer = answered(&parameters(2_000), &[]).expect("judged");
    assert_eq!((&answer["rank"], &answer["to_resolve"]["verdicts"]), (&1.into(), &0.into()));
    assert_eq!(
        answer["to_resolve"]["not_tried"],
        serde_json::json!([
            "2000 known values and outputs: none is tried; a larger --work-limit allows more"
        ])
    );
    let error = answered(&parameters(100_000), &[]).expect_err("too many");
    assert!(error.contains("100001 states and parameters; expected at most 4000 unknowns"), "{error}");
}

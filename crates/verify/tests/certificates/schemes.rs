//! Certificates of random schemes, and changed ones, compared by both checkers: this crate and
//! `tools/verify_certificate.py`.

use obsdeg_core::certificate::{Certificate, Kind, RowName, certify};
use obsdeg_core::degree::{Status, Verdict, judge};
use obsdeg_core::model::{Platform, Scheme, scheme_file};
use obsdeg_exact::SplitMix64;
use obsdeg_verify::{Replay, verify, verify_with};
use serde_json::{Value, json};

use crate::python::Python;

pub(crate) fn pick<'a, T>(rng: &mut SplitMix64, list: &'a [T]) -> &'a T {
    &list[rng.below(list.len() as u64) as usize]
}

/// Random scheme file.
fn draw(rng: &mut SplitMix64) -> String {
    let mut text = format!("carry = \"{}\"\n", pick(rng, &["platform", "inertial", "reset"]));
    let latitude = pick(rng, &["", "", "28.2", "-33.868", "90", "0", "45"]);
    if !latitude.is_empty() {
        text += &format!("latitude_deg = {latitude}\n");
    }
    let terms: [&[&str]; 11] = [
        &["F", "I", "O", "S"],
        &["F", "I", "O", "S"],
        &["F", "I", "O", "S"],
        &["F", "I", "O", "S", "II", "IO", "OS"],
        &["F"],
        &["S", "F", "OO", "SS"],
        &["F", "I", "O", "S", "K0", "K1"],
        &["F", "I", "K0", "M3", "K2"],
        &["K0", "K1", "M6", "K3", "Kx"],
        &["F", "I", "O", "S", "GS", "GM", "K0", "K1", "M3", "K2"],
        &["F", "S", "GS", "GM3"],
    ];
    text += &format!("terms = {:?}\n", pick(rng, &terms));
    if rng.below(6) == 0 {
        text += "measured_azimuth = true\n";
    }
    if text.contains("GS") {
        text += "path = \"gimbals\"\n";
    }
    match rng.below(6) {
        0 => text += "combinations = [\"D_FX - D_FZ\", \"2*psi_x + wU/wN*psi_z\"]\n",
        1 => text += "combinations = [\"D_FZ - wN*psi_y\", \"sqrt(3)*wU*psi_x + D_FY\"]\n",
        _ => {}
    }
    // at a pole wN is 0, and so is the divisor of a combination
    if text.contains("reset") || !text.contains("\"F\"") || text.contains("latitude_deg = 90") {
        text = text.lines().filter(|l| !l.starts_with("comb")).map(|l| format!("{l}\n")).collect();
    }
    let step = *pick(rng, &["90", "90", "15", "45", "1", "0.5"]);
    for _ in 0..1 + rng.below(6) {
        if step == "90" && rng.below(2) == 0 {
            let letters = pick(rng, &["NUE", "NDW", "USE", "ENU", "EUS", "DSW", "SUW", "WND", "UEN", "DNE"]);
            text += &format!("[[position]]\nattitude = \"{letters}\"\n");
            continue;
        }
        let mut angle = || {
            let k = rng.below(49) as f64 - 24.0;
            k * step.parse::<f64>().expect("a number") * if step == "1" { 7.0 } else { 1.0 }
        };
        text += &format!("[[position]]\nangles_deg = [{}, {}, {}]\n", angle(), angle(), angle());
    }
    if rng.below(5) == 0 {
        text += "[geometry]\nX = { I = \"+y\", O = \"+x\", S = \"-z\" }\nY = { I = \"-x\", O = \"+z\", S = \
            \"+y\" }\nZ = { I = \"z\", O = \"x\", S = \"y\" }\n";
    }
    text
}

fn scheme(text: &str) -> Scheme {
    scheme_file::read(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Certificate of a scheme file, and its text.
fn certified(text: &str) -> (Certificate, String) {
    let certificate = certify(&scheme(text), 1).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let json = certificate.text().expect("JSON");
    (certificate, json)
}

/// Both checkers accept the certificates of `count` random schemes, with the same sentences.
fn accept(count: usize, seed: u64) {
    let mut rng = SplitMix64::new(seed);
    let mut python = Python::start();
    let (mut exact, mut observable, mut combinations, mut fewest) = (0, 0, 0, 0);
    for _ in 0..count {
        let text = draw(&mut rng);
        let (certificate, json) = certified(&text);
        let sentences =
            verify(json.as_bytes(), Some(&text)).unwrap_or_else(|e| panic!("{e}\n{text}\n{json}"));
        if let Some(python) = &mut python {
            assert_eq!(python.asks(&json, Some(&text)), (true, sentences.join("\n")), "{text}");
        }
        let platform = Platform::new(scheme(&text)).expect("a scheme");
        let degrees = judge(&platform, 2).expect("verdicts").degrees;
        for (c, claimed) in certificate.verdicts.iter().enumerate() {
            let Verdict { status, degree } = Verdict::of(&degrees, c);
            assert_eq!((claimed.proof.status, claimed.proof.degree), (status, degree), "{text}");
            observable += usize::from(status == Status::Observable);
        }
        // no scheme determines more coefficients than the count of its positions allows
        if let Some(least) = fewest_of(&sentences) {
            assert!(least <= certificate.problem.positions.len(), "{text}\n{sentences:?}");
            fewest += usize::from(least == certificate.problem.positions.len());
        }
        exact += usize::from(certificate.kind == Kind::Exact);
        combinations += certificate.combinations.len();
    }
    println!("{count} schemes, {exact} exact, {observable} observable unknowns, {combinations} combinations");
    assert!(
        exact * 4 > count && exact * 20 < count * 19 && observable > 2 * count && combinations > count / 4
    );
    assert!(fewest > count / 20, "{fewest}");
}

/// Number of positions in the sentence on counting.
fn fewest_of(sentences: &[String]) -> Option<usize> {
    let rest = sentences.iter().find_map(|s| s.strip_prefix("Counting: no scheme of fewer than "))?;
    rest.split(' ').next()?.parse().ok()
}

/// Hand computation: (33 + 3)/6 = 6 positions for the 33 coefficients of the whole platform, also with
/// slews; the twelve drifts need 4, 5 and 6.
#[test]
fn fewest_positions_by_counting() {
    let root =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/fifteen-positions/scheme.toml");
    let text = std::fs::read_to_string(root).expect("an example");
    let drifts = text.replace("\"all\"", "\"F\", \"I\", \"O\", \"S\"").replace("GM = 60\nK1 = 5\n", "");
    let head = |text: &str, carry: &str| {
        let fewer = text.replace("carry = \"inertial\"", &format!("carry = \"{carry}\""));
        let simulation = fewer.replace("slew_rate_deg_s = 1\n", "");
        if carry == "inertial" { text.to_string() } else { simulation.replace("path = \"one-axis\"\n", "") }
    };
    let mut python = Python::start();
    for (text, carry, seen, positions) in [
        (&text, "inertial", 33, 6),
        (&text, "platform", 33, 6),
        (&drifts, "platform", 12, 4),
        (&drifts, "inertial", 12, 5),
        (&drifts, "reset", 12, 6),
    ] {
        let (_, json) = certified(&head(text, carry));
        let sentences = verify(json.as_bytes(), None).expect("accepted");
        assert_eq!(fewest_of(&sentences), Some(positions), "{carry} {sentences:?}");
        let makes = format!("positions makes {seen} coefficients observable under {carry} carry");
        assert!(sentences.iter().any(|s| s.contains(&makes)), "{sentences:?}");
        if let Some(python) = &mut python {
            assert_eq!(python.asks(&json, None), (true, sentences.join("\n")));
        }
    }
}

/// A file that is no scheme is bad input, and no key inside a table is ignored.
#[test]
fn scheme_files_that_are_none() {
    let (_, json) = certified(P1_P2);
    let of = |text: &str| verify(json.as_bytes(), Some(text)).expect_err("no scheme");
    assert!(of("{ not TOML").is_unreadable());
    let mut python = Python::start();
    for key in [
        "[geometry]\nW = [\"+x\", \"-z\", \"+y\"]\n",
        "[[position]]\nattitude = \"NDW\"\nslew = { about = \"N\", turn = 1 }\n",
    ] {
        let text = format!("{P1_P2}{key}");
        let refused = of(&text);
        assert!(
            !refused.is_unreadable() && refused.to_string().contains("keys of standing positions"),
            "{refused}"
        );
        if let Some(python) = &mut python {
            let (accepted, said) = python.asks(&json, Some(&text));
            assert!(!accepted && said.contains("keys of standing positions"), "{said}");
        }
    }
    let blocks = Replay { blocks: Some(1), seed: None };
    assert!(verify_with(json.as_bytes(), None, &blocks).expect_err("no blocks").is_unreadable());
}

#[test]
fn both_checkers_accept_certificates_of_random_schemes() {
    accept(60, 42);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn both_checkers_accept_certificates_of_4000_random_schemes() {
    accept(4000, 4242);
}

/// All places of a value whose paths `wanted` accepts.
pub(crate) fn places(
    value: &Value,
    path: &mut Vec<String>,
    wanted: &dyn Fn(&[String], &Value) -> bool,
    out: &mut Vec<String>,
) {
    if wanted(path, value) {
        out.push(format!("/{}", path.join("/")));
    }
    let children: Vec<(String, &Value)> = match value {
        Value::Array(list) => list.iter().enumerate().map(|(i, v)| (i.to_string(), v)).collect(),
        Value::Object(map) => map.iter().map(|(k, v)| (k.clone(), v)).collect(),
        _ => Vec::new(),
    };
    for (key, child) in children {
        path.push(key);
        places(child, path, wanted, out);
        path.pop();
    }
}

const KINDS: [&str; 10] =
    ["entry", "degree", "status", "scheme", "rank", "row", "pivot", "solution", "combination", "name"];

/// True for a place of this kind of change.
fn belongs(kind: &str, path: &[String], value: &Value) -> bool {
    let first = path.first().map_or("", String::as_str);
    let last = path.last().map_or("", String::as_str);
    let of_claim = (first == "verdicts" || first == "combinations") && path.len() >= 3;
    match kind {
        "entry" => {
            let number = first == "null_vectors" && path.len() == 6
                || of_claim && path[2] == "coefficients" && path.len() == 6;
            number && value.is_i64() && last != "2"
        }
        "degree" => of_claim && last == "degree",
        "status" => of_claim && last == "status",
        "scheme" => {
            first == "problem"
                && path.len() > 1
                && (value.is_string() || value.is_boolean() || value.is_null())
        }
        "rank" => first == "ranks" && path.len() == 2,
        "row" => first == "basis" && path.len() == 3 && last != "3",
        "pivot" => first == "basis" && path.len() == 3 && last == "3",
        "combination" => {
            first == "combinations" && path.len() == 6 && path[2] == "terms" && ["0", "1"].contains(&last)
        }
        "solution" => of_claim && path[2] == "solution" && path.len() == 5,
        _ => of_claim && (["hidden_by", "unknown"].contains(&last) || path[2] == "excited_by"),
    }
}

/// True if another coefficient at this place of a combination makes a false claim: the combination is
/// observable, and this unknown is not.
fn is_told_apart(certificate: &Value, path: &[String]) -> bool {
    let combination = &certificate["combinations"][path[1].parse::<usize>().expect("an index")];
    let of = |v: &&Value| v["unknown"] == path[3].as_str();
    let verdict = certificate["verdicts"].as_array().and_then(|list| list.iter().find(of));
    combination["degree"].is_u64() && verdict.is_some_and(|v| v["degree"].is_null())
}

/// Different value in place of `value`.
fn another(rng: &mut SplitMix64, kind: &str, value: &Value) -> Value {
    let texts = |list: &[&str], rng: &mut SplitMix64| json!(pick(rng, list));
    match value {
        Value::Number(n) => {
            let change = *pick(rng, &[-2, -1, 1, 2]);
            json!(n.as_i64().unwrap_or(0) + change)
        }
        Value::Bool(b) => json!(!b),
        Value::Null if kind == "degree" => json!(rng.below(3)),
        Value::Null => texts(&["psi_y", "D_FZ", "28.2"], rng),
        Value::String(_) if kind == "status" => {
            texts(&["observable", "inseparable", "not_excited", "not_seen"], rng)
        }
        Value::String(s) if kind == "scheme" && s.parse::<f64>().is_ok() => {
            texts(&["0", "30", "90", "28.3", "-12.5", "360"], rng)
        }
        Value::String(_) if kind == "scheme" => {
            texts(&["platform", "inertial", "reset", "+x", "-z", "F", "II", "K0"], rng)
        }
        _ => texts(&["psi_x", "psi_y", "psi_z", "D_FX", "D_FZ", "D_IY", "psi_y@1", ""], rng),
    }
}

/// Both checkers refuse `count` single changes of every kind.
fn refuse(count: usize, seed: u64) {
    let mut rng = SplitMix64::new(seed);
    let mut python = Python::start();
    for kind in KINDS {
        let mut done = 0;
        while done < count {
            let text = draw(&mut rng);
            let (_, json) = certified(&text);
            let value: Value = serde_json::from_str(&json).expect("JSON");
            let mut found = Vec::new();
            let wanted = |path: &[String], v: &Value| {
                belongs(kind, path, v) && (kind != "combination" || is_told_apart(&value, path))
            };
            places(&value, &mut Vec::new(), &wanted, &mut found);
            for _ in 0..5.min(found.len()) {
                let place = pick(&mut rng, &found);
                let mut changed = value.clone();
                let slot = changed.pointer_mut(place).expect("a place");
                let new = another(&mut rng, kind, slot);
                if *slot == new {
                    continue;
                }
                *slot = new.clone();
                let changed = changed.to_string();
                let reason = verify(changed.as_bytes(), Some(&text));
                let reason =
                    reason.expect_err(&format!("{kind} {place} = {new} of {text}\n{json}")).to_string();
                assert!(reason.contains(": "), "{reason}");
                if let Some(python) = &mut python {
                    let (accepted, reason) = python.asks(&changed, Some(&text));
                    assert!(!accepted && reason.contains(": "), "{kind} {place} = {new} of {text}\n{json}");
                }
                done += 1;
            }
        }
    }
}

#[test]
fn both_checkers_refuse_single_changes() {
    refuse(10, 7);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn both_checkers_refuse_1000_single_changes_of_every_kind() {
    refuse(1000, 77);
}

const P1_P2: &str = "[[position]]\nattitude = \"NUE\"\n[[position]]\nattitude = \"NDW\"\n";

/// A certificate with a changed problem is a statement about another scheme: it is accepted alone if it
/// is true, and never together with the original scheme.
#[test]
fn a_true_statement_about_another_scheme() {
    let text = format!("latitude_deg = 28.2\n{P1_P2}");
    let (_, json) = certified(&text);
    let other = json.replace("\"28.2\"", "\"28.3\"");
    assert!(verify(other.as_bytes(), None).is_ok());
    let refused = verify(other.as_bytes(), Some(&text)).expect_err("another scheme").to_string();
    assert_eq!(
        refused,
        "problem.latitude_deg, against the scheme file: the certificate says \"28.3\"; found \"28.2\""
    );
    let pole = json.replace("\"28.2\"", "\"90\"");
    assert!(verify(pole.as_bytes(), None).is_err());
}

/// Hand computation: at p1 p2 the D_FX of the paper, 1/2 [wU (Z1@p1 + Z1@p2) - Z3'@p1 - Z3'@p2], and
/// psi_y with D_FZ as null vector.
#[test]
fn the_solution_of_the_paper() {
    let (certificate, json) = certified(P1_P2);
    assert_eq!((certificate.kind, &certificate.ranks[..]), (Kind::Exact, &[2, 6, 8][..]));
    let of = |name: &str| &certificate.verdicts.iter().find(|v| v.unknown == name).expect("an unknown").proof;
    let d_fx = of("D_FX");
    let terms = |rows: &Option<Vec<RowName>>, numbers: &Option<Vec<Vec<[i64; 5]>>>| {
        rows.clone()
            .unwrap_or_default()
            .into_iter()
            .map(|row| (row.segment, row.order, row.component))
            .zip(numbers.clone().unwrap_or_default())
            .collect::<Vec<_>>()
    };
    // Z1 = psi_z is the same at both positions up to its sign: psi_z^n of p2 is -psi_z, so the two
    // terms in wU cancel
    assert_eq!(
        terms(&d_fx.solution, &d_fx.coefficients),
        [((1, 1, 3), vec![[-1, 2, 1, 0, 0]]), ((2, 1, 3), vec![[-1, 2, 1, 0, 0]])]
    );
    assert_eq!((of("psi_y").status, of("D_SY").status), (Status::Inseparable, Status::NotExcited));
    let last = certificate.null_vectors.as_ref().and_then(|n| n.last()).expect("null vectors");
    let expected = [("D_FZ".to_string(), vec![[1, 1, 1, 0, 0]]), ("psi_y".into(), vec![[1, 1, 1, -1, 0]])];
    assert!(last.contains(&expected.into()), "{last:?}");
    assert!(json.len() < 20_000, "{}", json.len());
}

/// Invalid files are refused with a reason, without a panic: every truncation of a certificate, and
/// single wrong bytes.
#[test]
fn hostile_files() {
    let (_, json) = certified(P1_P2);
    let mut rng = SplitMix64::new(3);
    for _ in 0..300 {
        let cut = rng.below(json.len() as u64 - 2) as usize;
        assert!(verify(&json.as_bytes()[..cut], None).is_err());
        let mut bytes = json.clone().into_bytes();
        bytes[cut] = rng.below(256) as u8;
        // only blanks may differ
        if verify(&bytes, Some(P1_P2)).is_ok() {
            assert!(json.as_bytes()[cut].is_ascii_whitespace() || bytes == json.as_bytes(), "byte {cut}");
        }
    }
    let deep = "{\"a\":".repeat(100_000);
    // a list of values is no object of the layout
    let list = json.replace("{\"I\":\"+x\",\"O\":\"-z\",\"S\":\"+y\"}", "[\"+x\",\"-z\",\"+y\"]");
    assert_ne!(list, json);
    let repeated = json.replacen("\"ranks\"", "\"kind\": \"exact\", \"ranks\"", 1);
    let huge = json.replacen("[2,6,8]", "[18446744073709551616]", 1);
    let powers = json.replace("[1,1,1,-1,0]", "[1,1,1,-1000000000,0]");
    for (text, reason) in [
        (deep, "EOF"),
        (list, "problem.gyros.0"),
        (repeated, "duplicate field"),
        (huge, "ranks"),
        (powers, "not a term"),
    ] {
        let refused = verify(text.as_bytes(), None).expect_err("hostile").to_string();
        assert!(refused.contains(reason) || reason == "ranks", "{refused}");
    }
    let many = json.replace(
        "[[\"0\",\"0\",\"0\"]",
        &format!("[{}[\"0\",\"0\",\"0\"]", "[\"1\",\"0\",\"0\"],".repeat(1000)),
    );
    assert!(verify(many.as_bytes(), None).expect_err("too many").to_string().contains("1 to 1000 positions"));
}

/// Schemes that certificates do not cover are refused with the feature.
#[test]
fn schemes_without_certificates() {
    let cases = [
        ("[[position]]\nangles_deg = [\"alpha\", 0, 0]\n", "the generic angle alpha"),
        ("terms = \"drift\"\n[[position]]\nattitude = \"NUE\"\n", "the unknowns `drift`"),
        (
            "[[position]]\nattitude = \"NUE\"\nrotation = { about = \"X_p\", angle_deg = 90 }\n",
            "the rotating segment p1",
        ),
    ];
    for (text, reason) in cases {
        let error = certify(&scheme(text), 1).expect_err("not covered").to_string();
        assert!(error.contains(reason), "{error}");
    }
}

/// A verdict that holds only at the latitude of the scheme has a certificate of kind modular that both
/// checkers accept; a combination that is zero there is refused.
#[test]
fn what_holds_at_one_latitude_is_modular() {
    let head = "carry = \"inertial\"\nlatitude_deg = 45\nterms = [\"F\", \"I\", \"O\", \"S\", \"II\", \"IO\", \"OS\"]\n\
                combinations = [\"D_FX - D_FZ\", \"2*psi_x + wU/wN*psi_z\"]\n";
    let positions =
        ["-900, 180, 675", "-1035, 765, -90", "-1035, -585, 135", "1080, 810, 180", "-945, 585, 855"]
            .map(|angles| format!("[[position]]\nangles_deg = [{angles}]\n"))
            .concat();
    let text = format!("{head}{positions}");
    let (certificate, json) = certified(&text);
    assert_eq!(certificate.kind, Kind::Modular);
    assert!(!certificate.combinations.is_empty());
    verify(json.as_bytes(), Some(&text)).expect("accepted");
    let mut python = Python::start();
    if let Some(python) = &mut python {
        assert!(python.asks(&json, Some(&text)).0);
    }
    // wN - wU is zero at 45 deg
    let mut value: Value = serde_json::from_str(&json).expect("JSON");
    let terms = value["combinations"][0]["terms"].as_object_mut().expect("terms");
    let first = terms.values_mut().next().expect("a term");
    *first = json!([[1, 1, 1, 1, 0], [-1, 1, 1, 0, 1]]);
    let forged = value.to_string();
    let refused = verify(forged.as_bytes(), None).expect_err("refused").to_string();
    assert!(refused.contains("a number other than 0"), "{refused}");
    if let Some(python) = &mut python {
        let (accepted, said) = python.asks(&forged, None);
        assert!(!accepted && said.contains("numbers other than 0"), "{said}");
    }
}

/// Axes in a list equal those in a table, in its order.
#[test]
fn axes_in_a_list() {
    let positions = "[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\nangles_deg = [180, 0, 0]\n";
    let axes = ["[\"-y\", \"+z\", \"x\"]", "{ X = \"-y\", Y = \"+z\", Z = \"x\" }"];
    let text =
        axes.map(|a| format!("terms = [\"F\", \"K0\"]\n[geometry]\naccelerometers = {a}\n{positions}"));
    let json = certified(&text[1]).1;
    let mut python = Python::start();
    for text in &text {
        verify(json.as_bytes(), Some(text)).expect("accepted");
        if let Some(python) = &mut python {
            assert!(python.asks(&json, Some(text)).0, "{text}");
        }
    }
}

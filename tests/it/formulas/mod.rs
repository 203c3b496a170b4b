//! Every printed formula is read back from text, JSON and LaTeX, and evaluated on derivatives of Z that are
//! simulated from the equations alone. Only the tested output comes from the engine: readers, motion and
//! values are the test's own.

mod draw;
mod platform;
mod tex;
mod text;
mod value;
mod why;

use std::collections::BTreeMap;

use obsdeg_core::analysis::{Analysis, AnalysisOptions, Quantity, analyze};
use obsdeg_core::model::Scheme;
use obsdeg_core::solution::Frame;
use obsdeg_report::{Format, TerminalLayout};
use obsdeg_symbolic::Worker;
use regex::Regex;
use serde_json::Value as Json;

use self::draw::{Angles, RandomScheme, cases, fixed};
use self::platform::Case;
use self::text::READINGS;
use self::value::Value;

/// Relative tolerance of exact coefficients, relative to the sum of the magnitudes of all terms.
const EXACT: f64 = 1e-9;
/// Relative tolerance of coefficients printed as decimals with six digits: 5e-6 for each, and 5e-6 for the
/// combination on the left.
const SIX_DIGITS: f64 = 1.1e-5;
/// Absolute tolerance of terms that cancel, for unknowns of about one.
const SIX_PLACES: f64 = 1e-4;

/// Number of formulas of each kind that were checked.
#[derive(Debug, Default)]
struct CheckCounts {
    exact: usize,
    symbolic: usize,
    decimal: usize,
    combinations: usize,
    turning: usize,
    null_vectors: usize,
    formulas: usize,
}

/// Values for a check of one formula, and the text of a failure.
struct Check<'a> {
    case: &'a Case,
    about: String,
}

impl Check<'_> {
    fn text(&self, formula: &str) -> Value {
        let at = |name: &str| self.case.value(name);
        let values = READINGS.map(|blank| {
            text::evaluate(formula, blank, &at).unwrap_or_else(|e| panic!("{e}\n{}", self.about))
        });
        for v in &values {
            assert!(
                v.is(values[0].value, 1e-13),
                "`{formula}` reads in two ways: {values:?}\n{}",
                self.about
            );
        }
        values[0]
    }

    fn latex(&self, formula: &str) -> Value {
        tex::evaluate(formula, &|name| self.case.value(name))
            .unwrap_or_else(|e| panic!("{e}\n{}", self.about))
    }

    fn equal(&self, what: &str, found: Value, expected: Value, tolerance: f64) {
        // values are near one: an expected zero is zero up to rounding
        let size = Value { size: found.size.max(expected.size).max(1e-3), ..found };
        assert!(
            size.is(expected.value, tolerance),
            "{what}: {found:?}, expected {expected:?}\n{}",
            self.about
        );
    }
}

/// Rows of the tables in a LaTeX document whose first cell is a formula.
fn latex_rows(document: &str) -> Vec<Vec<String>> {
    let rows = document.lines().filter(|l| l.starts_with('$') && l.ends_with("\\\\"));
    rows.map(|l| {
        let cells = l.trim_end_matches("\\\\").split(" & ");
        cells.map(|c| c.trim().trim_matches('$').to_string()).collect()
    })
    .collect()
}

/// Formulas under a heading of a LaTeX document.
fn items<'a>(document: &'a str, heading: &str) -> Vec<&'a str> {
    let under = document.lines().skip_while(|l| !l.starts_with(&format!("\\paragraph{{{heading}"))).skip(1);
    let lines = under.take_while(|l| !l.starts_with("\\end")).filter_map(|l| l.strip_prefix("\\item $"));
    lines.map(|l| l.strip_suffix('$').expect("a formula")).collect()
}

fn list_of(json: &Json, key: &str) -> Vec<Json> {
    json[key].as_array().cloned().unwrap_or_default()
}

/// Station names as the readers write them: `p1`, `leg 1-b[45]`.
fn stations(json: &Json) -> Vec<String> {
    let name = |s: &Json| {
        let position = s["position"].as_str().expect("a name");
        s["turned_deg"].as_f64().map_or_else(|| position.to_string(), |t| format!("{position}[{t}]"))
    };
    list_of(json, "stations").iter().map(name).collect()
}

/// Checks all formulas of one scheme.
fn check(draw: &RandomScheme, frame: Frame, worker: Option<&mut Worker>, seen: &mut CheckCounts) {
    let (scheme, case) = (draw.scheme(), draw.case());
    let options =
        AnalysisOptions { seed: 1, solutions: true, formulas: worker.is_some(), frame, omitted: false };
    let a: Analysis = analyze(&scheme, options, worker).expect("analysed");
    let written = |format| obsdeg_report::written(&a, format, TerminalLayout::default()).expect("written");
    let document = written(Format::Latex);
    let latex = latex_rows(&document);
    let json: Json = serde_json::from_str(&written(Format::Json)).expect("JSON");
    null_vectors(&json, &document, draw, &case, seen);
    if options.formulas {
        position_formulas(&json, &document, draw, &case, seen);
    }
    let mut fields: Vec<BTreeMap<String, String>> = Vec::new();
    for table in ["quantities", "combinations"].into_iter().filter(|t| !list_of(&json, t).is_empty()) {
        let text = obsdeg_report::csv(&a, Some(table)).expect("a table");
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        fields.extend(reader.deserialize().map(|row| row.expect("a row")));
    }
    let (quantities, combinations) = (list_of(&json, "quantities"), list_of(&json, "combinations"));
    assert_eq!((latex.len(), fields.len()), (quantities.len() + combinations.len(), latex.len()));
    let rows = quantities.iter().chain(&combinations).zip(latex).zip(&fields);
    for (i, ((q, latex), row)) in rows.enumerate() {
        let single = i < quantities.len();
        let left = q[if single { "name" } else { "expression" }].as_str().expect("a text");
        let c = Check { case: &case, about: format!("{left} of {draw:?} in {frame:?}: {q:#}") };
        // in spreadsheets, a text that begins with a minus and contains a quoted name starts with an
        // apostrophe
        let field = |key: &str| {
            row[key].strip_prefix('\'').filter(|f| f.contains('"')).unwrap_or(&row[key]).to_string()
        };
        assert_eq!(field(if single { "name" } else { "expression" }), left);
        let expected = c.text(left);
        c.equal("left side in LaTeX", c.latex(&latex[0]), expected, EXACT);
        if single {
            assert_eq!(tex::name(&latex[0]).as_deref(), Ok(left));
        }
        let Some(solution) = q["solution"].as_object() else {
            // an unreadably long solution is omitted, and a note says so
            let notes = json["notes"].to_string();
            let long =
                notes.contains(&format!("no solution printed for {left}: its longest coefficient has"));
            assert!(q["degree"].is_null() || long, "no solution: {notes}\n{}", c.about);
            continue;
        };
        let printed = solution["text"].as_str().expect("a text");
        assert_eq!(field("solution.text"), printed);
        let tolerance = match solution["form"].as_str() {
            Some("exact") => {
                seen.exact += 1;
                EXACT
            }
            Some("symbolic") => {
                seen.symbolic += 1;
                EXACT
            }
            _ => {
                seen.decimal += 1;
                SIX_DIGITS
            }
        };
        seen.combinations += usize::from(!single);
        let list = solution["terms"].as_array().expect("terms");
        let text = |t: &Json, key: &str| t[key].as_str().expect("a text").to_string();
        let sum = list.iter().fold(Value::of(0.0), |sum, t| {
            sum.add(c.text(&format!(
                "{}*{}@{}",
                text(t, "coefficient"),
                text(t, "observation"),
                text(t, "station")
            )))
        });
        c.equal("terms", sum, expected, EXACT);
        // an answer states that it uses derivatives during a rotation
        let turning = |t: &Json| {
            let station = list_of(&json, "stations")
                .into_iter()
                .find(|s| s["label"] == t["station"])
                .expect("it is listed");
            assert_eq!(station["rate"].is_null(), station["turned_deg"].is_null());
            text(t, "observation").contains('\'') && !station["rate"].is_null()
        };
        assert_eq!(solution["turning"].as_bool(), Some(list.iter().any(turning)), "{}", c.about);
        seen.turning += usize::from(printed.contains("w@"));
        c.equal("text", c.text(printed), expected, tolerance);
        let off = (c.text(printed).value - expected.value).abs();
        assert!(off < SIX_PLACES, "terms that cancel are rounded to decimals: off by {off}\n{}", c.about);
        c.equal("LaTeX", c.latex(&latex[latex.len() - 1]), expected, tolerance);
    }
}

/// Directions that are printed as unobservable change no derivative of Z.
fn null_vectors(json: &Json, latex: &str, draw: &RandomScheme, case: &Case, seen: &mut CheckCounts) {
    let lines = items(latex, "Directions that derivatives of Z do not see");
    let vectors = json["null_space"].as_array().expect("a list");
    assert_eq!(lines.len(), vectors.len());
    if draw.terms == "drift" {
        return;
    }
    let c = Check { case, about: format!("{vectors:#?} of {draw:?}") };
    for (vector, line) in vectors.iter().zip(lines) {
        let mut moved = case.clone();
        let mut parts = line.split(",\\; ").filter_map(|part| part.strip_prefix("\\delta "));
        let mut decimals = false;
        for component in vector.as_array().expect("a list") {
            let text = |key: &str| component[key].as_str().expect("a text");
            let (left, right) = parts.next().and_then(|p| p.split_once(" = ")).expect("a component");
            assert_eq!(tex::name(left).as_deref(), Ok(text("name")));
            let amount = c.text(text("coefficient"));
            decimals |= text("coefficient").contains('.');
            c.equal("LaTeX", c.latex(right), amount, EXACT);
            assert!(moved.change(text("name"), amount.value), "{}", text("name"));
        }
        seen.null_vectors += 1;
        for station in stations(json) {
            let (i, turned) = case.find(&station).expect("a station");
            let (here, there) = (case.station(i, turned), moved.station(i, turned));
            for (x, y) in here.z_n.iter().flatten().zip(there.z_n.iter().flatten()) {
                assert!((x - y).abs() <= if decimals { 1e-4 } else { 1e-9 } * (1.0 + x.abs()), "{}", c.about);
            }
        }
    }
}

/// Checks the formulas of Z, and of psi and eps at each position.
fn position_formulas(json: &Json, latex: &str, draw: &RandomScheme, case: &Case, seen: &mut CheckCounts) {
    let formulas = json["formulas"].as_array().expect("formulas");
    let lines = items(latex, "Z in n, and psi, eps in n at each position");
    assert_eq!(lines.len(), formulas.len());
    let lines: Vec<(&str, &str)> = lines.iter().filter_map(|l| l.split_once(" = ")).collect();
    for (i, f) in formulas.iter().enumerate() {
        let text = |key: &str| f[key].as_str().expect("a text");
        let labels = list_of(json, "stations");
        let own = f["position"]
            .as_str()
            .map(|own| labels.iter().position(|l| l["label"] == own).expect("a station"));
        let stations = stations(json);
        let stations = own.map_or(stations.clone(), |i| vec![stations[i].clone()]);
        for station in stations {
            // formulas of one position mean its own psi^n and eps^n
            let at = |name: &str| {
                let local = name.ends_with("^n") || name.ends_with("^n'");
                case.value(&if local { format!("{name}@{station}") } else { name.into() })
            };
            let about = format!("{f} of {draw:?}");
            let expected = at(&if text("left").starts_with('Z') {
                format!("{}@{station}", text("left"))
            } else {
                text("left").into()
            });
            let expected = Value::of(expected.unwrap_or_else(|| panic!("{about}")));
            let c = Check { case, about };
            for blank in READINGS {
                let v =
                    text::evaluate(text("right"), blank, &at).unwrap_or_else(|e| panic!("{e}\n{}", c.about));
                c.equal("formula", v, expected, EXACT);
            }
            let v = tex::evaluate(lines[i].1, &at).unwrap_or_else(|e| panic!("{e}\n{}", c.about));
            c.equal("LaTeX", v, expected, EXACT);
            let left = own.map_or(text("left").into(), |_| format!("{}@{station}", text("left")));
            assert_eq!(tex::name(lines[i].0), Ok(left));
        }
        seen.formulas += 1;
    }
}

/// Requested combinations may contain roots, decimals, sines and cosines, with and without the engine.
fn asked(mut worker: Option<&mut Worker>) {
    for (angles, asked) in [
        (
            &["0,0,0", "180,0,0"] as &[&str],
            &[
                "sqrt(2)*D_FX + D_SX/3",
                "0.123456789*D_FX - sqrt(12)*wU^2/wN*psi_x",
                "(D_IY-D_FY)*wN*(1+sqrt(6))^2",
            ] as &'static [&'static str],
        ),
        (
            &["20,0,0", "180,0,0"],
            &["D_FX - sin(-20 deg)/(1+cos(-20 deg))*D_OX", "cos(110 deg)*(D_FX+D_SX) - 2.5*psi_x*wU"],
        ),
        (
            &["alpha,0,0", "alpha,0,180"],
            &["cos(alpha)*D_FX + sin(alpha)*cos(alpha)*D_OX", "D_SX/sin(alpha)^2"],
        ),
    ] {
        let draw = fixed(angles, asked);
        let mut seen = CheckCounts::default();
        for frame in [Frame::N, Frame::Platform] {
            let generic = angles[0].contains("alpha");
            if generic && worker.is_none() {
                continue;
            }
            check(&draw, frame, worker.as_deref_mut(), &mut seen);
            let a = analyze(&draw.scheme(), AnalysisOptions { frame, ..AnalysisOptions::default() }, None)
                .expect("analysed");
            let verdicts: Vec<_> = a.combinations.iter().filter(|c| c.requested).map(|c| c.degree).collect();
            assert!(verdicts.len() == asked.len() && verdicts.iter().all(Option::is_some), "{verdicts:?}");
        }
    }
}

/// Coefficients that are not allowed are refused, and the message lists the allowed ones.
#[test]
fn coefficients_that_are_not_known_are_refused() {
    for (text, expected) in [
        (
            "sqrt(5)*D_FX",
            "expected the root of 2, 3 or 6, or of one of these times a square, found that of 5",
        ),
        ("exp(1)*D_FX", "expected sin or cos of an angle, or a square root"),
        ("sin(33 deg)*D_FX", "expected an angle that the scheme has, found `33 deg`"),
        ("sin(alpha)*D_FX", "`alpha` is not known here; expected one of psi_x, "),
        ("(wN+wU)*D_FX", "expected coefficients that are numbers times powers of wN and wU"),
        ("D_FX*D_FY", "expected a linear combination of unknowns"),
    ] {
        let scheme = Scheme { combinations: vec![text.into()], ..fixed(&["0,0,0", "20,0,0"], &[]).scheme() };
        let e = analyze(&scheme, AnalysisOptions::default(), None).expect_err("refused").to_string();
        assert!(e.contains(expected), "{text}: {e}");
    }
}

/// Every reported combination is readable: no coefficient is a decimal, at any angles.
#[test]
fn combinations_can_be_read() {
    let angles = Regex::new(r"\(-?[\d.]+ deg\)").expect("an expression");
    for kind in [Angles::Decimals, Angles::Constants, Angles::Roots] {
        for draw in cases(kind, 3, crate::program::cases(4, 12), &[]) {
            let a = analyze(
                &draw.scheme(),
                AnalysisOptions { solutions: false, ..AnalysisOptions::default() },
                None,
            )
            .expect("analysed");
            for c in &a.combinations {
                let coefficients = angles.replace_all(&c.expression, "");
                assert!(
                    !coefficients.contains('.') && !coefficients.contains("combination"),
                    "{} of {draw:?}",
                    c.expression
                );
            }
            // the unknowns in n of a single position have no names in the model
            if draw.terms == "drift" {
                continue;
            }
            // combinations and unknowns up to each degree span the observable functionals, and no combination
            // is redundant
            let case = draw.case();
            let functional = |text: &str| -> Vec<f64> {
                let part = |q: &Quantity| {
                    let mut moved = case.silent();
                    assert!(moved.change(&q.name, 1.0), "{}", q.name);
                    Check { case: &moved, about: format!("{text} of {draw:?}") }.text(text).value
                };
                a.quantities.iter().map(part).collect()
            };
            let unknowns = a.quantities.iter().map(|q| (q.degree, &q.name, true));
            let combined = a.combinations.iter().map(|c| (c.degree, &c.expression, false));
            let all: Vec<(usize, bool, Vec<f64>)> = unknowns
                .chain(combined)
                .filter_map(|(degree, text, single)| Some((degree?, single, functional(text))))
                .collect();
            for (k, expected) in a.rank_profile.iter().enumerate() {
                let span = |of: &dyn Fn(usize, bool) -> bool| -> Vec<Vec<f64>> {
                    all.iter().filter(|(d, single, _)| of(*d, *single)).map(|(.., f)| f.clone()).collect()
                };
                let added = span(&|degree, single| degree == k && !single).len();
                let before = rank(span(&|degree, single| degree < k || degree == k && single));
                let within = rank(span(&|degree, _| degree <= k));
                assert_eq!((before + added, within), (*expected, *expected), "{k} {draw:?}");
            }
        }
    }
}

/// Rank of the derivatives of Z up to an order, as functionals of the unknowns.
#[cfg(feature = "symbolica")]
fn numeric_rank(case: &Case, order: usize) -> usize {
    let silent = case.silent();
    let psi = ["psi_x", "psi_y", "psi_z"].map(String::from);
    let unknowns: Vec<String> = psi.into_iter().chain(case.drift.keys().cloned()).collect();
    let column = |name: &String| -> Vec<f64> {
        let mut moved = silent.clone();
        assert!(moved.change(name, 1.0));
        let stations = (0..case.positions.len()).map(|i| moved.station(i, 0.0));
        stations.flat_map(|s| s.z_n[..=order].concat()).collect()
    };
    rank(unknowns.iter().map(column).collect())
}

/// Rank of a matrix, by elimination with full pivoting.
fn rank(mut columns: Vec<Vec<f64>>) -> usize {
    let mut rank = 0;
    loop {
        let entries = columns
            .iter()
            .enumerate()
            .flat_map(|(c, v)| v.iter().enumerate().map(move |(r, x)| (x.abs(), c, r)));
        let Some((largest, c, r)) = entries.max_by(|a, b| a.0.total_cmp(&b.0)) else { return rank };
        if largest < 1e-8 {
            return rank;
        }
        rank += 1;
        let pivot = columns.swap_remove(c);
        for other in &mut columns {
            let factor = other[r] / pivot[r];
            other.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
}

/// Degenerate angles: the rank profile is as printed at each given point, and different beside it.
#[cfg(feature = "symbolica")]
fn degenerate_angles(worker: &mut Worker) {
    let mut several = 0;
    for angles in [
        &["alpha,0,0", "alpha,0,180"] as &[&str],
        &["alpha,alpha,0", "0,alpha,alpha", "alpha,0,alpha"],
        &["alpha,0,0", "a1,0,0", "0,0,alpha"],
        &["alpha,0,a1", "0,alpha,0", "a1,0,0"],
    ] {
        let draw = fixed(angles, &[]);
        let options = AnalysisOptions { solutions: false, formulas: true, ..AnalysisOptions::default() };
        let a = analyze(&draw.scheme(), options, Some(&mut *worker)).expect("analysed");
        let loci = a.degenerate_loci.expect("loci");
        assert!(loci.len() > 1, "{:?}", a.notes);
        for l in &loci {
            assert!(l.condition.len() < 250 && !l.points_deg.is_empty(), "{l:?}");
            several += usize::from(!l.complete);
            for point in &l.points_deg {
                let profile_at = |offset: f64| -> Vec<usize> {
                    let names = point.iter().map(|(n, deg)| (n.clone(), deg.to_radians() + offset));
                    let mut values: std::collections::HashMap<String, f64> =
                        [("alpha".to_string(), 0.77), ("a1".into(), -1.31)].into();
                    values.extend(names);
                    let case = draw.case_at(&values);
                    (0..a.rank_profile.len()).map(|k| numeric_rank(&case, k)).collect()
                };
                let mut expected = l.rank_profile.clone();
                expected.resize(a.rank_profile.len(), *expected.last().expect("a rank"));
                assert_eq!(profile_at(0.0), expected, "{l:?}");
                if l.complete {
                    assert_eq!(profile_at(0.02), a.rank_profile, "{l:?}");
                }
            }
            if l.complete {
                let (name, values) = l.condition.split_once(" = ").expect("a list");
                let printed: Vec<f64> = values
                    .trim_end_matches(" deg")
                    .split(", ")
                    .map(|x| x.parse().expect("degrees"))
                    .collect();
                assert_eq!(printed.len(), l.points_deg.len());
                for (x, point) in printed.iter().zip(&l.points_deg) {
                    assert!((x - point[name]).abs() < 1e-3);
                }
            }
        }
    }
    assert!(several > 2);
}

/// Requested combinations without the engine.
#[test]
fn combinations_asked_for() {
    asked(None);
}

/// Formulas without the engine: numbers recovered from the fields, and decimals.
#[test]
fn formulas_without_the_engine_give_the_truth() {
    without_the_engine(2);
}

/// Formulas without the engine, seven times as many schemes.
#[test]
#[ignore = "full length, for `.ci/run release`"]
fn formulas_without_the_engine_give_the_truth_at_length() {
    without_the_engine(14);
}

fn without_the_engine(times: usize) {
    let mut seen = CheckCounts::default();
    for (kind, most, n, turning) in [
        (Angles::Cardinal, 5, 2 * times, &[] as &[i32]),
        (Angles::Roots, 4, 2 * times, &[]),
        (Angles::Constants, 3, times, &[]),
        (Angles::Decimals, 4, times, &[]),
        // stations at multiples of 45 degrees, then at other angles
        (Angles::Cardinal, 2, times, &[360, -360, 720]),
        (Angles::Roots, 2, times / 2, &[-360, 240]),
        (Angles::Decimals, 2, times / 2, &[90, -200, 75]),
    ] {
        for draw in cases(kind, most, n, turning) {
            for frame in [Frame::N, Frame::Platform] {
                check(&draw, frame, None, &mut seen);
            }
        }
    }
    assert!(
        seen.exact > 32 * times
            && seen.decimal > 20 * times
            && seen.turning > 6 * times
            && seen.null_vectors > 6 * times,
        "{seen:?}"
    );
}

/// Formulas with the engine: sines and cosines of names and of constant angles, and the formulas of each
/// position.
#[cfg(feature = "symbolica")]
#[test]
#[ignore = "seconds: .ci/run"]
fn formulas_of_the_engine_give_the_truth() {
    with_the_engine(1);
}

#[cfg(feature = "symbolica")]
#[test]
#[ignore = "full length, for `.ci/run release`"]
fn formulas_of_the_engine_give_the_truth_at_length() {
    with_the_engine(4);
}

#[cfg(feature = "symbolica")]
fn with_the_engine(times: usize) {
    let mut worker = Worker::new(obsdeg_symbolic::WorkerConfig {
        program: env!("CARGO_BIN_EXE_obsdeg").into(),
        arguments: vec!["symbolic-worker".into()],
        limit: 60,
        wait: std::time::Duration::from_secs(600),
        waiting: obsdeg_symbolic::Waiting::silent(),
    });
    let mut seen = CheckCounts::default();
    for (kind, most, n, turning) in [
        (Angles::Cardinal, 3, 2 * times, &[] as &[i32]),
        (Angles::Roots, 3, 2 * times, &[]),
        (Angles::Constants, 2, 4 * times, &[]),
        (Angles::Names, 2, 5 * times, &[]),
        (Angles::TwoNames, 1, times, &[]),
        (Angles::Cardinal, 2, 3 * times, &[360, -360]),
    ] {
        for (i, draw) in cases(kind, most, n, turning).iter().enumerate() {
            check(draw, [Frame::N, Frame::Platform][i % 2], Some(&mut worker), &mut seen);
        }
    }
    let turning = RandomScheme { turns: vec![Some(("X_p", 360))], ..fixed(&["alpha,0,0"], &[]) };
    for frame in [Frame::N, Frame::Platform] {
        check(&turning, frame, Some(&mut worker), &mut seen);
    }
    asked(Some(&mut worker));
    degenerate_angles(&mut worker);
    assert!(
        seen.exact > 50 * times
            && seen.symbolic > 25 * times
            && seen.turning > 5 * times
            && seen.null_vectors > 15 * times
            && seen.formulas > 150 * times,
        "{seen:?}"
    );
}

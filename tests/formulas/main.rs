//! Every printed formula is read back, from text, JSON and LaTeX, and evaluated on derivatives of Z that are simulated from the
//! equations alone. Nothing here but the printing under test comes from the engine: readers, motion and values are the test's own.

mod platform;
mod tex;
mod text;
mod value;

use std::collections::HashMap;

use obsdeg_core::analysis::{Analysis, Options, Quantity, analyze};
use obsdeg_core::model::rotation::Rotation;
use obsdeg_core::model::scheme::parse_attitude;
use obsdeg_core::model::{self, Scheme};
use obsdeg_core::solution::solver::Frame;
use obsdeg_report::{Format, Layout};
use obsdeg_symbolic::Worker;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, RngSeed, TestRunner};
use serde_json::Value as Json;

use platform::{Carry, Case, Position, Turn};
use text::READINGS;
use value::Value;

/// Exact coefficients, relative to the sum of the magnitudes that are added up.
const EXACT: f64 = 1e-9;
/// Coefficients that are printed with six digits and decimals: 5e-6 each, and those of a combination on the left as well.
const SIX_DIGITS: f64 = 1.1e-5;
/// Whatever cancels: absolute, for unknowns of about one.
const SIX_PLACES: f64 = 1e-4;

/// How the angles of a scheme are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(not(feature = "symbolica"), allow(dead_code, reason = "generic angles need the engine"))]
enum Angles {
    /// Multiples of 90 degrees.
    Cardinal,
    /// Multiples of 15 degrees.
    Roots,
    /// Few constant angles besides, whose sines and cosines are symbols.
    Constants,
    /// A name, with signs and offsets.
    Names,
    /// Two names.
    TwoNames,
    /// Decimals, all different.
    Decimals,
}

/// What is drawn.
#[derive(Debug, Clone)]
struct Draw {
    angles: Vec<[String; 3]>,
    /// About what and by how many degrees each position turns.
    turns: Vec<Option<(&'static str, i32)>>,
    carry: Carry,
    latitude: Option<&'static str>,
    azimuth: bool,
    terms: &'static str,
    /// Combinations asked for.
    asked: &'static [&'static str],
    values: Vec<f64>,
}

fn angle(kind: Angles) -> BoxedStrategy<String> {
    let of = |list: &'static [&'static str]| prop::sample::select(list).prop_map(String::from).boxed();
    match kind {
        Angles::Cardinal => of(&["0", "90", "180", "-90"]),
        Angles::Roots => of(&["0", "90", "-90", "30", "45", "-120", "15", "105"]),
        Angles::Constants => of(&["0", "90", "180", "20", "-20", "110", "35.5"]),
        Angles::Names => of(&["0", "90", "180", "alpha", "-alpha", "alpha+90"]),
        Angles::TwoNames => of(&["0", "90", "alpha", "180-a1"]),
        Angles::Decimals => (-1800..1800i32).prop_map(|x| format!("{}.{}", x / 10, x.abs() % 10)).boxed(),
    }
}

fn draws(kind: Angles, most: usize, turning: &'static [i32]) -> impl Strategy<Value = Draw> {
    let about = prop::sample::select(vec!["X_p", "Y_p", "Z_p", "N", "U", "E"]);
    let turn = move || match turning {
        [] => Just(None).boxed(),
        _ => prop::option::weighted(0.7, (about.clone(), prop::sample::select(turning))).boxed(),
    };
    (
        prop::collection::vec((prop::array::uniform3(angle(kind)), turn()), 1..=most),
        prop::sample::select(vec![Carry::Platform, Carry::Inertial, Carry::Reset]),
        prop::sample::select(vec![None, None, Some("28.2"), Some("-60"), Some("0"), Some("90"), Some("-90")]),
        prop::bool::weighted(0.2),
        prop::sample::select(vec!["F,I,O,S", "F,I,O,S", "F,I", "F,I,O,S,II,SS,IS"]),
        prop::collection::vec(0.2f64..1.0, 64),
    )
        .prop_map(move |(positions, carry, latitude, azimuth, terms, values)| {
            let (angles, turns): (Vec<_>, Vec<_>) = positions.into_iter().unzip();
            // the drift alone is that of one position at rest
            let single = angles.len() == 1 && turns[0].is_none();
            let terms = if single && values[0] < 0.5 { "drift" } else { terms };
            Draw { angles, turns, carry, latitude, azimuth, terms, asked: &[], values }
        })
}

impl Draw {
    /// Names that need quotation marks, and names that do not.
    fn name(&self, i: usize) -> String {
        if self.turns.iter().any(Option::is_some) && i > 0 {
            format!("leg {i}-b")
        } else {
            format!("p{}", i + 1)
        }
    }

    fn scheme(&self) -> Scheme {
        let angles = self.angles.iter().map(|a| parse_attitude(&a.join(",")).expect("an attitude"));
        let mut scheme = Scheme::of_angles(angles);
        for (i, (position, turn)) in scheme.positions.iter_mut().zip(&self.turns).enumerate() {
            position.name = self.name(i);
            position.rotation =
                turn.map(|(about, angle)| Rotation::new(about, &angle.to_string()).expect("a rotation"));
        }
        Scheme {
            carry: match self.carry {
                Carry::Platform => model::Carry::Platform,
                Carry::Inertial => model::Carry::Inertial,
                Carry::Reset => model::Carry::Reset,
            },
            latitude: self.latitude.map(|l| l.parse().expect("a latitude")),
            measured_azimuth: self.azimuth,
            unknowns: self.terms.parse().expect("terms"),
            combinations: self.asked.iter().map(ToString::to_string).collect(),
            ..scheme
        }
    }

    /// Values for all that is unknown, of both signs, none near zero.
    fn case(&self) -> Case {
        self.case_at(&HashMap::from([
            ("alpha".into(), 0.4 + self.values[62]),
            ("a1".into(), -0.3 - self.values[63]),
        ]))
    }

    /// The same with these values for generic angles, in rad.
    fn case_at(&self, names: &HashMap<String, f64>) -> Case {
        let mut values =
            self.values.iter().enumerate().map(|(i, x)| if i % 3 == 0 { -x } else { *x }).cycle();
        let mut next = || values.next().expect("endless");
        let number = |text: &str| -> f64 {
            // a name with a sign, and decimal degrees before or behind it
            let mut total = 0.0;
            let mut rest = text;
            while !rest.is_empty() {
                let end = rest[1..].find(['+', '-']).map_or(rest.len(), |e| e + 1);
                let (part, after) = rest.split_at(end);
                rest = after;
                let (sign, part) = match part.strip_prefix('-') {
                    Some(part) => (-1.0, part),
                    None => (1.0, part.strip_prefix('+').unwrap_or(part)),
                };
                let value = names.get(part).copied();
                total += sign * value.unwrap_or_else(|| part.parse::<f64>().expect("degrees").to_radians());
            }
            total
        };
        let positions = self.angles.iter().enumerate().map(|(i, a)| Position {
            name: self.name(i),
            angles: std::array::from_fn(|k| number(&a[k])),
            turn: self.turns[i].map(|(about, angle)| {
                let axis =
                    ["X_p", "Y_p", "Z_p", "N", "U", "E"].iter().position(|a| *a == about).expect("an axis");
                let rate = f64::from(angle.signum()) * self.values[50 + i];
                Turn { axis: axis % 3, geographic: axis > 2, angle_deg: angle.into(), rate }
            }),
        });
        let positions: Vec<Position> = positions.collect();
        let rates = match self.latitude {
            None => [next().abs(), next()],
            Some(l) => {
                let l: f64 = l.parse::<f64>().expect("degrees").to_radians();
                // a rate that is zero is zero
                let zero = |x: f64| if x.abs() < 1e-15 { 0.0 } else { x };
                [zero(l.cos()), zero(l.sin())]
            }
        };
        let psi = positions.iter().map(|_| std::array::from_fn(|_| next())).collect();
        let mut drift = HashMap::new();
        let terms = if self.terms == "drift" { "F,I,O,S" } else { self.terms };
        for term in terms.split(',') {
            for gyro in ["X", "Y", "Z"] {
                drift.insert(format!("D_{term}{gyro}"), next());
            }
        }
        Case { positions, carry: self.carry, rates, psi, drift, names: names.clone() }
    }
}

/// How many of each kind were checked.
#[derive(Debug, Default)]
struct Seen {
    exact: usize,
    symbolic: usize,
    decimal: usize,
    combinations: usize,
    turning: usize,
    null_vectors: usize,
    formulas: usize,
}

/// One check of a scheme, with all that a failure needs.
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
        // values are near one: what should vanish does so up to rounding
        let size = Value { size: found.size.max(expected.size).max(1e-3), ..found };
        assert!(
            size.is(expected.value, tolerance),
            "{what}: {found:?}, expected {expected:?}\n{}",
            self.about
        );
    }
}

/// The rows of the tables in a LaTeX document whose first cell is a formula, and its lines of null vectors.
fn latex_rows(document: &str) -> Vec<Vec<String>> {
    let rows = document.lines().filter(|l| l.starts_with('$') && l.ends_with("\\\\"));
    rows.map(|l| {
        let cells = l.trim_end_matches("\\\\").split(" & ");
        cells.map(|c| c.trim().trim_matches('$').to_string()).collect()
    })
    .collect()
}

fn list_of(json: &Json, key: &str) -> Vec<Json> {
    json[key].as_array().cloned().unwrap_or_default()
}

/// The stations, as the readers name them: `p1`, `leg 1-b[45]`.
fn stations(json: &Json) -> Vec<String> {
    let name = |s: &Json| {
        let position = s["position"].as_str().expect("a name");
        s["turned_deg"].as_f64().map_or_else(|| position.to_string(), |t| format!("{position}[{t}]"))
    };
    list_of(json, "stations").iter().map(name).collect()
}

/// Everything that is printed about one scheme.
fn check(draw: &Draw, frame: Frame, worker: Option<&mut Worker>, seen: &mut Seen) {
    let (scheme, case) = (draw.scheme(), draw.case());
    let options = Options { seed: 1, solutions: true, formulas: worker.is_some(), frame };
    let a: Analysis = analyze(&scheme, options, worker).expect("analysed");
    let written = |format| obsdeg_report::analysis(&a, format, Layout::default()).expect("written");
    let document = written(Format::Latex);
    let latex = latex_rows(&document);
    let json: Json = serde_json::from_str(&written(Format::Json)).expect("JSON");
    null_vectors(&json, &document, draw, &case, seen);
    if options.formulas {
        position_formulas(&json, &document, draw, &case, seen);
    }
    let csv = written(Format::Csv);
    let csv: Vec<csv::StringRecord> =
        csv::Reader::from_reader(csv.as_bytes()).records().map(|r| r.expect("a record")).collect();
    let (quantities, combinations) = (list_of(&json, "quantities"), list_of(&json, "combinations"));
    assert_eq!((latex.len(), csv.len()), (quantities.len() + combinations.len(), latex.len()));
    let rows = quantities.iter().chain(&combinations).zip(latex).zip(&csv);
    for (i, ((q, latex), csv)) in rows.enumerate() {
        let single = i < quantities.len();
        let left = q[if single { "name" } else { "expression" }].as_str().expect("a text");
        let c = Check { case: &case, about: format!("{left} of {draw:?} in {frame:?}: {q:#}") };
        // for spreadsheets a text that begins with a minus and names what only quotes can has an apostrophe
        let field =
            |i: usize| csv[i].strip_prefix('\'').filter(|f| f.contains('"')).unwrap_or(&csv[i]).to_string();
        assert_eq!(field(1), left);
        let expected = c.text(left);
        c.equal("left side in LaTeX", c.latex(&latex[0]), expected, EXACT);
        if single {
            assert_eq!(tex::name(&latex[0]).as_deref(), Ok(left));
        }
        let Some(solution) = q["solution"].as_object() else {
            // one that nobody could read is left out, and that is said
            let notes = json["notes"].to_string();
            let long =
                notes.contains(&format!("no solution printed for {left}: its longest coefficient has"));
            assert!(q["degree"].is_null() || long, "no solution: {notes}\n{}", c.about);
            continue;
        };
        let printed = solution["text"].as_str().expect("a text");
        assert_eq!(field(csv.len() - 1), printed);
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
        // what is taken while the platform turns says so
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

/// The directions that Z is said not to see move no derivative of it.
fn null_vectors(json: &Json, latex: &str, draw: &Draw, case: &Case, seen: &mut Seen) {
    let lines: Vec<&str> =
        latex.lines().filter_map(|l| l.strip_prefix("\\item not seen by derivatives of $Z$: ")).collect();
    let vectors = json["null_space"].as_array().expect("a list");
    assert_eq!(lines.len(), vectors.len());
    if draw.terms == "drift" {
        return;
    }
    let c = Check { case, about: format!("{vectors:#?} of {draw:?}") };
    for (vector, line) in vectors.iter().zip(lines) {
        let mut moved = case.clone();
        let mut parts = line.split("$, $").map(|part| part.trim_matches('$'));
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

/// The formulas of Z, and of psi and eps at each position.
fn position_formulas(json: &Json, latex: &str, draw: &Draw, case: &Case, seen: &mut Seen) {
    let formulas = json["formulas"].as_array().expect("formulas");
    let lines = latex.lines().filter_map(|l| l.strip_prefix("\\item $")).filter_map(|l| l.split_once(" = "));
    let lines: Vec<(&str, &str)> = lines.collect();
    for (i, f) in formulas.iter().enumerate() {
        let text = |key: &str| f[key].as_str().expect("a text");
        let labels = list_of(json, "stations");
        let own = f["position"]
            .as_str()
            .map(|own| labels.iter().position(|l| l["label"] == own).expect("a station"));
        let stations = stations(json);
        let stations = own.map_or(stations.clone(), |i| vec![stations[i].clone()]);
        for station in stations {
            // at a position, its own psi^n and eps^n
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
            let right = lines[i].1.strip_suffix('$').expect("a formula");
            let v = tex::evaluate(right, &at).unwrap_or_else(|e| panic!("{e}\n{}", c.about));
            c.equal("LaTeX", v, expected, EXACT);
            let left = own.map_or(text("left").into(), |_| format!("{}@{station}", text("left")));
            assert_eq!(tex::name(lines[i].0), Ok(left));
        }
        seen.formulas += 1;
    }
}

/// A scheme of the given attitudes.
fn fixed(angles: &[&str], asked: &'static [&'static str]) -> Draw {
    let of = |a: &&str| -> [String; 3] {
        let parts: Vec<String> = a.split(',').map(String::from).collect();
        parts.try_into().expect("three angles")
    };
    Draw {
        angles: angles.iter().map(of).collect(),
        turns: vec![None; angles.len()],
        carry: Carry::Platform,
        latitude: None,
        azimuth: false,
        terms: "F,I,O,S",
        asked,
        values: (0..64).map(|i| 0.2 + f64::from(i * 37 % 64) / 80.0).collect(),
    }
}

/// Combinations that are asked for may have roots, decimals, sines and cosines in them, with and without the engine.
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
        let mut seen = Seen::default();
        for frame in [Frame::N, Frame::Platform] {
            let generic = angles[0].contains("alpha");
            if generic && worker.is_none() {
                continue;
            }
            check(&draw, frame, worker.as_deref_mut(), &mut seen);
            let a = analyze(&draw.scheme(), Options { frame, ..Options::default() }, None).expect("analysed");
            let verdicts: Vec<_> = a.combinations.iter().filter(|c| c.requested).map(|c| c.degree).collect();
            assert!(verdicts.len() == asked.len() && verdicts.iter().all(Option::is_some), "{verdicts:?}");
        }
    }
}

/// What a coefficient cannot be is refused with what it can be.
#[test]
fn coefficients_that_are_not_known_are_refused() {
    for (text, expected) in [
        (
            "sqrt(5)*D_FX",
            "expected the root of 2, 3 or 6, or of one of these times a square, found that of 5",
        ),
        ("exp(1)*D_FX", "expected sin or cos of an angle, or a square root"),
        ("sin(33 deg)*D_FX", "expected an angle that the scheme has, found `33 deg`"),
        ("sin(alpha)*D_FX", "`alpha` is not known here"),
        ("(wN+wU)*D_FX", "expected coefficients that are numbers times powers of wN and wU"),
        ("D_FX*D_FY", "expected a linear combination of unknowns"),
    ] {
        let scheme = Scheme { combinations: vec![text.into()], ..fixed(&["0,0,0", "20,0,0"], &[]).scheme() };
        let e = analyze(&scheme, Options::default(), None).expect_err("refused").to_string();
        assert!(e.contains(expected), "{text}: {e}");
    }
}

/// Every reported combination can be read: whatever the angles, none of its coefficients is a decimal.
#[test]
fn combinations_can_be_read() {
    for kind in [Angles::Decimals, Angles::Constants, Angles::Roots] {
        for draw in cases(kind, 3, 12, &[]) {
            let a = analyze(&draw.scheme(), Options { solutions: false, ..Options::default() }, None)
                .expect("analysed");
            for c in &a.combinations {
                assert!(
                    !c.expression.contains('.') && !c.expression.contains("combination"),
                    "{} of {draw:?}",
                    c.expression
                );
            }
            // the unknowns in n of a single position have no names of their own in the model
            if draw.terms == "drift" {
                continue;
            }
            // with the unknowns up to each degree, and those before, they span what is observable, and none is too many
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

/// The rank of the derivatives of Z up to an order as functionals of the unknowns.
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

/// The rank of a matrix, by elimination with full pivoting.
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

/// Degenerate angles: at each of the points that are given ranks are what is said, and not beside it.
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
        let options = Options { solutions: false, formulas: true, ..Options::default() };
        let a = analyze(&draw.scheme(), options, Some(&mut *worker)).expect("analysed");
        let loci = a.degenerate_loci.expect("loci");
        assert!(loci.len() > 1, "{:?}", a.notes);
        for l in &loci {
            assert!(l.condition.len() < 250 && !l.points_deg.is_empty(), "{l:?}");
            several += usize::from(!l.complete);
            for point in &l.points_deg {
                let profile_at = |offset: f64| -> Vec<usize> {
                    let names = point.iter().map(|(n, deg)| (n.clone(), deg.to_radians() + offset));
                    let mut values: HashMap<String, f64> =
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

/// Draws `n` cases, the same ones every time.
fn cases(kind: Angles, most: usize, n: usize, turning: &'static [i32]) -> Vec<Draw> {
    let config =
        Config { rng_seed: RngSeed::Fixed(12), rng_algorithm: RngAlgorithm::ChaCha, ..Config::default() };
    let mut runner = TestRunner::new(config);
    (0..n).map(|_| draws(kind, most, turning).new_tree(&mut runner).expect("drawn").current()).collect()
}

/// Combinations that are asked for, without the engine.
#[test]
fn combinations_asked_for() {
    asked(None);
}

/// Without the engine: numbers recovered from the fields, and decimals.
#[test]
fn formulas_without_the_engine_give_the_truth() {
    let mut seen = Seen::default();
    for (kind, most, n, turning) in [
        (Angles::Cardinal, 5, 30, &[] as &[i32]),
        (Angles::Roots, 4, 30, &[]),
        (Angles::Constants, 3, 10, &[]),
        (Angles::Decimals, 4, 10, &[]),
        // stations at multiples of 45 degrees, then at other angles
        (Angles::Cardinal, 2, 12, &[360, -360, 720]),
        (Angles::Roots, 2, 6, &[-360, 240]),
        (Angles::Decimals, 2, 6, &[90, -200, 75]),
    ] {
        for draw in cases(kind, most, n, turning) {
            for frame in [Frame::N, Frame::Platform] {
                check(&draw, frame, None, &mut seen);
            }
        }
    }
    assert!(
        seen.exact > 500 && seen.decimal > 300 && seen.turning > 100 && seen.null_vectors > 100,
        "{seen:?}"
    );
}

/// With it: sines and cosines of names and of constant angles, and the formulas of each position.
#[cfg(feature = "symbolica")]
#[test]
fn formulas_of_the_engine_give_the_truth() {
    let mut worker = Worker::new(obsdeg_symbolic::WorkerConfig {
        program: env!("CARGO_BIN_EXE_obsdeg").into(),
        arguments: vec!["symbolic-worker".into()],
        limit: 60,
        waiting: || {},
    });
    let mut seen = Seen::default();
    for (kind, most, n, turning) in [
        (Angles::Cardinal, 3, 4, &[] as &[i32]),
        (Angles::Roots, 3, 4, &[]),
        (Angles::Constants, 2, 8, &[]),
        (Angles::Names, 2, 10, &[]),
        (Angles::TwoNames, 1, 2, &[]),
        (Angles::Cardinal, 2, 6, &[360, -360]),
    ] {
        for (i, draw) in cases(kind, most, n, turning).iter().enumerate() {
            check(draw, [Frame::N, Frame::Platform][i % 2], Some(&mut worker), &mut seen);
        }
    }
    let turning = Draw { turns: vec![Some(("X_p", 360))], ..fixed(&["alpha,0,0"], &[]) };
    for frame in [Frame::N, Frame::Platform] {
        check(&turning, frame, Some(&mut worker), &mut seen);
    }
    asked(Some(&mut worker));
    degenerate_angles(&mut worker);
    assert!(
        seen.exact > 100
            && seen.symbolic > 50
            && seen.turning > 10
            && seen.null_vectors > 30
            && seen.formulas > 300,
        "{seen:?}"
    );
}

//! Ways to spoil a record, in families: each visible one is refused or flagged with its cause, or does no
//! harm.

use obsdeg_calibration::record::Record;
use obsdeg_calibration::{Calibration, CalibrationError, Options, calibrate};
use obsdeg_core::model::Scheme;
use obsdeg_evidence::simulation::Conditions;

use crate::round_trip::{conditions, errors, scheme, six};
use crate::simulator::{Bench, Sample, csv};

/// Required outcome of a spoiled record.
enum Expected {
    /// Consistent estimate, equal to that of the right record.
    Right,
    /// One of these words in the error, the findings, the outliers or the gaps.
    Says(&'static [&'static str]),
}
use Expected::{Right, Says};

/// Spoiled record: its text, and its scheme and conditions where they are spoiled.
struct Case {
    family: &'static str,
    name: String,
    bytes: Vec<u8>,
    scheme: Scheme,
    conditions: Conditions,
    expected: Expected,
}

struct Cases {
    bench: Bench,
    samples: Vec<Sample>,
    all: Vec<Case>,
}

impl Cases {
    fn text(
        &mut self,
        family: &'static str,
        name: impl ToString,
        bytes: impl Into<Vec<u8>>,
        expected: Expected,
    ) {
        self.all.push(Case {
            family,
            name: name.to_string(),
            bytes: bytes.into(),
            scheme: scheme(&self.bench, "F,I,O,S"),
            conditions: conditions(&self.bench),
            expected,
        });
    }

    fn rows(&mut self, family: &'static str, name: impl ToString, rows: &[Sample], expected: Expected) {
        self.text(family, name, csv(rows), expected);
    }

    /// Adds a case with `of` applied to every sample.
    fn each(
        &mut self,
        family: &'static str,
        name: impl ToString,
        of: impl Fn(usize, &Sample) -> Sample,
        expected: Expected,
    ) {
        let rows: Vec<Sample> = self.samples.iter().enumerate().map(|(k, s)| of(k, s)).collect();
        self.rows(family, name, &rows, expected);
    }

    /// Adds a case with the right record under another scheme or other conditions.
    fn believed(
        &mut self,
        family: &'static str,
        name: impl ToString,
        of: impl FnOnce(&mut Bench),
        expected: Expected,
    ) {
        let mut other = self.bench.clone();
        of(&mut other);
        self.all.push(Case {
            family,
            name: name.to_string(),
            bytes: csv(&self.samples).into_bytes(),
            scheme: scheme(&other, "F,I,O,S"),
            conditions: conditions(&other),
            expected,
        });
    }

    /// Index of the first sample at a position.
    fn first(&self, label: &str) -> usize {
        self.samples.iter().position(|s| s.label == label).expect("there")
    }
}

fn force(s: &Sample, f: [f64; 3]) -> Sample {
    Sample { f, ..s.clone() }
}

fn time(s: &Sample, t: f64) -> Sample {
    Sample { t, ..s.clone() }
}

/// Number between -1 and 1 for each k, by an independent generator (Weyl).
fn between(k: usize, seed: f64) -> f64 {
    2.0 * ((k as f64 + 1.0) * (0.618_033_988_749_895 + seed)).fract() - 1.0
}

const G: f64 = 9.80665;

fn cases() -> Vec<Case> {
    let bench = Bench { seed: 31, slew_deg_s: Some(2.0), ..six() };
    let samples = bench.record();
    let mut c = Cases { bench, samples, all: Vec::new() };
    units(&mut c);
    axes(&mut c);
    labels(&mut c);
    times(&mut c);
    gaps(&mut c);
    cells(&mut c);
    sensors(&mut c);
    beliefs(&mut c);
    encoding(&mut c);
    c.all
}

fn units(c: &mut Cases) {
    for (axis, name) in ["fx", "fy", "fz"].into_iter().enumerate() {
        for (unit, by) in [("m/s^2", G), ("mg", 1e3), ("ug", 1e6)] {
            let of = |_, s: &Sample| {
                let mut f = s.f;
                f[axis] *= by;
                force(s, f)
            };
            c.each("units", format!("{name} in {unit}"), of, Says(&["with the numbers as"]));
        }
    }
    for (unit, by) in [("m/s^2", G), ("mg", 1e3), ("ug", 1e6), ("1/1.4 g", 1.4)] {
        c.each(
            "units",
            format!("all in {unit}"),
            |_, s| force(s, s.f.map(|x| x * by)),
            Says(&["with the numbers as", "no unit of forces"]),
        );
    }
    for (unit, by) in [("ms", 1e3), ("us", 1e6), ("ns", 1e9), ("min", 1.0 / 60.0), ("h", 1.0 / 3600.0)] {
        c.each("units", format!("times in {unit}"), |_, s| time(s, s.t * by), Says(&["they agree"]));
    }
    for unit in ["G", "m/s2", "kg"] {
        let text = csv(&c.samples).replacen("fx [g]", &format!("fx [{unit}]"), 1);
        c.text("units", format!("a header of {unit}"), text, Says(&["expected a unit"]));
    }
    let text = csv(&c.samples).replacen("fx [g]", "fx", 1);
    c.text("units", "no unit", text, Says(&["expected a unit"]));
}

fn axes(c: &mut Cases) {
    for signs in 1..8 {
        let sign = |i: usize| if (signs >> i) & 1 == 1 { -1.0 } else { 1.0 };
        let of = |_, s: &Sample| force(s, std::array::from_fn(|i| sign(i) * s.f[i]));
        c.each("signs", format!("{signs:03b}"), of, Says(&["axes or signs"]));
    }
    for order in [[0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        c.each(
            "axes",
            format!("{order:?}"),
            |_, s| force(s, order.map(|i| s.f[i])),
            Says(&["axes or signs"]),
        );
    }
}

fn labels(c: &mut Cases) {
    let swapped = |s: &Sample, a: &'static str, b: &'static str| Sample {
        label: if s.label == a {
            b
        } else if s.label == b {
            a
        } else {
            s.label
        },
        ..s.clone()
    };
    for (a, b) in [("p2", "p4"), ("p1", "p6"), ("p3", "p5")] {
        c.each("labels", format!("{a} and {b} exchanged"), |_, s| swapped(s, a, b), Says(&["expected p"]));
    }
    for (a, b) in [("p2", "P2"), ("p3", "q")] {
        c.each(
            "labels",
            format!("{a} called {b}"),
            |_, s| swapped(s, a, b),
            Says(&["no position is called"]),
        );
    }
    for label in ["p1", "p3", "p6"] {
        let rows: Vec<Sample> = c.samples.iter().filter(|s| s.label != label).cloned().collect();
        c.rows("labels", format!("no {label}"), &rows, Says(&["expected p", "has no samples"]));
    }
    let all = c.samples.clone();
    for late in [4, 10, 20] {
        let of = |k: usize, s: &Sample| Sample { label: all[k.saturating_sub(late)].label, ..s.clone() };
        c.each("labels", format!("{late} rows late"), of, Says(&["the platform"]));
        let of =
            |k: usize, s: &Sample| Sample { label: all[(k + late).min(all.len() - 1)].label, ..s.clone() };
        c.each("labels", format!("{late} rows early"), of, Says(&["the platform"]));
    }
    let at = c.first("p3") + 30;
    c.each(
        "labels",
        "one row of p3 called p5",
        |k, s| Sample { label: if k == at { "p5" } else { s.label }, ..s.clone() },
        Says(&["expected p"]),
    );
    let names = ["p1", "p2", "p3", "p4", "p5", "p6"];
    c.each(
        "labels",
        "all one further",
        |_, s| Sample {
            label: names.iter().position(|n| *n == s.label).map_or("", |i| names[(i + 1) % 6]),
            ..s.clone()
        },
        Says(&["expected p"]),
    );
}

fn times(c: &mut Cases) {
    for by in [1e-6, -1e-6, 0.01, 0.4, 3.7, -6.0, 1e3, 86_400.0, 1_795_424_400.0] {
        c.each("times", format!("offset {by} s"), |_, s| time(s, s.t + by), Right);
    }
    for rate in [0.003, 0.01, -0.01, 0.03, -0.03] {
        c.each("times", format!("rate {rate}"), |_, s| time(s, s.t * (1.0 + rate)), Says(&["Clock"]));
    }
    for by in [1e-6, 1e-3, 0.02] {
        c.each("times", format!("jitter of {by} s"), |k, s| time(s, s.t + by * between(k, 0.0)), Right);
    }
    for to in [1e-6, 1e-3, 0.05] {
        c.each("times", format!("rounded to {to} s"), |_, s| time(s, (s.t / to).round() * to), Right);
    }
    for wrap in [3600.0, 4_294.967_296, 1000.0] {
        c.each("times", format!("wrapped at {wrap} s"), |_, s| time(s, s.t % wrap), Says(&["is not after"]));
    }
    let mut rows = c.samples.clone();
    rows.swap(100, 101);
    c.rows("order", "two rows exchanged", &rows, Says(&["is not after"]));
    let rows: Vec<Sample> = c.samples.iter().rev().cloned().collect();
    c.rows("order", "backwards", &rows, Says(&["is not after", "expected p"]));
    let mut rows = c.samples.clone();
    rows.insert(50, rows[50].clone());
    c.rows("duplicates", "a row twice", &rows, Says(&["is not after"]));
    let rows: Vec<Sample> = c.samples.iter().chain(&c.samples).cloned().collect();
    c.rows("duplicates", "the record twice", &rows, Says(&["is not after", "expected"]));
    let mut rows = c.samples.clone();
    let again: Vec<Sample> = rows[20..40].to_vec();
    rows.splice(60..60, again);
    c.rows("duplicates", "a block twice", &rows, Says(&["is not after"]));
}

fn gaps(c: &mut Cases) {
    for (label, from, rows) in
        [("p1", 20, 5), ("p2", 0, 20), ("p3", 50, 50), ("p4", 40, 8), ("p5", 80, 20), ("p6", 30, 60)]
    {
        let first = c.first(label) + from;
        let left: Vec<Sample> = c
            .samples
            .iter()
            .enumerate()
            .filter(|(k, _)| !(first..first + rows).contains(k))
            .map(|x| x.1.clone())
            .collect();
        c.rows("gaps", format!("{rows} rows of {label}"), &left, Says(&["Gap {"]));
    }
    for part in [0.1, 0.3, 0.6] {
        let left = c.samples.iter().enumerate().filter(|(k, _)| between(*k, 0.1) > 2.0 * part - 1.0);
        let left: Vec<Sample> = left.map(|x| x.1.clone()).collect();
        c.rows("gaps", format!("{part} of all rows"), &left, Right);
    }
    let left: Vec<Sample> = c.samples.iter().filter(|s| !s.label.is_empty()).cloned().collect();
    c.rows("gaps", "no rows in slews", &left, Right);
}

fn cells(c: &mut Cases) {
    let at = [c.first("p2"), c.first("p4") + 50, c.first("p5") + 99];
    for (axis, &row) in at.iter().enumerate() {
        for by in [0.1, -0.03, 1e-2, 1e-3, 3e-4] {
            let of = |k: usize, s: &Sample| {
                let mut f = s.f;
                f[axis] += if k == row { by } else { 0.0 };
                force(s, f)
            };
            c.each(
                "gross cells",
                format!("row {row}, axis {axis}, {by:+} g"),
                of,
                Says(&["Outlier {", "the platform"]),
            );
        }
        for code in [0.0, -9999.0, 1e30] {
            let of = |k: usize, s: &Sample| {
                let mut f = s.f;
                f[axis] = if k == row { code } else { f[axis] };
                force(s, f)
            };
            c.each("gross cells", format!("row {row}, axis {axis} {code}"), of, Says(&["Outlier {", "Code"]));
            let of = |k: usize, s: &Sample| {
                let mut f = s.f;
                f[axis] = if (at[1] - 30..at[1] - 15).contains(&k) { code } else { f[axis] };
                force(s, f)
            };
            c.each("codes", format!("15 rows of axis {axis} {code}"), of, Says(&["Code"]));
        }
        let of = |k: usize, s: &Sample| {
            let mut f = s.f;
            f[axis] *= if k == at[1] { G } else { 1.0 };
            force(s, f)
        };
        c.each(
            "gross cells",
            format!("axis {axis} in m/s^2"),
            of,
            Says(&["with these numbers as", "Outlier {"]),
        );
        for rows in [6, 20] {
            let held = c.samples[at[1] - 30].f[axis];
            let of = |k: usize, s: &Sample| {
                let mut f = s.f;
                f[axis] = if (at[1] - 30..at[1] - 30 + rows).contains(&k) { held } else { f[axis] };
                force(s, f)
            };
            c.each("stuck", format!("axis {axis} over {rows} rows"), of, Says(&["Stuck"]));
        }
    }
}

fn sensors(c: &mut Cases) {
    const MISFIT: &[&str] = &["Force {", "Position {", "Noise {", "Channel {", "Correlated {"];
    let (half, whole) = (c.samples[c.samples.len() / 2].t, c.samples[c.samples.len() - 1].t);
    for axis in 0..3 {
        let moved = |s: &Sample, by: f64| {
            let mut f = s.f;
            f[axis] += by;
            force(s, f)
        };
        c.each(
            "saturation",
            format!("axis {axis} at 0.7 g"),
            |_, s| {
                let mut f = s.f;
                f[axis] = f[axis].clamp(-0.7, 0.7);
                force(s, f)
            },
            Says(&["Force {", "Stuck", "long", "Code", "saturated"]),
        );
        for by in [1e-3, 1e-4] {
            c.each(
                "steps",
                format!("axis {axis} by {by} g"),
                |_, s| moved(s, if s.t > half { by } else { 0.0 }),
                Says(MISFIT),
            );
            c.each(
                "ramps",
                format!("axis {axis} by {by} g"),
                |_, s| moved(s, by * s.t / whole),
                Says(MISFIT),
            );
            c.each("zeros", format!("axis {axis} by {by} g"), |_, s| moved(s, by), Says(MISFIT));
            c.each("scales", format!("axis {axis} by {by}"), |_, s| moved(s, by * s.f[axis]), Says(MISFIT));
        }
    }
    c.each("scales", "all by 1e-3", |_, s| force(s, s.f.map(|x| 1.001 * x)), Says(&["Force {"]));
    for by in [3.0, 10.0] {
        let bench = Bench { noise_g: 1e-5 * by, ..c.bench.clone() };
        c.rows("noise", format!("{by} times"), &bench.record(), Says(&["Noise {"]));
    }
    let mut walk = [0.0; 3];
    let mut rows = c.samples.clone();
    for (k, s) in rows.iter_mut().enumerate() {
        for (i, x) in walk.iter_mut().enumerate() {
            *x = 0.9 * *x + 6e-6 * between(k, 0.01 + 0.17 * i as f64);
            s.f[i] += *x;
        }
    }
    c.rows("noise", "correlated", &rows, Says(MISFIT));
}

fn beliefs(c: &mut Cases) {
    const RATES: &[&str] = &["Clock {", "Position {", "Noise {"];
    for by in [1.0, 10.0, -56.4] {
        c.believed("latitude", format!("{by:+} deg"), |b| b.latitude_deg += by, Says(RATES));
    }
    for p in [1, 3, 5] {
        for by in [3.0, 10.0, 40.0] {
            let name = format!("p{} by {by} deg", p + 1);
            c.believed(
                "scheme",
                name,
                |b| b.positions[p].1[1] += by,
                Says(&["Position {", "Clock {", "the specific force is", "the slew of the scheme takes"]),
            );
        }
    }
    c.believed("scheme", "two exchanged", |b| b.positions.swap(1, 3), Says(&["expected p"]));
    c.believed("scheme", "one more", |b| b.positions.push(("p7", [1.0, 2.0, 3.0], 1000.0)), Says(&["p7"]));
    for rate in [1.0, 3.0] {
        c.believed(
            "scheme",
            format!("slews of {rate} deg/s"),
            |b| b.slew_deg_s = Some(rate),
            Says(&["Clock {", "Position {", "slew"]),
        );
    }
}

fn encoding(c: &mut Cases) {
    let text = csv(&c.samples);
    let utf16: Vec<u8> =
        [0xfeff_u16].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    c.text("encoding", "UTF-16", utf16, Says(&["UTF-16"]));
    c.text(
        "encoding",
        "Latin-1",
        [b"# M\xfcnchen\n".as_slice(), text.as_bytes()].concat(),
        Says(&["no UTF-8"]),
    );
    c.text("encoding", "CR", text.replace('\n', "\r"), Says(&["CR alone"]));
    c.text("encoding", "NUL", text.replacen("p3", "p\0", 1), Says(&["byte 0x00"]));
    c.text("encoding", "cut off", text[..text.len() - 40].to_string(), Says(&["cells"]));
    c.text("encoding", "a mark of the byte order", format!("\u{feff}{text}"), Right);
    c.text("encoding", "CR LF", text.replace('\n', "\r\n"), Right);
    c.text("encoding", "semicolons", text.replace(',', ";").replace('.', ","), Right);
    c.text("encoding", "tabs", text.replace(',', "\t"), Right);
    c.text("encoding", "NaN", text.replacen(",-0.5", ",NaN", 1), Says(&["finite number", "expected"]));
    c.text("encoding", "words", text.replacen(",p2,", ",p2,x", 1), Says(&["expected a number"]));
}

/// Words of an answer, or of a refusal, and the largest error in sigma.
fn said(bench: &Bench, case: &Case) -> (String, Option<f64>) {
    let read = || -> Result<Calibration, CalibrationError> {
        let record = Record::csv("run.csv", Box::new(std::io::Cursor::new(case.bytes.clone())))?;
        calibrate(&case.scheme, &case.conditions, vec![record], &Options::default(), &|_| true)
    };
    match read() {
        Err(e) => (e.to_string(), None),
        Ok(c) => {
            let worst = errors(bench, &c).into_iter().map(|e| e.1.abs()).fold(0.0, f64::max);
            (
                format!("{:?} {:?} {:?}", c.findings, c.outliers, c.records[0].gaps),
                Some(worst).filter(|_| c.consistent),
            )
        }
    }
}

fn hold(of: impl Iterator<Item = Case>, bench: &Bench) {
    let (mut count, mut bad) = (0, Vec::new());
    for case in of {
        count += 1;
        let (words, worst) = said(bench, &case);
        let named = match case.expected {
            Right => worst.is_some_and(|w| w < 3.5),
            Says(any) => any.iter().any(|w| words.contains(w)),
        };
        // nothing is flagged, and the answer is wrong
        let silent = worst.is_some_and(|w| w > 4.0) && !named;
        if !named || silent {
            let words: String = words.chars().take(400).collect();
            println!(
                "{}: {}: worst {worst:?}{}: {words}",
                case.family,
                case.name,
                if silent { " SILENT" } else { "" }
            );
            bad.push((case.name, silent));
        }
    }
    println!("{count} ways, {} not named", bad.len());
    assert!(bad.iter().all(|b| !b.1), "{bad:?}");
    assert!(20 * bad.len() <= count, "{} of {count}: {bad:?}", bad.len());
}

fn bench() -> Bench {
    Bench { seed: 31, slew_deg_s: Some(2.0), ..six() }
}

/// Some cases of each family.
#[test]
fn some_ways_to_spoil_a_record() {
    hold(cases().into_iter().step_by(19), &bench());
}

/// All cases of all families.
#[test]
#[ignore = "minutes"]
fn all_ways_to_spoil_a_record() {
    let all = cases();
    assert!(all.len() >= 150, "{}", all.len());
    hold(all.into_iter(), &bench());
}

//! Small models with an answer known by other means: closed formulas of least squares, or the same model
//! without indistinguishable unknowns.

use nalgebra::{DMatrix, DVector};
use obsdeg_calibration::record::Record;
use obsdeg_calibration::system::{StatesStart, SystemEstimated, SystemFinding};
use obsdeg_calibration::{
    Before, SystemCalibration, SystemCalibrationError, SystemCalibrationOptions, calibrate_system,
};
use obsdeg_core::system::model_file;
use obsdeg_exact::SplitMix64;

pub(crate) fn options() -> SystemCalibrationOptions {
    SystemCalibrationOptions { starts: 16, profiles: vec![], prior: None, seed: 1 }
}

pub(crate) fn calibrated(
    model: &str,
    text: &str,
    options: &SystemCalibrationOptions,
) -> Result<SystemCalibration, SystemCalibrationError> {
    let record = Record::csv("data.csv", Box::new(std::io::Cursor::new(text.to_string())))?;
    let model = format!("name = \"small\"\n{model}");
    calibrate_system(&model_file::read(&model).expect("a model"), record, options, &|_| true)
}

/// Unit normals (Box-Muller).
pub(crate) fn normals(seed: u64) -> impl FnMut() -> f64 {
    let mut random = SplitMix64::new(seed);
    let mut uniform = move || ((random.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    move || (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
}

pub(crate) fn found<'a>(list: &'a [SystemEstimated], name: &str) -> &'a SystemEstimated {
    list.iter().find(|u| u.name == name).unwrap_or_else(|| panic!("{name}: {list:?}"))
}

const LINE: &str = "[known_inputs]\nx = \"generic\"\n[parameters]\na = {}\nb = {}\n[outputs]\n\
    y = \"a + b*x\"\n[simulation]\nvalues = { a = 1, b = 1 }\n";

/// A straight line with a spike: the spike is named with the distance and scatter by the line through the
/// other points.
#[test]
fn a_spike_does_not_hide_in_its_own_sigma() {
    let mut normal = normals(5);
    for (count, spike, noise) in
        [(20, 20.0, None), (9, -30.0, None), (20, 12.0, Some(0.1)), (20, 15.0, Some(0.05))]
    {
        let mut points: Vec<(f64, f64)> =
            (0..count).map(f64::from).map(|x| (x, 2.0 - 0.3 * x + 0.1 * normal())).collect();
        let at = 6;
        points[at].1 += 0.1 * spike;
        let text: String = std::iter::once("t,x,y\n".to_string())
            .chain(points.iter().enumerate().map(|(k, (x, y))| format!("{k},{x},{y}\n")))
            .collect();
        let model = noise.map_or(LINE.to_string(), |s: f64| format!("{LINE}noise = {{ y = {s} }}\n"));
        let c = calibrated(&model, &text, &options()).expect("calibrated");
        // the other points alone
        let others: Vec<(f64, f64)> =
            points.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, p)| *p).collect();
        let a = DMatrix::from_fn(others.len(), 2, |i, j| if j == 0 { 1.0 } else { others[i].0 });
        let y = DVector::from_iterator(others.len(), others.iter().map(|p| p.1));
        let inverse = (a.transpose() * &a).try_inverse().expect("regular");
        let x = &inverse * a.transpose() * &y;
        let s = ((&y - &a * &x).norm_squared() / (others.len() - 2) as f64).sqrt();
        let own = DVector::from_vec(vec![1.0, points[at].0]);
        let s = noise.map_or(s, |given| s.max(given));
        let t = (points[at].1 - own.dot(&x)) / s / (1.0 + own.dot(&(&inverse * &own))).sqrt();
        let outliers: Vec<_> = c
            .findings
            .iter()
            .filter_map(|f| match f {
                SystemFinding::Outlier { line, sigmas, .. } => Some((*line, *sigmas)),
                _ => None,
            })
            .collect();
        let [(line, sigmas)] = outliers[..] else { panic!("{count} {spike}: {:?}", c.findings) };
        assert_eq!(line, at as u64 + 2);
        assert!((sigmas / t - 1.0).abs() < 1e-4 && t.abs() > 8.0, "{sigmas} {t}");
        assert_eq!(c.consistent, Some(false));
    }
    // three points: one degree of freedom, none for the sigma of the others
    let c = calibrated(LINE, "t,x,y\n0,0,1\n1,1,2\n2,2,9\n", &options()).expect("calibrated");
    assert_eq!((c.outputs[0].outlier_gate, c.outputs[0].degrees_of_freedom.round()), (None, 1.0));
}

/// A scale and a start that are determined only as a product: the product equals the start for a scale of
/// one.
#[test]
fn what_is_not_distinguished_has_its_product() {
    let mut normal = normals(8);
    let line = |k: i32| {
        let t = 0.2 * f64::from(k);
        format!("{t},{}\n", 6.0 * (-0.7 * t).exp() + 0.05 * normal())
    };
    let text: String = std::iter::once("t,y\n".to_string()).chain((0..30).map(line)).collect();
    let model = "[states]\nx = \"-k*x\"\n[parameters]\nk = {}\ns = {}\n[outputs]\ny = \"s*x\"\n[simulation]\n\
        values = { x = 2, k = 1, s = 2 }\nnoise = { y = 0.05 }\n";
    let c = calibrated(model, &text, &options()).expect("calibrated");
    let plain = model.replace("s = {}\n", "").replace("s*x", "x").replace(", s = 2", "");
    let own = calibrated(&plain, &text, &options()).expect("calibrated");
    for name in ["x", "s"] {
        assert_eq!(found(&c.quantities, name).estimate, None);
    }
    let (product, x) = (&c.combinations[0], found(&own.quantities, "x"));
    assert!(
        ["x*s", "s*x"].contains(&product.name.as_str()) && c.combinations.len() == 1,
        "{:?}",
        c.combinations
    );
    let of = |e: &SystemEstimated| (e.estimate.expect("determined"), e.sigma.expect("determined"));
    let ((a, s), (b, t)) = (of(product), of(x));
    assert!((a - b).abs() < 1e-3 * t && (s / t - 1.0).abs() < 1e-3, "{a} {s} {b} {t}");
    assert!((a - 6.0).abs() < 4.0 * s);
    // one solution by the determined combinations: not all starts are needed
    let o = &own.other_starts;
    assert_eq!(own.starts.led + o.near + o.higher + o.unsettled + o.failed, own.starts.tried, "{o:?}");
    assert!(own.starts.tried < 16 && own.starts.led > 6 && own.starts_at_most == 16, "{:?}", own.starts);
}

/// Times and columns in another unit than the model's are converted, or refused with both units. A prior
/// calibration of the same model gives no finding.
#[test]
fn units_of_models() {
    let mut normal = normals(9);
    let rows: Vec<(f64, f64)> =
        (0..20).map(|k| f64::from(k) * 0.5).map(|t| (t, 3.0 * (-0.4 * t).exp() + 0.01 * normal())).collect();
    let text = |unit: &str, by: f64, of: &str, scale: f64| -> String {
        let line = |(t, y): &(f64, f64)| format!("{},{}\n", t * by, y * scale);
        std::iter::once(format!("t{unit},y{of}\n")).chain(rows.iter().map(line)).collect()
    };
    let model = "[states]\nx = { equation = \"-k*x\", unit = \"m/s^2\" }\n[parameters]\n\
        k = { unit = \"1/s\" }\n[outputs]\ny = { expression = \"x\", unit = \"m/s^2\" }\n[simulation]\n\
        values = { x = 2, k = 1 }\nnoise = { y = 0.01 }\n";
    let right = calibrated(model, &text("", 1.0, "", 1.0), &options()).expect("calibrated");
    let k = |c: &SystemCalibration| found(&c.quantities, "k").estimate.expect("determined");
    for (unit, by, of, scale) in [
        (" [s]", 1.0, " [m/s^2]", 1.0),
        (" [min]", 1.0 / 60.0, "", 1.0),
        (" [ms]", 1e3, " [mg]", 1e3 / 9.80665),
    ] {
        let c = calibrated(model, &text(unit, by, of, scale), &options()).expect("calibrated");
        assert!((k(&c) - k(&right)).abs() < 1e-6 * k(&right), "{unit}{of}: {} {}", k(&c), k(&right));
    }
    for (unit, of, words) in [
        (" [a]", "", "line 1, column `t [a]`: expected times in [s], as in the units of the model"),
        ("", " [V]", "line 1, column `y [V]`: expected the unit of the model, [m/s^2], or one of its kind"),
    ] {
        let e = calibrated(model, &text(unit, 1.0, of, 1.0), &options()).expect_err("refused").to_string();
        assert!(e.contains(words), "{e}");
    }
    let before = Before {
        priors: Vec::new(),
        estimates: right.covariance.clone(),
        rests_on: right.rests_on.clone(),
        of: right.model.clone(),
    };
    let options = SystemCalibrationOptions { prior: Some(before), ..options() };
    let e = calibrated(model, &text("", 1.0, "", 1.0), &options).expect_err("known").to_string();
    assert!(e.contains("which the calibration before rests on, of the same model"), "{e}");
    // a calibration of another model counts, with a finding
    let other = model.replace("-k*x", "-k*x*1");
    assert!(calibrated(&other, &text("", 1.0, "", 1.0), &options).expect("calibrated").shared);
}

const DOSES: &str = "[constants]\nD = { value = 100 }\n[states]\nA = \"-k*A\"\n[parameters]\nk = {}\nV = {}\n\
    [outputs]\ny = \"A/V\"\n[[segment]]\n[[segment]]\ncarry = { A = \"A + D\" }\n[[segment]]\n\
    carry = { A = \"A + D/2\" }\n[simulation]\nvalues = { A = 50, k = 0.2, V = 8 }\nnoise = { y = 0.05 }\n";

/// Doses at times stated in the record: the rest of the first dose is unknown, and the volume follows from
/// the jumps of the next doses, whose sizes are known.
#[test]
fn segments_begin_with_their_first_rows() {
    let (start, k, v, jumps) = (70.0, 0.13, 12.0, [(6.0, 100.0), (11.5, 50.0)]);
    let mut normal = normals(8);
    let mut text = "t,segment,y\n".to_string();
    let mut times: Vec<f64> = (0..60).map(|i| 0.3 * f64::from(i)).collect();
    // a row with only the time of a jump
    times.push(11.5);
    times.sort_by(f64::total_cmp);
    times.dedup();
    for t in times {
        let after = |(at, dose): &(f64, f64)| if t >= *at { dose * (-k * (t - at)).exp() } else { 0.0 };
        let amount = start * (-k * t).exp() + jumps.iter().map(after).sum::<f64>();
        let segment = 1 + jumps.iter().filter(|(at, _)| t >= *at).count();
        let y = if t == 11.5 { String::new() } else { (amount / v + 0.05 * normal()).to_string() };
        text += &format!("{t},{segment},{y}\n");
    }
    let c = calibrated(DOSES, &text, &options()).expect("calibrated");
    assert_eq!(c.consistent, Some(true), "{:?}", c.findings);
    for (name, truth) in [("A", start), ("k", k), ("V", v)] {
        let u = found(&c.quantities, name);
        let (x, s) = (u.estimate.expect(name), u.sigma.expect(name));
        assert!((x - truth).abs() < 3.5 * s && s < 0.05 * truth, "{name}: {x} +- {s}");
    }
    // without the jumps only amount over volume is determined, whatever segments there could be
    let early: String =
        text.lines().filter(|l| !l.contains(",2,") && !l.contains(",3,")).map(|l| format!("{l}\n")).collect();
    let c = calibrated(DOSES, &early, &options()).expect("calibrated");
    assert!(found(&c.quantities, "k").determined && !found(&c.quantities, "V").determined);
    let once = DOSES.replace(
        "[[segment]]\n[[segment]]\ncarry = { A = \"A + D\" }\n[[segment]]\ncarry = { A = \"A + D/2\" }\n",
        "",
    );
    let same = calibrated(&once, &early, &options()).expect("calibrated");
    assert!(same.ignored.is_empty() && found(&same.quantities, "V").estimate.is_none());
    assert!((same.chi_square / c.chi_square - 1.0).abs() < 1e-6, "{} {}", same.chi_square, c.chi_square);
    let e = calibrated(&once, &text, &options()).expect_err("segments").to_string();
    assert!(e.contains("column `segment`: found 2, expected 1: the model has no more segments"), "{e}");
    for (from, to, message) in [
        (
            "t,segment,y",
            "t,part,y",
            "data.csv: no column `segment` (1, 2, ...: it begins with its first row)",
        ),
        (
            "\n0.6,1,",
            "\n0.6,3,",
            "line 4, column `segment`: found 3, expected 1 or 2 (every segment has a row at least)",
        ),
        (
            "\n0,1,",
            "\n0,2,",
            "line 2, column `segment`: found 2, expected 1: every segment has a row at least",
        ),
        ("\n0.6,1,", "\n0.6,1.5,", "column `segment`: found 1.5, expected 1 or 2"),
        ("\n6.6,2,", "\n6.6,1,", "column `segment`: found 1, expected 2 or 3"),
        ("\n6.6,2,", "\n6.6,,", "column `segment`: found nothing, expected 2 or 3"),
        ("\n13.5,3,", "\n13.5,4,", "column `segment`: found 4, expected 3: the model has no more segments"),
    ] {
        assert!(text.contains(from), "{from}");
        let e = calibrated(DOSES, &text.replacen(from, to, 1), &options()).expect_err(to).to_string();
        assert!(e.contains(message), "{message}: {e}");
    }
}

/// Two patients with their own times of doses and initial amounts, and one volume: rows of one among those of
/// the other, or behind them.
#[test]
fn experiments_have_segments_of_their_own() {
    let (k, v) = (0.13, 12.0);
    let mut normal = normals(21);
    let mut lines = Vec::new();
    for i in 0..40 {
        for (experiment, start, at) in [(1, 70.0, 6.0), (2, 20.0, 3.1)] {
            let t = 0.3 * f64::from(i);
            let jump = if t >= at { 100.0 * (-k * (t - at)).exp() } else { 0.0 };
            let y = (start * (-k * t).exp() + jump) / v + 0.05 * normal();
            // the dose is at the first row behind it
            let segment = if t >= at { 2 } else { 1 };
            lines.push((experiment, format!("{t},{experiment},{segment},{y}\n")));
            if t < at && t + 0.3 > at && (at / 0.3).fract() > 1e-9 {
                lines.push((experiment, format!("{at},{experiment},2,\n")));
            }
        }
    }
    let text = |lines: &[(i32, String)]| -> String {
        std::iter::once("t,experiment,segment,y\n").chain(lines.iter().map(|l| l.1.as_str())).collect()
    };
    let model =
        format!("experiments = 2\n{}", DOSES.replace("[[segment]]\ncarry = { A = \"A + D/2\" }\n", ""));
    let c = calibrated(&model, &text(&lines), &options()).expect("calibrated");
    assert_eq!(c.consistent, Some(true), "{:?}", c.findings);
    for (name, truth) in [("A@1", 70.0), ("A@2", 20.0), ("k", k), ("V", v)] {
        let u = found(&c.quantities, name);
        let (x, s) = (u.estimate.expect(name), u.sigma.expect(name));
        assert!((x - truth).abs() < 3.5 * s && s < 0.05 * truth, "{name}: {x} +- {s}");
    }
    let mut sorted = lines.clone();
    sorted.sort_by_key(|l| l.0);
    let other = calibrated(&model, &text(&sorted), &options()).expect("calibrated");
    assert_eq!(c.quantities, other.quantities);
    // an experiment continues behind another's rows, and its time does not go back
    sorted.push((1, "5,1,2,3\n".into()));
    let e = calibrated(&model, &text(&sorted), &options()).expect_err("back").to_string();
    assert!(
        e.contains("column `t`: found 5, expected a time after 11.7, which experiment 1 has reached"),
        "{e}"
    );
}

/// Times of another clock are converted; endless work is refused before it begins.
#[test]
fn times_of_another_clock() {
    const DECAY: &str = "states = { x = '-k*x' }\nparameters = ['k']\noutputs = { z = 'x' }\n[simulation]\n\
        values = { x = 1, k = 1 }\nstep = 0.1\nnoise = { z = 0.001 }";
    let rows = |head: &str, time: &dyn Fn(f64) -> String| {
        let mut normal = normals(3);
        let of = |i: u32| {
            let t = 0.1 * f64::from(i);
            format!("{},{}\n", time(t), 2.0 * (-0.5 * t).exp() + 1e-3 * normal())
        };
        (0..100).map(of).fold(format!("{head},z\n"), |all: String, row| all + row.as_str())
    };
    let own = calibrated(DECAY, &rows("t", &|t| t.to_string()), &options()).expect("calibrated");
    let of =
        |c: &SystemCalibration| ["k", "x"].map(|n| found(&c.quantities, n).estimate.expect("determined"));
    let [k, x] = of(&own);
    assert!((k - 0.5).abs() < 2e-3 && (x - 2.0).abs() < 2e-3 && own.begins.is_none(), "{k} {x}");
    let date = |t: f64| format!("2026-11-23T09:00:{t:07.4}Z");
    for (text, begins) in [
        (rows("t", &|t| (t + 1e5).to_string()), 1e5),
        (rows("t", &|t| (t + 150.0).to_string()), 150.0),
        (rows("t", &|t| (t + 15.0).to_string()), 15.0),
        (rows("t", &|t| format!("{:.4}", t + 1_795_424_400.0)), 1_795_424_400.0),
        (rows("t", &date), 1_795_424_400.0),
    ] {
        let c = calibrated(DECAY, &text, &options()).expect("calibrated");
        for (a, b) in of(&c).iter().zip([k, x]) {
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
        assert_eq!(c.begins, Some(begins));
    }
    // milliseconds where the model has seconds, and a known start long before the record
    let known = DECAY.replace("x = '-k*x'", "x = { equation = '-k*x', initial = 2 }");
    assert_ne!(known, DECAY);
    let long_before = rows("t", &|t| (t + 90.0).to_string());
    for (model, text) in [(DECAY, rows("t", &|t| (1e3 * t).to_string())), (&known, long_before)] {
        let e = calibrated(&model.replace("step = 0.1", "step = 0.001"), &text, &options());
        let e = e.err().map(|e| e.to_string()).expect("refused");
        assert!(e.contains("steps of integration of at most 0.001; expected at most 55000"), "{e}");
    }
}

/// A function of the time has the time of the record, wherever the states start: x = 3 at the first row, k =
/// 0.5, a = 2, by the closed formula of x' = -k x + a exp(-0.02 t).
#[test]
fn functions_have_the_time_of_the_record() {
    const DRIVEN: &str = "time = 0\nstates = { x = '-k*x + a*u' }\nparameters = ['k', 'a']\n\
        outputs = { z = 'x' }\nknown_inputs = { u = { function = 'exp(-0.02*t)' } }\n[simulation]\n\
        values = { x = 1, k = 1, a = 1 }\nstep = 0.1\nnoise = { z = 0.001 }";
    let known = DRIVEN.replace("x = '-k*x + a*u'", "x = { equation = '-k*x + a*u', initial = 3 }");
    let record = |begin: f64| {
        let mut normal = normals(5);
        (0..100).fold("t,z\n".to_string(), |all, i| {
            let s = 0.1 * f64::from(i);
            let driven = |t: f64| 2.0 / 0.48 * (-0.02 * t).exp();
            let x = driven(begin + s) + (3.0 - driven(begin)) * (-0.5 * s).exp();
            format!("{all}{},{}\n", begin + s, x + 1e-3 * normal())
        })
    };
    let of = |c: &SystemCalibration, names: &[&str]| -> Vec<f64> {
        names.iter().map(|n| found(&c.quantities, n).estimate.unwrap_or(f64::NAN)).collect()
    };
    let at = |time: &str, model: &str| model.replace("time = 0", &format!("time = {time}"));
    for (model, begin, rule) in [
        (DRIVEN.to_string(), 12.0, StatesStart::FarRows),
        (DRIVEN.to_string(), 60.0, StatesStart::FarRows),
        (at("60", DRIVEN), 60.0, StatesStart::Model),
        (at("'generic'", DRIVEN), 3.0, StatesStart::Rows),
        (at("60", &known), 60.0, StatesStart::Model),
        (at("'generic'", &known), 60.0, StatesStart::Rows),
    ] {
        let c = calibrated(&model, &record(begin), &options()).expect("calibrated");
        let free = model.contains("x = '-k*x");
        let right = if free { [0.5, 2.0, 3.0].as_slice() } else { &[0.5, 2.0] };
        for (name, (x, right)) in
            ["k", "a", "x"].iter().zip(of(&c, &["k", "a", "x"][..right.len()]).iter().zip(right))
        {
            let sigma = found(&c.quantities, name).sigma.expect("determined");
            assert!((x - right).abs() < 4.0 * sigma, "{begin} {rule:?} {name}: {x} +- {sigma}");
        }
        assert_eq!((c.begins, c.states_start, c.before_first_row), (Some(begin), rule, None));
        assert_eq!(c.consistent, Some(true), "{:?}", c.findings);
        assert!(c.residuals[0].t == begin, "{}", c.residuals[0].t);
    }
    // a known start at 0 is taken at its word, and what lies between is said
    let c = calibrated(&known, &record(12.0), &options()).expect("calibrated");
    assert_eq!(
        (c.begins, c.before_first_row, c.consistent),
        (None, Some(12.0), Some(false)),
        "{:?}",
        c.findings
    );
    let early = calibrated(&at("60", &known), &record(59.0), &options()).map_err(|e| e.to_string());
    assert!(
        early.is_err_and(
            |e| e.contains("found 59, expected a time from 60, where the run of the model begins")
        )
    );
}

//! Constraints of models: compared with the same models with one unknown fewer, and closed formulas of least
//! squares.

use nalgebra::{DMatrix, DVector};
use obsdeg_calibration::system::ProfilePoint;
use obsdeg_calibration::system::SystemEstimated;
use obsdeg_calibration::{Before, SystemCalibrationOptions};

use crate::models::{calibrated, found, normals, options};

/// Measurements, for `rows`, of a direction at an angle of 0.7 and a gain of 3.
fn turned(rows: std::ops::Range<i32>) -> String {
    let (angle, gain): (f64, f64) = (0.7, 3.0);
    let mut normal = normals(12);
    let mut text = "t,u,y,z\n".to_string();
    for i in 0..rows.end {
        let u = f64::from(i) / 7.0;
        let (y, z) = (gain * angle.cos() * u.cos() + angle.sin(), gain * angle.sin() * u.sin());
        let line = format!("{i},{u},{},{}\n", y + 0.02 * normal(), z + 0.02 * normal());
        text += if rows.contains(&i) { &line } else { "" };
    }
    text
}

/// Model of these measurements with the direction `cos`, `sin`.
fn direction(unknowns: &str, cos: &str, sin: &str, values: &str) -> String {
    format!(
        "{unknowns}\n[known_inputs]\nu = \"generic\"\n[outputs]\ny = \"k*{cos}*cos(u) + {sin}\"\n\
         z = \"k*{sin}*sin(u)\"\n[simulation]\nvalues = {{ k = 2.5, {values} }}\nnoise = {{ y = 0.02, z = 0.02 }}\n"
    )
}

/// Model with the direction as two unknowns with constraints.
fn bound(constraints: &str, values: &str) -> String {
    direction(
        &format!("constraints = [{constraints}]\n[parameters]\nk = {{}}\nc = {{}}\ns = {{}}"),
        "c",
        "s",
        values,
    )
}

const UNIT: &str = "\"c^2 + s^2 = 1\"";

/// Model with the direction as an angle.
fn free() -> String {
    direction("[parameters]\nk = {}\na = {}", "cos(a)", "sin(a)", "a = 0.6435")
}

fn of(list: &[SystemEstimated], name: &str) -> (f64, f64, f64) {
    let u = found(list, name);
    (u.estimate.expect(name), u.sigma.expect(name), u.sigma_rescaled.expect(name))
}

/// A direction of unit length, as two unknowns with a constraint and as an angle, has the same estimates,
/// sigmas and degrees of freedom, from any start.
#[test]
fn constraints_are_an_unknown_less() {
    let text = turned(0..40);
    for (constraints, values) in [
        (UNIT, "c = 0.8, s = 0.6"),
        // starts at which no constraint holds, or none has a slope
        (UNIT, "c = 0.1, s = 0.1"),
        (UNIT, "c = -5, s = 100"),
        (UNIT, "c = 0, s = 0"),
        // the same constraint twice, and once more as a quotient
        ("\"c^2 + s^2 = 1\", \"3*c^2 + 3*s^2 = 3\", \"s^2 = (1 - c)*(1 + c)\"", "c = 0.6, s = 0.6"),
    ] {
        as_an_angle(&bound(constraints, values), &text);
    }
}

fn as_an_angle(bound: &str, text: &str) {
    let [bound, free] = [bound, &free()].map(|m| calibrated(m, text, &options()).expect("calibrated"));
    assert_eq!(
        (bound.consistent, bound.degrees_of_freedom),
        (Some(true), free.degrees_of_freedom),
        "{:?}",
        bound.findings
    );
    assert!(
        (bound.chi_square / free.chi_square - 1.0).abs() < 1e-6,
        "{} {}",
        bound.chi_square,
        free.chi_square
    );
    let (a, sigma, rescaled) = of(&free.quantities, "a");
    let (k, of_k, _) = of(&free.quantities, "k");
    for (name, value, sigma, rescaled) in [
        ("c", a.cos(), a.sin().abs() * sigma, a.sin().abs() * rescaled),
        ("s", a.sin(), a.cos().abs() * sigma, a.cos().abs() * rescaled),
    ] {
        let (x, s, r) = of(&bound.quantities, name);
        assert!((x - value).abs() < 1e-3 * sigma, "{name}: {x} {value}");
        assert!((s / sigma - 1.0).abs() < 1e-3 && (r / rescaled - 1.0).abs() < 1e-3, "{name}: {s} {sigma}");
    }
    let (x, s, _) = of(&bound.quantities, "k");
    assert!((x - k).abs() < 1e-3 * s && (s / of_k - 1.0).abs() < 1e-3, "{x} {k}");
    let [(c, ..), (s, ..)] = ["c", "s"].map(|n| of(&bound.quantities, n));
    assert!((c * c + s * s - 1.0).abs() < 1e-12, "{c} {s}");
}

/// Two masses with a known sum, far smaller than one and with a far smaller sigma: measured apart and
/// together, in closed form.
#[test]
fn a_sum_that_is_known() {
    let mut normal = normals(3);
    let (a, b, sigma) = (2e-6, 1e-6, 1e-10);
    let data: Vec<[f64; 2]> = (0..12).map(|_| [a + sigma * normal(), b + sigma * normal()]).collect();
    let text: String = std::iter::once("t,y,z\n".into())
        .chain(data.iter().enumerate().map(|(i, [y, z])| format!("{i},{y:e},{z:e}\n")))
        .collect();
    let model = |constraints: &str| {
        format!(
            "constraints = [{constraints}]\n[parameters]\na = {{}}\nb = {{}}\n[outputs]\ny = \"a\"\n\
             z = \"b\"\n[simulation]\nvalues = {{ a = 1e-6, b = 1e-7 }}\nnoise = {{ y = 1e-10, z = 1e-10 }}\n"
        )
    };
    let c = calibrated(&model("\"a + b = 0.000003\""), &text, &options()).expect("calibrated");
    let mean = data.iter().map(|[y, z]| y + 3e-6 - z).sum::<f64>() / 24.0;
    let (x, s, _) = of(&c.quantities, "a");
    let expected = sigma / 24f64.sqrt();
    assert!(
        (x - mean).abs() < 1e-3 * expected && (s / expected - 1.0).abs() < 1e-6,
        "{x} {mean} {s} {expected}"
    );
    assert_eq!((c.consistent, c.degrees_of_freedom), (Some(true), 23));
    // fully known: nothing is estimated, and nothing moves
    let both = model("\"a + b = 0.000003\", \"a = 2*b\"");
    let c = calibrated(&both, &text, &SystemCalibrationOptions { profiles: vec!["a".into()], ..options() })
        .expect("calibrated");
    let (x, s, _) = of(&c.quantities, "a");
    assert!((x / 2e-6 - 1.0).abs() < 1e-9 && s == 0.0, "{x} {s}");
    assert_eq!((c.degrees_of_freedom, c.profiles[0].points.len(), c.profiles[0].flat), (24, 1, false));
}

/// A constraint that holds nowhere, or has no slope where it holds, is refused by name.
#[test]
fn constraints_that_cannot_be_met() {
    let refused = |model: &str, text: &str, message: &str| {
        let e = calibrated(model, text, &options()).expect_err(model).to_string();
        assert!(e.contains(message), "{model}: {e}");
    };
    let rational = |constraints: &str| {
        bound(constraints, "c = 0.8, s = 0.6").replace("cos(u)", "u").replace("sin(u)", "u")
    };
    let text = turned(0..10);
    for (constraints, message) in [
        (
            "\"c^2 + s^2 = -1\"",
            "the constraint c^2 + s^2 = -1: no real point meets it: its left side minus its right side is \
             positive everywhere",
        ),
        ("\"c = 0.5\", \"c = 0.6\"", "no real point was found at which it holds together with the others"),
        (
            "\"(c - s)^2 = 0\"",
            "the constraint (c - s)^2 = 0: its left side minus its right side is never negative: where it \
             holds, if anywhere, its gradient",
        ),
    ] {
        refused(&rational(constraints), &text, message);
    }
    // a known start that satisfies the constraint, or does not
    let known = |x: f64| {
        format!(
            "constraints = [\"x^2 + v^2 = 4\", \"x = 1\"]\n[states]\n\
             x = {{ equation = \"v\", initial = \"known\" }}\nv = \"0\"\n[outputs]\ny = \"x\"\n[simulation]\n\
             values = {{ x = {x}, v = 1 }}\nnoise = {{ y = 0.1 }}\n"
        )
    };
    let text = "t,y\n0,1\n1,2.7\n2,4.5\n";
    refused(&known(1.5), text, "the constraint x = 1 does not hold anywhere near one of 16 starts");
    let c = calibrated(&known(1.0), text, &options()).expect("calibrated");
    assert!((of(&c.quantities, "v").0 - 3f64.sqrt()).abs() < 1e-9 && c.degrees_of_freedom == 3);
}

/// Parameters common to two experiments are constrained once, states at the start of each once each.
#[test]
fn experiments_do_not_count_twice() {
    let mut normal = normals(31);
    let (mut text, mut squares) = ("t,experiment,y,z\n".to_string(), 0.0);
    for experiment in 1..=2 {
        for i in 0..20 {
            let t = f64::from(i) / 10.0;
            let (y, z) = (0.01 * normal(), 0.01 * normal());
            squares += 1.0;
            text += &format!(
                "{t},{experiment},{},{}\n",
                (-0.4 * t).exp() * f64::from(experiment) + y,
                (-0.6 * t).exp() * (3.0 - f64::from(experiment)) + z
            );
        }
    }
    let model = "experiments = 2\nconstraints = [\"x + v = 3\", \"p + q = 1\"]\n[states]\nx = \"-p*x\"\n\
        v = \"-q*v\"\n[parameters]\np = {}\nq = {}\n[outputs]\ny = \"x\"\nz = \"v\"\n[simulation]\n\
        values = { x = 1, v = 1, p = 0.5, q = 0.5 }\nnoise = { y = 0.01, z = 0.01 }\n";
    let c = calibrated(model, &text, &options()).expect("calibrated");
    assert_eq!(
        (c.consistent, c.degrees_of_freedom),
        (Some(true), 2 * squares as usize - 3),
        "{:?}",
        c.findings
    );
    for (name, truth) in [("x@1", 1.0), ("v@1", 2.0), ("x@2", 2.0), ("v@2", 1.0), ("p", 0.4), ("q", 0.6)] {
        let (x, s, _) = of(&c.quantities, name);
        assert!((x - truth).abs() < 3.5 * s && s < 0.02, "{name}: {x} +- {s}");
    }
    let sigma = |name: &str| of(&c.quantities, name).1;
    assert!((sigma("p") / sigma("q") - 1.0).abs() < 1e-9 && (sigma("x@1") / sigma("v@1") - 1.0).abs() < 1e-9);
}

/// Profile along a circle: chi-square at values of an unknown is that of the angle there, with all others
/// fitted. Another solution lies beyond the end of the circle.
#[test]
fn profiles_and_other_solutions_keep_to_constraints() {
    let mut normal = normals(41);
    let (mut text, mut sum, mut squares) = ("t,u,y\n".to_string(), [0.0; 2], 0.0);
    for i in 0..30 {
        let u = 1.0 + f64::from(i) / 10.0;
        let y = 0.6 * u + 0.2 * normal();
        (sum[0], sum[1], squares) = (sum[0] + u * u, sum[1] + u * y, squares + y * y);
        text += &format!("{i},{u},{y}\n");
    }
    let model = "constraints = [\"c^2 + s^2 = 1\"]\n[known_inputs]\nu = \"generic\"\n[parameters]\nc = {}\n\
        s = {}\n[outputs]\ny = \"s*u\"\n[simulation]\nvalues = { c = 0.9, s = 0.3 }\nnoise = { y = 0.2 }\n";
    let asked = SystemCalibrationOptions { profiles: vec!["c".into()], ..options() };
    let c = calibrated(model, &text, &asked).expect("calibrated");
    let chi = |s: f64| (squares - 2.0 * s * sum[1] + s * s * sum[0]) / 0.04;
    let s = sum[1] / sum[0];
    let cos = of(&c.quantities, "c").0;
    assert!((of(&c.quantities, "s").0 - s).abs() < 1e-6 && (cos.abs() - (1.0 - s * s).sqrt()).abs() < 1e-6);
    assert!((c.chi_square / chi(s) - 1.0).abs() < 1e-9);
    let points = &c.profiles[0].points;
    assert_eq!((points.len(), c.profiles[0].flat), (9, false));
    for ProfilePoint { value: x, rise: more } in points {
        let expected = chi((1.0 - x * x).sqrt()) - chi(s);
        assert!((more - expected).abs() < 1e-4 * (1.0 + expected), "{x}: {more} {expected}");
    }
    assert!(points.iter().any(|p| p.rise > 5.0));
    let [other] = &c.others[..] else { panic!("{:?}", c.others) };
    assert!((other.values[0] + cos).abs() < 1e-6 && (other.values[1] - s).abs() < 1e-6, "{other:?}");
}

/// Half of the data, then the other half with the first as prior: the result equals that of all data at once,
/// and that with an angle. For a model without the constraint, a direction fixed by it carries no
/// information.
#[test]
fn what_was_known_before_keeps_to_constraints() {
    let (first, second) = (turned(0..5), turned(5..40));
    let model = bound(UNIT, "c = 0.8, s = 0.6");
    let c = calibrated(&model, &first, &options()).expect("calibrated");
    let before = Before {
        priors: Vec::new(),
        estimates: c.covariance.clone(),
        rests_on: c.rests_on.clone(),
        of: c.model.clone(),
    };
    let known = SystemCalibrationOptions { prior: Some(before), ..options() };
    let both = calibrated(&model, &second, &known).expect("calibrated");
    let all = calibrated(&model, &turned(0..40), &options()).expect("calibrated");
    assert_eq!((both.degrees_of_freedom, both.consistent), (73 - 3 + 1, Some(true)));
    for name in ["k", "c", "s"] {
        let ((x, s, _), (y, t, _), (_, first, _)) =
            (of(&both.quantities, name), of(&all.quantities, name), of(&c.quantities, name));
        assert!((x - y).abs() < 0.02 * t && (s / t - 1.0).abs() < 0.02, "{name}: {x} {y} {s} {t}");
        assert!(first > 1.5 * t, "{name}: nothing to say");
    }
    let without = bound("", "c = 0.8, s = 0.6");
    let e = calibrated(&without, &second, &known).expect_err("held").to_string();
    assert!(e.contains("the prior calibration knows k, c, s as constraints make them"), "{e}");
}

/// Three unknowns with two constraints, partly known before: the rows of constraints differ from the
/// conditions on single unknowns.
#[test]
fn what_was_known_of_some_is_as_it_was() {
    let mut normal = normals(51);
    let (mut text, mut rows) = ("t,y\n".to_string(), Vec::new());
    for i in 0..10 {
        let y = 1.3 + 0.1 * normal();
        rows.push(y);
        text += &format!("{i},{y}\n");
    }
    // a and b were known, with a correlation; a + b + c = 4 and c is measured
    let model = "constraints = [\"a + b + c = 4\"]\n[parameters]\na = {}\nb = {}\nc = {}\n[outputs]\n\
        y = \"c + 0*a + 0*b\"\n[simulation]\nnoise = { y = 0.1 }\n";
    let plain = "[parameters]\na = {}\nb = {}\n[outputs]\ny = \"a\"\nz = \"b\"\n[simulation]\n\
        noise = { y = 0.3, z = 0.4 }\n";
    let c = calibrated(plain, "t,y,z\n0,1.1,1.5\n1,1.2,1.4\n", &options()).expect("calibrated");
    let mut estimates = c.covariance.clone();
    estimates.covariance[0][1] = 0.03;
    estimates.covariance[1][0] = 0.03;
    let p = DMatrix::from_fn(2, 2, |i, j| estimates.covariance[i][j]);
    let mean = DVector::from_column_slice(&estimates.estimates);
    let before = Before { priors: Vec::new(), estimates, rests_on: c.rests_on.clone(), of: c.model };
    let known = SystemCalibrationOptions { prior: Some(before), ..options() };
    let c = calibrated(model, &text, &known).expect("calibrated");
    // normal equations for a and b alone
    let ones = DMatrix::from_element(10, 2, -1.0);
    let w = p.try_inverse().expect("regular");
    let information = &w + ones.transpose() * &ones * 100.0;
    let y = DVector::from_iterator(10, rows.iter().map(|y| y - 4.0));
    let inverse = information.try_inverse().expect("regular");
    let x = &inverse * (w * mean + ones.transpose() * y * 100.0);
    // an unknown that the model does not determine stays undetermined, whatever the prior
    assert!(!found(&c.quantities, "a").determined);
    let (e, s, _) = of(&c.quantities, "c");
    assert!((e - 4.0 + x.sum()).abs() < 1e-6 && (s - inverse.sum().sqrt()).abs() < 1e-6, "{e} {s} {x}");
}

//! Explanations against the simulated motion: the deciding derivatives determine the unknown, and none of
//! them can be left out. Along the unseen direction no derivative up to the stated order changes, and the
//! listed derivatives of the next order do.

use nalgebra::DVector;
use obsdeg_core::analysis::{AnalysisOptions, analyze, explain};
use obsdeg_core::why::{OutputDerivative, Why};

use super::draw::{Angles, RandomScheme, cases};
use super::platform::Case;
use super::text::{self, READINGS};

/// Singular values below this, of rows whose entries are near one, are zero.
const ZERO: f64 = 1e-8;

/// The change of a derivative of Z per unit of every unknown.
fn row(case: &Case, names: &[String], d: &OutputDerivative) -> DVector<f64> {
    let silent = case.silent();
    let name = format!("{}{}@{}", d.output, "'".repeat(d.order), d.place.as_deref().expect("a position"));
    let change = |unknown: &String| {
        let mut moved = silent.clone();
        assert!(moved.change(unknown, 1.0), "{unknown}");
        moved.value(&name).unwrap_or_else(|| panic!("{name}"))
    };
    DVector::from_iterator(names.len(), names.iter().map(change))
}

/// Distance of the unit vector of an unknown from the span of rows.
fn distance(rows: &[DVector<f64>], column: usize, columns: usize) -> f64 {
    let unit = DVector::from_fn(columns, |c, _| f64::from(u8::from(c == column)));
    let mut basis: Vec<DVector<f64>> = Vec::new();
    // twice, since one pass loses digits where rows are nearly dependent
    let rest = |v: &DVector<f64>, basis: &[DVector<f64>]| {
        let once = |v: DVector<f64>| basis.iter().fold(v, |rest, b| &rest - b * b.dot(&rest));
        once(once(v.clone()))
    };
    for row in rows {
        let own = rest(&row.normalize(), &basis);
        if own.norm() > ZERO {
            basis.push(own.normalize());
        }
    }
    rest(&unit, &basis).norm()
}

fn check(draw: &RandomScheme, why: &Why, names: &[String]) -> usize {
    let case = draw.case();
    let about = format!("{why:#?}\n{draw:?}");
    let column = names.iter().position(|n| *n == why.name).expect("an unknown");
    let rows: Vec<DVector<f64>> = why.determined_by.iter().map(|d| row(&case, names, d)).collect();
    if why.degree.is_some() {
        assert_eq!(why.determined_by.iter().map(|d| d.order).max(), why.degree, "{about}");
        assert!(distance(&rows, column, names.len()) < ZERO, "they do not determine it: {about}");
        for k in 0..rows.len() {
            let rest: Vec<_> =
                rows.iter().enumerate().filter(|(i, _)| *i != k).map(|r| r.1.clone()).collect();
            assert!(distance(&rest, column, names.len()) > 1e-6, "{k} can be left out: {about}");
        }
    } else {
        assert!(rows.is_empty(), "{about}");
    }
    let Some(unseen) = &why.unseen else {
        assert_eq!(why.degree, Some(0), "{about}");
        return 0;
    };
    let mut direction = DVector::zeros(names.len());
    for c in &unseen.components {
        let Some(coefficient) = &c.coefficient else { return 0 };
        let value = text::evaluate(coefficient, READINGS[0], &|name| case.value(name)).expect("a number");
        direction[names.iter().position(|n| *n == c.name).expect("an unknown")] = value.value;
    }
    assert_eq!((unseen.components[0].name.as_str(), direction[column]), (why.name.as_str(), 1.0), "{about}");
    let size = direction.amax();
    for station in &draw.case().positions {
        for (output, order) in
            ["Z1", "Z3"].into_iter().flat_map(|z| (0..=unseen.up_to_order).map(move |k| (z, k)))
        {
            let d = OutputDerivative { output: output.into(), order, place: Some(station.name.clone()) };
            let change = row(&case, names, &d).dot(&direction);
            assert!(change.abs() < 1e-4 * size, "{d:?} changes by {change}: {about}");
        }
    }
    // determined by derivatives of which one must see the direction
    assert_eq!(why.degree.is_some(), !unseen.seen_by.is_empty(), "{about}");
    for d in &unseen.seen_by {
        assert_eq!(Some(d.order), why.degree);
        assert!(row(&case, names, d).dot(&direction).abs() > 1e-6, "{d:?} does not change: {about}");
    }
    1
}

/// Checks the explanations of every unknown of random schemes.
fn explanations(count: usize, kind: Angles) -> usize {
    let mut checked = 0;
    for draw in cases(kind, 3, count, &[]) {
        if draw.terms == "drift" || draw.azimuth {
            continue;
        }
        let scheme = draw.scheme();
        let options = AnalysisOptions { solutions: false, omitted: false, ..AnalysisOptions::default() };
        let found = analyze(&scheme, options, None).expect("analysed");
        for name in &found.unknowns {
            let why = explain(&scheme, &found, name, 1).expect("explained").expect("an unknown");
            assert!(why.not_explained.is_empty(), "{why:?}");
            checked += check(&draw, &why, &found.unknowns);
        }
    }
    checked
}

#[test]
fn explanations_hold_in_the_simulated_motion() {
    let checked = explanations(6, Angles::Roots) + explanations(6, Angles::Cardinal);
    assert!(checked > 60, "{checked}");
}

#[test]
#[ignore = "at full length: .ci/run release"]
fn explanations_hold_in_the_simulated_motion_at_length() {
    let checked = explanations(150, Angles::Roots) + explanations(150, Angles::Cardinal);
    assert!(checked > 1500, "{checked}");
}

//! Random schemes for the tests of formulas.

use std::collections::HashMap;

use obsdeg_core::model::{self, Rotation, Scheme, parse_attitude};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, RngSeed, TestRunner};

use super::platform::{Carry, Case, Position, Turn};

/// Kinds of angles in a random scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(not(feature = "symbolica"), allow(dead_code, reason = "generic angles need the engine"))]
pub(super) enum Angles {
    /// Multiples of 90 degrees.
    Cardinal,
    /// Multiples of 15 degrees.
    Roots,
    /// A few constant angles besides, with symbols for their sines and cosines.
    Constants,
    /// One angle name, with signs and offsets.
    Names,
    /// Two angle names.
    TwoNames,
    /// Decimal angles, all different.
    Decimals,
}

/// A random scheme.
#[derive(Debug, Clone)]
pub(super) struct RandomScheme {
    pub(super) angles: Vec<[String; 3]>,
    /// Axis and angle (deg) by which each position turns.
    pub(super) turns: Vec<Option<(&'static str, i32)>>,
    pub(super) carry: Carry,
    pub(super) latitude: Option<&'static str>,
    pub(super) azimuth: bool,
    pub(super) terms: &'static str,
    /// Requested combinations.
    pub(super) asked: &'static [&'static str],
    pub(super) values: Vec<f64>,
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

fn draws(kind: Angles, most: usize, turning: &'static [i32]) -> impl Strategy<Value = RandomScheme> {
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
            // the terms `drift` belong to one position at rest
            let single = angles.len() == 1 && turns[0].is_none();
            let terms = if single && values[0] < 0.5 { "drift" } else { terms };
            RandomScheme { angles, turns, carry, latitude, azimuth, terms, asked: &[], values }
        })
}

impl RandomScheme {
    /// Name of a position; some names need quotation marks.
    fn name(&self, i: usize) -> String {
        if self.turns.iter().any(Option::is_some) && i > 0 {
            format!("leg {i}-b")
        } else {
            format!("p{}", i + 1)
        }
    }

    pub(super) fn scheme(&self) -> Scheme {
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

    /// The scheme with values of both signs, none near zero, for all unknowns.
    pub(super) fn case(&self) -> Case {
        self.case_at(&HashMap::from([
            ("alpha".into(), 0.4 + self.values[62]),
            ("a1".into(), -0.3 - self.values[63]),
        ]))
    }

    /// The scheme with values for its unknowns and these values (rad) for generic angles.
    pub(super) fn case_at(&self, names: &HashMap<String, f64>) -> Case {
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
                // a rate of rounding errors is set to zero
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

/// Scheme of the given attitudes and requested combinations.
pub(super) fn fixed(angles: &[&str], asked: &'static [&'static str]) -> RandomScheme {
    let of = |a: &&str| -> [String; 3] {
        let parts: Vec<String> = a.split(',').map(String::from).collect();
        parts.try_into().expect("three angles")
    };
    RandomScheme {
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

/// The same `n` random schemes in every run.
pub(super) fn cases(kind: Angles, most: usize, n: usize, turning: &'static [i32]) -> Vec<RandomScheme> {
    let config =
        Config { rng_seed: RngSeed::Fixed(12), rng_algorithm: RngAlgorithm::ChaCha, ..Config::default() };
    let mut runner = TestRunner::new(config);
    (0..n).map(|_| draws(kind, most, turning).new_tree(&mut runner).expect("drawn").current()).collect()
}

//! Reader of certificate files: exactly the keys of the specification, each once.

use std::collections::BTreeMap;

use num_bigint::BigInt;
use num_rational::BigRational;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::{Refused, same};

/// Row: segment (from 1), order, component.
pub(crate) type RowName = (usize, usize, usize);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Certificate {
    #[serde(rename = "layout")]
    _layout: String,
    pub problem: RawProblem,
    pub unknowns: Vec<String>,
    pub kind: String,
    pub ranks: Vec<usize>,
    pub basis: Vec<(usize, usize, usize, String)>,
    #[serde(deserialize_with = "Option::deserialize")]
    pub null_vectors: Option<Vec<Vec<Functional>>>,
    pub verdicts: Vec<Claimed>,
    pub combinations: Vec<Claimed>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawProblem {
    pub carry: String,
    #[serde(deserialize_with = "Option::deserialize")]
    pub latitude_deg: Option<String>,
    pub measured_azimuth: bool,
    pub terms: Vec<String>,
    pub gyros: [RawGyro; 3],
    pub accelerometers: [String; 3],
    pub positions: Vec<[String; 3]>,
    #[serde(deserialize_with = "Option::deserialize")]
    pub slews: Option<Vec<Vec<RawTurn>>>,
}

#[derive(Deserialize, Serialize, Clone)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawTurn {
    #[serde(deserialize_with = "Option::deserialize")]
    pub about: Option<RawAxis>,
    pub angle_deg: String,
}

/// Axis of a turn: its name, or a direction in n.
#[derive(Deserialize, Serialize, Clone)]
#[serde(untagged)]
pub(crate) enum RawAxis {
    Named(String),
    Direction([Number; 3]),
}

#[derive(Deserialize, Serialize, Clone)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the letters of the specification")]
pub(crate) struct RawGyro {
    pub I: String,
    pub O: String,
    pub S: String,
}

/// A verdict (with `unknown`) or a combination (with `terms`).
pub(crate) struct Claimed {
    pub unknown: Option<String>,
    pub terms: Option<Functional>,
    pub witness: Witness,
}

/// Status, degree and witness of a functional, as claimed by the certificate or found by the checker.
#[derive(Serialize, Default)]
pub(crate) struct Witness {
    pub status: String,
    pub degree: Option<usize>,
    pub solution: Option<Vec<RowName>>,
    #[serde(skip)]
    pub coefficients: Option<Vec<Number>>,
    pub hidden_by: Option<String>,
    pub excited_by: Option<RowName>,
}

impl<'de> Deserialize<'de> for Claimed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Flat {
            unknown: Option<String>,
            terms: Option<Functional>,
            status: String,
            #[serde(deserialize_with = "Option::deserialize")]
            degree: Option<usize>,
            #[serde(deserialize_with = "Option::deserialize")]
            solution: Option<Vec<RowName>>,
            #[serde(deserialize_with = "Option::deserialize")]
            coefficients: Option<Vec<Number>>,
            #[serde(deserialize_with = "Option::deserialize")]
            hidden_by: Option<String>,
            #[serde(deserialize_with = "Option::deserialize")]
            excited_by: Option<RowName>,
        }
        let Flat { unknown, terms, status, degree, solution, coefficients, hidden_by, excited_by } =
            Flat::deserialize(deserializer)?;
        let witness = Witness { status, degree, solution, coefficients, hidden_by, excited_by };
        Ok(Self { unknown, terms, witness })
    }
}

impl Witness {
    /// Refuses a claim that differs from `found` in anything but the coefficients.
    pub(crate) fn compare(&self, name: &str, found: &Self) -> Result<(), Refused> {
        same(&format!("{name}, status"), &self.status, &found.status)?;
        same(&format!("{name}, degree"), &self.degree, &found.degree)?;
        same(&format!("{name}, solution"), &self.solution, &found.solution)?;
        same(&format!("{name}, hidden_by"), &self.hidden_by, &found.hidden_by)?;
        same(&format!("{name}, excited_by"), &self.excited_by, &found.excited_by)
    }
}

/// Sum of `q sqrt(r) wN^a wU^b`: `q` by `(r, a, b)`, without zeros.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Number(pub BTreeMap<(u8, i32, i32), BigRational>);

impl Serialize for Number {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let terms = self.0.iter().map(|((r, a, b), q)| (q.to_string(), *r, *a, *b));
        terms.collect::<Vec<_>>().serialize(serializer)
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let terms = Vec::<(i64, i64, u8, i32, i32)>::deserialize(deserializer)?;
        let mut out = BTreeMap::new();
        for (p, q, r, a, b) in terms {
            let limit = 1 << 31;
            let form = p != 0 && (1..limit).contains(&q) && (1 - limit..limit).contains(&p);
            let form = form && gcd(p.unsigned_abs(), q.unsigned_abs()) == 1 && [1, 2, 3, 6].contains(&r);
            if !form || !(-9..=9).contains(&a) || !(-9..=9).contains(&b) {
                return Err(D::Error::custom(format!("[{p},{q},{r},{a},{b}] is not a term of a number")));
            }
            if out.insert((r, a, b), BigRational::new(BigInt::from(p), BigInt::from(q))).is_some() {
                return Err(D::Error::custom(format!(
                    "[{p},{q},{r},{a},{b}]: these powers occur twice in a number"
                )));
            }
        }
        Ok(Self(out))
    }
}

/// Linear combination of unknowns: numbers by names.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Functional(pub BTreeMap<String, Number>);

impl<'de> Deserialize<'de> for Functional {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Once;
        impl<'de> Visitor<'de> for Once {
            type Value = Functional;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object of names and numbers")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Functional, A::Error> {
                let mut out = BTreeMap::new();
                while let Some((name, number)) = map.next_entry::<String, Number>()? {
                    if out.insert(name, number).is_some() {
                        return Err(A::Error::custom("a key is repeated"));
                    }
                }
                Ok(Functional(out))
            }
        }
        deserializer.deserialize_map(Once)
    }
}

impl Functional {
    /// The functional of one unknown.
    pub(crate) fn unit(name: &str) -> Self {
        let one = BigRational::from_integer(BigInt::from(1));
        Self([(name.to_string(), Number([((1, 0, 0), one)].into()))].into())
    }
}

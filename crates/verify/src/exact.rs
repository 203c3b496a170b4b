//! Check in exact arithmetic: numbers `sum q sqrt(r) wN^a wU^b` with rational `q`.

use std::collections::BTreeMap;

use num_bigint::BigInt;
use num_rational::BigRational;

use crate::file::{Certificate, Functional, Number, RowName};
use crate::problem::{Matrix, ORDERS, Problem, Ring, TURN};
use crate::{Claim, Refused, need};

/// Ring of exact numbers, with the rates of a problem.
struct ExactRing {
    rates: [Number; 2],
}

fn rational(p: i64, q: i64) -> BigRational {
    BigRational::new(BigInt::from(p), BigInt::from(q))
}

/// A sum of `p/q sqrt(r)`.
fn radicals<const N: usize>(terms: [(i64, i64, u8); N]) -> Number {
    Number(terms.into_iter().map(|(p, q, r)| ((r, 0, 0), rational(p, q))).collect())
}

impl Ring for ExactRing {
    type Element = Number;
    fn zero(&self) -> Number {
        Number::default()
    }
    fn one(&self) -> Number {
        radicals([(1, 1, 1)])
    }
    fn add(&self, a: &Number, b: &Number) -> Number {
        let mut sum = a.clone();
        for (k, q) in &b.0 {
            *sum.0.entry(*k).or_insert_with(|| rational(0, 1)) += q;
        }
        without_zeros(sum)
    }
    fn mul(&self, a: &Number, b: &Number) -> Number {
        let mut out: BTreeMap<(u8, i32, i32), BigRational> = BTreeMap::new();
        for ((r, i, j), q) in &a.0 {
            for ((s, k, l), x) in &b.0 {
                // sqrt r sqrt s = g sqrt(rs / g^2), g their common divisor
                let g = [6, 3, 2].into_iter().find(|g| r % g == 0 && s % g == 0).unwrap_or(1);
                let product = q * x * BigInt::from(g);
                *out.entry((r / g * (s / g), i + k, j + l)).or_insert_with(|| rational(0, 1)) += product;
            }
        }
        without_zeros(Number(out))
    }
    fn neg(&self, a: &Number) -> Number {
        Number(a.0.iter().map(|(k, q)| (*k, -q)).collect())
    }
    fn is_zero(&self, a: &Number) -> bool {
        a.0.is_empty()
    }
    fn cos_sin(&self, angle: i64) -> (Number, Number) {
        let sine = |steps: i64| {
            let steps = steps.rem_euclid(24);
            let half = steps % 12;
            let positive = match half.min(12 - half) {
                0 => Number::default(),
                1 => radicals([(1, 4, 6), (-1, 4, 2)]),
                2 => radicals([(1, 2, 1)]),
                3 => radicals([(1, 2, 2)]),
                4 => radicals([(1, 2, 3)]),
                5 => radicals([(1, 4, 6), (1, 4, 2)]),
                _ => radicals([(1, 1, 1)]),
            };
            if steps < 12 { positive } else { self.neg(&positive) }
        };
        let steps = angle / (TURN / 24);
        (sine(steps + 6), sine(steps))
    }
    fn rates(&self) -> [Number; 2] {
        self.rates.clone()
    }
    fn left(&self, _: &Problem, _: &[Matrix<Number>]) -> Vec<Matrix<Number>> {
        // certificates with slews are modular, so slews are refused earlier
        Vec::new()
    }
}

fn without_zeros(mut x: Number) -> Number {
    x.0.retain(|_, q| *q != rational(0, 1));
    x
}

/// A row by the names of the unknowns, without zeros.
type Row<'a> = BTreeMap<&'a str, Number>;

/// Checks all null vectors and solutions.
pub(crate) fn check(
    problem: &Problem,
    file: &Certificate,
    functionals: &[Functional],
    claims: &[Claim<'_>],
) -> Result<(), Refused> {
    let odd = problem.positions.iter().flatten().find(|a| *a % (TURN / 24) != 0);
    need(odd.is_none(), "kind", "angles that are multiples of 15 degrees in an exact certificate", "others")?;
    need(problem.slews.is_empty(), "kind", "no slews in an exact certificate", "some")?;
    let power = |zero: bool, a, b| {
        if zero { Number::default() } else { Number([((1, a, b), rational(1, 1))].into()) }
    };
    let ring = ExactRing { rates: [power(problem.pole, 1, 0), power(problem.equator, 0, 1)] };
    let sparse = |row: Vec<Number>| -> Row<'_> {
        problem.names.iter().map(String::as_str).zip(row).filter(|(_, x)| !ring.is_zero(x)).collect()
    };
    let rows: BTreeMap<RowName, Row<'_>> =
        problem.rows(&ring).into_iter().map(|(name, row)| (name, sparse(row))).collect();
    null_vectors(problem, file, &ring, &rows)?;
    for (functional, (name, claim)) in functionals.iter().zip(claims) {
        let place = format!("{name}, coefficients");
        match (&claim.solution, &claim.coefficients) {
            (Some(solution), Some(numbers)) if solution.len() == numbers.len() => {
                let mut total: Row<'_> =
                    functional.0.iter().map(|(name, x)| (name.as_str(), ring.neg(x))).collect();
                for (row, y) in solution.iter().filter_map(|name| rows.get(name)).zip(numbers) {
                    y.check(&place, problem)?;
                    for (name, x) in row {
                        let entry = total.entry(*name).or_default();
                        *entry = ring.add(entry, &ring.mul(y, x));
                    }
                }
                let wrong = total.iter().find(|(_, x)| !ring.is_zero(x));
                let wrong = wrong.map_or("", |(name, _)| *name);
                need(
                    wrong.is_empty(),
                    &place,
                    "rows times coefficients that make the functional",
                    format!("another entry at {wrong}"),
                )?;
            }
            (None, None) if claim.status == "not_excited" => {
                let excites = |row: &Row<'_>| functional.0.keys().any(|name| row.contains_key(name.as_str()));
                need(!rows.values().any(excites), &place, "0 in every row", "another entry")?;
            }
            (None, None) => {}
            _ => need(false, &place, "one number per row of the solution", "another number of them")?,
        }
    }
    Ok(())
}

/// Checks that every null vector is 1 at its free unknown, 0 at the others, and orthogonal to all rows
/// up to its order.
fn null_vectors(
    problem: &Problem,
    file: &Certificate,
    ring: &ExactRing,
    rows: &BTreeMap<RowName, Row<'_>>,
) -> Result<(), Refused> {
    let levels = file.null_vectors.as_deref().unwrap_or_default();
    need(levels.len() == file.ranks.len(), "null_vectors", "one list per rank", levels.len())?;
    for (k, vectors) in levels.iter().enumerate() {
        let pivots: Vec<&String> = file.basis.iter().take(file.ranks[k]).map(|row| &row.3).collect();
        let free: Vec<&String> = problem.names.iter().filter(|n| !pivots.contains(n)).collect();
        need(
            vectors.len() == free.len(),
            &format!("null_vectors.{k}"),
            &format!("{} vectors", free.len()),
            vectors.len(),
        )?;
        let last = if k + 1 == levels.len() { ORDERS - 1 } else { k };
        for (f, vector) in free.into_iter().zip(vectors) {
            let place = format!("null_vectors.{k}.{f}");
            vector.check(&place, problem)?;
            need(vector.0.get(f) == Some(&ring.one()), &place, "the entry 1 at its free unknown", "another")?;
            let only = vector.0.keys().all(|name| name == f || pivots.contains(&name));
            need(only, &place, "no entry at other free unknowns", "one")?;
            for (name, row) in rows.iter().filter(|(name, _)| name.1 <= last) {
                let entries =
                    vector.0.iter().filter_map(|(unknown, x)| Some((x, row.get(unknown.as_str())?)));
                let product = entries.fold(ring.zero(), |sum, (x, r)| ring.add(&sum, &ring.mul(x, r)));
                need(
                    ring.is_zero(&product),
                    &place,
                    &format!("0 as product with row {name:?}"),
                    "another number",
                )?;
            }
        }
    }
    Ok(())
}

//! The numbers of an exact certificate, recovered from their images in two prime fields with four embeddings
//! each.
//!
//! All rows are homogeneous in the rates: give every drift coefficient the weight 1, psi 0, a row of order k
//! the weight k. Where `wN` is not 0, rows of order at most k span what `wN psi_x, wN psi_z, eps_x, eps_z -
//! wN psi_y, eps_y` (those of order at most k) of every position span, and in `wN psi` and the coefficients
//! So an entry of a null vector is a number times a power of `wN`. A coefficient of a solution, at `wN = 1`,
//! is a polynomial in `wU` of degree at most 2; for a combination the degree grows by the powers of the
//! rates in it.

use std::cell::Cell;
use std::collections::BTreeMap;

use obsdeg_exact::radical::embeddings;
use obsdeg_exact::{Field, RootField};

use super::witness::{Filtration, WitnessedVerdict};
use super::{ExactNumber, ExactVector, Exactly, number};
use crate::degree::coefficient::{Coefficient, Number, power, recover_radical};
use crate::degree::ensemble::Verdicts;
use crate::model::platform::{FieldSample, Platform};
use crate::model::{Angle, ErrorSource};

/// The numbers of an exact certificate.
pub(super) struct ExactWitness {
    /// Null vectors, per order and free unknown.
    pub null_vectors: Vec<Vec<ExactVector>>,
    /// Coefficients of the solution rows, per functional; `None` where it is not observable.
    pub coefficients: Vec<Option<Vec<ExactNumber>>>,
}

/// Image of a combination in the field of a sample at given rates `(wN, wU)`; powers of a rate that is 0 are
/// 0.
pub(super) fn image(c: &Exactly, sample: &FieldSample, rates: [u64; 2]) -> Vec<(usize, u64)> {
    let f = &sample.roots.field;
    let value = |c: &Coefficient| match &c.number {
        Number::Radical(radical) => {
            f.mul(radical.image(&sample.roots), power(f, rates, c.rates).unwrap_or(0))
        }
        _ => 0,
    };
    c.iter().map(|(column, c)| (*column, value(c))).collect()
}

/// The fields, embeddings and rates at which everything is solved.
struct FiltrationPoints<'a> {
    platform: &'a Platform,
    fields: [RootField; 2],
    /// Filtrations at the points, indexed `[field][embedding][point]`.
    filtrations: [[Vec<SolvedFiltration>; 4]; 2],
    /// Rates `(wN, wU)` of the points. At a pole or the equator the only non-zero rate is 1.
    rates: Vec<[u64; 2]>,
    pole: bool,
    /// Lowest power of `wU` in a combination, at most 0.
    lowest: i32,
}

/// Filtration at one point, with the inverses of its minors.
struct SolvedFiltration {
    sample: FieldSample,
    filtration: Filtration,
    inverses: Vec<Vec<Vec<u64>>>,
}

/// The exact numbers of a certificate; `None` where the angles or the terms do not allow it, or where a
/// number is not small.
pub(super) fn exact(
    platform: &Platform,
    verdicts: &Verdicts,
    filtration: &Filtration,
    combinations: &[Exactly],
    found: &[WitnessedVerdict],
) -> Option<ExactWitness> {
    let scheme = platform.scheme();
    let mut angles = scheme.positions.iter().flat_map(|p| p.angles.iter().map(Angle::turn));
    let drifts = scheme.unknowns.terms().iter().all(|t| t.source() == ErrorSource::Gravity);
    if !drifts || !angles.all(|a| a.is_multiple_of_deg(15)) {
        return None;
    }
    let points = FiltrationPoints::new(platform, verdicts, filtration, combinations)?;
    let null_vectors =
        (0..filtration.ranks.len()).map(|k| points.null_vectors(filtration, k)).collect::<Option<_>>()?;
    let one = |c: usize| vec![(c, Coefficient::one())];
    let functionals = (0..platform.names().len()).map(one).chain(combinations.iter().cloned());
    let coefficients = functionals
        .zip(found)
        .map(|(c, found)| match (found.degree, &found.solution) {
            (Some(degree), Some(rows)) => points.coefficients(filtration, &c, degree, rows).map(Some),
            _ => Some(None),
        })
        .collect::<Option<_>>()?;
    Some(ExactWitness { null_vectors, coefficients })
}

impl<'a> FiltrationPoints<'a> {
    /// Computes the filtrations at all points; `None` if the basis rows differ at one of them.
    fn new(
        platform: &'a Platform,
        verdicts: &Verdicts,
        filtration: &Filtration,
        combinations: &[Exactly],
    ) -> Option<Self> {
        let latitude = platform.scheme().latitude;
        let [pole, equator] =
            [latitude.is_some_and(|l| l.is_pole()), latitude.is_some_and(|l| l.is_equator())];
        let powers = || combinations.iter().flatten().map(|(_, c)| c.rates[1]).chain([0]);
        let (lowest, highest) = (powers().min()?, powers().max()?);
        let rates: Vec<[u64; 2]> = match (pole, equator) {
            (true, _) => vec![[0, 1]],
            (_, true) => vec![[1, 0]],
            _ => (1..=(highest - lowest + 3) as u64).map(|t| [1, t]).collect(),
        };
        let solved = |values: &crate::model::platform::RandomValues, a: u64, rates: &[u64; 2]| {
            let at = rates.map(|t| values.roots().field.from_u64(t));
            let sample = values.sample_at(platform.scheme(), a, at);
            let other = Filtration::new(platform, &sample);
            let same = other.basis == filtration.basis && other.ranks == filtration.ranks;
            let inverses = (0..other.ranks.len()).map(|k| other.inverse(k)).collect::<Option<_>>();
            Some(SolvedFiltration { sample, inverses: inverses?, filtration: other }).filter(|_| same)
        };
        let mut filtrations = [0, 1].map(|_| [0; 4].map(|_| Vec::new()));
        for (field, values) in filtrations.iter_mut().zip(&verdicts.values) {
            for (slot, a) in field.iter_mut().zip(embeddings(values.roots().order)) {
                *slot = rates.iter().map(|r| solved(values, a, r)).collect::<Option<_>>()?;
            }
        }
        let fields = [0, 1].map(|i| *verdicts.values[i].roots());
        Some(Self { platform, fields, filtrations, rates, pole, lowest })
    }

    /// Weight of a column: 0 for psi, 1 for a coefficient.
    fn weight(&self, column: usize) -> i32 {
        i32::from(column >= self.platform.names().len() - self.platform.coefficients())
    }

    /// A number times powers `a`, `b` of the rates, in the form of a certificate.
    fn times_power(&self, images: &[[u64; 4]; 2], [a, b]: [i32; 2]) -> Option<ExactNumber> {
        let number_ = Number::Radical(recover_radical(&self.fields, images)?);
        let small = a.abs().max(b.abs()) <= 9;
        small.then(|| number(&Coefficient { number: number_, rates: [a, b] }))
    }

    fn null_vectors(&self, filtration: &Filtration, order: usize) -> Option<Vec<ExactVector>> {
        let images = self
            .filtrations
            .each_ref()
            .map(|embeddings| embeddings.each_ref().map(|points| points[0].filtration.null_vectors(order)));
        let names = self.platform.names();
        let vector = |(i, &free): (usize, &usize)| {
            let mut out = BTreeMap::new();
            for (column, name) in names.iter().enumerate() {
                let values = images.each_ref().map(|field| field.each_ref().map(|n| n[i][column]));
                if values.iter().flatten().all(|x| *x == 0) {
                    continue;
                }
                let degree = self.weight(column) - self.weight(free);
                if self.pole && degree != 0 {
                    return None;
                }
                out.insert(name.clone(), self.times_power(&values, [degree, 0])?);
            }
            Some(out)
        };
        filtration.free(order).iter().enumerate().map(vector).collect()
    }

    /// Coefficients of the rows of a solution.
    fn coefficients(
        &self,
        filtration: &Filtration,
        c: &Exactly,
        degree: usize,
        rows: &[usize],
    ) -> Option<Vec<ExactNumber>> {
        // homogeneous parts, by weight
        let mut parts: BTreeMap<i32, Exactly> = BTreeMap::new();
        for (column, x) in c {
            let weight = x.rates[0] + x.rates[1] + self.weight(*column);
            parts.entry(weight).or_default().push((*column, x.clone()));
        }
        let mut out = vec![ExactNumber::new(); rows.len()];
        for (weight, part) in parts {
            // y is indexed [field][embedding][point][row]. A functional that is observable at the given
            // latitude alone has no solution. A row whose coefficient vanishes only there (such as wN - wU
            // at 45 deg) is not among `rows`.
            let holds = Cell::new(true);
            let solved = |s: &SolvedFiltration, [w_n, w_u]: &[u64; 2]| {
                let f = s.sample.roots.field;
                let c = image(&part, &s.sample, [f.from_u64(*w_n), f.from_u64(*w_u)]);
                let y = s.filtration.solution(&s.inverses[degree], &c);
                let listed = y.iter().enumerate().all(|(i, y)| *y == 0 || rows.contains(&i));
                holds.set(holds.get() && listed && s.filtration.makes(&y, &c));
                y
            };
            let y = self.filtrations.each_ref().map(|embeddings| {
                embeddings.each_ref().map(|points| {
                    points.iter().zip(&self.rates).map(|(s, r)| solved(s, r)).collect::<Vec<_>>()
                })
            });
            if !holds.get() {
                return None;
            }
            for (slot, &row) in out.iter_mut().zip(rows) {
                let power = weight - filtration.basis[row].0.order as i32;
                slot.extend(self.terms(power, |field, embedding, point| y[field][embedding][point][row])?);
            }
        }
        Some(out)
    }

    /// Terms of a homogeneous coefficient of degree `power`, from its values at all points.
    fn terms(&self, power: i32, value: impl Fn(usize, usize, usize) -> u64) -> Option<ExactNumber> {
        if let [[w_n, _]] = self.rates[..] {
            let images = [0, 1].map(|i| [0, 1, 2, 3].map(|a| value(i, a, 0)));
            let rates = if w_n == 0 { [0, power] } else { [power, 0] };
            return self.times_power(&images, rates);
        }
        // multiplied by wU^-lowest it is a polynomial in wU
        let polynomials = [0, 1].map(|i| {
            let f = self.fields[i].field;
            [0, 1, 2, 3].map(|a| {
                let points = self.rates.iter().enumerate().map(|(j, [_, t])| {
                    let t = f.from_u64(*t);
                    (t, f.mul(value(i, a, j), f.pow(t, self.lowest.unsigned_abs().into())))
                });
                interpolate(&f, &points.collect::<Vec<_>>())
            })
        });
        let mut out = ExactNumber::new();
        for j in 0..self.rates.len() {
            let images = polynomials.each_ref().map(|field| field.each_ref().map(|p| p[j]));
            let b = j as i32 + self.lowest;
            out.extend(self.times_power(&images, [power - b, b])?);
        }
        Some(out)
    }
}

/// Coefficients, lowest first, of the polynomial through points with distinct arguments (Newton).
fn interpolate(f: &Field, points: &[(u64, u64)]) -> Vec<u64> {
    let n = points.len();
    let mut differences: Vec<u64> = points.iter().map(|p| p.1).collect();
    for k in 1..n {
        for i in (k..n).rev() {
            let step = f.inv(f.sub(points[i].0, points[i - k].0));
            differences[i] = f.mul(f.sub(differences[i], differences[i - 1]), step);
        }
    }
    let mut out = vec![0; n];
    for (&d, &(t, _)) in differences.iter().zip(points).rev() {
        // out = out (x - t) + d
        for j in (0..n).rev() {
            let below = if j > 0 { out[j - 1] } else { d };
            out[j] = f.sub(below, f.mul(t, out[j]));
        }
    }
    out
}

//! Two random fields in four embeddings each: what verdicts agree in and coefficients are recovered from.

use obsdeg_exact::certainty::{Claim, error_bound};
use obsdeg_exact::radical::embeddings;
use obsdeg_exact::{Echelon, PrimeError, RootField};

use super::platform_rows::PlatformRows;
use super::reset::reset_degrees;
use super::staircase::{Degrees, climb};
use crate::model::platform::{RandomValues, Sample};
use crate::model::{Carry, Platform, Unknowns};
use crate::solution::local::{LocalObservable, RateZeros, local_observables, rows_at};
use crate::solution::turning::motion_rows;

/// How many pairs of fields are drawn before a disagreement is an error.
const ATTEMPTS: usize = 4;

/// Why no verdict could be reached.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EnsembleError {
    /// No field fits the angles.
    #[error(transparent)]
    Prime(#[from] PrimeError),
    /// The fields kept disagreeing.
    #[error(
        "two random primes disagreed {ATTEMPTS} times in a row; expected at most one disagreement in 10^6 runs: please report this scheme"
    )]
    Disagreement,
}

/// The verdicts of a scheme, agreed on by two random fields.
#[derive(Debug, Clone)]
pub struct Verdicts {
    /// What was agreed on.
    pub degrees: Degrees,
    /// The bases of `V_0, V_1, ...` in the first field.
    pub stairs: Vec<Echelon>,
    /// The random values of the two fields.
    pub values: [RandomValues; 2],
    /// Bound on the probability that any of the verdicts is wrong.
    pub error_bound: f64,
}

/// Judges `platform` in two random fields, each of a stream of its own of `seed` and the scheme.
///
/// # Errors
/// [`EnsembleError`].
pub fn judge(platform: &Platform, seed: u64) -> Result<Verdicts, EnsembleError> {
    let (degrees, stairs, values) = agreed(platform, seed, &|sample| staircase(platform, sample))?;
    let claim = claim(platform, &degrees, values[0].roots().order);
    Ok(Verdicts { error_bound: error_bound(&claim, 2), degrees, stairs, values })
}

/// The degrees alone, as [`judge`] finds them.
///
/// # Errors
/// [`EnsembleError`].
pub fn degrees(platform: &Platform, seed: u64) -> Result<Degrees, EnsembleError> {
    let scheme = platform.scheme();
    if scheme.carry != Carry::Reset || scheme.unknowns == Unknowns::Drift {
        return Ok(judge(platform, seed)?.degrees);
    }
    Ok(agreed(platform, seed, &|sample| (reset_degrees(platform, sample), ()))?.0)
}

/// What two random fields agree on, with what else was found in the first.
fn agreed<T>(
    platform: &Platform,
    seed: u64,
    climbed: &dyn Fn(&Sample) -> (Degrees, T),
) -> Result<(Degrees, T, [RandomValues; 2]), EnsembleError> {
    let scheme = platform.scheme();
    for attempt in 0..ATTEMPTS {
        let draw = |field: usize| {
            let mut rng = scheme.random(seed, &format!("verdicts, attempt {attempt}, field {field}"));
            RandomValues::draw(scheme, &mut rng)
        };
        let values = [draw(0)?, draw(1)?];
        let (second, _) = climbed(&values[1].sample(scheme, 1));
        let (degrees, rest) = climbed(&values[0].sample(scheme, 1));
        if degrees == second {
            return Ok((degrees, rest, values));
        }
    }
    Err(EnsembleError::Disagreement)
}

/// The degrees and the bases of `V_0, V_1, ...` at one sample.
pub fn staircase(platform: &Platform, sample: &Sample) -> (Degrees, Vec<Echelon>) {
    let mut rows = PlatformRows::new(platform, sample);
    let mut basis = Echelon::new(sample.point.ring, platform.names().len());
    let mut stairs = Vec::new();
    let degrees = climb(&mut rows, &mut basis, |_, v| stairs.push(v.clone()));
    (degrees, stairs)
}

/// The size of the claim (see [`obsdeg_exact::certainty`]): a row is a row of `H F^k`, of degree k in
/// the rates, times `S_i`, whose entries are products of at most six sines and cosines per g factor.
fn claim(platform: &Platform, degrees: &Degrees, order: u64) -> Claim {
    let generic = !platform.scheme().generic_names().is_empty();
    let orders = degrees.rank_profile.len();
    let unknowns = platform.names().len();
    Claim {
        unknowns,
        decisions: orders * (1 + unknowns),
        order,
        row_degree: orders + if generic { 18 } else { 0 },
        // |entry| <= 6, denominators 2^9, 15 entries of norm at most sqrt(15) together, w/ margin
        row_bits: 16.0,
    }
}

/// The rows of the local observables of every position, in one field and embedding.
#[derive(Debug, Clone)]
pub struct Table {
    /// Field and embedding.
    pub sample: Sample,
    /// One row per station and local observable, station by station; then, if the scheme rotates, one per station of
    /// [`motion_rows`].
    pub rows: Vec<Vec<u64>>,
}

impl Table {
    /// The values of `(wN, wU)`.
    pub fn rates(&self) -> [u64; 2] {
        [self.sample.point.w_n, self.sample.point.w_u]
    }
}

/// The observable rows of a scheme in two fields, four embeddings each, with random rates: a formula in
/// `wN` and `wU` that holds there holds at every latitude with the same zeros.
#[derive(Debug, Clone)]
pub struct Tables {
    /// The observables of one position.
    pub observables: Vec<LocalObservable>,
    /// How many rows are those of local observables.
    pub observable_rows: usize,
    /// Zeros of the rates.
    pub zeros: RateZeros,
    /// `tables[field][embedding]`.
    pub tables: [[Table; 4]; 2],
    /// The first field and embedding at other rates.
    pub other_rates: Table,
}

impl Tables {
    /// The tables of `platform` in the fields of `verdicts`.
    pub fn new(platform: &Platform, verdicts: &Verdicts, seed: u64) -> Self {
        let scheme = platform.scheme();
        let zeros = RateZeros::of(platform);
        let observables = local_observables(zeros, scheme.measured_azimuth);
        let mut rng = scheme.random(seed, "other rates");
        let mut rates = |roots: &RootField| {
            let p = roots.field.modulus();
            let mut draw = |zero: bool| if zero { 0 } else { 1 + rng.below(p - 1) };
            [draw(zeros.w_n), draw(zeros.w_u)]
        };
        let table = |values: &RandomValues, a: u64, [w_n, w_u]: [u64; 2]| {
            let mut sample = values.sample(scheme, a);
            (sample.point.w_n, sample.point.w_u) = (w_n, w_u);
            let mut rows = rows_at(platform, &sample.point, &observables);
            rows.extend(motion_rows(platform, &sample.point));
            Table { sample, rows }
        };
        // the rates of the verdicts, so that vectors of the stairs are vectors of the first table
        let tables = [0, 1].map(|i| {
            let values = &verdicts.values[i];
            let point = values.sample(scheme, 1).point;
            embeddings(values.roots().order).map(|a| table(values, a, [point.w_n, point.w_u]))
        });
        let first = &verdicts.values[0];
        let other_rates = table(first, 1, rates(first.roots()));
        let observable_rows = scheme.stations().len() * observables.len();
        Self { observables, observable_rows, zeros, tables, other_rates }
    }

    /// The two fields.
    pub fn fields(&self) -> [RootField; 2] {
        [self.tables[0][0].sample.roots, self.tables[1][0].sample.roots]
    }

    /// The derivative order of a row.
    pub fn order(&self, row: usize) -> usize {
        self.observables[row % self.observables.len()].order
    }

    /// The station of a row.
    pub fn station(&self, row: usize) -> usize {
        row / self.observables.len()
    }

    /// The row of [`motion_rows`] of a station.
    pub fn motion_row(&self, station: usize) -> usize {
        self.observable_rows + station
    }

    /// The rows of local observables of order up to `degree`.
    pub fn rows_up_to(&self, degree: usize) -> Vec<usize> {
        (0..self.observable_rows).filter(|&j| self.order(j) <= degree).collect()
    }

    /// The first field and embedding.
    pub fn first(&self) -> &Table {
        &self.tables[0][0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Scheme;

    fn claimed(angles: &[[&str; 3]], latitude: Option<&str>) -> Claim {
        let angles = angles.iter().map(|a| a.map(|x| x.parse().expect("an angle")));
        let latitude = latitude.map(|l| l.parse().expect("a latitude"));
        let platform = Platform::new(Scheme { latitude, ..Scheme::of_angles(angles) }).expect("a scheme");
        let verdicts = judge(&platform, 1).expect("verdicts");
        claim(&platform, &verdicts.degrees, verdicts.values[0].roots().order)
    }

    /// By hand: p1 p2 has 15 unknowns and the rank profile 2 6 8, so three orders, each with a rank and 15 memberships.
    #[test]
    fn what_is_claimed() {
        let p1_p2 = Claim { unknowns: 15, decisions: 48, order: 24, row_degree: 3, row_bits: 16.0 };
        assert_eq!(claimed(&[["0", "0", "0"], ["180", "0", "0"]], None), p1_p2);
        // 10 degrees are a 36th of a turn: with multiples of 15 degrees, 72
        let finer = Claim { order: 72, ..p1_p2 };
        assert_eq!(claimed(&[["0", "0", "0"], ["180", "10", "0"]], None).order, finer.order);
        // one position: 2 3 4 of 15, so three orders; six sines and cosines of generic angles per factor of g
        let generic = claimed(&[["alpha", "0", "0"]], None);
        assert_eq!((generic.row_degree, generic.decisions), (3 + 18, 48));
    }
}

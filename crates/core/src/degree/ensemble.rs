//! Two random fields in four embeddings each: verdicts must agree in both, and coefficients are recovered
//! from all.

use obsdeg_exact::certainty::{RankClaim, error_bound};
use obsdeg_exact::{Echelon, PrimeError, gcd};

use super::filtration::{Degrees, climb};
use super::histories;
use super::platform_rows::PlatformRows;
use super::reset::reset_degrees;
use crate::model::platform::{FieldSample, RandomValues};
use crate::model::{Carry, ErrorSource, Platform, Unknowns};

/// Number of pairs of fields drawn before a disagreement is an error.
const ATTEMPTS: usize = 4;

/// Reasons for the lack of a verdict.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EnsembleError {
    /// No field fits the angles.
    #[error(transparent)]
    Prime(#[from] PrimeError),
    /// The fields kept disagreeing.
    #[error(
        "two random primes disagreed {ATTEMPTS} times in a row; expected at most one disagreement in 10^6 \
         runs: please report this scheme"
    )]
    Disagreement,
}

/// Verdicts of a scheme on which two random fields agree.
#[derive(Debug, Clone)]
pub struct Verdicts {
    /// Degrees that both fields give.
    pub degrees: Degrees,
    /// Bases of `V_0, V_1, ...` in the first field.
    pub spans: Vec<Echelon>,
    /// Random values of the two fields.
    pub values: [RandomValues; 2],
    /// Bound on the probability that any of the verdicts is wrong.
    pub error_bound: f64,
}

/// Judges `platform` in two random fields, each with its own stream of `seed` and the scheme.
///
/// # Errors
/// [`EnsembleError`].
pub fn judge(platform: &Platform, seed: u64) -> Result<Verdicts, EnsembleError> {
    let (degrees, spans, values) = agreed(platform, seed, &|sample| filtration(platform, sample))?;
    let claim = claim(platform, &degrees, values[0].roots().order);
    Ok(Verdicts { error_bound: error_bound(&claim, 2), degrees, spans, values })
}

/// The degrees alone, as [`judge`] finds them.
///
/// # Errors
/// [`EnsembleError`].
pub(crate) fn degrees(platform: &Platform, seed: u64) -> Result<Degrees, EnsembleError> {
    let scheme = platform.scheme();
    if scheme.carry != Carry::Reset || scheme.unknowns == Unknowns::Drift || scheme.by_history() {
        return Ok(judge(platform, seed)?.degrees);
    }
    Ok(agreed(platform, seed, &|sample| (reset_degrees(platform, sample), ()))?.0)
}

/// Result on which two random fields agree, with further findings of the first field.
fn agreed<T>(
    platform: &Platform,
    seed: u64,
    climbed: &dyn Fn(&FieldSample) -> (Degrees, T),
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
pub fn filtration(platform: &Platform, sample: &FieldSample) -> (Degrees, Vec<Echelon>) {
    if platform.scheme().by_history() {
        return histories::filtration(platform, sample);
    }
    let mut rows = PlatformRows::new(platform, sample);
    let mut basis = Echelon::new(sample.point.ring, platform.names().len());
    let mut spans = Vec::new();
    let degrees = climb(&mut rows, &mut basis, |_, v| spans.push(v.clone()));
    (degrees, spans)
}

/// Size of the claim (see [`obsdeg_exact::certainty`]). A row is a row of `H F^k`, of degree k in the rates,
/// times `S_i`. Its entries are products of at most six sines and cosines per factor, and of `C_c^n`.
/// Torqued rates add one degree in the rates; torquer errors of turns add one degree in pi.
fn claim(platform: &Platform, degrees: &Degrees, order: u64) -> RankClaim {
    let scheme = platform.scheme();
    let generic = !scheme.generic_names().is_empty();
    let orders = degrees.rank_profile.len();
    let unknowns = platform.names().len();
    let factors = scheme.unknowns.terms().iter().map(|t| t.order()).max().unwrap_or(0).max(2);
    // entries of a row: psi of its position, and the coefficients
    let entries = 3 + platform.coefficients();
    let torquers = usize::from(scheme.unknowns.have(ErrorSource::Rate));
    let rotations = if scheme.by_history() {
        scheme.positions.iter().filter(|p| p.rotation.is_some()).count()
    } else {
        0
    };
    let harmonics = platform.errors().harmonics();
    let turning_bits = rotations as f64 * histories::bits(harmonics);
    // an entry is at most 6, denominators 2^9 (2^3 of every factor beyond two), 15 entries of norm at most
    // sqrt(15) together, with margin
    let bits = 16.0 + 3.0 * (factors - 2) as f64 + (entries as f64 / 15.0).log2().max(0.0) / 2.0;
    RankClaim {
        unknowns,
        decisions: orders * (1 + unknowns),
        order,
        row_degree: orders
            + if generic { 6 * (1 + factors) } else { 0 }
            + torquers
            + rotations * histories::degree(harmonics),
        row_bits: bits + torquer_bits(platform) + turning_bits,
    }
}

/// Bits that turns add to the entries of a row. A turn is `C J E(u)`: products of at most six entries of
/// `C_c^n`, with denominators 2^3 each and the cube of a root's denominator, and an angle with its own
/// denominator. Every turn adds one bit.
fn torquer_bits(platform: &Platform) -> f64 {
    let steps: Vec<_> = platform.paths().iter().flatten().collect();
    let half_turn = 180_000_000_000u64;
    let common = steps.iter().fold(half_turn, |g, s| gcd(g, s.angle().nanodeg().unsigned_abs()));
    if steps.is_empty() {
        0.0
    } else {
        24.0 + (steps.len() as f64).log2() + ((half_turn / common) as f64).log2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Scheme;

    fn claimed(angles: &[[&str; 3]], latitude: Option<&str>) -> RankClaim {
        let angles = angles.iter().map(|a| a.map(|x| x.parse().expect("an angle")));
        let latitude = latitude.map(|l| l.parse().expect("a latitude"));
        let platform = Platform::new(Scheme { latitude, ..Scheme::of_angles(angles) }).expect("a scheme");
        let verdicts = judge(&platform, 1).expect("verdicts");
        claim(&platform, &verdicts.degrees, verdicts.values[0].roots().order)
    }

    /// By hand: p1 p2 has 15 unknowns and the rank profile 2 6 8, so three orders, each with a rank and 15
    /// memberships.
    #[test]
    fn what_is_claimed() {
        let p1_p2 = RankClaim { unknowns: 15, decisions: 48, order: 24, row_degree: 3, row_bits: 16.0 };
        assert_eq!(claimed(&[["0", "0", "0"], ["180", "0", "0"]], None), p1_p2);
        // 10 degrees are a 36th of a turn: with multiples of 15 degrees, 72
        let finer = RankClaim { order: 72, ..p1_p2 };
        assert_eq!(claimed(&[["0", "0", "0"], ["180", "10", "0"]], None).order, finer.order);
        // one position: 2 3 4 of 15, so three orders; six sines and cosines of generic angles per factor of g
        let generic = claimed(&[["alpha", "0", "0"]], None);
        assert_eq!((generic.row_degree, generic.decisions), (3 + 18, 48));
    }

    /// The degrees under reset carry, position by position, equal those of all positions at once.
    #[test]
    fn degrees_alone_are_those_of_the_filtration() {
        let angles = [["0", "0", "0"], ["90", "0", "0"], ["0", "90", "30"]];
        for carry in Carry::ALL {
            // the unknown `drift` belongs to one position
            for (unknowns, positions) in [(Unknowns::default(), 3), (Unknowns::Drift, 1)] {
                let angles = angles[..positions].iter().map(|a| a.map(|x| x.parse().expect("an angle")));
                let scheme = Scheme { carry, unknowns: unknowns.clone(), ..Scheme::of_angles(angles) };
                let platform = Platform::new(scheme).expect("a scheme");
                let all = judge(&platform, 1).expect("verdicts").degrees;
                assert_eq!(degrees(&platform, 1).expect("degrees"), all, "{carry} {unknowns:?}");
                assert!(all.rank() > 3);
            }
        }
    }
}

//! Degrees of a scheme under reset carry, position by position. psi of a position occurs in its rows alone,
//! so it is eliminated there, and the remaining rows concern the coefficients. The general filtration would
//! need a matrix of all unknowns by all unknowns.

use obsdeg_exact::Echelon;

use super::filtration::Degrees;
use super::platform_rows::{LocalRow, local_chain};
use crate::model::platform::{FieldSample, LOCAL, Platform, PositionBlock};

/// Number of psi components of one position.
const PSI: usize = 3;

/// Degrees of a scheme under reset carry: the result of [`super::filtration::climb`], at less cost.
pub(super) fn reset_degrees(platform: &Platform, sample: &FieldSample) -> Degrees {
    let field = sample.point.ring;
    let chain = local_chain(&field, sample.point.w_n, sample.point.w_u, platform.observed());
    let blocks = platform.blocks(&sample.point);
    let n = platform.names().len();
    let (own, first) = (PSI + platform.coefficients(), n - platform.coefficients());
    let mut degrees = Degrees { degree: vec![None; n], excited: vec![false; n], ..Degrees::default() };
    // per position: psi, then the coefficients; in common: the coefficients
    let mut locals: Vec<(usize, Echelon)> = Vec::new();
    for block in &blocks {
        if locals.last().is_none_or(|(psi, _)| *psi != block.columns[0]) {
            locals.push((block.columns[0], Echelon::new(field, own)));
        }
    }
    let mut shared = Echelon::new(field, own - PSI);
    let mut rank = 0;
    for order in 0.. {
        if rank == n || !chain.iter().any(|r| r.order >= order) {
            break;
        }
        let mut next = 0;
        for block in &blocks {
            while locals[next].0 != block.columns[0] {
                next += 1;
            }
            for local in chain.iter().filter(|r| r.order == order) {
                let row = row(&field, local, block);
                for (&column, _) in block.columns.iter().zip(&row).filter(|(_, x)| **x != 0) {
                    degrees.excited[column] = true;
                }
                locals[next].1.insert(&row);
            }
        }
        rank = 0;
        for (_, basis) in &locals {
            let psi = basis.pivots().filter(|c| *c < PSI).count();
            rank += psi;
            for (i, _) in basis.pivots().enumerate().filter(|(_, c)| *c >= PSI) {
                shared.insert(&basis.row(i)[PSI..]);
            }
        }
        rank += shared.rank();
        for (psi, basis) in &locals {
            for c in (0..PSI).filter(|c| degrees.degree[psi + c].is_none()).collect::<Vec<_>>() {
                let alone = |row: &&[u64]| (0..PSI).all(|k| k == c || row[k] == 0);
                if basis.pivot_row(c).filter(alone).is_some_and(|row| shared.contains(&row[PSI..])) {
                    degrees.degree[psi + c] = Some(order);
                }
            }
        }
        for c in first..n {
            if degrees.degree[c].is_none() && shared.has_unit(c - first) {
                degrees.degree[c] = Some(order);
            }
        }
        degrees.rank_profile.push(rank);
    }
    degrees
}

/// Row of the local chain at one station, in the columns of its block.
fn row(field: &obsdeg_exact::Field, local: &LocalRow, block: &PositionBlock<u64>) -> Vec<u64> {
    let entry = |k: usize| {
        let terms = (0..LOCAL).filter(|&i| local.row[i] != 0).map(|i| (local.row[i], block.rows[i][k]));
        field.dot(0, terms)
    };
    (0..block.columns.len()).map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::degree::ensemble::filtration;
    use crate::model::platform::RandomValues;
    use crate::model::{Angle, Carry, ErrorSource, Rotation, Scheme, Term, Unknowns};
    use obsdeg_exact::SplitMix64;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        /// Both computations give the same verdicts: cardinal and other attitudes, rotating segments, any
        /// terms and latitudes.
        #[test]
        fn position_by_position_is_all_at_once(
            places in prop::collection::vec(prop::array::uniform3(-4i32..=4), 1..7),
            step in prop::sample::select(vec![90, 45, 20]),
            terms in prop::sample::subsequence(Term::ALL.to_vec(), 1..5),
            latitude in prop::option::of(prop::sample::select(vec!["0", "28.2", "90"])),
            measured_azimuth in any::<bool>(),
            turning in prop::option::of(0usize..6),
        ) {
            // a term and its lower triangle exclude each other
            let both = |whole, triangle| terms.contains(&whole) && terms.contains(&triangle);
            prop_assume!(!both(Term::GM, Term::GM3) && !both(Term::M6, Term::M3));
            let angles = places.iter().map(|p| p.map(|k| Angle::from_degrees(k * step)));
            let mut scheme = Scheme {
                carry: Carry::Reset,
                latitude: latitude.and_then(|l| l.parse().ok()),
                unknowns: Unknowns::Coefficients(terms),
                measured_azimuth,
                ..Scheme::of_angles(angles)
            };
            let drifts = scheme.unknowns.terms().iter().all(|t| t.source() == ErrorSource::Gravity);
            if let Some(p) = turning.filter(|_| drifts).and_then(|i| scheme.positions.get_mut(i)) {
                p.rotation = Rotation::new("X_p", "120").ok();
            }
            let values = RandomValues::draw(&scheme, &mut SplitMix64::new(5)).expect("a field");
            let platform = Platform::new(scheme).expect("a scheme");
            let sample = values.sample(platform.scheme(), 1);
            prop_assert_eq!(reset_degrees(&platform, &sample), filtration(&platform, &sample).0);
        }
    }
}

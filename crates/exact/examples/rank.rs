//! A rank that rounding hides: 8 cos 20 deg cos 40 deg cos 80 deg = 1, so three vectors lie in a plane.
//! In a prime field that contains the cosines of decimal degrees the determinant is zero, not small.
#![allow(clippy::print_stdout, reason = "an example")]

use obsdeg_exact::certainty::{RankClaim, error_bound};
use obsdeg_exact::turn::common_order;
use obsdeg_exact::{Echelon, PrimeError, RootField, SplitMix64, TurnFraction};

fn main() -> Result<(), PrimeError> {
    let angles = [20, 40, 80].map(|deg| TurnFraction::from_nanodeg(deg * 1_000_000_000));
    let [a, b, c] = angles.map(|angle| angle.cos_sin_f64().0);
    println!("in doubles: {:e}", 1.0 - 8.0 * a * b * c);

    let order = common_order(angles);
    let mut random = SplitMix64::new(1);
    for _ in 0..2 {
        let k = RootField::random(order, &mut random)?;
        let [a, b, c] = angles.map(|angle| k.unit_circle(angle).map_or(0, |z| k.cos_sin(z).0));
        let f = k.field;
        let mut space = Echelon::new(f, 3);
        for row in [[f.one(), 0, f.mul(a, b)], [0, f.one(), 0], [f.mul(f.from_i64(8), c), 0, f.one()]] {
            space.insert(&row);
        }
        println!("modulo {}: rank {} of 3", f.modulus(), space.rank());
    }
    // certainty of two fields that agree: a determinant of three rows, each below 2^4 without
    // denominators
    let claim = RankClaim { unknowns: 3, decisions: 1, order, row_degree: 0, row_bits: 4.0 };
    println!("wrong with probability below {:.0e}", error_bound(&claim, 2));
    Ok(())
}

//! Decimal degrees as exact fractions of a full turn, and their cosines and sines in a field.

use crate::{RootField, gcd};

/// A full turn in units of 1e-9 degrees.
const FULL_NANODEG: i64 = 360_000_000_000;

/// An angle of a whole number of 1e-9 degrees, reduced to one turn: `0 <= nanodeg < 360e9`.
///
/// ```
/// use obsdeg_exact::TurnFraction;
/// assert_eq!(TurnFraction::from_nanodeg(-90_000_000_000).degrees(), 270.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct TurnFraction(i64);

impl TurnFraction {
    /// The angle of `nanodeg` 1e-9 degrees.
    pub fn from_nanodeg(nanodeg: i64) -> Self {
        Self(nanodeg.rem_euclid(FULL_NANODEG))
    }

    /// The angle in units of 1e-9 degrees, `0..360e9`.
    pub fn nanodeg(self) -> i64 {
        self.0
    }

    /// The angle in degrees, `0..360`.
    pub fn degrees(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// True if the angle is a multiple of `deg` degrees.
    pub fn is_multiple_of_deg(self, deg: i64) -> bool {
        self.0 % (deg * 1_000_000_000) == 0
    }

    /// `(cos, sin)` as floating-point numbers, exact at multiples of 90 degrees.
    pub fn cos_sin_f64(self) -> (f64, f64) {
        const QUARTER: i64 = 90_000_000_000;
        // the difference from the nearest quarter turn is exact, so a small cosine or sine has all its
        // digits
        let quarters = (self.nanodeg() + QUARTER / 2).div_euclid(QUARTER);
        let rest = self.nanodeg() - quarters * QUARTER;
        let (s, c) = (rest as f64 * 1e-9).to_radians().sin_cos();
        match quarters.rem_euclid(4) {
            _ if rest == 0 => {
                [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][quarters.rem_euclid(4) as usize]
            }
            0 => (c, s),
            1 => (-s, c),
            2 => (-c, -s),
            _ => (s, -c),
        }
    }
}

/// Least order `n`, a multiple of 24, for which the n-th roots of unity represent every given angle.
pub fn common_order(angles: impl IntoIterator<Item = TurnFraction>) -> u64 {
    let unit = angles.into_iter().fold(FULL_NANODEG as u64 / 24, |u, a| gcd(u, a.0.unsigned_abs()));
    FULL_NANODEG as u64 / unit
}

impl RootField {
    /// The image of `exp(i angle)`; `None` if the order of this field does not represent the angle.
    pub fn unit_circle(&self, angle: TurnFraction) -> Option<u64> {
        let unit = FULL_NANODEG / self.order as i64;
        (angle.0 % unit == 0).then(|| self.field.pow(self.root, (angle.0 / unit) as u64))
    }

    /// The image of the imaginary unit.
    pub fn imaginary_unit(&self) -> u64 {
        self.field.pow(self.root, self.order / 4)
    }

    /// `(cos, sin)` of the angle whose `exp(i angle)` is `z` (not zero).
    pub fn cos_sin(&self, z: u64) -> (u64, u64) {
        let f = &self.field;
        let half = f.inv(f.from_i64(2));
        let inverse = f.inv(z);
        let cos = f.mul(f.add(z, inverse), half);
        // sin = (z - 1/z) / 2i, and 1/i = -i
        let sin = f.mul(f.mul(f.sub(inverse, z), half), self.imaginary_unit());
        (cos, sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SplitMix64;

    #[test]
    fn known_values_hold_in_the_field() {
        let deg = |d: i64| TurnFraction::from_nanodeg(d * 1_000_000_000);
        let k = RootField::random(common_order([deg(10)]), &mut SplitMix64::new(3)).expect("order");
        let f = &k.field;
        let cs = |a: TurnFraction| k.cos_sin(k.unit_circle(a).expect("angle fits"));
        assert_eq!(cs(deg(60)).0, f.from_ratio(1, 2));
        assert_eq!(cs(deg(-90)), (0, f.from_i64(-1)));
        assert_eq!(cs(deg(180)), (f.from_i64(-1), 0));
        // cos 20 is a root of 8 x^3 - 6 x - 1 (triple angle of 60 degrees)
        let x = cs(deg(20)).0;
        let cubic = f.sub(f.mul(f.from_i64(8), f.pow(x, 3)), f.mul(f.from_i64(6), x));
        assert_eq!(cubic, f.one());
        // addition theorem
        let ((c1, s1), (c2, s2)) = (cs(deg(70)), cs(deg(-130)));
        let sum = cs(deg(-60));
        assert_eq!(f.sub(f.mul(c1, c2), f.mul(s1, s2)), sum.0);
        assert_eq!(f.add(f.mul(s1, c2), f.mul(c1, s2)), sum.1);
    }

    #[test]
    fn orders_cover_the_angles() {
        let nano = TurnFraction::from_nanodeg;
        assert_eq!(common_order([]), 24);
        assert_eq!(common_order([nano(15_000_000_000), nano(-90_000_000_000)]), 24);
        assert_eq!(common_order([nano(10_000_000_000)]), 72);
        assert_eq!(common_order([nano(1)]), 360_000_000_000);
        let k = RootField::random(24, &mut SplitMix64::new(0)).expect("order");
        assert_eq!(k.unit_circle(nano(1)), None);
    }

    #[test]
    fn floats_snap_at_right_angles() {
        assert_eq!(TurnFraction::from_nanodeg(-90_000_000_000).cos_sin_f64(), (0.0, -1.0));
        let (c, s) = TurnFraction::from_nanodeg(30_000_000_000).cos_sin_f64();
        assert!((s - 0.5).abs() < 1e-15 && (c - 0.75f64.sqrt()).abs() < 1e-15);
    }
}

//! Numbers `a + b sqrt 2 + c sqrt 3 + d sqrt 6` recovered from their images in a prime field.

use std::fmt;

use crate::{Field, RootField, gcd};

/// Largest numerator and denominator that [`Radical::recover`] accepts.
const BOUND: u64 = 1 << 20;

/// A rational number in lowest terms, with a positive denominator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ratio {
    /// Numerator.
    pub num: i64,
    /// Denominator, positive.
    pub den: i64,
}

impl Ratio {
    /// The same number in lowest terms.
    fn reduced(self) -> Self {
        let g = gcd(self.num.unsigned_abs(), self.den.unsigned_abs()).max(1) as i64;
        Self { num: self.num / g, den: self.den / g }
    }

    /// The rational number with numerator and denominator up to 2^20 whose image is `value`; `None`
    /// without one.
    pub fn recover(field: &Field, value: u64) -> Option<Self> {
        Self::within(field, value, BOUND)
    }

    /// The rational number with numerator and denominator up to `bound` whose image is `value`; `None`
    /// without one.
    pub fn within(field: &Field, value: u64, bound: u64) -> Option<Self> {
        // half-extended Euclid (Wang 1981, doi:10.1145/800206.806398)
        let (mut r0, mut r1) = (field.modulus(), field.to_u64(value));
        let (mut t0, mut t1) = (0i64, 1i64);
        while r1 > bound {
            let q = r0 / r1;
            (r0, r1) = (r1, r0 - q * r1);
            (t0, t1) = (t1, t0.checked_sub((q as i64).checked_mul(t1)?)?);
        }
        let (num, den) = if t1 < 0 { (-(r1 as i64), -t1) } else { (r1 as i64, t1) };
        (den > 0 && den as u64 <= bound && field.from_ratio(num, den) == value).then_some(Self { num, den })
    }
}

/// Number `a + b sqrt 2 + c sqrt 3 + d sqrt 6` with rational coefficients, the field of cosines and
/// sines of multiples of 15 degrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Radical {
    /// Coefficients of 1, sqrt 2, sqrt 3, sqrt 6.
    pub coefficients: [Ratio; 4],
}

/// The exponents `a` of the four embeddings `g -> g^a` that a [`Radical`] is recovered from,
/// for fields of the given order: they fix or flip `sqrt 2` and `sqrt 3` in all four ways.
pub fn embeddings(order: u64) -> [u64; 4] {
    [1, 5, 7, 11].map(|a| {
        let prime_to_order =
            |e: &u64| [2, 3, 5].iter().all(|q| !order.is_multiple_of(*q) || !e.is_multiple_of(*q));
        // a + 24 j runs through all residues modulo 5, so one of the first five fits
        (0..5).map(|j| a + 24 * j).find(prime_to_order).unwrap_or(a)
    })
}

impl Radical {
    /// The number whose images under the four [`embeddings`] of `k` are `images`; `None` if its
    /// coefficients are not small. A coincidence has a probability near 2^-19 per coefficient; the
    /// caller compares with [`Radical::image`] in a second field.
    pub fn recover(k: &RootField, images: [u64; 4]) -> Option<Self> {
        let f = &k.field;
        let quarter = f.from_ratio(1, 4);
        let [v1, v5, v7, v11] = images;
        let mix = |s5: bool, s7: bool, s11: bool| {
            let signed = |plus: bool, v: u64| if plus { v } else { f.neg(v) };
            let sum = f.add(f.add(v1, signed(s5, v5)), f.add(signed(s7, v7), signed(s11, v11)));
            f.mul(sum, quarter)
        };
        let parts = [
            mix(true, true, true),
            mix(false, true, false),
            mix(false, false, true),
            mix(true, false, false),
        ];
        let roots = square_roots(k);
        let mut coefficients = [Ratio { num: 0, den: 1 }; 4];
        for (slot, (part, root)) in coefficients.iter_mut().zip(parts.into_iter().zip(roots)) {
            *slot = Ratio::recover(f, f.mul(part, f.inv(root)))?;
        }
        Some(Self { coefficients })
    }

    /// The image of this number in `k`.
    pub fn image(&self, k: &RootField) -> u64 {
        let f = &k.field;
        let terms = self.coefficients.iter().zip(square_roots(k));
        f.dot(0, terms.map(|(q, root)| (f.from_ratio(q.num, q.den), root)))
    }

    /// The nearest floating-point number.
    pub fn to_f64(&self) -> f64 {
        let roots = [1.0, 2f64.sqrt(), 3f64.sqrt(), 6f64.sqrt()];
        self.coefficients.iter().zip(roots).map(|(q, r)| q.num as f64 / q.den as f64 * r).sum()
    }

    /// Number of the four coefficients that are not zero.
    pub fn terms(&self) -> usize {
        self.coefficients.iter().filter(|q| q.num != 0).count()
    }

    /// The rational number `num / den` as given; `den` must be positive.
    pub fn rational(num: i64, den: i64) -> Self {
        let zero = Ratio { num: 0, den: 1 };
        Self { coefficients: [Ratio { num, den }.reduced(), zero, zero, zero] }
    }

    /// The sum, or `None` on overflow.
    #[must_use]
    pub fn checked_add(&self, other: &Self) -> Option<Self> {
        let mut sum = *self;
        for (a, b) in sum.coefficients.iter_mut().zip(other.coefficients) {
            let num = a.num.checked_mul(b.den)?.checked_add(b.num.checked_mul(a.den)?)?;
            *a = Ratio { num, den: a.den.checked_mul(b.den)? }.reduced();
        }
        Some(sum)
    }

    /// The number negated.
    #[must_use]
    pub fn negated(mut self) -> Self {
        for q in &mut self.coefficients {
            q.num = -q.num;
        }
        self
    }
}

impl fmt::Display for Radical {
    /// For instance `1/2`, `-sqrt(3)/2` or `sqrt(6)/4+sqrt(2)/4`.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut first = true;
        for (q, root) in self.coefficients.iter().zip([1, 2, 3, 6]) {
            if q.num == 0 {
                continue;
            }
            let sign = if q.num < 0 {
                "-"
            } else if first {
                ""
            } else {
                "+"
            };
            first = false;
            match (q.num.unsigned_abs(), root) {
                (n, 1) => write!(out, "{sign}{n}")?,
                (1, r) => write!(out, "{sign}sqrt({r})")?,
                (n, r) => write!(out, "{sign}{n}*sqrt({r})")?,
            }
            if q.den != 1 {
                write!(out, "/{}", q.den)?;
            }
        }
        if first { out.write_str("0") } else { Ok(()) }
    }
}

/// Images of 1, sqrt 2, sqrt 3, sqrt 6: `2 cos 45` and `2 cos 30` degrees in roots of unity.
fn square_roots(k: &RootField) -> [u64; 4] {
    let f = &k.field;
    let twice_cos = |parts: u64| {
        let z = f.pow(k.root, k.order / parts);
        f.add(z, f.inv(z))
    };
    let (r2, r3) = (twice_cos(8), twice_cos(12));
    [f.one(), r2, r3, f.mul(r2, r3)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{SplitMix64, TurnFraction};
    use proptest::prelude::*;

    fn ratio(num: i64, den: i64) -> Ratio {
        Ratio { num, den }
    }

    proptest! {
        #[test]
        fn recovers_what_was_sent(n in prop::array::uniform4(-900i64..900), seed in any::<u64>(),
                                  order in prop::sample::select(vec![24u64, 72, 360, 3600])) {
            let sent = Radical { coefficients: [ratio(n[0], 1), ratio(n[1], 1), ratio(n[2], 1), ratio(n[3], 1)] };
            let k = RootField::random(order, &mut SplitMix64::new(seed)).expect("order");
            let images = embeddings(order).map(|a| sent.image(&k.conjugate(a)));
            prop_assert_eq!(Radical::recover(&k, images), Some(sent));
        }
    }

    #[test]
    fn embeddings_are_units_that_move_the_square_roots_in_all_four_ways() {
        for order in [24, 72, 120, 360, 600, 3600, 1_800_000, 360_000_000_000] {
            let all = embeddings(order);
            // sqrt 2 = 2 cos 45 and sqrt 3 = 2 cos 30 depend on the residue modulo 8 and 12, so modulo
            // 24
            assert_eq!(all.map(|a| a % 24), [1, 5, 7, 11], "{order}");
            assert_eq!(all.map(|a| gcd(a, order)), [1; 4], "{order}");
        }
        assert_eq!(embeddings(24), [1, 5, 7, 11]);
        // 5 shares a factor with 120: the next is 29
        assert_eq!(embeddings(120), [1, 29, 7, 11]);
    }

    #[test]
    fn images_under_every_embedding() {
        let k = RootField::random(120, &mut SplitMix64::new(17)).expect("order");
        let f = &k.field;
        let [_, r2, r3, r6] = square_roots(&k);
        assert_eq!([f.mul(r2, r2), f.mul(r3, r3), f.mul(r6, r6)], [2, 3, 6].map(|x| f.from_i64(x)));
        // exp(2 pi i 5 / 8) = -exp(2 pi i / 8): 5 and 7 modulo 8 and 12 give the signs (-, -), (+, -),
        // (-, +)
        let signs = [(1, 1), (-1, -1), (1, -1), (-1, 1)];
        for (a, (s2, s3)) in embeddings(120).into_iter().zip(signs) {
            let [_, c2, c3, _] = square_roots(&k.conjugate(a));
            assert_eq!((c2, c3), (f.mul(f.from_i64(s2), r2), f.mul(f.from_i64(s3), r3)), "{a}");
        }
    }

    #[test]
    fn ratios_at_the_bound() {
        let f = Field::new((1 << 60) + 33);
        for (num, den) in [(1 << 20, 1), (-(1 << 20), (1 << 20) - 1), (1, 1 << 20), (0, 1), (-7, 3)] {
            assert_eq!(Ratio::recover(&f, f.from_ratio(num, den)), Some(ratio(num, den)), "{num}/{den}");
        }
        for (num, den) in [((1 << 20) + 1, 1), (1, (1 << 20) + 1), (-(1 << 20) - 5, 7)] {
            assert_eq!(Ratio::recover(&f, f.from_ratio(num, den)), None, "{num}/{den}");
        }
    }

    #[test]
    fn printed_with_signs_and_roots() {
        let of = |c: [(i64, i64); 4]| Radical { coefficients: c.map(|(n, d)| ratio(n, d)) };
        let zero = (0, 1);
        assert_eq!(of([zero; 4]).to_string(), "0");
        assert_eq!(of([(-1, 2), (3, 4), zero, (-1, 1)]).to_string(), "-1/2+3*sqrt(2)/4-sqrt(6)");
        let mixed = of([(-1, 2), (3, 4), zero, (-1, 1)]);
        assert_eq!((mixed.terms(), mixed.negated().terms()), (3, 3));
        assert!((mixed.to_f64() - (-0.5 + 0.75 * 2f64.sqrt() - 6f64.sqrt())).abs() < 1e-15);
        assert!((mixed.negated().to_f64() + mixed.to_f64()).abs() < 1e-15);
    }

    #[test]
    fn cosine_of_fifteen_degrees() {
        let k = RootField::random(24, &mut SplitMix64::new(11)).expect("order");
        let images = embeddings(24).map(|a| {
            let k = k.conjugate(a);
            k.cos_sin(k.unit_circle(TurnFraction::from_nanodeg(15_000_000_000)).expect("fits")).0
        });
        let cos15 = Radical::recover(&k, images).expect("a radical");
        assert_eq!(cos15.to_string(), "sqrt(2)/4+sqrt(6)/4");
        assert!((cos15.to_f64() - 15f64.to_radians().cos()).abs() < 1e-15);
    }

    #[test]
    fn sums_are_reduced() {
        let half = Radical::rational(1, 2);
        assert_eq!(half.checked_add(&half), Some(Radical::rational(1, 1)));
    }

    #[test]
    fn what_is_no_radical_is_refused() {
        let k = RootField::random(72, &mut SplitMix64::new(5)).expect("order");
        let images = embeddings(72).map(|a| {
            let k = k.conjugate(a);
            k.cos_sin(k.unit_circle(TurnFraction::from_nanodeg(20_000_000_000)).expect("fits")).0
        });
        assert_eq!(Radical::recover(&k, images), None);
    }
}

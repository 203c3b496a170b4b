//! Products of polynomials over a prime field by number-theoretic transforms (Pollard 1971,
//! doi:10.1090/S0025-5718-1971-0301966-0).

use std::collections::HashMap;

use crate::Field;

/// Number of coefficients below which a product is summed directly.
const SHORT: usize = 96;

/// Products of polynomials whose lengths together are below a bound.
///
/// ```
/// use obsdeg_exact::{Field, SplitMix64, RootField, transform::Transform};
/// let f = RootField::random(1 << 8, &mut SplitMix64::new(1))?.field;
/// let mut t = Transform::new(f, 100);
/// let of = |a: &[i64]| a.iter().map(|&x| f.from_i64(x)).collect::<Vec<_>>();
/// // (1 + x)(1 - x), two coefficients of it
/// assert_eq!(t.products(&of(&[1, 1]), &[(0, &of(&[1, -1]))], 2), [of(&[1, 0])]);
/// # Ok::<(), obsdeg_exact::PrimeError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Transform {
    f: Field,
    /// `roots[l][j]`: the j-th power of a primitive root of order `2^(l + 1)`, for j below `2^l`; none where
    /// the field lacks the roots.
    roots: Vec<Vec<u64>>,
    /// Powers of the inverse roots, as `roots`.
    inverses: Vec<Vec<u64>>,
    /// Transforms of factors by their keys, at one size.
    spectra: HashMap<usize, Vec<u64>>,
    size: usize,
}

impl Transform {
    /// Transforms for products of two polynomials of up to `length` coefficients. They are fast if p -
    /// 1 is divisible by the smallest power of two that is at least twice the length.
    pub fn new(f: Field, length: usize) -> Self {
        let size = (2 * length).next_power_of_two().max(2);
        let order = size as u64;
        let mut out = Self { f, roots: Vec::new(), inverses: Vec::new(), spectra: HashMap::new(), size: 0 };
        if length < SHORT || !(f.modulus() - 1).is_multiple_of(order) {
            return out;
        }
        // half of all elements have a power of that order
        let power = |x: u64| f.pow(f.from_u64(x), (f.modulus() - 1) / order);
        let Some(root) = (2..1000).map(power).find(|&g| f.pow(g, order / 2) != f.one()) else { return out };
        let tables = |root: u64| -> Vec<Vec<u64>> {
            let levels = 0..size.trailing_zeros();
            let level = |l: u32| {
                let step = f.pow(root, order >> (l + 1));
                std::iter::successors(Some(f.one()), |&x| Some(f.mul(x, step))).take(1 << l).collect()
            };
            levels.map(level).collect()
        };
        (out.roots, out.inverses) = (tables(root), tables(f.inv(root)));
        out
    }

    /// The first `n` coefficients of the product, zeros where it has fewer.
    pub fn product(&self, a: &[u64], b: &[u64], n: usize) -> Vec<u64> {
        let f = &self.f;
        let (a, b) = (&a[..a.len().min(n)], &b[..b.len().min(n)]);
        let back: Vec<u64> = b.iter().rev().copied().collect();
        let coefficient = |k: usize| {
            // a_j b_(k-j), for valid indices of both
            let (from, to) = ((k + 1).saturating_sub(b.len()), (k + 1).min(a.len()));
            if from >= to {
                return 0;
            }
            let start = b.len() - 1 + from - k;
            f.dot(0, a[from..to].iter().copied().zip(back[start..].iter().copied()))
        };
        (0..n).map(coefficient).collect()
    }

    /// The first `n` coefficients of the product with each of several polynomials, which are identified
    /// by keys: equal keys must mean equal polynomials.
    pub fn products(&mut self, a: &[u64], factors: &[(usize, &[u64])], n: usize) -> Vec<Vec<u64>> {
        let a = &a[..a.len().min(n)];
        let size = (2 * n).next_power_of_two();
        if n < SHORT || size.trailing_zeros() as usize > self.roots.len() {
            return factors.iter().map(|(_, b)| self.product(a, b, n)).collect();
        }
        if size != self.size {
            self.spectra.clear();
            self.size = size;
        }
        let padded = |x: &[u64]| {
            let mut out = x.to_vec();
            out.resize(size, 0);
            self.forward(&mut out);
            out
        };
        let spectrum = padded(a);
        // n coefficients of one, size/2 of the other: no wrap-around
        let new = factors.iter().filter(|(key, _)| !self.spectra.contains_key(key));
        let new: Vec<_> = new.map(|(key, b)| (*key, padded(&b[..b.len().min(size / 2)]))).collect();
        self.spectra.extend(new);
        let f = &self.f;
        let product = |(key, _): &(usize, &[u64])| {
            let mut out: Vec<u64> =
                spectrum.iter().zip(&self.spectra[key]).map(|(x, y)| f.loose_product(*x, *y)).collect();
            self.backward(&mut out);
            out.truncate(n);
            out
        };
        factors.iter().map(product).collect()
    }

    /// Values at the powers of the root, in bit-reversed order, below 2p.
    fn forward(&self, x: &mut [u64]) {
        let (f, p) = (&self.f, self.f.modulus());
        for l in (0..x.len().trailing_zeros() as usize).rev() {
            for block in x.chunks_exact_mut(2 << l) {
                let (low, high) = block.split_at_mut(1 << l);
                for ((u, v), w) in low.iter_mut().zip(high).zip(&self.roots[l]) {
                    // all below 2p (Harvey 2014, doi:10.1016/j.jsc.2013.09.002)
                    let (sum, difference) = (*u + *v, *u + 2 * p - *v);
                    (*u, *v) = (f.loosely(sum), f.loose_product(difference, *w));
                }
            }
        }
    }

    /// Inverse of [`Transform::forward`].
    fn backward(&self, x: &mut [u64]) {
        let (f, p) = (&self.f, self.f.modulus());
        for l in 0..x.len().trailing_zeros() as usize {
            for block in x.chunks_exact_mut(2 << l) {
                let (low, high) = block.split_at_mut(1 << l);
                for ((u, v), w) in low.iter_mut().zip(high).zip(&self.inverses[l]) {
                    let turned = f.loose_product(*v, *w);
                    (*u, *v) = (f.loosely(*u + turned), f.loosely(*u + 2 * p - turned));
                }
            }
        }
        let scale = f.inv(f.from_u64(x.len() as u64));
        x.iter_mut().for_each(|x| *x = f.mul(*x, scale));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{RootField, SplitMix64};

    #[test]
    fn products_as_they_are_written() {
        let mut rng = SplitMix64::new(3);
        let with = RootField::random(1 << 12, &mut rng).expect("an order").field;
        let without = Field::new((1 << 60) + 33);
        for (f, fast) in [(with, true), (without, false)] {
            let mut t = Transform::new(f, 900);
            assert_eq!(!t.roots.is_empty(), fast);
            for (m, k, n) in [
                (1, 1, 1),
                (3, 5, 4),
                (5, 3, 12),
                (700, 700, 700),
                (700, 150, 300),
                (200, 650, 900),
                (97, 96, 50),
            ] {
                let mut draw = |m: usize| (0..m).map(|_| rng.below(f.modulus())).collect::<Vec<u64>>();
                let (a, b) = (draw(m), draw(k));
                let mut slow = vec![0; n];
                for (i, x) in a.iter().enumerate() {
                    for (j, y) in b.iter().enumerate().filter(|(j, _)| i + j < n) {
                        slow[i + j] = f.add(slow[i + j], f.mul(*x, *y));
                    }
                }
                assert_eq!(t.product(&a, &b, n), slow, "{m} {k} {n}");
                t.spectra.clear();
                let (one, other) = ((1, &b[..]), (2, &a[..]));
                assert_eq!(t.products(&a, &[one, other], n)[0], slow, "{m} {k} {n}");
                // a known key, with fewer coefficients
                let less = (n - n / 8).max(1);
                assert_eq!(t.products(&a, &[one], less), [&slow[..less]], "{m} {k} {n}");
            }
        }
    }
}

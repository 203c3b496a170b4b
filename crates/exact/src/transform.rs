//! Products of polynomials over a prime field by number-theoretic transforms (Pollard 1971,
//! doi:10.1090/S0025-5718-1971-0301966-0).

use std::collections::HashMap;

use crate::{Field, interrupt};

/// Number of coefficients below which a product is summed directly.
const SHORT: usize = 64;

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
    roots: Vec<Vec<FixedFactor>>,
    /// Powers of the inverse roots, as `roots`.
    inverses: Vec<Vec<FixedFactor>>,
    /// Transforms of factors by their keys, at one size, over the lengths of their blocks.
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
        let tables = |root: u64| -> Vec<Vec<FixedFactor>> {
            let levels = 0..size.trailing_zeros();
            let level = |l: u32| {
                let step = f.pow(root, order >> (l + 1));
                let powers = std::iter::successors(Some(f.one()), |&x| Some(f.mul(x, step))).take(1 << l);
                powers.map(|x| FixedFactor::new(&f, x)).collect()
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
        let lists: Vec<_> = factors.iter().map(|&(key, b)| vec![(0, key, b)]).collect();
        self.sums(&[Some(a)], &lists, n).into_iter().flatten().collect()
    }

    /// For each list of `(index, key, factor)` the first `n` coefficients of the sum of the products of
    /// `of[index]` and the factor; `None` if there is none of these. Equal keys must mean equal factors.
    pub fn sums(
        &mut self,
        of: &[Option<&[u64]>],
        lists: &[Vec<(usize, usize, &[u64])>],
        n: usize,
    ) -> Vec<Option<Vec<u64>>> {
        let f = self.f;
        let size = size_for(n);
        if n < SHORT || size.next_power_of_two().trailing_zeros() as usize > self.roots.len() {
            return lists.iter().map(|list| self.sum_of_products(of, list, n)).collect();
        }
        if size != self.size {
            self.spectra.clear();
            self.size = size;
        }
        // n coefficients of one, half of the size of the other: no wrap-around
        let scale = self.scales(size);
        for &(i, key, b) in lists.iter().flatten() {
            if of[i].is_some() && !self.spectra.contains_key(&key) {
                let mut spectrum = self.spectrum(&b[..b.len().min(size / 2)], size);
                let (low, high) = spectrum.split_at_mut(first_block(size));
                low.iter_mut().for_each(|x| *x = f.loose_product(*x, scale[0]));
                high.iter_mut().for_each(|x| *x = f.loose_product(*x, scale[1]));
                self.spectra.insert(key, spectrum);
            }
        }
        let mut used = vec![false; of.len()];
        lists.iter().flatten().for_each(|part| used[part.0] = true);
        let spectrum = |a: &[u64]| {
            interrupt::check();
            self.spectrum(&a[..a.len().min(n)], size)
        };
        let spectra: Vec<Option<Vec<u64>>> =
            of.iter().zip(&used).map(|(a, used)| a.filter(|_| *used).map(spectrum)).collect();
        let sum = |list: &Vec<(usize, usize, &[u64])>| {
            interrupt::check();
            let part =
                |&(i, key, _): &(usize, usize, &[u64])| Some((spectra[i].as_ref()?, &self.spectra[&key]));
            let parts: Vec<_> = list.iter().filter_map(part).collect();
            // two products are reduced together
            let products = |pair: &[(&Vec<u64>, &Vec<u64>)]| -> Vec<u64> {
                let all = pair.iter().map(|(a, b)| a.iter().zip(*b));
                match pair {
                    [(a, b), (c, d)] => {
                        let pairs = a.iter().zip(*b).zip(c.iter().zip(*d));
                        pairs.map(|((a, b), (c, d))| f.loose_sum([*a, *b], [*c, *d])).collect()
                    }
                    _ => all.flatten().map(|(a, b)| f.loose_product(*a, *b)).collect(),
                }
            };
            let out = parts.chunks(2).map(products).reduce(|mut sum, more| {
                sum.iter_mut().zip(more).for_each(|(x, y)| *x = f.loosely(*x + y));
                sum
            })?;
            Some(self.coefficients(out, n))
        };
        lists.iter().map(sum).collect()
    }

    /// A sum of products as in `sums`, each product by itself.
    fn sum_of_products(
        &self,
        of: &[Option<&[u64]>],
        list: &[(usize, usize, &[u64])],
        n: usize,
    ) -> Option<Vec<u64>> {
        interrupt::check();
        let products = list.iter().filter_map(|&(i, _, b)| Some(self.product(of[i]?, b, n)));
        products.reduce(|mut sum, product| {
            sum.iter_mut().zip(product).for_each(|(x, y)| *x = self.f.add(*x, y));
            sum
        })
    }

    /// Inverses of the sizes of the blocks of a spectrum.
    fn scales(&self, size: usize) -> [u64; 2] {
        let first = first_block(size) as u64;
        [first, first / 2].map(|block| self.f.inv(self.f.from_u64(block)))
    }

    /// Values of a polynomial of at most `size / 2` coefficients, below 2p: at the powers of the root of
    /// order `size` if that is a power of two. Of `3 M / 2` values, M are at the powers of the root of order
    /// M, and the rest at the zeros of `x^(M/2) - i`, with `i^2 = -1`.
    fn spectrum(&self, a: &[u64], size: usize) -> Vec<u64> {
        let (f, p) = (&self.f, self.f.modulus());
        let first = first_block(size);
        let mut out = a.to_vec();
        out.resize(first, 0);
        if size > first {
            let half = first / 2;
            let roots = &self.roots[first.trailing_zeros() as usize];
            let turned: Vec<u64> = a.iter().zip(roots).map(|(x, w)| w.times(p, *x)).collect();
            let fold = |j: usize| match (turned.get(j), turned.get(j + half)) {
                (Some(x), Some(y)) => f.loosely(x + y),
                (x, _) => x.copied().unwrap_or(0),
            };
            let mut rest: Vec<u64> = (0..half).map(fold).collect();
            self.forward(&mut rest);
            self.forward(&mut out);
            out.extend(rest);
        } else {
            self.forward(&mut out);
        }
        out
    }

    /// The first `n` coefficients of the polynomial with these values, multiplied by the sizes of the blocks.
    fn coefficients(&self, mut spectrum: Vec<u64>, n: usize) -> Vec<u64> {
        let (f, p, size) = (&self.f, self.f.modulus(), spectrum.len());
        let first = first_block(size);
        let (low, rest) = spectrum.split_at_mut(first);
        self.backward(low);
        if size > first {
            self.backward(rest);
            // C = A modulo x^M - 1 and B modulo x^(M/2) - i: with A = A' + x^(M/2) A'' the first M/2
            // coefficients are those of (A' - i A'' + B)/2
            let half = first / 2;
            let level = first.trailing_zeros() as usize;
            let (i, inverses) = (self.roots[level][half], &self.inverses[level]);
            let two = FixedFactor::new(f, f.inv(f.from_u64(2)));
            for (j, b) in rest.iter().enumerate().take(n) {
                let (b, turned) = (inverses[j].times(p, *b), i.times(p, low[j + half]));
                low[j] = two.times(p, f.loosely(low[j] + b) + 2 * p - turned);
            }
        }
        spectrum.truncate(n);
        spectrum.iter_mut().for_each(|x| *x = f.reduced(*x));
        spectrum
    }

    /// Values at the powers of the root, in bit-reversed order, below 2p.
    fn forward(&self, x: &mut [u64]) {
        let (f, p) = (&self.f, self.f.modulus());
        // all below 2p (Harvey 2014, doi:10.1016/j.jsc.2013.09.002)
        let turn = |u: u64, v: u64, w: &FixedFactor| (f.loosely(u + v), w.times(p, u + 2 * p - v));
        let mut l = x.len().trailing_zeros() as usize;
        // two layers at once, so that each number is loaded and stored half as often
        while l > 3 {
            let (roots, inner) = (&self.roots[l - 1], &self.roots[l - 2]);
            for block in x.chunks_exact_mut(1 << l) {
                let [a, b, c, d] = quarters(block);
                let (low, high) = roots.split_at(a.len());
                for j in 0..a.len() {
                    let (even, other) = turn(a[j], c[j], &low[j]);
                    let (odd, turned) = turn(b[j], d[j], &high[j]);
                    (a[j], b[j]) = turn(even, odd, &inner[j]);
                    (c[j], d[j]) = turn(other, turned, &inner[j]);
                }
            }
            l -= 2;
        }
        if l == 3 {
            for block in x.as_chunks_mut::<8>().0 {
                for j in 0..4 {
                    (block[j], block[j + 4]) = turn(block[j], block[j + 4], &self.roots[2][j]);
                }
            }
        }
        let i = self.roots[1][1];
        for block in x.as_chunks_mut::<4>().0 {
            let [a, b, c, d] = *block;
            let (even, odd) = (f.loosely(a + c), f.loosely(b + d));
            let (other, turned) = (f.loosely(a + 2 * p - c), i.times(p, b + 2 * p - d));
            *block = [even + odd, even + 2 * p - odd, other + turned, other + 2 * p - turned]
                .map(|x| f.loosely(x));
        }
    }

    /// Inverse of [`Transform::forward`], multiplied by the length.
    fn backward(&self, x: &mut [u64]) {
        let (f, p) = (&self.f, self.f.modulus());
        let turn = |u: u64, v: u64, w: &FixedFactor| {
            let turned = w.times(p, v);
            (f.loosely(u + turned), f.loosely(u + 2 * p - turned))
        };
        let i = self.inverses[1][1];
        for block in x.as_chunks_mut::<4>().0 {
            let [a, b, c, d] = *block;
            let (even, odd) = (f.loosely(a + b), f.loosely(a + 2 * p - b));
            let (other, turned) = (f.loosely(c + d), i.times(p, c + 2 * p - d));
            *block = [even + other, odd + turned, even + 2 * p - other, odd + 2 * p - turned]
                .map(|x| f.loosely(x));
        }
        let (mut l, last) = (2, x.len().trailing_zeros() as usize);
        if last % 2 == 1 {
            for block in x.as_chunks_mut::<8>().0 {
                for j in 0..4 {
                    (block[j], block[j + 4]) = turn(block[j], block[j + 4], &self.inverses[2][j]);
                }
            }
            l = 3;
        }
        while l < last {
            let (inner, roots) = (&self.inverses[l], &self.inverses[l + 1]);
            for block in x.chunks_exact_mut(4 << l) {
                let [a, b, c, d] = quarters(block);
                let (low, high) = roots.split_at(a.len());
                for j in 0..a.len() {
                    let (even, odd) = turn(a[j], b[j], &inner[j]);
                    let (other, turned) = turn(c[j], d[j], &inner[j]);
                    (a[j], c[j]) = turn(even, other, &low[j]);
                    (b[j], d[j]) = turn(odd, turned, &high[j]);
                }
            }
            l += 2;
        }
    }
}

/// Four parts of equal length.
fn quarters(block: &mut [u64]) -> [&mut [u64]; 4] {
    let quarter = block.len() / 4;
    let (low, high) = block.split_at_mut(2 * quarter);
    let ((a, b), (c, d)) = (low.split_at_mut(quarter), high.split_at_mut(quarter));
    [a, &mut b[..quarter], &mut c[..quarter], &mut d[..quarter]]
}

/// Factor by which many numbers are multiplied: its value, and the quotient of `2^64` times it by p (Shoup's
/// method, as in Harvey 2014).
#[derive(Debug, Clone, Copy)]
struct FixedFactor {
    value: u64,
    quotient: u64,
}

impl FixedFactor {
    fn new(f: &Field, x: u64) -> Self {
        let value = f.to_u64(x);
        Self { value, quotient: ((u128::from(value) << 64) / u128::from(f.modulus())) as u64 }
    }

    /// The product with any number, below 2p.
    #[inline]
    fn times(&self, p: u64, x: u64) -> u64 {
        let quotient = ((u128::from(x) * u128::from(self.quotient)) >> 64) as u64;
        x.wrapping_mul(self.value).wrapping_sub(quotient.wrapping_mul(p))
    }
}

/// Number of values that determine a product of two polynomials of n coefficients: a power of two, or three
/// quarters of one.
fn size_for(n: usize) -> usize {
    let size = (2 * n).next_power_of_two();
    if 8 * n <= 3 * size { size / 4 * 3 } else { size }
}

/// Length of the first block of a spectrum: all of it, or two thirds.
fn first_block(size: usize) -> usize {
    if size.is_power_of_two() { size } else { size / 3 * 2 }
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

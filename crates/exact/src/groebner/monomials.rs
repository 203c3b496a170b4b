//! Table of monomials: numbers in place of exponents, with their order, products and quotients.

use std::cmp::Ordering;

use super::work::OverLimit;
use crate::SplitMix64;
use crate::multivariate::Monomial;

/// Monomials by number; equal monomials have the same number.
#[derive(Debug, Clone)]
pub(super) struct MonomialTable {
    pub(super) weights: Vec<u32>,
    exponents: Vec<u8>,
    pub(super) degree: Vec<u32>,
    /// Bit mask of the variables that occur, modulo 64.
    mask: Vec<u64>,
    /// Hash: the sum of exponents times `keys`, so that the hash of a product is a sum.
    hash: Vec<u64>,
    keys: Vec<u64>,
    /// Open addressing by hash; the size is a power of two, at most half of it is used.
    slots: Vec<u32>,
}

/// Empty slot of the hash table.
const EMPTY: u32 = u32::MAX;

impl MonomialTable {
    pub(super) fn new(weights: &[u32]) -> Self {
        let mut rng = SplitMix64::new(0);
        Self {
            weights: weights.to_vec(),
            exponents: Vec::new(),
            degree: Vec::new(),
            mask: Vec::new(),
            hash: Vec::new(),
            keys: weights.iter().map(|_| rng.next_u64()).collect(),
            slots: vec![EMPTY; 1024],
        }
    }

    pub(super) fn of(&self, m: u32) -> &[u8] {
        let n = self.weights.len();
        &self.exponents[m as usize * n..(m as usize + 1) * n]
    }

    /// The slot of the monomial with this hash for which `is` is true, or the slot where it goes.
    fn slot(&self, hash: u64, is: impl Fn(u32) -> bool) -> usize {
        let last = self.slots.len() - 1;
        let mut at = (hash >> 20) as usize & last;
        while self.slots[at] != EMPTY && !(self.hash[self.slots[at] as usize] == hash && is(self.slots[at])) {
            at = (at + 1) & last;
        }
        at
    }

    pub(super) fn put(&mut self, exponents: &[u8]) -> u32 {
        let hash = exponents
            .iter()
            .zip(&self.keys)
            .fold(0u64, |h, (&e, k)| h.wrapping_add(k.wrapping_mul(e.into())));
        let slot = self.slot(hash, |m| self.of(m) == exponents);
        if self.slots[slot] != EMPTY {
            return self.slots[slot];
        }
        let m = self.degree.len() as u32;
        self.degree.push(exponents.iter().zip(&self.weights).map(|(&e, w)| u32::from(e) * w).sum());
        let bit = |(v, &e): (usize, &u8)| u64::from(e > 0) << (v % 64);
        self.mask.push(exponents.iter().enumerate().map(bit).fold(0, |a, b| a | b));
        self.hash.push(hash);
        self.exponents.extend_from_slice(exponents);
        self.slots[slot] = m;
        if self.degree.len() * 2 > self.slots.len() {
            self.slots = vec![EMPTY; self.slots.len() * 2];
            for m in 0..self.degree.len() {
                let slot = self.slot(self.hash[m], |_| false);
                self.slots[slot] = m as u32;
            }
        }
        m
    }

    pub(super) fn monomial(&mut self, m: &Monomial) -> Result<u32, OverLimit> {
        let mut dense = vec![0u8; self.weights.len()];
        for &(v, e) in m {
            dense[v as usize] = u8::try_from(e).map_err(|_| OverLimit)?;
        }
        Ok(self.put(&dense))
    }

    /// Combines two monomials exponent by exponent.
    fn combined(&mut self, a: u32, b: u32, rule: impl Fn(u8, u8) -> Option<u8>) -> Result<u32, OverLimit> {
        let both = self.of(a).iter().zip(self.of(b));
        let dense: Option<Vec<u8>> = both.map(|(&x, &y)| rule(x, y)).collect();
        Ok(self.put(&dense.ok_or(OverLimit)?))
    }

    pub(super) fn product(&mut self, a: u32, b: u32) -> Result<u32, OverLimit> {
        let hash = self.hash[a as usize].wrapping_add(self.hash[b as usize]);
        let is = |m: u32| {
            let both = self.of(a).iter().zip(self.of(b));
            both.zip(self.of(m)).all(|((&x, &y), &z)| x.checked_add(y) == Some(z))
        };
        match self.slots[self.slot(hash, is)] {
            EMPTY => self.combined(a, b, u8::checked_add),
            m => Ok(m),
        }
    }

    pub(super) fn lcm(&mut self, a: u32, b: u32) -> Result<u32, OverLimit> {
        self.combined(a, b, |x, y| Some(x.max(y)))
    }

    /// The quotient `a / b`, where b divides a.
    pub(super) fn quotient(&mut self, a: u32, b: u32) -> Result<u32, OverLimit> {
        self.combined(a, b, u8::checked_sub)
    }

    pub(super) fn divides(&self, a: u32, b: u32) -> bool {
        self.mask[a as usize] & !self.mask[b as usize] == 0
            && self.degree[a as usize] <= self.degree[b as usize]
            && self.of(a).iter().zip(self.of(b)).all(|(x, y)| x <= y)
    }

    pub(super) fn disjoint(&self, a: u32, b: u32) -> bool {
        self.of(a).iter().zip(self.of(b)).all(|(&x, &y)| x == 0 || y == 0)
    }

    pub(super) fn compare(&self, a: u32, b: u32) -> Ordering {
        self.degree[a as usize].cmp(&self.degree[b as usize]).then_with(|| {
            // of two monomials of one degree, the one with the smaller exponent in the last variable in
            // which they differ is larger
            self.of(b).iter().rev().cmp(self.of(a).iter().rev())
        })
    }
}

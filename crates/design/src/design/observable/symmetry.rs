//! Turns of the platform axes under a scheme: 24 rotations P, `C_c^n -> C_c^n P`, that map schemes to
//! equally good ones.
//!
//! `g^c` becomes `P^T g^c`. Where every column of `C P E(P^T g)` is, up to sign, a column of `C E(g)`,
//! the new scheme is the old one with the coefficients renamed, for example D_SX for D_IY. Then a
//! search needs only schemes whose first position is the first of an orbit.

use std::collections::HashMap;

use obsdeg_exact::{Field, SplitMix64};

use obsdeg_core::model::{Matrix3, Platform, earth_rate_in, product};

/// Orbits of the candidates.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CandidateSymmetry {
    /// Number of rotations that map candidates to candidates and coefficients to equal coefficients.
    pub order: usize,
    /// Orbit of every candidate: index from 0.
    pub orbit: Vec<usize>,
    /// Image of every candidate under each of these rotations; the identity if there is no other.
    pub maps: Vec<Vec<usize>>,
}

impl CandidateSymmetry {
    /// Symmetry of candidates given by their `C_c^n` in some fields, all of which must agree; `same(i,
    /// j)` is true if coefficients i and j are equivalent for the search.
    pub fn new(
        fields: &[(Field, &[Matrix3<u64>])],
        platform: &Platform,
        same: &dyn Fn(usize, usize) -> bool,
    ) -> Self {
        let candidates = fields.first().map_or(0, |(_, attitudes)| attitudes.len());
        let maps_in = |(f, attitudes): &(Field, &[Matrix3<u64>])| -> Vec<Option<Vec<usize>>> {
            let places: HashMap<&Matrix3<u64>, usize> =
                attitudes.iter().enumerate().map(|(i, c)| (c, i)).collect();
            let map = |p: &Matrix3<u64>| -> Option<Vec<usize>> {
                attitudes.iter().map(|c| places.get(&product(f, c, p)).copied()).collect()
            };
            rotations(f).iter().map(|p| map(p).filter(|_| renames(f, platform, p, same))).collect()
        };
        let mut agreed: Vec<Option<Vec<usize>>> = Vec::new();
        for (i, here) in fields.iter().map(maps_in).enumerate() {
            if i == 0 {
                agreed = here;
            } else {
                agreed =
                    agreed.into_iter().zip(here).map(|(a, b)| a.filter(|a| Some(a) == b.as_ref())).collect();
            }
        }
        let maps: Vec<Vec<usize>> = agreed.into_iter().flatten().collect();
        let mut orbit = vec![usize::MAX; candidates];
        let mut orbits = 0;
        for i in 0..candidates {
            if orbit[i] == usize::MAX {
                for map in &maps {
                    orbit[map[i]] = orbits;
                }
                orbit[i] = orbits;
                orbits += 1;
            }
        }
        let maps = if maps.is_empty() { vec![(0..candidates).collect()] } else { maps };
        Self { order: maps.len(), orbit, maps }
    }

    /// Trivial symmetry: the identity alone.
    pub fn none(candidates: usize) -> Self {
        Self { order: 1, orbit: (0..candidates).collect(), maps: vec![(0..candidates).collect()] }
    }

    /// Number of searched images of a set, out of its `order` images (one per turn of the axes, counted
    /// separately). Only images whose smallest member is the first of its orbit are searched. A turn
    /// other than the identity moves every attitude, so one turn brings each member of the lowest orbit
    /// to its first.
    pub(crate) fn searched_images(&self, set: &[usize]) -> usize {
        let lowest = set.iter().map(|&c| self.orbit[c]).min();
        let members = |(i, c): (usize, &usize)| Some(self.orbit[*c]) == lowest && !set[..i].contains(c);
        set.iter().enumerate().filter(|&x| members(x)).count()
    }

    /// First candidate of every orbit.
    pub fn representatives(&self) -> Vec<usize> {
        let orbits = self.orbit.iter().max().map_or(0, |m| m + 1);
        (0..orbits).filter_map(|o| self.orbit.iter().position(|x| *x == o)).collect()
    }
}

/// All 24 signed permutation matrices of determinant 1.
fn rotations(f: &Field) -> Vec<Matrix3<u64>> {
    let mut out = Vec::new();
    for (permutation, even) in [
        ([0, 1, 2], true),
        ([1, 2, 0], true),
        ([2, 0, 1], true),
        ([1, 0, 2], false),
        ([0, 2, 1], false),
        ([2, 1, 0], false),
    ] {
        for signs in 0..8u32 {
            if (signs.count_ones() % 2 == 0) == even {
                out.push(std::array::from_fn(|i| {
                    std::array::from_fn(|j| match (permutation[i] == j, signs >> i & 1 == 1) {
                        (false, _) => 0,
                        (true, false) => f.one(),
                        (true, true) => f.neg(f.one()),
                    })
                }));
            }
        }
    }
    out
}

/// True if turning the platform axes by `p` renames the coefficients, equivalent ones among themselves.
/// The columns (of the drift and of Z) are polynomials in C, so columns equal at a random matrix are
/// equal.
fn renames(f: &Field, platform: &Platform, p: &Matrix3<u64>, same: &dyn Fn(usize, usize) -> bool) -> bool {
    let mut rng = SplitMix64::new(0x7261_6e64_6f6d_2043);
    let c: Matrix3<u64> = std::array::from_fn(|_| std::array::from_fn(|_| rng.below(f.modulus())));
    let [w_n, w_u] = [0; 2].map(|_| rng.below(f.modulus()));
    let columns = |c: &Matrix3<u64>| -> Vec<[u64; 6]> {
        let drift = platform.errors().drift_rows(f, c, || earth_rate_in(f, c, &w_n, &w_u));
        let of_z = platform.errors().accelerometer_rows(f, c);
        let entry = |r: usize, k: usize| if r < 3 { drift[r][k] } else { of_z[r - 3][k] };
        (0..platform.coefficients()).map(|k| std::array::from_fn(|r| entry(r, k))).collect()
    };
    let (before, after) = (columns(&c), columns(&product(f, &c, p)));
    let mut used = vec![false; before.len()];
    after.iter().enumerate().all(|(j, column)| {
        let negative = column.map(|x| f.neg(x));
        let found = (0..before.len())
            .find(|&i| !used[i] && same(i, j) && (before[i] == *column || before[i] == negative));
        found.map(|i| used[i] = true).is_some()
    })
}

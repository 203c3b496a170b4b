//! State of a filter with full attitudes; its local coordinates are those of the unknowns, in their order.

use obsdeg_core::model::Matrix3;
use obsdeg_core::model::slew::{cross, rotation, rotation_vector, times, transpose};
use obsdeg_ekf::{Manifold, Transition};

/// Attitudes `A = exp([psi x])`, each in the axes of its unknowns psi, and the constants: the coefficients D,
/// and biases behind them. The local coordinates of an attitude are the rotation vector `delta` with
/// `A_true = exp([delta x]) A`.
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformState {
    pub(super) attitudes: Vec<Matrix3<f64>>,
    pub(super) constants: Vec<f64>,
}

impl PlatformState {
    /// State with the unknowns `x` (SI units), of which the last `constants` are not psi.
    pub fn of_unknowns(x: &[f64], constants: usize) -> Self {
        let (psi, d) = x.split_at(x.len() - constants);
        let attitudes = psi.chunks_exact(3).map(|v| rotation(&[v[0], v[1], v[2]])).collect();
        Self { attitudes, constants: d.to_vec() }
    }

    /// Number of attitudes.
    pub fn attitudes(&self) -> usize {
        self.attitudes.len()
    }

    /// Unknowns of the state, psi as rotation vectors.
    pub fn unknowns(&self) -> Vec<f64> {
        self.attitudes.iter().flat_map(rotation_vector).chain(self.constants.iter().copied()).collect()
    }

    /// State with the attitude of index `block` at the rotation vector `psi` (rad, in the axes of its
    /// unknowns).
    #[must_use]
    pub fn with_psi(mut self, block: usize, psi: &[f64; 3]) -> Self {
        self.attitudes[block] = rotation(psi);
        self
    }

    /// State with the attitude of index `block` of `other`.
    #[must_use]
    pub fn with_attitude_of(mut self, block: usize, other: &Self) -> Self {
        self.attitudes[block] = other.attitudes[block];
        self
    }

    /// Functional `c` of the unknowns as one of the local coordinates (of psi: by the derivative of the
    /// rotation vector).
    pub fn functional(&self, c: &[(usize, f64)]) -> Vec<(usize, f64)> {
        let first = 3 * self.attitudes.len();
        let mut out = vec![0.0; first];
        let mut rest = Vec::new();
        for &(i, k) in c {
            if i < first {
                let row = inverse_left_jacobian(&rotation_vector(&self.attitudes[i / 3]))[i % 3];
                (0..3).for_each(|j| out[i / 3 * 3 + j] += k * row[j]);
            } else {
                rest.push((i, k));
            }
        }
        out.into_iter().enumerate().filter(|(_, k)| *k != 0.0).chain(rest).collect()
    }
}

impl Manifold for PlatformState {
    fn dimension(&self) -> usize {
        3 * self.attitudes.len() + self.constants.len()
    }

    fn retract(&mut self, delta: &[f64]) {
        let (turns, d) = delta.split_at(3 * self.attitudes.len());
        for (e, v) in self.attitudes.iter_mut().zip(turns.chunks_exact(3)) {
            if v.iter().any(|x| *x != 0.0) {
                *e = orthonormal(&times(&rotation(&[v[0], v[1], v[2]]), e));
            }
        }
        self.constants.iter_mut().zip(d).for_each(|(x, d)| *x += d);
    }

    fn local(&self, from: &Self) -> Vec<f64> {
        let turns = self.attitudes.iter().zip(&from.attitudes);
        let turns = turns.flat_map(|(to, from)| rotation_vector(&times(to, &transpose(from))));
        turns.chain(self.constants.iter().zip(&from.constants).map(|(x, y)| x - y)).collect()
    }

    fn transport(&self, delta: &[f64]) -> Option<Transition> {
        let n = self.dimension();
        let (mut active, mut rows) = (Vec::new(), Vec::new());
        for (block, v) in delta[..3 * self.attitudes.len()].chunks_exact(3).enumerate() {
            if v.iter().all(|x| *x == 0.0) {
                continue;
            }
            for (i, row) in left_jacobian(&[v[0], v[1], v[2]]).iter().enumerate() {
                let start = rows.len();
                active.push(3 * block + i);
                rows.resize(start + n, 0.0);
                rows[start + 3 * block..start + 3 * block + 3].copy_from_slice(row);
            }
        }
        Transition::of_rows(n, active, rows).ok()
    }

    fn is_finite(&self) -> bool {
        self.attitudes.iter().flatten().flatten().chain(&self.constants).all(|x| x.is_finite())
    }
}

/// Left Jacobian: integral of `exp(s [v x])` over s in 0..1, the rotation on the left per change of v.
fn left_jacobian(v: &[f64; 3]) -> Matrix3<f64> {
    let a2: f64 = v.iter().map(|x| x * x).sum();
    let a = a2.sqrt();
    // (1 - cos a)/a^2 and (a - sin a)/a^3
    let (c, s) = if a < 1e-3 {
        (0.5 - a2 / 24.0, 1.0 / 6.0 - a2 / 120.0)
    } else {
        ((1.0 - a.cos()) / a2, (a - a.sin()) / (a2 * a))
    };
    series(v, c, s)
}

/// Inverse of the left Jacobian.
pub(super) fn inverse_left_jacobian(v: &[f64; 3]) -> Matrix3<f64> {
    let a2: f64 = v.iter().map(|x| x * x).sum();
    let a = a2.sqrt();
    // 1/a^2 - (1 + cos a)/(2 a sin a)
    let s = if a < 1e-2 { 1.0 / 12.0 + a2 / 720.0 } else { 1.0 / a2 - 1.0 / (2.0 * a * (a / 2.0).tan()) };
    series(v, -0.5, s)
}

/// Matrix `1 + first [v x] + second [v x]^2`.
fn series(v: &[f64; 3], first: f64, second: f64) -> Matrix3<f64> {
    let k = cross(v);
    let k2 = times(&k, &k);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| f64::from(u8::from(i == j)) + first * k[i][j] + second * k2[i][j])
    })
}

/// Rotation next to an almost orthonormal matrix: `E (3 - E^T E)/2`.
pub(super) fn orthonormal(e: &Matrix3<f64>) -> Matrix3<f64> {
    let square = times(&transpose(e), e);
    let correction: Matrix3<f64> = std::array::from_fn(|i| {
        std::array::from_fn(|j| 1.5 * f64::from(u8::from(i == j)) - 0.5 * square[i][j])
    });
    times(e, &correction)
}

#[cfg(test)]
mod tests {
    use obsdeg_exact::SplitMix64;

    use super::*;

    /// Random number in -scale..scale.
    fn random(rng: &mut SplitMix64, scale: f64) -> f64 {
        scale * (2.0 * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 1.0)
    }

    fn vector(rng: &mut SplitMix64, n: usize, scale: f64) -> Vec<f64> {
        (0..n).map(|_| random(rng, scale)).collect()
    }

    fn largest(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
    }

    /// Two attitudes and three constants: local coordinates invert the retraction, the transport is their
    /// derivative about the new state, and a functional the derivative of the unknowns.
    #[test]
    fn a_manifold() {
        let mut rng = SplitMix64::new(7);
        for scale in [1e-5, 0.1, 1.0] {
            let x = PlatformState::of_unknowns(&vector(&mut rng, 9, scale), 3);
            let delta = vector(&mut rng, 9, scale);
            let mut moved = x.clone();
            moved.retract(&delta);
            assert!(largest(&moved.local(&x), &delta) < 1e-14, "{scale}");
            let transport = x.transport(&delta).expect("attitudes").matrix();
            let c: Vec<(usize, f64)> = vector(&mut rng, 9, 1.0).into_iter().enumerate().collect();
            let functional =
                |x: &PlatformState| -> f64 { c.iter().zip(x.unknowns()).map(|((_, k), x)| k * x).sum() };
            let of_moved = moved.functional(&c);
            let h = 1e-5;
            for j in 0..9 {
                let at = |sign: f64| {
                    let mut other = delta.clone();
                    other[j] += sign * h;
                    let mut y = x.clone();
                    y.retract(&other);
                    y
                };
                let (up, down) = (at(1.0).local(&moved), at(-1.0).local(&moved));
                let found: Vec<f64> = up.iter().zip(&down).map(|(a, b)| (a - b) / (2.0 * h)).collect();
                assert!(largest(transport.column(j).as_slice(), &found) < 1e-9, "{scale}: column {j}");
                let mut unit = vec![0.0; 9];
                let along = |sign: f64, unit: &mut Vec<f64>| {
                    unit[j] = sign * h;
                    let mut y = moved.clone();
                    y.retract(unit);
                    functional(&y)
                };
                let slope = (along(1.0, &mut unit) - along(-1.0, &mut unit)) / (2.0 * h);
                let given: f64 = of_moved.iter().filter(|(i, _)| *i == j).map(|(_, k)| k).sum();
                assert!((slope - given).abs() < 1e-9, "{scale}: functional {j}");
            }
        }
    }
}

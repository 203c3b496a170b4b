//! Contributions of a turning platform to derivatives of Z: derivatives of `C_c^n` and of `eps^n` by the
//! angle of the turn.
//!
//! While the platform turns at the rate w, `eps^n` changes with its attitude, so `Z''` contains
//! `w d eps^n/d angle` in addition to its value at rest. `Z` in platform axes is `C_n^c Z^n`, and `C_n^c`
//! changes as well.

use crate::model::Platform;
use crate::model::attitude::{Matrix3, product};
use crate::model::platform::PlatformPoint;
use crate::model::ring::Ring;
use crate::model::rotation::Axis;

/// Ring of dual numbers `a + b d` with `d^2 = 0`: a value and its derivative.
#[derive(Debug, Clone, Copy)]
struct DualNumbers<'a, R>(&'a R);

impl<R: Ring> Ring for DualNumbers<'_, R> {
    type Element = [R::Element; 2];
    fn zero(&self) -> Self::Element {
        [self.0.zero(), self.0.zero()]
    }
    fn one(&self) -> Self::Element {
        [self.0.one(), self.0.zero()]
    }
    fn add(&self, a: &Self::Element, b: &Self::Element) -> Self::Element {
        [self.0.add(&a[0], &b[0]), self.0.add(&a[1], &b[1])]
    }
    fn mul(&self, a: &Self::Element, b: &Self::Element) -> Self::Element {
        [self.0.mul(&a[0], &b[0]), self.0.dot([(&a[0], &b[1]), (&a[1], &b[0])])]
    }
    fn neg(&self, a: &Self::Element) -> Self::Element {
        [self.0.neg(&a[0]), self.0.neg(&a[1])]
    }
    fn is_zero(&self, a: &Self::Element) -> bool {
        self.0.is_zero(&a[0]) && self.0.is_zero(&a[1])
    }
}

/// The derivative of the given order of `C_c^n` by the angle of a turn about `axis`: `C' = C [a x]` about a
/// platform axis a, `C' = [b x] C` about a geographic axis b.
pub(crate) fn attitude_derivative<R: Ring>(
    ring: &R,
    c: &Matrix3<R::Element>,
    axis: Axis,
    order: usize,
) -> Matrix3<R::Element> {
    let (j, k) = ((axis.index + 1) % 3, (axis.index + 2) % 3);
    let mut cross: Matrix3<R::Element> = std::array::from_fn(|_| std::array::from_fn(|_| ring.zero()));
    cross[k][j] = ring.one();
    cross[j][k] = ring.neg(&ring.one());
    (0..order).fold(c.clone(), |c, _| {
        if axis.geographic { product(ring, &cross, &c) } else { product(ring, &c, &cross) }
    })
}

/// Derivative `d eps^n/d angle`: three rows, one column per coefficient. No torquer error is unknown where
/// the platform turns.
pub(crate) fn drift_derivative<R: Ring>(
    platform: &Platform,
    ring: &R,
    c: &Matrix3<R::Element>,
    axis: Axis,
) -> [Vec<R::Element>; 3] {
    let slope = attitude_derivative(ring, c, axis, 1);
    let both: Matrix3<[R::Element; 2]> =
        std::array::from_fn(|i| std::array::from_fn(|j| [c[i][j].clone(), slope[i][j].clone()]));
    let rows = platform
        .errors()
        .drift_rows(&DualNumbers(ring), &both, || std::array::from_fn(|_| DualNumbers(ring).zero()));
    rows.map(|row| row.into_iter().map(|[_, slope]| slope).collect())
}

/// Minus `d eps_z^n/d angle` at every station as a functional of the unknowns; zero where the platform is at
/// rest. `Z1''` is the only second derivative that solutions use (16).
pub(crate) fn motion_rows<R: Ring>(platform: &Platform, point: &PlatformPoint<R>) -> Vec<Vec<R::Element>> {
    if !platform.scheme().rotates() || platform.scheme().by_history() {
        return Vec::new();
    }
    let ring = &point.ring;
    let first_d = platform.names().len() - platform.coefficients();
    let stations = platform.scheme().stations();
    let row = |(station, c): (&crate::model::scheme::Station<'_>, &Matrix3<R::Element>)| {
        let mut out = vec![ring.zero(); platform.names().len()];
        if let Some(turned) = &station.turned {
            let [_, _, z] = drift_derivative(platform, ring, c, turned.axis);
            for (slot, x) in out[first_d..].iter_mut().zip(z) {
                *slot = ring.neg(&x);
            }
        }
        out
    };
    stations.iter().zip(&point.attitudes).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Scheme;
    use crate::model::ring::Float;
    use crate::model::scheme::parse_attitude;

    /// Derivatives agree with differences of attitudes and drifts.
    #[test]
    fn derivatives_are_limits_of_differences() {
        let angles = parse_attitude("20,-35,70").expect("an attitude");
        let unknowns = "F,I,O,S,II,IS".parse().expect("terms");
        let platform =
            Platform::new(Scheme { unknowns, ..Scheme::of_angles([angles.clone()]) }).expect("valid");
        for name in ["X_p", "Y_p", "Z_p", "N", "U", "E"] {
            let axis: Axis = name.parse().expect("an axis");
            let at = |deg: &str| {
                let turned = crate::model::attitude::Turned { axis, angle: deg.parse().expect("an angle") };
                crate::model::attitude::c_n(&Float, &angles, Some(&turned), |a| a.turn().cos_sin_f64())
            };
            let (minus, zero, plus) = (at("-0.01"), at("0"), at("0.01"));
            let h = 0.01f64.to_radians();
            let [first, second] = [1, 2].map(|k| attitude_derivative(&Float, &zero, axis, k));
            let drift = drift_derivative(&platform, &Float, &zero, axis);
            let rows = [&minus, &plus].map(|c| platform.errors().drift_rows(&Float, c, || [0.0; 3]));
            for i in 0..3 {
                for j in 0..3 {
                    assert!(((plus[i][j] - minus[i][j]) / (2.0 * h) - first[i][j]).abs() < 1e-7);
                    let curve = (plus[i][j] - 2.0 * zero[i][j] + minus[i][j]) / (h * h);
                    assert!((curve - second[i][j]).abs() < 1e-6);
                }
                for (k, slope) in drift[i].iter().enumerate() {
                    assert!(((rows[1][i][k] - rows[0][i][k]) / (2.0 * h) - slope).abs() < 1e-6, "{name}");
                }
            }
        }
    }
}

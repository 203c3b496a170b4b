//! The computed attitude over time: constant at a position, turning about an eigenaxis during a slew.

use crate::model::attitude::Matrix3;
use crate::model::ring::Float;
use crate::model::scheme::Rotation;

/// `a b` in floating point.
pub(crate) fn times(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    crate::model::attitude::product(&Float, a, b)
}

/// `a b`.
pub(crate) fn apply(a: &Matrix3<f64>, b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|j| a[i][j] * b[j]).sum())
}

/// The transpose.
pub(crate) fn transpose(a: &Matrix3<f64>) -> Matrix3<f64> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// `exp([v x])`: the active rotation by the vector `v` (rad).
pub(crate) fn rotation(v: &[f64; 3]) -> Matrix3<f64> {
    let angle = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    // sin(a)/a and (1 - cos a)/a^2
    let (s, c) = if angle < 1e-4 {
        (1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0)
    } else {
        (angle.sin() / angle, (1.0 - angle.cos()) / (angle * angle))
    };
    let k = cross(v);
    let k2 = times(&k, &k);
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)) + s * k[i][j] + c * k2[i][j]))
}

/// `[v x]`.
pub(crate) fn cross(v: &[f64; 3]) -> Matrix3<f64> {
    [[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]]
}

/// The rotation vector of a rotation matrix: `rotation(v) = r`, of length at most pi.
pub(crate) fn rotation_vector(r: &Matrix3<f64>) -> [f64; 3] {
    let sine = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]].map(|x| x / 2.0);
    let length = sine.iter().map(|x| x * x).sum::<f64>().sqrt();
    let cosine = (r[0][0] + r[1][1] + r[2][2] - 1.0) / 2.0;
    let angle = length.atan2(cosine);
    if length > 1e-7 {
        return sine.map(|x| x * angle / length);
    }
    if cosine > 0.0 {
        return sine;
    }
    // half a turn: r = 2 a a^T - 1
    let largest = (0..3).fold(0, |b, i| if r[i][i] > r[b][b] { i } else { b });
    let scale = ((r[largest][largest] + 1.0) * 2.0).sqrt();
    let axis: [f64; 3] = std::array::from_fn(|i| {
        if i == largest { scale / 2.0 } else { (r[i][largest] + r[largest][i]) / (2.0 * scale) }
    });
    let norm = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    axis.map(|x| x * std::f64::consts::PI / norm)
}

/// A turn from one attitude to another about a fixed axis at a constant rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Slew {
    /// `C_c^n` at the start.
    pub from: Matrix3<f64>,
    /// The rate `omega_nc` in the axes of c, rad/s (constant).
    pub rate: [f64; 3],
    /// How long it takes, in s.
    pub duration_s: f64,
}

impl Slew {
    /// The shortest turn from `from` to `to` at `rate_rad_s`; `None` when they are the same.
    pub fn between(from: &Matrix3<f64>, to: &Matrix3<f64>, rate_rad_s: f64) -> Option<Self> {
        // C(t) = C_0 exp([v x] t/T)
        let v = rotation_vector(&times(&transpose(from), to));
        let angle = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if angle < 1e-12 {
            return None;
        }
        let duration_s = angle / rate_rad_s;
        Some(Self { from: *from, rate: v.map(|x| x / duration_s), duration_s })
    }

    /// A rotating segment from `from` that takes `duration_s`.
    pub fn about(from: &Matrix3<f64>, rotation: &Rotation, duration_s: f64) -> Self {
        let rate = (rotation.angle.nanodeg() as f64 / 1e9).to_radians() / duration_s;
        let axis = std::array::from_fn(|i| if i == rotation.axis { rate } else { 0.0 });
        let rate = if rotation.geographic { apply(&transpose(from), &axis) } else { axis };
        Self { from: *from, rate, duration_s }
    }

    /// `C_c^n` after `t` seconds.
    pub fn at(&self, t: f64) -> Matrix3<f64> {
        times(&self.from, &rotation(&self.rate.map(|x| x * t)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn distance(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
        (0..9).map(|k| (a[k / 3][k % 3] - b[k / 3][k % 3]).abs()).fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn rotations_and_their_vectors(v in prop::array::uniform3(-1.8f64..1.8)) {
            let r = rotation(&v);
            prop_assert!(distance(&times(&r, &transpose(&r)), &rotation(&[0.0; 3])) < 1e-14);
            let back = rotation_vector(&r);
            prop_assert!((0..3).all(|i| (back[i] - v[i]).abs() < 1e-9), "{v:?} {back:?}");
        }
    }

    #[test]
    fn half_turns_about_any_axis() {
        for axis in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [-0.48, 0.6, 0.64]] {
            let r = rotation(&axis.map(|x| x * std::f64::consts::PI));
            assert!(distance(&rotation(&rotation_vector(&r)), &r) < 1e-7, "{axis:?}");
        }
    }

    #[test]
    fn a_slew_ends_where_it_should() {
        let (from, to) = (rotation(&[0.3, -0.2, 1.0]), rotation(&[-1.3, 0.7, 0.4]));
        let slew = Slew::between(&from, &to, 0.02).expect("a turn");
        assert!(distance(&slew.at(slew.duration_s), &to) < 1e-12);
        assert_eq!(Slew::between(&from, &from, 0.02), None);
    }
}

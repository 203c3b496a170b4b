//! The computed attitude over time: constant at a position, turning about an eigenaxis during a slew.

use super::plan::W_IE;
use crate::model::attitude::Matrix3;
use crate::model::ring::Float;
use crate::model::rotation::{Axis, Rotation, SlewTo};

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

/// The unit vector of `axis` in the axes of c.
fn axis_in_c(from: &Matrix3<f64>, axis: Axis) -> [f64; 3] {
    let unit = std::array::from_fn(|i| f64::from(u8::from(i == axis.index)));
    if axis.geographic { apply(&transpose(from), &unit) } else { unit }
}

/// A turn does not lead to the position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoWay;

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
    /// A rotating segment from `from` that takes `duration_s`.
    pub fn about(from: &Matrix3<f64>, rotation: &Rotation, duration_s: f64) -> Self {
        let rate = (rotation.angle.nanodeg() as f64 / 1e9).to_radians() / duration_s;
        Self { from: *from, rate: axis_in_c(from, rotation.axis).map(|x| x * rate), duration_s }
    }

    /// The way to `to` as `slew` describes it, at `rate_rad_s`; `None` when there is nothing to turn.
    ///
    /// # Errors
    /// [`NoWay`] when a turn about its axis, or by its angle, does not lead there.
    pub fn to(
        from: &Matrix3<f64>,
        to: &Matrix3<f64>,
        slew: &SlewTo,
        rate_rad_s: f64,
    ) -> Result<Option<Self>, NoWay> {
        let shortest = rotation_vector(&times(&transpose(from), to));
        let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let axis = match slew.axis {
            Some(axis) => axis_in_c(from, axis),
            None if length(&shortest) < 1e-12 => return Ok(None),
            None => shortest.map(|x| x / length(&shortest)),
        };
        // about a given axis the shorter way; by a given angle whatever it is
        let along: f64 = shortest.iter().zip(&axis).map(|(x, a)| x * a).sum();
        let angle = slew.angle.as_ref().map_or(along, |a| (a.nanodeg() as f64 / 1e9).to_radians());
        let reached = times(from, &rotation(&axis.map(|x| x * angle)));
        let missed = (0..9).map(|k| (reached[k / 3][k % 3] - to[k / 3][k % 3]).abs()).fold(0.0, f64::max);
        if missed > 1e-6 {
            return Err(NoWay);
        }
        let duration_s = angle.abs() / rate_rad_s;
        let rate = axis.map(|x| x * angle / duration_s);
        Ok((angle.abs() > 1e-12).then_some(Self { from: *from, rate, duration_s }))
    }

    /// How far it turns in `t` seconds, with the earth rate, in rad.
    pub fn turn(&self, t: f64) -> f64 {
        (self.rate.iter().map(|x| x * x).sum::<f64>().sqrt() + W_IE) * t
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
        let eigenaxis = SlewTo::default();
        let slew = Slew::to(&from, &to, &eigenaxis, 0.02).expect("a way").expect("a turn");
        assert!(distance(&slew.at(slew.duration_s), &to) < 1e-12);
        assert_eq!(Slew::to(&from, &from, &eigenaxis, 0.02), Ok(None));
        // about another axis there is no way
        let about = SlewTo { axis: "X_p".parse().ok(), ..SlewTo::default() };
        assert_eq!(Slew::to(&from, &to, &about, 0.02), Err(NoWay));
    }

    #[test]
    fn a_slew_about_an_axis_the_long_way() {
        let unit = rotation(&[0.0; 3]);
        let to = rotation(&[0.0, 1.0, 0.0].map(|x| x * 70f64.to_radians()));
        let degrees = |slew: &SlewTo| {
            let slew = Slew::to(&unit, &to, slew, 0.01).expect("a way").expect("a turn");
            assert!(distance(&slew.at(slew.duration_s), &to) < 1e-9);
            (slew.duration_s * 0.01).to_degrees().round() * slew.rate[1].signum()
        };
        let about = |angle: Option<i32>| SlewTo {
            axis: "U".parse().ok(),
            angle: angle.map(crate::model::Angle::from_degrees),
            rate_deg_s: None,
        };
        assert_eq!(degrees(&about(None)), 70.0);
        assert_eq!(degrees(&about(Some(-290))), -290.0);
        assert_eq!(degrees(&about(Some(430))), 430.0);
        assert_eq!(Slew::to(&unit, &to, &about(Some(71)), 0.01), Err(NoWay));
    }
}

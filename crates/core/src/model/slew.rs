//! Computed attitude over time: constant at a position, turning about a fixed axis during a slew.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attitude::Matrix3;
use super::rotation::{Axis, Rotation, SlewAxis, SlewTo};

/// Earth rate in rad/s.
pub const W_IE: f64 = 7.292115e-5;

/// Turn of the platform about a fixed axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Turn {
    /// Axis of the turn: a unit vector (North, Up, East), dimensionless.
    pub about: [f64; 3],
    /// Angle of the turn in degrees, right-handed about the axis, above 0.
    pub angle_deg: f64,
}

impl Turn {
    /// True if the opposite turn ends at the same attitude.
    pub fn is_half(&self) -> bool {
        self.angle_deg == 180.0
    }
}

/// Product `a b` in floating point.
#[inline]
pub fn times(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    // in the order of `product`, whose sums begin with 0; each step of an integration multiplies some
    let dot = |r: &[f64; 3], j: usize| 0.0 + r[0] * b[0][j] + r[1] * b[1][j] + r[2] * b[2][j];
    let row = |r: &[f64; 3]| [dot(r, 0), dot(r, 1), dot(r, 2)];
    [row(&a[0]), row(&a[1]), row(&a[2])]
}

/// Product `a b` of a matrix and a vector.
#[inline]
pub fn apply(a: &Matrix3<f64>, b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|j| a[i][j] * b[j]).sum())
}

/// Transpose of a matrix.
#[inline]
pub fn transpose(a: &Matrix3<f64>) -> Matrix3<f64> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// `exp([v x])`: the active rotation by the vector `v` (rad).
#[inline]
pub fn rotation(v: &[f64; 3]) -> Matrix3<f64> {
    let angle = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    // sin(a)/a and (1 - cos a)/a^2
    let (s, c) = if angle < 1e-4 {
        (1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0)
    } else {
        (angle.sin() / angle, (1.0 - angle.cos()) / (angle * angle))
    };
    let k = cross(v);
    let k2 = times(&k, &k);
    let row = |i: usize| {
        let entry = |j: usize| f64::from(u8::from(i == j)) + s * k[i][j] + c * k2[i][j];
        [entry(0), entry(1), entry(2)]
    };
    [row(0), row(1), row(2)]
}

/// Matrix `[v x]`.
#[inline]
pub fn cross(v: &[f64; 3]) -> Matrix3<f64> {
    [[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]]
}

/// Tolerance in rad below which two turns are the same: rounding is about 1e-15, and angles of nine decimals
/// differ by at least 1.7e-11.
const SAME: f64 = 1e-12;
/// Smallest component of an axis that decides the sense of a half turn.
const COMPONENT: f64 = 1e-6;

/// Rotation vector of a rotation matrix: `rotation(v) = r`, of length at most pi. For a half turn, the
/// vector whose first non-zero component is positive.
pub fn rotation_vector(r: &Matrix3<f64>) -> [f64; 3] {
    let sine = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]].map(|x| x / 2.0);
    let length = norm(&sine);
    let cosine = (r[0][0] + r[1][1] + r[2][2] - 1.0) / 2.0;
    let angle = length.atan2(cosine);
    if cosine > -0.5 {
        return if length > 1e-7 { sine.map(|x| x * angle / length) } else { sine };
    }
    // near half a turn the sine loses its direction; r + r^T = 2 cos + 2 (1 - cos) a a^T keeps it
    let largest = (0..3).fold(0, |b, i| if r[i][i] > r[b][b] { i } else { b });
    let scale = 2.0 * (1.0 - cosine);
    let column = std::array::from_fn(|i| {
        (r[i][largest] + r[largest][i] - if i == largest { 2.0 * cosine } else { 0.0 }) / scale
    });
    let axis = column.map(|x| x / norm(&column));
    let along: f64 = sine.iter().zip(&axis).map(|(s, a)| s * a).sum();
    let forward = if along.abs() > SAME {
        along > 0.0
    } else {
        axis.iter().find(|x| x.abs() > COMPONENT).is_some_and(|x| *x > 0.0)
    };
    axis.map(|x| if forward { x * angle } else { -x * angle })
}

fn norm(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// True if a rotation by `angle` rad is a half turn: the opposite rotation has the same end.
fn is_half_turn(angle: f64) -> bool {
    (angle.abs() - std::f64::consts::PI).abs() <= SAME
}

/// The unit vector of `axis` in the axes of c.
fn axis_in_c(from: &Matrix3<f64>, axis: Axis) -> [f64; 3] {
    let unit = std::array::from_fn(|i| f64::from(u8::from(i == axis.index)));
    if axis.geographic { apply(&transpose(from), &unit) } else { unit }
}

/// Error for a turn that does not lead to the position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TurnMismatch;

/// Turn from one attitude to another about a fixed axis at a constant rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Slew {
    /// `C_c^n` at the start.
    pub from: Matrix3<f64>,
    /// Rate `omega_nc` in the axes of c, in rad/s (constant).
    pub rate: [f64; 3],
    /// Duration of the turn, in s.
    pub duration_s: f64,
}

impl Slew {
    /// Rotation of a segment from `from`, of duration `duration_s`.
    pub fn about(from: &Matrix3<f64>, rotation: &Rotation, duration_s: f64) -> Self {
        let rate = (rotation.angle.nanodeg() as f64 / 1e9).to_radians() / duration_s;
        Self { from: *from, rate: axis_in_c(from, rotation.axis).map(|x| x * rate), duration_s }
    }

    /// Turn by a rotation vector (rad) in the axes of c, at `rate_rad_s`.
    pub fn by(from: &Matrix3<f64>, vector: &[f64; 3], rate_rad_s: f64) -> Self {
        let duration_s = norm(vector) / rate_rad_s;
        Self { from: *from, rate: vector.map(|x| x / duration_s), duration_s }
    }

    /// Turn to the attitude `to` as `slew` describes it, at `rate_rad_s`; `None` if the attitude stays the
    /// same. Without an axis it is the shortest turn. A half turn goes about the axis in n (North, Up, East)
    /// whose first non-zero component is positive. So a turn of the platform axes, `from -> from P`,
    /// `to -> to P`, leaves the turn in n unchanged.
    ///
    /// # Errors
    /// [`TurnMismatch`] if a turn about the axis, or by the angle, does not lead there.
    pub fn to(
        from: &Matrix3<f64>,
        to: &Matrix3<f64>,
        slew: &SlewTo,
        rate_rad_s: f64,
    ) -> Result<Option<Self>, TurnMismatch> {
        let shortest = apply(&transpose(from), &rotation_vector(&times(to, &transpose(from))));
        let length = norm(&shortest);
        let axis = match &slew.axis {
            Some(SlewAxis::Named(axis)) => axis_in_c(from, *axis),
            Some(SlewAxis::Direction(n)) => apply(&transpose(from), &n.map(|x| x / norm(n))),
            None if length < SAME => return Ok(None),
            None => shortest.map(|x| x / length),
        };
        // about a given axis take the shorter turn, a half turn right-handed; a given angle is taken as it
        // is
        let along: f64 = shortest.iter().zip(&axis).map(|(x, a)| x * a).sum();
        let along = if is_half_turn(length) { along.abs() } else { along };
        let angle = slew.angle.as_ref().map_or(along, |a| (a.nanodeg() as f64 / 1e9).to_radians());
        let reached = times(from, &rotation(&axis.map(|x| x * angle)));
        let missed = (0..9).map(|k| (reached[k / 3][k % 3] - to[k / 3][k % 3]).abs()).fold(0.0, f64::max);
        if missed > 1e-6 {
            return Err(TurnMismatch);
        }
        let duration_s = angle.abs() / rate_rad_s;
        let rate = axis.map(|x| x * angle / duration_s);
        Ok((angle.abs() > SAME).then_some(Self { from: *from, rate, duration_s }))
    }

    /// The turn in n.
    pub fn turn(&self) -> Turn {
        let rate = norm(&self.rate);
        // removes the rounding of components that are zero
        let clean = |x: f64| (x / rate * 1e12).round() / 1e12 + 0.0;
        let angle_deg = (rate * self.duration_s).to_degrees();
        let angle_deg = (angle_deg * 1e10).round() / 1e10;
        Turn { about: apply(&self.from, &self.rate).map(clean), angle_deg }
    }

    /// The opposite turn between the same two attitudes; `None` unless it is a half turn.
    pub fn reversed(&self) -> Option<Self> {
        let half = is_half_turn(norm(&self.rate) * self.duration_s);
        half.then(|| Self { rate: self.rate.map(|x| -x), ..self.clone() })
    }

    /// Angle of the turn after `t` seconds, with the earth rate, in rad.
    pub fn turned(&self, t: f64) -> f64 {
        (norm(&self.rate) + W_IE) * t
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

    /// Half turns in n are the same for every turn of the platform axes, and go about the axis that the rule
    /// states.
    #[test]
    fn half_turns_are_chosen_in_n() {
        let names = crate::model::attitude::cardinal_names();
        let matrix = |name: &String| {
            let angles = crate::model::attitude::cardinal(name).expect("an attitude");
            crate::model::attitude::c_n_f64(&angles)
        };
        let all: Vec<Matrix3<f64>> = names.iter().map(matrix).collect();
        let mut half_turns = 0;
        for from in &all {
            for to in &all {
                let slew = |p: &Matrix3<f64>| {
                    Slew::to(&times(from, p), &times(to, p), &SlewTo::default(), 0.02).expect("a way")
                };
                let plain = slew(&all[0]).map(|s| s.turn());
                if let Some(turn) = plain.filter(|t| t.angle_deg == 180.0) {
                    half_turns += 1;
                    let first = turn.about.iter().find(|x| **x != 0.0);
                    assert!(first.is_some_and(|x| *x > 0.0), "{turn:?}");
                }
                for p in &all {
                    assert_eq!(slew(p).map(|s| s.turn()), plain);
                }
                // the opposite turn leads there too, in the same time
                if let Some(slew) = slew(&all[0]) {
                    let back = slew.reversed();
                    assert_eq!(back.is_some(), slew.turn().angle_deg == 180.0);
                    for way in back.into_iter().chain([slew]) {
                        assert!(distance(&way.at(way.duration_s), to) < 1e-12);
                    }
                }
            }
        }
        // half turns about three axes and six diagonals
        assert_eq!(half_turns, 24 * 9);
    }

    proptest! {
        /// Slightly short of half a turn (by the last of nine decimals) the shorter turn is taken; at half a
        /// turn the rule decides.
        #[test]
        fn close_to_half_a_turn(v in prop::array::uniform3(-1f64..1.0), short in 1e-11f64..1e-3) {
            prop_assume!(norm(&v) > 0.1 && v[0].abs() > 1e-3);
            let axis = v.map(|x| x / norm(&v));
            let by = |angle: f64| rotation_vector(&rotation(&axis.map(|x| x * angle)));
            let back = by(std::f64::consts::PI - short);
            prop_assert!((norm(&back) - (std::f64::consts::PI - short)).abs() < 1e-14);
            prop_assert!((0..3).all(|i| (back[i] / norm(&back) - axis[i]).abs() < 1e-14), "{axis:?} {back:?}");
            let half = by(std::f64::consts::PI);
            prop_assert!(half[0] > 0.0 && (half[0] - axis[0].abs() * std::f64::consts::PI).abs() < 1e-14);
        }
    }

    #[test]
    fn a_slew_ends_where_it_should() {
        let (from, to) = (rotation(&[0.3, -0.2, 1.0]), rotation(&[-1.3, 0.7, 0.4]));
        let eigenaxis = SlewTo::default();
        let slew = Slew::to(&from, &to, &eigenaxis, 0.02).expect("a way").expect("a turn");
        assert!(distance(&slew.at(slew.duration_s), &to) < 1e-12);
        assert_eq!(Slew::to(&from, &from, &eigenaxis, 0.02), Ok(None));
        // about another axis no turn leads there
        let about = SlewTo { axis: "X_p".parse().ok(), ..SlewTo::default() };
        assert_eq!(Slew::to(&from, &to, &about, 0.02), Err(TurnMismatch));
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
        assert_eq!(Slew::to(&unit, &to, &about(Some(71)), 0.01), Err(TurnMismatch));
    }

    /// Turns about a direction in n, by a signed angle or right-handed.
    #[test]
    fn half_turns_about_skew_axes() {
        let unit = rotation(&[0.3, -0.2, 1.0]);
        let axis = [0.6, -0.8, 0.0];
        let to = times(&rotation(&axis.map(|x| x * std::f64::consts::PI)), &unit);
        let turn = |direction: [f64; 3], angle: Option<i32>| {
            let angle = angle.map(crate::model::Angle::from_degrees);
            let how = SlewTo { axis: Some(SlewAxis::Direction(direction)), angle, rate_deg_s: None };
            let slew = Slew::to(&unit, &to, &how, 0.01).expect("a way").expect("a turn");
            assert!(distance(&slew.at(slew.duration_s), &to) < 1e-12);
            slew.turn()
        };
        let forward = Turn { about: axis, angle_deg: 180.0 };
        let back = Turn { about: [-0.6, 0.8, 0.0], angle_deg: 180.0 };
        assert_eq!(turn([3.0, -4.0, 0.0], Some(180)), forward);
        assert_eq!(turn([3.0, -4.0, 0.0], Some(-180)), back);
        assert_eq!((turn([3.0, -4.0, 0.0], None), turn([-3.0, 4.0, 0.0], None)), (forward, back));
        let eigenaxis = Slew::to(&unit, &to, &SlewTo::default(), 0.01).expect("a way").expect("a turn");
        assert_eq!(eigenaxis.turn(), forward);
    }
}

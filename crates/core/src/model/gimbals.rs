//! How far the gimbals turn: limits on the Euler angles of (19).

use std::fmt;

use super::angle::{format_decimal, parse_decimal};
use super::attitude::{Euler, Matrix3, c_n_f64};
use super::scheme::Position;
use crate::model::slew::Slew;

/// A turn in 1e-9 degrees.
const TURN: i64 = 360_000_000_000;
/// Half a turn.
const HALF: i64 = TURN / 2;
/// Rounding of angles taken from a matrix, in 1e-9 degrees.
const ROUNDING: i64 = 100_000;

/// Limits on alpha, beta, gamma as `[low, high]` in 1e-9 degrees; `None`: the gimbal turns freely.
///
/// An attitude has two sets of Euler angles, `(a, b, g)` and `(a+180, 180-b, g+180)`, and at `b = +-90` infinitely
/// many: it is reached when one of them lies within the limits, whole turns left out of account.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gimbals {
    /// Of alpha, beta and gamma.
    pub limits: [Option<[i64; 2]>; 3],
}

/// Not a limit of a gimbal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no gimbal limit; expected alpha, beta or gamma and degrees, as in beta=-80:80")]
pub struct GimbalError {
    /// The text found.
    pub found: String,
}

/// The names of the Euler angles.
const NAMES: [&str; 3] = ["alpha", "beta", "gamma"];

impl Gimbals {
    /// Sets one limit from a text such as `beta=-80:80`.
    ///
    /// # Errors
    /// [`GimbalError`].
    pub fn limit(&mut self, text: &str) -> Result<(), GimbalError> {
        let parse = || {
            let (name, range) = text.split_once('=')?;
            let (low, high) = range.split_once(':')?;
            let k = NAMES.iter().position(|n| *n == name.trim())?;
            let limits = [parse_decimal(low.trim()).ok()?, parse_decimal(high.trim()).ok()?];
            (limits[0] <= limits[1]).then_some((k, limits))
        };
        let (k, limits) = parse().ok_or_else(|| GimbalError { found: text.into() })?;
        self.limits[k] = Some(limits);
        Ok(())
    }

    /// Whether nothing is limited.
    pub fn are_free(&self) -> bool {
        self.limits.iter().all(Option::is_none)
    }

    /// Whether the gimbals reach an attitude; one with a generic angle is taken as reached.
    pub fn reach(&self, angles: &Euler) -> bool {
        if self.are_free() || angles.iter().any(|a| a.generic().is_some()) {
            return true;
        }
        self.reach_nanodeg(std::array::from_fn(|k| angles[k].nanodeg()), 0)
    }

    fn reach_nanodeg(&self, [a, b, g]: [i64; 3], slack: i64) -> bool {
        let limit = |k: usize| self.limits[k].map_or([0, TURN], |[low, high]| [low - slack, high + slack]);
        let within = |x: i64, [low, high]: [i64; 2]| (x - low).rem_euclid(TURN) <= high - low;
        if (b + HALF / 2).rem_euclid(HALF) == 0 {
            // at b = 90 only a - g counts, at b = -90 only a + g
            let [[al, ah], [gl, gh]] = [limit(0), limit(2)];
            let (sum, range) = if (b - HALF / 2).rem_euclid(TURN) == 0 {
                (a - g, [al - gh, ah - gl])
            } else {
                (a + g, [al + gl, ah + gh])
            };
            return within(b, limit(1)) && within(sum, range);
        }
        [[a, b, g], [a + HALF, HALF - b, g + HALF]]
            .iter()
            .any(|angles| (0..3).all(|k| within(angles[k], limit(k))))
    }

    /// The name and attitude of a position, or of a point of a rotating segment (every degree of it is looked at), that
    /// the gimbals do not reach.
    pub fn beyond(&self, position: &Position) -> Option<(String, String)> {
        let name = || position.name.clone();
        if !self.reach(&position.angles) {
            return Some((name(), position.angles_text()));
        }
        let r = position.rotation.as_ref().filter(|_| !self.are_free())?;
        if position.angles.iter().any(|a| a.generic().is_some()) {
            return None;
        }
        let start = c_n_f64(&position.angles);
        // a turn of so many degrees in so many seconds; behind a whole turn nothing is new
        let whole = r.angle.nanodeg() as f64 / 1e9;
        let path = Slew::about(&start, r, whole.abs());
        let arc = whole.abs().min(360.0);
        let steps = arc.ceil();
        (1..=steps as usize).map(|k| k as f64 * arc / steps).find_map(|t| {
            let angles = euler_angles(&path.at(t)).map(|x| (x.to_degrees() * 1e9).round() as i64);
            let turned = if whole < 0.0 { -t } else { t };
            (!self.reach_nanodeg(angles, ROUNDING))
                .then(|| (name(), format!("{} turned by {turned:.0} deg", position.angles_text())))
        })
    }
}

impl fmt::Display for Gimbals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limited = NAMES.iter().zip(self.limits).filter_map(|(name, limit)| {
            limit
                .map(|[low, high]| format!("{name} from {} to {}", format_decimal(low), format_decimal(high)))
        });
        let limited: Vec<String> = limited.collect();
        if limited.is_empty() { f.write_str("any angles") } else { write!(f, "{} deg", limited.join(", ")) }
    }
}

/// Euler angles (rad) of `C_c^n`, beta in -90..90 degrees.
pub(crate) fn euler_angles(c: &Matrix3<f64>) -> [f64; 3] {
    // C = Mx My Mz: row 0 is (cb cg, cb sg, -sb), column 2 is (-sb, sa cb, ca cb)
    let beta = (-c[0][2]).clamp(-1.0, 1.0).asin();
    if c[0][2].abs() > 1.0 - 1e-12 {
        // only a -+ g is determined: gamma = 0, and the middle column of Mx My is (0, ca, -sa)
        return [(-c[2][1]).atan2(c[1][1]), beta, 0.0];
    }
    [c[1][2].atan2(c[2][2]), beta, c[0][1].atan2(c[0][0])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::attitude::{cardinal, cardinal_names};
    use crate::model::rotation::Rotation;
    use crate::model::scheme::{Scheme, parse_attitude};
    use proptest::prelude::*;

    const DEG: i64 = 1_000_000_000;

    fn limited(limits: [Option<[i64; 2]>; 3]) -> Gimbals {
        Gimbals { limits: limits.map(|l| l.map(|l| l.map(|x| x * DEG))) }
    }

    fn distance(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
        (0..9).map(|k| (a[k / 3][k % 3] - b[k / 3][k % 3]).abs()).fold(0.0, f64::max)
    }

    fn of_degrees(angles: [f64; 3]) -> Matrix3<f64> {
        let cs = angles.map(|x: f64| (x.to_radians().cos(), x.to_radians().sin()));
        crate::model::attitude::c_n_from_euler(&crate::model::ring::Float, &cs)
    }

    proptest! {
        #[test]
        fn euler_angles_give_the_attitude(a in -180.0f64..180.0, b in -180.0f64..180.0, g in -180.0f64..180.0) {
            let c = of_degrees([a, b, g]);
            let back = euler_angles(&c).map(f64::to_degrees);
            prop_assert!(distance(&of_degrees(back), &c) < 1e-9);
        }

        /// The verdict is that of trying all angles of the gimbals in steps.
        #[test]
        fn reach_is_what_a_search_over_gimbal_angles_finds(
            angles in prop::array::uniform3(-12i64..=12),
            low in prop::array::uniform3(-12i64..=0),
            width in prop::array::uniform3(0i64..=14),
        ) {
            let gimbals = limited(std::array::from_fn(|k| Some([low[k] * 15, (low[k] + width[k]) * 15])));
            let euler = angles.map(|a| crate::model::Angle::from_nanodeg(a * 15 * DEG));
            let target = of_degrees(angles.map(|a| (a * 15) as f64));
            let range = |k: usize| low[k]..=low[k] + width[k];
            let found = range(0).any(|a| range(1).any(|b| range(2).any(|g| {
                distance(&of_degrees([a, b, g].map(|x| (x * 15) as f64)), &target) < 1e-9
            })));
            prop_assert_eq!(gimbals.reach(&euler), found);
        }
    }

    #[test]
    fn cardinal_attitudes_within_a_pitch_limit() {
        let gimbals = limited([None, Some([-80, 80]), None]);
        let reached = cardinal_names().into_iter().filter(|n| cardinal(n).is_some_and(|e| gimbals.reach(&e)));
        // beta = +-90 where Z_p points South or North
        let level = cardinal_names().into_iter().filter(|n| !n.ends_with(['N', 'S']));
        assert_eq!((reached.clone().count(), reached.collect::<Vec<_>>()), (16, level.collect()));
    }

    #[test]
    fn a_rotation_beyond_the_limits() {
        let gimbals = limited([Some([-100, 100]), Some([-89, 89]), None]);
        let mut scheme = Scheme::of_angles([parse_attitude("0,0,0").expect("angles")]);
        let beyond = |scheme: &Scheme, turn: &str| {
            let mut p = scheme.positions[0].clone();
            p.rotation = Some(Rotation::new("N", turn).expect("a rotation"));
            gimbals.beyond(&p).map(|b| b.1)
        };
        assert_eq!(beyond(&scheme, "99"), None);
        assert_eq!(beyond(&scheme, "-120"), Some("0,0,0 turned by -101 deg".into()));
        scheme.positions[0].angles = parse_attitude("150,0,0").expect("angles");
        assert_eq!(gimbals.beyond(&scheme.positions[0]).map(|b| b.1), Some("150,0,0".into()));
    }
}

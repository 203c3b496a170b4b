//! The gimbals: their axes, their limits, and the gimbal angles of an attitude.
//!
//! `C_c^n = Mx(alpha) My(beta) Mz(gamma)` (19) takes platform components to geographic ones. Its first
//! factor acts on geographic components: a change of alpha turns everything inside about North, an axis
//! fixed to the base, so alpha is the *outer* gimbal. Its last factor acts on platform components: a change
//! of gamma turns the platform alone, about Z_p, so gamma is the *inner* gimbal. Beta turns the *middle*
//! gimbal about the axis `Mx(alpha) e_y`. The outer gimbal carries this axis along and the inner one does
//! not move it; it is Up where alpha = 0. The matrices are passive: a positive angle turns the platform
//! left-handed about these axes.

use std::fmt;

use super::angle::{Angle, format_decimal, parse_decimal};
use super::attitude::{Euler, Matrix3, angles_text, c_n_f64};
use super::position::Position;
use crate::model::slew::Slew;

/// Whole turn in 1e-9 degrees.
const TURN: i64 = 360_000_000_000;
/// Half turn in 1e-9 degrees.
const HALF: i64 = TURN / 2;
/// Rounding of angles computed from a matrix, in 1e-9 degrees.
pub(super) const ROUNDING: i64 = 100_000;

/// Limits on alpha, beta, gamma as `[low, high]` in 1e-9 degrees; `None`: the gimbal turns freely.
///
/// An attitude has two sets of Euler angles, `(a, b, g)` and its twin `(a+180, 180-b, g+180)`, each up to
/// whole turns, and at `b = +-90` infinitely many. The attitude is reached if one of them lies within the
/// limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gimbals {
    /// Limits of alpha, beta and gamma.
    pub limits: [Option<[i64; 2]>; 3],
}

/// Error for a text that is not a limit of a gimbal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no gimbal limit; expected alpha, beta or gamma and degrees, as in beta=-80:80")]
pub struct GimbalError {
    /// The text found.
    pub found: String,
}

/// Names of the Euler angles and their gimbals, outer to inner.
pub const GIMBAL_NAMES: [&str; 3] = ["alpha", "beta", "gamma"];

impl Gimbals {
    /// Sets one limit from a text such as `beta=-80:80`.
    ///
    /// # Errors
    /// [`GimbalError`].
    pub fn limit(&mut self, text: &str) -> Result<(), GimbalError> {
        let parse = || {
            let (name, range) = text.split_once('=')?;
            let (low, high) = range.split_once(':')?;
            let k = GIMBAL_NAMES.iter().position(|n| *n == name.trim())?;
            let limits = [parse_decimal(low.trim()).ok()?, parse_decimal(high.trim()).ok()?];
            (limits[0] <= limits[1]).then_some((k, limits))
        };
        let (k, limits) = parse().ok_or_else(|| GimbalError { found: text.into() })?;
        self.limits[k] = Some(limits);
        Ok(())
    }

    /// True if the angles lie within the limits as written, whole turns included. Generic angles count as
    /// within.
    pub fn hold(&self, angles: &Euler) -> bool {
        let within = |(a, limit): (&Angle, Option<[i64; 2]>)| {
            a.generic().is_some() || limit.is_none_or(|[low, high]| (low..=high).contains(&a.nanodeg()))
        };
        angles.iter().zip(self.limits).all(within)
    }

    /// Gimbal angles of the attitude of `angles` within the limits, with the shortest gimbal way from
    /// `before`. They are exact angles of the same attitude. `None` if the gimbals do not reach the
    /// attitude; generic angles stay unchanged.
    ///
    /// The gimbal way is the sum of the angles by which the three gimbals turn. Of equal ways, the one
    /// with the smaller largest turn is taken, then the one with beta in -90..90. A gimbal without a limit
    /// turns the shorter way round, and its angle lies in (-180, 180]. At `beta = +-90` alpha and gamma turn
    /// about the same line: alpha is kept, or changed as little as possible if gamma cannot follow.
    pub fn nearest(&self, angles: &Euler, before: &Euler) -> Option<Euler> {
        if angles.iter().any(|a| a.generic().is_some()) {
            return Some(angles.clone());
        }
        let from: [i64; 3] =
            std::array::from_fn(|k| if before[k].generic().is_some() { 0 } else { before[k].nanodeg() });
        let [a, b, g] = std::array::from_fn(|k| angles[k].nanodeg());
        let way = |to: &[i64; 3]| -> [i64; 3] { std::array::from_fn(|k| (to[k] - from[k]).abs()) };
        let found = if is_singular(b) {
            let along = self.locked([a, b, g], from);
            along.into_iter().min_by_key(|to| (way(to)[0], way(to).iter().sum::<i64>()))
        } else {
            let twins = [[a, b, g], [a + HALF, HALF - b, g + HALF]];
            let placed = twins.iter().filter_map(|twin| self.placed(*twin, from));
            placed.min_by_key(|to| {
                let way = way(to);
                (way.iter().sum::<i64>(), way.into_iter().max(), wrapped(to[1]).abs() > HALF / 2)
            })
        }?;
        let shown = |k: usize| if self.limits[k].is_some() { found[k] } else { wrapped(found[k]) };
        Some(std::array::from_fn(|k| Angle::from_nanodeg(shown(k))))
    }

    /// Gimbal angles of successive attitudes, each with the shortest gimbal way from the one before, the
    /// first from (0, 0, 0). Attitudes that the gimbals do not reach stay unchanged. Without limits the
    /// angles lie in (-180, 180].
    pub fn along(&self, attitudes: &[Euler]) -> Vec<Euler> {
        let mut out: Vec<Euler> = Vec::with_capacity(attitudes.len());
        let zero: Euler = std::array::from_fn(|_| Angle::from_degrees(0));
        for angles in attitudes {
            let before = out.last().unwrap_or(&zero);
            let chosen = if self.are_free() { normalised(angles) } else { self.nearest(angles, before) };
            out.push(chosen.unwrap_or_else(|| angles.clone()));
        }
        out
    }

    /// The angles, each moved by whole turns to the value within its limits that is nearest to `from`;
    /// `None` if one has none.
    fn placed(&self, angles: [i64; 3], from: [i64; 3]) -> Option<[i64; 3]> {
        let mut out = angles;
        for k in 0..3 {
            out[k] = self.place(k, angles[k], from[k])?;
        }
        Some(out)
    }

    /// Angle `x` of gimbal `k`, moved by whole turns to the value within its limits that is nearest to
    /// `near`.
    fn place(&self, k: usize, x: i64, near: i64) -> Option<i64> {
        let at = near + wrapped(x - near);
        let Some([low, high]) = self.limits[k] else { return Some(at) };
        // the value nearest to `near`, or the first one inside
        let inside = if at < low {
            low + (x - low).rem_euclid(TURN)
        } else if at > high {
            high - (high - x).rem_euclid(TURN)
        } else {
            at
        };
        (low..=high).contains(&inside).then_some(inside)
    }

    /// Angles at `beta = +-90` within the limits: for every value of gamma the alpha nearest to that of
    /// `from`.
    fn locked(&self, [a, b, g]: [i64; 3], from: [i64; 3]) -> Vec<[i64; 3]> {
        let Some(beta) = self.place(1, b, from[1]) else { return Vec::new() };
        // at b = 90 only a - g counts, at b = -90 only a + g
        let up = wrapped(b) == HALF / 2;
        let (fixed, sign) = if up { (a - g, 1) } else { (a + g, -1) };
        let [low, high] = self.limits[0].unwrap_or([from[0] - HALF, from[0] + HALF]);
        let Some([gl, gh]) = self.limits[2] else {
            let alpha = from[0].clamp(low, high);
            let gamma = from[2] + wrapped(sign * (alpha - fixed) - from[2]);
            return vec![[alpha, beta, gamma]];
        };
        // alphas for gamma's range, moved by whole turns over the range of alpha
        let (first, last) = if up { (gl + fixed, gh + fixed) } else { (fixed - gh, fixed - gl) };
        let turns = -(last - low).div_euclid(TURN)..=(high - first).div_euclid(TURN);
        let of = |n: i64| {
            let (least, most) = ((first + n * TURN).max(low), (last + n * TURN).min(high));
            (least <= most).then(|| {
                let alpha = from[0].clamp(least, most);
                [alpha, beta, sign * (alpha - n * TURN - fixed)]
            })
        };
        turns.filter_map(of).collect()
    }

    /// True if no gimbal has a limit.
    pub fn are_free(&self) -> bool {
        self.limits.iter().all(Option::is_none)
    }

    /// True if the gimbals reach an attitude; an attitude with a generic angle counts as reached.
    pub fn reach(&self, angles: &Euler) -> bool {
        if self.are_free() || angles.iter().any(|a| a.generic().is_some()) {
            return true;
        }
        self.reach_nanodeg(std::array::from_fn(|k| angles[k].nanodeg()), 0)
    }

    fn reach_nanodeg(&self, [a, b, g]: [i64; 3], slack: i64) -> bool {
        let limit = |k: usize| self.limits[k].map_or([0, TURN], |[low, high]| [low - slack, high + slack]);
        let within = |x: i64, [low, high]: [i64; 2]| (x - low).rem_euclid(TURN) <= high - low;
        if is_singular(b) {
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

    /// Name and attitude of a position that the gimbals do not reach, or of an unreached point of a rotating
    /// segment (tested at every degree).
    pub fn beyond(&self, position: &Position) -> Option<(String, String)> {
        let name = || position.name.clone();
        if !self.reach(&position.angles) {
            return Some((name(), angles_text(&position.angles)));
        }
        let r = position.rotation.as_ref().filter(|_| !self.are_free())?;
        if position.angles.iter().any(|a| a.generic().is_some()) {
            return None;
        }
        let start = c_n_f64(&position.angles);
        // points of the turn, one for every degree; beyond a whole turn no attitude is new
        let whole = r.angle.nanodeg() as f64 / 1e9;
        let path = Slew::about(&start, r, whole.abs());
        let arc = whole.abs().min(360.0);
        let steps = arc.ceil();
        (1..=steps as usize).map(|k| k as f64 * arc / steps).find_map(|t| {
            let angles = euler_angles(&path.at(t)).map(|x| (x.to_degrees() * 1e9).round() as i64);
            let turned = if whole < 0.0 { -t } else { t };
            (!self.reach_nanodeg(angles, ROUNDING))
                .then(|| (name(), format!("{} turned by {turned:.0} deg", angles_text(&position.angles))))
        })
    }
}

/// Angle in 1e-9 degrees, moved by whole turns into (-180, 180] degrees.
fn wrapped(x: i64) -> i64 {
    HALF - (HALF - x).rem_euclid(TURN)
}

/// Angles, the constant ones moved by whole turns into (-180, 180] degrees; generic ones stay unchanged.
fn normalised(angles: &Euler) -> Option<Euler> {
    let shown = |a: &Angle| match a.generic() {
        None => Angle::from_nanodeg(wrapped(a.nanodeg())),
        Some(_) => a.clone(),
    };
    Some(angles.each_ref().map(shown))
}

/// True at `beta = +-90` degrees, where alpha and gamma turn about one line.
fn is_singular(beta: i64) -> bool {
    (beta + HALF / 2).rem_euclid(HALF) == 0
}

impl fmt::Display for Gimbals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limited = GIMBAL_NAMES.iter().zip(self.limits).filter_map(|(name, limit)| {
            limit
                .map(|[low, high]| format!("{name} from {} to {}", format_decimal(low), format_decimal(high)))
        });
        let limited: Vec<String> = limited.collect();
        if limited.is_empty() { f.write_str("any angles") } else { write!(f, "{} deg", limited.join(", ")) }
    }
}

/// True where beta is `+-90` degrees up to rounding.
pub(super) fn is_locked(c: &Matrix3<f64>) -> bool {
    c[0][2].abs() > 1.0 - 1e-12
}

/// Euler angles of `C_c^n`, rounded to 1e-9 degrees, beta in -90..90 degrees.
pub fn euler_of(c: &Matrix3<f64>) -> Euler {
    euler_angles(c).map(|x| Angle::from_nanodeg((x.to_degrees() * 1e9).round() as i64))
}

/// Euler angles (rad) of `C_c^n`, beta in -90..90 degrees.
pub(crate) fn euler_angles(c: &Matrix3<f64>) -> [f64; 3] {
    // C = Mx My Mz: row 0 is (cb cg, cb sg, -sb), column 2 is (-sb, sa cb, ca cb)
    // near +-90 degrees an arc sine has half the digits
    let beta = (-c[0][2]).atan2(c[0][0].hypot(c[0][1]));
    if is_locked(c) {
        // only a -+ g is determined: choose gamma = 0; the middle column of Mx My is (0, ca, -sa)
        return [(-c[2][1]).atan2(c[1][1]), beta, 0.0];
    }
    [c[1][2].atan2(c[2][2]), beta, c[0][1].atan2(c[0][0])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::attitude::{cardinal, cardinal_names};
    use crate::model::rotation::Rotation;
    use crate::model::{position::parse_attitude, scheme::Scheme};
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

        /// The verdict equals that of a search over all gimbal angles in steps.
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

    /// Columns of `C_c^n` by turning a platform whose axes lie along North, Up, East, with its gimbals, from
    /// the inside out. The inner gimbal turns the platform about its own Z, the middle one turns both about
    /// its own Y, the outer one turns everything about North.
    fn nested([a, b, g]: [f64; 3]) -> Matrix3<f64> {
        // Rodrigues: v cos + (k x v) sin + k (k v) (1 - cos), left-handed
        let turned = |v: [f64; 3], k: [f64; 3], degrees: f64| -> [f64; 3] {
            let (s, c) = (-degrees).to_radians().sin_cos();
            let dot: f64 = (0..3).map(|i| k[i] * v[i]).sum();
            std::array::from_fn(|i| {
                let (j, l) = ((i + 1) % 3, (i + 2) % 3);
                v[i] * c + (k[j] * v[l] - k[l] * v[j]) * s + k[i] * dot * (1.0 - c)
            })
        };
        let unit = |i: usize| -> [f64; 3] { std::array::from_fn(|j| f64::from(u8::from(i == j))) };
        let axes = [0, 1, 2].map(|i| turned(turned(turned(unit(i), unit(2), g), unit(1), b), unit(0), a));
        std::array::from_fn(|i| std::array::from_fn(|j| axes[j][i]))
    }

    proptest! {
        /// Alpha is the outer gimbal, about North; beta the middle, about an axis that alpha alone moves;
        /// gamma the inner, about Z_p.
        #[test]
        fn gimbals_from_the_inside_out(at in prop::array::uniform3(-180.0f64..180.0), by in -90.0f64..90.0) {
            let c = of_degrees(at);
            prop_assert!(distance(&c, &nested(at)) < 1e-12);
            let changed = |k: usize| of_degrees(std::array::from_fn(|i| at[i] + if i == k { by } else { 0.0 }));
            // a turn leaves its axis unchanged: rows are along North, columns are platform axes
            prop_assert!((0..3).all(|j| (changed(0)[0][j] - c[0][j]).abs() < 1e-12));
            prop_assert!((0..3).all(|i| (changed(2)[i][2] - c[i][2]).abs() < 1e-12));
            let (s, cos) = at[0].to_radians().sin_cos();
            let middle = |c: &Matrix3<f64>, j: usize| cos * c[1][j] - s * c[2][j];
            prop_assert!((0..3).all(|j| (middle(&changed(1), j) - middle(&c, j)).abs() < 1e-12));
        }

        /// The nearest angles have the shortest way of all gimbal angles within the limits that give the
        /// attitude; at beta = +-90, of those that keep alpha, if there are any.
        #[test]
        fn the_nearest_angles_are_what_a_search_over_gimbal_angles_finds(
            angles in prop::array::uniform3(-24i64..=24),
            before in prop::array::uniform3(-12i64..=12),
            low in prop::array::uniform3(-24i64..=6),
            width in prop::array::uniform3(prop::option::weighted(0.8, 0i64..=20)),
        ) {
            let limits = std::array::from_fn(|k| width[k].map(|w| [low[k] * 15, (low[k] + w) * 15]));
            let gimbals = limited(limits);
            let of = |angles: [i64; 3]| angles.map(|a| Angle::from_nanodeg(a * 15 * DEG));
            let target = of_degrees(angles.map(|a| (a * 15) as f64));
            // a free gimbal turns at most half a turn in each direction
            let range = |k: usize| match limits[k] {
                Some([low, high]) => low / 15..=high / 15,
                None => before[k] - 12..=before[k] + 12,
            };
            let way = |to: [i64; 3]| -> [i64; 3] { std::array::from_fn(|k| (to[k] - before[k]).abs()) };
            let locked = angles[1].rem_euclid(12) == 6;
            let key = |to: [i64; 3]| (if locked { way(to)[0] } else { 0 }, way(to).iter().sum::<i64>());
            let mut best: Option<(i64, i64)> = None;
            for a in range(0) {
                for b in range(1) {
                    for g in range(2) {
                        let here = key([a, b, g]);
                        let better = best.is_none_or(|best| here < best);
                        if better && distance(&of_degrees([a, b, g].map(|x| (x * 15) as f64)), &target) < 1e-9 {
                            best = Some(here);
                        }
                    }
                }
            }
            let found = gimbals.nearest(&of(angles), &of(before));
            prop_assert_eq!(found.is_some(), gimbals.reach(&of(angles)));
            prop_assert_eq!(found.is_some(), best.is_some());
            let Some(found) = found else { return Ok(()) };
            prop_assert!(gimbals.hold(&found), "{found:?} {gimbals}");
            let found: [i64; 3] = std::array::from_fn(|k| found[k].nanodeg() / DEG / 15);
            prop_assert!(distance(&of_degrees(found.map(|x| (x * 15) as f64)), &target) < 1e-9);
            let round = |k: usize| if width[k].is_some() {
                found[k]
            } else {
                before[k] + wrapped((found[k] - before[k]) * 15 * DEG) / DEG / 15
            };
            prop_assert_eq!(Some(key(std::array::from_fn(round))), best);
            prop_assert!((0..3).all(|k| width[k].is_some() || (-11..=12).contains(&found[k])));
        }

        /// The nearest angles give exactly the same attitude: the matrices are equal in a prime field that
        /// contains the sines of all angles.
        #[test]
        fn the_nearest_angles_give_the_same_attitude(
            angles in prop::array::uniform3(-400_000_000_000i64..400_000_000_000),
            right in prop::option::of(-2i64..=2),
            before in prop::array::uniform3(-400_000_000_000i64..400_000_000_000),
            low in -180_000_000_000i64..0,
            width in 0i64..300_000_000_000,
            k in 0usize..3,
            seed in 0u64..1000,
        ) {
            let of = |angles: [i64; 3]| angles.map(Angle::from_nanodeg);
            let [a, b, g] = angles;
            let euler = of([a, right.map_or(b, |r| (2 * r + 1) * HALF / 2), g]);
            let mut gimbals = Gimbals::default();
            gimbals.limits[k] = Some([low, low + width]);
            let Some(found) = gimbals.nearest(&euler, &of(before)) else { return Ok(()) };
            prop_assert!(gimbals.hold(&found));
            let turns = euler.iter().chain(&found).map(Angle::turn);
            let mut rng = obsdeg_exact::SplitMix64::new(seed);
            let roots =
                obsdeg_exact::RootField::random(obsdeg_exact::turn::common_order(turns), &mut rng)
                    .expect("a field");
            let matrix = |euler: &Euler| {
                let cs = euler.each_ref().map(|a| roots.cos_sin(roots.unit_circle(a.turn()).expect("held")));
                crate::model::attitude::c_n_from_euler(&roots.field, &cs)
            };
            prop_assert_eq!(matrix(&euler), matrix(&found), "{:?} {:?}", euler, found);
        }
    }

    /// By hand: 135 of a gimbal that stops at 90 becomes its twin -45. The way from the position before
    /// decides where both are within the limits.
    #[test]
    fn twins_by_hand() {
        let gimbals = limited([Some([-90, 90]), None, None]);
        let near = |gimbals: &Gimbals, angles: &str, before: &str| {
            let of = |text: &str| parse_attitude(text).expect("angles");
            gimbals.nearest(&of(angles), &of(before)).map(|e| e.map(|a| a.to_string()).join(","))
        };
        assert_eq!(near(&gimbals, "135,0,0", "0,0,0").as_deref(), Some("-45,180,180"));
        assert_eq!(near(&gimbals, "180,0,0", "0,0,0").as_deref(), Some("0,180,180"));
        assert_eq!(near(&gimbals, "361.13,10,0", "0,0,0").as_deref(), Some("1.13,10,0"));
        // 90 and -90 are both within
        assert_eq!(near(&gimbals, "90,0,0", "90,0,0").as_deref(), Some("90,0,0"));
        assert_eq!(near(&gimbals, "90,0,0", "-90,180,180").as_deref(), Some("-90,180,180"));
        // at beta = 90 alpha - gamma counts: alpha stays
        assert_eq!(near(&gimbals, "180,90,0", "30,0,0").as_deref(), Some("30,90,-150"));
        let narrow = limited([Some([-90, 90]), None, Some([-100, 100])]);
        assert_eq!(near(&narrow, "180,90,0", "30,0,0").as_deref(), Some("80,90,-100"));
        // whole turns of a gimbal that turns by more than one
        let wide = limited([Some([-270, 270]), Some([-80, 80]), None]);
        assert_eq!(near(&wide, "-170,0,0", "150,0,0").as_deref(), Some("190,0,0"));
        assert_eq!(near(&wide, "0,90,0", "0,0,0"), None);
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

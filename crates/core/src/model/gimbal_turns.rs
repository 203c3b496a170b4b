//! Turns of the platform by its gimbals: whether the gimbal angles stay within their limits during the turn,
//! not only at its ends.
//!
//! From gimbal angles `(a, b, g)` a turn about one axis moves the gimbals along one path. The path is
//! followed in steps of at most one degree, and of a quarter of the distance to `beta = +-90`. There alpha
//! and gamma turn about the same line, and a turn about the line perpendicular to both is possible only
//! after they have swung round.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attitude::{Euler, Matrix3, angles_text, c_n_f64};
use super::gimbals::{GIMBAL_NAMES, Gimbals, ROUNDING, euler_angles, is_locked};
use super::path::Path;
use super::scheme::{Position, Scheme};
use super::slew::{Slew, Turn};

/// Largest step along the path, in degrees of the turn.
const STEP_DEG: f64 = 1.0;
/// Smallest step, in degrees of the turn.
const LEAST_DEG: f64 = 0.01;
/// Smallest step as a fraction of the turn.
const LEAST_PART: f64 = 1e-5;
/// Number of points in a step at which the rates of the gimbals are taken.
const RATES: u32 = 8;
/// Largest rate of a gimbal that can follow, as a multiple of the platform's rate.
const FASTEST: f64 = 100.0;

/// Gimbal limits of a scheme, with the angles and turns that exceed them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GimbalReport {
    /// Gimbal limits in words, in degrees.
    pub limits: String,
    /// Positions written with angles beyond a limit, each with angles of the same attitude within the limits.
    pub beyond: Vec<BeyondLimits>,
    /// Turns to every position but the first, and rotations of segments; empty for generic angles.
    pub turns: Vec<GimbalTurn>,
}

/// Position written with angles beyond a gimbal limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BeyondLimits {
    /// Name of the position in the scheme.
    pub position: String,
    /// Euler angles as written, in degrees.
    pub angles: String,
    /// Euler angles of the same attitude within the limits, in degrees.
    pub within: String,
}

/// Turn of the platform, followed from gimbal angles within the limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GimbalTurn {
    /// Name of the position that the turn leads to, or whose rotation it is.
    pub position: String,
    /// True for the rotation of a segment.
    pub rotation: bool,
    /// True if the scheme states that the platform turns gimbal by gimbal.
    pub by_gimbals: bool,
    /// Turn about one axis; null if the attitude stays the same, or gimbal by gimbal.
    pub turn: Option<Turn>,
    /// True if all gimbal angles stay within their limits during the turn; gimbal by gimbal, judged by the
    /// angles as written.
    pub stays: bool,
    /// Obstacle of the turn about one axis; null if it stays within the limits, and gimbal by gimbal.
    pub stop: Option<GimbalStop>,
    /// Gimbal angles at the end of the turn in degrees (alpha, beta, gamma); null if it stops, or ends at the
    /// angles listed.
    pub ends_deg: Option<[f64; 3]>,
    /// Changes of alpha, beta and gamma, in degrees, of the slew path gimbal by gimbal (`path = "gimbals"`)
    /// between angles within the limits, which stays within them; null for a rotation.
    pub gimbals_deg: Option<[f64; 3]>,
}

/// Obstacle of a turn about one axis: a gimbal reaches its limit, or near `beta = +-90` degrees alpha and
/// gamma would have to turn more than a hundred times as fast as the platform.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GimbalStop {
    /// Gimbal that reaches its limit: alpha, beta or gamma; null near `beta = +-90` degrees.
    pub gimbal: Option<String>,
    /// Limit that is reached, in degrees; without a gimbal, beta in degrees.
    pub at_deg: f64,
    /// Angle that the platform has turned by when it stops, in degrees.
    pub after_deg: f64,
}

impl Scheme {
    /// Angles and turns beyond the gimbal limits; `None` where the scheme states no limits.
    pub fn gimbal_report(&self) -> Option<GimbalReport> {
        let gimbals = &self.gimbals;
        if gimbals.are_free() {
            return None;
        }
        let stands = self.gimbal_angles();
        let beyond = self.positions.iter().zip(&stands).filter(|(p, within)| p.angles != **within);
        let beyond = beyond.map(|(p, within)| BeyondLimits {
            position: p.name.clone(),
            angles: angles_text(&p.angles),
            within: angles_text(within),
        });
        let mut turns = Vec::new();
        // gimbal angles at the start of the turn to the next position
        let mut start = None;
        for (i, (p, angles)) in self.positions.iter().zip(&stands).enumerate() {
            let constant = angles.iter().all(|a| a.generic().is_none());
            if let (Some(start), Some(before), true) = (start, i.checked_sub(1), constant) {
                turns.extend(self.turn_to(&self.positions[before], start, p, degrees(angles)));
            }
            start = constant.then(|| degrees(angles));
            if let Some(r) = p.rotation.as_ref().filter(|_| constant) {
                let slew = Slew::about(&c_n_f64(angles), r, 1.0);
                let (stop, end) = gimbals.follow(degrees(angles), &slew);
                start = stop.is_none().then_some(end);
                turns.push(GimbalTurn {
                    position: p.name.clone(),
                    rotation: true,
                    by_gimbals: false,
                    turn: Some(slew.turn()),
                    stays: stop.is_none(),
                    stop,
                    ends_deg: None,
                    gimbals_deg: None,
                });
            }
        }
        Some(GimbalReport { limits: gimbals.to_string(), beyond: beyond.collect(), turns })
    }

    /// Gimbal angles of the positions. Angles within the limits are taken as written; otherwise those of the
    /// same attitude with the shortest gimbal way from the position before.
    pub(super) fn gimbal_angles(&self) -> Vec<Euler> {
        let mut out: Vec<Euler> = Vec::with_capacity(self.positions.len());
        for p in &self.positions {
            let before = out.last().unwrap_or(&p.angles);
            let within =
                if self.gimbals.hold(&p.angles) { None } else { self.gimbals.nearest(&p.angles, before) };
            out.push(within.unwrap_or_else(|| p.angles.clone()));
        }
        out
    }

    /// The turn to the next position, at gimbal angles `listed` (degrees), from one position that ends at
    /// gimbal angles `start`; `None` where the stated turn does not lead there.
    fn turn_to(
        &self,
        from: &Position,
        start: [f64; 3],
        to: &Position,
        listed: [f64; 3],
    ) -> Option<GimbalTurn> {
        let how = to.slew.clone().unwrap_or_default();
        let by_gimbals = how.axis.is_none() && self.path == Some(Path::Gimbals);
        let mut out = GimbalTurn {
            position: to.name.clone(),
            rotation: false,
            by_gimbals,
            turn: None,
            stays: true,
            stop: None,
            ends_deg: None,
            gimbals_deg: Some(std::array::from_fn(|k| clean(listed[k] - start[k]))),
        };
        if by_gimbals {
            // gimbal by gimbal, the turn uses the angles as written
            let difference = |k: usize| degrees(&to.angles)[k] - degrees(&from.angles)[k];
            out.gimbals_deg = Some(std::array::from_fn(|k| clean(difference(k))));
            out.stays = self.gimbals.hold(&from.angles) && self.gimbals.hold(&to.angles);
            return from.rotation.is_none().then_some(out);
        }
        let matrix = c_n_f64(&from.angles);
        let matrix = from.rotation.as_ref().map_or(matrix, |r| Slew::about(&matrix, r, 1.0).at(1.0));
        let Some(slew) = Slew::to(&matrix, &c_n_f64(&to.angles), &how, 1.0).ok()? else {
            return Some(out);
        };
        let (stop, reached) = self.gimbals.follow(start, &slew);
        (out.turn, out.stays) = (Some(slew.turn()), stop.is_none());
        // whole turns of a gimbal without a limit do not count
        let off = |k: usize| match self.gimbals.limits[k] {
            Some(_) => reached[k] - listed[k],
            None => beside(reached[k] - listed[k], 0.0),
        };
        let elsewhere = (0..3).any(|k| off(k).abs() > ROUNDING as f64 / 1e9);
        out.ends_deg = (stop.is_none() && elsewhere).then(|| reached.map(clean));
        out.stop = stop;
        Some(out)
    }
}

/// Magnitudes of the rates of alpha, beta, gamma at the attitude `c` for a turn about `about` in n, over the
/// rate of the platform; zeros at `beta = +-90`, where they are not determined.
fn gimbal_rates(c: &Matrix3<f64>, about: &[f64; 3]) -> [f64; 3] {
    if is_locked(c) {
        return [0.0; 3];
    }
    let [a, b, _] = euler_angles(c);
    let ((sa, ca), (sb, cb)) = (a.sin_cos(), b.sin_cos());
    // the gimbals turn left-handed about North, the middle axis Mx(alpha) e_y and Z_p
    let inner = -(about[1] * sa + about[2] * ca) / cb;
    [-about[0] + inner * sb, -(about[1] * ca - about[2] * sa), inner].map(f64::abs)
}

pub(super) fn degrees(angles: &Euler) -> [f64; 3] {
    angles.each_ref().map(|a| a.nanodeg() as f64 / 1e9)
}

/// Angle in degrees without the rounding errors of sines.
pub(super) fn clean(deg: f64) -> f64 {
    (deg * 1e6).round() / 1e6 + 0.0
}

/// Angle in degrees, moved by whole turns to the value nearest to `near`.
pub(super) fn beside(deg: f64, near: f64) -> f64 {
    deg + ((near - deg) / 360.0).round() * 360.0
}

/// Distance of beta to the nearer of `+-90`, in degrees.
pub(super) fn from_lock(beta: f64) -> f64 {
    (beside(beta, 0.0).abs() - 90.0).abs()
}

impl Gimbals {
    /// Limit of gimbal `k` that its angle exceeds, in degrees; `None` if it exceeds none.
    fn passed(&self, k: usize, angle: f64) -> Option<f64> {
        let [low, high] = self.limits[k]?.map(|x| x as f64 / 1e9);
        let rounding = ROUNDING as f64 / 1e9;
        if angle < low - rounding { Some(low) } else { (angle > high + rounding).then_some(high) }
    }

    /// The gimbal that reaches its limit first between two sets of angles in degrees, the limit, and the
    /// fraction of the step up to it.
    fn first_passed(&self, at: &[f64; 3], next: &[f64; 3]) -> Option<(usize, f64, f64)> {
        let passed = (0..3).filter_map(|k| {
            let limit = self.passed(k, next[k])?;
            Some((k, limit, ((limit - at[k]) / (next[k] - at[k])).clamp(0.0, 1.0)))
        });
        passed.min_by(|a, b| a.2.total_cmp(&b.2))
    }

    /// Follows a turn from gimbal angles in degrees. Returns the obstacle that stops it, if there is one,
    /// and the gimbal angles reached.
    pub(super) fn follow(&self, start: [f64; 3], slew: &Slew) -> (Option<GimbalStop>, [f64; 3]) {
        let (stop, at, _) = self.followed(start, slew);
        (stop, at)
    }

    /// Follows a turn as [`Self::follow`] does; returns also the largest turn of each gimbal per turn of the
    /// platform.
    pub(super) fn followed(&self, start: [f64; 3], slew: &Slew) -> (Option<GimbalStop>, [f64; 3], [f64; 3]) {
        let turn = slew.turn();
        let whole = turn.angle_deg;
        let (mut at, mut done, mut fastest) = (start, 0.0, [0.0f64; 3]);
        // a turn of very many degrees takes larger steps
        let least = LEAST_DEG.max(whole * LEAST_PART);
        let most = STEP_DEG.max(least);
        while done < whole {
            let step = (from_lock(at[1]) / 4.0).clamp(least, most).min(whole - done);
            let next = self.beside(&slew.at((done + step) / whole * slew.duration_s), at);
            let swing = [0, 2].into_iter().map(|k| (next[k] - at[k]).abs()).fold(0.0, f64::max);
            if swing > FASTEST * step.max(least) {
                let stop = GimbalStop { gimbal: None, at_deg: clean(at[1]), after_deg: clean(done) };
                return (Some(stop), at, fastest);
            }
            if let Some((k, at_deg, part)) = self.first_passed(&at, &next) {
                let after_deg = clean(done + part * step);
                let gimbal = Some(GIMBAL_NAMES[k].into());
                return (Some(GimbalStop { gimbal, at_deg, after_deg }), at, fastest);
            }
            for part in (0..=RATES).map(|j| (done + step * f64::from(j) / f64::from(RATES)) / whole) {
                let own = gimbal_rates(&slew.at(part * slew.duration_s), &turn.about);
                fastest = std::array::from_fn(|k| fastest[k].max(own[k]));
            }
            (at, done) = (next, done + step);
        }
        (None, at, fastest)
    }

    /// Gimbal angles in degrees of an attitude, nearest to `near`. At `beta = +-90` alpha is kept, unless
    /// gamma alone cannot follow.
    fn beside(&self, c: &Matrix3<f64>, near: [f64; 3]) -> [f64; 3] {
        let [a, b, g] = euler_angles(c).map(f64::to_degrees);
        let placed = |angles: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| beside(angles[k], near[k])) };
        if is_locked(c) {
            // gamma is 0 there: a turn of alpha equals one of gamma, in the opposite sense at beta = -90
            let sign = b.signum();
            let kept = placed([near[0], b, sign * (near[0] - a)]);
            let other = placed([a + sign * near[2], b, near[2]]);
            let beyond = |to: &[f64; 3]| self.first_passed(&near, to).is_some();
            return if !beyond(&kept) || beyond(&other) { kept } else { other };
        }
        let way = |to: &[f64; 3]| (0..3).map(|k| (to[k] - near[k]).abs()).sum::<f64>();
        let (one, twin) = (placed([a, b, g]), placed([a + 180.0, 180.0 - b, g + 180.0]));
        if way(&twin) < way(&one) { twin } else { one }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::scheme_file;
    use crate::model::slew::{apply, rotation, transpose};
    use proptest::prelude::*;

    fn report(head: &str, positions: &[&str]) -> GimbalReport {
        let tables = positions.iter().map(|p| format!("[[position]]\n{p}\n"));
        let text = format!("{head}\n{}", tables.collect::<String>());
        scheme_file::read(&text).expect("a scheme").gimbal_report().expect("limits")
    }

    /// The gimbal that stops a turn, its limit and the angle turned, the angles in whole degrees.
    fn stopped(turn: &GimbalTurn) -> (Option<&str>, i32, i32) {
        let stop = turn.stop.as_ref().expect("a stop");
        let whole =
            [stop.at_deg.abs(), stop.after_deg].map(|x| (x.round() as i32, (x - x.round()).abs() < 1e-3));
        assert!(!turn.stays && whole.iter().all(|w| w.1), "{stop:?}");
        (stop.gimbal.as_deref(), whole[0].0, whole[1].0)
    }

    /// Rates of alpha, beta, gamma for a rate `w` of the platform in n. The gimbals turn left-handed about
    /// North, the middle axis and Z_p.
    fn rates([a, b, _]: [f64; 3], w: [f64; 3]) -> [f64; 3] {
        let [(sa, ca), (sb, cb)] = [a, b].map(|x| x.to_radians().sin_cos());
        // w = -a' (1, 0, 0) - b' (0, ca, -sa) - g' (-sb, sa cb, ca cb)
        let inner = -(w[1] * sa + w[2] * ca) / cb;
        [-w[0] + inner * sb, -(w[1] * ca - w[2] * sa), inner]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        /// A followed turn ends where the integrated gimbal rates (Runge-Kutta) end, and it stops at the
        /// limit that these exceed first.
        #[test]
        fn turns_are_integrals_of_gimbal_rates(
            start in prop::array::uniform3(-80.0f64..80.0),
            axis in prop::array::uniform3(-1.0f64..1.0),
            whole in 10.0f64..180.0,
            limits in prop::array::uniform3(90i64..200),
        ) {
            let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
            prop_assume!(length > 0.1);
            let unit = axis.map(|x| x / length);
            let c = rotation_of(start);
            let vector = apply(&transpose(&c), &unit.map(|x| x * whole.to_radians()));
            let slew = Slew::by(&c, &vector, 1.0);
            let nanodeg = |x: i64| x * 1_000_000_000;
            let gimbals = Gimbals { limits: limits.map(|l| Some([nanodeg(-l), nanodeg(l)])) };
            let (stop, end) = gimbals.follow(start, &slew);
            const STEPS: usize = 20_000;
            let h = whole / STEPS as f64;
            let mut at = start;
            for step in 0..STEPS {
                prop_assume!(from_lock(at[1]) > 2.0);
                let shifted = |k: [f64; 3], by: f64| -> [f64; 3] { std::array::from_fn(|i| at[i] + by * h * k[i]) };
                let k1 = rates(at, unit);
                let k2 = rates(shifted(k1, 0.5), unit);
                let k3 = rates(shifted(k2, 0.5), unit);
                let k4 = rates(shifted(k3, 1.0), unit);
                at = std::array::from_fn(|i| at[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
                if let Some(k) = (0..3).find(|&k| at[k].abs() > limits[k] as f64 + 0.001) {
                    let Some(stop) = stop else {
                        return Err(TestCaseError::fail(format!("no stop at {at:?}")));
                    };
                    let after_deg = stop.after_deg;
                    prop_assert_eq!(
                        (stop.gimbal.as_deref(), stop.at_deg),
                        (Some(GIMBAL_NAMES[k]), limits[k] as f64 * at[k].signum())
                    );
                    prop_assert!((after_deg - (step + 1) as f64 * h).abs() < 0.5, "{after_deg}");
                    return Ok(());
                }
            }
            // a limit that is only touched may or may not count
            prop_assume!((0..3).all(|k| (at[k].abs() - limits[k] as f64).abs() > 0.01));
            prop_assert_eq!(&stop, &None, "{:?}", at);
            prop_assert!((0..3).all(|k| (at[k] - end[k]).abs() < 1e-3), "{at:?} {end:?}");
        }
    }

    fn rotation_of(degrees: [f64; 3]) -> Matrix3<f64> {
        // active turns by the negative angles, from the inside out
        let about = |k: usize| {
            rotation(&std::array::from_fn(|i| if i == k { -degrees[k].to_radians() } else { 0.0 }))
        };
        crate::model::slew::times(&about(0), &crate::model::slew::times(&about(1), &about(2)))
    }

    /// By hand: half a turn about North is one of alpha; gimbal by gimbal it goes by the twin angles.
    #[test]
    fn half_a_turn_about_north() {
        let head = "gimbals = { alpha_deg = [-90, 90] }";
        let found = report(head, &["attitude = 'NUE'", "attitude = 'NDW'"]);
        let beyond =
            BeyondLimits { position: "p2".into(), angles: "180,0,0".into(), within: "0,180,180".into() };
        assert_eq!((found.limits.as_str(), &found.beyond[..]), ("alpha from -90 to 90 deg", &[beyond][..]));
        let [turn] = &found.turns[..] else { panic!("{found:?}") };
        assert_eq!((turn.stays, turn.ends_deg, turn.gimbals_deg), (false, None, Some([0.0, 180.0, 180.0])));
        assert_eq!(stopped(turn), (Some("alpha"), 90, 90));
        // gimbal by gimbal, with the angles as in the file
        let found = report(&format!("path = 'gimbals'\n{head}"), &["attitude = 'NUE'", "attitude = 'NDW'"]);
        assert_eq!((found.turns[0].by_gimbals, found.turns[0].stays), (true, false));
        let found =
            report(&format!("path = 'gimbals'\n{head}"), &["attitude = 'NUE'", "angles_deg = [0, 180, 180]"]);
        assert_eq!((found.turns[0].stays, found.turns[0].gimbals_deg), (true, Some([0.0, 180.0, 180.0])));
    }

    /// By hand: straight through beta = 90 beta exceeds its limit; perpendicular to it alpha and gamma have
    /// to swing by 90 degrees first.
    #[test]
    fn through_the_lock_and_across() {
        let wide = "gimbals = { beta_deg = [-170, 170] }";
        let slew = "slew = { about = 'U', angle_deg = -120 }";
        let straight = |head: &str| {
            report(head, &["angles_deg = [0, 0, 0]", &format!("angles_deg = [0, 120, 0]\n{slew}")])
        };
        let found = straight(wide);
        assert_eq!((found.turns[0].stays, found.turns[0].ends_deg), (true, None));
        let found = straight("gimbals = { beta_deg = [-90, 90] }");
        assert_eq!(found.beyond[0].within, "180,60,180");
        assert_eq!(stopped(&found.turns[0]), (Some("beta"), 90, 90));
        // at beta = 90, alpha = 0 the middle axis is Up and Z_p is South: a turn about East is perpendicular
        // to both
        let across =
            report(wide, &["angles_deg = [0, 90, 0]", "angles_deg = [90, 50, 90]\nslew = { about = 'E' }"]);
        let lock = GimbalStop { gimbal: None, at_deg: 90.0, after_deg: 0.0 };
        assert_eq!(
            (across.turns[0].stop.as_ref(), across.turns[0].gimbals_deg),
            (Some(&lock), Some([90.0, -40.0, 90.0]))
        );
    }

    /// At beta = 90 a turn about North is one of gamma, and of alpha where gamma is at its limit.
    #[test]
    fn alpha_takes_over_at_the_lock() {
        let positions = [
            "angles_deg = [0, 90, 0]",
            "angles_deg = [150, 90, 0]\nslew = { about = 'N', angle_deg = -150 }",
        ];
        let found = report("gimbals = { gamma_deg = [-60, 60] }", &positions);
        assert_eq!(found.turns[0].stop, None, "{found:?}");
        let found = report("gimbals = { gamma_deg = [-60, 60], alpha_deg = [-60, 160] }", &positions);
        assert_eq!((found.turns[0].stays, found.beyond.len()), (true, 0));
        let found = report(
            "gimbals = { gamma_deg = [0, 160], alpha_deg = [-200, -100] }",
            &[
                "angles_deg = [-100, 90, 0]",
                "angles_deg = [-110, 90, 140]\nslew = { about = 'N', angle_deg = 150 }",
            ],
        );
        // gamma takes all of the turn, and alpha stays
        assert_eq!((found.turns[0].stays, found.turns[0].ends_deg), (true, Some([-100.0, 90.0, 150.0])));
    }

    /// The turn after a rotation starts at the gimbal angles at the end of the rotation.
    #[test]
    fn a_rotation_winds_its_gimbal() {
        let positions = [
            "angles_deg = [0, 0, 0]\nrotation = { about = 'N', angle_deg = -100 }",
            "angles_deg = [160, 0, 0]",
        ];
        let found = report("gimbals = { alpha_deg = [-120, 170] }", &positions);
        assert_eq!(
            found.turns.iter().map(|t| (t.rotation, t.stays)).collect::<Vec<_>>(),
            [(true, true), (false, true)]
        );
        assert_eq!(found.turns[1].gimbals_deg, Some([60.0, 0.0, 0.0]));
        let found = report("gimbals = { alpha_deg = [-200, 90] }", &positions[..1]);
        assert_eq!(stopped(&found.turns[0]), (Some("alpha"), 90, 90));
    }
}

//! Attitudes of the platform in geographic axes at every position, and the turns that lead to them.

use super::attitude::{Matrix3, c_n_f64};
use super::path::Path;
use super::scheme::{Position, Scheme};
use super::slew::{Slew, Turn};

/// Attitude of the platform at one position, with the turns that lead to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    /// Name of the position.
    pub name: String,
    /// Euler angles in degrees, or their names.
    pub angles: [String; 3],
    /// Direction letters of X_p, Y_p, Z_p if all angles are multiples of 90 degrees; `None` otherwise.
    pub letters: Option<String>,
    /// `C_c^n` at the start (3x3; column j is platform axis j in North, Up, East); `None` for generic
    /// angles.
    pub attitude: Option<Matrix3<f64>>,
    /// Rotation while Z is observed, as in `X_p:90`; `None` if there is none.
    pub rotation: Option<String>,
    /// Turns that lead to the position. `None` for the first position, between generic angles, and if the
    /// stated turn does not lead there.
    pub way: Option<SlewTurns>,
}

/// Turns from one position to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct SlewTurns {
    /// Turns in order; none if the attitude stays the same.
    pub turns: Vec<Turn>,
    /// True if the scheme states the turns; otherwise they are the shortest turn.
    pub stated: bool,
}

impl Scheme {
    /// Poses of the platform at every position, in order.
    pub fn poses(&self) -> Vec<Pose> {
        let mut out: Vec<Pose> = Vec::with_capacity(self.positions.len());
        for (i, p) in self.positions.iter().enumerate() {
            let before = i.checked_sub(1).map(|k| &self.positions[k]);
            let constant = p.angles.iter().all(|a| a.generic().is_none());
            out.push(Pose {
                name: p.name.clone(),
                angles: p.angles.each_ref().map(ToString::to_string),
                letters: p.cardinal(),
                attitude: constant.then(|| c_n_f64(&p.angles)),
                rotation: p.rotation.as_ref().map(ToString::to_string),
                way: before.and_then(|from| self.way(from, p)),
            });
        }
        out
    }

    /// Turns from `from` to `to`; `None` for generic angles, and if the stated turn does not lead there.
    fn way(&self, from: &Position, to: &Position) -> Option<SlewTurns> {
        if from.angles.iter().chain(&to.angles).any(|a| a.generic().is_some()) {
            return None;
        }
        let stated = self.path.is_some() || to.slew.is_some() || self.simulation.slew_rate_deg_s.is_some();
        let start = c_n_f64(&from.angles);
        let mut end = from.rotation.as_ref().map_or(start, |r| Slew::about(&start, r, 1.0).at(1.0));
        let how = to.slew.clone().unwrap_or_default();
        if how.axis.is_some() || self.path != Some(Path::Gimbals) {
            let slew = Slew::to(&end, &c_n_f64(&to.angles), &how, 1.0).ok()?;
            return Some(SlewTurns { turns: slew.iter().map(Slew::turn).collect(), stated });
        }
        let mut turns = Vec::new();
        for step in Path::gimbals(from, to)? {
            let turn = step.at_f64(&end);
            let slew = Slew::by(&end, &turn.axis.map(|x| x * turn.angle), 1.0);
            end = slew.at(slew.duration_s);
            turns.push(slew.turn());
        }
        Some(SlewTurns { turns, stated })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::scheme_file;

    fn poses(head: &str, positions: &[&str]) -> Vec<Pose> {
        let tables = positions.iter().map(|p| format!("[[position]]\n{p}\n"));
        let text = format!("carry = 'inertial'\n{head}\n{}", tables.collect::<String>());
        scheme_file::read(&text).expect("a scheme").poses()
    }

    fn way(pose: &Pose) -> (bool, Vec<([f64; 3], f64)>) {
        let way = pose.way.as_ref().expect("a way");
        (way.stated, way.turns.iter().map(|t| (t.about, t.angle_deg)).collect())
    }

    /// By hand: X_p, Y_p, Z_p of NUE turned about North by 90 degrees stand North, East, Down.
    #[test]
    fn a_way_is_stated_or_the_shortest() {
        let two = ["attitude = 'NUE'", "attitude = 'NED'"];
        let found = poses("", &two);
        assert_eq!((found[0].way.as_ref(), found[1].letters.as_deref()), (None, Some("NED")));
        assert_eq!(way(&found[1]), (false, vec![([1.0, 0.0, 0.0], 90.0)]));
        assert_eq!(way(&poses("path = 'one-axis'", &two)[1]), (true, vec![([1.0, 0.0, 0.0], 90.0)]));
        assert!(way(&poses("[simulation]\nslew_rate_deg_s = 1", &two)[1]).0);
        let back = [two[0], "attitude = 'NED'\nslew = { about = 'N', angle_deg = -270 }"];
        assert_eq!(way(&poses("", &back)[1]), (true, vec![([-1.0, 0.0, 0.0], 270.0)]));
        // the end of the rotation is the next attitude: no turn remains
        let turning = ["attitude = 'NUE'\nrotation = { about = 'X_p', angle_deg = 90 }", two[1]];
        let found = poses("", &turning);
        assert_eq!((way(&found[1]), found[0].rotation.as_deref()), ((false, vec![]), Some("X_p:90")));
        let generic = poses("", &["angles_deg = ['alpha', 0, 0]", two[1]]);
        assert_eq!((generic[0].attitude, generic[1].way.as_ref()), (None, None));
        // a turn that does not lead there
        let astray = [two[0], "attitude = 'NED'\nslew = { about = 'U' }"];
        assert_eq!(poses("", &astray)[1].way, None);
    }

    /// Gimbal by gimbal the turns end at the attitude: alpha about N, beta about the middle axis, gamma
    /// about Z_p, each in the sense opposite to that of the passive matrices.
    #[test]
    fn the_turns_of_gimbals_lead_there() {
        let found = poses("path = 'gimbals'", &["angles_deg = [10, 25, 40]", "angles_deg = [130, -50, 70]"]);
        let (stated, turns) = way(&found[1]);
        assert_eq!((stated, turns.len(), turns[0]), (true, 3, ([-1.0, 0.0, 0.0], 120.0)));
        let mut at = found[0].attitude.expect("angles");
        for (about, angle) in turns {
            let turn = crate::model::slew::rotation(&about.map(|x| x * angle.to_radians()));
            at = crate::model::slew::times(&turn, &at);
        }
        let there = found[1].attitude.expect("angles");
        assert!((0..9).all(|k| (at[k / 3][k % 3] - there[k / 3][k % 3]).abs() < 1e-9), "{at:?} {there:?}");
    }
}

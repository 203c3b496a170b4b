//! Gimbal angles along a scheme as the platform executes it, turn by turn.

use super::attitude::c_n_f64;
use super::gimbal_turns::{GimbalStop, clean, degrees};
use super::path::Path;
use super::scheme::Scheme;
use super::slew::Slew;

/// Gimbal angles of one position of a scheme that is executed turn by turn.
#[derive(Debug, Clone, PartialEq)]
pub struct GimbalStation {
    /// Gimbal angles alpha, beta, gamma before the turn to the position, in degrees; those of the position
    /// itself for the first.
    pub before_deg: [f64; 3],
    /// Turns of the platform to the position: one about one axis, or up to three gimbal by gimbal. Durations
    /// are those at one deg/s.
    pub turns: Vec<Slew>,
    /// True if the platform turns gimbal by gimbal.
    pub by_gimbals: bool,
    /// Gimbal angles at the position, in degrees.
    pub at_deg: [f64; 3],
    /// Gimbal angles at the end of a rotating segment, in degrees; those at the position otherwise.
    pub after_deg: [f64; 3],
    /// Obstacle of the turn or of the rotation; `None` if the gimbals can follow.
    pub obstacle: Option<GimbalObstacle>,
}

/// Obstacle that keeps the gimbals from a position of a scheme.
#[derive(Debug, Clone, PartialEq)]
pub enum GimbalObstacle {
    /// A limit, or the lock near `beta = +-90` degrees.
    Stop(GimbalStop),
    /// Limits that no gimbal angles of the attitude satisfy, or angles beyond them gimbal by gimbal.
    Limits,
    /// A path gimbal by gimbal that is stated for other gimbal angles than those where the gimbals stand.
    Elsewhere,
    /// A stated turn that does not lead to the position.
    Misses,
}

impl Scheme {
    /// Gimbal angles along the scheme. The first position is taken within the limits as written, or at the
    /// angles of the same attitude that are. A turn about one axis is followed; gimbal by gimbal the angles
    /// as written are taken. `None` with generic angles.
    pub fn gimbal_sequence(&self) -> Option<Vec<GimbalStation>> {
        if !self.generic_names().is_empty() {
            return None;
        }
        let rate = 1f64.to_radians();
        let within = self.gimbal_angles();
        let mut out: Vec<GimbalStation> = Vec::with_capacity(self.positions.len());
        for (i, p) in self.positions.iter().enumerate() {
            let (attitude, listed) = (c_n_f64(&p.angles), degrees(&within[i]));
            let mut station = GimbalStation {
                before_deg: out.last().map_or(listed, |s| s.after_deg),
                turns: Vec::new(),
                by_gimbals: false,
                at_deg: listed,
                after_deg: listed,
                obstacle: (!self.gimbals.reach(&p.angles)).then_some(GimbalObstacle::Limits),
            };
            if let Some(before) = i.checked_sub(1).map(|b| &self.positions[b]) {
                let start = c_n_f64(&before.angles);
                let start = before.rotation.as_ref().map_or(start, |r| Slew::about(&start, r, 1.0).at(1.0));
                let how = p.slew.clone().unwrap_or_default();
                station.by_gimbals = how.axis.is_none() && self.path == Some(Path::Gimbals);
                if station.by_gimbals {
                    station.at_deg = degrees(&p.angles);
                    let as_written = degrees(&before.angles) == station.before_deg;
                    let mut from = start;
                    for step in Path::gimbals(before, p).into_iter().flatten() {
                        let turn = step.at_f64(&from);
                        let slew = Slew::by(&from, &turn.axis.map(|x| x * turn.angle), rate);
                        from = slew.at(slew.duration_s);
                        station.turns.push(slew);
                    }
                    let inside = self.gimbals.hold(&before.angles) && self.gimbals.hold(&p.angles);
                    station.obstacle = match (before.rotation.is_none(), inside, as_written) {
                        (false, _, _) => Some(GimbalObstacle::Misses),
                        (_, false, _) => Some(GimbalObstacle::Limits),
                        (_, _, false) => Some(GimbalObstacle::Elsewhere),
                        _ => None,
                    };
                } else {
                    match Slew::to(&start, &attitude, &how, rate) {
                        Err(_) => station.obstacle = Some(GimbalObstacle::Misses),
                        Ok(None) => station.at_deg = station.before_deg,
                        Ok(Some(slew)) => {
                            let (stop, reached) = self.gimbals.follow(station.before_deg, &slew);
                            match stop {
                                Some(stop) => station.obstacle = Some(GimbalObstacle::Stop(stop)),
                                None => station.at_deg = reached.map(clean),
                            }
                            station.turns.push(slew);
                        }
                    }
                }
            }
            station.after_deg = station.at_deg;
            if let Some(r) = &p.rotation {
                let (stop, reached) = self.gimbals.follow(station.at_deg, &Slew::about(&attitude, r, 1.0));
                station.after_deg = reached.map(clean);
                station.obstacle = station.obstacle.take().or(stop.map(GimbalObstacle::Stop));
            }
            out.push(station);
        }
        Some(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::attitude::{c_n_from_euler, cardinal_names};
    use crate::model::ring::Float;
    use crate::model::scheme_file;
    use proptest::prelude::*;

    fn matrix(angles: [f64; 3]) -> [[f64; 3]; 3] {
        c_n_from_euler(&Float, &angles.map(|x: f64| (x.to_radians().cos(), x.to_radians().sin())))
    }

    fn distance(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> f64 {
        (0..9).map(|k| (a[k / 3][k % 3] - b[k / 3][k % 3]).abs()).fold(0.0, f64::max)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// The gimbal angles at every position give its attitude, and the turns lead from one to the next.
        #[test]
        fn gimbal_angles_are_those_of_the_attitudes(
            names in prop::collection::vec(prop::sample::select(cardinal_names()), 2..7),
            path in prop::sample::select(vec!["", "path = 'one-axis'\n", "path = 'gimbals'\n"]),
        ) {
            let positions: String =
                names.iter().map(|n| format!("[[position]]\nattitude = '{n}'\n")).collect();
            let scheme = scheme_file::read(&format!("{path}{positions}")).expect("a scheme");
            let stations = scheme.gimbal_sequence().expect("constant angles");
            let mut at = matrix(stations[0].at_deg);
            for (p, s) in scheme.positions.iter().zip(&stations) {
                for turn in &s.turns {
                    prop_assert!(distance(&turn.from, &at) < 1e-9);
                    at = turn.at(turn.duration_s);
                }
                prop_assert!(distance(&at, &c_n_f64(&p.angles)) < 1e-9, "{s:?}");
                // near beta = +-90 a turn about another axis stops
                if s.obstacle.is_none() {
                    prop_assert!(distance(&matrix(s.at_deg), &at) < 1e-6, "{s:?}");
                }
            }
        }
    }

    /// By hand: half a turn about North ends at alpha = -180, and the next turn starts there.
    #[test]
    fn turns_follow_each_other() {
        let of = |head: &str, positions: &[&str]| {
            let tables: String = positions.iter().map(|p| format!("[[position]]\n{p}\n")).collect();
            scheme_file::read(&format!("{head}{tables}"))
                .expect("a scheme")
                .gimbal_sequence()
                .expect("angles")
        };
        let found = of("", &["attitude = 'NUE'", "attitude = 'NDW'", "attitude = 'NUE'"]);
        assert_eq!(found.iter().map(|s| s.at_deg).collect::<Vec<_>>()[..2], [[0.0; 3], [-180.0, 0.0, 0.0]]);
        assert_eq!(found[2].before_deg, [-180.0, 0.0, 0.0]);
        assert_eq!(found[2].at_deg, [-360.0, 0.0, 0.0]);
        // with a limit the same turn stops, and the sheet says where
        let limited = "gimbals = { alpha_deg = [-90, 90] }\n";
        let found = of(limited, &["attitude = 'NUE'", "attitude = 'NDW'"]);
        assert!(
            matches!(&found[1].obstacle, Some(GimbalObstacle::Stop(s)) if s.at_deg == -90.0),
            "{found:?}"
        );
    }
}

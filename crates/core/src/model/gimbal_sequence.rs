//! Gimbal angles along a scheme as the platform executes it, turn by turn.

use super::attitude::{Matrix3, c_n_f64};
use super::gimbal_turns::{GimbalStop, beside, clean, degrees, from_lock};
use super::path::Path;
use super::position::Position;
use super::rotation::SlewTo;
use super::scheme::Scheme;
use super::slew::Slew;

/// Gimbal angles of one position of a scheme that is executed turn by turn.
#[derive(Debug, Clone, PartialEq)]
pub struct GimbalStation {
    /// Gimbal angles alpha, beta, gamma before the turn to the position, in degrees; those of the position
    /// itself for the first.
    pub before_deg: [f64; 3],
    /// True if `before_deg` are not the angles at the end of the position before: there, at `beta = +-90`,
    /// alpha and gamma turn together while the platform rests.
    pub shifted: bool,
    /// Turns of the platform to the position: one about one axis, or up to three gimbal by gimbal. Durations
    /// are those at one deg/s.
    pub turns: Vec<Slew>,
    /// Largest rates of alpha, beta, gamma during a turn about one axis, over that of the platform
    /// (dimensionless); zeros gimbal by gimbal.
    pub fastest: [f64; 3],
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

/// Largest rounding of followed gimbal angles, in degrees.
const ROUNDED: f64 = 1e-4;
/// Largest rounding of followed gimbal angles at the end of a turn that leads to `beta = +-90`, in degrees.
const ROUNDED_AT_LOCK: f64 = 0.01;

/// Followed gimbal angles without their rounding: those of the attitude at `written`, or of its twin, if they
/// are near.
fn snapped(reached: [f64; 3], [a, b, g]: [f64; 3]) -> [f64; 3] {
    let near = |angles: [f64; 3]| -> Option<[f64; 3]> {
        let placed: [f64; 3] = std::array::from_fn(|k| beside(angles[k], reached[k]));
        (0..3).all(|k| (placed[k] - reached[k]).abs() < ROUNDED).then(|| placed.map(clean))
    };
    near([a, b, g]).or_else(|| near([a + 180.0, 180.0 - b, g + 180.0])).unwrap_or(reached)
}

/// Gimbal angles at the end of a turn about `about` (North, Up, East) that leads to `beta = +-90`, without
/// the rounding of those that were followed: the middle axis `Mx(alpha) e_y` lies along the part of the
/// turn's axis across North, and alpha and gamma together give the attitude at `written`. `None` elsewhere,
/// and for turns about North.
fn snapped_at_lock(reached: [f64; 3], [a, b, g]: [f64; 3], [_, up, east]: [f64; 3]) -> Option<[f64; 3]> {
    if from_lock(b) > 1e-9 || up.hypot(east) < 1e-9 {
        return None;
    }
    let along = (-east).atan2(up).to_degrees();
    // at b = 90 only a - g counts, at b = -90 only a + g
    let sign = b.to_radians().sin().signum();
    [along, along + 180.0].into_iter().find_map(|alpha| {
        let placed = [(alpha, 0), (b, 1), (g + sign * (alpha - a), 2)].map(|(x, k)| beside(x, reached[k]));
        (0..3).all(|k| (placed[k] - reached[k]).abs() < ROUNDED_AT_LOCK).then(|| placed.map(clean))
    })
}

impl Scheme {
    /// Gimbal angles along the scheme. The first position is taken at the angles as written, or at others of
    /// the same attitude within the limits if the gimbals can follow from there only. A turn about one axis
    /// is followed; where it begins at `beta = +-90` and cannot go on, alpha and gamma are turned together
    /// before. Gimbal by gimbal the angles as written are taken. `None` with generic angles.
    pub fn gimbal_sequence(&self) -> Option<Vec<GimbalStation>> {
        if !self.generic_names().is_empty() {
            return None;
        }
        let within = self.gimbal_angles();
        let listed = degrees(within.first()?);
        let written = self.sequence_from(listed, false);
        let possible = |stations: &[GimbalStation]| stations.iter().all(|s| s.obstacle.is_none());
        // gimbal by gimbal the turns are those between the angles as written
        if possible(&written) || self.path == Some(Path::Gimbals) {
            return Some(written);
        }
        let starts = self.starts(listed);
        let mut others = starts.iter().map(|start| self.sequence_from(*start, false));
        if let Some(found) = others.find(|stations| possible(stations)) {
            return Some(found);
        }
        let all = std::iter::once(&listed).chain(&starts).map(|start| self.sequence_from(*start, true));
        // with alpha and gamma turned together at the lock, as far as that helps
        let mut all: Vec<_> = all.collect();
        let best = all.iter().position(|stations| possible(stations)).unwrap_or(0);
        Some(all.swap_remove(best))
    }

    /// Gimbal angles of the attitude at `angles`, in degrees, within the limits: whole turns, the twin, and
    /// at `beta = +-90` alpha in steps of 15 degrees.
    fn starts(&self, [a, b, g]: [f64; 3]) -> Vec<[f64; 3]> {
        let mut own = vec![[a, b, g], [a + 180.0, 180.0 - b, g + 180.0]];
        if from_lock(b) < 1e-9 {
            // at b = 90 only a - g counts, at b = -90 only a + g
            let sign = b.to_radians().sin().signum();
            let split = (1..24).map(|k| 15.0 * f64::from(k)).map(|by| [a + by, b, g + sign * by]);
            own.extend(split);
        }
        let limits = self.gimbals.limits.map(|l| l.map(|l| l.map(|x| x as f64 / 1e9)));
        let placed = |angles: &[f64; 3]| -> Vec<[f64; 3]> {
            let of = |k: usize| -> Vec<f64> {
                let Some([low, high]) = limits[k] else { return vec![beside(angles[k], 0.0)] };
                let first = ((low - angles[k]) / 360.0 - 1e-9).ceil() as i64;
                let last = ((high - angles[k]) / 360.0 + 1e-9).floor() as i64;
                (first..=last).map(|n| angles[k] + 360.0 * n as f64).collect()
            };
            let (a, b, g) = (of(0), of(1), of(2));
            let all = a.iter().flat_map(|a| b.iter().flat_map(|b| g.iter().map(|g| [*a, *b, *g])));
            all.collect()
        };
        own.iter().flat_map(placed).collect()
    }

    /// Gimbal angles along the scheme from those of the first position, in degrees. `shifts`: alpha and gamma
    /// may turn together at `beta = +-90`.
    fn sequence_from(&self, first: [f64; 3], shifts: bool) -> Vec<GimbalStation> {
        let within = self.gimbal_angles();
        let mut out: Vec<GimbalStation> = Vec::with_capacity(self.positions.len());
        for (i, p) in self.positions.iter().enumerate() {
            let listed = if i == 0 { first } else { degrees(&within[i]) };
            let mut station = GimbalStation {
                before_deg: out.last().map_or(listed, |s| s.after_deg),
                shifted: false,
                turns: Vec::new(),
                fastest: [0.0; 3],
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
                    self.turn_gimbals(&mut station, before, p, start);
                } else {
                    self.turn_platform(&mut station, p, &start, &how, shifts);
                }
            }
            station.after_deg = station.at_deg;
            if let Some(r) = &p.rotation {
                let (stop, reached) =
                    self.gimbals.follow(station.at_deg, &Slew::about(&c_n_f64(&p.angles), r, 1.0));
                station.after_deg = reached.map(clean);
                station.obstacle = station.obstacle.take().or(stop.map(GimbalObstacle::Stop));
            }
            out.push(station);
        }
        out
    }

    /// Gimbal angles of the same attitude at `beta = +-90` from which a turn goes on with beta, the nearest
    /// first: the middle axis `Mx(alpha) e_y` lies along the part of the turn's axis across North. Empty
    /// elsewhere.
    fn shifted(&self, [a, b, g]: [f64; 3], slew: &Slew) -> Vec<[f64; 3]> {
        let [_, up, east] = slew.turn().about;
        if from_lock(b) > ROUNDED || up.hypot(east) < 1e-9 {
            return Vec::new();
        }
        // at b = 90 only a - g counts, at b = -90 only a + g
        let sign = b.to_radians().sin().signum();
        let along = (-east).atan2(up).to_degrees();
        let near = beside(along, a) - a;
        let mut by: Vec<f64> = (-4..=4).map(|k| near + 180.0 * f64::from(k)).collect();
        by.sort_by(|x, y| x.abs().total_cmp(&y.abs()));
        let limits = self.gimbals.limits.map(|l| l.map(|l| l.map(|x| x as f64 / 1e9)));
        let inside = |angles: &[f64; 3]| {
            (0..3)
                .all(|k| limits[k].is_none_or(|[low, high]| (low - 1e-9..=high + 1e-9).contains(&angles[k])))
        };
        by.into_iter().map(|by| [a + by, b, g + sign * by].map(clean)).filter(inside).collect()
    }

    /// Adds the turns of the gimbals from one position, at the attitude `start`, to the next.
    fn turn_gimbals(
        &self,
        station: &mut GimbalStation,
        before: &Position,
        p: &Position,
        start: Matrix3<f64>,
    ) {
        let as_written = degrees(&before.angles) == station.before_deg;
        let mut from = start;
        for step in Path::gimbals(before, p).into_iter().flatten() {
            let turn = step.at_f64(&from);
            let slew = Slew::by(&from, &turn.axis.map(|x| x * turn.angle), 1f64.to_radians());
            from = slew.at(slew.duration_s);
            station.turns.push(slew);
        }
        let inside = self.gimbals.hold(&before.angles) && self.gimbals.hold(&p.angles);
        station.at_deg = degrees(&p.angles);
        station.obstacle = match (before.rotation.is_none(), inside, as_written) {
            (false, _, _) => Some(GimbalObstacle::Misses),
            (_, false, _) => Some(GimbalObstacle::Limits),
            (_, _, false) => Some(GimbalObstacle::Elsewhere),
            _ => None,
        };
    }

    /// Adds the turn about one axis from the attitude `start` to a position, as `how` describes it.
    fn turn_platform(
        &self,
        station: &mut GimbalStation,
        p: &Position,
        start: &Matrix3<f64>,
        how: &SlewTo,
        shifts: bool,
    ) {
        let slew = match Slew::to(start, &c_n_f64(&p.angles), how, 1f64.to_radians()) {
            Ok(Some(slew)) => slew,
            Ok(None) => {
                station.at_deg = station.before_deg;
                return;
            }
            Err(_) => {
                station.obstacle = Some(GimbalObstacle::Misses);
                return;
            }
        };
        let mut followed = self.gimbals.followed(station.before_deg, &slew);
        if shifts && followed.0.is_some() {
            let others = self.shifted(station.before_deg, &slew).into_iter();
            let found =
                others.map(|from| (from, self.gimbals.followed(from, &slew))).find(|f| f.1.0.is_none());
            if let Some((from, way)) = found {
                (station.before_deg, station.shifted, followed) = (from, true, way);
            }
        }
        let (stop, reached, fastest) = followed;
        station.fastest = fastest;
        match stop {
            Some(stop) => station.obstacle = Some(GimbalObstacle::Stop(stop)),
            None => {
                let (reached, written) = (reached.map(clean), degrees(&p.angles));
                station.at_deg = snapped_at_lock(reached, written, slew.turn().about)
                    .unwrap_or_else(|| snapped(reached, written));
            }
        }
        station.turns.push(slew);
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

    /// Gimbal angles of a scheme with these lines before its positions.
    fn of(head: &str, positions: &[&str]) -> Vec<GimbalStation> {
        let tables: String = positions.iter().map(|p| format!("[[position]]\n{p}\n")).collect();
        scheme_file::read(&format!("{head}{tables}")).expect("a scheme").gimbal_sequence().expect("angles")
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

    /// From beta = -90 a turn about one axis is possible if alpha and gamma are set so that beta follows;
    /// with limits of alpha a whole turn further may be the way.
    #[test]
    fn another_start_of_the_same_attitude() {
        let found = of("", &["attitude = 'UEN'", "attitude = 'NUE'"]);
        assert!(found.iter().all(|s| s.obstacle.is_none()), "{found:?}");
        let start = of("", &["attitude = 'UEN'"]).remove(0).at_deg;
        assert!(distance(&matrix(found[0].at_deg), &matrix(start)) < 1e-9 && found[0].at_deg != start);
        let limited = "gimbals = { alpha_deg = [-170, 300] }\n";
        let found = of(limited, &["angles_deg = [-150, 0, 0]", "angles_deg = [150, 10, 0]"]);
        assert_eq!((found[0].at_deg, found[1].obstacle.as_ref()), ([210.0, 0.0, 0.0], None));
    }

    /// Turns between cardinal attitudes that lead to beta = +-90 end at multiples of 15 degrees: the axes of
    /// such turns are diagonals of the axes, and what was followed has no rounding left.
    #[test]
    fn turns_to_the_lock_end_at_their_limit() {
        let names = cardinal_names();
        let mut ends = 0;
        for from in &names {
            for to in &names {
                let tables = [from, to].map(|n| format!("attitude = '{n}'"));
                for s in of("", &[&tables[0], &tables[1]]) {
                    if s.obstacle.is_none() && from_lock(s.at_deg[1]) < 1e-6 {
                        let multiple = |x: f64| (x / 15.0 - (x / 15.0).round()).abs() < 1e-9;
                        assert!(s.at_deg.iter().all(|x| multiple(*x)), "{from} {to}: {s:?}");
                        ends += 1;
                    }
                }
            }
        }
        assert!(ends > 100, "{ends}");
    }

    /// Positions at beta = +-90 in the middle of a scheme: alpha and gamma turn together at rest, which
    /// leaves the attitude as it is, and every turn is possible.
    #[test]
    fn alpha_and_gamma_turn_together_at_the_lock() {
        let names = ["NUE", "WND", "EDN", "DES", "USE"];
        let positions: Vec<String> = names.iter().map(|n| format!("attitude = '{n}'")).collect();
        let found = of("", &positions.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(found.iter().all(|s| s.obstacle.is_none()), "{found:?}");
        assert!(found.iter().any(|s| s.shifted));
        for pair in found.windows(2) {
            let (end, start) = (matrix(pair[0].after_deg), matrix(pair[1].before_deg));
            assert!(distance(&end, &start) < 1e-6, "{pair:?}");
            assert!(pair[1].shifted || pair[0].after_deg == pair[1].before_deg);
        }
    }
}

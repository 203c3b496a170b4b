//! Steps of a sheet, with their times and gimbal angles.

use obsdeg_core::model::slew::{Slew, apply, transpose};
use obsdeg_core::model::{Dwell, GIMBAL_NAMES, GimbalObstacle, GimbalStation, Scheme};
use obsdeg_evidence::simulation::{Conditions, Plan};

use super::answer::{Obstacle, ObstacleKind, Step, StepKind, StepTurn};

/// Steps with the obstacles of the gimbals.
pub(super) struct Sheet {
    pub(super) steps: Vec<Step>,
    pub(super) obstacles: Vec<Obstacle>,
    pub(super) total_s: f64,
}

/// Steps of a scheme. Turns take time only where a rate is stated.
pub(super) fn sheet(scheme: &Scheme, conditions: &Conditions, plan: &Plan) -> Sheet {
    let stations = scheme.gimbal_sequence().unwrap_or_default();
    let mut list = StepList { steps: Vec::new(), now: 0.0, position: String::new() };
    for (i, (p, station)) in scheme.positions.iter().zip(&stations).enumerate() {
        list.position = p.name.clone();
        if i == 0 {
            list.push(StepKind::Set, 0.0, station.at_deg, None);
        }
        if station.shifted {
            list.push(StepKind::Gimbals, 0.0, station.before_deg, None);
        }
        let rate = conditions.slew_rate(p);
        let mut at = station.before_deg;
        for (turn, gimbal) in station.turns.iter().zip(gimbals(station)) {
            let from = at;
            match gimbal {
                Some(k) => at[k] = station.at_deg[k],
                None => at = station.at_deg,
            }
            let fastest = match gimbal {
                Some(own) => std::array::from_fn(|k| f64::from(u8::from(k == own))),
                None => station.fastest,
            };
            let turn = step_turn(turn, rate, gimbal, from, fastest);
            let duration_s = rate.map_or(0.0, |rate| turn.angle_deg / rate);
            list.push(StepKind::Turn, duration_s, at, Some(turn));
        }
        let dwell_s = p.dwell.map_or(conditions.dwell_s, Dwell::seconds);
        if let Some(r) = &p.rotation {
            let turn = Slew::about(&plan.attitudes[i], r, dwell_s);
            let rate = turn.turn().angle_deg / dwell_s;
            list.push(
                StepKind::Rotate,
                dwell_s,
                station.after_deg,
                Some(step_turn(&turn, Some(rate), None, station.at_deg, [0.0; 3])),
            );
            continue;
        }
        let settle_s = conditions.settle_s;
        if settle_s > 0.0 {
            list.push(StepKind::Wait, settle_s, station.at_deg, None);
        }
        list.push(StepKind::Record, dwell_s - settle_s, station.at_deg, None);
    }
    let named = scheme.positions.iter().zip(&stations);
    let obstacles = named.filter_map(|(p, s)| Some(obstacle(&p.name, s.obstacle.as_ref()?)));
    Sheet { obstacles: obstacles.collect(), total_s: list.now, steps: list.steps }
}

/// Steps so far, and their time.
struct StepList {
    steps: Vec<Step>,
    now: f64,
    position: String,
}

impl StepList {
    fn push(&mut self, kind: StepKind, duration_s: f64, gimbals_deg: [f64; 3], turn: Option<StepTurn>) {
        self.steps.push(Step {
            number: self.steps.len() + 1,
            kind,
            position: self.position.clone(),
            start_s: self.now,
            duration_s,
            gimbals_deg,
            turn,
            force_g: None,
            tolerance_g: None,
        });
        self.now += duration_s;
    }
}

/// Gimbal of each turn to a position: the one that turns alone, `None` about one axis.
fn gimbals(station: &GimbalStation) -> Vec<Option<usize>> {
    if !station.by_gimbals {
        return vec![None; station.turns.len()];
    }
    (0..3).filter(|&k| station.at_deg[k] != station.before_deg[k]).map(Some).collect()
}

/// Turn of a step from gimbal angles `from_deg`; `fastest` are the rates of the gimbals over that of the
/// platform.
fn step_turn(
    slew: &Slew,
    rate_deg_s: Option<f64>,
    gimbal: Option<usize>,
    from_deg: [f64; 3],
    fastest: [f64; 3],
) -> StepTurn {
    let turn = slew.turn();
    let clean = |x: f64| (x * 1e12).round().clamp(-1e12, 1e12) / 1e12 + 0.0;
    StepTurn {
        about: turn.about,
        about_platform: apply(&transpose(&slew.from), &turn.about).map(clean),
        angle_deg: turn.angle_deg,
        rate_deg_s,
        from_deg,
        gimbal_rates_deg_s: rate_deg_s.map(|rate| fastest.map(|k| (k * rate * 100.0).round() / 100.0)),
        gimbal: gimbal.map(|k| GIMBAL_NAMES[k].into()),
    }
}

fn obstacle(position: &str, found: &GimbalObstacle) -> Obstacle {
    let (kind, stop) = match found {
        GimbalObstacle::Stop(stop) => (ObstacleKind::Stop, Some(stop)),
        GimbalObstacle::Limits => (ObstacleKind::Limits, None),
        GimbalObstacle::Elsewhere => (ObstacleKind::Elsewhere, None),
        GimbalObstacle::Misses => (ObstacleKind::Misses, None),
    };
    Obstacle {
        position: position.into(),
        kind,
        gimbal: stop.and_then(|s| s.gimbal.clone()),
        at_deg: stop.map(|s| s.at_deg),
        after_deg: stop.map(|s| s.after_deg),
    }
}

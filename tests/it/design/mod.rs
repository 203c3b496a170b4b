//! Designed schemes: the fewest positions, the best five of the cardinal attitudes, and the filter's run of
//! the result.

mod brute;
mod certificate;
mod command;
mod correlated;
mod divide;
mod free;
mod gimbals;
mod next;
mod orders;
mod part_edits;
mod parts;
mod prior;
mod search;
mod sigmas;
mod speed;
mod unmet;
mod whole;

use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Carry, Dwell, Scheme, SlewAxis, SlewTo, cardinal};
use obsdeg_design::design::{
    AttitudeRows, Candidates, Design, DesignOptions, Evaluator, Found, Progress, design,
};
use obsdeg_evidence::simulation::Conditions;

fn base(carry: Carry) -> Scheme {
    Scheme { carry, latitude: "28.2".parse().ok(), ..Scheme::default() }
}

/// Indices of all twelve coefficients.
const ALL: [usize; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

fn options(positions: Option<usize>) -> DesignOptions {
    DesignOptions { positions, keep: 5, restarts: 40, ..DesignOptions::default() }
}

fn on(_: Progress) -> bool {
    true
}

fn designed(carry: Carry, options: &DesignOptions) -> Design {
    design(&base(carry), &quiet(), options, &on).expect("designed")
}

fn rows_of(carry: Carry, candidates: &Candidates) -> AttitudeRows {
    AttitudeRows::new(&base(carry), &candidates.attitudes, &ALL, 1).expect("rows")
}

fn evaluator_of(carry: Carry, candidates: &Candidates) -> Evaluator {
    Evaluator::new(&base(carry), &candidates.attitudes, &ALL, &quiet()).expect("an evaluator")
}

/// Sequence of candidate indices of the given names.
fn sequence_of(candidates: &Candidates, names: &[String]) -> Vec<usize> {
    let place = |n: &String| candidates.names.iter().position(|c| c == n).expect("a candidate");
    names.iter().map(place).collect()
}

fn scheme_of(names: &[String], carry: Carry) -> Scheme {
    let attitudes = names.iter().map(|n| cardinal(n).expect("an attitude"));
    Scheme { positions: Scheme::of_angles(attitudes).positions, ..base(carry) }
}

fn quiet() -> Conditions {
    let require = |name: &str, value| Assignment { name: name.into(), value };
    Conditions {
        drift_noise: "0 deg/h".parse().expect("a drift noise"),
        requirements: vec![require("D", 0.1), require("psi", 0.01)],
        ..Conditions::default()
    }
}

/// Largest sigma of a drift, in deg/h.
fn worst(found: &Found) -> f64 {
    found.worst_sigma_dph.expect("a drift is required")
}

/// Scheme of a search result, with the half turns of the result.
fn scheme_found(found: &Found, like: &Scheme) -> Scheme {
    let angles = found.angles.iter().map(|a| obsdeg_core::model::parse_attitude(a).expect("angles"));
    let mut positions = Scheme::of_angles(angles).positions;
    for turn in &found.half_turns {
        let (axis, angle) = (Some(SlewAxis::Direction(turn.about)), "180".parse().ok());
        positions[turn.to - 1].slew = Some(SlewTo { axis, angle, rate_deg_s: None });
    }
    for p in &mut positions {
        p.dwell = Dwell::from_seconds(found.dwell_s);
    }
    Scheme { positions, ..like.clone() }
}

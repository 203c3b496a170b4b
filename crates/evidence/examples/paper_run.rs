//! Run of the paper: two positions of 1000 s, a filter against a simulated truth, and its estimates with
//! their sigmas at the end.
#![allow(clippy::print_stdout, reason = "an example")]

use obsdeg_core::model::{Angle, Scheme};
use obsdeg_evidence::simulation::{Conditions, SimulationError, simulate};

fn main() -> Result<(), SimulationError> {
    let positions = [[0, 0, 0], [180, 0, 0]].map(|p| p.map(Angle::from_degrees));
    let scheme = Scheme::of_angles(positions);
    let (run, _series) = simulate(&scheme, &Conditions::default(), 1)?;
    for q in &run.quantities {
        println!(
            "{:<6} true {:9.4}, off by {:9.5}, sigma {:.5} {}",
            q.name, q.truth, q.error, q.sigma, q.unit
        );
    }
    Ok(())
}

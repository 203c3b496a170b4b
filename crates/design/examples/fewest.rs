//! The fewest positions that make all twelve gyro coefficients observable, and the best three that make the
//! zero-order drifts so.
#![allow(clippy::print_stdout, reason = "an example")]

use obsdeg_core::model::{Carry, Scheme};
use obsdeg_design::design::{DesignError, DesignOptions, design};
use obsdeg_evidence::simulation::Conditions;

fn main() -> Result<(), DesignError> {
    let conditions = Conditions::default();
    for carry in Carry::ALL {
        let base = Scheme { carry, ..Scheme::default() };
        let found = design(&base, &conditions, &DesignOptions::default(), &|_| true)?;
        let fewest = found.minimum.positions.map_or_else(|| "none".to_string(), |k| k.to_string());
        println!("{carry}: {fewest}, proven: {}", found.minimum.proven);
    }
    let options =
        DesignOptions { positions: Some(3), required: vec!["D_F".into()], ..DesignOptions::default() };
    let found = design(&Scheme::default(), &conditions, &options, &|_| true)?;
    for scheme in found.found.iter().take(1) {
        println!("largest sigma {:.5} deg/h with {:?}", scheme.value, scheme.positions);
    }
    Ok(())
}

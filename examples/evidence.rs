//! The library in a few lines: predicted and measured slopes of sigma against the dwell for five positions.
#![allow(clippy::print_stdout, reason = "an example")]

use obsdeg::error::SimulationError;
use obsdeg::{Angle, Conditions, CrossCheckOptions, Scheme, crosscheck};

fn main() -> Result<(), SimulationError> {
    let positions = [[10, 25, 40], [130, -50, 70], [-95, 33, -160], [60, 80, 15], [-20, -70, 110]];
    let scheme = Scheme::of_angles(positions.map(|p| p.map(Angle::from_degrees)));
    let options = CrossCheckOptions { runs: 50, seed: 1, ..CrossCheckOptions::default() };
    let evidence = crosscheck(&scheme, &Conditions::default(), &options, &|_| true)?;
    for q in evidence.quantities.iter().filter(|q| q.degree.is_some()) {
        let measured = q.slope.measured.unwrap_or(f64::NAN);
        println!(
            "{:<6} degree {:?}: predicted {:.1}, measured {measured:.3}",
            q.name, q.degree, q.slope.predicted
        );
    }
    println!("everything agrees: {}", evidence.passed);
    Ok(())
}

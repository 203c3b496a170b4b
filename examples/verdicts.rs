//! The library in ten lines: the degrees of the paper's two positions under each carry.
#![allow(clippy::print_stdout, reason = "an example")]

use obsdeg::error::AnalysisError;
use obsdeg::{AnalysisOptions, Angle, Carry, Scheme, analyze};

fn main() -> Result<(), AnalysisError> {
    let positions = [[0, 0, 0], [180, 0, 0]].map(|p| p.map(Angle::from_degrees));
    for carry in Carry::ALL {
        let scheme = Scheme { carry, ..Scheme::of_angles(positions.clone()) };
        let options = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
        let answer = analyze(&scheme, options, None)?;
        println!("{carry}: rank {} of {}", answer.rank, answer.unknowns.len());
        for q in answer.quantities.iter().filter(|q| q.degree.is_some()) {
            println!("  {} {:?}", q.name, q.degree);
        }
    }
    Ok(())
}

//! One answer in the format of the first argument: table, json, markdown, csv or latex.
#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;

use obsdeg_core::analysis::{AnalysisOptions, analyze};
use obsdeg_core::model::{Angle, Scheme};
use obsdeg_report::{Format, TerminalLayout, written};

fn main() -> Result<(), Box<dyn Error>> {
    let format: Format = std::env::args().nth(1).as_deref().unwrap_or("markdown").parse()?;
    let positions = [[0, 0, 0], [180, 0, 0]].map(|p| p.map(Angle::from_degrees));
    let answer = analyze(&Scheme::of_angles(positions), AnalysisOptions::default(), None)?;
    print!("{}", written(&answer, format, TerminalLayout { width: Some(100), ..TerminalLayout::default() })?);
    Ok(())
}

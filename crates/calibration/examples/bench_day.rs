//! Calibration of a platform from a record: `cargo run -p obsdeg-calibration --example bench_day` in the root
//! of the repository, or with a scheme and a record of your own.
#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::fs::{File, read_to_string};

use obsdeg_calibration::record::Record;
use obsdeg_calibration::{Options, calibrate};
use obsdeg_core::model::scheme_file;
use obsdeg_evidence::simulation::Conditions;

fn main() -> Result<(), Box<dyn Error>> {
    let mut files = std::env::args().skip(1);
    let scheme = files.next().unwrap_or_else(|| "examples/bench-day/scheme.toml".into());
    let record = files.next().unwrap_or_else(|| "examples/bench-day/record.csv".into());
    let scheme = scheme_file::read(&read_to_string(scheme)?)?;
    let conditions = Conditions::of(&scheme);
    let records = vec![Record::file(&record, File::open(&record)?)?];
    let found = calibrate(&scheme, &conditions, records, &Options::default(), &|_| true)?;
    println!("consistent: {}", found.consistent);
    for u in &found.quantities {
        match u.estimate.zip(u.sigma) {
            Some((estimate, sigma)) => println!("{:<6} {estimate:9.4} +- {sigma:.4} {}", u.name, u.unit),
            None => println!("{:<6} not determined", u.name),
        }
    }
    Ok(())
}

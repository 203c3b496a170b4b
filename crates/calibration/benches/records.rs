//! Records of 100,000 rows at two positions: time and memory of reading, and of a calibration.

use std::fmt::Write;
use std::io::Cursor;

use divan::{AllocProfiler, Bencher};
use obsdeg_calibration::platform::read_records;
use obsdeg_calibration::record::Record;
use obsdeg_calibration::{Options, calibrate};
use obsdeg_core::model::{Carry, Scheme, parse_attitude};
use obsdeg_evidence::simulation::Conditions;

#[global_allocator]
static ALLOCATIONS: AllocProfiler = AllocProfiler::system();

fn main() {
    divan::main();
}

const ROWS: usize = 100_000;

/// Record of p1 and p2, 1000 s each without drift, with rows every 0.02 s and noise that repeats after
/// 104,729 rows.
fn record() -> (Scheme, Conditions, String) {
    let attitudes = ["0,0,0", "180,0,0"].map(|a| parse_attitude(a).expect("an attitude"));
    let scheme = Scheme { carry: Carry::Inertial, ..Scheme::of_angles(attitudes) };
    let mut text = String::from("t [s],position,fx [g],fy [g],fz [g]\n");
    let noise = |k: usize| 1e-5 * ((k * 7919 % 104_729) as f64 / 52_364.5 - 1.0);
    for k in 0..ROWS {
        let (p, up) = if k < ROWS / 2 { ("p1", 1.0) } else { ("p2", -1.0) };
        let (t, f) = (0.02 * (k + 1) as f64, [noise(k), up + noise(k + 31), noise(k + 77)]);
        writeln!(text, "{t:.2},{p},{:.8},{:.8},{:.8}", f[0], f[1], f[2]).expect("written");
    }
    (scheme, Conditions::default(), text)
}

fn records(text: &str) -> Vec<Record> {
    vec![Record::csv("run.csv", Box::new(Cursor::new(text.to_owned()))).expect("a record")]
}

/// Reads the rows into bins, without an estimate.
#[divan::bench(sample_count = 20)]
fn read(bencher: Bencher<'_, '_>) {
    let (scheme, conditions, text) = record();
    let options = Options::default();
    bencher
        .with_inputs(|| records(&text))
        .bench_values(|r| read_records(&scheme, &conditions, r, &options, &|_| true).expect("a reading"));
}

/// Complete calibration: multiple shooting, estimates, curvature, findings.
#[divan::bench(sample_count = 5)]
fn calibrated(bencher: Bencher<'_, '_>) {
    let (scheme, conditions, text) = record();
    let options = Options::default();
    bencher
        .with_inputs(|| records(&text))
        .bench_values(|r| calibrate(&scheme, &conditions, r, &options, &|_| true).expect("a calibration"));
}

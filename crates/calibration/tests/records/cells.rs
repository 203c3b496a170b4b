//! Invalid cells: each is named by row and column, and the estimate is that of the other cells.

use obsdeg_calibration::answer::{CalibrationFinding, CellKind};
use obsdeg_calibration::{Calibration, CalibrationError};

use crate::round_trip::{errors, of_csv, six, with_recording};
use crate::simulator::{Bench, Sample, csv};

fn bench() -> Bench {
    Bench { seed: 31, slew_deg_s: Some(2.0), ..six() }
}

fn is_near(bench: &Bench, c: &Calibration, what: &str) {
    for (name, sigmas) in errors(bench, c) {
        assert!(sigmas.abs() < 3.5, "{what}: {name} by {sigmas} sigma, {:?}", c.findings);
    }
}

/// First row of a position, one in its middle and its last.
fn places(samples: &[Sample]) -> [usize; 3] {
    let of = |label: &str| samples.iter().position(|s| s.label == label).expect("there");
    [of("p2"), of("p3") + 40, of("p5") - 30]
}

#[test]
fn a_gross_cell_is_named_and_left_out() {
    gross_cells(&[(10.0, 0..1, 4), (0.5, 1..2, 1)]);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn gross_cells_at_length() {
    gross_cells(&[10.0, 2.0, 0.5].map(|step_s| (step_s, 0..3, 4)));
}

/// Records of a step with a gross cell in one of these columns, of so many kinds.
fn gross_cells(cases: &[(f64, std::ops::Range<usize>, usize)]) {
    for (step_s, columns, kinds) in cases {
        let step_s = *step_s;
        let bench = Bench { step_s, ..bench() };
        let samples = bench.record();
        let middle = samples.iter().position(|s| s.label == "p4").expect("there") + 50;
        for axis in columns.clone() {
            let column = ["fx [g]", "fy [g]", "fz [g]"][axis];
            let all = [(middle, 0.1), (middle, f64::NAN), (middle, -9999.0), (places(&samples)[0], 0.1)];
            for &(k, what) in &all[..*kinds] {
                let mut own = samples.clone();
                own[k].f[axis] = match what {
                    0.1 => own[k].f[axis] + 0.1,
                    what if what.is_nan() => 0.0,
                    what => what,
                };
                let c = of_csv(&bench, "F,I,O,S", csv(&own)).expect("calibrated");
                is_near(&bench, &c, &format!("{step_s} s, {column}, {what}"));
                let line = k as u64 + 2;
                let outlier =
                    c.outliers.iter().any(|o| o.lines == (line, line).into() && o.channel == column);
                let code = c.findings.iter().any(|f| {
                    matches!(f, CalibrationFinding::Cells { column: found, lines, .. }
                        if *lines == (line, line).into() && found == column)
                });
                assert!(outlier || code, "{step_s} s, {column}, {what}: {:?} {:?}", c.outliers, c.findings);
                // some samples are far from the line of a dense bin by chance
                assert!(step_s < 1.0 || c.outliers.len() < 4, "{:?}", c.outliers);
            }
        }
    }
}

/// Empty cells in bins of two rows, at drifts of 25 to 36 deg/h: the row that remains does not count as the
/// middle of the bin.
#[test]
fn empty_cells_leave_the_others_right() {
    let drift = [[36.0, -30.0, 25.0], [12.0, -14.0, 9.0], [-8.0, 11.0, 13.0], [10.0, 7.0, -12.0]];
    let bench = Bench { step_s: 5.0, drift, ..bench() };
    let text = csv(&bench.record());
    let row = |(k, line): (usize, &str)| {
        let mut cells: Vec<&str> = line.split(',').collect();
        if k % 37 == 5 {
            cells[2 + k / 37 % 3] = "";
        }
        cells.join(",")
    };
    let lines: Vec<String> = text.lines().enumerate().map(row).collect();
    let c = of_csv(&bench, "F,I,O,S", lines.join("\n")).expect("calibrated");
    is_near(&bench, &c, "empty cells");
    assert!(c.consistent && c.outliers.is_empty(), "{:?} {:?}", c.findings, c.outliers);
}

/// Codes of missing values are reported. If the file states them, they are empty cells, which are counted
/// like NaN.
#[test]
fn codes_are_asked_about() {
    let bench = bench();
    let samples = bench.record();
    let from = samples.iter().position(|s| s.label == "p3").expect("there") + 20;
    for code in [-9999.0, 0.0] {
        let mut own = samples.clone();
        (from..from + 12).for_each(|k| own[k].f[1] = code);
        let c = of_csv(&bench, "F,I,O,S", csv(&own)).expect("calibrated");
        is_near(&bench, &c, "a code");
        let [
            CalibrationFinding::Cells {
                column, kind_of_cells: CellKind::Code, value, count: 12, lines, ..
            },
        ] = &c.findings[..]
        else {
            panic!("{:?}", c.findings)
        };
        assert_eq!(
            (column.as_str(), *value, *lines),
            ("fy [g]", code, (from as u64 + 2, from as u64 + 13).into())
        );
        let recording = obsdeg_core::model::Recording { missing: vec![code], ..Default::default() };
        let stated = with_recording(&bench, recording, csv(&own)).expect("calibrated");
        assert!(stated.consistent, "{:?}", stated.findings);
        is_near(&bench, &stated, "stated");
        let [empty] = &stated.records[0].empty_cells[..] else { panic!("{:?}", stated.records) };
        assert_eq!((empty.column.as_str(), empty.count), ("fy [g]", 12));
        // the same with empty cells
        let blank = csv(&own).replace(&format!(",{code},"), ",,");
        let blank = of_csv(&bench, "F,I,O,S", blank).expect("calibrated");
        assert_eq!(
            (&blank.quantities, &blank.records[0].empty_cells),
            (&stated.quantities, &stated.records[0].empty_cells)
        );
    }
    let mut own = samples.clone();
    (from..from + 9).for_each(|k| own[k].f = own[from].f);
    let c: Result<_, CalibrationError> = of_csv(&bench, "F,I,O,S", csv(&own));
    let c = c.expect("calibrated");
    is_near(&bench, &c, "stuck");
    let stuck = |f: &&CalibrationFinding| {
        matches!(f, CalibrationFinding::Cells { kind_of_cells: CellKind::Stuck, .. })
    };
    assert_eq!(c.findings.iter().filter(stuck).count(), 3, "{:?}", c.findings);
}

/// One cell at each of three positions with the same value is a code, though no position has it twice.
#[test]
fn a_code_here_and_there_is_asked_about() {
    let bench = bench();
    let mut own = bench.record();
    for k in places(&own) {
        own[k].f[1] = -9999.0;
    }
    let c = of_csv(&bench, "F,I,O,S", csv(&own)).expect("calibrated");
    let code = |f: &CalibrationFinding| {
        matches!(f, CalibrationFinding::Cells { kind_of_cells: CellKind::Code, count: 3, .. })
    };
    assert!(c.findings.iter().any(code) && c.outliers.is_empty(), "{:?} {:?}", c.findings, c.outliers);
    is_near(&bench, &c, "codes");
}

/// Codes that another unit would explain, here and there in the record, are codes; rows in another unit are
/// refused as such.
#[test]
fn codes_are_no_other_unit() {
    let bench = Bench { step_s: 4.0, dropped: 0, ..bench() };
    for code in [-1.0, 1.0] {
        let mut own = bench.record();
        own.iter_mut().skip(3).step_by(50).for_each(|s| s.f = [code; 3]);
        let c = of_csv(&bench, "F,I,O,S", csv(&own)).expect("calibrated");
        let is_code = |f: &&CalibrationFinding| {
            matches!(f, CalibrationFinding::Cells { kind_of_cells: CellKind::Code, .. })
        };
        assert_eq!(c.findings.iter().filter(is_code).count(), 3, "{code}: {:?}", c.findings);
        is_near(&bench, &c, "codes");
    }
    let mut own = bench.record();
    own.iter_mut().skip(3).step_by(50).for_each(|s| s.f = s.f.map(|f| f * 9.80665));
    let e = of_csv(&bench, "F,I,O,S", csv(&own)).expect_err("refused").to_string();
    assert!(e.contains("with these numbers as [m/s^2] it is as in the rows beside it"), "{e}");
}

/// An output that gets stuck while the platform drifts far is stuck, and no code: it holds the value of a
/// row.
#[test]
fn a_stuck_output_is_no_code() {
    let drift = [[12.0, -9.0, 14.0], [5.0, 3.0, -4.0], [-2.0, 6.0, 1.0], [4.0, -5.0, 3.0]];
    let bench = Bench { drift, dropped: 0, ..bench() };
    let mut own = bench.record();
    let from = own.iter().position(|s| s.label == "p3").expect("there") + 20;
    for axis in 0..3 {
        let value = own[from].f[axis];
        own[from..from + 15].iter_mut().for_each(|s| s.f[axis] = value);
    }
    let c = of_csv(&bench, "F,I,O,S", csv(&own)).expect("calibrated");
    let stuck = |f: &CalibrationFinding| {
        matches!(f, CalibrationFinding::Cells { kind_of_cells: CellKind::Stuck, count: 14, .. })
    };
    assert!(c.findings.len() == 3 && c.findings.iter().all(stuck), "{:?}", c.findings);
    is_near(&bench, &c, "stuck");
}

/// Codes in every seventh or fourth row of a column, with two rows in a bin: all are named, and nothing else.
#[test]
fn frequent_codes_are_asked_about() {
    let bench = Bench { step_s: 5.0, dropped: 0, ..bench() };
    for (every, code) in [(7, -9999.0), (7, 0.0), (4, -9999.0)] {
        let mut own = bench.record();
        let rows: Vec<usize> = (0..own.len()).filter(|k| k % every == every - 1).collect();
        rows.iter().for_each(|&k| own[k].f[0] = code);
        let at_rest = rows.iter().filter(|&&k| !own[k].label.is_empty()).count();
        let c = of_csv(&bench, "F,I,O,S", csv(&own)).expect("calibrated");
        let [CalibrationFinding::Cells { column, kind_of_cells: CellKind::Code, value, count, .. }] =
            &c.findings[..]
        else {
            panic!("{every} {code}: {:?}", c.findings)
        };
        assert_eq!((column.as_str(), *value, *count), ("fx [g]", code, at_rest));
        is_near(&bench, &c, "frequent codes");
    }
}

/// An output that is missing or stuck through a whole position is named, whatever that does to the length of
/// the force; coarse steps of a converter are right.
#[test]
fn an_output_that_is_held_through_a_position_is_named() {
    let bench = bench();
    for (axis, column) in ["fx", "fy", "fz"].iter().enumerate() {
        for value in [0.0, 0.123] {
            let mut own = bench.record();
            own.iter_mut().filter(|s| s.label == "p3").for_each(|s| s.f[axis] = value);
            let e = of_csv(&bench, "F,I,O,S", csv(&own)).expect_err("refused").to_string();
            let begins = format!("run.csv: column `{column} [g]` is {value} in all ");
            assert!(e.starts_with(&begins) && e.contains(" rows of p3 from line "), "{e}");
        }
    }
    let steps = bench.record().into_iter().map(|s| Sample { f: s.f.map(|f| (f * 1e3).round() / 1e3), ..s });
    let read = of_csv(&bench, "F,I,O,S", csv(&steps.collect::<Vec<_>>()));
    assert!(!matches!(&read, Err(CalibrationError::Mistaken(e)) if e.to_string().contains("was stuck")));
}

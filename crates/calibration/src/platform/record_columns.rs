//! Columns of a platform's record: those that are requested, with their units, and their numbers in n.

use std::ops::Range;

use obsdeg_core::model::slew::apply;
use obsdeg_core::model::{AZIMUTH, Float, Matrix3, elementary, product};
use obsdeg_evidence::simulation::Plan;

use super::CalibrationError;
use super::force::ForceColumn;
use crate::answer::{ColumnRead, EmptyCells};
use crate::record::{Record, RecordColumn, RecordError, TIME_INDEX, Wanted};

/// Units of forces, with their values in g (`None`: a metre per second squared, which depends on gravity).
const FORCES: [(&str, Option<f64>); 4] =
    [("g", Some(1.0)), ("mg", Some(1e-3)), ("ug", Some(1e-6)), ("m/s^2", None)];
/// Units of increments of velocity over the time since the sample before, with their values in m/s. The
/// quotient is the mean force in this interval.
const INCREMENTS: [(&str, f64); 4] = [("m/s", 1.0), ("cm/s", 1e-2), ("mm/s", 1e-3), ("um/s", 1e-6)];
const ANGLES: [(&str, f64); 4] = [
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("deg", std::f64::consts::PI / 180.0),
    ("arcsec", std::f64::consts::PI / 648000.0),
];
/// Units of a temperature, whose zero does not matter.
const TEMPERATURES: [(&str, f64); 3] = [("degC", 1.0), ("C", 1.0), ("K", 1.0)];
/// Units of time.
pub(crate) const TIMES: [(&str, f64); 6] =
    [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("min", 60.0), ("h", 3600.0)];
/// Indices of the three observed columns among the requested numbers, which follow the time.
pub(super) const OBSERVED: Range<usize> = TIME_INDEX + 1..TIME_INDEX + 4;
/// Index of the azimuth among the requested numbers, where it is one.
const AZIMUTH_INDEX: usize = OBSERVED.end;

/// Meaning of the three observed columns of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ObservedColumns {
    /// Outputs of the accelerometers in platform axes.
    Force,
    /// Z in platform axes.
    Platform,
    /// Z in n.
    Geographic,
}

/// Layout of the requested numbers of a row: time, three of Z or of the force, the azimuth, standard
/// deviations of the three, gimbal angles, temperature.
pub(super) struct RecordColumns {
    pub observed: ObservedColumns,
    /// Columns of the force; `None` if Z is observed.
    pub forces: Option<[ForceColumn; 3]>,
    /// Column of the time: its text, and the value of one of its numbers in s.
    pub time: ColumnRead,
    pub wanted: Vec<Wanted>,
    pub azimuth: bool,
    pub sigmas: bool,
    /// True if forces are increments of velocity, which are read in g s.
    pub increments: bool,
    /// Index of the first of the three gimbal angles among the requested numbers.
    pub gimbals: Option<usize>,
    pub temperature: Option<usize>,
    pub label: Option<usize>,
    pub ignored: Vec<String>,
    /// Texts of the three observed columns.
    pub columns: [String; 3],
}

/// Units of the force in g, or of increments of velocity in g s.
pub(super) fn units_of_force(increments: bool, gravity: f64) -> [(&'static str, f64); 4] {
    match increments {
        true => INCREMENTS.map(|(u, size)| (u, size / gravity)),
        false => FORCES.map(|(u, g)| (u, g.unwrap_or(1.0 / gravity))),
    }
}

/// Observed columns of a record, with their names.
fn observed_columns(record: &Record) -> Result<(ObservedColumns, [&'static str; 3]), RecordError> {
    let families = [
        (ObservedColumns::Force, ["fx", "fy", "fz"]),
        (ObservedColumns::Platform, ["Zx", "Zy", "Zz"]),
        (ObservedColumns::Geographic, ["Z1", "Z2", "Z3"]),
    ];
    let there = |names: &[&str; 3]| names.iter().any(|n| record.find(n).is_some());
    let mut of = families.iter().filter(|(_, names)| there(names));
    let expected = "`fx [g]`, `fy [g]`, `fz [g]` (outputs of the accelerometers in platform axes), or \
        `Zx`, `Zy`, `Zz`, or `Z1`, `Z3`";
    let &(observed, names) = of.next().ok_or_else(|| record.missing(expected))?;
    if let Some((_, others)) = of.next() {
        let also = format!("either {}, {}, {} or {}", names[0], names[1], names[2], others.join(", "));
        return Err(record.missing(&also));
    }
    Ok((observed, names))
}

/// True if a unit is one of increments of velocity.
fn is_increment(unit: &str) -> bool {
    INCREMENTS.iter().any(|(u, _)| *u == unit)
}

/// Requested numbers of three columns `names`, each in one of `units`; `instead` where the record has none
/// and none is `needed`, as Z2 of a scheme without unknown accelerometers.
fn three_wanted(
    record: &Record,
    names: &[String; 3],
    units: &[(&str, f64)],
    needed: &dyn Fn(usize) -> bool,
    instead: Wanted,
) -> Result<[Wanted; 3], RecordError> {
    let mut out = [instead; 3];
    for (i, name) in names.iter().enumerate() {
        match record.find(name) {
            Some(column) => out[i] = record.wanted(column, units)?,
            None if needed(i) => return Err(record.missing(&format!("`{name} [g]`"))),
            None => {}
        }
    }
    Ok(out)
}

/// Requested numbers of the three gimbal angles; empty where the record has none.
fn gimbals_wanted(record: &Record) -> Result<Vec<Wanted>, RecordError> {
    let angles = ["alpha", "beta", "gamma"];
    if angles.iter().all(|a| record.find(a).is_none()) {
        return Ok(Vec::new());
    }
    let of = |name: &str| {
        let column = record.find(name).ok_or_else(|| record.missing(&format!("`{name} [deg]`")))?;
        record.wanted(column, &ANGLES)
    };
    angles.into_iter().map(of).collect()
}

impl RecordColumns {
    /// Columns of a record of the scheme of `plan`, for an acceleration of 1 g of `gravity` m/s^2.
    ///
    /// # Errors
    /// [`CalibrationError::Record`].
    pub(super) fn of(record: &Record, plan: &Plan, gravity: f64) -> Result<Self, CalibrationError> {
        let time = record.find("t").ok_or_else(|| record.missing("`t [s]`"))?;
        let of_time = record.wanted(time, &TIMES)?;
        let mut wanted = vec![of_time];
        let (observed, names) = observed_columns(record)?;
        let unit = |name: &&str| record.columns()[record.find(name)?].unit.as_deref();
        let increments =
            observed == ObservedColumns::Force && names.iter().filter_map(unit).any(is_increment);
        let units = units_of_force(increments, gravity);
        let needed = |i: usize| observed != ObservedColumns::Geographic || plan.components.contains(&(i + 1));
        let own = three_wanted(record, &names.map(String::from), &units, &needed, of_time)?;
        wanted.extend(own);
        let text = |w: &Wanted| record.columns()[w.column].text.clone();
        let forces = (observed == ObservedColumns::Force)
            .then(|| own.map(|w| ForceColumn { text: text(&w), scale: w.scale }));
        let azimuth = plan.components.contains(&AZIMUTH);
        if azimuth {
            let column =
                record.find("Za").ok_or_else(|| record.missing("`Za [deg]` (the measured azimuth)"))?;
            wanted.push(record.wanted(column, &ANGLES)?);
        }
        let of_sigma = names.map(|n| format!("sigma_{n}"));
        let sigmas = of_sigma.iter().any(|n| record.find(n).is_some());
        if sigmas {
            wanted.extend(three_wanted(record, &of_sigma, &units, &needed, of_time)?);
        }
        let gimbals = gimbals_wanted(record)?;
        let first_gimbal = (!gimbals.is_empty()).then_some(wanted.len());
        wanted.extend(gimbals);
        let mut temperature = None;
        if let Some(column) = record.find("T") {
            temperature = Some(wanted.len());
            wanted.push(record.wanted(column, &TEMPERATURES)?);
        }
        let label = record.find("position");
        let used = |i: usize| label == Some(i) || wanted.iter().any(|w| w.column == i);
        let ignored = record.columns().iter().enumerate().filter(|(i, _)| !used(*i));
        let ignored = ignored.map(|(_, c): (usize, &RecordColumn)| c.text.clone()).collect();
        Ok(Self {
            observed,
            forces,
            time: ColumnRead { column: text(&of_time), factor: of_time.scale },
            wanted,
            azimuth,
            sigmas,
            increments,
            gimbals: first_gimbal,
            temperature,
            label,
            ignored,
            columns: own.map(|w| text(&w)),
        })
    }

    /// True if the record has the observed column `i` of three; otherwise its number is that of the time.
    pub(super) fn own(&self, i: usize) -> bool {
        self.wanted[OBSERVED][i].column != self.wanted[TIME_INDEX].column
    }

    /// Columns that are used, in their order, with the value of one of their numbers.
    pub(super) fn used(&self, record: &Record) -> Vec<ColumnRead> {
        let text = |w: &Wanted| record.columns()[w.column].text.clone();
        let mut all: Vec<&Wanted> = self.wanted.iter().collect();
        all.sort_by_key(|w| w.column);
        all.dedup_by_key(|w| w.column);
        all.into_iter().map(|w| ColumnRead { column: text(w), factor: w.scale }).collect()
    }

    /// Columns with empty cells, and their number.
    pub(super) fn missing(&self, columns: &[String], empty: &[usize]) -> Vec<EmptyCells> {
        let mut out: Vec<(usize, usize)> =
            self.wanted.iter().zip(empty).map(|(w, n)| (w.column, *n)).filter(|(_, n)| *n > 0).collect();
        out.sort_unstable();
        out.dedup();
        out.into_iter().map(|(c, count)| EmptyCells { column: columns[c].clone(), count }).collect()
    }

    /// Indices of the standard deviations among the requested numbers, if the record has some.
    fn of_sigmas(&self) -> Option<Range<usize>> {
        let first = if self.azimuth { AZIMUTH_INDEX + 1 } else { AZIMUTH_INDEX };
        self.sigmas.then_some(first..first + 3)
    }

    /// Divides the increments of a row by the interval `dt` (s) into mean forces; an unknown interval leaves
    /// none.
    pub(super) fn divide(&self, numbers: &mut [Option<f64>], dt: Option<f64>) {
        for i in OBSERVED.chain(self.of_sigmas().unwrap_or(0..0)) {
            numbers[i] = numbers[i].and_then(|dv| Some(dv / dt?));
        }
    }

    /// Components 1, 2, 3 of Z in n, and the azimuth, of a row at the attitude `c`.
    pub(super) fn in_n(&self, n: &[Option<f64>], c: &Matrix3<f64>) -> [Option<f64>; 4] {
        let azimuth = if self.azimuth { n[AZIMUTH_INDEX] } else { None };
        let turned = match n[OBSERVED] {
            [Some(x), Some(y), Some(z)] => Some(apply(c, &[x, y, z])),
            _ => None,
        };
        match self.observed {
            ObservedColumns::Geographic => {
                let own = &n[OBSERVED];
                [own[0], own[1], own[2], azimuth]
            }
            ObservedColumns::Platform => {
                [turned.map(|z| z[0]), turned.map(|z| z[1]), turned.map(|z| z[2]), azimuth]
            }
            // Z^c = f^c + g^c
            ObservedColumns::Force => {
                [turned.map(|z| z[0]), turned.map(|z| z[1] - 1.0), turned.map(|z| z[2]), azimuth]
            }
        }
    }

    /// Angle of the turn between the gimbal readings and the attitude `c`, in deg.
    pub(super) fn gimbals_off(&self, n: &[Option<f64>], c: &Matrix3<f64>) -> Option<f64> {
        let first = self.gimbals?;
        let [alpha, beta, gamma] = [n[first]?, n[first + 1]?, n[first + 2]?];
        let turn = |axis: usize, angle: f64| elementary(&Float, axis, &(angle.cos(), angle.sin()));
        let read = product(&Float, &product(&Float, &turn(0, alpha), &turn(1, beta)), &turn(2, gamma));
        let trace: f64 = (0..3).map(|i| (0..3).map(|j| read[i][j] * c[i][j]).sum::<f64>()).sum();
        Some(((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees())
    }

    /// Standard deviations of the components in n; `None` if the record has none. Those of platform axes are
    /// turned without their correlation.
    pub(super) fn sigmas_in_n(&self, n: &[Option<f64>], c: &Matrix3<f64>) -> Option<[Option<f64>; 3]> {
        let of = self.of_sigmas()?;
        let own: [Option<f64>; 3] = std::array::from_fn(|i| n[of.start + i]);
        if self.observed == ObservedColumns::Geographic {
            return Some(own);
        }
        let squares: Option<Vec<f64>> = own.iter().map(|s| s.map(|s| s * s)).collect();
        Some(std::array::from_fn(|i| {
            let squares = squares.as_ref()?;
            Some((0..3).map(|j| c[i][j] * c[i][j] * squares[j]).sum::<f64>().sqrt())
        }))
    }
}

//! Static record: time, and columns of gyros and accelerometers, in stretches of evenly spaced samples.

use obsdeg_core::span::Span;

use super::answer::SensorKind;
use super::{NoiseError, NoiseOptions};
use crate::CalibrationProgress;
use crate::platform::TIMES;
use crate::record::{MOST, Record, Wanted};

/// Units of rates, with their values in deg/h.
const RATES: [(&str, f64); 5] = [
    ("deg/h", 1.0),
    ("deg/s", 3600.0),
    ("mdeg/s", 3.6),
    ("rad/s", 3600.0 * 180.0 / std::f64::consts::PI),
    ("mrad/s", 3.6 * 180.0 / std::f64::consts::PI),
];
/// Units of specific force, with their values in ug; `None`: by gravity.
const FORCES: [(&str, Option<f64>); 4] =
    [("ug", Some(1.0)), ("mg", Some(1e3)), ("g", Some(1e6)), ("m/s^2", None)];
/// Most numbers that are kept in memory.
const MOST_NUMBERS: usize = 50_000_000;
/// Largest relative difference of a usual interval from the median.
const USUAL: f64 = 0.5;
/// Distance of a bad cell from the mean of its neighbours, in standard deviations of this distance.
const FAR: f64 = 8.0;
/// Number of rows from one report of progress to the next.
const OFTEN: usize = 10_000;

/// Index, kind and scale of a column of a sensor, with its title.
type SensorColumn<'a> = (&'a (usize, SensorKind, f64), String);

/// Column of a sensor.
pub(super) struct Channel {
    pub text: String,
    pub sensor: SensorKind,
    /// Unit of the samples (deg/h, ug) per unit of the column.
    pub scale: f64,
    pub stretches: Vec<Vec<f64>>,
    pub empty: usize,
    /// Lines of cells that were left out.
    pub left_out: Vec<u64>,
}

/// Static record in stretches.
pub(super) struct StaticRecord {
    pub name: String,
    pub samples: usize,
    pub span_s: Span<f64>,
    pub interval_s: f64,
    pub gaps: usize,
    pub jitter: f64,
    pub ignored: Vec<String>,
    pub channels: Vec<Channel>,
}

/// Kind and scale of a unit.
fn sensor(unit: &str, gravity: f64) -> Option<(SensorKind, f64)> {
    let rate = RATES.iter().find(|(u, _)| *u == unit).map(|(_, s)| (SensorKind::Gyro, *s));
    let force = FORCES.iter().find(|(u, _)| *u == unit);
    rate.or(force.map(|(_, s)| (SensorKind::Accelerometer, s.unwrap_or(1e6 / gravity))))
}

/// Columns of sensors: index, kind, scale.
fn sensors(record: &Record, options: &NoiseOptions) -> Result<Vec<(usize, SensorKind, f64)>, NoiseError> {
    let of = |(i, c): (usize, &crate::record::RecordColumn)| {
        let (kind, scale) = sensor(c.unit.as_deref()?, options.gravity_m_s2)?;
        Some((i, kind, scale * c.count))
    };
    let all: Vec<(usize, SensorKind, f64)> = record.columns().iter().enumerate().filter_map(of).collect();
    let texts = |of: &mut dyn Iterator<Item = usize>| {
        of.take(40).map(|i| format!("`{}`", record.columns()[i].text)).collect::<Vec<_>>().join(", ")
    };
    if all.is_empty() {
        let found = texts(&mut (0..record.columns().len()));
        return Err(NoiseError::Sensors { record: record.name().into(), found });
    }
    if options.columns.is_empty() {
        return Ok(all);
    }
    let named = |name: &String| {
        let column = &record.columns();
        let own = all.iter().find(|(i, ..)| column[*i].name == *name || column[*i].text == *name);
        own.copied().ok_or_else(|| NoiseError::Column {
            record: record.name().into(),
            name: name.clone(),
            expected: texts(&mut all.iter().map(|(i, ..)| *i)),
        })
    };
    options.columns.iter().map(named).collect()
}

impl StaticRecord {
    /// Reads a static record.
    pub(super) fn read(
        record: Record,
        options: &NoiseOptions,
        progress: &dyn Fn(CalibrationProgress<'_>) -> bool,
    ) -> Result<Self, NoiseError> {
        let time = record.find("t").ok_or_else(|| record.missing("`t [s]`"))?;
        let mut wanted = vec![record.wanted(time, &TIMES)?];
        let columns = sensors(&record, options)?;
        wanted.extend(columns.iter().map(|&(column, _, scale)| Wanted { column, scale }));
        if wanted.len() > MOST {
            return Err(NoiseError::Long { record: record.name().into(), most: MOST - 1 });
        }
        if record.rows_stated().is_some_and(|rows| rows.saturating_mul(wanted.len()) > MOST_NUMBERS) {
            return Err(NoiseError::Long { record: record.name().into(), most: MOST_NUMBERS });
        }
        let name = record.name().to_string();
        let used = |i: &usize| *i != time && columns.iter().all(|(c, ..)| c != i);
        let ignored = (0..record.columns().len()).filter(used);
        let ignored = ignored.map(|i| record.columns()[i].text.clone()).collect();
        let texts: Vec<String> = columns.iter().map(|(i, ..)| record.columns()[*i].text.clone()).collect();
        let (mut times, mut lines) = (Vec::new(), Vec::new());
        let mut values = vec![Vec::new(); columns.len()];
        record.read(&wanted, None, false, |row| -> Result<(), NoiseError> {
            times.extend(row.time());
            lines.push(row.line);
            for (values, number) in values.iter_mut().zip(row.values()) {
                values.push(number.unwrap_or(f64::NAN));
            }
            if times.len() * wanted.len() > MOST_NUMBERS {
                return Err(NoiseError::Long { record: name.clone(), most: MOST_NUMBERS });
            }
            let heard = !times.len().is_multiple_of(OFTEN)
                || progress(CalibrationProgress::Reads { record: &name, samples: times.len() });
            if heard { Ok(()) } else { Err(NoiseError::Interrupted) }
        })?;
        let interval_s = usual(&times);
        let is_usual = |w: &[f64]| ((w[1] - w[0]) / interval_s - 1.0).abs() < USUAL;
        let begins: Vec<usize> =
            times.windows(2).enumerate().filter(|(_, w)| !is_usual(w)).map(|(i, _)| i + 1).collect();
        let intervals = times.windows(2).filter(|w| is_usual(w));
        let jitter = intervals.map(|w| ((w[1] - w[0]) / interval_s - 1.0).abs()).fold(0.0, f64::max);
        let channel = |(((_, sensor, scale), text), values): (SensorColumn<'_>, Vec<f64>)| {
            let empty = values.iter().filter(|x| x.is_nan()).count();
            let (sensor, scale) = (*sensor, *scale);
            let (stretches, left_out) = stretches(values, &begins, &lines);
            Channel { text, sensor, scale, stretches, empty, left_out }
        };
        Ok(Self {
            name: name.clone(),
            samples: times.len(),
            span_s: Span { from: times[0], to: times[times.len() - 1] },
            interval_s,
            gaps: begins.len(),
            jitter,
            ignored,
            channels: columns.iter().zip(texts).zip(values).map(channel).collect(),
        })
    }
}

/// Median interval between times, in s.
fn usual(times: &[f64]) -> f64 {
    let mut all: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    median(&mut all).unwrap_or(1.0)
}

fn median(all: &mut [f64]) -> Option<f64> {
    let middle = all.len() / 2;
    (!all.is_empty()).then(|| *all.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Values in stretches, and the lines of bad cells. A stretch begins at the rows `begins`, and behind cells
/// that are empty or far from both neighbours.
fn stretches(mut values: Vec<f64>, begins: &[usize], lines: &[u64]) -> (Vec<Vec<f64>>, Vec<u64>) {
    let off = |w: &[f64]| w[1] - (w[0] + w[2]) / 2.0;
    let mut sizes: Vec<f64> = values.windows(3).map(off).filter(|x| x.is_finite()).map(f64::abs).collect();
    let scale = median(&mut sizes).unwrap_or(0.0) / 0.674_489_750_196_081_7;
    let far = |w: &[f64]| {
        let beside = |x: f64| (w[1] - x).abs() > FAR * scale;
        scale > 0.0 && off(w).abs() > FAR * scale && beside(w[0]) && beside(w[2])
    };
    let found: Vec<usize> =
        values.windows(3).enumerate().filter(|(_, w)| far(w)).map(|(i, _)| i + 1).collect();
    found.iter().for_each(|&i| values[i] = f64::NAN);
    let mut out = vec![Vec::new()];
    let mut begins = begins.iter().peekable();
    for (i, x) in values.into_iter().enumerate() {
        if begins.next_if(|b| **b == i).is_some() || x.is_nan() {
            out.push(Vec::new());
        }
        if let Some(last) = out.last_mut().filter(|_| !x.is_nan()) {
            last.push(x);
        }
    }
    out.retain(|s| !s.is_empty());
    (out, found.iter().map(|&i| lines[i]).collect())
}

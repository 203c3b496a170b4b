//! Data of a model: the rows of a record, by experiment.

use std::ops::Range;

use obsdeg_core::model::Still;
use obsdeg_core::system::{KnownInput, ModelError, StartTime, StateStart, SystemModel};

use super::answer::{StatesStart, SystemCalibrationError};
use super::units;
use crate::Going;
use crate::record::{MOST, Record, RecordError, Row, Wanted};
use crate::still::Detector;

/// Interval of progress reports, in samples.
const OFTEN: usize = 10_000;

/// Row of the record.
#[derive(Debug, Clone)]
pub(super) struct Data {
    pub(super) line: u64,
    pub(super) experiment: usize,
    /// Number of the run; rows of another run begin at the start again.
    pub(super) run: usize,
    /// Index of the segment, which begins with its first row.
    pub(super) segment: usize,
    pub(super) t: f64,
    /// Values of the inputs, with their standard deviations.
    pub(super) inputs: Vec<(f64, f64)>,
    /// Measurements by output; `None` where the cell is empty.
    pub(super) outputs: Vec<Option<f64>>,
    /// Standard deviations by output; `None` where the record states none.
    pub(super) sigmas: Vec<Option<f64>>,
}

/// Data of a model.
pub(super) struct Read {
    pub(super) rows: Vec<Data>,
    /// Known inputs with values in every row.
    pub(super) inputs: Vec<usize>,
    /// Name of the record; `digest` is that of its numbers.
    pub(super) name: String,
    pub(super) digest: String,
    pub(super) ignored: Vec<String>,
    pub(super) samples: usize,
    /// Time of the record at which the states of each experiment start; `t` of a row is the time from it.
    pub(super) origins: Vec<f64>,
    /// Rule of `origins`.
    pub(super) states_start: StatesStart,
    /// Number of intervals at rest; `None` unless they are sought.
    pub(super) intervals: Option<usize>,
}

/// Source of the value of a known input.
#[derive(Debug, Clone, Copy)]
enum From {
    /// Index of the requested number, and that of its standard deviation.
    Column(usize, Option<usize>),
    /// Mean of another input in the interval before.
    Before(usize),
}

/// Meaning of the requested numbers of a row.
struct Columns {
    wanted: Vec<Wanted>,
    /// Known inputs with values in every row, and their sources.
    inputs: Vec<(usize, From)>,
    /// Outputs: the indices of the number and of its standard deviation, or a known value.
    outputs: Vec<Result<(usize, Option<usize>), f64>>,
    label: Option<usize>,
    /// Index of the requested number of the segment.
    segment: Option<usize>,
    ignored: Vec<String>,
}

impl Columns {
    fn of(record: &Record, model: &SystemModel) -> Result<Self, SystemCalibrationError> {
        let time = record.find("t").ok_or_else(|| record.missing("`t` (the time of the model)"))?;
        let mut wanted = vec![units::time(record, time, model)?];
        let mut want = |column: usize, unit: &str| -> Result<usize, RecordError> {
            wanted.push(units::wanted(record, column, unit)?);
            Ok(wanted.len() - 1)
        };
        let mut inputs = Vec::new();
        let before = |name: &str| {
            let of = name.strip_suffix("_before").filter(|_| model.recording.still.is_some())?;
            model.known_inputs.iter().position(|i| i.0.name == of).filter(|_| record.find(of).is_some())
        };
        for (k, (named, kind)) in model.known_inputs.iter().enumerate() {
            match (record.find(&named.name), kind) {
                (None, KnownInput::Function(_)) => {}
                (None, _) if model.simulation.inputs.contains_key(&named.name) => {}
                (None, _) if before(&named.name).is_some() => {
                    inputs.extend(before(&named.name).map(|of| (k, From::Before(of))));
                }
                (None, _) => return Err(record.missing(&format!("`{}` (a known input)", named.name)).into()),
                (Some(_), KnownInput::Function(_)) => {
                    let what = format!("the known input {}", named.name);
                    let message =
                        "a function of time in the model and a column of the record; expected one of them";
                    return Err(ModelError { what, message: message.into(), span: None }.into());
                }
                (Some(column), _) => {
                    let sigma = record.find(&format!("sigma_{}", named.name));
                    let own = want(column, &named.unit)?;
                    let sigma = sigma.map(|column| want(column, &named.unit)).transpose()?;
                    inputs.push((k, From::Column(own, sigma)));
                }
            }
        }
        let mut outputs = Vec::new();
        for (named, _) in &model.outputs {
            let column = record.find(&named.name);
            if let (None, Some(value)) = (column, model.recording.value(&named.name)) {
                outputs.push(Err(value));
                continue;
            }
            let column = column.ok_or_else(|| record.missing(&format!("`{}` (an output)", named.name)))?;
            let own = want(column, &named.unit)?;
            let sigma = record.find(&format!("sigma_{}", named.name));
            outputs.push(Ok((own, sigma.map(|column| want(column, &named.unit)).transpose()?)));
        }
        let label = record.find("experiment");
        if label.is_none() && model.experiments > 1 {
            return Err(record.missing("`experiment` (1, 2, ...)").into());
        }
        if label.is_some() && model.recording.still.is_some() {
            let what = "intervals at rest that are sought and a column `experiment`";
            return Err(SystemCalibrationError::NotYet { what });
        }
        let named = record.find("segment").filter(|column| wanted.iter().all(|w| w.column != *column));
        if model.segments.len() > 1 {
            if named.is_none() {
                return Err(record.missing("`segment` (1, 2, ...: it begins with its first row)").into());
            }
            if model.recording.still.is_some() {
                let what = "intervals at rest that are sought in several segments";
                return Err(SystemCalibrationError::NotYet { what });
            }
        }
        wanted.extend(named.map(|column| Wanted { column, scale: 1.0 }));
        let segment = named.map(|_| wanted.len() - 1);
        let used = |i: usize| label == Some(i) || wanted.iter().any(|w| w.column == i);
        let columns = record.columns().iter().enumerate();
        let ignored = columns.filter(|(i, _)| !used(*i)).map(|(_, c)| c.text.clone()).collect();
        if wanted.len() > MOST {
            return Err(SystemCalibrationError::TooMany { found: wanted.len() });
        }
        Ok(Self { wanted, inputs, outputs, label, segment, ignored })
    }
}

pub(super) fn read(
    record: Record,
    model: &SystemModel,
    uses_time: bool,
    going: &dyn Fn(Going<'_>) -> bool,
) -> Result<Read, SystemCalibrationError> {
    let record = record.named(&model.recording)?;
    let columns = Columns::of(&record, model)?;
    let still = model.recording.still.as_ref();
    let (name, experiments) = (record.name().to_string(), model.experiments.max(1));
    let texts: Vec<String> = columns.wanted.iter().map(|w| record.columns()[w.column].text.clone()).collect();
    let mut rows: Vec<Data> = Vec::new();
    let segments = model.segments.len().max(1);
    let least = match model.time {
        StartTime::Zero => 0.0,
        StartTime::Generic => f64::NEG_INFINITY,
        at @ StartTime::At { .. } => at.number(),
    };
    // segment and time of the last row of every experiment
    let mut reached = vec![(0, f64::NEG_INFINITY); experiments];
    let take = |row: Row<'_>| -> Result<(), SystemCalibrationError> {
        let samples = rows.len() + 1;
        if samples.is_multiple_of(OFTEN) && !going(Going::Reads { record: &name, samples }) {
            return Err(SystemCalibrationError::Interrupted);
        }
        let refuse = |column: &str, found: String, expected: &str| SystemCalibrationError::Value {
            record: name.clone(),
            line: row.line,
            column: column.into(),
            found,
            expected: expected.into(),
        };
        let experiment = match columns.label {
            None => 0,
            Some(_) => {
                let number = row.label.parse::<usize>().ok().filter(|e| (1..=experiments).contains(e));
                let expected = format!("a number from 1 to {experiments}");
                number.ok_or_else(|| refuse("experiment", format!("`{}`", row.label), &expected))? - 1
            }
        };
        let t = row.numbers[0].unwrap_or(f64::NAN);
        // an experiment may continue behind rows of another
        let (last, time) = reached[experiment];
        let mut segment = last;
        if let Some(i) = columns.segment {
            let first = time == f64::NEG_INFINITY;
            let most = if first { 1 } else { (last + 2).min(segments) };
            let found = row.numbers[i].filter(|n| (last + 1..=most).any(|k| *n == k as f64));
            let expected = match most == last + 1 {
                true if first && segments > 1 => "1: every segment has a row at least".into(),
                true => format!("{most}: the model has no more segments"),
                false => format!("{} or {most} (every segment has a row at least)", last + 1),
            };
            let text = row.numbers[i].map_or_else(|| "nothing".into(), |n| n.to_string());
            segment = found.ok_or_else(|| refuse("segment", text, &expected))? as usize - 1;
        }
        if t <= time {
            let expected = format!("a time after {time}, which experiment {} has reached", experiment + 1);
            return Err(refuse(&texts[0], t.to_string(), &expected));
        }
        reached[experiment] = (segment, t);
        if t < least && still.is_none() {
            let expected = format!("a time from {least}, where the run of the model begins, on");
            return Err(refuse(&texts[0], t.to_string(), &expected));
        }
        let value = |i: usize| row.numbers[i];
        let sigma = |i: Option<usize>| -> Result<Option<f64>, SystemCalibrationError> {
            match i.and_then(|i| Some((i, value(i)?))) {
                Some((i, s)) if s <= 0.0 => {
                    Err(refuse(&texts[i], s.to_string(), "a standard deviation above zero"))
                }
                found => Ok(found.map(|(_, s)| s)),
            }
        };
        let mut of_inputs = Vec::new();
        for &(_, from) in &columns.inputs {
            let From::Column(i, s) = from else {
                of_inputs.push((f64::NAN, 0.0));
                continue;
            };
            let x =
                value(i).ok_or_else(|| refuse(&texts[i], "nothing".into(), "the value of a known input"))?;
            of_inputs.push((x, sigma(s)?.unwrap_or(0.0)));
        }
        let outputs = columns.outputs.iter().map(|o| o.map_or_else(Some, |(i, _)| value(i))).collect();
        let sigmas = columns.outputs.iter().map(|o| o.map_or(Ok(None), |(_, s)| sigma(s)));
        let sigmas = sigmas.collect::<Result<_, _>>()?;
        rows.push(Data {
            line: row.line,
            experiment,
            run: experiment,
            segment,
            t,
            inputs: of_inputs,
            outputs,
            sigmas,
        });
        Ok(())
    };
    let digest = record.read(&columns.wanted, columns.label, true, take)?;
    let (samples, mut intervals) = (rows.len(), None);
    let begins = if least.is_finite() { least } else { 0.0 };
    let (mut rule, mut origins) = (StatesStart::Model, vec![begins; experiments]);
    if let Some(still) = still {
        let place =
            |name: &String| columns.inputs.iter().position(|(k, _)| model.known_inputs[*k].0.name == *name);
        let by: Vec<usize> = still.by.iter().filter_map(place).collect();
        let found = at_rest(&rows, &by, still);
        if found.len() < 2 {
            return Err(SystemCalibrationError::NoRest { record: name.clone(), found: found.len() });
        }
        intervals = Some(found.len());
        rows = if model.states.is_empty() {
            found.iter().map(|r| mean(&rows[r.clone()], &columns.inputs, None)).collect()
        } else {
            ways(&rows, &found, &columns.inputs)
        };
    } else {
        // rows of each experiment together
        rows.sort_by_key(|r| r.experiment);
        let given = |k: usize| columns.inputs.iter().any(|(of, _)| *of == k);
        let of_time = |k: usize| model.simulation.inputs.contains_key(&model.known_inputs[k].0.name);
        let uses_time = uses_time || (0..model.known_inputs.len()).any(|k| !given(k) && of_time(k));
        rule = states_start(&rows, model, uses_time);
        origins = from_origins(&mut rows, rule, begins, experiments);
    }
    let inputs = columns.inputs.iter().map(|(k, _)| *k).collect();
    Ok(Read {
        rows,
        inputs,
        name,
        digest,
        ignored: columns.ignored,
        samples,
        origins,
        states_start: rule,
        intervals,
    })
}

/// Rule of the start of the states for `rows`, sorted by experiment. A stated `time` holds. Without it,
/// states whose values at the start are all unknown may start with the first rows: their values are free at
/// any time.
fn states_start(rows: &[Data], model: &SystemModel, uses_time: bool) -> StatesStart {
    match model.time {
        StartTime::Generic => return StatesStart::Rows,
        StartTime::At { .. } => return StatesStart::Model,
        StartTime::Zero => {}
    }
    let mut all = rows.chunk_by(|a, b| a.experiment == b.experiment);
    let beyond = |of: &[Data], least: f64| {
        let (first, last) = (of[0].t, of[of.len() - 1].t);
        last > first && first > least * (last - first)
    };
    let free = model.states.iter().all(|s| s.start == StateStart::Unknown) && model.constraints.is_empty();
    let far = match (free, uses_time) {
        (true, _) => all.any(|of| beyond(of, 1.0)),
        (false, true) => false,
        (false, false) => !rows.is_empty() && all.all(|of| beyond(of, 100.0)),
    };
    if far { StatesStart::FarRows } else { StatesStart::Model }
}

/// Longest time from the start of the states to the first row of an experiment, where it is longer than the
/// experiment.
pub(super) fn before_first_row(rows: &[Data]) -> Option<f64> {
    let all = rows.chunk_by(|a, b| a.run == b.run);
    let waits = all.filter(|of| of.len() > 1 && 2.0 * of[0].t > of[of.len() - 1].t).map(|of| of[0].t);
    waits.max_by(f64::total_cmp)
}

/// Changes times of rows to those from the start of the states of their experiment: the time `begins` of the
/// model, or the first row. Returns the starts by experiment.
fn from_origins(rows: &mut [Data], rule: StatesStart, begins: f64, experiments: usize) -> Vec<f64> {
    let mut origins = vec![begins; experiments];
    for of in rows.chunk_by_mut(|a, b| a.experiment == b.experiment) {
        let origin = &mut origins[of[0].experiment];
        if rule != StatesStart::Model {
            *origin = of[0].t;
        }
        of.iter_mut().for_each(|row| row.t -= *origin);
    }
    origins
}

/// Intervals at rest by the inputs `by`, as ranges of rows.
fn at_rest(rows: &[Data], by: &[usize], still: &Still) -> Vec<Range<usize>> {
    let (mut detector, mut decided) = (Detector::new(still), Vec::new());
    for (i, row) in rows.iter().enumerate() {
        detector.push(row.t, by.iter().map(|&k| row.inputs[k].0).collect(), i, &mut decided);
    }
    detector.end(&mut decided);
    let mut out: Vec<Range<usize>> = Vec::with_capacity(detector.found());
    for one in decided {
        match one.interval {
            Some(k) if k + 1 == out.len() => out[k].end = one.sample + 1,
            Some(_) => out.push(one.sample..one.sample + 1),
            None => {}
        }
    }
    out
}

/// Mean of some rows, with the standard deviations of the means of independent samples. Inputs of the
/// interval before come from `before`.
fn mean(rows: &[Data], inputs: &[(usize, From)], before: Option<&Data>) -> Data {
    let of = |values: &mut dyn Iterator<Item = f64>| {
        let values: Vec<f64> = values.collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let scatter = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        (!values.is_empty()).then(|| (mean, (scatter / n).sqrt()))
    };
    let input = |(i, (_, from)): (usize, &(usize, From))| match (from, before) {
        (From::Before(k), Some(before)) => {
            let at = inputs.iter().position(|(of, _)| of == k).unwrap_or(i);
            before.inputs[at]
        }
        _ => of(&mut rows.iter().map(|r| r.inputs[i].0)).unwrap_or((f64::NAN, 0.0)),
    };
    let output = |j: usize| of(&mut rows.iter().filter_map(|r| r.outputs[j]));
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    let outputs: Vec<_> = (0..first.outputs.len()).map(output).collect();
    Data {
        line: first.line,
        experiment: 0,
        run: 0,
        segment: 0,
        t: (first.t + last.t) / 2.0,
        inputs: inputs.iter().enumerate().map(input).collect(),
        outputs: outputs.iter().map(|o| o.map(|(mean, _)| mean)).collect(),
        // a value equal in every row is exact
        sigmas: outputs.iter().map(|o| o.map(|(_, sigma)| sigma).filter(|s| *s > 0.0)).collect(),
    }
}

/// Motions from each interval to the next, one run each: the samples between them, then the means of the next
/// interval with the measured outputs.
fn ways(rows: &[Data], intervals: &[Range<usize>], inputs: &[(usize, From)]) -> Vec<Data> {
    let mut out = Vec::new();
    for (run, pair) in intervals.windows(2).enumerate() {
        let (from, to) = (pair[0].end - 1, pair[1].start);
        let before = mean(&rows[pair[0].clone()], inputs, None);
        let begin = rows[from].t;
        for row in &rows[from..to] {
            let own = mean(std::slice::from_ref(row), inputs, Some(&before));
            let outputs = vec![None; own.outputs.len()];
            out.push(Data { run, t: row.t - begin, outputs, ..own });
        }
        out.push(Data { run, t: rows[to].t - begin, ..mean(&rows[pair[1].clone()], inputs, Some(&before)) });
    }
    out
}

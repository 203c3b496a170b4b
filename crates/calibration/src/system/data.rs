//! Data of a model: the rows of a record, by experiment.

use std::ops::Range;

use obsdeg_core::model::Still;
use obsdeg_core::system::{KnownInput, ModelError, StartTime, StateStart, SystemModel};

use super::answer::{StatesStart, SystemCalibrationError};
use super::units;
use crate::CalibrationProgress;
use crate::record::{MOST, Record, RecordError, RecordRow, Wanted};
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
pub(super) struct ModelData {
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
enum InputSource {
    /// Index of the requested number, and that of its standard deviation.
    Column(usize, Option<usize>),
    /// Mean of another input in the interval before.
    Before(usize),
}

/// Source of an output: the indices of the number and of its standard deviation, or a known value.
type OutputSource = Result<(usize, Option<usize>), f64>;

/// Meaning of the requested numbers of a row.
struct ModelColumns {
    wanted: Vec<Wanted>,
    /// Known inputs with values in every row, and their sources.
    inputs: Vec<(usize, InputSource)>,
    /// Sources of the outputs.
    outputs: Vec<OutputSource>,
    label: Option<usize>,
    /// Index of the requested number of the segment.
    segment: Option<usize>,
    ignored: Vec<String>,
}

impl ModelColumns {
    fn of(record: &Record, model: &SystemModel) -> Result<Self, SystemCalibrationError> {
        let time = record.find("t").ok_or_else(|| record.missing("`t` (the time of the model)"))?;
        let mut wanted = vec![units::time(record, time, model)?];
        let inputs = input_sources(record, model, &mut wanted)?;
        let outputs = output_sources(record, model, &mut wanted)?;
        let label = experiment_column(record, model)?;
        let named = segment_column(record, model, &wanted)?;
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

/// Index of a further requested number: that of `column`, in `unit`.
fn want(record: &Record, wanted: &mut Vec<Wanted>, column: usize, unit: &str) -> Result<usize, RecordError> {
    wanted.push(units::wanted(record, column, unit)?);
    Ok(wanted.len() - 1)
}

/// Known inputs with values in every row, and their sources; their numbers are added to `wanted`.
fn input_sources(
    record: &Record,
    model: &SystemModel,
    wanted: &mut Vec<Wanted>,
) -> Result<Vec<(usize, InputSource)>, SystemCalibrationError> {
    let mut out = Vec::new();
    let before = |name: &str| {
        let of = name.strip_suffix("_before").filter(|_| model.recording.still.is_some())?;
        model.known_inputs.iter().position(|i| i.0.name == of).filter(|_| record.find(of).is_some())
    };
    for (k, (named, kind)) in model.known_inputs.iter().enumerate() {
        match (record.find(&named.name), kind) {
            (None, KnownInput::Function(_)) => {}
            (None, _) if model.simulation.inputs.contains_key(&named.name) => {}
            (None, _) if before(&named.name).is_some() => {
                out.extend(before(&named.name).map(|of| (k, InputSource::Before(of))));
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
                let own = want(record, wanted, column, &named.unit)?;
                let sigma = sigma.map(|column| want(record, wanted, column, &named.unit)).transpose()?;
                out.push((k, InputSource::Column(own, sigma)));
            }
        }
    }
    Ok(out)
}

/// Sources of the outputs, in their order; their numbers are added to `wanted`.
fn output_sources(
    record: &Record,
    model: &SystemModel,
    wanted: &mut Vec<Wanted>,
) -> Result<Vec<OutputSource>, RecordError> {
    let mut out = Vec::new();
    for (named, _) in &model.outputs {
        let column = record.find(&named.name);
        if let (None, Some(value)) = (column, model.recording.value(&named.name)) {
            out.push(Err(value));
            continue;
        }
        let column = column.ok_or_else(|| record.missing(&format!("`{}` (an output)", named.name)))?;
        let own = want(record, wanted, column, &named.unit)?;
        let sigma = record.find(&format!("sigma_{}", named.name));
        out.push(Ok((own, sigma.map(|column| want(record, wanted, column, &named.unit)).transpose()?)));
    }
    Ok(out)
}

/// Column of the experiments; `None` for a single one.
fn experiment_column(record: &Record, model: &SystemModel) -> Result<Option<usize>, SystemCalibrationError> {
    let label = record.find("experiment");
    if label.is_none() && model.experiments > 1 {
        return Err(record.missing("`experiment` (1, 2, ...)").into());
    }
    if label.is_some() && model.recording.still.is_some() {
        let what = "intervals at rest that are sought and a column `experiment`";
        return Err(SystemCalibrationError::NotYet { what });
    }
    Ok(label)
}

/// Column of the segments, unless it is one of the `wanted`; `None` for a single one.
fn segment_column(
    record: &Record,
    model: &SystemModel,
    wanted: &[Wanted],
) -> Result<Option<usize>, SystemCalibrationError> {
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
    Ok(named)
}

/// Reader of the rows of a record, one after the other.
struct RowReader<'a> {
    /// Name of the record, and the texts of the requested columns.
    record: &'a str,
    texts: Vec<String>,
    columns: &'a ModelColumns,
    /// Numbers of experiments and of segments.
    experiments: usize,
    segments: usize,
    /// Earliest time of a row; -infinity if any time is allowed.
    least: f64,
    /// Segment and time of the last row of every experiment.
    reached: Vec<(usize, f64)>,
    rows: Vec<Data>,
}

impl RowReader<'_> {
    /// Error of the value `found` in a column.
    fn refuse(&self, line: u64, column: &str, found: String, expected: &str) -> SystemCalibrationError {
        SystemCalibrationError::Value {
            record: self.record.into(),
            line,
            column: column.into(),
            found,
            expected: expected.into(),
        }
    }

    /// Adds a row.
    fn take(&mut self, row: &RecordRow<'_>) -> Result<(), SystemCalibrationError> {
        let experiment = self.experiment(row)?;
        let t = row.time().unwrap_or(f64::NAN);
        let (_, time) = self.reached[experiment];
        let segment = self.segment(row, experiment)?;
        if t <= time {
            let expected = format!("a time after {time}, which experiment {} has reached", experiment + 1);
            return Err(self.refuse(row.line, &self.texts[0], t.to_string(), &expected));
        }
        self.reached[experiment] = (segment, t);
        if t < self.least {
            let expected = format!("a time from {}, where the run of the model begins, on", self.least);
            return Err(self.refuse(row.line, &self.texts[0], t.to_string(), &expected));
        }
        let inputs = self.inputs(row)?;
        let outputs = self.columns.outputs.iter();
        let outputs = outputs.map(|o| o.map_or_else(Some, |(i, _)| row.numbers[i])).collect();
        let sigmas = self.columns.outputs.iter().map(|o| o.map_or(Ok(None), |(_, s)| self.sigma(row, s)));
        let sigmas = sigmas.collect::<Result<_, _>>()?;
        let (line, run) = (row.line, experiment);
        self.rows.push(Data { line, experiment, run, segment, t, inputs, outputs, sigmas });
        Ok(())
    }

    /// Index of the experiment of a row.
    fn experiment(&self, row: &RecordRow<'_>) -> Result<usize, SystemCalibrationError> {
        if self.columns.label.is_none() {
            return Ok(0);
        }
        let experiments = self.experiments;
        let number = row.label.parse::<usize>().ok().filter(|e| (1..=experiments).contains(e));
        let expected = format!("a number from 1 to {experiments}");
        let refuse = || self.refuse(row.line, "experiment", format!("`{}`", row.label), &expected);
        Ok(number.ok_or_else(refuse)? - 1)
    }

    /// Index of the segment of a row. An experiment may continue behind rows of another.
    fn segment(&self, row: &RecordRow<'_>, experiment: usize) -> Result<usize, SystemCalibrationError> {
        let (last, time) = self.reached[experiment];
        let Some(i) = self.columns.segment else { return Ok(last) };
        let first = time == f64::NEG_INFINITY;
        let most = if first { 1 } else { (last + 2).min(self.segments) };
        let found = row.numbers[i].filter(|n| (last + 1..=most).any(|k| *n == k as f64));
        let expected = match most == last + 1 {
            true if first && self.segments > 1 => "1: every segment has a row at least".into(),
            true => format!("{most}: the model has no more segments"),
            false => format!("{} or {most} (every segment has a row at least)", last + 1),
        };
        let text = row.numbers[i].map_or_else(|| "nothing".into(), |n| n.to_string());
        Ok(found.ok_or_else(|| self.refuse(row.line, "segment", text, &expected))? as usize - 1)
    }

    /// Standard deviation in a requested number of a row; `None` where there is none.
    fn sigma(&self, row: &RecordRow<'_>, i: Option<usize>) -> Result<Option<f64>, SystemCalibrationError> {
        match i.and_then(|i| Some((i, row.numbers[i]?))) {
            Some((i, s)) if s <= 0.0 => {
                Err(self.refuse(row.line, &self.texts[i], s.to_string(), "a standard deviation above zero"))
            }
            found => Ok(found.map(|(_, s)| s)),
        }
    }

    /// Values of the inputs in a row, with their standard deviations.
    fn inputs(&self, row: &RecordRow<'_>) -> Result<Vec<(f64, f64)>, SystemCalibrationError> {
        let mut out = Vec::new();
        for &(_, from) in &self.columns.inputs {
            let InputSource::Column(i, s) = from else {
                out.push((f64::NAN, 0.0));
                continue;
            };
            let nothing =
                || self.refuse(row.line, &self.texts[i], "nothing".into(), "the value of a known input");
            let x = row.numbers[i].ok_or_else(nothing)?;
            out.push((x, self.sigma(row, s)?.unwrap_or(0.0)));
        }
        Ok(out)
    }
}

/// Earliest time of a row; -infinity if the model begins at any time.
fn earliest(model: &SystemModel) -> f64 {
    match model.time {
        StartTime::Zero => 0.0,
        StartTime::Generic => f64::NEG_INFINITY,
        at @ StartTime::At { .. } => at.number(),
    }
}

/// Reads the rows of a record for a model.
///
/// # Errors
/// [`SystemCalibrationError`].
pub(super) fn read(
    record: Record,
    model: &SystemModel,
    uses_time: bool,
    progress: &dyn Fn(CalibrationProgress<'_>) -> bool,
) -> Result<ModelData, SystemCalibrationError> {
    let record = record.named(&model.recording)?;
    let columns = ModelColumns::of(&record, model)?;
    let still = model.recording.still.as_ref();
    let (name, experiments) = (record.name().to_string(), model.experiments.max(1));
    let least = earliest(model);
    let mut reader = RowReader {
        record: &name,
        texts: columns.wanted.iter().map(|w| record.columns()[w.column].text.clone()).collect(),
        columns: &columns,
        experiments,
        segments: model.segments.len().max(1),
        least: if still.is_none() { least } else { f64::NEG_INFINITY },
        reached: vec![(0, f64::NEG_INFINITY); experiments],
        rows: Vec::new(),
    };
    let digest = record.read(&columns.wanted, columns.label, true, |row| {
        let samples = reader.rows.len() + 1;
        if samples.is_multiple_of(OFTEN) && !progress(CalibrationProgress::Reads { record: &name, samples }) {
            return Err(SystemCalibrationError::Interrupted);
        }
        reader.take(&row)
    })?;
    let mut rows = reader.rows;
    let (samples, mut intervals) = (rows.len(), None);
    let begins = if least.is_finite() { least } else { 0.0 };
    let (mut rule, mut origins) = (StatesStart::Model, vec![begins; experiments]);
    if let Some(still) = still {
        let (found, of_rest) = rows_at_rest(&rows, &columns.inputs, model, still);
        if found < 2 {
            return Err(SystemCalibrationError::NoRest { record: name.clone(), found });
        }
        intervals = Some(found);
        rows = of_rest;
    } else {
        // rows of each experiment together
        rows.sort_by_key(|r| r.experiment);
        let given = |k: usize| columns.inputs.iter().any(|(of, _)| *of == k);
        let of_time = |k: usize| model.simulation.inputs.contains_key(&model.known_inputs[k].0.name);
        let uses_time = uses_time || (0..model.known_inputs.len()).any(|k| !given(k) && of_time(k));
        rule = states_start(&rows, model, uses_time);
        origins = from_origins(&mut rows, rule, begins, experiments);
    }
    Ok(ModelData {
        rows,
        inputs: columns.inputs.iter().map(|(k, _)| *k).collect(),
        name,
        digest,
        ignored: columns.ignored,
        samples,
        origins,
        states_start: rule,
        intervals,
    })
}

/// Number of intervals at rest, and the rows that a model with them has: means of the intervals, or motions
/// from one to the next if it has states. With fewer than two intervals there are none.
fn rows_at_rest(
    rows: &[Data],
    inputs: &[(usize, InputSource)],
    model: &SystemModel,
    still: &Still,
) -> (usize, Vec<Data>) {
    let place = |name: &String| inputs.iter().position(|(k, _)| model.known_inputs[*k].0.name == *name);
    let by: Vec<usize> = still.by.iter().filter_map(place).collect();
    let found = at_rest(rows, &by, still);
    let of_rest = match found.len() {
        0 | 1 => Vec::new(),
        _ if model.states.is_empty() => found.iter().map(|r| mean(&rows[r.clone()], inputs, None)).collect(),
        _ => ways(rows, &found, inputs),
    };
    (found.len(), of_rest)
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
fn mean(rows: &[Data], inputs: &[(usize, InputSource)], before: Option<&Data>) -> Data {
    let of = |values: &mut dyn Iterator<Item = f64>| {
        let values: Vec<f64> = values.collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let scatter = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        (!values.is_empty()).then(|| (mean, (scatter / n).sqrt()))
    };
    let input = |(i, (_, from)): (usize, &(usize, InputSource))| match (from, before) {
        (InputSource::Before(k), Some(before)) => {
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
fn ways(rows: &[Data], intervals: &[Range<usize>], inputs: &[(usize, InputSource)]) -> Vec<Data> {
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

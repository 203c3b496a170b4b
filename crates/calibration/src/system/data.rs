//! The data of a model: the rows of a record, by experiment.

use obsdeg_core::system::{KnownInput, ModelError, SystemModel};

use super::answer::SystemCalibrationError;
use crate::record::{MOST, Record, Row, Wanted};

/// A row of the record.
#[derive(Debug, Clone)]
pub(super) struct Data {
    pub(super) line: u64,
    pub(super) experiment: usize,
    pub(super) t: f64,
    /// Values of inputs, and their standard deviations.
    pub(super) inputs: Vec<(f64, f64)>,
    /// By output.
    pub(super) outputs: Vec<Option<f64>>,
    /// By output, where the record says so.
    pub(super) sigmas: Vec<Option<f64>>,
}

/// The data of a model.
pub(super) struct Read {
    pub(super) rows: Vec<Data>,
    /// Known inputs that are columns.
    pub(super) inputs: Vec<usize>,
    pub(super) ignored: Vec<String>,
}

/// Which wanted numbers of a row are what.
struct Columns {
    wanted: Vec<Wanted>,
    inputs: Vec<(usize, Option<usize>)>,
    outputs: Vec<(usize, Option<usize>)>,
    label: Option<usize>,
    ignored: Vec<String>,
}

impl Columns {
    fn of(record: &Record, model: &SystemModel) -> Result<Self, SystemCalibrationError> {
        let time = record.find("t").ok_or_else(|| record.missing("`t` (the time of the model)"))?;
        // units of a model are its own
        let mut wanted = vec![Wanted { column: time, scale: 1.0 }];
        let mut want = |column: usize| {
            wanted.push(Wanted { column, scale: 1.0 });
            wanted.len() - 1
        };
        let mut inputs = Vec::new();
        let mut given = Vec::new();
        for (k, (named, kind)) in model.known_inputs.iter().enumerate() {
            match (record.find(&named.name), kind) {
                (None, KnownInput::Function(_)) => {}
                (None, _) if model.simulation.inputs.contains_key(&named.name) => {}
                (None, _) => return Err(record.missing(&format!("`{}` (a known input)", named.name)).into()),
                (Some(_), KnownInput::Function(_)) => {
                    let what = format!("the known input {}", named.name);
                    let message =
                        "a function of time in the model and a column of the record; expected one of them";
                    return Err(ModelError { what, message: message.into(), span: None }.into());
                }
                (Some(column), _) => {
                    given.push(k);
                    inputs.push((want(column), record.find(&format!("sigma_{}", named.name)).map(&mut want)));
                }
            }
        }
        let mut outputs = Vec::new();
        for (named, _) in &model.outputs {
            let column = record.find(&named.name);
            let column = column.ok_or_else(|| record.missing(&format!("`{}` (an output)", named.name)))?;
            outputs.push((want(column), record.find(&format!("sigma_{}", named.name)).map(&mut want)));
        }
        let label = record.find("experiment");
        if label.is_none() && model.experiments > 1 {
            return Err(record.missing("`experiment` (1, 2, ...)").into());
        }
        let used = |i: usize| label == Some(i) || wanted.iter().any(|w| w.column == i);
        let columns = record.columns().iter().enumerate();
        let ignored = columns.filter(|(i, _)| !used(*i)).map(|(_, c)| c.text.clone()).collect();
        if wanted.len() > MOST {
            return Err(SystemCalibrationError::TooMany { found: wanted.len() });
        }
        Ok(Self { wanted, inputs, outputs, label, ignored })
    }
}

pub(super) fn read(record: Record, model: &SystemModel) -> Result<Read, SystemCalibrationError> {
    let columns = Columns::of(&record, model)?;
    let inputs: Vec<usize> = (0..model.known_inputs.len())
        .filter(|&k| record.find(&model.known_inputs[k].0.name).is_some())
        .collect();
    let (name, experiments) = (record.name().to_string(), model.experiments.max(1));
    let texts: Vec<String> = columns.wanted.iter().map(|w| record.columns()[w.column].text.clone()).collect();
    let mut rows: Vec<Data> = Vec::new();
    let take = |row: Row<'_>| -> Result<(), SystemCalibrationError> {
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
        if t < 0.0 {
            return Err(refuse(&texts[0], t.to_string(), "a time from 0, the start of the model, on"));
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
        for &(i, s) in &columns.inputs {
            let x =
                value(i).ok_or_else(|| refuse(&texts[i], "nothing".into(), "the value of a known input"))?;
            of_inputs.push((x, sigma(s)?.unwrap_or(0.0)));
        }
        let outputs = columns.outputs.iter().map(|&(i, _)| value(i)).collect();
        let sigmas = columns.outputs.iter().map(|&(_, s)| sigma(s)).collect::<Result<_, _>>()?;
        rows.push(Data { line: row.line, experiment, t, inputs: of_inputs, outputs, sigmas });
        Ok(())
    };
    record.read(&columns.wanted, columns.label, true, take)?;
    // each experiment in one piece
    rows.sort_by_key(|r| r.experiment);
    Ok(Read { rows, inputs, ignored: columns.ignored })
}

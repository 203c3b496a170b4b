//! Reading of the records of a run, as a file states it: names and units of columns, and the detection of
//! intervals at rest.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

/// Reading of the records of `obsdeg calibrate`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// Names of the columns in the record, by their names here.
    pub columns: BTreeMap<String, String>,
    /// Units of the columns, or the size of one count, by their names here: `2.44e-5 g`.
    pub units: BTreeMap<String, String>,
    /// Known values of a model's outputs that are no columns.
    pub values: BTreeMap<String, f64>,
    /// Detection of the intervals at rest; `None` if they are not found from the data.
    pub still: Option<Still>,
    /// Fraction of the interval between rows by which their time stamps may differ from the timeline of a
    /// scheme; `None` for the program's default.
    pub tolerance: Option<f64>,
    /// Codes of missing values in the columns of a scheme's record, as written.
    pub missing: Vec<f64>,
    /// Time at the start of each position of a scheme, in s, whose measurements are left out; `None` for
    /// none.
    pub settle: Option<f64>,
}

/// Detection of intervals at rest: the variance within a window about each sample, all columns together, is
/// at most `factor` times that of the initial rest. Source: D. Tedaldi, A. Pretto, E. Menegatti, ICRA 2014,
/// doi:10.1109/ICRA.2014.6907297.
#[derive(Debug, Clone, PartialEq)]
pub struct Still {
    /// Known inputs of a model whose scatter decides; for a scheme, the forces.
    pub by: Vec<String>,
    /// Duration of the initial rest, in the unit of the record's time (s for a scheme).
    pub initial: f64,
    /// Width of the window about each sample, in the unit of the record's time.
    pub window: f64,
    /// Largest variance at rest over that of the initial rest, dimensionless.
    pub factor: f64,
    /// Shortest interval at rest, in the unit of the record's time; shorter intervals are discarded.
    pub shortest: f64,
}

/// Reading of the records of `obsdeg calibrate`: columns, units and intervals at rest.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SchemeRecord {
    /// Names of the columns in the record, by their names here, as in `fx = "AccX"`.
    #[serde(default)]
    columns: BTreeMap<String, String>,
    /// Units of columns without a unit in the header, or sizes of one count, by name here:
    /// `fx = "2.44e-5 g"`. For pulses of an accelerometer, the velocity increment of one pulse:
    /// `fx = "1e-5 m/s"`.
    #[serde(default)]
    units: BTreeMap<String, String>,
    /// Detection of the positions as intervals at rest, by the scatter of the forces; used if no column
    /// `position` labels the samples.
    #[serde(default, rename = "static")]
    still: Option<SchemeStill>,
    /// Fraction of the interval between rows, dimensionless, 0 to 0.5, by which their times may differ from
    /// the timeline of the scheme; 0.05 when left out.
    #[serde(default)]
    tolerance: Option<f64>,
    /// Codes of missing values, in the unit of their column: `missing = [-9999, 0]`.
    #[serde(default)]
    missing: Vec<f64>,
    /// Time at the start of each position at rest, in s, 0 to 1e6, whose measurements do not count: not in a
    /// calibration, and not in predicted uncertainties; none when left out.
    #[serde(default)]
    settle: Option<f64>,
}

/// Detection of intervals at rest: the variance within a window about each sample is at most `factor` times
/// the variance of the initial rest.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SchemeStill {
    /// Duration of the initial rest of the record, in s; at least the window.
    initial: f64,
    /// Width of the window about each sample, in s, above 0.
    window: f64,
    /// Largest variance at rest over that of the initial rest, dimensionless, above 1; 6 when left out.
    #[serde(default = "six")]
    factor: f64,
    /// Shortest interval at rest, in s; shorter intervals are discarded.
    shortest: f64,
}

/// Reading of the record of `obsdeg calibrate --model`: columns, known values and intervals at rest.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ModelRecord {
    /// Names of the columns in the record, by their names in the model.
    #[serde(default)]
    columns: BTreeMap<String, String>,
    /// Values of outputs without a column, equal in every row, as in `g = 9.81`, in the units of the outputs;
    /// for a vector all entries, or each.
    #[serde(default)]
    values: BTreeMap<String, f64>,
    /// Reduction of the record to intervals at rest: each becomes a row of means, each with its standard
    /// deviation. In a model with states, the samples between two intervals are a run of their own.
    /// `NAME_before` is the mean of a known input before that run, and outputs are measured at its end.
    #[serde(default, rename = "static")]
    still: Option<ModelStill>,
}

/// Detection of intervals at rest: the variance within a window about each sample is at most `factor` times
/// the variance of the initial rest. Times are in the unit of `t`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ModelStill {
    /// Known inputs of the model whose scatter decides, all together.
    by: Vec<String>,
    /// Duration of the initial rest of the record, in the unit of `t`; at least the window.
    initial: f64,
    /// Width of the window about each sample, in the unit of `t`, above 0.
    window: f64,
    /// Largest variance at rest over that of the initial rest, dimensionless, above 1; 6 when left out.
    #[serde(default = "six")]
    factor: f64,
    /// Shortest interval at rest, in the unit of `t`; shorter intervals are discarded.
    shortest: f64,
}

impl From<SchemeRecord> for Recording {
    fn from(r: SchemeRecord) -> Self {
        let still = r.still.map(|SchemeStill { initial, window, factor, shortest }| Still {
            by: Vec::new(),
            initial,
            window,
            factor,
            shortest,
        });
        Self {
            columns: r.columns,
            units: r.units,
            values: BTreeMap::new(),
            still,
            tolerance: r.tolerance,
            missing: r.missing,
            settle: r.settle,
        }
    }
}

impl From<ModelRecord> for Recording {
    fn from(r: ModelRecord) -> Self {
        let still = r.still.map(|ModelStill { by, initial, window, factor, shortest }| Still {
            by,
            initial,
            window,
            factor,
            shortest,
        });
        Self {
            columns: r.columns,
            units: BTreeMap::new(),
            values: r.values,
            still,
            tolerance: None,
            missing: Vec::new(),
            settle: None,
        }
    }
}

fn six() -> f64 {
    6.0
}

impl Recording {
    /// Known value of an output; an entry of a vector has its own value, or that of the whole vector.
    pub fn value(&self, output: &str) -> Option<f64> {
        let whole = output.split('[').next().unwrap_or(output);
        self.values.get(output).or_else(|| self.values.get(whole)).copied()
    }

    /// Checks numbers and texts, independently of the rest of the file.
    ///
    /// # Errors
    /// Description of the fault and of the expected values.
    pub fn check(&self) -> Result<(), String> {
        if let Some(s) = &self.still {
            for (key, x, least) in [
                ("initial", s.initial, 0.0),
                ("window", s.window, 0.0),
                ("shortest", s.shortest, 0.0),
                ("factor", s.factor, 1.0),
            ] {
                if !(x.is_finite() && x > least) {
                    return Err(format!("static.{key} is {x}; expected a number above {least}"));
                }
            }
            if s.initial < s.window {
                return Err(format!(
                    "static.initial is {}; expected at least static.window, {}",
                    s.initial, s.window
                ));
            }
        }
        if let Some(x) = self.tolerance.filter(|x| !(0.0..=0.5).contains(x)) {
            return Err(format!("tolerance is {x}; expected a part of the sample interval, 0 to 0.5"));
        }
        if let Some(x) = self.settle.filter(|x| !(0.0..=1e6).contains(x)) {
            return Err(format!("settle is {x}; expected a time at the start of each position, 0 to 1e6 s"));
        }
        if let Some(x) = self.missing.iter().find(|x| !x.is_finite()) {
            return Err(format!("missing has {x}; expected finite numbers"));
        }
        let bad = self.values.iter().find(|(_, x)| !x.is_finite());
        bad.map_or(Ok(()), |(name, x)| Err(format!("values.{name} is {x}; expected a finite number")))
    }

    /// Checks the reading for a model with these known `inputs` and `outputs`.
    ///
    /// # Errors
    /// Description of the fault, as for [`Self::check`].
    pub(crate) fn check_model(&self, inputs: &[&str], outputs: &[&str]) -> Result<(), String> {
        self.check()?;
        let none = |kind: &str, list: &[&str], name: &str| {
            format!("`{name}` is no {kind} of the model; expected one of {}", list.join(", "))
        };
        let is = |o: &&str, n: &str| *o == n || o.strip_prefix(n).is_some_and(|rest| rest.starts_with('['));
        if let Some(name) = self.values.keys().find(|n| !outputs.iter().any(|o| is(o, n))) {
            return Err(none("output", outputs, name));
        }
        if let Some(s) = &self.still {
            if s.by.is_empty() {
                return Err("static.by is missing; expected the known inputs whose scatter decides".into());
            }
            if let Some(name) = s.by.iter().find(|n| !inputs.contains(&n.as_str())) {
                return Err(none("known input", inputs, name));
            }
        }
        Ok(())
    }
}

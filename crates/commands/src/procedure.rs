//! Sheet of a run: turns, waits and recordings in order of time.

use clap::Args;
use obsdeg_core::model::scheme_file::write;
use obsdeg_core::model::{Scheme, angles_text};
use obsdeg_design::procedure::{
    Procedure as Sheet, ProcedureError, ProcedureOptions, TILT_DEG, procedure as sheet, rotation_table,
    scheme_of_procedure, scheme_of_rotations, start_of_table,
};
use obsdeg_evidence::simulation::Conditions;
use obsdeg_report::{File, position_figure, procedure_page, record_header, steps_csv};
use serde::{Deserialize, Serialize};

use crate::arguments::{ANY, Attitude, InputOptions, SEED, Word, one_of, whole};
use crate::conditions::ConditionOptions;
use crate::problem::Problem;
use crate::source::{Input, Source, title};
use crate::text;

/// Form of the table for a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dialect {
    /// Every step with its gimbal angles and its turn.
    #[default]
    Generic,
    /// Rotations about axes of the body, with the rest before and after each.
    Psins,
}

/// The words of `--dialect`.
const DIALECTS: [Word<Dialect>; 2] = [
    ("generic", "every step: gimbal angles, turn, rate, readings (controller.csv)", Dialect::Generic),
    ("psins", "rotations k, Ux, Uy, Uz, angle, T, T0, T1 (controller.txt)", Dialect::Psins),
];

/// Request of `procedure`: the scheme, and the conditions of its run.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct ProcedureRequest {
    /// Seed of the verdicts
    #[arg(long, default_value_t = SEED, value_parser = whole::<u64>(ANY))]
    pub seed: u64,

    /// Time at rest before each recording, in s, within the dwell (default: settle of the file, else 0; 0 to
    /// 100000)
    #[arg(long, value_name = "S", help_heading = "Sheet")]
    pub settle: Option<f64>,

    /// Tilt that the tolerance of a reading always allows, in degrees (0.01 to 90)
    #[arg(long, value_name = "DEG", default_value_t = TILT_DEG, help_heading = "Sheet")]
    pub tilt: f64,

    /// Table for a controller
    #[arg(
        long, value_name = "DIALECT", default_value = "generic", help_heading = "Sheet",
        value_parser = one_of(DIALECTS)
    )]
    pub dialect: Dialect,

    /// With --rotations: attitude at the start, as for --angles
    #[arg(long, value_name = "A,B,G", allow_hyphen_values = true, help_heading = "Sheet")]
    #[serde(with = "text")]
    pub start: Option<Attitude>,

    /// Positions, combinations and assumptions.
    #[command(flatten)]
    #[serde(flatten)]
    pub input: InputOptions,

    /// Conditions of the run.
    #[command(flatten)]
    #[serde(flatten)]
    pub conditions: ConditionOptions,
}

impl Default for ProcedureRequest {
    fn default() -> Self {
        Self {
            seed: SEED,
            settle: None,
            tilt: TILT_DEG,
            dialect: Dialect::Generic,
            start: None,
            input: InputOptions::default(),
            conditions: ConditionOptions::default(),
        }
    }
}

/// Sheet with the scheme that it executes.
#[derive(Debug, Clone)]
pub struct Planned {
    /// The sheet.
    pub sheet: Sheet,
    /// Scheme with all conditions of the sheet.
    pub scheme: Scheme,
    dialect: Dialect,
}

/// Sheet of a scheme, or of a rotation table.
///
/// # Errors
/// [`Problem`] of the scheme, the table or an option.
pub fn procedure(
    a: &ProcedureRequest,
    sources: Vec<Source>,
    rotations: Option<&Source>,
) -> Result<Planned, Problem> {
    let sources = match rotations {
        None if a.start.is_some() => {
            return Err(Problem::input(
                "--start is where a rotation table begins; expected --rotations FILE",
            ));
        }
        None => sources,
        Some(_) if !sources.is_empty() || !a.input.angles.is_empty() => {
            return Err(Problem::input("found --rotations beside another scheme; expected one of them"));
        }
        Some(table) => vec![of_table(a, table)?],
    };
    let Input::Scheme(scheme) = a.input.read_one(sources)? else {
        return Err(Problem::input("a model has no sheet; expected a scheme, or --angles once per position"));
    };
    a.conditions.concern(std::iter::once(&*scheme))?;
    let mut conditions: Conditions = a.conditions.conditions(&scheme);
    conditions.settle_s = a.settle.unwrap_or(conditions.settle_s);
    let options = ProcedureOptions { tilt_deg: a.tilt, seed: a.seed };
    let sheet = sheet(&scheme, &conditions, &options).map_err(|e| match e {
        ProcedureError::Simulation(e) => Problem::from(e),
        e => Problem::input(e.to_string()),
    })?;
    if a.dialect == Dialect::Psins && sheet.rotations.is_empty() {
        return Err(Problem::input(
            "--dialect psins needs turns with a rate; expected --slew-rate (inertial carry) and two positions \
             or more",
        ));
    }
    Ok(Planned { sheet, scheme: scheme_of_procedure(&scheme, &conditions), dialect: a.dialect })
}

/// Scheme file of a rotation table.
fn of_table(a: &ProcedureRequest, table: &Source) -> Result<Source, Problem> {
    // a table of obsdeg has its start in a comment
    let own = start_of_table(&table.text).unwrap_or("0,0,0").parse::<Attitude>();
    let own = || own.map_err(|e| Problem::input(format!("{}: its start: {e}", table.name)));
    let start = a.start.clone().map_or_else(own, Ok)?;
    if start.rotation.is_some() || start.angles.iter().any(|angle| angle.generic().is_some()) {
        let found = angles_text(&start.angles);
        return Err(Problem::input(format!("--start {found}: expected three angles in degrees")));
    }
    let scheme = scheme_of_rotations(&table.text, &start.angles);
    let scheme = scheme.map_err(|e| Problem::input(format!("{}: {e}", table.name)))?;
    let description = format!("Rotation table {}, from {}", title(&table.name), angles_text(&start.angles));
    let named = Scheme { name: title(&table.name), description, ..scheme };
    Ok(Source::new(table.name.clone(), write(&named)))
}

impl Planned {
    /// Name of the table for a controller; empty for a sheet that the gimbals cannot execute.
    pub fn controller(&self) -> String {
        match (self.sheet.executable, self.dialect) {
            (false, _) => String::new(),
            (true, Dialect::Generic) => "controller.csv".into(),
            (true, Dialect::Psins) => "controller.txt".into(),
        }
    }

    /// Files beside the JSON: the page, the scheme, the header of the record, the table for a controller.
    ///
    /// # Errors
    /// [`Problem`] of a page that cannot be written.
    pub fn files(&self) -> Result<Vec<File>, Problem> {
        let mut files = vec![
            procedure_page(&self.sheet, &self.scheme)?,
            File::new("scheme.toml", write(&self.scheme)),
            File::new("record.csv", record_header(&self.sheet)),
            position_figure(&self.scheme),
        ];
        // a controller gets no steps that the gimbals cannot execute
        if self.sheet.executable {
            files.push(match self.dialect {
                Dialect::Generic => File::new("controller.csv", steps_csv(&self.sheet)?),
                Dialect::Psins => {
                    let start =
                        self.scheme.positions.first().map(|p| angles_text(&p.angles)).unwrap_or_default();
                    let start_attitude = self.sheet.start_attitude_deg;
                    File::new("controller.txt", rotation_table(&self.sheet.rotations, start_attitude, &start))
                }
            });
        }
        Ok(files)
    }
}

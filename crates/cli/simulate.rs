//! `obsdeg simulate`: one run of the filter against a simulated truth.

use clap::Args;
use obsdeg_evidence::simulation::{Traces, simulate};
use obsdeg_evidence::system::simulate_system;
use obsdeg_report::{Answer, File, ReportError, series_csv, series_parquet, simulation_figures};

use crate::arguments::{ANY, Given, InputArguments, one_file, whole};
use crate::conditions::ConditionArguments;
use crate::failure::Failure;
use crate::input::Input;
use crate::interrupt;
use crate::output::{Output, to_a_folder};

const AFTER_HELP: &str = "\
Examples:
  obsdeg simulate --angles 0,0,0 --angles 180,0,0
  obsdeg simulate --angles 0,0,0 --angles 180,0,0 --truth exact --carry inertial --drift-scale 0.001
  obsdeg simulate scheme.toml --slew-rate 1 --carry inertial -o run
  obsdeg simulate examples/lotka-volterra/model.toml -o run

Left to itself it is the paper's run: psi(0) 0.1 deg each, D_F 11, 12, 13 deg/h, D_I D_O D_S 5 deg/h/g, random drift 0.01 deg/h, \
noise 1e-5 g, steps of 10 s, 1000 s a position. With -o it writes summary.json, series.csv, series.parquet and, as SVG and PNG, two \
figures per unknown (estimate, .error), all in one, and those of the paper.

Exit codes: 0 done (whatever the verdict), 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(one_file), mut_args(to_a_folder))]
pub(crate) struct Arguments {
    /// Seed of the noise
    #[arg(long, default_value_t = 1, value_parser = whole::<u64>(ANY))]
    seed: u64,

    #[command(flatten)]
    input: InputArguments,

    #[command(flatten)]
    conditions: ConditionArguments,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(a: &Arguments, given: &Given) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.check_folder()?;
    match a.input.read_one(given)? {
        Input::Scheme(scheme) => {
            a.conditions.concern(std::iter::once(&*scheme))?;
            let (summary, record) = simulate(&scheme, &a.conditions.conditions(&scheme), a.seed)?;
            let more = || files(&record.traces, &summary);
            a.output.write_folder(&summary, "summary.json", more)
        }
        Input::Model(file) => {
            let (run, traces) = simulate_system(&file.model, a.seed).map_err(|e| file.wrong_run(&e))?;
            a.output.write_folder(&run, "summary.json", || files(&traces, &run))
        }
    }
}

/// What goes into the folder beside the summary.
fn files(traces: &Traces, summary: &impl Answer) -> Result<Vec<File>, ReportError> {
    let mut files = vec![
        File { name: "series.csv".into(), bytes: series_csv(traces)?.into_bytes() },
        File { name: "series.parquet".into(), bytes: series_parquet(traces, summary)? },
    ];
    files.extend(simulation_figures(traces)?);
    Ok(files)
}

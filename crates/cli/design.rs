//! `obsdeg design`: the fewest positions, the best of a number of positions, and sets of outputs of a model.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::{Arg, Args};
use obsdeg_commands::{Designed, Host, Search, SearchFiles, Source, design, is_word};
use obsdeg_design::design::Part;
use obsdeg_report::{next_figures, sensor_figures};
use obsdeg_verify::{Replay, verify_with};

use crate::arguments::RequireMet;
use crate::failure::Failure;
use crate::input::{is_stdin, read};
use crate::interrupt;
use crate::output::{Output, print, to_a_folder, write_file};
use crate::progress::Bar;

const AFTER_HELP: &str = "\
Examples:
  obsdeg design --minimum --carry inertial
  obsdeg design --positions 5 --carry inertial
  obsdeg design --positions 12 --dwell 417 --carry inertial -o twelve
  obsdeg design --positions 5 --carry inertial --slew-rate 1 --max-slew 120 --max-time 5300
  obsdeg design --positions 6 --observable D_F,D_O,D_S --max-degree 1
  obsdeg design --positions 6 --criterion margin --requirement D=0.05 --requirement D_F=0.01 --meet
  obsdeg design --positions 5 --carry inertial --candidates grid:45 --gimbal beta=-60:60 --refine
  obsdeg design --positions 12 --carry reset --candidates free --round 5
  obsdeg design --positions 12 --terms all --carry inertial --slew-rate 1 --criterion d
  obsdeg design --positions 8 --carry platform --within 0
  obsdeg design --positions 5 --carry inertial --divide
  obsdeg design --positions 5 --carry inertial --certificate c.json    a proof for obsdeg verify and other checkers
  obsdeg design --positions 7 --carry inertial --part 2/40 -o part-2.json
  obsdeg design --merge part-*.json --check 3
  obsdeg design scheme.toml --candidates grid:45        with carry, dwell, noise, requirements and gimbals of the file
  obsdeg design model.toml --measure states             the fewest outputs that make all unknowns of a model observable
  obsdeg design model.toml --measure \"x1, x1 + x3\" --own-outputs --observable k1,k2 --max-degree 4

Up to 50 million sequences are searched exhaustively, with --within 0 all, which proves the best; beyond, \
coordinate exchange from random starts. Where order matters and repositioning takes no time, a bound on what \
the last two positions can add leaves most of many sequences out (branch and bound): eight of the 24 \
cardinal attitudes in some minutes. Under reset carry information adds over positions, so that a bound on \
what any scheme of the candidates can reach says how far the best found is from it at most. Where units \
differ (--terms all) the criterion is d or margin; where torquer errors act on slews, schemes are walks, \
found by exchange. With slews half turns are tried in both directions: NUE (-N) NDW is the one that is \
right-handed about South. The folder of -o holds design.json, winner.toml (a scheme file), its positions as \
a picture, and the front of total time against the criterion as a figure. Ctrl-C ends with the best so far.

With --measure the folder of -o holds sensors.json and two figures: front (number or cost of the outputs \
against the largest degree) and degrees (each unknown by candidate). With --next it holds next.json, and with \
--next 1 attitudes (a map of what each candidate gives) and degrees (each coefficient by candidate).

Of a model the answer is which of the candidates to measure: minimal sets, the front of their number or cost \
against the largest degree, and the cheapest set of each unknown, each with its proof.

Exit codes: 0 done (with --minimum also when no positions do), 1 the first scheme misses a requirement (with \
--require-met), 2 bad input (also when no scheme can be found), 3 internal error, 130 interrupted before \
anything was found.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(to_a_folder), mut_args(words))]
pub(crate) struct Arguments {
    /// Scheme file whose carry, latitude, geometry, terms, conditions, requirements and gimbal limits hold; -
    /// is stdin. Its positions are not chosen from (--candidates), and as many are searched where no number
    /// is asked for. Or a model file: sets of outputs are chosen (--measure)
    #[arg(value_name = "SCHEME", id = "conditions", conflicts_with = "merge")]
    scheme: Option<PathBuf>,

    #[command(flatten)]
    asked: Search,

    /// Put the parts of a search together to the answer of the whole (under reset carry: that of --within 0).
    /// No other option is needed: the parts know theirs. What they list is evaluated again, and what they
    /// count must add up; that they were searched as they state is believed, but for --check N
    #[arg(long, value_name = "FILE", num_args = 1.., help_heading = "Parts", conflicts_with_all = ["minimum", "part"])]
    merge: Vec<PathBuf>,

    /// With --next: the answer of `obsdeg calibrate` (calibration.json) that is known beforehand. The added
    /// positions are then a run of their own, with the conditions of the scheme
    #[arg(long, value_name = "FILE", help_heading = "Further positions", requires = "next")]
    after: Option<PathBuf>,

    #[command(flatten)]
    met: RequireMet,

    /// Write a certificate of the optimum (JSON) that `obsdeg verify` and other checkers search again: the
    /// answer must be proven to be the best
    #[arg(long, value_name = "FILE", help_heading = "Output", conflicts_with_all = ["minimum", "part", "merge"])]
    certificate: Option<PathBuf>,

    #[command(flatten)]
    output: Output,
}

/// Help and conflicts of shared options for `design`.
fn words(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "latitude" => arg.help("Latitude in degrees (default: 28.2)"),
        "output" => arg
            .value_name("DIR")
            .help("Write summary, series and figures to a folder; with --part the part to a file"),
        "part" => arg.requires("output"),
        _ => arg,
    }
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    if a.asked.part.is_none() {
        a.output.check_folder()?;
    }
    if let Some(path) = a.certificate.as_ref().filter(|path| path.exists() && !a.output.target.force) {
        return Err(Failure::input(format!("{} exists; --force replaces it", path.display())));
    }
    let file = |text: &&String| is_stdin(Path::new(text)) || Path::new(text).exists();
    let candidates = Some(&a.asked.candidates).filter(|text| !is_word(text)).filter(file);
    let part = |path: &Path| read(path, "part");
    let files = SearchFiles {
        conditions_file: a.scheme.as_deref().map(|file| read(file, "scheme")).transpose()?,
        candidates_file: candidates.map(|file| read(Path::new(file), "scheme")).transpose()?,
        merge: a.merge.iter().map(|path| part(path)).collect::<Result<Vec<Source>, _>>()?,
        after: a.after.as_deref().map(|file| read(file, "calibration")).transpose()?,
        resume: a.asked.part.and_then(|_| a.output.target.existing()).map(part).transpose()?,
    };
    let bar = Bar::start(a.output.target.quiet);
    let interrupted = interrupt::flag()?;
    let progress = |now| {
        bar.show(&now);
        !interrupted.load(Ordering::Relaxed)
    };
    let asked = Search { certificate: a.certificate.is_some(), ..a.asked.clone() };
    let designed = design(&asked, &files, &Host { worker: None, progress: &progress });
    drop(bar);
    match designed? {
        Designed::Schemes(mut found) => {
            if let (Some(path), Some(file)) = (&a.certificate, found.take_certificate()) {
                // checks the question, the best sequences and the cover, but searches no block again
                let replay = Replay { blocks: Some(0), seed: Some(0) };
                if let Err(refused) = verify_with(&file.bytes, None, &replay) {
                    return Err(Failure::input(format!("no certificate: its check refuses it ({refused})")));
                }
                write_file(path, &file.bytes)?;
            }
            let first = || found.found.found.first().map(|f| &f.requirements);
            a.met.check(first())?;
            a.output.write_folder(&*found, "design.json", || found.files(true))?;
            a.met.decide(first())
        }
        Designed::SlewSequence(found) => {
            a.output.write_folder(&*found, "walks.json", || Ok::<_, Failure>(found.files()))
        }
        Designed::Outputs(found) => {
            a.met.check(None)?;
            a.output.write_folder(&*found, "sensors.json", || sensor_figures(&found))
        }
        Designed::Next(found) => {
            let first = || found.found.first().map(|f| &f.then.requirements);
            a.met.check(first())?;
            a.output.write_folder(&*found, "next.json", || next_figures(&found))?;
            a.met.decide(first())
        }
        Designed::Part(part) => write_part(&part, a),
    }
}

/// Writes a complete or interrupted part to its file; says so, and names the options that act at the merge
/// only.
fn write_part(part: &Part, Arguments { asked, output, .. }: &Arguments) -> Result<(), Failure> {
    let text = serde_json::to_string(part).map_err(|e| Failure::internal(e.to_string()))?;
    output.target.replace(format!("{text}\n").as_bytes())?;
    let [number, of] = part.part;
    let [from, to, all] = part.starts;
    let examined: u64 = part.levels.iter().map(|level| level.best.examined).sum();
    let of_the_answer = [
        ("--refine", asked.refine),
        ("--divide", asked.divide),
        ("--front", !asked.front.is_empty()),
        ("--restarts", asked.restarts.is_some()),
    ];
    let of_the_answer = of_the_answer.into_iter().filter_map(|(option, given)| given.then_some(option));
    let later = of_the_answer.chain(output.wording()).collect::<Vec<_>>().join(", ");
    let later = match later.is_empty() {
        true => later,
        false => format!("; {later}: where the parts are merged"),
    };
    let what = format!("part {number} of {of}: {} of {all} starts, {examined} sequences{later}", to - from);
    match part.complete {
        true => print(format!("{what}\n").as_bytes()),
        false => {
            Err(Failure::unfinished(format!("{what} so far: interrupted; the same command goes on with it")))
        }
    }
}

//! `obsdeg design`: the fewest positions, and the best of a number of positions.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::{Arg, ArgGroup, Args};
use obsdeg_core::model::ranges::{PRIOR, SLEW_RATE_DEG_S, TURN_DEG};
use obsdeg_core::model::scheme_file::write;
use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Carry, Scheme, parse_decimal};
use obsdeg_design::design::{
    Candidates, CriterionName, Design, DesignError, DesignOptions, Found, Part, Progress, WalkOptions,
    design, design_merged, design_part, is_walk, scheme_found, scheme_of_walk, walks,
};
use obsdeg_evidence::simulation::{Conditions, general_first};
use obsdeg_report::{File, design_figures, position_figure, visible};

use crate::arguments::{ANY, Assumptions, TermArguments, Word, WordOr, one_of, whole};
use crate::conditions::{MeasurementArguments, assigned, concern_some, within};
use crate::failure::Failure;
use crate::input::{Source, is_stdin};
use crate::interrupt;
use crate::output::{Output, print, to_a_folder};
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
  obsdeg design --positions 7 --carry inertial --part 2/40 -o part-2.json
  obsdeg design --positions 7 --carry inertial --merge part-*.json

Up to 50 million sequences are searched exhaustively, with --within 0 all, which proves the best; beyond, coordinate exchange from random \
starts. Where order matters and repositioning takes no time, a bound on what the last two positions can add leaves most of many sequences out (branch \
and bound): eight of the 24 cardinal attitudes in some minutes. Under reset carry information adds over positions, so that a bound on what any scheme of the candidates can reach says how far the best found is from it at most. Where units \
differ (--terms all) the criterion is d or margin; where torquer errors act on slews, schemes are walks, found by exchange. With slews \
half turns are tried in both directions: NUE (-N) NDW is the one that is right-handed about South. The folder of -o holds design.json, \
winner.toml (a scheme file), its positions as a picture, and the front of total time against the criterion as a figure. Ctrl-C ends with the best so far.

Exit codes: 0 done (with --minimum also when no positions do), 2 bad input (also when no scheme can be found), 3 internal error, 130 interrupted before anything was found.";

/// The words of `--candidates`; whatever else it says is a file.
const CANDIDATES: [(&str, &str); 3] = [
    ("cardinal", "the 24 attitudes along North, Up, East, South, Down, West"),
    ("free", "the attitudes that weights on all attitudes need, reset carry"),
    ("grid:", "and a step in degrees, as in grid:45: Euler angles in steps"),
];

/// The words of `--criterion`.
const CRITERIA: [Word<CriterionName>; 5] = [
    ("worst", "the largest sigma", CriterionName::Worst),
    ("a", "the trace of the covariance", CriterionName::A),
    ("d", "the determinant of the covariance", CriterionName::D),
    ("e", "its largest eigenvalue", CriterionName::E),
    ("margin", "the largest sigma over its requirement, as for --meet", CriterionName::Margin),
];

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, group(ArgGroup::new("asked").required(true).args(["positions", "minimum"])), mut_args(to_a_folder), mut_args(words))]
pub(crate) struct Arguments {
    /// Seed of all random choices; the result does not depend on the number of threads
    #[arg(long, default_value_t = 1, value_parser = whole::<u64>(ANY))]
    seed: u64,

    /// Find the best scheme of so many positions
    #[arg(long, value_name = "K", value_parser = whole::<usize>(1..=100))]
    positions: Option<usize>,

    /// Only find the fewest positions that make every required coefficient observable, with the proof
    #[arg(long)]
    minimum: bool,

    /// What to choose from, or a scheme file: its positions, with carry, latitude, geometry, terms, conditions and gimbal limits of the file
    #[arg(long, value_name = "WHAT", default_value = "cardinal", value_parser = WordOr(CANDIDATES))]
    candidates: String,

    /// With --candidates free: angles are rounded to multiples of so many degrees, and schemes evaluated as they are rounded; the cardinal
    /// attitudes may be chosen too (default: 5)
    #[arg(long, value_name = "DEG")]
    round: Option<String>,

    #[command(flatten)]
    assumptions: Assumptions,

    #[command(flatten)]
    terms: TermArguments,

    /// With --minimum and torquer errors (GS, GM, GM3): the largest turn from one position to the next, in degrees
    /// (default: 90)
    #[arg(long, value_name = "DEG", value_parser = within(TURN_DEG))]
    max_turn: Option<f64>,

    /// How many schemes are listed (default: 10)
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..=1000))]
    keep: Option<u16>,

    /// Restarts of the exchange (default: 200)
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1_000_000))]
    restarts: Option<u64>,

    /// Under reset carry, where many sequences would have to be searched: a scheme found by exchange is enough when it is within so many percent
    /// of what is possible at all. 0: all sequences are searched, however long that takes, under any carry (beyond
    /// 5 million sets of candidates: exchange; default: 0.01)
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    within: Option<f64>,

    /// Move the angles of the best scheme continuously, to hundredths of a degree
    #[arg(long)]
    refine: bool,

    /// Divide the total time among the positions of the best scheme: dwells of their own, in steps of the samples
    #[arg(long)]
    divide: bool,

    /// Other numbers of positions for the front of total time against the criterion
    #[arg(long, value_name = "K", value_delimiter = ',', value_parser = whole::<usize>(1..=100))]
    front: Vec<usize>,

    /// Search only part I of N of all sequences, however many these are, and write what it finds to the file of -o (a file here, no folder); an
    /// interrupted part goes on when the same command is given again
    #[arg(long, value_name = "I/N", value_parser = part, requires = "output", conflicts_with_all = ["minimum", "merge"])]
    part: Option<[usize; 2]>,

    /// Put the parts of a search together to the answer of the whole (under reset carry: that of --within 0); all other options as they were
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "minimum")]
    merge: Vec<PathBuf>,

    #[command(flatten)]
    wanted: WantedArguments,

    #[command(flatten)]
    measurement: MeasurementArguments,

    /// What is known of an unknown or family beforehand, as standard deviation in deg, deg/h, deg/h/g, ppm, arcsec, ug: D_F=0.1, psi=0.05. It counts in the
    /// criterion, in sigmas and in the bound, not in what is observable; priors that a scheme file states count too (default: none; 1e-9 to 1e9)
    #[arg(long, value_name = "NAME=X", help_heading = "Measurement", value_parser = assigned(PRIOR))]
    prior: Vec<Assignment>,

    #[command(flatten)]
    output: Output,
}

/// What a scheme must be.
#[derive(Debug, Args)]
#[command(next_help_heading = "What is wanted")]
struct WantedArguments {
    /// Coefficients or families that must be observable and that the criterion is about, such as D_F,D_IX (default: all)
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    observable: Vec<String>,

    /// Largest degree, of all required coefficients or of one or a family: 1, D_F=1
    #[arg(long, value_name = "[NAME=]K", value_parser = degree_cap)]
    max_degree: Vec<(Option<String>, usize)>,

    /// What makes one scheme better; a smaller worst degree comes before it. psi is estimated with the coefficients but counts in margin and
    /// --meet only (default: worst)
    #[arg(long, value_name = "HOW", value_parser = one_of(CRITERIA))]
    criterion: Option<CriterionName>,

    /// Only schemes that meet every requirement: on all coefficients and psi (default: psi 0.01 deg), or with --observable on those
    /// coefficients; by prediction: no prior but --prior, no drift noise, psi at the start (`simulate` the winner for the rest)
    #[arg(long)]
    meet: bool,

    /// Largest total time with slews, in s
    #[arg(long, value_name = "S")]
    max_time: Option<f64>,

    /// Longest slew between successive positions, in s (with a slew rate)
    #[arg(long, value_name = "S")]
    max_slew: Option<f64>,

    /// Positions are reached by rotations at this rate, in deg/s; inertial carry only (default: instantaneous; 0.001 to 10000 deg/s)
    #[arg(long, value_name = "DEG_S", value_parser = within(SLEW_RATE_DEG_S))]
    slew_rate: Option<f64>,

    /// How far a gimbal turns in degrees, as alpha=-180:180, beta=-80:80; attitudes beyond are left out
    #[arg(long, value_name = "ANGLE=LOW:HIGH", allow_hyphen_values = true)]
    gimbal: Vec<String>,
}

fn degree_cap(text: &str) -> Result<(Option<String>, usize), String> {
    let (name, cap) = text.split_once('=').map_or((None, text), |(name, cap)| (Some(name.trim()), cap));
    let cap =
        cap.trim().parse().map_err(|_| format!("expected a degree, as in 1 or D_F=1, found `{text}`"))?;
    Ok((name.map(Into::into), cap))
}

fn part(text: &str) -> Result<[usize; 2], String> {
    let found =
        text.split_once('/').and_then(|(i, n)| Some([i.trim().parse().ok()?, n.trim().parse().ok()?]));
    found
        .filter(|[i, n]| (1..=*n).contains(i))
        .ok_or_else(|| format!("expected a part such as 2/7, found `{text}`"))
}

fn percent(text: &str) -> Result<f64, String> {
    let found = text.trim().parse().ok().filter(|x: &f64| (0.0..=100.0).contains(x));
    found.ok_or_else(|| format!("expected 0 to 100 percent, found `{text}`"))
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    if a.part.is_none() {
        a.output.check_folder()?;
    }
    let (mut base, candidates) = candidates(&a.candidates)?;
    a.assumptions.apply(&mut base);
    if let Some(terms) = a.terms.unknowns()? {
        base.unknowns = terms;
    }
    for limit in &a.wanted.gimbal {
        base.gimbals.limit(limit).map_err(|e| Failure::input(format!("--gimbal: {e}")))?;
    }
    // any position has the unknowns that count
    let any = std::array::from_fn(|_| obsdeg_core::model::Angle::from_degrees(0));
    let with_any = Scheme { positions: Scheme::of_angles([any]).positions, ..base.clone() };
    a.measurement.concern(std::iter::once(&with_any))?;
    concern_some("--prior", &a.prior, std::iter::once(&with_any))?;
    let mut conditions = a.measurement.conditions(&base);
    conditions.priors.extend(general_first(a.prior.clone()));
    conditions.slew_rate_deg_s = a.wanted.slew_rate.or(conditions.slew_rate_deg_s);
    idle(a, &base, &conditions)?;
    let round = a.round.as_deref().unwrap_or("5");
    let step = parse_decimal(round.trim()).ok().filter(|step| (1..=90_000_000_000).contains(step));
    let step = step.ok_or_else(|| {
        Failure::input(format!("--round {round}: expected degrees above 0 and up to 90, as in 5"))
    })?;
    let options = DesignOptions {
        candidates,
        positions: a.positions,
        required: a.wanted.observable.clone(),
        degree_caps: a.wanted.max_degree.clone(),
        meet: a.wanted.meet,
        total_s: a.wanted.max_time,
        slew_s: a.wanted.max_slew,
        criterion: a.wanted.criterion.unwrap_or_default(),
        keep: a.keep.unwrap_or(10).into(),
        restarts: a.restarts.unwrap_or(200),
        refine: a.refine,
        divide: a.divide,
        front: a.front.clone(),
        within: a.within.unwrap_or(0.01) / 100.0,
        everywhere: true,
        free: (a.candidates == "free").then_some(step),
        seed: a.seed,
    };
    if a.max_turn.is_some() && !(a.minimum && is_walk(&base)) {
        return Err(Failure::input(
            "--max-turn is for --minimum with torquer errors (GS, GM, GM3) under inertial carry".into(),
        ));
    }
    if a.minimum && is_walk(&base) {
        return fewest_of_walks(a, &base, options);
    }
    let parts = a.merge.iter().map(|path| Ok((path.display().to_string(), read_part(path)?)));
    let parts: Vec<(String, Part)> = parts.collect::<Result<_, Failure>>()?;
    let going_on = a.part.and_then(|_| a.output.target.existing()).map(read_part).transpose()?;
    let bar = Bar::start(1, "searching", a.output.target.quiet);
    let interrupted = interrupt::flag()?;
    let progress = |now: Progress| {
        bar.search(&now);
        !interrupted.load(Ordering::Relaxed)
    };
    if let Some(number) = a.part {
        let done = design_part(&base, &conditions, &options, number, going_on, &progress);
        drop(bar);
        return write_part(&done?, &a.output);
    }
    let designed = if parts.is_empty() {
        design(&base, &conditions, &options, &progress)
    } else {
        design_merged(&base, &conditions, &options, &parts, &progress)
    };
    drop(bar);
    let found = designed?;
    let more = || files(&found, &base, &conditions);
    a.output.write_folder(&found, "design.json", more)
}

/// Refuses options that would do nothing, each with what it needs.
fn idle(a: &Arguments, base: &Scheme, conditions: &Conditions) -> Result<(), Failure> {
    let (w, free) = (&a.wanted, a.candidates == "free");
    if a.minimum {
        let of_positions = [
            ("--keep", a.keep.is_some()),
            ("--restarts", a.restarts.is_some()),
            ("--within", a.within.is_some()),
            ("--refine", a.refine),
            ("--divide", a.divide),
            ("--front", !a.front.is_empty()),
            ("--round", a.round.is_some()),
            ("--max-degree", !w.max_degree.is_empty()),
            ("--criterion", w.criterion.is_some()),
            ("--meet", w.meet),
            ("--max-time", w.max_time.is_some()),
            ("--max-slew", w.max_slew.is_some()),
            ("--slew-rate", w.slew_rate.is_some()),
            ("--prior", !a.prior.is_empty()),
        ];
        let given = of_positions.into_iter().filter_map(|(option, given)| given.then_some(option));
        if let Some(option) = given.chain(a.measurement.given()).next() {
            return Err(Failure::input(format!(
                "{option} does nothing with --minimum, which asks what positions determine at all, with any noise; it is for --positions"
            )));
        }
    }
    let others = [
        ("--round", a.round.is_some() && !free, "--candidates free with it"),
        (
            "--within",
            a.within.is_some_and(|within| within > 0.0) && base.carry != Carry::Reset,
            "--carry reset with it, or --within 0, by which all sequences are searched",
        ),
        (
            "--within",
            a.within.is_some() && free,
            "given candidates with it; free attitudes are never all searched",
        ),
        (
            "--max-slew",
            w.max_slew.is_some() && conditions.slew_rate_deg_s.is_none(),
            "slews that take time, by --slew-rate or the file of --candidates",
        ),
        (
            "--azimuth-noise",
            a.measurement.given().any(|option| option == "--azimuth-noise") && !base.measured_azimuth,
            "a measured azimuth, by --measured-azimuth or the file of --candidates",
        ),
    ];
    match others.into_iter().find(|(_, idle, _)| *idle) {
        Some((option, _, needed)) => {
            Err(Failure::input(format!("{option} does nothing here: expected {needed}")))
        }
        None => Ok(()),
    }
}

/// A part of a search from its file.
fn read_part(path: &Path) -> Result<Part, Failure> {
    let source = Source::read(path, "part")?;
    serde_json::from_str(source.text())
        .map_err(|e| Failure::input(format!("{}: it is no part of a search: {e}", path.display())))
}

/// Writes a part to its file, whole or interrupted, and says which.
fn write_part(part: &Part, output: &Output) -> Result<(), Failure> {
    let text = serde_json::to_string(part).map_err(|e| Failure::internal(e.to_string()))?;
    output.target.replace(format!("{text}\n").as_bytes())?;
    let [number, of] = part.part;
    let [from, to, all] = part.starts;
    let examined: u64 = part.levels.iter().map(|level| level.best.examined).sum();
    let what = format!("part {number} of {of}: {} of {all} starts, {examined} sequences", to - from);
    match part.complete {
        true => print(format!("{what}\n").as_bytes()),
        false => {
            Err(Failure::unfinished(format!("{what} so far: interrupted; the same command goes on with it")))
        }
    }
}

/// The fewest positions where the way between them counts.
fn fewest_of_walks(a: &Arguments, base: &Scheme, options: DesignOptions) -> Result<(), Failure> {
    if !base.gimbals.are_free() {
        let text = "--gimbal is not taken where torquer errors make a scheme a walk; expected --max-turn, --observable";
        return Err(Failure::input(text.into()));
    }
    let options = WalkOptions {
        candidates: options.candidates,
        required: options.required,
        most_turn_deg: a.max_turn.unwrap_or(90.0),
        seed: options.seed,
    };
    let bar = Bar::start(1, "searching walks", a.output.target.quiet);
    let interrupted = interrupt::flag()?;
    let found = walks(base, &options, &|| !interrupted.load(Ordering::Relaxed));
    drop(bar);
    let found = found?;
    let winner = || -> Result<Vec<File>, Failure> {
        let scheme = scheme_of_walk(&found, base);
        let file = |s: Scheme| File { name: "winner.toml".into(), bytes: write(&s).into_bytes() };
        Ok(scheme.map(file).into_iter().collect())
    };
    a.output.write_folder(&found, "walks.json", winner)
}

/// What a shared option says here.
fn words(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "latitude" => arg.help("Latitude in degrees (default: 28.2)"),
        "output" => arg
            .value_name("DIR")
            .help("Write summary, series and figures to a folder; with --part the part to a file"),
        _ => arg,
    }
}

/// What to choose from, and the scheme whose assumptions hold.
fn candidates(text: &str) -> Result<(Scheme, Candidates), Failure> {
    if text == "cardinal" {
        return Ok((Scheme::default(), Candidates::cardinals()));
    }
    if text == "free" {
        // where the search for attitudes begins
        return Ok((Scheme::default(), Candidates::grid(45_000_000_000)?));
    }
    if let Some(step) = text.strip_prefix("grid:") {
        let wrong =
            || Failure::input(format!("--candidates {text}: expected a step in degrees, as in grid:45"));
        let step = parse_decimal(step.trim()).map_err(|_| wrong())?;
        return Ok((Scheme::default(), Candidates::grid(step)?));
    }
    if !is_stdin(Path::new(text)) && !Path::new(text).exists() {
        return Err(Failure::input(format!(
            "--candidates {text}: there is no such file; expected cardinal, free, a grid such as grid:45, or a scheme file that exists"
        )));
    }
    let scheme = Source::read(Path::new(text), "scheme")?.scheme()?;
    let candidates = Candidates::of_scheme(&scheme)?;
    Ok((scheme, candidates))
}

/// What goes into the folder beside the JSON.
fn files(found: &Design, base: &Scheme, conditions: &Conditions) -> Result<Vec<File>, Failure> {
    let mut files = Vec::new();
    if let Some(best) = found.found.first() {
        let bytes = scheme_file(found, best, base, conditions)?.into_bytes();
        files.push(File { name: "winner.toml".into(), bytes });
        files.push(position_figure(&scheme_found(best, base, conditions)?));
    }
    files.extend(design_figures(found)?);
    Ok(files)
}

/// A scheme that was found, as a file that `obsdeg analyze --scheme` reads.
fn scheme_file(
    found: &Design,
    best: &Found,
    base: &Scheme,
    conditions: &Conditions,
) -> Result<String, DesignError> {
    let as_searched = !best.refined && best.dwells_s.is_empty();
    let proven = found.search.as_ref().is_some_and(|s| s.proven) && as_searched;
    let certificate = found.search.as_ref().and_then(|s| s.certificate.as_ref()).filter(|_| as_searched);
    let proven = match (proven, certificate) {
        (true, _) => "proven best".into(),
        (false, Some(c)) => {
            format!("within {} of the best possible", obsdeg_report::percent(c.within_percent))
        }
        (false, None) => "best found".to_string(),
    };
    let positions = best.positions.iter().enumerate().map(|(i, name)| format!("p{} {name}", i + 1));
    let positions = positions.collect::<Vec<_>>().join(", ");
    let scheme = scheme_found(best, base, conditions)?;
    let all = found.required.len() + 3 >= best.rank[1];
    let what = if all { "all coefficients".into() } else { found.required.join(", ") };
    let search = found.search.as_ref();
    let unit = search.and_then(|s| s.unit.as_deref());
    let prior = search.and_then(|s| s.prior.as_ref());
    let prior = prior.map_or_else(|| "no prior".into(), |p| format!("prior {}", visible(p)));
    let name = search.map_or("", |s| s.criterion.as_str());
    let largest = |sigma: f64| format!("largest sigma of {what} {sigma:.3e} deg/h (per g)");
    let reached = match (unit, best.worst_sigma_dph) {
        (Some("deg/h"), Some(sigma)) if name == "worst" => largest(sigma),
        (unit, sigma) => {
            let own = unit.map_or_else(String::new, |u| format!(" {u}"));
            let sigma = sigma.filter(|_| unit == Some("deg/h")).map(|s| format!("; {}", largest(s)));
            format!("criterion {name} of {what} {:.3e}{own}{}", best.value, sigma.unwrap_or_default())
        }
    };
    Ok(format!(
        "# {proven} of {} candidates: {reached} in {:.0} s, {prior}, no drift noise, seed {}\n# {}\n{}",
        found.candidates.len(),
        best.total_s,
        found.seed,
        visible(&positions),
        write(&scheme)
    ))
}

//! The fewest positions, and the best of a number of positions.

use std::fmt;
use std::str::FromStr;

use std::ops::RangeInclusive;

use clap::{ArgGroup, Args};
use obsdeg_core::model::ranges::{SLEW_RATE_DEG_S, TURN_DEG};
use obsdeg_core::model::{Angle, Carry, Scheme, parse_decimal};
use obsdeg_design::design::{
    Candidates, CriterionName, Design, DesignOptions, Immune, Part, Progress, SlewSequenceOptions,
    asked as asked_conditions, certify_optimum, check_certifiable, design_merged, design_part,
    is_slew_sequence, shortest_slew_sequence,
};
use obsdeg_design::next::{NextOptions, NextPositions};
use obsdeg_design::sensors::Sensors;
use obsdeg_evidence::simulation::Conditions;
use obsdeg_report::File;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::arguments::{ANY, Assumptions, SEED, TermOptions, Word, WordOr, check_whole, one_of, whole};
use crate::conditions::{MeasurementOptions, within};
use crate::designed::{Designed, Searched, SearchedSlewSequence};
use crate::host::{Host, Now};
use crate::measure::{MeasureOptions, SetRequirements, measured};
use crate::next::{FurtherOptions, calibrated, check_further, further};
use crate::problem::Problem;
use crate::source::Source;
use crate::text;

/// Range of the number of positions.
const POSITIONS: RangeInclusive<u64> = 1..=100;
/// Range of the number of listed schemes.
const KEPT: RangeInclusive<u64> = 1..=1000;
/// Range of the number of blocks that are searched again.
const CHECKED: RangeInclusive<u64> = 0..=1_000_000_000;
/// Range of the number of restarts of the exchange.
const RESTARTS: RangeInclusive<u64> = 1..=1_000_000;

/// Words of `--candidates`; any other text is the path of a file.
const CANDIDATES: [(&str, &str); 3] = [
    (CARDINAL, "the 24 attitudes along North, Up, East, South, Down, West"),
    ("free", "the attitudes that weights on all attitudes need, reset carry"),
    ("grid:45", "Euler angles in steps of 45 degrees, or of another number that divides 90"),
];

/// The words of `--criterion`.
const CRITERIA: [Word<CriterionName>; 5] = [
    ("worst", "the largest sigma", CriterionName::Worst),
    ("a", "the trace of the covariance", CriterionName::A),
    ("d", "the determinant of the covariance", CriterionName::D),
    ("e", "its largest eigenvalue", CriterionName::E),
    ("margin", "the largest sigma over its requirement, as for --meet", CriterionName::Margin),
];

/// Request of `design`: candidates, requirements, criterion and limits of the search.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[command(group(ArgGroup::new("asked").args(["positions", "minimum", "next"])))]
#[serde(default)]
pub struct Search {
    /// Seed of all random choices; the result does not depend on the number of threads
    #[arg(long, default_value_t = SEED, value_parser = whole::<u64>(ANY))]
    pub seed: u64,

    /// Find the best scheme of so many positions
    #[arg(long, value_name = "K", value_parser = whole::<usize>(POSITIONS))]
    pub positions: Option<usize>,

    /// Only find the fewest positions that make every required coefficient observable, with the proof
    #[arg(long)]
    pub minimum: bool,

    /// What to choose from, or a scheme file: its positions; without SCHEME with carry, latitude, geometry,
    /// terms, conditions and gimbal limits of the file
    #[arg(long, value_name = "WHAT", default_value = CARDINAL, value_parser = WordOr(CANDIDATES))]
    pub candidates: String,

    /// With --candidates free: angles are rounded to multiples of so many degrees, and schemes evaluated as
    /// they are rounded; the cardinal attitudes may be chosen too (default: 5)
    #[arg(long, value_name = "DEG")]
    #[serde(with = "text")]
    pub round: Option<String>,

    /// Assumptions that override those of scheme files.
    #[command(flatten)]
    #[serde(flatten)]
    pub assumptions: Assumptions,

    /// Unknowns that override those of scheme files.
    #[command(flatten)]
    #[serde(flatten)]
    pub terms: TermOptions,

    /// With --minimum and torquer errors (GS, GM, GM3): the largest turn from one position to the next, in
    /// degrees (default: 90)
    #[arg(long, value_name = "DEG", value_parser = within(TURN_DEG))]
    pub max_turn: Option<f64>,

    /// How many schemes, or sets of outputs, are listed (default: 10)
    #[arg(long, value_name = "N", value_parser = whole::<u16>(KEPT))]
    pub keep: Option<u16>,

    /// Restarts of the exchange (default: 200)
    #[arg(long, value_name = "N", value_parser = whole::<u64>(RESTARTS))]
    pub restarts: Option<u64>,

    /// Under reset carry, where more than two million sequences would have to be searched: all are searched
    /// unless the scheme that an exchange finds is within so many percent of a bound on what is possible at
    /// all (default: they are not searched, and the answer says how far that scheme is from the bound at
    /// most). 0: all sequences are searched, however long that takes, under any carry (beyond 5 million sets
    /// of candidates: exchange)
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    pub within: Option<f64>,

    /// Move the angles of the best scheme continuously, to hundredths of a degree
    #[arg(long)]
    pub refine: bool,

    /// Divide the total time among the positions of the best scheme: dwells of their own, in steps of the
    /// samples
    #[arg(long)]
    pub divide: bool,

    /// Other numbers of positions for the front of total time against the criterion
    #[arg(long, value_name = "K", value_delimiter = ',', value_parser = whole::<usize>(POSITIONS))]
    pub front: Vec<usize>,

    /// Search only part I of N of all sequences, however many these are, and write what it finds to the file
    /// of -o (a file here, no folder); an interrupted part goes on when the same command is given again. All
    /// parts are given the same options; --refine, --divide, --front and
    /// --restarts act where the parts are merged, which know the options
    #[arg(long, value_name = "I/N", help_heading = "Parts", value_parser = part, conflicts_with = "minimum")]
    pub part: Option<[usize; 2]>,

    /// With --merge: search N blocks of the parts again, chosen at random, and refuse a part whose block
    /// gives something else (default: 0; a block is at most 16 of the starts)
    #[arg(
        long, value_name = "N", help_heading = "Parts", value_parser = whole::<u64>(CHECKED),
        conflicts_with_all = ["minimum", "part"]
    )]
    pub check: Option<u64>,

    /// True if `certificate.json` is among the files of the answer; on the command line `--certificate` names
    /// the file.
    #[arg(skip)]
    pub certificate: bool,

    /// Requirements on a scheme.
    #[command(flatten)]
    #[serde(flatten)]
    pub wanted: WantedOptions,

    /// Measurement and requirements on sigmas.
    #[command(flatten)]
    #[serde(flatten)]
    pub measurement: MeasurementOptions,

    /// Candidates for the outputs of a model.
    #[command(flatten)]
    #[serde(flatten)]
    pub outputs: MeasureOptions,

    /// Positions to add to a scheme.
    #[command(flatten)]
    #[serde(flatten)]
    pub further: FurtherOptions,
}

/// Requirements on a scheme: observable coefficients, degrees, immunity, criterion, times, gimbals.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[command(next_help_heading = "What is wanted")]
#[serde(default)]
pub struct WantedOptions {
    /// Coefficients or families that must be observable and that the criterion is about, such as D_F,D_IX; of
    /// a model its unknowns (default: all)
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub observable: Vec<String>,

    /// Largest degree, of all required coefficients, or of one, a family or an unknown of a model: 1, D_F=1.
    /// The narrowest name holds: D_FX=2 beside D_F=1
    #[arg(long, value_name = "[NAME=]K")]
    #[serde(with = "text::list")]
    pub max_degree: Vec<DegreeCap>,

    /// Only schemes that are immune to an error or a family that they do not estimate, each of its terms: it
    /// has no effect (K0), or none but one that a record shows at 3 sigma from a size on (K0=20). Exact
    /// classes; the units are those of --bench
    #[arg(long, value_name = "NAME[=X]", value_delimiter = ',')]
    #[serde(with = "text::list")]
    pub immune: Vec<Immune>,

    /// What makes one scheme better; a smaller worst degree comes before it. psi is estimated with the
    /// coefficients but counts in margin and --meet only (default: worst)
    #[arg(long, value_name = "HOW", value_parser = one_of(CRITERIA))]
    pub criterion: Option<CriterionName>,

    /// Only schemes that meet every stated requirement, with --observable every one on those coefficients
    #[arg(long)]
    pub meet: bool,

    /// Largest total time with slews, in s
    #[arg(long, value_name = "S")]
    pub max_time: Option<f64>,

    /// Longest slew between successive positions, in s (with a slew rate)
    #[arg(long, value_name = "S")]
    pub max_slew: Option<f64>,

    /// Positions are reached by rotations at this rate, in deg/s; inertial carry only (default:
    /// instantaneous; 0.001 to 10000 deg/s)
    #[arg(long, value_name = "DEG_S", value_parser = within(SLEW_RATE_DEG_S))]
    pub slew_rate: Option<f64>,

    /// How far a gimbal turns in degrees, as alpha=-90:90, beta=-80:80. alpha is the outer gimbal, about
    /// North, beta the middle one, gamma the inner one, about Z_p. Attitudes beyond are left out; the others
    /// are printed, written and drawn with angles within the limits, those with the shortest gimbal way from
    /// the position before
    #[arg(long, value_name = "ANGLE=LOW:HIGH", allow_hyphen_values = true)]
    pub gimbal: Vec<String>,
}

impl Default for Search {
    /// Request without a number of positions and without `--minimum`.
    fn default() -> Self {
        Self {
            seed: SEED,
            positions: None,
            minimum: false,
            candidates: CARDINAL.into(),
            round: None,
            assumptions: Assumptions::default(),
            terms: TermOptions::default(),
            max_turn: None,
            keep: None,
            restarts: None,
            within: None,
            refine: false,
            divide: false,
            front: Vec::new(),
            part: None,
            check: None,
            certificate: false,
            wanted: WantedOptions::default(),
            measurement: MeasurementOptions::default(),
            outputs: MeasureOptions::default(),
            further: FurtherOptions::default(),
        }
    }
}

impl WantedOptions {
    /// Largest degrees with the names that they are for, each once.
    ///
    /// # Errors
    /// [`Problem`] of a name that is given twice.
    fn degree_caps(&self) -> Result<Vec<(Option<String>, usize)>, Problem> {
        for (i, cap) in self.max_degree.iter().enumerate() {
            if let Some(before) = self.max_degree[..i].iter().find(|c| c.name == cap.name) {
                return Err(Problem::input(format!(
                    "--max-degree {before} and {cap}: given twice; expected one largest degree for each name"
                )));
            }
        }
        Ok(self.max_degree.iter().map(|c| (c.name.clone(), c.cap)).collect())
    }
}

/// Largest degree of one coefficient or family, or of all that are required: `D_F=1`, `1`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DegreeCap {
    /// Coefficient or family; `None` stands for all required coefficients.
    pub name: Option<String>,
    /// Largest degree allowed.
    pub cap: usize,
}

impl fmt::Display for DegreeCap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.name {
            Some(name) => write!(f, "{name}={}", self.cap),
            None => write!(f, "{}", self.cap),
        }
    }
}

impl FromStr for DegreeCap {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, cap) = text.split_once('=').map_or((None, text), |(name, cap)| (Some(name.trim()), cap));
        let cap =
            cap.trim().parse().map_err(|_| format!("expected a degree, as in 1 or D_F=1, found `{text}`"))?;
        Ok(Self { name: name.map(Into::into), cap })
    }
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

/// Files of a search.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SearchFiles {
    /// Scheme whose conditions hold. Its positions are no candidates; their number is the number of positions
    /// by default.
    pub conditions_file: Option<Source>,
    /// Scheme whose positions are the candidates.
    pub candidates_file: Option<Source>,
    /// Parts to merge.
    pub merge: Vec<Source>,
    /// Interrupted part that is continued.
    pub resume: Option<Source>,
    /// The calibration after which further positions are sought.
    pub after: Option<Source>,
}

/// Searches schemes, or sets of outputs of a model.
///
/// # Errors
/// Options that are wrong or have no effect; a search that found nothing.
pub fn design(a: &Search, files: &SearchFiles, host: &Host<'_>) -> Result<Designed, Problem> {
    if let Some(found) = of_model(a, files, host)? {
        return Ok(Designed::Outputs(Box::new(found)));
    }
    if a.further.next.is_some() || files.after.is_some() {
        return Ok(Designed::Next(Box::new(next_positions(a, files, host)?)));
    }
    let asked = known(a, files)?;
    let files = &SearchFiles { merge: files.merge.clone(), ..asked.files(files) };
    let a = &asked.options;
    check_values(a)?;
    let (base, candidates, conditions) = assumed(a, files)?;
    idle(a, !files.merge.is_empty(), &base, &conditions)?;
    let options = design_options(a, candidates)?;
    if a.max_turn.is_some() && !(a.minimum && is_slew_sequence(&base)) {
        return Err(Problem::input(
            "--max-turn is for --minimum with torquer errors (GS, GM, GM3) under inertial carry",
        ));
    }
    if a.minimum && is_slew_sequence(&base) {
        return fewest_positions_of_slew_sequence(a, base, options, host);
    }
    if a.certificate {
        if a.part.is_some() || !files.merge.is_empty() {
            return Err(Problem::input(
                "a certificate is of a search at once; found parts (--part, --merge)",
            ));
        }
        check_certifiable(&base, &conditions, &options)?;
    }
    let parts = files.merge.iter().map(|part| Ok((part.name.clone(), read_part(part)?)));
    let parts: Vec<(String, Part)> = parts.collect::<Result<_, Problem>>()?;
    let progress = |now: Progress| (host.progress)(now.into());
    if let Some(number) = a.part {
        let resumed = files.resume.as_ref().map(read_part).transpose()?;
        let mut done = design_part(&base, &conditions, &options, number, resumed, &progress)?;
        done.asked = Some(Asked::of(a, files)?);
        return Ok(Designed::Part(Box::new(done.sealed())));
    }
    let found = if parts.is_empty() {
        obsdeg_design::design::design(&base, &conditions, &options, &progress)
    } else {
        let check = a.check.map_or(0, |blocks| usize::try_from(blocks).unwrap_or(usize::MAX));
        design_merged(&base, &conditions, &options, &parts, check, &progress)
    }?;
    let certificate =
        a.certificate.then(|| proof(&base, &conditions, &options, &found, &progress)).transpose()?;
    let conditions = asked_conditions(&base, &conditions, &options.required)?;
    Ok(Designed::Schemes(Box::new(Searched { found, base, conditions, certificate })))
}

/// Checks the numbers among the options of a search.
fn check_values(a: &Search) -> Result<(), Problem> {
    match (a.positions, a.minimum) {
        (None, false) => {
            return Err(Problem::input(
                "nothing to search; expected --positions K, --minimum, or a scheme file with as many positions",
            ));
        }
        (Some(_), true) => {
            return Err(Problem::input("found --positions beside --minimum; expected one of them"));
        }
        _ => {}
    }
    if let Some([i, n]) = a.part.filter(|[i, n]| !(1..=*n).contains(i)) {
        return Err(Problem::input(format!("--part {i}/{n}: expected a part such as 2/7")));
    }
    if let Some(within) = a.within.filter(|x| !(0.0..=100.0).contains(x)) {
        return Err(Problem::input(format!("--within {within}: expected 0 to 100 percent")));
    }
    for k in a.positions.iter().chain(&a.front) {
        check_whole("--positions", *k as u64, &POSITIONS)?;
    }
    a.keep.map_or(Ok(()), |keep| check_whole("--keep", keep, &KEPT))?;
    a.restarts.map_or(Ok(()), |restarts| check_whole("--restarts", restarts, &RESTARTS))?;
    a.check.map_or(Ok(()), |blocks| check_whole("--check", blocks, &CHECKED))?;
    Ok(())
}

/// Options of the search itself.
fn design_options(a: &Search, candidates: Candidates) -> Result<DesignOptions, Problem> {
    let round = a.round.as_deref().unwrap_or("5");
    let step = parse_decimal(round.trim()).ok().filter(|step| (1..=90_000_000_000).contains(step));
    let step = step.ok_or_else(|| {
        Problem::input(format!("--round {round}: expected degrees above 0 and up to 90, as in 5"))
    })?;
    Ok(DesignOptions {
        candidates,
        positions: a.positions,
        required: a.wanted.observable.clone(),
        degree_caps: a.wanted.degree_caps()?,
        immune: a.wanted.immune.clone(),
        meet: a.wanted.meet,
        total_s: a.wanted.max_time,
        slew_s: a.wanted.max_slew,
        criterion: a.wanted.criterion.unwrap_or_default(),
        keep: a.keep.unwrap_or(10).into(),
        restarts: a.restarts.unwrap_or(200),
        refine: a.refine,
        divide: a.divide,
        front: a.front.clone(),
        within: a.within.map(|percent| percent / 100.0),
        everywhere: true,
        free: (a.candidates == "free").then_some(step),
        seed: a.seed,
    })
}

/// Further positions of the scheme in a file.
fn next_positions(a: &Search, files: &SearchFiles, host: &Host<'_>) -> Result<NextPositions, Problem> {
    let of_parts = !files.merge.is_empty() || files.resume.is_some();
    let given = stated(a)?;
    let names: Vec<&str> = given.keys().map(String::as_str).chain(of_parts.then_some("merge")).collect();
    let added = check_further(&a.further, &names, files.conditions_file.is_some(), files.after.is_some())?;
    let (base, candidates, conditions) = assumed(a, files)?;
    let options = NextOptions {
        candidates,
        added,
        required: a.wanted.observable.clone(),
        total_s: a.wanted.max_time,
        slew_s: a.wanted.max_slew,
        keep: a.keep.unwrap_or(10).into(),
        beforehand: files.after.as_ref().map(|after| calibrated(after, &base)).transpose()?,
        days: a.further.days.clone(),
        seed: a.seed,
    };
    further(&base, &conditions, &options, host)
}

/// Scheme with the assumptions of the search, candidates, and conditions.
fn assumed(a: &Search, files: &SearchFiles) -> Result<(Scheme, Candidates, Conditions), Problem> {
    let (mut base, candidates) = candidates(&a.candidates, files.candidates_file.as_ref())?;
    if let Some(file) = &files.conditions_file {
        base = file.scheme()?;
        // a dwell that all positions share becomes the default dwell of the scheme
        let mut dwells = base.positions.iter().map(|p| p.dwell.map(|d| d.seconds()));
        let first = dwells.next().flatten();
        if base.simulation.dwell_s.is_none() && dwells.all(|d| d == first) {
            base.simulation.dwell_s = first;
        }
    }
    a.assumptions.apply(&mut base);
    if let Some(terms) = a.terms.unknowns()? {
        base.unknowns = terms;
    }
    for limit in &a.wanted.gimbal {
        base.gimbals.limit(limit).map_err(|e| Problem::input(format!("--gimbal: {e}")))?;
    }
    // the options concern unknowns that every position has
    let any = std::array::from_fn(|_| Angle::from_degrees(0));
    let with_any = Scheme { positions: Scheme::of_angles([any]).positions, ..base.clone() };
    a.measurement.concern(std::iter::once(&with_any))?;
    let mut conditions = a.measurement.conditions(&base);
    conditions.slew_rate_deg_s = a.wanted.slew_rate.or(conditions.slew_rate_deg_s);
    Ok((base, candidates, conditions))
}

/// Options that a search for outputs of a model takes.
const OF_MODELS: [&str; 10] = [
    "seed",
    "keep",
    "observable",
    "max_degree",
    "measure",
    "own_outputs",
    "unique",
    "cost",
    "order",
    "work_limit",
];

/// Sets of outputs, if a model or candidates for its outputs are given; `None` for schemes.
fn of_model(a: &Search, files: &SearchFiles, host: &Host<'_>) -> Result<Option<Sensors>, Problem> {
    let file = files.conditions_file.as_ref();
    let model = file.filter(|file| file.is_model());
    let outputs = &a.outputs;
    if *outputs == MeasureOptions::default() && model.is_none() {
        return Ok(None);
    }
    let Some(file) = file else {
        return Err(Problem::input("nothing to choose outputs of; expected a model file"));
    };
    let given = stated(a)?;
    if let Some(other) = given.keys().find(|name| !OF_MODELS.contains(&name.as_str())) {
        let option = other.replace('_', "-");
        return Err(Problem::input(format!(
            "--{option} is about schemes; outputs of a model are chosen by --measure"
        )));
    }
    a.keep.map_or(Ok(()), |keep| check_whole("--keep", keep, &KEPT))?;
    let wanted = SetRequirements {
        required: &a.wanted.observable,
        max_degree: a.wanted.degree_caps()?,
        keep: a.keep.unwrap_or(10).into(),
        seed: a.seed,
    };
    measured(outputs, &wanted, file, host).map(Some)
}

/// Certificate of a proven optimum, as a file.
fn proof(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    found: &Design,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<File, Problem> {
    let certificate = certify_optimum(base, conditions, options, found, progress)?;
    // one block per line
    let text = serde_json::to_string(&certificate).map_err(no_json)?.replace("{\"start\"", "\n{\"start\"");
    Ok(File { name: "certificate.json".into(), bytes: (text + "\n").into_bytes() })
}

/// Options and files of a part, as its file keeps them for the merge.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Asked {
    options: Search,
    conditions_file: Option<Source>,
    candidates_file: Option<Source>,
}

impl Asked {
    /// Options and files as JSON text, without options that have their default.
    fn of(a: &Search, files: &SearchFiles) -> Result<String, Problem> {
        let mut asked = serde_json::Map::new();
        asked.insert("options".into(), Value::Object(stated(&Search { part: None, ..a.clone() })?));
        let of_files =
            [("conditions_file", &files.conditions_file), ("candidates_file", &files.candidates_file)];
        for (name, file) in of_files {
            if let Some(file) = file {
                asked.insert(name.into(), serde_json::to_value(file).map_err(no_json)?);
            }
        }
        Ok(Value::Object(asked).to_string())
    }

    /// Given files, else those of the part.
    fn files(&self, given: &SearchFiles) -> SearchFiles {
        SearchFiles {
            conditions_file: given.conditions_file.clone().or_else(|| self.conditions_file.clone()),
            candidates_file: given.candidates_file.clone().or_else(|| self.candidates_file.clone()),
            merge: Vec::new(),
            resume: given.resume.clone(),
            after: None,
        }
    }
}

fn no_json(e: serde_json::Error) -> Problem {
    Problem::internal(e.to_string())
}

/// Options without those that have their default, as JSON.
fn stated(a: &Search) -> Result<serde_json::Map<String, Value>, Problem> {
    let object = |a: &Search| serde_json::to_value(a).map_err(no_json);
    let (all, none) = (object(a)?, object(&Search::default())?);
    let differs = |(name, value): &(&String, &Value)| none.get(name) != Some(value);
    Ok(all.as_object().into_iter().flatten().filter(differs).map(|(n, v)| (n.clone(), v.clone())).collect())
}

/// Options and files of a search. At a merge: those of the parts, overridden by the given options. For a
/// scheme file alone: as many positions as it has.
fn known(a: &Search, files: &SearchFiles) -> Result<Asked, Problem> {
    let mut asked = Asked { options: a.clone(), ..Asked::default() };
    if let Some(first) = files.merge.first()
        && let Some(of_part) = read_part(first)?.asked
    {
        let wrong = |e: serde_json::Error| Problem::input(format!("{}: its options: {e}", first.name));
        asked = serde_json::from_str(&of_part).map_err(wrong)?;
        let mut options = stated(&asked.options)?;
        options.extend(stated(a)?);
        asked.options = serde_json::from_value(Value::Object(options)).map_err(no_json)?;
    }
    if let (None, false, Some(file)) =
        (asked.options.positions, asked.options.minimum, &files.conditions_file)
    {
        asked.options.positions = Some(file.scheme()?.positions.len());
    }
    Ok(asked)
}

/// Refuses options that would have no effect; the message names the option that they need.
fn idle(a: &Search, merged: bool, base: &Scheme, conditions: &Conditions) -> Result<(), Problem> {
    let (w, free) = (&a.wanted, a.candidates == "free");
    if a.minimum {
        idle_with_minimum(a)?;
    }
    let others = [
        ("--check", a.check.is_some() && !merged, "--merge with it, whose parts are checked"),
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
            "--within",
            a.within.is_some_and(|within| within > 0.0) && (a.part.is_some() || merged),
            "a search that is not in parts; these are of all sequences, as with --within 0",
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
            Err(Problem::input(format!("{option} does nothing here: expected {needed}")))
        }
        None => Ok(()),
    }
}

/// Refuses options that concern a number of positions beside `--minimum`.
fn idle_with_minimum(a: &Search) -> Result<(), Problem> {
    let w = &a.wanted;
    let of_positions = [
        ("--keep", a.keep.is_some()),
        ("--restarts", a.restarts.is_some()),
        ("--within", a.within.is_some()),
        ("--refine", a.refine),
        ("--divide", a.divide),
        ("--front", !a.front.is_empty()),
        ("--round", a.round.is_some()),
        ("--max-degree", !w.max_degree.is_empty()),
        ("--immune", !w.immune.is_empty()),
        ("--criterion", w.criterion.is_some()),
        ("--meet", w.meet),
        ("--max-time", w.max_time.is_some()),
        ("--max-slew", w.max_slew.is_some()),
        ("--slew-rate", w.slew_rate.is_some()),
    ];
    let given = of_positions.into_iter().filter_map(|(option, given)| given.then_some(option));
    if let Some(option) = given.chain(a.measurement.given()).next() {
        return Err(Problem::input(format!(
            "{option} does nothing with --minimum, which asks what positions determine at all, by any \
             degree and with any noise; it is for --positions"
        )));
    }
    Ok(())
}

/// Reads a part of a search; refuses a file that was changed after it was written.
fn read_part(part: &Source) -> Result<Part, Problem> {
    let named = |why: String| Problem::input(format!("{}: {why}", part.name));
    let read: Part = serde_json::from_str(&part.text).map_err(|e| {
        let expected = "expected the file that `obsdeg design --part` wrote";
        named(format!("it is no part of a search ({e}); {expected}"))
    })?;
    read.unchanged().map_err(|why| named(why.to_string()))?;
    Ok(read)
}

/// Fewest positions where the slew path between them counts.
fn fewest_positions_of_slew_sequence(
    a: &Search,
    base: Scheme,
    options: DesignOptions,
    host: &Host<'_>,
) -> Result<Designed, Problem> {
    if !base.gimbals.are_free() {
        let text = "--gimbal is not taken where torquer errors make a scheme a walk; expected --max-turn, --observable";
        return Err(Problem::input(text));
    }
    let options = SlewSequenceOptions {
        candidates: options.candidates,
        required: options.required,
        most_turn_deg: a.max_turn.unwrap_or(90.0),
        seed: options.seed,
    };
    let found =
        shortest_slew_sequence(&base, &options, &|| (host.progress)(Now::of("searching walks", 0, 1)))?;
    Ok(Designed::SlewSequence(Box::new(SearchedSlewSequence { found, base })))
}

/// Default of `--candidates`.
const CARDINAL: &str = "cardinal";

/// Candidates, and the scheme whose assumptions hold.
fn candidates(text: &str, file: Option<&Source>) -> Result<(Scheme, Candidates), Problem> {
    if let Some(file) = file {
        let scheme = file.scheme()?;
        let candidates = Candidates::of_scheme(&scheme)?;
        return Ok((scheme, candidates));
    }
    if text == CARDINAL {
        return Ok((Scheme::default(), Candidates::cardinals()));
    }
    if text == "free" {
        // grid from which the search for free attitudes starts
        return Ok((Scheme::default(), Candidates::grid(45_000_000_000)?));
    }
    if let Some(step) = text.strip_prefix("grid:") {
        let wrong =
            || Problem::input(format!("--candidates {text}: expected a step in degrees, as in grid:45"));
        let step = parse_decimal(step.trim()).map_err(|_| wrong())?;
        return Ok((Scheme::default(), Candidates::grid(step)?));
    }
    Err(Problem::input(format!(
        "--candidates {text}: there is no such file; expected cardinal, free, a grid such as grid:45, or a \
         scheme file that exists"
    )))
}

/// True if `--candidates` is one of its words and not the path of a file.
pub fn is_word(candidates: &str) -> bool {
    candidates == CARDINAL || candidates == "free" || candidates.starts_with("grid:")
}

//! Options of `obsdeg design`, as arguments and in JSON.

use std::ops::RangeInclusive;

use clap::{ArgGroup, Args};
use obsdeg_core::model::ranges::{SLEW_RATE_DEG_S, TURN_DEG};
use obsdeg_design::DegreeCap;
use obsdeg_design::design::{CriterionName, Immune};
use serde::{Deserialize, Serialize};

use crate::arguments::{ANY, Assumptions, SEED, TermOptions, Word, WordOr, one_of, whole};
use crate::conditions::{MeasurementOptions, within};
use crate::measure::MeasureOptions;
use crate::next::FurtherOptions;
use crate::problem::Problem;
use crate::source::Source;
use crate::text;

/// Range of the number of positions.
pub(super) const POSITIONS: RangeInclusive<u64> = 1..=100;

/// Range of the number of listed schemes.
pub(super) const KEPT: RangeInclusive<u64> = 1..=1000;

/// Range of the number of blocks that are searched again.
pub(super) const CHECKED: RangeInclusive<u64> = 0..=1_000_000_000;

/// Range of the number of restarts of the exchange.
pub(super) const RESTARTS: RangeInclusive<u64> = 1..=1_000_000;

/// Default of `--candidates`.
pub(super) const CARDINAL: &str = "cardinal";

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

    /// Candidates to choose from, or a scheme file: its positions; without SCHEME with carry, latitude,
    /// geometry, terms, conditions and gimbal limits of the file
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

    /// Number of schemes, or of sets of outputs, that are listed (default: 10)
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

    /// Criterion by which a scheme is better; a smaller worst degree comes before it. psi is estimated with
    /// the coefficients but counts in margin and --meet only (default: worst)
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

    /// Range of the angle of a gimbal in degrees, as alpha=-90:90, beta=-80:80. alpha is the outer gimbal,
    /// about North, beta the middle one, gamma the inner one, about Z_p. Attitudes beyond are left out; the
    /// others are printed, written and drawn with angles within the limits, those with the shortest gimbal
    /// way from the position before
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
    pub(super) fn degree_caps(&self) -> Result<Vec<DegreeCap>, Problem> {
        for (i, cap) in self.max_degree.iter().enumerate() {
            if let Some(before) = self.max_degree[..i].iter().find(|c| c.name == cap.name) {
                return Err(Problem::input(format!(
                    "--max-degree {before} and {cap}: given twice; expected one largest degree for each name"
                )));
            }
        }
        Ok(self.max_degree.clone())
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

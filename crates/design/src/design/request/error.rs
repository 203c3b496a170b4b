//! Why no scheme is found.

use obsdeg_core::degree::EnsembleError;
use obsdeg_core::model::SchemeError;
use obsdeg_ekf::EkfError;
use obsdeg_evidence::simulation::SimulationError;

use crate::design::nearest::Nearest;
use crate::design::request::limits::{MAX_CANDIDATES, MAX_TURNING, MAX_UNKNOWNS, MOST_EXTENSIONS};

/// Why no scheme is found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// Nothing to choose from, or too much.
    #[error("{found} candidates; expected at least one and at most {MAX_CANDIDATES}")]
    Candidates {
        /// Their number.
        found: usize,
    },
    /// Too many turns between candidates.
    #[error("{found} candidates with slews; expected at most {}", MAX_TURNING)]
    Pairs {
        /// Their number.
        found: usize,
    },
    /// Steps that do not fit.
    #[error("a grid of {found} degrees; expected a step that divides 90 degrees, as in grid:45")]
    Grid {
        /// The step.
        found: String,
    },
    /// A number of positions that cannot be.
    #[error("{found} positions; expected 1 to 100")]
    Positions {
        /// The number asked for.
        found: usize,
    },
    /// A number of added positions that is not compared.
    #[error("{found} more positions; expected 1 or 2")]
    Added {
        /// The number asked for.
        found: usize,
    },
    /// Too many extensions of a scheme.
    #[error(
        "{found} extensions or more; expected at most {}: fewer candidates, or one more position",
        MOST_EXTENSIONS
    )]
    Extensions {
        /// Their number.
        found: usize,
    },
    /// Ageing without a calibration.
    #[error("days are counted from a calibration; expected one beforehand")]
    NoCalibration,
    /// No extension keeps the limits.
    #[error("no extension by the candidates keeps the limits: {limits}")]
    NoExtension {
        /// The limits, in words.
        limits: String,
    },
    /// The drift itself is constant at one position only.
    #[error("a design needs coefficients; found the unknowns `drift` (use terms such as F,I,O,S)")]
    Drift,
    /// A rotating segment has no place among candidates.
    #[error("a design chooses among positions; found the rotating segment `{name}`")]
    Rotation {
        /// The segment.
        name: String,
    },
    /// A generic angle has no sigma.
    #[error("the angle `{name}` is generic; expected numbers for a design")]
    GenericAngle {
        /// Its name.
        name: String,
    },
    /// No certificate of an optimum covers the search or its answer.
    #[error(
        "no certificate: found {found}; certificates of optima cover an exhaustive search that proves the best sequence of given candidates, \
         equal dwells, repositioning at once, white noise of Z and nothing known beforehand"
    )]
    NoCertificate {
        /// Part of the search that is not covered.
        found: String,
    },
    /// A name that is no coefficient.
    #[error("`{found}` is no coefficient of this scheme; expected some of {known}, or families such as D_F")]
    UnknownName {
        /// The name found.
        found: String,
        /// The coefficients.
        known: String,
    },
    /// A name that is no error of this scheme.
    #[error(
        "immune to `{found}`: no error that this scheme does not estimate has this name; expected some such as K0, M, latitude"
    )]
    Immune {
        /// The name found.
        found: String,
    },
    /// A size from which on double precision does not tell whether a record shows an error.
    #[error(
        "immune to `{found}`: beyond {most:.3e} {unit} a search does not tell an error that a record hardly shows from one that none shows; \
         expected a smaller size"
    )]
    ImmuneSize {
        /// The error with its size.
        found: String,
        /// Largest size, in `unit`.
        most: f64,
        /// Unit of the size.
        unit: &'static str,
    },
    /// Turns that take time are about one axis here.
    #[error(
        "design evaluates turns about one axis; found path = \"gimbals\" with turns that take time: leave one of them out"
    )]
    GimbalPath,
    /// Requirements decide, and none is stated.
    #[error(
        "{what} needs a requirement, and none is stated on what must be observable; expected --requirement NAME=SIGMA (as in --requirement D=0.05 for all drift \
         coefficients, psi=0.01 for psi), or [requirements] in a scheme file"
    )]
    NoRequirement {
        /// The option that needs it.
        what: &'static str,
    },
    /// Positions are what is searched for.
    #[error(
        "the {what} for `{found}` is that of one position; expected psi, psi_x, psi_y or psi_z, for every position"
    )]
    OnePosition {
        /// A requirement or a prior.
        what: &'static str,
        /// The name found.
        found: String,
    },
    /// A limit that cannot be.
    #[error("{what} of {found} s; expected more than 0")]
    Limit {
        /// What is limited.
        what: &'static str,
        /// The number found.
        found: f64,
    },
    /// Too many coefficients.
    #[error("{found} unknowns; expected at most {}", MAX_UNKNOWNS)]
    TooManyUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// No sequence of that many candidates is what is wanted.
    #[error("no scheme of {positions} of these candidates {wanted}: {why}")]
    Impossible {
        /// The number of positions.
        positions: usize,
        /// What is wanted, with all limits.
        wanted: String,
        /// What is missed, or how that is known.
        why: String,
    },
    /// Of those that were looked at, no sequence is what is wanted.
    #[error(
        "no scheme found: none of the {examined} sequences of {positions} of these candidates that were looked at {wanted}; there are too many to look at all"
    )]
    NotFound {
        /// The number of positions.
        positions: usize,
        /// What is wanted, with all limits.
        wanted: String,
        /// How many were looked at.
        examined: u64,
    },
    /// No scheme meets every requirement.
    #[error("{why}\n{nearest}")]
    NotMet {
        /// Evidence that no scheme meets every requirement.
        why: Box<DesignError>,
        /// Changes that would meet every requirement.
        nearest: Box<Nearest>,
    },
    /// Parts of no exhaustive search.
    #[error("parts are of a search for so many positions of given candidates; expected these")]
    Parts,
    /// A part that is none.
    #[error("part {} of {}; expected 1 of 1 or more, as in 2/7", .found[0], .found[1])]
    PartNumber {
        /// Which of how many.
        found: [usize; 2],
    },
    /// A part that is not taken.
    #[error("{name}: {why}")]
    Part {
        /// Its name.
        name: String,
        /// Why.
        why: PartError,
    },
    /// Parts that are not there.
    #[error("missing of {of} parts: {}", listed(.missing))]
    MissingParts {
        /// Their numbers.
        missing: Vec<usize>,
        /// How many there are.
        of: usize,
    },
    /// More sequences than an exhaustive search takes, in parts or not.
    #[error(
        "all sequences of {positions} of {candidates} candidates are too many for an exhaustive search, in parts too"
    )]
    TooMany {
        /// The number of positions.
        positions: usize,
        /// The number of candidates.
        candidates: usize,
    },
    /// Attitudes chosen freely where nothing says which.
    #[error(
        "free attitudes are chosen for a number of positions under reset carry, where information adds; found {found}"
    )]
    Free {
        /// What was found.
        found: String,
    },
    /// Stopped before anything was found.
    #[error("interrupted before anything was found")]
    Interrupted,
    /// The scheme.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// Conditions that do not go together.
    #[error(transparent)]
    Conditions(#[from] SimulationError),
    /// No verdict.
    #[error(transparent)]
    Verdict(#[from] EnsembleError),
    /// No turn, or too many, between candidates whose way counts.
    #[error(
        "{found} turns between candidates; expected 1 to {most}: take a larger or smaller --max-turn, or other candidates"
    )]
    Turns {
        /// Their number.
        found: usize,
        /// The most.
        most: usize,
    },
    /// What is searched over sets only.
    #[error(
        "torquer errors act on the way between positions, so schemes are walks: found {found}; expected slews that take time (--slew-rate), about one \
         axis, between cardinal attitudes, by exchange (no --refine, --divide, --part, or cap of degrees); --minimum finds the fewest positions"
    )]
    Walks {
        /// What is not of walks.
        found: String,
    },
    /// No sigma is the largest of several units.
    #[error(
        "{criterion} compares sigmas in one unit, but {units} are required; expected criterion margin (over requirements), or D (their geometric mean), or \
         --observable with coefficients of one unit: the others are estimated with them"
    )]
    Units {
        /// The criterion.
        criterion: &'static str,
        /// An example of every unit.
        units: String,
    },
    /// A number is not finite.
    #[error(transparent)]
    Filter(#[from] EkfError),
}

/// Why a part is not taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PartError {
    /// No part at all.
    #[error("it is no part of a search: {why}")]
    Layout {
        /// What is wrong.
        why: String,
    },
    /// Changed after it was written.
    #[error("it was changed after it was written: its contents do not have the digest in its field `seal`")]
    Changed,
    /// Counts that no search of its starts gives.
    #[error("its counts do not add up: {why}")]
    Counts {
        /// Which of them.
        why: String,
    },
    /// Listed sequence that no search of its starts lists.
    #[error("it lists {sequence}: {why}")]
    Listed {
        /// Names of the candidates, or their indices.
        sequence: String,
        /// What is wrong.
        why: String,
    },
    /// Searched again, with another result.
    #[error("its starts {} to {} (from 0) were searched again, and {why}", .starts[0], .starts[1].saturating_sub(1))]
    Block {
        /// Index of the first start, index behind the last.
        starts: [usize; 2],
        /// What differs.
        why: String,
    },
    /// Of other inputs.
    #[error("it is a part of another search: {why}")]
    Foreign {
        /// Which inputs differ.
        why: String,
    },
    /// Divided otherwise.
    #[error("it is part {} of {}; expected a part of {expected}", .found[0], .found[1])]
    Division {
        /// Which part it is.
        found: [usize; 2],
        /// How many there are.
        expected: usize,
    },
    /// Another number.
    #[error("it is part {} of {}; expected part {} of {}", .found[0], .found[1], .expected[0], .expected[1])]
    Number {
        /// Which part it is.
        found: [usize; 2],
        /// Which part is asked for.
        expected: [usize; 2],
    },
    /// Other starts than its number has.
    #[error("it has the starts {found:?}; part {} of {} has {expected:?}", .part[0], .part[1])]
    Starts {
        /// Its starts.
        found: [usize; 3],
        /// Those of its number.
        expected: [usize; 3],
        /// Which part it is.
        part: [usize; 2],
    },
    /// Not done.
    #[error("part {} of {} was interrupted; the command that wrote it goes on with it", .part[0], .part[1])]
    Unfinished {
        /// Which part it is.
        part: [usize; 2],
    },
    /// Given twice.
    #[error("part {} of {} is in {other} too", .part[0], .part[1])]
    Doubled {
        /// Which part it is.
        part: [usize; 2],
        /// Where else.
        other: String,
    },
}

/// `2, 5`: at most twenty numbers.
fn listed(numbers: &[usize]) -> String {
    const SHOWN: usize = 20;
    let shown: Vec<String> = numbers.iter().take(SHOWN).map(ToString::to_string).collect();
    let more = numbers.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

//! Errors of a design.

use obsdeg_core::degree::EnsembleError;
use obsdeg_core::model::SchemeError;
use obsdeg_ekf::EkfError;
use obsdeg_evidence::simulation::SimulationError;

use crate::design::nearest::Nearest;
use crate::design::request::limits::{MAX_CANDIDATES, MAX_TURNING, MAX_UNKNOWNS, MOST_EXTENSIONS};

/// Error of a design.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// No candidates, or too many.
    #[error("{found} candidates; expected at least one and at most {MAX_CANDIDATES}")]
    Candidates {
        /// Number of candidates.
        found: usize,
    },
    /// Too many candidates where turns take time.
    #[error("{found} candidates with slews; expected at most {}", MAX_TURNING)]
    Pairs {
        /// Number of candidates.
        found: usize,
    },
    /// Grid step that does not divide 90 degrees.
    #[error("a grid of {found} degrees; expected a step that divides 90 degrees, as in grid:45")]
    Grid {
        /// Step in degrees.
        found: String,
    },
    /// Number of positions beyond the range 1 to 100.
    #[error("{found} positions; expected 1 to 100")]
    Positions {
        /// Number of positions that was asked for.
        found: usize,
    },
    /// Number of added positions other than 1 and 2.
    #[error("{found} more positions; expected 1 or 2")]
    Added {
        /// Number of added positions that was asked for.
        found: usize,
    },
    /// More extensions of a scheme than are compared.
    #[error(
        "{found} extensions or more; expected at most {}: fewer candidates, or one more position",
        MOST_EXTENSIONS
    )]
    Extensions {
        /// Number of extensions, or a lower bound on it.
        found: usize,
    },
    /// Number of days without a calibration from which they count.
    #[error("days are counted from a calibration; expected one beforehand")]
    NoCalibration,
    /// No extension within the limits of time.
    #[error("no extension by the candidates keeps the limits: {limits}")]
    NoExtension {
        /// Limits, in words.
        limits: String,
    },
    /// Unknown `drift` in place of coefficients: the drift is constant at a single position only.
    #[error("a design needs coefficients; found the unknowns `drift` (use terms such as F,I,O,S)")]
    Drift,
    /// Rotating segment among the candidates.
    #[error("a design chooses among positions; found the rotating segment `{name}`")]
    Rotation {
        /// Name of the segment.
        name: String,
    },
    /// Generic angle: it has no sigma.
    #[error("the angle `{name}` is generic; expected numbers for a design")]
    GenericAngle {
        /// Name of the angle.
        name: String,
    },
    /// No certificate of an optimum covers the search or its answer.
    #[error(
        "no certificate: found {found}; certificates of optima cover an exhaustive search that proves the \
         best sequence of given candidates, equal dwells, repositioning at once, white noise of Z and \
         nothing known beforehand"
    )]
    NoCertificate {
        /// Part of the search that is not covered.
        found: String,
    },
    /// Name that is no coefficient.
    #[error("`{found}` is no coefficient of this scheme; expected some of {known}, or families such as D_F")]
    UnknownName {
        /// Name that was found.
        found: String,
        /// Names of the coefficients.
        known: String,
    },
    /// Name that is no error of this scheme.
    #[error(
        "immune to `{found}`: no error that this scheme does not estimate has this name; expected some such \
         as K0, M, latitude"
    )]
    Immune {
        /// Name that was found.
        found: String,
    },
    /// Size at which double precision cannot decide whether a record shows an error.
    #[error(
        "immune to `{found}`: beyond {most:.3e} {unit} a search does not tell an error that a record hardly \
         shows from one that none shows; expected a smaller size"
    )]
    ImmuneSize {
        /// Error with its size.
        found: String,
        /// Largest size that can be decided, in `unit`.
        most: f64,
        /// Unit of the size.
        unit: &'static str,
    },
    /// Turns along gimbal paths that take time: a design evaluates turns about one axis only.
    #[error(
        "design evaluates turns about one axis; found path = \"gimbals\" with turns that take time: leave \
         one of them out"
    )]
    GimbalPath,
    /// Option that needs a requirement, with none stated.
    #[error(
        "{what} needs a requirement, and none is stated on what must be observable; expected --requirement \
         NAME=SIGMA (as in --requirement D=0.05 for all drift coefficients, psi=0.01 for psi), or \
         [requirements] in a scheme file"
    )]
    NoRequirement {
        /// Option that needs a requirement.
        what: &'static str,
    },
    /// Requirement or prior on a single position: a design searches for the positions.
    #[error(
        "the {what} for `{found}` is that of one position; expected psi, psi_x, psi_y or psi_z, for every position"
    )]
    OnePosition {
        /// Kind of statement: requirement or prior.
        what: &'static str,
        /// Name that was found.
        found: String,
    },
    /// Time limit that is not positive.
    #[error("{what} of {found} s; expected more than 0")]
    Limit {
        /// Limited quantity.
        what: &'static str,
        /// Limit that was found, in s.
        found: f64,
    },
    /// Too many unknowns.
    #[error("{found} unknowns; expected at most {}", MAX_UNKNOWNS)]
    TooManyUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// Search that proves that no sequence of these candidates is sufficient.
    #[error("no scheme of {positions} of these candidates {wanted}: {why}")]
    Impossible {
        /// Number of positions.
        positions: usize,
        /// Requirements on the scheme in words, with all limits.
        wanted: String,
        /// Reason or proof.
        why: String,
    },
    /// Search by exchange that found no sufficient sequence.
    #[error(
        "no scheme found: none of the {examined} sequences of {positions} of these candidates that were \
         looked at {wanted}; there are too many to look at all"
    )]
    NotFound {
        /// Number of positions.
        positions: usize,
        /// Requirements on the scheme in words, with all limits.
        wanted: String,
        /// Number of sequences examined.
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
    /// Parts of a search that is not exhaustive.
    #[error("parts are of a search for so many positions of given candidates; expected these")]
    Parts,
    /// Part number out of range.
    #[error("part {} of {}; expected 1 of 1 or more, as in 2/7", .found[0], .found[1])]
    PartNumber {
        /// Number of the part, then number of parts.
        found: [usize; 2],
    },
    /// Part that is refused.
    #[error("{name}: {why}")]
    Part {
        /// Name of the part.
        name: String,
        /// Reason for the refusal.
        why: PartError,
    },
    /// Missing parts.
    #[error("missing of {of} parts: {}", listed(.missing))]
    MissingParts {
        /// Numbers of the missing parts.
        missing: Vec<usize>,
        /// Number of all parts.
        of: usize,
    },
    /// Too many sequences for an exhaustive search, in parts or not.
    #[error(
        "all sequences of {positions} of {candidates} candidates are too many for an exhaustive search, in parts too"
    )]
    TooMany {
        /// Number of positions.
        positions: usize,
        /// Number of candidates.
        candidates: usize,
    },
    /// Free attitudes outside their scope: a number of positions under reset carry.
    #[error(
        "free attitudes are chosen for a number of positions under reset carry, where information adds; found {found}"
    )]
    Free {
        /// Conflicting input.
        found: String,
    },
    /// Interruption before any result.
    #[error("interrupted before anything was found")]
    Interrupted,
    /// Error of the scheme.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// Conditions that contradict each other.
    #[error(transparent)]
    Conditions(#[from] SimulationError),
    /// Verdict that cannot be reached.
    #[error(transparent)]
    Verdict(#[from] EnsembleError),
    /// No turn between candidates, or too many, where torquer errors act in turns.
    #[error(
        "{found} turns between candidates; expected 1 to {most}: take a larger or smaller --max-turn, or \
         other candidates"
    )]
    Turns {
        /// Number of turns.
        found: usize,
        /// Largest number of turns.
        most: usize,
    },
    /// Option that does not apply where torquer errors act in turns.
    #[error(
        "torquer errors act on the way between positions, so schemes are walks: found {found}; expected \
         slews that take time (--slew-rate), about one axis, between cardinal attitudes, by exchange (no \
         --refine, --divide, --part, or cap of degrees); --minimum finds the fewest positions"
    )]
    SlewSequences {
        /// Option or input that does not apply.
        found: String,
    },
    /// Criterion that compares sigmas in several units.
    #[error(
        "{criterion} compares sigmas in one unit, but {units} are required; expected criterion margin (over \
         requirements), or D (their geometric mean), or --observable with coefficients of one unit: the \
         others are estimated with them"
    )]
    Units {
        /// Name of the criterion.
        criterion: &'static str,
        /// Example of every unit.
        units: String,
    },
    /// Number that is not finite.
    #[error(transparent)]
    Filter(#[from] EkfError),
}

/// Reason to refuse a part.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PartError {
    /// File that is not a part.
    #[error("it is no part of a search: {why}")]
    Layout {
        /// Fault of the file.
        why: String,
    },
    /// Contents that do not match the seal.
    #[error("it was changed after it was written: its contents do not have the digest in its field `seal`")]
    Changed,
    /// Counts that no search of these starts gives.
    #[error("its counts do not add up: {why}")]
    Counts {
        /// Counts that do not add up.
        why: String,
    },
    /// Listed sequence that no search of these starts lists.
    #[error("it lists {sequence}: {why}")]
    Listed {
        /// Names of the candidates, or their indices.
        sequence: String,
        /// Fault of the sequence.
        why: String,
    },
    /// Block whose repeated search has another result.
    #[error("its starts {} to {} (from 0) were searched again, and {why}", .starts[0], .starts[1].saturating_sub(1))]
    Block {
        /// Index of the first start, then index behind the last.
        starts: [usize; 2],
        /// Difference between the results.
        why: String,
    },
    /// Part of a search with other inputs.
    #[error("it is a part of another search: {why}")]
    Foreign {
        /// Inputs that differ.
        why: String,
    },
    /// Part of another number of parts.
    #[error("it is part {} of {}; expected a part of {expected}", .found[0], .found[1])]
    Division {
        /// Number of the part, then number of parts.
        found: [usize; 2],
        /// Expected number of parts.
        expected: usize,
    },
    /// Part with another number than expected.
    #[error("it is part {} of {}; expected part {} of {}", .found[0], .found[1], .expected[0], .expected[1])]
    Number {
        /// Number of the part, then number of parts.
        found: [usize; 2],
        /// Expected number of the part, then of parts.
        expected: [usize; 2],
    },
    /// Starts that are not those of the part number.
    #[error("it has the starts {found:?}; part {} of {} has {expected:?}", .part[0], .part[1])]
    Starts {
        /// Starts that were found: first, behind the last, number of all.
        found: [usize; 3],
        /// Expected starts: first, behind the last, number of all.
        expected: [usize; 3],
        /// Number of the part, then number of parts.
        part: [usize; 2],
    },
    /// Part that was interrupted.
    #[error("part {} of {} was interrupted; the command that wrote it goes on with it", .part[0], .part[1])]
    Unfinished {
        /// Number of the part, then number of parts.
        part: [usize; 2],
    },
    /// Part that is given twice.
    #[error("part {} of {} is in {other} too", .part[0], .part[1])]
    Doubled {
        /// Number of the part, then number of parts.
        part: [usize; 2],
        /// Name of the other file with this part.
        other: String,
    },
}

/// Text `2, 5`, at most twenty numbers.
fn listed(numbers: &[usize]) -> String {
    const SHOWN: usize = 20;
    let shown: Vec<String> = numbers.iter().take(SHOWN).map(ToString::to_string).collect();
    let more = numbers.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

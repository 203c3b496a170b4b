//! Finding schemes: the fewest positions, and the best of a number of positions.
//!
//! Sets of candidates are first judged exactly (`observable`). Sequences of those that make the required
//! coefficients observable, in every order where the carry makes order matter and by both paths of half turns
//! (`measure::slews`), are then ranked (`search`): constraints first, then the worst degree, then a criterion
//! of optimal design (`measure`), up to turns of the platform axes (`observable::symmetry`).

pub(crate) mod answer;
mod certificate;
mod measure;
mod nearest;
mod observable;
mod polish;
mod request;
mod run;
mod search;

pub use answer::*;
pub use certificate::{Bound, Everywhere, ListedWeights, WeightedAttitude};
pub use measure::criterion::{Criterion, SigmaLimits};
pub use measure::evaluator::{Evaluator, SequenceState};
pub use measure::stop::Stop;
pub use nearest::{Nearest, TriedCandidates};
pub use observable::rows::{AttitudeRows, EnumerationLimits};
pub use observable::slew_sequences::{
    ShortestSlewSequence, SlewSequenceOptions, is_slew_sequence, scheme_of_slew_sequence,
    shortest_slew_sequence,
};
pub use observable::symmetry::CandidateSymmetry;
pub use request::candidates::Candidates;
pub use request::error::{DesignError, PartError};
pub(crate) use request::limits::MOST_EXTENSIONS;
pub use request::options::{CriterionName, DesignOptions, Immune};
pub use run::driver::design;
pub use run::merged::design_merged;
pub use run::optimum::{
    BestSequence, OptimumCertificate, OptimumProblem, RequiredCoefficient, SequenceBlock, certify_optimum,
    check_certifiable,
};
pub use run::part::{Block, Level, Part, design_part, design_starts};
pub use run::task::asked;
pub use run::winner::scheme as scheme_found;
pub(crate) use run::winner::{half_turn, under};
pub use search::best::Best;
pub use search::constraints::Constraints;
pub use search::progress::Progress;
pub use search::score::{Score, Scored};
pub use search::scoring::SequenceSearch;
pub use search::ties::Ties;

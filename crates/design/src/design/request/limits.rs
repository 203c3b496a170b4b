//! Limits of a search.

/// Largest number of candidates.
pub(crate) const MAX_CANDIDATES: usize = 1000;
/// Largest number of candidates if turns between them take time.
pub(crate) const MAX_TURNING: usize = 256;
/// Largest number of unknowns of a search: psi and the coefficients of all terms.
pub(crate) const MAX_UNKNOWNS: usize = 66;
/// Number of unknowns, psi and drifts, up to which a search takes smaller arrays.
pub(crate) const MAX_DRIFTS: usize = 33;
/// Largest number of sequences, up to symmetry, that are searched exhaustively.
pub(crate) const EXHAUSTIVE: u64 = 50_000_000;
/// Most extensions of a scheme that are compared.
pub(crate) const MOST_EXTENSIONS: usize = 20_000;
/// Number of sequences above which an incumbent is searched first (branch and bound).
pub(crate) const MANY: u64 = 1_000_000;
/// Number of sequences, under reset carry, up to which all are searched whatever a bound says.
pub(crate) const QUICK: u64 = 2_000_000;
/// Largest error probability of a result that is called proven.
pub(crate) const PROOF: f64 = 1e-12;

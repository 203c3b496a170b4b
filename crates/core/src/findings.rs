//! Findings of a scheme: degrees, accuracy orders, sparse combinations and null vectors, exact and typed. An
//! analysis puts them into words; a prediction computes with them.

use obsdeg_symbolic::Worker;

use crate::accuracy::{Accuracy, AccuracyError};
use crate::degree::ensemble::{EnsembleError, Verdicts, judge};
use crate::degree::filtration::partners;
use crate::degree::findings::{ByPrimes, Findings};
use crate::degree::status::{Status, Verdict};
use crate::model::scheme::MAX_UNKNOWNS;
use crate::model::{Platform, SchemeError};
use crate::solution::combinations::{NullVector, combinations, null_space};
use crate::solution::requested::{CombinationError, Requested, requested_combinations};
use crate::solution::solver::{Frame, Functional, Solver};

/// Reasons for the lack of findings.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AnalysisError {
    /// The scheme cannot be analysed.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// The verdicts could not be reached.
    #[error(transparent)]
    Verdict(#[from] EnsembleError),
    /// A combination is no linear combination of the unknowns.
    #[error(transparent)]
    Combination(#[from] CombinationError),
}

/// Judged scheme, from which everything else is computed.
pub struct JudgedScheme<'a> {
    /// Platform of the scheme.
    pub platform: &'a Platform,
    /// Verdicts, with the random values and bases behind them.
    pub verdicts: Verdicts,
    requested: Vec<Requested>,
    seed: u64,
}

/// Findings of a scheme.
pub struct SchemeFindings {
    /// Verdicts on the unknowns and on the requested combinations.
    pub verdicts: Findings,
    /// Certainty of the verdicts.
    pub certainty: ByPrimes,
    /// Observable combinations beyond single unknowns, by degree, then those that the scheme requests.
    pub combinations: Vec<CombinationFinding>,
    /// Basis of the unobservable directions, without unknowns that are not excited.
    pub null_space: Vec<NullVector>,
    /// Accuracy orders, or the reason why there are none.
    pub accuracy: Result<Accuracy, AccuracyError>,
}

/// Observable or requested combination.
pub struct CombinationFinding {
    /// Name, such as `D_FZ - wN*psi_y` or `eps_x^n@p2`; for a requested combination its text.
    pub name: String,
    /// True if the combination was requested.
    pub requested: bool,
    /// Coefficients in the first field of the verdicts, up to a factor.
    pub vector: Vec<u64>,
    /// Exact coefficients, that of the leading unknown first; `None` if they could not be computed.
    pub functional: Option<Functional>,
    /// Verdict on the combination: status and degree.
    pub verdict: Verdict,
    /// Accuracy orders of the combination, if there are any.
    pub orders: Orders,
}

/// Accuracy orders of a functional; `None` where no dwell makes it observable, or none are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Orders {
    /// Accuracy order with psi at the start.
    pub start: Option<usize>,
    /// Accuracy order with psi at the end, which is what a filter shows.
    pub end: Option<usize>,
}

impl<'a> JudgedScheme<'a> {
    /// Judges a scheme, and reads its requested combinations.
    ///
    /// # Errors
    /// [`AnalysisError`].
    pub fn new(platform: &'a Platform, seed: u64) -> Result<Self, AnalysisError> {
        // checked before anything grows with the number of unknowns
        let found = platform.names().len();
        if found > MAX_UNKNOWNS {
            return Err(SchemeError::TooManyUnknowns { found }.into());
        }
        let verdicts = judge(platform, seed)?;
        let requested = requested_combinations(platform, &verdicts, seed)?;
        Ok(Self { platform, verdicts, requested, seed })
    }

    /// Solver of coefficients and solutions; without a worker it computes nothing symbolic.
    pub fn solver<'b>(&'b self, frame: Frame, worker: Option<&'b mut Worker>) -> Solver<'b> {
        Solver::new(self.platform, &self.verdicts, self.seed, frame, worker)
    }

    /// All findings of the scheme.
    pub fn findings(&self, solver: &mut Solver<'_>) -> SchemeFindings {
        let Self { platform, verdicts, requested, seed } = self;
        let basis = combinations(platform, verdicts, solver);
        let null_space = null_space(platform, verdicts, solver);
        let accuracy = Accuracy::new(platform, verdicts, *seed);
        let orders = |vector: &[u64], degree| {
            accuracy.as_ref().map_or_else(
                |_| Orders::default(),
                |a| Orders {
                    start: a.of_functional(vector, degree),
                    end: a.of_functional_at_end(vector, degree),
                },
            )
        };
        let basis = basis.into_iter().map(|c| CombinationFinding {
            orders: orders(&c.vector, Some(c.degree)),
            name: c.name,
            requested: false,
            vector: c.vector,
            functional: c.functional,
            verdict: Verdict { status: Status::Observable, degree: Some(c.degree) },
        });
        let asked = requested.iter().map(|r| CombinationFinding {
            orders: orders(&r.row, r.verdict.degree),
            name: r.text.clone(),
            requested: true,
            vector: r.row.clone(),
            functional: solver.functional(r.terms.clone()),
            verdict: r.verdict,
        });
        let combinations = basis.chain(asked).collect();
        let primes = [0, 1].map(|i| verdicts.values[i].roots().field.modulus());
        SchemeFindings {
            verdicts: Findings {
                partners: partners(verdicts.degrees.degree.len(), &verdicts.spans),
                degrees: verdicts.degrees.clone(),
                asked: requested.iter().map(|r| r.verdict).collect(),
                seed: *seed,
            },
            certainty: ByPrimes { primes, third: None, error_bound: verdicts.error_bound },
            combinations,
            null_space,
            accuracy,
        }
    }
}

impl SchemeFindings {
    /// Accuracy orders of an unknown.
    pub fn orders(&self, unknown: usize) -> Orders {
        let of = |a: &Accuracy| Orders { start: a.order[unknown], end: a.order_at_end[unknown] };
        self.accuracy.as_ref().map_or_else(|_| Orders::default(), of)
    }
}

//! What is found of a scheme: degrees, accuracy orders, sparse combinations and null vectors; exact and
//! typed. An analysis words it, a prediction counts in it.

use obsdeg_symbolic::Worker;

use crate::accuracy::{Accuracy, AccuracyError};
use crate::degree::ensemble::{EnsembleError, Verdicts, judge};
use crate::degree::findings::{ByPrimes, Findings};
use crate::degree::staircase::partners;
use crate::degree::status::{Status, Verdict};
use crate::model::scheme::MAX_UNKNOWNS;
use crate::model::{Platform, SchemeError};
use crate::solution::combinations::{NullVector, combinations, null_space};
use crate::solution::requested::{CombinationError, Requested, requested_combinations};
use crate::solution::solver::{Frame, Functional, Solver};

/// Why nothing is found of a scheme.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AnalysisError {
    /// The scheme cannot be analysed.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// No verdict.
    #[error(transparent)]
    Verdict(#[from] EnsembleError),
    /// A combination is no linear combination of the unknowns.
    #[error(transparent)]
    Combination(#[from] CombinationError),
}

/// A scheme that was judged: what everything else is computed from.
pub struct Judged<'a> {
    /// The model.
    pub platform: &'a Platform,
    /// The verdicts, with the random values and bases that they come from.
    pub verdicts: Verdicts,
    requested: Vec<Requested>,
    seed: u64,
}

/// What is found of a scheme.
pub struct SchemeFindings {
    /// The verdicts.
    pub verdicts: Findings,
    /// How certain they are.
    pub certainty: ByPrimes,
    /// Observable combinations beyond single unknowns, by degree, then those that the scheme asks for.
    pub combinations: Vec<CombinationFinding>,
    /// Basis of the directions that no derivative of Z sees (unknowns that are not excited left out).
    pub null_space: Vec<NullVector>,
    /// What dwells determine.
    pub accuracy: Result<Accuracy, AccuracyError>,
}

/// An observable combination, or one that was asked for.
pub struct CombinationFinding {
    /// What it is, such as `D_FZ - wN*psi_y` or `eps_x^n@p2`, or as it was asked for.
    pub name: String,
    /// True if it was asked for.
    pub requested: bool,
    /// Its coefficients in the first field of the verdicts (up to a factor).
    pub vector: Vec<u64>,
    /// Its exact coefficients, that of the leading unknown first, if they could be computed.
    pub functional: Option<Functional>,
    /// Status and degree.
    pub verdict: Verdict,
    /// The accuracy orders, if there are any.
    pub orders: Orders,
}

/// Accuracy orders of a functional; `None` where no dwell makes it observable, or none are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Orders {
    /// With psi of the start.
    pub start: Option<usize>,
    /// With psi of the end, which is what a filter shows.
    pub end: Option<usize>,
}

impl<'a> Judged<'a> {
    /// Judges a scheme, and reads the combinations that it asks for.
    ///
    /// # Errors
    /// [`AnalysisError`].
    pub fn new(platform: &'a Platform, seed: u64) -> Result<Self, AnalysisError> {
        // before anything grows
        let found = platform.names().len();
        if found > MAX_UNKNOWNS {
            return Err(SchemeError::TooManyUnknowns { found }.into());
        }
        let verdicts = judge(platform, seed)?;
        let requested = requested_combinations(platform, &verdicts, seed)?;
        Ok(Self { platform, verdicts, requested, seed })
    }

    /// What coefficients and solutions are computed with; without a worker nothing symbolic is started.
    pub fn solver<'b>(&'b self, frame: Frame, worker: Option<&'b mut Worker>) -> Solver<'b> {
        Solver::new(self.platform, &self.verdicts, self.seed, frame, worker)
    }

    /// Everything that is found of the scheme.
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
                partners: partners(verdicts.degrees.degree.len(), &verdicts.stairs),
                degrees: verdicts.degrees.clone(),
                asked: requested.iter().map(|r| r.verdict).collect(),
                seed: *seed,
            },
            certainty: ByPrimes { primes, error_bound: verdicts.error_bound },
            combinations,
            null_space,
            accuracy,
        }
    }
}

impl SchemeFindings {
    /// The accuracy orders of an unknown.
    pub fn orders(&self, unknown: usize) -> Orders {
        let of = |a: &Accuracy| Orders { start: a.order[unknown], end: a.order_at_end[unknown] };
        self.accuracy.as_ref().map_or_else(|_| Orders::default(), of)
    }
}

//! What the exact engine says of a scheme, as numbers that a filter can be held against.

use obsdeg_core::accuracy::{Accuracy, AccuracyError};
use obsdeg_core::analysis::{AnalysisError, few_enough};
use obsdeg_core::degree::{Coefficient, Status, Verdict, judge, partners};
use obsdeg_core::model::Platform;
use obsdeg_core::solution::{Frame, Solver, Sparse, combinations, null_space, requested_combinations};

/// A linear combination of unknowns: `(unknown, coefficient)` in SI units.
pub type Combination = Vec<(usize, f64)>;

/// The verdict on one unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedUnknown {
    /// Whether it can be solved.
    pub status: Status,
    /// The observable degree.
    pub degree: Option<usize>,
    /// The accuracy order: `None` when no dwell makes it observable, and for schemes that rotate.
    pub accuracy_order: Option<usize>,
    /// Whether samples over the dwells determine it (psi: of the start): by the accuracy order, or by the degree where the orders are not computed.
    pub determined: bool,
    /// The accuracy order of its value at the end, which is what a filter shows.
    pub order_at_end: Option<usize>,
    /// Whether samples determine its value at the end: psi moves, and at a pole drift that nobody sees moves it.
    pub determined_at_end: bool,
    /// Unknowns that derivatives do not tell it from.
    pub partners: Vec<usize>,
}

/// An observable combination, or one that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedCombination {
    /// In words: `D_FZ - wN*psi_y`.
    pub expression: String,
    /// Its coefficients; the first is its leading unknown.
    pub terms: Combination,
    /// Whether it can be solved.
    pub status: Status,
    /// The observable degree.
    pub degree: Option<usize>,
    /// The accuracy order.
    pub accuracy_order: Option<usize>,
    /// The accuracy order of its value at the end.
    pub order_at_end: Option<usize>,
    /// Whether samples over the dwells determine its value at the end.
    pub determined_at_end: bool,
}

/// All of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Per unknown, in model order.
    pub unknowns: Vec<PredictedUnknown>,
    /// Observable combinations beyond single unknowns, and those that the scheme asks for.
    pub combinations: Vec<PredictedCombination>,
    /// Directions that Z does not see with dwells either, unknowns that are not excited included: a basis, except at a pole, where others
    /// move psi as well.
    pub null_space: Vec<Combination>,
    /// The rank with dwells: unknowns minus this is the defect of a filter.
    pub rank: usize,
    /// Whether there are accuracy orders: none are computed for schemes that rotate.
    pub has_accuracy_orders: bool,
    /// Bound on the probability that any of it is wrong.
    pub error_bound: f64,
}

/// Why there is no prediction.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PredictionError {
    /// No verdict, or a combination that is none.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// No accuracy order.
    #[error(transparent)]
    Accuracy(#[from] AccuracyError),
}

impl Prediction {
    /// The prediction for `platform` with the rates `(wN, wU)` in rad/s.
    ///
    /// # Errors
    /// [`PredictionError`].
    pub fn new(platform: &Platform, rates: [f64; 2], seed: u64) -> Result<Self, PredictionError> {
        few_enough(platform).map_err(AnalysisError::from)?;
        let verdicts = judge(platform, seed).map_err(AnalysisError::from)?;
        let requested = requested_combinations(platform, &verdicts, seed).map_err(AnalysisError::from)?;
        let accuracy = match Accuracy::new(platform, &verdicts, seed) {
            Err(AccuracyError::Rotation) => None,
            other => Some(other?),
        };
        let mut solver = Solver::new(platform, &verdicts, seed, Frame::N, None);
        let null = null_space(platform, &verdicts, &mut solver);
        let n = platform.names().len();
        let determined = |order: Option<usize>, degree: Option<usize>| {
            if accuracy.is_some() { order.is_some() } else { degree.is_some() }
        };
        let unknowns: Vec<PredictedUnknown> = partners(n, &verdicts.stairs)
            .into_iter()
            .enumerate()
            .map(|(c, partners)| {
                let v = Verdict::of(&verdicts.degrees, c);
                let accuracy_order = accuracy.as_ref().and_then(|a| a.order[c]);
                let order_at_end = accuracy.as_ref().and_then(|a| a.order_at_end[c]);
                PredictedUnknown {
                    status: v.status,
                    degree: v.degree,
                    accuracy_order,
                    determined: determined(accuracy_order, v.degree),
                    order_at_end,
                    determined_at_end: determined(order_at_end, v.degree),
                    partners,
                }
            })
            .collect();
        let combined = combinations(platform, &verdicts, &mut solver);
        let numbers = |terms: &Sparse| -> Option<Combination> {
            let rate = |k: &Coefficient| rates[0].powi(k.rates[0]) * rates[1].powi(k.rates[1]);
            terms.iter().map(|(c, k)| Some((*c, solver.number(k)? * rate(k)))).collect()
        };
        let of_functional =
            |row: &[u64], degree| accuracy.as_ref().and_then(|a| a.of_functional(row, degree));
        let at_end =
            |row: &[u64], degree| accuracy.as_ref().and_then(|a| a.of_functional_at_end(row, degree));
        let asked = requested.into_iter().filter_map(|r| {
            let order_at_end = at_end(&r.row, r.verdict.degree);
            Some(PredictedCombination {
                terms: numbers(&r.terms).filter(|t| !t.is_empty())?,
                status: r.verdict.status,
                degree: r.verdict.degree,
                accuracy_order: of_functional(&r.row, r.verdict.degree),
                order_at_end,
                determined_at_end: determined(order_at_end, r.verdict.degree),
                expression: r.text,
            })
        });
        let combinations = combined
            .into_iter()
            .filter_map(|c| {
                let order_at_end = at_end(&c.vector, Some(c.degree));
                Some(PredictedCombination {
                    terms: numbers(&c.functional.as_ref()?.terms)?,
                    expression: c.name,
                    status: Status::Observable,
                    degree: Some(c.degree),
                    accuracy_order: of_functional(&c.vector, Some(c.degree)),
                    order_at_end,
                    determined_at_end: determined(order_at_end, Some(c.degree)),
                })
            })
            .chain(asked)
            .collect();
        // with dwells, a direction may be seen that derivatives do not see (at a pole)
        let unseen = |v: &[u64]| !accuracy.as_ref().is_some_and(|a| a.sees(v));
        let silent = (0..n).filter(|&c| unknowns[c].status == Status::NotExcited).filter(|&c| {
            let mut unit = vec![0; n];
            unit[c] = 1;
            unseen(&unit)
        });
        let null_space = (null.iter().filter(|v| unseen(&v.vector)))
            .filter_map(|v| numbers(v.components.as_ref()?))
            .chain(silent.map(|c| vec![(c, 1.0)]))
            .collect();
        let rank = accuracy.as_ref().and_then(Accuracy::rank).unwrap_or_else(|| verdicts.degrees.rank());
        let has_accuracy_orders = accuracy.is_some();
        let error_bound = accuracy.map_or(verdicts.error_bound, |a| verdicts.error_bound.max(a.error_bound));
        Ok(Self { unknowns, combinations, null_space, rank, has_accuracy_orders, error_bound })
    }
}

impl Prediction {
    /// The null space, if all of it is known.
    pub(crate) fn whole_null_space(&self) -> Option<&[Combination]> {
        (self.null_space.len() + self.rank == self.unknowns.len()).then_some(&self.null_space)
    }
}

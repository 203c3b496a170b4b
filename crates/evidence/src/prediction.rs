//! Verdicts of the exact engine on a scheme as numbers, for comparison with a filter.

use obsdeg_core::accuracy::{Accuracy, AccuracyError};
use obsdeg_core::degree::{Coefficient, Findings, Status, Verdict};
use obsdeg_core::findings::{AnalysisError, CombinationFinding, JudgedScheme, SchemeFindings};
use obsdeg_core::model::Platform;
use obsdeg_core::solution::{Frame, Sparse};

/// A linear combination of unknowns: `(unknown, coefficient)` in SI units.
pub type Combination = Vec<(usize, f64)>;

/// Verdict on one unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedUnknown {
    /// Status: observable, inseparable or not excited.
    pub status: Status,
    /// Observable degree; `None` if the unknown is not observable.
    pub degree: Option<usize>,
    /// Accuracy order; `None` if no dwell makes the unknown observable, and for schemes that rotate.
    pub accuracy_order: Option<usize>,
    /// True if samples over the dwells determine the unknown (psi: of the start): by the accuracy order, or
    /// by the degree where the orders are not computed.
    pub determined: bool,
    /// Accuracy order of the value at the end, which a filter estimates.
    pub order_at_end: Option<usize>,
    /// True if samples determine the value at the end. It can differ from the start: psi moves, and at a pole
    /// unobservable drift moves it.
    pub determined_at_end: bool,
    /// Unknowns that are indistinguishable from it by derivatives.
    pub partners: Vec<usize>,
}

/// Observable combination, or a requested one.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedCombination {
    /// Expression, such as `D_FZ - wN*psi_y`.
    pub expression: String,
    /// True if the scheme requests the combination; other combinations belong to a basis.
    pub requested: bool,
    /// Coefficients of the combination; the first is that of its leading unknown.
    pub terms: Combination,
    /// Status: observable, inseparable or not excited.
    pub status: Status,
    /// Observable degree; `None` if the combination is not observable.
    pub degree: Option<usize>,
    /// Accuracy order; `None` if no dwell makes the combination observable, and for schemes that rotate.
    pub accuracy_order: Option<usize>,
    /// Accuracy order of the value at the end.
    pub order_at_end: Option<usize>,
    /// True if samples over the dwells determine the value at the end.
    pub determined_at_end: bool,
}

/// Verdicts on a scheme in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Verdicts on the unknowns, in model order.
    pub unknowns: Vec<PredictedUnknown>,
    /// Observable combinations beyond single unknowns, and those that the scheme requests.
    pub combinations: Vec<PredictedCombination>,
    /// Rank profile `dim V_0, dim V_1, ...` by derivatives.
    pub rank_profile: Vec<usize>,
    /// True if all combinations of the basis have numbers.
    pub all_combinations: bool,
    /// Basis of the directions that affect no derivative of Z, without unknowns that are not excited; `None`
    /// if a direction has no numbers.
    pub unseen_by_derivatives: Option<Vec<Combination>>,
    /// Directions that are unobservable from Z with dwells too, unknowns that are not excited included. It is
    /// a basis, except at a pole, where other directions move psi as well.
    pub null_space: Vec<Combination>,
    /// Rank with dwells: the number of unknowns minus this is the defect of a filter.
    pub rank: usize,
    /// True if there are accuracy orders: schemes that rotate have none.
    pub has_accuracy_orders: bool,
    /// Bound on the probability that any of these verdicts is wrong.
    pub error_bound: f64,
}

/// Reason why there is no prediction.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PredictionError {
    /// No verdict, or an invalid combination.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// No accuracy order.
    #[error(transparent)]
    Accuracy(#[from] AccuracyError),
}

/// True if samples over the dwells determine a quantity: by its accuracy order if there are orders
/// (`by_orders`), otherwise by its degree.
fn determined(by_orders: bool, order: Option<usize>, degree: Option<usize>) -> bool {
    if by_orders { order.is_some() } else { degree.is_some() }
}

impl PredictedUnknown {
    /// Prediction for the unknown `c`.
    fn of(found: &SchemeFindings, c: usize, by_orders: bool) -> Self {
        let (Verdict { status, degree }, orders) = (found.verdicts.verdict(c), found.orders(c));
        Self {
            status,
            degree,
            accuracy_order: orders.start,
            determined: determined(by_orders, orders.start, degree),
            order_at_end: orders.end,
            determined_at_end: determined(by_orders, orders.end, degree),
            partners: found.verdicts.partners[c].clone(),
        }
    }
}

impl PredictedCombination {
    /// Prediction for a combination with the coefficients `terms`.
    fn of(c: &CombinationFinding, terms: Combination, by_orders: bool) -> Self {
        let Verdict { status, degree } = c.verdict;
        Self {
            expression: c.name.clone(),
            requested: c.requested,
            terms,
            status,
            degree,
            accuracy_order: c.orders.start,
            order_at_end: c.orders.end,
            determined_at_end: determined(by_orders, c.orders.end, degree),
        }
    }
}

impl Prediction {
    /// Prediction for `platform` with the rates `(wN, wU)` in rad/s.
    ///
    /// # Errors
    /// [`PredictionError`].
    pub fn new(platform: &Platform, rates: [f64; 2], seed: u64) -> Result<Self, PredictionError> {
        let judged = JudgedScheme::new(platform, seed)?;
        let mut solver = judged.solver(Frame::N, None);
        let found = judged.findings(&mut solver);
        let accuracy = match found.accuracy.as_ref() {
            Err(AccuracyError::Rotation) => None,
            other => Some(other.map_err(Clone::clone)?),
        };
        let n = platform.names().len();
        let by_orders = accuracy.is_some();
        let unknowns: Vec<PredictedUnknown> =
            (0..n).map(|c| PredictedUnknown::of(&found, c, by_orders)).collect();
        let numbers = |terms: &Sparse| -> Option<Combination> {
            let rate = |k: &Coefficient| rates[0].powi(k.rates[0]) * rates[1].powi(k.rates[1]);
            terms.iter().map(|(c, k)| Some((*c, solver.number(k)? * rate(k)))).collect()
        };
        let predicted = |c: &CombinationFinding| {
            let terms = numbers(&c.functional.as_ref()?.terms).filter(|t| !t.is_empty())?;
            Some(PredictedCombination::of(c, terms, by_orders))
        };
        let combinations: Vec<PredictedCombination> =
            found.combinations.iter().filter_map(predicted).collect();
        let all_combinations = combinations.len() == found.combinations.len();
        let components = found.null_space.iter().map(|v| numbers(v.components.as_ref()?));
        let unseen_by_derivatives = components.collect();
        // with dwells, a direction may be observable that is not so by derivatives (at a pole)
        let unseen = |v: &[u64]| !accuracy.is_some_and(|a| a.sees(v));
        let silent = (0..n).filter(|&c| unknowns[c].status == Status::NotExcited).filter(|&c| {
            let mut unit = vec![0; n];
            unit[c] = 1;
            unseen(&unit)
        });
        let null_space = (found.null_space.iter().filter(|v| unseen(&v.vector)))
            .filter_map(|v| numbers(v.components.as_ref()?))
            .chain(silent.map(|c| vec![(c, 1.0)]))
            .collect();
        let (Findings { degrees, .. }, error_bound) = (&found.verdicts, found.certainty.error_bound);
        let rank = accuracy.and_then(Accuracy::rank).unwrap_or_else(|| degrees.rank());
        let error_bound = accuracy.map_or(error_bound, |a| error_bound.max(a.error_bound));
        Ok(Self {
            unknowns,
            combinations,
            rank_profile: degrees.rank_profile.clone(),
            all_combinations,
            unseen_by_derivatives,
            null_space,
            rank,
            has_accuracy_orders: by_orders,
            error_bound,
        })
    }
}

impl Prediction {
    /// Null space; `None` unless all of it is known.
    pub(crate) fn whole_null_space(&self) -> Option<&[Combination]> {
        (self.null_space.len() + self.rank == self.unknowns.len()).then_some(&self.null_space)
    }
}

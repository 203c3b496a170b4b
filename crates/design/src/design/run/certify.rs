//! Reports of bounds on the schemes of a task.

use nalgebra::DMatrix;
use obsdeg_core::model::angles_text;
use obsdeg_exact::parallel;

use crate::design::answer::{Certificate, EverywhereReport, Finer, Rounded, Weight};
use crate::design::certificate::WeightedAttitude;
use crate::design::certificate::value::{CriterionValue, excess};
use crate::design::certificate::{Bound, Everywhere};
use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::stop::Stop;
use crate::design::polish::rounding::MovedScheme;
use crate::design::run::task::{DWELLS, Task};
use crate::design::search::score::Scored;

/// Number of attitudes that are listed of the weights over all attitudes.
const LISTED: usize = 10;

/// Report of the bound over all attitudes, beside the criterion `value` of the best scheme found.
pub(crate) fn everywhere(
    found: &Everywhere,
    value: CriterionValue,
    rounded: Option<(i64, Option<&MovedScheme>)>,
) -> EverywhereReport {
    let weight = |a: &WeightedAttitude| Weight { candidate: angles_text(&a.angles), weight: a.weight };
    let (listed, lighter) = found.support.split_at(found.support.len().min(LISTED));
    EverywhereReport {
        best_possible: found.value,
        within_percent: 100.0 * excess(value.at_most, found.value),
        rounding: value.rounding,
        attained: found.attained,
        weights: listed.iter().map(weight).collect(),
        lighter: lighter.len(),
        lighter_weight: lighter.iter().map(|a| a.weight).sum(),
        rounded: rounded.map(|(step, finer)| Rounded {
            step_deg: step as f64 / 1e9,
            finer: finer
                .filter(|f| f.value < value.computed)
                .map(|f| Finer { value: f.value, angles: f.scheme.iter().map(angles_text).collect() }),
        }),
    }
}

impl Task<'_> {
    /// Lower bound on the criterion of schemes of `k` candidates.
    pub(crate) fn bound(&self, evaluator: &Evaluator, k: usize, proceed: &dyn Fn() -> bool) -> Option<Bound> {
        evaluator.bound(&self.criterion, k, &self.symmetry.representatives(), proceed)
    }

    /// Criterion of a scheme with its rounding tolerance, for its information as evaluated.
    pub(crate) fn value(&self, evaluator: &Evaluator, of: &Scored) -> CriterionValue {
        CriterionValue::new(of.score.value, self.at_most(evaluator, of, None))
    }

    /// Criterion with its rounding tolerance, for the information as it is bounded over all attitudes:
    /// without psi.
    pub(crate) fn value_among_all(&self, evaluator: &Evaluator, of: &Scored) -> CriterionValue {
        let attitudes = |stop: &Stop| (stop.candidate, &self.candidates.attitudes[stop.candidate]);
        let errors = evaluator.errors_of(of.sequence.iter().map(attitudes));
        CriterionValue::new(of.score.value, self.at_most(evaluator, of, Some(&errors)))
    }

    /// Upper bound on the criterion of a scheme; `None` for total uncertainties, whose rounding is
    /// unknown.
    fn at_most(&self, evaluator: &Evaluator, of: &Scored, errors: Option<&DMatrix<f64>>) -> Option<f64> {
        let of_sigmas = || evaluator.at_most(&of.sequence, &self.criterion, errors);
        if self.omitted.is_none() { of_sigmas() } else { None }
    }

    /// Report of the bound over the candidates, beside the criterion `value` of the best scheme found.
    pub(crate) fn certificate(&self, bound: &Bound, value: CriterionValue) -> Certificate {
        let excess = excess(value.at_most, bound.value);
        let weights = self.candidates.names.iter().zip(&bound.listed.weights).filter(|(_, w)| **w > 0.0);
        Certificate {
            best_possible: bound.value,
            within_percent: 100.0 * excess,
            efficiency: (1.0 + excess).powi(-2),
            rounding: value.rounding,
            attained: bound.listed.attained,
            weights: weights.map(|(name, &weight)| Weight { candidate: name.clone(), weight }).collect(),
            everywhere: None,
            front: Vec::new(),
        }
    }

    /// Lower bound over time, `[total time in s, criterion]`, for schemes of the candidates in equal
    /// dwells with any of the numbers of positions asked for.
    pub(crate) fn front_bound(
        &self,
        evaluator: &Evaluator,
        (k, dwell_s): (usize, f64),
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> Vec<[f64; 2]> {
        let mut counts = vec![k];
        counts.extend(self.options.front.iter().filter(|f| **f != k));
        let mut totals: Vec<f64> =
            counts.iter().flat_map(|&count| DWELLS.map(|factor| count as f64 * dwell_s * factor)).collect();
        totals.sort_by(f64::total_cmp);
        totals.dedup();
        let at = |total: f64| {
            let least = counts.iter().filter_map(|&count| {
                // a dwell of too many steps is no point of the front
                let there = evaluator.clone().with_dwell(total / count as f64).ok()?;
                Some(self.bound(&there, count, proceed).map(|b| b.value))
            });
            // no point unless the bound is known for every number of positions
            least
                .collect::<Option<Vec<f64>>>()?
                .into_iter()
                .min_by(f64::total_cmp)
                .map(|value| [total, value])
        };
        parallel::map(totals.len(), |i| at(totals[i])).into_iter().flatten().collect()
    }
}

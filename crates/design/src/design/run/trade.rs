//! Front of sigma against bias by the bench: of all schemes if they are few, otherwise of schemes that
//! are best with the bench scaled, from zero to far more.

use std::sync::Arc;

use crate::design::answer::BiasPoint;
use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::stop::Stop;
use crate::design::run::task::Task;
use crate::design::search::best::Best;
use crate::design::search::score::Scored;
use crate::design::search::scoring::{SequenceSearch, Trial};

/// Factors on all sizes of the bench.
const FACTORS: [f64; 8] = [0.0, 0.1, 0.25, 0.5, 2.0, 4.0, 10.0, 100.0];
/// Largest number of sequences that are all compared with each other.
const MOST: f64 = 2e4;
/// Largest total on the front, as a multiple of the best one.
const WORST: f64 = 100.0;
/// Restarts of the exchange at each factor, besides those from the schemes found.
const RESTARTS: u64 = 4;

impl Task<'_> {
    /// Schemes of `k` positions on the front of sigma against bias, by sigma, with totals up to 100
    /// times the least; true if the front is of all schemes. Empty if the search does not count a
    /// bench, and for D and E, which belong to no single coefficient.
    pub(crate) fn bias_front(
        &self,
        evaluator: &Evaluator,
        search: &SequenceSearch<'_>,
        k: usize,
        main: &Best,
    ) -> (Vec<BiasPoint>, bool) {
        let single = matches!(self.criterion, Criterion::Worst | Criterion::A | Criterion::Margin(_));
        let sized = self.omitted.as_ref().filter(|o| o.has_sizes());
        let (Some(omitted), true, Some(first)) = (sized, single, main.found.first()) else {
            return (Vec::new(), false);
        };
        // only schemes of the smallest worst degree are listed
        let same = |s: &&Scored| s.score.degree == first.score.degree;
        let every = search.few(&self.symmetry, k, MOST).map(|all| {
            let mut trial = Trial::new(evaluator);
            let start = evaluator.start();
            let scored = all.into_iter().map(|s| search.score_behind((&start, 0), &s, &mut trial));
            let valid = scored.filter(|s| s.score.is_valid()).filter(|s| same(&s));
            valid.map(|s| s.sequence).collect::<Vec<_>>()
        });
        let all = every.is_some();
        let mut sequences: Vec<Vec<Stop>> =
            main.found.iter().filter(same).map(|s| s.sequence.clone()).collect();
        sequences.extend(every.into_iter().flatten());
        // from the best of the search and of the previous factor
        let mut starts: Vec<Vec<Stop>> = sequences.first().cloned().into_iter().collect();
        for factor in FACTORS.into_iter().filter(|_| !all) {
            let there = Evaluator { omitted: Some(Arc::new(omitted.scaled(factor))), ..evaluator.clone() };
            let scaled = SequenceSearch { evaluator: &there, keep: 1, ..*search };
            let best = scaled.exchange(k, &starts, RESTARTS, self.options.seed);
            if !best.complete {
                return (Vec::new(), false);
            }
            for s in best.found.iter().filter(same) {
                starts.truncate(1);
                starts.push(s.sequence.clone());
                sequences.push(s.sequence.clone());
            }
        }
        let mut points: Vec<BiasPoint> = sequences.iter().filter_map(|s| self.point(evaluator, s)).collect();
        points.sort_by(|a, b| a.sigma.total_cmp(&b.sigma).then(a.bias.total_cmp(&b.bias)));
        let best = points.iter().map(|p| p.total).fold(f64::INFINITY, f64::min);
        points.retain(|p| p.total <= WORST * best);
        let mut least = f64::INFINITY;
        // points that differ only by rounding are merged
        points.retain(|p| {
            let better = p.bias < least * (1.0 - 1e-9);
            least = least.min(p.bias);
            better
        });
        (points, all)
    }

    /// Sigma, bias and total of a sequence; `None` where rounding hides them.
    fn point(&self, evaluator: &Evaluator, sequence: &[Stop]) -> Option<BiasPoint> {
        let (state, mut root) = (evaluator.state_of(sequence), Vec::new());
        let sigma = evaluator.sigma_value(&state, &self.criterion, &mut root, &mut Vec::new());
        let total = evaluator.value(&state, &self.criterion, &mut root);
        let added = evaluator.added_variances(&state, &root);
        let unit = evaluator.dph;
        let squared = added.iter().map(|a| a / (unit * unit));
        let bias = match &self.criterion {
            Criterion::A => squared.sum::<f64>() / added.len() as f64,
            Criterion::Margin(limits) => {
                squared.zip(&limits.coefficients).map(|(a, l)| a / (l * l)).fold(0.0, f64::max)
            }
            _ => squared.fold(0.0, f64::max),
        };
        let positions = sequence.iter().map(|s| self.candidates.names[s.candidate].clone()).collect();
        total.is_finite().then(|| BiasPoint { positions, sigma, bias: bias.sqrt(), total })
    }
}

//! Slew paths between candidates, where turning takes time: the shortest, for half turns both
//! directions.

use obsdeg_core::model::slew::{Slew, Turn};
use obsdeg_core::model::{Matrix3, SlewTo};
use obsdeg_exact::parallel;

use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::slew_path::SlewPath;
use crate::design::measure::stop::Stop;
use crate::design::request::error::DesignError;
use crate::design::request::limits::MAX_TURNING;

impl Evaluator {
    /// Evaluator with other candidates, and all slew paths between them.
    pub(crate) fn among(
        mut self,
        attitudes: &[Matrix3<f64>],
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, DesignError> {
        self.stand_at(attitudes);
        if self.conditions.slew_rate_deg_s.is_some() {
            let found = attitudes.len();
            if found > MAX_TURNING {
                return Err(DesignError::Pairs { found });
            }
            self.slew_paths = parallel::try_map(found * found, |k| {
                let shortest_path = || self.shortest_path(&attitudes[k / found], &attitudes[k % found]);
                proceed().then(shortest_path).ok_or(DesignError::Interrupted)
            })?;
        }
        Ok(self)
    }

    /// Evaluator with the positions of one sequence as candidates, and the slew paths from each to the
    /// next.
    pub(crate) fn along(&self, attitudes: &[Matrix3<f64>]) -> Self {
        let mut out = self.clone();
        out.stand_at(attitudes);
        if self.conditions.slew_rate_deg_s.is_some() {
            let n = attitudes.len();
            let next = |k: usize| k % n == k / n + 1;
            let shortest_path = |k: usize| {
                if next(k) { out.shortest_path(&attitudes[k / n], &attitudes[k % n]) } else { out.stay() }
            };
            out.slew_paths = (0..n * n).map(shortest_path).collect();
        }
        out
    }

    /// Shortest slew path from one attitude to another, with the opposite one if that is as short.
    fn shortest_path(&self, from: &Matrix3<f64>, to: &Matrix3<f64>) -> SlewPath {
        let rate = self.conditions.slew_rate_deg_s.unwrap_or(f64::INFINITY);
        // a shortest path always exists
        let slew = Slew::to(from, to, &SlewTo::default(), rate.to_radians()).ok().flatten();
        let Some(slew) = slew else { return self.stay() };
        let other = slew.reversed().map(|other| Box::new(self.turned(&other)));
        SlewPath { other, ..self.turned(&slew) }
    }

    /// Path without a turn.
    fn stay(&self) -> SlewPath {
        SlewPath::none(self.n - 3)
    }

    fn turned(&self, slew: &Slew) -> SlewPath {
        let drift_at = |t: f64| self.drift_with_omitted(&slew.at(t), slew);
        SlewPath::along(slew, &self.w, self.n - 3, drift_at)
    }

    /// Duration of the turn from one candidate to another, in s.
    pub fn slew_s(&self, from: usize, to: usize) -> f64 {
        self.slew_paths.get(from * self.candidates.len() + to).map_or(0.0, |w| w.seconds)
    }

    /// Slew paths from the previous position (`None` for the first position) to a candidate: one, or
    /// two for a half turn.
    pub fn stops(&self, last: Option<usize>, candidate: usize) -> impl Iterator<Item = Stop> {
        let shortest_path =
            last.and_then(|last| self.slew_paths.get(last * self.candidates.len() + candidate));
        let two = shortest_path.is_some_and(|w| w.other.is_some());
        [false, true].into_iter().take(1 + usize::from(two)).map(move |reversed| Stop { candidate, reversed })
    }

    /// Slew path to a stop from the previous candidate; `None` for the first position.
    pub(crate) fn path_to(&self, last: Option<usize>, stop: Stop) -> Option<&SlewPath> {
        let shortest_path = self.slew_paths.get(last? * self.candidates.len() + stop.candidate)?;
        Some(shortest_path.other.as_deref().filter(|_| stop.reversed).unwrap_or(shortest_path))
    }

    /// Canonical form, which makes equal sequences compare equal: only half turns have a second slew
    /// path.
    pub(crate) fn tidy(&self, sequence: &mut [Stop]) {
        let mut last = None;
        for stop in sequence {
            stop.reversed &= self.stops(last, stop.candidate).count() == 2;
            last = Some(stop.candidate);
        }
    }

    /// Half turns of a sequence, each with the index of the position that it leads to.
    pub fn half_turns(&self, sequence: &[Stop]) -> Vec<(usize, Turn)> {
        let turn = |k: usize| self.path_to(Some(sequence[k - 1].candidate), sequence[k])?.turn;
        (1..sequence.len()).filter_map(|k| Some((k, turn(k).filter(Turn::is_half)?))).collect()
    }

    /// Number of sequences of `k` positions that begin with one of `firsts`; `None` beyond 2^64.
    pub(crate) fn sequences(&self, firsts: &[usize], k: usize) -> Option<u64> {
        let n = self.candidates.len();
        if self.slew_paths.is_empty() {
            return (firsts.len() as u64).checked_mul((n as u64).checked_pow(k as u32 - 1)?);
        }
        // number of sequences that end with each candidate
        let mut ends: Vec<u64> = (0..n).map(|c| u64::from(firsts.contains(&c))).collect();
        for _ in 1..k {
            let to = |c: usize| {
                (0..n).try_fold(0u64, |sum, last| {
                    sum.checked_add(ends[last].checked_mul(self.stops(Some(last), c).count() as u64)?)
                })
            };
            ends = (0..n).map(to).collect::<Option<_>>()?;
        }
        ends.into_iter().try_fold(0u64, u64::checked_add)
    }
}

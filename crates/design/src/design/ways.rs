//! The ways from one candidate to another, where turning takes time: the shortest, and of half turns both.

use obsdeg_core::model::slew::{Slew, Turn};
use obsdeg_core::model::{Matrix3, SlewTo};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::DesignError;
use super::information::Evaluator;

/// Most candidates when it takes time to turn from one to another.
pub(crate) const MAX_TURNING: usize = 256;
/// Largest turn of an integration step, in rad.
const TURN_STEP: f64 = 0.05;

/// What a turn from one candidate to another does.
#[derive(Debug, Clone)]
pub(super) struct Way {
    pub(super) seconds: f64,
    /// `psi^n` behind it by `psi^n` before.
    pub(super) phi: Matrix3<f64>,
    /// `psi^n` behind it by the coefficients (3 x d).
    pub(super) drift: [Vec<f64>; 3],
    /// How it turns; `None`: there is nothing to turn.
    turn: Option<Turn>,
    /// The other way round, of half a turn.
    other: Option<Box<Self>>,
}

/// Position of a sequence: the candidate, and the slew path to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub struct Stop {
    /// Index of the candidate, from 0.
    pub candidate: usize,
    /// True if a half turn to the position goes the other way round than by default: about the axis whose
    /// first non-zero component is negative.
    pub reversed: bool,
}

impl From<usize> for Stop {
    fn from(candidate: usize) -> Self {
        Self { candidate, reversed: false }
    }
}

impl Evaluator {
    /// The same with other candidates, and all the ways between them.
    pub(super) fn among(
        mut self,
        attitudes: &[Matrix3<f64>],
        going: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, DesignError> {
        self.stand_at(attitudes);
        if self.conditions.slew_rate_deg_s.is_some() {
            let found = attitudes.len();
            if found > MAX_TURNING {
                return Err(DesignError::Pairs { found });
            }
            let ways = (0..found * found).into_par_iter().map(|k| {
                let way = || self.way(&attitudes[k / found], &attitudes[k % found]);
                going().then(way).ok_or(DesignError::Interrupted)
            });
            self.ways = ways.collect::<Result<_, _>>()?;
        }
        Ok(self)
    }

    /// The same with the positions of one sequence as candidates, and the ways from each to the next.
    pub(super) fn along(&self, attitudes: &[Matrix3<f64>]) -> Self {
        let mut out = self.clone();
        out.stand_at(attitudes);
        if self.conditions.slew_rate_deg_s.is_some() {
            let n = attitudes.len();
            let next = |k: usize| k % n == k / n + 1;
            let way =
                |k: usize| if next(k) { out.way(&attitudes[k / n], &attitudes[k % n]) } else { out.stay() };
            out.ways = (0..n * n).map(way).collect();
        }
        out
    }

    /// The shortest way from one attitude to another, and the other one if that is as short.
    fn way(&self, from: &Matrix3<f64>, to: &Matrix3<f64>) -> Way {
        let rate = self.conditions.slew_rate_deg_s.unwrap_or(f64::INFINITY);
        // there is always a shortest way
        let slew = Slew::to(from, to, &SlewTo::default(), rate.to_radians()).ok().flatten();
        let Some(slew) = slew else { return self.stay() };
        let other = slew.reversed().map(|other| Box::new(self.turned(&other)));
        Way { other, ..self.turned(&slew) }
    }

    fn stay(&self) -> Way {
        let phi = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
        let drift = std::array::from_fn(|_| vec![0.0; self.n - 3]);
        Way { seconds: 0.0, phi, drift, turn: None, other: None }
    }

    /// `X' = W X + [0 | C(t) E(g(t))]` from `X = [1 | 0]` by Runge-Kutta: psi^n behind a turn by psi^n and the coefficients.
    fn turned(&self, slew: &Slew) -> Way {
        let n = self.n;
        let steps = (slew.turned(slew.duration_s) / TURN_STEP).ceil().max(1.0);
        let dt = slew.duration_s / steps;
        let drift_at = |t: f64| self.ordered_columns(self.drift_rows(&slew.at(t), Some(slew)));
        let slope = |x: &[Vec<f64>; 3], drift: &[Vec<f64>; 3]| -> [Vec<f64>; 3] {
            std::array::from_fn(|i| {
                let own = |k: usize| if k < 3 { 0.0 } else { drift[i][k - 3] };
                (0..n).map(|k| own(k) + (0..3).map(|j| self.w[i][j] * x[j][k]).sum::<f64>()).collect()
            })
        };
        let moved = |x: &[Vec<f64>; 3], k: &[Vec<f64>; 3], h: f64| -> [Vec<f64>; 3] {
            std::array::from_fn(|i| x[i].iter().zip(&k[i]).map(|(x, k)| x + h * k).collect())
        };
        let mut x: [Vec<f64>; 3] =
            std::array::from_fn(|i| (0..n).map(|k| f64::from(u8::from(i == k))).collect());
        let mut before = drift_at(0.0);
        for step in 0..steps as usize {
            let t = step as f64 * dt;
            let (middle, after) = (drift_at(t + dt / 2.0), drift_at(t + dt));
            let k1 = slope(&x, &before);
            let k2 = slope(&moved(&x, &k1, dt / 2.0), &middle);
            let k3 = slope(&moved(&x, &k2, dt / 2.0), &middle);
            let k4 = slope(&moved(&x, &k3, dt), &after);
            for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                x = moved(&x, &k, weight * dt / 6.0);
            }
            before = after;
        }
        Way {
            // times are compared: what rounding adds is no time
            seconds: (slew.duration_s * 1e9).round() / 1e9,
            phi: std::array::from_fn(|i| std::array::from_fn(|j| x[i][j])),
            drift: x.map(|row| row[3..].to_vec()),
            turn: Some(slew.turn()),
            other: None,
        }
    }

    /// How long it takes to get from one candidate to another, in s.
    pub fn slew_s(&self, from: usize, to: usize) -> f64 {
        self.ways.get(from * self.candidates.len() + to).map_or(0.0, |w| w.seconds)
    }

    /// The ways from the position before (`None`: there is none) to a candidate: one, or two where half a turn leads
    /// there.
    pub fn stops(&self, last: Option<usize>, candidate: usize) -> impl Iterator<Item = Stop> {
        let way = last.and_then(|last| self.ways.get(last * self.candidates.len() + candidate));
        let two = way.is_some_and(|w| w.other.is_some());
        [false, true].into_iter().take(1 + usize::from(two)).map(move |reversed| Stop { candidate, reversed })
    }

    /// The way to a stop from the candidate before.
    pub(super) fn way_to(&self, last: Option<usize>, stop: Stop) -> Option<&Way> {
        let way = self.ways.get(last? * self.candidates.len() + stop.candidate)?;
        Some(way.other.as_deref().filter(|_| stop.reversed).unwrap_or(way))
    }

    /// Makes equal sequences equal: what is no half turn has no other way.
    pub(super) fn tidy(&self, sequence: &mut [Stop]) {
        let mut last = None;
        for stop in sequence {
            stop.reversed &= self.stops(last, stop.candidate).count() == 2;
            last = Some(stop.candidate);
        }
    }

    /// The half turns of a sequence, with the index of the position that they lead to.
    pub fn half_turns(&self, sequence: &[Stop]) -> Vec<(usize, Turn)> {
        let turn = |k: usize| self.way_to(Some(sequence[k - 1].candidate), sequence[k])?.turn;
        (1..sequence.len()).filter_map(|k| Some((k, turn(k).filter(Turn::is_half)?))).collect()
    }

    /// How many sequences of `k` begin with one of `firsts`; `None` beyond 2^64.
    pub(super) fn sequences(&self, firsts: &[usize], k: usize) -> Option<u64> {
        let n = self.candidates.len();
        if self.ways.is_empty() {
            return (firsts.len() as u64).checked_mul((n as u64).checked_pow(k as u32 - 1)?);
        }
        // how many end with each candidate
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

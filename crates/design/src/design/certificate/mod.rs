//! Lower bounds on the criterion of every scheme of k candidates, where information adds over positions
//! (reset carry), from the optimal weights of the candidates (approximate design theory).

mod bound;
pub(crate) mod bounded;
#[cfg(test)]
mod exact;
mod free;
mod scheme;
pub(crate) mod value;
mod weights;

pub use free::{Everywhere, WeightedAttitude};

use nalgebra::{DMatrix, DVector};

use crate::design::measure::criterion::{Criterion, SigmaLimits};
use crate::design::measure::evaluator::Evaluator;
use bound::{Additive, Objective};
use weights::{listed, weigh};

/// Largest number of first positions for which psi is bounded one by one, for requirements on psi.
const MOST_PSI: usize = 48;

/// Weights as they are listed.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedWeights {
    /// Rounded weight of every candidate, to be divided by their sum, dimensionless.
    pub weights: Vec<f64>,
    /// Criterion of these weights, in deg/h (per g), for margin dimensionless.
    pub attained: f64,
}

/// Lower bound on the criterion of every scheme of given candidates.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Lower bound, in deg/h (per g), for margin dimensionless.
    pub value: f64,
    /// Criterion of the weights themselves: the largest bound that this method can give.
    pub attained: f64,
    /// Weight of every candidate, dimensionless (sum 1).
    pub weights: Vec<f64>,
    /// Weights as they are listed, and their criterion.
    pub listed: ListedWeights,
}

impl Evaluator {
    /// Lower bound for schemes of `k` candidates, in any order and with repetitions. Every scheme must
    /// be as good as one that contains a candidate of `firsts`. `None` where information does not add
    /// over positions (platform and inertial carry, correlated noise of Z), where the candidates
    /// together do not determine the coefficients that count, or when stopped.
    pub fn bound(
        &self,
        criterion: &Criterion,
        k: usize,
        firsts: &[usize],
        proceed: &dyn Fn() -> bool,
    ) -> Option<Bound> {
        if self.ordered() || self.candidates.is_empty() || k == 0 {
            return None;
        }
        let found = match criterion {
            Criterion::Margin(limits) if limits.psi.iter().any(|l| l.is_finite()) => {
                self.with_psi(limits, k, firsts, proceed)?
            }
            _ => self.weighed(self.objective(criterion), k, proceed)?,
        };
        (proceed() && found.value > 0.0).then_some(found)
    }

    /// Objective of a criterion, as a function of the information on the coefficients.
    fn objective(&self, criterion: &Criterion) -> Objective {
        match criterion {
            Criterion::Margin(limits) => self.largest(limits),
            Criterion::Worst => {
                let d = self.n - 3 - self.nuisance;
                self.largest(&SigmaLimits { coefficients: vec![1.0; d], psi: [f64::INFINITY; 3] })
            }
            Criterion::A => Objective::Mean(self.units()),
            Criterion::D => Objective::Volume,
            Criterion::E => Objective::Least,
        }
    }

    /// Unit columns of the coefficients that count (m x d).
    fn units(&self) -> DMatrix<f64> {
        let m = self.n - 3;
        DMatrix::from_fn(m, m - self.nuisance, |i, j| f64::from(u8::from(i == j + self.nuisance)))
    }

    /// Objective: largest variance over the square of its limit.
    fn largest(&self, limits: &SigmaLimits) -> Objective {
        let mut vectors = self.units();
        for (mut column, limit) in vectors.column_iter_mut().zip(&limits.coefficients) {
            column /= *limit;
        }
        let offsets = vec![0.0; vectors.ncols()];
        Objective::Largest(vectors, offsets)
    }

    /// Bound for margin with requirements on psi: the objective of [`Self::largest`] with psi of one position
    /// added. It is the least bound over `firsts`: every scheme, up to its images, contains one of them.
    fn with_psi(
        &self,
        limits: &SigmaLimits,
        k: usize,
        firsts: &[usize],
        proceed: &dyn Fn() -> bool,
    ) -> Option<Bound> {
        let every: Vec<usize> = if firsts.len() <= MOST_PSI { firsts.to_vec() } else { Vec::new() };
        let Objective::Largest(coefficients, none) = self.largest(limits) else { return None };
        let mut least: Option<Bound> = None;
        for candidate in every.iter().map(Some).chain(every.is_empty().then_some(None)) {
            let (mut vectors, mut offsets) = (coefficients.clone(), none.clone());
            for (k, limit) in limits.psi.iter().enumerate().filter(|(_, l)| l.is_finite()) {
                let Some(psi) = candidate.map(|&c| self.own_psi(c)).filter(|p| p.variances[k].is_finite())
                else {
                    continue;
                };
                let unit = 1f64.to_degrees() / limit;
                let at = vectors.ncols();
                vectors = vectors.insert_column(at, 0.0);
                let moved = psi.moved.iter().map(|moved| moved[k] * unit * self.dph);
                vectors.set_column(at, &DVector::from_iterator(psi.moved.len(), moved));
                offsets.push(psi.variances[k] * unit * unit);
            }
            let found = self.weighed(Objective::Largest(vectors, offsets), k, proceed)?;
            if least.as_ref().is_none_or(|l| found.value < l.value) {
                least = Some(found);
            }
        }
        least
    }

    /// Bound by the weights that minimise the objective.
    fn weighed(&self, objective: Objective, k: usize, proceed: &dyn Fn() -> bool) -> Option<Bound> {
        let problem = self.additive(objective, k);
        let found = weigh(&problem, proceed)?;
        let exact = || (found.weights.clone(), found.attained);
        let (weights, attained) = listed(&problem, &found.weights).unwrap_or_else(exact);
        // the bound of exact weights may rest on rounding
        let listed = ListedWeights { weights, attained: attained.max(found.bound).sqrt() };
        Some(Bound {
            value: found.bound.sqrt(),
            attained: found.attained.sqrt(),
            weights: found.weights,
            listed,
        })
    }

    /// Information of the candidates, times k; numbers are in deg/h (per g).
    fn additive(&self, objective: Objective, k: usize) -> Additive {
        let (n, m) = (self.n, self.n - 3);
        let unit = k as f64 * self.dph * self.dph;
        let known = |i: usize, j: usize| match i == j {
            true => self.prior.coefficients[i] * self.dph * self.dph,
            false => 0.0,
        };
        let information =
            |own: &Vec<f64>| DMatrix::from_fn(m, m, |i, j| unit * own[(3 + i.max(j)) * n + 3 + i.min(j)]);
        Additive {
            candidates: self.candidates.iter().map(|c| information(&c.own)).collect(),
            prior: DMatrix::from_fn(m, m, known),
            nuisance: self.nuisance,
            objective,
        }
    }
}

//! Criteria of optimal design, from the information of a sequence: functions of the covariance alone.
//!
//! The same criteria are bounded from above in `certificate/scheme`, from below in `certificate/bound`, and
//! excluded by pairs of positions in `search/screen`. Here `of_attained` and `by_root`, elsewhere
//! `bias_front` and `point` (`run/trade`) and `squared` (`certificate/exact`, for tests) end in a default,
//! the criterion worst.

use nalgebra::DMatrix;
use obsdeg_core::model::Carry;
use obsdeg_ekf::EkfError;
use obsdeg_evidence::requirements::Requirements;
use obsdeg_evidence::simulation::{Attained, si_per_shown};

use crate::design::measure::evaluator::{Evaluator, SequenceState};
use crate::design::measure::stop::Stop;
use crate::design::request::limits::{MAX_DRIFTS, MAX_UNKNOWNS};

/// Criterion that orders schemes: a function of the covariance of the d coefficients that count.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Criterion {
    /// Largest sigma.
    #[default]
    Worst,
    /// Root of the mean variance (A-optimal).
    A,
    /// Geometric mean of the principal sigmas, after the volume of the error ellipsoid (D-optimal).
    D,
    /// Largest principal sigma (E-optimal).
    E,
    /// Largest sigma over its requirement, dimensionless.
    Margin(SigmaLimits),
}

/// Largest sigmas allowed; infinite where there is no requirement.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmaLimits {
    /// Largest sigmas of the coefficients that count, in deg/h (per g) (shape d).
    pub coefficients: Vec<f64>,
    /// Largest sigmas of psi_x, psi_y, psi_z at the end, in deg; under reset carry at the end of every
    /// position.
    pub psi: [f64; 3],
}

impl Criterion {
    /// Name: worst, A, D, E or margin.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Worst => "worst",
            Self::A => "A",
            Self::D => "D",
            Self::E => "E",
            Self::Margin(_) => "margin",
        }
    }
}

impl Criterion {
    /// Criterion of a scheme from its covariance at the end, random drift included; `counts` names the
    /// coefficients that count.
    pub(crate) fn of_attained(
        &self,
        attained: &Attained,
        requirements: &Requirements,
        counts: &dyn Fn(&String) -> bool,
    ) -> Result<f64, EkfError> {
        let (names, units) = (attained.plan.platform.names(), attained.plan.platform.units());
        let counted: Vec<usize> = (0..names.len()).filter(|&c| counts(&names[c])).collect();
        if let Self::Margin(_) = self {
            return Ok(match &requirements.worst {
                Some(worst) if !requirements.leaves_out() => 1.0 / worst.margin,
                _ => f64::INFINITY,
            });
        }
        if counted.iter().any(|&c| attained.sigmas[c].is_none()) {
            return Ok(f64::INFINITY);
        }
        let scale = |k: usize| 1.0 / si_per_shown(units[counted[k]]);
        let own = attained.covariance_of(&counted)?;
        let shown = DMatrix::from_fn(own.nrows(), own.ncols(), |i, j| own[(i, j)] * scale(i) * scale(j));
        let n = shown.nrows() as f64;
        Ok(match self {
            Self::A => (shown.trace() / n).sqrt(),
            Self::D => shown.symmetric_eigenvalues().iter().map(|x| x.ln() / (2.0 * n)).sum::<f64>().exp(),
            Self::E => shown.symmetric_eigenvalues().max().sqrt(),
            _ => shown.diagonal().max().sqrt(),
        })
    }
}

impl Evaluator {
    /// Cholesky factor of the information, with psi and the coefficients that do not count first. The
    /// block of the others is the factor of the inverse of their covariance. False if one of them is
    /// not determined.
    pub(crate) fn root(&self, state: &SequenceState, root: &mut Vec<f64>) -> bool {
        self.root_from(if self.carry() == Carry::Reset { 3 } else { 0 }, state, root)
    }

    /// Factor as [`Self::root`], for the unknowns from `first` on.
    pub(crate) fn root_from(&self, first: usize, state: &SequenceState, root: &mut Vec<f64>) -> bool {
        let n = self.n;
        root.resize(n * n, 0.0);
        let l = &mut root[..];
        for i in first..n {
            let (done, rest) = l.split_at_mut(i * n);
            let row = &mut rest[..=i];
            let given = &state.information[i * n..=i * n + i];
            for j in first..i {
                let other = &done[j * n..=j * n + j];
                let sum: f64 = row[first..j].iter().zip(&other[first..j]).map(|(a, b)| a * b).sum();
                row[j] = if other[j] > 0.0 { (given[j] - sum) / other[j] } else { 0.0 };
            }
            let pivot = given[i] - row[first..i].iter().map(|a| a * a).sum::<f64>();
            // pivot of an undetermined direction, left by rounding
            row[i] = match pivot <= 1e-13 * given[i] {
                false => pivot.sqrt(),
                // it couples with none of the later unknowns
                true if i < 3 + self.nuisance => 0.0,
                true => return false,
            };
        }
        true
    }

    /// Criterion of a sequence, smaller is better. It is infinite, or as large as rounding makes it, if
    /// a coefficient that counts is not determined. Sigmas are in deg/h (per g); where errors that are
    /// not estimated count they are total uncertainties. `root` is working space.
    pub fn value(&self, state: &SequenceState, criterion: &Criterion, root: &mut Vec<f64>) -> f64 {
        match self.root(state, root) {
            true => self.by_root(state, criterion, root, &mut Vec::new(), true),
            false => f64::INFINITY,
        }
    }

    /// Criterion of the sigmas alone, a lower bound on that of the total uncertainties. `variances`
    /// receives the variances of the coefficients that count if the criterion is computed from them.
    pub(crate) fn sigma_value(
        &self,
        state: &SequenceState,
        criterion: &Criterion,
        root: &mut Vec<f64>,
        variances: &mut Vec<f64>,
    ) -> f64 {
        variances.clear();
        match self.root(state, root) {
            true => self.by_root(state, criterion, root, variances, false),
            false => f64::INFINITY,
        }
    }

    /// Criterion from the Cholesky factor of the information and the variances of the coefficients that
    /// count, which are computed if `own` is empty; with `total` of the total uncertainties, without of
    /// the sigmas.
    pub(crate) fn by_root(
        &self,
        state: &SequenceState,
        criterion: &Criterion,
        root: &[f64],
        own: &mut Vec<f64>,
        total: bool,
    ) -> f64 {
        let total = total && state.beside.is_some();
        if total && matches!(criterion, Criterion::D | Criterion::E) {
            return self.of_total_covariance(state, criterion, root).unwrap_or(f64::INFINITY);
        }
        let (n, begin) = (self.n, 3 + self.nuisance);
        let d = n - begin;
        let l = root;
        if *criterion == Criterion::D {
            // geometric mean of the principal sigmas
            let logs: f64 = (begin..n).map(|i| l[i * n + i].ln()).sum();
            return (-logs / d as f64).exp() / self.dph;
        }
        if *criterion == Criterion::E {
            let block =
                DMatrix::from_fn(d, d, |i, j| if j <= i { l[(i + begin) * n + j + begin] } else { 0.0 });
            let information = &block * block.transpose();
            return 1.0 / information.symmetric_eigenvalues().min().max(0.0).sqrt() / self.dph;
        }
        let added = if total { self.added_variances(state, l) } else { Vec::new() };
        let added = added.into_iter().chain(std::iter::repeat(0.0));
        if own.is_empty() {
            own.extend((begin..n).map(|i| self.variance(l, i)));
        }
        let variances = own.iter().zip(added).map(|(own, added)| own + added);
        match criterion {
            Criterion::A => (variances.sum::<f64>() / d as f64).sqrt() / self.dph,
            Criterion::Margin(limits) => {
                let over = variances.zip(&limits.coefficients).map(|(v, limit)| v.sqrt() / self.dph / limit);
                over.fold(self.psi_over(state, l, &limits.psi), f64::max)
            }
            _ => variances.fold(0.0, f64::max).sqrt() / self.dph,
        }
    }

    /// Variance of unknown `i`: the square of column i of the inverse of the factor `l`.
    fn variance(&self, l: &[f64], i: usize) -> f64 {
        match self.n {
            0..=MAX_DRIFTS => self.variance_in::<MAX_DRIFTS>(l, i),
            _ => self.variance_in::<MAX_UNKNOWNS>(l, i),
        }
    }

    fn variance_in<const N: usize>(&self, l: &[f64], i: usize) -> f64 {
        let n = self.n;
        let mut column = [0.0; N];
        column[i] = 1.0 / l[i * n + i];
        let mut variance = column[i] * column[i];
        for r in i + 1..n {
            let row = &l[r * n..=r * n + r];
            let product: f64 = row[i..r].iter().zip(&column[i..r]).map(|(a, b)| a * b).sum();
            column[r] = -product / row[r];
            variance += column[r] * column[r];
        }
        variance
    }

    /// State after a whole sequence.
    pub(crate) fn state_of<S: Copy + Into<Stop>>(&self, sequence: &[S]) -> SequenceState {
        let (mut now, mut next) = (self.start(), self.start());
        for &stop in sequence {
            self.extend(&now, stop.into(), &mut next);
            std::mem::swap(&mut now, &mut next);
        }
        now
    }

    /// Sigmas of the coefficients that count, in deg/h (per g), in model order; empty if one is not
    /// determined.
    pub fn sigmas<S: Copy + Into<Stop>>(&self, sequence: &[S]) -> Vec<f64> {
        let mut root = Vec::new();
        if !self.root(&self.state_of(sequence), &mut root) {
            return Vec::new();
        }
        (3 + self.nuisance..self.n).map(|i| self.variance(&root, i).sqrt() / self.dph).collect()
    }

    /// Criterion of a whole sequence.
    pub fn of_sequence<S: Copy + Into<Stop>>(&self, sequence: &[S], criterion: &Criterion) -> f64 {
        self.value(&self.state_of(sequence), criterion, &mut Vec::new())
    }
}

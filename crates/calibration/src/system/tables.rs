//! Tables of the answer: estimates, combinations, covariance, findings, invariants and profiles.

use super::answer::ProfilePoint;
use nalgebra::DVector;
use obsdeg_core::degree::{Status, Verdict};
use obsdeg_core::system::{Judgement, ModelError, invariant_reports, symmetries};
use obsdeg_ekf::EkfError;
use obsdeg_evidence::system::FilterState;

use super::Calibrating;
use super::answer::{
    OutputFit, Profile, SystemCalibrationError, SystemEstimated, SystemFinding, SystemResidual,
};
use super::final_fit::{FinalFit, FreeUnknowns, OfInvariant};
use super::fit::{ModelRows, Settled, WEAK, leverage, settle, size, step};
use crate::answer::CovarianceTable;
use crate::least_squares::LeastSquaresSolution;
use crate::levels;
use crate::setup::SourceRecord;

impl Calibrating<'_> {
    /// Estimates of the unknowns.
    pub(super) fn quantities(&self, unknowns: &FreeUnknowns, fit: &FinalFit) -> Vec<SystemEstimated> {
        let of = |(j, name): (usize, &String)| {
            let named = (name.as_str(), self.unit(self.problem.free[j]));
            fit.estimated(named, unknowns.verdicts[j], fit.determined[j], fit.best.x[j], &[(j, 1.0)])
        };
        unknowns.names.iter().enumerate().map(of).collect()
    }

    /// Estimates of the requested combinations, then of identifiable combinations of unknowns that are not
    /// determined alone, by the symmetries of the model.
    pub(super) fn combinations(
        &self,
        judged: &Judgement,
        names: &[String],
        fit: &FinalFit,
    ) -> Result<Vec<SystemEstimated>, ModelError> {
        let all = self.problem.all(&self.base, &fit.best.x);
        let (values, by_all) = self.problem.numeric.combinations(&all);
        let by_free = by_all * self.problem.of_free(&self.base, &fit.best.x);
        let requested = self.model.combinations.iter().zip(judged.asked()).enumerate().map(|(i, (c, v))| {
            let terms: Vec<(usize, f64)> = by_free.row(i).iter().copied().enumerate().collect();
            let determined = v.status == Status::Observable && fit.determines(&terms);
            fit.estimated((c.text.as_str(), String::new()), Some(v), determined, values[i], &terms)
        });
        let mut out: Vec<SystemEstimated> = requested.collect();
        for (text, degree, value, terms) in self.invariants(judged, names, &fit.best.x)? {
            if out.iter().any(|c| c.name == text) {
                continue;
            }
            let verdict = Verdict { status: Status::Observable, degree };
            let named = (text.as_str(), String::new());
            out.push(fit.estimated(named, Some(verdict), fit.determines(&terms), value, &terms));
        }
        Ok(out)
    }

    /// Covariance of the determined unknowns.
    pub(super) fn covariance(&self, names: &[String], fit: &FinalFit) -> CovarianceTable {
        let own: Vec<usize> = (0..names.len()).filter(|&j| fit.determined[j]).collect();
        let p = fit.solution.covariance();
        CovarianceTable {
            names: own.iter().map(|&j| names[j].clone()).collect(),
            units: own.iter().map(|&j| self.unit(self.problem.free[j])).collect(),
            estimates: own.iter().map(|&j| fit.best.x[j]).collect(),
            covariance: own.iter().map(|&i| own.iter().map(|&j| p[(i, j)]).collect()).collect(),
            rescaled: own
                .iter()
                .map(|&i| own.iter().map(|&j| fit.between(&[(i, 1.0)], &[(j, 1.0)])).collect())
                .collect(),
        }
    }

    /// True if the noise of every output is estimated: chi-square then says nothing.
    pub(super) fn all_estimated(&self) -> bool {
        self.estimated.iter().all(|e| *e)
    }

    /// Evidence against the model or its sigmas.
    pub(super) fn findings(
        &self,
        fit: &FinalFit,
        residuals: &[SystemResidual],
        outputs: &[OutputFit],
    ) -> Vec<SystemFinding> {
        let (band, mean) = (fit.band(), fit.mean);
        let mut out = Vec::new();
        if self.problem.stopped {
            out.push(SystemFinding::Interrupted);
        } else if !fit.best.converged {
            out.push(SystemFinding::NotSettled);
        }
        if !self.all_estimated() && !band.contains(&mean) {
            out.push(SystemFinding::Noise { chi_square: mean, factor: mean.sqrt() });
        }
        for o in outputs {
            if let Some(probability) =
                o.whiteness_probability.filter(|p| p * (outputs.len() as f64) < levels::CORRELATED)
            {
                out.push(SystemFinding::Correlated { output: o.output.clone(), probability });
            }
        }
        out.extend(self.outliers(residuals, outputs));
        out
    }

    /// Identifiable products and sums of unknowns that are not determined alone: their text, degree, value at
    /// `x`, and derivatives by the unknowns `names`. Combinations with known starts are left out.
    fn invariants(
        &self,
        judged: &Judgement,
        names: &[String],
        x: &DVector<f64>,
    ) -> Result<Vec<OfInvariant>, ModelError> {
        let found = symmetries(self.model, self.compiled, judged, self.options.seed)?;
        let reports = invariant_reports(judged, &found);
        let of = |(i, report): (&obsdeg_core::system::Invariant, obsdeg_core::system::SystemCombination)| {
            let place = |&(c, m): &(usize, i64)| {
                let name = &judged.layout.unknowns[c].name;
                Some((names.iter().position(|n| n == name)?, m as f64))
            };
            let powers: Vec<(usize, f64)> = i.terms.iter().map(place).collect::<Option<_>>()?;
            let value = match i.product {
                true => powers.iter().map(|&(j, m)| x[j].powf(m)).product(),
                false => powers.iter().map(|&(j, m)| m * x[j]).sum::<f64>(),
            };
            let by = |&(j, m): &(usize, f64)| (j, if i.product { m * value / x[j] } else { m });
            let terms: Vec<(usize, f64)> = powers.iter().map(by).collect();
            let finite = terms.iter().all(|t| t.1.is_finite());
            finite.then_some((report.expression, report.degree, value, terms))
        };
        Ok(found.invariants.iter().zip(reports).filter_map(of).collect())
    }

    /// Records that the estimates rest on.
    pub(super) fn rests_on(&self) -> Vec<SourceRecord> {
        let own = SourceRecord { record: self.data.name.clone(), digest: self.data.digest.clone() };
        let before = self.options.prior.iter().flat_map(|b| b.rests_on.iter());
        let before = before.filter(|b| own.among(std::slice::from_ref(b)).is_none());
        std::iter::once(own.clone()).chain(before.cloned()).collect()
    }

    /// True if the prior calibration rests on the same record.
    pub(super) fn shared(&self) -> bool {
        let own = SourceRecord { record: self.data.name.clone(), digest: self.data.digest.clone() };
        self.options.prior.as_ref().is_some_and(|b| own.among(&b.rests_on).is_some())
    }

    fn unit(&self, state: usize) -> String {
        match self.problem.numeric.states[state] {
            FilterState::State { i, .. } => self.model.states[i].named.unit.clone(),
            FilterState::Parameter(i) => self.model.parameters[i].unit.clone(),
            FilterState::Input { i, derivative: 0, .. } => self.model.unknown_inputs[i].0.unit.clone(),
            FilterState::Input { .. } => String::new(),
        }
    }

    /// Factors on the noise of the outputs: 1 where it is given.
    pub(super) fn factors(&self, at: &ModelRows, x: &DVector<f64>) -> Result<Vec<f64>, EkfError> {
        let solution = step(at, x, 1.0 / WEAK)?;
        let of = |j: usize| {
            let own = (0..at.keys.len()).filter(|&i| at.keys[i].1 == j);
            let (chi, free) = own.fold((0.0, 0.0), |(c, f), i| {
                (c + (at.left[i] / at.sigmas[i]).powi(2), f + 1.0 - leverage(at, &solution, i))
            });
            if self.estimated[j] && chi > 0.0 && free > 1e-9 { (chi / free).sqrt() } else { 1.0 }
        };
        Ok((0..self.estimated.len()).map(of).collect())
    }

    /// Profiles: chi-square at values of an unknown about its estimate, with all others fitted.
    pub(super) fn profiles(
        &mut self,
        names: &[String],
        best: &Settled,
        solution: &LeastSquaresSolution,
        finer: usize,
    ) -> Result<Vec<Profile>, SystemCalibrationError> {
        let mut out = Vec::new();
        for name in &self.options.profiles {
            let j = names.iter().position(|n| n == name).ok_or_else(|| {
                SystemCalibrationError::NoUnknown { found: name.clone(), expected: names.join(", ") }
            })?;
            // three sigma, or half of the size where sigma is large
            let width = (3.0 * solution.sigma(&[(j, 1.0)])).min(0.5 * size(best.x[j]));
            let mut points = vec![ProfilePoint { value: best.x[j], rise: 0.0 }];
            for side in [-1.0, 1.0] {
                let mut x = best.x.clone();
                for k in 1..=4 {
                    x[j] = best.x[j] + side * width * f64::from(k) / 4.0;
                    let Ok(end) = settle(&mut self.problem, &self.base, x.clone(), finer, Some(j)) else {
                        break;
                    };
                    points.push(ProfilePoint { value: x[j], rise: end.cost - best.cost });
                    x = end.x;
                }
            }
            points.sort_by(|a, b| a.value.total_cmp(&b.value));
            // an unknown that constraints alone determine has no other values
            points.dedup_by(|a, b| a.value == b.value);
            let flat = points.len() > 1 && points.iter().all(|p| p.rise.abs() < 0.01);
            out.push(Profile { name: name.clone(), points, flat });
        }
        Ok(out)
    }
}

//! Diagnosis of an estimate: residuals of every measurement, by position, component and time; the filter as a
//! second path; contributions of single positions and of the prior.

pub(crate) mod data;
pub(crate) mod filter_path;
mod tables;

use nalgebra::DMatrix;
use obsdeg_core::degree::Status;
use obsdeg_core::model::Platform;
use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_ekf::EkfError;
use obsdeg_evidence::acceptance::{MeasuredCoefficient, acceptance};
use obsdeg_evidence::prediction::PredictedCombination;
use obsdeg_evidence::requirements::{Miss, RequirementClaim, Requirements, SigmaSource};
use obsdeg_evidence::simulation::omitted::Bench;
use obsdeg_evidence::simulation::{PlatformState, shown_unit, si_per_shown};

use super::CalibrationError;
use super::estimate::{LinearisedRuns, TIGHT, WEAK};
use super::suspects::{FamilyChange, Outside, omitted};
use crate::answer::{Calibration, CovarianceTable, Curvature, Estimated, FamilyLimit, LAYOUT};
use crate::least_squares::LeastSquaresSolution;
use crate::setup::Setup;
use data::{AnswerData, ReportedFunctional, ReportedSolutions};

/// Largest ratio of sigmas, for a pull ten times as weak, of a determined unknown.
const DETERMINED: f64 = 1.05;

/// Smallest ratio of sigmas, without and with a position, of an unknown that this position alone determines.
const LOST: f64 = 1e3;

impl AnswerData<'_> {
    /// Reported functionals: unknowns, then combinations; those with psi once per record.
    fn asked(
        &self,
        weaker: &LeastSquaresSolution,
        at_rest: &[PlatformState],
    ) -> (Vec<ReportedFunctional>, Vec<ReportedFunctional>) {
        let (names, units) = (self.planned.platform.names(), self.planned.platform.units());
        let psi = self.planned.unknowns() - self.planned.platform.coefficients();
        let runs = self.problem.runs.len();
        let make = |name: &str, verdict: (Status, Option<usize>, bool), terms: &[(usize, f64)]| {
            let of_psi = terms.iter().any(|(i, _)| *i < psi);
            let many = runs > 1 && of_psi;
            (0..if many { runs } else { 1 })
                .map(|r| {
                    let index = &self.problem.unknowns.index[r];
                    let on = |c: &[(usize, f64)]| c.iter().map(|&(s, k)| (index[s], k)).collect::<Vec<_>>();
                    let local = on(&self.estimate.at.x[r].functional(terms));
                    let (narrow, wide) = (self.linear.sigma(&local), weaker.sigma(&local));
                    let from_prior =
                        !verdict.2 && self.has_prior() && !self.problem.unknowns.is_open(&on(terms));
                    let determined = (verdict.2 || from_prior) && wide <= DETERMINED * narrow;
                    ReportedFunctional {
                        name: if many { format!("{name} (record {})", r + 1) } else { name.into() },
                        unit: units[terms[0].0],
                        status: verdict.0,
                        degree: verdict.1,
                        determined,
                        from_prior,
                        left_open: determined && self.bent.leaves_open(),
                        terms: on(terms),
                        local,
                        planned: on(&at_rest[r].functional(terms)),
                    }
                })
                .collect::<Vec<_>>()
        };
        let unknowns = self
            .prediction
            .unknowns
            .iter()
            .enumerate()
            .flat_map(|(c, u)| make(&names[c], (u.status, u.degree, u.determined), &[(c, 1.0)]));
        // a combination of determined unknowns alone adds nothing
        let open = |c: &&PredictedCombination| {
            c.requested || c.terms.iter().any(|&(i, _)| !self.prediction.unknowns[i].determined)
        };
        let combinations = self.prediction.combinations.iter().filter(open).flat_map(|c| {
            let determined = c.status == Status::Observable || c.accuracy_order.is_some();
            make(&c.expression, (c.status, c.degree, determined), &c.terms)
        });
        (unknowns.collect(), combinations.collect())
    }

    /// True if priors are stated, or a prior calibration is given.
    fn has_prior(&self) -> bool {
        !self.problem.unknowns.stated.is_empty() || self.problem.known.is_some()
    }

    /// Estimate with the prior of the scheme on everything.
    fn with_prior(&self) -> Result<LeastSquaresSolution, EkfError> {
        self.problem.step_with_prior(&self.estimate.at)
    }

    /// Answer with its findings and its decisions.
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub(crate) fn answer(self) -> Result<Calibration, CalibrationError> {
        let weaker = self.problem.step(&self.estimate.at, 10.0 * WEAK)?;
        let at_rest = self.problem.at_rest();
        let (unknowns, combinations) = self.asked(&weaker, &at_rest);
        let all = || unknowns.iter().chain(&combinations);
        if !all().any(|a| a.determined) {
            return Err(CalibrationError::Nothing);
        }
        let determined: Vec<&ReportedFunctional> = all().filter(|a| a.stands()).collect();
        let fit = self.fit(&unknowns, &combinations);
        let by = self.solutions(at_rest, fit.factor.max(1.0))?;
        let covariance = self.covariance(&determined, &by);
        let positions = self.positions(&determined)?;
        let channels = self.channels();
        let records = self.records();
        let repeatability = self.repeatability(&fit);
        let left_out = self.left_out()?;
        let quantities: Vec<Estimated> = unknowns.iter().map(|a| self.estimated(a, &by)).collect();
        let asked = (&self.conditions.bench[..], self.options.seed);
        let (omitted, outside) = omitted(self.problem, self.estimate, &quantities, self.later, asked)?;
        let mut out = Calibration {
            schema: LAYOUT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            name: self.scheme.name.clone(),
            document: self.scheme.document.clone(),
            consistent: true,
            findings: Vec::new(),
            quantities,
            omitted,
            requirements: None,
            acceptance: None,
            next_runs: Vec::new(),
            combinations: combinations.iter().map(|a| self.estimated(a, &by)).collect(),
            covariance,
            fit,
            positions,
            channels,
            outlier_count: left_out.len(),
            outliers: left_out.iter().map(|l| l.outlier.clone()).collect(),
            second_path: self.found.second.clone(),
            repeatability,
            records,
            assumed: self.assumed(&unknowns),
            curvature: self.curvature(),
            setup: Setup::of(self.scheme),
            rests_on: self.rests_on.clone(),
            series: self.series(),
            residuals: self.residuals(),
        };
        out.findings = self.findings(&out, &left_out);
        self.decide(&mut out, &outside)?;
        Ok(out)
    }

    /// Solutions that the reported numbers come from. The platform at the attitudes of the scheme has the
    /// states `at_rest`; `factor` is that on the standard deviations of the measurements.
    fn solutions(
        &self,
        at_rest: Vec<PlatformState>,
        factor: f64,
    ) -> Result<ReportedSolutions, CalibrationError> {
        let problem = self.problem;
        let with_prior = self.with_prior()?;
        let values = match &self.bent.found {
            Some(found) => problem.values(&problem.moved(&self.estimate.at.x, &found.mean)),
            None => problem.values(&self.estimate.at.x),
        };
        let tight = problem.step_constrained(&self.estimate.at, TIGHT)?;
        let planned: LinearisedRuns = problem.at(at_rest)?;
        let planned = problem.step(&planned, WEAK)?;
        let none = || DMatrix::zeros(0, problem.unknowns.n);
        let known = problem.known.as_ref().map_or_else(none, |k| k.rows.clone());
        Ok(ReportedSolutions { values, with_prior, tight, planned, known, factor })
    }

    /// Covariance of two functionals with the noise that the fit has, in their shown units.
    fn between(&self, a: &ReportedFunctional, b: &ReportedFunctional, by: &ReportedSolutions) -> f64 {
        let covariance = self.estimate.solution.covariance_with(&a.local, &b.local, by.factor, &by.known);
        covariance / si_per_shown(a.unit) / si_per_shown(b.unit)
    }

    /// Estimate of a functional.
    fn estimated(&self, a: &ReportedFunctional, by: &ReportedSolutions) -> Estimated {
        let data_alone = self.problem.unknowns.stated.is_empty();
        let scale = si_per_shown(a.unit);
        let there = |x: f64| a.stands().then_some(x);
        let sigma = self.estimate.solution.sigma(&a.local);
        let (linear, constrained) = (self.linear.sigma(&a.local), by.tight.sigma(&a.local));
        let moved: f64 = a.local.iter().map(|&(i, k)| k * by.with_prior.x[i]).sum();
        let open = (sigma * sigma - constrained * constrained).max(0.0).sqrt();
        Estimated {
            name: a.name.clone(),
            unit: shown_unit(a.unit).into(),
            status: a.status,
            degree: a.degree,
            determined: a.stands(),
            left_open: a.left_open,
            total: None,
            estimate: there(a.terms.iter().map(|&(i, k)| k * by.values[i]).sum::<f64>() / scale),
            sigma: there(sigma / scale),
            sigma_rescaled: there(self.between(a, a, by).max(0.0).sqrt()),
            predicted_sigma: there(by.planned.sigma(&a.planned) / scale),
            required_sigma: self.required(&a.name),
            constrained_factor: there(sigma / constrained),
            open_sigma: there(open / scale),
            from_prior: a.stands() && a.from_prior,
            prior_shift: there(moved / linear).filter(|_| data_alone),
            prior_factor: there(by.with_prior.sigma(&a.local) / linear).filter(|_| data_alone),
        }
    }

    /// Covariance of the determined functionals that do not follow from the others.
    fn covariance(&self, determined: &[&ReportedFunctional], by: &ReportedSolutions) -> CovarianceTable {
        let solution = &self.estimate.solution;
        let row = |a: &ReportedFunctional| {
            let zero = nalgebra::RowDVector::zeros(solution.inverse_root.ncols());
            let scale = si_per_shown(a.unit);
            a.local.iter().fold(zero, |sum, &(i, k)| sum + solution.inverse_root.row(i) * (k / scale))
        };
        let single = |a: &ReportedFunctional| a.terms.len() == 1;
        let follows = |a: &ReportedFunctional| {
            a.terms.iter().all(|(i, _)| determined.iter().any(|d| single(d) && d.terms[0].0 == *i))
        };
        let free: Vec<&ReportedFunctional> =
            determined.iter().copied().filter(|a| single(a) || !follows(a)).collect();
        let of: Vec<_> = free.iter().map(|a| row(a)).collect();
        CovarianceTable {
            names: free.iter().map(|a| a.name.clone()).collect(),
            units: free.iter().map(|a| shown_unit(a.unit).into()).collect(),
            estimates: free.iter().filter_map(|a| self.estimated(a, by).estimate).collect(),
            covariance: of.iter().map(|a| of.iter().map(|b| a.dot(b)).collect()).collect(),
            rescaled: free.iter().map(|a| free.iter().map(|b| self.between(a, b, by)).collect()).collect(),
        }
    }

    /// Test of the linear model of the covariance.
    fn curvature(&self) -> Curvature {
        Curvature {
            kappa: self.bent.kappa.is_finite().then_some(self.bent.kappa),
            samples: self.bent.samples,
            failed: self.bent.failed,
            from_samples: self.bent.found.is_some(),
        }
    }

    /// Decides on requirements and acceptance by the total uncertainties, with the errors of `outside`, and
    /// proposes further runs.
    fn decide(&self, out: &mut Calibration, outside: &Outside) -> Result<(), CalibrationError> {
        out.consistent = out.findings.is_empty();
        for e in out.quantities.iter_mut().filter(|e| outside.adds_to(&e.name)) {
            e.total = total(e, outside);
        }
        out.requirements = self.requirements(&out.quantities, outside);
        let measured = out.quantities.iter().map(|e| MeasuredCoefficient {
            name: &e.name,
            unit: &e.unit,
            estimate: e.estimate,
            uncertainty: total(e, outside),
            by_prior: e.from_prior,
        });
        out.acceptance = acceptance(&self.scheme.acceptance, measured, Some(out.consistent));
        if out.requirements.as_ref().is_some_and(Requirements::all_met) {
            out.omitted.limits = limits(&out.quantities, outside);
        }
        out.next_runs = self.next_runs(out, &outside.bench)?;
        Ok(())
    }

    /// Largest sigma allowed of a coefficient, in its unit; `None` where none is stated, and for psi.
    fn required(&self, name: &str) -> Option<f64> {
        let of = |a: &&Assignment| concerns(&a.name, name) && !name.starts_with("psi");
        self.conditions.requirements.iter().rfind(of).map(|a| a.value)
    }

    /// Outcome of the requirements on coefficients, with the contributions of a bench and of a suspected
    /// error; `None` where no requirement is stated.
    fn requirements(&self, quantities: &[Estimated], outside: &Outside) -> Option<Requirements> {
        let claims = quantities.iter().map(|e| RequirementClaim {
            name: &e.name,
            required: e.required_sigma,
            sigma: total(e, outside).ok_or(Miss::NotObservable),
        });
        let mut out = Requirements::of(SigmaSource::Record, claims);
        let stated = &self.conditions.bench;
        let estimated = |p: &Platform| Bench::estimated(stated, p).len();
        out.with_bench =
            self.problem.runs.first().is_some_and(|run| estimated(&run.plan.platform) < stated.len());
        let on_prior = quantities.iter().filter(|e| e.from_prior && e.required_sigma.is_some());
        out.on_prior = on_prior.map(|e| e.name.clone()).collect();
        Some(out).filter(|r| r.stated > 0)
    }
}

/// Uncertainty of an estimate: its larger sigma, the contribution of the bench, and the change by a suspected
/// error.
fn total(e: &Estimated, outside: &Outside) -> Option<f64> {
    let named = |of: &[(String, f64)]| of.iter().find(|(name, _)| *name == e.name).map_or(0.0, |(_, x)| *x);
    Some(e.larger_sigma()?.hypot(named(&outside.bench)).hypot(named(&outside.suspected)))
}

/// Smallest size of each open family at which a total reaches its requirement, beside the bench.
fn limits(quantities: &[Estimated], outside: &Outside) -> Vec<FamilyLimit> {
    let of = |family: &FamilyChange| {
        let used = family.changes.iter().filter(|(_, change)| *change != 0.0).filter_map(|(name, change)| {
            let e = quantities.iter().find(|e| e.name == *name)?;
            let left = e.required_sigma?.powi(2) - total(e, outside)?.powi(2);
            (left > 0.0).then(|| (name, left.sqrt() / change))
        });
        let (unknown, size) = used.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let (family, unit) = (family.family.into(), family.unit.into());
        Some(FamilyLimit { family, unit, unknown: unknown.clone(), size })
    };
    outside.families.iter().filter_map(of).collect()
}

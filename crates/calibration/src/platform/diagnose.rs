//! Diagnosis of an estimate: residuals of every measurement, by position, component and time; the filter as a
//! second path; contributions of single positions and of the prior.

use std::cell::RefCell;
use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::degree::Status;
use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{AZIMUTH, Platform, Scheme};
use obsdeg_ekf::linear::{SmoothedStart, filter_pass, smoothed_start};
use obsdeg_ekf::{Covariance, CovarianceForm, EkfError};
use obsdeg_evidence::acceptance::{MeasuredCoefficient, acceptance};
use obsdeg_evidence::prediction::{PredictedCombination, Prediction};
use obsdeg_evidence::requirements::{Miss, RequirementClaim, Requirements, SigmaSource};
use obsdeg_evidence::simulation::omitted::Bench;
use obsdeg_evidence::simulation::{Conditions, Plan, PlatformState, latitude_of, shown_unit, si_per_shown};

use super::curvature::CurvatureResult;
use super::estimate::{BOX, LinearisedRuns, PlatformEstimate, PlatformProblem, TIGHT, WEAK};
use super::jump::Jump;
use super::offset::{Later, Offset};
use super::placed::channel_name;
use super::run::MeasurementKey;
use super::suspects::{FamilyChange, Outside, omitted};
use super::{CalibrationError, Options};
use crate::answer::{
    Assumed, Calibration, ChannelFit, CovarianceTable, Curvature, Estimated, FamilyLimit, LAYOUT, Moved,
    PositionFit, RecordReport, SecondPath,
};
use crate::least_squares::{LeastSquaresSolution, Linearised, RunState, StackedRows, StartInformation};
use crate::setup::{self, Setup};

/// Factor by which the prior of the filter is wider than that of the scheme.
const WIDE: f64 = 100.0;
/// Largest ratio of sigmas, for a pull ten times as weak, of a determined unknown.
const DETERMINED: f64 = 1.05;
/// Smallest ratio of sigmas, without and with a position, of an unknown that this position alone determines.
const LOST: f64 = 1e3;

/// Measurement with its residual.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeasurementResidual {
    pub run: usize,
    pub key: MeasurementKey,
    /// Measurement minus estimate.
    pub residual: f64,
    /// Variance of the measurement as given.
    pub r: f64,
    /// Variance of the residual: `r D`.
    pub free: f64,
    /// Difference from the prediction by all other measurements, normalised.
    pub normalised: f64,
    /// Innovation: difference from the prediction by the measurements before it, normalised. With a right
    /// model innovations are independent unit normals, also after an estimate from the same record; nearly
    /// zero if the measurements before it do not predict it.
    pub innovation: f64,
}

impl MeasurementResidual {
    /// Square of the residual in units of sigma.
    fn square(&self) -> f64 {
        self.residual * self.residual / self.r
    }
}

/// Residuals of all measurements, and the second path.
pub(crate) struct Diagnosed {
    pub all: Vec<MeasurementResidual>,
    pub second: SecondPath,
    /// Sum of squares of each run alone, by least squares with the wide prior.
    pub alone: Vec<f64>,
    /// Probabilities of whiteness that were computed, by run and channel.
    pub white: RefCell<BTreeMap<(usize, usize), Option<f64>>>,
}

/// Prior standard deviations of the states of run `r`, wider than those of the scheme. Random biases have
/// priors of their own.
fn wide_prior(problem: &PlatformProblem<'_>, r: usize) -> Vec<f64> {
    let own = &problem.runs[r].plan;
    let wide =
        |(s, &i): (usize, &usize)| problem.unknowns.prior[i] * if s < own.unknowns() { WIDE } else { 1.0 };
    problem.unknowns.index[r].iter().enumerate().map(wide).collect()
}

/// Filter along a linearised run.
struct FilterPath {
    /// Correction and standard deviations of the state at the end.
    end: Option<(Vec<f64>, Vec<f64>)>,
    whitened: Vec<f64>,
    smoothed: SmoothedStart,
}

impl FilterPath {
    /// Filter along a run with these prior standard deviations.
    fn along(run: &Linearised, prior: &[f64]) -> Result<Self, EkfError> {
        let n = prior.len();
        let p0 = DMatrix::from_diagonal(&DVector::from_iterator(n, prior.iter().map(|s| s * s)));
        let (mut delta, mut whitened) = (vec![0.0; n], Vec::with_capacity(run.residuals.len()));
        let mut end: Option<(Vec<f64>, Vec<f64>)> = None;
        let mut first = 0;
        let mut measure = |_: usize, _: usize, z: &mut [f64]| {
            z.copy_from_slice(&run.residuals[first..first + z.len()]);
            first += z.len();
        };
        let covariance = Covariance::new("P0", &p0, CovarianceForm::Ud)?;
        let steps = run.stages.len();
        let gains = filter_pass(&run.stages, covariance, &mut delta, &mut measure, |step, x, p, w| {
            whitened.extend_from_slice(w);
            if step + 1 == steps {
                end = Some((x.to_vec(), p.sigmas()));
            }
        })?;
        let smoothed = smoothed_start(&run.stages, &gains, &whitened, &p0)?;
        Ok(Self { end, whitened, smoothed })
    }
}

impl Diagnosed {
    /// Diagnosis of an estimate.
    ///
    /// # Errors
    /// [`EkfError`].
    pub(crate) fn of(
        problem: &PlatformProblem<'_>,
        estimate: &PlatformEstimate,
        prediction: &Prediction,
    ) -> Result<Self, EkfError> {
        let mut out = Self {
            all: Vec::new(),
            second: SecondPath { difference: 0.0, sigma_difference: 0.0 },
            alone: Vec::new(),
            white: RefCell::default(),
        };
        for (r, (run, keys)) in estimate.at.runs.iter().enumerate() {
            let prior = wide_prior(problem, r);
            let path = FilterPath::along(run, &prior)?;
            out.add(r, run, keys, &path);
            out.compare(run, &estimate.at.information[r], (&prior[..], &path), prediction)?;
        }
        Ok(out)
    }

    /// Adds the residuals of run `r`.
    fn add(&mut self, r: usize, run: &Linearised, keys: &[MeasurementKey], path: &FilterPath) {
        let variances = run.stages.iter().flat_map(|s| &s.outputs).map(|o| o.r);
        let each = path.smoothed.left_out.iter().zip(variances).zip(keys).zip(&path.whitened);
        for (((left, r_of), key), innovation) in each {
            self.all.push(MeasurementResidual {
                run: r,
                key: *key,
                residual: r_of * left.u,
                r: r_of,
                free: r_of * left.variance,
                normalised: left.normalised(),
                innovation: *innovation,
            });
        }
    }

    /// Compares the end of a filter along a run with that of least squares with the same prior.
    fn compare(
        &mut self,
        run: &Linearised,
        information: &StartInformation,
        (prior, path): (&[f64], &FilterPath),
        prediction: &Prediction,
    ) -> Result<(), EkfError> {
        let n = prior.len();
        let mut rows = StackedRows::new(n);
        rows.add(&information.root, &information.right);
        let pull = DVector::from_iterator(n, prior.iter().map(|s| 1.0 / s));
        rows.add(&DMatrix::from_diagonal(&pull), &DVector::zeros(n));
        let batch = rows.solve()?;
        self.alone.push(information.left + batch.left);
        let start = RunState { correction: batch.x.clone(), root: batch.inverse_root.clone() };
        let states = information.states(run, start)?;
        if let (Some((x, sigmas)), Some(last)) = (&path.end, states.last()) {
            let determined = |s: usize| prediction.unknowns.get(s).is_some_and(|u| u.determined_at_end);
            let second = &mut self.second;
            for (i, (x, sigma)) in x.iter().zip(sigmas).enumerate().filter(|(s, _)| determined(*s)) {
                let own = last.sigma(i);
                second.difference = second.difference.max((x - last.correction[i]).abs() / sigma);
                second.sigma_difference = second.sigma_difference.max((own / sigma - 1.0).abs());
            }
        }
        Ok(())
    }

    /// Factors on the sigmas, by channel.
    pub(crate) fn channel_factors(&self, channels: usize) -> Vec<f64> {
        let of = |c| {
            let (chi, free) = self.sums(|l| l.key.channel == c);
            if free > 0.0 && chi > 0.0 { (chi / free).sqrt() } else { 1.0 }
        };
        (0..channels).map(of).collect()
    }

    /// Sum of squares and degrees of freedom of some measurements.
    pub(super) fn sums(&self, of: impl Fn(&MeasurementResidual) -> bool) -> (f64, f64) {
        let some = self.all.iter().filter(|l| of(l));
        some.fold((0.0, 0.0), |(chi, free), l| (chi + l.square(), free + l.free))
    }

    /// Measurements farther off than `gate`, in units of the usual size of residuals if that exceeds one.
    pub(crate) fn beyond(&self, gate: f64) -> Vec<(usize, MeasurementKey)> {
        let mut sizes: Vec<f64> = self.all.iter().map(|l| l.normalised.abs()).collect();
        if sizes.is_empty() {
            return Vec::new();
        }
        let middle = sizes.len() / 2;
        let usual = (*sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745).max(1.0);
        let off = self.all.iter().filter(|l| l.normalised.abs() > gate * usual);
        off.map(|l| (l.run, l.key)).collect()
    }
}

/// Data of an answer.
pub(crate) struct AnswerData<'a> {
    pub scheme: &'a Scheme,
    pub conditions: &'a Conditions,
    pub options: &'a Options,
    pub planned: &'a Plan,
    pub prediction: &'a Prediction,
    pub problem: &'a PlatformProblem<'a>,
    pub estimate: &'a PlatformEstimate,
    /// Last step by the linear model: the covariance of the estimate may be that of samples.
    pub linear: &'a LeastSquaresSolution,
    pub bent: &'a CurvatureResult,
    pub found: &'a Diagnosed,
    /// Beginning of the scheme by run; `None` where it was not estimated.
    pub offsets: &'a [Option<Offset>],
    /// Change of the measurements with the beginning, by run; `None` unless labels leave the beginning open.
    pub later: &'a [Option<Later>],
    /// Jump of a clock that explains most of an inconsistent fit.
    pub jump: Option<Jump>,
    pub too_many: Option<usize>,
    pub known: Vec<String>,
    pub rests_on: Vec<setup::SourceRecord>,
    pub interrupted: bool,
}

/// A functional that is reported.
pub(super) struct ReportedFunctional {
    name: String,
    unit: &'static str,
    status: Status,
    degree: Option<usize>,
    /// True if scheme and records determine it.
    pub determined: bool,
    /// True if they do so only with a prior that is stated.
    from_prior: bool,
    /// True if no covariance describes its error, because undetermined unknowns cause too much curvature.
    left_open: bool,
    /// On the unknowns, in SI.
    pub terms: Vec<(usize, f64)>,
    /// Coefficients in local coordinates at the estimate, with the platform at the attitudes of the scheme.
    local: Vec<(usize, f64)>,
    planned: Vec<(usize, f64)>,
}

/// Solutions that the reported numbers come from.
struct ReportedSolutions {
    /// Values of the unknowns, in SI.
    values: DVector<f64>,
    /// Solution with the prior of the scheme on everything.
    with_prior: LeastSquaresSolution,
    /// Solution in which the undetermined directions count as known.
    tight: LeastSquaresSolution,
    /// Solution with the platform at the attitudes of the scheme.
    planned: LeastSquaresSolution,
    /// Rows of the prior calibration, which no factor changes.
    known: DMatrix<f64>,
    /// Factor on the standard deviations of the measurements by the fit, at least one.
    factor: f64,
}

impl ReportedFunctional {
    /// True if there is an estimate with a sigma.
    fn stands(&self) -> bool {
        self.determined && !self.left_open
    }
}

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
            Some((mean, _)) => problem.values(&problem.moved(&self.estimate.at.x, mean)),
            None => problem.values(&self.estimate.at.x),
        };
        let tight = problem.step_constrained(&self.estimate.at, TIGHT)?;
        let planned: LinearisedRuns = problem.at(at_rest)?;
        let planned = problem.step(&planned, WEAK)?;
        let none = || DMatrix::zeros(0, problem.unknowns.n);
        let known = problem.known.as_ref().map_or_else(none, |(rows, _)| rows.clone());
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

    fn positions(&self, determined: &[&ReportedFunctional]) -> Result<Vec<PositionFit>, EkfError> {
        let names = &self.scheme.positions;
        let mut out = Vec::new();
        for (r, run) in self.problem.runs.iter().enumerate() {
            for (p, position) in names.iter().enumerate() {
                let (chi, free) = self.found.sums(|l| l.run == r && l.key.position == p);
                let measurements =
                    self.found.all.iter().filter(|l| l.run == r && l.key.position == p).count();
                let (start_s, end_s) = run.reading.stays.get(p).copied().unwrap_or((0.0, 0.0));
                let (moves, loses) = self.without(r, p, determined)?;
                out.push(PositionFit {
                    record: run.reading.name.clone(),
                    position: position.name.clone(),
                    start_s: run.reading.origin + start_s,
                    end_s: run.reading.origin + end_s,
                    force_g: run.reading.lengths.get(p).copied().flatten().map(|l| l.length),
                    measurements,
                    chi_square: chi / free.max(f64::MIN_POSITIVE),
                    degrees_of_freedom: free,
                    moves,
                    loses,
                });
            }
        }
        Ok(out)
    }

    /// Change of the estimates without a position of a run, and the unknowns that are then lost.
    fn without(
        &self,
        r: usize,
        p: usize,
        determined: &[&ReportedFunctional],
    ) -> Result<(Option<Moved>, Vec<String>), EkfError> {
        let (run, keys): &(Linearised, Vec<MeasurementKey>) = &self.estimate.at.runs[r];
        let keep: Vec<bool> = keys.iter().map(|k| k.position != p).collect();
        let rest = StartInformation::of(&run.without(&keep))?;
        let solution = self.problem.step_with(&self.estimate.at, WEAK, Some((r, &rest)))?;
        let (mut moves, mut loses): (Option<Moved>, _) = (None, Vec::new());
        for a in determined {
            let (with, without) = (self.linear.sigma(&a.local), solution.sigma(&a.local));
            if without > LOST * with {
                loses.push(a.name.clone());
                continue;
            }
            let by: f64 = a.local.iter().map(|&(i, k)| k * solution.x[i]).sum();
            let expected = (without * without - with * with).max(1e-12 * with * with).sqrt();
            let sigmas = by / expected;
            if moves.as_ref().is_none_or(|m| sigmas.abs() > m.sigmas.abs()) {
                moves = Some(Moved { name: a.name.clone(), sigmas });
            }
        }
        Ok((moves, loses))
    }

    fn channels(&self) -> Vec<ChannelFit> {
        let of = |(c, &component): (usize, &usize)| {
            let (chi, free) = self.found.sums(|l| l.key.channel == c);
            let means = self.problem.runs.iter().flat_map(|run| run.measured());
            let (scatter, scatter_free) = means
                .filter(|(key, ..)| key.channel == c)
                .fold((0.0, 0), |(s, f), (_, m, _)| (s + m.scatter, f + m.free));
            let white = (0..self.problem.runs.len()).filter_map(|r| self.whiteness(r, c));
            ChannelFit {
                channel: channel_name(component),
                unit: if component == AZIMUTH { "rad".into() } else { "g".into() },
                sigma: self.problem.sigmas[c],
                scatter: (scatter_free > 0).then(|| (scatter / scatter_free as f64).sqrt()),
                chi_square: chi / free.max(f64::MIN_POSITIVE),
                degrees_of_freedom: free,
                whiteness_probability: white.reduce(f64::min),
                temperature: (0..self.problem.runs.len())
                    .filter_map(|r| self.warmth(r, c))
                    .min_by(|a, b| a.probability.total_cmp(&b.probability)),
            }
        };
        self.planned.components.iter().enumerate().map(of).collect()
    }

    fn records(&self) -> Vec<RecordReport> {
        let of = |(r, run): (usize, &super::run::RecordedRun)| RecordReport {
            clock: self.clock(r),
            name: run.reading.name.clone(),
            samples: run.reading.samples,
            interval_s: run.reading.interval,
            gaps: run.reading.gaps(self.scheme),
            empty_cells: run.reading.empty_cells(),
            psi_at_s: run.reading.origin,
            unused: run.reading.unused,
            waiting: run.reading.waiting,
            bins: run.len(),
            span_s: run.reading.span,
            positions_by: run.reading.by.into(),
            change_open_s: run.changes.iter().map(|c| c.open).reduce(f64::max),
            gimbals_deg: run.reading.gimbals,
            ignored: run.reading.ignored.clone(),
            force_g: run.reading.force,
        };
        self.problem.runs.iter().enumerate().map(of).collect()
    }

    /// Keys of the conditions that are not stated.
    fn chosen(&self) -> Vec<String> {
        let stated = self.conditions.states();
        let all = [
            ("latitude_deg", self.scheme.latitude.is_none()),
            ("accelerometer_noise_g", !stated.accelerometer_noise && !self.options.estimate_noise),
            ("drift_noise", !stated.drift_noise && self.conditions.drift_noise.amount() > 0.0),
        ];
        all.into_iter().filter(|(_, by_default)| *by_default).map(|(key, _)| key.into()).collect()
    }

    /// Unknowns of a run with a stated prior: name, standard deviation, unit.
    fn priors(&self) -> Vec<(String, f64, String)> {
        let (names, units) = (self.planned.platform.names(), self.planned.platform.units());
        let u = &self.problem.unknowns;
        let stated = (0..names.len()).filter(|&s| u.stated.contains(&u.index[0][s]));
        stated
            .map(|s| {
                (
                    names[s].clone(),
                    u.prior[u.index[0][s]] / si_per_shown(units[s]),
                    shown_unit(units[s]).into(),
                )
            })
            .collect()
    }

    fn assumed(&self, unknowns: &[ReportedFunctional]) -> Assumed {
        let c = self.conditions;
        let open = unknowns.iter().filter(|a| !a.determined);
        let constrained = open.map(|a| {
            let width = BOX * self.problem.unknowns.prior[a.terms[0].0] / si_per_shown(a.unit);
            (a.name.clone(), width, shown_unit(a.unit).to_string())
        });
        Assumed {
            latitude_deg: latitude_of(self.scheme).map_or(0.0, |l| l.degrees()),
            latitude_by_default: self.scheme.latitude.is_none(),
            gravity_m_s2: self.options.gravity_m_s2,
            bin_s: c.step_s,
            accelerometer_noise_g: c.accelerometer_noise_g,
            noise_estimated: self.options.estimate_noise,
            drift_noise_deg_sqrt_h: c.drift_noise.density_deg_sqrt_h(c.drift_noise_step_s),
            gate: self.options.gate,
            known: self.known.clone(),
            priors: self.priors(),
            known_differs: self.options.prior.as_ref().map_or_else(Vec::new, |before| {
                let own = Setup::of(self.scheme);
                let differs = if before.of.terms == own.terms { None } else { Some(before.of.terms.clone()) };
                differs.map(|terms| format!("terms {terms} instead of {}", own.terms)).into_iter().collect()
            }),
            constrained: constrained.collect(),
            by_default: self.chosen(),
            seed: self.options.seed,
        }
    }
}

/// Maps both ends of a band.
pub(super) trait MapBoth {
    fn map_both(self, f: impl Fn(f64) -> f64) -> Self;
}

impl MapBoth for (f64, f64) {
    fn map_both(self, f: impl Fn(f64) -> f64) -> Self {
        (f(self.0), f(self.1))
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

//! Evidence d: Monte Carlo runs. Linear truths are drawn from the prior. An exact truth has the scheme's own
//! drifts for every filter. Initial estimates are drawn about it, so that the errors have the covariance of
//! the prior and the drifts are those of the platform. The linear filter makes its covariance pass once; each
//! run is a truth and a state pass. Runs are summed in a fixed order, so that the result does not depend on
//! the number of threads.

use nalgebra::DMatrix;
use obsdeg_core::model::settings::{FilterKind, Truth};
use obsdeg_core::span::Span;
use obsdeg_ekf::consistency::{Nees, chi_square_band};
use obsdeg_ekf::linear::{covariance_pass, state_pass};
use obsdeg_ekf::{Covariance, CovarianceForm, Gains, Manifold, Update};
use obsdeg_exact::parallel;

use super::answer::{HistoryPoint, Statistic};
use crate::simulation::SimulationError;
use crate::simulation::answer::Validity;
use crate::simulation::conditions::Conditions;
use crate::simulation::extended::ExtendedFilter;
use crate::simulation::iterated::iterated;
use crate::simulation::plan::Plan;
use crate::simulation::record::{RunStart, choose, first_steps, largest_psi, sample};
use crate::simulation::state::PlatformState;
use crate::simulation::truth::{Noise, TruthModel, check_drifts};

/// Number of times at which NEES is taken.
const CHECKPOINTS: usize = 20;
/// Largest lag of the autocorrelation, in samples.
const LAGS: usize = 10;
/// Runs per task, then tasks between two progress reports.
const CHUNK: usize = 8;
const BATCH: usize = 32;

/// Filter and truth of a Monte Carlo experiment.
pub struct MonteCarloExperiment<'a> {
    /// Model of the filter.
    pub filter: &'a Plan,
    /// Model of the truth, on the same timeline.
    pub truth: &'a Plan,
    /// Conditions of filter and truth.
    pub conditions: &'a Conditions,
    /// Basis of the directions unobservable from Z (SI units); `None` unless all of them are known.
    pub null_space: Option<&'a [Vec<(usize, f64)>]>,
    /// Seed of all random streams.
    pub seed: u64,
}

/// Sums over the runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Totals {
    /// Number of runs.
    pub runs: usize,
    /// NEES of all unknowns at every checkpoint.
    nees: Vec<f64>,
    /// NEES of the observable subspace at the end.
    nees_observable: f64,
    /// NIS of the samples up to every checkpoint.
    nis: Vec<f64>,
    /// Products of whitened innovations at lags 0, 1, ...
    lagged: [f64; LAGS + 1],
    /// Largest `|psi|` of all runs.
    pub largest_psi: f64,
    /// Number of runs whose linearisation did not converge, or that ended in numbers that are not finite.
    pub unsettled: usize,
    /// Sums of the squared errors at the end, in units of the prior sigma, per unknown; empty for the linear
    /// filter.
    pub errors: Vec<f64>,
}

impl Totals {
    fn none(checkpoints: usize) -> Self {
        Self {
            runs: 0,
            nees: vec![0.0; checkpoints],
            nees_observable: 0.0,
            nis: vec![0.0; checkpoints],
            lagged: [0.0; LAGS + 1],
            largest_psi: 0.0,
            unsettled: 0,
            errors: Vec::new(),
        }
    }

    fn add(&mut self, other: &Self) {
        self.runs += other.runs;
        self.unsettled += other.unsettled;
        let sum = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        sum(&mut self.nees, &other.nees);
        sum(&mut self.nis, &other.nis);
        sum(&mut self.lagged, &other.lagged);
        self.errors.resize(other.errors.len(), 0.0);
        sum(&mut self.errors, &other.errors);
        self.nees_observable += other.nees_observable;
        self.largest_psi = self.largest_psi.max(other.largest_psi);
    }

    /// Adds the products of the whitened innovations of a run, `outputs` per sample.
    fn correlate(&mut self, whitened: &[f64], outputs: usize) {
        for (lag, sum) in self.lagged.iter_mut().enumerate() {
            let later = whitened.get(lag * outputs..).unwrap_or(&[]);
            *sum += whitened.iter().zip(later).map(|(a, b)| a * b).sum::<f64>();
        }
    }
}

/// Data common to all runs: gains, and factors of the covariance at the checkpoints.
pub struct PreparedExperiment<'a> {
    experiment: MonteCarloExperiment<'a>,
    gains: Gains,
    start: RunStart,
    truth_start: RunStart,
    /// Numbers of the steps after which NEES is taken; the last one ends the run.
    checkpoints: Vec<usize>,
    nees: Vec<Nees>,
    /// Observable subspace at the end: its basis (n x r), and the factor of its covariance.
    observable: Option<(DMatrix<f64>, Nees)>,
    first_step: Vec<usize>,
    /// Kind of the filter that runs.
    kind: FilterKind,
}

impl<'a> PreparedExperiment<'a> {
    /// Prepares an experiment: runs the covariance pass.
    ///
    /// # Errors
    /// [`SimulationError`].
    pub fn new(experiment: MonteCarloExperiment<'a>) -> Result<Self, SimulationError> {
        let (filter, conditions) = (experiment.filter, experiment.conditions);
        let start = RunStart::new(filter, &conditions.within(&filter.platform))?;
        let same = filter.platform.names() == experiment.truth.platform.names();
        let truth_start = if same && filter.biases == experiment.truth.biases {
            start.clone()
        } else {
            RunStart::new(experiment.truth, conditions)?
        };
        let kind = kind(&experiment, same)?;
        let unknowns = experiment.truth.unknowns();
        let first = unknowns - experiment.truth.platform.coefficients();
        let drawn = truth_start.estimate.iter().zip(&truth_start.sigma).take(unknowns).skip(first);
        // bound of six sigma
        let drawn: Vec<f64> = drawn.map(|(mean, sigma)| mean.abs() + 6.0 * sigma).collect();
        check_drifts(experiment.truth, conditions, experiment.truth.drift_bound(&drawn))?;
        let total: usize = filter.segments.iter().map(|s| s.steps).sum();
        let points = CHECKPOINTS.min(total);
        let checkpoints: Vec<usize> = (1..=points).map(|i| (i * total).div_ceil(points) - 1).collect();
        let mut covariances = Vec::with_capacity(points);
        let gains = covariance_pass(&filter.stages, start.covariance(CovarianceForm::Ud)?, |step, p| {
            if checkpoints.binary_search(&step).is_ok() {
                covariances.push(p.clone());
            }
        })?;
        let nees = covariances.iter().map(Nees::of_covariance).collect::<Result<_, _>>()?;
        // outputs may determine at large angles what they do not at small ones
        let null_space = experiment.null_space.filter(|_| same && kind == FilterKind::Linear);
        let basis = null_space.map(|null| observable_basis(&start.sigma, null));
        let observable = match (covariances.last(), basis) {
            (Some(p), Some(basis)) if basis.ncols() > 0 => {
                let nees = Nees::new(&symmetric(basis.transpose() * p.matrix() * &basis))?;
                Some((basis, nees))
            }
            _ => None,
        };
        let first_step = first_steps(experiment.truth);
        Ok(Self { experiment, gains, start, truth_start, checkpoints, nees, observable, first_step, kind })
    }

    /// True if filter and truth have the same unknowns, so that errors can be taken.
    fn comparable(&self) -> bool {
        self.experiment.filter.platform.names() == self.experiment.truth.platform.names()
    }

    /// Sums over `runs` runs in parallel; `progress` gets the number of finished runs and returns false to
    /// stop.
    pub fn run(&self, runs: usize, progress: &dyn Fn(usize) -> bool) -> Totals {
        let mut totals = Totals::none(self.checkpoints.len());
        for batch in (0..runs).step_by(CHUNK * BATCH) {
            let end = runs.min(batch + CHUNK * BATCH);
            let starts: Vec<usize> = (batch..end).step_by(CHUNK).collect();
            let of = |i: usize| self.chunk(starts[i], end.min(starts[i] + CHUNK));
            let chunks: Vec<Totals> = parallel::map(starts.len(), of);
            for chunk in &chunks {
                totals.add(chunk);
            }
            if !progress(end) {
                break;
            }
        }
        totals
    }

    /// Kind of the filter that runs.
    pub fn filter(&self) -> FilterKind {
        self.kind
    }

    /// True if runs start from the scheme's own truth, with initial estimates drawn about it: for an exact
    /// truth and a filter of its unknowns. Otherwise truths are drawn about the initial estimate.
    pub(crate) fn is_about_the_truth(&self) -> bool {
        self.experiment.conditions.truth == Truth::Exact && self.comparable()
    }

    /// Draws the truth of a run and an initial estimate about it: biases are random, all other true values
    /// are those of the scheme.
    fn draw_about_the_truth(&self, noise: &mut Noise, truth: &mut [f64], estimate: &mut [f64]) {
        let unknowns = self.experiment.truth.unknowns();
        truth.copy_from_slice(&self.truth_start.truth);
        let biases = truth.iter_mut().zip(&self.truth_start.sigma).skip(unknowns);
        biases.for_each(|(x, sigma)| *x = sigma * noise.normal());
        for ((x, truth), sigma) in estimate.iter_mut().zip(&*truth).zip(&self.start.sigma).take(unknowns) {
            *x = truth + sigma * noise.normal();
        }
    }

    /// Sums over the runs `from..to`, one after the other.
    pub fn chunk(&self, from: usize, to: usize) -> Totals {
        if self.kind == FilterKind::Linear { self.linear(from, to) } else { self.exact(from, to) }
    }

    /// Sums over the runs `from..to` of a filter with full attitudes.
    fn exact(&self, from: usize, to: usize) -> Totals {
        let MonteCarloExperiment { truth: plan, filter, conditions, seed, .. } = &self.experiment;
        let mut totals = Totals::none(self.checkpoints.len());
        let extended = ExtendedFilter::new(filter, conditions, Update::default())
            .expect("an exact truth has coefficients, and so has the filter of the same unknowns");
        let constants = plan.constants();
        let (mut start, mut from_truth, mut z) =
            (self.start.clone(), self.truth_start.truth.clone(), Vec::new());
        let mut truth = TruthModel::new(plan, conditions, self.truth_start.truth.clone());
        for run in from..to {
            let mut noise = Noise::new(*seed, run as u64 + 1);
            self.draw_about_the_truth(&mut noise, &mut from_truth, &mut start.estimate);
            truth.reset(&from_truth);
            let (mut states, mut taken) = (Vec::with_capacity(self.checkpoints.len()), 0);
            sample(&mut truth, plan, &mut noise, &mut z, |x| {
                // the first sample is the start
                if taken > 0 && self.checkpoints.get(states.len()) == Some(&(taken - 1)) {
                    states.push(PlatformState::of_unknowns(x, constants));
                }
                taken += 1;
            });
            let (mut next, mut whitened) = (0, Vec::new());
            let mut nis = vec![0.0; self.checkpoints.len()];
            let mut nees = vec![0.0; self.checkpoints.len()];
            let mut error = vec![f64::NAN; plan.unknowns()];
            let on_step = |step: usize, x: &PlatformState, p: &Covariance, innovations: &[f64]| {
                nis[next] += innovations.iter().map(|v| v * v).sum::<f64>();
                whitened.extend_from_slice(innovations);
                if self.checkpoints[next] == step {
                    let mut off = states[next].local(x);
                    error.copy_from_slice(&off[..plan.unknowns()]);
                    let mut of = |p: &Covariance| Nees::of_covariance(p)?.of(&mut off);
                    nees[next] = of(p).unwrap_or(f64::NAN);
                    next = (next + 1).min(self.checkpoints.len() - 1);
                }
            };
            let ended = match self.kind {
                FilterKind::Iterated => iterated(&extended, &start, &z, on_step),
                _ => extended.run(&start, &z, on_step),
            };
            totals.runs += 1;
            totals.largest_psi = totals.largest_psi.max(truth.largest_psi);
            let settled = ended.as_ref().is_ok_and(|e| e.converged);
            totals.unsettled += usize::from(!settled);
            if ended.is_err() {
                // a failed run counts, with NaN
                nis.fill(f64::NAN);
                nees.fill(f64::NAN);
                error.fill(f64::NAN);
            }
            let relative = error.iter().zip(&self.start.sigma).map(|(e, s)| (e / s).powi(2));
            totals.errors.resize(error.len(), 0.0);
            totals.errors.iter_mut().zip(relative).for_each(|(sum, e)| *sum += e);
            let sum = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            sum(&mut totals.nis, &nis);
            sum(&mut totals.nees, &nees);
            totals.correlate(&whitened, filter.components.len());
        }
        totals
    }

    /// Sums over the runs `from..to` of the linear filter.
    fn linear(&self, from: usize, to: usize) -> Totals {
        let MonteCarloExperiment { truth: plan, filter, conditions, seed, .. } = &self.experiment;
        let mut totals = Totals::none(self.checkpoints.len());
        let mut drawn = self.truth_start.estimate.clone();
        let mut truth = TruthModel::new(plan, conditions, drawn.clone());
        let (mut x, mut error) = (self.start.estimate.clone(), self.start.estimate.clone());
        let comparable = self.comparable();
        let mut whitened: Vec<f64> = Vec::new();
        for run in from..to {
            let mut noise = Noise::new(*seed, run as u64 + 1);
            x.copy_from_slice(&self.start.estimate);
            self.draw(&mut noise, &mut drawn, &mut x);
            truth.reset(&drawn);
            whitened.clear();
            let mut next = 0;
            let truth = std::cell::RefCell::new(&mut truth);
            state_pass(
                &filter.stages,
                &self.gains,
                &mut x,
                |step, segment, z| {
                    truth.borrow_mut().step(segment, step - self.first_step[segment], &mut noise, z);
                },
                |step, x, innovations| {
                    totals.nis[next] += innovations.iter().map(|v| v * v).sum::<f64>();
                    whitened.extend_from_slice(innovations);
                    if self.checkpoints[next] == step {
                        if comparable {
                            let truth = truth.borrow();
                            // a truth without biases has zeros in their place
                            let true_x = truth.x().iter().chain(std::iter::repeat(&0.0));
                            for ((e, a), b) in error.iter_mut().zip(x).zip(true_x) {
                                *e = a - b;
                            }
                            totals.nees[next] += self.nees[next].of(&mut error).unwrap_or(f64::NAN);
                        }
                        next = (next + 1).min(self.checkpoints.len() - 1);
                    }
                },
            )
            .expect("gains and states are those of the filter's stages");
            if comparable {
                totals.nees_observable += self.nees_observable(&x, truth.borrow().x());
            }
            totals.correlate(&whitened, filter.components.len());
            totals.largest_psi = totals.largest_psi.max(truth.borrow().largest_psi);
            totals.runs += 1;
        }
        totals
    }

    /// Draws the truth of a run of the linear filter: about its first estimate, or as
    /// [`Self::draw_about_the_truth`] does with an initial estimate.
    fn draw(&self, noise: &mut Noise, truth: &mut [f64], estimate: &mut [f64]) {
        if self.is_about_the_truth() {
            return self.draw_about_the_truth(noise, truth, estimate);
        }
        for ((x, mean), sigma) in
            truth.iter_mut().zip(&self.truth_start.estimate).zip(&self.truth_start.sigma)
        {
            *x = mean + sigma * noise.normal();
        }
    }

    /// NEES of the observable subspace for the estimate `x` at the end, where the true states are `truth`;
    /// zero without such a subspace.
    fn nees_observable(&self, x: &[f64], truth: &[f64]) -> f64 {
        let Some((basis, nees)) = &self.observable else { return 0.0 };
        // a truth without biases has zeros in their place
        let errors = || x.iter().zip(truth.iter().chain(std::iter::repeat(&0.0))).map(|(a, b)| a - b);
        let mut projected: Vec<f64> =
            basis.column_iter().map(|c| c.iter().zip(errors()).map(|(a, e)| a * e).sum()).collect();
        nees.of(&mut projected).unwrap_or(f64::NAN)
    }

    /// Number of samples of Z per run.
    fn samples(&self) -> usize {
        self.gains.updates() / self.experiment.filter.components.len()
    }

    /// ANEES of all unknowns and of the observable subspace, and the mean NIS.
    pub fn statistics(&self, totals: &Totals) -> Vec<Statistic> {
        let n = self.start.sigma.len();
        let outputs = self.experiment.filter.components.len();
        let runs = totals.runs as f64;
        let mut out = Vec::new();
        if self.comparable() {
            let last = totals.nees.last().copied().unwrap_or(0.0);
            let biases = self.experiment.filter.biases.len();
            let states = if biases > 0 { format!(" and {biases} biases") } else { String::new() };
            let name = format!("ANEES, {} unknowns{states}", n - biases);
            out.push(statistic(&name, n, last / runs, runs));
            if let Some((basis, _)) = &self.observable {
                let r = basis.ncols();
                let name = format!("ANEES, observable subspace ({r})");
                out.push(statistic(&name, r, totals.nees_observable / runs, runs));
            }
        }
        let samples = runs * self.samples() as f64;
        out.push(statistic("NIS", outputs, totals.nis.iter().sum::<f64>() / samples, samples));
        out
    }

    /// Probability of autocorrelations at least as large as those found, for white innovations.
    pub fn whiteness(&self, totals: &Totals) -> f64 {
        let sequences = totals.runs * self.experiment.filter.components.len();
        // a short run has no products at long lags
        let lags = LAGS.min(self.samples() - 1);
        if lags == 0 {
            return 1.0;
        }
        let correlations: Vec<f64> = totals.lagged[1..=lags].iter().map(|l| l / totals.lagged[0]).collect();
        obsdeg_ekf::consistency::ljung_box_of_sequences(&correlations, self.samples(), sequences)
    }

    /// Averages over the runs, by time.
    pub fn history(&self, totals: &Totals) -> Vec<HistoryPoint> {
        let plan = self.experiment.filter;
        // number of samples up to every step
        let (mut time, mut seen, mut count) = (Vec::new(), Vec::new(), 0);
        for (segment, stage) in plan.segments.iter().zip(&plan.stages) {
            for i in 1..=segment.steps {
                count += usize::from(!stage.outputs.is_empty());
                time.push(segment.start_s + segment.dt * i as f64);
                seen.push(count);
            }
        }
        let mut before = 0;
        let runs = totals.runs;
        self.checkpoints
            .iter()
            .enumerate()
            .map(|(i, &step)| {
                let samples = (seen[step] - before) * runs;
                before = seen[step];
                let nis = if samples > 0 { totals.nis[i] / samples as f64 } else { f64::NAN };
                HistoryPoint { t_s: time[step], nees: totals.nees[i] / runs as f64, nis, samples }
            })
            .filter(|p| p.samples > 0)
            .collect()
    }
}

/// Kind of the filter that is compared with the truth: the one that a single run would use.
fn kind(experiment: &MonteCarloExperiment<'_>, same: bool) -> Result<FilterKind, SimulationError> {
    let MonteCarloExperiment { filter, truth, conditions, seed, .. } = experiment;
    // a deliberately wrong filter is wrong in its linear model
    if conditions.truth != Truth::Exact || !same || filter.stages != truth.stages {
        return Ok(FilterKind::Linear);
    }
    let start = RunStart::new(truth, conditions)?;
    let psi = largest_psi(truth, conditions, &start, *seed)?;
    let validity = Validity::of(truth, conditions, &start.truth, psi)?;
    Ok(choose(filter, conditions, &validity)?.0)
}

fn statistic(name: &str, dof: usize, measured: f64, count: f64) -> Statistic {
    let wide_band: Span<f64> = chi_square_band(dof as f64, count, 0.999).into();
    Statistic {
        name: name.into(),
        expected: dof as f64,
        measured,
        band: chi_square_band(dof as f64, count, obsdeg_ekf::consistency::CONFIDENCE).into(),
        wide_band,
        pass: wide_band.contains(&measured),
    }
}

fn symmetric(m: DMatrix<f64>) -> DMatrix<f64> {
    (&m + m.transpose()) / 2.0
}

/// Functionals that vanish on the null space (n x r), orthonormal in units of the prior.
fn observable_basis(sigma: &[f64], null_space: &[Vec<(usize, f64)>]) -> DMatrix<f64> {
    let n = sigma.len();
    let mut seen: Vec<Vec<f64>> = Vec::new();
    let reduce = |v: &mut Vec<f64>, basis: &[Vec<f64>]| {
        // twice: Gram-Schmidt loses digits once
        for b in basis.iter().chain(basis) {
            let s: f64 = v.iter().zip(b).map(|(x, y)| x * y).sum();
            v.iter_mut().zip(b).for_each(|(x, y)| *x -= s * y);
        }
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v.iter_mut().for_each(|x| *x /= norm);
        norm
    };
    for vector in null_space {
        let mut v = vec![0.0; n];
        for &(i, x) in vector {
            v[i] = x / sigma[i];
        }
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v.iter_mut().for_each(|x| *x /= norm);
        reduce(&mut v, &seen);
        seen.push(v);
    }
    let hidden = seen.len();
    for i in 0..n {
        let mut v: Vec<f64> = (0..n).map(|j| f64::from(u8::from(i == j))).collect();
        if reduce(&mut v, &seen) > 1e-6 {
            seen.push(v);
        }
    }
    DMatrix::from_fn(n, seen.len() - hidden, |i, j| seen[hidden + j][i] / sigma[i])
}

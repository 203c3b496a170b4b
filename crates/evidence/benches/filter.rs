//! Run of the paper (15 states, 200 steps): one run, its stages, and 1000 runs.

use divan::{Bencher, black_box};
use obsdeg_core::model::settings::{FilterKind, Truth};
use obsdeg_core::model::{Carry, Scheme, parse_attitude};
use obsdeg_ekf::CovarianceForm;
use obsdeg_ekf::linear::covariance_pass;
use obsdeg_evidence::crosscheck::{MonteCarloExperiment, PreparedExperiment};
use obsdeg_evidence::simulation::{Conditions, Plan, RunStart};

fn main() {
    divan::main();
}

fn paper(truth: Truth) -> (Plan, Conditions) {
    let attitudes = ["0,0,0", "180,0,0"].map(|a| parse_attitude(a).expect("an attitude"));
    let scheme = Scheme { carry: Carry::Inertial, ..Scheme::of_angles(attitudes) };
    let conditions = Conditions { truth, filter: Some(FilterKind::Linear), ..Conditions::default() };
    (Plan::new(&scheme, &conditions).expect("a plan"), conditions)
}

fn experiment<'a>(plan: &'a Plan, conditions: &'a Conditions) -> MonteCarloExperiment<'a> {
    MonteCarloExperiment { filter: plan, truth: plan, conditions, null_space: None, seed: 1 }
}

/// Covariance pass, truth, state pass, NEES, NIS and autocorrelations of one run.
#[divan::bench]
fn one_run_whole(bencher: Bencher<'_, '_>) {
    let (plan, conditions) = paper(Truth::Linear);
    bencher.bench(|| {
        let prepared = PreparedExperiment::new(experiment(&plan, &conditions)).expect("prepared");
        black_box(prepared.chunk(0, 1))
    });
}

/// The covariance pass alone, in both forms.
#[divan::bench(args = [CovarianceForm::Joseph, CovarianceForm::Ud])]
fn covariance(bencher: Bencher<'_, '_>, form: &CovarianceForm) {
    let (plan, conditions) = paper(Truth::Linear);
    let start = RunStart::new(&plan, &conditions).expect("a start");
    bencher.bench(|| {
        let prior = start.covariance(*form).expect("a prior");
        black_box(covariance_pass(&plan.stages, prior, |_, _| {}).expect("shapes"))
    });
}

/// One more run, once the gains are known: truth, state pass and statistics.
#[divan::bench(args = [Truth::Linear, Truth::Exact])]
fn one_more_run(bencher: Bencher<'_, '_>, truth: &Truth) {
    let (plan, conditions) = paper(*truth);
    let prepared = PreparedExperiment::new(experiment(&plan, &conditions)).expect("prepared");
    bencher.bench(|| black_box(prepared.chunk(0, 1)));
}

/// One more run against exact truth at the paper's drifts by a filter with full attitudes: once, and
/// linearised again along the whole run.
#[divan::bench(args = [FilterKind::Extended, FilterKind::Iterated])]
fn full_attitudes(bencher: Bencher<'_, '_>, filter: &FilterKind) {
    let (plan, conditions) = paper(Truth::Exact);
    let conditions = Conditions { filter: Some(*filter), ..conditions };
    let prepared = PreparedExperiment::new(experiment(&plan, &conditions)).expect("prepared");
    bencher.bench(|| black_box(prepared.chunk(0, 1)));
}

/// 1000 runs of the extended filter on all cores.
#[divan::bench(sample_count = 5)]
fn monte_carlo_extended(bencher: Bencher<'_, '_>) {
    let (plan, conditions) = paper(Truth::Exact);
    let conditions = Conditions { filter: Some(FilterKind::Extended), ..conditions };
    let prepared = PreparedExperiment::new(experiment(&plan, &conditions)).expect("prepared");
    bencher.bench(|| black_box(prepared.run(1000, &|_| true)));
}

/// Monte Carlo runs of the linear filter on all cores.
#[divan::bench(args = [1000, 10_000])]
fn monte_carlo(bencher: Bencher<'_, '_>, runs: usize) {
    let (plan, conditions) = paper(Truth::Linear);
    let prepared = PreparedExperiment::new(experiment(&plan, &conditions)).expect("prepared");
    bencher.bench(|| black_box(prepared.run(runs, &|_| true)));
}

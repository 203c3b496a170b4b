//! Suspects: errors that the scheme does not estimate and that would explain what the fit leaves.
//!
//! Residuals and the column of every omitted error go through the same filter, whose start says nothing: its whitened
//! innovations are residuals from which every change of the unknowns is taken out, with the random drift of the run.
//! Columns are those of small angles at the attitudes of the scheme. Of several records each has unknowns of its own.

use nalgebra::DMatrix;
use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{OmittedModel, OmittedTerm};
use obsdeg_core::omitted::{OmittedClass, omitted_verdicts};
use obsdeg_ekf::linear::{covariance_pass, state_pass};
use obsdeg_ekf::{Covariance, EkfError, Form};
use obsdeg_evidence::simulation::omitted::{
    Bench, ChangePerUnit, Explanation, OmittedColumns, Score, SuspectedChange, SuspectedError, Suspicion,
};
use obsdeg_evidence::simulation::{SegmentKind, shown_unit, si_per_shown};

use super::CalibrationError;
use super::estimate::{Estimate, Problem};
use super::run::{Key, Run};
use crate::answer::{Estimated, Omitted, SilentError};

/// How many times wider than the prior the start of the filter is.
const WIDE: f64 = 1e4;
/// Most estimates whose change is listed.
const CHANGES: usize = 3;

/// The omitted errors of a calibration: those that explain residuals, and those that no record of the scheme shows;
/// beside them what a bench adds to the sigma of every coefficient, by name in its shown unit (root of the sum of
/// squares), by the weights of the first record.
///
/// # Errors
/// [`CalibrationError`] for a number that is not finite.
pub(super) fn omitted(
    problem: &Problem<'_>,
    estimate: &Estimate,
    quantities: &[Estimated],
    (bench, seed): (&[Assignment], u64),
) -> Result<(Omitted, Vec<(String, f64)>), CalibrationError> {
    let Some(first) = problem.runs.first() else { return Ok(Default::default()) };
    let platform = &first.plan.platform;
    let model = OmittedModel::new(platform);
    let classes = omitted_verdicts(platform, &model, seed).ok();
    let class = |j: usize| classes.as_ref().map(|v| v.terms[j].class);
    let shown = (0..model.terms().len()).map(|j| class(j).is_none_or(|c| c == OmittedClass::Visible));
    let tested = tested(problem, estimate, &model, shown.collect())?;
    let silent = classes.iter().flat_map(|v| v.terms.iter().enumerate());
    let silent = silent.filter(|(_, t)| t.class == OmittedClass::Silent).map(|(j, t)| SilentError {
        name: t.name.clone(),
        unit: model.terms()[j].unit.into(),
        changes: t.changes.clone(),
        sensitivities: tested.per_unit(j, model.terms()[j].unit, &t.changes),
    });
    let suspicion = tested.score.explanation().map(|found| suspicion(&found, &model, &tested, quantities));
    let found = Omitted {
        tried: tested.score.tried().len(),
        suspicion,
        silent: silent.filter(|s| s.changes.iter().any(|c| !c.starts_with("psi"))).collect(),
    };
    let size =
        |t: &OmittedTerm| Bench::size_of(bench, t.family, &t.name).unwrap_or(0.0) * si_per_shown(t.unit);
    let sizes: Vec<f64> = model.terms().iter().map(size).collect();
    let added =
        |changes: &[f64]| changes.iter().zip(&sizes).map(|(b, s)| (b * s).powi(2)).sum::<f64>().sqrt();
    let added = tested.changes.iter().map(|(name, unit, of)| (name.clone(), added(of) / si_per_shown(unit)));
    Ok((found, added.collect()))
}

/// Sums of all runs, and the change of every coefficient of the platform per SI unit of every error.
struct Tested {
    score: Score,
    /// By name of the coefficient, with its unit.
    changes: Vec<(String, &'static str, Vec<f64>)>,
}

impl Tested {
    /// Changes of the coefficients `of` per unit of error `j`.
    fn per_unit(&self, j: usize, unit: &str, of: &[String]) -> Vec<ChangePerUnit> {
        let own = self.changes.iter().filter(|(name, ..)| of.contains(name));
        own.map(|(name, of, changes)| ChangePerUnit {
            unknown: name.clone(),
            unit: shown_unit(of).into(),
            per_unit: changes[j] * si_per_shown(unit) / si_per_shown(of),
        })
        .collect()
    }
}

fn tested(
    problem: &Problem<'_>,
    estimate: &Estimate,
    model: &OmittedModel,
    shown: Vec<bool>,
) -> Result<Tested, CalibrationError> {
    let m = model.terms().len();
    let mut score = Score {
        products: DMatrix::zeros(m, m),
        against: vec![0.0; m],
        chi_square: 0.0,
        degrees_of_freedom: 0.0,
        shown,
    };
    let mut changes = Vec::new();
    for (r, (run, (linear, keys))) in problem.runs.iter().zip(&estimate.at.runs).enumerate() {
        let columns = columns(run, model, keys)?;
        let prior = problem.unknowns.index[r]
            .iter()
            .enumerate()
            .map(|(s, &i)| problem.unknowns.prior[i] * if s < run.plan.unknowns() { WIDE } else { 1.0 });
        let prior: Vec<f64> = prior.collect();
        let n = prior.len();
        let variances = nalgebra::DVector::from_iterator(n, prior.iter().map(|s| s * s));
        let covariance = Covariance::new("P0", &DMatrix::from_diagonal(&variances), Form::Ud)?;
        let gains = covariance_pass(&linear.stages, covariance, |_, _| {})?;
        let through = |z: &[f64]| -> Result<(Vec<f64>, Vec<f64>), EkfError> {
            let (mut x, mut whitened, mut next) = (vec![0.0; n], Vec::with_capacity(z.len()), 0);
            let measure = |_: usize, _: usize, out: &mut [f64]| {
                out.copy_from_slice(&z[next..next + out.len()]);
                next += out.len();
            };
            state_pass(&linear.stages, &gains, &mut x, measure, |_, _, w| whitened.extend_from_slice(w))?;
            Ok((x, whitened))
        };
        let (_, own) = through(&linear.residuals)?;
        let passed = columns.iter().map(|z| through(z)).collect::<Result<Vec<_>, _>>()?;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (j, (_, column)) in passed.iter().enumerate() {
            score.against[j] += dot(column, &own);
            for (k, (_, other)) in passed.iter().enumerate().take(j + 1) {
                let product = dot(column, other);
                score.products[(j, k)] += product;
                if k < j {
                    score.products[(k, j)] += product;
                }
            }
        }
        score.chi_square += dot(&own, &own);
        score.degrees_of_freedom += own.len() as f64 - run.plan.unknowns() as f64;
        if r == 0 {
            let platform = &run.plan.platform;
            let coefficients = run.plan.unknowns() - platform.coefficients()..run.plan.unknowns();
            changes = coefficients
                .map(|c| {
                    let of = passed.iter().map(|(x, _)| x[c]).collect();
                    (platform.names()[c].clone(), platform.units()[c], of)
                })
                .collect();
        }
    }
    Ok(Tested { score, changes })
}

/// The columns of all errors in the measurements of a run, in their order.
fn columns(run: &Run, model: &OmittedModel, keys: &[Key]) -> Result<Vec<Vec<f64>>, CalibrationError> {
    let m = model.terms().len();
    let mut of_bins: Vec<Vec<f64>> = Vec::new();
    let mut columns = OmittedColumns::new(&run.plan, model);
    for (segment, bin) in run.plan.segments.iter().zip(&run.bins) {
        let mut last = Vec::new();
        for _ in 0..segment.steps {
            last = columns.step()?.unwrap_or_default().to_vec();
        }
        if bin.is_some() && !matches!(segment.kind, SegmentKind::Slew(_)) {
            of_bins.push(last);
        }
    }
    let entry = |j: usize, key: &Key| of_bins.get(key.bin).and_then(|b| b.get(key.channel * m + j)).copied();
    Ok((0..m).map(|j| keys.iter().map(|k| entry(j, k).unwrap_or(0.0)).collect()).collect())
}

/// The suspicion in names and units.
fn suspicion(
    found: &Explanation,
    model: &OmittedModel,
    tested: &Tested,
    quantities: &[Estimated],
) -> Suspicion {
    let terms = model.terms();
    let errors = found.errors.iter().zip(&found.estimates).map(|(&j, [estimate, sigma])| {
        let scale = si_per_shown(terms[j].unit);
        SuspectedError {
            name: terms[j].name.clone(),
            unit: terms[j].unit.into(),
            estimate: estimate / scale,
            sigma: sigma / scale,
        }
    });
    let mut changes: Vec<(f64, SuspectedChange)> = Vec::new();
    for (name, unit, per_unit) in &tested.changes {
        let Some(q) = quantities.iter().find(|q| q.name == *name) else { continue };
        let (Some(estimate), Some(sigma)) = (q.estimate, q.sigma) else { continue };
        let moved = found.errors.iter().zip(&found.estimates).map(|(&j, [size, _])| per_unit[j] * size);
        let moved = moved.sum::<f64>() / si_per_shown(unit);
        let unit = shown_unit(unit).to_string();
        let change = SuspectedChange { unknown: name.clone(), unit, estimate, with: estimate - moved };
        changes.push(((moved / sigma).abs(), change));
    }
    changes.sort_by(|a, b| b.0.total_cmp(&a.0));
    Suspicion {
        errors: errors.collect(),
        indistinguishable: found.group.iter().map(|&j| terms[j].name.clone()).collect(),
        chi_square_fall: found.fall,
        probability: found.probability,
        changes: changes.into_iter().take(CHANGES).map(|(_, c)| c).collect(),
    }
}

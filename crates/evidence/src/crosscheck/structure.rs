//! Evidence a and b: what the filter's model can tell apart, against what the exact verdicts say of it.

use nalgebra::DMatrix;
use obsdeg_core::model::Scheme;
use obsdeg_ekf::decomposition::singular_values;
use obsdeg_ekf::linear::covariance_pass;
use obsdeg_ekf::{Covariance, Form, SquareRootInformation};

use super::answer::{Check, Correlation, Count, NullEvidence, QuantityEvidence, SlopeCurve};
use super::rules;
use super::slopes::{self, slopes};
use crate::prediction::{Combination, Prediction};
use crate::simulation::batch::{batch, diffuse_prior};
use crate::simulation::conditions::{shown_unit, si_per_shown};
use crate::simulation::record::RunStart;
use crate::simulation::{Conditions, Plan, SimulationError};

/// Parts of a null vector that are smaller, beside its largest and by what Z shows of each alone, show no correlation
/// where other directions are hardly seen.
const SMALL_PART: f64 = 0.01;
/// What counts as not seen, relative to the best seen direction.
const UNSEEN: f64 = 1e-10;

/// Evidence a and b: what the filter's model can tell apart.
pub(super) struct Structure {
    pub(super) quantities: Vec<QuantityEvidence>,
    pub(super) null_space: Vec<NullEvidence>,
    pub(super) defect: Count,
    pub(super) slopes: Vec<SlopeCurve>,
    pub(super) correlation: Correlation,
}

impl Structure {
    /// The number of checks that fail, and of all checks.
    pub(super) fn failures(&self) -> (usize, usize) {
        let missing = self.quantities.iter().filter(|q| !q.modelled).map(|_| false);
        let measured = self.quantities.iter().flat_map(|q| [q.slope.pass, q.inflation.pass]);
        let null = self.null_space.iter().flat_map(|v| [v.seen.pass, v.correlation.and_then(|c| c.pass)]);
        rules::failures(measured.chain(null).chain(missing.map(Some)).chain([Some(self.defect.pass)]))
    }
}

/// Repositioning is instantaneous here, as in the exact verdicts: a slew moves psi by drifts of its own.
pub(super) fn structure(
    truth: &Plan,
    prediction: &Prediction,
    filter_scheme: &Scheme,
    conditions: &Conditions,
) -> Result<Structure, SimulationError> {
    let conditions = &still(conditions);
    let filter = Plan::derived(filter_scheme, conditions)?;
    let names = names(truth, prediction);
    let functionals = functionals(truth, &filter, prediction);
    let known: Vec<Combination> = functionals.iter().flatten().cloned().collect();
    let measured = slopes(filter_scheme, conditions, &known)?;
    let inflation = inflation(&filter, &known)?;
    let (null_space, defect) = null_evidence(truth, &filter, prediction, &inflation.correlation)?;
    Ok(Structure {
        quantities: quantities(&names, prediction, &functionals, &measured, &inflation.ratios),
        null_space,
        defect,
        slopes: curves(truth, prediction, &names, &functionals, &measured),
        correlation: Correlation {
            names: filter.platform.names().to_vec(),
            values: inflation.correlation.row_iter().map(|r| r.iter().copied().collect()).collect(),
        },
    })
}

/// Without drift noise and slews.
pub(super) fn still(conditions: &Conditions) -> Conditions {
    Conditions { slews: false, ..conditions.clone().without_drift_noise() }
}

/// Unknowns, then combinations.
fn names(plan: &Plan, prediction: &Prediction) -> Vec<String> {
    let combinations = prediction.combinations.iter().map(|c| c.expression.clone());
    plan.platform.names().iter().cloned().chain(combinations).collect()
}

/// Each of them as a functional of the filter's unknowns; `None` when the filter does not have them.
fn functionals(truth: &Plan, filter: &Plan, prediction: &Prediction) -> Vec<Option<Combination>> {
    let index = |c: usize| {
        let name = &truth.platform.names()[c];
        filter.platform.names().iter().position(|n| n == name)
    };
    let single = (0..truth.unknowns()).map(|c| vec![(c, 1.0)]);
    single
        .chain(prediction.combinations.iter().map(|c| c.terms.clone()))
        .map(|terms| terms.into_iter().map(|(c, k)| Some((index(c)?, k))).collect())
        .collect()
}

/// Evidence b.
struct Inflation {
    /// Of every functional: the factor on sigma.
    ratios: Vec<f64>,
    /// Correlation under the diffuse prior.
    correlation: DMatrix<f64>,
}

fn inflation(plan: &Plan, functionals: &[Combination]) -> Result<Inflation, SimulationError> {
    let prior = diffuse_prior(plan)?;
    let end = |factor: f64| {
        let sigma = prior.iter().map(|s| s * factor).collect();
        last_covariance(plan, &RunStart { truth: Vec::new(), estimate: Vec::new(), sigma }, Form::Ud)
    };
    let (small, large) = (end(1.0)?, end(10.0)?);
    let ratio = |c: &Combination| Ok((large.variance(c)? / small.variance(c)?).sqrt());
    let ratios = functionals.iter().map(ratio).collect::<Result<_, obsdeg_ekf::EkfError>>()?;
    let n = plan.unknowns();
    let small = small.matrix();
    let sigma: Vec<f64> = (0..n).map(|i| small[(i, i)].sqrt()).collect();
    Ok(Inflation {
        ratios,
        correlation: DMatrix::from_fn(n, n, |i, j| small[(i, j)] / (sigma[i] * sigma[j])),
    })
}

pub(super) fn last_covariance(
    plan: &Plan,
    start: &RunStart,
    form: Form,
) -> Result<Covariance, SimulationError> {
    let prior = start.covariance(form)?;
    let mut last = prior.clone();
    let total: usize = plan.segments.iter().map(|s| s.steps).sum();
    covariance_pass(&plan.stages, prior, |step, p| {
        if step + 1 == total {
            last = p.clone();
        }
    })?;
    Ok(last)
}

fn quantities(
    names: &[String],
    prediction: &Prediction,
    functionals: &[Option<Combination>],
    slopes: &slopes::Slopes,
    ratios: &[f64],
) -> Vec<QuantityEvidence> {
    let unknowns = prediction.unknowns.iter();
    let unknowns = unknowns.map(|u| (u.status, u.degree, u.accuracy_order, u.determined_at_end));
    let combinations = prediction.combinations.iter();
    let combinations = combinations.map(|c| (c.status, c.degree, c.accuracy_order, c.determined_at_end));
    let mut measured = slopes.slopes.iter().zip(&slopes.straight).zip(ratios);
    names
        .iter()
        .zip(unknowns.chain(combinations))
        .zip(functionals)
        .map(|((name, (status, degree, accuracy_order, at_end)), functional)| {
            let found = functional.as_ref().and_then(|_| measured.next());
            let (slope, ratio) = (found.map(|f| *f.0.0), found.map(|f| *f.1));
            // the slope is that of the start, the inflation that of the end
            let inflation = rules::LINEAR.check(at_end, ratio);
            let mut slope = rules::slope(accuracy_order, slope);
            // what no slope shows is no evidence against an order where the measurements determine it all the same, nor
            // are slopes of what they do not determine, which rounding makes under so wide a prior
            let bent = found.is_some_and(|f| !f.0.1);
            if slope.fails() && (bent || accuracy_order.is_none()) && !inflation.fails() {
                slope.pass = None;
            }
            QuantityEvidence {
                name: name.clone(),
                status,
                degree,
                accuracy_order,
                modelled: functional.is_some(),
                slope,
                inflation,
            }
        })
        .collect()
}

/// What Z does not see: the predicted null vectors against the information, and their number.
fn null_evidence(
    truth: &Plan,
    filter: &Plan,
    prediction: &Prediction,
    correlation: &DMatrix<f64>,
) -> Result<(Vec<NullEvidence>, Count), SimulationError> {
    let n = filter.unknowns();
    let root = batch(filter, SquareRootInformation::none(n))?.information;
    // columns of unit length, so that units do not matter
    let norms: Vec<f64> =
        root.root().column_iter().map(|c| c.norm()).map(|x| if x > 0.0 { x } else { 1.0 }).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| root.root()[(i, j)] / norms[j]);
    let (values, _) = singular_values(&scaled)?;
    let largest = values.first().copied().unwrap_or(1.0);
    let defect = rules::defect(truth.unknowns() - prediction.rank, &values, UNSEEN);
    let mut evidence = Vec::new();
    for (k, vector) in prediction.null_space.iter().enumerate() {
        let names = truth.platform.names();
        let parts: Vec<String> =
            vector.iter().map(|(c, x)| format!("{} = {}", names[*c], short(*x))).collect();
        let comparable = names == filter.platform.names();
        let seen = comparable.then(|| {
            let mut v = nalgebra::DVector::zeros(n);
            for &(c, x) in vector {
                v[c] = x * norms[c];
            }
            (&scaled * &v).norm() / (v.norm() * largest)
        });
        // only where all null vectors are known is it known that no other shares its unknowns
        let shares = |other: &Combination| other.iter().any(|(c, _)| vector.iter().any(|(d, _)| c == d));
        let alone = prediction
            .whole_null_space()
            .is_some_and(|all| all.iter().enumerate().all(|(i, other)| i == k || !shares(other)));
        let correlation = (comparable && alone && vector.len() > 1).then(|| {
            let pairs = vector.iter().enumerate().flat_map(|(i, a)| vector[..i].iter().map(move |b| (a, b)));
            let signed = pairs.map(|(a, b)| correlation[(a.0, b.0)] * (a.1 * b.1).signum());
            // NaN stays
            let smallest = signed.fold(1.0, |a: f64, b| if b >= a { a } else { b });
            let mut check = Check::new(1.0, Some(smallest), |x| x > 0.999);
            // a part that is small beside the others is moved more by what else is hardly seen
            let parts = vector.iter().map(|&(c, x)| (x * norms[c]).abs());
            let (least, most) = parts.fold((f64::MAX, 0.0f64), |(l, m), x| (l.min(x), m.max(x)));
            if check.fails() && least < SMALL_PART * most {
                check.pass = None;
            }
            check
        });
        evidence.push(NullEvidence {
            direction: parts.join(", "),
            seen: Check::new(0.0, seen, |s| s <= UNSEEN),
            correlation,
        });
    }
    Ok((evidence, defect))
}

/// A number in few digits.
fn short(x: f64) -> String {
    let text = format!("{x:.4e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    if exponent == "0" { digits.into() } else { format!("{digits}e{exponent}") }
}

fn curves(
    truth: &Plan,
    prediction: &Prediction,
    names: &[String],
    functionals: &[Option<Combination>],
    measured: &slopes::Slopes,
) -> Vec<SlopeCurve> {
    let orders = prediction.unknowns.iter().map(|u| u.accuracy_order);
    let orders = orders.chain(prediction.combinations.iter().map(|c| c.accuracy_order));
    let leads = (0..truth.unknowns()).chain(prediction.combinations.iter().map(|c| c.terms[0].0));
    let present = functionals.iter().zip(names).zip(orders.zip(leads)).filter(|((f, _), _)| f.is_some());
    present
        .zip(&measured.sigmas)
        .map(|(((_, name), (accuracy_order, lead)), sigmas)| {
            let unit = truth.platform.units()[lead];
            let scale = si_per_shown(unit);
            SlopeCurve {
                name: name.clone(),
                unit: shown_unit(unit).into(),
                accuracy_order,
                points: measured.dwells.iter().zip(sigmas).map(|(&t, s)| (t, s / scale)).collect(),
            }
        })
        .collect()
}

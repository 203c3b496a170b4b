//! Comparison of the exact verdicts on any system with the information of its samples, linearised along the
//! true run.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::degree::{Status, Verdict};
use obsdeg_core::system::{
    Compiled, DigitsReport, Judgement, ModelError, PolynomialDirection, Role, StateStart, Symmetry,
    SystemModel, Unknown, judge_compiled, symmetries, symmetry_reports,
};
use obsdeg_ekf::decomposition::singular_values;
use obsdeg_ekf::integrate::runge_kutta;
use obsdeg_ekf::{EkfError, Measurement, SquareRootInformation};
use schemars::JsonSchema;
use serde::Serialize;

use super::numeric::{FilterState, Numeric};
use super::run::{RunError, RunNumbers};
use crate::crosscheck::answer::{Agreement, Check, Count, Counts, Measured};
use crate::crosscheck::rules::{self, SLOPE_TOLERANCE};

/// Name and version of the JSON layout.
pub(crate) const SCHEMA: &str = "obsdeg.system-evidence/1";
/// Number of samples of a segment within a horizon.
const SAMPLES: usize = 60;
/// Number of Runge-Kutta steps between two samples.
const SUBSTEPS: usize = 2;
/// Factor on the prior of the file for the inflation; the second prior is ten times as loose.
const DIFFUSE: f64 = 1e3;
/// Ratio of two consecutive horizons.
const SHORTER: f64 = 1.5;
/// Number of horizons that are tried.
const HORIZONS: i32 = 45;
/// Relative singular values (columns of unit length): above the first a direction is observable, below the
/// second it is not.
const SEEN: f64 = 1e-9;
const UNSEEN: f64 = 1e-12;
/// Relative effect on the outputs, over the width of the prior, below which an unknown counts as rounding.
const ROUNDING: f64 = 1e-13;
/// Ratio of sigma to the diffuse prior above which the inflation is not resolvable.
const LEFT: f64 = 0.01;
/// Number of consecutive slopes that must settle, and the change of a slope that rounding may cause.
const SETTLED: usize = 4;
const JITTER: f64 = 0.005;

/// Cross-check of the verdicts on one system against the information of simulated samples.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemEvidence {
    /// Layout of this answer: `obsdeg.system-evidence/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the system, as in its file.
    pub name: String,
    /// Evidence on each unknown, in model order.
    pub quantities: Vec<SystemQuantityEvidence>,
    /// Symmetries: the information along each, relative to the largest.
    pub symmetries: Vec<SymmetryEvidence>,
    /// Number of unobservable directions: exact, and singular values that vanish.
    pub defect: Count,
    /// Number of checks that failed.
    pub failures: usize,
    /// Coverage of the degrees by measured slopes.
    pub orders: Measured,
    /// Number of checks that agree or disagree, without those that are not resolvable or were skipped.
    pub checks: usize,
    /// Number of checks that neither support nor contradict a verdict: an unknown that affects the outputs by
    /// no more than rounding, or whose diffuse prior shrinks by less than a hundredth; singular values
    /// between observable and unobservable.
    pub not_resolvable: usize,
    /// True if no check of the model failed.
    pub passed: bool,
    /// Bound on the order of derivatives up to which an unknown that is not seen was looked for; samples may
    /// see it by higher ones, which contradicts nothing. Null where the end is proven.
    pub seen_up_to: Option<usize>,
    /// Time of the model at which the run begins, in its unit; 1 stands for a generic time. Null where
    /// neither the equations nor the known inputs hold the time.
    pub time: Option<f64>,
    /// Longest horizon, of every experiment, in the unit of `t` in the model.
    pub duration: f64,
    /// Bound on the probability that a verdict is wrong; null for a model judged in real numbers.
    pub error_bound: Option<f64>,
    /// Margin of the rank decisions in real numbers; null for a model judged in prime fields.
    pub digits: Option<DigitsReport>,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Evidence on one unknown of a system, by the information of the samples.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemQuantityEvidence {
    /// Name of the unknown, as in the model.
    pub name: String,
    /// Verdict on the unknown by the exact analysis.
    pub status: Status,
    /// Observable degree; null if the unknown is not observable.
    pub degree: Option<usize>,
    /// Log-log slope of sigma against the horizon: predicted -(degree + 1/2); measured null if it does not
    /// settle above rounding.
    pub slope: Check,
    /// Factor on sigma at the full duration when the prior is ten times as loose: 1, or 10 for an
    /// unobservable unknown.
    pub inflation: Check,
}

/// Evidence on one symmetry, by the information of the samples.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SymmetryEvidence {
    /// Symmetry in words, as in the analysis.
    pub words: String,
    /// Information along the symmetry, relative to the largest: predicted 0.
    pub seen: Check,
}

/// Rows of all samples until `horizon` of every experiment, as derivatives by the unknowns at the start, and
/// rows of the constraints, each weighted like the best sample. The second value is the size of all outputs,
/// over their noise.
fn rows(setup: &RunNumbers<'_>, horizon: f64) -> Result<(DMatrix<f64>, f64), RunError> {
    let numeric = &setup.numeric;
    let n = numeric.states.len();
    let segments = numeric.segments();
    let parts = segments * numeric.experiments();
    let outputs = setup.sigmas.len();
    let dt = horizon / (segments * SAMPLES) as f64;
    let (_, constraints) = numeric.constraints(&setup.truth);
    let mut out = DMatrix::zeros(parts * SAMPLES * outputs + constraints.nrows(), n);
    let (mut x, mut phi) = (setup.truth.clone(), DMatrix::identity(n, n));
    let mut size = 0.0;
    for part in 0..parts {
        let begin = (part % segments * SAMPLES) as f64 * dt;
        let (after, jump) = numeric.carry(part, begin, &x);
        (x, phi) = (after, jump * phi);
        let (process, measurement) = (numeric.process(part), numeric.measurement(part, &setup.sigmas));
        for k in 0..SAMPLES {
            let t = begin + k as f64 * dt;
            let next = runge_kutta(&process, t, &x, dt, SUBSTEPS).map_err(|error| RunError::Filter {
                time: t,
                duration: horizon,
                error,
            })?;
            (x, phi) = (next.x, next.phi * phi);
            let h = measurement.jacobian(t + dt, &x) * &phi;
            size += measurement
                .h(t + dt, &x)
                .iter()
                .zip(&setup.sigmas)
                .map(|(h, s)| (h / s).powi(2))
                .sum::<f64>();
            for (i, sigma) in setup.sigmas.iter().enumerate() {
                out.row_mut((part * SAMPLES + k) * outputs + i).copy_from(&(h.row(i) / *sigma));
            }
        }
    }
    let samples = parts * SAMPLES * outputs;
    let weight = |row: usize, of: &DMatrix<f64>| {
        of.row(row).iter().zip(&setup.prior).map(|(x, sigma)| (x * sigma).powi(2)).sum::<f64>().sqrt()
    };
    let best = (0..samples).map(|row| weight(row, &out)).fold(0.0, f64::max);
    for c in 0..constraints.nrows() {
        let own = weight(c, &constraints);
        out.row_mut(samples + c).copy_from(&(constraints.row(c) * (best / own)));
    }
    match out.iter().all(|v| v.is_finite()) {
        true => Ok((out, size.sqrt())),
        false => Err(RunError::Filter {
            time: 0.0,
            duration: horizon,
            error: EkfError::NotFinite {
                what: "the derivative of an output by the unknowns",
                value: f64::NAN,
                row: 0,
                column: 0,
            },
        }),
    }
}

/// Rows for unknowns only (states of known start have none), with columns of unit length: `(rows, lengths)`.
fn scaled(rows: &DMatrix<f64>, columns: &[usize]) -> (DMatrix<f64>, Vec<f64>) {
    let picked = rows.select_columns(columns);
    let norms: Vec<f64> =
        picked.column_iter().map(|c| c.norm()).map(|x| if x > 0.0 { x } else { 1.0 }).collect();
    let m = DMatrix::from_fn(picked.nrows(), columns.len(), |i, j| picked[(i, j)] / norms[j]);
    (m, norms)
}

/// Sigma of every unknown from the observable directions: `sum (V_ij / s_j)^2` over the first `rank` singular
/// values. `None` when these cannot be separated from rounding.
fn sigmas(rows: &DMatrix<f64>, columns: &[usize], rank: usize) -> Result<Option<Vec<f64>>, EkfError> {
    let (m, norms) = scaled(rows, columns);
    let square = m.qr().r();
    let (values, v) = singular_values(&square)?;
    let largest = values.first().copied().unwrap_or(0.0);
    let clear = rank > 0
        && values[rank - 1] > SEEN * largest
        && values.get(rank).is_none_or(|s| *s < UNSEEN * largest);
    if !clear {
        return Ok(None);
    }
    let of = |i: usize| (0..rank).map(|j| (v[(i, j)] / values[j]).powi(2)).sum::<f64>().sqrt() / norms[i];
    Ok(Some((0..columns.len()).map(of).collect()))
}

/// Index of an unknown of the exact verdict among the states of the filter.
fn place(numeric: &Numeric<'_>, u: &Unknown) -> Option<usize> {
    let experiment = u.experiment.unwrap_or(0);
    let state = match u.role {
        Role::State(i) => FilterState::State { experiment, i },
        Role::Parameter(i) => FilterState::Parameter(i),
        Role::UnknownInput(i) => FilterState::Input { experiment, i, derivative: u.derivative },
        Role::KnownInput(_) | Role::Constant(_) | Role::Time => return None,
    };
    numeric.states.iter().position(|s| *s == state)
}

/// Compares the exact verdicts on a model with the information of its samples.
///
/// # Errors
/// [`RunError`].
pub fn crosscheck_system(model: &SystemModel, seed: u64) -> Result<SystemEvidence, RunError> {
    let compiled = model.compile()?;
    let judged = judge_compiled(model, &compiled, seed, None)?;
    let found = symmetries(model, &compiled, &judged, seed)?;
    let run = SampledRun::new(model, &compiled, &judged)?;
    let SampledRun { setup, columns, rows, .. } = &run;
    let inflated = inflation(setup, rows, columns).map_err(|e| run.stopped(e))?;
    // with jumps, dwell may determine early what only late derivatives do: slopes then follow the accuracy
    // orders
    let slopes =
        if setup.numeric.segments() == 1 && model.states.iter().all(|s| s.start == StateStart::Unknown) {
            slopes(setup, columns, run.rank)?
        } else {
            vec![None; columns.len()]
        };
    let quantities = run.quantities(&judged, &inflated, &slopes);
    let (m, norms) = scaled(rows, columns);
    let (values, _) = singular_values(&m.clone().qr().r()).map_err(|e| run.stopped(e))?;
    let largest = values.first().copied().unwrap_or(1.0);
    let defect = run.defect(&values, largest, &quantities);
    let directions = found
        .found
        .iter()
        .map(|s| direction(s, &setup.truth, columns))
        .chain(found.polynomial.iter().map(|d| polynomial_direction(d, setup, columns)));
    let symmetries: Vec<SymmetryEvidence> = directions
        .zip(symmetry_reports(model, &judged, &found))
        .map(|(v, report)| SymmetryEvidence {
            words: report.words,
            seen: run.seen_along(v, (&m, &norms[..]), largest),
        })
        .collect();
    let measured = quantities.iter().flat_map(|q| [q.slope.outcome, q.inflation.outcome]);
    let moved = symmetries.iter().map(|s| s.seen.outcome);
    let counts = Counts::of(measured.chain(moved).chain([defect.outcome]));
    Ok(SystemEvidence {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        name: model.name.clone(),
        orders: Measured::count(quantities.iter().map(|q| (&q.slope, q.degree.is_some()))),
        quantities,
        symmetries,
        defect,
        failures: counts.disagree,
        checks: counts.agree + counts.disagree,
        not_resolvable: counts.not_resolvable,
        passed: counts.disagree == 0,
        seen_up_to: run.open.then(|| judged.findings.degrees.rank_profile.len().saturating_sub(1)),
        time: compiled.uses_time().then(|| model.time.number()),
        duration: setup.duration,
        error_bound: judged.error_bound(),
        digits: judged.digits(),
        seed,
    })
}

/// Samples of the whole run, as rows of derivatives by the unknowns at the start.
struct SampledRun<'a> {
    setup: RunNumbers<'a>,
    /// Index of the filter state, by unknown.
    columns: Vec<usize>,
    /// Rows by filter state; zero for unknowns that are rounding.
    rows: DMatrix<f64>,
    /// True for each unknown that affects the outputs by no more than rounding.
    rounded: Vec<bool>,
    /// Rank by the verdicts.
    rank: usize,
    /// True if a derivative beyond the bound may determine an unknown that no verdict covers.
    open: bool,
}

impl<'a> SampledRun<'a> {
    fn new(model: &SystemModel, compiled: &'a Compiled, judged: &Judgement) -> Result<Self, RunError> {
        let setup = RunNumbers::new(model, compiled)?;
        let unknowns = &judged.layout.unknowns;
        let columns: Vec<usize> = unknowns.iter().filter_map(|u| place(&setup.numeric, u)).collect();
        if columns.len() != unknowns.len() {
            let message = "some unknowns are no states of the filter".into();
            return Err(ModelError { what: model.name.clone(), message, span: None }.into());
        }
        let (mut whole, size) = rows(&setup, setup.duration)?;
        let weight = |c: usize| whole.column(columns[c]).norm() * setup.prior[columns[c]];
        let largest = (0..columns.len()).map(weight).fold(size, f64::max);
        let rounded: Vec<bool> = (0..columns.len()).map(|c| weight(c) <= ROUNDING * largest).collect();
        for (&c, _) in columns.iter().zip(&rounded).filter(|(_, rounded)| **rounded) {
            whole.column_mut(c).fill(0.0);
        }
        let (rank, open) = (judged.findings.degrees.rank(), judged.rests_on_bound);
        Ok(Self { setup, columns, rows: whole, rounded, rank, open })
    }

    /// Error of numbers of the whole run.
    fn stopped(&self, error: EkfError) -> RunError {
        RunError::Filter { time: self.setup.duration, duration: self.setup.duration, error }
    }

    /// Evidence on the unknowns, by the factors of [`inflation`] and the slopes.
    fn quantities(
        &self,
        judged: &Judgement,
        inflated: &[(f64, f64)],
        slopes: &[Option<f64>],
    ) -> Vec<SystemQuantityEvidence> {
        let of = |(c, u): (usize, &Unknown)| {
            let Verdict { status, degree } = judged.verdict_on(c);
            let (inflated, left) = inflated[c];
            let mut inflation = rules::LINEARISED.check(degree.is_some(), Some(inflated));
            let faint = self.rounded[c] || (degree.is_some() && left > LEFT);
            if inflation.fails() && (faint || status == Status::NotSeen) {
                inflation.outcome = Agreement::NotResolvable;
            }
            // without a degree no slope is expected
            let measured = slopes[c].filter(|_| degree.is_some());
            SystemQuantityEvidence {
                name: u.name.clone(),
                status,
                degree,
                slope: rules::slope(degree, measured),
                inflation,
            }
        };
        judged.layout.unknowns.iter().enumerate().map(of).collect()
    }

    /// Evidence on the number of unobservable directions, by the singular values, the largest of which is
    /// `largest`.
    fn defect(&self, values: &[f64], largest: f64, quantities: &[SystemQuantityEvidence]) -> Count {
        let vanish = |limit: f64| values.iter().filter(|s| **s <= limit * largest).count();
        let (hidden, unseen) = (vanish(UNSEEN), vanish(SEEN));
        let mut defect = rules::defect(self.columns.len() - self.rank, values, SEEN);
        // number of observable unknowns too weak to be separated from rounding
        let faint =
            (0..self.columns.len()).filter(|&c| self.rounded[c] && quantities[c].degree.is_some()).count();
        if (hidden.saturating_sub(faint)..=unseen).contains(&defect.predicted)
            && defect.predicted != defect.measured
        {
            defect.outcome = Agreement::NotResolvable;
        }
        // at values that hide an observable unknown, one more direction vanishes
        let blurred =
            quantities.iter().any(|q| q.degree.is_some() && q.inflation.outcome == Agreement::NotResolvable);
        if defect.measured > defect.predicted && blurred {
            defect.outcome = Agreement::NotResolvable;
        }
        if self.open && defect.measured < defect.predicted {
            defect.outcome = Agreement::NotResolvable;
        }
        defect
    }

    /// Check of the information along the direction `v` of a symmetry, relative to the `largest`; `m` has
    /// columns of unit length, `norms` were their lengths.
    fn seen_along(&self, mut v: DVector<f64>, (m, norms): (&DMatrix<f64>, &[f64]), largest: f64) -> Check {
        for (x, norm) in v.iter_mut().zip(norms) {
            *x *= norm;
        }
        let seen = (m * &v).norm() / (v.norm() * largest);
        // the derivatives are integrated by Runge-Kutta, whose error respects a symmetry
        let mut seen = Check::new(0.0, Some(seen), |x| x <= 1e-6);
        if self.open && seen.fails() {
            seen.outcome = Agreement::NotResolvable;
        }
        seen
    }
}

fn quotient((p, q): (i64, i64)) -> f64 {
    p as f64 / q as f64
}

/// Direction of a symmetry at the truth.
fn direction(s: &Symmetry, truth: &DVector<f64>, columns: &[usize]) -> DVector<f64> {
    let mut v = DVector::zeros(columns.len());
    for &(c, k) in &s.scaling {
        v[c] += quotient(k) * truth[columns[c]];
    }
    for &(c, k) in &s.translation {
        v[c] += quotient(k);
    }
    v
}

/// Direction that is polynomial in unknowns and known constants, at the truth.
fn polynomial_direction(d: &PolynomialDirection, setup: &RunNumbers<'_>, columns: &[usize]) -> DVector<f64> {
    let mut v = DVector::zeros(columns.len());
    let factor = |&j: &usize| match columns.get(j) {
        Some(&state) => setup.truth[state],
        None => setup.numeric.constant(j - columns.len()),
    };
    for (c, terms) in &d.components {
        v[*c] = terms.iter().map(|(f, k)| quotient(*k) * f.iter().map(factor).product::<f64>()).sum();
    }
    v
}

/// Factors by unknown: on its sigma at the start when a diffuse prior is ten times as loose, and sigma over
/// the first prior.
fn inflation(
    setup: &RunNumbers<'_>,
    rows: &DMatrix<f64>,
    columns: &[usize],
) -> Result<Vec<(f64, f64)>, EkfError> {
    let picked = rows.select_columns(columns);
    let sigmas = |factor: f64| {
        let prior: Vec<f64> = columns.iter().map(|&c| setup.prior[c] * factor).collect();
        let mut information = SquareRootInformation::prior(&prior)?;
        information.add(&picked)?;
        information.sigmas()
    };
    let (small, large) = (sigmas(DIFFUSE)?, sigmas(10.0 * DIFFUSE)?);
    let prior = columns.iter().map(|&c| setup.prior[c] * DIFFUSE);
    Ok(large.iter().zip(&small).zip(prior).map(|((l, s), prior)| (l / s, s / prior)).collect())
}

/// Limit of the slopes at shorter and shorter horizons: the last one, if the last of them change little and
/// less and less. Two equal slopes are not enough, since rising and falling slopes may cross.
fn settled(slopes: &[f64]) -> Option<f64> {
    let last = slopes.last_chunk::<SETTLED>()?;
    let changes: Vec<f64> = last.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let less = changes.windows(2).all(|w| w[1] <= w[0].max(JITTER));
    let little = changes.iter().all(|x| *x <= SLOPE_TOLERANCE)
        && changes.last().is_some_and(|x| *x <= SLOPE_TOLERANCE / 4.0);
    (less && little).then_some(last[SETTLED - 1])
}

/// Slope of every unknown at the shortest horizon without visible rounding; `None` where the slopes before it
/// do not settle.
fn slopes(setup: &RunNumbers<'_>, columns: &[usize], rank: usize) -> Result<Vec<Option<f64>>, RunError> {
    let mut seen: Vec<(f64, Vec<f64>)> = Vec::new();
    for j in 0..HORIZONS {
        let horizon = setup.duration * SHORTER.powi(-j);
        let error = |error| RunError::Filter { time: horizon, duration: horizon, error };
        match sigmas(&rows(setup, horizon)?.0, columns, rank).map_err(error)? {
            Some(s) => seen.push((horizon, s)),
            None if seen.len() > 2 => break,
            None => seen.clear(),
        }
    }
    let slope = |c: usize, k: usize| {
        let ((t1, s1), (t2, s2)) = (&seen[k], &seen[k + 1]);
        // the number of samples is constant; at a fixed density it would grow with the horizon
        (s1[c] / s2[c]).ln() / (t1 / t2).ln() - 0.5
    };
    Ok((0..columns.len())
        .map(|c| settled(&(0..seen.len().saturating_sub(1)).map(|k| slope(c, k)).collect::<Vec<_>>()))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::settled;

    #[test]
    fn what_settles() {
        assert_eq!(settled(&[-4.0, -4.351, -4.403, -4.436, -4.458]), Some(-4.458));
        assert_eq!(settled(&[-0.5; 4]), Some(-0.5));
        // too few; two that agree by chance; a drift at a steady pace; growing changes; rounding
        for open in [
            &[-0.5; 3][..],
            &[-7.2, -1.6, -1.25, -1.27],
            &[-1.3, -1.32, -1.34, -1.9],
            &[-2.0, -2.08, -2.16, -2.24],
            &[-2.5, -2.501, -2.51, -2.53],
            &[-2.5, -2.5, -2.5, f64::NAN],
        ] {
            assert_eq!(settled(open), None, "{open:?}");
        }
    }
}

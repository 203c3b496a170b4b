//! Evidence a and b: observable and unobservable directions of the filter's model, compared with the exact
//! verdicts.

use nalgebra::DMatrix;
use obsdeg_core::degree::Status;
use obsdeg_core::model::{Carry, Latitude, Scheme, Unknowns};
use obsdeg_ekf::decomposition::singular_values;
use obsdeg_ekf::{Covariance, CovarianceForm, SquareRootInformation};
use obsdeg_exact::parallel;

use super::answer::{
    Agreement, Check, Correlation, Count, Counts, NullEvidence, QuantityEvidence, SlopeCurve, SlopePoint,
    SpaceCheck,
};
use super::asymptotics::{Asymptotics, DwellSlope, SlopeRequest, asymptotics, samples};
use super::precise::Between;
use super::resolution::{ROUNDING, Resolution};
use super::slopes::{self, slopes};
use super::{rules, spaces};
use crate::prediction::{Combination, PredictedUnknown, Prediction};
use crate::simulation::batch::{batch, diffuse_prior};
use crate::simulation::conditions::{is_rate, shown_unit, si_per_shown};
use crate::simulation::record::RunStart;
use crate::simulation::{Conditions, Plan, SimulationError};

/// Relative rounding tolerance of a column, by the longest column of its kind.
const NOTHING: f64 = 1e-14;
/// Singular value below which a direction counts as unobservable, relative to the largest.
const UNSEEN: f64 = 1e-10;

/// Evidence a and b, with the outcomes of their checks.
pub(super) struct StructureEvidence {
    pub(super) quantities: Vec<QuantityEvidence>,
    pub(super) spaces: Vec<SpaceCheck>,
    pub(super) null_space: Vec<NullEvidence>,
    pub(super) defect: Count,
    pub(super) slopes: Vec<SlopeCurve>,
    pub(super) correlation: Correlation,
    /// Reasons why checks of evidence b are not resolvable, one for each.
    pub(super) unresolved: Vec<String>,
}

/// Outcomes of evidence a and b.
pub(super) fn outcomes(
    quantities: &[QuantityEvidence],
    spaces: &[SpaceCheck],
    null_space: &[NullEvidence],
    defect: &Count,
) -> impl Iterator<Item = Agreement> {
    let missing = quantities.iter().filter(|q| !q.modelled).map(|_| Agreement::Disagrees);
    let measured = quantities.iter().flat_map(|q| {
        let numbers = [q.degree_slope, q.slope, q.slope_at_end, q.inflation].map(|c| c.outcome);
        numbers.into_iter().chain([q.status_outcome]).chain(q.partners.as_ref().map(|p| p.outcome))
    });
    let null = null_space.iter().flat_map(|v| [Some(v.seen.outcome), v.correlation.map(|c| c.outcome)]);
    let spaces = spaces.iter().map(|s| s.outcome);
    missing.chain(measured).chain(null.flatten()).chain(spaces).chain([defect.outcome])
}

impl StructureEvidence {
    /// Counts of the outcomes of its checks.
    pub(super) fn counts(&self) -> Counts {
        Counts::of(outcomes(&self.quantities, &self.spaces, &self.null_space, &self.defect))
    }
}

/// Structure of the filter's model. Repositioning is instantaneous here, as in the exact verdicts, since a
/// slew moves psi by drifts of its own.
pub(super) fn structure(
    truth: &Plan,
    prediction: &Prediction,
    filter_scheme: &Scheme,
    conditions: &Conditions,
) -> Result<StructureEvidence, SimulationError> {
    let conditions = &still(conditions);
    let filter = Plan::derived(filter_scheme, conditions)?;
    let names = names(truth, prediction);
    let functionals = functionals(truth, &filter, prediction);
    let known: Vec<Combination> = functionals.iter().flatten().cloned().collect();
    let shown = DwellLimit::of(&filter, truth, &functionals);
    let inflation = inflation(&filter, &known)?;
    let resolution = Resolution::new(&filter, conditions, &inflation.prior);
    let (mut null_space, defect) = null_evidence(truth, &filter, prediction, &shown, &inflation.correlation)?;
    let is_psi = |c: usize| !is_rate(filter.platform.units()[c]);
    let same = truth.platform.names() == filter.platform.names();
    let mut quantities = quantities(truth, &names, prediction, &functionals, &shown, &inflation.ratios);
    let mut unresolved = Vec::new();
    let present = quantities.iter_mut().zip(&functionals).filter_map(|(q, f)| Some((q, f.as_ref()?)));
    for (i, (q, terms)) in present.enumerate() {
        unresolved.extend(decide_inflation(q, terms, shown.dwell_slopes(i)[2], &resolution));
    }
    unresolved.extend(null_space.iter_mut().filter_map(decide_seen));
    unresolved.extend(null_space.iter_mut().filter_map(|v| decide_correlation(v, &resolution)));
    let null_space = null_space.into_iter().map(|v| v.evidence).collect();
    // at a pole unobservable drift moves psi, and directions without numbers are not listed
    let pole = truth.platform.scheme().latitude.is_some_and(Latitude::is_pole);
    let partial = pole || prediction.unseen_by_derivatives.is_none();
    let hidden = shown.rank().map(|rank| filter.unknowns() - rank);
    let mut spaces = Vec::new();
    if same {
        spaces.extend(spaces::spaces(prediction, shown.derivatives.as_ref(), &is_psi));
        spaces.push(spaces::with_dwells(prediction, shown.with_dwells(), hidden, partial, &is_psi));
    }
    Ok(StructureEvidence {
        quantities,
        spaces,
        null_space,
        defect,
        slopes: curves(truth, prediction, &names, &functionals, &slopes(filter_scheme, conditions, &known)),
        correlation: Correlation {
            names: filter.platform.names().to_vec(),
            values: inflation.correlation.row_iter().map(|r| r.iter().copied().collect()).collect(),
        },
        unresolved,
    })
}

/// Decides the prior inflation of a quantity, by high precision first: its slope at the end shows whether the
/// samples determine it. The value of the filter in doubles counts only where high precision says that it
/// must show. Returns the reason where the check is not resolvable.
fn decide_inflation(
    q: &mut QuantityEvidence,
    terms: &Combination,
    at_end: Option<DwellSlope>,
    resolution: &Resolution<'_>,
) -> Option<String> {
    let determined = match at_end.filter(|_| q.slope_at_end.outcome.is_resolved()) {
        Some(DwellSlope::Slope(_)) => Some(true),
        Some(DwellSlope::Unseen) => Some(false),
        Some(DwellSlope::Bends) | None => None,
    };
    let said = q.inflation.predicted == 1.0;
    if determined.is_some_and(|determined| determined != said) {
        q.inflation.outcome = Agreement::Disagrees;
        return None;
    }
    let measured = q.inflation.measured.filter(|_| q.inflation.fails())?;
    let why = match determined {
        Some(determined) => resolution.inflation(terms, determined, measured)?,
        None => "many digits do not tell whether it is determined".into(),
    };
    q.inflation.outcome = Agreement::NotResolvable;
    Some(format!("{}: prior inflation {measured:.3}: {why}", q.name))
}

/// Decides whether a filter in doubles observes a direction: its value counts where rounding cannot cause as
/// much. Returns the reason where the check is not resolvable.
fn decide_seen(v: &mut Direction) -> Option<String> {
    let NullEvidence { direction, seen, .. } = &mut v.evidence;
    let measured = seen.measured.filter(|x| seen.fails() && *x <= v.rounding)?;
    seen.outcome = Agreement::NotResolvable;
    Some(format!(
        "{direction}: part of it seen {measured:.1e}: moving the numbers of the model by 2^{ROUNDING} may show {:.1e}",
        v.rounding
    ))
}

/// Decides the correlation along a direction: its value counts where high precision says that the filter must
/// show it. Returns the reason where the check is not resolvable.
fn decide_correlation(v: &mut Direction, resolution: &Resolution<'_>) -> Option<String> {
    let NullEvidence { direction, correlation, .. } = &mut v.evidence;
    let check = correlation.as_mut().filter(|c| c.fails())?;
    let ((pair, sign), measured) = (v.weakest?, check.measured?);
    let why = resolution.correlation(pair, sign, measured)?;
    check.outcome = Agreement::NotResolvable;
    Some(format!("{direction}: correlation {measured:.6}: {why}"))
}

/// Behaviour of the samples as the dwell goes to zero.
struct DwellLimit {
    /// Slopes by derivatives: psi is handed on as it was at the start of a position.
    derivatives: Option<Asymptotics>,
    /// Slopes with dwells: first with psi of the start, then with psi of the end. The outer `None` marks
    /// cases without carried psi, in which both equal the slopes by derivatives.
    dwells: Option<Option<Asymptotics>>,
}

impl DwellLimit {
    fn of(filter: &Plan, truth: &Plan, functionals: &[Option<Combination>]) -> Self {
        let scheme = filter.platform.scheme();
        let units = filter.platform.units();
        let is_psi = |c: usize| !is_rate(units[c]);
        let requests = |at_end: bool| {
            // coefficients of unknowns are exact, those of combinations are doubles
            let present = functionals.iter().enumerate().filter_map(|(i, f)| Some((i, f.clone()?)));
            present.map(move |(i, terms)| SlopeRequest { terms, exact: i < truth.unknowns(), at_end })
        };
        let start: Vec<SlopeRequest> = requests(false).collect();
        let alone = scheme.carry == Carry::Reset || scheme.unknowns == Unknowns::Drift;
        let both = || -> Vec<SlopeRequest> { requests(false).chain(requests(true)).collect() };
        let samples = samples(scheme);
        let (derivatives, dwells) = parallel::join(
            || asymptotics(&samples, Between::Nothing, &is_psi, &start),
            || (!alone).then(|| asymptotics(&samples, Between::Dwell, &is_psi, &both())),
        );
        Self { derivatives, dwells }
    }

    /// Slopes of the functional with index `i`: by derivatives, with dwells, and with dwells at the end.
    fn dwell_slopes(&self, i: usize) -> [Option<DwellSlope>; 3] {
        let by_derivatives = self.derivatives.as_ref().map(|a| a.dwell_slopes[i]);
        let dwells = |a: &Asymptotics, half: usize| a.dwell_slopes[half * (a.dwell_slopes.len() / 2) + i];
        match &self.dwells {
            None => [by_derivatives; 3],
            Some(found) => {
                let with = |half| found.as_ref().map(|a| dwells(a, half));
                [by_derivatives, with(0), with(1)]
            }
        }
    }

    /// Behaviour with dwells.
    fn with_dwells(&self) -> Option<&Asymptotics> {
        self.dwells.as_ref().unwrap_or(&self.derivatives).as_ref()
    }

    /// Rank with dwells.
    fn rank(&self) -> Option<usize> {
        Some(self.with_dwells()?.seen.rank())
    }
}

/// Check of an order against a slope; it is not resolvable if the slope is not settled or cannot be separated
/// from rounding.
fn slope(order: Option<usize>, modelled: bool, dwell_slope: Option<DwellSlope>) -> Check {
    let measured = match dwell_slope {
        Some(DwellSlope::Slope(s)) => Some(s),
        // sigma stays that of the prior, whatever the prior is
        Some(DwellSlope::Unseen) => Some(0.0),
        Some(DwellSlope::Bends) | None => None,
    };
    let mut check = rules::slope(order, measured);
    if modelled && measured.is_none() {
        check.outcome = Agreement::NotResolvable;
    }
    check
}

/// Conditions without drift noise and slews.
pub(super) fn still(conditions: &Conditions) -> Conditions {
    Conditions { slews: false, ..conditions.clone().without_drift_noise() }
}

/// Names of the unknowns, then expressions of the combinations.
fn names(plan: &Plan, prediction: &Prediction) -> Vec<String> {
    let combinations = prediction.combinations.iter().map(|c| c.expression.clone());
    plan.platform.names().iter().cloned().chain(combinations).collect()
}

/// Unknowns and combinations as functionals of the filter's unknowns; `None` for one that the filter does not
/// have.
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

/// Evidence b: factors on sigma when the prior is ten times as wide.
struct InflationFactors {
    /// Factor on sigma of each functional, dimensionless.
    ratios: Vec<f64>,
    /// Correlation matrix under the diffuse prior.
    correlation: DMatrix<f64>,
    /// Standard deviations of the diffuse prior.
    prior: Vec<f64>,
}

fn inflation(plan: &Plan, functionals: &[Combination]) -> Result<InflationFactors, SimulationError> {
    let prior = diffuse_prior(plan)?;
    let end = |factor: f64| {
        let sigma = prior.iter().map(|s| s * factor).collect();
        last_covariance(
            plan,
            &RunStart { truth: Vec::new(), estimate: Vec::new(), sigma },
            CovarianceForm::Ud,
        )
    };
    let (small, large) = (end(1.0)?, end(10.0)?);
    let ratio = |c: &Combination| Ok((large.variance(c)? / small.variance(c)?).sqrt());
    let ratios = functionals.iter().map(ratio).collect::<Result<_, obsdeg_ekf::EkfError>>()?;
    let n = plan.unknowns();
    let sigma = small.sigmas();
    let small = small.matrix();
    Ok(InflationFactors {
        prior,
        ratios,
        correlation: DMatrix::from_fn(n, n, |i, j| small[(i, j)] / (sigma[i] * sigma[j])),
    })
}

pub(super) fn last_covariance(
    plan: &Plan,
    start: &RunStart,
    form: CovarianceForm,
) -> Result<Covariance, SimulationError> {
    Ok(obsdeg_ekf::linear::last_covariance(&plan.stages, start.covariance(form)?)?)
}

/// Verdict on a quantity, an unknown or a combination.
#[derive(Clone, Copy)]
struct QuantityVerdict {
    status: Status,
    degree: Option<usize>,
    /// Accuracy orders of the values at the start and at the end.
    orders: [Option<usize>; 2],
    determined_at_end: bool,
    /// True if the coefficients are exact: those of unknowns, not those of combinations.
    exact: bool,
}

/// Verdicts on the unknowns, then on the combinations.
fn verdicts(prediction: &Prediction) -> impl Iterator<Item = QuantityVerdict> + '_ {
    let unknowns = prediction.unknowns.iter().map(|u| QuantityVerdict {
        status: u.status,
        degree: u.degree,
        orders: [u.accuracy_order, u.order_at_end],
        determined_at_end: u.determined_at_end,
        exact: true,
    });
    unknowns.chain(prediction.combinations.iter().map(|c| QuantityVerdict {
        status: c.status,
        degree: c.degree,
        orders: [c.accuracy_order, c.order_at_end],
        determined_at_end: c.determined_at_end,
        exact: false,
    }))
}

impl QuantityVerdict {
    /// Check of an order against a slope. The coefficients of a combination are doubles, so a rest of it
    /// below 2^-46 counts as rounding; the contribution of the dwells, as small as the dwell, is then lost
    /// too, and the slope is that of the degree.
    fn slope(&self, order: Option<usize>, modelled: bool, dwell_slope: Option<DwellSlope>) -> Check {
        let check = slope(order, modelled, dwell_slope);
        let hides = !self.exact && self.degree.is_some_and(|degree| order.is_none_or(|order| order > degree));
        let of_degree = rules::slope(self.degree, check.measured).outcome == Agreement::Agrees;
        if check.fails() && hides && of_degree {
            return Check { outcome: Agreement::NotResolvable, ..check };
        }
        check
    }
}

/// Evidence on the unknowns and combinations; `ratios` are the factors of the inflation of those that the
/// filter has.
fn quantities(
    truth: &Plan,
    names: &[String],
    prediction: &Prediction,
    functionals: &[Option<Combination>],
    shown: &DwellLimit,
    ratios: &[f64],
) -> Vec<QuantityEvidence> {
    let comparable = functionals[..truth.unknowns()].iter().all(Option::is_some);
    let seen = shown.derivatives.as_ref().map(|a| &a.seen);
    let partners = seen.filter(|_| comparable).map(spaces::partners);
    let mut measured = ratios.iter().enumerate();
    let all = names.iter().zip(verdicts(prediction)).zip(functionals).enumerate();
    all.map(|(c, ((name, verdict), functional))| {
        let found = functional.as_ref().and_then(|f| Some((f, measured.next()?)));
        let dwell_slopes = found.map_or([None; 3], |(_, (i, _))| shown.dwell_slopes(i));
        let modelled = functional.is_some();
        let status_measured = found.and_then(|(f, _)| {
            let excited = f.iter().any(|(c, _)| seen.is_some_and(|s| s.excited[*c]));
            match dwell_slopes[0]? {
                DwellSlope::Slope(_) => Some(Status::Observable),
                DwellSlope::Unseen => Some(Status::of(None, excited)),
                DwellSlope::Bends => None,
            }
        });
        let status_outcome = match (modelled, status_measured) {
            (_, Some(found)) => Agreement::of(found == verdict.status),
            (true, None) => Agreement::NotResolvable,
            (false, None) => Agreement::NotTested,
        };
        let named = |u: &PredictedUnknown| {
            let found = partners.as_ref().map(|p| p[c].as_slice());
            spaces::named(&u.partners, found, truth.platform.names())
        };
        QuantityEvidence {
            name: name.clone(),
            status: verdict.status,
            degree: verdict.degree,
            accuracy_order: verdict.orders[0],
            modelled,
            degree_slope: slope(verdict.degree, modelled, dwell_slopes[0]),
            status_measured,
            status_outcome,
            partners: prediction.unknowns.get(c).filter(|_| comparable).map(named),
            slope: verdict.slope(verdict.orders[0], modelled, dwell_slopes[1]),
            slope_at_end: verdict.slope(verdict.orders[1], modelled, dwell_slopes[2]),
            inflation: rules::LINEAR.check(verdict.determined_at_end, found.map(|(_, (_, ratio))| *ratio)),
        }
    })
    .collect()
}

/// Direction unobservable from Z by the verdicts.
struct Direction {
    evidence: NullEvidence,
    /// Its two unknowns of least correlation, and the sign of their correlation.
    weakest: Option<([usize; 2], f64)>,
    /// Largest part of the direction that rounding of the model may make observable, dimensionless.
    rounding: f64,
}

/// Information of all samples of the filter, by columns of unit length, so that units do not matter.
struct ScaledInformation {
    root: DMatrix<f64>,
    /// Lengths of the columns. The rest that cosines of right angles leave of a column counts as zero.
    norms: Vec<f64>,
    /// Length of the longest column of the same kind (rates or not), by unknown.
    largest_of_kind: Vec<f64>,
    /// Singular values, and the largest of them.
    values: Vec<f64>,
    largest: f64,
}

impl ScaledInformation {
    fn of(filter: &Plan) -> Result<Self, SimulationError> {
        let n = filter.unknowns();
        let root = batch(filter, SquareRootInformation::none(n))?.information;
        let lengths: Vec<f64> = root.root().column_iter().map(|c| c.norm()).collect();
        let units = filter.platform.units();
        let largest_of = |unit: &&str| {
            let own = lengths.iter().zip(units).filter(|(_, u)| is_rate(u) == is_rate(unit));
            own.map(|(x, _)| *x).fold(0.0, f64::max)
        };
        let largest_of_kind: Vec<f64> = units.iter().map(largest_of).collect();
        let norm = |(x, most): (&f64, &f64)| match *most {
            0.0 => 1.0,
            most if *x <= NOTHING * most => most,
            _ => *x,
        };
        let norms: Vec<f64> = lengths.iter().zip(&largest_of_kind).map(norm).collect();
        let root = DMatrix::from_fn(n, n, |i, j| root.root()[(i, j)] / norms[j]);
        let (values, _) = singular_values(&root)?;
        let largest = values.first().copied().unwrap_or(1.0);
        Ok(Self { root, norms, largest_of_kind, values, largest })
    }

    /// Information along a direction, relative to the largest.
    fn seen_along(&self, vector: &Combination) -> f64 {
        let mut v = nalgebra::DVector::zeros(self.norms.len());
        for &(c, x) in vector {
            v[c] = x * self.norms[c];
        }
        (&self.root * &v).norm() / (v.norm() * self.largest)
    }

    /// Largest part of a direction that rounding of the model may make observable, in units of rounding.
    fn rounding_along(&self, vector: &Combination) -> f64 {
        let moved = |&(c, x): &(usize, f64)| (x * self.largest_of_kind[c]).abs();
        let size = vector.iter().map(|&(c, x)| (x * self.norms[c]).powi(2)).sum::<f64>().sqrt();
        vector.iter().map(moved).sum::<f64>() / (size * self.largest)
    }
}

/// Evidence on the unobservable directions: the predicted null vectors against the information, and their
/// number.
fn null_evidence(
    truth: &Plan,
    filter: &Plan,
    prediction: &Prediction,
    shown: &DwellLimit,
    correlation: &DMatrix<f64>,
) -> Result<(Vec<Direction>, Count), SimulationError> {
    let n = filter.unknowns();
    let information = ScaledInformation::of(filter)?;
    let predicted = truth.unknowns() - prediction.rank;
    let defect = match shown.rank() {
        Some(rank) => Count { predicted, measured: n - rank, outcome: Agreement::of(predicted == n - rank) },
        // doubles may lose a hardly observable direction
        None => {
            let defect = rules::defect(predicted, &information.values, UNSEEN);
            Count { outcome: Agreement::NotResolvable, ..defect }
        }
    };
    let names = truth.platform.names();
    let comparable = names == filter.platform.names();
    let direction = |(k, vector): (usize, &Combination)| {
        let parts: Vec<String> =
            vector.iter().map(|(c, x)| format!("{} = {}", names[*c], short(*x))).collect();
        let seen = comparable.then(|| information.seen_along(vector));
        let alone = comparable && shares_nothing(prediction, k);
        let weakest = weakest_correlation(if alone { vector.as_slice() } else { &[] }, correlation);
        let rounding = f64::from(ROUNDING).exp2();
        Direction {
            weakest: weakest.map(|w| w.0),
            rounding: if comparable { rounding * information.rounding_along(vector) } else { 0.0 },
            evidence: NullEvidence {
                direction: parts.join(", "),
                seen: Check::new(0.0, seen, |s| s <= UNSEEN),
                correlation: weakest.map(|(_, x)| Check::new(1.0, Some(x), |x| x > 0.999)),
            },
        }
    };
    Ok((prediction.null_space.iter().enumerate().map(direction).collect(), defect))
}

/// True if the null vector `k` shares no unknown with another. Shared unknowns are known only where all null
/// vectors are.
fn shares_nothing(prediction: &Prediction, k: usize) -> bool {
    let vector = &prediction.null_space[k];
    let shares = |other: &Combination| other.iter().any(|(c, _)| vector.iter().any(|(d, _)| c == d));
    prediction
        .whole_null_space()
        .is_some_and(|all| all.iter().enumerate().all(|(i, other)| i == k || !shares(other)))
}

/// Two unknowns of a null vector and the sign of their correlation, where that is least in size, and its
/// size.
fn weakest_correlation(
    vector: &[(usize, f64)],
    correlation: &DMatrix<f64>,
) -> Option<(([usize; 2], f64), f64)> {
    let pairs = vector.iter().enumerate().flat_map(|(i, a)| vector[..i].iter().map(move |b| (a, b)));
    let signed = pairs.map(|(a, b)| (([a.0, b.0], (a.1 * b.1).signum()), correlation[(a.0, b.0)]));
    // NaN stays
    signed
        .map(|((pair, sign), x)| ((pair, sign), x * sign))
        .reduce(|a, b| if b.1 >= a.1 || a.1.is_nan() { a } else { b })
}

/// Number in few digits.
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
    measured: &slopes::DwellSigmas,
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
                points: measured
                    .dwells
                    .iter()
                    .zip(sigmas)
                    .map(|(&dwell_s, s)| SlopePoint { dwell_s, sigma: s / scale })
                    .collect(),
            }
        })
        .collect()
}

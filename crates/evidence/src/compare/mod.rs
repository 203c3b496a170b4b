//! Comparison of schemes for design reviews: verdicts, predicted accuracy, contribution of each position, and
//! sensitivity to the assumptions.

pub(crate) mod answer;

pub use answer::*;

use std::collections::BTreeMap;

use obsdeg_core::degree::Status;
use obsdeg_core::model::slew::W_IE;
use obsdeg_core::model::{Carry, ErrorSource, ErrorTerm, Float, Matrix3, Platform, Position, Scheme, slew};
use obsdeg_exact::parallel;

use crate::requirements::{Miss, RequirementClaim};
use crate::simulation::answer::MeasurementReport;
use crate::simulation::carries::under;
use crate::simulation::conditions::{Conditions, resolve, shown_unit, si_per_shown};
use crate::simulation::iterated::at_own_drifts;
use crate::simulation::limits::MAX_UNKNOWNS;
use crate::simulation::omitted::{Bench, omitted_effects};
use crate::simulation::{Attained, SimulationError, noise_floor, other_carries};

/// Latitudes of the sweep, in degrees.
const LATITUDES: [&str; 7] = ["0", "15", "30", "45", "60", "75", "90"];
/// Factors on the dwells.
const DWELLS: [f64; 2] = [0.5, 2.0];

/// Scheme to compare, with its name and conditions.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Name of the scheme in the comparison.
    pub name: String,
    /// Scheme to compare.
    pub scheme: Scheme,
    /// Conditions of the scheme, with its requirements.
    pub conditions: Conditions,
}

/// Checks, before anything is computed, that a scheme is small enough under all carries.
///
/// # Errors
/// [`SimulationError::ComparedUnknowns`].
pub fn comparable(scheme: &Scheme) -> Result<(), SimulationError> {
    let found = Platform::new(Scheme { carry: Carry::Reset, ..scheme.clone() })?.names().len();
    if found <= MAX_UNKNOWNS { Ok(()) } else { Err(SimulationError::ComparedUnknowns { found }) }
}

/// Compares schemes.
///
/// # Errors
/// Name of the scheme that cannot be judged, and the reason.
pub fn compare(entries: &[Entry], seed: u64) -> Result<Comparison, (String, SimulationError)> {
    for e in entries {
        comparable(&e.scheme).map_err(|error| (e.name.clone(), error))?;
    }
    let schemes = entries.iter().map(|e| review(e, seed).map_err(|error| (e.name.clone(), error)));
    let schemes = schemes.collect::<Result<Vec<_>, _>>()?;
    Ok(Comparison {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        differ: differ(&schemes),
        schemes,
        seed,
    })
}

/// Differences between schemes besides positions, dwells and slews.
fn differ(schemes: &[ComparedScheme]) -> Vec<String> {
    let Some((first, others)) = schemes.split_first() else { return Vec::new() };
    // psi of every position counts as psi
    let required = |r: &ComparedScheme| -> BTreeMap<String, Option<f64>> {
        let family = |name: &str| name.split('@').next().unwrap_or_default().to_string();
        r.quantities.iter().map(|q| (family(&q.name), q.requirement)).collect()
    };
    let here = required(first);
    let other = |differs: &dyn Fn(&ComparedScheme) -> bool| others.iter().any(differs);
    let noise = |r: &ComparedScheme| (r.conditions.accelerometer_noise_g, r.conditions.azimuth_noise_deg);
    let random = |r: &ComparedScheme| {
        let c = &r.conditions;
        (c.drift_noise.clone(), c.gyro_noise, c.accelerometer_bias)
    };
    let found = [
        ("carry", other(&|r| r.carry != first.carry)),
        ("latitude", other(&|r| r.conditions.latitude_deg != first.conditions.latitude_deg)),
        ("unknowns", other(&|r| !required(r).keys().eq(here.keys()))),
        ("requirements", other(&|r| required(r).iter().any(|(n, x)| here.get(n).is_some_and(|y| x != y)))),
        ("noise", other(&|r| noise(r) != noise(first))),
        ("random drift or bias instability", other(&|r| random(r) != random(first))),
        ("prior", other(&|r| r.conditions.prior != first.conditions.prior)),
        ("bench", other(&|r| r.conditions.bench != first.conditions.bench)),
        ("step", other(&|r| r.conditions.step_s != first.conditions.step_s)),
        ("settle", other(&|r| r.conditions.settle_s != first.conditions.settle_s)),
    ];
    found.into_iter().filter(|f| f.1).map(|f| f.0.into()).collect()
}

/// Predicted standard deviations of all unknowns at the end, in deg, deg/h, deg/h/g, under the stated
/// conditions; with a bench their total uncertainties. `None` where neither samples nor stated priors bound
/// the unknown.
///
/// # Errors
/// [`SimulationError`].
pub fn predicted(
    scheme: &Scheme,
    conditions: &Conditions,
    seed: u64,
) -> Result<Vec<(String, Option<f64>)>, SimulationError> {
    let judged = judged(scheme, conditions, seed)?;
    Ok(judged.plan.platform.names().iter().cloned().zip(judged.totals.iter().copied()).collect())
}

/// Accuracy of a scheme under those conditions that concern its unknowns: other carries and fewer positions
/// have other unknowns.
fn judged(scheme: &Scheme, conditions: &Conditions, seed: u64) -> Result<Attained, SimulationError> {
    Bench::check(&conditions.bench, scheme.positions.len(), scheme.rotates())?;
    Attained::new(scheme, &conditions.within(&Platform::new(scheme.clone())?), seed)
}

/// Rank with dwell, and number of unknowns.
fn rank(of: &Attained) -> [usize; 2] {
    [of.prediction.rank, of.prediction.unknowns.len()]
}

/// Names of the coefficients that have a sigma.
fn determined(of: &Attained) -> Vec<String> {
    let (names, units) = (of.plan.platform.names(), of.plan.platform.units());
    let determined = (0..names.len()).filter(|&c| units[c] != "rad" && of.sigmas[c].is_some());
    determined.map(|c| names[c].clone()).collect()
}

fn review(entry: &Entry, seed: u64) -> Result<ComparedScheme, SimulationError> {
    let Entry { name, scheme, conditions } = entry;
    let judged = judged(scheme, conditions, seed)?;
    conditions.concern(&judged.plan.platform)?;
    let drop_one = drop_one(scheme, conditions, &judged, seed)?;
    let mut quantities = quantities(&judged, conditions, &drop_one)?;
    // drifts that are not stated, or beyond what a run admits, give no validity
    let states_drifts = !conditions.stated_values().is_empty();
    let own = match states_drifts.then(|| at_own_drifts(&judged.plan, conditions)) {
        None => None,
        Some(Err(e)) if e.is_numeric() => None,
        Some(own) => own?,
    };
    if let Some((_, sigmas)) = own.as_ref().filter(|(validity, _)| !validity.holds) {
        for ((q, sigma), unit) in quantities.iter_mut().zip(sigmas).zip(judged.plan.platform.units()) {
            q.sigma_extended = (*unit != "rad").then(|| sigma / si_per_shown(unit));
        }
    }
    let requirements = judged.requirements(conditions)?;
    let slews = judged.plan.slews();
    let has_slews = judged.plan.slews().next().is_some();
    Ok(ComparedScheme {
        name: name.clone(),
        carry: scheme.carry,
        conditions: MeasurementReport::new(scheme, conditions),
        positions: scheme.positions.iter().map(|p| p.name.clone()).collect(),
        slews: slews.map(|(p, turn)| ComparedSlew { to: scheme.positions[p].name.clone(), turn }).collect(),
        total_s: judged.plan.duration_s(),
        rank: rank(&judged),
        meets_requirements: requirements.all_met(),
        requirements,
        other_carries: other_carries(scheme, conditions, seed)?,
        omitted: omitted_effects(&judged, conditions, seed)?,
        has_accuracy_orders: judged.prediction.has_accuracy_orders,
        quantities,
        worst: judged.worst_of(&|_| true),
        validity: own.map(|(validity, _)| validity),
        noise_floor: noise_floor(scheme, conditions, &judged.prediction)?,
        gimbals: scheme.gimbal_report(),
        drop_one,
        sensitivity: sensitivity(scheme, conditions, &determined(&judged), has_slews, seed)?,
    })
}

fn quantities(
    judged: &Attained,
    conditions: &Conditions,
    drop_one: &[DropOne],
) -> Result<Vec<ComparedQuantity>, SimulationError> {
    let platform = &judged.plan.platform;
    let requirements = resolve("required sigma", platform, &conditions.requirements, f64::NAN)?;
    let first_d = platform.names().len() - platform.coefficients();
    let excitations = excitations(judged);
    let excitation = |c: usize| -> Vec<f64> {
        let Some(d) = c.checked_sub(first_d) else { return Vec::new() };
        excitations.iter().map(|of| of[d]).collect()
    };
    let of_unknown = |(c, u): (usize, &crate::prediction::PredictedUnknown)| {
        let name = &platform.names()[c];
        let requirement = Some(requirements[c]).filter(|r| !r.is_nan());
        let sigma = judged.sigmas[c];
        let carries = drop_one.iter().filter(|d| d.lost.contains(name));
        ComparedQuantity {
            name: name.clone(),
            unit: shown_unit(platform.units()[c]).into(),
            status: u.status,
            degree: u.degree,
            accuracy_order: u.accuracy_order,
            sigma,
            by_prior: judged.by_prior[c],
            sigma_extended: None,
            requirement,
            total: judged.totals[c].filter(|_| judged.has_bench()),
            margin: RequirementClaim {
                name,
                required: requirement,
                sigma: judged.totals[c].ok_or(Miss::NotObservable),
            }
            .margin(),
            excitation: excitation(c),
            carried_by: carries.map(|d| d.position.clone()).collect(),
        }
    };
    Ok(judged.prediction.unknowns.iter().enumerate().map(of_unknown).collect())
}

/// Excitation per position and coefficient: the length of the coefficient's column of `eps^n = C E D`, or of
/// the error of the accelerometers. Over the arc of a rotating segment it is the root mean square. The
/// columns of C are orthonormal, so the length is the product of components of g, f, or of the earth rate.
fn excitations(judged: &Attained) -> Vec<Vec<f64>> {
    let (plan, platform) = (&judged.plan, &judged.plan.platform);
    let squares = |c: &Matrix3<f64>| -> Vec<f64> {
        let rows = plan.drift_rows(c, None);
        let seen = platform.errors().accelerometer_rows(&Float, c);
        // torquers: rates in units of the earth rate
        let unit = |t: &ErrorTerm| if t.source == ErrorSource::Rate { W_IE } else { 1.0 };
        let square = |(d, t): (usize, &ErrorTerm)| -> f64 {
            rows.iter().chain(&seen).map(|r| (r[d] / unit(t)).powi(2)).sum()
        };
        platform.error_terms().iter().enumerate().map(square).collect()
    };
    let of = |(i, position): (usize, &Position)| -> Vec<f64> {
        let Some(turn) = &position.rotation else {
            return squares(&plan.attitudes[i]).iter().map(|x| x.sqrt()).collect();
        };
        let arc = slew::Slew::about(&plan.attitudes[i], turn, 1.0);
        let mut mean = vec![0.0; platform.coefficients()];
        for (t, weight) in quadrature(arc.rate.iter().map(|x| x * x).sum::<f64>().sqrt()) {
            for (m, x) in mean.iter_mut().zip(squares(&arc.at(t))) {
                *m += weight * x;
            }
        }
        mean.iter().map(|x| x.max(0.0).sqrt()).collect()
    };
    platform.scheme().positions.iter().enumerate().map(of).collect()
}

/// Points in [0, 1] with weights for a mean over an arc (rad): three-point Gauss-Legendre rules on intervals
/// of at most five degrees, exact to 1e-10 for the squares of second-order terms.
fn quadrature(arc: f64) -> Vec<(f64, f64)> {
    const PART: f64 = std::f64::consts::PI / 36.0;
    const MOST: f64 = 10_000.0;
    let parts = (arc / PART).ceil().clamp(1.0, MOST);
    let offset = 0.6f64.sqrt();
    let of = |i: usize| {
        let points = [(-offset, 5.0), (0.0, 8.0), (offset, 5.0)];
        points.map(|(x, weight)| ((i as f64 + 0.5 + x / 2.0) / parts, weight / 18.0 / parts))
    };
    (0..parts as usize).flat_map(of).collect()
}

/// Comparison of the scheme without each of its positions in turn.
fn drop_one(
    scheme: &Scheme,
    conditions: &Conditions,
    whole: &Attained,
    seed: u64,
) -> Result<Vec<DropOne>, SimulationError> {
    if scheme.positions.len() < 2 {
        return Ok(Vec::new());
    }
    let observable = |of: &Attained, name: &String| {
        let c = of.plan.platform.names().iter().position(|n| n == name);
        let unknown = |c: usize| &of.prediction.unknowns[c];
        c.is_some_and(|c| unknown(c).status == Status::Observable || unknown(c).determined)
    };
    let without = |i: usize| {
        let position = scheme.positions[i].name.clone();
        let own = Conditions { bench: Bench::without(&conditions.bench, i), ..conditions.clone() };
        let judged = judged(&scheme.without_position(i), &own, seed)?;
        let names = whole.plan.platform.names().iter();
        // under reset carry every position has a psi of its own
        let names = names.filter(|n| !n.contains('@'));
        let lost = names.filter(|n| observable(whole, n) && !observable(&judged, n)).cloned().collect();
        let requirements = judged.requirements(conditions)?;
        Ok(DropOne { position, lost, worst: judged.worst_of(&|_| true), requirements })
    };
    parallel::try_map(scheme.positions.len(), without)
}

/// Worst sigmas at other latitudes, dwells and carries.
fn sensitivity(
    scheme: &Scheme,
    conditions: &Conditions,
    determined: &[String],
    slews: bool,
    seed: u64,
) -> Result<Vec<Sensitivity>, SimulationError> {
    let mut others: Vec<(String, Scheme, Conditions)> = Vec::new();
    for latitude in LATITUDES {
        let other = Scheme { latitude: latitude.parse().ok(), ..scheme.clone() };
        others.push((format!("latitude {latitude} deg"), other, conditions.clone()));
    }
    for factor in DWELLS {
        let other = scheme.with_dwells(conditions.dwell_s, factor)?;
        if conditions.leaves_samples(&other) {
            others.push((format!("dwell x {factor}"), other, conditions.clone()));
        }
    }
    let without = if slews { ", no slews" } else { "" };
    for carry in Carry::ALL.into_iter().filter(|c| *c != scheme.carry) {
        let other = under(scheme, conditions, carry);
        others.extend(other.map(|(other, still)| (format!("{carry} carry{without}"), other, still)));
    }
    let of = |i: usize| {
        let (condition, scheme, conditions) = &others[i];
        let judged = judged(scheme, conditions, seed)?;
        let worst_determined = judged.worst_of(&|name| determined.contains(name));
        Ok(Sensitivity {
            condition: condition.clone(),
            rank: rank(&judged),
            worst: judged.worst_of(&|_| true),
            worst_determined,
        })
    };
    parallel::try_map(others.len(), of)
}

//! Found schemes as schemes with gimbal angles and conditions.

use std::collections::BTreeMap;

use obsdeg_core::model::ranges::DWELL_S;
use obsdeg_core::model::settings::{Assignment, Settings, concerns};
use obsdeg_core::model::{
    Acceptance, Angle, Dwell, Platform, Position, Recording, Scheme, SchemeError, SlewAxis, SlewTo,
    angles_text, parse_attitude,
};
use obsdeg_evidence::simulation::{AccelerometerBias, Conditions, latitude_of};

use crate::design::answer::{Design, Found};
use crate::design::request::error::DesignError;

/// Half turn in degrees.
const HALF: i32 = 180;

/// Gives every scheme of an answer the gimbal angles of its attitudes within the limits of `base`, each
/// with the shortest gimbal path from the previous position. A name made of the old angles is replaced.
///
/// # Errors
/// [`DesignError::Scheme`] for a dwell that no scheme has.
pub(crate) fn within_gimbals(
    out: &mut Design,
    base: &Scheme,
    conditions: &Conditions,
) -> Result<(), DesignError> {
    for found in out.found.iter_mut().chain(&mut out.front) {
        let within = chosen(&found.angles, base);
        for ((name, angles), within) in found.positions.iter_mut().zip(&found.angles).zip(&within) {
            if name == angles {
                name.clone_from(within);
            }
        }
        found.angles = within;
    }
    let certificate = out.search.as_mut().and_then(|s| s.certificate.as_mut());
    let rounded = certificate.and_then(|c| c.everywhere.as_mut()?.rounded.as_mut());
    if let Some(finer) = rounded.and_then(|r| r.finer.as_mut()) {
        finer.angles = chosen(&finer.angles, base);
    }
    if let Some(first) = out.found.first() {
        out.gimbals = scheme(first, base, conditions)?.gimbal_report();
    }
    // angles of a user's own file are kept, and reported
    if let (Some(report), Some(own)) = (&mut out.gimbals, base.gimbal_report()) {
        report.beyond = own.beyond;
    }
    Ok(())
}

/// Gimbal angles of successive attitudes, from their angles.
fn chosen(angles: &[String], base: &Scheme) -> Vec<String> {
    let attitudes: Vec<_> = angles.iter().filter_map(|text| parse_attitude(text).ok()).collect();
    base.gimbals.along(&attitudes).iter().map(angles_text).collect()
}

/// Found scheme under the assumptions of `base` and `conditions`, with dwells, slews and the directions
/// of half turns, so that its sigmas are those of the search. Positions are p1, p2, ...
///
/// # Errors
/// [`DesignError::Scheme`] for a dwell that no scheme has.
pub fn scheme(found: &Found, base: &Scheme, conditions: &Conditions) -> Result<Scheme, DesignError> {
    let attitudes = found.angles.iter().filter_map(|text| parse_attitude(text).ok());
    let mut positions = Scheme::of_angles(attitudes).positions;
    for (i, p) in positions.iter_mut().enumerate() {
        let seconds = found.dwells_s.get(i).copied().unwrap_or(found.dwell_s);
        let dwell = Dwell::from_seconds(seconds).ok_or(SchemeError::Dwell { found: seconds.to_string() })?;
        p.dwell = Some(dwell);
    }
    for turn in &found.half_turns {
        if let Some(p) = positions.get_mut(turn.to - 1) {
            p.slew = Some(half_turn(&turn.about));
        }
    }
    let dwell_s = Some(found.dwell_s).filter(|s| found.dwells_s.is_empty() && DWELL_S.admits(*s));
    Ok(under(base, conditions, positions, dwell_s))
}

/// Positions as a scheme that states all conditions of a search.
pub(crate) fn under(
    base: &Scheme,
    conditions: &Conditions,
    positions: Vec<Position>,
    dwell_s: Option<f64>,
) -> Scheme {
    let bias = AccelerometerBias::of(conditions);
    let gyros = (!conditions.gyro_noise.is_none()).then_some(conditions.gyro_noise);
    Scheme {
        name: String::new(),
        description: String::new(),
        positions,
        latitude: latitude_of(base),
        combinations: Vec::new(),
        simulation: Settings {
            step_s: Some(conditions.step_s),
            dwell_s,
            slew_rate_deg_s: conditions.slew_rate_deg_s,
            accelerometer_noise_g: Some(conditions.accelerometer_noise_g),
            priors: by_name(conditions.stated_priors()),
            accelerometer_bias_instability_ug: bias.map(|b| b.instability_ug),
            accelerometer_correlation_time_s: bias.map(|b| b.correlation_time_s),
            azimuth_noise_deg: base.measured_azimuth.then_some(conditions.azimuth_noise_deg),
            // the absence of random drift is a condition too
            drift_noise: Some(conditions.as_stated().drift_noise),
            angle_random_walk_deg_sqrt_h: gyros.map(|g| g.angle_random_walk_deg_sqrt_h),
            rate_random_walk_dph_sqrt_h: gyros.map(|g| g.rate_random_walk_dph_sqrt_h),
            bias_instability_dph: gyros.map(|g| g.bias_instability_dph),
            correlation_time_s: gyros.map(|g| g.correlation_time_s),
            drift_scale: (conditions.drift_scale != 1.0).then_some(conditions.drift_scale),
            ..base.simulation.clone()
        },
        requirements: by_name(&conditions.requirements),
        bench: by_name(&conditions.bench),
        acceptance: within_terms(base),
        recording: Recording {
            settle: Some(conditions.settle_s).filter(|s| *s > 0.0),
            ..base.recording.clone()
        },
        ..base.clone()
    }
}

/// Acceptance limits of the coefficients that the scheme has.
fn within_terms(base: &Scheme) -> Acceptance {
    let names = Platform::new(Scheme { combinations: Vec::new(), ..base.clone() });
    let names = names.map(|p| p.names().to_vec()).unwrap_or_default();
    let mut out = base.acceptance.clone();
    out.limits.retain(|name, _| names.iter().any(|n| concerns(name, n)));
    if out.limits.is_empty() { Acceptance::default() } else { out }
}

/// Assignments as a file states them: a value for a single unknown overrides that of its family, in any
/// order.
fn by_name(given: &[Assignment]) -> BTreeMap<String, f64> {
    let mut out = BTreeMap::new();
    for a in given {
        out.retain(|name: &String, _| !concerns(&a.name, name));
        out.insert(a.name.clone(), a.value);
    }
    out
}

/// Half turn about a direction in n: an axis by its name, others by components of which the largest is
/// 1.
pub(crate) fn half_turn(about: &[f64; 3]) -> SlewTo {
    let largest = about.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let direction = about.map(|x| (x / largest * 1e12).round() / 1e12 + 0.0);
    let named = ["N", "U", "E"].iter().zip(direction).filter(|(_, x)| *x != 0.0).collect::<Vec<_>>();
    let (axis, angle) = match named[..] {
        [(name, x)] => (name.parse().ok(), if x < 0.0 { -HALF } else { HALF }),
        _ => (Some(SlewAxis::Direction(direction)), HALF),
    };
    SlewTo { rate_deg_s: None, axis, angle: Some(Angle::from_degrees(angle)) }
}

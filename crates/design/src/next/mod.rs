//! Next positions of a scheme, or after a calibration. Every extension by one or two candidates is compared,
//! first by its verdicts, then by the largest ratio of total uncertainty to requirement. For coefficients
//! that aged since a calibration: runs that meet the requirements again.

mod answer;
mod bound;
mod compared;
mod options;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU64, Ordering};

use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{Platform, Scheme, Unknowns, angles_text};
use obsdeg_core::remedies::Resolved;
use obsdeg_evidence::simulation::{
    Conditions, KnownCovariance, MeasurementReport, general_first, latitude_of, resolve,
};
use obsdeg_exact::parallel;

pub use answer::*;
pub use options::NextOptions;

use self::compared::{Compared, JudgedExtension, StateBefore};
use self::options::any_position;
use crate::design::{Candidates, DesignError, asked};

/// Compared extensions, best first.
struct Listed {
    found: Vec<JudgedExtension>,
    examined: u64,
    interrupted: bool,
}

/// Compares extensions of `base` under `conditions`. Without a prior covariance the positions of `base` come
/// first. Added positions have the dwell of `conditions`. `progress` receives the number of extensions
/// compared so far and in total; if it returns false, the answer holds the best extensions so far.
///
/// # Errors
/// [`DesignError`].
pub fn next(
    base: &Scheme,
    conditions: &Conditions,
    options: &NextOptions,
    progress: &(dyn Fn(u64, u64) -> bool + Sync),
) -> Result<NextPositions, DesignError> {
    let stated = conditions;
    let conditions = &asked(base, conditions, &options.required)?;
    conditions.validate()?;
    let (candidates, beyond) = options.candidates.clone().within(&base.gimbals);
    let required = check(base, options, &candidates)?;
    let start = start(base, options);
    let schedule = schedule(&start, conditions, &candidates, &required, options, progress)?;
    let options = &match options.days.last() {
        Some(days) => NextOptions { beforehand: aged(&start, options, *days)?, ..options.clone() },
        None => options.clone(),
    };
    let compared =
        Compared { start: &start, conditions, candidates: &candidates, required: &required, options };
    let Listed { mut found, examined, interrupted } = listed(&compared, progress)?;
    let Some(first) = found.first() else {
        return Err(if interrupted { DesignError::Interrupted } else { none_fits(options) });
    };
    let as_good = found.iter().filter(|e| e.is_as_good_as(first)).count() as u64;
    let meets = compared.meets(first)?;
    let error_bound = first.error_bound;
    let before = compared.before()?;
    let bound = compared.bound(first)?;
    let by_candidate = if options.added == 1 { by_candidate(&found) } else { Vec::new() };
    found.truncate(options.keep.max(1));
    let found = found.into_iter().map(|e| extension(e, before.as_ref(), &required)).collect();
    Ok(NextPositions {
        schedule,
        found,
        by_candidate,
        degrees_before: match (&before, &options.beforehand) {
            (Some(before), None) => before.degrees.clone(),
            _ => Vec::new(),
        },
        before: before.map(|b| b.standing),
        as_good,
        bound,
        meets,
        examined,
        proven: !interrupted,
        interrupted,
        error_bound,
        beyond_gimbals: beyond,
        ..before_search(&compared, base, stated)?
    })
}

/// Answer without extensions: the scheme, candidates and conditions. `stated` are the conditions with all
/// requirements.
fn before_search(
    compared: &Compared<'_>,
    base: &Scheme,
    stated: &Conditions,
) -> Result<NextPositions, DesignError> {
    let Compared { start, conditions, candidates, required, options } = *compared;
    let of_conditions = Scheme { positions: any_position(), ..start.clone() };
    let names = Platform::new(Scheme { combinations: Vec::new(), ..of_conditions.clone() })?.names().to_vec();
    let walks = if options.days.is_empty() { Default::default() } else { base.ageing.clone() };
    let (ageing, unused): (BTreeMap<String, f64>, BTreeMap<String, f64>) =
        walks.into_iter().partition(|(of, _)| names.iter().any(|name| concerns(of, name)));
    Ok(NextPositions {
        schema: NEXT_SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        carry: base.carry,
        geometry: base.geometry,
        terms: base.unknowns.to_string(),
        positions: start.positions.iter().map(|p| p.name.clone()).collect(),
        position_angles: start.positions.iter().map(|p| angles_text(&p.angles)).collect(),
        after_calibration: options.beforehand.is_some(),
        days: options.days.last().copied(),
        unused_ageing: unused.into_keys().collect(),
        ageing,
        schedule: Vec::new(),
        candidates: candidates.names.clone(),
        beyond_gimbals: Vec::new(),
        added: options.added,
        required: required.to_vec(),
        conditions: MeasurementReport::new(&of_conditions, conditions),
        found: Vec::new(),
        by_candidate: Vec::new(),
        degrees_before: Vec::new(),
        before: None,
        as_good: 0,
        bound: None,
        meets: None,
        examined: 0,
        proven: false,
        interrupted: false,
        not_judged: not_judged(stated, conditions),
        error_bound: 0.0,
        seed: options.seed,
    })
}

/// Stated requirements that are missing in `conditions`.
fn not_judged(stated: &Conditions, conditions: &Conditions) -> Vec<String> {
    let judged = |a: &&Assignment| conditions.requirements.iter().any(|r| concerns(&a.name, &r.name));
    stated.requirements.iter().filter(|a| !judged(a)).map(|a| a.name.clone()).collect()
}

/// All extensions within the limits, best first.
fn listed(
    compared: &Compared<'_>,
    progress: &(dyn Fn(u64, u64) -> bool + Sync),
) -> Result<Listed, DesignError> {
    let sequences = compared.sequences()?;
    let (all, done) = (sequences.len() as u64, AtomicU64::new(0));
    let judge = |sequence: &compared::Sequence| {
        let count = done.fetch_add(1, Ordering::Relaxed);
        if progress(count, all) { compared.extended(sequence).map(Some) } else { Ok(None) }
    };
    let judged: Vec<Option<JudgedExtension>> = parallel::try_map(sequences.len(), |i| judge(&sequences[i]))?;
    let interrupted = judged.iter().any(Option::is_none);
    let examined = judged.iter().flatten().count() as u64;
    let mut found: Vec<JudgedExtension> =
        judged.into_iter().flatten().filter(JudgedExtension::is_possible).collect();
    found.sort_by(JudgedExtension::order);
    Ok(Listed { found, examined, interrupted })
}

/// Best extension by each candidate, in the order of the extensions, which add one position each.
fn by_candidate(found: &[JudgedExtension]) -> Vec<CandidateGain> {
    let mut seen = BTreeSet::new();
    let firsts = found.iter().filter(|e| seen.insert(e.sequence[0].0));
    firsts
        .map(|e| {
            let (position, standing) = (&e.positions[0], &e.standing);
            CandidateGain {
                candidate: position.candidate.clone(),
                angles: position.angles.clone(),
                not_observable: standing.not_observable.len(),
                ratio: standing.requirements.worst.as_ref().map(|w| 1.0 / w.margin),
                worst: standing.worst.clone(),
                degrees: e.degrees.clone(),
            }
        })
        .collect()
}

/// Requalification after each number of days.
fn schedule(
    start: &Scheme,
    conditions: &Conditions,
    candidates: &Candidates,
    required: &[String],
    options: &NextOptions,
    progress: &(dyn Fn(u64, u64) -> bool + Sync),
) -> Result<Vec<Requalification>, DesignError> {
    let of_day = |&days: &f64| {
        let beforehand = aged(start, options, days)?;
        let with = |added| NextOptions { beforehand: beforehand.clone(), added, ..options.clone() };
        let options = with(options.added);
        let compared = Compared { start, conditions, candidates, required, options: &options };
        let Some(before) = compared.before()? else { return Err(DesignError::NoCalibration) };
        let mut out = Requalification {
            days,
            before: before.standing.clone(),
            fewest: Some(0),
            best: None,
            quickest: None,
            examined: 0,
        };
        if before.standing.requirements.all_met() {
            return Ok(out);
        }
        out.fewest = None;
        for added in 1..=options.added {
            let options = with(added);
            let compared = Compared { start, conditions, candidates, required, options: &options };
            let Listed { found, examined, interrupted } = listed(&compared, progress)?;
            if interrupted {
                return Err(DesignError::Interrupted);
            }
            out.examined += examined;
            let quickest = compared.quickest(&found, out.quickest.as_ref().map(|q: &Quickest| q.total_s))?;
            out.quickest = quickest.or(out.quickest);
            let met = found.into_iter().find(|e| e.standing.requirements.all_met());
            if let (Some(met), None) = (met, out.fewest) {
                out.fewest = Some(added);
                out.best = Some(extension(met, Some(&before), required));
            }
        }
        Ok(out)
    };
    options.days.iter().map(of_day).collect()
}

/// Covariance of the calibration after some days of ageing.
fn aged(start: &Scheme, options: &NextOptions, days: f64) -> Result<Option<KnownCovariance>, DesignError> {
    let Some(known) = &options.beforehand else { return Err(DesignError::NoCalibration) };
    let platform = Platform::new(Scheme { positions: any_position(), ..start.clone() })?;
    let walk = |(name, value): (&String, &f64)| Assignment { name: name.clone(), value: *value };
    let stated = general_first(start.ageing.iter().map(walk).collect());
    let walks = resolve("ageing", &platform, &stated, 0.0)?;
    let names = platform.names();
    Ok(Some(known.aged(|name| names.iter().position(|n| n == name).map(|c| walks[c]), days)))
}

/// Scheme to extend; after a calibration it has no positions.
fn start(base: &Scheme, options: &NextOptions) -> Scheme {
    let positions = if options.beforehand.is_some() { Vec::new() } else { base.positions.clone() };
    Scheme { positions, latitude: latitude_of(base), combinations: Vec::new(), ..base.clone() }
}

/// Names of the required coefficients, after checks of the options.
fn check(base: &Scheme, options: &NextOptions, candidates: &Candidates) -> Result<Vec<String>, DesignError> {
    if base.unknowns == Unknowns::Drift {
        return Err(DesignError::Drift);
    }
    if candidates.attitudes.is_empty() {
        return Err(DesignError::Candidates { found: 0 });
    }
    if !(1..=2).contains(&options.added) {
        return Err(DesignError::Added { found: options.added });
    }
    for (what, limit) in [("a total time", options.total_s), ("a longest slew", options.slew_s)] {
        if let Some(found) = limit.filter(|l| !(l.is_finite() && *l > 0.0)) {
            return Err(DesignError::Limit { what, found });
        }
    }
    let given = base.positions.iter().filter(|_| options.beforehand.is_none()).map(|p| &p.angles);
    if let Some((name, _)) = given.chain(&candidates.attitudes).flatten().find_map(|a| a.generic()) {
        return Err(DesignError::GenericAngle { name: name.into() });
    }
    let platform =
        Platform::new(Scheme { positions: any_position(), combinations: Vec::new(), ..base.clone() })?;
    let first = platform.names().len() - platform.coefficients();
    let all = &platform.names()[first..];
    if let Some(found) = options.required.iter().find(|r| !all.iter().any(|name| concerns(r, name))) {
        return Err(DesignError::UnknownName { found: found.clone(), known: all.join(", ") });
    }
    let counts =
        |name: &&String| options.required.is_empty() || options.required.iter().any(|r| concerns(r, name));
    Ok(all.iter().filter(counts).cloned().collect())
}

fn none_fits(options: &NextOptions) -> DesignError {
    let limits = [
        options.total_s.map(|s| format!("at most {s} s in all")),
        options.slew_s.map(|s| format!("slews of at most {s} s")),
    ];
    let limits: Vec<String> = limits.into_iter().flatten().collect();
    DesignError::NoExtension { limits: limits.join(" and ") }
}

/// Extension as listed in the answer, with its changes relative to the state before.
fn extension(e: JudgedExtension, before: Option<&StateBefore>, required: &[String]) -> Extension {
    let was = |c: usize| before.and_then(|b| b.degrees[c]);
    let was_open = |c: usize| before.is_none_or(|b| b.standing.not_observable.contains(&required[c]));
    let changed = |keep: &dyn Fn(usize, usize) -> bool| -> Vec<Resolved> {
        let of = |(c, degree): (usize, &Option<usize>)| {
            let degree = degree.filter(|&now| keep(c, now))?;
            Some(Resolved { name: required[c].clone(), degree })
        };
        e.degrees.iter().enumerate().filter_map(of).collect()
    };
    Extension {
        resolves: changed(&|c, _| was(c).is_none() && was_open(c)),
        lowers: changed(&|c, now| was(c).is_some_and(|was| now < was)),
        positions: e.positions,
        then: e.standing,
    }
}

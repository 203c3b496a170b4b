//! The search from request to answer.

use std::sync::atomic::Ordering;

use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{Angle, Euler, Scheme};
use obsdeg_evidence::simulation::omitted::omitted_effects;
use obsdeg_evidence::simulation::{Attained, Conditions, MeasurementReport, latitude_of, other_carries};
use obsdeg_exact::parallel;

use crate::design::answer::{Design, Found, PartsReport, SCHEMA, SearchReport, TiesReport};
use crate::design::request::error::DesignError;
use crate::design::request::limits::PROOF;
use crate::design::request::options::DesignOptions;
use crate::design::run::free::Free;
use crate::design::run::prepared::Prepared;
use crate::design::run::task::{Task, asked};
use crate::design::run::{alternatives, certify, winner};
use crate::design::search::best::Best;
use crate::design::search::progress::{NOTHING_YET, Progress, watched};
use crate::design::search::ties::TIE;

/// Finds schemes under the assumptions of `base` (its positions do not matter); `conditions` give the
/// noise, the dwell, the rate of slews and the requirements. A search stops when `progress` returns
/// false and gives its best schemes so far.
///
/// # Errors
/// [`DesignError`].
pub fn design(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Design, DesignError> {
    answered(base, conditions, options, progress, None)
}

/// Source of search results instead of a search: merged parts, with their report.
pub(crate) type ResultSource<'a> =
    &'a dyn Fn(&Prepared<'_>, usize) -> Result<(Best, PartsReport), DesignError>;

/// Answer of a design; `elsewhere` provides the results instead of a search.
pub(crate) fn answered(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
    elsewhere: Option<ResultSource<'_>>,
) -> Result<Design, DesignError> {
    let stated = conditions;
    let conditions = &asked(base, conditions, &options.required)?;
    watched(progress, |progress, stopped| {
        let going = || progress(NOTHING_YET);
        let free =
            options.free.map(|step| Free::new(base, conditions, options, step, progress)).transpose()?;
        let chosen =
            free.as_ref().map(|f| DesignOptions { candidates: f.candidates.clone(), ..options.clone() });
        let options = chosen.as_ref().unwrap_or(options);
        let prepared = Prepared::new(base, conditions, options, &going)?;
        let task = &prepared.task;
        let minimum = task.minimum(&prepared.degrees, &going)?;
        let mut sets = minimum.none_of.iter().fold(0.0, |sum, [_, sets]| sum + *sets as f64);
        let mut out = Design {
            schema: SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            carry: base.carry,
            latitude_deg: latitude_of(base).map_or(0.0, |l| l.degrees()),
            latitude_by_default: base.latitude.is_none(),
            geometry: base.geometry,
            terms: base.unknowns.to_string(),
            candidates: task.candidates.names.clone(),
            beyond_gimbals: prepared.beyond.clone(),
            symmetry: task.symmetry.order,
            required: task.required.iter().map(|r| r.0.clone()).collect(),
            minimum,
            search: None,
            found: Vec::new(),
            front: Vec::new(),
            bias_front: Vec::new(),
            bias_front_complete: false,
            omitted: None,
            other_carries: Vec::new(),
            not_judged: not_judged(stated, conditions),
            gimbals: None,
            primes: task.rows.fields(),
            error_bound: task.rows.error_bound(sets),
            seed: options.seed,
        };
        out.minimum.proven &= out.error_bound < PROOF;
        let Some(k) = options.positions else { return Ok(out) };
        prepared.check(k)?;
        let evaluator = &prepared.evaluator;
        let search = prepared.search(progress);
        let bound = task.bound(evaluator, k, &going);
        let (merged, parts) = elsewhere.map(|parts| parts(&prepared, k)).transpose()?.unzip();
        let (best, exhaustive) = match (merged, &free) {
            (Some(merged), _) => (merged, task.space(k, evaluator)),
            (None, Some(free)) => free.searched(&prepared, &search, k)?,
            (None, None) => prepared.searched(&search, k, bound.as_ref()),
        };
        if let Some((more, _)) = exhaustive {
            sets += more as f64;
            out.error_bound = task.rows.error_bound(sets);
        }
        let all = exhaustive.is_some() && best.complete;
        out.found = task.all_found(evaluator, &best.found)?;
        if task.is_noisy() {
            out.found.sort_by(|a, b| a.worst_degree.cmp(&b.worst_degree).then(a.value.total_cmp(&b.value)));
        }
        if task.ranks() {
            out.found.truncate(options.keep.max(1));
        }
        task.mark_images(&mut out.found, evaluator.ordered());
        let Some(first) = best.found.first().filter(|_| !out.found.is_empty()) else {
            let (positions, wanted) = (k, task.wanted());
            let error = match (best.complete, exhaustive) {
                (false, _) => return Err(DesignError::Interrupted),
                (true, Some(_)) if !task.ranks() => DesignError::Impossible {
                    positions,
                    wanted,
                    why: examined(best.lost, conditions.slew_rate_deg_s.is_some()),
                },
                (true, _) => DesignError::NotFound { positions, wanted, examined: best.examined },
            };
            if !options.meet {
                return Err(error);
            }
            let nearest = alternatives::seek(base, conditions, options, k, progress)?;
            return Err(DesignError::NotMet { why: Box::new(error), nearest: Box::new(nearest) });
        };
        out.front = task.all_found(evaluator, &best.front)?;
        // the bound is for samples without random drift: figures with drift may exceed it by any amount
        let certified = bound.filter(|_| !task.is_noisy());
        let mut certificate = certified.map(|bound| task.certificate(&bound, task.value(evaluator, first)));
        if best.complete {
            (out.bias_front, out.bias_front_complete) = task.bias_front(evaluator, &search, k, &best);
            let of = (k, conditions.dwell_s);
            let wanted = certificate.is_some() && options.everywhere && free.is_none();
            let over_all = || wanted.then(|| evaluator.everywhere(&task.criterion, k, &going)).flatten();
            let line = || certificate.is_some().then(|| task.front_bound(evaluator, of, &going));
            let (front, (found, line)) = parallel::join(
                || task.front(evaluator, &search, of, &best),
                || parallel::join(over_all, line),
            );
            out.front.extend(front?);
            if let (Some(certificate), Some(line)) = (&mut certificate, line) {
                let every = free.as_ref().map(|f| &f.every).or(found.as_ref());
                certificate.everywhere = every.map(|every| {
                    let rounded = options.free.zip(free.as_ref()).map(|(step, f)| (step, f.finer.as_ref()));
                    certify::everywhere(every, task.value_among_all(evaluator, first), rounded)
                });
                certificate.front = line;
            }
        }
        if options.refine && going() {
            let refined = task.refined(evaluator, first, &going)?;
            out.front.extend(refined.iter().cloned());
            let refined = refined.filter(|f| improves(task, f, out.found.first()));
            put_first(&mut out.found, refined);
        }
        if options.divide && going() {
            let divided = task.divided(evaluator, first, &going)?;
            out.front.extend(divided.iter().cloned());
            let divided = divided.filter(|f| improves(task, f, out.found.first()));
            put_first(&mut out.found, divided);
        }
        out.front = pareto(std::mem::take(&mut out.front));
        out.other_carries = match out.found.first() {
            Some(best) => {
                let scheme = winner::scheme(best, base, conditions)?;
                let own = Conditions::of(&scheme);
                let attained = Attained::new(&scheme, &own, options.seed)?;
                out.omitted = Some(omitted_effects(&attained, &own, options.seed)?);
                other_carries(&scheme, &own, options.seed)?
            }
            None => Vec::new(),
        };
        out.search = Some(SearchReport {
            positions: k,
            // positions that are searched for have the dwell of the conditions
            conditions: MeasurementReport::new(
                &Scheme { positions: Scheme::of_angles([zero()]).positions, ..base.clone() },
                conditions,
            ),
            drift_noise: conditions.as_stated().drift_noise_in_words(),
            prior: conditions.stated_prior_in_words(),
            criterion: task.criterion.name().into(),
            unit: task.unit().ok().flatten().map(Into::into),
            examined: best.examined,
            excluded: best.excluded,
            lost: best.lost,
            sequences: task.space(k, evaluator).map(|s| s.1).filter(|_| !all && free.is_none()),
            proven: all && out.error_bound < PROOF && !task.is_noisy(),
            parts,
            ties: all.then(|| TiesReport { sequences: best.ties.total(task.symmetry.order), within: TIE }),
            order_matters: evaluator.ordered(),
            interrupted: stopped.load(Ordering::Relaxed),
            degree_floor: (!task.walks).then_some(search.floor),
            constraints: task.constraints_in_words(),
            ranked: task.ranks().then_some(best.found.len()),
            certificate,
        });
        winner::within_gimbals(&mut out, base, conditions)?;
        Ok(out)
    })
}

/// Names of stated requirements that `conditions` leave out.
fn not_judged(stated: &Conditions, conditions: &Conditions) -> Vec<String> {
    let judged = |a: &Assignment| conditions.requirements.iter().any(|r| concerns(&a.name, &r.name));
    stated.requirements.iter().filter(|a| !judged(a)).map(|a| a.name.clone()).collect()
}

/// Attitude with all angles zero.
fn zero() -> Euler {
    std::array::from_fn(|_| Angle::from_degrees(0))
}

/// Reason why an exhaustive search found nothing.
fn examined(lost: u64, slews: bool) -> String {
    let with = if slews { " with the slews" } else { "" };
    match lost {
        0 => "every sequence was examined".into(),
        _ => format!(
            "every sequence was examined; the samples of {lost} with observable positions do not determine \
             it{with}, as far as double precision tells"
        ),
    }
}

/// True if a polished scheme may stand first: polishing ignores the bench and may increase the total.
fn improves(task: &Task<'_>, polished: &Found, first: Option<&Found>) -> bool {
    !task.ranks() || first.is_none_or(|f| polished.value < f.value)
}

/// Puts a scheme, if there is one, before others.
fn put_first(found: &mut Vec<Found>, first: Option<Found>) {
    let moved = usize::from(first.is_some());
    found.iter_mut().flat_map(|f| &mut f.image_of).for_each(|of| *of += moved);
    found.splice(0..0, first);
}

/// Schemes that no other one beats in both total time and criterion, by time.
fn pareto(mut found: Vec<Found>) -> Vec<Found> {
    found.sort_by(|a, b| a.total_s.total_cmp(&b.total_s).then(a.value.total_cmp(&b.value)));
    let mut least = f64::INFINITY;
    found.retain(|f| {
        let better = f.value < least;
        least = least.min(f.value);
        better
    });
    found
}

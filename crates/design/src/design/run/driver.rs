//! The search from request to answer.

use std::sync::atomic::Ordering;

use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{Angle, Euler, Scheme};
use obsdeg_evidence::simulation::omitted::omitted_effects;
use obsdeg_evidence::simulation::{Attained, Conditions, MeasurementReport, latitude_of, other_carries};
use obsdeg_exact::parallel;

use crate::design::answer::{Certificate, Design, Found, PartsReport, SCHEMA, SearchReport, TiesReport};
use crate::design::request::error::DesignError;
use crate::design::request::limits::PROOF;
use crate::design::request::options::DesignOptions;
use crate::design::run::free::Free;
use crate::design::run::prepared::PreparedSearch;
use crate::design::run::task::{Task, asked};
use crate::design::run::{alternatives, certify, winner};
use crate::design::search::best::Best;
use crate::design::search::progress::{NOTHING_YET, Progress, watched};
use crate::design::search::score::Scored;
use crate::design::search::scoring::SequenceSearch;
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
    &'a dyn Fn(&PreparedSearch<'_>, usize) -> Result<(Best, PartsReport), DesignError>;

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
        let proceed = || progress(NOTHING_YET);
        let free =
            options.free.map(|step| Free::new(base, conditions, options, step, progress)).transpose()?;
        let chosen =
            free.as_ref().map(|f| DesignOptions { candidates: f.candidates.clone(), ..options.clone() });
        let options = chosen.as_ref().unwrap_or(options);
        let prepared = PreparedSearch::new(base, conditions, options, &proceed)?;
        let (mut out, mut sets) = fewest(&prepared, stated, &proceed)?;
        let Some(k) = options.positions else { return Ok(out) };
        prepared.check(k)?;
        let (task, evaluator) = (&prepared.task, &prepared.evaluator);
        let search = prepared.search(progress);
        let run = SchemeSearch { prepared: &prepared, free: free.as_ref(), search, k, proceed: &proceed };
        let bound = task.bound(evaluator, k, &proceed);
        let (merged, parts) = elsewhere.map(|parts| parts(&prepared, k)).transpose()?.unzip();
        let (best, exhaustive) = match (merged, &free) {
            (Some(merged), _) => (merged, task.space(k, evaluator)),
            (None, Some(free)) => free.searched(&prepared, &run.search, k)?,
            (None, None) => prepared.searched(&run.search, k, bound.as_ref()),
        };
        if let Some((more, _)) = exhaustive {
            sets += more as f64;
            out.error_bound = task.rows.error_bound(sets);
        }
        out.found = run.listed(&best)?;
        let Some(first) = best.found.first().filter(|_| !out.found.is_empty()) else {
            return Err(run.nothing_found(&best, exhaustive.is_some()));
        };
        out.front = task.all_found(evaluator, &best.front)?;
        // the bound is for samples without random drift: figures with drift may exceed it by any amount
        let certified = bound.filter(|_| !task.is_noisy());
        let mut certificate = certified.map(|bound| task.certificate(&bound, task.value(evaluator, first)));
        if best.complete {
            (out.bias_front, out.bias_front_complete) = task.bias_front(evaluator, &run.search, k, &best);
            run.add_front(&best, first, &mut out.front, certificate.as_mut())?;
        }
        run.polish(first, &mut out)?;
        out.front = pareto(std::mem::take(&mut out.front));
        run.judge_first(&mut out)?;
        let all = exhaustive.is_some() && best.complete;
        out.search = Some(SearchReport {
            parts,
            interrupted: stopped.load(Ordering::Relaxed),
            certificate,
            ..run.report(&best, all, out.error_bound)
        });
        winner::within_gimbals(&mut out, base, conditions)?;
        Ok(out)
    })
}

/// Answer on the fewest positions, without a search, and the number of sets that were judged. `stated` are
/// the conditions with all requirements.
fn fewest(
    prepared: &PreparedSearch<'_>,
    stated: &Conditions,
    proceed: &(dyn Fn() -> bool + Sync),
) -> Result<(Design, f64), DesignError> {
    let task = &prepared.task;
    let base = task.base;
    let minimum = task.minimum(&prepared.degrees, proceed)?;
    let sets = minimum.none_of.iter().fold(0.0, |sum, [_, sets]| sum + *sets as f64);
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
        not_judged: not_judged(stated, prepared.conditions),
        gimbals: None,
        primes: task.rows.fields(),
        error_bound: task.rows.error_bound(sets),
        seed: task.options.seed,
    };
    out.minimum.proven &= out.error_bound < PROOF;
    Ok((out, sets))
}

/// Search for schemes of `k` positions.
struct SchemeSearch<'a> {
    prepared: &'a PreparedSearch<'a>,
    /// Free attitudes; `None` for given candidates.
    free: Option<&'a Free>,
    search: SequenceSearch<'a>,
    k: usize,
    /// Cancellation callback: false stops the search.
    proceed: &'a (dyn Fn() -> bool + Sync),
}

impl SchemeSearch<'_> {
    /// Schemes of the best sequences as they are listed.
    fn listed(&self, best: &Best) -> Result<Vec<Found>, DesignError> {
        let (task, evaluator) = (&self.prepared.task, &self.prepared.evaluator);
        let mut found = task.all_found(evaluator, &best.found)?;
        if task.is_noisy() {
            found.sort_by(|a, b| a.worst_degree.cmp(&b.worst_degree).then(a.value.total_cmp(&b.value)));
        }
        if task.ranks() {
            found.truncate(task.options.keep.max(1));
        }
        task.mark_images(&mut found, evaluator.ordered());
        Ok(found)
    }

    /// Reason why no scheme was found, with the changes that would meet every requirement if these are
    /// asked for.
    fn nothing_found(&self, best: &Best, exhaustive: bool) -> DesignError {
        let (task, conditions) = (&self.prepared.task, self.prepared.conditions);
        let (positions, wanted) = (self.k, task.wanted());
        let error = match (best.complete, exhaustive) {
            (false, _) => return DesignError::Interrupted,
            (true, true) if !task.ranks() => DesignError::Impossible {
                positions,
                wanted,
                why: examined(best.lost, conditions.slew_rate_deg_s.is_some()),
            },
            (true, _) => DesignError::NotFound { positions, wanted, examined: best.examined },
        };
        if !task.options.meet {
            return error;
        }
        match alternatives::seek(task.base, conditions, task.options, self.k, self.search.progress) {
            Ok(nearest) => DesignError::NotMet { why: Box::new(error), nearest: Box::new(nearest) },
            Err(e) => e,
        }
    }

    /// Adds the front of total time, and to the certificate the bounds over time and over all attitudes.
    fn add_front(
        &self,
        best: &Best,
        first: &Scored,
        front: &mut Vec<Found>,
        certificate: Option<&mut Certificate>,
    ) -> Result<(), DesignError> {
        let (task, evaluator) = (&self.prepared.task, &self.prepared.evaluator);
        let (search, free, proceed, k) = (&self.search, self.free, self.proceed, self.k);
        let options = task.options;
        let of = (k, self.prepared.conditions.dwell_s);
        let certified = certificate.is_some();
        let wanted = certified && options.everywhere && free.is_none();
        let over_all = || wanted.then(|| evaluator.everywhere(&task.criterion, k, proceed)).flatten();
        let line = || certified.then(|| task.front_bound(evaluator, of, proceed));
        let (more, (found, line)) =
            parallel::join(|| task.front(evaluator, search, of, best), || parallel::join(over_all, line));
        front.extend(more?);
        if let (Some(certificate), Some(line)) = (certificate, line) {
            let every = free.map(|f| &f.every).or(found.as_ref());
            certificate.everywhere = every.map(|every| {
                let rounded = options.free.zip(free).map(|(step, f)| (step, f.finer.as_ref()));
                certify::everywhere(every, task.value_among_all(evaluator, first), rounded)
            });
            certificate.front = line;
        }
        Ok(())
    }

    /// Adds the first scheme with its angles refined, and with its time divided, as far as they are asked
    /// for.
    fn polish(&self, first: &Scored, out: &mut Design) -> Result<(), DesignError> {
        let (task, evaluator, proceed) = (&self.prepared.task, &self.prepared.evaluator, self.proceed);
        if task.options.refine && proceed() {
            let refined = task.refined(evaluator, first, proceed)?;
            out.front.extend(refined.iter().cloned());
            let refined = refined.filter(|f| improves(task, f, out.found.first()));
            put_first(&mut out.found, refined);
        }
        if task.options.divide && proceed() {
            let divided = task.divided(evaluator, first, proceed)?;
            out.front.extend(divided.iter().cloned());
            let divided = divided.filter(|f| improves(task, f, out.found.first()));
            put_first(&mut out.found, divided);
        }
        Ok(())
    }

    /// Adds errors that are not estimated, and the other carries, of the first scheme.
    fn judge_first(&self, out: &mut Design) -> Result<(), DesignError> {
        let Some(best) = out.found.first() else { return Ok(()) };
        let seed = self.prepared.task.options.seed;
        let scheme = winner::scheme(best, self.prepared.task.base, self.prepared.conditions)?;
        let own = Conditions::of(&scheme);
        let attained = Attained::new(&scheme, &own, seed)?;
        out.omitted = Some(omitted_effects(&attained, &own, seed)?);
        out.other_carries = other_carries(&scheme, &own, seed)?;
        Ok(())
    }

    /// Report of the search, without parts and certificate, as if it was not interrupted. `all` is true if
    /// all sequences were searched.
    fn report(&self, best: &Best, all: bool, error_bound: f64) -> SearchReport {
        let (task, evaluator) = (&self.prepared.task, &self.prepared.evaluator);
        let conditions = self.prepared.conditions;
        SearchReport {
            positions: self.k,
            // positions that are searched for have the dwell of the conditions
            conditions: MeasurementReport::new(
                &Scheme { positions: Scheme::of_angles([zero()]).positions, ..task.base.clone() },
                conditions,
            ),
            drift_noise: conditions.as_stated().drift_noise_in_words(),
            prior: conditions.stated_prior_in_words(),
            criterion: task.criterion.name().into(),
            unit: task.unit().ok().flatten().map(Into::into),
            examined: best.examined,
            excluded: best.excluded,
            lost: best.lost,
            sequences: task.space(self.k, evaluator).map(|s| s.1).filter(|_| !all && self.free.is_none()),
            proven: all && error_bound < PROOF && !task.is_noisy(),
            parts: None,
            ties: all.then(|| TiesReport { sequences: best.ties.total(task.symmetry.order), within: TIE }),
            order_matters: evaluator.ordered(),
            interrupted: false,
            degree_floor: (!task.slew_sequences).then_some(self.search.floor),
            constraints: task.constraints_in_words(),
            ranked: task.ranks().then_some(best.found.len()),
            certificate: None,
        }
    }
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

//! The search from request to answer.

use std::sync::atomic::Ordering;

use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{Angle, Euler, Scheme};
use obsdeg_evidence::simulation::{Conditions, MeasurementReport, latitude_of, other_carries};

use crate::design::answer::{Certificate, Design, Found, Minimum, SCHEMA, SearchReport, TiesReport};
use crate::design::request::error::DesignError;
use crate::design::request::limits::PROOF;
use crate::design::request::options::DesignOptions;
use crate::design::run::free::Free;
use crate::design::run::prepared::Prepared;
use crate::design::run::task::asked;
use crate::design::run::{alternatives, certify, winner};
use crate::design::search::best::Best;
use crate::design::search::progress::{NOTHING_YET, Progress, watched};
use crate::design::search::score::Scored;
use crate::design::search::scoring::Search;
use crate::design::search::ties::TIE;

/// Finds schemes under the assumptions of `base` (its positions do not matter); `conditions` give the noise, the dwell,
/// the rate of slews and the requirements. `progress` says whether to go on: a search that is stopped gives the best so
/// far.
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

/// What an exhaustive search found elsewhere.
pub(crate) type Elsewhere<'a> = &'a dyn Fn(&Prepared<'_>, usize) -> Result<Best, DesignError>;

/// The answer; `elsewhere` instead of a search.
pub(crate) fn answered(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
    elsewhere: Option<Elsewhere<'_>>,
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
        let minimum = prepared.task.minimum(&prepared.degrees, &going)?;
        let sets = minimum.none_of.iter().fold(0.0, |sum, [_, sets]| sum + *sets as f64);
        let mut out = unsearched(base, &prepared, minimum, sets);
        out.not_judged = not_judged(stated, conditions);
        let Some(positions) = options.positions else { return Ok(out) };
        prepared.check(positions)?;
        let search = prepared.search(progress);
        let run = Run { base, prepared: &prepared, search: &search, free: free.as_ref(), positions };
        let (best, certificate) = match run.found(&mut out, sets, elsewhere, &going)? {
            Ok(found) => found,
            Err(error) if !options.meet => return Err(error),
            Err(DesignError::Interrupted) => return Err(DesignError::Interrupted),
            Err(error) => {
                let nearest = alternatives::seek(base, conditions, options, positions, progress)?;
                return Err(DesignError::NotMet { why: Box::new(error), nearest: Box::new(nearest) });
            }
        };
        out.other_carries = match out.found.first() {
            Some(best) => {
                let scheme = winner::scheme(best, base, conditions)?;
                other_carries(&scheme, &Conditions::of(&scheme), options.seed)?
            }
            None => Vec::new(),
        };
        let interrupted = stopped.load(Ordering::Relaxed);
        out.search = Some(run.report(&best, out.error_bound, interrupted, certificate));
        winner::within_gimbals(&mut out, base, conditions)?;
        Ok(out)
    })
}

/// The answer before any search; `sets` is the number of sets of candidates whose ranks it rests on.
fn unsearched(base: &Scheme, prepared: &Prepared<'_>, minimum: Minimum, sets: f64) -> Design {
    let task = &prepared.task;
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
        other_carries: Vec::new(),
        not_judged: Vec::new(),
        gimbals: None,
        primes: task.rows.fields(),
        error_bound: task.rows.error_bound(sets),
        seed: task.options.seed,
    };
    out.minimum.proven &= out.error_bound < PROOF;
    out
}

/// The best sequences, with the number of sets and sequences of a search of all of them.
struct Searched {
    best: Best,
    exhaustive: Option<(u64, u64)>,
}

impl Searched {
    /// True if all sequences were searched to the end.
    fn all(&self) -> bool {
        self.exhaustive.is_some() && self.best.complete
    }
}

/// A search for schemes of a number of positions.
struct Run<'a> {
    base: &'a Scheme,
    prepared: &'a Prepared<'a>,
    search: &'a Search<'a>,
    free: Option<&'a Free>,
    positions: usize,
}

impl Run<'_> {
    /// Searches, and puts into `out` what was found, with the front and what polishing adds; the inner error says
    /// why there is no scheme.
    fn found(
        &self,
        out: &mut Design,
        sets: f64,
        elsewhere: Option<Elsewhere<'_>>,
        going: &(dyn Fn() -> bool + Sync),
    ) -> Result<Result<(Searched, Option<Certificate>), DesignError>, DesignError> {
        let (task, evaluator, k) = (&self.prepared.task, &self.prepared.evaluator, self.positions);
        let bound = task.bound(evaluator, k, &going);
        let (best, exhaustive) = match (elsewhere, self.free) {
            (Some(elsewhere), _) => (elsewhere(self.prepared, k)?, task.space(k, evaluator)),
            (None, Some(free)) => free.searched(self.prepared, self.search, k)?,
            (None, None) => self.prepared.searched(self.search, k, bound.as_ref()),
        };
        if let Some((more, _)) = exhaustive {
            out.error_bound = task.rows.error_bound(sets + more as f64);
        }
        out.found = task.all_found(evaluator, &best.found)?;
        if task.is_noisy() {
            out.found.sort_by(|a, b| a.worst_degree.cmp(&b.worst_degree).then(a.value.total_cmp(&b.value)));
        }
        task.mark_images(&mut out.found, evaluator.ordered());
        let searched = Searched { best, exhaustive };
        let Some(first) = searched.best.found.first().filter(|_| !out.found.is_empty()) else {
            return Ok(Err(self.nothing(&searched)));
        };
        out.front = task.all_found(evaluator, &searched.best.front)?;
        // the bound is of samples without random drift: it says nothing of how far above it figures with it
        // may be
        let certified = bound.filter(|_| !task.is_noisy());
        let mut certificate = certified.map(|bound| task.certificate(&bound, task.value(evaluator, first)));
        if searched.best.complete {
            out.front.extend(self.front(&searched.best, first, &mut certificate, going)?);
        }
        if task.options.refine && going() {
            polished(out, task.refined(evaluator, first, &going)?);
        }
        if task.options.divide && going() {
            polished(out, task.divided(evaluator, first, &going)?);
        }
        out.front = pareto(std::mem::take(&mut out.front));
        Ok(Ok((searched, certificate)))
    }

    /// Why there is no scheme.
    fn nothing(&self, searched: &Searched) -> DesignError {
        let (positions, wanted) = (self.positions, self.prepared.task.wanted());
        match (searched.best.complete, searched.exhaustive) {
            (false, _) => DesignError::Interrupted,
            (true, Some(_)) => DesignError::Impossible {
                positions,
                wanted,
                why: examined(searched.best.lost, self.prepared.conditions.slew_rate_deg_s.is_some()),
            },
            (true, None) => DesignError::NotFound { positions, wanted, examined: searched.best.examined },
        }
    }

    /// The front over other numbers of positions; the bounds over all attitudes and along the front go into the
    /// certificate.
    fn front(
        &self,
        best: &Best,
        first: &Scored,
        certificate: &mut Option<Certificate>,
        going: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<Found>, DesignError> {
        let (task, evaluator, k) = (&self.prepared.task, &self.prepared.evaluator, self.positions);
        let of = (k, self.prepared.conditions.dwell_s);
        let certified = certificate.is_some();
        let wanted = certified && task.options.everywhere && self.free.is_none();
        let over_all = || wanted.then(|| evaluator.everywhere(&task.criterion, k, &going)).flatten();
        let line = || certified.then(|| task.front_bound(evaluator, of, &going));
        let (front, (found, line)) =
            rayon::join(|| task.front(evaluator, self.search, of, best), || rayon::join(over_all, line));
        let front = front?;
        if let (Some(certificate), Some(line)) = (certificate, line) {
            let every = self.free.map(|f| &f.every).or(found.as_ref());
            certificate.everywhere = every.map(|every| {
                let rounded = task.options.free.zip(self.free).map(|(step, f)| (step, f.finer.as_ref()));
                certify::everywhere(every, task.value_among_all(evaluator, first), rounded)
            });
            certificate.front = line;
        }
        Ok(front)
    }

    /// How it was searched.
    fn report(
        &self,
        searched: &Searched,
        error_bound: f64,
        interrupted: bool,
        certificate: Option<Certificate>,
    ) -> SearchReport {
        let (task, conditions) = (&self.prepared.task, self.prepared.conditions);
        let (evaluator, k) = (&self.prepared.evaluator, self.positions);
        let (best, all) = (&searched.best, searched.all());
        SearchReport {
            positions: k,
            // positions that are searched for have the dwell of the conditions
            conditions: MeasurementReport::new(
                &Scheme { positions: Scheme::of_angles([zero()]).positions, ..self.base.clone() },
                conditions,
            ),
            drift_noise: conditions.as_stated().drift_noise_in_words(),
            prior: conditions.stated_prior_in_words(),
            criterion: task.criterion.name().into(),
            unit: task.unit().ok().flatten().map(Into::into),
            examined: best.examined,
            excluded: best.excluded,
            lost: best.lost,
            sequences: task.space(k, evaluator).map(|s| s.1).filter(|_| !all && self.free.is_none()),
            proven: all && error_bound < PROOF && !task.is_noisy(),
            ties: all.then(|| TiesReport { sequences: best.ties.total(task.symmetry.order), within: TIE }),
            order_matters: evaluator.ordered(),
            interrupted,
            degree_floor: (!task.walks).then_some(self.search.floor),
            constraints: task.constraints_in_words(),
            certificate,
        }
    }
}

/// Puts what polishing made of the best scheme before the others, and into the front.
fn polished(out: &mut Design, found: Option<Found>) {
    out.front.extend(found.iter().cloned());
    put_first(&mut out.found, found);
}

/// Names of the requirements that `conditions` leave out of those that are stated.
fn not_judged(stated: &Conditions, conditions: &Conditions) -> Vec<String> {
    let judged = |a: &Assignment| conditions.requirements.iter().any(|r| concerns(&a.name, &r.name));
    stated.requirements.iter().filter(|a| !judged(a)).map(|a| a.name.clone()).collect()
}

/// The attitude with all angles zero.
fn zero() -> Euler {
    std::array::from_fn(|_| Angle::from_degrees(0))
}

/// Why an exhaustive search found nothing.
fn examined(lost: u64, slews: bool) -> String {
    let with = if slews { " with the slews" } else { "" };
    match lost {
        0 => "every sequence was examined".into(),
        _ => format!(
            "every sequence was examined; the samples of {lost} with observable positions do not determine it{with}, as far as double precision \
             tells"
        ),
    }
}

/// Puts a scheme before others, if there is one.
fn put_first(found: &mut Vec<Found>, first: Option<Found>) {
    let moved = usize::from(first.is_some());
    found.iter_mut().flat_map(|f| &mut f.image_of).for_each(|of| *of += moved);
    found.splice(0..0, first);
}

/// Those that none beats in both total time and criterion, by time.
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

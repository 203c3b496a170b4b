//! Task of a search: names resolved, candidates ordered by orbits; and reports of its results.

use std::collections::HashMap;

use obsdeg_core::accuracy::Accuracy;
use obsdeg_core::degree::judge;
use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{Angle, Carry, Euler, Path, Platform, Scheme, Unknowns, angles_text, c_n_f64};
use obsdeg_core::omitted::OmittedClass;
use obsdeg_evidence::requirements::Requirements;
use obsdeg_evidence::simulation::omitted::{Bench, OmittedEffect, term_effects};
use obsdeg_evidence::simulation::{Attained, Conditions, PRIOR, SimulationError, latitude_of, resolve};
use obsdeg_exact::parallel;

use crate::degree_caps::widest_first;
use crate::design::answer::{Found, HalfTurn, Minimum};
use crate::design::measure::criterion::{Criterion, SigmaLimits};
use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::omitted::OmittedErrors;
use crate::design::measure::stop::Stop;
use crate::design::observable::rows::AttitudeRows;
use crate::design::observable::slew_sequences::is_slew_sequence;
use crate::design::observable::symmetry::CandidateSymmetry;
use crate::design::polish::{divide, refine};
use crate::design::request::candidates::Candidates;
use crate::design::request::error::DesignError;
use crate::design::request::limits::{EXHAUSTIVE, MAX_CANDIDATES};
use crate::design::request::options::{CriterionName, DesignOptions, Immune};
use crate::design::run::winner;
use crate::design::search::best::Best;
use crate::design::search::constraints::Constraints;
use crate::design::search::score::Scored;
use crate::design::search::scoring::SequenceSearch;

/// Largest number of sets for which one bit per degree is stored.
const MOST_SETS: u64 = 5_000_000;
/// Largest number of prefixes and sets examined for the minimum if that is not what was asked for.
const MINIMUM_SETS: u64 = 1_000_000;
/// Factors on the dwell for the front of total time.
pub(crate) const DWELLS: [f64; 6] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0];
/// Restarts of the exchange at each factor, besides those from the schemes found.
const FRONT_RESTARTS: u64 = 8;

/// Conditions of a search. If only some coefficients are asked for, requirements on psi and on the
/// others are left out, also in the file that is written, so that every command judges alike.
///
/// # Errors
/// [`DesignError::Scheme`] for a base that is no platform.
pub fn asked(base: &Scheme, conditions: &Conditions, required: &[String]) -> Result<Conditions, DesignError> {
    if required.is_empty() {
        return Ok(conditions.clone());
    }
    let any = std::array::from_fn(|_| Angle::from_degrees(0));
    let positions = Scheme::of_angles([any]).positions;
    let platform = Platform::new(Scheme { positions, combinations: Vec::new(), ..base.clone() })?;
    let counts = |name: &&String| required.iter().any(|asked| concerns(asked, name));
    let names: Vec<&String> = platform.names().iter().filter(counts).collect();
    let of = |a: &Assignment| -> Vec<Assignment> {
        let concerned = names.iter().filter(|name| concerns(&a.name, name));
        concerned.map(|name| Assignment { name: name.to_string(), value: a.value }).collect()
    };
    let requirements = conditions.requirements.iter().flat_map(of).collect();
    Ok(Conditions { requirements, ..conditions.clone() })
}

/// Task of a search: names resolved, candidates ordered by orbits.
pub(crate) struct Task<'a> {
    pub(crate) base: &'a Scheme,
    pub(crate) options: &'a DesignOptions,
    pub(crate) candidates: Candidates,
    /// Names of the coefficients that count, and their indices.
    pub(crate) required: Vec<(String, usize)>,
    pub(crate) criterion: Criterion,
    pub(crate) constraints: Constraints,
    /// Errors that are not estimated and that the search counts; `None` if it counts none.
    pub(crate) omitted: Option<OmittedErrors>,
    /// Units of the errors that schemes must be immune to.
    immune_units: Vec<&'static str>,
    conditions: &'a Conditions,
    pub(crate) rows: AttitudeRows,
    pub(crate) symmetry: CandidateSymmetry,
    /// True if repositioning takes time.
    slews: bool,
    /// Units of all coefficients.
    units: Vec<&'static str>,
    /// True if torquer errors act in the turns between positions: sets have no verdict then.
    pub(crate) slew_sequences: bool,
}

/// Checks the numbers of candidates and positions, the limits, and that the base and all angles are of a kind
/// that a search takes.
fn check(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    candidates: &Candidates,
) -> Result<(), DesignError> {
    let found = candidates.attitudes.len();
    if !(1..=MAX_CANDIDATES).contains(&found) {
        return Err(DesignError::Candidates { found });
    }
    let counts = options.positions.iter().chain(&options.front);
    if let Some(&found) = counts.into_iter().find(|k| !(1..=100).contains(*k)) {
        return Err(DesignError::Positions { found });
    }
    if base.unknowns == Unknowns::Drift {
        return Err(DesignError::Drift);
    }
    for (what, limit) in [("a total time", options.total_s), ("a longest slew", options.slew_s)] {
        if let Some(found) = limit.filter(|l| !(l.is_finite() && *l > 0.0)) {
            return Err(DesignError::Limit { what, found });
        }
    }
    if base.path == Some(Path::Gimbals) && conditions.slew_rate_deg_s.is_some() {
        return Err(DesignError::GimbalPath);
    }
    let generic = candidates.attitudes.iter().flatten().find_map(|a| a.generic());
    if let Some((name, _)) = generic {
        return Err(DesignError::GenericAngle { name: name.into() });
    }
    Ok(())
}

/// Indices of the coefficients that a name or a family concerns.
fn named(all: &[(String, usize)], asked: &str) -> Result<Vec<usize>, DesignError> {
    let known = all.iter().map(|c| c.0.clone()).collect::<Vec<_>>().join(", ");
    let found: Vec<usize> = all.iter().filter(|c| concerns(asked, &c.0)).map(|c| c.1).collect();
    let unknown = DesignError::UnknownName { found: asked.into(), known };
    if found.is_empty() { Err(unknown) } else { Ok(found) }
}

/// Coefficients that count, with their indices: those asked for, by default all.
fn required(all: &[(String, usize)], options: &DesignOptions) -> Result<Vec<(String, usize)>, DesignError> {
    let mut required = all.to_vec();
    if !options.required.is_empty() {
        let asked = options.required.iter().map(|name| named(all, name));
        let asked = asked.collect::<Result<Vec<_>, _>>()?.concat();
        required.retain(|c| asked.contains(&c.1));
    }
    Ok(required)
}

/// Largest degree of every coefficient that counts; the largest number where there is no limit.
fn caps(
    all: &[(String, usize)],
    required: &[(String, usize)],
    options: &DesignOptions,
) -> Result<Vec<usize>, DesignError> {
    let mut caps = vec![usize::MAX; required.len()];
    for (name, cap) in widest_first(&options.degree_caps) {
        let concerned = name.as_ref().map(|name| named(all, name)).transpose()?;
        for (slot, c) in caps.iter_mut().zip(required) {
            if concerned.as_ref().is_none_or(|list| list.contains(&c.1)) {
                *slot = *cap;
            }
        }
    }
    Ok(caps)
}

/// Refuses requirements and priors of single positions.
fn check_positions_of(conditions: &Conditions) -> Result<(), DesignError> {
    for (what, list) in [("requirement", &conditions.requirements[..]), ("prior", conditions.stated_priors())]
    {
        if let Some(of_one) = list.iter().find(|a| a.name.contains('@')) {
            return Err(DesignError::OnePosition { what, found: of_one.name.clone() });
        }
    }
    Ok(())
}

/// True if the search uses requirements, as a constraint or as its criterion.
fn uses_requirements(options: &DesignOptions) -> bool {
    options.meet || options.criterion == CriterionName::Margin
}

/// Largest sigmas of the coefficients that count and of psi; refused if the search uses requirements and none
/// is stated.
fn limits(
    platform: &Platform,
    conditions: &Conditions,
    required: &[(String, usize)],
    options: &DesignOptions,
) -> Result<SigmaLimits, DesignError> {
    let limits_of = resolve("required sigma", platform, &conditions.requirements, f64::INFINITY)?;
    let first = platform.names().len() - platform.coefficients();
    let limits = SigmaLimits {
        coefficients: required.iter().map(|c| limits_of[first + c.1]).collect(),
        psi: [0, 1, 2].map(|k| limits_of[k]),
    };
    let all = || limits.coefficients.iter().chain(&limits.psi);
    if uses_requirements(options) && all().all(|l| l.is_infinite()) {
        let what = if options.meet { "--meet" } else { "--criterion margin" };
        return Err(DesignError::NoRequirement { what });
    }
    Ok(limits)
}

/// Criterion of this name; the margin is that to the limits.
fn criterion(name: CriterionName, limits: &SigmaLimits) -> Criterion {
    match name {
        CriterionName::Worst => Criterion::Worst,
        CriterionName::A => Criterion::A,
        CriterionName::D => Criterion::D,
        CriterionName::E => Criterion::E,
        CriterionName::Margin => Criterion::Margin(limits.clone()),
    }
}

/// Demands of a task on the coefficients, by which a turn of the platform axes may rename them.
struct Demands<'a> {
    /// Indices of the coefficients that count.
    required: &'a [usize],
    /// Largest degree of each of these.
    caps: &'a [usize],
    /// Largest sigma of each of these; `None` if the search does not use requirements.
    limits: Option<&'a [f64]>,
    /// Prior sigma of every coefficient.
    priors: &'a [f64],
    /// True if psi may be renamed too, so that any coefficient may.
    renames: bool,
}

impl Demands<'_> {
    /// True if the demands on two coefficients are the same.
    fn are_alike(&self, i: usize, j: usize) -> bool {
        let place = |c: usize| self.required.iter().position(|r| *r == c);
        match (place(i), place(j)) {
            _ if (!self.renames || self.priors[i] != self.priors[j]) && i != j => false,
            (None, None) => true,
            (Some(i), Some(j)) => {
                self.caps[i] == self.caps[j] && self.limits.is_none_or(|limits| limits[i] == limits[j])
            }
            _ => false,
        }
    }
}

/// Candidates, each attitude once, orbit by orbit, so that a set that begins with a representative stands for
/// all its images; with their rows and their symmetry.
fn by_orbits(
    candidates: &Candidates,
    rows: &AttitudeRows,
    demands: &Demands<'_>,
) -> (Candidates, AttitudeRows, CandidateSymmetry) {
    let repeated = rows.repeated();
    let kept: Vec<usize> = (0..candidates.attitudes.len()).filter(|i| !repeated.contains(i)).collect();
    let same = |i: usize, j: usize| demands.are_alike(i, j);
    let symmetry = rows.select(&kept).symmetry(&same);
    let mut order: Vec<(usize, usize)> = symmetry.orbit.iter().copied().zip(kept).collect();
    order.sort_unstable();
    let order: Vec<usize> = order.into_iter().map(|(_, c)| c).collect();
    let (candidates, rows) = (candidates.permuted(&order), rows.select(&order));
    let symmetry = rows.symmetry(&same);
    (candidates, rows, symmetry)
}

/// Constraints of the schemes of a task.
fn constraints(options: &DesignOptions, limits: SigmaLimits, caps: Vec<usize>) -> Constraints {
    Constraints {
        total_s: options.total_s,
        slew_s: options.slew_s,
        sigmas: options.meet.then_some(limits),
        degrees: caps.iter().any(|c| *c != usize::MAX).then_some(caps),
    }
}

impl<'a> Task<'a> {
    pub(crate) fn new(
        base: &'a Scheme,
        conditions: &'a Conditions,
        options: &'a DesignOptions,
        candidates: Candidates,
    ) -> Result<Self, DesignError> {
        conditions.validate()?;
        check(base, conditions, options, &candidates)?;
        let positions = Scheme::of_angles(candidates.attitudes.iter().take(1).cloned()).positions;
        let platform = Platform::new(Scheme { positions, combinations: Vec::new(), ..base.clone() })?;
        let first = platform.names().len() - platform.coefficients();
        let all: Vec<(String, usize)> = platform.names()[first..].iter().cloned().zip(0..).collect();
        let required = required(&all, options)?;
        let caps = caps(&all, &required, options)?;
        check_positions_of(conditions)?;
        let priors = resolve(PRIOR, &platform, conditions.stated_priors(), f64::INFINITY)?;
        let limits = limits(&platform, conditions, &required, options)?;
        let uses_requirements = uses_requirements(options);
        // the total uncertainty of psi is that at the end, which is not built up position by position
        let of_psi = uses_requirements && limits.psi.iter().any(|l| l.is_finite());
        // where the number of positions is searched for, errors of single positions do not exist
        Bench::check(&conditions.bench, options.positions.unwrap_or(0), false)
            .map_err(SimulationError::from)?;
        let omitted = OmittedErrors::of(base, &platform, conditions, &options.immune)?;
        let omitted = omitted.filter(|_| !of_psi || conditions.bench.is_empty());
        let criterion = criterion(options.criterion, &limits);
        let indices: Vec<usize> = required.iter().map(|r| r.1).collect();
        let slew_sequences = is_slew_sequence(base);
        // for slew sequences the rows only tell which attitudes are the same
        let by_sets =
            Scheme { carry: if slew_sequences { Carry::Platform } else { base.carry }, ..base.clone() };
        let rows = AttitudeRows::new(&by_sets, &candidates.attitudes, &indices, options.seed)?;
        // a turn of the platform axes renames psi as well
        let renames = (!uses_requirements || limits.psi.iter().all(|l| *l == limits.psi[0]))
            && priors[..3].iter().all(|p| *p == priors[0])
            && omitted.as_ref().is_none_or(|o| o.alike);
        let demands = Demands {
            required: &indices,
            caps: &caps,
            limits: uses_requirements.then_some(&limits.coefficients[..]),
            priors: &priors[first..],
            renames,
        };
        let (candidates, rows, symmetry) = by_orbits(&candidates, &rows, &demands);
        Ok(Self {
            base,
            conditions,
            options,
            candidates,
            required,
            criterion,
            constraints: constraints(options, limits, caps),
            rows,
            symmetry,
            omitted,
            immune_units: OmittedErrors::units(&platform, &options.immune),
            slews: conditions.slew_rate_deg_s.is_some(),
            units: platform.units()[first..].to_vec(),
            slew_sequences,
        })
    }

    /// Unit of the criterion; `None` if it has none, or several.
    ///
    /// # Errors
    /// [`DesignError::Units`] if the criterion compares coefficients in different units.
    pub(crate) fn unit(&self) -> Result<Option<&'static str>, DesignError> {
        let families = [("deg/h", "deg/h"), ("ug", "ug"), ("ppm", "ppm"), ("arcsec", "arcsec")];
        let named = |family: &str| self.required.iter().find(|r| self.units[r.1].starts_with(family));
        let found: Vec<_> = families.iter().filter_map(|(f, unit)| Some((*unit, &named(f)?.0))).collect();
        match (&self.criterion, &found[..]) {
            (Criterion::Margin(_), _) => Ok(None),
            (_, [(unit, _)]) => Ok(Some(*unit)),
            (Criterion::D, _) => Ok(None),
            (criterion, _) => {
                let units = found.iter().map(|(unit, name)| format!("{name} [{unit}]"));
                let units = units.collect::<Vec<_>>().join(", ");
                Err(DesignError::Units { criterion: criterion.name(), units })
            }
        }
    }

    /// Required coefficients that all candidates together leave unobservable; `degrees` are their
    /// degrees.
    pub(crate) fn never<'s>(&'s self, degrees: &'s [Option<usize>]) -> impl Iterator<Item = &'s str> {
        let lost = self.required.iter().zip(degrees).filter(|(_, d)| d.is_none());
        lost.map(|(c, _)| c.0.as_str())
    }

    /// Smallest number of candidates that is sufficient, with the proof; `proven` ignores the bound on
    /// errors.
    ///
    /// # Errors
    /// [`DesignError::Interrupted`].
    pub(crate) fn minimum(
        &self,
        best_degrees: &[Option<usize>],
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> Result<Minimum, DesignError> {
        let names = |set: &[usize]| set.iter().map(|&c| self.candidates.names[c].clone()).collect();
        let mut out = Minimum {
            positions: None,
            witness: Vec::new(),
            counting_bound: self.rows.counting_bound(),
            rows_per_position: self.rows.most(),
            none_of: Vec::new(),
            never: if self.slew_sequences {
                Vec::new()
            } else {
                self.never(best_degrees).map(Into::into).collect()
            },
            proven: true,
        };
        if !out.never.is_empty() {
            return Ok(out);
        }
        if self.slew_sequences {
            return Ok(Minimum { counting_bound: 0, proven: false, ..out });
        }
        let firsts = self.symmetry.representatives();
        let asked = self.options.positions.is_none();
        let most = if asked { EXHAUSTIVE } else { MINIMUM_SETS / firsts.len() as u64 };
        let n = self.rows.candidates() as u64;
        for size in out.counting_bound..=self.rows.candidates() {
            let sets = choose(n, size as u64).unwrap_or(u64::MAX);
            let (set, all) = self.rows.first_observable_set(size, &firsts, most, proceed);
            if !proceed() {
                return Err(DesignError::Interrupted);
            }
            match set {
                Some(set) => {
                    out.positions = Some(size);
                    out.witness = names(&set);
                    return Ok(out);
                }
                None if all => out.none_of.push([size as u64, sets]),
                None => break,
            }
        }
        out.proven = false;
        Ok(out)
    }

    /// Number of sets of an exhaustive search of `k` positions, and of its sequences up to symmetry;
    /// `None` if too many to store or to count.
    pub(crate) fn space(&self, k: usize, evaluator: &Evaluator) -> Option<(u64, u64)> {
        if self.slew_sequences {
            return None;
        }
        let n = self.rows.candidates() as u64;
        let sets: u64 = (1..=k as u64).try_fold(0u64, |sum, size| sum.checked_add(choose(n, size)?))?;
        let searched = if evaluator.ordered() {
            evaluator.sequences(&self.symmetry.representatives(), k).filter(|_| sets <= MOST_SETS)?
        } else {
            choose(n + k as u64 - 1, k as u64)? / self.symmetry.order as u64
        };
        Some((sets, searched))
    }

    /// Scheme of a sequence with its exact verdict; `None` if the verdict, the requirements or the immunity
    /// of the sequence are not as required.
    pub(crate) fn found(&self, evaluator: &Evaluator, scored: &Scored) -> Result<Option<Found>, DesignError> {
        let attitudes: Vec<Euler> =
            scored.sequence.iter().map(|s| self.candidates.attitudes[s.candidate].clone()).collect();
        let names = scored.sequence.iter().map(|s| self.candidates.names[s.candidate].clone()).collect();
        self.attained(self.judged(evaluator, &scored.sequence, attitudes, names, scored.score.value)?)
    }

    /// Scored sequences confirmed by the exact verdict, as schemes.
    pub(crate) fn all_found(
        &self,
        evaluator: &Evaluator,
        list: &[Scored],
    ) -> Result<Vec<Found>, DesignError> {
        let found: Vec<Option<Found>> = parallel::try_map(list.len(), |i| self.found(evaluator, &list[i]))?;
        Ok(found.into_iter().flatten().collect())
    }

    /// Sets `image_of` of schemes that a turn of the platform axes makes of earlier ones.
    pub(crate) fn mark_images(&self, found: &mut [Found], ordered: bool) {
        // candidates in order, and half turns with their axes
        type Arrangement = (Vec<usize>, Vec<(usize, [i64; 3])>);
        let names: HashMap<&str, usize> = self.candidates.names.iter().map(String::as_str).zip(0..).collect();
        let arranged = |mut sequence: Vec<usize>| {
            if !ordered {
                sequence.sort_unstable();
            }
            sequence
        };
        // all images of the schemes that are no images themselves
        let mut known: HashMap<Arrangement, usize> = HashMap::new();
        for (i, f) in found.iter_mut().enumerate() {
            let sequence: Option<Vec<usize>> =
                f.positions.iter().map(|p| names.get(p.as_str()).copied()).collect();
            let Some(sequence) = sequence else { continue };
            let turns: Vec<_> =
                f.half_turns.iter().map(|t| (t.to, t.about.map(|x| (x * 1e9).round() as i64))).collect();
            f.image_of = known.get(&(arranged(sequence.clone()), turns.clone())).copied();
            if f.image_of.is_none() {
                for map in &self.symmetry.maps {
                    let image = arranged(sequence.iter().map(|&c| map[c]).collect());
                    known.entry((image, turns.clone())).or_insert(i + 1);
                }
            }
        }
    }

    fn judged(
        &self,
        evaluator: &Evaluator,
        sequence: &[Stop],
        attitudes: Vec<Euler>,
        positions: Vec<String>,
        value: f64,
    ) -> Result<Option<Found>, DesignError> {
        let angles = attitudes.iter().map(angles_text).collect();
        let mut stops = Scheme::of_angles(attitudes).positions;
        let half_turns = evaluator.half_turns(sequence);
        for (k, turn) in &half_turns {
            stops[*k].slew = self.slew_sequences.then(|| winner::half_turn(&turn.about));
        }
        let scheme = Scheme {
            positions: stops,
            path: if self.slew_sequences { Some(Path::OneAxis) } else { self.base.path },
            latitude: latitude_of(self.base),
            combinations: Vec::new(),
            ..self.base.clone()
        };
        let platform = Platform::new(scheme)?;
        let verdicts = judge(&platform, self.options.seed)?;
        let first = platform.names().len() - platform.coefficients();
        let columns = || self.required.iter().map(|r| first + r.1);
        let degrees: Option<Vec<usize>> = columns().map(|c| verdicts.degrees.degree[c]).collect();
        let Some(degrees) = degrees.filter(|d| self.constraints.cap(d)) else { return Ok(None) };
        // the order is unknown beyond the precision of the series
        let accuracy = Accuracy::new(&platform, &verdicts, self.options.seed).ok();
        let order_of = |c: usize| accuracy.as_ref().and_then(|a| a.order[c]);
        let orders = columns().map(order_of).collect::<Option<Vec<_>>>();
        if evaluator.sigmas(sequence).is_empty() {
            return Ok(None);
        }
        Ok(Some(Found {
            positions,
            image_of: None,
            angles,
            half_turns: half_turns
                .into_iter()
                .map(|(k, turn)| HalfTurn { to: k + 1, about: turn.about })
                .collect(),
            refined: false,
            dwell_s: evaluator.dwell_s(),
            dwells_s: Vec::new(),
            total_s: evaluator.state_of(sequence).seconds,
            value,
            worst_sigma_dph: None,
            worst: None,
            requirements: Requirements::of(self.conditions.basis(), []),
            worst_degree: degrees.into_iter().max().unwrap_or(0),
            worst_accuracy_order: orders.and_then(|o| o.into_iter().max()),
            rank: [verdicts.degrees.rank(), platform.names().len()],
        }))
    }

    /// Scheme with the figures that every other command gives for its file; `None` if requirements are a
    /// constraint and one is missed, or if it is not immune as required.
    ///
    /// # Errors
    /// [`DesignError`] for a scheme that cannot be run.
    pub(crate) fn attained(&self, found: Option<Found>) -> Result<Option<Found>, DesignError> {
        let Some(found) = found else { return Ok(None) };
        let scheme = winner::scheme(&found, self.base, self.conditions)?;
        let conditions = Conditions::of(&scheme);
        let attained = Attained::new(&scheme, &conditions, self.options.seed)?;
        let requirements = attained.requirements(&conditions)?;
        if self.options.meet && !requirements.all_met() {
            return Ok(None);
        }
        let counts = |name: &String| self.required.iter().any(|r| r.0 == *name);
        let (worst, worst_sigma_dph) = attained.worst_of(&counts).map(|w| (w.name, w.sigma_dph)).unzip();
        if !self.is_immune(&attained, &conditions)? {
            return Ok(None);
        }
        let value = match self.is_noisy() {
            false => found.value,
            true => self
                .criterion
                .of_attained(&attained, &requirements, &counts)
                .map_err(SimulationError::from)?,
        };
        Ok(Some(Found { requirements, worst, worst_sigma_dph, value, ..found }))
    }

    /// True if a scheme is immune as required, by the exact classes of the errors.
    fn is_immune(&self, attained: &Attained, conditions: &Conditions) -> Result<bool, DesignError> {
        if self.options.immune.is_empty() {
            return Ok(true);
        }
        let effects = term_effects(attained, conditions, self.options.seed)?;
        let stands = |t: &OmittedEffect, size: Option<f64>| match t.class {
            Some(OmittedClass::NoEffect) => true,
            Some(OmittedClass::Visible) => t.visible_from.zip(size).is_some_and(|(from, size)| from <= size),
            _ => false,
        };
        let kept = |i: &Immune| {
            let mut own = effects.terms.iter().filter(|t| i.names(&t.family, &t.name));
            own.all(|t| stands(t, i.size))
        };
        Ok(self.options.immune.iter().all(kept))
    }

    /// True if random drift or a bench is stated that the search does not count: listed schemes are
    /// evaluated with it.
    pub(crate) fn is_noisy(&self) -> bool {
        self.ranks()
            || !self.conditions.gyro_noise.is_none()
            || self.conditions.as_stated().drift_noise.amount() > 0.0
    }

    /// True if a bench or an immunity is stated that the search does not count: the schemes of least
    /// sigma are ranked by total uncertainty.
    pub(crate) fn ranks(&self) -> bool {
        self.omitted.is_none() && !(self.conditions.bench.is_empty() && self.options.immune.is_empty())
    }

    /// Front of total time: schemes at other dwells and numbers of positions.
    pub(crate) fn front(
        &self,
        evaluator: &Evaluator,
        search: &SequenceSearch<'_>,
        (k, dwell_s): (usize, f64),
        main: &Best,
    ) -> Result<Vec<Found>, DesignError> {
        let mut out = Vec::new();
        let mut counts = vec![k];
        counts.extend(self.options.front.iter().filter(|f| **f != k));
        for count in counts {
            let known = main.found.iter().filter(|s| s.sequence.len() == count);
            let mut given: Vec<Vec<Stop>> = known.map(|s| s.sequence.clone()).collect();
            for factor in DWELLS {
                if (count, factor) == (k, 1.0) {
                    continue;
                }
                // a dwell of too many steps is no point of the front
                let Ok(other) = evaluator.clone().with_dwell(dwell_s * factor) else { continue };
                // schemes of the front are compared by their criterion alone
                let there = SequenceSearch { evaluator: &other, keep: 1, ..*search };
                let restarts = if count == k { FRONT_RESTARTS } else { self.options.restarts.min(40) };
                let best = there.exchange(count, &given, restarts, self.options.seed);
                if !best.complete {
                    return Ok(out);
                }
                given.extend(best.found.iter().map(|s| s.sequence.clone()));
                out.extend(self.all_found(&other, &best.front)?);
            }
        }
        Ok(out)
    }

    /// Attitudes of a sequence, and the sequence as stops of these attitudes as candidates.
    pub(crate) fn placed(&self, of: &Scored) -> (Vec<Euler>, Vec<Stop>) {
        let attitude = |s: &Stop| self.candidates.attitudes[s.candidate].clone();
        let path = of.sequence.iter().zip(0..).map(|(s, candidate)| Stop { candidate, ..*s });
        (of.sequence.iter().map(attitude).collect(), path.collect())
    }

    /// Best sequence with the total time divided among its positions; `None` if equal dwells are as
    /// good.
    pub(crate) fn divided(
        &self,
        evaluator: &Evaluator,
        best: &Scored,
        proceed: &dyn Fn() -> bool,
    ) -> Result<Option<Found>, DesignError> {
        let (attitudes, path) = self.placed(best);
        let along = evaluator.along(&attitudes.iter().map(c_n_f64).collect::<Vec<_>>());
        let allowed = |there: &Evaluator| proceed() && self.constraints.keep(there, &path);
        let divided = divide::divide(&along, &path, &self.criterion, &allowed)?;
        let Some((value, there)) = divided else { return Ok(None) };
        let names = best.sequence.iter().map(|s| self.candidates.names[s.candidate].clone()).collect();
        let found = self.judged(&there, &path, attitudes, names, value)?;
        let dwells_s: Vec<f64> = (0..path.len()).map(|i| there.dwelling_of(i).seconds).collect();
        self.attained(found.map(|f| Found { dwells_s, dwell_s: evaluator.dwell_s(), ..f }))
    }

    /// Best sequence with its angles refined; `None` unless its worst degree is no larger and its
    /// criterion smaller.
    pub(crate) fn refined(
        &self,
        evaluator: &Evaluator,
        best: &Scored,
        proceed: &dyn Fn() -> bool,
    ) -> Result<Option<Found>, DesignError> {
        let (start, path) = self.placed(best);
        let c = &self.constraints;
        let allowed = |there: &Evaluator| proceed() && c.keep(there, &path);
        let refined = refine::refine(evaluator, &start, &path, &self.criterion, &self.base.gimbals, &allowed);
        let Some((value, attitudes)) = refined else { return Ok(None) };
        let matrices: Vec<_> = attitudes.iter().map(c_n_f64).collect();
        let there = evaluator.along(&matrices);
        let mut names = Candidates::default();
        attitudes.iter().for_each(|a| names.add(a.clone()));
        let found = self.judged(&there, &path, attitudes, names.names, value)?;
        let found = found.filter(|f| f.worst_degree <= best.score.degree);
        self.attained(found.map(|f| Found { refined: true, ..f }))
    }

    /// Text `makes D_FX, D_FY observable with at most 10 s in all`.
    pub(crate) fn wanted(&self) -> String {
        let every = self.options.required.is_empty();
        let names: Vec<&str> = self.required.iter().map(|r| r.0.as_str()).collect();
        let what = if every { "every coefficient".into() } else { names.join(", ") };
        let limits = self.constraints_in_words();
        let limits = if limits.is_empty() { String::new() } else { format!(" with {}", limits.join(", ")) };
        let slews = if self.slews { " by repositioning at once as well as with its slews" } else { "" };
        format!("makes {what} observable{slews}{limits}")
    }

    pub(crate) fn constraints_in_words(&self) -> Vec<String> {
        let c = &self.constraints;
        let mut out = Vec::new();
        out.extend(c.total_s.map(|s| format!("at most {s} s in all")));
        out.extend(c.slew_s.map(|s| format!("slews of at most {s} s")));
        if c.sigmas.is_some() {
            out.push(match self.options.required.is_empty() {
                true => "every stated requirement met as predicted".into(),
                false => "every stated requirement on what must be observable met as predicted".into(),
            });
        }
        out.extend(self.options.immune.iter().zip(&self.immune_units).map(|(i, unit)| match i.size {
            Some(size) => {
                format!(
                    "no effect of {}, or one that a record shows at 3 sigma from {size} {unit} on",
                    i.name
                )
            }
            None => format!("no effect of {}", i.name),
        }));
        let caps = widest_first(&self.options.degree_caps);
        for (name, cap) in &caps {
            let every = if caps.len() > 1 {
                "every other required coefficient"
            } else {
                "every required coefficient"
            };
            let name = name.as_deref().unwrap_or(every);
            out.push(format!("degree of {name} at most {cap}"));
        }
        if !self.base.gimbals.are_free() {
            out.push(format!("gimbals: {}", self.base.gimbals));
        }
        out
    }
}

/// Number of sets of `k` out of `n`; `None` beyond 2^64.
fn choose(n: u64, k: u64) -> Option<u64> {
    if k > n {
        return Some(0);
    }
    let k = k.min(n - k);
    (0..k)
        .try_fold(1u128, |product, i| product.checked_mul(u128::from(n - i)).map(|p| p / u128::from(i + 1)))
        .and_then(|x| u64::try_from(x).ok())
}

//! Schemes of a search as found: judged, attained, divided and refined.

use std::collections::HashMap;

use obsdeg_core::accuracy::Accuracy;
use obsdeg_core::degree::judge;
use obsdeg_core::model::{Euler, Path, Platform, Scheme, angles_text, c_n_f64};
use obsdeg_core::omitted::OmittedClass;
use obsdeg_evidence::requirements::Requirements;
use obsdeg_evidence::simulation::omitted::{OmittedEffect, term_effects};
use obsdeg_evidence::simulation::{Attained, Conditions, SimulationError, latitude_of};
use obsdeg_exact::parallel;

use super::{DWELLS, FRONT_RESTARTS, Task};
use crate::design::answer::{Found, HalfTurn};
use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::stop::Stop;
use crate::design::polish::{divide, refine};
use crate::design::request::candidates::Candidates;
use crate::design::request::error::DesignError;
use crate::design::request::options::Immune;
use crate::design::run::winner;
use crate::design::search::best::Best;
use crate::design::search::score::Scored;
use crate::design::search::scoring::SequenceSearch;

impl Task<'_> {
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
}

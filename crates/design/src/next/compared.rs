//! Extensions of a scheme, and their order.

use std::cmp::Ordering;

use obsdeg_core::model::slew::Slew;
use obsdeg_core::model::{Dwell, Platform, Position, Scheme, SlewTo, angles_text, c_n_f64};
use obsdeg_evidence::requirements::{Miss, RequirementClaim, Requirements, SigmaSource, Worst};
use obsdeg_evidence::simulation::{Attained, Conditions, KnownCovariance, SimulationError, is_rate, resolve};

use super::answer::{AddedPosition, AttitudeBound, Meeting, Quickest, Standing};
use super::bound;
use super::options::{LONGEST, NextOptions, SAME, any_position, is_ordered};
use crate::design::{Candidates, DesignError, MOST_EXTENSIONS, half_turn};

/// Candidates of an extension, each with true for the other direction of a half turn.
pub(super) type Sequence = Vec<(usize, bool)>;

/// Setting of a comparison.
pub(super) struct Compared<'a> {
    /// Scheme to extend.
    pub(super) start: &'a Scheme,
    pub(super) conditions: &'a Conditions,
    pub(super) candidates: &'a Candidates,
    pub(super) required: &'a [String],
    pub(super) options: &'a NextOptions,
}

/// Extension with the values that decide its order.
#[derive(Debug, Clone)]
pub(super) struct JudgedExtension {
    pub(super) sequence: Sequence,
    pub(super) positions: Vec<AddedPosition>,
    pub(super) standing: Standing,
    /// Degrees of the required coefficients.
    pub(super) degrees: Vec<Option<usize>>,
    /// Largest ratio of uncertainty to requirement; without requirements the largest sigma.
    value: f64,
    /// True if the extension is within the limits of time.
    possible: bool,
    pub(super) error_bound: f64,
}

/// State before the added positions.
pub(super) struct StateBefore {
    pub(super) standing: Standing,
    pub(super) degrees: Vec<Option<usize>>,
}

impl JudgedExtension {
    pub(super) fn is_possible(&self) -> bool {
        self.possible
    }

    /// Fewest unobservable, then the smallest worst degree.
    fn verdict(&self) -> (usize, usize) {
        (self.standing.not_observable.len(), self.standing.worst_degree.unwrap_or(usize::MAX))
    }

    /// Verdicts, then the uncertainty, then the time, then the order of the candidates.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        let value = |e: &Self| format!("{:.9e}", e.value).parse().unwrap_or(e.value);
        (self.verdict().cmp(&other.verdict()))
            .then(f64::total_cmp(&value(self), &value(other)))
            .then(self.standing.total_s.total_cmp(&other.standing.total_s))
            .then_with(|| self.sequence.cmp(&other.sequence))
    }

    pub(super) fn is_as_good_as(&self, best: &Self) -> bool {
        let near = |a: f64, b: f64| a == b || (a - b).abs() <= SAME * b.abs();
        self.verdict() == best.verdict()
            && near(self.value, best.value)
            && near(self.standing.total_s, best.standing.total_s)
    }
}

impl Compared<'_> {
    /// All extensions: both directions of half turns where slews take time, two positions in both orders
    /// where the order counts.
    ///
    /// # Errors
    /// [`DesignError::Extensions`] if there are too many.
    pub(super) fn sequences(&self) -> Result<Vec<Sequence>, DesignError> {
        let all = 0..self.candidates.attitudes.len();
        let mut out: Vec<Sequence> = vec![Vec::new()];
        let ordered = is_ordered(self.start, self.conditions);
        for _ in 0..self.options.added {
            let mut longer = Vec::new();
            for before in &out {
                let from = before.last().filter(|_| !ordered).map_or(0, |last| last.0);
                for candidate in all.clone().filter(|&c| c >= from) {
                    let turns: &[bool] =
                        if self.is_half_turn(before, candidate) { &[false, true] } else { &[false] };
                    longer.extend(turns.iter().map(|&turn| {
                        let mut sequence = before.clone();
                        sequence.push((candidate, turn));
                        sequence
                    }));
                }
            }
            if longer.len() > MOST_EXTENSIONS {
                return Err(DesignError::Extensions { found: longer.len() });
            }
            out = longer;
        }
        Ok(out)
    }

    /// Slew to a candidate; `None` if slews take no time.
    fn slew(&self, before: &[(usize, bool)], candidate: usize) -> Option<Slew> {
        let rate = self.conditions.slew_rate_deg_s?;
        let from = match before.last() {
            Some((last, _)) => &self.candidates.attitudes[*last],
            // behind a rotation the attitude is another one
            None => self.start.positions.last().filter(|p| p.rotation.is_none()).map(|p| &p.angles)?,
        };
        let to = &self.candidates.attitudes[candidate];
        Slew::to(&c_n_f64(from), &c_n_f64(to), &SlewTo::default(), rate.to_radians()).ok().flatten()
    }

    fn is_half_turn(&self, before: &[(usize, bool)], candidate: usize) -> bool {
        self.slew(before, candidate).is_some_and(|slew| slew.reversed().is_some())
    }

    /// Scheme with added positions at its end, each with this dwell.
    fn scheme(&self, sequence: &Sequence, dwell_s: f64) -> (Scheme, Vec<AddedPosition>) {
        let mut scheme = self.start.clone();
        let mut added = Vec::new();
        for (k, &(candidate, reversed)) in sequence.iter().enumerate() {
            let angles = self.candidates.attitudes[candidate].clone();
            let slew = self.slew(&sequence[..k], candidate);
            let half =
                slew.and_then(|s| Some(if reversed { s.reversed()? } else { s.reversed().map(|_| s)? }));
            let about = half.map(|s| s.turn().about);
            let name = free_name(&scheme);
            added.push(AddedPosition {
                name: name.clone(),
                candidate: self.candidates.names[candidate].clone(),
                angles: angles_text(&angles),
                half_turn_about: about,
            });
            let slew = about.map(|about| half_turn(&about));
            scheme.positions.push(Position {
                name,
                angles,
                dwell: Dwell::from_seconds(dwell_s),
                rotation: None,
                slew,
            });
        }
        (scheme, added)
    }

    /// Judges an extension.
    pub(super) fn extended(&self, sequence: &Sequence) -> Result<JudgedExtension, DesignError> {
        self.at(sequence, self.conditions.dwell_s)
    }

    fn at(&self, sequence: &Sequence, dwell_s: f64) -> Result<JudgedExtension, DesignError> {
        let (scheme, positions) = self.scheme(sequence, dwell_s);
        let attained =
            Attained::beside(&scheme, self.conditions, self.options.beforehand.as_ref(), self.options.seed)?;
        let (standing, degrees, value) = self.standing(&attained)?;
        let slews = (0..sequence.len()).filter_map(|k| self.slew(&sequence[..k], sequence[k].0));
        let longest = slews.map(|s| s.duration_s).fold(0.0, f64::max);
        let within = |found: f64, limit: Option<f64>| limit.is_none_or(|limit| found <= limit);
        let possible = within(standing.total_s, self.options.total_s) && within(longest, self.options.slew_s);
        let error_bound = attained.prediction.error_bound;
        Ok(JudgedExtension {
            sequence: sequence.clone(),
            positions,
            standing,
            degrees,
            value,
            possible,
            error_bound,
        })
    }

    /// State of the required coefficients, their degrees, and the value for comparison.
    fn standing(&self, attained: &Attained) -> Result<(Standing, Vec<Option<usize>>, f64), DesignError> {
        let (names, units) = (attained.plan.platform.names(), attained.plan.platform.units());
        let columns: Vec<usize> =
            self.required.iter().filter_map(|r| names.iter().position(|n| n == r)).collect();
        let degrees: Vec<Option<usize>> =
            columns.iter().map(|&c| attained.prediction.unknowns[c].degree).collect();
        let mut requirements = attained.requirements(self.conditions)?;
        if self.options.beforehand.is_some() {
            requirements.basis = SigmaSource::PredictedWithPrior;
            // every coefficient rests on the calibration, as the answer states
            requirements.on_prior.clear();
        }
        let mut worst: Option<Worst> = None;
        let mut largest = 0.0f64;
        for &c in &columns {
            let Some(sigma_dph) = attained.totals[c] else { continue };
            largest = largest.max(sigma_dph);
            if is_rate(units[c]) && worst.as_ref().is_none_or(|w| sigma_dph > w.sigma_dph) {
                worst = Some(Worst { name: names[c].clone(), sigma_dph });
            }
        }
        let own = worst.as_ref().map_or(largest, |w| w.sigma_dph);
        let value = match requirements.stated {
            0 => own,
            _ => requirements.worst.as_ref().map_or(f64::INFINITY, |w| 1.0 / w.margin),
        };
        let open = columns.iter().filter(|&&c| attained.totals[c].is_none());
        let standing = Standing {
            not_observable: open.map(|&c| names[c].clone()).collect(),
            worst_degree: degrees
                .iter()
                .copied()
                .collect::<Option<Vec<_>>>()
                .and_then(|d| d.into_iter().max()),
            requirements,
            worst,
            total_s: attained.plan.duration_s(),
        };
        Ok((standing, degrees, value))
    }

    /// State before the added positions; after a calibration the state given by its covariance.
    pub(super) fn before(&self) -> Result<Option<StateBefore>, DesignError> {
        if let Some(known) = &self.options.beforehand {
            return self.of_covariance(known).map(Some);
        }
        if self.start.positions.is_empty() {
            return Ok(None);
        }
        let attained = Attained::new(self.start, self.conditions, self.options.seed)?;
        let (standing, degrees, _) = self.standing(&attained)?;
        Ok(Some(StateBefore { standing, degrees }))
    }

    /// Bound over all attitudes on one more position after a calibration.
    pub(super) fn bound(&self, first: &JudgedExtension) -> Result<Option<AttitudeBound>, DesignError> {
        let Some(known) = self.options.beforehand.as_ref().filter(|_| self.options.added == 1) else {
            return Ok(None);
        };
        let (scheme, _) = self.scheme(&first.sequence, self.conditions.dwell_s);
        let attained = Attained::beside(&scheme, self.conditions, Some(known), self.options.seed)?;
        let platform = &attained.plan.platform;
        let limits = resolve("required sigma", platform, &self.conditions.requirements, f64::NAN)?;
        let limit = |c: usize| Some(limits[c]).filter(|limit| !limit.is_nan());
        Ok(bound::bound(&attained, known, self.conditions, self.required, limit))
    }

    /// State of the coefficients given by a covariance alone.
    fn of_covariance(&self, known: &KnownCovariance) -> Result<StateBefore, DesignError> {
        let platform = Platform::new(Scheme { positions: any_position(), ..self.start.clone() })?;
        let (names, units) = (platform.names(), platform.units());
        let limits = resolve("required sigma", &platform, &self.conditions.requirements, f64::NAN)?;
        let coefficients = names.len() - platform.coefficients()..names.len();
        let claims = coefficients.map(|c| RequirementClaim {
            name: &names[c],
            required: Some(limits[c]).filter(|r| !r.is_nan()),
            sigma: known.sigma(&names[c]).ok_or(Miss::NotObservable),
        });
        let requirements = Requirements::of(SigmaSource::PredictedWithPrior, claims);
        let of_rate =
            |name: &&String| names.iter().position(|n| n == *name).is_some_and(|c| is_rate(units[c]));
        let rates = self.required.iter().filter(of_rate);
        let sigmas =
            rates.filter_map(|name| Some(Worst { name: name.clone(), sigma_dph: known.sigma(name)? }));
        let open = self.required.iter().filter(|name| known.sigma(name).is_none());
        let standing = Standing {
            not_observable: open.cloned().collect(),
            worst_degree: None,
            requirements,
            worst: sigmas.max_by(|a, b| a.sigma_dph.total_cmp(&b.sigma_dph)),
            total_s: 0.0,
        };
        Ok(StateBefore { standing, degrees: vec![None; self.required.len()] })
    }

    /// Shortest dwell of an extension that meets every requirement.
    pub(super) fn meets(&self, of: &JudgedExtension) -> Result<Option<Meeting>, DesignError> {
        self.meets_within(of, LONGEST * self.conditions.dwell_s)
    }

    /// Shortest dwell up to `longest` that meets every requirement, in whole seconds.
    fn meets_within(&self, of: &JudgedExtension, longest: f64) -> Result<Option<Meeting>, DesignError> {
        let met = |r: &Requirements| r.stated > 0 && r.all_met();
        let at = |dwell: f64| match self.at(&of.sequence, dwell) {
            // a dwell with more steps than a plan allows is not possible
            Err(DesignError::Conditions(SimulationError::TooManySteps { .. })) => Ok(None),
            other => other.map(|e| Some(e).filter(|e| e.possible && met(&e.standing.requirements))),
        };
        if of.standing.requirements.stated == 0 || longest < 1.0 {
            return Ok(None);
        }
        let (mut short, mut long) = (0.0, self.conditions.dwell_s.min(longest));
        let mut best = at(long)?;
        while best.is_none() && long < longest {
            (short, long) = (long, (2.0 * long).min(longest));
            best = at(long)?;
        }
        let Some(mut best) = best else { return Ok(None) };
        while long - short > 1.0 && long - short > 0.001 * long {
            let middle = ((short + long) / 2.0).ceil();
            match at(middle)? {
                Some(found) => (long, best) = (middle, found),
                None => short = middle,
            }
        }
        Ok(Some(Meeting { dwell_s: long, total_s: best.standing.total_s }))
    }

    /// Extension that meets every requirement in the shortest time, if it is shorter than `below`. Every
    /// extension is tried with dwells that make it at least a second shorter than the shortest so far.
    pub(super) fn quickest(
        &self,
        all: &[JudgedExtension],
        below: Option<f64>,
    ) -> Result<Option<Quickest>, DesignError> {
        let (mut shortest, mut best) = (below.unwrap_or(f64::INFINITY), None);
        for one in all {
            let spare = (shortest - 1.0 - one.standing.total_s) / one.sequence.len() as f64;
            let longest = (self.conditions.dwell_s + spare).min(LONGEST * self.conditions.dwell_s).floor();
            if let Some(met) = self.meets_within(one, longest)? {
                shortest = met.total_s;
                let positions = one.positions.clone();
                best = Some(Quickest { positions, dwell_s: met.dwell_s, total_s: met.total_s });
            }
        }
        Ok(best)
    }
}

/// A name for one more position: `p3` for the third, or the next number that no other position has.
fn free_name(scheme: &Scheme) -> String {
    let taken = |name: &String| scheme.positions.iter().any(|p| p.name == *name);
    let numbers = scheme.positions.len() + 1..;
    numbers.map(|k| format!("p{k}")).find(|name| !taken(name)).unwrap_or_default()
}

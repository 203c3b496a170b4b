//! Task of a search: names resolved, candidates ordered by orbits; and reports of its results.

mod requirements;
mod schemes;

use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{Angle, Carry, Platform, Scheme};
use obsdeg_evidence::simulation::omitted::Bench;
use obsdeg_evidence::simulation::{Conditions, PRIOR, SimulationError, resolve};

use crate::degree_caps::{DegreeCap, widest_first};
use crate::design::answer::Minimum;
use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::omitted::OmittedErrors;
use crate::design::observable::rows::AttitudeRows;
use crate::design::observable::slew_sequences::is_slew_sequence;
use crate::design::observable::symmetry::CandidateSymmetry;
use crate::design::request::candidates::Candidates;
use crate::design::request::error::DesignError;
use crate::design::request::limits::EXHAUSTIVE;
use crate::design::request::options::DesignOptions;
use crate::design::search::constraints::Constraints;
use requirements::{
    Demands, by_orbits, caps, check, check_positions_of, constraints, criterion, limits, required,
    uses_requirements,
};

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
        let omitted = OmittedErrors::of(base, &platform, conditions, &options.immune)?
            .filter(|_| !of_psi || conditions.bench.is_empty());
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
            criterion: criterion(options.criterion, &limits),
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
        for DegreeCap { name, cap } in &caps {
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

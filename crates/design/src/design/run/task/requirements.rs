//! Requirements of a search: names resolved, limits, degrees, constraints and the criterion.

use obsdeg_core::model::settings::concerns;
use obsdeg_core::model::{Path, Platform, Scheme, Unknowns};
use obsdeg_evidence::simulation::{Conditions, resolve};

use crate::degree_caps::{DegreeCap, widest_first};
use crate::design::measure::criterion::{Criterion, SigmaLimits};
use crate::design::observable::rows::AttitudeRows;
use crate::design::observable::symmetry::CandidateSymmetry;
use crate::design::request::candidates::Candidates;
use crate::design::request::error::DesignError;
use crate::design::request::limits::MAX_CANDIDATES;
use crate::design::request::options::{CriterionName, DesignOptions};
use crate::design::search::constraints::Constraints;

/// Checks the numbers of candidates and positions, the limits, and that the base and all angles are of a kind
/// that a search takes.
pub(super) fn check(
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
pub(super) fn required(
    all: &[(String, usize)],
    options: &DesignOptions,
) -> Result<Vec<(String, usize)>, DesignError> {
    let mut required = all.to_vec();
    if !options.required.is_empty() {
        let asked = options.required.iter().map(|name| named(all, name));
        let asked = asked.collect::<Result<Vec<_>, _>>()?.concat();
        required.retain(|c| asked.contains(&c.1));
    }
    Ok(required)
}

/// Largest degree of every coefficient that counts; the largest number where there is no limit.
pub(super) fn caps(
    all: &[(String, usize)],
    required: &[(String, usize)],
    options: &DesignOptions,
) -> Result<Vec<usize>, DesignError> {
    let mut caps = vec![usize::MAX; required.len()];
    for DegreeCap { name, cap } in widest_first(&options.degree_caps) {
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
pub(super) fn check_positions_of(conditions: &Conditions) -> Result<(), DesignError> {
    for (what, list) in [("requirement", &conditions.requirements[..]), ("prior", conditions.stated_priors())]
    {
        if let Some(of_one) = list.iter().find(|a| a.name.contains('@')) {
            return Err(DesignError::OnePosition { what, found: of_one.name.clone() });
        }
    }
    Ok(())
}

/// True if the search uses requirements, as a constraint or as its criterion.
pub(super) fn uses_requirements(options: &DesignOptions) -> bool {
    options.meet || options.criterion == CriterionName::Margin
}

/// Largest sigmas of the coefficients that count and of psi; refused if the search uses requirements and none
/// is stated.
pub(super) fn limits(
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
pub(super) fn criterion(name: CriterionName, limits: &SigmaLimits) -> Criterion {
    match name {
        CriterionName::Worst => Criterion::Worst,
        CriterionName::A => Criterion::A,
        CriterionName::D => Criterion::D,
        CriterionName::E => Criterion::E,
        CriterionName::Margin => Criterion::Margin(limits.clone()),
    }
}

/// Demands of a task on the coefficients, by which a turn of the platform axes may rename them.
pub(super) struct Demands<'a> {
    /// Indices of the coefficients that count.
    pub(super) required: &'a [usize],
    /// Largest degree of each of these.
    pub(super) caps: &'a [usize],
    /// Largest sigma of each of these; `None` if the search does not use requirements.
    pub(super) limits: Option<&'a [f64]>,
    /// Prior sigma of every coefficient.
    pub(super) priors: &'a [f64],
    /// True if psi may be renamed too, so that any coefficient may.
    pub(super) renames: bool,
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
pub(super) fn by_orbits(
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
pub(super) fn constraints(options: &DesignOptions, limits: SigmaLimits, caps: Vec<usize>) -> Constraints {
    Constraints {
        total_s: options.total_s,
        slew_s: options.slew_s,
        sigmas: options.meet.then_some(limits),
        degrees: caps.iter().any(|c| *c != usize::MAX).then_some(caps),
    }
}

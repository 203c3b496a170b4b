//! What is asked of a search, checked and resolved: coefficients, criterion, order of the candidates.

use obsdeg_core::model::settings::concerns;
use obsdeg_core::model::{Path, Scheme, Unknowns};
use obsdeg_evidence::simulation::Conditions;

use crate::design::measure::criterion::{Criterion, Limits};
use crate::design::observable::rows::Rows;
use crate::design::request::candidates::Candidates;
use crate::design::request::error::DesignError;
use crate::design::request::limits::MAX_CANDIDATES;
use crate::design::request::options::{CriterionName, DesignOptions};

/// Refuses what no search can do, before anything is computed.
pub(super) fn check(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    candidates: &Candidates,
) -> Result<(), DesignError> {
    conditions.validate()?;
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
    match generic {
        Some((name, _)) => Err(DesignError::GenericAngle { name: name.into() }),
        None => Ok(()),
    }
}

/// Refuses requirements and priors of one position.
pub(super) fn of_all_positions(conditions: &Conditions) -> Result<(), DesignError> {
    for (what, list) in [("requirement", &conditions.requirements[..]), ("prior", conditions.stated_priors())]
    {
        if let Some(of_one) = list.iter().find(|a| a.name.contains('@')) {
            return Err(DesignError::OnePosition { what, found: of_one.name.clone() });
        }
    }
    Ok(())
}

/// Names of coefficients with their indices, and the highest degree that each may have.
pub(super) type Required = (Vec<(String, usize)>, Vec<usize>);

/// The coefficients that count among those of these names.
pub(super) fn required(names: &[String], options: &DesignOptions) -> Result<Required, DesignError> {
    let all: Vec<(String, usize)> = names.iter().cloned().zip(0..).collect();
    let named = |asked: &String| {
        let known = all.iter().map(|c| c.0.clone()).collect::<Vec<_>>().join(", ");
        let found: Vec<usize> = all.iter().filter(|c| concerns(asked, &c.0)).map(|c| c.1).collect();
        let unknown = DesignError::UnknownName { found: asked.clone(), known };
        if found.is_empty() { Err(unknown) } else { Ok(found) }
    };
    let mut required = all.clone();
    if !options.required.is_empty() {
        let asked = options.required.iter().map(named).collect::<Result<Vec<_>, _>>()?.concat();
        required.retain(|c| asked.contains(&c.1));
    }
    let mut caps = vec![usize::MAX; required.len()];
    for (name, cap) in &options.degree_caps {
        let concerned = name.as_ref().map(named).transpose()?;
        for (slot, c) in caps.iter_mut().zip(&required) {
            if concerned.as_ref().is_none_or(|list| list.contains(&c.1)) {
                *slot = *cap;
            }
        }
    }
    Ok((required, caps))
}

/// True if requirements decide what is found.
pub(super) fn uses_requirements(options: &DesignOptions) -> bool {
    options.meet || options.criterion == CriterionName::Margin
}

/// The criterion; refused where it needs a requirement and there is none.
pub(super) fn criterion(options: &DesignOptions, limits: &Limits) -> Result<Criterion, DesignError> {
    let none = limits.coefficients.iter().chain(&limits.psi).all(|l| l.is_infinite());
    if uses_requirements(options) && none {
        let what = if options.meet { "--meet" } else { "--criterion margin" };
        return Err(DesignError::NoRequirement { what });
    }
    Ok(match options.criterion {
        CriterionName::Worst => Criterion::Worst,
        CriterionName::A => Criterion::A,
        CriterionName::D => Criterion::D,
        CriterionName::E => Criterion::E,
        CriterionName::Margin => Criterion::Margin(limits.clone()),
    })
}

/// Candidates orbit by orbit, an attitude once: a set that begins with a representative stands for all its images.
pub(super) fn by_orbits(rows: &Rows, same: &dyn Fn(usize, usize) -> bool) -> Vec<usize> {
    let repeated = rows.repeated();
    let kept: Vec<usize> = (0..rows.candidates()).filter(|i| !repeated.contains(i)).collect();
    let symmetry = rows.select(&kept).symmetry(same);
    let mut order: Vec<(usize, usize)> = symmetry.orbit.iter().copied().zip(kept).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, c)| c).collect()
}

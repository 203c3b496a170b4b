//! Effects of errors outside the model: changes of the estimates by errors that a scheme does not estimate.
//!
//! With x the unknowns and k the omitted errors, `Z = J x + O k + n`. Estimates change by `B k`,
//! `B = (J' R^-1 J + P^-1)^-1 J' R^-1 O`, with the noise and the priors of the sigmas. The classes (no
//! effect, silent, visible) are verdicts of the exact engine ([`obsdeg_core::omitted`]); sizes and
//! sensitivities are figures.

mod advice;
#[cfg(test)]
mod advice_tests;
mod answer;
pub(crate) mod bench;
mod budget;
mod columns;
mod score;
#[cfg(test)]
mod tests;
pub(crate) mod weights;

use obsdeg_core::model::{OmittedModel, OmittedTerm, Platform};
use obsdeg_core::omitted::{OmittedClass, OmittedVerdict, omitted_verdicts};

pub use answer::{
    Advice, AdviceKind, Budget, BudgetLine, CarryUncertainty, ChangePerUnit, Composition, CorrelatedNoise,
    Evaluation, FamilyEffect, OmittedEffect, OmittedEffects, SAMPLES, UsesUp,
};
pub use bench::{Bench, BenchError};
pub use columns::OmittedColumns;
pub use score::{ResidualExplanation, ScoreSums, SuspectedChange, SuspectedError, Suspicion};
pub use weights::Influence;

use crate::simulation::{
    Attained, Conditions, SimulationError, is_rate, required_sigmas, shown_unit, si_per_shown,
};

/// Relative information of an error below which it counts as rounding of its samples.
const ROUNDING: f64 = 1e-18;
/// Size of a visible error, in sigmas, that counts as detected.
pub const SEEN: f64 = 3.0;

/// Effects of everything that the scheme of `attained` does not estimate. With a bench: also the uncertainty
/// under every carry, and advice where the bench uses up a margin.
///
/// # Errors
/// [`SimulationError`].
pub fn omitted_effects(
    attained: &Attained,
    conditions: &Conditions,
    seed: u64,
) -> Result<OmittedEffects, SimulationError> {
    let mut out = term_effects(attained, conditions, seed)?;
    out.correlated_noise = correlated_noise(attained, conditions, seed)?;
    if !out.budgets.is_empty() {
        out.carries = advice::carries(attained, conditions, seed)?;
        out.advice = advice::advice(attained, conditions, &out, seed)?;
    }
    Ok(out)
}

/// Factors of the correlated noise of the accelerometers on the sigmas; `None` without such noise.
fn correlated_noise(
    attained: &Attained,
    conditions: &Conditions,
    seed: u64,
) -> Result<Option<CorrelatedNoise>, SimulationError> {
    if conditions.accelerometer().states().is_empty() {
        return Ok(None);
    }
    let white = Conditions { accelerometer_instability_ug: 0.0, bench: Vec::new(), ..conditions.clone() };
    let white = Attained::new(attained.plan.platform.scheme(), &white, seed)?;
    let (names, units) = (attained.plan.platform.names(), attained.plan.platform.units());
    let factor = |c: usize| Some((attained.sigmas[c]? / white.sigmas[c]?, c));
    let factors: Vec<(f64, usize)> =
        (0..names.len()).filter(|&c| is_rate(units[c])).filter_map(factor).collect();
    let largest = factors.iter().max_by(|a, b| a.0.total_cmp(&b.0));
    Ok(largest.map(|&(largest, c)| CorrelatedNoise {
        smallest: factors.iter().fold(largest, |least, f| least.min(f.0)),
        largest,
        unknown: names[c].clone(),
    }))
}

/// Effects of the errors alone; the parts that [`omitted_effects`] adds with a bench are empty.
///
/// # Errors
/// [`SimulationError`].
pub fn term_effects(
    attained: &Attained,
    conditions: &Conditions,
    seed: u64,
) -> Result<OmittedEffects, SimulationError> {
    let platform = &attained.plan.platform;
    let scheme = platform.scheme();
    Bench::check(&conditions.bench, scheme.positions.len(), scheme.rotates())?;
    let model = OmittedModel::new(platform);
    let classified = omitted_verdicts(platform, &model, seed);
    let (verdicts, not_classified) = match classified {
        Ok(verdicts) => (Some(verdicts), None),
        Err(e) => (None, Some(e.to_string())),
    };
    let influence = attained.influence(&model)?;
    let bench = Bench::of(&conditions.bench, &model)?;
    let changes = influence.shown(platform.units(), &attained.sigmas, &model, verdicts.as_ref());
    let required = required_sigmas(platform, conditions)?;
    let totals = bench.totals(&attained.sigmas, &changes);
    let names = platform.names();
    let margins = Margins { names, required: &required, totals: &totals };
    let terms: Vec<OmittedEffect> = (0..model.terms().len())
        .map(|j| {
            let verdict = verdicts.as_ref().map(|v| &v.terms[j]);
            let shown = (influence.information[j], influence.squares[j]);
            term_effect((platform, &model), j, verdict, shown, bench.sizes[j], (&changes[..], &margins))
        })
        .collect();
    let families = families(attained, (&model, &terms), &changes, &margins);
    let budget = |c: usize| {
        let (name, unit) = (names[c].as_str(), shown_unit(platform.units()[c]));
        Some(budget::budget((name, unit), attained.sigmas[c]?, required[c], &terms))
    };
    let budgets = if bench.is_empty() { Vec::new() } else { (0..names.len()).filter_map(budget).collect() };
    Ok(OmittedEffects {
        families,
        budgets,
        terms,
        carries: Vec::new(),
        advice: Vec::new(),
        correlated_noise: None,
        torquers_in_turns: model.turning().is_some()
            || attained.plan.slews().next().is_some()
            || platform.scheme().rotates(),
        error_bound: verdicts.map(|v| v.error_bound),
        not_classified,
        estimated: Bench::estimated(&conditions.bench, platform),
        priors: !conditions.stated_priors().is_empty(),
        attitudes: model.terms().iter().any(|t| t.family == "attitude"),
    })
}

/// Effect of the error `j` with its `size` in the bench. `shown` is its information in the samples, and the
/// sum of their squares.
fn term_effect(
    (platform, model): (&Platform, &OmittedModel),
    j: usize,
    verdict: Option<&OmittedVerdict>,
    shown: (f64, f64),
    size: Option<f64>,
    (changes, margins): (&[Vec<f64>], &Margins<'_>),
) -> OmittedEffect {
    let (names, t) = (platform.names(), &model.terms()[j]);
    let class = verdict.map(|v| v.class);
    let sensitivities = (0..names.len()).filter(|&c| changes[c][j] != 0.0).map(|c| ChangePerUnit {
        unknown: names[c].clone(),
        unit: shown_unit(platform.units()[c]).into(),
        per_unit: changes[c][j],
    });
    OmittedEffect {
        name: t.name.clone(),
        family: t.family.into(),
        unit: t.unit.into(),
        class,
        exact: verdict.and_then(|v| v.exact.clone()),
        visible_from: visible_from(t, class, shown.0, shown.1),
        size,
        sensitivities: sensitivities.collect(),
        uses_up: margins.used_up(|c| changes[c][j], |c| changes[c][j] * size.unwrap_or(0.0)),
    }
}

/// Requirement and total uncertainty of every unknown.
struct Margins<'a> {
    names: &'a [String],
    required: &'a [Option<f64>],
    totals: &'a [Option<f64>],
}

impl Margins<'_> {
    /// Smallest size at which an error raises a total to its requirement. `change` is the change of an
    /// unknown per unit; `benched` is the change by the error's size in the bench, which the new size
    /// replaces.
    fn used_up(&self, change: impl Fn(usize) -> f64, benched: impl Fn(usize) -> f64) -> Option<UsesUp> {
        let used = (0..self.names.len()).filter_map(|c| {
            let (change, own) = (change(c), benched(c));
            let rest = (self.totals[c]? * self.totals[c]? - own * own).max(0.0);
            let left = self.required[c]? * self.required[c]? - rest;
            // without a margin there is nothing to use up
            (change != 0.0 && left > 0.0)
                .then(|| UsesUp { unknown: self.names[c].clone(), size: left.sqrt() / change.abs() })
        });
        used.min_by(|a, b| a.size.total_cmp(&b.size))
    }
}

/// Size at which a record shows a visible error at three sigma, in its unit.
fn visible_from(
    term: &OmittedTerm,
    class: Option<OmittedClass>,
    information: f64,
    squares: f64,
) -> Option<f64> {
    // without a class, a rounding rest of the samples does not count
    let visible = class.map_or(information > ROUNDING * squares, |c| c == OmittedClass::Visible);
    (visible && information > 0.0).then(|| SEEN / information.sqrt() / si_per_shown(term.unit))
}

/// Effects by family, in the order of the terms.
fn families(
    attained: &Attained,
    (model, terms): (&OmittedModel, &[OmittedEffect]),
    changes: &[Vec<f64>],
    margins: &Margins<'_>,
) -> Vec<FamilyEffect> {
    let (names, units) = (attained.plan.platform.names(), attained.plan.platform.units());
    let mut known: Vec<&str> = Vec::new();
    for t in model.terms() {
        if !known.contains(&t.family) {
            known.push(t.family);
        }
    }
    let family = |family: &str| {
        let own: Vec<usize> = (0..terms.len()).filter(|&j| terms[j].family == family).collect();
        let rss = |c: usize| own.iter().map(|&j| changes[c][j].powi(2)).sum::<f64>().sqrt();
        let benched = |j: usize, c: usize| changes[c][j] * terms[j].size.unwrap_or(0.0);
        let rates = (0..names.len()).filter(|&c| is_rate(units[c]) && rss(c) > 0.0);
        let worst = rates.clone().max_by(|&a, &b| rss(a).total_cmp(&rss(b)));
        let count = |class: OmittedClass| {
            let classes: Option<Vec<OmittedClass>> = own.iter().map(|&j| terms[j].class).collect();
            classes.map(|c| c.into_iter().filter(|c| *c == class).count())
        };
        let used = own.iter().filter_map(|&j| terms[j].uses_up.clone());
        FamilyEffect {
            family: family.into(),
            unit: terms[own[0]].unit.clone(),
            terms: own.len(),
            no_effect: count(OmittedClass::NoEffect),
            silent: count(OmittedClass::Silent),
            worst: worst.map(|c| ChangePerUnit {
                unknown: names[c].clone(),
                unit: units[c].into(),
                per_unit: rss(c),
            }),
            worst_in_sigmas: rates.filter_map(|c| Some(rss(c) / attained.sigmas[c]?)).reduce(f64::max),
            visible_from: own.iter().filter_map(|&j| terms[j].visible_from).reduce(f64::min),
            uses_up: margins.used_up(rss, |c| own.iter().map(|&j| benched(j, c).powi(2)).sum::<f64>().sqrt()),
            one_uses_up: used.min_by(|a, b| a.size.total_cmp(&b.size)),
        }
    };
    known.into_iter().map(family).collect()
}

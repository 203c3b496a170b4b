//! Uncertainty budgets in the form of the GUM (JCGM 100:2008): sources with standard uncertainty, sensitivity
//! and contribution, the largest contribution first.

use super::answer::{Budget, BudgetLine, Evaluation, OmittedEffect, SAMPLES};

/// Budget of an unknown of standard deviation `sigma`, with the errors that have a size.
pub(crate) fn budget(
    unknown: (&str, &str),
    sigma: f64,
    requirement: Option<f64>,
    effects: &[OmittedEffect],
) -> Budget {
    let (name, unit) = unknown;
    let line = |source: &str, evaluation, (value, value_unit): (f64, &str), sensitivity: f64| BudgetLine {
        source: source.into(),
        evaluation,
        value,
        value_unit: value_unit.into(),
        sensitivity,
        contribution: (value * sensitivity).abs(),
        percent: 0.0,
    };
    let mut lines = vec![line(SAMPLES, Evaluation::A, (sigma, unit), 1.0)];
    lines.extend(effects.iter().filter_map(|e| {
        let own = e.sensitivities.iter().find(|s| s.unknown == name)?;
        Some(line(&e.name, Evaluation::B, (e.size.filter(|s| *s > 0.0)?, e.unit.as_str()), own.per_unit))
    }));
    lines.sort_by(|a, b| b.contribution.total_cmp(&a.contribution));
    let squared: f64 = lines.iter().map(|l| l.contribution * l.contribution).sum();
    for l in &mut lines {
        l.percent = if squared > 0.0 { 100.0 * l.contribution * l.contribution / squared } else { 0.0 };
    }
    Budget { unknown: name.into(), unit: unit.into(), total: squared.sqrt(), requirement, lines }
}

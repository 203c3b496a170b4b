//! Acceptance of coefficients within limits, with guard bands.
//!
//! A coefficient is estimated as `y` with standard uncertainty `u` and has to lie within `[low, high]`. It is
//! accepted if `low + g <= y <= high - g`, rejected if `y` lies beyond a limit by more than `w`, and
//! undecided between. The guard bands follow from the stated risk `r` (JCGM 106:2012, 7 and 8, with the
//! conformance probability of a normal error):
//!
//! - `Phi(-g/u) + Phi(-(high - low - g)/u) = r`: an accepted coefficient lies outside with probability `r` at
//!   most;
//! - `Phi(-w/u) + Phi(-(high - low + w)/u) = r`: a coefficient within the limits is rejected with probability
//!   `r` at most.

use obsdeg_core::model::Acceptance;
use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_ekf::consistency::normal_cdf;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::simulation::general_first;

/// Decisions on all coefficients with limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AcceptanceReport {
    /// Largest probability, dimensionless, that an accepted coefficient lies outside its limits, and that a
    /// coefficient within them is rejected.
    pub risk: f64,
    /// True if the decisions stand; false for a calibration that is not consistent, whose uncertainties do
    /// not count.
    pub valid: bool,
    /// Coefficients with limits, in model order.
    pub limits: Vec<AcceptanceLimit>,
}

/// Coefficient with its limits and the decision on it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AcceptanceLimit {
    /// Name of the coefficient, such as D_FX.
    pub name: String,
    /// Unit of the limits, the estimate and the uncertainty.
    pub unit: String,
    /// Lowest value allowed, in the unit of `unit`.
    pub low: f64,
    /// Highest value allowed, in the unit of `unit`.
    pub high: f64,
    /// Standard uncertainty of the estimate, in the unit of `unit`; null if the coefficient is not
    /// determined.
    pub uncertainty: Option<f64>,
    /// Lowest and highest estimate that is accepted, in the unit of `unit`; null if the uncertainty allows
    /// none.
    pub accepted: Option<[f64; 2]>,
    /// Estimates, in the unit of `unit`, below and above which the coefficient is rejected; null without an
    /// uncertainty.
    pub rejected_beyond: Option<[f64; 2]>,
    /// True if the samples do not determine the coefficient, so that stated priors alone bound it: it stays
    /// undecided.
    #[serde(default)]
    pub by_prior: bool,
    /// Estimate of the coefficient, in the unit of `unit`; null before a run, and if it is not determined.
    pub estimate: Option<f64>,
    /// Decision on the estimate; null before a run.
    pub decision: Option<Decision>,
}

/// Decision on a coefficient with limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// Estimate within the limits by more than the guard band.
    Accepted,
    /// Estimate beyond a limit by more than the guard band.
    Rejected,
    /// Estimate within the guard band of a limit, a coefficient that is not determined or bounded by priors
    /// alone, or a calibration that is not consistent.
    Undecided,
}

impl AcceptanceReport {
    /// True if every coefficient with limits is accepted.
    pub fn all_accepted(&self) -> bool {
        self.limits.iter().all(|l| l.decision == Some(Decision::Accepted))
    }
}

/// Unknown with the numbers that its acceptance needs.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredCoefficient<'a> {
    /// Name of the unknown.
    pub name: &'a str,
    /// Unit of the numbers.
    pub unit: &'a str,
    /// Estimate; `None` before a run.
    pub estimate: Option<f64>,
    /// Standard uncertainty; `None` if the unknown is not determined.
    pub uncertainty: Option<f64>,
    /// True if stated priors alone bound the unknown.
    pub by_prior: bool,
}

/// Decisions on `measured` by the stated limits; `None` where none is stated. `consistent` is `None` before a
/// run.
pub fn acceptance<'a>(
    stated: &Acceptance,
    measured: impl IntoIterator<Item = MeasuredCoefficient<'a>>,
    consistent: Option<bool>,
) -> Option<AcceptanceReport> {
    let end = |k: usize| {
        let of = |(name, ends): (&String, &[f64; 2])| Assignment { name: name.clone(), value: ends[k] };
        general_first(stated.limits.iter().map(of).collect())
    };
    let ends = [end(0), end(1)];
    let risk = stated.risk();
    let limits = measured.into_iter().filter_map(|m| {
        let [low, high] = [0, 1].map(|k| ends[k].iter().rfind(|a| concerns(&a.name, m.name)));
        Some(limit(&m, [low?.value, high?.value], risk, consistent))
    });
    let limits: Vec<AcceptanceLimit> = limits.collect();
    (!limits.is_empty()).then(|| AcceptanceReport { risk, valid: consistent != Some(false), limits })
}

fn limit(
    m: &MeasuredCoefficient<'_>,
    [low, high]: [f64; 2],
    risk: f64,
    consistent: Option<bool>,
) -> AcceptanceLimit {
    let uncertainty = m.uncertainty.filter(|u| u.is_finite() && *u >= 0.0);
    let accepted = uncertainty.and_then(|u| inner_guard(u, high - low, risk)).map(|g| [low + g, high - g]);
    let rejected_beyond = uncertainty.map(|u| outer_guard(u, high - low, risk)).map(|w| [low - w, high + w]);
    let within = |[low, high]: [f64; 2], y: f64| (low..=high).contains(&y);
    let decision = consistent.map(|consistent| match (m.estimate, accepted, rejected_beyond) {
        _ if m.by_prior => Decision::Undecided,
        (Some(y), Some(accepted), _) if consistent && within(accepted, y) => Decision::Accepted,
        (Some(y), _, Some(beyond)) if consistent && !within(beyond, y) => Decision::Rejected,
        _ => Decision::Undecided,
    });
    let (name, unit) = (m.name.into(), m.unit.into());
    let estimate = m.estimate.filter(|_| uncertainty.is_some());
    let by_prior = m.by_prior;
    AcceptanceLimit {
        name,
        unit,
        low,
        high,
        uncertainty,
        accepted,
        rejected_beyond,
        by_prior,
        estimate,
        decision,
    }
}

/// Number of bisections of a guard band.
const BISECTIONS: usize = 200;

/// Guard band inside limits that are `width` apart; `None` if even the middle exceeds the risk.
fn inner_guard(u: f64, width: f64, risk: f64) -> Option<f64> {
    let outside = |g: f64| normal_cdf(-g / u) + normal_cdf((g - width) / u);
    if u == 0.0 {
        return Some(0.0);
    }
    (outside(width / 2.0) <= risk).then(|| least(0.0, width / 2.0, |g| outside(g) <= risk))
}

/// Guard band outside limits that are `width` apart.
fn outer_guard(u: f64, width: f64, risk: f64) -> f64 {
    let wrong = |w: f64| normal_cdf(-w / u) + normal_cdf(-(w + width) / u);
    if u == 0.0 { 0.0 } else { least(0.0, 40.0 * u, |w| wrong(w) <= risk) }
}

/// Smallest number between `low` and `high` at which a monotone condition holds, which it does at `high`.
fn least(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = f64::midpoint(low, high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(low: f64, high: f64, risk: f64, estimate: f64, uncertainty: Option<f64>) -> AcceptanceLimit {
        let stated = Acceptance { limits: [("D_F".into(), [low, high])].into(), risk: Some(risk) };
        let measured = MeasuredCoefficient {
            name: "D_FX",
            unit: "deg/h",
            estimate: Some(estimate),
            uncertainty,
            by_prior: false,
        };
        acceptance(&stated, [measured], Some(true)).expect("a limit").limits.remove(0)
    }

    /// Guard bands of wide limits are one-sided quantiles of the normal distribution: 1.644854 sigma at 5 %,
    /// 2.326348 at 1 % (tables).
    #[test]
    fn guard_bands_of_wide_limits() {
        for (risk, quantile) in [(0.05, 1.644854), (0.01, 2.326348), (0.025, 1.959964)] {
            let found = of(-10.0, 10.0, risk, 0.0, Some(0.5));
            let [low, high] = found.accepted.expect("an interval");
            assert!((low + 10.0 - 0.5 * quantile).abs() < 1e-6 && (low + high).abs() < 1e-12, "{found:?}");
            let beyond = found.rejected_beyond.expect("an interval");
            assert!((beyond[1] - 10.0 - 0.5 * quantile).abs() < 1e-6, "{found:?}");
        }
    }

    /// Limits of four sigma in all: the middle lies outside with 4.55 % (tables), so that 5 % leave an
    /// interval and 4 % none.
    #[test]
    fn narrow_limits_leave_no_acceptance() {
        assert!(of(-1.0, 1.0, 0.05, 0.0, Some(0.5)).accepted.is_some());
        let none = of(-1.0, 1.0, 0.04, 0.0, Some(0.5));
        assert_eq!((none.accepted, none.decision), (None, Some(Decision::Undecided)));
        // a large uncertainty rejects nothing nearby
        assert_eq!(of(-1e-3, 1e-3, 0.05, 0.5, Some(0.5)).decision, Some(Decision::Undecided));
    }

    #[test]
    fn decisions() {
        let decided = |y: f64| of(-10.0, 20.0, 0.05, y, Some(1.0)).decision;
        assert_eq!(decided(0.0), Some(Decision::Accepted));
        assert_eq!([decided(18.4), decided(21.6), decided(-8.4)], [Some(Decision::Undecided); 3]);
        assert_eq!(decided(18.3), Some(Decision::Accepted));
        assert_eq!([decided(21.7), decided(-11.7)], [Some(Decision::Rejected); 2]);
        // by a prior alone nothing is accepted
        let prior = MeasuredCoefficient {
            name: "D_FX",
            unit: "",
            estimate: Some(0.0),
            uncertainty: Some(0.1),
            by_prior: true,
        };
        let wide = Acceptance { limits: [("D_F".into(), [-9.0, 9.0])].into(), risk: None };
        assert_eq!(
            acceptance(&wide, [prior], Some(true)).expect("a limit").limits[0].decision,
            Some(Decision::Undecided)
        );
        assert_eq!(of(-1.0, 1.0, 0.05, 0.0, None).decision, Some(Decision::Undecided));
        assert_eq!(of(-1.0, 1.0, 0.05, 0.0, Some(0.0)).decision, Some(Decision::Accepted));
        let stated = Acceptance { limits: [("D".into(), [-9.0, 9.0])].into(), risk: None };
        let at = |consistent| {
            let m = MeasuredCoefficient {
                name: "D_IX",
                unit: "deg/h/g",
                estimate: Some(0.0),
                uncertainty: Some(1.0),
                by_prior: false,
            };
            acceptance(&stated, [m], consistent).expect("a limit")
        };
        assert_eq!(at(None).limits[0].decision, None);
        assert!(!at(Some(false)).valid && !at(Some(false)).all_accepted() && at(Some(true)).all_accepted());
        // the limit of the coefficient itself counts before that of its family
        let both = Acceptance {
            limits: [("D".into(), [-9.0, 9.0]), ("D_IX".into(), [1.0, 2.0])].into(),
            risk: None,
        };
        let m = MeasuredCoefficient {
            name: "D_IX",
            unit: "",
            estimate: None,
            uncertainty: None,
            by_prior: false,
        };
        assert_eq!(acceptance(&both, [m], None).expect("a limit").limits[0].low, 1.0);
        let psi = MeasuredCoefficient {
            name: "psi_x",
            unit: "deg",
            estimate: None,
            uncertainty: None,
            by_prior: false,
        };
        assert_eq!(acceptance(&both, [psi], None), None);
    }
}

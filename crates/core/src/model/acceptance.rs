//! Acceptance limits of calibrated coefficients.

use std::collections::BTreeMap;

/// Limits within which calibrated coefficients are accepted, with the largest risk of an acceptance.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Acceptance {
    /// Lowest and highest value allowed by coefficient or family, in the unit of the coefficient.
    pub limits: BTreeMap<String, [f64; 2]>,
    /// Largest probability that an accepted coefficient lies outside its limits; `None`: 0.05.
    pub risk: Option<f64>,
}

/// Risk where a scheme states none.
pub(crate) const RISK: f64 = 0.05;
/// Admitted risks.
const RISKS: [f64; 2] = [1e-6, 0.5];

impl Acceptance {
    /// Largest probability that an accepted coefficient lies outside its limits.
    pub fn risk(&self) -> f64 {
        self.risk.unwrap_or(RISK)
    }

    /// Key and message of an entry that is wrong in itself; `admitted` names the range of limits.
    pub(crate) fn wrong(&self) -> Option<(String, String)> {
        if let Some(risk) = self.risk.filter(|r| !(RISKS[0]..=RISKS[1]).contains(r)) {
            let message = format!("acceptance.risk {risk}: expected {} to {}", RISKS[0], RISKS[1]);
            return Some(("acceptance.risk".into(), message));
        }
        if self.limits.is_empty() && self.risk.is_some() {
            let message = "acceptance: a risk without limits; expected limits, as in limits = { D_F = 20 }";
            return Some(("acceptance.risk".into(), message.into()));
        }
        self.limits.iter().find_map(|(name, [low, high])| {
            let key = format!("acceptance.limits.{name}");
            if name.starts_with("psi") || name.starts_with("eps") {
                let message =
                    format!("`{name}`: limits are for coefficients; expected D_F, D_IX or the like");
                return Some((key, message));
            }
            if low == &-high && *high <= 0.0 {
                let expected = "expected a largest magnitude above 0, or the lowest and the highest value";
                return Some((key, format!("acceptance limit of `{name}`: {high}; {expected}")));
            }
            let inside = |x: &f64| super::ranges::VALUE.admits(*x);
            (!(inside(low) && inside(high) && low < high)).then(|| {
                let expected = format!("expected two ascending numbers of {}", super::ranges::VALUE);
                (key, format!("acceptance limits of `{name}`: {low} to {high}; {expected}"))
            })
        })
    }
}

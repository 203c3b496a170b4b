//! Requirements against sigmas: the one decision that every command reports.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// True if a sigma meets a requirement: the comparison on which every "met" and "reached" rests. False for
/// NaN.
pub fn meets(sigma: f64, required: f64) -> bool {
    sigma <= required
}

/// Unknown with its requirement and its sigma.
#[derive(Debug, Clone, PartialEq)]
pub struct RequirementClaim<'a> {
    /// Name of the unknown.
    pub name: &'a str,
    /// Largest sigma allowed, in the unit of the unknown; an unknown without one does not count.
    pub required: Option<f64>,
    /// Sigma in the same unit, or the reason why no sigma counts.
    pub sigma: Result<f64, Miss>,
}

impl RequirementClaim<'_> {
    /// Margin: required over found sigma, met from 1. `None` without a requirement, or without a sigma that
    /// counts.
    pub fn margin(&self) -> Option<f64> {
        let sigma = self.sigma.ok().filter(|s| s.is_finite() && *s >= 0.0)?;
        self.required.map(|r| r / sigma).filter(|m| !m.is_nan())
    }

    /// Reason why the requirement is missed; `None` if it is met.
    fn miss(&self, required: f64) -> Option<Miss> {
        match self.sigma {
            Err(why) => Some(why),
            Ok(sigma) if meets(sigma, required) => None,
            Ok(sigma) => Some(if sigma.is_finite() { Miss::TooLarge } else { Miss::NoNumber }),
        }
    }
}

/// Reason why a requirement is missed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Miss {
    /// Sigma above the requirement.
    TooLarge,
    /// Unknown that the outputs do not determine.
    NotObservable,
    /// Sigma hardly below the prior's: it repeats the prior.
    RestsOnPrior,
    /// Error beyond four sigma: the filter is wrong.
    Inconsistent,
    /// Sigma or estimate that is not a finite number.
    NoNumber,
}

/// Unknown that misses its requirement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Missed {
    /// Name of the unknown that misses.
    pub name: String,
    /// Reason why the requirement is missed.
    pub why: Miss,
}

/// Margin of a requirement, with its unknown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Margin {
    /// Name of the unknown with this margin.
    pub name: String,
    /// Required over found sigma, dimensionless: met from 1.
    pub margin: f64,
}

/// Largest sigma, with a bench the largest total uncertainty, of a drift coefficient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Worst {
    /// Name of the coefficient with this sigma.
    pub name: String,
    /// Standard deviation of the coefficient, with a bench its total uncertainty, in deg/h (per g, per g^2).
    pub sigma_dph: f64,
}

/// Source of the sigmas that are compared with requirements. The prediction alone decides whether a scheme
/// meets its requirements; a run is an example, a record its confirmation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Basis")]
pub enum SigmaSource {
    /// Information of all samples with the stated noise and random drift, psi at the end of the scheme (under
    /// reset carry at the end of each position); no prior knowledge.
    Predicted,
    /// Information of all samples as in `predicted`, with the stated priors.
    PredictedWithPrior,
    /// Filter at the end of a simulated run, with its prior and its random drift, whether they are stated or
    /// chosen by the program.
    Run,
    /// Estimates of a calibration from a record.
    Record,
}

/// Outcome of all requirements: those met, those missed and the smallest margin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Requirements {
    /// Source of the sigmas that decide.
    pub basis: SigmaSource,
    /// Number of unknowns with a requirement.
    pub stated: usize,
    /// Number of unknowns that meet their requirement.
    pub met: usize,
    /// Smallest margin among the sigmas that count; null if there is none.
    pub worst: Option<Margin>,
    /// Unknowns that miss their requirement, in model order.
    pub missed: Vec<Missed>,
    /// True if the sigmas are total uncertainties, with the errors of a stated bench.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub with_bench: bool,
    /// Unknowns with a requirement that the samples do not determine, so that their sigma depends on stated
    /// priors alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub on_prior: Vec<String>,
}

impl Requirements {
    /// Decision on `claims`, in their order.
    pub fn of<'a>(basis: SigmaSource, claims: impl IntoIterator<Item = RequirementClaim<'a>>) -> Self {
        let mut out = Self {
            basis,
            stated: 0,
            met: 0,
            worst: None,
            missed: Vec::new(),
            with_bench: false,
            on_prior: Vec::new(),
        };
        for claim in claims {
            let Some(required) = claim.required else { continue };
            out.stated += 1;
            match claim.miss(required) {
                None => out.met += 1,
                Some(why) => out.missed.push(Missed { name: claim.name.into(), why }),
            }
            if let Some(margin) = claim.margin()
                && out.worst.as_ref().is_none_or(|w| margin < w.margin)
            {
                out.worst = Some(Margin { name: claim.name.into(), margin });
            }
        }
        out
    }

    /// True if requirements are stated and every one is met; false where none is stated.
    pub fn all_met(&self) -> bool {
        self.stated > 0 && self.missed.is_empty()
    }

    /// True if a stated requirement is missed.
    pub fn any_missed(&self) -> bool {
        !self.missed.is_empty()
    }

    /// True if the worst margin leaves out missed requirements whose sigma does not count.
    pub fn leaves_out(&self) -> bool {
        self.missed.iter().any(|m| m.why != Miss::TooLarge)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(name: &str, required: Option<f64>, sigma: Result<f64, Miss>) -> RequirementClaim<'_> {
        RequirementClaim { name, required, sigma }
    }

    #[test]
    fn what_is_met_and_what_is_missed() {
        let judged = Requirements::of(
            SigmaSource::Run,
            [
                claim("just", Some(0.1), Ok(0.1)),
                claim("above", Some(0.1), Ok(0.1000001)),
                claim("well", Some(0.1), Ok(0.01)),
                claim("unseen", Some(0.1), Err(Miss::NotObservable)),
                claim("free", None, Err(Miss::NotObservable)),
                claim("nan", Some(0.1), Ok(f64::NAN)),
                claim("infinite", Some(0.1), Ok(f64::INFINITY)),
                claim("exact", Some(0.1), Ok(0.0)),
            ],
        );
        assert_eq!((judged.stated, judged.met, judged.all_met()), (7, 3, false));
        let missed: Vec<(&str, Miss)> = judged.missed.iter().map(|m| (m.name.as_str(), m.why)).collect();
        let expected = [
            ("above", Miss::TooLarge),
            ("unseen", Miss::NotObservable),
            ("nan", Miss::NoNumber),
            ("infinite", Miss::NoNumber),
        ];
        assert_eq!(missed, expected);
        assert!(judged.leaves_out());
        assert_eq!(judged.worst.map(|w| w.name).as_deref(), Some("above"));
        assert!(!Requirements::of(SigmaSource::Run, [claim("above", Some(0.1), Ok(0.2))]).leaves_out());
        // without a requirement none is met and none is missed
        let none = Requirements::of(SigmaSource::Predicted, [claim("free", None, Ok(1.0))]);
        assert_eq!((none.stated, none.met, none.worst.is_none()), (0, 0, true));
        assert!(!none.all_met() && !none.any_missed());
    }
}

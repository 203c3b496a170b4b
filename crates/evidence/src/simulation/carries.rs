//! Comparison of a scheme under the other carries: effect of the assumption about repositioning.

use obsdeg_core::model::{Carry, Platform, Scheme};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attained::Attained;
use super::conditions::Conditions;
use super::error::SimulationError;
use super::limits::MAX_UNKNOWNS;
use crate::requirements::{Requirements, Worst};

/// Scheme under another carry than its own: same positions, dwells, noise and requirements. Slews, which only
/// inertial carry has, are left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OtherCarry {
    /// Carry: quantity that continues from one position to the next.
    pub carry: Carry,
    /// Largest sigma of a drift coefficient in deg/h (per g); null if a coefficient is not observable, or if
    /// nothing was judged.
    pub worst: Option<Worst>,
    /// True if the slews of the scheme are left out there, since only inertial carry has slews.
    #[serde(default)]
    pub without_slews: bool,
    /// Outcome of the requirements; null if nothing was judged.
    pub requirements: Option<Requirements>,
    /// Reason why nothing was judged; left out where something was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_judged: Option<String>,
}

/// Scheme and conditions under another carry; `None` where torquer errors act on turns that the scheme does
/// not state. Combinations are those of the scheme's own unknowns and are left out.
pub(crate) fn under(scheme: &Scheme, conditions: &Conditions, carry: Carry) -> Option<(Scheme, Conditions)> {
    let other = Scheme { carry, combinations: Vec::new(), ..scheme.clone() };
    other.paths().is_ok().then(|| (other, Conditions { slews: false, ..conditions.clone() }))
}

/// Comparison of the scheme under every carry but its own.
///
/// # Errors
/// [`SimulationError`].
pub fn other_carries(
    scheme: &Scheme,
    conditions: &Conditions,
    seed: u64,
) -> Result<Vec<OtherCarry>, SimulationError> {
    let without_slews = scheme.positions.iter().skip(1).any(|p| conditions.slew_rate(p).is_some());
    let judged = |carry: Carry| {
        let nothing = |why: String| OtherCarry {
            carry,
            worst: None,
            without_slews,
            requirements: None,
            not_judged: Some(why),
        };
        let Some((scheme, conditions)) = under(scheme, conditions, carry) else {
            return Ok(nothing("torquer errors act in turns that the scheme does not state".into()));
        };
        let platform = Platform::new(scheme.clone())?;
        let unknowns = platform.names().len();
        if unknowns > MAX_UNKNOWNS {
            return Ok(nothing(format!("{unknowns} unknowns, more than {MAX_UNKNOWNS}")));
        }
        let conditions = conditions.within(&platform);
        let attained = Attained::new(&scheme, &conditions, seed)?;
        Ok(OtherCarry {
            carry,
            worst: attained.worst_of(&|_| true),
            without_slews,
            requirements: Some(attained.requirements(&conditions)?),
            not_judged: None,
        })
    };
    Carry::ALL.into_iter().filter(|c| *c != scheme.carry).map(judged).collect()
}

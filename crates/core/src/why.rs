//! Explanation of one verdict: what decides it, which assumptions it rests on, and what would improve it.
//! Plain data, and the linear algebra that schemes and models share.

use std::cmp::Reverse;

use obsdeg_exact::{RowSpace, Scalars};
use schemars::JsonSchema;
use serde::Serialize;

use crate::degree::status::Status;
use crate::language::among;
use crate::remedies::{Change, Resolved};

/// Largest number of unknowns up to which deciding derivatives are sought: the work grows with the fourth
/// power.
pub(crate) const MOST_DECIDED: usize = 120;

/// Sentence that replaces the deciding derivatives of a scheme or model with too many unknowns.
pub(crate) fn too_many(unknowns: usize) -> String {
    format!("deciding derivatives: {unknowns} unknowns; at most {MOST_DECIDED}")
}

/// Error message for a name that is not an unknown, with similar names.
pub fn no_unknown(name: &str, unknowns: &[String]) -> String {
    format!("no unknown `{name}`; {}", among(name, unknowns))
}

/// Explanation of the verdict on one unknown.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Why {
    /// Name of the unknown that the explanation concerns.
    pub name: String,
    /// Verdict: observable, inseparable, not excited, or not resolved up to the bound on the order.
    pub status: Status,
    /// Observable degree of the unknown; null if it is not observable.
    pub degree: Option<usize>,
    /// Output derivatives that determine the unknown, with the constraints and the known quantities (of a
    /// scheme: the unknown is a linear combination of the derivatives); none of the derivatives can be left
    /// out. Other sets of derivatives may do the same. Empty if the unknown is not observable, or if
    /// `not_explained` has the reason.
    pub determined_by: Vec<OutputDerivative>,
    /// Unobserved direction: proof that no lower order, or no order at all, is enough; null for degree 0.
    pub unseen: Option<UnseenDirection>,
    /// Symmetries that change the unknown and leave every output unchanged, in words; empty for schemes.
    pub symmetries: Vec<String>,
    /// Assumptions of the verdict, each with the verdicts without it.
    pub assumptions: Vec<Assumption>,
    /// Changes that make the unknown observable, or lower its degree, each tried by the exact engine. In
    /// order of cost: a value known, one more position, one more output, another carry, two changes; those of
    /// one kind by the degree that they lead to. Two changes are listed only if no single one makes the
    /// unknown observable.
    pub remedies: Vec<Improvement>,
    /// Parts of the explanation that are missing and changes that were not tried, one sentence each; empty if
    /// there are none.
    pub not_explained: Vec<String>,
    /// Number of changed schemes or models that the exact engine judged.
    pub verdicts: usize,
}

/// Time derivative of an output.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct OutputDerivative {
    /// Output: `Z1` (north), `Z2` (up), `Z3` (east) in local geographic axes, `Za` of a measured azimuth,
    /// or the name of an output of a model.
    pub output: String,
    /// Order of the derivative by time.
    pub order: usize,
    /// Position of the scheme, or segment or experiment of the model (`segment 2`, `experiment 1`); null for
    /// a model with one of each.
    pub place: Option<String>,
}

/// Direction in which unknowns change together while no output derivative up to an order changes. Every
/// component is needed: in a direction of fewer of these unknowns a derivative changes.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UnseenDirection {
    /// Highest order of the output derivatives that do not change.
    pub up_to_order: usize,
    /// True if no derivative of any order changes.
    pub at_every_order: bool,
    /// Unknowns that change, with the coefficients of the direction; the unknown itself first, with 1.
    pub components: Vec<Component>,
    /// Derivatives of the next order, out of `determined_by`, that change along the direction; empty if the
    /// unknown is not observable.
    pub seen_by: Vec<OutputDerivative>,
}

/// Component of a null vector.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Component {
    /// Name of the unknown, as in the model.
    pub name: String,
    /// Coefficient of the unknown in the null vector; null if it was not computed.
    pub coefficient: Option<String>,
}

/// Kind of an assumption of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AssumptionKind {
    /// Carry between positions of the scheme.
    Carry,
    /// Latitude: generic, or the stated one.
    Latitude,
    /// Angles of the positions of the scheme.
    Angles,
    /// Azimuth as a measured output.
    Azimuth,
    /// Presence of a position in the scheme.
    Position,
    /// Presence of an output in the model.
    Output,
    /// Known initial value of a state.
    KnownStart,
    /// Known constant of the model.
    KnownConstant,
    /// Known input function of the model.
    KnownInput,
    /// Constraint that the model states.
    Constraint,
}

/// Assumption of a verdict, and verdicts without it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Assumption {
    /// Kind of the assumption, such as carry.
    pub kind: AssumptionKind,
    /// Assumption as stated: `platform`, `48.2 deg`, `p2`, `x1`.
    pub stated: String,
    /// Verdicts under other conditions.
    pub otherwise: Vec<Otherwise>,
    /// True if the degree differs under one of the other conditions: the verdict rests on the assumption.
    pub decides: bool,
}

/// Verdict under another condition.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Otherwise {
    /// Condition that replaces the assumption: `inertial`, `pole`, `without it`, `unknown`.
    pub condition: String,
    /// Observable degree of the unknown under the condition; null if it is not observable.
    pub degree: Option<usize>,
}

impl Assumption {
    /// Assumption with the verdicts under other conditions; `degree` is the verdict under the assumption.
    pub(crate) fn new(
        kind: AssumptionKind,
        stated: String,
        otherwise: Vec<Otherwise>,
        degree: Option<usize>,
    ) -> Self {
        let decides = otherwise.iter().any(|o| o.degree != degree);
        Self { kind, stated, otherwise, decides }
    }
}

/// Change that makes an unknown observable or lowers its degree.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Improvement {
    /// Changes, one or two that are needed together.
    pub changes: Vec<Change>,
    /// Observable degree of the unknown with the changes.
    pub degree: usize,
    /// Other unknowns that are observable with the changes and not without them, without those whose value is
    /// given.
    pub resolves: Vec<Resolved>,
    /// Unknowns that are observable without the changes and not with them: possible under another carry only.
    pub loses: Vec<String>,
}

/// True if `after` is lower than `before`; no degree counts as higher than every degree.
pub(crate) fn is_lower(after: Option<usize>, before: Option<usize>) -> bool {
    after.is_some_and(|a| before.is_none_or(|b| a < b))
}

/// Sorts improvements by cost: kinds in the order of [`Why::remedies`], then degrees, then most unknowns
/// resolved.
pub(crate) fn by_cost(improvements: &mut [Improvement]) {
    let kind = |i: &Improvement| match i.changes[..] {
        [Change::Known { .. }] => 0,
        [Change::Attitude { .. }] => 1,
        [Change::Output { .. }] => 2,
        [Change::Carry { .. }] => 3,
        _ => 4,
    };
    improvements.sort_by_key(|i| (kind(i), i.degree, i.loses.len(), Reverse(i.resolves.len())));
}

/// Indices of a minimal set of `rows` whose span, together with `known`, contains the unit vector of a
/// column. Several orders of the rows are tried, and the smallest set is returned. `None` if the span of all
/// rows does not contain the vector.
pub(crate) fn deciding_rows<S: Scalars>(
    field: &S,
    known: &[&[S::Element]],
    rows: &[&[S::Element]],
    column: usize,
) -> Option<Vec<usize>> {
    let columns = rows.first().or(known.first())?.len();
    let mut base = <S::Space as RowSpace>::new(field.clone(), columns);
    known.iter().for_each(|row| _ = base.insert(row));
    let forward: Vec<usize> = (0..rows.len()).collect();
    // rows with an entry in the column first
    let (near, far): (Vec<usize>, Vec<usize>) =
        forward.iter().partition(|&&i| !field.is_zero(&rows[i][column]));
    let touching = [near, far].concat();
    let backward: Vec<usize> = forward.iter().rev().copied().collect();
    let orders = [forward, touching.clone(), touching.into_iter().rev().collect(), backward];
    let found = orders.into_iter().filter_map(|order| decided(&base, rows, &order, column));
    found.min_by_key(Vec::len)
}

/// Indices, in ascending order, of a minimal set of rows whose span contains the unit vector: rows are taken
/// in `order` until the span contains it, then every row that is not needed is dropped.
fn decided<V: RowSpace>(
    base: &V,
    rows: &[&[V::Element]],
    order: &[usize],
    column: usize,
) -> Option<Vec<usize>> {
    let mut space = base.clone();
    let mut kept: Vec<usize> = Vec::new();
    for &i in order {
        if space.has_unit(column) {
            break;
        }
        if space.insert(rows[i]) {
            kept.push(i);
        }
    }
    if !space.has_unit(column) {
        return None;
    }
    // independent rows beside the base: the expression is unique up to the base, so that one pass is enough
    let mut place = 0;
    while place < kept.len() {
        let mut rest = base.clone();
        let others = kept.iter().enumerate().filter(|(k, _)| *k != place);
        others.for_each(|(_, &i)| _ = rest.insert(rows[i]));
        match rest.has_unit(column) {
            true => _ = kept.remove(place),
            false => place += 1,
        }
    }
    kept.sort_unstable();
    Some(kept)
}

#[cfg(test)]
mod tests {
    use obsdeg_exact::Field;

    use super::*;

    /// x0 = (r0 - r1) alone is shorter than r2 + r3 + r4, and r5 alone is shortest.
    #[test]
    fn fewest_rows_by_hand() {
        let f = Field::new((1 << 60) + 33);
        let rows = [[1, 1, 0, 0], [0, 1, 0, 0], [1, 0, 1, 0], [0, 0, -1, 1], [0, 0, 0, -1], [2, 0, 0, 0]]
            .map(|r: [i64; 4]| r.map(|x| f.from_i64(x)));
        let take = |n: usize| rows[..n].iter().map(|r| &r[..]).collect::<Vec<_>>();
        assert_eq!(deciding_rows(&f, &[], &take(1), 0), None);
        assert_eq!(deciding_rows(&f, &[], &take(5), 0), Some(vec![0, 1]));
        assert_eq!(deciding_rows(&f, &[], &take(6), 0), Some(vec![5]));
        // a known row counts without being chosen
        assert_eq!(deciding_rows(&f, &[&rows[1]], &take(1), 0), Some(vec![0]));
        assert_eq!(deciding_rows(&f, &[&rows[5]], &take(5), 0), Some(vec![]));
    }

    #[test]
    fn costs_are_in_order() {
        let one = |change: Change, degree| Improvement {
            changes: vec![change],
            degree,
            resolves: vec![],
            loses: vec![],
        };
        let known = |name: &str| Change::Known { name: name.into() };
        let mut all = vec![
            Improvement { changes: vec![known("a"), known("b")], ..one(known("a"), 0) },
            one(Change::Output { state: "x".into() }, 0),
            one(known("b"), 2),
            one(known("c"), 1),
        ];
        by_cost(&mut all);
        assert_eq!(all.iter().map(|i| i.changes.len()).collect::<Vec<_>>(), [1, 1, 1, 2]);
        assert_eq!(all[0].changes, [known("c")]);
        assert!(is_lower(Some(3), None) && !is_lower(None, None) && !is_lower(Some(2), Some(2)));
    }
}

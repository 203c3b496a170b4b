//! Remedies: changes of a scheme or model that make unobservable unknowns observable. Plain data, and the
//! linear algebra that proposes candidates; the exact engine tries every candidate before it becomes a
//! remedy.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use obsdeg_exact::{RowSpace, Scalars};
use schemars::JsonSchema;
use serde::Serialize;

use crate::model::Carry;

/// Largest number of candidates of which pairs are formed.
pub(crate) const MOST_PAIRED: usize = 48;

/// Remedies of the unknowns that are not observable.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct Remedies {
    /// Remedies, each tried by the exact engine: single changes first, then pairs for unknowns that no single
    /// change resolves.
    pub remedies: Vec<Remedy>,
    /// Unobservable unknowns without a remedy: of the changes that were tried only the value of the unknown
    /// itself resolves them.
    pub unresolved: Vec<String>,
    /// Candidates left out because of the limits on the work, one sentence for each kind; empty when all were
    /// tried.
    pub not_tried: Vec<String>,
    /// Number of changed schemes or models that the exact engine judged.
    pub verdicts: usize,
}

/// Change of the scheme or model, or two changes that are needed together.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Remedy {
    /// Changes that resolve the unknowns, one or two.
    pub changes: Vec<Change>,
    /// Unknowns that are observable with the changes and not without them, in model order; without those
    /// whose value is given.
    pub resolves: Vec<Resolved>,
    /// Unknowns that are observable without the changes and not with them: possible under another carry only.
    pub loses: Vec<String>,
}

/// Unknown that a remedy makes observable.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Resolved {
    /// Name of the resolved unknown.
    pub name: String,
    /// Observable degree of the unknown after the change.
    pub degree: usize,
}

/// Change of a scheme or model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Change {
    /// Known value of an unknown: of a parameter, of psi or a coefficient, of a state at the start of every
    /// experiment, of an input at all times.
    Known {
        /// Name of the unknown whose value is given.
        name: String,
    },
    /// State that becomes one more output of the model.
    Output {
        /// Name of the state that becomes an output.
        state: String,
    },
    /// Position that is added at the end of the scheme.
    Attitude {
        /// Name of the position that is added.
        position: String,
        /// Cardinal attitude: directions of X_p, Y_p and Z_p.
        attitude: String,
    },
    /// Carry between positions that replaces the scheme's own.
    Carry {
        /// Carry of the changed scheme.
        carry: Carry,
    },
}

impl Change {
    /// Unknown whose value this change gives; `None` for other changes.
    pub fn known(&self) -> Option<&str> {
        match self {
            Self::Known { name } => Some(name),
            _ => None,
        }
    }
}

impl Remedies {
    /// True if a remedy resolves the unknown of this name.
    pub(crate) fn resolves(&self, name: &str) -> bool {
        self.remedies.iter().any(|r| r.resolves.iter().any(|x| x.name == name))
    }

    /// Completes the list: records the unknowns of `open` that have no remedy.
    pub(crate) fn close(&mut self, open: impl Iterator<Item = String>) {
        self.unresolved = open.filter(|name| !self.resolves(name)).collect();
    }
}

/// Unobservable directions: for every unknown its entries in a basis N of the null space. A row `c` of
/// further information has the entries `c N`. With such rows an unknown becomes observable if its own
/// entries lie in their span.
pub(crate) struct Directions<S: Scalars> {
    field: S,
    /// Entries of every unknown in the null vectors.
    units: Vec<Vec<S::Element>>,
    /// Number of null vectors.
    count: usize,
}

impl<S: Scalars> Directions<S> {
    /// Directions that no row of a space observes.
    pub(crate) fn of(field: S, space: &S::Space) -> Self {
        let basis = space.null_space();
        let units = (0..space.columns()).map(|c| basis.iter().map(|v| v[c]).collect()).collect();
        Self { field, units, count: basis.len() }
    }

    /// Largest number of products that [`known`](Self::known) takes for a number of unknowns, and
    /// [`resolved`](Self::resolved) with them.
    pub(crate) fn products(&self, known: usize, open: usize) -> u64 {
        let [known, open, count] = [known, open, self.count].map(|n| n as u64);
        // a known row is reduced by those before it and reduces them; an open unknown is reduced by all
        let rows = known.saturating_mul(known).saturating_add(open.saturating_mul(known + 1));
        rows.saturating_mul(count)
    }

    /// Largest number of products that the search for [`pairs`](Self::pairs) of one list takes, if each
    /// candidate gives at most `known` unknowns.
    pub(crate) fn products_of_pairs(&self, candidates: usize, known: usize, open: usize) -> u64 {
        let paired = candidates.min(MOST_PAIRED) as u64;
        let pairs = paired * paired.saturating_sub(1) / 2;
        pairs.saturating_mul(self.products(2 * known, open))
    }

    /// Information of known values of some unknowns on the unobservable directions.
    pub(crate) fn known(&self, columns: &[usize]) -> CandidateInformation<S> {
        let mut space = <S::Space as RowSpace>::new(self.field.clone(), self.count);
        for &c in columns {
            space.insert(&self.units[c]);
        }
        CandidateInformation { space, given: columns.to_vec() }
    }

    /// Information of further rows on the unobservable directions.
    pub(crate) fn rows<'a>(&self, rows: impl Iterator<Item = &'a [S::Element]>) -> CandidateInformation<S>
    where
        S::Element: 'a,
    {
        let mut information = self.known(&[]);
        let zero = self.field.zero();
        for row in rows {
            let entry = |k: usize| self.field.dot(&zero, row.iter().zip(self.units.iter().map(|u| &u[k])));
            let entries: Vec<_> = (0..self.count).map(entry).collect();
            information.space.insert(&entries);
        }
        information
    }

    /// Unknowns of `open` that become observable by this information and are not given.
    pub(crate) fn resolved(&self, by: &CandidateInformation<S>, open: &[usize]) -> Vec<usize> {
        let resolved = |c: &usize| !by.given.contains(c) && by.space.contains(&self.units[*c]);
        open.iter().copied().filter(resolved).collect()
    }

    /// Unknowns of an unobservable direction of minimal support that changes the unknown `column`, which
    /// comes first. Several orders are tried, and the shortest direction is returned. `None` if no direction
    /// changes the unknown. As many other unknowns as possible are held still, until one direction remains.
    pub(crate) fn shortest(&self, column: usize) -> Option<Vec<usize>> {
        let forward: Vec<usize> = (0..self.units.len()).filter(|&c| c != column).collect();
        let shift = forward.len() / 2;
        let turned = [&forward[shift..], &forward[..shift]].concat();
        let backward = |list: &[usize]| list.iter().rev().copied().collect::<Vec<_>>();
        let orders = [forward.clone(), backward(&forward), turned.clone(), backward(&turned)];
        let of = |order: Vec<usize>| self.support_through(column, &order);
        orders.into_iter().filter_map(of).min_by_key(Vec::len)
    }

    fn support_through(&self, column: usize, order: &[usize]) -> Option<Vec<usize>> {
        let mut still = <S::Space as RowSpace>::new(self.field.clone(), self.count);
        if still.contains(&self.units[column]) {
            return None;
        }
        for &c in order.iter().filter(|_| self.count > 1) {
            if still.contains(&self.units[c]) {
                continue;
            }
            let mut more = still.clone();
            more.insert(&self.units[c]);
            if !more.contains(&self.units[column]) {
                still = more;
            }
        }
        let mut rest: Vec<usize> =
            order.iter().copied().filter(|&c| !still.contains(&self.units[c])).collect();
        rest.sort_unstable();
        Some(std::iter::once(column).chain(rest).collect())
    }

    /// True if the set is the support of an unobservable direction of minimal support: with all other
    /// unknowns held still, one direction remains, and it changes every unknown of the set.
    pub(crate) fn is_support(&self, set: &[usize]) -> bool {
        let mut still = <S::Space as RowSpace>::new(self.field.clone(), self.count);
        let others = (0..self.units.len()).filter(|c| !set.contains(c));
        others.for_each(|c| _ = still.insert(&self.units[c]));
        still.rank() + 1 == self.count && set.iter().all(|&c| !still.contains(&self.units[c]))
    }

    /// Tries pairs of one candidate of `left` and one of `right` (of one list if `right` is missing), the
    /// pair that resolves most open unknowns first. `judge` receives their indices and returns the unknowns
    /// that the engine finds resolved, or `None` at the end of its work. Returns false if candidates were
    /// left out: more than `MOST_PAIRED` in a list, or the end of the work.
    pub(crate) fn pairs(
        &self,
        left: &[CandidateInformation<S>],
        right: Option<&[CandidateInformation<S>]>,
        open: Vec<usize>,
        mut judge: impl FnMut(usize, usize) -> Option<Vec<usize>>,
    ) -> bool {
        let second = right.unwrap_or(left);
        let mut found: Vec<(usize, usize, Vec<usize>)> = Vec::new();
        for (i, one) in left.iter().enumerate().take(MOST_PAIRED) {
            let from = if right.is_some() { 0 } else { i + 1 };
            for (j, other) in second.iter().enumerate().take(MOST_PAIRED).skip(from) {
                let resolved = self.resolved(&one.and(other), &open);
                if !resolved.is_empty() {
                    found.push((i, j, resolved));
                }
            }
        }
        let mut open: BTreeSet<usize> = open.into_iter().collect();
        let count = |of: &[usize], open: &BTreeSet<usize>| of.iter().filter(|c| open.contains(c)).count();
        loop {
            found.retain(|pair| count(&pair.2, &open) > 0);
            // the first of the pairs that resolve most
            let best = (0..found.len()).max_by_key(|&k| (count(&found[k].2, &open), Reverse(k)));
            let Some(k) = best else { break };
            let (i, j, _) = found.remove(k);
            let Some(resolved) = judge(i, j) else { return false };
            open.retain(|c| !resolved.contains(c));
        }
        left.len() <= MOST_PAIRED && second.len() <= MOST_PAIRED
    }
}

/// Information of a candidate on the unobservable directions.
pub(crate) struct CandidateInformation<S: Scalars> {
    /// Span of the candidate's rows, in entries of the directions.
    space: S::Space,
    /// Unknowns whose values the candidate gives.
    given: Vec<usize>,
}

impl<S: Scalars> CandidateInformation<S> {
    /// Information of two candidates together.
    fn and(&self, other: &Self) -> Self {
        let mut space = self.space.clone();
        (0..other.space.rank()).for_each(|k| {
            space.insert(other.space.row(k));
        });
        Self { space, given: [self.given.as_slice(), &other.given].concat() }
    }
}

#[cfg(test)]
mod tests {
    use obsdeg_exact::{Echelon, Field};

    use super::*;

    /// x0 + x1 + x2 and x2 + x3 are observable: directions (1,-1,0,0), (1,0,-1,1), (0,1,-1,1).
    #[test]
    fn directions_of_minimal_support_by_hand() {
        let f = Field::new((1 << 60) + 33);
        let mut space = Echelon::new(f, 5);
        space.insert(&[1, 1, 1, 0, 0]);
        space.insert(&[0, 0, 1, 1, 0]);
        let directions = Directions::of(f, &space);
        assert_eq!(directions.shortest(0), Some(vec![0, 1]));
        assert_eq!(directions.shortest(3).map(|s| s.len()), Some(3));
        assert_eq!(directions.shortest(4), Some(vec![4]));
        assert!(directions.is_support(&[0, 1]) && directions.is_support(&[2, 1, 3]));
        assert!(!directions.is_support(&[0, 1, 2, 3]) && !directions.is_support(&[0, 2]));
        space.insert(&[1, 0, 0, 0, 0]);
        assert_eq!(Directions::of(f, &space).shortest(0), None);
    }
}

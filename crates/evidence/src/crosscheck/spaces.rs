//! Evidence a for ranks, null space, combinations and partners, against the samples as the dwell goes to
//! zero.

use obsdeg_core::degree::Status;

use super::answer::{Agreement, Partners, SpaceCheck};
use super::asymptotics::{Asymptotics, ROUNDED, functional};
use super::precise::{Digits, ObservableDirections, add_up};
use crate::prediction::{Combination, Prediction};

/// Bounds of a pivot of rows and columns of unit size: a pivot above the first is non-zero, one below the
/// second is rounding of doubles.
const CLEAR: [f64; 2] = [1e-7, 1e-12];

/// Checks of the spaces that derivatives determine; `is_psi` is true for unknowns that are not drifts.
pub(super) fn spaces(
    prediction: &Prediction,
    shown: Option<&Asymptotics>,
    is_psi: &dyn Fn(usize) -> bool,
) -> Vec<SpaceCheck> {
    let profile = |p: &[usize]| p.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let measured = shown.and_then(|s| s.profile.as_ref());
    vec![
        SpaceCheck {
            what: "rank profile".into(),
            predicted: profile(&prediction.rank_profile),
            measured: measured.map(|p| profile(p)).unwrap_or_default(),
            outcome: measured.map_or(Agreement::NotResolvable, |p| {
                Agreement::of(same_profile(&prediction.rank_profile, p))
            }),
        },
        null_space(prediction, shown, is_psi),
        combinations(prediction, shown, is_psi),
    ]
}

/// True if two rank profiles are equal up to trailing orders that add nothing.
fn same_profile(predicted: &[usize], measured: &[usize]) -> bool {
    let at = |p: &[usize], k: usize| p.get(k).or(p.last()).copied().unwrap_or(0);
    (0..predicted.len().max(measured.len())).all(|k| at(predicted, k) == at(measured, k))
}

/// Check of the null space: number of vectors, their independence, and that no sample observes them.
fn null_space(
    prediction: &Prediction,
    shown: Option<&Asymptotics>,
    is_psi: &dyn Fn(usize) -> bool,
) -> SpaceCheck {
    let silent = prediction.unknowns.iter().filter(|u| u.status == Status::NotExcited).count();
    let mut out = SpaceCheck {
        what: "null space (not excited left out): independent directions that are not seen".into(),
        predicted: String::new(),
        measured: String::new(),
        outcome: Agreement::NotTested,
    };
    let Some(vectors) = &prediction.unseen_by_derivatives else { return out };
    out.predicted = vectors.len().to_string();
    let Some(Asymptotics { seen, .. }) = shown else {
        out.outcome = Agreement::NotResolvable;
        return out;
    };
    let free = seen.free();
    let hidden = count_unseen(seen, vectors, is_psi);
    let on_free: Vec<Vec<f64>> = vectors.iter().map(|v| dense(v, &free, is_psi, true)).collect();
    let rank = rank(on_free);
    let unexcited = seen.excited.iter().filter(|e| !**e).count();
    out.measured = match rank {
        Some(r) => format!("{} ({hidden} of those listed are not seen, {r} independent)", free.len()),
        None => format!("{} ({hidden} of those listed are not seen)", free.len()),
    };
    let agree = hidden == vectors.len() && vectors.len() == free.len() && silent == unexcited;
    out.outcome = match rank {
        Some(r) => Agreement::of(agree && r == vectors.len()),
        None if agree => Agreement::NotResolvable,
        None => Agreement::Disagrees,
    };
    out
}

/// Number of vectors that change no observable direction.
fn count_unseen(
    seen: &ObservableDirections,
    vectors: &[Combination],
    is_psi: &dyn Fn(usize) -> bool,
) -> usize {
    let (free, rows) = seen.reduced();
    let unseen = |v: &&Combination| {
        // change of drift in units of the earth rate
        let v = functional(seen.digits(), &|c| is_psi(c), v, true);
        let entry = |c: usize| v.iter().filter(move |(d, _)| *d == c).map(|(_, x)| x);
        let alone = |c: usize| entry(c).map(|x| (None, x)).collect::<Vec<_>>();
        seen.pivots.iter().zip(&rows).all(|(&pivot, row)| {
            let moved = free.iter().zip(row).flat_map(|(&f, r)| entry(f).map(move |x| (Some(r), x)));
            add_up(seen.digits(), alone(pivot).into_iter().chain(moved)) <= ROUNDED[0]
        })
    };
    vectors.iter().filter(unseen).count()
}

/// Check of the directions that are unobservable with dwells too: `hidden` of them, independent, none
/// affecting a sample. `partial` is true where more directions than those listed are known to exist.
pub(super) fn with_dwells(
    prediction: &Prediction,
    shown: Option<&Asymptotics>,
    hidden: Option<usize>,
    partial: bool,
    is_psi: &dyn Fn(usize) -> bool,
) -> SpaceCheck {
    let listed = prediction.null_space.len();
    let columns: Vec<usize> = (0..prediction.unknowns.len()).collect();
    let vectors = prediction.null_space.iter();
    let rank = rank(vectors.map(|v| dense(v, &columns, is_psi, true)).collect());
    let unseen = shown.map_or(listed, |s| count_unseen(&s.seen, &prediction.null_space, is_psi));
    let measured = |n: usize| match (rank, unseen == listed) {
        (Some(r), true) => format!("{n} ({r} independent)"),
        (_, false) => format!("{n} ({unseen} of those listed are not seen)"),
        (None, true) => n.to_string(),
    };
    let outcome = match (hidden, rank) {
        _ if unseen != listed => Agreement::Disagrees,
        (Some(n), _) if listed > n || (listed < n && !partial) => Agreement::Disagrees,
        (_, Some(r)) if r < listed => Agreement::Disagrees,
        (Some(_), Some(_)) => Agreement::Agrees,
        _ => Agreement::NotResolvable,
    };
    SpaceCheck {
        what: "directions listed that are not seen with dwells either".into(),
        predicted: format!("{listed}{}", if partial { " of all" } else { "" }),
        measured: hidden.map(measured).unwrap_or_default(),
        outcome,
    }
}

/// Check of the combinations: with the unknowns of degree up to k they span the directions observable with k
/// derivatives. Each combination adds a direction to those before it.
fn combinations(
    prediction: &Prediction,
    shown: Option<&Asymptotics>,
    is_psi: &dyn Fn(usize) -> bool,
) -> SpaceCheck {
    let basis: Vec<_> = prediction.combinations.iter().filter(|c| !c.requested).collect();
    let mut out = SpaceCheck {
        what: "combinations: span what is seen, degree by degree, and are independent".into(),
        predicted: basis.len().to_string(),
        measured: String::new(),
        outcome: Agreement::NotTested,
    };
    if !prediction.all_combinations {
        return out;
    }
    let Some(Asymptotics { seen, profile: Some(profile), .. }) = shown else {
        out.outcome = Agreement::NotResolvable;
        return out;
    };
    out.outcome = Agreement::Agrees;
    let mut spanned = Vec::new();
    for (k, &dimension) in profile.iter().enumerate() {
        let pivots = &seen.pivots[..dimension.min(seen.pivots.len())];
        let unit = |c: usize| dense(&[(c, 1.0)], pivots, is_psi, false);
        let singles =
            (0..prediction.unknowns.len()).filter(|&c| prediction.unknowns[c].degree.is_some_and(|d| d <= k));
        let before: Vec<Vec<f64>> = singles
            .map(unit)
            .chain(
                basis
                    .iter()
                    .filter(|c| c.degree.is_some_and(|d| d < k))
                    .map(|c| dense(&c.terms, pivots, is_psi, false)),
            )
            .collect();
        let new: Vec<Vec<f64>> = basis
            .iter()
            .filter(|c| c.degree == Some(k))
            .map(|c| dense(&c.terms, pivots, is_psi, false))
            .collect();
        let added = new.len();
        match (rank(before.clone()), rank(before.into_iter().chain(new).collect())) {
            (Some(without), Some(with)) => {
                spanned.push(with.to_string());
                if with != dimension || without + added != with {
                    out.outcome = Agreement::Disagrees;
                }
            }
            _ => {
                spanned.push("?".into());
                if out.outcome == Agreement::Agrees {
                    out.outcome = Agreement::NotResolvable;
                }
            }
        }
    }
    let dimensions: Vec<String> = profile.iter().map(ToString::to_string).collect();
    out.measured = format!("they span {} of {}", spanned.join(" "), dimensions.join(" "));
    out
}

/// Entries at some columns of a functional, or of a change of the unknowns, with drifts in units of the earth
/// rate.
fn dense(
    terms: &[(usize, f64)],
    columns: &[usize],
    is_psi: &dyn Fn(usize) -> bool,
    change: bool,
) -> Vec<f64> {
    let d = Digits { bits: 64 };
    let scaled = functional(d, is_psi, terms, change);
    let entry =
        |c: &usize| scaled.iter().filter(|(k, _)| k == c).map(|(_, x)| super::precise::double(x)).sum();
    columns.iter().map(entry).collect()
}

/// Rank of rows, by elimination with the largest pivot; `None` where a pivot is neither clearly non-zero nor
/// rounding.
fn rank(mut rows: Vec<Vec<f64>>) -> Option<usize> {
    let size = |v: &mut dyn Iterator<Item = f64>| v.fold(0.0f64, |m, x| m.max(x.abs()));
    let columns = rows.first().map_or(0, Vec::len);
    for row in &mut rows {
        let m = size(&mut row.iter().copied());
        row.iter_mut().for_each(|x| *x /= if m > 0.0 { m } else { 1.0 });
    }
    for c in 0..columns {
        let m = size(&mut rows.iter().map(|r| r[c]));
        rows.iter_mut().for_each(|r| r[c] /= if m > 0.0 { m } else { 1.0 });
    }
    let mut rank = 0;
    loop {
        let left = (rank..rows.len()).flat_map(|i| (0..columns).map(move |c| (i, c)));
        let largest = left.max_by(|a, b| rows[a.0][a.1].abs().total_cmp(&rows[b.0][b.1].abs()));
        let Some((i, c)) = largest else { return Some(rank) };
        let pivot = rows[i][c];
        if pivot.abs() < CLEAR[1] {
            return Some(rank);
        }
        if pivot.abs() < CLEAR[0] {
            return None;
        }
        rows.swap(rank, i);
        let (top, below) = rows.split_at_mut(rank + 1);
        for row in below {
            let factor = row[c] / pivot;
            row.iter_mut().zip(&top[rank]).for_each(|(x, y)| *x -= factor * y);
            row[c] = 0.0;
        }
        rank += 1;
    }
}

/// Partners of every unknown: the unknowns in a common unobservable direction that has no shorter one within
/// it. They are the connected components of the graph of pivots and the free unknowns in their rows; the
/// components do not depend on the choice of the pivots.
pub(super) fn partners(seen: &ObservableDirections) -> Vec<Vec<usize>> {
    let n = seen.excited.len();
    let (free, rows) = seen.reduced();
    let mut part: Vec<usize> = (0..n).collect();
    for (&pivot, row) in seen.pivots.iter().zip(&rows) {
        for (&f, _) in free.iter().zip(row).filter(|(_, x)| !x.is_zero()) {
            let (from, to) = (part[f], part[pivot]);
            part.iter_mut().filter(|p| **p == from).for_each(|p| *p = to);
        }
    }
    (0..n).map(|c| (0..n).filter(|&d| d != c && part[d] == part[c]).collect()).collect()
}

/// Check of the partners of an unknown, by name.
pub(super) fn named(predicted: &[usize], measured: Option<&[usize]>, names: &[String]) -> Partners {
    let words = |list: &[usize]| list.iter().map(|&c| names[c].clone()).collect::<Vec<_>>();
    let sorted = |list: &[usize]| {
        let mut list = list.to_vec();
        list.sort_unstable();
        list
    };
    Partners {
        predicted: words(predicted),
        measured: measured.map(words),
        outcome: measured.map_or(Agreement::NotResolvable, |m| Agreement::of(sorted(predicted) == sorted(m))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_of_doubles() {
        let rows = |r: &[[f64; 3]]| r.iter().map(|x| x.to_vec()).collect::<Vec<_>>();
        assert_eq!(rank(rows(&[[1.0, 2.0, 0.0], [2.0, 4.0, 0.0], [0.0, 0.0, 1e-20]])), Some(2));
        assert_eq!(rank(rows(&[[1.0, 2.0, 3.0], [0.1, 0.2, 0.3]])), Some(1));
        assert_eq!(rank(rows(&[[1.0, 1.0, 0.0], [1.0, 1.0 + 1e-9, 0.0]])), None);
        assert_eq!(rank(vec![]), Some(0));
        assert!(same_profile(&[2, 6, 8, 8], &[2, 6, 8]) && !same_profile(&[2, 6, 8], &[2, 6]));
    }
}

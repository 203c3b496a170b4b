//! Sentences that several formats share.

pub(super) mod assumptions;
pub(super) mod run;

use std::collections::BTreeMap;

use obsdeg_core::analysis::{Analysis, Component, Quantity, Solution, term_notes};
use obsdeg_core::degree::{Difference, Form, Status, Verdict};
use obsdeg_core::model::slew::Turn;
use obsdeg_core::model::{Carry, Scheme, parse_attitude};
use obsdeg_core::solution::Verification;

use crate::document::number;

pub(crate) fn degree(d: Option<usize>) -> String {
    d.map_or_else(|| "-".into(), |k| k.to_string())
}

/// Accuracy order in a table, with the reason if there is none beside a degree.
pub(crate) fn accuracy_order(degree: Option<usize>, order: Option<usize>, computed: bool) -> String {
    match (degree, order) {
        (_, Some(k)) => k.to_string(),
        (_, None) if !computed => "not computed".into(),
        (Some(_), None) => "not with dwell".into(),
        (None, None) => "-".into(),
    }
}

/// Remark on the effect of the dwell on a degree; empty if the accuracy order equals the degree.
pub(crate) fn with_dwell(a: &Analysis, degree: Option<usize>, order: Option<usize>) -> String {
    match (degree, order) {
        _ if !a.has_accuracy_orders => String::new(),
        (Some(_), None) => "not determined".into(),
        (degree, Some(k)) if degree != Some(k) => format!("order {k}"),
        _ => String::new(),
    }
}

/// True if the dwell changes a row of the answer.
pub(crate) fn dwell_matters(a: &Analysis) -> bool {
    let unknowns = a.quantities.iter().map(|q| (q.degree, q.accuracy_order));
    let combinations = a.combinations.iter().map(|c| (c.degree, c.accuracy_order));
    unknowns.chain(combinations).any(|(degree, order)| !with_dwell(a, degree, order).is_empty())
}

pub(crate) fn list(items: &[usize]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// `2 positions, platform carry, generic latitude`.
pub(crate) fn headline(a: &Analysis) -> String {
    let n = a.positions.len();
    let latitude = a.latitude_deg.map_or_else(|| "generic latitude".into(), |l| format!("latitude {l} deg"));
    let azimuth = if a.measured_azimuth { ", azimuth measured" } else { "" };
    format!("{n} position{}, {} carry, {latitude}{azimuth}", if n == 1 { "" } else { "s" }, a.carry)
}

/// `rank 8 of 15 by derivatives; rank profile 2 6 8 with derivatives up to order 0, 1, 2`.
pub(crate) fn rank(a: &Analysis) -> String {
    let orders: Vec<String> = (0..a.rank_profile.len()).map(|k| k.to_string()).collect();
    format!(
        "rank {} of {} by derivatives; rank profile {} with derivatives up to order {}",
        a.rank,
        a.unknowns.len(),
        list(&a.rank_profile),
        orders.join(", ")
    )
}

/// `not told from D_FZ, D_OY`; a long list is cut and says so (JSON and CSV have all of it).
pub(crate) fn indistinguishable_from(partners: &[String]) -> String {
    const SHOWN: usize = 8;
    let more = partners.len().saturating_sub(SHOWN);
    let tail = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("not told from {}{tail}", partners[..partners.len() - more].join(", "))
}

/// Remark beside the verdict on an unknown: its solution or its partners, then its degree elsewhere.
pub(crate) fn explanation(q: &Quantity) -> String {
    let mut out = match (&q.solution, q.status) {
        (Some(s), _) => s.text.clone(),
        (None, Status::Inseparable) => indistinguishable_from(&q.partners),
        _ => String::new(),
    };
    if let Some(e) = &q.elsewhere {
        let mut where_else = Vec::new();
        if let Some(k) = e.other_latitudes {
            where_else.push(format!("degree {k} at other latitudes"));
        }
        if let Some(k) = e.other_angles {
            where_else.push(format!("degree {k} at other angles"));
        }
        let joint = if out.is_empty() { "" } else { "; " };
        out = format!("{out}{joint}{}", where_else.join(", "));
    }
    out
}

fn verdict(v: &Verdict) -> String {
    match (v.status, v.degree) {
        (Status::Observable, Some(k)) => format!("degree {k}"),
        (status, _) => status.to_string(),
    }
}

/// `D_FZ inseparable -> degree 1`.
pub(crate) fn difference(d: &Difference) -> String {
    format!("{} {} -> {}", d.name, verdict(&d.here), verdict(&d.there))
}

/// Unknowns that change alike, with the positions in their names.
struct DifferenceGroup<'a> {
    of: &'a Difference,
    names: Vec<(&'a str, Vec<&'a str>)>,
}

/// `D_FX, D_FZ inseparable -> degree 1; psi_x@1 to @7 degree 1 -> degree 2`: unknowns with the same change
/// are grouped.
fn differences(all: &[Difference]) -> String {
    let mut groups: Vec<DifferenceGroup<'_>> = Vec::new();
    for d in all {
        let place = groups.iter().position(|g| (g.of.here, g.of.there) == (d.here, d.there));
        let place = place.unwrap_or_else(|| {
            groups.push(DifferenceGroup { of: d, names: Vec::new() });
            groups.len() - 1
        });
        let (name, position) = d.name.split_once('@').unwrap_or((&d.name, ""));
        let names = &mut groups[place].names;
        match names.iter_mut().find(|(n, _)| *n == name) {
            Some((_, positions)) => positions.push(position),
            None => names.push((name, vec![position])),
        }
    }
    let named = |(name, positions): &(&str, Vec<&str>)| match positions[..] {
        [""] => name.to_string(),
        [one] => format!("{name}@{one}"),
        [first, .., last] if consecutive(positions) => format!("{name}@{first} to @{last}"),
        _ => format!("{name}@{}", positions.join(", @")),
    };
    let group = |g: &DifferenceGroup<'_>| {
        let names: Vec<String> = g.names.iter().map(named).collect();
        format!("{} {} -> {}", names.join(", "), verdict(&g.of.here), verdict(&g.of.there))
    };
    groups.iter().map(group).collect::<Vec<_>>().join("; ")
}

/// True if numbers, given as texts, follow each other.
fn consecutive(positions: &[&str]) -> bool {
    let numbers: Option<Vec<usize>> = positions.iter().map(|p| p.parse().ok()).collect();
    numbers.is_some_and(|n| n.windows(2).all(|pair| pair[1] == pair[0] + 1))
}

/// Reasons why candidates leave coefficients unobservable, if the terms give them.
pub(crate) fn reasons(terms: &str, candidates: &[String]) -> Vec<String> {
    let attitudes: Result<Vec<_>, _> = candidates.iter().map(|c| parse_attitude(c)).collect();
    let (Ok(unknowns), Ok(attitudes)) = (terms.parse(), attitudes) else { return Vec::new() };
    // inertial: notes on the meaning of another carry would be no reasons
    term_notes(&Scheme { carry: Carry::Inertial, unknowns, ..Scheme::of_angles(attitudes) })
}

/// Accuracy orders that differ from the degrees, one sentence for each pair of order and degree.
pub(crate) fn accuracy(a: &Analysis) -> Vec<String> {
    let unknowns = a.quantities.iter().map(|q| (&q.name, q.degree, q.accuracy_order));
    let combinations = a.combinations.iter().map(|c| (&c.expression, c.degree, c.accuracy_order));
    let mut groups: BTreeMap<(Option<usize>, Option<usize>), Vec<&str>> = BTreeMap::new();
    if a.has_accuracy_orders {
        for (name, degree, order) in unknowns.chain(combinations).filter(|(_, degree, order)| degree != order)
        {
            groups.entry((degree, order)).or_default().push(name);
        }
    }
    let sentence = |((degree, order), names): ((Option<usize>, Option<usize>), Vec<&str>)| {
        let degree = degree.map_or_else(|| "not observable by derivatives".into(), |k| format!("degree {k}"));
        let names = names.join(", ");
        match order {
            Some(order) => format!("{names}: accuracy order {order} ({degree}), error ~ T^-{order}.5"),
            None => format!("{names}: {degree}, yet not determined with dwell, during which psi moves"),
        }
    };
    groups.into_iter().map(sentence).collect()
}

/// Title of the null space.
pub(crate) const UNSEEN: &str = "Directions that derivatives of Z do not see";

/// Title of the section on accuracy orders.
pub(crate) const ACCURACY: &str =
    "Accuracy order where it differs from the degree (dwell T at every position)";

/// A bound on a probability to one digit, rounded up: `8e-23`.
pub(crate) fn at_most(bound: f64) -> String {
    let near = format!("{bound:.0e}");
    let below = near.parse::<f64>().is_ok_and(|shown| shown < bound);
    let parts = near.split_once('e').filter(|_| below);
    let parts =
        parts.and_then(|(digit, power)| Some((digit.parse::<u32>().ok()?, power.parse::<i32>().ok()?)));
    match parts {
        None => near,
        Some((9.., power)) => format!("1e{}", power + 1),
        Some((digit, power)) => format!("{}e{power}", digit + 1),
    }
}

/// A bound on the probability of an error, after "a verdict is": `wrong with probability below 8e-23`.
/// Numbers with very many digits leave none below one.
pub(crate) fn wrong_below(bound: f64) -> String {
    if bound < 1.0 {
        format!("wrong with probability below {}", at_most(bound))
    } else {
        "without a bound on the probability of an error (numbers with fewer digits have one)".into()
    }
}

/// Sentence on the certainty of verdicts and solutions.
pub(crate) fn certainty(a: &Analysis) -> String {
    let c = &a.certainty;
    let mut out = format!(
        "{} (p = {}, {}; seed {}): a verdict is {}",
        c.method,
        c.primes[0],
        c.primes[1],
        c.seed,
        wrong_below(c.error_bound)
    );
    let solutions: Vec<&Solution> = a
        .quantities
        .iter()
        .filter_map(|q| q.solution.as_ref())
        .chain(a.combinations.iter().filter_map(|c| c.solution.as_ref()))
        .collect();
    for (kind, how) in [
        (Verification::Symbolic, "by exact substitution"),
        (Verification::Modular, "by substitution in both prime fields"),
        (Verification::Numeric, "by substitution in floating point"),
    ] {
        let n = solutions.iter().filter(|s| s.verification == kind).count();
        if n > 0 {
            out.push_str(&format!("; {n} solution{} verified {how}", if n == 1 { "" } else { "s" }));
        }
    }
    let decimals = solutions.iter().filter(|s| s.form == Form::Decimal).count();
    if decimals > 0 {
        out.push_str(&format!("; {decimals} with coefficients as decimals, rounded to six places"));
    }
    out
}

/// The unknowns that are not excited.
pub(crate) fn not_excited(a: &Analysis) -> Vec<&str> {
    a.quantities.iter().filter(|q| q.status == Status::NotExcited).map(|q| q.name.as_str()).collect()
}

/// A null vector as `psi_y = 1, D_FZ = wN`.
pub(crate) fn null_vector(v: &[Component]) -> String {
    let part = |c: &Component| match &c.coefficient {
        Some(k) => format!("{} = {k}", c.name),
        None => c.name.clone(),
    };
    let turned = if rotates_the_axes(v) {
        " (all that is mounted turns: a rotation of the platform axes)"
    } else {
        ""
    };
    format!("{}{turned}", v.iter().map(part).collect::<Vec<_>>().join(", "))
}

/// True if a direction is a rotation of the platform axes: only psi and misalignments of gyros and
/// accelerometers change, these by antisymmetric parts.
fn rotates_the_axes(v: &[Component]) -> bool {
    let number = |name: &str| {
        let found = v.iter().find(|c| c.name == name);
        found.map_or(Some(0.0), |c| c.coefficient.as_ref()?.parse::<f64>().ok())
    };
    let odd = |family: &str| {
        ["XY", "YZ", "ZX"].iter().all(|pair| {
            let (there, back) =
                (format!("{family}_{pair}"), format!("{family}_{}{}", &pair[1..], &pair[..1]));
            matches!((number(&there), number(&back)), (Some(x), Some(y)) if x == -y)
        })
    };
    let of = |family: &str| v.iter().any(|c| c.name.starts_with(family));
    let only = v.iter().all(|c| ["psi_", "GM_", "M_"].iter().any(|f| c.name.starts_with(f)));
    only && of("psi_") && of("GM_") && of("M_") && odd("GM") && odd("M")
}

/// Note on the list of degenerate angles.
pub(crate) fn loci(loci: &[obsdeg_core::solution::Locus]) -> String {
    let held = match loci.is_empty() {
        true => "none was found: a determinant would vanish there, and",
        false => "a determinant vanishes there, and",
    };
    format!(
        "({held} at a random point of each, in two prime fields, ranks or verdicts differ from those above; \
         what needs two equations at once is not sought; degrees that are not whole are rounded)"
    )
}

/// A locus as `alpha = 0 deg: rank profile 2 4 5; D_FX degree 1 -> not observable`.
pub(crate) fn locus(l: &obsdeg_core::solution::Locus) -> String {
    let changes: Vec<String> = l.changes.iter().map(difference).collect();
    let changes = if changes.is_empty() { String::new() } else { format!("; {}", changes.join("; ")) };
    format!("{}: rank profile {}{changes}", l.condition, list(&l.rank_profile))
}

/// Names, at most a dozen of them.
pub(crate) fn names<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    const SHOWN: usize = 12;
    let all: Vec<&str> = names.into_iter().collect();
    let more = all.len().saturating_sub(SHOWN);
    let tail = if more > 1 { format!(" and {more} more") } else { String::new() };
    let shown = if more > 1 { SHOWN } else { all.len() };
    format!("{}{tail}", all[..shown].join(", "))
}

/// A direction in n as `N`, `-U`, `N-E` or `0.6N+0.8U`.
pub(crate) fn direction(v: &[f64; 3]) -> String {
    let largest = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let plain = v.iter().all(|x| x.abs() < 1e-9 || x.abs() > largest - 1e-9);
    let part = |(x, letter): (&f64, char)| {
        let size = if plain { String::new() } else { format!("{:.3}", x.abs()) };
        let shown = x.abs() >= if plain { 1e-9 } else { 5e-4 };
        let size = if size.contains('.') { size.trim_end_matches('0').trim_end_matches('.') } else { "" };
        shown.then(|| format!("{}{size}{letter}", if *x < 0.0 { '-' } else { '+' }))
    };
    let text: String = v.iter().zip(['N', 'U', 'E']).filter_map(part).collect();
    text.strip_prefix('+').unwrap_or(&text).to_string()
}

/// Probability with its digits, or `below 1e-9`.
pub(crate) fn chance(p: f64) -> String {
    if p < 1e-9 { "below 1e-9".into() } else { number(p) }
}

/// `180 deg about -N`.
pub(crate) fn turn(t: &Turn) -> String {
    format!("{} deg about {}", (t.angle_deg * 100.0).round() / 100.0, direction(&t.about))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The printed bound is no smaller than the bound, and at most a digit above.
    #[test]
    fn bounds_are_rounded_up() {
        let cases = [(8.4e-23, "9e-23"), (8e-23, "8e-23"), (9.5e-5, "1e-4"), (9.001e-1, "1e0"), (0.0, "0e0")];
        for (x, said) in cases {
            assert_eq!(at_most(x), said);
        }
        for k in 0..500 {
            let x = 10f64.powf(-0.0737 * f64::from(k)) * 1.3;
            let said: f64 = at_most(x).parse().expect("a number");
            assert!(said >= x && said <= 2.0 * x, "{x}: {said}");
        }
    }

    #[test]
    fn directions_read_as_sums_of_axes() {
        let r = 0.5f64.sqrt();
        for (v, expected) in [
            ([1.0, 0.0, 0.0], "N"),
            ([0.0, -1.0, 0.0], "-U"),
            ([r, 0.0, -r], "N-E"),
            ([-r, -r, 1e-17], "-N-U"),
            ([0.6, 0.0, -0.8], "0.6N-0.8E"),
            ([-0.1234567, 0.99235, 1e-7], "-0.123N+0.992U"),
        ] {
            assert_eq!(direction(&v), expected);
        }
    }
}

//! Bounds on a criterion, and the fewest positions, in sentences.

use obsdeg_core::model::Carry;
use obsdeg_design::design::{Certificate, Design, EverywhereReport, Rounded, SearchReport, Weight};

use super::terms::searched;
use super::terms::shortened;
use crate::document::number;
use crate::excess::Excess;
use crate::words;

/// Criterion of the first scheme of the search; not a number if there is none.
fn first_value(d: &Design) -> f64 {
    d.found.iter().find(|f| !f.refined && f.dwells_s.is_empty()).map_or(f64::NAN, |f| f.value)
}

/// Criterion of the first scheme of the search: its excess over the bound for the candidates, and over that
/// for all attitudes.
pub(super) fn first_above(d: &Design, c: &Certificate) -> (Excess, Option<Excess>) {
    let first = first_value(d);
    let every = c.everywhere.as_ref().map(|e| Excess::new(first, e.best_possible, e.within_percent));
    (Excess::new(first, c.best_possible, c.within_percent), every)
}

/// Sentences on the bound of the criterion, and on how close to it the found schemes are.
pub(super) fn bound(d: &Design, s: &SearchReport) -> Vec<String> {
    let Some(c) = &s.certificate else { return vec![no_bound(d, s)] };
    let (above_candidates, above_all) = first_above(d, c);
    let mut out = bound_of_candidates(d, s, c, &above_candidates);
    out.push(format!("weights, as parts of their sum: {}", weights(&c.weights)));
    let Some((every, above)) = c.everywhere.as_ref().zip(above_all) else {
        out.push("of all attitudes: no bound was computed".into());
        return out;
    };
    out.push(bound_of_all_attitudes(d, s, &above));
    out.push(weights_on_all_attitudes(every));
    let ratio = c.best_possible / every.attained;
    match &every.rounded {
        Some(rounded) => out.extend(cost_of_rounding(d, rounded)),
        None if ratio > FAR => out.push(format!(
            "these candidates cost: weights on other attitudes, as if positions could be divided, would \
             reach a criterion {ratio:.2} times smaller than any scheme of these has (--candidates free or \
             --refine look for them; so few positions may not come near it)"
        )),
        None => {}
    }
    out
}

/// Sentence on the reason why there is no bound.
fn no_bound(d: &Design, s: &SearchReport) -> String {
    match s.order_matters {
        _ if s.conditions.accelerometer_bias.is_some() => {
            "not known: the noise of Z is correlated from position to position, so the information of a \
             scheme is no sum over its positions, and no bound is computed"
                .into()
        }
        true => format!(
            "not known: under {} carry the information of a scheme is no sum over its positions, and no \
             bound is computed",
            d.carry
        ),
        false if s.interrupted => "not known: interrupted".into(),
        false => "not known: the weights of the candidates prove nothing here".into(),
    }
}

/// Sentences on the bound for the candidates.
fn bound_of_candidates(d: &Design, s: &SearchReport, c: &Certificate, above: &Excess) -> Vec<String> {
    let first = searched(d);
    let Excess { value, bound, percent } = above;
    let beyond = match s.proven {
        true => format!("{percent} above that bound"),
        false => format!("at most {percent} above the best of them"),
    };
    vec![
        format!(
            "proven by a bound, without a search: no scheme of {} of these candidates in equal dwells, of \
             whatever degrees, has a criterion below {bound}; {first}, of {value}, is {beyond} ({} {:.6} at \
             least)",
            s.positions,
            if s.criterion == "D" { "D-efficiency" } else { "efficiency, the square of the ratio," },
            (c.efficiency * 1e6).floor() / 1e6
        ),
        format!(
            "the bound is by optimal weights of the candidates (approximate design theory), as if positions \
             could be divided: those listed would reach {}, and this way of bounding gives no more",
            number(c.attained)
        ),
    ]
}

/// Sentence on the bound for all attitudes.
fn bound_of_all_attitudes(d: &Design, s: &SearchReport, above: &Excess) -> String {
    let first = searched(d);
    format!(
        "proven by a bound, of all attitudes: no scheme of {} attitudes whatever in equal dwells has a \
         criterion below {}{}; {first}, of {}, is {} above that, and what lies between is left open: so few \
         positions may not reach the bound (attitudes that add most are sought on a net; between its points \
         what they add is bounded as a trigonometric polynomial, and a part of 1e-8 is assumed for \
         rounding)",
        s.positions,
        above.bound,
        if s.criterion == "margin" { ", requirements on psi left out" } else { "" },
        above.value,
        above.percent
    )
}

/// Sentence on the best weights on all attitudes.
fn weights_on_all_attitudes(every: &EverywhereReport) -> String {
    let lighter = match every.lighter {
        0 => String::new(),
        n => format!("; {n} lighter ones, {} together, are not listed", number(every.lighter_weight)),
    };
    format!(
        "weights on {} attitudes, as parts of their sum, would reach {}: {}{lighter}",
        every.weights.len() + every.lighter,
        number(every.attained),
        weights(&every.weights)
    )
}

/// Sentences on angles that are rounded, and on the cost of rounding.
fn cost_of_rounding(d: &Design, rounded: &Rounded) -> [String; 2] {
    let on_a_grid = format!(
        "the candidates are the cardinal attitudes, and those of weights and of schemes near them \
         with angles rounded to {} deg; every criterion listed is that of the angles as they are \
         listed",
        rounded.step_deg
    );
    let cost = match &rounded.finer {
        Some(finer) => {
            let cost = Excess::new(first_value(d), finer.value, 0.0);
            format!(
                "rounding costs {}: with angles in hundredths of a degree a criterion of {} was \
                 found, and here {}, at {}",
                cost.percent,
                cost.bound,
                cost.value,
                finer.angles.join(" ")
            )
        }
        None => "rounding costs nothing that was found: no better scheme with angles in hundredths \
                 of a degree"
            .into(),
    };
    [on_a_grid, cost]
}

/// `0.25 each of NUE NDW; 0.1 of WUN`: equal weights together, largest first.
fn weights(list: &[Weight]) -> String {
    let mut sorted: Vec<_> = list.iter().collect();
    sorted.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    let groups = sorted.chunk_by(|a, b| a.weight == b.weight);
    let group = |of: &[&Weight]| {
        let names: Vec<String> = of.iter().map(|w| w.candidate.clone()).collect();
        format!("{}{} {}", of[0].weight, if of.len() > 1 { " each of" } else { " of" }, shortened(&names))
    };
    groups.map(group).collect::<Vec<_>>().join("; ")
}

/// Factor of the criterion from which the candidates are said to be worse than other attitudes.
const FAR: f64 = 1.1;

/// The answer of `design --minimum` in a sentence.
pub(super) fn fewest(d: &Design) -> String {
    let m = &d.minimum;
    let proven = if m.proven { "proven" } else { "not proven" };
    match m.positions {
        _ if !m.never.is_empty() => {
            format!(
                "No number of these candidates is enough: {} stay unobservable; {proven}",
                words::names(m.never.iter().map(String::as_str))
            )
        }
        Some(1) => format!("1 position is needed; {proven}"),
        Some(k) if m.proven => format!("{k} positions are needed; proven"),
        Some(k) => format!("{k} positions are enough; that fewer are not is not proven"),
        None => "How many positions are needed is not known".into(),
    }
}

pub(super) fn minimum(d: &Design) -> Vec<String> {
    let m = &d.minimum;
    let chance = format!("not proven: wrong with a probability of up to {}", words::at_most(d.error_bound));
    if !m.never.is_empty() {
        let never = format!("all candidates together leave {} unobservable", m.never.join(", "));
        let reasons = words::reasons(&d.terms, &d.candidates);
        return std::iter::once(never).chain((!m.proven).then_some(chance)).chain(reasons).collect();
    }
    let mut out = match m.positions {
        Some(k) => vec![format!("{k} positions: {}", m.witness.join(" "))],
        None if d.search.as_ref().is_some_and(|s| s.degree_floor.is_none()) => {
            vec!["not asked: torquer errors act in every turn (see `obsdeg design --minimum`)".into()]
        }
        None => vec!["not known: the sets are too many to examine all".into()],
    };
    out.extend((m.positions.is_some() && !m.proven).then_some(chance));
    if m.counting_bound > 1 {
        out.push(format!(
            "fewer than {} cannot do: a position adds at most {} independent derivative rows{}, and {} \
             coefficients are required",
            m.counting_bound,
            m.rows_per_position,
            if d.carry == Carry::Reset { " besides those that its own psi takes" } else { "" },
            d.required.len()
        ));
    }
    let images = if d.symmetry > 1 { ", up to turns of the platform axes" } else { "" };
    for [size, sets] in &m.none_of {
        out.push(format!("none of the {sets} sets of {size} does (exact ranks, every set examined{images})"));
    }
    out
}

//! Documents and figures of found schemes.

use obsdeg_core::model::Carry;
use obsdeg_design::design::{
    BiasPoint, Certificate, Design, EverywhereReport, Found, PartsReport, Rounded, SearchReport, TiesReport,
    Weight,
};

use obsdeg_evidence::requirements::{Miss, Requirements};

use crate::document::{Document, DocumentBlock, left, number, right};
use crate::excess::Excess;
use crate::figure::{BLACK, BLUE, Curve, Figure, FigureError, Stroke};
use crate::figures::{File, picture};
use crate::{Answer, gimbals, omitted, stated, words};

fn criterion(name: &str) -> &'static str {
    match name {
        "A" => {
            "A: root of the mean variance of the coefficients (psi is estimated with them and does not count)"
        }
        "D" => {
            "D: geometric mean of the principal sigmas of the coefficients (psi is estimated with them and \
             does not count)"
        }
        "E" => {
            "E: largest principal sigma of the coefficients (psi is estimated with them and does not count)"
        }
        "margin" => {
            "margin: largest sigma over what is required, of psi too where every coefficient is asked for; \
             up to 1 all requirements are met"
        }
        _ => "worst: largest sigma of a coefficient (psi is estimated with them and does not count)",
    }
}

/// ` [deg/h, /g]`: the unit of the criterion, if it has one.
fn unit(s: &SearchReport) -> String {
    match s.unit.as_deref() {
        Some(unit @ ("deg/h" | "ug")) => format!(" [{unit}, /g]"),
        Some(unit) => format!(" [{unit}]"),
        None => String::new(),
    }
}

/// `NUE (-N) NDW`: the positions in order, with the axes of the half turns between them.
fn route(f: &Found) -> String {
    let mut out = Vec::new();
    for (i, position) in f.positions.iter().enumerate() {
        let turn = f.half_turns.iter().find(|t| t.to == i + 1);
        out.extend(turn.map(|t| format!("({})", words::direction(&t.about))));
        out.push(position.clone());
    }
    out.join(" ")
}

/// `0.5 (psi_y)`, and the unknowns without a margin.
fn margin(r: &Requirements) -> String {
    let unseen: Vec<&str> =
        r.missed.iter().filter(|m| m.why != Miss::TooLarge).map(|m| m.name.as_str()).collect();
    let none = (!unseen.is_empty()).then(|| format!("none ({})", words::names(unseen)));
    none.or_else(|| stated::worst_margin(r)).unwrap_or_else(|| "-".into())
}

/// First lines: the first scheme and its requirements, then the carry and the conditions that are not stated.
fn lead(d: &Design) -> Vec<String> {
    let mut out = Vec::new();
    if let (Some(s), Some(first)) = (&d.search, d.found.first()) {
        let best = match s.proven && !first.refined && first.dwells_s.is_empty() {
            true if by_parts(s).is_some() => "Best, proven if the parts were searched as they state,",
            true => "Proven best of these candidates",
            false => "Best found",
        };
        let sigma = first.worst_sigma_dph.zip(first.worst.as_ref());
        let sigma = sigma.map_or_else(String::new, |(sigma, name)| {
            format!(": {} {}", stated::worst(&first.requirements), stated::sigma_of(name, sigma))
        });
        // a scheme with a smaller criterion and a larger worst degree comes later
        let first_by = if s.degree_floor.is_some() { "worst degree, then " } else { "" };
        let by = format!("{best} by {first_by}the criterion {}", s.criterion);
        out.push(format!("{by}: {}{sigma}; {}.", route(first), stated::requirements(&first.requirements)));
        let met = first.requirements.all_met();
        out.extend(d.omitted.as_ref().and_then(|o| omitted::lead(o, first.requirements.with_bench, met)));
        out.extend(s.ranked.map(|n| {
            format!(
                "The search does not count what is not estimated under these conditions: the {n} schemes of \
                 least sigma were ranked by their total uncertainty. No bound and no proof counts, and a \
                 scheme with a larger sigma may have a smaller total."
            )
        }));
        if first.requirements.any_missed() {
            let margin =
                if s.criterion == "margin" { "" } else { "--criterion margin seeks the largest margin; " };
            out.push(format!("Next: {margin}--meet says what would meet every requirement"));
        }
    }
    if d.search.is_none() {
        out.push(fewest(d));
    }
    if !d.not_judged.is_empty() {
        let names = words::names(d.not_judged.iter().map(String::as_str));
        out.push(format!(
            "not judged, since --observable does not ask for them: the requirements on {names}"
        ));
    }
    out.extend(gimbals::lead(d.gimbals.as_ref()));
    out.push(stated::carry(d.carry).into());
    out.extend(stated::other_carries(&d.other_carries));
    out.extend(d.search.as_ref().and_then(|s| stated::by_default(&s.conditions)));
    out
}

/// The parts of a search; `None` if every block of them was searched again.
fn by_parts(s: &SearchReport) -> Option<&PartsReport> {
    s.parts.as_ref().filter(|parts| !parts.is_repeated())
}

/// Sentence on the merged parts and on the blocks of them that were searched again.
fn parts(p: &PartsReport) -> String {
    let again = match (p.searched_again, p.is_repeated()) {
        (_, true) => format!("all {} blocks of starts were searched again with the same result", p.blocks),
        (0, _) => format!("no block of starts of {} was searched again (--check N)", p.blocks),
        (n, _) => format!(
            "{n} of {} blocks of starts, chosen at random, were searched again with the same result",
            p.blocks
        ),
    };
    format!(
        "put together from {} parts, searched by version {}: what they list was evaluated again, their \
         starts and counts add up; {again}",
        p.parts,
        p.versions.join(", ")
    )
}

/// ` (900, 1100 s)`: dwells that are not equal.
fn dwells(f: &Found) -> String {
    let listed: Vec<String> = f.dwells_s.iter().map(|s| number(*s)).collect();
    if listed.is_empty() { String::new() } else { format!(" ({} s)", listed.join(", ")) }
}

/// Name of the scheme that a refined or divided one started from: the first of the search.
fn searched(d: &Design) -> &'static str {
    match (d.found.iter().any(|f| f.refined), d.found.iter().any(|f| !f.dwells_s.is_empty())) {
        (false, false) => "the first",
        (true, false) => "the first that is not refined",
        (false, true) => "the first of equal dwells",
        (true, true) => "the first of equal dwells that is not refined",
    }
}

fn table(heading: &str, found: &[Found]) -> DocumentBlock {
    let row = |(i, f): (usize, &Found)| {
        let image = f.image_of.map_or_else(String::new, |of| format!(" (image of {of})"));
        vec![
            (i + 1).to_string(),
            format!("{}{}{}{image}", route(f), if f.refined { " (refined)" } else { "" }, dwells(f)),
            number(f.total_s),
            f.worst_degree.to_string(),
            f.worst_accuracy_order.map_or_else(|| "-".into(), |o| o.to_string()),
            number(f.value),
            f.worst_sigma_dph
                .zip(f.worst.as_ref())
                .map_or_else(|| "-".into(), |(sigma, name)| format!("{} ({name})", number(sigma))),
            margin(&f.requirements),
            format!("{} of {}", f.rank[0], f.rank[1]),
        ]
    };
    DocumentBlock::table(
        heading,
        [
            right(""),
            left("positions in order"),
            right("total [s]"),
            right("degree"),
            right("accuracy"),
            right("criterion"),
            left("worst sigma [deg/h, /g]"),
            left("worst margin"),
            right("rank by derivatives"),
        ],
        found.iter().enumerate().map(row),
    )
}

/// Gimbal angles that the operator sets at each position of a scheme.
fn gimbal_angles(f: &Found) -> DocumentBlock {
    let columns =
        [left(""), left("position")].into_iter().chain(gimbals::NAMES.map(right)).collect::<Vec<_>>();
    let row = |(i, (name, angles)): (usize, (&String, &String))| {
        let set = angles.split(',').map(String::from);
        [format!("p{}", i + 1), name.clone()].into_iter().chain(set).collect::<Vec<_>>()
    };
    let rows = f.positions.iter().zip(&f.angles).enumerate().map(row);
    DocumentBlock::table("Gimbal angles of the first [deg]", columns, rows)
}

/// Sentences on the search and the order of the schemes.
fn how(d: &Design, s: &SearchReport) -> Vec<String> {
    let mut out = vec![searched_how(d, s)];
    out.extend(s.parts.as_ref().map(parts));
    if d.found.iter().any(|f| f.image_of.is_some()) {
        out.push(
            "images of a scheme listed before them are that scheme in other platform axes (coefficients \
             renamed): what is true of one is true of all"
                .into(),
        );
    }
    if s.ties.is_some() && s.interrupted {
        out.push("interrupted before the front was complete".into());
    }
    if s.lost > 0 {
        out.push(format!(
            "{} of them are observable by the exact verdict (of repositioning at once), but their samples{} \
             do not determine what is required, as far as double precision tells: they count as worse than \
             all others",
            s.lost,
            if s.conditions.slew_rate_deg_s.is_some() { " with the slews" } else { "" }
        ));
    }
    out.extend(s.ties.map(equally_good));
    out.push(orders_of_positions(d, s).into());
    if s.conditions.slew_rate_deg_s.is_some() {
        out.push(
            match s.degree_floor {
                Some(_) => {
                    "degrees, accuracy orders, ranks and the fewest positions are those of repositioning at \
                     once; only what is observable so is listed, and its samples determine it with the \
                     slews; what slews alone would determine is not sought"
                }
                None => {
                    "degrees, accuracy orders and ranks are those of turns fast against the earth rate, in \
                     which torquer errors act; only what is observable so is listed, and its samples \
                     determine it with the slews"
                }
            }
            .into(),
        );
        out.push(
        "half turns are tried in both directions, which are different schemes: the axis about which they \
         are right-handed stands before the position"
            .into(),
        );
    }
    out.push(order_of_schemes(s));
    out.extend(s.constraints.iter().map(|c| format!("constraint: {c}")));
    out
}

/// Number of sequences that were evaluated and excluded.
fn evaluated(d: &Design, s: &SearchReport) -> String {
    let images = if d.symmetry > 1 {
        format!(
            ", one of every {} that turns of the platform axes make of each other (coefficients renamed)",
            d.symmetry
        )
    } else {
        String::new()
    };
    match s.excluded {
        0 => format!("{} evaluated{images}", s.examined),
        excluded => format!(
            "{} evaluated, {excluded} excluded by a bound on what their last two positions can add{images}",
            s.examined
        ),
    }
}

/// Sentence on the search: proven, exhaustive, interrupted or by exchange.
fn searched_how(d: &Design, s: &SearchReport) -> String {
    if s.proven {
        proven_best(d, s)
    } else if s.ties.is_some() {
        exhausted(d, s)
    } else {
        exchanged(d, s)
    }
}

/// Sentence on a proven best scheme.
fn proven_best(d: &Design, s: &SearchReport) -> String {
    let evaluated = evaluated(d, s);
    let unrefined = searched(d);
    let if_searched = by_parts(s).map_or("", |_| ", if the parts were searched as they state");
    format!(
        "{unrefined} is proven to be the best of these {} candidates{if_searched}, by {}: of all \
         sequences of {} of them within the constraints none has a smaller worst degree, or the same and \
         a smaller criterion ({evaluated}); other attitudes, dwells and numbers of positions are left \
         open",
        d.candidates.len(),
        if s.excluded > 0 { "exhaustion with a bound" } else { "exhaustion" },
        s.positions
    )
}

/// Sentence on a search of all sequences that proves nothing.
fn exhausted(d: &Design, s: &SearchReport) -> String {
    let evaluated = evaluated(d, s);
    if s.ranked.is_some() {
        format!(
            "not proven: all sequences were searched by sigma alone ({evaluated}), without what is not \
             estimated"
        )
    } else {
        format!(
            "not proven: all sequences were searched ({evaluated}), but one may be overlooked with a \
             probability of up to {}",
            words::at_most(d.error_bound)
        )
    }
}

/// Sentence on a search of some sequences.
fn exchanged(d: &Design, s: &SearchReport) -> String {
    let known = s.certificate.as_ref().map(|c| {
        format!("at most {} above the best of these candidates, by a bound", first_above(d, c).0.percent)
    });
    if s.interrupted {
        let known = known.map_or_else(String::new, |k| format!(", {k}"));
        format!("interrupted after {} sequences: the best so far{known}", s.examined)
    } else {
        let known = known.map_or_else(String::new, |k| format!("; {k}"));
        let rounded =
            s.certificate.as_ref().and_then(|c| c.everywhere.as_ref()).is_some_and(|e| e.rounded.is_some());
        let by = match rounded {
            true => {
                "schemes of the cardinal attitudes, of the weights' and random ones, exchanged and moved on \
                 the grid of rounded angles"
            }
            false => "coordinate exchange from random starts",
        };
        let all =
            s.sequences.map_or_else(String::new, |n| format!("; --within 0 searches all {n} sequences"));
        format!("not proven: {by}, {} sequences examined{known}{all}", s.examined)
    }
}

/// Sentence on sequences that are as good as the best.
fn equally_good(t: TiesReport) -> String {
    match t.sequences {
        1 => format!(
            "no other sequence is as good (worst degree equal, criterion within {:e} of it)",
            t.within
        ),
        n => format!(
            "{n} sequences are as good, itself and its images counted (worst degree equal, criterion within \
             {:e} of it)",
            t.within
        ),
    }
}

/// Sentence on orders of the same positions.
fn orders_of_positions(d: &Design, s: &SearchReport) -> &'static str {
    if s.order_matters && d.carry == Carry::Reset {
        "orders of the same positions are different schemes: the noise of Z is correlated from one to \
         the next; a position may be repeated"
    } else if s.order_matters {
        "orders of the same positions are different schemes: the dwell lets psi move in between; a \
         position may be repeated"
    } else {
        "the order of positions does not matter under reset carry; a position may be repeated"
    }
}

/// Sentence on the order of schemes: worst degree and criterion.
fn order_of_schemes(s: &SearchReport) -> String {
    let by = match s.conditions.bench {
        Some(_) => format!("{}; with the bench a sigma is a total uncertainty", criterion(&s.criterion)),
        None => criterion(&s.criterion).into(),
    };
    match s.degree_floor {
        Some(floor) => format!(
            "a smaller worst degree comes first (no scheme of these candidates is below {floor}), then the \
             criterion, {by}"
        ),
        None => format!(
            "torquer errors act in every turn, so that only a whole scheme has degrees: schemes are ordered \
             by the criterion alone, {by}; what is listed is observable by the exact verdict"
        ),
    }
}

/// Criterion of the first scheme of the search; not a number if there is none.
fn first_value(d: &Design) -> f64 {
    d.found.iter().find(|f| !f.refined && f.dwells_s.is_empty()).map_or(f64::NAN, |f| f.value)
}

/// Criterion of the first scheme of the search: its excess over the bound for the candidates, and over that
/// for all attitudes.
fn first_above(d: &Design, c: &Certificate) -> (Excess, Option<Excess>) {
    let first = first_value(d);
    let every = c.everywhere.as_ref().map(|e| Excess::new(first, e.best_possible, e.within_percent));
    (Excess::new(first, c.best_possible, c.within_percent), every)
}

/// Sentences on the bound of the criterion, and on how close to it the found schemes are.
fn bound(d: &Design, s: &SearchReport) -> Vec<String> {
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
fn fewest(d: &Design) -> String {
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

fn minimum(d: &Design) -> Vec<String> {
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

/// Conditions of the sigmas, one sentence each.
fn conditions(d: &Design, s: &SearchReport) -> Vec<String> {
    let c = &s.conditions;
    let slews = c.slew_rate_deg_s.map_or_else(
        || "repositioning at once".into(),
        |r| format!("slews at {r} deg/s about the eigenaxis, Z not used meanwhile"),
    );
    let azimuth = c.azimuth_noise_deg.map_or_else(String::new, |a| format!(", azimuth {a:e} deg per sample"));
    let bias = c.accelerometer_bias.as_ref();
    let bias = bias.map_or_else(String::new, |b| format!(", {}, counted", words::accelerometer_bias(b)));
    let none = |what: &Option<String>| what.clone().unwrap_or_else(|| "none".into());
    vec![
        format!(
            "{} s at each position, steps of at most {} s, a sample after each; {slews}",
            c.dwell_s, c.step_s
        ),
        format!(
            "noise of Z {:e} g per sample and axis{azimuth}{bias}; random drift: {}; prior: {}",
            c.accelerometer_noise_g,
            none(&s.drift_noise),
            s.prior.as_ref().map_or_else(
                || "none".into(),
                |p| format!(
                    "{p} (deg, deg/h, ... as stated; counted in sigmas and the bound, not in what is \
                     observable)"
                )
            )
        ),
        format!(
            "estimated together: psi and all coefficients of the terms {}; {}",
            d.terms,
            words::gyros(&d.geometry)
        ),
    ]
}

/// Front of sigma against bias; `None` if the search counts no bench.
fn bias_front(d: &Design, s: &SearchReport) -> Option<DocumentBlock> {
    let row = |p: &BiasPoint| vec![p.positions.join(" "), number(p.sigma), number(p.bias), number(p.total)];
    let unit = s.unit.as_ref().map_or_else(|| "over what is required".into(), |u| format!("in {u}"));
    let how = match d.bias_front_complete {
        true => "of all sequences",
        false => "by exchange with other sizes of the bench, not proven",
    };
    // the largest sigma and the largest bias of the best scheme may belong to different coefficients
    let best = d.found.first().filter(|f| !d.bias_front.iter().any(|p| p.positions == f.positions));
    let best = best.map_or("", |_| "; the best by the total is not on it");
    let heading = format!(
        "Front of sigma against bias by the bench: criterion {} of each and of the total, {unit} ({how}{best})",
        s.criterion
    );
    let columns = [left("positions"), right("sigma"), right("bias"), right("total")];
    (!d.bias_front.is_empty()).then(|| DocumentBlock::table(heading, columns, d.bias_front.iter().map(row)))
}

impl Answer for Design {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let mut blocks = Vec::new();
        if let Some(s) = &self.search {
            let judged = self.found.first().is_some_and(|f| f.requirements.stated > 0);
            let left_out: &[&str] = if judged { &[] } else { &["worst margin"] };
            let heading = format!("Best schemes ({})", stated::predicted(&s.conditions));
            blocks.push(table(&heading, &self.found).without(left_out));
            blocks.extend(self.found.first().map(gimbal_angles));
            blocks.extend(gimbals::block(self.gimbals.as_ref()));
            blocks.extend(self.omitted.iter().flat_map(|o| omitted::blocks(o, " by the first scheme")));
            blocks.extend(bias_front(self, s));
            blocks.push(DocumentBlock::list("How", how(self, s)));
            blocks.push(DocumentBlock::list("How good the best can be", bound(self, s)));
            blocks.push(
                table(
                    "Front of total time against the criterion (other dwells by exchange, not proven)",
                    &self.front,
                )
                .without(left_out),
            );
        }
        blocks.push(DocumentBlock::list(
            "Fewest positions that make every required coefficient observable",
            minimum(self),
        ));
        let by = if self.latitude_by_default { " (chosen here: nothing names one)" } else { "" };
        let mut assumed =
            vec![format!("{} carry, latitude {} deg{by}; seed {}", self.carry, self.latitude_deg, self.seed)];
        match &self.search {
            Some(s) => assumed.extend(conditions(self, s)),
            None => assumed.push(format!("terms {}; {}", self.terms, words::gyros(&self.geometry))),
        }
        assumed.push(format!("required: {}", self.required.join(", ")));
        assumed.push(candidates(&self.candidates));
        if !self.beyond_gimbals.is_empty() {
            assumed.push(format!("beyond the gimbal limits: {}", shortened(&self.beyond_gimbals)));
        }
        assumed.push(format!(
        "ranks of sets modulo {} random 61-bit primes: an observable set is overlooked with probability below {}",
        self.primes, words::at_most(self.error_bound)
    ));
        blocks.push(DocumentBlock::list("Assumed", assumed));
        let what = self.search.as_ref().map_or_else(
            || "fewest positions".into(),
            |s| format!("{} of {} positions", s.positions, self.candidates.len()),
        );
        Document { title: format!("Design: {what}, {} carry", self.carry), lead: lead(self), blocks }
    }

    fn sentences(&self) -> Vec<String> {
        lead(self)
    }

    fn main_table(&self) -> &'static str {
        if self.found.is_empty() { "answer" } else { "found" }
    }
}

fn candidates(names: &[String]) -> String {
    format!("{} candidates: {}", names.len(), shortened(names))
}

/// Names, at most thirty of them.
fn shortened(names: &[String]) -> String {
    const SHOWN: usize = 30;
    let more =
        if names.len() > SHOWN { format!(" ... ({} more)", names.len() - SHOWN) } else { String::new() };
    format!("{}{more}", names.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(" "))
}

/// Lower bound of the criterion over total time.
pub(crate) fn bound_line(bound: &[[f64; 2]]) -> Curve {
    Curve {
        label: "no scheme of the candidates in equal dwells is below".into(),
        color: BLACK,
        stroke: Stroke::Dashed,
        points: bound_steps(bound),
    }
}

/// Steps of a bound: between two times the bound of the longer holds, since more time is never worse.
pub(crate) fn bound_steps(bound: &[[f64; 2]]) -> Vec<(f64, f64)> {
    let steps = bound.windows(2).flat_map(|w| [(w[0][0], w[0][1]), (w[0][0], w[1][1])]);
    steps.chain(bound.last().map(|p| (p[0], p[1]))).collect()
}

/// Front of total time against the criterion; empty without a search.
pub(crate) fn figures(d: &Design) -> Result<Vec<File>, FigureError> {
    let Some(search) = d.search.as_ref().filter(|_| !d.front.is_empty()) else { return Ok(Vec::new()) };
    // lines per number of positions, and the front itself as steps
    let steps = d.front.windows(2).flat_map(|w| [(w[0].total_s, w[0].value), (w[1].total_s, w[0].value)]);
    let last = d.front.last().map(|f| (f.total_s, f.value));
    let quantity = match search.conditions.bench {
        Some(_) => "largest total uncertainty",
        None => "largest sigma",
    };
    let label = match search.criterion.as_str() {
        "margin" => format!("{quantity} over requirement"),
        "worst" => format!("{quantity}{}", unit(search)),
        other => format!("{other}-criterion{}", unit(search)),
    };
    let slews =
        search.conditions.slew_rate_deg_s.map_or_else(String::new, |r| format!(", slews at {r} deg/s"));
    let ends = |of: fn(&Found) -> f64| {
        let (low, high) = d.front.iter().map(of).fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        Some((low / 1.3, high * 1.3))
    };
    let bound = search.certificate.as_ref().map_or(&[][..], |c: &Certificate| &c.front);
    let lowest = bound.iter().map(|p| p[1]).fold(f64::MAX, f64::min) / 1.3;
    let figure = Figure {
        title: format!("What total time buys{slews}"),
        x_label: "total time [s]".into(),
        y_label: label,
        x_range: ends(|f| f.total_s),
        y_range: ends(|f| f.value).map(|(low, high)| (low.min(lowest), high)),
        lines: std::iter::once(Curve {
            label: if bound.is_empty() { String::new() } else { "best found".into() },
            color: BLUE,
            stroke: Stroke::Solid,
            points: steps.chain(last).collect(),
        })
        .chain((!bound.is_empty()).then(|| bound_line(bound)))
        .collect(),
        log: true,
        ..Figure::default()
    };
    Ok(picture("front", figure.svg())?.into())
}

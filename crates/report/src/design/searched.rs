//! Method of a search in sentences: what was scored, exhausted, exchanged and proven.

use obsdeg_core::model::Carry;
use obsdeg_design::design::{Design, PartsReport, SearchReport, TiesReport};

use super::bounds::first_above;
use super::terms::criterion;
use super::terms::searched;
use crate::words;

/// The parts of a search; `None` if every block of them was searched again.
pub(super) fn by_parts(s: &SearchReport) -> Option<&PartsReport> {
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

/// Sentences on the search and the order of the schemes.
pub(super) fn how(d: &Design, s: &SearchReport) -> Vec<String> {
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

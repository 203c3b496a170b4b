//! Schemes that were found.

use obsdeg_core::design::Design;
use obsdeg_core::design::answer::{Found, Minimum, SearchReport};

use crate::document::{Block, Document, number};
use crate::figure::{BLUE, Figure, FigureError, Line, Stroke};
use crate::figures::{File, picture};

fn criterion(name: &str) -> &'static str {
    match name {
        "A" => "A: root of the mean variance of the coefficients",
        "D" => "D: geometric mean of the principal sigmas of the coefficients",
        "E" => "E: largest principal sigma of the coefficients",
        "margin" => {
            "margin: largest sigma of a coefficient over what is required; below 1 all requirements are met"
        }
        _ => "worst: largest sigma of a coefficient",
    }
}

fn table(heading: &str, found: &[Found]) -> Block {
    let row = |(i, f): (usize, &Found)| {
        vec![
            (i + 1).to_string(),
            format!("{}{}", f.positions.join(" "), if f.refined { " (refined)" } else { "" }),
            number(f.total_s),
            f.worst_degree.to_string(),
            f.worst_accuracy_order.map_or_else(|| "-".into(), |o| o.to_string()),
            number(f.value),
            format!("{} ({})", number(f.worst_sigma_dph), f.worst),
            format!("{} of {}", f.rank[0], f.rank[1]),
        ]
    };
    Block::Table {
        heading: heading.into(),
        header: vec![
            "",
            "positions in order",
            "total [s]",
            "degree",
            "accuracy",
            "criterion",
            "worst sigma [deg/h, /g]",
            "rank",
        ],
        numbers: vec![true, false, true, true, true, true, false, true],
        rows: found.iter().enumerate().map(row).collect(),
    }
}

fn how(d: &Design, s: &SearchReport) -> Vec<String> {
    let images = if d.symmetry > 1 {
        format!(
            ", one of every {} that turns of the platform axes make of each other (coefficients renamed)",
            d.symmetry
        )
    } else {
        String::new()
    };
    let mut out = vec![if s.proven {
        format!(
            "the first of the candidates' sequences is proven to be the best: all {} within the constraints were examined{images}",
            s.examined
        )
    } else if s.interrupted {
        format!("interrupted after {} sequences: the best so far", s.examined)
    } else {
        format!("not proven: coordinate exchange from random starts, {} sequences examined", s.examined)
    }];
    out.push(
        if s.order_matters {
            "orders of the same positions are different schemes: the dwell lets psi move in between; a position may be repeated"
        } else {
            "the order of positions does not matter under reset carry; a position may be repeated"
        }
        .into(),
    );
    out.push(format!(
        "a smaller worst degree comes first (no scheme of these candidates is below {}), then the criterion, {}",
        s.degree_floor,
        criterion(&s.criterion)
    ));
    out.extend(s.constraints.iter().map(|c| format!("constraint: {c}")));
    out
}

fn minimum(m: &Minimum) -> Vec<String> {
    if !m.never.is_empty() {
        return vec![format!("all candidates together leave {} unobservable", m.never.join(", "))];
    }
    let mut out = match m.positions {
        Some(k) => vec![format!("{k} positions: {}", m.witness.join(" "))],
        None => vec!["not known: the sets are too many to examine all".into()],
    };
    out.push(format!("fewer than {} cannot do: too few derivative rows", m.counting_bound));
    for [size, sets] in &m.none_of {
        out.push(format!("none of the {sets} sets of {size} does (exact ranks, every set examined)"));
    }
    out
}

pub(crate) fn document(d: &Design) -> Document {
    let mut blocks = Vec::new();
    if let Some(s) = &d.search {
        blocks.push(table(
            "Best schemes (sigma: information of all samples, no prior, no drift noise)",
            &d.found,
        ));
        blocks.push(Block::List { heading: "How".into(), lines: how(d, s) });
        blocks.push(table(
            "Front of total time against the criterion (other dwells by exchange, not proven)",
            &d.front,
        ));
    }
    blocks.push(Block::List {
        heading: "Fewest positions that make every required coefficient observable".into(),
        lines: minimum(&d.minimum),
    });
    let mut assumed = vec![format!(
        "{} carry, latitude {} deg{}; seed {}",
        d.carry,
        d.latitude_deg,
        d.search.as_ref().map_or_else(String::new, |s| {
            let slews = s.slew_rate_deg_s.map_or_else(
                || "repositioning at once".into(),
                |r| format!("slews at {r} deg/s about the eigenaxis"),
            );
            format!(", {} s at each position, {slews}", s.dwell_s)
        }),
        d.seed
    )];
    assumed.push(format!("required: {}", d.required.join(", ")));
    assumed.push(candidates(&d.candidates));
    if !d.beyond_gimbals.is_empty() {
        assumed.push(format!("beyond the gimbal limits: {}", shortened(&d.beyond_gimbals)));
    }
    let bound = format!(
        "ranks of sets modulo one random 61-bit prime: an observable set is overlooked with probability below {:.0e}",
        d.error_bound
    );
    assumed.extend((d.error_bound > 0.0).then_some(bound));
    blocks.push(Block::List { heading: "Assumed".into(), lines: assumed });
    let what = d.search.as_ref().map_or_else(
        || "fewest positions".into(),
        |s| format!("{} of {} positions", s.positions, d.candidates.len()),
    );
    Document { title: format!("Design: {what}, {} carry", d.carry), lead: Vec::new(), blocks }
}

fn candidates(names: &[String]) -> String {
    format!("{} candidates: {}", names.len(), shortened(names))
}

/// At most thirty names.
fn shortened(names: &[String]) -> String {
    const SHOWN: usize = 30;
    let more =
        if names.len() > SHOWN { format!(" ... ({} more)", names.len() - SHOWN) } else { String::new() };
    format!("{}{more}", names.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(" "))
}

/// The front of total time against the criterion; none when there is no search.
pub(crate) fn figures(d: &Design) -> Result<Vec<File>, FigureError> {
    let Some(search) = d.search.as_ref().filter(|_| !d.front.is_empty()) else { return Ok(Vec::new()) };
    // lines per number of positions, and the front itself as steps
    let steps = d.front.windows(2).flat_map(|w| [(w[0].total_s, w[0].value), (w[1].total_s, w[0].value)]);
    let last = d.front.last().map(|f| (f.total_s, f.value));
    let label = match search.criterion.as_str() {
        "margin" => "largest sigma over requirement".into(),
        "worst" => "largest sigma [deg/h, /g]".into(),
        other => format!("{other}-criterion [deg/h, /g]"),
    };
    let slews = search.slew_rate_deg_s.map_or_else(String::new, |r| format!(", slews at {r} deg/s"));
    let ends = |of: fn(&Found) -> f64| {
        let (low, high) = d.front.iter().map(of).fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        Some((low / 1.3, high * 1.3))
    };
    let figure = Figure {
        title: format!("What total time buys{slews}"),
        x_label: "total time [s]".into(),
        y_label: label,
        x_range: ends(|f| f.total_s),
        y_range: ends(|f| f.value),
        lines: vec![Line {
            label: String::new(),
            color: BLUE,
            stroke: Stroke::Solid,
            points: steps.chain(last).collect(),
        }],
        log: true,
        ..Figure::default()
    };
    Ok(picture("front", figure.svg())?.into())
}

//! Schemes that were found.

use obsdeg_core::design::Design;

use crate::document::{Block, Document, number};

pub(crate) fn document(d: &Design) -> Document {
    let mut blocks = Vec::new();
    let proof = match &d.minimum {
        None => vec!["all candidates together do not make every coefficient observable".to_string()],
        Some(m) => {
            let mut lines = vec![
                format!("{} positions: {}", m.positions, m.witness.join(" ")),
                format!("fewer than {} cannot do: too few derivative rows", m.counting_bound),
            ];
            for [size, sets] in &m.none_of {
                lines.push(format!(
                    "none of the {sets} sets of {size} does (exact ranks, every set examined)"
                ));
            }
            lines
        }
    };
    if !d.found.is_empty() {
        let rows = d.found.iter().enumerate().map(|(i, f)| {
            vec![
                (i + 1).to_string(),
                f.positions.join(" "),
                number(f.value),
                number(f.worst_sigma_dph),
                format!("{} of {}", f.rank[0], f.rank[1]),
            ]
        });
        blocks.push(Block::Table {
            heading: "Best schemes (worst sigma(D): information of all samples, no prior, no drift noise, no slews)".into(),
            header: vec!["", "positions in order", "criterion", "worst sigma(D) [deg/h, /g]", "rank"],
            numbers: vec![true, false, true, true, true],
            rows: rows.collect(),
        });
        let order = if d.order_matters {
            "orders of the same positions are different schemes: the dwell lets psi move in between"
        } else {
            "the order of positions does not matter under reset carry"
        };
        let how = if d.proven {
            format!(
                "the first is proven to be the best: all {} sequences of observable sets were examined",
                d.examined
            )
        } else if d.interrupted {
            format!("interrupted after {} sequences: the best so far", d.examined)
        } else {
            format!("not proven: coordinate exchange from random starts, {} sequences examined", d.examined)
        };
        let criterion = match d.criterion.as_str() {
            "A" => "A: root of the mean variance of the coefficients",
            "D" => "D: geometric mean of the principal sigmas of the coefficients",
            "E" => "E: largest principal sigma of the coefficients",
            "margin" => {
                "margin: largest sigma of a coefficient over what is required; below 1 all requirements are met"
            }
            _ => "worst: largest sigma of a coefficient",
        };
        let lines = vec![how, order.into(), format!("criterion {criterion}")];
        blocks.push(Block::List { heading: "How".into(), lines });
    }
    blocks.push(Block::List {
        heading: "Fewest positions that make every coefficient observable".into(),
        lines: proof,
    });
    blocks.push(Block::List {
        heading: "Assumed".into(),
        lines: vec![
            format!(
                "{} carry, latitude {} deg, {} s at each position; seed {}",
                d.carry, d.latitude_deg, d.dwell_s, d.seed
            ),
            format!("candidates {}", d.candidates.join(" ")),
            format!(
                "ranks of sets modulo one random 61-bit prime: an observable set is overlooked with probability below {:.0e}",
                d.error_bound
            ),
        ],
    });
    let what = d
        .positions
        .map_or_else(|| "fewest positions".into(), |k| format!("{k} of {} positions", d.candidates.len()));
    Document { title: format!("Design: {what}, {} carry", d.carry), lead: Vec::new(), blocks }
}

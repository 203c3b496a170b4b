//! Positions of a scheme, and their numbers.

use obsdeg_design::review::SchemeReview;
use obsdeg_evidence::compare::{ComparedQuantity, ComparedScheme};

use super::pictures;
use super::sections::seconds;
use crate::document::{DocumentBlock, left, right};
use crate::{gimbals, words};

pub(super) fn positions(blocks: &mut Vec<DocumentBlock>, s: &SchemeReview, id: &str) {
    let rows = s.analysis.positions.iter().zip(&s.positions).map(|(p, numbers)| {
        vec![
            p.name.clone(),
            words::assumptions::angles(p),
            p.attitude.clone().unwrap_or_else(|| "-".into()),
            seconds(numbers.start_s),
            seconds(numbers.dwell_s),
            numbers.slew_s.map_or_else(|| "-".into(), seconds),
            numbers.turn.map_or_else(|| "-".into(), |turn| words::turn(&turn)),
        ]
    });
    let columns = [
        left("position"),
        left("alpha, beta, gamma [deg]"),
        left("X_p Y_p Z_p"),
        right("start [s]"),
        right("dwell [s]"),
        right("slew to it [s]"),
        left("turn"),
    ];
    let table = DocumentBlock::table("Positions in order of time", columns, rows);
    let empty = |all: &dyn Fn(usize) -> bool| (0..s.positions.len()).all(all);
    let unused = [
        ("X_p Y_p Z_p", empty(&|i| s.analysis.positions[i].attitude.is_none())),
        ("slew to it [s]", empty(&|i| s.positions[i].slew_s.is_none())),
        ("turn", empty(&|i| s.positions[i].turn.is_none())),
    ];
    let unused: Vec<&str> = unused.into_iter().filter(|c| c.1).map(|c| c.0).collect();
    blocks.push(table.without(&unused));
    blocks.extend(gimbals::block(s.analysis.gimbals.as_ref()));
    let at = &s.simulation.conditions;
    blocks.extend(pictures::poses(&s.poses, at.latitude_deg, at.latitude_by_default, id));
}

/// Gravity along the axes of the gyros at each position, and what each position excites.
pub(super) fn numbers(
    s: &SchemeReview,
    coefficients: &[&ComparedQuantity],
    review: &ComparedScheme,
    id: &str,
) -> Vec<DocumentBlock> {
    let component = |x: f64| if x == x.round() { format!("{x:.0}") } else { format!("{x:.3}") };
    let g = |g: [f64; 3]| g.map(component).join(", ");
    let row =
        |p: &obsdeg_design::review::PositionReview| vec![p.name.clone(), g(p.g[0]), g(p.g[1]), g(p.g[2])];
    let mut out = vec![
        DocumentBlock::table(
            "Components of g along the axes I, O, S of each gyro (in g, at the start)",
            [left("position"), right("gyro X: I O S"), right("gyro Y: I O S"), right("gyro Z: I O S")],
            s.positions.iter().map(row),
        ),
        pictures::attitudes(s, &format!("{id}_attitude")),
    ];
    if coefficients.iter().any(|q| !q.excitation.is_empty()) {
        out.push(pictures::excitation(coefficients, &review.positions, &format!("{id}_excitation")));
    }
    out
}

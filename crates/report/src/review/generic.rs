//! Part of a scheme with generic angles: verdicts that hold at almost all angles, without numbers.

use obsdeg_core::degree::Status;
use obsdeg_design::review::GenericReview;

use super::answers::Answers;
use super::pictures;
use super::sections::{derivatives, section};
use crate::document::{DocumentBlock, Grade, StatusBox, StatusRow, TableCell};
use crate::{Answer, words};

/// `any alpha and gamma`.
fn any(g: &GenericReview) -> String {
    format!("any {}", g.angles.join(" and "))
}

/// The verdict: what is observable at almost all angles.
fn verdict(g: &GenericReview) -> String {
    let a = &g.analysis;
    let seen: Vec<_> = a.quantities.iter().filter(|q| q.status == Status::Observable).collect();
    let worst = seen.iter().filter_map(|q| q.degree).max();
    let how = worst.map_or_else(String::new, |k| {
        format!(", {}", derivatives(k, seen.iter().map(|q| (q.name.as_str(), q.degree))))
    });
    format!(
        "{} of {} unknowns are observable for {}{how}, but for angles on which verdicts change: those that \
         were found are below. Without numbers for the angles there are no predicted sigmas, no requirements \
         and no evidence by a filter.",
        seen.len(),
        a.quantities.len(),
        any(g)
    )
}

/// Status of a scheme with generic angles.
pub(super) fn status(g: &GenericReview) -> StatusBox {
    let a = &g.analysis;
    let seen = a.quantities.iter().filter(|q| q.status == Status::Observable).count();
    let grade = if seen == a.quantities.len() { Grade::Good } else { Grade::Limited };
    let row = |what, grade, text| StatusRow { what, grade, text };
    StatusBox {
        title: g.name.clone(),
        rows: vec![
            row("Observable", grade, format!("{seen} of {} unknowns, for {}", a.quantities.len(), any(g))),
            row("Requirements", Grade::Open, "nothing is predicted: generic angles have no numbers".into()),
            row("Filter and exact verdicts", Grade::Open, "not taken: generic angles have no numbers".into()),
        ],
        actions: vec![action(g)],
    }
}

fn action(g: &GenericReview) -> String {
    format!(
        "State numbers for {}: then accuracy, requirements and evidence are reviewed as well.",
        g.angles.join(" and ")
    )
}

/// Answers to the questions of a board.
pub(super) fn answers(g: &GenericReview) -> Answers {
    let a = &g.analysis;
    let lost: Vec<&str> =
        a.quantities.iter().filter(|q| q.status != Status::Observable).map(|q| q.name.as_str()).collect();
    let latitude = a.latitude_deg.map_or_else(|| "generic latitude".into(), |l| format!("latitude {l} deg"));
    let open = || format!("Not computed: no number is stated for {}", g.angles.join(" and "));
    let limits = match lost.is_empty() {
        true => {
            TableCell::graded("Angles on which verdicts change: those that were found are below", Grade::Good)
        }
        false => TableCell::graded(format!("Not determined: {}", words::names(lost)), Grade::Limited),
    };
    Answers {
        name: g.name.clone(),
        rows: vec![
            ("Carry", words::assumptions::carry(a.carry).into()),
            ("Assumed", format!("Almost {} at {} positions; {latitude}", any(g), a.positions.len()).into()),
            ("Chosen by the program", "Nothing".into()),
            ("What limits it", limits),
            ("Accelerometers off by 20 ug", open().into()),
            ("Duration", open().into()),
            ("Position to drop", open().into()),
            ("Proven by", super::answers::proven(a, false).into()),
            ("Verified by", TableCell::graded("No filter: it needs numbers for the angles", Grade::Open)),
        ],
        next: action(g),
    }
}

/// Part with verdict, unknowns and positions.
pub(super) fn part(blocks: &mut Vec<DocumentBlock>, g: &GenericReview, level: usize, id: &str) {
    let document = g.analysis.document();
    blocks.push(section(level, "Verdict"));
    blocks.extend((!g.description.is_empty()).then(|| DocumentBlock::Text(g.description.clone())));
    blocks.push(DocumentBlock::Text(verdict(g)));
    blocks.push(DocumentBlock::Text(words::rank(&g.analysis)));
    blocks.push(pictures::staircase(&g.analysis, &format!("{id}_staircase")));
    blocks.push(section(level, "Positions and unknowns"));
    blocks.extend(pictures::poses(&g.poses, g.latitude_deg, g.analysis.latitude_deg.is_none(), id));
    blocks.extend(document.blocks);
}

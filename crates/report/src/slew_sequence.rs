//! Fewest positions where the slew path between them counts.

use obsdeg_design::design::ShortestSlewSequence;

use crate::Answer;
use crate::document::{Document, DocumentBlock, left, right};
use crate::words::{reasons, wrong_below};

/// Sentences on the examined slew sequences and their consequence.
fn examined(w: &ShortestSlewSequence) -> Vec<String> {
    let mut out = vec![format!(
        "a position adds at most {} independent rows, and {} coefficients are required: fewer than {} are never enough",
        w.rows_per_position,
        w.required.len(),
        w.counting_bound
    )];
    out.extend(
        w.none_of.iter().map(|[positions, count]| {
            format!("none of the {count} walks of {positions} does, by exhaustion")
        }),
    );
    out.push(match (w.positions, w.proven) {
        (Some(k), true) if w.none_of.is_empty() => format!("so {k} positions are the fewest, by counting"),
        (Some(k), true) => format!(
            "so {k} positions are the fewest of these candidates and turns ({})",
            wrong_below(w.error_bound)
        ),
        (Some(k), false) if w.interrupted => format!("interrupted: whether fewer than {k} do is not known"),
        (Some(k), false) => {
            format!("longer walks are too many to be examined: whether fewer than {k} do is not known")
        }
        (None, _) if !w.never.is_empty() => {
            format!(
                "even a tour of all {} turns leaves {} unobservable: no walk was sought",
                w.turns,
                w.never.join(", ")
            )
        }
        (None, _) => "no walk was found that does".into(),
    });
    if !w.never.is_empty() {
        out.extend(reasons(&w.terms, &w.candidates));
    }
    out
}

impl Answer for ShortestSlewSequence {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let row = |(i, (name, angles)): (usize, (&String, &String))| {
            vec![format!("p{}", i + 1), name.clone(), angles.clone()]
        };
        let columns = vec![left("position"), left("X_p Y_p Z_p"), right("alpha, beta, gamma [deg]")];
        let rows = self.sequence.iter().zip(&self.angles).enumerate().map(row);
        let title = match self.positions {
            Some(k) => format!(
                "{k} positions that make every required coefficient observable, by turns of at most {} degrees",
                self.most_turn_deg
            ),
            None if !self.never.is_empty() => format!(
                "No walk by turns of at most {} degrees makes every required coefficient observable",
                self.most_turn_deg
            ),
            None => format!(
                "No walk by turns of at most {} degrees was found that makes every required coefficient observable",
                self.most_turn_deg
            ),
        };
        let summary = match self.positions {
            Some(_) => format!(
                "{} of {} unknowns are determined; inertial carry, torquer errors act in every turn",
                self.rank[0], self.rank[1]
            ),
            None => "inertial carry, torquer errors act in every turn".into(),
        };
        Document {
            title,
            lead: vec![summary],
            blocks: vec![
                DocumentBlock::table("", columns, rows),
                DocumentBlock::list("Fewer", examined(self)),
                DocumentBlock::list(
                    "Searched",
                    vec![
                        format!(
                            "{} candidates, {} turns about one axis, the shortest way",
                            self.candidates.len(),
                            self.turns
                        ),
                        format!("unknown terms {}; required: {}", self.terms, self.required.join(", ")),
                        match self.latitude_deg {
                            Some(l) => format!("latitude {l} deg; seed {}", self.seed),
                            None => format!(
                                "latitude generic: wN and wU independent, not zero; seed {}",
                                self.seed
                            ),
                        },
                    ],
                ),
            ],
        }
    }

    fn main_table(&self) -> &'static str {
        "answer"
    }
}

//! The audit of the paper.

use obsdeg_evidence::audit::{Audit, AuditFinding};

use crate::Answer;
use crate::document::{Document, DocumentBlock, left};

fn word(f: AuditFinding) -> &'static str {
    match f {
        AuditFinding::Agree => "agree",
        AuditFinding::Conditional => "with a condition",
        AuditFinding::NotCovered => "not covered",
        AuditFinding::Disagree => "disagree",
    }
}

impl Answer for Audit {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let all = [
            AuditFinding::Agree,
            AuditFinding::Conditional,
            AuditFinding::Disagree,
            AuditFinding::NotCovered,
        ];
        let count = |f| self.lines.iter().filter(|l| l.finding == f).count();
        let counts = all.map(|f| format!("{} {}", count(f), word(f))).join(", ");
        let rows = self.lines.iter().map(|l| vec![l.place.as_str(), word(l.finding), &l.claim, &l.reason]);
        let columns = [left("place"), left("finding"), left("claim"), left("reason")];
        Document {
            title: format!("The paper against the algebra: {counts} (recomputed with seed {})", self.seed),
            lead: Vec::new(),
            blocks: vec![DocumentBlock::table("", columns, rows)],
        }
    }

    fn main_table(&self) -> &'static str {
        "lines"
    }
}

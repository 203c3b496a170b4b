//! The audit of the paper in every text format.

use obsdeg_evidence::audit::{Audit, Finding};

use crate::table::{heading, table as new_table};
use crate::{Layout, ReportError, csv_text, latex, markdown};

fn word(f: Finding) -> String {
    match f {
        Finding::Agree => "agree",
        Finding::Conditional => "with a condition",
        Finding::NotCovered => "not covered",
        Finding::Disagree => "disagree",
    }
    .into()
}

const HEADER: [&str; 4] = ["place", "finding", "claim", "reason"];

fn rows(a: &Audit) -> Vec<[String; 4]> {
    a.lines.iter().map(|l| [l.place.clone(), word(l.finding), l.claim.clone(), l.reason.clone()]).collect()
}

fn title(a: &Audit) -> String {
    let all = [Finding::Agree, Finding::Conditional, Finding::Disagree, Finding::NotCovered];
    let counts = all.map(|f| format!("{} {}", a.lines.iter().filter(|l| l.finding == f).count(), word(f)));
    format!("The paper against the algebra: {} (recomputed with seed {})", counts.join(", "), a.seed)
}

pub(crate) fn table(a: &Audit, layout: Layout) -> String {
    let mut out = String::new();
    heading(&mut out, &title(a), layout);
    let mut t = new_table(&HEADER, layout);
    t.add_rows(rows(a));
    out.push_str(&t.to_string().lines().map(str::trim_end).collect::<Vec<_>>().join("\n"));
    out.push('\n');
    out
}

pub(crate) fn markdown(a: &Audit) -> String {
    let cells = rows(a).into_iter().map(|r| r.map(|c| markdown::escape(&c)).to_vec());
    format!("# {}\n\n{}", title(a), markdown::table(&HEADER, cells))
}

pub(crate) fn csv(a: &Audit) -> Result<String, ReportError> {
    let header = HEADER.map(String::from).to_vec();
    csv_text::write(std::iter::once(header).chain(rows(a).into_iter().map(Vec::from)))
}

pub(crate) fn latex(a: &Audit) -> String {
    let cells = rows(a).into_iter().map(|r| r.map(|c| latex::escape(&c)).to_vec());
    latex::table("llp{0.3\\linewidth}p{0.45\\linewidth}", &HEADER, cells)
}

//! The audit of the paper in every text format.

use obsdeg_core::audit::{Audit, Finding};

use crate::table::{heading, table as new_table};
use crate::{Layout, ReportError, csv_text, latex, markdown};

fn word(f: Finding) -> String {
    match f {
        Finding::Agree => "agree",
        Finding::Disagree => "disagree",
    }
    .into()
}

const HEADER: [&str; 4] = ["place", "finding", "claim", "reason"];

fn rows(a: &Audit) -> Vec<[String; 4]> {
    a.lines.iter().map(|l| [l.place.clone(), word(l.finding), l.claim.clone(), l.reason.clone()]).collect()
}

fn title(a: &Audit) -> String {
    let slips = a.lines.iter().filter(|l| l.finding == Finding::Disagree).count();
    format!(
        "The paper against the algebra: {} lines, {slips} disagree (recomputed at random points, seed {})",
        a.lines.len(),
        a.seed
    )
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

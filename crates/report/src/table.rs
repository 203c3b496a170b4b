//! The table for the terminal.

use comfy_table::{Cell, CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};
use obsdeg_core::analysis::Analysis;
use obsdeg_core::degree::Status;

use crate::{Layout, visible, words};

/// Status, degree, accuracy order.
type Verdict = (Status, Option<usize>, Option<usize>);

/// One line under the header, nothing else.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// A section heading.
pub(crate) fn heading(out: &mut String, text: &str, layout: Layout) {
    if !out.is_empty() {
        out.push('\n');
    }
    let text = visible(text);
    if layout.color {
        out.push_str(&format!("\u{1b}[1m{text}\u{1b}[0m\n"));
    } else {
        out.push_str(&format!("{text}\n"));
    }
}

/// An empty table with a header.
pub(crate) fn table(header: &[&str], layout: Layout) -> Table {
    let mut table = Table::new();
    table.load_style(STYLE).set_header(header.to_vec());
    if let Some(width) = layout.width {
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(width);
    }
    table
}

/// A cell of a table.
pub(crate) fn cell(text: impl AsRef<str>) -> Cell {
    Cell::new(visible(text.as_ref()))
}

/// Adds lines that are wrapped to the width, with a hanging indent.
pub(crate) fn paragraph(out: &mut String, text: &str, layout: Layout) {
    let width = layout.width.map_or(usize::MAX, usize::from).max(20);
    let (mut line, mut first) = (String::from("  "), true);
    for word in visible(text).split(' ') {
        if !first && line.chars().count() + 1 + word.chars().count() > width {
            out.push_str(line.trim_end());
            out.push('\n');
            line = String::from("      ");
            first = true;
        }
        if !first {
            line.push(' ');
        }
        line.push_str(word);
        first = false;
    }
    out.push_str(line.trim_end());
    out.push('\n');
}

fn trimmed(table: &Table) -> String {
    table.to_string().lines().map(str::trim_end).collect::<Vec<_>>().join("\n") + "\n"
}

pub(crate) fn analysis(a: &Analysis, layout: Layout) -> String {
    let mut out = String::new();
    heading(&mut out, &format!("Observable degrees: {}", words::headline(a)), layout);
    paragraph(&mut out, &words::rank(a), layout);

    let mut positions =
        table(&["position", "alpha, beta, gamma [deg]", "X_p Y_p Z_p", "g in x, y, z [g]"], layout);
    for p in &a.positions {
        let angles: Vec<String> = p.angles_deg.iter().map(ToString::to_string).collect();
        let g = p.g_c.map_or_else(String::new, |g| g.map(short).join(", "));
        let angles = words::turned(&angles.join(", "), p.rotation.as_deref());
        positions.add_row([&p.name, &angles, p.attitude.as_deref().unwrap_or_default(), &g].map(cell));
    }
    out.push_str(&trimmed(&positions));

    heading(&mut out, "Unknowns", layout);
    let dwell = words::dwell_matters(a).then_some(words::WITH_DWELL);
    let header = |first: &[&'static str], last: &'static str| {
        first.iter().copied().chain(["verdict", "degree"]).chain(dwell).chain([last]).collect::<Vec<_>>()
    };
    let row = |first: &[&String], (status, degree, order): Verdict, last: String| {
        let dwell = dwell.map(|_| cell(words::with_dwell(a, degree, order)));
        let degree = cell(words::degree(degree)).set_alignment(CellAlignment::Right);
        let first = first.iter().map(cell);
        first.chain([cell(status.to_string()), degree]).chain(dwell).chain([cell(last)]).collect::<Vec<_>>()
    };
    let mut unknowns = table(&header(&["unknown", "unit"], "solution, or why there is none"), layout);
    for q in &a.quantities {
        let verdict = (q.status, q.degree, q.accuracy_order);
        unknowns.add_row(row(&[&q.name, &q.unit], verdict, words::explanation(q)));
    }
    out.push_str(&trimmed(&unknowns));

    if !a.combinations.is_empty() {
        heading(&mut out, "Observable combinations (and those asked for)", layout);
        let mut combinations = table(&header(&["combination"], "solution"), layout);
        for c in &a.combinations {
            let asked = if c.requested { " (asked for)" } else { "" };
            let solution = c.solution.as_ref().map_or_else(String::new, |s| s.text.clone());
            let verdict = (c.status, c.degree, c.accuracy_order);
            combinations.add_row(row(&[&format!("{}{asked}", c.expression)], verdict, solution));
        }
        out.push_str(&trimmed(&combinations));
    }
    let accuracy = words::accuracy(a);
    if !accuracy.is_empty() {
        heading(&mut out, words::ACCURACY, layout);
        for line in &accuracy {
            paragraph(&mut out, line, layout);
        }
    }
    if !a.null_space.is_empty() {
        heading(&mut out, &format!("{} (a change along one leaves them as they are)", words::UNSEEN), layout);
        for v in &a.null_space {
            paragraph(&mut out, &words::null_vector(v), layout);
        }
    }
    let silent = words::not_excited(a);
    if !silent.is_empty() {
        heading(&mut out, "Not excited (never moves Z)", layout);
        paragraph(&mut out, &silent.join(", "), layout);
    }
    if let Some(loci) = &a.degenerate_loci {
        heading(&mut out, "Degenerate angles", layout);
        for l in loci {
            paragraph(&mut out, &words::locus(l), layout);
        }
        paragraph(&mut out, &words::loci(loci), layout);
    }
    if let Some(formulas) = &a.formulas {
        heading(&mut out, "Z in n, and psi, eps in n at each position", layout);
        for f in formulas {
            let at = f.position.as_ref().map(|p| format!(" @{p}")).unwrap_or_default();
            paragraph(&mut out, &format!("{}{at} = {}", f.left, f.right), layout);
        }
    }
    if !a.carries.is_empty() {
        heading(&mut out, "Under the other carries", layout);
        for c in &a.carries {
            paragraph(&mut out, &format!("{}: {}", words::carry(c), words::differences(c)), layout);
        }
    }
    heading(&mut out, "Assumed", layout);
    for line in words::assumptions(a) {
        paragraph(&mut out, &line, layout);
    }
    heading(&mut out, "Certainty", layout);
    paragraph(&mut out, &words::certainty(a), layout);
    for note in &a.notes {
        paragraph(&mut out, &format!("note: {note}"), layout);
    }
    out
}

/// Three decimals, without trailing zeros.
fn short(x: f64) -> String {
    let text = format!("{x:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

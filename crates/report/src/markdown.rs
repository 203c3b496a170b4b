//! GitHub-flavoured Markdown.

use obsdeg_core::analysis::Analysis;

use crate::{visible, words};

/// Text in a table cell or paragraph, with what Markdown would read as markup escaped.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in visible(text).chars() {
        if matches!(c, '\\' | '|' | '*' | '_' | '`' | '<' | '>' | '[' | ']' | '#') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// A table.
pub(crate) fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let names: Vec<String> = header.iter().map(|h| escape(h)).collect();
    let mut out = format!("| {} |\n|{}\n", names.join(" | "), " --- |".repeat(header.len()));
    for row in rows {
        out.push_str(&format!("| {} |\n", row.join(" | ")));
    }
    out
}

/// A formula as code between more backticks than it has in a row; the bar is escaped, since tables split at bars even in code.
fn code(text: &str) -> String {
    if text.is_empty() {
        return String::new();
    }
    let text = visible(text).replace('|', "\\|");
    let most = text.split(|c| c != '`').map(str::len).max().unwrap_or(0);
    let fence = "`".repeat(most + 1);
    if most == 0 { format!("`{text}`") } else { format!("{fence} {text} {fence}") }
}

pub(crate) fn analysis(a: &Analysis) -> String {
    let mut out = format!("# Observable degrees\n\n{}; {}.\n\n", escape(&words::headline(a)), words::rank(a));
    out.push_str(&table(
        &["position", "alpha, beta, gamma [deg]", "X_p Y_p Z_p"],
        a.positions.iter().map(|p| {
            let angles: Vec<String> = p.angles_deg.iter().map(ToString::to_string).collect();
            vec![
                escape(&p.name),
                escape(&words::turned(&angles.join(", "), p.rotation.as_deref())),
                p.attitude.clone().unwrap_or_default(),
            ]
        }),
    ));
    out.push_str("\n## Unknowns\n\n");
    let dwell = words::dwell_matters(a).then_some(words::WITH_DWELL);
    let header = |first: &[&'static str], last: &'static str| {
        first.iter().copied().chain(["verdict", "degree"]).chain(dwell).chain([last]).collect::<Vec<_>>()
    };
    let with_dwell = |degree, order| dwell.map(|_| words::with_dwell(a, degree, order));
    out.push_str(&table(
        &header(&["unknown", "unit"], "solution, or why there is none"),
        a.quantities.iter().map(|q| {
            let why = if q.solution.is_some() {
                code(&words::explanation(q))
            } else {
                escape(&words::explanation(q))
            };
            let mut row = vec![code(&q.name), escape(&q.unit), q.status.to_string(), words::degree(q.degree)];
            row.extend(with_dwell(q.degree, q.accuracy_order));
            row.push(why);
            row
        }),
    ));
    if !a.combinations.is_empty() {
        out.push_str("\n## Combinations\n\n");
        out.push_str(&table(
            &header(&["combination"], "solution"),
            a.combinations.iter().map(|c| {
                let mut row = vec![code(&c.expression), c.status.to_string(), words::degree(c.degree)];
                row.extend(with_dwell(c.degree, c.accuracy_order));
                row.push(c.solution.as_ref().map_or_else(String::new, |s| code(&s.text)));
                row
            }),
        ));
    }
    let mut section = |title: &str, items: Vec<String>| {
        if !items.is_empty() {
            out.push_str(&format!("\n## {title}\n\n"));
            for item in items {
                out.push_str(&format!("- {item}\n"));
            }
        }
    };
    section(words::ACCURACY, words::accuracy(a).iter().map(|s| escape(s)).collect());
    section(words::UNSEEN, a.null_space.iter().map(|v| code(&words::null_vector(v))).collect());
    section("Not excited", words::not_excited(a).iter().map(|n| code(n)).collect());
    section(
        "Degenerate angles",
        a.degenerate_loci
            .iter()
            .flat_map(|l| l.iter().map(words::locus).chain([words::loci(l)]))
            .map(|l| escape(&l))
            .collect(),
    );
    let formula = |f: &obsdeg_core::solution::Formula| {
        let at = f.position.as_ref().map(|p| format!(" @{p}")).unwrap_or_default();
        code(&format!("{}{at} = {}", f.left, f.right))
    };
    section("Formulas", a.formulas.iter().flatten().map(formula).collect());
    let carry = |c: &obsdeg_core::analysis::CarryReport| {
        escape(&format!("{}: {}", words::carry(c), words::differences(c)))
    };
    section("Under the other carries", a.carries.iter().map(carry).collect());
    section("Assumed", words::assumptions(a).iter().map(|s| escape(s)).collect());
    let certainty = std::iter::once(words::certainty(a)).chain(a.notes.iter().map(|n| format!("note: {n}")));
    section("Certainty", certainty.map(|s| escape(&s)).collect());
    out
}

//! Comma-separated values.

use obsdeg_core::analysis::Analysis;

use crate::{ReportError, visible, words};

/// A field: a text that a spreadsheet would take for a formula has an apostrophe before it, as one types it there. Numbers are left
/// alone, and so is what begins with a minus and holds nothing but what formulas of ours do: no function with a text, no other program.
fn field(text: &str) -> String {
    let text = visible(text);
    let ours = |c: char| c.is_alphanumeric() || " _+-*/^()[].,'@".contains(c);
    let formula = match text.chars().next() {
        Some('-') => !text.chars().all(ours),
        Some('+') => text.parse::<f64>().is_err(),
        Some(c) => "=@\u{ff1d}\u{ff0b}\u{ff0d}\u{ff20}".contains(c),
        None => false,
    };
    if formula { format!("'{text}") } else { text.into_owned() }
}

/// Rows as CSV text.
pub(crate) fn write(rows: impl IntoIterator<Item = Vec<String>>) -> Result<String, ReportError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.write_record(row.iter().map(|text| field(text)))?;
    }
    let bytes = writer.into_inner().map_err(|e| csv::Error::from(e.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// One row per unknown, then one per combination.
pub(crate) fn analysis(a: &Analysis) -> Result<String, ReportError> {
    let header =
        ["kind", "name", "unit", "status", "degree", "accuracy_order", "with_dwell", "partners", "solution"];
    let header = header.map(String::from).to_vec();
    let degree = |d: Option<usize>| d.map_or_else(String::new, |k| k.to_string());
    let unknowns = a.quantities.iter().map(|q| {
        let solution = q.solution.as_ref().map_or_else(String::new, |s| s.text.clone());
        let status = q.status.to_string().replace(' ', "_");
        vec![
            "unknown".into(),
            q.name.clone(),
            q.unit.clone(),
            status,
            degree(q.degree),
            degree(q.accuracy_order),
            words::with_dwell(a, q.degree, q.accuracy_order),
            q.partners.join(" "),
            solution,
        ]
    });
    let combinations = a.combinations.iter().map(|c| {
        let solution = c.solution.as_ref().map_or_else(String::new, |s| s.text.clone());
        let kind = if c.requested { "requested" } else { "combination" };
        let status = c.status.to_string().replace(' ', "_");
        vec![
            kind.into(),
            c.expression.clone(),
            String::new(),
            status,
            degree(c.degree),
            degree(c.accuracy_order),
            words::with_dwell(a, c.degree, c.accuracy_order),
            String::new(),
            solution,
        ]
    });
    write(std::iter::once(header).chain(unknowns).chain(combinations))
}

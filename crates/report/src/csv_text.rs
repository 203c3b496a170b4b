//! Comma-separated values.

use crate::{ReportError, visible};

/// Field of a CSV file. A text that a spreadsheet would take for a formula gets an apostrophe before it, as
/// one types it there. Numbers stay as they are. So do texts that begin with a sign and have only the
/// characters of formulas and directions (`-D_FX`, `+x,-z`): these can call no function and no program.
fn field(text: &str) -> String {
    let text = visible(text);
    let ours = |c: char| c.is_alphanumeric() || " _+-*/^()[].,'@".contains(c);
    let formula = match text.chars().next() {
        Some('-' | '+') => !text.chars().all(ours),
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

//! Columns of a record with their units, and its rows.

use std::collections::HashSet;

use super::error::{RecordError, RecordPlace};

/// Column of a header.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordColumn {
    /// Name of the column.
    pub name: String,
    /// Unit of the column; `None` if the header states none.
    pub unit: Option<String>,
    /// Value of one count, in that unit.
    pub count: f64,
    /// Text of the header cell.
    pub text: String,
    /// True if the cells are dates (ISO 8601), which are read as Unix seconds.
    pub dates: bool,
    /// First cell, or type of the cells, where these are no plain numbers and no dates.
    pub other: Option<String>,
}

impl RecordColumn {
    fn of(text: &str) -> Option<Self> {
        let whole = text.trim();
        let (name, unit) = match whole.split_once('[') {
            Some((name, rest)) => (name.trim(), Some(rest.strip_suffix(']')?.trim().to_string())),
            None => (whole, None),
        };
        let sound = !name.is_empty() && !name.contains(']');
        sound.then(|| Self {
            name: name.into(),
            unit,
            count: 1.0,
            text: whole.into(),
            dates: false,
            other: None,
        })
    }
}

/// Requested column: its index, and the factor from its numbers to the unit of the caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Index of the column.
    pub column: usize,
    /// Factor from a number of the column to the unit of the caller.
    pub scale: f64,
}

/// Row: its requested numbers (`None` for an empty cell) and its label.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordRow<'a> {
    /// Line from 1.
    pub line: u64,
    /// Requested numbers, in their order.
    pub numbers: &'a [Option<f64>],
    /// Text of the label column.
    pub label: &'a str,
}

/// Index of the time among the requested numbers: every reader requests it first.
pub(crate) const TIME_INDEX: usize = 0;

impl RecordRow<'_> {
    /// Time of the row; `None` for an empty cell.
    pub fn time(&self) -> Option<f64> {
        self.numbers[TIME_INDEX]
    }

    /// Requested numbers behind the time.
    pub fn values(&self) -> &[Option<f64>] {
        &self.numbers[TIME_INDEX + 1..]
    }
}

/// Most columns that an error lists.
pub(super) const LISTED: usize = 40;

/// Largest number of requested columns.
pub const MOST: usize = 64;

/// Expected content of a time cell, for messages.
pub(super) const TIME: &str = "a number, the time since any moment";

pub(super) fn place(record: &str, line: u64, column: &str) -> RecordPlace {
    RecordPlace { record: record.into(), line, column: column.into() }
}

/// Columns of the headers; each name occurs once.
pub(super) fn columns(
    record: &str,
    headers: Vec<String>,
    line: u64,
) -> Result<Vec<RecordColumn>, RecordError> {
    let mut out: Vec<RecordColumn> = Vec::with_capacity(headers.len());
    let mut names = HashSet::new();
    for text in headers {
        let found = RecordColumn::of(&text).filter(|c| names.insert(c.name.clone()));
        out.push(found.ok_or_else(|| RecordError::Header { place: place(record, line, text.trim()) })?);
    }
    Ok(out)
}

//! Errors of a record, with their place.

/// Place of an error in a record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordPlace {
    /// Name of the record.
    pub record: String,
    /// Line from 1, including the header; for Parquet the row from 1.
    pub line: u64,
    /// Header of the column; empty for the whole row.
    pub column: String,
}

impl std::fmt::Display for RecordPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: line {}", self.record, self.line)?;
        if self.column.is_empty() { Ok(()) } else { write!(f, ", column `{}`", self.column) }
    }
}

/// Reason why a record cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// The file or pipe cannot be read.
    #[error("cannot read the record {record}: {reason}")]
    Read {
        /// Name of the record.
        record: String,
        /// Reason of the failure.
        reason: String,
    },
    /// The record has no header.
    #[error("the record {record} is empty; expected a header such as `t [s],position,fx [g],fy [g],fz [g]`")]
    Empty {
        /// Name of the record.
        record: String,
    },
    /// A header is malformed.
    #[error("{place}: expected a name, or a name with its unit as in `fx [g]`, once")]
    Header {
        /// Place of the header.
        place: RecordPlace,
    },
    /// A required column does not exist.
    #[error("{record}: no column {expected}; found {found}{hint}")]
    Missing {
        /// Name of the record.
        record: String,
        /// Required columns.
        expected: String,
        /// Columns that were found.
        found: String,
        /// Advice on the column.
        hint: &'static str,
    },
    /// A column has the unit of another quantity.
    #[error("{place}: expected {expected}")]
    Unit {
        /// Place of the column.
        place: RecordPlace,
        /// Units that are allowed.
        expected: String,
    },
    /// A unit stated in the scheme is invalid.
    #[error("record.units.{name}: found `{found}`; expected a unit, or what one count is, as in `2.44e-5 g`")]
    Count {
        /// Name of the column in the scheme.
        name: String,
        /// Unit that was found.
        found: String,
    },
    /// A cell is not a number.
    #[error("{place}: expected {expected}, found `{found}`")]
    Number {
        /// Place of the cell.
        place: RecordPlace,
        /// Expected content.
        expected: &'static str,
        /// Content that was found.
        found: String,
    },
    /// A number is out of range.
    #[error("{place}: found {found}, expected {expected}")]
    Value {
        /// Place of the cell.
        place: RecordPlace,
        /// Number that was found.
        found: String,
        /// Expected values.
        expected: &'static str,
    },
    /// A row has a wrong number of cells.
    #[error("{place}: {found} cells; expected {expected}, as in the header")]
    Cells {
        /// Place of the row.
        place: RecordPlace,
        /// Number of cells found.
        found: usize,
        /// Number of columns of the header.
        expected: usize,
    },
    /// A time does not increase.
    #[error(
        "{place}: the time {found} is not after that of the row before, {before}; expected times that increase"
    )]
    Time {
        /// Place of the time.
        place: RecordPlace,
        /// Time that was found.
        found: String,
        /// Time of the row before.
        before: String,
    },
    /// The record has no rows.
    #[error("{record}: no rows after the header")]
    NoRows {
        /// Name of the record.
        record: String,
    },
}

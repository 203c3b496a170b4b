//! Records: columns of numbers with their units in the header, from CSV or Parquet, read row by row with one
//! row in memory.
//!
//! A header is `name [unit]`; a name without brackets has no unit. Lines that begin with `#` are comments. An
//! empty cell is a missing value.

use std::collections::HashSet;
#[cfg(feature = "parquet")]
use std::fs::File;
#[cfg(feature = "parquet")]
use std::io::Seek;
use std::io::{BufRead, BufReader, Read};

use obsdeg_core::model::Recording;
#[cfg(feature = "parquet")]
use parquet::basic::{ConvertedType, LogicalType, TimeUnit};
#[cfg(feature = "parquet")]
use parquet::file::reader::FileReader;
#[cfg(feature = "parquet")]
use parquet::record::Field;
use sha2::{Digest, Sha256};

use crate::csv_lines::{Lines, SEPARATORS, number, unix_seconds};
#[cfg(feature = "parquet")]
use crate::zstd_pages::ParquetFile;

/// Standard acceleration of gravity, in m/s^2.
pub const STANDARD_GRAVITY: f64 = 9.80665;

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

/// Source of the rows.
enum RowSource {
    Csv(Lines),
    #[cfg(feature = "parquet")]
    Parquet(Box<dyn FileReader>),
}

/// Most bytes of Parquet from a pipe: its header comes last, so that all of it is kept in memory.
#[cfg(feature = "parquet")]
const PIPED: u64 = 1 << 28;
/// Record whose header has been read.
pub struct Record {
    name: String,
    columns: Vec<RecordColumn>,
    rows: RowSource,
    /// Separator and decimal mark in words; `None` for commas and points.
    written: Option<String>,
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

impl Record {
    /// Record from a file: with the feature `parquet`, Parquet if it begins as such, otherwise CSV.
    ///
    /// # Errors
    /// [`RecordError`].
    #[cfg(feature = "parquet")]
    pub fn file(name: &str, mut file: File) -> Result<Self, RecordError> {
        let wrong =
            |e: &dyn std::fmt::Display| RecordError::Read { record: name.into(), reason: e.to_string() };
        let mut magic = [0; 4];
        let parquet = file.metadata().map_err(|e| wrong(&e))?.is_file() && {
            let whole = file.read_exact(&mut magic).is_ok();
            file.rewind().map_err(|e| wrong(&e))?;
            whole && &magic == b"PAR1"
        };
        if !parquet {
            return Self::stream(name, Box::new(file));
        }
        Self::parquet(name, Box::new(ParquetFile::new(file).map_err(|e| wrong(&e))?))
    }

    /// Record from a pipe: with the feature `parquet`, Parquet if it begins as such, otherwise CSV. Parquet
    /// is read whole, since its header comes last.
    ///
    /// # Errors
    /// [`RecordError`].
    #[cfg(feature = "parquet")]
    pub fn stream(name: &str, mut from: Box<dyn Read>) -> Result<Self, RecordError> {
        let wrong =
            |e: &dyn std::fmt::Display| RecordError::Read { record: name.into(), reason: e.to_string() };
        let mut begin = Vec::new();
        (&mut from).take(4).read_to_end(&mut begin).map_err(|e| wrong(&e))?;
        if begin != b"PAR1" {
            return Self::csv(name, Box::new(std::io::Cursor::new(begin).chain(from)));
        }
        (&mut from).take(PIPED).read_to_end(&mut begin).map_err(|e| wrong(&e))?;
        if begin.len() as u64 > PIPED {
            let most = PIPED >> 20;
            return Err(wrong(&format!(
                "more than {most} MiB of Parquet from a pipe; expected a file, of which only what is needed is read"
            )));
        }
        let reader = ParquetFile::new(bytes::Bytes::from(begin)).map_err(|e| wrong(&e))?;
        Self::parquet(name, Box::new(reader))
    }

    /// Number of rows; `None` unless the file states it before them.
    pub(crate) fn rows_stated(&self) -> Option<usize> {
        match &self.rows {
            RowSource::Csv(_) => None,
            #[cfg(feature = "parquet")]
            RowSource::Parquet(reader) => usize::try_from(reader.metadata().file_metadata().num_rows()).ok(),
        }
    }

    #[cfg(feature = "parquet")]
    fn parquet(name: &str, reader: Box<dyn FileReader>) -> Result<Self, RecordError> {
        let fields = reader.metadata().file_metadata().schema().get_fields();
        let headers: Vec<String> = fields.iter().map(|f| f.name().to_string()).collect();
        let mut columns = columns(name, headers, 0)?;
        let moment = |f: &parquet::schema::types::Type| {
            matches!(f.get_basic_info().logical_type_ref(), Some(LogicalType::Timestamp { .. }))
                || matches!(
                    f.get_basic_info().converted_type(),
                    ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIMESTAMP_MICROS
                )
        };
        let nanos = |f: &parquet::schema::types::Type| {
            let info = f.get_basic_info();
            matches!(info.logical_type_ref(), Some(LogicalType::Timestamp(t)) if t.unit == TimeUnit::NANOS)
        };
        for (column, field) in columns.iter_mut().zip(fields) {
            if moment(field) && column.unit.is_none() {
                (column.unit, column.dates) = (Some("s".into()), true);
                column.count = if nanos(field) { 1e-9 } else { 1.0 };
            }
            column.other = match field.get_basic_info().logical_type_ref() {
                Some(LogicalType::Time { .. }) => Some("times of a day".into()),
                Some(LogicalType::Date) => Some("dates without a time".into()),
                Some(LogicalType::String) => Some("texts".into()),
                _ => None,
            };
        }
        Ok(Self { name: name.into(), columns, rows: RowSource::Parquet(reader), written: None })
    }

    /// Record in CSV.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn csv(name: &str, text: Box<dyn Read>) -> Result<Self, RecordError> {
        let wrong =
            |e: &dyn std::fmt::Display| RecordError::Read { record: name.into(), reason: e.to_string() };
        // a byte order mark is no part of a name
        let mut text = BufReader::new(text);
        if text.fill_buf().map_err(|e| wrong(&e))?.starts_with(&[0xef, 0xbb, 0xbf]) {
            text.consume(3);
        }
        let reason = |reason: String| RecordError::Read { record: name.into(), reason };
        let mut lines = Lines::new(text);
        if !lines.next().map_err(reason)? {
            return Err(RecordError::Empty { record: name.into() });
        }
        let mut columns = columns(name, lines.cells.clone(), lines.line)?;
        // the first row shows how numbers and times are written
        lines.held = lines.next().map_err(reason)?;
        let decimal = |c: &String| c.contains(',') && number(c, lines.separator).is_some();
        let separator = SEPARATORS.iter().find(|(c, _)| *c == lines.separator).map(|(_, name)| *name);
        let written = separator.map(|name| {
            let commas = if lines.cells.iter().any(decimal) { ", decimals by commas" } else { "" };
            format!("columns are separated by {name}{commas}")
        });
        for (column, cell) in columns.iter_mut().zip(&lines.cells) {
            if column.unit.is_none() && unix_seconds(cell).is_some() {
                (column.unit, column.dates) = (Some("s".into()), true);
            } else if !cell.is_empty() && number(cell, lines.separator).is_none() {
                column.other = Some(format!("`{cell}`"));
            }
        }
        Ok(Self { name: name.into(), columns, rows: RowSource::Csv(lines), written })
    }

    /// Separator and decimal mark in words; `None` for commas and points.
    pub fn written(&self) -> Option<&str> {
        self.written.as_deref()
    }

    /// Name of the record.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Columns of the record.
    pub fn columns(&self) -> &[RecordColumn] {
        &self.columns
    }

    /// Record with the names and units that a scheme gives its columns.
    ///
    /// # Errors
    /// [`RecordError`] for a column that does not exist, two of one name, or an invalid unit.
    pub fn named(mut self, by: &Recording) -> Result<Self, RecordError> {
        let found: Vec<Option<usize>> = by.columns.values().map(|own| self.find(own)).collect();
        for ((name, own), column) in by.columns.iter().zip(found) {
            let column = column
                .ok_or_else(|| self.without(&format!("`{own}`, which record.columns has as `{name}`"), ""))?;
            self.columns[column].name.clone_from(name);
        }
        let mut names = HashSet::new();
        if let Some(i) = self.columns.iter().position(|c| !names.insert(&c.name)) {
            return Err(RecordError::Header { place: self.at(1, i) });
        }
        for (name, text) in &by.units {
            let column =
                self.find(name).ok_or_else(|| self.without(&format!("`{name}`, of record.units"), ""))?;
            let (count, unit) = match text.trim().split_once(char::is_whitespace) {
                Some((count, unit)) => (count.parse().unwrap_or(f64::NAN), unit.trim()),
                None => (1.0, text.trim()),
            };
            if !(count.is_finite() && count != 0.0) || unit.is_empty() {
                return Err(RecordError::Count { name: name.clone(), found: text.clone() });
            }
            self.columns[column].count = count;
            self.columns[column].unit = Some(unit.into());
        }
        Ok(self)
    }

    /// Index of the column of this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c.name == name)
    }

    /// Column with the factor from its numbers to the first of `units`; these are given with their values in
    /// the first.
    ///
    /// # Errors
    /// [`RecordError::Unit`].
    pub fn wanted(&self, column: usize, units: &[(&str, f64)]) -> Result<Wanted, RecordError> {
        let own = &self.columns[column];
        let found = own.unit.as_ref().and_then(|u| units.iter().find(|(name, _)| name == u));
        found.map(|&(_, scale)| Wanted { column, scale: scale * own.count }).ok_or_else(|| {
            let each: Vec<String> = units.iter().map(|(u, _)| format!("`{} [{u}]`", own.name)).collect();
            let dates = match (&own.unit, own.name.as_str()) {
                (None, "t") => ", or dates such as 2026-11-23 09:00:00.5",
                _ => "",
            };
            let found = own.other.as_ref().map_or_else(String::new, |other| format!("; found {other}"));
            self.unit(column, format!("a unit, {}{dates}{found}", each.join(" or ")))
        })
    }

    /// Error of a column with another unit than expected.
    pub(crate) fn unit(&self, column: usize, expected: String) -> RecordError {
        RecordError::Unit { place: self.at(1, column), expected }
    }

    /// Error of a column that does not exist under any name.
    pub fn missing(&self, expected: &str) -> RecordError {
        self.without(expected, "; a column of another name is given under [record.columns]")
    }

    fn without(&self, expected: &str, hint: &'static str) -> RecordError {
        let mut found: Vec<String> =
            self.columns.iter().take(LISTED).map(|c| format!("`{}`", c.text)).collect();
        if self.columns.len() > LISTED {
            found.push(format!("and {} more", self.columns.len() - LISTED));
        }
        RecordError::Missing {
            record: self.name.clone(),
            expected: expected.into(),
            found: found.join(", "),
            hint,
        }
    }

    fn at(&self, line: u64, column: usize) -> RecordPlace {
        place(&self.name, line, &self.columns[column].text)
    }

    /// Reads all rows and passes `each` the `wanted` numbers and the text of the `label` column. The first
    /// number is the time, which must exist and increase; if `anew`, it may start again with another label.
    ///
    /// Returns a digest, equal for equal records: the first half of SHA-256 (FIPS 180-4) in hexadecimal. It
    /// covers the `wanted` numbers alone, in the units of the caller and row by row. Other columns, labels,
    /// names, comments and the file format do not change it.
    ///
    /// # Errors
    /// [`RecordError`], and the errors of `each`.
    pub fn read<E: From<RecordError>>(
        self,
        wanted: &[Wanted],
        label: Option<usize>,
        anew: bool,
        mut each: impl FnMut(RecordRow<'_>) -> Result<(), E>,
    ) -> Result<String, E> {
        let Self { name, columns, rows, .. } = self;
        let mut check = RowCheck::new(&name, &columns, wanted, anew);
        let mut row = |line: u64, cell: &mut dyn FnMut(usize) -> CellContent, label: &str| -> Result<(), E> {
            let numbers = check.numbers(line, cell, label)?;
            each(RecordRow { line, numbers: &numbers[..wanted.len()], label })
        };
        match rows {
            RowSource::Csv(mut lines) => {
                let wrong = |reason: String| RecordError::Read { record: name.clone(), reason };
                while lines.next().map_err(wrong)? {
                    let (line, cells) = (lines.line, &lines.cells);
                    if cells.len() != columns.len() {
                        let (found, expected) = (cells.len(), columns.len());
                        return Err(
                            RecordError::Cells { place: place(&name, line, ""), found, expected }.into()
                        );
                    }
                    let separator = lines.separator;
                    let mut cell = |i: usize| match cells[i].as_str() {
                        "" => CellContent::Nothing,
                        text if columns[i].dates => unix_seconds(text)
                            .map_or_else(|| CellContent::Text(text.into()), CellContent::Number),
                        text => number(text, separator)
                            .map_or_else(|| CellContent::Text(text.into()), CellContent::Number),
                    };
                    row(line, &mut cell, label.map_or("", |i| &cells[i]))?;
                }
            }
            #[cfg(feature = "parquet")]
            RowSource::Parquet(reader) => {
                let wrong = |e: parquet::errors::ParquetError| RecordError::Read {
                    record: name.clone(),
                    reason: e.to_string(),
                };
                for (i, read) in reader.get_row_iter(None).map_err(wrong)?.enumerate() {
                    let read = read.map_err(wrong)?;
                    let fields: Vec<&Field> = read.get_column_iter().map(|(_, f)| f).collect();
                    let label = label.map_or_else(String::new, |i| text_of(fields[i]));
                    row(i as u64 + 1, &mut |i| CellContent::of(fields[i]), &label)?;
                }
            }
        }
        Ok(check.digest()?)
    }
}

/// Check of the rows of a record, one after the other, with their digest.
struct RowCheck<'a> {
    /// Name of the record.
    record: &'a str,
    columns: &'a [RecordColumn],
    wanted: &'a [Wanted],
    /// True if times may start again with another label.
    anew: bool,
    digest: Sha256,
    /// Time of the row before; -infinity before the first.
    before: f64,
    /// Label of the row before.
    last: String,
    /// True after the first row.
    any: bool,
}

impl<'a> RowCheck<'a> {
    fn new(record: &'a str, columns: &'a [RecordColumn], wanted: &'a [Wanted], anew: bool) -> Self {
        let (digest, before, last) = (Sha256::new(), f64::NEG_INFINITY, String::new());
        Self { record, columns, wanted, anew, digest, before, last, any: false }
    }

    /// Place of the requested number `i` in a line.
    fn at(&self, line: u64, i: usize) -> RecordPlace {
        place(self.record, line, &self.columns[self.wanted[i].column].text)
    }

    /// Requested numbers of a row, whose time is after that of the row before.
    fn numbers(
        &mut self,
        line: u64,
        cell: &mut dyn FnMut(usize) -> CellContent,
        label: &str,
    ) -> Result<[Option<f64>; MOST], RecordError> {
        let mut numbers = [None; MOST];
        for (i, (slot, w)) in numbers.iter_mut().zip(self.wanted).enumerate() {
            *slot = self.number(line, i, cell(w.column))?;
        }
        let Some(t) = numbers[0] else {
            let (place, found) = (self.at(line, 0), String::new());
            return Err(RecordError::Number { place, expected: TIME, found });
        };
        if self.anew && label != self.last {
            self.before = f64::NEG_INFINITY;
            self.last = label.into();
        }
        if t <= self.before {
            // as written, without the rounding of the scale
            let written = |t: f64| (t / self.wanted[0].scale * 1e9).round() / 1e9;
            let (found, before) = (written(t).to_string(), written(self.before).to_string());
            return Err(RecordError::Time { place: self.at(line, 0), found, before });
        }
        (self.before, self.any) = (t, true);
        self.add(&numbers);
        Ok(numbers)
    }

    /// Requested number `i` of a line; `None` for an empty cell.
    fn number(&self, line: u64, i: usize, cell: CellContent) -> Result<Option<f64>, RecordError> {
        match cell {
            CellContent::Number(x) if x.is_finite() => Ok(Some(x * self.wanted[i].scale)),
            CellContent::Number(x) => {
                let expected = "a finite number (an empty cell is a value that is not there)";
                Err(RecordError::Value { place: self.at(line, i), found: x.to_string(), expected })
            }
            CellContent::Nothing => Ok(None),
            CellContent::Text(found) => {
                let expected = if i == 0 { TIME } else { "a number" };
                Err(RecordError::Number { place: self.at(line, i), expected, found })
            }
        }
    }

    /// Adds the numbers of a row to the digest.
    fn add(&mut self, numbers: &[Option<f64>; MOST]) {
        // NaN for a missing value
        let mut bytes = [0; 8 * MOST];
        let bytes = &mut bytes[..8 * self.wanted.len()];
        for (x, place) in numbers.iter().zip(bytes.chunks_exact_mut(8)) {
            place.copy_from_slice(&(x.unwrap_or(f64::NAN) + 0.0).to_le_bytes());
        }
        self.digest.update(&*bytes);
    }

    /// Digest of all rows.
    ///
    /// # Errors
    /// [`RecordError::NoRows`].
    fn digest(self) -> Result<String, RecordError> {
        if !self.any {
            return Err(RecordError::NoRows { record: self.record.into() });
        }
        Ok(self.digest.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect())
    }
}

/// Most columns that an error lists.
const LISTED: usize = 40;

/// Largest number of requested columns.
pub const MOST: usize = 64;

/// Expected content of a time cell, for messages.
const TIME: &str = "a number, the time since any moment";

/// Content of a cell.
enum CellContent {
    Number(f64),
    Nothing,
    Text(String),
}

#[cfg(feature = "parquet")]
impl CellContent {
    fn of(field: &Field) -> Self {
        match field {
            Field::Double(x) => Self::Number(*x),
            Field::Float(x) => Self::Number(f64::from(*x)),
            Field::Float16(x) => Self::Number(f64::from(*x)),
            Field::Int(x) => Self::Number(f64::from(*x)),
            Field::Short(x) => Self::Number(f64::from(*x)),
            Field::UInt(x) => Self::Number(f64::from(*x)),
            Field::UShort(x) => Self::Number(f64::from(*x)),
            Field::Long(x) => Self::Number(*x as f64),
            Field::ULong(x) => Self::Number(*x as f64),
            Field::TimestampMillis(x) => Self::Number(*x as f64 / 1e3),
            Field::TimestampMicros(x) => Self::Number(*x as f64 / 1e6),
            Field::Decimal(d) => decimal(d.data(), d.scale()),
            Field::Null => Self::Nothing,
            other => Self::Text(other.to_string()),
        }
    }
}

/// Decimal number: the integer in its bytes, the highest first, in units of 10^-scale.
#[cfg(feature = "parquet")]
fn decimal(bytes: &[u8], scale: i32) -> CellContent {
    let negative = bytes.first().is_some_and(|b| *b >= 0x80);
    if bytes.len() > 16 {
        return CellContent::Text("a decimal of more than 38 digits".into());
    }
    let whole = bytes.iter().fold(if negative { -1_i128 } else { 0 }, |x, b| (x << 8) | i128::from(*b));
    // parsed from text, without a second rounding
    format!("{whole}e{}", -scale).parse().map_or(CellContent::Nothing, CellContent::Number)
}

/// Text of a Parquet label.
#[cfg(feature = "parquet")]
fn text_of(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(s) => s.trim().into(),
        other => other.to_string(),
    }
}

fn place(record: &str, line: u64, column: &str) -> RecordPlace {
    RecordPlace { record: record.into(), line, column: column.into() }
}

/// Columns of the headers; each name occurs once.
fn columns(record: &str, headers: Vec<String>, line: u64) -> Result<Vec<RecordColumn>, RecordError> {
    let mut out: Vec<RecordColumn> = Vec::with_capacity(headers.len());
    let mut names = HashSet::new();
    for text in headers {
        let found = RecordColumn::of(&text).filter(|c| names.insert(c.name.clone()));
        out.push(found.ok_or_else(|| RecordError::Header { place: place(record, line, text.trim()) })?);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Line, numbers and label of a row.
    type ReadRow = (u64, Vec<Option<f64>>, String);

    fn all(text: &str) -> Result<Vec<ReadRow>, RecordError> {
        let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(text.to_string())))?;
        let t = record.wanted(
            record.find("t").ok_or_else(|| record.missing("`t [s]`"))?,
            &[("s", 1.0), ("ms", 1e-3)],
        )?;
        let f = record.wanted(record.find("f").ok_or_else(|| record.missing("`f [g]`"))?, &[("g", 1.0)])?;
        let (label, mut out) = (record.find("position"), Vec::new());
        record.read(&[t, f], label, false, |r| {
            out.push((r.line, r.numbers.to_vec(), r.label.to_string()));
            Ok::<(), RecordError>(())
        })?;
        Ok(out)
    }

    #[test]
    fn rows_with_units_gaps_and_comments() {
        let rows = all("\u{feff}# made by hand\nt [ms], f [g] ,position\n500,1.5,p1\n# a gap\n1500,,\n\
            2500.5,-1e-3,p 2\n")
        .expect("rows");
        assert_eq!(rows[0], (3, vec![Some(0.5), Some(1.5)], "p1".to_string()));
        assert_eq!(rows[1], (5, vec![Some(1.5), None], String::new()));
        assert_eq!(rows[2], (6, vec![Some(2.5005), Some(-1e-3)], "p 2".to_string()));
    }

    /// Semicolons and tabs as separators, decimal commas.
    #[test]
    fn what_else_loggers_write() {
        for (text, written) in [
            (
                "t [s];f [g];note\n0;1,5;a\n1;-2e-3;b\n",
                "columns are separated by semicolons, decimals by commas",
            ),
            ("t [s]\tf [g]\n0\t1.5\n1\t-0,002\n", "columns are separated by tabs"),
            (
                "t [s];f [g]\n\"0\";\"1,5\"\n1,0;-0,002\n",
                "columns are separated by semicolons, decimals by commas",
            ),
        ] {
            let rows = all(text).expect(text);
            assert_eq!(
                rows.iter().map(|r| r.1.clone()).collect::<Vec<_>>(),
                [[Some(0.0), Some(1.5)], [Some(1.0), Some(-0.002)]]
            );
            let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(text))).expect("a record");
            assert_eq!(record.written(), Some(written));
        }
        let e = all("t [s];f [g]\n0;1.234,5\n").expect_err("both").to_string();
        assert!(e.ends_with("line 2, column `f [g]`: expected a number, found `1.234,5`"), "{e}");
    }

    /// Dates, against seconds by a system's calendar.
    #[test]
    fn dates_are_unix_seconds() {
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", 0.0),
            ("2000-02-29T12:00:00Z", 951_825_600.0),
            ("2026-11-23T10:00:00.25+01:00", 1_795_424_400.25),
            ("2026-11-23 09:00", 1_795_424_400.0),
            ("23.11.2026 09:00", 1_795_424_400.0),
            ("23.11.2026 09:00:00,5", 1_795_424_400.5),
            ("1969-12-31T23:59:59.5Z", -0.5),
            ("2100-03-01T00:00:00Z", 4_107_542_400.0),
        ] {
            assert_eq!(unix_seconds(text), Some(seconds), "{text}");
        }
        for text in [
            "2026-11-23",
            "11.23.2026 09:00",
            "23.11.2026.1 09:00",
            "11/23/2026 09:00",
            "2026-02-29T00:00",
            "2026-13-01T00:00",
            "2026-11-23T24:00",
            "x",
            "10:00",
            "2026-11-23T10",
        ] {
            assert_eq!(unix_seconds(text), None, "{text}");
        }
        for cell in ["23.11.26 09:00:00", "11/23/2026 9:00 AM"] {
            let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(format!("t,f [g]\n{cell},1\n"))));
            let e = record.expect("a header").wanted(0, &[("s", 1.0)]).expect_err("refused").to_string();
            assert!(e.ends_with(&format!("or dates such as 2026-11-23 09:00:00.5; found `{cell}`")), "{e}");
        }
        let rows = all("t,f [g]\n2026-11-23T09:00:00Z,1\n2026-11-23T09:00:00.5Z,2\n").expect("rows");
        assert_eq!(rows[1].1, [Some(1_795_424_400.5), Some(2.0)]);
    }

    /// A header of many columns takes no time that grows with their square.
    #[test]
    fn many_columns() {
        let names: Vec<String> = (0..100_000).map(|k| format!("c{k}")).collect();
        let text = format!("t [s],f [g],{}\n", names.join(","));
        let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(text))).expect("a record");
        let record = record.named(&Recording::default()).expect("named");
        assert_eq!(record.find("c99999"), Some(100_001));
        assert!(record.missing("`x`").to_string().len() < 1000);
    }

    /// Names and counts that a scheme gives the columns.
    #[test]
    fn names_and_counts() {
        let by = |columns: &[(&str, &str)], units: &[(&str, &str)]| {
            let of = |l: &[(&str, &str)]| l.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
            Recording { columns: of(columns), units: of(units), ..Recording::default() }
        };
        let read = |by: &Recording| {
            let text = "Time [ms],AccX,g\n500,3,1\n";
            let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(text)))?.named(by)?;
            let of =
                |name: &str, unit: &str| record.wanted(record.find(name).expect("there"), &[(unit, 10.0)]);
            Ok::<_, RecordError>((of("t", "ms")?, of("fx", "g")?))
        };
        let (t, f) = read(&by(&[("t", "Time"), ("fx", "AccX")], &[("fx", "2.5e-5 g")])).expect("named");
        assert_eq!((t, f), (Wanted { column: 0, scale: 10.0 }, Wanted { column: 1, scale: 2.5e-4 }));
        let message = |by| read(&by).expect_err("wrong").to_string();
        assert_eq!(
            message(by(&[("t", "Zeit")], &[])),
            "r.csv: no column `Zeit`, which record.columns has as `t`; found `Time [ms]`, `AccX`, `g`"
        );
        assert!(message(by(&[("g", "AccX")], &[])).starts_with("r.csv: line 1, column `g`: expected a name"));
        assert_eq!(
            message(by(&[("t", "Time"), ("fx", "AccX")], &[("fx", "much g")])),
            "record.units.fx: found `much g`; expected a unit, or what one count is, as in `2.44e-5 g`"
        );
    }

    #[test]
    fn what_is_wrong_has_its_place() {
        for (text, message) in [
            (
                "",
                "the record r.csv is empty; expected a header such as `t [s],position,fx [g],fy [g],fz [g]`",
            ),
            ("t [s],f [g]\n", "r.csv: no rows after the header"),
            (
                "t [s],g [g]\n0,1\n",
                "r.csv: no column `f [g]`; found `t [s]`, `g [g]`; a column of another name is given under \
                 [record.columns]",
            ),
            ("t [s],f\n0,1\n", "r.csv: line 1, column `f`: expected a unit, `f [g]`"),
            ("t [h],f [g]\n0,1\n", "r.csv: line 1, column `t [h]`: expected a unit, `t [s]` or `t [ms]`"),
            (
                "t [s],f [g],f [g]\n0,1,1\n",
                "r.csv: line 1, column `f [g]`: expected a name, or a name with its unit as in `fx [g]`, once",
            ),
            (
                "t [s],f [g\n0,1\n",
                "r.csv: line 1, column `f [g`: expected a name, or a name with its unit as in `fx [g]`, once",
            ),
            (
                "t [s],f [g]\n2026-11-23T10:00,1\n",
                "r.csv: line 2, column `t [s]`: expected a number, the time since any moment, found `2026-11-23T10:00`",
            ),
            ("t [s],f [g]\n0,1\n1,abc\n", "r.csv: line 3, column `f [g]`: expected a number, found `abc`"),
            (
                "t [s],f [g]\n0,NaN\n",
                "r.csv: line 2, column `f [g]`: found NaN, expected a finite number (an empty cell is a \
                 value that is not there)",
            ),
            (
                "t [ms],f [g]\n100,1\n100,1\n",
                "r.csv: line 3, column `t [ms]`: the time 100 is not after that of the row before, 100; \
                 expected times that increase",
            ),
            (
                "t [s],f [g]\n,1\n",
                "r.csv: line 2, column `t [s]`: expected a number, the time since any moment, found ``",
            ),
            ("t [s],f [g]\n0,1\n0.5\n", "r.csv: line 3: 1 cells; expected 2, as in the header"),
            (
                "t [s],f [g]\n0,1\n0,1\n",
                "r.csv: line 3, column `t [s]`: the time 0 is not after that of the row before, 0; expected \
                 times that increase",
            ),
        ] {
            assert_eq!(all(text).expect_err(text).to_string(), message);
        }
    }
}

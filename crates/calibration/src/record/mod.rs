//! Records: columns of numbers with their units in the header, from CSV or Parquet, read row by row with one
//! row in memory.
//!
//! A header is `name [unit]`; a name without brackets has no unit. Lines that begin with `#` are comments. An
//! empty cell is a missing value.

mod cells;
mod columns;
mod error;

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

use crate::csv_lines::{Lines, SEPARATORS, number, unix_seconds};
#[cfg(feature = "parquet")]
use crate::zstd_pages::ParquetFile;
#[cfg(feature = "parquet")]
use cells::text_of;
use cells::{CellContent, RowCheck};
use columns::{LISTED, columns, place};

pub(crate) use columns::TIME_INDEX;
pub use columns::{MOST, RecordColumn, RecordRow, Wanted};
pub use error::{RecordError, RecordPlace};

/// Standard acceleration of gravity, in m/s^2.
pub const STANDARD_GRAVITY: f64 = 9.80665;

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

#[cfg(test)]
mod tests;

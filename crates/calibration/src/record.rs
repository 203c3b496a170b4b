//! Records: columns of numbers with their units in the header, from CSV or Parquet, row by row; only one row is held.
//!
//! A header is `name [unit]`; a name without brackets has no unit. Lines that begin with `#` are comments. An empty cell is a value that is not there.

#[cfg(feature = "parquet")]
use std::fs::File;
#[cfg(feature = "parquet")]
use std::io::Seek;
use std::io::{BufRead, BufReader, Read};

use obsdeg_core::model::Recording;
#[cfg(feature = "parquet")]
use parquet::file::reader::{FileReader, SerializedFileReader};
#[cfg(feature = "parquet")]
use parquet::record::Field;
use sha2::{Digest, Sha256};

/// The standard acceleration of gravity, in m/s^2.
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// Where something of a record is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The record.
    pub record: String,
    /// Its line from 1, the header included; of Parquet the row from 1.
    pub line: u64,
    /// The header of the column; empty for all of the row.
    pub column: String,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: line {}", self.record, self.line)?;
        if self.column.is_empty() { Ok(()) } else { write!(f, ", column `{}`", self.column) }
    }
}

/// Why a record cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// The file or pipe.
    #[error("cannot read the record {record}: {reason}")]
    Read {
        /// The record.
        record: String,
        /// Why.
        reason: String,
    },
    /// No header.
    #[error("the record {record} is empty; expected a header such as `t [s],position,fx [g],fy [g],fz [g]`")]
    Empty {
        /// The record.
        record: String,
    },
    /// Columns that no commas part.
    #[error(
        "{record}: line {line}: the columns are parted by {found}; expected commas (and points in numbers)"
    )]
    Separator {
        /// The record.
        record: String,
        /// The line of the header.
        line: u64,
        /// What parts them.
        found: &'static str,
    },
    /// A header that is none.
    #[error("{place}: expected a name, or a name with its unit as in `fx [g]`, once")]
    Header {
        /// Where.
        place: Place,
    },
    /// A column that is wanted.
    #[error("{record}: no column {expected}; found {found}{hint}")]
    Missing {
        /// The record.
        record: String,
        /// What is wanted.
        expected: String,
        /// What there is.
        found: String,
        /// What helps.
        hint: &'static str,
    },
    /// A unit of something else.
    #[error("{place}: expected {expected}")]
    Unit {
        /// Where.
        place: Place,
        /// The units that would do.
        expected: String,
    },
    /// A unit of the file that is none.
    #[error("record.units.{name}: found `{found}`; expected a unit, or what one count is, as in `2.44e-5 g`")]
    Count {
        /// The column, as the file names it.
        name: String,
        /// What it says.
        found: String,
    },
    /// Not a number.
    #[error("{place}: expected {expected}, found `{found}`")]
    Number {
        /// Where.
        place: Place,
        /// What it is to be.
        expected: &'static str,
        /// What there is.
        found: String,
    },
    /// A number that cannot be.
    #[error("{place}: found {found}, expected {expected}")]
    Value {
        /// Where.
        place: Place,
        /// What there is.
        found: String,
        /// Changes that would meet every requirement.
        expected: &'static str,
    },
    /// A row of another length.
    #[error("{place}: {found} cells; expected {expected}, as in the header")]
    Cells {
        /// Where.
        place: Place,
        /// Its cells.
        found: usize,
        /// Those of the header.
        expected: usize,
    },
    /// Time that does not go on.
    #[error(
        "{place}: the time {found} is not after that of the row before, {before}; expected times that increase"
    )]
    Time {
        /// Where.
        place: Place,
        /// The time.
        found: String,
        /// The one before.
        before: String,
    },
    /// Nothing after the header.
    #[error("{record}: no rows after the header")]
    NoRows {
        /// The record.
        record: String,
    },
}

/// A column of a header.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its unit, if it says one.
    pub unit: Option<String>,
    /// What one of its numbers is of that unit.
    pub count: f64,
    /// As it is written.
    pub text: String,
}

impl Column {
    fn of(text: &str) -> Option<Self> {
        let whole = text.trim();
        let (name, unit) = match whole.split_once('[') {
            Some((name, rest)) => (name.trim(), Some(rest.strip_suffix(']')?.trim().to_string())),
            None => (whole, None),
        };
        let sound = !name.is_empty() && !name.contains(']');
        sound.then(|| Self { name: name.into(), unit, count: 1.0, text: whole.into() })
    }
}

/// What rows come from.
enum Rows {
    Csv(Lines),
    #[cfg(feature = "parquet")]
    Parquet(Box<dyn FileReader>),
}

/// Lines of CSV with their numbers.
struct Lines {
    text: BufReader<Box<dyn Read>>,
    line: u64,
    cells: Vec<String>,
    buffer: Vec<u8>,
}

/// Longest line, in bytes.
const LONGEST: u64 = 1 << 20;

impl Lines {
    /// Reads the cells of the next line that is neither empty nor a comment; false at the end.
    fn next(&mut self, record: &str) -> Result<bool, RecordError> {
        let wrong = |reason: String| RecordError::Read { record: record.into(), reason };
        loop {
            self.buffer.clear();
            let read = (&mut self.text).take(LONGEST).read_until(b'\n', &mut self.buffer);
            let read = read.map_err(|e| wrong(e.to_string()))?;
            if read == 0 {
                return Ok(false);
            }
            self.line += 1;
            if read as u64 == LONGEST {
                return Err(wrong(format!("line {} is longer than {LONGEST} bytes", self.line)));
            }
            let text = std::str::from_utf8(&self.buffer)
                .map_err(|_| {
                    let marks = [[0xff, 0xfe], [0xfe, 0xff]];
                    let utf16 = self.line == 1 && marks.iter().any(|m| self.buffer.starts_with(m));
                    let hint = if utf16 { " (it begins as UTF-16 does)" } else { "" };
                    wrong(format!("line {} is no UTF-8 text{hint}", self.line))
                })?
                .trim_end_matches(['\n', '\r']);
            match text.bytes().find(|b| b.is_ascii_control() && *b != b'\t') {
                Some(b'\r') => {
                    let reason = "lines end with CR alone; expected LF or CR LF";
                    return Err(wrong(reason.into()));
                }
                Some(b) => {
                    let reason = format!("line {} has a byte {b:#04x} in it, which no text has", self.line);
                    return Err(wrong(reason));
                }
                None => {}
            }
            if text.trim().is_empty() || text.starts_with('#') {
                continue;
            }
            self.cells.clear();
            if text.contains('"') {
                let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes());
                let cells = reader.records().next().transpose().map_err(|e| wrong(e.to_string()))?;
                self.cells.extend(cells.iter().flatten().map(|c| c.trim().to_string()));
            } else {
                self.cells.extend(text.split(',').map(|c| c.trim().to_string()));
            }
            return Ok(true);
        }
    }
}

/// A record whose header was read.
pub struct Record {
    name: String,
    columns: Vec<Column>,
    rows: Rows,
}

/// A column that is wanted: its index, and what a number of it is times to be in the unit of the caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Which.
    pub column: usize,
    /// In its own unit.
    pub scale: f64,
}

/// One row: the wanted numbers (`None` where the cell is empty) and its label.
#[derive(Debug, Clone, PartialEq)]
pub struct Row<'a> {
    /// Its line from 1.
    pub line: u64,
    /// The wanted numbers in their order.
    pub numbers: &'a [Option<f64>],
    /// The text of the label column.
    pub label: &'a str,
}

impl Record {
    /// A record from a file, with the feature `parquet`: Parquet if it begins so, else CSV.
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
        Self::parquet(name, Box::new(SerializedFileReader::new(file).map_err(|e| wrong(&e))?))
    }

    /// A record from a pipe, with the feature `parquet`: Parquet, which ends with its header and so is read whole, if it begins so, else CSV.
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
        from.read_to_end(&mut begin).map_err(|e| wrong(&e))?;
        let reader = SerializedFileReader::new(bytes::Bytes::from(begin)).map_err(|e| wrong(&e))?;
        Self::parquet(name, Box::new(reader))
    }

    #[cfg(feature = "parquet")]
    fn parquet(name: &str, reader: Box<dyn FileReader>) -> Result<Self, RecordError> {
        let fields = reader.metadata().file_metadata().schema().get_fields();
        let headers: Vec<String> = fields.iter().map(|f| f.name().to_string()).collect();
        Ok(Self { name: name.into(), columns: columns(name, headers, 0)?, rows: Rows::Parquet(reader) })
    }

    /// A record as CSV.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn csv(name: &str, text: Box<dyn Read>) -> Result<Self, RecordError> {
        let wrong =
            |e: &dyn std::fmt::Display| RecordError::Read { record: name.into(), reason: e.to_string() };
        // a mark of the byte order is no part of a name
        let mut text = BufReader::new(text);
        if text.fill_buf().map_err(|e| wrong(&e))?.starts_with(&[0xef, 0xbb, 0xbf]) {
            text.consume(3);
        }
        let mut lines = Lines { text, line: 0, cells: Vec::new(), buffer: Vec::new() };
        if !lines.next(name)? {
            return Err(RecordError::Empty { record: name.into() });
        }
        if let [header] = &lines.cells[..]
            && let Some((_, found)) =
                [(';', "semicolons"), ('\t', "tabs")].into_iter().find(|(c, _)| header.contains(*c))
        {
            return Err(RecordError::Separator { record: name.into(), line: lines.line, found });
        }
        let columns = columns(name, lines.cells.clone(), lines.line)?;
        Ok(Self { name: name.into(), columns, rows: Rows::Csv(lines) })
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Names and units that a file gives the columns.
    ///
    /// # Errors
    /// [`RecordError`] for a column that is not there, two of one name, or a unit that is none.
    pub fn named(mut self, by: &Recording) -> Result<Self, RecordError> {
        let found: Vec<Option<usize>> = by.columns.values().map(|own| self.find(own)).collect();
        for ((name, own), column) in by.columns.iter().zip(found) {
            let column = column
                .ok_or_else(|| self.without(&format!("`{own}`, which record.columns has as `{name}`"), ""))?;
            self.columns[column].name.clone_from(name);
        }
        let twice = |i: &usize| self.columns[..*i].iter().any(|c| c.name == self.columns[*i].name);
        if let Some(i) = (0..self.columns.len()).find(twice) {
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

    /// The index of the column of this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c.name == name)
    }

    /// What a number of a column is times to be in the first of `units`, which are given with what one of each is of the first.
    ///
    /// # Errors
    /// [`RecordError::Unit`].
    pub fn wanted(&self, column: usize, units: &[(&str, f64)]) -> Result<Wanted, RecordError> {
        let own = &self.columns[column];
        let found = own.unit.as_ref().and_then(|u| units.iter().find(|(name, _)| name == u));
        found.map(|&(_, scale)| Wanted { column, scale: scale * own.count }).ok_or_else(|| {
            let each: Vec<String> = units.iter().map(|(u, _)| format!("`{} [{u}]`", own.name)).collect();
            self.unit(column, format!("a unit, {}", each.join(" or ")))
        })
    }

    /// A column of another unit than is expected.
    pub(crate) fn unit(&self, column: usize, expected: String) -> RecordError {
        RecordError::Unit { place: self.at(1, column), expected }
    }

    /// A column that is not there, nor under another name.
    pub fn missing(&self, expected: &str) -> RecordError {
        self.without(expected, "; a column of another name is given under [record.columns]")
    }

    fn without(&self, expected: &str, hint: &'static str) -> RecordError {
        let found: Vec<String> = self.columns.iter().map(|c| format!("`{}`", c.text)).collect();
        RecordError::Missing {
            record: self.name.clone(),
            expected: expected.into(),
            found: found.join(", "),
            hint,
        }
    }

    fn at(&self, line: u64, column: usize) -> Place {
        place(&self.name, line, &self.columns[column].text)
    }

    /// Goes through all rows: of each the `wanted` numbers and the text of the `label` column. The first wanted is the time, which must be there and
    /// increase; it may begin anew with another label where `anew` says so.
    ///
    /// Gives the digest by which two records are the same, the first half of SHA-256 (FIPS 180-4) in hexadecimal. It is of the `wanted` numbers alone, in the units
    /// of the caller and row by row: neither other columns nor labels, names, comments or the kind of file are in it, so that a record to which somebody adds a
    /// column of notes, or which he saves in another format, is still the same.
    ///
    /// # Errors
    /// [`RecordError`], and what `each` refuses.
    pub fn read<E: From<RecordError>>(
        self,
        wanted: &[Wanted],
        label: Option<usize>,
        anew: bool,
        mut each: impl FnMut(Row<'_>) -> Result<(), E>,
    ) -> Result<String, E> {
        let Self { name, columns, rows } = self;
        let mut digest = Sha256::new();
        let mut before = f64::NEG_INFINITY;
        let mut last = String::new();
        let mut any = false;
        let mut row = |line: u64, cell: &mut dyn FnMut(usize) -> Cell, label: &str| -> Result<(), E> {
            let mut numbers = [None; MOST];
            for (i, (slot, w)) in numbers.iter_mut().zip(wanted).enumerate() {
                let at = || place(&name, line, &columns[w.column].text);
                *slot = match cell(w.column) {
                    Cell::Number(x) if x.is_finite() => Some(x * w.scale),
                    Cell::Number(x) => {
                        let expected = "a finite number (an empty cell is a value that is not there)";
                        return Err(RecordError::Value { place: at(), found: x.to_string(), expected }.into());
                    }
                    Cell::Nothing => None,
                    Cell::Text(found) => {
                        let expected = if i == 0 { TIME } else { "a number" };
                        return Err(RecordError::Number { place: at(), expected, found }.into());
                    }
                };
            }
            let at = || place(&name, line, &columns[wanted[0].column].text);
            let Some(t) = numbers[0] else {
                return Err(RecordError::Number { place: at(), expected: TIME, found: String::new() }.into());
            };
            if anew && label != last {
                before = f64::NEG_INFINITY;
                last = label.into();
            }
            if t <= before {
                // as they are written, but for rounding
                let written = |t: f64| (t / wanted[0].scale * 1e9).round() / 1e9;
                let (found, before) = (written(t).to_string(), written(before).to_string());
                return Err(RecordError::Time { place: at(), found, before }.into());
            }
            (before, any) = (t, true);
            // what is not there is NaN
            for x in &numbers[..wanted.len()] {
                digest.update((x.unwrap_or(f64::NAN) + 0.0).to_le_bytes());
            }
            each(Row { line, numbers: &numbers[..wanted.len()], label })
        };
        match rows {
            Rows::Csv(mut lines) => {
                while lines.next(&name)? {
                    let (line, cells) = (lines.line, &lines.cells);
                    if cells.len() != columns.len() {
                        let (found, expected) = (cells.len(), columns.len());
                        return Err(
                            RecordError::Cells { place: place(&name, line, ""), found, expected }.into()
                        );
                    }
                    let mut cell = |i: usize| match cells[i].as_str() {
                        "" => Cell::Nothing,
                        text => text.parse().map_or_else(|_| Cell::Text(text.into()), Cell::Number),
                    };
                    row(line, &mut cell, label.map_or("", |i| &cells[i]))?;
                }
            }
            #[cfg(feature = "parquet")]
            Rows::Parquet(reader) => {
                let wrong = |e: parquet::errors::ParquetError| RecordError::Read {
                    record: name.clone(),
                    reason: e.to_string(),
                };
                for (i, read) in reader.get_row_iter(None).map_err(wrong)?.enumerate() {
                    let read = read.map_err(wrong)?;
                    let fields: Vec<&Field> = read.get_column_iter().map(|(_, f)| f).collect();
                    let label = label.map_or_else(String::new, |i| text_of(fields[i]));
                    row(i as u64 + 1, &mut |i| Cell::of(fields[i]), &label)?;
                }
            }
        }
        if !any {
            return Err(RecordError::NoRows { record: name }.into());
        }
        Ok(digest.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect())
    }
}

/// Most numbers that are wanted of a row.
pub const MOST: usize = 64;

/// What a time is.
const TIME: &str = "a number, the time since any moment";

/// What a cell holds.
enum Cell {
    Number(f64),
    Nothing,
    Text(String),
}

#[cfg(feature = "parquet")]
impl Cell {
    fn of(field: &Field) -> Self {
        match field {
            Field::Double(x) => Self::Number(*x),
            Field::Float(x) => Self::Number(f64::from(*x)),
            Field::Int(x) => Self::Number(f64::from(*x)),
            Field::Short(x) => Self::Number(f64::from(*x)),
            Field::UInt(x) => Self::Number(f64::from(*x)),
            Field::UShort(x) => Self::Number(f64::from(*x)),
            Field::Long(x) => Self::Number(*x as f64),
            Field::ULong(x) => Self::Number(*x as f64),
            Field::Null => Self::Nothing,
            other => Self::Text(other.to_string()),
        }
    }
}

/// A label of Parquet.
#[cfg(feature = "parquet")]
fn text_of(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(s) => s.trim().into(),
        other => other.to_string(),
    }
}

fn place(record: &str, line: u64, column: &str) -> Place {
    Place { record: record.into(), line, column: column.into() }
}

/// The columns of headers, each once.
fn columns(record: &str, headers: Vec<String>, line: u64) -> Result<Vec<Column>, RecordError> {
    let mut out: Vec<Column> = Vec::new();
    for text in headers {
        let found = Column::of(&text).filter(|c| out.iter().all(|o| o.name != c.name));
        out.push(found.ok_or_else(|| RecordError::Header { place: place(record, line, text.trim()) })?);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Line, numbers, label.
    type Read = (u64, Vec<Option<f64>>, String);

    fn all(text: &str) -> Result<Vec<Read>, RecordError> {
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
        let rows = all("\u{feff}# made by hand\nt [ms], f [g] ,position\n500,1.5,p1\n# a gap\n1500,,\n2500.5,-1e-3,p 2\n").expect("rows");
        assert_eq!(rows[0], (3, vec![Some(0.5), Some(1.5)], "p1".to_string()));
        assert_eq!(rows[1], (5, vec![Some(1.5), None], String::new()));
        assert_eq!(rows[2], (6, vec![Some(2.5005), Some(-1e-3)], "p 2".to_string()));
    }

    /// Names and counts that a file gives.
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
                "r.csv: no column `f [g]`; found `t [s]`, `g [g]`; a column of another name is given under [record.columns]",
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
                "r.csv: line 2, column `f [g]`: found NaN, expected a finite number (an empty cell is a value that is not there)",
            ),
            (
                "t [s];f [g]\n0;1\n",
                "r.csv: line 1: the columns are parted by semicolons; expected commas (and points in numbers)",
            ),
            (
                "t [ms],f [g]\n100,1\n100,1\n",
                "r.csv: line 3, column `t [ms]`: the time 100 is not after that of the row before, 100; expected times that increase",
            ),
            (
                "t [s],f [g]\n,1\n",
                "r.csv: line 2, column `t [s]`: expected a number, the time since any moment, found ``",
            ),
            ("t [s],f [g]\n0,1\n0.5\n", "r.csv: line 3: 1 cells; expected 2, as in the header"),
            (
                "t [s],f [g]\n0,1\n0,1\n",
                "r.csv: line 3, column `t [s]`: the time 0 is not after that of the row before, 0; expected times that increase",
            ),
        ] {
            assert_eq!(all(text).expect_err(text).to_string(), message);
        }
    }
}

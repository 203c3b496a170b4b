//! Cells of a record as numbers: checks of the rows, and values of Parquet.

#[cfg(feature = "parquet")]
use parquet::record::Field;
use sha2::{Digest, Sha256};

use super::columns::{MOST, RecordColumn, TIME, TIME_INDEX, Wanted, place};
use super::error::{RecordError, RecordPlace};

/// Check of the rows of a record, one after the other, with their digest.
pub(super) struct RowCheck<'a> {
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
    pub(super) fn new(
        record: &'a str,
        columns: &'a [RecordColumn],
        wanted: &'a [Wanted],
        anew: bool,
    ) -> Self {
        let (digest, before, last) = (Sha256::new(), f64::NEG_INFINITY, String::new());
        Self { record, columns, wanted, anew, digest, before, last, any: false }
    }

    /// Place of the requested number `i` in a line.
    fn at(&self, line: u64, i: usize) -> RecordPlace {
        place(self.record, line, &self.columns[self.wanted[i].column].text)
    }

    /// Requested numbers of a row, whose time is after that of the row before.
    pub(super) fn numbers(
        &mut self,
        line: u64,
        cell: &mut dyn FnMut(usize) -> CellContent,
        label: &str,
    ) -> Result<[Option<f64>; MOST], RecordError> {
        let mut numbers = [None; MOST];
        for (i, (slot, w)) in numbers.iter_mut().zip(self.wanted).enumerate() {
            *slot = self.number(line, i, cell(w.column))?;
        }
        let Some(t) = numbers[TIME_INDEX] else {
            let (place, found) = (self.at(line, TIME_INDEX), String::new());
            return Err(RecordError::Number { place, expected: TIME, found });
        };
        if self.anew && label != self.last {
            self.before = f64::NEG_INFINITY;
            self.last = label.into();
        }
        if t <= self.before {
            // as written, without the rounding of the scale
            let written = |t: f64| (t / self.wanted[TIME_INDEX].scale * 1e9).round() / 1e9;
            let (found, before) = (written(t).to_string(), written(self.before).to_string());
            return Err(RecordError::Time { place: self.at(line, TIME_INDEX), found, before });
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
                let expected = if i == TIME_INDEX { TIME } else { "a number" };
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
    pub(super) fn digest(self) -> Result<String, RecordError> {
        if !self.any {
            return Err(RecordError::NoRows { record: self.record.into() });
        }
        Ok(self.digest.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect())
    }
}

/// Content of a cell.
pub(super) enum CellContent {
    Number(f64),
    Nothing,
    Text(String),
}

#[cfg(feature = "parquet")]
impl CellContent {
    pub(super) fn of(field: &Field) -> Self {
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
pub(super) fn decimal(bytes: &[u8], scale: i32) -> CellContent {
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
pub(super) fn text_of(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(s) => s.trim().into(),
        other => other.to_string(),
    }
}

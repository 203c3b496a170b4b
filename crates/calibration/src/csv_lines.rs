//! Lines of CSV with their cells, and the numbers and dates in these.

use std::io::{BufRead, BufReader, Read};

/// Longest line, in bytes.
const LONGEST: u64 = 1 << 20;

/// Lines of CSV with their numbers.
pub(crate) struct Lines {
    text: BufReader<Box<dyn Read>>,
    /// Number of the last line.
    pub(crate) line: u64,
    /// Cells of the last line.
    pub(crate) cells: Vec<String>,
    buffer: Vec<u8>,
    /// Separator of columns.
    pub(crate) separator: char,
    /// True if the cells belong to a row that has not been returned yet.
    pub(crate) held: bool,
}

/// Separators of columns besides the comma, with their names.
pub(crate) const SEPARATORS: [(char, &str); 2] = [(';', "semicolons"), ('\t', "tabs")];

/// Number in a cell: with a decimal comma where another character separates the columns.
pub(crate) fn number(text: &str, separator: char) -> Option<f64> {
    if separator != ','
        && let Some((whole, part)) = text.split_once(',')
        && !text.contains('.')
    {
        return format!("{whole}.{part}").parse().ok();
    }
    text.parse().ok()
}

/// Text of the line of this number, without its end.
///
/// # Errors
/// The reason, in words.
fn line_text(bytes: &[u8], line: u64) -> Result<&str, String> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| {
            let marks = [[0xff, 0xfe], [0xfe, 0xff]];
            let utf16 = line == 1 && marks.iter().any(|m| bytes.starts_with(m));
            let hint = if utf16 { " (it begins as UTF-16 does)" } else { "" };
            format!("line {line} is no UTF-8 text{hint}")
        })?
        .trim_end_matches(['\n', '\r']);
    match text.bytes().find(|b| b.is_ascii_control() && *b != b'\t') {
        Some(b'\r') => Err("lines end with CR alone; expected LF or CR LF".into()),
        Some(b) => Err(format!("line {line} has a byte {b:#04x} in it, which no text has")),
        None => Ok(text),
    }
}

/// Splits a line into `cells`, whose strings are reused.
///
/// # Errors
/// The reason, in words.
fn split(text: &str, separator: char, cells: &mut Vec<String>) -> Result<(), String> {
    if text.contains('"') {
        cells.clear();
        let mut builder = csv::ReaderBuilder::new();
        let builder = builder.has_headers(false).delimiter(separator as u8);
        let mut reader = builder.from_reader(text.as_bytes());
        let found = reader.records().next().transpose().map_err(|e| e.to_string())?;
        cells.extend(found.iter().flatten().map(|c| c.trim().to_string()));
        return Ok(());
    }
    let mut count = 0;
    for cell in text.split(separator).map(str::trim) {
        match cells.get_mut(count) {
            Some(own) => {
                own.clear();
                own.push_str(cell);
            }
            None => cells.push(cell.into()),
        }
        count += 1;
    }
    cells.truncate(count);
    Ok(())
}

impl Lines {
    /// Lines of a text from its first.
    pub(crate) fn new(text: BufReader<Box<dyn Read>>) -> Self {
        Self { text, line: 0, cells: Vec::new(), buffer: Vec::new(), separator: '\0', held: false }
    }

    /// Reads the cells of the next line that is neither empty nor a comment; false at the end.
    ///
    /// # Errors
    /// The reason, in words.
    pub(crate) fn next(&mut self) -> Result<bool, String> {
        if std::mem::take(&mut self.held) {
            return Ok(true);
        }
        while self.next_line()? {
            let text = line_text(&self.buffer, self.line)?;
            if text.trim().is_empty() || text.starts_with('#') {
                continue;
            }
            if self.separator == '\0' {
                let other = SEPARATORS.iter().find(|(c, _)| !text.contains(',') && text.contains(*c));
                self.separator = other.map_or(',', |(c, _)| *c);
            }
            split(text, self.separator, &mut self.cells)?;
            return Ok(true);
        }
        Ok(false)
    }

    /// Reads the next line into the buffer; false at the end.
    ///
    /// # Errors
    /// The reason, in words.
    fn next_line(&mut self) -> Result<bool, String> {
        self.buffer.clear();
        let read = (&mut self.text).take(LONGEST).read_until(b'\n', &mut self.buffer);
        let read = read.map_err(|e| e.to_string())?;
        if read == 0 {
            return Ok(false);
        }
        self.line += 1;
        if read as u64 == LONGEST {
            return Err(format!("line {} is longer than {LONGEST} bytes", self.line));
        }
        Ok(true)
    }
}

/// Seconds since 1970-01-01T00:00Z of a date with a time (ISO 8601, UTC where no offset is given), such as
/// `2026-11-23T10:00:00.25+01:00`; a blank may replace T. A date with points is day, month, year.
pub(crate) fn unix_seconds(text: &str) -> Option<f64> {
    let (date, time) = text.split_once(['T', ' '])?;
    let whole = |text: &str, digits: usize| {
        let is = text.len() == digits && text.bytes().all(|b| b.is_ascii_digit());
        text.parse::<i64>().ok().filter(|_| is)
    };
    let mut parts: Vec<&str> = date.split('-').collect();
    if date.contains('.') {
        parts = date.rsplit('.').collect();
    }
    let &[year, month, day] = &parts[..] else { return None };
    let (year, month, day) = (whole(year, 4)?, whole(month, 2)?, whole(day, 2)?);
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = [31, if leap { 29 } else { 28 }, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let valid = (1..=12).contains(&month) && (1..=*days.get(month as usize - 1)?).contains(&day);
    if !valid {
        return None;
    }
    let (time, offset) = match time.find(['Z', '+', '-']) {
        None => (time, 0),
        Some(at) if &time[at..] == "Z" => (&time[..at], 0),
        Some(at) => {
            let sign = if time[at..].starts_with('-') { -1 } else { 1 };
            let (h, m) = time[at + 1..].split_once(':').unwrap_or((&time[at + 1..], "00"));
            (&time[..at], sign * (3600 * whole(h, 2)? + 60 * whole(m, 2)?))
        }
    };
    let mut parts = time.split(':');
    let (hour, minute) = (whole(parts.next()?, 2)?, whole(parts.next()?, 2)?);
    let second = match parts.next() {
        Some(text) if text.starts_with(|c: char| c.is_ascii_digit()) => {
            text.replacen(',', ".", 1).parse::<f64>().ok()?
        }
        Some(_) => return None,
        None => 0.0,
    };
    if parts.next().is_some() || hour > 23 || minute > 59 || second >= 61.0 {
        return None;
    }
    // days of whole years since 1970, by leap years before
    let leaps = |y: i64| y.div_euclid(4) - y.div_euclid(100) + y.div_euclid(400);
    let before: i64 = days[..month as usize - 1].iter().sum();
    let day = 365 * (year - 1970) + leaps(year - 1) - leaps(1969) + before + day - 1;
    Some((86400 * day + 3600 * hour + 60 * minute - offset) as f64 + second)
}

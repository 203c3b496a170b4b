//! Headings, tables and lists, in every text format. Text from files is escaped where it is written.

use comfy_table::{Cell, CellAlignment};

use crate::table::{heading, paragraph, table as new_table};
use crate::{Layout, ReportError, csv_text, latex, markdown};

/// A part of a document.
pub(crate) enum Block {
    /// A table; columns of numbers are set flush right.
    Table {
        heading: String,
        header: Vec<&'static str>,
        /// Whether a column holds numbers.
        numbers: Vec<bool>,
        rows: Vec<Vec<String>>,
    },
    /// Lines, wrapped.
    List { heading: String, lines: Vec<String> },
}

/// A title and its parts.
pub(crate) struct Document {
    pub(crate) title: String,
    pub(crate) lead: Vec<String>,
    pub(crate) blocks: Vec<Block>,
}

/// A number with four significant digits.
pub(crate) fn number(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 {
        "0".into()
    } else if !(1e-3..1e5).contains(&magnitude) {
        format!("{x:.3e}")
    } else {
        let decimals = (3 - magnitude.log10().floor() as i32).clamp(0, 6) as usize;
        format!("{x:.decimals$}")
    }
}

/// A number, or a dash.
pub(crate) fn optional(x: Option<f64>) -> String {
    x.map_or_else(|| "-".into(), number)
}

impl Document {
    pub(crate) fn table(&self, layout: Layout) -> String {
        let mut out = String::new();
        heading(&mut out, &self.title, layout);
        for line in &self.lead {
            paragraph(&mut out, line, layout);
        }
        for block in &self.blocks {
            match block {
                Block::Table { heading: title, header, numbers, rows } => {
                    heading(&mut out, title, layout);
                    let mut table = new_table(header, layout);
                    for row in rows {
                        let cell = |(text, &right): (&String, &bool)| {
                            let side = if right { CellAlignment::Right } else { CellAlignment::Left };
                            Cell::new(text).set_alignment(side)
                        };
                        table.add_row(row.iter().zip(numbers).map(cell).collect::<Vec<_>>());
                    }
                    let text = table.to_string();
                    out.extend(text.lines().flat_map(|l| [l.trim_end(), "\n"]));
                }
                Block::List { heading: title, lines } => {
                    heading(&mut out, title, layout);
                    for line in lines {
                        paragraph(&mut out, line, layout);
                    }
                }
            }
        }
        out
    }

    pub(crate) fn markdown(&self) -> String {
        let mut out = format!("# {}\n\n", markdown::escape(&self.title));
        for line in &self.lead {
            out.push_str(&format!("{}\n\n", markdown::escape(line)));
        }
        for (i, block) in self.blocks.iter().enumerate() {
            let gap = if i == 0 { "" } else { "\n" };
            match block {
                Block::Table { heading, header, rows, .. } => {
                    let cells = rows.iter().map(|r| r.iter().map(|c| markdown::escape(c)).collect());
                    let table = markdown::table(header, cells);
                    out.push_str(&format!("{gap}## {}\n\n{table}", markdown::escape(heading)));
                }
                Block::List { heading, lines } => {
                    out.push_str(&format!("{gap}## {}\n\n", markdown::escape(heading)));
                    for line in lines {
                        out.push_str(&format!("- {}\n", markdown::escape(line)));
                    }
                }
            }
        }
        out
    }

    pub(crate) fn latex(&self) -> String {
        let mut out = format!("% {}\n", self.title.replace('\n', " "));
        let item = |lines: &[String]| {
            let items: String = lines.iter().map(|l| format!("\\item {}\n", latex::escape(l))).collect();
            format!("\\begin{{itemize}}\n{items}\\end{{itemize}}\n")
        };
        if !self.lead.is_empty() {
            out.push_str(&item(&self.lead));
        }
        for block in &self.blocks {
            match block {
                Block::Table { heading, header, numbers, rows } => {
                    let columns: String = numbers.iter().map(|&n| if n { 'r' } else { 'l' }).collect();
                    let cells = rows.iter().map(|r| r.iter().map(|c| latex::escape(c)).collect::<Vec<_>>());
                    out.push_str(&format!("\\paragraph{{{}}}\n", latex::escape(heading)));
                    out.push_str(&latex::table(&columns, header, cells));
                }
                Block::List { heading, lines } => {
                    out.push_str(&format!("\\paragraph{{{}}}\n", latex::escape(heading)));
                    if !lines.is_empty() {
                        out.push_str(&item(lines));
                    }
                }
            }
        }
        out
    }

    /// The first table.
    pub(crate) fn csv(&self) -> Result<String, ReportError> {
        let first = self.blocks.iter().find_map(|b| match b {
            Block::Table { header, rows, .. } => Some((header, rows)),
            Block::List { .. } => None,
        });
        let Some((header, rows)) = first else { return Ok(String::new()) };
        let header = header.iter().map(ToString::to_string).collect();
        csv_text::write(std::iter::once(header).chain(rows.iter().cloned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits() {
        let shown = [0.0, 12.0, -0.0231, 123456.0, 1e-5, 0.00123, 99999.0].map(number);
        assert_eq!(shown, ["0", "12.00", "-0.02310", "1.235e5", "1.000e-5", "0.001230", "99999"]);
    }
}

//! Headings, tables and lists, in every text format. Text from files is escaped where it is written.

use comfy_table::CellAlignment;

use crate::figure::Figure;
use crate::table::{cell, heading, paragraph, table as new_table};
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
    /// The heading of a part (level 1) or of a section of it (level 2).
    Section { level: usize, title: String },
    /// A paragraph.
    Text(String),
    /// Formulas, each with its left side.
    Formulas { heading: String, lines: Vec<Typeset> },
    /// A picture.
    Picture(Picture),
    /// What a reader must know first, a box for each scheme or model.
    Status(Vec<Status>),
}

/// The state of one scheme or model at a glance.
pub(crate) struct Status {
    /// Whose it is.
    pub(crate) title: String,
    /// A row per question.
    pub(crate) rows: Vec<Finding>,
}

/// The answer to one question.
pub(crate) struct Finding {
    pub(crate) what: &'static str,
    pub(crate) grade: Grade,
    pub(crate) text: String,
}

/// What an answer means.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Grade {
    /// As it should be.
    Good,
    /// It limits what the rest is worth.
    Limited,
    /// What was asked for is not there.
    Missed,
    /// Nobody knows: not computed, not taken.
    Open,
}

impl Grade {
    pub(crate) fn mark(self) -> &'static str {
        match self {
            Self::Good => "ok",
            Self::Limited => "LIMITED",
            Self::Missed => "NOT MET",
            Self::Open => "open",
        }
    }
}

impl Status {
    /// The box as a table, for formats that have no boxes.
    fn table(&self) -> Block {
        let row = |f: &Finding| vec![f.what.into(), f.grade.mark().into(), f.text.clone()];
        Block::Table {
            heading: format!("Status: {}", self.title),
            header: vec!["question", "status", "finding"],
            numbers: vec![false; 3],
            rows: self.rows.iter().map(row).collect(),
        }
    }
}

/// A formula in program notation and as LaTeX.
pub(crate) struct Typeset {
    pub(crate) text: String,
    pub(crate) latex: String,
}

/// A picture with a caption, and its place relative to the text, without an ending.
pub(crate) struct Picture {
    pub(crate) name: String,
    pub(crate) caption: String,
    pub(crate) drawing: Drawing,
}

/// What is drawn.
pub(crate) enum Drawing {
    /// Curves, which a page may make interactive.
    Curves(Box<Figure>),
    /// A picture as it is, SVG.
    Still(String),
}

impl Picture {
    pub(crate) fn svg(&self) -> String {
        match &self.drawing {
            Drawing::Curves(figure) => figure.svg(),
            Drawing::Still(svg) => svg.clone(),
        }
    }
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

/// A block, or pictures that stand together.
pub(crate) enum Part<'a> {
    Block(&'a Block),
    Pictures(Vec<&'a Picture>),
}

impl Document {
    /// The same with status boxes as tables.
    pub(crate) fn plain(mut self) -> Self {
        let tables = |b: Block| match b {
            Block::Status(boxes) => boxes.iter().map(Status::table).collect(),
            other => vec![other],
        };
        self.blocks = self.blocks.into_iter().flat_map(tables).collect();
        self
    }

    /// The blocks, with pictures that follow each other taken together.
    pub(crate) fn parts(&self) -> Vec<Part<'_>> {
        let mut out: Vec<Part<'_>> = Vec::new();
        for block in &self.blocks {
            match (block, out.last_mut()) {
                (Block::Picture(p), Some(Part::Pictures(list))) => list.push(p),
                (Block::Picture(p), _) => out.push(Part::Pictures(vec![p])),
                (block, _) => out.push(Part::Block(block)),
            }
        }
        out
    }

    /// The same with all pictures in `folder`.
    pub(crate) fn with_pictures_in(mut self, folder: &str) -> Self {
        for block in &mut self.blocks {
            if let Block::Picture(p) = block {
                p.name = format!("{folder}/{}", p.name);
            }
        }
        self
    }

    pub(crate) fn pictures(&self) -> impl Iterator<Item = &Picture> {
        self.blocks.iter().filter_map(|b| match b {
            Block::Picture(p) => Some(p),
            _ => None,
        })
    }

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
                        let aligned = |(text, &right): (&String, &bool)| {
                            let side = if right { CellAlignment::Right } else { CellAlignment::Left };
                            cell(text).set_alignment(side)
                        };
                        table.add_row(row.iter().zip(numbers).map(aligned).collect::<Vec<_>>());
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
                Block::Section { title, .. } => heading(&mut out, title, layout),
                Block::Text(text) => paragraph(&mut out, text, layout),
                Block::Formulas { heading: title, lines } => {
                    heading(&mut out, title, layout);
                    for line in lines {
                        paragraph(&mut out, &line.text, layout);
                    }
                }
                // a status is a table by now
                Block::Picture(_) | Block::Status(_) => {}
            }
        }
        out
    }

    pub(crate) fn markdown(&self) -> String {
        let mut out = format!("# {}\n\n", markdown::escape(&self.title));
        for line in &self.lead {
            out.push_str(&format!("{}\n\n", markdown::escape(line)));
        }
        let sections = self.blocks.iter().any(|b| matches!(b, Block::Section { .. }));
        let hashes = if sections { "####" } else { "##" };
        for (i, block) in self.blocks.iter().enumerate() {
            let gap = if i == 0 { "" } else { "\n" };
            match block {
                Block::Table { heading, header, rows, .. } => {
                    let cells = rows.iter().map(|r| r.iter().map(|c| markdown::escape(c)).collect());
                    let table = markdown::table(header, cells);
                    out.push_str(&format!("{gap}{hashes} {}\n\n{table}", markdown::escape(heading)));
                }
                Block::List { heading, lines } => {
                    if heading.is_empty() {
                        out.push_str(gap);
                    } else {
                        out.push_str(&format!("{gap}{hashes} {}\n\n", markdown::escape(heading)));
                    }
                    for line in lines {
                        out.push_str(&format!("- {}\n", markdown::escape(line)));
                    }
                }
                Block::Section { level, title } => {
                    out.push_str(&format!("{gap}{} {}\n", "#".repeat(level + 1), markdown::escape(title)));
                }
                Block::Text(text) => out.push_str(&format!("{gap}{}\n", markdown::escape(text))),
                Block::Formulas { heading, lines } => {
                    out.push_str(&format!("{gap}{hashes} {}\n\n", markdown::escape(heading)));
                    for line in lines {
                        out.push_str(&format!("- ${}$\n", line.latex));
                    }
                }
                Block::Picture(p) => {
                    let caption = markdown::escape(&p.caption);
                    out.push_str(&format!("{gap}![{caption}]({}.svg)\n", p.name));
                }
                Block::Status(_) => {}
            }
        }
        out
    }

    pub(crate) fn latex(&self) -> String {
        let mut out = format!("% {}\n", latex::escape(&self.title));
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
                    // a column of sentences is wrapped
                    const LONG: usize = 70;
                    let long = |k: usize| rows.iter().any(|r| r[k].chars().count() > LONG);
                    let column = |(k, &number): (usize, &bool)| match number {
                        true => "r",
                        false if long(k) => "p{.5\\linewidth}",
                        false => "l",
                    };
                    let columns: String = numbers.iter().enumerate().map(column).collect();
                    let cells = rows.iter().map(|r| r.iter().map(|c| latex::escape(c)).collect::<Vec<_>>());
                    out.push_str(&format!("\\paragraph{{{}}}\n", latex::escape(heading)));
                    let header: Vec<String> = header.iter().map(|h| latex::escape(h)).collect();
                    let header: Vec<&str> = header.iter().map(String::as_str).collect();
                    out.push_str(&latex::table(&columns, &header, cells));
                }
                Block::List { heading, lines } => {
                    if !heading.is_empty() {
                        out.push_str(&format!("\\paragraph{{{}}}\n", latex::escape(heading)));
                    }
                    if !lines.is_empty() {
                        out.push_str(&item(lines));
                    }
                }
                Block::Section { level, title } => {
                    let command = if *level == 1 { "section" } else { "subsection" };
                    out.push_str(&format!("\\{command}*{{{}}}\n", latex::escape(title)));
                }
                Block::Text(text) => out.push_str(&format!("{}\n\n", latex::escape(text))),
                Block::Formulas { heading, lines } => {
                    let items: String = lines.iter().map(|l| format!("\\item ${}$\n", l.latex)).collect();
                    out.push_str(&format!(
                        "\\paragraph{{{}}}\n\\begin{{itemize}}\n{items}\\end{{itemize}}\n",
                        latex::escape(heading)
                    ));
                }
                Block::Picture(p) => out.push_str(&format!(
                    "\\begin{{center}}\\includegraphics[width=.8\\linewidth,height=.35\\textheight,keepaspectratio]{{{}.png}}\\\\{}\\end{{center}}\n",
                    p.name,
                    latex::escape(&p.caption)
                )),
                Block::Status(_) => {}
            }
        }
        out
    }

    /// The first table.
    pub(crate) fn csv(&self) -> Result<String, ReportError> {
        let first = self.blocks.iter().find_map(|b| match b {
            Block::Table { header, rows, .. } => Some((header, rows)),
            _ => None,
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

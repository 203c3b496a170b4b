//! The table for the terminal.

use std::borrow::Cow;

use comfy_table::{Cell, CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};

use crate::document::{Document, DocumentBlock, TableCell, TableColumn};
use crate::{TerminalLayout, visible};

/// Table with one line under the header and no other.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// Section heading; nothing if it is empty.
fn heading(out: &mut String, text: &str, layout: TerminalLayout) {
    if text.is_empty() {
        return;
    }
    if !out.is_empty() {
        out.push('\n');
    }
    for line in wrapped(text, layout, "", "  ") {
        if layout.color {
            out.push_str(&format!("\u{1b}[1m{line}\u{1b}[0m\n"));
        } else {
            out.push_str(&format!("{line}\n"));
        }
    }
}

/// Adds lines with a hanging indent.
fn paragraph(out: &mut String, text: &str, layout: TerminalLayout) {
    for line in wrapped(text, layout, "  ", "      ") {
        out.push_str(&line);
        out.push('\n');
    }
}

/// Lines of the layout's width, broken between words, with one indent for the first and another for the rest.
fn wrapped(text: &str, layout: TerminalLayout, first: &str, others: &str) -> Vec<String> {
    let width = layout.width.map_or(usize::MAX, usize::from).max(20);
    let (mut lines, mut line, mut empty) = (Vec::new(), String::from(first), true);
    for word in visible(text).split(' ') {
        if !empty && line.chars().count() + 1 + word.chars().count() > width {
            lines.push(line.trim_end().to_string());
            line = String::from(others);
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line.push_str(word);
        empty = false;
    }
    lines.push(line.trim_end().to_string());
    lines
}

fn table(out: &mut String, columns: &[TableColumn], rows: &[Vec<TableCell>], layout: TerminalLayout) {
    let mut table = Table::new();
    table.load_style(STYLE).set_header(columns.iter().map(|c| visible(&c.name)));
    if let Some(width) = layout.width {
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(width);
    }
    for row in rows {
        let aligned = row.iter().zip(columns).map(|(cell, column)| {
            let side = if column.number { CellAlignment::Right } else { CellAlignment::Left };
            let graded = layout.color && GRADED.contains(&column.name.as_ref());
            let text = if graded { marked(&cell.text) } else { visible(&cell.text) };
            Cell::new(text).set_alignment(side)
        });
        table.add_row(aligned);
    }
    for line in table.to_string().lines() {
        let coloured =
            COLOURS.iter().fold(line.trim_end().to_string(), |l, (mark, code, _)| l.replace(*mark, code));
        out.push_str(&coloured.replace(END, "\u{1b}[0m"));
        out.push('\n');
    }
}

/// Columns whose words are coloured by grade.
const GRADED: [&str; 4] = ["status", "verdict", "outcome", "finding"];

/// Colours: a mark without width that stands for the colour, its code, and the words that have it. No
/// information is in a colour alone.
const COLOURS: [(char, &str, &[&str]); 3] = [
    ('\u{2062}', "\u{1b}[32m", &["observable", "agree", "agrees", "ok", "met", "consistent"]),
    (
        '\u{2063}',
        "\u{1b}[33m",
        &["inseparable", "not seen", "LIMITED", "not resolvable", "open", "with a condition"],
    ),
    (
        '\u{2064}',
        "\u{1b}[31m",
        &["not excited", "disagree", "disagrees", "NOT MET", "missed", "inconsistent"],
    ),
];

/// The mark of the end of a colour.
const END: char = '\u{2061}';

/// A graded text with every word between marks, so that it can be wrapped.
fn marked(text: &str) -> Cow<'_, str> {
    match COLOURS.iter().find(|(.., words)| words.contains(&text)) {
        Some((mark, ..)) => {
            let words: Vec<String> = text.split(' ').map(|word| format!("{mark}{word}{END}")).collect();
            Cow::Owned(words.join(" "))
        }
        None => visible(text),
    }
}

/// Writes blocks; `left_out` receives the headings of details that are not written.
fn blocks(out: &mut String, all: &[DocumentBlock], layout: TerminalLayout, left_out: &mut Vec<String>) {
    for block in all {
        match block {
            DocumentBlock::Table { heading: title, columns, rows } => {
                heading(out, title, layout);
                table(out, columns, rows, layout);
            }
            DocumentBlock::List { heading: title, lines } => {
                heading(out, title, layout);
                lines.iter().for_each(|line| paragraph(out, line, layout));
            }
            DocumentBlock::Section { title, .. } => heading(out, title, layout),
            DocumentBlock::Text(text) => paragraph(out, text, layout),
            DocumentBlock::Formulas { heading: title, lines } => {
                heading(out, title, layout);
                lines.iter().for_each(|line| paragraph(out, &line.text, layout));
            }
            DocumentBlock::Fold(fold) if fold.printed || !layout.brief => {
                blocks(out, &fold.blocks, layout, left_out);
            }
            DocumentBlock::Fold(fold) => left_out.extend(fold.blocks.iter().filter_map(short_heading)),
            // a status is a table here
            DocumentBlock::Picture(_) | DocumentBlock::Status(_) | DocumentBlock::NewPage => {}
        }
    }
}

/// Heading of a block, without what explains it in brackets or behind a colon; `None` without a heading.
fn short_heading(block: &DocumentBlock) -> Option<String> {
    let (DocumentBlock::Table { heading, .. }
    | DocumentBlock::List { heading, .. }
    | DocumentBlock::Formulas { heading, .. }) = block
    else {
        return None;
    };
    let short = heading.split([':', '(', ';']).next().unwrap_or_default().trim();
    (!short.is_empty()).then(|| short.into())
}

pub(crate) fn document(d: &Document, layout: TerminalLayout) -> String {
    let mut out = String::new();
    heading(&mut out, &d.title, layout);
    for line in &d.lead {
        paragraph(&mut out, line, layout);
    }
    let mut left_out = Vec::new();
    blocks(&mut out, &d.blocks, layout, &mut left_out);
    if !left_out.is_empty() {
        out.push('\n');
        left_out.dedup();
        paragraph(&mut out, &format!("--details prints: {}", left_out.join("; ")), layout);
    }
    if layout.ascii { in_ascii(&out) } else { out }
}

/// Text in ASCII: drawn lines as ASCII, other characters by their numbers.
///
/// ```
/// assert_eq!(obsdeg_report::in_ascii("\u{2500} 5 \u{b5}g"), "- 5 \\u{b5}g");
/// ```
pub fn in_ascii(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '─' => out.push('-'),
            c if c.is_ascii() => out.push(c),
            c => out.extend(c.escape_unicode()),
        }
    }
    out
}

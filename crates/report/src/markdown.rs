//! GitHub-flavoured Markdown.

use crate::document::{Document, DocumentBlock, TableCell};
use crate::visible;

/// Text of a table cell or paragraph, with Markdown's markup characters escaped.
fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in visible(text).chars() {
        if matches!(c, '\\' | '|' | '*' | '_' | '`' | '<' | '>' | '[' | ']' | '#') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// Row of a table.
fn row(cells: impl Iterator<Item = String>) -> String {
    format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
}

/// Formula as code, between one more backtick than its longest run of backticks. Bars are escaped, since
/// tables split at bars even in code.
fn code(text: &str) -> String {
    if text.is_empty() {
        return String::new();
    }
    let text = visible(text).replace('|', "\\|");
    let most = text.split(|c| c != '`').map(str::len).max().unwrap_or(0);
    let fence = "`".repeat(most + 1);
    if most == 0 { format!("`{text}`") } else { format!("{fence} {text} {fence}") }
}

fn cell(cell: &TableCell) -> String {
    if cell.latex.is_some() { code(&cell.text) } else { escape(&cell.text) }
}

pub(crate) fn document(d: &Document) -> String {
    let mut out = format!("# {}\n\n", escape(&d.title));
    for line in &d.lead {
        out.push_str(&format!("{}\n\n", escape(line)));
    }
    // headings follow each other without a gap: below the title, then below the last section
    let mut above = 1;
    let heading = |above: usize, text: &str| match text {
        "" => String::new(),
        text => format!("{} {}\n\n", "#".repeat(above + 1), escape(text)),
    };
    for (i, block) in d.blocks.iter().enumerate() {
        if matches!(block, DocumentBlock::Status(_) | DocumentBlock::Fold(_) | DocumentBlock::NewPage) {
            continue;
        }
        out.push_str(if i == 0 { "" } else { "\n" });
        match block {
            DocumentBlock::Table { heading: title, columns, rows } => {
                out.push_str(&heading(above, title));
                out.push_str(&row(columns.iter().map(|c| escape(&c.name))));
                out.push_str(&format!("|{}\n", " --- |".repeat(columns.len())));
                out.extend(rows.iter().map(|cells| row(cells.iter().map(cell))));
            }
            DocumentBlock::List { heading: title, lines } => {
                out.push_str(&heading(above, title));
                out.extend(lines.iter().map(|line| format!("- {}\n", escape(line))));
            }
            DocumentBlock::Section { level, title } => {
                above = level + 1;
                out.push_str(&format!("{} {}\n", "#".repeat(above), escape(title)));
            }
            DocumentBlock::Text(text) => out.push_str(&format!("{}\n", escape(text))),
            DocumentBlock::Formulas { heading: title, lines } => {
                out.push_str(&heading(above, title));
                out.extend(lines.iter().map(|line| format!("- ${}$\n", line.latex)));
            }
            DocumentBlock::Picture(p) => {
                out.push_str(&format!("![{}]({}.svg)\n", escape(&p.caption), p.name))
            }
            DocumentBlock::Status(_) | DocumentBlock::Fold(_) | DocumentBlock::NewPage => {}
        }
    }
    out
}

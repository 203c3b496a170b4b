//! LaTeX for `\input`: booktabs, longtable, amsmath.

mod math;

use crate::document::{Document, DocumentBlock, TableCell, TableColumn};
use crate::visible;
#[cfg(feature = "pdf")]
pub(crate) use math::{FUNCTIONS, GREEK};
pub(crate) use math::{expression, left, solution, solution_of, symbol};

/// Plain text with LaTeX's special characters escaped.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in visible(text).replace("->", "\u{2192}").chars() {
        match c {
            '\u{2192}' => out.push_str("$\\to$"),
            '\\' => out.push_str("\\textbackslash{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => {
                out.push('\\');
                out.push(c);
            }
            '<' | '>' => out.push_str(&format!("${c}$")),
            _ => out.push(c),
        }
    }
    out
}

/// Document to be compiled alone.
pub(crate) fn alone(d: &Document) -> String {
    format!(
        "\\documentclass[a4paper]{{article}}\n\\usepackage{{amsmath,booktabs,graphicx,longtable}}\n\
         \\usepackage[margin=15mm]{{geometry}}\n\\title{{{}}}\n\\date{{}}\n\\begin{{document}}\n\\maketitle\n\
         \\footnotesize\n{}\\end{{document}}\n",
        escape(&d.title),
        body(d)
    )
}

fn heading(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("\\paragraph{{{}}}\n", escape(text)) }
}

fn items(lines: impl Iterator<Item = String>) -> String {
    let items: String = lines.map(|line| format!("\\item {line}\n")).collect();
    if items.is_empty() { items } else { format!("\\begin{{itemize}}\n{items}\\end{{itemize}}\n") }
}

fn cell(cell: &TableCell) -> String {
    cell.latex.as_ref().map_or_else(|| escape(&cell.text), |formula| format!("${formula}$"))
}

/// Characters on a line of a table, and those of the space between two columns.
const LINE: usize = 112;
const BETWEEN: usize = 3;
/// Width in characters up to which a column is never wrapped.
const SHORT: usize = 12;

/// Largest width of every column in characters: columns of texts are limited until all fit the line. `None`
/// is unlimited.
fn widths(columns: &[TableColumn], rows: &[Vec<TableCell>]) -> Vec<Option<usize>> {
    let natural = |k: usize| {
        let cells = rows.iter().map(|r| r[k].text.chars().count());
        cells.chain([columns[k].name.chars().count()]).max().unwrap_or(0)
    };
    let natural: Vec<usize> = (0..columns.len()).map(natural).collect();
    let room = LINE.saturating_sub(BETWEEN * columns.len().saturating_sub(1));
    let taken = |most: usize| -> usize {
        natural.iter().zip(columns).map(|(w, c)| if c.number { *w } else { (*w).min(most) }).sum()
    };
    // largest width of texts that fits
    let most = (SHORT..=LINE).rev().find(|&most| taken(most) <= room).unwrap_or(SHORT);
    let wrapped = |(w, c): (usize, &TableColumn)| (!c.number && w > most).then_some(most);
    natural.into_iter().zip(columns).map(wrapped).collect()
}

/// Longtable; columns of texts are wrapped if the line is too short.
fn table(columns: &[TableColumn], rows: &[Vec<TableCell>]) -> String {
    let widths = widths(columns, rows);
    let spec = columns.iter().zip(widths).map(|(column, width)| match (column.number, width) {
        (true, _) => "r".into(),
        (false, Some(width)) => format!("p{{{:.2}\\linewidth}}", width as f64 / LINE as f64),
        (false, None) => "l".to_string(),
    });
    let line = |cells: Vec<String>| format!("{} \\\\\n", cells.join(" & "));
    format!(
        "\\begin{{longtable}}{{{}}}\n\\toprule\n{}\\midrule\n\\endhead\n{}\\bottomrule\n\\end{{longtable}}\n",
        spec.collect::<String>(),
        line(columns.iter().map(|c| escape(&c.name)).collect()),
        rows.iter().map(|row| line(row.iter().map(cell).collect())).collect::<String>()
    )
}

/// A document to be input by another.
pub(crate) fn document(d: &Document) -> String {
    let title = heading(&d.title);
    format!("% needs the packages amsmath, booktabs and longtable\n{title}{}", body(d))
}

fn body(d: &Document) -> String {
    let mut out = items(d.lead.iter().map(|l| escape(l)));
    for block in &d.blocks {
        match block {
            DocumentBlock::Table { heading: title, columns, rows } => {
                out.push_str(&heading(title));
                out.push_str(&table(columns, rows));
            }
            DocumentBlock::List { heading: title, lines } => {
                out.push_str(&heading(title));
                out.push_str(&items(lines.iter().map(|l| escape(l))));
            }
            DocumentBlock::Section { level, title } => {
                let command = if *level == 1 { "section" } else { "subsection" };
                out.push_str(&format!("\\{command}*{{{}}}\n", escape(title)));
            }
            DocumentBlock::Text(text) => out.push_str(&format!("{}\n\n", escape(text))),
            DocumentBlock::Formulas { heading: title, lines } => {
                out.push_str(&heading(title));
                out.push_str(&items(lines.iter().map(|l| format!("${}$", l.latex))));
            }
            DocumentBlock::Picture(p) => out.push_str(&format!(
                "\\begin{{center}}\\includegraphics[width=.8\\linewidth,height=.35\\textheight,\
                 keepaspectratio]{{{}.pdf}}\\\\{}\\end{{center}}\n",
                p.name,
                escape(&p.caption)
            )),
            DocumentBlock::Status(_) | DocumentBlock::Fold(_) | DocumentBlock::NewPage => {}
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_characters() {
        assert_eq!(escape("50% & a_b"), "50\\% \\& a\\_b");
    }
}

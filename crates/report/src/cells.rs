//! Tables of lettered cells: a row per unknown, a column per case, coloured by degree.

use std::fmt::Write;

use crate::figure::{BLACK, FONT, GREY, ink, shade};
use crate::visible::escaped;

/// Width and height of a cell, and the least width of a picture, in pixels.
const CELL: [f64; 2] = [34.0, 20.0];
const LEAST_WIDTH: f64 = 560.0;
/// Width of the legend with eight degrees, in pixels.
const LEGEND: f64 = 510.0;
/// Font size of texts, and an upper bound of the width of a character, in pixels.
const TEXT: f64 = 12.0;
const CHARACTER: f64 = 7.8;
/// Largest number of characters of a name: longer names are cut.
const LONGEST: usize = 28;

/// Degrees of unknowns in several cases.
pub(crate) struct Cells<'a> {
    /// Title, in lines.
    pub(crate) title: Vec<String>,
    /// Names of the rows, from the top.
    pub(crate) rows: Vec<&'a str>,
    /// Name of the rows in general.
    pub(crate) row_label: &'a str,
    /// Columns from the left.
    pub(crate) columns: Vec<CellColumn<'a>>,
    /// Name of the columns in general.
    pub(crate) column_label: String,
    /// Sentence below; empty for none.
    pub(crate) note: String,
}

/// Column of degrees.
pub(crate) struct CellColumn<'a> {
    /// Name, at the top.
    pub(crate) name: &'a str,
    /// Degrees by row; `None` for an unknown that is not observable.
    pub(crate) degrees: &'a [Option<usize>],
    /// True if a gap separates the column from the others.
    pub(crate) is_apart: bool,
}

/// A name of at most [`LONGEST`] characters.
pub(crate) fn cut(name: &str) -> String {
    match name.chars().count() > LONGEST {
        true => name.chars().take(LONGEST - 1).chain(['\u{2026}']).collect(),
        false => name.into(),
    }
}

/// Upper bound of the width of a text, in pixels.
fn width_of(texts: impl Iterator<Item = usize>) -> f64 {
    CHARACTER * texts.max().unwrap_or(0) as f64
}

/// Text of an SVG; `more` are further attributes.
pub(crate) fn text(out: &mut String, [x, y]: [f64; 2], anchor: &str, more: &str, text: &str) {
    let text = escaped(text);
    let _ = write!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" {more}>{text}</text>");
}

impl Cells<'_> {
    /// Smallest and largest degree; `None` if nothing is observable.
    fn range(&self) -> Option<[usize; 2]> {
        let all = || self.columns.iter().flat_map(|c| c.degrees).flatten().copied();
        Some([all().min()?, all().max()?])
    }

    /// Colour of a degree: dark for the lowest, light for the highest.
    fn color(&self, degree: usize) -> [u8; 3] {
        let [low, high] = self.range().unwrap_or([degree; 2]);
        shade(1.0 - (degree - low) as f64 / (high - low).max(1) as f64)
    }

    /// SVG of the table.
    pub(crate) fn svg(&self) -> String {
        let names = width_of(self.rows.iter().map(|r| cut(r).chars().count())).max(60.0);
        let left = names + 44.0;
        let longest = width_of(self.columns.iter().map(|c| cut(c.name).chars().count()));
        // column names are turned by 60 degrees
        let (tall, aside) = (longest * 0.87 + 14.0, longest * 0.5);
        let title = 20.0 * self.title.len() as f64 + 12.0;
        let top = title + 20.0 + tall;
        let gaps = self.columns.iter().filter(|c| c.is_apart).count() as f64 * 10.0;
        let across = CELL[0] * self.columns.len() as f64 + gaps;
        let bottom = top + CELL[1] * self.rows.len() as f64;
        let width = (left + across + aside.max(20.0)).max(left + LEGEND).max(LEAST_WIDTH);
        let height = bottom + 66.0 + if self.note.is_empty() { 0.0 } else { 22.0 };
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             font-family=\"{FONT}\" font-size=\"{TEXT}\"><rect width=\"100%\" height=\"100%\" fill=\"white\" />"
        );
        for (i, line) in self.title.iter().enumerate() {
            let style = if i == 0 { "font-size=\"15\" font-weight=\"bold\"" } else { "font-size=\"13\"" };
            text(&mut out, [width / 2.0, 20.0 + 20.0 * i as f64], "middle", style, line);
        }
        text(&mut out, [left + across / 2.0, title + 14.0], "middle", "", &self.column_label);
        let middle = (top + bottom) / 2.0;
        let turned = format!("transform=\"rotate(-90 14 {middle:.1})\"");
        text(&mut out, [14.0, middle], "middle", &turned, self.row_label);
        for (i, row) in self.rows.iter().enumerate() {
            text(&mut out, [left - 6.0, top + CELL[1] * (i as f64 + 0.72)], "end", "", &cut(row));
        }
        let mut x = left;
        for column in &self.columns {
            x += if column.is_apart { 10.0 } else { 0.0 };
            let (at, y) = (x + CELL[0] / 2.0 + 4.0, top - 6.0);
            let turned = format!("transform=\"rotate(-60 {at:.1} {y:.1})\"");
            text(&mut out, [at, y], "start", &turned, &cut(column.name));
            for (i, degree) in column.degrees.iter().enumerate() {
                self.cell(&mut out, [x, top + CELL[1] * i as f64], *degree);
            }
            x += CELL[0];
        }
        self.legend(&mut out, [left, bottom + 22.0]);
        text(&mut out, [left, bottom + 64.0], "start", "", &self.note);
        out.push_str("</svg>\n");
        out
    }

    /// Cell with its degree; an unknown that is not observable has a dash on white.
    fn cell(&self, out: &mut String, [x, y]: [f64; 2], degree: Option<usize>) {
        let color = degree.map_or([255; 3], |k| self.color(k));
        let [r, g, b] = color;
        let _ = write!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{}\" height=\"{}\" fill=\"rgb({r},{g},{b})\" \
             stroke=\"{GREY}\" stroke-width=\"0.5\" />",
            CELL[0], CELL[1]
        );
        let word = degree.map_or_else(|| "\u{2013}".to_string(), |k| k.to_string());
        let fill = format!("fill=\"{}\"", ink(color));
        text(out, [x + CELL[0] / 2.0, y + CELL[1] * 0.72], "middle", &fill, &word);
    }

    /// Colours of up to eight degrees, and the meaning of a dash.
    fn legend(&self, out: &mut String, [mut x, y]: [f64; 2]) {
        let black = format!("fill=\"{BLACK}\"");
        text(out, [x, y + 14.0], "start", &black, "degree");
        x += 54.0;
        if let Some([low, high]) = self.range() {
            let steps = (high - low).min(7);
            for i in 0..=steps {
                let degree = low + ((high - low) * i + steps / 2) / steps.max(1);
                self.cell(out, [x, y], Some(degree));
                x += CELL[0];
            }
            x += 16.0;
        }
        self.cell(out, [x, y], None);
        text(out, [x + CELL[0] + 8.0, y + 14.0], "start", &black, "not observable");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lowest degree is the darkest, the highest the lightest; a dash stands for no degree.
    #[test]
    fn cells_have_the_letter_and_the_shade_of_their_degree() {
        let (one, two) = ([Some(1), None], [Some(4), Some(2)]);
        let column = |name, degrees| CellColumn { name, degrees, is_apart: false };
        let cells = Cells {
            title: vec!["<b>".into()],
            rows: vec!["k", "x"],
            row_label: "unknown",
            columns: vec![column("y & z", &one), column("a", &two)],
            column_label: "output".into(),
            note: String::new(),
        };
        let svg = cells.svg();
        assert!(svg.contains("&lt;b&gt;") && svg.contains("y &amp; z"), "{svg}");
        let drawn: Vec<(&str, &str)> = svg
            .split("<rect x=\"")
            .skip(1)
            .filter_map(|cell| {
                let fill = cell.split("fill=\"").nth(1)?.split('"').next()?;
                let letter = cell.split("middle\" fill=\"").nth(1)?.split('>').nth(1)?.split('<').next()?;
                Some((letter, fill))
            })
            .collect();
        let letters: Vec<&str> = drawn.iter().map(|d| d.0).collect();
        // two columns, then the legend
        assert_eq!(letters, ["1", "\u{2013}", "4", "2", "1", "2", "3", "4", "\u{2013}"]);
        assert_eq!(drawn[1].1, "rgb(255,255,255)");
        let grey = |fill: &str| -> f64 {
            let numbers = fill.trim_start_matches("rgb(").trim_end_matches(')').split(',');
            numbers
                .map(|n| n.parse::<f64>().expect("a number"))
                .zip([0.3, 0.59, 0.11])
                .map(|(n, w)| n * w)
                .sum()
        };
        let greys: Vec<f64> = drawn[4..8].iter().map(|d| grey(d.1)).collect();
        assert!(greys.windows(2).all(|w| w[0] + 15.0 < w[1]), "{greys:?}");
        assert_eq!(drawn[0].1, drawn[4].1);
    }

    #[test]
    fn long_names_are_cut() {
        assert_eq!(cut(&"x".repeat(LONGEST)).chars().count(), LONGEST);
        assert!(cut(&"x".repeat(LONGEST + 1)).ends_with("x\u{2026}"));
    }
}

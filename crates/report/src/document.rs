//! Content of a result, independent of the format: headings, tables, lists, formulas, pictures. Each format
//! escapes texts from files when it writes them.

use std::borrow::Cow;

use serde_json::{Value, json};

use crate::figure::Figure;
use crate::panels::Panels;

/// A part of a document.
pub(crate) enum DocumentBlock {
    /// Table; without a heading if that is empty.
    Table { heading: String, columns: Vec<TableColumn>, rows: Vec<Vec<TableCell>> },
    /// Lines, wrapped; without a heading if that is empty.
    List { heading: String, lines: Vec<String> },
    /// The heading of a part (level 1) or of a section of it (level 2).
    Section { level: usize, title: String },
    /// A paragraph.
    Text(String),
    /// Formulas, each with its left side.
    Formulas { heading: String, lines: Vec<Typeset> },
    /// A picture.
    Picture(Picture),
    /// Status of each scheme or model, in boxes at the beginning.
    Status(Vec<StatusBox>),
    /// Part that may be folded away.
    Fold(Fold),
    /// Page break before the next block, in formats with pages.
    NewPage,
}

/// Part of a page that may be folded away.
pub(crate) struct Fold {
    /// Level of its heading, as of a section.
    pub(crate) level: usize,
    pub(crate) title: String,
    /// False for details that a printed page leaves out; texts have them all.
    pub(crate) printed: bool,
    pub(crate) blocks: Vec<DocumentBlock>,
}

impl DocumentBlock {
    pub(crate) fn fold(level: usize, title: impl Into<String>, blocks: Vec<DocumentBlock>) -> Self {
        Self::Fold(Fold { level, title: title.into(), printed: true, blocks })
    }

    /// Details that a printed page leaves out; `None` without any.
    pub(crate) fn details(
        level: usize,
        title: impl Into<String>,
        blocks: Vec<DocumentBlock>,
    ) -> Option<Self> {
        let fold = Fold { level, title: title.into(), printed: false, blocks };
        (!fold.blocks.is_empty()).then_some(Self::Fold(fold))
    }

    pub(crate) fn table<C: Into<TableCell>>(
        heading: impl Into<String>,
        columns: impl Into<Vec<TableColumn>>,
        rows: impl IntoIterator<Item = Vec<C>>,
    ) -> Self {
        let rows = rows.into_iter().map(|row| row.into_iter().map(Into::into).collect());
        Self::Table { heading: heading.into(), columns: columns.into(), rows: rows.collect() }
    }

    /// Table without the columns of these names.
    pub(crate) fn without(self, names: &[&str]) -> Self {
        let Self::Table { heading, columns, rows } = self else { return self };
        let kept: Vec<bool> = columns.iter().map(|c| !names.contains(&c.name.as_ref())).collect();
        let keep = |row: Vec<TableCell>| {
            row.into_iter().zip(&kept).filter(|(_, k)| **k).map(|(cell, _)| cell).collect()
        };
        let rows = rows.into_iter().map(keep).collect();
        let columns = columns.into_iter().zip(&kept).filter(|(_, k)| **k).map(|(column, _)| column).collect();
        Self::Table { heading, columns, rows }
    }

    pub(crate) fn list(heading: impl Into<String>, lines: Vec<String>) -> Self {
        Self::List { heading: heading.into(), lines }
    }

    /// List; `None` without lines.
    pub(crate) fn list_if_any(heading: impl Into<String>, lines: Vec<String>) -> Option<Self> {
        (!lines.is_empty()).then(|| Self::list(heading, lines))
    }

    /// Formulas; `None` without any.
    pub(crate) fn formulas(
        heading: impl Into<String>,
        lines: impl IntoIterator<Item = Typeset>,
    ) -> Option<Self> {
        let lines: Vec<Typeset> = lines.into_iter().collect();
        (!lines.is_empty()).then(|| Self::Formulas { heading: heading.into(), lines })
    }
}

/// A column of a table.
#[derive(Clone)]
pub(crate) struct TableColumn {
    pub(crate) name: Cow<'static, str>,
    /// True for numbers, which are set flush right.
    pub(crate) number: bool,
}

/// A column of text.
pub(crate) fn left(name: impl Into<Cow<'static, str>>) -> TableColumn {
    TableColumn { name: name.into(), number: false }
}

/// A column of numbers.
pub(crate) fn right(name: impl Into<Cow<'static, str>>) -> TableColumn {
    TableColumn { name: name.into(), number: true }
}

/// A cell of a table.
#[derive(Clone)]
pub(crate) struct TableCell {
    pub(crate) text: String,
    /// LaTeX of a formula; `None` for texts.
    pub(crate) latex: Option<String>,
    /// Grade of the content; `None` if it is not graded. The text says the same.
    pub(crate) grade: Option<Grade>,
}

impl TableCell {
    pub(crate) fn formula(text: impl Into<String>, latex: String) -> Self {
        Self { text: text.into(), latex: Some(latex), grade: None }
    }

    pub(crate) fn graded(text: impl Into<String>, grade: Grade) -> Self {
        Self { text: text.into(), latex: None, grade: Some(grade) }
    }
}

impl<T: Into<String>> From<T> for TableCell {
    fn from(text: T) -> Self {
        Self { text: text.into(), latex: None, grade: None }
    }
}

/// First columns of the tables whose rows a narrow page shows one below the other, if they have more than two
/// columns: the steps of a procedure, the answers of several schemes.
const CARDS: [&str; 2] = ["step", "question"];

/// A table for the templates of pages.
pub(crate) fn table_of_page(heading: &str, columns: &[TableColumn], rows: &[Vec<TableCell>]) -> Value {
    let cell = |c: &TableCell| json!({ "text": c.text, "grade": c.grade.map(Grade::name) });
    let texts = |row: &Vec<TableCell>| row.iter().map(cell).collect::<Vec<_>>();
    json!({
        "kind": "table",
        "heading": heading,
        "cards": columns.len() > 2 && columns.first().is_some_and(|c| CARDS.contains(&&*c.name)),
        "header": columns.iter().map(|c| &c.name).collect::<Vec<_>>(),
        "numbers": columns.iter().map(|c| c.number).collect::<Vec<_>>(),
        "rows": rows.iter().map(texts).collect::<Vec<_>>(),
    })
}

/// Status of one scheme, model or calibration.
pub(crate) struct StatusBox {
    /// Name of the scheme, model or calibration.
    pub(crate) title: String,
    /// Answers, one per question.
    pub(crate) rows: Vec<StatusRow>,
    /// Recommended actions.
    pub(crate) actions: Vec<String>,
}

/// Answer to one question of a status.
pub(crate) struct StatusRow {
    pub(crate) what: &'static str,
    pub(crate) grade: Grade,
    pub(crate) text: String,
}

/// Grade of an answer.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Grade {
    /// Requirements are met and checks pass.
    Good,
    /// Limits the validity of other answers.
    Limited,
    /// A requirement or a check is not met.
    Missed,
    /// Not computed or not measured.
    Open,
}

impl Grade {
    /// Name of the grade on pages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Limited => "limited",
            Self::Missed => "missed",
            Self::Open => "open",
        }
    }

    pub(crate) fn mark(self) -> &'static str {
        match self {
            Self::Good => "ok",
            Self::Limited => "LIMITED",
            Self::Missed => "NOT MET",
            Self::Open => "open",
        }
    }
}

impl StatusBox {
    /// Status as a table, for formats without boxes.
    fn table(&self) -> DocumentBlock {
        let row = |f: &StatusRow| [f.what, f.grade.mark(), &f.text].map(String::from).to_vec();
        let action = |text: &String| ["Recommended action", "", text].map(String::from).to_vec();
        let columns = [left("question"), left("status"), left("finding")];
        let rows = self.rows.iter().map(row).chain(self.actions.iter().map(action));
        DocumentBlock::table(format!("Status: {}", self.title), columns, rows)
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

/// Content of a picture.
pub(crate) enum Drawing {
    /// Curves, which a page may make interactive.
    Curves(Box<Figure>),
    /// Bars, which no page makes interactive.
    Bars(Box<Figure>),
    /// SVG.
    Still(String),
    /// SVG on white, whose colours a dark page inverts.
    Map(String),
    /// Positions side by side, as many as fit.
    Panels(Panels),
}

impl Picture {
    /// True if the picture takes the full width.
    pub(crate) fn is_wide(&self) -> bool {
        matches!(self.drawing, Drawing::Panels(_))
    }

    pub(crate) fn svg(&self) -> String {
        match &self.drawing {
            Drawing::Curves(figure) | Drawing::Bars(figure) => figure.svg(),
            Drawing::Still(svg) | Drawing::Map(svg) => svg.clone(),
            Drawing::Panels(panels) => panels.svg(),
        }
    }
}

/// Content of a result, independent of the format: title, first lines and blocks.
pub struct Document {
    pub(crate) title: String,
    pub(crate) lead: Vec<String>,
    pub(crate) blocks: Vec<DocumentBlock>,
}

/// A number with four significant digits.
pub(crate) fn number(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 {
        "0".into()
    } else if !(1e-3..1e5).contains(&magnitude) {
        format!("{x:.3e}")
    } else {
        // exponent of the rounded number: 0.99999 is 1.000
        let rounded = format!("{magnitude:.3e}");
        let exponent = rounded.split_once('e').and_then(|(_, e)| e.parse::<i32>().ok()).unwrap_or(0);
        let decimals = (3 - exponent).clamp(0, 6) as usize;
        format!("{x:.decimals$}")
    }
}

/// Estimate rounded to the second digit of its standard deviation.
pub(crate) fn estimate(x: Option<f64>, sigma: Option<f64>) -> String {
    let (Some(x), Some(sigma)) = (x, sigma) else { return optional(x) };
    let decimals = 1.0 - sigma.log10().floor();
    if (1e-3..1e9).contains(&x.abs()) && (0.0..=9.0).contains(&decimals) {
        format!("{x:.*}", decimals as usize)
    } else {
        number(x)
    }
}

/// Number with at most three decimals, without trailing zeros.
pub(crate) fn short(x: f64) -> String {
    let text = format!("{x:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Number, or a dash for `None`.
pub(crate) fn optional(x: Option<f64>) -> String {
    x.map_or_else(|| "-".into(), number)
}

/// A block, or pictures that follow each other.
pub(crate) enum BlockGroup<'a> {
    Block(&'a DocumentBlock),
    Pictures(Vec<&'a Picture>),
}

/// Blocks, with successive pictures grouped unless they are wide.
pub(crate) fn parts(blocks: &[DocumentBlock]) -> Vec<BlockGroup<'_>> {
    let mut out: Vec<BlockGroup<'_>> = Vec::new();
    for block in blocks {
        match (block, out.last_mut()) {
            (DocumentBlock::Picture(p), Some(BlockGroup::Pictures(list)))
                if !p.is_wide() && !list[0].is_wide() =>
            {
                list.push(p)
            }
            (DocumentBlock::Picture(p), _) => out.push(BlockGroup::Pictures(vec![p])),
            (block, _) => out.push(BlockGroup::Block(block)),
        }
    }
    out
}

/// Blocks with status boxes as tables, and folds as sections.
fn unfolded(blocks: Vec<DocumentBlock>) -> Vec<DocumentBlock> {
    let of = |b: DocumentBlock| match b {
        DocumentBlock::Status(boxes) => boxes.iter().map(StatusBox::table).collect(),
        DocumentBlock::Fold(fold) => {
            let mut out = vec![DocumentBlock::Section { level: fold.level.min(2), title: fold.title }];
            out.extend(unfolded(fold.blocks));
            out
        }
        other => vec![other],
    };
    blocks.into_iter().flat_map(of).collect()
}

impl Document {
    /// The document with status boxes as tables and without folds.
    pub(crate) fn plain(mut self) -> Self {
        self.blocks = unfolded(self.blocks);
        self
    }

    /// The document with all pictures in `folder`.
    pub(crate) fn with_pictures_in(mut self, folder: &str) -> Self {
        for block in &mut self.blocks {
            if let DocumentBlock::Picture(p) = block {
                p.name = format!("{folder}/{}", p.name);
            }
        }
        self
    }

    pub(crate) fn pictures(&self) -> impl Iterator<Item = &Picture> {
        self.blocks.iter().filter_map(|b| match b {
            DocumentBlock::Picture(p) => Some(p),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One document in every format. A formula is code in Markdown, math in LaTeX and text elsewhere. Empty
    /// headings are left out, and columns of sentences share the line.
    #[test]
    fn a_formula_in_every_format() {
        let columns = [left("what"), right("how many")];
        let row = vec![TableCell::formula("D_FX", "D_{FX}".into()), "a_1".into()];
        let formula = Typeset { text: "x_1 = 2".into(), latex: "x_{1} = 2".into() };
        let blocks =
            [Some(DocumentBlock::table("", columns, [row])), DocumentBlock::formulas("Where", [formula])];
        assert!(
            DocumentBlock::formulas("Nowhere", []).is_none()
                && DocumentBlock::list_if_any("Nothing", vec![]).is_none()
        );
        let d = Document {
            title: "T".into(),
            lead: vec!["so".into()],
            blocks: blocks.into_iter().flatten().collect(),
        };
        assert_eq!(
            crate::markdown::document(&d),
            "# T\n\nso\n\n| what | how many |\n| --- | --- |\n| `D_FX` | a\\_1 |\n\n## Where\n\n- $x_{1} = 2$\n"
        );
        assert_eq!(
            crate::latex::document(&d),
            "% needs the packages amsmath, booktabs and longtable\n\\paragraph{T}\n\\begin{itemize}\n\\item \
             so\n\\end{itemize}\n\\begin{longtable}{lr}\n\\toprule\nwhat & how many \\\\\n\\midrule\n\
             \\endhead\n$D_{FX}$ & a\\_1 \\\\\n\\bottomrule\n\\end{longtable}\n\\paragraph{Where}\n\
             \\begin{itemize}\n\\item $x_{1} = 2$\n\\end{itemize}\n"
        );
        let table = crate::table::document(&d, crate::TerminalLayout::default());
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines[..3], ["T", "  so", " what   how many"]);
        assert_eq!(lines[4..], [" D_FX        a_1", "", "Where", "  x_1 = 2"]);
    }

    #[test]
    fn wide_columns_share_the_line() {
        let sentence = "so ".repeat(30);
        for sentences in 1..=3 {
            let row: Vec<&str> = (0..3).map(|k| if k < sentences { &sentence } else { "short" }).collect();
            let blocks = vec![DocumentBlock::table("", [left("a"), left("b"), left("c")], [row])];
            let latex = crate::latex::document(&Document { title: "T".into(), lead: vec![], blocks });
            let spec =
                latex.split("longtable}{").nth(1).and_then(|t| t.split("}\n").next()).unwrap_or_default();
            let wrapped = spec.matches("linewidth").count();
            // a single sentence of 90 characters fits
            let expected = if sentences == 1 { 0 } else { sentences };
            assert_eq!(wrapped, expected, "{spec}");
            let shares = spec.split("p{").skip(1).filter_map(|t| t.split('\\').next()?.parse::<f64>().ok());
            assert!(shares.sum::<f64>() < 1.0, "{spec}");
        }
    }

    #[test]
    fn four_digits() {
        let shown = [0.0, 12.0, -0.0231, 123456.0, 1e-5, 0.00123, 99999.0].map(number);
        assert_eq!(shown, ["0", "12.00", "-0.02310", "1.235e5", "1.000e-5", "0.001230", "99999"]);
    }
}

//! One self-contained HTML page. Tables and formulas need no scripts; with scripts, pictures are interactive.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment, context, escape_formatter};
use pulldown_latex::config::{DisplayMode, RenderConfig};
use pulldown_latex::{Parser, Storage, push_mathml};
use serde_json::{Value as Json, json};

use crate::document::{
    BlockGroup, Document, DocumentBlock, Drawing, Fold, Picture, StatusBox, StatusRow, Typeset, parts,
    table_of_page,
};
use crate::figure::{CLIP, Curve, Figure, Stroke};
use crate::{ReportError, visible};

const TEMPLATE: &str = include_str!("../assets/page.html");
const FRAGMENT: &str = include_str!("../assets/fragment.html");
const STYLE: &str = include_str!("../assets/page.css");
const SCRIPT: &str = include_str!("../assets/page.js");
const PLOT_SCRIPT: &str = include_str!("../assets/uPlot.iife.min.js");
const PLOT_STYLE: &str = include_str!("../assets/uPlot.min.css");
const FONT: &[u8] = include_bytes!("../assets/math.woff2");

/// The document as a page.
pub(crate) fn page(d: &Document, version: &str) -> Result<String, ReportError> {
    // blocks before the first part
    let first =
        d.blocks.iter().position(|b| matches!(b, DocumentBlock::Section { .. } | DocumentBlock::Fold(_)));
    let (front, rest) = d.blocks.split_at(first.unwrap_or(d.blocks.len()));
    let mut ids = 0;
    let [front, blocks] = [front, rest].map(|b| listed(b, &mut ids));
    let environment = environment()?;
    let interactive = has_curves(&d.blocks);
    let page = environment.get_template("page")?.render(context! {
        title => d.title.clone(),
        lead => d.lead.clone(),
        front => Value::from(Serde(&front)),
        blocks => Value::from(Serde(&blocks)),
        version => version,
        interactive => interactive,
        style => STYLE,
        script => SCRIPT,
        plot_style => PLOT_STYLE,
        plot_script => PLOT_SCRIPT,
        font => STANDARD.encode(FONT),
    })?;
    Ok(page)
}

/// Templates, which escape every text that is not their own markup.
fn environment() -> Result<Environment<'static>, ReportError> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.set_formatter(|out, state, value| match value.as_str() {
        Some(text) if !value.is_safe() => escape_formatter(out, state, &Value::from(visible(text))),
        _ => escape_formatter(out, state, value),
    });
    environment.add_template("page", TEMPLATE)?;
    environment.add_template("fragment", FRAGMENT)?;
    Ok(environment)
}

/// Document as a part of another page: tables, lists and formulas that need no scripts and no style.
pub(crate) fn fragment(d: &Document) -> Result<String, ReportError> {
    let blocks = listed(&d.blocks, &mut 0);
    Ok(environment()?.get_template("fragment")?.render(context! {
        title => d.title.clone(),
        lead => d.lead.clone(),
        blocks => Value::from(Serde(&blocks)),
    })?)
}

fn has_curves(blocks: &[DocumentBlock]) -> bool {
    blocks.iter().any(|b| match b {
        DocumentBlock::Picture(p) => matches!(p.drawing, Drawing::Curves(_)),
        DocumentBlock::Fold(fold) => has_curves(&fold.blocks),
        _ => false,
    })
}

/// Blocks as data for the template. A fold becomes its beginning, its blocks and its end. `ids` counts the
/// targets of links.
fn listed(blocks: &[DocumentBlock], ids: &mut usize) -> Vec<Json> {
    let mut out = Vec::new();
    for part in parts(blocks) {
        *ids += 1;
        if let BlockGroup::Block(DocumentBlock::Fold(fold)) = &part {
            let id = format!("section-{ids}");
            let Fold { level, title, printed, blocks } = fold;
            out.push(json!({ "kind": "fold", "level": level, "title": title, "printed": printed, "id": id }));
            out.extend(listed(blocks, ids));
            out.push(json!({ "kind": "end" }));
        } else {
            out.push(block(*ids, &part));
        }
    }
    out
}

/// One block as data for the template.
fn block(i: usize, part: &BlockGroup<'_>) -> Json {
    let b = match part {
        BlockGroup::Pictures(pictures) => {
            let pictures: Vec<Json> = pictures.iter().map(|p| picture(p)).collect();
            return json!({ "kind": "pictures", "pictures": pictures });
        }
        BlockGroup::Block(b) => b,
    };
    match b {
        DocumentBlock::Section { level, title } => {
            json!({ "kind": "section", "level": level, "title": title, "id": format!("section-{i}") })
        }
        DocumentBlock::Text(text) => json!({ "kind": "text", "text": text }),
        DocumentBlock::List { heading, lines } => {
            json!({ "kind": "list", "heading": heading, "lines": lines })
        }
        DocumentBlock::Table { heading, columns, rows } => table_of_page(heading, columns, rows),
        DocumentBlock::Formulas { heading, lines } => {
            let lines: Vec<Json> = lines.iter().map(formula).collect();
            json!({ "kind": "formulas", "heading": heading, "lines": lines })
        }
        // pictures come in groups, folds are taken apart by `listed`
        DocumentBlock::Picture(_) | DocumentBlock::Fold(_) => Json::Null,
        DocumentBlock::NewPage => json!({ "kind": "page" }),
        DocumentBlock::Status(boxes) => {
            let row = |f: &StatusRow| {
                let (grade, mark) = (f.grade.name(), f.grade.mark());
                json!({ "what": f.what, "grade": grade, "mark": mark, "text": f.text })
            };
            let of = |s: &StatusBox| {
                let rows: Vec<Json> = s.rows.iter().map(row).collect();
                json!({ "title": s.title, "rows": rows, "actions": s.actions })
            };
            json!({ "kind": "status", "boxes": boxes.iter().map(of).collect::<Vec<_>>() })
        }
    }
}

fn picture(p: &Picture) -> Json {
    let plot = match &p.drawing {
        // `</script>` must not occur in a script
        Drawing::Curves(figure) => Json::from(curves(figure).to_string().replace('<', "\\u003c")),
        Drawing::Bars(_) | Drawing::Still(_) | Drawing::Map(_) | Drawing::Panels(_) => Json::Null,
    };
    let panels: Option<Vec<String>> = match &p.drawing {
        Drawing::Panels(panels) => Some(panels.each().map(|svg| in_page_colors(&svg)).collect()),
        Drawing::Bars(_) | Drawing::Still(_) | Drawing::Map(_) | Drawing::Curves(_) => None,
    };
    let svg = if panels.is_some() { String::new() } else { inlined(p) };
    let class = match &p.drawing {
        Drawing::Curves(_) => "curves",
        Drawing::Bars(_) => "bars",
        Drawing::Still(_) => "drawing",
        Drawing::Map(_) => "map",
        Drawing::Panels(_) => "panels",
    };
    json!({ "name": p.name, "class": class, "caption": p.caption, "svg": svg, "panels": panels, "plot": plot })
}

/// MathML of a formula, with program notation in case the LaTeX cannot be converted.
fn formula(f: &Typeset) -> Json {
    json!({ "text": f.text, "mathml": lines(&f.latex, LONG) })
}

/// MathML of LaTeX, in pieces that break before signs if it is longer than `long` bytes.
pub(crate) fn lines(latex: &str, long: usize) -> Option<String> {
    let pieces: Option<Vec<String>> = terms(latex, long).iter().map(|piece| mathml(piece)).collect();
    pieces.map(|p| p.join(" "))
}

/// MathML of LaTeX.
pub(crate) fn mathml(latex: &str) -> Option<String> {
    let storage = Storage::new();
    let parser = Parser::new(latex, &storage);
    let mut out = String::new();
    let config = RenderConfig { display_mode: DisplayMode::Inline, ..RenderConfig::default() };
    let failed = push_mathml(&mut out, parser, config).is_err() || out.contains("merror");
    (!failed).then_some(out)
}

/// Length in bytes from which a formula of a report may break.
const LONG: usize = 120;

/// Splits a formula longer than `long` bytes before its plus and minus signs: browsers break lines between
/// formulas, not inside.
fn terms(latex: &str, long: usize) -> Vec<String> {
    let mut out = vec![String::new()];
    let (mut depth, mut escaped) = (0usize, false);
    for (i, c) in latex.char_indices() {
        match c {
            _ if escaped => {}
            '{' => depth += 1,
            '}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        escaped = c == '\\' && !escaped;
        let sign = latex[i..].starts_with(" + ") || latex[i..].starts_with(" - ");
        if latex.len() > long && depth == 0 && sign {
            // an empty operand before the sign keeps it binary
            out.push("{}".into());
        }
        if let Some(last) = out.last_mut() {
            last.push(c);
        }
    }
    out
}

/// The SVG with ids of its own, in the colours of the page.
fn inlined(p: &Picture) -> String {
    let svg = match &p.drawing {
        Drawing::Curves(figure) | Drawing::Bars(figure) => figure.small_svg(),
        _ => p.svg(),
    };
    let attribute = |name: &str| {
        let rest = svg.split_once(&format!(" {name}=\""))?.1;
        rest.split_once('"').map(|(value, _)| value.to_string())
    };
    let size = attribute("width").zip(attribute("height"));
    let view = size.map_or_else(String::new, |(w, h)| format!(" viewBox=\"0 0 {w} {h}\""));
    let svg = svg
        .replacen(
            "<svg ",
            &format!("<svg class=\"still\" role=\"img\" aria-labelledby=\"{}-caption\"{view} ", p.name),
            1,
        )
        .replace(CLIP, &format!("{}-clip-", p.name))
        .replacen("<rect width=\"100%\" height=\"100%\" fill=\"white\" />", "", 1);
    in_page_colors(&svg)
}

/// Black becomes the colour of the page's text; for other colours a dark page has rules of its own.
fn in_page_colors(svg: &str) -> String {
    svg.replace("\"#000000\"", "\"currentColor\"").replace("\"black\"", "\"currentColor\"")
}

/// Number rounded to `digits` significant digits.
fn rounded(x: f64, digits: usize) -> f64 {
    format!("{x:.*e}", digits - 1).parse().unwrap_or(x)
}

/// Point between two pieces of a curve.
const GAP: (f64, f64) = (f64::NAN, f64::NAN);

/// Curves as data of the interactive plots: tables with strictly increasing x, one per run of equal x.
fn curves(f: &Figure) -> Json {
    let all = || f.lines.iter().flat_map(|l| l.points.iter().map(|p| p.0));
    let (low, high) = all().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    let step = (high - low).abs().max(f64::MIN_POSITIVE) * 1e-5;
    let mut series = Vec::new();
    // x, then the values of all successive series with the same x
    let mut tables: Vec<Vec<Vec<f64>>> = Vec::new();
    let mut bands = Vec::new();
    let mut add =
        |label: &str, color: &str, dash: &[u32], width: f64, points: &mut dyn Iterator<Item = (f64, f64)>| {
            let (mut xs, mut ys): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
            for (x, y) in points {
                // the end of a piece is a value that is missing, right behind its last one
                let x = if x.is_nan() { f64::MIN } else { x };
                let x = xs.last().map_or(x, |last| if x <= *last { last + step } else { x });
                xs.push(rounded(x, 8));
                ys.push(rounded(y, 4));
            }
            series.push(json!({ "label": visible(label), "color": color, "dash": dash, "width": width }));
            match tables.last_mut() {
                Some(table) if table[0] == xs => table.push(ys),
                _ => tables.push(vec![xs, ys]),
            }
            series.len()
        };
    let drawn = |pieces: &mut dyn Iterator<Item = Vec<(f64, f64)>>| -> Vec<Vec<(f64, f64)>> {
        pieces.filter(|p| !p.is_empty()).collect()
    };
    // bands of one colour are pieces of one band
    for pieces in f.bands.chunk_by(|a, b| a.color == b.color) {
        let color = pieces[0].color;
        let mut edge = |k: fn(&(f64, f64, f64)) -> f64| {
            let points: Vec<Vec<(f64, f64)>> =
                drawn(&mut pieces.iter().map(|b| b.points.iter().map(|p| (p.0, k(p))).collect()));
            add("", color, &[], 0.5, &mut points.join(&GAP).into_iter())
        };
        let (high, low) = (edge(|p| p.2), edge(|p| p.1));
        bands.push(json!({ "series": [high, low], "color": color }));
    }
    // a line without a label is a piece of the one before, if it is drawn alike
    let alike = |a: &Curve, b: &Curve| b.label.is_empty() && a.color == b.color && dash(a) == dash(b);
    for pieces in f.lines.chunk_by(alike) {
        let points = drawn(&mut pieces.iter().map(|l| l.points.clone()));
        let first = &pieces[0];
        add(&first.label, first.color, dash(first), 1.6, &mut points.join(&GAP).into_iter());
    }
    json!({
        "title": visible(&f.title), "x": visible(&f.x_label), "y": visible(&f.y_label),
        "log_x": f.log, "log_y": f.log || f.log_y,
        "orders": f.orders, "x_range": f.x_range, "y_range": f.y_range, "marks": f.marks,
        "series": series, "tables": tables, "bands": bands,
    })
}

/// Dashes of a line in pixels; empty for a solid one.
fn dash(l: &Curve) -> &'static [u32] {
    match l.stroke {
        Stroke::Solid => &[],
        Stroke::Dashed => &[8, 4],
        Stroke::DashDot => &[8, 4, 2, 4],
        Stroke::Dotted => &[2, 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_a_curve_are_one_series() {
        let line = |label: &str, points: &[(f64, f64)]| Curve {
            label: label.into(),
            color: "#000000",
            stroke: Stroke::Solid,
            points: points.to_vec(),
        };
        let figure = Figure {
            lines: vec![
                line("a", &[(0.0, 1.0), (1.0, 2.0)]),
                line("", &[(3.0, 4.0)]),
                line("b", &[(0.0, 5.0)]),
            ],
            ..Figure::default()
        };
        let data = curves(&figure);
        let labels: Vec<&str> =
            data["series"].as_array().expect("series").iter().filter_map(|s| s["label"].as_str()).collect();
        assert_eq!(labels, ["a", "b"]);
        assert_eq!(data["tables"][0][1], json!([1.0, 2.0, null, 4.0]));
        let x: Vec<f64> =
            data["tables"][0][0].as_array().expect("x").iter().filter_map(Json::as_f64).collect();
        assert!(x.len() == 4 && x.windows(2).all(|w| w[0] < w[1]), "{x:?}");
    }

    #[test]
    fn long_formulas_break_before_their_signs() {
        assert_eq!(terms("D = a + b", LONG), ["D = a + b"]);
        let long = "x".repeat(120);
        let text = format!("D = \\frac{{a + b}}{{c}} (\\text{{p 1 - 2 \\}} + }} - {long}) + \\{{ + e");
        let expected = [
            "D = \\frac{a + b}{c} (\\text{p 1 - 2 \\} + }".to_string(),
            format!("{{}} - {long})"),
            "{} + \\{".into(),
            "{} + e".into(),
        ];
        assert_eq!(terms(&text, LONG), expected);
    }
}

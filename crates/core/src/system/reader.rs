//! Keys and texts of a model file: sizes of vectors, expressions of any shape, their order of use.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;

use serde_spanned::Spanned;
use toml::Value;

use super::error::FilePlace;
use super::error::ModelError;
use super::model::{Named, PlacedExpression};
use crate::language::vectors::{Mismatch, stacked};
use crate::language::{Expression, MAX_ENTRIES, Node, Shape, Shapes, parse_components, parse_equation};
use crate::model::angle::excerpt;

/// Key with its value.
pub(super) type ModelEntry<'a> = (&'a String, &'a Spanned<Value>);

/// Entries in the order of the file.
pub(super) fn in_order(map: &BTreeMap<String, Spanned<Value>>) -> Vec<ModelEntry<'_>> {
    let mut out: Vec<_> = map.iter().collect();
    out.sort_by_key(|(_, v)| v.span().start);
    out
}

/// Reader of a model file.
pub(super) struct ModelReader<'a> {
    pub(super) text: &'a str,
    /// Shapes of the names that are no scalars.
    pub(super) shapes: Shapes,
}

/// Expression of any shape: the expressions of its entries, row by row.
pub(super) struct Formulas {
    pub(super) shape: Shape,
    pub(super) parts: Vec<PlacedExpression>,
}

impl Formulas {
    /// True for the number 0.
    fn is_zero(&self) -> bool {
        let zero =
            |p: &PlacedExpression| matches!(p.expression.nodes[..], [Node::Number { mantissa: 0, .. }]);
        self.shape == Shape::SCALAR && self.parts.iter().all(zero)
    }
}

/// Name and shape of a key: `p[3]` declares `p` as a vector, `p` has no shape.
pub(super) fn declared(key: &str) -> Result<(&str, Option<Shape>), String> {
    let Some((base, sizes)) = key.split_once('[') else { return Ok((key, None)) };
    let sizes: Option<Vec<usize>> =
        sizes.strip_suffix(']').and_then(|s| s.split(',').map(|n| n.trim().parse().ok()).collect());
    let shape = match sizes.as_deref() {
        Some(&[rows]) => Some(Shape::vector(rows)),
        Some(&[rows, columns]) => Some(Shape { rows, columns }),
        _ => None,
    };
    let most = |s: &Shape| s.rows > 0 && s.rows.saturating_mul(s.columns) <= MAX_ENTRIES;
    match shape.filter(|s| most(s) && s.entries() > 1) {
        Some(shape) => Ok((base.trim_end(), Some(shape))),
        None => Err(format!(
            "not a size; expected that of a vector, as in {base}[3], or of a matrix, as in {base}[3,3], \
             with 2 to {MAX_ENTRIES} entries"
        )),
    }
}

/// Key without its size.
pub(super) fn base(key: &str) -> &str {
    key.split_once('[').map_or(key, |(base, _)| base.trim_end())
}

/// Names in a text; names before a bracket are functions and are left out.
fn names_in(text: &str) -> impl Iterator<Item = &str> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut rest = text;
    std::iter::from_fn(move || {
        loop {
            rest = &rest[rest.find(is_name)?..];
            let (word, tail) = rest.split_at(rest.find(|c| !is_name(c)).unwrap_or(rest.len()));
            rest = tail;
            if !word.starts_with(|c: char| c.is_ascii_digit()) && !tail.starts_with('(') {
                return Some(word);
            }
        }
    })
}

/// All texts in a value.
fn texts(value: &Value) -> Vec<&str> {
    match value {
        Value::String(s) => vec![s],
        Value::Array(list) => list.iter().flat_map(texts).collect(),
        Value::Table(table) => table.get("value").map(texts).unwrap_or_default(),
        _ => Vec::new(),
    }
}

/// Entries sorted so that each comes after those that its texts name; otherwise in the order of the file.
///
/// # Errors
/// Names of a cycle, the first one again at its end.
fn by_use<'a>(entries: &[ModelEntry<'a>]) -> Result<Vec<ModelEntry<'a>>, Vec<usize>> {
    let place: HashMap<&str, usize> = entries.iter().enumerate().map(|(i, e)| (base(e.0), i)).collect();
    let uses = |i: usize| -> Vec<usize> {
        let texts = texts(entries[i].1.get_ref());
        texts.into_iter().flat_map(names_in).filter_map(|name| place.get(name).copied()).collect()
    };
    let (mut out, mut done) = (Vec::new(), vec![false; entries.len()]);
    for first in 0..entries.len() {
        // entries in progress, each with its open dependencies
        let mut path: Vec<(usize, Vec<usize>)> = Vec::new();
        let mut next = (!done[first]).then_some(first);
        while let Some(i) = next {
            path.push((i, uses(i)));
            next = None;
            while let Some((last, needed)) = path.last_mut() {
                if let Some(at) = needed.iter().position(|&j| !done[j]) {
                    let j = needed.swap_remove(at);
                    if let Some(begin) = path.iter().position(|p| p.0 == j) {
                        return Err(path[begin..].iter().map(|p| p.0).chain([j]).collect());
                    }
                    next = Some(j);
                    break;
                }
                done[*last] = true;
                out.push(entries[*last]);
                path.pop();
            }
        }
    }
    Ok(out)
}

impl ModelReader<'_> {
    pub(super) fn at(&self, span: Range<usize>, what: String, message: String) -> ModelError {
        ModelError { what, message, span: Some(span) }
    }

    /// Expression of any shape. Its text is as written for a number, the contents for a string, and one for
    /// each entry in a list.
    pub(super) fn formulas(
        &self,
        what: &str,
        value: &Value,
        span: Range<usize>,
    ) -> Result<Formulas, ModelError> {
        self.formulas_from(what, value, &span, &mut span.start.clone())
    }

    /// Expression of any shape; its text is searched from `cursor` on.
    fn formulas_from(
        &self,
        what: &str,
        value: &Value,
        span: &Range<usize>,
        cursor: &mut usize,
    ) -> Result<Formulas, ModelError> {
        if let Value::Array(list) = value {
            let parts: Vec<Formulas> = list
                .iter()
                .map(|item| self.formulas_from(what, item, span, cursor))
                .collect::<Result<_, _>>()?;
            let shapes: Vec<Shape> = parts.iter().map(|p| p.shape).collect();
            let shape = stacked(&shapes).map_err(|Mismatch { expected, found }| {
                self.at(span.clone(), what.into(), format!("found {found}; expected {expected}"))
            })?;
            return Ok(Formulas { shape, parts: parts.into_iter().flat_map(|p| p.parts).collect() });
        }
        let within = &self.text[span.clone()];
        let source = match value {
            Value::String(s) => s.clone(),
            Value::Integer(i) if within.contains(['{', '[']) => i.to_string(),
            Value::Float(x) if within.contains(['{', '[']) => x.to_string(),
            Value::Integer(_) | Value::Float(_) => within.replace('_', ""),
            other => {
                let message =
                    format!("found a {}; expected an expression in quotes, or a number", other.type_str());
                return Err(self.at(span.clone(), what.into(), message));
            }
        };
        // except for escapes, the expression is the same text in the file
        let offset = match source.is_empty() {
            true => Some(*cursor),
            false => self.text[*cursor..span.end].find(&source).map(|o| *cursor + o),
        };
        *cursor = offset.map_or(*cursor, |o| o + source.len());
        let place = FilePlace { what: what.into(), offset };
        let read = parse_components(&source, &self.shapes).map_err(|e| {
            let mut error = place.error(e.to_string(), e.span());
            error.span.get_or_insert(span.clone());
            error
        })?;
        let part = |expression: Expression| PlacedExpression {
            text: source.clone(),
            expression,
            place: place.clone(),
        };
        Ok(Formulas { shape: read.shape, parts: read.entries.into_iter().map(part).collect() })
    }

    /// Entries of `left - right` of an equation, and the expressions that are not negative where it holds;
    /// their text is the equation.
    pub(super) fn constraint(
        &self,
        equation: &Spanned<String>,
    ) -> Result<(Vec<PlacedExpression>, Option<PlacedExpression>), ModelError> {
        let (text, span) = (equation.get_ref().trim(), equation.span());
        let offset = self.text[span.clone()].find(text).map(|o| span.start + o);
        let place = FilePlace { what: format!("the constraint {}", excerpt(text)), offset };
        let (read, size) = parse_equation(text, &self.shapes).map_err(|e| {
            let mut error = place.error(e.to_string(), e.span());
            error.span.get_or_insert(span);
            error
        })?;
        let part = |expression| PlacedExpression { text: text.into(), expression, place: place.clone() };
        Ok((read.entries.into_iter().map(part).collect(), size.map(part)))
    }

    /// Expressions of the entries of `name`, whose shape is known; 0 stands for every entry.
    pub(super) fn fitted(
        &self,
        (name, what): (&str, &str),
        value: &Value,
        span: Range<usize>,
    ) -> Result<Vec<PlacedExpression>, ModelError> {
        let shape = self.shapes.get(name).copied().unwrap_or(Shape::SCALAR);
        let mut found = self.formulas(what, value, span.clone())?;
        if found.shape != shape && found.is_zero() {
            found.parts = vec![found.parts[0].clone(); shape.entries()];
            found.shape = shape;
        }
        if found.shape != shape {
            let hint = match (shape, found.shape) {
                (Shape::SCALAR, Shape { rows, columns: 1 }) => {
                    format!("; `{name}[{rows}]` in quotes declares one")
                }
                (Shape::SCALAR, Shape { rows, columns }) => {
                    format!("; `{name}[{rows},{columns}]` in quotes declares one")
                }
                _ => String::new(),
            };
            let message = format!("found {}; expected {shape}, as `{name}` is{hint}", found.shape);
            return Err(self.at(span, what.into(), message));
        }
        Ok(found.parts)
    }

    /// Checks that no vector has the name of another entry.
    pub(super) fn names_of_their_own(
        &self,
        sections: &[&[ModelEntry<'_>]],
        parameters: &[Named],
    ) -> Result<(), ModelError> {
        let keys = sections.iter().flat_map(|s| s.iter()).map(|(key, value)| (base(key), value.span()));
        let mut seen: HashSet<&str> = parameters.iter().map(|p| base(&p.name)).collect();
        for (name, span) in keys {
            if !seen.insert(name) && self.shapes.contains_key(name) {
                return Err(self.at(
                    span,
                    format!("`{name}`"),
                    "given twice; expected different names".into(),
                ));
            }
        }
        Ok(())
    }

    /// Entries sorted so that each comes after those that it names.
    pub(super) fn by_use<'e>(
        &self,
        kind: &str,
        entries: &[ModelEntry<'e>],
    ) -> Result<Vec<ModelEntry<'e>>, ModelError> {
        by_use(entries).map_err(|circle| {
            let names: Vec<&str> = circle.iter().map(|&i| base(entries[i].0)).collect();
            let message = format!("a circle: {}; expected an end to it", names.join(" -> "));
            self.at(entries[circle[0]].1.span(), format!("{kind} {}", names[0]), message)
        })
    }

    /// Names of the entries of `name`.
    pub(super) fn entries(&self, name: &str) -> Vec<String> {
        self.shapes.get(name).map_or_else(|| vec![name.to_string()], |shape| shape.names(name))
    }

    /// Records the size that a key declares; returns the name without it.
    pub(super) fn declare<'k>(&mut self, key: &'k str, span: Range<usize>) -> Result<&'k str, ModelError> {
        let (name, shape) = declared(key).map_err(|message| self.at(span, format!("`{key}`"), message))?;
        if let Some(shape) = shape {
            self.shapes.insert(name.into(), shape);
        }
        Ok(name)
    }

    /// Name of a key whose shape is that of its expression, and the expressions of its entries.
    pub(super) fn defined<'k>(
        &mut self,
        (key, what): (&'k str, &str),
        value: &Value,
        span: Range<usize>,
    ) -> Result<(&'k str, Vec<PlacedExpression>), ModelError> {
        let name = self.declare(key, span.clone())?;
        if self.shapes.contains_key(name) {
            return Ok((name, self.fitted((name, what), value, span)?));
        }
        let found = self.formulas(what, value, span)?;
        if found.shape != Shape::SCALAR {
            self.shapes.insert(name.into(), found.shape);
        }
        Ok((name, found.parts))
    }
}

/// Byte range of the last place where a name in quotes (`` `x` ``) is defined: as a key, or in a list of
/// names.
pub(super) fn last_mention(text: &str, quoted: &str) -> Option<Range<usize>> {
    let name = quoted.strip_prefix('`')?.strip_suffix('`')?;
    let given = |at: usize| {
        let (before, after) = (&text[..at], text[at + name.len()..].trim_start());
        let key = after.starts_with('=') && before.trim_end_matches([' ', '\t']).ends_with(['\n', '{', ',']);
        key || (before.ends_with('"') && text[at + name.len()..].starts_with('"'))
    };
    let at = text.match_indices(name).map(|(at, _)| at).filter(|&at| given(at)).last()?;
    Some(at..at + name.len())
}

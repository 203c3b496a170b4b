//! Tables of an answer: the lists of objects in its JSON, one row per object, with the names of the JSON.

use serde_json::{Map, Value};

/// A table with a row per object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Path of the list in the JSON: `quantities`, `schemes.quantities`.
    pub name: String,
    /// Path of each field of the objects: `solution.text`.
    pub columns: Vec<String>,
    /// Texts in the order of the columns: numbers with all their digits, empty texts for missing values,
    /// lists of words and numbers with semicolons between them.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Table of rows whose fields may differ.
    fn of(name: String, rows: &[Vec<(String, String)>]) -> Self {
        let mut columns: Vec<String> = Vec::new();
        for (column, _) in rows.iter().flatten() {
            if !columns.contains(column) {
                columns.push(column.clone());
            }
        }
        // a field that is an object in one row may be null in another
        let below =
            |c: &String| columns.iter().any(|d| d.strip_prefix(c).is_some_and(|d| d.starts_with('.')));
        let objects: Vec<String> = columns.iter().filter(|c| below(c)).cloned().collect();
        columns.retain(|c| !objects.contains(c));
        let field = |row: &Vec<(String, String)>, column: &String| {
            row.iter().find(|(c, _)| c == column).map(|(_, text)| text.clone()).unwrap_or_default()
        };
        let rows = rows.iter().map(|row| columns.iter().map(|c| field(row, c)).collect()).collect();
        Self { name, columns, rows }
    }

    /// Rows as fields with the names of their columns.
    fn fields(self) -> Vec<Vec<(String, String)>> {
        let Self { columns, rows, .. } = self;
        rows.into_iter().map(|row| columns.iter().cloned().zip(row).collect()).collect()
    }
}

/// True if the value at `path` is an empty list.
pub(crate) fn is_empty_list(answer: &Value, path: &str) -> bool {
    let pointer = format!("/{}", path.replace('.', "/"));
    answer.pointer(&pointer).is_some_and(|v| v.as_array().is_some_and(Vec::is_empty))
}

/// Tables of an answer: its own fields, then every list of objects in it, at any depth. The table of a nested
/// list has the name of the outer object in its first column.
pub(crate) fn of_json(answer: &Value) -> Vec<Table> {
    let mut out = Vec::new();
    if let Value::Object(fields) = answer {
        let mut own = Vec::new();
        visit(fields, "", &mut own, "", &[], &mut out);
        out.insert(0, Table::of("answer".into(), &[own]));
    }
    out
}

/// The tables of several answers by name, with the name of each answer in a first column.
pub(crate) fn together(answers: Vec<(String, Vec<Table>)>) -> Vec<Table> {
    let mut out = Vec::new();
    for (file, tables) in answers {
        let named = |mut table: Table| {
            table.columns.insert(0, "file".into());
            table.rows.iter_mut().for_each(|row| row.insert(0, file.clone()));
            table
        };
        merge(&mut out, tables.into_iter().map(named).collect());
    }
    out
}

fn path(above: &str, key: &str) -> String {
    if above.is_empty() { key.into() } else { format!("{above}.{key}") }
}

/// Adds the fields of an object to `row`, and the lists of objects below it to `out`.
fn visit(
    fields: &Map<String, Value>,
    column: &str,
    row: &mut Vec<(String, String)>,
    table: &str,
    keys: &[(String, String)],
    out: &mut Vec<Table>,
) {
    for (key, value) in fields {
        match value {
            Value::Object(below) => visit(below, &path(column, key), row, &path(table, key), keys, out),
            Value::Array(items) if items.iter().any(|v| v.is_object() || v.is_array()) => {
                list(items, &path(table, key), keys, out);
            }
            // an empty list shows no type of items
            Value::Array(items) if items.is_empty() => {}
            Value::Array(items) => {
                let words: Vec<String> = items.iter().map(text).collect();
                row.push((path(column, key), words.join("; ")));
            }
            value => row.push((path(column, key), text(value))),
        }
    }
}

/// Adds a list of objects, or of lists of objects.
fn list(items: &[Value], name: &str, keys: &[(String, String)], out: &mut Vec<Table>) {
    let at = out.len();
    let mut rows = Vec::new();
    let mut below: Vec<Table> = Vec::new();
    for (i, item) in items.iter().enumerate() {
        match item {
            Value::Object(fields) => {
                let mut row = keys.to_vec();
                let known =
                    ["name", "label", "expression", "what", "unknown"].iter().find_map(|k| fields.get(*k));
                let key = (format!("{name}.name"), known.map_or_else(|| (i + 1).to_string(), text));
                let keys: Vec<_> = keys.iter().cloned().chain([key]).collect();
                let mut found = Vec::new();
                visit(fields, "", &mut row, name, &keys, &mut found);
                rows.push(row);
                merge(&mut below, found);
            }
            // lists of lists: the number of each is its key
            Value::Array(inner) if inner.iter().any(Value::is_object) => {
                let key = (format!("{name}.number"), (i + 1).to_string());
                let keys: Vec<_> = keys.iter().cloned().chain([key]).collect();
                let mut found = Vec::new();
                list(inner, name, &keys, &mut found);
                merge(&mut below, found);
            }
            // a matrix
            Value::Array(inner) if inner.iter().all(Value::is_number) => {
                for (k, v) in inner.iter().enumerate() {
                    let cells =
                        [("row", (i + 1).to_string()), ("column", (k + 1).to_string()), ("value", text(v))];
                    let cells = cells.map(|(name, text)| (name.to_string(), text));
                    rows.push(keys.iter().cloned().chain(cells).collect());
                }
            }
            Value::Array(inner) => {
                let cells = inner.iter().enumerate().map(|(k, v)| ((k + 1).to_string(), text(v)));
                rows.push(keys.iter().cloned().chain(cells).collect());
            }
            _ => {}
        }
    }
    if !rows.is_empty() {
        out.insert(at, Table::of(name.into(), &rows));
    }
    merge(out, below);
}

/// Appends tables to those of the same name.
fn merge(to: &mut Vec<Table>, more: Vec<Table>) {
    for table in more {
        match to.iter().position(|t| t.name == table.name) {
            Some(i) => {
                let mut rows = to[i].clone().fields();
                let name = table.name.clone();
                rows.extend(table.fields());
                to[i] = Table::of(name, &rows);
            }
            None => to.push(table),
        }
    }
}

fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn lists_of_objects_are_tables() {
        let tables = of_json(&json!({
            "seed": 1,
            "rank": [1, 2],
            "at": { "latitude_deg": 28.2, "by": null },
            "schemes": [
                {
                    "name": "a", "worst": null, "missed": [],
                    "quantities": [{ "name": "x", "sigma": 1.5e-300 }, { "name": "y", "degree": 2 }],
                },
                { "name": "b", "worst": { "name": "x" }, "quantities": [{ "name": "x", "sigma": null }] },
            ],
            "null_space": [[{ "name": "x" }], [{ "name": "y" }]],
            "noise": [["y", 0.1]],
            "matrix": [[1.0, 0.5], [0.5, 2.0]],
        }));
        let shown = |t: &Table| {
            let rows: Vec<String> = t.rows.iter().map(|r| r.join(",")).collect();
            format!("{}: {} | {}", t.name, t.columns.join(","), rows.join(" | "))
        };
        assert_eq!(
            tables.iter().map(shown).collect::<Vec<_>>(),
            [
                "answer: seed,rank,at.latitude_deg,at.by | 1,1; 2,28.2,",
                "schemes: name,worst.name | a, | b,x",
                "schemes.quantities: schemes.name,name,sigma,degree | a,x,1.5e-300, | a,y,,2 | b,x,,",
                "null_space: null_space.number,name | 1,x | 2,y",
                "noise: 1,2 | y,0.1",
                "matrix: row,column,value | 1,1,1.0 | 1,2,0.5 | 2,1,0.5 | 2,2,2.0",
            ]
        );
    }
}

//! Linker of the page's scripts: modules become one script that needs no file beside it.
//!
//! Modules are those of the language. Two forms are allowed: `import { a, b } from './x.js';`, and `export`
//! before a function, a class or one constant. A module becomes a function that is called once and returns
//! its exports.

use std::collections::{HashMap, HashSet};

use crate::tokens::{declarators, declared, is_name, tokens, used};

const IMPORT: &str = "import { a, b } from './x.js';";
const EXPORT: &str = "export before `function`, `async function`, `class` or `const` with one name";

/// Error that ends the linking of scripts.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LinkError {
    /// An import or export in another form.
    #[error("{file}: expected {expected}, found {found}")]
    Form { file: String, expected: &'static str, found: String },
    /// An import from a file that is no script of the page.
    #[error("{file} imports from {from}; expected one of {scripts}")]
    File { file: String, from: String, scripts: String },
    /// An import of a name that the other script does not export.
    #[error("{file} imports {name} from {from}; expected one of its exports: {exports}")]
    Name { file: String, name: String, from: String, exports: String },
    /// An import that its script does not use.
    #[error("{file} imports {name} and does not use it; expected no import of it")]
    UnusedImport { file: String, name: String },
    /// An export that no script imports.
    #[error("{file} exports {name}, which no script imports; expected no `export`")]
    UnusedExport { file: String, name: String },
    /// A name of another script that is used without an import.
    #[error("{file} uses {name} of {from}; expected an import of it")]
    NotImported { file: String, name: String, from: String },
    /// Scripts that import one another.
    #[error("imports in a circle: {0}; expected imports in one direction")]
    Circle(String),
}

/// A script with its imports and exports.
struct Script<'a> {
    file: &'a str,
    /// Names by the file that they are imported from.
    imports: Vec<(&'a str, Vec<&'a str>)>,
    exports: Vec<&'a str>,
    /// Tokens without imports.
    tokens: Vec<&'a str>,
    /// Text without imports, the word `export`, comments and indents.
    body: String,
}

/// One script from modules, each a file and its text.
pub(crate) fn linked(scripts: &[(&str, &str)]) -> Result<String, LinkError> {
    let modules = scripts.iter().map(|(file, text)| module(file, text)).collect::<Result<Vec<_>, _>>()?;
    imports_hold(&modules)?;
    names_are_imported(&modules)?;
    let (mut order, mut path) = (Vec::new(), Vec::new());
    for module in &modules {
        visit(module, &modules, &mut path, &mut order)?;
    }
    Ok(order.into_iter().map(emitted).collect())
}

/// Reads the imports and exports of a script.
fn module<'a>(file: &'a str, text: &'a str) -> Result<Script<'a>, LinkError> {
    let all = tokens(text);
    let mut module = Script { file, imports: vec![], exports: vec![], tokens: vec![], body: String::new() };
    // offset of a token in the text
    let offset = |token: &str| token.as_ptr() as usize - text.as_ptr() as usize;
    let form = |expected, at: usize| {
        let found = text[offset(all[at])..].lines().next().unwrap_or("").to_owned();
        LinkError::Form { file: file.to_owned(), expected, found: format!("`{found}`") }
    };
    // index of the token, and end of the last one in the body
    let (mut at, mut end) = (0, 0);
    while at < all.len() {
        let (start, property) = (at, at > 0 && [".", "?."].contains(&all[at - 1]));
        match all[at] {
            "import" if !property => {
                let (from, names) = import(&all, &mut at).ok_or_else(|| form(IMPORT, start))?;
                module.imports.push((from, names));
                continue;
            }
            "export" if !property => {
                module.exports.push(export(&all, at).ok_or_else(|| form(EXPORT, start))?);
            }
            token => {
                let between = &text[end..offset(token)];
                module.body += if between.contains('\n') { "\n" } else { &" "[..between.len().min(1)] };
                module.body += token;
                end = offset(token) + token.len();
                module.tokens.push(token);
            }
        }
        at += 1;
    }
    Ok(module)
}

/// File and names of the import at `at`, which then is behind it.
fn import<'a>(all: &[&'a str], at: &mut usize) -> Option<(&'a str, Vec<&'a str>)> {
    let length = all[*at..].iter().position(|t| *t == ";")?;
    let [_, "{", names @ .., "}", "from", file] = &all[*at..*at + length] else { return None };
    let names: Vec<_> = names.split(|t| *t == ",").collect();
    // a comma may follow the last name
    let names = names.strip_suffix(&[&[][..]]).unwrap_or(&names);
    let one = |name: &&[&'a str]| if let [name] = *name { Some(*name).filter(|n| is_name(n)) } else { None };
    let names = names.iter().map(one).collect::<Option<Vec<_>>>()?;
    let from = file.strip_prefix("'./")?.strip_suffix('\'')?;
    *at += length + 1;
    Some((from, names)).filter(|(_, names)| !names.is_empty())
}

/// Name of the export at `at`.
fn export<'a>(all: &[&'a str], at: usize) -> Option<&'a str> {
    let name = match all.get(at + 1..)? {
        ["async", "function", name, ..] | ["function" | "class", name, ..] => *name,
        ["const", name, "=", ..] if declarators(all, at + 2).len() == 1 => *name,
        _ => return None,
    };
    Some(name).filter(|n| is_name(n))
}

/// Every import is of an export and is used, and every export is imported.
fn imports_hold(modules: &[Script]) -> Result<(), LinkError> {
    let exports: HashMap<_, _> = modules.iter().map(|m| (m.file, &m.exports)).collect();
    let mut imported = HashSet::new();
    for module in modules {
        let (file, uses) = (module.file.to_owned(), used(&module.tokens));
        for (from, names) in &module.imports {
            let Some(exports) = exports.get(from) else {
                let scripts = modules.iter().map(|m| m.file).collect::<Vec<_>>().join(", ");
                return Err(LinkError::File { file, from: (*from).to_owned(), scripts });
            };
            for name in names {
                let own = (*name).to_owned();
                if !exports.contains(name) {
                    let from = (*from).to_owned();
                    return Err(LinkError::Name { file, name: own, from, exports: exports.join(", ") });
                }
                if !uses.contains(name) {
                    return Err(LinkError::UnusedImport { file, name: own });
                }
                imported.insert((*from, *name));
            }
        }
    }
    for module in modules {
        if let Some(name) = module.exports.iter().find(|name| !imported.contains(&(module.file, **name))) {
            return Err(LinkError::UnusedExport { file: module.file.to_owned(), name: (*name).to_owned() });
        }
    }
    Ok(())
}

/// No script uses a name of another one that it neither imports nor declares.
fn names_are_imported(modules: &[Script]) -> Result<(), LinkError> {
    let top: Vec<_> = modules.iter().map(|m| (m.file, declared(&m.tokens, false))).collect();
    for module in modules {
        let mut known = declared(&module.tokens, true);
        known.extend(module.imports.iter().flat_map(|(_, names)| names));
        let owner = |name| top.iter().find(|(_, names)| names.contains(name)).map(|(from, _)| (name, from));
        if let Some((name, from)) = used(&module.tokens).difference(&known).filter_map(owner).min() {
            let [file, name, from] = [module.file, name, from].map(str::to_owned);
            return Err(LinkError::NotImported { file, name, from });
        }
    }
    Ok(())
}

/// Adds a module to `order` after all that it imports; `path` are the modules that import it.
fn visit<'a>(
    module: &'a Script<'a>,
    modules: &'a [Script<'a>],
    path: &mut Vec<&'a str>,
    order: &mut Vec<&'a Script<'a>>,
) -> Result<(), LinkError> {
    if let Some(start) = path.iter().position(|file| *file == module.file) {
        return Err(LinkError::Circle(path[start..].join(", ")));
    }
    if order.iter().any(|m| m.file == module.file) {
        return Ok(());
    }
    path.push(module.file);
    for (from, _) in &module.imports {
        if let Some(imported) = modules.iter().find(|m| m.file == *from) {
            visit(imported, modules, path, order)?;
        }
    }
    path.pop();
    order.push(module);
    Ok(())
}

/// A module as a constant: the call of a function that returns its exports.
fn emitted(module: &Script) -> String {
    let constant = |file: &str| format!("m_{}", file.trim_end_matches(".js"));
    let import = |(from, names): &(&str, Vec<&str>)| {
        format!("const {{ {} }} = {};\n", names.join(", "), constant(from))
    };
    let imports: String = module.imports.iter().map(import).collect();
    let (name, exports) = (constant(module.file), module.exports.join(", "));
    format!(
        "const {name} = (() => {{\n{imports}{}\nreturn {{ {exports} }};\n}})();\n",
        module.body.trim_start()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error of linking scripts.
    fn refusal(scripts: &[(&str, &str)]) -> String {
        linked(scripts).expect_err("a refusal").to_string()
    }

    #[test]
    fn the_scripts_of_the_page_link() {
        let script = linked(crate::build::SCRIPTS).expect("they link");
        assert!(script.ends_with("begin();\nreturn {  };\n})();\n"), "main.js runs last");
    }

    #[test]
    fn modules_run_after_those_that_they_import() {
        let scripts = [
            ("main.js", "// The start.\nimport {\n  a, b,\n} from './b.js';\n\na(b // its end\n  );\n"),
            (
                "b.js",
                "import { c } from './c.js';\nexport const a = (x) => c;\nexport async function b() {}\n",
            ),
            ("c.js", "export class c {}\n"),
        ];
        let expected = "const m_c = (() => {\nclass c {}\nreturn { c };\n})();\n\
            const m_b = (() => {\nconst { c } = m_c;\nconst a = (x) => c;\nasync function b() {}\n\
            return { a, b };\n})();\n\
            const m_main = (() => {\nconst { a, b } = m_b;\na(b\n);\nreturn {  };\n})();\n";
        assert_eq!(linked(&scripts).expect("they link"), expected);
    }

    #[test]
    fn imports_are_of_exports_in_one_direction() {
        let a = ("a.js", "import { b } from './b.js';\nexport const a = b;");
        let b = ("b.js", "import { c } from './c.js';\nexport const b = c;");
        let c = ("c.js", "import { a } from './a.js';\nexport const c = a;");
        let circle = "imports in a circle: a.js, b.js, c.js; expected imports in one direction";
        assert_eq!(refusal(&[a, b, c]), circle);
        assert_eq!(refusal(&[a, c]), "a.js imports from b.js; expected one of a.js, c.js");
        let other = ("b.js", "export const x = 1, y = 2;");
        assert!(refusal(&[a, other]).starts_with("b.js: expected export before"), "{}", refusal(&[a, other]));
        let other = ("b.js", "export const x = 1;\nexport function y() {}");
        assert_eq!(refusal(&[a, other]), "a.js imports b from b.js; expected one of its exports: x, y");
    }

    #[test]
    fn imports_are_used_and_exports_imported() {
        let a = ("a.js", "export function a() {}\nexport function b() {}");
        let unused = ("b.js", "import { a, b } from './a.js';\na({ b: 'b' }, x.b); // b");
        assert_eq!(refusal(&[a, unused]), "b.js imports b and does not use it; expected no import of it");
        let one = ("b.js", "import { a } from './a.js';\na();");
        assert_eq!(refusal(&[a, one]), "a.js exports b, which no script imports; expected no `export`");
        let hidden = [("a.js", "function a() {}"), ("b.js", "const c = (b) => `${a(b)}`;")];
        assert_eq!(refusal(&hidden), "b.js uses a of a.js; expected an import of it");
        assert!(
            linked(&[hidden[0], ("b.js", "const c = (a) => a;")]).is_ok(),
            "a parameter of the same name"
        );
    }

    #[test]
    fn other_forms_are_refused() {
        let imports = [
            "import a from './a.js';",
            "import * as a from './a.js';",
            "import { a as b } from './a.js';",
            "import { } from './a.js';",
            "import { a } from \"./a.js\";",
            "import { a } from 'a.js';",
            "import './a.js';",
            "const a = await import('./a.js');",
        ];
        for text in imports {
            let found = &text[text.find("import").expect("an import")..];
            let expected = format!("b.js: expected {IMPORT}, found `{found}`");
            assert_eq!(refusal(&[("a.js", ""), ("b.js", text)]), expected);
        }
        let exports = [
            "let a = 1;",
            "default a;",
            "{ a };",
            "* from './a.js';",
            "const { a } = b;",
            "function* a() {}",
        ];
        for text in exports {
            let expected = format!("a.js: expected {EXPORT}, found `export {text}`");
            assert_eq!(refusal(&[("a.js", &format!("export {text}\nf();"))]), expected);
        }
    }
}

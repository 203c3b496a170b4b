//! Formulas from LaTeX to the typesetter's notation. Only commands that `latex` writes are known; other
//! commands become text.

use crate::latex::{FUNCTIONS, GREEK};

/// Letters, operators and spaces besides Greek letters and functions.
const WORDS: [(&str, &str); 9] = [
    ("psi", "psi"),
    ("varepsilon", "epsilon"),
    ("cdot", "dot.op"),
    ("to", "arrow.r"),
    ("circ", "degree"),
    ("quad", "quad"),
    (",", "thin"),
    (";", "med"),
    ("_", "\\_"),
];

/// The formula in the typesetter's notation.
pub(super) fn typst(latex: &str) -> String {
    let mut rest = latex;
    sequence(&mut rest)
}

/// Everything up to a closing brace.
fn sequence(rest: &mut &str) -> String {
    let mut out = String::new();
    while let Some(c) = rest.chars().next().filter(|c| *c != '}') {
        let atom = atom(rest);
        if atom.is_empty() {
            continue;
        }
        // primes, indices and exponents touch what they belong to
        let joins = matches!(c, '_' | '^' | '\'');
        if !out.is_empty() && !joins {
            out.push(' ');
        }
        out.push_str(&atom);
    }
    out
}

/// One symbol, command or group.
fn atom(rest: &mut &str) -> String {
    let Some(c) = rest.chars().next() else { return String::new() };
    *rest = &rest[c.len_utf8()..];
    match c {
        '{' => group_body(rest),
        '_' | '^' => format!("{c}({})", atom(rest)),
        '\\' => command(rest),
        '/' | '#' | '$' | '"' | '&' | '@' | '`' | '~' => format!("\\{c}"),
        '0'..='9' => {
            let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(rest.len());
            let digits = format!("{c}{}", &rest[..end]);
            *rest = &rest[end..];
            digits
        }
        c if c.is_whitespace() => String::new(),
        c => c.to_string(),
    }
}

/// Content of a group whose brace has been read.
fn group_body(rest: &mut &str) -> String {
    let body = sequence(rest);
    *rest = rest.strip_prefix('}').unwrap_or(rest);
    body
}

/// Text of a group of letters.
fn plain(rest: &mut &str) -> String {
    let Some(inner) = rest.strip_prefix('{') else { return String::new() };
    // `\_` and `\textasciicircum{}` are the escapes of plain text
    let mut depth = 1;
    let mut end = inner.len();
    for (i, c) in inner.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            end = i;
            break;
        }
    }
    let text = inner[..end]
        .replace("\\textbackslash{}", "\u{1}")
        .replace("\\textasciicircum{}", "^")
        .replace("\\textasciitilde{}", "~")
        .replace("$\\to$", "->")
        .replace("$<$", "<")
        .replace("$>$", ">")
        .replace('\\', "")
        .replace('\u{1}', "\\");
    *rest = inner.get(end + 1..).unwrap_or("");
    super::quoted(&text)
}

fn command(rest: &mut &str) -> String {
    let letters = rest.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(rest.len());
    let end = if letters == 0 { rest.chars().next().map_or(0, char::len_utf8) } else { letters };
    let name = &rest[..end];
    *rest = &rest[end..];
    let argument = |rest: &mut &str| atom(rest);
    match name {
        "dot" => format!("dot({})", argument(rest)),
        "ddot" => format!("dot.double({})", argument(rest)),
        "sqrt" => format!("sqrt({})", argument(rest)),
        "frac" => {
            let above = argument(rest);
            format!("frac({above}, {})", argument(rest))
        }
        "text" => plain(rest),
        "mathit" => format!("italic({})", plain(rest)),
        other if GREEK.contains(&other) || FUNCTIONS.iter().any(|f| f.1 == other) => other.into(),
        other => WORDS.iter().find(|w| w.0 == other).map_or_else(|| super::quoted(other), |w| w.1.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::typst;

    #[test]
    fn what_our_formulas_use() {
        let cases = [
            (
                "D_{FX} = \\frac{1}{2}\\,[\\omega_U\\,(Z_{1}(\\text{p1}))]",
                "D_(F X) = frac(1, 2) thin [ omega_(U) thin ( Z_(1) ( \"p1\" ) ) ]",
            ),
            ("\\psi_{x}^{(12)}", "psi_(x)^(( 12 ))"),
            ("\\ddot{Z}_{3}'^{2}/4", "dot.double(Z)_(3)'^(2) \\/ 4"),
            ("\\mathit{k\\_1}", "italic(\"k_1\")"),
            ("\\cos^{2}(\\alpha)\\cdot 2", "cos^(2) ( alpha ) dot.op 2"),
            ("\\text{a \\$ \"b\" \\textbackslash{}}", "\"a $ \\\"b\\\" \\\\\""),
        ];
        for (latex, expected) in cases {
            assert_eq!(typst(latex), expected, "{latex}");
        }
    }
}

//! Tokens of a script, and the names that it declares and uses: as much of the language as the linker needs.

use std::collections::HashSet;

/// Words that stand before a bracket without declaring what is in it.
const CONTROL: [&str; 5] = ["if", "for", "while", "switch", "with"];

/// Names, signs and literals of a script, without blanks and comments. The texts of a template are literals
/// between the tokens of its expressions.
pub(crate) fn tokens(text: &str) -> Vec<&str> {
    let (mut out, mut at) = (Vec::new(), 0);
    // open braces; true for those of templates
    let mut braces = Vec::new();
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let until = |end: &str| rest[2..].find(end).map_or(rest.len(), |n| 2 + n);
        let last = out.last().copied().unwrap_or("");
        let length = match first {
            _ if first.is_whitespace() => first.len_utf8(),
            '/' if rest.starts_with("//") => until("\n"),
            '/' if rest.starts_with("/*") => (until("*/") + 2).min(rest.len()),
            '/' if is_pattern_after(last) => pattern(rest),
            '\'' | '"' => literal(rest, first),
            '`' => literal(rest, '`'),
            '}' if braces.pop() == Some(true) => literal(rest, '`'),
            _ if is_of_name(first) => rest.find(|c| !is_of_name(c)).unwrap_or(rest.len()),
            _ => ["...", "=>", "?."]
                .into_iter()
                .find(|s| rest.starts_with(s))
                .map_or(first.len_utf8(), str::len),
        };
        let token = &rest[..length];
        if token.ends_with('{') && "{`}".contains(first) {
            braces.push(first != '{');
        }
        if !first.is_whitespace() && !token.starts_with("//") && !token.starts_with("/*") {
            out.push(token);
        }
        at += length;
    }
    out
}

fn is_of_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_' || c == '$'
}

/// True if a slash begins a regular expression, false if it divides what ends with the token before it.
fn is_pattern_after(last: &str) -> bool {
    let value =
        last.ends_with(|c| is_of_name(c) || ")]}'\"`".contains(c)) || (last.len() > 1 && last.ends_with('/'));
    !value || last == "return"
}

/// Length of a literal up to its quote; a part of a template also ends before an expression.
fn literal(rest: &str, quote: char) -> usize {
    // the character before, unless it is escaped
    let mut before = ' ';
    for (i, c) in rest.char_indices().skip(1) {
        match c {
            _ if before == '\\' => {
                before = ' ';
                continue;
            }
            '{' if quote == '`' && before == '$' => return i + 1,
            _ if c == quote => return i + 1,
            _ => before = c,
        }
    }
    rest.len()
}

/// Length of a regular expression with its flags.
fn pattern(rest: &str) -> usize {
    let (mut escaped, mut class) = (false, false);
    for (i, c) in rest.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '[' | ']' => class = c == '[',
            '/' if !class => return i + 1 + rest[i + 1..].bytes().take_while(u8::is_ascii_lowercase).count(),
            _ => {}
        }
    }
    rest.len()
}

/// True for a name, also if it is a word of the language.
pub(crate) fn is_name(token: &str) -> bool {
    token.starts_with(|c| is_of_name(c) && !c.is_ascii_digit())
}

/// Index of the bracket that closes the one at `open`.
fn closing(tokens: &[&str], open: usize) -> usize {
    let mut depth = 0;
    for (i, token) in tokens.iter().enumerate().skip(open) {
        depth += i32::from(token.ends_with(['(', '[', '{'])) - i32::from(token.starts_with([')', ']', '}']));
        if depth == 0 {
            return i;
        }
    }
    tokens.len()
}

/// Names that a pattern declares: those of its values and the rest, not those of keys and of default values.
fn bound<'a>(pattern: &[&'a str]) -> impl Iterator<Item = &'a str> {
    let key = |i: usize| pattern.get(i + 1) == Some(&":");
    let value = |i: usize| i == 0 || ["(", "[", "{", ",", ":", "..."].contains(&pattern[i - 1]);
    (0..pattern.len()).filter(move |&i| value(i) && !key(i)).map(|i| pattern[i]).filter(|t| is_name(t))
}

/// Names that a statement `const`, `let` or `var` declares; its first pattern is at `at`.
pub(crate) fn declarators<'a>(tokens: &[&'a str], mut at: usize) -> Vec<&'a str> {
    let mut out = Vec::new();
    while at < tokens.len() {
        let end = closing(tokens, at);
        out.extend(bound(&tokens[at..=end.min(tokens.len() - 1)]));
        at = end + 1;
        if tokens.get(at).is_none_or(|t| ["of", "in"].contains(t)) {
            break;
        }
        while at < tokens.len() && tokens[at] != "," {
            if tokens[at] == ";" || tokens[at].starts_with([')', ']', '}']) {
                return out;
            }
            at = closing(tokens, at) + 1;
        }
        at += 1;
    }
    out
}

/// Names that a script declares at its top level, or, with `within`, anywhere: also parameters.
pub(crate) fn declared<'a>(tokens: &[&'a str], within: bool) -> HashSet<&'a str> {
    let (mut out, mut at) = (HashSet::new(), 0);
    while at < tokens.len() {
        let next = tokens.get(at + 1).copied().unwrap_or("");
        match tokens[at] {
            "const" | "let" | "var" => out.extend(declarators(tokens, at + 1)),
            "function" | "class" => out.extend(Some(next).filter(|t| is_name(t))),
            name if within && next == "=>" => out.extend(Some(name).filter(|t| is_name(t))),
            "(" if within && (at == 0 || !CONTROL.contains(&tokens[at - 1])) => {
                let end = closing(tokens, at);
                if tokens.get(end + 1).is_some_and(|t| ["{", "=>"].contains(t)) {
                    out.extend(bound(&tokens[at..end]));
                }
            }
            _ => {}
        }
        at = if within { at + 1 } else { closing(tokens, at) + 1 };
    }
    out
}

/// Names that a script uses, other than those of properties.
pub(crate) fn used<'a>(tokens: &[&'a str]) -> HashSet<&'a str> {
    let at = |i: Option<usize>| i.and_then(|i| tokens.get(i)).copied().unwrap_or("");
    let property = |i: usize| {
        let before = at(i.checked_sub(1));
        [".", "?."].contains(&before) || (["{", ","].contains(&before) && at(Some(i + 1)) == ":")
    };
    (0..tokens.len()).filter(|&i| is_name(tokens[i]) && !property(i)).map(|i| tokens[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(names: HashSet<&str>) -> String {
        let mut names: Vec<_> = names.into_iter().collect();
        names.sort_unstable();
        names.join(" ")
    }

    #[test]
    fn literals_and_comments_hold_no_names() {
        let text = r#"a(/b\/[/]c/g, 'd\'e', "f", `g ${h(`i ${j}`, { k: l })} \${m}`) / n; // o
            /* p */ q?.r.s?t:u"#;
        assert_eq!(sorted(used(&tokens(text))), "a h j l n q t u");
        assert_eq!(tokens("return /x/ / 2;"), ["return", "/x/", "/", "2", ";"]);
    }

    #[test]
    fn names_are_declared_by_statements_and_parameters() {
        let text = "const { a, b: [c], ...d } = f(1, x), e = (g, { h = y } = {}) => z; \
            for (const i of w) { let j; } function k(l) { if (v) {} } const m = { n(o) {} }, p = q => 1;";
        let tokens = tokens(text);
        assert_eq!(sorted(declared(&tokens, false)), "a c d e k m p");
        assert_eq!(sorted(declared(&tokens, true)), "a c d e g h i j k l m o p q");
    }
}

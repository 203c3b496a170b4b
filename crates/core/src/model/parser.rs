//! The grammar of expressions, by winnow.

use winnow::Parser;
use winnow::combinator::{Infix, Prefix, expression};
use winnow::error::{ErrMode, ParserError};
use winnow::stream::{LocatingSlice, Location, Stateful, Stream};

use super::expression::{Expression, ExpressionError, Function, MAX_DEPTH, Names, Node};

type Input<'a> = Stateful<LocatingSlice<&'a str>, Expression>;

/// Where the grammar is violated, and what could stand there.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Wrong {
    at: usize,
    expected: &'static str,
}

impl ParserError<Input<'_>> for Wrong {
    type Inner = Self;
    fn from_input(input: &Input<'_>) -> Self {
        Self { at: input.current_token_start(), expected: "something else" }
    }
    fn into_inner(self) -> Result<Self, Self> {
        Ok(self)
    }
}

type Parsed<T> = Result<T, ErrMode<Wrong>>;

fn wrong<T>(input: &Input<'_>, expected: &'static str) -> Parsed<T> {
    Err(ErrMode::Cut(Wrong { at: input.current_token_start(), expected }))
}

/// Not this, perhaps something else.
fn other<T>(input: &Input<'_>) -> Parsed<T> {
    Err(ErrMode::Backtrack(Wrong::from_input(input)))
}

fn skip_blanks(input: &mut Input<'_>) {
    let rest: &str = input.input.as_ref();
    let blanks = rest.len() - rest.trim_start().len();
    input.next_slice(blanks);
}

fn peek(input: &Input<'_>) -> Option<char> {
    let rest: &str = input.input.as_ref();
    rest.chars().next()
}

/// The next character, if it is one of `wanted`.
fn symbol(input: &mut Input<'_>, wanted: &str) -> Option<char> {
    skip_blanks(input);
    let found = peek(input).filter(|c| wanted.contains(*c))?;
    input.next_slice(found.len_utf8());
    Some(found)
}

/// An operator between two operands; `**` is `^`.
fn operator(input: &mut Input<'_>) -> Option<char> {
    let found = symbol(input, "+-*/^")?;
    if found == '*' && peek(input) == Some('*') {
        input.next_slice(1);
        return Some('^');
    }
    Some(found)
}

/// Adds an operation that ends here.
fn push(input: &mut Input<'_>, node: Node, start: usize) -> usize {
    let end = input.previous_token_end();
    input.state.nodes.push(node);
    input.state.spans.push(start..end);
    input.state.nodes.len() - 1
}

fn number(input: &mut Input<'_>) -> Parsed<usize> {
    let start = input.current_token_start();
    let rest: &str = input.input.as_ref();
    let mut length = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
    let literal = &rest[..length];
    // an exponent, as in 1e-5
    let tail = &rest[length..];
    let digits = tail.strip_prefix(['e', 'E']).map(|t| (t, t.strip_prefix(['+', '-']).unwrap_or(t)));
    let mut exponent = 0i32;
    if let Some((signed, digits)) = digits.filter(|(_, d)| d.starts_with(|c: char| c.is_ascii_digit())) {
        let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
        let sign = signed.len() - digits.len();
        match signed[..sign + end].parse() {
            Ok(e @ -400..=400) => exponent = e,
            _ => return wrong(input, "an exponent of at most 400"),
        }
        length += 1 + sign + end;
    }
    let (whole, decimals) = literal.split_once('.').unwrap_or((literal, ""));
    let digits = format!("{whole}{decimals}");
    match digits.parse() {
        Ok(mantissa) if digits.len() <= 36 => {
            let decimals = decimals.len() as i32 - exponent;
            input.next_slice(length);
            Ok(push(input, Node::Number { mantissa, decimals }, start))
        }
        _ => wrong(input, "a number of at most 36 digits"),
    }
}

/// What could stand before a bracket instead of a name.
const fn functions(names: Names) -> &'static str {
    match names {
        Names::Platform => "a known function (sin, cos, sqrt) or an operator before `(`",
        Names::Plain => {
            "a known function (sin, cos, tan, asin, acos, atan, exp, log, sqrt) or an operator before `(`"
        }
    }
}

fn operand(input: &mut Input<'_>, names: Names) -> Parsed<usize> {
    skip_blanks(input);
    let start = input.current_token_start();
    match peek(input) {
        Some(c) if c.is_ascii_digit() || c == '.' => {
            let literal: &str = input.input.as_ref();
            let value = number(input)?;
            let rest: &str = input.input.as_ref();
            let behind = rest.strip_prefix(" deg").filter(|_| names == Names::Platform);
            if behind.is_none_or(|b| b.starts_with(|c: char| c.is_alphanumeric() || c == '_')) {
                return Ok(value);
            }
            // `20 deg` names an angle
            let name = literal[..literal.len() - rest.len() + " deg".len()].to_string();
            input.next_slice(" deg".len());
            input.state.nodes.pop();
            input.state.spans.pop();
            Ok(push(input, Node::Name(name), start))
        }
        Some(c) if c.is_alphabetic() || c == '_' => {
            let rest: &str = input.input.as_ref();
            let more = |c: char| c.is_alphanumeric() || c == '_' || (c == '@' && names == Names::Platform);
            let mut length = rest.find(|c| !more(c)).unwrap_or(rest.len());
            if names == Names::Platform && rest[length..].starts_with("^n") {
                length += 2;
            }
            let name = rest[..length].to_string();
            input.next_slice(length);
            let Some(function) = Function::named(&name) else {
                return match peek(input) {
                    Some('(') => Err(ErrMode::Cut(Wrong { at: start, expected: functions(names) })),
                    _ => Ok(push(input, Node::Name(name), start)),
                };
            };
            if symbol(input, "(").is_none() {
                return wrong(input, "`(`");
            }
            let argument = sum(input, names)?;
            if symbol(input, ")").is_none() {
                return wrong(input, "an operator or `)`");
            }
            Ok(push(input, Node::Call { function, argument }, start))
        }
        Some('(') => {
            symbol(input, "(");
            let inner = sum(input, names)?;
            if symbol(input, ")").is_none() {
                return wrong(input, "an operator or `)`");
            }
            Ok(inner)
        }
        _ => other(input),
    }
}

fn sum(input: &mut Input<'_>, names: Names) -> Parsed<usize> {
    fn of(input: &mut Input<'_>, a: usize, b: usize, node: fn(usize, usize) -> Node) -> Parsed<usize> {
        let start = input.state.spans[a].start;
        Ok(push(input, node(a, b), start))
    }
    expression(|input: &mut Input<'_>| operand(input, names))
        .prefix(|input: &mut Input<'_>| match symbol(input, "-+") {
            Some('-') => Ok(Prefix(5, |input: &mut Input<'_>, a: usize| {
                let start = input.state.spans[a].start;
                Ok(push(input, Node::Negate(a), start))
            })),
            Some(_) => Ok(Prefix(5, |_: &mut Input<'_>, a: usize| Ok(a))),
            None => wrong(input, "a number, a name or `(`"),
        })
        .infix(|input: &mut Input<'_>| match operator(input) {
            Some('+') => Ok(Infix::Left(1, |i: &mut Input<'_>, a, b| of(i, a, b, Node::Add))),
            Some('-') => Ok(Infix::Left(1, |i: &mut Input<'_>, a, b| of(i, a, b, Node::Subtract))),
            Some('*') => Ok(Infix::Left(3, |i: &mut Input<'_>, a, b| of(i, a, b, Node::Multiply))),
            Some('/') => Ok(Infix::Left(3, |i: &mut Input<'_>, a, b| of(i, a, b, Node::Divide))),
            Some(_) => Ok(Infix::Right(8, |i: &mut Input<'_>, a, b| of(i, a, b, Node::Power))),
            None => other(input),
        })
        .parse_next(input)
}

/// The first place that is nested too deeply.
fn too_deep(text: &str) -> Option<usize> {
    let (mut brackets, mut signs, mut powers) = (0usize, 0usize, 0usize);
    let mut before = ' ';
    let mut characters = text.char_indices().filter(|(_, c)| !c.is_whitespace()).peekable();
    while let Some((at, c)) = characters.next() {
        // ** is ^
        let double = c == '*' && characters.next_if(|next| *next == (at + 1, '*')).is_some();
        let c = if double { '^' } else { c };
        match c {
            '(' => brackets += 1,
            ')' => brackets = brackets.saturating_sub(1),
            _ => {}
        }
        let sign = matches!(c, '+' | '-');
        signs = if sign { signs + 1 } else { 0 };
        // a sign behind ^ belongs to the exponent
        if matches!(c, '*' | '/' | '(' | ')') || (sign && !matches!(before, '^' | '+' | '-')) {
            powers = 0;
        }
        powers += usize::from(c == '^');
        if brackets > MAX_DEPTH || signs > MAX_DEPTH || powers > MAX_DEPTH {
            return Some(at);
        }
        before = c;
    }
    None
}

/// Parses a whole text with names of the platform.
///
/// # Errors
/// [`ExpressionError`] with the place in the text.
pub fn parse(text: &str) -> Result<Expression, ExpressionError> {
    parse_with(text, Names::Platform)
}

/// Parses a whole text.
///
/// # Errors
/// [`ExpressionError`] with the place in the text.
pub fn parse_with(text: &str, names: Names) -> Result<Expression, ExpressionError> {
    if let Some(at) = too_deep(text) {
        return Err(ExpressionError::TooDeep { span: at..at + 1 });
    }
    let mut input = Stateful { input: LocatingSlice::new(text), state: Expression::default() };
    let parsed = sum(&mut input, names).and_then(|root| {
        skip_blanks(&mut input);
        match peek(&input) {
            None => Ok(root),
            Some(_) => wrong(&input, "an operator or the end of the expression"),
        }
    });
    match parsed {
        // operands come first: the whole is the last
        Ok(_) => Ok(input.state),
        Err(error) => {
            let wrong = error.into_inner().unwrap_or(Wrong { at: text.len(), expected: "an expression" });
            let rest = &text[wrong.at..];
            let token = rest.find(|c: char| !c.is_alphanumeric() && c != '_' && c != '.');
            let length = match token {
                Some(0) => rest.chars().next().map_or(0, char::len_utf8),
                other => other.unwrap_or(rest.len()),
            };
            let found = match length {
                0 => "the end of the expression".into(),
                _ => format!("`{}`", rest[..length].chars().take(40).collect::<String>()),
            };
            let span = wrong.at..wrong.at + length;
            Err(ExpressionError::Syntax { expected: wrong.expected, found, span })
        }
    }
}

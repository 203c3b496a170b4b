//! The grammar of expressions, by winnow.

use std::collections::HashMap;

use winnow::Parser;
use winnow::combinator::{Infix, Prefix, expression};
use winnow::error::{ErrMode, ParserError};
use winnow::stream::{LocatingSlice, Location, Stateful, Stream};

use super::expression::{
    Expression, ExpressionError, Function, MAX_DEPTH, MAX_NAME, Names, Node, evaluate_f64,
};
use super::vectors::{Made, Mismatch, NodeBuilder, Shape, Value, VectorOperation, component, entry, list};

/// Largest number of names, numbers and operations of a vector or matrix with all entries written out.
const MAX_WRITTEN_OUT: usize = 4_000_000;

/// Shapes of the names that are no scalars.
pub type Shapes = HashMap<String, Shape>;

/// State of the parser: the expression read so far.
#[derive(Debug, Clone)]
struct ParserState<'a> {
    expression: Expression,
    names: Names,
    shapes: &'a Shapes,
    /// True if any value was no scalar.
    vectors: bool,
}

type ParserInput<'a> = Stateful<LocatingSlice<&'a str>, ParserState<'a>>;

/// Error of the parser: place and expected text, or shapes that do not fit.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ParseFailure {
    at: usize,
    expected: &'static str,
    shape: Option<Box<ExpressionError>>,
}

impl ParserError<ParserInput<'_>> for ParseFailure {
    type Inner = Self;
    fn from_input(input: &ParserInput<'_>) -> Self {
        Self { at: input.current_token_start(), expected: "something else", shape: None }
    }
    fn into_inner(self) -> Result<Self, Self> {
        Ok(self)
    }
}

type Parsed<T> = Result<T, ErrMode<ParseFailure>>;

fn wrong<T>(input: &ParserInput<'_>, expected: &'static str) -> Parsed<T> {
    Err(ErrMode::Cut(ParseFailure { at: input.current_token_start(), expected, shape: None }))
}

/// Failure from which the parser may try another rule.
fn other<T>(input: &ParserInput<'_>) -> Parsed<T> {
    Err(ErrMode::Backtrack(ParseFailure::from_input(input)))
}

fn skip_blanks(input: &mut ParserInput<'_>) {
    let rest: &str = input.input.as_ref();
    let blanks = rest.len() - rest.trim_start().len();
    input.next_slice(blanks);
}

fn peek(input: &ParserInput<'_>) -> Option<char> {
    let rest: &str = input.input.as_ref();
    rest.chars().next()
}

/// Next character, if it is one of `wanted`.
fn symbol(input: &mut ParserInput<'_>, wanted: &str) -> Option<char> {
    skip_blanks(input);
    let found = peek(input).filter(|c| wanted.contains(*c))?;
    input.next_slice(found.len_utf8());
    Some(found)
}

/// Operator between two operands; `**` is read as `^`.
fn operator(input: &mut ParserInput<'_>) -> Option<char> {
    let found = symbol(input, "+-*/^")?;
    if found == '*' && peek(input) == Some('*') {
        input.next_slice(1);
        return Some('^');
    }
    Some(found)
}

/// Adds an operation on scalars that ends at the current place.
fn push(input: &mut ParserInput<'_>, node: Node, start: usize) -> Value {
    let end = input.previous_token_end();
    let expression = &mut input.state.expression;
    expression.nodes.push(node);
    expression.spans.push(start..end);
    Value { shape: Shape::SCALAR, entries: vec![expression.nodes.len() - 1], start }
}

/// Adds an operation that ends at the current place and makes or takes vectors.
fn push_vector(
    input: &mut ParserInput<'_>,
    start: usize,
    made: impl FnOnce(&mut NodeBuilder<'_>) -> Made,
) -> Parsed<Value> {
    let span = start..input.previous_token_end();
    input.state.vectors = true;
    let mut builder = NodeBuilder { expression: &mut input.state.expression, span: span.clone() };
    match made(&mut builder) {
        Ok((shape, entries)) => Ok(Value { shape, entries, start }),
        Err(Mismatch { expected, found }) => {
            let shape = ExpressionError::Shape { expected, found, span };
            Err(ErrMode::Cut(ParseFailure { at: start, expected: "", shape: Some(Box::new(shape)) }))
        }
    }
}

fn number(input: &mut ParserInput<'_>) -> Parsed<Value> {
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

/// Functions with these names, for messages about an unknown name before a bracket.
const fn functions(names: Names) -> &'static str {
    match names {
        Names::Platform => "a known function (sin, cos, sqrt) or an operator before `(`",
        Names::Plain => {
            "a known function (sin, cos, tan, asin, acos, atan, atan2, exp, log, sqrt, tanh, abs, sign; of \
             vectors cross, dot, norm, transpose, skew, R, qmul, conj, qdot, Rx, Ry, Rz) or an operator \
             before `(`"
        }
    }
}

fn operand(input: &mut ParserInput<'_>) -> Parsed<Value> {
    skip_blanks(input);
    let start = input.current_token_start();
    let plain = input.state.names == Names::Plain;
    let mut value = match peek(input) {
        Some(c) if c.is_ascii_digit() || c == '.' => {
            let literal: &str = input.input.as_ref();
            let value = number(input)?;
            let rest: &str = input.input.as_ref();
            let behind = rest.strip_prefix(" deg").filter(|_| !plain);
            if behind.is_none_or(|b| b.starts_with(|c: char| c.is_alphanumeric() || c == '_')) {
                return Ok(value);
            }
            // `20 deg` names an angle
            let name = literal[..literal.len() - rest.len() + " deg".len()].to_string();
            input.next_slice(" deg".len());
            input.state.expression.nodes.pop();
            input.state.expression.spans.pop();
            return Ok(push(input, Node::Name(name), start));
        }
        Some(c) if c.is_alphabetic() || c == '_' => name(input, start)?,
        Some('(') => {
            symbol(input, "(");
            let inner = sum(input)?;
            if symbol(input, ")").is_none() {
                return wrong(input, "an operator or `)`");
            }
            inner
        }
        Some('[') if plain => {
            symbol(input, "[");
            let parts = values(input, "]", "an operator, `,` or `]`")?;
            push_vector(input, start, |_| list(&parts))?
        }
        _ => return other(input),
    };
    while plain && symbol(input, "[").is_some() {
        let mut index = Vec::new();
        loop {
            skip_blanks(input);
            let rest: &str = input.input.as_ref();
            let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
            let Ok(i) = rest[..digits].parse::<usize>() else {
                return wrong(input, "an index: a whole number from 1 on");
            };
            input.next_slice(digits);
            index.push(i);
            match symbol(input, ",]") {
                Some(',') => {}
                Some(_) => break,
                None => return wrong(input, "`,` or `]`"),
            }
        }
        value = push_vector(input, start, |_| Ok((Shape::SCALAR, vec![entry(&value, &index)?])))?;
    }
    Ok(value)
}

/// Values between commas, until `end`.
fn values(input: &mut ParserInput<'_>, end: &str, expected: &'static str) -> Parsed<Vec<Value>> {
    let mut out = Vec::new();
    loop {
        out.push(sum(input)?);
        if symbol(input, ",").is_none() {
            return if symbol(input, end).is_some() { Ok(out) } else { wrong(input, expected) };
        }
    }
}

/// A name, or a function with its arguments.
fn name(input: &mut ParserInput<'_>, start: usize) -> Parsed<Value> {
    let names = input.state.names;
    let rest: &str = input.input.as_ref();
    let more = |c: char| c.is_alphanumeric() || c == '_' || (c == '@' && names == Names::Platform);
    let mut length = rest.find(|c| !more(c)).unwrap_or(rest.len());
    if names == Names::Platform && rest[length..].starts_with("^n") {
        length += 2;
    }
    if rest[..length].chars().nth(MAX_NAME).is_some() {
        return wrong(input, "a name of at most 256 characters");
    }
    let name = rest[..length].to_string();
    input.next_slice(length);
    // functions of models only
    let later = [Function::Tanh, Function::Abs, Function::Sign];
    let known = |f: &Function| names == Names::Plain || !later.contains(f);
    if let Some(function) = Function::named(&name).filter(known) {
        if symbol(input, "(").is_none() {
            return wrong(input, "`(`");
        }
        let argument = sum(input)?;
        if symbol(input, ")").is_none() {
            return wrong(input, "an operator or `)`");
        }
        if argument.shape != Shape::SCALAR {
            let expected = format!("a scalar in `{name}`");
            return push_vector(input, start, |_| Err(Mismatch::new(expected, argument.shape)));
        }
        return Ok(push(input, Node::Call { function, argument: argument.entries[0] }, start));
    }
    if name == "atan2" && names == Names::Plain && symbol(input, "(").is_some() {
        let arguments = values(input, ")", "an operator, `,` or `)`")?;
        return angle(input, &arguments, start);
    }
    if peek(input) == Some('(') {
        let Some(operation) = VectorOperation::named(&name).filter(|_| names == Names::Plain) else {
            return Err(ErrMode::Cut(ParseFailure { at: start, expected: functions(names), shape: None }));
        };
        symbol(input, "(");
        let arguments = values(input, ")", "an operator, `,` or `)`")?;
        return push_vector(input, start, |make| operation.apply(&arguments, make));
    }
    let Some(&shape) = input.state.shapes.get(&name) else { return Ok(push(input, Node::Name(name), start)) };
    input.state.vectors = true;
    let entries =
        shape.names(&name).into_iter().flat_map(|n| push(input, Node::Name(n), start).entries).collect();
    Ok(Value { shape, entries, start })
}

/// Angle `atan2(y, x)` of the point (x, y): `2 atan(y / (sqrt(x^2 + y^2) + x))`, valid off the negative
/// x-axis, where it jumps.
fn angle(input: &mut ParserInput<'_>, arguments: &[Value], start: usize) -> Parsed<Value> {
    let [Value { shape: Shape::SCALAR, entries: y, .. }, Value { shape: Shape::SCALAR, entries: x, .. }] =
        arguments
    else {
        let found = arguments.iter().map(|a| a.shape.to_string()).collect::<Vec<_>>().join(", ");
        return push_vector(input, start, |_| Err(Mismatch::new("two scalars in `atan2`", found)));
    };
    let (y, x) = (y[0], x[0]);
    let call = |input: &mut ParserInput<'_>, node: Node| push(input, node, start).entries[0];
    let (xx, yy) = (call(input, Node::Multiply(x, x)), call(input, Node::Multiply(y, y)));
    let square = call(input, Node::Add(xx, yy));
    let radius = call(input, Node::Call { function: Function::Sqrt, argument: square });
    let below = call(input, Node::Add(radius, x));
    let tangent = call(input, Node::Divide(y, below));
    let half = call(input, Node::Call { function: Function::Atan, argument: tangent });
    Ok(push(input, Node::Add(half, half), start))
}

fn binary(input: &mut ParserInput<'_>, sign: char, a: &Value, b: &Value) -> Parsed<Value> {
    let node = match (sign, a.shape, b.shape) {
        (_, Shape::SCALAR, Shape::SCALAR) => {
            let (a, b) = (a.entries[0], b.entries[0]);
            match sign {
                '+' => Node::Add(a, b),
                '-' => Node::Subtract(a, b),
                '*' => Node::Multiply(a, b),
                '/' => Node::Divide(a, b),
                _ => Node::Power(a, b),
            }
        }
        _ => return push_vector(input, a.start, |make| make.binary(sign, a, b)),
    };
    Ok(push(input, node, a.start))
}

fn sum(input: &mut ParserInput<'_>) -> Parsed<Value> {
    expression(operand)
        .prefix(|input: &mut ParserInput<'_>| match symbol(input, "-+") {
            Some('-') => Ok(Prefix(5, |input: &mut ParserInput<'_>, a: Value| match a.shape {
                Shape::SCALAR => Ok(push(input, Node::Negate(a.entries[0]), a.start)),
                shape => push_vector(input, a.start, |make| Ok((shape, make.negative(&a)))),
            })),
            Some(_) => Ok(Prefix(5, |_: &mut ParserInput<'_>, a: Value| Ok(a))),
            None => wrong(input, "a number, a name or `(`"),
        })
        .infix(|input: &mut ParserInput<'_>| match operator(input) {
            Some('+') => Ok(Infix::Left(1, |i: &mut ParserInput<'_>, a, b| binary(i, '+', &a, &b))),
            Some('-') => Ok(Infix::Left(1, |i: &mut ParserInput<'_>, a, b| binary(i, '-', &a, &b))),
            Some('*') => Ok(Infix::Left(3, |i: &mut ParserInput<'_>, a, b| binary(i, '*', &a, &b))),
            Some('/') => Ok(Infix::Left(3, |i: &mut ParserInput<'_>, a, b| binary(i, '/', &a, &b))),
            Some(_) => Ok(Infix::Right(8, |i: &mut ParserInput<'_>, a, b| binary(i, '^', &a, &b))),
            None => other(input),
        })
        .parse_next(input)
}

/// First place that is nested too deeply.
fn too_deep(text: &str) -> Option<usize> {
    let (mut brackets, mut signs, mut powers) = (0usize, 0usize, 0usize);
    let mut before = ' ';
    let mut characters = text.char_indices().filter(|(_, c)| !c.is_whitespace()).peekable();
    while let Some((at, c)) = characters.next() {
        // ** is read as ^
        let double = c == '*' && characters.next_if(|next| *next == (at + 1, '*')).is_some();
        let c = if double { '^' } else { c };
        match c {
            '(' | '[' => brackets += 1,
            ')' | ']' => brackets = brackets.saturating_sub(1),
            _ => {}
        }
        let sign = matches!(c, '+' | '-');
        signs = if sign { signs + 1 } else { 0 };
        // a sign after ^ belongs to the exponent
        if matches!(c, '*' | '/' | '(' | ')' | '[' | ']' | ',')
            || (sign && !matches!(before, '^' | '+' | '-'))
        {
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

/// Parses a whole text of scalars.
///
/// # Errors
/// [`ExpressionError`] with the place in the text.
pub fn parse_with(text: &str, names: Names) -> Result<Expression, ExpressionError> {
    let none = Shapes::new();
    let (read, value) = read(text, names, &none, sum)?;
    match (value.shape, read.vectors) {
        // operands come first: the last operation is the root
        (Shape::SCALAR, false) => Ok(read.expression),
        (Shape::SCALAR, true) => Ok(component(&read.expression, value.entries[0])),
        (shape, _) => Err(ExpressionError::Shape {
            expected: "a scalar".into(),
            found: shape.to_string(),
            span: 0..text.len(),
        }),
    }
}

/// An expression of any shape, component by component.
#[derive(Debug, Clone, PartialEq)]
pub struct Components {
    /// Rows and columns.
    pub shape: Shape,
    /// Expressions of the entries, row by row.
    pub entries: Vec<Expression>,
}

/// Parses a whole text in which some names are vectors or matrices.
///
/// # Errors
/// [`ExpressionError`] with the place in the text.
pub fn parse_components(text: &str, shapes: &Shapes) -> Result<Components, ExpressionError> {
    let (read, value) = read(text, Names::Plain, shapes, sum)?;
    components(read, &value, text)
}

/// Parses `a = b` as `a - b`. `norm(v) = c`, or `|v| = c`, becomes `dot(v, v) - c^2`; every root that stands
/// alone on the left is squared in the same way, so that no root remains. The second expression is such a
/// `c`, which is not negative where the equation holds.
///
/// # Errors
/// [`ExpressionError`] with the place in the text.
pub(crate) fn parse_equation(
    text: &str,
    shapes: &Shapes,
) -> Result<(Components, Option<Expression>), ExpressionError> {
    let mut other_side = None;
    let (read, value) = read(text, Names::Plain, shapes, |input| {
        let start = input.current_token_start();
        let bars = symbol(input, "|").is_some();
        let mut left = sum(input)?;
        if bars {
            if symbol(input, "|").is_none() {
                return wrong(input, "an operator or `|`");
            }
            let of = [left];
            left = push_vector(input, start, |make| VectorOperation::Norm.apply(&of, make))?;
        }
        if symbol(input, "=").is_none() {
            return wrong(input, "an operator or `=`");
        }
        skip_blanks(input);
        let start = input.checkpoint();
        let right = sum(input)?;
        let root = match (left.shape, &input.state.expression.nodes[left.entries[0]]) {
            (Shape::SCALAR, Node::Call { function: Function::Sqrt, argument }) => Some(*argument),
            _ => None,
        };
        let Some(argument) = root.filter(|_| right.shape == Shape::SCALAR) else {
            return binary(input, '-', &left, &right);
        };
        let own = component(&input.state.expression, right.entries[0]);
        let size = evaluate_f64(&own, &|_| f64::NAN);
        if size < 0.0 {
            input.reset(&start);
            return wrong(input, "a root or norm equal to what is not negative");
        }
        other_side = Some(own);
        input.state.vectors = true;
        let square = binary(input, '*', &right, &right)?;
        binary(input, '-', &Value { entries: vec![argument], ..left }, &square)
    })?;
    Ok((components(read, &value, text)?, other_side))
}

fn components(read: ParserState<'_>, value: &Value, text: &str) -> Result<Components, ExpressionError> {
    let mut entries = Vec::with_capacity(value.entries.len());
    let mut operations = 0;
    for &root in value.entries.iter().filter(|_| read.vectors) {
        let entry = component(&read.expression, root);
        operations += entry.nodes.len();
        if operations > MAX_WRITTEN_OUT {
            let expected = format!("at most {MAX_WRITTEN_OUT} names, numbers and operations, entry by entry");
            return Err(ExpressionError::Shape { expected, found: "more".into(), span: 0..text.len() });
        }
        entries.push(entry);
    }
    if !read.vectors {
        entries.push(read.expression);
    }
    Ok(Components { shape: value.shape, entries })
}

/// Reads a whole text by a rule of the grammar.
fn read<'a>(
    text: &'a str,
    names: Names,
    shapes: &'a Shapes,
    rule: impl FnOnce(&mut ParserInput<'a>) -> Parsed<Value>,
) -> Result<(ParserState<'a>, Value), ExpressionError> {
    if let Some(at) = too_deep(text) {
        return Err(ExpressionError::TooDeep { span: at..at + 1 });
    }
    let state = ParserState { expression: Expression::default(), names, shapes, vectors: false };
    let mut input = Stateful { input: LocatingSlice::new(text), state };
    let parsed = rule(&mut input).and_then(|value| {
        skip_blanks(&mut input);
        match peek(&input) {
            None => Ok(value),
            Some(_) => wrong(&input, "an operator or the end of the expression"),
        }
    });
    match parsed {
        Ok(value) => Ok((input.state, value)),
        Err(error) => {
            let fallback = ParseFailure { at: text.len(), expected: "an expression", shape: None };
            let wrong = error.into_inner().unwrap_or(fallback);
            if let Some(shape) = wrong.shape {
                return Err(*shape);
            }
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

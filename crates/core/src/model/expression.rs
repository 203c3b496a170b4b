//! Arithmetic expressions: a Pratt parser with a depth limit, and values in a prime field.
//!
//! `+ - * / ^` with integer exponents, brackets, decimals (exact), names, and `sin cos` of a name.

use std::ops::Range;

use obsdeg_exact::Field;

/// Deepest nesting of brackets and signs.
pub const MAX_DEPTH: usize = 200;

/// An expression and where it stands in its text.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// What it is.
    pub node: Node,
    /// Byte range in the text.
    pub span: Range<usize>,
}

/// The kinds of expressions.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the usual operations")]
pub enum Node {
    /// `mantissa / 10^decimals`.
    Number {
        mantissa: i64,
        decimals: u32,
    },
    Name(String),
    Call {
        function: Function,
        argument: String,
    },
    Negate(Box<Expression>),
    Add(Box<Expression>, Box<Expression>),
    Subtract(Box<Expression>, Box<Expression>),
    Multiply(Box<Expression>, Box<Expression>),
    Divide(Box<Expression>, Box<Expression>),
    Power(Box<Expression>, i32),
}

/// Functions of an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the usual functions")]
pub enum Function {
    Sin,
    Cos,
}

/// Why a text is no expression, or has no value.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExpressionError {
    /// The grammar is violated.
    #[error("expected {expected}, found {found}")]
    Syntax {
        /// What could stand here.
        expected: &'static str,
        /// What stands here.
        found: String,
        /// Where.
        span: Range<usize>,
    },
    /// Brackets nested too deeply.
    #[error("nested more than {MAX_DEPTH} deep")]
    TooDeep {
        /// Where.
        span: Range<usize>,
    },
    /// A name without a meaning.
    #[error("`{name}` is not known here{}", hint.as_ref().map(|h| format!("; did you mean `{h}`?")).unwrap_or_default())]
    UnknownName {
        /// The name.
        name: String,
        /// The nearest known name.
        hint: Option<String>,
        /// Where.
        span: Range<usize>,
    },
    /// A division by zero.
    #[error("division by zero")]
    DivisionByZero {
        /// Where.
        span: Range<usize>,
    },
}

impl ExpressionError {
    /// Where in the text the error is.
    pub fn span(&self) -> Range<usize> {
        match self {
            Self::Syntax { span, .. }
            | Self::TooDeep { span }
            | Self::UnknownName { span, .. }
            | Self::DivisionByZero { span } => span.clone(),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number { mantissa: i64, decimals: u32 },
    Name(String),
    Symbol(char),
    End,
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    token: Token,
    span: Range<usize>,
}

impl<'a> Parser<'a> {
    fn error(&self, expected: &'static str) -> ExpressionError {
        let found = match self.token {
            Token::End => "the end of the expression".into(),
            _ => format!("`{}`", &self.text[self.span.clone()]),
        };
        ExpressionError::Syntax { expected, found, span: self.span.clone() }
    }

    fn advance(&mut self) -> Result<(), ExpressionError> {
        let rest = &self.text[self.at..];
        let start = self.at + (rest.len() - rest.trim_start().len());
        let rest = &self.text[start..];
        let run = |accept: &dyn Fn(char) -> bool| rest.find(|c| !accept(c)).unwrap_or(rest.len());
        let (token, length) = match rest.chars().next() {
            None => (Token::End, 0),
            Some(c) if c.is_ascii_digit() || c == '.' => {
                let length = run(&|c| c.is_ascii_digit() || c == '.');
                let literal = &rest[..length];
                let (whole, decimals) = literal.split_once('.').unwrap_or((literal, ""));
                self.span = start..start + length;
                match format!("{whole}{decimals}").parse() {
                    Ok(mantissa) if decimals.len() <= 15 => {
                        (Token::Number { mantissa, decimals: decimals.len() as u32 }, length)
                    }
                    _ => {
                        return Err(ExpressionError::Syntax {
                            expected: "a number of at most 18 digits",
                            found: format!("`{literal}`"),
                            span: self.span.clone(),
                        });
                    }
                }
            }
            Some(c) if c.is_ascii_alphabetic() || c == '_' => {
                // `@`, `^n` belong to names such as psi_x@1 and psi_x^n
                let mut length = run(&|c| c.is_ascii_alphanumeric() || c == '_' || c == '@');
                if rest[length..].starts_with("^n") {
                    length += 2;
                }
                (Token::Name(rest[..length].into()), length)
            }
            Some(c) => (Token::Symbol(c), c.len_utf8()),
        };
        self.token = token;
        self.span = start..start + length;
        self.at = start + length;
        Ok(())
    }

    fn is(&self, symbol: char) -> bool {
        self.token == Token::Symbol(symbol)
    }

    fn expect(&mut self, symbol: char, expected: &'static str) -> Result<(), ExpressionError> {
        if !self.is(symbol) {
            return Err(self.error(expected));
        }
        self.advance()
    }

    fn operand(&mut self, depth: usize) -> Result<Expression, ExpressionError> {
        let span = self.span.clone();
        if depth > MAX_DEPTH {
            return Err(ExpressionError::TooDeep { span });
        }
        let start = span.start;
        match self.token.clone() {
            Token::Number { mantissa, decimals } => {
                self.advance()?;
                Ok(Expression { node: Node::Number { mantissa, decimals }, span })
            }
            Token::Name(name) => {
                self.advance()?;
                let function = match name.as_str() {
                    "sin" => Function::Sin,
                    "cos" => Function::Cos,
                    _ => return Ok(Expression { node: Node::Name(name), span }),
                };
                self.expect('(', "`(`")?;
                let Token::Name(argument) = self.token.clone() else {
                    return Err(self.error("the name of an angle"));
                };
                self.advance()?;
                let end = self.span.end;
                self.expect(')', "`)`")?;
                Ok(Expression { node: Node::Call { function, argument }, span: start..end })
            }
            Token::Symbol('(') => {
                self.advance()?;
                let inner = self.sum(0, depth + 1)?;
                self.expect(')', "an operator or `)`")?;
                Ok(inner)
            }
            Token::Symbol(sign @ ('-' | '+')) => {
                self.advance()?;
                let inner = self.sum(2, depth + 1)?;
                if sign == '+' {
                    return Ok(inner);
                }
                let span = start..inner.span.end;
                Ok(Expression { node: Node::Negate(Box::new(inner)), span })
            }
            _ => Err(self.error("a number, a name or `(`")),
        }
    }

    /// Everything that binds tighter than `binding`: 0 sums, 1 products, 2 powers.
    fn sum(&mut self, binding: u8, depth: usize) -> Result<Expression, ExpressionError> {
        let mut left = self.operand(depth)?;
        loop {
            let (power, symbol) = match self.token {
                Token::Symbol(c @ ('+' | '-')) => (1, c),
                Token::Symbol(c @ ('*' | '/')) => (2, c),
                Token::Symbol('^') => (3, '^'),
                _ => return Ok(left),
            };
            if power <= binding {
                return Ok(left);
            }
            self.advance()?;
            let start = left.span.start;
            if symbol == '^' {
                let negative = self.is('-');
                if negative {
                    self.advance()?;
                }
                let Token::Number { mantissa, decimals: 0 } = self.token else {
                    return Err(self.error("an integer exponent"));
                };
                let Ok(exponent) = i32::try_from(mantissa) else {
                    return Err(self.error("a small integer exponent"));
                };
                let span = start..self.span.end;
                self.advance()?;
                let exponent = if negative { -exponent } else { exponent };
                left = Expression { node: Node::Power(Box::new(left), exponent), span };
                continue;
            }
            let right = self.sum(power, depth + 1)?;
            let span = start..right.span.end;
            let (a, b) = (Box::new(left), Box::new(right));
            let node = match symbol {
                '+' => Node::Add(a, b),
                '-' => Node::Subtract(a, b),
                '*' => Node::Multiply(a, b),
                _ => Node::Divide(a, b),
            };
            left = Expression { node, span };
        }
    }
}

/// Parses a whole text.
///
/// # Errors
/// [`ExpressionError`] with the place in the text.
pub fn parse(text: &str) -> Result<Expression, ExpressionError> {
    let mut parser = Parser { text, at: 0, token: Token::End, span: 0..0 };
    parser.advance()?;
    let expression = parser.sum(0, 0)?;
    if parser.token != Token::End {
        return Err(parser.error("an operator or the end of the expression"));
    }
    Ok(expression)
}

/// Where the names of an expression get their values.
pub trait Environment {
    /// The value of a name.
    fn name(&self, name: &str) -> Option<u64>;
    /// The cosine and sine of a named angle.
    fn cos_sin(&self, angle: &str) -> Option<(u64, u64)>;
    /// All known names, for hints.
    fn known(&self) -> Vec<String>;
}

/// The value of `expression` in a field.
///
/// # Errors
/// [`ExpressionError::UnknownName`] and [`ExpressionError::DivisionByZero`].
pub fn evaluate(expression: &Expression, f: &Field, env: &dyn Environment) -> Result<u64, ExpressionError> {
    let span = || expression.span.clone();
    let value = |e: &Expression| evaluate(e, f, env);
    let unknown = |name: &str| ExpressionError::UnknownName {
        name: name.into(),
        hint: nearest(name, &env.known()),
        span: span(),
    };
    let inverse = |a: u64| match a {
        0 => Err(ExpressionError::DivisionByZero { span: span() }),
        _ => Ok(f.inv(a)),
    };
    Ok(match &expression.node {
        Node::Number { mantissa, decimals } => {
            f.mul(f.from_i64(*mantissa), f.inv(f.pow(f.from_u64(10), u64::from(*decimals))))
        }
        Node::Name(name) => env.name(name).ok_or_else(|| unknown(name))?,
        Node::Call { function, argument } => {
            let (c, s) = env.cos_sin(argument).ok_or_else(|| unknown(argument))?;
            if *function == Function::Cos { c } else { s }
        }
        Node::Negate(a) => f.neg(value(a)?),
        Node::Add(a, b) => f.add(value(a)?, value(b)?),
        Node::Subtract(a, b) => f.sub(value(a)?, value(b)?),
        Node::Multiply(a, b) => f.mul(value(a)?, value(b)?),
        Node::Divide(a, b) => f.mul(value(a)?, inverse(value(b)?)?),
        Node::Power(a, e) => {
            let power = f.pow(value(a)?, e.unsigned_abs().into());
            if *e < 0 { inverse(power)? } else { power }
        }
    })
}

/// The value of an expression in floating point, with the names' values from `at`; NaN for functions.
pub fn evaluate_f64(e: &Expression, at: &dyn Fn(&str) -> f64) -> f64 {
    let value = |e: &Expression| evaluate_f64(e, at);
    match &e.node {
        Node::Number { mantissa, decimals } => *mantissa as f64 / 10f64.powi(*decimals as i32),
        Node::Name(n) => at(n),
        Node::Call { .. } => f64::NAN,
        Node::Negate(a) => -value(a),
        Node::Add(a, b) => value(a) + value(b),
        Node::Subtract(a, b) => value(a) - value(b),
        Node::Multiply(a, b) => value(a) * value(b),
        Node::Divide(a, b) => value(a) / value(b),
        Node::Power(a, k) => value(a).powi(*k),
    }
}

/// The known name with the least edit distance, if it is close.
fn nearest(name: &str, known: &[String]) -> Option<String> {
    let distance = |a: &str, b: &str| {
        let b: Vec<char> = b.chars().collect();
        let mut row: Vec<usize> = (0..=b.len()).collect();
        for (i, ca) in a.chars().enumerate() {
            let mut diagonal = row[0];
            row[0] = i + 1;
            for (j, cb) in b.iter().enumerate() {
                let substituted = diagonal + usize::from(!ca.eq_ignore_ascii_case(cb));
                diagonal = row[j + 1];
                row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
            }
        }
        row[b.len()]
    };
    known
        .iter()
        .map(|k| (distance(name, k), k))
        .min()
        .filter(|(d, _)| *d <= 2.max(name.chars().count() / 3))
        .map(|(_, k)| k.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rstest::rstest;

    struct Env;
    impl Environment for Env {
        fn name(&self, name: &str) -> Option<u64> {
            let f = Field::new((1 << 60) + 33);
            match name {
                "x" => Some(f.from_i64(3)),
                "D_FX" => Some(f.from_i64(5)),
                "psi_x@1" => Some(f.from_i64(7)),
                "psi_x^n" => Some(f.from_i64(11)),
                _ => None,
            }
        }
        fn cos_sin(&self, angle: &str) -> Option<(u64, u64)> {
            let f = Field::new((1 << 60) + 33);
            (angle == "alpha").then(|| (f.from_i64(20), f.from_i64(21)))
        }
        fn known(&self) -> Vec<String> {
            ["x", "D_FX", "psi_x@1", "psi_x^n", "alpha"].map(String::from).to_vec()
        }
    }

    #[rstest]
    #[case("1+2*3", 7)]
    #[case("(1+2)*3", 9)]
    #[case("2-3-4", -5)]
    #[case("-x^2", -9)]
    #[case("8/4/2", 1)]
    #[case("2*x^3 - D_FX", 49)]
    #[case("0.5*psi_x@1*2", 7)]
    #[case("psi_x^n^2", 121)]
    #[case("x^-1*3", 1)]
    #[case("sin(alpha)-cos(alpha)", 1)]
    #[case("- - +x", 3)]
    fn values(#[case] text: &str, #[case] expected: i64) {
        let f = Field::new((1 << 60) + 33);
        let e = parse(text).expect("it parses");
        assert_eq!(evaluate(&e, &f, &Env), Ok(f.from_i64(expected)));
    }

    #[rstest]
    #[case("", "expected a number, a name or `(`, found the end of the expression", 0..0)]
    #[case("1 +", "expected a number, a name or `(`, found the end of the expression", 3..3)]
    #[case("(x", "expected an operator or `)`, found the end of the expression", 2..2)]
    #[case("x x", "expected an operator or the end of the expression, found `x`", 2..3)]
    #[case("x^y", "expected an integer exponent, found `y`", 2..3)]
    #[case("sin(2)", "expected the name of an angle, found `2`", 4..5)]
    #[case("é", "expected a number, a name or `(`, found `é`", 0..2)]
    #[case("99999999999999999999", "expected a number of at most 18 digits, found `99999999999999999999`", 0..20)]
    fn syntax_errors(#[case] text: &str, #[case] message: &str, #[case] span: Range<usize>) {
        let e = parse(text).expect_err("wrong");
        assert_eq!((e.to_string().as_str(), e.span()), (message, span));
    }

    #[test]
    fn values_that_fail() {
        let f = Field::new((1 << 60) + 33);
        let wrong =
            |text: &str| evaluate(&parse(text).expect("parses"), &f, &Env).expect_err("wrong").to_string();
        assert_eq!(wrong("D_FZ"), "`D_FZ` is not known here; did you mean `D_FX`?");
        assert_eq!(wrong("1/(x-3)"), "division by zero");
        assert_eq!(wrong("nothing_like_it"), "`nothing_like_it` is not known here");
    }

    #[test]
    fn deep_nesting_is_refused() {
        let deep = "(".repeat(1_000_000);
        assert!(matches!(parse(&deep), Err(ExpressionError::TooDeep { .. })));
        assert!(matches!(parse(&"-".repeat(1_000_000)), Err(ExpressionError::TooDeep { .. })));
    }
}

//! Arithmetic expressions, and their values in a prime field and in floating point.
//!
//! `+ - * / ^`, brackets, decimals (exact), names, and functions of one argument. Operations are in a list,
//! operands before the operations that use them, so that no recursion goes as deep as a file is long.

use std::ops::Range;

use obsdeg_exact::Field;

/// Deepest nesting of brackets, signs and powers that is accepted.
pub const MAX_DEPTH: usize = 200;
/// Largest number of characters of a name.
pub(crate) const MAX_NAME: usize = 256;

/// An expression: its operations in order; the last one is its root.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Expression {
    /// Operations; operands are indices of earlier ones.
    pub nodes: Vec<Node>,
    /// Byte range in the text of each operation.
    pub spans: Vec<Range<usize>>,
}

/// The kinds of operations.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the usual operations")]
pub enum Node {
    /// Decimal `mantissa / 10^decimals`.
    Number {
        mantissa: i128,
        decimals: i32,
    },
    Name(String),
    Call {
        function: Function,
        argument: usize,
    },
    Negate(usize),
    Add(usize, usize),
    Subtract(usize, usize),
    Multiply(usize, usize),
    Divide(usize, usize),
    Power(usize, usize),
}

impl Node {
    /// The same operation on other operands.
    pub(super) fn with(&self, place: &mut dyn FnMut(usize) -> usize) -> Self {
        match self {
            Self::Number { .. } | Self::Name(_) => self.clone(),
            Self::Call { function, argument } => {
                Self::Call { function: *function, argument: place(*argument) }
            }
            Self::Negate(a) => Self::Negate(place(*a)),
            Self::Add(a, b) => Self::Add(place(*a), place(*b)),
            Self::Subtract(a, b) => Self::Subtract(place(*a), place(*b)),
            Self::Multiply(a, b) => Self::Multiply(place(*a), place(*b)),
            Self::Divide(a, b) => Self::Divide(place(*a), place(*b)),
            Self::Power(a, b) => Self::Power(place(*a), place(*b)),
        }
    }
}

/// Functions of one argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the usual functions")]
pub enum Function {
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Exp,
    Log,
    Sqrt,
    Tanh,
    Abs,
    Sign,
}

impl Function {
    /// All functions, with their names.
    pub const ALL: [(&'static str, Self); 12] = [
        ("sin", Self::Sin),
        ("cos", Self::Cos),
        ("tan", Self::Tan),
        ("asin", Self::Asin),
        ("acos", Self::Acos),
        ("atan", Self::Atan),
        ("exp", Self::Exp),
        ("log", Self::Log),
        ("sqrt", Self::Sqrt),
        ("tanh", Self::Tanh),
        ("abs", Self::Abs),
        ("sign", Self::Sign),
    ];

    /// Value in floating point; the sign of zero is zero.
    pub fn value(self, x: f64) -> f64 {
        match self {
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tan => x.tan(),
            Self::Asin => x.asin(),
            Self::Acos => x.acos(),
            Self::Atan => x.atan(),
            Self::Exp => x.exp(),
            Self::Log => x.ln(),
            Self::Sqrt => x.sqrt(),
            Self::Tanh => x.tanh(),
            Self::Abs => x.abs(),
            Self::Sign if x == 0.0 => 0.0,
            Self::Sign => x.signum(),
        }
    }

    /// The function with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(n, _)| *n == name).map(|(_, f)| *f)
    }
}

/// Reasons why a text is no expression, or has no value.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExpressionError {
    /// The grammar is violated.
    #[error("expected {expected}, found {found}")]
    Syntax {
        /// Texts that could stand here.
        expected: &'static str,
        /// Text that stands here.
        found: String,
        /// Byte range of the error.
        span: Range<usize>,
    },
    /// Brackets, signs or powers are nested too deeply.
    #[error("nested more than {MAX_DEPTH} deep")]
    TooDeep {
        /// Byte range of the error.
        span: Range<usize>,
    },
    /// Vectors and matrices have shapes that do not fit.
    #[error("expected {expected}, found {found}")]
    Shape {
        /// Shapes that would fit.
        expected: String,
        /// Shapes that stand here.
        found: String,
        /// Byte range of the error.
        span: Range<usize>,
    },
    /// A name has no meaning.
    #[error("`{name}` is not known here; {hint}")]
    UnknownName {
        /// Name found.
        name: String,
        /// Nearest known name, or the known names.
        hint: String,
        /// Byte range of the error.
        span: Range<usize>,
    },
    /// A division by zero.
    #[error("division by zero")]
    DivisionByZero {
        /// Byte range of the error.
        span: Range<usize>,
    },
}

impl ExpressionError {
    /// Byte range of the error in the text.
    pub fn span(&self) -> Range<usize> {
        match self {
            Self::Syntax { span, .. }
            | Self::Shape { span, .. }
            | Self::TooDeep { span }
            | Self::UnknownName { span, .. }
            | Self::DivisionByZero { span } => span.clone(),
        }
    }
}

/// Set of admitted names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Names {
    /// Names of the platform, such as `psi_x@1` and `psi_x^n`.
    Platform,
    /// Names of letters, digits and `_`.
    Plain,
}

/// Values of the names in an expression.
pub trait Environment {
    /// Value of a name; `None` if it is unknown.
    fn name(&self, name: &str) -> Option<u64>;
    /// Cosine and sine of a named angle, or of one such as `20 deg`.
    fn cos_sin(&self, angle: &str) -> Option<(u64, u64)>;
    /// Square root of an integer; `None` if the field has none.
    fn sqrt(&self, _: i32) -> Option<u64> {
        None
    }
    /// All known names, for hints.
    fn known(&self) -> Vec<String>;
}

impl Expression {
    /// Index of the root operation.
    pub fn root(&self) -> usize {
        self.nodes.len().saturating_sub(1)
    }

    /// Byte range of the whole expression.
    pub fn span(&self) -> Range<usize> {
        self.spans.last().cloned().unwrap_or(0..0)
    }

    /// Name that operation `i` is, and true if it has a minus.
    pub(crate) fn angle_at(&self, i: usize) -> Option<(&str, bool)> {
        match &self.nodes[i] {
            Node::Name(name) => Some((name, false)),
            Node::Negate(a) => self.angle_at(*a).map(|(name, minus)| (name, !minus)),
            _ => None,
        }
    }

    /// Integer that operation `i` is; `None` if it is none, or a large one.
    pub(crate) fn integer_at(&self, i: usize) -> Option<i32> {
        match self.nodes[i] {
            Node::Number { mantissa, decimals: 0 } => i32::try_from(mantissa).ok(),
            Node::Negate(a) => self.integer_at(a).map(|x| -x),
            _ => None,
        }
    }
}

/// Value of `expression` in a field. Functions are the sine and cosine of named angles and square roots of
/// integers; exponents are integers.
///
/// # Errors
/// [`ExpressionError::UnknownName`] and [`ExpressionError::DivisionByZero`], [`ExpressionError::Syntax`] for
/// other functions and exponents.
pub fn evaluate(expression: &Expression, f: &Field, env: &dyn Environment) -> Result<u64, ExpressionError> {
    let is_argument = angle_arguments(expression);
    let mut evaluation =
        FieldEvaluation { expression, f, env, values: Vec::with_capacity(expression.nodes.len()) };
    for (i, &is_argument) in is_argument.iter().enumerate() {
        let value = if is_argument { evaluation.argument(i)? } else { evaluation.node(i)? };
        evaluation.values.push(value);
    }
    Ok(evaluation.values.last().copied().unwrap_or(0))
}

/// True, per node, if it is the argument of a function or its negative.
fn angle_arguments(expression: &Expression) -> Vec<bool> {
    let mut arguments = vec![false; expression.nodes.len()];
    for (i, node) in expression.nodes.iter().enumerate().rev() {
        match node {
            Node::Call { argument, .. } => arguments[*argument] = true,
            Node::Negate(a) => arguments[*a] |= arguments[i],
            _ => (),
        }
    }
    arguments
}

/// FieldEvaluation of an expression in a field, with the values of the nodes so far.
struct FieldEvaluation<'a> {
    expression: &'a Expression,
    f: &'a Field,
    env: &'a dyn Environment,
    values: Vec<u64>,
}

impl FieldEvaluation<'_> {
    fn syntax(&self, i: usize, expected: &'static str, found: String) -> ExpressionError {
        ExpressionError::Syntax { expected, found, span: self.expression.spans[i].clone() }
    }

    fn unknown(&self, i: usize, name: &str) -> ExpressionError {
        ExpressionError::UnknownName {
            name: name.into(),
            hint: among(name, &self.env.known()),
            span: self.expression.spans[i].clone(),
        }
    }

    /// Inverse of a value in node i.
    fn inverse(&self, i: usize, a: u64) -> Result<u64, ExpressionError> {
        match a {
            0 => Err(ExpressionError::DivisionByZero { span: self.expression.spans[i].clone() }),
            _ => Ok(self.f.inv(a)),
        }
    }

    /// Value of a node that is an argument: the name of an angle needs none.
    fn argument(&self, i: usize) -> Result<u64, ExpressionError> {
        match self.expression.nodes[i] {
            Node::Name(_) => Ok(0),
            _ => self.node(i),
        }
    }

    fn node(&self, i: usize) -> Result<u64, ExpressionError> {
        let (f, values) = (self.f, &self.values);
        Ok(match &self.expression.nodes[i] {
            Node::Number { mantissa, decimals } => {
                let ten = f.pow(f.from_u64(10), decimals.unsigned_abs().into());
                f.mul(from_i128(f, *mantissa), if *decimals < 0 { ten } else { f.inv(ten) })
            }
            Node::Name(name) if name.ends_with(" deg") => {
                return Err(self.syntax(i, "angles in sin or cos only", format!("`{name}`")));
            }
            Node::Name(name) => self.env.name(name).ok_or_else(|| self.unknown(i, name))?,
            Node::Call { function, argument } => self.call(i, *function, *argument)?,
            Node::Negate(a) => f.neg(values[*a]),
            Node::Add(a, b) => f.add(values[*a], values[*b]),
            Node::Subtract(a, b) => f.sub(values[*a], values[*b]),
            Node::Multiply(a, b) => f.mul(values[*a], values[*b]),
            Node::Divide(a, b) => f.mul(values[*a], self.inverse(i, values[*b])?),
            Node::Power(a, b) => {
                let Some(e) = self.expression.integer_at(*b) else {
                    return Err(self.syntax(*b, "an integer exponent", "something else".into()));
                };
                let power = f.pow(values[*a], e.unsigned_abs().into());
                if e < 0 { self.inverse(i, power)? } else { power }
            }
        })
    }

    /// Value of a function in node i.
    fn call(&self, i: usize, function: Function, argument: usize) -> Result<u64, ExpressionError> {
        match function {
            Function::Cos => Ok(self.cos_sin(i, argument)?.0),
            Function::Sin => Ok(self.cos_sin(i, argument)?.1),
            Function::Sqrt => {
                let n = self.expression.integer_at(argument);
                n.and_then(|n| self.env.sqrt(n)).ok_or_else(|| {
                    let found = n.map_or_else(|| "that of something else".into(), |n| format!("that of {n}"));
                    self.syntax(i, "the root of 2, 3 or 6, or of one of these times a square", found)
                })
            }
            _ => Err(self.syntax(i, "sin or cos of an angle, or a square root", "something else".into())),
        }
    }

    /// Cosine and sine of the angle that the node `argument` names; node i is the function.
    fn cos_sin(&self, i: usize, argument: usize) -> Result<(u64, u64), ExpressionError> {
        let Some((angle, minus)) = self.expression.angle_at(argument) else {
            let expected = "the name of an angle, or one such as `20 deg`";
            return Err(self.syntax(argument, expected, "something else".into()));
        };
        let known = self.env.cos_sin(angle);
        let (c, s) =
            known.ok_or_else(|| match angle.ends_with(" deg") || self.env.name(angle).is_some() {
                true => self.syntax(argument, "an angle that the scheme has", format!("`{angle}`")),
                false => self.unknown(i, angle),
            })?;
        Ok((c, if minus { self.f.neg(s) } else { s }))
    }
}

/// Image of an integer.
pub fn from_i128(f: &Field, x: i128) -> u64 {
    let p = u128::from(f.modulus());
    let image = f.from_u64((x.unsigned_abs() % p) as u64);
    if x < 0 { f.neg(image) } else { image }
}

/// Constants of every model unless it gives the name another meaning: `pi`, and a degree in radians.
pub fn constant(name: &str) -> Option<f64> {
    match name {
        "pi" => Some(std::f64::consts::PI),
        "deg" => Some(std::f64::consts::PI / 180.0),
        _ => None,
    }
}

/// Value of an expression in floating point, with the values of names from `at`: NaN for a name that it does
/// not know.
pub fn evaluate_f64(e: &Expression, at: &dyn Fn(&str) -> f64) -> f64 {
    let mut values: Vec<f64> = Vec::with_capacity(e.nodes.len());
    for node in &e.nodes {
        let value = match node {
            Node::Number { mantissa, decimals } => *mantissa as f64 / 10f64.powi(*decimals),
            Node::Name(n) => match (at(n), constant(n)) {
                (x, Some(own)) if x.is_nan() => own,
                (x, _) => x,
            },
            Node::Call { function, argument } => function.value(values[*argument]),
            Node::Negate(a) => -values[*a],
            Node::Add(a, b) => values[*a] + values[*b],
            Node::Subtract(a, b) => values[*a] - values[*b],
            Node::Multiply(a, b) => values[*a] * values[*b],
            Node::Divide(a, b) => values[*a] / values[*b],
            Node::Power(a, b) => match e.integer_at(*b) {
                Some(k) => values[*a].powi(k),
                None => values[*a].powf(values[*b]),
            },
        };
        values.push(value);
    }
    values.last().copied().unwrap_or(f64::NAN)
}

/// The known name with the least edit distance, if it is close, or a known name that begins with `name`:
/// `latitude`, `latitude_deg`.
pub(crate) fn nearest(name: &str, known: &[String]) -> Option<String> {
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
    // one letter in place of another one-letter name is no misspelling
    let length = name.chars().count();
    let limit = (length * 2 / 5).max(1).min(length.saturating_sub(1));
    known
        .iter()
        .map(|k| (distance(name, k).min(distance(name, k.split_once('_').map_or(k, |(stem, _)| stem))), k))
        .map(|(d, k)| (d > 0 && !goes_on(name, k), d, k))
        .min()
        .filter(|(far, d, _)| !far || *d <= limit)
        .map(|(_, _, k)| k.clone())
}

/// Hint for an unknown `name`: the nearest known name, or the known names (the first ones of very many).
pub(crate) fn among(name: &str, known: &[String]) -> String {
    match nearest(name, known) {
        Some(near) => format!("did you mean `{near}`?"),
        None if known.len() > 40 => format!("expected one of {}, ...", known[..20].join(", ")),
        None => format!("expected one of {}", known.join(", ")),
    }
}

/// True if `longer` begins with `name`, as `latitude_deg` does for `Latitude`.
pub(crate) fn goes_on(name: &str, longer: &str) -> bool {
    let start = longer.get(..name.len()).filter(|_| name.len() > 2);
    start.is_some_and(|s| s.eq_ignore_ascii_case(name)) && longer[name.len()..].starts_with('_')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::parser::parse;

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

    #[test]
    fn values() {
        for (text, expected) in [
            ("1+2*3", 7),
            ("(1+2)*3", 9),
            ("2-3-4", -5),
            ("-x^2", -9),
            ("8/4/2", 1),
            ("2*x^3 - D_FX", 49),
            ("0.5*psi_x@1*2", 7),
            ("psi_x^n^2", 121),
            ("x^-1*3", 1),
            ("sin(alpha)-cos(alpha)", 1),
            ("- - +x", 3),
            ("(2^3)**2 - 64", 0),
            ("-2^2", -4),
            ("x^-(1)*9", 3),
            ("1.5e1 + 50E-1", 20),
            ("x--x-+x", 3),
        ] {
            let f = Field::new((1 << 60) + 33);
            let e = parse(text).expect("it parses");
            assert_eq!(evaluate(&e, &f, &Env), Ok(f.from_i64(expected)), "{text}");
        }
    }

    #[test]
    fn syntax_errors() {
        for (text, message, span) in [
            ("", "expected a number, a name or `(`, found the end of the expression", 0..0),
            ("1 +", "expected a number, a name or `(`, found the end of the expression", 3..3),
            ("(x", "expected an operator or `)`, found the end of the expression", 2..2),
            ("x x", "expected an operator or the end of the expression, found `x`", 2..3),
            ("sin 2", "expected `(`, found `2`", 4..5),
            ("2^^3", "expected a number, a name or `(`, found `^`", 2..3),
            ("1e999", "expected an exponent of at most 400, found `1e999`", 0..5),
            ("§", "expected a number, a name or `(`, found `§`", 0..2),
            ("1.2.3", "expected a number of at most 36 digits, found `1.2.3`", 0..5),
            (
                "2*abs(x)",
                "expected a known function (sin, cos, sqrt) or an operator before `(`, found `abs`",
                2..5,
            ),
            ("(x)(x)", "expected an operator or the end of the expression, found `(`", 3..4),
        ] {
            let e = parse(text).expect_err("wrong");
            assert_eq!((e.to_string().as_str(), e.span()), (message, span), "{text}");
        }
    }

    #[test]
    fn values_that_fail() {
        let f = Field::new((1 << 60) + 33);
        let wrong =
            |text: &str| evaluate(&parse(text).expect("parses"), &f, &Env).expect_err("wrong").to_string();
        assert_eq!(wrong("D_FZ"), "`D_FZ` is not known here; did you mean `D_FX`?");
        assert_eq!(wrong("1/(x-3)"), "division by zero");
        assert_eq!(
            wrong("nothing_like_it"),
            "`nothing_like_it` is not known here; expected one of x, D_FX, psi_x@1, psi_x^n, alpha"
        );
        let angle = "expected the name of an angle, or one such as `20 deg`, found something else";
        assert_eq!(wrong("sin(2)"), angle);
        assert_eq!(wrong("sin(2.5 deg)"), "expected an angle that the scheme has, found `2.5 deg`");
        assert_eq!(wrong("2 deg"), "expected angles in sin or cos only, found `2 deg`");
        assert_eq!(wrong("sin(x)"), "expected an angle that the scheme has, found `x`");
        assert_eq!(
            wrong("tan(alpha)"),
            "expected sin or cos of an angle, or a square root, found something else"
        );
        assert_eq!(
            wrong("sqrt(5)"),
            "expected the root of 2, 3 or 6, or of one of these times a square, found that of 5"
        );
        assert_eq!(wrong("x^x"), "expected an integer exponent, found something else");
    }

    #[test]
    fn names_that_are_near() {
        let known =
            ["name", "attitude", "latitude_deg", "slew_rate_deg_s", "D_FX", "psi_x", "psi"].map(String::from);
        for (name, found) in [
            ("latitude", "latitude_deg"),
            ("Latitude", "latitude_deg"),
            ("lattitude_deg", "latitude_deg"),
            ("slew_rate", "slew_rate_deg_s"),
            ("d_fx", "D_FX"),
            ("Psi", "psi"),
            ("atitude", "attitude"),
        ] {
            assert_eq!(nearest(name, &known).as_deref(), Some(found), "{name}");
        }
        for strange in ["lat", "la", "ä", "latitude_deg_and_more", "carry"] {
            assert_eq!(nearest(strange, &known), None, "{strange}");
        }
    }

    #[test]
    fn deep_nesting_is_refused() {
        for deep in ["(", "-", "x^", "2^-", "sin(", "x*(", "- ", "x**", "2**-"] {
            let e = parse(&deep.repeat(1_000_000)).expect_err("too deep");
            assert!(matches!(e, ExpressionError::TooDeep { .. }), "{deep}: {e}");
        }
        // a long expression is not a deep one
        let f = Field::new((1 << 60) + 33);
        for (long, value) in [("x+", 3 * 300_001), ("x^2-y^2+y^2-x^2+", 3), ("1*", 3), ("1^2*", 3)] {
            let text = format!("{}x", long.repeat(if value > 3 { 300_000 } else { 1000 })).replace('y', "x");
            assert_eq!(evaluate(&parse(&text).expect("long"), &f, &Env), Ok(f.from_i64(value)));
        }
    }
}

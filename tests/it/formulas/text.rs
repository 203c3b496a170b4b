//! Reader of formulas as text, written from the notation alone.
//!
//! It reads `+ - * / ^`, round and square brackets, a blank for a product, `sin cos sqrt`, `20 deg`, and
//! names such as `psi_x@1`, `eps_y^n`, `Z3''@p1`, `Z1'@"about X"[45 deg]`. A sign is allowed only before a
//! term.

use super::value::{Names, Value};

/// Precedence of a blank as product; a formula must have the same value with each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Blank {
    /// Lower precedence than `*` and `/`.
    Weak,
    /// Precedence of `*`.
    Plain,
    /// Higher precedence than `*` and `/`: `a/b c` is `a/(b c)`.
    Strong,
}

pub(crate) const READINGS: [Blank; 3] = [Blank::Weak, Blank::Plain, Blank::Strong];

struct TextReader<'a> {
    rest: &'a str,
    blank: Blank,
    names: &'a Names<'a>,
}

/// Value of a formula.
pub(crate) fn evaluate(text: &str, blank: Blank, names: &Names<'_>) -> Result<Value, String> {
    let mut reader = TextReader { rest: text, blank, names };
    let value = reader.sum().map_err(|e| format!("{e} before `{}` in `{text}`", reader.rest))?;
    if reader.rest.is_empty() { Ok(value) } else { Err(format!("left over `{}` in `{text}`", reader.rest)) }
}

impl TextReader<'_> {
    fn take(&mut self, token: &str) -> bool {
        let found = self.rest.strip_prefix(token);
        if let Some(rest) = found {
            self.rest = rest;
        }
        found.is_some()
    }

    fn sum(&mut self) -> Result<Value, String> {
        let mut negative = self.take("-");
        let mut total = Value::of(0.0);
        loop {
            let term = self.weak()?;
            total = total.add(if negative { term.negated() } else { term });
            negative = if self.take(" - ") || self.take("-") {
                true
            } else if self.take(" + ") || self.take("+") {
                false
            } else {
                return Ok(total);
            };
        }
    }

    /// True if a blank that multiplies follows; consumes it.
    fn multiplies(&mut self) -> bool {
        let next = self.rest.strip_prefix(' ').and_then(|r| r.chars().next());
        let found = next.is_some_and(|c| c.is_alphanumeric() || c == '(' || c == '[');
        let found = found && !self.rest.starts_with(" deg)");
        found && self.take(" ")
    }

    fn weak(&mut self) -> Result<Value, String> {
        let mut product = self.product()?;
        while self.blank == Blank::Weak && self.multiplies() {
            product = product.times(self.product()?);
        }
        Ok(product)
    }

    fn product(&mut self) -> Result<Value, String> {
        let mut product = self.strong()?;
        loop {
            if self.take("*") || (self.blank == Blank::Plain && self.multiplies()) {
                product = product.times(self.strong()?);
            } else if self.take("/") {
                product = product.over(self.strong()?);
            } else {
                return Ok(product);
            }
        }
    }

    fn strong(&mut self) -> Result<Value, String> {
        let mut product = self.power()?;
        while self.blank == Blank::Strong && self.multiplies() {
            product = product.times(self.power()?);
        }
        Ok(product)
    }

    fn power(&mut self) -> Result<Value, String> {
        let base = self.primary()?;
        if !self.take("^") {
            return Ok(base);
        }
        let minus = self.take("-");
        let exponent: i32 = self.word(|c| c.is_ascii_digit()).parse().map_err(|_| "no exponent")?;
        Ok(base.power(if minus { -exponent } else { exponent }))
    }

    fn word(&mut self, which: impl Fn(char) -> bool) -> String {
        let end = self.rest.find(|c| !which(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        word.into()
    }

    fn number(&mut self) -> Result<f64, String> {
        let text = self.word(|c| c.is_ascii_digit() || c == '.');
        text.parse().map_err(|_| format!("`{text}` is no number"))
    }

    fn primary(&mut self) -> Result<Value, String> {
        for (open, close) in [("(", ")"), ("[ ", " ]")] {
            if self.take(open) {
                let inner = self.sum()?;
                return if self.take(close) { Ok(inner) } else { Err(format!("no {close}")) };
            }
        }
        if self.rest.starts_with(|c: char| c.is_ascii_digit()) {
            let number = self.number()?;
            // every reader takes `1/2` as one number
            let rest = self.rest;
            if self.blank == Blank::Strong && self.take("/") {
                match self.number() {
                    Ok(below) => return Ok(Value::of(number / below)),
                    Err(_) => self.rest = rest,
                }
            }
            return Ok(Value::of(number));
        }
        if !self.rest.starts_with(|c: char| c.is_alphabetic()) {
            return Err("no operand".into());
        }
        let mut name = self.word(|c| c.is_alphanumeric() || c == '_');
        if matches!(name.as_str(), "sin" | "cos" | "sqrt") && self.take("(") {
            let argument = self.sum()?;
            let degrees = self.take(" deg");
            if !self.take(")") {
                return Err("no )".into());
            }
            let x = if degrees { argument.value.to_radians() } else { argument.value };
            return Ok(Value::of(match name.as_str() {
                "sin" => x.sin(),
                "cos" => x.cos(),
                _ => x.sqrt(),
            }));
        }
        if (name.starts_with("psi_") || name.starts_with("eps_")) && self.take("^n") {
            name.push_str("^n");
        }
        name.push_str(&self.word(|c| c == '\''));
        if self.take("@") {
            name.push('@');
            name.push_str(&self.station()?);
        }
        (self.names)(&name).map(Value::of).ok_or_else(|| format!("`{name}` is not known"))
    }

    /// Reads a station such as `p1` or `"about X"`, with or without `[45 deg]`; returns `p1`, `about X`,
    /// `p1[45]`.
    fn station(&mut self) -> Result<String, String> {
        let mut name = if self.take("\"") {
            let name = self.word(|c| c != '"');
            if !self.take("\"") {
                return Err("no closing quote".into());
            }
            name
        } else {
            self.word(|c| c.is_alphanumeric() || c == '_')
        };
        if self.take("[") {
            let minus = if self.take("-") { "-" } else { "" };
            name.push_str(&format!("[{minus}{}]", self.word(|c| c.is_ascii_digit() || c == '.')));
            if !self.take(" deg]") {
                return Err("no deg]".into());
            }
        }
        Ok(name)
    }
}

#[test]
fn the_notation() {
    let names = |name: &str| match name {
        "a" => Some(3.0),
        "Z3''@about X[-45]" => Some(5.0),
        "psi_x^n" | "psi_x@1" => Some(7.0),
        _ => None,
    };
    for (text, expected) in [
        ("1/2 [ a (a - 1) + a ]", 4.5),
        ("-(1/a) Z3''@\"about X\"[-45 deg]", -5.0 / 3.0),
        ("a^2-psi_x^n*2 + psi_x@1", 2.0),
        ("sqrt(a)^2*cos(60 deg)", 1.5),
        ("1/(1+a)*2", 0.5),
    ] {
        for blank in READINGS {
            assert!(evaluate(text, blank, &names).expect("read").is(expected, 1e-15), "{text} {blank:?}");
        }
    }
    // texts with several readings, and texts with none
    let at = |text, blank| evaluate(text, blank, &names).expect("read").value;
    assert_ne!(at("1/a a", Blank::Plain), at("1/a a", Blank::Strong));
    for wrong in ["1/a -psi_x@1", "2 3 -", "a b", "", "Z3@p1+180 deg", "(a"] {
        assert!(evaluate(wrong, Blank::Plain, &names).is_err(), "{wrong}");
    }
}

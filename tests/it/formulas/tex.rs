//! Reader of formulas in LaTeX, written from the notation alone. Names are returned as in text.

use super::value::{Names, Value};

struct LatexReader<'a> {
    rest: &'a str,
    names: &'a Names<'a>,
}

/// Value of a formula.
pub(crate) fn evaluate(latex: &str, names: &Names<'_>) -> Result<Value, String> {
    let mut reader = LatexReader { rest: latex, names };
    let value = reader.sum().map_err(|e| format!("{e} before `{}` in `{latex}`", reader.rest))?;
    if reader.rest.is_empty() { Ok(value) } else { Err(format!("left over `{}` in `{latex}`", reader.rest)) }
}

/// Text name of a name in LaTeX.
pub(crate) fn name(latex: &str) -> Result<String, String> {
    let mut reader = LatexReader { rest: latex, names: &|_| None };
    let name = reader.name()?;
    if reader.rest.is_empty() { Ok(name) } else { Err(format!("left over `{}`", reader.rest)) }
}

impl LatexReader<'_> {
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
            let term = self.product()?;
            total = total.add(if negative { term.negated() } else { term });
            negative = if self.take(" - ") {
                true
            } else if self.take(" + ") {
                false
            } else {
                return Ok(total);
            };
        }
    }

    fn product(&mut self) -> Result<Value, String> {
        let mut product = self.power()?;
        while self.take("\\,") || self.take("\\cdot ") {
            product = product.times(self.power()?);
        }
        // quotients are written as fractions
        if self.rest.starts_with('/') { Err("a slash".into()) } else { Ok(product) }
    }

    fn exponent(&mut self) -> Result<Option<i32>, String> {
        if !self.take("^{") {
            return Ok(None);
        }
        let end = self.rest.find('}').ok_or("no }")?;
        let exponent = self.rest[..end].parse().map_err(|_| "no exponent")?;
        self.rest = &self.rest[end + 1..];
        Ok(Some(exponent))
    }

    fn power(&mut self) -> Result<Value, String> {
        let base = self.primary()?;
        Ok(self.exponent()?.map_or(base, |e| base.power(e)))
    }

    fn inside(&mut self, open: &str, close: &str) -> Result<Value, String> {
        if !self.take(open) {
            return Err(format!("no {open}"));
        }
        let inner = self.sum()?;
        if self.take(close) { Ok(inner) } else { Err(format!("no {close}")) }
    }

    fn number(&mut self) -> Option<f64> {
        let end = self.rest.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(self.rest.len());
        let number = self.rest[..end].parse().ok()?;
        self.rest = &self.rest[end..];
        Some(number)
    }

    fn primary(&mut self) -> Result<Value, String> {
        if self.take("\\frac") {
            let above = self.inside("{", "}")?;
            return Ok(above.over(self.inside("{", "}")?));
        }
        if self.take("\\sqrt") {
            return Ok(Value::of(self.inside("{", "}")?.value.sqrt()));
        }
        for (command, f) in [("\\sin", f64::sin as fn(f64) -> f64), ("\\cos", f64::cos)] {
            if self.take(command) {
                let exponent = self.exponent()?.unwrap_or(1);
                let x = Value::of(f(self.inside("(", ")")?.value));
                return Ok(x.power(exponent));
            }
        }
        for (open, close) in [("(", ")"), ("[", "]")] {
            if self.rest.starts_with(open) {
                return self.inside(open, close);
            }
        }
        if let Some(number) = self.number() {
            let degrees = self.take("^{\\circ}");
            return Ok(Value::of(if degrees { number.to_radians() } else { number }));
        }
        let name = self.name()?;
        (self.names)(&name).map(Value::of).ok_or_else(|| format!("`{name}` is not known"))
    }

    fn braces(&mut self) -> Result<String, String> {
        if !self.take("{") {
            return Err("no {".into());
        }
        let end = self.rest.find('}').ok_or("no }")?;
        let inner = self.rest[..end].to_string();
        self.rest = &self.rest[end + 1..];
        Ok(inner)
    }

    /// Reads a station such as `(\text{p1})` or `(\text{about X}, -45^{\circ})`.
    fn station(&mut self) -> Result<String, String> {
        if !self.take("(\\text") {
            return Err("no station".into());
        }
        let mut out = self.braces()?.replace("\\_", "_");
        if self.take(",\\,") {
            let minus = if self.take("-") { "-" } else { "" };
            let end = self.rest.find('^').ok_or("no angle")?;
            out.push_str(&format!("[{minus}{}]", &self.rest[..end]));
            self.rest = &self.rest[end..];
            if !self.take("^{\\circ}") {
                return Err("no degrees".into());
            }
        }
        if self.take(")") { Ok(out) } else { Err("no )".into()) }
    }

    fn name(&mut self) -> Result<String, String> {
        for (letter, primes) in [("Z", ""), ("\\dot{Z}", "'"), ("\\ddot{Z}", "''")] {
            if self.take(&format!("{letter}_")) {
                let component = self.braces()?;
                let at = if self.rest.starts_with("(\\text") {
                    format!("@{}", self.station()?)
                } else {
                    String::new()
                };
                return Ok(format!("Z{component}{primes}{at}"));
            }
        }
        for (rate, name) in [("\\omega_N", "wN"), ("\\omega_U", "wU")] {
            if self.take(rate) {
                return Ok(name.into());
            }
        }
        if self.rest.starts_with("\\omega(\\text") && self.take("\\omega") {
            return Ok(format!("w@{}", self.station()?));
        }
        for (letter, name, primes) in [
            ("\\psi_", "psi_", ""),
            ("\\varepsilon_", "eps_", ""),
            ("\\dot{\\varepsilon}_", "eps_", "'"),
            ("D_", "D_", ""),
        ] {
            if self.take(letter) {
                let mut out = format!("{name}{}", self.braces()?);
                if self.take("^{n}") {
                    out.push_str(&format!("^n{primes}"));
                    if self.rest.starts_with("(\\text") {
                        out.push_str(&format!("@{}", self.station()?));
                    }
                } else if self.take("^{(") {
                    let end = self.rest.find(")}").ok_or("no )}")?;
                    out.push_str(&format!("@{}", &self.rest[..end]));
                    self.rest = &self.rest[end + 2..];
                }
                return Ok(out);
            }
        }
        if self.take("\\mathit") {
            return self.braces();
        }
        let greek = self.take("\\");
        let end = self.rest.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(self.rest.len());
        let end = if greek { end } else { end.min(1) };
        if end == 0 {
            return Err("no operand".into());
        }
        let mut out = self.rest[..end].to_string();
        self.rest = &self.rest[end..];
        if self.take("_{\\mathit") {
            out.push_str(&self.braces()?);
            if !self.take("}") {
                return Err("no }".into());
            }
        }
        Ok(out)
    }
}

#[test]
fn the_notation() {
    let names = |name: &str| match name {
        "alpha" => Some(0.5),
        "wN" => Some(3.0),
        "Z3''@about X[-45]" => Some(5.0),
        "psi_x^n" | "psi_x@1" => Some(7.0),
        _ => None,
    };
    for (latex, expected) in [
        ("\\frac{1}{2}\\,[\\omega_N\\,(\\omega_N - 1) + \\omega_N]", 4.5),
        ("-\\frac{1}{\\omega_N}\\,\\ddot{Z}_{3}(\\text{about X},\\,-45^{\\circ})", -5.0 / 3.0),
        ("\\omega_N^{2} - \\psi_{x}^{n}\\cdot 2 + \\psi_{x}^{(1)}", 2.0),
        ("\\cos^{2}(\\alpha) + \\sin^{2}(\\alpha) + \\cos(60^{\\circ})", 1.5),
    ] {
        assert!(evaluate(latex, &names).expect("read").is(expected, 1e-15), "{latex}");
    }
    for wrong in ["1/2", "2 3", "", "Z_{1}", "\\omega_N\\omega_N"] {
        assert!(evaluate(wrong, &names).is_err(), "{wrong}");
    }
}

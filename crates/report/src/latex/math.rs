//! Formulas as LaTeX: names, expressions in program notation, solutions.

use obsdeg_core::analysis::Solution;
use obsdeg_core::solution::{DerivativeTerm, Frame, Group, StationLabel, group};

use super::escape;

/// Greek letters, whose names are the same in both notations.
pub(crate) const GREEK: [&str; 21] = [
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu",
    "nu", "xi", "pi", "rho", "sigma", "tau", "phi", "chi", "omega",
];

/// Functions by their names in program notation, and their commands.
pub(crate) const FUNCTIONS: [(&str, &str); 9] = [
    ("sin", "sin"),
    ("cos", "cos"),
    ("tan", "tan"),
    ("asin", "arcsin"),
    ("acos", "arccos"),
    ("atan", "arctan"),
    ("exp", "exp"),
    ("log", "log"),
    ("tanh", "tanh"),
];

/// Deepest nesting of brackets that is set as a formula.
const MAX_DEPTH: usize = 60;

/// The math of one name: `D_FX`, `psi_x@1`, `eps_y^n`, `eps_z^n'@p2`, `wN`, `w@p1`.
pub(crate) fn symbol(name: &str) -> String {
    let (base, position) = name.split_once('@').map_or((name, None), |(b, p)| (b, Some(p)));
    if let ("w", Some(position)) = (base, position) {
        return format!("\\omega{}", place(position));
    }
    let (base, dotted) = base.strip_suffix('\'').map_or((base, false), |b| (b, true));
    let (base, frame) = base.strip_suffix("^n").map_or((base, ""), |b| (b, "^{n}"));
    let body = match base.split_once('_') {
        Some(("psi", axis)) => format!("\\psi_{{{axis}}}"),
        Some(("eps", axis)) if dotted => format!("\\dot{{\\varepsilon}}_{{{axis}}}"),
        Some(("eps", axis)) => format!("\\varepsilon_{{{axis}}}"),
        Some(("D", rest)) => format!("D_{{{rest}}}"),
        // terms of the axes X, Y, Z: torquers, and misalignments of gyros and accelerometers
        Some((family @ ("GS" | "GM" | "M"), axes)) if sensors(axes) => {
            format!("\\mathit{{{family}}}_{{{axes}}}")
        }
        Some((family @ ("K0" | "K1" | "K2" | "K3" | "Kx"), axes)) if sensors(axes) => {
            format!("K_{{{},{axes}}}", &family[1..])
        }
        Some(("a", axis)) if !frame.is_empty() => format!("a_{{{axis}}}"),
        _ => match base {
            "wN" => "\\omega_N".into(),
            "wU" => "\\omega_U".into(),
            other => name_of_model(other),
        },
    };
    // `psi_x@1` is an unknown, `eps_x^n@p1` a value at a station
    let position = match position {
        Some(p) if frame.is_empty() => format!("^{{({p})}}"),
        Some(p) => place(p),
        None => String::new(),
    };
    format!("{body}{frame}{position}")
}

/// True if a text names one or two sensors.
fn sensors(axes: &str) -> bool {
    (1..=2).contains(&axes.len()) && axes.bytes().all(|b| b"XYZ".contains(&b))
}

/// A name of a model: `gamma` is Greek, `k21`, `k_on`, `v[1]` and `C[1,2]` have an index.
fn name_of_model(name: &str) -> String {
    if let Some((whole, index)) = name.strip_suffix(']').and_then(|n| n.split_once('[')) {
        let whole = name_of_model(whole);
        return match whole.contains('_') {
            true => format!("{{{whole}}}_{{{index}}}"),
            false => format!("{whole}_{{{index}}}"),
        };
    }
    let letter = |text: &str| match text {
        t if GREEK.contains(&t) => Some(format!("\\{t}")),
        t if t.len() == 1 => Some(t.to_string()),
        _ => None,
    };
    let digits = name.find(|c: char| c.is_ascii_digit() || c == '_').unwrap_or(name.len());
    let (base, index) = name.split_at(digits);
    let index = index.strip_prefix('_').unwrap_or(index);
    match letter(base) {
        Some(base) if index.is_empty() => base,
        Some(base) if index.chars().all(|c| c.is_ascii_alphanumeric()) => {
            format!("{base}_{{\\mathit{{{index}}}}}")
        }
        _ => format!("\\mathit{{{}}}", escape(name)),
    }
}

/// LaTeX of an expression in program notation. `*` becomes a thin space and every quotient a fraction, so
/// that no reader needs rules of precedence. A text that is no expression stays text.
pub(crate) fn expression(text: &str) -> String {
    let mut reader = Reader { rest: text, depth: 0 };
    match reader.sum() {
        Some(math) if reader.rest.trim().is_empty() => math,
        _ => format!("\\text{{{}}}", escape(text)),
    }
}

/// Factor as LaTeX.
struct LatexFactor {
    math: String,
    /// The same without the brackets, if the factor is a sum in brackets.
    sum: Option<String>,
}

impl LatexFactor {
    fn of(math: String) -> Self {
        Self { math, sum: None }
    }
}

/// Factors side by side; with `alone`, a sum that is the only factor has no brackets.
fn side_by_side(factors: &[LatexFactor], alone: bool) -> String {
    match factors {
        [] => "1".into(),
        [LatexFactor { sum: Some(sum), .. }] if alone => sum.clone(),
        _ => {
            let mut out = String::new();
            for f in factors {
                let digit = f.math.starts_with(|c: char| c.is_ascii_digit());
                out.push_str(match (out.is_empty(), digit) {
                    (true, _) => "",
                    (false, true) => "\\cdot ",
                    (false, false) => "\\,",
                });
                out.push_str(&f.math);
            }
            out
        }
    }
}

/// Recursive descent over an expression; methods return `None` for text that is none.
struct Reader<'a> {
    rest: &'a str,
    depth: usize,
}

impl Reader<'_> {
    /// The next character that is no blank, without consuming it.
    fn peek(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    fn take(&mut self, c: char) -> bool {
        let found = self.peek() == Some(c);
        if found {
            self.rest = &self.rest[c.len_utf8()..];
        }
        found
    }

    /// Consumes the characters that satisfy `which`.
    fn word(&mut self, which: impl Fn(char) -> bool) -> String {
        let end = self.rest.find(|c| !which(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        word.into()
    }

    fn sum(&mut self) -> Option<String> {
        let mut out = String::new();
        let mut negative = self.take('-');
        loop {
            let (minus, product) = self.product()?;
            sum(&mut out, minus != negative, &product);
            negative = match self.peek() {
                Some('-') => true,
                Some('+') => false,
                _ => return Some(out),
            };
            self.rest = &self.rest[1..];
        }
    }

    /// Product, and true if it is negative.
    fn product(&mut self) -> Option<(bool, String)> {
        let (mut negative, mut above, mut below) = (false, Vec::new(), Vec::new());
        let mut divides = false;
        loop {
            while let Some(sign) = self.peek().filter(|c| matches!(c, '+' | '-')) {
                negative ^= sign == '-';
                self.rest = &self.rest[1..];
            }
            let factor = self.power()?;
            if divides {
                below.push(factor)
            } else {
                above.push(factor)
            }
            divides = match self.peek() {
                // `**` is `^`, which `power` has consumed
                Some('*') => false,
                Some('/') => true,
                _ => break,
            };
            self.rest = &self.rest[1..];
        }
        // the 1 of `1/x*y` is left out
        if above.len() > 1 {
            above.retain(|f| f.math != "1");
        }
        let math = match &below[..] {
            [] => side_by_side(&above, false),
            _ => format!("\\frac{{{}}}{{{}}}", side_by_side(&above, true), side_by_side(&below, true)),
        };
        Some((negative, math))
    }

    fn power(&mut self) -> Option<LatexFactor> {
        let (base, function) = self.primary()?;
        if self.peek() == Some('^') {
            self.rest = &self.rest[1..];
        } else if let Some(rest) = self.rest.strip_prefix("**") {
            self.rest = rest;
        } else {
            return Some(base);
        }
        let minus = self.take('-');
        let exponent = self.power()?;
        let exponent = exponent.sum.unwrap_or(exponent.math);
        let exponent = if minus { format!("-{exponent}") } else { exponent };
        let positive = exponent.chars().all(|c| c.is_ascii_digit());
        Some(LatexFactor::of(match function {
            // `f^{-1}` would mean the inverse function
            Some((name, argument)) if positive => format!("\\{name}^{{{exponent}}}({argument})"),
            Some(_) => format!("({})^{{{exponent}}}", base.math),
            None if base.sum.is_none() && base.math.contains(['^', '\\']) && !plain(&base.math) => {
                format!("({})^{{{exponent}}}", base.math)
            }
            None => format!("{}^{{{exponent}}}", base.math),
        }))
    }

    /// Number, name, function or bracket; for a function also its command and argument.
    fn primary(&mut self) -> Option<(LatexFactor, Option<(&'static str, String)>)> {
        let c = self.peek()?;
        if c.is_ascii_digit() || c == '.' {
            let number = self.word(|c| c.is_ascii_digit() || c == '.');
            let degrees = self.rest.strip_prefix(" deg");
            let degrees = degrees.filter(|r| !r.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_'));
            if let Some(rest) = degrees {
                self.rest = rest;
                return Some((LatexFactor::of(format!("{number}^{{\\circ}}")), None));
            }
            return Some((LatexFactor::of(number), None));
        }
        if c == '(' {
            let inner = self.bracket()?;
            return Some((LatexFactor { math: format!("({inner})"), sum: Some(inner) }, None));
        }
        if !(c.is_alphabetic() || c == '_') {
            return None;
        }
        let mut name = self.word(|c| c.is_alphanumeric() || c == '_');
        if let Some(rest) = self.rest.strip_prefix("^n")
            && ["psi_", "eps_"].iter().any(|p| name.starts_with(p))
            && !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_')
        {
            name.push_str("^n");
            self.rest = rest;
            name.push_str(&self.word(|c| c == '\''));
        }
        let primes = self.word(|c| c == '\'').len();
        // an entry of a vector
        let index = |c: char| c.is_ascii_digit() || c == ',';
        if let Some((inside, rest)) = self.rest.strip_prefix('[').and_then(|r| r.split_once(']'))
            && inside.chars().all(index)
        {
            self.rest = rest;
            name.push_str(&format!("[{inside}]"));
        }
        if let Some(rest) = self.rest.strip_prefix('@') {
            self.rest = rest;
            name.push_str(&self.station()?);
        }
        let math = dotted(&symbol(&name), primes);
        if !self.rest.starts_with('(') {
            return Some((LatexFactor::of(math), None));
        }
        let argument = self.bracket()?;
        if name == "sqrt" {
            return Some((LatexFactor::of(format!("\\sqrt{{{argument}}}")), None));
        }
        let Some((_, command)) = FUNCTIONS.iter().find(|(known, _)| *known == name) else {
            // the value at a time, such as that at the start
            let time = argument.chars().all(|c| c.is_ascii_digit());
            return time.then(|| (LatexFactor::of(format!("{math}({argument})")), None));
        };
        Some((LatexFactor::of(format!("\\{command}({argument})")), Some((command, argument))))
    }

    /// `@p1`, `@"about X"[45 deg]`.
    fn station(&mut self) -> Option<String> {
        let quoted = self.rest.starts_with('"');
        let end = if quoted {
            1 + self.rest[1..].find('"')? + 1
        } else {
            self.rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(self.rest.len())
        };
        let angle = self.rest[end..].strip_prefix('[').and_then(|r| r.find(']'));
        let end = angle.map_or(end, |a| end + a + 2);
        let (station, rest) = self.rest.split_at(end);
        self.rest = rest;
        Some(format!("@{station}"))
    }

    /// Content of brackets.
    fn bracket(&mut self) -> Option<String> {
        self.depth += 1;
        let inside = self.depth <= MAX_DEPTH && self.take('(');
        let sum = if inside { self.sum() } else { None }?;
        self.depth -= 1;
        self.take(')').then_some(sum)
    }
}

/// Time derivative: up to two dots above the letter, then the order in brackets.
fn dotted(math: &str, order: usize) -> String {
    let end = math.find(['_', '^']).filter(|_| !math.starts_with("\\mathit")).unwrap_or(math.len());
    let (letter, index) = math.split_at(end);
    match order {
        0 => math.into(),
        1 => format!("\\dot{{{letter}}}{index}"),
        2 => format!("\\ddot{{{letter}}}{index}"),
        // a name with an exponent takes no second one
        _ if index.contains('^') => format!("{{{math}}}^{{({order})}}"),
        _ => format!("{math}^{{({order})}}"),
    }
}

/// True if an exponent can follow: a letter, with an index at most.
fn plain(math: &str) -> bool {
    !math.contains('^') && !["\\frac", "\\sqrt", "("].iter().any(|c| math.contains(c))
}

/// Output derivative at a station: `Z_3''@p1`.
fn z(term: &DerivativeTerm, frame: Frame, stations: &[StationLabel]) -> String {
    let letter = match term.order {
        0 => "Z".to_string(),
        1 => "\\dot{Z}".into(),
        2 => "\\ddot{Z}".into(),
        k => format!("Z^{{({k})}}"),
    };
    let index = match (frame, term.azimuth) {
        (_, true) => "a".to_string(),
        (Frame::N, _) => term.component.to_string(),
        (Frame::Platform, _) => ["x", "y", "z"][term.component - 1].into(),
    };
    format!("{letter}_{{{index}}}{}", place(&stations[term.station].label))
}

/// A station in brackets: `(\text{p1})`, `(\text{about X},\,45^{\circ})`.
fn place(label: &str) -> String {
    let (name, angle) = match label.strip_suffix(" deg]").and_then(|l| l.rsplit_once('[')) {
        Some((name, angle)) => (name, format!(",\\,{angle}^{{\\circ}}")),
        None => (label, String::new()),
    };
    let quoted = name.strip_prefix('"').and_then(|n| n.strip_suffix('"'));
    format!("(\\text{{{}}}{angle})", escape(quoted.unwrap_or(name)))
}

/// The left side of a formula: `Z1''`, or `psi_x^n` at a position.
pub(crate) fn left(name: &str, position: Option<&str>) -> String {
    let plain = name.trim_end_matches('\'');
    let letter = match (plain.strip_prefix('Z'), name.len() - plain.len()) {
        (Some(index), 0) => format!("Z_{{{index}}}"),
        (Some(index), 1) => format!("\\dot{{Z}}_{{{index}}}"),
        (Some(index), 2) => format!("\\ddot{{Z}}_{{{index}}}"),
        (None, 0) => symbol(plain),
        _ => symbol(name),
    };
    format!("{letter}{}", position.map(place).unwrap_or_default())
}

/// Product of factors; empty for none.
fn product(factors: &[String]) -> String {
    if factors.is_empty() { String::new() } else { expression(&factors.join("*")) }
}

fn sum(out: &mut String, negative: bool, text: &str) {
    out.push_str(match (out.is_empty(), negative) {
        (true, true) => "-",
        (true, false) => "",
        (false, true) => " - ",
        (false, false) => " + ",
    });
    out.push_str(text);
}

/// A solution: common factors in front, terms of equal coefficient in brackets.
pub(crate) fn solution(s: &Solution, frame: Frame, stations: &[StationLabel]) -> String {
    let grouped = group(&s.solved, stations);
    let mut inner = String::new();
    let bracket = |g: &Group| {
        let mut terms = String::new();
        for (negative, t) in &g.terms {
            sum(&mut terms, *negative, &z(t, frame, stations));
        }
        if g.terms.len() > 1 { format!("({terms})") } else { terms }
    };
    for g in &grouped.groups {
        let c = product(&g.factors(stations));
        if c.is_empty() {
            for (negative, t) in &g.terms {
                sum(&mut inner, *negative != g.negative, &z(t, frame, stations));
            }
        } else {
            sum(&mut inner, g.negative, &format!("{c}\\,{}", bracket(g)));
        }
    }
    match &grouped.factor {
        None if inner.is_empty() => "0".into(),
        None => inner,
        Some(f) => format!("{}\\,[{inner}]", product(&f.sign_and_factors().1)),
    }
}

/// LaTeX of a solution from the terms of an answer: coefficient in program notation, observation (`Z3'`),
/// station. Terms of one coefficient, up to the sign, share a bracket.
pub(crate) fn solution_of(terms: &[[&str; 3]]) -> String {
    let mut groups: Vec<(&str, Vec<(bool, String)>)> = Vec::new();
    for &[coefficient, observation, station] in terms {
        let (negative, size) =
            coefficient.strip_prefix('-').map_or((false, coefficient), |size| (true, size));
        let z = (negative, left(observation, Some(station)));
        match groups.iter_mut().find(|(c, _)| *c == size) {
            Some((_, of)) => of.push(z),
            None => groups.push((size, vec![z])),
        }
    }
    let mut out = String::new();
    for (size, of) in &groups {
        // the sign of the first stands before the bracket
        let first = of[0].0;
        let mut inner = String::new();
        for (negative, z) in of {
            sum(&mut inner, *negative != first, z);
        }
        match (*size, of.len()) {
            ("1", _) => of.iter().for_each(|(negative, z)| sum(&mut out, *negative, z)),
            (_, 1) => sum(&mut out, first, &format!("{}\\,{inner}", factor(size))),
            _ => sum(&mut out, first, &format!("{}\\,({inner})", factor(size))),
        }
    }
    if out.is_empty() { "0".into() } else { out }
}

/// Expression as a factor: sums are put in brackets.
fn factor(text: &str) -> String {
    let math = expression(text);
    if [" + ", " - "].iter().any(|sign| text.contains(sign)) { format!("({math})") } else { math }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_of_one_coefficient_share_a_bracket() {
        let terms = [["-wU/2", "Z1", "p1"], ["wU/2", "Z1", "p2"], ["-1", "Z3''", "p1"], ["1", "Z3'", "p2"]];
        let math = "-\\frac{\\omega_U}{2}\\,(Z_{1}(\\text{p1}) - Z_{1}(\\text{p2})) - \
                    \\ddot{Z}_{3}(\\text{p1}) + \\dot{Z}_{3}(\\text{p2})";
        assert_eq!(solution_of(&terms), math);
        assert_eq!(solution_of(&[["a - b", "Z1", "p1"]]), "(a - b)\\,Z_{1}(\\text{p1})");
        assert_eq!(solution_of(&[]), "0");
    }

    #[test]
    fn names_and_expressions() {
        assert_eq!(symbol("D_FX"), "D_{FX}");
        assert_eq!(symbol("psi_x@12"), "\\psi_{x}^{(12)}");
        assert_eq!(symbol("eps_y^n"), "\\varepsilon_{y}^{n}");
        for (text, math) in [
            ("D_FZ - wN*psi_y", "D_{FZ} - \\omega_N\\,\\psi_{y}"),
            ("sqrt(2)*cos(alpha)^2/4", "\\frac{\\sqrt{2}\\,\\cos^{2}(\\alpha)}{4}"),
            ("k21*gamma - V_max", "k_{\\mathit{21}}\\,\\gamma - V_{\\mathit{max}}"),
            ("sin(25 deg)", "\\sin(25^{\\circ})"),
            // every quotient is a fraction, and later factors are not under its line
            ("1/cos(25 deg)*wU/wN^2", "\\frac{\\omega_U}{\\cos(25^{\\circ})\\,\\omega_N^{2}}"),
            ("1/2/(a+b)*(c-d)", "\\frac{c - d}{2\\,(a + b)}"),
            ("1/(a+b)", "\\frac{1}{a + b}"),
            ("(a+b)*c", "(a + b)\\,c"),
            ("-(1/2+a)*wN", "-(\\frac{1}{2} + a)\\,\\omega_N"),
            ("a - -b + c*-2", "a + b - c\\cdot 2"),
            ("psi_x^n^2 + (a/b)^2", "(\\psi_{x}^{n})^{2} + (\\frac{a}{b})^{2}"),
            ("sqrt(a)^3*sin(a)^-1", "(\\sqrt{a})^{3}\\,(\\sin(a))^{-1}"),
            ("exp(-k*t)*x^n", "\\exp(-k\\,t)\\,x^{n}"),
            // derivatives of outputs, and values at the start
            ("-(y^2*y'*y'''-2*y''^2)", "-(y^{2}\\,\\dot{y}\\,y^{(3)} - 2\\,\\ddot{y}^{2})"),
            ("z1'''^2/in_bed'", "\\frac{(z_{\\mathit{1}}^{(3)})^{2}}{\\dot{\\mathit{in\\_bed}}}"),
            ("y2'*gut(0)", "\\dot{y}_{\\mathit{2}}\\,\\mathit{gut}(0)"),
            ("f(x)", "\\text{f(x)}"),
            ("a combination of D_FX, D_FY", "\\text{a combination of D\\_FX, D\\_FY}"),
            ("?", "\\text{?}"),
            ("1/2*w@p1^2", "\\frac{(\\omega(\\text{p1}))^{2}}{2}"),
            (
                "eps_x^n@\"a-b\"[-4.5 deg] + eps_z^n'",
                "\\varepsilon_{x}^{n}(\\text{a-b},\\,-4.5^{\\circ}) + \\dot{\\varepsilon}_{z}^{n}",
            ),
        ] {
            assert_eq!(expression(text), math, "{text}");
        }
        assert!(expression(&"(".repeat(100_000)).starts_with("\\text{"));
    }
}

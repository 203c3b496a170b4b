//! Nodes of the graph as text for readers.

use super::dag::{Dag, Op};
use crate::language::Function;

/// Largest number of operations that are written: shared ones count each time.
const MAX_OPERATIONS: usize = 60;

/// Binding strength of the outermost operation of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Power,
}

/// Text of a node in the names of the slots, with `+ - * / ^` and functions; `None` beyond 60 operations.
pub(super) fn text(dag: &Dag, node: usize, names: &[String]) -> Option<String> {
    let mut left = MAX_OPERATIONS;
    Writer { dag, names, left: &mut left }.write(node).map(|(text, _)| text)
}

struct Writer<'a> {
    dag: &'a Dag,
    names: &'a [String],
    left: &'a mut usize,
}

impl Writer<'_> {
    fn write(&mut self, node: usize) -> Option<(String, Binding)> {
        *self.left = self.left.checked_sub(1)?;
        Some(match self.dag.ops[node] {
            Op::Number { mantissa, decimals } => {
                let text = number(mantissa, decimals);
                let binding = if text.starts_with('-') { Binding::Sum } else { Binding::Power };
                (text, binding)
            }
            Op::Slot(s) => (self.names.get(s)?.clone(), Binding::Power),
            Op::Pi => ("pi".into(), Binding::Power),
            // x + -2 y
            Op::Add(a, b) => {
                let (a, b) = (self.write(a)?.0, self.write(b)?.0);
                let text = match (a.strip_prefix('-'), b.strip_prefix('-')) {
                    (_, Some(size)) => format!("{a} - {size}"),
                    (Some(size), None) => format!("{b} - {size}"),
                    (None, None) => format!("{a} + {b}"),
                };
                (text, Binding::Sum)
            }
            Op::Subtract(a, b) => {
                let a = self.write(a)?.0;
                (format!("{a} - {}", self.operand(b, Binding::Product)?), Binding::Sum)
            }
            Op::Multiply(..) => self.product(node)?,
            Op::Divide(a, b) => {
                let a = self.operand(a, Binding::Product)?;
                (format!("{a}/{}", self.operand(b, Binding::Power)?), Binding::Product)
            }
            Op::Primitive { function, of, .. } => {
                let name = Function::ALL.iter().find(|(_, f)| *f == function)?.0;
                (format!("{name}({})", self.write(of)?.0), Binding::Power)
            }
        })
    }

    /// Product of factors, equal ones as powers; a factor of -1 as a sign.
    fn product(&mut self, node: usize) -> Option<(String, Binding)> {
        let (mut factors, mut open): (Vec<(usize, usize)>, _) = (Vec::new(), vec![node]);
        while let Some(i) = open.pop() {
            *self.left = self.left.checked_sub(1)?;
            match self.dag.ops[i] {
                Op::Multiply(a, b) => open.extend([b, a]),
                _ => match factors.iter_mut().find(|f| f.0 == i) {
                    Some((_, power)) => *power += 1,
                    None => factors.push((i, 1)),
                },
            }
        }
        // numbers first
        factors.sort_by_key(|f| !matches!(self.dag.ops[f.0], Op::Number { .. }));
        let signs = factors.iter().find(|f| self.dag.is(f.0, -1)).map_or(0, |f| f.1);
        let minus = !signs.is_multiple_of(2);
        factors.retain(|f| !self.dag.is(f.0, -1));
        let shown = &factors[..];
        let mut parts = Vec::new();
        for (k, &(factor, power)) in shown.iter().enumerate() {
            let plain = power == 1 && k == 0 && !minus && matches!(self.dag.ops[factor], Op::Number { .. });
            parts.push(match power {
                1 if plain => self.write(factor)?.0,
                1 => self.operand(factor, Binding::Product)?,
                _ => format!("{}^{power}", self.operand(factor, Binding::Power)?),
            });
        }
        if parts.is_empty() {
            parts.push("1".into());
        }
        let text = format!("{}{}", if minus { "-" } else { "" }, parts.join("*"));
        let binding = match (text.starts_with('-'), shown) {
            (true, _) => Binding::Sum,
            (false, [_]) => Binding::Power,
            _ => Binding::Product,
        };
        Some((text, binding))
    }

    /// Text of an operand, in brackets if it binds less than `least`.
    fn operand(&mut self, node: usize, least: Binding) -> Option<String> {
        let (text, binding) = self.write(node)?;
        Some(if binding < least { format!("({text})") } else { text })
    }
}

/// Decimal `mantissa / 10^decimals` in digits.
fn number(mantissa: i128, decimals: i32) -> String {
    let (sign, digits) = (if mantissa < 0 { "-" } else { "" }, mantissa.unsigned_abs().to_string());
    let places = decimals.unsigned_abs() as usize;
    if places > 40 {
        return format!("{sign}{digits}e{}", -i64::from(decimals));
    }
    if decimals <= 0 {
        let zeros = if mantissa == 0 { 0 } else { places };
        return format!("{sign}{digits}{}", "0".repeat(zeros));
    }
    let padded = format!("{digits:0>width$}", width = places + 1);
    let (whole, part) = padded.split_at(padded.len() - places);
    let part = part.trim_end_matches('0');
    let point = if part.is_empty() { "" } else { "." };
    format!("{sign}{whole}{point}{part}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::{Names, evaluate_f64, parse_with};

    /// Texts of nodes, read again, give the values of the nodes.
    #[test]
    fn written_and_read_again() {
        let names = ["x", "y", "t"].map(String::from);
        let at = |name: &str| [1.7, -0.6, 2.3][names.iter().position(|n| n == name).expect("a name")];
        for (text_in, expected) in [
            ("t - 7", "t - 7"),
            ("x - (y - t)", "x - (y - t)"),
            ("x*x*y^3", "x^2*y^3"),
            ("-(x + y)", "-(x + y)"),
            ("(x + y)*(x - y)/t", "(x + y)*(x - y)/t"),
            ("x/(y*t)", "x/(y*t)"),
            ("x - -2*y", "x - (-2*y)"),
            ("2.50*x + 0.03", "2.5*x + 0.03"),
            ("sin(x - y)^2", "sin(x - y)^2"),
            ("(x/y)^2 - (-x)^2", "(x/y)^2 - x^2"),
            ("-(-(x + y))*2", "2*(x + y)"),
            ("x + (-1)*(-1)", "x + 1"),
            ("x - 3*(-y)", "x - (-3*y)"),
            ("2*x - y*-3", "2*x - (-3*y)"),
        ] {
            let mut dag = Dag::default();
            for s in 0..names.len() {
                dag.slot(s);
            }
            let e = parse_with(text_in, Names::Plain).expect("an expression");
            let slot = |name: &str| names.iter().position(|n| n == name);
            let node = dag.translate(&e, &slot).expect("a node");
            let said = text(&dag, node, &names).expect("short");
            let again = parse_with(&said, Names::Plain).unwrap_or_else(|e| panic!("{said}: {e}"));
            let (a, b) = (evaluate_f64(&e, &at), evaluate_f64(&again, &at));
            assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{text_in}: {said}: {a} {b}");
            assert_eq!(said, expected);
        }
        let mut dag = Dag::default();
        let mut node = dag.slot(0);
        for _ in 0..100 {
            node = dag.function(Function::Sin, node);
        }
        assert_eq!(text(&dag, node, &names), None);
    }
}

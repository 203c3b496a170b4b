//! Constraints that are products: one of their factors is zero, and verdicts are those where the same one always is.

use crate::language::{Expression, Node, component, evaluate_f64};

use super::constraints::ConstraintFactor;
use super::model::{PlacedExpression, SystemModel};
use super::real_points::real_point;
use super::rows::Layout;
use super::work::Spent;

/// Choices of one factor in each product that are tried at most.
const CHOICES: usize = 64;
/// Operations of the search for a point of each.
const OPERATIONS: u64 = 20_000_000;
/// Size, relative to the largest of a product, up to which a factor is zero at the given values.
const ZERO: f64 = 1e-9;

/// A factor of a constraint.
struct Factor {
    text: String,
    expression: Expression,
}

impl SystemModel {
    /// The same with the first factor that has a real point, together with all other constraints, in the place of
    /// each constraint that is a product; factors that are zero at the values of the file before all others. Unchanged
    /// where there is no product, or no such point was found.
    pub(super) fn by_one_factor(self) -> Self {
        let mut products: Vec<(usize, Vec<Factor>, Option<usize>)> = Vec::new();
        for (c, own) in self.constraints.iter().enumerate() {
            let factors = factors(own);
            if factors.len() > 1 {
                let given = self.zero_at_given(&factors);
                products.push((c, factors, given));
            }
        }
        let total = products.iter().map(|p| p.1.len()).fold(1, usize::saturating_mul);
        if products.is_empty() {
            return self;
        }
        for choice in 0..total.min(CHOICES) {
            let (mut out, mut left) = (self.clone(), choice);
            for (c, factors, given) in &products {
                // the given one, then the others as written
                let rank = left % factors.len();
                left /= factors.len();
                let order = (given.iter().copied()).chain((0..factors.len()).filter(|k| Some(*k) != *given));
                let Some(taken) = order.into_iter().nth(rank) else { continue };
                out.constraints[*c].expression = factors[taken].expression.clone();
                let others = (0..factors.len()).filter(|k| *k != taken).map(|k| factors[k].text.clone());
                out.factors.push(ConstraintFactor {
                    constraint: self.constraints[*c].text.clone(),
                    factor: factors[taken].text.clone(),
                    others: others.collect(),
                    given: *given == Some(taken),
                });
            }
            if out.has_point() {
                return out;
            }
        }
        self
    }

    fn has_point(&self) -> bool {
        let mut model = self.clone();
        model.work_limit = model.work_limit.within(OPERATIONS);
        let Ok(compiled) = model.compile() else { return false };
        let layout = Layout::new(&model, &compiled, None);
        real_point(&model, &compiled, &layout, 1, &mut Spent::default()).is_ok()
    }

    /// The only factor that is zero at the values under `[simulation.values]` of the first experiment, where these
    /// are complete.
    fn zero_at_given(&self, factors: &[Factor]) -> Option<usize> {
        let value = |name: &str| self.simulation.value(name, 0).unwrap_or(f64::NAN);
        let sizes: Vec<f64> = factors.iter().map(|f| evaluate_f64(&f.expression, &value).abs()).collect();
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        let mut zero = (0..factors.len()).filter(|&k| sizes[k] <= ZERO * largest);
        let first = zero.next()?;
        (zero.next().is_none() && sizes.iter().all(|s| s.is_finite())).then_some(first)
    }
}

/// The different factors of a constraint, those without a name in them left out; none where it is no product.
fn factors(own: &PlacedExpression) -> Vec<Factor> {
    let e = &own.expression;
    let (mut found, mut open) = (Vec::new(), Vec::new());
    let Some(last) = e.nodes.len().checked_sub(1) else { return Vec::new() };
    let zero = |i: usize| matches!(e.nodes[i], Node::Number { mantissa: 0, .. });
    match e.nodes[last] {
        Node::Subtract(a, b) if zero(b) => open.push(a),
        Node::Subtract(a, b) if zero(a) => open.push(b),
        _ => {}
    }
    while let Some(i) = open.pop() {
        match e.nodes[i] {
            Node::Multiply(a, b) => open.extend([b, a]),
            Node::Divide(a, _) | Node::Negate(a) => open.push(a),
            Node::Power(a, b) if matches!(e.nodes[b], Node::Number { mantissa: 1.., decimals: ..=0 }) => {
                open.push(a)
            }
            _ => found.push(component(e, i)),
        }
    }
    let named = |e: &Expression| e.nodes.iter().any(|n| matches!(n, Node::Name(_)));
    let mut out: Vec<Factor> = Vec::new();
    for expression in found.into_iter().filter(named) {
        if let Some(text) = text(own, &expression)
            && out.iter().all(|f| f.expression.nodes != expression.nodes)
        {
            out.push(Factor { text, expression });
        }
    }
    out
}

/// A factor as written.
fn text(own: &PlacedExpression, factor: &Expression) -> Option<String> {
    let span = factor.spans.iter().cloned().reduce(|a, b| a.start.min(b.start)..a.end.max(b.end))?;
    Some(own.text.get(span)?.trim().to_string())
}

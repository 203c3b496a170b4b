//! Constraints that are products: one of their factors is zero. Verdicts are those where the same factor is
//! always zero.

use std::collections::HashMap;

use obsdeg_exact::{Ball, Reals};

use super::constraints::ConstraintFactor;
use super::judge::point_degrees::climb_at;
use super::model::{PlacedExpression, SystemModel};
use super::real_points::real_point;
use super::rows::layout::Layout;
use super::work::Spent;
use crate::language::{Expression, Node, component, evaluate_f64};

/// Largest number of choices of one factor in each product that are tried.
const CHOICES: usize = 64;
/// Limit of operations of the search for points of all choices.
const OPERATIONS: u64 = 200_000_000;
/// Size, relative to the largest factor of the product, below which a factor is zero at the given values.
const ZERO: f64 = 1e-9;
/// Size below which a factor is zero at a point of 77 digits.
const ROUNDING: f64 = 1e-30;

/// Factor of a constraint.
struct Factor {
    text: String,
    expression: Expression,
}

/// Constraint that is a product.
struct ConstraintProduct {
    constraint: usize,
    factors: Vec<Factor>,
    /// Index of the factor that is zero at the values of the file.
    given: Option<usize>,
}

impl SystemModel {
    /// The model with one factor in place of each constraint that is a product. Candidates are choices whose
    /// factors have a real point together with all other constraints, at which the model is defined. The
    /// preferred choice has factors that are zero at the values of the file; then those at whose point no
    /// other factor is zero; then factors that are no unknown alone (x = 0 removes more from a model than y
    /// = z); then the first as written. The model is unchanged if there is no product, or if no such point
    /// was found.
    pub(super) fn by_one_factor(self) -> Self {
        let all = self.constraints.iter().enumerate();
        let products: Vec<ConstraintProduct> = all.filter_map(|(c, own)| self.product(c, own)).collect();
        if products.is_empty() {
            return self;
        }
        let total = products.iter().map(|p| p.factors.len()).fold(1, usize::saturating_mul);
        let (mut best, mut spent): (Option<([usize; 3], Self)>, _) = (None, Spent::default());
        for choice in 0..total.min(CHOICES) {
            let (mut out, mut left, mut others) = (self.clone(), choice, Vec::new());
            let (mut not_given, mut alone) = (0, 0);
            for p in &products {
                let taken = left % p.factors.len();
                left /= p.factors.len();
                not_given += usize::from(p.given.is_some_and(|given| given != taken));
                alone += usize::from(p.factors[taken].expression.nodes.len() == 1);
                others.extend(p.factors.iter().enumerate().filter(|(k, _)| *k != taken).map(|(_, f)| f));
                out.take(p, taken);
            }
            if best.as_ref().is_some_and(|(rank, _)| rank[0] < not_given) {
                continue;
            }
            if spent.operations >= OPERATIONS {
                break;
            }
            if let Some(zero) = out.zero_at_point(&others, &mut spent)
                && best.as_ref().is_none_or(|(rank, _)| [not_given, zero, alone] < *rank)
            {
                best = Some(([not_given, zero, alone], out));
            }
        }
        best.map_or(self, |(_, out)| out)
    }

    fn product(&self, constraint: usize, own: &PlacedExpression) -> Option<ConstraintProduct> {
        let factors = factors(own);
        let given = self.zero_at_given(&factors)?;
        (factors.len() > 1).then_some(ConstraintProduct { constraint, factors, given })
    }

    /// Replaces a product by one of its factors.
    fn take(&mut self, of: &ConstraintProduct, taken: usize) {
        let own = &mut self.constraints[of.constraint];
        own.expression = of.factors[taken].expression.clone();
        let others = of.factors.iter().enumerate().filter(|(k, _)| *k != taken);
        self.factors.push(ConstraintFactor {
            constraint: own.text.clone(),
            factor: of.factors[taken].text.clone(),
            others: others.map(|(_, f)| f.text.clone()).collect(),
            given: of.given == Some(taken),
        });
    }

    /// Number of factors that are zero at a real point at which the constraints hold and the model is
    /// defined; `None` if none was found.
    fn zero_at_point(&self, factors: &[&Factor], spent: &mut Spent) -> Option<usize> {
        let mut model = self.clone();
        model.work_limit = model.work_limit.within(OPERATIONS - spent.operations);
        let compiled = model.compile().ok()?;
        let mut layout = Layout::new(&model, &compiled, Some(0));
        layout.dependent = real_point(&model, &compiled, &layout, 1, spent).ok()?;
        let mut rng = model.random(1, "factors");
        let at = climb_at(&model, &compiled, &layout, Reals::<4>, &mut rng, spent).ok()?;
        let names = layout.unknowns.iter().map(|u| u.name.as_str());
        let names = names.chain(model.constants.iter().map(|c| c.0.name.as_str()));
        let values: HashMap<&str, f64> = names.zip(at.values.iter().map(Ball::to_f64)).collect();
        let value = |name: &str| values.get(name).copied().unwrap_or(f64::NAN);
        let is_zero = |f: &&&Factor| evaluate_f64(&f.expression, &value).abs() < ROUNDING;
        Some(factors.iter().filter(is_zero).count())
    }

    /// The only factor that is zero at the values under `[simulation.values]`, if these are complete, in all
    /// experiments; `None` for a product whose factors are zero in different experiments.
    fn zero_at_given(&self, factors: &[Factor]) -> Option<Option<usize>> {
        let zero = |experiment: usize| {
            let value = |name: &str| self.simulation.value(name, experiment).unwrap_or(f64::NAN);
            let sizes: Vec<f64> = factors.iter().map(|f| evaluate_f64(&f.expression, &value).abs()).collect();
            let largest = sizes.iter().copied().fold(0.0, f64::max);
            let mut zero = (0..factors.len()).filter(|&k| sizes[k] <= ZERO * largest);
            let first = zero.next()?;
            (zero.next().is_none() && sizes.iter().all(|s| s.is_finite())).then_some(first)
        };
        let first = zero(0);
        (1..self.experiments).all(|e| zero(e) == first).then_some(first)
    }
}

/// Distinct factors of a constraint, without factors that contain no name; empty if it is no product.
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
            Node::Negate(a) => open.push(a),
            Node::Divide(a, b) if matches!(e.nodes[b], Node::Number { .. }) => open.push(a),
            // it holds everywhere, or wherever the denominator is not zero
            Node::Number { mantissa: 0, .. } | Node::Divide(..) => return Vec::new(),
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

/// Text of a factor as written.
fn text(own: &PlacedExpression, factor: &Expression) -> Option<String> {
    let span = factor.spans.iter().cloned().reduce(|a, b| a.start.min(b.start)..a.end.max(b.end))?;
    Some(own.text.get(span)?.trim().to_string())
}

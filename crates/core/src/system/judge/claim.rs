//! Size of the claim behind a verdict: degrees and coefficients of the polynomials that decide a rank.

use obsdeg_exact::certainty::RankClaim;

use super::super::dag::{Dag, Op};
use super::super::model::compiled::{Compiled, Role};
use super::super::rows::layout::Layout;
use crate::degree::filtration::Degrees;
use crate::language::Function;

/// Number of pairs of fields that are tried.
pub(super) const ATTEMPTS: usize = 5;

/// Size of the claim: the degree and the coefficients of the polynomials that decide a rank (derivation:
/// crates/README.md, *Certainty*).
///
/// With `f_i = N_i / D` over a common denominator, `L_f^k h = P_k / D^(2k+1)`. The degree of `P_k` grows
/// by at most `delta = max(deg N, deg D) + deg D` an order. Its coefficients grow by the effect of a
/// derivative and two products.
pub(super) fn claim(compiled: &Compiled, layout: &Layout, degrees: &Degrees, runs: usize) -> RankClaim {
    // Decisions at each of ATTEMPTS points: a rank at each order, of all runs and of each alone, here and at
    // a generic point; that no unit vector comes an order early (if the ranks are correct none comes late);
    // and that no column or entry of the last basis is zero by chance.
    let decisions = ATTEMPTS
        * ((degrees.rank_profile.len() + 1) * (1 + 2 * runs)
            + 2 * layout.unknowns.len()
            + 2 * compiled.combinations.len()
            + degrees.rank() * (layout.unknowns.len() - degrees.rank()));
    RankClaim { decisions, ..claim_of(compiled, layout, degrees.rank_profile.len()) }
}

/// Size of the claim of one decision on rows of the given number of orders.
pub(in crate::system) fn claim_of(compiled: &Compiled, layout: &Layout, orders: usize) -> RankClaim {
    let fractions = fractions(&compiled.dag);
    let experiments = 0..compiled.experiments.len();
    let used: Vec<QuotientBounds> = experiments
        .flat_map(|e| {
            let given = compiled.constants(e).iter().flatten();
            compiled.rates(e).iter().chain(compiled.outputs(e)).chain(given)
        })
        .chain(compiled.starts.iter().flatten())
        .chain(
            compiled.segments.iter().flat_map(|s| s.constants.iter().chain(&s.carry)).map(|(_, node)| node),
        )
        .map(|&node| fractions[node])
        .chain(function_rates(&compiled.dag, &fractions, compiled))
        .collect();
    // over the product of all denominators
    let (below, below_bits) = used.iter().fold((0.0, 0.0), |(d, b), f| (d + f.below.0, b + f.below.1));
    let above = |part: fn(&QuotientBounds) -> f64| used.iter().map(part).fold(0.0, f64::max);
    let (top, top_bits) = (above(|f| f.above.0) + below, above(|f| f.above.1) + below_bits);
    let delta = top.max(below) + below;
    let (orders, n) = (orders as f64, layout.unknowns.len() as f64);
    // jets of inputs and states are variables too
    let functions = compiled.dag.ops.iter().filter(|op| matches!(op, Op::Primitive { .. })).count();
    let variables = (compiled.roles.len() as f64) * (orders + 1.0) + functions as f64;
    let degree = top + orders * delta + below;
    let step =
        (variables * (degree + (2.0 * orders + 1.0) * below).max(1.0)).log2() + 2.0 * (top_bits + below_bits);
    let bits = top_bits + (orders + 1.0) * step + n.max(1.0).log2();
    RankClaim {
        unknowns: layout.unknowns.len(),
        decisions: 1,
        order: 1,
        row_degree: degree.min(1e18) as usize,
        row_bits: bits,
    }
}

/// Bounds of a quotient of polynomials: degree, and `log2` of the sum of the absolute coefficients.
#[derive(Debug, Clone, Copy)]
struct QuotientBounds {
    above: (f64, f64),
    below: (f64, f64),
}

impl QuotientBounds {
    const ZERO: Self = Self { above: (0.0, 0.0), below: (0.0, 0.0) };
    const VARIABLE: Self = Self { above: (1.0, 0.0), below: (0.0, 0.0) };

    fn plus(self, other: Self) -> Self {
        let (left, right) = (times(self.above, other.below), times(other.above, self.below));
        Self {
            above: (left.0.max(right.0), left.1.max(right.1) + 1.0),
            below: times(self.below, other.below),
        }
    }

    fn times(self, other: Self) -> Self {
        Self { above: times(self.above, other.above), below: times(self.below, other.below) }
    }

    fn inverse(self) -> Self {
        Self { above: self.below, below: self.above }
    }
}

/// Bounds of a product of polynomials.
fn times(x: (f64, f64), y: (f64, f64)) -> (f64, f64) {
    (x.0 + y.0, x.1 + y.1)
}

/// Time derivatives of the variables that replace functions: `E' = E u'` for exp and tanh, `(1 + t^2)/2 u'`
/// with `t = tan(u/2)` for sin, cos and tan, `weight u'` for a logarithm and an arc tangent.
fn function_rates(dag: &Dag, fractions: &[QuotientBounds], compiled: &Compiled) -> Vec<QuotientBounds> {
    // derivatives of all nodes; a jet of an input is a variable
    let mut rates: Vec<QuotientBounds> = Vec::with_capacity(dag.ops.len());
    let mut out = Vec::new();
    for (i, op) in dag.ops.iter().enumerate() {
        rates.push(match *op {
            Op::Number { .. } | Op::Pi => QuotientBounds::ZERO,
            Op::Slot(s) => match compiled.roles[s] {
                Role::State(k) => fractions[compiled.rates(0)[k]],
                _ => QuotientBounds::VARIABLE,
            },
            Op::Add(a, b) | Op::Subtract(a, b) => rates[a].plus(rates[b]),
            Op::Multiply(a, b) => rates[a].times(fractions[b]).plus(fractions[a].times(rates[b])),
            // (a' - (a/b) b') / b
            Op::Divide(a, b) => {
                let below = fractions[b].inverse();
                rates[a].plus(fractions[i].times(rates[b])).times(below)
            }
            Op::Primitive { of, weight, function } => {
                let factor = match function {
                    Function::Exp | Function::Tanh => QuotientBounds::VARIABLE,
                    Function::Sin | Function::Cos | Function::Tan => {
                        QuotientBounds { above: (2.0, 1.0), below: (0.0, 1.0) }
                    }
                    _ => fractions[weight],
                };
                out.push(factor.times(rates[of]));
                fractions[weight].times(rates[of])
            }
        });
    }
    out
}

/// Every node of a graph as a quotient of polynomials over the integers, in the slots and in one variable
/// for each function.
fn fractions(dag: &Dag) -> Vec<QuotientBounds> {
    let mut out: Vec<QuotientBounds> = Vec::with_capacity(dag.ops.len());
    for op in &dag.ops {
        let one = (0.0, 0.0);
        out.push(match *op {
            Op::Number { mantissa, decimals } => {
                let digits = (mantissa.unsigned_abs().max(1) as f64).log2();
                let ten = f64::from(decimals.abs()) * std::f64::consts::LOG2_10;
                match decimals > 0 {
                    true => QuotientBounds { above: (0.0, digits), below: (0.0, ten) },
                    false => QuotientBounds { above: (0.0, digits + ten), below: one },
                }
            }
            Op::Slot(_) | Op::Pi => QuotientBounds::VARIABLE,
            Op::Primitive { function, .. } => match function {
                // (E^2 - 1)/(E^2 + 1), 2t/(1 + t^2) and similar quotients
                Function::Tanh | Function::Sin | Function::Cos | Function::Tan => {
                    QuotientBounds { above: (2.0, 1.0), below: (2.0, 1.0) }
                }
                _ => QuotientBounds::VARIABLE,
            },
            Op::Add(a, b) | Op::Subtract(a, b) => out[a].plus(out[b]),
            Op::Multiply(a, b) => out[a].times(out[b]),
            Op::Divide(a, b) => out[a].times(out[b].inverse()),
        });
    }
    out
}

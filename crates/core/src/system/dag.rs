//! Expressions as a graph of shared operations that are never expanded.
//!
//! A function also stores its derivative: `dF = weight d(of)`, where the weight is a node like any other.

use std::collections::{HashMap, HashSet};

use crate::language::{Expression, Function, Node};

/// Operation; operands are indices of nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Op {
    /// Decimal `mantissa / 10^decimals`.
    Number {
        /// All digits as an integer.
        mantissa: i128,
        /// Number of digits after the decimal point.
        decimals: i32,
    },
    /// Slot of a state, parameter, input or constant.
    Slot(usize),
    /// Sum `a + b`.
    Add(usize, usize),
    /// Difference `a - b`.
    Subtract(usize, usize),
    /// Product `a b`.
    Multiply(usize, usize),
    /// Quotient `a / b`.
    Divide(usize, usize),
    /// Number pi.
    Pi,
    /// Function F with `dF = weight d(of)`; the weight may come later and depend on F.
    Primitive {
        /// Kind of the function.
        function: Function,
        /// Argument of the function.
        of: usize,
        /// Derivative of the function by its argument.
        weight: usize,
    },
}

/// Reasons why an expression has no place in the graph.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DagError {
    /// A name has no meaning.
    #[error("`{0}` is not known here")]
    UnknownName(String),
    /// A number or power is too large.
    #[error("{0}")]
    TooLarge(&'static str),
    /// An expression is never defined.
    #[error("{0}")]
    Undefined(&'static str),
}

/// Graph of operations.
#[derive(Debug, Clone, Default)]
pub struct Dag {
    /// Operations; operands come first, except for weights.
    pub ops: Vec<Op>,
    index: HashMap<Op, usize>,
    /// Nodes of the functions, by kind and argument.
    pub(super) functions: HashMap<(Function, usize), usize>,
    /// Values of slots that are rational and never change, by slot: exponents may be made of these.
    pub(super) definite: HashMap<usize, (i64, i64)>,
    /// Logarithms that come from a power whose exponent is neither an integer nor half of one: the model
    /// does not contain them as text.
    pub(super) powers: HashSet<usize>,
}

impl Dag {
    /// True if the graph has no function, so that every value exists in a prime field.
    pub(crate) fn is_rational(&self) -> bool {
        !self.ops.iter().any(|op| matches!(op, Op::Primitive { .. } | Op::Pi))
    }

    /// True if the graph has this function of the node.
    pub(super) fn has(&self, function: Function, of: usize) -> bool {
        self.functions.contains_key(&(function, of))
    }

    pub(super) fn add(&mut self, op: Op) -> usize {
        if let Some(&i) = self.index.get(&op) {
            return i;
        }
        self.ops.push(op);
        self.index.insert(op, self.ops.len() - 1);
        self.ops.len() - 1
    }

    /// Node of a slot.
    pub fn slot(&mut self, slot: usize) -> usize {
        self.add(Op::Slot(slot))
    }

    /// Node of an integer.
    pub fn integer(&mut self, x: i64) -> usize {
        self.add(Op::Number { mantissa: x.into(), decimals: 0 })
    }

    pub(super) fn is(&self, node: usize, x: i64) -> bool {
        matches!(
            self.ops[node],
            Op::Number { mantissa, decimals } if mantissa == i128::from(x) && (x == 0 || decimals == 0)
        )
    }

    pub(super) fn sum(&mut self, a: usize, b: usize) -> usize {
        if self.is(a, 0) {
            return b;
        }
        if self.is(b, 0) { a } else { self.add(Op::Add(a.min(b), a.max(b))) }
    }

    pub(super) fn difference(&mut self, a: usize, b: usize) -> usize {
        if self.is(b, 0) {
            return a;
        }
        if a == b { self.integer(0) } else { self.add(Op::Subtract(a, b)) }
    }

    pub(super) fn product(&mut self, a: usize, b: usize) -> usize {
        match (self.is(a, 1), self.is(b, 1)) {
            (true, _) => b,
            (_, true) => a,
            _ if self.is(a, 0) || self.is(b, 0) => self.integer(0),
            _ => self.add(Op::Multiply(a.min(b), a.max(b))),
        }
    }

    pub(super) fn quotient(&mut self, a: usize, b: usize) -> usize {
        if self.is(b, 1) { a } else { self.add(Op::Divide(a, b)) }
    }

    pub(super) fn negative(&mut self, a: usize) -> usize {
        if let Op::Number { mantissa, decimals } = self.ops[a] {
            return self.add(Op::Number { mantissa: -mantissa, decimals });
        }
        let minus = self.integer(-1);
        self.product(minus, a)
    }

    /// Node of an expression; `names` gives the nodes of names.
    ///
    /// # Errors
    /// [`DagError`] with the index of the operation in the expression.
    pub(crate) fn translate(
        &mut self,
        e: &Expression,
        names: &dyn Fn(&str) -> Option<usize>,
    ) -> Result<usize, (DagError, usize)> {
        let mut nodes: Vec<usize> = Vec::with_capacity(e.nodes.len());
        for (i, node) in e.nodes.iter().enumerate() {
            let made = match node {
                Node::Number { mantissa, decimals } => {
                    Ok(self.add(Op::Number { mantissa: *mantissa, decimals: *decimals }))
                }
                Node::Name(name) => names(name)
                    .or_else(|| self.constant(name))
                    .ok_or_else(|| DagError::UnknownName(name.clone())),
                Node::Call { function, argument } => self.call(*function, nodes[*argument]),
                Node::Negate(a) => Ok(self.negative(nodes[*a])),
                Node::Add(a, b) => Ok(self.sum(nodes[*a], nodes[*b])),
                Node::Subtract(a, b) => Ok(self.difference(nodes[*a], nodes[*b])),
                Node::Multiply(a, b) => Ok(self.product(nodes[*a], nodes[*b])),
                Node::Divide(_, b) if self.is(nodes[*b], 0) => Err(DagError::Undefined("division by zero")),
                Node::Divide(a, b) => Ok(self.quotient(nodes[*a], nodes[*b])),
                Node::Power(a, b) => self.power(nodes[*a], nodes[*b]),
            };
            nodes.push(made.map_err(|error| (error, i))?);
        }
        Ok(nodes.last().copied().unwrap_or_else(|| self.integer(0)))
    }
}

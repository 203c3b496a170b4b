//! Run of a system: its Taylor series, the condition that ends it, and the rows of one order.

use obsdeg_exact::Scalars;

use super::super::adjoint::Adjoint;
use super::super::taylor::Taylor;
use super::super::values::Values;
use super::super::work::{RowCost, Sweeps};

/// Condition that ends a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum EndCondition {
    /// The point is generic: an order that adds nothing is the last.
    Stagnation,
    /// No higher rank is possible: these are the ranks at a generic point, of all outputs together, or of
    /// each alone.
    Rank(Vec<usize>),
    /// The system is at rest: the rows are `C A^k`, and by Cayley-Hamilton those of this order are the last
    /// that can add anything.
    Order(usize),
    /// No end is proven.
    Open,
}

impl EndCondition {
    /// True if a run has ended: its rows, or those of one of its outputs, have this rank after an order;
    /// `grew` is true if that order raised the rank.
    pub(super) fn is_reached(&self, output: usize, order: usize, grew: bool, rank: usize) -> bool {
        match self {
            Self::Stagnation => !grew,
            Self::Rank(ranks) => ranks.get(output).is_some_and(|most| rank >= *most),
            Self::Order(last) => order >= *last,
            Self::Open => false,
        }
    }
}

#[derive(Debug, Clone)]
pub(super) struct RunRows<'a, S: Values> {
    pub(super) taylor: Taylor<'a, S>,
    /// Rows computed backwards, if there are many unknowns.
    pub(super) adjoint: Option<Adjoint<'a, S>>,
    pub(super) outputs: &'a [usize],
    /// Span of the run's own rows.
    pub(super) own: S::Space,
    pub(super) end: EndCondition,
    pub(super) done: bool,
    /// Differentials of the constraints at the start of the experiment.
    pub(super) known: Rows<S>,
    /// Gradients of the combinations at the start of the run.
    pub(super) combinations: Rows<S>,
}

/// Rows over the unknowns.
pub(in crate::system) type Rows<S> = Vec<Vec<<S as Scalars>::Element>>;

/// Cost of the rows of a run.
pub(super) fn cost_of<S: Values>(
    taylor: &Taylor<'_, S>,
    backwards: Option<Sweeps>,
    outputs: usize,
) -> RowCost {
    let [fixed, growing, nodes, products] = taylor.operations();
    RowCost {
        fixed,
        growing,
        nodes,
        products,
        backwards,
        outputs: outputs as u64,
        components: taylor.components() as u64,
        words: (size_of::<S::Element>() as u64).div_ceil(8),
    }
}

/// Rows of an order of all outputs.
pub(super) fn rows_of<S: Values>(
    taylor: &mut Taylor<'_, S>,
    adjoint: Option<&mut Adjoint<'_, S>>,
    outputs: &[usize],
    order: usize,
) -> Rows<S> {
    if let Some(adjoint) = adjoint {
        return adjoint.rows(order);
    }
    while taylor.length <= order {
        taylor.advance();
    }
    let row = |&output: &usize| {
        dense(&taylor.field(), taylor.components(), taylor.components_of(output), taylor.dual(output, order))
    };
    outputs.iter().map(row).collect()
}

/// Full row of a sparse one: zeros outside its support.
pub(in crate::system) fn dense<S: Values>(
    f: &S,
    components: usize,
    support: &[u32],
    row: &[S::Element],
) -> Vec<S::Element> {
    let mut out = vec![f.zero(); components];
    for (&component, x) in support.iter().zip(row) {
        out[component as usize] = *x;
    }
    out
}

//! Derivatives of the outputs along the dynamics.

use symbolica::prelude::*;

use super::JobError;
use super::tower::atom;
use crate::protocol::Dynamics;

/// `z_j, z_j', ..., z_j^(order)` for every output, expanded: Lie derivatives along `x' = f(x)`.
pub(crate) fn derivatives(dynamics: &Dynamics, order: usize) -> Result<Vec<Vec<Atom>>, JobError> {
    if dynamics.states.len() != dynamics.equations.len() {
        let (found, expected) = (dynamics.equations.len(), dynamics.states.len());
        return Err(JobError::Shape { what: "dynamics", found, expected });
    }
    let states: Vec<Symbol> = dynamics.states.iter().map(|s| symbol!(s)).collect();
    let f: Vec<Atom> = dynamics.equations.iter().map(|e| atom(e)).collect::<Result<_, _>>()?;
    let mut out = Vec::new();
    for output in &dynamics.outputs {
        let mut chain = vec![atom(output)?.expand()];
        for k in 0..order {
            let next = states
                .iter()
                .zip(&f)
                .fold(Atom::num(0), |sum, (x, rate)| sum + chain[k].derivative(*x) * rate);
            chain.push(next.expand());
        }
        out.push(chain);
    }
    Ok(out)
}

/// Derivatives as text, output by output.
pub(crate) fn formulas(dynamics: &Dynamics, order: usize) -> Result<Vec<String>, JobError> {
    Ok(derivatives(dynamics, order)?.iter().flatten().map(ToString::to_string).collect())
}

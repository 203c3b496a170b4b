//! Linear systems over a [`Tower`], and their verification by substitution.

use symbolica::prelude::*;

use super::JobError;
use super::derive::derivatives;
use super::tower::{Element, Tower, atom};
use crate::protocol::{SubstitutionCheck, System};

/// Solves the system. Returns `x` or `P x` as text, and true if the check was made; a check that does
/// not hold is an error.
pub(crate) fn solve(
    tower: &Tower,
    system: &System,
    check: Option<&SubstitutionCheck>,
) -> Result<(Vec<String>, bool), JobError> {
    let unknowns = system.matrix.first().map_or(0, Vec::len);
    shape("right side", system.right.len(), system.matrix.len())?;
    let mut rows: Vec<Vec<Element>> = Vec::new();
    for (row, right) in system.matrix.iter().zip(&system.right) {
        shape("row", row.len(), unknowns)?;
        rows.push(row.iter().chain([right]).map(|t| tower.element(t)).collect::<Result<_, _>>()?);
    }
    let x = eliminate(tower, rows, unknowns)?;
    if let Some(check) = check {
        verify(tower, &x, check)?;
    }
    let values = if system.outputs.is_empty() {
        x.iter().map(|e| tower.print(e)).collect::<Result<_, _>>()?
    } else {
        let mut out = Vec::new();
        for row in &system.outputs {
            shape("output", row.len(), unknowns)?;
            let mut sum = tower.zero();
            for (text, value) in row.iter().zip(&x) {
                sum = tower.add(&sum, &tower.mul(&tower.element(text)?, value));
            }
            out.push(tower.print(&sum)?);
        }
        out
    };
    Ok((values, check.is_some()))
}

fn shape(what: &'static str, found: usize, expected: usize) -> Result<(), JobError> {
    if found == expected { Ok(()) } else { Err(JobError::Shape { what, found, expected }) }
}

/// Gauss-Jordan elimination of `[M | b]`. The simplest entry is the next pivot, since its inverse keeps
/// the others short.
fn eliminate(tower: &Tower, mut rows: Vec<Vec<Element>>, unknowns: usize) -> Result<Vec<Element>, JobError> {
    let entries = |row: &[Element]| row.iter().filter(|e| !tower.is_zero(e)).count();
    let mut solved: Vec<(usize, Vec<Element>)> = Vec::new();
    loop {
        rows.retain(|row| entries(row) > 0);
        if rows.is_empty() {
            break;
        }
        let best = (0..rows.len())
            .flat_map(|i| (0..unknowns).map(move |c| (i, c)))
            .filter(|&(i, c)| !tower.is_zero(&rows[i][c]))
            .min_by_key(|&(i, c)| (tower.terms(&rows[i][c]), entries(&rows[i])));
        let Some((best, pivot)) = best else {
            return Err(JobError::NotUnique("inconsistent"));
        };
        let mut row = rows.swap_remove(best);
        let scale = tower.inv(&row[pivot]);
        for e in row.iter_mut().filter(|e| !tower.is_zero(e)) {
            *e = tower.mul(e, &scale);
            tower.go_on()?;
        }
        for other in rows.iter_mut().chain(solved.iter_mut().map(|(_, r)| r)) {
            if tower.is_zero(&other[pivot]) {
                continue;
            }
            let factor = tower.neg(&other[pivot]);
            for (o, e) in other.iter_mut().zip(&row).filter(|(_, e)| !tower.is_zero(e)) {
                *o = tower.add(o, &tower.mul(&factor, e));
                tower.go_on()?;
            }
        }
        solved.push((pivot, row));
    }
    if solved.len() < unknowns {
        return Err(JobError::NotUnique("underdetermined"));
    }
    solved.sort_by_key(|(pivot, _)| *pivot);
    Ok(solved.into_iter().map(|(_, row)| row[unknowns].clone()).collect())
}

/// Differentiates the outputs along the dynamics, substitutes the states of each segment, and compares
/// the combination with the target, unknown by unknown.
fn verify(tower: &Tower, x: &[Element], check: &SubstitutionCheck) -> Result<(), JobError> {
    shape("check", check.terms.len(), x.len())?;
    shape("target", check.target.len(), check.unknowns.len())?;
    let order = check.terms.iter().flatten().map(|t| t.order).max().unwrap_or(0);
    let z = derivatives(&check.dynamics, order)?;
    let states: Vec<_> = check.dynamics.states.iter().map(|s| atom(s)).collect::<Result<_, _>>()?;
    let unknowns: Vec<_> = check.unknowns.iter().map(|s| atom(s)).collect::<Result<_, _>>()?;
    let mut rest: Vec<Element> = Vec::new();
    for (number, factor) in &check.target {
        let factor = tower.lift(tower.scalar(factor)?);
        rest.push(tower.neg(&tower.mul(&tower.element(number)?, &factor)));
    }
    for (value, terms) in x.iter().zip(&check.terms) {
        for t in terms {
            let mut expression = z[t.output][t.order].clone();
            for (state, text) in states.iter().zip(&check.segments[t.segment]) {
                expression = expression.replace(state.clone()).with(atom(text)?);
            }
            let expression = expression.expand();
            let factor = tower.mul(value, &tower.lift(tower.scalar(&t.factor)?));
            for (slot, unknown) in rest.iter_mut().zip(&unknowns) {
                let coefficient = expression.coefficient(unknown.clone());
                *slot = tower.add(slot, &tower.mul(&factor, &tower.element_of(&coefficient)?));
                tower.go_on()?;
            }
        }
    }
    if rest.iter().all(|e| tower.is_zero(e)) { Ok(()) } else { Err(JobError::NotVerified) }
}

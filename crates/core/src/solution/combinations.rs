//! Named combinations and null vectors, from the filtration.

use obsdeg_exact::{Echelon, Radical};

use crate::degree::coefficient::{Coefficient, Form, Number, READABLE, linear_combination};
use crate::degree::ensemble::Verdicts;
use crate::degree::sparse::{extend_by_short_vectors, support};
use crate::model::Platform;
use crate::model::platform::LOCAL_NAMES;
use crate::solution::print::{StationLabel, stations};
use crate::solution::problem::LinearSystem;
use crate::solution::solver::{Functional, Solver, Sparse};
use crate::solution::support::short_support;

/// Named observable combination.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NamedCombination {
    /// Name, such as `D_FZ - wN*psi_y` or `eps_x^n@p2`.
    pub name: String,
    /// Coefficients in the first field of the verdicts, up to a factor.
    pub vector: Vec<u64>,
    /// Exact coefficients, that of the leading unknown first; `None` if they could not be computed.
    pub functional: Option<Functional>,
    /// Observable degree: the smallest k with the combination in `V_k`.
    pub degree: usize,
}

/// Null vector: a direction in which the unknowns change without any change of Z.
#[derive(Debug, Clone, PartialEq)]
pub struct NullVector {
    /// Components in the first field of the verdicts, up to a factor.
    pub vector: Vec<u64>,
    /// Columns with non-zero components.
    pub support: Vec<usize>,
    /// Exact components; `None` if they could not be computed.
    pub components: Option<Sparse>,
}

/// Text such as `D_FZ - wN*psi_y`; `None` if a number in it is longer than [`READABLE`] or a decimal.
fn readable_sum(platform: &Platform, terms: &Sparse) -> Option<String> {
    let readable =
        |c: &Coefficient| c.form() != Form::Decimal && c.without_rates().to_string().len() <= READABLE;
    let names = platform.names();
    terms
        .iter()
        .all(|(_, c)| readable(c))
        .then(|| linear_combination(terms.iter().map(|(c, k)| (k, names[*c].as_str()))))
}

/// Row of the tables in the local unknowns of a position: `eps_z^n@p2 - wN*psi_y^n@p2`.
fn local_name(solver: &Solver<'_>, labels: &[StationLabel], row: usize) -> String {
    let tables = &solver.tables;
    let at = &labels[tables.station(row)].label;
    let terms = tables.observables[row % tables.observables.len()].row.iter().map(|&(i, sign, rates)| {
        let number = Number::Radical(Radical::rational(sign, 1));
        (Coefficient { number, rates }, format!("{}@{at}", LOCAL_NAMES[i]))
    });
    let terms: Vec<(Coefficient, String)> = terms.collect();
    linear_combination(terms.iter().map(|(c, name)| (c, name.as_str())))
}

/// Leading column of a support: the first coefficient (no psi), or else the first column.
fn lead(platform: &Platform, support: &[usize]) -> usize {
    let constant = |c: &&usize| !platform.names()[**c].starts_with("psi");
    support.iter().find(constant).copied().unwrap_or(support[0])
}

/// Basis of the filtration beyond single unknowns: for every degree k, combinations that span `V_k` together
/// with the unknowns of degree up to k and the combinations before. Sparse combinations of unknowns with
/// readable coefficients come first; combinations of `psi^n` and `eps^n` at single positions complete the
/// basis.
pub(crate) fn combinations(
    platform: &Platform,
    verdicts: &Verdicts,
    solver: &mut Solver<'_>,
) -> Vec<NamedCombination> {
    let sum = |(vector, degree): (Vec<u64>, usize)| {
        let mut support = support(&vector);
        let lead = lead(platform, &support);
        support.sort_by_key(|c| *c != lead);
        let functional = combination_coefficients(platform, solver, &support, &vector, degree);
        let found = functional.and_then(|f| Some((readable_sum(platform, &f.terms)?, f)));
        solver.left_out += usize::from(found.is_none());
        let (name, functional) = found?;
        Some(NamedCombination { name, vector, functional: Some(functional), degree })
    };
    let mut out: Vec<NamedCombination> = short_vectors(verdicts).into_iter().filter_map(sum).collect();
    // other combinations that are determined during a turn contain turning rates, and have no name
    if !platform.scheme().by_history() {
        complete_by_positions(platform, verdicts, solver, &mut out);
    }
    out.sort_by_key(|c| c.degree);
    out
}

/// Span of the single unknowns of degree up to k.
fn single_unknowns(verdicts: &Verdicts, k: usize) -> Echelon {
    let field = verdicts.values[0].roots().field;
    let n = verdicts.degrees.degree.len();
    let mut span = Echelon::new(field, n);
    for c in (0..n).filter(|&c| verdicts.degrees.degree[c].is_some_and(|d| d <= k)) {
        let unit: Vec<u64> = (0..n).map(|j| if j == c { field.one() } else { 0 }).collect();
        span.insert(&unit);
    }
    span
}

/// Sparse vectors that span every `V_k` together with the single unknowns, each with its degree.
fn short_vectors(verdicts: &Verdicts) -> Vec<(Vec<u64>, usize)> {
    let field = verdicts.values[0].roots().field;
    let mut chosen: Vec<(Vec<u64>, usize)> = Vec::new();
    for (k, basis) in verdicts.spans.iter().enumerate() {
        let mut span = single_unknowns(verdicts, k);
        for (v, _) in &chosen {
            span.insert(v);
        }
        // basis rows whose pivot is no single unknown vanish at all single unknowns
        let single = |c: usize| verdicts.degrees.degree[c].is_some_and(|d| d <= k);
        let rows: Vec<Vec<u64>> = basis
            .pivots()
            .enumerate()
            .filter(|&(_, c)| !single(c))
            .map(|(i, _)| basis.row(i).to_vec())
            .collect();
        if span.rank() < basis.rank() {
            chosen.extend(extend_by_short_vectors(&field, &rows, &mut span).into_iter().map(|v| (v, k)));
        }
    }
    chosen
}

/// Adds combinations of `psi^n` and `eps^n` at single positions until all `V_k` are spanned.
fn complete_by_positions(
    platform: &Platform,
    verdicts: &Verdicts,
    solver: &mut Solver<'_>,
    out: &mut Vec<NamedCombination>,
) {
    let labels = stations(platform.scheme());
    for (k, basis) in verdicts.spans.iter().enumerate() {
        let mut span = single_unknowns(verdicts, k);
        for c in out.iter().filter(|c| c.degree <= k) {
            span.insert(&c.vector);
        }
        for row in solver.tables.rows_up_to(k) {
            if span.rank() == basis.rank() {
                break;
            }
            let vector = solver.tables.first().rows[row].clone();
            if span.insert(&vector) {
                let functional = solver.functional_of_row(row);
                let name = local_name(solver, &labels, row);
                out.push(NamedCombination { name, vector, functional, degree: k });
            }
        }
    }
}

/// Exact coefficients of a combination found as `vector`, scaled to one at the first of `support`.
fn combination_coefficients(
    platform: &Platform,
    solver: &mut Solver<'_>,
    support: &[usize],
    vector: &[u64],
    degree: usize,
) -> Option<Functional> {
    let first = solver.tables.first();
    let field = first.sample.roots.field;
    let allowed = solver.tables.rows_up_to(degree);
    let used = short_support(field, &first.rows, &allowed, vector, |_| 1)?;
    let problem = LinearSystem::combination(&used, platform.names().len(), support, support[0]);
    solver.functional_of(support, &problem)
}

/// Sparse basis of the null space, without the unknowns that are not excited.
pub(crate) fn null_space(
    platform: &Platform,
    verdicts: &Verdicts,
    solver: &mut Solver<'_>,
) -> Vec<NullVector> {
    let Some(last) = verdicts.spans.last() else { return Vec::new() };
    let field = verdicts.values[0].roots().field;
    let excited = &verdicts.degrees.excited;
    let vectors: Vec<Vec<u64>> =
        last.null_space().into_iter().filter(|v| support(v).iter().all(|&c| excited[c])).collect();
    let mut span = Echelon::new(field, platform.names().len());
    let short = extend_by_short_vectors(&field, &vectors, &mut span);
    short
        .into_iter()
        .map(|v| {
            let support = support(&v);
            let components = null_components(solver, &support, usize::MAX);
            NullVector { vector: v, support, components }
        })
        .collect()
}

/// Components of the null vector of the derivatives up to `order` on a minimal support, in the order of the
/// support; the first is one. `None` if they could not be computed.
pub(crate) fn null_components(solver: &mut Solver<'_>, support: &[usize], order: usize) -> Option<Sparse> {
    let lead = support[0];
    let first = solver.tables.first();
    let mut basis = Echelon::new(first.sample.roots.field, support.len() - 1);
    // independent rows on the support without its lead determine the vector
    let restricted = |j: usize| -> Vec<u64> { support[1..].iter().map(|&c| first.rows[j][c]).collect() };
    let used: Vec<usize> =
        solver.tables.rows_up_to(order).into_iter().filter(|&j| basis.insert(&restricted(j))).collect();
    let (values, _) = solver.coefficients(&LinearSystem::null_vector(&used, support, lead))?;
    let rest = support[1..].iter().copied().zip(values);
    Some(std::iter::once((lead, Coefficient::one())).chain(rest).collect())
}

//! Factors of a maximal minor: the conditions under which a rank can drop.

use symbolica::poly::factor::Factorize;

use super::JobError;
use super::tower::{Scalar, Tower};

/// Irreducible factors (without constants and multiplicities) of one maximal minor of a matrix of
/// rational functions. Wherever the rank drops, one of them vanishes, or an entry has a pole.
pub(crate) fn minor_factors(tower: &Tower, matrix: &[Vec<String>]) -> Result<Vec<String>, JobError> {
    let mut rows: Vec<Vec<Scalar>> =
        matrix.iter().map(|row| row.iter().map(|t| tower.scalar(t)).collect()).collect::<Result<_, _>>()?;
    let columns = rows.first().map_or(0, Vec::len);
    let mut factors: Vec<String> = Vec::new();
    let cost = |s: &Scalar| s.numerator.nterms() + s.denominator.nterms();
    let mut minor: Option<Scalar> = None;
    loop {
        // the simplest pivot keeps the entries short
        let pivot = (0..rows.len())
            .flat_map(|i| (0..columns).map(move |c| (i, c)))
            .filter(|&(i, c)| !rows[i][c].is_zero())
            .min_by_key(|&(i, c)| (cost(&rows[i][c]), rows[i].iter().filter(|e| !e.is_zero()).count()));
        let Some((i, c)) = pivot else { break };
        let row = rows.swap_remove(i);
        minor = Some(minor.map_or_else(|| row[c].clone(), |m| &m * &row[c]));
        let inverse = row[c].clone().inv();
        for other in &mut rows {
            if other[c].is_zero() {
                continue;
            }
            let factor = -(&other[c] * &inverse);
            for (o, e) in other.iter_mut().zip(&row).filter(|(_, e)| !e.is_zero()) {
                tower.charge(&factor, e);
                let product = &factor * e;
                tower.charge(o, &product);
                *o = &*o + &product;
                tower.go_on()?;
            }
        }
    }
    if let Some(minor) = minor {
        for (factor, _) in minor.numerator.factor() {
            if !factor.is_constant() {
                factors.push(factor.to_expression().to_string());
            }
        }
    }
    factors.sort();
    factors.dedup();
    Ok(factors)
}

//! Two calibrations of one platform: what changed between them.

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::consistency::chi_square_tail;

use crate::answer::{Calibration, CovarianceTable};

/// Changes of the coefficients from one calibration to a later one.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationChange {
    /// Coefficients that both determine.
    pub coefficients: Vec<CoefficientChange>,
    /// Coefficients that stated priors alone bound in one of the calibrations: they are not compared.
    pub by_prior: Vec<String>,
    /// True if both calibrations are consistent.
    pub consistent: bool,
    /// True if a bench or a suspected error adds to an uncertainty: it is part of the sigmas of the changes,
    /// and all changes together have no significance.
    pub with_bench: bool,
    /// Records that both rest on: the calibrations are not independent then, and no change has a
    /// significance.
    pub shared: Vec<String>,
    /// Differences of their setups beside the positions, in words; empty if both describe the same platform.
    pub differs: Vec<String>,
    /// Chi-square of all changes together, with its degrees of freedom and the probability of a larger one by
    /// chance; `None` if the calibrations share records or no coefficient, are not consistent, or have a
    /// bench.
    pub together: Option<ChangeTest>,
}

/// Change of one coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientChange {
    /// Name of the coefficient.
    pub name: String,
    /// Unit of the numbers.
    pub unit: String,
    /// Estimate of the earlier calibration.
    pub before: f64,
    /// Later estimate minus earlier one.
    pub change: f64,
    /// Standard deviation of the change, of independent calibrations.
    pub sigma: f64,
}

/// Test of all changes together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChangeTest {
    /// Chi-square of the changes.
    pub chi_square: f64,
    /// Number of degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Probability of a larger chi-square if nothing changed.
    pub probability: f64,
}

/// Rows of a covariance by the names of its coefficients.
fn part(table: &CovarianceTable, of: &[&String]) -> Option<DMatrix<f64>> {
    let at = |name: &String| table.names.iter().position(|n| n == name);
    let rows = of.iter().map(|name| at(name)).collect::<Option<Vec<_>>>()?;
    let entry = |i: usize, j: usize| table.rescaled.get(i).and_then(|row| row.get(j)).copied();
    let mut out = DMatrix::zeros(of.len(), of.len());
    for (i, &a) in rows.iter().enumerate() {
        for (j, &b) in rows.iter().enumerate() {
            out[(i, j)] = entry(a, b)?;
        }
    }
    Some(out)
}

/// Changes from `before` to `now`, by their rescaled covariances. psi is that of each run, and is left out.
pub fn compared(now: &Calibration, before: &Calibration) -> CalibrationChange {
    let (here, there) = (&now.covariance, &before.covariance);
    let is_common = |name: &&String| !name.starts_with("psi") && there.names.contains(name);
    let estimated = |c: &Calibration, name: &String| c.quantities.iter().find(|e| e.name == *name).cloned();
    let both_of =
        |name: &String| [now, before].into_iter().filter_map(|c| estimated(c, name)).collect::<Vec<_>>();
    let (by_prior, names): (Vec<&String>, Vec<&String>) =
        here.names.iter().filter(is_common).partition(|name| both_of(name).iter().any(|e| e.from_prior));
    // variance that a bench and suspected errors add
    let outside =
        |name: &String| both_of(name).iter().filter_map(|e| Some(e.outside()?.powi(2))).sum::<f64>();
    let value = |table: &CovarianceTable, name: &String| {
        let k = table.names.iter().position(|n| n == name)?;
        Some((*table.estimates.get(k)?, table.units.get(k)?.clone()))
    };
    let both = part(here, &names).zip(part(there, &names)).map(|(a, b)| a + b);
    let changes = names.iter().enumerate().filter_map(|(k, name)| {
        let ((now, unit), (before, _)) = value(here, name).zip(value(there, name))?;
        let sigma = (both.as_ref()?[(k, k)].max(0.0) + outside(name)).sqrt();
        Some(CoefficientChange { name: (*name).clone(), unit, before, change: now - before, sigma })
    });
    let coefficients: Vec<CoefficientChange> = changes.collect();
    let shares = |b: &&crate::setup::SourceRecord| before.rests_on.iter().any(|o| o.digest == b.digest);
    let shared: Vec<String> = now.rests_on.iter().filter(shares).map(|b| b.record.clone()).collect();
    let positions = |c: &Calibration| crate::setup::Setup { positions: Vec::new(), ..c.setup.clone() };
    let with_bench = names.iter().any(|name| outside(name) > 0.0);
    let consistent = now.consistent && before.consistent;
    let is_tested = shared.is_empty() && !coefficients.is_empty() && consistent && !with_bench;
    let together = both.filter(|_| is_tested).and_then(|covariance| {
        let d = DVector::from_iterator(coefficients.len(), coefficients.iter().map(|c| c.change));
        // entries differ by orders of magnitude: scaled to unit variances
        let scale = DMatrix::from_diagonal(&covariance.diagonal().map(|v| 1.0 / v.sqrt()));
        let (scaled, d) = (&scale * covariance * &scale, &scale * d);
        let chi_square = d.dot(&scaled.cholesky()?.solve(&d));
        let degrees_of_freedom = coefficients.len();
        let probability = chi_square_tail(degrees_of_freedom as f64, chi_square);
        Some(ChangeTest { chi_square, degrees_of_freedom, probability })
    });
    let differs = positions(now).differences(&positions(before));
    let differs = differs.into_iter().filter(|d| !d.starts_with("number of positions")).collect();
    let by_prior = by_prior.into_iter().cloned().collect();
    CalibrationChange { coefficients, by_prior, consistent, with_bench, shared, differs, together }
}

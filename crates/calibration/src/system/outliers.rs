//! Residuals of the measurements by output, and measurements that disagree with the others.

use obsdeg_ekf::consistency::{chi_square_quantile, student_quantile};

use super::Calibrating;
use super::answer::{OutputFit, SystemFinding, SystemResidual};
use super::fit::{ModelRows, leverage};
use crate::least_squares::LeastSquaresSolution;
use crate::levels;
use crate::white;

impl Calibrating<'_> {
    pub(super) fn residuals(&self, at: &ModelRows, solution: &LeastSquaresSolution) -> Vec<SystemResidual> {
        let of = |(i, &(k, output)): (usize, &(usize, usize))| {
            let row = &self.data.rows[k];
            let free = (1.0 - leverage(at, solution, i)).max(1e-9);
            SystemResidual {
                output,
                experiment: row.experiment,
                line: row.line,
                t: row.t + self.data.origins[row.experiment],
                measured: row.outputs[output].unwrap_or(f64::NAN),
                residual: at.left[i],
                sigma: at.sigmas[i],
                normalised: at.left[i] / at.sigmas[i] / free.sqrt(),
            }
        };
        at.keys.iter().enumerate().map(of).collect()
    }

    pub(super) fn outputs(
        &self,
        residuals: &[SystemResidual],
        at: &ModelRows,
        solution: &LeastSquaresSolution,
    ) -> Vec<OutputFit> {
        let of = |j: usize| {
            let own: Vec<&SystemResidual> = residuals.iter().filter(|r| r.output == j).collect();
            let of_output = (0..at.keys.len()).filter(|&i| at.keys[i].1 == j);
            let (free, variance) = of_output.fold((0.0, 0.0), |(sum, variance), i| {
                let free = 1.0 - leverage(at, solution, i);
                (sum + free, variance + free * at.sigmas[i] * at.sigmas[i])
            });
            let chi: f64 = own.iter().map(|r| (r.residual / r.sigma).powi(2)).sum();
            let squares: f64 = own.iter().map(|r| r.residual * r.residual).sum();
            let series: Vec<f64> = own.iter().map(|r| r.normalised).collect();
            let sigma = own.first().map(|r| r.sigma).filter(|s| own.iter().all(|r| r.sigma == *s));
            OutputFit {
                output: self.model.outputs[j].0.name.clone(),
                measurements: own.len(),
                sigma,
                estimated: self.estimated[j],
                chi_square: if free > 1e-9 { chi / free } else { 0.0 },
                rms: (squares / own.len().max(1) as f64).sqrt(),
                degrees_of_freedom: free,
                outlier_gate: None,
                expected_rms: (f64::max(variance, 0.0) / own.len().max(1) as f64).sqrt(),
                whiteness_probability: white::whiteness(&series),
            }
        };
        (0..self.model.outputs.len()).map(of).collect()
    }

    /// Measurements that disagree with the others: residuals studentised without the measurement itself
    /// (Cook, Weisberg 1982, 2.2.1), so that an outlier does not hide in the sigma that it causes. Where
    /// sigmas are given, it must be far off by these as well.
    pub(super) fn outliers(&self, residuals: &[SystemResidual], outputs: &[OutputFit]) -> Vec<SystemFinding> {
        let normal = student_gate(f64::INFINITY, residuals.len());
        let of = |r: &SystemResidual| {
            let output = &outputs[r.output];
            let gate = output.outlier_gate?;
            let (chi, free) = self.group(r.output, outputs);
            let others = ((chi - r.normalised * r.normalised) / (free - 1.0)).max(0.0).sqrt();
            let off = r.normalised / if output.estimated { others } else { others.max(1.0) };
            let far = off.abs() > gate && (output.estimated || r.normalised.abs() > normal);
            far.then(|| SystemFinding::Outlier { output: output.output.clone(), line: r.line, sigmas: off })
        };
        residuals.iter().filter_map(of).collect()
    }

    /// Chi-square and degrees of freedom of the measurements that determine the noise of an output: its own
    /// where that is estimated, otherwise all whose noise is given.
    fn group(&self, output: usize, outputs: &[OutputFit]) -> (f64, f64) {
        let own = |j: &usize| if self.estimated[output] { *j == output } else { !self.estimated[*j] };
        let some = (0..outputs.len()).filter(own);
        some.fold((0.0, 0.0), |(chi, free), j| {
            (
                chi + outputs[j].chi_square * outputs[j].degrees_of_freedom,
                free + outputs[j].degrees_of_freedom,
            )
        })
    }

    /// Outputs with their gates for outliers.
    pub(super) fn with_gates(&self, mut outputs: Vec<OutputFit>) -> Vec<OutputFit> {
        let count = outputs.iter().map(|o| o.measurements).sum();
        for j in 0..outputs.len() {
            let free = self.group(j, &outputs).1 - 1.0;
            // one other measurement gives no sigma
            outputs[j].outlier_gate = (free >= 1.0).then(|| student_gate(free, count));
        }
        outputs
    }
}

/// Bound of all right residuals of so many, but for the probability of an outlier, where sigma is that of
/// others with `free` degrees of freedom.
fn student_gate(free: f64, of: usize) -> f64 {
    let each = levels::OUTLIER / of.max(1) as f64;
    match free.is_finite() {
        true => student_quantile(free, 1.0 - each / 2.0),
        false => chi_square_quantile(1.0, 1.0 - each).sqrt(),
    }
}

//! Upper bound on the criterion of a scheme, valid despite all rounding: a posteriori, by a residual.
//!
//! For any regular K, best the computed inverse of the Cholesky factor of M, and `T = K M K^T - 1`,
//!
//! ```text
//! M^-1 = K^T (1 + T)^-1 K,    so    M^-1 <= K^T K / (1 - t)    wherever |T|_2 <= t < 1
//! ```
//!
//! T is computed; its rounding error is at most `gamma_n` times the same product of the absolute values
//! `|K| S |K|^T`, S the sum of the absolute values of the terms of M (N. J. Higham, *Accuracy and
//! Stability of Numerical Algorithms*, 2nd edition, 2002, (3.4) and (3.13); the residual of an
//! approximate inverse as a proof: S. M. Rump, *Acta Numerica* 19, 2010, 287-449). The origin of K does
//! not matter, and no condition number is assumed. Where M is too near a singular matrix, t is not
//! below 1 and there is no bound.

use nalgebra::DMatrix;

use super::bounded::rounding;
use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::stop::Stop;

impl Evaluator {
    /// Upper bound on the criterion of a sequence, in deg/h (per g), for margin dimensionless. It holds
    /// for the information of each position in double precision, whose error is at most `errors` (m x
    /// m, absolute values, without psi). `None` where order matters, and where rounding may hide all of
    /// it.
    pub(crate) fn at_most(
        &self,
        sequence: &[Stop],
        criterion: &Criterion,
        errors: Option<&DMatrix<f64>>,
    ) -> Option<f64> {
        if self.ordered() {
            return None;
        }
        let (n, m) = (self.n, self.n - 3);
        let (state, mut root) = (self.state_of(sequence), Vec::new());
        if !self.root(&state, &mut root) {
            return None;
        }
        let symmetric =
            |lower: &[f64]| DMatrix::from_fn(m, m, |i, j| lower[(3 + i.max(j)) * n + 3 + i.min(j)]);
        let mut sizes = symmetric(&self.start().information).abs();
        for stop in sequence {
            sizes += symmetric(&self.candidates[stop.candidate].own).abs();
        }
        let l = DMatrix::from_fn(m, m, |i, j| if j <= i { root[(3 + i) * n + 3 + j] } else { 0.0 });
        let k = l.solve_lower_triangular(&DMatrix::identity(m, m))?;
        let size = k.abs();
        let residual = &k * symmetric(&state.information) * k.transpose() - DMatrix::identity(m, m);
        let rounded = (&size * &sizes * size.transpose()).norm() * rounding(2 * m + sequence.len());
        let wrong = errors.map_or(0.0, |errors| (&size * errors * size.transpose()).norm());
        let t = (residual.norm() + rounded + wrong) * (1.0 + rounding(m * m + 2 * m));
        // `K^T K` on the coefficients that count, and the criterion of it
        let counting = k.columns(self.nuisance, m - self.nuisance);
        let variances = || counting.column_iter().map(|column| column.norm_squared());
        let d = counting.ncols() as f64;
        let dph = self.dph * self.dph;
        let squared = match criterion {
            Criterion::Worst => variances().fold(0.0, f64::max) / dph,
            Criterion::A => variances().sum::<f64>() / d / dph,
            Criterion::D => {
                let logs = || (self.nuisance..m).map(|j| k[(j, j)].abs().ln());
                let sizes: f64 = logs().map(f64::abs).sum();
                (2.0 * logs().sum::<f64>() / d + 4.0 * f64::EPSILON * sizes).exp() / dph
            }
            Criterion::E => largest_eigenvalue_at_most(&counting.into_owned())? / dph,
            Criterion::Margin(limits) => {
                let over = variances().zip(&limits.coefficients).map(|(v, limit)| v / dph / (limit * limit));
                let psi = sequence.iter().flat_map(|stop| {
                    let own = self.own_psi(stop.candidate);
                    let finite = (0..3).filter(|&k| limits.psi[k].is_finite());
                    finite.map(|c| {
                        let moved = DMatrix::from_fn(m, 1, |i, _| own.moved[i][c]);
                        let moved = (&k * &moved).norm() + rounding(m) * (&size * moved.abs()).norm();
                        (own.variances[c] + moved * moved) * (1f64.to_degrees() / limits.psi[c]).powi(2)
                    })
                });
                over.chain(psi.collect::<Vec<_>>()).fold(0.0, f64::max)
            }
        };
        let value = (squared / (1.0 - t)).sqrt() * (1.0 + rounding(m));
        (t < 1.0 && value.is_finite()).then_some(value)
    }
}

/// Upper bound on the eigenvalues of `K^T K`. With any Q, best its computed eigenvectors, and `Q^T Q =
/// 1 + F`, the largest is at most the largest eigenvalue of `Q^T K^T K Q` divided by `1 - |F|`. The
/// largest eigenvalue of a matrix is at most its largest row sum of absolute values.
fn largest_eigenvalue_at_most(k: &DMatrix<f64>) -> Option<f64> {
    let (m, d) = k.shape();
    let q = (k.transpose() * k).symmetric_eigen().eigenvectors;
    let turned = k * &q;
    let sizes = k.abs() * q.abs();
    let product = turned.transpose() * &turned;
    let hidden = rounding(2 * d + m) * sizes.norm_squared();
    let rows = product.row_iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>());
    let largest = rows.fold(0.0, f64::max) * (1.0 + rounding(d)) + hidden;
    let identity = DMatrix::<f64>::identity(d, d);
    let f = (q.transpose() * &q - identity).norm() + rounding(d) * q.norm_squared();
    let bound = largest / (1.0 - f) * (1.0 + rounding(d));
    (f < 1.0 && bound.is_finite()).then_some(bound)
}

#[cfg(test)]
mod tests {
    use super::super::exact::{ExactInformation, square_root};
    use super::*;
    use crate::design::measure::criterion::SigmaLimits;
    use crate::design::{Candidates, Stop};
    use obsdeg_core::model::{Angle, Carry, Euler, Scheme};
    use obsdeg_evidence::simulation::Conditions;
    use obsdeg_exact::SplitMix64;

    /// Random scheme, with the number of its coefficients.
    fn drawn_scheme(drawn: &mut dyn FnMut(u64) -> usize) -> (Scheme, usize) {
        let terms = ["F", "F,I", "F,O,S", "F,I,O,S", "F,K0"][drawn(5)];
        let base = Scheme {
            carry: Carry::Reset,
            latitude: (5 + drawn(80)).to_string().parse().ok(),
            unknowns: terms.parse().expect("terms"),
            ..Scheme::default()
        };
        (base, 3 * terms.split(',').count())
    }

    /// Random candidates: cardinal in every second task, else near each other or not.
    fn drawn_candidates(task: usize, drawn: &mut dyn FnMut(u64) -> usize) -> Vec<Euler> {
        let near = [1, 30, 360][drawn(3)];
        (0..4 + drawn(8))
            .map(|_| match task % 2 {
                0 => Candidates::cardinals().attitudes[drawn(24)].clone(),
                _ => std::array::from_fn(|_| Angle::from_degrees(drawn(near) as i32)),
            })
            .collect()
    }

    /// Random schemes: the criterion in 512 bits, of the same information, is never above the bound,
    /// and hardly below it. The criterion in double precision is often below the one in 512 bits, so
    /// rounding must be allowed for. Some schemes have coefficients that do not count, some are near
    /// singular.
    #[test]
    fn no_criterion_is_above_its_stated_bound() {
        let mut rng = SplitMix64::new(41);
        let (mut bounded, mut below, mut parts) = (0, 0, Vec::new());
        for task in 0..300 {
            let mut drawn = |n: u64| rng.below(n) as usize;
            let (base, d) = drawn_scheme(&mut drawn);
            let conditions = Conditions {
                dwell_s: [50.0, 1000.0, 4000.0][drawn(3)],
                step_s: 50.0,
                ..Conditions::default()
            };
            let candidates = drawn_candidates(task, &mut drawn);
            let mut counting: Vec<usize> = (0..d).filter(|_| drawn(3) > 0).collect();
            if counting.is_empty() {
                counting.push(0);
            }
            let limits = SigmaLimits {
                coefficients: counting.iter().map(|_| 10f64.powi(drawn(4) as i32 - 2)).collect(),
                psi: [[0.01, 1.0, f64::INFINITY], [f64::INFINITY; 3]][drawn(2)],
            };
            let criteria =
                [Criterion::Worst, Criterion::A, Criterion::D, Criterion::E, Criterion::Margin(limits)];
            let criterion = criteria[task % criteria.len()].clone();
            let evaluator = Evaluator::new(&base, &candidates, &counting, &conditions).expect("an evaluator");
            let sequence: Vec<Stop> =
                (0..candidates.len() + drawn(3)).map(|i| Stop::from(i % candidates.len())).collect();
            let computed = evaluator.of_sequence(&sequence, &criterion);
            let Some(most) = evaluator.at_most(&sequence, &criterion, None) else { continue };
            let exact = ExactInformation::of(&evaluator, &sequence);
            let part = most / computed - 1.0;
            if criterion == Criterion::E {
                // the largest eigenvalue is below a number where that number times 1, minus S, is
                // positive; double precision has the smallest eigenvalue of S^-1
                let is_above = |sigma: f64| exact.covariance_is_below(sigma);
                assert!(is_above(most), "task {task}: {computed} {most}");
                assert!(
                    part.abs() > 1e-4 || !is_above(most * (1.0 - 1e-3)),
                    "task {task}: {computed} {most}"
                );
                below += usize::from(!is_above(computed));
            } else {
                let truth = square_root(&exact.squared(&criterion, &evaluator, &sequence));
                assert!(truth <= most, "task {task} {criterion:?}: {truth:e} {most:e} {computed:e}");
                assert!(
                    (truth / computed - 1.0).abs() <= part,
                    "task {task}: {truth:e} {computed:e} {part:e}"
                );
                below += usize::from(computed < truth);
            }
            bounded += 1;
            parts.push(part);
        }
        parts.sort_by(f64::total_cmp);
        let median = parts[parts.len() / 2];
        assert!(bounded > 120 && below > 30 && median < 1e-9, "{bounded} {below} {median:e}");
    }
}

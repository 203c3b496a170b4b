//! Starts of the iterations, the rule that ends the search, and the comparison of the solutions.

use nalgebra::DVector;
use obsdeg_evidence::simulation::Noise;

use super::Calibrating;
use super::answer::{OtherSolution, OtherStarts};
use super::fit::{Settled, Stuck, settle, size};
use crate::least_squares::LeastSquaresSolution;

/// Difference in sigma of the determined unknowns below which two solutions are the same.
const SAME: f64 = 1e-2;
/// Largest excess of the sum of squares of a listed solution over the best, in units of the residual
/// chi-square per degree of freedom.
const NEAR: f64 = 25.0;
/// Scatter of the starts: standard deviation of their logarithm.
const SPREAD: f64 = 1.5;
/// Relative difference of the observable unknowns below which two ends of iterations are the same solution.
const ALIKE: f64 = 1e-3;

/// Converged ends, one of each solution by the unknowns that `counts` selects, with the number of ends at it.
fn apart<'a>(ends: &'a [Settled], counts: &dyn Fn(usize) -> bool) -> Vec<(&'a Settled, usize)> {
    let mut out: Vec<(&Settled, usize)> = Vec::new();
    for end in ends.iter().filter(|e| e.converged) {
        let same = |of: &Settled| {
            let near = |j: usize| (of.x[j] - end.x[j]).abs() <= ALIKE * size(of.x[j]);
            (of.cost - end.cost).abs() <= ALIKE * of.cost.max(1.0)
                && (0..end.x.len()).filter(|&j| counts(j)).all(near)
        };
        match out.iter_mut().find(|(of, _)| same(of)) {
            Some((_, count)) => *count += 1,
            None => out.push((end, 1)),
        }
    }
    out
}

/// True if no more solutions are expected than were found. The criterion for w solutions from n starts is
/// `w (n - 1) / (n - w - 2) < w + 1/2` (C. G. E. Boender, A. H. G. Rinnooy Kan, Math. Programming 37, 1987,
/// doi:10.1007/BF02591684).
fn enough(found: usize, starts: usize) -> bool {
    let (w, n) = (found as f64, starts as f64);
    n > w + 2.0 && w * (n - 1.0) / (n - w - 2.0) < w + 0.5
}

impl Calibrating<'_> {
    /// Starts: that of the file, then others about it; a constrained unknown starts with either sign.
    pub(super) fn starts(&self) -> Vec<DVector<f64>> {
        let mut noise = Noise::new(self.options.seed, 18);
        let first: Vec<f64> = self.problem.free.iter().map(|&i| self.base[i]).collect();
        let bounds = self.problem.bounds(&self.base, &DVector::from_column_slice(&first));
        (0..self.options.starts.max(1))
            .map(|k| {
                let of = |(j, x): (usize, &f64)| match (k, *x == 0.0) {
                    (0, _) => *x,
                    (_, true) => noise.normal(),
                    (_, false) => {
                        let size = x * (SPREAD * noise.normal()).exp();
                        if bounds.column(j).amax() > 0.0 { size.copysign(noise.normal()) } else { size }
                    }
                };
                DVector::from_vec(first.iter().enumerate().map(of).collect())
            })
            .collect()
    }

    /// Iterates from `starts` until they suffice; `counts` selects the unknowns that distinguish solutions.
    /// Returns the ends, the number of starts tried, and the first error.
    pub(super) fn search(
        &mut self,
        starts: &[DVector<f64>],
        counts: &dyn Fn(usize) -> bool,
    ) -> (Vec<Settled>, usize, Option<Stuck>) {
        let (mut ends, mut tried, mut first_error): (Vec<Settled>, usize, Option<Stuck>) =
            (Vec::new(), 0, None);
        for x in starts {
            // the solutions so far are the answer
            if self.problem.stopped && !ends.is_empty() {
                break;
            }
            tried += 1;
            match settle(&mut self.problem, &self.base, x.clone(), 1, None) {
                Ok(end) => ends.push(end),
                Err(e) => drop(first_error.get_or_insert(e)),
            }
            let settled = ends.iter().filter(|e| e.converged).count();
            if settled > 0 && enough(apart(&ends, counts).len(), settled) {
                break;
            }
        }
        ends.sort_by(|a, b| {
            (!a.converged, a.cost).partial_cmp(&(!b.converged, b.cost)).unwrap_or(std::cmp::Ordering::Equal)
        });
        (ends, tried, first_error)
    }

    /// Solutions other than the best that fit nearly as well, and the number of starts that led to the best.
    /// The last value counts the outcomes of the other starts, without those that failed.
    pub(super) fn others(
        &mut self,
        ends: &[Settled],
        best: &Settled,
        determined: &[bool],
        solution: &LeastSquaresSolution,
        mean: f64,
        finer: usize,
    ) -> (Vec<OtherSolution>, usize, OtherStarts) {
        let same = |a: &DVector<f64>, b: &DVector<f64>| {
            (0..a.len()).filter(|&j| determined[j]).all(|j| {
                (a[j] - b[j]).abs()
                    <= SAME * solution.sigma(&[(j, 1.0)]) * mean.sqrt().max(1.0) + 1e-9 * size(b[j])
            })
        };
        let (mut out, mut led): (Vec<OtherSolution>, usize) = (Vec::new(), 0);
        let unsettled = ends.iter().filter(|e| !e.converged).count();
        let mut starts = OtherStarts { unsettled, ..OtherStarts::default() };
        for (end, count) in apart(ends, &|j| determined[j]) {
            // with the noise and the integration steps of the solution
            let again = settle(&mut self.problem, &self.base, end.x.clone(), finer, None).ok();
            let Some(end) = again.filter(|end| end.converged) else {
                starts.unsettled += count;
                continue;
            };
            if same(&end.x, &best.x) {
                led += count;
                continue;
            }
            if end.cost > best.cost + NEAR * mean.max(1e-300) {
                starts.higher += count;
                let least = &mut starts.least_higher_chi_square;
                *least = Some(least.map_or(end.cost, |l| l.min(end.cost)));
                continue;
            }
            starts.near += count;
            let known = out.iter_mut().find(|o| same(&end.x, &DVector::from_column_slice(&o.values)));
            match known {
                Some(o) => o.starts += count,
                None => out.push(OtherSolution {
                    chi_square: end.cost,
                    starts: count,
                    values: end.x.iter().copied().collect(),
                }),
            }
        }
        out.sort_by(|a, b| a.chi_square.total_cmp(&b.chi_square));
        (out, led, starts)
    }
}

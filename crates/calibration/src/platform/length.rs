//! Causes of a specific force whose length is not 1 g: all axes alike (scale, gravity), one axis (its scale
//! or zero), or neither.
//!
//! For a force `t` of length 1 g, an output `f_i = (1 + s) t_i + b` with a scale error s alone gives
//! `|f|^2 - 1 = (1 - (1 + s)^-2) f_i^2`. A zero b alone gives `2 b f_i - b^2`. Both are straight lines, over
//! `f_i^2` and `f_i` of the positions.

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::consistency::chi_square_quantile;

use crate::answer::{ForceCause, ForceError};

/// Smallest deviation of the length from 1 g, in g, for which gravity or a scale of all axes is doubted.
const ALIKE: f64 = 3e-4;
/// Largest difference between lengths of positions that does not matter, in g.
const DIFFER: f64 = 1e-5;
/// Relative residual up to which a cause explains the lengths, however small the sigmas are.
const PART: f64 = 0.1;
/// Ratio to the best residual up to which a cause explains the lengths equally well.
const WORSE: f64 = 3.0;
/// Names of the outputs of the accelerometers.
const AXES: [&str; 3] = ["fx", "fy", "fz"];

/// Specific force of a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Length {
    /// Length in g; `sigma` is its standard deviation.
    pub length: f64,
    pub sigma: f64,
    /// Force in platform axes, in g.
    pub force: [f64; 3],
}

/// Deviation of the lengths, by position.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wrong {
    /// Indices of the positions with the least and the greatest length.
    pub ends: [usize; 2],
    /// True if all lengths are equal.
    pub alike: bool,
    /// Causes, each of which explains the lengths alone.
    pub causes: Vec<ForceCause>,
}

/// Straight line through the squares of the lengths.
struct LengthLine {
    coefficients: DVector<f64>,
    /// Standard deviation of the last coefficient.
    sigma: f64,
    /// Residuals: chi-square, and the root of the mean square `left`, in g^2.
    chi_square: f64,
    left: f64,
    free: usize,
}

/// Least-squares fit of `|f|^2 - 1` by `columns`.
fn line(all: &[Length], columns: &[Vec<f64>]) -> Option<LengthLine> {
    let (m, n) = (all.len(), columns.len());
    let weights: Vec<f64> = all.iter().map(|l| 1.0 / (2.0 * l.length * l.sigma)).collect();
    let y = DVector::from_fn(m, |i, _| all[i].length.powi(2) - 1.0);
    let a = DMatrix::from_fn(m, n, |i, j| columns[j][i]);
    let whitened = DMatrix::from_fn(m, n, |i, j| a[(i, j)] * weights[i]);
    // nearly equal columns decide nothing
    let unit = DMatrix::from_columns(&whitened.column_iter().map(|c| c.normalize()).collect::<Vec<_>>());
    let gram = unit.transpose() * &unit;
    if m <= n || !gram.iter().all(|x| x.is_finite()) || gram.determinant() < 1e-6 {
        return None;
    }
    let inverse = (whitened.transpose() * &whitened).try_inverse()?;
    let right = whitened.transpose() * DVector::from_fn(m, |i, _| y[i] * weights[i]);
    let coefficients = &inverse * right;
    let left = y - a * &coefficients;
    let chi_square = left.iter().zip(&weights).map(|(e, w)| (e * w).powi(2)).sum();
    let sigma = inverse[(n - 1, n - 1)].max(0.0).sqrt();
    Some(LengthLine {
        coefficients,
        sigma,
        chi_square,
        left: (left.norm_squared() / m as f64).sqrt(),
        free: m - n,
    })
}

impl LengthLine {
    /// True if chance leaves as much with a probability of `level`.
    fn fits(&self, level: f64) -> bool {
        let free = self.free as f64;
        free > 0.0 && self.chi_square <= chi_square_quantile(free, 1.0 - level)
    }

    /// Scale error or zero of an axis from the last coefficient, with its standard deviation.
    fn cause(&self, error: ForceError, axis: usize, offset: bool) -> Option<ForceCause> {
        let k = *self.coefficients.iter().next_back()?;
        let (by, sigma) = match error {
            ForceError::Scale => {
                let root = (1.0 - k).sqrt();
                (1.0 / root - 1.0, self.sigma / (2.0 * root.powi(3)))
            }
            ForceError::Zero => (k, self.sigma),
        };
        let besides = offset.then(|| (1.0 + self.coefficients[0]).sqrt() - 1.0);
        by.is_finite().then(|| ForceCause { error, axis: AXES[axis].into(), by, sigma, besides })
    }
}

/// Fault of the lengths of the force at the positions of a record; `None` where there is none. `level` is the
/// probability of one where the record is right.
pub(crate) fn wrong(lengths: &[Option<Length>], level: f64) -> Option<Wrong> {
    let places: Vec<usize> = (0..lengths.len()).filter(|&p| lengths[p].is_some()).collect();
    let all: Vec<Length> = lengths.iter().copied().flatten().collect();
    let by_length = |a: &usize, b: &usize| all[*a].length.total_cmp(&all[*b].length);
    let least = (0..all.len()).min_by(by_length)?;
    let most = (0..all.len()).max_by(by_length)?;
    let ends = [places[least], places[most]];
    let ones = vec![1.0; all.len()];
    let mean = all.iter().map(|l| l.length).sum::<f64>() / all.len() as f64;
    let same = line(&all, std::slice::from_ref(&ones));
    let differ =
        all[most].length - all[least].length > DIFFER && same.as_ref().is_some_and(|l| !l.fits(level));
    if !differ && (mean - 1.0).abs() <= ALIKE {
        return None;
    }
    // causes in one axis, alone or beside a common one
    let explain = |offset: bool| -> Vec<(f64, ForceCause)> {
        let before = same.as_ref().map_or(0.0, |l| if offset { l.left } else { rms(&all) });
        let mut found = Vec::new();
        for error in [ForceError::Scale, ForceError::Zero] {
            for axis in 0..3 {
                let of = |l: &Length| match error {
                    ForceError::Scale => l.force[axis].powi(2),
                    ForceError::Zero => 2.0 * l.force[axis],
                };
                let own: Vec<f64> = all.iter().map(of).collect();
                let columns = if offset { vec![ones.clone(), own] } else { vec![own] };
                let Some(line) = line(&all, &columns) else { continue };
                if line.fits(level) || line.left <= PART * before {
                    found.extend(line.cause(error, axis, offset).map(|cause| (line.left, cause)));
                }
            }
        }
        let best = found.iter().map(|f| f.0).fold(f64::INFINITY, f64::min);
        let noise = all.iter().map(|l| 2.0 * l.sigma).fold(0.0, f64::max);
        found.retain(|f| f.0 <= WORSE * best.max(noise));
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    };
    let mut found = explain(false);
    if found.is_empty() && differ {
        found = explain(true);
    }
    Some(Wrong { ends, alike: !differ, causes: found.into_iter().map(|f| f.1).collect() })
}

/// Root of the mean square of `|f|^2 - 1`, in g^2.
fn rms(all: &[Length]) -> f64 {
    let squares: f64 = all.iter().map(|l| (l.length.powi(2) - 1.0).powi(2)).sum();
    (squares / all.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lengths for given directions, computed from scale errors and zeros of the outputs.
    fn lengths(scale: [f64; 3], zero: [f64; 3], directions: &[[f64; 3]]) -> Vec<Option<Length>> {
        let of = |d: &[f64; 3]| {
            let n = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            let force: [f64; 3] = std::array::from_fn(|i| d[i] / n * (1.0 + scale[i]) + zero[i]);
            let length = force.iter().map(|x| x * x).sum::<f64>().sqrt();
            Some(Length { length, sigma: 1e-6, force })
        };
        directions.iter().map(of).collect()
    }

    fn found(of: &[Option<Length>]) -> Option<Wrong> {
        wrong(of, 5e-4)
    }

    const SIX: [[f64; 3]; 6] = [
        [1.0, 2.0, 3.0],
        [-2.0, 1.0, 0.5],
        [0.3, -1.0, 2.0],
        [1.5, 0.2, -0.7],
        [-0.4, 3.0, 0.1],
        [0.9, -0.8, -1.1],
    ];

    #[test]
    fn wrong_lengths_are_reported() {
        assert_eq!(found(&lengths([0.0; 3], [0.0; 3], &SIX)), None);
        // gravity by a tenth of what is doubted, and four times it
        assert_eq!(found(&lengths([3e-5; 3], [0.0; 3], &SIX)), None);
        let all = found(&lengths([1.2e-3; 3], [0.0; 3], &SIX)).expect("wrong");
        assert!(all.alike && all.causes.is_empty(), "{all:?}");
        for axis in 0..3 {
            let (mut scale, mut zero) = ([0.0; 3], [0.0; 3]);
            (scale[axis], zero[axis]) = (5e-4, -5e-4);
            for (found, error, by) in [
                (found(&lengths(scale, [0.0; 3], &SIX)), ForceError::Scale, 5e-4),
                (found(&lengths([0.0; 3], zero, &SIX)), ForceError::Zero, -5e-4),
            ] {
                let found = found.expect("wrong");
                let [cause] = &found.causes[..] else { panic!("{found:?}") };
                assert_eq!((cause.error, cause.axis.as_str(), found.alike), (error, AXES[axis], false));
                assert!((cause.by / by - 1.0).abs() < 1e-2 && cause.besides.is_none(), "{cause:?}");
            }
        }
        // one axis beside another gravity
        let both = found(&lengths([2e-3, 1e-3, 1e-3], [0.0; 3], &SIX)).expect("wrong");
        let [cause] = &both.causes[..] else { panic!("{both:?}") };
        assert_eq!((cause.error, cause.axis.as_str()), (ForceError::Scale, "fx"));
        assert!((cause.by / 1e-3 - 1.0).abs() < 1e-2, "{cause:?}");
        assert!((cause.besides.expect("there") / 1e-3 - 1.0).abs() < 1e-2, "{cause:?}");
        // two axes are none
        let two = found(&lengths([5e-4, -4e-4, 0.0], [0.0; 3], &SIX)).expect("wrong");
        assert!(!two.alike && two.causes.is_empty() && two.ends == [4, 3], "{two:?}");
    }

    /// If y is vertical throughout, its scale explains the lengths as well as a common one.
    #[test]
    fn an_ambiguous_cause_stays_ambiguous() {
        let two = found(&lengths([0.0, 5e-4, 0.0], [0.0; 3], &[[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]));
        let two = two.expect("wrong");
        let [cause] = &two.causes[..] else { panic!("{two:?}") };
        assert_eq!((two.alike, cause.error, cause.axis.as_str()), (true, ForceError::Scale, "fy"));
        // a zero of y makes one longer and one shorter
        let two = found(&lengths([0.0; 3], [0.0, 5e-4, 0.0], &[[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]));
        let two = two.expect("wrong");
        assert_eq!((two.alike, two.causes.len()), (false, 1), "{two:?}");
        assert_eq!(two.causes[0].error, ForceError::Zero);
    }
}

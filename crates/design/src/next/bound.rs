//! Bound over all attitudes on what one more position gives after a calibration.
//!
//! In n the run of this position tells of its drift `d = C E(g) D` (g in c) with an information M (3 x 3)
//! that is the same at every attitude: psi' = psi x w + d, psi at the start is unknown, Z is measured. Random
//! drift and unknown errors of the accelerometers only reduce M; all coefficients beside first-order drift
//! count as known, which only reduces sigmas. With the information L of the calibration on D, the variance of
//! the coefficient i at an attitude is, with any vector x,
//!
//! `e_i^T (L + E^T C^T M C E)^-1 e_i >= x_i^2 / (x^T L x + |M^(1/2) d_x|^2)`, `d_x = C E(g) x`.
//!
//! Attitudes run over cells of the rotations. In a cell up to the angle r from its middle, the change of
//! `d_x = C (u + G g)` is that of first order and at most `r^2/2 (|u| + 4 |G|)` more. The x of a cell is that
//! of equality at its middle with an information enlarged for the size of the cell. Cells that cannot be
//! better than the best attitude found so far are done; the others are divided, the most promising first.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Matrix6, Quaternion, UnitQuaternion, Vector3};
use obsdeg_core::model::{AZIMUTH, ErrorSource, Float, Platform};
use obsdeg_evidence::requirements::Worst;
use obsdeg_evidence::simulation::{Attained, Conditions, KnownCovariance, Plan, si_per_shown};

use super::answer::AttitudeBound;

/// Divisions of the edge of each of the four cubes that cover the rotations, at first.
const FIRST: usize = 4;
/// Largest numbers of cells that are examined: for all coefficients together, and for one.
const MOST: [usize; 2] = [100_000, 6_000];
/// Relative gap of the bound to the best attitude at which the search ends.
const CLOSE: f64 = 0.02;

/// Half the factor of |G| in the remainder of second order.
const REST: f64 = 2.0;

/// Problem in SI units: information of the calibration, and that of a dwell on its drift.
struct BoundProblem {
    before: DMatrix<f64>,
    /// Drift in c at zero g (3 x n), and its derivatives by the components of g.
    steady: Matrix3xX<f64>,
    by_gravity: [Matrix3xX<f64>; 3],
    /// Root of the information of the dwell on its drift in n, and its largest singular value.
    root: Matrix3<f64>,
    most: f64,
    /// Coefficients that count: index, and their limit (one where none are required).
    asked: Vec<(usize, f64)>,
}

/// Cell of rotations: its middle and half its edge in the coordinates of its cube, with the bound.
struct RotationCell {
    face: usize,
    middle: [f64; 3],
    half: f64,
    bound: f64,
}

impl PartialEq for RotationCell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for RotationCell {}
impl PartialOrd for RotationCell {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for RotationCell {
    /// The least bound is greatest, so that a heap returns it first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound.total_cmp(&self.bound).then_with(|| {
            (self.face, self.half).partial_cmp(&(other.face, other.half)).unwrap_or(Ordering::Equal)
        })
    }
}

/// Rotation at coordinates (each -1 to 1) of the cube `face` of unit quaternions.
fn rotation(face: usize, p: [f64; 3]) -> UnitQuaternion<f64> {
    let mut q = [1.0; 4];
    (0..3).for_each(|k| q[(face + 1 + k) % 4] = p[k]);
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

impl RotationCell {
    /// Middle of the cell, and the largest angle from it. A cap about the middle is convex in the coordinates
    /// of the cube (a central projection), so a corner is farthest.
    fn extent(&self) -> (UnitQuaternion<f64>, f64) {
        let middle = rotation(self.face, self.middle);
        let corner = |k: usize| {
            let at = |i: usize| self.middle[i] + if k >> i & 1 == 0 { -self.half } else { self.half };
            middle.angle_to(&rotation(self.face, [at(0), at(1), at(2)]))
        };
        (middle, (0..8).map(corner).fold(0.0, f64::max))
    }

    fn parts(&self) -> impl Iterator<Item = (usize, [f64; 3], f64)> + '_ {
        let half = self.half / 2.0;
        (0..8).map(move |k| {
            let at = |i: usize| self.middle[i] + if k >> i & 1 == 0 { -half } else { half };
            (self.face, [at(0), at(1), at(2)], half)
        })
    }
}

impl BoundProblem {
    /// Largest ratio of sigma to limit at an attitude and, for all attitudes within `angle` of it, a bound
    /// from below; the ratio is infinite where numbers fail.
    fn at(&self, c: &Matrix3<f64>, angle: f64) -> (f64, f64) {
        let g = c.transpose() * Vector3::new(0.0, -1.0, 0.0);
        let mut e = self.steady.clone();
        self.by_gravity.iter().zip(g.iter()).for_each(|(by, g)| e += by * *g);
        let seen = self.root * c * &e;
        let whole = &self.before + seen.transpose() * &seen;
        let Some(own) = whole.clone().cholesky() else { return (f64::INFINITY, 0.0) };
        // the largest ratios decide
        let n = self.before.nrows();
        let column = |i: usize| DVector::from_fn(n, |k, _| if k == i { 1.0 } else { 0.0 });
        let ratio = |&(i, limit): &(usize, f64)| own.solve(&column(i))[i].sqrt() / limit;
        let mut ratios: Vec<(f64, usize)> = self.asked.iter().map(ratio).zip(0..).collect();
        ratios.sort_by(|a, b| b.0.total_cmp(&a.0));
        let worst = ratios.first().map_or(0.0, |r| r.0);
        // change of what is seen by a turn about each axis of n, in first order
        let down = Vector3::new(0.0, -1.0, 0.0);
        let of_turn = |k: usize| {
            let axis = Vector3::ith(k, 1.0);
            let moved = c.transpose() * down.cross(&axis);
            let mut by = axis.cross_matrix() * c * &e;
            self.by_gravity.iter().zip(moved.iter()).for_each(|(of, g)| by += c * of * *g);
            self.root * by
        };
        let turns = [0, 1, 2].map(of_turn);
        let mut larger = whole;
        turns.iter().for_each(|by| larger += by.transpose() * by * angle.powi(2));
        let second = (REST * self.most * angle.powi(2)).powi(2);
        self.by_gravity.iter().for_each(|by| larger += by.transpose() * by * second);
        let Some(larger) = larger.cholesky() else { return (worst, 0.0) };
        let least = |&(_, k): &(f64, usize)| {
            let (i, limit) = self.asked[k];
            let x = larger.solve(&column(i));
            let norm =
                |all: &[Matrix3xX<f64>]| all.iter().map(|m| (m * &x).norm_squared()).sum::<f64>().sqrt();
            let rest =
                angle.powi(2) / 2.0 * ((&self.steady * &x).norm() + 2.0 * REST * norm(&self.by_gravity));
            let drift = (&seen * &x).norm() + angle * norm(&turns) + self.most * rest;
            let own = (x.transpose() * &self.before * &x)[0];
            x[i].abs() / (own + drift * drift).sqrt() / limit
        };
        (worst, ratios.iter().take(2).map(least).fold(0.0, f64::max))
    }

    /// Bound from below over all attitudes on the largest ratio of sigma to limit, by at most `most` cells.
    fn search(&self, most: usize) -> f64 {
        let mut cells = BinaryHeap::new();
        let mut best = f64::INFINITY;
        let mut count = 0;
        let examine = |(face, middle, half): (usize, [f64; 3], f64), best: &mut f64| {
            let mut cell = RotationCell { face, middle, half, bound: 0.0 };
            let (middle, angle) = cell.extent();
            let (worst, bound) = self.at(middle.to_rotation_matrix().matrix(), angle);
            *best = best.min(worst);
            cell.bound = bound;
            cell
        };
        let at = |k: usize| (2.0 * k as f64 + 1.0) / FIRST as f64 - 1.0;
        for k in 0..4 * FIRST.pow(3) {
            let middle = [k % FIRST, k / FIRST % FIRST, k / FIRST.pow(2) % FIRST].map(at);
            cells.push(examine((k / FIRST.pow(3), middle, 1.0 / FIRST as f64), &mut best));
            count += 1;
        }
        // the least bound of all cells that are left
        while let Some(cell) = cells.pop() {
            if cell.bound >= best * (1.0 - CLOSE) || count >= most {
                return cell.bound.min(best);
            }
            for part in cell.parts() {
                let mut part = examine(part, &mut best);
                part.bound = part.bound.max(cell.bound);
                cells.push(part);
                count += 1;
            }
        }
        best
    }
}

/// Information of a dwell on its drift in n (3 x 3), per (rad/s)^2. The attitude error at the start has the
/// standard deviation `psi` in rad.
fn information(plan: &Plan, conditions: &Conditions, psi: f64) -> Option<Matrix3<f64>> {
    let [segment] = &plan.segments[..] else { return None };
    let [w_n, w_u, _] = plan.earth_rate();
    // psi' = psi x w + d
    let w = Vector3::new(w_n, w_u, 0.0);
    let mut dynamics = Matrix6::zeros();
    dynamics.fixed_view_mut::<3, 3>(0, 0).copy_from(&-w.cross_matrix());
    dynamics.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
    let step = (dynamics * segment.dt).exp();
    let mut whole = Matrix6::zeros();
    let mut transition = Matrix6::identity();
    for _ in 0..segment.steps {
        transition = step * transition;
        for &component in &plan.components {
            // Z1 = psi_E, Z3 = -psi_N, in g; Z2 has no psi
            let state = match component {
                1 => 2,
                3 => 0,
                AZIMUTH => 1,
                _ => continue,
            };
            let row = transition.row(state);
            whole += row.transpose() * row / Plan::output_sigma(component, conditions).powi(2);
        }
    }
    let part = |i: usize, j: usize| whole.fixed_view::<3, 3>(i, j).into_owned();
    let start = part(0, 0) + Matrix3::identity() / (psi * psi);
    let left = part(3, 3) - part(3, 0) * start.cholesky()?.solve(&part(0, 3));
    Some((left + left.transpose()) / 2.0)
}

/// Drift in c (3 x n) of the coefficients `drift`, at zero g, and its derivatives by the components of g.
fn drift_by_gravity(platform: &Platform, drift: &[usize]) -> (Matrix3xX<f64>, [Matrix3xX<f64>; 3]) {
    let at = |axis: usize, sign: f64| {
        // any attitude with this g in c
        let up = -Vector3::ith(axis, sign);
        let north = Vector3::ith((axis + 1) % 3, 1.0);
        let c = Matrix3::from_rows(&[north.transpose(), up.transpose(), north.cross(&up).transpose()]);
        let rows = platform.errors().drift_rows(&Float, &c.transpose().data.0, || [0.0; 3]);
        c.transpose() * Matrix3xX::from_fn(drift.len(), |i, j| rows[i][drift[j]])
    };
    let ends = [0, 1, 2].map(|axis| [at(axis, 1.0), at(axis, -1.0)]);
    let steady = (&ends[0][0] + &ends[0][1]) / 2.0;
    (steady, ends.map(|[plus, minus]| (plus - minus) / 2.0))
}

/// Bound on one more position after `known`, for the required coefficients; `attained` is that with any one
/// position, `limit` the requirement of a column in the unit of its coefficient. `None` if the calibration
/// leaves a coefficient of the drift open, or none is required.
pub(super) fn bound(
    attained: &Attained,
    known: &KnownCovariance,
    conditions: &Conditions,
    required: &[String],
    limit: impl Fn(usize) -> Option<f64>,
) -> Option<AttitudeBound> {
    let (platform, plan) = (&attained.plan.platform, &attained.plan);
    let (names, units) = (platform.names(), platform.units());
    let first = names.len() - platform.coefficients();
    let terms = platform.error_terms();
    let steady = |&k: &usize| terms[k].source == ErrorSource::Gravity && terms[k].factors.len() <= 1;
    let drift: Vec<usize> = (0..terms.len()).filter(steady).collect();
    if !drift.iter().all(|&k| known.sigma(&names[first + k]).is_some()) {
        return None;
    }
    let rows = known.rows(plan, &attained.prediction).ok()?;
    let all = rows.transpose() * rows;
    let n = drift.len();
    let before = DMatrix::from_fn(n, n, |i, j| all[(first + drift[i], first + drift[j])]);
    let of = |i: usize| first + drift[i];
    let asked: Vec<usize> = (0..n).filter(|&i| required.contains(&names[of(i)])).collect();
    let psi = attained.priors()[..first].iter().copied().fold(f64::INFINITY, f64::min);
    let information = information(plan, conditions, psi)?;
    let eigen = information.symmetric_eigen();
    let roots = eigen.eigenvalues.map(|x| x.max(0.0).sqrt());
    let (steady, by_gravity) = drift_by_gravity(platform, &drift);
    let mut dwell = BoundProblem {
        before,
        steady,
        by_gravity,
        root: Matrix3::from_diagonal(&roots) * eigen.eigenvectors.transpose(),
        most: roots.max(),
        asked: Vec::new(),
    };
    let scale = |i: usize| si_per_shown(units[of(i)]);
    let mut over = |asked: Vec<(usize, f64)>, most: usize| -> Option<f64> {
        dwell.asked = asked;
        (!dwell.asked.is_empty()).then(|| dwell.search(most))
    };
    let limits: Vec<(usize, f64)> =
        asked.iter().filter_map(|&i| Some((i, limit(of(i))? * scale(i)))).collect();
    let sigmas = asked.iter().filter_map(|&i| {
        let sigma_dph = over(vec![(i, scale(i))], MOST[1])?;
        Some(Worst { name: names[of(i)].clone(), sigma_dph })
    });
    let sigmas: Vec<Worst> = sigmas.collect();
    let ratio = over(limits, MOST[0]);
    let worst_dph = match ratio {
        Some(_) => None,
        None => Some(over(asked.iter().map(|&i| (i, scale(i))).collect(), MOST[0])?),
    };
    Some(AttitudeBound { sigmas, ratio, worst_dph })
}

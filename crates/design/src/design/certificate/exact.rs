//! Certificates recomputed in balls of 512 bits, for tests: independent arithmetic, by elimination.

use nalgebra::DMatrix;
use obsdeg_core::model::{Angle, Euler, LOCAL, Ring, earth_rate_in, elementary, product};
use obsdeg_exact::Ball;

use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::stop::Stop;

pub(super) type BallReal = Ball<8>;

pub(super) fn real(x: f64) -> BallReal {
    BallReal::from_f64(x)
}

/// Ring of balls of 512 bits.
pub(super) struct BallRing;

impl Ring for BallRing {
    type Element = BallReal;
    fn zero(&self) -> BallReal {
        BallReal::ZERO
    }
    fn one(&self) -> BallReal {
        real(1.0)
    }
    fn add(&self, a: &BallReal, b: &BallReal) -> BallReal {
        a.add(b)
    }
    fn mul(&self, a: &BallReal, b: &BallReal) -> BallReal {
        a.mul(b)
    }
    fn neg(&self, a: &BallReal) -> BallReal {
        a.neg()
    }
    fn is_zero(&self, a: &BallReal) -> bool {
        a.is_exactly_zero()
    }
}

pub(super) fn square_root(x: &BallReal) -> f64 {
    x.sqrt().expect("not negative").to_f64()
}

/// Effects of the coefficients on drift and accelerometers at the attitude `euler`.
pub(super) fn effects_of(evaluator: &Evaluator, euler: &Euler) -> Vec<Vec<BallReal>> {
    #[derive(Clone, Copy)]
    struct Scaled(BallReal);
    impl std::ops::Mul<f64> for Scaled {
        type Output = Self;
        fn mul(self, factor: f64) -> Self {
            Self(self.0.mul(&real(factor)))
        }
    }
    let half = BallReal::from_i64(180_000_000_000);
    let turn = |axis: usize| {
        let angle: &Angle = &euler[axis];
        let radians = BallReal::from_i64(angle.nanodeg()).mul(&BallReal::pi()).div(&half).expect("not zero");
        let (sin, cos) = radians.sin_cos().expect("small");
        elementary(&BallRing, axis, &(cos, sin))
    };
    let c = product(&BallRing, &product(&BallRing, &turn(0), &turn(1)), &turn(2));
    let [w_u, w_n] = [evaluator.w[1][2], -evaluator.w[0][2]].map(real);
    let errors = evaluator.platform.errors();
    let mut rows: Vec<Vec<BallReal>> =
        errors.drift_rows(&BallRing, &c, || earth_rate_in(&BallRing, &c, &w_n, &w_u)).into();
    if evaluator.platform.observed().accelerometers {
        rows.extend(errors.accelerometer_rows(&BallRing, &c));
    }
    let ordered = |row: Vec<BallReal>| {
        let row: Vec<Scaled> = row.into_iter().map(Scaled).collect();
        evaluator.in_order(&row).into_iter().map(|x| x.0).collect()
    };
    rows.into_iter().map(ordered).collect()
}

/// Contribution `d` of an attitude with the effects `rows`, with `g` for G.
pub(super) fn energy_of(
    rows: &[Vec<BallReal>],
    g: &[[f64; LOCAL - 3]; LOCAL - 3],
    x: &DMatrix<f64>,
) -> BallReal {
    let mut sum = BallReal::ZERO;
    for column in x.column_iter() {
        let x: Vec<BallReal> = column.iter().copied().map(real).collect();
        let y: Vec<BallReal> = rows.iter().map(|row| BallRing.dot(row.iter().zip(&x))).collect();
        for (a, row) in y.iter().zip(g) {
            for (b, g) in y.iter().zip(row) {
                sum = sum.add(&a.mul(b).mul(&real(*g)));
            }
        }
    }
    sum
}

type RealMatrix = Vec<Vec<BallReal>>;

/// Information of a scheme on the coefficients, the sum over its positions, and its inverse.
pub(super) struct ExactInformation {
    /// Inverse of the information (m x m).
    inverse: RealMatrix,
    nuisance: usize,
    dph: f64,
}

impl ExactInformation {
    pub(super) fn of(evaluator: &Evaluator, sequence: &[Stop]) -> Self {
        let (n, m) = (evaluator.n, evaluator.n - 3);
        let start = evaluator.start().information;
        let entry = |i: usize, j: usize| {
            let place = (3 + i.max(j)) * n + 3 + i.min(j);
            let own = sequence.iter().map(|s| real(evaluator.candidates[s.candidate].own[place]));
            own.fold(real(start[place]), |sum, x| sum.add(&x))
        };
        let information: RealMatrix = (0..m).map(|i| (0..m).map(|j| entry(i, j)).collect()).collect();
        Self { inverse: inverted(information), nuisance: evaluator.nuisance, dph: evaluator.dph }
    }

    fn counting(&self) -> std::ops::Range<usize> {
        self.nuisance..self.inverse.len()
    }

    /// Square of a criterion, for all criteria except E.
    pub(super) fn squared(
        &self,
        criterion: &Criterion,
        evaluator: &Evaluator,
        sequence: &[Stop],
    ) -> BallReal {
        let unit = real(self.dph).mul(&real(self.dph)).inverse().expect("not zero");
        let d = self.counting().len();
        let variances: Vec<BallReal> = self.counting().map(|j| self.inverse[j][j].mul(&unit)).collect();
        let largest = |list: Vec<BallReal>| {
            list.into_iter().fold(BallReal::ZERO, |a, b| if b.sub(&a).is_positive() { b } else { a })
        };
        match criterion {
            Criterion::A => {
                let sum = variances.iter().fold(BallReal::ZERO, |sum, v| sum.add(v));
                sum.div(&BallReal::from_i64(d as i64)).expect("some")
            }
            Criterion::D => {
                // the determinant of the block, by elimination
                let block: RealMatrix = self
                    .counting()
                    .map(|i| self.counting().map(|j| self.inverse[i][j].mul(&unit)).collect())
                    .collect();
                let logs = pivots(block).into_iter().map(|p| p.ln().expect("positive"));
                let sum = logs.fold(BallReal::ZERO, |sum, x| sum.add(&x));
                sum.div(&BallReal::from_i64(d as i64)).expect("some").exp().expect("finite")
            }
            Criterion::Margin(limits) => {
                let over =
                    |(v, limit): (&BallReal, &f64)| v.div(&real(*limit).mul(&real(*limit))).expect("a limit");
                let mut all: Vec<BallReal> = variances.iter().zip(&limits.coefficients).map(over).collect();
                let to_degrees = real(180.0).div(&BallReal::pi()).expect("not zero");
                for stop in sequence {
                    let own = evaluator.own_psi(stop.candidate);
                    for k in (0..3).filter(|&k| limits.psi[k].is_finite()) {
                        let moved: Vec<BallReal> = own.moved.iter().map(|x| real(x[k])).collect();
                        let dot = |row: &Vec<BallReal>| BallRing.dot(row.iter().zip(&moved));
                        let through: Vec<BallReal> = self.inverse.iter().map(dot).collect();
                        let variance = real(own.variances[k]).add(&BallRing.dot(through.iter().zip(&moved)));
                        let unit = to_degrees.div(&real(limits.psi[k])).expect("a limit");
                        all.push(variance.mul(&unit).mul(&unit));
                    }
                }
                largest(all)
            }
            _ => largest(variances),
        }
    }

    /// True if all principal sigmas of the coefficients that count are below `sigma`.
    pub(super) fn covariance_is_below(&self, sigma: f64) -> bool {
        let limit = real(sigma).mul(&real(self.dph));
        let limit = limit.mul(&limit);
        let left = |i: usize, j: usize| {
            let own = if i == j { limit } else { BallReal::ZERO };
            own.sub(&self.inverse[i][j])
        };
        let left = self.counting().map(|i| self.counting().map(|j| left(i, j)).collect()).collect();
        pivots(left).iter().all(BallReal::is_positive)
    }
}

/// Pivots of a symmetric matrix, by elimination from the first on.
fn pivots(mut a: RealMatrix) -> Vec<BallReal> {
    let n = a.len();
    for p in 0..n {
        let row = a[p].clone();
        let Some(inverse) = row[p].inverse() else { break };
        for below in &mut a[p + 1..] {
            let factor = below[p].mul(&inverse);
            below.iter_mut().zip(&row).for_each(|(x, y)| *x = x.sub(&factor.mul(y)));
        }
    }
    (0..n).map(|i| a[i][i]).collect()
}

/// Inverse of a positive matrix, by Gauss and Jordan.
fn inverted(mut a: RealMatrix) -> RealMatrix {
    let n = a.len();
    let mut out: RealMatrix =
        (0..n).map(|i| (0..n).map(|j| real(f64::from(u8::from(i == j)))).collect()).collect();
    for p in 0..n {
        let inverse = a[p][p].inverse().expect("not singular");
        for x in a[p].iter_mut().chain(&mut out[p]) {
            *x = x.mul(&inverse);
        }
        for i in (0..n).filter(|&i| i != p) {
            let factor = a[i][p];
            for of in [&mut a, &mut out] {
                let row = of[p].clone();
                of[i].iter_mut().zip(&row).for_each(|(x, y)| *x = x.sub(&factor.mul(y)));
            }
        }
    }
    out
}

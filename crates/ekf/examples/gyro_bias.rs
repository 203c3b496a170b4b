//! Bias of three gyros from sightings of two stars: the attitude is a quaternion, its error a rotation
//! vector.
#![allow(clippy::print_stdout, reason = "an example shows what it finds")]

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3, dvector};
use obsdeg_ekf::{
    CovarianceForm, EkfError, Filter, Manifold, Measurement, Motion, ProcessNoise, Transition, Update,
};

/// Attitude (body to inertial axes) and bias of the gyros in rad/s.
#[derive(Clone)]
struct Body {
    attitude: UnitQuaternion<f64>,
    bias: Vector3<f64>,
}

impl Manifold for Body {
    fn dimension(&self) -> usize {
        6
    }
    fn retract(&mut self, d: &[f64]) {
        self.attitude = UnitQuaternion::from_scaled_axis(Vector3::new(d[0], d[1], d[2])) * self.attitude;
        self.bias += Vector3::new(d[3], d[4], d[5]);
    }
    fn local(&self, from: &Self) -> Vec<f64> {
        let turn = (self.attitude * from.attitude.inverse()).scaled_axis();
        turn.iter().chain((self.bias - from.bias).iter()).copied().collect()
    }
    /// Correct to first order in the correction, which is small after every update.
    fn transport(&self, d: &[f64]) -> Option<Transition> {
        let mut out = DMatrix::identity(6, 6);
        let half = Vector3::new(d[0], d[1], d[2]).cross_matrix() * 0.5;
        out.view_mut((0, 0), (3, 3)).iter_mut().zip(half.iter()).for_each(|(x, h)| *x += h);
        Transition::new(&out).ok()
    }
    fn is_finite(&self) -> bool {
        self.attitude.coords.iter().chain(self.bias.iter()).all(|x| x.is_finite())
    }
}

/// One reading of the gyros in rad/s.
struct GyroReading(Vector3<f64>);

impl Motion<Body> for GyroReading {
    fn advance(
        &self,
        _: f64,
        dt: f64,
        x: &mut Body,
    ) -> Result<(Transition, Cow<'_, ProcessNoise>), EkfError> {
        let turned = (self.0 - x.bias) * dt;
        x.attitude *= UnitQuaternion::from_scaled_axis(turned);
        let mut phi = DMatrix::identity(6, 6);
        // the turn of a step is small
        phi.view_mut((0, 3), (3, 3)).copy_from(&(x.attitude.to_rotation_matrix().matrix() * -dt));
        Ok((Transition::new(&phi)?, Cow::Owned(ProcessNoise::none())))
    }
}

/// Two stars, seen in body axes.
struct Stars;

impl Measurement<Body> for Stars {
    fn outputs(&self) -> usize {
        6
    }
    fn h(&self, _: f64, x: &Body) -> DVector<f64> {
        let body = x.attitude.inverse();
        DVector::from_iterator(6, [Vector3::x(), Vector3::z()].iter().flat_map(|s| (body * s).data.0[0]))
    }
    fn jacobian(&self, _: f64, x: &Body) -> DMatrix<f64> {
        let body = x.attitude.inverse().to_rotation_matrix();
        let mut out = DMatrix::zeros(6, 6);
        for (i, s) in [Vector3::x(), Vector3::z()].iter().enumerate() {
            out.view_mut((3 * i, 0), (3, 3)).copy_from(&(body.matrix() * s.cross_matrix()));
        }
        out
    }
    fn noise(&self, _: f64) -> DMatrix<f64> {
        DMatrix::identity(6, 6) * 1e-8
    }
}

fn main() -> Result<(), EkfError> {
    let bias = Vector3::new(2e-4, -1e-4, 3e-4);
    let mut truth = UnitQuaternion::from_euler_angles(0.5, -0.2, 1.0);
    let start = Body { attitude: UnitQuaternion::from_euler_angles(0.4, 0.0, 1.1), bias: Vector3::zeros() };
    let p0 = DMatrix::from_diagonal(&dvector![0.1, 0.1, 0.1, 1e-6, 1e-6, 1e-6]);
    let mut filter = Filter::new(start, &p0, CovarianceForm::Ud)?;
    for k in 0..600 {
        let t = 0.1 * f64::from(k);
        let rate = Vector3::new(0.02, 0.03 * (0.2 * t).sin(), -0.01);
        truth *= UnitQuaternion::from_scaled_axis(rate * 0.1);
        filter.advance(&GyroReading(rate + bias), t, 0.1)?;
        // the second star is behind a cloud for a while
        let seen = Stars.h(t, &Body { attitude: truth, bias });
        let z: Vec<Option<f64>> = (0..6).map(|i| Some(seen[i]).filter(|_| i < 3 || k > 300)).collect();
        filter.update_with(&Stars, t, &z, &Update::iterated(5))?;
    }
    for (axis, (x, b)) in ["x", "y", "z"].iter().zip(filter.x().bias.iter().zip(bias.iter())) {
        println!("bias {axis}: {:+.3e} rad/s, true {:+.3e}", x, b);
    }
    let sigmas = filter.covariance().sigmas();
    println!("sigma {:.1e} {:.1e} {:.1e} rad/s", sigmas[3], sigmas[4], sigmas[5]);
    Ok(())
}

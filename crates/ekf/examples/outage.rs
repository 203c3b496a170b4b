//! Position measured every second except in an outage: the filter's estimates, and the smoothed
//! estimates from all data.
#![allow(clippy::print_stdout, reason = "an example shows what it finds")]

use nalgebra::{DMatrix, DVector, dmatrix, dvector};
use obsdeg_ekf::integrate::van_loan;
use obsdeg_ekf::{CovarianceForm, EkfError, Filter, FixedInterval, Measurement, ProcessNoise, Transition};

/// Measurement of the position of x = (position, velocity).
struct PositionMeasurement;

impl Measurement for PositionMeasurement {
    fn outputs(&self) -> usize {
        1
    }
    fn h(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
        dvector![x[0]]
    }
    fn jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> {
        dmatrix![1.0, 0.0]
    }
    fn noise(&self, _: f64) -> DMatrix<f64> {
        dmatrix![0.01]
    }
}

fn main() -> Result<(), EkfError> {
    let (phi, q) = van_loan(&dmatrix![0.0, 1.0; 0.0, 0.0], &dmatrix![0.0, 0.0; 0.0, 1e-4], 1.0)?;
    let (step, noise) = (Transition::new(&phi)?, ProcessNoise::new(&q)?);
    let mut filter = Filter::new(dvector![0.0, 0.0], &dmatrix![1.0, 0.0; 0.0, 1.0], CovarianceForm::Joseph)?;
    let mut interval = FixedInterval::new(&filter);
    let mut at_the_time = vec![1.0];
    for t in 1..=40 {
        filter.jump(&phi * filter.x(), &step, &noise)?;
        interval.predicted(&filter, step.clone());
        if !(15..=25).contains(&t) {
            filter.update(&PositionMeasurement, f64::from(t), &dvector![0.2 * f64::from(t)])?;
            interval.updated(&filter);
        }
        at_the_time.push(filter.covariance().sigmas()[0]);
    }
    println!("  t  sigma then  sigma afterwards");
    for (t, (then, after)) in at_the_time.iter().zip(interval.smooth()?).enumerate().step_by(5) {
        println!("{t:3}  {then:10.4}  {:16.4}", after.p[(0, 0)].sqrt());
    }
    Ok(())
}

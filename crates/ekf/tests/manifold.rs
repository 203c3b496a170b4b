//! States that are no vectors, iterated updates, gates, gaps and jumps, and the smoother, each compared
//! with an independent computation.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, UnitQuaternion, Vector3, dmatrix, dvector};
use obsdeg_ekf::consistency::{Nees, chi_square_band};
use obsdeg_ekf::linear::{covariance_pass, filter_pass, smoothed_start, state_pass};
use obsdeg_ekf::{
    Covariance, CovarianceForm, EkfError, Filter, FixedInterval, Gain, Manifold, Measurement, Motion,
    ProcessNoise, ScalarOutput, Stage, Transition, Update,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// Attitude and the bias of three gyros.
#[derive(Debug, Clone)]
struct Attitude {
    q: UnitQuaternion<f64>,
    bias: Vector3<f64>,
}

/// `integral of exp(s [v x])` by a long series.
fn left_jacobian(v: &Vector3<f64>) -> Matrix3<f64> {
    let k = v.cross_matrix();
    let (mut term, mut sum) = (Matrix3::identity(), Matrix3::identity());
    for i in 1..30 {
        term = term * k / f64::from(i + 1);
        sum += term;
    }
    sum
}

impl Manifold for Attitude {
    fn dimension(&self) -> usize {
        6
    }
    fn retract(&mut self, d: &[f64]) {
        self.q = UnitQuaternion::from_scaled_axis(Vector3::new(d[0], d[1], d[2])) * self.q;
        self.bias += Vector3::new(d[3], d[4], d[5]);
    }
    fn local(&self, from: &Self) -> Vec<f64> {
        let (turn, bias) = ((self.q * from.q.inverse()).scaled_axis(), self.bias - from.bias);
        turn.iter().chain(bias.iter()).copied().collect()
    }
    fn transport(&self, d: &[f64]) -> Option<Transition> {
        let mut out = DMatrix::identity(6, 6);
        out.view_mut((0, 0), (3, 3)).copy_from(&left_jacobian(&Vector3::new(d[0], d[1], d[2])));
        Transition::new(&out).ok()
    }
    fn is_finite(&self) -> bool {
        self.q.coords.iter().chain(self.bias.iter()).all(|x| x.is_finite())
    }
}

/// Gyros that read `rate + bias + noise` in body axes, over one step.
struct Gyros {
    reading: Vector3<f64>,
    noise: ProcessNoise,
}

impl Motion<Attitude> for Gyros {
    fn advance(
        &self,
        _: f64,
        dt: f64,
        x: &mut Attitude,
    ) -> Result<(Transition, Cow<'_, ProcessNoise>), EkfError> {
        let turned = (self.reading - x.bias) * dt;
        // an error of the bias turns by J(turned), in body axes at the start
        let by_bias = -(x.q.to_rotation_matrix().matrix() * left_jacobian(&turned) * dt);
        x.q *= UnitQuaternion::from_scaled_axis(turned);
        let mut phi = DMatrix::identity(6, 6);
        phi.view_mut((0, 3), (3, 3)).copy_from(&by_bias);
        Ok((Transition::new(&phi)?, Cow::Borrowed(&self.noise)))
    }
}

/// Sighting of two directions in body axes.
struct Stars;

const STARS: [[f64; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]];

impl Measurement<Attitude> for Stars {
    fn outputs(&self) -> usize {
        6
    }
    fn h(&self, _: f64, x: &Attitude) -> DVector<f64> {
        let seen = STARS.iter().flat_map(|s| (x.q.inverse() * Vector3::from(*s)).data.0[0]);
        DVector::from_iterator(6, seen)
    }
    fn jacobian(&self, _: f64, x: &Attitude) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(6, 6);
        for (i, s) in STARS.iter().enumerate() {
            let row = x.q.inverse().to_rotation_matrix().matrix() * Vector3::from(*s).cross_matrix();
            out.view_mut((3 * i, 0), (3, 3)).copy_from(&row);
        }
        out
    }
    fn noise(&self, _: f64) -> DMatrix<f64> {
        DMatrix::identity(6, 6) * 1e-4
    }
}

/// Errors of half a radian at the start: the filter that folds them into the attitude is consistent.
#[test]
fn an_attitude_filter_is_consistent() {
    let (runs, steps, dt) = (200, 40, 0.1);
    let p0 = DMatrix::from_diagonal(&dvector![0.09, 0.09, 0.09, 0.01, 0.01, 0.01]);
    let q = 1e-3f64;
    let noise =
        ProcessNoise::new(&DMatrix::from_diagonal(&dvector![q * q, q * q, q * q, 0.0, 0.0, 0.0])).expect("Q");
    let (mut nees, mut nis) = (0.0, 0.0);
    for run in 0..runs {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(run);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let start = Attitude { q: UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0), bias: Vector3::zeros() };
        let mut truth = start.clone();
        truth.retract(&[
            0.3 * normal(),
            0.3 * normal(),
            0.3 * normal(),
            0.1 * normal(),
            0.1 * normal(),
            0.1 * normal(),
        ]);
        let mut filter = Filter::new(start, &p0, CovarianceForm::Ud).expect("valid");
        for k in 0..steps {
            let t = dt * f64::from(k);
            let rate = Vector3::new(t.sin(), (0.7 * t).cos(), 0.4);
            let gyros = Gyros { reading: rate + truth.bias, noise: noise.clone() };
            truth.q *= UnitQuaternion::from_scaled_axis(rate * dt);
            truth.retract(&[q * normal(), q * normal(), q * normal(), 0.0, 0.0, 0.0]);
            filter.advance(&gyros, t, dt).expect("finite");
            let z = Stars.h(t, &truth).map(|h| h + 0.01 * normal());
            let z: Vec<Option<f64>> = z.iter().copied().map(Some).collect();
            let seen = filter.update_with(&Stars, t, &z, &Update::iterated(5)).expect("finite");
            // at the first measurement the nonlinearity of the directions exceeds their noise
            nis += if k > 0 { seen.nis() / f64::from(steps - 1) } else { 0.0 };
            assert!(seen.accepted && seen.iterations >= 2);
        }
        nees +=
            Nees::of_covariance(filter.covariance()).expect("P").of(&mut truth.local(filter.x())).expect("6");
    }
    let runs = runs as f64;
    let (low, high) = chi_square_band(6.0, runs, 0.999);
    assert!((low..high).contains(&(nees / runs)), "ANEES {}", nees / runs);
    let (low, high) = chi_square_band(6.0, runs * f64::from(steps - 1), 0.999);
    assert!((low..high).contains(&(nis / runs)), "NIS {}", nis / runs);
}

/// A reset is a change of coordinates: covariance of the rotation vector about the new attitude, by
/// differences.
#[test]
fn a_reset_carries_the_covariance() {
    let start = Attitude { q: UnitQuaternion::identity(), bias: Vector3::zeros() };
    let p0 = DMatrix::identity(6, 6) * 0.25;
    let mut filter = Filter::new(start.clone(), &p0, CovarianceForm::Joseph).expect("valid");
    let mut truth = start.clone();
    truth.retract(&[0.6, -0.4, 0.5, 0.0, 0.0, 0.0]);
    let z: Vec<Option<f64>> = Stars.h(0.0, &truth).iter().copied().map(Some).collect();
    filter.update_with(&Stars, 0.0, &z, &Update::iterated(20)).expect("finite");
    // the information in coordinates about the estimate: the prior's, by differences, and H^T H / r
    let estimate = filter.x().clone();
    let about = |d: &DVector<f64>| {
        let mut x = estimate.clone();
        x.retract(d.as_slice());
        DVector::from_vec(x.local(&start))
    };
    let j = obsdeg_ekf::model::central_difference(about, &DVector::zeros(6), &DVector::from_element(6, 1e-6));
    let h = Stars.jacobian(0.0, &estimate);
    let information = j.transpose() * p0.try_inverse().expect("P0") * &j + h.transpose() * h * 1e4;
    let expected = information.try_inverse().expect("regular");
    let found = filter.covariance().matrix();
    assert!((&found - &expected).amax() < 1e-4 * expected.amax(), "{found} {expected}");
    assert!((&found - &expected).view((0, 0), (3, 3)).amax() < 1e-3 * expected.view((0, 0), (3, 3)).amax());
}

/// Distance of a point in the plane from the origin.
struct Distance;

impl Measurement for Distance {
    fn outputs(&self) -> usize {
        1
    }
    fn h(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
        dvector![x.norm()]
    }
    fn jacobian(&self, _: f64, x: &DVector<f64>) -> DMatrix<f64> {
        DMatrix::from_row_slice(1, 2, (x / x.norm()).as_slice())
    }
    fn noise(&self, _: f64) -> DMatrix<f64> {
        dmatrix![1e-4]
    }
}

/// The iterated update ends at the most probable state, found by search; a single linearisation does not.
#[test]
fn iteration_finds_the_most_probable_state() {
    let (x0, p0) = (dvector![1.0, 0.2], dmatrix![0.04, 0.0; 0.0, 1.0]);
    let cost =
        |x: f64, y: f64| (x - 1.0).powi(2) / 0.04 + (y - 0.2).powi(2) + (x.hypot(y) - 1.6).powi(2) / 1e-4;
    // search on ever finer grids
    let (mut best, mut width) = ((1.0, 1.0), 1.0);
    for _ in 0..60 {
        let grid = (-10..=10).flat_map(|i| (-10..=10).map(move |j| (f64::from(i), f64::from(j))));
        let points = grid.map(|(i, j)| (best.0 + i * width / 10.0, best.1 + j * width / 10.0));
        best = points.min_by(|a, b| cost(a.0, a.1).total_cmp(&cost(b.0, b.1))).expect("points");
        width *= 0.7;
    }
    let updated = |how: &Update| {
        let mut filter = Filter::new(x0.clone(), &p0, CovarianceForm::Ud).expect("valid");
        let seen = filter.update_with(&Distance, 0.0, &[Some(1.6)], how).expect("finite");
        (filter.x().clone(), seen)
    };
    let (x, seen) = updated(&Update { iterations: 100, tolerance: 1e-9, ..Update::default() });
    assert!(seen.converged && seen.iterations > 3);
    assert!((x[0] - best.0).abs() < 1e-6 && (x[1] - best.1).abs() < 1e-6, "{x} {best:?}");
    let (x, seen) = updated(&Update::default());
    assert!(seen.iterations == 1 && (x[0] - best.0).abs() > 0.05);
    // too few iterations are reported
    assert!(!updated(&Update { iterations: 2, tolerance: 1e-9, ..Update::default() }).1.converged);
}

/// Measurement of two states with correlated noise.
struct Both;

impl Measurement for Both {
    fn outputs(&self) -> usize {
        2
    }
    fn h(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
        x.clone()
    }
    fn jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> {
        DMatrix::identity(2, 2)
    }
    fn noise(&self, _: f64) -> DMatrix<f64> {
        dmatrix![1.0, 0.5; 0.5, 2.0]
    }
}

#[test]
fn what_is_missing_or_gated_is_left_out() {
    let p0 = dmatrix![4.0, 1.0; 1.0, 3.0];
    let fresh = || Filter::new(dvector![0.0, 0.0], &p0, CovarianceForm::Joseph).expect("valid");
    // one component alone: K = P h^T / (p + r)
    let mut filter = fresh();
    let seen = filter.update_with(&Both, 0.0, &[None, Some(2.5)], &Update::default()).expect("valid");
    assert!((filter.x()[0] - 2.5 / 5.0).abs() < 1e-12 && (filter.x()[1] - 1.5).abs() < 1e-12);
    assert!(seen.whitened.len() == 1 && (seen.nis() - 2.5 * 2.5 / 5.0).abs() < 1e-12);
    // none at all
    let mut filter = fresh();
    let seen = filter.update_with(&Both, 0.0, &[None, None], &Update::default()).expect("valid");
    assert!(seen.accepted && seen.whitened.is_empty() && filter == fresh());
    // S = P + R = [5, 1.5; 1.5, 5]: NIS of (6, -6) is 72/3.5; the gate of two components at 0.999 is 13.8
    let gate = |confidence| Update { gate: Some(confidence), ..Update::default() };
    let mut filter = fresh();
    let z = [Some(6.0), Some(-6.0)];
    let seen = filter.update_with(&Both, 0.0, &z, &gate(0.999)).expect("valid");
    assert!(!seen.accepted && (seen.nis() - 72.0 / 3.5).abs() < 1e-9 && filter == fresh());
    assert!(fresh().update_with(&Both, 0.0, &z, &gate(1.0 - 1e-6)).expect("valid").accepted);
    // a NaN component is an error, not a missing component
    let refused =
        fresh().update_with(&Both, 0.0, &[Some(f64::NAN), None], &Update::default()).expect_err("refused");
    assert!(refused.to_string().starts_with("z has an entry that is not finite"), "{refused}");
    let refused = fresh().update_with(&Both, 0.0, &[None], &Update::default()).expect_err("refused");
    assert_eq!(refused.to_string(), "z has shape 1x1; expected 2x1");
}

#[test]
fn a_jump_moves_the_state_and_its_covariance() {
    let mut filter =
        Filter::new(dvector![1.0, 2.0], &dmatrix![1.0, 0.0; 0.0, 4.0], CovarianceForm::Ud).expect("valid");
    let exchange = Transition::new(&dmatrix![0.0, 1.0; 1.0, 0.0]).expect("finite");
    let noise = ProcessNoise::new(&dmatrix![0.5, 0.0; 0.0, 0.0]).expect("Q");
    filter.jump(dvector![2.0, 1.0], &exchange, &noise).expect("valid");
    assert!((filter.covariance().matrix() - dmatrix![4.5, 0.0; 0.0, 1.0]).amax() < 1e-12);
    let before = filter.clone();
    assert!(filter.jump(dvector![f64::NAN, 0.0], &exchange, &noise).is_err());
    assert!(filter.jump(dvector![0.0, 0.0], &Transition::identity(3), &noise).is_err());
    assert_eq!(filter, before);
}

/// Random walk in two states, the first measured: the smoother, and the estimate of the start from the
/// innovations, against least squares on all states at once.
#[test]
fn smoothers_are_least_squares_on_the_whole_interval() {
    let phi = dmatrix![1.0, 0.3; -0.1, 0.9];
    let q = dmatrix![0.2, 0.05; 0.05, 0.1];
    let (r, p0, x0) = (0.3, dmatrix![2.0, 0.4; 0.4, 1.0], dvector![0.5, -1.0]);
    let z = [0.7, 1.9, -0.4, 0.2, 2.2, 1.0];
    let stage = Stage {
        transition: Transition::new(&phi).expect("finite"),
        noise: ProcessNoise::new(&q).expect("Q"),
        outputs: vec![ScalarOutput { h: vec![(0, 1.0), (1, 0.5)], r }],
        steps: z.len(),
    };
    // all states x_0..x_N: prior, motions, measurements
    let n = 2 * (z.len() + 1);
    let (mut information, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let mut add = |rows: DMatrix<f64>, value: DVector<f64>, covariance: &DMatrix<f64>| {
        let weight = covariance.clone().try_inverse().expect("definite");
        information += rows.transpose() * &weight * &rows;
        right += rows.transpose() * weight * value;
    };
    let mut first = DMatrix::zeros(2, n);
    first.view_mut((0, 0), (2, 2)).fill_with_identity();
    add(first, x0.clone(), &p0);
    for (k, &z) in z.iter().enumerate() {
        let mut motion = DMatrix::zeros(2, n);
        motion.view_mut((0, 2 * k), (2, 2)).copy_from(&-&phi);
        motion.view_mut((0, 2 * k + 2), (2, 2)).fill_with_identity();
        add(motion, DVector::zeros(2), &q);
        let mut seen = DMatrix::zeros(1, n);
        (seen[(0, 2 * k + 2)], seen[(0, 2 * k + 3)]) = (1.0, 0.5);
        add(seen, dvector![z], &dmatrix![r]);
    }
    let covariance = information.try_inverse().expect("definite");
    let states = &covariance * right;

    let outputs = &stage.outputs[0];
    struct Seen(ScalarOutput);
    impl Measurement for Seen {
        fn outputs(&self) -> usize {
            1
        }
        fn h(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
            dvector![self.0.predict(x.as_slice())]
        }
        fn jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> {
            dmatrix![1.0, 0.5]
        }
        fn noise(&self, _: f64) -> DMatrix<f64> {
            dmatrix![self.0.r]
        }
    }
    let mut filter = Filter::new(x0.clone(), &p0, CovarianceForm::Ud).expect("valid");
    let mut interval = FixedInterval::new(&filter);
    for &z in &z {
        filter.jump(&phi * filter.x(), &stage.transition, &stage.noise).expect("valid");
        interval.predicted(&filter, stage.transition.clone());
        filter.update(&Seen(outputs.clone()), 0.0, &dvector![z]).expect("valid");
        interval.updated(&filter);
    }
    let smoothed = interval.smooth().expect("definite");
    assert_eq!(smoothed.len(), z.len() + 1);
    for (k, s) in smoothed.iter().enumerate() {
        assert!((&s.x - states.rows(2 * k, 2)).amax() < 1e-10, "state {k}");
        assert!((&s.p - covariance.view((2 * k, 2 * k), (2, 2))).amax() < 1e-10, "covariance {k}");
    }

    let stages = std::slice::from_ref(&stage);
    let prior = Covariance::new("P0", &p0, CovarianceForm::Ud).expect("definite");
    let (mut x, mut whitened) = (x0.as_slice().to_vec(), Vec::new());
    let fill = |step: usize, _: usize, out: &mut [f64]| out[0] = z[step];
    let gains = filter_pass(stages, prior.clone(), &mut x, fill, |_, _, _, w| whitened.extend_from_slice(w))
        .expect("run");
    let start = smoothed_start(stages, &gains, &whitened, &p0).expect("run");
    assert!((0..2).all(|i| (x0[i] + start.correction[i] - states[i]).abs() < 1e-10));
    assert!((start.covariance - covariance.view((0, 0), (2, 2))).amax() < 1e-10);
    assert!((0..2).all(|i| (x[i] - states[n - 2 + i]).abs() < 1e-10));
    // residual of a measurement from the estimate of all of them, and its variance
    let h = dmatrix![1.0, 0.5];
    for (k, left) in start.left_out.iter().enumerate() {
        let own = covariance.view((2 * k + 2, 2 * k + 2), (2, 2));
        let of = (&h * own * h.transpose())[(0, 0)];
        assert!((r * left.u - (z[k] - (&h * states.rows(2 * k + 2, 2))[0])).abs() < 1e-10, "update {k}");
        assert!((r * r * left.variance - (r - of)).abs() < 1e-10, "update {k}");
    }
    // both recursions at once equal the two one after the other
    assert_eq!(gains, covariance_pass(stages, prior, |_, _| {}).expect("run"));
    let mut again = x0.as_slice().to_vec();
    state_pass(stages, &gains, &mut again, fill, |_, _, _| {}).expect("run");
    assert_eq!(again, x);
    assert!(smoothed_start(stages, &gains, &whitened[1..], &p0).is_err());
    assert!(state_pass(stages, &gains, &mut [0.0; 3], fill, |_, _, _| {}).is_err());
    assert!(state_pass(&[], &gains, &mut again, fill, |_, _, _| {}).is_err());
}

/// The covariance, too, refuses numbers that are not finite and wrong shapes.
#[test]
fn wrong_outputs_and_steps_are_refused() {
    let mut p = Covariance::new("P0", &DMatrix::identity(2, 2), CovarianceForm::Ud).expect("definite");
    let before = p.clone();
    let mut gain = Gain { k: Vec::new(), s: 0.0 };
    let mut update = |h: Vec<(usize, f64)>, r: f64| {
        p.update(&ScalarOutput { h, r }, &mut gain).expect_err("refused").to_string()
    };
    assert_eq!(update(vec![(0, 1.0)], 0.0), "R is 0e0; expected a variance above 0");
    assert_eq!(update(vec![(0, 1.0)], -1.0), "R is -1e0; expected a variance above 0");
    assert!(update(vec![(0, 1.0)], f64::NAN).starts_with("R is NaN"));
    assert_eq!(update(vec![(2, 1.0)], 1.0), "H has shape 1x3; expected 1x2");
    assert!(update(vec![(1, f64::INFINITY)], 1.0).starts_with("H has an entry that is not finite"));
    assert!(p.variance(&[(2, 1.0)]).is_err() && p.variance(&[(0, f64::NAN)]).is_err());
    assert!(p.propagate(&Transition::identity(3), &ProcessNoise::none()).is_err());
    assert_eq!(p, before);
    assert!(Nees::of_covariance(&p).expect("definite").of(&mut [1.0]).is_err());
    let rows = |active: Vec<usize>, rows: Vec<f64>| Transition::of_rows(2, active, rows);
    assert!(rows(vec![1, 0], vec![0.0; 4]).is_err() && rows(vec![2], vec![0.0; 2]).is_err());
    assert!(rows(vec![0], vec![0.0]).is_err() && rows(vec![0], vec![0.0, f64::NAN]).is_err());
    let phi = rows(vec![1], vec![3.0, 4.0]).expect("a row");
    assert_eq!(phi.matrix(), dmatrix![1.0, 0.0; 3.0, 4.0]);
    let r = Rotation3::from_euler_angles(0.1, 0.2, 0.3);
    let mut wrong = Attitude { q: UnitQuaternion::from_rotation_matrix(&r), bias: Vector3::zeros() };
    wrong.bias[0] = f64::NAN;
    assert!(matches!(
        Filter::new(wrong, &DMatrix::identity(6, 6), CovarianceForm::Ud),
        Err(EkfError::StateNotFinite { what: "x0" })
    ));
}

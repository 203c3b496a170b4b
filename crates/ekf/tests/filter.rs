//! Tests of the filter against textbook formulas, closed forms and statistics.

use nalgebra::{DMatrix, DVector, dmatrix, dvector};
use obsdeg_ekf::consistency::{Nees, autocorrelation, chi_square_band, ljung_box};
use obsdeg_ekf::decomposition::singular_values;
use obsdeg_ekf::integrate::{runge_kutta, van_loan};
use obsdeg_ekf::linear::{covariance_pass, state_pass};
use obsdeg_ekf::model::central_difference;
use obsdeg_ekf::{
    Covariance, CovarianceForm, EkfError, Filter, Gain, Measurement, Process, ProcessNoise, ScalarOutput,
    SquareRootInformation, Stage, Transition,
};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// A random positive definite matrix.
fn definite(n: usize, entries: &[f64]) -> DMatrix<f64> {
    let a = DMatrix::from_column_slice(n, n, &entries[..n * n]);
    &a * a.transpose() + DMatrix::identity(n, n) * 0.1
}

fn close(a: &DMatrix<f64>, b: &DMatrix<f64>, tolerance: f64) -> bool {
    (a - b).amax() <= tolerance * b.amax().max(1.0)
}

/// A system given by its matrices.
struct Matrices {
    f: DMatrix<f64>,
    q: DMatrix<f64>,
    h: DMatrix<f64>,
    r: DMatrix<f64>,
}

impl Process for Matrices {
    fn states(&self) -> usize {
        self.f.nrows()
    }
    fn f(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
        &self.f * x
    }
    fn jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> {
        self.f.clone()
    }
    fn noise(&self, _: f64) -> DMatrix<f64> {
        self.q.clone()
    }
}

impl Measurement for Matrices {
    fn outputs(&self) -> usize {
        self.h.nrows()
    }
    fn h(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
        &self.h * x
    }
    fn jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> {
        self.h.clone()
    }
    fn noise(&self, _: f64) -> DMatrix<f64> {
        self.r.clone()
    }
}

proptest! {
    /// Both forms against the matrix formulas, with correlated measurement noise.
    #[test]
    fn both_forms_are_the_kalman_filter(e in prop::collection::vec(-1.0f64..1.0, 80)) {
        let (n, m) = (4, 2);
        let p0 = definite(n, &e);
        let model = Matrices {
            f: DMatrix::from_column_slice(n, n, &e[16..32]),
            q: definite(n, &e[32..48]) * 0.1,
            h: DMatrix::from_column_slice(m, n, &e[48..56]),
            r: definite(m, &e[56..60]),
        };
        let (x0, z) = (DVector::from_column_slice(&e[60..64]), DVector::from_column_slice(&e[64..66]));
        let step = runge_kutta(&model, 0.0, &x0, 0.1, 8).expect("valid");
        let p = &step.phi * &p0 * step.phi.transpose() + &step.q;
        let s = &model.h * &p * model.h.transpose() + &model.r;
        let inverse = s.clone().try_inverse().expect("definite");
        let k = &p * model.h.transpose() * &inverse;
        let innovation = &z - &model.h * &step.x;
        let x = &step.x + &k * &innovation;
        let after = (DMatrix::identity(n, n) - &k * &model.h) * &p;
        let nis = (innovation.transpose() * inverse * &innovation)[(0, 0)];
        for form in [CovarianceForm::Joseph, CovarianceForm::Ud] {
            let mut filter = Filter::new(x0.clone(), &p0, form).expect("valid");
            filter.predict(&model, 0.0, 0.1, 8).expect("valid");
            prop_assert!(close(&filter.covariance().matrix(), &p, 1e-10), "{form:?} predict");
            let seen = filter.update(&model, 0.1, &z).expect("valid");
            prop_assert!(close(&filter.covariance().matrix(), &after, 1e-9), "{form:?} update");
            prop_assert!((filter.x() - &x).amax() < 1e-9);
            prop_assert!((seen.nis() - nis).abs() < 1e-7 * nis.max(1.0));
            let sigmas = filter.covariance().sigmas();
            prop_assert!((0..n).all(|i| (sigmas[i].powi(2) - after[(i, i)]).abs() < 1e-9));
        }
    }

    #[test]
    fn van_loan_agrees_with_runge_kutta(e in prop::collection::vec(-1.0f64..1.0, 32)) {
        let model = Matrices {
            f: DMatrix::from_column_slice(4, 4, &e[..16]),
            q: definite(4, &e[16..]),
            h: DMatrix::zeros(0, 4),
            r: DMatrix::zeros(0, 0),
        };
        let (phi, q) = van_loan(&model.f, &model.q, 0.3).expect("valid");
        let step = runge_kutta(&model, 0.0, &DVector::zeros(4), 0.3, 64).expect("valid");
        prop_assert!(close(&step.phi, &phi, 1e-8) && close(&step.q, &q, 1e-8));
    }

    /// A transition that changes only some states, with noise on some only: both forms against the
    /// formula, and NEES against the inverse.
    #[test]
    fn partial_transitions(
        e in prop::collection::vec(-1.0f64..1.0, 60),
        moving in prop::collection::vec(any::<bool>(), 5),
        noisy in prop::collection::vec(any::<bool>(), 5),
    ) {
        let n = 5;
        let p0 = definite(n, &e[..25]);
        let full = DMatrix::from_column_slice(n, n, &e[25..50]);
        let identity: DMatrix<f64> = DMatrix::identity(n, n);
        let phi = DMatrix::from_fn(n, n, |i, j| identity[(i, j)] + if moving[i] { full[(i, j)] } else { 0.0 });
        let q = DMatrix::from_fn(n, n, |i, j| {
            if noisy[i] && noisy[j] { e[50 + i] * e[50 + j] + 0.5 * identity[(i, j)] } else { 0.0 }
        });
        let expected = &phi * &p0 * phi.transpose() + &q;
        for form in [CovarianceForm::Joseph, CovarianceForm::Ud] {
            let mut p = Covariance::new("P0", &p0, form).expect("valid");
            let noise = ProcessNoise::new(&q).expect("valid");
            p.propagate(&Transition::new(&phi).expect("valid"), &noise).expect("of one size");
            prop_assert!(close(&p.matrix(), &expected, 1e-10), "{form:?}");
            let error = DVector::from_column_slice(&e[55..]);
            if let (Some(inverse), Ok(nees)) = (expected.clone().try_inverse(), Nees::of_covariance(&p)) {
                let direct = (error.transpose() * inverse * &error)[(0, 0)];
                let found = nees.of(&mut error.as_slice().to_vec()).expect("of one size");
                prop_assert!((found - direct).abs() < 1e-6 * direct.abs().max(1.0), "{found} {direct}");
            }
        }
    }

    /// Stages give the same filter: information and covariance agree, and nothing depends on the data.
    #[test]
    fn covariance_pass_is_the_inverse_information(e in prop::collection::vec(-1.0f64..1.0, 40)) {
        let n = 3;
        let phi = DMatrix::identity(n, n) + DMatrix::from_column_slice(n, n, &e[..9]) * 0.2;
        let h: Vec<(usize, f64)> = (0..n).map(|i| (i, e[9 + i])).collect();
        let stage = Stage {
            transition: Transition::new(&phi).expect("valid"),
            noise: ProcessNoise::new(&DMatrix::zeros(n, n)).expect("valid"),
            outputs: vec![ScalarOutput { h: h.clone(), r: 0.04 }],
            steps: 12,
        };
        let prior = [2.0, 3.0, 1.0];
        let p0 = DMatrix::from_diagonal(&DVector::from_column_slice(&prior).map(|s| s * s));
        let mut information = SquareRootInformation::prior(&prior).expect("valid");
        let mut to_now = DMatrix::identity(n, n);
        let row = DMatrix::from_fn(1, n, |_, j| h[j].1 / 0.2);
        for _ in 0..12 {
            to_now = &phi * to_now;
            information.add(&(&row * &to_now)).expect("valid");
        }
        let expected = &to_now * information.covariance().expect("regular") * to_now.transpose();
        for form in [CovarianceForm::Joseph, CovarianceForm::Ud] {
            let mut last = DMatrix::zeros(n, n);
            let p0 = Covariance::new("P0", &p0, form).expect("valid");
            covariance_pass(std::slice::from_ref(&stage), p0, |_, p| last = p.matrix()).expect("shapes");
            prop_assert!(close(&last, &expected, 1e-8), "{form:?}");
        }
    }
}

/// Best achievable variance of the k-th derivative of a polynomial of degree k from dense samples over
/// T: `(2k+1) ((2k)!/k!)^2 sigma^2 dt / T^(2k+1)`.
#[test]
fn variance_constants() {
    let (sigma, dt, steps) = (0.3, 1e-3, 4000usize);
    let time = dt * steps as f64;
    for (k, constant) in [(0usize, 1.0), (1, 12.0), (2, 720.0), (3, 100_800.0)] {
        let n = k + 1;
        let mut information = SquareRootInformation::none(n);
        let taylor = |t: f64, j: usize| t.powi(j as i32) / (1..=j).map(|i| i as f64).product::<f64>();
        let rows = DMatrix::from_fn(steps, n, |i, j| taylor((i as f64 + 0.5) * dt, j) / sigma);
        information.add(&rows).expect("valid");
        let variance = information.covariance().expect("regular")[(k, k)];
        let predicted = constant * sigma * sigma * dt / time.powi(2 * k as i32 + 1);
        assert!((variance / predicted - 1.0).abs() < 1e-3, "k = {k}: {variance:e} {predicted:e}");
    }
}

/// Pendulum measured by its horizontal displacement.
struct Pendulum;

impl Process for Pendulum {
    fn states(&self) -> usize {
        2
    }
    fn f(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
        dvector![x[1], -9.81 * x[0].sin()]
    }
    fn jacobian(&self, _: f64, x: &DVector<f64>) -> DMatrix<f64> {
        dmatrix![0.0, 1.0; -9.81 * x[0].cos(), 0.0]
    }
    fn noise(&self, _: f64) -> DMatrix<f64> {
        dmatrix![0.0, 0.0; 0.0, 1e-4]
    }
}

impl Measurement for Pendulum {
    fn outputs(&self) -> usize {
        1
    }
    fn h(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
        dvector![x[0].sin()]
    }
    fn jacobian(&self, _: f64, x: &DVector<f64>) -> DMatrix<f64> {
        dmatrix![x[0].cos(), 0.0]
    }
    fn noise(&self, _: f64) -> DMatrix<f64> {
        dmatrix![1e-4]
    }
}

#[test]
fn jacobians_are_derivatives_and_phi_is_the_derivative_of_the_flow() {
    let (x, step) = (dvector![0.4, -1.1], dvector![1e-5, 1e-5]);
    let f = central_difference(|x| Pendulum.f(0.0, x), &x, &step);
    assert!(close(&f, &Process::jacobian(&Pendulum, 0.0, &x), 1e-8));
    let h = central_difference(|x| Pendulum.h(0.0, x), &x, &step);
    assert!(close(&h, &Measurement::jacobian(&Pendulum, 0.0, &x), 1e-8));
    let flow = |x: &DVector<f64>| runge_kutta(&Pendulum, 0.0, x, 0.2, 20).expect("valid");
    assert!(close(&central_difference(|x| flow(x).x, &x, &step), &flow(&x).phi, 1e-7));
}

/// Monte Carlo on the pendulum: the extended filter is consistent in both forms.
#[test]
fn a_right_model_gives_consistent_errors_and_white_innovations() {
    let (runs, steps, dt) = (200, 60, 0.05);
    let p0 = dmatrix![0.01, 0.0; 0.0, 0.04];
    for form in [CovarianceForm::Joseph, CovarianceForm::Ud] {
        let (mut nees, mut nis, mut white) = (0.0, 0.0, Vec::new());
        for run in 0..runs {
            let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(run);
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let mut truth = dvector![0.5 + 0.1 * normal(), 0.2 * normal()];
            let mut filter = Filter::new(dvector![0.5, 0.0], &p0, form).expect("valid");
            for i in 0..steps {
                let t = dt * f64::from(i);
                let step = runge_kutta(&Pendulum, t, &truth, dt, 2).expect("valid");
                truth = step.x;
                truth[1] += (1e-4 * dt).sqrt() * normal();
                filter.predict(&Pendulum, t, dt, 2).expect("valid");
                let z = dvector![truth[0].sin() + 0.01 * normal()];
                let seen = filter.update(&Pendulum, t + dt, &z).expect("valid");
                nis += seen.nis() / f64::from(steps);
                white.push(seen.whitened[0]);
            }
            let mut error = (&truth - filter.x()).as_slice().to_vec();
            nees += Nees::of_covariance(filter.covariance())
                .expect("definite")
                .of(&mut error)
                .expect("of one size");
        }
        let runs = runs as f64;
        let (low, high) = chi_square_band(2.0, runs, 0.999);
        assert!((low..high).contains(&(nees / runs)), "{form:?}: NEES {}", nees / runs);
        let (low, high) = chi_square_band(1.0, runs * f64::from(steps), 0.999);
        assert!((low..high).contains(&(nis / runs)), "{form:?}: NIS {}", nis / runs);
        let p = ljung_box(&autocorrelation(&white, 20), white.len());
        assert!(p > 1e-3, "{form:?}: whiteness {p}");
        // a coloured sequence is detected
        let coloured: Vec<f64> = white.windows(2).map(|w| w[0] + 0.3 * w[1]).collect();
        assert!(ljung_box(&autocorrelation(&coloured, 20), coloured.len()) < 1e-6);
    }
}

#[test]
fn state_pass_is_the_filter_step_by_step() {
    let phi = dmatrix![1.0, 0.1; 0.0, 1.0];
    let q = dmatrix![1e-4, 0.0; 0.0, 0.0];
    let stage = Stage {
        transition: Transition::new(&phi).expect("valid"),
        noise: ProcessNoise::new(&q).expect("valid"),
        outputs: vec![
            ScalarOutput { h: vec![(0, 1.0)], r: 0.01 },
            ScalarOutput { h: vec![(1, 2.0)], r: 0.5 },
        ],
        steps: 9,
    };
    let p0 = DMatrix::identity(2, 2);
    let z = |step: usize, j: usize| ((step * 2 + j) as f64).sin();
    let gains = covariance_pass(
        std::slice::from_ref(&stage),
        Covariance::new("P0", &p0, CovarianceForm::Joseph).expect("valid"),
        |_, _| {},
    )
    .expect("shapes");
    let mut x = [0.3, -0.2];
    let fill = |step: usize, _: usize, out: &mut [f64]| (0..2).for_each(|j| out[j] = z(step, j));
    state_pass(std::slice::from_ref(&stage), &gains, &mut x, fill, |_, _, _| {}).expect("of one run");
    let (mut p, mut expected) = (p0, dvector![0.3, -0.2]);
    let (h, r) = (dmatrix![1.0, 0.0; 0.0, 2.0], dmatrix![0.01, 0.0; 0.0, 0.5]);
    for step in 0..9 {
        p = &phi * p * phi.transpose() + &q;
        expected = &phi * expected;
        let s = (&h * &p * h.transpose() + &r).try_inverse().expect("definite");
        let k = &p * h.transpose() * s;
        expected += &k * (dvector![z(step, 0), z(step, 1)] - &h * &expected);
        p = (DMatrix::identity(2, 2) - &k * &h) * p;
    }
    assert!((expected[0] - x[0]).abs() < 1e-12 && (expected[1] - x[1]).abs() < 1e-12);
}

/// With a diffuse prior, P itself loses the small directions; the UD form keeps them.
#[test]
fn the_ud_form_keeps_what_a_diffuse_prior_costs() {
    let outputs = [
        ScalarOutput { h: vec![(0, 1.0), (1, 1.0)], r: 1e-4 },
        ScalarOutput { h: vec![(0, 1.0), (1, -1.0)], r: 1e-4 },
    ];
    let p0 = DMatrix::identity(2, 2) * 1e18;
    let mut p = Covariance::new("P0", &p0, CovarianceForm::Ud).expect("valid");
    let mut gain = Gain { k: Vec::new(), s: 0.0 };
    for output in &outputs {
        p.update(output, &mut gain).expect("valid");
    }
    // each state is half the sum or difference of two measurements
    let expected = (1e-4f64 / 2.0).sqrt();
    assert!(p.sigmas().iter().all(|s| (s / expected - 1.0).abs() < 1e-6), "{:?}", p.sigmas());
}

#[test]
fn singular_values_of_a_matrix_of_ones() {
    let (values, v) = singular_values(&DMatrix::from_element(5, 3, 1.0)).expect("finite");
    assert!((values[0] - 15f64.sqrt()).abs() < 1e-12 && values[1..].iter().all(|s| s.abs() < 1e-12));
    assert!(close(&(v.transpose() * &v), &DMatrix::identity(3, 3), 1e-12));
    assert!(singular_values(&DMatrix::from_element(5, 3, f64::NAN)).is_err());
}

#[test]
fn wrong_inputs_are_refused_by_name() {
    let (x, unit) = (dvector![0.0, 0.0], DMatrix::<f64>::identity(2, 2));
    let new = |x: &DVector<f64>, p: &DMatrix<f64>| {
        Filter::new(x.clone(), p, CovarianceForm::Joseph).expect_err("refused")
    };
    assert_eq!(new(&x, &DMatrix::identity(3, 3)).to_string(), "P0 has shape 3x3; expected 2x2");
    assert!(new(&dvector![0.0, f64::NAN], &unit).to_string().starts_with("x0 is not finite"));
    assert!(new(&x, &dmatrix![1.0, 0.0; 0.0, -1.0]).to_string().starts_with("P0 is not positive definite"));
    assert!(matches!(new(&x, &dmatrix![1.0, 0.5; 0.0, 1.0]), EkfError::NotSymmetric { what: "P0", .. }));
    assert!(matches!(
        ProcessNoise::new(&dmatrix![0.0, 1.0; 1.0, 1.0]),
        Err(EkfError::NotPositiveSemidefinite { what: "Q", .. })
    ));
    assert!(ProcessNoise::new(&dmatrix![1.0, 1.0; 1.0, 1.0]).is_ok());
    assert!(Transition::new(&dmatrix![1.0, f64::INFINITY; 0.0, 1.0]).is_err());
    let mut filter = Filter::new(x, &unit, CovarianceForm::Ud).expect("valid");
    let wrong = Matrices { f: unit.clone(), q: unit.clone(), h: unit.clone(), r: unit.clone() * -1.0 };
    let refused = filter.update(&wrong, 0.0, &dvector![0.0, 0.0]).expect_err("refused");
    assert!(refused.to_string().starts_with("R is not positive definite"), "{refused}");
    let refused = filter.update(&wrong, 0.0, &dvector![0.0]).expect_err("refused");
    assert_eq!(refused.to_string(), "z has shape 1x1; expected 2x1");
    let stage = Stage {
        transition: Transition::new(&unit).expect("valid"),
        noise: ProcessNoise::new(&unit).expect("valid"),
        outputs: vec![ScalarOutput { h: vec![(2, 1.0)], r: 1.0 }],
        steps: 1,
    };
    let pass = |n: usize| {
        let prior = Covariance::new("P0", &DMatrix::identity(n, n), CovarianceForm::Ud).expect("valid");
        covariance_pass(std::slice::from_ref(&stage), prior, |_, _| {}).expect_err("refused").to_string()
    };
    assert_eq!(pass(3), "Phi has shape 2x2; expected 3x3");
    assert_eq!(pass(2), "H has shape 1x3; expected 1x2");
    let ill = Matrices { q: DMatrix::identity(3, 3), ..wrong };
    let refused = filter.predict(&ill, 0.0, 1.0, 1).expect_err("refused");
    assert_eq!(refused.to_string(), "Q has shape 3x3; expected 2x2");
    let singular = SquareRootInformation::none(2).covariance();
    assert_eq!(singular, Err(EkfError::Singular { column: 0 }));
}

//! The extended filter against a filter written here from the equations of the method: attitude as a
//! quaternion, explicit drift of every gyro, Jacobians by differences, covariance as a full matrix.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, UnitQuaternion, Vector3};
use obsdeg_core::model::Carry;
use obsdeg_core::model::settings::Truth;
use obsdeg_ekf::Update;
use obsdeg_evidence::simulation::{Conditions, ExtendedFilter, Noise, Plan, RunStart, TruthModel};

use crate::schemes::{paper, scheme};

const G: Vector3<f64> = Vector3::new(0.0, -1.0, 0.0);
const LATITUDE: f64 = 28.2;

/// State: attitude quaternion from true platform axes to n, and the twelve coefficients (D_F, D_I, D_O, D_S;
/// X, Y, Z each).
#[derive(Clone)]
struct State {
    q: UnitQuaternion<f64>,
    d: Vec<f64>,
}

fn earth() -> Vector3<f64> {
    let l = LATITUDE.to_radians();
    Vector3::new(l.cos(), l.sin(), 0.0) * 7.292115e-5
}

/// Attitude matrix `C_c^n` of (19): passive rotations.
fn computed(alpha: f64, beta: f64, gamma: f64) -> Matrix3<f64> {
    let ((sa, ca), (sb, cb), (sg, cg)) = (alpha.sin_cos(), beta.sin_cos(), gamma.sin_cos());
    Matrix3::new(1.0, 0.0, 0.0, 0.0, ca, sa, 0.0, -sa, ca)
        * Matrix3::new(cb, 0.0, -sb, 0.0, 1.0, 0.0, sb, 0.0, cb)
        * Matrix3::new(cg, sg, 0.0, -sg, cg, 0.0, 0.0, 0.0, 1.0)
}

/// Drift by (3) with the gyro axes of the paper.
fn drift(d: &[f64], g: &Vector3<f64>) -> Vector3<f64> {
    let ([f, i, o, s], [x, y, z]) = ([&d[..3], &d[3..6], &d[6..9], &d[9..12]], [g.x, g.y, g.z]);
    Vector3::new(
        f[0] + i[0] * x + s[0] * y - o[0] * z,
        f[1] + i[1] * y - s[1] * x - o[1] * z,
        f[2] + i[2] * z + s[2] * y + o[2] * x,
    )
}

/// State after one step at a position with the computed attitude `c`: the platform turns at the commanded
/// rate and its drift.
fn step(c: &Matrix3<f64>, dt: f64, x: &State) -> State {
    let command = c.transpose() * earth();
    let slope = |q: &nalgebra::Quaternion<f64>| {
        let unit = UnitQuaternion::new_normalize(*q);
        let body = command + drift(&x.d, &(unit.inverse() * G));
        (q * nalgebra::Quaternion::from_imag(body) - nalgebra::Quaternion::from_imag(earth()) * q) * 0.5
    };
    let (mut q, parts) = (*x.q.quaternion(), 4);
    let h = dt / f64::from(parts);
    for _ in 0..parts {
        let k1 = slope(&q);
        let k2 = slope(&(q + k1 * (h / 2.0)));
        let k3 = slope(&(q + k2 * (h / 2.0)));
        let k4 = slope(&(q + k3 * h));
        q += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
    }
    State { q: UnitQuaternion::new_normalize(q), d: x.d.clone() }
}

/// Output by (6) without small angles: `Z^n = C_c^n (f^p + g^c)`, `f^p = -g^p`; components 1 and 3.
fn output(c: &Matrix3<f64>, x: &State) -> [f64; 2] {
    let z = c * (c.transpose() * G - x.q.inverse() * G);
    [z.x, z.z]
}

fn moved(x: &State, delta: &DVector<f64>) -> State {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(delta[0], delta[1], delta[2]));
    State { q: turn * x.q, d: x.d.iter().zip(delta.iter().skip(3)).map(|(d, e)| d + e).collect() }
}

fn apart(x: &State, from: &State) -> DVector<f64> {
    let turn = (x.q * from.q.inverse()).scaled_axis();
    DVector::from_iterator(15, turn.iter().copied().chain(x.d.iter().zip(&from.d).map(|(a, b)| a - b)))
}

fn by_differences(f: impl Fn(&DVector<f64>) -> DVector<f64>) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = (0..15)
        .map(|j| {
            let h = if j < 3 { 1e-4 } else { 1e-6 };
            let mut e = DVector::zeros(15);
            e[j] = h;
            (f(&e) - f(&-e)) / (2.0 * h)
        })
        .collect();
    DMatrix::from_columns(&columns)
}

#[test]
#[ignore = "seconds: .ci/run release"]
fn an_independent_filter_has_the_same_estimates() {
    for (scheme, attitudes) in [
        (paper(Carry::Platform), vec!["0,0,0", "180,0,0"]),
        (paper(Carry::Inertial), vec!["0,0,0", "180,0,0"]),
        (
            scheme(&["10,25,40", "130,-50,70", "-95,33,-160"], Carry::Platform),
            vec!["10,25,40", "130,-50,70", "-95,33,-160"],
        ),
        (
            scheme(&["10,25,40", "130,-50,70", "-95,33,-160"], Carry::Inertial),
            vec!["10,25,40", "130,-50,70", "-95,33,-160"],
        ),
    ] {
        let carry = scheme.carry;
        let conditions = Conditions { truth: Truth::Exact, ..Conditions::default() };
        let plan = Plan::new(&scheme, &conditions).expect("a plan");
        let start = RunStart::new(&plan, &conditions).expect("a start");
        let mut truth = TruthModel::new(&plan, &conditions, start.truth.clone());
        let (mut noise, mut z) = (Noise::new(3, 0), Vec::new());
        for (segment, s) in plan.segments.iter().enumerate() {
            for i in 0..s.steps {
                let mut now = [0.0; 2];
                truth.step(segment, i, &mut noise, &mut now);
                z.extend(now);
            }
        }
        let filter = ExtendedFilter::new(&plan, &conditions, Update::default()).expect("coefficients");
        let mut last = Vec::new();
        let ended = filter.run(&start, &z, |_, x, _, _| last = x.unknowns()).expect("finite");

        let c: Vec<Matrix3<f64>> = attitudes
            .iter()
            .map(|a| {
                let angles: Vec<f64> =
                    a.split(',').map(|x| x.parse::<f64>().expect("degrees").to_radians()).collect();
                computed(angles[0], angles[1], angles[2])
            })
            .collect();
        let mut x = State {
            q: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(c[0])),
            d: vec![0.0; 12],
        };
        let mut p = DMatrix::from_diagonal(&DVector::from_iterator(15, start.sigma.iter().map(|s| s * s)));
        // psi is in platform axes at the start
        let mut to_n = DMatrix::identity(15, 15);
        to_n.view_mut((0, 0), (3, 3)).copy_from(&c[0]);
        p = &to_n * p * to_n.transpose();
        let held = (0.01f64 / 3600.0).to_radians();
        let mut k = 0;
        for (i, c_now) in c.iter().enumerate() {
            if i > 0 {
                // instantaneous slew: the platform turns by the command in its own axes (inertial carry), or
                // keeps C_c^p
                let turn = match carry {
                    Carry::Inertial => Matrix3::identity(),
                    _ => c_now * c[i - 1].transpose(),
                };
                let e = x.q.to_rotation_matrix().matrix() * c[i - 1].transpose();
                let e = turn * e * turn.transpose();
                x.q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(e * c_now));
                let mut j = DMatrix::identity(15, 15);
                j.view_mut((0, 0), (3, 3)).copy_from(&turn);
                p = &j * p * j.transpose();
            }
            for _ in 0..100 {
                let after = step(c_now, 10.0, &x);
                let phi = by_differences(|e| apart(&step(c_now, 10.0, &moved(&x, e)), &after));
                p = &phi * p * phi.transpose();
                (0..3).for_each(|j| p[(j, j)] += (held * 10.0).powi(2));
                x = after;
                let seen = output(c_now, &x);
                let h = by_differences(|e| DVector::from_column_slice(&output(c_now, &moved(&x, e))));
                let s = &h * &p * h.transpose() + DMatrix::identity(2, 2) * 1e-10;
                let gain = &p * h.transpose() * s.try_inverse().expect("definite");
                let innovation = DVector::from_column_slice(&[z[k] - seen[0], z[k + 1] - seen[1]]);
                k += 2;
                let delta = &gain * innovation;
                let left = DMatrix::identity(15, 15) - &gain * &h;
                p = &left * p * left.transpose() + &gain * gain.transpose() * 1e-10;
                let new = moved(&x, &delta);
                // effect of a reset on the error, by differences
                let reset = by_differences(|e| apart(&moved(&x, &(&delta + e)), &new));
                p = &reset * p * reset.transpose();
                p = (&p + p.transpose()) / 2.0;
                x = new;
            }
        }
        let sigmas = ended.covariance.sigmas();
        for j in 0..12 {
            let (a, b) = (last[3 + j], x.d[j]);
            assert!(
                (a - b).abs() < 1e-6 * b.abs().max(sigmas[3 + j]),
                "{carry} coefficient {j}: {a:e} {b:e}"
            );
            let (a, b) = (sigmas[3 + j], p[(3 + j, 3 + j)].sqrt());
            assert!((a / b - 1.0).abs() < 1e-6, "{carry} sigma {j}: {a:e} {b:e}");
        }
    }
}

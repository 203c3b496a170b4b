//! Tests of the random errors of sensors against quadrature, closed forms and simulated data.

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::allan::overlapping_deviation;
use obsdeg_ekf::noise::{FLICKER_FLOOR, MARKOV_PEAK, MARKOV_PEAK_AT, discretised};
use obsdeg_ekf::{EkfError, SensorNoise};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const WHITE: SensorNoise = SensorNoise { white: 0.5, walk: 0.0, instability: 0.0, correlation_s: 1.0 };
const WALK: SensorNoise = SensorNoise { white: 0.0, walk: 0.02, instability: 0.0, correlation_s: 1.0 };
const MARKOV: SensorNoise = SensorNoise { white: 0.0, walk: 0.0, instability: 2.0, correlation_s: 40.0 };

/// Means over steps of `dt` of simulated sensor errors, by the exact discretisation of the integral.
fn simulated(noise: &SensorNoise, dt: f64, count: usize, seed: u64) -> Vec<f64> {
    let (f, q) = noise.model();
    let (phi, q_d) = discretised(&f, &q, dt).expect("discretised");
    let n = f.nrows();
    let root = |q: DMatrix<f64>| {
        // zero where there is no noise
        let e = q.symmetric_eigen();
        &e.eigenvectors * DMatrix::from_diagonal(&e.eigenvalues.map(|x| x.max(0.0).sqrt()))
    };
    let root = root(q_d);
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut x = DVector::zeros(n);
    for (i, s) in noise.states().iter().enumerate() {
        x[i + 1] = s.variance.sqrt() * normal();
    }
    let step = |_| {
        x[0] = 0.0;
        x = &phi * &x + &root * DVector::from_fn(n, |_, _| normal());
        x[0] / dt
    };
    (0..count).map(step).collect()
}

/// `d ln sigma/d ln tau` between two cluster sizes, of the mean Allan variance of some runs.
fn deviations(noise: &SensorNoise, dt: f64, sizes: &[usize]) -> Vec<f64> {
    const RUNS: u64 = 20;
    let mut sums = vec![0.0; sizes.len()];
    for seed in 0..RUNS {
        let rates = simulated(noise, dt, 20_000, seed);
        for (sum, &m) in sums.iter_mut().zip(sizes) {
            *sum += overlapping_deviation(&rates, m).expect("enough samples").powi(2);
        }
    }
    sums.iter().map(|s| (s / RUNS as f64).sqrt()).collect()
}

/// White noise falls with slope -1/2, a random walk rises with 1/2, and a Gauss-Markov process is flat
/// at its peak: between 1/1.3 and 1.3 of the peak's cluster time the slope is within 0.05 of zero.
/// Every deviation is within 3 % of the closed form.
#[test]
fn allan_slopes() {
    let peak = MARKOV_PEAK_AT * MARKOV.correlation_s;
    for (noise, dt, sizes, slope) in [
        (WHITE, 0.1, [1, 10, 100], -0.5),
        (WALK, 5.0, [4, 20, 100], 0.5),
        (MARKOV, peak / 20.0, [15, 20, 26], 0.0),
    ] {
        let found = deviations(&noise, dt, &sizes);
        for (&m, found) in sizes.iter().zip(&found) {
            let expected = noise.allan_variance(m as f64 * dt).sqrt();
            assert!((found / expected - 1.0).abs() < 0.03, "{noise:?} {m}: {found} instead of {expected}");
        }
        let measured = (found[2] / found[0]).ln() / (sizes[2] as f64 / sizes[0] as f64).ln();
        assert!((measured - slope).abs() < 0.05, "{noise:?}: {measured} instead of {slope}");
    }
    // below its peak the deviation rises, above it falls: the check can fail
    let found = deviations(&MARKOV, MARKOV.correlation_s / 10.0, &[1, 4, 100, 400]);
    assert!((found[1] / found[0]).log(4.0) > 0.4 && (found[3] / found[2]).log(4.0) < -0.3, "{found:?}");
}

/// The peak of the Gauss-Markov process is where the standard has it, and as high as the flicker floor of B.
#[test]
fn bias_instability_as_a_gauss_markov_process() {
    assert!((FLICKER_FLOOR - (2.0 * 2f64.ln() / std::f64::consts::PI).sqrt()).abs() < 1e-15);
    assert!((FLICKER_FLOOR - 0.664).abs() < 5e-4 && (MARKOV_PEAK / 2f64.sqrt() - 0.437).abs() < 5e-4);
    assert!((MARKOV_PEAK_AT - 1.89).abs() < 5e-3);
    let at = |x: f64| MARKOV.allan_variance(x * MARKOV.correlation_s).sqrt();
    let peak = at(MARKOV_PEAK_AT);
    assert!((peak / (FLICKER_FLOOR * MARKOV.instability) - 1.0).abs() < 1e-12, "{peak}");
    for k in -40..=40 {
        assert!(at(MARKOV_PEAK_AT * 1.1f64.powi(k)) <= peak * (1.0 + 1e-12), "{k}");
    }
    // the series for small x meets the closed form, and for very short times the process is a random
    // walk of its density
    assert!((at(0.009_999_999) / at(0.010_000_001) - (1.0 - 1e-7)).abs() < 2e-9);
    let density = MARKOV.states()[0].density;
    let tau = 1e-6 * MARKOV.correlation_s;
    assert!((MARKOV.allan_variance(tau) / (density * tau / 3.0) - 1.0).abs() < 1e-5);
}

/// Datasheet units, by hand.
#[test]
fn units() {
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
    let gyro = SensorNoise::gyro(0.6, 0.6, 0.3, 100.0);
    // an angle of 0.6 deg after an hour, a rate of 0.6 deg/h after an hour
    assert!(near((gyro.white * 3600f64.sqrt()).to_degrees(), 0.6));
    assert!(near((gyro.walk * 3600f64.sqrt()).to_degrees() * 3600.0, 0.6));
    assert!(near(gyro.instability.to_degrees() * 3600.0, 0.3));
    // 1 m/s after an hour
    let accelerometer = SensorNoise::accelerometer(1.0, 60.0, 10.0, 100.0);
    assert!(near(accelerometer.white * 3600f64.sqrt() * 9.80665, 1.0));
    assert!(near(accelerometer.walk, 1e-6) && near(accelerometer.instability, 1e-5));
    assert_eq!((WHITE.states().len(), WALK.states().len(), gyro.states().len()), (0, 1, 2));
}

/// The discretisation against `Q_d = integral of e^(F s) Q e^(F^T s)`, by Simpson's rule on the closed form
/// of the exponential, for steps from a hundredth of the correlation time to a hundred of them.
#[test]
fn discretisation_against_quadrature() {
    let noise = SensorNoise { white: 0.3, walk: 0.1, instability: 1.5, correlation_s: 7.0 };
    let (f, q) = noise.model();
    let a = 1.0 / noise.correlation_s;
    // columns: the integral, the random walk, the Gauss-Markov process
    let exponential = |s: f64| {
        let decayed = (-a * s).exp();
        [[1.0, s, (1.0 - decayed) / a], [0.0, 1.0, 0.0], [0.0, 0.0, decayed]]
    };
    for dt in [0.07, 7.0, 100.0, 700.0] {
        let (phi, q_d) = discretised(&f, &q, dt).expect("discretised");
        let parts = 20_000;
        let mut integral = [[0.0; 3]; 3];
        for k in 0..=parts {
            let weight = if k == 0 || k == parts { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
            let e = exponential(dt * f64::from(k) / f64::from(parts));
            for i in 0..3 {
                for j in 0..3 {
                    let density: f64 = (0..3).map(|l| e[i][l] * q[(l, l)] * e[j][l]).sum();
                    integral[i][j] += weight * density * dt / f64::from(parts) / 3.0;
                }
            }
        }
        let exact = exponential(dt);
        for i in 0..3 {
            for j in 0..3 {
                assert!((phi[(i, j)] - exact[i][j]).abs() < 1e-11 * (1.0 + exact[i][j]), "{dt} {i} {j}");
                let scale = (integral[i][i] * integral[j][j]).sqrt();
                assert!(
                    (q_d[(i, j)] - integral[i][j]).abs() < 1e-10 * scale,
                    "{dt} {i} {j}: {q_d} {integral:?}"
                );
            }
        }
    }
    // far beyond the range of the exponential of -F dt
    let (phi, q_d) = discretised(&f, &q, 1e6).expect("discretised");
    assert_eq!(phi[(2, 2)], 0.0);
    assert!((q_d[(2, 2)] / noise.markov_sigma().powi(2) - 1.0).abs() < 1e-12);
}

#[test]
fn too_few_samples() {
    assert_eq!(overlapping_deviation(&[1.0, 3.0], 1), Ok(2f64.sqrt()));
    for (samples, m) in [(&[1.0][..], 1), (&[1.0; 9], 5), (&[1.0; 9], 0), (&[], 0), (&[1.0; 9], usize::MAX)] {
        assert!(matches!(overlapping_deviation(samples, m), Err(EkfError::Shape { .. })), "{m}");
    }
}

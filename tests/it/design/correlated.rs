//! Correlated noise of Z in the criterion: against least squares with the covariance of all samples, written
//! from the equations, and against a filter with the biases of the accelerometers as states.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, SMatrix};
use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Angle, Carry, Scheme};
use obsdeg_design::design::{
    Candidates, Criterion, CriterionName, DesignError, DesignOptions, Evaluator, design, scheme_found,
};
use obsdeg_ekf::{CovarianceForm, linear::covariance_pass};
use obsdeg_evidence::simulation::{Conditions, Plan, RunStart, simulate};
use obsdeg_exact::SplitMix64;

use super::certificate::{DPH, EARTH, attitude, drift};
use super::*;

/// Sigma of the process divided by its bias-instability coefficient B: 0.664/0.617.
const OF_B: f64 = 0.664_282_470 / 0.617_364_283;

fn correlated(instability_ug: f64, correlation_s: f64) -> Conditions {
    Conditions {
        accelerometer_instability_ug: instability_ug,
        accelerometer_correlation_s: correlation_s,
        ..quiet()
    }
}

/// Sigmas of psi at the end (deg, platform axes; under reset carry for every position) and of the
/// coefficients (deg/h), by generalised least squares. Every sample is a row over (psi, D). The noise
/// covariance of two samples is that of three accelerometer biases.
fn least_squares(degrees: &[[f64; 3]], carry: Carry, terms: &str, latitude: f64, c: &Conditions) -> Vec<f64> {
    let (north, up) = (EARTH * latitude.to_radians().cos(), EARTH * latitude.to_radians().sin());
    let mut f = SMatrix::<f64, 6, 6>::zeros();
    for (i, j, x) in
        [(0, 2, -up), (1, 2, north), (2, 0, up), (2, 1, -north), (0, 3, 1.0), (1, 4, 1.0), (2, 5, 1.0)]
    {
        f[(i, j)] = x;
    }
    let samples = (c.dwell_s / c.step_s).round() as usize;
    let h = c.dwell_s / samples as f64;
    let (mut step, mut term) = (SMatrix::<f64, 6, 6>::identity(), SMatrix::<f64, 6, 6>::identity());
    for order in 1..14 {
        term = term * f * (h / f64::from(order));
        step += term;
    }
    let k = degrees.len();
    let psis = if carry == Carry::Reset { 3 * k } else { 3 };
    let n = psis + 3 * terms.len();
    let mut rows: Vec<DVector<f64>> = Vec::new();
    let mut at: Vec<(f64, [f64; 3])> = Vec::new();
    let mut before = Matrix3::identity();
    // psi^n as a functional of the unknowns
    let mut psi = Matrix3xX::<f64>::zeros(n);
    // psi at the end in platform axes: under reset carry for every position, otherwise for the scheme; psi
    // carried in n is expressed in the axes of the first position
    let mut ends: Vec<Matrix3xX<f64>> = Vec::new();
    for (i, d) in degrees.iter().enumerate() {
        let turn = attitude(*d);
        let eps = drift(&turn, terms);
        match (i, carry) {
            (_, Carry::Reset) => {
                psi.fill(0.0);
                psi.view_mut((0, 3 * i), (3, 3)).copy_from(&turn);
            }
            (0, _) => psi.view_mut((0, 0), (3, 3)).copy_from(&turn),
            (_, Carry::Platform) => psi = turn * before.transpose() * psi,
            _ => {}
        }
        before = turn;
        for s in 1..=samples {
            let (own, by) = (step.fixed_view::<3, 3>(0, 0), step.fixed_view::<3, 3>(0, 3));
            let moved = by * &eps;
            psi = own * psi;
            psi.columns_mut(psis, n - psis).zip_apply(&moved, |x, y| *x += y);
            for (row, axis, sign) in [(2, 0, 1.0), (0, 2, -1.0)] {
                rows.push(psi.row(row).transpose() * sign);
                at.push(((i * samples + s) as f64 * h, [turn[(axis, 0)], turn[(axis, 1)], turn[(axis, 2)]]));
            }
        }
        match carry {
            Carry::Reset => ends.push(turn.transpose() * &psi),
            Carry::Platform if i + 1 == k => ends.push(turn.transpose() * &psi),
            Carry::Inertial if i + 1 == k => ends.push(attitude(degrees[0]).transpose() * &psi),
            _ => {}
        }
    }
    let sigma = c.accelerometer_instability_ug * 1e-6 * OF_B;
    let covariance = DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
        let ((t, a), (u, b)) = (at[i], at[j]);
        let along: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        let white = if i == j { c.accelerometer_noise_g.powi(2) } else { 0.0 };
        white + sigma * sigma * along * (-(t - u).abs() / c.accelerometer_correlation_s).exp()
    });
    let scale: Vec<f64> = (0..n).map(|j| if j < psis { 1f64.to_radians() } else { 1.0 }).collect();
    let design = DMatrix::from_fn(rows.len(), n, |i, j| rows[i][j] * scale[j]);
    let root = covariance.cholesky().expect("positive").l();
    let whitened = root.solve_lower_triangular(&design).expect("regular");
    let inverse = whitened.qr().r().try_inverse().expect("determined");
    let at_end = |functional: Vec<f64>| {
        let shown = DVector::from_iterator(n, functional.iter().zip(&scale).map(|(x, s)| x * s));
        inverse.tr_mul(&shown).norm().to_degrees()
    };
    let psi = ends
        .iter()
        .flat_map(|e| e.row_iter().map(|r| at_end(r.iter().copied().collect())).collect::<Vec<_>>());
    psi.chain(inverse.row_iter().skip(psis).map(|r| r.norm())).collect()
}

/// Random sequences under all carries, with correlation times from one sample to longer than the run, and
/// bias instability from zero to a hundred times the white noise.
#[test]
fn sigmas_are_those_of_least_squares_with_all_correlations() {
    let mut rng = SplitMix64::new(37);
    let mut between =
        |low: f64, high: f64| low + (high - low) * (rng.below(1 << 30) as f64 / f64::from(1 << 30));
    let (mut compared, mut differs) = (0, 0);
    for task in 0..24 {
        let carry = Carry::ALL[task % 3];
        let terms = ["FIOS", "FI", "F"][task / 3 % 3];
        let k = if terms == "FIOS" { 7 } else { 4 };
        let latitude = between(10.0, 70.0).round();
        let degrees: Vec<[f64; 3]> = (0..k)
            .map(|_| [between(-180.0, 180.0), between(-80.0, 80.0), between(-180.0, 180.0)].map(f64::round))
            .collect();
        let conditions = Conditions {
            dwell_s: 300.0,
            step_s: 30.0,
            ..correlated(10f64.powf(between(-1.0, 3.0)), 10f64.powf(between(1.5, 6.0)))
        };
        let base = Scheme {
            carry,
            latitude: latitude.to_string().parse().ok(),
            unknowns: terms
                .chars()
                .map(|t| t.to_string())
                .collect::<Vec<_>>()
                .join(",")
                .parse()
                .expect("terms"),
            ..Scheme::default()
        };
        let attitudes: Vec<_> = degrees.iter().map(|d| d.map(|x| Angle::from_degrees(x as i32))).collect();
        let all: Vec<usize> = (0..3 * terms.len()).collect();
        let path: Vec<usize> = (0..k).collect();
        let of = |conditions: &Conditions| {
            let evaluator = Evaluator::new(&base, &attitudes, &all, conditions).expect("an evaluator");
            [evaluator.psi_sigmas(&path).concat(), evaluator.sigmas(&path)].concat()
        };
        let (found, white) = (of(&conditions), of(&conditions.clone().without_drift_noise()));
        let expected = least_squares(&degrees, carry, terms, latitude, &conditions);
        if expected.iter().any(|x| *x > 1e5) {
            continue;
        }
        assert_eq!(found.len(), expected.len(), "{task} {carry} {terms}");
        for (found, expected) in found.iter().zip(&expected) {
            let off = (found / expected - 1.0).abs();
            assert!(off < 1e-5, "{task} {carry} {terms}: {found} {expected}");
            compared += 1;
        }
        differs += usize::from(white.iter().zip(&found).any(|(a, b)| b > &(a * 1.5)));
    }
    assert!(compared > 200 && differs > 5, "{compared} {differs}");
}

/// Unknown errors of accelerometers, slews that take time, and priors: against a filter with the biases as
/// states.
#[test]
fn sigmas_are_those_of_a_filter_with_biases() {
    let candidates = Candidates::grid(45_000_000_000).expect("a grid");
    let mut rng = SplitMix64::new(41);
    for (terms, carry, slew) in [
        ("F,I,O,S", Carry::Inertial, Some(0.2)),
        ("F,I,K0,K1,M3", Carry::Inertial, Some(1.0)),
        ("F,I,K0,K1,M3", Carry::Reset, None),
        ("F,O,K0,K2", Carry::Platform, None),
    ] {
        for (instability, correlation) in [(3.0, 60.0), (30.0, 2000.0)] {
            let mut conditions =
                Conditions { dwell_s: 200.0, slew_rate_deg_s: slew, ..correlated(instability, correlation) };
            let stated = [("D", 1.0), ("K0", 100.0), ("K1", 300.0), ("K2", 50.0), ("M", 60.0), ("psi", 0.01)];
            let stated = stated.map(|(name, value)| Assignment { name: name.into(), value });
            conditions.priors.extend(stated);
            let like = Scheme { unknowns: terms.parse().expect("terms"), ..base(carry) };
            let sequence: Vec<usize> =
                (0..6).map(|_| rng.below(candidates.names.len() as u64) as usize).collect();
            let attitudes: Vec<_> = sequence.iter().map(|&c| candidates.attitudes[c].clone()).collect();
            let mut scheme =
                Scheme { positions: Scheme::of_angles(attitudes.iter().cloned()).positions, ..like.clone() };
            scheme.simulation.slew_rate_deg_s = slew;
            let plan = Plan::new(&scheme, &conditions).expect("a plan");
            assert_eq!(plan.states(), plan.unknowns() + 3);
            let prior = RunStart::new(&plan, &conditions)
                .expect("a start")
                .covariance(CovarianceForm::Ud)
                .expect("a prior");
            let mut last = Vec::new();
            covariance_pass(&plan.stages, prior, |_, p| last = p.sigmas()).expect("a pass");
            let count = plan.platform.coefficients();
            let first = plan.unknowns() - count;
            let all: Vec<usize> = (0..count).collect();
            let evaluator = Evaluator::new(&like, &attitudes, &all, &conditions).expect("an evaluator");
            let path: Vec<usize> = (0..6).collect();
            let found = evaluator.sigmas(&path);
            for (c, found) in found.iter().enumerate() {
                let unit = match plan.platform.units()[first + c] {
                    unit if unit.starts_with("deg/h") => DPH,
                    "arcsec" => DPH,
                    _ => 1e-6,
                };
                let expected = last[first + c] / unit;
                assert!((found / expected - 1.0).abs() < 1e-5, "{terms} {carry} {c}: {found} {expected}");
            }
            assert_eq!(found.len(), count);
        }
    }
}

/// The design is the best of all sequences by least squares, in every order under every carry. The file of
/// the best scheme contains the noise, and its run has the promised sigma. No bound is stated, since bounds
/// hold for sums of information.
#[test]
#[ignore = "seconds: .ci/run"]
fn designs_count_correlated_noise() {
    let degrees = [[0.0, 0.0, 0.0], [90.0, 0.0, 90.0], [20.0, -40.0, 70.0], [110.0, 15.0, -35.0]];
    let mut candidates = Candidates::default();
    for d in degrees {
        candidates.add(d.map(|x| Angle::from_degrees(x as i32)));
    }
    for carry in Carry::ALL {
        let like = Scheme { unknowns: "F,I".parse().expect("terms"), ..base(carry) };
        let conditions = Conditions { dwell_s: 200.0, step_s: 20.0, ..correlated(20.0, 500.0) };
        let options = DesignOptions {
            candidates: candidates.clone(),
            criterion: CriterionName::A,
            everywhere: true,
            divide: true,
            ..options(Some(4))
        };
        let found = design(&like, &conditions, &options, &on).expect("designed");
        let search = found.search.as_ref().expect("a search");
        assert!(search.proven && search.order_matters && search.certificate.is_none(), "{carry}");
        let equal = found.found.iter().find(|f| f.dwells_s.is_empty()).expect("equal dwells");
        let rows = AttitudeRows::new(&like, &candidates.attitudes, &[0, 1, 2, 3, 4, 5], 1).expect("rows");
        let (mut least, mut orders) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..256 {
            let sequence: Vec<usize> = (0..4).map(|p| i / 4usize.pow(p) % 4).collect();
            let mut set = sequence.clone();
            set.sort_unstable();
            set.dedup();
            let degrees_of: Option<Vec<usize>> = rows.degrees(&set).into_iter().collect();
            if degrees_of.and_then(|d| d.into_iter().max()) != Some(equal.worst_degree) {
                continue;
            }
            let there: Vec<[f64; 3]> = sequence.iter().map(|&c| degrees[c]).collect();
            let sigmas = least_squares(&there, carry, "FI", 28.2, &conditions);
            let coefficients = &sigmas[sigmas.len() - 6..];
            let value = (coefficients.iter().map(|s| s * s).sum::<f64>() / 6.0).sqrt();
            least = least.min(value);
            if set.len() == 4 {
                orders = orders.max(value);
            }
        }
        assert!((equal.value / least - 1.0).abs() < 1e-5, "{carry}: {} {least}", equal.value);
        assert!(orders > least * (1.0 + 1e-5), "{carry}: {orders} {least}");
        // run of the best scheme with an almost uninformative prior
        for f in [equal, &found.found[0]] {
            let scheme = scheme_found(f, &like, &conditions).expect("a scheme");
            let wide =
                [("psi", 1e3), ("D", 1e6)].map(|(name, value)| Assignment { name: name.into(), value });
            let of_file = Conditions {
                drift_noise: "0 deg/h".parse().expect("none"),
                priors: wide.to_vec(),
                ..Conditions::of(&scheme)
            };
            let (run, _) = simulate(&scheme, &of_file, 1).expect("simulated");
            let drifts: Vec<f64> =
                run.quantities.iter().filter(|q| q.name.starts_with("D_")).map(|q| q.sigma).collect();
            let value = (drifts.iter().map(|s| s * s).sum::<f64>() / 6.0).sqrt();
            assert!((value / f.value - 1.0).abs() < 1e-3, "{carry}: {value} {f:?}");
        }
        if carry == Carry::Reset {
            let evaluator = Evaluator::new(&like, &candidates.attitudes, &[0, 1], &conditions).expect("one");
            assert!(evaluator.bound(&Criterion::D, 4, &[], &|| true).is_none());
            assert!(evaluator.everywhere(&Criterion::D, 4, &|| true).is_none());
            let free = DesignOptions { free: Some(5_000_000_000), ..options.clone() };
            let error = design(&like, &conditions, &free, &on).expect_err("refused");
            assert!(matches!(&error, DesignError::Free { found } if found.contains("correlated")), "{error}");
        }
    }
}

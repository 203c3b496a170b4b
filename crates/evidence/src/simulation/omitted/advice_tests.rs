//! Tests of the advice by applying it, of the carries side by side, and of correlated noise by an independent
//! covariance.

use nalgebra::DMatrix;
use obsdeg_core::model::{Carry, Platform, Scheme, Term, Unknowns, c_n_f64, cardinal, cardinal_names};

use super::tests::letters;
use super::{AdviceKind, OmittedEffects, omitted_effects};
use crate::simulation::{Attained, Conditions, is_rate};

/// Scheme of the five positions of least sigma, with a requirement that sigma meets and a bench of `sizes`.
fn benched(sizes: &[(&str, f64)]) -> Scheme {
    let mut scheme = letters(&["NUE", "USE", "ENU", "EUS", "DSW"], Carry::Inertial);
    scheme.requirements = [("D".to_string(), 0.1)].into();
    scheme.bench = sizes.iter().map(|(n, s)| (n.to_string(), *s)).collect();
    scheme
}

/// Accuracy of a scheme, and true if its requirements are met.
fn accuracy(scheme: &Scheme) -> (Attained, bool) {
    let conditions = Conditions::of(scheme);
    let attained = Attained::new(scheme, &conditions, 1).expect("sigmas");
    let met = attained.requirements(&conditions).expect("judged").all_met();
    (attained, met)
}

fn effects(scheme: &Scheme) -> (Attained, OmittedEffects, bool) {
    let (attained, met) = accuracy(scheme);
    let effects = omitted_effects(&attained, &Conditions::of(scheme), 1).expect("effects");
    (attained, effects, met)
}

/// Largest total over 0.1, and largest sigma, of the drift coefficients.
fn worst(of: &Attained) -> [f64; 2] {
    let units = of.plan.platform.units();
    let rates = (0..units.len()).filter(|&c| is_rate(units[c]));
    let largest =
        |of: &[Option<f64>]| rates.clone().map(|c| of[c].unwrap_or(f64::INFINITY)).fold(0.0, f64::max);
    [largest(&of.totals) / 0.1, largest(&of.sigmas)]
}

/// Scheme changed as an advice says, by hand.
fn applied(scheme: &Scheme, kind: AdviceKind, what: &str) -> Scheme {
    let mut out = scheme.clone();
    match kind {
        AdviceKind::Estimate => {
            let Unknowns::Coefficients(terms) = &mut out.unknowns else { panic!("coefficients") };
            for letters in what.split(',') {
                terms.push(Term::ALL.into_iter().find(|t| t.letters() == letters).expect("a term"));
            }
            terms.sort_unstable();
        }
        AdviceKind::Relevel => out.carry = what.parse().expect("a carry"),
        AdviceKind::AddPosition => {
            let angles = out.positions.iter().map(|p| p.angles.clone());
            let all: Vec<_> = angles.chain([cardinal(what).expect("an attitude")]).collect();
            out.positions = Scheme::of_angles(all).positions;
        }
    }
    out
}

/// Every advice, applied, gives its stated figures and improves the scheme; the added position is the best of
/// the 24. There is no advice without a bench, or where the bench uses up no margin.
#[test]
fn advice_does_what_it_says() {
    let (mut kinds, mut met_by, mut met_by_levelling) = (Vec::new(), 0, false);
    // of all 24 attitudes re-levelling suffices, as in the reference table
    let all = super::tests::by_letters();
    let mut all = letters(&all.iter().map(String::as_str).collect::<Vec<_>>(), Carry::Inertial);
    all.requirements = [("D".to_string(), 0.1)].into();
    all.bench = [("K0".to_string(), 100.0)].into();
    let five = [&[("K0", 20.0)][..], &[("K0", 20.0), ("M", 5.0), ("latitude", 10.0)], &[("M", 20.0)]];
    for scheme in five.map(benched).into_iter().chain([all]) {
        let sizes = scheme.bench.clone();
        let (before, of, met) = effects(&scheme);
        assert!(!met && !of.advice.is_empty(), "{sizes:?}");
        let now = worst(&before)[0];
        for a in &of.advice {
            let changed = applied(&scheme, a.kind, &a.what);
            let (after, met) = accuracy(&changed);
            let [over, _] = worst(&after);
            assert!((a.now / now - 1.0).abs() < 1e-9, "{a:?} {now}");
            assert!((a.total_over_required / over - 1.0).abs() < 1e-9, "{a:?} {over}");
            assert!(over < now && a.met == met, "{a:?}");
            kinds.push(a.kind);
            met_by += usize::from(met);
            met_by_levelling |= met && a.kind == AdviceKind::Relevel;
            if a.kind == AdviceKind::AddPosition {
                let any = cardinal_names()
                    .into_iter()
                    .map(|n| worst(&accuracy(&applied(&scheme, AdviceKind::AddPosition, &n)).0)[0]);
                assert!(any.fold(f64::INFINITY, f64::min) > over * (1.0 - 1e-9), "{a:?}");
            }
        }
    }
    for kind in [AdviceKind::Estimate, AdviceKind::Relevel, AdviceKind::AddPosition] {
        assert!(kinds.contains(&kind), "{kinds:?}");
    }
    assert!(met_by > 0 && met_by_levelling);
    for sizes in [&[][..], &[("K0", 1.0)]] {
        let (_, of, met) = effects(&benched(sizes));
        assert!(met && of.advice.is_empty(), "{sizes:?} {:?}", of.advice);
    }
}

/// K0 among the unknowns costs four percent of sigma here, as the method says.
#[test]
fn an_error_among_the_unknowns_costs_little() {
    let (before, of, _) = effects(&benched(&[("K0", 20.0)]));
    let found = of.advice.iter().find(|a| a.kind == AdviceKind::Estimate).expect("K0 estimated");
    let after = accuracy(&applied(&benched(&[]), AdviceKind::Estimate, "K0")).0;
    let names = before.plan.platform.names();
    let factor = |c: usize| {
        let other = after.plan.platform.names().iter().position(|n| *n == names[c]).expect("a name");
        after.sigmas[other].expect("a sigma") / before.sigmas[c].expect("a sigma")
    };
    let units = before.plan.platform.units();
    let largest = (0..names.len()).filter(|&c| is_rate(units[c])).map(factor).fold(0.0, f64::max);
    assert!((found.sigma_factor / largest - 1.0).abs() < 1e-9, "{found:?} {largest}");
    let [_, sigma] = worst(&before);
    assert!(worst(&after)[1] / sigma < 1.05, "{} {sigma}", worst(&after)[1]);
}

/// Outcomes of the carries equal those of the three schemes by themselves; reset carry reduces the bias of K0
/// and raises sigma.
#[test]
fn carries_are_traded_as_they_are() {
    let scheme = benched(&[("K0", 20.0)]);
    let (_, of, _) = effects(&scheme);
    assert_eq!(of.carries.len(), 3);
    assert_eq!(of.carries[0].carry, Carry::Inertial);
    for c in &of.carries {
        let alone = Scheme { carry: c.carry, ..scheme.clone() };
        let (attained, _) = accuracy(&alone);
        let Some(own) = &c.worst else {
            assert!(attained.totals.iter().any(Option::is_none), "{c:?}");
            continue;
        };
        let names = attained.plan.platform.names();
        let at = names.iter().position(|n| *n == own.unknown).expect("a name");
        let (sigma, total) = (attained.sigmas[at].expect("a sigma"), attained.totals[at].expect("a total"));
        assert!((own.total / (worst(&attained)[0] * 0.1) - 1.0).abs() < 1e-9, "{c:?}");
        assert!((own.sigma / sigma - 1.0).abs() < 1e-9 && (own.total / total - 1.0).abs() < 1e-9, "{c:?}");
        assert!((own.sigma.hypot(own.bias) / own.total - 1.0).abs() < 1e-9, "{c:?}");
    }
    let of_carry = |carry| of.carries.iter().find(|c| c.carry == carry).and_then(|c| c.worst.clone());
    if let (Some(inertial), Some(reset)) = (of_carry(Carry::Inertial), of_carry(Carry::Reset)) {
        assert!(reset.bias < 0.1 * inertial.bias && reset.sigma > inertial.sigma, "{reset:?} {inertial:?}");
    }
}

/// Factors of correlated noise equal the ratio of two sigmas by the information of all samples: with the full
/// covariance of a first-order Gauss-Markov process of each accelerometer, and with white noise alone.
#[test]
fn the_factor_of_correlated_noise_is_that_of_its_covariance() {
    let mut scheme = letters(&["NUE", "USE", "ENU", "EUS", "DSW"], Carry::Inertial);
    scheme.simulation.step_s = Some(100.0);
    let conditions = Conditions {
        accelerometer_instability_ug: 20.0,
        accelerometer_correlation_s: 700.0,
        step_s: 100.0,
        dwell_s: 1000.0,
        ..Conditions::default()
    };
    let attained = Attained::new(&scheme, &conditions, 1).expect("sigmas");
    let of = omitted_effects(&attained, &conditions, 1).expect("effects");
    let factors = of.correlated_noise.expect("factors");
    let state = conditions.accelerometer().states()[0];
    let platform = Platform::new(scheme.clone()).expect("a platform");
    let (angles, attitudes): (Vec<[f64; 3]>, Vec<_>) = scheme
        .positions
        .iter()
        .map(|p| &p.angles)
        .map(|e| (std::array::from_fn(|i| e[i].degrees().expect("a number")), c_n_f64(e)))
        .unzip();
    let columns = super::tests::columns_every(&platform, &angles, 1000.0, 100.0);
    let rows = columns[0].len();
    let j = DMatrix::from_fn(rows, columns.len(), |r, c| columns[c][r]);
    // row r: component r % 2 (Z1, Z3) at time 100 s (r / 2 + 1)
    let axis = |r: usize| 2 * (r % 2);
    let covariance = |bias: f64| {
        DMatrix::from_fn(rows, rows, |a, b| {
            let apart = 100.0 * (a / 2).abs_diff(b / 2) as f64;
            let [c, d] = [attitudes[a / 20], attitudes[b / 20]];
            let along: f64 = (0..3).map(|k| c[axis(a)][k] * d[axis(b)][k]).sum();
            let white = if a == b { 1e-10 } else { 0.0 };
            white + bias * along * (-apart / 700.0).exp()
        })
    };
    // unknowns of very different size: scaled columns
    let lengths: Vec<f64> = j.column_iter().map(|c| c.norm()).collect();
    let scaled = DMatrix::from_fn(rows, columns.len(), |r, c| j[(r, c)] / lengths[c]);
    let sigmas = |bias: f64| -> Vec<f64> {
        let root = covariance(bias).cholesky().expect("definite").l();
        let white = root.solve_lower_triangular(&scaled).expect("regular");
        let n = columns.len();
        let inverse = white.qr().r().solve_upper_triangular(&DMatrix::identity(n, n)).expect("regular");
        (0..n).map(|c| inverse.row(c).norm() / lengths[c]).collect()
    };
    let [with, without] = [sigmas(state.variance), sigmas(0.0)];
    let names = platform.names();
    let ratios: Vec<f64> =
        (0..names.len()).filter(|&c| names[c].starts_with("D_")).map(|c| with[c] / without[c]).collect();
    let largest = ratios.iter().copied().fold(0.0, f64::max);
    let smallest = ratios.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((factors.largest / largest - 1.0).abs() < 1e-4, "{factors:?} {largest}");
    assert!((factors.smallest / smallest - 1.0).abs() < 1e-4, "{factors:?} {smallest}");
    assert!(largest > 1.5, "{largest}");
}

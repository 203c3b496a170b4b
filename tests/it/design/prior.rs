//! Priors count in the criterion: against the information of all samples with that prior, by a simulation
//! plan, and against the filter's own run.

use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Carry, Scheme, parse_attitude};
use obsdeg_design::design::{
    Candidates, Criterion, CriterionName, DesignError, DesignOptions, Evaluator, design,
};
use obsdeg_ekf::SquareRootInformation;
use obsdeg_evidence::simulation::{Conditions, Plan, RunStart, batch, simulate};
use obsdeg_exact::SplitMix64;

use super::*;

/// Adds stated priors; later ones replace earlier ones.
fn with_priors(conditions: &Conditions, stated: &[(&str, f64)]) -> Conditions {
    let mut out = conditions.clone();
    out.priors.extend(stated.iter().map(|(name, value)| Assignment { name: (*name).into(), value: *value }));
    out
}

fn odd() -> Candidates {
    let mut out = Candidates::default();
    for name in ["NUE", "UEN", "DNE", "20,-40,70", "110,15,-35", "-65,50,160"] {
        out.add(parse_attitude(name).expect("an attitude"));
    }
    out
}

/// Scheme of a sequence of candidates.
fn scheme(like: &Scheme, candidates: &Candidates, sequence: &[usize], slew: Option<f64>) -> Scheme {
    let attitudes = sequence.iter().map(|&c| candidates.attitudes[c].clone());
    let mut out = Scheme { positions: Scheme::of_angles(attitudes).positions, ..like.clone() };
    out.simulation.slew_rate_deg_s = slew;
    out
}

/// Sigmas of all unknowns at the end, in the units of the answer, by all samples and the stated prior of the
/// run.
fn by_samples(scheme: &Scheme, conditions: &Conditions) -> Vec<(String, f64)> {
    let plan = Plan::new(scheme, conditions).expect("a plan");
    let prior = RunStart::new(&plan, conditions).expect("a start").sigma;
    let prior = SquareRootInformation::prior(&prior).expect("a prior");
    let batch = batch(&plan, prior).expect("a batch");
    let root = &batch.to_end * batch.information.inverse_root().expect("regular");
    let sigmas: Vec<f64> = root.row_iter().map(|row| row.norm()).collect();
    let units = plan.platform.units().iter().map(|u| match *u {
        "rad" => 1f64.to_radians(),
        "ug" | "ppm" => 1e-6,
        "arcsec" | "deg/h" | "deg/h/g" => 1f64.to_radians() / 3600.0,
        other => panic!("{other}"),
    });
    plan.platform.names().iter().cloned().zip(sigmas.iter().zip(units).map(|(s, u)| s / u)).collect()
}

/// Sigmas of coefficients and psi of random sequences, with priors of any width that differ between axes, and
/// with scaled drift priors.
#[test]
fn sigmas_are_those_of_all_samples_and_the_prior() {
    let candidates = odd();
    let mut rng = SplitMix64::new(31);
    let mut between =
        |low: f64, high: f64| low + (high - low) * (rng.below(1 << 30) as f64 / f64::from(1 << 30));
    let (mut compared, mut lowered) = (0, 0);
    for (terms, carry, slew) in [
        ("F,I,O,S", Carry::Platform, None),
        ("F,I,O,S", Carry::Inertial, None),
        ("F,I,O,S", Carry::Inertial, Some(0.5)),
        ("F,I,O,S", Carry::Reset, None),
        ("F,I,K0,K1,M3", Carry::Reset, None),
        ("F,O,K0", Carry::Platform, None),
    ] {
        for task in 0..4 {
            let like = Scheme { unknowns: terms.parse().expect("terms"), ..base(carry) };
            let mut wide = |low, high| 10f64.powf(between(low, high));
            let stated = [
                ("D", wide(-4.0, 3.0)),
                ("K0", wide(-1.0, 3.0)),
                ("K1", wide(-1.0, 3.0)),
                ("M", wide(-1.0, 3.0)),
                ("psi", wide(-6.0, 0.0)),
                ("D_I", wide(-4.0, 2.0)),
                ("psi_y", wide(-6.0, 0.0)),
                ("D_FX", wide(-4.0, 2.0)),
            ];
            let quiet = Conditions {
                slew_rate_deg_s: slew,
                dwell_s: [100.0, 1000.0][task % 2],
                drift_scale: [1.0, 3.0][task / 2],
                ..quiet()
            };
            let conditions = with_priors(&quiet, &stated);
            let k = 1 + task * 2;
            let sequence: Vec<usize> = (0..k).map(|_| between(0.0, 5.99) as usize).collect();
            let there = scheme(&like, &candidates, &sequence, slew);
            let expected = by_samples(&there, &conditions);
            let psis = 3 * if carry == Carry::Reset { k } else { 1 };
            let all: Vec<usize> = (0..expected.len() - psis).collect();
            let of = |conditions: &Conditions| {
                let evaluator =
                    Evaluator::new(&like, &candidates.attitudes, &all, conditions).expect("an evaluator");
                [evaluator.psi_sigmas(&sequence).concat(), evaluator.sigmas(&sequence)].concat()
            };
            let (found, without) = (of(&conditions), of(&quiet));
            assert_eq!(found.len(), expected.len(), "{terms} {carry}");
            for ((name, expected), found) in expected.iter().zip(&found) {
                assert!(
                    (found / expected - 1.0).abs() < 1e-5,
                    "{terms} {carry} {k} {name}: {found} {expected}"
                );
                compared += 1;
            }
            // the prior lowers some sigma by at least 10 %
            lowered +=
                usize::from(without.is_empty() || without.iter().zip(&found).any(|(a, b)| b < &(a * 0.9)));
        }
    }
    assert!(compared > 300 && lowered == 24, "{compared} {lowered}");
}

/// The sigma that a design promises is that of the filter at the end of a run. Its result is the best of all
/// sequences by the samples. Front, refinement and dwells include the prior too.
#[test]
#[ignore = "seconds: .ci/run release"]
fn designs_count_the_prior() {
    let candidates = odd();
    for (carry, k, slew, stated) in [
        (Carry::Platform, 3, None, [("D", 0.02), ("psi", 1e-3), ("D_FX", 1e-3)]),
        (Carry::Inertial, 3, None, [("D", 0.5), ("psi", 1e-4), ("psi_y", 1e-2)]),
        (Carry::Inertial, 3, Some(0.5), [("D", 0.05), ("psi", 1e-3), ("psi_x", 1e-4)]),
        (Carry::Reset, 3, None, [("D", 0.05), ("psi", 1e-3), ("D_FY", 0.2)]),
    ] {
        let like = Scheme { unknowns: "F".parse().expect("terms"), ..base(carry) };
        let conditions =
            with_priors(&Conditions { slew_rate_deg_s: slew, dwell_s: 200.0, ..quiet() }, &stated);
        let options = DesignOptions { candidates: candidates.clone(), ..options(Some(k)) };
        let found = design(&like, &conditions, &options, &on).expect("designed");
        let search = found.search.as_ref().expect("a search");
        assert!(search.proven, "{carry}");
        let said = search.prior.as_deref().expect("a prior");
        assert!(said.starts_with(&format!("D {}, psi {}", stated[0].1, stated[1].1)), "{said}");
        let first = &found.found[0];
        let written = obsdeg_design::design::scheme_found(first, &like, &conditions).expect("a scheme");
        let of_file =
            Conditions { drift_noise: "0 deg/h".parse().expect("none"), ..Conditions::of(&written) };
        let (run, _) = simulate(&written, &of_file, 1).expect("simulated");
        let drifts = run.quantities.iter().filter(|q| q.name.starts_with("D_"));
        let largest = drifts.map(|q| q.sigma).fold(0.0, f64::max);
        assert!((largest / first.value - 1.0).abs() < 1e-4, "{carry}: {largest} {first:?}");
        // no observable sequence with the smallest worst degree is better
        let largest = |sequence: &[usize]| {
            let there = scheme(&like, &candidates, sequence, slew);
            let drifts =
                by_samples(&there, &conditions).into_iter().filter(|(name, _)| name.starts_with("D_"));
            drifts.map(|(_, s)| s).fold(0.0, f64::max)
        };
        let rows = AttitudeRows::new(&like, &candidates.attitudes, &[0, 1, 2], 1).expect("rows");
        let n = candidates.names.len();
        let mut least = f64::INFINITY;
        for i in 0..n.pow(k as u32) {
            let sequence: Vec<usize> = (0..k).map(|p| i / n.pow(p as u32) % n).collect();
            let mut set = sequence.clone();
            set.sort_unstable();
            set.dedup();
            let degrees: Option<Vec<usize>> = rows.degrees(&set).into_iter().collect();
            if degrees.is_some_and(|d| d.into_iter().max() == Some(first.worst_degree)) {
                // either direction of a half turn may be the better one
                least = least.min(largest(&sequence));
            }
        }
        let tolerance = if slew.is_some() { 0.5 } else { 1e-5 };
        assert!(
            first.value <= least * (1.0 + 1e-5) && first.value > least * (1.0 - tolerance),
            "{carry}: {least}"
        );
        if let Some(c) = &search.certificate {
            assert!(c.best_possible <= first.value && c.best_possible > 0.3 * first.value, "{c:?}");
            assert!(c.front.iter().zip(&found.front).all(|(b, _)| b[1] > 0.0));
            for f in &found.front {
                let at = c.front.iter().find(|p| p[0] == f.total_s).expect("a bound at every time");
                assert!(f.value >= at[1] * (1.0 - 1e-9), "{f:?} {at:?}");
            }
        }
        for f in &found.front {
            let evaluator = Evaluator::new(&like, &candidates.attitudes, &[0, 1, 2], &conditions);
            let there = evaluator.expect("an evaluator").with_dwell(f.dwell_s).expect("a dwell");
            if slew.is_none() {
                let sequence = sequence_of(&candidates, &f.positions);
                let value = there.of_sequence(&sequence, &Criterion::Worst);
                assert!((value / f.value - 1.0).abs() < 1e-9, "{carry} {f:?}");
            }
        }
    }
}

/// The bound over all attitudes holds for random sets of attitudes. Priors of psi that differ by axis have no
/// such bound.
#[test]
fn all_attitudes_have_a_bound_with_a_prior() {
    let like = Scheme { unknowns: "F,I".parse().expect("terms"), ..base(Carry::Reset) };
    let grid = Candidates::grid(90_000_000_000).expect("a grid");
    let all: Vec<usize> = (0..6).collect();
    let conditions = with_priors(&quiet(), &[("D_I", 0.01), ("psi", 3e-4)]);
    let start = Evaluator::new(&like, &grid.attitudes, &all, &conditions).expect("an evaluator");
    let k = 4;
    let every = start.everywhere(&Criterion::D, k, &|| true).expect("a bound");
    assert!(every.value <= every.attained && every.attained < every.value * 1.05, "{every:?}");
    let without = Evaluator::new(&like, &grid.attitudes, &all, &quiet()).expect("an evaluator");
    let without = without.everywhere(&Criterion::D, k, &|| true).expect("a bound");
    assert!(every.value < 0.9 * without.value, "{every:?} {without:?}");
    let mut rng = SplitMix64::new(7);
    let mut best = f64::INFINITY;
    for _ in 0..300 {
        let mut angle =
            || obsdeg_core::model::Angle::from_nanodeg(rng.below(360_000_000_000) as i64 - 180_000_000_000);
        let attitudes: Vec<_> = (0..k).map(|_| [angle(), angle(), angle()]).collect();
        let there = Evaluator::new(&like, &attitudes, &all, &conditions).expect("an evaluator");
        best = best.min(there.of_sequence(&(0..k).collect::<Vec<_>>(), &Criterion::D));
    }
    assert!(best >= every.value && best < 3.0 * every.value, "{best} {every:?}");
    let uneven = with_priors(&conditions, &[("psi_x", 1e-4)]);
    let there = Evaluator::new(&like, &grid.attitudes, &all, &uneven).expect("an evaluator");
    assert!(there.everywhere(&Criterion::D, k, &|| true).is_none());
    assert!(there.bound(&Criterion::D, k, &[], &|| true).is_some());
    let free = DesignOptions {
        candidates: grid,
        criterion: CriterionName::D,
        free: Some(5_000_000_000),
        ..options(Some(k))
    };
    let error = design(&like, &uneven, &free, &on).expect_err("refused").to_string();
    assert!(error.ends_with("found priors of psi that differ by axis"), "{error}");
    let one = with_priors(&quiet(), &[("psi_x@1", 0.1)]);
    let error = design(&like, &one, &options(Some(k)), &on).expect_err("of one position");
    assert!(matches!(&error, DesignError::OnePosition { what: "prior", .. }), "{error}");
}

/// A turn of the platform axes is a symmetry only if it maps the prior to itself.
#[test]
fn symmetry_is_that_of_the_prior() {
    let order = |stated: &[(&str, f64)]| {
        let conditions = with_priors(&quiet(), stated);
        let options = DesignOptions { restarts: 1, ..options(Some(4)) };
        design(&base(Carry::Platform), &conditions, &options, &on).expect("designed").symmetry
    };
    let all = order(&[]);
    assert!(all > 1);
    assert_eq!(order(&[("D", 0.1), ("psi", 0.01)]), all);
    for uneven in [("psi_x", 0.01), ("D_FY", 0.1), ("D_I", 0.1)] {
        let found = order(&[uneven]);
        assert!(found < all || uneven.0 == "D_I", "{uneven:?}: {found}");
    }
}

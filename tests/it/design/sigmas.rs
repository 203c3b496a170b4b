//! Promised sigmas, against the filter, the covariance and comparisons; requirements on sigmas.

use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Carry, Scheme, SlewAxis, SlewTo};
use obsdeg_design::design::{
    Candidates, Criterion, CriterionName, DesignError, DesignOptions, Evaluator, SigmaLimits, design,
};
use obsdeg_ekf::SquareRootInformation;
use obsdeg_evidence::compare::predicted;
use obsdeg_evidence::simulation::{Conditions, Plan, batch, simulate};

use super::*;

/// The predicted sigma is that of the filter with an uninformative prior and no drift noise.
#[test]
fn the_predicted_sigma_is_that_of_the_filter() {
    for carry in Carry::ALL {
        let k = 7;
        let options = DesignOptions { restarts: 2, ..options(Some(k)) };
        let found = designed(carry, &options);
        let best = &found.found[0];
        let prior = |name: &str| Assignment { name: name.into(), value: 1e7 };
        let conditions = Conditions { priors: vec![prior("psi"), prior("D")], ..quiet() };
        let mut scheme = scheme_of(&best.positions, carry);
        for (i, p) in scheme.positions.iter_mut().enumerate() {
            p.name = format!("p{}", i + 1);
        }
        let (run, _) = simulate(&scheme, &conditions, 1).expect("simulated");
        let drifts = run.quantities.iter().filter(|q| q.name.starts_with("D_"));
        let largest = drifts.map(|q| q.sigma).fold(0.0, f64::max);
        assert!((largest / worst(best) - 1.0).abs() < 1e-4, "{carry}: {largest} {best:?}");
        // the errors of 30 runs agree too, within the 99.9 % limits for their number
        let square = |seed: u64| -> f64 {
            let (run, _) = simulate(&scheme, &conditions, seed).expect("simulated");
            let q = run.quantities.iter().find(|q| Some(&q.name) == best.worst.as_ref()).expect("the worst");
            (q.error / worst(best)).powi(2)
        };
        let mean = (0..30).map(square).sum::<f64>() / 30.0;
        let (low, high) = obsdeg_ekf::consistency::chi_square_band(1.0, 30.0, 0.999);
        assert!((low..high).contains(&mean), "{carry}: {mean} not in {low}..{high}");
    }
}

/// Every criterion against the covariance from the information of all samples.
#[test]
fn criteria_are_those_of_the_covariance() {
    let candidates = Candidates::cardinals();
    for carry in Carry::ALL {
        let sets = rows_of(carry, &candidates).observable_sets(7);
        let mut sequence = sets[sets.len() / 3].clone();
        sequence.rotate_left(3);
        let chosen: Vec<String> = sequence.iter().map(|&c| candidates.names[c].clone()).collect();
        let mut scheme = scheme_of(&chosen, carry);
        for (i, p) in scheme.positions.iter_mut().enumerate() {
            p.name = format!("p{}", i + 1);
        }
        let plan = Plan::new(&scheme, &quiet()).expect("a plan");
        let prior = SquareRootInformation::prior(&vec![1e6; plan.unknowns()]).expect("a prior");
        let covariance = batch(&plan, prior).expect("a batch").information.covariance().expect("regular");
        let first = plan.unknowns() - 12;
        let dph = 1f64.to_radians() / 3600.0;
        let block = covariance.view((first, first), (12, 12)) / (dph * dph);
        let evaluator = evaluator_of(carry, &candidates);
        let requirements: Vec<f64> = (1..=12).map(|i| 0.01 * f64::from(i)).collect();
        let sigmas: Vec<f64> = (0..12).map(|i| block[(i, i)].sqrt()).collect();
        let largest = |it: &mut dyn Iterator<Item = f64>| it.fold(0.0, f64::max);
        for (criterion, expected) in [
            (Criterion::Worst, largest(&mut sigmas.iter().copied())),
            (Criterion::A, (block.trace() / 12.0).sqrt()),
            (Criterion::D, block.clone().determinant().powf(1.0 / 24.0)),
            (Criterion::E, block.clone().symmetric_eigenvalues().max().sqrt()),
            (
                Criterion::Margin(SigmaLimits {
                    coefficients: requirements.clone(),
                    psi: [f64::INFINITY; 3],
                }),
                largest(&mut sigmas.iter().zip(&requirements).map(|(s, t)| s / t)),
            ),
        ] {
            let found = evaluator.of_sequence(&sequence, &criterion);
            assert!(
                (found / expected - 1.0).abs() < 1e-5,
                "{carry} {}: {found} {expected}",
                criterion.name()
            );
        }
    }
}

/// psi has requirements like the coefficients. The search uses the sigma of psi that a comparison states, and
/// its result is the best of all sequences by separate comparisons.
#[test]
#[ignore = "seconds: .ci/run"]
fn requirements_on_psi_count() {
    let mut candidates = Candidates::default();
    for name in ["NUE", "UEN", "DNE", "20,-40,70", "110,15,-35"] {
        candidates.add(obsdeg_core::model::parse_attitude(name).expect("an attitude"));
    }
    let require = |name: &str, value| Assignment { name: name.into(), value };
    let base_of = |carry| Scheme { unknowns: "F".parse().expect("terms"), ..base(carry) };
    for (carry, slew) in
        [(Carry::Platform, None), (Carry::Inertial, None), (Carry::Inertial, Some(0.5)), (Carry::Reset, None)]
    {
        let like = base_of(carry);
        let k = if carry == Carry::Reset { 3 } else { 2 };
        let mut seen: Vec<Vec<(String, Option<f64>)>> = Vec::new();
        let free = Conditions { slew_rate_deg_s: slew, requirements: Vec::new(), ..quiet() };
        let evaluator =
            Evaluator::new(&like, &candidates.attitudes, &[0, 1, 2], &free).expect("an evaluator");
        let n = candidates.names.len();
        let sequences: Vec<Vec<usize>> =
            (0..n.pow(k as u32)).map(|i| (0..k).map(|p| i / n.pow(p as u32) % n).collect()).collect();
        for sequence in &sequences {
            let mut scheme = Scheme {
                positions: Scheme::of_angles(sequence.iter().map(|&c| candidates.attitudes[c].clone()))
                    .positions,
                ..like.clone()
            };
            // direction of half turns that a search tries first
            for (i, turn) in evaluator.half_turns(&sequence.iter().map(|&c| c.into()).collect::<Vec<_>>()) {
                let (axis, angle) = (Some(SlewAxis::Direction(turn.about)), "180".parse().ok());
                scheme.positions[i].slew = Some(SlewTo { axis, angle, rate_deg_s: None });
            }
            let of = obsdeg_evidence::compare::predicted(&scheme, &free, 1).expect("predicted");
            let psi = evaluator.psi_sigmas(sequence).concat();
            if of.iter().all(|(_, sigma)| sigma.is_some()) {
                for ((name, sigma), found) in of.iter().zip(&psi) {
                    let sigma = sigma.expect("determined");
                    assert!(
                        (found / sigma - 1.0).abs() < 1e-5,
                        "{carry} {sequence:?} {name}: {found} {sigma}"
                    );
                }
            }
            seen.push(of);
        }
        // largest ratio of sigma to requirement of every sequence; infinite if an unknown is not determined
        let worst = |asked: &dyn Fn(&str) -> f64| -> Vec<f64> {
            let over =
                |(name, sigma): &(String, Option<f64>)| sigma.map_or(f64::INFINITY, |s| s / asked(name));
            seen.iter().map(|of| of.iter().map(over).fold(0.0, f64::max)).collect()
        };
        let requirement = |name: &str| match name {
            n if n.starts_with("psi_y") => 0.002,
            n if n.starts_with("psi") => 0.02,
            _ => 0.05,
        };
        let all = worst(&requirement);
        let best = all.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(best.is_finite() && psi_decides(&seen, &all, &requirement), "{carry}: nothing is tested");
        for (factor, meet) in [(1.0, false), (best * 1.0001, true), (best * 0.9999, true)] {
            let conditions = Conditions {
                requirements: vec![
                    require("D", 0.05 * factor),
                    require("psi", 0.02 * factor),
                    require("psi_y", 0.002 * factor),
                ],
                ..free.clone()
            };
            let options = DesignOptions {
                candidates: candidates.clone(),
                meet,
                criterion: CriterionName::Margin,
                ..options(Some(k))
            };
            let found = design(&like, &conditions, &options, &on);
            if meet && factor < best {
                assert!(matches!(found, Err(DesignError::NotMet { .. })), "{carry}: {found:?}");
                continue;
            }
            let found = found.expect("designed");
            let first = &found.found[0];
            // the smallest worst degree comes first; all sequences that determine everything have the same
            // one here
            assert!((first.value * factor / best - 1.0).abs() < 1e-5, "{carry}: {} {best}", first.value);
            let margin = first.requirements.worst.as_ref().expect("a margin");
            assert!((margin.margin * first.value - 1.0).abs() < 1e-6, "{margin:?}");
            assert_eq!(first.requirements.all_met(), first.value <= 1.0);
            let count = 3 + 3 * if carry == Carry::Reset { k } else { 1 };
            assert_eq!(first.requirements.stated, count);
        }
        // with selected coefficients psi does not count
        let some = DesignOptions {
            candidates: candidates.clone(),
            meet: true,
            required: vec!["D_FX".into()],
            ..options(Some(k))
        };
        let conditions =
            Conditions { requirements: vec![require("D", 1.0), require("psi", 1e-9)], ..free.clone() };
        let found = design(&like, &conditions, &some, &on).expect("designed");
        assert_eq!(found.found[0].requirements.stated, 1);
    }
    let one = Conditions { requirements: vec![require("psi_x@1", 0.1)], ..quiet() };
    let error = design(&base_of(Carry::Reset), &one, &options(Some(3)), &on).expect_err("of one position");
    assert!(error.to_string().contains("`psi_x@1`"), "{error}");
}

/// True if some fully determined sequence has its smallest margin at psi.
fn psi_decides(seen: &[Vec<(String, Option<f64>)>], worst: &[f64], asked: &dyn Fn(&str) -> f64) -> bool {
    seen.iter().zip(worst).any(|(of, worst)| {
        let psi = of.iter().filter(|(name, _)| name.starts_with("psi"));
        worst.is_finite() && psi.filter_map(|(name, s)| Some(s.as_ref()? / asked(name))).any(|x| x == *worst)
    })
}

/// Coefficients that are not required are estimated too. Their sigma may be infinite; the other sigmas are
/// those of all samples.
#[test]
fn what_is_not_required_may_be_lost() {
    let candidates = Candidates::cardinals();
    // two positions under platform carry: no D_I and no separate D_FZ, but D_FX and D_SX
    let required = [0, 9];
    let evaluator = Evaluator::new(&base(Carry::Platform), &candidates.attitudes, &required, &quiet());
    let sequence = sequence_of(&candidates, &["NUE".into(), "NDW".into()]);
    let sigmas = evaluator.expect("an evaluator").sigmas(&sequence);
    let chosen: Vec<String> = ["NUE", "NDW"].map(String::from).to_vec();
    let mut scheme = scheme_of(&chosen, Carry::Platform);
    scheme.positions[1].name = "p2".into();
    let plan = Plan::new(&scheme, &quiet()).expect("a plan");
    let prior = obsdeg_evidence::simulation::diffuse_prior(&plan).expect("a prior");
    let prior = SquareRootInformation::prior(&prior).expect("a prior");
    let all = batch(&plan, prior).expect("a batch").information.sigmas().expect("regular");
    for (own, c) in sigmas.iter().zip([3, 12]) {
        let expected = all[c].to_degrees() * 3600.0;
        assert!((own / expected - 1.0).abs() < 1e-6, "{own} {expected}");
    }
    assert_eq!(sigmas.len(), 2);
}

/// Every listed scheme has the sigma and the time that a comparison of schemes states.
#[test]
fn listed_schemes_are_what_a_comparison_says() {
    let slews = Conditions { slew_rate_deg_s: Some(0.5), ..quiet() };
    let scheme = base(Carry::Inertial);
    let mut skew = 0;
    for (required, k) in [(vec!["D_F".to_string()], 3), (Vec::new(), 5)] {
        let options = DesignOptions { required: required.clone(), keep: 10, restarts: 2, ..options(Some(k)) };
        let found = design(&scheme, &slews, &options, &on).expect("designed");
        assert!(found.found.len() == 10 && found.found.iter().any(|f| !f.half_turns.is_empty()));
        for f in found.found.iter().chain(&found.front) {
            let there = scheme_found(f, &scheme);
            skew += f.half_turns.iter().filter(|t| t.about.iter().all(|x| x.abs() < 0.9)).count();
            let sigmas = predicted(&there, &slews, 1).expect("predicted");
            let sigma =
                |name: &String| sigmas.iter().find(|s| s.0 == *name).and_then(|s| s.1).expect("a sigma");
            let largest = found.required.iter().map(sigma).fold(0.0, f64::max);
            assert!((largest / worst(f) - 1.0).abs() < 1e-6, "{largest} {f:?}");
            let seconds = Plan::new(&there, &slews).expect("a plan").duration_s();
            assert!((seconds - f.total_s).abs() < 1e-6, "{seconds} {f:?}");
        }
    }
    assert!(skew > 0);
}

/// Torquer errors are no errors of accelerometers, but raise the number of unknowns beyond that of drifts.
#[test]
#[ignore = "seconds: .ci/run release"]
fn all_drifts_and_torquers_are_searched() {
    let terms = "F,I,O,S,II,OO,IO,IS,OS,GS,GM";
    let conditions = ["--terms", terms, "--carry", "platform", "--format", "json"];
    let asked = ["design", "--positions", "6", "--observable", "D_F", "--restarts", "1"];
    let found = crate::program::json(&[&asked[..], &conditions].concat());
    let best = &found["found"][0];
    let positions: Vec<&str> = best["positions"]
        .as_array()
        .expect("positions")
        .iter()
        .map(|p| p.as_str().expect("letters"))
        .collect();
    let angles: Vec<&str> = positions.iter().flat_map(|p| ["--angles", p]).collect();
    let run = crate::program::json(&[&["simulate"], &angles[..], &conditions].concat());
    let all = run["quantities"].as_array().expect("unknowns").iter();
    let drifts = all.filter(|q| q["name"].as_str().is_some_and(|n| n.starts_with("D_F")));
    let largest = drifts.filter_map(|q| q["predicted_sigma"].as_f64()).fold(0.0, f64::max);
    let value = best["value"].as_f64().expect("a number");
    assert!(largest > 0.0 && (value / largest - 1.0).abs() < 1e-6, "{value} {largest}: {positions:?}");
}

//! Searches with unknown errors of the accelerometers and the torquers.

use obsdeg_core::model::{Carry, Scheme, parse_attitude};
use obsdeg_design::design::{
    AttitudeRows, Best, CandidateSymmetry, Candidates, Constraints, Criterion, CriterionName, DesignError,
    DesignOptions, Evaluator, SequenceSearch, design,
};
use obsdeg_evidence::compare::predicted;
use obsdeg_evidence::simulation::Conditions;
use obsdeg_exact::SplitMix64;

use super::*;

fn whole(terms: &str, carry: Carry) -> Scheme {
    Scheme { unknowns: terms.parse().expect("terms"), ..base(carry) }
}

/// Sigmas of random sequences are those of comparisons, each in the unit of its coefficient.
#[test]
#[ignore = "seconds: .ci/run release"]
fn sigmas_are_those_of_comparisons() {
    let mut odd = Candidates::cardinals();
    for attitude in ["20,-40,70", "110,15,-35", "-65,50,160"] {
        odd.add(parse_attitude(attitude).expect("an attitude"));
    }
    let cardinal = Candidates::cardinals();
    let mut rng = SplitMix64::new(29);
    for (terms, carry, slew) in [
        ("F,I,O,S,K0,K1", Carry::Platform, None),
        ("F,I,O,S,K0,K1,M3", Carry::Reset, None),
        ("F,I,K0,K1,M6,K2,K3", Carry::Inertial, None),
        ("F,O,K0,Kx", Carry::Inertial, Some(0.7)),
        ("F,S,GS,GM", Carry::Platform, None),
        ("F,GS,GM3,M6", Carry::Reset, None),
        ("F,GS,GM", Carry::Inertial, Some(1.0)),
        ("all", Carry::Inertial, Some(0.5)),
    ] {
        let like = whole(terms, carry);
        let conditions = Conditions { slew_rate_deg_s: slew, ..quiet() };
        let torqued = terms.contains("GS") || terms == "all";
        let candidates = if torqued && carry == Carry::Inertial { &cardinal } else { &odd };
        let first = Scheme { positions: scheme_of(&["NUE".into()], carry).positions, ..like.clone() };
        let names = obsdeg_core::model::Platform::new(first).expect("a platform").names()[3..].to_vec();
        let all: Vec<usize> = (0..names.len()).collect();
        let evaluator =
            Evaluator::new(&like, &candidates.attitudes, &all, &conditions).expect("an evaluator");
        let mut compared = 0;
        for _ in 0..4 {
            let k = 9 + rng.below(4) as usize;
            let n = candidates.names.len() as u64;
            let sequence: Vec<usize> = (0..k).map(|_| rng.below(n) as usize).collect();
            let attitudes = sequence.iter().map(|&c| candidates.attitudes[c].clone());
            let mut scheme = Scheme { positions: Scheme::of_angles(attitudes).positions, ..like.clone() };
            scheme.simulation.slew_rate_deg_s = slew;
            let expected = predicted(&scheme, &conditions, 1).expect("predicted");
            let expected: Option<Vec<f64>> =
                names.iter().map(|name| expected.iter().find(|s| s.0 == *name)?.1).collect();
            // an undetermined unknown has no sigma
            let Some(expected) = expected else { continue };
            let found = evaluator.sigmas(&sequence);
            assert_eq!(found.len(), names.len(), "{terms} {carry}");
            // an almost undetermined unknown loses all digits in the normal equations
            if expected.iter().any(|s| *s > 1e5) {
                continue;
            }
            for ((name, found), expected) in names.iter().zip(&found).zip(&expected) {
                assert!((found / expected - 1.0).abs() < 1e-5, "{terms} {carry} {name}: {found} {expected}");
            }
            compared += 1;
        }
        assert!(compared > 0, "{terms} {carry}");
    }
}

/// Sigmas in different units are not compared. Coefficients that are not required are estimated too.
#[test]
fn units_are_not_compared() {
    let like = whole("F,O,K0,K1", Carry::Reset);
    let wanted = |criterion, required: &[&str]| {
        let required = required.iter().map(ToString::to_string).collect();
        let options = DesignOptions { criterion, required, restarts: 2, ..options(Some(5)) };
        design(&like, &quiet(), &options, &on)
    };
    for (criterion, name) in
        [(CriterionName::Worst, "worst"), (CriterionName::A, "A "), (CriterionName::E, "E ")]
    {
        let refused = wanted(criterion, &[]).expect_err("refused");
        assert!(matches!(refused, DesignError::Units { .. }), "{refused}");
        let refused = refused.to_string();
        for part in ["--observable", "D_FX [deg/h]", "K0_X [ug]", "K1_X [ppm]", name] {
            assert!(refused.contains(part), "{refused}");
        }
    }
    let unit = |criterion, required: &[&str]| {
        let found = wanted(criterion, required).expect("designed");
        let best = &found.found[0];
        assert_eq!(best.worst_sigma_dph.is_some(), found.required.iter().any(|r| r.starts_with("D_")));
        found.search.expect("a search").unit
    };
    assert_eq!(unit(CriterionName::D, &[]), None);
    assert_eq!(unit(CriterionName::Worst, &["D_F", "D_O"]).as_deref(), Some("deg/h"));
    assert_eq!(unit(CriterionName::A, &["K0"]).as_deref(), Some("ug"));
}

/// The best of all sequences under platform carry, by a separate evaluation of each.
#[test]
fn the_best_is_the_best_of_all() {
    let mut candidates = Candidates::default();
    for name in ["NUE", "UEN", "DNE", "20,-40,70", "110,15,-35"] {
        candidates.add(parse_attitude(name).expect("an attitude"));
    }
    let like = whole("F,K0,K1", Carry::Platform);
    let k = 4;
    let options =
        DesignOptions { candidates: candidates.clone(), criterion: CriterionName::D, ..options(Some(k)) };
    let found = design(&like, &quiet(), &options, &on).expect("designed");
    assert!(found.search.expect("a search").proven);
    let n = candidates.names.len();
    let mut least = f64::INFINITY;
    for i in 0..n.pow(k as u32) {
        let chosen = (0..k).map(|p| candidates.attitudes[i / n.pow(p as u32) % n].clone());
        let scheme = Scheme { positions: Scheme::of_angles(chosen).positions, ..like.clone() };
        let plan = obsdeg_evidence::simulation::Plan::new(&scheme, &quiet()).expect("a plan");
        let prior = vec![1e6; plan.unknowns()];
        let prior = obsdeg_ekf::SquareRootInformation::prior(&prior).expect("a prior");
        let all = obsdeg_evidence::simulation::batch(&plan, prior).expect("a batch");
        let covariance = all.information.covariance().expect("regular");
        let units = [1f64.to_radians() / 3600.0, 1e-6, 1e-6];
        let block =
            nalgebra::DMatrix::from_fn(9, 9, |i, j| covariance[(3 + i, 3 + j)] / units[i / 3] / units[j / 3]);
        // an undetermined coefficient keeps the sigma of the prior
        if block.diagonal().iter().all(|v| *v < 1e12) {
            least = least.min(block.determinant().powf(1.0 / 18.0));
        }
    }
    let best = found.found[0].value;
    assert!((best / least - 1.0).abs() < 1e-5, "{best} {least}");
}

/// Slew sequences on which torquer errors act: results are observable and have the sigmas that a comparison
/// states, half turns included.
#[test]
fn slew_sequences_by_sigma() {
    let like = whole("F,GS,GM,K0,K1,M3", Carry::Inertial);
    let conditions = Conditions { slew_rate_deg_s: Some(1.0), ..quiet() };
    let options = DesignOptions { criterion: CriterionName::D, restarts: 3, keep: 3, ..options(Some(7)) };
    let found = design(&like, &conditions, &options, &on).expect("designed");
    let search = found.search.clone().expect("a search");
    assert!(!search.proven && search.degree_floor.is_none() && !found.minimum.proven);
    let half: usize = found.found.iter().map(|f| f.half_turns.len()).sum();
    assert!(half > 0, "{found:?}");
    for f in &found.found {
        let mut scheme = scheme_found(f, &like);
        scheme.simulation.slew_rate_deg_s = Some(1.0);
        let sigmas = predicted(&scheme, &conditions, 1).expect("predicted");
        let of = |name: &String| sigmas.iter().find(|s| s.0 == *name).and_then(|s| s.1).expect("a sigma");
        let name = f.worst.as_ref().expect("a drift");
        let promised = f.worst_sigma_dph.expect("a sigma");
        assert!((of(name) / promised - 1.0).abs() < 1e-5, "{name} {promised} {}", of(name));
        assert_eq!(f.rank[0], f.rank[1]);
    }
    let refused = |conditions: &Conditions, options: DesignOptions| {
        design(&like, conditions, &options, &on).expect_err("refused").to_string()
    };
    assert!(refused(&quiet(), options.clone()).contains("found repositioning at once"));
    let refined = DesignOptions { refine: true, ..options.clone() };
    assert!(refused(&conditions, refined).contains("found --refine"));
    let mut odd = Candidates::cardinals();
    odd.add(parse_attitude("20,-40,70").expect("an attitude"));
    let odd = DesignOptions { candidates: odd, ..options };
    assert!(refused(&conditions, odd).contains("found candidate 20,-40,70"));
}

/// Images under turns of the platform axes are equally good: the best of the searched representatives is the
/// best of all sequences, with as many ties.
#[test]
fn turned_schemes_are_equally_good() {
    let candidates = Candidates::cardinals();
    let mut orders = Vec::new();
    for terms in ["F,K0", "F,K1", "F,M3", "F,M6", "F,K0,K2", "F,GM3", "F,GS"] {
        for carry in [Carry::Platform, Carry::Reset] {
            // only the earth rate torques the platform, with three values: rounding decides the ties
            if (terms, carry) == ("F,GM3", Carry::Reset) {
                continue;
            }
            let like = whole(terms, carry);
            let rows = AttitudeRows::new(&like, &candidates.attitudes, &[0, 1, 2], 1).expect("rows");
            let evaluator =
                Evaluator::new(&like, &candidates.attitudes, &[0, 1, 2], &quiet()).expect("an evaluator");
            let of = |symmetry: &CandidateSymmetry| {
                let search = SequenceSearch {
                    rows: &rows,
                    slew_sequences: false,
                    evaluator: &evaluator,
                    criterion: &Criterion::Worst,
                    constraints: &Constraints::default(),
                    keep: 1,
                    floor: 0,
                    progress: &on,
                };
                search.exhaust(symmetry, 3)
            };
            let symmetry = rows.symmetry(&|i, j| (i < 3) == (j < 3));
            orders.push(symmetry.order);
            let (some, all) = (of(&symmetry), of(&CandidateSymmetry::none(24)));
            let best = |of: &Best| of.found.first().map(|f| f.score.value);
            match best(&some).zip(best(&all)) {
                Some((some, all)) => {
                    assert!((some / all - 1.0).abs() < 1e-7, "{terms} {carry}: {some} {all}")
                }
                None => assert_eq!(best(&some), best(&all), "{terms} {carry}"),
            }
            assert_eq!(some.ties.total(symmetry.order), all.ties.total(1), "{terms} {carry}");
        }
    }
    // turns do not preserve a triangle of misalignments, but they preserve bias and scale factor
    assert!(orders.contains(&24) && orders.iter().any(|o| *o < 24), "{orders:?}");
}

//! Division of the total time among positions, against the information of all samples that a simulation plan
//! computes from the scheme.

use obsdeg_core::model::{Carry, Dwell, Scheme};
use obsdeg_design::design::{CriterionName, DesignOptions, design, scheme_found};
use obsdeg_evidence::compare::predicted;
use obsdeg_evidence::simulation::Conditions;

use super::{base, on, options};

/// Criterion of a scheme with dwells in multiples of ten seconds.
fn value(scheme: &Scheme, tens: &[usize], conditions: &Conditions, criterion: CriterionName) -> f64 {
    let mut scheme = scheme.clone();
    for (p, tens) in scheme.positions.iter_mut().zip(tens) {
        p.dwell = Dwell::from_seconds(10.0 * *tens as f64);
    }
    let sigmas = predicted(&scheme, conditions, 1).expect("sigmas");
    let sigmas = sigmas.into_iter().filter(|(name, _)| name.starts_with("D_"));
    let sigmas: Vec<f64> = sigmas.map(|(_, sigma)| sigma.expect("determined")).collect();
    match criterion {
        CriterionName::A => (sigmas.iter().map(|s| s * s).sum::<f64>() / sigmas.len() as f64).sqrt(),
        _ => sigmas.iter().copied().fold(0.0, f64::max),
    }
}

/// The divided time is better than equal dwells, has the stated criterion, and moving a step from one
/// position to another does not improve it. Where the criterion is smooth and every dwell stays positive, the
/// gain of one step is the same at all positions. Under reset carry some dwells vanish, since one long dwell
/// is better than two short ones.
#[test]
fn time_is_divided_as_well_as_can_be() {
    let step = Conditions { dwell_s: 200.0, ..super::quiet() };
    for (carry, k, criterion) in [
        (Carry::Platform, 7, CriterionName::A),
        (Carry::Inertial, 7, CriterionName::Worst),
        (Carry::Reset, 7, CriterionName::A),
    ] {
        let options = DesignOptions {
            divide: true,
            criterion,
            keep: 1,
            restarts: 4,
            within: Some(0.5),
            ..options(Some(k))
        };
        let found = design(&base(carry), &step, &options, &on).expect("designed");
        let (divided, equal) = (&found.found[0], &found.found[1]);
        assert!(equal.dwells_s.is_empty() && divided.value < equal.value, "{carry}: {divided:?}");
        assert_eq!(divided.positions, equal.positions);
        let tens: Vec<usize> = divided.dwells_s.iter().map(|s| (s / 10.0).round() as usize).collect();
        assert!((divided.total_s / equal.total_s - 1.0).abs() < 1e-9, "{divided:?}");
        assert_eq!(tens.iter().sum::<usize>(), 20 * k);
        assert!(found.front.iter().any(|f| f.total_s == divided.total_s && f.value <= divided.value));
        let scheme = scheme_found(divided, &base(carry), &step).expect("a scheme");
        let at = |tens: &[usize]| value(&scheme, tens, &step, criterion);
        let best = at(&tens);
        assert!((best / divided.value - 1.0).abs() < 1e-6, "{carry}: {best} {divided:?}");
        assert!((at(&vec![20; k]) / equal.value - 1.0).abs() < 1e-6);
        let mut gains = Vec::new();
        for to in 0..k {
            let mut longer = tens.clone();
            longer[to] += 1;
            gains.push(best - at(&longer));
            for from in (0..k).filter(|&from| from != to && tens[from] > 1) {
                let mut moved = longer.clone();
                moved[from] -= 1;
                assert!(at(&moved) >= best * (1.0 - 1e-9), "{carry}: {from} {to} {tens:?}");
            }
        }
        if carry == Carry::Platform {
            // equal up to the second difference of one step (the variance falls with the cube of a dwell)
            let (least, most) =
                (gains.iter().copied().fold(f64::MAX, f64::min), gains.iter().copied().fold(0.0, f64::max));
            assert!(least > 0.0 && most < least * 1.6, "{carry}: {gains:?} {tens:?}");
        }
    }
}

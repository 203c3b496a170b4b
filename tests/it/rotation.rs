//! Rotating segments: all attitudes of an arc in one position.

use obsdeg_core::analysis::Analysis;
use obsdeg_core::model::{Carry, Rotation, Scheme, parse_attitude};
use obsdeg_evidence::simulation::{Conditions, simulate};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

use crate::schemes::judged;

/// Scheme from texts such as `NUE@X_p:360` or `10,20,30`.
fn scheme(parts: &[&str], carry: Carry) -> Scheme {
    let split = |part: &&str| {
        part.split_once('@').map_or((part.to_string(), None), |(a, r)| (a.into(), Some(r.to_string())))
    };
    let parts: Vec<(String, Option<String>)> = parts.iter().map(split).collect();
    let mut out = Scheme::of_angles(parts.iter().map(|(a, _)| parse_attitude(a).expect("an attitude")));
    for (position, (_, rotation)) in out.positions.iter_mut().zip(&parts) {
        position.rotation = rotation.as_ref().map(|r| {
            let (about, angle) = r.split_once(':').expect("about:angle");
            Rotation::new(about, angle).expect("a rotation")
        });
    }
    Scheme { carry, ..out }
}

fn degrees(a: &Analysis) -> Vec<(String, Option<usize>)> {
    let mut out: Vec<_> = a.quantities.iter().map(|q| (q.name.clone(), q.degree)).collect();
    out.sort();
    out
}

/// Reference verdicts, derived independently of the program.
#[test]
fn reference_verdicts() {
    let both = judged(&scheme(&["NUE@X_p:360", "NUE@Z_p:360"], Carry::Inertial));
    assert_eq!(both.rank_profile, [2, 14, 15]);
    assert_eq!(judged(&scheme(&["NUE@X_p:360"], Carry::Inertial)).rank, 11);
    assert_eq!(judged(&scheme(&["NUE@U:360"], Carry::Inertial)).rank, 6);
    assert_eq!(judged(&scheme(&["NUE@Y_p:-360"], Carry::Inertial)).rank, 6);
}

proptest! {
    #![proptest_config(Config { cases: 40, rng_seed: RngSeed::Fixed(2), ..Config::default() })]

    /// A rotation is equivalent to many positions on its arc with psi^n carried between them: the chosen
    /// stations suffice, and more add nothing. Each axis starts where its turn changes one Euler angle.
    #[test]
    fn a_rotation_is_all_positions_of_its_arc(
        [a, b, c] in prop::array::uniform3(-170i32..170),
        axis in 0usize..6,
        arc in prop::sample::select(vec![-360, -75, 40, 90, 200, 360, 720]),
        at in prop::collection::vec(0.0f64..1.0, 14),
        squared in any::<bool>(),
    ) {
        let (about, start, moves) = match axis {
            0 => ("X_p", [a, 0, 0], 0),
            1 => ("Y_p", [a, b, 0], 1),
            2 => ("Z_p", [a, b, c], 2),
            3 => ("N", [a, b, c], 0),
            4 => ("U", [0, b, c], 1),
            _ => ("E", [0, 0, c], 2),
        };
        let text = |x: [f64; 3]| format!("{},{},{}", x[0], x[1], x[2]);
        let start = start.map(f64::from);
        let rotating = format!("{}@{about}:{arc}", text(start));
        // psi refers to the first position
        let positions: Vec<String> = std::iter::once(0.0)
            .chain(at)
            .map(|part| {
                let mut angles = start;
                angles[moves] -= (part * f64::from(arc)).round();
                text(angles)
            })
            .collect();
        let positions: Vec<&str> = positions.iter().map(String::as_str).collect();
        let terms = if squared { "F,I,O,S,II,SS,IS" } else { "F,I,O,S" };
        let with_terms = |s: Scheme| Scheme { unknowns: terms.parse().expect("terms"), ..s };
        let whole = judged(&with_terms(scheme(&[&rotating], Carry::Inertial)));
        let sampled = judged(&with_terms(scheme(&positions, Carry::Inertial)));
        prop_assert_eq!(&whole.rank_profile, &sampled.rank_profile, "{} {:?}", rotating, positions);
        prop_assert_eq!(degrees(&whole), degrees(&sampled));
    }

    /// If a rotation ends at the attitude of the next position, psi does not jump, so that two carries give
    /// the same verdicts. psi in platform axes is carried from the end of the rotation, not from its start.
    #[test]
    fn psi_is_handed_on_where_a_rotation_ends(arc in -350i32..350, b in -80i32..80, c in -170i32..170) {
        prop_assume!(arc.abs() > 1);
        let rotating = format!("0,0,0@N:{arc}");
        let end = format!("{},0,0@Z_p:{c}", -arc);
        prop_assume!(c != 0);
        let parts = [rotating.as_str(), end.as_str()];
        prop_assert_eq!(
            degrees(&judged(&scheme(&parts, Carry::Platform))),
            degrees(&judged(&scheme(&parts, Carry::Inertial)))
        );
        // a jump of psi generally makes a difference, which the rank of V_0 shows
        let jump = format!("{},{b},0", 90 - arc);
        let parts = [rotating.as_str(), jump.as_str()];
        let profile = |carry| judged(&scheme(&parts, carry)).rank_profile[0];
        prop_assert_eq!((profile(Carry::Inertial), profile(Carry::Platform)), (2, 3));
    }
}

/// The filter runs through a rotation and is consistent with its covariance, against linear and exact truth.
/// Every sigma falls below half its prior.
#[test]
fn a_rotation_is_simulated() {
    let scheme = scheme(&["NUE@X_p:360", "NUE@Z_p:360"], Carry::Inertial);
    for truth in ["linear", "exact"] {
        let conditions = Conditions {
            truth: serde_json::from_value(serde_json::json!(truth)).expect("a truth"),
            drift_scale: 1e-3,
            ..Conditions::default()
        };
        let (s, _) = simulate(&scheme, &conditions, 1).expect("simulated");
        assert!(s.consistency.consistent, "{truth}: {:?}", s.consistency);
        assert_eq!(s.timeline.len(), 2);
    }
    let (s, _) = simulate(&scheme, &Conditions::default(), 1).expect("simulated");
    assert!(s.consistency.consistent && s.quantities.iter().all(|q| q.sigma < 0.5 * q.prior_sigma), "{s:?}");
}

#[test]
fn what_is_no_rotation_is_refused() {
    for (about, angle, expected) in
        [("X", "360", "X_p"), ("X_p", "0", "0.001"), ("X_p", "alpha", "decimal"), ("up", "90", "geographic")]
    {
        let refused = Rotation::new(about, angle).expect_err("refused").to_string();
        assert!(refused.contains(expected), "{refused}");
    }
}

//! Reference verdicts: rank profiles and degrees that were derived independently of this program.

use std::collections::{BTreeMap, BTreeSet};

use obsdeg_core::analysis::Analysis;
use obsdeg_core::degree::Status;
use obsdeg_core::model::{Carry, Scheme, Unknowns, cardinal, cardinal_names};

use crate::program::cases;
use crate::schemes::{S6, judged, scheme};

fn degree(a: &Analysis, name: &str) -> Option<usize> {
    a.quantities.iter().find(|q| q.name == name).expect("an unknown").degree
}

/// Degrees of all unknowns whose names satisfy a filter.
fn degrees(a: &Analysis, which: impl Fn(&str) -> bool) -> Vec<Option<usize>> {
    a.quantities.iter().filter(|q| which(&q.name)).map(|q| q.degree).collect()
}

fn all(a: &Analysis, which: impl Fn(&str) -> bool, expected: Option<usize>) -> bool {
    let found = degrees(a, which);
    !found.is_empty() && found.iter().all(|d| *d == expected)
}

fn psi(n: &str) -> bool {
    n.starts_with("psi")
}
fn input(n: &str) -> bool {
    n.starts_with("D_I")
}
fn other(n: &str) -> bool {
    n.starts_with("D_") && !input(n)
}

fn drift(latitude: Option<&str>, measured_azimuth: bool) -> Analysis {
    judged(&Scheme {
        unknowns: Unknowns::Drift,
        latitude: latitude.map(|l| l.parse().expect("a latitude")),
        measured_azimuth,
        combinations: vec!["eps_z^n - wN*psi_y^n".into()],
        ..scheme(&["0,0,0"], Carry::Platform)
    })
}

#[test]
fn single_position() {
    let a = drift(None, false);
    assert_eq!(a.rank_profile, [2, 4, 5]);
    for (name, expected) in [
        ("psi_x^n", Some(0)),
        ("psi_z^n", Some(0)),
        ("eps_x^n", Some(1)),
        ("eps_y^n", Some(2)),
        ("psi_y^n", None),
        ("eps_z^n", None),
    ] {
        assert_eq!(degree(&a, name), expected, "{name}");
    }
    let asked = a.combinations.iter().find(|c| c.requested).expect("asked for");
    assert_eq!((asked.status, asked.degree), (Status::Observable, Some(1)));
}

#[test]
fn single_position_at_pole_and_equator_and_with_azimuth() {
    let pole = drift(Some("90"), false);
    assert_eq!((pole.rank, degree(&pole, "eps_y^n"), degree(&pole, "eps_z^n")), (4, None, Some(1)));
    assert_eq!(drift(Some("-90"), false).rank, 4);
    assert_eq!(drift(Some("0"), false).rank, 5);
    assert_eq!(drift(Some("28.2"), false).rank, 5);
    let azimuth = drift(None, true);
    assert_eq!((azimuth.rank, degree(&azimuth, "eps_y^n")), (6, Some(1)));
}

/// The unknowns from which an unknown is indistinguishable depend on the unobservable directions, not on the
/// choice of a basis. At -90, 0, 0 (D_FY, psi_z) and (D_OY, psi_z) are not observable, hence D_FY = 1, D_OY =
/// -+1 is not either.
#[test]
fn unknowns_indistinguishable_from_another() {
    let partners = |s: &Scheme| -> BTreeMap<String, BTreeSet<String>> {
        let list = judged(s).quantities;
        list.into_iter().map(|q| (q.name, q.partners.into_iter().collect())).collect()
    };
    let set = |names: &[&str]| names.iter().map(ToString::to_string).collect::<BTreeSet<String>>();
    let mut single = scheme(&["-90,0,0"], Carry::Platform);
    let found = partners(&single);
    assert!(found["D_FY"].is_superset(&set(&["D_OY", "psi_z"])), "{found:?}");
    assert!(found["D_OY"].is_superset(&set(&["D_FY", "psi_z"])), "{found:?}");
    single.measured_azimuth = true;
    assert!(partners(&single)["D_FY"].contains("D_OY"));
    // the pole, and schemes of all kinds: the relation is mutual and includes the unknowns of every printed
    // direction
    let cardinals = ["0,0,0", "180,0,0", "0,-90,90", "90,180,-90", "0,90,0"];
    let mut schemes: Vec<Scheme> = Carry::ALL
        .iter()
        .flat_map(|&carry| {
            (1..=5)
                .step_by(cases(2, 1))
                .flat_map(move |n| [scheme(&cardinals[..n], carry), scheme(&S6[..n], carry)])
        })
        .collect();
    for s in schemes.clone() {
        schemes.push(Scheme { latitude: "90".parse().ok(), ..s });
    }
    for s in &schemes {
        let found = partners(s);
        for (name, others) in &found {
            assert!(
                !others.contains(name) && others.iter().all(|o| found[o].contains(name)),
                "{name}: {found:?}"
            );
        }
        for direction in judged(s).null_space {
            let all: BTreeSet<String> = direction.iter().map(|c| c.name.clone()).collect();
            for name in &all {
                let mut with_itself = found[name].clone();
                with_itself.insert(name.clone());
                assert!(with_itself.is_superset(&all), "{name}: {found:?}");
            }
        }
    }
}

#[test]
fn the_papers_two_positions() {
    let p1p2 = ["0,0,0", "180,0,0"];
    let a = judged(&scheme(&p1p2, Carry::Platform));
    assert_eq!(a.rank_profile, [2, 6, 8]);
    for (name, expected) in
        [("psi_x", 0), ("psi_z", 0), ("D_FX", 1), ("D_FY", 2), ("D_IY", 2), ("D_SX", 1), ("D_SZ", 1)]
    {
        assert_eq!(degree(&a, name), Some(expected), "{name}");
    }
    let status = |name: &str| a.quantities.iter().find(|q| q.name == name).map(|q| q.status);
    for name in ["D_IX", "D_IZ", "D_OX", "D_OY", "D_OZ", "D_SY"] {
        assert_eq!(status(name), Some(Status::NotExcited), "{name}");
    }
    let psi_y = a.quantities.iter().find(|q| q.name == "psi_y").expect("psi_y");
    assert_eq!(
        (psi_y.status, psi_y.partners.as_slice()),
        (Status::Inseparable, ["D_FZ".to_string()].as_slice())
    );
    let combinations: Vec<(&str, Option<usize>)> =
        a.combinations.iter().map(|c| (c.expression.as_str(), c.degree)).collect();
    assert_eq!(combinations, [("D_FZ - wN*psi_y", Some(1))]);

    let inertial = judged(&scheme(&p1p2, Carry::Inertial));
    assert_eq!((degree(&inertial, "D_FZ"), degree(&inertial, "D_SZ")), (Some(1), None));
    assert!(inertial.quantities.iter().any(|q| q.name == "D_SZ" && q.partners == ["psi_y"]));

    let reset = judged(&scheme(&p1p2, Carry::Reset));
    for (name, expected) in [
        ("D_FX", Some(1)),
        ("D_SX", Some(1)),
        ("D_FY", Some(2)),
        ("D_IY", Some(2)),
        ("D_FZ", None),
        ("D_SZ", None),
    ] {
        assert_eq!(degree(&reset, name), expected, "{name}");
    }
    assert!(
        reset.unknowns.contains(&"psi_x@1".to_string()) && reset.unknowns.contains(&"psi_z@2".to_string())
    );
}

#[test]
fn six_positions() {
    let a = judged(&scheme(&S6, Carry::Platform));
    assert_eq!(a.rank_profile, [3, 14, 15]);
    assert!(all(&a, psi, Some(0)) && all(&a, input, Some(2)) && all(&a, other, Some(1)));
    let a = judged(&scheme(&S6, Carry::Inertial));
    assert_eq!(a.rank_profile, [2, 14, 15]);
    assert!(all(&a, psi, Some(1)) && all(&a, input, Some(2)) && all(&a, other, Some(1)));
    let a = judged(&scheme(&S6, Carry::Reset));
    assert_eq!((a.rank_profile.as_slice(), a.unknowns.len()), ([12, 24, 30].as_slice(), 30));
    assert!(all(&a, |n| n.starts_with("D_"), Some(2)));
    assert_eq!(a.quantities.iter().filter_map(|q| q.degree).max(), Some(2));
    assert!(a.quantities.iter().all(|q| q.degree.is_some()));
}

#[test]
fn five_and_four_positions() {
    let a = judged(&scheme(&S6[..5], Carry::Platform));
    assert_eq!(a.rank_profile, [3, 13, 15]);
    assert!(all(&a, |n| n.starts_with("D_"), Some(2)));
    let a = judged(&scheme(&S6[..5], Carry::Inertial));
    assert_eq!(a.rank_profile, [2, 12, 15]);
    assert!(all(&a, |_| true, Some(2)));
    let a = judged(&scheme(&S6[..4], Carry::Platform));
    assert_eq!(a.rank_profile, [3, 11, 15]);
    assert!(all(&a, psi, Some(0)) && all(&a, |n| n.starts_with("D_"), Some(2)));
    let a = judged(&scheme(&S6[..4], Carry::Inertial));
    assert_eq!((a.rank_profile.as_slice(), a.rank), ([2, 10, 14].as_slice(), 14));
}

#[test]
fn all_cardinal_attitudes() {
    let angles = cardinal_names().iter().filter_map(|n| cardinal(n)).collect::<Vec<_>>();
    assert_eq!(angles.len(), 24);
    let a = judged(&Scheme { carry: Carry::Inertial, ..Scheme::of_angles(angles) });
    assert_eq!(a.rank_profile, [2, 12, 15]);
    assert!(all(&a, input, Some(2)) && all(&a, other, Some(1)));
}

/// Fewest positions for all 12 coefficients at generic attitudes: platform 4, inertial 5, reset 6.
#[test]
fn fewest_positions() {
    for (carry, fewest) in [(Carry::Platform, 4), (Carry::Inertial, 5), (Carry::Reset, 6)] {
        let complete = |n: usize| {
            let angles =
                (0..n).map(|i| std::array::from_fn(|k| format!("a{i}x{k}").parse().expect("a name")));
            let a = judged(&Scheme { carry, ..Scheme::of_angles(angles) });
            degrees(&a, |n| n.starts_with("D_")).iter().all(Option::is_some)
        };
        assert!(complete(fewest) && !complete(fewest - 1), "{carry}");
    }
}

/// Accuracy orders derived independently from information matrices (log-log slopes).
#[test]
fn accuracy_orders() {
    let orders = |n: usize, carry| {
        let a = judged(&scheme(&S6[..n], carry));
        let order = |which: fn(&str) -> bool| -> Vec<Option<usize>> {
            let mut found: Vec<_> =
                a.quantities.iter().filter(|q| which(&q.name)).map(|q| q.accuracy_order).collect();
            found.dedup();
            found
        };
        [order(psi), order(input), order(other)]
    };
    let one = |k: usize| vec![Some(k)];
    assert_eq!(orders(4, Carry::Platform), [one(1), one(2), one(2)]);
    assert_eq!(orders(5, Carry::Platform), [one(0), one(1), one(1)]);
    assert_eq!(orders(6, Carry::Platform), [one(0), one(1), one(1)]);
    assert_eq!(orders(5, Carry::Inertial)[1], one(2));
    assert_eq!(orders(6, Carry::Inertial), [one(1), one(2), one(1)]);
    for carry in Carry::ALL {
        let a = judged(&scheme(&["0,0,0", "180,0,0"], carry));
        assert!(a.quantities.iter().all(|q| q.accuracy_order == q.degree), "{carry}");
    }
    // unequal dwells have the same orders
    let mut uneven = scheme(&S6, Carry::Platform);
    for (position, dwell) in uneven.positions.iter_mut().zip(["1000", "333.25", "7", "500", "250.5", "80"]) {
        position.dwell = Some(dwell.parse().expect("a dwell"));
    }
    let a = judged(&uneven);
    assert!(a.quantities.iter().filter(|q| input(&q.name)).all(|q| q.accuracy_order == Some(1)));
}

/// At a pole the drift about the vertical changes the azimuth without an effect on Z; the next position
/// reveals it.
#[test]
fn dwell_shows_more_than_derivatives_at_a_pole() {
    let tilted =
        Scheme { latitude: Some("90".parse().expect("a latitude")), ..scheme(&S6[..5], Carry::Platform) };
    let a = judged(&tilted);
    assert!(a.quantities.iter().any(|q| q.degree.is_none() && q.accuracy_order == Some(1)), "{a:?}");
}

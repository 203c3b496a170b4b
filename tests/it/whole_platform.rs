//! Accelerometers, torquers and mounting (section 10 of the method): the reference verdicts, a second path
//! independent of the engine, and laws on random schemes.

use obsdeg_core::degree::{Degrees, judge};
use obsdeg_core::model::{
    Carry, Path, Platform, Rotation, Scheme, Unknowns, c_n_f64, cardinal_names, parse_attitude,
};
use obsdeg_exact::SplitMix64;

use crate::program::cases;

fn unknowns(terms: &str) -> Unknowns {
    terms.parse().expect("terms")
}

fn at(attitudes: &[&str]) -> Scheme {
    Scheme::of_angles(attitudes.iter().map(|a| parse_attitude(a).expect("an attitude")))
}

fn cardinals() -> Scheme {
    let names = cardinal_names();
    at(&names.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Random slew sequence with turns of 90 degrees about platform axes.
fn slew_sequence(positions: usize, seed: u64) -> Scheme {
    let mut rng = SplitMix64::new(seed);
    let names = cardinal_names();
    let columns: Vec<[[i64; 3]; 3]> = names.iter().map(|n| integer_attitude(n)).collect();
    let mut here = columns.iter().position(|c| *c == integer_attitude("NUE")).expect("one of them");
    let mut visited = vec![names[here].clone()];
    while visited.len() < positions {
        let (axis, back) = (rng.below(3) as usize, rng.below(2) == 1);
        // C exp([e x] 90 deg): the axes j and k become k and -j, or -k and j
        let c = columns[here];
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut next = c;
        let sign = if back { -1 } else { 1 };
        for r in 0..3 {
            next[r][j] = sign * c[r][k];
            next[r][k] = -sign * c[r][j];
        }
        here = columns.iter().position(|c| *c == next).expect("a cardinal attitude");
        visited.push(names[here].clone());
    }
    let mut scheme = at(&visited.iter().map(String::as_str).collect::<Vec<_>>());
    scheme.carry = Carry::Inertial;
    scheme.path = Some(Path::OneAxis);
    scheme
}

/// Attitude matrix `C_c^n` of three letters: column j is the direction of platform axis j in North, Up, East.
fn integer_attitude(name: &str) -> [[i64; 3]; 3] {
    let mut c = [[0; 3]; 3];
    for (j, letter) in name.chars().enumerate() {
        let (row, sign) = match letter {
            'N' => (0, 1),
            'S' => (0, -1),
            'U' => (1, 1),
            'D' => (1, -1),
            'E' => (2, 1),
            _ => (2, -1),
        };
        c[row][j] = sign;
    }
    c
}

fn exact(scheme: &Scheme) -> (Vec<String>, Degrees) {
    let platform = Platform::new(scheme.clone()).expect("a scheme");
    let degrees = judge(&platform, 1).expect("verdicts").degrees;
    (platform.names().to_vec(), degrees)
}

/// Numbers of coefficients of degree 0, 1, 2 and not observable.
fn by_degree((names, degrees): &(Vec<String>, Degrees)) -> [usize; 4] {
    let mut out = [0; 4];
    for (_, degree) in names.iter().zip(&degrees.degree).filter(|(n, _)| !n.starts_with("psi")) {
        out[degree.unwrap_or(3)] += 1;
    }
    out
}

/// Rows of the reference table with 24 cardinal attitudes.
#[test]
fn cardinal_attitudes() {
    type Row<'a> = (&'a str, [(&'a [usize], [usize; 4]); 3]);
    let table: [Row<'_>; 3] = [
        (
            "F,I,O,S,K0,K1",
            [(&[9, 18, 21], [6, 9, 3, 0]), (&[8, 18, 21], [6, 9, 3, 0]), (&[54, 87, 90], [6, 9, 3, 0])],
        ),
        (
            "F,I,O,S,K0,K1,M3",
            [(&[12, 21, 24], [9, 9, 3, 0]), (&[11, 21, 24], [9, 9, 3, 0]), (&[54, 87, 93], [6, 6, 9, 0])],
        ),
        (
            "F,I,O,S,K0,K1,M3,K2",
            [(&[15, 24, 27], [12, 9, 3, 0]), (&[14, 24, 27], [12, 9, 3, 0]), (&[54, 87, 96], [3, 3, 18, 0])],
        ),
    ];
    for (terms, rows) in table {
        for (carry, (profile, degrees)) in Carry::ALL.into_iter().zip(rows) {
            let found = exact(&Scheme { carry, unknowns: unknowns(terms), ..cardinals() });
            assert_eq!(found.1.rank_profile, profile, "{terms} {carry}");
            assert_eq!(by_degree(&found), degrees, "{terms} {carry}");
        }
    }
}

/// Rows of the reference table with slews, 31 positions.
#[test]
fn self_calibration_with_slews() {
    for seed in [1, 2, 3] {
        for (terms, observable) in [
            ("F,I,O,S,GS,GM,K0,K1,M3,K2", Some([21, 9, 3, 0])),
            ("F,I,O,S,GS,GM3,K0,K1,M6,K2", Some([21, 9, 3, 0])),
            ("F,I,O,S,GS,GM,K0,K1,M6,K2", None),
        ] {
            let found = exact(&Scheme { unknowns: unknowns(terms), ..slew_sequence(31, seed) });
            assert_eq!(found.1.rank_profile, [23, 33, 36], "{terms} {seed}");
            match observable {
                Some(expected) => assert_eq!(by_degree(&found), expected, "{terms} {seed}"),
                None => assert_eq!(found.0.len(), 39),
            }
        }
    }
}

mod floats;

/// Positions of a scheme in floating point.
fn legs(scheme: &Scheme) -> Vec<floats::Leg> {
    let platform = Platform::new(scheme.clone()).expect("a scheme");
    let back = |m: &floats::M| -> floats::M { std::array::from_fn(|i| std::array::from_fn(|j| m[j][i])) };
    let mut end: Option<floats::M> = None;
    let mut legs = Vec::new();
    for (i, position) in scheme.positions.iter().enumerate() {
        let attitude = c_n_f64(&position.angles);
        let slew = end.filter(|_| platform.paths().get(i).is_some_and(|p| !p.is_empty())).map(|from| {
            // a turn of less than half: its axis is that of the odd part of C_from^T C_to
            let r = floats::times(&back(&from), &attitude);
            let odd = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
            let sine = odd.iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0;
            let cosine = (r[0][0] + r[1][1] + r[2][2] - 1.0) / 2.0;
            assert!(sine > 1e-3, "no half turns here");
            (odd.map(|x| x / (2.0 * sine)), sine.atan2(cosine))
        });
        let rotation = position.rotation.as_ref().map(|r| {
            let unit: [f64; 3] = std::array::from_fn(|k| f64::from(u8::from(k == r.axis.index)));
            let of_n: [f64; 3] = std::array::from_fn(|k| attitude[r.axis.index][k]);
            (if r.axis.geographic { of_n } else { unit }, (r.angle.nanodeg() as f64 / 1e9).to_radians())
        });
        end =
            Some(rotation.map_or(attitude, |(u, angle)| floats::times(&attitude, &floats::turn(&u, angle))));
        legs.push(floats::Leg { attitude, slew, rotation });
    }
    legs
}

/// Rank profile and degrees of a scheme by the second path.
fn by_floats(scheme: &Scheme) -> (Vec<usize>, Vec<Option<usize>>) {
    let terms = scheme.unknowns.to_string();
    floats::judge(&terms.split(',').collect::<Vec<_>>(), &legs(scheme), scheme.carry)
}

fn both_paths_agree(scheme: &Scheme) {
    let (names, degrees) = exact(scheme);
    let (profile, found) = by_floats(scheme);
    let rest = profile.len().min(degrees.rank_profile.len());
    assert_eq!(profile[..rest], degrees.rank_profile[..rest], "{} {}", scheme.unknowns, scheme.carry);
    assert_eq!(profile.last(), degrees.rank_profile.last());
    for ((name, exact), float) in names.iter().zip(&degrees.degree).zip(&found) {
        assert_eq!(exact, float, "{name} of {} {}", scheme.unknowns, scheme.carry);
    }
}

/// The second path confirms the reference table, and verdicts for random terms and attitudes, with slews of
/// 90, 120 and other angles.
#[test]
fn a_second_path() {
    second_paths(cases(4, 12));
}

/// Random terms and attitudes, rotations and rotations by samples, more of each.
#[test]
#[ignore = "full length: .ci/run release"]
fn second_paths_at_length() {
    second_paths(60);
    rotations_by_the_second_path(36);
    rotations_by_samples(40);
}

fn second_paths(cases: usize) {
    for terms in ["F,I,O,S,K0,K1", "F,I,O,S,K0,K1,M3,K2"] {
        for carry in Carry::ALL {
            both_paths_agree(&Scheme { carry, unknowns: unknowns(terms), ..cardinals() });
        }
    }
    for terms in ["all", "F,I,O,S,GS,GM3,K0,K1,M6,K2", "F,I,O,S,GS,GM,K0,K1,M6,K2"] {
        both_paths_agree(&Scheme { unknowns: unknowns(terms), ..slew_sequence(31, 5) });
    }
    let all =
        ["F", "I", "O", "S", "II", "OO", "SS", "GS", "GM", "GM3", "K0", "K1", "M6", "M3", "K2", "K3", "Kx"];
    let mut rng = SplitMix64::new(11);
    for case in 0..cases {
        let mut chosen: Vec<&str> = all.into_iter().filter(|_| rng.below(2) == 0).collect();
        for (whole, triangle) in [("GM", "GM3"), ("M6", "M3")] {
            if chosen.contains(&whole) {
                chosen.retain(|t| *t != triangle);
            }
        }
        if chosen.is_empty() {
            continue;
        }
        let carry = Carry::ALL[case % 3];
        let positions = 3 + rng.below(6) as usize;
        let mut scheme = slew_sequence(positions, rng.next_u64());
        if case % 2 == 1 {
            // any attitudes, each reached from the one before by a turn about a platform axis
            let start = ["10,25,40", "-70,15,130"][case % 4 / 2];
            scheme = turned_about(start, positions, &mut rng);
        }
        both_paths_agree(&Scheme { carry, unknowns: unknowns(&chosen.join(",")), ..scheme });
    }
}

/// Positions reached by turning one gimbal at a time.
fn turned_about(start: &str, positions: usize, rng: &mut SplitMix64) -> Scheme {
    let mut angles: Vec<i64> = start.split(',').map(|a| a.parse().expect("degrees")).collect();
    let mut list = vec![start.to_string()];
    while list.len() < positions {
        angles[rng.below(3) as usize] += [35, -50, 90, 120, -15][rng.below(5) as usize];
        list.push(angles.iter().map(ToString::to_string).collect::<Vec<_>>().join(","));
    }
    let mut scheme = at(&list.iter().map(String::as_str).collect::<Vec<_>>());
    scheme.carry = Carry::Inertial;
    scheme.path = Some(Path::Gimbals);
    scheme
}

/// Fewest generic positions that make all coefficients observable.
#[test]
fn fewest_positions() {
    let mut rng = SplitMix64::new(3);
    let generic: Vec<String> = (0..9)
        .map(|_| {
            (0..3)
                .map(|_| format!("{:.1}", rng.below(3500) as f64 / 10.0 - 175.0))
                .collect::<Vec<_>>()
                .join(",")
        })
        .collect();
    for (terms, fewest) in
        [("F,I,O,S,K0,K1", [4, 5, 6]), ("F,I,O,S,K0,K1,M3", [4, 5, 7]), ("F,I,O,S,K0,K1,M3,K2", [5, 5, 8])]
    {
        for (carry, expected) in Carry::ALL.into_iter().zip(fewest) {
            let enough = |positions: usize| {
                let attitudes: Vec<&str> = generic[..positions].iter().map(String::as_str).collect();
                by_degree(&exact(&Scheme { carry, unknowns: unknowns(terms), ..at(&attitudes) }))[3] == 0
            };
            let found = (1..=9).find(|&k| enough(k));
            assert_eq!(found, Some(expected), "{terms} {carry}");
        }
    }
}

/// Laws on random schemes: one more unknown never lowers a degree. GM with M6 leaves at least three more
/// directions unobservable than GM with M3 unless psi is reset. The verdicts on the relative mounting are the
/// same in every frame.
#[test]
fn laws() {
    let mut rng = SplitMix64::new(23);
    let gyros = ["F", "I", "O", "S", "GS"];
    let accelerometers = ["K0", "K1", "K2", "K3", "Kx"];
    for case in 0..40 {
        let carry = Carry::ALL[case % 3];
        let positions = 2 + rng.below(8) as usize;
        let scheme = if case % 2 == 0 {
            slew_sequence(positions, case as u64)
        } else {
            turned_about("5,20,-35", positions, &mut rng)
        };
        let mut terms: Vec<&str> =
            gyros.into_iter().chain(accelerometers).filter(|_| rng.below(2) == 0).collect();
        let of =
            |terms: &[&str]| exact(&Scheme { carry, unknowns: unknowns(&terms.join(",")), ..scheme.clone() });
        let defect = |(names, degrees): &(Vec<String>, Degrees)| names.len() - degrees.rank();
        terms.push("GM");
        let (small, with_m3, with_m6) =
            (of(&terms), of(&[&terms[..], &["M3"]].concat()), of(&[&terms[..], &["M6"]].concat()));
        let larger = |a: &(Vec<String>, Degrees), b: &(Vec<String>, Degrees)| {
            for (name, degree) in a.0.iter().zip(&a.1.degree) {
                let there = b.0.iter().position(|n| n == name).expect("an unknown of both");
                let never = |d: Option<usize>| d.unwrap_or(usize::MAX);
                assert!(never(b.1.degree[there]) >= never(*degree), "{name} {terms:?} {carry}");
            }
        };
        larger(&small, &with_m3);
        larger(&with_m3, &with_m6);
        let rotations = if carry == Carry::Reset { 0 } else { 3 };
        assert!(defect(&with_m6) >= defect(&with_m3) + rotations, "{terms:?} {carry}");
        assert!(defect(&with_m6) >= 3, "{terms:?} {carry}");
        // the frame of the gyros: the same rank, apart from the terms that define the frame
        terms.retain(|t| *t != "GM");
        let with_gm3 = of(&[&terms[..], &["GM3", "M6"]].concat());
        assert_eq!(with_gm3.1.rank(), with_m3.1.rank(), "{terms:?} {carry}");
        for (a, b) in with_m3.0.iter().zip(&with_m3.1.degree) {
            let Some(there) = with_gm3.0.iter().position(|n| n == a) else { continue };
            let mounting = a.starts_with("psi") || a.starts_with("GM") || a.starts_with("M_");
            assert!(mounting || with_gm3.1.degree[there] == *b, "{a} of {terms:?} {carry}");
        }
    }
}

/// Wrong use is refused or explained.
#[test]
fn wrong_use_has_a_reason() {
    use obsdeg_core::analysis::{AnalysisOptions, analyze};
    let inertial = |terms: &str| Scheme {
        carry: Carry::Inertial,
        unknowns: unknowns(terms),
        ..at(&["NUE", "NED", "DNE"])
    };
    let refused = Platform::new(inertial("F,GS")).expect_err("no path").to_string();
    assert!(refused.contains("GS") && refused.contains("path = \"one-axis\""), "{refused}");
    let odd = Scheme { path: Some(Path::OneAxis), ..inertial("F,GS") };
    let odd = Scheme { positions: at(&["10,20,30", "-40,70,5"]).positions, ..odd };
    let refused = Platform::new(odd).expect_err("no exact turn").to_string();
    assert!(refused.contains("no exact form") && refused.contains("gimbals"), "{refused}");
    let notes = |scheme: &Scheme| {
        let options = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
        analyze(scheme, options, None).expect("an answer").notes.join("\n")
    };
    let cardinal = inertial("K1,K3,Kx,F,II,OO,SS");
    let stated = notes(&cardinal);
    for part in ["K1 and K3 are not told apart", "Kx is not excited", "are never told apart"] {
        assert!(stated.contains(part), "{stated}");
    }
    assert!(
        notes(&Scheme { carry: Carry::Platform, ..inertial("F,GS") })
            .contains("under platform carry a repositioning")
    );
    let (names, degrees) = exact(&cardinal);
    let degree = |name: &str| degrees.degree[names.iter().position(|n| n == name).expect("known")];
    assert!(degree("K1_X").is_none() && degree("K3_X").is_none());
}

/// Positions that rotate while Z is observed, with drifts: the contribution of the rotation to the
/// derivatives of Z changes no verdict.
#[test]
fn rotating_segments_by_the_second_path() {
    rotations_by_the_second_path(cases(4, 9));
}

fn rotations_by_the_second_path(cases: usize) {
    let all = ["F", "I", "O", "S", "II", "OO", "SS"];
    let mut rng = SplitMix64::new(17);
    for case in 0..cases {
        let chosen: Vec<&str> = all.into_iter().filter(|_| rng.below(2) == 0).collect();
        if chosen.is_empty() {
            continue;
        }
        let start = ["10,25,40", "0,0,0", "-70,15,130"][case % 3];
        let mut scheme = turned_about(start, 1 + rng.below(3) as usize, &mut rng);
        scheme.carry = Carry::ALL[case / 3 % 3];
        scheme.unknowns = unknowns(&chosen.join(","));
        let last = scheme.positions.len() - 1;
        let mut turns = vec![rng.below(1 + last as u64) as usize];
        turns.extend((case % 2 == 0).then_some(last));
        for i in turns {
            let axis = ["X_p", "Y_p", "Z_p", "N", "U", "E"][rng.below(6) as usize];
            let angle = ["70", "-120", "360", "500"][rng.below(4) as usize];
            scheme.positions[i].rotation = Some(Rotation::new(axis, angle).expect("a rotation"));
        }
        both_paths_agree(&scheme);
    }
}

/// Rotations with errors of accelerometers and torquers: psi integrated along the rotation and samples of Z
/// confirm the exact verdict. No degree is below that with the drifts alone.
#[test]
fn histories_by_samples() {
    rotations_by_samples(cases(5, 10));
}

fn rotations_by_samples(cases: usize) {
    let all = ["F", "I", "O", "S", "II", "GS", "GM", "GM3", "K0", "K1", "M6", "M3", "K2", "K3", "Kx"];
    let mut rng = SplitMix64::new(41);
    let mut compared = 0;
    for case in 0..cases {
        let mut chosen: Vec<&str> = all.into_iter().filter(|_| rng.below(4) == 0).collect();
        for (whole, triangle) in [("GM", "GM3"), ("M6", "M3")] {
            if chosen.contains(&whole) {
                chosen.retain(|t| *t != triangle);
            }
        }
        let start = ["10,25,40", "0,0,0", "-70,15,130"][case % 3];
        let mut scheme = turned_about(start, 1 + rng.below(3) as usize, &mut rng);
        scheme.carry = Carry::ALL[case / 3 % 3];
        // a slew path by gimbals is known from the start of a position, not from the end of a rotation
        let rotated = if scheme.carry == Carry::Inertial { scheme.positions.len() - 1 } else { 0 };
        let axis = ["X_p", "Y_p", "Z_p", "N", "U", "E"][rng.below(6) as usize];
        let angle = ["70", "-120", "360", "500"][rng.below(4) as usize];
        scheme.positions[rotated].rotation = Some(Rotation::new(axis, angle).expect("a rotation"));
        let drifts: Vec<&str> =
            chosen.iter().copied().filter(|t| t.len() < 3 && "FIOS".contains(&t[..1])).collect();
        if chosen.is_empty() || drifts.len() == chosen.len() {
            continue;
        }
        scheme.unknowns = unknowns(&chosen.join(","));
        let (names, degrees) = exact(&scheme);
        let terms = scheme.unknowns.to_string();
        let (rank, determined) =
            floats::sampled(&terms.split(',').collect::<Vec<_>>(), &legs(&scheme), scheme.carry);
        assert_eq!(degrees.rank(), rank, "{terms} {} {start} {axis}:{angle}", scheme.carry);
        for ((name, degree), seen) in names.iter().zip(&degrees.degree).zip(determined) {
            assert_eq!(degree.is_some(), seen, "{name} of {terms} {} {start} {axis}:{angle}", scheme.carry);
        }
        compared += 1;
        if !drifts.is_empty() {
            let (fewer, alone) = exact(&Scheme { unknowns: unknowns(&drifts.join(",")), ..scheme.clone() });
            for (name, degree) in fewer.iter().zip(alone.degree) {
                let at = names.iter().position(|n| n == name).expect("an unknown of both");
                let with = degrees.degree[at].map_or(usize::MAX, |k| k);
                assert!(
                    with >= degree.unwrap_or(usize::MAX),
                    "{name} of {terms}: {degree:?} alone, then {with}"
                );
            }
        }
    }
    assert!(compared > cases / 3, "{compared}");
}

/// By hand: during a rotation about the vertical the gyro along it has one constant drift, D_F + GS (w + wU),
/// whose parts are indistinguishable. A position before, where GS acts through wU alone, does not change this
/// under reset carry. With psi carried the turn distinguishes them.
#[test]
fn a_torquer_about_the_vertical() {
    let scheme = |carry: Carry, attitudes: &[&str]| {
        let mut scheme =
            Scheme { carry, unknowns: unknowns("F,GS"), path: Some(Path::OneAxis), ..at(attitudes) };
        let last = scheme.positions.len() - 1;
        scheme.positions[last].rotation = Some(Rotation::new("U", "360").expect("a rotation"));
        scheme
    };
    let degree = |scheme: &Scheme, name: &str| {
        let (names, degrees) = exact(scheme);
        degrees.degree[names.iter().position(|n| n == name).expect("an unknown")]
    };
    for carry in Carry::ALL {
        let alone = scheme(carry, &["NUE"]);
        assert!(degree(&alone, "D_FY").is_none() && degree(&alone, "GS_Y").is_none());
    }
    let both = scheme(Carry::Inertial, &["NUE", "NUE"]);
    assert!(degree(&both, "D_FY").is_some() && degree(&both, "GS_Y").is_some());
}

/// Fewest positions by quarter turns, with proof. Coefficients that no slew sequence determines are reported
/// at once.
#[test]
fn fewest_positions_of_slew_sequences() {
    use obsdeg_design::design::{
        Candidates, SlewSequenceOptions, scheme_of_slew_sequence, shortest_slew_sequence,
    };
    let base = Scheme { carry: Carry::Inertial, unknowns: unknowns("F,GS,GM,K0,K1"), ..Scheme::default() };
    let options = SlewSequenceOptions {
        candidates: Candidates::cardinals(),
        required: Vec::new(),
        most_turn_deg: 90.0,
        seed: 1,
    };
    let found = shortest_slew_sequence(&base, &options, &|| true).expect("an answer");
    let fewest = found.positions.expect("a slew sequence");
    assert!(found.proven && found.never.is_empty() && found.sequence.len() == fewest, "{found:?}");
    let (names, degrees) = exact(&scheme_of_slew_sequence(&found, &base).expect("a scheme"));
    let seen = |(n, d): (&String, &Option<usize>)| n.starts_with("psi") || d.is_some();
    assert!(names.iter().zip(&degrees.degree).all(seen));
    // no random slew sequence with one position less suffices
    for seed in 0..300 {
        let scheme = Scheme { unknowns: base.unknowns.clone(), ..slew_sequence(fewest - 1, seed) };
        let (names, degrees) = exact(&scheme);
        assert!(!names.iter().zip(&degrees.degree).all(seen), "{seed}");
    }
    let hidden = Scheme { unknowns: unknowns("F,GS,K1,K3"), ..base };
    let none = shortest_slew_sequence(&hidden, &options, &|| true).expect("an answer");
    let title = |w: &obsdeg_design::design::ShortestSlewSequence| {
        let text =
            obsdeg_report::written(w, obsdeg_report::Format::Table, obsdeg_report::TerminalLayout::default());
        text.expect("text").split_whitespace().collect::<Vec<_>>().join(" ")
    };
    // a sequence with all slews proves that no sequence suffices; an unsuccessful search does not
    assert!(!none.never.is_empty() && title(&none).contains("degrees makes every required"), "{none:?}");
    let sought = obsdeg_design::design::ShortestSlewSequence { never: Vec::new(), ..none.clone() };
    assert!(title(&sought).contains("degrees was found that makes every required"), "{sought:?}");
    assert!(none.positions.is_none() && none.never.contains(&"K1_X".to_string()) && !none.proven, "{none:?}");
}

//! Schemes found: the fewest positions, the best of five of the cardinal attitudes, and what the filter makes of it.

#[path = "design/brute.rs"]
mod brute;
#[path = "design/orders.rs"]
mod orders;

use std::process::Command;

use brute::Brute;
use obsdeg_core::analysis::{Options as AnalysisOptions, analyze};
use obsdeg_core::model::attitude::cardinal;
use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Carry, Dwell, Scheme, SlewAxis, SlewTo};
use obsdeg_design::design::answer::Found;
use obsdeg_design::design::criterion::{Criterion, Limits};
use obsdeg_design::design::information::Evaluator;
use obsdeg_design::design::observability::Rows;
use obsdeg_design::design::search::{Constraints, Progress, Search};
use obsdeg_design::design::symmetry::Symmetry;
use obsdeg_design::design::{Candidates, Design, DesignError, Kind, Options, design};
use obsdeg_ekf::SquareRootInformation;
use obsdeg_evidence::compare::predicted;
use obsdeg_evidence::simulation::batch::batch;
use obsdeg_evidence::simulation::conditions::Conditions;
use obsdeg_evidence::simulation::plan::Plan;
use obsdeg_evidence::simulation::simulate;
use obsdeg_exact::SplitMix64;

fn base(carry: Carry) -> Scheme {
    Scheme { carry, latitude: "28.2".parse().ok(), ..Scheme::default() }
}

/// All twelve coefficients.
const ALL: [usize; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

fn options(positions: Option<usize>) -> Options {
    Options {
        candidates: Candidates::cardinals(),
        positions,
        required: Vec::new(),
        degree_caps: Vec::new(),
        meet: false,
        total_s: None,
        slew_s: None,
        criterion: Kind::Worst,
        keep: 5,
        restarts: 40,
        refine: false,
        front: Vec::new(),
        seed: 1,
    }
}

fn on(_: Progress) -> bool {
    true
}

fn designed(carry: Carry, options: &Options) -> Design {
    design(&base(carry), &quiet(), options, &on).expect("designed")
}

fn rows_of(carry: Carry, candidates: &Candidates) -> Rows {
    Rows::new(&base(carry), &candidates.attitudes, &ALL, 1).expect("rows")
}

fn evaluator_of(carry: Carry, candidates: &Candidates) -> Evaluator {
    Evaluator::new(&base(carry), &candidates.attitudes, &ALL, &quiet()).expect("an evaluator")
}

/// The sequence of some names.
fn sequence_of(candidates: &Candidates, names: &[String]) -> Vec<usize> {
    let place = |n: &String| candidates.names.iter().position(|c| c == n).expect("a candidate");
    names.iter().map(place).collect()
}

fn scheme_of(names: &[String], carry: Carry) -> Scheme {
    let attitudes = names.iter().map(|n| cardinal(n).expect("an attitude"));
    Scheme { positions: Scheme::of_angles(attitudes).positions, ..base(carry) }
}

fn quiet() -> Conditions {
    Conditions { drift_noise: "0 deg/h".parse().expect("a drift noise"), ..Conditions::default() }
}

#[test]
fn fewest_positions_with_a_witness() {
    for (carry, fewest) in [(Carry::Platform, 4), (Carry::Inertial, 5), (Carry::Reset, 6)] {
        let found = designed(carry, &options(None));
        let minimum = found.minimum;
        assert_eq!((minimum.positions, minimum.witness.len()), (Some(fewest), fewest), "{carry}");
        // what has fewer was excluded by counting or one by one
        let excluded = minimum.none_of.iter().map(|[size, _]| *size as usize);
        assert_eq!(excluded.collect::<Vec<_>>(), (minimum.counting_bound..fewest).collect::<Vec<_>>());
        let no_solutions = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
        let a = analyze(&scheme_of(&minimum.witness, carry), no_solutions, None).expect("analysed");
        let drifts = a.quantities.iter().filter(|q| q.name.starts_with("D_"));
        assert!(drifts.clone().count() == 12 && drifts.clone().all(|q| q.degree.is_some()), "{carry}");
    }
}

/// The sets that the search calls observable are those that the analysis calls observable.
#[test]
fn sets_are_judged_as_schemes_are() {
    let candidates = Candidates::cardinals();
    let mut rng = SplitMix64::new(3);
    for (carry, size) in [(Carry::Platform, 4), (Carry::Inertial, 5), (Carry::Reset, 6)] {
        let rows = rows_of(carry, &candidates);
        let sets = rows.observable_sets(size);
        assert!(sets.windows(2).all(|w| w[0] < w[1]));
        for _ in 0..60 {
            let mut set: Vec<usize> = Vec::new();
            while set.len() < size {
                let c = rng.below(24) as usize;
                if !set.contains(&c) {
                    set.push(c);
                }
            }
            set.sort_unstable();
            let chosen: Vec<String> = set.iter().map(|&c| candidates.names[c].clone()).collect();
            let no_solutions = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
            let a = analyze(&scheme_of(&chosen, carry), no_solutions, None).expect("analysed");
            let all = a.quantities.iter().filter(|q| q.name.starts_with("D_")).all(|q| q.degree.is_some());
            assert_eq!(sets.binary_search(&set).is_ok(), all, "{chosen:?} {carry}");
            let degree = |name: &str| a.quantities.iter().find(|q| q.name == name).and_then(|q| q.degree);
            let axes = |family: char| ["X", "Y", "Z"].map(|axis| degree(&format!("D_{family}{axis}")));
            let degrees: Vec<_> = ['F', 'I', 'O', 'S'].into_iter().flat_map(axes).collect();
            assert_eq!(rows.degrees(&set), degrees, "{chosen:?} {carry}");
        }
    }
}

/// Reference: over random full-rank five-sets the worst sigma runs from 0.039 over a median of 0.068 to 0.10 deg/h; the optimum
/// is proven by exhaustion over all orders; twelve positions in the same time reach 0.018.
#[test]
fn the_best_of_five_and_of_twelve() {
    let candidates = Candidates::cardinals();
    let evaluator = evaluator_of(Carry::Inertial, &candidates);
    let sets = rows_of(Carry::Inertial, &candidates).observable_sets(5);
    let mut rng = SplitMix64::new(5);
    let mut shuffled = || {
        let mut sequence = sets[rng.below(sets.len() as u64) as usize].clone();
        for i in (1..sequence.len()).rev() {
            sequence.swap(i, rng.below(i as u64 + 1) as usize);
        }
        sequence
    };
    let mut random: Vec<f64> =
        (0..20_000).map(|_| evaluator.of_sequence(&shuffled(), &Criterion::Worst)).collect();
    random.sort_by(f64::total_cmp);
    let (low, median, high) = (random[0], random[10_000], random[19_999]);
    assert!(
        (0.036..0.042).contains(&low) && (0.060..0.076).contains(&median) && (0.09..0.12).contains(&high),
        "{low} {median} {high}"
    );
    // what every sequence of five of the 24 comes to, up to turns of the platform axes
    let five = designed(Carry::Inertial, &options(Some(5)));
    let optimum = five.found[0].worst_sigma_dph;
    assert!(five.search.is_some_and(|s| s.proven) && five.symmetry == 24);
    assert!(optimum <= low + 1e-9 && (0.0393..0.0394).contains(&optimum), "{optimum} {low}");
    let twelve = Conditions { dwell_s: 5000.0 / 12.0, ..quiet() };
    let few = Options { restarts: 8, ..options(Some(12)) };
    let twelve = design(&base(Carry::Inertial), &twelve, &few, &on).expect("designed");
    assert!(twelve.search.is_some_and(|s| !s.proven) && twelve.found[0].worst_sigma_dph <= 0.018);
}

/// Exhaustion over some of the candidates, against every sequence evaluated by itself, repeated positions included; with and
/// without a symmetry.
#[test]
fn exhaustion_finds_the_best() {
    let all = Candidates::cardinals();
    let some = |list: &[usize]| Candidates {
        names: list.iter().map(|&i| all.names[i].clone()).collect(),
        attitudes: list.iter().map(|&i| all.attitudes[i].clone()).collect(),
    };
    // eight without much symmetry, and the eight that turns about Z_p make of two
    let turned = ["NUE", "UNW", "USE", "DNE", "UEN", "EUS", "SDE", "DSW"].map(String::from);
    for (carry, candidates, k) in [
        (Carry::Platform, some(&[0, 1, 2, 4, 7, 10, 16, 23]), 5),
        (Carry::Inertial, some(&[0, 1, 2, 4, 7, 10, 16, 23]), 5),
        (Carry::Inertial, some(&sequence_of(&all, &turned)), 5),
        (Carry::Reset, some(&[0, 1, 2, 4, 7, 10, 16, 23]), 7),
    ] {
        let options = Options { candidates: candidates.clone(), ..options(Some(k)) };
        let found = design(&base(carry), &quiet(), &options, &on);
        let (rows, evaluator) = (rows_of(carry, &candidates), evaluator_of(carry, &candidates));
        let mut best = f64::INFINITY;
        let mut sequence = vec![0; k];
        'all: loop {
            let wanted = carry != Carry::Reset || sequence.is_sorted();
            if wanted && rows.degrees(&sequence).iter().all(Option::is_some) {
                best = best.min(evaluator.of_sequence(&sequence, &Criterion::Worst));
            }
            for place in (0..k).rev() {
                sequence[place] += 1;
                if sequence[place] < candidates.names.len() {
                    continue 'all;
                }
                sequence[place] = 0;
            }
            break;
        }
        match found {
            Ok(found) => {
                assert!(found.search.is_some_and(|s| s.proven));
                assert!(found.found.is_sorted_by(|a, b| a.worst_sigma_dph <= b.worst_sigma_dph));
                let ratio = found.found[0].worst_sigma_dph / best;
                assert!((ratio - 1.0).abs() < 1e-6, "{carry}: {ratio}");
            }
            Err(e) => assert!(best.is_infinite(), "{carry}: {e}"),
        }
    }
}

/// Turning the platform axes renames coefficients: every image of a sequence has the same criterion, when all coefficients count
/// alike; a requirement of one of them breaks that.
#[test]
fn turned_schemes_are_equally_good() {
    let candidates = Candidates::cardinals();
    for carry in Carry::ALL {
        let rows = rows_of(carry, &candidates);
        let all = rows.symmetry(&|_, _| true);
        assert_eq!((all.order, all.representatives()), (24, vec![0]));
        // D_FX alone: turns about X_p, and half turns that turn it round
        let one = rows.symmetry(&|i, j| (i == 0) == (j == 0));
        assert_eq!(one.order, 8);
    }
    // every sequence has an image that begins with NUE: the best of all is the best of these
    let rows = rows_of(Carry::Inertial, &candidates);
    let evaluator = evaluator_of(Carry::Inertial, &candidates);
    let of = |symmetry: &Symmetry| {
        let search = Search {
            rows: &rows,
            evaluator: &evaluator,
            criterion: &Criterion::A,
            constraints: &Constraints::default(),
            keep: 3,
            floor: 2,
            progress: &on,
        };
        search.exhaust(symmetry, 5)
    };
    let orbits = Symmetry { order: 4, orbit: (0..24).map(|i| i / 4).collect() };
    let (one, six) = (of(&rows.symmetry(&|_, _| true)), of(&orbits));
    assert_eq!(one.examined * 6, six.examined);
    assert_eq!(one.ties.total(24), six.ties.total(4));
    let ratio = six.found[0].worth.value / one.found[0].worth.value;
    assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
}

/// One seed, one answer, on any number of threads; an interrupted search gives the best so far.
#[test]
fn threads_and_interruption() {
    let few = Options { restarts: 32, ..options(Some(8)) };
    let threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| designed(Carry::Inertial, &few))
    };
    assert_eq!(threads(1), threads(3));
    // until a sequence has been looked at
    let stopped = design(&base(Carry::Inertial), &quiet(), &few, &|now| now.examined == 0).expect("designed");
    let search = stopped.search.expect("a search");
    assert!(search.interrupted && !search.proven && search.ties.is_none() && !stopped.found.is_empty());
    // heard within one restart of many evaluations
    assert!(search.examined < 4 * 256, "{}", search.examined);
    let impossible = design(&base(Carry::Inertial), &quiet(), &options(Some(3)), &on);
    assert!(impossible.expect_err("none").to_string().contains("3 of these candidates"));
}

/// What takes minutes hears at once that it is to stop: the search for the fewest positions, ways between many candidates, exchange by
/// a slow criterion, exhaustion.
#[test]
fn long_searches_hear_of_an_interruption() {
    let grid = |deg: i64| Candidates::grid(deg * 1_000_000_000).expect("a grid");
    let slews = Conditions { slew_rate_deg_s: Some(1.0), ..quiet() };
    for (options, conditions) in [
        (Options { candidates: grid(30), ..options(None) }, quiet()),
        (Options { candidates: grid(30), ..options(Some(4)) }, quiet()),
        (Options { candidates: grid(45), criterion: Kind::E, ..options(Some(5)) }, quiet()),
        (Options { candidates: grid(45), ..options(Some(5)) }, slews),
        (Options { required: vec!["D_F".into()], criterion: Kind::E, ..options(Some(6)) }, quiet()),
    ] {
        // the first questions come from the search for the fewest, the others from what comes behind it
        for patience in [0, 20, 200] {
            let asked = std::sync::atomic::AtomicU64::new(0);
            let going = |_: Progress| asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) < patience;
            match design(&base(Carry::Inertial), &conditions, &options, &going) {
                Err(DesignError::Interrupted) => {}
                Ok(found) => assert!(found.search.is_some_and(|s| s.interrupted) && !found.found.is_empty()),
                Err(e) => panic!("{e}"),
            }
        }
    }
}

/// An answer says what its sigmas rest on, in words and in JSON, and how many schemes are as good.
#[test]
fn an_answer_says_what_it_rests_on() {
    let run = |more: &[&str]| {
        let arguments =
            ["design", "--positions", "3", "--carry", "inertial", "--observable", "D_F", "--dwell", "500"];
        let arguments =
            [&arguments[..], &["--step", "20", "--noise", "2e-5", "--slew-rate", "0.5"], more].concat();
        let output = Command::new(env!("CARGO_BIN_EXE_obsdeg")).args(arguments).output().expect("it runs");
        String::from_utf8(output.stdout).expect("text")
    };
    let table = run(&[]).replace("\n      ", " ");
    for said in [
        "latitude 28.2 deg (chosen here: nothing names one)",
        "500 s at each position, steps of at most 20 s, a sample after each; slews at 0.5 deg/s",
        "noise of Z 2e-5 g per sample and axis; random drift: none; prior: none",
        "psi and all coefficients of the terms F,I,O,S",
        "24 sequences are as good, itself and its images counted",
        "half turns are tried in both directions",
        "NUE (-N) NDW (-N) NUE",
        "Best schemes (sigma: information of all samples, no prior, no drift noise; psi at the start)",
        "by prediction (no prior, no drift noise, psi at the start) every requirement (the program's own: none is stated) is met, 3 of 3",
        "to be checked with prior and drift noise, psi at the end: `obsdeg simulate`",
    ] {
        assert!(table.contains(said), "{said}: {table}");
    }
    assert!(!run(&["--latitude", "28.2"]).contains("chosen here"));
    let json: serde_json::Value = serde_json::from_str(&run(&["--format", "json"])).expect("JSON");
    let search = &json["search"];
    let conditions = serde_json::json!({
        "latitude_deg": 28.2, "latitude_by_default": true, "dwell_s": 500.0, "step_s": 20.0, "accelerometer_noise_g": 2e-5,
        "azimuth_noise_deg": null, "slew_rate_deg_s": 0.5
    });
    assert_eq!(search["conditions"], conditions);
    assert!(search["drift_noise"].is_null() && search["prior"].is_null());
    assert_eq!(json["found"][0]["requirements"]["basis"], "predicted");
    // what is missed by prediction needs no other check
    assert!(!run(&["--requirement", "D=1e-9"]).contains("to be checked"));
    assert_eq!(search["ties"], serde_json::json!({ "sequences": 24, "within": 1e-6 }));
    let turns =
        serde_json::json!([{ "to": 2, "about": [-1.0, 0.0, 0.0] }, { "to": 3, "about": [-1.0, 0.0, 0.0] }]);
    assert_eq!(json["found"][0]["half_turns"], turns);
}

/// Ctrl-C ends the program with the exit code of a shell when nothing was found.
#[cfg(unix)]
#[test]
fn an_interrupted_program_ends_with_130() {
    // minutes of work, whatever the machine
    let arguments = ["design", "--minimum", "--carry", "inertial", "--candidates", "grid:30", "--quiet"];
    // a signal that comes before the program listens ends it without a code: then it is tried again
    let code = [300, 1000, 3000].into_iter().find_map(|wait| {
        let program = Command::new(env!("CARGO_BIN_EXE_obsdeg"))
            .args(arguments)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .expect("it runs");
        std::thread::sleep(std::time::Duration::from_millis(wait));
        let sent = Command::new("kill").args(["-INT", &program.id().to_string()]).status();
        assert!(sent.expect("a signal").success());
        let output = program.wait_with_output().expect("it ends");
        assert!(output.stdout.is_empty());
        output.status.code()
    });
    assert_eq!(code, Some(130));
}

/// The bound on errors counts every set: angles of nine decimals leave few primes, so more of them are taken.
#[test]
fn nothing_is_proven_by_chance() {
    let mut rng = SplitMix64::new(19);
    let mut angle =
        || obsdeg_core::model::Angle::from_nanodeg(rng.below(360_000_000_000) as i64 - 180_000_000_000);
    let mut candidates = Candidates::default();
    (0..24).for_each(|_| candidates.add(std::array::from_fn(|_| angle())));
    let found = designed(Carry::Inertial, &Options { candidates, ..options(None) });
    assert_eq!((found.minimum.positions, found.minimum.proven), (Some(5), true));
    assert!(found.error_bound < 1e-12 && found.primes > 2, "{found:?}");
    // each set is excluded by a rank of at most 15 rows modulo a prime that is 1 modulo 360e9; there are about 2^60 over
    // phi(360e9) ln 2^61 = 9.6e10 * 42.3 of 61 bits, and a minor of 15 rows of 16 bits is divisible by at most 15 * 16 / 60
    let one = 15.0 * 16.0 / 60.0 / (2f64.powi(60) / (9.6e10 * 42.28));
    let sets = 2024.0 + 10626.0;
    assert!(
        found.error_bound > sets * f64::powi(one, found.primes as i32),
        "{:e} {one:e}",
        found.error_bound
    );
    // one prime would not do, and the bound of the cardinal attitudes is counted in the same way
    assert!(sets * one > 1e-2);
    let cardinal = designed(Carry::Inertial, &options(Some(5)));
    assert!(cardinal.primes == 2 && cardinal.error_bound < 1e-12 && cardinal.error_bound > 0.0);
    assert!(cardinal.search.is_some_and(|s| s.proven));
}

/// The winner's file is a scheme that `analyze` accepts and that has the sigma promised; wrong arguments are named.
#[test]
fn the_winner_is_a_scheme_file() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("found").display().to_string();
    let winner = place.path().join("found/winner.toml").display().to_string();
    let run = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_obsdeg")).args(arguments).output().expect("it runs")
    };
    let file = "examples/six-positions/scheme.toml";
    let found = run(&[
        "design",
        "--candidates",
        file,
        "--positions",
        "5",
        "--carry",
        "inertial",
        "--slew-rate",
        "1",
        "--gimbal",
        "beta=-80:80",
        "-o",
        &folder,
        "--format",
        "json",
    ]);
    assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
    let found: serde_json::Value = serde_json::from_slice(&found.stdout).expect("JSON");
    assert_eq!((&found["schema"], &found["search"]["proven"]), (&"obsdeg.design/1".into(), &true.into()));
    for name in ["design.json", "front.svg", "front.png"] {
        assert!(place.path().join("found").join(name).is_file(), "{name}");
    }
    let compared = run(&["compare", &winner, "--format", "json"]);
    let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).expect("JSON");
    let (promised, kept) =
        (&found["found"][0]["worst_sigma_dph"], &compared["schemes"][0]["worst"]["sigma_dph"]);
    let (promised, kept) = (promised.as_f64().expect("a number"), kept.as_f64().expect("a number"));
    assert!((promised / kept - 1.0).abs() < 1e-6, "{promised} {kept}");
    assert!(run(&["analyze", "--scheme", &winner, "--solutions", "off"]).status.success());
    // half turns about an axis and about a diagonal, either way, are in the file: what the commands make of it is what was found
    let two = place.path().join("two.toml").display().to_string();
    for (attitudes, axes) in [
        (["NUE", "NDW"], ["about = \"N\", angle_deg = 180", "about = \"N\", angle_deg = -180"]),
        (["NUE", "WDS"], ["about = [1, 0, -1], angle_deg = 180", "about = [-1, 0, 1], angle_deg = 180"]),
    ] {
        let text = attitudes.map(|a| format!("[[position]]\nname = \"{a}\"\nattitude = \"{a}\"\n")).concat();
        std::fs::write(&two, format!("carry = \"inertial\"\nlatitude_deg = 28.2\n{text}")).expect("written");
        let list =
            ["--positions", "4", "--slew-rate", "0.5", "--observable", "D_FY", "--format", "json", "--force"];
        let found = run(&[&["design", "--candidates", &two, "-o", &folder], &list[..]].concat());
        assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
        let found: serde_json::Value = serde_json::from_slice(&found.stdout).expect("JSON");
        let turns = found["found"][0]["half_turns"].as_array().expect("half turns");
        let text = std::fs::read_to_string(&winner).expect("a winner");
        assert!(
            !turns.is_empty() && turns.len() == axes.map(|a| text.matches(a).count()).iter().sum::<usize>(),
            "{text}"
        );
        let promised = found["found"][0]["worst_sigma_dph"].as_f64().expect("a number");
        let sigma = |rows: &serde_json::Value| {
            let row = rows.as_array().expect("rows").iter().find(|q| q["name"] == "D_FY").expect("D_FY");
            row["sigma"].as_f64().expect("a number")
        };
        let compared = run(&["compare", &winner, "--format", "json"]);
        let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).expect("JSON");
        let simulated = [
            &["simulate", "--scheme", &winner, "--format", "json", "--drift-noise", "0 deg/h"][..],
            &["--prior", "psi=1e6", "--prior", "D=1e6"],
        ];
        let simulated = run(&simulated.concat());
        let simulated: serde_json::Value = serde_json::from_slice(&simulated.stdout).expect("JSON");
        for (kept, within) in
            [(sigma(&compared["schemes"][0]["quantities"]), 1e-6), (sigma(&simulated["quantities"]), 1e-3)]
        {
            assert!((promised / kept - 1.0).abs() < within, "{promised} {kept}");
        }
        // lists of slews say how they turn
        let slews = [&compared["schemes"][0]["slews"], &simulated["timeline"]].map(|rows| {
            let of = |r: &serde_json::Value| r["turn"]["about"].as_array().cloned();
            rows.as_array().expect("rows").iter().filter_map(of).collect::<Vec<_>>()
        });
        let expected: Vec<_> = turns.iter().filter_map(|t| t["about"].as_array().cloned()).collect();
        assert!(slews.iter().all(|about| *about == expected), "{slews:?} {expected:?}");
    }
    let again = ["design", "--candidates", file, "--positions", "5", "-o", &folder, "--force"];
    assert!(run(&again).status.success());
    for (arguments, expected) in [
        (&["design", "--positions", "5", "-o", &folder][..], "--force"),
        (&["design", "--positions", "5", "--candidates", "grid:40"], "divides 90"),
        (&["design", "--positions", "5", "--candidates", "grid:x"], "grid:45"),
        (
            &["design", "--positions", "5", "--candidates", "examples/tumbling/scheme.toml"],
            "rotating segment",
        ),
        (&["design", "--positions", "5", "--gimbal", "beta=80:-80"], "beta=-80:80"),
        (&["design", "--positions", "5", "--observable", "D_FW"], "D_FX"),
        (&["design", "--positions", "5", "--max-degree", "D_F=x"], "D_F=1"),
        (&["design", "--positions", "5", "--max-degree", "1"], "every sequence was examined"),
        (&["design", "--positions", "5", "--max-time", "0"], "more than 0"),
        (&["design", "--positions", "5", "--slew-rate", "1"], "inertial"),
        (&["design", "--positions", "4", "--meet", "--requirement", "D=1e-9"], "every sequence was examined"),
        (
            &["design", "--positions", "5", "--criterion", "margin", "--requirement", "D_F=0"],
            "expected 1e-12 to 1e9",
        ),
        (&["design"], "--positions"),
        (&["design", "--positions", "0"], "1 to 100"),
        (
            &["design", "--positions", "3", "--carry", "inertial"],
            "no scheme of 3 of these candidates makes every coefficient observable: every sequence was examined",
        ),
        (
            &["design", "--positions", "5", "--max-time", "10"],
            "at most 10 s in all: 5 times 1000 s at a position are more",
        ),
        (
            &["design", "--positions", "3", "--observable", "D_F", "--max-degree", "1"],
            "makes D_FX, D_FY, D_FZ observable with degree of every required coefficient at most 1",
        ),
        (
            &[
                "design",
                "--positions",
                "4",
                "--carry",
                "inertial",
                "--candidates",
                "grid:45",
                "--restarts",
                "2",
            ],
            "sequences of 4 of these candidates that were looked at makes every coefficient observable",
        ),
        (&["design", "--minimum", "--terms", "drift"], "coefficients"),
        (&["design", "--minimum", "--candidates", "examples/generic-angles/scheme.toml"], "generic"),
        (&["design", "--positions", "5", "--dwell", "0"], "'--dwell <S>': expected"),
    ] {
        let output = run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}

/// What is predicted is what the filter says: a prior that says nothing, no drift noise.
#[test]
fn the_predicted_sigma_is_that_of_the_filter() {
    for carry in Carry::ALL {
        let k = 7;
        let options = Options { restarts: 2, ..options(Some(k)) };
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
        let worst = drifts.map(|q| q.sigma).fold(0.0, f64::max);
        assert!((worst / best.worst_sigma_dph - 1.0).abs() < 1e-4, "{carry}: {worst} {best:?}");
        // and so are the errors of 100 runs, within what their number allows (99.9 %)
        let square = |seed: u64| -> f64 {
            let (run, _) = simulate(&scheme, &conditions, seed).expect("simulated");
            let q = run.quantities.iter().find(|q| q.name == best.worst).expect("the worst");
            (q.error / best.worst_sigma_dph).powi(2)
        };
        let mean = (0..100).map(square).sum::<f64>() / 100.0;
        let (low, high) = obsdeg_ekf::consistency::chi_square_band(1.0, 100.0, 0.999);
        assert!((low..high).contains(&mean), "{carry}: {mean} not in {low}..{high}");
    }
}

/// Every criterion against the covariance of the batch of all samples.
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
                Criterion::Margin(Limits { coefficients: requirements.clone(), psi: [f64::INFINITY; 3] }),
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

/// psi has a requirement like everything else: the sigma that a search holds against it is that of a comparison, and what is found is the best
/// of all sequences, judged one by one by comparisons.
#[test]
fn requirements_on_psi_count() {
    let mut candidates = Candidates::default();
    for name in ["NUE", "UEN", "DNE", "20,-40,70", "110,15,-35"] {
        candidates.add(obsdeg_core::model::scheme::parse_attitude(name).expect("an attitude"));
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
            // the way that a search takes first
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
        // the largest sigma over requirement of every sequence; infinite where something is not determined
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
            let options =
                Options { candidates: candidates.clone(), meet, criterion: Kind::Margin, ..options(Some(k)) };
            let found = design(&like, &conditions, &options, &on);
            if meet && factor < best {
                assert!(matches!(found, Err(DesignError::Impossible { .. })), "{carry}: {found:?}");
                continue;
            }
            let found = found.expect("designed");
            let first = &found.found[0];
            // the smallest worst degree comes first; here all that determine everything have the same
            assert!((first.value * factor / best - 1.0).abs() < 1e-5, "{carry}: {} {best}", first.value);
            let margin = first.requirements.worst.as_ref().expect("a margin");
            assert!((margin.margin * first.value - 1.0).abs() < 1e-9, "{margin:?}");
            assert_eq!(first.requirements.all_met(), first.value <= 1.0);
            let count = 3 + 3 * if carry == Carry::Reset { k } else { 1 };
            assert_eq!(first.requirements.stated, count);
        }
        // asked for some coefficients, psi is not
        let some = Options {
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

/// Whether psi is what misses most in some sequence that is determined.
fn psi_decides(seen: &[Vec<(String, Option<f64>)>], worst: &[f64], asked: &dyn Fn(&str) -> f64) -> bool {
    seen.iter().zip(worst).any(|(of, worst)| {
        let psi = of.iter().filter(|(name, _)| name.starts_with("psi"));
        worst.is_finite() && psi.filter_map(|(name, s)| Some(s.as_ref()? / asked(name))).any(|x| x == *worst)
    })
}

/// What must be kept is kept, and what is found is as good as a search through all sequences says.
#[test]
fn constraints_are_kept() {
    let slews = Conditions { slew_rate_deg_s: Some(1.0), ..quiet() };
    let free = design(&base(Carry::Inertial), &slews, &options(Some(5)), &on).expect("designed");
    let tight = Options { total_s: Some(5380.0), slew_s: Some(100.0), ..options(Some(5)) };
    let kept = design(&base(Carry::Inertial), &slews, &tight, &on).expect("designed");
    assert!(kept.found.iter().all(|f| f.total_s <= 5380.0) && kept.found[0].value >= free.found[0].value);
    // times by hand: quarter turns take 90 s, and the front goes down as time goes up
    assert_eq!(kept.found[0].total_s, 5360.0);
    assert!(free.front.is_sorted_by(|a, b| a.total_s < b.total_s && a.value > b.value));
    // every dwell is there: what slews alone determine does not push out what the exact verdict knows
    assert!(free.front.iter().any(|f| f.total_s < 1400.0) && free.front.iter().any(|f| f.total_s > 20_000.0));
    // without the D_I everything may have degree 1 (six positions), and is found before what has a smaller sigma
    let some = ["D_F", "D_O", "D_S"].map(String::from).to_vec();
    let six = Options { required: some.clone(), ..options(Some(6)) };
    let mut few = Candidates::default();
    for name in ["NUE", "DNE", "ENU", "USE", "ESD", "NDW", "WND"] {
        few.add(cardinal(name).expect("an attitude"));
    }
    let ones = designed(Carry::Platform, &Options { candidates: few.clone(), ..six });
    assert!(ones.found.iter().all(|f| f.worst_degree == 1) && ones.required.len() == 9);
    let capped = Options { candidates: few, degree_caps: vec![(Some("D_I".into()), 1)], ..options(Some(5)) };
    let error = design(&base(Carry::Platform), &quiet(), &capped, &on).expect_err("the lemma forbids it");
    assert!(matches!(error, DesignError::Impossible { .. }), "{error}");
    // requirements: met by what is found, and the margin says so
    let strict = |sigma: f64| {
        let required = Assignment { name: "D".into(), value: sigma };
        let conditions = Conditions { requirements: vec![required], ..quiet() };
        let options = Options { meet: true, criterion: Kind::Margin, ..options(Some(5)) };
        design(&base(Carry::Inertial), &conditions, &options, &on)
    };
    assert!(strict(0.0394).expect("met").found.iter().all(|f| f.value <= 1.0 && f.worst_sigma_dph <= 0.0394));
    assert!(strict(0.0393).is_err());
}

/// Gimbal limits leave candidates out, refinement stays within them and is never worse.
#[test]
fn grids_gimbals_and_refinement() {
    let mut limited = base(Carry::Inertial);
    limited.gimbals.limit("beta=-60:60").expect("limits");
    let grid = Candidates::grid(45_000_000_000).expect("a grid");
    let options = Options { candidates: grid, restarts: 3, refine: true, ..options(Some(5)) };
    let found = design(&limited, &quiet(), &options, &on).expect("designed");
    assert_eq!((found.candidates.len(), found.beyond_gimbals.len()), (192, 16));
    let (refined, plain) = (&found.found[0], &found.found[1]);
    assert!(refined.refined && !plain.refined && refined.value < plain.value);
    assert!(found.front.iter().any(|f| f.refined));
    let angles =
        refined.angles.iter().map(|a| obsdeg_core::model::scheme::parse_attitude(a).expect("angles"));
    let scheme = Scheme { positions: Scheme::of_angles(angles).positions, ..limited };
    assert_eq!(scheme.validate(), Ok(()));
    let plan = Plan::new(&scheme, &quiet()).expect("a plan");
    let prior = SquareRootInformation::prior(&vec![1e6; plan.unknowns()]).expect("a prior");
    let sigmas = batch(&plan, prior).expect("a batch").information.sigmas().expect("regular");
    let worst = sigmas[3..].iter().copied().fold(0.0, f64::max).to_degrees() * 3600.0;
    assert!((worst / refined.worst_sigma_dph - 1.0).abs() < 1e-5, "{worst} {refined:?}");
}

/// Coefficients that do not count are estimated all the same: their sigma may be infinite, the others' are those of the batch.
#[test]
fn what_is_not_required_may_be_lost() {
    let candidates = Candidates::cardinals();
    // two positions: no D_I, no D_FZ alone (platform carry), but D_FX and D_SX
    let required = [0, 9];
    let evaluator = Evaluator::new(&base(Carry::Platform), &candidates.attitudes, &required, &quiet());
    let sequence = sequence_of(&candidates, &["NUE".into(), "NDW".into()]);
    let sigmas = evaluator.expect("an evaluator").sigmas(&sequence);
    let chosen: Vec<String> = ["NUE", "NDW"].map(String::from).to_vec();
    let mut scheme = scheme_of(&chosen, Carry::Platform);
    scheme.positions[1].name = "p2".into();
    let plan = Plan::new(&scheme, &quiet()).expect("a plan");
    let prior = obsdeg_evidence::simulation::batch::diffuse_prior(&plan).expect("a prior");
    let prior = SquareRootInformation::prior(&prior).expect("a prior");
    let all = batch(&plan, prior).expect("a batch").information.sigmas().expect("regular");
    for (own, c) in sigmas.iter().zip([3, 12]) {
        let expected = all[c].to_degrees() * 3600.0;
        assert!((own / expected - 1.0).abs() < 1e-6, "{own} {expected}");
    }
    assert_eq!(sigmas.len(), 2);
}

/// A scheme that was found, with its half turns as they were found.
fn scheme_found(found: &Found, like: &Scheme) -> Scheme {
    let angles = found.angles.iter().map(|a| obsdeg_core::model::scheme::parse_attitude(a).expect("angles"));
    let mut positions = Scheme::of_angles(angles).positions;
    for turn in &found.half_turns {
        let (axis, angle) = (Some(SlewAxis::Direction(turn.about)), "180".parse().ok());
        positions[turn.to - 1].slew = Some(SlewTo { axis, angle, rate_deg_s: None });
    }
    for p in &mut positions {
        p.dwell = Dwell::from_seconds(found.dwell_s);
    }
    Scheme { positions, ..like.clone() }
}

/// Every scheme that is listed has the sigma and the time that a comparison of schemes gives it.
#[test]
fn listed_schemes_are_what_a_comparison_says() {
    let slews = Conditions { slew_rate_deg_s: Some(0.5), ..quiet() };
    let scheme = base(Carry::Inertial);
    let mut skew = 0;
    for (required, k) in [(vec!["D_F".to_string()], 3), (Vec::new(), 5)] {
        let options = Options { required: required.clone(), keep: 10, restarts: 2, ..options(Some(k)) };
        let found = design(&scheme, &slews, &options, &on).expect("designed");
        assert!(found.found.len() == 10 && found.found.iter().any(|f| !f.half_turns.is_empty()));
        for f in found.found.iter().chain(&found.front) {
            let there = scheme_found(f, &scheme);
            skew += f.half_turns.iter().filter(|t| t.about.iter().all(|x| x.abs() < 0.9)).count();
            let sigmas = predicted(&there, &slews, 1).expect("predicted");
            let sigma =
                |name: &String| sigmas.iter().find(|s| s.0 == *name).and_then(|s| s.1).expect("a sigma");
            let worst = found.required.iter().map(sigma).fold(0.0, f64::max);
            assert!((worst / f.worst_sigma_dph - 1.0).abs() < 1e-6, "{worst} {f:?}");
            let seconds = Plan::new(&there, &slews).expect("a plan").duration_s();
            assert!((seconds - f.total_s).abs() < 1e-6, "{seconds} {f:?}");
        }
    }
    assert!(skew > 0);
}

/// All 24^k sequences, with both directions of half turns, by an evaluation of their own: none is better than what the search
/// calls proven, and as many as it says are as good.
#[test]
fn no_sequence_with_slews_is_better_than_the_proven() {
    let candidates = Candidates::cardinals();
    let coefficients = ["D_FX", "D_FY", "D_FZ"];
    let steps = Conditions { slew_rate_deg_s: Some(0.5), step_s: 100.0, ..quiet() };
    let brute = Brute::new(&candidates.names, 28.2, 1000.0, 100.0, 1e-5, 0.5);
    for (required, k) in [(1..2, 2), (0..3, 2), (0..3, 3)] {
        let names: Vec<String> = coefficients[required.clone()].iter().map(ToString::to_string).collect();
        let wanted: Vec<usize> = required.clone().collect();
        let rows = Rows::new(&base(Carry::Inertial), &candidates.attitudes, &wanted, 7).expect("rows");
        // worst degree and worst sigma of every sequence
        let mut all: Vec<(usize, f64)> = Vec::new();
        let mut sequence = vec![0; k];
        'sequences: loop {
            let mut set = sequence.clone();
            set.sort_unstable();
            set.dedup();
            let degrees: Option<Vec<usize>> = rows.degrees(&set).into_iter().collect();
            if let Some(degree) = degrees.and_then(|d| d.into_iter().max()) {
                let two: Vec<usize> = sequence.windows(2).map(|w| brute.ways[w[0]][w[1]].len()).collect();
                let mut ways = vec![0; k - 1];
                'ways: loop {
                    let sigmas = brute.sigmas(&sequence, &ways);
                    all.push((degree, wanted.iter().map(|&d| sigmas[d]).fold(0.0, f64::max)));
                    for (way, two) in ways.iter_mut().zip(&two) {
                        *way += 1;
                        if *way < *two {
                            continue 'ways;
                        }
                        *way = 0;
                    }
                    break;
                }
            }
            for place in (0..k).rev() {
                sequence[place] += 1;
                if sequence[place] < 24 {
                    continue 'sequences;
                }
                sequence[place] = 0;
            }
            break;
        }
        // what slews bring in beside the attitudes may leave a coefficient undetermined
        all.retain(|(_, sigma)| *sigma < 1e3);
        let found =
            design(&base(Carry::Inertial), &steps, &Options { required: names, ..options(Some(k)) }, &on);
        let Some(degree) = all.iter().map(|a| a.0).min() else {
            assert!(matches!(found, Err(DesignError::Impossible { .. })), "{k} {required:?}");
            continue;
        };
        let best = all.iter().filter(|a| a.0 == degree).map(|a| a.1).fold(f64::INFINITY, f64::min);
        let found = found.expect("designed");
        let first = &found.found[0];
        assert_eq!((first.worst_degree, found.symmetry), (degree, if required.len() == 3 { 24 } else { 8 }));
        assert!((first.worst_sigma_dph / best - 1.0).abs() < 1e-7, "{best} {first:?}");
        for f in &found.found {
            let sequence = sequence_of(&candidates, &f.positions);
            let leg = |i: usize| {
                let all = &brute.ways[sequence[i]][sequence[i + 1]];
                let about = f.half_turns.iter().find(|t| t.to == i + 2).map(|t| t.about);
                let same = |w: &brute::Way| {
                    about.is_none_or(|a| w.about.iter().zip(a).all(|(x, y)| (x - y).abs() < 1e-9))
                };
                assert_eq!(all.len(), 1 + usize::from(about.is_some()), "{f:?}");
                all.iter().position(same).expect("a way")
            };
            let ways: Vec<usize> = (0..k - 1).map(leg).collect();
            let sigmas = brute.sigmas(&sequence, &ways);
            let worst = wanted.iter().map(|&d| sigmas[d]).fold(0.0, f64::max);
            assert!((worst / f.worst_sigma_dph - 1.0).abs() < 1e-7, "{worst} {f:?}");
            let slews = (0..k - 1).map(|i| brute.ways[sequence[i]][sequence[i + 1]][ways[i]].seconds);
            assert!((slews.sum::<f64>() + k as f64 * 1000.0 - f.total_s).abs() < 1e-6, "{f:?}");
        }
        let ties = found.search.and_then(|s| s.ties.filter(|_| s.proven)).expect("proven");
        let near = all.iter().filter(|a| a.0 == degree && a.1 <= best * (1.0 + ties.within)).count();
        assert_eq!(ties.sequences, near as u64, "{k} {required:?}");
    }
}

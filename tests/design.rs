//! Schemes found: the fewest positions, the best of five of the cardinal attitudes, and what the filter makes of it.

use std::process::Command;

use obsdeg_core::analysis::{Options as AnalysisOptions, analyze};
use obsdeg_core::design::criterion::Criterion;
use obsdeg_core::design::information::Evaluator;
use obsdeg_core::design::observability::Rows;
use obsdeg_core::design::search::{Constraints, Progress, Search};
use obsdeg_core::design::{Candidates, Design, DesignError, Kind, Options, design};
use obsdeg_core::model::attitude::cardinal;
use obsdeg_core::model::{Carry, Scheme};
use obsdeg_core::simulation::batch::batch;
use obsdeg_core::simulation::conditions::{Assignment, Conditions};
use obsdeg_core::simulation::plan::Plan;
use obsdeg_core::simulation::simulate;
use obsdeg_ekf::SquareRootInformation;
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
    let of = |firsts: &[usize]| {
        let search = Search {
            rows: &rows,
            evaluator: &evaluator,
            criterion: &Criterion::A,
            constraints: &Constraints::default(),
            keep: 3,
            floor: 2,
            progress: &on,
        };
        search.exhaust(firsts, 5)
    };
    let (one, six) = (of(&[0]), of(&[0, 3, 7, 11, 20, 23]));
    assert_eq!(one.examined * 6, six.examined);
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
    let stopped = design(&base(Carry::Inertial), &quiet(), &few, &|_| false).expect("designed");
    assert!(stopped.search.is_some_and(|s| s.interrupted && !s.proven) && !stopped.found.is_empty());
    let impossible = design(&base(Carry::Inertial), &quiet(), &options(Some(3)), &on);
    assert!(impossible.expect_err("none").to_string().contains("3 of these candidates"));
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
        (&["design", "--positions", "3", "--carry", "inertial"], "no scheme of 3"),
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
                Criterion::Margin(requirements.clone()),
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
    let prior = obsdeg_core::simulation::batch::diffuse_prior(&plan);
    let prior = SquareRootInformation::prior(&prior).expect("a prior");
    let all = batch(&plan, prior).expect("a batch").information.sigmas().expect("regular");
    for (own, c) in sigmas.iter().zip([3, 12]) {
        let expected = all[c].to_degrees() * 3600.0;
        assert!((own / expected - 1.0).abs() < 1e-6, "{own} {expected}");
    }
    assert_eq!(sigmas.len(), 2);
}

//! The exact verdicts against the filter: what must agree, and what must not.

use obsdeg_core::degree::Status;
use obsdeg_core::model::settings::{Assignment, FilterKind, Truth};
use obsdeg_core::model::{Angle, Carry, Scheme, Unknowns};
use obsdeg_ekf::SquareRootInformation;
use obsdeg_evidence::crosscheck::{
    Agreement, CrossCheck, CrossCheckOptions, Experiment, FilterChange, Prepared, crosscheck,
    crosscheck_against,
};
use obsdeg_evidence::prediction::{PredictedUnknown, Prediction};
use obsdeg_evidence::simulation::{Conditions, Plan, batch};
use obsdeg_exact::SplitMix64;
use obsdeg_report::{Format, Layout};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

use crate::program::{obsdeg, run, stderr, stdout};
use crate::schemes::{S6, paper, scheme};

const P1P2: [&str; 5] = ["crosscheck", "--angles", "0,0,0", "--angles", "180,0,0"];

fn check(scheme: &Scheme, conditions: &Conditions, filter: FilterChange) -> CrossCheck {
    crosscheck(scheme, conditions, &CrossCheckOptions { runs: 200, seed: 1, filter }, &|_| true)
        .expect("checked")
}

fn right(scheme: &Scheme) -> CrossCheck {
    check(scheme, &Conditions::default(), FilterChange::default())
}

/// The measured slope of every unknown, as predicted by its accuracy order, which the test knows by itself.
fn slopes(c: &CrossCheck, which: &str) -> Vec<f64> {
    let of = |name: &str| name.starts_with(which) && !name.contains(' ');
    c.quantities.iter().filter(|q| of(&q.name)).filter_map(|q| q.slope.measured).collect()
}

fn all_near(found: &[f64], expected: f64) -> bool {
    !found.is_empty() && found.iter().all(|s| (s - expected).abs() < 0.1)
}

#[test]
fn slopes_are_those_of_the_accuracy_orders() {
    for carry in [Carry::Platform, Carry::Inertial] {
        for n in [4, 5, 6] {
            let c = right(&scheme(&S6[..n], carry));
            assert!(c.passed, "{n} positions, {carry}: {:?}", c.disagreements);
            match (carry, n) {
                (Carry::Platform, 4) => assert!(all_near(&slopes(&c, "psi"), -1.5)),
                (Carry::Platform, _) => assert!(all_near(&slopes(&c, "D_I"), -1.5)),
                (_, 6) => assert!(all_near(&slopes(&c, "D_I"), -2.5)),
                _ => {}
            }
        }
        let c = right(&paper(carry));
        assert!(c.passed, "{:?}", c.disagreements);
        for (name, slope) in [("psi_x", -0.5), ("D_FX", -1.5), ("D_SX", -1.5), ("D_FY", -2.5), ("D_IY", -2.5)]
        {
            assert!(all_near(&slopes(&c, name), slope), "{name}");
        }
        let swapped = if carry == Carry::Platform { ["D_SZ", "D_FZ"] } else { ["D_FZ", "D_SZ"] };
        assert!(all_near(&slopes(&c, swapped[0]), -1.5) && all_near(&slopes(&c, swapped[1]), 0.0));
    }
}

#[test]
fn the_papers_case_is_consistent() {
    let c = right(&paper(Carry::Platform));
    let statistic =
        |name: &str| c.monte_carlo.statistics.iter().find(|s| s.name.starts_with(name)).expect("there");
    let all = statistic("ANEES, 15");
    assert!((all.band.0 - 14.25).abs() < 0.01 && (all.band.1 - 15.77).abs() < 0.01);
    for s in &c.monte_carlo.statistics {
        assert!(s.measured >= s.band.0 && s.measured <= s.band.1, "{s:?}");
    }
    assert_eq!(statistic("ANEES, observable").expected, 8.0);
    assert!(
        c.covariance.iter().any(|d| d.limit == 1e-6 && d.outcome == Agreement::Agrees),
        "{:?}",
        c.covariance
    );
    assert_eq!((c.defect.predicted, c.defect.measured), (7, 7));
    assert_eq!(c.ranking.kendall_tau, Some(1.0));
    // psi_x, psi_z, D_FX, D_FY, D_IY, D_SX, D_SZ, and D_FZ - wN*psi_y
    assert_eq!((c.orders.measured, c.orders.of), (8, 8));
}

/// A filter with other unknowns is found out for that; what it does not have is not measured.
#[test]
fn a_filter_without_an_unknown() {
    let c = check(
        &paper(Carry::Platform),
        &Conditions::default(),
        FilterChange { carry: Some(Carry::Reset), ..FilterChange::default() },
    );
    let psi = c.quantities.iter().find(|q| q.name == "psi_x").expect("psi_x");
    assert!(
        !psi.modelled
            && [psi.slope, psi.degree_slope, psi.inflation].iter().all(|c| c.outcome == Agreement::NotTested)
    );
    assert!(c.disagreements.contains(&"psi_x: the filter has no such unknown".to_string()));
    assert!(c.orders.measured < c.orders.of && c.quantities.iter().any(|q| q.modelled));
}

/// One position: the best variance of psi_z, eps_x and eps_y, when what their solution needs is unknown and the rest of the
/// drift is known, is 1, 12 and 720 times sigma^2 dt / T^(2k+1) (over wN^2 for eps_y, which enters psi_z'' by wN).
#[test]
fn variance_constants_of_a_single_position() {
    let single = Scheme { unknowns: Unknowns::Drift, ..scheme(&["0,0,0"], Carry::Platform) };
    let (sigma, dt, time) = (1e-5, 2.0, 200.0);
    let conditions = Conditions {
        step_s: dt,
        dwell_s: time,
        accelerometer_noise_g: sigma,
        drift_noise: "0 deg/h".parse().expect("a drift noise"),
        ..Conditions::default()
    };
    let plan = Plan::new(&single, &conditions).expect("a plan");
    let names = plan.platform.names();
    let w_n = plan.point.w_n;
    let known = |name: &str| name.starts_with("eps") || name == "psi_y^n";
    for (name, unknown, k, constant, gain) in [
        ("psi_z^n", vec![], 0, 1.0, 1.0),
        ("eps_x^n", vec!["eps_x^n"], 1, 12.0, 1.0),
        ("eps_y^n", vec!["eps_x^n", "eps_y^n", "eps_z^n"], 2, 720.0, 1.0 / w_n),
    ] {
        let prior: Vec<f64> = names
            .iter()
            .map(|n| if known(n) && !unknown.contains(&n.as_str()) { 1e-15 } else { 1e6 })
            .collect();
        let prior = SquareRootInformation::prior(&prior).expect("a prior");
        let sigmas = batch(&plan, prior).expect("a batch").information.sigmas().expect("regular");
        let found = sigmas[names.iter().position(|n| n == name).expect("an unknown")] / gain;
        let predicted = constant * sigma * sigma * dt / f64::powi(time, 2 * k + 1);
        assert!((found * found / predicted - 1.0).abs() < 0.02, "{name}: {}", found * found / predicted);
    }
}

#[test]
fn wrong_filters_are_found_out() {
    let none = FilterChange::default;
    for change in [
        FilterChange { carry: Some(Carry::Inertial), ..none() },
        FilterChange { carry: Some(Carry::Reset), ..none() },
        FilterChange { latitude: "90".parse().ok(), ..none() },
        FilterChange { dropped: Some(1), ..none() },
        FilterChange { dropped: Some(0), ..none() },
    ] {
        let c = check(&paper(Carry::Platform), &Conditions::default(), change.clone());
        assert!(!c.passed && !c.disagreements.is_empty(), "{change:?}");
        // by the data too, not only by the model
        assert!(c.monte_carlo.statistics.iter().any(|s| s.name == "NIS" && !s.pass), "{change:?}");
    }
    let c = right(&paper(Carry::Platform));
    assert!(
        c.controls.len() == 3
            && c.controls.iter().all(|k| k.outcome == Agreement::Agrees && k.failed > 0 && k.nis > 100.0)
    );
}

/// ANEES and NIS of many runs against exact truth at the paper's drifts. The iterated filter is what it believes; one that goes
/// through the run once is not, since it linearised the first steps before it knew the drifts, nor is the linear one. With
/// p1 p2 the most probable run alone has an ANEES of 16.5 under inertial carry: what is left open bends by more than what is known.
#[test]
fn the_iterated_filter_is_what_it_believes() {
    let statistics = |scheme: &Scheme, filter: Option<FilterKind>, runs: usize| {
        let conditions = Conditions { truth: Truth::Exact, filter, ..Conditions::default() };
        let plan = Plan::new(scheme, &conditions).expect("a plan");
        let experiment =
            Experiment { filter: &plan, truth: &plan, conditions: &conditions, null_space: None, seed: 1 };
        let prepared = Prepared::new(experiment).expect("prepared");
        let totals = prepared.run(runs, &|_| true);
        assert_eq!(totals.unsettled, 0);
        let [anees, nis] = &prepared.statistics(&totals)[..] else { panic!("ANEES and NIS") };
        (prepared.filter(), anees.clone(), nis.clone())
    };
    const SIX: [&str; 6] = ["0,0,0", "180,0,0", "90,0,0", "-90,0,0", "0,0,90", "0,0,-90"];
    let carries = [Carry::Platform, Carry::Inertial];
    for scheme in carries.map(|c| scheme(&SIX, c)).into_iter().chain(carries.map(paper)) {
        let (filter, anees, nis) = statistics(&scheme, None, 200);
        assert!(filter == FilterKind::Iterated && anees.pass && nis.pass, "{anees:?} {nis:?}");
    }
    for carry in [Carry::Platform, Carry::Inertial] {
        let (_, anees, nis) = statistics(&paper(carry), Some(FilterKind::Extended), 50);
        assert!(anees.measured > 40.0 && nis.measured < 2.2, "{carry}: {anees:?} {nis:?}");
        let (_, anees, nis) = statistics(&paper(carry), Some(FilterKind::Linear), 50);
        assert!(anees.measured > 1e4 && nis.measured > 10.0, "{carry}: {anees:?} {nis:?}");
    }
}

/// A sign that is wrong in the model of the verdicts shows against the equations of direction cosines.
#[test]
fn the_model_is_held_against_equations_written_anew() {
    for carry in Carry::ALL {
        let c = right(&scheme(&["10,25,40", "130,-50,70"], carry));
        let d = c.covariance.iter().find(|d| d.name.contains("direction cosines")).expect("held against");
        assert!(d.outcome == Agreement::Agrees && d.difference < 1e-12, "{carry}: {d:?}");
    }
}

#[test]
fn exact_truth_fails_the_linear_filter_at_the_papers_drifts_and_passes_at_a_thousandth() {
    let linear = Some(FilterKind::Linear);
    let exact = Conditions { truth: Truth::Exact, filter: linear, ..Conditions::default() };
    let c = check(&paper(Carry::Platform), &exact, FilterChange::default());
    let nis = c.monte_carlo.statistics.iter().find(|s| s.name == "NIS").expect("NIS");
    assert!(!c.passed && nis.measured > 100.0 && !c.validity.holds);
    // what fails is the model of the runs, not a verdict
    assert!(c.verdicts_agree && c.quantities.iter().all(|q| !q.slope.fails() && !q.inflation.fails()));
    let title = |c: &CrossCheck| {
        let text = obsdeg_report::written(c, Format::Table, Layout::default()).expect("text");
        text.lines().next().unwrap_or_default().to_string()
    };
    assert_eq!(
        title(&c),
        "Cross-check: filter and exact verdicts agree, but the Monte Carlo runs (d) do NOT fit the filter (platform carry)"
    );
    let wrong = FilterChange { carry: Some(Carry::Inertial), ..FilterChange::default() };
    let c = check(&paper(Carry::Platform), &Conditions::default(), wrong);
    assert!(
        !c.verdicts_agree && title(&c).contains("filter and exact verdicts DISAGREE"),
        "{:?}",
        c.disagreements
    );
    // of psi too: with 0.1 deg |psi|^2/2 is half the noise of one sample, which 200 samples begin to see
    let psi = || vec![Assignment { name: "psi".into(), value: 0.02 }];
    let priors = [exact.priors.clone(), psi()].concat();
    let small =
        Conditions { drift_scale: 1e-3, values: [exact.values.clone(), psi()].concat(), priors, ..exact };
    let c = check(&paper(Carry::Inertial), &small, FilterChange::default());
    assert!(c.passed && c.validity.holds, "{:?}", c.disagreements);
}

/// A prior of one position holds for the truth and for filters that have no such unknown.
#[test]
fn psi_of_one_position() {
    let prior = |name: &str| Assignment { name: name.into(), value: 0.2 };
    let priors = [Conditions::default().priors, vec![prior("psi_x@2")]].concat();
    let conditions = Conditions { priors, ..Conditions::default() };
    let c = check(&paper(Carry::Reset), &conditions, FilterChange::default());
    assert!(c.passed && c.controls.len() == 3, "{:?}", c.disagreements);
    let other = FilterChange { carry: Some(Carry::Platform), ..FilterChange::default() };
    assert!(!check(&paper(Carry::Reset), &conditions, other).passed);
}

/// At the pole, drift that nobody sees turns psi during the dwell: what derivatives see is lost at the start (slope) or at the end
/// (inflation), and directions move psi as well. The filter agrees with all of it.
#[test]
fn at_the_pole_the_dwell_takes_away() {
    let at_the_pole =
        |attitudes: &[&str], carry| Scheme { latitude: "90".parse().ok(), ..scheme(attitudes, carry) };
    for carry in Carry::ALL {
        for attitudes in [&["0,0,0", "0,90,0", "45,0,0"][..], &S6[..3], &S6[..5]] {
            let c = right(&at_the_pole(attitudes, carry));
            assert!(c.passed, "{attitudes:?} {carry}: {:?}", c.disagreements);
        }
    }
    let c = right(&at_the_pole(&["0,0,0", "0,90,0", "45,0,0"], Carry::Platform));
    let of = |name: &str| c.quantities.iter().find(|q| q.name == name).expect("an unknown");
    let seen = |name: &str| (of(name).accuracy_order, of(name).inflation.predicted);
    assert_eq!(["psi_x", "psi_y", "psi_z"].map(seen), [(Some(0), 1.0), (None, 10.0), (Some(0), 10.0)]);
    // derivatives see it, samples over dwells do not
    assert_eq!(
        (of("psi_y").status_measured, of("psi_y").slope.measured),
        (Some(Status::Observable), Some(0.0))
    );
}

/// The control at another latitude is far from the scheme's: at 89.9999 degrees a filter at the pole is hardly wrong.
#[test]
fn the_control_is_at_a_latitude_far_away() {
    for (latitude, control) in
        [(Some("89.9999"), "0"), (Some("-60"), "0"), (Some("50"), "0"), (Some("40"), "90"), (None, "90")]
    {
        let scheme = Scheme { latitude: latitude.and_then(|l| l.parse().ok()), ..paper(Carry::Platform) };
        let options = CrossCheckOptions { runs: 2, seed: 1, filter: FilterChange::default() };
        let c = crosscheck(&scheme, &Conditions::default(), &options, &|_| true).expect("checked");
        let name = format!("filter at latitude {control} deg");
        assert!(
            c.controls.iter().any(|k| k.name == name && k.outcome == Agreement::Agrees),
            "{latitude:?}: {:?}",
            c.controls
        );
    }
}

/// Of white innovations the probability is even: 500 times ten runs of 20 samples, whose longest lag has half as many products. The mean of
/// 500 even numbers is 0.5 +- 0.013, and one in a hundred is below 0.01.
#[test]
fn whiteness_of_right_filters_is_even() {
    let conditions = Conditions { dwell_s: 100.0, ..Conditions::default() };
    let plan = Plan::new(&paper(Carry::Inertial), &conditions).expect("a plan");
    let experiment =
        Experiment { filter: &plan, truth: &plan, conditions: &conditions, null_space: None, seed: 3 };
    let prepared = Prepared::new(experiment).expect("prepared");
    let p: Vec<f64> = (0..500).map(|k| prepared.whiteness(&prepared.chunk(10 * k, 10 * k + 10))).collect();
    let (mean, small) = (p.iter().sum::<f64>() / 500.0, p.iter().filter(|p| **p < 0.01).count());
    assert!((mean - 0.5).abs() < 0.05 && (1..=12).contains(&small), "{mean} {small}");
    // of one sample, and of two, there are no lags and one
    let short = Conditions { dwell_s: 10.0, ..conditions };
    for attitudes in [&["0,0,0"][..], &["0,0,0", "180,0,0"]] {
        let plan = Plan::new(&scheme(attitudes, Carry::Inertial), &short).expect("a plan");
        let experiment =
            Experiment { filter: &plan, truth: &plan, conditions: &short, null_space: None, seed: 3 };
        let prepared = Prepared::new(experiment).expect("prepared");
        assert!((0.001..=1.0).contains(&prepared.whiteness(&prepared.chunk(0, 50))));
    }
}

/// Same seed, same bytes, whatever the number of threads; and the bar hears of every run.
#[test]
fn threads_do_not_change_the_sums() {
    let conditions = Conditions::default();
    let plan = Plan::new(&paper(Carry::Platform), &conditions).expect("a plan");
    let experiment =
        || Experiment { filter: &plan, truth: &plan, conditions: &conditions, null_space: None, seed: 7 };
    let prepared = Prepared::new(experiment()).expect("prepared");
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let heard = std::sync::atomic::AtomicUsize::new(0);
        let totals = pool.install(|| {
            prepared.run(300, &|done| {
                heard.store(done, std::sync::atomic::Ordering::Relaxed);
                true
            })
        });
        (totals, heard.into_inner())
    };
    let (one, heard) = run(1);
    assert_eq!(heard, 300);
    assert_eq!(one, run(3).0);
}

proptest! {
    #![proptest_config(Config { cases: 24, rng_seed: RngSeed::Fixed(1), ..Config::default() })]
    /// Random schemes of whole degrees (the same ones each time: one in three hundred right filters leaves a band of 99.9 %): model evidence a, b, c and the ranking agree with the exact verdicts.
    #[test]
    fn random_schemes_agree(
        angles in prop::collection::vec(prop::array::uniform3(-18i32..18), 1..6),
        carry in prop::sample::select(Carry::ALL.to_vec()),
    ) {
        let attitudes: Vec<String> =
            angles.iter().map(|[a, b, c]| format!("{},{},{}", a * 10, b * 10, c * 10)).collect();
        let attitudes: Vec<&str> = attitudes.iter().map(String::as_str).collect();
        let scheme = scheme(&attitudes, carry);
        let options = CrossCheckOptions { runs: 8, seed: 1, filter: FilterChange::default() };
        let c = crosscheck(&scheme, &Conditions::default(), &options, &|_| true).expect("checked");
        prop_assert!(c.passed, "{attitudes:?} {carry}: {:?}", c.disagreements);
    }
}

/// Noise, step and dwell only scale what the samples say: slopes, inflation and null vectors are theirs, not those of a prior.
#[test]
fn evidence_does_not_depend_on_noise_and_steps() {
    let usual = right(&paper(Carry::Platform));
    for (noise, step, dwell) in
        [(1e-5, 0.1, 100.0), (1e-5, 0.01, 20.0), (1e-12, 10.0, 1000.0), (1e2, 1.0, 1000.0)]
    {
        let conditions = Conditions {
            accelerometer_noise_g: noise,
            step_s: step,
            dwell_s: dwell,
            ..Conditions::default()
        };
        let options = CrossCheckOptions { runs: 2, seed: 1, filter: FilterChange::default() };
        let c = crosscheck(&paper(Carry::Platform), &conditions, &options, &|_| true).expect("checked");
        for (a, b) in usual.quantities.iter().zip(&c.quantities) {
            let (slope, factor) =
                (b.slope.measured.expect("a slope"), b.inflation.measured.expect("a factor"));
            assert!(
                (slope - a.slope.measured.expect("a slope")).abs() < 1e-4,
                "{noise} {step}: {} {slope}",
                a.name
            );
            assert!(
                b.slope.outcome == Agreement::Agrees && b.inflation.outcome == Agreement::Agrees,
                "{noise} {step}: {} {factor}",
                a.name
            );
        }
        assert!(
            c.defect.outcome == Agreement::Agrees
                && c.null_space.iter().all(|v| v.seen.outcome == Agreement::Agrees),
            "{noise} {step}"
        );
    }
}

/// Valid schemes always get an answer. (One of the first has coefficients that never separate, at a latitude and dwells that used to
/// end in a pivot of nothing.)
#[test]
fn every_valid_scheme_is_answered() {
    let mut first = scheme(&["0,0,180", "180,180,0", "0,-90,180", "90,180,-90", "0,90,0"], Carry::Platform);
    first.latitude = "-60".parse().ok();
    first.unknowns = "I,II".parse().expect("terms");
    first.positions[0].dwell = "500".parse().ok();
    let options = CrossCheckOptions { runs: 2, seed: 1, filter: FilterChange::default() };
    let answered =
        |scheme: &Scheme, conditions: &Conditions| crosscheck(scheme, conditions, &options, &|_| true);
    let c = answered(&first, &Conditions::default()).expect("an answer");
    assert!(
        c.quantities.iter().all(|q| [q.slope, q.inflation].iter().all(|c| c.outcome == Agreement::Agrees)),
        "{:?}",
        c.disagreements
    );
    let strategy = (
        prop::collection::vec(prop::array::uniform3(-2i32..=2), 1..4),
        prop::sample::subsequence(vec!["F", "I", "O", "S", "II", "OO", "SS", "IO", "IS", "OS"], 1..5),
        prop::sample::select(vec!["-60", "0", "28.2", "89.9", "90"]),
        prop::sample::select(Carry::ALL.to_vec()),
        prop::sample::select(vec![1e-9, 1e-5, 1e-2]),
        prop::sample::select(vec![20.0, 300.0]),
        prop::sample::select(vec!["100", "500"]),
    );
    let config =
        Config { cases: 40, rng_seed: RngSeed::Fixed(3), failure_persistence: None, ..Config::default() };
    proptest!(config, |((places, terms, latitude, carry, noise, step, dwell) in strategy)| {
        let attitudes: Vec<String> =
            places.iter().map(|a| a.map(|k| (k * 90).to_string()).join(",")).collect();
        let mut scheme = scheme(&attitudes.iter().map(String::as_str).collect::<Vec<_>>(), carry);
        scheme.latitude = latitude.parse().ok();
        scheme.unknowns = terms.join(",").parse().expect("terms");
        scheme.positions[0].dwell = dwell.parse().ok();
        let conditions = Conditions { accelerometer_noise_g: noise, step_s: step, ..Conditions::default() };
        let answer = answered(&scheme, &conditions);
        prop_assert!(answer.is_ok(), "{:?}", answer.err());
    });
}

/// A position cannot be dropped when there is no other.
#[test]
fn the_only_position_is_not_dropped() {
    let filter = FilterChange { dropped: Some(0), ..FilterChange::default() };
    let options = CrossCheckOptions { runs: 2, seed: 1, filter };
    let one = scheme(&["0,0,0"], Carry::Platform);
    let refused = crosscheck(&one, &Conditions::default(), &options, &|_| true).expect_err("refused");
    assert!(refused.to_string().contains("only position"), "{refused}");
}

#[test]
fn exit_codes_and_the_same_bytes() {
    let run = |arguments: &[&str]| run(&[&P1P2[..], &["--runs", "40"], arguments].concat());
    let (first, second) = (run(&["--format", "json"]), run(&["--format", "json"]));
    assert_eq!(first.status.code(), Some(0));
    assert_eq!(first.stdout, second.stdout);
    assert!(first.stderr.is_empty());
    assert_eq!(run(&["--filter-carry", "inertial"]).status.code(), Some(1));
    assert_eq!(run(&["--truth", "exact", "--filter", "linear"]).status.code(), Some(1));
    assert_eq!(run(&["--truth", "exact"]).status.code(), Some(0));
    assert_eq!(run(&["--filter-drop", "p9"]).status.code(), Some(2));
    assert_eq!(run(&["--value", "D_FW=1"]).status.code(), Some(2));
    assert_eq!(run(&["--drift-noise", "0.01"]).status.code(), Some(2));
}

/// The paper's case word by word; figures that are rounding are left out.
#[test]
fn the_papers_case_word_by_word() {
    let output = run(&P1P2);
    assert!(output.status.success() && output.stderr.is_empty());
    insta::with_settings!({
        omit_expression => true,
        prepend_module_to_snapshot => false,
        filters => vec![(r" *\d\.\de-?\d+   ", "   [rounding]   ")],
    }, {
        insta::assert_snapshot!("crosscheck_p1p2_table", stdout(&output));
    });
}

/// Figures of the evidence, and nothing else, are written.
#[test]
fn the_folder_of_a_crosscheck() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("evidence");
    let arguments =
        ["crosscheck", "--angles", "0,0,0", "--angles", "180,0,0", "--runs", "16", "--quiet", "-o"];
    let output = obsdeg(&arguments).arg(&folder).output().expect("it runs");
    assert!(output.status.success(), "{}", stderr(&output));
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .expect("the folder")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let pictures = ["correlation", "nees", "nis", "slopes"]
        .iter()
        .flat_map(|n| [format!("{n}.png"), format!("{n}.svg")]);
    let mut expected: Vec<String> = pictures.chain(["evidence.json".into()]).collect();
    expected.sort();
    assert_eq!(names, expected);
    let slopes = std::fs::read_to_string(folder.join("slopes.svg")).expect("readable");
    for text in ["slope -0.5", "slope -1.5", "slope -2.5", "dwell of a position [s]", "1 sigma [deg/h/g]"] {
        assert!(slopes.contains(text), "{text}");
    }
    // no two curves alike, of one order or of several: colours and dashes; references are black and dotted
    let value = |path: &str, key: &str| {
        let rest = path.split_once(&format!(" {key}=\""))?.1;
        rest.split_once('"').map(|(value, _)| value.to_string())
    };
    let paths = slopes.split("<path ").skip(1).filter_map(|p| p.split_once("/>").map(|(path, _)| path));
    let styles: Vec<_> = paths
        .map(|path| (value(path, "stroke"), value(path, "stroke-dasharray")))
        .filter(|(color, _)| color.as_deref() != Some("#000000"))
        .collect();
    let different: std::collections::BTreeSet<_> = styles.iter().collect();
    assert_eq!((styles.len(), different.len()), (8, 8), "{styles:?}");
}

/// What doubles at dwells of a platform do not show, many digits at short dwells do: positions that hardly differ, and a latitude close to
/// the pole.
#[test]
fn what_doubles_do_not_show_is_resolved() {
    let at = |latitude: &str, attitudes: &[&str], carry| Scheme {
        latitude: latitude.parse().ok(),
        ..scheme(attitudes, carry)
    };
    for (s, unknown, order) in [
        (at("89.9999", &["0,0,0", "180,0,0"], Carry::Platform), "D_FY", Some(2)),
        (at("28.2", &["0,0,0", "0,0,0.1"], Carry::Platform), "D_SY", None),
        (at("28.2", &["0,0,0", "0.1,0,0"], Carry::Inertial), "D_OY", None),
        (at("28.2", &["0,0,0", "0,0,0.000000001"], Carry::Platform), "D_SY", None),
        (at("90", &["90,0,0", "0,90,0"], Carry::Platform), "psi_z", None),
    ] {
        let options = CrossCheckOptions { runs: 20, seed: 1, filter: FilterChange::default() };
        let c = crosscheck(&s, &Conditions::default(), &options, &|_| true).expect("checked");
        assert!(c.passed, "{unknown}: {:?}", c.disagreements);
        let q = c.quantities.iter().find(|q| q.name == unknown).expect("an unknown");
        assert_eq!(q.accuracy_order, order, "{unknown}");
        let all = c.quantities.iter().take(15);
        let slopes = all.flat_map(|q| [q.degree_slope.outcome, q.slope.outcome, q.slope_at_end.outcome]);
        assert!(slopes.into_iter().all(|o| o == Agreement::Agrees), "{unknown}");
    }
}

/// What is not resolvable is counted, and no disagreement: the filter's prior is none beside a direction that is seen through a turn of
/// 1e-9 degrees.
#[test]
fn what_is_not_resolvable_is_no_disagreement() {
    let s = scheme(&["40,-6,155", "-22,12,45", "140,136,109", "40,-6,155.000000001"], Carry::Platform);
    let options = CrossCheckOptions { runs: 20, seed: 1, filter: FilterChange::default() };
    let c = crosscheck(&s, &Conditions::default(), &options, &|_| true).expect("checked");
    assert!(c.passed && c.counts.not_resolvable > 0 && c.counts.disagree == 0, "{:?}", c.disagreements);
    assert!(c.quantities.iter().any(|q| q.inflation.outcome == Agreement::NotResolvable));
    let text = obsdeg_report::written(&c, Format::Table, Layout::default()).expect("text");
    let line = format!(
        "checks: {} agree, 0 disagree, {} not resolvable, {} not tested",
        c.counts.agree, c.counts.not_resolvable, c.counts.not_tested
    );
    assert!(text.contains(&line) && text.contains("not resolvable where a direction that is seen"), "{text}");
}

/// The verdicts on a scheme, as numbers.
fn predicted(scheme: &Scheme) -> Prediction {
    let plan = Plan::new(scheme, &Conditions::default()).expect("a plan");
    Prediction::new(&plan.platform, [plan.point.w_n, plan.point.w_u], 1).expect("a prediction")
}

/// Holds a prediction against a scheme.
fn held(prediction: &Prediction, scheme: &Scheme) -> CrossCheck {
    let options = CrossCheckOptions { runs: 2, seed: 1, filter: FilterChange::default() };
    crosscheck_against(prediction, scheme, &Conditions::default(), &options, &|_| true).expect("checked")
}

/// Every wrong word of a verdict is caught: one field after the other is changed.
#[test]
fn wrong_verdicts_are_caught() {
    type Change = Box<dyn Fn(&mut Prediction)>;
    let three = scheme(&["0,0,0", "90,0,0", "0,90,0"], Carry::Inertial);
    for s in [paper(Carry::Platform), three] {
        let right = predicted(&s);
        let c = held(&right, &s);
        assert!(c.passed && c.counts.not_resolvable == 0, "{:?}", c.disagreements);
        let mut wrong: Vec<(String, Change)> = Vec::new();
        let mut add = |what: String, change: Change| wrong.push((what, change));
        // of the second scheme the first of every kind: the others are judged alike
        let kind = |u: &PredictedUnknown| (u.status, u.degree, u.accuracy_order, u.order_at_end);
        let is_first = |i: usize| right.unknowns[..i].iter().all(|u| kind(u) != kind(&right.unknowns[i]));
        let chosen = (0..right.unknowns.len()).filter(|&i| s.carry == Carry::Platform || is_first(i));
        for (i, u) in chosen.map(|i| (i, &right.unknowns[i])) {
            if u.degree.is_some() {
                add(
                    format!("degree {i} + 1"),
                    Box::new(move |p| p.unknowns[i].degree = p.unknowns[i].degree.map(|d| d + 1)),
                );
                add(
                    format!("not observable {i}"),
                    Box::new(move |p| {
                        (p.unknowns[i].status, p.unknowns[i].degree) = (Status::Inseparable, None)
                    }),
                );
            } else {
                add(
                    format!("observable {i}"),
                    Box::new(move |p| {
                        (p.unknowns[i].status, p.unknowns[i].degree) = (Status::Observable, Some(1))
                    }),
                );
                let other = [Status::Inseparable, Status::NotExcited];
                let swapped = other[usize::from(u.status == Status::Inseparable)];
                add(format!("status {i}"), Box::new(move |p| p.unknowns[i].status = swapped));
            }
            let others = u.partners.len();
            if others > 0 {
                add(
                    format!("a partner of {i} less"),
                    Box::new(move |p| p.unknowns[i].partners.truncate(others - 1)),
                );
                add(format!("no partners of {i}"), Box::new(move |p| p.unknowns[i].partners.clear()));
            }
            add(
                format!("a partner of {i} more"),
                Box::new(move |p| {
                    let own = &mut p.unknowns[i].partners;
                    let other = (0..).find(|c| *c != i && !own.contains(c)).expect("another");
                    own.push(other);
                }),
            );
            if u.accuracy_order.is_some() {
                add(
                    format!("order {i} + 1"),
                    Box::new(move |p| {
                        p.unknowns[i].accuracy_order = p.unknowns[i].accuracy_order.map(|d| d + 1)
                    }),
                );
                add(format!("no order {i}"), Box::new(move |p| p.unknowns[i].accuracy_order = None));
            }
            add(
                format!("order at the end {i}"),
                Box::new(move |p| {
                    p.unknowns[i].order_at_end = p.unknowns[i].order_at_end.map_or(Some(1), |d| Some(d + 1))
                }),
            );
            add(
                format!("determined at the end {i}"),
                Box::new(move |p| p.unknowns[i].determined_at_end = !p.unknowns[i].determined_at_end),
            );
        }
        add(
            "all degrees + 3".into(),
            Box::new(|p| {
                p.unknowns.iter_mut().for_each(|u| u.degree = u.degree.map(|d| d + 3));
            }),
        );
        add(
            "nothing excited".into(),
            Box::new(|p| {
                p.unknowns.iter_mut().for_each(|u| (u.status, u.degree) = (Status::NotExcited, None));
            }),
        );
        for (i, c) in right.combinations.iter().enumerate() {
            add(format!("without combination {i}"), Box::new(move |p| drop(p.combinations.remove(i))));
            add(
                format!("combination {i} twice"),
                Box::new(move |p| {
                    let again = p.combinations[i].clone();
                    p.combinations.push(again);
                }),
            );
            add(
                format!("degree of combination {i}"),
                Box::new(move |p| p.combinations[i].degree = p.combinations[i].degree.map(|d| d + 1)),
            );
            for k in 0..c.terms.len() {
                add(
                    format!("coefficient {k} of combination {i}"),
                    Box::new(move |p| p.combinations[i].terms[k].1 *= 1.001),
                );
            }
        }
        let vectors = right.unseen_by_derivatives.as_ref().expect("numbers");
        fn list(p: &mut Prediction) -> &mut Vec<obsdeg_evidence::prediction::Combination> {
            p.unseen_by_derivatives.as_mut().expect("numbers")
        }
        add("no null space".into(), Box::new(|p| list(p).clear()));
        for (i, v) in vectors.iter().enumerate() {
            add(format!("without null vector {i}"), Box::new(move |p| drop(list(p).remove(i))));
            add(
                format!("null vector {i} twice"),
                Box::new(move |p| {
                    let again = list(p)[i].clone();
                    list(p).push(again);
                }),
            );
            add(
                format!("null vector {i} for all"),
                Box::new(move |p| {
                    let again = list(p)[i].clone();
                    let (n, unknowns) = (list(p).len(), p.unknowns.len());
                    // of one vector, another that is seen
                    let other = vec![vec![(unknowns - 1, 1.0)]; n];
                    *list(p) = if n > 1 { vec![again; n] } else { other };
                }),
            );
            for k in 0..v.len() {
                add(format!("component {k} of null vector {i}"), Box::new(move |p| list(p)[i][k].1 *= 1.001));
            }
        }
        for (i, v) in right.null_space.iter().enumerate().filter(|(_, v)| v.len() > 1) {
            for k in 0..v.len() {
                add(
                    format!("component {k} with dwells {i}"),
                    Box::new(move |p| p.null_space[i][k].1 *= 1.001),
                );
            }
        }
        add("nothing unseen with dwells".into(), Box::new(|p| p.null_space.clear()));
        for i in 0..right.null_space.len() {
            add(format!("without {i} with dwells"), Box::new(move |p| drop(p.null_space.remove(i))));
            add(
                format!("{i} twice with dwells"),
                Box::new(move |p| {
                    let last = p.null_space.len() - 1;
                    let other = if i == last { 0 } else { last };
                    p.null_space[other] = p.null_space[i].clone();
                    if last == 0 {
                        p.null_space.push(p.null_space[0].clone());
                    }
                }),
            );
        }
        add("rank + 1".into(), Box::new(|p| p.rank += 1));
        for k in 0..right.rank_profile.len() {
            add(format!("dim V_{k}"), Box::new(move |p| p.rank_profile[k] += 1));
        }
        assert!(wrong.len() > 40);
        for (what, change) in wrong {
            let mut prediction = right.clone();
            change(&mut prediction);
            if prediction == right {
                continue;
            }
            let c = held(&prediction, &s);
            // what exit code 1 says
            assert!(!c.passed && !c.verdicts_agree && c.counts.disagree > 0, "{what} is not caught");
        }
    }
}

/// The verdicts on another carry, another mounting (signs of S_i: two at a time, since axes stay right-handed), other angles and another
/// latitude are caught.
#[test]
fn verdicts_on_something_else_are_caught() {
    let s = scheme(&["0,0,0", "90,0,0", "0,90,0"], Carry::Platform);
    let mounted = |gyro: usize, kept: usize| {
        let mut geometry = s.geometry;
        let gyro = [&mut geometry.X, &mut geometry.Y, &mut geometry.Z].into_iter().nth(gyro).expect("a gyro");
        let axes = [&mut gyro.I, &mut gyro.O, &mut gyro.S];
        axes.into_iter().enumerate().filter(|(k, _)| *k != kept).for_each(|(_, a)| a.negative ^= true);
        Scheme { geometry, ..s.clone() }
    };
    let mut mountings = 0;
    for other in (0..9).map(|k| mounted(k / 3, k % 3)) {
        let (wrong, right) = (predicted(&other), predicted(&s));
        // what is the same to every word is no wrong verdict
        if wrong != right {
            let c = held(&wrong, &s);
            assert!(!c.passed && !c.verdicts_agree, "{other:?}");
            mountings += 1;
        }
    }
    assert!(mountings >= 6, "{mountings}");
    for other in [
        Scheme { carry: Carry::Inertial, ..s.clone() },
        scheme(&["0,0,0", "90,0,0", "0,90,30"], Carry::Platform),
        Scheme { latitude: "90".parse().ok(), ..s.clone() },
    ] {
        let c = held(&predicted(&other), &s);
        assert!(!c.passed && !c.verdicts_agree, "{other:?}");
    }
}

/// A scheme drawn at random: carries, latitudes with poles and equator, terms, one to eight positions; `near` has two positions or a
/// latitude that hardly differ from another.
fn drawn(seed: u64, near: bool) -> Scheme {
    let mut rng = SplitMix64::new(seed);
    let mut pick = |n: usize| rng.below(n as u64) as usize;
    let (count, carry, kind) = (1 + pick(8), Carry::ALL[pick(3)], pick(4));
    let mut angle = || match kind {
        0 => 90_000 * (pick(4) as i64 - 1),
        1 => 30_000 * (pick(12) as i64 - 5),
        2 => 1000 * (pick(360) as i64 - 180),
        _ => pick(360_000) as i64 - 180_000,
    };
    let mut places: Vec<[i64; 3]> =
        (0..count).map(|_| std::array::from_fn(|_| 1_000_000 * angle())).collect();
    let mut latitude = ["28.2", "0", "90", "-90", "-60", "45", "1", "80"][pick(8)];
    let terms = ["F,I,O,S", "F", "F,I", "F,I,O,S,II,OO,SS,IO,IS,OS", "I,II", "F,S,IO"][pick(6)];
    if near && pick(3) == 0 {
        latitude = ["89.9999", "89.99", "0.0001", "-0.01", "89.999999999", "-89.9999"][pick(6)];
    } else if near {
        // 0.1 to 1e-9 degrees
        let mut place = places[pick(count)];
        place[pick(3)] += [100_000_000, 30_000_000, 10_000_000, 1_000_000, 1000, 1][pick(6)];
        places.push(place);
    }
    let angles = places.iter().map(|p| p.map(Angle::from_nanodeg));
    let mut scheme = Scheme {
        carry,
        latitude: latitude.parse().ok(),
        unknowns: terms.parse().expect("terms"),
        measured_azimuth: pick(6) == 0,
        ..Scheme::of_angles(angles)
    };
    for position in &mut scheme.positions {
        if pick(3) > 0 {
            continue;
        }
        position.dwell = ["100", "300", "2000"][pick(3)].parse().ok();
    }
    scheme
}

/// Checks schemes drawn at random: no verdict disagrees, and at most one in a hundred checks (one in ten of schemes that are `near`) is
/// not resolvable.
#[expect(clippy::print_stdout, reason = "the figures of a long run")]
fn sweep(seeds: std::ops::Range<u64>, near: bool) {
    let mut counts = [0; 3];
    for seed in seeds {
        let s = drawn(seed, near);
        let options = CrossCheckOptions { runs: 8, seed, filter: FilterChange::default() };
        let c = crosscheck(&s, &Conditions::default(), &options, &|_| true).expect("an answer");
        assert!(c.verdicts_agree, "{seed} {s:?}: {:?}", c.disagreements);
        counts = [
            counts[0] + c.counts.agree,
            counts[1] + c.counts.not_resolvable,
            counts[2] + c.counts.not_tested,
        ];
    }
    let [agree, open, untested] = counts;
    println!("{agree} agree, {open} not resolvable, {untested} not tested");
    assert!(open * if near { 10 } else { 100 } <= agree, "{counts:?}");
}

#[test]
fn schemes_drawn_at_random_agree() {
    sweep(0..25, false);
    // a psi that is not excited, but for what cosines of right angles leave of its column
    sweep(296..297, false);
    sweep(1000..1010, true);
    // sines of right angles are rounded, times a psi that nobody sees
    sweep(1060..1061, true);
}

/// Minutes: `cargo test --test it -- --ignored many_schemes --nocapture`.
#[test]
#[ignore = "minutes"]
fn many_schemes_drawn_at_random_agree() {
    sweep(0..500, false);
    sweep(1000..1100, true);
}

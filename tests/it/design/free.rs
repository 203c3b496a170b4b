//! Free attitudes: evaluated as printed, and never worse than the cardinal ones.

use obsdeg_core::model::c_n_f64;
use obsdeg_core::model::settings::Assignment;
use obsdeg_design::design::{
    Candidates, Criterion, CriterionName, Design, DesignOptions, Evaluator, Everywhere, SigmaLimits,
};
use obsdeg_exact::SplitMix64;

use super::certificate::Oracle;
use super::*;

const CRITERIA: [CriterionName; 5] =
    [CriterionName::Worst, CriterionName::A, CriterionName::D, CriterionName::E, CriterionName::Margin];

/// Angles of a printed attitude, in degrees.
fn degrees(text: &str) -> [f64; 3] {
    let angles: Vec<f64> = text.split(',').map(|a| a.parse().expect("degrees")).collect();
    angles.try_into().expect("three angles")
}

/// Designs of one task with free and with cardinal attitudes, and the data for an evaluation from the
/// equations.
struct DesignPair {
    terms: &'static str,
    criterion: Criterion,
    conditions: Conditions,
    latitude: f64,
    cardinal: Design,
    free: Design,
    /// Optimal weights over all attitudes, found from the same candidates.
    every: Everywhere,
}

/// Random task with `k` positions.
fn both(
    criterion: CriterionName,
    terms: &'static str,
    k: usize,
    step: i64,
    rng: &mut SplitMix64,
) -> DesignPair {
    let mut between =
        |low: f64, high: f64| low + (high - low) * (rng.below(1 << 30) as f64 / f64::from(1 << 30));
    let m = 3 * terms.len();
    let latitude = between(10.0, 70.0).round();
    let limits: Vec<f64> = (0..m).map(|_| 10f64.powf(between(-2.0, 0.0))).collect();
    let mut conditions = Conditions {
        dwell_s: (between(3.0, 30.0).round() * 100.0),
        step_s: 50.0,
        accelerometer_noise_g: 10f64.powf(between(-6.0, -4.0)),
        ..quiet()
    };
    if criterion == CriterionName::Margin {
        for (j, value) in limits.iter().enumerate() {
            let name = format!("D_{}{}", &terms[j / 3..=j / 3], ["X", "Y", "Z"][j % 3]);
            conditions.requirements.push(Assignment { name, value: *value });
        }
        conditions.requirements.push(Assignment { name: "psi".into(), value: 0.1 });
    }
    let listed = terms.chars().map(|t| t.to_string()).collect::<Vec<_>>().join(",");
    let base = Scheme {
        latitude: latitude.to_string().parse().ok(),
        unknowns: listed.parse().expect("terms"),
        ..base(Carry::Reset)
    };
    let of = |candidates: Candidates, free: Option<i64>| {
        let options =
            DesignOptions { candidates, criterion, free, restarts: 12, keep: 3, ..options(Some(k)) };
        design(&base, &conditions, &options, &on).expect("designed")
    };
    let grid = Candidates::grid(45_000_000_000).expect("a grid");
    let (cardinal, free) = (of(Candidates::cardinals(), None), of(grid.clone(), Some(step)));
    let criterion = match criterion {
        CriterionName::Worst => Criterion::Worst,
        CriterionName::A => Criterion::A,
        CriterionName::D => Criterion::D,
        CriterionName::E => Criterion::E,
        CriterionName::Margin => Criterion::Margin(SigmaLimits { coefficients: limits, psi: [0.1; 3] }),
    };
    let all: Vec<usize> = (0..m).collect();
    let evaluator = Evaluator::new(&base, &grid.attitudes, &all, &conditions).expect("an evaluator");
    let every = evaluator.everywhere(&without_psi(&criterion), k, &|| true).expect("a bound");
    DesignPair { terms, criterion, conditions, latitude, cardinal, free, every }
}

impl DesignPair {
    /// Criterion of printed attitudes with the given weights; `None` if it cannot be evaluated.
    fn value(&self, angles: &[String], times: &[f64]) -> Option<f64> {
        let c = &self.conditions;
        let oracle = Oracle::new(
            (self.latitude, c.dwell_s, c.step_s, c.accelerometer_noise_g),
            &angles.iter().map(|a| degrees(a)).collect::<Vec<_>>(),
            self.terms,
        );
        let counting: Vec<usize> = (0..3 * self.terms.len()).collect();
        let scheme: Vec<(usize, f64)> = times.iter().copied().enumerate().collect();
        oracle.weighed(&scheme, &counting, &self.criterion)
    }

    /// Checks the printed values by the equations. True for each that could be evaluated: best schemes,
    /// scheme with finer angles, weights.
    fn check(&self, step: f64) -> [bool; 3] {
        let (first, cardinal) = (&self.free.found[0], &self.cardinal.found[0]);
        let task = format!("{} {:?} {first:?}", self.terms, self.criterion);
        // better in the order of the search, where a smaller degree comes first
        let key = |f: &Found| (f.worst_degree, f.value);
        assert!(key(first) <= (cardinal.worst_degree, cardinal.value * (1.0 + 1e-12)), "{task} {cardinal:?}");
        let reaches = |value: Option<f64>, stated: f64, within: f64| {
            assert!(value.is_none_or(|v| (v / stated - 1.0).abs() < within), "{task}: {value:?} {stated}");
            value.is_some()
        };
        let once = |n: usize| vec![1.0; n];
        let found = self
            .free
            .found
            .iter()
            .all(|f| reaches(self.value(&f.angles, &once(f.angles.len())), f.value, 1e-4));
        let on_grid = |angle: &f64| (angle / step - (angle / step).round()).abs() < 1e-9;
        for angles in self.free.found.iter().flat_map(|f| &f.angles) {
            assert!(degrees(angles).iter().all(|a| on_grid(a) || *a % 90.0 == 0.0), "{task}");
        }
        let certificate =
            self.free.search.as_ref().and_then(|s| s.certificate.as_ref()).expect("a certificate");
        let every = certificate.everywhere.as_ref().expect("a bound over all attitudes");
        assert!(matches!(self.criterion, Criterion::Margin(_)) || every.best_possible <= first.value);
        let rounded = every.rounded.as_ref().expect("rounded angles");
        assert_eq!(rounded.step_deg, step);
        let finer = rounded.finer.as_ref().is_some_and(|f| {
            assert!(f.value < first.value, "{task}");
            reaches(self.value(&f.angles, &once(f.angles.len())), f.value, 1e-4)
        });
        // weights are relative to their sum, and psi of the positions does not count in their criterion
        let of_coefficients = DesignPair { criterion: without_psi(&self.criterion), ..self.shallow() };
        // the answer lists at most ten
        assert!(every.weights.len() == 10 || every.lighter == 0 && every.weights.len() < 10, "{task}");
        let all = &self.every.support;
        let angles: Vec<String> =
            all.iter().map(|a| a.angles.each_ref().map(ToString::to_string).join(",")).collect();
        let sum: f64 = all.iter().map(|a| a.weight).sum();
        let times: Vec<f64> = all.iter().map(|a| a.weight / sum * first.angles.len() as f64).collect();
        let weights = reaches(of_coefficients.value(&angles, &times), self.every.attained, 1e-3);
        // the search starts from the same attitudes in another order: both values lie between the bounds of
        // both
        assert!(every.attained >= self.every.value && self.every.attained >= every.best_possible, "{task}");
        [found, finer, weights]
    }

    fn shallow(&self) -> Self {
        Self {
            criterion: self.criterion.clone(),
            conditions: self.conditions.clone(),
            cardinal: self.cardinal.clone(),
            free: self.free.clone(),
            every: self.every.clone(),
            ..*self
        }
    }
}

fn without_psi(criterion: &Criterion) -> Criterion {
    match criterion {
        Criterion::Margin(limits) => {
            Criterion::Margin(SigmaLimits { psi: [f64::INFINITY; 3], ..limits.clone() })
        }
        other => other.clone(),
    }
}

fn free_attitudes_are_never_worse(tasks: impl Iterator<Item = (CriterionName, &'static str, usize, i64)>) {
    let mut rng = SplitMix64::new(29);
    let mut stated = [0; 3];
    let mut count = 0;
    for (criterion, terms, k, step) in tasks {
        let checked = both(criterion, terms, k, step, &mut rng).check(step as f64 / 1e9);
        stated.iter_mut().zip(checked).for_each(|(sum, checked)| *sum += usize::from(checked));
        count += 1;
    }
    assert!(
        stated[0] * 10 >= count * 8 && stated[1] > 0 && stated[2] * 10 >= count * 5,
        "{stated:?} of {count}"
    );
}

/// Two random tasks: the first criterion, angles in steps of 5 and of 7 degrees.
#[test]
fn two_tasks_are_never_worse() {
    free_attitudes_are_never_worse(ten_tasks().take(2));
}

#[test]
#[ignore = "a minute: .ci/run release"]
fn ten_tasks_are_never_worse() {
    free_attitudes_are_never_worse(ten_tasks());
}

/// Criterion, terms, number of positions and angle step (1e-9 degrees) of ten tasks with three to six
/// positions.
fn ten_tasks() -> impl Iterator<Item = (CriterionName, &'static str, usize, i64)> {
    CRITERIA.into_iter().enumerate().flat_map(|(i, criterion)| {
        let terms = ["F", "FI", "FO", "IS", "FS"][i];
        let k = [3, 6, 5, 4, 6][i];
        [(criterion, terms, k, 5_000_000_000), (criterion, "F", 3, 7_000_000_000)]
    })
}

/// Twelve coefficients at six, nine and twelve positions: `cargo test --test it -- --ignored thirty_tasks`.
#[test]
#[ignore = "some minutes"]
fn thirty_tasks_are_never_worse() {
    let tasks = CRITERIA.into_iter().flat_map(|criterion| {
        [6, 9, 12]
            .into_iter()
            .flat_map(move |k| [5_000_000_000, 7_000_000_000].map(move |step| (criterion, "FIOS", k, step)))
    });
    free_attitudes_are_never_worse(tasks);
}

/// Six free positions for twelve coefficients. Attitudes taken from the weights alone would be 41 % worse
/// than the cardinal attitudes.
#[test]
#[ignore = "seconds: .ci/run"]
fn six_free_positions_are_better_than_six_cardinal_ones() {
    let free = |step: i64| {
        let candidates = Candidates::grid(45_000_000_000).expect("a grid");
        let options = DesignOptions { candidates, free: Some(step), ..options(Some(6)) };
        designed(Carry::Reset, &options).found[0].value
    };
    let cardinal = designed(Carry::Reset, &options(Some(6))).found[0].value;
    assert!((cardinal - 0.060_91).abs() < 1e-5, "{cardinal}");
    let [five, hundredths] = [5_000_000_000, 10_000_000].map(free);
    assert!(five < 0.95 * cardinal && hundredths < 0.95 * cardinal, "{five} {hundredths} {cardinal}");
}

/// A scheme is called an image exactly if a turn of the platform axes maps its attitude matrices to those of
/// the other.
#[test]
fn images_are_turns_of_the_axes() {
    let options = DesignOptions { keep: 40, ..options(Some(4)) };
    let mut images = 0;
    for carry in Carry::ALL {
        // coefficients that every turn of the axes permutes among themselves
        let options = DesignOptions { required: vec!["D_F".into()], ..options.clone() };
        let found = designed(carry, &options).found;
        // attitude as a matrix of whole numbers
        type IntegerMatrix = [[i64; 3]; 3];
        let matrices = |f: &Found| -> Vec<IntegerMatrix> {
            let of = |a: &String| c_n_f64(&obsdeg_core::model::parse_attitude(a).expect("angles"));
            f.angles.iter().map(|a| of(a).map(|row| row.map(|x| x.round() as i64))).collect()
        };
        let arranged = |mut list: Vec<IntegerMatrix>| {
            if carry == Carry::Reset {
                list.sort_unstable();
            }
            list
        };
        let product = |c: &IntegerMatrix, p: &IntegerMatrix| -> IntegerMatrix {
            std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| c[i][k] * p[k][j]).sum()))
        };
        let turns: Vec<IntegerMatrix> = Candidates::cardinals()
            .attitudes
            .iter()
            .map(|e| c_n_f64(e).map(|row| row.map(|x| x.round() as i64)))
            .collect();
        let is_image = |a: &Found, b: &Found| {
            let (a, b) = (matrices(a), arranged(matrices(b)));
            turns.iter().any(|p| arranged(a.iter().map(|c| product(c, p)).collect()) == b)
        };
        for (i, f) in found.iter().enumerate() {
            let first = (0..i).find(|&j| found[j].image_of.is_none() && is_image(&found[j], f));
            assert_eq!(f.image_of, first.map(|j| j + 1), "{carry} {i}");
            images += usize::from(first.is_some());
        }
    }
    assert!(images > 0);
}

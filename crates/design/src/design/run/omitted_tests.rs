//! Designs with a bench, and immune ones, against brute force: every sequence by itself, by its whole answer,
//! or by records and ranks of a model written anew here.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::degree::judge;
use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Carry, Euler, OmittedModel, Platform, Scheme};
use obsdeg_evidence::simulation::omitted::OmittedColumns;
use obsdeg_evidence::simulation::{Attained, Conditions};
use obsdeg_exact::SplitMix64;

use crate::design::{
    BiasPoint, Candidates, CriterionName, Design, DesignError, DesignOptions, Immune, design,
};

const W_IE: f64 = 7.292115e-5;
const LATITUDE: f64 = 28.2;
const STEP_S: f64 = 50.0;
const DWELL_S: f64 = 1000.0;

/// Design task with few sequences.
struct Small {
    base: Scheme,
    conditions: Conditions,
    options: DesignOptions,
    positions: usize,
}

impl Small {
    fn draw(rng: &mut SplitMix64, terms: &str) -> Self {
        let all = Candidates::cardinals();
        let mut candidates = Candidates::default();
        while candidates.names.len() < 3 + rng.below(3) as usize {
            let c = rng.below(24) as usize;
            if !candidates.names.contains(&all.names[c]) {
                candidates.names.push(all.names[c].clone());
                candidates.attitudes.push(all.attitudes[c].clone());
            }
        }
        let carry = Carry::ALL[rng.below(3) as usize];
        let base = Scheme {
            carry,
            latitude: "28.2".parse().ok(),
            unknowns: terms.parse().expect("terms"),
            ..Scheme::default()
        };
        let conditions = Conditions { dwell_s: DWELL_S, step_s: STEP_S, ..Conditions::default() };
        let positions = 3 + rng.below(2) as usize;
        let options = DesignOptions {
            candidates,
            positions: Some(positions),
            seed: rng.below(1000),
            everywhere: false,
            ..DesignOptions::default()
        };
        Self { base, conditions, options, positions }
    }

    /// All sequences of candidates.
    fn sequences(&self) -> Vec<Vec<usize>> {
        let n = self.options.candidates.names.len();
        (0..self.positions).fold(vec![Vec::new()], |all, _| {
            all.iter().flat_map(|s| (0..n).map(move |c| [&s[..], &[c]].concat())).collect()
        })
    }

    fn scheme(&self, sequence: &[usize]) -> Scheme {
        let attitudes: Vec<Euler> =
            sequence.iter().map(|&c| self.options.candidates.attitudes[c].clone()).collect();
        Scheme { positions: Scheme::of_angles(attitudes).positions, ..self.base.clone() }
    }

    /// Worst degree and criterion of a sequence, by its whole answer; `None` where a coefficient is not
    /// observable.
    fn score(&self, sequence: &[usize]) -> Option<(usize, f64)> {
        let scheme = self.scheme(sequence);
        let platform = Platform::new(scheme.clone()).expect("a platform");
        let verdicts = judge(&platform, 1).expect("verdicts");
        let first = platform.names().len() - platform.coefficients();
        let degrees: Option<Vec<usize>> =
            (first..platform.names().len()).map(|c| verdicts.degrees.degree[c]).collect();
        let degree = degrees?.into_iter().max()?;
        let attained = Attained::new(&scheme, &self.conditions, 1).expect("sigmas");
        let totals: Vec<f64> = attained.totals[first..].iter().map(|t| t.expect("a total")).collect();
        let eigenvalues = || {
            let counted: Vec<usize> = (first..platform.names().len()).collect();
            let unit = (1f64 / 3600.0).to_radians();
            (attained.covariance_of(&counted).expect("finite") / (unit * unit)).symmetric_eigenvalues()
        };
        let required = || self.conditions.requirements[0].value;
        if self.options.meet && totals.iter().any(|t| *t > required()) {
            return None;
        }
        let value = match self.options.criterion {
            CriterionName::A => (totals.iter().map(|t| t * t).sum::<f64>() / totals.len() as f64).sqrt(),
            CriterionName::Margin => totals.iter().fold(0.0, |worst: f64, t| worst.max(t / required())),
            CriterionName::D => {
                let logs = eigenvalues().map(f64::ln);
                (logs.sum() / (2.0 * logs.len() as f64)).exp()
            }
            CriterionName::E => eigenvalues().max().sqrt(),
            _ => totals.iter().copied().fold(0.0, f64::max),
        };
        Some((degree, value))
    }

    /// Criterion of the sigmas alone and of what the bench adds alone, for the worst, A and margin.
    fn sigma_and_bias(&self, sequence: &[usize]) -> [f64; 2] {
        let attained = Attained::new(&self.scheme(sequence), &self.conditions, 1).expect("sigmas");
        let first = attained.plan.platform.names().len() - attained.plan.platform.coefficients();
        let of = |x: Vec<f64>| match self.options.criterion {
            CriterionName::A => (x.iter().map(|t| t * t).sum::<f64>() / x.len() as f64).sqrt(),
            CriterionName::Margin => {
                x.iter().fold(0.0, |w: f64, t| w.max(t / self.conditions.requirements[0].value))
            }
            _ => x.into_iter().fold(0.0, f64::max),
        };
        let own = |of: &[Option<f64>]| of[first..].iter().map(|x| x.expect("a number")).collect::<Vec<f64>>();
        let (sigmas, totals) = (own(&attained.sigmas), own(&attained.totals));
        let biases = totals.iter().zip(&sigmas).map(|(t, s)| (t * t - s * s).max(0.0).sqrt()).collect();
        [of(sigmas), of(biases)]
    }

    /// Best sequence by `score` among those for which `allowed` is true.
    fn brute_force(&self, allowed: impl Fn(&[usize]) -> bool) -> Option<(usize, f64)> {
        let all = self.sequences();
        let scores = all.iter().filter(|s| allowed(s)).filter_map(|s| self.score(s));
        scores.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
    }
}

/// Random bench of families and single errors.
fn bench(rng: &mut SplitMix64) -> Vec<Assignment> {
    let all = [
        ("K0", 100.0),
        ("M", 20.0),
        ("GS", 500.0),
        ("GM", 50.0),
        ("latitude", 60.0),
        ("attitude", 5.0),
        ("K0_Y", 300.0),
        ("earth_rate", 200.0),
        ("D_II", 0.05),
    ];
    let drawn = (0..1 + rng.below(3)).map(|_| {
        let (name, most) = all[rng.below(all.len() as u64) as usize];
        Assignment { name: name.into(), value: most * (1 + rng.below(100)) as f64 / 100.0 }
    });
    drawn.collect()
}

/// All criteria: tasks take them by turns.
const CRITERIA: [CriterionName; 5] =
    [CriterionName::Worst, CriterionName::A, CriterionName::Margin, CriterionName::D, CriterionName::E];

/// Checks that the first scheme of `count` tasks with a bench is the best of brute force, by worst
/// degree and total, and called proven. Returns the number of tasks with a scheme, and of those whose
/// scheme of least sigma is another one.
fn benched(count: usize, seed: u64) -> [usize; 2] {
    let mut rng = SplitMix64::new(seed);
    let mut counts = [0; 2];
    for task in 0..count {
        let mut small = Small::draw(&mut rng, ["F", "F,I", "F,S"][task % 3]);
        small.conditions.bench = bench(&mut rng);
        small.options.criterion = CRITERIA[task % CRITERIA.len()];
        // requirements on totals, as a limit in some tasks
        small.options.meet = task % 4 == 1;
        if small.options.criterion == CriterionName::Margin || small.options.meet {
            let value = 0.1 * (1 + rng.below(20)) as f64;
            small.conditions.requirements = vec![Assignment { name: "D".into(), value }];
        }
        let expected = small.brute_force(|_| true);
        let found = design(&small.base, &small.conditions, &small.options, &|_| true);
        let Some((degree, value)) = expected else {
            assert!(found.is_err(), "task {task}");
            continue;
        };
        let found = found.unwrap_or_else(|e| panic!("task {task}: {e}"));
        let first = &found.found[0];
        assert_eq!(first.worst_degree, degree, "task {task}");
        assert!((first.value / value - 1.0).abs() < 1e-6, "task {task}: {} instead of {value}", first.value);
        let search = found.search.as_ref().expect("a search");
        assert!(search.proven && search.ranked.is_none(), "task {task}");
        if !matches!(small.options.criterion, CriterionName::D | CriterionName::E) {
            check_front(&small, &found, task);
        }
        counts[0] += 1;
        let without = Conditions { bench: Vec::new(), ..small.conditions.clone() };
        let other = design(&small.base, &without, &small.options, &|_| true).expect("a scheme");
        let index = |name: &String| small.options.candidates.names.iter().position(|n| n == name);
        let sequence: Option<Vec<usize>> = other.found[0].positions.iter().map(index).collect();
        let total = small.score(&sequence.expect("candidates"));
        counts[1] += usize::from(total.is_none_or(|t| t.0 == degree && t.1 > value * (1.0 + 1e-6)));
    }
    counts
}

/// Checks the front of sigma against bias: its figures are those of the whole answers, none beats
/// another in both, and no total is below the best.
fn check_front(small: &Small, found: &Design, task: usize) {
    assert!(!found.bias_front.is_empty(), "task {task}");
    let without = Small {
        base: small.base.clone(),
        conditions: Conditions { bench: Vec::new(), ..small.conditions.clone() },
        options: small.options.clone(),
        positions: small.positions,
    };
    let index = |name: &String| small.options.candidates.names.iter().position(|n| n == name);
    for p in &found.bias_front {
        let sequence: Option<Vec<usize>> = p.positions.iter().map(index).collect();
        let sequence = sequence.expect("candidates");
        let [sigma, total] = [&without, small].map(|s| s.score(&sequence).expect("observable, and met").1);
        assert!((p.sigma / sigma - 1.0).abs() < 1e-6, "task {task}: {p:?} {sigma}");
        assert!((p.total / total - 1.0).abs() < 1e-6, "task {task}: {p:?} {total}");
        assert!(p.total > found.found[0].value * (1.0 - 1e-9), "task {task}: {p:?}");
        // for a largest value and for a mean: the total is at most the root sum of squares
        assert!(p.total <= p.sigma.hypot(p.bias) * (1.0 + 1e-9), "task {task}: {p:?}");
        assert!(p.total >= p.sigma.max(p.bias) * (1.0 - 1e-9), "task {task}: {p:?}");
    }
    // few sequences: the front is that of all of them
    assert!(found.bias_front_complete, "task {task}");
    let mut all: Vec<[f64; 2]> = small
        .sequences()
        .iter()
        .filter(|s| small.score(s).is_some_and(|w| w.0 == found.found[0].worst_degree))
        .map(|s| small.sigma_and_bias(s))
        .collect();
    all.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    for [sigma, bias] in all {
        let near = |x: f64| x * (1.0 + 1e-5);
        let not_above = |p: &BiasPoint| p.sigma <= near(sigma) && p.bias <= near(bias) + 1e-9 * sigma;
        let hopeless = sigma.max(bias) > 70.0 * found.found[0].value;
        assert!(
            hopeless || found.bias_front.iter().any(not_above),
            "task {task}: no point of the front is as good as sigma {sigma}, bias {bias} (the front takes a total \
             of at most hypot(sigma, bias)): {:?}",
            found.bias_front
        );
    }
    let falls = |p: &[BiasPoint]| p[0].sigma < p[1].sigma && p[0].bias > p[1].bias;
    assert!(found.bias_front.windows(2).all(falls), "task {task}: {:?}", found.bias_front);
}

#[test]
fn no_total_is_below_that_of_a_design() {
    let [found, other] = benched(CRITERIA.len(), 36);
    assert!(found > 2 && other > 0, "{found} {other}");
}

#[test]
#[ignore = "100 tasks: .ci/run release"]
#[expect(clippy::print_stderr, reason = "what was measured")]
fn no_total_is_below_that_of_a_design_at_length() {
    let [found, other] = benched(100, 3636);
    eprintln!("{found} of 100 tasks have a scheme; {other} another one than that of least sigma");
    assert!(found > 40 && other > 10);
}

/// `C_c^n` of a cardinal attitude by its letters: columns are where X, Y, Z point, in North, Up, East.
fn axes(letters: &str) -> DMatrix<f64> {
    let columns = letters.bytes().map(|b| match b {
        b'N' => [1.0, 0.0, 0.0],
        b'S' => [-1.0, 0.0, 0.0],
        b'U' => [0.0, 1.0, 0.0],
        b'D' => [0.0, -1.0, 0.0],
        b'E' => [0.0, 0.0, 1.0],
        _ => [0.0, 0.0, -1.0],
    });
    DMatrix::from_columns(&columns.map(|c| DVector::from_column_slice(&c)).collect::<Vec<_>>())
}

/// One column of the model: psi (axis, position), `D_F` of a gyro, or `K0` of an accelerometer.
#[derive(Clone, Copy)]
enum ModelColumn {
    Psi(usize, usize),
    Drift(usize),
    Bias(usize),
}

/// Z1 and Z3 of one column, written anew: `psi' = psi x w + eps`, by Runge and Kutta.
fn record(column: ModelColumn, positions: &[&str], carry: Carry) -> DVector<f64> {
    let (sin, cos) = LATITUDE.to_radians().sin_cos();
    let w = DVector::from_column_slice(&[W_IE * cos, W_IE * sin, 0.0]);
    let (mut psi, mut out, mut before) = (DVector::zeros(3), Vec::new(), None);
    for (i, letters) in positions.iter().enumerate() {
        let c = axes(letters);
        match (&before, carry) {
            (None, _) | (_, Carry::Inertial) => {}
            (_, Carry::Reset) => psi.fill(0.0),
            (Some(from), Carry::Platform) => {
                let from: &DMatrix<f64> = from;
                psi = &c * from.transpose() * psi;
            }
        }
        let (mut rate, mut force) = (DVector::zeros(3), DVector::zeros(3));
        match column {
            ModelColumn::Psi(k, at) if at == i => psi += c.column(k),
            ModelColumn::Psi(..) => {}
            ModelColumn::Drift(k) => rate = c.column(k).into_owned(),
            ModelColumn::Bias(k) => force = c.column(k).into_owned(),
        }
        let slope = |p: &DVector<f64>| p.cross(&w) + &rate;
        for _ in 0..(DWELL_S / STEP_S) as usize {
            let k1 = slope(&psi);
            let k2 = slope(&(&psi + 0.5 * STEP_S * &k1));
            let k3 = slope(&(&psi + 0.5 * STEP_S * &k2));
            let k4 = slope(&(&psi + STEP_S * &k3));
            psi += (k1 + 2.0 * (k2 + k3) + k4) * (STEP_S / 6.0);
            out.extend([psi[2] + force[0], -psi[0] + force[2]]);
        }
        before = Some(c);
    }
    DVector::from_vec(out)
}

/// Part of a vector outside the span of others, orthogonalised twice.
fn outside(basis: &[DVector<f64>], v: &DVector<f64>) -> DVector<f64> {
    let mut rest = v.clone();
    for _ in 0..2 {
        for q in basis {
            rest -= q * q.dot(&rest);
        }
    }
    rest
}

/// Smallest size in ug at which each K0 shows at three sigma (1e-5 g a sample), by ranks of the records
/// of this file: 0 if none has an effect, infinite if one is in the span of the unknowns.
fn shown_from(positions: &[&str], carry: Carry) -> f64 {
    let own = if carry == Carry::Reset { positions.len() } else { 1 };
    let psi = (0..own).flat_map(|at| (0..3).map(move |k| ModelColumn::Psi(k, at)));
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for column in psi.chain((0..3).map(ModelColumn::Drift)) {
        let v = record(column, positions, carry);
        let rest = outside(&basis, &(&v / v.norm()));
        if rest.norm() > 1e-9 {
            basis.push(&rest / rest.norm());
        }
    }
    let from = |k: usize| {
        let v = record(ModelColumn::Bias(k), positions, carry);
        let rest = outside(&basis, &v).norm();
        match v.norm() {
            0.0 => 0.0,
            norm if rest > 1e-9 * norm => 3.0 * 1e-5 / rest * 1e6,
            _ => f64::INFINITY,
        }
    };
    (0..3).map(from).fold(0.0, f64::max)
}

/// Checks that immune designs of `count` tasks are the best of all sequences that are immune by
/// [`shown_from`], with and without a bench, and that nothing is found if none is. Returns the number
/// of tasks with an immune scheme, of those without, and of those whose best scheme is not immune.
fn immune(count: usize, seed: u64) -> [usize; 3] {
    let mut rng = SplitMix64::new(seed);
    let mut counts = [0; 3];
    for task in 0..count {
        let mut small = Small::draw(&mut rng, "F");
        if task % 2 == 0 {
            small.conditions.bench = vec![Assignment { name: "K0".into(), value: 20.0 }];
        }
        let names = small.options.candidates.names.clone();
        let carry = small.base.carry;
        let from = |s: &[usize]| {
            let letters: Vec<&str> = s.iter().map(|&c| names[c].as_str()).collect();
            shown_from(&letters, carry)
        };
        // size at which some sequences are immune and others are not: that of a random one
        let mut finite: Vec<f64> = small.sequences().iter().map(|s| from(s)).collect();
        finite.retain(|f| *f > 0.0 && *f < 2e4);
        let drawn = finite.get(rng.below(finite.len().max(1) as u64) as usize).map_or(100.0, |f| f * 1.001);
        let size = (task % 4 != 3).then_some(drawn);
        small.options.immune = vec![Immune { name: "K0".into(), size }];
        let stands = |s: &[usize]| from(s) <= size.unwrap_or(0.0);
        let found = design(&small.base, &small.conditions, &small.options, &|_| true);
        match (small.brute_force(stands), found) {
            (None, Err(e)) => {
                assert!(matches!(e, DesignError::Impossible { .. }), "task {task}: {e}");
                counts[1] += 1;
            }
            (Some((degree, value)), Ok(found)) => {
                let first = &found.found[0];
                assert_eq!(first.worst_degree, degree, "task {task}");
                assert!((first.value / value - 1.0).abs() < 1e-6, "task {task}: {} {value}", first.value);
                assert!(found.search.as_ref().is_some_and(|s| s.proven), "task {task}");
                counts[0] += 1;
                let any = small.brute_force(|_| true).expect("a scheme");
                counts[2] += usize::from(any.0 < degree || any.1 < value * (1.0 - 1e-6));
            }
            (expected, found) => panic!("task {task}: {expected:?} {:?}", found.map(|f| f.found)),
        }
    }
    counts
}

#[test]
fn immune_designs_are_those_of_ranks() {
    let [found, none, other] = immune(8, 7);
    assert!(found > 1 && none > 1 && other > 0, "{found} {none} {other}");
}

#[test]
#[ignore = "100 tasks: .ci/run release"]
#[expect(clippy::print_stderr, reason = "what was measured")]
fn immune_designs_are_those_of_ranks_at_length() {
    let [found, none, other] = immune(100, 77);
    eprintln!("{found} tasks with an immune scheme, {none} without; the best of {other} is not immune");
    assert!(found > 20 && none > 20 && other > 5);
}

/// Sizes that double precision cannot decide are refused. At the largest size allowed, an error that
/// the search takes for silent has less information in any record than the size requires.
#[test]
fn immunity_is_decided_or_refused() {
    for (terms, name, carry) in [
        ("F", "K0", Carry::Reset),
        ("F", "M", Carry::Inertial),
        ("F,I", "GS", Carry::Platform),
        ("F", "attitude", Carry::Inertial),
    ] {
        let mut small = Small::draw(&mut SplitMix64::new(5), terms);
        small.base.carry = carry;
        small.options.immune = vec![Immune { name: name.into(), size: Some(1e8) }];
        let found = design(&small.base, &small.conditions, &small.options, &|_| true);
        let Err(DesignError::ImmuneSize { most, unit, .. }) = found else { panic!("{name}: {found:?}") };
        // samples of every sequence, by the records of its whole answer
        let si = if unit == "ppm" || unit == "ug" { 1e-6 } else { (1f64 / 3600.0).to_radians() };
        let allowed = (3.0 / (most * si)).powi(2) / 1e-9;
        for sequence in small.sequences() {
            let platform = Platform::new(small.scheme(&sequence)).expect("a platform");
            let model = OmittedModel::new(&platform);
            let attained = Attained::new(platform.scheme(), &small.conditions, 1).expect("sigmas");
            let mut columns = OmittedColumns::new(&attained.plan, &model);
            let mut squares = vec![0.0; model.terms().len()];
            while let Some(step) = columns.step().expect("finite") {
                let m = squares.len();
                step.chunks_exact(m).for_each(|row| {
                    squares.iter_mut().zip(row).for_each(|(sum, o)| *sum += o * o / 1e-10);
                });
            }
            for (t, samples) in model.terms().iter().zip(&squares).filter(|(t, _)| t.family == name) {
                assert!(*samples <= allowed * (1.0 + 1e-9), "{} {samples} {allowed}", t.name);
            }
        }
        small.options.immune = vec![Immune { name: name.into(), size: Some(most * 0.99) }];
        let found = design(&small.base, &small.conditions, &small.options, &|_| true);
        assert!(!matches!(found, Err(DesignError::ImmuneSize { .. })), "{name}: {found:?}");
    }
}

/// Immunity to a name that is no error, or to an error that is estimated, is refused.
#[test]
fn immunity_to_nothing_is_refused() {
    let mut small = Small::draw(&mut SplitMix64::new(1), "F");
    for name in ["K0", "latitude", "attitude"] {
        let platform = Platform::new(small.scheme(&[0, 1])).expect("a platform");
        assert!(OmittedModel::new(&platform).terms().iter().any(|t| t.family == name));
    }
    small.base.unknowns = "F,K0".parse().expect("terms");
    small.options.immune = vec![Immune { name: "K0".into(), size: None }];
    let found = design(&small.base, &small.conditions, &small.options, &|_| true);
    assert!(matches!(found, Err(DesignError::Immune { .. })), "{found:?}");
    assert!("Q".parse::<Immune>().is_err() && "K0=0".parse::<Immune>().is_err());
    let read: Immune = "K0_X=2.5".parse().expect("an error");
    assert_eq!((read.to_string().as_str(), read.size), ("K0_X=2.5", Some(2.5)));
}

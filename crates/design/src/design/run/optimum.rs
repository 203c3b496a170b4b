//! Certificates of proven optima: the question, the best sequences, and bounds by blocks of sequences that a
//! checker can search again. The chapter `certificate` of the book is the specification.

use std::sync::atomic::{AtomicU64, Ordering};

use obsdeg_core::model::{Carry, Euler, GyroAxes, Scheme, Term, cardinal_name, format_decimal};
use obsdeg_evidence::simulation::{Conditions, latitude_of, steps};
use obsdeg_exact::parallel;
use schemars::JsonSchema;
use serde::Serialize;

use crate::design::answer::Design;
use crate::design::measure::criterion::Criterion;
use crate::design::measure::stop::Stop;
use crate::design::request::error::DesignError;
use crate::design::request::options::{CriterionName, DesignOptions};
use crate::design::run::prepared::PreparedSearch;
use crate::design::run::task::asked;
use crate::design::search::exhaust::SearchLevel;
use crate::design::search::progress::{NOTHING_YET, Progress, watched};
use crate::design::search::scoring::SequenceSearch;

/// Name and version of the layout.
pub(crate) const OPTIMUM_LAYOUT: &str = "obsdeg.optimum-certificate/1";
/// Number of sequences behind a start above which starts are made longer.
const LONG: f64 = 1e6;
/// Largest number of blocks.
const MOST_BLOCKS: usize = 100_000;
/// Fraction of the excess of a block's least value over the best that its bound claims: values far
/// above the best may rest on rounding.
const ROOM: f64 = 0.9;
/// Largest value of a block that counts, as a multiple of the best one.
const CAP: f64 = 10.0;

/// Certificate of a proven optimum: the best sequences of candidates, with bounds on all others by blocks.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct OptimumCertificate {
    /// Name and version of the layout, `obsdeg.optimum-certificate/1`.
    pub layout: String,
    /// Question that the certificate answers.
    pub problem: OptimumProblem,
    /// Smallest worst degree of a sequence that keeps the caps: that of the best.
    pub degree: usize,
    /// Best sequences of this degree, best first.
    pub best: Vec<BestSequence>,
    /// Number of sequences in all blocks.
    pub sequences: u64,
    /// Blocks of sequences, in lexicographic order of their starts.
    pub blocks: Vec<SequenceBlock>,
}

/// Search that a certificate of an optimum is about.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct OptimumProblem {
    /// Carry between positions: platform, inertial or reset.
    pub carry: Carry,
    /// Latitude in degrees as decimal text.
    pub latitude_deg: String,
    /// True if `psi_y^n` is measured too.
    pub measured_azimuth: bool,
    /// Unknown terms, in the order of their coefficients.
    pub terms: Vec<Term>,
    /// Axes of the gyros X, Y, Z as signed platform axes.
    pub gyros: [GyroAxes; 3],
    /// Input axes of the accelerometers X, Y, Z as signed platform axes.
    pub accelerometers: [String; 3],
    /// Euler angles alpha, beta, gamma of every candidate in degrees, as decimal texts.
    pub candidates: Vec<[String; 3]>,
    /// Number of positions of a sequence.
    pub positions: usize,
    /// Dwell of every position, in s.
    pub dwell_s: f64,
    /// Number of samples at every position, at equal intervals, the last at its end.
    pub samples: usize,
    /// White noise of a sample of Z, in g.
    pub noise_g: f64,
    /// White noise of a sample of the azimuth, in degrees; null unless it is measured.
    pub azimuth_noise_deg: Option<f64>,
    /// Criterion: worst, a, d, e or margin.
    pub criterion: &'static str,
    /// Coefficients that must be observable and that the criterion is about, in the order of the unknowns.
    pub required: Vec<RequiredCoefficient>,
}

/// Coefficient that must be observable.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RequiredCoefficient {
    /// Name of the coefficient, such as `D_FX`.
    pub name: String,
    /// Largest observable degree; null if any will do.
    pub max_degree: Option<usize>,
    /// Required sigma in the unit of the coefficient; null where none is stated, and unless the criterion is
    /// margin.
    pub limit: Option<f64>,
}

/// One of the best sequences.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BestSequence {
    /// Candidates in order of time: index of each, from 1.
    pub sequence: Vec<usize>,
    /// Criterion, in the unit of the coefficients (margin: dimensionless).
    pub value: f64,
}

/// Sequences that begin alike.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SequenceBlock {
    /// First candidates of all sequences of the block: index of each, from 1.
    pub start: Vec<usize>,
    /// Number of sequences of the block.
    pub sequences: u64,
    /// Lower bound on the criterion of the sequences of the degree, in the unit of the coefficients; null if
    /// the block has none.
    pub bound: Option<f64>,
}

fn not_covered(found: impl Into<String>) -> DesignError {
    DesignError::NoCertificate { found: found.into() }
}

/// Refuses searches that certificates of optima do not cover, by their options.
///
/// # Errors
/// [`DesignError::NoCertificate`].
pub fn check_certifiable(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
) -> Result<(), DesignError> {
    let conditions = &asked(base, conditions, &options.required)?;
    let psi = || conditions.requirements.iter().any(|r| r.name.starts_with("psi"));
    let limits_psi = options.criterion == CriterionName::Margin && options.required.is_empty() && psi();
    let cardinal = |angles: &Euler| cardinal_name(angles).is_some();
    let latitude = latitude_of(base).and_then(|l| l.to_string().parse().ok()).map_or(0.0, f64::abs);
    let samples = steps(conditions.dwell_s, conditions.step_s);
    let noisy = !conditions.gyro_noise.is_none() || conditions.as_stated().drift_noise.amount() > 0.0;
    let found = [
        (options.positions.is_none(), "a search for the fewest positions"),
        (!options.candidates.attitudes.iter().all(cardinal), "candidates that are not cardinal"),
        (!options.required.is_empty(), "some of the coefficients alone (--observable)"),
        (options.free.is_some(), "--candidates free"),
        (options.refine, "--refine"),
        (options.divide, "--divide"),
        (options.meet, "--meet"),
        (options.total_s.is_some(), "--max-time"),
        (options.slew_s.is_some(), "--max-slew"),
        (!options.immune.is_empty(), "--immune"),
        (conditions.slew_rate_deg_s.is_some(), "slews that take time (--slew-rate)"),
        (!conditions.bench.is_empty(), "a bench of errors that are not estimated (--bench)"),
        (!conditions.stated_priors().is_empty(), "a stated prior (--prior)"),
        (noisy, "random drift (--drift-noise, [simulation])"),
        (conditions.accelerometer_instability_ug > 0.0, "a bias instability of the accelerometers"),
        (limits_psi, "a requirement on psi"),
        (!(1.0..=89.0).contains(&latitude), "a latitude within 1 degree of the equator or a pole"),
        (conditions.settle_s > 0.0, "samples that the record leaves out (settle under [record])"),
        (!(10.0..=1e6).contains(&conditions.dwell_s), "a dwell outside 10 s to 1e6 s"),
        (
            !samples.is_ok_and(|n| (5..=10_000).contains(&n)),
            "samples outside 5 to 10,000 a position (--step)",
        ),
        (!(1e-9..=1e-2).contains(&conditions.accelerometer_noise_g), "noise outside 1e-9 g to 1e-2 g"),
    ];
    match found.into_iter().find(|(is, _)| *is) {
        Some((_, what)) => Err(not_covered(what)),
        None => Ok(()),
    }
}

/// Certificate of an optimum that a search has proven. Its blocks are searched for their bounds.
///
/// # Errors
/// [`DesignError::NoCertificate`] where nothing is proven, or the layout does not cover it; [`DesignError`].
pub fn certify_optimum(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    design: &Design,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<OptimumCertificate, DesignError> {
    check_certifiable(base, conditions, options)?;
    let conditions = &asked(base, conditions, &options.required)?;
    let (Some(k), Some(report)) = (options.positions, &design.search) else {
        return Err(not_covered("no search"));
    };
    if !report.proven {
        return Err(not_covered("an answer that is not proven to be the best"));
    }
    watched(progress, |progress, _| {
        let prepared = PreparedSearch::new(base, conditions, options, &|| progress(NOTHING_YET))?;
        let names = &prepared.task.candidates.names;
        let index = |name: &String| names.iter().position(|n| n == name).map(|i| i + 1);
        let degree = design.found.first().map_or(0, |f| f.worst_degree);
        let of_degree = design.found.iter().filter(|f| f.worst_degree == degree);
        let best: Vec<BestSequence> = of_degree
            .filter_map(|f| {
                let sequence = f.positions.iter().map(index).collect::<Option<_>>()?;
                Some(BestSequence { sequence, value: f.value })
            })
            .collect();
        let Some(least) = best.first().map(|b| b.value) else { return Err(not_covered("no sequence")) };
        let blocks = blocks(&prepared, (k, degree, least), progress)?;
        Ok(OptimumCertificate {
            layout: OPTIMUM_LAYOUT.into(),
            problem: problem(&prepared, k)?,
            degree,
            best,
            sequences: blocks.iter().map(|b| b.sequences).sum(),
            blocks,
        })
    })
}

/// Question that the certificate answers.
fn problem(prepared: &PreparedSearch<'_>, k: usize) -> Result<OptimumProblem, DesignError> {
    let (task, conditions) = (&prepared.task, prepared.conditions);
    let scheme = task.base;
    let limit = |i: usize| match &task.criterion {
        Criterion::Margin(limits) => Some(limits.coefficients[i]).filter(|l| l.is_finite()),
        _ => None,
    };
    let cap = |i: usize| task.constraints.degrees.as_ref().map(|caps| caps[i]).filter(|c| *c != usize::MAX);
    let required = task.required.iter().enumerate();
    let azimuth = scheme.measured_azimuth.then_some(conditions.azimuth_noise_deg);
    Ok(OptimumProblem {
        carry: scheme.carry,
        latitude_deg: latitude_of(scheme).map_or_else(|| "0".into(), |l| l.to_string()),
        measured_azimuth: scheme.measured_azimuth,
        terms: scheme.unknowns.terms().to_vec(),
        gyros: scheme.geometry.gyros(),
        accelerometers: scheme.geometry.accelerometers.inputs().map(|a| a.to_string()),
        candidates: task
            .candidates
            .attitudes
            .iter()
            .map(|angles| angles.each_ref().map(|a| format_decimal(a.nanodeg())))
            .collect(),
        positions: k,
        dwell_s: conditions.dwell_s,
        samples: steps(conditions.dwell_s, conditions.step_s)?,
        noise_g: conditions.accelerometer_noise_g,
        azimuth_noise_deg: azimuth,
        criterion: match &task.criterion {
            Criterion::Worst => "worst",
            Criterion::A => "a",
            Criterion::D => "d",
            Criterion::E => "e",
            Criterion::Margin(_) => "margin",
        },
        required: required
            .map(|(i, r)| RequiredCoefficient { name: r.0.clone(), max_degree: cap(i), limit: limit(i) })
            .collect(),
    })
}

/// All blocks, with the bounds that a search of each finds.
fn blocks(
    prepared: &PreparedSearch<'_>,
    (k, degree, least): (usize, usize, f64),
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Vec<SequenceBlock>, DesignError> {
    let quiet = |_: Progress| progress(NOTHING_YET);
    let search = SequenceSearch { keep: 1, ..prepared.search(&quiet) };
    let n = prepared.task.rows.candidates();
    let symmetry = &prepared.task.symmetry;
    let starts = starts(symmetry.representatives(), (n, k), prepared.evaluator.ordered())?;
    let pruning = prepared.pruning(&search, k);
    let levels = search.levels_of(k).ok_or(DesignError::Interrupted)?;
    let Some(level) = levels.first() else { return Err(not_covered("no sequence")) };
    if matches!(level, SearchLevel::Degree(own, _) if *own != degree) {
        return Err(not_covered(
            "sequences of a smaller worst degree that double precision does not determine",
        ));
    }
    let (done, total) = (AtomicU64::new(0), starts.len() as u64);
    let block = |start: &Vec<usize>| -> Result<SequenceBlock, DesignError> {
        let stops: Vec<Stop> = start.iter().map(|&c| Stop::from(c)).collect();
        let best = search.exhaust_starts(&[stops], symmetry, k, level, pruning.as_ref());
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        let now = Progress { done, total, examined: best.examined, best: least };
        if !best.complete || !progress(now) {
            return Err(DesignError::Interrupted);
        }
        let found = best.found.first().filter(|s| s.score.degree == degree).map(|s| s.score.value);
        // excluded sequences are above the best, and sequences lost to rounding are unknown
        let hidden = best.excluded > 0 || best.lost > 0;
        let above = |value: f64| least + ROOM * (value.min(CAP * least) - least);
        let bound = if hidden { Some(least) } else { found.map(above) };
        Ok(SequenceBlock {
            start: start.iter().map(|c| c + 1).collect(),
            sequences: behind(start, (n, k), prepared.evaluator.ordered())
                .ok_or_else(|| not_covered("more than 2^63 sequences"))?,
            bound,
        })
    };
    parallel::try_map(starts.len(), |i| block(&starts[i]))
}

/// Starts of all blocks, in lexicographic order: two candidates, or more where many sequences follow.
fn starts(firsts: Vec<usize>, (n, k): (usize, usize), ordered: bool) -> Result<Vec<Vec<usize>>, DesignError> {
    let mut out: Vec<Vec<usize>> = firsts.into_iter().map(|c| vec![c]).collect();
    for depth in 1..k {
        let behind = (n as f64).powi((k - depth) as i32);
        if depth >= 2 && (behind <= LONG || out.len() * n > MOST_BLOCKS) {
            break;
        }
        let longer = |start: &Vec<usize>| -> Vec<Vec<usize>> {
            let from = if ordered { 0 } else { start.last().copied().unwrap_or(0) };
            (from..n).map(|c| [&start[..], &[c]].concat()).collect()
        };
        out = out.iter().flat_map(longer).collect();
    }
    match out.len() {
        0..=MOST_BLOCKS => Ok(out),
        many => Err(not_covered(format!("{many} blocks of sequences"))),
    }
}

/// Number of sequences that begin with a start; `None` beyond 2^63.
fn behind(start: &[usize], (n, k): (usize, usize), ordered: bool) -> Option<u64> {
    let left = (k - start.len()) as u64;
    let choices = (n - if ordered { 0 } else { start.last().copied().unwrap_or(0) }) as u64;
    let mut out: u128 = 1;
    for i in 0..u128::from(left) {
        out = match ordered {
            true => out.checked_mul(u128::from(choices))?,
            false => out.checked_mul(u128::from(choices) + i)? / (i + 1),
        };
        (out < 1 << 63).then_some(())?;
    }
    u64::try_from(out).ok()
}

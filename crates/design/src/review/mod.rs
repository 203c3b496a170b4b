//! Design review of torquing schemes: verdicts, predictions, evidence, alternatives.

pub(crate) mod answer;

pub use answer::*;

use obsdeg_core::analysis::{Analysis, AnalysisError, AnalysisOptions, analyze};
use obsdeg_core::degree::Status;
use obsdeg_core::model::{Carry, Dwell, Latitude, Pose, Scheme};
use obsdeg_core::system::{ModelError, SystemAnalysis, SystemModel, SystemOptions, analyze_system, judge};
use obsdeg_evidence::compare::{Entry, comparable, compare, predicted};
use obsdeg_evidence::crosscheck::{CrossCheckOptions, crosscheck};
use obsdeg_evidence::simulation::{Conditions, Plan, SegmentKind, SimulationError, latitude_of, simulate};
use obsdeg_evidence::system::{RunError, crosscheck_system, simulate_system};
use obsdeg_exact::parallel;
use obsdeg_symbolic::Worker;

use crate::design::{Candidates, DesignError, DesignOptions, design};

/// Step of the latitudes of the sweep, in degrees.
const LATITUDE_STEP: i32 = 5;
/// Largest factor on the dwells of the sweep in octaves, up and down, in steps of half an octave.
const OCTAVES: i32 = 3;
/// Largest number of positions of the schemes on the front.
const FRONT_POSITIONS: usize = 5;
/// Largest number of positions under reset carry, where sets are searched and a bound ends the search.
const FRONT_OF_SETS: usize = 12;
/// Largest number of positions of a scheme whose smallest sufficient subset is searched.
const SUBSETS: usize = 24;
/// Largest number of outputs of a model that is judged without each of them.
const OUTPUTS: usize = 12;
/// Largest number of unknowns of such a model.
const UNKNOWNS: usize = 60;

/// Options of a review.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReviewOptions {
    /// Number of Monte Carlo runs of the evidence.
    pub runs: usize,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Error of a review.
#[derive(Debug, thiserror::Error)]
pub enum ReviewError {
    /// Verdicts of a scheme that fail.
    #[error("{name}: {error}")]
    Analysis {
        /// Name of the scheme.
        name: String,
        /// Error of the analysis.
        error: AnalysisError,
    },
    /// Scheme that cannot be simulated.
    #[error("{name}: {error}")]
    Simulation {
        /// Name of the scheme.
        name: String,
        /// Error of the simulation.
        error: SimulationError,
    },
    /// Model that cannot be judged.
    #[error("model {}: {error}", model + 1)]
    Model {
        /// Index of the model, from 0.
        model: usize,
        /// Error of the model.
        error: ModelError,
    },
    /// Interruption of the review.
    #[error("interrupted")]
    Interrupted,
}

/// Reviews schemes and models. `progress` receives the name of the next step and the fraction of work
/// done; the review stops when it returns false.
///
/// # Errors
/// [`ReviewError`].
pub fn review(
    entries: &[Entry],
    models: &[SystemModel],
    options: ReviewOptions,
    mut worker: Option<&mut Worker>,
    progress: &dyn Fn(&str, f64) -> bool,
) -> Result<DesignReview, ReviewError> {
    let parts = (entries.len() + models.len()).max(1) as f64;
    let step = |part: usize, share: f64, what: &str| match progress(what, (part as f64 + share) / parts) {
        true => Ok(()),
        false => Err(ReviewError::Interrupted),
    };
    for Entry { name, scheme, .. } in entries {
        comparable(scheme).map_err(|error| ReviewError::Simulation { name: name.clone(), error })?;
    }
    let (mut schemes, mut generic) = (Vec::new(), Vec::new());
    for (i, entry) in entries.iter().enumerate() {
        let step = |share: f64, what: &str| step(i, share, &format!("{}: {what}", entry.name));
        if entry.scheme.generic_names().is_empty() {
            schemes.push(scheme(entry, options, worker.as_deref_mut(), &step)?);
        } else {
            step(0.0, "verdicts")?;
            generic.push(self::generic(entry, options, worker.as_deref_mut())?);
        }
    }
    let mut out = Vec::new();
    for (i, model) in models.iter().enumerate() {
        step(entries.len() + i, 0.0, &model.name)?;
        let part = self::model(model, options.seed);
        out.push(part.map_err(|error| ReviewError::Model { model: i, error })?);
    }
    let numeric: Vec<Entry> =
        entries.iter().filter(|e| e.scheme.generic_names().is_empty()).cloned().collect();
    let comparison =
        compare(&numeric, options.seed).map_err(|(name, error)| ReviewError::Simulation { name, error })?;
    Ok(DesignReview {
        version: env!("CARGO_PKG_VERSION").into(),
        schemes,
        generic,
        models: out,
        comparison,
        runs: options.runs,
        seed: options.seed,
    })
}

fn scheme(
    entry: &Entry,
    options: ReviewOptions,
    worker: Option<&mut Worker>,
    step: &dyn Fn(f64, &str) -> Result<(), ReviewError>,
) -> Result<SchemeReview, ReviewError> {
    let Entry { name, scheme, conditions } = entry;
    let failed = |error: SimulationError| ReviewError::Simulation { name: name.clone(), error };
    // a scheme that cannot be run is refused before anything is computed
    let plan = Plan::new(scheme, conditions).map_err(failed)?;
    step(0.0, "verdicts")?;
    let analysis = verdicts(entry, options, worker)?;
    step(0.2, "a run of the filter")?;
    let (simulation, record) = simulate(scheme, conditions, options.seed).map_err(failed)?;
    step(0.3, "evidence")?;
    let check = CrossCheckOptions { runs: options.runs, seed: options.seed, filter: Default::default() };
    let evidence_progress =
        |done: usize| step(0.3 + 0.4 * done as f64 / options.runs.max(1) as f64, "evidence").is_ok();
    let evidence = match crosscheck(scheme, conditions, &check, &evidence_progress) {
        Err(SimulationError::Interrupted) => return Err(ReviewError::Interrupted),
        Err(e) if e != SimulationError::CrosscheckRotation && !e.is_numeric() => return Err(failed(e)),
        evidence => evidence,
    };
    step(0.7, "sweeps")?;
    let latitudes = latitudes(scheme, conditions, options.seed).map_err(failed)?;
    let dwells = dwells(scheme, conditions, options.seed).map_err(failed)?;
    step(0.8, "alternatives")?;
    let alternatives = alternatives(scheme, conditions, &analysis, options.seed);
    Ok(SchemeReview {
        name: name.clone(),
        description: scheme.description.clone(),
        document: scheme.document.clone(),
        positions: positions(scheme, conditions, &plan),
        poses: poses(scheme, conditions),
        attitudes: attitudes(&plan),
        analysis,
        simulation,
        traces: record.traces,
        evidence,
        latitudes,
        dwells,
        alternatives,
    })
}

/// Exact verdicts of a scheme.
fn verdicts(
    entry: &Entry,
    options: ReviewOptions,
    mut worker: Option<&mut Worker>,
) -> Result<Analysis, ReviewError> {
    let wanted = AnalysisOptions { seed: options.seed, ..AnalysisOptions::default() };
    let analysis = analyze(&entry.scheme, wanted, worker.as_deref_mut())
        .map_err(|error| ReviewError::Analysis { name: entry.name.clone(), error })?;
    rest(worker);
    Ok(analysis)
}

/// Review of a scheme with generic angles.
fn generic(
    entry: &Entry,
    options: ReviewOptions,
    worker: Option<&mut Worker>,
) -> Result<GenericReview, ReviewError> {
    Ok(GenericReview {
        name: entry.name.clone(),
        description: entry.scheme.description.clone(),
        document: entry.scheme.document.clone(),
        analysis: verdicts(entry, options, worker)?,
        poses: poses(&entry.scheme, &entry.conditions),
        angles: entry.scheme.generic_names(),
        latitude_deg: latitude_of(&entry.scheme).map_or(0.0, Latitude::degrees),
    })
}

/// Gravity in platform axes is the second row of `C_c^n`: North, Up, East.
const UP: usize = 1;

fn positions(scheme: &Scheme, conditions: &Conditions, plan: &Plan) -> Vec<PositionReview> {
    let slew = |i: usize| {
        let of = |p: &&obsdeg_evidence::simulation::PlanSegment| {
            p.position == i && matches!(p.kind, SegmentKind::Slew(_))
        };
        plan.segments.iter().find(of).map(|s| s.dt * s.steps as f64)
    };
    let start = |i: usize| {
        let of = |p: &&obsdeg_evidence::simulation::PlanSegment| {
            p.position == i && !matches!(p.kind, SegmentKind::Slew(_))
        };
        plan.segments.iter().find(of).map_or(0.0, |s| s.start_s)
    };
    let row = |(i, p): (usize, &obsdeg_core::model::Position)| {
        let g = plan.attitudes[i][UP];
        let along = |axis: obsdeg_core::model::SignedAxis| {
            let component: f64 = axis.vector().iter().zip(&g).map(|(&a, g)| f64::from(a) * g).sum();
            // a multiple of a right angle leaves a rounding error of the sine
            if component.abs() < 1e-15 { 0.0 } else { component }
        };
        PositionReview {
            name: p.name.clone(),
            start_s: start(i),
            dwell_s: p.dwell.map_or(conditions.dwell_s, Dwell::seconds),
            slew_s: slew(i),
            turn: plan.slews().find(|s| s.0 == i).map(|s| s.1),
            g: scheme.geometry.gyros().map(|gyro| [along(gyro.I), along(gyro.O), along(gyro.S)]),
        }
    };
    scheme.positions.iter().enumerate().map(row).collect()
}

/// Platform at every position; a slew rate of the conditions decides how each is reached.
fn poses(scheme: &Scheme, conditions: &Conditions) -> Vec<Pose> {
    let mut scheme = scheme.clone();
    scheme.simulation.slew_rate_deg_s = conditions.slew_rate_deg_s.filter(|_| conditions.slews);
    scheme.poses()
}

/// Gravity along the platform axes over time.
fn attitudes(plan: &Plan) -> Vec<GravitySample> {
    const STEPS: usize = 24;
    let mut out = Vec::new();
    for s in &plan.segments {
        let duration = s.dt * s.steps as f64;
        let mut at = |t: f64, c: &obsdeg_core::model::Matrix3<f64>| {
            out.push(GravitySample { t_s: s.start_s + t, position: s.position, g: c[UP] });
        };
        match &s.kind {
            SegmentKind::Dwell => {
                at(0.0, &plan.attitudes[s.position]);
                at(duration, &plan.attitudes[s.position]);
            }
            SegmentKind::Slew(slew) => {
                (0..=STEPS).for_each(|k| {
                    let t = duration * k as f64 / STEPS as f64;
                    at(t, &slew.at(t));
                });
            }
            SegmentKind::Rotation(turn) => {
                at(0.0, &turn.at(0.0));
                at(duration, &turn.at(duration));
            }
        }
    }
    out
}

fn latitudes(scheme: &Scheme, conditions: &Conditions, seed: u64) -> Result<Sweep, SimulationError> {
    let at = |k: usize| {
        let degrees = k as i32 * LATITUDE_STEP;
        let other = Scheme { latitude: degrees.to_string().parse().ok(), ..scheme.clone() };
        Ok::<_, SimulationError>((f64::from(degrees), predicted(&other, conditions, seed)?))
    };
    Ok(Sweep::of(parallel::try_map((90 / LATITUDE_STEP) as usize + 1, at)?))
}

fn dwells(scheme: &Scheme, conditions: &Conditions, seed: u64) -> Result<Sweep, SimulationError> {
    let factors = (0..=4 * OCTAVES).map(|k| 2f64.powf(f64::from(k - 2 * OCTAVES) / 2.0));
    let scaled = factors.map(|f| Ok((f, scheme.with_dwells(conditions.dwell_s, f)?)));
    let scaled = scaled.collect::<Result<Vec<_>, SimulationError>>()?;
    // shorter dwells have no sample after the time that the record leaves out
    let scaled: Vec<_> = scaled.into_iter().filter(|(_, other)| conditions.leaves_samples(other)).collect();
    let at = |k: usize| {
        let (factor, other) = &scaled[k];
        // a step is at most half a dwell
        let shortest = other.positions.iter().filter_map(|p| p.dwell).map(Dwell::seconds);
        let step_s = shortest.fold(conditions.step_s, |step, dwell| step.min(dwell / 2.0));
        Ok::<_, SimulationError>((
            *factor,
            predicted(other, &Conditions { step_s, ..conditions.clone() }, seed)?,
        ))
    };
    Ok(Sweep::of(parallel::try_map(scaled.len(), at)?))
}

/// Smallest subset that keeps the same coefficients observable, smallest scheme for all coefficients,
/// and front of schemes of the cardinal attitudes.
fn alternatives(scheme: &Scheme, conditions: &Conditions, analysis: &Analysis, seed: u64) -> Alternatives {
    let mut out = Alternatives::default();
    // conditions of the predictions: no prior and white noise of Z
    let conditions = &Conditions {
        priors: Conditions::default().priors,
        accelerometer_instability_ug: 0.0,
        ..conditions.clone()
    };
    let mut refused = Vec::new();
    let seen: Vec<String> = (analysis.quantities.iter())
        .filter(|q| q.status == Status::Observable && q.name.starts_with("D_"))
        .map(|q| q.name.clone())
        .collect();
    let task = |candidates, positions, required: &[String]| DesignOptions {
        candidates,
        positions,
        required: required.to_vec(),
        keep: 1,
        restarts: 40,
        seed,
        ..DesignOptions::default()
    };
    let progress = |_| true;
    let mut run = |options: DesignOptions| match design(scheme, conditions, &options, &progress) {
        Ok(found) => Some(found),
        // no coefficients, generic angles, rotations: nothing to choose from
        Err(DesignError::Drift | DesignError::Rotation { .. } | DesignError::GenericAngle { .. }) => None,
        Err(e) => {
            refused.push(e);
            None
        }
    };
    if !seen.is_empty()
        && scheme.positions.len() <= SUBSETS
        && let Ok(own) = Candidates::of_scheme(scheme)
    {
        out.kept = run(task(own, None, &seen)).map(|d| d.minimum);
        if let Some(kept) = &mut out.kept {
            kept.witness.sort_by_key(|name| scheme.positions.iter().position(|p| p.name == *name));
        }
    }
    out.all = run(task(Candidates::cardinals(), None, &[])).map(|d| d.minimum);
    if !seen.is_empty() {
        let most = if scheme.carry == Carry::Reset { FRONT_OF_SETS } else { FRONT_POSITIONS };
        let positions = scheme.positions.len().min(most);
        let found = run(task(Candidates::cardinals(), Some(positions), &seen));
        if let Some(found) = found {
            out.front = found.front;
            out.certificate = found.search.and_then(|s| s.certificate);
        }
        out.front_positions = positions;
    }
    out.required = seen;
    out.refused = refused;
    out
}

/// Releases the engine to other processes: the next steps need no formulas and may take long.
fn rest(worker: Option<&mut Worker>) {
    if let Some(worker) = worker {
        worker.rest();
    }
}

/// True if the file states a run: its duration, and the noise of every output. A file for a calibration may
/// state a part of it, and is reviewed without a run.
fn states_run(model: &SystemModel) -> bool {
    let stated = &model.simulation;
    stated.duration.is_some() && model.outputs.iter().all(|o| stated.noise.contains_key(&o.0.name))
}

/// Name of an output; entries `y[1]`, `y[2]` of a vector have the same.
fn output_name(name: &str) -> &str {
    name.split('[').next().unwrap_or(name)
}

/// Verdicts of a model without each of its outputs; `None` if there are many outputs or unknowns, or if a
/// model with fewer outputs cannot be judged.
fn without_outputs(model: &SystemModel, analysis: &SystemAnalysis, seed: u64) -> Option<Vec<WithoutOutput>> {
    let mut names: Vec<&str> = model.outputs.iter().map(|o| output_name(&o.0.name)).collect();
    names.dedup();
    if names.len() < 2 {
        return Some(Vec::new());
    }
    if names.len() > OUTPUTS || analysis.unknowns > UNKNOWNS {
        return None;
    }
    let without = |i: usize| {
        let name = names[i];
        let mut fewer = SystemModel { combinations: Vec::new(), candidates: Vec::new(), ..model.clone() };
        fewer.outputs.retain(|o| output_name(&o.0.name) != name);
        let judged = judge(&fewer, seed, None)?;
        let rank = judged.findings.degrees.rank();
        let mut out =
            WithoutOutput { name: name.into(), lost: Vec::new(), higher: Vec::new(), rank, largest: 0 };
        for q in analysis.quantities.iter().filter(|q| q.degree.is_some()) {
            let degree = judged.verdict(&fewer, &q.name).and_then(|v| v.degree);
            out.largest = out.largest.max(degree.unwrap_or(0));
            if degree.is_none() {
                out.lost.push(q.name.clone());
            } else if degree > q.degree {
                out.higher.push(q.name.clone());
            }
        }
        Ok::<_, ModelError>(out)
    };
    parallel::try_map(names.len(), without).ok()
}

/// Review of a model, with run and evidence if it has numbers for them.
fn model(model: &SystemModel, seed: u64) -> Result<ModelReview, ModelError> {
    let analysis = analyze_system(model, SystemOptions { seed, ..SystemOptions::default() })?;
    let mut refused = None;
    let run = simulate_system(model, seed);
    let evidence = run.as_ref().ok().map(|_| crosscheck_system(model, seed));
    let mut unless_wrong = |e: RunError| match e {
        RunError::Model(error) if states_run(model) => Err(error),
        e => {
            refused = Some(e);
            Ok(())
        }
    };
    let run = match run {
        Ok((run, traces)) => Some(ModelRun { run, traces }),
        Err(e) => unless_wrong(e).map(|()| None)?,
    };
    let evidence = match evidence {
        Some(Ok(evidence)) => Some(evidence),
        Some(Err(e)) => unless_wrong(e).map(|()| None)?,
        None => None,
    };
    let outputs = without_outputs(model, &analysis, seed);
    Ok(ModelReview { document: model.document.clone(), analysis, run, evidence, refused, outputs })
}

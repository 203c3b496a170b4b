//! Exhaustive searches in parts: ranges of the ordered starts, each searched where and when one likes, put together
//! again to what the whole gives.

use std::collections::BTreeMap;
use std::ops::Range;

use obsdeg_core::model::Scheme;
use obsdeg_evidence::simulation::Conditions;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::design::answer::Design;
use crate::design::request::error::{DesignError, PartError};
use crate::design::request::options::DesignOptions;
use crate::design::run::driver::answered;
use crate::design::run::prepared::Prepared;
use crate::design::run::task::asked;
use crate::design::search::best::Best;
use crate::design::search::progress::{NOTHING_YET, Progress, watched};

/// Name and version of the JSON layout.
pub const PART_SCHEMA: &str = "obsdeg.part/1";
/// Starts that are searched at once: an interrupted part goes on behind the last that are all done.
const CHUNK: usize = 16;

/// Part of an exhaustive search, done or interrupted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Part {
    /// Layout of this answer: `obsdeg.part/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// SHA-256 of all inputs: the parts of one search have the same.
    pub digest: String,
    /// Inputs of the search by name, as the library writes them; they show the difference if digests differ.
    pub inputs: BTreeMap<String, String>,
    /// Options and files of the command that wrote it, as the JSON text that the command reads: its merge
    /// needs no others; null if no command did.
    pub asked: Option<String>,
    /// Index of the part, from 1, then the number of parts.
    pub part: [usize; 2],
    /// Starts of the part: index of the first, index behind the last (both from 0), and the number of all
    /// starts.
    pub starts: [usize; 3],
    /// Sequences found, by worst degree, smallest first (under reset carry all degrees together).
    pub levels: Vec<Level>,
    /// True if all of its starts were searched, at as many worst degrees as the whole may need.
    pub complete: bool,
}

/// Sequences found with one worst degree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Level {
    /// Index of the first start that is not yet searched.
    pub next: usize,
    /// Best sequences, the front and the counts at this worst degree.
    pub best: Best,
}

/// Everything that a search of parts depends on, by name; what is not listed here is told by the compiler.
fn inputs(base: &Scheme, conditions: &Conditions, options: &DesignOptions) -> BTreeMap<String, String> {
    let Scheme {
        // what a design takes of a scheme are its assumptions
        name: _,
        description: _,
        positions: _,
        combinations: _,
        recording: _,
        carry,
        latitude,
        geometry,
        unknowns,
        measured_azimuth,
        simulation,
        requirements,
        bench: bench_of_scheme,
        gimbals,
        path,
    } = base;
    let DesignOptions {
        // a part searches all
        within: _,
        everywhere: _,
        candidates,
        positions,
        required,
        degree_caps,
        meet,
        total_s,
        slew_s,
        criterion,
        keep,
        restarts,
        refine,
        divide,
        front,
        free,
        seed,
    } = options;
    let Conditions {
        truth,
        filter,
        step_s,
        dwell_s,
        slew_rate_deg_s,
        slews,
        accelerometer_noise_g,
        accelerometer_instability_ug,
        accelerometer_correlation_s,
        azimuth_noise_deg,
        drift_noise,
        drift_noise_step_s,
        gyro_noise,
        propagation,
        values,
        drift_scale,
        estimates,
        priors,
        requirements: required_sigmas,
        bench,
        stated,
    } = conditions;
    let of: [(&str, &dyn std::fmt::Debug); 48] = [
        ("version", &env!("CARGO_PKG_VERSION")),
        ("carry", carry),
        ("latitude", latitude),
        ("geometry", geometry),
        ("terms", unknowns),
        ("measured azimuth", measured_azimuth),
        ("settings of the scheme", simulation),
        ("requirements of the scheme", requirements),
        ("bench of the scheme", bench_of_scheme),
        ("gimbals", gimbals),
        ("path", path),
        ("candidates", &candidates.names),
        ("angles of candidates", &candidates.attitudes),
        ("positions", positions),
        ("observable", required),
        ("max-degree", degree_caps),
        ("meet", meet),
        ("max-time", total_s),
        ("max-slew", slew_s),
        ("criterion", criterion),
        ("keep", keep),
        ("restarts", restarts),
        ("refine", refine),
        ("divide", divide),
        ("front", front),
        ("free", free),
        ("seed", seed),
        ("truth", truth),
        ("filter", filter),
        ("step", step_s),
        ("dwell", dwell_s),
        ("slew-rate", slew_rate_deg_s),
        ("slews", slews),
        ("noise", accelerometer_noise_g),
        ("accelerometer-instability", accelerometer_instability_ug),
        ("accelerometer-correlation-time", accelerometer_correlation_s),
        ("azimuth-noise", azimuth_noise_deg),
        ("drift noise", drift_noise),
        ("step of drift noise", drift_noise_step_s),
        ("noise of gyros", gyro_noise),
        ("propagation", propagation),
        ("values", values),
        ("drift scale", drift_scale),
        ("estimates", estimates),
        ("prior", priors),
        ("requirement", required_sigmas),
        ("bench", bench),
        ("stated conditions", stated),
    ];
    of.into_iter().map(|(name, value)| (name.into(), format!("{value:?}"))).collect()
}

/// `SHA-256` of the inputs.
fn digest(inputs: &BTreeMap<String, String>) -> String {
    let text: String = inputs.iter().map(|(name, value)| format!("{name}\n{value}\n")).collect();
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// `dwell is 999.0, here 1000.0`: what differs; long values are left out.
fn differing(found: &BTreeMap<String, String>, expected: &BTreeMap<String, String>) -> String {
    const LONGEST: usize = 60;
    let value = |of: &BTreeMap<String, String>, name: &String| {
        of.get(name).cloned().unwrap_or_else(|| "missing".into())
    };
    let mut names: Vec<&String> = expected.keys().chain(found.keys()).collect();
    names.sort_unstable();
    names.dedup();
    let differs = names.into_iter().filter_map(|name| {
        let (there, here) = (value(found, name), value(expected, name));
        let short = there.len().max(here.len()) <= LONGEST;
        (there != here)
            .then(|| if short { format!("{name} is {there}, here {here}") } else { format!("{name} differ") })
    });
    let listed: Vec<String> = differs.collect();
    if listed.is_empty() { "its inputs are not those of its digest".into() } else { listed.join("; ") }
}

/// The starts of part `number` of `of`, counted from 1: each part has about as many sequences behind its starts as any other.
fn range(work: &[f64], [number, of]: [usize; 2]) -> Range<usize> {
    let total: f64 = work.iter().sum();
    // where the middle of a start is
    let mut behind = 0.0;
    let middles: Vec<f64> = work
        .iter()
        .map(|work| {
            behind += work;
            (behind - work / 2.0) / total * of as f64
        })
        .collect();
    let to =
        |part: usize| if part == of { work.len() } else { middles.partition_point(|m| *m < part as f64) };
    to(number - 1)..to(number)
}

/// The number of starts of an exhaustive search: what its parts divide. More parts than starts leave some of them empty.
///
/// # Errors
/// [`DesignError`].
pub fn design_starts(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
) -> Result<usize, DesignError> {
    let going = || true;
    let conditions = &asked(base, conditions, &options.required)?;
    let prepared = Prepared::new(base, conditions, options, &going)?;
    let k = options.positions.filter(|_| options.free.is_none()).ok_or(DesignError::Parts)?;
    Ok(prepared.search(&|_| true).starts(&prepared.task.symmetry, k).len())
}

/// Part `number` of `of` of the exhaustive search, however large that is; `resumed` is what an interrupted run of the
/// same part found. Interrupted again, it is not complete.
///
/// # Errors
/// [`DesignError`]; [`PartError`] for a part that cannot be gone on with.
pub fn design_part(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    part: [usize; 2],
    resumed: Option<Part>,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Part, DesignError> {
    let k = options.positions.filter(|_| options.free.is_none()).ok_or(DesignError::Parts)?;
    if !(1..=part[1]).contains(&part[0]) {
        return Err(DesignError::PartNumber { found: part });
    }
    let inputs = inputs(base, conditions, options);
    let digest = digest(&inputs);
    if let Some(resumed) = &resumed {
        let number = (resumed.part != part)
            .then_some(PartError::Number { found: resumed.part, expected: part })
            .map_or(Ok(()), Err);
        let why = resumed.check(&digest, &inputs).and(number);
        why.map_err(|why| DesignError::Part { name: "the part to go on with".into(), why })?;
        if resumed.complete {
            return Ok(resumed.clone());
        }
    }
    let conditions = &asked(base, conditions, &options.required)?;
    watched(progress, |progress, _| {
        let going = || progress(NOTHING_YET);
        let prepared = Prepared::new(base, conditions, options, &going)?;
        prepared.check(k)?;
        prepared.exhaustible(k)?;
        let search = prepared.search(progress);
        let starts = search.starts(&prepared.task.symmetry, k);
        let own = range(&search.work(&starts, k), part);
        let expected = [own.start, own.end, starts.len()];
        let mut out = resumed.unwrap_or_else(|| Part {
            schema: PART_SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            digest,
            inputs,
            asked: None,
            part,
            starts: expected,
            levels: Vec::new(),
            complete: false,
        });
        if out.starts != expected {
            let why = PartError::Starts { found: out.starts, expected, part };
            return Err(DesignError::Part { name: "the part to go on with".into(), why });
        }
        let symmetry = &prepared.task.symmetry;
        let pruning = prepared.pruning(&search, k);
        let Some(levels) = search.levels_of(k) else { return Ok(out) };
        let mut all = Best { complete: true, ..Best::default() };
        for (i, level) in levels.iter().enumerate() {
            if out.levels.len() == i {
                let best = Best { complete: true, ..Best::default() };
                out.levels.push(Level { next: own.start, best });
            }
            let here = &mut out.levels[i];
            while here.next < own.end {
                let to = (here.next + CHUNK).min(own.end);
                let done =
                    search.exhaust_starts(&starts[here.next..to], symmetry, k, level, pruning.as_ref());
                if !done.complete {
                    return Ok(out);
                }
                here.best.merge(options.keep, done);
                here.next = to;
            }
            all.merge(options.keep, here.best.clone());
            if all.found.len() >= options.keep.max(1) {
                break;
            }
        }
        out.complete = true;
        Ok(out)
    })
}

/// What all parts of an exhaustive search found together: the answer of the whole. The parts are named, and come in any
/// order.
///
/// # Errors
/// [`DesignError::Part`] for one that is foreign, doubled or not done, [`DesignError::MissingParts`]; [`DesignError`].
pub fn design_merged(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    parts: &[(String, Part)],
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Design, DesignError> {
    let inputs = inputs(base, conditions, options);
    let digest = digest(&inputs);
    let Some((_, first)) = parts.first().filter(|_| options.free.is_none()) else {
        return Err(DesignError::Parts);
    };
    let of = first.part[1];
    let mut sorted: Vec<Option<&(String, Part)>> = vec![None; of.min(MOST_PARTS)];
    for named in parts {
        let (name, part) = named;
        let named_error = |why: PartError| DesignError::Part { name: name.clone(), why };
        part.check(&digest, &inputs).map_err(named_error)?;
        if part.part[1] != of {
            return Err(named_error(PartError::Division { found: part.part, expected: of }));
        }
        if !part.complete {
            return Err(named_error(PartError::Unfinished { part: part.part }));
        }
        let slot = sorted.get_mut(part.part[0] - 1);
        let Some(slot) = slot else { return Err(DesignError::PartNumber { found: part.part }) };
        if let Some((other, _)) = slot {
            return Err(named_error(PartError::Doubled { part: part.part, other: other.clone() }));
        }
        *slot = Some(named);
    }
    let missing: Vec<usize> = (1..=sorted.len()).filter(|i| sorted[i - 1].is_none()).collect();
    if !missing.is_empty() {
        return Err(DesignError::MissingParts { missing, of });
    }
    let sorted: Vec<&(String, Part)> = sorted.into_iter().flatten().collect();
    let together = |prepared: &Prepared<'_>, k: usize| {
        prepared.exhaustible(k)?;
        let search = prepared.search(&|_| true);
        let work = search.work(&search.starts(&prepared.task.symmetry, k), k);
        for (name, part) in &sorted {
            let own = range(&work, part.part);
            let expected = [own.start, own.end, work.len()];
            let wrong = |why| Err(DesignError::Part { name: name.clone(), why });
            if part.starts != expected {
                return wrong(PartError::Starts { found: part.starts, expected, part: part.part });
            }
            if part.levels.iter().any(|level| level.next != own.end) {
                return wrong(PartError::Unfinished { part: part.part });
            }
        }
        let mut all = Best { complete: true, ..Best::default() };
        for i in 0.. {
            if sorted.iter().all(|(_, part)| part.levels.len() <= i) {
                break;
            }
            for (name, part) in &sorted {
                // a part ends early only when it has found enough by itself
                let unfinished = || DesignError::Part {
                    name: name.clone(),
                    why: PartError::Unfinished { part: part.part },
                };
                all.merge(options.keep, part.levels.get(i).ok_or_else(unfinished)?.best.clone());
            }
            if all.found.len() >= options.keep.max(1) {
                break;
            }
        }
        Ok(all)
    };
    answered(base, conditions, options, progress, Some(&together))
}

/// Most parts of a search.
const MOST_PARTS: usize = 1_000_000;

impl Part {
    /// Whether it belongs to a search of these inputs.
    fn check(&self, digest: &str, inputs: &BTreeMap<String, String>) -> Result<(), PartError> {
        let [number, of] = self.part;
        let why = if self.schema != PART_SCHEMA {
            format!("schema {}; expected {PART_SCHEMA}", self.schema)
        } else if !(1..=of).contains(&number) {
            format!("part {number} of {of}")
        } else if self.digest != digest {
            return Err(PartError::Foreign { why: differing(&self.inputs, inputs) });
        } else {
            return Ok(());
        };
        Err(PartError::Layout { why })
    }
}

//! The fewest positions, and the best of a number of positions.

mod asked;
mod checks;
pub(super) mod options;

use obsdeg_core::model::{Angle, Scheme, parse_decimal};
use obsdeg_design::design::{
    Candidates, DesignOptions, Part, Progress, SlewSequenceOptions, asked as asked_conditions,
    check_certifiable, design_merged, design_part, is_slew_sequence, shortest_slew_sequence,
};
use obsdeg_design::next::{NextOptions, NextPositions};
use obsdeg_design::sensors::Sensors;
use obsdeg_evidence::simulation::Conditions;

use crate::arguments::check_whole;
use crate::designed::{Designed, Searched, SearchedSlewSequence};
use crate::host::{Host, Now};
use crate::measure::{MeasureOptions, SetRequirements, measured};
use crate::next::{calibrated, check_further, further};
use crate::problem::Problem;
use crate::source::Source;
use asked::{Asked, known, proof, read_part, stated};
use checks::{check_values, idle};
use options::{CARDINAL, KEPT, Search, SearchFiles};

/// Searches schemes, or sets of outputs of a model.
///
/// # Errors
/// Options that are wrong or have no effect; a search that found nothing.
pub fn design(a: &Search, files: &SearchFiles, host: &Host<'_>) -> Result<Designed, Problem> {
    if let Some(found) = of_model(a, files, host)? {
        return Ok(Designed::Outputs(Box::new(found)));
    }
    if a.further.next.is_some() || files.after.is_some() {
        return Ok(Designed::Next(Box::new(next_positions(a, files, host)?)));
    }
    let asked = known(a, files)?;
    let files = &SearchFiles { merge: files.merge.clone(), ..asked.files(files) };
    let a = &asked.options;
    check_values(a)?;
    let (base, candidates, conditions) = assumed(a, files)?;
    idle(a, !files.merge.is_empty(), &base, &conditions)?;
    let options = design_options(a, candidates)?;
    if a.max_turn.is_some() && !(a.minimum && is_slew_sequence(&base)) {
        return Err(Problem::input(
            "--max-turn is for --minimum with torquer errors (GS, GM, GM3) under inertial carry",
        ));
    }
    if a.minimum && is_slew_sequence(&base) {
        return fewest_positions_of_slew_sequence(a, base, options, host);
    }
    if a.certificate {
        if a.part.is_some() || !files.merge.is_empty() {
            return Err(Problem::input(
                "a certificate is of a search at once; found parts (--part, --merge)",
            ));
        }
        check_certifiable(&base, &conditions, &options)?;
    }
    let parts = files.merge.iter().map(|part| Ok((part.name.clone(), read_part(part)?)));
    let parts: Vec<(String, Part)> = parts.collect::<Result<_, Problem>>()?;
    let progress = |now: Progress| (host.progress)(now.into());
    if let Some(number) = a.part {
        let resumed = files.resume.as_ref().map(read_part).transpose()?;
        let mut done = design_part(&base, &conditions, &options, number, resumed, &progress)?;
        done.asked = Some(Asked::of(a, files)?);
        return Ok(Designed::Part(Box::new(done.sealed())));
    }
    let found = if parts.is_empty() {
        obsdeg_design::design::design(&base, &conditions, &options, &progress)
    } else {
        let check = a.check.map_or(0, |blocks| usize::try_from(blocks).unwrap_or(usize::MAX));
        design_merged(&base, &conditions, &options, &parts, check, &progress)
    }?;
    let certificate =
        a.certificate.then(|| proof(&base, &conditions, &options, &found, &progress)).transpose()?;
    let conditions = asked_conditions(&base, &conditions, &options.required)?;
    Ok(Designed::Schemes(Box::new(Searched { found, base, conditions, certificate })))
}

/// Options of the search itself.
fn design_options(a: &Search, candidates: Candidates) -> Result<DesignOptions, Problem> {
    let round = a.round.as_deref().unwrap_or("5");
    let step = parse_decimal(round.trim()).ok().filter(|step| (1..=90_000_000_000).contains(step));
    let step = step.ok_or_else(|| {
        Problem::input(format!("--round {round}: expected degrees above 0 and up to 90, as in 5"))
    })?;
    Ok(DesignOptions {
        candidates,
        positions: a.positions,
        required: a.wanted.observable.clone(),
        degree_caps: a.wanted.degree_caps()?,
        immune: a.wanted.immune.clone(),
        meet: a.wanted.meet,
        total_s: a.wanted.max_time,
        slew_s: a.wanted.max_slew,
        criterion: a.wanted.criterion.unwrap_or_default(),
        keep: a.keep.unwrap_or(10).into(),
        restarts: a.restarts.unwrap_or(200),
        refine: a.refine,
        divide: a.divide,
        front: a.front.clone(),
        within: a.within.map(|percent| percent / 100.0),
        everywhere: true,
        free: (a.candidates == "free").then_some(step),
        seed: a.seed,
    })
}

/// Further positions of the scheme in a file.
fn next_positions(a: &Search, files: &SearchFiles, host: &Host<'_>) -> Result<NextPositions, Problem> {
    let of_parts = !files.merge.is_empty() || files.resume.is_some();
    let given = stated(a)?;
    let names: Vec<&str> = given.keys().map(String::as_str).chain(of_parts.then_some("merge")).collect();
    let added = check_further(&a.further, &names, files.conditions_file.is_some(), files.after.is_some())?;
    let (base, candidates, conditions) = assumed(a, files)?;
    let options = NextOptions {
        candidates,
        added,
        required: a.wanted.observable.clone(),
        total_s: a.wanted.max_time,
        slew_s: a.wanted.max_slew,
        keep: a.keep.unwrap_or(10).into(),
        beforehand: files.after.as_ref().map(|after| calibrated(after, &base)).transpose()?,
        days: a.further.days.clone(),
        seed: a.seed,
    };
    further(&base, &conditions, &options, host)
}

/// Scheme with the assumptions of the search, candidates, and conditions.
fn assumed(a: &Search, files: &SearchFiles) -> Result<(Scheme, Candidates, Conditions), Problem> {
    let (mut base, candidates) = candidates(&a.candidates, files.candidates_file.as_ref())?;
    if let Some(file) = &files.conditions_file {
        base = file.scheme()?;
        // a dwell that all positions share becomes the default dwell of the scheme
        let mut dwells = base.positions.iter().map(|p| p.dwell.map(|d| d.seconds()));
        let first = dwells.next().flatten();
        if base.simulation.dwell_s.is_none() && dwells.all(|d| d == first) {
            base.simulation.dwell_s = first;
        }
    }
    a.assumptions.apply(&mut base);
    if let Some(terms) = a.terms.unknowns()? {
        base.unknowns = terms;
    }
    for limit in &a.wanted.gimbal {
        base.gimbals.limit(limit).map_err(|e| Problem::input(format!("--gimbal: {e}")))?;
    }
    // the options concern unknowns that every position has
    let any = std::array::from_fn(|_| Angle::from_degrees(0));
    let with_any = Scheme { positions: Scheme::of_angles([any]).positions, ..base.clone() };
    a.measurement.concern(std::iter::once(&with_any))?;
    let mut conditions = a.measurement.conditions(&base);
    conditions.slew_rate_deg_s = a.wanted.slew_rate.or(conditions.slew_rate_deg_s);
    Ok((base, candidates, conditions))
}

/// Options that a search for outputs of a model takes.
const OF_MODELS: [&str; 10] = [
    "seed",
    "keep",
    "observable",
    "max_degree",
    "measure",
    "own_outputs",
    "unique",
    "cost",
    "order",
    "work_limit",
];

/// Sets of outputs, if a model or candidates for its outputs are given; `None` for schemes.
fn of_model(a: &Search, files: &SearchFiles, host: &Host<'_>) -> Result<Option<Sensors>, Problem> {
    let file = files.conditions_file.as_ref();
    let model = file.filter(|file| file.is_model());
    let outputs = &a.outputs;
    if *outputs == MeasureOptions::default() && model.is_none() {
        return Ok(None);
    }
    let Some(file) = file else {
        return Err(Problem::input("nothing to choose outputs of; expected a model file"));
    };
    let given = stated(a)?;
    if let Some(other) = given.keys().find(|name| !OF_MODELS.contains(&name.as_str())) {
        let option = other.replace('_', "-");
        return Err(Problem::input(format!(
            "--{option} is about schemes; outputs of a model are chosen by --measure"
        )));
    }
    a.keep.map_or(Ok(()), |keep| check_whole("--keep", keep, &KEPT))?;
    let wanted = SetRequirements {
        required: &a.wanted.observable,
        max_degree: a.wanted.degree_caps()?,
        keep: a.keep.unwrap_or(10).into(),
        seed: a.seed,
    };
    measured(outputs, &wanted, file, host).map(Some)
}

/// Fewest positions where the slew path between them counts.
fn fewest_positions_of_slew_sequence(
    a: &Search,
    base: Scheme,
    options: DesignOptions,
    host: &Host<'_>,
) -> Result<Designed, Problem> {
    if !base.gimbals.are_free() {
        let text = "--gimbal is not taken where torquer errors make a scheme a walk; expected --max-turn, --observable";
        return Err(Problem::input(text));
    }
    let options = SlewSequenceOptions {
        candidates: options.candidates,
        required: options.required,
        most_turn_deg: a.max_turn.unwrap_or(90.0),
        seed: options.seed,
    };
    let found =
        shortest_slew_sequence(&base, &options, &|| (host.progress)(Now::of("searching walks", 0, 1)))?;
    Ok(Designed::SlewSequence(Box::new(SearchedSlewSequence { found, base })))
}

/// Candidates, and the scheme whose assumptions hold.
fn candidates(text: &str, file: Option<&Source>) -> Result<(Scheme, Candidates), Problem> {
    if let Some(file) = file {
        let scheme = file.scheme()?;
        let candidates = Candidates::of_scheme(&scheme)?;
        return Ok((scheme, candidates));
    }
    if text == CARDINAL {
        return Ok((Scheme::default(), Candidates::cardinals()));
    }
    if text == "free" {
        // grid from which the search for free attitudes starts
        return Ok((Scheme::default(), Candidates::grid(45_000_000_000)?));
    }
    if let Some(step) = text.strip_prefix("grid:") {
        let wrong =
            || Problem::input(format!("--candidates {text}: expected a step in degrees, as in grid:45"));
        let step = parse_decimal(step.trim()).map_err(|_| wrong())?;
        return Ok((Scheme::default(), Candidates::grid(step)?));
    }
    Err(Problem::input(format!(
        "--candidates {text}: there is no such file; expected cardinal, free, a grid such as grid:45, or a \
         scheme file that exists"
    )))
}

/// True if `--candidates` is one of its words and not the path of a file.
pub fn is_word(candidates: &str) -> bool {
    candidates == CARDINAL || candidates == "free" || candidates.starts_with("grid:")
}

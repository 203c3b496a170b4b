//! Calls from other languages: a command by its name, options and files as JSON.

use obsdeg_calibration::record::Record;
use obsdeg_core::language::explain_message;
use obsdeg_report::{
    Answer, Explanation, File, Format, ReviewFormat, TerminalLayout, csv, fragment, next_figures,
    picture_folder, position_figure, sensor_figures, written,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::allan::{Allan, allan, files as allan_files};
use crate::analyze::{Analyze, analyze, certificate, reduced_model};
use crate::arguments::Given;
use crate::calibrate::{Calibrate, calibrate};
use crate::compare::{Compare, compare};
use crate::crosscheck::{Crosscheck, crosscheck, files as crosscheck_files};
use crate::design::design;
use crate::design::options::{Search, SearchFiles};
use crate::designed::Designed;
use crate::host::Host;
use crate::paper::{Paper, paper};
use crate::problem::Problem;
use crate::procedure::{ProcedureRequest, procedure};
use crate::report::{CalibrationFile, Report, origin, report};
use crate::simulate::{Simulate, files as simulation_files, simulate};
use crate::source::{Input, NamedInput, Source, title};

/// Names of the commands.
pub const COMMANDS: [&str; 10] = [
    "analyze",
    "simulate",
    "crosscheck",
    "procedure",
    "calibrate",
    "allan",
    "compare",
    "design",
    "report",
    "paper",
];

/// Answer of any command, written in the formats that are asked for.
pub trait Rendered: Send + Sync {
    /// Name and version of the JSON layout (`obsdeg.analysis/1`); `None` for lists of answers and for texts.
    fn layout(&self) -> Option<&str>;

    /// Text that the command line prints with `--format`, byte for byte; a report is its page in any format.
    ///
    /// # Errors
    /// [`Problem`] of an answer that cannot be written.
    fn written(&self, format: Format) -> Result<String, Problem>;

    /// One list of the JSON as CSV (`--table`); the main list if `name` is `None`.
    ///
    /// # Errors
    /// [`Problem`] of a name that the answer has no list for.
    fn table(&self, name: Option<&str>) -> Result<String, Problem>;

    /// Part of an HTML page: tables and formulas that need no scripts.
    ///
    /// # Errors
    /// [`Problem`] of an answer that cannot be written.
    fn fragment(&self) -> Result<String, Problem>;

    /// Files of the folder, besides the JSON: series, found schemes, and with `pictures` the figures.
    ///
    /// # Errors
    /// [`Problem`] of a figure that cannot be drawn.
    fn files(&self, pictures: bool) -> Result<Vec<File>, Problem>;
}

/// Answer to a request in JSON.
pub struct Answered {
    /// The answer.
    pub answer: Box<dyn Rendered>,
    /// True if the command line would exit with 0: false where something disagrees or is not explained.
    pub passed: bool,
}

impl Answered {
    /// Text that the command line prints with `--format json`, byte for byte. For a report it is the page,
    /// for a part of a search the file.
    ///
    /// # Errors
    /// [`Problem`] of an answer that cannot be written.
    pub fn text(&self) -> Result<String, Problem> {
        self.answer.written(Format::Json)
    }
}

/// Answer with the function that makes its files.
struct AnswerWithFiles<A, F> {
    answer: A,
    files: F,
}

impl<A, F> Rendered for AnswerWithFiles<A, F>
where
    A: Answer + Send + Sync,
    F: Fn(&A, bool) -> Result<Vec<File>, Problem> + Send + Sync,
{
    fn layout(&self) -> Option<&str> {
        self.answer.layout()
    }

    fn written(&self, format: Format) -> Result<String, Problem> {
        Ok(written(&self.answer, format, TerminalLayout::default())?)
    }

    fn table(&self, name: Option<&str>) -> Result<String, Problem> {
        Ok(csv(&self.answer, name)?)
    }

    fn fragment(&self) -> Result<String, Problem> {
        Ok(fragment(&self.answer)?)
    }

    fn files(&self, pictures: bool) -> Result<Vec<File>, Problem> {
        let mut files = (self.files)(&self.answer, pictures)?;
        files.retain(|f| pictures || !is_picture(&f.name));
        Ok(files)
    }
}

/// Answer that is a text in every format: the page of a report, a part of a search.
struct PlainText(String);

impl Rendered for PlainText {
    fn layout(&self) -> Option<&str> {
        None
    }

    fn written(&self, _: Format) -> Result<String, Problem> {
        Ok(self.0.clone())
    }

    fn table(&self, _: Option<&str>) -> Result<String, Problem> {
        Err(Problem::input("there are no tables of this answer"))
    }

    fn fragment(&self) -> Result<String, Problem> {
        Ok(self.0.clone())
    }

    fn files(&self, _: bool) -> Result<Vec<File>, Problem> {
        Ok(Vec::new())
    }
}

/// True for the file names of pictures.
fn is_picture(name: &str) -> bool {
    [".svg", ".png"].iter().any(|end| name.ends_with(end))
}

/// Files of an answer that are all pictures.
fn drawn<A, E>(draw: impl Fn(&A) -> Result<Vec<File>, E>) -> impl Fn(&A, bool) -> Result<Vec<File>, Problem>
where
    Problem: From<E>,
{
    move |answer, pictures| if pictures { Ok(draw(answer)?) } else { Ok(Vec::new()) }
}

/// No files, for answers without any.
fn none<A>(_: &A, _: bool) -> Result<Vec<File>, Problem> {
    Ok(Vec::new())
}

/// Form in which an answer is returned.
trait OutputForm {
    type Out;

    fn whole<A: Answer + Send + Sync + 'static>(
        answer: A,
        passed: bool,
        files: impl Fn(&A, bool) -> Result<Vec<File>, Problem> + Send + Sync + 'static,
    ) -> Result<Self::Out, Problem>;

    fn text(text: String, passed: bool) -> Result<Self::Out, Problem>;
}

/// Answers that can be written in every format, with their files.
struct AllFormats;

impl OutputForm for AllFormats {
    type Out = Answered;

    fn whole<A: Answer + Send + Sync + 'static>(
        answer: A,
        passed: bool,
        files: impl Fn(&A, bool) -> Result<Vec<File>, Problem> + Send + Sync + 'static,
    ) -> Result<Answered, Problem> {
        Ok(Answered { answer: Box::new(AnswerWithFiles { answer, files }), passed })
    }

    fn text(text: String, passed: bool) -> Result<Answered, Problem> {
        Ok(Answered { answer: Box::new(PlainText(text)), passed })
    }
}

/// Answer as JSON, with its sentences.
pub struct InJson {
    /// The JSON, as the command line prints it.
    pub text: String,
    /// The answer in sentences ([`Answer::sentences`]).
    pub sentences: Vec<String>,
    /// Explanations of single verdicts in words ([`Answer::explanations`]).
    pub explanations: Vec<Explanation>,
    /// True if the command line would exit with 0.
    pub passed: bool,
}

/// Answers as JSON only: a program that needs nothing else links no other writer.
struct JsonOnly;

impl OutputForm for JsonOnly {
    type Out = InJson;

    fn whole<A: Answer + Send + Sync + 'static>(
        answer: A,
        passed: bool,
        _: impl Fn(&A, bool) -> Result<Vec<File>, Problem> + Send + Sync + 'static,
    ) -> Result<Self::Out, Problem> {
        let (sentences, explanations) = (answer.sentences(), answer.explanations());
        Ok(InJson { text: obsdeg_report::json(&answer)?, sentences, explanations, passed })
    }

    fn text(text: String, passed: bool) -> Result<Self::Out, Problem> {
        Ok(InJson { text, sentences: Vec::new(), explanations: Vec::new(), passed })
    }
}

/// Answers a command with the text of the answer ([`Answered::text`]), its sentences, and the outcome of its
/// checks.
///
/// # Errors
/// The errors of [`call`].
pub fn call_json(command: &str, request: &str, host: &mut Host<'_>) -> Result<InJson, Problem> {
    object(request).and_then(|request| answered::<JsonOnly>(command, request, host)).map_err(in_snake_case)
}

/// Answers a command. `request` is a JSON object with options, named as on the command line in snake case,
/// and files, each `{"name": ..., "text": ...}`. `sources` are schemes and models. `calibrate` also has
/// `records` and `before`, `report` has `calibrations`, `design` has `candidates_file`, `merge` and `resume`.
///
/// # Errors
/// Defect of the request; options are named in snake case.
pub fn call(command: &str, request: &str, host: &mut Host<'_>) -> Result<Answered, Problem> {
    object(request).and_then(|request| answered::<AllFormats>(command, request, host)).map_err(in_snake_case)
}

/// Answer to a command in a form.
fn answered<W: OutputForm>(
    command: &str,
    request: Map<String, Value>,
    host: &mut Host<'_>,
) -> Result<W::Out, Problem> {
    match command {
        "analyze" => analyzed::<W>(request, host),
        "simulate" => simulated::<W>(request),
        "crosscheck" => crosschecked::<W>(request, host),
        "procedure" => planned::<W>(request),
        "calibrate" => calibrated_from_texts::<W>(request, host),
        "allan" => {
            let asked: CommandRequest<Allan, StaticRecords> = CommandRequest::read(request)?;
            let records = asked.files.records.into_iter().map(of_text).collect::<Result<_, _>>()?;
            noise_of::<W>(&asked.options, records, host)
        }
        "compare" => {
            let asked: CommandRequest<Compare, Sources> = CommandRequest::read(request)?;
            W::whole(compare(&asked.options, read(asked.files.sources)?)?, true, none)
        }
        "design" => designed::<W>(request, host),
        "report" => reviewed::<W>(request, host),
        "paper" => {
            let asked: CommandRequest<Paper, NoFiles> = CommandRequest::read(request)?;
            W::whole(paper(&asked.options)?, true, none)
        }
        _ => {
            Err(Problem::input(format!("`{command}` is no command; expected one of {}", COMMANDS.join(", "))))
        }
    }
}

/// Verdicts on schemes and models.
fn analyzed<W: OutputForm>(request: Map<String, Value>, host: &mut Host<'_>) -> Result<W::Out, Problem> {
    let mut asked: CommandRequest<Analyze, Sources> = CommandRequest::read(request)?;
    asked.options.input.given = asked.given;
    let read = asked.options.input.read(asked.files.sources)?;
    let judged = analyze(&asked.options, &read, host)?;
    let wanted = asked.options.certificate;
    let certificate = wanted.then(|| certificate(&asked.options, &read)).transpose()?;
    let reduced = asked.options.reduced.then(|| reduced_model(&asked.options, &read)).transpose()?;
    W::whole(judged, true, move |_, _| {
        let own = certificate.clone().into_iter().chain(reduced.clone());
        Ok(position_figures(&read).into_iter().chain(own).collect())
    })
}

/// A simulated run.
fn simulated<W: OutputForm>(request: Map<String, Value>) -> Result<W::Out, Problem> {
    let mut asked: CommandRequest<Simulate, Sources> = CommandRequest::read(request)?;
    asked.options.input.given = asked.given;
    let input = asked.options.input.read_one(asked.files.sources)?;
    let (run, traces) = simulate(&asked.options, &input)?;
    W::whole(run, true, move |run, pictures| Ok(simulation_files(run, &traces, pictures)?))
}

/// Evidence on a scheme or a model.
fn crosschecked<W: OutputForm>(request: Map<String, Value>, host: &mut Host<'_>) -> Result<W::Out, Problem> {
    let mut asked: CommandRequest<Crosscheck, Sources> = CommandRequest::read(request)?;
    asked.options.input.given = asked.given;
    let input = asked.options.input.read_one(asked.files.sources)?;
    let evidence = crosscheck(&asked.options, &input, host)?;
    let passed = evidence.passed();
    W::whole(evidence, passed, drawn(crosscheck_files))
}

/// The sheet of a run.
fn planned<W: OutputForm>(request: Map<String, Value>) -> Result<W::Out, Problem> {
    let mut asked: CommandRequest<ProcedureRequest, Planning> = CommandRequest::read(request)?;
    asked.options.input.given = asked.given;
    let Planning { sources, rotations } = asked.files;
    let planned = procedure(&asked.options, sources, rotations.as_ref())?;
    let passed = planned.sheet.executable;
    W::whole(planned.sheet.clone(), passed, move |_, _| planned.files())
}

/// A calibration from records that are texts.
fn calibrated_from_texts<W: OutputForm>(
    request: Map<String, Value>,
    host: &mut Host<'_>,
) -> Result<W::Out, Problem> {
    let mut asked: CommandRequest<Calibrate, RecordFiles> = CommandRequest::read(request)?;
    asked.options.given = asked.given;
    let RecordFiles { sources, records, before } = asked.files;
    let source = one(sources)?;
    let records = records.into_iter().map(of_text).collect::<Result<_, _>>()?;
    calibrated::<W>(&asked.options, source, records, before.as_ref(), host)
}

/// Found schemes, or sets of outputs.
fn designed<W: OutputForm>(request: Map<String, Value>, host: &mut Host<'_>) -> Result<W::Out, Problem> {
    let asked: CommandRequest<Search, SearchFiles> = CommandRequest::read(request)?;
    match design(&asked.options, &asked.files, host)? {
        Designed::Schemes(found) => W::whole(*found, true, |f, pictures| f.files(pictures)),
        Designed::SlewSequence(found) => W::whole(*found, true, |f, _| Ok(f.files())),
        Designed::Outputs(found) => W::whole(*found, true, drawn(sensor_figures)),
        Designed::Next(found) => W::whole(*found, true, drawn(next_figures)),
        Designed::Part(part) => {
            let json = serde_json::to_string(&part).map_err(|e| Problem::internal(e.to_string()))?;
            W::text(json + "\n", part.complete)
        }
    }
}

/// The page of a review.
fn reviewed<W: OutputForm>(request: Map<String, Value>, host: &mut Host<'_>) -> Result<W::Out, Problem> {
    let mut asked: CommandRequest<Report, Pages> = CommandRequest::read(request)?;
    asked.options.given = asked.given.without("runs");
    let Pages { sources, calibrations, command } = asked.files;
    let origin = origin(command, sources.iter().chain(calibrations.iter().map(|c| &c.source)));
    let reviewed = report(&asked.options, read(sources)?, &calibrations, host)?;
    let files = reviewed.files(&origin, ReviewFormat::Html, &picture_folder("review"))?;
    let page = files.into_iter().next().map(|page| page.bytes).unwrap_or_default();
    W::text(String::from_utf8(page).map_err(|e| Problem::internal(e.to_string()))?, true)
}

/// Files of most commands: schemes and models.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Sources {
    sources: Vec<Source>,
}

/// Files of a sheet: a scheme, or a rotation table.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Planning {
    sources: Vec<Source>,
    rotations: Option<Source>,
}

/// Files of a calibration.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct RecordFiles {
    sources: Vec<Source>,
    records: Vec<Source>,
    before: Option<Source>,
}

/// Record of a request for the noise of sensors.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct StaticRecords {
    records: Vec<Source>,
}

/// Record from a text.
fn of_text(r: Source) -> Result<Record, Problem> {
    let bytes = std::io::Cursor::new(r.text.into_bytes());
    Record::csv(&r.name, Box::new(bytes)).map_err(|e| Problem::input(e.to_string()))
}

/// Files of a review, and the command line that it names.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Pages {
    sources: Vec<Source>,
    calibrations: Vec<CalibrationFile>,
    command: String,
}

/// Files of a command that reads none.
#[derive(Default, Serialize, Deserialize)]
struct NoFiles {}

/// Options and files of a command, and the given options that concern one kind of file only.
struct CommandRequest<O, F> {
    options: O,
    files: F,
    given: Given,
}

impl<O, F> CommandRequest<O, F>
where
    O: Default + Serialize + DeserializeOwned,
    F: Default + Serialize + DeserializeOwned,
{
    /// Splits a JSON object into options and files; refuses other names.
    fn read(request: Map<String, Value>) -> Result<Self, Problem> {
        let options = names(&O::default())?;
        let known = names(&F::default())?;
        let (mut asked, mut files) = (Map::new(), Map::new());
        for (name, value) in request {
            match (options.contains(&name), known.contains(&name)) {
                // null is the same as no option
                (true, _) if value.is_null() => {}
                (true, _) => drop(asked.insert(name, value)),
                (_, true) => drop(files.insert(name, value)),
                _ => {
                    let all: Vec<&str> = options.iter().chain(&known).map(String::as_str).collect();
                    return Err(Problem::input(format!(
                        "there is no option `{name}` here; expected one of {}",
                        all.join(", ")
                    )));
                }
            }
        }
        let given = Given::of(asked.keys().map(|name| (name.as_str(), name.clone())));
        Ok(Self { options: typed(asked)?, files: typed(files)?, given })
    }
}

/// Names of the fields of a struct of options or files.
fn names(of: &impl Serialize) -> Result<Vec<String>, Problem> {
    match serde_json::to_value(of) {
        Ok(Value::Object(map)) => Ok(map.into_iter().map(|(name, _)| name).collect()),
        other => Err(Problem::internal(format!("options are {other:?}"))),
    }
}

/// Options from JSON; an error names the option whose value has the wrong type.
fn typed<T: DeserializeOwned>(map: Map<String, Value>) -> Result<T, Problem> {
    let alone = map.clone();
    serde_json::from_value(Value::Object(map)).map_err(|e| {
        let wrong = alone.into_iter().find_map(|(name, value)| {
            let one = Map::from_iter([(name.clone(), value)]);
            serde_json::from_value::<T>(Value::Object(one))
                .err()
                .map(|e| format!("{name}: {}", explain_message(&e.to_string())))
        });
        Problem::input(wrong.unwrap_or_else(|| explain_message(&e.to_string())))
    })
}

/// Reads schemes and models from texts.
fn read(sources: Vec<Source>) -> Result<Vec<NamedInput>, Problem> {
    if sources.is_empty() {
        return Err(Problem::input("nothing to judge; expected schemes or models as sources"));
    }
    sources.into_iter().map(Source::read).collect()
}

/// Picture of the positions of every scheme.
fn position_figures(read: &[NamedInput]) -> Vec<File> {
    let mut files = Vec::new();
    for (name, input) in read {
        let Input::Scheme(scheme) = input else { continue };
        let mut file = position_figure(scheme);
        if read.len() > 1 {
            file.name = format!("{}-{}", title(name), file.name);
        }
        files.push(file);
    }
    files
}

/// Calibrates from records that are no texts; `request` is as in [`call`], without `records`.
///
/// # Errors
/// Defect of the request or of a record.
pub fn call_calibrate(request: &str, records: Vec<Record>, host: &mut Host<'_>) -> Result<Answered, Problem> {
    let answer = || {
        let mut asked: CommandRequest<Calibrate, RecordFiles> = CommandRequest::read(object(request)?)?;
        asked.options.given = asked.given;
        let source = one(asked.files.sources)?;
        calibrated::<AllFormats>(&asked.options, source, records, asked.files.before.as_ref(), host)
    };
    answer().map_err(in_snake_case)
}

/// Noise of sensors in a record that is no text; `request` is as in [`call`], without `records`.
///
/// # Errors
/// Defect of the request or of the record.
pub fn call_allan(request: &str, records: Vec<Record>, host: &mut Host<'_>) -> Result<Answered, Problem> {
    let answer = || {
        let asked: CommandRequest<Allan, StaticRecords> = CommandRequest::read(object(request)?)?;
        noise_of::<AllFormats>(&asked.options, records, host)
    };
    answer().map_err(in_snake_case)
}

fn noise_of<W: OutputForm>(
    options: &Allan,
    records: Vec<Record>,
    host: &Host<'_>,
) -> Result<W::Out, Problem> {
    let found = records.len();
    let [record] = <[Record; 1]>::try_from(records)
        .map_err(|_| Problem::input(format!("found {found} records; expected one of sensors at rest")))?;
    let found = allan(options, record, host)?;
    let passed = found.columns.iter().all(|c| c.explained);
    W::whole(found, passed, |found, _| Ok(allan_files(found)?))
}

fn calibrated<W: OutputForm>(
    options: &Calibrate,
    source: Source,
    records: Vec<Record>,
    before: Option<&Source>,
    host: &Host<'_>,
) -> Result<W::Out, Problem> {
    let found = calibrate(options, source.read()?, records, before, host)?;
    let passed = found.passed();
    W::whole(found, passed, |found, pictures| Ok(found.files(pictures)?))
}

fn one(sources: Vec<Source>) -> Result<Source, Problem> {
    let found = sources.len();
    match <[Source; 1]>::try_from(sources) {
        Ok([source]) => Ok(source),
        Err(_) => Err(Problem::input(format!("found {found} files; expected one scheme or model"))),
    }
}

/// Parses a request, which is a JSON object.
fn object(request: &str) -> Result<Map<String, Value>, Problem> {
    match serde_json::from_str(request) {
        Ok(Value::Object(request)) => Ok(request),
        Ok(_) => Err(Problem::input("the request is no JSON object; expected options by their names")),
        Err(e) => Err(Problem::input(format!("the request is no JSON: {e}"))),
    }
}

/// Renames the options in a message from the command line's form to that of JSON: `--slew-rate` to
/// `slew_rate`.
fn in_snake_case(mut problem: Problem) -> Problem {
    let mut out = String::with_capacity(problem.message.len());
    let mut rest = problem.message.as_str();
    while let Some(at) = rest.find("--") {
        let (before, option) = rest.split_at(at);
        out.push_str(before);
        let option = &option[2..];
        let end = option.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(option.len());
        match before.chars().next_back().is_none_or(|c| !c.is_alphanumeric()) && end > 0 {
            true => out.push_str(&option[..end].replace('-', "_")),
            false => out.push_str(&format!("--{}", &option[..end])),
        }
        rest = &option[end..];
    }
    out.push_str(rest);
    problem.message = out;
    problem
}

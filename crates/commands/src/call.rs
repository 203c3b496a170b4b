//! A command by its name, its options and files as JSON: how other languages ask.

use obsdeg_calibration::record::Record;
use obsdeg_report::{
    Answer, File, Format, Layout, ReviewFormat, csv, fragment, picture_folder, position_figure, written,
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
use crate::design::{Designed, Search, SearchFiles, design};
use crate::host::Host;
use crate::paper::{Paper, paper};
use crate::problem::Problem;
use crate::report::{CalibrationFile, Report, origin, report};
use crate::simulate::{Simulate, files as simulation_files, simulate};
use crate::source::{Input, Named, Source, title};

/// The commands.
pub const COMMANDS: [&str; 9] =
    ["analyze", "simulate", "crosscheck", "calibrate", "allan", "compare", "design", "report", "paper"];

/// An answer, whatever it is of.
pub trait Rendered: Send + Sync {
    /// Name and version of the layout of the JSON (`obsdeg.analysis/1`); none of lists of answers and of
    /// texts.
    fn layout(&self) -> Option<&str>;

    /// What the command line prints with `--format`, byte for byte; a report is a page in any format.
    ///
    /// # Errors
    /// What cannot be written.
    fn written(&self, format: Format) -> Result<String, Problem>;

    /// One of the lists of the JSON as CSV (`--table`); the main one where none is named.
    ///
    /// # Errors
    /// A table that there is not.
    fn table(&self, name: Option<&str>) -> Result<String, Problem>;

    /// A part of an HTML page: tables and formulas that read without scripts.
    ///
    /// # Errors
    /// What cannot be written.
    fn fragment(&self) -> Result<String, Problem>;

    /// What goes into a folder beside the JSON: figures, series, schemes that were found.
    ///
    /// # Errors
    /// What cannot be drawn.
    fn files(&self) -> Result<Vec<File>, Problem>;
}

/// An answer to whoever asked in JSON.
pub struct Answered {
    /// The answer.
    pub answer: Box<dyn Rendered>,
    /// True if the command line would exit with 0: false where something disagrees or is not explained.
    pub passed: bool,
}

impl Answered {
    /// What the command line prints with `--format json`, byte for byte; of a report the page, of a part of a
    /// search the file.
    ///
    /// # Errors
    /// What cannot be written.
    pub fn text(&self) -> Result<String, Problem> {
        self.answer.written(Format::Json)
    }
}

/// An answer, and the files that belong to it.
struct Whole<A, F> {
    answer: A,
    files: F,
}

impl<A, F> Rendered for Whole<A, F>
where
    A: Answer + Send + Sync,
    F: Fn(&A) -> Result<Vec<File>, Problem> + Send + Sync,
{
    fn layout(&self) -> Option<&str> {
        self.answer.layout()
    }

    fn written(&self, format: Format) -> Result<String, Problem> {
        Ok(written(&self.answer, format, Layout::default())?)
    }

    fn table(&self, name: Option<&str>) -> Result<String, Problem> {
        Ok(csv(&self.answer, name)?)
    }

    fn fragment(&self) -> Result<String, Problem> {
        Ok(fragment(&self.answer)?)
    }

    fn files(&self) -> Result<Vec<File>, Problem> {
        (self.files)(&self.answer)
    }
}

/// A text that is what it is: the page of a report, a part of a search.
struct Text(String);

impl Rendered for Text {
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

    fn files(&self) -> Result<Vec<File>, Problem> {
        Ok(Vec::new())
    }
}

/// No files belong to an answer.
fn none<A>(_: &A) -> Result<Vec<File>, Problem> {
    Ok(Vec::new())
}

/// What becomes of an answer.
trait Wanted {
    type Out;

    fn whole<A: Answer + Send + Sync + 'static>(
        answer: A,
        passed: bool,
        files: impl Fn(&A) -> Result<Vec<File>, Problem> + Send + Sync + 'static,
    ) -> Result<Self::Out, Problem>;

    fn text(text: String, passed: bool) -> Result<Self::Out, Problem>;
}

/// All of it is kept.
struct All;

impl Wanted for All {
    type Out = Answered;

    fn whole<A: Answer + Send + Sync + 'static>(
        answer: A,
        passed: bool,
        files: impl Fn(&A) -> Result<Vec<File>, Problem> + Send + Sync + 'static,
    ) -> Result<Answered, Problem> {
        Ok(Answered { answer: Box::new(Whole { answer, files }), passed })
    }

    fn text(text: String, passed: bool) -> Result<Answered, Problem> {
        Ok(Answered { answer: Box::new(Text(text)), passed })
    }
}

/// An answer as JSON.
pub struct InJson {
    /// The JSON, as the command line prints it.
    pub text: String,
    /// The answer in sentences ([`Answer::sentences`]).
    pub sentences: Vec<String>,
    /// True if the command line would exit with 0.
    pub passed: bool,
}

/// Only its text: a program that asks for no more holds no writer of anything else.
struct JsonOnly;

impl Wanted for JsonOnly {
    type Out = InJson;

    fn whole<A: Answer + Send + Sync + 'static>(
        answer: A,
        passed: bool,
        _: impl Fn(&A) -> Result<Vec<File>, Problem> + Send + Sync + 'static,
    ) -> Result<Self::Out, Problem> {
        Ok(InJson { text: obsdeg_report::json(&answer)?, sentences: answer.sentences(), passed })
    }

    fn text(text: String, passed: bool) -> Result<Self::Out, Problem> {
        Ok(InJson { text, sentences: Vec::new(), passed })
    }
}

/// The text of an answer ([`Answered::text`]) and its sentences alone, and whether the command line would
/// exit with 0.
///
/// # Errors
/// As [`call`].
pub fn call_json(command: &str, request: &str, host: &mut Host<'_>) -> Result<InJson, Problem> {
    object(request).and_then(|request| answered::<JsonOnly>(command, request, host)).map_err(in_snake_case)
}

/// Answers a command. `request` is a JSON object with its options, named as on the command line in snake
/// case, and with its files, each a `{"name": ..., "text": ...}`: `sources` are the schemes and models;
/// `calibrate` has `records` and `before` too, `report` `calibrations`, and `design` has `candidates_file`,
/// `merge` and `resume`.
///
/// # Errors
/// What is wrong with the request; options are named in snake case.
pub fn call(command: &str, request: &str, host: &mut Host<'_>) -> Result<Answered, Problem> {
    object(request).and_then(|request| answered::<All>(command, request, host)).map_err(in_snake_case)
}

fn answered<W: Wanted>(
    command: &str,
    request: Map<String, Value>,
    host: &mut Host<'_>,
) -> Result<W::Out, Problem> {
    match command {
        "analyze" => {
            let mut asked: Request<Analyze, Sources> = Request::read(request)?;
            asked.options.input.given = asked.given;
            let read = asked.options.input.read(asked.files.sources)?;
            let judged = analyze(&asked.options, &read, host)?;
            let wanted = asked.options.certificate;
            let certificate = wanted.then(|| certificate(&asked.options, &read)).transpose()?;
            let reduced = asked.options.reduced.then(|| reduced_model(&asked.options, &read)).transpose()?;
            W::whole(judged, true, move |_| {
                let own = certificate.clone().into_iter().chain(reduced.clone());
                Ok(position_figures(&read).into_iter().chain(own).collect())
            })
        }
        "simulate" => {
            let mut asked: Request<Simulate, Sources> = Request::read(request)?;
            asked.options.input.given = asked.given;
            let input = asked.options.input.read_one(asked.files.sources)?;
            let (run, traces) = simulate(&asked.options, &input)?;
            W::whole(run, true, move |run| Ok(simulation_files(run, &traces)?))
        }
        "crosscheck" => {
            let mut asked: Request<Crosscheck, Sources> = Request::read(request)?;
            asked.options.input.given = asked.given;
            let input = asked.options.input.read_one(asked.files.sources)?;
            let evidence = crosscheck(&asked.options, &input, host)?;
            let passed = evidence.passed();
            W::whole(evidence, passed, |e| Ok(crosscheck_files(e)?))
        }
        "calibrate" => {
            let mut asked: Request<Calibrate, Records> = Request::read(request)?;
            asked.options.given = asked.given;
            let Records { sources, records, before } = asked.files;
            let source = one(sources)?;
            let records = records.into_iter().map(of_text).collect::<Result<_, _>>()?;
            calibrated::<W>(&asked.options, source, records, before.as_ref(), host)
        }
        "allan" => {
            let asked: Request<Allan, StaticRecords> = Request::read(request)?;
            let records = asked.files.records.into_iter().map(of_text).collect::<Result<_, _>>()?;
            noise_of::<W>(&asked.options, records, host)
        }
        "compare" => {
            let asked: Request<Compare, Sources> = Request::read(request)?;
            W::whole(compare(&asked.options, read(asked.files.sources)?)?, true, none)
        }
        "design" => {
            let asked: Request<Search, SearchFiles> = Request::read(request)?;
            match design(&asked.options, &asked.files, host)? {
                Designed::Schemes(found) => W::whole(*found, true, |f| f.files()),
                Designed::Walks(found) => W::whole(*found, true, |f| Ok(f.files())),
                Designed::Outputs(found) => W::whole(*found, true, none),
                Designed::Next(found) => W::whole(*found, true, none),
                Designed::Part(part) => {
                    let json = serde_json::to_string(&part).map_err(|e| Problem::internal(e.to_string()))?;
                    W::text(json + "\n", part.complete)
                }
            }
        }
        "report" => {
            let mut asked: Request<Report, Pages> = Request::read(request)?;
            asked.options.given = asked.given.without("runs");
            let Pages { sources, calibrations, command } = asked.files;
            let origin = origin(command, sources.iter().chain(calibrations.iter().map(|c| &c.source)));
            let reviewed = report(&asked.options, read(sources)?, &calibrations, host)?;
            let files = reviewed.files(&origin, ReviewFormat::Html, &picture_folder("review"))?;
            let page = files.into_iter().next().map(|page| page.bytes).unwrap_or_default();
            W::text(String::from_utf8(page).map_err(|e| Problem::internal(e.to_string()))?, true)
        }
        "paper" => {
            let asked: Request<Paper, NoFiles> = Request::read(request)?;
            W::whole(paper(&asked.options)?, true, none)
        }
        _ => {
            Err(Problem::input(format!("`{command}` is no command; expected one of {}", COMMANDS.join(", "))))
        }
    }
}

/// The schemes and models that most commands are about.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Sources {
    sources: Vec<Source>,
}

/// What a calibration reads.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Records {
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

/// A record that is a text.
fn of_text(r: Source) -> Result<Record, Problem> {
    let bytes = std::io::Cursor::new(r.text.into_bytes());
    Record::csv(&r.name, Box::new(bytes)).map_err(|e| Problem::input(e.to_string()))
}

/// What a review reads, and the command that it names.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct Pages {
    sources: Vec<Source>,
    calibrations: Vec<CalibrationFile>,
    command: String,
}

/// Nothing is read.
#[derive(Default, Serialize, Deserialize)]
struct NoFiles {}

/// Options and files of a command, and which options were given.
struct Request<O, F> {
    options: O,
    files: F,
    given: Given,
}

impl<O, F> Request<O, F>
where
    O: Default + Serialize + DeserializeOwned,
    F: Default + Serialize + DeserializeOwned,
{
    /// Takes an object apart; what it has no name for is refused.
    fn read(request: Map<String, Value>) -> Result<Self, Problem> {
        let options = names(&O::default())?;
        let known = names(&F::default())?;
        let (mut asked, mut files) = (Map::new(), Map::new());
        for (name, value) in request {
            match (options.contains(&name), known.contains(&name)) {
                // as if it were not there
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

/// The names of the options of something.
fn names(of: &impl Serialize) -> Result<Vec<String>, Problem> {
    match serde_json::to_value(of) {
        Ok(Value::Object(map)) => Ok(map.into_iter().map(|(name, _)| name).collect()),
        other => Err(Problem::internal(format!("options are {other:?}"))),
    }
}

/// Options of their types; where one has another its name is in the error.
fn typed<T: DeserializeOwned>(map: Map<String, Value>) -> Result<T, Problem> {
    let alone = map.clone();
    serde_json::from_value(Value::Object(map)).map_err(|e| {
        let wrong = alone.into_iter().find_map(|(name, value)| {
            let one = Map::from_iter([(name.clone(), value)]);
            serde_json::from_value::<T>(Value::Object(one)).err().map(|e| format!("{name}: {e}"))
        });
        Problem::input(wrong.unwrap_or_else(|| e.to_string()))
    })
}

/// The schemes and models in texts.
fn read(sources: Vec<Source>) -> Result<Vec<Named>, Problem> {
    if sources.is_empty() {
        return Err(Problem::input("nothing to judge; expected schemes or models as sources"));
    }
    sources.into_iter().map(Source::read).collect()
}

/// The positions of every scheme as a picture.
fn position_figures(read: &[Named]) -> Vec<File> {
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

/// A calibration from records that are no texts, as [`call`] gives one of texts: `request` has all but
/// `records`.
///
/// # Errors
/// What is wrong with the request or a record.
pub fn call_calibrate(request: &str, records: Vec<Record>, host: &mut Host<'_>) -> Result<Answered, Problem> {
    let answer = || {
        let mut asked: Request<Calibrate, Records> = Request::read(object(request)?)?;
        asked.options.given = asked.given;
        let source = one(asked.files.sources)?;
        calibrated::<All>(&asked.options, source, records, asked.files.before.as_ref(), host)
    };
    answer().map_err(in_snake_case)
}

/// The noise of sensors in a record that is no text, as [`call`] gives it of texts: `request` has all but
/// `records`.
///
/// # Errors
/// What is wrong with the request or the record.
pub fn call_allan(request: &str, records: Vec<Record>, host: &mut Host<'_>) -> Result<Answered, Problem> {
    let answer = || {
        let asked: Request<Allan, StaticRecords> = Request::read(object(request)?)?;
        noise_of::<All>(&asked.options, records, host)
    };
    answer().map_err(in_snake_case)
}

fn noise_of<W: Wanted>(options: &Allan, records: Vec<Record>, host: &Host<'_>) -> Result<W::Out, Problem> {
    let found = records.len();
    let [record] = <[Record; 1]>::try_from(records)
        .map_err(|_| Problem::input(format!("found {found} records; expected one of sensors at rest")))?;
    let found = allan(options, record, host)?;
    let passed = found.columns.iter().all(|c| c.explained);
    W::whole(found, passed, |found| Ok(allan_files(found)?))
}

fn calibrated<W: Wanted>(
    options: &Calibrate,
    source: Source,
    records: Vec<Record>,
    before: Option<&Source>,
    host: &Host<'_>,
) -> Result<W::Out, Problem> {
    let found = calibrate(options, source.read()?, records, before, host)?;
    let passed = found.passed();
    W::whole(found, passed, |found| Ok(found.files()?))
}

fn one(sources: Vec<Source>) -> Result<Source, Problem> {
    let found = sources.len();
    match <[Source; 1]>::try_from(sources) {
        Ok([source]) => Ok(source),
        Err(_) => Err(Problem::input(format!("found {found} files; expected one scheme or model"))),
    }
}

/// The object that a request is.
fn object(request: &str) -> Result<Map<String, Value>, Problem> {
    match serde_json::from_str(request) {
        Ok(Value::Object(request)) => Ok(request),
        Ok(_) => Err(Problem::input("the request is no JSON object; expected options by their names")),
        Err(e) => Err(Problem::input(format!("the request is no JSON: {e}"))),
    }
}

/// Options in words as JSON names them: `--slew-rate` is `slew_rate`.
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

//! A command by its name, its options and files as JSON: how other languages ask.

use obsdeg_calibration::record::Record;
use obsdeg_report::{Answer, Format, Layout, ReviewFormat, picture_folder, written};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::analyze::{Analyze, analyze};
use crate::arguments::Given;
use crate::calibrate::{Calibrate, calibrate};
use crate::compare::{Compare, compare};
use crate::crosscheck::{Crosscheck, crosscheck};
use crate::design::{Designed, Search, SearchFiles, design};
use crate::host::Host;
use crate::paper::{Paper, paper};
use crate::problem::Problem;
use crate::report::{CalibrationFile, Report, origin, report};
use crate::simulate::{Simulate, simulate};
use crate::source::{Named, Source};

/// The commands.
pub const COMMANDS: [&str; 8] =
    ["analyze", "simulate", "crosscheck", "calibrate", "compare", "design", "report", "paper"];

/// An answer to whoever asked in JSON.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answered {
    /// What the command line prints with `--format json`, byte for byte; of a report the page.
    pub text: String,
    /// Whether the command line would exit with 0: false where something disagrees or is not explained.
    pub passed: bool,
}

/// Answers a command. `request` is a JSON object with its options, named as on the command line in snake case, and with its files,
/// each a `{"name": ..., "text": ...}`: `sources` are the schemes and models; `calibrate` has `records` and `before` too, `report`
/// `calibrations`, and `design` has `candidates_file`, `merge` and `resume`.
///
/// # Errors
/// What is wrong with the request; options are named in snake case.
pub fn call(command: &str, request: &str, host: &mut Host<'_>) -> Result<Answered, Problem> {
    let request: Value =
        serde_json::from_str(request).map_err(|e| Problem::input(format!("the request is no JSON: {e}")))?;
    match request {
        Value::Object(request) => answered(command, request, host).map_err(in_snake_case),
        _ => Err(Problem::input("the request is no JSON object; expected options by their names")),
    }
}

fn answered(command: &str, request: Map<String, Value>, host: &mut Host<'_>) -> Result<Answered, Problem> {
    match command {
        "analyze" => {
            let mut asked: Request<Analyze, Sources> = Request::read(request)?;
            asked.options.input.given = asked.given;
            let read = asked.options.input.read(asked.files.sources)?;
            json(&analyze(&asked.options, &read, host)?, true)
        }
        "simulate" => {
            let mut asked: Request<Simulate, Sources> = Request::read(request)?;
            asked.options.input.given = asked.given;
            let input = asked.options.input.read_one(asked.files.sources)?;
            json(&simulate(&asked.options, &input)?.0, true)
        }
        "crosscheck" => {
            let mut asked: Request<Crosscheck, Sources> = Request::read(request)?;
            asked.options.input.given = asked.given;
            let input = asked.options.input.read_one(asked.files.sources)?;
            let evidence = crosscheck(&asked.options, &input, host)?;
            json(&evidence, evidence.passed())
        }
        "calibrate" => {
            let mut asked: Request<Calibrate, Records> = Request::read(request)?;
            asked.options.given = asked.given;
            let Records { sources, records, before } = asked.files;
            let found = sources.len();
            let Ok([source]) = <[Source; 1]>::try_from(sources) else {
                return Err(Problem::input(format!("found {found} files; expected one scheme or model")));
            };
            let record = |r: Source| {
                let bytes = std::io::Cursor::new(r.text.into_bytes());
                Record::stream(&r.name, Box::new(bytes)).map_err(|e| Problem::input(e.to_string()))
            };
            let records = records.into_iter().map(record).collect::<Result<_, _>>()?;
            let found = calibrate(&asked.options, source.read()?, records, before.as_ref(), host)?;
            json(&found, found.passed())
        }
        "compare" => {
            let asked: Request<Compare, Sources> = Request::read(request)?;
            json(&compare(&asked.options, read(asked.files.sources)?)?, true)
        }
        "design" => {
            let asked: Request<Search, SearchFiles> = Request::read(request)?;
            match design(&asked.options, &asked.files, host)? {
                Designed::Schemes(found) => json(&*found, true),
                Designed::Walks(found) => json(&*found, true),
                Designed::Part(part) => {
                    let text = serde_json::to_string(&part).map_err(|e| Problem::internal(e.to_string()))?;
                    Ok(Answered { text: text + "\n", passed: part.complete })
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
            let text = String::from_utf8(page).map_err(|e| Problem::internal(e.to_string()))?;
            Ok(Answered { text, passed: true })
        }
        "paper" => {
            let asked: Request<Paper, NoFiles> = Request::read(request)?;
            json(&paper(&asked.options)?, true)
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

fn json(answer: &impl Answer, passed: bool) -> Result<Answered, Problem> {
    Ok(Answered { text: written(answer, Format::Json, Layout::default())?, passed })
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

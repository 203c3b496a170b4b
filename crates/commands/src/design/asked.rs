//! Request of a search, as its parts state it.

use obsdeg_core::model::Scheme;
use obsdeg_design::design::{Design, DesignOptions, Part, Progress, certify_optimum};
use obsdeg_evidence::simulation::Conditions;
use obsdeg_report::File;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::options::{Search, SearchFiles};
use crate::problem::Problem;
use crate::source::Source;

/// Certificate of a proven optimum, as a file.
pub(super) fn proof(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    found: &Design,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<File, Problem> {
    let certificate = certify_optimum(base, conditions, options, found, progress)?;
    // one block per line
    let text = serde_json::to_string(&certificate).map_err(no_json)?.replace("{\"start\"", "\n{\"start\"");
    Ok(File { name: "certificate.json".into(), bytes: (text + "\n").into_bytes() })
}

/// Options and files of a part, as its file keeps them for the merge.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Asked {
    pub(super) options: Search,
    conditions_file: Option<Source>,
    candidates_file: Option<Source>,
}

impl Asked {
    /// Options and files as JSON text, without options that have their default.
    pub(super) fn of(a: &Search, files: &SearchFiles) -> Result<String, Problem> {
        let mut asked = serde_json::Map::new();
        asked.insert("options".into(), Value::Object(stated(&Search { part: None, ..a.clone() })?));
        let of_files =
            [("conditions_file", &files.conditions_file), ("candidates_file", &files.candidates_file)];
        for (name, file) in of_files {
            if let Some(file) = file {
                asked.insert(name.into(), serde_json::to_value(file).map_err(no_json)?);
            }
        }
        Ok(Value::Object(asked).to_string())
    }

    /// Given files, else those of the part.
    pub(super) fn files(&self, given: &SearchFiles) -> SearchFiles {
        SearchFiles {
            conditions_file: given.conditions_file.clone().or_else(|| self.conditions_file.clone()),
            candidates_file: given.candidates_file.clone().or_else(|| self.candidates_file.clone()),
            merge: Vec::new(),
            resume: given.resume.clone(),
            after: None,
        }
    }
}

fn no_json(e: serde_json::Error) -> Problem {
    Problem::internal(e.to_string())
}

/// Options without those that have their default, as JSON.
pub(super) fn stated(a: &Search) -> Result<serde_json::Map<String, Value>, Problem> {
    let object = |a: &Search| serde_json::to_value(a).map_err(no_json);
    let (all, none) = (object(a)?, object(&Search::default())?);
    let differs = |(name, value): &(&String, &Value)| none.get(name) != Some(value);
    Ok(all.as_object().into_iter().flatten().filter(differs).map(|(n, v)| (n.clone(), v.clone())).collect())
}

/// Options and files of a search. At a merge: those of the parts, overridden by the given options. For a
/// scheme file alone: as many positions as it has.
pub(super) fn known(a: &Search, files: &SearchFiles) -> Result<Asked, Problem> {
    let mut asked = Asked { options: a.clone(), ..Asked::default() };
    if let Some(first) = files.merge.first()
        && let Some(of_part) = read_part(first)?.asked
    {
        let wrong = |e: serde_json::Error| Problem::input(format!("{}: its options: {e}", first.name));
        asked = serde_json::from_str(&of_part).map_err(wrong)?;
        let mut options = stated(&asked.options)?;
        options.extend(stated(a)?);
        asked.options = serde_json::from_value(Value::Object(options)).map_err(no_json)?;
    }
    if let (None, false, Some(file)) =
        (asked.options.positions, asked.options.minimum, &files.conditions_file)
    {
        asked.options.positions = Some(file.scheme()?.positions.len());
    }
    Ok(asked)
}

/// Reads a part of a search; refuses a file that was changed after it was written.
pub(super) fn read_part(part: &Source) -> Result<Part, Problem> {
    let named = |why: String| Problem::input(format!("{}: {why}", part.name));
    let read: Part = serde_json::from_str(&part.text).map_err(|e| {
        let expected = "expected the file that `obsdeg design --part` wrote";
        named(format!("it is no part of a search ({e}); {expected}"))
    })?;
    read.unchanged().map_err(|why| named(why.to_string()))?;
    Ok(read)
}

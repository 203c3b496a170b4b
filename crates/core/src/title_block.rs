//! Title block of the document that a scheme or a model is reviewed in.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// Largest number of characters of an entry, and of signatures.
const MOST: usize = 200;
const SIGNATURES: usize = 6;

/// Title block of a review, as the file states it: nothing of it comes from the clock or from the computer.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TitleBlock {
    /// Number or reference of the document; empty when left out.
    pub reference: String,
    /// Revision of the document, such as `B`; empty when left out.
    pub revision: String,
    /// Date of the document, as a text or a date of TOML; empty when left out.
    #[serde(deserialize_with = "date")]
    pub date: String,
    /// Author of the document; empty when left out.
    pub author: String,
    /// Roles that sign the document, such as `["Checked", "Approved"]`: a line for each in a review.
    pub signatures: Vec<String>,
}

/// Date as text.
fn date<'de, D: Deserializer<'de>>(d: D) -> Result<String, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Date {
        Text(String),
        Date(toml::value::Datetime),
    }
    Ok(match Date::deserialize(d)? {
        Date::Text(text) => text,
        Date::Date(date) => date.to_string(),
    })
}

impl TitleBlock {
    /// Entries with their names, those that are stated.
    pub fn entries(&self) -> Vec<(&'static str, &str)> {
        let all = [
            ("reference", &self.reference),
            ("revision", &self.revision),
            ("date", &self.date),
            ("author", &self.author),
        ];
        all.into_iter()
            .filter(|(_, text)| !text.is_empty())
            .map(|(name, text)| (name, text.as_str()))
            .collect()
    }

    /// Error of an entry that is blank or too long, or of too many signatures.
    pub(crate) fn wrong(&self) -> Option<String> {
        let signatures = self.signatures.iter().map(|s| ("signatures", s.as_str()));
        for (name, text) in self.entries().into_iter().chain(signatures) {
            let found = text.chars().count();
            if text.trim().is_empty() {
                return Some(format!("{name} is blank; expected a text, or leave it out"));
            }
            if found > MOST {
                return Some(format!("{name} has {found} characters; expected at most {MOST}"));
            }
        }
        let found = self.signatures.len();
        (found > SIGNATURES).then(|| format!("{found} signatures; expected at most {SIGNATURES}"))
    }
}

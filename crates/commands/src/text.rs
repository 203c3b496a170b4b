//! Options in JSON as on the command line: their texts, or numbers, which are read as their shortest texts.

use std::fmt::Display;
use std::str::FromStr;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serializer};

/// A text, or a number.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a text or a number")]
enum TextOrNumber {
    Written(String),
    Whole(i64),
    Number(f64),
}

impl TextOrNumber {
    fn read<T: FromStr<Err: Display>, E: Error>(self) -> Result<T, E> {
        let text = match self {
            Self::Written(text) => text,
            Self::Whole(n) => n.to_string(),
            Self::Number(x) => x.to_string(),
        };
        text.parse().map_err(|e| E::custom(e))
    }
}

pub(crate) fn serialize<T: Display, S: Serializer>(value: &Option<T>, to: S) -> Result<S::Ok, S::Error> {
    match value {
        Some(value) => to.collect_str(value),
        None => to.serialize_none(),
    }
}

pub(crate) fn deserialize<'de, T, D>(from: D) -> Result<Option<T>, D::Error>
where
    T: FromStr<Err: Display>,
    D: Deserializer<'de>,
{
    Option::<TextOrNumber>::deserialize(from)?.map(TextOrNumber::read).transpose()
}

/// Lists of such options.
pub(crate) mod list {
    use std::collections::BTreeMap;

    use super::{Deserialize, Deserializer, Display, FromStr, Serializer, TextOrNumber};

    /// Texts, or numbers by name: `["D=0.05"]` and `{"D": 0.05}` are the same.
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected a list of texts, or numbers by name")]
    enum List {
        List(Vec<TextOrNumber>),
        Named(BTreeMap<String, f64>),
    }

    pub(crate) fn serialize<T: Display, S: Serializer>(values: &[T], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(values.iter().map(ToString::to_string))
    }

    pub(crate) fn deserialize<'de, T, D>(from: D) -> Result<Vec<T>, D::Error>
    where
        T: FromStr<Err: Display>,
        D: Deserializer<'de>,
    {
        match List::deserialize(from)? {
            List::List(list) => list.into_iter().map(TextOrNumber::read).collect(),
            List::Named(named) => {
                let text = |(name, value): (String, f64)| TextOrNumber::Written(format!("{name}={value}"));
                named.into_iter().map(|pair| text(pair).read()).collect()
            }
        }
    }
}

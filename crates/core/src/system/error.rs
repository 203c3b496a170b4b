//! Error of a model that cannot be judged.

use std::ops::Range;

/// Largest number of characters of the place of a fault that is shown: a name may be as long as a file.
const LONGEST_PLACE: usize = 320;

fn shortened(place: &str) -> String {
    match place.char_indices().nth(LONGEST_PLACE) {
        Some((cut, _)) => format!("{}...", &place[..cut]),
        None => place.into(),
    }
}

/// Error of a model that cannot be judged: the place, the fault and the expectation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {message}", shortened(what))]
pub struct ModelError {
    /// Place of the fault in words, such as `the equation of x1`.
    pub what: String,
    /// Fault, and what was expected.
    pub message: String,
    /// Byte range in the file; `None` where it is not known.
    pub span: Option<Range<usize>>,
}

/// Place of a text in a model file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FilePlace {
    /// Description of the entry: `the equation of x1`.
    pub what: String,
    /// Byte offset in the file at which the text begins; `None` if it is unknown.
    pub offset: Option<usize>,
}

impl FilePlace {
    /// Error in the text of this place, at a byte range of it.
    pub fn error(&self, message: String, range: Range<usize>) -> ModelError {
        let span = self.offset.map(|o| o + range.start..o + range.end);
        ModelError { what: self.what.clone(), message, span }
    }
}

//! What a record is mistaken in, before anything is estimated.

/// A record that is not what it says it is.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Mistaken {
    /// Numbers of another unit.
    #[error(
        "{record}: line {line}, columns {columns}: at {position} the specific force is {length_g} g long by what the header says, expected about 1; with the numbers as {units} it is"
    )]
    ForceUnit {
        /// The record.
        record: String,
        /// The first line of the position.
        line: u64,
        /// The columns.
        columns: String,
        /// Where it is furthest from 1 g.
        position: String,
        /// What it is there.
        length_g: String,
        /// The units that the numbers are as of.
        units: String,
    },
    /// Rows of another unit than the others.
    #[error(
        "{record}: line {line}, columns {columns}: the specific force is {length_g} g long there; with these numbers as {units} it is as in the rows beside it{more}; expected every row in the units of the header"
    )]
    RowUnit {
        /// The record.
        record: String,
        /// The line of the first.
        line: u64,
        /// The columns.
        columns: String,
        /// What it is by what the header says.
        length_g: String,
        /// The units that these numbers are as of.
        units: String,
        /// How many more such rows there are, if any.
        more: String,
    },
    /// A force that is none of gravity.
    #[error(
        "{record}: line {line}: at {position} the specific force is {length_g} g long; expected about 1, and no unit of forces makes it that"
    )]
    ForceLength {
        /// The record.
        record: String,
        /// The first line of the position.
        line: u64,
        /// Where it is furthest from 1 g.
        position: String,
        /// What it is there.
        length_g: String,
    },
    /// Times of another unit.
    #[error(
        "{record}: column `{column}`: the first position lasts {found} s by what the header says, in the scheme {expected} s, and all others alike; with the numbers as [{unit}] they agree"
    )]
    TimeUnit {
        /// The record.
        record: String,
        /// The column.
        column: String,
        /// How long the first position lasts, in s.
        found: String,
        /// How long it does in the scheme.
        expected: String,
        /// The unit that the numbers are as of.
        unit: &'static str,
    },
    /// The platform leaves a position while samples are still said to be of it, or comes later.
    #[error(
        "{record}: between lines {from} and {to} the platform {what} {position}: the samples of {position} {side} that are up to {off_deg} deg from the others, as at {like}; expected positions (by label or by time) that begin and end where the platform does{clock}"
    )]
    Shifted {
        /// The record.
        record: String,
        /// It happens after this line.
        from: u64,
        /// And before this one.
        to: u64,
        /// The position.
        position: String,
        /// What happens.
        what: &'static str,
        /// Which samples are not of it.
        side: &'static str,
        /// How far the first or the last of them is from the others.
        off_deg: String,
        /// What position has such a force.
        like: String,
        /// What the clock of the record has to do with it.
        clock: String,
    },
}

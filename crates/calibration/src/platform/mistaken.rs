//! Contradictions within a record, found before anything is estimated.

/// Contradiction between a record and its header or labels.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Mistaken {
    /// Numbers of another unit.
    #[error(
        "{record}: line {line}, columns {columns}: at {position} the specific force is {length_g} g long by \
         what the header says, expected about 1; with the numbers as {units} it is"
    )]
    ForceUnit {
        /// Name of the record.
        record: String,
        /// First line of the position.
        line: u64,
        /// Names of the columns.
        columns: String,
        /// Name of the position farthest from 1 g.
        position: String,
        /// Length of the force there, in g.
        length_g: String,
        /// Units that fit the numbers.
        units: String,
    },
    /// Rows in another unit than the others.
    #[error(
        "{record}: line {line}, columns {columns}: the specific force is {length_g} g long there; with these \
         numbers as {units} it is as in the rows beside it{more}; expected every row in the units of the header"
    )]
    RowUnit {
        /// Name of the record.
        record: String,
        /// Line of the first such row.
        line: u64,
        /// Names of the columns.
        columns: String,
        /// Length of the force by the header, in g.
        length_g: String,
        /// Units that fit these numbers.
        units: String,
        /// Number of further such rows, in words; empty if there are none.
        more: String,
    },
    /// A force that does not fit gravity in any unit.
    #[error(
        "{record}: line {line}: at {position} the specific force is {length_g} g long; expected about 1, and \
         no unit of forces makes it that"
    )]
    ForceLength {
        /// Name of the record.
        record: String,
        /// First line of the position.
        line: u64,
        /// Name of the position farthest from 1 g.
        position: String,
        /// Length of the force there, in g.
        length_g: String,
    },
    /// Output that holds one value through a position.
    #[error(
        "{record}: column `{column}` is {value} in all {rows} rows of {position} from line {line} on, and \
         varies at all other positions: its output was stuck, saturated or missing; leave its cells empty or record \
         {position} again"
    )]
    Held {
        /// Name of the record.
        record: String,
        /// First line of the position.
        line: u64,
        /// Column with that output.
        column: String,
        /// Value of all its cells.
        value: String,
        /// Number of rows of the position.
        rows: usize,
        /// Name of the position.
        position: String,
    },
    /// Times of another unit.
    #[error(
        "{record}: column `{column}`: the first position lasts {found} s by what the header says, in the \
         scheme {expected} s, and all others alike; with the numbers as [{unit}] they agree"
    )]
    TimeUnit {
        /// Name of the record.
        record: String,
        /// Name of the column.
        column: String,
        /// Duration of the first position, in s.
        found: String,
        /// Duration of the first position in the scheme, in s.
        expected: String,
        /// Unit that fits the numbers.
        unit: &'static str,
    },
    /// The platform leaves a position while samples still have its label, or arrives after the first of them.
    #[error(
        "{record}: between lines {from} and {to} the platform {what} {position}: the samples of {position} \
         {side} that are up to {off_deg} deg from the others, as at {like}; expected positions (by label or \
         by time) that begin and end where the platform does{clock}"
    )]
    Shifted {
        /// Name of the record.
        record: String,
        /// Last line before the motion.
        from: u64,
        /// First line after it.
        to: u64,
        /// Name of the position.
        position: String,
        /// Motion in words: comes to rest at, or leaves.
        what: &'static str,
        /// Side of the motion with the wrong samples: before or after.
        side: &'static str,
        /// Angle between the outermost of these samples and the others, in deg.
        off_deg: String,
        /// Name of the position that such a force fits.
        like: String,
        /// Relation to the clock of the record, in words.
        clock: String,
    },
}

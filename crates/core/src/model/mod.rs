//! What can be judged: the platform of the paper, and how it is written down.

pub mod angle;
pub mod attitude;
mod canonical;
pub(crate) mod combination;
pub mod dwell;
pub mod expression;
pub(crate) mod file_error;
pub mod geometry;
pub mod gimbals;
mod parser;
pub mod platform;
pub mod ranges;
pub mod ring;
pub mod rotation;
pub mod scheme;
pub mod scheme_file;
pub mod settings;
pub mod slew;
pub mod symbols;

pub use angle::{Angle, AngleError};
pub use dwell::Dwell;
pub use geometry::{Geometry, Term, Unknowns};
pub use gimbals::Gimbals;
pub use platform::Platform;
pub use rotation::{Rotation, SlewAxis, SlewTo};
pub use scheme::{Carry, Latitude, Position, Scheme, SchemeError};

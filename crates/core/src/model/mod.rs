//! The platform of the paper: schemes, their notation, and the model in any ring.

pub(crate) mod acceptance;
pub(crate) mod angle;
pub(crate) mod attitude;
mod canonical;
pub(crate) mod combination;
pub(crate) mod dwell;
pub(crate) mod error_model;
pub(crate) mod geometry;
mod gimbal_sequence;
mod gimbal_turns;
pub(crate) mod gimbals;
mod matrices;
pub(crate) mod observed;
pub(crate) mod omitted;
pub(crate) mod omitted_names;
pub(crate) mod path;
pub(crate) mod per_gyro;
pub(crate) mod platform;
pub(crate) mod pose;
pub(crate) mod position;
pub mod ranges;
pub(crate) mod recording;
pub(crate) mod ring;
pub(crate) mod rotation;
pub(crate) mod scheme;
pub mod scheme_file;
pub mod settings;
pub mod slew;
pub(crate) mod symbols;
pub(crate) mod terms;

pub use acceptance::Acceptance;
pub use angle::{Angle, AngleError, format_decimal, parse_decimal};
pub use attitude::{
    Euler, Matrix3, Turned, angles_text, c_n_f64, cardinal, cardinal_name, cardinal_names, elementary,
    product,
};
pub use dwell::{Dwell, DwellError};
pub use error_model::{Columns, ErrorModel};
pub use geometry::{Accelerometers, GYROS, Geometry, GeometryError, GyroAxes, SignedAxis};
pub use gimbal_sequence::{GimbalObstacle, GimbalStation};
pub use gimbal_turns::{BeyondLimits, GimbalReport, GimbalStop, GimbalTurn};
pub use gimbals::{GIMBAL_NAMES, GimbalError, Gimbals, euler_of};
pub use matrices::{MatricesError, PlatformMatrices, earth_rates, platform_matrices};
pub use observed::{LOCAL, Observed, PSI_EPS};
pub use omitted::{MAX_ATTITUDES, OmittedKind, OmittedModel, OmittedTerm};
pub use omitted_names::{may_be_omitted, omitted_meant, omitted_unit};
pub use path::{Path, PathError, PathStep, TurnAt};
pub use per_gyro::{PerGyro, PerGyroError};
pub use platform::{
    AZIMUTH, FieldSample, Platform, PlatformPoint, PositionBlock, RandomValues, SteadyTurn, earth_rate_in,
    local_dynamics, local_output,
};
pub use pose::{Pose, SlewTurns};
pub use position::{Carry, CarryError, Position, PositionError, Station, parse_attitude};
pub use recording::{Recording, Still};
pub use ring::{Float, Ring, Text};
pub use rotation::{Axis, AxisError, Rotation, RotationError, SlewAxis, SlewTo};
pub use scheme::{Latitude, LatitudeError, Scheme, SchemeError};
pub use symbols::Symbols;
pub use terms::{DefinedBy, ErrorSource, ErrorTerm, FrameError, Term, TermError, Unknowns};

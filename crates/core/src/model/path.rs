//! Slew paths between positions, exactly: turns whose axes and angles have images in a prime field.
//!
//! A torquer error acts while the platform turns, so its effect on psi depends on the path of the slew. A
//! turn by `phi` about the unit vector `u` of c adds `C_c^n(from) J E(u)` to `psi^n`, with
//! `J = sin(phi) I + (1 - cos(phi)) [u x] + (phi - sin(phi)) u u^T`. J is the integral of `exp([u x] t)`
//! from 0 to `phi` (fast against the earth rate).

use std::fmt;
use std::str::FromStr;

use obsdeg_exact::{Radical, Ratio, RootField};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::angle::Angle;
use super::attitude::{Matrix3, Turned, c_n, c_n_f64, elementary, product};
use super::position::Position;
use super::ring::{Float, Ring};
use super::rotation::{Axis, SlewAxis};
use super::slew::Slew;

/// Slew path: turn of the platform from one position to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Path {
    /// Single turn about one axis, the shortest. Half turns go about the axis in n whose first non-zero
    /// component is positive.
    OneAxis,
    /// Turns gimbal by gimbal: alpha (outer, about N), beta (middle), gamma (inner, about Z_p), each by the
    /// difference of its Euler angles.
    Gimbals,
}

impl Path {
    /// All slew paths.
    pub const ALL: [Self; 2] = [Self::OneAxis, Self::Gimbals];

    /// Name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::OneAxis => "one-axis",
            Self::Gimbals => "gimbals",
        }
    }
}

impl Path {
    /// Turns of the gimbals from one position to the next; `None` for generic angles, and if a rotation has
    /// left the Euler angles.
    pub fn gimbals(from: &Position, to: &Position) -> Option<Vec<PathStep>> {
        if from.rotation.is_some() {
            return None;
        }
        // a passive matrix Mx(a) is a turn by -a about N of n, Mz(a) by -a about Z_p
        let constant = |a: &Angle| a.generic().is_none().then(|| a.nanodeg());
        let back =
            |k: usize| Some(Angle::from_nanodeg(constant(&from.angles[k])? - constant(&to.angles[k])?));
        let axis = |index, geographic| Axis { index, geographic };
        let steps = [
            PathStep::Named { axis: axis(0, true), angle: back(0)? },
            PathStep::Middle { gamma: from.angles[2].clone(), angle: back(1)? },
            PathStep::Named { axis: axis(2, false), angle: back(2)? },
        ];
        Some(steps.into_iter().filter(|s| s.angle().nanodeg() != 0).collect())
    }
}

impl FromStr for Path {
    type Err = PathError;
    fn from_str(text: &str) -> Result<Self, PathError> {
        let found = Self::ALL.into_iter().find(|p| p.name() == text);
        found.ok_or_else(|| PathError::Name { found: text.into() })
    }
}

/// Reasons for the lack of an exact path to a position.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PathError {
    /// The text is not a slew path.
    #[error("`{found}` is no way to turn; expected one-axis or gimbals")]
    Name {
        /// The text found.
        found: String,
    },
    /// No slew is stated, and the verdict depends on it.
    #[error(
        "torquer errors ({terms}) are unknown under inertial carry, and nothing says how `{name}` is \
         reached: they act while the platform turns, so a repositioning at once would give a verdict that \
         is wrong in kind; expected path = \"one-axis\" or \"gimbals\", a slew rate, or a slew of the \
         position"
    )]
    NotStated {
        /// Name of the position.
        name: String,
        /// Index of the position.
        index: usize,
        /// Unknown torquer terms: GS, GM, GM3.
        terms: String,
    },
    /// The stated turn does not lead to the position.
    #[error("the slew to `{name}` does not lead there")]
    NotReached {
        /// Name of the position.
        name: String,
        /// Index of the position.
        index: usize,
    },
    /// An angle or axis has no image in a field.
    #[error(
        "the turn to `{name}` ({found}) has no exact form; expected a turn about X_p, Y_p, Z_p, N, U or E \
         by decimal degrees, a turn by 15 degrees or a multiple between such attitudes, or path = \
         \"gimbals\""
    )]
    NotExact {
        /// Name of the position.
        name: String,
        /// Index of the position.
        index: usize,
        /// Turn in words.
        found: String,
    },
}

impl PathError {
    /// Key of the position in a scheme file.
    pub fn key(&self) -> Option<String> {
        match self {
            Self::Name { .. } => Some("path".into()),
            Self::NotStated { .. } => None,
            Self::NotReached { index, .. } | Self::NotExact { index, .. } => {
                Some(format!("position.{index}"))
            }
        }
    }
}

/// Turn of a slew path.
#[derive(Debug, Clone, PartialEq)]
pub enum PathStep {
    /// Turn about one of the six axes.
    Named {
        /// Axis of the turn.
        axis: Axis,
        /// Angle of the turn, right-handed.
        angle: Angle,
    },
    /// Turn about the middle gimbal axis, which on the platform at these Euler angles is `Mz(gamma)^T e_y`.
    /// The sense is opposite to that of the passive matrices.
    Middle {
        /// Euler angle gamma.
        gamma: Angle,
        /// Angle of the turn.
        angle: Angle,
    },
    /// Shortest turn to the next attitude, or turn about a direction of n.
    Direct {
        /// Axis in n (North, Up, East), a unit vector.
        about: [f64; 3],
        /// Angle of the turn, right-handed about the axis, above 0.
        angle: Angle,
    },
}

impl fmt::Display for PathStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named { axis, angle } => write!(f, "{axis}:{angle}"),
            Self::Middle { gamma, angle } => write!(f, "middle gimbal at {gamma}:{angle}"),
            Self::Direct { about: [n, u, e], angle } => write!(f, "({n:.9},{u:.9},{e:.9}):{angle}"),
        }
    }
}

/// Turn at one point of a ring.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnAt<E> {
    /// Unit vector of the axis in c (constant during the turn).
    pub axis: [E; 3],
    /// Cosine and sine of the angle.
    pub cos_sin: (E, E),
    /// Angle of the turn, in rad.
    pub angle: E,
}

impl<E: Clone> TurnAt<E> {
    /// `J = sin(phi) I + (1 - cos(phi)) [u x] + (phi - sin(phi)) u u^T`.
    pub fn integral<R: Ring<Element = E>>(&self, ring: &R) -> Matrix3<E> {
        let (c, s) = &self.cos_sin;
        let versine = ring.add(&ring.one(), &ring.neg(c));
        let rest = ring.add(&self.angle, &ring.neg(s));
        let cross = cross(ring, &self.axis);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let outer = ring.mul(&self.axis[i], &self.axis[j]);
                let sum = ring.add(&ring.mul(&versine, &cross[i][j]), &ring.mul(&rest, &outer));
                if i == j { ring.add(&sum, s) } else { sum }
            })
        })
    }

    /// `exp([u x] phi) = cos(phi) I + sin(phi) [u x] + (1 - cos(phi)) u u^T`.
    pub fn rotation<R: Ring<Element = E>>(&self, ring: &R) -> Matrix3<E> {
        let (c, s) = &self.cos_sin;
        let versine = ring.add(&ring.one(), &ring.neg(c));
        let cross = cross(ring, &self.axis);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let outer = ring.mul(&self.axis[i], &self.axis[j]);
                let sum = ring.add(&ring.mul(s, &cross[i][j]), &ring.mul(&versine, &outer));
                if i == j { ring.add(&sum, c) } else { sum }
            })
        })
    }
}

/// Matrix `[v x]`.
fn cross<R: Ring>(ring: &R, v: &[R::Element; 3]) -> Matrix3<R::Element> {
    let mut out: Matrix3<R::Element> = std::array::from_fn(|_| std::array::from_fn(|_| ring.zero()));
    for (i, x) in v.iter().enumerate() {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        out[k][j] = x.clone();
        out[j][k] = ring.neg(x);
    }
    out
}

/// Slew path from the end of one position (after its rotation) to the next.
///
/// # Errors
/// [`StepError`].
pub(super) fn steps(from: &Position, to: &Position, path: Path) -> Result<Vec<PathStep>, StepError> {
    let own = to.slew.as_ref().filter(|s| s.axis.is_some());
    if let (None, Path::Gimbals) = (own, path) {
        let no_gimbals = "gimbal by gimbal between generic angles, or from the end of a rotation";
        return Path::gimbals(from, to).ok_or_else(|| StepError::NotExact(no_gimbals.into()));
    }
    if from.angles.iter().chain(&to.angles).any(|a| a.generic().is_some()) {
        return Err(generic());
    }
    let turned = from.rotation.as_ref().map(|r| Turned { axis: r.axis, angle: r.angle.clone() });
    let start = c_n(&Float, &from.angles, turned.as_ref(), |a| a.turn().cos_sin_f64());
    let how = own.cloned().unwrap_or_default();
    let Some(turn) = Slew::to(&start, &c_n_f64(&to.angles), &how, 1.0)
        .map_err(|_| StepError::NotReached)?
        .map(|s| s.turn())
    else {
        return Ok(Vec::new());
    };
    if let (Some(SlewAxis::Named(axis)), Some(angle)) = (&how.axis, &how.angle) {
        return Ok(vec![PathStep::Named { axis: *axis, angle: angle.clone() }]);
    }
    let found = || {
        let [n, u, e] = turn.about;
        StepError::NotExact(format!("{} deg about N {n:.6}, U {u:.6}, E {e:.6}", turn.angle_deg))
    };
    // the angle is known to a tenth of the last of nine decimals
    let nanodeg = (turn.angle_deg * 1e9).round();
    if (turn.angle_deg * 1e9 - nanodeg).abs() > 0.01 || nanodeg < 1.0 {
        return Err(found());
    }
    Ok(vec![PathStep::Direct { about: turn.about, angle: Angle::from_nanodeg(nanodeg as i64) }])
}

fn generic() -> StepError {
    StepError::NotExact("between generic angles".into())
}

/// Reasons for the lack of exact steps.
pub(super) enum StepError {
    NotReached,
    NotExact(String),
}

impl PathStep {
    /// Angle of the turn, right-handed about its axis.
    pub fn angle(&self) -> &Angle {
        match self {
            Self::Named { angle, .. } | Self::Middle { angle, .. } | Self::Direct { angle, .. } => angle,
        }
    }

    /// The turn in floating point, from the attitude `from` (`C_c^n`).
    pub fn at_f64(&self, from: &Matrix3<f64>) -> TurnAt<f64> {
        let phi = (self.angle().nanodeg() as f64 / 1e9).to_radians();
        let axis = match self {
            Self::Direct { about, .. } => into_c(&Float, from, about),
            other => other.named(&Float, from, |a| a.turn().cos_sin_f64()),
        };
        TurnAt { axis, cos_sin: self.angle().turn().cos_sin_f64(), angle: phi }
    }

    /// The turn in a prime field where pi has the image `pi`; `to` is the attitude after it. `None` if the
    /// axis has no image, or if the turn contradicts its floating-point form.
    pub(super) fn at_field(
        &self,
        roots: &RootField,
        from: &Matrix3<u64>,
        to: Option<&Matrix3<u64>>,
        pi: u64,
        cos_sin: impl Fn(&Angle) -> (u64, u64),
    ) -> Option<TurnAt<u64>> {
        let f = roots.field;
        let (c, s) = cos_sin(self.angle());
        let angle = f.mul(pi, f.from_ratio(self.angle().nanodeg(), 180_000_000_000));
        let axis = match self {
            Self::Direct { about, .. } => direct(roots, from, to?, (c, s), about)?,
            other => other.named(&f, from, cos_sin),
        };
        Some(TurnAt { axis, cos_sin: (c, s), angle })
    }

    /// Axis in c of a turn about a named axis.
    fn named<R: Ring>(
        &self,
        ring: &R,
        from: &Matrix3<R::Element>,
        cos_sin: impl Fn(&Angle) -> (R::Element, R::Element),
    ) -> [R::Element; 3] {
        let unit = |i: usize| std::array::from_fn(|j| if i == j { ring.one() } else { ring.zero() });
        match self {
            Self::Named { axis, .. } if axis.geographic => into_c(ring, from, &unit(axis.index)),
            Self::Named { axis, .. } => unit(axis.index),
            // C = Mx My Mz, so a turn of My is a turn about Mz^T e_y of c
            Self::Middle { gamma, .. } => {
                let m = elementary(ring, 2, &cos_sin(gamma));
                m[1].clone()
            }
            Self::Direct { .. } => unit(0),
        }
    }
}

/// Product `C_n^c v`.
fn into_c<R: Ring>(ring: &R, c: &Matrix3<R::Element>, v: &[R::Element; 3]) -> [R::Element; 3] {
    std::array::from_fn(|j| ring.dot((0..3).map(|i| (&c[i][j], &v[i]))))
}

/// Axis in c of the turn between two attitudes by an angle of the given cosine and sine; `about` is its
/// direction in floating point. `None` if the turn has another angle, or the axis has no image.
fn direct(
    roots: &RootField,
    from: &Matrix3<u64>,
    to: &Matrix3<u64>,
    (c, s): (u64, u64),
    about: &[f64; 3],
) -> Option<[u64; 3]> {
    let f = roots.field;
    // in n: exp([u x] phi) = C_to C_from^T
    let back: Matrix3<u64> = std::array::from_fn(|i| std::array::from_fn(|j| from[j][i]));
    let r = product(&f, to, &back);
    let u = if s != 0 {
        let half = f.inv(f.add(s, s));
        std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            f.mul(half, f.sub(r[k][j], r[j][k]))
        })
    } else {
        let images: Option<Vec<u64>> = about.iter().map(|x| recognised(roots, *x)).collect();
        images?.try_into().ok()?
    };
    let turn = TurnAt { axis: u, cos_sin: (c, s), angle: 0 };
    (turn.rotation(&f) == r && f.dot(0, u.iter().map(|x| (*x, *x))) == f.one()).then(|| into_c(&f, from, &u))
}

/// Image of a component of a unit vector that is a square root of a ratio of small numbers.
fn recognised(roots: &RootField, x: f64) -> Option<u64> {
    Some(radical(x)?.image(roots))
}

/// Exact form of a component of a unit vector that is a square root of a ratio of small numbers.
pub(crate) fn radical(x: f64) -> Option<Radical> {
    for (place, radicand) in [1.0f64, 2.0, 3.0, 6.0].into_iter().enumerate() {
        for den in 1..=6 {
            let num = (x / radicand.sqrt() * f64::from(den)).round();
            if (num * radicand.sqrt() / f64::from(den) - x).abs() < 1e-9 {
                let mut coefficients = [Ratio { num: 0, den: 1 }; 4];
                coefficients[place] = Ratio { num: num as i64, den: i64::from(den) };
                return Some(Radical { coefficients });
            }
        }
    }
    None
}

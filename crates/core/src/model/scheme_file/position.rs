//! One `[[position]]` of a scheme file.

use serde_spanned::Spanned;

use super::layout::{PositionEntry, RotationEntry, SlewEntry};
use super::{SchemeFileError, SchemeReader};
use crate::model::angle::{Angle, MAX_DEGREES, parse_decimal};
use crate::model::attitude::Euler;
use crate::model::dwell::Dwell;
use crate::model::ranges::DWELL_S;
use crate::model::rotation::{AxisError, MIN_ROTATION, Rotation, SlewAxis, SlewTo, whole_angle};
use crate::model::scheme::{Position, parse_attitude};

impl SchemeReader<'_> {
    pub(super) fn position(
        &mut self,
        i: usize,
        entry: &Spanned<PositionEntry>,
    ) -> Result<Position, SchemeFileError> {
        let p = entry.get_ref();
        let key = format!("position.{i}");
        self.places.insert(key.clone(), entry.span());
        let angles = self.angles(entry)?;
        let name = self.keep(format!("{key}.name"), p.name.as_ref());
        let dwell = p.dwell_s.as_ref();
        let dwell =
            dwell.map(|d| self.number(d)?.parse::<Dwell>().map_err(|e| self.at(d.span(), e.to_string())));
        let mut dwell = dwell.transpose()?;
        let mut rotation = None;
        if let Some(r) = &p.rotation {
            self.places.insert(format!("{key}.rotation"), r.span());
            rotation = Some(self.rotation(r, &mut dwell)?);
        }
        let mut slew = None;
        if let Some(s) = &p.slew {
            self.places.insert(format!("{key}.slew"), s.span());
            slew = Some(self.slew(&key, s)?);
        }
        Ok(Position { name: name.unwrap_or_else(|| format!("p{}", i + 1)), angles, dwell, rotation, slew })
    }

    fn angles(&self, entry: &Spanned<PositionEntry>) -> Result<Euler, SchemeFileError> {
        let p = entry.get_ref();
        match (&p.angles_deg, &p.attitude) {
            (Some(list), None) => {
                let parse = |v: &Spanned<toml::Value>| {
                    let text = v.get_ref().as_str().map_or_else(|| self.number(v), |name| Ok(name.into()))?;
                    text.parse::<Angle>().map_err(|e| self.at(v.span(), e.to_string()))
                };
                let found = list.get_ref().len();
                let three =
                    || self.at(list.span(), format!("{found} angle(s); expected three: alpha, beta, gamma"));
                let [a, b, c] = &list.get_ref()[..] else { return Err(three()) };
                Ok([parse(a)?, parse(b)?, parse(c)?])
            }
            (None, Some(letters)) => {
                parse_attitude(letters.get_ref()).map_err(|e| self.at(letters.span(), e.to_string()))
            }
            (None, None) => {
                Err(self.at(entry.span(), "no attitude; expected angles_deg or attitude in a position"))
            }
            (Some(_), Some(letters)) => {
                let message = "both angles_deg and attitude; expected one of them in a position";
                Err(self.at(letters.span(), message))
            }
        }
    }

    /// Rotation of a position; with a rate it may determine the dwell.
    fn rotation(
        &self,
        entry: &Spanned<RotationEntry>,
        dwell: &mut Option<Dwell>,
    ) -> Result<Rotation, SchemeFileError> {
        let RotationEntry { about, angle_deg, rate_deg_s } = entry.get_ref();
        let axis = about.get_ref().parse().map_err(|e: AxisError| self.at(about.span(), e.to_string()))?;
        let angle = |v: &Spanned<toml::Value>| {
            whole_angle(&self.number(v)?).map_err(|e| self.at(v.span(), e.to_string()))
        };
        let angle = match (angle_deg, rate_deg_s, *dwell) {
            (Some(a), None, _) => angle(a)?,
            (Some(a), Some(rate), None) => {
                let (angle, seconds) = (angle(a)?, self.number(rate)?.parse::<f64>());
                // the duration needs no exact number
                let seconds = seconds.map_or(f64::NAN, |x| angle.nanodeg() as f64 / 1e9 / x);
                let wrong = || {
                    let message =
                        format!("expected a rate in deg/s with the sign of angle_deg, that takes {DWELL_S}");
                    self.at(rate.span(), message)
                };
                let taken = Dwell::from_seconds(seconds).filter(|d| DWELL_S.admits(d.seconds()));
                *dwell = Some(taken.ok_or_else(wrong)?);
                angle
            }
            (None, Some(rate), Some(dwell)) => {
                let text = self.number(rate)?;
                turned(&text, dwell).ok_or_else(|| {
                    let message = format!(
                        "at `{text}` deg/s for {dwell} s there is no exact angle of at least 0.001 \
                         degrees; expected a decimal"
                    );
                    self.at(rate.span(), message)
                })?
            }
            _ => {
                let message =
                    "expected angle_deg, or rate_deg_s with either angle_deg or dwell_s of the position";
                return Err(self.at(entry.span(), message));
            }
        };
        Ok(Rotation { axis, angle })
    }

    fn slew(&mut self, key: &str, entry: &Spanned<SlewEntry>) -> Result<SlewTo, SchemeFileError> {
        let SlewEntry { rate_deg_s, about, angle_deg } = entry.get_ref();
        if let (Some(angle), None) = (angle_deg, about) {
            return Err(self.at(angle.span(), "an angle without an axis; expected `about` too"));
        }
        let axis =
            about.as_ref().map(|a| slew_axis(a.get_ref()).map_err(|e| self.at(a.span(), e.to_string())));
        let angle = angle_deg
            .as_ref()
            .map(|a| whole_angle(&self.number(a)?).map_err(|e| self.at(a.span(), e.to_string())));
        let (axis, angle) = (axis.transpose()?, angle.transpose()?);
        let rate_deg_s = self.keep(format!("{key}.slew.rate_deg_s"), rate_deg_s.as_ref());
        Ok(SlewTo { rate_deg_s, axis, angle })
    }
}

/// Reasons why a value is no axis of a slew.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
enum SlewAxisError {
    #[error("{0}, or a direction [North, Up, East] such as [1, 1, 0]")]
    Name(AxisError),
    #[error("expected X_p, Y_p, Z_p, N, U, E, or a direction [North, Up, East] such as [1, 1, 0]")]
    Direction,
}

/// Axis of a slew: a name, or three numbers.
fn slew_axis(about: &toml::Value) -> Result<SlewAxis, SlewAxisError> {
    let number = |v: &toml::Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
    let direction = |list: &Vec<toml::Value>| {
        let components: Option<Vec<f64>> = list.iter().map(number).collect();
        components.and_then(|c| SlewAxis::direction(&c))
    };
    match about {
        toml::Value::String(name) => name.parse().map_err(SlewAxisError::Name),
        other => other.as_array().and_then(direction).ok_or(SlewAxisError::Direction),
    }
}

/// Exact angle of a rotation at `rate` deg/s over a dwell; `None` if it is no decimal.
fn turned(rate: &str, dwell: Dwell) -> Option<Angle> {
    let rate = i128::from(parse_decimal(rate).ok()?);
    let product = rate * i128::from(dwell.nanoseconds());
    let nanodeg = i64::try_from(product / 1_000_000_000).ok().filter(|_| product % 1_000_000_000 == 0)?;
    let limit = MAX_DEGREES * 1_000_000_000;
    (MIN_ROTATION..=limit).contains(&nanodeg.abs()).then(|| Angle::from_nanodeg(nanodeg))
}

//! Matrices of the platform in numbers: F, H and `S_i` of (8) and (9), for building or checking a filter by
//! hand.

use nalgebra::DMatrix;

use super::platform::{Platform, PlatformPoint, local_dynamics, local_output};
use super::ring::Float;
use super::scheme::{Scheme, SchemeError};
use super::slew::W_IE;

/// The linear model of a scheme: `l' = F l`, `Z = H l` at every position, and `l = S_i x` at the start of
/// position i. x holds the unknowns of the scheme, l the local unknowns of a position: psi^n (rad), the
/// drift eps^n (rad/s) and, if unknown, the accelerometer errors (g).
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformMatrices {
    /// Names of the unknowns x, in the order of the columns of every `S_i`.
    pub unknowns: Vec<String>,
    /// F of (8), of 6 by 6, or 9 by 9 if accelerometer errors are unknown; entries between angles in 1/s.
    pub f: DMatrix<f64>,
    /// H of (9), one row per observed component: Z1 and Z3, or Z1, Z2, Z3 with accelerometer errors, then a
    /// measured azimuth if there is one; Z in rad (or g).
    pub h: DMatrix<f64>,
    /// `S_i` of every position, in order; psi in rad, coefficients in rad/s, rad/s/g, and in g for
    /// accelerometers.
    pub s: Vec<DMatrix<f64>>,
}

/// North and up component of the earth rate, `[wN, wU]` in rad/s, at a latitude in degrees, positive north.
pub fn earth_rates(latitude_deg: f64) -> [f64; 2] {
    let latitude = latitude_deg.to_radians();
    [W_IE * latitude.cos(), W_IE * latitude.sin()]
}

/// Reason why a scheme has no matrices in numbers.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MatricesError {
    /// The scheme itself can not be analysed.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// An angle is generic and has no number.
    #[error("position {position}: the angle {angle} is generic; expected decimal degrees")]
    Generic {
        /// Name of the position.
        position: String,
        /// Angle as written.
        angle: String,
    },
    /// A segment rotates while Z is observed: its S changes all the time.
    #[error("position {position} rotates while Z is observed; expected fixed attitudes")]
    Rotates {
        /// Name of the segment.
        position: String,
    },
}

/// F, H and `S_i` of a scheme at the rates `[wN, wU]` of the earth in rad/s, see [`earth_rates`]. The
/// latitude of the scheme is not used. Turns between positions take no time here.
///
/// Source: (8), (9) of Ding, Cai, Huang, J. NUDT 39(1), 2017; `S_i` by the carry of the scheme.
///
/// # Errors
/// [`MatricesError`] if the scheme can not be analysed, has generic angles, or rotates while Z is observed.
pub fn platform_matrices(scheme: &Scheme, earth_rates: [f64; 2]) -> Result<PlatformMatrices, MatricesError> {
    for p in &scheme.positions {
        if p.rotation.is_some() {
            return Err(MatricesError::Rotates { position: p.name.clone() });
        }
        if let Some(angle) = p.angles.iter().find(|a| a.generic().is_some()) {
            return Err(MatricesError::Generic { position: p.name.clone(), angle: angle.to_string() });
        }
    }
    let platform = Platform::new(scheme.clone())?;
    let [w_n, w_u] = earth_rates;
    let observed = platform.observed();
    let locals = observed.locals();
    let f = local_dynamics(&Float, &w_n, &w_u);
    let output = local_output(&Float, observed);
    let unknowns = platform.names().to_vec();
    let s = platform.blocks(&PlatformPoint::in_floats(&platform, w_n, w_u)).into_iter().map(|block| {
        let mut s = DMatrix::zeros(locals, unknowns.len());
        for (r, row) in block.rows.iter().take(locals).enumerate() {
            for (&column, value) in block.columns.iter().zip(row) {
                s[(r, column)] = *value;
            }
        }
        s
    });
    Ok(PlatformMatrices {
        f: DMatrix::from_fn(locals, locals, |r, c| f[r][c]),
        h: DMatrix::from_fn(output.len(), locals, |r, c| output[r].1[c]),
        s: s.collect(),
        unknowns,
    })
}

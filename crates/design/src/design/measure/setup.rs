//! The evaluator of a search, from a scheme, candidates and conditions.

use std::sync::Arc;

use obsdeg_core::model::slew::W_IE;
use obsdeg_core::model::{Carry, Euler, Float, Gimbals, Matrix3, Platform, Scheme, c_n_f64, local_dynamics};
use obsdeg_evidence::simulation::{
    Conditions, PRIOR, SimulationError, is_rate, latitude_of, resolve, si_per_shown,
};

use crate::design::measure::evaluator::{Evaluator, Prior};
use crate::design::measure::omitted::OmittedErrors;
use crate::design::request::error::DesignError;
use crate::design::request::limits::MAX_UNKNOWNS;

impl Evaluator {
    /// Evaluator for positions of `dwell_s` each, without drift noise, with the priors that are stated.
    /// `required` are the coefficients that count (indices among the coefficients); the others are
    /// estimated with them.
    ///
    /// # Errors
    /// [`DesignError`].
    pub fn new(
        base: &Scheme,
        candidates: &[Euler],
        required: &[usize],
        conditions: &Conditions,
    ) -> Result<Self, DesignError> {
        Self::interruptible((base, candidates), required, (conditions, None), &|| true)
    }

    /// Evaluator with errors that are not estimated and count. Stops when `proceed` returns false: slew
    /// paths between many candidates take time.
    pub(crate) fn interruptible(
        (base, candidates): (&Scheme, &[Euler]),
        required: &[usize],
        (conditions, omitted): (&Conditions, Option<OmittedErrors>),
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, DesignError> {
        let scheme = Scheme {
            positions: Scheme::of_angles(candidates.iter().take(1).cloned()).positions,
            latitude: latitude_of(base),
            combinations: Vec::new(),
            gimbals: Gimbals::default(),
            ..base.clone()
        };
        let latitude = scheme
            .latitude
            .map_or((1.0, 0.0), |l| obsdeg_exact::TurnFraction::from_nanodeg(l.nanodeg()).cos_sin_f64());
        if conditions.slew_rate_deg_s.is_some() && scheme.carry != Carry::Inertial {
            return Err(SimulationError::SlewCarry { carry: scheme.carry }.into());
        }
        let platform = Platform::new(scheme)?;
        let d = platform.coefficients();
        let dph = si_per_shown("deg/h");
        if d + 3 > MAX_UNKNOWNS {
            return Err(DesignError::TooManyUnknowns { found: d + 3 });
        }
        let f = local_dynamics(&Float, &(W_IE * latitude.0), &(W_IE * latitude.1));
        let counts = |c: &usize| required.contains(c);
        let order: Vec<usize> = (0..d).filter(|c| !counts(c)).chain((0..d).filter(|c| counts(c))).collect();
        let locals = platform.observed().locals();
        let units = platform.units()[platform.units().len() - d..].to_vec();
        let prior = Prior::of(&platform, conditions, &order)?;
        let empty = Self {
            prior,
            bias: conditions.accelerometer().states().first().copied(),
            omitted: omitted.map(Arc::new),
            platform,
            conditions: conditions.clone(),
            nuisance: d - required.len(),
            scale: order.iter().map(|&c| si_per_shown(units[c]) / dph).collect(),
            order,
            n: d + 3,
            locals,
            w: std::array::from_fn(|i| std::array::from_fn(|j| f[i][j])),
            dwells: Vec::new(),
            candidates: Vec::new(),
            slew_paths: Vec::new(),
            dph,
        };
        let attitudes: Vec<Matrix3<f64>> = candidates.iter().map(c_n_f64).collect();
        empty.with_dwell(conditions.dwell_s)?.among(&attitudes, proceed)
    }
}

impl Prior {
    /// Prior that `conditions` state for the unknowns of `platform`; coefficients in the order `order`.
    fn of(platform: &Platform, conditions: &Conditions, order: &[usize]) -> Result<Self, DesignError> {
        let sigmas = resolve(PRIOR, platform, conditions.stated_priors(), f64::INFINITY)?;
        let scaled = |(sigma, unit): (&f64, &&str)| match is_rate(unit) {
            true => sigma * conditions.drift_scale,
            false => *sigma,
        };
        let sigmas: Vec<f64> = sigmas.iter().zip(platform.units()).map(scaled).collect();
        let information = |sigma: f64, unit: &str| (sigma * si_per_shown(unit)).powi(-2);
        let first = sigmas.len() - platform.coefficients();
        Ok(Self {
            psi: std::array::from_fn(|k| information(sigmas[k], "rad")),
            coefficients: order.iter().map(|&c| information(sigmas[first + c], "deg/h")).collect(),
        })
    }
}

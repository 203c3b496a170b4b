//! Resolution of evidence b by a filter in doubles, computed in high precision: width of the filter's prior
//! and effect of rounding.

use std::cell::OnceCell;

use obsdeg_core::model::slew::W_IE;
use obsdeg_exact::SplitMix64;

use super::asymptotics::functional;
use super::precise::{Digits, Functional, Posterior, PreciseModel, SampleInformation};
use crate::prediction::Combination;
use crate::simulation::conditions::is_rate;
use crate::simulation::{Conditions, Plan};

/// Bits of this evaluation: enough for information of 1e30 of a prior, and for the cancellation in it.
const BITS: usize = 512;
/// Binary logarithm of the change that rounding makes to a number of a model of doubles, whose largest are
/// about one. 2^-46 is 64 units of the last place, for some hundreds of steps of the filter.
pub(super) const ROUNDING: i32 = -46;
/// Number of models with randomly rounded numbers.
const DRAWS: usize = 2;
/// Factor between the two priors of evidence b.
const WIDER: f64 = 10.0;
/// Relative difference from the value in high precision up to which a number of the filter counts as the
/// same.
const SAME: f64 = 0.01;
/// Largest difference of a value in high precision from that of an infinitely wide prior: relative for an
/// inflation, absolute for a correlation. It is a fifth of the tolerance for values measured in doubles.
const CLOSE: [f64; 2] = [2e-3, 2e-4];

/// Covariances of a model with both priors of evidence b.
struct PosteriorPair {
    prior: Posterior,
    wider: Posterior,
}

impl PosteriorPair {
    fn inflation(&self, functional: &Functional) -> f64 {
        self.wider.sigma(functional) / self.prior.sigma(functional)
    }
}

/// Covariance of the filter at the end in high precision, computed on demand.
pub(super) struct Resolution<'a> {
    plan: &'a Plan,
    conditions: &'a Conditions,
    /// Standard deviations of the prior, in SI units.
    prior: &'a [f64],
    /// Model in high precision; `None` where it cannot be computed, here and below.
    model: OnceCell<Option<PreciseModel>>,
    /// Filter of the model.
    exact: OnceCell<Option<PosteriorPair>>,
    /// Filters of the model with randomly rounded numbers.
    rounded: OnceCell<Option<Vec<PosteriorPair>>>,
}

impl<'a> Resolution<'a> {
    /// Resolution for the filter of `plan` with a prior of these standard deviations.
    pub(super) fn new(plan: &'a Plan, conditions: &'a Conditions, prior: &'a [f64]) -> Self {
        Self {
            plan,
            conditions,
            prior,
            model: OnceCell::new(),
            exact: OnceCell::new(),
            rounded: OnceCell::new(),
        }
    }

    fn is_psi(&self, c: usize) -> bool {
        !is_rate(self.plan.platform.units()[c])
    }

    fn model(&self) -> Option<&PreciseModel> {
        let compute = || {
            let scheme = self.plan.platform.scheme().with_dwells(self.conditions.dwell_s, 1.0).ok()?;
            PreciseModel::new(&scheme, Digits { bits: BITS })
        };
        self.model.get_or_init(compute).as_ref()
    }

    /// Filter of a model, at the times of its samples.
    fn filtered(&self, model: &PreciseModel) -> Option<PosteriorPair> {
        let conditions = self.conditions;
        let dwell_s = self.plan.segments.first().map(|s| s.dt * s.steps as f64)?;
        let samples: Vec<usize> = self.plan.segments.iter().map(|s| s.steps).collect();
        let noise = [conditions.accelerometer_noise_g, conditions.azimuth_noise_deg.to_radians()];
        let information = SampleInformation::of_filter(model, dwell_s * W_IE, &samples, noise);
        let prior = |factor: f64| -> Vec<f64> {
            let unit = |c: usize| if self.is_psi(c) { 1.0 } else { W_IE };
            self.prior.iter().enumerate().map(|(c, s)| s * factor / unit(c)).collect()
        };
        let at = |factor: f64| Posterior::new(&information, &prior(factor));
        Some(PosteriorPair { prior: at(1.0)?, wider: at(WIDER)? })
    }

    fn exact(&self) -> Option<&PosteriorPair> {
        self.exact.get_or_init(|| self.filtered(self.model()?)).as_ref()
    }

    fn rounded(&self) -> Option<&[PosteriorPair]> {
        let compute = || {
            let (own, mut rng) = (self.model()?, SplitMix64::new(1));
            let rounded: Vec<PreciseModel> = (0..DRAWS).map(|_| own.rounded(ROUNDING, &mut rng)).collect();
            rounded.iter().map(|model| self.filtered(model)).collect()
        };
        self.rounded.get_or_init(compute).as_deref()
    }

    /// Reason why doubles, which show `measured`, need not show `limit`, the value of an infinitely wide
    /// prior; `None` where they must show it. `of` computes the value from a model.
    fn why(
        &self,
        limit: f64,
        measured: f64,
        close: f64,
        of: &dyn Fn(&PosteriorPair) -> f64,
    ) -> Option<String> {
        const UNKNOWN: &str = "many digits do not tell what the filter must show";
        let close = |x: f64| (x - limit).abs() <= close * limit;
        let Some(exact) = self.exact().map(of) else { return Some(UNKNOWN.into()) };
        if !close(exact) {
            let same = (measured - exact).abs() <= SAME * exact.abs();
            let doubles = if same {
                "the filter in doubles shows the same"
            } else {
                "the filter in doubles shows neither"
            };
            return Some(format!(
                "by many digits {exact:.4} at the diffuse prior of this evidence (the program's own, \
                 whatever --prior says), which is too narrow to show \
                 {limit:.0}; {doubles}"
            ));
        }
        let Some(rounded) = self.rounded() else { return Some(UNKNOWN.into()) };
        let moved = rounded.iter().map(of).find(|x| !close(*x))?;
        Some(format!(
            "by many digits {exact:.4}, but {moved:.4} where rounding moves the model by 2^{ROUNDING}"
        ))
    }

    /// Reason why `measured`, the prior inflation of a combination of the filter's unknowns, may differ from
    /// its limit; `determined` says which limit it has.
    pub(super) fn inflation(&self, terms: &Combination, determined: bool, measured: f64) -> Option<String> {
        let f = functional(Digits { bits: BITS }, &|c| self.is_psi(c), terms, false);
        let limit = if determined { 1.0 } else { WIDER };
        self.why(limit, measured, CLOSE[0], &|filtered| filtered.inflation(&f))
    }

    /// Reason why the correlation of two unknowns, times its expected sign, may differ from one; `measured`
    /// is that of the filter, with this sign.
    pub(super) fn correlation(&self, pair: [usize; 2], sign: f64, measured: f64) -> Option<String> {
        let unit = |c: usize| functional(Digits { bits: BITS }, &|c| self.is_psi(c), &[(c, 1.0)], false);
        let [a, b] = pair.map(unit);
        self.why(1.0, measured, CLOSE[1], &|filtered| sign * filtered.prior.correlation(&a, &b))
    }
}

//! What evidence b must show in a filter of doubles, by many digits: whether the filter's prior is wide
//! enough for it, and the rounding of doubles small enough.

use std::cell::OnceCell;

use obsdeg_core::model::slew::W_IE;
use obsdeg_exact::SplitMix64;

use super::asymptotics::functional;
use super::precise::{Digits, Functional, Information, Model, Posterior};
use crate::prediction::Combination;
use crate::simulation::conditions::is_rate;
use crate::simulation::{Conditions, Plan};

/// Bits of this evaluation: information of 1e30 of a prior, and what cancels in it.
const BITS: usize = 512;
/// By how much rounding may move a number of a model of doubles, whose largest are about one: 2^-46 is 64
/// units of the last place, for some hundreds of steps of the filter.
pub(super) const ROUNDING: i32 = -46;
/// Models that are rounded at random.
const DRAWS: usize = 2;
/// The factor between the two priors of evidence b.
const WIDER: f64 = 10.0;
/// How far a number of the filter may be from that by many digits to be called the same, relative.
const SAME: f64 = 0.01;
/// How far the value by many digits may be from what a prior without bounds shows, a fifth of the tolerance
/// of what is measured in doubles: of an inflation, relative, and of a correlation.
const CLOSE: [f64; 2] = [2e-3, 2e-4];

/// A model with both priors of evidence b.
struct Filtered {
    prior: Posterior,
    wider: Posterior,
}

impl Filtered {
    fn inflation(&self, functional: &Functional) -> f64 {
        self.wider.sigma(functional) / self.prior.sigma(functional)
    }
}

/// The filter's covariance at the end by many digits, computed where it is asked for.
pub(super) struct Resolution<'a> {
    plan: &'a Plan,
    conditions: &'a Conditions,
    /// Standard deviations of the prior, in SI units.
    prior: &'a [f64],
    /// The model in many digits; `None` where these do not give it, here and below.
    model: OnceCell<Option<Model>>,
    /// The filter of the model.
    exact: OnceCell<Option<Filtered>>,
    /// Filters of the model with rounded numbers.
    rounded: OnceCell<Option<Vec<Filtered>>>,
}

impl<'a> Resolution<'a> {
    /// Of the filter of `plan` with a prior of these standard deviations.
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

    fn model(&self) -> Option<&Model> {
        let compute = || {
            let scheme = self.plan.platform.scheme().with_dwells(self.conditions.dwell_s, 1.0).ok()?;
            Model::new(&scheme, Digits { bits: BITS })
        };
        self.model.get_or_init(compute).as_ref()
    }

    /// The filter of a model, at the times of its samples.
    fn filtered(&self, model: &Model) -> Option<Filtered> {
        let conditions = self.conditions;
        let dwell_s = self.plan.segments.first().map(|s| s.dt * s.steps as f64)?;
        let samples: Vec<usize> = self.plan.segments.iter().map(|s| s.steps).collect();
        let noise = [conditions.accelerometer_noise_g, conditions.azimuth_noise_deg.to_radians()];
        let information = Information::of_filter(model, dwell_s * W_IE, &samples, noise);
        let prior = |factor: f64| -> Vec<f64> {
            let unit = |c: usize| if self.is_psi(c) { 1.0 } else { W_IE };
            self.prior.iter().enumerate().map(|(c, s)| s * factor / unit(c)).collect()
        };
        let at = |factor: f64| Posterior::new(&information, &prior(factor));
        Some(Filtered { prior: at(1.0)?, wider: at(WIDER)? })
    }

    fn exact(&self) -> Option<&Filtered> {
        self.exact.get_or_init(|| self.filtered(self.model()?)).as_ref()
    }

    fn rounded(&self) -> Option<&[Filtered]> {
        let compute = || {
            let (own, mut rng) = (self.model()?, SplitMix64::new(1));
            let rounded: Vec<Model> = (0..DRAWS).map(|_| own.rounded(ROUNDING, &mut rng)).collect();
            rounded.iter().map(|model| self.filtered(model)).collect()
        };
        self.rounded.get_or_init(compute).as_deref()
    }

    /// Why doubles, which show `measured`, may show something else than `limit`, to which a prior without
    /// bounds leads by many digits; `None` where they must show it. `of` is what is shown.
    fn why(&self, limit: f64, measured: f64, close: f64, of: &dyn Fn(&Filtered) -> f64) -> Option<String> {
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
                "by many digits {exact:.4} at the diffuse prior of this evidence (the program's own, whatever --prior says), which is too narrow to show \
                 {limit:.0}; {doubles}"
            ));
        }
        let Some(rounded) = self.rounded() else { return Some(UNKNOWN.into()) };
        let moved = rounded.iter().map(of).find(|x| !close(*x))?;
        Some(format!(
            "by many digits {exact:.4}, but {moved:.4} where rounding moves the model by 2^{ROUNDING}"
        ))
    }

    /// Why the prior inflation of a combination of the filter's unknowns, which is `measured`, may be another
    /// than that of what is determined, or is not.
    pub(super) fn inflation(&self, terms: &Combination, determined: bool, measured: f64) -> Option<String> {
        let f = functional(Digits { bits: BITS }, &|c| self.is_psi(c), terms, false);
        let limit = if determined { 1.0 } else { WIDER };
        self.why(limit, measured, CLOSE[0], &|filtered| filtered.inflation(&f))
    }

    /// Why the correlation of two unknowns, with the sign that it must have, may be another than one;
    /// `measured` is that of the filter, with this sign.
    pub(super) fn correlation(&self, pair: [usize; 2], sign: f64, measured: f64) -> Option<String> {
        let unit = |c: usize| functional(Digits { bits: BITS }, &|c| self.is_psi(c), &[(c, 1.0)], false);
        let [a, b] = pair.map(unit);
        self.why(1.0, measured, CLOSE[1], &|filtered| sign * filtered.prior.correlation(&a, &b))
    }
}

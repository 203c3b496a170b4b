//! Information of samples over dwells of any length, at the precision that they need: slopes, ranks and null
//! vectors where positions hardly differ and doubles do not suffice.
//!
//! The equations are those of the paper, (2), (3), (6) to (9) and (19). Nothing comes from the exact engine,
//! and from the model only the data of a scheme (angles, latitude, mounting, terms). The unit of time is
//! 1/w_ie, so that drifts are in units of the earth rate.

mod digits;
mod information;
mod model;
mod posterior;
mod seen;

pub(super) use digits::{Digits, Functional, add_up, double};
pub(super) use information::{Between, SampleInformation};
pub(super) use model::PreciseModel;
pub(super) use posterior::Posterior;
pub(super) use seen::ObservableDirections;

use std::sync::{Arc, OnceLock};

use obsdeg_core::model::Scheme;

use model::Moments;

/// Number of samples of Z per position: more than the order of any derivative that a solution needs.
const SAMPLES: usize = 6;

/// Scheme in high precision, with samples over dwells.
struct SampledModel {
    model: PreciseModel,
    /// Samples by dwell, then by position.
    moments: Vec<Vec<Arc<Moments>>>,
}

/// Samples of a scheme over dwells, computed at each precision when requested.
pub(super) struct PreciseSamples<'a, const DIGITS: usize> {
    scheme: &'a Scheme,
    /// Dwells of the first position, in 1/w_ie.
    dwells: Vec<f64>,
    bits: [usize; DIGITS],
    taken: [OnceLock<Option<SampledModel>>; DIGITS],
}

impl<'a, const DIGITS: usize> PreciseSamples<'a, DIGITS> {
    /// Samples of which none is computed yet.
    pub(super) fn new(scheme: &'a Scheme, dwells: Vec<f64>, bits: [usize; DIGITS]) -> Self {
        Self { scheme, dwells, bits, taken: [const { OnceLock::new() }; DIGITS] }
    }

    /// Observable directions at every dwell, at the precision of index `digits`; `None` where they cannot be
    /// separated from rounding.
    pub(super) fn seen(&self, digits: usize, between: Between) -> Option<Vec<ObservableDirections>> {
        let sampled = self.taken[digits].get_or_init(|| {
            let model = PreciseModel::new(self.scheme, Digits { bits: self.bits[digits] })?;
            let samples = vec![SAMPLES; self.scheme.positions.len()];
            // constant noise density: shorter steps have larger noise
            let weights = |dwell: f64| std::array::from_fn(|_| model.digits.double(dwell));
            let of = |&dwell: &f64| model.moments(dwell, &samples, &weights(dwell));
            let moments = self.dwells.iter().map(of).collect();
            Some(SampledModel { model, moments })
        });
        let SampledModel { model, moments } = sampled.as_ref()?;
        moments.iter().map(|m| SampleInformation::new(model, m, between).seen()).collect()
    }
}

//! The information of samples over dwells as short as one likes, in as many digits as that takes: what
//! slopes, ranks and null vectors of doubles cannot show where positions hardly differ.
//!
//! Written from the equations of the paper, (2), (3), (6) to (9) and (19): of the exact engine it takes
//! nothing, and of the model only what a scheme says (angles, latitude, mounting, terms). The unit of time is
//! 1/w_ie, so that drifts are in units of the earth rate.

mod digits;
mod information;
mod model;
mod posterior;
mod seen;

pub(super) use digits::{Digits, Functional, add_up, double};
pub(super) use information::{Between, Information};
pub(super) use model::Model;
pub(super) use posterior::Posterior;
pub(super) use seen::Seen;

use std::sync::{Arc, OnceLock};

use obsdeg_core::model::Scheme;

use model::Moments;

/// Samples of Z in a position: more than any derivative that a solution needs.
const SAMPLES: usize = 6;

/// A scheme in so many bits, with samples over dwells.
struct Sampled {
    model: Model,
    /// Of every dwell: one for each position.
    moments: Vec<Vec<Arc<Moments>>>,
}

/// Samples of a scheme over dwells, in as many digits as are asked for.
pub(super) struct Samples<'a, const DIGITS: usize> {
    scheme: &'a Scheme,
    /// Dwells of the first position, in 1/w_ie.
    dwells: Vec<f64>,
    bits: [usize; DIGITS],
    taken: [OnceLock<Option<Sampled>>; DIGITS],
}

impl<'a, const DIGITS: usize> Samples<'a, DIGITS> {
    /// Nothing is computed yet.
    pub(super) fn new(scheme: &'a Scheme, dwells: Vec<f64>, bits: [usize; DIGITS]) -> Self {
        Self { scheme, dwells, bits, taken: [const { OnceLock::new() }; DIGITS] }
    }

    /// What is seen at every dwell, in the digits of this number; `None` where that is not told from
    /// rounding.
    pub(super) fn seen(&self, digits: usize, between: Between) -> Option<Vec<Seen>> {
        let sampled = self.taken[digits].get_or_init(|| {
            let model = Model::new(self.scheme, Digits { bits: self.bits[digits] })?;
            let samples = vec![SAMPLES; self.scheme.positions.len()];
            // of noise of one density: shorter steps have larger noise
            let weights = |dwell: f64| std::array::from_fn(|_| model.digits.double(dwell));
            let of = |&dwell: &f64| model.moments(dwell, &samples, &weights(dwell));
            let moments = self.dwells.iter().map(of).collect();
            Some(Sampled { model, moments })
        });
        let Sampled { model, moments } = sampled.as_ref()?;
        moments.iter().map(|m| Information::new(model, m, between).seen()).collect()
    }
}

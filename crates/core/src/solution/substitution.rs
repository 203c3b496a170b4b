//! Substitution of the derivatives of Z in printed terms: their sum as a functional of the unknowns.

use super::solver::Frame;
use super::term::DerivativeTerm;
use super::turning::{attitude_derivative, drift_derivative};
use crate::model::Platform;
use crate::model::attitude::Matrix3;
use crate::model::platform::{
    AZIMUTH, LOCAL, PSI_EPS, PlatformPoint, PositionBlock, local_dynamics, local_output,
};
use crate::model::ring::Ring;
use crate::model::scheme::Station;

/// Number of local unknowns with `eps^n'`.
const MOVING: usize = LOCAL + 3;

/// The platform at one point, ready for substitution.
pub(super) struct Substitution<'a, R: Ring> {
    platform: &'a Platform,
    point: &'a PlatformPoint<R>,
    frame: Frame,
    stations: Vec<Station<'a>>,
    blocks: Vec<PositionBlock<R::Element>>,
    /// `H` by component, and `F` with `eps' = eps^n'`.
    output: Vec<(usize, [R::Element; MOVING])>,
    dynamics: [[R::Element; MOVING]; MOVING],
}

impl<'a, R: Ring> Substitution<'a, R> {
    pub(super) fn new(platform: &'a Platform, point: &'a PlatformPoint<R>, frame: Frame) -> Self {
        let ring = &point.ring;
        let wide = |row: [R::Element; LOCAL]| -> [R::Element; MOVING] {
            let mut row = row.into_iter();
            std::array::from_fn(|_| row.next().unwrap_or_else(|| ring.zero()))
        };
        let mut local = local_dynamics(ring, &point.w_n, &point.w_u).into_iter();
        let mut dynamics: [[R::Element; MOVING]; MOVING] =
            std::array::from_fn(|_| local.next().map_or_else(|| std::array::from_fn(|_| ring.zero()), wide));
        for i in 3..PSI_EPS {
            dynamics[i][LOCAL + i - 3] = ring.one();
        }
        let output = local_output(ring, platform.observed());
        Self {
            platform,
            point,
            frame,
            stations: platform.scheme().stations(),
            blocks: platform.blocks(point),
            output: output.into_iter().map(|(component, row)| (component, wide(row))).collect(),
            dynamics,
        }
    }

    /// Sum of the terms as a functional of the unknowns. `coefficients` include the rates of the earth and
    /// of turning; `turning` is the turning rate at a position.
    pub(super) fn sum(
        &self,
        terms: &[DerivativeTerm],
        coefficients: &[R::Element],
        turning: impl Fn(usize) -> R::Element,
    ) -> Vec<R::Element> {
        let ring = &self.point.ring;
        let mut out = vec![ring.zero(); self.platform.names().len()];
        for (term, coefficient) in terms.iter().zip(coefficients) {
            let station = &self.stations[term.station];
            let rate = turning(station.index);
            let row = self.derivative(term, &rate);
            let block = &self.blocks[term.station];
            for (k, &column) in block.columns.iter().enumerate() {
                let entry = block.entry(ring, &row[..LOCAL], k);
                out[column] = ring.add(&out[column], &ring.mul(coefficient, &entry));
            }
            let Some(turned) = &station.turned else { continue };
            let c = &self.point.attitudes[term.station];
            let slopes = drift_derivative(self.platform, ring, c, turned.axis);
            let first = out.len() - self.platform.coefficients();
            for (k, slot) in out[first..].iter_mut().enumerate() {
                let entry = ring.dot((0..3).map(|i| (&row[LOCAL + i], &slopes[i][k])));
                *slot = ring.add(slot, &ring.mul(coefficient, &ring.mul(&rate, &entry)));
            }
        }
        out
    }

    /// Derivative of Z that a term names, as a functional of the local unknowns and `eps^n'`.
    fn derivative(&self, term: &DerivativeTerm, rate: &R::Element) -> [R::Element; MOVING] {
        let ring = &self.point.ring;
        // Z^n^(k) as measured
        let in_n = |component: usize, order: usize| {
            let found = self.output.iter().find(|(c, _)| *c == component);
            let row = found.map_or_else(|| std::array::from_fn(|_| ring.zero()), |(_, row)| row.clone());
            (0..order).fold(row, |r, _| {
                std::array::from_fn(|j| ring.dot((0..MOVING).map(|i| (&r[i], &self.dynamics[i][j]))))
            })
        };
        if self.frame == Frame::N || term.azimuth {
            return in_n(if term.azimuth { AZIMUTH } else { term.component }, term.order);
        }
        // Z^c = C_n^c Z^n, and C_n^c changes while the platform turns: sum of binomials times (w^j d^j
        // C_n^c) Z^n^(k-j)
        let c = &self.point.attitudes[term.station];
        let turned = self.stations[term.station].turned.as_ref();
        let mut out: [R::Element; MOVING] = std::array::from_fn(|_| ring.zero());
        let mut power = ring.one();
        for j in 0..=term.order {
            let slope: Option<Matrix3<R::Element>> = match turned {
                Some(t) => Some(attitude_derivative(ring, c, t.axis, j)),
                None => (j == 0).then(|| c.clone()),
            };
            for n in 1..=3 {
                let Some(slope) = &slope else { continue };
                let weight = ring.mul(&power, &slope[n - 1][term.component - 1]);
                let row = in_n(n, term.order - j);
                for _ in 0..binomial(term.order, j) {
                    out = std::array::from_fn(|i| ring.add(&out[i], &ring.mul(&weight, &row[i])));
                }
            }
            power = ring.mul(&power, rate);
        }
        out
    }
}

/// Binomial coefficient `n over k`.
pub(super) fn binomial(n: usize, k: usize) -> usize {
    (0..k).fold(1, |b, i| b * (n - i) / (i + 1))
}

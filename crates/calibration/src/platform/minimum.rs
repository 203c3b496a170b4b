//! Minimum of the reported estimate: found first by multiple shooting; then the lowest minimum about an
//! estimate with curvature.

use nalgebra::DVector;
use obsdeg_evidence::simulation::{Noise, PlatformState};

use super::CalibrationError;
use super::curvature::BENT;
use super::estimate::{PlatformEstimate, PlatformProblem};

/// Sum of squares, as a multiple of the number of measurements, above which a fit is poor.
const POOR: f64 = 2.0;
/// Starts along an axis of the posterior, in standard deviations.
const AWAY: [f64; 4] = [3.0, -3.0, 10.0, -10.0];
/// Number of first estimates that are drawn from the priors, and the seed of these draws.
const DRAWS: usize = 12;
const SEED: u64 = 1;
/// Most bins times squared unknowns of records whose minima are sought without curvature.
const SEARCHED: usize = 1_000_000;
/// Times that an iteration goes on where it has not settled and still leads down: a valley that bends takes
/// many short steps.
const LONGER: usize = 6;
/// Least difference by which a sum of squares is lower than another.
const LOWER: f64 = 1e-2;
/// Largest difference in the sum of squares of a rival minimum: its likelihood is a thousandth or more, since
/// exp(-14/2) = 0.0009.
const RIVAL: f64 = 14.0;
/// Least distance of a rival minimum, in sigma.
const APART: f64 = 5.0;

impl PlatformProblem<'_> {
    /// Estimate from `x`. If `first`, it starts by multiple shooting (also from `x` itself, if that does not
    /// converge or fits poorly), and is the lowest of the minima about it.
    ///
    /// # Errors
    /// [`CalibrationError`] when a number is not finite.
    pub(super) fn estimate(
        &self,
        x: Vec<PlatformState>,
        first: bool,
    ) -> Result<PlatformEstimate, CalibrationError> {
        let before = self.passes.get();
        if !first {
            return self.longer(self.settle(x)?);
        }
        let found = self.lowest(self.longer(self.first(x)?)?)?;
        let found = self.longer(found)?;
        Ok(PlatformEstimate { passes: self.passes.get() - before, ..found })
    }

    /// The iteration from an estimate on where it has not settled and leads further down.
    fn longer(&self, mut estimate: PlatformEstimate) -> Result<PlatformEstimate, CalibrationError> {
        for _ in 0..LONGER {
            if estimate.converged || self.stopped.get() {
                break;
            }
            let next = self.settle(estimate.at.x.clone())?;
            let stays = !next.converged && next.at.cost >= estimate.at.cost * (1.0 - 1e-9);
            estimate = PlatformEstimate { rivals: estimate.rivals, ..next };
            if stays {
                break;
            }
        }
        Ok(estimate)
    }

    /// Estimate without a search for a lower minimum.
    fn first(&self, x: Vec<PlatformState>) -> Result<PlatformEstimate, CalibrationError> {
        let shot = self.shoot(&x).ok().flatten();
        let Some(start) = shot else { return self.settle(x) };
        let found = self.settle(start);
        let poor = |e: &PlatformEstimate| !e.converged || e.at.cost > POOR * self.rows(e);
        if found.as_ref().is_ok_and(|e| !poor(e)) || self.stopped.get() {
            return found;
        }
        match (found, self.settle(x)) {
            (Ok(a), Ok(b)) => {
                let better = (b.converged, -b.at.cost) > (a.converged, -a.at.cost);
                Ok(if better { b } else { a })
            }
            (Ok(e), Err(_)) | (Err(_), Ok(e)) => Ok(e),
            (Err(e), Err(_)) => Err(e),
        }
    }

    /// Lowest of the minima about an estimate with curvature; others nearly as low are counted as rivals. A
    /// nonlinear sum of squares has several minima, and the first one found need not be the most probable.
    /// If the scheme leaves directions undetermined, a minimum without curvature may be far from the most
    /// probable one too, so minima are sought from the priors.
    ///
    /// # Errors
    /// [`CalibrationError`] when a number is not finite.
    fn lowest(&self, estimate: PlatformEstimate) -> Result<PlatformEstimate, CalibrationError> {
        if self.stopped.get() {
            return Ok(estimate);
        }
        let bins: usize = self.runs.iter().map(|run| run.len()).sum();
        let starts = if self.kappa(&estimate)? >= BENT {
            self.starts_about(&estimate)
        } else if self.unknowns.undetermined && bins * self.unknowns.n.pow(2) <= SEARCHED {
            self.drawn_starts()
        } else {
            return Ok(estimate);
        };
        let mut best = estimate;
        let mut others: Vec<PlatformEstimate> = Vec::new();
        for start in starts {
            if self.stopped.get() {
                break;
            }
            let Ok(e) = self.settle(start) else { continue };
            if !e.converged && best.converged {
                continue;
            }
            if e.at.cost < best.at.cost - LOWER {
                others.push(std::mem::replace(&mut best, e));
            } else {
                others.push(e);
            }
        }
        let rival = |e: &&PlatformEstimate| {
            let far = (&best.solution.root * self.between(&best.at.x, &e.at.x)).norm();
            e.converged && e.at.cost < best.at.cost + RIVAL && far > APART
        };
        best.rivals = others.iter().filter(rival).count();
        Ok(best)
    }

    /// Starts along the axes of the posterior of an estimate, in both directions, and starts drawn from the
    /// priors.
    fn starts_about(&self, estimate: &PlatformEstimate) -> Vec<Vec<PlatformState>> {
        let from = &estimate.at.x;
        let axes = self.axes(estimate);
        let mut out: Vec<Vec<PlatformState>> =
            axes.iter().flat_map(|a| AWAY.map(|by| self.moved(from, &(a * by)))).collect();
        out.extend(self.drawn_starts());
        out
    }

    /// Starts by multiple shooting from first estimates drawn from the priors.
    fn drawn_starts(&self) -> Vec<Vec<PlatformState>> {
        let (mut noise, mut out) = (Noise::new(SEED, 1), Vec::new());
        for _ in 0..DRAWS {
            let d = DVector::from_fn(self.unknowns.n, |i, _| self.unknowns.prior[i] * noise.normal());
            // a start with an invalid trajectory is skipped
            out.extend(self.shoot(&self.moved(&self.at_rest(), &d)).ok().flatten());
        }
        out
    }
}

//! Start of the iteration, by multiple shooting ("lifted" Gauss-Newton; Bock, Plitt 1984,
//! doi:10.1016/S1474-6670(17)61205-9).
//!
//! Large drifts turn the platform by tens of degrees in a run. A trajectory from zero unknowns is then far
//! from the run, and its late measurements carry no information on the unknowns. The trajectory is therefore
//! divided into parts, two per dwell. Each begins with the attitude that turns gravity to its measured
//! direction by the smallest angle. The gaps between the parts are condensed into the unknowns of the run, so
//! that a pass costs as much as one without parts. A step is limited by the turn of any part. The gaps are in
//! no sum of squares, so cost does not decide here.

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::{Manifold, Update};
use obsdeg_evidence::simulation::{Conditions, ExtendedFilter, PlatformState, SegmentKind};

use super::CalibrationError;
use super::estimate::{LinearisedRecord, PlatformProblem, TURN, WEAK, largest_turn};
use super::run::RecordedRun;

/// Most passes.
const PASSES: usize = 40;
/// Number of parts of a dwell.
const PARTS: usize = 2;
/// Fewest bins of a part.
const FEWEST: usize = 4;
/// Convergence limit: largest turn of the beginning of a part, in rad.
const SETTLED: f64 = 1e-5;

/// Run in parts: its start, and the segments at which later parts begin, with their attitudes.
struct DividedRun {
    start: PlatformState,
    nodes: Vec<(usize, PlatformState)>,
}

/// Value at time 0 of the least-squares parabola through points (of a line or a constant, if they are few).
fn at_zero(points: &[(f64, f64)]) -> Option<f64> {
    let degree = match points.len() {
        0 => return None,
        1..=2 => 0,
        3..=5 => 1,
        _ => 2,
    };
    let length = points.iter().map(|p| p.0.abs()).fold(f64::MIN_POSITIVE, f64::max);
    let a = DMatrix::from_fn(points.len(), degree + 1, |i, j| (points[i].0 / length).powi(j as i32));
    let b = DVector::from_iterator(points.len(), points.iter().map(|p| p.1));
    let (q, r) = a.qr().unpack();
    r.solve_upper_triangular(&(q.transpose() * b)).map(|x| x[0])
}

impl RecordedRun {
    /// Gravity in n as measured at the beginning of the first of some segments, by the bins in all of them;
    /// `None` without enough measurements.
    fn gravity(&self, segments: &[usize]) -> Option<[f64; 3]> {
        let mut t = 0.0;
        let mut points: [Vec<(f64, f64)>; 3] = Default::default();
        let (mut over, mut bins) = (0, 0);
        let channel = |component: usize| self.plan.components.iter().position(|c| *c == component);
        let channels = [channel(1), channel(2), channel(3)];
        let mut number = self.bins[..*segments.first()?].iter().flatten().count();
        for &segment in segments {
            t += self.plan.segments[segment].dt;
            let Some(place) = &self.bins[segment] else { continue };
            let bin = self.reading.bin(place);
            for (points, channel) in points.iter_mut().zip(channels) {
                let mean = channel.filter(|&c| self.counts[number][c]).and_then(|c| bin.channels[c]);
                points.extend(mean.map(|m| (t, m.value)));
            }
            number += 1;
            bins += 1;
            over += usize::from(self.reading.over[place.position][place.index]);
        }
        let [z1, z2, z3] = points.map(|p| at_zero(&p));
        let (x, z) = (-z1?, -z3?);
        // length of 1 g, where Z2 is not measured
        let up = (1.0 - x * x - z * z).max(0.0).sqrt();
        let y = z2.map_or(if 2 * over > bins { up } else { -up }, |z2| -1.0 - z2);
        Some([x, y, z])
    }

    /// Run in parts, each levelled by its measurements, or beginning from `start` where there are none.
    fn in_parts(
        &self,
        conditions: &Conditions,
        start: &PlatformState,
    ) -> Result<DividedRun, CalibrationError> {
        let filter = ExtendedFilter::new(&self.plan, conditions, Update::default())?;
        let mut out = DividedRun { start: start.clone(), nodes: Vec::new() };
        let mut seen = vec![false; start.attitudes()];
        for position in 0..self.reading.bins.len() {
            let within = |k: &usize| {
                let segment = &self.plan.segments[*k];
                segment.position == position && !matches!(segment.kind, SegmentKind::Slew(_))
            };
            let own: Vec<usize> = (0..self.plan.segments.len()).filter(within).collect();
            if own.is_empty() {
                continue;
            }
            let parts = (own.len() / FEWEST).clamp(1, PARTS);
            for part in own.chunks(own.len().div_ceil(parts)) {
                let motion = filter.motion(part[0]);
                let block = motion.block();
                let psi = self.gravity(part).and_then(|g| motion.levelled(&g));
                let first = !std::mem::replace(&mut seen[block], true);
                let Some(psi) = psi else { continue };
                if first {
                    out.start = out.start.with_psi(block, &psi);
                } else {
                    out.nodes.push((part[0], start.clone().with_psi(block, &psi)));
                }
            }
        }
        Ok(out)
    }
}

impl PlatformProblem<'_> {
    /// Starts of all runs by multiple shooting, with constants from those of `x`. If the work is stopped, the
    /// current starts; `None` if the parts do not converge.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    pub(super) fn shoot(&self, x: &[PlatformState]) -> Result<Option<Vec<PlatformState>>, CalibrationError> {
        let each = self.runs.iter().zip(x).map(|(run, x)| run.in_parts(self.conditions, x));
        let mut parts = each.collect::<Result<Vec<DividedRun>, _>>()?;
        for _ in 0..PASSES {
            if self.stopped.get() {
                return Ok(Some(parts.into_iter().map(|p| p.start).collect()));
            }
            let starts = parts.iter().map(|p| p.start.clone()).collect();
            let at = self.at_parts(starts, |r| &parts[r].nodes)?;
            let step = self.step(&at, WEAK)?.x;
            let mut largest: f64 = 0.0;
            let mut moves: Vec<(Vec<f64>, Vec<Vec<f64>>)> = Vec::with_capacity(parts.len());
            for (r, (part, LinearisedRecord { run, .. })) in parts.iter().zip(&at.runs).enumerate() {
                let attitudes = part.start.attitudes();
                let own: Vec<f64> = self.unknowns.index[r].iter().map(|&i| step[i]).collect();
                largest = largest.max(largest_turn(&own, attitudes));
                let mut nodes = part.nodes.iter().peekable();
                let mut later = Vec::with_capacity(part.nodes.len());
                run.carried(&own, |done, d| {
                    if nodes.next_if(|(at, _)| *at == done + 1).is_some() {
                        largest = largest.max(largest_turn(d, attitudes));
                        later.push(d.to_vec());
                    }
                });
                moves.push((own, later));
            }
            let part_of_step = (TURN / largest).min(1.0);
            let scaled = |d: &[f64]| d.iter().map(|x| x * part_of_step).collect::<Vec<f64>>();
            for (part, (own, later)) in parts.iter_mut().zip(&moves) {
                part.start.retract(&scaled(own));
                part.nodes.iter_mut().zip(later).for_each(|((_, node), d)| node.retract(&scaled(d)));
            }
            if largest <= SETTLED {
                return Ok(Some(parts.into_iter().map(|p| p.start).collect()));
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use obsdeg_core::model::settings::DriftNoise;
    use obsdeg_core::model::{Carry, Path, Scheme, parse_attitude};
    use obsdeg_evidence::simulation::{Plan, is_rate, si_per_shown};

    use super::*;
    use crate::platform::observe::observe;
    use crate::record::Record;

    /// Three positions with turns of 1 deg/s between them, and a minimal record. Each sample is a bin:
    /// the rows omit the curvature within bins.
    fn run(terms: &str) -> (RecordedRun, Conditions, Vec<f64>) {
        let attitudes = ["NUE", "ENU", "DSW"].map(|a| parse_attitude(a).expect("an attitude"));
        let mut scheme = Scheme { carry: Carry::Inertial, ..Scheme::of_angles(attitudes) };
        scheme.unknowns = terms.parse().expect("terms");
        scheme.path = Some(Path::OneAxis);
        let conditions = Conditions {
            dwell_s: 400.0,
            step_s: 50.0,
            slew_rate_deg_s: Some(1.0),
            drift_noise: DriftNoise::RandomWalk(0.0),
            ..Conditions::default()
        };
        let plan = Plan::new(&scheme, &conditions).expect("a plan");
        let line = |k: u32| {
            let t = 50.0 * f64::from(k + 1);
            let z = [1.0, 2.0, 3.0].map(|c: f64| 1e-6 * (c * t).sin());
            format!("{t},{},{},{}\n", z[0], z[1], z[2])
        };
        let rows: String = (0..(plan.duration_s() / 50.0) as u32).map(line).collect();
        let text = format!("t [s],Z1 [g],Z2 [g],Z3 [g]\n{rows}");
        let record = Record::csv("run.csv", Box::new(std::io::Cursor::new(text))).expect("a record");
        let sigmas = vec![1e-5; plan.components.len()];
        let reading = observe(record, &plan, 9.80665, 50.0, sigmas.clone(), &|_| true).expect("read");
        (RecordedRun::new(reading, &scheme, &plan, &conditions).expect("a run"), conditions, sigmas)
    }

    /// A start far from zero: psi 10 deg, drifts 13 deg/h and 5 deg/h/g, all other unknowns 3e-4.
    fn far(run: &RecordedRun) -> PlatformState {
        let size = |unit: &str| match unit {
            "rad" => 10f64.to_radians() / 3f64.sqrt(),
            "deg/h" => 13.0 * si_per_shown(unit),
            unit if is_rate(unit) => 5.0 * si_per_shown(unit),
            _ => 3e-4,
        };
        let signs = [1.0, -1.0, 1.0, 1.0, -1.0].into_iter().cycle();
        let x: Vec<f64> = run.plan.platform.units().iter().zip(signs).map(|(u, s)| s * size(u)).collect();
        assert!(x[..3].iter().all(|psi| psi.abs() > 0.1) && (x[3] / 6.3e-5).abs() > 0.99, "{x:?}");
        PlatformState::of_unknowns(&x, run.plan.constants())
    }

    /// Largest difference between the rows of a run and the differences of its own prediction, over the
    /// largest row of the same unknown.
    fn gap(terms: &str) -> f64 {
        let (run, conditions, sigmas) = run(terms);
        let x = far(&run);
        let (along, keys) = run.along(&conditions, &sigmas, &x).expect("finite");
        assert!(keys.len() > 40 && along.stages.len() > 25);
        let n = x.dimension();
        let mut to = DMatrix::identity(n, n);
        let mut rows: Vec<nalgebra::RowDVector<f64>> = Vec::new();
        for stage in &along.stages {
            to = stage.transition.matrix() * to;
            for output in &stage.outputs {
                let zero = nalgebra::RowDVector::zeros(n);
                rows.push(output.h.iter().fold(zero, |sum, &(j, c)| sum + to.row(j) * c));
            }
        }
        let units = run.plan.platform.units();
        let mut worst: f64 = 0.0;
        for j in 0..n {
            let size = if is_rate(units[j]) { 1e-9 } else { 1e-5 };
            let left = |sign: f64| {
                let mut delta = vec![0.0; n];
                delta[j] = sign * size;
                let mut y = x.clone();
                y.retract(&delta);
                run.along(&conditions, &sigmas, &y).expect("finite").0.residuals
            };
            let (up, down) = (left(1.0), left(-1.0));
            let largest = rows.iter().map(|r| r[j].abs()).fold(1e-3, f64::max);
            for (i, row) in rows.iter().enumerate() {
                worst = worst.max(((down[i] - up[i]) / (2.0 * size) - row[j]).abs() / largest);
            }
        }
        worst
    }

    /// The rows of a run, dwells and slews, are the derivatives of its own prediction by the start, at drifts
    /// of 13 deg/h and a psi of 10 deg. Differences of 1e-9 rad/s and 1e-5 rad have a truncation error of
    /// 1e-10 and a rounding error of 1e-10.
    #[test]
    fn rows_are_derivatives_of_the_prediction_far_from_zero() {
        for terms in ["F,I,O,S", "all"] {
            let gap = gap(terms);
            assert!(gap < 1e-8, "{terms}: {gap}");
        }
    }

    /// Levelled parts have gravity in its measured direction.
    #[test]
    fn parts_begin_level() {
        let (run, conditions, _) = run("F,I,O,S");
        let zero = PlatformState::of_unknowns(&vec![0.0; run.plan.states()], run.plan.constants());
        let parts = run.in_parts(&conditions, &zero).expect("parts");
        assert_eq!(parts.nodes.len(), 3 * PARTS - 1);
        let filter = ExtendedFilter::new(&run.plan, &conditions, Update::default()).expect("coefficients");
        let motion = filter.motion(0);
        let seen = [0.3, -0.9, -0.2];
        let length = seen.iter().map(|x| x * x).sum::<f64>().sqrt();
        let psi = motion.levelled(&seen).expect("not upside down");
        let x = zero.with_psi(motion.block(), &psi);
        let z = obsdeg_ekf::Measurement::h(&motion, 0.0, &x);
        // Z = g - measured gravity, components 1 and 3
        let expected = [-seen[0] / length, -seen[2] / length];
        assert!(z.iter().zip(expected).all(|(z, e)| (z - e).abs() < 1e-12), "{z}");
    }
}

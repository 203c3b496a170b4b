//! Optimal weights over all attitudes: attitudes with the largest contribution are added one by one. A
//! net of attitudes and a bound between its points cover all others.
//!
//! A position with attitude C adds `d(C) = |G^(1/2) C E(g) X|^2` to `tr(X^T M X)`. Along a rotation
//! about any axis this is a trigonometric polynomial of its angle, of degree n = 2, 4, 6 for drift
//! terms of no, one, two factors of g; it is not negative. With D its maximum over all attitudes, `d >=
//! D (1 + cos(n a)) / 2` at an angle a <= pi / n from the maximum (M. Riesz, 1914, applied to d - D /
//! 2). Hence D is at most `2 max d / (1 + cos(n h))` over a net that is never further than h from any
//! attitude.
//!
//! G is the information of a dwell on drift and accelerometers, as computed in double precision. All
//! bounds are for `d` with this G and X, at all rotations C. Rounding: d is evaluated at the nodes of
//! an interpolation with a bound on its rounding, that of cosines included (`bounded`). Errors up to r
//! at the nodes become at most `L^2 r`, L the largest sum of the absolute interpolation weights.

use nalgebra::DMatrix;
use obsdeg_core::model::{Angle, Euler, LOCAL, Matrix3, c_n_f64, earth_rate_in, elementary, product};
use obsdeg_exact::parallel;

use super::bounded::{Bounded, Bounds, rounding};
use super::weights::{OptimalWeights, listed, weigh};
use crate::design::measure::criterion::{Criterion, SigmaLimits};
use crate::design::measure::evaluator::Evaluator;

/// Step of the net of Euler angles on which attitudes to add are searched, in degrees.
const COARSE: usize = 9;
/// Step of the net on which the bound rests, in degrees.
const FINE: usize = 3;
/// Number of attitudes added at once.
const TAKEN: usize = 24;
/// Largest number of rounds.
const ROUNDS: usize = 25;
/// Relative excess of an attitude's contribution below which it is not added.
const GAIN: f64 = 1e-5;
/// Full turn in 1e-9 degrees.
const FULL: u64 = 360_000_000_000;
/// Weight below which an attitude is not part of the support.
const SUPPORT: f64 = 1e-7;
/// Largest angle, in degrees, between attitudes that are equal to within the rounding of their angles.
const SAME: f64 = 0.02;

/// Attitude with its weight.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightedAttitude {
    /// Euler angles, rounded to hundredths of a degree.
    pub angles: Euler,
    /// Rounded weight, dimensionless.
    pub weight: f64,
}

/// Optimal weights over all attitudes and the lower bound that they prove.
#[derive(Debug, Clone, PartialEq)]
pub struct Everywhere {
    /// Lower bound on the criterion of every scheme of any attitudes.
    pub value: f64,
    /// Criterion of the weights at the listed attitudes.
    pub attained: f64,
    /// Attitudes, each once, with weights, heaviest first. Angles are rounded to hundredths of a
    /// degree: beta within a quarter of a turn, the others above -180 and up to 180 degrees. Weights
    /// are rounded; divide them by their sum.
    pub support: Vec<WeightedAttitude>,
}

impl Evaluator {
    /// Lower bound for schemes of any `k` attitudes, requirements on psi left out, and the support of
    /// its weights. The search for attitudes begins at the candidates. `None` as for [`Self::bound`],
    /// and if the prior of psi differs between axes: then `d` is no such polynomial.
    pub fn everywhere(
        &self,
        criterion: &Criterion,
        k: usize,
        proceed: &dyn Fn() -> bool,
    ) -> Option<Everywhere> {
        if self.ordered() || k == 0 || !self.prior.is_alike() {
            return None;
        }
        let objective = match criterion {
            Criterion::Margin(limits) => {
                self.objective(&Criterion::Margin(SigmaLimits { psi: [f64::INFINITY; 3], ..limits.clone() }))
            }
            other => self.objective(other),
        };
        let mut here = self.clone();
        let mut problem = here.additive(objective, k);
        let mut found: OptimalWeights = weigh(&problem, proceed)?;
        let scale = k as f64 * self.dph * self.dph;
        for _ in 0..ROUNDS {
            let energy = |c: &Matrix3<f64>| scale * self.energy(c, &found.dual.x);
            let most = problem.gains(&found.dual.x).into_iter().fold(0.0, f64::max);
            let mut new: Vec<Euler> = peaks(self.degree(), &energy);
            new.retain(|e| energy(&c_n_f64(e)) > most * (1.0 + GAIN));
            // several starting points lead to the same peak
            new.sort_by_key(|e| e.each_ref().map(Angle::nanodeg));
            new.dedup();
            if new.is_empty() || !proceed() {
                break;
            }
            // attitudes without weight are dropped
            let kept = here.candidates.iter().zip(&found.weights).filter(|(_, w)| **w > 1e-6);
            let mut attitudes: Vec<Matrix3<f64>> = kept.map(|(c, _)| c.c).collect();
            attitudes.extend(new.iter().map(c_n_f64));
            here.stand_at(&attitudes);
            problem = here.additive(problem.objective.clone(), k);
            found = weigh(&problem, proceed)?;
        }
        let most = self.largest_energy(&found.dual.x, scale);
        let known = problem.gains(&found.dual.x).into_iter().fold(0.0, f64::max);
        let most = most.max(known);
        let value = problem.lower_bound_over(&found.dual, most).sqrt();
        let support = here.candidates.iter().zip(&found.weights).filter(|(_, w)| **w > SUPPORT);
        let (support, weights) = merged(support.map(|(c, w)| (&c.c, *w)));
        // listed figures are those of the listed attitudes and weights
        here.stand_at(&support.iter().map(c_n_f64).collect::<Vec<_>>());
        let problem = here.additive(problem.objective, k);
        let exact = || (weights.clone(), found.attained);
        let (weights, attained) = listed(&problem, &weights).unwrap_or_else(exact);
        let support = support.into_iter().zip(weights).filter(|(_, w)| *w > 0.0);
        let support = support.map(|(angles, weight)| WeightedAttitude { angles, weight }).collect();
        let attained = attained.sqrt().max(value);
        proceed().then_some(Everywhere { value, attained, support })
    }

    /// Upper bound on the contribution of one position at any attitude, X in units of deg/h, times `scale`.
    fn largest_energy(&self, x: &DMatrix<f64>, scale: f64) -> f64 {
        // h: changes of three angles, of which two axes may coincide, are a rotation by at most sqrt(5)
        // times the largest change
        let h = 5f64.sqrt() * (FINE as f64 / 2.0).to_radians();
        let n = self.degree();
        let g = self.information_of_effects();
        let energy = |e: &Euler| self.energy_bounded(e, &g, x) * scale;
        let largest = |points: Points<'_>| points.map(|p| p.1).fold(0.0, f64::max);
        let on_net = on_net(FINE, n, &|e| energy(e).value, largest).into_iter().fold(0.0, f64::max);
        let (hidden, moved) = hidden(FINE, n, &energy);
        let part = (1.0 + (n as f64 * h).cos()) / 2.0 * (1.0 - rounding(0));
        (on_net + hidden) / (part - moved) * (1.0 + rounding(0))
    }

    /// Contribution `d(C)` of one position, X in units of deg/h.
    fn energy(&self, c: &Matrix3<f64>, x: &DMatrix<f64>) -> f64 {
        let rows = self.effects(c);
        let g = self.information_of_effects();
        let mut sum = 0.0;
        for column in x.column_iter() {
            let y: [f64; LOCAL - 3] =
                rows.each_ref().map(|row| row.iter().zip(column.iter()).map(|(a, b)| a * b).sum());
            let weighted = g.iter().map(|row| row.iter().zip(&y).map(|(g, y)| g * y).sum::<f64>());
            sum += weighted.zip(&y).map(|(g, y)| g * y).sum::<f64>();
        }
        sum
    }

    /// Contribution `d(C)` at the attitude `euler` with a bound on its rounding, with `g` for G.
    fn energy_bounded(&self, euler: &Euler, g: &[[f64; LOCAL - 3]; LOCAL - 3], x: &DMatrix<f64>) -> Bounded {
        let rows = self.effects_bounded(euler);
        let column = |column: nalgebra::DVectorView<'_, f64>| -> Bounded {
            let y = rows
                .each_ref()
                .map(|row| row.iter().zip(column.iter()).map(|(a, b)| *a * *b).sum::<Bounded>());
            let weighted = g.iter().map(|row| row.iter().zip(&y).map(|(g, y)| *y * *g).sum());
            weighted.zip(&y).map(|(g, y): (Bounded, _)| g * *y).sum()
        };
        x.column_iter().map(column).sum()
    }

    /// Effects of the coefficients on drift and accelerometers at the attitude `euler`.
    fn effects_bounded(&self, euler: &Euler) -> [Vec<Bounded>; LOCAL - 3] {
        let turn = |axis: usize| {
            let (cos, sin) = euler[axis].turn().cos_sin_f64();
            // an angle below a whole turn is rounded three times in its conversion to radians; right
            // angles are exact
            let radius = if cos * sin == 0.0 { 0.0 } else { 16.0 * f64::EPSILON };
            elementary(&Bounds, axis, &(Bounded { value: cos, radius }, Bounded { value: sin, radius }))
        };
        let c = product(&Bounds, &product(&Bounds, &turn(0), &turn(1)), &turn(2));
        let [w_u, w_n] = [self.w[1][2], -self.w[0][2]].map(Bounded::exact);
        let errors = self.platform.errors();
        let drift = errors.drift_rows(&Bounds, &c, || earth_rate_in(&Bounds, &c, &w_n, &w_u));
        let of_z = match self.platform.observed().accelerometers {
            true => errors.accelerometer_rows(&Bounds, &c),
            false => Default::default(),
        };
        let mut rows = drift.into_iter().chain(of_z).map(|row| self.in_order(&row));
        std::array::from_fn(|_| rows.next().unwrap_or_default())
    }

    /// Largest difference (m x m, absolute values) between the information of the positions as the
    /// search computes it and that of the exact rotations by their angles with the same G.
    pub(crate) fn errors_of<'e>(&self, positions: impl Iterator<Item = (usize, &'e Euler)>) -> DMatrix<f64> {
        let (n, m) = (self.n, self.n - 3);
        let g = self.information_of_effects();
        let g = DMatrix::from_fn(LOCAL - 3, LOCAL - 3, |i, j| g[i][j]);
        let mut sum = DMatrix::zeros(m, m);
        for (candidate, euler) in positions {
            let rows = self.effects_bounded(euler);
            let of = |part: &dyn Fn(&Bounded) -> f64| {
                DMatrix::from_fn(LOCAL - 3, m, |r, j| rows[r].get(j).map_or(0.0, part))
            };
            let (value, radius) = (of(&|y| y.value), of(&|y| y.radius));
            let size = value.abs() + &radius;
            let own = &self.candidates[candidate].own;
            let own = DMatrix::from_fn(m, m, |i, j| own[(3 + i.max(j)) * n + 3 + i.min(j)]);
            let half = size.transpose() * g.abs();
            let moved = &half * &radius;
            sum += (own - value.transpose() * &g * &value).abs()
                + half * &size * rounding(2 * LOCAL)
                + moved.transpose()
                + moved;
        }
        sum * (1.0 + rounding(4 * LOCAL))
    }

    /// Degree n of `d` along a rotation.
    fn degree(&self) -> usize {
        let factors = self.platform.error_terms().iter().map(|t| t.factors.len()).max().unwrap_or(0);
        2 * (1 + factors)
    }
}

/// Nodes that determine a trigonometric polynomial of degree n, and the weights of its values there for
/// its values at every `step` degrees.
fn interpolation(step: usize, n: usize) -> (Vec<f64>, DMatrix<f64>) {
    let count = 2 * n + 1;
    let nodes: Vec<f64> = (0..count).map(|i| 360.0 * i as f64 / count as f64).collect();
    let kernel = |x: f64| (1..=n).map(|k| 2.0 * (k as f64 * x).cos()).sum::<f64>() + 1.0;
    let weights = DMatrix::from_fn(360_usize.div_ceil(step), count, |a, i| {
        kernel(((a * step) as f64 - nodes[i]).to_radians()) / count as f64
    });
    (nodes, weights)
}

/// Euler angles in degrees, rounded to 1e-9 degrees.
fn at(alpha: f64, beta: f64, gamma: f64) -> Euler {
    [alpha, beta, gamma].map(|x| Angle::from_nanodeg((x * 1e9).round() as i64))
}

/// Multiples of `step` from -90 to 90 degrees.
fn betas(step: usize) -> Vec<f64> {
    (0..=180).step_by(step).map(|b| b as f64 - 90.0).collect()
}

/// Euler angles in degrees, each with the value there.
type Points<'a> = &'a mut dyn Iterator<Item = ([f64; 3], f64)>;

/// A function of the attitude on a net of Euler angles in degrees. Along alpha and gamma, which turn about
/// fixed axes, it is a trigonometric polynomial of degree n: 2 n + 1 values of each determine the others (the
/// interpolation adds a few roundings to them). `layer` reduces the points of one beta.
fn on_net<T: Send>(
    step: usize,
    n: usize,
    energy: &(dyn Fn(&Euler) -> f64 + Sync),
    layer: impl Fn(Points<'_>) -> T + Sync,
) -> Vec<T> {
    let (nodes, weights) = interpolation(step, n);
    let betas = betas(step);
    let along = |k: usize| {
        let b = betas[k];
        let count = nodes.len();
        let values = DMatrix::from_fn(count, count, |i, j| energy(&at(nodes[i], b, nodes[j])));
        let all = &weights * values * weights.transpose();
        let full = weights.nrows();
        let of = |k: usize| {
            let (i, j) = (k / full, k % full);
            ([(i * step) as f64, b, (j * step) as f64], all[(i, j)])
        };
        layer(&mut (0..full * full).map(of))
    };
    parallel::map(betas.len(), along)
}

/// Rounding bound of the values of [`on_net`] from those at the nodes, and the relative bound for nodes
/// that are no multiples of 1e-9 degrees (of the largest value of the function anywhere).
fn hidden(step: usize, n: usize, energy: &(dyn Fn(&Euler) -> Bounded + Sync)) -> (f64, f64) {
    let (nodes, weights) = interpolation(step, n);
    let count = nodes.len();
    let both = |b: f64| {
        let all = nodes.iter().flat_map(|a| nodes.iter().map(move |c| energy(&at(*a, b, *c))));
        all.fold((0.0, 0.0), |(size, radius): (f64, f64), x| (size.max(x.value.abs()), radius.max(x.radius)))
    };
    let larger = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.max(b.1));
    let betas = betas(step);
    let largest = parallel::map(betas.len(), |k| both(betas[k]));
    let (size, radius) = largest.into_iter().fold((0.0, 0.0), larger);
    // arguments up to 2 pi k are off by some 26 k u, cosines by u, and their sum by (n + 1) u of its size
    let weight = (14 * n + 16) as f64 * f64::EPSILON;
    let sizes = weights.row_iter().map(|row| row.iter().map(|w| w.abs()).sum::<f64>()).fold(0.0, f64::max);
    let sizes = sizes + weight * count as f64;
    let by_weights = 2.0 * weight * count as f64 * sizes + rounding(2 * count) * sizes * sizes;
    // half a unit of each of two angles, where a slope is at most n / 2 of the largest value (S. N.
    // Bernstein, of d - D / 2)
    let off = if FULL.is_multiple_of(count as u64) { 0.0 } else { 1e-9f64.to_radians() };
    (sizes * sizes * radius + by_weights * size, sizes * sizes * n as f64 / 2.0 * off)
}

fn matrix(degrees: [f64; 3]) -> Matrix3<f64> {
    c_n_f64(&euler(degrees))
}

/// Euler angles rounded to hundredths of a degree.
fn euler(degrees: [f64; 3]) -> Euler {
    degrees.map(|x| Angle::from_nanodeg((x * 100.0).round() as i64 * 10_000_000))
}

/// Merges attitudes that are equal to within the rounding of their angles and adds their weights;
/// heaviest first.
fn merged<'c>(weighed: impl Iterator<Item = (&'c Matrix3<f64>, f64)>) -> (Vec<Euler>, Vec<f64>) {
    let mut sorted: Vec<(&Matrix3<f64>, f64)> = weighed.collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut out: Vec<(&Matrix3<f64>, f64)> = Vec::new();
    for (c, weight) in sorted {
        // a rotation by a small angle a moves the entries, as a vector, by sqrt(2) a
        let apart = |other: &Matrix3<f64>| {
            let squares = c.as_flattened().iter().zip(other.as_flattened()).map(|(a, b)| (a - b).powi(2));
            (squares.sum::<f64>() / 2.0).sqrt().to_degrees()
        };
        match out.iter_mut().find(|(other, _)| apart(other) <= SAME) {
            Some((_, sum)) => *sum += weight,
            None => out.push((c, weight)),
        }
    }
    out.sort_by(|a, b| b.1.total_cmp(&a.1));
    out.into_iter().map(|(c, weight)| (angles(c), weight)).unzip()
}

/// Euler angles of an attitude, to hundredths of a degree: `C = Mx(alpha) My(beta) Mz(gamma)`, beta
/// within a quarter of a turn, the others above -180 and up to 180 degrees.
fn angles(c: &Matrix3<f64>) -> Euler {
    let beta = (-c[0][2]).clamp(-1.0, 1.0).asin();
    let (alpha, gamma) = if beta.cos().abs() > 1e-9 {
        (c[1][2].atan2(c[2][2]), c[0][1].atan2(c[0][0]))
    } else {
        // alpha and gamma turn about one axis
        ((-c[2][1]).atan2(c[1][1]), 0.0)
    };
    let positive = |x: f64| if x <= -180.0 + 0.005 { 180.0 } else { x };
    euler([alpha, beta, gamma].map(f64::to_degrees).map(positive))
}

/// Attitudes of largest energy near the best points of the coarse net, largest first.
fn peaks(n: usize, energy: &(dyn Fn(&Matrix3<f64>) -> f64 + Sync)) -> Vec<Euler> {
    let mut points: Vec<([f64; 3], f64)> =
        on_net(COARSE, n, &|e| energy(&c_n_f64(e)), |points| points.collect::<Vec<_>>()).concat();
    points.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut taken: Vec<([f64; 3], Matrix3<f64>)> = Vec::new();
    for (e, _) in points {
        let c = matrix(e);
        // the trace of C1^T C2 is 1 + 2 cos of the angle between
        let near = |(_, other): &([f64; 3], Matrix3<f64>)| {
            (0..3).map(|i| (0..3).map(|j| c[i][j] * other[i][j]).sum::<f64>()).sum::<f64>() > 1.0 + 2.0 * 0.97
        };
        if !taken.iter().any(near) {
            taken.push((e, c));
        }
        if taken.len() == TAKEN {
            break;
        }
    }
    parallel::map(taken.len(), |k| {
        let (mut at, c) = taken[k];
        let mut best = energy(&c);
        let mut step = COARSE as f64 / 2.0;
        while step > 0.005 {
            let tries = (0..3).flat_map(|k| [step, -step].map(|d| (k, d)));
            let moved = tries.map(|(k, d)| {
                let mut there = at;
                there[k] += d;
                (energy(&matrix(there)), there)
            });
            match moved.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((value, there)) if value > best => (best, at) = (value, there),
                _ => step /= 2.0,
            }
        }
        euler(at)
    })
}

#[cfg(test)]
mod tests {
    use super::super::exact::{BallReal, effects_of, energy_of, real};
    use super::*;
    use crate::design::Candidates;
    use obsdeg_core::model::{Carry, Scheme};
    use obsdeg_evidence::simulation::Conditions;
    use obsdeg_exact::SplitMix64;

    /// Scheme without positions under reset carry, with these error terms.
    fn with(terms: &str) -> Scheme {
        Scheme {
            carry: Carry::Reset,
            latitude: "28.2".parse().ok(),
            unknowns: terms.parse().expect("terms"),
            ..Scheme::default()
        }
    }

    /// Interpolated values equal direct ones for every set of terms; a degree less is not enough.
    #[test]
    fn a_net_is_interpolated() {
        let mut rng = SplitMix64::new(3);
        for terms in ["F", "F,I,O,S", "F,II,OO", "F,I,GS,GM", "F,K0,K1,K2,M6"] {
            let base = with(terms);
            let some = &Candidates::cardinals().attitudes[..1];
            let evaluator = Evaluator::new(&base, some, &[0], &Conditions::default()).expect("an evaluator");
            let mut draw = || rng.below(1 << 20) as f64 / f64::from(1 << 19) - 1.0;
            let x = DMatrix::from_fn(evaluator.n - 3, 3, |_, _| draw());
            let energy = |c: &Matrix3<f64>| evaluator.energy(c, &x);
            let off = |n: usize| {
                let all: Vec<_> =
                    on_net(20, n, &|e| energy(&c_n_f64(e)), |points| points.collect::<Vec<_>>()).concat();
                assert_eq!(all.len(), 18 * 10 * 18);
                let largest = all.iter().map(|(_, d)| *d).fold(0.0, f64::max);
                let far = all.iter().map(|(e, d)| (d - energy(&matrix(*e))).abs()).fold(0.0, f64::max);
                far / largest
            };
            let n = evaluator.degree();
            assert!(off(n) < 1e-9, "{terms}: {}", off(n));
            assert!(off(n / 2 - 1) > 1e-6, "{terms}");
        }
    }

    /// Errors of energies, of interpolated energies and of the information of positions stay within
    /// their bounds, against 512 bits; the bounds are not much larger than the errors.
    #[test]
    fn rounding_is_within_its_bounds() {
        let mut rng = SplitMix64::new(5);
        let mut largest = [0.0f64; 3];
        for terms in ["F", "F,I,O,S", "F,II,OO", "F,I,GS,GM", "F,K0,K1,K2,M6"] {
            let base = with(terms);
            let mut below = |n: u64| rng.below(n) as i64;
            let mut candidates: Vec<Euler> = (0..6)
                .map(|_| std::array::from_fn(|_| Angle::from_nanodeg(below(FULL) - FULL as i64 / 2)))
                .collect();
            candidates.extend(Candidates::cardinals().attitudes.into_iter().take(2));
            let evaluator =
                Evaluator::new(&base, &candidates, &[0], &Conditions::default()).expect("an evaluator");
            let m = evaluator.n - 3;
            let x = DMatrix::from_fn(m, 3, |_, _| below(1 << 20) as f64 / f64::from(1 << 19) - 1.0);
            let (n, g) = (evaluator.degree(), evaluator.information_of_effects());
            let energy = |e: &Euler| evaluator.energy_bounded(e, &g, &x);
            let mut within = |kind: usize, stated: f64, truth: &BallReal, radius: f64, place: &str| {
                let off = real(stated).sub(truth).to_f64().abs();
                assert!(off <= radius, "{terms}: {place} {stated:e} off by {off:e}, stated {radius:e}");
                largest[kind] = largest[kind].max(if radius > 0.0 { off / radius } else { 0.0 });
            };
            let net: Vec<_> =
                on_net(FINE, n, &|e| energy(e).value, |points| points.collect::<Vec<_>>()).concat();
            let most = net.iter().map(|(_, d)| *d).fold(0.0, f64::max);
            let (hidden, moved) = hidden(FINE, n, &energy);
            assert!(hidden < 1e-8 * most && moved < 1e-8, "{terms}: {hidden:e} {moved:e} {most:e}");
            for at in net.iter().step_by(99_991) {
                let there = euler(at.0);
                within(
                    0,
                    at.1,
                    &energy_of(&effects_of(&evaluator, &there), &g, &x),
                    hidden + moved * most,
                    "net",
                );
            }
            for (c, e) in candidates.iter().enumerate() {
                let rows = effects_of(&evaluator, e);
                let stated = energy(e);
                within(1, stated.value, &energy_of(&rows, &g, &x), stated.radius, "energy");
                let errors = evaluator.errors_of(std::iter::once((c, e)));
                for (i, j) in (0..m).flat_map(|i| (0..=i).map(move |j| (i, j))) {
                    let unit = |k: usize| DMatrix::from_fn(m, 1, |i, _| f64::from(u8::from(i == k)));
                    // by polarisation: 4 a_ij = d(e_i + e_j) - d(e_i - e_j)
                    let of = |x: DMatrix<f64>| energy_of(&rows, &g, &x);
                    let truth = of(unit(i) + unit(j)).sub(&of(unit(i) - unit(j))).shifted(-2);
                    let own = evaluator.candidates[c].own[(3 + i) * evaluator.n + 3 + j];
                    within(2, own, &truth, errors[(i, j)], "information");
                }
            }
        }
        assert!(largest.iter().all(|part| *part > 1e-5), "{largest:?}");
    }
}

//! The best weights over all attitudes: attitudes are taken up where they would add most, and what the net of attitudes
//! leaves between its points is bounded.
//!
//! What a position adds to `tr(X^T M X)` is `d(C) = |G^(1/2) C E(g) X|^2`. Along a rotation about any axis it is a
//! trigonometric polynomial of its angle, of degree n = 2, 4, 6 for drift terms of no, one, two factors of g; it is not
//! negative. So with D its maximum over all attitudes, `d >= D (1 + cos(n a)) / 2` at an angle a <= pi / n from there (M.
//! Riesz, 1914, of d - D / 2), and D is not above `2 max d / (1 + cos(n h))` over a net that is never further than h.

use nalgebra::DMatrix;
use obsdeg_core::model::{Angle, Euler, LOCAL, Matrix3, c_n_f64};
use rayon::prelude::*;

use super::super::criterion::{Criterion, Limits};
use super::super::information::Evaluator;
use super::weights::{Weighed, listed, weigh};

/// Step of the net of Euler angles on which attitudes are looked for, in degrees.
const COARSE: usize = 9;
/// Step of the net on which the bound rests.
const FINE: usize = 3;
/// Attitudes taken up at once.
const TAKEN: usize = 24;
/// Rounds, at most.
const ROUNDS: usize = 25;
/// What adds less than this part more is not taken up.
const GAIN: f64 = 1e-5;
/// Weights below are no support.
const SUPPORT: f64 = 1e-7;
/// The information of a position is evaluated in two ways that differ by rounding: assumed, not derived.
const ROUNDING: f64 = 1e-8;

/// What weights on all attitudes reach, and what nothing is below.
#[derive(Debug, Clone, PartialEq)]
pub struct Everywhere {
    /// No scheme of attitudes whatever has a smaller criterion.
    pub value: f64,
    /// The criterion of the weights at these attitudes, as they are.
    pub attained: f64,
    /// The attitudes, to hundredths of a degree, with weights: rounded, to be divided by their sum.
    pub support: Vec<(Euler, f64)>,
}

impl Evaluator {
    /// What no scheme of `k` attitudes is below, requirements on psi left out, and the attitudes that weights for it
    /// need; the candidates are where the search for them begins. `None` as for [`Self::bound`], and where psi
    /// is known beforehand about one axis better than about another: `d` is no polynomial then.
    pub fn everywhere(
        &self,
        criterion: &Criterion,
        k: usize,
        going: &dyn Fn() -> bool,
    ) -> Option<Everywhere> {
        if self.ordered() || k == 0 || !self.prior.is_alike() {
            return None;
        }
        let aim = match criterion {
            Criterion::Margin(limits) => {
                self.aim(&Criterion::Margin(Limits { psi: [f64::INFINITY; 3], ..limits.clone() }))
            }
            other => self.aim(other),
        };
        let mut here = self.clone();
        let mut eulers: Vec<Option<Euler>> = vec![None; here.candidates.len()];
        let mut problem = here.additive(aim, k);
        let mut found: Weighed = weigh(&problem, going)?;
        let scale = k as f64 * self.dph * self.dph;
        for _ in 0..ROUNDS {
            let energy = |c: &Matrix3<f64>| scale * self.energy(c, &found.dual.x);
            let most = problem.gains(&found.dual.x).into_iter().fold(0.0, f64::max);
            let new: Vec<Euler> = peaks(self.degree(), &energy)
                .into_iter()
                .filter(|e| energy(&c_n_f64(e)) > most * (1.0 + GAIN))
                .collect();
            if new.is_empty() || !going() {
                break;
            }
            // those without weight give way
            let kept: Vec<usize> = (0..eulers.len()).filter(|&i| found.weights[i] > 1e-6).collect();
            let mut attitudes: Vec<Matrix3<f64>> = kept.iter().map(|&i| here.candidates[i].c).collect();
            let mut names: Vec<Option<Euler>> = kept.iter().map(|&i| eulers[i].clone()).collect();
            attitudes.extend(new.iter().map(c_n_f64));
            names.extend(new.into_iter().map(Some));
            here.stand_at(&attitudes);
            eulers = names;
            problem = here.additive(problem.aim.clone(), k);
            found = weigh(&problem, going)?;
        }
        // h: rates of three angles, of which two axes may coincide, are a turn of at most sqrt(5) times the largest
        let h = 5f64.sqrt() * (FINE as f64 / 2.0).to_radians();
        let n = self.degree() as f64;
        let energy = |c: &Matrix3<f64>| scale * self.energy(c, &found.dual.x);
        let on_net = on_net(FINE, self.degree(), &energy).map(|(_, d)| d).reduce(|| 0.0, f64::max);
        let known = problem.gains(&found.dual.x).into_iter().fold(0.0, f64::max);
        let most = (2.0 * on_net / (1.0 + (n * h).cos())).max(known) * (1.0 + ROUNDING);
        let value = problem.lower_bound_over(&found.dual, most).sqrt();
        let support = eulers.iter().zip(&here.candidates).zip(&found.weights).filter(|(_, w)| **w > SUPPORT);
        let (support, weights): (Vec<Euler>, Vec<f64>) =
            support.map(|((e, c), w)| (e.clone().unwrap_or_else(|| angles(&c.c)), *w)).unzip();
        // what is told of the weights is what these attitudes and numbers give
        here.stand_at(&support.iter().map(c_n_f64).collect::<Vec<_>>());
        let problem = here.additive(problem.aim, k);
        let exact = || (weights.clone(), found.attained);
        let (weights, attained) = listed(&problem, &weights).unwrap_or_else(exact);
        let support = support.into_iter().zip(weights).filter(|(_, w)| *w > 0.0).collect();
        let attained = attained.sqrt().max(value);
        going().then_some(Everywhere { value, attained, support })
    }

    /// `d(C)` for one position, X in units of deg/h.
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

    /// Degree of `d` along a rotation.
    fn degree(&self) -> usize {
        let factors = self.platform.error_terms().iter().map(|t| t.factors.len()).max().unwrap_or(0);
        2 * (1 + factors)
    }
}

/// A function of the attitude on a net of Euler angles in degrees. Along alpha and gamma, which turn about fixed axes, it is a trigonometric
/// polynomial of degree n: 2 n + 1 values of each determine the others (the interpolation adds a few roundings to them).
fn on_net(
    step: usize,
    n: usize,
    energy: &(dyn Fn(&Matrix3<f64>) -> f64 + Sync),
) -> impl ParallelIterator<Item = ([f64; 3], f64)> {
    let nodes = 2 * n + 1;
    let node = move |i: usize| 360.0 * i as f64 / nodes as f64;
    let full: Vec<f64> = (0..360).step_by(step).map(f64::from).collect();
    let kernel = |x: f64| (1..=n).map(|k| 2.0 * (k as f64 * x).cos()).sum::<f64>() + 1.0;
    let weights =
        DMatrix::from_fn(full.len(), nodes, |a, i| kernel((full[a] - node(i)).to_radians()) / nodes as f64);
    let half: Vec<f64> = (0..=180).step_by(step).map(|b| f64::from(b) - 90.0).collect();
    half.into_par_iter().flat_map_iter(move |b| {
        let at =
            |i: usize, j: usize| [node(i), b, node(j)].map(|x| Angle::from_nanodeg((x * 1e9).round() as i64));
        let values = DMatrix::from_fn(nodes, nodes, |i, j| energy(&c_n_f64(&at(i, j))));
        let all = &weights * values * weights.transpose();
        let full = full.clone();
        (0..full.len() * full.len()).map(move |k| {
            let (i, j) = (k / full.len(), k % full.len());
            ([full[i], b, full[j]], all[(i, j)])
        })
    })
}

fn matrix(degrees: [f64; 3]) -> Matrix3<f64> {
    c_n_f64(&euler(degrees))
}

/// To hundredths of a degree.
fn euler(degrees: [f64; 3]) -> Euler {
    degrees.map(|x| Angle::from_nanodeg((x * 100.0).round() as i64 * 10_000_000))
}

/// The Euler angles of an attitude: `C = Mx(alpha) My(beta) Mz(gamma)`.
fn angles(c: &Matrix3<f64>) -> Euler {
    let beta = (-c[0][2]).clamp(-1.0, 1.0).asin();
    let (alpha, gamma) = if beta.cos().abs() > 1e-9 {
        (c[1][2].atan2(c[2][2]), c[0][1].atan2(c[0][0]))
    } else {
        // alpha and gamma turn about one axis
        ((-c[2][1]).atan2(c[1][1]), 0.0)
    };
    euler([alpha, beta, gamma].map(f64::to_degrees))
}

/// Attitudes where the energy is largest near the points of the coarse net that have most of it, largest first.
fn peaks(n: usize, energy: &(dyn Fn(&Matrix3<f64>) -> f64 + Sync)) -> Vec<Euler> {
    let mut points: Vec<([f64; 3], f64)> = on_net(COARSE, n, energy).collect();
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
    let polished = taken.into_par_iter().map(|(mut at, c)| {
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
    });
    polished.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Candidates;
    use obsdeg_core::model::Scheme;
    use obsdeg_evidence::simulation::Conditions;
    use obsdeg_exact::SplitMix64;

    /// What is interpolated is what it is where it is evaluated, whatever the terms; a degree less would not do.
    #[test]
    fn a_net_is_interpolated() {
        let mut rng = SplitMix64::new(3);
        for terms in ["F", "F,I,O,S", "F,II,OO", "F,I,GS,GM", "F,K0,K1,K2,M6"] {
            let base = Scheme {
                carry: obsdeg_core::model::Carry::Reset,
                latitude: "28.2".parse().ok(),
                unknowns: terms.parse().expect("terms"),
                ..Scheme::default()
            };
            let some = &Candidates::cardinals().attitudes[..1];
            let evaluator = Evaluator::new(&base, some, &[0], &Conditions::default()).expect("an evaluator");
            let mut draw = || rng.below(1 << 20) as f64 / f64::from(1 << 19) - 1.0;
            let x = DMatrix::from_fn(evaluator.n - 3, 3, |_, _| draw());
            let energy = |c: &Matrix3<f64>| evaluator.energy(c, &x);
            let off = |n: usize| {
                let all: Vec<_> = on_net(20, n, &energy).collect();
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
}

//! Degrees of schemes with steady turns in which not only drifts are unknown.
//!
//! Drifts alone are judged at attitudes of an arc. With accelerometer or torquer errors that method would
//! claim too much: at a steady rate w the drift integrates to `(D/w) sin(w t)` beside `K0 sin(w t)`, and to
//! `D t` beside `GS w t`. This module lets psi move while the platform turns:
//!
//! `psi' = F psi + eps(w t)`, `Z^(k) = H F^k psi + sum_{j<k} H F^(k-1-j) eps^(j) + a^(k)`,
//! `eps = C E(g, omega_c) D`, `a = C A(f) K`,
//!
//! with `omega_c` the earth rate and the rate of turning in c. Times are in a unit T: a rotation by phi at
//! the rate c/T takes `phi T/c`. The rows `T^k Z^(k)` at its start generate all of its samples over
//! `K[[T]]`. They are trigonometric polynomials of degree m and powers of time, and solve an equation of
//! order `2m + 4` with leading coefficient one. With the rows `T^k H F^k S_i` of positions they generate a
//! module L. A functional c has degree k if k is the smallest number with `T^k c` in L. At positions k is
//! the order of the derivative; what accumulates during a turn counts by its power of time. The rates c are
//! random: verdicts hold at almost all rates.
//!
//! A functional that is determined at one rate alone (`GS + D/w` as a number) is only in the last `V_k`,
//! which is the span of the rows at a random T.

use obsdeg_exact::series::{SeriesEchelon, SeriesRing};
use obsdeg_exact::{Echelon, Field, SplitMix64};

use super::filtration::Degrees;
use super::platform_rows::local_chain;
use super::transition::{LiftField, RandomTime, transition};
use crate::model::Carry;
use crate::model::attitude::{Matrix3, elementary, product, transpose, unit};
use crate::model::error_model::Columns;
use crate::model::platform::{
    FieldSample, LOCAL, PSI_EPS, Platform, PositionBlock, SteadyTurn, earth_rate_in, local_dynamics,
    local_output,
};
use crate::model::ring::Ring;

/// Order of the equation that Z(t) solves during a turn: `exp(i j angle)` with |j| up to m, the rotation of
/// the earth (three, one of them the constant again), and the accumulation of constants.
pub(super) const fn orders(harmonics: usize) -> usize {
    2 * harmonics + 4
}

/// Degree in the random values that a rotation adds to a row. The denominators that are cleared are `w` (m
/// times, and that of its duration), `W^2`, `1 + W^2 e^2`, `T` and `j^2 w^2 - W^2 T^2` (j up to m, degree
/// 4). The numerators have no higher degree, and derivatives have m more powers of w and T.
pub(super) const fn degree(harmonics: usize) -> usize {
    2 * (5 * harmonics + 9) + orders(harmonics)
}

/// Bits that a rotation adds to the entries of a row. The factors of [`degree`], `3m + 6` in all, have norms
/// of at most `1 + m^2`. Derivatives multiply by up to `m^k`, and the angle has its own denominator, up to
/// 180e9.
pub(super) fn bits(harmonics: usize) -> f64 {
    let m = harmonics as f64;
    (3.0 * m + 6.0) * (1.0 + m * m).log2() + orders(harmonics) as f64 * m.log2() + 38.0
}

/// The degrees, and the bases of `V_0, V_1, ...`, at one sample.
pub(super) fn filtration(platform: &Platform, sample: &FieldSample) -> (Degrees, Vec<Echelon>) {
    let field = sample.point.ring;
    let n = platform.names().len();
    let full = at_a_time(platform, sample);
    let mut precision = 8;
    let series = loop {
        let ring = SeriesRing { field, precision };
        let motion = |arc: &SteadyTurn| in_series(platform, sample, &ring, arc);
        let rows = rows(platform, sample, &ring, &ring.monomial(field.one(), 1), motion);
        let series = SeriesEchelon::new(ring, n, rows.into_iter().map(|r| r.concat()).collect());
        if series.rank() >= full.rank() && precision > 2 * series.largest_valuation() {
            break series;
        }
        precision *= 2;
    };
    let last = series.largest_valuation();
    let mut degrees = Degrees { degree: vec![None; n], ..Degrees::default() };
    let mut spans = Vec::new();
    for order in 0..=last {
        let mut basis = Echelon::new(field, n);
        for row in series.constants_of_order(order) {
            // beyond the precision of the series nothing is distinguished from zero
            if full.contains(&row) {
                basis.insert(&row);
            }
        }
        if order == last || basis.rank() == n {
            basis = full.clone();
        }
        for (c, degree) in degrees.degree.iter_mut().enumerate() {
            if degree.is_none() && basis.has_unit(c) {
                *degree = Some(order);
            }
        }
        degrees.rank_profile.push(basis.rank());
        let complete = basis.rank() == full.rank();
        spans.push(basis);
        if complete {
            break;
        }
    }
    degrees.excited = (0..n).map(|c| !full.is_zero_column(c)).collect();
    (degrees, spans)
}

/// Motion of psi in a rotation: `exp(F t)` over all of it, its integral over time in units of T, and
/// `(i j c - F T)^-1` for the harmonics j = -m..=m except 0.
struct PsiMotion<E> {
    phi: Matrix3<E>,
    integral: Matrix3<E>,
    resolvents: Vec<Option<Matrix3<E>>>,
}

/// Span of the rows at a random time T.
fn at_a_time(platform: &Platform, sample: &FieldSample) -> Echelon {
    let (field, point) = (sample.point.ring, &sample.point);
    // one seed for all embeddings
    let seed = sample.arcs.iter().flatten().fold(field.modulus(), |seed, arc| seed ^ arc.rate);
    let mut rng = SplitMix64::new(seed);
    let t = 1 + rng.below(field.modulus() - 1);
    let (t_squared, over_t) = (field.mul(t, t), field.inv(t));
    let motion = |arc: &SteadyTurn| {
        let time = field.mul(t, arc.duration);
        let earth = RandomTime::random(field, [point.w_n, point.w_u], time, &mut rng);
        let phi = earth.phi(1);
        // (s - F T)^-1 = (1 + (s F T + (F T)^2)/(s^2 + W^2 T^2))/s
        let resolvent = |s: u64| {
            let over_s = field.inv(s);
            let square = field.add(field.mul(s, s), field.mul(earth.w2, t_squared));
            let both = field.mul(over_s, field.inv(square));
            earth.combine([over_s, field.mul(field.mul(s, both), t), field.mul(both, t_squared)])
        };
        PsiMotion {
            phi: phi.map(|row| [row[0], row[1], row[2]]),
            integral: phi.map(|row| [row[3], row[4], row[5]].map(|x| field.mul(x, over_t))),
            resolvents: frequencies(platform, sample, arc).into_iter().map(|s| s.map(resolvent)).collect(),
        }
    };
    let mut full = Echelon::new(field, platform.names().len());
    for row in rows(platform, sample, &field, &t, motion) {
        full.insert(&row);
    }
    full
}

/// Frequencies `i j c` of the harmonics j = -m..=m of a rotation; `None` for j = 0.
fn frequencies(platform: &Platform, sample: &FieldSample, arc: &SteadyTurn) -> Vec<Option<u64>> {
    let (f, m) = (sample.point.ring, platform.errors().harmonics() as i64);
    let unit = f.mul(sample.roots.imaginary_unit(), arc.rate);
    (-m..=m).map(|j| (j != 0).then(|| f.mul(f.from_i64(j), unit))).collect()
}

/// Motion of psi in a rotation, as power series in T.
fn in_series(
    platform: &Platform,
    sample: &FieldSample,
    ring: &SeriesRing,
    arc: &SteadyTurn,
) -> PsiMotion<Vec<u64>> {
    let (field, point) = (ring.field, &sample.point);
    // one more order, which the integral loses
    let longer = SeriesRing { precision: ring.precision + 1, ..*ring };
    let phi = transition(&longer, point.w_n, point.w_u, arc.duration);
    let f = psi_dynamics(&field, point.w_n, point.w_u);
    // (s - F T)^-1 = sum (F T)^n / s^(n+1)
    let resolvent = |s: u64| {
        let mut out: Matrix3<Vec<u64>> = std::array::from_fn(|_| std::array::from_fn(|_| ring.zero()));
        let over_s = field.inv(s);
        let mut power = unit(&field).map(|row| row.map(|x| field.mul(x, over_s)));
        for n in 0..ring.precision {
            for (out, x) in out.iter_mut().flatten().zip(power.iter().flatten()) {
                out[n] = *x;
            }
            power = product(&field, &power, &f).map(|row| row.map(|x| field.mul(x, over_s)));
        }
        out
    };
    PsiMotion {
        phi: std::array::from_fn(|i| std::array::from_fn(|j| phi[i][j][..ring.precision].to_vec())),
        integral: std::array::from_fn(|i| std::array::from_fn(|j| phi[i][j + 3][1..].to_vec())),
        resolvents: frequencies(platform, sample, arc).into_iter().map(|s| s.map(resolvent)).collect(),
    }
}

/// Rows that generate L, in a ring that contains the field and T.
fn rows<R: LiftField>(
    platform: &Platform,
    sample: &FieldSample,
    ring: &R,
    t: &R::Element,
    mut motion: impl FnMut(&SteadyTurn) -> PsiMotion<R::Element>,
) -> Vec<Vec<R::Element>> {
    let point = &sample.point;
    let carry = platform.scheme().carry;
    let n = platform.names().len();
    let first = n - platform.coefficients();
    let lift = |m: &Matrix3<u64>| m.map(|row| row.map(|x| ring.lift(x)));
    let chain = local_chain(&point.ring, point.w_n, point.w_u, platform.observed());
    let most = chain.iter().map(|r| r.order).max().unwrap_or(0).max(orders(platform.errors().harmonics()));
    let mut powers = vec![ring.one()];
    (0..most).for_each(|k| powers.push(ring.mul(&powers[k], t)));

    let stations = platform.scheme().stations();
    let blocks = platform.blocks(point);
    let mut out = Vec::new();
    // psi^n as functionals of the unknowns, and psi in platform axes at the end of the last rotation
    let mut psi: Columns<R::Element> = Default::default();
    let mut left: Option<Columns<R::Element>> = None;
    for (i, (station, c)) in stations.iter().zip(&point.attitudes).enumerate() {
        if station.continues {
            continue;
        }
        psi = match (&left, carry) {
            (Some(_), Carry::Inertial) => jumped(platform, sample, ring, i, psi),
            (Some(before), Carry::Platform) => times(ring, &lift(c), before),
            _ => {
                let own = if carry == Carry::Reset { 3 * station.index } else { 0 };
                let entry = |r: usize, k: usize| {
                    if (own..own + 3).contains(&k) { ring.lift(c[r][k - own]) } else { ring.zero() }
                };
                std::array::from_fn(|r| (0..n).map(|k| entry(r, k)).collect())
            }
        };
        let Some(Some(arc)) = sample.arcs.get(station.index) else {
            for local in &chain {
                let row = at_rest(ring, &psi, local.row.map(|x| ring.lift(x)), &blocks[i], first);
                out.push(row.iter().map(|x| ring.mul(x, &powers[local.order])).collect());
            }
            left = Some(times(ring, &lift(&transpose(c)), &psi));
            continue;
        };
        let turning = RotationErrors::new(platform, sample, c, arc);
        out.extend(turning.rows(ring, &psi, &powers));
        psi = turning.moved(ring, &psi, t, &motion(arc));
        // the end of the arc is the next station
        left = Some(times(ring, &lift(&transpose(&point.attitudes[i + 1])), &psi));
    }
    out
}

/// `psi^n` after the turns to a station, with the torquer errors of these.
fn jumped<R: LiftField>(
    platform: &Platform,
    sample: &FieldSample,
    ring: &R,
    station: usize,
    psi: Columns<R::Element>,
) -> Columns<R::Element> {
    let point = &sample.point;
    let first = platform.names().len() - platform.coefficients();
    point.turns_to(station).iter().fold(psi, |psi, (from, turn)| {
        let jump = product(&point.ring, from, &turn.integral(&point.ring));
        let columns = platform.errors().torquer_columns(&point.ring, &turn.axis);
        std::array::from_fn(|r| {
            let more = |c: usize| point.ring.dot(0, (0..3).map(|j| (jump[r][j], columns[j][c - first])));
            let add = |(c, x): (usize, &R::Element)| {
                if c < first { x.clone() } else { ring.add(x, &ring.lift(more(c))) }
            };
            psi[r].iter().enumerate().map(add).collect()
        })
    })
}

/// A functional of the local unknowns at a position, as a functional of the unknowns of the scheme.
fn at_rest<R: LiftField>(
    ring: &R,
    psi: &Columns<R::Element>,
    row: [R::Element; LOCAL],
    block: &PositionBlock<u64>,
    first: usize,
) -> Vec<R::Element> {
    let n = psi[0].len();
    let entry = |c: usize| {
        let of_psi = ring.dot((0..3).map(|r| (&row[r], &psi[r][c])));
        let Some(k) = c.checked_sub(first) else { return of_psi };
        let rest = (3..LOCAL).filter_map(|r| Some((&row[r], ring.lift(*block.rows[r].get(3 + k)?))));
        rest.fold(of_psi, |sum, (x, y)| ring.add(&sum, &ring.mul(x, &y)))
    };
    (0..n).map(entry).collect()
}

/// Product `m v`.
fn times<R: Ring>(ring: &R, m: &Matrix3<R::Element>, v: &Columns<R::Element>) -> Columns<R::Element> {
    let entry = |r: usize, c: usize| ring.dot((0..3).map(|j| (&m[r][j], &v[j][c])));
    std::array::from_fn(|r| (0..v[0].len()).map(|c| entry(r, c)).collect())
}

/// Block of `F` that acts on `psi^n`.
fn psi_dynamics(field: &Field, w_n: u64, w_u: u64) -> Matrix3<u64> {
    let local = local_dynamics(field, &w_n, &w_u);
    std::array::from_fn(|i| std::array::from_fn(|j| local[i][j]))
}

/// Ring of the trigonometric polynomials of an angle with coefficients in a field: coefficients of
/// `exp(i j angle)` for j in `-degree..=degree`.
struct Harmonics<'a> {
    field: &'a Field,
    degree: usize,
}

impl Harmonics<'_> {
    /// Sum of the two first harmonics.
    fn wave(&self, plus: u64, minus: u64) -> Vec<u64> {
        let mut out = self.zero();
        (out[self.degree + 1], out[self.degree - 1]) = (plus, minus);
        out
    }

    fn constant(&self, x: u64) -> Vec<u64> {
        let mut out = self.zero();
        out[self.degree] = x;
        out
    }
}

impl Ring for Harmonics<'_> {
    type Element = Vec<u64>;
    fn zero(&self) -> Vec<u64> {
        vec![0; 2 * self.degree + 1]
    }
    fn one(&self) -> Vec<u64> {
        self.constant(self.field.one())
    }
    fn add(&self, a: &Vec<u64>, b: &Vec<u64>) -> Vec<u64> {
        a.iter().zip(b).map(|(&a, &b)| self.field.add(a, b)).collect()
    }
    fn mul(&self, a: &Vec<u64>, b: &Vec<u64>) -> Vec<u64> {
        let mut out = self.zero();
        for (i, &x) in a.iter().enumerate().filter(|(_, x)| **x != 0) {
            for (j, &y) in b.iter().enumerate().filter(|(_, y)| **y != 0) {
                // no product of a model has a higher degree
                let slot = &mut out[i + j - self.degree];
                *slot = self.field.add(*slot, self.field.mul(x, y));
            }
        }
        out
    }
    fn neg(&self, a: &Vec<u64>) -> Vec<u64> {
        a.iter().map(|&a| self.field.neg(a)).collect()
    }
    fn is_zero(&self, a: &Vec<u64>) -> bool {
        a.iter().all(|&a| a == 0)
    }
}

/// Errors along a rotation as trigonometric polynomials of its angle.
struct RotationErrors<'a> {
    platform: &'a Platform,
    sample: &'a FieldSample,
    arc: &'a SteadyTurn,
    /// Drift from torquer errors at the turning rate c, in n: three rows, one column per coefficient.
    turned: Columns<Vec<u64>>,
    /// Rest of the drift, `eps^n`.
    drift: Columns<Vec<u64>>,
    /// Error of the accelerometers in `Z^n`.
    accelerometer: Columns<Vec<u64>>,
}

impl<'a> RotationErrors<'a> {
    fn new(
        platform: &'a Platform,
        sample: &'a FieldSample,
        start: &Matrix3<u64>,
        arc: &'a SteadyTurn,
    ) -> Self {
        let (f, point, errors) = (&sample.point.ring, &sample.point, platform.errors());
        let ring = Harmonics { field: f, degree: errors.harmonics() };
        let half = f.from_ratio(1, 2);
        let over_2i = f.mul(half, f.neg(sample.roots.imaginary_unit()));
        let (cos, sin) = (ring.wave(half, half), ring.wave(over_2i, f.neg(over_2i)));
        let start = start.map(|row| row.map(|x| ring.constant(x)));
        let turn = elementary(&ring, arc.axis.index, &(cos, ring.neg(&sin)));
        let c =
            if arc.axis.geographic { product(&ring, &turn, &start) } else { product(&ring, &start, &turn) };
        // the axis is fixed in n and in c
        let about: [Vec<u64>; 3] =
            std::array::from_fn(|k| match (arc.axis.geographic, k == arc.axis.index) {
                (true, _) => start[arc.axis.index][k].clone(),
                (false, true) => ring.one(),
                (false, false) => ring.zero(),
            });
        let rate = ring.constant(arc.rate);
        let still = errors.drift_rows(&ring, &c, || [0; 3].map(|_| ring.zero()));
        let turned = errors.drift_rows(&ring, &c, || about.map(|x| ring.mul(&x, &rate)));
        let turned = std::array::from_fn(|r| {
            turned[r].iter().zip(&still[r]).map(|(a, b)| ring.add(a, &ring.neg(b))).collect()
        });
        let rates = [point.w_n, point.w_u].map(|x| ring.constant(x));
        let drift = errors.drift_rows(&ring, &c, || earth_rate_in(&ring, &c, &rates[0], &rates[1]));
        let accelerometer = errors.accelerometer_rows(&ring, &c);
        Self { platform, sample, arc, turned, drift, accelerometer }
    }

    /// Rows `T^k Z^(k)` at the start of the rotation for all orders k, as functionals of the unknowns.
    fn rows<R: LiftField>(
        &self,
        ring: &R,
        psi: &Columns<R::Element>,
        powers: &[R::Element],
    ) -> Vec<Vec<R::Element>> {
        let (f, point) = (&self.sample.point.ring, &self.sample.point);
        let orders = orders(self.platform.errors().harmonics());
        let n = psi[0].len();
        let coefficients = self.platform.coefficients();
        let frequencies = frequencies(self.platform, self.sample, self.arc);
        // derivatives at angle 0: the sums of the harmonics times their frequencies
        let derivatives = |of: &Columns<Vec<u64>>| -> Vec<[Vec<u64>; 3]> {
            let mut factors: Vec<u64> = frequencies.iter().map(|_| f.one()).collect();
            (0..orders)
                .map(|_| {
                    let at = |x: &Vec<u64>| f.dot(0, x.iter().copied().zip(factors.iter().copied()));
                    let now = of.each_ref().map(|row| row.iter().map(at).collect());
                    factors.iter_mut().zip(&frequencies).for_each(|(x, s)| *x = f.mul(*x, s.unwrap_or(0)));
                    now
                })
                .collect()
        };
        let [turned, drift, errors] = [&self.turned, &self.drift, &self.accelerometer].map(derivatives);
        let dynamics = psi_dynamics(f, point.w_n, point.w_u);
        let mut out = Vec::new();
        for (_, local) in local_output(f, self.platform.observed()) {
            // H F^k
            let mut functional: Vec<[u64; 3]> = vec![std::array::from_fn(|r| local[r])];
            for order in 0..orders {
                let now = functional[order];
                functional.push(std::array::from_fn(|k| f.dot(0, (0..3).map(|r| (now[r], dynamics[r][k])))));
            }
            for order in 0..orders {
                let lifted = functional[order].map(|x| ring.mul(&ring.lift(x), &powers[order]));
                let mut row: Vec<R::Element> =
                    (0..n).map(|c| ring.dot((0..3).map(|r| (&lifted[r], &psi[r][c])))).collect();
                for (c, slot) in row[n - coefficients..].iter_mut().enumerate() {
                    let dot = |h: &[u64; 3], of: &[Vec<u64>; 3]| f.dot(0, (0..3).map(|r| (h[r], of[r][c])));
                    let a = f.dot(0, (0..3).map(|r| (local[PSI_EPS + r], errors[order][r][c])));
                    *slot = ring.add(slot, &ring.lift(a));
                    for j in 0..order {
                        // T^(k-1-j) H F^(k-1-j) of eps^(j); the part from the earth rate and g has one more
                        // T
                        let k = order - 1 - j;
                        for (power, x) in
                            [(k, dot(&functional[k], &turned[j])), (k + 1, dot(&functional[k], &drift[j]))]
                        {
                            if x != 0 {
                                *slot = ring.add(slot, &ring.mul(&ring.lift(x), &powers[power]));
                            }
                        }
                    }
                }
                out.push(row);
            }
        }
        out
    }

    /// `psi^n` at the end of the rotation. With `eps = sum E_j exp(i j angle)` it is `exp(F t)` of its start
    /// value, the integral of `exp(F t)` times `E_0`, and `R_j exp(i j angle) - exp(F t) R_j` times `E_j`,
    /// with `R_j = (i j c - F T)^-1`.
    fn moved<R: LiftField>(
        &self,
        ring: &R,
        psi: &Columns<R::Element>,
        t: &R::Element,
        motion: &PsiMotion<R::Element>,
    ) -> Columns<R::Element> {
        let f = &self.sample.point.ring;
        let (m, first) = (self.platform.errors().harmonics(), psi[0].len() - self.platform.coefficients());
        let (cos, sin) = self.arc.cos_sin;
        let z = f.add(cos, f.mul(self.sample.roots.imaginary_unit(), sin));
        let mut moved = times(ring, &motion.phi, psi);
        for (k, resolvent) in motion.resolvents.iter().enumerate() {
            let matrix = resolvent.as_ref().map_or_else(
                || motion.integral.clone(),
                |r| {
                    let base = if k < m { f.inv(z) } else { z };
                    let turned = ring.lift(f.pow(base, k.abs_diff(m) as u64));
                    let before = product(ring, &motion.phi, r);
                    std::array::from_fn(|i| {
                        std::array::from_fn(|j| {
                            ring.add(&ring.mul(&r[i][j], &turned), &ring.neg(&before[i][j]))
                        })
                    })
                },
            );
            let part = |r: usize, c: usize| {
                ring.add(&ring.lift(self.turned[r][c][k]), &ring.mul(&ring.lift(self.drift[r][c][k]), t))
            };
            let eps: Columns<R::Element> =
                std::array::from_fn(|r| (0..self.platform.coefficients()).map(|c| part(r, c)).collect());
            for (row, more) in moved.iter_mut().zip(times(ring, &matrix, &eps)) {
                row[first..].iter_mut().zip(more).for_each(|(x, y)| *x = ring.add(x, &y));
            }
        }
        moved
    }
}

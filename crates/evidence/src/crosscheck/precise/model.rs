//! Model of a scheme in numbers of high precision.

use std::sync::Arc;

use obsdeg_core::model::{Angle, Carry, Dwell, ErrorSource, Geometry, PathStep, Scheme, Term, Unknowns};
use obsdeg_exact::SplitMix64;

use super::digits::{Constants, Digits, ROUNDING, Real, Vector, log2};

/// Fraction of the bits below which an entry of a sum of turns is cancellation residue, relative to the
/// largest entry.
const CANCELLED: f64 = 0.75;

/// Number of local unknowns: psi^n, eps^n, and the error a^n of the accelerometers.
pub(super) const LOCAL: usize = 9;

/// Observed output: an entry of psi^n with its sign, and an entry of a^n.
#[derive(Clone, Copy)]
struct PreciseOutput {
    psi: Option<(usize, bool)>,
    error: Option<usize>,
    azimuth: bool,
}

/// Model of a scheme in numbers.
#[derive(Clone)]
pub(in super::super) struct PreciseModel {
    pub(super) digits: Digits,
    /// Number of unknowns.
    pub(super) unknowns: usize,
    /// True if every position has its own psi.
    pub(super) reset: bool,
    /// Axes in which psi is carried, in n: one rotation for each position.
    pub(super) carried: Vec<[Vector; 3]>,
    /// Drift `eps^n` as a functional of the coefficients, for each position.
    pub(super) drifts: Vec<[Vector; 3]>,
    /// Accelerometer error `a^n` as a functional of the coefficients, for each position.
    pub(super) errors: Vec<[Vector; 3]>,
    /// Sum of the contributions of torquer errors to `psi^n` in all turns up to a position, as a functional
    /// of the coefficients.
    pub(super) torqued: Vec<[Vector; 3]>,
    /// Dwell of each position, relative to the first.
    ratios: Vec<Real>,
    /// Matrix of `psi x omega_ie`.
    turning: [Vector; 3],
    outputs: Vec<PreciseOutput>,
}

/// Weights of a sample of Z and of a measured azimuth: one over the variance of the noise.
pub(super) type Weights = [Real; 2];

/// Samples over the dwell of one position.
pub(super) struct Moments {
    /// Information on the local unknowns at the start of the position (9 x 9).
    pub(super) gram: Vec<Vector>,
    /// `psi^n` at the end of the position as a functional of `psi^n` and `eps^n` at its start (3 x 6).
    pub(super) end: [Vector; 3],
}

/// Attitude `C_c^n = Mx(alpha) My(beta) Mz(gamma)` (19).
fn attitude(d: Digits, angles: &[Angle; 3], constants: &mut Constants) -> [Vector; 3] {
    let [(ca, sa), (cb, sb), (cg, sg)] = angles.each_ref().map(|a| d.cos_sin(a.nanodeg(), constants));
    let (zero, one) = (d.int(0), d.int(1));
    let x = [[&one, &zero, &zero], [&zero, &ca, &sa], [&zero, &sa.neg(), &ca]].map(|r| r.map(Clone::clone));
    let y = [[&cb, &zero, &sb.neg()], [&zero, &one, &zero], [&sb, &zero, &cb]].map(|r| r.map(Clone::clone));
    let z = [[&cg, &sg, &zero], [&sg.neg(), &cg, &zero], [&zero, &zero, &one]].map(|r| r.map(Clone::clone));
    let times = |a: &[[Real; 3]; 3], b: &[[Real; 3]; 3]| -> [[Real; 3]; 3] {
        std::array::from_fn(|i| std::array::from_fn(|j| d.dot((0..3).map(|k| (&a[i][k], &b[k][j])))))
    };
    times(&times(&x, &y), &z).map(|row| row.to_vec())
}

/// Components of a vector of n in the axes of c.
fn in_c(d: Digits, c: &[Vector; 3], v: &[Real; 3]) -> Vector {
    (0..3).map(|j| d.dot((0..3).map(|i| (&c[i][j], &v[i])))).collect()
}

/// Unit matrix (3 x 3).
fn identity(d: Digits) -> [Vector; 3] {
    std::array::from_fn(|r| (0..3).map(|k| d.int(i64::from(r == k))).collect())
}

/// Component of a vector along a signed axis.
fn along(d: Digits, v: &[Real], axis: [i32; 3]) -> Real {
    v.iter().zip(axis).fold(d.int(0), |sum, (x, k)| d.add(&sum, &d.mul(x, &d.int(k.into()))))
}

/// Axis of c and factor of each coefficient of `terms`, by their definitions (IEEE Std 517, 529, 1293); terms
/// of a source other than `source` get zero. `x` is `g^c`, the torqued rate, or the specific force, in c.
fn acting(
    d: Digits,
    geometry: &Geometry,
    terms: &[Term],
    source: ErrorSource,
    x: &[Real],
) -> Vec<([i32; 3], Real)> {
    let gyros = [&geometry.X, &geometry.Y, &geometry.Z];
    let of_gyros = gyros.map(|g| g.I.vector());
    let a = &geometry.accelerometers;
    let of_accelerometers = [a.X.vector(), a.Y.vector(), a.Z.vector()];
    let mut out = Vec::new();
    for &term in terms {
        let inputs = if term.source() == ErrorSource::Force { of_accelerometers } else { of_gyros };
        for i in 0..3 {
            let own = along(d, x, inputs[i]);
            let square = d.mul(&own, &own);
            let others = |first: usize| (0..3).filter(move |&j| j != i && (first == 3 || j < i));
            let factors: Vec<Real> = match term {
                Term::GS | Term::K1 => vec![own],
                Term::GM | Term::M6 => others(3).map(|j| along(d, x, inputs[j])).collect(),
                Term::GM3 | Term::M3 => others(0).map(|j| along(d, x, inputs[j])).collect(),
                Term::K0 => vec![d.int(1)],
                Term::K2 => vec![square],
                Term::K3 => vec![d.mul(&square, &own)],
                Term::Kx => others(3).map(|j| d.mul(&own, &along(d, x, inputs[j]))).collect(),
                _ => {
                    let letters = term.letters().chars().filter(|l| *l != 'F');
                    vec![letters.fold(d.int(1), |product, letter| {
                        let axis = match letter {
                            'I' => gyros[i].I,
                            'O' => gyros[i].O,
                            _ => gyros[i].S,
                        };
                        d.mul(&product, &along(d, x, axis.vector()))
                    })]
                }
            };
            let counts = term.source() == source;
            out.extend(factors.into_iter().map(|f| (inputs[i], if counts { f } else { d.int(0) })));
        }
    }
    out
}

/// Contributions along axes of c, turned into n: three rows, one column per coefficient.
fn in_n(d: Digits, c: &[Vector; 3], acting: &[([i32; 3], Real)]) -> [Vector; 3] {
    std::array::from_fn(|r| acting.iter().map(|(axis, x)| d.mul(x, &along(d, &c[r], *axis))).collect())
}

fn plus(d: Digits, a: &[Vector; 3], b: &[Vector; 3]) -> [Vector; 3] {
    std::array::from_fn(|r| a[r].iter().zip(&b[r]).map(|(x, y)| d.add(x, y)).collect())
}

/// Product of `[v x]` with the columns of `m`.
fn crossed(d: Digits, v: &[Real], m: &[Vector; 3]) -> [Vector; 3] {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        m[j].iter().zip(&m[k]).map(|(y, z)| d.sub(&d.mul(&v[j], z), &d.mul(&v[k], y))).collect()
    })
}

/// Matrix `exp([u x] angle) m`, and the integral of `exp([u x] t) m` over t from 0 to `angle`, by their
/// series.
fn turned(d: Digits, u: &[Real], angle: &Real, m: &[Vector; 3]) -> [[Vector; 3]; 2] {
    let mut power = m.clone();
    let (mut rotated, mut integral) =
        (m.clone(), m.clone().map(|row| row.iter().map(|_| d.int(0)).collect::<Vector>()));
    for order in 1.. {
        // power = ([u x] angle)^(order-1)/(order-1)! m
        let factor = d.div(angle, &d.int(order));
        let step: [Vector; 3] = std::array::from_fn(|r| power[r].iter().map(|x| d.mul(x, &factor)).collect());
        integral = plus(d, &integral, &step);
        power = crossed(d, u, &step);
        rotated = plus(d, &rotated, &power);
        if power.iter().flatten().all(|x| log2(x).is_none_or(|e| e < -(d.bits as f64) - 8.0)) {
            return [rotated, integral];
        }
    }
    [rotated, integral]
}

/// Unit vector in c about which the platform turns from the attitude `from` to the attitude `to`.
fn axis_of(
    d: Digits,
    step: &PathStep,
    from: &[Vector; 3],
    to: &[Vector; 3],
    constants: &mut Constants,
) -> Vector {
    let unit = |i: usize| -> [Real; 3] { std::array::from_fn(|k| d.int(i64::from(k == i))) };
    match step {
        PathStep::Named { axis, .. } if axis.geographic => in_c(d, from, &unit(axis.index)),
        PathStep::Named { axis, .. } => unit(axis.index).to_vec(),
        PathStep::Middle { gamma, .. } => {
            // Mz^T e_y is the second row of Mz
            let (c, s) = d.cos_sin(gamma.nanodeg(), constants);
            vec![s.neg(), c, d.int(0)]
        }
        PathStep::Direct { about, .. } => {
            // R = C_to C_from^T = cos + (1 - cos) u u^T + sin [u x]
            let r = |i: usize, j: usize| d.dot(to[i].iter().zip(&from[j]));
            let odd: Vector =
                (0..3).map(|i| d.sub(&r((i + 2) % 3, (i + 1) % 3), &r((i + 1) % 3, (i + 2) % 3))).collect();
            let norm = |v: &Vector| d.dot(v.iter().zip(v)).sqrt(d.bits, ROUNDING);
            let long = norm(&odd);
            let v: Vector = if log2(&long).is_some_and(|e| e > -(d.bits as f64) / 2.0) {
                odd.iter().map(|x| d.div(x, &long)).collect()
            } else {
                // half a turn: R + 1 = 2 u u^T
                let k = (0..3).max_by(|a, b| about[*a].abs().total_cmp(&about[*b].abs())).unwrap_or(0);
                let column: Vector = (0..3).map(|i| d.add(&r(i, k), &d.int(i64::from(i == k)))).collect();
                let long = norm(&column);
                let forward = if about[k] < 0.0 { long.neg() } else { long };
                column.iter().map(|x| d.div(x, &forward)).collect()
            };
            in_c(d, from, &[v[0].clone(), v[1].clone(), v[2].clone()])
        }
    }
}

/// Sums of the contributions of torquer errors to `psi^n` in all turns up to each position, as functionals of
/// the coefficients; `none` adds nothing.
fn torqued(
    d: Digits,
    scheme: &Scheme,
    terms: &[Term],
    attitudes: &[[Vector; 3]],
    none: &[Vector; 3],
    constants: &mut Constants,
) -> Option<Vec<[Vector; 3]>> {
    let geometry = &scheme.geometry;
    let mut torqued = vec![none.clone(); attitudes.len()];
    for (i, steps) in scheme.paths().ok()?.iter().enumerate().skip(1) {
        let mut from = attitudes[i - 1].clone();
        let mut sum = torqued[i - 1].clone();
        for step in steps {
            let u = axis_of(d, step, &from, &attitudes[i], constants);
            let half_turns = d.div(&d.int(step.angle().nanodeg()), &d.int(180_000_000_000));
            let angle = d.mul(&half_turns, &constants.pi(d.bits));
            // E(u) in c, then turned on
            let unit = identity(d);
            let act = in_n(d, &unit, &acting(d, geometry, terms, ErrorSource::Rate, &u));
            let [_, left] = turned(d, &u, &angle, &act);
            let to_n = |c: &[Vector; 3], m: &[Vector; 3]| -> [Vector; 3] {
                std::array::from_fn(|r| {
                    (0..m[0].len()).map(|k| d.dot((0..3).map(|j| (&c[r][j], &m[j][k])))).collect()
                })
            };
            sum = plus(d, &sum, &to_n(&from, &left));
            let [on, _] = turned(d, &u, &angle, &unit);
            from = to_n(&from, &on);
        }
        torqued[i] = sum;
    }
    // cancellation residue, such as the sine of half a turn, is set to zero
    let largest = torqued.iter().flatten().flatten().filter_map(log2).fold(f64::MIN, f64::max);
    for x in torqued.iter_mut().flatten().flatten() {
        if log2(x).is_some_and(|size| size < largest - d.bits as f64 * CANCELLED) {
            *x = d.int(0);
        }
    }
    Some(torqued)
}

/// Observed outputs: `Z^n = (psi_z, 0, -psi_x) + a^n`, and psi_y where the azimuth is measured.
fn outputs(scheme: &Scheme) -> Vec<PreciseOutput> {
    let z =
        |psi: Option<(usize, bool)>, error: usize| PreciseOutput { psi, error: Some(error), azimuth: false };
    let mut out = vec![z(Some((2, false)), 0), z(Some((0, true)), 2)];
    if scheme.unknowns.have(ErrorSource::Force) {
        out.push(z(None, 1));
    }
    if scheme.measured_azimuth {
        out.push(PreciseOutput { psi: Some((1, false)), error: None, azimuth: true });
    }
    out
}

impl PreciseModel {
    /// Model of a scheme without generic angles and rotations, at its latitude. `None` when memory does not
    /// suffice for the constants, or without a latitude.
    pub(in super::super) fn new(scheme: &Scheme, digits: Digits) -> Option<Self> {
        let d = digits;
        let mut constants = Constants::new()?;
        let (w_n, w_u) = d.cos_sin(scheme.latitude?.nanodeg(), &mut constants);
        let attitudes: Vec<[Vector; 3]> =
            scheme.positions.iter().map(|p| attitude(d, &p.angles, &mut constants)).collect();
        let (psi, terms): (usize, &[Term]) = match &scheme.unknowns {
            Unknowns::Drift => (3, &[]),
            Unknowns::Coefficients(terms) if scheme.carry == Carry::Reset => (3 * attitudes.len(), terms),
            Unknowns::Coefficients(terms) => (3, terms),
        };
        let geometry = &scheme.geometry;
        let of = |c: &[Vector; 3], source, v: [Real; 3]| acting(d, geometry, terms, source, &in_c(d, c, &v));
        let zero = || d.int(0);
        let down = || [zero(), d.int(-1), zero()];
        let up = || [zero(), d.int(1), zero()];
        let earth = || [w_n.clone(), w_u.clone(), zero()];
        let drifts: Vec<[Vector; 3]> = match &scheme.unknowns {
            Unknowns::Coefficients(_) => attitudes
                .iter()
                .map(|c| {
                    let gravity = in_n(d, c, &of(c, ErrorSource::Gravity, down()));
                    plus(d, &gravity, &in_n(d, c, &of(c, ErrorSource::Rate, earth())))
                })
                .collect(),
            // the total drift in n is an unknown itself
            Unknowns::Drift => vec![identity(d); attitudes.len()],
        };
        let none: [Vector; 3] = std::array::from_fn(|r| drifts[0][r].iter().map(|_| zero()).collect());
        let errors = match &scheme.unknowns {
            Unknowns::Coefficients(_) => {
                attitudes.iter().map(|c| in_n(d, c, &of(c, ErrorSource::Force, up()))).collect()
            }
            Unknowns::Drift => vec![none.clone(); attitudes.len()],
        };
        let torqued = match scheme.unknowns.have(ErrorSource::Rate) {
            true => torqued(d, scheme, terms, &attitudes, &none, &mut constants)?,
            false => vec![none; attitudes.len()],
        };
        let seconds = |i: usize| scheme.positions[i].dwell.unwrap_or(Dwell::PAPER).seconds();
        let ratios =
            (0..attitudes.len()).map(|i| d.div(&d.double(seconds(i)), &d.double(seconds(0)))).collect();
        let turning = [
            vec![zero(), zero(), w_u.neg()],
            vec![zero(), zero(), w_n.clone()],
            vec![w_u.clone(), w_n.neg(), zero()],
        ];
        let unknowns = psi + drifts[0][0].len();
        let reset = scheme.carry == Carry::Reset && scheme.unknowns != Unknowns::Drift;
        let carried = match (&scheme.unknowns, scheme.carry) {
            (Unknowns::Drift, _) => vec![identity(d); attitudes.len()],
            (_, Carry::Inertial) => vec![attitudes[0].clone(); attitudes.len()],
            _ => attitudes,
        };
        let outputs = outputs(scheme);
        Some(Self { digits, unknowns, reset, carried, drifts, errors, torqued, ratios, turning, outputs })
    }

    /// Model with every number changed at random by up to `2^log2`: the effect of rounding on a model of
    /// doubles.
    pub(in super::super) fn rounded(&self, log2: i32, rng: &mut SplitMix64) -> Self {
        let d = self.digits;
        let mut out = self.clone();
        let parts = [&mut out.carried, &mut out.drifts, &mut out.errors, &mut out.torqued];
        let rows = parts.into_iter().flatten().chain([&mut out.turning]).flatten();
        for x in rows.flatten() {
            let part = rng.below(1 << 53) as f64 / (1u64 << 52) as f64 - 1.0;
            *x = d.add(x, &d.double(part * f64::from(log2).exp2()));
        }
        out
    }

    /// `psi^n` at a time as a functional of `psi^n` and `eps^n` at the start (3 x 6), by the series of
    /// `psi' = psi x omega + eps`.
    fn moved(&self, time: &Real) -> [Vector; 3] {
        let d = self.digits;
        let mut term: [Vector; 3] =
            std::array::from_fn(|r| (0..6).map(|k| d.int(i64::from(r == k))).collect());
        let mut sum = term.clone();
        for order in 1.. {
            let factor = d.div(time, &d.int(order));
            term = std::array::from_fn(|r| {
                let entry = |k: usize| {
                    let turned = d.dot((0..3).map(|j| (&self.turning[r][j], &term[j][k])));
                    // eps is constant: it enters once
                    if order == 1 && k == r + 3 { d.add(&turned, &d.int(1)) } else { turned }
                };
                (0..6).map(|k| d.mul(&factor, &entry(k))).collect()
            });
            let vanishes =
                |x: &Real| log2(x).is_none_or(|e| e < -(d.bits as f64) - 8.0 + log2(time).unwrap_or(0.0));
            for (s, t) in sum.iter_mut().flatten().zip(term.iter().flatten()) {
                *s = d.add(s, t);
            }
            if term.iter().flatten().all(vanishes) {
                break;
            }
        }
        sum
    }

    /// Samples at the ends of equal steps over the dwell of each position; the first position lasts
    /// `dwell / w_ie`. `samples` has the number per position. Positions of equal dwell share them.
    pub(super) fn moments(&self, dwell: f64, samples: &[usize], weights: &Weights) -> Vec<Arc<Moments>> {
        let d = self.digits;
        let mut out: Vec<Arc<Moments>> = Vec::new();
        for (i, (ratio, &count)) in self.ratios.iter().zip(samples).enumerate() {
            let same = |j: usize| self.ratios[j] == *ratio && samples[j] == count;
            let known = (0..i).find(|&j| same(j)).map(|j| out[j].clone());
            let new = || Arc::new(self.of_dwell(&d.mul(ratio, &d.double(dwell)), count, weights));
            out.push(known.unwrap_or_else(new));
        }
        out
    }

    /// Sum `sum_k F^k^T G F^k` for k = 1 to `count`, by doubling, with the step `F` and the information `G`
    /// of a sample.
    fn of_dwell(&self, dwell: &Real, count: usize, weights: &Weights) -> Moments {
        let d = self.digits;
        let sample = self.sample(weights);
        let step = self.moved(&d.div(dwell, &d.int(count as i64)));
        let (mut gram, mut end) = (congruent(d, &sample, &step), step.clone());
        // bits of the count below the highest
        for bit in (0..count.max(1).ilog2()).rev() {
            gram = sum(d, &gram, &congruent(d, &gram, &end));
            end = composed(d, &end, &end);
            if count >> bit & 1 == 1 {
                gram = congruent(d, &sum(d, &gram, &sample), &step);
                end = composed(d, &step, &end);
            }
        }
        Moments { gram, end }
    }

    /// Information of one sample on the local unknowns at its time (9 x 9).
    fn sample(&self, weights: &Weights) -> Vec<Vector> {
        let d = self.digits;
        let mut out = vec![vec![d.int(0); LOCAL]; LOCAL];
        for output in &self.outputs {
            let weight = &weights[usize::from(output.azimuth)];
            let psi = output.psi.map(|(i, negative)| (i, d.int(if negative { -1 } else { 1 })));
            let row: Vec<(usize, Real)> =
                psi.into_iter().chain(output.error.map(|k| (6 + k, d.int(1)))).collect();
            for (i, x) in &row {
                for (j, y) in &row {
                    out[*i][*j] = d.add(&out[*i][*j], &d.mul(weight, &d.mul(x, y)));
                }
            }
        }
        out
    }
}

/// Sum of two matrices.
fn sum(d: Digits, a: &[Vector], b: &[Vector]) -> Vec<Vector> {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(x, y)| d.add(x, y)).collect()).collect()
}

/// Congruence `F^T G F` of a symmetric `G` (9 x 9); `F` moves psi (3 x 6) and leaves eps and a.
fn congruent(d: Digits, g: &[Vector], f: &[Vector; 3]) -> Vec<Vector> {
    let column = |k: usize| f.iter().map(move |row| &row[k]);
    // row by row: G F, whose columns from 3 on also have those of G
    let right: Vec<Vector> = (0..LOCAL)
        .map(|i| {
            let entry = |k: usize| match k {
                0..3 => d.dot(g[i].iter().zip(column(k))),
                3..6 => d.add(&g[i][k], &d.dot(g[i].iter().zip(column(k)))),
                _ => g[i][k].clone(),
            };
            (0..LOCAL).map(entry).collect()
        })
        .collect();
    let mut out = vec![vec![d.int(0); LOCAL]; LOCAL];
    for (i, k) in (0..LOCAL).flat_map(|i| (i..LOCAL).map(move |k| (i, k))) {
        let own = || right.iter().map(|row| &row[k]);
        let x = match i {
            0..3 => d.dot(own().zip(column(i))),
            3..6 => d.add(&right[i][k], &d.dot(own().zip(column(i)))),
            _ => right[i][k].clone(),
        };
        out[k][i] = x.clone();
        out[i][k] = x;
    }
    out
}

/// Map of psi by `first`, then by `after` (3 x 6).
fn composed(d: Digits, after: &[Vector; 3], first: &[Vector; 3]) -> [Vector; 3] {
    std::array::from_fn(|r| {
        let entry = |k: usize| {
            let moved = d.dot(after[r].iter().zip(first.iter().map(|row| &row[k])));
            if k < 3 { moved } else { d.add(&moved, &after[r][k]) }
        };
        (0..6).map(entry).collect()
    })
}

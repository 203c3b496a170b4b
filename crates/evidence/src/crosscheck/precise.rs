//! The information of samples over dwells as short as one likes, in as many digits as that takes: what slopes, ranks
//! and null vectors of doubles cannot show where positions hardly differ.
//!
//! Written from the equations of the paper, (2), (3), (6) to (9) and (19): of the exact engine it takes nothing, and of
//! the model only what a scheme says (angles, latitude, mounting, terms). The unit of time is 1/w_ie, so that drifts are
//! in units of the earth rate.

use astro_float_num::{BigFloat, Consts, RoundingMode, WORD_BIT_SIZE};
use obsdeg_core::model::{Angle, Carry, Dwell, Geometry, PathStep, Scheme, Source, Term, Unknowns};

/// A number of many digits.
pub(super) type Real = BigFloat;
type Vector = Vec<Real>;

/// What becomes of psi between the start of one position and that of the next, besides the carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Between {
    /// Nothing: Phi = 1. What samples determine then is what derivatives do.
    Nothing,
    /// It moves during the dwell.
    Dwell,
}

/// Samples of Z in a position: more than any derivative that a solution needs.
const SAMPLES: i64 = 6;
/// A pivot is seen above the first of these parts of the digits, relative to the diagonal; the errors that Cholesky's elimination
/// then makes are within half of it, and what is below the second is rounding. Between them nothing is certain.
const CLEAR: f64 = 10.0 / 16.0;
const ROUNDING_BELOW: f64 = 11.0 / 16.0;
/// What is left of a functional whose coefficients are doubles, beside its largest coefficient (drifts in units of the earth rate), in bits: what
/// their rounding spreads to other unknowns, and far below the 1e-11 by which positions differ at least.
const NEGLIGIBLE: f64 = -46.0;
/// A sum of errors is at most so many bits more than the largest of them.
const SUMMED: f64 = 8.0;

/// Arithmetic of so many bits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Digits {
    pub(super) bits: usize,
}

const ROUNDING: RoundingMode = RoundingMode::None;

impl Digits {
    fn int(self, x: i64) -> Real {
        Real::from_i64(x, self.bits)
    }

    pub(super) fn double(self, x: f64) -> Real {
        Real::from_f64(x, self.bits)
    }

    fn add(self, a: &Real, b: &Real) -> Real {
        a.add(b, self.bits, ROUNDING)
    }

    fn sub(self, a: &Real, b: &Real) -> Real {
        a.sub(b, self.bits, ROUNDING)
    }

    fn mul(self, a: &Real, b: &Real) -> Real {
        a.mul(b, self.bits, ROUNDING)
    }

    fn div(self, a: &Real, b: &Real) -> Real {
        a.div(b, self.bits, ROUNDING)
    }

    fn dot<'a>(self, terms: impl Iterator<Item = (&'a Real, &'a Real)>) -> Real {
        let terms = terms.filter(|(a, b)| !a.is_zero() && !b.is_zero());
        terms.fold(self.int(0), |sum, (a, b)| self.add(&sum, &self.mul(a, b)))
    }

    /// Cosine and sine of 1e-9 degrees; exact at quarter turns.
    fn cos_sin(self, nanodeg: i64, constants: &mut Constants) -> (Real, Real) {
        const QUARTER: i64 = 90_000_000_000;
        let (quarters, rest) = (nanodeg.div_euclid(QUARTER).rem_euclid(4), nanodeg.rem_euclid(QUARTER));
        let (c, s) = if rest == 0 {
            (self.int(1), self.int(0))
        } else {
            let turn = self.div(&self.int(rest), &self.int(2 * QUARTER));
            let x = self.mul(&turn, &constants.pi(self.bits));
            (x.cos(self.bits, ROUNDING, &mut constants.0), x.sin(self.bits, ROUNDING, &mut constants.0))
        };
        match quarters {
            0 => (c, s),
            1 => (s.neg(), c),
            2 => (c.neg(), s.neg()),
            _ => (s, c.neg()),
        }
    }
}

/// Cosines, sines and pi.
struct Constants(Consts);

impl Constants {
    fn pi(&mut self, bits: usize) -> Real {
        self.0.pi(bits, ROUNDING)
    }
}

/// Of the digits of a sum in turns, the part that is never lost: what is smaller is the rest of what cancels.
const CANCELLED: f64 = 0.75;

/// Local unknowns: psi^n, eps^n, and the error a^n of the accelerometers.
const LOCAL: usize = 9;

/// A local unknown at the start of a position as a functional: nine rows, one entry per column.
struct Local {
    columns: Vec<usize>,
    rows: [Vector; LOCAL],
}

/// What is observed: an entry of psi^n, its sign, and an entry of a^n.
#[derive(Clone, Copy)]
struct Output {
    psi: Option<(usize, bool)>,
    error: Option<usize>,
    azimuth: bool,
}

/// A scheme in numbers.
struct Model {
    digits: Digits,
    unknowns: usize,
    /// `C_c^n`, rows in n.
    attitudes: Vec<[Vector; 3]>,
    /// `eps^n` as a functional of the coefficients.
    drifts: Vec<[Vector; 3]>,
    /// `a^n` as a functional of the coefficients.
    errors: Vec<[Vector; 3]>,
    /// What torquer errors have added to `psi^n` in all turns up to a position, as a functional of the coefficients.
    torqued: Vec<[Vector; 3]>,
    /// Dwells in those of the first position.
    ratios: Vec<Real>,
    /// `psi x omega_ie` as a matrix.
    turning: [Vector; 3],
    outputs: Vec<Output>,
}

/// `C_c^n = Mx(alpha) My(beta) Mz(gamma)` (19).
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

/// The components of a vector of n in the axes of c.
fn in_c(d: Digits, c: &[Vector; 3], v: &[Real; 3]) -> Vector {
    (0..3).map(|j| d.dot((0..3).map(|i| (&c[i][j], &v[i])))).collect()
}

/// The component along a signed axis.
fn along(d: Digits, v: &[Real], axis: [i32; 3]) -> Real {
    v.iter().zip(axis).fold(d.int(0), |sum, (x, k)| d.add(&sum, &d.mul(x, &d.int(k.into()))))
}

/// What the coefficients of `terms` are multiplied with and along which axis of c they act, by their definitions (IEEE Std 517, 529, 1293): those
/// of `source`, others with zero. `x` is `g^c`, the torqued rate, or the specific force, in c.
fn acting(
    d: Digits,
    geometry: &Geometry,
    terms: &[Term],
    source: Source,
    x: &[Real],
) -> Vec<([i32; 3], Real)> {
    let gyros = [&geometry.X, &geometry.Y, &geometry.Z];
    let of_gyros = gyros.map(|g| g.I.vector());
    let a = &geometry.accelerometers;
    let of_accelerometers = [a.X.vector(), a.Y.vector(), a.Z.vector()];
    let mut out = Vec::new();
    for &term in terms {
        let inputs = if term.source() == Source::Force { of_accelerometers } else { of_gyros };
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

/// What acts along axes of c, in n: three rows, a column per coefficient.
fn in_n(d: Digits, c: &[Vector; 3], acting: &[([i32; 3], Real)]) -> [Vector; 3] {
    std::array::from_fn(|r| acting.iter().map(|(axis, x)| d.mul(x, &along(d, &c[r], *axis))).collect())
}

fn plus(d: Digits, a: &[Vector; 3], b: &[Vector; 3]) -> [Vector; 3] {
    std::array::from_fn(|r| a[r].iter().zip(&b[r]).map(|(x, y)| d.add(x, y)).collect())
}

/// `[v x]` applied to columns.
fn crossed(d: Digits, v: &[Real], m: &[Vector; 3]) -> [Vector; 3] {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        m[j].iter().zip(&m[k]).map(|(y, z)| d.sub(&d.mul(&v[j], z), &d.mul(&v[k], y))).collect()
    })
}

/// `exp([u x] angle) m` and the integral of `exp([u x] t) m` over t from 0 to `angle`, by their series.
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

/// The unit vector in c about which the platform turns from `from`, where it stands at `to` afterwards.
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
            // Mz^T e_y, the second row of Mz
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

impl Model {
    /// A scheme without generic angles and rotations, at its latitude.
    fn new(scheme: &Scheme, digits: Digits) -> Option<Self> {
        let d = digits;
        let mut constants = Constants(Consts::new().ok()?);
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
                    let gravity = in_n(d, c, &of(c, Source::Gravity, down()));
                    plus(d, &gravity, &in_n(d, c, &of(c, Source::Rate, earth())))
                })
                .collect(),
            // the total drift in n is unknown itself
            Unknowns::Drift => {
                let unit = |r: usize| (0..3).map(|k| d.int(i64::from(r == k))).collect();
                vec![std::array::from_fn(unit); attitudes.len()]
            }
        };
        let none: [Vector; 3] = std::array::from_fn(|r| drifts[0][r].iter().map(|_| zero()).collect());
        let errors = match &scheme.unknowns {
            Unknowns::Coefficients(_) => {
                attitudes.iter().map(|c| in_n(d, c, &of(c, Source::Force, up()))).collect()
            }
            Unknowns::Drift => vec![none.clone(); attitudes.len()],
        };
        let mut torqued = vec![none; attitudes.len()];
        for (i, steps) in scheme.paths().ok()?.iter().enumerate().skip(1) {
            let mut from = attitudes[i - 1].clone();
            let mut sum = torqued[i - 1].clone();
            for step in steps {
                let u = axis_of(d, step, &from, &attitudes[i], &mut constants);
                let half_turns = d.div(&d.int(step.angle().nanodeg()), &d.int(180_000_000_000));
                let angle = d.mul(&half_turns, &constants.pi(d.bits));
                // E(u) in c, then turned on
                let unit: [Vector; 3] =
                    std::array::from_fn(|r| (0..3).map(|k| d.int(i64::from(r == k))).collect());
                let act = in_n(d, &unit, &acting(d, geometry, terms, Source::Rate, &u));
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
        // what rounding leaves of terms that cancel, as the sine of half a turn, is nothing
        let largest = torqued.iter().flatten().flatten().filter_map(log2).fold(f64::MIN, f64::max);
        for x in torqued.iter_mut().flatten().flatten() {
            if log2(x).is_some_and(|size| size < largest - digits.bits as f64 * CANCELLED) {
                *x = d.int(0);
            }
        }
        let seconds = |i: usize| scheme.positions[i].dwell.unwrap_or(Dwell::PAPER).seconds();
        let ratios =
            (0..attitudes.len()).map(|i| d.div(&d.double(seconds(i)), &d.double(seconds(0)))).collect();
        let turning = [
            vec![zero(), zero(), w_u.neg()],
            vec![zero(), zero(), w_n.clone()],
            vec![w_u.clone(), w_n.neg(), zero()],
        ];
        // Z^n = (psi_z, 0, -psi_x) + a^n, and psi_y where the azimuth is measured
        let z = |psi: Option<(usize, bool)>, error: usize| Output { psi, error: Some(error), azimuth: false };
        let mut outputs = vec![z(Some((2, false)), 0), z(Some((0, true)), 2)];
        if scheme.unknowns.have(Source::Force) {
            outputs.push(z(None, 1));
        }
        if scheme.measured_azimuth {
            outputs.push(Output { psi: Some((1, false)), error: None, azimuth: true });
        }
        let unknowns = psi + drifts[0][0].len();
        Some(Self { digits, unknowns, attitudes, drifts, errors, torqued, ratios, turning, outputs })
    }

    /// `psi^n` at a time as a functional of `psi^n` and `eps^n` at the start (3 x 6): the series of `psi' = psi x omega + eps`.
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

    /// The information of samples over a dwell on the local unknowns at its start (9 x 9).
    fn gram(&self, dwell: &Real, azimuth: f64) -> Vec<Vector> {
        let d = self.digits;
        let step = d.div(dwell, &d.int(SAMPLES));
        let mut out = vec![vec![d.int(0); LOCAL]; LOCAL];
        for k in 1..=SAMPLES {
            let moved = self.moved(&d.mul(&step, &d.int(k)));
            for output in &self.outputs {
                let mut row = vec![d.int(0); LOCAL];
                if let Some((psi, negative)) = output.psi {
                    for (x, y) in row.iter_mut().zip(&moved[psi]) {
                        *x = if negative { y.neg() } else { y.clone() };
                    }
                }
                if let Some(k) = output.error {
                    row[6 + k] = d.int(1);
                }
                let weight = if output.azimuth { &d.mul(&step, &d.double(azimuth)) } else { &step };
                for (i, entries) in out.iter_mut().enumerate() {
                    for (j, entry) in entries.iter_mut().enumerate() {
                        *entry = d.add(entry, &d.mul(weight, &d.mul(&row[i], &row[j])));
                    }
                }
            }
        }
        out
    }
}

/// Binary logarithm of a magnitude; `None` of zero.
pub(super) fn log2(x: &Real) -> Option<f64> {
    let (words, _, _, exponent, _) = x.as_raw_parts()?;
    // the mantissa is in 0.5..1, its highest word last
    let top = words.last().filter(|w| **w != 0)?;
    Some(f64::from(exponent) + (*top as f64).log2() - WORD_BIT_SIZE as f64)
}

/// A number in double precision.
pub(super) fn double(x: &Real) -> f64 {
    let sign = if x.is_negative() { -1.0 } else { 1.0 };
    log2(x).map_or(0.0, |e| sign * e.exp2())
}

/// The magnitude of a sum of products (or of numbers), in that of its parts.
pub(super) fn add_up<'a>(d: Digits, parts: impl Iterator<Item = (Option<&'a Real>, &'a Real)>) -> f64 {
    let (mut sum, mut size) = (d.int(0), d.int(0));
    for (factor, x) in parts {
        let part = factor.map_or_else(|| x.clone(), |f| d.mul(f, x));
        sum = d.add(&sum, &part);
        size = d.add(&size, &part.abs());
    }
    if size.is_zero() { 0.0 } else { double(&d.div(&sum.abs(), &size)) }
}

/// The information of all samples on the unknowns at the start.
pub(super) struct Information {
    digits: Digits,
    matrix: Vec<Vector>,
    /// psi of the end in the carried axes as functionals of the unknowns at the start, where psi is handed on.
    psi_at_end: Option<[Vector; 3]>,
}

impl Information {
    /// Of `scheme`, whose first position lasts `dwell / w_ie`, the others in proportion, at a density of noise of one; `azimuth` is the
    /// weight of a measured azimuth beside Z. `None` when there is no memory for constants, or no latitude.
    pub(super) fn new(
        scheme: &Scheme,
        between: Between,
        dwell: f64,
        digits: Digits,
        azimuth: f64,
    ) -> Option<Self> {
        let d = digits;
        let model = Model::new(scheme, d)?;
        let reset = scheme.carry == Carry::Reset && scheme.unknowns != Unknowns::Drift;
        let n = model.unknowns;
        let coefficients = model.drifts[0][0].len();
        let first = n - coefficients;
        let unit = |r: usize| (0..3 + coefficients).map(|k| d.int(i64::from(r == k))).collect::<Vector>();
        // psi in the carried axes, as functionals of psi at the start and the coefficients
        let mut psi: [Vector; 3] = std::array::from_fn(unit);
        let mut matrix = vec![vec![d.int(0); n]; n];
        for (i, (c, drift)) in model.attitudes.iter().zip(&model.drifts).enumerate() {
            let to_n = match (&scheme.unknowns, scheme.carry) {
                (Unknowns::Drift, _) => &std::array::from_fn(|r| unit(r)[..3].to_vec()),
                (_, Carry::Inertial) => &model.attitudes[0],
                _ => c,
            };
            if reset {
                psi = std::array::from_fn(unit);
            }
            let own = if reset { 3 * i } else { 0 };
            let columns: Vec<usize> = (own..own + 3).chain(first..n).collect();
            let behind =
                |row: &Vector| (0..3).map(|_| d.int(0)).chain(row.iter().cloned()).collect::<Vector>();
            // in turns at once torquers add to psi^n, not to the psi that is carried
            let torqued: [Vector; 3] = std::array::from_fn(|r| behind(&model.torqued[i][r]));
            let carried = |r: usize, k: usize| d.dot((0..3).map(|j| (&to_n[r][j], &psi[j][k])));
            let rows: [Vector; LOCAL] = std::array::from_fn(|r| match r {
                0..3 => (0..columns.len()).map(|k| d.add(&carried(r, k), &torqued[r][k])).collect(),
                3..6 => behind(&drift[r - 3]),
                _ => behind(&model.errors[i][r - 6]),
            });
            let local = Local { columns, rows };
            let dwell = d.mul(&model.ratios[i], &d.double(dwell));
            local.add(d, &model.gram(&dwell, azimuth), &mut matrix);
            if between == Between::Dwell && !reset {
                let moved = model.moved(&dwell);
                let after: [Vector; 3] = std::array::from_fn(|r| {
                    // what the dwell makes of torqued psi^n, less that itself: no digits of it are left where nothing moves it
                    let change = |j: usize| d.sub(&moved[r][j], &d.int(i64::from(r == j)));
                    let change: [Real; 3] = std::array::from_fn(change);
                    let after = |k: usize| {
                        let own: Vector = (0..3).map(|j| carried(j, k)).collect();
                        let own = own.iter().chain((3..6).map(|j| &local.rows[j][k]));
                        d.dot(
                            moved[r].iter().zip(own).chain(change.iter().zip((0..3).map(|j| &torqued[j][k]))),
                        )
                    };
                    (0..local.columns.len()).map(after).collect()
                });
                psi = std::array::from_fn(|j| {
                    (0..local.columns.len())
                        .map(|k| d.dot((0..3).map(|r| (&to_n[r][j], &after[r][k]))))
                        .collect()
                });
            }
        }
        Some(Self { digits, matrix, psi_at_end: (!reset).then_some(psi) })
    }
}

impl Local {
    /// Adds `L^T G L`.
    fn add(&self, d: Digits, gram: &[Vector], matrix: &mut [Vector]) {
        let c = self.columns.len();
        let weighted: Vec<Vector> = gram
            .iter()
            .map(|g| (0..c).map(|k| d.dot(g.iter().zip(self.rows.iter().map(|r| &r[k])))).collect())
            .collect();
        for (i, &row) in self.columns.iter().enumerate() {
            for (j, &column) in self.columns.iter().enumerate().skip(i) {
                let entry = d.dot(self.rows.iter().map(|r| &r[i]).zip(weighted.iter().map(|w| &w[j])));
                let sum = d.add(&matrix[row][column], &entry);
                matrix[column][row] = sum.clone();
                matrix[row][column] = sum;
            }
        }
    }
}

/// What is seen: `N = sum l_k l_k^T`, best seen first.
pub(super) struct Seen {
    digits: Digits,
    /// The unknown of every pivot.
    pub(super) pivots: Vec<usize>,
    /// `l_k` (n entries each).
    columns: Vec<Vector>,
    /// Binary logarithms of the pivots, descending.
    pub(super) sizes: Vec<f64>,
    /// Of every unknown: whether its column is not zero.
    pub(super) excited: Vec<bool>,
    /// Binary logarithms of the diagonal of N.
    own: Vec<f64>,
    psi_at_end: Option<[Vector; 3]>,
}

impl Information {
    /// The information on unknowns that are measured in these units.
    pub(super) fn scaled(mut self, units: &[f64]) -> Self {
        let d = self.digits;
        for (i, row) in self.matrix.iter_mut().enumerate() {
            for (x, unit) in row.iter_mut().zip(units) {
                *x = d.mul(x, &d.mul(&d.double(*unit), &d.double(units[i])));
            }
        }
        self
    }

    /// Cholesky factors, the largest pivot first; `None` where what is seen and rounding are not told apart.
    pub(super) fn seen(mut self) -> Option<Seen> {
        let d = self.digits;
        let n = self.matrix.len();
        let diagonal = |m: &[Vector], c: usize| log2(&m[c][c]);
        let own: Vec<Option<f64>> = (0..n).map(|c| diagonal(&self.matrix, c)).collect();
        let largest = own.iter().flatten().copied().fold(f64::MIN, f64::max);
        let [rounding, clear] = [ROUNDING_BELOW, CLEAR].map(|part| -part * d.bits as f64);
        // a column whose entries are rounding is below its square; what is seen is above
        let excited: Vec<bool> =
            own.iter().map(|x| x.is_some_and(|x| x - largest > 2.0 * rounding)).collect();
        let doubtful = |x: f64| x - largest > 2.0 * rounding && x - largest < 2.0 * clear;
        if own.iter().flatten().any(|x| doubtful(*x)) {
            return None;
        }
        let mut left: Vec<usize> = (0..n).filter(|&c| excited[c]).collect();
        let (mut pivots, mut columns, mut sizes): (Vec<usize>, Vec<Vector>, Vec<f64>) = Default::default();
        loop {
            // what is left of a column, in its own
            let part = |c: usize| Some((c, diagonal(&self.matrix, c)?, own[c]?));
            let parts = || left.iter().filter_map(|&c| part(c));
            let positive = |c: usize| self.matrix[c][c].is_positive();
            if parts().any(|(c, x, own)| x - own > rounding && (x - own < clear || !positive(c))) {
                return None;
            }
            let best = parts().filter(|(_, x, own)| x - own > rounding).max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((pivot, size, _)) = best else { break };
            let root = self.matrix[pivot][pivot].sqrt(d.bits, ROUNDING);
            let mut column = vec![d.int(0); n];
            column[pivot] = root.clone();
            left.retain(|c| *c != pivot);
            for &c in &left {
                column[c] = d.div(&self.matrix[c][pivot], &root);
            }
            for (i, &r) in left.iter().enumerate() {
                for &c in &left[i..] {
                    let x = d.sub(&self.matrix[r][c], &d.mul(&column[r], &column[c]));
                    self.matrix[c][r] = x.clone();
                    self.matrix[r][c] = x;
                }
            }
            pivots.push(pivot);
            columns.push(column);
            sizes.push(size);
        }
        let own = own.into_iter().map(|x| x.unwrap_or(f64::MIN)).collect();
        Some(Seen { digits: d, pivots, columns, sizes, excited, own, psi_at_end: self.psi_at_end })
    }
}

/// A functional: `(unknown, coefficient)`, drifts in units of the earth rate.
pub(super) type Functional = Vec<(usize, Real)>;

impl Seen {
    pub(super) fn digits(&self) -> Digits {
        self.digits
    }

    /// The number of directions that are seen.
    pub(super) fn rank(&self) -> usize {
        self.pivots.len()
    }

    /// Half the digits: what is smaller, in units of what rounding could make, is rounding.
    fn rounding(&self) -> f64 {
        -(self.digits.bits as f64) / 2.0
    }

    /// Binary logarithm of sigma of a functional, by what is seen alone; `None` when it is not in the span of that. `rounded` is the relative
    /// error of its coefficients (none by default).
    pub(super) fn sigma(&self, functional: &Functional, rounded: Option<f64>) -> Option<f64> {
        let d = self.digits;
        let mut rest = vec![d.int(0); self.own.len()];
        for (c, x) in functional {
            rest[*c] = d.add(&rest[*c], x);
        }
        // the sums of magnitudes that the rest is the difference of
        let mut sizes: Vec<Real> = rest.iter().map(Real::abs).collect();
        let mut variance = d.int(0);
        let largest = rest.iter().filter_map(log2).fold(f64::MIN, f64::max);
        let vanishes = |rest: &Vector, sizes: &Vector, variance: &Real| {
            let sigma = log2(variance).map(|v| v / 2.0);
            rest.iter().zip(sizes).zip(&self.own).all(|((x, size), own)| {
                let Some(x) = log2(x) else { return true };
                let coefficients = rounded
                    .zip(log2(size))
                    .is_some_and(|(r, size)| x - size < r.log2() || x - largest < NEGLIGIBLE);
                // an error of N, relative to its diagonal
                coefficients || sigma.is_some_and(|sigma| x - (own / 2.0 + sigma) < self.rounding())
            })
        };
        for (pivot, column) in self.pivots.iter().zip(&self.columns) {
            if vanishes(&rest, &sizes, &variance) {
                break;
            }
            let y = d.div(&rest[*pivot], &column[*pivot]);
            variance = d.add(&variance, &d.mul(&y, &y));
            for ((x, size), l) in rest.iter_mut().zip(&mut sizes).zip(column).filter(|(_, l)| !l.is_zero()) {
                let part = d.mul(&y, l);
                *x = d.sub(x, &part);
                *size = d.add(size, &part.abs());
            }
            rest[*pivot] = d.int(0);
        }
        vanishes(&rest, &sizes, &variance).then(|| log2(&variance).map(|v| v / 2.0)).flatten()
    }

    /// A functional of psi at the end and the coefficients as one of the unknowns at the start.
    pub(super) fn at_start(&self, functional: &Functional) -> Functional {
        let d = self.digits;
        let Some(psi) = &self.psi_at_end else { return functional.clone() };
        let moved = functional.iter().filter(|(c, _)| *c < 3);
        let moved = moved.flat_map(|(c, x)| psi[*c].iter().enumerate().map(move |(k, y)| (k, d.mul(x, y))));
        moved
            .chain(functional.iter().filter(|(c, _)| *c >= 3).cloned())
            .filter(|(_, x)| !x.is_zero())
            .collect()
    }

    /// What is not seen: `x_pivots = -R x_free` with `R = R_11^-1 R_12`. Its free unknowns (those that are not excited left out), and for every
    /// pivot its row of R, with zeros for what is rounding.
    pub(super) fn reduced(&self) -> (Vec<usize>, Vec<Vector>) {
        let d = self.digits;
        let free: Vec<usize> =
            (0..self.own.len()).filter(|c| self.excited[*c] && !self.pivots.contains(c)).collect();
        // from the last pivot up; what rounding may make of an entry comes from its own pivot, or from entries below
        let mut rows: Vec<Vector> = Vec::new();
        let mut errors: Vec<Vec<f64>> = Vec::new();
        for (k, column) in self.columns.iter().enumerate().rev() {
            let below = &self.pivots[k + 1..];
            let pivot = &column[self.pivots[k]];
            let (mut row, mut error) = (Vec::new(), Vec::new());
            for (j, &f) in free.iter().enumerate() {
                let known = below.iter().map(|&p| &column[p]).zip(rows.iter().rev().map(|r: &Vector| &r[j]));
                let x = d.div(&d.sub(&column[f], &d.dot(known)), pivot);
                let own = (self.own[f] - self.sizes[k]) / 2.0 + self.rounding();
                let inherited = below
                    .iter()
                    .zip(errors.iter().rev())
                    .filter_map(|(&p, e)| Some(log2(&column[p])? + e[j]));
                let inherited =
                    log2(pivot).map_or(f64::MIN, |size| inherited.fold(f64::MIN, f64::max) - size);
                let rounded = own.max(inherited + SUMMED);
                row.push(if log2(&x).is_none_or(|x| x < rounded) { d.int(0) } else { x });
                error.push(rounded);
            }
            rows.push(row);
            errors.push(error);
        }
        rows.reverse();
        (free, rows)
    }
}

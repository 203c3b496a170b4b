//! The information of samples over dwells as short as one likes, in as many digits as that takes: what slopes, ranks
//! and null vectors of doubles cannot show where positions hardly differ.
//!
//! Written from the equations of the paper, (2), (3), (6) to (9) and (19): of the exact engine it takes nothing, and of
//! the model only what a scheme says (angles, latitude, mounting, terms). The unit of time is 1/w_ie, so that drifts are
//! in units of the earth rate.

use astro_float_num::{BigFloat, Consts, RoundingMode, WORD_BIT_SIZE};
use obsdeg_core::model::{Angle, Carry, Dwell, Geometry, Scheme, Term, Unknowns};

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

/// A local unknown at the start of a position as a functional: six rows (psi^n, eps^n), one entry per column.
struct Local {
    columns: Vec<usize>,
    rows: [Vector; 6],
}

/// A scheme in numbers.
struct Model {
    digits: Digits,
    unknowns: usize,
    /// `C_c^n`, rows in n.
    attitudes: Vec<[Vector; 3]>,
    /// `eps^n` as a functional of the coefficients.
    drifts: Vec<[Vector; 3]>,
    /// Dwells in those of the first position.
    ratios: Vec<Real>,
    /// `psi x omega_ie` as a matrix.
    turning: [Vector; 3],
    components: Vec<usize>,
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

/// `eps^n = C_c^n eps^c`, and of each gyro `eps^c = D I` times the components of `g^c` along the axes that the letters
/// of its term name (3): three rows, a column per coefficient.
fn drift(d: Digits, c: &[Vector; 3], geometry: &Geometry, terms: &[Term]) -> [Vector; 3] {
    // g^c = C_n^c (0, -1, 0)
    let along = |v: &Vector, axis: [i32; 3]| -> Real {
        v.iter().zip(axis).fold(d.int(0), |sum, (x, k)| d.add(&sum, &d.mul(x, &d.int(k.into()))))
    };
    let gravity: Vector = c[1].iter().map(Real::neg).collect();
    let mut out: [Vector; 3] = std::array::from_fn(|_| Vec::new());
    for term in terms {
        for gyro in [&geometry.X, &geometry.Y, &geometry.Z] {
            let letters = term.letters().chars().filter(|l| *l != 'F');
            let excitation = letters.fold(d.int(1), |product, letter| {
                let axis = match letter {
                    'I' => gyro.I,
                    'O' => gyro.O,
                    _ => gyro.S,
                };
                d.mul(&product, &along(&gravity, axis.vector()))
            });
            for (row, c) in out.iter_mut().zip(c) {
                row.push(d.mul(&excitation, &along(c, gyro.I.vector())));
            }
        }
    }
    out
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
        let drifts: Vec<[Vector; 3]> = match &scheme.unknowns {
            Unknowns::Coefficients(_) => {
                attitudes.iter().map(|c| drift(d, c, &scheme.geometry, terms)).collect()
            }
            // the total drift in n is unknown itself
            Unknowns::Drift => {
                let unit = |r: usize| (0..3).map(|k| d.int(i64::from(r == k))).collect();
                vec![std::array::from_fn(unit); attitudes.len()]
            }
        };
        let seconds = |i: usize| scheme.positions[i].dwell.unwrap_or(Dwell::PAPER).seconds();
        let ratios =
            (0..attitudes.len()).map(|i| d.div(&d.double(seconds(i)), &d.double(seconds(0)))).collect();
        let zero = || d.int(0);
        let turning = [
            vec![zero(), zero(), w_u.neg()],
            vec![zero(), zero(), w_n.clone()],
            vec![w_u, w_n.neg(), zero()],
        ];
        // Z^n = (psi_z, 0, -psi_x), and psi_y where the azimuth is measured
        let components = if scheme.measured_azimuth { vec![2, 0, 1] } else { vec![2, 0] };
        let unknowns = psi + drifts[0][0].len();
        Some(Self { digits, unknowns, attitudes, drifts, ratios, turning, components })
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

    /// The information of samples over a dwell on the local unknowns at its start (6 x 6).
    fn gram(&self, dwell: &Real, azimuth: f64) -> Vec<Vector> {
        let d = self.digits;
        let step = d.div(dwell, &d.int(SAMPLES));
        let mut out = vec![vec![d.int(0); 6]; 6];
        for k in 1..=SAMPLES {
            let moved = self.moved(&d.mul(&step, &d.int(k)));
            for &component in &self.components {
                let row = &moved[component];
                let weight = if component == 1 { &d.mul(&step, &d.double(azimuth)) } else { &step };
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
            let rows: [Vector; 6] = std::array::from_fn(|r| match r {
                0..3 => {
                    (0..columns.len()).map(|k| d.dot((0..3).map(|j| (&to_n[r][j], &psi[j][k])))).collect()
                }
                _ => (0..3).map(|_| d.int(0)).chain(drift[r - 3].iter().cloned()).collect(),
            });
            let local = Local { columns, rows };
            let dwell = d.mul(&model.ratios[i], &d.double(dwell));
            local.add(d, &model.gram(&dwell, azimuth), &mut matrix);
            if between == Between::Dwell && !reset {
                let moved = model.moved(&dwell);
                let after: [Vector; 3] = std::array::from_fn(|r| {
                    (0..local.columns.len())
                        .map(|k| d.dot((0..6).map(|j| (&moved[r][j], &local.rows[j][k]))))
                        .collect()
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
        // from the last pivot up
        let mut rows: Vec<Vector> = Vec::new();
        for (k, column) in self.columns.iter().enumerate().rev() {
            let below = &self.pivots[k + 1..];
            let row = free.iter().enumerate().map(|(j, &f)| {
                let known = below.iter().map(|&p| &column[p]).zip(rows.iter().rev().map(|r: &Vector| &r[j]));
                let x = d.div(&d.sub(&column[f], &d.dot(known)), &column[self.pivots[k]]);
                let scale = (self.own[f] - self.sizes[k]) / 2.0;
                if log2(&x).is_none_or(|x| x - scale < self.rounding()) { d.int(0) } else { x }
            });
            let row = row.collect();
            rows.push(row);
        }
        rows.reverse();
        (free, rows)
    }
}

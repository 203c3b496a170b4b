//! Lower bounds on the criterion of a sequence in double precision, valid despite rounding.
//!
//! Information is stored as its root: `M = Y^T Y`, with the rows `Y_i = U L_i` of position i. `U^T U`
//! is the information of one dwell on the local quantities, and `L_i` gives these in terms of the
//! unknowns. For any x
//!
//! ```text
//! v^T M^-1 v >= (v x)^2 / |Y x|^2        (Cauchy and Schwarz)
//! ```
//!
//! so the origin of x does not matter, and `|Y x|` is known to within the majorant of its rows.

use crate::problem::{Problem, Ring, Source, TURN};

/// Rate of the earth in rad/s.
const EARTH_RATE: f64 = 7.292115e-5;
/// An arc second in rad: also deg/h in rad/s.
const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;
/// Local quantities of a position: psi, eps, a in n.
const LOCAL: usize = 9;
/// Pivots below this fraction of a diagonal entry are rounding.
const PIVOT: f64 = 1e-13;
/// Pivots from this fraction of a diagonal entry on are known to a relative accuracy of about 1e-6.
pub(super) const SURE_PIVOT: f64 = 1e-9;

/// Rows of any length.
pub(super) type Rows = Vec<Vec<f64>>;

/// Ring of double-precision numbers, with the rates of a problem.
pub(super) struct Double {
    rates: [f64; 2],
}

impl Double {
    fn new(latitude: i64) -> Self {
        let (cos, sin) = cos_sin(latitude);
        Self { rates: [EARTH_RATE * cos, EARTH_RATE * sin] }
    }
}

/// Cosine and sine of an angle in 1e-9 degrees, exact at multiples of 90 degrees.
fn cos_sin(angle: i64) -> (f64, f64) {
    let quarter = TURN / 4;
    let turns = (angle + quarter / 2).div_euclid(quarter);
    let (sin, cos) = ((angle - turns * quarter) as f64 * 1e-9).to_radians().sin_cos();
    match turns.rem_euclid(4) {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    }
}

impl Ring for Double {
    type Element = f64;
    fn zero(&self) -> f64 {
        0.0
    }
    fn one(&self) -> f64 {
        1.0
    }
    fn add(&self, a: &f64, b: &f64) -> f64 {
        a + b
    }
    fn mul(&self, a: &f64, b: &f64) -> f64 {
        a * b
    }
    fn neg(&self, a: &f64) -> f64 {
        -a
    }
    fn is_zero(&self, a: &f64) -> bool {
        *a == 0.0
    }
    fn cos_sin(&self, angle: i64) -> (f64, f64) {
        cos_sin(angle)
    }
    fn rates(&self) -> [f64; 2] {
        self.rates
    }
    fn left(&self, _: &Problem, _: &[Vec<Vec<f64>>]) -> Vec<Rows> {
        Vec::new()
    }
}

/// Criterion of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Criterion {
    Worst,
    Mean,
    Volume,
    Principal,
    Margin,
}

/// Measurement at every position: dwell, samples and noise.
pub(super) struct Dwell {
    pub seconds: f64,
    pub samples: usize,
    pub noise_g: f64,
    pub azimuth_noise_deg: Option<f64>,
}

/// Evaluator of sequences.
pub(super) struct Accuracy {
    carry: String,
    criterion: Criterion,
    /// Number of coefficients, those that do not count first.
    d: usize,
    nuisance: usize,
    /// Sigma that is 1 in the criterion, per coefficient that counts.
    limits: Vec<f64>,
    /// Root of the information of a dwell on the local quantities (9 x 9, upper triangle).
    root: Rows,
    /// psi^n after the dwell as a function of psi^n and eps^n before it (3 x 6).
    behind: Rows,
    /// Matrix C of every candidate, with drift and accelerometer error as functions of the coefficients
    /// (6 x d).
    candidates: Vec<(Rows, Rows)>,
    /// Rows on the coefficients (9 x d) under reset carry, per candidate, and the psi that minimises
    /// them (3 x d).
    alone: Vec<(Rows, Rows)>,
    /// Sums of the absolute values at psi, eps and a, per row of the root.
    sizes: [[f64; 3]; LOCAL],
    /// Sums of the absolute values of the columns of a coefficient: at eps and a.
    scales: Vec<[f64; 2]>,
    seconds: f64,
    samples: usize,
}

/// State of a sequence of positions.
#[derive(Clone)]
pub(super) struct SequenceState {
    /// psi in the carried axes as a function of the unknowns (3 x n).
    psi: Rows,
    /// Rows Y of the positions so far.
    rows: Vec<Rows>,
    /// psi of each position under reset carry as a function of the coefficients.
    own: Vec<Rows>,
    /// Information `Y^T Y` (n x n).
    information: Rows,
}

/// Value of a criterion with its lower bound.
#[derive(Debug, Clone, Copy)]
pub(super) struct BoundedValue {
    pub computed: f64,
    pub at_least: f64,
    /// Smallest pivot of the root relative to its diagonal entry, without those that are left out; 0 if
    /// a coefficient is determined by rounding alone.
    pub pivot: f64,
    /// Number of unknowns that are left out because nothing determines them.
    pub left_out: usize,
}

fn zeros(rows: usize, columns: usize) -> Rows {
    vec![vec![0.0; columns]; rows]
}

/// Product `A B`.
fn product(a: &Rows, b: &Rows) -> Rows {
    let mut out = zeros(a.len(), b[0].len());
    for (row, a) in out.iter_mut().zip(a) {
        for (x, b) in a.iter().zip(b).filter(|(x, _)| **x != 0.0) {
            row.iter_mut().zip(b).for_each(|(sum, y)| *sum += x * y);
        }
    }
    out
}

fn transposed(a: &Rows) -> Rows {
    (0..a[0].len()).map(|j| a.iter().map(|row| row[j]).collect()).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// psi^n after `t` seconds as a function of `psi^n` and `eps^n`: `[exp(W t), int exp(W s) ds]` (3 x 6).
fn behind(rates: [f64; 2], t: f64) -> Rows {
    let [n, u] = rates;
    let w: Rows = vec![vec![0.0, 0.0, -u], vec![0.0, 0.0, n], vec![u, -n, 0.0]];
    let square = product(&w, &w);
    let rate = n.hypot(u);
    let x = rate * t;
    let half = (x / 2.0).sin() / rate;
    // (x - sin x)/rate^3, by its series if x is small
    let third = match x {
        x if x < 0.5 => {
            let (mut term, mut sum, mut k) = (t * t * t / 6.0, 0.0, 3.0);
            while term.abs() > 1e-20 * t * t * t {
                sum += term;
                term *= -x * x / ((k + 1.0) * (k + 2.0));
                k += 2.0;
            }
            sum
        }
        x => (x - x.sin()) / rate.powi(3),
    };
    let entry = |i: usize, j: usize, [a, b, c]: [f64; 3]| {
        (if i == j { a } else { 0.0 }) + b * w[i][j] + c * square[i][j]
    };
    (0..3)
        .map(|i| {
            let turned = (0..3).map(|j| entry(i, j, [1.0, x.sin() / rate, 2.0 * half * half]));
            turned.chain((0..3).map(|j| entry(i, j, [t, 2.0 * half * half, third]))).collect()
        })
        .collect()
}

/// Adds a row to an upper triangular root, by Givens rotations.
fn fold(root: &mut Rows, mut row: Vec<f64>) {
    for i in 0..row.len() {
        if row[i] == 0.0 {
            continue;
        }
        let length = root[i][i].hypot(row[i]);
        let (cos, sin) = (root[i][i] / length, row[i] / length);
        for j in i..row.len() {
            let (a, b) = (root[i][j], row[j]);
            (root[i][j], row[j]) = (cos * a + sin * b, cos * b - sin * a);
        }
        row[i] = 0.0;
    }
}

/// Factor from the unit of a coefficient to SI units: deg/h, arc seconds, or millionths.
fn unit(name: &str) -> f64 {
    let arc = name.starts_with("D_") || name.starts_with("GM_") || name.starts_with("M_");
    if arc { ARCSEC } else { 1e-6 }
}

impl Accuracy {
    /// Evaluator of sequences. `required`: columns of the coefficients that count, with the sigma that
    /// is 1 in the criterion.
    pub(super) fn new(
        problem: &Problem,
        carry: &str,
        dwell: &Dwell,
        criterion: Criterion,
        required: &[(usize, f64)],
    ) -> Self {
        let ring = Double::new(problem.latitude.unwrap_or(0));
        let d = problem.coefficients.len();
        let counts = |k: &usize| required.iter().any(|r| r.0 == *k);
        let order: Vec<usize> = (0..d).filter(|k| !counts(k)).chain(required.iter().map(|r| r.0)).collect();
        let units: Vec<f64> = order.iter().map(|&k| unit(&problem.names[problem.psi + k])).collect();
        let local = |c: &Rows| {
            let s = problem.local(&ring, 0, c, c);
            let row = |row: &Vec<f64>| -> Vec<f64> {
                order.iter().zip(&units).map(|(&k, unit)| row[problem.psi + k] * unit).collect()
            };
            s[3..].iter().map(row).collect::<Rows>()
        };
        let candidates: Vec<(Rows, Rows)> =
            problem.attitudes(&ring).into_iter().map(|c| (c.clone(), local(&c))).collect();
        let scale = |(&k, unit): (&usize, &f64)| match problem.coefficients[k].of {
            Source::Force => [0.0, *unit],
            Source::Rate => [EARTH_RATE * unit, 0.0],
            Source::Gravity => [*unit, 0.0],
        };
        let root = root(problem, ring.rates, dwell);
        let size = |row: &Vec<f64>, of: usize| row[3 * of..3 * of + 3].iter().map(|x| x.abs()).sum();
        let mut out = Self {
            carry: carry.into(),
            criterion,
            d,
            nuisance: d - required.len(),
            limits: required.iter().map(|r| r.1).collect(),
            sizes: std::array::from_fn(|i| [0, 1, 2].map(|of| size(&root[i], of))),
            root,
            behind: behind(ring.rates, dwell.seconds),
            scales: order.iter().zip(&units).map(scale).collect(),
            candidates,
            alone: Vec::new(),
            seconds: dwell.seconds,
            samples: dwell.samples,
        };
        if carry == "reset" {
            out.alone = out.candidates.iter().map(|(_, effects)| out.alone(effects)).collect();
        }
        out
    }

    /// Rows of a position with a psi of its own, and that psi, which makes the rows 0 that begin at it.
    fn alone(&self, effects: &Rows) -> (Rows, Rows) {
        let d = self.d;
        let mut rows: Rows =
            self.root.iter().map(|row| product(&vec![row[3..].to_vec()], effects).remove(0)).collect();
        let mut psi = zeros(3, d);
        for i in (0..3).rev().filter(|&i| self.root[i][i] != 0.0) {
            for k in 0..d {
                psi[i][k] = -rows[i][k] / self.root[i][i];
            }
            for (row, root) in rows.iter_mut().zip(&self.root).take(i + 1) {
                row.iter_mut().zip(&psi[i]).for_each(|(x, y)| *x += root[i] * y);
            }
            rows[i] = vec![0.0; d];
        }
        (rows, psi)
    }

    /// Number of unknowns before the coefficients: those of psi, unless every position has its own.
    fn psi(&self) -> usize {
        if self.carry == "reset" { 0 } else { 3 }
    }

    pub(super) fn start(&self) -> SequenceState {
        let n = self.psi() + self.d;
        let unit = |r: usize| (0..n).map(|j| f64::from(u8::from(j == r))).collect();
        SequenceState {
            psi: (0..3).map(unit).collect(),
            rows: Vec::new(),
            own: Vec::new(),
            information: zeros(n, n),
        }
    }

    /// State of the sequence with one more candidate.
    pub(super) fn extended(&self, state: &SequenceState, candidate: usize) -> SequenceState {
        let mut out = state.clone();
        let (c, effects) = &self.candidates[candidate];
        let rows = if self.carry == "reset" {
            let (rows, psi) = &self.alone[candidate];
            out.own.push(psi.clone());
            rows.clone()
        } else {
            let inertial = self.carry == "inertial";
            let mut local = if inertial { state.psi.clone() } else { product(c, &state.psi) };
            for effect in effects {
                local.push([0.0; 3].iter().chain(effect).copied().collect());
            }
            let after = product(&self.behind, &local[..6].to_vec());
            out.psi = if inertial { after } else { product(&transposed(c), &after) };
            product(&self.root, &local)
        };
        for row in &rows {
            for (i, x) in row.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                out.information[i][..=i].iter_mut().zip(row).for_each(|(sum, y)| *sum += x * y);
            }
        }
        out.rows.push(rows);
        out
    }

    /// Criterion of a sequence.
    pub(super) fn value(&self, state: &SequenceState) -> BoundedValue {
        let root = Root::new(&state.information, self.psi() + self.nuisance);
        let n = root.l.len();
        let (first, d) = (n - self.limits.len(), self.limits.len() as f64);
        // inverse of the block of the coefficients that count: columns
        let inverse: Rows = (first..n).map(|j| root.column(j)).collect();
        let variance = |k: usize| inverse[k].iter().map(|x| x * x).sum::<f64>() / self.limits[k].powi(2);
        let unit = |k: usize| (0..n).map(|i| f64::from(u8::from(i == first + k))).collect::<Vec<_>>();
        let of = |v: &[f64]| {
            let x = root.solved(v);
            dot(v, &x).powi(2) / self.energy(state, &x).powi(2)
        };
        let (squared, bound) = match self.criterion {
            Criterion::Worst | Criterion::Margin => {
                let all = (0..self.limits.len()).map(|k| (k, variance(k)));
                let (k, largest) = all.fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
                (largest, of(&unit(k)) / self.limits[k].powi(2))
            }
            Criterion::Mean => {
                let all = || 0..self.limits.len();
                (all().map(variance).sum::<f64>() / d, all().map(|k| of(&unit(k))).sum::<f64>() / d)
            }
            Criterion::Volume => {
                let logs: f64 = (first..n).map(|i| root.l[i][i].ln()).sum();
                let energy: f64 = (first..n).map(|i| self.energy(state, &root.backward(i)).powi(2)).sum();
                ((-2.0 * logs / d).exp(), (-2.0 * logs / d).exp() * d / energy)
            }
            Criterion::Principal => {
                let covariance: Rows =
                    inverse.iter().map(|a| inverse.iter().map(|b| dot(a, b)).collect()).collect();
                let (largest, vector) = principal(covariance);
                let v: Vec<f64> = std::iter::repeat_n(0.0, first).chain(vector).collect();
                (largest, of(&v) / dot(&v, &v))
            }
        };
        // rounding of the bound itself
        BoundedValue {
            computed: squared.sqrt(),
            at_least: (bound.sqrt() * (1.0 - 1e-13)).max(0.0),
            pivot: root.pivot,
            left_out: root.left_out,
        }
    }

    /// Upper bound on `|Y x|`, valid despite rounding.
    fn energy(&self, state: &SequenceState, x: &[f64]) -> f64 {
        let psi = self.psi();
        let (mut sum, mut hidden) = (0.0, 0.0);
        let sizes = |of: usize| x[psi..].iter().zip(&self.scales).map(|(x, s)| x.abs() * s[of]).sum::<f64>();
        let (eps, a) = (sizes(0), sizes(1));
        let of_psi: f64 = x[..psi].iter().map(|x| x.abs()).sum();
        for (i, rows) in state.rows.iter().enumerate() {
            sum += rows.iter().map(|row| dot(row, x).powi(2)).sum::<f64>();
            let own = state.own.get(i).map_or(0.0, |own| {
                own.iter().map(|row| row.iter().zip(x).map(|(r, x)| (r * x).abs()).sum::<f64>()).sum()
            });
            let carried = of_psi + own + i as f64 * self.seconds * eps;
            let row = |s: &[f64; 3]| (s[0] * carried + s[1] * eps + s[2] * a).powi(2);
            hidden += self.sizes.iter().map(row).sum::<f64>();
        }
        let rounding = (self.samples + 40 * state.rows.len() + 200) as f64 * 2f64.powi(-48);
        sum.sqrt() + rounding * hidden.sqrt()
    }
}

/// Root of the information of a dwell on the local quantities.
fn root(problem: &Problem, rates: [f64; 2], dwell: &Dwell) -> Rows {
    let mut root = zeros(LOCAL, LOCAL);
    for j in 1..=dwell.samples {
        let of_psi = behind(rates, dwell.seconds * j as f64 / dwell.samples as f64);
        for c in problem.components() {
            let (psi, sign, noise) = match c {
                1 => (Some(2), 1.0, dwell.noise_g),
                2 => (None, 1.0, dwell.noise_g),
                3 => (Some(0), -1.0, dwell.noise_g),
                _ => (Some(1), 1.0, dwell.azimuth_noise_deg.unwrap_or(1.0).to_radians()),
            };
            let mut row = vec![0.0; LOCAL];
            if let Some(axis) = psi {
                row[..6].copy_from_slice(&of_psi[axis]);
                row.iter_mut().for_each(|x| *x *= sign);
            }
            if problem.force() && c < 4 {
                row[5 + c] = 1.0;
            }
            row.iter_mut().for_each(|x| *x /= noise);
            fold(&mut root, row);
        }
    }
    root
}

/// Lower triangular root of an information matrix. Directions that the first `nuisance` unknowns leave
/// undetermined are left out; undetermined coefficients that count are determined by rounding alone.
struct Root {
    l: Rows,
    /// Smallest pivot relative to its diagonal entry, without those that are left out; 0 if one is
    /// rounding.
    pivot: f64,
    left_out: usize,
}

impl Root {
    fn new(information: &Rows, nuisance: usize) -> Self {
        let n = information.len();
        let mut l = zeros(n, n);
        let (mut smallest, mut left_out) = (1.0f64, 0);
        for i in 0..n {
            for j in 0..i {
                let rest = information[i][j] - dot(&l[i][..j], &l[j][..j]);
                l[i][j] = if l[j][j] > 0.0 { rest / l[j][j] } else { 0.0 };
            }
            let given = information[i][i];
            let pivot = given - dot(&l[i][..i], &l[i][..i]);
            let counts = pivot > PIVOT * given;
            match counts {
                true => smallest = smallest.min(pivot / given),
                false if i < nuisance => left_out += 1,
                false => smallest = 0.0,
            }
            l[i][i] = match counts {
                true => pivot.sqrt(),
                false if i < nuisance => 0.0,
                false if given > 0.0 => (PIVOT * given).sqrt(),
                false => 1.0,
            };
        }
        Self { l, pivot: smallest, left_out }
    }

    /// Column j of the inverse of the root, from entry j on.
    fn column(&self, j: usize) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.l.len() - j);
        for (i, row) in self.l.iter().enumerate().skip(j) {
            let unit = f64::from(u8::from(i == j));
            out.push((unit - dot(&row[j..i], &out)) / row[i]);
        }
        // padded to the full length
        let mut whole = vec![0.0; self.l.len() - out.len()];
        whole.extend(out);
        whole
    }

    /// Solution `L^-T e_i`.
    fn backward(&self, i: usize) -> Vec<f64> {
        let mut unit = vec![0.0; self.l.len()];
        unit[i] = 1.0;
        self.transposed(unit)
    }

    fn transposed(&self, mut x: Vec<f64>) -> Vec<f64> {
        for i in (0..x.len()).rev() {
            x[i] = if self.l[i][i] > 0.0 { x[i] / self.l[i][i] } else { 0.0 };
            let (before, rest) = x.split_at_mut(i);
            before.iter_mut().zip(&self.l[i]).for_each(|(x, l)| *x -= l * rest[0]);
        }
        x
    }

    /// Solution `L^-T L^-1 v`.
    fn solved(&self, v: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(v.len());
        for (row, v) in self.l.iter().zip(v) {
            let i = y.len();
            y.push(if row[i] > 0.0 { (v - dot(&row[..i], &y)) / row[i] } else { 0.0 });
        }
        self.transposed(y)
    }
}

/// Largest eigenvalue of a symmetric matrix, and its eigenvector: cyclic Jacobi rotations.
fn principal(mut a: Rows) -> (f64, Vec<f64>) {
    let n = a.len();
    let mut vectors: Rows = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for _ in 0..30 {
        let pairs = || (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
        let size = |(i, j): (usize, usize)| a[i][j].powi(2) / (a[i][i] * a[j][j]);
        if pairs().map(size).fold(0.0, f64::max) < 1e-26 {
            break;
        }
        for (p, q) in pairs().collect::<Vec<_>>() {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = if theta < 0.0 { -1.0 } else { 1.0 } / (theta.abs() + theta.hypot(1.0));
            let cos = 1.0 / t.hypot(1.0);
            let sin = t * cos;
            for row in &mut a {
                (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
            }
            for of in [&mut a, &mut vectors] {
                let (before, rest) = of.split_at_mut(p);
                for (x, y) in rest[0].iter_mut().zip(&mut before[q]) {
                    (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
                }
            }
        }
    }
    let best = (0..n).fold(0, |best, i| if a[i][i] > a[best][best] { i } else { best });
    (a[best][best], vectors.swap_remove(best))
}

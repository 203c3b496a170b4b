//! Sigmas of the cardinal attitudes with slews between them, computed from the equations alone, without any
//! code of the program. Attitudes are integer matrices, slews turn in n, the drift model is (22), (23), (27),
//! (28) of the paper.

type Matrix = [[f64; 3]; 3];

/// Unknowns: psi^n, then D_F, D_I, D_O, D_S of X, Y, Z.
const N: usize = 15;
type Row = [f64; N];

const EARTH: f64 = 7.292115e-5;
const DPH: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// Sigmas of the prior, in rad and rad/s, which keep the elimination regular for undetermined unknowns.
const PRIOR: [f64; 2] = [1e2, 1e2 * DPH * 3600.0];

/// Slew path from one attitude to another.
#[derive(Debug, Clone)]
pub(crate) struct SlewPath {
    /// Slew axis in n (unit vector).
    pub(crate) about: [f64; 3],
    /// Duration of the slew, in s.
    pub(crate) seconds: f64,
    /// psi^n after the slew, as rows over psi^n before it and the coefficients.
    psi: [Row; 3],
}

/// Model of a platform with given candidates and conditions.
pub(crate) struct Brute {
    attitudes: Vec<Matrix>,
    /// `paths[i][j]`: slew paths from attitude i to j; two for a half turn, otherwise one.
    pub(crate) paths: Vec<Vec<Vec<SlewPath>>>,
    /// Square root of the information of a dwell on (psi^n, eps^n) at its start.
    root: [[f64; 6]; 6],
    /// psi^n after a dwell, as rows over (psi^n, eps^n) before it.
    after: [[f64; 6]; 3],
    w: Matrix,
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Attitude matrix of three letters: column j is the direction of platform axis j.
fn matrix(name: &str) -> Matrix {
    let mut c = [[0.0; 3]; 3];
    for (j, letter) in name.chars().enumerate() {
        let (row, sign) = match letter {
            'N' => (0, 1.0),
            'S' => (0, -1.0),
            'U' => (1, 1.0),
            'D' => (1, -1.0),
            'E' => (2, 1.0),
            _ => (2, -1.0),
        };
        c[row][j] = sign;
    }
    c
}

/// Rotation matrix about a unit vector (Rodrigues), angle in rad.
fn turned(axis: &[f64; 3], angle: f64) -> Matrix {
    let [x, y, z] = *axis;
    let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let (s, c) = angle.sin_cos();
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let unit = if i == j { c } else { 0.0 };
            unit + s * cross[i][j] + (1.0 - c) * axis[i] * axis[j]
        })
    })
}

/// `eps^n = C E(g^c) D`.
fn drift(c: &Matrix) -> [Row; 3] {
    let [gx, gy, gz] = c[1].map(|x| -x);
    let mut e = [[0.0; N]; 3];
    let axes = [[gx, -gz, gy], [gy, -gz, -gx], [gz, gx, gy]];
    for (axis, [i, o, s]) in axes.into_iter().enumerate() {
        (e[axis][3 + axis], e[axis][6 + axis], e[axis][9 + axis], e[axis][12 + axis]) = (1.0, i, o, s);
    }
    std::array::from_fn(|r| std::array::from_fn(|j| (0..3).map(|k| c[r][k] * e[k][j]).sum()))
}

impl Brute {
    pub(crate) fn new(
        names: &[String],
        latitude_deg: f64,
        dwell: f64,
        step: f64,
        noise: f64,
        rate_deg_s: f64,
    ) -> Self {
        let (wn, wu) = (EARTH * latitude_deg.to_radians().cos(), EARTH * latitude_deg.to_radians().sin());
        let w = [[0.0, 0.0, -wu], [0.0, 0.0, wn], [wu, -wn, 0.0]];
        let attitudes: Vec<Matrix> = names.iter().map(|n| matrix(n)).collect();
        let mut out = Self { attitudes, paths: Vec::new(), root: [[0.0; 6]; 6], after: [[0.0; 6]; 3], w };
        // psi' = W psi + eps, eps' = 0: a few terms of the Taylor series suffice for one step
        let mut now: [[f64; 6]; 3] =
            std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
        for _ in 0..(dwell / step).round() as usize {
            let mut term = now;
            for order in 1..12 {
                let eps = |i: usize, j: usize| if order == 1 && j == i + 3 { 1.0 } else { 0.0 };
                term = std::array::from_fn(|i| {
                    std::array::from_fn(|j| {
                        ((0..3).map(|k| w[i][k] * term[k][j]).sum::<f64>() + eps(i, j)) * step
                            / f64::from(order)
                    })
                });
                for (x, t) in now.iter_mut().flatten().zip(term.iter().flatten()) {
                    *x += t;
                }
            }
            // Z = (psi_z, -psi_x)
            for row in [now[2], now[0].map(|x| -x)] {
                insert(&mut out.root, row.map(|x| x / noise));
            }
        }
        out.after = now;
        let paths = |a: usize| (0..names.len()).map(|b| out.between(a, b, rate_deg_s)).collect();
        out.paths = (0..names.len()).map(paths).collect();
        out
    }

    fn between(&self, from: usize, to: usize, rate_deg_s: f64) -> Vec<SlewPath> {
        let (from, to) = (&self.attitudes[from], &self.attitudes[to]);
        let back: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| from[j][i]));
        let r = product(to, &back);
        let trace = r[0][0] + r[1][1] + r[2][2];
        let unit = |v: [f64; 3]| v.map(|x| x / v.iter().map(|x| x * x).sum::<f64>().sqrt());
        if trace == 3.0 {
            let psi = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
            return vec![SlewPath { about: [0.0; 3], seconds: 0.0, psi }];
        }
        let angle = ((trace - 1.0) / 2.0).acos();
        let axes = if trace == -1.0 {
            // r + 1 = 2 a a^T
            let columns = (0..3).map(|j| std::array::from_fn(|i| r[i][j] + f64::from(u8::from(i == j))));
            let column =
                columns.into_iter().find(|c: &[f64; 3]| c.iter().any(|x| *x != 0.0)).expect("an axis");
            vec![unit(column), unit(column).map(|x| -x)]
        } else {
            vec![unit([r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]])]
        };
        let seconds = angle.to_degrees() / rate_deg_s;
        axes.into_iter()
            .map(|about| SlewPath { about, seconds, psi: self.slew(from, &about, angle, seconds) })
            .collect()
    }

    /// `psi' = W psi + eps(t)` by Runge-Kutta.
    fn slew(&self, from: &Matrix, about: &[f64; 3], angle: f64, seconds: f64) -> [Row; 3] {
        const STEPS: usize = 60;
        let h = seconds / STEPS as f64;
        let eps = |share: f64| drift(&product(&turned(about, angle * share), from));
        let slope = |x: &[Row; 3], e: &[Row; 3]| -> [Row; 3] {
            std::array::from_fn(|i| {
                std::array::from_fn(|j| e[i][j] + (0..3).map(|k| self.w[i][k] * x[k][j]).sum::<f64>())
            })
        };
        let moved = |x: &[Row; 3], k: &[Row; 3], h: f64| -> [Row; 3] {
            std::array::from_fn(|i| std::array::from_fn(|j| x[i][j] + h * k[i][j]))
        };
        let mut x: [Row; 3] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
        for step in 0..STEPS {
            let at = |part: f64| eps((step as f64 + part) / STEPS as f64);
            let (before, middle, after) = (at(0.0), at(0.5), at(1.0));
            let k1 = slope(&x, &before);
            let k2 = slope(&moved(&x, &k1, h / 2.0), &middle);
            let k3 = slope(&moved(&x, &k2, h / 2.0), &middle);
            let k4 = slope(&moved(&x, &k3, h), &after);
            for i in 0..3 {
                for j in 0..N {
                    x[i][j] += h / 6.0 * (k1[i][j] + 2.0 * (k2[i][j] + k3[i][j]) + k4[i][j]);
                }
            }
        }
        x
    }

    /// Sigma of every coefficient in deg/h (per g). `sequence` lists attitudes, `paths[i]` selects the slew
    /// path from position i to i + 1.
    pub(crate) fn sigmas(&self, sequence: &[usize], paths: &[usize]) -> [f64; 12] {
        let mut root = [[0.0; N]; N];
        for (i, row) in root.iter_mut().enumerate() {
            row[i] = 1.0 / PRIOR[usize::from(i >= 3)];
        }
        let mut psi: [Row; 3] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
        for (place, &c) in sequence.iter().enumerate() {
            if place > 0 {
                let path = &self.paths[sequence[place - 1]][c][paths[place - 1]];
                psi = std::array::from_fn(|i| {
                    std::array::from_fn(|j| {
                        let own = if j < 3 { 0.0 } else { path.psi[i][j] };
                        own + (0..3).map(|k| path.psi[i][k] * psi[k][j]).sum::<f64>()
                    })
                });
            }
            let eps = drift(&self.attitudes[c]);
            let along = |row: &[f64; 6]| -> Row {
                std::array::from_fn(|j| (0..3).map(|k| row[k] * psi[k][j] + row[k + 3] * eps[k][j]).sum())
            };
            for row in &self.root {
                insert(&mut root, along(row));
            }
            psi = [along(&self.after[0]), along(&self.after[1]), along(&self.after[2])];
        }
        // variance i = |R^-T e_i|^2
        std::array::from_fn(|d| {
            let mut solved = [0.0; N];
            let mut sum = 0.0;
            for i in d + 3..N {
                let known: f64 = (d + 3..i).map(|k| root[k][i] * solved[k]).sum();
                solved[i] = (f64::from(u8::from(i == d + 3)) - known) / root[i][i];
                sum += solved[i] * solved[i];
            }
            sum.sqrt() / DPH
        })
    }
}

/// Adds a row to an upper triangular root of the information by Givens rotations.
fn insert<const M: usize>(root: &mut [[f64; M]; M], mut row: [f64; M]) {
    for i in 0..M {
        if row[i] == 0.0 {
            continue;
        }
        let length = root[i][i].hypot(row[i]);
        let (c, s) = (root[i][i] / length, row[i] / length);
        for j in i..M {
            (root[i][j], row[j]) = (c * root[i][j] + s * row[j], c * row[j] - s * root[i][j]);
        }
    }
}

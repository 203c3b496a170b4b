//! Second path: rows in floating point, written from the equations in n, with slews integrated step by step.
//! Only the list of terms comes from the engine.

use std::ops::{Add, Mul};

use obsdeg_core::model::Carry;
use obsdeg_ekf::decomposition::singular_values;

pub(super) type M = [[f64; 3]; 3];

/// Value and its first two Taylor coefficients in time.
#[derive(Clone, Copy)]
struct Jet([f64; 3]);

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| (0..=k).map(|i| self.0[i] * other.0[k - i]).sum()))
    }
}

fn constant(x: f64) -> Jet {
    Jet([x, 0.0, 0.0])
}

/// Axes of the gyros X, Y and Z in c, mounted as in the paper.
const GYROS: [[[f64; 3]; 3]; 3] = [
    // input, output, spin
    [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
    [[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]],
    [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
];

fn dot(a: &[Jet; 3], b: &[f64; 3]) -> Jet {
    (0..3).map(|i| a[i] * constant(b[i])).fold(constant(0.0), Add::add)
}

/// Effects of one unit of every coefficient of a term, as `(axis, value)` in c, for gravity g, torqued rate w
/// and specific force f in c: drift first, accelerometer error second.
fn unit_effects(term: &str, g: &[Jet; 3], w: &[Jet; 3], f: &[Jet; 3]) -> Vec<(usize, Jet, Jet)> {
    let zero = constant(0.0);
    let mut out = Vec::new();
    for i in 0..3 {
        let [input, output, spin] = &GYROS[i];
        let [gi, go, gs] = [dot(g, input), dot(g, output), dot(g, spin)];
        let mut drift = |x: Jet| out.push((i, x, zero));
        match term {
            "F" => drift(constant(1.0)),
            "I" => drift(gi),
            "O" => drift(go),
            "S" => drift(gs),
            "II" => drift(gi * gi),
            "OO" => drift(go * go),
            "SS" => drift(gs * gs),
            "GS" => drift(w[i]),
            "GM" => (0..3).filter(|j| *j != i).for_each(|j| drift(w[j])),
            "GM3" => (0..i).for_each(|j| drift(w[j])),
            _ => {}
        }
        let mut error = |x: Jet| out.push((i, zero, x));
        match term {
            "K0" => error(constant(1.0)),
            "K1" => error(f[i]),
            "M6" => (0..3).filter(|j| *j != i).for_each(|j| error(f[j])),
            "M3" => (0..i).for_each(|j| error(f[j])),
            "K2" => error(f[i] * f[i]),
            "K3" => error(f[i] * f[i] * f[i]),
            "Kx" => (0..3).filter(|j| *j != i).for_each(|j| error(f[i] * f[j])),
            _ => {}
        }
    }
    out
}

/// Effects `(eps^n, a^n)` per unit of every coefficient at the attitude `c` (rows in n), torqued with the
/// rate `w` in c.
fn columns(terms: &[&str], c: &[[Jet; 3]; 3], w: &[Jet; 3]) -> [Vec<[Jet; 3]>; 2] {
    let in_c = |v: [f64; 3]| -> [Jet; 3] { std::array::from_fn(|j| dot(&[c[0][j], c[1][j], c[2][j]], &v)) };
    let (g, f) = (in_c([0.0, -1.0, 0.0]), in_c([0.0, 1.0, 0.0]));
    let all: Vec<_> = terms.iter().flat_map(|t| unit_effects(t, &g, w, &f)).collect();
    let along = |axis: usize, x: Jet| -> [Jet; 3] { std::array::from_fn(|r| c[r][axis] * x) };
    [
        all.iter().map(|&(axis, eps, _)| along(axis, eps)).collect(),
        all.iter().map(|&(axis, _, a)| along(axis, a)).collect(),
    ]
}

/// Attitude `C exp([u x] rate t)` as Taylor coefficients in t.
fn turning(c: &M, u: &[f64; 3], rate: f64) -> [[Jet; 3]; 3] {
    let slope = |m: &M| -> M {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let (a, b) = ((j + 1) % 3, (j + 2) % 3);
                rate * (m[i][a] * u[b] - m[i][b] * u[a])
            })
        })
    };
    let (first, second) = (slope(c), slope(&slope(c)));
    std::array::from_fn(|i| std::array::from_fn(|j| Jet([c[i][j], first[i][j], second[i][j] / 2.0])))
}

/// Rotation matrix `exp([u x] t) = cos t + sin t [u x] + (1 - cos t) u u^T` (Rodrigues).
pub(super) fn turn(u: &[f64; 3], t: f64) -> M {
    let (sin, cos) = t.sin_cos();
    let cross: M = [[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let one = f64::from(u8::from(i == j));
            cos * one + sin * cross[i][j] + (1.0 - cos) * u[i] * u[j]
        })
    })
}

pub(super) fn times(a: &M, b: &M) -> M {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn back(m: &M) -> M {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}

/// Rotation: axis in c, angle in rad.
pub(super) type Turn = ([f64; 3], f64);

/// Position with the turns before and during it.
pub(super) struct Leg {
    pub(super) attitude: M,
    /// Slew to the position, during which torquer errors act.
    pub(super) slew: Option<Turn>,
    /// Rotation of the position while Z is observed.
    pub(super) rotation: Option<Turn>,
}

/// Effect of the torquer errors on psi^n in a turn: psi^n' = C(t) E(u) k by Gauss's rule of five points in
/// parts of a tenth of a radian (error below 1e-16).
fn left_by(terms: &[&str], from: &M, (u, angle): Turn) -> Vec<[f64; 3]> {
    let outer = 5.0 + 2.0 * (10.0f64 / 7.0).sqrt();
    let inner = 5.0 - 2.0 * (10.0f64 / 7.0).sqrt();
    let weight = |sign: f64| (322.0 + sign * 13.0 * 70.0f64.sqrt()) / 900.0;
    let points = [
        (0.0, 128.0 / 225.0),
        (inner.sqrt() / 3.0, weight(1.0)),
        (-inner.sqrt() / 3.0, weight(1.0)),
        (outer.sqrt() / 3.0, weight(-1.0)),
        (-outer.sqrt() / 3.0, weight(-1.0)),
    ];
    let parts = (angle.abs() * 10.0).ceil();
    let half = angle / parts / 2.0;
    let mut sum: Vec<[f64; 3]> = Vec::new();
    for part in 0..parts as usize {
        for (x, weight) in points {
            let at = (2.0 * part as f64 + 1.0 + x) * half;
            let there = turning(&times(from, &turn(&u, at)), &u, 0.0);
            let [eps, _] = columns(terms, &there, &u.map(constant));
            let [without, _] = columns(terms, &there, &[constant(0.0); 3]);
            sum.resize(eps.len(), [0.0; 3]);
            for (s, (e, e0)) in sum.iter_mut().zip(eps.iter().zip(&without)) {
                (0..3).for_each(|r| s[r] += weight * half * (e[r].0[0] - e0[r].0[0]));
            }
        }
    }
    sum
}

/// Number of attitudes per arc, above the number of sines, cosines and constants in its rows.
const ARC: usize = 23;
/// Rates wN, wU and the rate of rotation, dimensionless; any values will do.
const RATES: [f64; 3] = [0.63, 0.41, 0.77];

/// psi^n at the start of a position, as rows over the unknowns (3 x n). `psi` and `end` are psi^n and
/// attitude at the end of the position before.
fn begins(
    terms: &[&str],
    carry: Carry,
    (i, leg): (usize, &Leg),
    (psi, end): (&[Vec<f64>; 3], Option<M>),
    (first, n): (usize, usize),
) -> [Vec<f64>; 3] {
    match (carry, end) {
        (Carry::Reset, _) | (_, None) => std::array::from_fn(|r| {
            let at = if carry == Carry::Reset { 3 * i } else { 0 };
            (0..n).map(|c| if (at..at + 3).contains(&c) { leg.attitude[r][c - at] } else { 0.0 }).collect()
        }),
        (Carry::Platform, Some(end)) => {
            let over = times(&leg.attitude, &back(&end));
            std::array::from_fn(|r| (0..n).map(|c| (0..3).map(|j| over[r][j] * psi[j][c]).sum()).collect())
        }
        (Carry::Inertial, Some(end)) => match leg.slew {
            Some(slew) => left_behind(psi, &left_by(terms, &end, slew), first),
            None => psi.clone(),
        },
    }
}

fn left_behind(psi: &[Vec<f64>; 3], left: &[[f64; 3]], first: usize) -> [Vec<f64>; 3] {
    std::array::from_fn(|r| {
        let jump = |c: usize| if c < first { 0.0 } else { left[c - first][r] };
        psi[r].iter().enumerate().map(|(c, x)| x + jump(c)).collect()
    })
}

/// Rank of all samples, and true for each determined unknown. In a rotation Z is sampled along the arc and
/// psi is integrated (Runge and Kutta, fourth order).
pub(super) fn sampled(terms: &[&str], legs: &[Leg], carry: Carry) -> (usize, Vec<bool>) {
    const SAMPLES: usize = 48;
    const STEPS: usize = 40;
    let [w_n, w_u, rate] = RATES;
    let k = columns(terms, &turning(&legs[0].attitude, &[0.0; 3], 0.0), &[constant(1.0); 3])[0].len();
    let first = if carry == Carry::Reset { 3 * legs.len() } else { 3 };
    let n = first + k;
    let w: M = [[0.0, 0.0, -w_u], [0.0, 0.0, w_n], [w_u, -w_n, 0.0]];
    let errors = |c: &M, u: &[f64; 3], rate: f64| {
        let still = turning(c, &[0.0; 3], 0.0);
        let torqued: [Jet; 3] = std::array::from_fn(|j| {
            dot(&[still[0][j], still[1][j], still[2][j]], &[w_n, w_u, 0.0]) + constant(u[j] * rate)
        });
        columns(terms, &still, &torqued)
            .map(|of| of.into_iter().map(|v| v.map(|x| x.0[0])).collect::<Vec<_>>())
    };
    let slope = |psi: &[Vec<f64>; 3], eps: &[[f64; 3]]| -> [Vec<f64>; 3] {
        std::array::from_fn(|r| {
            let of = |c: usize| if c < first { 0.0 } else { eps[c - first][r] };
            (0..n).map(|c| (0..3).map(|j| w[r][j] * psi[j][c]).sum::<f64>() + of(c)).collect()
        })
    };
    let moved = |psi: &[Vec<f64>; 3], by: &[Vec<f64>; 3], h: f64| -> [Vec<f64>; 3] {
        std::array::from_fn(|r| psi[r].iter().zip(&by[r]).map(|(x, y)| x + h * y).collect())
    };
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut see = |psi: &[Vec<f64>; 3], a: &[[f64; 3]]| {
        for (r, sign, e) in [(2, 1.0, 0), (0, -1.0, 2), (0, 0.0, 1)] {
            let of = |c: usize| if c < first { 0.0 } else { a[c - first][e] };
            rows.push((0..n).map(|c| sign * psi[r][c] + of(c)).collect());
        }
    };
    let (mut psi, mut end): ([Vec<f64>; 3], Option<M>) = Default::default();
    for (i, leg) in legs.iter().enumerate() {
        psi = begins(terms, carry, (i, leg), (&psi, end), (first, n));
        let Some((u, angle)) = leg.rotation else {
            let [eps, a] = errors(&leg.attitude, &[0.0; 3], 0.0);
            let none = vec![[0.0; 3]; k];
            let mut now = psi.clone();
            see(&now, &a);
            for order in 1..4 {
                now = slope(&now, if order == 1 { &eps } else { &none });
                see(&now, &none);
            }
            end = Some(leg.attitude);
            continue;
        };
        let h = angle.abs() / rate / (SAMPLES * STEPS) as f64;
        let along = |t: f64| times(&leg.attitude, &turn(&u, angle.signum() * rate * t));
        for step in 0..SAMPLES * STEPS {
            let t = step as f64 * h;
            let [begin, middle, after] =
                [t, t + h / 2.0, t + h].map(|t| errors(&along(t), &u, angle.signum() * rate));
            if step % STEPS == 0 {
                see(&psi, &begin[1]);
            }
            let k1 = slope(&psi, &begin[0]);
            let k2 = slope(&moved(&psi, &k1, h / 2.0), &middle[0]);
            let k3 = slope(&moved(&psi, &k2, h / 2.0), &middle[0]);
            let k4 = slope(&moved(&psi, &k3, h), &after[0]);
            for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                psi = moved(&psi, &k, weight * h / 6.0);
            }
        }
        end = Some(along(angle.abs() / rate));
    }
    let rank = |rows: &[Vec<f64>]| {
        let matrix = nalgebra::DMatrix::from_fn(rows.len(), n, |i, j| rows[i][j]);
        let (values, _) = singular_values(&matrix.qr().r()).expect("finite");
        values.iter().filter(|v| **v > 1e-8 * values[0]).count()
    };
    let all = rank(&rows);
    let determined = (0..n).map(|c| {
        rows.push((0..n).map(|j| f64::from(u8::from(j == c))).collect());
        let with = rank(&rows);
        rows.pop();
        with == all
    });
    let determined = determined.collect();
    (all, determined)
}

/// Ranks of V_0, V_1, V_2, and the smallest order whose span contains each unknown. In a rotation the time
/// derivatives of Z include the changes of attitude, gravity and torqued rate (that of the rotation added),
/// at many attitudes of the arc.
pub(super) fn judge(terms: &[&str], legs: &[Leg], carry: Carry) -> (Vec<usize>, Vec<Option<usize>>) {
    let [w_n, w_u, rate] = RATES;
    let one = turning(&legs[0].attitude, &[0.0; 3], 0.0);
    let k = columns(terms, &one, &[constant(1.0); 3])[0].len();
    let first = if carry == Carry::Reset { 3 * legs.len() } else { 3 };
    let n = first + k;
    // psi' = psi x w
    let w: M = [[0.0, 0.0, -w_u], [0.0, 0.0, w_n], [w_u, -w_n, 0.0]];
    let mut rows: Vec<Vec<Vec<f64>>> = vec![Vec::new(); 3];
    // psi^n as rows over the unknowns
    let mut psi: [Vec<f64>; 3] = Default::default();
    let mut end: Option<M> = None;
    for (i, leg) in legs.iter().enumerate() {
        psi = begins(terms, carry, (i, leg), (&psi, end), (first, n));
        let mut stations = vec![(leg.attitude, psi.clone())];
        if let Some((u, angle)) = leg.rotation {
            stations.extend((1..=ARC).map(|j| {
                let part = angle * j as f64 / ARC as f64;
                let left = left_by(terms, &leg.attitude, (u, part));
                (times(&leg.attitude, &turn(&u, part)), left_behind(&psi, &left, first))
            }));
        }
        let (u, rate) = leg.rotation.map_or(([0.0; 3], 0.0), |(u, angle)| (u, rate * angle.signum()));
        for (attitude, psi) in &stations {
            let c = turning(attitude, &u, rate);
            let torqued: [Jet; 3] = std::array::from_fn(|j| {
                dot(&[c[0][j], c[1][j], c[2][j]], &[w_n, w_u, 0.0]) + constant(u[j] * rate)
            });
            let [eps, a] = columns(terms, &c, &torqued);
            let coefficient = |of: &[[Jet; 3]], c: usize, r: usize, order: usize| {
                if c < first { 0.0 } else { of[c - first][r].0[order] }
            };
            let mut now = psi.clone();
            for (order, rows) in rows.iter_mut().enumerate() {
                let z = |r: usize, sign: f64, e: usize| -> Vec<f64> {
                    (0..n).map(|c| sign * now[r][c] + coefficient(&a, c, e, order)).collect()
                };
                rows.extend([z(2, 1.0, 0), z(0, -1.0, 2), z(0, 0.0, 1)]);
                now = std::array::from_fn(|r| {
                    let turned = |c: usize| -> f64 { (0..3).map(|j| w[r][j] * now[j][c]).sum() };
                    (0..n)
                        .map(|c| (turned(c) + coefficient(&eps, c, r, order)) / (order + 1) as f64)
                        .collect()
                });
            }
            end = Some(*attitude);
        }
        psi = stations.pop().map(|(_, psi)| psi).unwrap_or_default();
    }
    let matrix = |rows: &[Vec<f64>]| nalgebra::DMatrix::from_fn(rows.len(), n, |i, j| rows[i][j]);
    let rank = |rows: &[Vec<f64>]| {
        let (values, _) = singular_values(&matrix(rows)).expect("finite");
        values.iter().filter(|v| **v > 1e-9 * values[0]).count()
    };
    let (mut profile, mut degrees, mut all) = (Vec::new(), vec![None; n], Vec::new());
    for (order, rows) in rows.into_iter().enumerate() {
        all.extend(rows);
        // the same span in fewer rows
        all = matrix(&all).qr().r().row_iter().map(|row| row.iter().copied().collect()).collect();
        let here = rank(&all);
        profile.push(here);
        for (c, degree) in degrees.iter_mut().enumerate().filter(|(_, d)| d.is_none()) {
            let unit: Vec<f64> = (0..n).map(|j| f64::from(u8::from(j == c))).collect();
            all.push(unit);
            if rank(&all) == here {
                *degree = Some(order);
            }
            all.pop();
        }
    }
    (profile, degrees)
}

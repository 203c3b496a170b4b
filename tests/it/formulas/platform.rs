//! Simulation of the platform from the equations alone, in floating point and in platform axes: (1)-(6) of
//! the paper, the passive Euler matrices, the carries, and Taylor coefficients at one moment by a separate
//! recursion.

use std::collections::HashMap;

pub(crate) type Vector = [f64; 3];
pub(crate) type Matrix = [[f64; 3]; 3];

/// Number of Taylor coefficients: derivatives up to the second.
const ORDERS: usize = 3;

/// Rotation at a constant rate.
#[derive(Debug, Clone)]
pub(crate) struct Turn {
    /// Index of the rotation axis: 0, 1 or 2.
    pub(crate) axis: usize,
    /// True for the axes N, U, E instead of X_p, Y_p, Z_p.
    pub(crate) geographic: bool,
    /// Total angle in degrees, right-handed.
    pub(crate) angle_deg: f64,
    /// Rate in rad per unit of time, with the sign of the angle.
    pub(crate) rate: f64,
}

#[derive(Debug, Clone)]
pub(crate) struct Position {
    pub(crate) name: String,
    /// Euler angles alpha, beta, gamma in rad.
    pub(crate) angles: Vector,
    pub(crate) turn: Option<Turn>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Carry {
    Platform,
    Inertial,
    Reset,
}

/// Scheme with values for all unknowns and generic angles.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    pub(crate) positions: Vec<Position>,
    pub(crate) carry: Carry,
    /// Earth-rate components (wN, wU).
    pub(crate) rates: [f64; 2],
    /// psi in platform axes at the start of the scheme; under reset carry at the start of each position.
    pub(crate) psi: Vec<Vector>,
    /// Values of the coefficients by name, such as `D_FX`.
    pub(crate) drift: HashMap<String, f64>,
    /// Values of generic angles by name, in rad.
    pub(crate) names: HashMap<String, f64>,
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn apply(a: &Matrix, x: &Vector) -> Vector {
    std::array::from_fn(|i| (0..3).map(|k| a[i][k] * x[k]).sum())
}

/// Cross-product matrix `[x cross]`.
fn cross_matrix([x, y, z]: Vector) -> Matrix {
    [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
}

fn unit(axis: usize) -> Vector {
    std::array::from_fn(|i| f64::from(u8::from(i == axis)))
}

/// Attitude matrix `C_c^n = Mx My Mz`, passive.
pub(crate) fn euler([a, b, g]: Vector) -> Matrix {
    let ((sa, ca), (sb, cb), (sg, cg)) = (a.sin_cos(), b.sin_cos(), g.sin_cos());
    let mx = [[1.0, 0.0, 0.0], [0.0, ca, sa], [0.0, -sa, ca]];
    let my = [[cb, 0.0, -sb], [0.0, 1.0, 0.0], [sb, 0.0, cb]];
    let mz = [[cg, sg, 0.0], [-sg, cg, 0.0], [0.0, 0.0, 1.0]];
    product(&product(&mx, &my), &mz)
}

/// Rotation matrix `exp([a x] t)` by Rodrigues' formula, with the unit vector of axis a.
fn rotation(axis: usize, t: f64) -> Matrix {
    let k = cross_matrix(unit(axis));
    let kk = product(&k, &k);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| f64::from(u8::from(i == j)) + t.sin() * k[i][j] + (1.0 - t.cos()) * kk[i][j])
    })
}

/// Taylor coefficients of a vector or matrix.
type Series<T> = [T; ORDERS];

/// Unknowns and derivatives of Z at a station.
#[derive(Debug, Clone)]
pub(crate) struct Station {
    /// `psi^n`, `eps^n`, and the time derivative of `eps^n`.
    pub(crate) psi_n: Vector,
    pub(crate) eps_n: Vector,
    pub(crate) eps_rate_n: Vector,
    /// Derivatives of Z in platform axes and in n, and derivatives of `psi_y^n`.
    pub(crate) z_c: [Vector; ORDERS],
    pub(crate) z_n: [Vector; ORDERS],
    pub(crate) azimuth: [f64; ORDERS],
}

impl Case {
    fn attitude(&self, index: usize, turned: f64) -> Matrix {
        let p = &self.positions[index];
        let c = euler(p.angles);
        match &p.turn {
            Some(t) if t.geographic => product(&rotation(t.axis, turned), &c),
            Some(t) => product(&c, &rotation(t.axis, turned)),
            None => c,
        }
    }

    /// `psi^n` at a position: carried through rotations, with no time between positions.
    fn psi_n(&self, index: usize) -> Vector {
        let start = |i: usize| self.attitude(i, 0.0);
        match self.carry {
            Carry::Reset => apply(&start(index), &self.psi[index]),
            Carry::Inertial => apply(&start(0), &self.psi[0]),
            Carry::Platform => {
                let mut psi_c = self.psi[0];
                for i in 0..index {
                    let psi_n = apply(&start(i), &psi_c);
                    let whole = self.positions[i].turn.as_ref().map_or(0.0, |t| t.angle_deg.to_radians());
                    psi_c = apply(&transposed(&self.attitude(i, whole)), &psi_n);
                }
                apply(&start(index), &psi_c)
            }
        }
    }

    fn d(&self, name: &str) -> f64 {
        self.drift.get(name).copied().unwrap_or(0.0)
    }

    /// Drift in platform axes as a series, for the gravity series `g` in platform axes.
    fn drift(&self, g: &Series<Vector>) -> Series<Vector> {
        // I, O, S of the gyros X, Y, Z as (sign, component of g)
        const GYROS: [[(f64, usize); 3]; 3] = [
            [(1.0, 0), (-1.0, 2), (1.0, 1)],
            [(1.0, 1), (-1.0, 2), (-1.0, 0)],
            [(1.0, 2), (1.0, 0), (1.0, 1)],
        ];
        let mut out = [[0.0; 3]; ORDERS];
        for (gyro, (axes, letter)) in GYROS.iter().zip(["X", "Y", "Z"]).enumerate() {
            let along = |a: usize| -> Series<f64> { std::array::from_fn(|k| axes[a].0 * g[k][axes[a].1]) };
            let times = |a: Series<f64>, b: Series<f64>| -> Series<f64> {
                std::array::from_fn(|k| (0..=k).map(|i| a[i] * b[k - i]).sum())
            };
            let [i, o, s] = [along(0), along(1), along(2)];
            let one = std::array::from_fn(|k| f64::from(u8::from(k == 0)));
            for (term, x) in [
                ("F", one),
                ("I", i),
                ("O", o),
                ("S", s),
                ("II", times(i, i)),
                ("OO", times(o, o)),
                ("SS", times(s, s)),
                ("IO", times(i, o)),
                ("IS", times(i, s)),
                ("OS", times(o, s)),
            ] {
                let d = self.d(&format!("D_{term}{letter}"));
                for k in 0..ORDERS {
                    out[k][gyro] += d * x[k];
                }
            }
        }
        out
    }

    /// Values at a station: a position, or a rotating position after a turn of `turned_deg` degrees.
    pub(crate) fn station(&self, index: usize, turned_deg: f64) -> Station {
        let c0 = self.attitude(index, turned_deg.to_radians());
        let turn = self.positions[index].turn.as_ref();
        // rate of the platform relative to n, in platform axes at this moment
        let spin: Vector = match turn {
            None => [0.0; 3],
            Some(t) if t.geographic => apply(&transposed(&c0), &unit(t.axis)).map(|x| x * t.rate),
            Some(t) => unit(t.axis).map(|x| x * t.rate),
        };
        // C' = C [spin x]; spin is constant in platform axes for every rotation axis
        let k = cross_matrix(spin);
        let mut c: Series<Matrix> = [c0; ORDERS];
        for order in 1..ORDERS {
            c[order] = product(&c[order - 1], &k).map(|row| row.map(|x| x / order as f64));
        }
        let [w_n, w_u] = self.rates;
        let g: Series<Vector> = c.map(|c| apply(&transposed(&c), &[0.0, -1.0, 0.0]));
        let earth: Series<Vector> = c.map(|c| apply(&transposed(&c), &[w_n, w_u, 0.0]));
        let eps = self.drift(&g);
        let mut psi: Series<Vector> = [[0.0; 3]; ORDERS];
        psi[0] = apply(&transposed(&c0), &self.psi_n(index));
        for order in 0..ORDERS - 1 {
            let mut rate = eps[order];
            for i in 0..=order {
                let mut omega = earth[order - i];
                if i == order {
                    omega = std::array::from_fn(|a| omega[a] + spin[a]);
                }
                let turned = apply(&cross_matrix(psi[i]), &omega);
                rate = std::array::from_fn(|a| rate[a] + turned[a]);
            }
            psi[order + 1] = rate.map(|x| x / (order + 1) as f64);
        }
        // Z = -[g x] psi, and the same in n
        let convolved = |f: &dyn Fn(usize, usize) -> Vector| -> Series<Vector> {
            std::array::from_fn(|k| {
                (0..=k).fold([0.0; 3], |sum, i| {
                    let x = f(i, k - i);
                    std::array::from_fn(|a| sum[a] + x[a])
                })
            })
        };
        let z_c = convolved(&|i, j| apply(&cross_matrix(g[i]), &psi[j]).map(|x| -x));
        let z_n = convolved(&|i, j| apply(&c[i], &z_c[j]));
        let psi_n = convolved(&|i, j| apply(&c[i], &psi[j]));
        let eps_n = convolved(&|i, j| apply(&c[i], &eps[j]));
        let derivatives = |series: Series<Vector>| {
            let factorial = |k: usize| (1..=k).product::<usize>() as f64;
            std::array::from_fn(|k| series[k].map(|x| x * factorial(k)))
        };
        let psi_n_derivatives: [Vector; ORDERS] = derivatives(psi_n);
        Station {
            psi_n: psi_n[0],
            eps_n: eps_n[0],
            eps_rate_n: eps_n[1],
            z_c: derivatives(z_c),
            z_n: derivatives(z_n),
            azimuth: psi_n_derivatives.map(|v| v[1]),
        }
    }

    /// The same case with all unknowns zero.
    pub(crate) fn silent(&self) -> Self {
        let mut silent = self.clone();
        silent.psi.fill([0.0; 3]);
        silent.drift.values_mut().for_each(|d| *d = 0.0);
        silent
    }

    /// Adds `by` to an unknown; false if the name is no unknown.
    pub(crate) fn change(&mut self, name: &str, by: f64) -> bool {
        if let Some(d) = self.drift.get_mut(name) {
            *d += by;
            return true;
        }
        let (base, index) = name.split_once('@').map_or((name, Ok(1)), |(b, i)| (b, i.parse::<usize>()));
        let axis = ["psi_x", "psi_y", "psi_z"].iter().position(|n| *n == base);
        let slot = index.ok().and_then(|i| self.psi.get_mut(i.checked_sub(1)?)).zip(axis);
        slot.map(|(psi, axis)| psi[axis] += by).is_some()
    }

    /// Index of a position and the angle it has turned (deg), from `p1` or `p1[45]`.
    pub(crate) fn find(&self, station: &str) -> Option<(usize, f64)> {
        let (name, turned) = match station.split_once('[') {
            Some((name, rest)) => (name, rest.strip_suffix(']')?.parse().ok()?),
            None => (station, 0.0),
        };
        let index = self.positions.iter().position(|p| p.name == name)?;
        // only a rotating position is named with an angle
        (self.positions[index].turn.is_some() == station.contains('[')).then_some((index, turned))
    }

    /// Value of a name in the formulas: `Z3''@p1`, `w@p1`, `wN`, `psi_x@2`, `D_FX`, `eps_x^n@p1`.
    pub(crate) fn value(&self, name: &str) -> Option<f64> {
        let axis = |c: char| ['x', 'y', 'z'].iter().position(|a| *a == c);
        if let Some((base, station)) = name.split_once('@') {
            if let Ok(i) = station.parse::<usize>()
                && let Some(letter) = base.strip_prefix("psi_")
                && self.carry == Carry::Reset
            {
                return Some(self.psi.get(i.checked_sub(1)?)?[axis(letter.chars().next()?)?]);
            }
            let (index, turned) = if base == "w" {
                (self.positions.iter().position(|p| p.name == station)?, 0.0)
            } else {
                self.find(station)?
            };
            if base == "w" {
                return self.positions[index].turn.as_ref().map(|t| t.rate);
            }
            let s = self.station(index, turned);
            let order = base.chars().filter(|c| *c == '\'').count();
            let plain = base.trim_end_matches('\'');
            let what: Vec<char> = plain.chars().collect();
            return match what[..] {
                ['Z', 'a'] => Some(s.azimuth[order]),
                ['Z', digit @ '1'..='3'] => Some(s.z_n[order][digit as usize - '1' as usize]),
                ['Z', letter] => Some(s.z_c[order][axis(letter)?]),
                _ if order > 0 => {
                    let axis =
                        plain.strip_prefix("eps_")?.strip_suffix("^n")?.chars().next().and_then(axis)?;
                    (order == 1).then(|| s.eps_rate_n[axis])
                }
                _ => {
                    let component = axis(plain.chars().nth(4)?)?;
                    match (&plain[..4], plain.get(5..)?) {
                        ("psi_", "^n") => Some(s.psi_n[component]),
                        ("eps_", "^n") => Some(s.eps_n[component]),
                        _ => None,
                    }
                }
            };
        }
        match name {
            "wN" => Some(self.rates[0]),
            "wU" => Some(self.rates[1]),
            _ if name.starts_with("D_") => self.drift.get(name).copied(),
            _ if self.names.contains_key(name) => self.names.get(name).copied(),
            _ => {
                let component = axis(name.chars().nth(4)?)?;
                match (&name[..4], name.get(5..)?) {
                    ("psi_", "") if self.carry != Carry::Reset => Some(self.psi[0][component]),
                    // unknowns in n of a single position
                    ("psi_", "^n") => Some(self.station(0, 0.0).psi_n[component]),
                    ("eps_", "^n") => Some(self.station(0, 0.0).eps_n[component]),
                    _ => None,
                }
            }
        }
    }
}

/// The simulated derivatives agree with differences of an integration in small steps.
#[test]
fn derivatives_are_those_of_the_integrated_motion() {
    let case = Case {
        positions: vec![Position {
            name: "p1".into(),
            angles: [0.3, -0.4, 1.1],
            turn: Some(Turn { axis: 1, geographic: true, angle_deg: 90.0, rate: 0.7 }),
        }],
        carry: Carry::Platform,
        rates: [0.8, 0.5],
        psi: vec![[0.2, -0.3, 0.4]],
        drift: [("D_FX", 0.3), ("D_IY", -0.7), ("D_OZ", 0.5), ("D_ISX", 0.9)]
            .map(|(n, x)| (n.to_string(), x))
            .into(),
        names: HashMap::new(),
    };
    // psi' = psi x omega_c + eps by Runge-Kutta, omega_c = C^T omega_ie + spin
    let state = |t: f64| -> Matrix { case.attitude(0, 0.7 * t) };
    let rate = |t: f64, psi: &Vector| -> Vector {
        let back = transposed(&state(t));
        let spin = apply(&back, &[0.0, 0.7, 0.0]);
        let omega = apply(&back, &[0.8, 0.5, 0.0]);
        let [gx, gy, gz] = apply(&back, &[0.0, -1.0, 0.0]);
        let eps = [0.3 + 0.9 * gx * gy, -0.7 * gy, 0.5 * gx];
        let turned = apply(&cross_matrix(*psi), &std::array::from_fn(|i| omega[i] + spin[i]));
        let _ = gz;
        std::array::from_fn(|i| turned[i] + eps[i])
    };
    let z_at = |t: f64| -> [Vector; 2] {
        let (mut psi, steps) = (apply(&transposed(&state(0.0)), &case.psi_n(0)), 20);
        let h = t / f64::from(steps);
        for i in 0..steps {
            let t = h * f64::from(i);
            let plus = |k: &Vector, f: f64| -> Vector { std::array::from_fn(|a| psi[a] + f * k[a]) };
            let k1 = rate(t, &psi);
            let k2 = rate(t + h / 2.0, &plus(&k1, h / 2.0));
            let k3 = rate(t + h / 2.0, &plus(&k2, h / 2.0));
            let k4 = rate(t + h, &plus(&k3, h));
            psi = std::array::from_fn(|a| psi[a] + h / 6.0 * (k1[a] + 2.0 * k2[a] + 2.0 * k3[a] + k4[a]));
        }
        let g = apply(&transposed(&state(t)), &[0.0, -1.0, 0.0]);
        let z = apply(&cross_matrix(g), &psi).map(|x| -x);
        [z, apply(&state(t), &z)]
    };
    let s = case.station(0, 0.0);
    let h = 1e-3;
    let (minus, zero, plus) = (z_at(-h), z_at(0.0), z_at(h));
    for (frame, exact) in [(0, s.z_c), (1, s.z_n)] {
        for a in 0..3 {
            let (m, o, p) = (minus[frame][a], zero[frame][a], plus[frame][a]);
            assert!((o - exact[0][a]).abs() < 1e-12);
            assert!(((p - m) / (2.0 * h) - exact[1][a]).abs() < 1e-5, "{frame} {a}");
            assert!(((p - 2.0 * o + m) / (h * h) - exact[2][a]).abs() < 1e-4, "{frame} {a}");
        }
    }
}

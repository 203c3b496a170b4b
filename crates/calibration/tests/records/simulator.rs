//! Records by other mathematics than the estimator's: the attitude is a quaternion that turns with the drift
//! of the gyros, the force is exact, noise is white and Gauss-Markov, outputs are quantised, samples are
//! dropped. The simulator is written from the equations of the platform, and of the program it uses only a
//! generator of numbers.

use obsdeg_exact::SplitMix64;

pub(crate) type Vector = [f64; 3];
/// Quaternion (w, x, y, z), from platform axes to n.
pub(crate) type Quaternion = [f64; 4];

const EARTH_RATE: f64 = 7.292115e-5;
const DPH: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// Carry of the attitude error through an instantaneous turn.
#[derive(Debug, Clone)]
pub(crate) enum AtOnce {
    /// The error stays the same in n.
    Inertial,
    /// The error stays the same in platform axes.
    Platform,
    /// The error is another rotation vector in platform axes (rad) at each position but the first.
    Reset(Vec<Vector>),
}

/// Properties of the bench.
#[derive(Debug, Clone)]
pub(crate) struct Bench {
    pub(crate) latitude_deg: f64,
    /// Positions: name, Euler angles in deg, dwell in s.
    pub(crate) positions: Vec<(&'static str, Vector, f64)>,
    /// Rate of the turns between positions, in deg/s; `None`: instantaneous.
    pub(crate) slew_deg_s: Option<f64>,
    /// Carry of the attitude error through instantaneous turns.
    pub(crate) carry: AtOnce,
    /// psi at the start in platform axes, in rad.
    pub(crate) psi: Vector,
    /// D_F, D_I, D_O, D_S of the gyros X, Y, Z in deg/h (per g).
    pub(crate) drift: [Vector; 4],
    /// D_II, D_OO, D_SS of the gyros X, Y, Z in deg/h/g^2.
    pub(crate) squares: [Vector; 3],
    /// K0 (g), K1, K2 (1/g) of the accelerometers.
    pub(crate) accelerometers: [Vector; 3],
    /// Misalignments of each accelerometer: sensitivity of its output to the force along each other platform
    /// axis, in rad.
    pub(crate) mounting: [Vector; 3],
    /// Excess torquing of each gyro, relative to the rate commanded about each platform axis: scale factors,
    /// and misalignments in rad.
    pub(crate) torquer: [Vector; 3],
    /// White noise of a sample, in g.
    pub(crate) noise_g: f64,
    /// Quantum of the output, in g; 0: none.
    pub(crate) quantum_g: f64,
    /// Angle random walk, in deg/sqrt(h).
    pub(crate) walk_deg_sqrt_h: f64,
    /// Gauss-Markov drift of every gyro: sigma in deg/h, correlation time in s.
    pub(crate) markov: (f64, f64),
    /// Time between two samples, in s.
    pub(crate) step_s: f64,
    /// Reciprocal of the fraction of samples that are dropped; 0: none.
    pub(crate) dropped: u64,
    /// Factor on all outputs.
    pub(crate) scale: f64,
    pub(crate) seed: u64,
}

impl Default for Bench {
    fn default() -> Self {
        Self {
            latitude_deg: 28.2,
            positions: vec![("p1", [0.0, 0.0, 0.0], 1000.0), ("p2", [180.0, 0.0, 0.0], 1000.0)],
            slew_deg_s: None,
            carry: AtOnce::Inertial,
            psi: [0.1, 0.1, 0.1].map(f64::to_radians),
            drift: [[11.0, 12.0, 13.0], [5.0; 3], [5.0; 3], [5.0; 3]],
            squares: [[0.0; 3]; 3],
            accelerometers: [[0.0; 3]; 3],
            mounting: [[0.0; 3]; 3],
            torquer: [[0.0; 3]; 3],
            noise_g: 1e-5,
            quantum_g: 0.0,
            walk_deg_sqrt_h: 0.0,
            markov: (0.0, 3600.0),
            step_s: 10.0,
            dropped: 0,
            scale: 1.0,
            seed: 1,
        }
    }
}

/// Row of a record.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sample {
    pub(crate) t: f64,
    /// Label of the position; empty while the platform turns.
    pub(crate) label: &'static str,
    pub(crate) f: Vector,
}

fn multiply(a: &Quaternion, b: &Quaternion) -> Quaternion {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// Quaternion of a rotation vector.
fn of_vector(v: &Vector) -> Quaternion {
    let angle = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let k = if angle < 1e-12 { 0.5 } else { (angle / 2.0).sin() / angle };
    [(angle / 2.0).cos(), k * v[0], k * v[1], k * v[2]]
}

fn conjugate(q: &Quaternion) -> Quaternion {
    [q[0], -q[1], -q[2], -q[3]]
}

/// Vector of platform axes, turned into n.
pub(crate) fn turned(q: &Quaternion, v: &Vector) -> Vector {
    let out = multiply(&multiply(q, &[0.0, v[0], v[1], v[2]]), &conjugate(q));
    [out[1], out[2], out[3]]
}

/// Passive turns Mx(alpha) My(beta) Mz(gamma) as one quaternion from c to n: a passive turn by an angle is an
/// active one by its negative.
pub(crate) fn attitude(angles_deg: &Vector) -> Quaternion {
    let [a, b, c] = angles_deg.map(f64::to_radians);
    let about = |axis: usize, angle: f64| {
        let mut v = [0.0; 3];
        v[axis] = -angle;
        of_vector(&v)
    };
    multiply(&multiply(&about(0, a), &about(1, b)), &about(2, c))
}

/// Rotation vector of a quaternion, of the shorter turn.
fn vector(q: &Quaternion) -> Vector {
    let q = if q[0] < 0.0 { q.map(|x| -x) } else { *q };
    let s = (q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    let k = if s < 1e-12 { 2.0 } else { 2.0 * s.atan2(q[0]) / s };
    [k * q[1], k * q[2], k * q[3]]
}

pub(crate) struct Random(SplitMix64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    fn uniform(&mut self) -> f64 {
        ((self.0.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// Standard normal random number (Box-Muller).
    pub(crate) fn normal(&mut self) -> f64 {
        let (u, v) = (self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

impl Bench {
    /// Drift in platform axes, in rad/s, for gravity `g` there: the paper's mounting.
    fn drift(&self, g: &Vector) -> Vector {
        let [f, i, o, s] = &self.drift;
        let linear = [
            f[0] + i[0] * g[0] + s[0] * g[1] - o[0] * g[2],
            f[1] + i[1] * g[1] - s[1] * g[0] - o[1] * g[2],
            f[2] + i[2] * g[2] + s[2] * g[1] + o[2] * g[0],
        ];
        // gravity along I, O and S of each gyro
        let along = [[g[0], g[2], g[1]], [g[1], g[2], g[0]], [g[2], g[0], g[1]]];
        let squared = |x: usize| (0..3).map(|k| self.squares[k][x] * along[x][k] * along[x][k]).sum::<f64>();
        std::array::from_fn(|x| (linear[x] + squared(x)) * DPH)
    }

    /// Record of the bench.
    pub(crate) fn record(&self) -> Vec<Sample> {
        let mut random = Random(SplitMix64::new(self.seed));
        let latitude = self.latitude_deg.to_radians();
        let earth = [EARTH_RATE * latitude.cos(), EARTH_RATE * latitude.sin(), 0.0];
        let mut computed = attitude(&self.positions[0].1);
        // C_p^n = exp([psi^n x]) C_c^n
        let mut q = multiply(&of_vector(&turned(&computed, &self.psi)), &computed);
        let mut markov = [0.0; 3].map(|_: f64| self.markov.0 * DPH * random.normal());
        let (mut t, mut out) = (0.0, Vec::new());
        for (p, (name, angles, dwell)) in self.positions.iter().enumerate() {
            let target = attitude(angles);
            let turn = vector(&multiply(&conjugate(&computed), &target));
            let angle = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
            if p > 0 {
                match self.slew_deg_s {
                    Some(rate) if angle > 1e-9 => {
                        let seconds = angle / rate.to_radians();
                        let steps = (seconds / self.step_s).floor() as usize;
                        for k in 0..=steps {
                            let dt =
                                if k < steps { self.step_s } else { seconds - steps as f64 * self.step_s };
                            self.advance(
                                &mut q,
                                &mut computed,
                                &earth,
                                &turn.map(|x| x / seconds),
                                dt,
                                &mut markov,
                                &mut random,
                            );
                            t += dt;
                            if k < steps {
                                self.sample(&mut out, t, "", &q, &mut random);
                            }
                        }
                    }
                    _ => {
                        q = match &self.carry {
                            AtOnce::Inertial => multiply(&multiply(&q, &conjugate(&computed)), &target),
                            AtOnce::Platform => multiply(&target, &multiply(&conjugate(&computed), &q)),
                            AtOnce::Reset(psi) => {
                                multiply(&of_vector(&turned(&target, &psi[p - 1])), &target)
                            }
                        }
                    }
                }
                computed = target;
            }
            let steps = (dwell / self.step_s).round() as usize;
            for _ in 0..steps {
                self.advance(&mut q, &mut computed, &earth, &[0.0; 3], self.step_s, &mut markov, &mut random);
                t += self.step_s;
                self.sample(&mut out, t, name, &q, &mut random);
            }
        }
        out
    }

    /// Turns platform and computed platform in short parts: the gyros keep the platform at the commanded
    /// rate, with their drift.
    #[allow(clippy::too_many_arguments, reason = "one step of everything that moves")]
    fn advance(
        &self,
        q: &mut Quaternion,
        computed: &mut Quaternion,
        earth: &Vector,
        slew: &Vector,
        dt: f64,
        markov: &mut Vector,
        random: &mut Random,
    ) {
        let fast = slew.iter().any(|x| *x != 0.0);
        let parts = (dt / if fast { 0.02 } else { 1.0 }).ceil().max(1.0) as usize;
        let h = dt / parts as f64;
        let walk = self.walk_deg_sqrt_h.to_radians() / 60.0 / h.sqrt();
        let fade = (-h / self.markov.1).exp();
        for _ in 0..parts {
            let white = [0.0; 3].map(|_: f64| walk * random.normal());
            // rate at the middle, by a half step
            let mut middle = *q;
            let mut middle_computed = *computed;
            for half in [true, false] {
                let (at, at_computed) = (middle, middle_computed);
                let command_earth = turned(&conjugate(&at_computed), earth);
                let g = turned(&conjugate(&at), &[0.0, -1.0, 0.0]);
                let (drift, still) = (self.drift(&g), turned(&conjugate(&at), earth));
                let command: Vector = std::array::from_fn(|i| command_earth[i] + slew[i]);
                let rate: Vector = std::array::from_fn(|i| {
                    let wrong: f64 = (0..3).map(|j| self.torquer[i][j] * command[j]).sum();
                    command[i] + wrong + drift[i] + markov[i] + white[i] - still[i]
                });
                let part = if half { h / 2.0 } else { h };
                middle = multiply(q, &of_vector(&rate.map(|x| x * part)));
                middle_computed = multiply(computed, &of_vector(&slew.map(|x| x * part)));
            }
            (*q, *computed) = (middle, middle_computed);
            for m in markov.iter_mut() {
                *m = fade * *m + (1.0 - fade * fade).sqrt() * self.markov.0 * DPH * random.normal();
            }
        }
        let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        *q = q.map(|x| x / length);
    }

    fn sample(
        &self,
        out: &mut Vec<Sample>,
        t: f64,
        label: &'static str,
        q: &Quaternion,
        random: &mut Random,
    ) {
        let force = turned(&conjugate(q), &[0.0, 1.0, 0.0]);
        let [k0, k1, k2] = &self.accelerometers;
        let f: Vector = std::array::from_fn(|i| {
            let across: f64 = (0..3).map(|j| self.mounting[i][j] * force[j]).sum();
            let seen = force[i] + k0[i] + k1[i] * force[i] + k2[i] * force[i] * force[i] + across;
            let noisy = self.scale * (seen + self.noise_g * random.normal());
            if self.quantum_g > 0.0 { (noisy / self.quantum_g).round() * self.quantum_g } else { noisy }
        });
        let there = self.dropped == 0 || !random.0.next_u64().is_multiple_of(self.dropped);
        if there {
            out.push(Sample { t, label, f });
        }
    }
}

/// Samples as CSV.
pub(crate) fn csv(samples: &[Sample]) -> String {
    let line = |s: &Sample| format!("{},{},{},{},{}\n", s.t, s.label, s.f[0], s.f[1], s.f[2]);
    std::iter::once("t [s],position,fx [g],fy [g],fz [g]\n".to_string())
        .chain(samples.iter().map(line))
        .collect()
}

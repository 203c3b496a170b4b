//! Free motion of psi: `exp(F t)`, as a power series in time and at a random time.

use obsdeg_exact::series::SeriesRing;
use obsdeg_exact::{Field, SplitMix64};

use crate::model::platform::{LOCAL, local_dynamics};
use crate::model::ring::Ring;

/// Rings that contain the prime field.
pub(crate) trait LiftField: Ring {
    /// Image of an element of the field.
    fn lift(&self, x: u64) -> Self::Element;
}

impl LiftField for Field {
    fn lift(&self, x: u64) -> u64 {
        x
    }
}

impl LiftField for SeriesRing {
    fn lift(&self, x: u64) -> Vec<u64> {
        self.monomial(x, 0)
    }
}

/// psi rows of `exp(F r T)` as series, with r an element of the field: the sum of `F^k (r T)^k / k!`.
pub(crate) fn transition(ring: &SeriesRing, w_n: u64, w_u: u64, ratio: u64) -> [[Vec<u64>; LOCAL]; 3] {
    let f = &ring.field;
    let dynamics = local_dynamics(f, &w_n, &w_u);
    let mut out: [[Vec<u64>; LOCAL]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| ring.zero()));
    for (r, row) in out.iter_mut().enumerate() {
        let mut term: [u64; LOCAL] = std::array::from_fn(|c| if c == r { f.one() } else { 0 });
        for k in 0..ring.precision {
            for (entry, &x) in row.iter_mut().zip(&term) {
                entry[k] = x;
            }
            let scale = f.mul(ratio, f.from_ratio(1, k as i64 + 1));
            let old = term;
            term =
                std::array::from_fn(|c| f.mul(scale, f.dot(0, (0..LOCAL).map(|j| (old[j], dynamics[j][c])))));
        }
    }
    out
}

/// Transition matrix at a random time. `T`, `cos wT` and `sin wT` are independent except for
/// `cos^2 + sin^2 = 1`, so a random point of the circle stands for any dwell.
pub(crate) struct RandomTime {
    field: Field,
    /// Random time `T`.
    t: u64,
    /// Random values of `cos wT` and `sin(wT)/w`.
    circle: (u64, u64),
    /// The square of the earth rate W.
    pub w2: u64,
    /// Matrix W of `psi' = W psi + eps`.
    w: [[u64; 3]; 3],
    w_squared: [[u64; 3]; 3],
}

impl RandomTime {
    /// Transition at the rates `(wN, wU)` and the time `t`; the angle by which the earth rotates in it is
    /// random.
    pub(crate) fn random(field: Field, [w_n, w_u]: [u64; 2], t: u64, rng: &mut SplitMix64) -> Self {
        let f = field;
        let w2 = f.dot(0, [(w_n, w_n), (w_u, w_u)]);
        let circle = loop {
            let half = 1 + rng.below(f.modulus() - 1);
            let s2 = f.mul(w2, f.mul(half, half));
            let den = f.add(f.one(), s2);
            if den != 0 {
                let inverse = f.inv(den);
                break (f.mul(f.sub(f.one(), s2), inverse), f.mul(f.add(half, half), inverse));
            }
        };
        let dynamics = local_dynamics(&f, &w_n, &w_u);
        let w: [[u64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| dynamics[i][j]));
        let w_squared = crate::model::attitude::product(&f, &w, &w);
        Self { field, t, circle, w2, w, w_squared }
    }

    /// Matrix `a + b F + c F^2` on psi, for the coefficients (a, b, c).
    pub(crate) fn combine(&self, [unit, first, second]: [u64; 3]) -> [[u64; 3]; 3] {
        let entry = |i: usize, j: usize| {
            let unit = if i == j { unit } else { 0 };
            self.field.dot(unit, [(first, self.w[i][j]), (second, self.w_squared[i][j])])
        };
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }

    /// Pair `(cos, sin/w)` of the sum of two angles.
    fn turn(&self, a: (u64, u64), b: (u64, u64)) -> (u64, u64) {
        let f = &self.field;
        let cos = f.sub(f.mul(a.0, b.0), f.mul(self.w2, f.mul(a.1, b.1)));
        (cos, f.add(f.mul(a.0, b.1), f.mul(a.1, b.0)))
    }

    /// psi rows of `exp(F r T)`: `I + s W + (1-c)/w^2 W^2` and `rT I + (1-c)/w^2 W + (rT-s)/w^2 W^2`.
    pub(crate) fn phi(&self, ratio: u64) -> [[u64; LOCAL]; 3] {
        let f = &self.field;
        let (mut angle, mut base, mut e) = ((f.one(), 0), self.circle, ratio);
        while e > 0 {
            if e & 1 == 1 {
                angle = self.turn(angle, base);
            }
            base = self.turn(base, base);
            e >>= 1;
        }
        let (cos, sin) = angle;
        let time = f.mul(f.from_u64(ratio), self.t);
        let inverse = f.inv(self.w2);
        let versine = f.mul(f.sub(f.one(), cos), inverse);
        let rest = f.mul(f.sub(time, sin), inverse);
        let (of_psi, of_eps) = (self.combine([f.one(), sin, versine]), self.combine([time, versine, rest]));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| match j {
                0..3 => of_psi[i][j],
                3..6 => of_eps[i][j - 3],
                _ => 0,
            })
        })
    }
}

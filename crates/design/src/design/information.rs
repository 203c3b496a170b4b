//! The information of a sequence of positions, built up position by position: what a search evaluates millions of
//! times.

use std::ops::{Mul, Range};
use std::sync::OnceLock;

use nalgebra::DMatrix;
use obsdeg_core::model::slew::{Slew, W_IE};
use obsdeg_core::model::{
    Carry, Euler, Float, Gimbals, LOCAL, Matrix3, PSI_EPS, Platform, Scheme, c_n_f64, earth_rate_in,
    local_dynamics, local_output,
};
use obsdeg_ekf::BiasState;
use obsdeg_ekf::integrate::van_loan;
use obsdeg_evidence::simulation::{
    Conditions, PRIOR, Plan, SimulationError, is_rate, latitude_of, resolve, si_per_shown, steps,
};

use super::DesignError;
use super::correlated::{Joint, OfDwell};
use super::psi::OwnPsi;
use super::ways::{Stop, Way};

/// Most unknowns of a search: psi and the coefficients of all terms.
pub(crate) const MAX: usize = 66;
/// The same without errors of the accelerometers.
pub(super) const MAX_DRIFTS: usize = 33;

/// One candidate: its attitude, and what coefficients make of drift and accelerometers there.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub(super) c: Matrix3<f64>,
    /// `eps^n = C E(g)`, then the error of the accelerometers in `Z^n` (3 x d each), columns in the order of the evaluator; the last three
    /// are empty where none is unknown.
    pub(super) effects: [Vec<f64>; LOCAL - 3],
    /// Information of a position there on the coefficients, psi eliminated (n x n, row by row, lower triangle): what it
    /// adds to any scheme under reset carry; empty under the others.
    pub(super) own: Vec<f64>,
    /// Its own psi under reset carry, as soon as that was asked for.
    pub(super) psi: OnceLock<OwnPsi>,
    /// Which of the dwells of the evaluator it has.
    dwell: usize,
}

/// What a dwell makes of the local unknowns at a position.
#[derive(Debug, Clone)]
pub(super) struct Dwelling {
    pub(super) seconds: f64,
    /// Information of the position on its local unknowns.
    pub(super) local: [[f64; LOCAL]; LOCAL],
    /// `psi^n` behind it as a function of `(psi^n, eps^n)` before.
    pub(super) phi: [[f64; PSI_EPS]; 3],
    /// What its samples say where the noise of Z is correlated.
    pub(super) correlated: Option<Box<OfDwell>>,
}

/// What is known beforehand: information, zero where nothing is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Prior {
    /// On psi in platform axes at the start, under reset carry of every position, in 1/rad^2.
    pub(super) psi: [f64; 3],
    /// On the coefficients, in the order and the units of the evaluator (shape d).
    pub(super) coefficients: Vec<f64>,
}

/// What every evaluation shares.
#[derive(Debug, Clone)]
pub struct Evaluator {
    pub(super) platform: Platform,
    pub(super) conditions: Conditions,
    /// The column of every coefficient in the order of the evaluator: those that count come last.
    order: Vec<usize>,
    /// How many coefficients do not count.
    pub(super) nuisance: usize,
    /// The unit of every coefficient that is shown as 1, in `dph`, in the order of the evaluator.
    scale: Vec<f64>,
    /// Unknowns: psi, then d coefficients.
    pub(super) n: usize,
    /// Local unknowns of a position.
    locals: usize,
    /// The rotation of the dynamics of psi^n: `psi' = W psi + eps`.
    pub(super) w: Matrix3<f64>,
    /// That of all positions; where they have dwells of their own, of the first.
    dwells: Vec<Dwelling>,
    pub(super) candidates: Vec<Candidate>,
    /// The way from candidate i to j at `i * candidates + j`; empty when repositioning takes no time.
    pub(super) ways: Vec<Way>,
    pub(super) prior: Prior,
    /// The process that each accelerometer has beside white noise.
    pub(super) bias: Option<BiasState>,
    /// deg/h in rad/s. Coefficients of other units are scaled to it: a sigma over it is in the unit of its coefficient.
    pub(super) dph: f64,
}

/// A sequence so far.
#[derive(Debug, Clone)]
pub struct State {
    /// Information (n x n), row by row, lower triangle.
    pub(super) information: Vec<f64>,
    /// psi in the carried axes as a functional of the unknowns (3 x n).
    pub(super) psi: [Vec<f64>; 3],
    /// Where the noise of Z is correlated: what is known of it by now.
    pub(super) joint: Option<Joint>,
    /// The candidates in order.
    pub(super) path: Vec<usize>,
    /// Dwells and turns, in s.
    pub seconds: f64,
}

impl Evaluator {
    /// The evaluator for positions of `dwell_s` each, without drift noise; of priors those count that are stated. `required` are the
    /// coefficients that count (indices among the coefficients); the others are estimated with them.
    ///
    /// # Errors
    /// [`DesignError`].
    pub fn new(
        base: &Scheme,
        candidates: &[Euler],
        required: &[usize],
        conditions: &Conditions,
    ) -> Result<Self, DesignError> {
        Self::while_going(base, candidates, required, conditions, &|| true)
    }

    /// The same, as long as `going` says so: the ways between many candidates take a while.
    pub(super) fn while_going(
        base: &Scheme,
        candidates: &[Euler],
        required: &[usize],
        conditions: &Conditions,
        going: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, DesignError> {
        let scheme = Scheme {
            positions: Scheme::of_angles(candidates.iter().take(1).cloned()).positions,
            latitude: latitude_of(base),
            combinations: Vec::new(),
            gimbals: Gimbals::default(),
            ..base.clone()
        };
        let latitude = scheme
            .latitude
            .map_or((1.0, 0.0), |l| obsdeg_exact::Turn::from_nanodeg(l.nanodeg()).cos_sin_f64());
        if conditions.slew_rate_deg_s.is_some() && scheme.carry != Carry::Inertial {
            return Err(SimulationError::SlewCarry { carry: scheme.carry }.into());
        }
        let platform = Platform::new(scheme)?;
        let d = platform.coefficients();
        let dph = si_per_shown("deg/h");
        if d + 3 > MAX {
            return Err(DesignError::TooManyUnknowns { found: d + 3 });
        }
        let f = local_dynamics(&Float, &(W_IE * latitude.0), &(W_IE * latitude.1));
        let counts = |c: &usize| required.contains(c);
        let order: Vec<usize> = (0..d).filter(|c| !counts(c)).chain((0..d).filter(|c| counts(c))).collect();
        let locals = platform.observed().locals();
        let units = platform.units()[platform.units().len() - d..].to_vec();
        let prior = Prior::of(&platform, conditions, &order)?;
        let empty = Self {
            prior,
            bias: conditions.accelerometer().states().first().copied(),
            platform,
            conditions: conditions.clone(),
            nuisance: d - required.len(),
            scale: order.iter().map(|&c| si_per_shown(units[c]) / dph).collect(),
            order,
            n: d + 3,
            locals,
            w: std::array::from_fn(|i| std::array::from_fn(|j| f[i][j])),
            dwells: Vec::new(),
            candidates: Vec::new(),
            ways: Vec::new(),
            dph,
        };
        let attitudes: Vec<Matrix3<f64>> = candidates.iter().map(c_n_f64).collect();
        empty.with_dwell(conditions.dwell_s)?.among(&attitudes, going)
    }

    /// The same with another dwell.
    ///
    /// # Errors
    /// [`DesignError::Filter`].
    pub fn with_dwell(mut self, dwell_s: f64) -> Result<Self, DesignError> {
        self.dwells = vec![self.dwelling(dwell_s)?];
        let attitudes: Vec<Matrix3<f64>> = self.candidates.iter().map(|c| c.c).collect();
        let ways = std::mem::take(&mut self.ways);
        self.stand_at(&attitudes);
        self.ways = ways;
        Ok(self)
    }

    /// What so many seconds at a position are.
    pub(super) fn dwelling(&self, dwell_s: f64) -> Result<Dwelling, DesignError> {
        let f = local_dynamics(&Float, &self.w[1][2], &-self.w[0][2]);
        let f = DMatrix::from_fn(LOCAL, LOCAL, |i, j| f[i][j]);
        let steps = steps(dwell_s, self.conditions.step_s)?;
        let none = DMatrix::zeros(LOCAL, LOCAL);
        let (step, _) = van_loan(&f, &none, dwell_s / steps as f64)?;
        let outputs = local_output(&Float, self.platform.observed());
        let mut now: DMatrix<f64> = DMatrix::identity(LOCAL, LOCAL);
        let mut local = [[0.0; LOCAL]; LOCAL];
        let of = |bias| Box::new(self.of_dwell(bias, &step, steps, dwell_s / steps as f64));
        let correlated = self.bias.as_ref().map(of);
        for _ in 0..steps {
            now = &step * now;
            for (component, h) in &outputs {
                let weight = 1.0 / Plan::output_sigma(*component, &self.conditions).powi(2);
                let row: [f64; LOCAL] = std::array::from_fn(|j| (0..LOCAL).map(|i| h[i] * now[(i, j)]).sum());
                for i in 0..LOCAL {
                    for j in 0..LOCAL {
                        local[i][j] += weight * row[i] * row[j];
                    }
                }
            }
        }
        let phi = std::array::from_fn(|i| std::array::from_fn(|j| now[(i, j)]));
        Ok(Dwelling { seconds: dwell_s, local, phi, correlated })
    }

    /// Every candidate with a dwell of its own, which [`Self::dwell_at`] changes.
    pub(super) fn with_dwells(mut self) -> Self {
        self.dwells = vec![self.dwells[0].clone(); self.candidates.len()];
        self.candidates.iter_mut().enumerate().for_each(|(i, c)| c.dwell = i);
        self
    }

    /// Changes the dwell of a candidate that has one of its own.
    pub(super) fn dwell_at(&mut self, candidate: usize, dwelling: &Dwelling) {
        let Candidate { c, effects, dwell, .. } = &self.candidates[candidate];
        self.dwells[*dwell].clone_from(dwelling);
        let own = self.information_alone(c, effects, dwelling);
        (self.candidates[candidate].own, self.candidates[candidate].psi) = (own, OnceLock::new());
    }

    /// What the dwell of a candidate is.
    pub(super) fn dwelling_of(&self, candidate: usize) -> &Dwelling {
        &self.dwells[self.candidates[candidate].dwell]
    }

    /// The rows of `eps^n` at an attitude, while the platform turns as `slew` says.
    pub(super) fn drift_rows(&self, c: &Matrix3<f64>, slew: Option<&Slew>) -> [Vec<f64>; 3] {
        let rate = || {
            let earth = earth_rate_in(&Float, c, &self.w[1][2], &-self.w[0][2]);
            std::array::from_fn(|i| earth[i] + slew.map_or(0.0, |s| s.rate[i]))
        };
        self.platform.errors().drift_rows(&Float, c, rate)
    }

    /// [`Candidate::effects`] of an attitude.
    pub(super) fn effects(&self, c: &Matrix3<f64>) -> [Vec<f64>; LOCAL - 3] {
        let [x, y, z] = self.ordered_columns(self.drift_rows(c, None));
        let [a, b, c] = match self.platform.observed().accelerometers {
            true => self.ordered_columns(self.platform.errors().accelerometer_rows(&Float, c)),
            false => Default::default(),
        };
        [x, y, z, a, b, c]
    }

    /// The candidates without the ways between them.
    pub(super) fn stand_at(&mut self, attitudes: &[Matrix3<f64>]) {
        self.candidates = attitudes
            .iter()
            .map(|c| {
                let effects = self.effects(c);
                Candidate {
                    own: self.information_alone(c, &effects, &self.dwells[0]),
                    effects,
                    c: *c,
                    psi: OnceLock::new(),
                    dwell: 0,
                }
            })
            .collect();
        self.ways.clear();
    }

    /// Where a candidate stands, and how long.
    pub(super) fn stands(&self, candidate: usize) -> (&Matrix3<f64>, &Dwelling) {
        let Candidate { c, dwell, .. } = &self.candidates[candidate];
        (c, &self.dwells[*dwell])
    }

    /// Information of one position on the coefficients with a psi of its own; empty where psi goes on, or the noise of Z.
    fn information_alone(
        &self,
        c: &Matrix3<f64>,
        effects: &[Vec<f64>; LOCAL - 3],
        dwelling: &Dwelling,
    ) -> Vec<f64> {
        if self.ordered() {
            return Vec::new();
        }
        let n = self.n;
        let mut local = [[0.0; MAX]; LOCAL];
        for r in 0..3 {
            local[r][..3].copy_from_slice(&c[r]);
        }
        for (row, effect) in local[3..self.locals].iter_mut().zip(effects) {
            row[3..n].copy_from_slice(effect);
        }
        let weighted = self.weighted(&local, dwelling);
        let mut own = [[0.0; MAX]; MAX];
        for (i, row) in own[..n].iter_mut().enumerate() {
            for (l, w) in local.iter().zip(&weighted) {
                for (x, y) in row[..=i].iter_mut().zip(&w[..=i]) {
                    *x += l[i] * y;
                }
            }
        }
        self.prior.psi.iter().enumerate().for_each(|(k, p)| own[k][k] += p);
        eliminate(&mut own, n, 0..3);
        own[..n]
            .iter()
            .enumerate()
            .flat_map(|(i, row)| (0..n).map(move |j| if j <= i { row[j] } else { 0.0 }))
            .collect()
    }

    /// Information of a position on its drift in n and the error of its accelerometers in `Z^n`, its psi eliminated, whose prior is
    /// the same about every axis.
    pub(super) fn information_of_effects(&self) -> [[f64; LOCAL - 3]; LOCAL - 3] {
        let mut all = [[0.0; MAX]; MAX];
        for (row, local) in all.iter_mut().zip(&self.dwells[0].local) {
            row[..LOCAL].copy_from_slice(local);
        }
        self.prior.psi.iter().enumerate().for_each(|(k, p)| all[k][k] += p);
        eliminate(&mut all, LOCAL, 0..3);
        std::array::from_fn(|i| std::array::from_fn(|j| all[3 + i.max(j)][3 + i.min(j)]))
    }

    /// `G L` for the functionals L of the local unknowns at a position (of n unknowns each).
    fn weighted<const L: usize, const N: usize>(
        &self,
        local: &[[f64; N]; L],
        dwelling: &Dwelling,
    ) -> [[f64; N]; L] {
        let n = self.n;
        let mut weighted = [[0.0; N]; L];
        for (row, weights) in weighted.iter_mut().zip(&dwelling.local) {
            for (l, &g) in local.iter().zip(weights) {
                if g != 0.0 {
                    for (x, y) in row[..n].iter_mut().zip(&l[..n]) {
                        *x += g * y;
                    }
                }
            }
        }
        weighted
    }

    /// Rows on the coefficients in SI units, in the order and the units of the evaluator.
    pub(super) fn ordered_columns(&self, rows: [Vec<f64>; 3]) -> [Vec<f64>; 3] {
        rows.map(|row| self.in_order(&row))
    }

    /// One of these rows, of any numbers.
    pub(super) fn in_order<X: Copy + Mul<f64, Output = X>>(&self, row: &[X]) -> Vec<X> {
        self.order.iter().zip(&self.scale).filter_map(|(&c, scale)| Some(*row.get(c)? * *scale)).collect()
    }

    /// The same where nothing is known beforehand.
    pub(super) fn without_prior(&self) -> Self {
        let prior = Prior { psi: [0.0; 3], coefficients: vec![0.0; self.n - 3] };
        let attitudes: Vec<Matrix3<f64>> = self.candidates.iter().map(|c| c.c).collect();
        let mut out = Self { prior, ..self.clone() };
        out.stand_at(&attitudes);
        out.ways.clone_from(&self.ways);
        out
    }

    /// Nothing but what is known beforehand.
    pub fn start(&self) -> State {
        let n = self.n;
        let unit = |r: usize| (0..n).map(|c| f64::from(u8::from(c == r))).collect();
        let mut information = vec![0.0; n * n];
        let mut known = |i: usize, p: f64| information[i * n + i] = p;
        self.prior.coefficients.iter().enumerate().for_each(|(j, &p)| known(3 + j, p));
        // of platform axes; psi^n is known by the first position, and that of reset carry by every one
        if self.carry() == Carry::Platform {
            self.prior.psi.iter().enumerate().for_each(|(k, &p)| known(k, p));
        }
        State {
            information,
            psi: std::array::from_fn(unit),
            joint: self.bias.as_ref().map(|bias| Joint::start(bias, n)),
            path: Vec::new(),
            seconds: 0.0,
        }
    }

    /// Whether the order of positions makes a difference.
    pub(crate) fn ordered(&self) -> bool {
        self.carry() != Carry::Reset || self.bias.is_some()
    }

    pub(super) fn carry(&self) -> Carry {
        self.platform.scheme().carry
    }

    /// Largest time between samples, in s.
    pub(super) fn step_s(&self) -> f64 {
        self.conditions.step_s
    }

    /// Dwell of each position, in s; where they have dwells of their own, of the first.
    pub fn dwell_s(&self) -> f64 {
        self.dwells[0].seconds
    }

    /// Adds a position to `state`; the result goes to `out`.
    pub fn extend(&self, state: &State, stop: Stop, out: &mut State) {
        if let Some(bias) = &self.bias {
            return self.extend_correlated(bias, state, stop, false, out);
        }
        // sizes that the compiler knows
        match self.locals {
            PSI_EPS => self.extend_in::<PSI_EPS, MAX_DRIFTS>(state, stop, out),
            _ => self.extend_in::<LOCAL, MAX>(state, stop, out),
        }
    }

    fn extend_in<const L: usize, const N: usize>(&self, state: &State, stop: Stop, out: &mut State) {
        let n = self.n;
        let carry = self.carry();
        let Candidate { c, own, dwell, .. } = &self.candidates[stop.candidate];
        let dwelling = &self.dwells[*dwell];
        let turn = self.way_to(state.path.last().copied(), stop);
        out.path.clone_from(&state.path);
        out.path.push(stop.candidate);
        out.seconds = state.seconds + dwelling.seconds + turn.map_or(0.0, |t| t.seconds);
        if carry == Carry::Reset {
            // psi of the position is eliminated: information adds
            for ((sum, x), y) in out.information.iter_mut().zip(&state.information).zip(own) {
                *sum = x + y;
            }
            return;
        }
        let local = self.functionals::<L, N>(state, stop);
        // L^T (G L)
        let weighted = self.weighted(&local, dwelling);
        out.information.copy_from_slice(&state.information);
        self.know_first(state, c, |i, j, known| out.information[i * n + j] += known);
        for i in 0..n {
            let row = &mut out.information[i * n..=i * n + i];
            for (l, w) in local.iter().zip(&weighted).filter(|(l, _)| l[i] != 0.0) {
                for (x, y) in row.iter_mut().zip(&w[..=i]) {
                    *x += l[i] * y;
                }
            }
        }
        self.go_on(dwelling, c, &local, out);
    }

    /// The local unknowns of a position behind others as functionals of the unknowns; psi where it goes on.
    #[inline]
    pub(super) fn functionals<const L: usize, const N: usize>(
        &self,
        state: &State,
        stop: Stop,
    ) -> [[f64; N]; L] {
        let (n, carry) = (self.n, self.carry());
        let Candidate { c, effects, .. } = &self.candidates[stop.candidate];
        let turn = self.way_to(state.path.last().copied(), stop);
        let mut local = [[0.0; N]; L];
        for (row, effect) in local[3..].iter_mut().zip(&effects[..self.locals - 3]) {
            row[3..n].copy_from_slice(effect);
        }
        if carry == Carry::Reset {
            return local;
        }
        for r in 0..3 {
            match turn {
                _ if carry == Carry::Platform => {
                    for (j, x) in local[r][..n].iter_mut().enumerate() {
                        *x = (0..3).map(|k| c[r][k] * state.psi[k][j]).sum();
                    }
                }
                None => local[r][..n].copy_from_slice(&state.psi[r]),
                Some(turn) => {
                    for (j, x) in local[r][..n].iter_mut().enumerate() {
                        *x = (0..3).map(|k| turn.phi[r][k] * state.psi[k][j]).sum();
                    }
                    for (x, y) in local[r][3..n].iter_mut().zip(&turn.drift[r]) {
                        *x += y;
                    }
                }
            }
        }
        local
    }

    /// What is known beforehand of psi^n, which is what goes on under inertial carry: by the axes of the first position.
    #[inline]
    pub(super) fn know_first(&self, state: &State, c: &Matrix3<f64>, mut add: impl FnMut(usize, usize, f64)) {
        if self.carry() != Carry::Inertial || !state.path.is_empty() {
            return;
        }
        // psi^c = C^T psi^n
        for (i, j) in [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)] {
            let known = self.prior.psi.iter().enumerate().map(|(k, p)| c[i][k] * p * c[j][k]);
            add(i, j, known.sum());
        }
    }

    /// psi behind a dwell, in the axes in which it goes on.
    #[inline]
    pub(super) fn go_on<const L: usize, const N: usize>(
        &self,
        dwelling: &Dwelling,
        c: &Matrix3<f64>,
        local: &[[f64; N]; L],
        out: &mut State,
    ) {
        let n = self.n;
        if self.carry() == Carry::Reset {
            return;
        }
        let mut after = [[0.0; N]; 3];
        for (row, phi) in after.iter_mut().zip(&dwelling.phi) {
            for (l, p) in local.iter().zip(phi) {
                for (x, y) in row[..n].iter_mut().zip(&l[..n]) {
                    *x += p * y;
                }
            }
        }
        for (k, row) in out.psi.iter_mut().enumerate() {
            match self.carry() {
                Carry::Platform => {
                    for (j, x) in row.iter_mut().enumerate() {
                        *x = (0..3).map(|r| c[r][k] * after[r][j]).sum();
                    }
                }
                _ => row.copy_from_slice(&after[k][..n]),
            }
        }
    }
}

impl Prior {
    /// What `conditions` state of the unknowns of `platform`; coefficients in this order.
    fn of(platform: &Platform, conditions: &Conditions, order: &[usize]) -> Result<Self, DesignError> {
        let sigmas = resolve(PRIOR, platform, conditions.stated_priors(), f64::INFINITY)?;
        let scaled = |(sigma, unit): (&f64, &&str)| match is_rate(unit) {
            true => sigma * conditions.drift_scale,
            false => *sigma,
        };
        let sigmas: Vec<f64> = sigmas.iter().zip(platform.units()).map(scaled).collect();
        let information = |sigma: f64, unit: &str| (sigma * si_per_shown(unit)).powi(-2);
        let first = sigmas.len() - platform.coefficients();
        Ok(Self {
            psi: std::array::from_fn(|k| information(sigmas[k], "rad")),
            coefficients: order.iter().map(|&c| information(sigmas[first + c], "deg/h")).collect(),
        })
    }

    /// Whether psi is known as well about every axis.
    pub(super) fn is_alike(&self) -> bool {
        self.psi.iter().all(|p| *p == self.psi[0])
    }
}

/// The Schur complement of some unknowns of a symmetric matrix (n x n, lower triangle), those before them zero; these are set to zero.
pub(super) fn eliminate<const N: usize>(m: &mut [[f64; N]], n: usize, pivots: Range<usize>) {
    for p in pivots {
        let pivot = m[p][p];
        if pivot <= 0.0 {
            continue;
        }
        let column: [f64; N] = std::array::from_fn(|i| if i < n && i >= p { m[i][p] } else { 0.0 });
        for i in p + 1..n {
            for j in p + 1..=i {
                m[i][j] -= column[i] * column[j] / pivot;
            }
        }
        for row in m.iter_mut().take(n).skip(p) {
            row[p] = 0.0;
        }
    }
}

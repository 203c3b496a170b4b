//! Information of a sequence, built up position by position: the innermost loop of a search.

use obsdeg_core::model::{Carry, LOCAL, PSI_EPS};

use crate::design::measure::evaluator::{CandidateAttitude, Evaluator, SequenceState};
use crate::design::measure::noise_process::BiasDistribution;
use crate::design::measure::stop::Stop;
use crate::design::request::limits::{MAX_DRIFTS, MAX_UNKNOWNS};

impl Evaluator {
    /// State without positions: the prior alone.
    pub fn start(&self) -> SequenceState {
        let n = self.n;
        let unit = |r: usize| (0..n).map(|c| f64::from(u8::from(c == r))).collect();
        let mut information = vec![0.0; n * n];
        let mut known = |i: usize, p: f64| information[i * n + i] = p;
        self.prior.coefficients.iter().enumerate().for_each(|(j, &p)| known(3 + j, p));
        // in platform axes; under inertial carry the prior is added with the first position, under
        // reset with each
        if self.carry() == Carry::Platform {
            self.prior.psi.iter().enumerate().for_each(|(k, &p)| known(k, p));
        }
        SequenceState {
            information,
            psi: std::array::from_fn(unit),
            joint: self.bias.as_ref().map(|bias| BiasDistribution::start(bias, n)),
            beside: self.beside_at_start(),
            path: Vec::new(),
            seconds: 0.0,
        }
    }

    /// Adds a position to `state`; the result goes to `out`.
    pub fn extend(&self, state: &SequenceState, stop: Stop, out: &mut SequenceState) {
        self.extend_any(state, stop, true, out);
    }

    /// Adds only the information of a position: effects of errors that are not estimated stay in `out`
    /// as they were. Sufficient for sigmas and for bounds on them.
    pub(crate) fn extend_information(&self, state: &SequenceState, stop: Stop, out: &mut SequenceState) {
        self.extend_any(state, stop, false, out);
    }

    /// Adds the effects of errors that are not estimated. `out` must be the result of
    /// [`Self::extend_information`] for the same `state` and `stop`.
    pub(crate) fn extend_errors(&self, state: &SequenceState, stop: Stop, out: &mut SequenceState) {
        if self.carry() == Carry::Reset {
            return self.add_beside(state, stop.candidate, out);
        }
        let at = (stop.candidate, self.path_to(state.path.last().copied(), stop));
        match (self.locals, self.n) {
            (PSI_EPS, 0..=MAX_DRIFTS) => {
                let local = self.functionals::<PSI_EPS, MAX_DRIFTS>(state, stop);
                self.extend_beside(state, at, &local, out);
            }
            (PSI_EPS, _) => {
                let local = self.functionals::<PSI_EPS, MAX_UNKNOWNS>(state, stop);
                self.extend_beside(state, at, &local, out);
            }
            _ => {
                let local = self.functionals::<LOCAL, MAX_UNKNOWNS>(state, stop);
                self.extend_beside(state, at, &local, out);
            }
        }
    }

    fn extend_any(&self, state: &SequenceState, stop: Stop, beside: bool, out: &mut SequenceState) {
        if let Some(bias) = &self.bias {
            return self.extend_correlated(bias, state, stop, false, out);
        }
        // sizes known at compile time
        match (self.locals, self.n) {
            (PSI_EPS, 0..=MAX_DRIFTS) => self.extend_in::<PSI_EPS, MAX_DRIFTS>(state, stop, beside, out),
            (PSI_EPS, _) => self.extend_in::<PSI_EPS, MAX_UNKNOWNS>(state, stop, beside, out),
            _ => self.extend_in::<LOCAL, MAX_UNKNOWNS>(state, stop, beside, out),
        }
    }

    fn extend_in<const L: usize, const N: usize>(
        &self,
        state: &SequenceState,
        stop: Stop,
        beside: bool,
        out: &mut SequenceState,
    ) {
        let n = self.n;
        let carry = self.carry();
        let CandidateAttitude { c, own, dwell, .. } = &self.candidates[stop.candidate];
        let dwelling = &self.dwells[*dwell];
        let turn = self.path_to(state.path.last().copied(), stop);
        out.path.clone_from(&state.path);
        out.path.push(stop.candidate);
        out.seconds = state.seconds + dwelling.seconds + turn.map_or(0.0, |t| t.seconds);
        if carry == Carry::Reset {
            // psi of the position is eliminated: information adds up
            for ((sum, x), y) in out.information.iter_mut().zip(&state.information).zip(own) {
                *sum = x + y;
            }
            if beside {
                self.add_beside(state, stop.candidate, out);
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
        if beside {
            self.extend_beside(state, (stop.candidate, turn), &local, out);
        }
        self.go_on(dwelling, c, &local, out);
    }
}

//! Carry from position to position: psi as a functional of the unknowns.

use obsdeg_core::model::{Carry, Matrix3};

use crate::design::measure::evaluator::{CandidateAttitude, Dwelling, Evaluator, SequenceState};
use crate::design::measure::stop::Stop;

impl Evaluator {
    /// Local unknowns of the next position as functionals of the unknowns; psi only where it is
    /// carried.
    #[inline]
    pub(crate) fn functionals<const L: usize, const N: usize>(
        &self,
        state: &SequenceState,
        stop: Stop,
    ) -> [[f64; N]; L] {
        let (n, carry) = (self.n, self.carry());
        let CandidateAttitude { c, effects, .. } = &self.candidates[stop.candidate];
        let turn = self.path_to(state.path.last().copied(), stop);
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

    /// Prior information on psi^n, the carried quantity under inertial carry: about the axes of the
    /// first position.
    #[inline]
    pub(crate) fn know_first(
        &self,
        state: &SequenceState,
        c: &Matrix3<f64>,
        mut add: impl FnMut(usize, usize, f64),
    ) {
        if self.carry() != Carry::Inertial || !state.path.is_empty() {
            return;
        }
        // psi^c = C^T psi^n
        for (i, j) in [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)] {
            let known = self.prior.psi.iter().enumerate().map(|(k, p)| c[i][k] * p * c[j][k]);
            add(i, j, known.sum());
        }
    }

    /// psi after a dwell, in the axes in which it is carried.
    #[inline]
    pub(crate) fn go_on<const L: usize, const N: usize>(
        &self,
        dwelling: &Dwelling,
        c: &Matrix3<f64>,
        local: &[[f64; N]; L],
        out: &mut SequenceState,
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

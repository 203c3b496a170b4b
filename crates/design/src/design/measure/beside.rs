//! Changes of the estimates of a sequence by errors that the scheme does not estimate, stored beside
//! its information.

use obsdeg_core::model::slew::Slew;
use obsdeg_core::model::{Carry, Float, LOCAL, Matrix3, PSI_EPS, earth_rate_in};
use obsdeg_evidence::simulation::omitted::SEEN;
use obsdeg_evidence::simulation::{Conditions, si_per_shown};

use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::{Dwelling, Evaluator, SequenceState};
use crate::design::measure::omitted::{OmittedAt, OmittedErrors, OmittedSums};
use crate::design::measure::slew_path::SlewPath;
use crate::design::request::error::DesignError;
use crate::design::request::options::Immune;

/// Squared fraction of the samples of a unit error below which an effect is rounding: sines of right
/// angles are below 1e-16.
const NO_EFFECT: f64 = 1e-24;
/// Squared fraction of the samples of an error below which their residual after the unknowns is
/// rounding.
const SILENT: f64 = 1e-9;

impl Dwelling {
    /// `G v`, G the information on all local unknowns including errors of the accelerometers.
    fn information_of(&self, v: &[f64; LOCAL]) -> [f64; LOCAL] {
        std::array::from_fn(|i| self.full[i].iter().zip(v).map(|(g, x)| g * x).sum())
    }
}

impl Evaluator {
    /// Drift by the errors that are not estimated, at an attitude while the platform turns by `slew` (3
    /// x errors).
    fn omitted_drift(&self, of: &OmittedErrors, c: &Matrix3<f64>, slew: Option<&Slew>) -> [Vec<f64>; 3] {
        let (w_n, w_u) = (self.w[1][2], -self.w[0][2]);
        let earth = earth_rate_in(&Float, c, &w_n, &w_u);
        let rate = std::array::from_fn(|i| earth[i] + slew.map_or(0.0, |s| s.rate[i]));
        of.model.drift_rows(&Float, c, rate, [&w_n, &w_u])
    }

    /// Rows of [`Self::drift_rows`], followed by those of the errors that are not estimated.
    pub(crate) fn drift_with_omitted(&self, c: &Matrix3<f64>, slew: &Slew) -> [Vec<f64>; 3] {
        let mut rows = self.ordered_columns(self.drift_rows(c, Some(slew)));
        if let Some(of) = &self.omitted {
            let more = self.omitted_drift(of, c, Some(slew));
            rows.iter_mut().zip(more).for_each(|(row, more)| row.extend(more));
        }
        rows
    }

    /// Refuses sizes of immunity that [`Self::not_immune`] cannot decide in `most` positions. An error counts
    /// as silent below the fraction [`SILENT`] of the information of its samples. Beyond the largest size
    /// allowed here, a record might show such an error.
    ///
    /// # Errors
    /// [`DesignError::ImmuneSize`].
    pub(crate) fn check_immune(
        &self,
        immune: &[Immune],
        most: usize,
        conditions: &Conditions,
    ) -> Result<(), DesignError> {
        let Some(of) = &self.omitted else { return Ok(()) };
        let terms = of.model.terms().iter().map(|t| (t.family, t.name.as_str(), t.unit));
        let attitudes = ["attitude_x@1", "attitude_y@1", "attitude_z@1"].map(|n| ("attitude", n, "arcsec"));
        for (kind, (family, name, unit)) in terms.chain(attitudes).enumerate() {
            let Some(size) = of.immune[kind].filter(|size| *size > 0.0) else { continue };
            let largest = SEEN / (SILENT * self.samples_at_most(of, kind, most, conditions)).sqrt();
            if size > largest {
                let own = immune.iter().find(|i| i.names(family, name));
                let found = own.map_or_else(String::new, ToString::to_string);
                return Err(DesignError::ImmuneSize { found, most: largest / si_per_shown(unit), unit });
            }
        }
        Ok(())
    }

    /// Upper bound on `O^T R^-1 O` of an error in `most` positions, by the triangle inequality: psi is
    /// at most the drift times the time plus the effect of the turns.
    fn samples_at_most(&self, of: &OmittedErrors, kind: usize, most: usize, conditions: &Conditions) -> f64 {
        let dwell = self.dwells.iter().map(|d| d.seconds).fold(0.0, f64::max);
        let turn_s = conditions.slew_rate_deg_s.map_or(0.0, |rate| 360.0 / rate);
        let positions = most as f64;
        let seconds = if self.carry() == Carry::Reset { dwell } else { positions * (dwell + turn_s) };
        let mut o = [0.0f64; LOCAL];
        for at in &self.candidates {
            if let Some(effect) = at.omitted.effects.get(kind) {
                o[3..].iter_mut().zip(effect).for_each(|(o, e)| *o = o.max(e.abs()));
            }
        }
        let attitude = if kind >= of.fixed() { 1.0 } else { 0.0 };
        let torquer = of.model.terms().get(kind).is_some_and(|t| matches!(t.family, "GS" | "GM"));
        let turns = if torquer && turn_s > 0.0 { positions * std::f64::consts::TAU } else { 0.0 };
        let drift = o[3..PSI_EPS].iter().map(|x| x * x).sum::<f64>().sqrt();
        o[..3].fill(attitude + drift * seconds + turns);
        let norm = |d: &Dwelling| (0..LOCAL).map(|i| o[i] * d.full[i][i].max(0.0).sqrt()).sum::<f64>();
        positions * self.dwells.iter().map(norm).fold(0.0, f64::max).powi(2)
    }

    /// Effects of the errors at an attitude.
    pub(crate) fn omitted_at(
        &self,
        c: &Matrix3<f64>,
        unknowns: &[Vec<f64>; LOCAL - 3],
        dwelling: &Dwelling,
    ) -> OmittedAt {
        let Some(of) = &self.omitted else { return OmittedAt::default() };
        let (drift, output) = (self.omitted_drift(of, c, None), of.model.output_rows(&Float, c));
        let one = |j: usize| std::array::from_fn(|r| if r < 3 { drift[r][j] } else { output[r - 3][j] });
        let mut out = OmittedAt { effects: (0..of.fixed()).map(one).collect(), own: OmittedSums::default() };
        if self.carry() == Carry::Reset {
            out.own = self.omitted_alone(of, c, unknowns, dwelling, &out.effects);
        }
        out
    }

    /// Sums of one position with a psi of its own, which is eliminated.
    fn omitted_alone(
        &self,
        of: &OmittedErrors,
        c: &Matrix3<f64>,
        unknowns: &[Vec<f64>; LOCAL - 3],
        dwelling: &Dwelling,
        effects: &[[f64; LOCAL - 3]],
    ) -> OmittedSums {
        let n = self.n;
        let m = effects.len() + if of.attitudes { 3 } else { 0 };
        // columns: psi, coefficients, errors
        let column = |k: usize| -> [f64; LOCAL] {
            std::array::from_fn(|r| match (r, k) {
                (0..3, 0..3) => c[r][k],
                (3.., 3..) if k < n => unknowns[r - 3].get(k - 3).copied().unwrap_or(0.0),
                (3.., _) if k >= n && k < n + effects.len() => effects[k - n][r - 3],
                (0..3, _) if k >= n + effects.len() => c[r][k - n - effects.len()],
                _ => 0.0,
            })
        };
        let columns: Vec<[f64; LOCAL]> = (0..n + m).map(column).collect();
        let weighted = |v: &[f64; LOCAL]| dwelling.information_of(v);
        let product = |a: &[f64; LOCAL], b: &[f64; LOCAL]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let all: Vec<[f64; LOCAL]> = columns.iter().map(weighted).collect();
        let mut g: Vec<Vec<f64>> =
            all.iter().map(|w| columns.iter().map(|v| product(w, v)).collect()).collect();
        self.prior.psi.iter().enumerate().for_each(|(k, p)| g[k][k] += p);
        for p in 0..3 {
            let pivot = g[p][p];
            if pivot <= 0.0 {
                continue;
            }
            let row = g[p].clone();
            for other in g.iter_mut().skip(p + 1) {
                let part = other[p] / pivot;
                other.iter_mut().zip(&row).for_each(|(x, y)| *x -= part * y);
            }
        }
        let cross = (n..n + m).flat_map(|j| (0..n).map(move |i| (i, j)));
        OmittedSums {
            cross: cross.map(|(i, j)| if i < 3 { 0.0 } else { g[i][j] }).collect(),
            squares: (n..n + m).map(|j| g[j][j]).collect(),
            psi: vec![[0.0; 3]; m],
        }
    }

    /// Sums of a sequence without positions; `None` where no errors count.
    pub(crate) fn beside_at_start(&self) -> Option<Box<OmittedSums>> {
        let of = self.omitted.as_ref()?;
        let fixed = of.fixed();
        let (cross, squares) = (vec![0.0; fixed * self.n], vec![0.0; fixed]);
        Some(Box::new(OmittedSums { cross, squares, psi: vec![[0.0; 3]; fixed] }))
    }

    /// Adds a position under reset carry.
    pub(crate) fn add_beside(&self, state: &SequenceState, candidate: usize, out: &mut SequenceState) {
        let (Some(of), Some(before), Some(out)) = (&self.omitted, &state.beside, &mut out.beside) else {
            return;
        };
        let own = &self.candidates[candidate].omitted.own;
        let (fixed, n) = (of.fixed(), self.n);
        out.clone_from(before);
        out.cross.iter_mut().zip(&own.cross[..fixed * n]).for_each(|(x, y)| *x += y);
        out.squares.iter_mut().zip(&own.squares[..fixed]).for_each(|(x, y)| *x += y);
        // every position has its own attitude error
        out.cross.extend_from_slice(&own.cross[fixed * n..]);
        out.squares.extend_from_slice(&own.squares[fixed..]);
        out.psi.extend_from_slice(&own.psi[fixed..]);
    }

    /// Adds a position whose local unknowns are the functionals `local` of the unknowns.
    pub(crate) fn extend_beside<const L: usize, const N: usize>(
        &self,
        state: &SequenceState,
        (candidate, turn): (usize, Option<&SlewPath>),
        local: &[[f64; N]; L],
        out: &mut SequenceState,
    ) {
        let (Some(of), Some(before), Some(out)) = (&self.omitted, &state.beside, &mut out.beside) else {
            return;
        };
        let at = &self.candidates[candidate];
        let (c, dwelling, n, fixed) = (&at.c, &self.dwells[at.dwell], self.n, of.fixed());
        out.clone_from(before);
        if of.attitudes {
            out.cross.resize(out.cross.len() + 3 * n, 0.0);
            out.squares.resize(out.squares.len() + 3, 0.0);
            out.psi.resize(out.psi.len() + 3, [0.0; 3]);
        }
        let platform = self.carry() == Carry::Platform;
        for (j, psi) in out.psi.iter_mut().enumerate() {
            let mut o = [0.0; LOCAL];
            for r in 0..3 {
                o[r] = match turn {
                    _ if platform => (0..3).map(|k| c[r][k] * psi[k]).sum(),
                    None => psi[r],
                    Some(turn) => {
                        let gone_on: f64 = (0..3).map(|k| turn.phi[r][k] * psi[k]).sum();
                        gone_on + turn.omitted[r].get(j).copied().unwrap_or(0.0)
                    }
                };
            }
            if let Some(effects) = at.omitted.effects.get(j) {
                o[3..].copy_from_slice(effects);
            }
            // the attitude error of a position lasts as long as the position
            let own = (j >= before.psi.len()).then(|| (j - fixed) % 3);
            let offset: [f64; 3] = std::array::from_fn(|r| own.map_or(0.0, |axis| c[r][axis]));
            o.iter_mut().zip(&offset).for_each(|(x, y)| *x += y);
            let weighted = dwelling.information_of(&o);
            out.squares[j] += o.iter().zip(&weighted).map(|(x, y)| x * y).sum::<f64>();
            for (l, w) in local.iter().zip(&weighted).filter(|(_, w)| **w != 0.0) {
                for (x, y) in out.cross[j * n..][..n].iter_mut().zip(&l[..n]) {
                    *x += w * y;
                }
            }
            let after: [f64; 3] = std::array::from_fn(|r| {
                o[..PSI_EPS].iter().zip(&dwelling.phi[r]).map(|(x, p)| x * p).sum::<f64>() - offset[r]
            });
            *psi = match platform {
                true => std::array::from_fn(|k| (0..3).map(|r| c[r][k] * after[r]).sum()),
                false => after,
            };
        }
    }

    /// `L^-1 N_j` of an error, L the root of the information; zero where nothing is determined.
    fn forward(&self, cross: &[f64], l: &[f64], first: usize, y: &mut [f64]) {
        let n = self.n;
        for i in first..n {
            let row = &l[i * n..=i * n + i];
            let sum: f64 = row[first..i].iter().zip(&y[first..i]).map(|(a, b)| a * b).sum();
            y[i] = if row[i] > 0.0 { (cross[i] - sum) / row[i] } else { 0.0 };
        }
    }

    /// Changes of the coefficients that count by one sigma of every error with a size (shape d each, in units
    /// of the evaluator), one after the other; `l` is the root of the information.
    fn each_contribution(
        &self,
        of: &OmittedErrors,
        beside: &OmittedSums,
        l: &[f64],
        mut take: impl FnMut(&[f64]),
    ) {
        let (n, begin) = (self.n, 3 + self.nuisance);
        let first = if self.carry() == Carry::Reset { 3 } else { 0 };
        let mut y = vec![0.0; n];
        for j in (0..beside.squares.len()).filter(|&j| of.sizes[of.kind(j)] > 0.0) {
            self.forward(&beside.cross[j * n..][..n], l, first, &mut y);
            // only the coefficients that count, which come last
            for i in (begin..n).rev() {
                y[i] /= l[i * n + i];
                let (before, x) = (&l[i * n + begin..i * n + i], y[i]);
                y[begin..i].iter_mut().zip(before).for_each(|(y, l)| *y -= l * x);
            }
            let size = of.sizes[of.kind(j)];
            y[begin..].iter_mut().for_each(|b| *b *= size);
            take(&y[begin..]);
        }
    }

    /// Variances that the errors add to each coefficient that counts (shape d); empty without errors.
    pub(crate) fn added_variances(&self, state: &SequenceState, l: &[f64]) -> Vec<f64> {
        let (Some(of), Some(beside)) = (&self.omitted, &state.beside) else { return Vec::new() };
        let mut out = vec![0.0; self.n - 3 - self.nuisance];
        self.each_contribution(of, beside, l, |change| {
            out.iter_mut().zip(change).for_each(|(sum, b)| *sum += b * b);
        });
        out
    }

    /// Criteria D and E of the covariance of the coefficients that count, with the errors: in deg/h
    /// (per g).
    pub(crate) fn of_total_covariance(
        &self,
        state: &SequenceState,
        criterion: &Criterion,
        l: &[f64],
    ) -> Option<f64> {
        let (of, beside) = (self.omitted.as_ref()?, state.beside.as_ref()?);
        let (n, begin) = (self.n, 3 + self.nuisance);
        let d = n - begin;
        let block = |i: usize, j: usize| if j <= i { l[(i + begin) * n + j + begin] } else { 0.0 };
        let root = nalgebra::DMatrix::from_fn(d, d, block);
        let inverse = root.solve_lower_triangular(&nalgebra::DMatrix::identity(d, d))?;
        let mut covariance = inverse.transpose() * inverse;
        self.each_contribution(of, beside, l, |change| {
            let b = nalgebra::DVector::from_column_slice(change);
            covariance += &b * b.transpose();
        });
        let unit = self.dph * self.dph;
        let values = (covariance / unit).symmetric_eigenvalues();
        Some(match criterion {
            Criterion::D => (values.iter().map(|x| x.ln()).sum::<f64>() / (2.0 * d as f64)).exp(),
            _ => values.max().sqrt(),
        })
    }

    /// Distance of a sequence from immunity, dimensionless; 0 if immune. Each error adds 1 if it has an
    /// effect that it must not have or that no record shows, and less than 1 if a record shows it at a
    /// larger size than required. `root` is working space.
    pub(crate) fn not_immune(&self, state: &SequenceState, root: &mut Vec<f64>) -> f64 {
        let (Some(of), Some(beside)) = (&self.omitted, &state.beside) else { return 0.0 };
        if of.immune.iter().all(Option::is_none) {
            return 0.0;
        }
        self.root(state, root);
        let (n, first) = (self.n, if self.carry() == Carry::Reset { 3 } else { 0 });
        let mut y = vec![0.0; n];
        let unit = self.dwells.iter().flat_map(|d| (0..LOCAL).map(|i| d.full[i][i])).fold(0.0, f64::max);
        let of_one = |j: usize| -> f64 {
            let kind = of.kind(j);
            let Some(size) = of.immune[kind] else { return 0.0 };
            let samples = beside.squares[j];
            if samples <= NO_EFFECT * unit * of.largest[kind].powi(2) {
                return 0.0;
            }
            self.forward(&beside.cross[j * n..][..n], root, first, &mut y);
            let information = samples - y[first..].iter().map(|x| x * x).sum::<f64>();
            if information <= SILENT * samples {
                return 1.0;
            }
            let from = SEEN / information.sqrt();
            if from <= size { 0.0 } else { 1.0 - size / from }
        };
        (0..beside.squares.len()).map(of_one).sum()
    }
}

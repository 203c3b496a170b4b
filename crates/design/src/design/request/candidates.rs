//! Candidate attitudes of a design.

use obsdeg_core::model::{
    Angle, Euler, Gimbals, Scheme, angles_text, cardinal, cardinal_name, cardinal_names,
};

use crate::design::request::error::DesignError;
use crate::design::request::limits::MAX_CANDIDATES;

/// Candidate attitudes with their names.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Candidates {
    /// Names of the attitudes.
    pub names: Vec<String>,
    /// Euler angles of the attitudes.
    pub attitudes: Vec<Euler>,
}

impl Candidates {
    /// The 24 attitudes with the platform axes along North, Up, East, South, Down, West.
    pub fn cardinals() -> Self {
        let named = cardinal_names().into_iter().filter_map(|name| Some((cardinal(&name)?, name)));
        let (attitudes, names) = named.unzip();
        Self { names, attitudes }
    }

    /// All attitudes whose Euler angles are multiples of `step` 1e-9 degrees, each once: beta from -90
    /// to 90 degrees, gamma = 0 where beta = +-90 degrees.
    ///
    /// # Errors
    /// [`DesignError::Grid`] when `step` does not divide 90 degrees.
    pub fn grid(step: i64) -> Result<Self, DesignError> {
        const QUARTER: i64 = 90_000_000_000;
        let wrong = || DesignError::Grid { found: obsdeg_core::model::format_decimal(step) };
        if step <= 0 || QUARTER % step != 0 {
            return Err(wrong());
        }
        let n = QUARTER / step;
        let found = (16 * n * n * (2 * n - 1) + 8 * n) as usize;
        if found > MAX_CANDIDATES {
            return Err(DesignError::Candidates { found });
        }
        let mut out = Self::default();
        for beta in (0..=n).chain(1 - n..0).chain([-n]) {
            for alpha in (0..=2 * n).chain(1 - 2 * n..0) {
                for gamma in (0..=2 * n).chain(1 - 2 * n..0) {
                    if beta.abs() < n || gamma == 0 {
                        let attitude = [alpha, beta, gamma].map(|k| Angle::from_nanodeg(k * step));
                        out.add(attitude);
                    }
                }
            }
        }
        Ok(out)
    }

    /// Positions of a scheme as candidates.
    ///
    /// # Errors
    /// [`DesignError::Rotation`] for a rotating segment.
    pub fn of_scheme(scheme: &Scheme) -> Result<Self, DesignError> {
        if let Some(p) = scheme.positions.iter().find(|p| p.rotation.is_some()) {
            return Err(DesignError::Rotation { name: p.name.clone() });
        }
        Ok(Self {
            names: scheme.positions.iter().map(|p| p.name.clone()).collect(),
            attitudes: scheme.positions.iter().map(|p| p.angles.clone()).collect(),
        })
    }

    /// Adds an attitude under the name of its directions, or of its angles.
    pub fn add(&mut self, attitude: Euler) {
        self.names.push(cardinal_name(&attitude).unwrap_or_else(|| angles_text(&attitude)));
        self.attitudes.push(attitude);
    }

    /// Candidates that the gimbals reach, with angles within the limits, and the names of the others.
    /// Angles beyond the limits are replaced by those with the shortest gimbal path from (0, 0, 0); a
    /// name made of the old angles is replaced too.
    pub fn within(self, gimbals: &Gimbals) -> (Self, Vec<String>) {
        let (mut reached, mut beyond) = (Self::default(), Vec::new());
        let zero: Euler = std::array::from_fn(|_| Angle::from_degrees(0));
        for (name, attitude) in self.names.into_iter().zip(self.attitudes) {
            if gimbals.hold(&attitude) {
                reached.names.push(name);
                reached.attitudes.push(attitude);
            } else if let Some(within) = gimbals.nearest(&attitude, &zero) {
                reached.names.push(if name == angles_text(&attitude) { angles_text(&within) } else { name });
                reached.attitudes.push(within);
            } else {
                beyond.push(name);
            }
        }
        (reached, beyond)
    }

    /// Candidates in another order.
    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        Self {
            names: order.iter().map(|&i| self.names[i].clone()).collect(),
            attitudes: order.iter().map(|&i| self.attitudes[i].clone()).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use obsdeg_core::model::c_n_f64;

    #[test]
    fn grids_hold_every_attitude_once() {
        for (deg, expected) in [(90, 24), (45, 208), (30, 744)] {
            let grid = Candidates::grid(deg * 1_000_000_000).expect("a grid");
            assert_eq!(grid.attitudes.len(), expected);
            let mut matrices: Vec<[i64; 9]> = grid
                .attitudes
                .iter()
                .map(|e| {
                    let c = c_n_f64(e);
                    std::array::from_fn(|k| (c[k / 3][k % 3] * 1e9).round() as i64)
                })
                .collect();
            matrices.sort_unstable();
            matrices.dedup();
            assert_eq!(matrices.len(), expected, "{deg}");
        }
        let mut names = Candidates::grid(90_000_000_000).expect("a grid").names;
        let mut cardinals = Candidates::cardinals().names;
        names.sort();
        cardinals.sort();
        assert_eq!(names, cardinals);
        for step in [0, -1, 40_000_000_000, 10_000_000_000] {
            assert!(Candidates::grid(step).is_err(), "{step}");
        }
    }
}

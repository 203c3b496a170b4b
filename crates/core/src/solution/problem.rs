//! Small linear systems of known support, solved in a prime field, in floats, or as text.

use nalgebra::{DMatrix, DVector};
use obsdeg_exact::{Field, echelon::express};
use obsdeg_symbolic::System;

use crate::model::ring::{Float, ManyDigits, Real, Ring, Text};

/// Linear system `M x = b` with entries from the table of observable rows, and the outputs `P x`.
///
/// Every entry is a place `(row, column)` of that table, so a system is stated once and solved in any
/// ring.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LinearSystem {
    /// Number of unknowns.
    pub unknowns: usize,
    /// Equations, one per row of M: the unknowns that occur with the places of their coefficients, and the
    /// right side.
    pub equations: Vec<(Vec<(usize, TableEntry)>, RightSide)>,
    /// Outputs: the unknowns themselves, or sums of places times unknowns.
    pub outputs: SystemOutputs,
}

/// Right side of an equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RightSide {
    /// Zero.
    Zero,
    /// One.
    One,
    /// Minus the entry at a place.
    Minus(TableEntry),
    /// Entry of the target at a column.
    Target(usize),
}

impl RightSide {
    fn value<R: Ring>(self, ring: &R, table: &[Vec<R::Element>], target: &[R::Element]) -> R::Element {
        match self {
            Self::Zero => ring.zero(),
            Self::One => ring.one(),
            Self::Minus((r, c)) => ring.neg(&table[r][c]),
            Self::Target(i) => target[i].clone(),
        }
    }
}

/// Place `(row, column)` in the table of observable rows.
pub(crate) type TableEntry = (usize, usize);

/// Outputs of a system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum SystemOutputs {
    /// Outputs are the unknowns.
    Unknowns,
    /// Outputs are sums `sum_i place_i x_i`, one per row.
    Sums(Vec<Vec<TableEntry>>),
}

/// Correction of a solution for the turning of the platform: amounts `z` of the rows `rows` with
/// `sum_i z_i rows[i] = sum_j y_j motion_j`. The `y_j` are unknowns of the solution, listed with the rows of
/// minus their motion.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TurningCorrection {
    /// Independent rows that span the motion.
    pub rows: Vec<usize>,
    /// Unknowns of the solution with their motions: `(j, row of minus motion_j)`.
    pub of: Vec<(usize, usize)>,
}

/// Unknowns in order, each with the place of its coefficient.
fn numbered(places: impl Iterator<Item = TableEntry>) -> Vec<(usize, TableEntry)> {
    places.enumerate().collect()
}

/// Largest effect of rounding on a value, relative to the largest value; six digits are printed.
const CERTAIN: f64 = 1e-9;

impl LinearSystem {
    /// System of the solution `y` with `sum_j y_j rows[j] = target`. The given rows are independent, so `y`
    /// is unique. The right sides are the target's entries, column by column. The unknowns of every motion
    /// follow after `y`.
    pub(crate) fn solution(rows: &[usize], columns: usize, motions: &[TurningCorrection]) -> Self {
        let equation = |c: usize| (numbered(rows.iter().map(|&j| (j, c))), RightSide::Target(c));
        let mut equations: Vec<_> = (0..columns).map(equation).collect();
        let mut unknowns = rows.len();
        for motion in motions {
            for c in 0..columns {
                let own = motion.rows.iter().enumerate().map(|(i, &row)| (unknowns + i, (row, c)));
                let others = motion.of.iter().map(|&(j, row)| (j, (row, c)));
                equations.push((own.chain(others).collect(), RightSide::Zero));
            }
            unknowns += motion.rows.len();
        }
        Self { unknowns, equations, outputs: SystemOutputs::Unknowns }
    }

    /// System of the combination of the given rows that vanishes outside `support` and is one at `lead`.
    /// Outputs: its entries on `support`.
    pub(crate) fn combination(rows: &[usize], columns: usize, support: &[usize], lead: usize) -> Self {
        let places = |c: usize| -> Vec<TableEntry> { rows.iter().map(|&j| (j, c)).collect() };
        let equations = (0..columns)
            .filter(|c| *c == lead || !support.contains(c))
            .map(|c| {
                (numbered(places(c).into_iter()), if c == lead { RightSide::One } else { RightSide::Zero })
            })
            .collect();
        let sums = support.iter().map(|&c| places(c)).collect();
        Self { unknowns: rows.len(), equations, outputs: SystemOutputs::Sums(sums) }
    }

    /// System of the vector on `support` that all the given rows annihilate, without its lead entry, which
    /// is one: `sum_c row[c] v_c = -row[lead]`.
    pub(crate) fn null_vector(rows: &[usize], support: &[usize], lead: usize) -> Self {
        let others: Vec<usize> = support.iter().copied().filter(|&c| c != lead).collect();
        let equation = |&j: &usize| (numbered(others.iter().map(|&c| (j, c))), RightSide::Minus((j, lead)));
        Self {
            unknowns: others.len(),
            equations: rows.iter().map(equation).collect(),
            outputs: SystemOutputs::Unknowns,
        }
    }

    fn outputs_of<R: Ring>(
        &self,
        ring: &R,
        table: &[Vec<R::Element>],
        x: Vec<R::Element>,
    ) -> Vec<R::Element> {
        match &self.outputs {
            SystemOutputs::Unknowns => x,
            SystemOutputs::Sums(sums) => sums
                .iter()
                .map(|places| ring.dot(places.iter().zip(&x).map(|(&(r, c), x)| (&table[r][c], x))))
                .collect(),
        }
    }

    /// Outputs in a prime field; `None` if there is no solution.
    pub(crate) fn solve_in_field(&self, f: &Field, table: &[Vec<u64>], targets: &[u64]) -> Option<Vec<u64>> {
        let mut columns = vec![vec![0; self.equations.len()]; self.unknowns];
        for (e, (places, _)) in self.equations.iter().enumerate() {
            for &(i, (r, c)) in places {
                columns[i][e] = table[r][c];
            }
        }
        let refs: Vec<&[u64]> = columns.iter().map(Vec::as_slice).collect();
        let right: Vec<u64> = self.equations.iter().map(|(_, t)| t.value(f, table, targets)).collect();
        let x = express(*f, &refs, &right)?;
        Some(self.outputs_of(f, table, x))
    }

    /// Outputs in many digits, by elimination with the largest pivot. `None` if a pivot is not distinguished
    /// from zero, or an output is not known to all digits of a double. The prime fields have shown that
    /// there is a solution.
    pub(crate) fn solve_in_many_digits(&self, table: &[Vec<Real>]) -> Option<Vec<f64>> {
        let ring = ManyDigits;
        let equation = |(places, right): &(Vec<(usize, TableEntry)>, RightSide)| {
            let mut row = vec![ring.zero(); self.unknowns + 1];
            for &(i, (r, c)) in places {
                row[i] = table[r][c];
            }
            row[self.unknowns] = right.value(&ring, table, &[]);
            row
        };
        let mut rows: Vec<Vec<Real>> = self.equations.iter().map(equation).collect();
        for k in 0..self.unknowns {
            let certain = (k..rows.len()).filter(|&i| !rows[i][k].is_zero());
            let best = certain.max_by(|&a, &b| rows[a][k].size_log2().total_cmp(&rows[b][k].size_log2()))?;
            rows.swap(k, best);
            let inverse = rows[k][k].inverse()?;
            rows[k].iter_mut().for_each(|x| *x = x.mul(&inverse));
            let pivot = rows[k].clone();
            let others = rows.iter_mut().enumerate().filter(|(i, row)| *i != k && !row[k].is_exactly_zero());
            for (_, row) in others {
                let factor = row[k];
                for (x, y) in row.iter_mut().zip(&pivot).skip(k) {
                    *x = x.sub(&factor.mul(y));
                }
            }
        }
        let x = rows.iter().take(self.unknowns).map(|row| row[self.unknowns]).collect();
        self.outputs_of(&ring, table, x).iter().map(ManyDigits::to_f64).collect()
    }

    /// Outputs in floats, by least squares (QR). `None` if the residual exceeds 1e-9 of the right side, if
    /// the rounding of the table alone may change a value by more than [`CERTAIN`] of the largest, or if a
    /// number is not finite.
    pub(crate) fn solve_in_floats(&self, table: &[Vec<f64>], targets: &[f64]) -> Option<Vec<f64>> {
        let m = self.equations.len();
        let mut a = DMatrix::zeros(m, self.unknowns);
        for (e, (places, _)) in self.equations.iter().enumerate() {
            for &(i, (r, c)) in places {
                a[(e, i)] = table[r][c];
            }
        }
        let b =
            DVector::from_iterator(m, self.equations.iter().map(|(_, t)| t.value(&Float, table, targets)));
        let qr = a.clone().qr();
        let (q, r) = (qr.q(), qr.r());
        let x = r.solve_upper_triangular(&(q.transpose() * &b))?;
        let residual = (&a * &x - &b).norm();
        // |A^+| (|A| |x| + |b|): errors of x by relative errors of the entries
        let inverse = r.solve_upper_triangular(&q.transpose())?;
        let moved = inverse.abs() * (a.abs() * x.abs() + b.abs()) * f64::EPSILON;
        let certain = moved.amax() <= CERTAIN * x.amax();
        let fine = certain && x.iter().all(|v| v.is_finite()) && residual <= 1e-9 * (1.0 + b.norm());
        fine.then(|| self.outputs_of(&Float, table, x.iter().copied().collect()))
    }

    /// The system as text for the symbolic worker: matrix, right side, output matrix.
    pub(crate) fn to_text(&self, table: &[Vec<String>], targets: &[String]) -> System {
        let cell = |&(r, c): &TableEntry| table[r][c].clone();
        let row = |places: &[(usize, TableEntry)]| {
            let mut row = vec![Text.zero(); self.unknowns];
            for (i, place) in places {
                row[*i] = cell(place);
            }
            row
        };
        let matrix = self.equations.iter().map(|(places, _)| row(places)).collect();
        let right = self.equations.iter().map(|(_, t)| t.value(&Text, table, targets)).collect();
        let outputs = match &self.outputs {
            SystemOutputs::Unknowns => Vec::new(),
            SystemOutputs::Sums(sums) => {
                sums.iter().map(|places| places.iter().map(cell).collect()).collect()
            }
        };
        System { matrix, right, outputs }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_problem_in_two_rings() {
        let f = Field::new((1 << 60) + 33);
        let table = [vec![1i64, 2, 0], vec![0, 1, 1], vec![1, 0, 1]];
        let floats: Vec<Vec<f64>> = table.iter().map(|r| r.iter().map(|&a| a as f64).collect()).collect();
        let images: Vec<Vec<u64>> =
            table.iter().map(|r| r.iter().map(|&a| f.from_i64(a)).collect()).collect();
        // e_0 = (row0 - 2 row1 + 2 row2) / 3
        let p = LinearSystem::solution(&[0, 1, 2], 3, &[]);
        let x = p.solve_in_floats(&floats, &[1.0, 0.0, 0.0]).expect("solvable");
        for (a, b) in x.iter().zip([1.0 / 3.0, -2.0 / 3.0, 2.0 / 3.0]) {
            assert!((a - b).abs() < 1e-12);
        }
        let digits: Vec<Vec<Real>> =
            table.iter().map(|r| r.iter().map(|&a| Real::from_i64(a)).collect()).collect();
        let y = p.solve_in_field(&f, &images, &[f.one(), 0, 0]).expect("solvable");
        assert_eq!(y, [f.from_ratio(1, 3), f.from_ratio(-2, 3), f.from_ratio(2, 3)]);
        // rows 0 and 1 vanish outside {0, 2} as (1, 0, -2)
        let p = LinearSystem::combination(&[0, 1], 3, &[0, 2], 0);
        assert_eq!(p.solve_in_field(&f, &images, &[]), Some(vec![f.one(), f.from_i64(-2)]));
        assert_eq!(p.solve_in_many_digits(&digits), Some(vec![1.0, -2.0]));
        // (2, -1, 1) is annihilated by rows 0 and 1: lead 0 = 1 gives (-1/2, 1/2)
        let p = LinearSystem::null_vector(&[0, 1], &[0, 1, 2], 0);
        assert_eq!(p.solve_in_field(&f, &images, &[]), Some(vec![f.from_ratio(-1, 2), f.from_ratio(1, 2)]));
        assert_eq!(p.solve_in_many_digits(&digits), Some(vec![-0.5, 0.5]));
        // no solution
        let p = LinearSystem::solution(&[0], 3, &[]);
        assert_eq!(p.solve_in_field(&f, &images, &[f.one(), 0, 0]), None);
        assert_eq!(p.solve_in_floats(&floats, &[1.0, 0.0, 0.0]), None);
    }
}

//! Small linear systems whose support is known, solved in a prime field, in floats, or as text.

use nalgebra::{DMatrix, DVector};
use obsdeg_exact::{Field, echelon::express};

use crate::model::ring::{Ring, Text};

/// `M x = b` with entries out of the table of observable rows, and the outputs `P x`.
///
/// Every entry is a place `(row, column)` of that table, so one problem is posed once and solved in
/// any ring.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Number of unknowns.
    pub unknowns: usize,
    /// One equation per row: places of its coefficients, and whether the right side is
    /// `targets[index]` or zero.
    pub equations: Vec<(Vec<Place>, Option<usize>)>,
    /// The outputs: the unknowns themselves, or sums of places times unknowns.
    pub outputs: Outputs,
}

/// A place `(row, column)` in the table of observable rows.
pub type Place = (usize, usize);

/// What is asked of the solution.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outputs {
    /// The unknowns.
    Unknowns,
    /// `sum_i place_i x_i`, one per row.
    Sums(Vec<Vec<Place>>),
}

impl Problem {
    /// `y` with `sum_j y_j rows[j] = target`, for the given rows (independent, so `y` is unique).
    /// The right sides are the target's entries, column by column.
    pub fn solution(rows: &[usize], columns: usize) -> Self {
        let equation = |c: usize| (rows.iter().map(|&j| (j, c)).collect(), Some(c));
        Self { unknowns: rows.len(), equations: (0..columns).map(equation).collect(), outputs: Outputs::Unknowns }
    }

    /// The combination of the given rows that vanishes outside `support` and is one at `lead`
    /// (right side 0: the number one). Outputs: its entries on `support`.
    pub fn combination(rows: &[usize], columns: usize, support: &[usize], lead: usize) -> Self {
        let places = |c: usize| -> Vec<Place> { rows.iter().map(|&j| (j, c)).collect() };
        let equations = (0..columns)
            .filter(|c| *c == lead || !support.contains(c))
            .map(|c| (places(c), (c == lead).then_some(0)))
            .collect();
        let sums = support.iter().map(|&c| places(c)).collect();
        Self { unknowns: rows.len(), equations, outputs: Outputs::Sums(sums) }
    }

    /// The vector on `support` that all the given rows annihilate, minus its lead entry, which is one:
    /// `sum_c row[c] v_c = -row[lead]` (the right side of equation i is `targets[i]`).
    pub fn null_vector(rows: &[usize], support: &[usize], lead: usize) -> Self {
        let others: Vec<usize> = support.iter().copied().filter(|&c| c != lead).collect();
        let equation = |(i, &j): (usize, &usize)| (others.iter().map(|&c| (j, c)).collect(), Some(i));
        Self { unknowns: others.len(), equations: rows.iter().enumerate().map(equation).collect(), outputs: Outputs::Unknowns }
    }

    fn outputs_of<R: Ring>(&self, ring: &R, table: &[Vec<R::Element>], x: Vec<R::Element>) -> Vec<R::Element> {
        match &self.outputs {
            Outputs::Unknowns => x,
            Outputs::Sums(sums) => sums
                .iter()
                .map(|places| ring.dot(places.iter().zip(&x).map(|(&(r, c), x)| (&table[r][c], x))))
                .collect(),
        }
    }

    /// The outputs in a prime field; `None` when there is no solution.
    pub fn solve_in_field(&self, f: &Field, table: &[Vec<u64>], targets: &[u64]) -> Option<Vec<u64>> {
        let columns: Vec<Vec<u64>> = (0..self.unknowns)
            .map(|i| self.equations.iter().map(|(places, _)| table[places[i].0][places[i].1]).collect())
            .collect();
        let refs: Vec<&[u64]> = columns.iter().map(Vec::as_slice).collect();
        let right: Vec<u64> = self.equations.iter().map(|(_, t)| t.map_or(0, |t| targets[t])).collect();
        let x = express(*f, &refs, &right)?;
        Some(self.outputs_of(f, table, x))
    }

    /// The outputs in floats, by least squares (QR); `None` when the residual exceeds 1e-9 of the
    /// right side or anything is not finite.
    pub fn solve_in_floats(&self, table: &[Vec<f64>], targets: &[f64]) -> Option<Vec<f64>> {
        let m = self.equations.len();
        let a = DMatrix::from_fn(m, self.unknowns, |e, i| {
            let (r, c) = self.equations[e].0[i];
            table[r][c]
        });
        let b = DVector::from_iterator(m, self.equations.iter().map(|(_, t)| t.map_or(0.0, |t| targets[t])));
        let qr = a.clone().qr();
        let (q, r) = (qr.q(), qr.r());
        let x = r.solve_upper_triangular(&(q.transpose() * &b))?;
        let residual = (&a * &x - &b).norm();
        let fine = x.iter().all(|v| v.is_finite()) && residual <= 1e-9 * (1.0 + b.norm());
        fine.then(|| self.outputs_of(&crate::model::ring::Float, table, x.iter().copied().collect()))
    }

    /// The system as text for the symbolic worker: matrix, right side, output matrix.
    pub fn to_text(&self, table: &[Vec<String>], targets: &[String]) -> TextSystem {
        let cell = |&(r, c): &Place| table[r][c].clone();
        let matrix = self.equations.iter().map(|(places, _)| places.iter().map(cell).collect()).collect();
        let right =
            self.equations.iter().map(|(_, t)| t.map_or_else(|| Text.zero(), |t| targets[t].clone())).collect();
        let outputs = match &self.outputs {
            Outputs::Unknowns => Vec::new(),
            Outputs::Sums(sums) => sums.iter().map(|places| places.iter().map(cell).collect()).collect(),
        };
        TextSystem { matrix, right, outputs }
    }
}

/// A [`Problem`] written out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextSystem {
    /// `M`.
    pub matrix: Vec<Vec<String>>,
    /// `b`.
    pub right: Vec<String>,
    /// `P`; empty for the identity.
    pub outputs: Vec<Vec<String>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_problem_in_two_rings() {
        let f = Field::new((1 << 60) + 33);
        let table = vec![vec![1i64, 2, 0], vec![0, 1, 1], vec![1, 0, 1]];
        let floats: Vec<Vec<f64>> = table.iter().map(|r| r.iter().map(|&a| a as f64).collect()).collect();
        let images: Vec<Vec<u64>> = table.iter().map(|r| r.iter().map(|&a| f.from_i64(a)).collect()).collect();
        // e_0 = (row0 - 2 row1 + 2 row2) / 3
        let p = Problem::solution(&[0, 1, 2], 3);
        let x = p.solve_in_floats(&floats, &[1.0, 0.0, 0.0]).expect("solvable");
        for (a, b) in x.iter().zip([1.0 / 3.0, -2.0 / 3.0, 2.0 / 3.0]) {
            assert!((a - b).abs() < 1e-12);
        }
        let y = p.solve_in_field(&f, &images, &[f.one(), 0, 0]).expect("solvable");
        assert_eq!(y, [f.from_ratio(1, 3), f.from_ratio(-2, 3), f.from_ratio(2, 3)]);
        // rows 0 and 1 vanish outside {0, 2} as (1, 0, -2)
        let p = Problem::combination(&[0, 1], 3, &[0, 2], 0);
        assert_eq!(p.solve_in_field(&f, &images, &[f.one()]), Some(vec![f.one(), f.from_i64(-2)]));
        // (2, -1, 1) is annihilated by rows 0 and 1: lead 0 = 1 gives (-1/2, 1/2)
        let p = Problem::null_vector(&[0, 1], &[0, 1, 2], 0);
        let right = [f.from_i64(-1), 0];
        assert_eq!(p.solve_in_field(&f, &images, &right), Some(vec![f.from_ratio(-1, 2), f.from_ratio(1, 2)]));
        // no solution
        let p = Problem::solution(&[0], 3);
        assert_eq!(p.solve_in_field(&f, &images, &[f.one(), 0, 0]), None);
        assert_eq!(p.solve_in_floats(&floats, &[1.0, 0.0, 0.0]), None);
    }
}

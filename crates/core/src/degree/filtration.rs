//! The filtration `V_0 < V_1 < ...` of spans of derivative rows.

use obsdeg_exact::{Echelon, RowSpace, Scalars};

use super::rows::DerivativeRows;

/// Ranks, degrees and excitation of all unknowns, from the filtration.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Degrees {
    /// `dim V_0, dim V_1, ...` up to the last order at which some segment still had rows.
    pub rank_profile: Vec<usize>,
    /// Degree per unknown: the smallest k with `e_c` in `V_k`; `None` if it is not observable.
    pub degree: Vec<Option<usize>>,
    /// Excitation per unknown: true if it affects Z, that is, its column is not zero in every row.
    pub excited: Vec<bool>,
}

impl Degrees {
    /// Final rank.
    pub fn rank(&self) -> usize {
        self.rank_profile.last().copied().unwrap_or(0)
    }
}

/// Climbs the filtration: rows of order 0, 1, 2, ... enter `basis` (cleared first) until the chain of every
/// segment has stalled or the rank is full. `on_order` receives the basis of `V_k` after each order.
pub fn climb<R: DerivativeRows>(
    rows: &mut R,
    basis: &mut <R::Field as Scalars>::Space,
    mut on_order: impl FnMut(usize, &<R::Field as Scalars>::Space),
) -> Degrees {
    basis.clear();
    let mut degrees = Degrees { degree: vec![None; rows.columns()], ..Degrees::default() };
    for order in 0.. {
        let full = basis.rank() == basis.columns();
        let more = !full && rows.emit(order, &mut |row| basis.rank() < basis.columns() && basis.insert(row));
        if !more {
            break;
        }
        for (c, degree) in degrees.degree.iter_mut().enumerate() {
            if degree.is_none() && basis.has_unit(c) {
                *degree = Some(order);
            }
        }
        degrees.rank_profile.push(basis.rank());
        on_order(order, basis);
    }
    degrees.excited = (0..basis.columns()).map(|c| !basis.is_zero_column(c)).collect();
    degrees
}

/// Indistinguishable unknowns of every unknown: the other members of the null vectors of minimal support
/// that contain it. They depend on the null space alone, not on a basis of it, and the relation is mutual.
/// An observable unknown and an unknown that is not excited have none.
pub fn partners(unknowns: usize, spans: &[Echelon]) -> Vec<Vec<usize>> {
    spans.last().map_or_else(|| vec![Vec::new(); unknowns], Echelon::companions)
}

#[cfg(test)]
mod tests {
    use obsdeg_exact::Field;

    use super::*;

    #[test]
    fn who_goes_with_whom() {
        let f = Field::new((1 << 60) + 33);
        let mut basis = Echelon::new(f, 4);
        // x0 + x1 and x2 are observable; x3 is not excited
        basis.insert(&[1, 1, 0, 0]);
        basis.insert(&[0, 0, 1, 0]);
        assert_eq!(partners(4, &[basis]), [vec![1], vec![0], vec![], vec![]]);
        assert_eq!(partners(2, &[]), [vec![], vec![]] as [Vec<usize>; 2]);
        let degrees = Degrees { rank_profile: vec![2, 5, 7], ..Degrees::default() };
        assert_eq!((degrees.rank(), Degrees::default().rank()), (7, 0));
    }
}

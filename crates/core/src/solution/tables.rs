//! Rows from which solutions are made: the local observables of every position, in two fields, four
//! embeddings each.

use obsdeg_exact::RootField;
use obsdeg_exact::radical::embeddings;

use super::local::{LocalObservable, RateZeros, local_observables, rows_at};
use super::turning::motion_rows;
use crate::degree::ensemble::{Verdicts, filtration};
use crate::model::Platform;
use crate::model::platform::{FieldSample, RandomValues};

/// Rows of the local observables of every position, in one field and embedding.
#[derive(Debug, Clone)]
pub(crate) struct RowTable {
    /// Field and embedding.
    pub sample: FieldSample,
    /// Rows, one per station and local observable, station by station; then, if the scheme rotates, one per
    /// station of [`motion_rows`]. If rotations are judged by their output history, the bases of
    /// `V_0, V_1, ...` instead.
    pub rows: Vec<Vec<u64>>,
}

impl RowTable {
    /// Rates `(wN, wU)` of the table.
    pub(crate) fn rates(&self) -> [u64; 2] {
        [self.sample.point.w_n, self.sample.point.w_u]
    }
}

/// Observable rows of a scheme in two fields, four embeddings each, with random rates. A formula in `wN` and
/// `wU` that holds there holds at every latitude with the same zeros.
#[derive(Debug, Clone)]
pub(crate) struct Tables {
    /// Observables of one position.
    pub observables: Vec<LocalObservable>,
    /// Number of rows without those of [`motion_rows`].
    pub observable_rows: usize,
    /// Orders of the rows, if these are bases of `V_0, V_1, ...`; empty otherwise.
    orders: Vec<usize>,
    /// Components of the earth rate that are zero.
    pub zeros: RateZeros,
    /// Tables `[field][embedding]`.
    pub tables: [[RowTable; 4]; 2],
    /// Table of the first field and embedding at other rates.
    pub other_rates: RowTable,
}

impl Tables {
    /// The tables of `platform` in the fields of `verdicts`.
    pub(crate) fn new(platform: &Platform, verdicts: &Verdicts, seed: u64) -> Self {
        let scheme = platform.scheme();
        let zeros = RateZeros::of(platform);
        let observables = local_observables(zeros, platform.observed());
        let mut rng = scheme.random(seed, "other rates");
        let mut rates = |roots: &RootField| {
            let p = roots.field.modulus();
            let mut draw = |zero: bool| if zero { 0 } else { 1 + rng.below(p - 1) };
            [draw(zeros.w_n), draw(zeros.w_u)]
        };
        let table = |values: &RandomValues, a: u64, [w_n, w_u]: [u64; 2]| {
            let sample = values.sample_at(scheme, a, [w_n, w_u]);
            if scheme.by_history() {
                let spans = filtration(platform, &sample).1;
                let rows = spans.iter().flat_map(|basis| (0..basis.rank()).map(|i| basis.row(i).to_vec()));
                return RowTable { rows: rows.collect(), sample };
            }
            let mut rows = rows_at(platform, &sample.point, &observables);
            rows.extend(motion_rows(platform, &sample.point));
            RowTable { sample, rows }
        };
        // the rates of the verdicts, so that vectors of the spans are vectors of the first table
        let tables = [0, 1].map(|i| {
            let values = &verdicts.values[i];
            let point = values.sample(scheme, 1).point;
            embeddings(values.roots().order).map(|a| table(values, a, [point.w_n, point.w_u]))
        });
        let first = &verdicts.values[0];
        let other_rates = table(first, 1, rates(first.roots()));
        let mut orders = Vec::new();
        let mut observable_rows = scheme.stations().len() * observables.len();
        if scheme.by_history() {
            let ranks = verdicts.spans.iter().map(|basis| basis.rank()).enumerate();
            orders = ranks.flat_map(|(order, rank)| std::iter::repeat_n(order, rank)).collect();
            observable_rows = orders.len();
        }
        Self { observables, observable_rows, orders, zeros, tables, other_rates }
    }

    /// The two fields.
    pub(crate) fn fields(&self) -> [RootField; 2] {
        [self.tables[0][0].sample.roots, self.tables[1][0].sample.roots]
    }

    /// The derivative order of a row.
    pub(crate) fn order(&self, row: usize) -> usize {
        let of_span = self.orders.get(row).copied();
        of_span.unwrap_or_else(|| self.observables[row % self.observables.len()].order)
    }

    /// The station of a row.
    pub(crate) fn station(&self, row: usize) -> usize {
        row / self.observables.len()
    }

    /// Row of [`motion_rows`] of a station.
    pub(crate) fn motion_row(&self, station: usize) -> usize {
        self.observable_rows + station
    }

    /// The rows of order up to `degree`.
    pub(crate) fn rows_up_to(&self, degree: usize) -> Vec<usize> {
        (0..self.observable_rows).filter(|&j| self.order(j) <= degree).collect()
    }

    /// Table of the first field and embedding.
    pub(crate) fn first(&self) -> &RowTable {
        &self.tables[0][0]
    }
}

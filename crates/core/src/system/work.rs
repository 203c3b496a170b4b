//! Work of a verdict on a model: it is counted before it is done, and refused beyond a limit.

use std::cell::Cell;

use super::error::ModelError;

/// Operations in a unit of the limit.
const UNIT: u64 = 1_000_000;
/// Operations that cost as much as a byte of memory.
const PER_BYTE: u64 = 2;
/// Series that are held for every operation of a model, backwards.
const HELD: u64 = 4;
/// Operations of the three transforms of a product with two factors, for each point and each halving.
const TRANSFORM: (u64, u64) = (9, 2);
/// Orders that the first derivatives cost whatever their order is.
const FIRST: u64 = 8;

/// Limit of the work of one verdict on a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkLimit(
    /// Operations, in millions: products of coefficients, with their sums. Half as many bytes are allowed.
    pub u64,
);

impl WorkLimit {
    /// The limit without an option.
    pub const DEFAULT: Self = Self(600);

    /// The limit in operations.
    pub fn operations(self) -> u64 {
        self.0.saturating_mul(UNIT)
    }
}

impl Default for WorkLimit {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Work of one verdict at one random point.
#[derive(Debug, Clone)]
pub(crate) struct Work {
    limit: WorkLimit,
    spent: Cell<u64>,
    refused: Cell<Option<(usize, u64, u64)>>,
}

/// What the derivatives of a run cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cost {
    /// Products and sums of an order that do not grow with it, by unknowns.
    pub(super) fixed: u64,
    /// Products and sums of an order for each order before it, by unknowns.
    pub(super) growing: u64,
    /// Number of operations of the model that take part.
    pub(super) nodes: u64,
    /// Number of those that multiply or divide two series.
    pub(super) products: u64,
    /// True if rows are computed backwards, output by output.
    pub(super) backwards: bool,
    /// Number of outputs.
    pub(super) outputs: u64,
    /// Number of unknowns.
    pub(super) lanes: u64,
    /// Words of 64 bits of a number.
    pub(super) words: u64,
}

impl Cost {
    /// Operations of the rows of an order, with their elimination.
    fn operations(&self, order: u64) -> u64 {
        let next = order.saturating_add(1);
        let rows = match self.backwards {
            false => self.fixed.saturating_add(self.growing.saturating_mul(next)),
            true => {
                // the series that are left are about half as long as those before
                let length = order / 2 + FIRST;
                let short = length.saturating_mul(2 * length);
                let points = (2 * length).next_power_of_two();
                let transforms = points * u64::from(points.ilog2()) * TRANSFORM.0 / TRANSFORM.1;
                // many digits are multiplied coefficient by coefficient
                let product = if self.words > 1 { short } else { short.min(transforms) };
                let sums = self.nodes.saturating_mul(2 * length);
                let products = self.products.saturating_mul(product.saturating_add(next));
                self.outputs.saturating_mul(sums.saturating_add(products))
            }
        };
        let rank = self.outputs.saturating_mul(next).min(self.lanes);
        let elimination = self.outputs.saturating_mul(self.lanes).saturating_mul(rank);
        rows.saturating_add(elimination).saturating_mul(self.words.saturating_mul(self.words))
    }

    /// Bytes of the series up to an order, and of the rows.
    fn bytes(&self, order: u64) -> u64 {
        let series = match self.backwards {
            false => self.fixed.saturating_add(self.nodes),
            true => self.nodes.saturating_mul(HELD),
        };
        let rows = self.lanes.saturating_mul(self.lanes).saturating_mul(2);
        series.saturating_mul(order + 1).saturating_add(rows).saturating_mul(8 * self.words)
    }
}

impl Work {
    pub(crate) fn new(limit: WorkLimit) -> Self {
        Self { limit, spent: Cell::new(0), refused: Cell::new(None) }
    }

    /// Counts the rows of an order before they are computed; false if they are beyond the limit.
    pub(super) fn spend(&self, order: usize, cost: &Cost) -> bool {
        let most = self.limit.operations();
        let spent = self.spent.get().saturating_add(cost.operations(order as u64));
        let bytes = cost.bytes(order as u64);
        if spent > most || bytes > most / PER_BYTE {
            self.refused.set(Some((order, spent, bytes)));
            return false;
        }
        self.spent.set(spent);
        true
    }

    /// Operations so far.
    pub(crate) fn spent(&self) -> u64 {
        self.spent.get()
    }

    /// Why the verdict was not computed, if it was not.
    pub(crate) fn refused(&self) -> Option<ModelError> {
        let (order, spent, bytes) = self.refused.get()?;
        let limit = self.limit.0;
        let what = match bytes > self.limit.operations() / PER_BYTE {
            true => format!("{:.1e} bytes", bytes as f64),
            false => format!("{:.1e} operations", spent as f64),
        };
        Some(ModelError {
            what: "the model".into(),
            message: format!(
                "too large to be judged at the limit of work: derivatives of order {order} take {what}, beyond --work-limit {limit} \
                 ({:.1e} operations, {:.1e} bytes); a larger --work-limit allows more, and a lower --order, a smaller model or fewer unknowns \
                 need less",
                self.limit.operations() as f64,
                (self.limit.operations() / PER_BYTE) as f64
            ),
            span: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(backwards: bool) -> Cost {
        Cost { fixed: 10, growing: 6, nodes: 5, products: 3, backwards, outputs: 2, lanes: 7, words: 1 }
    }

    /// By hand: 10 + 6 * 4 of the rows of order 3, and 2 rows of 7 against a rank of at most 7.
    #[test]
    fn operations_by_hand() {
        assert_eq!(cost(false).operations(3), 10 + 6 * 4 + 2 * 7 * 7);
        assert_eq!(cost(false).operations(0), 10 + 6 + 2 * 7 * 2);
        // series of 9: 5 sums of twice that, 3 products of 2 * 81 terms, and 4 of the values
        assert_eq!(cost(true).operations(3), 2 * (5 * 18 + 3 * (2 * 81 + 4)) + 2 * 7 * 7);
        // series of 108: transforms of 256 points
        let transforms = 256 * 8 * 9 / 2;
        assert_eq!(cost(true).operations(200), 2 * (5 * 216 + 3 * (transforms + 201)) + 2 * 7 * 7);
        assert_eq!(Cost { words: 3, ..cost(false) }.operations(0), 9 * (10 + 6 + 2 * 7 * 2));
        assert_eq!(cost(false).bytes(3), 8 * ((10 + 5) * 4 + 2 * 49));
    }

    #[test]
    fn what_is_beyond_is_refused_with_its_option() {
        let work = Work::new(WorkLimit(1000));
        let large = Cost { growing: 400_000_000, ..cost(false) };
        assert!(work.spend(0, &large) && work.refused().is_none());
        assert!(!work.spend(1, &large));
        assert_eq!(work.spent(), 400_000_000 + 10 + 28);
        let message = work.refused().expect("refused").to_string();
        assert!(
            message.contains(
                "order 1 take 1.2e9 operations, beyond --work-limit 1000 (1.0e9 operations, 5.0e8 bytes)"
            ),
            "{message}"
        );
        let work = Work::new(WorkLimit(1000));
        assert!(!work.spend(9, &Cost { fixed: 10_000_000, ..cost(false) }));
        let message = work.refused().expect("refused").to_string();
        assert!(message.contains("order 9 take 8.0e8 bytes"), "{message}");
    }
}

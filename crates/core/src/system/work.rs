//! Work of a verdict on a model: counted before it is done, and refused beyond a limit.

use std::cell::Cell;

use super::dag::Op;
use super::error::ModelError;

/// Operations per unit of the limit.
const UNIT: u64 = 1_000_000;
/// Operations that cost as much as a byte of memory.
const PER_BYTE: u64 = 2;
/// Number of series that the backward computation stores for every operation of a model.
const HELD: u64 = 4;
/// Operations of the three transforms of a product with two factors, for each point and each halving. Half
/// of them multiply and take two sums, which count as one and a half.
const TRANSFORM: (u64, u64) = (9, 4);

/// Operations that cost as much as the stored series of an operation, whether or not it takes part.
pub(super) const PER_NODE: u64 = 32;
/// Number of products that cost as much as an inverse, and as a function.
const PER_INVERSE: u64 = 64;
const PER_FUNCTION: u64 = 256;

/// Operations of a product of two numbers, by their words of 64 bits.
pub(super) fn product<E>() -> u64 {
    let words = size_of::<E>().div_ceil(8) as u64;
    words * words
}

/// Operations of the value of an operation in such numbers.
pub(super) fn operations_of<E>(op: Op) -> u64 {
    let products = match op {
        Op::Number { decimals, .. } => PER_INVERSE + u64::from(decimals.unsigned_abs()),
        Op::Divide(..) => PER_INVERSE,
        Op::Primitive { .. } => PER_FUNCTION,
        _ => 1,
    };
    products * product::<E>()
}

/// Limit of the work of one verdict on a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkLimit(
    /// Operations, in millions: products of coefficients, with their sums. Half as many bytes are allowed.
    pub u64,
);

impl WorkLimit {
    /// Limit without an option.
    pub const DEFAULT: Self = Self(600);

    /// Limit in operations.
    pub fn operations(self) -> u64 {
        self.0.saturating_mul(UNIT)
    }
}

impl WorkLimit {
    /// Smallest limit that allows these operations, at most this one.
    pub(super) fn within(self, operations: u64) -> Self {
        Self(operations.div_ceil(UNIT).min(self.0))
    }

    /// Limit in bytes of memory.
    pub fn bytes(self) -> u64 {
        self.operations() / PER_BYTE
    }

    /// Error for a model that takes more bytes, or more operations, than the limit.
    pub(super) fn refuse(self, step: &str, what: &str) -> ModelError {
        ModelError {
            what: "the model".into(),
            message: format!(
                "too large to be judged at the limit of work: {step} take {what}, beyond --work-limit {} \
                 ({:.1e} operations, {:.1e} bytes); a larger --work-limit allows more, and a lower \
                 --order, a smaller model or fewer unknowns need less",
                self.0,
                self.operations() as f64,
                self.bytes() as f64
            ),
            span: None,
        }
    }
}

impl Default for WorkLimit {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Step of the work that may exceed the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WorkStep {
    /// Values of the model at the random points that are tried.
    Points,
    /// Random points at which constraints hold.
    Constraints,
    /// The proof that functions are independent of each other.
    Independence,
    /// Gradients of all operations at a point.
    Gradients,
    /// Derivatives of an order.
    Derivatives(usize),
}

impl WorkStep {
    /// Description of the step in words.
    fn words(self) -> String {
        match self {
            Self::Points => "values of its operations at random points".into(),
            Self::Constraints => "points at which its constraints hold".into(),
            Self::Independence => "gradients of the arguments of its functions".into(),
            Self::Gradients => "gradients of its operations".into(),
            Self::Derivatives(order) => format!("derivatives of order {order}"),
        }
    }
}

/// Error for work beyond its limit; [`Work::refused`] gives the reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Refused;

/// Work of one verdict at one random point.
#[derive(Debug, Clone)]
pub(crate) struct Work {
    limit: WorkLimit,
    spent: Cell<u64>,
    /// First refusal: the step, with the operations and the bytes that it would have reached.
    refused: Cell<Option<(WorkStep, u64, u64)>>,
}

/// Series that the rows of an order take when computed backwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sweeps {
    /// Length of the longest series.
    pub(super) longest: u64,
    /// Number of sweeps through the graph; each takes series that are shorter by one.
    pub(super) count: u64,
    /// Numbers of orders of the values that are stored before and after.
    pub(super) values: [u64; 2],
}

/// Cost of the derivatives of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RowCost {
    /// Products and sums of an order that do not grow with it, by unknowns.
    pub(super) fixed: u64,
    /// Products and sums of an order for each order before it, by unknowns.
    pub(super) growing: u64,
    /// Number of operations of the model that take part.
    pub(super) nodes: u64,
    /// Number of these operations that multiply or divide two series.
    pub(super) products: u64,
    /// Series of the rows that are computed backwards, output by output; `None` if they are computed
    /// forwards.
    pub(super) backwards: Option<Sweeps>,
    /// Number of outputs.
    pub(super) outputs: u64,
    /// Number of unknowns.
    pub(super) components: u64,
    /// Number of words of 64 bits in a number.
    pub(super) words: u64,
}

impl RowCost {
    /// Operations of the rows of an order, with their elimination.
    fn operations(&self, order: u64) -> u64 {
        let next = order.saturating_add(1);
        let rows = match self.backwards {
            None => self.fixed.saturating_add(self.growing.saturating_mul(next)),
            Some(sweeps) => self.swept(sweeps),
        };
        let rank = self.outputs.saturating_mul(next).min(self.components);
        let elimination = self.outputs.saturating_mul(self.components).saturating_mul(rank);
        rows.saturating_add(elimination).saturating_mul(self.words.saturating_mul(self.words))
    }

    /// Operations of the missing values, and of sweeps through the graph.
    fn swept(&self, sweeps: Sweeps) -> u64 {
        let triangle = |n: u64| n.saturating_mul(n + 1) / 2;
        let [before, then] = sweeps.values.map(triangle);
        let values = self.products.saturating_mul(then.saturating_sub(before));
        let sweep = |length: u64| {
            let short = length.saturating_mul(length);
            let points = (2 * length.max(1)).next_power_of_two();
            let transforms = points * u64::from(points.ilog2()) * TRANSFORM.0 / TRANSFORM.1;
            // numbers of many digits are multiplied coefficient by coefficient
            let product = if self.words > 1 { short } else { short.min(transforms) };
            let sums = self.nodes.saturating_mul(length);
            sums.saturating_add(self.products.saturating_mul(product))
        };
        let all = (0..sweeps.count).map(|k| sweep(sweeps.longest.saturating_sub(k)));
        let one_output = all.fold(0, u64::saturating_add);
        values.saturating_add(self.outputs.saturating_mul(one_output))
    }

    /// Bytes of the series up to an order, and of the rows.
    fn bytes(&self, order: u64) -> u64 {
        let series = match self.backwards {
            None => self.fixed.saturating_add(self.nodes).saturating_mul(order + 1),
            Some(sweeps) => self.nodes.saturating_mul(HELD).saturating_mul(sweeps.values[1]),
        };
        let rows = self.components.saturating_mul(self.components).saturating_mul(2);
        series.saturating_add(rows).saturating_mul(8 * self.words)
    }
}

impl Work {
    pub(crate) fn new(limit: WorkLimit) -> Self {
        Self { limit, spent: Cell::new(0), refused: Cell::new(None) }
    }

    /// Counts the rows of an order before they are computed; false if they exceed the limit.
    pub(super) fn spend(&self, order: usize, cost: &RowCost) -> bool {
        let (operations, bytes) = (cost.operations(order as u64), cost.bytes(order as u64));
        self.take(WorkStep::Derivatives(order), operations, bytes).is_ok()
    }

    /// Counts operations before they are done, and bytes before they are allocated.
    ///
    /// # Errors
    /// [`Refused`] if they exceed the limit, or if anything was refused before.
    pub(super) fn take(&self, step: WorkStep, operations: u64, bytes: u64) -> Result<(), Refused> {
        if self.refused.get().is_some() {
            return Err(Refused);
        }
        let spent = self.spent.get().saturating_add(operations);
        if spent > self.limit.operations() || bytes > self.limit.bytes() {
            self.refused.set(Some((step, spent, bytes)));
            return Err(Refused);
        }
        self.spent.set(spent);
        Ok(())
    }

    /// Error with the reason why the verdict was not computed; `None` if nothing was refused.
    pub(crate) fn refused(&self) -> Option<ModelError> {
        let (step, spent, bytes) = self.refused.get()?;
        let what = match bytes > self.limit.bytes() {
            true => format!("{:.1e} bytes", bytes as f64),
            false => format!("{:.1e} operations", spent as f64),
        };
        Some(self.limit.refuse(&step.words(), &what))
    }
}

/// Operations of several verdicts or points.
#[derive(Debug, Default)]
pub(crate) struct Spent {
    /// Number of operations, whether or not they led to a verdict.
    pub(crate) operations: u64,
    /// True if any verdict or point was refused.
    pub(crate) refused: bool,
}

impl Spent {
    /// Adds the operations at a point.
    pub(super) fn add(&mut self, work: &Work) {
        self.operations = self.operations.saturating_add(work.spent.get());
        self.refused |= work.refused.get().is_some();
    }

    /// Adds the operations of other verdicts or points.
    pub(super) fn join(&mut self, other: &Self) {
        self.operations = self.operations.saturating_add(other.operations);
        self.refused |= other.refused;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(backwards: Option<Sweeps>) -> RowCost {
        RowCost {
            fixed: 10,
            growing: 6,
            nodes: 5,
            products: 3,
            backwards,
            outputs: 2,
            components: 7,
            words: 1,
        }
    }

    /// By hand: 10 + 6 * 4 for the rows of order 3, and 2 rows of 7 against a rank of at most 7.
    #[test]
    fn operations_by_hand() {
        assert_eq!(cost(None).operations(3), 10 + 6 * 4 + 2 * 7 * 7);
        assert_eq!(cost(None).operations(0), 10 + 6 + 2 * 7 * 2);
        // two sweeps with series of 9 and 8: 5 sums of as many, 3 products of 81 and 64 terms; values of
        // orders 4 to 9
        let sweeps = Sweeps { longest: 9, count: 2, values: [4, 10] };
        let values = 3 * (5 + 6 + 7 + 8 + 9 + 10);
        let elimination = 2 * 7 * 7;
        assert_eq!(cost(Some(sweeps)).operations(3), values + 2 * (5 * 17 + 3 * (81 + 64)) + elimination);
        // a series of 108: transforms of 256 points
        let (transforms, long) = (256 * 8 * 9 / 4, Sweeps { longest: 108, count: 1, values: [200, 200] });
        assert_eq!(cost(Some(long)).operations(200), 2 * (5 * 108 + 3 * transforms) + elimination);
        assert_eq!(cost(Some(long)).bytes(3), 8 * (5 * 4 * 200 + 2 * 49));
        assert_eq!(RowCost { words: 3, ..cost(None) }.operations(0), 9 * (10 + 6 + 2 * 7 * 2));
        assert_eq!(cost(None).bytes(3), 8 * ((10 + 5) * 4 + 2 * 49));
    }

    #[test]
    fn what_is_beyond_is_refused_with_its_option() {
        let work = Work::new(WorkLimit(1000));
        let large = RowCost { growing: 400_000_000, ..cost(None) };
        assert!(work.spend(0, &large) && work.refused().is_none());
        assert!(!work.spend(1, &large));
        assert_eq!(work.spent.get(), 400_000_000 + 10 + 28);
        let message = work.refused().expect("refused").to_string();
        assert!(
            message.contains(
                "order 1 take 1.2e9 operations, beyond --work-limit 1000 (1.0e9 operations, 5.0e8 bytes)"
            ),
            "{message}"
        );
        let work = Work::new(WorkLimit(1000));
        assert!(!work.spend(9, &RowCost { fixed: 10_000_000, ..cost(None) }));
        let message = work.refused().expect("refused").to_string();
        assert!(message.contains("order 9 take 8.0e8 bytes"), "{message}");
    }

    /// A refusal is final, however little is requested next, and the first reason stays.
    #[test]
    fn a_refusal_stays() {
        let work = Work::new(WorkLimit(1));
        assert_eq!(
            [(400_000, 0), (600_000, 500_000)].map(|(n, b)| work.take(WorkStep::Points, n, b)),
            [Ok(()); 2]
        );
        assert_eq!(work.take(WorkStep::Gradients, 0, 500_001), Err(Refused));
        assert_eq!(work.take(WorkStep::Constraints, 0, 0), Err(Refused));
        let message = work.refused().expect("refused").to_string();
        assert!(message.contains("gradients of its operations take 5.0e5 bytes"), "{message}");
        assert_eq!([0, 1, UNIT, UNIT + 1, 9 * UNIT].map(|n| WorkLimit(3).within(n).0), [0, 1, 1, 2, 3]);
        let mut spent = Spent::default();
        spent.add(&work);
        spent.add(&work);
        assert!(spent.refused && spent.operations == 2_000_000);
        for (step, words) in [
            (WorkStep::Points, "values of its operations at random points take 1.0e7 operations"),
            (WorkStep::Constraints, "points at which its constraints hold take"),
            (WorkStep::Independence, "gradients of the arguments of its functions take"),
        ] {
            let work = Work::new(WorkLimit(1));
            assert_eq!(work.take(step, 10_000_000, 0), Err(Refused));
            let message = work.refused().expect("refused").to_string();
            assert!(message.contains(words) && message.contains("--work-limit 1 "), "{message}");
        }
    }
}

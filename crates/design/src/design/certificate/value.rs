//! A criterion with its rounding tolerance, for comparison with a bound.

/// Largest relative excess of a criterion over a bound, dimensionless, at least 0.
pub(crate) fn excess(value: f64, bound: f64) -> f64 {
    (value / bound * (1.0 + 4.0 * f64::EPSILON) - 1.0).max(0.0)
}

/// Criterion with its rounding tolerance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CriterionValue {
    /// Criterion as the search computes it.
    pub(crate) computed: f64,
    /// Upper bound on the criterion; the computed value where its rounding error is unknown.
    pub(crate) at_most: f64,
    /// Relative rounding tolerance, dimensionless; `None` where it is unknown.
    pub(crate) rounding: Option<f64>,
}

impl CriterionValue {
    pub(crate) fn new(computed: f64, at_most: Option<f64>) -> Self {
        let rounding = at_most.map(|most| (most / computed - 1.0).max(0.0));
        Self { computed, at_most: at_most.unwrap_or(computed).max(computed), rounding }
    }
}

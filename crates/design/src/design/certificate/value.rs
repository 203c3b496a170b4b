//! A criterion with what rounding may hide of it, beside a bound.

/// How far a criterion is above a bound at most, as a part of it.
pub(crate) fn excess(value: f64, bound: f64) -> f64 {
    (value / bound * (1.0 + 4.0 * f64::EPSILON) - 1.0).max(0.0)
}

/// A criterion, with what rounding may hide of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Value {
    /// As the search computes it.
    pub(crate) computed: f64,
    /// What it is at most; where nothing is known of its rounding, as computed.
    pub(crate) at_most: f64,
    /// What rounding may hide of it, as a part of it, where that is known.
    pub(crate) rounding: Option<f64>,
}

impl Value {
    pub(crate) fn new(computed: f64, at_most: Option<f64>) -> Self {
        let rounding = at_most.map(|most| (most / computed - 1.0).max(0.0));
        Self { computed, at_most: at_most.unwrap_or(computed).max(computed), rounding }
    }
}

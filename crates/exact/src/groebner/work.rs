//! Limit of work, counted in operations.

use crate::interrupt;

/// Limit of work in products of coefficients, counted down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RemainingWork {
    /// Remaining work.
    pub left: u64,
    /// True once the limit was reached. Otherwise [`OverLimit`] is a power above 255, which no limit
    /// allows.
    pub used_up: bool,
}

/// Error: the limit of work was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OverLimit;

impl RemainingWork {
    /// Limit of `left` products.
    pub const fn new(left: u64) -> Self {
        Self { left, used_up: false }
    }

    /// Takes `amount` from the remaining work.
    ///
    /// # Errors
    /// [`OverLimit`] when less is left.
    pub fn take(&mut self, amount: u64) -> Result<(), OverLimit> {
        interrupt::check();
        let left = self.left.checked_sub(amount);
        self.used_up |= left.is_none();
        self.left = left.ok_or(OverLimit)?;
        Ok(())
    }
}

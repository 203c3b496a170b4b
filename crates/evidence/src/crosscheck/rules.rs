//! Conditions under which evidence agrees with a verdict: one set of rules for platforms and any other
//! system.

use std::ops::RangeInclusive;

use super::answer::{Agreement, Check, Count};

/// Largest difference of a measured slope from the predicted one, dimensionless.
pub(crate) const SLOPE_TOLERANCE: f64 = 0.1;

/// Bands of the factor on sigma for a prior ten times as loose: for a determined quantity (1 in the limit)
/// and for an undetermined one (10 in the limit).
pub(crate) struct InflationBands {
    pub(crate) determined: RangeInclusive<f64>,
    pub(crate) open: RangeInclusive<f64>,
}

/// Bands for a linear filter, whose prior is so diffuse that the limit is reached.
pub(crate) const LINEAR: InflationBands = InflationBands { determined: 0.99..=1.01, open: 9.0..=11.0 };
/// Bands for a system linearised along its run, whose prior is a multiple of that of its file.
pub(crate) const LINEARISED: InflationBands =
    InflationBands { determined: 0.0..=1.5, open: 5.0..=f64::INFINITY };

impl InflationBands {
    /// Check of a measured factor.
    pub(crate) fn check(&self, determined: bool, measured: Option<f64>) -> Check {
        let (expected, band) = if determined { (1.0, &self.determined) } else { (10.0, &self.open) };
        Check::new(expected, measured, |x| band.contains(&x))
    }
}

/// Check of the log-log slope of sigma against time: -(order + 1/2) for a quantity with an order. Without an
/// order sigma stays, or grows as an unobservable quantity drives it.
pub(crate) fn slope(order: Option<usize>, measured: Option<f64>) -> Check {
    let predicted = order.map_or(0.0, |d| -(d as f64 + 0.5));
    Check::new(predicted, measured, |x| match order {
        Some(_) => (x - predicted).abs() <= SLOPE_TOLERANCE,
        None => x >= -SLOPE_TOLERANCE,
    })
}

/// Check of the number of unobservable directions: the predicted one against the number of singular values
/// (largest first) of at most `unseen` times the largest.
pub(crate) fn defect(predicted: usize, values: &[f64], unseen: f64) -> Count {
    let largest = values.first().copied().unwrap_or(1.0);
    let measured = values.iter().filter(|s| **s <= unseen * largest).count();
    Count { predicted, measured, outcome: Agreement::of(predicted == measured) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_agrees() {
        use Agreement::{Agrees, Disagrees, NotTested};
        let passes = |order, x| slope(order, x).outcome;
        assert_eq!(
            [-2.41, -2.59, -2.61, -1.5].map(|x| passes(Some(2), Some(x))),
            [Agrees, Agrees, Disagrees, Disagrees]
        );
        assert_eq!(
            [0.0, 0.5, -0.1, -0.5].map(|x| passes(None, Some(x))),
            [Agrees, Agrees, Agrees, Disagrees]
        );
        // NaN agrees with no prediction; a missing measurement neither agrees nor disagrees
        assert_eq!([passes(Some(2), Some(f64::NAN)), passes(None, Some(f64::NAN))], [Disagrees; 2]);
        assert_eq!([passes(Some(2), None), passes(None, None)], [NotTested; 2]);
        let inflated =
            |rules: &InflationBands, determined, x| rules.check(determined, Some(x)).outcome == Agrees;
        assert_eq!([1.0, 1.02, 9.5].map(|x| inflated(&LINEAR, true, x)), [true, false, false]);
        assert_eq!([10.0, 8.9, 1.0].map(|x| inflated(&LINEAR, false, x)), [true, false, false]);
        assert_eq!([1.4, 1.6, f64::NAN].map(|x| inflated(&LINEARISED, true, x)), [true, false, false]);
        assert_eq!([6.0, 4.0, f64::NAN].map(|x| inflated(&LINEARISED, false, x)), [true, false, false]);
        assert_eq!(LINEAR.check(true, None).outcome, NotTested);
    }

    #[test]
    fn what_counts() {
        let count = |predicted, measured, outcome| Count { predicted, measured, outcome };
        assert_eq!(defect(1, &[10.0, 1.0, 1e-12], 1e-10), count(1, 1, Agreement::Agrees));
        assert_eq!(defect(0, &[10.0, 1.0, 1e-12], 1e-10), count(0, 1, Agreement::Disagrees));
        assert_eq!(defect(0, &[], 1e-10).measured, 0);
    }
}

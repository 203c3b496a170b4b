//! When evidence agrees with a verdict: one set of rules for platforms and for any system.

use std::ops::RangeInclusive;

use super::answer::{Agreement, Check, Count};

/// How far a measured slope may be from the predicted one.
pub(crate) const SLOPE_TOLERANCE: f64 = 0.1;

/// The factors on sigma, when a prior is ten times as loose, of what is determined and of what is not: 1 and
/// 10 in the limit.
pub(crate) struct Inflation {
    pub(crate) determined: RangeInclusive<f64>,
    pub(crate) open: RangeInclusive<f64>,
}

/// Of a linear filter, whose prior is so diffuse that the limit is reached.
pub(crate) const LINEAR: Inflation = Inflation { determined: 0.99..=1.01, open: 9.0..=11.0 };
/// Of a system linearised along its run, whose prior is a multiple of that of its file.
pub(crate) const LINEARISED: Inflation = Inflation { determined: 0.0..=1.5, open: 5.0..=f64::INFINITY };

impl Inflation {
    /// The check of a measured factor.
    pub(crate) fn check(&self, determined: bool, measured: Option<f64>) -> Check {
        let (expected, band) = if determined { (1.0, &self.determined) } else { (10.0, &self.open) };
        Check::new(expected, measured, |x| band.contains(&x))
    }
}

/// The log-log slope of sigma against time of what has an order, -(order + 1/2); without one nothing is
/// learnt: sigma stays, or grows as what nobody sees moves it.
pub(crate) fn slope(order: Option<usize>, measured: Option<f64>) -> Check {
    let predicted = order.map_or(0.0, |d| -(d as f64 + 0.5));
    Check::new(predicted, measured, |x| match order {
        Some(_) => (x - predicted).abs() <= SLOPE_TOLERANCE,
        None => x >= -SLOPE_TOLERANCE,
    })
}

/// The number of directions that are not seen: predicted, and singular values (largest first) below `unseen`
/// times the largest.
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
        // what is no number agrees with nothing; what was not measured is neither
        assert_eq!([passes(Some(2), Some(f64::NAN)), passes(None, Some(f64::NAN))], [Disagrees; 2]);
        assert_eq!([passes(Some(2), None), passes(None, None)], [NotTested; 2]);
        let inflated = |rules: &Inflation, determined, x| rules.check(determined, Some(x)).outcome == Agrees;
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

//! Excess of a criterion over a bound: two figures, and the percentage that follows from the printed figures.

use crate::document::number;

/// A criterion, a lower bound of it, and the excess over the bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excess {
    /// The criterion, to six digits.
    pub value: String,
    /// The bound to six digits, rounded down.
    pub bound: String,
    /// Excess of the first printed figure over the second, in percent, rounded up to three digits.
    pub percent: String,
}

impl Excess {
    /// Excess of a criterion over a bound, both above 0. `at_most_percent` is a known upper limit of the
    /// excess, which rounded figures may hide.
    ///
    /// ```
    /// use obsdeg_report::Excess;
    /// let excess = Excess::new(0.6204648, 0.6082472, 2.00865);
    /// assert_eq!([&*excess.value, &*excess.bound, &*excess.percent], ["0.620465", "0.608247", "2.01 %"]);
    /// ```
    pub fn new(value: f64, bound: f64, at_most_percent: f64) -> Self {
        let (value, bound) = (six(value, f64::round), six(bound, f64::floor));
        let of = |figure: &str| figure.parse::<f64>().unwrap_or(f64::NAN);
        let percent = 100.0 * (of(&value) / of(&bound) - 1.0);
        Self { percent: upward(percent.max(at_most_percent)), value, bound }
    }
}

/// Number above 0 with six digits.
fn six(x: f64, rounded: impl Fn(f64) -> f64) -> String {
    if !(x.is_finite() && x > 0.0) {
        return number(x);
    }
    let digits = 5 - x.log10().floor() as i32;
    let unit = 10f64.powi(digits.abs());
    // a decimal number of six digits stays as it is
    let scaled = if digits < 0 { x / unit } else { x * unit };
    let near = (scaled - scaled.round()).abs() < 1e-14 * scaled;
    let whole = if near { scaled.round() } else { rounded(scaled) };
    let cut = if digits < 0 { whole * unit } else { whole / unit };
    match (1e-3..1e6).contains(&x) {
        true => format!("{cut:.*}", digits.max(0) as usize),
        false => format!("{cut:.5e}"),
    }
}

/// Percentage rounded up to three digits, in steps of at least 1e-6: `0.0213 %`.
fn upward(percent: f64) -> String {
    const FINEST: f64 = 1e-6;
    if percent <= FINEST {
        return format!("{FINEST} %");
    }
    let decimals = (2 - percent.log10().floor() as i32).clamp(0, 6);
    let unit = 10f64.powi(decimals);
    format!("{:.*} %", decimals as usize, (percent * unit - 1e-6).ceil() / unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The percentage is that of the printed figures, or at most a unit of its last digit above.
    #[test]
    fn percentages_follow_from_the_figures() {
        let mut seed = 7u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        for _ in 0..2000 {
            let bound = 10f64.powf(9.0 * draw() - 6.0);
            let value = bound * (1.0 + 10f64.powf(7.0 * draw() - 6.0));
            let stated = Excess::new(value, bound, 100.0 * (value / bound - 1.0));
            let of = |figure: &str| figure.parse::<f64>().expect("a number");
            let percent = stated.percent.strip_suffix(" %").expect("a percentage");
            let of_figures = 100.0 * (of(&stated.value) / of(&stated.bound) - 1.0);
            let decimals = percent.split_once('.').map_or(0, |(_, d)| d.len() as i32);
            let unit = 10f64.powi(-decimals);
            assert!(
                of(&stated.bound) <= bound * (1.0 + 1e-14)
                    && (of(&stated.value) / value - 1.0).abs() < 5.1e-6,
                "{stated:?} {value} {bound}"
            );
            assert!(of(percent) >= of_figures - 1e-6 * unit - 1e-9, "{stated:?} {of_figures}");
            // below 0.001 % six digits are too few: the known excess counts
            let most = of_figures.max(100.0 * (value / bound - 1.0)).max(1e-6);
            assert!(of(percent) <= most + unit * 1.001, "{stated:?} {of_figures}");
        }
        let of = |value: f64, bound: f64| {
            let Excess { value, bound, percent } = Excess::new(value, bound, 100.0 * (value / bound - 1.0));
            [value, bound, percent]
        };
        assert_eq!(of(0.5, 0.5), ["0.500000", "0.500000", "0.000001 %"]);
        assert_eq!(of(6.343e-4 * 1.3, 6.343e-4), ["8.24590e-4", "6.34300e-4", "30.0 %"]);
        assert_eq!(of(150.0, 100.0), ["150.000", "100.000", "50.0 %"]);
    }
}

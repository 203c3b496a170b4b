//! Sizes of errors that keep a change small, rounded down.

use obsdeg_evidence::simulation::si_per_shown;

/// Smallest printed bound on a probability.
pub(super) const SMALLEST: f64 = 1e-300;

/// Share of the squared total, in percent, from which a source has a line of its own in a printed budget.
pub(super) const LEAST: f64 = 0.05;

/// A number with two significant digits: sizes need no more.
pub(super) fn short(x: f64) -> String {
    if x == 0.0 || !(1e-3..1e5).contains(&x.abs()) {
        return if x == 0.0 { "0".into() } else { format!("{x:.1e}") };
    }
    let decimals = (1 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{x:.decimals$}")
}

/// A number with three significant digits, rounded down: a size below which a requirement is met.
pub(super) fn below(x: f64) -> String {
    let exponent = x.log10().floor() as i32;
    let unit = 10f64.powi(exponent - 2);
    let down = (x / unit).floor() * unit;
    match exponent {
        -3..5 => format!("{down:.*}", (2 - exponent).max(0) as usize),
        _ => format!("{down:.2e}"),
    }
}

/// Largest size of an error that counts as small: 0.05 g, 5 % of a rate or a scale, 0.05 rad. Beyond it the
/// change of first order does not hold.
const SMALL: f64 = 0.05;

/// True if changes of first order hold up to this size.
pub(super) fn is_small(size: f64, unit: &str) -> bool {
    size * si_per_shown(unit) < SMALL
}

/// Limits of families (name, size, unit, remark); a family whose limit is not small is listed by its name
/// only.
pub(super) fn limits<'a>(all: impl Iterator<Item = (&'a str, f64, &'a str, String)>) -> Option<String> {
    let (small, other): (Vec<_>, Vec<_>) = all.partition(|(_, size, unit, _)| is_small(*size, unit));
    let limit = |(family, size, unit, more): &(&str, f64, &str, String)| {
        format!("{family} < {} {unit}{more}", below(*size))
    };
    let listed = small.iter().map(limit).collect::<Vec<_>>().join(", ");
    let names = other.iter().map(|o| o.0).collect::<Vec<_>>().join(", ");
    let other = (!other.is_empty())
        .then(|| format!("no small size (up to 0.05 g, 5 %, 0.05 rad) of {names} uses up a margin"));
    let small = (!small.is_empty()).then_some(listed);
    let all: Vec<String> = small.into_iter().chain(other).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

//! Log-log slopes of sigma against the dwell as the dwell goes to zero, and the observable directions there.

use obsdeg_core::model::Scheme;
use obsdeg_core::model::slew::W_IE;

use super::precise::{self, Between, Digits, Functional, ObservableDirections};

/// Precisions that are tried in turn, in bits.
const BITS: [usize; 2] = [1024, 2048];
/// Dwells of the first position as powers of two, in 1/w_ie: 2^-133 is 9e-41. Angles and latitudes are whole
/// 1e-9 degrees, 2e-11 rad, so directions that hardly differ still differ by far more.
const DWELLS: [i32; 3] = [-133, -140, -147];
/// Largest difference of the slopes between neighbouring dwells that counts as settled, dimensionless.
const SETTLED: f64 = 0.01;

/// Method and limits of the slopes, in words.
pub(super) fn method() -> Vec<String> {
    let [first, .., last] = DWELLS;
    let [few, many] = BITS;
    vec![
        format!(
            "a: samples of Z in a model written apart from the exact engine's, in {few} bits ({many} where \
             these do not tell what is seen from \
             rounding; not resolvable where those do not), at dwells of 2^{first} to 2^{last} of 1/w_ie"
        ),
        format!(
            "a: a slope counts where it changes by less than {SETTLED} between these dwells, for a \
             combination whether its coefficients are \
             taken to 1e-7 or to 1e-12; it is not resolvable elsewhere, nor is what dwells \
             add to a combination beyond its degree (coefficients are doubles, and dwells smaller than their rounding)"
        ),
    ]
}

/// Dependence of the sigma of a functional on the dwell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DwellSlope {
    /// Sigma falls, or stays, with this slope on logarithmic axes.
    Slope(f64),
    /// The samples do not determine the functional.
    Unseen,
    /// The slope still changes with the dwell.
    Bends,
}

/// Functional whose slope is requested.
pub(super) struct SlopeRequest {
    /// `(unknown, coefficient)`, drifts in rad/s.
    pub(super) terms: Vec<(usize, f64)>,
    /// True if the coefficients are exact, false if they are rounded to doubles.
    pub(super) exact: bool,
    /// True if the psi of the functional is that of the end.
    pub(super) at_end: bool,
}

/// Largest and smallest assumed relative errors of rounded coefficients: a functional for which the choice
/// matters is not resolvable.
pub(super) const ROUNDED: [f64; 2] = [1e-7, 1e-12];

/// Behaviour of the samples as the dwell goes to zero.
pub(super) struct Asymptotics {
    pub(super) dwell_slopes: Vec<DwellSlope>,
    /// dim V_0, dim V_1, ..., from the slopes of the pivots; `None` where they do not settle.
    pub(super) profile: Option<Vec<usize>>,
    /// Observable directions at the shortest dwell.
    pub(super) seen: ObservableDirections,
}

/// Terms with drifts in units of the earth rate, of a functional or (if `change`) of a change of the
/// unknowns.
pub(super) fn functional(
    digits: Digits,
    is_psi: &dyn Fn(usize) -> bool,
    terms: &[(usize, f64)],
    change: bool,
) -> Functional {
    let scaled = |c: usize, k: f64| match (is_psi(c), change) {
        (true, _) => k,
        (false, true) => k / W_IE,
        (false, false) => k * W_IE,
    };
    terms.iter().map(|&(c, k)| (c, digits.double(scaled(c, k)))).collect()
}

/// Samples of a scheme at the dwells, in every precision of `BITS`.
pub(super) type Samples<'a> = precise::PreciseSamples<'a, { BITS.len() }>;

/// Samples of `scheme` at the dwells.
pub(super) fn samples(scheme: &Scheme) -> Samples<'_> {
    Samples::new(scheme, DWELLS.iter().map(|&k| 2f64.powi(k)).collect(), BITS)
}

/// Slopes of `requests`; `None` where no precision separates observable directions from rounding.
pub(super) fn asymptotics(
    samples: &Samples<'_>,
    between: Between,
    is_psi: &(dyn Fn(usize) -> bool + Sync),
    requests: &[SlopeRequest],
) -> Option<Asymptotics> {
    (0..BITS.len()).find_map(|bits| {
        let seen: Vec<ObservableDirections> = samples.seen(bits, between)?;
        let digits = Digits { bits: BITS[bits] };
        let dwell_slope = |q: &SlopeRequest| {
            let terms = functional(digits, is_psi, &q.terms, false);
            let sigmas = |rounded: Option<f64>| -> Vec<Option<f64>> {
                let moved =
                    |s: &ObservableDirections| if q.at_end { s.at_start(&terms) } else { terms.clone() };
                seen.iter().map(|s| s.sigma(&moved(s), rounded)).collect()
            };
            let [sigmas, closer] = if q.exact { [None; 2] } else { ROUNDED.map(Some) }.map(sigmas);
            if sigmas != closer {
                return DwellSlope::Bends;
            }
            if sigmas.iter().all(Option::is_none) {
                return DwellSlope::Unseen;
            }
            let Some(sigmas) = sigmas.into_iter().collect::<Option<Vec<f64>>>() else {
                return DwellSlope::Bends;
            };
            slope(&sigmas).map_or(DwellSlope::Bends, DwellSlope::Slope)
        };
        let dwell_slopes = requests.iter().map(dwell_slope).collect();
        let rank = seen[0].rank();
        let same = seen.iter().all(|s| s.rank() == rank);
        let orders: Option<Vec<usize>> = (0..rank)
            .map(|k| {
                let sizes: Vec<f64> = seen.iter().filter_map(|s| s.sizes.get(k).copied()).collect();
                // the square root falls as the dwell to the order + 1/2
                let order = slope(&sizes)? / 2.0 - 0.5;
                ((order - order.round()).abs() < SETTLED).then_some(order.round().max(0.0) as usize)
            })
            .collect();
        let profile = orders.filter(|_| same).map(|orders| {
            let last = orders.iter().copied().max().unwrap_or(0);
            (0..=last).map(|k| orders.iter().filter(|o| **o <= k).count()).collect()
        });
        let seen = seen.into_iter().next_back()?;
        Some(Asymptotics { dwell_slopes, profile, seen })
    })
}

/// Slope of binary logarithms at the dwells; `None` if it does not settle.
fn slope(values: &[f64]) -> Option<f64> {
    let [a, b, c] = *values else { return None };
    let between = |y: f64, x: f64, i: usize| (y - x) / f64::from(DWELLS[i + 1] - DWELLS[i]);
    let (first, last) = (between(b, a, 0), between(c, b, 1));
    ((last - first).abs() < SETTLED).then_some(last)
}

#[cfg(test)]
mod tests {
    use obsdeg_core::model::{Carry, Scheme, parse_attitude};

    use super::*;

    fn dwell_slopes(
        attitudes: &[&str],
        latitude: &str,
        carry: Carry,
        between: Between,
    ) -> (Vec<DwellSlope>, Vec<usize>) {
        let angles = attitudes.iter().map(|a| parse_attitude(a).expect("an attitude"));
        let scheme = Scheme { carry, latitude: latitude.parse().ok(), ..Scheme::of_angles(angles) };
        let ask = |c| SlopeRequest { terms: vec![(c, 1.0)], exact: true, at_end: false };
        let n = if carry == Carry::Reset { 3 * attitudes.len() + 12 } else { 15 };
        let requests: Vec<SlopeRequest> = (0..n).map(ask).collect();
        let found = asymptotics(&samples(&scheme), between, &|c| c + 12 < n, &requests).expect("resolved");
        (found.dwell_slopes, found.profile.expect("settled"))
    }

    fn orders(dwell_slopes: &[DwellSlope]) -> Vec<Option<usize>> {
        let order = |c: &DwellSlope| match c {
            DwellSlope::Slope(s) => {
                let order = -s - 0.5;
                assert!((order - order.round()).abs() < 1e-6, "{s}");
                Some(order.round() as usize)
            }
            DwellSlope::Unseen => None,
            DwellSlope::Bends => panic!("bends: {dwell_slopes:?}"),
        };
        dwell_slopes.iter().map(order).collect()
    }

    const S6: [&str; 6] = ["10,25,40", "130,-50,70", "-95,33,-160", "60,80,15", "-20,-70,110", "170,15,-75"];

    /// Verdicts of section 9 of the method, by samples alone.
    #[test]
    fn published_verdicts() {
        let p1p2 = ["0,0,0", "180,0,0"];
        let (found, profile) = dwell_slopes(&p1p2, "28.2", Carry::Platform, Between::Nothing);
        let (zero, one, two) = (Some(0), Some(1), Some(2));
        assert_eq!(
            orders(&found),
            [zero, None, zero, one, two, None, None, two, None, None, None, None, one, None, one]
        );
        assert_eq!(profile, [2, 6, 8]);
        for (n, carry, expected) in [
            (6, Carry::Platform, &[3, 14, 15][..]),
            (6, Carry::Inertial, &[2, 14, 15]),
            (6, Carry::Reset, &[12, 24, 30]),
            (5, Carry::Platform, &[3, 13, 15]),
            (4, Carry::Inertial, &[2, 10, 14]),
        ] {
            assert_eq!(dwell_slopes(&S6[..n], "28.2", carry, Between::Nothing).1, expected, "{n} {carry}");
        }
        let (found, _) = dwell_slopes(&S6[..5], "28.2", Carry::Platform, Between::Nothing);
        assert_eq!(orders(&found), [vec![zero; 3], vec![two; 12]].concat());
        // with dwells
        let (found, _) = dwell_slopes(&S6[..5], "28.2", Carry::Platform, Between::Dwell);
        assert_eq!(orders(&found)[6..9], [one; 3]);
        let (found, _) = dwell_slopes(&S6[..4], "28.2", Carry::Platform, Between::Dwell);
        assert_eq!(orders(&found)[..3], [one; 3]);
    }
}

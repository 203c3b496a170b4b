//! Run of a filter in sentences: estimates, consistency, noise of the sensors, and limits of sigma.

use obsdeg_core::span::Span;
use obsdeg_evidence::simulation::{
    AccelerometerBias, CoefficientFloor, Consistency, Doubt, GyroNoise, NoiseFloor, Outcome, Reached,
    SimulationError,
};

use super::{degree, names};
use crate::document::{number, optional};

/// Outcome of an unknown in a run.
pub(crate) fn outcome(o: Outcome) -> &'static str {
    match o {
        Outcome::Reached => "reached",
        Outcome::Converging => "converging",
        Outcome::Determined => "determined",
        Outcome::RestsOnPrior => "rests on the prior",
        Outcome::PriorOnly => "known from the prior only",
        Outcome::LargeAnglesOnly => "large angles only",
        Outcome::Inconsistent => "inconsistent",
        Outcome::NoNumber => "no number",
    }
}

/// The columns of [`estimate`].
pub(crate) const ESTIMATE: [&str; 6] = ["degree", "truth", "estimate", "error", "sigma", "in sigma"];

/// Degree, true value, estimate, error and sigma of an unknown, and the error in sigma.
pub(crate) fn estimate(d: Option<usize>, values: [f64; 4], in_sigma: f64) -> [String; 6] {
    let [truth, estimate, error, sigma] = values.map(number);
    [degree(d), truth, estimate, error, sigma, format!("{in_sigma:.2}")]
}

/// Reason why a review has no evidence by a filter.
pub(crate) fn no_evidence(e: &SimulationError) -> String {
    match e {
        SimulationError::CrosscheckRotation => {
            "this scheme has a rotating segment, and the evidence by a filter takes positions".into()
        }
        e => format!("no evidence by a filter: {e}"),
    }
}

/// Findings against the consistency of a run.
pub(crate) fn doubts(c: &Consistency) -> String {
    let of = |d: &Doubt| match d {
        Doubt::NoNumber => "a figure of the run is no number".into(),
        Doubt::Nis => format!("mean NIS {} is outside {} (99.9 %)", number(c.nis), band(c.nis_wide_band)),
        Doubt::Nees => {
            format!("NEES {} at the end is above {} (99.9 %)", number(c.nees), number(c.nees_limit))
        }
        Doubt::Error => {
            format!("errors are beyond four sigma: {}", names(c.beyond.iter().map(String::as_str)))
        }
        Doubt::Correlated => {
            format!("innovations are not white (probability {})", number(c.whiteness_probability))
        }
    };
    c.doubts.iter().map(of).collect::<Vec<String>>().join("; ")
}

/// Band such as `1.7..2.3`.
pub(crate) fn band(band: Span<f64>) -> String {
    format!("{}..{}", number(band.from), number(band.to))
}

/// `; without ...`: the directions that the NEES leaves out; empty if there are none.
fn left_out(c: &Consistency) -> String {
    let directions = |k: usize| format!("{k} {}", if k == 1 { "direction" } else { "directions" });
    let held = match c.held_directions {
        0 => String::new(),
        k => format!("; without {} that constraints hold", directions(k)),
    };
    match c.unresolved_directions {
        0 => held,
        k => format!(
            "{held}; without {} that are not resolvable: the filter claims to know them more than a million \
             times better than any unknown",
            directions(k)
        ),
    }
}

/// Sentences on the consistency of a run, with its figures.
pub(crate) fn consistency(c: &Consistency) -> Vec<String> {
    vec![
        if c.consistent {
            "this run of the filter is consistent with its truth".into()
        } else {
            format!("the filter is NOT consistent with this truth: {}", doubts(c))
        },
        format!("mean NIS {} (95 %: {})", number(c.nis), band(c.nis_band)),
        format!(
            "NEES at the end {} (95 %: {}; decides: at most {}){}",
            number(c.nees),
            band(c.nees_band),
            number(c.nees_limit),
            left_out(c)
        ),
        format!("innovations white: probability {}", number(c.whiteness_probability)),
    ]
}

/// Samples at the start of positions that are left out.
pub(crate) fn settle(seconds: f64) -> String {
    format!("samples of the first {seconds} s at each position left out (settle under [record])")
}

/// The bias instability of the accelerometers.
pub(crate) fn accelerometer_bias(b: &AccelerometerBias) -> String {
    format!(
        "bias instability B {} ug of each accelerometer (first-order Gauss-Markov of {} s, sigma 1.076 B)",
        b.instability_ug, b.correlation_time_s
    )
}

/// Noise of the gyros by their datasheet.
pub(crate) fn gyro_noise(g: &GyroNoise) -> String {
    let listed = [
        (g.angle_random_walk_deg_sqrt_h, "angle random walk", "deg/sqrt(h)"),
        (g.rate_random_walk_dph_sqrt_h, "rate random walk", "deg/h/sqrt(h)"),
        (g.bias_instability_dph, "bias instability B", "deg/h"),
    ];
    let there = listed.iter().filter(|(x, ..)| !x.is_none());
    let parts: Vec<String> = there.map(|(x, what, unit)| format!("{what} {x} {unit}")).collect();
    let markov = if g.bias_instability_dph.is_none() {
        String::new()
    } else {
        format!(
            " (first-order Gauss-Markov of {} s, sigma 1.076 B: Allan peak 0.664 B)",
            g.correlation_time_s
        )
    };
    let states = if g.rate_random_walk_dph_sqrt_h.is_none() && g.bias_instability_dph.is_none() {
        ""
    } else {
        "; the biases are states of filter and truth, and D_F is the constant part: the walk counts from the \
         start of the run"
    };
    format!("gyros (X, Y, Z where they differ): {}{markov}{states}", parts.join(", "))
}

/// Columns of a noise floor: sigma with the scheme's dwells, the least sigma, and the dwell that reaches it.
pub(crate) const FLOOR: [&str; 3] = ["sigma now", "least sigma", "no better beyond [s]"];

/// Cells of the noise floor of one coefficient.
pub(crate) fn floor(c: &CoefficientFloor) -> [String; 3] {
    let dwell = match c.reached {
        Some(Reached::StillFalls) => "still falls".into(),
        Some(Reached::AtTheShortest) => "the shortest".into(),
        Some(Reached::Within) | None => optional(c.dwell_s),
    };
    [optional(c.sigma), optional(c.least_sigma), dwell]
}

/// Notes on the meaning of a noise floor.
pub(crate) const FLOOR_MEANS: [&str; 3] = [
    "sigma of the linear filter, as far as the small-angle model holds, without a prior, with noise of Z and \
     random drift: now, and the least over all dwells in proportion to these",
    "no better beyond: the shortest such dwell (mean of the positions) at which sigma is within 5 % of the \
     least; the shortest: of those looked at, so that shorter ones may do as well or better; still falls: \
     not before a quarter of the longest",
    "every coefficient is a constant: D_F is the bias at the start of the run, and the walk of a gyro takes \
     its bias away from there",
];

/// Dwells and noise of a noise floor.
pub(crate) fn floor_of(f: &NoiseFloor) -> [String; 2] {
    let [low, high] = f.dwells_s.map(number);
    let drift = if f.drift_noise_deg_sqrt_h > 0.0 {
        format!("; random drift of {} deg/sqrt(h) besides", number(f.drift_noise_deg_sqrt_h))
    } else {
        String::new()
    };
    [
        format!("dwells from {low} to {high} s, mean of the positions"),
        format!("{}{drift}", gyro_noise(&f.gyro_noise)),
    ]
}

//! Sentences on requirements, on conditions that are stated or not, and on the carry.

use obsdeg_core::model::Carry;
use obsdeg_evidence::requirements::{Miss, Requirements, SigmaSource, Worst};
use obsdeg_evidence::simulation::{
    ConditionsReport, Estimate, MeasurementReport, OtherCarry, RunDiffers, RunRequirements, SigmaRatio,
};

use crate::document::number;
use crate::words::run::{accelerometer_bias, gyro_noise};
use crate::words::{self, names};

/// Largest relative difference at which sigmas of a run count as equal to the predicted ones.
const EQUAL: f64 = 0.01;

/// Sentence with its first letter in upper case.
pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
}

/// The unknowns that miss their requirements, by reason.
pub(crate) fn missed(r: &Requirements) -> String {
    let reasons = [
        (Miss::TooLarge, ""),
        (Miss::NotObservable, " (not determined)"),
        (Miss::RestsOnPrior, " (resting on the prior)"),
        (Miss::Inconsistent, " (the filter is wrong about it)"),
        (Miss::NoNumber, " (no number)"),
    ];
    let of = |(why, words): (Miss, &str)| {
        let mut concerned = r.missed.iter().filter(|m| m.why == why).map(|m| m.name.as_str()).peekable();
        concerned.peek()?;
        Some(format!("{}{words}", names(concerned)))
    };
    reasons.into_iter().filter_map(of).collect::<Vec<_>>().join("; ")
}

/// Smallest margin such as `0.06798 (psi_y)`; `None` if nothing has a margin.
pub(crate) fn worst_margin(r: &Requirements) -> Option<String> {
    r.worst.as_ref().map(|w| format!("{} ({})", number(w.margin), w.name))
}

/// ` of the others` for a smallest margin if some missed unknowns have none.
pub(crate) fn whose_margin(r: &Requirements) -> &'static str {
    if r.leaves_out() { " of the others" } else { "" }
}

/// `every requirement is met, 15 of 15`, `requirements are NOT met, 2 of 15 missed: psi_x, psi_y`.
pub(crate) fn verdict(r: &Requirements) -> String {
    let bench = if r.with_bench { "with the bench " } else { "" };
    match (r.stated, r.all_met()) {
        (0, _) => "no requirement is stated, so none is judged".into(),
        (n, true) => format!("{bench}every requirement is met, {} of {n}", r.met),
        (n, false) => {
            format!("{bench}requirements are NOT met, {} of {n} missed: {}", r.missed.len(), missed(r))
        }
    }
}

/// [`verdict`] with the smallest margin and what rests on a prior.
fn outcome(r: &Requirements) -> String {
    let margin =
        worst_margin(r).map_or_else(String::new, |w| format!("; smallest margin{} {w}", whose_margin(r)));
    let prior = match r.on_prior.is_empty() {
        true => String::new(),
        false => format!("; by the stated prior alone: {}", names(r.on_prior.iter().map(String::as_str))),
    };
    format!("{}{margin}{prior}", verdict(r))
}

/// `every requirement is met, 15 of 15; smallest margin 1.245 (D_OZ)`.
pub(crate) fn requirements(r: &Requirements) -> String {
    let basis = match r.basis {
        _ if r.stated == 0 => return verdict(r),
        SigmaSource::Predicted | SigmaSource::PredictedWithPrior => "",
        SigmaSource::Run => "in this run ",
        SigmaSource::Record => "by this record ",
    };
    format!("{basis}{}", outcome(r))
}

/// Outcome of the requirements in a run, and the reasons for differences from the predicted sigmas.
pub(crate) fn run(r: &RunRequirements, c: &ConditionsReport) -> String {
    match r.requirements.stated {
        0 => format!("in this run {}", sigmas_of_run(r, c)),
        _ => format!("{}; {}", requirements(&r.requirements), sigmas_of_run(r, c)),
    }
}

/// [`run`] behind the prediction, whose outcome is not said again.
pub(crate) fn run_beside(predicted: &Requirements, r: &RunRequirements, c: &ConditionsReport) -> String {
    match r.requirements.stated > 0 && outcome(predicted) == outcome(&r.requirements) {
        true => format!("in the run too; {}", sigmas_of_run(r, c)),
        false => run(r, c),
    }
}

/// Sigmas of a run beside the predicted ones, and the reasons for differences.
fn sigmas_of_run(r: &RunRequirements, c: &ConditionsReport) -> String {
    let (Some(low), Some(high)) = (&r.smallest_ratio, &r.largest_ratio) else {
        return "no sigma is predicted".into();
    };
    if low.ratio > 1.0 - EQUAL && high.ratio < 1.0 + EQUAL {
        return "its sigmas are the predicted ones within 1 %".into();
    }
    let of = |r: &SigmaRatio| format!("{} ({})", ratio(r.ratio), r.name);
    let reasons: Vec<String> = r.differs.iter().map(|why| reason(*why, c)).collect();
    let why = match reasons.is_empty() {
        true => String::new(),
        false => format!(", since the run has {}", listed(&reasons)),
    };
    format!("its sigmas are {} to {} times the predicted ones{why}", of(low), of(high))
}

/// `a`, `a and b`, `a, b and c`.
fn listed(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Ratio with two decimals, or two digits if it is very small or large: `3.92`, `1.2e-03`.
fn ratio(x: f64) -> String {
    if (0.01..1000.0).contains(&x) { format!("{x:.2}") } else { format!("{x:.1e}") }
}

fn reason(why: RunDiffers, c: &ConditionsReport) -> String {
    match why {
        RunDiffers::RandomDrift => format!("a random drift of {} (not stated)", c.drift_noise),
        RunDiffers::Prior => "priors (not stated)".into(),
        RunDiffers::FullAttitudes => "full attitudes (the prediction is that of small angles)".into(),
    }
}

/// Name of a carry, with its assumption on the platform.
pub(crate) fn carry(c: Carry) -> &'static str {
    match c {
        Carry::Platform => {
            "platform carry: psi goes on unchanged in platform axes from position to position, as in the \
             paper; a platform that is torqued from one to the next has inertial carry"
        }
        Carry::Inertial => {
            "inertial carry: psi goes on in geographic axes from position to position, as on a platform that \
             is torqued from one to the next"
        }
        Carry::Reset => {
            "reset carry: the platform is levelled and aligned anew at every position, so that each has a \
             psi of its own"
        }
    }
}

/// Sigma such as `0.002237 deg/h/g (D_SX)`.
pub(crate) fn worst_sigma(w: &Worst) -> String {
    sigma_of(&w.name, w.sigma_dph)
}

/// Sigma of a drift coefficient with its unit. Zero-order coefficients and components of the drift are rates;
/// coefficients with one more letter are per g, with two more per g^2.
pub(crate) fn sigma_of(name: &str, sigma_dph: f64) -> String {
    let terms = name.strip_prefix("D_").map_or("", |rest| &rest[..rest.len().saturating_sub(1)]);
    let unit = match terms {
        "" | "F" => "deg/h",
        one if one.len() == 1 => "deg/h/g",
        _ => "deg/h/g^2",
    };
    format!("{} {unit} ({name})", number(sigma_dph))
}

/// Name of the largest figure of drift coefficients: the total with a bench, else sigma.
pub(crate) fn worst(r: &Requirements) -> &'static str {
    if r.with_bench { "worst total" } else { "worst sigma" }
}

/// The same scheme under the other carries, in one line; `None` if none was judged.
pub(crate) fn other_carries(carries: &[OtherCarry]) -> Option<String> {
    let of = |o: &OtherCarry| {
        let Some(r) = &o.requirements else {
            return format!("{}: not judged ({})", o.carry, o.not_judged.as_deref().unwrap_or("unknown"));
        };
        let at_once = if o.without_slews { " (repositioning at once)" } else { "" };
        let sigma = o.worst.as_ref().map_or_else(
            || "not every coefficient is determined".into(),
            |w| format!("{} {}", worst(r), worst_sigma(w)),
        );
        let met = match (r.stated, r.all_met()) {
            (0, _) => String::new(),
            (n, true) => format!(", every requirement met ({n})"),
            (n, false) => format!(", requirements NOT met ({} of {n} missed)", r.missed.len()),
        };
        format!("{}{at_once}: {sigma}{met}", o.carry)
    };
    let listed: Vec<String> = carries.iter().map(of).collect();
    (!listed.is_empty()).then(|| format!("under the other carries, {}", listed.join("; ")))
}

/// Conditions of predicted sigmas, for the heading of a table.
pub(crate) fn predicted(m: &MeasurementReport) -> String {
    let drift = match (&m.drift_noise, &m.gyro_noise) {
        (None, None) => "no random drift",
        _ => "the random drift that is stated",
    };
    let prior = if m.prior.is_some() { "the priors that are stated" } else { "no prior" };
    let bench = if m.bench.is_some() { "; worst sigma: total uncertainty with the bench" } else { "" };
    format!("sigma: information of all samples, {prior}, {drift}; psi at the end{bench}")
}

/// Conditions of the predicted sigmas of several schemes, which may differ.
pub(crate) fn predicted_of<'a>(all: impl IntoIterator<Item = &'a MeasurementReport>) -> String {
    let all: Vec<&MeasurementReport> = all.into_iter().collect();
    let mut said: Vec<String> = all.iter().map(|m| predicted(m)).collect();
    said.dedup();
    match said.len() {
        1 => said.remove(0),
        _ if all.iter().any(|m| m.bench.is_some()) => "sigma: information of all samples, with the priors \
                                                       and the random drift that each scheme states; psi at \
                                                       the end; worst sigma: of schemes with a bench the \
                                                       total uncertainty"
            .into(),
        _ => "sigma: information of all samples, with the priors and the random drift that each scheme \
              states; psi at the end"
            .into(),
    }
}

/// Values of conditions that are not stated, by their keys: `latitude 28.2 deg, noise of Z 1e-5 g`; `None` if
/// all are stated.
pub(crate) fn chosen(m: &MeasurementReport) -> Option<String> {
    let value = |key: &String| match key.as_str() {
        "latitude_deg" => format!("latitude {} deg", m.latitude_deg),
        "accelerometer_noise_g" => format!("noise of Z {:e} g", m.accelerometer_noise_g),
        "step_s" => format!("a sample every {} s", m.step_s),
        "dwell_s" => format!("{} s at a position", m.dwell_s),
        "azimuth_noise_deg" => format!("noise of the azimuth {:e} deg", m.azimuth_noise_deg.unwrap_or(0.0)),
        other => other.into(),
    };
    let listed: Vec<String> = m.by_default.iter().map(value).collect();
    (!listed.is_empty()).then(|| listed.join(", "))
}

/// Sentence on conditions of predicted sigmas that are not stated; `None` if all are stated.
pub(crate) fn by_default(m: &MeasurementReport) -> Option<String> {
    chosen(m).map(|listed| format!("not stated, chosen by the program: {listed}"))
}

/// Sentence on conditions of a run that are not stated; `None` if all are stated.
pub(crate) fn by_default_in_run(c: &ConditionsReport, unknowns: &[Estimate]) -> Option<String> {
    chosen_in_run(c, unknowns, &[]).map(|listed| format!("not stated, chosen by the program: {listed}"))
}

/// Conditions of a run that are not stated, without those of the keys `said`; `None` without any.
pub(crate) fn chosen_in_run(c: &ConditionsReport, unknowns: &[Estimate], said: &[String]) -> Option<String> {
    // the paper lacks the other unknowns, whose values and priors the program chooses
    let of_paper = |name: &str| {
        name.starts_with("psi")
            || ["D_F", "D_I", "D_O", "D_S"].contains(&&name[..name.len().saturating_sub(1)])
    };
    let others = unknowns.iter().any(|q| !of_paper(&q.name));
    let rest = if others { "; others too" } else { "" };
    let value = |key: &String| match key.as_str() {
        "latitude_deg" => format!("latitude {} deg", c.latitude_deg),
        "accelerometer_noise_g" => format!("noise of Z {:e} g", c.accelerometer_noise_g),
        "step_s" => format!("steps of {} s", c.step_s),
        "dwell_s" => "1000 s at a position".into(),
        "truth" => "truth exact, as a filter with full attitudes needs".into(),
        "drift_noise" => format!("random drift {}", c.drift_noise),
        "values" => {
            let of = scaled(c);
            format!("the paper's drifts{of} (D_F 11, 12, 13 deg/h, D_I D_O D_S 5 deg/h/g{rest})")
        }
        "priors" => match c.drift_scale == 1.0 {
            true => format!("priors (psi 0.1 deg, D_F 20 deg/h, D_I D_O D_S 10 deg/h/g{rest})"),
            false => {
                format!(
                    "priors (psi 0.1 deg; of drifts{}: D_F 20 deg/h, D_I D_O D_S 10 deg/h/g{rest})",
                    scaled(c)
                )
            }
        },
        "other_values" => "true values of the other unknowns".into(),
        "other_priors" => "priors of the other unknowns".into(),
        "azimuth_noise_deg" => "noise of the azimuth 0.001 deg".into(),
        other => other.to_string(),
    };
    let listed: Vec<String> = c.by_default.iter().filter(|key| !said.contains(key)).map(value).collect();
    (!listed.is_empty()).then(|| listed.join(", "))
}

/// True if the drifts of a run are not stated, so that they are those of the paper.
pub(crate) fn drifts_by_default(c: &ConditionsReport) -> bool {
    c.by_default.iter().any(|key| key == "values")
}

/// Factor on drifts such as ` times 0.001`; empty if it is one.
fn scaled(c: &ConditionsReport) -> String {
    if c.drift_scale == 1.0 { String::new() } else { format!(" times {}", c.drift_scale) }
}

/// Drifts of a run: the stated ones or the paper's, with the factor on them.
pub(crate) fn drifts(c: &ConditionsReport) -> String {
    match drifts_by_default(c) {
        true => format!("the drifts of the paper{} (11 to 13 deg/h; none are stated)", scaled(c)),
        false => "these drifts".into(),
    }
}

/// Conditions of predicted sigmas, one sentence each, in addition to that of [`predicted`].
pub(crate) fn measurement(m: &MeasurementReport) -> Vec<String> {
    let by = if m.latitude_by_default { " (chosen here: the scheme names none)" } else { "" };
    let azimuth = m.azimuth_noise_deg.map_or_else(String::new, |a| format!(", azimuth {a:e} deg per sample"));
    let slews = m.slew_rate_deg_s.map_or_else(
        || "repositioning at once unless a position says otherwise".into(),
        |r| {
            format!(
                "slews at {r} deg/s unless a position says otherwise, Z not used meanwhile (degrees, \
                 accuracy orders and ranks: of repositioning at once, with torquer errors of turns fast \
                 against the earth rate; what has a sigma: with the slews, in floating point)"
            )
        },
    );
    let mut out = vec![
        format!(
            "noise of Z {:e} g per sample and axis{azimuth}; steps of at most {} s, a sample after each",
            m.accelerometer_noise_g, m.step_s
        ),
        format!("{} s at a position unless it says otherwise, {slews}", m.dwell_s),
        format!("latitude {} deg{by}", m.latitude_deg),
    ];
    out.extend(m.settle_s.map(words::run::settle));
    out.extend(m.accelerometer_bias.as_ref().map(accelerometer_bias));
    out.extend(m.drift_noise.as_ref().map(|noise| format!("random drift {noise}")));
    out.extend(m.gyro_noise.as_ref().map(gyro_noise));
    out.extend(m.bench.as_deref().map(words::assumptions::bench));
    out.extend(m.prior.as_ref().map(|prior| format!("prior {prior} (deg, deg/h, ... as stated)")));
    out
}

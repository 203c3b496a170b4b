//! Formulas of Z and its derivatives at each position, and of the drift: (9), (10), (12).

use obsdeg_symbolic::{Job, Request, WorkerError};
use schemars::JsonSchema;
use serde::Serialize;

use super::ask::dynamics_text;
use super::print::stations;
use super::solver::Solver;
use super::turning::drift_derivative;
use crate::model::platform::{AZIMUTH, LOCAL_NAMES, PSI_EPS, local_output};
use crate::model::ring::{Ring, Text};
use crate::model::{ErrorSource, Platform};

/// Formula of Z or of one of its derivatives.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Formula {
    /// Label of the station; null for formulas that hold at every station.
    pub position: Option<String>,
    /// Left side of the formula, such as `Z1'`.
    pub left: String,
    /// Right side of the formula.
    pub right: String,
}

/// Reasons for the lack of formulas.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum FormulasError {
    /// Torquer errors are unknown: their turns have no symbols.
    #[error("no formulas of Z: those with torquer errors (GS, GM, GM3) are not written out")]
    Torquers,
    /// The platform turns with accelerometers among the unknowns: that case has no formulas.
    #[error("no formulas of Z: those with accelerometer errors of a platform that turns are not written out")]
    Turning,
    /// There is no symbolic engine.
    #[error("formulas of Z need the symbolic engine")]
    NoEngine,
    /// The symbolic engine failed.
    #[error("no formulas of Z: {0}")]
    Engine(WorkerError),
}

/// Formulas of Z, Z', Z'' in n, which all positions share, then of `psi^n` and `eps^n` of every position in
/// the unknowns, and of `eps^n'` where the platform turns.
///
/// # Errors
/// [`FormulasError`].
pub(crate) fn formulas(platform: &Platform, solver: &mut Solver<'_>) -> Result<Vec<Formula>, FormulasError> {
    if platform.scheme().unknowns.have(ErrorSource::Rate) {
        return Err(FormulasError::Torquers);
    }
    if platform.scheme().by_history() {
        return Err(FormulasError::Turning);
    }
    let mut out = shared_formulas(platform, solver)?;
    out.extend(position_formulas(platform, solver));
    Ok(out)
}

/// Highest order of the derivatives of Z.
const ORDER: usize = 2;

/// Formulas of Z and its derivatives in `psi^n` and `eps^n`, by the engine.
fn shared_formulas(platform: &Platform, solver: &mut Solver<'_>) -> Result<Vec<Formula>, FormulasError> {
    let observed = platform.observed();
    let locals = observed.locals();
    let zeros = solver.tables.zeros;
    let rate = |zero: bool, name: &str| if zero { "0".to_string() } else { name.to_string() };
    let mut dynamics = dynamics_text(&rate(zeros.w_n, "wN"), &rate(zeros.w_u, "wU"), observed, |i| {
        // the engine would read `psi_x^n` as a power
        let derivative = || LOCAL_NAMES[i - locals + 3].replace("^n", "_d");
        if i < locals { LOCAL_NAMES[i].replace("^n", "_n") } else { derivative() }
    });
    if !platform.scheme().rotates() {
        // eps^n is constant
        dynamics.equations[3..PSI_EPS].fill(Text.zero());
    }
    let worker = solver.worker().ok_or(FormulasError::NoEngine)?;
    let request = Request {
        symbols: vec!["wN".into(), "wU".into()],
        generators: vec![],
        angles: vec![],
        job: Job::Derive { dynamics, order: ORDER },
    };
    let (texts, _) = worker.ask(&request).map_err(FormulasError::Engine)?;
    let mut out = Vec::new();
    for (i, (component, _)) in local_output(&Text, observed).iter().enumerate() {
        let name = if *component == AZIMUTH { "Za".to_string() } else { format!("Z{component}") };
        for k in 0..=ORDER {
            let right = texts[i * (ORDER + 1) + k].replace("_n", "^n").replace("_d", "^n'");
            out.push(Formula { position: None, left: format!("{name}{}", "'".repeat(k)), right });
        }
    }
    Ok(out)
}

/// Formulas of `psi^n` and `eps^n` of every position in the unknowns, and of `eps^n'` where the platform
/// turns.
fn position_formulas(platform: &Platform, solver: &Solver<'_>) -> Vec<Formula> {
    let locals = platform.observed().locals();
    let text_point = solver.symbols().point(platform, "wN", "wU");
    let attitudes = text_point.attitudes.iter().zip(platform.scheme().stations());
    let slopes = attitudes.map(|(c, station)| -> Option<[Vec<String>; 3]> {
        let rows = drift_derivative(platform, &Text, c, station.turned?.axis);
        Some(rows.map(|row| row.iter().map(|t| solver.symbols().display(t)).collect()))
    });
    let first_d = platform.names().len() - platform.coefficients();
    let stations = stations(platform.scheme()).into_iter();
    let mut out = Vec::new();
    for ((station, block), slopes) in stations.zip(platform.blocks(&text_point)).zip(slopes) {
        let mut push = |left: String, right| {
            out.push(Formula { position: Some(station.label.clone()), left, right });
        };
        for (name, row) in LOCAL_NAMES[..locals].iter().zip(&block.rows) {
            let terms = row.iter().zip(&block.columns);
            let term =
                |(t, &c): (&String, &usize)| Text.mul(&solver.symbols().display(t), &platform.names()[c]);
            push((*name).into(), sum(terms.map(term)));
        }
        for (name, row) in LOCAL_NAMES[3..PSI_EPS].iter().zip(slopes.iter().flatten()) {
            let rate = station.rate.as_deref().unwrap_or_default();
            let names = &platform.names()[first_d..];
            let right = sum(row.iter().zip(names).map(|(t, d)| Text.mul(&Text.mul(t, &rate.to_string()), d)));
            push(format!("{name}'"), right);
        }
    }
    out
}

/// Sum of terms with their signs.
fn sum(terms: impl Iterator<Item = String>) -> String {
    let mut out = String::new();
    for term in terms.filter(|t| !Text.is_zero(t)) {
        let (negative, magnitude) = term.strip_prefix('-').map_or((false, term.as_str()), |m| (true, m));
        out.push_str(match (out.is_empty(), negative) {
            (true, true) => "-",
            (true, false) => "",
            (false, true) => " - ",
            (false, false) => " + ",
        });
        out.push_str(magnitude);
    }
    if out.is_empty() { Text.zero() } else { out }
}

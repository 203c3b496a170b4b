//! Z and its derivatives at each position, printed as formulas: (9), (10), (12), and the drift there.

use obsdeg_symbolic::{Job, Request};
use schemars::JsonSchema;
use serde::Serialize;

use super::ask::dynamics_text;
use super::solver::Solver;
use crate::degree::coefficient::linear_combination;
use crate::model::Platform;
use crate::model::platform::{LOCAL_NAMES, local_output};
use crate::model::ring::{Ring, Text};

/// One formula.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Formula {
    /// The position; null for formulas that hold at every position.
    pub position: Option<String>,
    /// Left side, such as `Z1'`.
    pub left: String,
    /// Right side.
    pub right: String,
}

/// The formulas of Z, Z', Z'' in n, which every position shares, then `psi^n` and `eps^n` of every
/// position in the unknowns.
///
/// # Errors
/// A sentence that says why there are none.
pub fn formulas(platform: &Platform, solver: &mut Solver<'_>) -> Result<Vec<Formula>, String> {
    let azimuth = platform.scheme().measured_azimuth;
    let zeros = solver.tables.zeros;
    let rate = |zero: bool, name: &str| if zero { "0".to_string() } else { name.to_string() };
    let dynamics = dynamics_text(&rate(zeros.w_n, "wN"), &rate(zeros.w_u, "wU"), azimuth, |i| {
        // `psi_x^n` is a power to the engine
        LOCAL_NAMES[i].replace("^n", "_n")
    });
    const ORDER: usize = 2;
    let text_point = solver.symbols().point(platform, "wN", "wU");
    let display: Vec<Vec<Vec<String>>> = platform
        .blocks(&text_point)
        .iter()
        .map(|b| b.rows.iter().map(|row| row.iter().map(|t| solver.symbols().display(t)).collect()).collect())
        .collect();
    let columns: Vec<Vec<usize>> = platform.blocks(&text_point).into_iter().map(|b| b.columns).collect();
    let worker = solver.worker().ok_or("formulas of Z need the symbolic engine")?;
    let request = Request {
        symbols: vec!["wN".into(), "wU".into()],
        generators: vec![],
        angles: vec![],
        job: Job::Derive { dynamics, order: ORDER },
    };
    let (texts, _) = worker.ask(&request).map_err(|e| format!("no formulas of Z: {e}"))?;
    let mut out = Vec::new();
    for (i, (component, _)) in local_output(&Text, azimuth).iter().enumerate() {
        let name = if *component == 2 { "Za".to_string() } else { format!("Z{component}") };
        for k in 0..=ORDER {
            let right = texts[i * (ORDER + 1) + k].replace("_n", "^n");
            out.push(Formula { position: None, left: format!("{name}{}", "'".repeat(k)), right });
        }
    }
    for ((station, rows), columns) in platform.scheme().stations().iter().zip(display).zip(columns) {
        for (name, row) in LOCAL_NAMES.iter().zip(rows) {
            let terms: Vec<String> = row
                .iter()
                .zip(&columns)
                .filter(|(t, _)| !Text.is_zero(t))
                .map(|(t, &c)| Text.mul(t, &platform.names()[c]))
                .collect();
            let mut right = String::new();
            for term in terms {
                let (negative, magnitude) =
                    term.strip_prefix('-').map_or((false, term.as_str()), |m| (true, m));
                right.push_str(match (right.is_empty(), negative) {
                    (true, true) => "-",
                    (true, false) => "",
                    (false, true) => " - ",
                    (false, false) => " + ",
                });
                right.push_str(magnitude);
            }
            let right = if right.is_empty() { linear_combination([]) } else { right };
            out.push(Formula { position: Some(station.name()), left: (*name).into(), right });
        }
    }
    Ok(out)
}

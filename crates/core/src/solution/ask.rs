//! Requests of the solver to the symbolic worker.

use obsdeg_exact::Radical;
use obsdeg_symbolic::{Dynamics, Job, Request, SubstitutionCheck, System, WorkerError, protocol::CheckTerm};

use super::local::ZTerm;
use super::problem::{LinearSystem, SystemOutputs};
use super::solve::{Contribution, TermKey, UsedRow};
use super::solver::{Functional, Solver};
use super::turning::drift_derivative;
use crate::degree::coefficient::{Number, Rates};
use crate::model::platform::{LOCAL, Observed, PSI_EPS, local_dynamics, local_output};
use crate::model::ring::{Ring, Text};
use crate::model::symbols::Symbols;

impl Solver<'_> {
    pub(super) fn request(&self, system: System, check: Option<SubstitutionCheck>) -> Request {
        Request {
            symbols: self.symbols.independent(),
            generators: self.symbols.generators(),
            angles: self.symbols.angle_names(),
            job: Job::Solve { system, check },
        }
    }

    pub(super) fn ask_for_outputs(&mut self, problem: &LinearSystem) -> Option<Vec<String>> {
        let request = self.request(problem.to_text(&self.text_or_none()?, &[]), None);
        Some(self.ask(&request)?.0)
    }

    /// Requests a formula; after one that exceeded the limit of work no other is requested.
    fn ask(&mut self, request: &Request) -> Option<(Vec<String>, bool)> {
        let answer = self.worker.as_deref_mut()?.ask(request);
        if matches!(answer, Err(WorkerError::OverLimit { .. })) {
            self.text.clear();
        }
        answer.ok()
    }

    fn text_or_none(&self) -> Option<Vec<Vec<String>>> {
        (!self.text.is_empty()).then(|| self.text.clone())
    }

    /// Numbers of the printed terms as text, solved and verified by the worker; `None` if there are none, or
    /// if the job failed.
    pub(super) fn ask_for_solution(
        &mut self,
        functional: &Functional,
        problem: &LinearSystem,
        used: &[UsedRow],
        plan: &[(TermKey, Vec<Contribution>)],
    ) -> Option<Vec<String>> {
        let text = self.text_or_none()?;
        let mut target = vec![(Text.zero(), Text.one()); self.platform.names().len()];
        for (column, c) in &functional.terms {
            let number = match &c.number {
                Number::Radical(r) => radical_text(r),
                Number::Text { raw, .. } => raw.clone(),
                Number::Decimal(_) => return None,
            };
            target[*column] = (number, rates_text(c.rates));
        }
        let numbers: Vec<String> = target.iter().map(|(n, _)| n.clone()).collect();
        let mut system = problem.to_text(&text, &numbers);
        // outputs: the printed terms
        system.outputs = plan
            .iter()
            .map(|(key, contributions)| {
                let mut row = vec![Text.zero(); used.len()];
                for c in contributions {
                    row[c.unknown] = Text.add(&row[c.unknown], &self.weight(&self.text_point, key, c));
                }
                row
            })
            .collect();
        debug_assert!(problem.outputs == SystemOutputs::Unknowns);
        let check = self.check(used, target);
        let request = self.request(system, Some(check));
        self.ask(&request).filter(|(_, verified)| *verified).map(|(texts, _)| texts)
    }

    fn check(&self, used: &[UsedRow], target: Vec<(String, String)>) -> SubstitutionCheck {
        let zeros = self.tables.zeros;
        let rate = |zero: bool, name: &str| if zero { "0".to_string() } else { name.to_string() };
        let observed = self.platform.observed();
        let components: Vec<usize> = local_output(&Text, observed).iter().map(|(c, _)| *c).collect();
        let state = |i: usize| format!("x_{i}");
        let unknown = |c: usize| format!("u_{c}");
        let first_d = self.platform.names().len() - self.platform.coefficients();
        let blocks = self.platform.blocks(&self.text_point).into_iter();
        let segments =
            blocks.zip(&self.stations).zip(&self.text_point.attitudes).map(|((block, station), c)| {
                let entry = |row: &[String]| -> String {
                    let names: Vec<String> = block.columns.iter().map(|&c| unknown(c)).collect();
                    Text.dot(row.iter().zip(&names))
                };
                let local = block.rows[..observed.locals()].iter().map(|row| entry(row));
                let moving: Vec<String> = match *station {
                    (position, Some(axis)) => drift_derivative(self.platform, &Text, c, axis)
                        .iter()
                        .map(|row| {
                            let names: Vec<String> = (0..row.len()).map(|k| unknown(first_d + k)).collect();
                            Text.mul(&Symbols::rate_of_turning(position), &Text.dot(row.iter().zip(&names)))
                        })
                        .collect(),
                    _ => vec![Text.zero(); 3],
                };
                local.chain(moving).collect()
            });
        let terms = used.iter().map(|u| {
            let observable = &self.tables.observables[u.row % self.tables.observables.len()];
            let station = self.tables.station(u.row);
            let term = |z: &ZTerm| {
                let mut factor = rates_text([u.rates[0] + z.rates[0], u.rates[1] + z.rates[1]]);
                if u.turns > 0 {
                    factor = format!("{factor}*{}", Symbols::rate_of_turning(self.stations[station].0));
                }
                CheckTerm {
                    factor: if z.sign < 0 { format!("-{factor}") } else { factor },
                    segment: station,
                    output: components.iter().position(|&c| c == z.component).unwrap_or(0),
                    order: z.order,
                }
            };
            observable.solution.iter().map(term).collect()
        });
        SubstitutionCheck {
            dynamics: dynamics_text(&rate(zeros.w_n, "wN"), &rate(zeros.w_u, "wU"), observed, state),
            unknowns: (0..self.platform.names().len()).map(unknown).collect(),
            segments: segments.collect(),
            terms: terms.collect(),
            target,
        }
    }
}

/// (8) and (9) as text, with names for the local unknowns and then for the derivatives of `eps^n`, which
/// changes while the platform turns.
pub(crate) fn dynamics_text(
    w_n: &str,
    w_u: &str,
    observed: Observed,
    state: impl Fn(usize) -> String,
) -> Dynamics {
    let locals = observed.locals();
    let states: Vec<String> = (0..locals + 3).map(state).collect();
    let row = |row: &[String; LOCAL]| Text.dot(row[..locals].iter().zip(&states));
    let dynamics = local_dynamics(&Text, &w_n.to_string(), &w_u.to_string());
    let mut equations: Vec<String> = dynamics[..locals].iter().map(row).collect();
    equations[3..PSI_EPS].clone_from_slice(&states[locals..]);
    equations.extend(vec![Text.zero(); 3]);
    Dynamics {
        equations,
        outputs: local_output(&Text, observed).iter().map(|(_, r)| row(r)).collect(),
        states,
    }
}

pub(super) fn radical_text(r: &Radical) -> String {
    r.to_string().replace("sqrt(6)", "r_2*r_3").replace("sqrt(2)", "r_2").replace("sqrt(3)", "r_3")
}

fn rates_text(rates: Rates) -> String {
    format!("wN^({})*wU^({})", rates[0], rates[1])
}

//! What the solver asks of the symbolic worker.

use obsdeg_exact::Radical;
use obsdeg_symbolic::{Check, Dynamics, Job, Request, System, WorkerError, protocol::CheckTerm};

use super::local::ZTerm;
use super::problem::{Outputs, Problem};
use super::solver::{Contribution, Functional, Key, Solver};
use crate::degree::coefficient::{Number, Rates};
use crate::model::platform::{LOCAL, local_dynamics, local_output};
use crate::model::ring::{Ring, Text};

impl Solver<'_> {
    pub(super) fn request(&self, system: System, check: Option<Check>) -> Request {
        Request {
            symbols: self.symbols.independent(),
            generators: self.symbols.generators(),
            angles: self.symbols.angle_names(),
            job: Job::Solve { system, check },
        }
    }

    pub(super) fn ask_for_outputs(&mut self, problem: &Problem) -> Option<Vec<String>> {
        let request = self.request(problem.to_text(&self.text_or_none()?, &[]), None);
        Some(self.ask(&request)?.0)
    }

    /// Asks for a formula; after one that was too much work no other is attempted.
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

    /// The numbers of the printed terms as text, solved and verified by the worker; `None` when there
    /// is none, or the job failed.
    pub(super) fn ask_for_solution(
        &mut self,
        functional: &Functional,
        problem: &Problem,
        support: &[usize],
        rates: &[Rates],
        plan: &[(Key, Vec<Contribution>)],
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
        let n = support.len();
        system.outputs = plan
            .iter()
            .map(|((_, component, azimuth, _, position), contributions)| {
                let mut row = vec![Text.zero(); n];
                for &(j, sign, in_n) in contributions {
                    let axis = self.axis_factor(&self.text_point, *position, *component, *azimuth, in_n);
                    row[j] = Text.add(&row[j], &if sign < 0 { Text.neg(&axis) } else { axis });
                }
                row
            })
            .collect();
        debug_assert!(problem.outputs == Outputs::Unknowns);
        let check = self.check(support, rates, target);
        let request = self.request(system, Some(check));
        self.ask(&request).filter(|(_, verified)| *verified).map(|(texts, _)| texts)
    }

    fn check(&self, support: &[usize], rates: &[Rates], target: Vec<(String, String)>) -> Check {
        let zeros = self.tables.zeros;
        let rate = |zero: bool, name: &str| if zero { "0".to_string() } else { name.to_string() };
        let azimuth = self.platform.scheme().measured_azimuth;
        let components: Vec<usize> = local_output(&Text, azimuth).iter().map(|(c, _)| *c).collect();
        let state = |i: usize| format!("x_{i}");
        let unknown = |c: usize| format!("u_{c}");
        let segments = self.platform.blocks(&self.text_point).into_iter().map(|block| {
            let entry = |row: &Vec<String>| -> String {
                let names: Vec<String> = block.columns.iter().map(|&c| unknown(c)).collect();
                Text.dot(row.iter().zip(&names))
            };
            block.rows.iter().map(entry).collect()
        });
        let terms = support.iter().zip(rates).map(|(&row, r)| {
            let observable = &self.tables.observables[row % self.tables.observables.len()];
            let term = |z: &ZTerm| {
                let factor = rates_text([r[0] + z.rates[0], r[1] + z.rates[1]]);
                CheckTerm {
                    factor: if z.sign < 0 { format!("-{factor}") } else { factor },
                    segment: self.tables.position(row),
                    output: components.iter().position(|&c| c == z.component).unwrap_or(0),
                    order: z.order,
                }
            };
            observable.solution.iter().map(term).collect()
        });
        Check {
            dynamics: dynamics_text(&rate(zeros.w_n, "wN"), &rate(zeros.w_u, "wU"), azimuth, state),
            unknowns: (0..self.platform.names().len()).map(unknown).collect(),
            segments: segments.collect(),
            terms: terms.collect(),
            target,
        }
    }
}

/// (8) and (9) as text, with names for the six local unknowns.
pub fn dynamics_text(w_n: &str, w_u: &str, azimuth: bool, state: impl Fn(usize) -> String) -> Dynamics {
    let states: Vec<String> = (0..LOCAL).map(state).collect();
    let row = |row: &[String; LOCAL]| Text.dot(row.iter().zip(&states));
    Dynamics {
        equations: local_dynamics(&Text, &w_n.to_string(), &w_u.to_string()).iter().map(row).collect(),
        outputs: local_output(&Text, azimuth).iter().map(|(_, r)| row(r)).collect(),
        states,
    }
}

fn radical_text(r: &Radical) -> String {
    r.to_string().replace("sqrt(6)", "r_2*r_3").replace("sqrt(2)", "r_2").replace("sqrt(3)", "r_3")
}

fn rates_text(rates: Rates) -> String {
    format!("wN^({})*wU^({})", rates[0], rates[1])
}

//! Numbers of solutions as a requirement: sets under which every required unknown has one solution.
//!
//! Another output never adds a solution: a set fails if a larger one leaves several, and fulfils the
//! requirement if a smaller one does.

use obsdeg_core::system::{Candidate, NumberOfSolutions, SystemModel, SystemOptions, analyze_system};

use super::cuts::members;
use super::ranks::Set;
use super::{SensorOptions, TargetUnknown};

/// Largest number of sets whose solutions are counted.
const COUNTED: usize = 300;

/// Sets whose numbers of solutions are known.
pub(crate) struct UniqueSolutions<'a> {
    model: &'a SystemModel,
    options: &'a SensorOptions,
    /// Required unknowns.
    pub(crate) required: Vec<TargetUnknown>,
    one: Vec<Set>,
    several: Vec<Set>,
    /// Sets under which the number of solutions of a required unknown is not decided, and of none several.
    undecided: Vec<Set>,
}

impl<'a> UniqueSolutions<'a> {
    pub(crate) fn new(model: &'a SystemModel, options: &'a SensorOptions) -> Self {
        let (required, one, several, undecided) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { model, options, required, one, several, undecided }
    }

    /// Numbers of solutions of unknowns under a set; `None` where it is not observable or not counted.
    pub(crate) fn numbers(&self, set: Set, of: &[TargetUnknown]) -> Vec<Option<NumberOfSolutions>> {
        let chosen: Vec<Candidate> = members(set).map(|c| self.options.candidates[c].clone()).collect();
        let (measuring, _) = self.model.measuring(&chosen, self.options.own_outputs);
        let wanted =
            SystemOptions { seed: self.options.seed, order: self.options.order, ..SystemOptions::default() };
        let Ok(found) = analyze_system(&measuring, wanted) else { return vec![None; of.len()] };
        let number = |u: &TargetUnknown| {
            let name = u.name_in(self.model, &measuring);
            found.quantities.iter().find(|q| q.name == name)?.number_of_solutions.clone()
        };
        of.iter().map(number).collect()
    }

    /// Numbers of solutions of unknowns under all candidates. A number that is not decided there is one if a
    /// set without one candidate leaves one solution.
    pub(crate) fn numbers_of_all(
        &mut self,
        all: Set,
        of: &[TargetUnknown],
    ) -> Vec<Option<NumberOfSolutions>> {
        let mut out = self.numbers(all, of);
        let is_open = |n: &Option<NumberOfSolutions>| matches!(n, Some(NumberOfSolutions::Undecided(_)));
        for left_out in members(all) {
            if !out.iter().any(is_open) {
                break;
            }
            let fewer = self.numbers(all & !(1 << left_out), of);
            for (own, fewer) in out.iter_mut().zip(fewer) {
                if is_open(own) && is_one(&fewer) {
                    *own = fewer;
                }
            }
        }
        out
    }

    /// Notes that all candidates leave one solution of every required unknown.
    pub(crate) fn one_under(&mut self, all: Set) {
        self.one.push(all);
    }

    /// True if every required unknown is known to have one solution under a set.
    pub(crate) fn holds(&self, set: Set) -> bool {
        self.one.iter().any(|own| own & !set == 0)
    }

    /// Counts the solutions under a set that makes every required unknown observable; false at the limit.
    pub(crate) fn count(&mut self, set: Set) -> bool {
        let fails = self.several.iter().any(|own| set & !own == 0) || self.undecided.contains(&set);
        if fails || self.holds(set) {
            return true;
        }
        if self.counted() >= COUNTED {
            return false;
        }
        let numbers = self.numbers(set, &self.required);
        match numbers.iter().all(is_one) {
            true => self.one.push(set),
            false if numbers.iter().any(|n| matches!(n, Some(NumberOfSolutions::Counted(2..)))) => {
                self.several.push(set);
            }
            false => self.undecided.push(set),
        }
        true
    }

    /// Number of sets whose solutions were counted.
    pub(crate) fn counted(&self) -> usize {
        self.one.len() + self.several.len() + self.undecided.len()
    }

    /// Number of sets under which the number of solutions is not decided.
    pub(crate) fn undecided(&self) -> usize {
        self.undecided.len()
    }
}

/// True if one solution is known.
pub(crate) fn is_one(number: &Option<NumberOfSolutions>) -> bool {
    matches!(number, Some(NumberOfSolutions::OneByExpression | NumberOfSolutions::Counted(1)))
}

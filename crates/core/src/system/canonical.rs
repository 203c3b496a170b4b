//! Canonical text of everything that a model's verdicts depend on: input for the choice of primes.

use obsdeg_exact::SplitMix64;

use super::model::{Constant, KnownInput, PlacedExpression, StartTime, StateStart, SystemModel};

impl SystemModel {
    /// Random stream of `seed` for one purpose and this model ([`SplitMix64::of`]). It depends on the whole
    /// model except for what changes no verdict: the name of the model, units, descriptions, numbers of a
    /// simulation.
    pub fn random(&self, seed: u64, purpose: &str) -> SplitMix64 {
        SplitMix64::of(seed, purpose, &self.canonical())
    }

    /// Canonical parts of the model, lists with their length: the same for the same model, whatever file it
    /// came from.
    fn canonical(&self) -> Vec<String> {
        let mut out: Vec<String> = vec!["model".into()];
        self.list_quantities(&mut out);
        list_formulas(&mut out, self.definitions.iter().map(|(name, f)| (name, f)));
        list_formulas(&mut out, self.outputs.iter().map(|(named, f)| (&named.name, f)));
        count(&mut out, self.experiments);
        self.list_changes(&mut out);
        match self.time {
            StartTime::Zero => {}
            StartTime::At { mantissa, decimals } => {
                out.extend(["time".into(), format!("{mantissa}e-{decimals}")])
            }
            StartTime::Generic => out.extend(["time".into(), "generic".into()]),
        }
        if !self.constraints.is_empty() {
            out.push("constraints".into());
            out.extend(self.constraints.iter().map(text));
            out.extend(self.factors.iter().flat_map(|w| [w.constraint.clone(), w.factor.clone()]));
        }
        out
    }

    /// States, parameters, inputs and constants.
    fn list_quantities(&self, out: &mut Vec<String>) {
        count(out, self.states.len());
        for s in &self.states {
            let start = match &s.start {
                StateStart::Unknown => "unknown".into(),
                StateStart::Known => "known".into(),
                StateStart::Value(f) => format!("={}", text(f)),
            };
            out.extend([s.named.name.clone(), text(&s.equation), start]);
        }
        count(out, self.parameters.len());
        out.extend(self.parameters.iter().map(|p| p.name.clone()));
        count(out, self.known_inputs.len());
        for (named, input) in &self.known_inputs {
            out.extend([named.name.clone(), kind_of(input)]);
        }
        count(out, self.unknown_inputs.len());
        for (named, degree) in &self.unknown_inputs {
            let kind = degree.map_or_else(|| "arbitrary".into(), |d| format!("polynomial {d}"));
            out.extend([named.name.clone(), kind]);
        }
        count(out, self.constants.len());
        for (named, constant) in &self.constants {
            let value = match constant {
                Constant::Generic => "generic".into(),
                Constant::Value(f) => format!("={}", text(f)),
            };
            out.extend([named.name.clone(), value]);
        }
    }

    /// Segments, combinations, and the differences of the experiments.
    fn list_changes(&self, out: &mut Vec<String>) {
        count(out, self.segments.len());
        for s in &self.segments {
            list_formulas(out, s.constants.iter().map(|(name, f)| (name, f)));
            list_formulas(out, s.carry.iter().map(|(name, f)| (name, f)));
        }
        out.extend(self.combinations.iter().map(text));
        for own in &self.own {
            out.push("experiment".into());
            list_formulas(out, own.constants.iter().map(|(name, f)| (name, f)));
            count(out, own.known_inputs.len());
            out.extend(own.known_inputs.iter().flat_map(|(name, input)| [name.clone(), kind_of(input)]));
        }
    }
}

fn text(f: &PlacedExpression) -> String {
    f.text.trim().to_string()
}

fn count(out: &mut Vec<String>, n: usize) {
    out.push(n.to_string());
}

fn kind_of(input: &KnownInput) -> String {
    match input {
        KnownInput::Generic => "generic".into(),
        KnownInput::Polynomial(degree) => format!("polynomial {degree}"),
        KnownInput::Function(f) => format!("={}", text(f)),
    }
}

/// Appends the number of formulas, then their names and texts.
fn list_formulas<'a>(
    out: &mut Vec<String>,
    list: impl ExactSizeIterator<Item = (&'a String, &'a PlacedExpression)>,
) {
    count(out, list.len());
    out.extend(list.flat_map(|(name, f)| [name.clone(), text(f)]));
}

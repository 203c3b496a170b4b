//! First lines: for `analyze` the answer in one sentence, with remedies for unknowns that are not observable;
//! for `compare` the position to drop.

use obsdeg_core::analysis::Analysis;
use obsdeg_core::degree::Status;
use obsdeg_core::remedies::{Change, Remedies, Remedy};
use obsdeg_core::system::{NumberOfSolutions, SystemAnalysis};
use obsdeg_evidence::compare::{ComparedScheme, DropOne};
use obsdeg_evidence::requirements::Worst;

use crate::stated::worst_sigma;
use crate::words::names;

/// Largest factor of a sigma that counts as no growth.
const SAME: f64 = 1.001;
/// Factor up to which a larger figure is worth a position less, where no requirement decides.
const LITTLE: f64 = 1.25;

/// First line of `compare` for one scheme: the position to drop, or that none can be dropped.
pub(crate) fn position_to_drop(r: &ComparedScheme) -> Option<String> {
    if r.drop_one.len() < 2 {
        return None;
    }
    let met = r.requirements.stated > 0 && r.requirements.all_met();
    // without a position, psi of single positions is numbered anew
    let count = |r: &obsdeg_evidence::requirements::Requirements| {
        r.missed.iter().filter(|m| !m.name.contains('@')).count()
    };
    let keeps = |d: &&DropOne| d.lost.is_empty() && count(&d.requirements) <= count(&r.requirements);
    let sigma = |d: &DropOne| d.worst.as_ref().map_or(f64::INFINITY, |w| w.sigma_dph);
    let best = r.drop_one.iter().filter(keeps).min_by(|x, y| sigma(x).total_cmp(&sigma(y)));
    let Some(d) = best else {
        let nothing = match r.drop_one.iter().all(|d| !d.lost.is_empty()) {
            true => "an unknown is not observable any more",
            false => "an unknown is not observable any more, or a requirement is missed",
        };
        return Some(format!("Drop no position: without any one of them {nothing}"));
    };
    let kept = match met {
        true => "every unknown stays observable and every requirement met",
        false if r.requirements.stated > 0 => {
            "nothing observable is lost and no more requirements are missed"
        }
        false => "nothing observable is lost",
    };
    let what = if r.conditions.bench.is_some() { "total uncertainty" } else { "predicted sigma" };
    let grows = |now: &Worst, then: &Worst| {
        let [now, then] = [now, then].map(worst_sigma);
        format!("the largest {what} of a coefficient grows from {now} to {then}")
    };
    Some(match (&r.worst, &d.worst) {
        (Some(now), Some(then)) if then.sigma_dph <= now.sigma_dph * SAME => {
            format!("Drop {}: {kept}, and the largest {what} of a coefficient does not grow", d.position)
        }
        (Some(now), Some(then)) if met || then.sigma_dph <= now.sigma_dph * LITTLE => {
            format!("You can drop {}: {kept}; {}", d.position, grows(now, then))
        }
        (Some(now), Some(then)) => {
            format!("Keep all positions: without {}, which costs least, {}", d.position, grows(now, then))
        }
        _ => format!("Drop {}: {kept}", d.position),
    })
}

/// The answer on a scheme, then a line for each group of unknowns that is not observable.
pub(crate) fn of_scheme(a: &Analysis) -> Vec<String> {
    let all = a.quantities.iter().map(|q| (q.name.as_str(), q.degree)).collect();
    let mut answer = UnknownDegrees { all, constrained: false, discrete: false }.answer(&a.to_resolve, "");
    let lost = a.quantities.iter().filter(|q| q.degree.is_some() && q.accuracy_order.is_none());
    let lost: Vec<&str> = lost.filter(|_| a.has_accuracy_orders).map(|q| q.name.as_str()).collect();
    if !lost.is_empty() {
        answer.push_str(&format!("; not with dwell: {}", names(lost)));
    }
    std::iter::once(answer).chain(to_resolve_in_scheme(a)).collect()
}

/// Lines *To resolve* of a scheme.
pub(crate) fn to_resolve_in_scheme(a: &Analysis) -> Vec<String> {
    let others = match a.terms == "drift" {
        true => "no other known value",
        false => "no other known value, cardinal attitude or carry",
    };
    let two = if a.terms == "drift" { "two values" } else { "two attitudes or values" };
    lines(&a.to_resolve, others, two, a.quantities.iter().map(|q| q.name.as_str()))
}

/// The answer on a model, then a line for each group of unknowns that is not observable.
pub(crate) fn of_model(a: &SystemAnalysis) -> Vec<String> {
    let all = a.quantities.iter().map(|q| (q.name.as_str(), q.degree)).collect();
    let unproven = a.quantities.iter().any(|q| q.status == Status::NotSeen);
    let upto = if unproven { format!(" up to order {}", a.last_order) } else { String::new() };
    let mut answer = UnknownDegrees { all, constrained: !a.constraints.is_empty(), discrete: a.discrete }
        .answer(&a.to_resolve, &upto);
    let several = a.quantities.iter().filter_map(|q| match q.number_of_solutions {
        Some(NumberOfSolutions::Counted(k)) if k > 1 => Some(q.name.as_str()),
        _ => None,
    });
    let several: Vec<&str> = several.collect();
    if !several.is_empty() {
        answer.push_str(&format!("; several solutions: {}", names(several)));
    }
    // without a number of solutions they are determined near a generic point only
    let open = a.quantities.iter().filter(|q| {
        q.degree.is_some() && matches!(q.number_of_solutions, None | Some(NumberOfSolutions::Undecided(_)))
    });
    let open: Vec<&str> = open.map(|q| q.name.as_str()).collect();
    let counted = a.quantities.iter().any(|q| q.number_of_solutions.is_some());
    match (open.is_empty(), counted) {
        (true, _) => {}
        (false, true) => {
            answer.push_str(&format!("; locally, number of solutions not decided: {}", names(open)))
        }
        (false, false) => answer.push_str("; locally: solutions are not counted"),
    }
    std::iter::once(answer).chain(to_resolve_in_model(a)).collect()
}

/// Lines *To resolve* of a model.
pub(crate) fn to_resolve_in_model(a: &SystemAnalysis) -> Vec<String> {
    let others = "no other known value and no state as an output";
    lines(&a.to_resolve, others, "two values or two outputs", a.quantities.iter().map(|q| q.name.as_str()))
}

/// All unknowns with their degrees.
struct UnknownDegrees<'a> {
    all: Vec<(&'a str, Option<usize>)>,
    /// True if constraints on the unknowns add to the outputs.
    constrained: bool,
    /// True if degrees count steps.
    discrete: bool,
}

impl UnknownDegrees<'_> {
    /// Sentence such as `gamma is determined; S, I are not: know one of them`.
    fn answer(&self, remedies: &Remedies, upto: &str) -> String {
        let of = |seen: bool| self.all.iter().filter(move |q| q.1.is_some() == seen).map(|q| q.0);
        let (seen, open): (Vec<&str>, Vec<&str>) = (of(true).collect(), of(false).collect());
        let all = self.all.len();
        if open.is_empty() {
            let order = self.all.iter().filter_map(|q| q.1).max().unwrap_or(0);
            let subject = match seen[..] {
                [one] => format!("{one} is determined"),
                [_, _] => "Both unknowns are determined".into(),
                _ => format!("All {all} unknowns are determined"),
            };
            let from = if self.constrained { "the outputs and the constraints" } else { "the outputs" };
            return match order {
                0 => format!("{subject} by {from} themselves"),
                k if self.discrete => format!("{subject} with outputs up to t+{k}"),
                k => format!("{subject} with derivatives up to order {k}"),
            };
        }
        let tail = whole(remedies, &open).map_or_else(String::new, |text| format!(": {text}"));
        let not = format!("{} {} not{upto}{tail}", names(open.iter().copied()), verb(open.len()));
        match seen.len() {
            0 if open.len() == 1 => format!("{} is not determined{upto}{tail}", open[0]),
            0 => format!("None of the {all} unknowns is determined{upto}{tail}"),
            n @ 1..=3 => format!("{} {} determined; {not}", names(seen), verb(n)),
            n => format!("{n} of {all} unknowns are determined; {not}"),
        }
    }
}

fn verb(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}

/// Change of a remedy with a single one; `None` for two.
fn single(r: &Remedy) -> Option<&Change> {
    match &r.changes[..] {
        [one] => Some(one),
        _ => None,
    }
}

/// True if a remedy resolves an unknown.
fn resolves(r: &Remedy, name: &str) -> bool {
    r.resolves.iter().any(|x| x.name == name)
}

/// Alternatives of single changes that resolve all of `open`, without changes of the carry.
fn whole(remedies: &Remedies, open: &[&str]) -> Option<String> {
    let settles = |r: &&Remedy| {
        let given = single(r).and_then(Change::known);
        open.iter().all(|name| given == Some(name) || resolves(r, name))
    };
    let mut group = RemedyGroup { names: open.to_vec(), ..RemedyGroup::default() };
    for r in remedies.remedies.iter().filter(settles) {
        match single(r) {
            Some(Change::Known { name }) => group.known.push(name),
            Some(Change::Output { state }) => group.outputs.push(state),
            Some(Change::Attitude { .. }) if group.attitude.is_none() => group.attitude = Some(r),
            _ => {}
        }
    }
    group.known.sort_unstable();
    group.outputs.sort_unstable();
    let parts = group.parts();
    (open.len() > 1 && !parts.is_empty()).then(|| either(&parts))
}

/// `a, b or c`.
fn either(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

/// Unknowns that the same changes resolve, with these changes.
#[derive(Default)]
struct RemedyGroup<'a> {
    names: Vec<&'a str>,
    known: Vec<&'a str>,
    outputs: Vec<&'a str>,
    attitude: Option<&'a Remedy>,
    carries: Vec<&'a Remedy>,
    two: Option<&'a Remedy>,
    /// True if each becomes observable only as an output of its own.
    themselves: bool,
}

impl<'a> RemedyGroup<'a> {
    /// The remedies of one unknown.
    fn of(remedies: &'a Remedies, name: &'a str) -> Self {
        let mut group = Self { names: vec![name], ..Self::default() };
        for r in remedies.remedies.iter().filter(|r| resolves(r, name)) {
            match single(r) {
                Some(Change::Known { name }) => group.known.push(name),
                Some(Change::Output { state }) => group.outputs.push(state),
                Some(Change::Attitude { .. }) => group.attitude = group.attitude.or(Some(r)),
                Some(Change::Carry { .. }) => group.carries.push(r),
                None => group.two = group.two.or(Some(r)),
            }
        }
        if group.settled() || !group.carries.is_empty() {
            group.two = None;
        }
        // of unknowns that determine each other, each is listed
        let tried = remedies.remedies.iter().filter_map(single).filter_map(Change::known).any(|w| w == name);
        if tried && !group.known.is_empty() {
            group.known.push(name);
        }
        group.known.sort_unstable();
        group.outputs.sort_unstable();
        if group.outputs == [name] && group.known.is_empty() && group.attitude.is_none() {
            group.outputs.clear();
            group.themselves = true;
        }
        group
    }

    /// Adds an unknown with the same remedies apart from the carry; false if its remedies differ.
    fn join(&mut self, other: &Self) -> bool {
        let same = (&self.known, &self.outputs, self.attitude, self.two, self.themselves)
            == (&other.known, &other.outputs, other.attitude, other.two, other.themselves)
            && (self.settled() || self.carries == other.carries);
        if same {
            self.names.extend(&other.names);
            let more = other.carries.iter().filter(|r| !self.carries.contains(r)).collect::<Vec<_>>();
            self.carries.extend(more);
        }
        same
    }

    /// True if one change other than the carry is enough.
    fn settled(&self) -> bool {
        !self.known.is_empty() || !self.outputs.is_empty() || self.attitude.is_some() || self.themselves
    }

    /// The alternatives in words.
    fn parts(&self) -> Vec<String> {
        let one_of = |list: &[&str]| {
            // for a single unknown, its own value is no remedy worth naming
            let own = |name: &&str| list.len() > 1 && self.names == [*name];
            let others: Vec<&str> = list.iter().copied().filter(|name| !own(name)).collect();
            match others[..] {
                [one] if self.names == [one] => "it".to_string(),
                [one] => one.to_string(),
                _ if others.len() == self.names.len() && others.iter().all(|n| self.names.contains(n)) => {
                    "one of them".into()
                }
                _ => format!("one of {}", names(others)),
            }
        };
        let mut out = Vec::new();
        if !self.known.is_empty() && self.known == self.outputs {
            out.push(format!("know or measure {}", one_of(&self.known)));
        } else {
            out.extend((!self.known.is_empty()).then(|| format!("know {}", one_of(&self.known))));
            out.extend((!self.outputs.is_empty()).then(|| format!("measure {}", one_of(&self.outputs))));
        }
        if self.themselves {
            out.push(format!("measure {}", if self.names.len() == 1 { "it" } else { "each of them" }));
        }
        out.extend(self.attitude.map(|r| changes(&r.changes)));
        out.extend(self.carries.iter().map(|r| {
            let resolved: Vec<&str> = self.names.iter().copied().filter(|name| resolves(r, name)).collect();
            let of = match resolved.len() == self.names.len() {
                true => String::new(),
                false => format!("for {} ", names(resolved)),
            };
            let without = match r.loses.is_empty() {
                true => String::new(),
                false => format!(" (which loses {})", names(r.loses.iter().map(String::as_str))),
            };
            format!("{of}{}{without}", changes(&r.changes))
        }));
        out.extend(self.two.map(|r| changes(&r.changes)));
        out
    }

    /// Highest degree by these remedies, and true if all give that degree.
    fn degrees(&self, remedies: &Remedies) -> Option<(usize, bool)> {
        let shown = |r: &&Remedy| match single(r) {
            Some(Change::Known { name }) => self.known.contains(&name.as_str()),
            Some(Change::Output { state }) => {
                self.outputs.contains(&state.as_str())
                    || self.themselves && self.names.contains(&state.as_str())
            }
            Some(Change::Attitude { .. }) => self.attitude == Some(*r),
            Some(Change::Carry { .. }) => self.carries.contains(r),
            None => self.two == Some(*r),
        };
        let resolved = remedies.remedies.iter().filter(shown).flat_map(|r| &r.resolves);
        let degrees: Vec<usize> =
            resolved.filter(|x| self.names.contains(&x.name.as_str())).map(|x| x.degree).collect();
        let most = *degrees.iter().max()?;
        Some((most, degrees.iter().all(|d| *d == most)))
    }
}

/// Changes that are made together, in the imperative: `add a position NWU and one USE`. Added positions have
/// no numbers, since lines are alternatives.
pub(crate) fn changes(list: &[Change]) -> String {
    let mut before = "";
    let mut one = |c: &Change| {
        let (verb, what) = match c {
            Change::Known { name } => ("know ", name.clone()),
            Change::Output { state } => ("measure ", state.clone()),
            Change::Attitude { attitude, .. } if before == "add " => ("add ", format!("one {attitude}")),
            Change::Attitude { attitude, .. } => ("add ", format!("a position {attitude}")),
            Change::Carry { carry } => ("take ", format!("{carry} carry")),
        };
        let said = if verb == before { "" } else { verb };
        before = verb;
        format!("{said}{what}")
    };
    list.iter().map(&mut one).collect::<Vec<_>>().join(" and ")
}

/// A line for each group of unknowns that the same changes resolve, in the order of the unknowns. `others`
/// and `two` name the changes that were tried.
fn lines<'a>(
    remedies: &'a Remedies,
    others: &str,
    two: &str,
    unknowns: impl Iterator<Item = &'a str>,
) -> Vec<String> {
    let mut groups: Vec<RemedyGroup<'a>> = Vec::new();
    let resolved = |name: &str| remedies.remedies.iter().any(|r| resolves(r, name));
    for name in unknowns.filter(|name| resolved(name)) {
        let group = RemedyGroup::of(remedies, name);
        if !groups.iter_mut().any(|g| g.join(&group)) {
            groups.push(group);
        }
    }
    let line = |g: &RemedyGroup<'_>| {
        let degree = match g.degrees(remedies) {
            Some((k, true)) => format!("; degree {k}"),
            Some((k, false)) => format!("; degree at most {k}"),
            None => String::new(),
        };
        format!("To resolve {}: {}{degree}", names(g.names.iter().copied()), either(&g.parts()))
    };
    let mut out: Vec<String> = groups.iter().map(line).collect();
    if !remedies.unresolved.is_empty() {
        let (know, them) = match remedies.unresolved.len() {
            1 => ("know it", "it"),
            _ => ("know each of them", "one of them"),
        };
        let why = match remedies.not_tried.is_empty() {
            true => format!("{others} resolves {them}, nor do {two}"),
            false => format!("nothing that was tried resolves {them}"),
        };
        out.push(format!(
            "To resolve {}: {know}; {why}",
            names(remedies.unresolved.iter().map(String::as_str))
        ));
    }
    out.extend(remedies.not_tried.iter().map(|text| format!("Not tried: {text}")));
    out
}

//! Sets of outputs of a model.

use obsdeg_core::system::NumberOfSolutions;
use obsdeg_design::sensors::{CountedSets, FrontSet, SensorUnknown, Sensors, Unattainable};

use crate::Answer;
use crate::document::{Document, DocumentBlock, left, right};
use crate::stated::capital;
use crate::words;

/// Largest number of candidates in the groups of a printed proof.
const MEMBERS: usize = 24;

/// Number with the word that it counts: `1 output`, `2 outputs`.
fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Outputs of a set, counted, with the experiment if it is one of them.
fn counted(s: &Sensors, outputs: &[String]) -> String {
    let experiment = |name: &&String| s.candidates.iter().any(|c| c.experiment && c.name == **name);
    match outputs.iter().filter(experiment).count() {
        0 => count(outputs.len(), "output"),
        more => format!("{} and {more} more experiment", count(outputs.len() - more, "output")),
    }
}

/// Outputs of a set.
pub(crate) fn set(outputs: &[String]) -> String {
    match outputs.is_empty() {
        true => "none".into(),
        false => outputs.join(", "),
    }
}

/// Cost without trailing zeros.
fn cost(cost: f64) -> String {
    let text = format!("{cost:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// True if a cost differs from one.
pub(crate) fn has_costs(s: &Sensors) -> bool {
    s.candidates.iter().any(|c| c.cost != 1.0)
}

/// Cost of a set in words: `2 outputs`, `cost 2.5`.
fn price(s: &Sensors, f: &FrontSet) -> String {
    match has_costs(s) {
        true => format!("cost {}", cost(f.cost)),
        false => counted(s, &f.outputs),
    }
}

/// Unknowns that the sets make observable: `all 34 unknowns`, `k1, k2`.
pub(crate) fn about(s: &Sensors) -> String {
    let (required, all) = (s.required.len(), s.quantities.len());
    match required {
        n if n == all => format!("all {}", count(n, "unknown")),
        n if n <= 6 => words::names(s.required.iter().map(String::as_str)),
        n => format!("{n} of {all} unknowns"),
    }
}

/// Sentences, the answer first.
fn sentences(s: &Sensors) -> Vec<String> {
    let mut out = Vec::new();
    if let Some(first) = s.front.first() {
        let makes = if first.outputs.len() == 1 || has_costs(s) { "makes" } else { "make" };
        let price = price(s, first);
        let beside = if s.own_outputs.is_empty() { "" } else { " beside the outputs of the model" };
        out.push(match first.outputs.is_empty() {
            true => format!(
                "The outputs of the model make {} observable without another one, with degree {}",
                about(s),
                first.degree
            ),
            false => format!(
                "{}{beside} {makes} {} observable, with degree {}: {}",
                capital(&price),
                about(s),
                first.degree,
                set(&first.outputs)
            ),
        });
    } else {
        let reason = if s.required.is_empty() { "" } else { ": the search ended before a set was found" };
        let none = match s.one_solution {
            None => "No set of the candidates makes an unknown that was asked for observable",
            Some(_) => "No set of the candidates leaves one solution of an unknown that was asked for",
        };
        out.push(if reason.is_empty() {
            none.into()
        } else {
            format!("No set of the candidates was found{reason}")
        });
    }
    let gives = if has_costs(s) { "gives" } else { "give" };
    for pair in s.front.windows(2) {
        out.push(format!(
            "{} {gives} degree {}: {}",
            capital(&price(s, &pair[1])),
            pair[1].degree,
            set(&pair[1].outputs)
        ));
    }
    if !s.unattainable.is_empty() {
        let word = |u: &Unattainable| match (u.degree, &u.number_of_solutions) {
            (_, Some(NumberOfSolutions::Counted(k))) => {
                format!("{} ({k} solutions with all candidates)", u.name)
            }
            (_, Some(_)) => format!("{} (number of solutions not decided with all candidates)", u.name),
            (Some(k), None) => format!("{} (degree {k} with all candidates)", u.name),
            (None, None) => format!("{} (not observable with all candidates)", u.name),
        };
        let list: Vec<String> = s.unattainable.iter().map(word).collect();
        out.push(format!("No set of the candidates reaches {}", list.join(", ")));
    }
    out
}

/// Proof that a set of the front is the cheapest.
fn proof(s: &Sensors, f: &FrontSet) -> String {
    let asked = match s.max_degree.is_empty() {
        true => String::new(),
        false => format!(" within the largest degrees asked for ({})", s.max_degree.join(", ")),
    };
    let goal = match f.below {
        Some(below) => format!("with degrees of at most {below}{asked}"),
        None => format!(
            "that {}{asked}",
            s.one_solution.as_ref().map_or("makes them observable", |_| "leaves one solution")
        ),
    };
    let (mut shown, mut members) = (Vec::new(), 0);
    for group in &f.one_of_each {
        members += group.len();
        if members > MEMBERS && !shown.is_empty() {
            break;
        }
        shown.push(format!("{{{}}}", group.join(", ")));
    }
    let more = f.one_of_each.len() - shown.len();
    let more = match more {
        0 => String::new(),
        n => format!(" and {} more (--format json)", count(n, "group")),
    };
    let judged = match f.examined {
        0 => String::new(),
        n => format!("; the {} of this kind that cost less fail one by one", count(n, "set")),
    };
    let undecided = match &s.one_solution {
        Some(CountedSets { undecided: 1.., .. }) => {
            "; a set with a number of solutions that is not decided counts as failing, which proves nothing about it"
        }
        _ => "",
    };
    match shown.is_empty() {
        true => format!("{}: nothing is cheaper", price(s, f)),
        false => format!(
            "{}: every set {goal} contains a candidate of {}{more}, because all candidates outside any of \
             these groups fail together{judged}{undecided}",
            price(s, f),
            shown.join(", of ")
        ),
    }
}

/// Conditions and limits of the answer.
fn validity(s: &Sensors) -> Vec<String> {
    let mut out = Vec::new();
    out.extend(s.stopped.as_ref().map(|reason| format!("the search ended early: {reason}")));
    out.push(completeness(s));
    let idle: Vec<&str> = s.candidates.iter().filter(|c| !c.tells).map(|c| c.name.as_str()).collect();
    if !idle.is_empty() {
        let verb = if idle.len() == 1 { "depends" } else { "depend" };
        out.push(format!("{} {verb} on no unknown: measuring adds nothing to any set", idle.join(", ")));
    }
    out.extend(s.one_solution.as_ref().map_or_else(Vec::new, counted_solutions));
    if !s.closed {
        out.push(format!(
            "derivatives of some outputs are computed up to order {} without a proven end: \
             \"not observable\" means up to this order",
            s.last_order
        ));
    }
    out.push(format!(
        "{}; {} judged again by `analyze`: the same degrees; seed {}",
        certainty(s),
        count(s.confirmed_sets, "set"),
        s.seed
    ));
    out
}

/// Sentence on the number of minimal sets.
fn completeness(s: &Sensors) -> String {
    match (s.minimal_sets, s.complete_to) {
        (Some(n), _) => format!(
            "{}: every set that makes {} observable contains one of them, because an additional output \
             never raises a degree",
            count(n, "minimal set"),
            about(s)
        ),
        (None, Some(most)) if most > 0 => format!(
            "at least {}: those of up to {} are all found, larger ones are not",
            count(s.minimal_sets_found, "minimal set"),
            count(most, "output")
        ),
        _ => "minimal sets were not searched".into(),
    }
}

/// Sentences on the number of solutions under the sets.
fn counted_solutions(sets: &CountedSets) -> Vec<String> {
    let CountedSets { counted, undecided } = sets;
    let mut out = vec![format!(
        "one solution of every required unknown is required: solutions under {} counted as `analyze` counts them",
        count(*counted, "set")
    )];
    if *undecided > 0 {
        out.push(format!(
            "under {} the number of solutions is not decided; these sets count as failing, so that a cheaper \
             one may leave one solution",
            count(*undecided, "set")
        ));
    }
    out
}

/// Sentence on the certainty of the degrees.
fn certainty(s: &Sensors) -> String {
    match (s.error_bound, s.digits) {
        (Some(bound), _) => format!(
            "degrees under {} by ranks at a random point, those of the {} that this answer rests on at a \
             second one too; one of these is {}",
            count(s.judged_sets, "set"),
            s.relied_on_sets,
            words::wrong_below(bound)
        ),
        _ => format!(
            "degrees under {} by ranks of real numbers at a random point, those of the {} that this answer \
             rests on at a second one too; no probability belongs to them",
            count(s.judged_sets, "set"),
            s.relied_on_sets
        ),
    }
}

fn unknown_row(u: &SensorUnknown) -> Vec<String> {
    let outputs = u.cheapest.as_ref().map_or_else(|| "-".into(), |c| set(&c.outputs));
    let degree = words::degree(u.cheapest.as_ref().map(|c| c.degree));
    vec![u.name.clone(), outputs, degree, words::degree(u.least_degree)]
}

/// Table of each candidate alone; with its cost if costs differ.
fn each_alone(s: &Sensors, costs: bool) -> DocumentBlock {
    let rows = s.candidates.iter().map(|c| {
        let mut row = vec![c.name.clone()];
        row.extend(costs.then(|| cost(c.cost)));
        row.extend([format!("{} of {}", c.observable, s.required.len()), words::degree(c.degree)]);
        row
    });
    let mut header = vec![left("candidate")];
    header.extend(costs.then(|| right("cost")));
    header.extend([right("observable"), right("degree")]);
    DocumentBlock::table("Each candidate alone", header, rows)
}

impl Answer for Sensors {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let costs = has_costs(self);
        let of_set = |outputs: &[String], price: f64, degree: usize| {
            let mut row = vec![outputs.len().to_string()];
            row.extend(costs.then(|| cost(price)));
            row.extend([degree.to_string(), set(outputs)]);
            row
        };
        let columns = || {
            let mut columns = vec![right("outputs")];
            columns.extend(costs.then(|| right("cost")));
            columns.extend([right("degree"), left("set")]);
            columns
        };
        let mut blocks = Vec::new();
        if !self.front.is_empty() {
            let rows = self.front.iter().map(|f| of_set(&f.outputs, f.cost, f.degree));
            let name = if costs { "Cost against degree" } else { "Outputs against degree" };
            blocks.push(DocumentBlock::table(name, columns(), rows));
            blocks.push(DocumentBlock::list(
                "Nothing cheaper",
                self.front.iter().map(|f| proof(self, f)).collect(),
            ));
        }
        if !self.sets.is_empty() {
            let all = self.minimal_sets.is_some_and(|n| n == self.sets.len());
            let heading = match (all, self.minimal_sets) {
                (true, _) => "Minimal sets".to_string(),
                (false, Some(n)) => format!("The first {} of {n} minimal sets", self.sets.len()),
                (false, None) => format!("The first {} minimal sets", self.sets.len()),
            };
            let rows = self.sets.iter().map(|s| of_set(&s.outputs, s.cost, s.degree));
            blocks.push(DocumentBlock::table(heading, columns(), rows));
        }
        let rows = self.quantities.iter().map(unknown_row);
        let header = [left("unknown"), left("cheapest set"), right("degree"), right("degree with all")];
        let name = match self.one_solution {
            None => "Cheapest set of each unknown",
            Some(_) => "Cheapest set that makes each unknown observable, with any number of solutions",
        };
        blocks.push(DocumentBlock::table(name, header, rows));
        blocks.push(each_alone(self, costs));
        blocks.push(DocumentBlock::list("Validity", validity(self)));
        let kept = match self.own_outputs.is_empty() {
            true => "in place of its outputs".to_string(),
            false => format!("beside {}", self.own_outputs.join(", ")),
        };
        Document {
            title: format!("What to measure of {}, {kept}", self.name),
            lead: sentences(self).into_iter().map(|s| format!("{s}.")).collect(),
            blocks,
        }
    }

    fn sentences(&self) -> Vec<String> {
        sentences(self)
    }

    fn main_table(&self) -> &'static str {
        "front"
    }
}

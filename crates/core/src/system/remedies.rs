//! Remedies of a model: one known value, one state as another output, or two of these.

use std::cmp::Reverse;

use obsdeg_exact::Reals;

use super::error::FilePlace;
use super::judge::judge_beside;
use super::judge::point_degrees::climb_at;
use super::judge::verdicts::Judgement;
use super::model::compiled::{Compiled, Role};
use super::model::{Constant, KnownInput, Named, PlacedExpression, StateStart, SystemModel};
use super::values::Values;
use super::work::{Spent, product};
use crate::language::{Expression, Node};
use crate::remedies::{CandidateInformation, Change, Directions, MOST_PAIRED, Remedies, Remedy, Resolved};
use crate::why::{Improvement, is_lower};

/// Largest number of verdicts on single changes of a model of up to `UNKNOWNS` unknowns; half as many on
/// pairs. For larger models the number falls as the square of the unknowns, since the work of a verdict
/// grows at least as fast: 10 for 90 unknowns, none from 300 on.
const MOST_VERDICTS: usize = 24;
/// Number of unknowns up to which that many verdicts are computed.
const UNKNOWNS: usize = 60;
/// Largest number of verdicts of a model whose functions are evaluated in many digits.
const MOST_IN_DIGITS: usize = 12;
/// Largest number of changes tried for one unknown.
const MOST_EXPLAINED: usize = 200;
/// Largest number of values tried for unknowns that determine each other.
const MOST_ALIKE: usize = 6;

/// Search for remedies of one model.
struct ModelRemedySearch<'a> {
    model: &'a SystemModel,
    judged: &'a Judgement,
    order: Option<usize>,
    /// Columns of reported unknowns that are not observable.
    open: Vec<usize>,
    /// Roles of the columns, each once, with all its columns.
    roles: Vec<(Role, Vec<usize>)>,
    /// Largest number of verdicts on single changes.
    budget: usize,
    /// Operations that remain.
    left: u64,
    /// True once the limit of operations ended the search.
    ended: bool,
    /// True once a changed model was judged where constraints hold in another way.
    elsewhere: bool,
    out: Remedies,
}

/// Remedies of a judged model, after `before` operations of other searches. The constants at the top of this
/// file limit the search.
pub(super) fn remedies(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    (seed, before): (u64, u64),
    order: Option<usize>,
) -> Remedies {
    let unknowns = &judged.layout.unknowns;
    let open: Vec<usize> = (0..unknowns.len())
        .filter(|&c| judged.shown(model, c) && judged.verdict_on(c).degree.is_none())
        .collect();
    if open.is_empty() {
        return Remedies::default();
    }
    let mut roles: Vec<(Role, Vec<usize>)> = Vec::new();
    for &c in &open {
        let role = unknowns[c].role;
        if roles.iter().all(|(known, _)| *known != role) {
            roles.push((role, (0..unknowns.len()).filter(|&k| unknowns[k].role == role).collect()));
        }
    }
    let n = unknowns.len().max(UNKNOWNS);
    let in_digits = judged.digits().map_or(MOST_VERDICTS, |_| MOST_IN_DIGITS);
    // all verdicts, and the search for symmetries before them, take at most the limit of one verdict
    let left = model.work_limit.operations().saturating_sub(before);
    let budget = (MOST_VERDICTS * UNKNOWNS * UNKNOWNS / (n * n)).min(in_digits);
    let mut search = ModelRemedySearch::new((model, judged, order), (open, roles), (budget, left));
    match (judged.fields, &judged.span) {
        (Some([field, _]), Some(span)) => search.all(&Directions::of(field, span)),
        _ => {
            let field = Reals::<8>;
            let mut rng = model.random(seed, "remedies");
            let mut spent = Spent::default();
            let at = climb_at(model, compiled, &judged.layout, field, &mut rng, &mut spent);
            search.left = search.left.saturating_sub(spent.operations);
            if let Ok(at) = at {
                search.all(&Directions::of(field, &at.span));
            }
        }
    }
    if search.elsewhere {
        let text = "known values and outputs: the constraints hold in several ways, and with a change \
                    verdicts are those of another one"
            .into();
        let verdicts = search.out.verdicts;
        search.out = Remedies { not_tried: vec![text], verdicts, ..Remedies::default() };
    }
    let open = search.open.iter().map(|&c| unknowns[c].name.clone());
    search.out.close(open);
    search.out
}

impl<'a> ModelRemedySearch<'a> {
    /// Search among `open` columns and `roles`, within a number of verdicts and of operations.
    fn new(
        (model, judged, order): (&'a SystemModel, &'a Judgement, Option<usize>),
        (open, roles): (Vec<usize>, Vec<(Role, Vec<usize>)>),
        (budget, left): (usize, u64),
    ) -> Self {
        let out = Remedies::default();
        Self { model, judged, order, open, roles, budget, left, ended: false, elsewhere: false, out }
    }

    /// Tries single changes, then pairs for unknowns that no single change resolves.
    fn all<S: Values>(&mut self, directions: &Directions<S>) {
        let open = self.open.len();
        let products = self.roles.iter().map(|(_, columns)| directions.products(columns.len(), open));
        if !self.spend::<S>(products.fold(0, u64::saturating_add)) {
            let text =
                format!("{} known values and outputs: none is tried{}", self.roles.len(), self.option());
            self.out.not_tried.push(text);
            return;
        }
        let singles = self.singles(directions);
        let (count, mut tried) = (singles.len(), 0);
        for change in singles.into_iter().take(self.budget) {
            if self.judge(vec![change]).is_none() {
                break;
            }
            tried += 1;
        }
        if tried < count {
            let text = format!(
                "{} of {count} known values and outputs: at most {tried} are tried{}",
                count - tried,
                self.option()
            );
            self.out.not_tried.push(text);
        }
        let states = self.roles.iter().map(|r| r.0).filter(|r| matches!(r, Role::State(_)));
        self.two(directions, &states.chain(self.started()).collect::<Vec<_>>());
    }

    /// States whose start is known: no unknowns, but their values at later times depend on unknowns.
    fn started(&self) -> impl Iterator<Item = Role> + use<'a> {
        let states = self.model.states.iter().enumerate();
        states.filter(|(_, s)| s.start != StateStart::Unknown).map(|(i, _)| Role::State(i))
    }

    /// Single changes in the order of the search: one value of every set of unknowns that determine each
    /// other, parameters first; then outputs, those first whose value alone resolves most; then other values
    /// of the sets.
    fn singles<S: Values>(&self, directions: &Directions<S>) -> Vec<Change> {
        let resolves = |columns: &[usize]| directions.resolved(&directions.known(columns), &self.open);
        let mut sets: Vec<(Vec<usize>, Vec<Role>)> = Vec::new();
        let mut states: Vec<(usize, Role)> = Vec::new();
        for (role, columns) in &self.roles {
            let mut set = resolves(columns);
            let is_state = matches!(role, Role::State(_));
            states.extend(is_state.then_some((set.len(), *role)));
            if set.is_empty() {
                continue;
            }
            set.extend(columns.iter().filter(|c| self.open.contains(c)));
            set.sort_unstable();
            match sets.iter_mut().find(|(other, _)| *other == set) {
                Some((_, roles)) => roles.push(*role),
                None => sets.push((set, vec![*role])),
            }
        }
        sets.sort_by_key(|(set, _)| Reverse(set.len()));
        states.sort_by_key(|(count, _)| Reverse(*count));
        for (_, roles) in &mut sets {
            roles.sort_by_key(|r| matches!(r, Role::State(_)));
        }
        let alike = |k: usize| sets.iter().filter_map(move |(_, roles)| roles.get(k)).map(|r| self.known(*r));
        let outputs =
            states.iter().map(|(_, role)| *role).chain(self.started()).map(|role| self.output(role));
        alike(0).chain(outputs).chain((1..MOST_ALIKE).flat_map(alike)).collect()
    }

    /// Tries two known values, or two more outputs, for unknowns that no single change resolves.
    fn two<S: Values>(&mut self, directions: &Directions<S>, outputs: &[Role]) {
        let most = self.budget.div_ceil(2);
        let mut work = most;
        let left = self.left();
        let widest = self.roles.iter().map(|r| r.1.len()).max().unwrap_or(0);
        let mut complete =
            self.spend::<S>(directions.products_of_pairs(self.roles.len(), widest, left.len()));
        if complete {
            // one more than are paired shows that there are more
            let paired = self.roles.iter().take(MOST_PAIRED + 1);
            let values: Vec<CandidateInformation<S>> =
                paired.map(|(_, columns)| directions.known(columns)).collect();
            complete = directions.pairs(&values, None, left, |i, j| {
                work = work.checked_sub(1)?;
                let changes = [i, j].map(|k| self.known(self.roles[k].0));
                self.judge(changes.into())
            });
        }
        // rows of another output come from another random point: only the engine can decide about two of
        // them
        for (i, j) in (0..outputs.len()).flat_map(|j| (0..j).map(move |i| (i, j))) {
            if self.left().is_empty() {
                break;
            }
            let changes = [i, j].map(|k| self.output(outputs[k]));
            if work == 0 || self.judge(changes.into()).is_none() {
                complete = false;
                break;
            }
            work -= 1;
        }
        if !complete {
            let text = format!("some pairs of changes: at most {most} are judged{}", self.option());
            self.out.not_tried.push(text);
        }
    }

    /// Counts products of numbers before they are formed; false if they take more operations than remain.
    fn spend<S: Values>(&mut self, products: u64) -> bool {
        let operations = products.saturating_mul(product::<S::Element>());
        let enough = operations <= self.left;
        match enough {
            true => self.left -= operations,
            false => self.ended = true,
        }
        enough
    }

    /// Unknowns without a remedy so far.
    fn left(&self) -> Vec<usize> {
        let name = |c: usize| &self.judged.layout.unknowns[c].name;
        self.open.iter().copied().filter(|&c| !self.out.resolves(name(c))).collect()
    }

    fn named(&self, role: Role) -> &Named {
        match role {
            Role::State(i) => &self.model.states[i].named,
            Role::Parameter(i) => &self.model.parameters[i],
            Role::UnknownInput(i) => &self.model.unknown_inputs[i].0,
            Role::KnownInput(i) => &self.model.known_inputs[i].0,
            Role::Constant(i) => &self.model.constants[i].0,
            // these roles are no unknowns
            Role::Time => &self.model.outputs[0].0,
        }
    }

    fn known(&self, role: Role) -> Change {
        Change::Known { name: self.named(role).name.clone() }
    }

    fn output(&self, role: Role) -> Change {
        Change::Output { state: self.named(role).name.clone() }
    }

    /// Option that allows more work, after a semicolon, if the limit of work ended the search; otherwise
    /// empty.
    fn option(&self) -> &'static str {
        if self.ended { "; a larger --work-limit allows more" } else { "" }
    }

    /// True if a changed model may have been judged on the same component of the constraints as the model.
    /// Removing k columns lowers a rank by less than k, since none of them is observable; an output raises
    /// it.
    fn is_of_same_part(&self, judged: &Judgement, changes: &[Change]) -> bool {
        let rank = |judged: &Judgement| judged.findings.degrees.rank();
        let (before, after) = (rank(self.judged), rank(judged));
        let left_out = self.judged.layout.unknowns.len().saturating_sub(judged.layout.unknowns.len());
        let outputs = changes.iter().any(|c| c.known().is_none());
        self.model.constraints.is_empty()
            || after + left_out.saturating_sub(1) >= before && (outputs || after <= before)
    }

    /// Judges the model with some changes, and records the unknowns that they resolve; `None` if that takes
    /// more operations than remain.
    fn judge(&mut self, changes: Vec<Change>) -> Option<Vec<usize>> {
        if self.left < self.judged.work {
            self.ended = true;
            return None;
        }
        let mut model = changed(self.model, &changes);
        // allow more than remains if little remains: the allowed memory grows with the operations
        let most = self.left.max(self.judged.work.saturating_mul(8));
        model.work_limit = self.model.work_limit.within(most);
        // given values add nothing beyond the last order of the model itself
        let closed = !self.judged.rests_on_bound && changes.iter().all(|c| c.known().is_some());
        let last = self.judged.findings.degrees.rank_profile.len().saturating_sub(1);
        let order = if closed { Some(last) } else { self.order };
        let mut spent = Spent::default();
        let judged = judge_beside(self.judged, &model, order, &mut spent);
        self.left = self.left.saturating_sub(spent.operations);
        if spent.refused && judged.is_err() {
            self.ended = true;
            return None;
        }
        self.out.verdicts += 1;
        let Ok(judged) = judged else { return Some(Vec::new()) };
        if !self.is_of_same_part(&judged, &changes) {
            self.elsewhere = true;
            return None;
        }
        let unknowns = &self.judged.layout.unknowns;
        let found: Vec<(usize, usize)> = (self.open.iter())
            .filter_map(|&c| Some((c, judged.verdict(&model, &unknowns[c].name)?.degree?)))
            .collect();
        let resolve = |&(c, degree): &(usize, usize)| Resolved { name: unknowns[c].name.clone(), degree };
        let resolves: Vec<Resolved> = found.iter().map(resolve).collect();
        if !resolves.is_empty() {
            self.out.remedies.push(Remedy { changes, resolves, loses: Vec::new() });
        }
        Some(found.into_iter().map(|(c, _)| c).collect())
    }
}

/// Changes of a model that make one unknown observable or lower its degree (one known value, or one more
/// state as an output), sentences on changes that were not tried, and the number of verdicts. At most
/// `MOST_EXPLAINED` changes are tried.
pub(super) fn improvements(
    model: &SystemModel,
    judged: &Judgement,
    (column, before): (usize, u64),
    order: Option<usize>,
) -> (Vec<Improvement>, Vec<String>, usize) {
    let unknowns = &judged.layout.unknowns;
    let degree = judged.verdict_on(column).degree;
    let shown = |c: &usize| judged.shown(model, *c);
    let is_open = |c: &usize| judged.verdict_on(*c).degree.is_none() || *c == column;
    let open = (0..unknowns.len()).filter(shown).filter(is_open).collect();
    let mut roles: Vec<(Role, Vec<usize>)> = Vec::new();
    for u in (0..unknowns.len()).filter(shown).map(|c| &unknowns[c]) {
        if roles.iter().all(|(role, _)| *role != u.role) {
            roles.push((u.role, Vec::new()));
        }
    }
    let left = model.work_limit.operations().saturating_sub(before);
    let mut search = ModelRemedySearch::new((model, judged, order), (open, roles), (MOST_EXPLAINED, left));
    let is_state = |role: &Role| matches!(role, Role::State(_));
    let roles: Vec<Role> = search.roles.iter().map(|r| r.0).collect();
    // with constraints, a changed model was judged only for values that are not observable
    let judged_there = |role: &&Role| {
        let own = |c: &usize| unknowns[*c].role == **role && *c != column;
        model.constraints.is_empty() || search.open.iter().any(own)
    };
    let values = roles.iter().filter(|role| **role != unknowns[column].role).filter(judged_there);
    let values = values.map(|role| search.known(*role));
    let states = roles.iter().copied().filter(is_state).chain(search.started());
    let outputs = states.map(|role| search.output(role));
    let changes: Vec<Change> = values.chain(outputs).collect();
    let (count, mut tried) = (changes.len(), 0);
    for change in changes.into_iter().take(MOST_EXPLAINED) {
        if search.judge(vec![change]).is_none() {
            break;
        }
        tried += 1;
    }
    if search.elsewhere {
        let text = "known values and outputs: the constraints hold in several ways, and with a change \
                    verdicts are those of another one";
        return (Vec::new(), vec![text.into()], search.out.verdicts);
    }
    let not_tried = (tried < count).then(|| {
        let left = count - tried;
        format!("{left} of {count} known values and outputs: at most {tried} are tried{}", search.option())
    });
    let name = &unknowns[column].name;
    let improvement = |r: Remedy| {
        let after = r.resolves.iter().find(|x| x.name == *name)?.degree;
        let resolves = r.resolves.into_iter().filter(|x| x.name != *name).collect();
        let found = Improvement { changes: r.changes, degree: after, resolves, loses: r.loses };
        is_lower(Some(after), degree).then_some(found)
    };
    let found = search.out.remedies.into_iter().filter_map(improvement).collect();
    (found, Vec::from_iter(not_tried), search.out.verdicts)
}

/// The model with some changes, without requested combinations.
fn changed(model: &SystemModel, changes: &[Change]) -> SystemModel {
    let mut out = SystemModel { combinations: Vec::new(), ..model.clone() };
    for change in changes {
        match change {
            Change::Known { name } => know(&mut out, name),
            Change::Output { state } => measure(&mut out, state),
            // changes of schemes only
            Change::Attitude { .. } | Change::Carry { .. } => {}
        }
    }
    out
}

/// Makes the value of an unknown known.
fn know(model: &mut SystemModel, name: &str) {
    if let Some(state) = model.states.iter_mut().find(|s| s.named.name == name) {
        state.start = StateStart::Known;
    } else if let Some(i) = model.parameters.iter().position(|p| p.name == name) {
        model.constants.push((model.parameters.remove(i), Constant::Generic));
    } else if let Some(i) = model.unknown_inputs.iter().position(|u| u.0.name == name) {
        let (named, degree) = model.unknown_inputs.remove(i);
        model.known_inputs.push((named, degree.map_or(KnownInput::Generic, KnownInput::Polynomial)));
    }
}

/// Adds a state as an output.
fn measure(model: &mut SystemModel, state: &str) {
    let mut name = state.split('[').next().unwrap_or(state).to_string();
    while model.outputs.iter().any(|o| o.0.name == name) {
        name.push('_');
    }
    let expression = Expression {
        nodes: vec![Node::Name(state.into())],
        spans: std::iter::once(0..state.len()).collect(),
    };
    let place = FilePlace { what: format!("the output {name}"), offset: None };
    let named = Named { name, ..Named::default() };
    model.outputs.push((named, PlacedExpression { text: state.into(), expression, place }));
}

//! Verdicts, runs and evidence on any system.

use obsdeg_core::degree::Status;
use obsdeg_core::system::{
    ConstraintFactor, DigitsReport, NumberOfSolutions, POLYNOMIAL_DEGREE, SystemAnalysis, SystemCombination,
    SystemQuantity,
};
use obsdeg_evidence::crosscheck::Agreement;
use obsdeg_evidence::simulation::Outcome;
use obsdeg_evidence::system::{SystemEstimate, SystemEvidence, SystemQuantityEvidence, SystemRun};

use crate::document::{Document, DocumentBlock, Typeset, left, number, right};
use crate::{Answer, Explanation, latex, resolve, why, words};

/// Length in bytes up to which a solving expression is printed.
const READABLE: usize = 240;

fn explanation(q: &SystemQuantity, constrained: bool) -> String {
    match (q.status, q.degree) {
        (Status::Observable, Some(0)) => {
            let from = if constrained { "the outputs and the constraints" } else { "the outputs" };
            format!("from {from} themselves; {}", solutions(q))
        }
        (Status::Observable, _) => solutions(q),
        (Status::Inseparable, _) => {
            format!("not identifiable: {}", words::indistinguishable_from(&q.partners))
        }
        (Status::NotExcited, _) => "not identifiable: moves no output".into(),
        (Status::NotSeen, _) => "a higher order may still solve it: no end is proven here".into(),
    }
}

/// Certainty of verdicts in a sentence. Real numbers give no probability: a number that differs from zero is
/// proven to do so, one whose ball contains zero is assumed to be zero.
pub(crate) fn certainty(error_bound: Option<f64>, digits: Option<DigitsReport>, seed: u64) -> String {
    match (error_bound, digits) {
        (Some(bound), _) => {
            format!("a verdict is {}; seed {seed}", words::wrong_below(bound))
        }
        (None, Some(d)) => {
            let zero = d.zero_log10.map_or_else(
                || "what counts as zero is so exactly".into(),
                |x| format!("what counts as zero is less than 10^{x:.0} of its row; a judgement by this gap"),
            );
            // + 0.0 avoids "-0"
            let least = d.nonzero_log10.round() + 0.0;
            format!(
                "functions by their true values at two random real points, with {} and {} digits, that \
                 agree: what counts as different from zero is proven to be (at least 10^{least} relative to \
                 the largest number of its row), {zero}; no probability belongs to it; seed {seed}",
                d.digits[0], d.digits[1]
            )
        }
        (None, None) => format!("seed {seed}"),
    }
}

/// Number of solutions of an observable unknown, and a reference to its expression.
fn solutions(q: &SystemQuantity) -> String {
    let words = q.identifiability_words();
    match (&q.number_of_solutions, &q.solution) {
        (Some(NumberOfSolutions::OneByExpression), _) => format!("{words}: see below"),
        (_, Some(_)) => format!("{words}; in terms of others: see below"),
        (_, None) => words,
    }
}

/// Conditions of the numbers of solutions, and reasons why some are missing.
fn counting(a: &SystemAnalysis) -> Vec<String> {
    let mut out = Vec::new();
    if let Some(order) = a.counting_order {
        let with = match a.discrete {
            true => format!("with the outputs up to t+{order}"),
            false => format!("with derivatives up to order {order}"),
        };
        out.push(format!(
            "solutions without an expression are counted by elimination, complex ones too, {with} at a random \
             point modulo each prime; no bound on the probability of an error is derived"
        ));
    }
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    let unknowns = a.quantities.iter().map(|q| (&q.name, &q.number_of_solutions));
    let asked = a.combinations.iter().map(|c| (&c.expression, &c.number_of_solutions));
    for (name, number) in unknowns.chain(asked) {
        if let Some(NumberOfSolutions::Undecided(reason)) = number {
            match reasons.iter_mut().find(|r| r.0 == reason) {
                Some((_, names)) => names.push(name),
                None => reasons.push((reason, vec![name])),
            }
        }
    }
    let undecided = |(reason, names): (&str, Vec<&str>)| {
        format!("the number of solutions of {} is not decided: {reason}", words::names(names))
    };
    out.extend(reasons.into_iter().map(undecided));
    out
}

/// The verdict on an observable combination, with the number of its values where they were counted.
fn values_of(c: &SystemCombination) -> String {
    match &c.number_of_solutions {
        None => "observable".into(),
        Some(NumberOfSolutions::Counted(1) | NumberOfSolutions::OneByExpression) => {
            "globally identifiable".into()
        }
        Some(NumberOfSolutions::Counted(k)) => format!("locally identifiable ({k} values)"),
        Some(NumberOfSolutions::Undecided(_)) => "locally identifiable (number of values not decided)".into(),
    }
}

/// Combinations with their verdicts. `unproven` is the largest order of derivatives if the end is not proven.
fn combinations(heading: &str, list: &[SystemCombination], unproven: Option<usize>) -> DocumentBlock {
    let row = |c: &SystemCombination| {
        let verdict = match (c.degree, unproven) {
            (Some(_), _) => values_of(c),
            (None, None) => "not observable".into(),
            (None, Some(order)) => format!("not seen up to order {order}"),
        };
        vec![c.expression.clone(), verdict, words::degree(c.degree)]
    };
    DocumentBlock::table(
        heading,
        [left("combination"), left("status"), right("degree")],
        list.iter().map(row),
    )
}

/// The side of branches in time to which verdicts at a generic time are limited: ` where t - 7 < 0`; empty if
/// the time is in no abs and no sign.
fn side_in_time(a: &SystemAnalysis) -> String {
    let of_time = a.branch_sides.iter().filter(|s| s.of_time).map(|s| s.condition.as_str());
    match words::names(of_time) {
        none if none.is_empty() => none,
        conditions => format!(" where {conditions}"),
    }
}

/// The branch of abs, sign, roots, asin and acos on which verdicts hold.
fn branch(a: &SystemAnalysis) -> String {
    let functions = words::names(a.branches.iter().map(String::as_str));
    let sides = words::names(a.branch_sides.iter().map(|s| s.condition.as_str()));
    let point = "unknowns near one, or where the model is not defined there, the first point that was found";
    let chosen = match (sides.is_empty(), a.branch_sides.iter().all(|s| s.of_time)) {
        (true, _) => format!("that of {point}"),
        (_, true) => format!("where {sides} (`time` in the file chooses another)"),
        _ if a.branch_sides.iter().all(|s| s.given || s.of_time) => {
            format!("where {sides} (known starts and `time` in the file choose another)")
        }
        _ if a.branch_sides.iter().any(|s| s.given) => {
            format!("where {sides} (by known starts where these decide, else by {point})")
        }
        (..) => format!("where {sides} (chosen by {point})"),
    };
    format!("{functions}: the verdicts are those of one branch, {chosen}; others may have other verdicts")
}

/// Table of the verdicts on unknowns, in the order given.
fn verdicts(a: &SystemAnalysis, order: &[&SystemQuantity]) -> DocumentBlock {
    let units = a.quantities.iter().any(|q| !q.unit.is_empty());
    let rows = order.iter().map(|q| verdict_row(a, q, units));
    let mut columns = vec![left("unknown"), left("kind")];
    columns.extend(units.then(|| left("unit")));
    columns.extend([left("status"), right("degree"), left("explanation")]);
    DocumentBlock::table("Verdicts", columns, rows)
}

/// Verdict on an unknown; with its unit if any unknown has one.
fn verdict_row(a: &SystemAnalysis, q: &SystemQuantity, units: bool) -> Vec<String> {
    let mut row = vec![q.name.clone(), q.kind.clone()];
    if units {
        row.push(q.unit.clone());
    }
    let verdict = match q.status {
        Status::NotSeen => format!("not seen up to order {}", a.last_order),
        status => status.to_string(),
    };
    row.extend([verdict, words::degree(q.degree), explanation(q, !a.constraints.is_empty())]);
    if !q.description.is_empty() {
        let last = row.len() - 1;
        row[last] = format!("{} ({})", row[last], q.description);
    }
    row
}

/// Expression that solves an unknown; `None` without one.
fn solved_by(q: &SystemQuantity) -> Option<Typeset> {
    let solution = q.solution.as_ref()?;
    let (text, latex) = match solution.len() {
        0..=READABLE => (solution.clone(), latex::expression(solution)),
        long => {
            let text = format!("a fraction of {long} characters (--format json holds it)");
            (text.clone(), format!("\\text{{{text}}}"))
        }
    };
    let latex = format!("{} = {latex}", latex::expression(&q.name));
    Some(Typeset { text: format!("{} = {text}", q.name), latex })
}

/// Changes of unknowns that no output shows; `None` without any.
fn directions(a: &SystemAnalysis) -> Option<DocumentBlock> {
    let mut lines: Vec<String> = a.symmetries.iter().map(|s| s.words.clone()).collect();
    let silent = a.quantities.iter().filter(|q| q.status == Status::NotExcited);
    lines.extend(silent.map(|q| format!("change {} alone", q.name)));
    lines.extend(a.other_directions.iter().map(|moved| {
        format!(
            "move {} together in a way for which no polynomial of degree up to {POLYNOMIAL_DEGREE} was found",
            moved.join(", ")
        )
    }));
    // derivatives of higher order than the bound may change
    let heading = match a.rests_on_bound {
        true if a.discrete => format!("No output up to t+{} changes when you", a.last_order),
        true => {
            format!("No derivative up to order {} changes at the start when you", a.last_order)
        }
        false => "No output changes when you".into(),
    };
    DocumentBlock::list_if_any(&heading, lines)
}

/// Conditions of the verdicts, one sentence each.
fn assumed(a: &SystemAnalysis) -> Vec<String> {
    let mut assumed = Vec::new();
    if a.missing_functions > 0 {
        let number = match a.missing_functions {
            1 => "1 more independent one exists".to_string(),
            n => format!("{n} more independent ones exist"),
        };
        let why = match a.digits {
            Some(_) => "for a model judged in real numbers only those of its symmetries are sought",
            None => "none was found among short sums of products of powers",
        };
        assumed.push(format!("identifiable combinations are not all listed: {number}; {why}"));
    }
    if !a.known.is_empty() {
        assumed.push(format!("known starts: {}", a.known.join(", ")));
    }
    assumed.extend(a.time.as_deref().map(|time| judged_at(a, time)));
    if !a.constraints.is_empty() {
        assumed.push(kept_constraints(a));
        assumed.extend(a.constraint_factors.iter().map(chosen_factor));
    }
    assumed.extend(a.discrete.then(|| {
        "discrete time: a degree is the number of steps, so that outputs up to y[t+degree] determine the \
         unknown at t"
            .into()
    }));
    assumed.push(if a.discrete { last_step(a) } else { last_order(a) });
    let (up_to, further) = match a.discrete {
        true => ("step", "outputs of later steps"),
        false => ("order", "derivatives of higher orders"),
    };
    assumed.push(format!(
        "observable and degree are meant locally: around a generic point no other value gives the same \
         outputs up to that {up_to}; how many values there are in all is said where it was decided, and \
         the expression of an only one may use {further}"
    ));
    if !a.branches.is_empty() {
        assumed.push(branch(a));
    }
    assumed.extend(counting(a));
    assumed.extend(a.note.clone());
    if let Some(count @ 1..) = a.independent_functions {
        assumed.push(format!(
            "the values of {count} functions, derivatives counted, are algebraically independent at a \
             generic point (by Ax's theorem, from the rank of the gradients of their arguments), so that \
             random values stand for them"
        ));
    }
    assumed.push(match (&a.primes, a.error_bound) {
        (Some(primes), Some(bound)) => format!(
            "ranks modulo the random primes {} at random points; {}; seed {}",
            primes.join(" and "),
            words::wrong_below(bound),
            a.seed
        ),
        _ => certainty(a.error_bound, a.digits, a.seed),
    });
    assumed
}

/// Sentence on the time at which a model that depends on it was judged: `generic` or a number.
fn judged_at(a: &SystemAnalysis, time: &str) -> String {
    let at = match time {
        "generic" => format!("a generic time (verdicts of almost every time{})", side_in_time(a)),
        time => format!("t = {time}, where the run begins"),
    };
    let later = match a.discrete {
        true => String::new(),
        false => {
            let side = if time == "generic" { String::new() } else { side_in_time(a) };
            format!("; segments after the first, if there are any, at a generic time{side}")
        }
    };
    format!(
        "the equations or known inputs depend on the time: judged at {at}{later}; `time` in the file sets \
         another, or \"generic\""
    )
}

/// Sentence on the constraints, which hold at the start.
fn kept_constraints(a: &SystemAnalysis) -> String {
    // a linear constraint holds in one way, a product by the factor that was chosen
    let left = |c: &String| {
        let factor = a.constraint_factors.iter().find(|w| w.constraint == *c);
        factor.map_or(c.clone(), |w| w.factor.clone())
    };
    // a name may stand for a product
    let defined = |c: &String| {
        a.equations.iter().any(|e| {
            let (name, _) = e.split_once(" = ").unwrap_or_default();
            !name.is_empty() && c.split(|x: char| !x.is_alphanumeric() && x != '_').any(|word| word == name)
        })
    };
    let several = a.constraints.iter().map(left).any(|c| c.contains(['*', '^', '/']) || defined(&c));
    format!(
        "at the start {}: the verdicts are about changes that keep this, as if it were an output of degree 0{}",
        a.constraints.join(", "),
        match several {
            true =>
                "; where it can hold in several ways (x^2 = y^2 by x = y or by x = -y), they are \
                 those of one: state that one to choose",
            false => "",
        }
    )
}

/// Sentence on the factor of a product that was chosen to be zero.
fn chosen_factor(w: &ConstraintFactor) -> String {
    let others: Vec<String> = w.others.iter().map(|o| format!("{o} = 0")).collect();
    format!(
        "{} holds where {} = 0 or where {}: all that is said is of {} = 0, {}; state another one \
         in its place to choose it",
        w.constraint,
        w.factor,
        others.join(" or where "),
        w.factor,
        match w.given {
            true => "which the values under [simulation.values] hold",
            false => "the first with a real point of its own, unknowns alone last",
        }
    )
}

/// Sentence on the last step in discrete time that was looked at.
fn last_step(a: &SystemAnalysis) -> String {
    let last = match a.last_order {
        0 => String::new(),
        k => format!("+{k}"),
    };
    if a.closed {
        format!("outputs up to t{last} were looked at; those of later steps make nothing more observable")
    } else if a.rests_on_bound {
        format!(
            "outputs up to t{last} were looked at, and what is not observable rests on this bound (--order sets \
             another)"
        )
    } else {
        format!("everything is observable with outputs up to t{last}")
    }
}

/// Sentence on the last order of derivatives that was looked at.
fn last_order(a: &SystemAnalysis) -> String {
    if a.closed {
        format!(
            "generic point and inputs: the first order that adds nothing is the last; {} was looked at",
            a.last_order
        )
    } else if a.rests_on_bound {
        format!(
            "starts, inputs or segments are not generic: orders up to the bound {} were looked at, and what \
             is not observable rests on it (--order sets another)",
            a.bound
        )
    } else if a.rank == a.unknowns {
        format!("everything is observable with derivatives up to order {}", a.last_order)
    } else {
        format!(
            "starts, inputs, jumps or the time are special, yet no order above {} can add anything: the rank \
             is that of a generic point, or nothing moves",
            a.last_order
        )
    }
}

impl Answer for SystemAnalysis {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn explanations(&self) -> Vec<Explanation> {
        self.why.iter().map(Explanation::new).collect()
    }

    fn document(&self) -> Document {
        let mut order: Vec<_> = self.quantities.iter().collect();
        // best first, unknowns without a degree last
        order.sort_by_key(|q| (q.status, q.degree));
        let mut blocks = why::blocks(&self.why);
        blocks.push(verdicts(self, &order));
        blocks.extend(DocumentBlock::formulas("Solved by", order.iter().filter_map(|q| solved_by(q))));
        let unproven = self.rests_on_bound.then_some(self.last_order);
        if !self.combinations.is_empty() {
            blocks.push(combinations("Combinations asked for", &self.combinations, unproven));
        }
        if !self.invariants.is_empty() {
            blocks.push(combinations("Identifiable combinations", &self.invariants, unproven));
        }
        if self.unobservable_directions > 0 {
            blocks.extend(directions(self));
        }
        blocks.extend(DocumentBlock::list_if_any(
            "Every solution has another one with the same outputs, which appears when you",
            self.solution_maps.clone(),
        ));
        blocks.push(DocumentBlock::list("The system", self.equations.clone()));
        blocks.push(DocumentBlock::list("Assumed", assumed(self)));
        let profile = words::list(&self.rank_profile);
        let mut lead = self.sentences();
        lead.extend((!self.description.is_empty()).then(|| self.description.clone()));
        lead.push(format!("rank {} of {}; rank profile {profile}", self.rank, self.unknowns));
        Document { title: format!("Observable degrees: {}", self.name), lead, blocks }
    }

    fn sentences(&self) -> Vec<String> {
        resolve::of_model(self)
    }
}

/// Sentence on the start of a run of a model that depends on time.
fn begins_at(time: f64) -> String {
    format!(
        "the equations or known inputs depend on the time: the run begins at t = {time} (1 where the file \
         says \"generic\")"
    )
}

/// Priors of a run that the file does not state; `None` if all are stated.
pub(crate) fn priors_chosen(run: &SystemRun) -> Option<String> {
    let all = &run.priors_by_default;
    (!all.is_empty()).then(|| {
        format!(
            "prior sigma of {}: the size of the true value (1 where that is zero)",
            words::names(all.iter().map(String::as_str))
        )
    })
}

/// One run of the filter.
impl Answer for SystemRun {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let row = |e: &SystemEstimate| {
            let exact = e.status.map_or_else(|| "start known".into(), |s| s.to_string());
            let verdict = match e.outcome {
                Outcome::Reached | Outcome::Converging => exact,
                other => format!("{exact}, {}", words::run::outcome(other)),
            };
            let mut out = vec![e.name.clone(), e.unit.clone(), verdict];
            let values = [e.truth, e.estimate, e.error, e.sigma];
            out.extend(words::run::estimate(e.degree, values, e.error_over_sigma));
            out.push(number(e.prior_sigma));
            out
        };
        let mut columns = vec![left("unknown"), left("unit"), left("status")];
        columns.extend(words::run::ESTIMATE.map(right));
        columns.push(right("prior sigma"));
        let table = DocumentBlock::table(
            "Estimates at the end (verdict and degree: exact, and what the run makes of it)",
            columns,
            self.quantities.iter().map(row),
        );
        let mut consistency = words::run::consistency(&self.consistency);
        // a state whose start is known has no verdict
        let unobservable =
            |e: &SystemEstimate| matches!(e.status, Some(Status::Inseparable | Status::NotExcited));
        let beyond = |e: &&SystemEstimate| unobservable(e) && e.error_over_sigma.abs() > 4.0;
        let beyond: Vec<&str> = self.quantities.iter().filter(beyond).map(|e| e.name.as_str()).collect();
        if !beyond.is_empty() {
            consistency.push(format!(
            "{}: not observable, yet the filter trusts its estimate: linearised anew at every step, it takes \
             up information that is not there",
            beyond.join(", ")
        ));
        }
        let noise: Vec<String> = self.noise.iter().map(|(name, sigma)| format!("{name} {sigma}")).collect();
        let mut assumed = vec![
            format!(
                "truth by the equations of the model, for {} in steps of {}",
                number(self.duration),
                number(self.step)
            ),
            format!("noise of a sample: {}", noise.join(", ")),
            "the initial estimate is the truth plus an error drawn from the prior".into(),
            certainty(self.error_bound, self.digits, self.seed),
        ];
        assumed.extend(priors_chosen(self).map(|text| format!("not stated, chosen by the program: {text}")));
        assumed.extend(self.time.map(begins_at));
        Document {
            title: format!("Simulation: {}", self.name),
            lead: Vec::new(),
            blocks: vec![
                table,
                DocumentBlock::list("Consistency", consistency),
                DocumentBlock::list("Assumed", assumed),
            ],
        }
    }
}

/// Outcome of a comparison in words.
fn said(outcome: Agreement) -> &'static str {
    match outcome {
        Agreement::Disagrees => "DISAGREES",
        Agreement::NotResolvable => "not resolvable",
        Agreement::Agrees => "agrees",
        Agreement::NotTested => "not measured",
    }
}

/// Finding on an unknown: its slope and its inflation together.
fn agreement(q: &SystemQuantityEvidence) -> &'static str {
    match (
        q.slope.fails() || q.inflation.fails(),
        q.inflation.outcome,
        q.degree.is_some() && q.slope.measured.is_none(),
    ) {
        (true, _, _) => "DISAGREES",
        (false, Agreement::NotResolvable, _) => "not resolvable",
        (false, Agreement::NotTested, _) => "not measured",
        (false, _, true) => "agrees, degree not measured",
        (false, _, false) => "agrees",
    }
}

/// Table of slopes and inflations, unknown by unknown.
fn information(e: &SystemEvidence) -> DocumentBlock {
    let row = |q: &SystemQuantityEvidence| {
        vec![
            q.name.clone(),
            q.status.to_string(),
            words::degree(q.degree),
            if q.degree.is_some() { format!("{:.1}", q.slope.predicted) } else { "-".into() },
            q.slope.measured.map_or_else(|| "-".into(), |x| format!("{x:.3}")),
            format!("{:.2}", q.inflation.predicted),
            q.inflation.measured.map_or_else(|| "-".into(), |x| format!("{x:.3}")),
            agreement(q).into(),
        ]
    };
    DocumentBlock::table(
        "Information of the samples, linearised along the true run",
        [
            left("unknown"),
            left("status"),
            right("degree"),
            right("slope"),
            right("slope measured"),
            right("prior x10"),
            right("x10 measured"),
            left("finding"),
        ],
        e.quantities.iter().map(row),
    )
}

/// Directions that no output sees, against the singular values of the information.
fn unseen_directions(e: &SystemEvidence) -> DocumentBlock {
    let mut null: Vec<String> = e
        .symmetries
        .iter()
        .map(|s| {
            let seen = s.seen.measured.map_or_else(|| "-".into(), |x| format!("{x:.0e}"));
            format!("{}: seen with {seen} of the best direction, {}", s.words, said(s.seen.outcome))
        })
        .collect();
    let (heading, by) = match e.seen_up_to {
        Some(order) => (
            format!("Directions that no derivative up to order {order} sees"),
            format!("up to order {order}"),
        ),
        None => ("Directions that no output sees".into(), "exact".into()),
    };
    null.push(format!(
        "unobservable directions: {} {by}, {} singular values vanish, {}",
        e.defect.predicted,
        e.defect.measured,
        said(e.defect.outcome)
    ));
    DocumentBlock::list(heading, null)
}

/// Meaning of the figures, and their certainty.
fn how(e: &SystemEvidence) -> Vec<String> {
    let mut how = vec![
        format!(
            "slope: of log sigma against the log of a short horizon, -(degree + 1/2) at a fixed sampling \
             rate; - where jumps or rounding hide it, or where it still changes with the horizon (up to \
             {} long)",
            number(e.duration)
        ),
        "prior x10: the factor on sigma when a diffuse prior is ten times as loose; 1 for what is \
         observable, 10 for what is not"
            .into(),
        "not resolvable: what moves no output by more than rounding (1e-13 of the outputs), what is \
         observable and leaves more than a hundredth of its diffuse prior, and directions seen with less \
         than 1e-9 of the best and more than 1e-12"
            .into(),
        certainty(e.error_bound, e.digits, e.seed),
    ];
    how.extend(e.seen_up_to.map(|order| {
        format!(
            "not seen: by no derivative up to order {order}; samples that see it by higher ones speak \
             neither for nor against the verdict"
        )
    }));
    how.extend(e.time.map(begins_at));
    how
}

/// First line: agreement of samples and verdicts, and the number of checks.
fn outcome(e: &SystemEvidence) -> String {
    let open = e.orders.measured < e.orders.of || e.not_resolvable > 0;
    let verdict = match (e.passed, open) {
        (false, _) => "the information of samples DISAGREES with the exact verdicts",
        (true, true) => "the information of samples agrees with the exact verdicts as far as measured",
        (true, false) => "the information of samples agrees with the exact verdicts",
    };
    let open = match e.not_resolvable {
        0 => String::new(),
        k => format!(", {k} not resolvable"),
    };
    let passed = format!("{} of {} checks passed{open}", e.checks - e.failures, e.checks);
    format!(
        "{verdict} (no filter is run): {passed}, {} of {} degrees measured",
        e.orders.measured, e.orders.of
    )
}

/// The exact verdicts against the information of the samples.
impl Answer for SystemEvidence {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let blocks = vec![information(self), unseen_directions(self), DocumentBlock::list("How", how(self))];
        Document { title: format!("Cross-check: {}", self.name), lead: vec![outcome(self)], blocks }
    }
}

//! Any system.

use obsdeg_core::degree::Status;
use obsdeg_core::system::{POLYNOMIAL_DEGREE, SystemAnalysis, SystemCombination, SystemQuantity};
use obsdeg_evidence::crosscheck::Check;
use obsdeg_evidence::simulation::Outcome;
use obsdeg_evidence::system::{SystemEstimate, SystemEvidence, SystemQuantityEvidence, SystemRun};

use crate::document::{Block, Document, Typeset, number};
use crate::{latex, words};

/// Longest solving expression that a reader is shown.
const READABLE: usize = 240;

fn explanation(q: &SystemQuantity) -> String {
    match (q.status, q.degree) {
        (Status::Observable, Some(0)) => "from the outputs themselves; local: finitely many solutions".into(),
        (Status::Observable, _) if q.solution.is_some() => "one solution: see below".into(),
        (Status::Observable, _) => "local: finitely many solutions".into(),
        (Status::Inseparable, _) => words::not_told_from(&q.partners),
        (Status::NotExcited, _) => "moves no output".into(),
    }
}

fn combinations(heading: &str, list: &[SystemCombination]) -> Block {
    let row = |c: &SystemCombination| {
        let verdict = if c.degree.is_some() { "observable" } else { "not observable" };
        vec![c.expression.clone(), verdict.into(), words::degree(c.degree)]
    };
    Block::Table {
        heading: heading.into(),
        header: vec!["combination", "verdict", "degree"],
        numbers: vec![false, false, true],
        rows: list.iter().map(row).collect(),
    }
}

pub(crate) fn document(a: &SystemAnalysis) -> Document {
    let list = |heading: &str, lines: Vec<String>| Block::List { heading: heading.into(), lines };
    let units = a.quantities.iter().any(|q| !q.unit.is_empty());
    let mut order: Vec<_> = a.quantities.iter().collect();
    // best first, what has no degree last
    order.sort_by_key(|q| (q.status, q.degree));
    let rows = order.iter().map(|q| {
        let mut row = vec![q.name.clone(), q.kind.clone()];
        if units {
            row.push(q.unit.clone());
        }
        row.extend([q.status.to_string(), words::degree(q.degree), explanation(q)]);
        if !q.description.is_empty() {
            let last = row.len() - 1;
            row[last] = format!("{} ({})", row[last], q.description);
        }
        row
    });
    let mut header = vec!["unknown", "kind"];
    let mut numbers = vec![false, false];
    if units {
        header.push("unit");
        numbers.push(false);
    }
    header.extend(["verdict", "degree", "explanation"]);
    numbers.extend([false, true, false]);
    let mut blocks = vec![Block::Table { heading: "Verdicts".into(), header, numbers, rows: rows.collect() }];
    let solved = order.iter().filter_map(|q| {
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
    });
    let lines: Vec<Typeset> = solved.collect();
    if !lines.is_empty() {
        blocks.push(Block::Formulas { heading: "Solved by".into(), lines });
    }
    if !a.combinations.is_empty() {
        blocks.push(combinations("Combinations asked for", &a.combinations));
    }
    if !a.invariants.is_empty() {
        blocks.push(combinations("What stays observable of the unobservable", &a.invariants));
    }
    if a.unobservable_directions > 0 {
        let mut lines: Vec<String> = a.symmetries.iter().map(|s| s.words.clone()).collect();
        let silent = a.quantities.iter().filter(|q| q.status == Status::NotExcited);
        lines.extend(silent.map(|q| format!("change {} alone", q.name)));
        lines.extend(a.other_directions.iter().map(|moved| {
            format!(
                "move {} together in a way that is no polynomial of degree up to {POLYNOMIAL_DEGREE}, or a long one",
                moved.join(", ")
            )
        }));
        blocks.push(list("No output changes when you", lines));
    }
    blocks.push(list("The system", a.equations.clone()));
    let mut assumed = Vec::new();
    if !a.known.is_empty() {
        assumed.push(format!("known starts: {}", a.known.join(", ")));
    }
    assumed.push(if a.closed {
        format!(
            "generic point and inputs: the first order that adds nothing is the last; {} was looked at",
            a.last_order
        )
    } else if a.rests_on_bound {
        format!(
            "starts, inputs or segments are not generic: orders up to the bound {} were looked at, and what is not observable rests on it (--order sets another)",
            a.bound
        )
    } else {
        format!("everything is observable with derivatives up to order {}", a.last_order)
    });
    assumed.push(
        "the verdict is local: an observable unknown has finitely many solutions near any generic point"
            .into(),
    );
    assumed.extend(a.note.clone());
    assumed.push(format!(
        "ranks modulo the random primes {} and {} at random points; wrong with probability below {:.0e}; seed {}",
        a.primes[0], a.primes[1], a.error_bound, a.seed
    ));
    blocks.push(list("Assumed", assumed));
    let profile = words::list(&a.rank_profile);
    let mut lead = vec![format!("rank {} of {}; rank profile {profile}", a.rank, a.unknowns)];
    if !a.description.is_empty() {
        lead.insert(0, a.description.clone());
    }
    Document { title: format!("Observable degrees: {}", a.name), lead, blocks }
}

/// One run of the filter.
pub(crate) fn run(r: &SystemRun) -> Document {
    let row = |e: &SystemEstimate| {
        let exact = e.status.map_or_else(|| "start known".into(), |s| s.to_string());
        let verdict = match e.verdict {
            Outcome::Reached | Outcome::Converging => exact,
            other => format!("{exact}, {other}"),
        };
        vec![
            e.name.clone(),
            e.unit.clone(),
            verdict,
            words::degree(e.degree),
            number(e.truth),
            number(e.estimate),
            number(e.error),
            number(e.sigma),
            format!("{:.2}", e.error_over_sigma),
            number(e.prior_sigma),
        ]
    };
    let table = Block::Table {
        heading: "Estimates at the end (verdict and degree: exact, and what the run makes of it)".into(),
        header: vec![
            "unknown",
            "unit",
            "verdict",
            "degree",
            "truth",
            "estimate",
            "error",
            "sigma",
            "in sigma",
            "prior sigma",
        ],
        numbers: vec![false, false, false, true, true, true, true, true, true, true],
        rows: r.estimates.iter().map(row).collect(),
    };
    let mut consistency = words::consistency(&r.consistency);
    let beyond = |e: &&SystemEstimate| e.status != Some(Status::Observable) && e.error_over_sigma.abs() > 4.0;
    let beyond: Vec<&str> = r.estimates.iter().filter(beyond).map(|e| e.name.as_str()).collect();
    if !beyond.is_empty() {
        consistency.push(format!(
            "{}: not observable, yet the filter trusts its estimate: linearised anew at every step, it takes up information that is not there",
            beyond.join(", ")
        ));
    }
    let noise: Vec<String> = r.noise.iter().map(|(name, sigma)| format!("{name} {sigma}")).collect();
    let assumed = vec![
        format!(
            "truth by the equations of the model, for {} in steps of {}",
            number(r.duration),
            number(r.step)
        ),
        format!("noise of a sample: {}", noise.join(", ")),
        "the initial estimate is the truth plus an error drawn from the prior".into(),
        format!("a verdict is wrong with probability below {:.0e}; seed {}", r.error_bound, r.seed),
    ];
    Document {
        title: format!("Simulation: {}", r.name),
        lead: Vec::new(),
        blocks: vec![
            table,
            Block::List { heading: "Consistency".into(), lines: consistency },
            Block::List { heading: "Assumed".into(), lines: assumed },
        ],
    }
}

/// The exact verdicts against the information of the samples.
pub(crate) fn evidence(e: &SystemEvidence) -> Document {
    let said = |c: &Check| if c.fails() { "DISAGREES" } else { "agrees" };
    let row = |q: &SystemQuantityEvidence| {
        vec![
            q.name.clone(),
            q.status.to_string(),
            words::degree(q.degree),
            if q.degree.is_some() { format!("{:.1}", q.slope.predicted) } else { "-".into() },
            q.slope.measured.map_or_else(|| "-".into(), |x| format!("{x:.3}")),
            format!("{:.2}", q.inflation.predicted),
            q.inflation.measured.map_or_else(|| "-".into(), |x| format!("{x:.3}")),
            match (q.slope.fails() || q.inflation.fails(), q.degree.is_some() && q.slope.measured.is_none()) {
                (true, _) => "DISAGREES",
                (false, true) => "agrees, degree not measured",
                (false, false) => "agrees",
            }
            .into(),
        ]
    };
    let mut blocks = vec![Block::Table {
        heading: "Information of the samples, linearised along the true run".into(),
        header: vec!["unknown", "verdict", "degree", "slope", "measured", "prior x10", "measured", ""],
        numbers: vec![false, false, true, true, true, true, true, false],
        rows: e.quantities.iter().map(row).collect(),
    }];
    let mut null: Vec<String> = e
        .symmetries
        .iter()
        .map(|s| {
            let seen = s.seen.measured.map_or_else(|| "-".into(), |x| format!("{x:.0e}"));
            format!("{}: seen with {seen} of the best direction, {}", s.words, said(&s.seen))
        })
        .collect();
    null.push(format!(
        "unobservable directions: {} exact, {} singular values vanish, {}",
        e.defect.predicted,
        e.defect.measured,
        if e.defect.pass { "agrees" } else { "DISAGREES" }
    ));
    blocks.push(Block::List { heading: "Directions that no output sees".into(), lines: null });
    blocks.push(Block::List {
        heading: "How".into(),
        lines: vec![
            format!(
                "slope: of log sigma against the log of a short horizon, -(degree + 1/2) at a fixed sampling rate; - where jumps or rounding hide it, or where it still changes with the horizon (up to {} long)",
                number(e.duration)
            ),
            "prior x10: the factor on sigma when a diffuse prior is ten times as loose; 1 for what is observable, 10 for what is not".into(),
            format!("a verdict is wrong with probability below {:.0e}; seed {}", e.error_bound, e.seed),
        ],
    });
    let verdict = match (e.passed, e.orders.measured < e.orders.of) {
        (false, _) => "filter and exact verdicts DISAGREE",
        (true, true) => "filter and exact verdicts agree as far as measured",
        (true, false) => "filter and exact verdicts agree",
    };
    let passed = format!("{} of {} checks passed", e.checks - e.failures, e.checks);
    Document {
        title: format!("Cross-check: {}", e.name),
        lead: vec![format!("{verdict}: {passed}, {} of {} degrees measured", e.orders.measured, e.orders.of)],
        blocks,
    }
}

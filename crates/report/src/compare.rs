//! Comparison of schemes.

use obsdeg_evidence::compare::{ComparedQuantity, ComparedScheme, Comparison, DropOne};
use obsdeg_evidence::requirements::{Requirements, Worst};
use obsdeg_evidence::simulation::CoefficientFloor;

use crate::document::{Document, DocumentBlock, left, number, optional, right};
use crate::{Answer, gimbals, omitted, resolve, stated, words};

pub(crate) fn worst(w: Option<&Worst>) -> String {
    w.map_or_else(|| "-".into(), |w| format!("{} ({})", number(w.sigma_dph), w.name))
}

/// Name of the figure of [`worst`]: with a bench it is the total uncertainty.
fn worst_heading(with_bench: bool) -> &'static str {
    if with_bench { "worst total(D), with the bench" } else { "worst sigma(D)" }
}

fn list(items: &[String]) -> String {
    if items.is_empty() { "-".into() } else { items.join(" ") }
}

/// `15 of 15`; with the words `by derivatives` if accuracy orders are not computed.
pub(crate) fn rank([rank, unknowns]: [usize; 2], with_dwell: bool) -> String {
    format!("{rank} of {unknowns}{}", if with_dwell { "" } else { " by derivatives" })
}

/// `met; 2.231 (D_IX)`.
pub(crate) fn requirements(r: &Requirements) -> String {
    let worst =
        stated::worst_margin(r).map_or_else(String::new, |w| format!(";{} {w}", stated::whose_margin(r)));
    match (r.stated, r.all_met()) {
        (0, _) => "none".into(),
        (_, true) => format!("met{worst}"),
        (stated, false) => format!("NOT met, {} of {stated} missed{worst}", r.missed.len()),
    }
}

/// Columns that are empty if no requirement is stated.
pub(crate) const REQUIREMENTS: [&str; 4] =
    ["requirements; worst margin", "met without", "required", "margin"];

/// One row per scheme.
fn overview(schemes: &[ComparedScheme]) -> DocumentBlock {
    let row = |r: &ComparedScheme| {
        let without = |keeps: fn(&&DropOne) -> bool| {
            let kept: Vec<String> = r.drop_one.iter().filter(keeps).map(|d| d.position.clone()).collect();
            if kept.len() > 1 && kept.len() == r.positions.len() { "any one".into() } else { list(&kept) }
        };
        vec![
            r.name.clone(),
            r.carry.to_string(),
            r.positions.len().to_string(),
            number(r.total_s),
            rank(r.rank, r.has_accuracy_orders),
            worst(r.worst.as_ref()),
            requirements(&r.requirements),
            without(|d| d.lost.is_empty()),
            without(|d| d.requirements.stated > 0 && d.requirements.all_met()),
        ]
    };
    DocumentBlock::table(
        format!("Side by side ({})", stated::predicted_of(schemes.iter().map(|r| &r.conditions))),
        [
            left("scheme"),
            left("carry"),
            right("positions"),
            right("total [s]"),
            right("rank with dwell"),
            left(worst_heading(has_bench(schemes))),
            left(REQUIREMENTS[0]),
            left("observable without"),
            left(REQUIREMENTS[1]),
        ],
        schemes.iter().map(row),
    )
}

/// True if a scheme has a bench; then all are compared with one.
fn has_bench(schemes: &[ComparedScheme]) -> bool {
    schemes.iter().any(|r| r.conditions.bench.is_some())
}

/// Uncertainty that requirements are compared with: the total with a bench, else sigma.
pub(crate) fn deciding(q: &ComparedQuantity) -> Option<f64> {
    q.total.or(q.sigma)
}

/// The unknowns of all schemes in the order of the first that has them.
pub(crate) fn unknowns(schemes: &[ComparedScheme]) -> Vec<&ComparedQuantity> {
    let mut out: Vec<&ComparedQuantity> = Vec::new();
    for q in schemes.iter().flat_map(|s| &s.quantities) {
        if !out.iter().any(|o| o.name == q.name) {
            out.push(q);
        }
    }
    out
}

/// Schemes as columns: what decides a requirement, and its ratio to that of the first scheme.
pub(crate) fn ratios(schemes: &[ComparedScheme]) -> DocumentBlock {
    let all = unknowns(schemes);
    let judged = all.iter().any(|q| q.requirement.is_some());
    let mut columns = vec![left("unknown"), left("unit")];
    columns.extend(judged.then(|| right("required")));
    columns.extend(schemes.iter().map(|s| right(s.name.clone())));
    let own = |s: &ComparedScheme, q: &ComparedQuantity| {
        s.quantities.iter().find(|own| own.name == q.name).cloned()
    };
    let row = |q: &ComparedQuantity| -> Vec<String> {
        let found: Vec<Option<ComparedQuantity>> = schemes.iter().map(|s| own(s, q)).collect();
        let first = found[0].as_ref().and_then(deciding);
        let cell = |(i, q): (usize, &Option<ComparedQuantity>)| {
            let required = q.as_ref().and_then(|q| q.requirement);
            let Some(value) = q.as_ref().and_then(deciding) else {
                return if required.is_some() { "- MISSED".into() } else { "-".into() };
            };
            let ratio = first.filter(|first| i > 0 && *first > 0.0);
            let ratio = ratio.map_or_else(String::new, |first| format!(" ({:.2})", value / first));
            let missed = required.is_some_and(|required| value > required);
            format!("{}{ratio}{}", number(value), if missed { " MISSED" } else { "" })
        };
        let required: Vec<Option<f64>> = found.iter().flatten().map(|q| q.requirement).collect();
        let same = required.windows(2).all(|pair| pair[0] == pair[1]);
        let required = if same { optional(q.requirement) } else { "differs".into() };
        [q.name.clone(), q.unit.clone()]
            .into_iter()
            .chain(judged.then_some(required))
            .chain(found.iter().enumerate().map(cell))
            .collect()
    };
    let bench = schemes.iter().any(|s| s.conditions.bench.is_some());
    let what = if bench { "Predicted sigma, with a bench the total uncertainty" } else { "Predicted sigma" };
    let ratio = if schemes.len() > 1 { ", and in brackets its ratio to the first scheme" } else { "" };
    DocumentBlock::table(
        format!("{what}{ratio} (- where it is not determined)"),
        columns,
        all.into_iter().map(row),
    )
}

/// One row per unknown: degree, accuracy order and sigma in every scheme.
fn by_unknown(schemes: &[ComparedScheme]) -> DocumentBlock {
    let mut names: Vec<&String> = Vec::new();
    for q in schemes.iter().flat_map(|r| &r.quantities) {
        if !names.contains(&&q.name) {
            names.push(&q.name);
        }
    }
    let with_bench = schemes.iter().flat_map(|r| &r.quantities).any(|q| q.total.is_some());
    let mut rows = Vec::new();
    for name in names {
        for r in schemes {
            let Some(q) = r.quantities.iter().find(|q| q.name == *name) else { continue };
            let mut row = vec![
                name.clone(),
                r.name.clone(),
                words::degree(q.degree),
                words::accuracy_order(q.degree, q.accuracy_order, r.has_accuracy_orders),
                optional(q.sigma),
            ];
            row.extend(with_bench.then(|| optional(q.total)));
            row.extend([
                q.unit.clone(),
                optional(q.requirement),
                optional(q.margin),
                excitation(q),
                if q.carried_by.len() == r.positions.len() { "all".into() } else { list(&q.carried_by) },
            ]);
            rows.push(row);
        }
    }
    let mut columns =
        vec![left("unknown"), left("scheme"), right("degree"), right("accuracy"), right("sigma")];
    columns.extend(with_bench.then(|| right("total")));
    columns.extend([
        left("unit"),
        right(REQUIREMENTS[2]),
        right(REQUIREMENTS[3]),
        left("excitation per position"),
        left("only by"),
    ]);
    let margin = if with_bench {
        "total: uncertainty with the bench of the scheme; margin: required over total, over sigma without a bench"
    } else {
        "margin: required over sigma"
    };
    let predicted = stated::predicted_of(schemes.iter().map(|r| &r.conditions));
    DocumentBlock::table(format!("By unknown ({predicted}; {margin})"), columns, rows)
}

/// `; half turns to p2 about -N, to p3 about N`.
fn half_turns(r: &ComparedScheme) -> String {
    let half = r.slews.iter().filter(|s| s.turn.is_half());
    let parts: Vec<String> =
        half.map(|s| format!("to {} about {}", s.to, words::direction(&s.turn.about))).collect();
    if parts.is_empty() { String::new() } else { format!("; half turns {}", parts.join(", ")) }
}

/// `1 0.7 0`.
fn excitation(q: &ComparedQuantity) -> String {
    let short = |x: &f64| {
        let text = format!("{x:.2}");
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    };
    q.excitation.iter().map(short).collect::<Vec<_>>().join(" ")
}

/// Predicted sigmas beside those of full attitudes, if the small-angle model does not hold at the scheme's
/// own drifts.
pub(crate) fn at_own_drifts(schemes: &[ComparedScheme]) -> Vec<DocumentBlock> {
    let large = || schemes.iter().filter(|r| r.validity.as_ref().is_some_and(|v| !v.holds));
    let rows = large().flat_map(|r| {
        let shown = r.quantities.iter().filter(|q| q.sigma_extended.is_some());
        shown.map(|q| {
            let [linear, full] = [q.sigma, q.sigma_extended].map(optional);
            vec![q.name.clone(), r.name.clone(), linear, full, q.unit.clone()]
        })
    });
    let rows: Vec<_> = rows.collect();
    if rows.is_empty() {
        return Vec::new();
    }
    let columns =
        [left("unknown"), left("scheme"), right("predicted"), right("full attitudes"), left("unit")];
    let reached = |r: &ComparedScheme| {
        let v = r.validity.as_ref()?;
        Some(format!(
            "{}: at the drifts that are stated |psi| reaches {} deg, and the small-angle model does NOT hold",
            r.name,
            number(v.largest_psi_deg)
        ))
    };
    let means = "full attitudes: sigma at the end of a filter that carries them, with the prior, linearised \
                 along the run of the drifts that are stated; an unknown that is not determined at small \
                 angles may be seen by large ones";
    vec![
        DocumentBlock::table("Sigma at the drifts that are stated", columns, rows),
        DocumentBlock::list(
            "Validity of the small-angle model",
            large().filter_map(reached).chain([means.into()]).collect(),
        ),
    ]
}

/// Answer on every scheme, then the carry and the conditions that are not stated.
fn lead(c: &Comparison) -> Vec<String> {
    let of = |text: String, r: &ComparedScheme| match c.schemes.len() {
        1 => stated::capital(&text),
        _ => format!("{}: {text}", r.name),
    };
    let mut out = Vec::new();
    if let [one] = &c.schemes[..] {
        out.extend(resolve::position_to_drop(one));
    }
    if !c.differ.is_empty() {
        out.push(format!("not like with like: the schemes differ in {}", c.differ.join(", ")));
    }
    for r in &c.schemes {
        let sigma = r.worst.as_ref().map_or_else(
            || "not every coefficient is determined".into(),
            |w| format!("{} {}", stated::worst(&r.requirements), stated::worst_sigma(w)),
        );
        out.push(of(format!("{}; {sigma}.", stated::requirements(&r.requirements)), r));
        let lead = omitted::lead(&r.omitted, r.requirements.with_bench, r.requirements.all_met());
        out.extend(lead.map(|t| of(t, r)));
    }
    let beyond = c.schemes.iter().filter_map(|r| Some((r, gimbals::lead(r.gimbals.as_ref())?)));
    out.extend(beyond.map(|(r, text)| format!("{}: {text}", r.name)));
    let mut said: Vec<String> = Vec::new();
    for r in &c.schemes {
        let lines =
            [Some(stated::carry(r.carry).into()), stated::other_carries(&r.other_carries).map(|t| of(t, r))];
        for line in lines.into_iter().flatten().chain(stated::by_default(&r.conditions)) {
            if !said.contains(&line) {
                said.push(line);
            }
        }
    }
    out.extend(said);
    out
}

/// Sentence on the conditions and positions of a scheme.
fn assumed(r: &ComparedScheme) -> String {
    format!(
        "{}: {}; positions {}{}",
        r.name,
        stated::measurement(&r.conditions).join("; "),
        r.positions.join(", "),
        half_turns(r)
    )
}

/// One row per scheme and position that is left out.
fn without_one_position(schemes: &[ComparedScheme]) -> DocumentBlock {
    let drop_rows = schemes.iter().flat_map(|r| {
        r.drop_one.iter().map(|d| {
            vec![
                r.name.clone(),
                d.position.clone(),
                list(&d.lost),
                worst(d.worst.as_ref()),
                requirements(&d.requirements),
            ]
        })
    });
    let figure = worst_heading(has_bench(schemes));
    let columns = ["scheme", "without", "not observable any more", figure, REQUIREMENTS[0]].map(left);
    DocumentBlock::table("Without one position", columns, drop_rows)
}

/// One row per condition and scheme: rank and worst sigma under the condition.
fn sensitivity(schemes: &[ComparedScheme]) -> DocumentBlock {
    let figure = worst_heading(has_bench(schemes));
    let conditions = schemes.first().map_or(&[][..], |r| &r.sensitivity);
    let mut names: Vec<&String> = conditions.iter().map(|s| &s.condition).collect();
    for s in schemes.iter().flat_map(|r| &r.sensitivity) {
        if !names.contains(&&s.condition) {
            names.push(&s.condition);
        }
    }
    let mut rows = Vec::new();
    for name in names {
        for r in schemes {
            if let Some(s) = r.sensitivity.iter().find(|s| s.condition == *name) {
                rows.push(vec![
                    name.clone(),
                    r.name.clone(),
                    rank(s.rank, r.has_accuracy_orders),
                    worst(s.worst.as_ref()),
                ]);
            }
        }
    }
    DocumentBlock::table(
        format!("Sensitivity of the {figure}"),
        [left("condition"), left("scheme"), right("rank with dwell"), left(figure)],
        rows,
    )
}

/// Noise floor of the coefficients in every scheme, with its meaning; empty if no scheme has one.
fn noise_floor(schemes: &[ComparedScheme]) -> Vec<DocumentBlock> {
    let floors = || schemes.iter().filter_map(|r| Some((r, r.noise_floor.as_ref()?)));
    if floors().next().is_none() {
        return Vec::new();
    }
    let mut columns = vec![left("coefficient"), left("scheme"), left("unit")];
    columns.extend(words::run::FLOOR.map(right));
    let mut names: Vec<&String> = Vec::new();
    for c in floors().flat_map(|(_, f)| &f.coefficients) {
        if !names.contains(&&c.name) {
            names.push(&c.name);
        }
    }
    let mut rows = Vec::new();
    for name in names {
        for (r, f) in floors() {
            let of = f.coefficients.iter().filter(|c| c.name == *name);
            let lead = |c: &CoefficientFloor| vec![name.clone(), r.name.clone(), c.unit.clone()];
            rows.extend(of.map(|c| [lead(c), words::run::floor(c).into()].concat()));
        }
    }
    let own = floors().map(|(r, f)| format!("{}: {}", r.name, words::run::floor_of(f).join("; ")));
    let means = words::run::FLOOR_MEANS.map(String::from).into_iter().chain(own);
    vec![
        DocumentBlock::table("Noise floor", columns, rows),
        DocumentBlock::list("Noise floor: what it is", means.collect()),
    ]
}

/// Meaning of the columns, one sentence each.
fn meaning(c: &Comparison) -> Vec<String> {
    let mut lines = vec![
        stated::predicted_of(c.schemes.iter().map(|r| &r.conditions)),
        "sigma(D) in deg/h, deg/h/g; - where an unknown is not determined".into(),
        "excitation: a product of components of g, its root mean square over the arc of a rotating segment"
            .into(),
        "observable without, met without: positions you can drop (one at a time) so that what is observable \
         stays so, and so that every requirement is met; only by: positions without which the unknown is not \
         observable"
            .into(),
        format!("seed {}", c.seed),
    ];
    if c.schemes.iter().any(|r| !r.slews.is_empty()) {
        lines.push(
            "no slews: slews need inertial carry, so other carries are taken with repositioning at once"
                .into(),
        );
    }
    lines
}

impl Answer for Comparison {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let schemes = &self.schemes[..];
        // without requirements their columns would be empty
        let judged = schemes.iter().any(|r| r.requirements.stated > 0);
        let left_out: &[&str] = if judged { &[] } else { &REQUIREMENTS };
        let first = vec![
            overview(schemes).without(left_out),
            ratios(schemes),
            DocumentBlock::list("Assumed", schemes.iter().map(assumed).collect()),
        ];
        let mut blocks = vec![by_unknown(schemes).without(left_out)];
        blocks.extend(at_own_drifts(schemes));
        blocks.push(without_one_position(schemes).without(left_out));
        blocks.push(sensitivity(schemes));
        for r in schemes {
            let whose = if schemes.len() > 1 { format!(" by {}", r.name) } else { String::new() };
            blocks.extend(omitted::blocks(&r.omitted, &whose));
        }
        blocks.extend(noise_floor(schemes));
        for r in schemes {
            let lines = gimbals::lines(r.gimbals.as_ref());
            blocks.extend(DocumentBlock::list_if_any(format!("Gimbals of {}", r.name), lines));
        }
        let missed = |r: &ComparedScheme| format!("{}: {}", r.name, stated::requirements(&r.requirements));
        if judged {
            blocks.push(DocumentBlock::list("Requirements", schemes.iter().map(missed).collect()));
        }
        blocks.push(DocumentBlock::list("Meaning of the columns", meaning(self)));
        let n = schemes.len();
        Document {
            title: format!("Comparison of {n} scheme{}", if n == 1 { "" } else { "s" }),
            lead: lead(self),
            blocks: first.into_iter().chain(DocumentBlock::details(1, "Details", blocks)).collect(),
        }
    }

    fn main_table(&self) -> &'static str {
        "schemes.quantities"
    }
}

//! The verdicts on a scheme.

use obsdeg_core::analysis::{Analysis, Component, PositionReport, Solution};
use obsdeg_core::degree::Status;
use obsdeg_core::solution::Formula;

use obsdeg_evidence::simulation::SchemeAnalysis;

use crate::document::{Document, DocumentBlock, TableCell, TableColumn, Typeset, left, right, short};
use crate::{Answer, Explanation, gimbals, latex, omitted, resolve, stated, why, words};

fn positions(positions: &[PositionReport]) -> DocumentBlock {
    let turned = positions.iter().any(|p| !p.turns.is_empty());
    let turns = |p: &PositionReport| p.turns.iter().map(words::turn).collect::<Vec<_>>().join(", ");
    let row = |p: &PositionReport| {
        let mut row = vec![
            p.name.clone(),
            words::assumptions::angles(p),
            p.attitude.clone().unwrap_or_default(),
            p.g_c.map_or_else(String::new, |g| g.map(short).join(", ")),
        ];
        row.extend(turned.then(|| turns(p)));
        row
    };
    let mut columns = vec![
        left("position"),
        left("alpha, beta, gamma [deg]"),
        left("X_p Y_p Z_p"),
        left("g in x, y, z [g]"),
    ];
    columns.extend(turned.then(|| left("reached by")));
    DocumentBlock::table("", columns, positions.iter().map(row))
}

/// Cell with a name or an expression in program notation, and its LaTeX.
fn expression(text: &str) -> TableCell {
    TableCell::formula(text, latex::expression(text))
}

/// Tables of the unknowns and of the combinations: name, verdict, solution.
fn verdicts(a: &Analysis) -> [DocumentBlock; 2] {
    let dwell = words::dwell_matters(a).then(|| left("with dwell"));
    let columns = |first: &[TableColumn], last| {
        [first, &[left("status"), right("degree")], dwell.as_slice(), &[left(last)]].concat()
    };
    let row = |first: Vec<TableCell>, status: Status, degree, order, last: TableCell| {
        let dwell = dwell.is_some().then(|| words::with_dwell(a, degree, order).into());
        [
            first,
            vec![status.to_string().into(), words::degree(degree).into()],
            Vec::from_iter(dwell),
            vec![last],
        ]
        .concat()
    };
    let solved = |s: &Option<Solution>, otherwise: String| match s {
        Some(s) => TableCell::formula(&s.text, latex::solution(s, a.frame, &a.stations)),
        None => otherwise.into(),
    };
    let unknowns = a.quantities.iter().map(|q| {
        let how = solved(&q.solution, words::explanation(q));
        row(vec![expression(&q.name), q.unit.as_str().into()], q.status, q.degree, q.accuracy_order, how)
    });
    let combinations = words::assumptions::combinations(a).map(|c| {
        let asked = if c.requested { " (asked for)" } else { "" };
        let name = expression(&c.expression);
        let name = TableCell { text: format!("{}{asked}", c.expression), ..name };
        row(vec![name], c.status, c.degree, c.accuracy_order, solved(&c.solution, String::new()))
    });
    [
        DocumentBlock::table(
            "Unknowns",
            columns(&[left("unknown"), left("unit")], "solution, or why there is none"),
            unknowns,
        ),
        DocumentBlock::table(
            "Observable combinations (and those asked for)",
            columns(&[left("combination")], "solution"),
            combinations,
        ),
    ]
}

/// Direction that Z does not observe.
pub(crate) fn null_vector(v: &[Component]) -> Typeset {
    let component = |c: &Component| {
        let value = c.coefficient.as_ref().map_or_else(|| "?".into(), |k| latex::expression(k));
        format!("\\delta {} = {value}", latex::symbol(&c.name))
    };
    Typeset { text: words::null_vector(v), latex: v.iter().map(component).collect::<Vec<_>>().join(",\\; ") }
}

fn formula(f: &Formula) -> Typeset {
    let at = f.position.as_ref().map(|p| format!(" @{p}")).unwrap_or_default();
    let left = latex::left(&f.left, f.position.as_deref());
    Typeset {
        text: format!("{}{at} = {}", f.left, f.right),
        latex: format!("{left} = {}", latex::expression(&f.right)),
    }
}

/// The degenerate angles, and the reason why some may be missing.
fn degenerate_angles(a: &Analysis) -> Option<DocumentBlock> {
    let mut lines: Vec<String> = a.degenerate_loci.iter().flatten().map(words::locus).collect();
    lines.extend(a.degenerate_loci.as_ref().map(|loci| words::loci(loci)));
    let incomplete = a.degenerate_loci_incomplete.as_ref();
    lines.extend(incomplete.map(|why| format!("there may be others: {why}")));
    let heading = match incomplete {
        Some(_) => "Degenerate angles (the list may lack some)",
        None => "Degenerate angles",
    };
    DocumentBlock::list_if_any(heading, lines)
}

impl Answer for SchemeAnalysis {
    fn layout(&self) -> Option<&str> {
        self.verdicts.layout()
    }

    fn document(&self) -> Document {
        let mut out = self.verdicts.document();
        let Some(s) = &self.sensitivities else { return out };
        out.blocks.extend(omitted::blocks(&s.effects, ""));
        out.blocks.push(DocumentBlock::list(
            "Sensitivities: the record that weights the samples",
            stated::measurement(&s.conditions),
        ));
        out
    }

    fn sentences(&self) -> Vec<String> {
        self.verdicts.sentences()
    }

    fn explanations(&self) -> Vec<Explanation> {
        self.verdicts.explanations()
    }
}

impl Answer for Analysis {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn explanations(&self) -> Vec<Explanation> {
        self.why.iter().map(Explanation::new).collect()
    }

    fn document(&self) -> Document {
        let [unknowns, combinations] = verdicts(self);
        let mut blocks = vec![positions(&self.positions)];
        blocks.extend(why::blocks(&self.why));
        blocks.push(unknowns);
        blocks.extend((!self.combinations.is_empty()).then_some(combinations));
        blocks.extend(DocumentBlock::list_if_any(words::ACCURACY, words::accuracy(self)));
        blocks.extend(DocumentBlock::formulas(
            format!("{} (a change along one leaves them as they are)", words::UNSEEN),
            self.null_space.iter().map(|v| null_vector(v)),
        ));
        let silent = words::not_excited(self);
        let silent = (!silent.is_empty()).then(|| silent.join(", "));
        blocks.extend(DocumentBlock::list_if_any("Not excited (never moves Z)", Vec::from_iter(silent)));
        blocks.extend(degenerate_angles(self));
        blocks.extend(DocumentBlock::formulas(
            "Z in n, and psi, eps in n at each position",
            self.formulas.iter().flatten().map(formula),
        ));
        blocks
            .extend(DocumentBlock::list_if_any("Under the other carries", words::assumptions::carries(self)));
        blocks
            .extend(self.omitted.as_ref().map(|o| DocumentBlock::list("Not estimated", omitted::classes(o))));
        blocks.extend(gimbals::block(self.gimbals.as_ref()));
        blocks.push(DocumentBlock::list("Assumed", words::assumptions::assumptions(self)));
        let notes = self.notes.iter().map(|n| format!("note: {n}"));
        blocks.push(DocumentBlock::list(
            "Certainty",
            std::iter::once(words::certainty(self)).chain(notes).collect(),
        ));
        Document {
            title: format!("Observable degrees: {}", words::headline(self)),
            lead: (self.sentences().into_iter())
                .chain([words::rank(self)])
                .chain(gimbals::lead(self.gimbals.as_ref()))
                .collect(),
            blocks,
        }
    }

    fn sentences(&self) -> Vec<String> {
        resolve::of_scheme(self)
    }
}

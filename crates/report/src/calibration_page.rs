//! Report of a calibration: decision and coefficients, fit, budget of the uncertainty, and changes since
//! earlier calibrations.

use obsdeg_calibration::{Calibration, CalibrationChange, SourceRecord, compared};

use crate::calibration_figures::file_name;
use crate::document::{Document, DocumentBlock, Grade, TableCell, estimate, left, number, optional, right};
use crate::review::calibrated::{Pictures, answers, pictures, status};
use crate::review::{answers, title};
use crate::words::{self, names};
use crate::{Answer, Origin, acceptance, stated};

/// Probability below which a change of all coefficients together is one.
const CHANCE: f64 = 0.001;
/// Change of one coefficient in sigma from which it is marked.
const MARKED: f64 = 3.0;

/// Report of the first of `calibrations`, which have names; the others are earlier ones, the latest first.
pub(crate) fn document(calibrations: &[(String, Calibration)], origin: &Origin) -> Document {
    let Some(((name, c), before)) = calibrations.split_first() else {
        return Document { title: String::new(), lead: Vec::new(), blocks: Vec::new() };
    };
    let scheme = c.name.as_str();
    let mut blocks = vec![title::of_one(&c.document, scheme), DocumentBlock::Text(made(c, origin))];
    let named = if name.is_empty() { "Calibration".into() } else { format!("Calibration {name}") };
    blocks.push(DocumentBlock::Status(vec![status(c, named)]));
    blocks.extend(answers::tables(&[answers(name, c)]));
    blocks.push(coefficients(c, before.first().map(|b| &b.1)));
    if let Some(a) = &c.acceptance {
        blocks.push(acceptance::table("Acceptance", a));
        blocks.push(DocumentBlock::list("Decision rule", acceptance::rule(a)));
    }
    for (earlier, b) in before {
        blocks.extend(changes(&compared(c, b), earlier));
    }
    blocks.push(DocumentBlock::NewPage);
    let Document { lead, blocks: own, .. } = c.document();
    blocks.push(DocumentBlock::Section { level: 1, title: "Fit and findings".into() });
    blocks.extend(lead.into_iter().map(DocumentBlock::Text));
    let (mut front, mut rest): (Vec<DocumentBlock>, Vec<DocumentBlock>) =
        own.into_iter().partition(is_of_the_fit);
    rest.retain(|b| !is_named(b, "Acceptance") && !is_named(b, "Decision rule"));
    let Pictures { estimates, residuals, details } = pictures(c, "c1");
    front.extend(residuals);
    blocks.extend(front);
    blocks.push(DocumentBlock::Section { level: 1, title: "Uncertainty".into() });
    blocks.push(budget(c));
    blocks.push(DocumentBlock::Text(PREDICTED.into()));
    blocks.extend(estimates);
    rest.extend(details);
    blocks.push(DocumentBlock::fold(1, "Details", rest));
    blocks.push(DocumentBlock::fold(1, "About this report", title::about(&c.version, origin)));
    let of = match (scheme.is_empty(), name.is_empty()) {
        (true, true) => c.records.iter().map(|r| r.name.as_str()).collect::<Vec<_>>().join(", "),
        (true, false) => name.clone(),
        (false, true) => scheme.into(),
        (false, false) => format!("{scheme} ({name})"),
    };
    Document { title: format!("Calibration: {of}"), lead: Vec::new(), blocks }
}

/// Sentence on the program and on what the calibration was made from: files with digests, else the records.
fn made(c: &Calibration, origin: &Origin) -> String {
    if !origin.inputs.is_empty() || c.rests_on.is_empty() {
        return title::made(&c.version, origin);
    }
    let of = |b: &SourceRecord| {
        let digest: String = b.digest.chars().take(title::DIGITS).collect();
        format!("{} (digest of its numbers {digest}...)", file_name(&b.record))
    };
    let records: Vec<String> = c.rests_on.iter().map(of).collect();
    format!("Made by obsdeg {} from {}.", c.version, records.join(", "))
}

/// Meaning of the predicted sigmas.
const PREDICTED: &str = "Predicted sigmas are those of the linear model at the times of the record, with its \
                         noise. The design predicts for the dwells, steps and noise that its scheme states: \
                         where the record has more samples or other noise, the two differ by the root of \
                         their ratio.";

fn is_named(b: &DocumentBlock, name: &str) -> bool {
    match b {
        DocumentBlock::Table { heading, .. } | DocumentBlock::List { heading, .. } => {
            heading.starts_with(name)
        }
        _ => false,
    }
}

fn is_of_the_fit(b: &DocumentBlock) -> bool {
    ["Fit", "Next runs", "Positions"].iter().any(|name| is_named(b, name))
}

/// Coefficients with what decides about them; psi is that of the start of a record.
fn coefficients(c: &Calibration, before: Option<&Calibration>) -> DocumentBlock {
    let mut columns = vec![
        left("coefficient"),
        left("unit"),
        right("estimate"),
        right("uncertainty"),
        right("required"),
        right("margin"),
        right("predicted sigma (without bench)"),
        right("sigma / predicted"),
    ];
    columns.extend(before.is_some().then(|| right("before")));
    let rows = c.quantities.iter().filter(|e| !e.name.starts_with("psi")).map(|e| {
        let u = e.uncertainty();
        let margin = u.zip(e.required_sigma).map(|(u, r)| r / u);
        let margin = match margin {
            Some(m) if e.from_prior => {
                TableCell::graded(format!("{} (prior alone)", number(m)), Grade::Limited)
            }
            Some(m) => TableCell::graded(number(m), if m >= 1.0 { Grade::Good } else { Grade::Missed }),
            None if e.required_sigma.is_some() => TableCell::graded("not determined", Grade::Missed),
            None => TableCell::from("-"),
        };
        let ratio = e.larger_sigma().zip(e.predicted_sigma).map(|(s, p)| s / p);
        let texts = [
            e.name.clone(),
            e.unit.clone(),
            estimate(e.estimate, u),
            optional(u),
            optional(e.required_sigma),
        ];
        let mut row: Vec<TableCell> = texts.into_iter().map(TableCell::from).collect();
        row.push(margin);
        row.extend([optional(e.predicted_sigma), optional(ratio)].map(TableCell::from));
        if let Some(b) = before {
            let own = b.quantities.iter().find(|q| q.name == e.name);
            row.push(TableCell::from(
                own.map_or_else(|| "-".into(), |q| estimate(q.estimate, q.uncertainty())),
            ));
        }
        row
    });
    DocumentBlock::table("Coefficients", columns, rows)
}

/// Budget of the uncertainty of each coefficient.
fn budget(c: &Calibration) -> DocumentBlock {
    let columns = [
        left("coefficient"),
        left("unit"),
        right("noise of the record"),
        right("rescaled by the fit"),
        right("bench and suspected errors"),
        right("uncertainty"),
        right("of the requirement [%]"),
    ];
    let rows = c.quantities.iter().filter(|e| !e.name.starts_with("psi")).map(|e| {
        let used = e.uncertainty().zip(e.required_sigma).map(|(u, r)| 100.0 * u / r);
        let numbers = [e.sigma, e.sigma_rescaled, e.outside(), e.uncertainty(), used].map(optional);
        [vec![e.name.clone(), e.unit.clone()], numbers.to_vec()].concat()
    });
    DocumentBlock::table(
        "Budget (root sum of squares: the larger sigma, and the errors outside the model)",
        columns,
        rows,
    )
}

/// Changes since an earlier calibration.
fn changes(change: &CalibrationChange, earlier: &str) -> Vec<DocumentBlock> {
    let texts =
        significance(change).into_iter().map(|s| DocumentBlock::Text(format!("{}.", stated::capital(&s))));
    std::iter::once(changed_coefficients(change, earlier)).chain(texts).collect()
}

/// Table of the coefficients with their changes.
fn changed_coefficients(change: &CalibrationChange, earlier: &str) -> DocumentBlock {
    let independent = change.shared.is_empty() && change.consistent;
    let columns = [
        left("coefficient"),
        left("unit"),
        right("before"),
        right("change"),
        right("sigma of the change"),
        right("in sigma"),
    ];
    let rows = change.coefficients.iter().map(|k| {
        let in_sigma = k.change / k.sigma;
        let marked = match (independent, in_sigma.abs() < MARKED) {
            (true, true) => TableCell::graded(number(in_sigma), Grade::Good),
            (true, false) => TableCell::graded(number(in_sigma), Grade::Limited),
            (false, _) => TableCell::from("-"),
        };
        let sigma = if independent { number(k.sigma) } else { "-".into() };
        let texts = [
            k.name.clone(),
            k.unit.clone(),
            number(k.before),
            estimate(Some(k.change), Some(k.sigma)),
            sigma,
        ];
        texts.into_iter().map(TableCell::from).chain([marked]).collect::<Vec<_>>()
    });
    DocumentBlock::table(format!("Changes since {earlier}"), columns, rows)
}

/// Sentences on the significance of the changes.
fn significance(change: &CalibrationChange) -> Vec<String> {
    let mut said: Vec<String> = Vec::new();
    if let Some(t) = change.together {
        let outcome = if t.probability < CHANCE {
            "the coefficients changed"
        } else {
            "no change beyond the uncertainties"
        };
        said.push(format!(
            "{outcome}: chi-square {} on {} degrees of freedom, probability {} if nothing changed",
            number(t.chi_square),
            t.degrees_of_freedom,
            words::chance(t.probability)
        ));
    }
    if !change.by_prior.is_empty() {
        let all = names(change.by_prior.iter().map(String::as_str));
        said.push(format!("not compared, since stated priors alone bound them: {all}"));
    }
    if !change.consistent {
        said.push("a calibration here is not consistent: its sigmas are not to be relied upon, and no change has a \
                   significance".into());
    }
    if change.with_bench {
        said.push(
            "the sigmas of the changes hold what the bench and suspected errors add to each calibration, as if the \
             two were independent; all changes together have no significance"
                .into(),
        );
    }
    if !change.shared.is_empty() {
        let shared = names(change.shared.iter().map(String::as_str));
        said.push(format!("both rest on {shared}, so that no change has a significance"));
    }
    said.extend((!change.differs.is_empty()).then(|| format!("other setup: {}", change.differs.join("; "))));
    said
}

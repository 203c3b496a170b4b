//! Effects of errors that a scheme does not estimate, as tables and sentences.

pub(super) mod calibration;
mod sizes;

use obsdeg_core::omitted::{OmittedClass, OmittedVerdicts};
use obsdeg_evidence::compare::ComparedScheme;
use obsdeg_evidence::simulation::omitted::{
    Advice, AdviceKind, Budget, BudgetLine, CarryUncertainty, FamilyEffect, OmittedEffects, SAMPLES,
};

use crate::document::{DocumentBlock, left, number, right};
use crate::words;
use sizes::{LEAST, below, is_small, limits, short};

/// Largest number of changes that are listed of a silent error.
const CHANGES: usize = 3;

/// Largest number of budgets that a document prints in full: those with the least margin, or with the largest
/// share of the bench.
const BUDGETS: usize = 3;

/// Largest number of lines of a printed budget and of listed silent errors; a report and the JSON have all.
const LINES: usize = 6;

/// Largest number of silent errors that a calibration names in its first sentence.
const SILENT: usize = 12;

/// Class of a family in words: the classes of its terms.
fn class(f: &FamilyEffect) -> String {
    let (Some(no_effect), Some(silent)) = (f.no_effect, f.silent) else { return "-".into() };
    let counts = [(no_effect, "no effect"), (silent, "silent"), (f.terms - no_effect - silent, "visible")];
    let all = counts.iter().find(|(n, _)| *n == f.terms);
    match all {
        Some((_, word)) => (*word).into(),
        None => {
            let some = counts.iter().filter(|(n, _)| *n > 0).map(|(n, word)| format!("{n} {word}"));
            some.collect::<Vec<_>>().join(", ")
        }
    }
}

fn row(f: &FamilyEffect) -> Vec<String> {
    let none = || "-".to_string();
    vec![
        format!("{} ({})", f.family, f.terms),
        class(f),
        f.worst.as_ref().map_or_else(none, |w| format!("{} {} per {}", number(w.per_unit), w.unit, f.unit)),
        f.worst.as_ref().map_or_else(none, |w| w.unknown.clone()),
        f.worst_in_sigmas.map_or_else(none, |x| format!("{} {}", short(1.0 / x), f.unit)),
        f.visible_from.map_or_else(none, |x| format!("{} {}", short(x), f.unit)),
        f.uses_up.as_ref().map_or_else(none, |u| match is_small(u.size, &f.unit) {
            true => format!("{} {} ({})", below(u.size), f.unit, u.unknown),
            false => "no small size".into(),
        }),
    ]
}

/// True if an error uses up the margin of a requirement.
fn judged(of: &OmittedEffects) -> bool {
    of.terms.iter().any(|t| t.uses_up.is_some())
}

/// The blocks of a document: the families, and the budgets where a bench is stated.
pub(crate) fn blocks(of: &OmittedEffects, whose: &str) -> Vec<DocumentBlock> {
    let columns = [
        left("family (terms)"),
        left("class"),
        right("worst change"),
        left("of"),
        right("as large as sigma at"),
        right("seen from (3 sigma)"),
        right("uses up a margin at"),
    ];
    let left_out: &[&str] = if judged(of) { &[] } else { &["uses up a margin at"] };
    let heading = format!("Not estimated{whose}: effect on the estimates");
    let mut out = vec![DocumentBlock::table(heading, columns, of.families.iter().map(row)).without(left_out)];
    out.push(DocumentBlock::list(format!("Not estimated{whose}: conditions"), conditions(of)));
    out.extend(trade(of, whose));
    out.extend(DocumentBlock::list_if_any(
        format!("Not estimated{whose}: what would help, each as it was tried"),
        advice(of),
    ));
    out.extend(printed(&of.budgets).into_iter().map(|b| budget(b, whose, LINES)));
    out
}

/// The blocks of a report: the families, and the budgets of all unknowns but psi in full, the least margin
/// first.
pub(crate) fn in_full(of: &OmittedEffects) -> (Vec<DocumentBlock>, Vec<DocumentBlock>) {
    let alone = OmittedEffects { budgets: Vec::new(), ..of.clone() };
    let budgets = of.budgets.iter().filter(|b| !b.unknown.starts_with("psi"));
    (blocks(&alone, ""), budgets.map(|b| budget(b, "", usize::MAX)).collect())
}

/// Bias of the accelerometers by which a review shows what they do, in ug.
const OFF_UG: f64 = 20.0;

/// Sizes of a bench by which a review shows what other errors outside the model do.
const TYPICAL: [(&str, f64); 3] = [("M", 10.0), ("M3", 10.0), ("M6", 10.0)];

/// Sentences on the largest change by errors of a typical bench, one for each family that is not estimated.
pub(crate) fn typical(review: &ComparedScheme) -> Vec<String> {
    TYPICAL
        .iter()
        .filter_map(|(name, size)| Some(format!("errors {}", by_size(review, name, *size)?)))
        .collect()
}

/// Sentence on the effect of accelerometers that are off by 20 ug.
pub(crate) fn accelerometers_off(review: &ComparedScheme) -> String {
    by_size(review, "K0", OFF_UG).map_or_else(
        || {
            format!(
                "Nothing changes: the scheme estimates K0, so that {OFF_UG} ug do not enter other estimates"
            )
        },
        |text| format!("Errors {text}"),
    )
}

/// Largest change of a coefficient by a family of errors, all of one size, against its requirement, and the
/// change by the size that the bench states; `None` for a family that is estimated.
fn by_size(review: &ComparedScheme, family: &str, size: f64) -> Option<String> {
    let of = &review.omitted;
    let f = of.families.iter().find(|f| f.family == family)?;
    let Some(w) = &f.worst else { return Some(format!("{family} of any size change no estimate")) };
    let own: Vec<Option<f64>> = of.terms.iter().filter(|t| t.family == family).map(|t| t.size).collect();
    let same = own.first().copied().flatten().filter(|size| own.iter().all(|s| *s == Some(*size)));
    let by = |size: f64| format!("{} {}", number(size * w.per_unit), w.unit);
    let stated = match same {
        Some(own) if own != size => format!("; {own} {}, as the bench states, by {}", f.unit, by(own)),
        None if own.iter().any(Option::is_some) => "; the bench states sizes of single terms".into(),
        Some(_) => "; the bench states this size".into(),
        None => String::new(),
    };
    let required = review.quantities.iter().find(|q| q.name == w.unknown).and_then(|q| q.requirement);
    let required = required
        .map_or_else(String::new, |r| format!(" ({} times what is required)", short(size * w.per_unit / r)));
    Some(format!(
        "{family} of {size} {} (1 sigma each) change {} most, by {}{required}{stated}",
        f.unit,
        w.unknown,
        by(size)
    ))
}

/// Sigma, bias and total of the worst drift coefficient under every carry; `None` without a bench.
fn trade(of: &OmittedEffects, whose: &str) -> Option<DocumentBlock> {
    let columns = [left("carry"), left("worst"), right("sigma"), right("bias"), right("total"), left("unit")];
    let row = |c: &CarryUncertainty| {
        let at_once = if c.without_slews { " (repositioning at once)" } else { "" };
        let mut cells = vec![format!("{}{at_once}", c.carry)];
        match &c.worst {
            Some(w) => cells.extend([
                w.unknown.clone(),
                number(w.sigma),
                number(w.bias),
                number(w.total),
                w.unit.clone(),
            ]),
            None => {
                cells.push("not all determined, or not judged".into());
                cells.extend(std::iter::repeat_n("-".into(), 4));
            }
        }
        cells
    };
    let heading = format!(
        "Carries{whose}: sigma, bias by the bench, and total of the coefficient with the largest total"
    );
    (!of.carries.is_empty()).then(|| DocumentBlock::table(heading, columns, of.carries.iter().map(row)))
}

/// Remedies, a line each: the largest total over its requirement with it, and its cost in sigma.
fn advice(of: &OmittedEffects) -> Vec<String> {
    of.advice.iter().map(advised).collect()
}

/// Line on one change that was tried.
pub(crate) fn advised(a: &Advice) -> String {
    let what = match a.kind {
        AdviceKind::Estimate => format!("Estimate {} too (add to the terms of the scheme)", a.what),
        AdviceKind::Relevel => "Level the platform again before each position (carry reset)".into(),
        AdviceKind::AddPosition => format!("Add a position {}, as long as the last one", a.what),
    };
    format!(
        "{what}: the largest total is {} times its requirement (now {}), sigmas at most {} times as large; {}",
        short(a.total_over_required),
        short(a.now),
        number(a.sigma_factor),
        if a.met { "every requirement is met" } else { "not enough by itself" }
    )
}

/// Uncertainty budget of one unknown in the form of the GUM, with its total; lines beyond `most`, and those
/// of less than [`LEAST`] percent, together in one line.
fn budget(b: &Budget, whose: &str, most: usize) -> DocumentBlock {
    let columns = [
        left("source"),
        left("type"),
        right("standard uncertainty"),
        right("sensitivity"),
        right("contribution"),
        right("percent"),
    ];
    let sensitivity = |l: &BudgetLine| match l.value_unit == b.unit {
        true => number(l.sensitivity),
        false => format!("{} {} per {}", number(l.sensitivity), b.unit, l.value_unit),
    };
    let row = |source: String, [kind, value, sensitivity]: [String; 3], contribution: f64, percent: f64| {
        let percent = format!("{percent:.1}");
        vec![source, kind, value, sensitivity, format!("{} {}", number(contribution), b.unit), percent]
    };
    let large = b.lines.iter().take_while(|l| l.percent >= LEAST).count().min(most);
    // the samples, and a single small source, have lines of their own
    let alone = b.lines.len() - large == 1;
    let shown = |(i, l): (usize, &BudgetLine)| alone || i < large || l.source == SAMPLES;
    let (shown, rest): (Vec<_>, Vec<_>) = b.lines.iter().enumerate().partition(|&line| shown(line));
    let mut rows: Vec<Vec<String>> = shown
        .iter()
        .map(|(_, l)| {
            let value = format!("{} {}", number(l.value), l.value_unit);
            let texts = [format!("{:?}", l.evaluation), value, sensitivity(l)];
            row(l.source.clone(), texts, l.contribution, l.percent)
        })
        .collect();
    let none = || ["-", "-", "-"].map(String::from);
    if !rest.is_empty() {
        let contribution = rest.iter().map(|(_, l)| l.contribution * l.contribution).sum::<f64>().sqrt();
        let percent = rest.iter().map(|(_, l)| l.percent).sum();
        rows.push(row(format!("{} smaller sources", rest.len()), none(), contribution, percent));
    }
    rows.push(row("total".into(), none(), b.total, b.lines.iter().map(|l| l.percent).sum()));
    let required = b.requirement.map_or_else(String::new, |r| format!(", required {}", number(r)));
    let heading =
        format!("Uncertainty budget of {}{whose}: total {} {}{required}", b.unknown, number(b.total), b.unit);
    DocumentBlock::table(heading, columns, rows)
}

/// Printed budgets: the largest totals over requirement first, then those with the smallest share of the
/// samples.
fn printed(budgets: &[Budget]) -> Vec<&Budget> {
    let over = |b: &Budget| b.requirement.map_or(0.0, |r| b.total / r);
    let share = |b: &Budget| {
        let own = b.lines.iter().filter(|l| l.source != SAMPLES);
        own.map(|l| l.percent).sum::<f64>()
    };
    let mut out: Vec<&Budget> = budgets.iter().filter(|b| b.lines.len() > 1).collect();
    out.sort_by(|a, b| over(b).total_cmp(&over(a)).then(share(b).total_cmp(&share(a))));
    out.truncate(BUDGETS);
    out
}

/// Conditions and meaning of the figures, one sentence each.
fn conditions(of: &OmittedEffects) -> Vec<String> {
    let mut out = vec![
        "worst change: of a drift coefficient, all terms of the family one unit large (root of the sum of squares), \
         by the weights of the predicted sigmas; term by term in the JSON"
            .into(),
        "no effect: enters no sample; silent: no record of this scheme shows it; visible: a record shows it from the \
         size given (exact classes, by ranks)"
            .into(),
        match of.attitudes {
            true => {
                "latitude, azimuth, earth_rate, gravity: stated value minus true value; attitude: each \
                 position by itself, about each platform axis"
            }
            false => {
                "latitude, azimuth, earth_rate, gravity: stated value minus true value; attitudes are not \
                 computed for rotating positions, nor for more than 64"
            }
        }
        .into(),
    ];
    if judged(of) && !of.budgets.is_empty() {
        out.push(
            "uses up a margin at: size in place of that of the bench, for the requirements that are met with it".into(),
        );
    }
    if !of.torquers_in_turns {
        out.push("GS and GM act at the earth rate alone: the turns between positions are not stated".into());
    }
    out.extend(of.correlated_noise.as_ref().map(|c| {
        format!(
            "the correlated noise of the accelerometers makes the sigmas of drift coefficients {} to {} \
             times as large as the white noise alone ({}, the most); it is counted in them",
            number(c.smallest),
            number(c.largest),
            c.unknown
        )
    }));
    out.extend(of.not_classified.as_ref().map(|why| format!("no exact classes: {why}")));
    let silent =
        of.terms.iter().filter(|t| t.class == Some(OmittedClass::Silent) && !t.sensitivities.is_empty());
    let silent = silent.filter_map(|t| {
        let exact = t.exact.as_ref().filter(|e| !e.is_empty())?;
        let changes: Vec<String> = exact.iter().map(|e| format!("{} by {}", e.unknown, e.change)).collect();
        Some((
            t.name.as_str(),
            format!("{} is silent and changes {}, in rad, rad/s and g", t.name, changes.join(", ")),
        ))
    });
    out.extend(first_lines(silent.collect()));
    if of.priors {
        out.push(
            "exact changes by silent errors are those by the samples alone: the stated priors hold part of \
             them back, as the figures per unit say"
                .into(),
        );
    }
    out
}

/// First lines on changes by silent errors, and the names of the errors without a line.
fn first_lines(all: Vec<(&str, String)>) -> Vec<String> {
    let shown = if all.len() == LINES + 1 { all.len() } else { LINES };
    let left: Vec<&str> = all.iter().skip(shown).map(|(name, _)| *name).collect();
    let more = (!left.is_empty()).then(|| {
        format!("silent and with changes of their own too (--format json has them): {}", left.join(", "))
    });
    all.into_iter().take(shown).map(|(_, line)| line).chain(more).collect()
}

/// First sentences: errors that the bench does not count, and sizes of errors without a stated size that
/// would use up a margin.
pub(crate) fn lead(of: &OmittedEffects, bench: bool, all_met: bool) -> Option<String> {
    let not_counted = not_counted(of, bench, all_met);
    if !all_met {
        return not_counted;
    }
    match met_while(of, bench, true) {
        Some(met) => Some(not_counted.into_iter().chain([met]).collect::<Vec<_>>().join(" ")),
        None => not_counted.filter(|_| bench),
    }
}

/// Sentence on errors that the bench does not count; `None` where it counts all that it states.
pub(crate) fn not_counted(of: &OmittedEffects, bench: bool, all_met: bool) -> Option<String> {
    let estimated = of.estimated.join(", ");
    let (is, does) = match of.estimated.len() {
        1 => ("is", "its size does"),
        _ => ("are", "their sizes do"),
    };
    match (bench || !all_met, of.estimated.is_empty()) {
        (false, true) => Some("No bench is stated (--bench).".to_string()),
        (false, false) => Some(format!("No size of the bench counts: {estimated} {is} estimated.")),
        (true, true) => None,
        (true, false) => Some(format!("Of the bench, {estimated} {is} estimated: {does} not count.")),
    }
}

/// Sentence on the sizes of errors without a stated size below which every requirement stays met; `None`
/// where no error uses up a margin. `single` adds the sizes of single terms.
pub(crate) fn met_while(of: &OmittedEffects, bench: bool, single: bool) -> Option<String> {
    // a family counts as stated if the bench states every term, also with size zero
    let open = |f: &&FamilyEffect| of.terms.iter().any(|t| t.family == f.family && t.size.is_none());
    let limit = |f: &'_ FamilyEffect| {
        let [all, one] = [f.uses_up.as_ref()?, f.one_uses_up.as_ref()?].map(|u| u.size);
        let alone = if !single || below(one) == below(all) {
            String::new()
        } else {
            format!(" (one term alone: {})", below(one))
        };
        Some((all, alone))
    };
    let open = of.families.iter().filter(open);
    let listed = limits(open.filter_map(|f| {
        let (size, more) = limit(f)?;
        Some((f.family.as_str(), size, f.unit.as_str(), more))
    }))?;
    Some(format!(
        "{}, each family by itself, 1 sigma of each of its terms: {}{}.",
        if bench { "Met while, of what the bench does not state" } else { "Met while" },
        listed,
        if of.attitudes { "" } else { "; attitudes are not computed here" }
    ))
}

/// The exact classes of an analysis, a line per class; silent errors with the unknowns that they change.
pub(crate) fn classes(of: &OmittedVerdicts) -> Vec<String> {
    let mut out = Vec::new();
    let means = [
        (OmittedClass::NoEffect, "no effect, whatever the weights"),
        (OmittedClass::Silent, "silent, no record of this scheme shows it"),
        (OmittedClass::Visible, "visible in a record, if it is large enough"),
    ];
    for (class, words) in means {
        let own: Vec<_> = of.terms.iter().filter(|t| t.class == class).collect();
        let mut families: Vec<(&str, Vec<&str>, usize)> = Vec::new();
        for t in own {
            match families.iter_mut().find(|f| f.0 == t.family) {
                Some(f) => f.1.push(&t.name),
                None => {
                    let all = of.terms.iter().filter(|o| o.family == t.family).count();
                    families.push((&t.family, vec![&t.name], all));
                }
            }
        }
        // a complete family is listed by its name
        let named = families.into_iter().map(|(family, names, all)| match names.len() == all {
            true => family.to_string(),
            false => names.join(", "),
        });
        let named: Vec<String> = named.collect();
        if !named.is_empty() {
            out.push(format!("{words}: {}", named.join(", ")));
        }
    }
    let silent = of.terms.iter().filter(|t| t.changes.iter().any(|c| !c.starts_with("psi")));
    let silent = silent.map(|t| {
        let exact = t.exact.as_ref().map(|e| {
            e.iter().map(|e| format!("{} by {}", e.unknown, e.change)).collect::<Vec<_>>().join(", ")
        });
        let exact = exact.unwrap_or_else(|| t.changes.join(", "));
        (t.name.as_str(), format!("{} changes {exact}, in rad, rad/s and g", t.name))
    });
    out.extend(first_lines(silent.collect()));
    out.push(format!(
        "classes: exact ranks modulo two random primes, {}; {}",
        words::wrong_below(of.error_bound),
        match of.torquers_in_turns {
            true => "GS and GM act in the stated turns too",
            false => "GS and GM act at the earth rate alone",
        }
    ));
    out
}

#[cfg(test)]
mod tests {
    use super::below;

    /// Three digits, never above the number.
    #[test]
    fn limits_are_rounded_down() {
        let shown = [3.0799, 3.36, 0.0999999, 0.00336, 12345.9, 99.99, 4.567e-7, 2e9].map(below);
        assert_eq!(
            shown,
            ["3.07", "3.36", "0.0999", "0.00336", "12300", "99.9", "4.56e-7", "2.00e9"].map(String::from)
        );
        for k in 1..2000 {
            let x = 1.0137f64.powi(k - 1000);
            let said: f64 = below(x).parse().expect("a number");
            assert!(said <= x * (1.0 + 1e-15) && said > 0.989 * x, "{x} {said}");
        }
    }
}

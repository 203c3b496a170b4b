//! LaTeX tables for `\input`: booktabs, longtable, amsmath.

mod math;

use obsdeg_core::analysis::Analysis;

use crate::{visible, words};
use math::left;
#[cfg(feature = "pdf")]
pub(crate) use math::{FUNCTIONS, GREEK};
pub(crate) use math::{expression, solution, symbol};

/// Plain text with LaTeX's special characters escaped.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in visible(text).replace("->", "\u{2192}").chars() {
        match c {
            '\u{2192}' => out.push_str("$\\to$"),
            '\\' => out.push_str("\\textbackslash{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => {
                out.push('\\');
                out.push(c);
            }
            '<' | '>' => out.push_str(&format!("${c}$")),
            _ => out.push(c),
        }
    }
    out
}

/// A document to be compiled by itself.
pub(crate) fn document(d: &crate::document::Document) -> String {
    format!(
        "\\documentclass[a4paper]{{article}}\n\\usepackage{{amsmath,booktabs,graphicx,longtable}}\n\\usepackage[margin=15mm]{{geometry}}\n\
         \\title{{{}}}\n\\date{{}}\n\\begin{{document}}\n\\maketitle\n\\footnotesize\n{}\\end{{document}}\n",
        escape(&d.title),
        d.latex()
    )
}

/// A longtable.
pub(crate) fn table(columns: &str, header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut out = format!(
        "\\begin{{longtable}}{{{columns}}}\n\\toprule\n{} \\\\\n\\midrule\n\\endhead\n",
        header.join(" & ")
    );
    for row in rows {
        out.push_str(&format!("{} \\\\\n", row.join(" & ")));
    }
    out + "\\bottomrule\n\\end{longtable}\n"
}

pub(crate) fn analysis(a: &Analysis) -> String {
    let names = &a.stations;
    let mut out = String::from("% needs the packages booktabs, longtable and amsmath\n");
    out.push_str(&format!(
        "\\paragraph{{Observable degrees}} {}; {}.\n",
        escape(&words::headline(a)),
        escape(&words::rank(a))
    ));
    out.push_str(&table(
        "lll",
        &["position", "$\\alpha, \\beta, \\gamma$ [deg]", "$X_p\\,Y_p\\,Z_p$"],
        a.positions.iter().map(|p| {
            let angles: Vec<String> = p.angles_deg.iter().map(|x| escape(&x.to_string())).collect();
            let angles = words::turned(&angles.join(", "), p.rotation.as_deref().map(escape).as_deref());
            vec![escape(&p.name), angles, p.attitude.clone().unwrap_or_default()]
        }),
    ));
    let dwell = words::dwell_matters(a).then_some(words::WITH_DWELL);
    // the last column takes what the others leave
    let (side, width) = dwell.map_or(("", "0.5"), |_| ("l", "0.4"));
    let header = |first: &[&'static str]| {
        first
            .iter()
            .copied()
            .chain(["verdict", "degree"])
            .chain(dwell)
            .chain(["solution"])
            .collect::<Vec<_>>()
    };
    let with_dwell = |degree, order| dwell.map(|_| words::with_dwell(a, degree, order));
    out.push_str(&table(
        &format!("lllr{side}p{{{width}\\linewidth}}"),
        &header(&["unknown", "unit"]),
        a.quantities.iter().map(|q| {
            let how = match &q.solution {
                Some(s) => format!("${}$", solution(s, a.frame, names)),
                None => escape(&words::explanation(q)),
            };
            let mut row = vec![
                format!("${}$", symbol(&q.name)),
                escape(&q.unit),
                q.status.to_string(),
                words::degree(q.degree),
            ];
            row.extend(with_dwell(q.degree, q.accuracy_order));
            row.push(how);
            row
        }),
    ));
    if !a.combinations.is_empty() {
        out.push_str(&table(
            &format!("llr{side}p{{{width}\\linewidth}}"),
            &header(&["combination"]),
            a.combinations.iter().map(|c| {
                let how = c
                    .solution
                    .as_ref()
                    .map_or_else(String::new, |s| format!("${}$", solution(s, a.frame, names)));
                let mut row = vec![
                    format!("${}$", expression(&c.expression)),
                    c.status.to_string(),
                    words::degree(c.degree),
                ];
                row.extend(with_dwell(c.degree, c.accuracy_order));
                row.push(how);
                row
            }),
        ));
    }
    let mut lines: Vec<String> = words::accuracy(a).iter().map(|l| escape(l)).collect();
    for v in &a.null_space {
        let part = |c: &obsdeg_core::analysis::Component| {
            let value = c.coefficient.as_ref().map_or_else(|| "?".into(), |k| expression(k));
            format!("${} = {value}$", symbol(&c.name))
        };
        lines.push(format!(
            "not seen by derivatives of $Z$: {}",
            v.iter().map(part).collect::<Vec<_>>().join(", ")
        ));
    }
    for f in a.formulas.iter().flatten() {
        lines.push(format!("${} = {}$", left(&f.left, f.position.as_deref()), expression(&f.right)));
    }
    for c in &a.carries {
        lines.push(escape(&format!("under the other carry {}: {}", words::carry(c), words::differences(c))));
    }
    lines.extend(
        a.degenerate_loci
            .iter()
            .flat_map(|l| l.iter().map(words::locus).chain([words::loci(l)]))
            .map(|l| escape(&format!("degenerate: {l}"))),
    );
    lines.extend(words::assumptions(a).iter().map(|s| escape(&format!("assumed: {s}"))));
    lines.push(escape(&words::certainty(a)));
    lines.extend(a.notes.iter().map(|n| escape(&format!("note: {n}"))));
    out.push_str("\\begin{itemize}\n");
    for line in lines {
        out.push_str(&format!("\\item {line}\n"));
    }
    out + "\\end{itemize}\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_characters() {
        assert_eq!(escape("50% & a_b"), "50\\% \\& a\\_b");
    }
}

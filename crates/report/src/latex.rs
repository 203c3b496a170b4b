//! LaTeX tables for `\input`: booktabs, longtable, amsmath.

use obsdeg_core::analysis::{Analysis, Solution};
use obsdeg_core::degree::coefficient::Coefficient;
use obsdeg_core::solution::print::{Group, group};
use obsdeg_core::solution::solver::{Frame, Term};

use crate::words;

/// Plain text with LaTeX's special characters escaped.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in text.replace("->", "\u{2192}").chars() {
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

/// The math of one name: `D_FX`, `psi_x@1`, `eps_y^n`, `wN`.
pub(crate) fn symbol(name: &str) -> String {
    let (base, position) = name.split_once('@').map_or((name, None), |(b, p)| (b, Some(p)));
    let (base, frame) = base.strip_suffix("^n").map_or((base, ""), |b| (b, "^{n}"));
    let body = match base.split_once('_') {
        Some(("psi", axis)) => format!("\\psi_{{{axis}}}"),
        Some(("eps", axis)) => format!("\\varepsilon_{{{axis}}}"),
        Some(("D", rest)) => format!("D_{{{rest}}}"),
        _ => match base {
            "wN" => "\\omega_N".into(),
            "wU" => "\\omega_U".into(),
            other => name_of_model(other),
        },
    };
    let position = position.map(|p| format!("^{{({p})}}")).unwrap_or_default();
    format!("{body}{frame}{position}")
}

/// Greek letters, by the names that they have in both notations.
pub(crate) const GREEK: [&str; 21] = [
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu",
    "nu", "xi", "pi", "rho", "sigma", "tau", "phi", "chi", "omega",
];

/// A name of a model: `gamma` is Greek, `k21` and `k_on` have an index.
fn name_of_model(name: &str) -> String {
    let letter = |text: &str| match text {
        t if GREEK.contains(&t) => Some(format!("\\{t}")),
        t if t.len() == 1 => Some(t.to_string()),
        _ => None,
    };
    let digits = name.find(|c: char| c.is_ascii_digit() || c == '_').unwrap_or(name.len());
    let (base, index) = name.split_at(digits);
    let index = index.strip_prefix('_').unwrap_or(index);
    match letter(base) {
        Some(base) if index.is_empty() => base,
        Some(base) if index.chars().all(|c| c.is_ascii_alphanumeric()) => {
            format!("{base}_{{\\mathit{{{index}}}}}")
        }
        _ => format!("\\mathit{{{}}}", escape(name)),
    }
}

/// An expression in program notation as math: names are set, `*` dropped, `sqrt(2)` and functions
/// turned into macros.
pub(crate) fn expression(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        if c.is_ascii_alphabetic() {
            let mut end = rest
                .find(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '@'))
                .unwrap_or(rest.len());
            if rest[end..].starts_with("^n") {
                end += 2;
            }
            let word = &rest[..end];
            rest = &rest[end..];
            match word {
                "sqrt" => {
                    let close = rest.find(')').unwrap_or(rest.len().saturating_sub(1));
                    out.push_str(&format!("\\sqrt{{{}}}", rest.get(1..close).unwrap_or("")));
                    rest = rest.get(close + 1..).unwrap_or("");
                }
                "deg" => out.push_str("^{\\circ}"),
                "sin" | "cos" | "tan" => out.push_str(&format!("\\{word}")),
                _ => out.push_str(&symbol(word)),
            }
            continue;
        }
        match c {
            '*' => out.push_str("\\,"),
            '^' => {
                let digits = rest[1..].find(|c: char| !c.is_ascii_digit()).map_or(rest.len(), |e| e + 1);
                out.push_str(&format!("^{{{}}}", &rest[1..digits]));
                rest = &rest[digits..];
                continue;
            }
            _ => out.push(c),
        }
        rest = &rest[c.len_utf8()..];
    }
    out
}

fn z(term: &Term, frame: Frame, positions: &[String]) -> String {
    let letter = match term.order {
        0 => "Z".to_string(),
        1 => "\\dot{Z}".into(),
        2 => "\\ddot{Z}".into(),
        k => format!("Z^{{({k})}}"),
    };
    let index = match (frame, term.azimuth) {
        (_, true) => "a".to_string(),
        (Frame::N, _) => term.component.to_string(),
        (Frame::Platform, _) => ["x", "y", "z"][term.component - 1].into(),
    };
    format!("{letter}_{{{index}}}(\\text{{{}}})", escape(&positions[term.position]))
}

fn coefficient(c: &Coefficient) -> String {
    let (_, factors) = c.sign_and_factors();
    factors.iter().map(|f| quotient(f)).collect::<Vec<_>>().join("\\,")
}

/// An expression; `a/b` without brackets is set as a fraction.
fn quotient(text: &str) -> String {
    match text.split_once('/') {
        Some((above, below)) if !text.contains(['(', ')', ' ']) && !below.contains(['/', '*']) => {
            format!("\\frac{{{}}}{{{}}}", expression(above), expression(below))
        }
        _ => expression(text),
    }
}

fn sum(out: &mut String, negative: bool, text: &str) {
    out.push_str(match (out.is_empty(), negative) {
        (true, true) => "-",
        (true, false) => "",
        (false, true) => " - ",
        (false, false) => " + ",
    });
    out.push_str(text);
}

pub(crate) fn solution(s: &Solution, frame: Frame, positions: &[String]) -> String {
    let grouped = group(&s.solved);
    let mut inner = String::new();
    let bracket = |g: &Group| {
        let mut terms = String::new();
        for (negative, t) in &g.terms {
            sum(&mut terms, *negative, &z(t, frame, positions));
        }
        if g.terms.len() > 1 { format!("({terms})") } else { terms }
    };
    for g in &grouped.groups {
        let c = coefficient(&g.coefficient);
        if c.is_empty() {
            for (negative, t) in &g.terms {
                sum(&mut inner, *negative != g.negative, &z(t, frame, positions));
            }
        } else {
            sum(&mut inner, g.negative, &format!("{c}\\,{}", bracket(g)));
        }
    }
    match &grouped.factor {
        None => inner,
        Some(f) => format!("{}\\,[{inner}]", coefficient(f)),
    }
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
    out.push_str(&table(
        "lllrp{0.5\\linewidth}",
        &["unknown", "unit", "verdict", "degree", "solution"],
        a.quantities.iter().map(|q| {
            let how = match &q.solution {
                Some(s) => format!("${}$", solution(s, a.frame, names)),
                None => escape(&words::explanation(q)),
            };
            vec![
                format!("${}$", symbol(&q.name)),
                escape(&q.unit),
                q.status.to_string(),
                words::degree(q.degree),
                how,
            ]
        }),
    ));
    if !a.combinations.is_empty() {
        out.push_str(&table(
            "llrp{0.5\\linewidth}",
            &["combination", "verdict", "degree", "solution"],
            a.combinations.iter().map(|c| {
                let how = c
                    .solution
                    .as_ref()
                    .map_or_else(String::new, |s| format!("${}$", solution(s, a.frame, names)));
                vec![
                    format!("${}$", expression(&c.expression)),
                    c.status.to_string(),
                    words::degree(c.degree),
                    how,
                ]
            }),
        ));
    }
    let mut lines: Vec<String> = words::accuracy(a).iter().map(|l| escape(l)).collect();
    for v in &a.null_space {
        let part = |c: &obsdeg_core::analysis::Component| {
            let value = c.coefficient.as_ref().map_or_else(|| "?".into(), |k| expression(k));
            format!("${} = {value}$", symbol(&c.name))
        };
        lines.push(format!("not seen by $Z$: {}", v.iter().map(part).collect::<Vec<_>>().join(", ")));
    }
    for c in &a.carries {
        lines.push(escape(&format!("under the other carry {}: {}", words::carry(c), words::differences(c))));
    }
    lines.extend(
        a.degenerate_loci.iter().flatten().map(|l| escape(&format!("degenerate: {}", words::locus(l)))),
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
    fn names_and_expressions() {
        assert_eq!(symbol("D_FX"), "D_{FX}");
        assert_eq!(symbol("psi_x@12"), "\\psi_{x}^{(12)}");
        assert_eq!(symbol("eps_y^n"), "\\varepsilon_{y}^{n}");
        assert_eq!(expression("D_FZ - wN*psi_y"), "D_{FZ} - \\omega_N\\,\\psi_{y}");
        assert_eq!(expression("sqrt(2)*cos(alpha)^2/4"), "\\sqrt{2}\\,\\cos(\\alpha)^{2}/4");
        assert_eq!(expression("k21*gamma - V_max"), "k_{\\mathit{21}}\\,\\gamma - V_{\\mathit{max}}");
        assert_eq!(expression("sin(25 deg)"), "\\sin(25 ^{\\circ})");
        assert_eq!(escape("50% & a_b"), "50\\% \\& a\\_b");
    }
}

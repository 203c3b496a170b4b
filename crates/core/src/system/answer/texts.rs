//! Names, symmetries and invariants of a judged system in words.

use super::super::functions::gcd;
use super::super::judge::verdicts::Judgement;
use super::super::model::SystemModel;
use super::super::symmetry::{Invariant, PolynomialDirection, PolynomialTerm, Symmetries, Symmetry};
use super::data::{SymmetryReport, SystemCombination};

/// Name of an unknown; known constants are numbered after the unknowns.
pub(super) fn name_of(model: &SystemModel, judged: &Judgement, c: usize) -> String {
    match judged.layout.unknowns.get(c) {
        Some(u) => u.name.clone(),
        None => model.constants[c - judged.layout.unknowns.len()].0.name.clone(),
    }
}

pub(super) fn named(list: &[Vec<usize>], name: &dyn Fn(usize) -> String) -> Vec<Vec<String>> {
    list.iter().map(|columns| columns.iter().map(|&c| name(c)).collect()).collect()
}

/// `c`, or a similar name that the model does not use.
fn free_name(model: &SystemModel) -> String {
    let own = model.slot_names();
    let taken = |name: &str| own.iter().any(|n| n == name);
    ["c", "s", "k", "factor"].into_iter().find(|n| !taken(n)).unwrap_or("factor_").into()
}

/// Symmetries of a judged model in words: scalings and translations, then polynomial directions.
pub fn symmetry_reports(
    model: &SystemModel,
    judged: &Judgement,
    symmetries: &Symmetries,
) -> Vec<SymmetryReport> {
    let c = free_name(model);
    let name = &|c: usize| name_of(model, judged, c);
    let plain = symmetries.found.iter().map(|s| SymmetryReport {
        words: words(s, &c, name),
        unknowns: {
            let scaled = |t: &&(usize, _)| s.scaling.iter().any(|own| own.0 == t.0);
            let moved = s.translation.iter().filter(|t| !scaled(t));
            s.scaling.iter().chain(moved).map(|t| name(t.0)).collect()
        },
    });
    let polynomial = symmetries.polynomial.iter().map(|d| SymmetryReport {
        words: along(d, name),
        unknowns: d.components.iter().map(|c| name(c.0)).collect(),
    });
    plain.chain(polynomial).collect()
}

/// Text such as `move x, y, theta along -y, x, 1`.
fn along(d: &PolynomialDirection, name: &dyn Fn(usize) -> String) -> String {
    let term = |(factors, (p, q)): &PolynomialTerm, first: bool| {
        let sign = match (*p < 0, first) {
            (true, true) => "-",
            (true, false) => " - ",
            (false, true) => "",
            (false, false) => " + ",
        };
        let size = match (p.abs(), *q) {
            (1, 1) if !factors.is_empty() => String::new(),
            (p, 1) => p.to_string(),
            (p, q) => format!("{p}/{q}"),
        };
        let mut powers: Vec<(usize, usize)> = Vec::new();
        for &f in factors {
            match powers.last_mut() {
                Some((last, power)) if *last == f => *power += 1,
                _ => powers.push((f, 1)),
            }
        }
        let power = |&(f, power): &(usize, usize)| match power {
            1 => name(f),
            k => format!("{}^{k}", name(f)),
        };
        let factor = powers.iter().map(power).collect::<Vec<_>>().join("*");
        let times = if size.is_empty() || factor.is_empty() { "" } else { "*" };
        format!("{sign}{size}{times}{factor}")
    };
    let component = |terms: &Vec<PolynomialTerm>| -> String {
        terms.iter().enumerate().map(|(i, t)| term(t, i == 0)).collect()
    };
    let names: Vec<String> = d.components.iter().map(|c| name(c.0)).collect();
    let speeds: Vec<String> = d.components.iter().map(|c| component(&c.1)).collect();
    format!("move {} along {}", names.join(", "), speeds.join(", "))
}

/// A symmetry as its effect on the unknowns, for every `c` (every positive one if it has a scaling). It is
/// the flow of `x_i' = c_i x_i + d_i` after the time `log c`, or after `c` without a scaling. Examples:
/// `multiply a, b by c; divide d by c^2`, `add c to x; subtract 2 c from y`,
/// `multiply a by c; replace x by c*x + 1 - c; add log(c) to y`.
fn words(s: &Symmetry, c: &str, name: &dyn Fn(usize) -> String) -> String {
    let fraction = |(p, q): (i64, i64)| if q == 1 { p.to_string() } else { format!("{p}/{q}") };
    let power = |(p, q): (i64, i64)| match (p, q) {
        (1, 1) => c.to_string(),
        (p, 1) if p > 0 => format!("{c}^{p}"),
        k => format!("{c}^({})", fraction(k)),
    };
    let step = if s.scaling.is_empty() { c.to_string() } else { format!("log({c})") };
    let amount = |(p, q): (i64, i64)| {
        if (p, q) == (1, 1) { step.clone() } else { format!("{} {step}", fraction((p, q))) }
    };
    // unknowns with the same change stand together
    let mut groups: Vec<(String, Vec<String>, String)> = Vec::new();
    let mut put =
        |verb: &str, name: String, rest: String| match groups.iter_mut().find(|g| g.0 == verb && g.2 == rest)
        {
            Some(group) => group.1.push(name),
            None => groups.push((verb.into(), vec![name], rest)),
        };
    for &(i, (p, q)) in &s.scaling {
        let Some(&(_, (d, e))) = s.translation.iter().find(|t| t.0 == i) else {
            let verb = if p > 0 { "multiply" } else { "divide" };
            put(verb, name(i), format!("by {}", power((p.abs(), q))));
            continue;
        };
        // x' = k x + d moves x away from -d/k
        let (above, below) = (d * q, e * p);
        let divisor = gcd(above, below) * below.signum();
        let (centre, factor) = ((above / divisor, below / divisor), power((p, q)));
        let size = match (centre.0.abs(), centre.1) {
            (1, 1) => String::new(),
            size => format!("{}*", fraction(size)),
        };
        let moved = match (centre.0 > 0, size.is_empty()) {
            (true, true) => format!("{factor} - 1"),
            (false, true) => format!("1 - {factor}"),
            (true, false) => format!("{size}({factor} - 1)"),
            (false, false) => format!("{size}(1 - {factor})"),
        };
        put("replace", name(i), format!("by {factor}*{} + {moved}", name(i)));
    }
    let scaled = |i: usize| s.scaling.iter().any(|t| t.0 == i);
    for &(i, (p, q)) in s.translation.iter().filter(|t| !scaled(t.0)) {
        let (verb, to) = if p > 0 { ("add", "to") } else { ("subtract", "from") };
        put(&format!("{verb} {} {to}", amount((p.abs(), q))), name(i), String::new());
    }
    let join = |(verb, names, rest): &(String, Vec<String>, String)| {
        format!("{verb} {} {rest}", names.join(", ")).trim_end().to_string()
    };
    groups.iter().map(join).collect::<Vec<_>>().join("; ")
}

/// Observable combinations of unobservable unknowns in words, in the order of `symmetries.invariants`.
pub fn invariant_reports(judged: &Judgement, symmetries: &Symmetries) -> Vec<SystemCombination> {
    let name = |c: usize| judged.layout.unknowns[c].in_formulas();
    let product = |i: &Invariant| {
        let power = |&(c, m): &(usize, i64)| match m.abs() {
            1 => name(c),
            m => format!("{}^{m}", name(c)),
        };
        let part = |positive: bool| -> Vec<String> {
            i.terms.iter().filter(|t| (t.1 > 0) == positive).map(power).collect()
        };
        let (above, below) = (part(true), part(false));
        let above = if above.is_empty() { "1".into() } else { above.join("*") };
        match below.len() {
            0 => above,
            1 => format!("{above}/{}", below[0]),
            _ => format!("{above}/({})", below.join("*")),
        }
    };
    let sum = |i: &Invariant| {
        let mut out = String::new();
        for &(c, m) in &i.terms {
            let sign = match (out.is_empty(), m > 0) {
                (true, true) => "",
                (true, false) => "-",
                (false, true) => " + ",
                (false, false) => " - ",
            };
            let factor = if m.abs() == 1 { String::new() } else { format!("{}*", m.abs()) };
            out.push_str(&format!("{sign}{factor}{}", name(c)));
        }
        out
    };
    let report = |i: &Invariant| SystemCombination {
        expression: if i.product { product(i) } else { sum(i) },
        degree: Some(i.degree),
        number_of_solutions: None,
    };
    symmetries.invariants.iter().map(report).collect()
}

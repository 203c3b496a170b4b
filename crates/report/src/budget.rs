//! Uncertainty budgets: all lines as CSV, and stacked bars.

use std::fmt::Write;

use obsdeg_evidence::simulation::omitted::{Budget, OmittedEffects, SAMPLES};

use crate::ReportError;
use crate::csv_text::write;
use crate::document::number;
use crate::figure::{AMBER, BLACK, BLUE, FONT, GREEN, GREY, ORANGE, PURPLE, SKY};
use crate::visible::escaped;

/// Colours of the families; samples are grey.
const COLORS: [&str; 6] = [ORANGE, BLUE, GREEN, AMBER, PURPLE, SKY];
/// Largest number of bars in a picture; the CSV has all budgets.
const BARS: usize = 40;
/// Widths of names, bars and texts, and the height of a bar, in pixels.
const NAMES: f64 = 70.0;
const BAR: f64 = 280.0;
const TEXTS: f64 = 250.0;
const ROW: f64 = 19.0;

/// All lines of all budgets as CSV, in the columns of the GUM.
///
/// # Errors
/// [`ReportError::Csv`].
pub fn budget_csv(budgets: &[Budget]) -> Result<String, ReportError> {
    let header = [
        "unknown",
        "source",
        "type",
        "value",
        "value_unit",
        "sensitivity",
        "contribution",
        "percent",
        "total",
        "requirement",
        "unit",
    ];
    let rows = budgets.iter().flat_map(|b| b.lines.iter().map(move |l| (b, l))).map(|(b, l)| {
        vec![
            b.unknown.clone(),
            l.source.clone(),
            format!("{:?}", l.evaluation),
            l.value.to_string(),
            l.value_unit.clone(),
            l.sensitivity.to_string(),
            l.contribution.to_string(),
            l.percent.to_string(),
            b.total.to_string(),
            b.requirement.map(|r| r.to_string()).unwrap_or_default(),
            b.unit.clone(),
        ]
    });
    write(std::iter::once(header.map(String::from).to_vec()).chain(rows))
}

/// Samples, then the families with a contribution, in the order of the error model.
fn sources(of: &OmittedEffects) -> Vec<&str> {
    let with_size = of.terms.iter().filter(|t| t.size.is_some());
    let mut out = vec![SAMPLES];
    for t in with_size {
        if !out.contains(&t.family.as_str()) {
            out.push(&t.family);
        }
    }
    out
}

/// Shares of the squared total of a budget, in percent, in the order of `sources`.
fn shares(b: &Budget, of: &OmittedEffects, sources: &[&str]) -> Vec<f64> {
    let source = |name: &str| {
        let term = of.terms.iter().find(|t| t.name == name);
        term.map_or(SAMPLES, |t| t.family.as_str()).to_string()
    };
    let share = |s: &&str| {
        let own = b.lines.iter().filter(|l| source(&l.source) == **s);
        own.map(|l| l.percent).sum::<f64>()
    };
    sources.iter().map(share).collect()
}

/// Stacked bars as SVG, a bar per unknown: shares of its squared total uncertainty by source. `None` without
/// a budget.
pub(crate) fn bars(of: &OmittedEffects) -> Option<String> {
    let budgets: Vec<&Budget> = of.budgets.iter().filter(|b| !b.unknown.starts_with("psi")).collect();
    if budgets.is_empty() {
        return None;
    }
    let sources = sources(of);
    let color = |i: usize| if i == 0 { GREY } else { COLORS[(i - 1) % COLORS.len()] };
    let top = 24.0 + 16.0 * sources.len() as f64;
    let shown = &budgets[..budgets.len().min(BARS)];
    let (width, height) = (NAMES + BAR + TEXTS, top + ROW * shown.len() as f64 + 6.0);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" font-family=\"{FONT}\" \
         font-size=\"11\"><rect width=\"100%\" height=\"100%\" fill=\"white\" />"
    );
    for (i, s) in sources.iter().enumerate() {
        let y = 4.0 + 16.0 * i as f64;
        rectangle(&mut out, [NAMES, y, 10.0, 10.0], color(i));
        text(&mut out, NAMES + 16.0, y + 9.0, s);
    }
    text(&mut out, NAMES, top - 8.0, "share of the squared total, 0 to 100 %");
    text(&mut out, NAMES + BAR + 8.0, top - 8.0, "total uncertainty (1 sigma)");
    for (k, b) in shown.iter().enumerate() {
        let y = top + ROW * k as f64;
        text(&mut out, 4.0, y + 13.0, &b.unknown);
        let mut x = NAMES;
        for (i, share) in shares(b, of, &sources).into_iter().enumerate() {
            let wide = BAR * share / 100.0;
            rectangle(&mut out, [x, y + 2.0, wide, ROW - 4.0], color(i));
            x += wide;
        }
        let judged = match b.requirement {
            Some(r) if b.total > r => format!(", missed (required {})", number(r)),
            Some(r) => format!(", met (required {})", number(r)),
            None => String::new(),
        };
        text(&mut out, NAMES + BAR + 8.0, y + 13.0, &format!("{} {}{judged}", number(b.total), b.unit));
    }
    out.push_str("</svg>\n");
    Some(out)
}

fn rectangle(out: &mut String, [x, y, width, height]: [f64; 4], color: &str) {
    let _ = write!(
        out,
        "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.2}\" height=\"{height:.1}\" fill=\"{color}\" stroke=\"white\" \
         stroke-width=\"0.5\" />"
    );
}

fn text(out: &mut String, x: f64, y: f64, text: &str) {
    let text = escaped(text);
    let _ = write!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{BLACK}\">{text}</text>");
}

#[cfg(test)]
mod tests {
    use super::*;
    use obsdeg_evidence::simulation::omitted::{BudgetLine, Evaluation, OmittedEffect};

    fn effects() -> OmittedEffects {
        let line = |source: &str, contribution: f64, percent: f64| BudgetLine {
            source: source.into(),
            evaluation: Evaluation::B,
            value: 2.0,
            value_unit: "ug".into(),
            sensitivity: contribution / 2.0,
            contribution,
            percent,
        };
        // 3-4-12 gives 13: shares 9/169, 16/169, 144/169
        let lines = [("K0_Y", 12.0), ("K0_X", 4.0), (SAMPLES, 3.0)];
        let lines = lines.map(|(s, c)| line(s, c, 100.0 * c * c / 169.0)).to_vec();
        let term = |name: &str| OmittedEffect {
            name: name.into(),
            family: "K0".into(),
            unit: "ug".into(),
            class: None,
            exact: None,
            visible_from: None,
            size: Some(2.0),
            sensitivities: Vec::new(),
            uses_up: None,
        };
        OmittedEffects {
            priors: false,
            families: Vec::new(),
            terms: vec![term("K0_X"), term("K0_Y")],
            budgets: vec![Budget {
                unknown: "D_IZ".into(),
                unit: "deg/h/g".into(),
                total: 13.0,
                requirement: Some(10.0),
                lines,
            }],
            carries: Vec::new(),
            advice: Vec::new(),
            correlated_noise: None,
            torquers_in_turns: false,
            error_bound: None,
            not_classified: None,
            estimated: Vec::new(),
            attitudes: true,
        }
    }

    #[test]
    fn bars_are_as_long_as_their_shares() {
        let of = effects();
        let svg = bars(&of).expect("bars");
        for (share, color) in [(9.0, GREY), (160.0, ORANGE)] {
            let wide = format!("width=\"{:.2}\" height=\"15.0\" fill=\"{color}\"", 280.0 * share / 169.0);
            assert!(svg.contains(&wide), "{wide} in {svg}");
        }
        assert!(svg.contains("missed (required 10"), "{svg}");
        assert!(bars(&OmittedEffects { budgets: Vec::new(), ..of }).is_none());
    }

    #[test]
    fn a_line_of_csv_for_every_source() {
        let text = budget_csv(&effects().budgets).expect("text");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4);
        assert!(lines[1].starts_with("D_IZ,K0_Y,B,2,ug,6,12,"), "{}", lines[1]);
        assert!(lines[1].ends_with(",13,10,deg/h/g"), "{}", lines[1]);
    }
}

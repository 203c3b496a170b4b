//! Charts of rows: a name, a remark, marks on an axis that all rows share, and a text with the same content.

use std::fmt::Write;

use crate::document::Grade;
use crate::figure::{AMBER, BLACK, BLUE, FONT, GREEN, GREY, ORANGE, PURPLE, SKY};
use crate::visible::escaped;

/// Row of a chart.
pub(crate) struct ChartRow {
    pub(crate) name: String,
    pub(crate) remark: String,
    /// Values of its marks, one per series; `None` for no mark.
    pub(crate) marks: Vec<Option<f64>>,
    /// Value of a line of its own; `None` without one.
    pub(crate) limit: Option<f64>,
    /// Meaning of its marks in words.
    pub(crate) text: String,
    pub(crate) grade: Grade,
}

/// A chart.
pub(crate) struct Chart {
    /// Heading of the remarks.
    pub(crate) remark: &'static str,
    /// Label of the axis.
    pub(crate) label: String,
    /// True if the axis has orders, 0, 1, 2; false if it is logarithmic.
    pub(crate) orders: bool,
    /// Value of a line through all rows; larger values are better.
    pub(crate) threshold: Option<f64>,
    /// Names of the series; empty for a single one.
    pub(crate) series: Vec<String>,
    pub(crate) rows: Vec<ChartRow>,
}

/// Widths of names, remarks, axis and texts, and the height of a row, in pixels.
const NAMES: f64 = 96.0;
const REMARKS: f64 = 52.0;
const AXIS: f64 = 200.0;
const TEXTS: f64 = 122.0;
const ROW: f64 = 16.0;
/// Distance between the marks of two series in a row, in pixels.
const APART: f64 = 7.0;

/// Colours of series; each series also has a shape of its own.
const COLORS: [&str; 6] = [BLUE, ORANGE, GREEN, PURPLE, SKY, AMBER];

/// Places of a chart, in pixels, and the range of its axis.
struct ChartScale {
    /// Left end of the axis.
    left: f64,
    /// Width of the chart.
    width: f64,
    /// Height of the legend.
    legend: f64,
    /// Upper end of the rows.
    top: f64,
    /// Lower end of the rows.
    bottom: f64,
    /// Height of a row.
    height: f64,
    /// Lowest and highest value of the axis: exponents of ten, or orders.
    low: f64,
    high: f64,
    /// True if the axis has orders.
    orders: bool,
}

impl ChartScale {
    /// Place of a value on the axis.
    fn at(&self, x: f64) -> f64 {
        let share = if self.orders { x } else { x.log10() };
        self.left + AXIS * ((share - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }
}

impl Chart {
    /// The lowest and the highest value of the axis: exponents of ten, or orders.
    fn range(&self) -> [f64; 2] {
        let marks = self.rows.iter().flat_map(|r| r.marks.iter().copied().chain([r.limit])).flatten();
        let all: Vec<f64> =
            marks.chain(self.threshold).filter(|x| x.is_finite() && (self.orders || *x > 0.0)).collect();
        let (low, high) = all.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
        match (all.is_empty(), self.orders) {
            (true, _) => [0.0, 1.0],
            (false, true) => [0.0, high.max(1.0)],
            (false, false) => {
                let [low, high] = [low.log10().floor(), high.log10().ceil()];
                [low, if high > low { high } else { low + 1.0 }]
            }
        }
    }

    /// Draws a mark: a disc for a single series, else the shape of the series.
    fn mark(&self, out: &mut String, series: usize, x: f64, y: f64, grade: Grade) {
        if self.series.is_empty() {
            // a missed mark is hollow, so that colour is not needed
            let (fill, stroke) = match grade {
                Grade::Good => (BLUE, BLUE),
                Grade::Missed => ("none", ORANGE),
                Grade::Limited | Grade::Open => (GREY, GREY),
            };
            let _ = write!(
                out,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"2\" />"
            );
            return;
        }
        let color = COLORS[series % COLORS.len()];
        let shape = match series % 4 {
            0 => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.6\" fill=\"{color}\" />"),
            1 => format!("<path d=\"M{:.1} {:.1}h7v7h-7Z\" fill=\"{color}\" />", x - 3.5, y - 3.5),
            2 => format!("<path d=\"M{x:.1} {:.1}l4.4 7.6h-8.8Z\" fill=\"{color}\" />", y - 4.6),
            _ => {
                format!("<path d=\"M{x:.1} {:.1}l4.6 4.6l-4.6 4.6l-4.6 -4.6Z\" fill=\"{color}\" />", y - 4.6)
            }
        };
        out.push_str(&shape);
    }

    /// The chart as SVG.
    pub(crate) fn svg(&self) -> String {
        let scale = self.scale();
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" \
             font-family=\"{FONT}\" font-size=\"11\"><rect width=\"100%\" height=\"100%\" fill=\"white\" />",
            scale.width,
            scale.bottom + 6.0
        );
        self.legend(&mut out, &scale);
        self.axis(&mut out, &scale);
        for (i, row) in self.rows.iter().enumerate() {
            self.row(&mut out, &scale, row, scale.top + scale.height * (i as f64 + 0.5));
        }
        if let Some(threshold) = self.threshold {
            let _ = write!(
                out,
                "<line x1=\"{0:.1}\" y1=\"{1:.1}\" x2=\"{0:.1}\" y2=\"{bottom:.1}\" stroke=\"{BLACK}\" \
                 stroke-width=\"1.5\" />",
                scale.at(threshold),
                scale.top - 4.0,
                bottom = scale.bottom
            );
        }
        out.push_str("</svg>\n");
        out
    }

    /// Places of the axis and of the rows.
    fn scale(&self) -> ChartScale {
        let count = self.series.len().max(1);
        let height = ROW.max(APART * (count as f64 + 1.0));
        // without any text its column is left out, but for a margin
        let texts = if self.rows.iter().all(|r| r.text.is_empty()) { 16.0 } else { TEXTS };
        let left = NAMES + REMARKS;
        let legend = self.series.iter().filter(|s| !s.is_empty()).count() as f64 * 16.0;
        let top = 40.0 + legend;
        let (width, bottom) = (left + AXIS + texts, top + height * self.rows.len() as f64);
        let [low, high] = self.range();
        ChartScale { left, width, legend, top, bottom, height, low, high, orders: self.orders }
    }

    /// Draws the names of the series beside their marks.
    fn legend(&self, out: &mut String, scale: &ChartScale) {
        for (i, name) in self.series.iter().enumerate() {
            let y = 9.0 + 16.0 * i as f64;
            self.mark(out, i, 10.0, y, Grade::Good);
            let room = scale.width - 22.0;
            fitting(out, [18.0, y + 4.0], "start", name, room);
        }
    }

    /// Draws the headings and the lines of the axis.
    fn axis(&self, out: &mut String, scale: &ChartScale) {
        let ChartScale { left, legend, top, bottom, low, high, .. } = *scale;
        text(out, left + AXIS / 2.0, legend + 14.0, "middle", &self.label);
        text(out, NAMES + REMARKS / 2.0 - 4.0, legend + 30.0, "middle", self.remark);
        let every = ((high - low) / 8.0).ceil().max(1.0);
        let ticks = (0..).map(|k| low + f64::from(k) * every).take_while(|t| *t <= high);
        for tick in ticks {
            let x = scale.at(if self.orders { tick } else { 10f64.powf(tick) });
            let _ = write!(
                out,
                "<line x1=\"{x:.1}\" y1=\"{:.1}\" x2=\"{x:.1}\" y2=\"{bottom:.1}\" stroke=\"{GREY}\" \
                 stroke-width=\"0.5\" />",
                top - 4.0
            );
            text(out, x, top - 10.0, "middle", &power(tick, self.orders));
        }
    }

    /// Draws a row around a height in pixels.
    fn row(&self, out: &mut String, scale: &ChartScale, row: &ChartRow, y: f64) {
        fitting(out, [4.0, y + 4.0], "start", &row.name, NAMES - 8.0);
        text(out, NAMES + REMARKS / 2.0 - 4.0, y + 4.0, "middle", &row.remark);
        text(out, scale.left + AXIS + 10.0, y + 4.0, "start", &row.text);
        if let Some(limit) = row.limit {
            let _ = write!(
                out,
                "<line x1=\"{0:.1}\" y1=\"{1:.1}\" x2=\"{0:.1}\" y2=\"{2:.1}\" stroke=\"{BLACK}\" \
                 stroke-width=\"2\" />",
                scale.at(limit),
                y - scale.height / 2.0 + 2.0,
                y + scale.height / 2.0 - 2.0
            );
        }
        let count = self.series.len().max(1);
        for (k, x) in row.marks.iter().enumerate().filter_map(|(k, x)| Some((k, (*x)?))) {
            let y = y + APART * (k as f64 - (count as f64 - 1.0) / 2.0);
            if let Some(threshold) = self.threshold {
                let _ = write!(
                    out,
                    "<line x1=\"{:.1}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{y:.1}\" stroke=\"{GREY}\" \
                     stroke-width=\"2\" />",
                    scale.at(threshold),
                    scale.at(x)
                );
            }
            self.mark(out, k, scale.at(x), y, row.grade);
        }
    }
}

/// Label of the axis: `0.01`, `1`, `1e5`, or an order.
fn power(x: f64, order: bool) -> String {
    match (order, x as i32) {
        (true, k) => k.to_string(),
        (false, k @ -3..=-1) => format!("{:.*}", -k as usize, 10f64.powi(k)),
        (false, k @ 0..=3) => format!("{}", 10i32.pow(k as u32)),
        (false, k) => format!("1e{k}"),
    }
}

fn text(out: &mut String, x: f64, y: f64, anchor: &str, text: &str) {
    fitting(out, [x, y], anchor, text, 44.0 * LETTER);
}

/// Mean width of a letter, in pixels.
const LETTER: f64 = 7.0;

/// Text that is cut to a width in pixels; the full text is its title.
fn fitting(out: &mut String, [x, y]: [f64; 2], anchor: &str, text: &str, room: f64) {
    let most = (room / LETTER) as usize;
    let (shown, title) = match text.chars().count() > most {
        true => {
            let short: String = text.chars().take(most.saturating_sub(1)).chain(['\u{2026}']).collect();
            (short, format!("<title>{}</title>", escaped(text)))
        }
        false => (text.to_string(), String::new()),
    };
    let shown = escaped(&shown);
    let _ = write!(
        out,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"{BLACK}\">{title}{shown}</text>"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(mark: Option<f64>, grade: Grade) -> ChartRow {
        ChartRow {
            name: "D_<X>".into(),
            remark: "1".into(),
            marks: vec![mark],
            limit: None,
            text: "so".into(),
            grade,
        }
    }

    fn chart(orders: bool, rows: Vec<ChartRow>) -> Chart {
        Chart {
            remark: "degree",
            label: "margin".into(),
            orders,
            threshold: (!orders).then_some(1.0),
            series: vec![],
            rows,
        }
    }

    fn discs(svg: &str) -> Vec<f64> {
        let ends = svg.split("<circle cx=\"").skip(1).filter_map(|t| t.split('"').next());
        ends.map(|x| x.parse().expect("a number")).collect()
    }

    #[test]
    fn marks_are_where_their_values_are() {
        let rows = vec![
            row(Some(10.0), Grade::Good),
            row(Some(0.1), Grade::Missed),
            row(None, Grade::Missed),
            row(Some(1.0), Grade::Good),
        ];
        let svg = chart(false, rows).svg();
        let (left, right) = (NAMES + REMARKS, NAMES + REMARKS + AXIS);
        assert_eq!(discs(&svg), [right, left, (left + right) / 2.0]);
        assert!(svg.contains("D_&lt;X&gt;") && svg.matches("fill=\"none\"").count() == 1, "{svg}");
        let svg = chart(true, vec![row(Some(0.0), Grade::Good), row(Some(2.0), Grade::Good)]).svg();
        assert_eq!(discs(&svg), [left, right]);
        assert!(svg.contains(">2</text>") && !svg.contains(">0.5</text>"));
        // a chart without marks has an axis
        assert!(chart(false, vec![row(None, Grade::Open)]).svg().contains(">10</text>"));
    }

    #[test]
    fn powers_of_ten() {
        assert_eq!(
            [-4.0, -2.0, 0.0, 3.0, 4.0].map(|x| power(x, false)),
            ["1e-4", "0.01", "1", "1000", "1e4"]
        );
    }
}

//! Pictures: the only module that names the plotting library. PNG is made from SVG.

use std::fmt::Write;
use std::sync::{Arc, OnceLock};

use kuva::plot::LabelStyle;
use kuva::prelude::{
    BandPlot, Heatmap, Layout, LegendPosition, LinePlot, Plot, ReferenceLine, ScatterPlot, SvgBackend,
    TickFormat,
};
use kuva::render::figure::Figure as Grid;
use resvg::{tiny_skia, usvg};

use crate::visible;
use crate::visible::escaped;

/// Colours that colour-blind readers can distinguish (Okabe and Ito).
pub(crate) const BLACK: &str = "#000000";
pub(crate) const BLUE: &str = "#0072B2";
pub(crate) const SKY: &str = "#56B4E9";
pub(crate) const ORANGE: &str = "#D55E00";
pub(crate) const GREEN: &str = "#009E73";
pub(crate) const PURPLE: &str = "#CC79A7";
pub(crate) const AMBER: &str = "#E69F00";
pub(crate) const GREY: &str = "#999999";

/// Text of a picture, which is XML, without control characters.
fn shown(text: &str) -> String {
    visible(text).into_owned()
}

/// Stroke of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stroke {
    Solid,
    Dashed,
    DashDot,
    Dotted,
}

/// Colour and stroke of curve number `i`: 18 different styles, none black or dotted, since references are.
pub(crate) fn style(i: usize) -> (&'static str, Stroke) {
    const COLORS: [&str; 6] = [BLUE, ORANGE, GREEN, SKY, PURPLE, AMBER];
    let stroke = [Stroke::Solid, Stroke::Dashed, Stroke::DashDot][i / COLORS.len() % 3];
    (COLORS[i % COLORS.len()], stroke)
}

/// A curve.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    /// Label in the legend; empty for none.
    pub(crate) label: String,
    pub(crate) color: &'static str,
    pub(crate) stroke: Stroke,
    pub(crate) points: Vec<(f64, f64)>,
}

/// A filled band around a curve: `(x, low, high)`.
#[derive(Debug, Clone)]
pub(crate) struct Band {
    pub(crate) color: &'static str,
    pub(crate) points: Vec<(f64, f64, f64)>,
}

/// A point with a text above at its right.
#[derive(Debug, Clone)]
pub(crate) struct NamedPoint {
    pub(crate) name: String,
    pub(crate) at: (f64, f64),
}

/// Axes with curves, bands and marks.
#[derive(Debug, Clone, Default)]
pub(crate) struct Figure {
    pub(crate) title: String,
    pub(crate) x_label: String,
    pub(crate) y_label: String,
    pub(crate) bands: Vec<Band>,
    pub(crate) lines: Vec<Curve>,
    pub(crate) points: Vec<NamedPoint>,
    /// Positions of vertical lines, which separate positions.
    pub(crate) marks: Vec<f64>,
    /// Range of the horizontal axis; `None` for that of the data.
    pub(crate) x_range: Option<(f64, f64)>,
    /// Range of the vertical axis; `None` for that of the data.
    pub(crate) y_range: Option<(f64, f64)>,
    /// True if both axes are logarithmic.
    pub(crate) log: bool,
    /// True if the vertical axis is logarithmic.
    pub(crate) log_y: bool,
    /// True if both axes have whole numbers.
    pub(crate) orders: bool,
    /// Names along x, at 1, 2, ...; empty for numbers.
    pub(crate) x_names: Vec<String>,
}

/// Width and height of one figure, in pixels.
const SIZE: (f64, f64) = (640.0, 400.0);
/// Width and height of a figure in a page, without its legend, height of a line of the legend, and size of
/// its texts, in pixels. A third of a printed page shows it at two thirds of its size, texts of 6 pt.
const SMALL: (f64, f64) = (340.0, 220.0);
const ENTRY: f64 = 18.0;
const SMALL_TEXT: u32 = 13;
/// Largest number of letters of a label that has half the width of a small figure.
const SHORT_LABEL: usize = 19;
/// Left and right margins in pixels: labels of the axes are wider than the library assumes.
const MARGINS: (f64, f64) = (88.0, 28.0);
/// Number of characters from which a title is broken.
const TITLE: usize = 48;
pub(crate) const FONT: &str = "DejaVu Sans, Verdana, sans-serif";
/// Beginning of the library's ids of clips.
pub(crate) const CLIP: &str = "kuva-clip-";

impl Figure {
    fn plots(&self) -> Vec<Plot> {
        let bands = self.bands.iter().map(|b| {
            let x: Vec<f64> = b.points.iter().map(|p| p.0).collect();
            let (low, high): (Vec<f64>, Vec<f64>) = b.points.iter().map(|p| (p.1, p.2)).unzip();
            Plot::from(BandPlot::new(x, low, high).with_color(b.color).with_opacity(0.25))
        });
        let lines = self.lines.iter().map(|l| {
            let plot = LinePlot::new()
                .with_data(l.points.iter().copied())
                .with_color(l.color)
                .with_stroke_width(if l.stroke == Stroke::Dashed { 1.8 } else { 1.4 });
            let plot = match l.stroke {
                Stroke::Solid => plot,
                Stroke::Dashed => plot.with_dashed(),
                Stroke::DashDot => plot.with_dashdot(),
                Stroke::Dotted => plot.with_dotted(),
            };
            Plot::from(if l.label.is_empty() { plot } else { plot.with_legend(shown(&l.label)) })
        });
        bands.chain(lines).chain(self.named_points()).collect()
    }

    /// Points with their names; `None` without points.
    fn named_points(&self) -> Option<Plot> {
        const SIZE: f64 = 4.5;
        // above the line to the right; nearer than a leader line would be drawn
        let right = LabelStyle::Arrow { offset_x: 3.5, offset_y: 6.0 };
        let plot = ScatterPlot::new()
            .with_data(self.points.iter().map(|p| p.at))
            .with_color(BLUE)
            .with_size(SIZE)
            .with_labels(self.points.iter().map(|p| shown(&p.name)))
            .with_label_style(right);
        (!self.points.is_empty()).then(|| Plot::from(plot))
    }

    /// Layout of the figure with these plots.
    fn layout(&self, plots: &[Plot]) -> Layout {
        let layout = self.with_scales(self.frame(plots));
        let mut layout = self.with_ticks(layout);
        for &x in &self.marks {
            layout = layout.with_reference_line(
                ReferenceLine::vertical(x).with_color(GREY).with_dasharray("2 3").with_stroke_width(1.0),
            );
        }
        layout
    }

    /// Size, title, labels of the axes and legend.
    fn frame(&self, plots: &[Plot]) -> Layout {
        let mut layout = Layout::auto_from_plots(plots)
            .with_x_label(shown(&self.x_label))
            .with_y_label(shown(&self.y_label))
            .with_width(SIZE.0)
            .with_height(SIZE.1)
            .with_font_family(FONT)
            .with_title_wrap(TITLE)
            // powers of ten are narrower than the library assumes, other numbers wider
            .with_y_label_offset(if self.log || self.log_y { 7.0 } else { -7.0 }, 0.0)
            .with_legend_box(false);
        if !self.title.is_empty() {
            layout = layout.with_title(shown(&self.title));
        }
        layout.force_margin_left = Some(MARGINS.0);
        if self.lines.iter().filter(|l| !l.label.is_empty()).count() > 4 {
            layout = layout.with_legend_position(LegendPosition::OutsideRightTop);
        } else {
            layout = layout.with_legend_position(LegendPosition::OutsideBottomCenter);
            layout.force_margin_right = Some(MARGINS.1);
        }
        layout
    }

    /// Logarithmic axes, and the ranges of both.
    fn with_scales(&self, mut layout: Layout) -> Layout {
        // an axis without positive values cannot be logarithmic
        let anything = |of: fn(&(f64, f64)) -> f64| {
            self.lines.iter().flat_map(|l| &l.points).any(|p| of(p) > 0.0 && of(p).is_finite())
        };
        if self.log_y && anything(|p| p.1) {
            layout = layout.with_log_y().with_y_tick_format(decades(self.ordinates()));
        }
        if self.log && anything(|p| p.0) && anything(|p| p.1) {
            layout = layout.with_log_scale().with_x_tick_format(decades_only(self.abscissas()));
            // plain numbers if all of them are short
            let short = |p: &(f64, f64)| (0.01..1e4).contains(&p.1);
            if !self.lines.iter().flat_map(|l| &l.points).all(short) {
                layout = layout.with_y_tick_format(decades(self.ordinates()));
            }
        }
        if let Some((low, high)) = self.x_range {
            layout = layout.with_x_axis_min(low).with_x_axis_max(high);
        }
        if let Some((low, high)) = self.y_range {
            layout = layout.with_y_axis_min(low).with_y_axis_max(high);
        }
        layout
    }

    /// Names along x, or whole numbers.
    fn with_ticks(&self, mut layout: Layout) -> Layout {
        if !self.x_names.is_empty() {
            let names: Vec<String> = self.x_names.iter().map(|name| shown(name)).collect();
            let name = move |x: f64| {
                let at = (1..=names.len()).find(|i| (x - *i as f64).abs() < 1e-6);
                at.map_or_else(String::new, |i| names[i - 1].clone())
            };
            let format = TickFormat::Custom(Arc::new(name));
            layout = layout.with_x_tick_step(1.0).with_x_tick_format(format);
        }
        if self.orders {
            let step = |range: Option<(f64, f64)>| {
                range.map_or(1.0, |(low, high)| ((high - low) / 8.0).ceil().max(1.0))
            };
            layout = layout.with_x_tick_step(step(self.x_range)).with_y_tick_step(step(self.y_range));
            layout = layout.with_tick_format(TickFormat::Integer);
        }
        layout
    }

    fn abscissas(&self) -> impl Iterator<Item = f64> + '_ {
        self.lines.iter().flat_map(|l| l.points.iter().map(|p| p.0))
    }

    /// Values of all lines.
    fn ordinates(&self) -> impl Iterator<Item = f64> + '_ {
        self.lines.iter().flat_map(|l| l.points.iter().map(|p| p.1))
    }

    /// SVG of the figure.
    pub(crate) fn svg(&self) -> String {
        let plots = self.plots();
        let layout = self.layout(&plots);
        numbered(&kuva::render_to_svg(plots, layout))
    }

    /// SVG for a page, whose caption stands for the title: small, with large texts.
    pub(crate) fn small_svg(&self) -> String {
        let mut bare = Self { title: String::new(), ..self.clone() };
        bare.lines.iter_mut().for_each(|l| l.label.clear());
        let plots = bare.plots();
        let mut layout = bare
            .layout(&plots)
            .with_width(SMALL.0)
            .with_height(SMALL.1)
            .with_label_size(SMALL_TEXT)
            .with_tick_size(SMALL_TEXT)
            .with_body_size(SMALL_TEXT)
            .with_ticks(4);
        layout.force_margin_right = Some(MARGINS.1);
        let svg = numbered(&kuva::render_to_svg(plots, layout));
        let (legend, height) = self.legend();
        let svg =
            svg.replacen(&format!("height=\"{}\"", SMALL.1), &format!("height=\"{}\"", SMALL.1 + height), 1);
        svg.replacen("</svg>", &format!("{legend}</svg>"), 1)
    }

    /// Legend below a small figure, in two columns if its labels are short, and its height in pixels.
    fn legend(&self) -> (String, f64) {
        let named: Vec<&Curve> = self.lines.iter().filter(|l| !l.label.is_empty()).collect();
        let columns = if named.iter().all(|l| l.label.chars().count() <= SHORT_LABEL) { 2 } else { 1 };
        let mut out = String::new();
        for (i, l) in named.iter().enumerate() {
            let x = 8.0 + SMALL.0 / 2.0 * (i % columns) as f64;
            let y = SMALL.1 + ENTRY * ((i / columns) as f64 + 0.5);
            let dashes = match l.stroke {
                Stroke::Solid => "",
                Stroke::Dashed => " stroke-dasharray=\"8 4\"",
                Stroke::DashDot => " stroke-dasharray=\"8 4 2 4\"",
                Stroke::Dotted => " stroke-dasharray=\"2 3\"",
            };
            let _ = write!(
                out,
                "<line x1=\"{x}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\" stroke=\"{}\" stroke-width=\"2\"{dashes} />\
                 <text x=\"{}\" y=\"{}\" font-family=\"{FONT}\" font-size=\"{SMALL_TEXT}\" fill=\"{BLACK}\">{}</text>",
                x + 24.0,
                l.color,
                x + 30.0,
                y + 4.5,
                escaped(&l.label)
            );
        }
        (out, ENTRY * named.len().div_ceil(columns) as f64 + 4.0)
    }
}

/// Labels of a logarithmic axis of times: powers of ten, at most five.
fn decades_only(values: impl Iterator<Item = f64>) -> TickFormat {
    let orders = values.filter(|x| *x > 0.0 && x.is_finite()).map(f64::log10);
    let (low, high) = orders.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    let every = ((high.ceil() - low.floor()) / 4.0).ceil().max(1.0);
    let label = move |x: f64| {
        let order = x.log10().round();
        let power = (x.log10() - order).abs() < 1e-6 && order.rem_euclid(every) < 0.5;
        match order as i32 {
            _ if !power => String::new(),
            k @ 0..=4 => 10i32.pow(k as u32).to_string(),
            k => format!("1e{k}"),
        }
    };
    TickFormat::Custom(Arc::new(label))
}

/// Number of labels of a logarithmic axis that fit a small figure.
const LABELS: f64 = 6.0;

/// Labels of a logarithmic axis with these values: powers of ten, of many decades every second or third one.
fn decades(values: impl Iterator<Item = f64>) -> TickFormat {
    let orders = values.filter(|x| *x > 0.0 && x.is_finite()).map(|x| x.log10().floor());
    let (low, high) = orders.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    if high - low < 2.0 {
        return TickFormat::Sci;
    }
    let every = ((high - low) / LABELS).ceil();
    let label = move |x: f64| {
        let (order, nearest) = (x.log10(), x.log10().round());
        let shown = (order - nearest).abs() < 1e-6 && nearest.rem_euclid(every) < 0.5;
        if shown { format!("1e{nearest}") } else { String::new() }
    };
    TickFormat::Custom(Arc::new(label))
}

/// Renumbers the ids of clips from 0. The library numbers them through the process, so that a picture would
/// differ from run to run.
fn numbered(svg: &str) -> String {
    let mut parts = svg.split(CLIP);
    let mut out = parts.next().unwrap_or_default().to_string();
    let mut ids = Vec::new();
    for part in parts {
        let (id, rest) = part.split_at(part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len()));
        let number = ids.iter().position(|known| *known == id).unwrap_or_else(|| {
            ids.push(id);
            ids.len() - 1
        });
        out.push_str(&format!("{CLIP}{number}{rest}"));
    }
    out
}

/// Several figures in rows of `columns`.
pub(crate) fn grid(figures: &[Figure], columns: usize, title: &str) -> String {
    let plots: Vec<Vec<Plot>> = figures.iter().map(Figure::plots).collect();
    let layouts = figures.iter().zip(&plots).map(|(f, p)| f.layout(p)).collect();
    let scene = Grid::new(figures.len().div_ceil(columns), columns)
        .with_title(shown(title))
        .with_plots(plots)
        .with_layouts(layouts)
        .with_cell_size(SIZE.0 * 0.75, SIZE.1 * 0.8)
        .with_shared_legend_bottom()
        .render();
    numbered(&SvgBackend::new().render_scene(&scene))
}

/// SVG of a matrix with named rows (from the top) and columns. Entries are from `low` to 1; colours are blue
/// to orange if `low` is negative, else white to blue.
pub(crate) fn heat(
    title: &str,
    rows: &[String],
    columns: &[String],
    values: Vec<Vec<f64>>,
    low: f64,
) -> String {
    // the library scales colours to the data; here they belong to the range from low to 1
    let (rows, values): (Vec<String>, Vec<Vec<f64>>) =
        rows.iter().map(|row| shown(row)).zip(values).rev().unzip();
    let columns: Vec<String> = columns.iter().map(|column| shown(column)).collect();
    let all = || values.iter().flatten().copied();
    let (least, most) = all().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    let color = move |t: f64| {
        let share = (least + t * (most - least) - low) / (1.0 - low);
        diverging(if low < 0.0 { share } else { (1.0 - share) / 2.0 })
    };
    let map = Heatmap::new()
        .with_data(values)
        .with_labels(rows.clone(), columns.clone())
        .with_color_map(kuva::prelude::ColorMap::Custom(Arc::new(color)));
    let plots = vec![Plot::from(map)];
    let layout = Layout::auto_from_plots(&plots)
        .with_title(shown(title))
        .with_x_categories(columns.clone())
        .with_y_categories(rows.clone())
        .with_x_tick_rotate(-60.0)
        .with_width(180.0 + 30.0 * columns.len().max(8) as f64)
        .with_height(180.0 + 28.0 * rows.len() as f64)
        .with_tick_size(14)
        .with_font_family(FONT);
    numbered(&kuva::render_to_svg(plots, layout))
}

/// Shade of blue for 0 (light) to 1 (dark), which also orders the values in grey.
pub(crate) fn shade(t: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 3] = [[226.0, 239.0, 248.0], [63.0, 147.0, 199.0], [0.0, 45.0, 84.0]];
    let t = 2.0 * if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 };
    let (from, to, s) = if t < 1.0 { (STOPS[0], STOPS[1], t) } else { (STOPS[1], STOPS[2], t - 1.0) };
    std::array::from_fn(|i| (from[i] + (to[i] - from[i]) * s).round() as u8)
}

/// Colour of a text on a colour: black or white.
pub(crate) fn ink([r, g, b]: [u8; 3]) -> &'static str {
    let light = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
    if light > 140.0 { BLACK } else { "#ffffff" }
}

/// Blue over white to orange, for 0 to 1.
fn diverging(t: f64) -> String {
    let t = t.clamp(0.0, 1.0);
    let (from, to, s) = if t < 0.5 {
        ([0.0, 114.0, 178.0], [255.0; 3], 2.0 * t)
    } else {
        ([255.0; 3], [213.0, 94.0, 0.0], 2.0 * t - 1.0)
    };
    let [r, g, b] = [0, 1, 2].map(|i: usize| (from[i] + (to[i] - from[i]) * s).round() as u8);
    format!("rgb({r},{g},{b})")
}

/// Reason why a picture could not be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot draw the picture: {0}")]
pub struct FigureError(String);

fn fonts() -> Arc<usvg::fontdb::Database> {
    static FONTS: OnceLock<Arc<usvg::fontdb::Database>> = OnceLock::new();
    let load = || {
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(dejavu::sans::regular().to_vec());
        fonts.load_font_data(dejavu::sans::bold().to_vec());
        Arc::new(fonts)
    };
    FONTS.get_or_init(load).clone()
}

/// Parses an SVG.
pub(crate) fn tree(svg: &str) -> Result<usvg::Tree, FigureError> {
    let options =
        usvg::Options { fontdb: fonts(), font_family: "DejaVu Sans".into(), ..usvg::Options::default() };
    usvg::Tree::from_str(svg, &options).map_err(|e| FigureError(e.to_string()))
}

/// Width in pixels from which a picture is wide enough for a screen as it is.
const WIDE: f32 = 1000.0;

/// The PNG of an SVG, at one and a half times its size unless it is wide.
///
/// # Errors
/// [`FigureError`] when the SVG cannot be read or the picture is too large.
pub fn png(svg: &str) -> Result<Vec<u8>, FigureError> {
    let tree = tree(svg)?;
    let scale = if tree.size().width() < WIDE { 1.5 } else { 1.0 };
    let (width, height) = (tree.size().width() * scale, tree.size().height() * scale);
    let mut pixels = tiny_skia::Pixmap::new(width.ceil() as u32, height.ceil() as u32)
        .ok_or_else(|| FigureError(format!("{width} x {height} pixels")))?;
    pixels.fill(tiny_skia::Color::WHITE);
    resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixels.as_mut());
    encoded(&pixels).map_err(|e| FigureError(e.to_string()))
}

/// PNG of opaque pixels, compressed fast: the default of the library takes longer than drawing. Colours are
/// multiplied by their opacity, which is one, so they are written as they are.
fn encoded(pixels: &tiny_skia::Pixmap) -> Result<Vec<u8>, png::EncodingError> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_compression(png::Compression::Fast);
    encoder.write_header()?.write_image_data(pixels.data())?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_same_whenever_it_is_drawn() {
        let line = |end| Curve {
            label: "sigma".into(),
            color: BLUE,
            stroke: Stroke::Solid,
            points: vec![(0.0, 1.0), (1.0, end)],
        };
        let figure = |end| Figure { lines: vec![line(end)], ..Figure::default() };
        let one = figure(2.0).svg();
        assert_eq!(one, figure(2.0).svg());
        assert!(one.contains(&format!("id=\"{CLIP}0\"")) && one.contains(&format!("(#{CLIP}0)")), "{one}");
        // each panel has clips of its own
        let both = grid(&[figure(2.0), figure(3.0)], 2, "both");
        assert_eq!(both, grid(&[figure(2.0), figure(3.0)], 2, "both"));
        for i in 0..2 {
            assert_eq!(both.matches(&format!("id=\"{CLIP}{i}\"")).count(), 1);
        }
    }
}

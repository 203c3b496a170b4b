//! Pictures side by side: panels of one height.

use std::fmt::Write;

use crate::figure::FONT;
use crate::visible::escaped;

/// Width of a panel, and of the space between two panels, in pixels.
pub(crate) const WIDTH: f64 = 220.0;
pub(crate) const GAP: f64 = 8.0;
/// Number of panels in a row of a picture with several rows.
const COLUMNS: usize = 4;

/// Panels, one per position, of one height in pixels.
pub(crate) struct Panels {
    pub(crate) panels: Vec<Panel>,
    pub(crate) height: f64,
}

/// The picture of one position.
pub(crate) struct Panel {
    /// Description of the picture.
    pub(crate) title: String,
    pub(crate) body: String,
}

impl Panels {
    /// SVG of each panel.
    pub(crate) fn each(&self) -> impl Iterator<Item = String> {
        let height = self.height;
        self.panels.iter().map(move |p| {
            format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{WIDTH}\" \
                 height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
                 font-family=\"{FONT}\"><title>{}</title>{}</svg>",
                escaped(&p.title),
                p.body
            )
        })
    }

    /// One SVG of all panels, in rows.
    pub(crate) fn svg(&self) -> String {
        let columns = self.panels.len().clamp(1, COLUMNS);
        let rows = self.panels.len().div_ceil(columns);
        let across = |n: usize, size: f64| n as f64 * (size + GAP) - GAP;
        let (width, height) = (across(columns, WIDTH), across(rows, self.height));
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 \
             {width} {height}\" font-family=\"{FONT}\"><rect width=\"100%\" height=\"100%\" fill=\"white\" \
             />"
        );
        for (i, p) in self.panels.iter().enumerate() {
            let (x, y) = ((i % columns) as f64 * (WIDTH + GAP), (i / columns) as f64 * (self.height + GAP));
            let _ = write!(
                out,
                "<g transform=\"translate({x} {y})\" role=\"img\"><title>{}</title>{}</g>",
                escaped(&p.title),
                p.body
            );
        }
        out.push_str("</svg>\n");
        out
    }
}

//! A picture as a PDF of one page, for LaTeX: outlines, lines and colours of the SVG, nothing turned into
//! pixels.

use pdf_writer::types::{ColorSpaceOperand, LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref};
use resvg::tiny_skia::{Path as Outline, PathSegment, Transform};
use resvg::usvg::{ClipPath, FillRule, Group, LineCap, LineJoin, Node, Paint, Path, Tree};

use crate::figure::{FigureError, tree};

/// Points per pixel.
const POINTS: f32 = 0.75;

/// Content of the page, and its opacities in thousandths.
struct PdfPage {
    content: Content,
    opacities: Vec<[u16; 2]>,
}

/// The PDF of an SVG.
///
/// # Errors
/// [`FigureError`] when the SVG cannot be read.
pub(crate) fn pdf(svg: &str) -> Result<Vec<u8>, FigureError> {
    let tree: Tree = tree(svg)?;
    let (width, height) = (tree.size().width() * POINTS, tree.size().height() * POINTS);
    let mut sheet = PdfPage { content: Content::new(), opacities: Vec::new() };
    // y is upwards in PDF
    sheet.content.transform([POINTS, 0.0, 0.0, -POINTS, 0.0, height]);
    sheet.group(tree.root(), 1.0);
    let drawn = miniz_oxide::deflate::compress_to_vec_zlib(&sheet.content.finish(), 6);
    let [catalog, pages, page, content] = [1, 2, 3, 4].map(Ref::new);
    let state = |i: usize| Ref::new(5 + i as i32);
    let mut out = Pdf::new();
    out.catalog(catalog).pages(pages);
    out.pages(pages).kids([page]).count(1);
    let mut one = out.page(page);
    one.parent(pages).media_box(Rect::new(0.0, 0.0, width, height)).contents(content);
    let mut resources = one.resources();
    let mut states = resources.ext_g_states();
    for i in 0..sheet.opacities.len() {
        states.pair(Name(name(i).as_bytes()), state(i));
    }
    states.finish();
    resources.finish();
    one.finish();
    for (i, [fill, stroke]) in sheet.opacities.iter().map(|o| o.map(|x| f32::from(x) / 1000.0)).enumerate() {
        out.ext_graphics(state(i)).non_stroking_alpha(fill).stroking_alpha(stroke);
    }
    out.stream(content, &drawn).filter(Filter::FlateDecode);
    Ok(out.finish())
}

/// PDF resource name of a graphics state, which sets an opacity.
fn name(i: usize) -> String {
    format!("o{i}")
}

fn matrix(t: Transform) -> [f32; 6] {
    [t.sx, t.ky, t.kx, t.sy, t.tx, t.ty]
}

/// Colour of a paint. Pictures have no gradients (their first stop counts) and no patterns (grey).
fn color(paint: &Paint) -> [f32; 3] {
    let found = match paint {
        Paint::Color(c) => Some(*c),
        Paint::LinearGradient(g) => g.stops().first().map(|s| s.color()),
        Paint::RadialGradient(g) => g.stops().first().map(|s| s.color()),
        Paint::Pattern(_) => None,
    };
    found.map_or([0.5; 3], |c| [c.red, c.green, c.blue].map(|x| f32::from(x) / 255.0))
}

impl PdfPage {
    /// Draws a group; overlapping parts are drawn one by one, each with the opacity.
    fn group(&mut self, group: &Group, opacity: f32) {
        self.content.save_state();
        self.content.transform(matrix(group.transform()));
        if let Some(clip) = group.clip_path() {
            self.clip(clip);
        }
        let opacity = opacity * group.opacity().get();
        for node in group.children() {
            match node {
                Node::Group(g) => self.group(g, opacity),
                Node::Path(p) if p.is_visible() => self.path(p, opacity),
                Node::Text(t) => self.group(t.flattened(), opacity),
                // pictures of the program have no invisible paths and no images
                Node::Path(_) | Node::Image(_) => {}
            }
        }
        self.content.restore_state();
    }

    fn clip(&mut self, clip: &ClipPath) {
        for node in clip.root().children() {
            if let Node::Path(p) = node {
                let outline = p.data().clone().transform(clip.transform());
                outline.iter().for_each(|o| self.outline(o));
            }
        }
        self.content.clip_nonzero().end_path();
    }

    fn path(&mut self, path: &Path, opacity: f32) {
        let of = |own: f32| (own * opacity * 1000.0).round() as u16;
        let fill = path.fill().map_or(1000, |f| of(f.opacity().get()));
        let stroke = path.stroke().map_or(1000, |s| of(s.opacity().get()));
        let i = self.opacities.iter().position(|o| *o == [fill, stroke]);
        let i = i.unwrap_or_else(|| {
            self.opacities.push([fill, stroke]);
            self.opacities.len() - 1
        });
        self.content.set_parameters(Name(name(i).as_bytes()));
        if let Some(f) = path.fill() {
            self.content.set_fill_color_space(ColorSpaceOperand::DeviceRgb).set_fill_color(color(f.paint()));
        }
        if let Some(s) = path.stroke() {
            self.content
                .set_stroke_color_space(ColorSpaceOperand::DeviceRgb)
                .set_stroke_color(color(s.paint()));
            self.content.set_line_width(s.width().get());
            self.content.set_dash_pattern(s.dasharray().unwrap_or(&[]).iter().copied(), s.dashoffset());
            self.content.set_line_cap(match s.linecap() {
                LineCap::Butt => LineCapStyle::ButtCap,
                LineCap::Round => LineCapStyle::RoundCap,
                LineCap::Square => LineCapStyle::ProjectingSquareCap,
            });
            self.content.set_line_join(match s.linejoin() {
                LineJoin::Round => LineJoinStyle::RoundJoin,
                LineJoin::Bevel => LineJoinStyle::BevelJoin,
                LineJoin::Miter | LineJoin::MiterClip => LineJoinStyle::MiterJoin,
            });
        }
        self.outline(path.data());
        let odd = path.fill().is_some_and(|f| f.rule() == FillRule::EvenOdd);
        match (path.fill().is_some(), path.stroke().is_some(), odd) {
            (true, true, false) => self.content.fill_nonzero_and_stroke(),
            (true, true, true) => self.content.fill_even_odd_and_stroke(),
            (true, false, false) => self.content.fill_nonzero(),
            (true, false, true) => self.content.fill_even_odd(),
            (false, true, _) => self.content.stroke(),
            (false, false, _) => self.content.end_path(),
        };
    }

    fn outline(&mut self, outline: &Outline) {
        let mut last = (0.0, 0.0);
        for segment in outline.segments() {
            match segment {
                PathSegment::MoveTo(p) => {
                    self.content.move_to(p.x, p.y);
                    last = (p.x, p.y);
                }
                PathSegment::LineTo(p) => {
                    self.content.line_to(p.x, p.y);
                    last = (p.x, p.y);
                }
                PathSegment::QuadTo(c, p) => {
                    // parabola as a cubic: its control points are two thirds of the way to that of the
                    // parabola
                    let toward = |from: f32, to: f32| from + (to - from) * 2.0 / 3.0;
                    let [x1, y1] = [toward(last.0, c.x), toward(last.1, c.y)];
                    let [x2, y2] = [toward(p.x, c.x), toward(p.y, c.y)];
                    self.content.cubic_to(x1, y1, x2, y2, p.x, p.y);
                    last = (p.x, p.y);
                }
                PathSegment::CubicTo(a, b, p) => {
                    self.content.cubic_to(a.x, a.y, b.x, b.y, p.x, p.y);
                    last = (p.x, p.y);
                }
                PathSegment::Close => {
                    self.content.close_path();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_one_page_of_outlines() {
        let svg = "<svg xmlns='http://www.w3.org/2000/svg' width='40' height='20'><rect x='0' y='0' \
                   width='40' height='20' fill='#fff' opacity='0.5'/><text x='2' y='12' font-family='DejaVu \
                   Sans' font-size='10'>so</text></svg>";
        let bytes = pdf(svg).expect("an SVG");
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.starts_with("%PDF-1.7") && text.contains("/MediaBox [0 0 30 15]"), "{text}");
        assert!(text.contains("/ca 0.5") && !text.contains("/Font"), "{text}");
        assert_eq!(bytes, pdf(svg).expect("the same bytes"));
        assert!(pdf("no picture").is_err());
    }
}

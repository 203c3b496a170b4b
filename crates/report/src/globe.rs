//! Attitudes on a map of the globe of the platform's axes.
//!
//! A point is the direction of Up in the platform's axes, so that a position with X_p up lies at X_p. A
//! wedge at the point opens towards North, as seen from the platform. Both together are the attitude.
//!
//! The map is Hammer's equal-area projection, seen from outside, with Z_p at the top:
//! `x = 2 sqrt 2 cos b sin(l/2) / d`, `y = sqrt 2 sin b / d`, `d = sqrt(1 + cos b cos(l/2))`, with latitude b
//! and longitude l from the meridian in the middle (J. P. Snyder, Map projections: a working manual, U.S.
//! Geological Survey Professional Paper 1395, 1987, page 182).

use std::f64::consts::{PI, SQRT_2, TAU};
use std::fmt::Write;

use obsdeg_core::model::Matrix3;

use crate::cells::text;
use crate::figure::{AMBER, BLACK, FONT, GREY, ink};
use crate::visible::escaped;

/// Width of the picture, and radius of the globe, in pixels.
const WIDTH: f64 = 900.0;
const RADIUS: f64 = 146.0;
/// Longitude of the middle of the map, in deg: X_p, Y_p and their opposites are off the edge.
const MIDDLE_DEG: f64 = 45.0;
/// Largest and smallest radius of a point with its wedges, in pixels.
const SIZES: [f64; 2] = [46.0, 5.0];
/// Smallest radius of points whose wedges have texts, in pixels.
const LETTERED: f64 = 40.0;

/// Attitude with a colour.
pub(crate) struct Spot {
    /// Name and value, which a wedge holds if there is room.
    pub(crate) name: String,
    pub(crate) value: String,
    /// `C_c^n`: columns X_p, Y_p, Z_p in North, Up, East.
    pub(crate) attitude: Matrix3<f64>,
    pub(crate) color: [u8; 3],
    /// True for a thick border.
    pub(crate) is_best: bool,
}

/// A colour with its meaning.
pub(crate) struct ScaleStep {
    pub(crate) color: [u8; 3],
    /// Text below; empty for none.
    pub(crate) label: String,
}

/// Map of attitudes.
pub(crate) struct Globe {
    /// Title, in lines.
    pub(crate) title: Vec<String>,
    pub(crate) spots: Vec<Spot>,
    /// Attitudes of the scheme with their names.
    pub(crate) positions: Vec<(String, Matrix3<f64>)>,
    /// Name of the colour scale, and its colours.
    pub(crate) scale: (String, Vec<ScaleStep>),
    /// Sentences below.
    pub(crate) notes: Vec<String>,
}

/// Spots with the same direction of Up.
struct SpotGroup<'a> {
    up: [f64; 3],
    spots: Vec<&'a Spot>,
}

impl SpotGroup<'_> {
    fn is_at(&self, up: &[f64; 3]) -> bool {
        (0..3).all(|k| (self.up[k] - up[k]).abs() < 1e-6)
    }
}

/// Row of `C_c^n`: an axis of n in the platform's axes.
fn row(c: &Matrix3<f64>, n: usize) -> [f64; 3] {
    c[n]
}

/// Latitude and longitude of a direction in the platform's axes, in rad.
fn sphere([x, y, z]: [f64; 3]) -> [f64; 2] {
    let level = x.hypot(y);
    [z.atan2(level), if level < 1e-9 { 0.0 } else { y.atan2(x) }]
}

/// Place on the map relative to its middle, in pixels right and down.
fn projected([latitude, longitude]: [f64; 2]) -> [f64; 2] {
    // the edge belongs to the left, whatever the rounding
    let l = (longitude - MIDDLE_DEG.to_radians() + PI + 1e-9).rem_euclid(TAU) - PI;
    flat(latitude, l)
}

/// Projection of a latitude and a longitude from the middle, in rad, to pixels.
fn flat(latitude: f64, longitude: f64) -> [f64; 2] {
    let (half, (s, c)) = (longitude / 2.0, latitude.sin_cos());
    let d = (1.0 + c * half.cos()).sqrt();
    [RADIUS * 2.0 * SQRT_2 * c * half.sin() / d, -RADIUS * SQRT_2 * s / d]
}

/// Direction of North on the globe at the point of Up: angle in rad, clockwise from the direction to the
/// pole Z_p. At the poles the direction is that of the meridian of X_p.
pub(crate) fn bearing(c: &Matrix3<f64>) -> f64 {
    let (up, north) = (row(c, 1), row(c, 0));
    let [(sb, cb), (sl, cl)] = sphere(up).map(f64::sin_cos);
    let along = |v: [f64; 3]| north.iter().zip(v).map(|(a, b)| a * b).sum::<f64>();
    along([-sl, cl, 0.0]).atan2(along([-sb * cl, -sb * sl, cb]))
}

/// Places with their spots.
fn places(spots: &[Spot]) -> Vec<SpotGroup<'_>> {
    let mut out: Vec<SpotGroup<'_>> = Vec::new();
    for spot in spots {
        let up = row(&spot.attitude, 1);
        match out.iter_mut().find(|p| p.is_at(&up)) {
            Some(place) => place.spots.push(spot),
            None => out.push(SpotGroup { up, spots: vec![spot] }),
        }
    }
    out
}

/// Radius of points that do not touch each other, in pixels.
fn radius(places: &[SpotGroup<'_>]) -> f64 {
    let at: Vec<[f64; 2]> = places.iter().map(|p| projected(sphere(p.up))).collect();
    let mut least = f64::MAX;
    for (i, a) in at.iter().enumerate() {
        for b in &at[..i] {
            least = least.min((a[0] - b[0]).hypot(a[1] - b[1]));
        }
    }
    (0.48 * least).clamp(SIZES[1], SIZES[0])
}

/// Lines of latitude and longitude every 30 degrees, and the edge.
fn graticule(out: &mut String) {
    let path = |out: &mut String, points: Vec<[f64; 2]>, width: f64| {
        let points: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = write!(
            out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{GREY}\" stroke-width=\"{width}\" />",
            points.join(" ")
        );
    };
    let steps = |from: f64, to: f64| (0..=60).map(move |k| from + (to - from) * f64::from(k) / 60.0);
    for b in [-60.0f64, -30.0, 0.0, 30.0, 60.0] {
        path(out, steps(-PI, PI).map(|l| flat(b.to_radians(), l)).collect(), 0.5);
    }
    for l in (0..12).map(|k| (f64::from(k) * PI / 6.0 - MIDDLE_DEG.to_radians()).rem_euclid(TAU) - PI) {
        path(out, steps(-PI / 2.0, PI / 2.0).map(|b| flat(b, l)).collect(), 0.5);
    }
    for edge in [-PI, PI] {
        path(out, steps(-PI / 2.0, PI / 2.0).map(|b| flat(b, edge)).collect(), 1.2);
    }
}

/// Wedge around an angle clockwise from the top; a disc if it is the only one.
fn wedge(r: f64, angle: f64, half: f64) -> String {
    if half >= PI {
        return format!("M{r:.1} 0A{r:.1} {r:.1} 0 1 1 -{r:.1} 0A{r:.1} {r:.1} 0 1 1 {r:.1} 0Z");
    }
    let corner = |a: f64| format!("{:.2} {:.2}", r * a.sin(), -r * a.cos());
    let large = u8::from(half > PI / 2.0);
    format!("M0 0L{}A{r:.2} {r:.2} 0 {large} 1 {}Z", corner(angle - half), corner(angle + half))
}

impl Globe {
    /// SVG of the map.
    pub(crate) fn svg(&self) -> String {
        let top = 24.0 * self.title.len() as f64 + 14.0;
        let tall = 2.0 * RADIUS * SQRT_2 + 2.0 * SIZES[0];
        let below = top + tall + 26.0;
        let height = below + 62.0 + 18.0 * self.notes.len() as f64;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height:.0}\" \
             font-family=\"{FONT}\" font-size=\"12\"><rect width=\"100%\" height=\"100%\" fill=\"white\" />"
        );
        for (i, line) in self.title.iter().enumerate() {
            let style = if i == 0 { "font-size=\"16\" font-weight=\"bold\"" } else { "font-size=\"13\"" };
            text(&mut out, [WIDTH / 2.0, 24.0 + 22.0 * i as f64], "middle", style, line);
        }
        let _ = write!(out, "<g transform=\"translate({} {:.1})\">", WIDTH / 2.0, top + tall / 2.0);
        graticule(&mut out);
        let places = places(&self.spots);
        let r = radius(&places);
        for place in &places {
            draw(&mut out, place, r);
        }
        self.axes(&mut out, &places, r);
        for (name, attitude) in &self.positions {
            let up = row(attitude, 1);
            let is_drawn = places.iter().any(|p| p.is_at(&up));
            mark(&mut out, name, attitude, if is_drawn { r } else { 0.0 });
        }
        out.push_str("</g>");
        self.legend(&mut out, below);
        out.push_str("</svg>\n");
        out
    }

    /// Names of the six directions of the axes, below their points.
    fn axes(&self, out: &mut String, places: &[SpotGroup<'_>], r: f64) {
        for (k, name) in ["X_p", "Y_p", "Z_p"].iter().enumerate() {
            for (sign, word) in [(1.0, "up"), (-1.0, "down")] {
                let mut up = [0.0; 3];
                up[k] = sign;
                let [x, y] = projected(sphere(up));
                let is_drawn = places.iter().any(|p| p.is_at(&up));
                let down = if is_drawn { r + 14.0 } else { 14.0 };
                if !is_drawn {
                    let _ = write!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\" fill=\"{BLACK}\" />");
                }
                let style = "font-weight=\"bold\" stroke=\"white\" stroke-width=\"3\" paint-order=\"stroke\"";
                text(out, [x, y + down], "middle", style, &format!("{name} {word}"));
            }
        }
    }

    fn legend(&self, out: &mut String, y: f64) {
        let (name, steps) = &self.scale;
        let (left, wide) = (250.0, 400.0 / steps.len().max(1) as f64);
        text(out, [left - 14.0, y + 13.0], "end", "", name);
        for (i, step) in steps.iter().enumerate() {
            let x = left + wide * i as f64;
            let [r, g, b] = step.color;
            let _ = write!(
                out,
                "<rect x=\"{x:.2}\" y=\"{y:.1}\" width=\"{:.2}\" height=\"18\" fill=\"rgb({r},{g},{b})\" />",
                wide + 0.3
            );
            text(out, [x + wide / 2.0, y + 34.0], "middle", "", &step.label);
        }
        let _ = write!(
            out,
            "<rect x=\"{left}\" y=\"{y:.1}\" width=\"400\" height=\"18\" fill=\"none\" stroke=\"{GREY}\" />"
        );
        for (i, note) in self.notes.iter().enumerate() {
            text(out, [WIDTH / 2.0, y + 60.0 + 18.0 * i as f64], "middle", "", note);
        }
    }
}

/// Half the smallest angle between two wedges of a point, in rad: they do not overlap.
fn half_width(place: &SpotGroup<'_>) -> f64 {
    let mut all: Vec<f64> = place.spots.iter().map(|s| bearing(&s.attitude)).collect();
    all.sort_by(f64::total_cmp);
    let next = all.iter().skip(1).copied().chain(all.first().map(|first| first + TAU));
    let gaps = all.iter().zip(next).map(|(a, b)| b - a);
    // attitudes twice in the list have no gap
    gaps.filter(|gap| *gap > 1e-6).fold(TAU, f64::min) / 2.0
}

/// Draws a point with a wedge for each of its attitudes; wedges with a thick border come last.
fn draw(out: &mut String, place: &SpotGroup<'_>, r: f64) {
    let [x, y] = projected(sphere(place.up));
    let half = half_width(place);
    let _ = write!(out, "<g transform=\"translate({x:.1} {y:.1})\">");
    let mut spots = place.spots.clone();
    spots.sort_by_key(|s| s.is_best);
    for spot in &spots {
        let angle = bearing(&spot.attitude);
        let [red, green, blue] = spot.color;
        let (stroke, width) = match (spot.is_best, r < 14.0) {
            (true, _) => (AMBER, 3.0),
            (false, true) => ("none", 0.0),
            (false, false) => ("white", 1.0),
        };
        let _ = write!(
            out,
            "<path d=\"{}\" fill=\"rgb({red},{green},{blue})\" stroke=\"{stroke}\" \
             stroke-width=\"{width}\" stroke-linejoin=\"round\"><title>{}</title></path>",
            wedge(r, angle, half),
            escaped(&format!("{}: {}", spot.name, spot.value))
        );
    }
    let _ = write!(out, "<circle r=\"{r:.1}\" fill=\"none\" stroke=\"{BLACK}\" stroke-width=\"0.8\" />");
    if r >= LETTERED && spots.len() <= 4 {
        for spot in &spots {
            let angle = bearing(&spot.attitude);
            let away = if spots.len() == 1 { 0.0 } else { 0.61 * r };
            let at = [away * angle.sin(), -away * angle.cos()];
            let fill = format!("font-size=\"10\" fill=\"{}\"", ink(spot.color));
            text(out, [at[0], at[1] - 1.0], "middle", &format!("font-weight=\"bold\" {fill}"), &spot.name);
            text(out, [at[0], at[1] + 10.0], "middle", &fill, &spot.value);
        }
    }
    out.push_str("</g>");
}

/// Position of the scheme: a tick towards North with its name, at the rim of its point, or from a dot of its
/// own for a radius of 0.
fn mark(out: &mut String, name: &str, attitude: &Matrix3<f64>, r: f64) {
    let ([x, y], angle) = (projected(sphere(row(attitude, 1))), bearing(attitude));
    let at = |away: f64| [x + away * angle.sin(), y - away * angle.cos()];
    let ([x1, y1], [x2, y2], [xt, yt]) = (at(r), at(r + 11.0), at(r + 19.0));
    for (color, width) in [("white", 6), (BLACK, 3)] {
        let _ = write!(
            out,
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{color}\" \
             stroke-width=\"{width}\" />"
        );
    }
    if r == 0.0 {
        let _ =
            write!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{BLACK}\" stroke=\"white\" />");
    }
    let style = "font-size=\"11\" stroke=\"white\" stroke-width=\"3\" paint-order=\"stroke\"";
    text(out, [xt, yt + 4.0], "middle", style, name);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    /// The map is equal-area: small triangles keep their area, wherever they lie.
    #[test]
    fn the_projection_keeps_areas() {
        let step = 1e-4;
        for (b, l) in [(0.0, 0.0), (0.7, 0.4), (-1.2, 2.8), (0.3, -3.0)] {
            let [[x0, y0], [x1, y1], [x2, y2]] = [flat(b, l), flat(b + step, l), flat(b, l + step)];
            let area = ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)).abs();
            let expected = RADIUS * RADIUS * step * step * b.cos();
            assert!((area / expected - 1.0).abs() < 1e-3, "{b} {l}: {area} {expected}");
        }
        assert_eq!(flat(0.0, 0.0), [0.0, -0.0]);
        let ends = [flat(0.0, PI)[0], -flat(PI / 2.0, 0.0)[1]];
        assert!((ends[0] - 2.0 * ends[1]).abs() < 1e-9, "twice as wide as tall");
    }

    /// Attitudes with the platform turned about the vertical: North turns the other way around the point,
    /// as seen from outside.
    #[test]
    fn wedges_open_towards_north() {
        // n is North, Up, East; columns are the platform's axes
        let matrix = |r: Rotation3<f64>| -> Matrix3<f64> {
            std::array::from_fn(|i| std::array::from_fn(|j| r.matrix()[(i, j)]))
        };
        // X_p North, Y_p Up, Z_p East: from Y_p, with Z_p upwards on the map, X_p is to the left
        let c = matrix(Rotation3::identity());
        assert!((bearing(&c) + PI / 2.0).abs() < 1e-12, "{}", bearing(&c));
        assert!(projected(sphere([0.0, 1.0, 0.0]))[0] > projected(sphere([1.0, 0.0, 0.0]))[0]);
        let tilt = Rotation3::from_euler_angles(0.3, 0.4, -0.7);
        for turn in [0.3, 1.0, -2.0] {
            let about_up = Rotation3::from_axis_angle(&Vector3::y_axis(), turn);
            let [before, after] = [tilt, about_up * tilt].map(|r| bearing(&matrix(r)));
            let apart = (after - before - turn + PI).rem_euclid(TAU) - PI;
            assert!(apart.abs() < 1e-9, "{turn} {before} {after}");
            // Up does not move
            let [a, b] = [tilt, about_up * tilt].map(|r| row(&matrix(r), 1));
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-12));
        }
    }

    #[test]
    fn attitudes_with_one_up_share_a_point() {
        let spot = |c: Matrix3<f64>| Spot {
            name: "a".into(),
            value: String::new(),
            attitude: c,
            color: [0; 3],
            is_best: false,
        };
        let level = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let turned = [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]];
        let over = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let spots = [level, turned, over].map(spot);
        let places = places(&spots);
        assert_eq!(places.iter().map(|p| p.spots.len()).collect::<Vec<_>>(), [2, 1]);
        assert!(radius(&places) > LETTERED);
        let halves: Vec<f64> = places.iter().map(half_width).collect();
        assert!((halves[0] - PI / 4.0).abs() < 1e-9 && halves[1] == PI, "{halves:?}");
    }
}

//! Pictures of positions: the platform's axes, g and the earth rate at each, in an axonometric view of North,
//! Up, East.
//!
//! The axes North, Up, East are right-handed. The picture shows North to the right, Up upwards and East
//! towards the reader. It is turned by [`AZIMUTH_DEG`] about Up and seen from [`ELEVATION_DEG`] above:
//! `right = n cos a - e sin a`, `near = n sin a + e cos a`, `up = u cos h - near sin h`, and towards the
//! reader `u sin h + near cos h`.

use std::fmt::Write;

use obsdeg_core::model::{Matrix3, Pose, Scheme};
use obsdeg_evidence::simulation::latitude_of;

use crate::figure::{BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE};
use crate::figures::File;
use crate::panels::{Panel, Panels, WIDTH};
use crate::visible::escaped;
use crate::{visible, words};

/// Azimuth and elevation of the view, in deg.
const AZIMUTH_DEG: f64 = 40.0;
const ELEVATION_DEG: f64 = 20.0;

/// Height of a panel without its lines of text, and of one line, in pixels.
const HEIGHT: f64 = 232.0;
const LINE: f64 = 16.0;
/// Length of a unit vector, in pixels.
const UNIT: f64 = 70.0;
/// Projection of a vector of n: pixels from the origin (right, down), and its component towards the reader.
fn seen([n, u, e]: [f64; 3]) -> ([f64; 2], f64) {
    let ((sa, ca), (sh, ch)) = (AZIMUTH_DEG.to_radians().sin_cos(), ELEVATION_DEG.to_radians().sin_cos());
    let near = n * sa + e * ca;
    ([UNIT * (n * ca - e * sa), -UNIT * (u * ch - near * sh)], u * sh + near * ch)
}

/// A component without the rounding errors of sines.
fn component(x: f64) -> f64 {
    (x * 1e12).round() / 1e12 + 0.0
}

/// Direction in words: `North`, or `(0.766, -0.5, 0.403)`.
fn direction(v: [f64; 3]) -> String {
    const NAMES: [[&str; 2]; 3] = [["North", "South"], ["Up", "Down"], ["East", "West"]];
    match v.iter().position(|x| component(x.abs()) == 1.0) {
        Some(k) => NAMES[k][usize::from(v[k] < 0.0)].into(),
        None => format!("({:.3}, {:.3}, {:.3})", v[0], v[1], v[2]),
    }
}

/// The columns of `C_c^n`: X_p, Y_p, Z_p in n.
fn axes(c: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|j| std::array::from_fn(|i| component(c[i][j])))
}

/// An arrow from the origin with its name beyond the tip; an axis that points away from the reader is dashed,
/// one along the line of sight a ring.
fn arrow(out: &mut String, name: &str, v: [f64; 3], color: &str, wide: bool) {
    let ([x, y], towards) = seen(v);
    let length = x.hypot(y);
    let (w, head, beyond) = if wide { (5.0, 7.0, 13.0) } else { (2.0, 4.0, 0.0) };
    let opacity = if wide { " opacity=\"0.45\"" } else { "" };
    let _ = write!(out, "<g data-name=\"{name}\" data-nue=\"{} {} {}\">", v[0], v[1], v[2]);
    if length < 8.0 {
        let _ = write!(
            out,
            "<circle class=\"tip\" cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"5\" fill=\"none\" stroke=\"{color}\" \
             stroke-width=\"{w}\"{opacity} />"
        );
    } else {
        let [a, b] = [x / length, y / length];
        let (tip, base) = (length + beyond, length + beyond - 2.2 * head);
        let dash = if towards < -1e-9 && !wide { " stroke-dasharray=\"4 3\"" } else { "" };
        let _ = write!(
            out,
            "<line x1=\"0\" y1=\"0\" x2=\"{:.2}\" y2=\"{:.2}\" stroke=\"{color}\" \
             stroke-width=\"{w}\"{dash}{opacity} /><path class=\"tip\" d=\"M{:.2} {:.2}L{:.2} {:.2}L{:.2} \
             {:.2}Z\" fill=\"{color}\"{opacity} />",
            a * base,
            b * base,
            a * tip,
            b * tip,
            a * base - b * head,
            b * base + a * head,
            a * base + b * head,
            b * base - a * head
        );
    }
    let [a, b] = if length < 8.0 { [0.8, 0.6] } else { [x / length, y / length] };
    // names of wide arrows lie beyond those of axes, which may have the same direction
    let at = length + if wide { 27.0 } else { 13.0 };
    label(out, [a * at, b * at], name, color, !wide);
    out.push_str("</g>");
}

/// Text centred on a point.
fn label(out: &mut String, [x, y]: [f64; 2], text: &str, color: &str, bold: bool) {
    let weight = if bold { " font-weight=\"bold\"" } else { "" };
    let _ = write!(
        out,
        "<text x=\"{x:.2}\" y=\"{:.2}\" text-anchor=\"middle\" font-size=\"13\"{weight} fill=\"{color}\">{text}</text>",
        y + 4.0
    );
}

/// Axes North, Up, East, behind everything else.
fn geographic(out: &mut String) {
    for (name, v) in [("N", [1.0, 0.0, 0.0]), ("U", [0.0, 1.0, 0.0]), ("E", [0.0, 0.0, 1.0])] {
        let ([x, y], _) = seen(v);
        let length = x.hypot(y);
        let [a, b] = [x / length, y / length];
        let _ = write!(
            out,
            "<line data-geographic=\"{name}\" x1=\"0\" y1=\"0\" x2=\"{:.2}\" y2=\"{:.2}\" stroke=\"{GREY}\" \
             stroke-width=\"1\" />",
            a * (length + 26.0),
            b * (length + 26.0)
        );
        label(out, [a * (length + 34.0), b * (length + 34.0)], name, GREY, false);
    }
}

/// The platform as a plate across Y_p.
fn plate(out: &mut String, [x, _, z]: &[[f64; 3]; 3]) {
    const HALF: f64 = 0.42;
    let corner = |a: f64, b: f64| seen(std::array::from_fn(|k| HALF * (a * x[k] + b * z[k]))).0;
    let corners = [corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0), corner(-1.0, 1.0)];
    let points: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
    let _ = write!(
        out,
        "<polygon points=\"{}\" fill=\"{GREY}\" fill-opacity=\"0.18\" stroke=\"{GREY}\" stroke-width=\"0.8\" />",
        points.join(" ")
    );
}

/// Slew path to the position, a line for each turn: `after 180 deg about N`, or the shortest turn.
fn ways(pose: &Pose) -> Vec<String> {
    let Some(way) = &pose.way else { return Vec::new() };
    let how = if way.stated { "after" } else { "shortest turn" };
    match way.turns.is_empty() {
        true => vec!["no turn".into()],
        false => way.turns.iter().map(|t| format!("{how} {}", words::turn(t))).collect(),
    }
}

/// Lines broken before ` about ` if they are too long for a panel.
fn broken(lines: Vec<String>) -> Vec<String> {
    let fits = |line: &str| line.chars().count() <= 34;
    let halves = |line: String| match line.split_once(" about ") {
        Some((turn, axis)) if !fits(&line) => vec![turn.to_string(), format!("about {axis}")],
        _ => vec![line],
    };
    lines.into_iter().flat_map(halves).collect()
}

/// Panels of positions. The earth rate is that at `latitude_deg`.
pub(crate) fn panels(poses: &[Pose], latitude_deg: f64) -> Panels {
    let texts: Vec<Vec<String>> = poses.iter().map(texts).collect();
    let lines = texts.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let panels = poses.iter().zip(&texts).map(|(pose, texts)| Panel {
        title: title(pose),
        body: body(pose, texts, latitude_deg, 8.0 + LINE * (lines + 1.0)),
    });
    Panels { panels: panels.collect(), height: HEIGHT + LINE * (lines + 1.0) }
}

/// Lines below the name of a position.
fn texts(pose: &Pose) -> Vec<String> {
    let angles = format!("{} deg", pose.angles.join(", "));
    let turning = pose.rotation.as_deref().and_then(|r| r.split_once(':'));
    let turning = turning.map(|(about, angle)| format!("then turns {angle} deg about {about}"));
    std::iter::once(angles).chain(broken(ways(pose))).chain(turning).collect()
}

/// Description of a panel.
fn title(pose: &Pose) -> String {
    let axes = match &pose.attitude {
        None => format!("angles {}, not drawn", pose.angles.join(", ")),
        Some(c) => {
            let axes = axes(c);
            let shown =
                ["X_p", "Y_p", "Z_p"].iter().zip(axes).map(|(name, v)| format!("{name} {}", direction(v)));
            shown.collect::<Vec<_>>().join(", ")
        }
    };
    let mut ways = ways(pose);
    ways.insert(0, format!("{}: {axes}", pose.name));
    visible(&ways.join("; ")).into_owned()
}

fn body(pose: &Pose, texts: &[String], latitude_deg: f64, top: f64) -> String {
    let mut out = String::new();
    let name = pose.letters.as_ref().map_or_else(|| pose.name.clone(), |l| format!("{}: {l}", pose.name));
    for (i, text) in std::iter::once(&name).chain(texts).enumerate() {
        let weight = if i == 0 { "14\" font-weight=\"bold" } else { "13" };
        let y = 16.0 + LINE * i as f64;
        let _ = write!(
            out,
            "<text x=\"6\" y=\"{y}\" font-size=\"{weight}\" fill=\"{BLACK}\">{}</text>",
            escaped(text)
        );
    }
    let _ = write!(out, "<g transform=\"translate({} {})\">", WIDTH / 2.0 - 8.0, top + 114.0);
    geographic(&mut out);
    let latitude = latitude_deg.to_radians();
    arrow(&mut out, "g", [0.0, -1.0, 0.0], BLACK, true);
    arrow(&mut out, "\u{3c9}", [component(latitude.cos()), component(latitude.sin()), 0.0], PURPLE, true);
    if let Some(c) = &pose.attitude {
        let axes = axes(c);
        plate(&mut out, &axes);
        let mut drawn: Vec<_> =
            ["X_p", "Y_p", "Z_p"].into_iter().zip(axes).zip([BLUE, ORANGE, GREEN]).collect();
        // vectors that are nearer to the reader are drawn later
        drawn.sort_by(|a, b| seen(a.0.1).1.total_cmp(&seen(b.0.1).1));
        for ((name, v), color) in drawn {
            arrow(&mut out, name, v, color, false);
        }
    }
    out.push_str("</g>");
    out
}

/// Caption of the pictures of all positions.
pub(crate) fn caption(poses: &[Pose], latitude_deg: f64, by_default: bool) -> String {
    let default = if by_default { ", which the scheme does not state" } else { "" };
    let turning =
        if poses.iter().any(|p| p.rotation.is_some()) { ", at the start where it turns" } else { "" };
    let guessed = poses.iter().any(|p| p.way.as_ref().is_some_and(|w| !w.stated && !w.turns.is_empty()));
    let guessed =
        if guessed { "; how a position is reached is not stated, so the shortest turn is given" } else { "" };
    format!(
        "The platform at every position{turning}: X_p, Y_p, Z_p in North, Up, East, with a plate across Y_p; \
         wide: g, which is down (the specific force is up), and \u{3c9}, the earth rate at latitude \
         {latitude_deg} deg{default}; dashed: away from the reader{guessed}"
    )
}

/// Picture of the positions of a scheme, `positions.svg`: axes, g and earth rate at each, and the turns
/// between them.
pub fn position_figure(scheme: &Scheme) -> File {
    let latitude_deg = latitude_of(scheme).map_or(0.0, |l| l.degrees());
    File::new("positions.svg", panels(&scheme.poses(), latitude_deg).svg())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};
    use obsdeg_core::model::{cardinal_names, parse_attitude};

    fn scheme(attitudes: &[&str], latitude: &str) -> Scheme {
        let angles = attitudes.iter().map(|a| parse_attitude(a).expect("angles"));
        Scheme { latitude: latitude.parse().ok(), ..Scheme::of_angles(angles) }
    }

    fn numbers(text: &str) -> Vec<f64> {
        text.split_whitespace().map(|x| x.parse().expect("a number")).collect()
    }

    /// Every text between two texts.
    fn between<'a>(text: &'a str, before: &str, after: &str) -> Vec<&'a str> {
        text.split(before).skip(1).filter_map(|rest| rest.split(after).next()).collect()
    }

    /// Arrows by name: their stated vectors, and the places of their tips.
    fn arrows(panel: &str) -> Vec<(&str, Vec<f64>, [f64; 2])> {
        between(panel, "<g data-name=\"", "</g>")
            .into_iter()
            .map(|group| {
                let name = group.split('"').next().expect("a name");
                let vector = numbers(between(group, "data-nue=\"", "\"")[0]);
                let tip = match between(group, "class=\"tip\" d=\"M", "L").first() {
                    Some(tip) => numbers(tip),
                    None => [" cx=\"", " cy=\""]
                        .iter()
                        .flat_map(|c| numbers(between(group, c, "\"")[0]))
                        .collect(),
                };
                (name, vector, [tip[0], tip[1]])
            })
            .collect()
    }

    /// Platform axis `j` in n. A passive matrix Mx(a) rotates a vector by -a about x, and so for y and z.
    fn by_quaternions(angles_deg: [f64; 3], j: usize) -> [f64; 3] {
        let about = |k: usize| UnitQuaternion::from_scaled_axis(Vector3::ith(k, -angles_deg[k].to_radians()));
        (about(0) * about(1) * about(2) * Vector3::ith(j, 1.0)).into()
    }

    #[test]
    fn axes_are_the_columns_of_the_attitude() {
        let angles = [[10.0, 25.0, 40.0], [130.0, -50.0, 70.0], [-95.0, 33.0, -160.0], [90.0, 0.0, 0.0]];
        let texts = angles.map(|a| a.map(|x| x.to_string()).join(","));
        let drawn = panels(&scheme(&texts.each_ref().map(String::as_str), "48").poses(), 48.0);
        for (panel, angles) in drawn.each().zip(angles) {
            // the projection is linear: a vector lies where the picture's own North, Up and East put it
            let ray = |name: &str| {
                let line = between(
                    &panel,
                    &format!("data-geographic=\"{name}\" x1=\"0\" y1=\"0\" x2=\""),
                    "\" stroke",
                )[0];
                let [x, y] = line.split("\" y2=\"").map(|c| numbers(c)[0]).collect::<Vec<_>>()[..] else {
                    panic!("{line}")
                };
                [x, y]
            };
            let unit = |name: &str| {
                let [x, y] = ray(name);
                let length = x.hypot(y);
                [x, y].map(|c| c * (length - 26.0) / length)
            };
            let sheet = ["N", "U", "E"].map(unit);
            for (name, vector, tip) in arrows(&panel) {
                let expected = match name {
                    "g" => [0.0, -1.0, 0.0],
                    "\u{3c9}" => [48f64.to_radians().cos(), 48f64.to_radians().sin(), 0.0],
                    axis => by_quaternions(
                        angles,
                        ["X_p", "Y_p", "Z_p"].iter().position(|n| *n == axis).expect("an axis"),
                    ),
                };
                assert!(
                    (0..3).all(|k| (vector[k] - expected[k]).abs() < 1e-9),
                    "{name} {vector:?} {expected:?}"
                );
                let at: [f64; 2] = std::array::from_fn(|c| (0..3).map(|k| expected[k] * sheet[k][c]).sum());
                // the tips of wide arrows lie beyond their vectors
                let length = at[0].hypot(at[1]);
                let beyond = if name.ends_with("_p") { 1.0 } else { (length + 13.0) / length };
                assert!((0..2).all(|c| (tip[c] - beyond * at[c]).abs() < 0.05), "{name} {tip:?} {at:?}");
            }
            assert_eq!(arrows(&panel).len(), 5);
        }
    }

    /// East is North x Up, and comes out of the sheet to the left of North: nothing is mirrored.
    #[test]
    fn the_view_is_right_handed() {
        let sheet = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(seen);
        let rows: [[f64; 3]; 3] =
            std::array::from_fn(|r| sheet.map(|([x, y], z)| [x / UNIT, -y / UNIT, z][r]));
        let [right, up, near] = rows;
        let cross: [f64; 3] = std::array::from_fn(|i| {
            right[(i + 1) % 3] * up[(i + 2) % 3] - right[(i + 2) % 3] * up[(i + 1) % 3]
        });
        assert!((0..3).all(|k| (cross[k] - near[k]).abs() < 1e-12), "{rows:?}");
        assert!((right.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn names_of_cardinal_attitudes_say_where_the_axes_point() {
        let names = cardinal_names();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let drawn = panels(&scheme(&names, "").poses(), 28.2);
        let letters = |title: &str| -> String {
            let word = |axis: &str| {
                between(title, axis, ",").concat().split(';').next().unwrap_or_default().trim().to_string()
            };
            ["X_p", "Y_p", "Z_p"].map(|axis| word(axis)[..1].to_string()).concat()
        };
        for (panel, name) in drawn.panels.iter().zip(names) {
            assert_eq!(letters(&panel.title), name, "{}", panel.title);
        }
    }

    #[test]
    fn what_is_not_known_is_not_drawn() {
        let generic = scheme(&["alpha,0,0", "NUE", "NDW", "UEN"], "");
        let svg = String::from_utf8(position_figure(&generic).bytes).expect("text");
        assert_eq!(
            (svg.matches("data-name=\"X_p\"").count(), svg.matches("data-name=\"g\"").count()),
            (3, 4)
        );
        assert!(svg.contains("<title>p1: angles alpha, 0, 0, not drawn</title>"));
        assert!(
            svg.contains("<title>p3: X_p North, Y_p Down, Z_p West; shortest turn 180 deg about N</title>"),
            "{svg}"
        );
        let words = caption(&generic.poses(), 28.2, true);
        assert!(
            words.contains("28.2 deg, which the scheme does not state")
                && words.contains("the shortest turn is given"),
            "{words}"
        );
        let stated =
            Scheme { path: Some(obsdeg_core::model::Path::OneAxis), ..scheme(&["NUE", "NDW"], "48") };
        let words = caption(&stated.poses(), 48.0, false);
        assert!(!words.contains("shortest") && !words.contains("state"), "{words}");
    }
}

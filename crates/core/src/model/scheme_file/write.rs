//! Writer of scheme files: the text of a scheme, from which the same scheme is read.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::model::angle::{Angle, format_decimal};
use crate::model::scheme::{Position, Scheme};
use crate::model::settings::{FilterKind, Propagation, Settings, Truth};
use crate::model::{Acceptance, Geometry, Gimbals, PerGyro, Recording, SlewAxis, Unknowns};
use crate::title_block::TitleBlock;

/// Text of a scheme file. Reading it gives the scheme again; a comment may precede it.
pub fn write(scheme: &Scheme) -> String {
    let mut out = String::new();
    for (key, text) in [("name", &scheme.name), ("description", &scheme.description)] {
        if !text.is_empty() {
            line(&mut out, key, &quoted(text));
        }
    }
    line(&mut out, "carry", &quoted(&scheme.carry.to_string()));
    if let Some(latitude) = scheme.latitude {
        line(&mut out, "latitude_deg", &latitude.to_string());
    }
    match &scheme.unknowns {
        Unknowns::Drift => line(&mut out, "terms", "\"drift\""),
        Unknowns::Coefficients(terms) => {
            line(&mut out, "terms", &list(terms.iter().map(|t| quoted(t.letters()))))
        }
    }
    geometry(&mut out, &scheme.geometry);
    if let Some(path) = scheme.path {
        line(&mut out, "path", &quoted(path.name()));
    }
    if scheme.measured_azimuth {
        line(&mut out, "measured_azimuth", "true");
    }
    if !scheme.combinations.is_empty() {
        line(&mut out, "combinations", &list(scheme.combinations.iter().map(|c| quoted(c))));
    }
    title_block(&mut out, &scheme.document);
    settings(&mut out, &scheme.simulation);
    numbers(&mut out, "requirements", &scheme.requirements);
    numbers(&mut out, "bench", &scheme.bench);
    numbers(&mut out, "ageing", &scheme.ageing);
    acceptance(&mut out, &scheme.acceptance);
    gimbals(&mut out, &scheme.gimbals);
    recording(&mut out, &scheme.recording);
    for p in &scheme.positions {
        position(&mut out, p);
    }
    out
}

fn geometry(out: &mut String, geometry: &Geometry) {
    if *geometry != Geometry::default() {
        for (letter, g) in ["X", "Y", "Z"].iter().zip(geometry.gyros()) {
            let axes = format!("{{ I = \"{}\", O = \"{}\", S = \"{}\" }}", g.I, g.O, g.S);
            line(out, &format!("geometry.{letter}"), &axes);
        }
        if !geometry.accelerometers.is_default() {
            let [x, y, z] = geometry.accelerometers.inputs();
            let axes = format!("{{ X = \"{x}\", Y = \"{y}\", Z = \"{z}\" }}");
            line(out, "geometry.accelerometers", &axes);
        }
    }
}

fn gimbals(out: &mut String, gimbals: &Gimbals) {
    let mut own = String::new();
    for (name, limit) in ["alpha", "beta", "gamma"].iter().zip(gimbals.limits) {
        if let Some(ends) = limit {
            line(&mut own, &format!("{name}_deg"), &list(ends.map(format_decimal)));
        }
    }
    table(out, "gimbals", &own);
}

fn title_block(out: &mut String, block: &TitleBlock) {
    let mut own = String::new();
    for (key, text) in block.entries() {
        line(&mut own, key, &quoted(text));
    }
    if !block.signatures.is_empty() {
        line(&mut own, "signatures", &list(block.signatures.iter().map(|s| quoted(s))));
    }
    table(out, "document", &own);
}

fn line(out: &mut String, key: &str, value: &str) {
    // writing to a String does not fail
    let _ = writeln!(out, "{key} = {value}");
}

fn list(items: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", items.into_iter().collect::<Vec<_>>().join(", "))
}

/// Writes a table, unless it is empty.
fn table(out: &mut String, name: &str, lines: &str) {
    if !lines.is_empty() {
        let _ = write!(out, "\n[{name}]\n{lines}");
    }
}

/// Number in TOML: the shortest text that reads as the same double.
fn number(x: f64) -> String {
    match x {
        x if x == 0.0 || (1e-3..1e15).contains(&x.abs()) => format!("{x}"),
        x => format!("{x:e}"),
    }
}

/// Text in quotes; quotes, backslashes and control characters are escaped.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out + "\""
}

fn numbers(out: &mut String, name: &str, given: &BTreeMap<String, f64>) {
    let mut lines = String::new();
    for (key, x) in given {
        // names may contain `@` and `^`
        line(&mut lines, &quoted(key), &number(*x));
    }
    table(out, name, &lines);
}

fn acceptance(out: &mut String, a: &Acceptance) {
    let mut own = String::new();
    if let Some(risk) = a.risk {
        line(&mut own, "risk", &number(risk));
    }
    for (name, ends) in &a.limits {
        line(&mut own, &format!("limits.{}", quoted(name)), &list(ends.map(number)));
    }
    table(out, "acceptance", &own);
}

fn recording(out: &mut String, r: &Recording) {
    let mut own = String::new();
    if let Some(part) = r.tolerance {
        line(&mut own, "tolerance", &number(part));
    }
    if let Some(seconds) = r.settle {
        line(&mut own, "settle", &number(seconds));
    }
    if !r.missing.is_empty() {
        line(&mut own, "missing", &list(r.missing.iter().map(|x| number(*x))));
    }
    table(out, "record", &own);
    for (name, texts) in [("record.columns", &r.columns), ("record.units", &r.units)] {
        let mut lines = String::new();
        texts.iter().for_each(|(key, text)| line(&mut lines, &quoted(key), &quoted(text)));
        table(out, name, &lines);
    }
    if let Some(s) = &r.still {
        let mut lines = String::new();
        for (key, x) in
            [("initial", s.initial), ("window", s.window), ("factor", s.factor), ("shortest", s.shortest)]
        {
            line(&mut lines, key, &number(x));
        }
        table(out, "record.static", &lines);
    }
}

fn settings(out: &mut String, s: &Settings) {
    let mut lines = String::new();
    let truth = s.truth.map(|t| match t {
        Truth::Linear => "linear",
        Truth::Exact => "exact",
    });
    let propagation = s.propagation.map(|p| match p {
        Propagation::Exponential => "exponential",
        Propagation::Rk4 => "rk4",
    });
    let per_gyro = |x: PerGyro| match x.0 {
        [x, y, z] if x == y && y == z => number(x),
        each => list(each.map(number)),
    };
    let gyros = s.gyros().map(|(key, x)| (key, x.map(per_gyro)));
    let texts = [
        ("truth", truth.map(quoted)),
        ("filter", s.filter.map(FilterKind::name).map(quoted)),
        ("step_s", s.step_s.map(number)),
        ("dwell_s", s.dwell_s.map(number)),
        ("slew_rate_deg_s", s.slew_rate_deg_s.map(number)),
        ("accelerometer_noise_g", s.accelerometer_noise_g.map(number)),
        ("accelerometer_bias_instability_ug", s.accelerometer_bias_instability_ug.map(number)),
        ("accelerometer_correlation_time_s", s.accelerometer_correlation_time_s.map(number)),
        ("azimuth_noise_deg", s.azimuth_noise_deg.map(number)),
        ("drift_noise", s.drift_noise.map(|n| quoted(&n.to_string()))),
        ("correlation_time_s", s.correlation_time_s.map(number)),
        ("propagation", propagation.map(quoted)),
        ("drift_scale", s.drift_scale.map(number)),
    ];
    for (key, value) in texts.into_iter().chain(gyros) {
        if let Some(value) = value {
            line(&mut lines, key, &value);
        }
    }
    table(out, "simulation", &lines);
    numbers(out, "simulation.values", &s.values);
    numbers(out, "simulation.estimates", &s.estimates);
    numbers(out, "simulation.priors", &s.priors);
}

fn position(out: &mut String, p: &Position) {
    let angle = |a: &Angle| if a.generic().is_some() { quoted(&a.to_string()) } else { a.to_string() };
    let _ = writeln!(out, "\n[[position]]\nname = {}", quoted(&p.name));
    line(out, "angles_deg", &list(p.angles.iter().map(angle)));
    if let Some(dwell) = p.dwell {
        line(out, "dwell_s", &dwell.to_string());
    }
    if let Some(r) = &p.rotation {
        line(out, "rotation", &format!("{{ about = \"{}\", angle_deg = {} }}", r.axis, r.angle));
    }
    if let Some(s) = &p.slew {
        let keys = [
            s.rate_deg_s.map(|rate| format!("rate_deg_s = {}", number(rate))),
            s.axis.map(|axis| match axis {
                SlewAxis::Named(axis) => format!("about = \"{axis}\""),
                SlewAxis::Direction(direction) => format!("about = {}", list(direction.map(number))),
            }),
            s.angle.as_ref().map(|angle| format!("angle_deg = {angle}")),
        ];
        let keys: Vec<String> = keys.into_iter().flatten().collect();
        line(out, "slew", &format!("{{ {} }}", keys.join(", ")));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Path;
    use crate::model::scheme_file::read;
    use crate::model::settings::DriftNoise;
    use crate::model::{Carry, Dwell, Rotation, SlewTo, Term};
    use proptest::prelude::*;

    fn numbers(range: std::ops::Range<i32>) -> impl Strategy<Value = BTreeMap<String, f64>> {
        let name = prop::sample::select(vec!["psi", "D", "D_F", "D_FX", "D_OS", "psi_y"]);
        let number = (range, 1.0f64..10.0).prop_map(|(e, m)| m * 10f64.powi(e));
        prop::collection::btree_map(name.prop_map(String::from), number, 0..3)
    }

    fn angle() -> impl Strategy<Value = Angle> {
        let exact = (-400_000_000_000i64..400_000_000_000).prop_map(Angle::from_nanodeg);
        let round = (-8i32..8).prop_map(|k| Angle::from_degrees(k * 45));
        let named = prop::sample::select(vec!["alpha", "-beta", "g2+90.5", "-x_1-0.25"]);
        prop_oneof![exact, round, named.prop_map(|t| t.parse().expect("an angle"))]
    }

    prop_compose! {
        fn place(first: bool)(
            name in "[a-zäé0-9_.][a-z0-9 ._-]{0,6}",
            angles in prop::array::uniform3(angle()),
            dwell in prop::option::of(1_000_000u64..1_000_000_000_000_000),
            turn in prop::option::of((0usize..6, 1_000_000i64..700_000_000_000)),
            slew in prop::option::of((
                prop::option::of(1e-3f64..5000.0),
                prop::option::of(0usize..6),
                1_000_000i64..700_000_000_000,
                any::<bool>(),
            )),
            direction in prop::option::of(prop::array::uniform3(-2f64..2.0)),
        ) -> Position {
            let axis = |i: usize| crate::model::rotation::Axis { index: i % 3, geographic: i >= 3 };
            let dwell = dwell.and_then(|ns| format_decimal(ns as i64).parse::<Dwell>().ok());
            let rotation = turn.map(|(i, n)| Rotation { axis: axis(i), angle: Angle::from_nanodeg(n) });
            let slew = slew.filter(|_| !first).map(|(rate_deg_s, about, n, whole)| {
                let axis = direction.map(SlewAxis::Direction).or(about.map(|i| SlewAxis::Named(axis(i))));
                let angle = (whole && axis.is_some()).then(|| Angle::from_nanodeg(-n));
                SlewTo { rate_deg_s, axis, angle }
            });
            Position { name, angles, dwell, rotation, slew }
        }
    }

    prop_compose! {
        fn settings()(
            truth in prop::option::of(prop::sample::select(vec![Truth::Linear, Truth::Exact])),
            filter in prop::option::of(prop::sample::select(FilterKind::ALL.to_vec())),
            propagation in prop::option::of(prop::sample::select(vec![Propagation::Exponential, Propagation::Rk4])),
            step_s in prop::option::of(1e-6f64..1e6),
            dwell_s in prop::option::of(1e-3f64..1e6),
            slew_rate_deg_s in prop::option::of(1e-3f64..1e4),
            accelerometer_noise_g in prop::option::of(1e-15f64..1e-3),
            accelerometer_bias_instability_ug in prop::option::of(1e-9f64..1e9),
            accelerometer_correlation_time_s in prop::option::of(1f64..1e9),
            azimuth_noise_deg in prop::option::of(1e-12f64..1e3),
            noise in prop::option::of((1e-12f64..1e6, any::<bool>())),
            gyros in prop::array::uniform3(prop::option::of((1e-12f64..1e6, prop::array::uniform3(0u8..3)))),
            correlation_time_s in prop::option::of(1f64..1e9),
            drift_scale in prop::option::of(1e-6f64..1e6),
            values in numbers(-20..5),
            estimates in numbers(-20..5),
            priors in numbers(-9..8),
        ) -> Settings {
            let drift_noise = noise
                .map(|(x, walk)| if walk { DriftNoise::RandomWalk(x) } else { DriftNoise::OneStep(x) });
            let [angle, rate, bias] = gyros.map(|g| g.map(|(x, of)| PerGyro(of.map(|k| x * f64::from(k.min(1))))));
            Settings {
                angle_random_walk_deg_sqrt_h: angle, rate_random_walk_dph_sqrt_h: rate, bias_instability_dph: bias,
                correlation_time_s, truth, filter, propagation, step_s, dwell_s, slew_rate_deg_s,
                accelerometer_noise_g, azimuth_noise_deg, accelerometer_bias_instability_ug,
                accelerometer_correlation_time_s, drift_noise, drift_scale, values, estimates, priors,
            }
        }
    }

    fn document(text: &str, signed: bool) -> TitleBlock {
        let signatures = if signed { vec![text.into(), "Approved".into()] } else { vec![] };
        TitleBlock { revision: text.into(), date: "2026-03-01".into(), signatures, ..TitleBlock::default() }
    }

    prop_compose! {
        fn scheme()(
            name in "[ -~äλ\\n\\t\\u{1b}\\u{7f}]{0,12}",
            description in any::<String>(),
            carry in prop::sample::select(Carry::ALL.to_vec()),
            latitude in prop::option::of(-90_000_000_000i64..=90_000_000_000),
            terms in prop::sample::subsequence(Term::ALL.to_vec(), 1..=20),
            drift in any::<bool>(),
            measured_azimuth in any::<bool>(),
            combination in any::<bool>(),
            simulation in settings(),
            requirements in numbers(-12..8),
            limit in prop::option::of((-400i64..0, 400i64..900)),
            first in place(true),
            rest in prop::collection::vec(place(false), 0..4),
            mirrored in any::<bool>(),
            path in prop::option::of(prop::sample::select(Path::ALL.to_vec())),
        ) -> Scheme {
            let alone = drift && rest.is_empty() && first.rotation.is_none();
            let mut positions: Vec<Position> = std::iter::once(first).chain(rest).collect();
            for (i, p) in positions.iter_mut().enumerate() {
                p.name.push_str(&i.to_string());
            }
            let mut geometry = Geometry::default();
            if mirrored {
                (geometry.X.O, geometry.X.S) = (geometry.X.S, "+z".parse().expect("an axis"));
                let accelerometers = &mut geometry.accelerometers;
                (accelerometers.X, accelerometers.Y) = (accelerometers.Y, "-x".parse().expect("an axis"));
            }
            let texts = || [("f x".into(), description.clone())].into();
            let still = crate::model::Still { by: vec![], initial: 30.0, window: 0.5, factor: 6.0, shortest: 1e-4 };
            let recording = Recording {
                columns: texts(),
                units: if mirrored { texts() } else { [].into() },
                still: mirrored.then_some(still),
                tolerance: mirrored.then_some(0.25),
                settle: mirrored.then_some(12.5),
                missing: if mirrored { vec![-9999.0, 0.0, 1e-7] } else { vec![] },
                ..Recording::default()
            };
            let limits = limit.map(|(low, high)| [low * 1_234_567_891, high * 1_000_000_000]);
            Scheme {
                name, document: document(&description, mirrored), description, positions, carry,
                latitude: latitude.and_then(|n| format_decimal(n).parse().ok()),
                geometry,
                unknowns: if alone { Unknowns::Drift } else { Unknowns::Coefficients(terms) },
                measured_azimuth,
                path,
                combinations: if combination && !alone {
                    vec!["psi_x + \n \"".replace('"', " 2*psi_x"), "wN*psi_z".into()]
                } else {
                    Vec::new()
                },
                simulation,
                requirements,
                bench: if mirrored { [("K0".into(), 20.0), ("latitude".into(), 0.5)].into() } else { [].into() },
                ageing: if mirrored { [("D_F".into(), 0.002)].into() } else { [].into() },
                acceptance: Acceptance {
                    limits: if mirrored { [("D_F".into(), [-20.0, 1.5])].into() } else { [].into() },
                    risk: (mirrored && combination).then_some(0.01),
                },
                gimbals: Gimbals { limits: [None, limits, None] },
                recording: if combination { recording } else { Recording::default() },
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn what_is_written_reads_as_the_same_scheme(scheme in scheme()) {
            prop_assume!(scheme.carry != Carry::Reset || scheme.combinations.is_empty());
            let text = write(&scheme);
            if scheme.validate().is_ok() {
                match read(&text) {
                    Ok(back) => prop_assert_eq!(back, scheme, "{}", text),
                    // under reset carry psi belongs to a position; where torquers act, a turn needs an exact
                    // form
                    Err(e) => prop_assert!(
                        e.message.contains("no such unknown")
                            || scheme.torquers_act() && e.message.contains("has no exact form"),
                        "{}\n{}", e.message, text
                    ),
                }
            } else {
                prop_assert!(read(&text).is_err(), "{}", text);
            }
        }
    }

    #[test]
    fn texts_and_numbers() {
        assert_eq!(quoted("a \"b\" \\ \n\u{1b}"), "\"a \\\"b\\\" \\\\ \\n\\u001B\"");
        assert_eq!(
            (number(1e-5), number(1000.0), number(0.25), number(-2e20)),
            ("1e-5".into(), "1000".into(), "0.25".into(), "-2e20".into())
        );
    }
}

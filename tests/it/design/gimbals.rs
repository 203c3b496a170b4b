//! Gimbal limits: all angles that a design prints, writes and draws lie within them. Angles of a file beyond
//! the limits are pointed out.

use std::path::Path;

use obsdeg_commands::{Designed, Host, Search, SearchFiles};
use obsdeg_core::model::{Euler, Gimbals, c_n_f64, cardinal, parse_attitude, scheme_file};
use obsdeg_exact::SplitMix64;
use obsdeg_report::{Format, TerminalLayout, written};

use crate::program::{run, stderr, stdout};

/// Random design task: gimbal limits, candidates and constraints.
fn task(rng: &mut SplitMix64) -> (Vec<String>, Search) {
    let mut limits = Vec::new();
    for name in ["alpha", "beta", "gamma"] {
        if rng.below(3) > 0 {
            let low = -(30 * (1 + rng.below(8) as i64));
            let high = low + 180 + 15 * rng.below(16) as i64;
            limits.push(format!("{name}={low}:{high}"));
        }
    }
    if limits.is_empty() {
        limits.push("alpha=-90:90".into());
    }
    let kind = rng.below(6);
    let candidates = ["cardinal", "cardinal", "grid:90", "grid:45", "grid:45", "free"][kind as usize];
    let carry = if candidates == "free" { "reset" } else { ["inertial", "platform"][rng.below(2) as usize] };
    let mut asked = serde_json::json!({
        "positions": if candidates == "grid:45" { 2 } else { 2 + rng.below(2) }, "candidates": candidates,
        "carry": carry, "latitude": "45", "gimbal": limits,
        "observable": ["D_FX", "D_SX"], "restarts": 2, "keep": 3,
        "refine": candidates != "free" && rng.below(2) == 0, "step": 100.0,
    });
    if candidates == "free" {
        asked["round"] = ["5", "7", "12.5"][rng.below(3) as usize].into();
    } else if candidates != "grid:45" && rng.below(2) == 0 {
        asked["slew_rate"] = if carry == "inertial" { 0.5.into() } else { serde_json::Value::Null };
    }
    (limits, serde_json::from_value(asked).expect("options"))
}

/// Attitudes such as `45,-30.5,180` found in a text.
fn angles_in(text: &str) -> impl Iterator<Item = Euler> {
    let words = text.split(|c: char| c.is_whitespace() || "()\"[];:<>|".contains(c));
    words.filter_map(|word| {
        let numbers = word.split(',').filter(|part| part.parse::<f64>().is_ok()).count();
        (numbers == 3).then(|| parse_attitude(word).ok())?
    })
}

/// Smallest sum of gimbal turns to any angles of the same attitude within the limits, in degrees, by trial
/// (beta is not +-90).
fn shortest(limits: &Gimbals, to: [f64; 3], from: [f64; 3]) -> f64 {
    let mut best = f64::INFINITY;
    for twin in [to, [to[0] + 180.0, 180.0 - to[1], to[2] + 180.0]] {
        let mut sum = 0.0;
        for k in 0..3 {
            let places = (-4..=4).map(|n| twin[k] + 360.0 * f64::from(n));
            let within =
                |x: &f64| limits.limits[k].is_none_or(|[l, h]| (l as f64 / 1e9..=h as f64 / 1e9).contains(x));
            sum += places.filter(within).map(|x| (x - from[k]).abs()).fold(f64::INFINITY, f64::min);
        }
        best = best.min(sum);
    }
    best
}

/// Random tasks: every angle in tables, JSON, Markdown, the scheme file and the picture of the positions is
/// within its gimbal limits. Attitudes match their letters, and no gimbal path between positions is shorter.
/// Returns the number of schemes.
fn within(tasks: usize, seed: u64) -> usize {
    let mut rng = SplitMix64::new(seed);
    let mut schemes = 0;
    for number in 0..tasks {
        let (limits, search) = task(&mut rng);
        let what = format!("task {number}: {limits:?} {search:?}");
        let mut gimbals = Gimbals::default();
        limits.iter().for_each(|l| gimbals.limit(l).expect("a limit"));
        let Ok(found) = obsdeg_commands::design(&search, &SearchFiles::default(), &Host::silent()) else {
            // too few attitudes lie within the limits
            continue;
        };
        let Designed::Schemes(searched) = &found else { panic!("{what}") };
        let design = &searched.found;
        for f in design.found.iter().chain(&design.front) {
            schemes += 1;
            let mut before = [0.0; 3];
            for (name, angles) in f.positions.iter().zip(&f.angles) {
                let set = parse_attitude(angles).expect("angles");
                assert!(gimbals.hold(&set), "{what}: {angles}");
                if let Some(letters) = cardinal(name) {
                    let (a, b) = (c_n_f64(&letters), c_n_f64(&set));
                    assert!(
                        (0..9).all(|k| (a[k / 3][k % 3] - b[k / 3][k % 3]).abs() < 1e-12),
                        "{what}: {name} {angles}"
                    );
                } else {
                    assert_eq!(name, angles, "{what}");
                }
                let here: [f64; 3] = std::array::from_fn(|k| set[k].nanodeg() as f64 / 1e9);
                let round = |k: usize| {
                    let by = (here[k] - before[k]).abs();
                    if gimbals.limits[k].is_some() {
                        by
                    } else {
                        by.rem_euclid(360.0).min(360.0 - by.rem_euclid(360.0))
                    }
                };
                let way = round(0) + round(1) + round(2);
                let locked = (here[1].abs() - 90.0).abs() < 1e-9 || (here[1].abs() - 270.0).abs() < 1e-9;
                assert!(
                    locked || (way - shortest(&gimbals, here, before)).abs() < 1e-6,
                    "{what}: {angles} from {before:?}"
                );
                before = here;
            }
        }
        let names = [&design.candidates, &design.minimum.witness];
        let printed = [Format::Table, Format::Json, Format::Markdown]
            .map(|format| written(searched.as_ref(), format, TerminalLayout::default()).expect("written"));
        // attitudes of the bound over all attitudes, and attitudes reported as beyond the limits
        let beyond: Vec<&String> = design.beyond_gimbals.iter().collect();
        let every = design
            .search
            .iter()
            .flat_map(|s| &s.certificate)
            .flat_map(|c| &c.everywhere)
            .flat_map(|e| &e.weights);
        let of_all: Vec<&String> = every.map(|w| &w.candidate).chain(beyond).collect();
        for text in names.iter().map(|n| n.join(" ")).chain(printed) {
            for angles in angles_in(&text) {
                let shown = angles.each_ref().map(ToString::to_string).join(",");
                assert!(gimbals.hold(&angles) || of_all.contains(&&shown), "{what}: {shown} in {text}");
            }
        }
        let files = searched.files(true).expect("files");
        let file = |name: &str| {
            String::from_utf8(files.iter().find(|f| f.name == name).expect("a file").bytes.clone())
                .expect("text")
        };
        let winner = scheme_file::read(&file("winner.toml")).expect("a scheme");
        assert_eq!(winner.gimbals, gimbals, "{what}");
        let drawn = file("positions.svg");
        for p in &winner.positions {
            assert!(gimbals.hold(&p.angles), "{what}: {:?}", p.angles);
            assert!(
                drawn.contains(&p.angles.each_ref().map(ToString::to_string).join(", ")),
                "{what}: {drawn}"
            );
        }
        let report = winner.gimbal_report().expect("limits");
        assert!(
            report.beyond.is_empty() && Some(&report.turns) == design.gimbals.as_ref().map(|g| &g.turns),
            "{what}"
        );
    }
    schemes
}

#[test]
fn no_angle_of_a_design_is_outside_its_gimbal() {
    assert!(within(10, 32) > 20);
}

/// The same on 200 tasks: `cargo test --release --test it -- --ignored no_angle_of_200_designs`.
#[test]
#[ignore = "a minute or two"]
fn no_angle_of_200_designs_is_outside_its_gimbal() {
    assert!(within(200, 33) > 400);
}

/// Angles of a file beyond its limits are pointed out in the first lines of every answer, with equivalent
/// angles, and stay as written.
#[test]
#[ignore = "seconds: .ci/run"]
fn angles_of_a_file_beyond_its_limits_are_pointed_out() {
    let place = tempfile::tempdir().expect("a folder");
    let file = place.path().join("own.toml").display().to_string();
    let positions = ["0,0,0", "135,20,0", "90,0,45", "-30,70,120"];
    let positions = positions.map(|a| format!("[[position]]\nangles_deg = [{}]\n", a.replace(',', ", ")));
    let text = format!(
        "carry = \"platform\"\nlatitude_deg = 45\n[gimbals]\nalpha_deg = [-90, 90]\n{}",
        positions.concat()
    );
    std::fs::write(&file, &text).expect("written");
    let said = "angles beyond the gimbal limits (alpha from -90 to 90 deg): p2 (135,20,0): the same attitude within \
                them is -45,160,180";
    for command in [
        &["analyze", &file, "--solutions", "off"][..],
        &["simulate", &file],
        &["compare", &file, "--details"],
        &[
            "design",
            "--candidates",
            &file,
            "--positions",
            "4",
            "--observable",
            "D_FX,D_FY",
            "--restarts",
            "2",
        ],
    ] {
        let output = run(command);
        let printed = stdout(&output);
        let first: Vec<&str> = printed.lines().take(8).collect();
        let first = first.join(" ").split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(first.contains(said), "{command:?}: {printed}{}", stderr(&output));
        let joined = printed.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            joined.contains("Gimbals") && joined.contains("alpha (outer, about North)"),
            "{command:?}: {printed}"
        );
    }
    let page = place.path().join("r.md").display().to_string();
    let output = run(&["report", &file, "-o", &page, "--runs", "2"]);
    assert!(Path::new(&page).is_file(), "{}", stderr(&output));
    assert!(std::fs::read_to_string(&page).expect("a report").contains(said));
    assert_eq!(std::fs::read_to_string(&file).expect("a file"), text);
}

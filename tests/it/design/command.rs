//! The command `design`: conditions of an answer, file of the best scheme, interrupts.

use std::process::{Command, Stdio};

use crate::program::{json, obsdeg, refused, run, stderr, stdout};

/// An answer states the conditions of its sigmas, in words and in JSON, and the number of equally good
/// schemes.
#[test]
fn an_answer_says_what_it_rests_on() {
    let run = |more: &[&str]| {
        let arguments =
            ["design", "--positions", "3", "--carry", "inertial", "--observable", "D_F", "--dwell", "500"];
        let arguments =
            [&arguments[..], &["--step", "20", "--noise", "2e-5", "--slew-rate", "0.5"], more].concat();
        stdout(&run(&arguments))
    };
    let table = run(&[]).replace("\n      ", " ");
    assert!(!table.contains("margin"), "{table}");
    for said in [
        "latitude 28.2 deg (chosen here: nothing names one)",
        "500 s at each position, steps of at most 20 s, a sample after each; slews at 0.5 deg/s",
        "noise of Z 2e-5 g per sample and axis; random drift: none; prior: none",
        "psi and all coefficients of the terms F,I,O,S",
        "24 sequences are as good, itself and its images counted",
        "half turns are tried in both directions",
        "NUE (-N) NDW (-N) NUE",
        "Best schemes (sigma: information of all samples, no prior, no random drift; psi at the end)",
        "Proven best of these candidates by worst degree, then the criterion worst: NUE (-N) NDW (-N) NUE: worst \
         sigma 0.008402 deg/h (D_FY); no requirement is stated, so none is judged.",
        "inertial carry: psi goes on in geographic axes from position to position",
        "under the other carries, platform (repositioning at once): not every coefficient is determined",
        "not stated, chosen by the program: latitude 28.2 deg\n",
    ] {
        assert!(table.contains(said), "{said}: {table}");
    }
    assert!(!run(&["--latitude", "28.2"]).contains("chosen here"));
    let json: serde_json::Value = serde_json::from_str(&run(&["--format", "json"])).expect("JSON");
    let search = &json["search"];
    let conditions = serde_json::json!({
        "latitude_deg": 28.2, "latitude_by_default": true, "dwell_s": 500.0, "step_s": 20.0,
        "accelerometer_noise_g": 2e-5,
        "azimuth_noise_deg": null, "slew_rate_deg_s": 0.5, "drift_noise": null, "prior": null,
        "by_default": ["latitude_deg"]
    });
    assert_eq!(search["conditions"], conditions);
    assert!(search["drift_noise"].is_null() && search["prior"].is_null());
    assert_eq!(json["found"][0]["requirements"]["basis"], "predicted");
    assert_eq!(json["found"][0]["requirements"]["stated"], 0);
    let missed = run(&["--requirement", "D=1e-9"]).replace("\n      ", " ");
    assert!(missed.contains("requirements are NOT met, 3 of 3 missed: D_FX, D_FY, D_FZ"), "{missed}");
    // `--meet` and the criterion `margin` need a requirement
    refused(
        &["design", "--positions", "5", "--meet"],
        &["--meet needs a requirement", "--requirement NAME=SIGMA"],
    );
    refused(
        &["design", "--positions", "5", "--criterion", "margin"],
        &["--criterion margin needs a requirement"],
    );
    assert_eq!(search["ties"], serde_json::json!({ "sequences": 24, "within": 1e-6 }));
    let turns =
        serde_json::json!([{ "to": 2, "about": [-1.0, 0.0, 0.0] }, { "to": 3, "about": [-1.0, 0.0, 0.0] }]);
    assert_eq!(json["found"][0]["half_turns"], turns);
}

/// Ctrl-C before any result ends the program with exit code 130.
#[cfg(unix)]
#[test]
fn an_interrupted_program_ends_with_130() {
    // a search of minutes on any machine
    let arguments = ["design", "--minimum", "--carry", "inertial", "--candidates", "grid:30", "--quiet"];
    // a signal before the program handles it ends the program without a code: the test tries again later
    let code = [300, 1000, 3000].into_iter().find_map(|wait| {
        let program =
            obsdeg(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it runs");
        std::thread::sleep(std::time::Duration::from_millis(wait));
        let sent = Command::new("kill").args(["-INT", &program.id().to_string()]).status();
        assert!(sent.expect("a signal").success());
        let output = program.wait_with_output().expect("it ends");
        assert!(output.stdout.is_empty());
        output.status.code()
    });
    assert_eq!(code, Some(130));
}

/// The file of the best scheme is accepted by `analyze` and has the promised sigma. Wrong arguments are
/// named.
#[test]
#[ignore = "seconds: .ci/run"]
fn the_winner_is_a_scheme_file() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("found").display().to_string();
    let winner = place.path().join("found/winner.toml").display().to_string();
    let file = "examples/six-positions/scheme.toml";
    let found = run(&[
        "design",
        "--candidates",
        file,
        "--positions",
        "5",
        "--carry",
        "inertial",
        "--slew-rate",
        "1",
        "--gimbal",
        "beta=-80:80",
        "-o",
        &folder,
        "--format",
        "json",
    ]);
    assert!(found.status.success(), "{}", stderr(&found));
    let found: serde_json::Value = serde_json::from_slice(&found.stdout).expect("JSON");
    assert_eq!((&found["schema"], &found["search"]["proven"]), (&"obsdeg.design/2".into(), &true.into()));
    for name in ["design.json", "front.svg", "front.png", "positions.svg"] {
        assert!(place.path().join("found").join(name).is_file(), "{name}");
    }
    let compared = json(&["compare", &winner, "--format", "json"]);
    let (promised, kept) =
        (&found["found"][0]["worst_sigma_dph"], &compared["schemes"][0]["worst"]["sigma_dph"]);
    let (promised, kept) = (promised.as_f64().expect("a number"), kept.as_f64().expect("a number"));
    assert!((promised / kept - 1.0).abs() < 1e-6, "{promised} {kept}");
    assert!(run(&["analyze", "--scheme", &winner, "--solutions", "off"]).status.success());
    // the file has half turns about an axis and about a diagonal, in both directions, and the other commands
    // confirm the result of the search
    let two = place.path().join("two.toml").display().to_string();
    for (attitudes, axes) in [
        (["NUE", "NDW"], ["about = \"N\", angle_deg = 180", "about = \"N\", angle_deg = -180"]),
        (["NUE", "WDS"], ["about = [1, 0, -1], angle_deg = 180", "about = [-1, 0, 1], angle_deg = 180"]),
    ] {
        let text = attitudes.map(|a| format!("[[position]]\nname = \"{a}\"\nattitude = \"{a}\"\n")).concat();
        std::fs::write(&two, format!("carry = \"inertial\"\nlatitude_deg = 28.2\n{text}")).expect("written");
        let list =
            ["--positions", "4", "--slew-rate", "0.5", "--observable", "D_FY", "--format", "json", "--force"];
        let found = run(&[&["design", "--candidates", &two, "-o", &folder], &list[..]].concat());
        assert!(found.status.success(), "{}", stderr(&found));
        let found: serde_json::Value = serde_json::from_slice(&found.stdout).expect("JSON");
        let turns = found["found"][0]["half_turns"].as_array().expect("half turns");
        let text = std::fs::read_to_string(&winner).expect("a winner");
        assert!(
            !turns.is_empty() && turns.len() == axes.map(|a| text.matches(a).count()).iter().sum::<usize>(),
            "{text}"
        );
        let drawn = std::fs::read_to_string(place.path().join("found/positions.svg")).expect("a picture");
        assert_eq!(drawn.matches("; after 180 deg about ").count(), turns.len(), "{drawn}");
        let promised = found["found"][0]["worst_sigma_dph"].as_f64().expect("a number");
        let sigma = |rows: &serde_json::Value| {
            let row = rows.as_array().expect("rows").iter().find(|q| q["name"] == "D_FY").expect("D_FY");
            row["sigma"].as_f64().expect("a number")
        };
        let compared = json(&["compare", &winner, "--format", "json"]);
        let simulated = [
            &["simulate", "--scheme", &winner, "--format", "json", "--drift-noise", "0 deg/h"][..],
            &["--prior", "psi=1e6", "--prior", "D=1e6"],
        ];
        let simulated = json(&simulated.concat());
        for (kept, within) in
            [(sigma(&compared["schemes"][0]["quantities"]), 1e-6), (sigma(&simulated["quantities"]), 1e-3)]
        {
            assert!((promised / kept - 1.0).abs() < within, "{promised} {kept}");
        }
        // lists of slews state the slew axes
        let slews = [&compared["schemes"][0]["slews"], &simulated["timeline"]].map(|rows| {
            let of = |r: &serde_json::Value| r["turn"]["about"].as_array().cloned();
            rows.as_array().expect("rows").iter().filter_map(of).collect::<Vec<_>>()
        });
        let expected: Vec<_> = turns.iter().filter_map(|t| t["about"].as_array().cloned()).collect();
        assert!(slews.iter().all(|about| *about == expected), "{slews:?} {expected:?}");
    }
    let again = ["design", "--candidates", file, "--positions", "5", "-o", &folder, "--force"];
    assert!(run(&again).status.success());
    for (arguments, expected) in [
        (&["design", "--positions", "5", "-o", &folder][..], "--force"),
        (&["design", "--positions", "5", "--candidates", "grid:40"], "divides 90"),
        (&["design", "--positions", "5", "--candidates", "grid:x"], "grid:45"),
        (
            &["design", "--positions", "5", "--candidates", "examples/tumbling/scheme.toml"],
            "rotating segment",
        ),
        (&["design", "--positions", "5", "--gimbal", "beta=80:-80"], "beta=-80:80"),
        (&["design", "--positions", "5", "--observable", "D_FW"], "D_FX"),
        (&["design", "--positions", "5", "--max-degree", "D_F=x"], "D_F=1"),
        (&["design", "--positions", "5", "--max-degree", "1"], "every sequence was examined"),
        (&["design", "--positions", "5", "--max-time", "0"], "more than 0"),
        (&["design", "--positions", "5", "--slew-rate", "1"], "inertial"),
        (&["design", "--positions", "4", "--meet", "--requirement", "D=1e-9"], "every sequence was examined"),
        (
            &["design", "--positions", "5", "--criterion", "margin", "--requirement", "D_F=0"],
            "expected 1e-12 to 1e9",
        ),
        (&["design"], "--positions"),
        (&["design", "--positions", "0"], "1 to 100"),
        (
            &["design", "--positions", "3", "--carry", "inertial"],
            "no scheme of 3 of these candidates makes every coefficient observable: every sequence was examined",
        ),
        (
            &["design", "--positions", "5", "--max-time", "10"],
            "at most 10 s in all: 5 times 1000 s at a position are more",
        ),
        (
            &["design", "--positions", "3", "--observable", "D_F", "--max-degree", "1"],
            "makes D_FX, D_FY, D_FZ observable with degree of every required coefficient at most 1",
        ),
        (
            &[
                "design",
                "--positions",
                "4",
                "--carry",
                "inertial",
                "--candidates",
                "grid:45",
                "--restarts",
                "2",
            ],
            "sequences of 4 of these candidates that were looked at makes every coefficient observable",
        ),
        (&["design", "--minimum", "--terms", "drift"], "coefficients"),
        (&["design", "--minimum", "--candidates", "examples/generic-angles/scheme.toml"], "generic"),
        (&["design", "--positions", "5", "--dwell", "0"], "'--dwell <S>': expected"),
    ] {
        let output = run(arguments);
        let stderr = stderr(&output);
        assert!(output.status.code() == Some(2) && stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}

/// The answer in JSON without the entry on its parts.
fn without_parts(answer: &str) -> serde_json::Value {
    let mut answer: serde_json::Value = serde_json::from_str(answer).expect("JSON");
    answer["search"].as_object_mut().expect("a search").remove("parts");
    answer
}

/// Parts of a search are files. Merged they give the answer of the whole search, and a message on a bad part
/// names its file.
#[test]
fn parts_are_files() {
    let place = tempfile::tempdir().expect("a folder");
    let file = |name: &str| place.path().join(name).display().to_string();
    let common =
        ["design", "--positions", "3", "--carry", "inertial", "--observable", "D_F", "--format", "json"];
    let with = |more: &[&str]| {
        let arguments = [&common[..], more].concat();
        run(&arguments)
    };
    let [one, two] = [1, 2].map(|i| file(&format!("part-{i}.json")));
    for (i, path) in [(1, &one), (2, &two)] {
        let said = stdout(&with(&["--part", &format!("{i}/2"), "-o", path]));
        assert!(said.starts_with(&format!("part {i} of 2: ")), "{said}");
        assert!(said.ends_with(" sequences; --format: where the parts are merged\n"), "{said}");
        // a complete part is not searched again
        assert_eq!(stdout(&with(&["--part", &format!("{i}/2"), "-o", path])), said);
    }
    let whole = stdout(&with(&[]));
    let merged = stdout(&with(&["--merge", &two, &one]));
    assert_eq!(without_parts(&merged), without_parts(&whole));
    // parts contain their inputs, including a file of candidates
    assert_eq!(stdout(&run(&["design", "--merge", &one, &two, "--format", "json"])), merged);
    let said = stdout(&run(&["design", "--merge", &one, &two]));
    assert!(said.contains("proven if the parts were searched as they state"), "{said}");
    let wanted = "put together from 2 parts, searched by version 0.1.0: what they list was evaluated again";
    assert!(said.split_whitespace().collect::<Vec<_>>().join(" ").contains(wanted), "{said}");
    let said = stdout(&run(&["design", "--merge", &one, &two, "--check", "100"]));
    assert!(said.contains("Proven best"), "{said}");
    let candidates = file("candidates.toml");
    std::fs::copy("examples/six-positions/scheme.toml", &candidates).expect("copied");
    let mut asked = vec![
        "design",
        "--positions",
        "4",
        "--candidates",
        &candidates,
        "--carry",
        "platform",
        "--within",
        "0",
    ];
    asked.extend(["--observable", "D_F"]);
    let part = file("whole.json");
    assert!(run(&[&asked[..], &["--part", "1/1", "-o", &part]].concat()).status.success());
    let whole = stdout(&run(&[&asked[..], &["--format", "json"]].concat()));
    std::fs::remove_file(&candidates).expect("removed");
    let merged = stdout(&run(&["design", "--merge", &part, "--format", "json"]));
    assert_eq!(without_parts(&merged), without_parts(&whole));
    for (arguments, expected) in [
        (vec!["--merge", &one], "missing of 2 parts: 2"),
        (vec!["--merge", &one, &two, &one], "is in"),
        (vec!["--merge", &one, "Cargo.toml"], "Cargo.toml: it is no part of a search"),
        (vec!["--merge", &one, &two, "--seed", "2"], "it is a part of another search"),
        (vec!["--part", "2/2", "-o", &one], "it is part 1 of 2; expected part 2 of 2"),
        (vec!["--part", "3/2", "-o", "x"], "expected a part such as 2/7"),
        (vec!["--part", "1/2"], "--output"),
        (vec!["--merge", &one, &two, "--within", "1"], "--within does nothing here"),
        (vec!["--check", "3"], "--check does nothing here: expected --merge"),
    ] {
        let output = with(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
    }
}

/// Options without effect are refused, and the message names the missing option.
#[test]
fn options_that_do_nothing_are_refused() {
    let minimum = "does nothing with --minimum";
    let with_minimum = [
        &["--keep", "3"][..],
        &["--restarts", "3"],
        &["--within", "1"],
        &["--refine"],
        &["--divide"],
        &["--front", "4"],
        &["--round", "5"],
        &["--max-degree", "1"],
        &["--criterion", "d"],
        &["--meet"],
        &["--max-time", "1e4"],
        &["--max-slew", "100"],
        &["--slew-rate", "1"],
        &["--prior", "D=1"],
        &["--dwell", "100"],
        &["--step", "1"],
        &["--noise", "1e-4"],
        &["--accelerometer-instability", "1"],
        &["--azimuth-noise", "0.1"],
        &["--requirement", "D=1"],
    ];
    for options in with_minimum {
        for carry in ["inertial", "reset"] {
            let output = run(&[&["design", "--minimum", "--carry", carry], options].concat());
            let said = stderr(&output);
            assert!(output.status.code() == Some(2), "{options:?}: {said}");
            assert!(said.contains(options[0]) && said.contains(minimum), "{options:?}: {said}");
        }
    }
    for (arguments, expected) in [
        (
            &["--carry", "reset", "--round", "7"][..],
            "--round does nothing here: expected --candidates free with it",
        ),
        (&["--carry", "inertial", "--within", "1"], "--within does nothing here: expected --carry reset"),
        (&["--carry", "inertial", "--max-slew", "10"], "--max-slew does nothing here: expected slews"),
        (&["--azimuth-noise", "0.1"], "--azimuth-noise does nothing here: expected a measured azimuth"),
        (&["--accelerometer-correlation-time", "100"], "expected --accelerometer-instability with it"),
        (
            &["--carry", "reset", "--candidates", "free", "--within", "0"],
            "--within does nothing here: expected given candidates",
        ),
        (
            &["--carry", "reset", "--within", "1", "--part", "1/2", "-o", "part.json"],
            "--within does nothing here: expected a search that is not in parts",
        ),
    ] {
        let output = run(&[&["design", "--positions", "3"], arguments].concat());
        let said = stderr(&output);
        assert!(output.status.code() == Some(2) && said.contains(expected), "{arguments:?}: {said}");
    }
}

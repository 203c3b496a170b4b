//! Comparison of schemes: predicted sigmas are those of the filter, and each position has a stated purpose.

use std::process::Output;

use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::{Carry, Rotation, Scheme};
use obsdeg_evidence::compare::{ComparedScheme, Entry, compare};
use obsdeg_evidence::requirements::Miss;
use obsdeg_evidence::simulation::{Conditions, simulate};
use obsdeg_report::{Format, TerminalLayout};

use crate::program::{json, run, stderr, stdout};
use crate::schemes::{S6, paper, scheme};

fn compared(arguments: &[&str]) -> Output {
    run(&[&["compare", "--details"], arguments].concat())
}

fn printed(arguments: &[&str]) -> String {
    stdout(&compared(arguments))
}

fn review(scheme: &Scheme) -> ComparedScheme {
    let entry = Entry { name: "it".into(), scheme: scheme.clone(), conditions: Conditions::default() };
    compare(&[entry], 1).expect("compared").schemes.remove(0)
}

/// The information of all samples, against a filter with an uninformative prior and no drift noise.
#[test]
#[ignore = "seconds: .ci/run release"]
fn the_predicted_sigma_is_that_of_a_filter() {
    for (attitudes, carry) in [
        (&S6[..5], Carry::Inertial),
        (&S6[..], Carry::Inertial),
        (&S6[..4], Carry::Platform),
        (&S6[..], Carry::Reset),
    ] {
        let scheme = scheme(attitudes, carry);
        let prior = |name: &str| Assignment { name: name.into(), value: 1e7 };
        let quiet = Conditions {
            drift_noise: "0 deg/h".parse().expect("a drift noise"),
            priors: vec![prior("psi"), prior("D")],
            ..Conditions::default()
        };
        let (filter, _) = simulate(&scheme, &quiet, 1).expect("simulated");
        for (q, f) in review(&scheme).quantities.iter().zip(&filter.quantities) {
            // psi of the filter refers to the end of the run
            if q.name.starts_with("D_") {
                let sigma = q.sigma.expect("observable");
                assert!((sigma / f.sigma - 1.0).abs() < 1e-4, "{} {carry}: {sigma} {}", q.name, f.sigma);
            }
        }
    }
}

#[test]
fn what_each_position_is_for() {
    // five positions are the minimum under inertial carry, so none can be dropped; of six, any one can
    let five = review(&scheme(&S6[..5], Carry::Inertial));
    assert!(five.drop_one.iter().all(|d| !d.lost.is_empty() && d.worst.is_none()));
    assert!(five.quantities.iter().all(|q| q.carried_by.len() == 5));
    let six = review(&scheme(&S6, Carry::Inertial));
    let worst = six.worst.clone().expect("all observable").sigma_dph;
    assert!(
        six.drop_one
            .iter()
            .all(|d| d.lost.is_empty() && d.worst.as_ref().is_some_and(|w| w.sigma_dph > worst))
    );
    // the paper's case: the second position distinguishes D_FX from D_SX; D_OX is excited at neither
    let paper = review(&scheme(&["0,0,0", "180,0,0"], Carry::Platform));
    let of = |name: &str| paper.quantities.iter().find(|q| q.name == name).expect("an unknown");
    assert_eq!(of("D_FX").carried_by, ["p1", "p2"]);
    assert_eq!(
        (of("D_FX").excitation.as_slice(), of("D_OX").excitation.as_slice()),
        (&[1.0, 1.0][..], &[0.0, 0.0][..])
    );
    assert_eq!((of("D_FZ").sigma, of("D_OX").sigma, paper.worst.as_ref()), (None, None, None));
    assert!(!paper.meets_requirements);
}

#[test]
fn sensitivity_says_what_the_assumptions_are_worth() {
    let six = review(&scheme(&S6, Carry::Inertial));
    let at =
        |condition: &str| six.sensitivity.iter().find(|s| s.condition == condition).expect("a condition");
    let sigma = |condition: &str| at(condition).worst.as_ref().map(|w| w.sigma_dph);
    let here = six.worst.as_ref().map(|w| w.sigma_dph);
    // eps_y is observed through wN: its sigma grows towards the pole, where eps_y is not observable
    assert!(sigma("latitude 30 deg") > here && sigma("latitude 75 deg") > sigma("latitude 30 deg"));
    assert_eq!((at("latitude 90 deg").worst.as_ref(), at("latitude 90 deg").rank[0] < 15), (None, true));
    // order 2: twice the dwell gains a factor of 2^2.5, slightly less because the earth turns
    let gain = sigma("dwell x 0.5").expect("there") / here.expect("there");
    assert!((4.5..6.5).contains(&gain), "{gain}");
    assert_eq!(at("reset carry").rank, [30, 30]);
}

/// Every unknown with a requirement counts, psi of every position included. An unobservable unknown misses
/// its requirement.
#[test]
#[ignore = "seconds: .ci/run release"]
fn requirements_are_those_of_all_unknowns() {
    let missed = |r: &ComparedScheme| -> Vec<(String, Miss)> {
        r.requirements.missed.iter().map(|m| (m.name.clone(), m.why)).collect()
    };
    let psi = |names: &[&str]| -> Vec<(String, Miss)> {
        names.iter().map(|n| (n.to_string(), Miss::TooLarge)).collect()
    };
    let under = |scheme: Scheme, stated: &[(&str, f64)]| {
        let stated = stated.iter().map(|(name, value)| Assignment { name: (*name).into(), value: *value });
        let conditions = Conditions { requirements: stated.collect(), ..Conditions::default() };
        compare(&[Entry { name: "it".into(), scheme, conditions }], 1).expect("compared").schemes.remove(0)
    };
    let five = under(scheme(&S6[..5], Carry::Inertial), &[("D", 0.1), ("psi", 0.001)]);
    assert_eq!(missed(&five), psi(&["psi_x", "psi_y", "psi_z"]));
    assert_eq!((five.requirements.stated, five.requirements.met), (15, 12));
    assert!(!five.meets_requirements && five.worst.as_ref().is_some_and(|w| w.sigma_dph < 0.1));
    // without stated requirements none is judged
    let nothing = review(&scheme(&S6[..5], Carry::Inertial));
    assert_eq!(
        (nothing.requirements.stated, nothing.meets_requirements, missed(&nothing)),
        (0, false, vec![])
    );
    // under reset carry each position has a psi of its own, which a requirement may name
    let of_position = |name: &str| Conditions {
        requirements: vec![Assignment { name: name.into(), value: 1e-3 }],
        ..Conditions::default()
    };
    let reset = |name: &str| {
        let entry =
            Entry { name: "it".into(), scheme: scheme(&S6, Carry::Reset), conditions: of_position(name) };
        compare(&[entry], 1).expect("compared").schemes.remove(0)
    };
    let six = reset("psi_y@4");
    assert_eq!((six.requirements.stated, missed(&six)), (1, psi(&["psi_y@4"])));
    assert_eq!(reset("psi").requirements.stated, 18);
    // one decision: a requirement is met if its margin in the table is at least one
    let paper = under(scheme(&["0,0,0", "180,0,0"], Carry::Platform), &[("D", 0.1), ("psi", 0.01)]);
    for r in [&five, &six, &paper] {
        let asked = r.quantities.iter().filter(|q| q.requirement.is_some());
        let met: Vec<bool> =
            asked.clone().map(|q| q.sigma.zip(q.requirement).is_some_and(|(s, r)| s <= r)).collect();
        assert_eq!(r.requirements.met, met.iter().filter(|m| **m).count());
        assert_eq!(r.meets_requirements, met.iter().all(|m| *m));
        let smallest = asked.filter_map(|q| q.margin).reduce(f64::min);
        assert_eq!(r.requirements.worst.as_ref().map(|w| w.margin), smallest);
    }
    let unseen: Vec<String> =
        (paper.quantities.iter().filter(|q| q.degree.is_none()).map(|q| q.name.clone())).collect();
    let said = missed(&paper).into_iter().filter(|m| m.1 == Miss::NotObservable).map(|m| m.0);
    assert_eq!(said.collect::<Vec<_>>(), unseen);
}

/// The excitation in a rotating segment is the root mean square over its arc. Reference: integrals of squares
/// of sines.
#[test]
fn excitation_of_an_arc() {
    let turning = |angle: &str, terms: &str| {
        let mut s = scheme(&["NUE", "UEN"], Carry::Inertial);
        s.unknowns = terms.parse().expect("terms");
        s.positions[0].rotation = Some(Rotation::new("X_p", angle).expect("a rotation"));
        review(&s)
    };
    let at_first = |r: &ComparedScheme, name: &str| {
        r.quantities.iter().find(|q| q.name == name).expect("a coefficient").excitation[0]
    };
    // about X_p, horizontal: g turns in the plane Y_p, Z_p, starting at -Y_p; gyro Y has I = +y, gyro Z I =
    // +z
    for angle in ["360", "90", "-135", "30", "7200"] {
        let a = angle.parse::<f64>().expect("degrees").to_radians();
        let half = (2.0 * a).sin() / (4.0 * a);
        let r = turning(angle, "F,I,II");
        let near =
            |found: f64, squared: f64| assert!((found - squared.sqrt()).abs() < 1e-8, "{angle}: {found}");
        near(at_first(&r, "D_FX"), 1.0);
        near(at_first(&r, "D_IX"), 0.0);
        near(at_first(&r, "D_IY"), 0.5 + half);
        near(at_first(&r, "D_IZ"), 0.5 - half);
        // mean of sin^4
        near(at_first(&r, "D_IIZ"), 3.0 / 8.0 - half + (4.0 * a).sin() / (32.0 * a));
    }
    // the tumble: every observable coefficient is excited in some segment
    let json = json(&["compare", "examples/tumbling/scheme.toml", "--format", "json"]);
    let coefficients = json["schemes"][0]["quantities"].as_array().expect("a list").iter();
    for q in coefficients.filter(|q| q["unit"] != "deg" && q["status"] == "observable") {
        let largest = q["excitation"].as_array().expect("a list").iter().filter_map(|x| x.as_f64());
        assert!(largest.fold(0.0, f64::max) > 0.5, "{q}");
    }
}

/// Positions that can be dropped without loss of observability need not be droppable within the requirements.
#[test]
fn positions_that_can_go() {
    let six = scheme(&S6, Carry::Inertial);
    let of = |d: f64| {
        let require = |name: &str, value| Assignment { name: name.into(), value };
        let requirements = vec![require("D", d), require("psi", 1.0)];
        let conditions = Conditions { requirements, ..Conditions::default() };
        let entry = Entry { name: "it".into(), scheme: six.clone(), conditions };
        compare(&[entry], 1).expect("compared").schemes.remove(0)
    };
    // by the worst sigma without each position, as drop-one states it
    let all = of(1e3);
    let mut without: Vec<f64> =
        all.drop_one.iter().filter_map(|d| Some(d.worst.as_ref()?.sigma_dph)).collect();
    without.sort_by(f64::total_cmp);
    let between = (without[2] + without[3]) / 2.0;
    let r = of(between);
    assert!(r.requirements.all_met() && r.drop_one.iter().all(|d| d.lost.is_empty()));
    for d in &r.drop_one {
        let sigma = d.worst.as_ref().expect("observable").sigma_dph;
        assert_eq!(
            (d.requirements.stated, d.requirements.all_met()),
            (15, sigma <= between),
            "{}",
            d.position
        );
    }
    assert_eq!(r.drop_one.iter().filter(|d| d.requirements.all_met()).count(), 3);
    assert!(all.drop_one.iter().all(|d| d.requirements.all_met()));
    let text = printed(&["examples/six-positions/scheme.toml", "--requirement", "D=1e-6"]);
    let row = text.lines().find(|l| l.starts_with(" six-positions")).expect("a row");
    assert!(
        text.contains("observable without") && row.contains(" any one ") && row.ends_with("   -"),
        "{row}"
    );
}

/// The table states what it compares: schemes under other carries (without slews), and schemes with different
/// tasks.
#[test]
#[ignore = "seconds: .ci/run release"]
fn what_is_not_alike_is_said() {
    let twelve = "examples/twelve-positions/scheme.toml";
    let text = printed(&[twelve]);
    assert!(
        text.contains(" platform carry, no slews ") && text.contains(" reset carry, no slews "),
        "{text}"
    );
    assert!(text.contains("no slews: slews need inertial carry") && !text.contains("not like with like"));
    let (five, six) = ("examples/five-positions/scheme.toml", "examples/six-positions/scheme.toml");
    let text = printed(&[five, six]);
    assert!(text.contains(" inertial carry ") && !text.contains("slews:"), "{text}");
    assert!(!text.contains("not like with like"), "{text}");
    let text = printed(&[twelve, five]);
    assert!(
        text.contains("not like with like: the schemes differ in carry, latitude, requirements\n"),
        "{text}"
    );
    let text = printed(&[twelve, five, "--carry", "inertial", "--latitude", "48", "--requirement", "D=1"]);
    assert!(!text.contains("not like with like"), "{text}");
    let json: serde_json::Value =
        serde_json::from_str(&printed(&[twelve, five, "--latitude", "48", "--format", "json"]))
            .expect("JSON");
    assert_eq!(json["differ"], serde_json::json!(["carry", "requirements"]));
    assert_eq!(json["schemes"][0]["sensitivity"][9]["condition"], "platform carry, no slews");
}

/// Every condition of the predicted sigmas that two schemes do not share is named.
#[test]
fn conditions_that_differ_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, conditions: &str, record: &str| {
        let path = folder.path().join(name);
        let text = format!(
            "latitude_deg = 40\n[simulation]\ndwell_s = 300\n{conditions}{record}\
             [[position]]\nattitude = 'NUE'\n[[position]]\nattitude = 'UEN'\n"
        );
        std::fs::write(&path, text).expect("written");
        path.display().to_string()
    };
    let plain = file("plain.toml", "", "");
    let random = "random drift or bias instability";
    for (conditions, record, named) in [
        ("", "", None),
        ("drift_noise = '0.001 deg/sqrt(h)'\n", "", Some(random)),
        ("bias_instability_dph = 0.01\n", "", Some(random)),
        ("accelerometer_bias_instability_ug = 2\n", "", Some(random)),
        ("priors = { D_F = 1 }\n", "", Some("prior")),
        ("step_s = 5\n", "", Some("step")),
        ("", "[record]\nsettle = 20\n", Some("settle")),
    ] {
        let other = file("other.toml", conditions, record);
        let json: serde_json::Value =
            serde_json::from_str(&printed(&[&plain, &other, "--format", "json"])).expect("JSON");
        assert_eq!(json["differ"], serde_json::json!(Vec::from_iter(named)), "{conditions}{record}");
    }
}

/// The answer and the table state the conditions of the sigmas. An unknown that the dwell makes undetermined
/// has no sigma.
#[test]
fn conditions_and_dwell() {
    let run = printed;
    let five = "examples/five-positions/scheme.toml";
    let given = ["--noise", "2e-6", "--step", "2.5", "--dwell", "300", "--latitude", "40"];
    let text = run(&[&[five][..], &given].concat()).replace("\n      ", " ");
    for said in [
        "sigma: information of all samples, no prior, no random drift; psi at the end",
        "noise of Z 2e-6 g per sample and axis; steps of at most 2.5 s",
        "300 s at a position unless it says otherwise, repositioning at once",
        "latitude 40 deg",
    ] {
        assert!(text.contains(said), "{said}: {text}");
    }
    let json: serde_json::Value =
        serde_json::from_str(&run(&[&[five][..], &given, &["--format", "json"]].concat())).expect("JSON");
    let c = &json["schemes"][0]["conditions"];
    let found = ["accelerometer_noise_g", "step_s", "dwell_s", "latitude_deg"].map(|k| c[k].as_f64());
    assert_eq!(found, [Some(2e-6), Some(2.5), Some(300.0), Some(40.0)]);
    let pole =
        Scheme { latitude: "90".parse().ok(), ..scheme(&["0,0,0", "0,90,0", "45,0,0"], Carry::Platform) };
    let r = review(&pole);
    let psi_y = r.quantities.iter().find(|q| q.name == "psi_y").expect("psi_y");
    assert_eq!((psi_y.degree, psi_y.accuracy_order, psi_y.sigma), (Some(0), None, None));
}

#[test]
fn files_are_named_and_wrong_ones_refused() {
    let run = compared;
    let files = ["examples/five-positions/scheme.toml", "examples/simulated-run/scheme.toml"];
    let output = run(&files);
    let text = stdout(&output);
    assert!(output.status.success(), "{}", stderr(&output));
    insta::with_settings!({ omit_expression => true, prepend_module_to_snapshot => false }, {
        insta::assert_snapshot!("compare_table", text);
    });
    for format in ["markdown", "latex", "csv", "json"] {
        let output = run(&[&files[..], &["--format", format]].concat());
        assert!(output.status.success() && stdout(&output).contains("five-positions"));
    }
    for (arguments, expected) in [
        (&["no/such.toml"][..], "no/such.toml"),
        (&["examples/wrong-gyro/scheme.toml"], "wrong-gyro"),
        (&["examples/generic-angles/scheme.toml"], "generic"),
        (&[files[0], "--requirement", "D_FW=1"], "D_FW"),
        (&[], "FILE"),
    ] {
        let output = run(arguments);
        let stderr = stderr(&output);
        assert!(output.status.code() == Some(2) && stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}

/// Sigmas with slews and without a prior agree with an independent computation in 70 digits. An unknown
/// coupled by only 6e-7 to an undetermined one has no sigma.
#[test]
fn sigmas_with_slews_are_those_without_a_prior() {
    let folder = tempfile::tempdir().expect("a folder");
    let sigmas = |name: &str, text: &str| {
        let path = folder.path().join(name).display().to_string();
        std::fs::write(&path, text).expect("written");
        let json = json(&["compare", "--format", "json", &path]);
        let quantities = json["schemes"][0]["quantities"].as_array().expect("a list").clone();
        let of =
            |q: &serde_json::Value| (q["name"].as_str().expect("a name").to_string(), q["sigma"].as_f64());
        quantities.iter().map(of).collect::<std::collections::BTreeMap<_, _>>()
    };
    let slow = sigmas(
        "slow.toml",
        "carry = \"inertial\"\nlatitude_deg = 89.9\n[simulation]\nslew_rate_deg_s = 0.01\n[[position]]\n\
         attitude = \"EDN\"\n\
         [[position]]\nangles_deg = [-177.94, 102.12, 115.37]\n[[position]]\nangles_deg = [-177.94, 102.12, -176.94]\n",
    );
    for (name, sigma) in
        [("D_FX", 142.9), ("D_FY", 33.6), ("D_FZ", 2.577), ("D_OZ", 1.245), ("D_SX", 13.31), ("D_SZ", 2.577)]
    {
        let found = slow[name].expect("determined");
        assert!((found / sigma - 1.0).abs() < 0.02, "{name}: {found} instead of {sigma}");
    }
    let coupled = sigmas(
        "coupled.toml",
        "carry = \"inertial\"\nlatitude_deg = 60\n[simulation]\nslew_rate_deg_s = 1\ndwell_s = 3000\n\
         [[position]]\nattitude = \"DWN\"\n[[position]]\nattitude = \"SWD\"\n",
    );
    assert_eq!((coupled["D_SY"], coupled["D_IX"]), (None, None));
}

/// If the paper's drifts break the small-angle model, sigmas of the filter with full attitudes stand
/// beside the predicted ones. An independent extended filter found 0.03 deg/h for D_FX, not 0.0003. At a
/// thousandth of the drifts the column is missing.
#[test]
fn sigmas_at_the_schemes_own_drifts() {
    let compared = |conditions: Conditions| {
        let entry = Entry { name: "p1p2".into(), scheme: paper(Carry::Platform), conditions };
        compare(&[entry], 1).expect("compared").schemes.remove(0)
    };
    // the paper's drifts count as a scheme's own only if the scheme states them
    let drift = |name: &str, value| Assignment { name: name.into(), value };
    let stated = vec![drift("D_FX", 11.0), drift("D_FY", 12.0), drift("D_FZ", 13.0)];
    let own = Conditions { values: [Conditions::default().values, stated].concat(), ..Conditions::default() };
    let nothing = compared(Conditions::default());
    assert!(nothing.validity.is_none() && nothing.quantities.iter().all(|q| q.sigma_extended.is_none()));
    let large = compared(own.clone());
    let of =
        |r: &ComparedScheme, name: &str| r.quantities.iter().find(|q| q.name == name).expect("there").clone();
    assert!(!large.validity.as_ref().expect("drifts").holds);
    let d_fx = of(&large, "D_FX");
    assert!(
        (0.025..0.035).contains(&d_fx.sigma_extended.expect("beside")) && d_fx.sigma.expect("seen") < 5e-4
    );
    assert!((0.6..0.9).contains(&of(&large, "D_FY").sigma_extended.expect("beside")));
    assert_eq!(of(&large, "psi_x").sigma_extended, None);
    let text = obsdeg_report::written(
        &compare(&[Entry { name: "p1p2".into(), scheme: paper(Carry::Platform), conditions: own }], 1)
            .expect("compared"),
        Format::Table,
        TerminalLayout::default(),
    )
    .expect("text");
    assert!(
        text.contains("Sigma at the drifts that are stated")
            && text.contains("p1p2: at the drifts that are stated |psi| reaches 11.81 deg"),
        "{text}"
    );
    let psi = Assignment { name: "psi".into(), value: 1e-4 };
    let values = [Conditions::default().values, vec![psi]].concat();
    let small = compared(Conditions { drift_scale: 1e-4, values, ..Conditions::default() });
    assert!(
        small.validity.expect("drifts").holds && small.quantities.iter().all(|q| q.sigma_extended.is_none())
    );
}

/// The decision first: without `--details` the table has the schemes side by side and names what it leaves
/// out, with `--details` every line of it too.
#[test]
fn the_decision_comes_first() {
    let files = ["examples/five-positions/scheme.toml", "examples/six-positions/scheme.toml"];
    let text = |more: &[&str]| {
        let run = run(&[&["compare"], &files[..], more].concat());
        stdout(&run)
    };
    let (short, long) = (text(&[]), text(&["--details"]));
    assert!(short.lines().count() <= 52 && long.lines().count() > 120, "{short}");
    let (own, named) = short.split_once("\n\n  --details prints: ").expect("what is left out");
    assert!(long.starts_with(own), "{short}");
    let named = named.replace("\n      ", " ");
    assert!(named.contains("By unknown; Without one position; Sensitivity"), "{named}");
    for heading in named.trim().split("; ") {
        assert!(long.lines().any(|line| line.starts_with(heading)), "{heading}");
        assert!(!own.lines().any(|line| line.starts_with(heading)), "{heading}");
    }
    // ratios of the printed sigmas
    let row: Vec<&str> =
        own.lines().find(|l| l.starts_with(" D_FX ")).expect("a row").split_whitespace().collect();
    let [a, b] = [row[2], row[3]].map(|x| x.parse::<f64>().expect("a sigma"));
    assert_eq!(row[4], format!("({:.2})", b / a));
    assert!(text(&["--format", "markdown"]).contains("Without one position"));
}

/// With a bench the worst figure is the total uncertainty, and every table names it so: the figure equals the
/// largest total of `simulate`.
#[test]
fn the_worst_figure_with_a_bench_is_a_total() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("bench.toml");
    let positions: String =
        ["NUE", "USE", "EDN", "WND", "DNE"].map(|n| format!("[[position]]\nattitude = '{n}'\n")).concat();
    std::fs::write(&file, format!("carry = 'inertial'\nbench = {{ K0 = 20 }}\n{positions}"))
        .expect("written");
    let file = file.to_str().expect("UTF-8");
    let text = printed(&[file]);
    assert!(text.contains("worst total(D)") && !text.contains("worst sigma(D)"), "{text}");
    let worst = json(&["compare", file, "--format", "json"])["schemes"][0]["worst"]["sigma_dph"].clone();
    let simulated = json(&["simulate", file, "--format", "json"]);
    let totals = simulated["omitted"]["budgets"].as_array().expect("budgets").iter();
    let drifts = totals.filter(|b| b["unknown"].as_str().is_some_and(|n| n.starts_with("D_")));
    let largest = drifts.filter_map(|b| b["total"].as_f64()).fold(0.0, f64::max);
    assert!((worst.as_f64().expect("a figure") / largest - 1.0).abs() < 1e-6, "{worst} {largest}");
}

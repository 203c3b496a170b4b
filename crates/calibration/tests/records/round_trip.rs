//! From a bench to a record to an estimate: the estimate equals the truth of the bench within its sigmas.

use nalgebra::{DMatrix, DVector};
use obsdeg_calibration::answer::ResidualDeviation;
use obsdeg_calibration::answer::{CalibrationFinding, PositionsBy};
use obsdeg_calibration::record::Record;
use obsdeg_calibration::{Calibration, CalibrationError, CalibrationProgress, Options, calibrate};
use obsdeg_core::model::settings::{Assignment, DriftNoise};
use obsdeg_core::model::{Carry, Path, Recording, Scheme, Still, parse_attitude};
use obsdeg_ekf::consistency::chi_square_band;
use obsdeg_evidence::simulation::Conditions;

use crate::simulator::{AtOnce, Bench, Sample, csv};

/// Scheme that a bench runs.
pub(crate) fn scheme(bench: &Bench, terms: &str) -> Scheme {
    let angles = bench
        .positions
        .iter()
        .map(|(_, a, _)| parse_attitude(&format!("{},{},{}", a[0], a[1], a[2])).expect("an attitude"));
    let mut scheme = Scheme::of_angles(angles);
    scheme.carry = match bench.carry {
        AtOnce::Inertial => Carry::Inertial,
        AtOnce::Platform => Carry::Platform,
        AtOnce::Reset(_) => Carry::Reset,
    };
    scheme.latitude = Some(bench.latitude_deg.to_string().parse().expect("a latitude"));
    scheme.unknowns = terms.parse().expect("terms");
    // torquers act on exact turns
    scheme.path = (terms == "all").then_some(Path::OneAxis);
    for (p, (name, _, dwell)) in scheme.positions.iter_mut().zip(&bench.positions) {
        p.name = (*name).into();
        p.dwell = Some(dwell.to_string().parse().expect("a dwell"));
    }
    scheme
}

pub(crate) fn conditions(bench: &Bench) -> Conditions {
    Conditions {
        drift_noise: DriftNoise::RandomWalk(bench.walk_deg_sqrt_h),
        accelerometer_noise_g: bench.noise_g,
        slew_rate_deg_s: bench.slew_deg_s,
        ..Conditions::default()
    }
}

pub(crate) fn of_csv(bench: &Bench, terms: &str, text: String) -> Result<Calibration, CalibrationError> {
    let record = Record::csv("run.csv", Box::new(std::io::Cursor::new(text)))?;
    calibrate(&scheme(bench, terms), &conditions(bench), vec![record], &Options::default(), &|_| true)
}

pub(crate) fn six() -> Bench {
    let attitudes = [
        [10.0, 25.0, 40.0],
        [130.0, -50.0, 70.0],
        [-95.0, 33.0, -160.0],
        [60.0, 80.0, 15.0],
        [-20.0, -70.0, 110.0],
        [170.0, 15.0, -75.0],
    ];
    let names = ["p1", "p2", "p3", "p4", "p5", "p6"];
    let positions = names.into_iter().zip(attitudes).map(|(n, a)| (n, a, 1000.0)).collect();
    Bench { positions, ..Bench::default() }
}

/// True value of a coefficient in the unit of the answer, by its name; `None` for psi and combinations.
pub(crate) fn truth(bench: &Bench, name: &str) -> Option<f64> {
    const ARCSEC: f64 = 648000.0 / std::f64::consts::PI;
    let (kind, axes) = name.rsplit_once('_').filter(|_| !name.contains(' '))?;
    let mut axes = axes.chars().map(|c| "XYZ".find(c));
    if let Some(term) = name.strip_prefix("D_") {
        let mut letters = term.chars();
        let (kind, axis) = ("FIOS".find(letters.next()?)?, "XYZ".find(letters.next()?)?);
        return letters.next().is_none().then_some(bench.drift[kind][axis]);
    }
    Some(match (kind, axes.next()??, axes.next().flatten(), axes.next()) {
        ("GS", i, None, None) => bench.torquer[i][i] * 1e6,
        ("GM", i, Some(axis), None) => bench.torquer[i][axis] * ARCSEC,
        ("M", i, Some(axis), None) => bench.mounting[i][axis] * ARCSEC,
        ("K0", i, None, None) => bench.accelerometers[0][i] * 1e6,
        ("K1", i, None, None) => bench.accelerometers[1][i] * 1e6,
        ("K2", i, None, None) => bench.accelerometers[2][i] * 1e6,
        _ => return None,
    })
}

/// Name, and error over sigma, of every coefficient.
pub(crate) fn errors(bench: &Bench, c: &Calibration) -> Vec<(String, f64)> {
    let known = c.quantities.iter().filter(|u| u.determined);
    let known = known.filter_map(|u| Some((u, truth(bench, &u.name)?)));
    known.map(|(u, t)| (u.name.clone(), (u.estimate.expect("there") - t) / u.sigma.expect("there"))).collect()
}

/// NEES of the coefficients, and their number.
fn normalised(bench: &Bench, c: &Calibration) -> (f64, usize) {
    let errors = errors(bench, c);
    let at: Vec<usize> =
        errors.iter().map(|(n, _)| c.covariance.names.iter().position(|m| m == n).expect("there")).collect();
    let p = DMatrix::from_fn(at.len(), at.len(), |i, j| c.covariance.covariance[at[i]][at[j]]);
    let e = errors.iter().zip(&at).map(|((_, e), &i)| e * c.covariance.covariance[i][i].sqrt());
    let e = DVector::from_iterator(at.len(), e);
    let solved = p.cholesky().expect("definite").solve(&e);
    (e.dot(&solved), at.len())
}

/// Checks common to all right records.
fn is_right(c: &Calibration) {
    // wide priors on undetermined unknowns cost sigmas some digits
    assert!(c.second_path.difference < 1e-9 && c.second_path.sigma_difference < 1e-8, "{:?}", c.second_path);
    assert!(c.consistent, "{:?}", c.findings);
}

/// Benches as real ones are: turns take time, outputs are quantised, samples are lost, gyros drift at random.
pub(crate) fn real(seed: u64) -> Bench {
    Bench {
        seed,
        slew_deg_s: Some(1.0),
        quantum_g: 1e-6,
        walk_deg_sqrt_h: 1e-4,
        dropped: 20,
        step_s: 5.0,
        ..six()
    }
}

/// The mean NEES of `records` records lies in its band of 99.9 %.
fn round_trips(records: u64, bench: impl Fn(u64) -> Bench, terms: &str) {
    let (mut sum, mut count, mut inconsistent) = (0.0, 0, 0);
    let mut clocks: Vec<f64> = Vec::new();
    for seed in 0..records {
        let bench = bench(seed);
        let c = of_csv(&bench, terms, csv(&bench.record())).expect("calibrated");
        assert!(
            c.second_path.difference < 1e-9 && c.second_path.sigma_difference < 1e-9,
            "{:?}",
            c.second_path
        );
        let (nees, n) = normalised(&bench, &c);
        (sum, count) = (sum + nees, n);
        inconsistent += u64::from(!c.consistent);
        clocks.extend(c.records[0].clock.by_earth.as_ref().map(|e| (e.fast / e.sigma).powi(2)));
    }
    let of_clock: f64 = clocks.iter().sum::<f64>() / clocks.len().max(1) as f64;
    let clock_band = chi_square_band(1.0, clocks.len() as f64, 0.999);
    println!("{terms}: {} clocks, mean square {of_clock:.3}, band {clock_band:.3?}", clocks.len());
    // the paper's two positions do not determine the clock
    assert!(
        clocks.is_empty() || (clock_band.0..=clock_band.1).contains(&of_clock),
        "{of_clock}: {clock_band:?}"
    );
    let (low, high) = chi_square_band(count as f64, records as f64, 0.999);
    let mean = sum / records as f64;
    println!(
        "{terms}: ANEES {mean:.2} of {count}, band {low:.2} to {high:.2}; {inconsistent} of {records} doubted"
    );
    assert!((low..=high).contains(&mean), "{mean} of {count}: {low} to {high}");
    // each of some twelve tests fails once in a thousand; that of correlations a little more often
    assert!(inconsistent <= 2 + records / 20, "{inconsistent} of {records}");
}

#[test]
fn estimates_are_what_their_sigmas_say() {
    round_trips(2, |seed| Bench { seed, ..six() }, "F,I,O,S");
    round_trips(2, real, "F,I,O,S");
}

#[test]
#[ignore = "full length: .ci/run release"]
fn estimates_are_what_their_sigmas_say_at_length() {
    round_trips(12, |seed| Bench { seed, ..six() }, "F,I,O,S");
    round_trips(12, real, "F,I,O,S");
}

/// Round trips with biases, scale factors and squares of the accelerometers.
#[test]
fn accelerometers_too() {
    let bench = |seed| Bench {
        accelerometers: [[3e-4, -2e-4, 1e-4], [5e-4, -3e-4, 2e-4], [2e-5, 1e-5, -3e-5]],
        positions: twelve(),
        ..real(seed)
    };
    round_trips(2, bench, "F,I,O,S,K0,K1,K2");
}

/// Seven quarter turns of examples/self-calibration, with errors of everything: 33 coefficients.
pub(crate) fn whole(seed: u64) -> Bench {
    let attitudes = [
        [0.0, 0.0, 90.0],
        [0.0, 0.0, 180.0],
        [0.0, 0.0, -90.0],
        [90.0, 0.0, -90.0],
        [0.0, -90.0, 0.0],
        [180.0, 0.0, 180.0],
        [-90.0, 0.0, 180.0],
    ];
    let names = ["p1", "p2", "p3", "p4", "p5", "p6", "p7"];
    Bench {
        positions: names.into_iter().zip(attitudes).map(|(n, a)| (n, a, 1000.0)).collect(),
        drift: [[1.3, -0.8, 2.1], [0.9, 1.6, -0.4], [-0.3, 0.6, 0.2], [0.7, -1.1, 0.5]],
        accelerometers: [[3e-4, -2e-4, 1e-4], [5e-4, -3e-4, 2e-4], [2e-5, 1e-5, -3e-5]],
        mounting: [[0.0; 3], [3e-4, 0.0, 0.0], [-2e-4, 5e-4, 0.0]],
        torquer: [[2e-4, 1e-4, -3e-4], [4e-4, -5e-4, 2e-4], [-1e-4, 3e-4, 1e-4]],
        step_s: 10.0,
        ..real(seed)
    }
}

/// Round trips with all errors at once: drifts, torquers, accelerometers and mounting.
#[test]
fn the_whole_platform() {
    round_trips(2, whole, "all");
}

/// 200 records of each kind: `cargo test -p obsdeg-calibration --release -- --ignored --nocapture many`.
#[test]
#[ignore = "minutes"]
fn many_records() {
    round_trips(200, |seed| Bench { seed, ..six() }, "F,I,O,S");
    round_trips(200, real, "F,I,O,S");
    let paper = |seed| Bench { seed, ..Bench::default() };
    round_trips(200, paper, "F,I,O,S");
    round_trips(200, whole, "all");
}

fn twelve() -> Vec<(&'static str, [f64; 3], f64)> {
    let more = [
        [0.0, 0.0, 0.0],
        [80.0, 10.0, -30.0],
        [160.0, -20.0, 60.0],
        [-110.0, 5.0, 140.0],
        [35.0, -75.0, -20.0],
        [-50.0, 60.0, 100.0],
    ];
    let names = ["q1", "q2", "q3", "q4", "q5", "q6"];
    let more = names.into_iter().zip(more).map(|(n, a)| (n, a, 1000.0));
    six().positions.into_iter().chain(more).collect()
}

/// Two positions determine D_FZ and psi_y only together: neither has an estimate, and their combination has
/// that of the bench.
#[test]
fn what_is_not_distinguished_has_no_estimate() {
    let bench = Bench { seed: 4, drift: [[1.1, 1.2, 1.3], [0.5; 3], [0.5; 3], [0.5; 3]], ..Bench::default() };
    let c = of_csv(&bench, "F,I,O,S", csv(&bench.record())).expect("calibrated");
    is_right(&c);
    for name in ["psi_y", "D_SZ", "D_IX", "D_OZ"] {
        let u = c.quantities.iter().find(|u| u.name == name).expect("an unknown");
        assert_eq!((u.determined, u.estimate, u.sigma), (false, None, None), "{name}");
        assert!(!c.covariance.names.contains(&u.name));
    }
    let of = |name: &str| c.combinations.iter().find(|u| u.name.contains(name)).expect("a combination");
    let both = of("psi_y");
    let (estimate, sigma) = (both.estimate.expect("there"), both.sigma.expect("there"));
    // under inertial carry: D_SZ + a*psi_y
    assert!(both.name.contains("D_SZ"), "{}", both.name);
    // D_SZ 0.5 and wN psi_y 0.023 deg/h: the fit bounds an undetermined direction by ten times its prior,
    // which affects the combination at second order
    assert!((estimate - 0.523).abs() < 3.0 * sigma && sigma < 0.5, "{both:?}");
    // with other priors the combination changes by that effect only, within sigma
    let mut other = conditions(&bench);
    other.priors.iter_mut().for_each(|p| p.value *= 0.5);
    let record =
        Record::csv("run.csv", Box::new(std::io::Cursor::new(csv(&bench.record())))).expect("a record");
    let again = calibrate(&scheme(&bench, "F,I,O,S"), &other, vec![record], &Options::default(), &|_| true)
        .expect("calibrated");
    for (a, b) in
        c.quantities.iter().chain(&c.combinations).zip(again.quantities.iter().chain(&again.combinations))
    {
        if let (Some(x), Some(y), Some(s)) = (a.estimate, b.estimate, a.sigma) {
            assert!((x - y).abs() < s, "{}: {x} {y} +- {s}", a.name);
        }
    }
}

/// Faults of a record, or of the assumptions on it, are found and named.
#[test]
fn faults_are_named() {
    let bench = Bench { seed: 9, ..real(9) };
    let samples = bench.record();
    let right = of_csv(&bench, "F,I,O,S", csv(&samples)).expect("calibrated");
    is_right(&right);

    // spikes, in samples of which two make a measurement
    let mut spiked = samples.clone();
    for (k, by) in [(100, 3e-4), (700, -2e-3)] {
        spiked[k].f[0] += by;
    }
    let c = of_csv(&bench, "F,I,O,S", csv(&spiked)).expect("calibrated");
    assert!(c.consistent, "{:?}", c.findings);
    for k in [100, 700] {
        let line = k as u64 + 2;
        assert!(
            c.outliers.iter().any(|o| (o.lines.from..=o.lines.to).contains(&line)),
            "{line}: {:?}",
            c.outliers
        );
    }
    assert!(c.outliers.iter().all(|o| [102, 702].iter().any(|l| (o.lines.from..=o.lines.to).contains(l))));
    for (a, b) in right.quantities.iter().zip(&c.quantities) {
        assert!(
            (a.estimate.expect("there") - b.estimate.expect("there")).abs() < a.sigma.expect("there"),
            "{}",
            a.name
        );
    }

    // two positions exchanged: with different gravity they contradict the scheme
    let mut other = bench.clone();
    (other.positions[1].1, other.positions[3].1) = (bench.positions[3].1, bench.positions[1].1);
    let e = of_csv(&other, "F,I,O,S", csv(&samples)).expect_err("another scheme").to_string();
    assert!(
        e.starts_with("run.csv: line ")
            && e.contains("at p2 the specific force is")
            && e.ends_with("it is that of p4"),
        "{e}"
    );

    // a position with another azimuth than the scheme's, which gravity does not show
    let mut other = bench.clone();
    other.positions[3].1 = [0.0, 0.0, 0.0];
    let mut turned = bench.clone();
    turned.positions[3].1 = [0.0, 3.0, 0.0];
    let c = of_csv(&other, "F,I,O,S", csv(&turned.record())).expect("calibrated");
    assert!(!c.consistent);

    // scale error
    let c = of_csv(&bench, "F,I,O,S", csv(&Bench { scale: 1.001, ..bench.clone() }.record()))
        .expect("calibrated");
    let Some(CalibrationFinding::Force { length_g, .. }) = c.findings.first() else {
        panic!("{:?}", c.findings)
    };
    assert!((length_g - 1.001).abs() < 1e-4, "{length_g}");

    // noise three times as large as stated, everywhere
    let c = of_csv(
        &Bench { noise_g: 1e-5, ..bench.clone() },
        "F,I,O,S",
        csv(&Bench { noise_g: 3e-5, ..bench.clone() }.record()),
    );
    let c = c.expect("calibrated");
    let [CalibrationFinding::Noise { factor, .. }] = c.findings[..] else { panic!("{:?}", c.findings) };
    assert!((factor / 3.0 - 1.0).abs() < 0.1, "{factor}");
    let u = &c.quantities[3];
    assert!((u.sigma_rescaled.expect("there") / u.sigma.expect("there") - factor).abs() < 1e-9);

    // a missing position
    let fewer: Vec<_> = samples.iter().filter(|s| s.label != "p3").cloned().collect();
    let e = of_csv(&bench, "F,I,O,S", csv(&fewer)).expect_err("no p3").to_string();
    assert!(e.contains("found `p4`, expected p3"), "{e}");
    let fewer: Vec<_> = samples.iter().filter(|s| s.label != "p6").cloned().collect();
    let e = of_csv(&bench, "F,I,O,S", csv(&fewer)).expect_err("no p6").to_string();
    assert_eq!(
        e,
        "run.csv: the position p6 of the scheme has no samples: its label does not occur (where the run ended before \
         it, delete its [[position]] in the scheme)"
    );
    let e = of_csv(&bench, "F,I,O,S", csv(&samples).replace(",p5,", ",P5,")).expect_err("no P5").to_string();
    assert!(
        e.contains("column `position`: no position is called `P5`; expected p1, p2, p3, p4, p5, p6"),
        "{e}"
    );
}

/// Short positions and small drifts, so that a window distinguishes rest from turns.
fn quick(seed: u64) -> Bench {
    let mut positions = six().positions;
    positions.iter_mut().for_each(|p| p.2 = 300.0);
    Bench {
        positions,
        drift: [[1.1, 1.2, 1.3], [0.5; 3], [0.5; 3], [0.5; 3]],
        step_s: 1.0,
        dropped: 0,
        ..real(seed)
    }
}

pub(crate) fn with_recording(
    bench: &Bench,
    recording: Recording,
    text: String,
) -> Result<Calibration, CalibrationError> {
    let mut scheme = scheme(bench, "F,I,O,S");
    scheme.recording = recording;
    let record = Record::csv("run.csv", Box::new(std::io::Cursor::new(text)))?;
    calibrate(&scheme, &conditions(bench), vec![record], &Options::default(), &|_| true)
}

/// Record without labels that begins late, by its intervals at rest: the estimate equals that by the timeline
/// within its sigmas, which contain what the windows leave open; other schemes are refused.
#[test]
fn positions_are_found() {
    let bench = quick(11);
    let samples = bench.record();
    let labelled = of_csv(&bench, "F,I,O,S", csv(&samples)).expect("calibrated");
    is_right(&labelled);
    let shifted: Vec<Sample> = samples.iter().map(|s| Sample { t: s.t + 4321.0, ..s.clone() }).collect();
    let bare = csv(&shifted).replace("position", "note");
    let still = Still { by: vec![], initial: 60.0, window: 10.0, factor: 50.0, shortest: 60.0 };
    let recording = Recording { still: Some(still.clone()), ..Recording::default() };
    let c = with_recording(&bench, recording.clone(), bare.clone()).expect("calibrated");
    is_right(&c);
    assert_eq!(
        (c.records[0].positions_by, &c.records[0].ignored),
        (PositionsBy::Static, &vec!["note".to_string()])
    );
    let open = c.records[0].change_open_s.expect("windows leave the changes open");
    assert!(open > 1.0 && open < 15.0 && labelled.records[0].change_open_s.is_none(), "{open}");
    for (a, b) in labelled.quantities.iter().zip(&c.quantities) {
        let (x, y, s) = (a.estimate.expect("there"), b.estimate.expect("there"), a.sigma.expect("there"));
        let own = b.sigma.expect("there");
        assert!((x - y).abs() < 2.5 * own && own > 0.95 * s, "{}: {x} +- {s}, {y} +- {own}", a.name);
    }
    let mut other = bench.clone();
    (other.positions[1].1, other.positions[3].1) = (bench.positions[3].1, bench.positions[1].1);
    let e = with_recording(&other, recording.clone(), bare.clone()).expect_err("other attitudes").to_string();
    assert!(e.contains("at p2 the specific force is") && e.ends_with("it is that of p4"), "{e}");
    other.positions.pop();
    let e = with_recording(&other, recording, bare.clone()).expect_err("five positions").to_string();
    assert!(
        e.starts_with("run.csv: 6 intervals at rest; expected 5, one for each position of the scheme: 43"),
        "{e}"
    );
    let long = Recording { still: Some(Still { shortest: 400.0, ..still }), ..Recording::default() };
    let e = with_recording(&bench, long, bare).expect_err("none so long").to_string();
    assert!(
        e.starts_with("run.csv: 0 intervals at rest; expected 6, one for each position of the scheme ("),
        "{e}"
    );
}

/// Names and counts of the file, gimbals, temperature: a correlation with the temperature is named.
#[test]
fn columns_of_all_kinds() {
    let bench = quick(12);
    let samples = bench.record();
    let right = of_csv(&bench, "F,I,O,S", csv(&samples)).expect("calibrated");
    let map = |list: &[(&str, &str)]| list.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
    let recording = Recording {
        columns: map(&[("t", "Time"), ("fx", "X"), ("fy", "Y"), ("fz", "Z")]),
        units: map(&[("fx", "1e-6 g"), ("fy", "-1e-3 mg"), ("fz", "1 ug")]),
        ..Recording::default()
    };
    let angles = |label: &str| bench.positions.iter().find(|p| p.0 == label).map_or([0.0; 3], |p| p.1);
    // temperature that rises and falls, and Z with it by up to four times the noise of a measurement
    let text = |by: f64, turned: f64| {
        let head = "Time [ms],position,X,Y,Z,alpha [deg],beta [deg],gamma [deg],T [degC]\n".to_string();
        let line = |s: &Sample| {
            let warm = (s.t / 37.0).sin();
            let f = s.f.map(|x| (x + by * warm) * 1e6);
            let [a, b, c] = angles(s.label);
            format!(
                "{},{},{},{},{},{a},{b},{},{}\n",
                s.t * 1e3,
                s.label,
                f[0],
                -f[1],
                f[2],
                c + turned,
                20.0 + warm
            )
        };
        std::iter::once(head).chain(samples.iter().map(line)).collect::<String>()
    };
    let c = with_recording(&bench, recording.clone(), text(0.0, 360.5)).expect("calibrated");
    is_right(&c);
    for (a, b) in right.quantities.iter().zip(&c.quantities) {
        let (x, y, s) = (a.estimate.expect("there"), b.estimate.expect("there"), a.sigma.expect("there"));
        assert!((x - y).abs() < 1e-3 * s, "{}: {x} {y} +- {s}", a.name);
    }
    assert!((c.records[0].gimbals_deg.expect("there") - 0.5).abs() < 1e-6);
    assert!(
        c.channels.iter().all(|c| c.temperature.is_some_and(|w| w.probability > 1e-3)),
        "{:?}",
        c.channels
    );
    let e = with_recording(&bench, recording.clone(), text(0.0, 7.0)).expect_err("turned").to_string();
    assert!(e.contains("at p1 the gimbals are 7.0 deg from where the scheme has them"), "{e}");
    let c = with_recording(&bench, recording, text(1.5e-5, 0.0)).expect("calibrated");
    let warm = |f: &CalibrationFinding| matches!(f, CalibrationFinding::Temperature { correlation, .. } if correlation.abs() > 0.5);
    assert!(c.findings.iter().any(warm), "{:?}", c.findings);
}

/// Unknown noise is estimated, component by component; the fit is then consistent, with the sigmas of a known
/// noise.
#[test]
fn noise_is_estimated() {
    let bench = Bench { noise_g: 3e-5, ..real(14) };
    let text = csv(&bench.record());
    let knows = of_csv(&bench, "F,I,O,S", text.clone()).expect("calibrated");
    let run = |estimate_noise: bool| {
        let record = Record::csv("run.csv", Box::new(std::io::Cursor::new(text.clone()))).expect("a record");
        let believed = Bench { noise_g: 1e-5, ..bench.clone() };
        let options = Options { estimate_noise, ..Options::default() };
        calibrate(&scheme(&bench, "F,I,O,S"), &conditions(&believed), vec![record], &options, &|_| true)
            .expect("calibrated")
    };
    assert!(matches!(run(false).findings[..], [CalibrationFinding::Noise { .. }]));
    let c = run(true);
    is_right(&c);
    assert!(c.assumed.noise_estimated && (c.fit.factor - 1.0).abs() < 1e-2, "{:?}", c.fit);
    for channel in &c.channels {
        // 1200 samples, two per measurement: a standard deviation is known to 3 %
        assert!((channel.sigma / 3e-5 - 1.0).abs() < 0.12, "{channel:?}");
    }
    for (a, b) in knows.quantities.iter().zip(&c.quantities) {
        let (x, y, s) = (a.estimate.expect("there"), b.estimate.expect("there"), a.sigma.expect("there"));
        assert!((x - y).abs() < 0.3 * s && (b.sigma.expect("there") / s - 1.0).abs() < 0.12, "{}", a.name);
    }
}

/// Two positions at the drifts of the paper, where psi grows to degrees: undetermined unknowns are in a box
/// about the first estimate, 0 or twice the truth. Both estimates of the determined unknowns are right. To
/// first order they differ by at most the part of sigma that comes from the box, times the distance of the
/// two boxes in widths of the box (Cauchy-Schwarz). A quarter of sigma is allowed for the second order.
#[test]
fn what_is_held_bends_little() {
    const OPEN: [&str; 7] = ["D_IX", "D_IZ", "D_OX", "D_OY", "D_OZ", "D_SY", "D_SZ"];
    let bench = Bench { seed: 21, ..Bench::default() };
    let text = csv(&bench.record());
    let at = |value: f64| {
        let mut own = conditions(&bench);
        own.estimates = OPEN.map(|name| Assignment { name: name.into(), value }).to_vec();
        let record = Record::csv("run.csv", Box::new(std::io::Cursor::new(text.clone()))).expect("a record");
        let scheme = scheme(&bench, "F,I,O,S");
        calibrate(&scheme, &own, vec![record], &Options::default(), &|_| true).expect("calibrated")
    };
    let [a, b] = [0.0, 10.0].map(at);
    for c in [&a, &b] {
        assert!(c.consistent, "{:?}", c.findings);
        assert!(errors(&bench, c).iter().all(|(_, e)| e.abs() < 3.5), "{:?}", errors(&bench, c));
    }
    let moved = a.assumed.constrained.iter().filter(|h| OPEN.contains(&h.name.as_str()));
    let distance = moved.map(|h| (10.0 / h.sigma).powi(2)).sum::<f64>().sqrt();
    let mut compared = 0;
    for (u, v) in a.quantities.iter().chain(&a.combinations).zip(b.quantities.iter().chain(&b.combinations)) {
        assert_eq!((&u.name, u.determined), (&v.name, v.determined));
        if let (Some(x), Some(y), Some(s)) = (u.estimate, v.estimate, u.sigma) {
            let open = u.open_sigma.expect("there").max(v.open_sigma.expect("there"));
            assert!((x - y).abs() < distance * open + 0.25 * s, "{}: {x} {y} +- {s}, {open}", u.name);
            compared += 1;
        }
    }
    assert_eq!(compared, 8);
}

/// Two runs of one platform agree; a coefficient that changed between them gives a finding.
#[test]
fn runs_are_held_against_each_other() {
    let first = quick(15);
    let both = |second: &Bench| {
        let read = |b: &Bench| {
            Record::csv("run.csv", Box::new(std::io::Cursor::new(csv(&b.record())))).expect("a record")
        };
        let records = vec![read(&first), read(second)];
        calibrate(&scheme(&first, "F,I,O,S"), &conditions(&first), records, &Options::default(), &|_| true)
            .expect("calibrated")
    };
    let same = both(&quick(16));
    is_right(&same);
    assert!(
        same.repeatability.as_ref().is_some_and(|r| r.degrees_of_freedom == 12.0),
        "{:?}",
        same.repeatability
    );
    assert!(errors(&first, &same).iter().all(|(_, e)| e.abs() < 3.5), "{:?}", errors(&first, &same));
    let mut other = quick(16);
    other.drift[0][0] += 0.2;
    let changed = both(&other);
    assert!(
        changed.findings.iter().any(|f| matches!(f, CalibrationFinding::Repeatability { .. })),
        "{:?}",
        changed.findings
    );
}

/// An interrupt while a record is read leaves no answer; later the answer is the current iterate, and says
/// so.
#[test]
fn an_interrupt_leaves_what_there_is() {
    let bench = Bench { step_s: 0.2, ..quick(13) };
    let text = csv(&bench.record());
    let until = |most: usize, reads: bool| {
        let record = Record::csv("run.csv", Box::new(std::io::Cursor::new(text.clone()))).expect("a record");
        let heard = std::cell::Cell::new(0);
        let progress = |now: CalibrationProgress<'_>| {
            let counts = matches!(now, CalibrationProgress::Reads { .. }) == reads;
            heard.set(heard.get() + usize::from(counts));
            !counts || heard.get() < most
        };
        calibrate(
            &scheme(&bench, "F,I,O,S"),
            &conditions(&bench),
            vec![record],
            &Options::default(),
            &progress,
        )
    };
    assert_eq!(until(1, true), Err(CalibrationError::Interrupted));
    let whole = until(usize::MAX, false).expect("calibrated");
    is_right(&whole);
    let c = until(2, false).expect("calibrated");
    assert_eq!((c.consistent, c.findings.first()), (false, Some(&CalibrationFinding::Interrupted)));
    // two linearisations are near
    for (a, b) in whole.quantities.iter().zip(&c.quantities) {
        let (x, y, s) = (a.estimate.expect("there"), b.estimate.expect("there"), a.sigma.expect("there"));
        assert!((x - y).abs() < 100.0 * s, "{}: {x} {y} +- {s}", a.name);
    }
    // residuals over time are white noise
    for s in &whole.series {
        assert!(s.points.len() <= 1000 && s.count == s.points.len() && s.autocorrelation.len() == 20);
        let band = 4.0 / (s.count as f64).sqrt();
        assert!(s.autocorrelation.iter().all(|r| r.abs() < band), "{:?}", s.autocorrelation);
        for (k, point) in s.allan.iter().enumerate() {
            let ResidualDeviation { tau_s: tau, deviation: found, white } = point;
            assert!((tau / 10.0 - f64::from(1 << k)).abs() < 0.1, "{tau}");
            // for n/m clusters
            let scatter = 4.0 * (tau / 10.0 / s.count as f64).sqrt();
            assert!((found / white - 1.0).abs() < scatter + 0.1, "{tau}: {found} {white}");
        }
    }
}

/// Record of examples/bench-day.
fn bench_day() -> Bench {
    let mut positions = six().positions;
    positions.iter_mut().for_each(|p| p.2 = 600.0);
    Bench {
        latitude_deg: 48.2,
        slew_deg_s: Some(2.0),
        psi: [0.04, -0.07, 0.05].map(f64::to_radians),
        drift: [[1.3, -0.8, 2.1], [0.9, 1.6, -0.4], [-0.3, 0.6, 0.2], [0.7, -1.1, 0.5]],
        quantum_g: 1e-7,
        walk_deg_sqrt_h: 1e-4,
        step_s: 4.0,
        dropped: 50,
        positions,
        seed: 18,
        ..Bench::default()
    }
}

/// The example's record is what the simulator writes, and the estimate is that of the bench.
#[test]
fn the_record_of_the_example() {
    let bench = bench_day();
    let text = csv(&bench.record());
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/bench-day/record.csv");
    if std::env::var_os("WRITE_RECORD").is_some() {
        std::fs::write(path, &text).expect("written");
    }
    assert_eq!(std::fs::read_to_string(path).expect("the record"), text);
    let c = of_csv(&bench, "F,I,O,S", text).expect("calibrated");
    is_right(&c);
    assert!(errors(&bench, &c).iter().all(|(_, e)| e.abs() < 3.5), "{:?}", errors(&bench, &c));
}

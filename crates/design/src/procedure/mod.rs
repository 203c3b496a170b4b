//! Sheet of a run: what the crew on the bench does, when, what the accelerometers should read, and what is
//! known after each position.
//!
//! ```
//! use obsdeg_core::model::{Angle, Carry, Scheme};
//! use obsdeg_design::procedure::{ProcedureOptions, StepKind, procedure};
//! use obsdeg_evidence::simulation::Conditions;
//!
//! let positions = [[0, 0, 0], [180, 0, 0]].map(|p| p.map(Angle::from_degrees));
//! let scheme = Scheme { carry: Carry::Inertial, ..Scheme::of_angles(positions) };
//! let conditions = Conditions { slew_rate_deg_s: Some(2.0), ..Conditions::default() };
//! let sheet = procedure(&scheme, &conditions, &ProcedureOptions::default())?;
//! let kinds: Vec<StepKind> = sheet.steps.iter().map(|s| s.kind).collect();
//! assert_eq!(kinds, [StepKind::Set, StepKind::Record, StepKind::Turn, StepKind::Record]);
//! assert_eq!((sheet.steps[2].duration_s, sheet.total_s), (90.0, 2090.0));
//! // half a turn about North: the accelerometer of Y_p reads +1 g, then -1 g
//! assert_eq!(sheet.steps[3].force_g.map(|f| f.map(f64::round)), Some([0.0, -1.0, 0.0]));
//! # Ok::<(), obsdeg_design::procedure::ProcedureError>(())
//! ```

mod answer;
mod options;
mod progress;
mod readings;
mod rotations;
mod steps;

use obsdeg_core::model::Scheme;
use obsdeg_evidence::acceptance::{MeasuredCoefficient, acceptance};
use obsdeg_evidence::simulation::{Conditions, MeasurementReport, Plan};

pub use answer::*;
pub use options::{ProcedureError, ProcedureOptions, TILT_DEG};
pub use rotations::{RotationTableError, rotation_table, scheme_of_rotations, start_of_table};

use self::options::check;
use self::progress::progress;
use crate::design::under;

/// Sheet of `scheme` under `conditions`.
///
/// # Errors
/// [`ProcedureError`].
pub fn procedure(
    scheme: &Scheme,
    conditions: &Conditions,
    options: &ProcedureOptions,
) -> Result<Procedure, ProcedureError> {
    check(options)?;
    let stated = conditions.as_stated();
    let plan = Plan::new(scheme, &stated)?;
    let steps::Sheet { mut steps, obstacles, total_s } = steps::sheet(scheme, &stated, &plan);
    let tolerance = readings::add(&mut steps, &plan, conditions, options)?;
    let progress = progress(scheme, conditions, options.seed)?;
    let timed_turns = steps.iter().all(|s| s.turn.as_ref().is_none_or(|t| t.rate_deg_s.is_some()));
    let measured = progress.coefficients.iter().map(|c| MeasuredCoefficient {
        name: &c.name,
        unit: &c.unit,
        estimate: None,
        uncertainty: c.uncertainty,
        by_prior: c.by_prior,
    });
    let acceptance = acceptance(&scheme.acceptance, measured, None);
    Ok(Procedure {
        schema: PROCEDURE_SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        name: scheme.name.clone(),
        document: scheme.document.clone(),
        carry: scheme.carry,
        executable: obstacles.is_empty(),
        obstacles,
        rotations: if timed_turns { rotations::rows(&steps) } else { Vec::new() },
        start_attitude_deg: rotations::start(&plan),
        free_gimbals: scheme.gimbals.limits.map(|l| l.is_none()),
        row_s: conditions.step_s,
        earth_rate_dph: [plan.point.w_n, plan.point.w_u].map(|w| w.to_degrees() * 3600.0),
        steps,
        total_s,
        timed_turns,
        settle_s: conditions.settle_s,
        tolerance,
        after: progress.after,
        coefficients: progress.coefficients,
        requirements: progress.requirements,
        acceptance,
        conditions: MeasurementReport::new(scheme, conditions),
        seed: options.seed,
    })
}

/// Scheme of a sheet, with all conditions that its figures rest on.
pub fn scheme_of_procedure(scheme: &Scheme, conditions: &Conditions) -> Scheme {
    let all = under(scheme, conditions, scheme.positions.clone(), Some(conditions.dwell_s));
    let (name, description) = (scheme.name.clone(), scheme.description.clone());
    Scheme { name, description, combinations: scheme.combinations.clone(), ..all }
}

#[cfg(test)]
mod tests {
    use super::*;
    use obsdeg_core::model::scheme_file;
    use obsdeg_evidence::simulation::Attained;

    const HEAD: &str = "carry = 'inertial'\nlatitude_deg = 40\n";
    const RUN: &str = "[simulation]\nslew_rate_deg_s = 2\ndwell_s = 300\nstep_s = 7\n\
                       [requirements]\nD_F = 0.01\nD_S = 0.05\n";

    fn scheme(head: &str, attitudes: &[&str]) -> Scheme {
        let positions: String = attitudes.iter().map(|a| format!("[[position]]\n{a}\n")).collect();
        scheme_file::read(&format!("{head}{RUN}{positions}")).expect("a scheme")
    }

    fn made(scheme: &Scheme, options: &ProcedureOptions) -> Result<Procedure, ProcedureError> {
        procedure(scheme, &Conditions::of(scheme), options)
    }

    const FOUR: [&str; 4] = ["attitude = 'NUE'", "attitude = 'USE'", "attitude = 'EDN'", "attitude = 'WND'"];

    /// Every prefix of the scheme has the uncertainties that its own prediction has.
    #[test]
    fn what_is_known_after_a_position_is_the_prediction_of_its_prefix() {
        let scheme = scheme(HEAD, &FOUR);
        let found = made(&scheme, &ProcedureOptions::default()).expect("a sheet");
        for (k, after) in found.after.iter().enumerate() {
            let prefix = Scheme { positions: scheme.positions[..=k].to_vec(), ..scheme.clone() };
            let own = Attained::new(&prefix, &Conditions::of(&prefix), 1).expect("a prediction");
            assert_eq!(own.totals[3..], after.uncertainty[..], "{}", after.position);
            assert_eq!(own.plan.duration_s(), after.end_s);
        }
        let names: Vec<&String> = found.after.iter().flat_map(|a| &a.meets).collect();
        assert_eq!(names.len(), found.requirements.met, "{:?}", found.after);
        for c in &found.coefficients {
            let met = c.uncertainty.zip(c.required).is_some_and(|(s, r)| s <= r);
            assert_eq!(met, c.met_from.is_some(), "{c:?}");
        }
    }

    /// A wait takes samples away, not time: uncertainties grow, and by no more than as if the dwells were
    /// shorter; they do not depend on whether the wait is a whole number of steps.
    #[test]
    fn a_wait_costs_samples() {
        let scheme = scheme(HEAD, &FOUR);
        let at = |settle_s: f64| {
            let conditions = Conditions { settle_s, ..Conditions::of(&scheme) };
            procedure(&scheme, &conditions, &ProcedureOptions::default())
        };
        let refused = at(300.0).expect_err("no time").to_string();
        assert!(refused.contains("leaves no sample of the dwell of `p1` (300 s)"), "{refused}");
        assert!(at(-1.0).is_err() && at(f64::NAN).is_err());
        let at = |settle_s: f64| at(settle_s).expect("a sheet");
        let sigma = |p: &Procedure| p.coefficients.iter().map(|c| c.uncertainty).collect::<Vec<_>>();
        let (none, some, more) = (at(0.0), at(50.0), at(150.0));
        assert_eq!((none.total_s, some.total_s), (some.total_s, more.total_s));
        for ((a, b), c) in sigma(&none).iter().zip(sigma(&some)).zip(sigma(&more)) {
            let (Some(a), Some(b), Some(c)) = (a, b, c) else { continue };
            assert!(*a < b && b < c && c < 30.0 * a, "{a} {b} {c}");
        }
        let steps: Vec<(StepKind, f64)> = some.steps.iter().map(|s| (s.kind, s.duration_s)).collect();
        assert_eq!(steps[1..3], [(StepKind::Wait, 50.0), (StepKind::Record, 250.0)]);
    }

    /// Gimbal by gimbal every turn is one of a gimbal, and limits that are exceeded are named.
    #[test]
    fn gimbal_by_gimbal() {
        let positions = ["angles_deg = [0, 0, 0]", "angles_deg = [30, -40, 50]"];
        let found =
            made(&scheme(&format!("{HEAD}path = 'gimbals'\n"), &positions), &ProcedureOptions::default());
        let found = found.expect("a sheet");
        let turns: Vec<(&str, f64, [f64; 3])> = found
            .steps
            .iter()
            .filter_map(|s| {
                Some((s.turn.as_ref()?.gimbal.as_deref()?, s.turn.as_ref()?.angle_deg, s.gimbals_deg))
            })
            .collect();
        let expected = [
            ("alpha", 30.0, [30.0, 0.0, 0.0]),
            ("beta", 40.0, [30.0, -40.0, 0.0]),
            ("gamma", 50.0, [30.0, -40.0, 50.0]),
        ];
        assert_eq!(turns, expected);
        assert!((found.total_s - 660.0).abs() < 1e-9 && found.executable);
        // a passive angle of +30 deg about North is a turn of -30 deg
        assert_eq!(found.steps[2].turn.as_ref().map(|t| t.about), Some([-1.0, 0.0, 0.0]));
        let limited = format!("{HEAD}gimbals.alpha_deg = [-90, 90]\n");
        let stopped =
            made(&scheme(&limited, &["attitude = 'NUE'", "attitude = 'NDW'"]), &ProcedureOptions::default());
        let stopped = stopped.expect("a sheet");
        assert!(!stopped.executable && stopped.obstacles[0].position == "p2", "{:?}", stopped.obstacles);
        assert_eq!(stopped.obstacles[0].gimbal.as_deref(), Some("alpha"));
    }

    /// Readings stay inside their tolerance for a platform that drifts as stated: 10 deg/h for 600 s and more
    /// is more than the tilt that is always allowed.
    #[test]
    fn tolerances_follow_the_stated_drifts() {
        let two = ["attitude = 'NUE'", "attitude = 'NDW'"];
        let plain = made(&scheme(HEAD, &two), &ProcedureOptions::default()).expect("a sheet");
        let drifting = scheme(HEAD, &two);
        let values = [("D_F".into(), 10.0)].into();
        let simulation = obsdeg_core::model::settings::Settings { values, ..drifting.simulation.clone() };
        let drifting = Scheme { simulation, ..drifting };
        let found = made(&drifting, &ProcedureOptions::default()).expect("a sheet");
        let last = |p: &Procedure| p.steps.last().and_then(|s| s.tolerance_g).expect("a tolerance");
        assert!((last(&plain) - 2.0 * 0.5f64.to_radians().sin() - 5e-5).abs() < 1e-9, "{}", last(&plain));
        // 10 deg/h about three axes for 690 s: 3.3 deg
        let drift = 10f64.to_radians() / 3600.0 * 690.0 * 3f64.sqrt();
        assert!((last(&found) - last(&plain)) / drift < 1.05 && last(&found) - last(&plain) > 0.5 * drift);
        assert!(found.tolerance.by_values && !plain.tolerance.by_values);
    }

    #[test]
    fn a_scheme_without_a_rate_has_no_times_of_turns() {
        let scheme = Scheme { carry: obsdeg_core::model::Carry::Reset, ..scheme("", &["attitude = 'NUE'"]) };
        let simulation = obsdeg_core::model::settings::Settings::default();
        let scheme = Scheme { simulation, ..scheme };
        let found = made(&scheme, &ProcedureOptions::default()).expect("a sheet");
        assert_eq!((found.steps.len(), found.rotations.len(), found.timed_turns), (2, 0, true));
        let two = Scheme::of_angles(
            [[0, 0, 0], [90, 0, 0]].map(|p| p.map(obsdeg_core::model::Angle::from_degrees)),
        );
        let found = made(&two, &ProcedureOptions::default()).expect("a sheet");
        assert_eq!((found.timed_turns, found.rotations.len(), found.total_s), (false, 0, 2000.0));
    }
}

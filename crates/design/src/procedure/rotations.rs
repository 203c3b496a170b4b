//! Rotation tables of the PSINS kind: rows `[k, Ux, Uy, Uz, angle, T, T0, T1]`, a rotation about an axis of
//! the body within T seconds, at rest for T0 seconds before and T1 seconds after it (function `attrottt` of
//! PSINS, G. Yan). The body has the axes right, front and up, here Z_p, X_p and Y_p; at zero attitude they
//! point East, North and Up.

use obsdeg_core::model::slew::{rotation, times};
use obsdeg_core::model::{
    Angle, Axis, Carry, Dwell, Euler, Matrix3, Position, Scheme, SlewAxis, SlewTo, c_n_f64, euler_of,
};
use obsdeg_evidence::simulation::Plan;

use super::answer::{RotationRow, Step, StepKind};

/// Platform axis (X_p, Y_p, Z_p) of each axis of the body (right, front, up); likewise the axis of n (North,
/// Up, East) of each axis of East, North, Up.
const BODY: [usize; 3] = [2, 0, 1];

/// Rows of the steps: every turn and rotation, with the rest before and after it.
pub(super) fn rows(steps: &[Step]) -> Vec<RotationRow> {
    let (mut out, mut rest): (Vec<RotationRow>, f64) = (Vec::new(), 0.0);
    for step in steps {
        match (&step.turn, step.kind) {
            (Some(turn), StepKind::Turn | StepKind::Rotate) => {
                if let Some(before) = out.last_mut() {
                    before.after_s = rest;
                }
                let before_s = if out.is_empty() { rest } else { 0.0 };
                out.push(RotationRow {
                    number: out.len() + 1,
                    axis: BODY.map(|k| turn.about_platform[k]),
                    angle_deg: turn.angle_deg,
                    rotate_s: step.duration_s,
                    before_s,
                    after_s: 0.0,
                });
                rest = 0.0;
            }
            _ => rest += step.duration_s,
        }
    }
    if let Some(last) = out.last_mut() {
        last.after_s = rest;
    }
    out
}

/// Pitch, roll and yaw of the first position in degrees, as PSINS defines them: `C_b^n = Cz(yaw) Cx(pitch)
/// Cy(roll)` from the body (right, front, up) to East, North, Up.
pub(super) fn start(plan: &Plan) -> [f64; 3] {
    let c = &plan.attitudes[0];
    let b = |i: usize, j: usize| c[BODY[i]][BODY[j]];
    let pitch = b(2, 1).clamp(-1.0, 1.0).asin();
    let (roll, yaw) = if b(2, 1).abs() > 1.0 - 1e-12 {
        (b(0, 2).atan2(b(0, 0)), 0.0)
    } else {
        ((-b(2, 0)).atan2(b(2, 2)), (-b(0, 1)).atan2(b(1, 1)))
    };
    [pitch, roll, yaw].map(|x| (x.to_degrees() * 1e9).round() / 1e9 + 0.0)
}

/// Text of a rotation table, with a comment on its axes and its attitude at the start; `start` are the Euler
/// angles of the first position.
pub fn rotation_table(rows: &[RotationRow], start_attitude_deg: [f64; 3], start: &str) -> String {
    let [pitch, roll, yaw] = start_attitude_deg;
    let mut out = format!(
        "% rotations of the body: axes right, front, up are Z_p, X_p, Y_p\n\
         % attitude at the start: pitch {pitch}, roll {roll}, yaw {yaw} deg\n\
         {START}{start}\n\
         % k, Ux, Uy, Uz, angle [deg], T [s], T0 [s], T1 [s]\n"
    );
    for r in rows {
        let [x, y, z] = r.axis;
        let line =
            [x, y, z, r.angle_deg, r.rotate_s, r.before_s, r.after_s].map(|v| v.to_string()).join(", ");
        out += &format!("{}, {line}\n", r.number);
    }
    out
}

/// Defect of a rotation table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RotationTableError {
    /// A row that is not a list of 6 to 8 numbers.
    #[error(
        "line {line}: `{found}`; expected k, Ux, Uy, Uz, angle in degrees, T, T0, T1 in s (T0 and T1 may \
             be left out)"
    )]
    Row {
        /// Number of the line, from 1.
        line: usize,
        /// Text that was found.
        found: String,
    },
    /// A number that no row has.
    #[error("line {line}: {what} {found}; expected {expected}")]
    Number {
        /// Number of the line, from 1.
        line: usize,
        /// Name of the number.
        what: &'static str,
        /// Number that was found.
        found: f64,
        /// Admitted numbers.
        expected: &'static str,
    },
    /// A position without rest.
    #[error(
        "line {line}: no rest before this rotation; expected T0 here or T1 of the row before, at least 1e-3 s: a \
         position is recorded at rest, and reached by one turn (not gimbal by gimbal)"
    )]
    NoRest {
        /// Number of the line, from 1.
        line: usize,
    },
    /// Angles that are all as small as those in rad.
    #[error("line {line}: the largest angle is {largest}, as in radians; expected degrees")]
    Radians {
        /// Number of the line of the first row.
        line: usize,
        /// Largest angle that was found.
        largest: f64,
    },
    /// No row.
    #[error("no row; expected k, Ux, Uy, Uz, angle in degrees, T, T0, T1 in s")]
    Empty,
}

/// Comment with the Euler angles of the first position.
const START: &str = "% obsdeg: --start ";

/// Euler angles of the first position by the comment of a table that obsdeg wrote; `None` without one.
pub fn start_of_table(text: &str) -> Option<&str> {
    text.lines().find_map(|line| line.trim().strip_prefix(START)).map(str::trim)
}

/// Largest angle of a table in degrees below which it is taken for one in rad.
const RADIANS: f64 = 7.0;
/// Rest of rows that state none, in s.
const REST_S: f64 = 10.0;
/// Shortest dwell of a position, in s.
const LEAST_S: f64 = 1e-3;

/// Number of an entry: `90`, `-90`, `90*glv.deg`.
fn entry(text: &str) -> Option<f64> {
    text.trim().trim_end_matches("*glv.deg").trim().parse().ok().filter(|x: &f64| x.is_finite())
}

/// Rows of a rotation table with their lines. Lines may have brackets, semicolons, and comments after `%` or
/// `#`.
fn read(text: &str) -> Result<Vec<(usize, RotationRow)>, RotationTableError> {
    let mut out = Vec::new();
    for (i, whole) in text.lines().enumerate() {
        let line = i + 1;
        let code = whole.split(['%', '#']).next().unwrap_or_default();
        let code = code.split_once('=').map_or(code, |(_, after)| after);
        for row in code.split(';') {
            let row: String = row.chars().filter(|c| !"[]{}".contains(*c)).collect();
            let cells: Vec<&str> =
                row.split(|c: char| c == ',' || c.is_whitespace()).filter(|c| !c.is_empty()).collect();
            if cells.is_empty() || cells == ["..."] {
                continue;
            }
            let wrong = || RotationTableError::Row { line, found: row.trim().into() };
            let numbers: Vec<f64> =
                cells.iter().map(|c| entry(c)).collect::<Option<_>>().ok_or_else(wrong)?;
            let (&[number, x, y, z, angle_deg, rotate_s], rests) =
                numbers.split_first_chunk::<6>().ok_or_else(wrong)?;
            let (before_s, after_s) = match *rests {
                [] => (REST_S, REST_S),
                [rest] => (rest, rest),
                [before, after] => (before, after),
                _ => return Err(wrong()),
            };
            let length = (x * x + y * y + z * z).sqrt();
            let whole = number >= 1.0 && number.fract() == 0.0;
            let checks = [
                ("k", number, whole, "the number of the row, from 1"),
                ("an axis of length", length, (0.5..1.5).contains(&length), "a unit vector"),
                ("T", rotate_s, rotate_s > 0.0, "more than 0 s"),
                ("an angle of", angle_deg, angle_deg != 0.0, "other degrees than 0"),
                (
                    "a rate of [deg/s]",
                    (angle_deg / rotate_s).abs(),
                    (1e-3..=1e4).contains(&(angle_deg / rotate_s).abs()),
                    "0.001 to 10000 deg/s",
                ),
                ("rests of", before_s.max(after_s), before_s.max(after_s) <= 1e6, "at most 1e6 s"),
                ("T0", before_s, before_s >= 0.0, "0 s or more"),
                ("T1", after_s, after_s >= 0.0, "0 s or more"),
            ];
            for (what, found, right, expected) in checks {
                if !right {
                    return Err(RotationTableError::Number { line, what, found, expected });
                }
            }
            let axis = [x, y, z].map(|c| c / length);
            let number = number.max(0.0) as usize;
            out.push((line, RotationRow { number, axis, angle_deg, rotate_s, before_s, after_s }));
        }
    }
    let largest = out.iter().map(|(_, r): &(usize, RotationRow)| r.angle_deg.abs()).fold(0.0, f64::max);
    match out.first() {
        None => Err(RotationTableError::Empty),
        Some((line, _)) if largest < RADIANS => Err(RotationTableError::Radians { line: *line, largest }),
        Some(_) => Ok(out),
    }
}

/// Scheme of a rotation table that begins at the Euler angles `start`, under inertial carry: positions at
/// rest with their dwells, and slews about the axes of the table. Angles are rounded to 1e-9 degrees.
///
/// # Errors
/// [`RotationTableError`] with the line.
pub fn scheme_of_rotations(text: &str, start: &Euler) -> Result<Scheme, RotationTableError> {
    let rows = read(text)?;
    let mut at: Matrix3<f64> = c_n_f64(start);
    let mut positions: Vec<Position> = Scheme::of_angles([start.clone()]).positions;
    let mut rest = 0.0;
    for (k, (line, row)) in rows.iter().enumerate() {
        rest += row.before_s;
        let Some(last) = positions.last_mut().filter(|_| rest >= LEAST_S) else {
            return Err(RotationTableError::NoRest { line: *line });
        };
        last.dwell = Dwell::from_seconds(rest);
        // components in the platform: X_p front, Y_p up, Z_p right
        let mut about = [0.0; 3];
        (0..3).for_each(|i| about[BODY[i]] = row.axis[i]);
        let angle = row.angle_deg.to_radians();
        let before = at;
        at = times(&at, &rotation(&about.map(|x| x * angle)));
        let mut position = Scheme::of_angles([euler_of(&at)]).positions.remove(0);
        position.name = format!("p{}", k + 2);
        position.slew = Some(slew(&before, about, row));
        positions.push(position);
        rest = row.after_s;
    }
    let Some(last) = positions.last_mut().filter(|_| rest >= LEAST_S) else {
        return Err(RotationTableError::NoRest { line: rows.last().map_or(0, |r| r.0) });
    };
    last.dwell = Dwell::from_seconds(rest);
    Ok(Scheme { carry: Carry::Inertial, positions, ..Scheme::default() })
}

/// Slew of a row about `about` in the platform, which stands at `from`.
fn slew(from: &Matrix3<f64>, about: [f64; 3], row: &RotationRow) -> SlewTo {
    let rate_deg_s = Some(row.angle_deg.abs() / row.rotate_s);
    let nanodeg = |deg: f64| Angle::from_nanodeg((deg * 1e9).round() as i64);
    let named = (0..3).find(|&i| about[i].abs() > 1.0 - 1e-12);
    let (axis, sign) = match named {
        Some(index) => (SlewAxis::Named(Axis { index, geographic: false }), about[index].signum()),
        None => {
            (SlewAxis::Direction(std::array::from_fn(|i| (0..3).map(|j| from[i][j] * about[j]).sum())), 1.0)
        }
    };
    SlewTo { rate_deg_s, axis: Some(axis), angle: Some(nanodeg(sign * row.angle_deg)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedure::{ProcedureOptions, procedure};
    use obsdeg_core::model::scheme_file;
    use obsdeg_evidence::simulation::Conditions;
    use proptest::prelude::*;

    /// Attitude matrix of PSINS (`a2mat`): from the body to East, North, Up, angles in degrees.
    fn a2mat([pitch, roll, yaw]: [f64; 3]) -> Matrix3<f64> {
        let [(si, ci), (sj, cj), (sk, ck)] = [pitch, roll, yaw].map(|x| x.to_radians().sin_cos());
        [
            [cj * ck - si * sj * sk, -ci * sk, sj * ck + si * cj * sk],
            [cj * sk + si * sj * ck, ci * ck, sj * sk - si * cj * ck],
            [-ci * sj, si, ci * cj],
        ]
    }

    fn sheet(scheme: &Scheme) -> crate::procedure::Procedure {
        let conditions = Conditions::of(scheme);
        procedure(scheme, &conditions, &ProcedureOptions::default()).expect("a sheet")
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// A table that PSINS would play (`Cnb * rv2m(U * angle)`) puts the accelerometers where the sheet
        /// has them, and a scheme read from it has the same attitudes, dwells and rates.
        #[test]
        fn tables_are_played_and_read(
            angles in prop::collection::vec(prop::array::uniform3(-170i32..170), 2..5),
            dwell in 20u32..600,
        ) {
            let positions: String = angles
                .iter()
                .map(|[a, b, g]| format!("[[position]]\nangles_deg = [{a}, {b}, {g}]\ndwell_s = {dwell}\n"))
                .collect();
            let head = "carry = 'inertial'\nterms = ['F']\n[simulation]\nslew_rate_deg_s = 2\n";
            let scheme = scheme_file::read(&format!("{head}{positions}")).expect("a scheme");
            let found = sheet(&scheme);
            let mut at = a2mat(found.start_attitude_deg);
            let mut read = vec![at[2]];
            for row in &found.rotations {
                at = times(&at, &rotation(&row.axis.map(|u| u * row.angle_deg.to_radians())));
                read.push(at[2]);
            }
            let forces: Vec<[f64; 3]> = found.steps.iter().filter_map(|s| s.force_g).collect();
            prop_assert_eq!(forces.len(), scheme.positions.len());
            // attitudes that follow each other without a turn have no row
            prop_assume!(found.rotations.len() + 1 == forces.len());
            // angles as small as those in rad are refused
            prop_assume!(found.rotations.iter().any(|r| r.angle_deg > 7.0));
            for (body, force) in read.iter().zip(&forces) {
                prop_assert!((0..3).all(|k| (body[k] - force[BODY[k]]).abs() < 1e-6), "{body:?} {force:?}");
            }
            let text = rotation_table(&found.rotations, found.start_attitude_deg, "1,2,3");
            prop_assert_eq!(start_of_table(&text), Some("1,2,3"));
            let back = scheme_of_rotations(&text, &scheme.positions[0].angles).expect("a scheme");
            for (p, q) in back.positions.iter().zip(&scheme.positions) {
                let (a, b) = (c_n_f64(&p.angles), c_n_f64(&q.angles));
                prop_assert!((0..9).all(|k| (a[k / 3][k % 3] - b[k / 3][k % 3]).abs() < 1e-8));
                prop_assert!((p.dwell.map_or(0.0, Dwell::seconds) - f64::from(dwell)).abs() < 1e-6);
            }
            back.validate().expect("a valid scheme");
            let again = sheet(&Scheme { unknowns: scheme.unknowns.clone(), ..back });
            prop_assert!((again.total_s - found.total_s).abs() < 1e-4);
        }
    }

    /// The table of the documentation of `attrottt`, with brackets, factors and comments.
    #[test]
    fn a_table_of_psins() {
        let text = "paras = [ [1, 0,0,1, 90*glv.deg, 10, 10, 10]; % about up\n\
                    [2, 1,0,0, 45*glv.deg, 10, 10, 10];\n 3 0 1 0 45 10 10 ];\n";
        let zero: Euler = std::array::from_fn(|_| Angle::from_degrees(0));
        let scheme = scheme_of_rotations(text, &zero).expect("a scheme");
        let dwells: Vec<f64> = scheme.positions.iter().map(|p| p.dwell.map_or(0.0, Dwell::seconds)).collect();
        assert_eq!(dwells, [10.0, 20.0, 20.0, 10.0]);
        // up of the body is Y_p: a turn about it by 90 deg takes X_p from North to West
        let c = c_n_f64(&scheme.positions[1].angles);
        let x = [0, 1, 2].map(|i| c[i][0].round());
        assert_eq!(x, [0.0, 0.0, -1.0]);
        let slew = scheme.positions[1].slew.as_ref().expect("a slew");
        assert_eq!(
            (slew.rate_deg_s, slew.angle.as_ref().map(ToString::to_string).as_deref()),
            (Some(9.0), Some("90"))
        );
        scheme.validate().expect("a valid scheme");
    }

    #[test]
    fn wrong_tables_are_named() {
        let zero: Euler = std::array::from_fn(|_| Angle::from_degrees(0));
        let message = |text: &str| scheme_of_rotations(text, &zero).expect_err("wrong").to_string();
        for (text, expected) in [
            ("", "no row"),
            ("1, 0, 0, 1, 90\n", "line 1: `1, 0, 0, 1, 90`"),
            ("% a\n1, 0, 0, 1, x, 9, 9, 9\n", "line 2"),
            ("1, 0, 0, 0, 90, 9, 9, 9\n", "an axis of length 0"),
            ("0, 1, 0, 90, 9, 70, 70\n", "k 0; expected the number of the row"),
            ("1, 0, 0, 1, 90, 0, 9, 9\n", "T 0; expected more than 0 s"),
            ("1, 0, 0, 1, 90, 9, -1, 9\n", "T0 -1"),
            ("1, 0, 0, 1, 90, 9, 9, 0\n2, 1, 0, 0, 90, 9, 0, 9\n", "line 2: no rest before"),
            ("1, 0, 0, 1, 90, 9, 9, 9, 9\n", "line 1"),
            ("\n1, 0, 0, 1, 1.5708, 9, 9, 9\n", "line 2: the largest angle is 1.5708, as in radians"),
        ] {
            assert!(message(text).contains(expected), "{text:?}: {}", message(text));
        }
    }
}

//! Problem of a scheme file, in the form of a certificate.

use toml::Value;

use crate::file::{Number, RawAxis, RawGyro, RawProblem, RawTurn};
use crate::problem::{TURN, all_terms, nanodeg};
use crate::{Refused, refusal, same};

/// Refuses a certificate whose problem differs from that of a scheme file.
pub(crate) fn compare(certificate: &RawProblem, scheme: &str) -> Result<(), Refused> {
    let found = read(scheme, certificate.slews.as_deref())?;
    let place = |key: &str| format!("problem.{key}, against the scheme file");
    same(&place("carry"), &certificate.carry, &found.carry)?;
    same(&place("latitude_deg"), &certificate.latitude_deg, &found.latitude_deg)?;
    same(&place("measured_azimuth"), &certificate.measured_azimuth, &found.measured_azimuth)?;
    same(&place("terms"), &certificate.terms, &found.terms)?;
    same(&place("gyros"), &certificate.gyros, &found.gyros)?;
    same(&place("accelerometers"), &certificate.accelerometers, &found.accelerometers)?;
    same(&place("number of positions"), &certificate.positions.len(), &found.positions.len())?;
    for (i, (a, b)) in certificate.positions.iter().zip(&found.positions).enumerate() {
        same(&place(&format!("positions.{i}")), a, b)?;
    }
    same(&place("slews"), &certificate.slews, &found.slews)?;
    Ok(())
}

fn refused<T>(expected: &str, found: impl std::fmt::Display) -> Result<T, Refused> {
    Err(refusal("scheme file", expected, found))
}

fn text<'a>(value: Option<&'a Value>, default: &'a str, what: &str) -> Result<&'a str, Refused> {
    match value {
        None => Ok(default),
        Some(Value::String(text)) => Ok(text),
        Some(other) => refused(what, other.type_str()),
    }
}

/// Shortest decimal of a number.
fn decimal(value: &Value) -> Result<String, Refused> {
    match value {
        Value::Integer(i) => Ok(i.to_string()),
        Value::Float(x) if x.is_finite() => Ok(if *x == 0.0 { "0".into() } else { x.to_string() }),
        other => refused("decimal degrees", other.type_str()),
    }
}

fn signed(axis: &str) -> String {
    if axis.starts_with(['+', '-']) { axis.into() } else { format!("+{axis}") }
}

/// Keys of a scheme file; those that do not affect the problem are ignored.
const KEYS: [&str; 16] = [
    "name",
    "description",
    "carry",
    "latitude_deg",
    "terms",
    "frame",
    "path",
    "measured_azimuth",
    "geometry",
    "combinations",
    "simulation",
    "requirements",
    "bench",
    "gimbals",
    "record",
    "position",
];
const KEYS_OF_POSITION: [&str; 5] = ["name", "angles_deg", "attitude", "dwell_s", "slew"];

/// Refuses unknown keys, which may affect the problem.
fn known_keys(table: &toml::Table, known: &[&str]) -> Result<(), Refused> {
    let other = table.keys().find(|key| !known.contains(&key.as_str()));
    other.map_or(Ok(()), |key| refused("keys of standing positions", key))
}

/// Names of the terms, with families expanded.
fn terms(file: &toml::Table) -> Result<Vec<&'static str>, Refused> {
    let list: Vec<&str> = match file.get("terms") {
        None => vec!["F", "I", "O", "S"],
        Some(Value::Array(list)) => list.iter().map(|t| t.as_str().unwrap_or("?")).collect(),
        Some(other) => return refused("a list of terms", other.type_str()),
    };
    let [of_gyros, of_accelerometers] = match text(file.get("frame"), "accelerometers", "a frame")? {
        "accelerometers" => ["GM", "M3"],
        "gyros" => ["GM3", "M6"],
        "body" => ["GM", "M6"],
        other => return refused("accelerometers, gyros or body", other),
    };
    let gyros = ["F", "I", "O", "S", "GS", of_gyros];
    let accelerometers = ["K0", "K1", of_accelerometers, "K2"];
    let mut out = Vec::new();
    for name in list {
        match name {
            "gyros" => out.extend(gyros),
            "accelerometers" => out.extend(accelerometers),
            "all" => out.extend(gyros.into_iter().chain(accelerometers)),
            _ => match all_terms().find(|known| *known == name) {
                Some(term) => out.push(term),
                None => return refused("terms that certificates cover", name),
            },
        }
    }
    Ok(out)
}

fn read(scheme: &str, claimed: Option<&[Vec<RawTurn>]>) -> Result<RawProblem, Refused> {
    let no_toml = |e: toml::de::Error| refusal("scheme file", "TOML", e.message()).unreadable();
    let file: toml::Table = scheme.parse().map_err(no_toml)?;
    known_keys(&file, &KEYS)?;
    let terms = terms(&file)?;
    let empty = Value::Table(toml::Table::new());
    let geometry = file.get("geometry").unwrap_or(&empty);
    match geometry.as_table() {
        Some(table) => known_keys(table, &["X", "Y", "Z", "accelerometers"])?,
        None => return refused("a table of the geometry", geometry.type_str()),
    }
    let gyro = |letter: &str, defaults: [&str; 3]| {
        let [i, o, s] = axes(geometry.get(letter), ["I", "O", "S"], defaults)?;
        Ok::<_, Refused>(RawGyro { I: i, O: o, S: s })
    };
    let (positions, entries) = match file.get("position") {
        Some(Value::Array(list)) => (list.iter().map(position).collect::<Result<Vec<_>, _>>()?, list),
        _ => return refused("positions", "none"),
    };
    let carry = text(file.get("carry"), "platform", "a carry")?;
    let torquers = terms.iter().any(|t| ["GS", "GM", "GM3"].contains(t));
    let act = carry == "inertial" && positions.len() > 1 && torquers;
    let gimbals = text(file.get("path"), "", "a path")? == "gimbals";
    Ok(RawProblem {
        slews: act.then(|| slews(entries, &positions, gimbals, claimed)).transpose()?,
        carry: carry.into(),
        latitude_deg: file.get("latitude_deg").map(decimal).transpose()?,
        measured_azimuth: match file.get("measured_azimuth") {
            None => false,
            Some(Value::Boolean(measured)) => *measured,
            Some(other) => return refused("true or false", other.type_str()),
        },
        terms: all_terms().filter(|t| terms.contains(t)).map(String::from).collect(),
        gyros: [
            gyro("X", ["+x", "-z", "+y"])?,
            gyro("Y", ["+y", "-z", "-x"])?,
            gyro("Z", ["+z", "+x", "+y"])?,
        ],
        accelerometers: axes(geometry.get("accelerometers"), ["X", "Y", "Z"], ["+x", "+y", "+z"])?,
        positions,
    })
}

/// Three axes, from a table with these keys or a list in their order.
fn axes(own: Option<&Value>, keys: [&str; 3], defaults: [&str; 3]) -> Result<[String; 3], Refused> {
    let found = match own {
        None => return Ok(defaults.map(signed)),
        Some(Value::Array(list)) if list.len() == 3 => [Some(&list[0]), Some(&list[1]), Some(&list[2])],
        Some(Value::Table(table)) => {
            known_keys(table, &keys)?;
            keys.map(|key| table.get(key))
        }
        Some(other) => return refused("three axes", other.type_str()),
    };
    let [a, b, c] = found.map(|axis| text(axis, "", "an axis").map(signed));
    Ok([a?, b?, c?])
}

fn position(entry: &Value) -> Result<[String; 3], Refused> {
    match entry.as_table() {
        Some(table) => known_keys(table, &KEYS_OF_POSITION)?,
        None => return refused("a table for each position", entry.type_str()),
    }
    match entry.get("slew") {
        None => {}
        Some(Value::Table(table)) => known_keys(table, &["about", "angle_deg", "rate_deg_s"])?,
        Some(other) => return refused("a table for each slew", other.type_str()),
    }
    if let Some(letters) = entry.get("attitude") {
        return cardinal(text(Some(letters), "", "an attitude")?);
    }
    match entry.get("angles_deg").and_then(Value::as_array).map(Vec::as_slice) {
        Some([a, b, c]) => Ok([decimal(a)?, decimal(b)?, decimal(c)?]),
        _ => refused("three angles or an attitude in a position", "others"),
    }
}

/// Turns that a scheme file states; for a shortest turn the claimed ones, if they have its form.
fn slews(
    entries: &[Value],
    positions: &[[String; 3]],
    gimbals: bool,
    claimed: Option<&[Vec<RawTurn>]>,
) -> Result<Vec<Vec<RawTurn>>, Refused> {
    let named = |name: &str, angle_deg| RawTurn { about: Some(RawAxis::Named(name.into())), angle_deg };
    let mut out = vec![Vec::new()];
    for (i, pair) in positions.windows(2).enumerate() {
        let slew = entries.get(i + 1).and_then(|e| e.get("slew"));
        let angle = slew.and_then(|s| s.get("angle_deg")).map(decimal).transpose()?;
        let claimed = claimed.and_then(|c| c.get(i + 1)).map_or(&[][..], Vec::as_slice);
        out.push(match slew.and_then(|s| s.get("about")) {
            Some(Value::Array(direction)) if is_along(claimed, direction, angle.as_deref()) => {
                claimed.to_vec()
            }
            Some(Value::Array(_)) => return refused("the turn about the direction of the slew", "another"),
            Some(about) => match angle {
                Some(angle) => vec![named(text(Some(about), "", "a named axis")?, angle)],
                None => return refused("angle_deg beside the axis of a slew", about.type_str()),
            },
            None if gimbals => {
                let mut turns = Vec::new();
                for (k, name) in ["N", "middle", "Z_p"].into_iter().enumerate() {
                    let angle = nanodeg("scheme file", &pair[0][k])? - nanodeg("scheme file", &pair[1][k])?;
                    if angle != 0 {
                        turns.push(named(name, in_degrees(angle)));
                    }
                }
                turns
            }
            None if claimed.is_empty() || is_shortest(claimed) => claimed.to_vec(),
            None => return refused("the shortest turn among the slews of the certificate", "another"),
        });
    }
    Ok(out)
}

/// Shortest decimal of an angle in 1e-9 degrees.
fn in_degrees(nanodeg: i64) -> String {
    let (sign, m) = (if nanodeg < 0 { "-" } else { "" }, nanodeg.unsigned_abs());
    let text = format!("{sign}{}.{:09}", m / 1_000_000_000, m % 1_000_000_000);
    text.trim_end_matches('0').trim_end_matches('.').into()
}

/// Value of a number without rates.
fn value(x: &Number) -> f64 {
    let ratio = |q: &num_rational::BigRational| {
        let of = |n: &num_bigint::BigInt| n.to_string().parse::<f64>().unwrap_or(f64::NAN);
        of(q.numer()) / of(q.denom())
    };
    x.0.iter().map(|((r, _, _), q)| ratio(q) * f64::from(*r).sqrt()).sum()
}

/// True for one turn about a direction of a scheme file, by its angle (degrees) if one is stated: half
/// a turn about it, or the turn below 180 degrees between the attitudes.
fn is_along(turns: &[RawTurn], direction: &[Value], angle: Option<&str>) -> bool {
    let [turn] = turns else { return false };
    let number = |x: &Value| x.as_float().or(x.as_integer().map(|i| i as f64));
    let stated: Vec<f64> = direction.iter().filter_map(number).collect();
    let length = stated.iter().map(|x| x * x).sum::<f64>().sqrt();
    let claimed = nanodeg("", &turn.angle_deg).unwrap_or(0);
    let angle = angle.map_or(Ok(claimed), |angle| nanodeg("", angle)).unwrap_or(0);
    let sign = if angle < 0 { -1.0 } else { 1.0 };
    let near = |(x, stated): (&Number, &f64)| (value(x) - sign * stated / length).abs() < 1e-9;
    match &turn.about {
        _ if stated.len() != 3 || angle.abs() != claimed => false,
        None => 0 < claimed && claimed < TURN / 2,
        Some(RawAxis::Direction(v)) => claimed == TURN / 2 && v.iter().zip(&stated).all(near),
        Some(RawAxis::Named(_)) => false,
    }
}

/// True for one turn below 180 degrees about the axis between the attitudes, or a half turn about a
/// direction whose first non-zero component is positive.
fn is_shortest(turns: &[RawTurn]) -> bool {
    let [turn] = turns else { return false };
    let angle = nanodeg("", &turn.angle_deg).unwrap_or(0);
    match &turn.about {
        None => 0 < angle && angle < TURN / 2,
        Some(RawAxis::Direction(v)) if angle == TURN / 2 => {
            v.iter().map(value).find(|x| x.abs() > 1e-9).is_some_and(|x| x > 0.0)
        }
        Some(_) => false,
    }
}

/// Angles of an attitude by the directions of X_p, Y_p, Z_p: those with the fewest non-zero angles.
fn cardinal(letters: &str) -> Result<[String; 3], Refused> {
    let quarters = [(0, 1, 0), (90, 0, 1), (180, -1, 0), (-90, 0, -1)];
    let direction = |axis: [i32; 3]| match axis {
        [1, 0, 0] => 'N',
        [0, 1, 0] => 'U',
        [0, 0, 1] => 'E',
        [-1, 0, 0] => 'S',
        [0, -1, 0] => 'D',
        _ => 'W',
    };
    let all = (0..64).map(|i| [quarters[i / 16], quarters[i / 4 % 4], quarters[i % 4]]);
    let fits = |[(_, ca, sa), (_, cb, sb), (_, cg, sg)]: &[(i32, i32, i32); 3]| {
        // columns of Mx My Mz
        let x = [cb * cg, -ca * sg + sa * sb * cg, sa * sg + ca * sb * cg];
        let y = [cb * sg, ca * cg + sa * sb * sg, -sa * cg + ca * sb * sg];
        let z = [-sb, sa * cb, ca * cb];
        [x, y, z].map(direction).iter().collect::<String>() == letters
    };
    let turns = |q: &[(i32, i32, i32); 3]| q.iter().filter(|a| a.0 != 0).count();
    match all.filter(fits).min_by_key(turns) {
        Some(q) => Ok(q.map(|a| a.0.to_string())),
        None => refused("a right-handed attitude such as NUE", letters),
    }
}

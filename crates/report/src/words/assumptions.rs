//! Assumptions of a scheme in sentences: carry, gyros, latitude, observation, units, accelerometers.

use obsdeg_core::analysis::{Analysis, CarryReport, CombinationReport, PositionReport};
use obsdeg_core::model::{Carry, ErrorSource, Geometry, Term, Unknowns, omitted_unit};
use obsdeg_core::solution::Frame;

use super::{differences, list};

/// `inertial (rank profile 2 6 8 of 15): no verdict differs`, a line for each of the other carries.
pub(crate) fn carries(a: &Analysis) -> Vec<String> {
    let line = |c: &CarryReport| {
        let differs =
            if c.differs.is_empty() { "no verdict differs".into() } else { differences(&c.differs) };
        format!("{} (rank profile {} of {}): {differs}", c.carry, list(&c.rank_profile), c.unknowns)
    };
    let mut out: Vec<String> = a.carries.iter().map(line).collect();
    if a.carries.iter().flat_map(|c| &c.differs).any(|d| d.name.contains('@')) {
        out.push(
            "psi of one position (psi_x@2) is an unknown of reset carry alone: under the other carry the \
             same quantity, psi in the axes of c where that position begins, is judged as a combination of \
             its unknowns"
                .into(),
        );
    }
    out
}

/// The bench of some conditions: sizes in the units of their errors.
pub(crate) fn bench(sizes: &str) -> String {
    let with_unit = |size: &str| {
        let unit = size.split(' ').next().and_then(omitted_unit);
        unit.map_or_else(|| size.to_string(), |unit| format!("{size} {unit}"))
    };
    let listed: Vec<String> = sizes.split(", ").map(with_unit).collect();
    format!("bench {} (1 sigma)", listed.join(", "))
}

/// `gyros X: I=+x O=-z S=+y, Y: ...`.
pub(crate) fn gyros(geometry: &Geometry) -> String {
    let gyros = ["X", "Y", "Z"].iter().zip(geometry.gyros());
    let parts: Vec<String> = gyros.map(|(g, x)| format!("{g}: I={} O={} S={}", x.I, x.O, x.S)).collect();
    format!("gyros {}", parts.join(", "))
}

/// Combinations of an analysis; one that was found and asked for is listed once, as asked for.
pub(crate) fn combinations(a: &Analysis) -> impl Iterator<Item = &CombinationReport> {
    let asked = |c: &CombinationReport| {
        a.combinations.iter().any(|other| other.requested && other.expression == c.expression)
    };
    a.combinations.iter().filter(move |c| c.requested || !asked(c))
}

/// Carry with its meaning.
pub(crate) fn carry(of: Carry) -> &'static str {
    match of {
        Carry::Platform => {
            "platform: psi in platform axes goes on from position to position (the paper's simulation)"
        }
        Carry::Inertial => {
            "inertial: psi in geographic axes goes on from position to position (real torqued slews)"
        }
        Carry::Reset => "reset: psi is a new unknown at each position",
    }
}

/// Assumptions, one sentence each.
pub(crate) fn assumptions(a: &Analysis) -> Vec<String> {
    let terms: Vec<Term> = a.terms.parse::<Unknowns>().map(|u| u.terms().to_vec()).unwrap_or_default();
    let has = |source: ErrorSource| terms.iter().any(|t| t.source() == source);
    let has_others = has(ErrorSource::Rate) || has(ErrorSource::Force);
    let mut out = vec![
        format!("carry {}", carry(a.carry)),
        format!("latitude {}", latitude(a.latitude_deg)),
        format!(
            "{}; {} {}",
            gyros(&a.geometry),
            if has_others { "unknown terms" } else { "drift terms" },
            a.terms
        ),
        format!("observation {}", observation(a.frame, has(ErrorSource::Force))),
        units(has(ErrorSource::Rate), has(ErrorSource::Force)),
    ];
    out.extend(has(ErrorSource::Force).then(|| accelerometers(&a.geometry)));
    if has(ErrorSource::Rate) {
        out.push(
            "torquer errors GS and GM are drifts along the input axis: GS times the torqued rate along it, \
             GM_XY that of gyro X times the torqued rate along the input axis of gyro Y; at a position that \
             is the earth rate, in a rotation that of the turn besides"
                .into(),
        );
    }
    if a.positions.iter().any(|p| !p.turns.is_empty()) {
        out.push(
            "on the way to a position the torqued rate is that of the slew, fast against the earth rate: the \
             listed turns leave torquer errors in psi^n, with pi as a number of its own"
                .into(),
        );
    }
    out.extend(rotations(a, has_others).map(String::from));
    out.extend(turned_station(a, has_others));
    out.extend(local_drift(a, has(ErrorSource::Rate)));
    if a.stations.len() > 1 && a.quantities.iter().any(|q| q.solution.is_some()) {
        out.push(
            "solutions take psi as it is carried from station to station: what the dwells change in it is \
             not in them"
                .into(),
        );
    }
    if a.measured_azimuth {
        out.push("azimuth psi_y^n is measured: Za".into());
    }
    out
}

/// Latitude with the components of the earth rate.
fn latitude(latitude_deg: Option<f64>) -> String {
    latitude_deg.map_or_else(
        || "generic: wN and wU independent, not zero".to_string(),
        |l| format!("{l} deg: wN = w_ie cos, wU = w_ie sin"),
    )
}

/// The observation in its axes, with or without errors of accelerometers.
fn observation(frame: Frame, force: bool) -> &'static str {
    match (frame, force) {
        (Frame::N, false) => {
            "Z = -[g x] psi in North-Up-East axes: Z1 = psi_z, Z3 = -psi_x; primes are time derivatives"
        }
        (Frame::N, true) => {
            "Z = -[g x] psi + a in North-Up-East axes: Z1 = psi_z + a_x^n, Z2 = a_y^n, Z3 = -psi_x + a_z^n; \
             primes are time derivatives"
        }
        (Frame::Platform, false) => {
            "Z = -[g x] psi in platform axes: Zx, Zy, Zz; primes are time derivatives"
        }
        (Frame::Platform, true) => {
            "Z = -[g x] psi + a in platform axes: Zx, Zy, Zz; primes are time derivatives"
        }
    }
}

/// Units in formulas; with those of torquer errors and of errors of accelerometers.
fn units(rate: bool, force: bool) -> String {
    let units = [
        rate.then_some("GS and GM as numbers, "),
        force.then_some("K0, K2, K3 and Kx in g, K1 and M as numbers, "),
    ];
    let units: String = units.into_iter().flatten().collect();
    format!(
        "units in formulas: psi in rad, D in rad/s (per g), wN and wU in rad/s, Z in g; {units}a blank \
         multiplies"
    )
}

/// Input axes of the accelerometers, and their error.
fn accelerometers(geometry: &Geometry) -> String {
    let inputs = ["X", "Y", "Z"].iter().zip(geometry.accelerometers.inputs());
    let inputs: Vec<String> = inputs.map(|(name, axis)| format!("{name}: I={axis}")).collect();
    format!(
        "accelerometers {}; their error a is K0, and K1, M, K2, K3, Kx times components of the specific \
         force f = -g",
        inputs.join(", ")
    )
}

/// Sentence on rotating segments; `None` without any.
fn rotations(a: &Analysis, has_others: bool) -> Option<&'static str> {
    let turns = a.positions.iter().any(|p| p.rotation.is_some());
    turns.then_some(if has_others {
        "a rotation is the whole course of Z while it goes on at a steady rate, which drift and these \
         errors share: at almost any rate; psi in n moves in it, by drift and by what torquer errors \
         leave"
    } else {
        "a rotation is all its attitudes at once: rows at 2m+1 of them span it (trigonometric \
         polynomials of degree m); psi in n goes on through it"
    })
}

/// Sentence on the first station where the platform has turned; `None` without one, or if there are errors of
/// torquers or accelerometers and nothing is solved.
fn turned_station(a: &Analysis, has_others: bool) -> Option<String> {
    let solved = a.quantities.iter().any(|q| q.solution.is_some());
    let turned = a.stations.iter().find(|s| s.turned_deg.is_some_and(|t| t != 0.0));
    let s = turned.filter(|_| solved || !has_others)?;
    let (angle, about) = (s.turned_deg.unwrap_or_default(), s.about.as_deref().unwrap_or_default());
    let rate = s.rate.as_deref().unwrap_or_default();
    Some(format!(
        "{} is {} when it has turned by {angle} deg (right-handed about {about}) and turns on: \
         derivatives of Z there are those of the turning platform, and {rate} is the rate of that angle \
         in rad/s",
        s.label, s.position
    ))
}

/// Sentence on the drift in n as a name in combinations; `None` if no combination has it.
fn local_drift(a: &Analysis, rate: bool) -> Option<String> {
    let local = |c: &&CombinationReport| !c.requested && c.expression.contains("^n@");
    let c = a.combinations.iter().find(local)?;
    let at = c.expression.rsplit_once('@').map_or("", |(_, at)| at);
    Some(format!(
        "eps_x^n@{at} is the drift along North at {at}, psi^n and y (Up), z (East) likewise{}",
        if rate { "" } else { "; --formulas writes them in the unknowns" }
    ))
}

/// The angles of a position, with the rotation that starts there.
pub(crate) fn angles(p: &PositionReport) -> String {
    let angles = p.angles_deg.each_ref().map(ToString::to_string).join(", ");
    match p.rotation.as_deref().and_then(|r| r.split_once(':')) {
        Some((about, angle)) => format!("{angles}, turned by {angle} about {about}"),
        None => angles,
    }
}

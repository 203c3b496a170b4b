//! Sentences that several formats share.

use std::collections::BTreeMap;

use obsdeg_core::analysis::{
    Analysis, CarryReport, CombinationReport, Component, PositionReport, Quantity, Solution, term_notes,
};
use obsdeg_core::degree::{Difference, Form, Status, Verdict};
use obsdeg_core::model::slew::Turn;
use obsdeg_core::model::{
    Carry, ErrorSource, Geometry, Scheme, Term, Unknowns, omitted_unit, parse_attitude,
};
use obsdeg_core::solution::{Frame, Verification};
use obsdeg_evidence::simulation::{
    AccelerometerBias, CoefficientFloor, Consistency, Doubt, GyroNoise, NoiseFloor, Outcome, Reached,
    SimulationError,
};

use crate::document::{number, optional};

pub(crate) fn degree(d: Option<usize>) -> String {
    d.map_or_else(|| "-".into(), |k| k.to_string())
}

/// Accuracy order in a table, with the reason if there is none beside a degree.
pub(crate) fn accuracy_order(degree: Option<usize>, order: Option<usize>, computed: bool) -> String {
    match (degree, order) {
        (_, Some(k)) => k.to_string(),
        (_, None) if !computed => "not computed".into(),
        (Some(_), None) => "not with dwell".into(),
        (None, None) => "-".into(),
    }
}

/// Remark on the effect of the dwell on a degree; empty if the accuracy order equals the degree.
pub(crate) fn with_dwell(a: &Analysis, degree: Option<usize>, order: Option<usize>) -> String {
    match (degree, order) {
        _ if !a.has_accuracy_orders => String::new(),
        (Some(_), None) => "not determined".into(),
        (degree, Some(k)) if degree != Some(k) => format!("order {k}"),
        _ => String::new(),
    }
}

/// True if the dwell changes a row of the answer.
pub(crate) fn dwell_matters(a: &Analysis) -> bool {
    let unknowns = a.quantities.iter().map(|q| (q.degree, q.accuracy_order));
    let combinations = a.combinations.iter().map(|c| (c.degree, c.accuracy_order));
    unknowns.chain(combinations).any(|(degree, order)| !with_dwell(a, degree, order).is_empty())
}

pub(crate) fn list(items: &[usize]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// `2 positions, platform carry, generic latitude`.
pub(crate) fn headline(a: &Analysis) -> String {
    let n = a.positions.len();
    let latitude = a.latitude_deg.map_or_else(|| "generic latitude".into(), |l| format!("latitude {l} deg"));
    let azimuth = if a.measured_azimuth { ", azimuth measured" } else { "" };
    format!("{n} position{}, {} carry, {latitude}{azimuth}", if n == 1 { "" } else { "s" }, a.carry)
}

/// `rank 8 of 15 by derivatives; rank profile 2 6 8 with derivatives up to order 0, 1, 2`.
pub(crate) fn rank(a: &Analysis) -> String {
    let orders: Vec<String> = (0..a.rank_profile.len()).map(|k| k.to_string()).collect();
    format!(
        "rank {} of {} by derivatives; rank profile {} with derivatives up to order {}",
        a.rank,
        a.unknowns.len(),
        list(&a.rank_profile),
        orders.join(", ")
    )
}

/// `not told from D_FZ, D_OY`; a long list is cut and says so (JSON and CSV have all of it).
pub(crate) fn indistinguishable_from(partners: &[String]) -> String {
    const SHOWN: usize = 8;
    let more = partners.len().saturating_sub(SHOWN);
    let tail = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("not told from {}{tail}", partners[..partners.len() - more].join(", "))
}

/// Remark beside the verdict on an unknown: its solution or its partners, then its degree elsewhere.
pub(crate) fn explanation(q: &Quantity) -> String {
    let mut out = match (&q.solution, q.status) {
        (Some(s), _) => s.text.clone(),
        (None, Status::Inseparable) => indistinguishable_from(&q.partners),
        _ => String::new(),
    };
    if let Some(e) = &q.elsewhere {
        let mut where_else = Vec::new();
        if let Some(k) = e.other_latitudes {
            where_else.push(format!("degree {k} at other latitudes"));
        }
        if let Some(k) = e.other_angles {
            where_else.push(format!("degree {k} at other angles"));
        }
        let joint = if out.is_empty() { "" } else { "; " };
        out = format!("{out}{joint}{}", where_else.join(", "));
    }
    out
}

fn verdict(v: &Verdict) -> String {
    match (v.status, v.degree) {
        (Status::Observable, Some(k)) => format!("degree {k}"),
        (status, _) => status.to_string(),
    }
}

/// `D_FZ inseparable -> degree 1`.
pub(crate) fn difference(d: &Difference) -> String {
    format!("{} {} -> {}", d.name, verdict(&d.here), verdict(&d.there))
}

/// Unknowns that change alike, with the positions in their names.
struct DifferenceGroup<'a> {
    of: &'a Difference,
    names: Vec<(&'a str, Vec<&'a str>)>,
}

/// `D_FX, D_FZ inseparable -> degree 1; psi_x@1 to @7 degree 1 -> degree 2`: unknowns with the same change
/// are grouped.
fn differences(all: &[Difference]) -> String {
    let mut groups: Vec<DifferenceGroup<'_>> = Vec::new();
    for d in all {
        let place = groups.iter().position(|g| (g.of.here, g.of.there) == (d.here, d.there));
        let place = place.unwrap_or_else(|| {
            groups.push(DifferenceGroup { of: d, names: Vec::new() });
            groups.len() - 1
        });
        let (name, position) = d.name.split_once('@').unwrap_or((&d.name, ""));
        let names = &mut groups[place].names;
        match names.iter_mut().find(|(n, _)| *n == name) {
            Some((_, positions)) => positions.push(position),
            None => names.push((name, vec![position])),
        }
    }
    let named = |(name, positions): &(&str, Vec<&str>)| match positions[..] {
        [""] => name.to_string(),
        [one] => format!("{name}@{one}"),
        [first, .., last] if consecutive(positions) => format!("{name}@{first} to @{last}"),
        _ => format!("{name}@{}", positions.join(", @")),
    };
    let group = |g: &DifferenceGroup<'_>| {
        let names: Vec<String> = g.names.iter().map(named).collect();
        format!("{} {} -> {}", names.join(", "), verdict(&g.of.here), verdict(&g.of.there))
    };
    groups.iter().map(group).collect::<Vec<_>>().join("; ")
}

/// True if numbers, given as texts, follow each other.
fn consecutive(positions: &[&str]) -> bool {
    let numbers: Option<Vec<usize>> = positions.iter().map(|p| p.parse().ok()).collect();
    numbers.is_some_and(|n| n.windows(2).all(|pair| pair[1] == pair[0] + 1))
}

/// Reasons why candidates leave coefficients unobservable, if the terms give them.
pub(crate) fn reasons(terms: &str, candidates: &[String]) -> Vec<String> {
    let attitudes: Result<Vec<_>, _> = candidates.iter().map(|c| parse_attitude(c)).collect();
    let (Ok(unknowns), Ok(attitudes)) = (terms.parse(), attitudes) else { return Vec::new() };
    // inertial: notes on the meaning of another carry would be no reasons
    term_notes(&Scheme { carry: Carry::Inertial, unknowns, ..Scheme::of_angles(attitudes) })
}

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

/// Accuracy orders that differ from the degrees, one sentence for each pair of order and degree.
pub(crate) fn accuracy(a: &Analysis) -> Vec<String> {
    let unknowns = a.quantities.iter().map(|q| (&q.name, q.degree, q.accuracy_order));
    let combinations = a.combinations.iter().map(|c| (&c.expression, c.degree, c.accuracy_order));
    let mut groups: BTreeMap<(Option<usize>, Option<usize>), Vec<&str>> = BTreeMap::new();
    if a.has_accuracy_orders {
        for (name, degree, order) in unknowns.chain(combinations).filter(|(_, degree, order)| degree != order)
        {
            groups.entry((degree, order)).or_default().push(name);
        }
    }
    let sentence = |((degree, order), names): ((Option<usize>, Option<usize>), Vec<&str>)| {
        let degree = degree.map_or_else(|| "not observable by derivatives".into(), |k| format!("degree {k}"));
        let names = names.join(", ");
        match order {
            Some(order) => format!("{names}: accuracy order {order} ({degree}), error ~ T^-{order}.5"),
            None => format!("{names}: {degree}, yet not determined with dwell, during which psi moves"),
        }
    };
    groups.into_iter().map(sentence).collect()
}

/// Title of the null space.
pub(crate) const UNSEEN: &str = "Directions that derivatives of Z do not see";

/// Title of the section on accuracy orders.
pub(crate) const ACCURACY: &str =
    "Accuracy order where it differs from the degree (dwell T at every position)";

/// A bound on a probability to one digit, rounded up: `8e-23`.
pub(crate) fn at_most(bound: f64) -> String {
    let near = format!("{bound:.0e}");
    let below = near.parse::<f64>().is_ok_and(|shown| shown < bound);
    let parts = near.split_once('e').filter(|_| below);
    let parts =
        parts.and_then(|(digit, power)| Some((digit.parse::<u32>().ok()?, power.parse::<i32>().ok()?)));
    match parts {
        None => near,
        Some((9.., power)) => format!("1e{}", power + 1),
        Some((digit, power)) => format!("{}e{power}", digit + 1),
    }
}

/// A bound on the probability of an error, after "a verdict is": `wrong with probability below 8e-23`.
/// Numbers with very many digits leave none below one.
pub(crate) fn wrong_below(bound: f64) -> String {
    if bound < 1.0 {
        format!("wrong with probability below {}", at_most(bound))
    } else {
        "without a bound on the probability of an error (numbers with fewer digits have one)".into()
    }
}

/// Sentence on the certainty of verdicts and solutions.
pub(crate) fn certainty(a: &Analysis) -> String {
    let c = &a.certainty;
    let mut out = format!(
        "{} (p = {}, {}; seed {}): a verdict is {}",
        c.method,
        c.primes[0],
        c.primes[1],
        c.seed,
        wrong_below(c.error_bound)
    );
    let solutions: Vec<&Solution> = a
        .quantities
        .iter()
        .filter_map(|q| q.solution.as_ref())
        .chain(a.combinations.iter().filter_map(|c| c.solution.as_ref()))
        .collect();
    for (kind, how) in [
        (Verification::Symbolic, "by exact substitution"),
        (Verification::Modular, "by substitution in both prime fields"),
        (Verification::Numeric, "by substitution in floating point"),
    ] {
        let n = solutions.iter().filter(|s| s.verification == kind).count();
        if n > 0 {
            out.push_str(&format!("; {n} solution{} verified {how}", if n == 1 { "" } else { "s" }));
        }
    }
    let decimals = solutions.iter().filter(|s| s.form == Form::Decimal).count();
    if decimals > 0 {
        out.push_str(&format!("; {decimals} with coefficients as decimals, rounded to six places"));
    }
    out
}

/// The unknowns that are not excited.
pub(crate) fn not_excited(a: &Analysis) -> Vec<&str> {
    a.quantities.iter().filter(|q| q.status == Status::NotExcited).map(|q| q.name.as_str()).collect()
}

/// A null vector as `psi_y = 1, D_FZ = wN`.
pub(crate) fn null_vector(v: &[Component]) -> String {
    let part = |c: &Component| match &c.coefficient {
        Some(k) => format!("{} = {k}", c.name),
        None => c.name.clone(),
    };
    let turned = if rotates_the_axes(v) {
        " (all that is mounted turns: a rotation of the platform axes)"
    } else {
        ""
    };
    format!("{}{turned}", v.iter().map(part).collect::<Vec<_>>().join(", "))
}

/// True if a direction is a rotation of the platform axes: only psi and misalignments of gyros and
/// accelerometers change, these by antisymmetric parts.
fn rotates_the_axes(v: &[Component]) -> bool {
    let number = |name: &str| {
        let found = v.iter().find(|c| c.name == name);
        found.map_or(Some(0.0), |c| c.coefficient.as_ref()?.parse::<f64>().ok())
    };
    let odd = |family: &str| {
        ["XY", "YZ", "ZX"].iter().all(|pair| {
            let (there, back) =
                (format!("{family}_{pair}"), format!("{family}_{}{}", &pair[1..], &pair[..1]));
            matches!((number(&there), number(&back)), (Some(x), Some(y)) if x == -y)
        })
    };
    let of = |family: &str| v.iter().any(|c| c.name.starts_with(family));
    let only = v.iter().all(|c| ["psi_", "GM_", "M_"].iter().any(|f| c.name.starts_with(f)));
    only && of("psi_") && of("GM_") && of("M_") && odd("GM") && odd("M")
}

/// Note on the list of degenerate angles.
pub(crate) fn loci(loci: &[obsdeg_core::solution::Locus]) -> String {
    let held = match loci.is_empty() {
        true => "none was found: a determinant would vanish there, and",
        false => "a determinant vanishes there, and",
    };
    format!(
        "({held} at a random point of each, in two prime fields, ranks or verdicts differ from those above; \
         what needs two equations at once is not sought; degrees that are not whole are rounded)"
    )
}

/// A locus as `alpha = 0 deg: rank profile 2 4 5; D_FX degree 1 -> not observable`.
pub(crate) fn locus(l: &obsdeg_core::solution::Locus) -> String {
    let changes: Vec<String> = l.changes.iter().map(difference).collect();
    let changes = if changes.is_empty() { String::new() } else { format!("; {}", changes.join("; ")) };
    format!("{}: rank profile {}{changes}", l.condition, list(&l.rank_profile))
}

/// Names, at most a dozen of them.
pub(crate) fn names<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    const SHOWN: usize = 12;
    let all: Vec<&str> = names.into_iter().collect();
    let more = all.len().saturating_sub(SHOWN);
    let tail = if more > 1 { format!(" and {more} more") } else { String::new() };
    let shown = if more > 1 { SHOWN } else { all.len() };
    format!("{}{tail}", all[..shown].join(", "))
}

/// Outcome of an unknown in a run.
pub(crate) fn outcome(o: Outcome) -> &'static str {
    match o {
        Outcome::Reached => "reached",
        Outcome::Converging => "converging",
        Outcome::Determined => "determined",
        Outcome::RestsOnPrior => "rests on the prior",
        Outcome::PriorOnly => "known from the prior only",
        Outcome::LargeAnglesOnly => "large angles only",
        Outcome::Inconsistent => "inconsistent",
        Outcome::NoNumber => "no number",
    }
}

/// The columns of [`estimate`].
pub(crate) const ESTIMATE: [&str; 6] = ["degree", "truth", "estimate", "error", "sigma", "in sigma"];

/// Degree, true value, estimate, error and sigma of an unknown, and the error in sigma.
pub(crate) fn estimate(d: Option<usize>, values: [f64; 4], in_sigma: f64) -> [String; 6] {
    let [truth, estimate, error, sigma] = values.map(number);
    [degree(d), truth, estimate, error, sigma, format!("{in_sigma:.2}")]
}

/// Reason why a review has no evidence by a filter.
pub(crate) fn no_evidence(e: &SimulationError) -> String {
    match e {
        SimulationError::CrosscheckRotation => {
            "this scheme has a rotating segment, and the evidence by a filter takes positions".into()
        }
        e => format!("no evidence by a filter: {e}"),
    }
}

/// Findings against the consistency of a run.
pub(crate) fn doubts(c: &Consistency) -> String {
    let of = |d: &Doubt| match d {
        Doubt::NoNumber => "a figure of the run is no number".into(),
        Doubt::Nis => format!("mean NIS {} is outside {} (99.9 %)", number(c.nis), band(c.nis_wide_band)),
        Doubt::Nees => {
            format!("NEES {} at the end is above {} (99.9 %)", number(c.nees), number(c.nees_limit))
        }
        Doubt::Error => {
            format!("errors are beyond four sigma: {}", names(c.beyond.iter().map(String::as_str)))
        }
        Doubt::Correlated => {
            format!("innovations are not white (probability {})", number(c.whiteness_probability))
        }
    };
    c.doubts.iter().map(of).collect::<Vec<String>>().join("; ")
}

/// Band such as `1.7..2.3`.
pub(crate) fn band((low, high): (f64, f64)) -> String {
    format!("{}..{}", number(low), number(high))
}

/// `; without ...`: the directions that the NEES leaves out; empty if there are none.
fn left_out(c: &Consistency) -> String {
    let directions = |k: usize| format!("{k} {}", if k == 1 { "direction" } else { "directions" });
    let held = match c.held_directions {
        0 => String::new(),
        k => format!("; without {} that constraints hold", directions(k)),
    };
    match c.unresolved_directions {
        0 => held,
        k => format!(
            "{held}; without {} that are not resolvable: the filter claims to know them more than a million \
             times better than any unknown",
            directions(k)
        ),
    }
}

/// Sentences on the consistency of a run, with its figures.
pub(crate) fn consistency(c: &Consistency) -> Vec<String> {
    vec![
        if c.consistent {
            "this run of the filter is consistent with its truth".into()
        } else {
            format!("the filter is NOT consistent with this truth: {}", doubts(c))
        },
        format!("mean NIS {} (95 %: {})", number(c.nis), band(c.nis_band)),
        format!(
            "NEES at the end {} (95 %: {}; decides: at most {}){}",
            number(c.nees),
            band(c.nees_band),
            number(c.nees_limit),
            left_out(c)
        ),
        format!("innovations white: probability {}", number(c.whiteness_probability)),
    ]
}

/// Samples at the start of positions that are left out.
pub(crate) fn settle(seconds: f64) -> String {
    format!("samples of the first {seconds} s at each position left out (settle under [record])")
}

/// The bias instability of the accelerometers.
pub(crate) fn accelerometer_bias(b: &AccelerometerBias) -> String {
    format!(
        "bias instability B {} ug of each accelerometer (first-order Gauss-Markov of {} s, sigma 1.076 B)",
        b.instability_ug, b.correlation_time_s
    )
}

/// Noise of the gyros by their datasheet.
pub(crate) fn gyro_noise(g: &GyroNoise) -> String {
    let listed = [
        (g.angle_random_walk_deg_sqrt_h, "angle random walk", "deg/sqrt(h)"),
        (g.rate_random_walk_dph_sqrt_h, "rate random walk", "deg/h/sqrt(h)"),
        (g.bias_instability_dph, "bias instability B", "deg/h"),
    ];
    let there = listed.iter().filter(|(x, ..)| !x.is_none());
    let parts: Vec<String> = there.map(|(x, what, unit)| format!("{what} {x} {unit}")).collect();
    let markov = if g.bias_instability_dph.is_none() {
        String::new()
    } else {
        format!(
            " (first-order Gauss-Markov of {} s, sigma 1.076 B: Allan peak 0.664 B)",
            g.correlation_time_s
        )
    };
    let states = if g.rate_random_walk_dph_sqrt_h.is_none() && g.bias_instability_dph.is_none() {
        ""
    } else {
        "; the biases are states of filter and truth, and D_F is the constant part: the walk counts from the \
         start of the run"
    };
    format!("gyros (X, Y, Z where they differ): {}{markov}{states}", parts.join(", "))
}

/// Columns of a noise floor: sigma with the scheme's dwells, the least sigma, and the dwell that reaches it.
pub(crate) const FLOOR: [&str; 3] = ["sigma now", "least sigma", "no better beyond [s]"];

/// Cells of the noise floor of one coefficient.
pub(crate) fn floor(c: &CoefficientFloor) -> [String; 3] {
    let dwell = match c.reached {
        Some(Reached::StillFalls) => "still falls".into(),
        Some(Reached::AtTheShortest) => "the shortest".into(),
        Some(Reached::Within) | None => optional(c.dwell_s),
    };
    [optional(c.sigma), optional(c.least_sigma), dwell]
}

/// Notes on the meaning of a noise floor.
pub(crate) const FLOOR_MEANS: [&str; 3] = [
    "sigma of the linear filter, as far as the small-angle model holds, without a prior, with noise of Z and \
     random drift: now, and the least over all dwells in proportion to these",
    "no better beyond: the shortest such dwell (mean of the positions) at which sigma is within 5 % of the \
     least; the shortest: of those looked at, so that shorter ones may do as well or better; still falls: \
     not before a quarter of the longest",
    "every coefficient is a constant: D_F is the bias at the start of the run, and the walk of a gyro takes \
     its bias away from there",
];

/// Dwells and noise of a noise floor.
pub(crate) fn floor_of(f: &NoiseFloor) -> [String; 2] {
    let [low, high] = f.dwells_s.map(number);
    let drift = if f.drift_noise_deg_sqrt_h > 0.0 {
        format!("; random drift of {} deg/sqrt(h) besides", number(f.drift_noise_deg_sqrt_h))
    } else {
        String::new()
    };
    [
        format!("dwells from {low} to {high} s, mean of the positions"),
        format!("{}{drift}", gyro_noise(&f.gyro_noise)),
    ]
}

/// A direction in n as `N`, `-U`, `N-E` or `0.6N+0.8U`.
pub(crate) fn direction(v: &[f64; 3]) -> String {
    let largest = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let plain = v.iter().all(|x| x.abs() < 1e-9 || x.abs() > largest - 1e-9);
    let part = |(x, letter): (&f64, char)| {
        let size = if plain { String::new() } else { format!("{:.3}", x.abs()) };
        let shown = x.abs() >= if plain { 1e-9 } else { 5e-4 };
        let size = if size.contains('.') { size.trim_end_matches('0').trim_end_matches('.') } else { "" };
        shown.then(|| format!("{}{size}{letter}", if *x < 0.0 { '-' } else { '+' }))
    };
    let text: String = v.iter().zip(['N', 'U', 'E']).filter_map(part).collect();
    text.strip_prefix('+').unwrap_or(&text).to_string()
}

/// Probability with its digits, or `below 1e-9`.
pub(crate) fn chance(p: f64) -> String {
    if p < 1e-9 { "below 1e-9".into() } else { number(p) }
}

/// `180 deg about -N`.
pub(crate) fn turn(t: &Turn) -> String {
    format!("{} deg about {}", (t.angle_deg * 100.0).round() / 100.0, direction(&t.about))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The printed bound is no smaller than the bound, and at most a digit above.
    #[test]
    fn bounds_are_rounded_up() {
        let cases = [(8.4e-23, "9e-23"), (8e-23, "8e-23"), (9.5e-5, "1e-4"), (9.001e-1, "1e0"), (0.0, "0e0")];
        for (x, said) in cases {
            assert_eq!(at_most(x), said);
        }
        for k in 0..500 {
            let x = 10f64.powf(-0.0737 * f64::from(k)) * 1.3;
            let said: f64 = at_most(x).parse().expect("a number");
            assert!(said >= x && said <= 2.0 * x, "{x}: {said}");
        }
    }

    #[test]
    fn directions_read_as_sums_of_axes() {
        let r = 0.5f64.sqrt();
        for (v, expected) in [
            ([1.0, 0.0, 0.0], "N"),
            ([0.0, -1.0, 0.0], "-U"),
            ([r, 0.0, -r], "N-E"),
            ([-r, -r, 1e-17], "-N-U"),
            ([0.6, 0.0, -0.8], "0.6N-0.8E"),
            ([-0.1234567, 0.99235, 1e-7], "-0.123N+0.992U"),
        ] {
            assert_eq!(direction(&v), expected);
        }
    }
}

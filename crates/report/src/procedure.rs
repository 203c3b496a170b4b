//! Sheet of a run: the page of the crew, and the tables of a controller.

use obsdeg_core::model::{Carry, GIMBAL_NAMES, Scheme, parse_attitude};
use obsdeg_core::title_block::TitleBlock;
use obsdeg_design::procedure::{Obstacle, ObstacleKind, Procedure, Step, StepKind, StepTurn};

use crate::document::{Document, DocumentBlock, Drawing, Picture, TableColumn, left, optional, right, short};
use crate::figures::File;
use crate::words::{self, names};
use crate::{Answer, ReportError, acceptance, csv_text, html, poses, stated};

/// Time as hours, minutes and seconds: `1:02:30`.
fn clock(seconds: f64) -> String {
    let tenths = (seconds * 10.0).round() as u64;
    let (hours, minutes, rest) = (tenths / 36_000, tenths / 600 % 60, tenths % 600);
    let fraction = if rest % 10 == 0 { String::new() } else { format!(".{}", rest % 10) };
    format!("{hours}:{minutes:02}:{:02}{fraction}", rest / 10)
}

/// Axis of a turn in the platform: `X_p`, or components.
fn platform_axis(v: &[f64; 3]) -> String {
    let named = ["X_p", "Y_p", "Z_p"].iter().zip(v).find(|(_, x)| x.abs() > 1.0 - 1e-9);
    match named {
        Some((name, x)) => format!("{}{name}", if *x < 0.0 { "-" } else { "" }),
        None => format!("({})", v.map(short).join(", ")),
    }
}

/// Turn of a step: `90 deg about N, in the platform X_p, at 2 deg/s`.
fn turn(t: &StepTurn) -> String {
    let angle = short(t.angle_deg);
    let rate = t.rate_deg_s.map_or_else(String::new, |r| format!(", at {} deg/s", short(r)));
    let platform = platform_axis(&t.about_platform);
    format!("{angle} deg about {}, in the platform {platform}{rate}", words::direction(&t.about))
}

/// Gimbals that turn much faster than the platform, with their rates.
fn fast_gimbals(t: &StepTurn) -> Option<String> {
    let (rate, own) = (t.rate_deg_s?, t.gimbal_rates_deg_s?);
    let fast = GIMBAL_NAMES.iter().zip(own).filter(|(_, r)| *r > FAST * rate);
    let all: Vec<String> = fast.map(|(name, r)| format!("{name} {} deg/s", short(r))).collect();
    (!all.is_empty()).then(|| format!("Gimbals reach {}.", all.join(", ")))
}

/// Rate of a gimbal over that of the platform from which the sheet names it.
const FAST: f64 = 2.0;

/// Instruction on arrival at a position under reset carry; empty for the first position and other carries.
fn again(p: &Procedure, s: &Step) -> &'static str {
    let is_first = p.steps.first().is_some_and(|first| first.position == s.position);
    if p.carry == Carry::Reset && !is_first { "Level and align the platform again. " } else { "" }
}

/// Instruction of a step.
fn instruction(p: &Procedure, s: &Step) -> String {
    let label = &s.position;
    match (s.kind, &s.turn) {
        (StepKind::Set, _) => "Set the gimbals. Level and align the platform.".into(),
        (StepKind::Gimbals, _) => {
            let [alpha, _, gamma] = s.gimbals_deg.map(short);
            format!(
                "Before departure, the platform at rest and recorded: turn alpha to {alpha} deg and gamma to {gamma} \
                 deg together, so that the attitude stays."
            )
        }
        (StepKind::Wait, _) => format!("{}Wait for rest. Label: {label}. Compare the readings.", again(p, s)),
        (StepKind::Record, _) => {
            let again = if p.settle_s > 0.0 { "" } else { again(p, s) };
            format!("{again}Record, a row every {} s or less. Label: {label}.", short(p.row_s))
        }
        (StepKind::Rotate, Some(t)) => {
            format!(
                "Record, a row every {} s or less. Label: {label}. Turn {} meanwhile.",
                short(p.row_s),
                turn(t)
            )
        }
        (StepKind::Turn, Some(t)) => match &t.gimbal {
            Some(gimbal) => {
                let k = GIMBAL_NAMES.iter().position(|name| name == gimbal).unwrap_or(0);
                let [from, to] = [t.from_deg[k], s.gimbals_deg[k]].map(short);
                let by = s.gimbals_deg[k] - t.from_deg[k];
                let rate = t.rate_deg_s.map_or_else(String::new, |r| format!(", at {} deg/s", short(r)));
                format!(
                    "Turn gimbal {gimbal} from {from} to {to} deg ({}{}){rate}.",
                    if by > 0.0 { "+" } else { "" },
                    short(by)
                )
            }
            None => {
                let fast = fast_gimbals(t).map_or_else(String::new, |text| format!(" {text}"));
                format!("Turn the platform {}.{fast}", turn(t))
            }
        },
        (StepKind::Turn | StepKind::Rotate, None) => String::new(),
    }
}

/// Gimbal angles; those without limits are printed from -180 to 180 deg.
fn angles(p: &Procedure, of: &[f64; 3]) -> String {
    let shown = |k: usize| match p.free_gimbals[k] {
        true => short(180.0 - (180.0 - of[k]).rem_euclid(360.0)),
        false => short(of[k]),
    };
    [0, 1, 2].map(shown).join(", ")
}

fn steps(p: &Procedure) -> DocumentBlock {
    let columns = [
        right("step"),
        left("do"),
        left("starts at"),
        left("lasts"),
        left("gimbals then: alpha, beta, gamma [deg]"),
        left("X_p, Y_p, Z_p should read [g]"),
        left("time, readings"),
        left("done"),
    ];
    // readings are compared once at each position, before the recording
    let waited = |s: &Step| s.kind == StepKind::Record && p.settle_s > 0.0;
    let row = |s: &Step| -> Vec<String> {
        let force = s.force_g.filter(|_| !waited(s));
        let blank = if force.is_some() { "\u{a0}".repeat(24) } else { String::new() };
        let force = force.map_or_else(String::new, |f| {
            let within = s.tolerance_g.map_or_else(String::new, |t| format!(" +- {t:.3}"));
            format!("{}{within}", f.map(|x| format!("{x:+.4}")).join(", "))
        });
        let lasts = if s.duration_s > 0.0 { clock(s.duration_s) } else { String::new() };
        let gimbals = angles(p, &s.gimbals_deg);
        vec![
            s.number.to_string(),
            instruction(p, s),
            clock(s.start_s),
            lasts,
            gimbals,
            force,
            blank,
            "[ ]".into(),
        ]
    };
    DocumentBlock::table("", columns, p.steps.iter().map(row))
}

fn obstacle(o: &Obstacle) -> String {
    let name = &o.position;
    match (o.kind, &o.gimbal) {
        (ObstacleKind::Stop, Some(gimbal)) => format!(
            "{name}: {gimbal} stops at {} deg, after {} deg of the turn",
            optional(o.at_deg),
            optional(o.after_deg)
        ),
        (ObstacleKind::Stop, None) if o.after_deg == Some(0.0) => format!(
            "{name}: the position before stands at the gimbal lock (beta {} deg), from which this turn about one \
             axis does not lead; path = \"gimbals\" turns gimbal by gimbal",
            optional(o.at_deg)
        ),
        (ObstacleKind::Stop, None) => format!(
            "{name}: beta reaches {} deg after {} deg of the turn, where alpha and gamma cannot follow",
            optional(o.at_deg),
            optional(o.after_deg)
        ),
        (ObstacleKind::Limits, _) => format!("{name}: its gimbal angles lie beyond the limits"),
        (ObstacleKind::Elsewhere, _) => {
            format!(
                "{name}: the path gimbal by gimbal starts at other gimbal angles than the gimbals stand at"
            )
        }
        (ObstacleKind::Misses, _) => format!("{name}: the stated turn does not lead there"),
    }
}

fn after(p: &Procedure) -> DocumentBlock {
    let columns = [
        left("after"),
        left("at"),
        left("requirements met"),
        left("determined from here"),
        left("requirement met from here"),
    ];
    let stated = p.requirements.stated;
    let all = |list: &[String]| match list.is_empty() {
        true => "-".into(),
        false => names(list.iter().map(String::as_str)),
    };
    let judged = p.after.len() > 1 || p.coefficients.iter().any(|c| c.determined_from.is_some());
    let rows = p.after.iter().map(|a| {
        let met = if stated == 0 { "-".into() } else { format!("{} of {stated}", a.met) };
        let [determines, meets] = match judged {
            true => [all(&a.determines), all(&a.meets)],
            false => ["not judged (more than 100 positions)"; 2].map(String::from),
        };
        vec![a.position.clone(), clock(a.end_s), met, determines, meets]
    });
    DocumentBlock::table("", columns, rows)
}

fn coefficients(p: &Procedure) -> DocumentBlock {
    let columns = [
        left("coefficient"),
        left("unit"),
        right("uncertainty at the end"),
        right("required"),
        left("determined from"),
        left("met from"),
    ];
    let name = |of: &Option<String>| of.clone().unwrap_or_else(|| "-".into());
    let rows = p.coefficients.iter().map(|c| {
        vec![
            c.name.clone(),
            c.unit.clone(),
            optional(c.uncertainty),
            optional(c.required),
            name(&c.determined_from),
            name(&c.met_from),
        ]
    });
    DocumentBlock::table("Coefficients", columns, rows)
}

/// Positions that are needed for requirements, in a sentence; `None` if none is met at the end.
fn needed(p: &Procedure) -> Option<String> {
    let mut parts: Vec<String> = Vec::new();
    for a in p.after.iter().filter(|a| !a.meets.is_empty()) {
        parts.push(format!("from {} on: {}", a.position, names(a.meets.iter().map(String::as_str))));
    }
    let last = p.after.iter().rposition(|a| !a.meets.is_empty())?;
    let spare: Vec<&str> = p.after[last + 1..].iter().map(|a| a.position.as_str()).collect();
    let spare = match spare.is_empty() || !p.requirements.all_met() {
        true => String::new(),
        false => format!(
            "; no requirement needs {} (to end before, delete its [[position]] in scheme.toml)",
            names(spare)
        ),
    };
    (p.requirements.stated > 0).then(|| format!("requirements are met {}{spare}", parts.join("; ")))
}

fn sentences(p: &Procedure) -> Vec<String> {
    let positions = p.steps.iter().map(|s| &s.position).collect::<std::collections::BTreeSet<_>>().len();
    let many = if positions == 1 { "position" } else { "positions" };
    let turns = if p.timed_turns { "" } else { ", without the time of the turns (no slew rate is stated)" };
    let mut out = vec![format!("{} steps, {positions} {many}, {}{turns}", p.steps.len(), clock(p.total_s))];
    if !p.executable {
        let all: Vec<String> = p.obstacles.iter().map(obstacle).collect();
        out.insert(0, format!("NOT executable from these gimbal angles: {}", all.join("; ")));
    }
    out.push(stated::capital(&stated::requirements(&p.requirements)));
    out.extend(p.acceptance.as_ref().and_then(acceptance::impossible).map(|text| stated::capital(&text)));
    out.extend(needed(p).map(|text| stated::capital(&text)));
    out
}

/// Basis of the tolerances, in sentences.
fn tolerance(p: &Procedure) -> Vec<String> {
    let t = &p.tolerance;
    let parts = [
        (t.by_values, "the tilt that the stated values give by then (linear model)"),
        (t.by_priors, "three sigma of the tilt by the stated priors"),
        (t.by_noise, "three sigma of the tilt by the stated random drift"),
        (t.accelerometers_g > 0.0, "the stated errors of the accelerometers"),
    ];
    let parts: Vec<&str> = parts.into_iter().filter(|p| p.0).map(|p| p.1).collect();
    let drift = match parts.is_empty() {
        true => "; no drift, since neither values, priors nor random drift are stated".into(),
        false => format!(", {}", parts.join(", ")),
    };
    let mut out = vec![
        "Stop at a reading outside its tolerance: the attitude, a sign or the order of the axes is wrong."
            .into(),
        format!("The tolerance allows a tilt of {} deg and the noise{drift}.", short(t.tilt_deg)),
    ];
    if !t.not_counted.is_empty() {
        let all = names(t.not_counted.iter().map(String::as_str));
        out.push(format!("Not in the tolerance: the errors {all} of the bench."));
    }
    if !t.wide.is_empty() {
        out.push(format!(
            "At {} the tolerance is above 0.25 g: a reading inside it does not exclude a wrong attitude.",
            names(t.wide.iter().map(String::as_str))
        ));
    }
    out
}

/// Entries of the title block, and lines for signatures.
fn title_block(block: &TitleBlock) -> Option<DocumentBlock> {
    let entries = block.entries();
    let stated: Vec<TableColumn> = entries
        .iter()
        .map(|(name, _)| left(*name))
        .chain(block.signatures.iter().map(|role| left(format!("{role}: name, date, signature"))))
        .collect();
    let texts = entries.iter().map(|(_, text)| text.to_string());
    let row: Vec<String> = texts.chain(block.signatures.iter().map(|_| "\u{a0}".repeat(44))).collect();
    (!stated.is_empty()).then(|| DocumentBlock::table("", stated, [row]))
}

fn rotations(p: &Procedure) -> Option<DocumentBlock> {
    let columns = [
        right("k"),
        left("Ux, Uy, Uz"),
        right("angle [deg]"),
        right("T [s]"),
        right("T0 [s]"),
        right("T1 [s]"),
    ];
    let rows = p.rotations.iter().map(|r| {
        let numbers = [r.angle_deg, r.rotate_s, r.before_s, r.after_s].map(short);
        [vec![r.number.to_string(), r.axis.map(short).join(", ")], numbers.to_vec()].concat()
    });
    let heading = "Rotation table (axes right, front, up of PSINS are Z_p, X_p, Y_p)";
    (!p.rotations.is_empty()).then(|| DocumentBlock::table(heading, columns, rows))
}

/// Rules for the platform between the steps.
fn platform(p: &Procedure) -> String {
    let [north, up] = p.earth_rate_dph.map(|w| format!("{w:.4}"));
    let latitude = p.conditions.latitude_deg;
    let torque = format!(
        "Torque the platform by the rate of the earth at {latitude} deg throughout: {north} deg/h about North, {up} \
         deg/h about Up"
    );
    match p.carry {
        Carry::Inertial => format!("{torque}. Do not level or align it again between the positions."),
        Carry::Platform => format!(
            "{torque}. Platform carry assumes that the misalignment stays in platform axes from position to \
             position, as in the paper; a platform that is torqued from one to the next has inertial carry."
        ),
        Carry::Reset => format!("{torque}. Level and align the platform again at every position."),
    }
}

/// Rules for the platform, the record and the readings.
fn rules(p: &Procedure) -> Vec<String> {
    let mut out = vec![platform(p)];
    out.push(
        "Turns are right-handed about their axes. The gimbal angles alpha, beta, gamma are those of C_c^n = \
         Mx(alpha) My(beta) Mz(gamma): they grow in left-handed turns."
            .into(),
    );
    out.push(
        "Record t [s], position, fx [g], fy [g], fz [g]: the outputs of the accelerometers in platform axes. \
         Label every row from arrival to departure. Leave the position empty only while the platform turns."
            .into(),
    );
    if p.settle_s > 0.0 {
        out.push(format!(
            "`calibrate` leaves out the first {} s of each position (settle in scheme.toml); the uncertainties \
             count the time behind them only.",
            short(p.settle_s)
        ));
    }
    if p.timed_turns && p.steps.iter().any(|s| s.turn.is_some()) {
        out.push(
            "Turn at the stated rates. When late, stay at the position, go on recording, and note the time; before \
             `calibrate`, state the true dwell (dwell_s of the position in scheme.toml)."
                .into(),
        );
    } else if !p.timed_turns {
        out.push(
            "Times do not count the turns (no slew rate is stated): begin each dwell on arrival.".into(),
        );
    }
    out.extend(winding(p));
    out.extend(tolerance(p));
    out
}

/// Gimbals without limits that wind up beyond half a turn; `None` if none does.
fn winding(p: &Procedure) -> Option<String> {
    let largest = |k: usize| {
        p.steps.iter().map(|s| s.gimbals_deg[k]).fold(0.0, |m: f64, x| if x.abs() > m.abs() { x } else { m })
    };
    let wound = (0..3).filter(|&k| p.free_gimbals[k]).map(|k| (GIMBAL_NAMES[k], largest(k)));
    let wound = wound.filter(|(_, x)| x.abs() > 180.0);
    let all: Vec<String> = wound.map(|(name, x)| format!("{name} to {} deg", short(x))).collect();
    (!all.is_empty()).then(|| {
        format!(
            "Gimbals without limits wind up: {}. Angles are printed from -180 to 180 deg.",
            all.join(", ")
        )
    })
}

/// Headings of the steps, and of what is known when.
const STEPS: &str = "Steps";
const KNOWN: &str = "Known after each position";

impl Answer for Procedure {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let named = if self.name.is_empty() { String::new() } else { format!(": {}", self.name) };
        let mut blocks: Vec<DocumentBlock> = title_block(&self.document).into_iter().collect();
        let section = |title: &str| DocumentBlock::Section { level: 1, title: title.into() };
        blocks.extend([section("Rules"), DocumentBlock::list("", rules(self)), section(STEPS), steps(self)]);
        blocks.extend([section(KNOWN), after(self), coefficients(self)]);
        if let Some(a) = &self.acceptance {
            blocks.extend([
                section("Acceptance"),
                acceptance::table("", a),
                DocumentBlock::list("Decision rule", acceptance::rule(a)),
            ]);
        }
        if let Some(table) = rotations(self) {
            blocks.push(DocumentBlock::fold(1, "Rotation table", vec![table]));
        }
        let mut conditions = vec![stated::carry(self.carry).into(), stated::predicted(&self.conditions)];
        conditions.extend(stated::measurement(&self.conditions));
        conditions.extend(stated::by_default(&self.conditions));
        blocks.push(DocumentBlock::fold(1, "Conditions", vec![DocumentBlock::list("", conditions)]));
        Document {
            title: format!("Procedure{named}"),
            lead: sentences(self).into_iter().map(|s| format!("{s}.")).collect(),
            blocks,
        }
    }

    fn sentences(&self) -> Vec<String> {
        sentences(self)
    }

    fn main_table(&self) -> &'static str {
        "steps"
    }
}

/// Steps as CSV for a controller: a row for every step.
///
/// # Errors
/// [`ReportError::Csv`].
pub fn steps_csv(p: &Procedure) -> Result<String, ReportError> {
    let header = "step,kind,position,start [s],duration [s],alpha [deg],beta [deg],gamma [deg],gimbal,about N,\
                  about U,about E,about X_p,about Y_p,about Z_p,angle [deg],rate [deg/s],\
                  alpha rate [deg/s],beta rate [deg/s],gamma rate [deg/s],fx [g],fy [g],fz [g],tolerance [g]";
    let text = |x: f64| ((x * 1e9).round() / 1e9 + 0.0).to_string();
    let row = |s: &Step| -> Vec<String> {
        let kind = serde_json::to_value(s.kind).ok().and_then(|k| k.as_str().map(String::from));
        let three =
            |of: Option<[f64; 3]>| of.map_or_else(|| vec![String::new(); 3], |v| v.map(text).to_vec());
        let one = |of: Option<f64>| of.map_or_else(String::new, text);
        let t = s.turn.as_ref();
        let mut out = vec![s.number.to_string(), kind.unwrap_or_default(), s.position.clone()];
        out.extend([s.start_s, s.duration_s].map(text));
        out.extend(s.gimbals_deg.map(text));
        out.push(t.and_then(|t| t.gimbal.clone()).unwrap_or_default());
        out.extend(three(t.map(|t| t.about)));
        out.extend(three(t.map(|t| t.about_platform)));
        out.push(one(t.map(|t| t.angle_deg)));
        out.push(one(t.and_then(|t| t.rate_deg_s)));
        out.extend(three(t.and_then(|t| t.gimbal_rates_deg_s)));
        out.extend(three(s.force_g));
        out.push(one(s.tolerance_g));
        out
    };
    let header = header.split(',').map(String::from).collect::<Vec<_>>();
    csv_text::write(std::iter::once(header).chain(p.steps.iter().map(row)))
}

/// Page of a sheet, with pictures of its positions.
///
/// # Errors
/// [`ReportError::Page`].
pub fn procedure_page(p: &Procedure, scheme: &Scheme) -> Result<File, ReportError> {
    let mut document = p.document();
    // with the gimbal angles of the sheet
    let mut drawn = scheme.clone();
    for position in &mut drawn.positions {
        let at = p.steps.iter().find(|s| s.position == position.name && s.force_g.is_some());
        if let Some(Ok(angles)) = at.map(|s| parse_attitude(&angles(p, &s.gimbals_deg).replace(' ', ""))) {
            position.angles = angles;
        }
    }
    let (poses, latitude) = (drawn.poses(), p.conditions.latitude_deg);
    let picture = Picture {
        name: "positions".into(),
        caption: poses::caption(&poses, latitude, p.conditions.latitude_by_default),
        drawing: Drawing::Panels(poses::panels(&poses, latitude)),
    };
    let known = |b: &DocumentBlock| matches!(b, DocumentBlock::Section { title, .. } if title == KNOWN);
    let at = document.blocks.iter().position(known).unwrap_or(document.blocks.len());
    document.blocks.insert(at, DocumentBlock::Picture(picture));
    Ok(File::new("procedure.html", html::page(&document, &p.version)?))
}

/// Header of the record of a sheet, to be filled by the logger.
pub fn record_header(p: &Procedure) -> String {
    let name = if p.name.is_empty() { "a scheme".into() } else { crate::visible(&p.name).into_owned() };
    let mut labels: Vec<String> = p.steps.iter().map(|s| crate::visible(&s.position).into_owned()).collect();
    labels.dedup();
    format!(
        "# record of {name}; position: {}, empty while the platform turns\n\
         t [s],position,fx [g],fy [g],fz [g]\n",
        labels.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_the_day() {
        assert_eq!([0.0, 59.96, 90.5, 3_725.0].map(clock), ["0:00:00", "0:01:00", "0:01:30.5", "1:02:05"]);
    }

    #[test]
    fn axes_of_the_platform() {
        assert_eq!(platform_axis(&[0.0, -1.0, 0.0]), "-Y_p");
        assert_eq!(platform_axis(&[0.6, 0.0, 0.8]), "(0.6, 0, 0.8)");
    }
}

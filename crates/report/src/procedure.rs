//! Sheet of a run: the page of the crew, and the tables of a controller.

use obsdeg_core::model::Scheme;
use obsdeg_core::title_block::TitleBlock;
use obsdeg_design::procedure::{Obstacle, ObstacleKind, Procedure, Step, StepKind, StepTurn};

use crate::document::{Block, Column, Document, Drawing, Picture, left, optional, right, short};
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

/// Turn of a step: `90 deg about N (X_p)`.
fn turn(t: &StepTurn) -> String {
    let angle = (t.angle_deg * 1000.0).round() / 1000.0;
    let rate = t.rate_deg_s.map_or_else(String::new, |r| format!(" at {} deg/s", short(r)));
    format!("{angle} deg about {} = {}{rate}", words::direction(&t.about), platform_axis(&t.about_platform))
}

/// Instruction of a step.
fn instruction(s: &Step) -> String {
    match (s.kind, &s.turn) {
        (StepKind::Set, _) => "Set the gimbals. Level and align the platform.".into(),
        (StepKind::Wait, _) => "Wait for rest.".into(),
        (StepKind::Record, _) => format!("Record. Label: {}.", s.position),
        (StepKind::Rotate, Some(t)) => format!("Record. Label: {}. Turn {} meanwhile.", s.position, turn(t)),
        (StepKind::Turn, Some(StepTurn { gimbal: Some(gimbal), .. })) => {
            let t = s.turn.as_ref().map(turn).unwrap_or_default();
            format!("Turn gimbal {gimbal}: {t}.")
        }
        (StepKind::Turn, Some(t)) => format!("Turn {}.", turn(t)),
        (StepKind::Turn | StepKind::Rotate, None) => String::new(),
    }
}

fn angles(of: &[f64; 3]) -> String {
    of.map(short).join(", ")
}

fn steps(p: &Procedure) -> Block {
    let columns = [
        right("step"),
        left("from the start"),
        left("for"),
        left("position"),
        left("do"),
        left("then gimbals alpha, beta, gamma [deg]"),
        left("accelerometers X_p, Y_p, Z_p read [g]"),
        left("done"),
    ];
    // readings are checked once at each position, before the recording
    let waited = |s: &Step| s.kind == StepKind::Record && p.settle_s > 0.0;
    let row = |s: &Step| -> Vec<String> {
        let force = s.force_g.filter(|_| !waited(s)).map_or_else(String::new, |f| {
            let within = s.tolerance_g.map_or_else(String::new, |t| format!(" +- {t:.3}"));
            format!("{}{within}", f.map(|x| format!("{x:+.4}")).join(", "))
        });
        let lasts = if s.duration_s > 0.0 { clock(s.duration_s) } else { String::new() };
        vec![
            s.number.to_string(),
            clock(s.start_s),
            lasts,
            s.position.clone(),
            instruction(s),
            angles(&s.gimbals_deg),
            force,
            "[ ]".into(),
        ]
    };
    Block::table("Steps", columns, p.steps.iter().map(row))
}

fn obstacle(o: &Obstacle) -> String {
    let name = &o.position;
    match (o.kind, &o.gimbal) {
        (ObstacleKind::Stop, Some(gimbal)) => format!(
            "{name}: {gimbal} stops at {} deg, after {} deg of the turn",
            optional(o.at_deg),
            optional(o.after_deg)
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

fn after(p: &Procedure) -> Block {
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
    let rows = p.after.iter().map(|a| {
        let met = if stated == 0 { "-".into() } else { format!("{} of {stated}", a.met) };
        vec![a.position.clone(), clock(a.end_s), met, all(&a.determines), all(&a.meets)]
    });
    Block::table("Known after each position", columns, rows)
}

fn coefficients(p: &Procedure) -> Block {
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
    Block::table("Coefficients", columns, rows)
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
        false => format!("; no requirement needs {}", names(spare)),
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
        out.insert(0, format!("NOT executable by the gimbals: {}", all.join("; ")));
    }
    out.push(stated::capital(&stated::requirements(&p.requirements)));
    out.extend(needed(p).map(|text| stated::capital(&text)));
    out
}

/// Basis of the tolerances, in words.
fn tolerance(p: &Procedure) -> String {
    let t = &p.tolerance;
    let more = match (t.by_values, t.by_priors) {
        (false, false) => "; no drift is stated (values or priors under [simulation]), so none is added",
        (true, false) => ", with the tilt that the stated values give by then",
        (false, true) => ", with three sigma of the tilt by the stated priors",
        (true, true) => ", with the tilt by the stated values and three sigma of that by the priors",
    };
    format!(
        "a reading outside its tolerance means a wrong attitude, a wrong sign or exchanged axes: stop. The \
         tolerance allows a tilt of {} deg{more}, and the noise",
        short(t.tilt_deg)
    )
}

/// Entries of the title block, and lines for signatures.
fn title_block(block: &TitleBlock) -> Option<Block> {
    let entries = block.entries();
    let stated: Vec<Column> = entries
        .iter()
        .map(|(name, _)| left(*name))
        .chain(block.signatures.iter().map(|role| left(format!("{role}: name, date, signature"))))
        .collect();
    let texts = entries.iter().map(|(_, text)| text.to_string());
    let row: Vec<String> = texts.chain(block.signatures.iter().map(|_| "\u{a0}".repeat(44))).collect();
    (!stated.is_empty()).then(|| Block::table("", stated, [row]))
}

fn rotations(p: &Procedure) -> Option<Block> {
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
    (!p.rotations.is_empty()).then(|| Block::table(heading, columns, rows))
}

/// Rules for the record and the readings.
fn rules(p: &Procedure) -> Vec<String> {
    let mut out = vec![
        "record t [s], position, fx [g], fy [g], fz [g]: the outputs of the accelerometers in platform axes. \
         Leave the position empty while the platform turns or waits"
            .into(),
        tolerance(p),
    ];
    if p.settle_s > 0.0 {
        out.push(format!(
            "each dwell begins with {} s at rest that are not recorded; the uncertainties count the recorded \
             time only",
            short(p.settle_s)
        ));
    }
    if !p.timed_turns {
        out.push("times do not count the turns: state the slew rate, or begin each dwell on arrival".into());
    }
    if p.conditions.slew_rate_deg_s.is_some() {
        out.push("turn at the stated rates: what the turns take is part of the model".into());
    }
    out
}

impl Answer for Procedure {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let named = if self.name.is_empty() { String::new() } else { format!(": {}", self.name) };
        let mut blocks: Vec<Block> = title_block(&self.document).into_iter().collect();
        blocks.push(steps(self));
        blocks.push(Block::list("Rules", rules(self)));
        blocks.push(after(self));
        blocks.push(coefficients(self));
        if let Some(a) = &self.acceptance {
            blocks.push(acceptance::table(a));
            blocks.push(Block::list("Decision rule", acceptance::rule(a)));
        }
        blocks.extend(rotations(self));
        let mut conditions = vec![stated::carry(self.carry).into(), stated::predicted(&self.conditions)];
        conditions.extend(stated::measurement(&self.conditions));
        conditions.extend(stated::by_default(&self.conditions));
        blocks.push(Block::list("Conditions", conditions));
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
                  about U,about E,about X_p,about Y_p,about Z_p,angle [deg],rate [deg/s],fx [g],fy [g],fz [g],\
                  tolerance [g]";
    let text = |x: f64| x.to_string();
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
    let (poses, latitude) = (scheme.poses(), p.conditions.latitude_deg);
    let picture = Picture {
        name: "positions".into(),
        caption: poses::caption(&poses, latitude, p.conditions.latitude_by_default),
        drawing: Drawing::Panels(poses::panels(&poses, latitude)),
    };
    document.blocks.push(Block::Picture(picture));
    Ok(File::new("procedure.html", html::page(&document, &p.version)?))
}

/// Header of the record of a sheet, to be filled by the logger.
pub fn record_header(p: &Procedure) -> String {
    let name = if p.name.is_empty() { "a scheme".into() } else { crate::visible(&p.name).into_owned() };
    let labels: Vec<String> = p.after.iter().map(|a| crate::visible(&a.position).into_owned()).collect();
    format!(
        "# record of {name}; position: {}, empty while the platform turns or waits\n\
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

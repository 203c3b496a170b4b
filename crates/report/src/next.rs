//! Answers on the next positions of a scheme.

use obsdeg_design::next::{AddedPosition, Extension, NextPositions, Requalification, Standing};

use crate::Answer;
use crate::document::{Document, DocumentBlock, left, number, right};
use crate::stated;
use crate::words::{self, names};

/// Added positions in words: `USE`, `USE then NWU`, each with the axis of a half turn.
fn listed(positions: &[AddedPosition]) -> String {
    let one = |p: &AddedPosition| match &p.half_turn_about {
        Some(about) => format!("{} (half turn about {})", p.candidate, words::direction(about)),
        None => p.candidate.clone(),
    };
    positions.iter().map(one).collect::<Vec<_>>().join(" then ")
}

fn positions(e: &Extension) -> String {
    listed(&e.positions)
}

/// Changes by an extension, in words.
fn gains(n: &NextPositions, e: &Extension) -> Vec<String> {
    let list = |all: &[obsdeg_core::remedies::Resolved]| {
        let one = |r: &obsdeg_core::remedies::Resolved| format!("{} (degree {})", r.name, r.degree);
        let all: Vec<String> = all.iter().map(one).collect();
        names(all.iter().map(String::as_str))
    };
    let mut out = Vec::new();
    // degrees are those of repositioning at once, sigmas those with the slews
    let is_open = |name: &String| e.then.not_observable.contains(name);
    let is_resolved = |name: &String| e.resolves.iter().any(|r| r.name == *name);
    let (open, resolved): (Vec<_>, Vec<_>) = e.resolves.iter().cloned().partition(|r| is_open(&r.name));
    if !resolved.is_empty() && n.before.is_some() {
        out.push(format!("makes {} observable", list(&resolved)));
    }
    if !open.is_empty() && n.before.is_some() {
        out.push(format!(
            "makes {} observable by repositioning at once, but not with the slews",
            list(&open)
        ));
    }
    if let Some(before) = &n.before {
        let by_slews = |name: &&String| !is_open(name) && !is_resolved(name);
        let shown: Vec<&str> = before.not_observable.iter().filter(by_slews).map(String::as_str).collect();
        if !shown.is_empty() && !n.after_calibration {
            out.push(format!(
                "determines {} by what the slews show (degrees are of repositioning at once)",
                names(shown)
            ));
        }
    }
    if !e.lowers.is_empty() {
        out.push(format!("lowers the degree of {}", list(&e.lowers)));
    }
    let left: Vec<&str> =
        e.then.not_observable.iter().filter(|name| !is_resolved(name)).map(String::as_str).collect();
    if !left.is_empty() {
        out.push(format!("leaves {} undetermined", names(left)));
    }
    out
}

fn sentences(n: &NextPositions) -> Vec<String> {
    let Some(first) = n.found.first() else { return Vec::new() };
    let more = gains(n, first);
    let more = if more.is_empty() { String::new() } else { format!(": this {}", more.join(", ")) };
    let met = n.before.as_ref().is_some_and(|b| b.requirements.stated > 0 && b.requirements.all_met());
    let mut out: Vec<String> = Vec::new();
    out.extend(met.then(|| "Every requirement is met without a further position".into()));
    let add = if met { "Most is gained by" } else { "Add" };
    out.push(format!("{add} {}{more}", positions(first)));
    if first.then.requirements.stated > 0 {
        out.push(stated::capital(&stated::requirements(&first.then.requirements)));
    }
    match &n.meets {
        Some(m) if first.then.requirements.all_met() => out.push(format!(
            "Every requirement is met from {} s at each added position on, {} s in all",
            m.dwell_s,
            number(m.total_s)
        )),
        Some(m) => out.push(format!(
            "Dwell {} s at each added position to meet every requirement: {} s in all",
            m.dwell_s,
            number(m.total_s)
        )),
        None if first.then.requirements.stated > 0 => {
            let longest = 16.0 * n.conditions.dwell_s;
            out.push(format!(
                "No dwell up to {} s at each added position meets every requirement",
                number(longest)
            ));
        }
        None => {}
    }
    out
}

fn standing(s: &Standing) -> Vec<String> {
    vec![
        words::degree(s.worst_degree),
        s.not_observable.len().to_string(),
        s.worst.as_ref().map_or_else(|| "-".into(), stated::worst_sigma),
        s.requirements
            .worst
            .as_ref()
            .map_or_else(|| "-".into(), |w| format!("{} ({})", number(w.margin), w.name)),
        number(s.total_s),
    ]
}

/// Requalification after each number of days.
fn schedule(n: &NextPositions) -> Option<DocumentBlock> {
    let columns = [
        right("days"),
        left("smallest margin before"),
        right("fewest positions"),
        left("positions"),
        left("quickest"),
        right("dwell [s]"),
        right("time [s]"),
    ];
    let row = |r: &Requalification| {
        let margin = r.before.requirements.worst.as_ref();
        let fewest = r.fewest.map_or_else(|| format!("more than {}", n.added), |k| k.to_string());
        let quickest = r.quickest.as_ref();
        vec![
            r.days.to_string(),
            margin.map_or_else(|| "-".into(), |w| format!("{} ({})", number(w.margin), w.name)),
            fewest,
            r.best.as_ref().map_or_else(|| "-".into(), |e| listed(&e.positions)),
            quickest.map_or_else(|| "-".into(), |q| listed(&q.positions)),
            quickest.map_or_else(|| "-".into(), |q| number(q.dwell_s)),
            quickest.map_or_else(|| "-".into(), |q| number(q.total_s)),
        ]
    };
    let rows: Vec<Vec<String>> = n.schedule.iter().map(row).collect();
    (!rows.is_empty())
        .then(|| DocumentBlock::table("Requalification by days since the calibration", columns, rows))
}

fn validity(n: &NextPositions) -> Vec<String> {
    let what = if n.added == 1 { "extension" } else { "ordered pair" };
    let mut out = vec![match n.proven {
        true => format!(
            "every {what} by the {} candidates was compared ({}): the first is the best of these",
            n.candidates.len(),
            n.examined
        ),
        false => format!("interrupted after {} extensions: another one may be better", n.examined),
    }];
    out.extend(of_all_attitudes(n));
    if n.as_good > 1 {
        out.push(format!("{} extensions are as good as the first", n.as_good));
    }
    if let Some(days) = n.days {
        let walk = n.ageing.iter().map(|(name, q)| format!("{name} {q}")).collect::<Vec<_>>().join(", ");
        out.push(format!(
            "{days} days after the calibration; random walk per sqrt(day), in the units of the coefficients: {walk}"
        ));
    }
    if !n.unused_ageing.is_empty() {
        out.push(format!("no coefficients of this scheme, no ageing: {}", n.unused_ageing.join(", ")));
    }
    if !n.schedule.is_empty() {
        out.push(
            "fewest positions and shortest runs: every extension was compared, with one dwell at all \
             positions of a run"
                .into(),
        );
    }
    if n.after_calibration {
        out.push(
            "the added positions are a separate run after the calibration, with a psi of its own".into(),
        );
    }
    out.push(format!("a verdict on an extension is {}; seed {}", words::wrong_below(n.error_bound), n.seed));
    if !n.not_judged.is_empty() {
        out.push(format!("not judged: requirements on {}", names(n.not_judged.iter().map(String::as_str))));
    }
    if !n.beyond_gimbals.is_empty() {
        out.push(format!("beyond the gimbals: {}", names(n.beyond_gimbals.iter().map(String::as_str))));
    }
    out
}

/// Sentences on the bound over all attitudes.
fn of_all_attitudes(n: &NextPositions) -> Vec<String> {
    let Some(bound) = &n.bound else { return Vec::new() };
    let dwell = number(n.conditions.dwell_s);
    let margin = bound.ratio.map(|ratio| {
        format!(
            "no attitude, candidate or not, gives a smallest margin above {} with a dwell of {dwell} s",
            number(1.0 / ratio)
        )
    });
    let sigma = bound.worst_dph.map(|worst| {
        format!(
            "no attitude, candidate or not, gives a worst sigma below {} deg/h (per g) with a dwell of {dwell} s",
            number(worst)
        )
    });
    margin.into_iter().chain(sigma).collect()
}

impl Answer for NextPositions {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let total = self.found.first().map_or("worst sigma", |e| stated::worst(&e.then.requirements));
        let columns = [
            left("added"),
            right("worst degree"),
            right("undetermined"),
            left(total),
            left("smallest margin"),
            right("time [s]"),
        ];
        let row = |(name, s): (String, &Standing)| [vec![name], standing(s)].concat();
        let before = self.before.as_ref().map(|s| row(("nothing".into(), s)));
        let rows = self.found.iter().map(|e| row((positions(e), &e.then)));
        let extensions =
            DocumentBlock::table("Extensions, best first", columns, before.into_iter().chain(rows));
        let mut blocks: Vec<DocumentBlock> = schedule(self).into_iter().chain([extensions]).collect();
        blocks.push(DocumentBlock::list("Validity", validity(self)));
        blocks.push(DocumentBlock::list("Conditions", stated::measurement(&self.conditions)));
        let after = match (self.after_calibration, self.positions.len()) {
            (true, _) => "a calibration".into(),
            (false, k @ 0..=6) => format!("{k} positions ({})", self.positions.join(", ")),
            (false, k) => format!("{k} positions"),
        };
        let what = if self.added == 1 { "The next position" } else { "The next two positions" };
        Document {
            title: format!("{what} after {after}, {} carry", self.carry),
            lead: sentences(self).into_iter().map(|s| format!("{s}.")).collect(),
            blocks,
        }
    }

    fn sentences(&self) -> Vec<String> {
        sentences(self)
    }

    fn main_table(&self) -> &'static str {
        "found"
    }
}

//! Documents and figures of found schemes.

mod bounds;
mod searched;
mod terms;

use obsdeg_design::design::{BiasPoint, Certificate, Design, Found, SearchReport};

use crate::document::{Document, DocumentBlock, left, number, right};
use crate::figure::{BLACK, BLUE, Curve, Figure, FigureError, Stroke};
use crate::figures::{File, picture};
use crate::{Answer, gimbals, omitted, stated, words};
use bounds::{bound, fewest, minimum};
use searched::{by_parts, how};
use terms::{candidates, dwells, margin, route, shortened, unit};

/// First lines: the first scheme and its requirements, then the carry and the conditions that are not stated.
fn lead(d: &Design) -> Vec<String> {
    let mut out = Vec::new();
    if let (Some(s), Some(first)) = (&d.search, d.found.first()) {
        let best = match s.proven && !first.refined && first.dwells_s.is_empty() {
            true if by_parts(s).is_some() => "Best, proven if the parts were searched as they state,",
            true => "Proven best of these candidates",
            false => "Best found",
        };
        let sigma = first.worst_sigma_dph.zip(first.worst.as_ref());
        let sigma = sigma.map_or_else(String::new, |(sigma, name)| {
            format!(": {} {}", stated::worst(&first.requirements), stated::sigma_of(name, sigma))
        });
        // a scheme with a smaller criterion and a larger worst degree comes later
        let first_by = if s.degree_floor.is_some() { "worst degree, then " } else { "" };
        let by = format!("{best} by {first_by}the criterion {}", s.criterion);
        out.push(format!("{by}: {}{sigma}; {}.", route(first), stated::requirements(&first.requirements)));
        let met = first.requirements.all_met();
        out.extend(d.omitted.as_ref().and_then(|o| omitted::lead(o, first.requirements.with_bench, met)));
        out.extend(s.ranked.map(|n| {
            format!(
                "The search does not count what is not estimated under these conditions: the {n} schemes of \
                 least sigma were ranked by their total uncertainty. No bound and no proof counts, and a \
                 scheme with a larger sigma may have a smaller total."
            )
        }));
        if first.requirements.any_missed() {
            let margin =
                if s.criterion == "margin" { "" } else { "--criterion margin seeks the largest margin; " };
            out.push(format!("Next: {margin}--meet says what would meet every requirement"));
        }
    }
    if d.search.is_none() {
        out.push(fewest(d));
    }
    if !d.not_judged.is_empty() {
        let names = words::names(d.not_judged.iter().map(String::as_str));
        out.push(format!(
            "not judged, since --observable does not ask for them: the requirements on {names}"
        ));
    }
    out.extend(gimbals::lead(d.gimbals.as_ref()));
    out.push(stated::carry(d.carry).into());
    out.extend(stated::other_carries(&d.other_carries));
    out.extend(d.search.as_ref().and_then(|s| stated::by_default(&s.conditions)));
    out
}

fn table(heading: &str, found: &[Found]) -> DocumentBlock {
    let row = |(i, f): (usize, &Found)| {
        let image = f.image_of.map_or_else(String::new, |of| format!(" (image of {of})"));
        vec![
            (i + 1).to_string(),
            format!("{}{}{}{image}", route(f), if f.refined { " (refined)" } else { "" }, dwells(f)),
            number(f.total_s),
            f.worst_degree.to_string(),
            f.worst_accuracy_order.map_or_else(|| "-".into(), |o| o.to_string()),
            number(f.value),
            f.worst_sigma_dph
                .zip(f.worst.as_ref())
                .map_or_else(|| "-".into(), |(sigma, name)| format!("{} ({name})", number(sigma))),
            margin(&f.requirements),
            format!("{} of {}", f.rank[0], f.rank[1]),
        ]
    };
    DocumentBlock::table(
        heading,
        [
            right(""),
            left("positions in order"),
            right("total [s]"),
            right("degree"),
            right("accuracy"),
            right("criterion"),
            left("worst sigma [deg/h, /g]"),
            left("worst margin"),
            right("rank by derivatives"),
        ],
        found.iter().enumerate().map(row),
    )
}

/// Gimbal angles that the operator sets at each position of a scheme.
fn gimbal_angles(f: &Found) -> DocumentBlock {
    let columns =
        [left(""), left("position")].into_iter().chain(gimbals::NAMES.map(right)).collect::<Vec<_>>();
    let row = |(i, (name, angles)): (usize, (&String, &String))| {
        let set = angles.split(',').map(String::from);
        [format!("p{}", i + 1), name.clone()].into_iter().chain(set).collect::<Vec<_>>()
    };
    let rows = f.positions.iter().zip(&f.angles).enumerate().map(row);
    DocumentBlock::table("Gimbal angles of the first [deg]", columns, rows)
}

/// Conditions of the sigmas, one sentence each.
fn conditions(d: &Design, s: &SearchReport) -> Vec<String> {
    let c = &s.conditions;
    let slews = c.slew_rate_deg_s.map_or_else(
        || "repositioning at once".into(),
        |r| format!("slews at {r} deg/s about the eigenaxis, Z not used meanwhile"),
    );
    let azimuth = c.azimuth_noise_deg.map_or_else(String::new, |a| format!(", azimuth {a:e} deg per sample"));
    let bias = c.accelerometer_bias.as_ref();
    let bias = bias.map_or_else(String::new, |b| format!(", {}, counted", words::run::accelerometer_bias(b)));
    let none = |what: &Option<String>| what.clone().unwrap_or_else(|| "none".into());
    vec![
        format!(
            "{} s at each position, steps of at most {} s, a sample after each; {slews}",
            c.dwell_s, c.step_s
        ),
        format!(
            "noise of Z {:e} g per sample and axis{azimuth}{bias}; random drift: {}; prior: {}",
            c.accelerometer_noise_g,
            none(&s.drift_noise),
            s.prior.as_ref().map_or_else(
                || "none".into(),
                |p| format!(
                    "{p} (deg, deg/h, ... as stated; counted in sigmas and the bound, not in what is \
                     observable)"
                )
            )
        ),
        format!(
            "estimated together: psi and all coefficients of the terms {}; {}",
            d.terms,
            words::assumptions::gyros(&d.geometry)
        ),
    ]
}

/// Front of sigma against bias; `None` if the search counts no bench.
fn bias_front(d: &Design, s: &SearchReport) -> Option<DocumentBlock> {
    let row = |p: &BiasPoint| vec![p.positions.join(" "), number(p.sigma), number(p.bias), number(p.total)];
    let unit = s.unit.as_ref().map_or_else(|| "over what is required".into(), |u| format!("in {u}"));
    let how = match d.bias_front_complete {
        true => "of all sequences",
        false => "by exchange with other sizes of the bench, not proven",
    };
    // the largest sigma and the largest bias of the best scheme may belong to different coefficients
    let best = d.found.first().filter(|f| !d.bias_front.iter().any(|p| p.positions == f.positions));
    let best = best.map_or("", |_| "; the best by the total is not on it");
    let heading = format!(
        "Front of sigma against bias by the bench: criterion {} of each and of the total, {unit} ({how}{best})",
        s.criterion
    );
    let columns = [left("positions"), right("sigma"), right("bias"), right("total")];
    (!d.bias_front.is_empty()).then(|| DocumentBlock::table(heading, columns, d.bias_front.iter().map(row)))
}

impl Answer for Design {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let mut blocks = Vec::new();
        if let Some(s) = &self.search {
            let judged = self.found.first().is_some_and(|f| f.requirements.stated > 0);
            let left_out: &[&str] = if judged { &[] } else { &["worst margin"] };
            let heading = format!("Best schemes ({})", stated::predicted(&s.conditions));
            blocks.push(table(&heading, &self.found).without(left_out));
            blocks.extend(self.found.first().map(gimbal_angles));
            blocks.extend(gimbals::block(self.gimbals.as_ref()));
            blocks.extend(self.omitted.iter().flat_map(|o| omitted::blocks(o, " by the first scheme")));
            blocks.extend(bias_front(self, s));
            blocks.push(DocumentBlock::list("How", how(self, s)));
            blocks.push(DocumentBlock::list("How good the best can be", bound(self, s)));
            blocks.push(
                table(
                    "Front of total time against the criterion (other dwells by exchange, not proven)",
                    &self.front,
                )
                .without(left_out),
            );
        }
        blocks.push(DocumentBlock::list(
            "Fewest positions that make every required coefficient observable",
            minimum(self),
        ));
        let by = if self.latitude_by_default { " (chosen here: nothing names one)" } else { "" };
        let mut assumed =
            vec![format!("{} carry, latitude {} deg{by}; seed {}", self.carry, self.latitude_deg, self.seed)];
        match &self.search {
            Some(s) => assumed.extend(conditions(self, s)),
            None => {
                assumed.push(format!("terms {}; {}", self.terms, words::assumptions::gyros(&self.geometry)))
            }
        }
        assumed.push(format!("required: {}", self.required.join(", ")));
        assumed.push(candidates(&self.candidates));
        if !self.beyond_gimbals.is_empty() {
            assumed.push(format!("beyond the gimbal limits: {}", shortened(&self.beyond_gimbals)));
        }
        assumed.push(format!(
        "ranks of sets modulo {} random 61-bit primes: an observable set is overlooked with probability below {}",
        self.primes, words::at_most(self.error_bound)
    ));
        blocks.push(DocumentBlock::list("Assumed", assumed));
        let what = self.search.as_ref().map_or_else(
            || "fewest positions".into(),
            |s| format!("{} of {} positions", s.positions, self.candidates.len()),
        );
        Document { title: format!("Design: {what}, {} carry", self.carry), lead: lead(self), blocks }
    }

    fn sentences(&self) -> Vec<String> {
        lead(self)
    }

    fn main_table(&self) -> &'static str {
        if self.found.is_empty() { "answer" } else { "found" }
    }
}

/// Lower bound of the criterion over total time.
pub(crate) fn bound_line(bound: &[[f64; 2]]) -> Curve {
    Curve {
        label: "no scheme of the candidates in equal dwells is below".into(),
        color: BLACK,
        stroke: Stroke::Dashed,
        points: bound_steps(bound),
    }
}

/// Steps of a bound: between two times the bound of the longer holds, since more time is never worse.
pub(crate) fn bound_steps(bound: &[[f64; 2]]) -> Vec<(f64, f64)> {
    let steps = bound.windows(2).flat_map(|w| [(w[0][0], w[0][1]), (w[0][0], w[1][1])]);
    steps.chain(bound.last().map(|p| (p[0], p[1]))).collect()
}

/// Front of total time against the criterion; empty without a search.
pub(crate) fn figures(d: &Design) -> Result<Vec<File>, FigureError> {
    let Some(search) = d.search.as_ref().filter(|_| !d.front.is_empty()) else { return Ok(Vec::new()) };
    // lines per number of positions, and the front itself as steps
    let steps = d.front.windows(2).flat_map(|w| [(w[0].total_s, w[0].value), (w[1].total_s, w[0].value)]);
    let last = d.front.last().map(|f| (f.total_s, f.value));
    let quantity = match search.conditions.bench {
        Some(_) => "largest total uncertainty",
        None => "largest sigma",
    };
    let label = match search.criterion.as_str() {
        "margin" => format!("{quantity} over requirement"),
        "worst" => format!("{quantity}{}", unit(search)),
        other => format!("{other}-criterion{}", unit(search)),
    };
    let slews =
        search.conditions.slew_rate_deg_s.map_or_else(String::new, |r| format!(", slews at {r} deg/s"));
    let ends = |of: fn(&Found) -> f64| {
        let (low, high) = d.front.iter().map(of).fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        Some((low / 1.3, high * 1.3))
    };
    let bound = search.certificate.as_ref().map_or(&[][..], |c: &Certificate| &c.front);
    let lowest = bound.iter().map(|p| p[1]).fold(f64::MAX, f64::min) / 1.3;
    let figure = Figure {
        title: format!("What total time buys{slews}"),
        x_label: "total time [s]".into(),
        y_label: label,
        x_range: ends(|f| f.total_s),
        y_range: ends(|f| f.value).map(|(low, high)| (low.min(lowest), high)),
        lines: std::iter::once(Curve {
            label: if bound.is_empty() { String::new() } else { "best found".into() },
            color: BLUE,
            stroke: Stroke::Solid,
            points: steps.chain(last).collect(),
        })
        .chain((!bound.is_empty()).then(|| bound_line(bound)))
        .collect(),
        log: true,
        ..Figure::default()
    };
    Ok(picture("front", figure.svg())?.into())
}

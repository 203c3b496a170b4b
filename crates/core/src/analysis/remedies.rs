//! Remedies of a scheme: known values, one or two more cardinal attitudes, another carry.

use obsdeg_exact::{Echelon, Field};

use super::CarryReport;
use crate::degree::ensemble::{Verdicts, degrees, filtration, judge};
use crate::degree::filtration::Degrees;
use crate::degree::findings::Findings;
use crate::model::attitude::{cardinal, cardinal_names};
use crate::model::platform::{Platform, RandomValues};
use crate::model::{Position, Scheme, Unknowns};
use crate::remedies::{CandidateInformation, Change, Directions, Remedies, Remedy, Resolved};

/// Largest number of unknowns of a scheme to which attitudes are added: each of the 24 costs as much as half
/// a verdict.
const MOST_UNKNOWNS: usize = 120;
/// Largest number of values tried as known.
const MOST_KNOWN: usize = 64;
/// Largest number of pairs that the engine judges.
const MOST_PAIRS: usize = 12;

/// Bases of `V_0, V_1, ...` in the two fields of a verdict.
pub(super) type Spans = [Vec<Echelon>; 2];

/// Search for remedies of one scheme.
struct SchemeRemedySearch<'a> {
    platform: &'a Platform,
    verdicts: &'a Verdicts,
    seed: u64,
    /// Unknowns that are not observable.
    open: Vec<usize>,
    spans: Spans,
    out: Remedies,
}

/// A scheme with one more attitude, in the first field of the verdict.
struct AttitudeCandidate {
    attitude: String,
    degrees: Vec<Option<usize>>,
    /// Rows of the attitude in the unobservable directions; `None` where the two schemes share no random
    /// values.
    information: Option<CandidateInformation<Field>>,
}

/// Remedies of a judged scheme. At most `MOST_KNOWN` values, 24 attitudes and `MOST_PAIRS` pairs of each
/// kind are tried.
pub(super) fn remedies(
    platform: &Platform,
    verdicts: &Verdicts,
    findings: &Findings,
    carries: &[CarryReport],
) -> Remedies {
    let open: Vec<usize> =
        (0..platform.names().len()).filter(|&c| findings.degrees.degree[c].is_none()).collect();
    if open.is_empty() {
        return Remedies::default();
    }
    let spans = spans(platform, &verdicts.values);
    let field = verdicts.values[0].roots().field;
    let none = Echelon::new(field, platform.names().len());
    let directions = Directions::of(field, spans[0].last().unwrap_or(&none));
    let out = Remedies::default();
    let mut search = SchemeRemedySearch { platform, verdicts, seed: findings.seed, open, spans, out };
    search.known(&directions);
    let candidates = search.attitudes(&directions);
    search.carries(carries);
    search.two(&directions, candidates);
    let open = search.open.iter().map(|&c| platform.names()[c].clone());
    search.out.close(open);
    search.out
}

/// A scheme with more cardinal attitudes at its end; `None` where a name is no cardinal attitude.
pub(super) fn with_attitudes(scheme: &Scheme, attitudes: &[&str]) -> Option<Scheme> {
    let mut out = scheme.clone();
    for attitude in attitudes {
        out.positions.push(Position {
            name: scheme.free_name(out.positions.len() + 1),
            angles: cardinal(attitude)?,
            dwell: None,
            rotation: None,
            slew: None,
        });
    }
    Some(out)
}

/// The bases of a scheme in both fields.
pub(super) fn spans(platform: &Platform, values: &[RandomValues; 2]) -> Spans {
    [0, 1].map(|i| filtration(platform, &values[i].sample(platform.scheme(), 1)).1)
}

/// Degrees of all unknowns where the values of some are known; `None` where two fields do not agree.
pub(super) fn degrees_knowing(spans: &Spans, known: &[usize]) -> Option<Vec<Option<usize>>> {
    let of = |spans: &Vec<Echelon>| {
        let columns = spans.first().map_or(0, Echelon::columns);
        let mut degree = vec![None; columns];
        for (order, space) in spans.iter().enumerate() {
            let mut space = space.clone();
            for &c in known {
                let mut unit = vec![0; columns];
                unit[c] = space.field().one();
                space.insert(&unit);
            }
            for (c, degree) in degree.iter_mut().enumerate().filter(|(_, d)| d.is_none()) {
                *degree = space.has_unit(c).then_some(order);
            }
        }
        degree
    };
    let [first, second] = [of(&spans[0]), of(&spans[1])];
    (first == second).then_some(first)
}

/// Entries of the rows of a longer scheme in the unobservable directions; `places` are the columns of this
/// scheme's unknowns. Unknowns of the new position alone are eliminated.
fn added(directions: &Directions<Field>, space: &Echelon, places: &[usize]) -> CandidateInformation<Field> {
    let own: Vec<usize> = (0..space.columns()).filter(|k| !places.contains(k)).collect();
    let field = space.field();
    let mut shared = Echelon::new(field, space.columns());
    for i in 0..space.rank() {
        let row = space.row(i);
        let order = own.iter().chain(places).map(|&k| row[k]);
        shared.insert(&order.collect::<Vec<_>>());
    }
    let beyond = shared.pivots().enumerate().filter(|(_, pivot)| *pivot >= own.len());
    directions.rows(beyond.map(|(i, _)| &shared.row(i)[own.len()..]))
}

impl SchemeRemedySearch<'_> {
    fn name(&self, c: usize) -> String {
        self.platform.names()[c].clone()
    }

    /// Unknowns without a remedy so far.
    fn left(&self) -> Vec<usize> {
        let left = |c: &usize| !self.out.resolves(&self.platform.names()[*c]);
        self.open.iter().copied().filter(left).collect()
    }

    /// Records the verdicts on a changed scheme, by the names of its unknowns. Returns the unknowns that the
    /// changes resolve.
    fn enter(&mut self, changes: Vec<Change>, names: &[String], degrees: &[Option<usize>]) -> Vec<usize> {
        self.out.verdicts += 1;
        let given = |name: &str| changes.iter().any(|c| c.known() == Some(name));
        let degree = |c: usize| {
            let name = &self.platform.names()[c];
            names.iter().position(|n| n == name).and_then(|k| degrees[k]).filter(|_| !given(name))
        };
        let found: Vec<(usize, usize)> =
            self.open.iter().filter_map(|&c| degree(c).map(|degree| (c, degree))).collect();
        let resolves: Vec<Resolved> =
            found.iter().map(|&(c, degree)| Resolved { name: self.name(c), degree }).collect();
        if !resolves.is_empty() {
            self.out.remedies.push(Remedy { changes, resolves, loses: Vec::new() });
        }
        found.into_iter().map(|(c, _)| c).collect()
    }

    fn value_of(&self, c: usize) -> Change {
        Change::Known { name: self.name(c) }
    }

    /// Tries each value as known, and keeps those that resolve another unknown.
    fn known(&mut self, directions: &Directions<Field>) {
        let others = |w: &usize| !directions.resolved(&directions.known(&[*w]), &self.open).is_empty();
        let mut candidates: Vec<usize> = self.open.iter().copied().filter(others).collect();
        if candidates.len() > MOST_KNOWN {
            let left = candidates.len() - MOST_KNOWN;
            self.out.not_tried.push(format!("{left} known values: at most {MOST_KNOWN} are tried"));
            candidates.truncate(MOST_KNOWN);
        }
        for w in candidates {
            if let Some(degrees) = degrees_knowing(&self.spans, &[w]) {
                let names = self.platform.names();
                self.enter(vec![self.value_of(w)], names, &degrees);
            }
        }
    }

    /// The platform of the scheme with more cardinal attitudes at its end; `None` where they cannot be added,
    /// for instance beyond a gimbal limit.
    fn with(&self, attitudes: &[&str]) -> Option<Platform> {
        Platform::new(with_attitudes(self.platform.scheme(), attitudes)?).ok()
    }

    fn attitude(&self, attitudes: &[&str]) -> Vec<Change> {
        let first = self.platform.scheme().positions.len();
        let change = |(k, a): (usize, &&str)| Change::Attitude {
            position: self.platform.scheme().free_name(first + k + 1),
            attitude: a.to_string(),
        };
        attitudes.iter().enumerate().map(change).collect()
    }

    /// Tries one more cardinal attitude: keeps the fewest of the 24 that together resolve most unknowns.
    fn attitudes(&mut self, directions: &Directions<Field>) -> Vec<AttitudeCandidate> {
        let n = self.platform.names().len();
        if self.platform.scheme().unknowns == Unknowns::Drift {
            return Vec::new();
        }
        if n > MOST_UNKNOWNS {
            self.out.not_tried.push(format!("more attitudes: {n} unknowns; at most {MOST_UNKNOWNS}"));
            return Vec::new();
        }
        let names = cardinal_names();
        let candidates: Vec<AttitudeCandidate> =
            names.iter().filter_map(|a| self.candidate(a, directions)).collect();
        let mut left = self.open.clone();
        let mut excluded = vec![false; candidates.len()];
        loop {
            let score = |k: usize| {
                let degrees = left.iter().filter_map(|&c| candidates[k].degrees[c]);
                (degrees.clone().count(), std::cmp::Reverse(degrees.sum::<usize>()), std::cmp::Reverse(k))
            };
            let best = (0..candidates.len()).filter(|&k| !excluded[k]).max_by_key(|&k| score(k));
            let Some(k) = best.filter(|&k| score(k).0 > 0) else { break };
            excluded[k] = true;
            let resolved = self.judge_attitudes(&[&candidates[k].attitude]);
            left.retain(|c| !resolved.contains(c));
        }
        candidates
    }

    /// Judges the scheme with more attitudes. Returns the unknowns that they resolve.
    fn judge_attitudes(&mut self, attitudes: &[&str]) -> Vec<usize> {
        let Some(platform) = self.with(attitudes) else { return Vec::new() };
        let Ok(Degrees { degree, .. }) = degrees(&platform, self.seed) else { return Vec::new() };
        self.enter(self.attitude(attitudes), platform.names(), &degree)
    }

    /// Degrees with one more attitude, in the first field.
    fn candidate(&self, attitude: &str, directions: &Directions<Field>) -> Option<AttitudeCandidate> {
        let platform = self.with(&[attitude])?;
        let scheme = platform.scheme();
        // with turns between positions or rates of rotations, each scheme draws its own random values
        let own = scheme.torquers_act() || scheme.by_history();
        let drawn;
        let values = match own {
            false => &self.verdicts.values[0],
            true => {
                drawn = RandomValues::draw(scheme, &mut scheme.random(self.seed, "remedies")).ok()?;
                &drawn
            }
        };
        let (found, spans) = filtration(&platform, &values.sample(scheme, 1));
        let names = self.platform.names();
        let place = |name: &String| platform.names().iter().position(|n| n == name);
        let places: Vec<usize> = names.iter().map(place).collect::<Option<_>>()?;
        let information = spans.last().filter(|_| !own).map(|space| added(directions, space, &places));
        Some(AttitudeCandidate {
            attitude: attitude.into(),
            degrees: places.iter().map(|&k| found.degree[k]).collect(),
            information,
        })
    }

    /// Tries the other carries, by the verdicts already found.
    fn carries(&mut self, carries: &[CarryReport]) {
        for report in carries {
            self.out.verdicts += 1;
            // psi of a position is an unknown only under reset carry
            let resolves = report.differs.iter().filter(|d| d.here.degree.is_none() && !d.name.contains('@'));
            let resolves: Vec<Resolved> = resolves
                .filter_map(|d| Some(Resolved { name: d.name.clone(), degree: d.there.degree? }))
                .collect();
            let lost = report.differs.iter().filter(|d| d.here.degree.is_some() && d.there.degree.is_none());
            let loses = lost.map(|d| d.name.clone()).collect();
            if !resolves.is_empty() {
                let changes = vec![Change::Carry { carry: report.carry }];
                self.out.remedies.push(Remedy { changes, resolves, loses });
            }
        }
    }

    /// Tries two changes for unknowns that no single one resolves: two attitudes, an attitude and a value,
    /// two values.
    fn two(&mut self, directions: &Directions<Field>, candidates: Vec<AttitudeCandidate>) {
        if candidates.iter().any(|c| c.information.is_none()) && !self.left().is_empty() {
            let text = "two changes with an attitude among them: the turn to it acts as well";
            self.out.not_tried.push(text.into());
        }
        let (names, attitudes): (Vec<String>, Vec<CandidateInformation<Field>>) =
            candidates.into_iter().filter_map(|c| Some((c.attitude, c.information?))).unzip();
        let values: Vec<CandidateInformation<Field>> =
            self.open.iter().map(|&w| directions.known(&[w])).collect();
        type List<'a> = &'a [CandidateInformation<Field>];
        let kinds: [(List<'_>, Option<List<'_>>); 3] =
            [(&attitudes, None), (&attitudes, Some(&values)), (&values, None)];
        let mut complete = true;
        for (kind, (left, right)) in kinds.into_iter().enumerate() {
            let mut work = MOST_PAIRS;
            complete &= directions.pairs(left, right, self.left(), |i, j| {
                work = work.checked_sub(1)?;
                Some(match kind {
                    0 => self.judge_attitudes(&[&names[i], &names[j]]),
                    1 => self.judge_attitude_and_value(&names[i], self.open[j]),
                    _ => self.judge_values([self.open[i], self.open[j]]),
                })
            });
        }
        if !complete {
            self.out
                .not_tried
                .push(format!("some pairs of changes: at most {MOST_PAIRS} of each kind are judged"));
        }
    }

    fn judge_attitude_and_value(&mut self, attitude: &str, known: usize) -> Vec<usize> {
        let Some(platform) = self.with(&[attitude]) else { return Vec::new() };
        let Ok(verdicts) = judge(&platform, self.seed) else { return Vec::new() };
        let name = self.name(known);
        let place = platform.names().iter().position(|n| *n == name);
        let spans = spans(&platform, &verdicts.values);
        let Some(degrees) = place.and_then(|k| degrees_knowing(&spans, &[k])) else { return Vec::new() };
        let mut changes = self.attitude(&[attitude]);
        changes.push(self.value_of(known));
        self.enter(changes, platform.names(), &degrees)
    }

    fn judge_values(&mut self, known: [usize; 2]) -> Vec<usize> {
        let Some(degrees) = degrees_knowing(&self.spans, &known) else { return Vec::new() };
        let names = self.platform.names();
        self.enter(known.map(|w| self.value_of(w)).into(), names, &degrees)
    }
}

//! Checks of a record by its specific force, before anything is estimated: the units of its numbers, its
//! direction at every position, and the times at which positions begin and end.

use obsdeg_core::model::Matrix3;
use obsdeg_core::model::slew::apply;
use obsdeg_core::span::Span;

use super::CalibrationError;
use super::clock;
use super::length::Length;
use super::mistaken::Mistaken;

/// Largest angle of the specific force of a position, in deg, from the vertical or, if psi continues in n,
/// from its direction at the end of the position before.
const TILT_DEG: f64 = 20.0;
/// Largest tilt if psi does not continue in n and the vertical moves by more than `TILT_DEG`: a multiple of
/// the summed moves of the vertical from half to half of the positions so far. Twice that sum is the move
/// over whole positions; azimuth may become tilt too. The limit holds even if another position is nearer.
const REACH: f64 = 4.0;
/// Largest move of the vertical by drift from one position to the next: this angle, in deg, plus `MOVES`
/// times the moves from half to half of the two positions.
const JUMP_DEG: f64 = 3.0;
const MOVES: f64 = 2.0;
/// Ratio of angles from which another position fits better.
const NEARER: f64 = 3.0;
/// Largest deviation of the force from 1 g, in g, with right units.
const UNIT: f64 = 0.1;
/// Largest deviation of the force from 1 g, in g, after a change of units.
const CLOSE: f64 = 0.05;
/// Largest relative deviation from 1 g that a scale error explains.
const GROSS: f64 = 0.2;
/// Most samples of a piece.
const MOST: usize = 50;
/// Number of samples at either end of a position that are pieces of their own.
const ALONE: usize = 8;
/// Fewest pieces of a position in which a turn is sought.
const FEWEST: usize = 20;
/// Largest move of the force of a platform at rest between two pieces: this angle in deg, plus a rate in
/// deg/s (a hundred deg/h), plus a multiple of the noise.
const HELD_DEG: f64 = 0.3;
const DRIFTS_DEG_S: f64 = 0.03;
const NOISE: f64 = 8.0;
/// Number of samples far from 1 g that are examined one by one.
const SUSPECTS: usize = 64;
/// Largest distance of a sample from its neighbours, in g; `ALONG` is that from the attitude of the scheme
/// where there are no neighbours.
const BESIDE: f64 = 0.03;
const ALONG: f64 = 0.35;
/// Factors for normal errors: sigma over the median of their sizes, and sigma of a median over that of a
/// mean.
const MEDIAN_TO_SIGMA: f64 = 1.4826;
const SIGMA_OF_MEDIAN: f64 = 1.2533;

/// Force of some consecutive samples, in platform axes: the median of each component.
#[derive(Debug, Clone)]
struct Piece {
    /// First and last line of the record.
    lines: Span<u64>,
    /// Time of its first sample, in s.
    t: f64,
    samples: usize,
    /// Median force in platform axes, in g.
    force: [f64; 3],
    /// Median of the lengths of the force, in g.
    length: f64,
}

/// Forces of a record, by position.
#[derive(Debug, Clone)]
pub(crate) struct Forces {
    /// Longest duration of a piece, in s.
    longest: f64,
    now: Vec<(u64, f64, [f64; 3])>,
    /// Index of the position of the samples in `now`, and the number `seen` of its samples.
    position: usize,
    seen: usize,
    pieces: Vec<Vec<Piece>>,
    /// Known variances of the lengths, by position: their sum and number.
    variances: Vec<(f64, usize)>,
    /// First samples far from 1 g: position, line, force.
    suspects: Vec<(usize, u64, [f64; 3])>,
}

/// Column of the force: its text, and the assumed value of one of its numbers, in g.
#[derive(Debug, Clone)]
pub(crate) struct ForceColumn {
    pub text: String,
    pub scale: f64,
}

/// Median of some numbers; zero for none.
fn median(of: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = of.collect();
    if all.is_empty() {
        return 0.0;
    }
    let middle = all.len() / 2;
    *all.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn length(f: &[f64; 3]) -> f64 {
    f.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Angle between two directions, in deg.
fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    (dot / (length(a) * length(b))).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Angle of a force in platform axes from the vertical at the attitude `c`, in deg.
fn tilt(c: &Matrix3<f64>, force: &[f64; 3]) -> f64 {
    angle(&apply(c, force), &[0.0, 1.0, 0.0])
}

impl Forces {
    /// Forces of a record of `positions` positions, in pieces of at most `longest` s.
    pub(crate) fn new(positions: usize, longest: f64) -> Self {
        let (pieces, variances) = (vec![Vec::new(); positions], vec![(0.0, 0); positions]);
        Self { longest, now: Vec::new(), position: 0, seen: 0, pieces, variances, suspects: Vec::new() }
    }

    /// Adds a sample of a position; the length of its force has the standard deviation `sigma`.
    pub(crate) fn push(&mut self, position: usize, line: u64, t: f64, force: [f64; 3], sigma: f64) {
        if position != self.position {
            self.end();
        }
        self.position = position;
        self.variances[position].0 += sigma * sigma;
        self.variances[position].1 += 1;
        if (length(&force) - 1.0).abs() > UNIT && self.suspects.len() < SUSPECTS {
            self.suspects.push((position, line, force));
        }
        let first = self.now.first().map(|(_, t, _)| *t);
        if self.now.len() == MOST || first.is_some_and(|first| t - first >= self.longest) {
            let now = std::mem::take(&mut self.now);
            self.piece(&now);
        }
        self.now.push((line, t, force));
        self.seen += 1;
        if self.seen <= ALONE {
            let now = std::mem::take(&mut self.now);
            self.piece(&now);
        }
    }

    /// Ends a position, or the record.
    pub(crate) fn end(&mut self) {
        for sample in std::mem::take(&mut self.now) {
            self.piece(&[sample]);
        }
        self.seen = 0;
    }

    fn piece(&mut self, of: &[(u64, f64, [f64; 3])]) {
        let (Some(first), Some(last)) = (of.first(), of.last()) else { return };
        self.pieces[self.position].push(Piece {
            lines: Span { from: first.0, to: last.0 },
            t: first.1,
            samples: of.len(),
            force: std::array::from_fn(|i| median(of.iter().map(|s| s.2[i]))),
            length: median(of.iter().map(|s| length(&s.2))),
        });
    }

    /// Removes the pieces of a position with any of these lines.
    pub(crate) fn leave_out(&mut self, position: usize, lines: Span<u64>) {
        self.pieces[position].retain(|piece| piece.lines.to < lines.from || lines.to < piece.lines.from);
    }

    /// Robust lengths of the force, by position. Their standard deviation is that of a median, from the known
    /// variances of the samples or from the scatter of the pieces, whichever is larger.
    pub(crate) fn lengths(&self) -> Vec<Option<Length>> {
        let mut out = vec![None; self.pieces.len()];
        for (p, _, force) in self.usual() {
            let (pieces, (sum, count)) = (&self.pieces[p], self.variances[p]);
            let length = median(pieces.iter().map(|x| x.length));
            let spread = MEDIAN_TO_SIGMA * median(pieces.iter().map(|x| (x.length - length).abs()));
            let known = sum.sqrt() / count.max(1) as f64;
            let sigma = SIGMA_OF_MEDIAN * known.max(spread / (pieces.len() as f64).sqrt());
            out[p] = Some(Length { length, sigma: sigma.max(f64::EPSILON), force });
        }
        out
    }

    /// Index, first line and median force of every position with samples.
    fn usual(&self) -> impl Iterator<Item = (usize, u64, [f64; 3])> + '_ {
        let of = |(p, pieces): (usize, &Vec<Piece>)| {
            let line = pieces.first()?.lines.from;
            Some((p, line, std::array::from_fn(|i| median(pieces.iter().map(|x| x.force[i])))))
        };
        self.pieces.iter().enumerate().filter_map(of)
    }

    /// Position whose force is farthest from 1 g: its index, first line, force and deviation in g.
    fn worst(&self) -> Option<(usize, u64, [f64; 3], f64)> {
        let off = |(p, line, f): (usize, u64, [f64; 3])| (p, line, f, (length(&f) - 1.0).abs());
        self.usual().map(off).max_by(|a, b| a.3.total_cmp(&b.3))
    }

    /// Checks that the numbers have the units of the header, first in whole columns, then in single rows.
    /// `units` have their values in g; for whole columns those of the other kind (forces or increments of
    /// velocity) are included.
    pub(crate) fn check_units(
        &self,
        record: &str,
        names: &[&str],
        attitudes: &[Matrix3<f64>],
        columns: Option<&[ForceColumn; 3]>,
        units: &[(&str, f64)],
        others: &[(&str, f64)],
    ) -> Result<(), Box<Mistaken>> {
        let all_units = [units, others].concat();
        let record = record.to_string();
        let all: Vec<[f64; 3]> = self.usual().map(|(.., f)| f).collect();
        let worst = self.worst().filter(|(.., off)| *off > UNIT);
        if let (Some((p, line, force, _)), Some(own)) = (worst, columns)
            && let Some((columns, units)) =
                other_units(&all, own, &all_units, &|f| (length(f) - 1.0).abs() <= CLOSE)
        {
            let (position, length_g) = (names[p].to_string(), format!("{:.4}", length(&force)));
            return Err(Box::new(Mistaken::ForceUnit { record, line, columns, position, length_g, units }));
        }
        let mut rows = self.suspects.iter().filter(|suspect| !self.has_code(suspect)).filter_map(|suspect| {
            let like = |f: &[f64; 3]| self.is_beside(suspect, f, attitudes);
            let (columns, units) = other_units(&[suspect.2], columns?, units, &like)?;
            Some((suspect.1, columns, units, format!("{:.4}", length(&suspect.2))))
        });
        if let Some((line, columns, units, length_g)) = rows.next() {
            let more = match rows.count() {
                0 => String::new(),
                n => format!(" (and so it is with {n} more rows at least)"),
            };
            return Err(Box::new(Mistaken::RowUnit { record, line, columns, length_g, units, more }));
        }
        match worst.filter(|(.., off)| *off > GROSS) {
            Some((p, line, force, _)) => Err(Box::new(Mistaken::ForceLength {
                record,
                line,
                position: names[p].into(),
                length_g: format!("{:.4}", length(&force)),
            })),
            None => Ok(()),
        }
    }

    /// True if a suspect has a component that is equal to the last digit at another position: a code of
    /// missing values, since forces differ from position to position.
    fn has_code(&self, &(p, _, force): &(usize, u64, [f64; 3])) -> bool {
        let mut others = self.suspects.iter().filter(|other| other.0 != p);
        others.any(|(_, _, other)| force.iter().zip(other).any(|(a, b)| a == b))
    }

    /// True if `force` agrees with the nearest samples of 1 g about a suspect in the record.
    fn is_beside(
        &self,
        &(p, line, _): &(usize, u64, [f64; 3]),
        force: &[f64; 3],
        attitudes: &[Matrix3<f64>],
    ) -> bool {
        let right = self.pieces[p].iter().filter(|x| (x.length - 1.0).abs() <= CLOSE);
        let nearest = right.min_by_key(|x| x.lines.from.abs_diff(line).min(x.lines.to.abs_diff(line)));
        let (beside, within) = nearest.map_or_else(
            // specific force of a platform at the attitude of the scheme
            || (attitudes[p][1], ALONG),
            |x| (x.force, BESIDE),
        );
        let off: [f64; 3] = std::array::from_fn(|i| force[i] - beside[i]);
        length(&off) <= within && (length(force) - 1.0).abs() <= CLOSE
    }

    /// Checks that the force of every position fits the scheme's attitude. A platform that drifts by degrees
    /// tilts more and more, but gradually. If psi continues in n (`inertial`), the vertical of a position
    /// begins where that of the one before ended.
    pub(crate) fn check_attitudes(
        &self,
        record: &str,
        names: &[&str],
        attitudes: &[Matrix3<f64>],
        inertial: bool,
    ) -> Result<(), CalibrationError> {
        const UP: [f64; 3] = [0.0, 1.0, 0.0];
        // for the position before: the vertical of its second half in n, and its move from the first half
        let mut before: Option<([f64; 3], f64)> = None;
        let mut moves = 0.0;
        for (p, line, _) in self.usual() {
            // medians, which single rows at the wrong position do not move
            let pieces = &self.pieces[p];
            let half = pieces.len().div_ceil(2);
            let usual = |of: &[Piece]| std::array::from_fn(|i| median(of.iter().map(|x| x.force[i])));
            let (first, last) = (usual(&pieces[..half]), usual(&pieces[pieces.len() - half..]));
            let moved = angle(&first, &last);
            let off = |q: usize| {
                let vertical = apply(&attitudes[q], &first);
                let jump = before.map_or(f64::INFINITY, |(v, _)| angle(&vertical, &v));
                jump.min(angle(&vertical, &UP))
            };
            let own = off(p);
            let nearest = (0..names.len()).map(off).fold(f64::INFINITY, f64::min);
            moves += moved;
            // drift from the middle of a half to that of the next makes half of both moves, since turns are
            // short beside positions: twice that is the limit
            let about = before.map(|(_, by)| by + moved);
            let held = about.map_or(f64::INFINITY, |by| JUMP_DEG + MOVES * by);
            let reach = about.map_or(JUMP_DEG + REACH * moves, |by| JUMP_DEG + by);
            let furthest = TILT_DEG.max(reach);
            // if psi does not continue in n, drift alone may bring another position nearer
            let least = if before.is_some() || reach < TILT_DEG { TILT_DEG.min(held) } else { furthest };
            let wrong = own > furthest || (own > least && own > NEARER * nearest);
            if !wrong {
                before = inertial.then(|| (apply(&attitudes[p], &last), moved));
                continue;
            }
            let near = |q: &usize| off(*q) <= TILT_DEG.min((NEARER * nearest).max(JUMP_DEG));
            let like: Vec<&str> = (0..names.len()).filter(near).map(|q| names[q]).collect();
            let like = if like.is_empty() { "no position of the scheme".into() } else { like.join(" or ") };
            return Err(CalibrationError::Attitude {
                record: record.into(),
                line,
                position: names[p].into(),
                off_deg: format!("{own:.1}"),
                like: format!("{like}{}", self.other_axes(attitudes).unwrap_or_default()),
            });
        }
        Ok(())
    }

    /// Permutation and signs of the axes with which every position fits the scheme; `None` unless exactly one
    /// does.
    fn other_axes(&self, attitudes: &[Matrix3<f64>]) -> Option<String> {
        const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        let all: Vec<(usize, [f64; 3])> = self.usual().map(|(p, _, force)| (p, force)).collect();
        let mut ways =
            ORDERS.iter().flat_map(|order| (0..8).map(move |signs| (order, signs))).filter(|way| {
                let (order, signs) = *way;
                let sign = |i: usize| if (signs >> i) & 1 == 1 { -1.0 } else { 1.0 };
                let turned = |force: &[f64; 3]| std::array::from_fn(|i| sign(i) * force[order[i]]);
                all.iter().all(|(p, force)| tilt(&attitudes[*p], &turned(force)) <= TILT_DEG)
            });
        let (order, signs) = ways.next().filter(|_| ways.next().is_none())?;
        if (*order, signs) == ([0, 1, 2], 0) {
            return None;
        }
        let name = |i: usize| {
            format!("{}{}", if (signs >> i) & 1 == 1 { "-" } else { "" }, ["fx", "fy", "fz"][order[i]])
        };
        let names = [0, 1, 2].map(name).join(", ");
        Some(format!(
            "; with {names} in the place of fx, fy, fz every position is where the scheme has it: axes or \
             signs are others than the header has"
        ))
    }

    /// Checks that the platform is at rest from the beginning to the end of every position. One sample is an
    /// outlier if bins have enough samples to leave it out, unless other positions have one too. `timeline`
    /// has the begins and ends of positions if no labels do.
    pub(crate) fn check_ends(
        &self,
        record: &str,
        names: &[&str],
        attitudes: &[Matrix3<f64>],
        timeline: Option<&[Span<f64>]>,
    ) -> Result<(), Box<Mistaken>> {
        let all: Vec<(usize, [f64; 3], [usize; 2])> =
            self.usual().map(|(p, _, force)| (p, force, away(&self.pieces[p], &force))).collect();
        for (side, begins) in [true, false].into_iter().enumerate() {
            let outer = |p: usize, count: usize| {
                let pieces = &self.pieces[p];
                if begins { &pieces[..count] } else { &pieces[pieces.len() - count..] }
            };
            let some: Vec<_> = all.iter().filter(|(_, _, away)| away[side] > 0).collect();
            let samples = |p: usize, count: usize| outer(p, count).iter().map(|x| x.samples).sum::<usize>();
            let Some(&&(p, force, away)) = some.iter().max_by_key(|(p, _, away)| samples(*p, away[side]))
            else {
                continue;
            };
            let dense =
                self.pieces[p].iter().filter(|x| x.samples > 1).all(|x| x.samples >= crate::bins::FEWEST);
            if dense && some.len() < 2 && samples(p, away[side]) < 2 {
                continue;
            }
            // sample farthest from the position, and the lines between which the platform arrives or leaves
            let (pieces, count) = (&self.pieces[p], away[side]);
            let first = pieces.len() - count;
            let (outer, from, to) = match begins {
                true => (&pieces[0], pieces[count - 1].lines.from, pieces[count].lines.to),
                false => (&pieces[pieces.len() - 1], pieces[first - 1].lines.from, pieces[first].lines.to),
            };
            let tilts = attitudes.iter().map(|c| tilt(c, &outer.force)).enumerate();
            let own = angle(&outer.force, &force);
            // at another position, and not merely on the way from it
            let like = tilts
                .filter(|(q, off)| *q != p && *off <= TILT_DEG && 3.0 * off < own)
                .min_by(|a, b| a.1.total_cmp(&b.1));
            return Err(Box::new(Mistaken::Shifted {
                record: record.into(),
                from,
                to,
                position: names[p].into(),
                what: if begins { "comes to rest at" } else { "leaves" },
                side: if begins { "before" } else { "after" },
                off_deg: format!("{own:.1}"),
                like: like.map_or_else(|| "no position (it turns)".into(), |(q, _)| names[q].into()),
                clock: timeline.and_then(|bounds| self.clock(&all, bounds)).unwrap_or_default(),
            }));
        }
        Ok(())
    }
}

impl Forces {
    /// Offset of the record's turns from those of the timeline, in words: a fast or slow clock, or a common
    /// delay; `None` if neither explains it.
    fn clock(&self, all: &[(usize, [f64; 3], [usize; 2])], bounds: &[Span<f64>]) -> Option<String> {
        let mut between: f64 = 0.0;
        let mut middle = |a: &Piece, b: &Piece| {
            between = between.max(b.t - a.t);
            (a.t + b.t) / 2.0
        };
        let turn = |pair: &[(usize, [f64; 3], [usize; 2])]| {
            let [(p, _, before), (q, _, after)] = pair else { return (0.0, 0.0) };
            let (left, come) = (&self.pieces[*p], &self.pieces[*q]);
            match (before[1], after[0]) {
                (0, 0) => (bounds[*p].to, bounds[*p].to),
                (0, late) => (bounds[*q].from, middle(&come[late - 1], &come[late])),
                (early, _) => {
                    let first = left.len() - early;
                    (bounds[*p].to, middle(&left[first - 1], &left[first]))
                }
            }
        };
        let points: Vec<(f64, f64)> = all.windows(2).map(turn).collect();
        let line = clock::line(&points)?;
        let whole = points.last()?.0 - points.first()?.0;
        if line.within > 1.5 * between {
            None
        } else if line.fast.abs() * whole > 2.0 * between {
            Some(format!("; all turns are where {} has them", clock::words(line.fast)))
        } else {
            Some(format!(
                "; all turns are {:+.1} s from where the timeline of the scheme has them",
                line.at_zero
            ))
        }
    }
}

/// Numbers of pieces at the beginning and at the end that do not continue steadily from the piece nearest to
/// the position's usual `force`.
fn away(pieces: &[Piece], force: &[f64; 3]) -> [usize; 2] {
    let off = |x: &Piece| angle(&x.force, force);
    let nearest = (0..pieces.len()).min_by(|a, b| off(&pieces[*a]).total_cmp(&off(&pieces[*b])));
    let Some(start) = nearest.filter(|_| pieces.len() >= FEWEST) else { return [0, 0] };
    // noise of the direction of one sample, from pieces of any size
    let spread = |w: &[Piece]| {
        let of = |x: &Piece| 1.0 / x.samples as f64;
        angle(&w[0].force, &w[1].force) / (of(&w[0]) + of(&w[1])).sqrt()
    };
    let noise = median(pieces.windows(2).map(spread));
    let run = |list: &mut dyn Iterator<Item = &Piece>| {
        let (mut good, mut count) = (&pieces[start], 0);
        for x in list {
            let most = HELD_DEG
                + DRIFTS_DEG_S * (x.t - good.t).abs()
                + NOISE * noise * (1.0 / x.samples as f64 + 1.0 / good.samples as f64).sqrt();
            if angle(&x.force, &good.force) > most {
                count += 1;
            } else {
                (good, count) = (x, 0);
            }
        }
        count
    };
    [run(&mut pieces[..start].iter().rev()), run(&mut pieces[start + 1..].iter())]
}

/// Columns in another unit, and that unit, with which all these forces are `right`. Of several choices the
/// one with the fewest columns wins, then the one with lengths nearest to 1 g.
fn other_units(
    all: &[[f64; 3]],
    own: &[ForceColumn; 3],
    units: &[(&str, f64)],
    right: &dyn Fn(&[f64; 3]) -> bool,
) -> Option<(String, String)> {
    // for every column its own unit, or another
    let choices: Vec<Option<usize>> = std::iter::once(None).chain((0..units.len()).map(Some)).collect();
    let mut found: Option<(usize, f64, [Option<usize>; 3])> = None;
    for code in 0..choices.len().pow(3) {
        let n = choices.len();
        let of = [choices[code % n], choices[code / n % n], choices[code / n / n]];
        let same = |j: usize| of[j].is_some_and(|u| (units[u].1 / own[j].scale - 1.0).abs() < 0.5);
        if (0..3).any(same) {
            continue;
        }
        let scaled = |f: &[f64; 3]| -> [f64; 3] {
            std::array::from_fn(|j| of[j].map_or(f[j], |u| f[j] * units[u].1 / own[j].scale))
        };
        let off = all.iter().map(|f| (length(&scaled(f)) - 1.0).abs()).fold(0.0, f64::max);
        let changed = of.iter().flatten().count();
        let better = found.as_ref().is_none_or(|(c, o, _)| (changed, off) < (*c, *o));
        if better && all.iter().all(|f| right(&scaled(f))) {
            found = Some((changed, off, of));
        }
    }
    let (_, _, of) = found?;
    let there = |j: &usize| of[*j].is_some();
    let columns: Vec<String> = (0..3).filter(there).map(|j| format!("`{}`", own[j].text)).collect();
    let mut names: Vec<&str> = of.iter().flatten().map(|u| units[*u].0).collect();
    names.dedup();
    let list = names.iter().map(|n| format!("[{n}]")).collect::<Vec<_>>();
    Some((columns.join(", "), list.join(", ")))
}

//! What the specific force says of a record before anything is estimated: whether its numbers are of the
//! units in the header, whether it points at every position where the scheme has it, and where a position
//! begins and ends.

use obsdeg_core::model::Matrix3;
use obsdeg_core::model::slew::apply;

use super::CalibrationError;
use super::clock;
use super::length::Length;
use super::mistaken::Mistaken;

/// The specific force of a position is no further than this from the vertical or, where psi goes on in n,
/// from where the position before left it, in deg.
const TILT_DEG: f64 = 20.0;
/// Largest tilt where psi does not go on in n and the vertical moves by more: so many times its
/// moves from half to half of all positions until then (twice that is the move of a whole position; azimuth,
/// too, may become tilt), whichever position is nearer.
const REACH: f64 = 4.0;
/// From one position to the next drift moves the vertical by less than this, in deg, beside so many times
/// what it moves it from half to half of the positions about the slew.
const JUMP_DEG: f64 = 3.0;
const MOVES: f64 = 2.0;
/// Another position fits better where it is nearer by this factor.
const NEARER: f64 = 3.0;
/// The force is within this of one g where its units are right.
const UNIT: f64 = 0.1;
/// With the right unit it is within this.
const CLOSE: f64 = 0.05;
/// Further off one g, as a part, is no scale error.
const GROSS: f64 = 0.2;
/// Most samples of a piece.
const MOST: usize = 50;
/// So many samples at the beginning of a position are pieces of their own, as are the last ones.
const ALONE: usize = 8;
/// Fewest pieces of a position in which a turn is sought.
const FEWEST: usize = 20;
/// From a piece to the next a platform that is held moves by no more than this, in deg, so much more in deg/s
/// (a hundred deg/h), and so many times what noise makes of it.
const HELD_DEG: f64 = 0.3;
const DRIFTS_DEG_S: f64 = 0.03;
const NOISE: f64 = 8.0;
/// So many samples that are far from one g are looked at one by one.
const SUSPECTS: usize = 64;
/// A sample is within this of those beside it, in g, or within this of the attitude of the scheme where there
/// are none.
const BESIDE: f64 = 0.03;
const ALONG: f64 = 0.35;
/// Of normal errors: sigma over the median of their sizes, and sigma of a median over that of a mean.
const MEDIAN_TO_SIGMA: f64 = 1.4826;
const SIGMA_OF_MEDIAN: f64 = 1.2533;

/// The force of some samples in a row, in platform axes: the median of each component.
#[derive(Debug, Clone)]
struct Piece {
    /// First and last line of the record.
    lines: (u64, u64),
    /// The time of its first sample, in s.
    t: f64,
    samples: usize,
    /// In g.
    force: [f64; 3],
    /// The median of its lengths, in g.
    length: f64,
}

/// The forces of a record, by position.
#[derive(Debug, Clone)]
pub(crate) struct Forces {
    /// Longest piece, in s.
    longest: f64,
    now: Vec<(u64, f64, [f64; 3])>,
    /// The position of these, and how many of its samples there were.
    position: usize,
    seen: usize,
    pieces: Vec<Vec<Piece>>,
    /// By position: the variances of the lengths as they are known, their sum and number.
    variances: Vec<(f64, usize)>,
    /// The first samples that are far from one g: position, line, force.
    suspects: Vec<(usize, u64, [f64; 3])>,
}

/// A column of the force: as it is written, and what one of its numbers was taken for, in g.
#[derive(Debug, Clone)]
pub(crate) struct ForceColumn {
    pub text: String,
    pub scale: f64,
}

/// The median of some numbers; zero of none.
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

/// The angle between two directions, in deg.
fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    (dot / (length(a) * length(b))).clamp(-1.0, 1.0).acos().to_degrees()
}

/// How far a force in platform axes is from the vertical where `C_c^n` is `c`, in deg.
fn tilt(c: &Matrix3<f64>, force: &[f64; 3]) -> f64 {
    angle(&apply(c, force), &[0.0, 1.0, 0.0])
}

impl Forces {
    /// Of a record of so many positions, in pieces of at most `longest` s.
    pub(crate) fn new(positions: usize, longest: f64) -> Self {
        let (pieces, variances) = (vec![Vec::new(); positions], vec![(0.0, 0); positions]);
        Self { longest, now: Vec::new(), position: 0, seen: 0, pieces, variances, suspects: Vec::new() }
    }

    /// Takes a sample of a position; the length of its force has the standard deviation `sigma`.
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

    /// The position, or the record, is over.
    pub(crate) fn end(&mut self) {
        for sample in std::mem::take(&mut self.now) {
            self.piece(&[sample]);
        }
        self.seen = 0;
    }

    fn piece(&mut self, of: &[(u64, f64, [f64; 3])]) {
        let (Some(first), Some(last)) = (of.first(), of.last()) else { return };
        self.pieces[self.position].push(Piece {
            lines: (first.0, last.0),
            t: first.1,
            samples: of.len(),
            force: std::array::from_fn(|i| median(of.iter().map(|s| s.2[i]))),
            length: median(of.iter().map(|s| length(&s.2))),
        });
    }

    /// Leaves out the piece of a position that is of these lines.
    pub(crate) fn leave_out(&mut self, position: usize, lines: (u64, u64)) {
        self.pieces[position].retain(|piece| piece.lines != lines);
    }

    /// By position: how long the force is, whatever single samples are. Its standard deviation is that of a
    /// median, by what is known of the samples and by how its pieces scatter, whichever is greater.
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

    /// Of every position that has samples: its first line and its force.
    fn usual(&self) -> impl Iterator<Item = (usize, u64, [f64; 3])> + '_ {
        let of = |(p, pieces): (usize, &Vec<Piece>)| {
            let line = pieces.first()?.lines.0;
            Some((p, line, std::array::from_fn(|i| median(pieces.iter().map(|x| x.force[i])))))
        };
        self.pieces.iter().enumerate().filter_map(of)
    }

    /// The position whose force is furthest from one g, with its first line and by how much.
    fn worst(&self) -> Option<(usize, u64, [f64; 3], f64)> {
        let off = |(p, line, f): (usize, u64, [f64; 3])| (p, line, f, (length(&f) - 1.0).abs());
        self.usual().map(off).max_by(|a, b| a.3.total_cmp(&b.3))
    }

    /// Refuses numbers that are of other units than the header has: whole columns, then single rows; `units`
    /// with what one of each is in g, those of the other kind (forces or increments of velocity) for whole
    /// columns.
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
        let mut rows = self.suspects.iter().filter_map(|suspect| {
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

    /// True if `force` is that of the samples of one g that are nearest to a suspect in the record.
    fn is_beside(
        &self,
        &(p, line, _): &(usize, u64, [f64; 3]),
        force: &[f64; 3],
        attitudes: &[Matrix3<f64>],
    ) -> bool {
        let right = self.pieces[p].iter().filter(|x| (x.length - 1.0).abs() <= CLOSE);
        let nearest = right.min_by_key(|x| x.lines.0.abs_diff(line).min(x.lines.1.abs_diff(line)));
        let (beside, within) = nearest.map_or_else(
            // the specific force of a platform that is where the scheme has it
            || (attitudes[p][1], ALONG),
            |x| (x.force, BESIDE),
        );
        let off: [f64; 3] = std::array::from_fn(|i| force[i] - beside[i]);
        length(&off) <= within && (length(force) - 1.0).abs() <= CLOSE
    }

    /// Refuses positions whose force is not that of the scheme's attitude. A platform that drifts by degrees
    /// tilts further and further, but not at once: where psi goes on in n (`inertial`), the vertical of a
    /// position begins where that of the one before ended.
    pub(crate) fn check_attitudes(
        &self,
        record: &str,
        names: &[&str],
        attitudes: &[Matrix3<f64>],
        inertial: bool,
    ) -> Result<(), CalibrationError> {
        const UP: [f64; 3] = [0.0, 1.0, 0.0];
        // of the position before: the vertical of its second half in n, and by how much it moved from the
        // first
        let mut before: Option<([f64; 3], f64)> = None;
        let mut moves = 0.0;
        for (p, line, _) in self.usual() {
            // medians, which rows at the wrong position do not move
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
            // from the middle of a half to that of the next drift makes half of both moves, and turns are
            // short beside positions: twice that is the furthest
            let about = before.map(|(_, by)| by + moved);
            let held = about.map_or(f64::INFINITY, |by| JUMP_DEG + MOVES * by);
            let reach = about.map_or(JUMP_DEG + REACH * moves, |by| JUMP_DEG + by);
            let furthest = TILT_DEG.max(reach);
            // where psi does not go on in n, another position may be nearer by drift alone
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

    /// The axes by which every position is where the scheme has it, where others in the place of these do
    /// that in one way only.
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
            "; with {names} in the place of fx, fy, fz every position is where the scheme has it: axes or signs are others than the header has"
        ))
    }

    /// Refuses positions at whose beginning or end the platform is not there yet, or no longer. One sample is
    /// an outlier where bins have so many that it is left out of them, unless other positions have one too.
    /// `timeline` says when positions begin and end, where that is all there is.
    pub(crate) fn check_ends(
        &self,
        record: &str,
        names: &[&str],
        attitudes: &[Matrix3<f64>],
        timeline: Option<&[(f64, f64)]>,
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
            // the sample furthest from the position, and the lines between which the platform comes or goes
            let (pieces, count) = (&self.pieces[p], away[side]);
            let first = pieces.len() - count;
            let (outer, from, to) = match begins {
                true => (&pieces[0], pieces[count - 1].lines.0, pieces[count].lines.1),
                false => (&pieces[pieces.len() - 1], pieces[first - 1].lines.0, pieces[first].lines.1),
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
    /// How the turns of the record lie beside those of the timeline: by a clock that is fast or slow, or all
    /// as late.
    fn clock(&self, all: &[(usize, [f64; 3], [usize; 2])], bounds: &[(f64, f64)]) -> Option<String> {
        let mut between: f64 = 0.0;
        let mut middle = |a: &Piece, b: &Piece| {
            between = between.max(b.t - a.t);
            (a.t + b.t) / 2.0
        };
        let turn = |pair: &[(usize, [f64; 3], [usize; 2])]| {
            let [(p, _, before), (q, _, after)] = pair else { return (0.0, 0.0) };
            let (left, come) = (&self.pieces[*p], &self.pieces[*q]);
            match (before[1], after[0]) {
                (0, 0) => (bounds[*p].1, bounds[*p].1),
                (0, late) => (bounds[*q].0, middle(&come[late - 1], &come[late])),
                (early, _) => {
                    let first = left.len() - early;
                    (bounds[*p].1, middle(&left[first - 1], &left[first]))
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

/// How many pieces at the beginning and at the end are away from where the position goes on steadily from the
/// piece that is nearest to its usual `force`.
fn away(pieces: &[Piece], force: &[f64; 3]) -> [usize; 2] {
    let off = |x: &Piece| angle(&x.force, force);
    let nearest = (0..pieces.len()).min_by(|a, b| off(&pieces[*a]).total_cmp(&off(&pieces[*b])));
    let Some(start) = nearest.filter(|_| pieces.len() >= FEWEST) else { return [0, 0] };
    // what noise makes of the direction of a sample, from pieces of any size
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

/// The columns whose numbers are of another unit, and that: with it all these forces are `right`. Of several
/// ways that with the fewest columns, then that with lengths nearest to one g.
fn other_units(
    all: &[[f64; 3]],
    own: &[ForceColumn; 3],
    units: &[(&str, f64)],
    right: &dyn Fn(&[f64; 3]) -> bool,
) -> Option<(String, String)> {
    // of every column its own unit, or another
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

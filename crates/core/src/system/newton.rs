//! Real points at which constraints hold, by Newton's method in many digits.

use obsdeg_exact::{Ball, RealSpace, Reals, RowSpace, Scalars, SplitMix64};

use super::dag::{Dag, Op};
use super::taylor::{Signal, Taylor};
use super::values::ConstraintFailure;
use super::work::{Work, WorkStep, product};

/// Number of steps of Newton's method from one start: near a point they double the digits.
const STEPS: usize = 80;
/// Number of successive slow steps near a point, of less than two bits of gain each, that end the search.
/// Near a point with independent gradients no step is slow. After so many steps the residual lies far below
/// its value where the constraints hold nowhere.
const SLOW: usize = 40;
/// Bits by which the residual after the slow steps is below the inverse fourth power of the size of the
/// point.
const DEEP: f64 = 24.0;
/// Largest length of the first slow step, as a power of two.
const SHORT: f64 = -8.0;
/// Bits by which the step from a point where the constraints hold must be shorter than the point's size.
const STILL: f64 = 32.0;
/// Largest number of terms into which a constraint is expanded as a sum.
const TERMS: usize = 64;
/// Relative residual, as a power of two, below which a point is near.
const NEAR: f64 = -16.0;
/// Logarithm of the ratio of sides from which a point counts as far.
const FAR: f64 = 0.5;
/// Smallest gain of that logarithm by a step from far away; a gain of half the logarithm suffices too.
const GAIN: f64 = 0.2;
/// Relative residual, as a power of two, below which a constraint holds at values of double precision.
const HELD: f64 = -40.0;
/// Relative change of a constraint, as a power of two, below which its gradient vanishes: change when the
/// point changes by its size, relative to the terms of the constraint.
const VANISHES: f64 = -16.0;
/// Bits by which a step may exceed the size of the point.
const LONGEST: f64 = 6.0;

/// Constraint as a sum of terms; true marks a subtracted term.
struct ConstraintSum {
    node: usize,
    terms: Vec<(bool, usize)>,
}

impl ConstraintSum {
    fn new(dag: &Dag, node: usize) -> Self {
        let (mut terms, mut open) = (Vec::new(), vec![(false, node)]);
        while let Some((minus, i)) = open.pop() {
            match dag.ops[i] {
                Op::Add(a, b) => open.extend([(minus, a), (minus, b)]),
                Op::Subtract(a, b) => open.extend([(minus, a), (!minus, b)]),
                _ => terms.push((minus, i)),
            }
            if terms.len() + open.len() > TERMS {
                return Self { node, terms: vec![(false, node)] };
            }
        }
        Self { node, terms }
    }

    /// Sums of the positive and of the negative terms at a point, with their derivatives by all `components`.
    fn sides<const N: usize>(
        &self,
        at: &Taylor<'_, Reals<N>>,
        components: usize,
    ) -> ([Ball<N>; 2], [Vec<Ball<N>>; 2]) {
        let mut sides = [Ball::ZERO; 2];
        let mut slopes = [vec![Ball::ZERO; components], vec![Ball::ZERO; components]];
        for &(minus, term) in &self.terms {
            let value = at.start(term).midpoint();
            // counted on the side on which it is positive
            let side = usize::from(minus != value.is_negative());
            sides[side] = sides[side].add(&if value.is_negative() { value.neg() } else { value });
            for (&component, x) in at.components_of(term).iter().zip(at.dual(term, 0)) {
                let x = if value.is_negative() { x.neg() } else { *x };
                slopes[side][component as usize] = slopes[side][component as usize].add(&x);
            }
        }
        (sides.map(|side| side.midpoint()), slopes)
    }
}

/// Constraints and their derivatives at a point.
struct Linear<const N: usize> {
    /// Rows of the constraints, in their order.
    rows: Vec<ConstraintRow<N>>,
    /// Largest residual relative to the terms of its constraint, as a power of two.
    off: f64,
    /// Index of the constraint with that residual.
    worst: usize,
    /// Largest residual relative to the change of its constraint when its slots change by their size, as a
    /// power of two.
    shift: f64,
    /// Largest residual, as a power of two.
    residual: f64,
    /// Distance from the constraints: the largest logarithm of a ratio of sides.
    far: f64,
    /// True if every residual is as small as the rounding of its terms.
    holds: bool,
}

impl<const N: usize> Linear<N> {
    /// Adds the next constraint; `here` are the values of the slots by which it is derived.
    fn add(&mut self, sum: &ConstraintSum, at: &Taylor<'_, Reals<N>>, here: &[Ball<N>]) {
        let (sides, slopes) = sum.sides(at, here.len());
        let row: Vec<Ball<N>> = slopes[0].iter().zip(&slopes[1]).map(|(a, b)| a.sub(b)).collect();
        let ratio = ratio(&sides, &slopes);
        // change of the constraint when its slots change by their size
        let change = row.iter().zip(here).map(|(slope, x)| slope.size_log2() + x.size_log2().max(0.0));
        let change = change.fold(f64::NEG_INFINITY, f64::max);
        // both sides of x*y = x*z decrease on the way to x = 0
        let scale = if ratio.is_some() { size(&sides).max(change) } else { change };
        let value = at.start(sum.node);
        let left = value.midpoint();
        self.shift = self.shift.max(left.size_log2() - change);
        self.residual = self.residual.max(left.size_log2());
        let off = if left.is_zero() { f64::NEG_INFINITY } else { left.size_log2() - scale };
        // rounding of the terms, and of their operands
        let bits = Ball::<N>::BITS as f64;
        let rounding = value.radius_log2().max(change - bits) - scale + 8.0;
        self.holds &= off <= rounding.min(-bits / 2.0).max(24.0 - bits);
        if off > self.off {
            (self.off, self.worst) = (off, self.rows.len());
        }
        self.far = self.far.max(ratio.as_ref().map_or(0.0, |(_, log)| log.to_f64().abs()));
        self.rows.push(ConstraintRow { sum: (row, left), ratio });
    }
}

/// One constraint at a point: derivatives and value of the sum of its terms. If it has terms of both signs,
/// also those of the logarithm of the ratio of the positive to the negative ones.
struct ConstraintRow<const N: usize> {
    sum: (Vec<Ball<N>>, Ball<N>),
    ratio: Option<(Vec<Ball<N>>, Ball<N>)>,
}

/// Constraints and free slots of Newton's steps.
struct Newton<'a> {
    dag: &'a Dag,
    sums: Vec<ConstraintSum>,
    places: Vec<usize>,
    work: &'a Work,
}

impl Newton<'_> {
    /// Constraints and their derivatives at a point; `None` if one is not defined, or beyond the limit of
    /// work.
    fn linear<const N: usize>(&self, values: &[Ball<N>]) -> Option<Linear<N>> {
        let at = self.series(values)?;
        // rank of the rows, their products, and the system of these
        let (rows, columns) = (self.sums.len() as u64, self.places.len() as u64);
        let pairs = rows.saturating_mul(rows).saturating_mul(rows.saturating_add(columns.saturating_mul(2)));
        self.work.take(WorkStep::Constraints, pairs.saturating_mul(product::<Ball<N>>()), 0).ok()?;
        let here: Vec<Ball<N>> = self.places.iter().map(|&s| values[s]).collect();
        let nothing = f64::NEG_INFINITY;
        let mut out = Linear {
            rows: Vec::new(),
            off: nothing,
            worst: 0,
            shift: nothing,
            residual: nothing,
            far: 0.0,
            holds: true,
        };
        self.sums.iter().for_each(|sum| out.add(sum, &at, &here));
        Some(out)
    }

    /// Values and derivatives of all terms at a point.
    fn series<const N: usize>(&self, values: &[Ball<N>]) -> Option<Taylor<'_, Reals<N>>> {
        let signal = |s: usize| Signal::Constant {
            value: values[s],
            component: self.places.iter().position(|place| *place == s),
        };
        let signals = (0..values.len()).map(signal).collect();
        let starts = vec![None; values.len()];
        let roots: Vec<usize> =
            self.sums.iter().flat_map(|s| s.terms.iter().map(|t| t.1).chain([s.node])).collect();
        let at = Taylor::new(
            self.dag,
            Reals::<N>,
            self.places.len(),
            signals,
            &starts,
            &roots,
            false,
            SplitMix64::new(0),
            self.work,
        );
        at.ok()
    }

    /// Shortest step `J' y` with `J J' y = -g` for independent rows J; if `by_ratio`, of the logarithms
    /// where they exist.
    fn step<const N: usize>(&self, linear: &Linear<N>, by_ratio: bool) -> Option<Vec<Ball<N>>> {
        let mut space = RealSpace::new(Reals, self.places.len());
        let mut rows: Vec<(Vec<Ball<N>>, Ball<N>)> = Vec::new();
        for row in &linear.rows {
            let (slopes, value) = row.ratio.as_ref().filter(|_| by_ratio).unwrap_or(&row.sum);
            if space.insert(slopes) {
                rows.push((slopes.iter().map(Ball::midpoint).collect(), *value));
            }
        }
        let dot = |a: &[Ball<N>], b: &[Ball<N>]| Reals.dot(&Ball::ZERO, a.iter().zip(b));
        let m = rows.len();
        let mut system = RealSpace::new(Reals, m + 1);
        for (row, g) in &rows {
            let mut line: Vec<Ball<N>> = rows.iter().map(|(other, _)| dot(row, other)).collect();
            line.push(*g);
            system.insert(&line);
        }
        let solution = system.null_space();
        let [y] = solution.as_slice() else { return None };
        let scale = y[m].inverse()?;
        let entry = |k: usize| {
            let sum = rows.iter().zip(y).fold(Ball::ZERO, |sum, ((row, _), w)| sum.add(&row[k].mul(w)));
            sum.mul(&scale).midpoint()
        };
        Some((0..self.places.len()).map(entry).collect())
    }

    /// Values after a step that is halved `halved` times.
    fn after<const N: usize>(&self, values: &[Ball<N>], step: &[Ball<N>], halved: i64) -> Vec<Ball<N>> {
        let mut out = values.to_vec();
        for (&s, dx) in self.places.iter().zip(step) {
            out[s] = values[s].add(&dx.shifted(-halved)).midpoint();
        }
        out
    }

    /// Step from far away that leads nearer: by the logarithms, which bring a high power near its value in
    /// few steps, or by the sums. The one that leads nearest is taken, shortened if neither does. `None` if
    /// none was found.
    fn nearer<const N: usize>(
        &self,
        values: &[Ball<N>],
        linear: &Linear<N>,
    ) -> Option<(Vec<Ball<N>>, Linear<N>)> {
        let mut best: Option<(Vec<Ball<N>>, Linear<N>)> = None;
        for halved in [0, 1, 2, 4, 7] {
            for by_ratio in [true, false] {
                let Some(step) = self.step(linear, by_ratio) else { continue };
                let there = self.after(values, &step, halved);
                if let Some(next) = self.linear(&there)
                    && best.as_ref().is_none_or(|(_, best)| next.far < best.far)
                {
                    best = Some((there, next));
                }
            }
            if best.as_ref().is_some_and(|(_, best)| best.far < (linear.far - GAIN).max(linear.far / 2.0)) {
                return best;
            }
        }
        None
    }
}

/// Derivatives and value of `log(P/N)`.
fn ratio<const N: usize>(
    sides: &[Ball<N>; 2],
    slopes: &[Vec<Ball<N>>; 2],
) -> Option<(Vec<Ball<N>>, Ball<N>)> {
    let [above, below] = [sides[0].inverse()?, sides[1].inverse()?];
    let value = sides[0].mul(&below).ln()?.midpoint();
    let row = slopes[0].iter().zip(&slopes[1]);
    Some((row.map(|(a, b)| a.mul(&above).sub(&b.mul(&below))).collect(), value))
}

/// Largest `log2` of an entry.
fn size<const N: usize>(list: &[Ball<N>]) -> f64 {
    list.iter().map(Ball::size_log2).fold(f64::NEG_INFINITY, f64::max)
}

/// Lengths of the steps of Newton's method so far.
struct StepHistory {
    /// Length of the last step, as a power of two.
    before: f64,
    /// Distance from the constraints before the last step.
    far_before: f64,
    /// Number of successive slow steps.
    slow: usize,
    /// Residual and size of the point when the steps became slow.
    from: (f64, f64),
}

impl Default for StepHistory {
    fn default() -> Self {
        Self { before: f64::INFINITY, far_before: f64::INFINITY, slow: 0, from: (f64::INFINITY, 0.0) }
    }
}

impl StepHistory {
    /// Counts a step of this length at a point of size `far`. True if the steps lead to a point with
    /// dependent gradients.
    fn end_at_dependent<const N: usize>(&mut self, linear: &Linear<N>, length: f64, far: f64) -> bool {
        // near a point with dependent gradients the steps shrink by a constant factor, and so do both sides
        let stays = linear.far > FAR && linear.far > self.far_before - GAIN / 2.0 && linear.shift < NEAR;
        self.slow = if (linear.off < NEAR || stays) && length < SHORT && length > self.before - 2.0 {
            self.slow + 1
        } else {
            0
        };
        if self.slow == 0 {
            self.from = (linear.residual, far);
        }
        // towards a point residuals fall by more than a bit per step; away from all points they stay, or the
        // values grow
        let settles = self.from.0 - linear.residual >= SLOW as f64 && far < self.from.1 + 1.0;
        // and fall below the residual that large values leave in a sum that is nowhere zero
        let settles = settles && linear.residual < -4.0 * far - DEEP;
        (self.before, self.far_before) = (length, linear.far);
        self.slow >= SLOW && settles
    }
}

/// Point near the values at which the constraints hold, by Newton's steps of least length in the `free`
/// slots. The residual of the constraints is included in the error bounds of the values.
///
/// # Errors
/// [`ConstraintFailure`], with the constraint of the largest residual.
pub(super) fn hold_by_newton<const N: usize>(
    dag: &Dag,
    constraints: &[usize],
    values: &mut [Ball<N>],
    free: &[bool],
    work: &Work,
) -> Result<(), ConstraintFailure> {
    let places: Vec<usize> = (0..values.len()).filter(|&s| free[s]).collect();
    let newton = Newton {
        dag,
        sums: constraints.iter().map(|&node| ConstraintSum::new(dag, node)).collect(),
        places,
        work,
    };
    // a refusal holds for all later steps
    let failed =
        |reason| work.take(WorkStep::Constraints, 0, 0).map_or(ConstraintFailure::Refused, |()| reason);
    let (mut steps, mut stuck) = (StepHistory::default(), false);
    let mut linear = newton.linear(values).ok_or_else(|| failed(ConstraintFailure::Constraint(0)))?;
    for _ in 0..STEPS {
        let nowhere = ConstraintFailure::Constraint(linear.worst);
        if linear.far > FAR && !stuck {
            if let Some((there, next)) = newton.nearer(values, &linear) {
                values.copy_from_slice(&there);
                (linear, steps.slow) = (next, 0);
                continue;
            }
            stuck = true;
        }
        let step = newton.step(&linear, false).ok_or_else(|| failed(nowhere))?;
        let here: Vec<Ball<N>> = newton.places.iter().map(|&s| values[s]).collect();
        let (length, far) = (size(&step), size(&here).max(0.0));
        // require a short step: if constraints hold only in the limit, it is as long as the distance so far
        if linear.holds && length <= far - STILL {
            let error = (length + 8.0).max(far - Ball::<N>::BITS as f64 + 24.0);
            newton.places.iter().for_each(|&s| values[s] = values[s].midpoint().widened(error));
            return Ok(());
        }
        // the point satisfies some constraints and comes no nearer to the others
        if length <= far - Ball::<N>::BITS as f64 + 8.0 {
            return Err(failed(nowhere));
        }
        if steps.end_at_dependent(&linear, length, far) {
            return Err(ConstraintFailure::Dependent(linear.worst));
        }
        let shorter = (length - far - LONGEST).max(0.0).ceil() as i64;
        let there = newton.after(values, &step, shorter);
        values.copy_from_slice(&there);
        linear = newton.linear(values).ok_or_else(|| failed(nowhere))?;
    }
    Err(failed(ConstraintFailure::Constraint(linear.worst)))
}

/// First constraint that holds at a point where its gradient vanishes.
pub(super) fn vanishing<const N: usize>(
    dag: &Dag,
    constraints: &[usize],
    values: &[Ball<N>],
    free: &[bool],
    work: &Work,
) -> Option<usize> {
    let places: Vec<usize> = (0..values.len()).filter(|&s| free[s]).collect();
    (0..constraints.len()).find(|&c| {
        let sums = vec![ConstraintSum::new(dag, constraints[c])];
        let linear = Newton { dag, sums, places: places.clone(), work }.linear(values);
        linear.is_some_and(|at| at.off < HELD && at.off - at.shift < VANISHES)
    })
}

/// Largest residual of a constraint, relative to its terms, as a power of two; `None` without constraints.
pub(super) fn off<const N: usize>(
    dag: &Dag,
    constraints: &[usize],
    values: &[Ball<N>],
    work: &Work,
) -> Option<f64> {
    let sums = constraints.iter().map(|&node| ConstraintSum::new(dag, node)).collect();
    Some(Newton { dag, sums, places: Vec::new(), work }.linear(values)?.off)
}

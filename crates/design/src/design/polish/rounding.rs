//! Local search for a scheme on a grid of rounded angles.

use obsdeg_core::model::{Angle, Euler, Gimbals, c_n_f64};
use obsdeg_exact::SplitMix64;

use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::stop::Stop;
use crate::design::search::constraints::Constraints;

/// Half a turn in 1e-9 degrees.
const HALF: i64 = 180_000_000_000;
/// Largest move of an angle, in 1e-9 degrees.
const FARTHEST: i64 = HALF / 4;
/// Fine step for comparison, in 1e-9 degrees: hundredths of a degree.
const FINE: i64 = 10_000_000;
/// Largest number of rounds over all positions with one size of moves, and of passes over all sizes.
const ROUNDS: usize = 40;
const CYCLES: usize = 6;

/// Scheme after the local search.
#[derive(Debug, Clone)]
pub(crate) struct MovedScheme {
    /// Violation of the limits, dimensionless; 0 when kept.
    pub(crate) violation: f64,
    /// Criterion of the scheme.
    pub(crate) value: f64,
    pub(crate) scheme: Vec<Euler>,
    /// Number of schemes evaluated.
    pub(crate) examined: u64,
}

impl MovedScheme {
    pub(crate) fn order(&self, other: &Self) -> std::cmp::Ordering {
        self.violation.total_cmp(&other.violation).then(self.value.total_cmp(&other.value))
    }
}

/// Results of the local search on two grids of angles.
pub(crate) struct OnGrids {
    /// Result on the grid of hundredths of a degree.
    pub(crate) finer: MovedScheme,
    /// Result on the grid of the step asked for.
    pub(crate) on_step: MovedScheme,
}

/// Move of angles by `by` on the grid of `step`, both in 1e-9 degrees.
#[derive(Clone, Copy)]
struct GridMove {
    by: i64,
    step: i64,
}

/// Local search for rounded schemes: evaluator, limits and criterion.
pub(crate) struct Moves<'a> {
    pub(crate) evaluator: &'a Evaluator,
    pub(crate) gimbals: &'a Gimbals,
    pub(crate) constraints: &'a Constraints,
    pub(crate) criterion: &'a Criterion,
    /// Stops when the callback returns false.
    pub(crate) proceed: &'a (dyn Fn() -> bool + Sync),
}

/// Nearest multiple of `step` 1e-9 degrees.
pub(crate) fn rounded(angle: &Angle, step: i64) -> Angle {
    Angle::from_nanodeg((angle.nanodeg() as f64 / step as f64).round() as i64 * step)
}

/// `k` random attitudes with angles that are multiples of `step`; `None` where the gimbals reach few of
/// them.
pub(crate) fn random(k: usize, step: i64, gimbals: &Gimbals, rng: &mut SplitMix64) -> Option<Vec<Euler>> {
    const TRIES: usize = 1000;
    let mut within = |most: i64| {
        let most = most / step;
        Angle::from_nanodeg((rng.below(2 * most as u64 + 1) as i64 - most) * step)
    };
    let drawn = (0..TRIES).map(|_| [within(HALF), within(HALF / 2), within(HALF)]);
    let out: Vec<Euler> = drawn.filter(|euler| gimbals.reach(euler)).take(k).collect();
    (out.len() == k).then_some(out)
}

/// Neighbours of an attitude: angles moved by `by` up or down, or unchanged, to multiples of `step`.
fn around(euler: &Euler, by: i64, step: i64) -> impl Iterator<Item = Euler> {
    let at = euler.each_ref().map(Angle::nanodeg);
    (0..27).filter(|i| *i != 13).filter_map(move |i| {
        let signs: [i64; 3] = [i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1];
        within_a_turn(std::array::from_fn(|axis| at[axis] + signs[axis] * by), step)
    })
}

/// Same attitude with beta within a quarter of a turn and the others within half a turn. `None` for
/// angles beyond if half a turn is no multiple of `step`.
fn within_a_turn(at: [i64; 3], step: i64) -> Option<Euler> {
    let wrapped = |x: i64| {
        if x > HALF {
            x - 2 * HALF
        } else if x <= -HALF {
            x + 2 * HALF
        } else {
            x
        }
    };
    let [alpha, beta, gamma] = match (HALF % step, at[1].abs() > HALF / 2) {
        (0, false) => [wrapped(at[0]), at[1], wrapped(at[2])],
        // Mx(180) My(180 - beta) Mz(180) = My(beta)
        (0, true) => [wrapped(at[0] + HALF), wrapped(HALF - at[1]), wrapped(at[2] + HALF)],
        (_, beyond) => {
            let far = beyond || at[0].abs().max(at[2].abs()) > HALF;
            return (!far).then(|| at.map(Angle::from_nanodeg));
        }
    };
    Some([alpha, beta, gamma].map(Angle::from_nanodeg))
}

impl Moves<'_> {
    /// Local search from `start` with angles in hundredths of a degree, and in multiples of `step` 1e-9
    /// degrees.
    pub(crate) fn rounded(&self, start: &[Euler], step: i64) -> OnGrids {
        let to_step = |scheme: &[Euler]| -> Vec<Euler> {
            scheme.iter().map(|euler| euler.each_ref().map(|angle| rounded(angle, step))).collect()
        };
        let first = self.moved(&to_step(start), step);
        if step <= FINE {
            return OnGrids { finer: first.clone(), on_step: MovedScheme { examined: 0, ..first } };
        }
        let finer = self.moved(&first.scheme, FINE);
        let again = self.moved(&to_step(&finer.scheme), step);
        let examined = first.examined + again.examined;
        let best = if again.order(&first).is_lt() { again } else { first };
        OnGrids { finer, on_step: MovedScheme { examined, ..best } }
    }

    /// Local search on the grid of multiples of `step` 1e-9 degrees. One position after the other moves
    /// to the best attitude around it, by smaller and smaller moves, until no move helps.
    fn moved(&self, start: &[Euler], step: i64) -> MovedScheme {
        let mut here = self.evaluator.along(&start.iter().map(c_n_f64).collect::<Vec<_>>());
        let order: Vec<Stop> = (0..start.len()).map(Stop::from).collect();
        let mut root = Vec::new();
        let mut best = MovedScheme { examined: 1, ..self.scored(&here, &order, start.to_vec(), &mut root) };
        let sizes = std::iter::successors(Some(step), |by| Some(by * 2));
        let farthest = sizes.take_while(|by| *by <= FARTHEST).last().unwrap_or(step);
        for _ in 0..CYCLES {
            let before = best.clone();
            let mut by = farthest;
            while by >= step {
                for _ in 0..ROUNDS {
                    let round = best.clone();
                    (0..start.len()).for_each(|place| {
                        self.move_one(&mut here, &mut best, place, GridMove { by, step }, &mut root);
                    });
                    if !best.order(&round).is_lt() || !(self.proceed)() {
                        break;
                    }
                }
                by /= 2;
            }
            if !best.order(&before).is_lt() || !(self.proceed)() {
                break;
            }
        }
        best
    }

    /// Moves the position at `place` to the attitude around it with the smallest criterion, if that
    /// improves the scheme.
    fn move_one(
        &self,
        here: &mut Evaluator,
        best: &mut MovedScheme,
        place: usize,
        GridMove { by, step }: GridMove,
        root: &mut Vec<f64>,
    ) {
        let k = best.scheme.len();
        let near: Vec<Euler> = around(&best.scheme[place], by, step).collect();
        let all: Vec<_> = best.scheme.iter().chain(&near).map(c_n_f64).collect();
        here.stand_at(&all);
        let mut order: Vec<Stop> = (0..k).map(Stop::from).collect();
        let scheme = best.scheme.clone();
        for (i, euler) in near.into_iter().enumerate() {
            order[place] = Stop::from(k + i);
            let mut scheme = scheme.clone();
            scheme[place] = euler;
            let examined = best.examined + 1;
            let there = self.scored(here, &order, scheme, root);
            if there.order(best).is_lt() {
                *best = there;
            }
            best.examined = examined;
        }
    }

    /// Criterion of a scheme and violation of the limits; `examined` is not counted here.
    fn scored(
        &self,
        here: &Evaluator,
        sequence: &[Stop],
        scheme: Vec<Euler>,
        root: &mut Vec<f64>,
    ) -> MovedScheme {
        let state = here.state_of(sequence);
        let violation = if scheme.iter().all(|e| self.gimbals.reach(e)) {
            self.constraints.violation(here, sequence, &state, root)
        } else {
            f64::INFINITY
        };
        let value = here.value(&state, self.criterion, root);
        MovedScheme { violation, value, scheme, examined: 0 }
    }
}

//! Effects of errors that a scheme does not estimate on its records: exact classes by ranks.
//!
//! J are the columns of the unknowns in all samples, O those of the omitted errors. Transition matrices over
//! the dwells are true ones (`T`, `cos wT`, `sin wT` random in a prime field, as for the accuracy order);
//! under reset carry the rows are derivatives at each position. In the reduced echelon form of the rows of
//! `[J O]`, pivots leftmost:
//!
//! - column j of O is zero in every row: *no effect*;
//! - no row that is zero in J has an entry in column j: `O_j = J v`, *silent*. The entry of v at a pivot of J
//!   is that of its row in column j, and an unknown that J alone determines has the same entry in every v;
//! - otherwise *visible*.
//!
//! Two random fields must agree.

use obsdeg_exact::certainty::{RankClaim, error_bound};
use obsdeg_exact::{Echelon, Field, SplitMix64, radical};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::accuracy::{dwell_ratios, dwell_rows};
use crate::degree::coefficient::{
    Coefficient, Image, Number, linear_combination, power, rates_between, recover_radical,
};
use crate::degree::ensemble::EnsembleError;
use crate::degree::platform_rows::{LocalRow, chain_of};
use crate::degree::transition::RandomTime;
use crate::model::platform::{FieldSample, LOCAL, Platform, PositionBlock, RandomValues, local_output};
use crate::model::{Carry, Observed, OmittedModel, Scheme};

/// Number of pairs of fields drawn before a disagreement is an error.
const ATTEMPTS: usize = 4;
/// Largest number of columns of unknowns and omitted errors together.
const MAX_COLUMNS: usize = 1000;

/// Class of an omitted error for one scheme. Exact: no noise, no weights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OmittedClass {
    /// Error that enters no sample: every estimate is immune, whatever the weights.
    NoEffect,
    /// Error whose effect on all samples equals that of a change of the unknowns: no record of the scheme
    /// shows it, and estimates change by exactly that.
    Silent,
    /// Error that no change of the unknowns imitates: a record shows it if it is large enough.
    Visible,
}

/// Exact change of one unknown by a silent error.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ExactChange {
    /// Name of the unknown whose estimate changes.
    pub unknown: String,
    /// Change of the estimate as a multiple of the error, in SI units (rad, rad/s, g), such as `-wN*K0_X`.
    pub change: String,
}

/// Verdict on one omitted error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OmittedVerdict {
    /// Name of the error, such as `K0_X`, `latitude` or `attitude_x@2`.
    pub name: String,
    /// Family of the error, such as `K0` or `latitude`.
    pub family: String,
    /// Unit of the error: ug, ppm, arcsec, ...
    pub unit: String,
    /// Exact class of the error: no effect, silent or visible.
    pub class: OmittedClass,
    /// Unknowns that a silent error changes, among those that the samples determine, by name; empty for other
    /// classes.
    pub changes: Vec<String>,
    /// Exact changes of these unknowns, where they are numbers with roots times powers of wN and wU; null if
    /// they are not, or for other classes.
    pub exact: Option<Vec<ExactChange>>,
}

/// Verdicts on everything that a scheme does not estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OmittedVerdicts {
    /// Verdicts in the order of the error model.
    pub terms: Vec<OmittedVerdict>,
    /// True if torquer errors act in the stated turns; otherwise they act at the earth rate alone.
    pub torquers_in_turns: bool,
    /// Bound on the probability that any of the classes is wrong.
    pub error_bound: f64,
}

/// Reasons for the lack of classes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OmittedError {
    /// Attitudes change while samples are taken.
    #[error("omitted errors are classified for positions, not for rotating segments")]
    Rotation,
    /// There are too many columns.
    #[error("{found} unknowns and omitted errors; expected at most {MAX_COLUMNS} for exact classes")]
    TooMany {
        /// Number of columns.
        found: usize,
    },
    /// No field was found, or the fields disagree.
    #[error(transparent)]
    Verdict(#[from] EnsembleError),
}

/// Classes in one field, with the change of every determined unknown by every silent error.
#[derive(Debug, Clone, PartialEq, Eq)]
struct FoundClasses {
    classes: Vec<OmittedClass>,
    /// True per unknown if the samples determine it.
    determined: Vec<bool>,
    /// Changes per error and unknown; empty unless the error is silent.
    changes: Vec<Vec<u64>>,
}

/// Classes of all errors that `platform` does not estimate.
///
/// # Errors
/// [`OmittedError`].
pub fn omitted_verdicts(
    platform: &Platform,
    model: &OmittedModel,
    seed: u64,
) -> Result<OmittedVerdicts, OmittedError> {
    let scheme = platform.scheme();
    if scheme.rotates() {
        return Err(OmittedError::Rotation);
    }
    let found = platform.names().len() + model.terms().len();
    if found > MAX_COLUMNS {
        return Err(OmittedError::TooMany { found });
    }
    let turning = model.turning().unwrap_or(scheme);
    for attempt in 0..ATTEMPTS {
        let draw = |field: usize| {
            let mut rng = scheme.random(seed, &format!("omitted, attempt {attempt}, field {field}"));
            let values = RandomValues::draw(turning, &mut rng).map_err(EnsembleError::from)?;
            let found = classes(platform, model, &values.sample(turning, 1), &mut rng);
            Ok::<_, OmittedError>((values, found))
        };
        let ((values, first), (_, second)) = (draw(0)?, draw(1)?);
        let nonzero = |f: &FoundClasses| -> Vec<Vec<bool>> {
            f.changes.iter().map(|v| v.iter().map(|x| *x != 0).collect()).collect()
        };
        let agree = first.classes == second.classes
            && first.determined == second.determined
            && nonzero(&first) == nonzero(&second);
        if agree {
            let changing = |&j: &usize| first.changes[j].iter().any(|x| *x != 0);
            let changing: Vec<usize> = (0..model.terms().len()).filter(changing).collect();
            let mut exact = vec![Vec::new(); model.terms().len()];
            if !changing.is_empty() {
                let changed: Vec<&[u64]> = changing.iter().map(|&j| first.changes[j].as_slice()).collect();
                let changes = exact_changes(platform, &model.only(&changing), &changed, seed);
                changing.into_iter().zip(changes).for_each(|(j, of)| exact[j] = of);
            }
            let order = values.roots().order;
            return Ok(verdicts(platform, model, &first, exact, order));
        }
    }
    Err(EnsembleError::Disagreement.into())
}

/// The answer, by names of errors and unknowns.
fn verdicts(
    platform: &Platform,
    model: &OmittedModel,
    found: &FoundClasses,
    exact: Vec<Vec<Option<Coefficient>>>,
    order: u64,
) -> OmittedVerdicts {
    let names = platform.names();
    let terms = model.terms().iter().enumerate().map(|(j, t)| {
        let changed: Vec<usize> =
            (0..names.len()).filter(|&c| found.changes[j].get(c).is_some_and(|x| *x != 0)).collect();
        let change = |&c: &usize| {
            let k = exact.get(j)?.get(c)?.as_ref()?;
            let change = linear_combination([(k, t.name.as_str())]);
            Some(ExactChange { unknown: names[c].clone(), change })
        };
        let silent = found.classes[j] == OmittedClass::Silent;
        OmittedVerdict {
            name: t.name.clone(),
            family: t.family.into(),
            unit: t.unit.into(),
            class: found.classes[j],
            changes: changed.iter().map(|&c| names[c].clone()).collect(),
            exact: silent.then(|| changed.iter().map(change).collect()).flatten(),
        }
    });
    let unknowns = names.len() + model.terms().len();
    let dwells = usize::try_from(dwell_ratios(platform.scheme()).iter().sum::<u64>());
    let claim = RankClaim {
        unknowns,
        decisions: unknowns * (1 + model.terms().len()),
        order,
        // rows as for the accuracy order, with three g factors and generic angles
        row_degree: 64 + 2 * dwells.unwrap_or(usize::MAX / 8),
        row_bits: 64.0 + 16.0 * platform.scheme().positions.len() as f64,
    };
    OmittedVerdicts {
        terms: terms.collect(),
        torquers_in_turns: model.turning().is_some(),
        error_bound: error_bound(&claim, 2),
    }
}

/// Classes and changes at one sample.
fn classes(
    platform: &Platform,
    model: &OmittedModel,
    sample: &FieldSample,
    rng: &mut SplitMix64,
) -> FoundClasses {
    let (n, m) = (platform.names().len(), model.terms().len());
    let field = sample.point.ring;
    let mut space = Echelon::new(field, n + m);
    for row in rows(platform, model, sample, rng) {
        space.insert(&row);
    }
    let unseen = |j: usize| space.pivots().enumerate().all(|(i, p)| p < n || space.row(i)[n + j] == 0);
    let class = |j: usize| match (space.is_zero_column(n + j), unseen(j)) {
        (true, _) => OmittedClass::NoEffect,
        (false, true) => OmittedClass::Silent,
        (false, false) => OmittedClass::Visible,
    };
    let classes: Vec<OmittedClass> = (0..m).map(class).collect();
    let alone = |c: usize| {
        let row = space.pivot_row(c)?;
        row[..n].iter().enumerate().all(|(k, x)| *x == 0 || k == c).then_some(row)
    };
    let determined = (0..n).map(|c| alone(c).is_some()).collect();
    let change = |c: usize, j: usize| alone(c).map_or(0, |row| quotient(&field, row[n + j], row[c]));
    let changes = (0..m).map(|j| match classes[j] {
        OmittedClass::Silent => (0..n).map(|c| change(c, j)).collect(),
        _ => Vec::new(),
    });
    FoundClasses { determined, changes: changes.collect(), classes }
}

fn quotient(field: &Field, a: u64, b: u64) -> u64 {
    if a == 0 { 0 } else { field.mul(a, field.inv(b)) }
}

/// All rows of `[J O]` at one sample.
fn rows(
    platform: &Platform,
    model: &OmittedModel,
    sample: &FieldSample,
    rng: &mut SplitMix64,
) -> Vec<Vec<u64>> {
    let point = &sample.point;
    let field = point.ring;
    let blocks = model.blocks(platform, point);
    // outputs of the scheme, with the errors of the accelerometers
    let vertical = platform.observed().accelerometers;
    let outputs = local_output(&field, Observed { accelerometers: true, ..platform.observed() });
    let used = outputs.into_iter().filter(|(component, _)| vertical || *component != 2).collect();
    let chain = chain_of(&field, [point.w_n, point.w_u], used, LOCAL);
    if platform.scheme().carry == Carry::Reset {
        return reset_rows(platform, model, &field, &blocks, &chain);
    }
    let time = 1 + rng.below(field.modulus() - 1);
    let at_a_time = RandomTime::random(field, [point.w_n, point.w_u], time, rng);
    let dwells = dwell_ratios(platform.scheme());
    let power = |j: usize| field.pow(time, j as u64);
    dwell_rows(&field, &blocks, &chain, power, |i| at_a_time.phi(dwells[i])).0
}

/// Derivative rows at each position, each position with its own psi.
fn reset_rows(
    platform: &Platform,
    model: &OmittedModel,
    field: &Field,
    blocks: &[PositionBlock<u64>],
    chain: &[LocalRow],
) -> Vec<Vec<u64>> {
    let columns = platform.names().len() + model.terms().len();
    let row_of = |block: &PositionBlock<u64>, local: &LocalRow| {
        let mut row = vec![0; columns];
        for (k, &column) in block.columns.iter().enumerate() {
            row[column] = block.entry(field, &local.row, k);
        }
        row
    };
    blocks.iter().flat_map(|b| chain.iter().map(move |l| row_of(b, l))).collect()
}

/// Exact changes by silent errors at generic latitude, where they hold at every latitude: per error, per
/// unknown. `None` if the change is no number with roots times powers of the rates, depends on dwells or
/// generic angles, or is zero in `changed` (errors x unknowns).
fn exact_changes(
    platform: &Platform,
    model: &OmittedModel,
    changed: &[&[u64]],
    seed: u64,
) -> Vec<Vec<Option<Coefficient>>> {
    let generic = |s: &Scheme| Scheme { latitude: None, ..s.clone() };
    let Ok(platform) = Platform::new(generic(platform.scheme())) else { return Vec::new() };
    let turning = model.turning().map_or_else(|| platform.scheme().clone(), generic);
    let draw = |field: usize| {
        let mut rng = platform.scheme().random(seed, &format!("omitted, exact, field {field}"));
        RandomValues::draw(&turning, &mut rng).ok().map(|values| (values, rng))
    };
    let (Some(first), Some(second)) = (draw(0), draw(1)) else { return Vec::new() };
    let mut samples = Vec::new();
    for (values, mut rng) in [first, second] {
        let mut below = |m: u64| 1 + rng.below(m - 1);
        let modulus = values.roots().field.modulus();
        let rates = [below(modulus), below(modulus)];
        let others = [below(modulus), below(modulus)];
        let exponents = radical::embeddings(values.roots().order);
        let mut at = |a: u64, rates| {
            let sample = values.sample_at(&turning, a, rates);
            classes(&platform, model, &sample, &mut rng)
        };
        let embedded = exponents.map(|a| at(a, rates));
        let other = at(1, others);
        samples.push((*values.roots(), rates, embedded, others, other));
    }
    let [one, two] = &samples[..] else { return Vec::new() };
    let recovered = |j: usize, c: usize| -> Option<Coefficient> {
        let value = |f: &FoundClasses| f.changes.get(j)?.get(c).copied();
        let field = one.0.field;
        let image = |value, rates| Image { value, rates };
        let rates = rates_between(&field, image(value(&one.2[0])?, one.1), image(value(&one.4)?, one.3))?;
        let mut images = [[0; 4]; 2];
        for (images, (roots, at, embedded, ..)) in images.iter_mut().zip([one, two]) {
            let inverse = roots.field.inv(power(&roots.field, *at, rates)?);
            for (x, found) in images.iter_mut().zip(embedded) {
                *x = roots.field.mul(value(found)?, inverse);
            }
        }
        let number = Number::Radical(recover_radical(&[one.0, two.0], &images)?);
        Some(Coefficient { number, rates })
    };
    let of = |(j, changed): (usize, &&[u64])| {
        changed.iter().enumerate().map(|(c, x)| (*x != 0).then(|| recovered(j, c)).flatten()).collect()
    };
    changed.iter().enumerate().map(of).collect()
}

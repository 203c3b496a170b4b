//! Verdicts on any system: degrees, agreed on by two random fields.

use obsdeg_exact::certainty::{Claim, error_bound};
use obsdeg_exact::{Echelon, Field, SplitMix64};

use super::dag::{Dag, Op};
use super::model::{Compiled, MAX_UNKNOWNS, ModelError, Role, SystemModel};
use super::rows::{Layout, SystemRows, field_for};
use super::taylor::Singular;
use crate::degree::findings::Findings;
use crate::degree::staircase::{Degrees, climb};
use crate::degree::status::{Status, Verdict};

/// Pairs of fields that are tried.
const ATTEMPTS: usize = 5;

/// What is known of a system.
#[derive(Debug, Clone)]
pub struct Judgement {
    /// The unknowns and the bound.
    pub layout: Layout,
    /// The verdicts.
    pub findings: Findings,
    /// The bases of `V_0, V_1, ...` in the first field.
    pub stairs: Vec<Echelon>,
    /// The two fields.
    pub fields: [Field; 2],
    /// What is not observable would be so only beyond the bound on the order: it is not proven that there is nothing.
    pub rests_on_bound: bool,
}

impl Judgement {
    /// Whether an unknown is spoken of: of arbitrary inputs only the signal itself is of interest.
    pub fn shown(&self, model: &SystemModel, unknown: usize) -> bool {
        let u = &self.layout.unknowns[unknown];
        match u.role {
            Role::UnknownInput(i) => u.derivative == 0 || model.unknown_inputs[i].1.is_some(),
            _ => true,
        }
    }

    /// The verdict on the unknown of a name, where it is spoken of.
    pub fn verdict(&self, model: &SystemModel, name: &str) -> Option<Verdict> {
        let unknown = self.layout.unknowns.iter().position(|u| u.name == name)?;
        self.shown(model, unknown).then(|| self.findings.verdict(unknown))
    }
}

/// Degrees at one random point.
pub(crate) struct At {
    pub(crate) degrees: Degrees,
    pub(crate) combinations: Vec<Verdict>,
    pub(crate) stairs: Vec<Echelon>,
    /// The value of every unknown there, then of every known constant.
    pub(crate) values: Vec<u64>,
}

/// Climbs the staircase of a system at a random point of a field.
pub(crate) fn climb_at(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    field: Field,
    rng: &mut SplitMix64,
) -> Result<At, ModelError> {
    let mut rows =
        SystemRows::new(model, compiled, layout, field, rng).map_err(|s| singular(model, compiled, s))?;
    let gradients = rows.combinations().to_vec();
    let mut found = vec![None; gradients.len()];
    let mut basis = Echelon::new(field, layout.unknowns.len());
    let mut stairs = Vec::new();
    let degrees = climb(&mut rows, &mut basis, |order, basis| {
        for (degree, gradient) in found.iter_mut().zip(&gradients) {
            if degree.is_none() && basis.contains(gradient) {
                *degree = Some(order);
            }
        }
        stairs.push(basis.clone());
    });
    let combinations = found
        .into_iter()
        .zip(&gradients)
        .map(|(degree, gradient)| {
            let moves = gradient.iter().zip(&degrees.excited).any(|(x, excited)| *x != 0 && *excited);
            Verdict { status: Status::of(degree, moves), degree }
        })
        .collect();
    let values = rows.values(compiled, layout, model.constants.len());
    Ok(At { degrees, combinations, stairs, values })
}

fn singular(model: &SystemModel, compiled: &Compiled, singular: Singular) -> ModelError {
    let (node, message) = match singular {
        Singular::Constraint(c) => {
            let (of, message) = (
                &model.constraints[c],
                "no point was found at which it holds; expected constraints that can be solved one by one, or together where all but one are linear",
            );
            return of.place.error(message.into(), 0..of.text.len());
        }
        Singular::Division(node) => (node, "division by zero at every point that was tried"),
        Singular::Root(node) => {
            (node, "the root of zero, or of nothing that is a square, at every point that was tried")
        }
    };
    match compiled.places.get(&node) {
        Some((place, span)) => place.error(message.into(), span.clone()),
        None => ModelError { what: "the model".into(), message: message.into(), span: None },
    }
}

/// Judges a model in two random fields, each of a stream of its own of `seed` and the model; `bound` overrides the
/// highest order.
///
/// # Errors
/// [`ModelError`].
pub fn judge(model: &SystemModel, seed: u64, bound: Option<usize>) -> Result<Judgement, ModelError> {
    let compiled = model.compile()?;
    judge_compiled(model, &compiled, seed, bound)
}

/// Judges a model that was compiled.
///
/// # Errors
/// [`ModelError`].
pub fn judge_compiled(
    model: &SystemModel,
    compiled: &Compiled,
    seed: u64,
    bound: Option<usize>,
) -> Result<Judgement, ModelError> {
    let mut layout = Layout::new(model, bound);
    if layout.closed && !compiled.constraints.is_empty() {
        // a start on constraints that the motion keeps is generic among all of these; on others it is a special one
        let mut rng = model.random(seed, "constraints");
        let field = field_for(compiled, &mut rng);
        let rows = SystemRows::new(model, compiled, &layout, field, &mut rng);
        if !rows.map_err(|s| singular(model, compiled, s))?.keeps_constraints() {
            layout = Layout::of(model, bound, false);
        }
    }
    let found = layout.unknowns.len();
    let refuse = |message: String| ModelError { what: "the model".into(), message, span: None };
    if found > MAX_UNKNOWNS {
        return Err(refuse(format!("{found} unknowns; expected at most {MAX_UNKNOWNS}")));
    }
    for attempt in 0..ATTEMPTS {
        let judged = |i: usize| {
            let mut rng = model.random(seed, &format!("verdicts, attempt {attempt}, field {i}"));
            let field = field_for(compiled, &mut rng);
            climb_at(model, compiled, &layout, field, &mut rng).map(|at| (field, at))
        };
        let ((p, first), (q, second)) = (judged(0)?, judged(1)?);
        if first.degrees == second.degrees && first.combinations == second.combinations {
            let full = first.degrees.rank() == found;
            let error_bound = error_bound(&claim(&compiled.dag, &layout, &first.degrees), 2);
            return Ok(Judgement {
                rests_on_bound: !layout.closed && !full,
                layout,
                findings: Findings::of(
                    first.degrees,
                    &first.stairs,
                    first.combinations,
                    ([p, q].map(|f| f.modulus()), error_bound, seed),
                ),
                stairs: first.stairs,
                fields: [p, q],
            });
        }
    }
    Err(refuse(format!(
        "two random primes disagreed {ATTEMPTS} times in a row; expected at most one disagreement in 10^6 runs: please report this model"
    )))
}

/// What the error bound depends on. A node is a rational function of the random values, its degree and the size of its
/// coefficients bounded by what it is made of; a derivative of order k multiplies by the right-hand sides k times.
fn claim(dag: &Dag, layout: &Layout, degrees: &Degrees) -> Claim {
    let mut size: Vec<(f64, f64)> = Vec::with_capacity(dag.ops.len());
    for op in &dag.ops {
        size.push(match *op {
            Op::Number { mantissa, decimals } => {
                let bits = (mantissa.unsigned_abs().max(1) as f64).log2() + f64::from(decimals.abs()) * 3.33;
                (0.0, bits)
            }
            Op::Slot(_) | Op::Primitive { .. } => (1.0, 1.0),
            Op::Add(a, b) | Op::Subtract(a, b) => (size[a].0 + size[b].0, size[a].1 + size[b].1 + 1.0),
            Op::Multiply(a, b) | Op::Divide(a, b) => (size[a].0 + size[b].0, size[a].1 + size[b].1),
        });
    }
    let largest = |of: fn(&(f64, f64)) -> f64| size.iter().map(of).fold(1.0, f64::max);
    let orders = degrees.rank_profile.len() as f64;
    let n = layout.unknowns.len();
    // every order adds a factor of f, its derivative and its denominator
    let factor = 3.0 * (orders + 1.0);
    Claim {
        unknowns: n,
        decisions: degrees.rank_profile.len() + 2 * n,
        order: 1,
        row_degree: (factor * largest(|s| s.0)).min(1e18) as usize,
        row_bits: factor * (largest(|s| s.1) + (orders + 2.0).log2() * orders),
    }
}

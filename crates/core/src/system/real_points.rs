//! Real points at which the constraints of a model hold: prime fields have points where there is no real one.

use obsdeg_exact::Reals;

use super::error::ModelError;
use super::model::{Compiled, Role, StateStart, SystemModel};
use super::rows::{Layout, Maker};
use super::values::{NotHeld, Values};
use super::work::{Spent, Work};

/// Starts of Newton's method: the values of the file first, then random points, the later the farther.
const TRIES: usize = 200;
/// Random attempts from one start to the next: sizes grow with them.
const FARTHER: usize = 10;

/// Looks for a real point at which all constraints hold.
///
/// # Errors
/// [`ModelError`] where none was found, or where the search is beyond the limit of work.
pub(super) fn has_real_point(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    seed: u64,
    spent: &mut Spent,
) -> Result<(), ModelError> {
    if model.constraints.is_empty() {
        return Ok(());
    }
    let work = Work::new(model.work_limit);
    let found = sought(model, compiled, layout, seed, &work);
    spent.add(&work);
    found
}

fn sought(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    seed: u64,
    work: &Work,
) -> Result<(), ModelError> {
    let Some(first) = model.constraints.first() else { return Ok(()) };
    let field = Reals::<4>;
    let maker = Maker { model, compiled, layout, field, work };
    let mut rng = model.random(seed, "real points");
    let free: Vec<bool> = (compiled.roles.iter())
        .map(|role| match *role {
            Role::State(i) => !matches!(model.states[i].start, StateStart::Value(_)),
            Role::Parameter(_) => true,
            Role::Constant(c) => compiled.constants(0)[c].is_none(),
            Role::KnownInput(_) | Role::UnknownInput(_) | Role::Time => false,
        })
        .collect();
    for attempt in 0..TRIES {
        let Some(mut values) = maker.values(&mut rng, attempt * FARTHER) else { continue };
        if attempt == 0 {
            for (slot, value) in nominal(model, compiled).into_iter().enumerate() {
                values[slot] =
                    value.filter(|_| free[slot]).map_or(values[slot], obsdeg_exact::Ball::from_f64);
            }
        }
        match field.hold(&compiled.dag, &compiled.constraints, &mut values, &free, &mut rng, work) {
            Ok(()) => return Ok(()),
            Err(NotHeld::Refused) => break,
            Err(_) => {}
        }
    }
    work.refused().map_or(Ok(()), Err)?;
    let all = if model.constraints.len() > 1 { " together with the others" } else { "" };
    let message = format!(
        "no real point was found at which it holds{all}, in {TRIES} tries from random points; if there is one, give it under \
         [simulation.values]"
    );
    Err(first.place.error(message, 0..first.text.len()))
}

/// The value that the file gives for a simulation, of every slot.
fn nominal(model: &SystemModel, compiled: &Compiled) -> Vec<Option<f64>> {
    let value = |role: &Role| {
        let name = match *role {
            Role::State(i) => &model.states[i].named.name,
            Role::Parameter(i) => &model.parameters[i].name,
            Role::Constant(i) => &model.constants[i].0.name,
            Role::KnownInput(_) | Role::UnknownInput(_) | Role::Time => return None,
        };
        model.simulation.values.get(name).copied()
    };
    compiled.roles.iter().map(value).collect()
}

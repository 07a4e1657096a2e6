//! The numeric functions that actions change.

use num_rational::BigRational;
use rustc_hash::FxHashSet;

use crate::ast::{Action, ActionBody, Effect, Name};

use super::world::{State, Symbol, World};

/// The functions that some action can change.
pub(super) fn changeable(world: &World<'_>) -> FxHashSet<Symbol> {
    let mut targets = FxHashSet::default();
    for action in &world.domain.actions {
        action_targets(action, &mut targets);
    }
    targets.into_iter().map(|name| world.symbol(name)).collect()
}

/// The values of the functions that some action can change, sorted by name.
pub(super) fn changeable_values(world: &World<'_>, state: &State) -> Vec<(String, BigRational)> {
    let symbols = changeable(world);
    let changeable = state.values.iter().filter(|((symbol, _), _)| symbols.contains(symbol));
    let mut values: Vec<_> = changeable
        .map(|((symbol, arguments), value)| (world.show(*symbol, arguments), value.clone()))
        .collect();
    values.sort();
    values
}

fn action_targets<'p>(action: &'p Action, targets: &mut FxHashSet<&'p Name>) {
    match &action.body {
        ActionBody::Instantaneous { effect, .. } => effect_targets(effect, targets),
        ActionBody::Durative { effects, .. } => {
            for (_, effect) in effects {
                effect_targets(effect, targets);
            }
        }
    }
}

fn effect_targets<'p>(effect: &'p Effect, targets: &mut FxHashSet<&'p Name>) {
    match effect {
        Effect::And(parts) => {
            for part in parts {
                effect_targets(part, targets);
            }
        }
        Effect::ForAll(_, body) | Effect::When(_, body) => effect_targets(body, targets),
        Effect::Assign(_, target, ..) => {
            targets.insert(&target.predicate.name);
        }
        Effect::Add(_) | Effect::Delete(_) => {}
    }
}

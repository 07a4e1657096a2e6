//! The numeric functions and the predicates that actions change.

use num_rational::BigRational;
use rustc_hash::FxHashSet;

use crate::ast::{Action, ActionBody, Domain, Effect, InitialElement, Name, Problem};

use super::world::{State, Symbol, World};

/// The functions that some action can change.
pub(super) fn changeable(world: &World<'_>) -> FxHashSet<Symbol> {
    let mut targets = FxHashSet::default();
    let mut note = |effect: &Effect| {
        if let Effect::Assign(_, target, ..) = effect {
            targets.insert(world.symbol(&target.predicate.name));
        }
    };
    world.domain.actions.iter().for_each(|action| action_effects(action, &mut note));
    targets
}

/// The predicates whose facts actions, timed initial literals or axioms can change.
pub(super) fn changeable_predicates<'p>(domain: &'p Domain, problem: &'p Problem) -> FxHashSet<&'p Name> {
    let mut predicates: FxHashSet<&Name> = FxHashSet::default();
    predicates.extend(domain.derived.iter().map(|axiom| &axiom.head.identifier.name));
    predicates.extend(problem.init.iter().filter_map(|element| match element {
        InitialElement::Timed(_, atom, ..) => Some(&atom.predicate.name),
        _ => None,
    }));
    let mut note = |effect: &'p Effect| {
        if let Effect::Add(atom) | Effect::Delete(atom) = effect {
            predicates.insert(&atom.predicate.name);
        }
    };
    domain.actions.iter().for_each(|action| action_effects(action, &mut note));
    predicates
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

/// Calls `found` with each effect of an action that is not made of others.
fn action_effects<'p>(action: &'p Action, found: &mut dyn FnMut(&'p Effect)) {
    match &action.body {
        ActionBody::Instantaneous { effect, .. } => simple_effects(effect, found),
        ActionBody::Durative { effects, .. } => {
            for (_, effect) in effects {
                simple_effects(effect, found);
            }
        }
    }
}

fn simple_effects<'p>(effect: &'p Effect, found: &mut dyn FnMut(&'p Effect)) {
    match effect {
        Effect::And(parts) => parts.iter().for_each(|part| simple_effects(part, found)),
        Effect::ForAll(_, body) | Effect::When(_, body) => simple_effects(body, found),
        Effect::Assign(..) | Effect::Add(_) | Effect::Delete(_) => found(effect),
    }
}

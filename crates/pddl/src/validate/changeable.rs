//! Functions and predicates that a plan can change.

use rustc_hash::FxHashSet;

use crate::ast::{Action, ActionBody, Domain, Effect, InitialElement, Name, Problem};

pub(super) fn changeable_functions(domain: &Domain) -> FxHashSet<&Name> {
    let mut functions = FxHashSet::default();
    for action in &domain.actions {
        action_effects(action, &mut |effect| {
            if let Effect::Assign(_, target, ..) = effect {
                functions.insert(&target.predicate.name);
            }
        });
    }
    functions
}

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

fn action_effects<'p>(action: &'p Action, visit: &mut dyn FnMut(&'p Effect)) {
    match &action.body {
        ActionBody::Instantaneous { effect, .. } => simple_effects(effect, visit),
        ActionBody::Durative { effects, .. } => {
            for (_, effect) in effects {
                simple_effects(effect, visit);
            }
        }
    }
}

fn simple_effects<'p>(effect: &'p Effect, visit: &mut dyn FnMut(&'p Effect)) {
    match effect {
        Effect::And(parts) => parts.iter().for_each(|part| simple_effects(part, visit)),
        Effect::ForAll(_, body) | Effect::When(_, body) => simple_effects(body, visit),
        Effect::Assign(..) | Effect::Add(_) | Effect::Delete(_) => visit(effect),
    }
}

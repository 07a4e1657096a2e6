//! Determines the fluents: predicates and functions that actions or timed events change, and derived predicates
//! that depend on fluents or cannot be evaluated in advance.

use crate::lifted::configuration::{is_static, recursive_through_forall};
use crate::lifted::{Axiom, Change, Formula, Lifted};

pub(super) fn mark_fluents(lifted: &mut Lifted) {
    for effect in
        lifted.schemas.iter().flat_map(|schema| schema.start_effects.iter().chain(&schema.end_effects))
    {
        match &effect.change {
            Change::Add(predicate, _) | Change::Delete(predicate, _) => {
                lifted.predicates[predicate.index()].fluent = true;
            }
            Change::Assign { function, .. } => lifted.functions[function.index()].fluent = true,
        }
    }
    for (predicate, ..) in lifted.events.iter().flat_map(|event| &event.changes) {
        lifted.predicates[predicate.index()].fluent = true;
    }
    // The Datalog engine evaluates a universal quantifier as a negated existential one, and negation must be
    // stratified. Derived predicates that depend on themselves through a universal quantifier are therefore treated as
    // fluents. Derived predicates with a comparison below a universal quantifier are treated as fluents for another
    // reason. If a value is undefined, neither the comparison nor its negation is true, so the double negation would be
    // wrong.
    let compares = lifted.axioms.iter().filter(|axiom| compares_for_all(&axiom.condition, false));
    let compares: Vec<_> = compares.map(|axiom| axiom.predicate).collect();
    for predicate in recursive_through_forall(lifted).into_iter().chain(compares) {
        lifted.predicates[predicate.index()].fluent = true;
    }
    loop {
        let depends = |axiom: &&Axiom| {
            !lifted.predicates[axiom.predicate.index()].fluent && !is_static(lifted, &axiom.condition)
        };
        let dependents: Vec<_> = lifted.axioms.iter().filter(depends).map(|axiom| axiom.predicate).collect();
        if dependents.is_empty() {
            return;
        }
        for predicate in dependents {
            lifted.predicates[predicate.index()].fluent = true;
        }
    }
}

fn compares_for_all(formula: &Formula, below: bool) -> bool {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => parts.iter().any(|part| compares_for_all(part, below)),
        Formula::Exists(_, body) => compares_for_all(body, below),
        Formula::ForAll(_, body) => compares_for_all(body, true),
        Formula::Literal { .. } | Formula::Equal { .. } => false,
        Formula::Compare(..) => below,
    }
}

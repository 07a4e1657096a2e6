//! What follows from a state by the axioms of the domain: the least fixpoint, layer by layer.

use super::evaluate::{Bindings, Evaluator};
use super::world::{Arguments, State, World};

/// Replaces the derived facts of `state` by those that follow from its other facts. An axiom whose
/// condition is undefined for some objects says nothing about them.
pub(super) fn close(world: &World<'_>, state: &mut State) {
    state.derived.clear();
    for layer in &world.layers {
        loop {
            let mut changed = false;
            for axiom in layer {
                changed |= apply(world, *axiom, state);
            }
            if !changed {
                break;
            }
        }
    }
}

/// Adds what one axiom says; returns whether that was new.
fn apply(world: &World<'_>, axiom: usize, state: &mut State) -> bool {
    let axiom = &world.domain.derived[axiom];
    let parameters = axiom.head.parameters.len();
    let mut bindings = Bindings::default();
    bindings.declare(&axiom.head.parameters);
    let mut found: Vec<Arguments> = Vec::new();
    Evaluator::new(world, state).solve(
        vec![&axiom.condition],
        &mut bindings,
        None,
        &mut |solution, undefined| {
            let objects: Option<Arguments> =
                solution.0[..parameters].iter().map(|binding| binding.object).collect();
            if undefined.is_none() {
                found.extend(objects);
            }
            true
        },
    );
    let predicate = world.symbol(&axiom.head.identifier.name);
    let known = state.derived.entry(predicate).or_default();
    let before = known.len();
    known.extend(found);
    known.len() > before
}

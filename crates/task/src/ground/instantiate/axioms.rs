//! Instantiates the rules of the derived atoms that occur in the task.

use crate::ground::evaluate::condition::residual;
use crate::ground::evaluate::normal_form::Definitions;
use crate::ground::vocabulary::atom::{AtomId, Binding};
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::world::World;
use crate::number::dense;

/// Adds the rules of all derived atoms in `world` to `definitions`. Rule bodies may register further derived
/// atoms, whose rules are added too.
#[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
pub(super) fn instantiate_axioms(
    world: &mut World<'_>,
    definitions: &mut Definitions,
) -> Result<(), Failure> {
    let lifted = world.lifted;
    let mut pulse = world.limits.pulse();
    let mut next = 0;
    while let Some(((predicate, arguments), ())) = world.atoms.get_index(next) {
        pulse.beat()?;
        let (predicate, arguments, head) = (*predicate, arguments.clone(), AtomId(dense(next)));
        next += 1;
        for axiom in lifted.axioms.iter().filter(|axiom| axiom.predicate == predicate) {
            let suits = axiom.parameters.iter().zip(arguments.iter());
            if !suits.into_iter().all(|(p, object)| p.candidates.binary_search(object).is_ok()) {
                continue;
            }
            let mut binding: Binding = arguments.iter().map(|object| Some(*object)).collect();
            binding.resize(axiom.variables, None);
            let body = residual(world, &axiom.condition, &mut binding)?;
            definitions.define(world, head, &body);
        }
    }
    Ok(())
}

//! Detection of strict comparisons (`<`, `>`) of fluents in a lifted task.

use task::lifted::{Formula, Lifted};

use crate::concurrent::duration_fluents::depends_on_state;
use pddl::ast::Comparison;

/// Returns `true` if a condition, axiom or goal contains a strict comparison with an expression
/// that depends on the state.
pub(super) fn compares_strictly(lifted: &Lifted) -> bool {
    let schemas = lifted.schemas.iter().flat_map(|schema| {
        let effects = schema.start_effects.iter().chain(&schema.end_effects);
        let conditions = [&schema.start_condition, &schema.over_all, &schema.at_end];
        conditions.into_iter().chain(effects.map(|effect| &effect.condition))
    });
    let axioms = lifted.axioms.iter().map(|axiom| &axiom.condition);
    schemas.chain(axioms).chain([&lifted.goal]).any(|formula| is_strict(lifted, formula))
}

fn is_strict(lifted: &Lifted, formula: &Formula) -> bool {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => parts.iter().any(|part| is_strict(lifted, part)),
        Formula::Exists(_, body) | Formula::ForAll(_, body) => is_strict(lifted, body),
        Formula::Compare(Comparison::Less | Comparison::Greater, left, right, _) => {
            depends_on_state(lifted, left) || depends_on_state(lifted, right)
        }
        Formula::Literal { .. } | Formula::Equal { .. } | Formula::Compare(..) => false,
    }
}

//! Pruning: removes irrelevant and unreachable operators, rules and effects.
//!
//! Forward pruning uses relaxed reachability over the ground operators and interval analysis of numbers.
//! Backward pruning removes effects on atoms and numbers that nothing reads, and then operators that neither
//! change the state nor reduce the cost.

mod forward;
mod intervals;
mod relevance;

use crate::ground::config::Generality;
use crate::ground::derived::simplify;
use crate::ground::prune::forward::forward;
use crate::ground::prune::intervals::{goal_can_hold, prune_by_numbers};
use crate::ground::prune::relevance::{backward, drop_unread_numerics};
use crate::ground::vocabulary::atom::{AtomId, arguments};
use crate::ground::vocabulary::task::GroundTask;
use crate::lifted::Formula;
use crate::lifted::configuration::conjuncts;
use crate::limits::Interrupted;

/// Prunes the task in place. Values of numbers are not used if `generality` lets initial numbers vary. Returns the
/// reason why the goal is unreachable if this is detected, and `None` otherwise. With a reason, the task is only
/// partly pruned.
pub fn prune(task: &mut GroundTask<'_>, generality: &Generality) -> Result<Option<String>, Interrupted> {
    let world = &task.world;
    let initially: Vec<bool> = world
        .atoms
        .keys()
        .map(|(predicate, arguments)| world.holds_initially(*predicate, arguments))
        .collect();
    let mut reached = forward(task, &initially)?;
    // Numeric pruning and relaxed reachability may each enable further pruning by the other.
    while generality.numbers.is_none() && prune_by_numbers(task)? {
        simplify(task)?;
        reached = forward(task, &initially)?;
    }
    let goal_atoms: Vec<AtomId> = match &task.goal {
        None => return Ok(Some(why_goal_is_false(task))),
        Some(goal) => goal.literals.iter().filter(|(_, positive)| *positive).map(|(atom, _)| *atom).collect(),
    };
    if let Some(atom) = goal_atoms.into_iter().find(|atom| !reached[atom.index()]) {
        return Ok(Some(never_true(&task.world.atom_name(atom))));
    }
    if generality.numbers.is_none() && !goal_can_hold(task)? {
        let reason = "the numbers that the goal requires cannot be reached, even if nothing is ever deleted";
        return Ok(Some(reason.into()));
    }
    drop_unread_numerics(task)?;
    backward(task)?;
    Ok(None)
}

fn never_true(atom: &str) -> String {
    format!("no action can make {atom} true, even if nothing is ever deleted")
}

fn why_goal_is_false(task: &GroundTask<'_>) -> String {
    for conjunct in conjuncts(&task.world.lifted.goal) {
        if let Formula::Literal { positive: true, predicate, terms } = conjunct {
            let arguments = arguments(terms, &Vec::new());
            if !task.world.can_hold(*predicate, &arguments) {
                return never_true(&task.world.name(*predicate, &arguments));
            }
        }
    }
    "the goal contradicts itself or static facts".into()
}

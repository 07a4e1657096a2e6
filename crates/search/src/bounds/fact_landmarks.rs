//! Fact landmarks \[1\] of a task: facts without which the goal is unreachable in the delete relaxation.
//!
//! \[1\] J. Hoffmann, J. Porteous, L. Sebastia: Ordered landmarks in planning, JAIR 22, 2004.

use task::context::Context;
use task::limits::Interrupted;
use task::number::dense;
use task::task::{Fact, VariableId};

use crate::bounds::delete_relaxation::{DeleteRelaxation, GOAL};

/// Number of rule visits of all reachability analyses together after which no further analysis starts.
const MAX_VISITS: u64 = 30_000_000;

/// A landmark that does not hold in the initial state and is no goal fact.
pub(super) struct FactLandmark {
    pub(super) fact: Fact,
    /// The other facts of basic variables that are unreachable in the delete relaxation unless the landmark was
    /// achieved before.
    pub(super) later_facts: Vec<Fact>,
}

/// Returns the fact landmarks of basic variables. Some or all may be missing, for example in a large task.
pub(super) fn fact_landmarks(context: Context<'_>) -> Result<Vec<FactLandmark>, Interrupted> {
    let Context { task, limits } = context;
    let Some(relaxation) = DeleteRelaxation::new(task) else { return Ok(Vec::new()) };
    let (reachable, mut visits) = relaxation.reachable_without(&task.initial.values, None);
    let mut landmarks = Vec::new();
    if !reachable[GOAL as usize] {
        return Ok(landmarks);
    }
    let facts = || {
        VariableId::all(task.basic).flat_map(|variable| {
            let values = 0..dense(task.variables[variable.index()].values.len());
            values.map(move |value| Fact { variable, value })
        })
    };
    for fact in limits.watch(facts()) {
        let fact = fact?;
        let number = relaxation.fact(fact);
        if fact.holds(&task.initial.values) || task.goal.facts.contains(&fact) || !reachable[number as usize]
        {
            continue;
        }
        if visits > MAX_VISITS {
            break;
        }
        let (without, more) = relaxation.reachable_without(&task.initial.values, Some(number));
        visits = visits.saturating_add(more);
        if !without[GOAL as usize] {
            let is_later = |other: &Fact| *other != fact && !without[relaxation.fact(*other) as usize];
            landmarks.push(FactLandmark { fact, later_facts: facts().filter(is_later).collect() });
        }
    }
    Ok(landmarks)
}

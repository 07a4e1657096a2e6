//! Removal of the auxiliary variables that link an over-all condition to the end of its action. They
//! are needed only during grounding.

use task::task::{Condition, Fact, Task, VariableId};

use crate::concurrent::happening::Instance;
use crate::concurrent::time_number::TimeNumber;

/// Removes the variables that the operators of over-all conditions set. During grounding, an end
/// requires its over-all condition by such a variable; afterwards the variables have no use.
#[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
pub(super) fn drop_links<T: TimeNumber>(task: &mut Task, instances: &[Instance<T>]) {
    let mut is_link = vec![false; task.variables.len()];
    for id in instances.iter().filter_map(|instance| instance.over_all) {
        for fact in std::mem::take(&mut task.operators[id.index()].effects) {
            is_link[fact.variable.index()] = true;
        }
    }
    let mut numbers = Vec::with_capacity(is_link.len());
    let mut next = 0;
    for link in &is_link {
        numbers.push(VariableId(next));
        next += u32::from(!link);
    }
    let is_removed = |variable: VariableId| is_link[variable.index()];
    let fact = |fact: &mut Fact| fact.variable = numbers[fact.variable.index()];
    let condition = |condition: &mut Condition| {
        condition.facts.retain(|fact| !is_removed(fact.variable));
        condition.facts.iter_mut().for_each(fact);
        condition.clauses.iter_mut().flatten().for_each(|literal| fact(&mut literal.fact));
    };
    for operator in &mut task.operators {
        condition(&mut operator.condition);
        operator.effects.retain(|fact| !is_removed(fact.variable));
        operator.effects.iter_mut().for_each(fact);
        for effect in &mut operator.conditional {
            effect.condition.iter_mut().for_each(|literal| fact(&mut literal.fact));
            effect.effects.iter_mut().for_each(fact);
        }
    }
    condition(&mut task.goal);
    for rule in task.axioms.iter_mut().flat_map(|layer| &mut layer.rules) {
        fact(&mut rule.head);
        condition(&mut rule.body);
    }
    let mut keep = is_link.iter().map(|link| !link);
    task.variables.retain(|_| keep.next().unwrap_or(true));
    let mut keep = is_link.iter().map(|link| !link);
    task.initial.values.retain(|_| keep.next().unwrap_or(true));
    task.basic -= is_link[..task.basic].iter().filter(|link| **link).count();
}

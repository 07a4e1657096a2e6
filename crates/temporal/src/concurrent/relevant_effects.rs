//! Relevance analysis: finds the effects on which a condition, the goal or the metric depends.

use search::search::{Polarity, directions};
use task::compile::is_hidden;
use task::number::Int;
use task::task::{Fact, NumericEffect, NumericId, Task};

use crate::concurrent::happening::Instance;
use crate::concurrent::time_number::TimeNumber;

pub(super) struct RelevanceContext<'k, T: TimeNumber = Int> {
    /// Upper bound on the useful simultaneous runs of each instance; `u32::MAX` if no bound is
    /// known.
    pub(super) most: &'k [u32],
    pub(super) separation: T,
    /// Per variable: whether a fact with a value other than 0 may be needed. For a variable of a single
    /// atom, this fact is the falsity of the atom.
    pub(super) needed: &'k [bool],
    /// Polarity of each number, i.e. whether larger or smaller values can help. Numbers beyond the
    /// end of the list have unknown polarity.
    pub(super) asked: &'k [Polarity],
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Change {
    Sets(Int),
    Adds(Int),
}

/// Returns the effect as an assignment or addition of a constant. Returns `None` if the effect
/// depends on the state.
pub(super) fn change(effect: &NumericEffect) -> Option<Change> {
    let value = &effect.value;
    let constant = value.quantity.tables.is_empty().then_some(value.quantity.constant)?;
    match value.coefficients.as_slice() {
        [] => Some(Change::Sets(constant)),
        [(variable, 1)] if *variable == effect.variable => Some(Change::Adds(constant)),
        _ => None,
    }
}

impl<T: TimeNumber> RelevanceContext<'_, T> {
    /// Returns the effects that may be needed. A plan without the other effects is no worse.
    pub(super) fn relevant_effects(&self, effects: &[Fact]) -> Vec<Fact> {
        let is_relevant = |fact: &&Fact| fact.value == 0 || self.needed[fact.variable.index()];
        effects.iter().filter(is_relevant).copied().collect()
    }

    /// Returns `true` if it is proved that adding `by` to a number is never an improvement.
    fn is_no_better(&self, number: NumericId, by: Int) -> bool {
        by == 0
            || self.asked.get(number.index()).is_some_and(|asked| !if by < 0 { asked.down } else { asked.up })
    }

    /// Returns `true` if it is proved that removing an effect on a number never makes a plan worse.
    pub(super) fn is_loss(&self, effect: &NumericEffect) -> bool {
        matches!(change(effect), Some(Change::Adds(by)) if self.is_no_better(effect.variable, by))
    }

    /// Returns `true` if setting the number to `value` again after the effect `other` is never an
    /// improvement.
    pub(super) fn keeps(&self, other: &NumericEffect, value: Int) -> bool {
        match change(other) {
            Some(Change::Sets(next)) => self.is_no_better(other.variable, value.saturating_sub(next)),
            Some(Change::Adds(by)) => self.is_no_better(other.variable, by.saturating_neg()),
            None => false,
        }
    }
}

/// Polarity of each number. Empty if durations, the metric, preferences or trajectory constraints
/// may read numbers, so that conditions alone do not determine the polarity.
pub(super) fn asked<T: TimeNumber>(task: &Task, instances: &[Instance<T>]) -> Vec<Polarity> {
    let is_judged = task.schema_names.iter().any(|name| is_hidden(name));
    let is_timed = instances.iter().any(|instance| instance.is_chosen || instance.timer.is_some());
    if is_judged || is_timed || !task.objective.rest.is_empty() { Vec::new() } else { directions(task) }
}

/// Per variable: whether the falsity of its atoms may be needed. `false` only for a variable of a single atom
/// that occurs only positively in conditions and the goal, and neither in the bodies of axioms nor in
/// conditions of conditional effects.
pub(super) fn needed(task: &Task) -> Vec<bool> {
    let mut falsity_needed: Vec<bool> =
        task.variables.iter().map(|variable| variable.values.len() != 2).collect();
    let conditions = task.operators.iter().map(|operator| &operator.condition).chain([&task.goal]);
    for condition in conditions {
        for fact in condition.facts.iter().filter(|fact| fact.value != 0) {
            falsity_needed[fact.variable.index()] = true;
        }
        for literal in condition.clauses.iter().flatten() {
            if (literal.fact.value == 0) != literal.positive {
                falsity_needed[literal.fact.variable.index()] = true;
            }
        }
    }
    // Either truth value of the condition of a conditional effect may be needed.
    let effects = task.operators.iter().flat_map(|operator| &operator.conditional);
    for literal in effects.flat_map(|effect| &effect.condition) {
        falsity_needed[literal.fact.variable.index()] = true;
    }
    for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
        let literals = rule.body.clauses.iter().flatten().map(|literal| literal.fact);
        for fact in rule.body.facts.iter().copied().chain(literals) {
            falsity_needed[fact.variable.index()] = true;
        }
    }
    falsity_needed
}

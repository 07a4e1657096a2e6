//! Relevance analysis: effects that no condition, goal or metric depends on are dropped.

use search::search::{Polarity, directions};
use task::compile::is_hidden;
use task::number::Int;
use task::task::{Fact, NumericEffect, NumericId, Task};

use crate::concurrent::happening::Instance;

/// Relevance information of a task.
pub(super) struct RelevanceContext<'k> {
    /// Number of useful simultaneous runs of each instance, as far as bounded.
    pub(super) most: &'k [u32],
    pub(super) separation: Int,
    /// Per variable: whether the falsity of its atoms may be needed.
    pub(super) needed: &'k [bool],
    /// Polarity of each number. Numbers beyond the end of the list have unknown polarity.
    pub(super) asked: &'k [Polarity],
}

/// Effect on a number, if it does not depend on the state.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Change {
    Sets(Int),
    Adds(Int),
}

pub(super) fn change(effect: &NumericEffect) -> Option<Change> {
    let value = &effect.value;
    let constant = value.quantity.tables.is_empty().then_some(value.quantity.constant)?;
    match value.coefficients.as_slice() {
        [] => Some(Change::Sets(constant)),
        [(variable, 1)] if *variable == effect.variable => Some(Change::Adds(constant)),
        _ => None,
    }
}

impl RelevanceContext<'_> {
    /// Effects that may be needed; removing the others does not make a plan worse.
    pub(super) fn relevant_effects(&self, effects: &[Fact]) -> Vec<Fact> {
        let is_relevant = |fact: &&Fact| fact.value == 0 || self.needed[fact.variable.index()];
        effects.iter().filter(is_relevant).copied().collect()
    }

    /// Returns `true` if changing a number by this amount is never an improvement.
    fn is_no_better(&self, number: NumericId, by: Int) -> bool {
        by == 0
            || self.asked.get(number.index()).is_some_and(|asked| !if by < 0 { asked.down } else { asked.up })
    }

    /// Returns `true` if removing an effect on a number never makes a plan worse.
    pub(super) fn is_loss(&self, effect: &NumericEffect) -> bool {
        matches!(change(effect), Some(Change::Adds(by)) if self.is_no_better(effect.variable, by))
    }

    /// Returns `true` if a number set to `value` is not worse after another effect, so that setting
    /// it again is no improvement.
    pub(super) fn keeps(&self, other: &NumericEffect, value: Int) -> bool {
        match change(other) {
            Some(Change::Sets(next)) => self.is_no_better(other.variable, value.saturating_sub(next)),
            Some(Change::Adds(by)) => self.is_no_better(other.variable, by.saturating_neg()),
            None => false,
        }
    }
}

/// Polarity of each number. Empty if other parts than conditions read numbers: durations, metrics,
/// preferences and trajectory constraints.
pub(super) fn asked(task: &Task, instances: &[Instance]) -> Vec<Polarity> {
    let is_judged = task.schema_names.iter().any(|name| is_hidden(name));
    let is_timed = instances.iter().any(|instance| instance.is_chosen || instance.timer.is_some());
    if is_judged || is_timed || !task.objective.rest.is_empty() { Vec::new() } else { directions(task) }
}

/// Per variable: whether the falsity of its atoms may be needed. It is not if the variable is a
/// single atom that only occurs positively.
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
    // Effects of conditional effects may be needed either way, so their conditions are as well.
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

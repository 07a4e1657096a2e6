//! Relevance analysis: effects that no condition, goal or metric depends on are dropped.

use search::search::{Polarity, directions};
use task::compile::is_hidden;
use task::number::Int;
use task::task::{Fact, NumericEffect, NumericId, Task};

use crate::concurrent::happening::Instance;

/// What is known of a task when runs are counted.
pub(super) struct RelevanceContext<'k> {
    /// How many runs of each instance can make a difference, as far as that is known.
    pub(super) most: &'k [u32],
    pub(super) separation: Int,
    /// By variable, whether anything may need that its atoms are false.
    pub(super) needed: &'k [bool],
    /// By number, what is asked of it; of those that are not in the list nothing is known.
    pub(super) asked: &'k [Polarity],
}

/// What an effect does to a number, if that does not depend on the state.
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
        [(own, 1)] if *own == effect.variable => Some(Change::Adds(constant)),
        _ => None,
    }
}

impl RelevanceContext<'_> {
    /// The effects that somebody may need: without the others a plan is as good.
    pub(super) fn relevant_effects(&self, effects: &[Fact]) -> Vec<Fact> {
        let is_wanted = |fact: &&Fact| fact.value == 0 || self.needed[fact.variable.index()];
        effects.iter().filter(is_wanted).copied().collect()
    }

    /// Whether a number that changes by so much is no better for it, whatever it is.
    fn is_no_better(&self, number: NumericId, by: Int) -> bool {
        by == 0
            || self.asked.get(number.index()).is_some_and(|asked| !if by < 0 { asked.down } else { asked.up })
    }

    /// Whether a plan is no worse without an effect on a number.
    pub(super) fn is_loss(&self, effect: &NumericEffect) -> bool {
        matches!(change(effect), Some(Change::Adds(by)) if self.is_no_better(effect.variable, by))
    }

    /// Whether a number that an effect has set is not worse after another effect, so that to set it again does not make it better.
    pub(super) fn keeps(&self, other: &NumericEffect, value: Int) -> bool {
        match change(other) {
            Some(Change::Sets(next)) => self.is_no_better(other.variable, value.saturating_sub(next)),
            Some(Change::Adds(by)) => self.is_no_better(other.variable, by.saturating_neg()),
            None => false,
        }
    }
}

/// By number, what is asked of it. Nothing is said where more than conditions asks for numbers: durations, metrics, preferences and constraints on the way.
pub(super) fn asked(task: &Task, instances: &[Instance]) -> Vec<Polarity> {
    let is_judged = task.schema_names.iter().any(|name| is_hidden(name));
    let is_timed = instances.iter().any(|own| own.is_chosen || own.timer.is_some());
    if is_judged || is_timed || !task.objective.rest.is_empty() { Vec::new() } else { directions(task) }
}

/// By variable, whether anything may need that its atoms are false. Of a single atom nothing does that is required positively only.
pub(super) fn needed(task: &Task) -> Vec<bool> {
    let mut needed: Vec<bool> = task.variables.iter().map(|variable| variable.values.len() != 2).collect();
    let conditions = task.operators.iter().map(|operator| &operator.condition).chain([&task.goal]);
    for condition in conditions {
        for fact in condition.facts.iter().filter(|fact| fact.value != 0) {
            needed[fact.variable.index()] = true;
        }
        for literal in condition.clauses.iter().flatten() {
            if (literal.fact.value == 0) != literal.positive {
                needed[literal.fact.variable.index()] = true;
            }
        }
    }
    // What they bring about may be needed either way.
    let effects = task.operators.iter().flat_map(|operator| &operator.conditional);
    for literal in effects.flat_map(|effect| &effect.condition) {
        needed[literal.fact.variable.index()] = true;
    }
    for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
        let literals = rule.body.clauses.iter().flatten().map(|literal| literal.fact);
        for fact in rule.body.facts.iter().copied().chain(literals) {
            needed[fact.variable.index()] = true;
        }
    }
    needed
}

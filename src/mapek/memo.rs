//! Cache of optimal plans for recurring situations: components that fail and recover, and measurements that oscillate
//! around a bound.
//!
//! A proved plan depends only on the situation, so that a cached plan equals the plan of a new search.

use std::collections::VecDeque;

use pddl::ast::{Atom, InitialElement, Problem, Term};

use crate::mapek::ask::{Outcome, Question};
use crate::mapek::beliefs::Running;
use crate::mapek::step::PlannedStep;

/// Capacity of the cache.
const CAPACITY: usize = 16;

/// Situations with their plans, most recently used first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memo(VecDeque<(StoredQuestion, Outcome)>);

/// Everything that a plan depends on, apart from the domain and the metric, which are constant. A new goal clears the
/// cache.
#[derive(Debug, Clone)]
pub(crate) struct StoredQuestion {
    problem: Problem,
    running: Option<Running>,
    /// The current plan, if the choice between optimal plans depends on it.
    old: Option<Vec<PlannedStep>>,
}

impl Memo {
    /// Returns the plan of a cached situation.
    pub(super) fn recall(&mut self, question: &Question<'_>) -> Option<Outcome> {
        let position = self.0.iter().position(|(situation, _)| situation.equals(question))?;
        let entry = self.0.remove(position)?;
        let outcome = entry.1.clone();
        self.0.push_front(entry);
        Some(outcome)
    }

    /// Caches an outcome if it is proved.
    pub(super) fn store(&mut self, question: &Question<'_>, outcome: &Outcome) {
        if outcome.proved {
            self.0.push_front((StoredQuestion::new(question), outcome.clone()));
            self.0.truncate(CAPACITY);
        }
    }

    /// Clears the cache, for a new goal.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

impl StoredQuestion {
    /// Copies the situation of a question.
    pub(super) fn new(question: &Question<'_>) -> Self {
        let old = question.old.filter(|_| question.stay_close).map(<[_]>::to_vec);
        Self { problem: question.problem.clone(), running: question.running.cloned(), old }
    }

    /// Returns `true` if both questions have the same action under way, or none.
    pub(super) fn has_same_action(&self, question: &Question<'_>) -> bool {
        self.running.as_ref().map(|running| running.action) == question.running.map(|running| running.action)
    }

    /// Returns `true` if the questions are equal.
    pub(super) fn equals(&self, question: &Question<'_>) -> bool {
        let (left, right) = (&self.problem, question.problem);
        let objects = |problem: &Problem| problem.objects.len();
        left.init.len() == right.init.len()
            && objects(left) == objects(right)
            && self.running.as_ref().map(relevant_part) == question.running.map(relevant_part)
            && self.old.as_deref() == question.old.filter(|_| question.stay_close)
            && left.init.iter().zip(&right.init).all(|(left, right)| are_equal(left, right))
            && left.objects.iter().zip(&right.objects).all(|(left, right)| {
                let types = left.r#type.alternatives.iter().map(|name| &name.name);
                left.identifier.name == right.identifier.name
                    && types.eq(right.r#type.alternatives.iter().map(|name| &name.name))
            })
    }
}

/// Part of the action under way that plans depend on. The numbers of action and request are irrelevant.
fn relevant_part(running: &Running) -> (&PlannedStep, &num_rational::BigRational) {
    (&running.step, &running.progress)
}

fn are_equal(left: &InitialElement, right: &InitialElement) -> bool {
    use InitialElement::{Fact, NegatedFact, Timed, Value};
    match (left, right) {
        (Fact(left), Fact(right)) | (NegatedFact(left), NegatedFact(right)) => are_equal_atoms(left, right),
        (Value(left, a, _), Value(right, b, _)) => a == b && are_equal_atoms(left, right),
        (Timed(s, left, a, _), Timed(t, right, b, _)) => s == t && a == b && are_equal_atoms(left, right),
        _ => false,
    }
}

fn are_equal_atoms(left: &Atom, right: &Atom) -> bool {
    let name = |term: &Term| match term {
        Term::Constant(identifier) | Term::Variable(identifier) => identifier.name.clone(),
    };
    left.predicate.name == right.predicate.name
        && left.arguments.iter().map(name).eq(right.arguments.iter().map(name))
}

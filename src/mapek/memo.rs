//! Cache of proved outcomes of planning (optimal plans, or the absence of a plan) for recurring situations: components
//! that fail and recover, and measurements that oscillate around a bound.
//!
//! An outcome that is proved for a planning problem also holds for an equal planning problem, so that no new search is
//! needed.

use std::collections::{BTreeMap, VecDeque};

use num_rational::BigRational;
use pddl::ast::{Atom, InitialElement, Problem, Term};

use crate::mapek::ask::{Outcome, Question};
use crate::mapek::beliefs::Running;
use crate::mapek::resume::has_reached_facts;
use crate::mapek::step::PlannedStep;

const CAPACITY: usize = 16;

/// Planning problems with their outcomes, most recently used first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memo(VecDeque<(StoredQuestion, Outcome)>);

/// Copy of a planning problem: all inputs of a search except the domain and the metric, which are constant.
#[derive(Debug, Clone)]
pub(crate) struct StoredQuestion {
    problem: Problem,
    goal: Option<String>,
    running: Option<Running>,
    /// The current plan, if the choice between optimal plans depends on it.
    old: Option<Vec<PlannedStep>>,
}

impl Memo {
    pub(super) fn recall(&mut self, question: &Question<'_>) -> Option<Outcome> {
        let position = self.0.iter().position(|(situation, _)| situation.equals(question))?;
        let entry = self.0.remove(position)?;
        let outcome = entry.1.clone();
        self.0.push_front(entry);
        Some(outcome)
    }

    pub(super) fn store(&mut self, question: &Question<'_>, outcome: &Outcome) {
        if outcome.proved {
            self.0.push_front((StoredQuestion::new(question), outcome.clone()));
            self.0.truncate(CAPACITY);
        }
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

impl StoredQuestion {
    pub(super) fn new(question: &Question<'_>) -> Self {
        let old = question.old.filter(|_| question.stay_close).map(<[_]>::to_vec);
        Self {
            problem: question.problem.clone(),
            goal: question.goal.map(ToOwned::to_owned),
            running: question.running.cloned(),
            old,
        }
    }

    pub(super) fn has_same_action(&self, question: &Question<'_>) -> bool {
        self.running.as_ref().map(|running| running.action) == question.running.map(|running| running.action)
    }

    /// Returns `false` if only one of the actions under way is known to have started, and plans depend on this.
    pub(super) fn has_equal_start(&self, question: &Question<'_>) -> bool {
        let (Some(stored), Some(running)) = (&self.running, question.running) else { return true };
        stored.started == running.started
            || !has_reached_facts(question.mission.domain(), &running.step, question.problem)
    }

    pub(super) fn equals(&self, question: &Question<'_>) -> bool {
        let (left, right) = (&self.problem, question.problem);
        let objects = |problem: &Problem| problem.objects.len();
        left.init.len() == right.init.len()
            && objects(left) == objects(right)
            && self.goal.as_deref() == question.goal
            && self.running.as_ref().map(relevant_part) == question.running.map(relevant_part)
            && self.old.as_deref() == question.old.filter(|_| question.stay_close)
            && self.has_equal_start(question)
            && left.init.iter().zip(&right.init).all(|(left, right)| are_equal(left, right))
            && left.objects.iter().zip(&right.objects).all(|(left, right)| {
                let types = left.r#type.alternatives.iter().map(|name| &name.name);
                left.identifier.name == right.identifier.name
                    && types.eq(right.r#type.alternatives.iter().map(|name| &name.name))
            })
    }
}

/// Returns the parts of an action under way on which plans depend, except `started`, which
/// [`StoredQuestion::has_equal_start`] compares.
fn relevant_part(running: &Running) -> (&PlannedStep, &BigRational, &BTreeMap<String, BigRational>) {
    (&running.step, &running.progress, &running.applied)
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
    left.predicate.name == right.predicate.name
        && left.arguments.iter().map(Term::name).eq(right.arguments.iter().map(Term::name))
}

//! Plans that were proved the best for situations, to be used again when the same situation comes back: components flap,
//! and measurements go to and fro across a bound.
//!
//! A proved plan depends on the situation and on nothing else, so that what is remembered is what would be found again.

use std::collections::VecDeque;

use pddl::ast::{Atom, InitialElement, Problem, Term};

use crate::mapek::ask::{Ask, Outcome};
use crate::mapek::beliefs::Running;
use crate::mapek::step::PlannedStep;

/// So many situations are remembered.
const SITUATIONS: usize = 16;

/// Situations with their plans, the one that was last asked for first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memo(VecDeque<(Asked, Outcome)>);

/// What a plan depends on. The domain and the metric stay; for another goal there is another memo.
#[derive(Debug, Clone)]
pub(crate) struct Asked {
    problem: Problem,
    running: Option<Running>,
    /// The plan at hand, where the choice depends on it.
    old: Option<Vec<PlannedStep>>,
}

impl Memo {
    /// The plan of a situation that was there before.
    pub(super) fn recall(&mut self, ask: &Ask<'_>) -> Option<Outcome> {
        let place = self.0.iter().position(|(situation, _)| situation.is(ask))?;
        let found = self.0.remove(place)?;
        let outcome = found.1.clone();
        self.0.push_front(found);
        Some(outcome)
    }

    /// Remembers a plan; one that may not be the best is looked for again.
    pub(super) fn note(&mut self, ask: &Ask<'_>, outcome: &Outcome) {
        if outcome.proved {
            self.0.push_front((Asked::new(ask), outcome.clone()));
            self.0.truncate(SITUATIONS);
        }
    }

    /// Another goal makes another question of each situation.
    pub(super) fn forget(&mut self) {
        self.0.clear();
    }
}

impl Asked {
    /// Keeps what a plan depends on.
    pub(super) fn new(ask: &Ask<'_>) -> Self {
        let old = ask.old.filter(|_| ask.stay_close).map(<[_]>::to_vec);
        Self { problem: ask.problem.clone(), running: ask.running.cloned(), old }
    }

    /// Returns `true` if the same action comes first, or none.
    pub(super) fn is_about(&self, ask: &Ask<'_>) -> bool {
        self.running.as_ref().map(|own| own.action) == ask.running.map(|own| own.action)
    }

    /// Returns `true` if it is the same question.
    pub(super) fn is(&self, ask: &Ask<'_>) -> bool {
        let (own, other) = (&self.problem, ask.problem);
        let objects = |problem: &Problem| problem.objects.len();
        own.init.len() == other.init.len()
            && objects(own) == objects(other)
            && self.running.as_ref().map(key) == ask.running.map(key)
            && self.old.as_deref() == ask.old.filter(|_| ask.stay_close)
            && own.init.iter().zip(&other.init).all(|(own, other)| same(own, other))
            && own.objects.iter().zip(&other.objects).all(|(own, other)| {
                let types = own.r#type.alternatives.iter().map(|name| &name.name);
                own.identifier.name == other.identifier.name
                    && types.eq(other.r#type.alternatives.iter().map(|name| &name.name))
            })
    }
}

/// What of the action under way a plan depends on: not the number that it was requested with.
fn key(running: &Running) -> (&PlannedStep, &num_rational::BigRational) {
    (&running.step, &running.progress)
}

fn same(own: &InitialElement, other: &InitialElement) -> bool {
    use InitialElement::{Fact, NegatedFact, Timed, Value};
    match (own, other) {
        (Fact(own), Fact(other)) | (NegatedFact(own), NegatedFact(other)) => same_atom(own, other),
        (Value(own, a, _), Value(other, b, _)) => a == b && same_atom(own, other),
        (Timed(s, own, a, _), Timed(t, other, b, _)) => s == t && a == b && same_atom(own, other),
        _ => false,
    }
}

fn same_atom(own: &Atom, other: &Atom) -> bool {
    let name = |term: &Term| match term {
        Term::Constant(identifier) | Term::Variable(identifier) => identifier.name.clone(),
    };
    own.predicate.name == other.predicate.name
        && own.arguments.iter().map(name).eq(other.arguments.iter().map(name))
}

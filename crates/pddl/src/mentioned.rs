//! Names that a domain and a problem mention, whether or not anything declares them.

use std::collections::BTreeSet;

use crate::ast::{
    ActionBody, Atom, Condition, Constraint, Domain, Effect, InitialElement, Name, Problem, Term, Trajectory,
};

/// Names that a domain and a problem mention.
#[derive(Debug, Clone, Default)]
pub struct Mentioned {
    /// Predicates in conditions, effects, preferences and constraints.
    pub predicates: BTreeSet<Name>,
    /// Predicates that actions or timed initial literals change.
    pub changed: BTreeSet<Name>,
    /// Predicates that timed initial literals change.
    pub timed: BTreeSet<Name>,
    /// Objects in conditions, effects and the initial state.
    pub objects: BTreeSet<Name>,
}

impl Mentioned {
    /// Returns what a domain mentions.
    pub fn by_domain(domain: &Domain) -> Self {
        let mut found = Self::default();
        for axiom in &domain.derived {
            found.condition(&axiom.condition);
        }
        found.constraints(&domain.constraints);
        for action in &domain.actions {
            for preference in &action.preferences {
                found.condition(&preference.condition);
            }
            match &action.body {
                ActionBody::Instantaneous { precondition, effect } => {
                    found.condition(precondition);
                    found.effect(effect);
                }
                ActionBody::Durative { conditions, effects, .. } => {
                    for (_, condition) in conditions {
                        found.condition(condition);
                    }
                    for (_, effect) in effects {
                        found.effect(effect);
                    }
                }
            }
        }
        found
    }

    /// Adds what a problem mentions.
    #[must_use]
    pub fn and_problem(mut self, problem: &Problem) -> Self {
        self.condition(&problem.goal);
        self.constraints(&problem.constraints);
        for element in &problem.init {
            match element {
                InitialElement::Fact(atom) | InitialElement::NegatedFact(atom) => self.atom(atom),
                InitialElement::Timed(_, atom, ..) => {
                    self.atom(atom);
                    self.changed.insert(atom.predicate.name.clone());
                    self.timed.insert(atom.predicate.name.clone());
                }
                InitialElement::Value(atom, ..) => self.terms(&atom.arguments),
            }
        }
        self
    }

    fn atom(&mut self, atom: &Atom) {
        self.predicates.insert(atom.predicate.name.clone());
        self.terms(&atom.arguments);
    }

    fn terms(&mut self, terms: &[Term]) {
        self.objects.extend(terms.iter().filter_map(|term| match term {
            Term::Constant(identifier) => Some(identifier.name.clone()),
            Term::Variable(_) => None,
        }));
    }

    fn constraints(&mut self, constraints: &[Constraint]) {
        for constraint in constraints {
            self.trajectory(&constraint.trajectory);
        }
    }

    fn trajectory(&mut self, trajectory: &Trajectory) {
        match trajectory {
            Trajectory::And(parts) => {
                for part in parts {
                    self.trajectory(part);
                }
            }
            Trajectory::ForAll(_, inner) => self.trajectory(inner),
            Trajectory::AtEnd(own)
            | Trajectory::Always(own)
            | Trajectory::Sometime(own)
            | Trajectory::AtMostOnce(own)
            | Trajectory::Within(_, own)
            | Trajectory::HoldDuring(_, _, own)
            | Trajectory::HoldAfter(_, own) => self.condition(own),
            Trajectory::SometimeAfter(first, second)
            | Trajectory::SometimeBefore(first, second)
            | Trajectory::AlwaysWithin(_, first, second) => {
                self.condition(first);
                self.condition(second);
            }
        }
    }

    /// Adds what a condition mentions.
    pub fn condition(&mut self, condition: &Condition) {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                for part in parts {
                    self.condition(part);
                }
            }
            Condition::Not(inner) | Condition::Exists(_, inner) | Condition::ForAll(_, inner) => {
                self.condition(inner);
            }
            Condition::Imply(premise, conclusion) => {
                self.condition(premise);
                self.condition(conclusion);
            }
            Condition::Atom(atom) => self.atom(atom),
            Condition::Equal(left, right, _) => self.terms(&[left.clone(), right.clone()]),
            Condition::Compare(..) => {}
        }
    }

    fn effect(&mut self, effect: &Effect) {
        match effect {
            Effect::And(parts) => {
                for part in parts {
                    self.effect(part);
                }
            }
            Effect::Add(atom) | Effect::Delete(atom) => {
                self.atom(atom);
                self.changed.insert(atom.predicate.name.clone());
            }
            Effect::ForAll(_, inner) => self.effect(inner),
            Effect::When(condition, inner) => {
                self.condition(condition);
                self.effect(inner);
            }
            Effect::Assign(_, target, ..) => self.terms(&target.arguments),
        }
    }
}

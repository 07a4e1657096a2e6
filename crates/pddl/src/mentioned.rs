//! Predicates and objects that occur in a domain and a problem, declared or not.

use std::collections::BTreeSet;

use crate::ast::{Atom, Condition, Domain, Effect, InitialElement, Name, Problem, Term};
use crate::visit::Node;

/// Predicates and objects that occur in a domain, and optionally in a problem, whether declared or not.
/// Declarations themselves do not count.
#[derive(Debug, Clone, Default)]
pub struct Mentioned {
    /// Predicates in conditions, effects, preferences, constraints, and the initial state.
    pub predicates: BTreeSet<Name>,
    /// Predicates of atomic effects and of timed initial literals.
    pub changed: BTreeSet<Name>,
    /// Predicates of timed initial literals.
    pub timed: BTreeSet<Name>,
    /// Objects in atoms, equalities, targets of numeric effects, and the initial state. Objects that occur
    /// only as arguments in numeric expressions are not included.
    pub objects: BTreeSet<Name>,
}

impl Mentioned {
    /// Returns the predicates and objects that occur in a domain.
    pub fn by_domain(domain: &Domain) -> Self {
        let mut mentioned = Self::default();
        domain.walk(&mut |node| mentioned.node(node));
        mentioned
    }

    /// Adds the predicates and objects that occur in a problem.
    #[must_use]
    pub fn and_problem(mut self, problem: &Problem) -> Self {
        problem.walk(&mut |node| self.node(node));
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

    /// Adds the predicates and objects that occur in a condition.
    pub fn condition(&mut self, condition: &Condition) {
        condition.walk(&mut |node| self.node(node));
    }

    fn node(&mut self, node: Node<'_>) {
        match node {
            Node::Condition(Condition::Atom(atom)) => self.atom(atom),
            Node::Condition(Condition::Equal(left, right, _)) => self.terms(&[left.clone(), right.clone()]),
            Node::Effect(Effect::Add(atom) | Effect::Delete(atom)) => {
                self.atom(atom);
                self.changed.insert(atom.predicate.name.clone());
            }
            Node::Effect(Effect::Assign(_, target, ..)) => self.terms(&target.arguments),
            _ => {}
        }
    }
}

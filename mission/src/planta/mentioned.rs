//! What a domain and a problem mention: the predicates and objects that something else has to declare.

use std::collections::BTreeSet;

use pddl::ast::{
    ActionBody, Atom, Condition, Domain, Effect, InitialElement, Name, Problem, Term, TypeExpression,
};

/// Names that are used.
#[derive(Debug, Default)]
pub(super) struct Mentioned {
    /// Of predicates, in conditions and effects.
    pub predicates: BTreeSet<Name>,
    /// Of predicates that actions or events change.
    pub changed: BTreeSet<Name>,
    /// Of predicates that events change.
    pub timed: BTreeSet<Name>,
    /// Of objects, in conditions, effects and the initial state.
    pub objects: BTreeSet<Name>,
}

impl Mentioned {
    /// What a domain mentions.
    pub fn by_domain(domain: &Domain) -> Self {
        let mut found = Self::default();
        for axiom in &domain.derived {
            found.condition(&axiom.condition);
        }
        for action in &domain.actions {
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

    /// What a problem mentions, too.
    pub fn and_problem(mut self, problem: &Problem) -> Self {
        self.condition(&problem.goal);
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

    fn condition(&mut self, condition: &Condition) {
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

/// The predicates that a domain uses in conditions and effects and that it declares nowhere.
pub(super) fn undeclared(domain: &Domain) -> BTreeSet<Name> {
    let mut used = Mentioned::by_domain(domain).predicates;
    for declared in &domain.predicates {
        used.remove(&declared.identifier.name);
    }
    used
}

/// The types that a domain or a problem gives to parameters, constants and objects.
pub(super) fn types(domain: &Domain, problem: &Problem) -> BTreeSet<Name> {
    let mut found = BTreeSet::new();
    let mut note = |r#type: &TypeExpression| {
        found.extend(r#type.alternatives.iter().map(|alternative| alternative.name.clone()));
    };
    let parameters = domain.actions.iter().flat_map(|action| &action.parameters);
    let heads = domain.derived.iter().flat_map(|axiom| &axiom.head.parameters);
    let declared = domain.predicates.iter().flat_map(|declared| &declared.parameters);
    let named = domain.types.iter().chain(&domain.constants).chain(&problem.objects);
    for entry in named.clone().chain(parameters).chain(heads).chain(declared) {
        note(&entry.r#type);
    }
    found.extend(domain.types.iter().map(|entry| entry.identifier.name.clone()));
    found
}

/// Takes out of a domain the derived predicates that no action, no goal and no other predicate asks for.
pub(super) fn keep_asked(domain: &mut Domain, problem: &Problem) {
    let derived = std::mem::take(&mut domain.derived);
    let mut asked = Mentioned::by_domain(domain).and_problem(problem).predicates;
    loop {
        let mut found = Mentioned::default();
        let axioms = derived.iter().filter(|axiom| asked.contains(&axiom.head.identifier.name));
        for axiom in axioms {
            found.condition(&axiom.condition);
        }
        let before = asked.len();
        asked.extend(found.predicates);
        if asked.len() == before {
            break;
        }
    }
    let (kept, dropped): (Vec<_>, Vec<_>) =
        derived.into_iter().partition(|axiom| asked.contains(&axiom.head.identifier.name));
    domain.derived = kept;
    let dropped: BTreeSet<Name> = dropped.into_iter().map(|axiom| axiom.head.identifier.name).collect();
    domain.predicates.retain(|declared| !dropped.contains(&declared.identifier.name));
}

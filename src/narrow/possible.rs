//! Computes upper bounds on the extensions of derived predicates in all reachable states.
//!
//! An open predicate, which actions can change, stays derived. Its parameters have no types, so grounding would try all
//! objects. Often few objects are possible, because only facts that actions add can extend the predicate. If these
//! facts can be bounded, the predicate gets a companion `possible-…`: a static predicate that is true wherever the open
//! predicate can be true. In every reachable state, an atom of the predicate is equivalent to its conjunction with
//! the companion's atom. With this conjunction, grounding enumerates few objects for each variable.

use std::collections::{BTreeMap, BTreeSet};

use pddl::ast::{
    ActionBody, Atom, Condition, Declaration, Derived, Domain, Effect, Name, Term, TypeExpression, TypedName,
};

use super::clause::{Clause, Fact, Literal};
use super::settle::{Additions, additions, are_equal};

#[derive(Debug, Clone)]
struct Addition {
    predicate: Name,
    arguments: Vec<Argument>,
}

/// Possible values of an argument: one object, or the objects that are members of all given
/// classes.
#[derive(Debug, Clone)]
enum Argument {
    Object(Name),
    Of(Vec<Name>),
}

#[derive(Debug, Clone, Default)]
pub(super) struct Possible {
    bounded: BTreeSet<Name>,
    additions: Vec<Addition>,
    clauses: Vec<Clause>,
}

impl Possible {
    /// Determines which open predicates (predicates that actions can change) get a bound. A predicate has no bound if
    /// one of its axioms is not a clause or leaves a variable unbound, or if the domain has a predicate with the name
    /// of the companion. Predicates that timed initial literals change have no bound. If an action adds the predicate,
    /// each argument must be a constant, or a parameter for which the action requires a class. A predicate that depends
    /// on a predicate without bound has no bound, either.
    pub fn new(
        domain: &Domain,
        open: &BTreeMap<Name, Option<Vec<Clause>>>,
        (changed, timed): (&BTreeSet<Name>, &BTreeSet<Name>),
        is_class: &dyn Fn(&Name) -> bool,
    ) -> Self {
        let mut free = timed.clone();
        // The name of a companion may belong to a predicate of the domain.
        let names: BTreeSet<&Name> = domain.predicates.iter().map(|atom| &atom.identifier.name).collect();
        free.extend(open.keys().filter(|name| names.contains(&possible(name))).cloned());
        free.extend(open.iter().filter(|(_, clauses)| clauses.is_none()).map(|(name, _)| name.clone()));
        // Members of a class have to be known before the bounds are computed, so open predicates do
        // not count as classes: their extensions may be larger in other states.
        let varying: BTreeSet<Name> = changed.iter().chain(open.keys()).cloned().collect();
        let mut additions_of_actions = Vec::new();
        for action in &domain.actions {
            let Additions { classes, atoms } = additions(action, &varying);
            for (atom, bound) in atoms {
                let argument = |term: &Term| match term {
                    Term::Constant(constant) => Some(Argument::Object(constant.name.clone())),
                    Term::Variable(variable) if bound.contains(&&variable.name) => None,
                    Term::Variable(_) => {
                        let required =
                            classes.iter().filter(|(class, of)| is_class(class) && are_equal(of, term));
                        let required: Vec<Name> = required.map(|(class, _)| class.clone()).collect();
                        (!required.is_empty()).then_some(Argument::Of(required))
                    }
                };
                let predicate = atom.predicate.name.clone();
                match atom.arguments.iter().map(argument).collect() {
                    Some(arguments) => additions_of_actions.push(Addition { predicate, arguments }),
                    None => {
                        free.insert(predicate);
                    }
                }
            }
        }
        loop {
            let is_free = |part: &Literal| part.name().is_some_and(|name| free.contains(name));
            let asks = |clauses: &Vec<Clause>| {
                clauses.iter().any(|clause| !clause.is_bound() || clause.body.iter().any(is_free))
            };
            let newly_free = open
                .iter()
                .filter(|(name, clauses)| !free.contains(*name) && clauses.as_ref().is_none_or(asks));
            let newly_free: Vec<Name> = newly_free.map(|(name, _)| name.clone()).collect();
            if newly_free.is_empty() {
                break;
            }
            free.extend(newly_free);
        }
        let bounded: BTreeSet<Name> = open.keys().filter(|name| !free.contains(*name)).cloned().collect();
        let clauses = bounded.iter().filter_map(|name| open[name].clone()).flatten().collect();
        Self { bounded, additions: additions_of_actions, clauses }
    }

    pub fn clauses(&self) -> impl Iterator<Item = &Clause> {
        self.clauses.iter()
    }

    /// Returns the facts that actions may add, except additions with a variable that no class restricts.
    /// `fixed` contains the initial facts and those of settled predicates. It is only searched for members of
    /// classes, which never change.
    pub fn added(&self, fixed: &BTreeSet<Fact>) -> BTreeSet<Fact> {
        let members = |class: &Name| -> BTreeSet<Name> {
            let unary = fixed.iter().filter(|(name, row)| name == class && row.len() == 1);
            unary.map(|(_, row)| row[0].clone()).collect()
        };
        let mut facts = BTreeSet::new();
        for addition in &self.additions {
            let mut rows: Vec<Vec<Name>> = vec![Vec::new()];
            for argument in &addition.arguments {
                let values: BTreeSet<Name> = match argument {
                    Argument::Object(object) => BTreeSet::from([object.clone()]),
                    Argument::Of(classes) => {
                        let mut members_by_class = classes.iter().map(members);
                        let first = members_by_class.next().unwrap_or_default();
                        members_by_class.fold(first, |one, other| one.intersection(&other).cloned().collect())
                    }
                };
                let extended = |row: &Vec<Name>| -> Vec<Vec<Name>> {
                    values.iter().map(|object| [row.clone(), vec![object.clone()]].concat()).collect()
                };
                rows = rows.iter().flat_map(extended).collect();
            }
            facts.extend(rows.into_iter().map(|row| (addition.predicate.clone(), row)));
        }
        facts
    }

    pub fn bounds(&self, derived: BTreeSet<Fact>) -> impl Iterator<Item = Fact> {
        let bounded = derived.into_iter().filter(|(name, _)| self.bounded.contains(name));
        bounded.map(|(name, row)| (possible(&name), row))
    }

    /// Replaces each atom of a bounded predicate in conditions of actions and in axioms by its conjunction
    /// with the companion's atom, and adds the companion to each axiom of a bounded predicate.
    pub fn restrict(&self, domain: &mut Domain) {
        let declared: Vec<Declaration> = domain
            .predicates
            .iter()
            .filter(|atom| self.bounded.contains(&atom.identifier.name))
            .cloned()
            .collect();
        for atom in declared {
            let untyped = |atom: TypedName| TypedName { r#type: TypeExpression::default(), ..atom };
            let identifier = possible(&atom.identifier.name).into();
            let parameters = atom.parameters.into_iter().map(untyped).collect();
            domain.predicates.push(Declaration { identifier, parameters });
        }
        for Derived { head, condition, .. } in &mut domain.derived {
            self.condition(condition);
            if self.bounded.contains(&head.identifier.name) {
                let arguments =
                    head.parameters.iter().map(|atom| Term::Variable(atom.identifier.clone())).collect();
                let atom = Atom { predicate: head.identifier.clone(), arguments, span: head.identifier.span };
                let inner = std::mem::replace(condition, Condition::And(Vec::new()));
                *condition = Condition::And(vec![possible_atom(&atom), inner]);
            }
        }
        for action in &mut domain.actions {
            match &mut action.body {
                ActionBody::Instantaneous { precondition, effect } => {
                    self.condition(precondition);
                    self.effect(effect);
                }
                ActionBody::Durative { conditions, effects, .. } => {
                    for (_, condition) in conditions {
                        self.condition(condition);
                    }
                    for (_, effect) in effects {
                        self.effect(effect);
                    }
                }
            }
        }
    }

    fn condition(&self, condition: &mut Condition) {
        match condition {
            Condition::Atom(atom) if self.bounded.contains(&atom.predicate.name) => {
                *condition = Condition::And(vec![possible_atom(atom), Condition::Atom(atom.clone())]);
            }
            other => other.parts_mut().for_each(|part| self.condition(part)),
        }
    }

    fn effect(&self, effect: &mut Effect) {
        if let Effect::When(condition, _) = effect {
            self.condition(condition);
        }
        effect.parts_mut().iter_mut().for_each(|part| self.effect(part));
    }
}

pub(super) fn possible(name: &Name) -> Name {
    Name::new(&format!("possible-{name}"))
}

fn possible_atom(atom: &Atom) -> Condition {
    Condition::Atom(Atom { predicate: possible(&atom.predicate.name).into(), ..atom.clone() })
}

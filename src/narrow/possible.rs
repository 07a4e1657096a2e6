//! What derived predicates can hold of at most, whatever actions do.
//!
//! A predicate that is not settled stays derived. That it can hold of few things only, though its parameters have no types, is
//! known all the same: nothing else than what actions add can make it hold of more. So for each such predicate there is one more,
//! `possible-…`, which no action changes and which holds wherever the predicate can; an atom and the conjunction of both are the
//! same in every state. Who goes through all objects that a variable can stand for, as the checker of certificates does, goes
//! through few.

use std::collections::{BTreeMap, BTreeSet};

use pddl::ast::{
    ActionBody, Atom, Condition, Declaration, Derived, Domain, Effect, Name, Term, TypeExpression, TypedName,
};

use super::clause::{Clause, Fact, Literal};
use super::settle::{Additions, additions, same};

/// A fact that an action may add.
#[derive(Debug, Clone)]
struct Addition {
    predicate: Name,
    arguments: Vec<Argument>,
}

/// What an argument of it can be: one object, or what some classes hold of.
#[derive(Debug, Clone)]
enum Argument {
    Object(Name),
    Of(Vec<Name>),
}

/// The predicates that have a bound, and what it is made of.
#[derive(Debug, Clone, Default)]
pub(super) struct Possible {
    bounded: BTreeSet<Name>,
    additions: Vec<Addition>,
    /// The clauses of those predicates.
    clauses: Vec<Clause>,
}

impl Possible {
    /// Which of the open predicates, with clauses or without, have a bound: those that depend on changed ones of which it is asked
    /// that their arguments are in classes of the knowledge base.
    pub fn new(
        domain: &Domain,
        open: &BTreeMap<Name, Option<Vec<Clause>>>,
        (changed, timed): (&BTreeSet<Name>, &BTreeSet<Name>),
        is_class: &dyn Fn(&Name) -> bool,
    ) -> Self {
        let mut free = timed.clone();
        free.extend(open.iter().filter(|(_, own)| own.is_none()).map(|(name, _)| name.clone()));
        // What a settled predicate holds of is computed before the bounds; an open one may hold of more things in other states.
        let varying: BTreeSet<Name> = changed.iter().chain(open.keys()).cloned().collect();
        let mut all = Vec::new();
        for action in &domain.actions {
            let Additions { classes, atoms } = additions(action, &varying);
            for (atom, bound) in atoms {
                let argument = |term: &Term| match term {
                    Term::Constant(own) => Some(Argument::Object(own.name.clone())),
                    Term::Variable(own) if bound.contains(&&own.name) => None,
                    Term::Variable(_) => {
                        let own = classes.iter().filter(|(class, of)| is_class(class) && same(of, term));
                        let own: Vec<Name> = own.map(|(class, _)| class.clone()).collect();
                        (!own.is_empty()).then_some(Argument::Of(own))
                    }
                };
                let predicate = atom.predicate.name.clone();
                match atom.arguments.iter().map(argument).collect() {
                    Some(arguments) => all.push(Addition { predicate, arguments }),
                    None => {
                        free.insert(predicate);
                    }
                }
            }
        }
        loop {
            let is_free = |part: &Literal| part.name().is_some_and(|name| free.contains(name));
            let asks = |clauses: &Vec<Clause>| {
                clauses.iter().any(|own| !own.is_bound() || own.body.iter().any(is_free))
            };
            let more =
                open.iter().filter(|(name, own)| !free.contains(*name) && own.as_ref().is_none_or(asks));
            let more: Vec<Name> = more.map(|(name, _)| name.clone()).collect();
            if more.is_empty() {
                break;
            }
            free.extend(more);
        }
        let bounded: BTreeSet<Name> = open.keys().filter(|name| !free.contains(*name)).cloned().collect();
        let clauses = bounded.iter().filter_map(|name| open[name].clone()).flatten().collect();
        Self { bounded, additions: all, clauses }
    }

    pub fn clauses(&self) -> impl Iterator<Item = &Clause> {
        self.clauses.iter()
    }

    /// Facts that actions may add, given the facts that hold in every state: those that are stated, and those of settled predicates.
    pub fn added(&self, fixed: &BTreeSet<Fact>) -> BTreeSet<Fact> {
        let members = |class: &Name| -> BTreeSet<Name> {
            let own = fixed.iter().filter(|(name, row)| name == class && row.len() == 1);
            own.map(|(_, row)| row[0].clone()).collect()
        };
        let mut facts = BTreeSet::new();
        for addition in &self.additions {
            let mut rows: Vec<Vec<Name>> = vec![Vec::new()];
            for argument in &addition.arguments {
                let own: BTreeSet<Name> = match argument {
                    Argument::Object(object) => BTreeSet::from([object.clone()]),
                    Argument::Of(classes) => {
                        let mut all = classes.iter().map(members);
                        let first = all.next().unwrap_or_default();
                        all.fold(first, |one, other| one.intersection(&other).cloned().collect())
                    }
                };
                let longer = |row: &Vec<Name>| -> Vec<Vec<Name>> {
                    own.iter().map(|object| [row.clone(), vec![object.clone()]].concat()).collect()
                };
                rows = rows.iter().flat_map(longer).collect();
            }
            facts.extend(rows.into_iter().map(|row| (addition.predicate.clone(), row)));
        }
        facts
    }

    /// The bounds of the predicates, from all that can be derived.
    pub fn bounds(&self, derived: BTreeSet<Fact>) -> impl Iterator<Item = Fact> {
        let own = derived.into_iter().filter(|(name, _)| self.bounded.contains(name));
        own.map(|(name, row)| (possible(&name), row))
    }

    /// Says in a domain of each atom that has a bound that it is possible.
    pub fn restrict(&self, domain: &mut Domain) {
        let declared: Vec<Declaration> = domain
            .predicates
            .iter()
            .filter(|own| self.bounded.contains(&own.identifier.name))
            .cloned()
            .collect();
        for own in declared {
            let untyped = |own: TypedName| TypedName { r#type: TypeExpression::default(), ..own };
            let identifier = possible(&own.identifier.name).into();
            let parameters = own.parameters.into_iter().map(untyped).collect();
            domain.predicates.push(Declaration { identifier, parameters });
        }
        for Derived { head, condition, .. } in &mut domain.derived {
            self.condition(condition);
            if self.bounded.contains(&head.identifier.name) {
                let arguments =
                    head.parameters.iter().map(|own| Term::Variable(own.identifier.clone())).collect();
                let own = Atom { predicate: head.identifier.clone(), arguments, span: head.identifier.span };
                let inner = std::mem::replace(condition, Condition::And(Vec::new()));
                *condition = Condition::And(vec![possible_atom(&own), inner]);
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
            Condition::Atom(own) if self.bounded.contains(&own.predicate.name) => {
                *condition = Condition::And(vec![possible_atom(own), Condition::Atom(own.clone())]);
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

/// The name of the bound of a predicate.
pub(super) fn possible(name: &Name) -> Name {
    Name::new(&format!("possible-{name}"))
}

fn possible_atom(own: &Atom) -> Condition {
    Condition::Atom(Atom { predicate: possible(&own.predicate.name).into(), ..own.clone() })
}

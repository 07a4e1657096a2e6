//! The atoms and fluents that a happening reads, according to the definition of interference: all
//! atoms and fluents in conditions, durations, conditions of effects and right-hand sides of
//! effects, whether or not they affect the outcome. A quantifier reads all its instances. A derived
//! predicate reads all predicates and functions on which it depends.

use rustc_hash::FxHashMap;

use crate::faithful::axioms::Axioms;
use crate::faithful::key::Key;
use crate::faithful::timeline::Event;
use crate::faithful::world::World;
use pddl::ast::{Atom, Condition, Effect, Expression, Name, Term, TypedName};

pub(super) struct Reads<'r> {
    pub(super) world: &'r World<'r>,
    pub(super) axioms: &'r Axioms,
    pub(super) binding: FxHashMap<&'r Name, u32>,
    pub(super) conditions: Vec<&'r Condition>,
    pub(super) effects: Vec<&'r Effect>,
    pub(super) durations: Vec<&'r Expression>,
}

#[derive(Clone, Copy)]
enum ReadQuery<'w> {
    Atom(&'w Key),
    Fluent(&'w Key),
}

impl Reads<'_> {
    pub(super) fn event(&self, event: &Event) -> bool {
        event.truths.keys().any(|key| self.atom(key))
    }

    pub(super) fn atom(&self, key: &Key) -> bool {
        self.reads(ReadQuery::Atom(key))
    }

    pub(super) fn fluent(&self, key: &Key) -> bool {
        self.reads(ReadQuery::Fluent(key))
    }

    fn reads(&self, wanted: ReadQuery<'_>) -> bool {
        let mut search = Search { reads: self, wanted, scope: Vec::new() };
        self.conditions.iter().any(|condition| search.condition(condition))
            || self.effects.iter().any(|effect| search.effect(effect))
            || self.durations.iter().any(|duration| search.expression(duration))
    }
}

struct Search<'s> {
    reads: &'s Reads<'s>,
    wanted: ReadQuery<'s>,
    scope: Vec<&'s TypedName>,
}

impl<'s> Search<'s> {
    fn condition(&mut self, condition: &'s Condition) -> bool {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => parts.iter().any(|part| self.condition(part)),
            Condition::Not(inner) => self.condition(inner),
            Condition::Imply(left, right) => self.condition(left) || self.condition(right),
            Condition::Exists(bound, inner) | Condition::ForAll(bound, inner) => {
                self.within(bound, |own| own.condition(inner))
            }
            Condition::Atom(atom) => self.atom(atom),
            Condition::Equal(..) => false,
            Condition::Compare(_, left, right, _) => self.expression(left) || self.expression(right),
        }
    }

    fn effect(&mut self, effect: &'s Effect) -> bool {
        match effect {
            Effect::And(parts) => parts.iter().any(|part| self.effect(part)),
            Effect::ForAll(bound, inner) => self.within(bound, |own| own.effect(inner)),
            Effect::When(condition, inner) => self.condition(condition) || self.effect(inner),
            Effect::Add(_) | Effect::Delete(_) => false,
            Effect::Assign(_, _, value, _) => self.expression(value),
        }
    }

    fn within(&mut self, bound: &'s [TypedName], read: impl FnOnce(&mut Self) -> bool) -> bool {
        let outer = self.scope.len();
        self.scope.extend(bound);
        let is_read = read(self);
        self.scope.truncate(outer);
        is_read
    }

    fn expression(&self, expression: &Expression) -> bool {
        match (expression, self.wanted) {
            (Expression::Fluent(atom), ReadQuery::Fluent(key)) => self.is_instance(atom, key),
            (Expression::Operation(_, parts, _), _) => parts.iter().any(|part| self.expression(part)),
            _ => false,
        }
    }

    fn atom(&self, atom: &Atom) -> bool {
        let Reads { world, axioms, .. } = self.reads;
        let Ok(symbol) = world.symbol(&atom.predicate.name) else { return false };
        let (ReadQuery::Atom(key) | ReadQuery::Fluent(key)) = self.wanted;
        if world.rules(symbol).is_some() {
            return axioms.depends(symbol, std::iter::once(key.0));
        }
        matches!(self.wanted, ReadQuery::Atom(_)) && self.is_instance(atom, key)
    }

    fn is_instance(&self, atom: &Atom, key: &Key) -> bool {
        let Reads { world, binding, .. } = self.reads;
        let mut chosen: FxHashMap<usize, u32> = FxHashMap::default();
        let mut fits = |(term, object): (&Term, &u32)| {
            let quantified = match term {
                Term::Variable(own) => self.scope.iter().rposition(|other| other.identifier.name == own.name),
                Term::Constant(_) => None,
            };
            match quantified {
                Some(place) => {
                    world.is_of(*object, &self.scope[place].r#type)
                        && *chosen.entry(place).or_insert(*object) == *object
                }
                None => world.object(term, binding) == Ok(*object),
            }
        };
        world.symbol(&atom.predicate.name) == Ok(key.0)
            && atom.arguments.len() == key.1.len()
            && atom.arguments.iter().zip(&key.1).all(&mut fits)
    }
}

//! Interference of happenings: the mutex rule of PDDL 2.1 ("no moving targets").

use std::rc::Rc;

use rustc_hash::FxHashSet;
use smallvec::SmallVec;

use crate::ast::{
    ActionBody, Atom, Condition, ConditionTime, Effect, EffectTime, Expression, Name, Term, TypedName,
};

use super::effects::{Change, Changes, Ground};
use super::evaluate::Bindings;
use super::running::Running;
use super::step::{conditions, effects};
use super::world::{Symbol, World};

/// Atom or numeric function that a happening reads. Quantified arguments match several objects.
#[derive(Debug, Clone)]
struct Pattern {
    symbol: Symbol,
    /// Arguments to match; `None` matches all arguments.
    arguments: Option<SmallVec<[Slot; 4]>>,
}

#[derive(Debug, Clone)]
enum Slot {
    Object(Symbol),
    /// Any object of a quantifier's type. The number identifies the quantified variable: equal numbers in one
    /// pattern mean equal objects.
    Each(usize, Rc<FxHashSet<Symbol>>),
}

impl Pattern {
    fn matches(&self, (symbol, arguments): &Ground) -> bool {
        let Some(pattern) = &self.arguments else { return self.symbol == *symbol };
        let mut bound: SmallVec<[(usize, Symbol); 4]> = SmallVec::new();
        let mut fits = |(slot, argument): (&Slot, &Symbol)| match slot {
            Slot::Object(object) => object == argument,
            Slot::Each(variable, objects) => {
                bound.push((*variable, *argument));
                let is_consistent = bound
                    .iter()
                    .all(|(bound_variable, object)| bound_variable != variable || object == argument);
                is_consistent && objects.contains(argument)
            }
        };
        self.symbol == *symbol
            && pattern.len() == arguments.len()
            && pattern.iter().zip(arguments).all(&mut fits)
    }
}

#[derive(Debug, Clone, Default)]
pub(super) struct Footprint {
    facts_read: Vec<Pattern>,
    values_read: Vec<Pattern>,
    added: Vec<Ground>,
    deleted: Vec<Ground>,
    /// Changed functions, each with the kind of change: 0 assign, 1 add, 2 scale. Two additions commute, and
    /// so do two scalings.
    values_written: Vec<(Ground, u8)>,
}

impl Footprint {
    pub(super) fn of<'p>(
        world: &World<'p>,
        running: &Running<'_, 'p>,
        when: EffectTime,
        changes: &Changes,
    ) -> Self {
        let mut footprint = Self::default();
        let mut predicates = Vec::new();
        let bindings = &running.instance.bindings;
        let mut record = |usage: Use<'p>, hidden: &[&'p TypedName]| match usage {
            Use::Fact(atom) => {
                predicates.push(&atom.predicate.name);
                footprint.facts_read.push(pattern(world, bindings, atom, hidden));
            }
            Use::Value(atom) => footprint.values_read.push(pattern(world, bindings, atom, hidden)),
        };
        let condition_time = match when {
            EffectTime::AtStart => ConditionTime::AtStart,
            EffectTime::AtEnd => ConditionTime::AtEnd,
        };
        let mut hidden = Vec::new();
        for condition in conditions(&running.instance, condition_time) {
            uses_of_condition(condition, &mut hidden, &mut record);
        }
        for effect in effects(&running.instance, when) {
            uses_of_effect(effect, &mut hidden, &mut record);
        }
        if let ActionBody::Durative { duration, .. } = &running.instance.action.body {
            for constraint in duration.iter().filter(|constraint| constraint.time == when) {
                uses_of_expression(&constraint.expression, &[], &mut record);
            }
        }
        read_through_axioms(world, predicates, &mut footprint);
        footprint.added.extend(changes.added.iter().cloned());
        footprint.deleted.extend(changes.deleted.iter().cloned());
        footprint.values_written.extend(changes.numeric.iter().map(|(target, change)| {
            let kind = match change {
                Change::Assign(_) => 0,
                Change::Add(_) => 1,
                Change::Scale(_) => 2,
            };
            (target.clone(), kind)
        }));
        footprint
    }

    pub(super) fn of_event(changes: &Changes) -> Self {
        let (added, deleted) = (changes.added.iter().cloned(), changes.deleted.iter().cloned());
        Self { added: added.collect(), deleted: deleted.collect(), ..Self::default() }
    }

    pub(super) fn join(&mut self, other: Self) {
        self.facts_read.extend(other.facts_read);
        self.values_read.extend(other.values_read);
        self.added.extend(other.added);
        self.deleted.extend(other.deleted);
        self.values_written.extend(other.values_written);
    }

    /// Returns a fact or function at which the two happenings interfere; `None` if they do not interfere.
    pub(super) fn interferes(&self, other: &Self) -> Option<Ground> {
        let read_or_deleted = self.disturbs(other).or_else(|| other.disturbs(self));
        read_or_deleted.or_else(|| {
            // Assignments (0) never commute, not even assignments of equal values.
            let clash = |(target, kind): &&(Ground, u8)| {
                other
                    .values_written
                    .iter()
                    .any(|(written, other_kind)| written == target && (kind != other_kind || *kind == 0))
            };
            self.values_written.iter().find(clash).map(|(target, _)| target.clone())
        })
    }

    /// Returns a fact or function that `self` writes and `other` reads, or that `self` adds and `other`
    /// deletes.
    fn disturbs(&self, other: &Self) -> Option<Ground> {
        let is_read = |fact: &&Ground| other.facts_read.iter().any(|pattern| pattern.matches(fact));
        let changed = self.added.iter().chain(&self.deleted).find(is_read);
        let removed = || self.added.iter().find(|fact| other.deleted.contains(fact));
        let value_is_read =
            |target: &&Ground| other.values_read.iter().any(|pattern| pattern.matches(target));
        let written = || self.values_written.iter().map(|(target, _)| target).find(value_is_read);
        changed.or_else(removed).or_else(written).cloned()
    }
}

#[derive(Clone, Copy)]
enum Use<'c> {
    Fact(&'c Atom),
    Value(&'c Atom),
}

type OnUse<'f, 'c> = &'f mut dyn FnMut(Use<'c>, &[&'c TypedName]);

fn uses_of_condition<'c>(condition: &'c Condition, hidden: &mut Vec<&'c TypedName>, on_use: OnUse<'_, 'c>) {
    match condition {
        Condition::Exists(variables, body) | Condition::ForAll(variables, body) => {
            let outer = hidden.len();
            hidden.extend(variables);
            uses_of_condition(body, hidden, on_use);
            hidden.truncate(outer);
        }
        Condition::Atom(atom) => on_use(Use::Fact(atom), hidden),
        Condition::Compare(_, left, right, _) => {
            uses_of_expression(left, hidden, on_use);
            uses_of_expression(right, hidden, on_use);
        }
        other => other.parts().for_each(|part| uses_of_condition(part, hidden, on_use)),
    }
}

fn uses_of_effect<'c>(effect: &'c Effect, hidden: &mut Vec<&'c TypedName>, on_use: OnUse<'_, 'c>) {
    match effect {
        Effect::ForAll(variables, body) => {
            let outer = hidden.len();
            hidden.extend(variables);
            uses_of_effect(body, hidden, on_use);
            hidden.truncate(outer);
        }
        Effect::When(condition, body) => {
            uses_of_condition(condition, hidden, on_use);
            uses_of_effect(body, hidden, on_use);
        }
        Effect::Assign(_, _, value, _) => uses_of_expression(value, hidden, on_use),
        other => other.parts().iter().for_each(|part| uses_of_effect(part, hidden, on_use)),
    }
}

fn uses_of_expression<'c>(expression: &'c Expression, hidden: &[&'c TypedName], on_use: OnUse<'_, 'c>) {
    expression.walk_fluents(&mut |atom| on_use(Use::Value(atom), hidden));
}

fn pattern(world: &World<'_>, bindings: &Bindings<'_>, atom: &Atom, hidden: &[&TypedName]) -> Pattern {
    let arguments = atom.arguments.iter().map(|term| match term {
        Term::Variable(identifier) => {
            match hidden.iter().rposition(|entry| entry.identifier.name == identifier.name) {
                Some(index) => Slot::Each(index, Rc::new(world.objects_of(&hidden[index].r#type).collect())),
                None => {
                    Slot::Object(bindings.get(&identifier.name).unwrap_or(world.symbol(&identifier.name)))
                }
            }
        }
        Term::Constant(identifier) => Slot::Object(world.symbol(&identifier.name)),
    });
    Pattern { symbol: world.symbol(&atom.predicate.name), arguments: Some(arguments.collect()) }
}

/// Adds all predicates and functions on which the derived predicates among `read` depend. All their instances
/// count as read.
fn read_through_axioms(world: &World<'_>, read: Vec<&Name>, into: &mut Footprint) {
    let mut visited: FxHashSet<&Name> = FxHashSet::default();
    let mut todo = read;
    while let Some(name) = todo.pop() {
        if !visited.insert(name) {
            continue;
        }
        for axiom in world.axioms.get(name).into_iter().flatten() {
            uses_of_condition(&axiom.condition, &mut Vec::new(), &mut |usage, _| {
                let (Use::Fact(atom) | Use::Value(atom)) = usage;
                let pattern = Pattern { symbol: world.symbol(&atom.predicate.name), arguments: None };
                match usage {
                    Use::Fact(_) => {
                        todo.push(&atom.predicate.name);
                        into.facts_read.push(pattern);
                    }
                    Use::Value(_) => into.values_read.push(pattern),
                }
            });
        }
    }
}

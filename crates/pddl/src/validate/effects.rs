//! Effects of happenings. All effects are evaluated in the state before the happening and then applied at
//! once. If an atom is both added and deleted, it is added.

use num_rational::BigRational;
use num_traits::{One, Zero};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::ast::{Arithmetic, Assignment, Effect};

use super::evaluate::{Bindings, Evaluator, Undefined, apply};
use super::world::{Arguments, State, Symbol, World};

pub(super) type Ground = (Symbol, Arguments);

#[derive(Debug, Default)]
pub(super) struct Changes {
    pub(super) added: FxHashSet<Ground>,
    pub(super) deleted: FxHashSet<Ground>,
    pub(super) numeric: FxHashMap<Ground, Change>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Change {
    Assign(BigRational),
    Add(BigRational),
    Scale(BigRational),
}

#[derive(Debug)]
pub(super) enum EffectError {
    Undefined(Undefined),
    /// One function is changed in two ways that do not commute.
    Conflict(Ground),
}

impl From<Undefined> for EffectError {
    fn from(undefined: Undefined) -> Self {
        Self::Undefined(undefined)
    }
}

impl<'p> Evaluator<'_, 'p> {
    pub(super) fn collect(
        &self,
        effect: &'p Effect,
        bindings: &mut Bindings<'p>,
        changes: &mut Changes,
    ) -> Result<(), EffectError> {
        match effect {
            Effect::And(parts) => parts.iter().try_for_each(|part| self.collect(part, bindings, changes)),
            Effect::Add(atom) | Effect::Delete(atom) => {
                let predicate = self.world.symbol(&atom.predicate.name);
                if let Some(arguments) = self.arguments(atom, bindings) {
                    let is_add = matches!(effect, Effect::Add(_));
                    let set = if is_add { &mut changes.added } else { &mut changes.deleted };
                    set.insert((predicate, arguments));
                }
                Ok(())
            }
            Effect::ForAll(variables, body) => {
                let mut result = Ok(());
                self.world.each(variables, bindings, &mut |bindings| {
                    result = self.collect(body, bindings, changes);
                    result.is_ok()
                });
                result
            }
            Effect::When(condition, body) => {
                if self.holds(condition, bindings)? {
                    self.collect(body, bindings, changes)
                } else {
                    Ok(())
                }
            }
            Effect::Assign(kind, target, value, _) => {
                let symbol = self.world.symbol(&target.predicate.name);
                let arguments = self.arguments(target, bindings).unwrap_or_default();
                let value = self.value(value, bindings)?;
                changes.record((symbol, arguments), change(*kind, value)?)
            }
        }
    }

    /// Like [`Self::collect`], but leaves out the parts of the effect that cannot be evaluated.
    pub(super) fn collect_defined(
        &self,
        effect: &'p Effect,
        bindings: &mut Bindings<'p>,
        changes: &mut Changes,
    ) {
        match effect {
            Effect::And(parts) => {
                for part in parts {
                    self.collect_defined(part, bindings, changes);
                }
            }
            Effect::ForAll(variables, body) => {
                self.world.each(variables, bindings, &mut |bindings| {
                    self.collect_defined(body, bindings, changes);
                    true
                });
            }
            Effect::When(condition, body) => {
                if self.holds(condition, bindings).unwrap_or(false) {
                    self.collect_defined(body, bindings, changes);
                }
            }
            Effect::Add(_) | Effect::Delete(_) | Effect::Assign(..) => {
                // An error of a single effect leaves `changes` as they are.
                let _ = self.collect(effect, bindings, changes);
            }
        }
    }
}

fn change(kind: Assignment, value: BigRational) -> Result<Change, Undefined> {
    Ok(match kind {
        Assignment::Assign => Change::Assign(value),
        Assignment::Increase => Change::Add(value),
        Assignment::Decrease => Change::Add(-value),
        Assignment::ScaleUp => Change::Scale(value),
        Assignment::ScaleDown => Change::Scale(apply(Arithmetic::Divide, &BigRational::one(), &value)?),
    })
}

impl Changes {
    fn record(&mut self, target: Ground, change: Change) -> Result<(), EffectError> {
        let combined = match (self.numeric.get(&target), change) {
            (None, change) => change,
            (Some(Change::Add(earlier)), Change::Add(value)) => {
                Change::Add(apply(Arithmetic::Add, earlier, &value)?)
            }
            (Some(Change::Scale(earlier)), Change::Scale(value)) => {
                Change::Scale(apply(Arithmetic::Multiply, earlier, &value)?)
            }
            (Some(Change::Assign(earlier)), Change::Assign(value)) if *earlier == value => {
                Change::Assign(value)
            }
            _ => return Err(EffectError::Conflict(target)),
        };
        self.numeric.insert(target, combined);
        Ok(())
    }

    pub(super) fn merge(&mut self, other: Self) -> Result<(), EffectError> {
        self.added.extend(other.added);
        self.deleted.extend(other.deleted);
        other.numeric.into_iter().try_for_each(|(target, change)| self.record(target, change))
    }

    /// Applies the changes to a state. On an error the state remains unchanged.
    pub(super) fn apply(self, world: &World<'_>, state: &mut State) -> Result<(), EffectError> {
        // All values are computed first, so that an error leaves the state unchanged.
        let mut values = Vec::new();
        for (target, change) in self.numeric {
            let new_value = new_value(world, state, &target, &change)?;
            values.push((target, new_value));
        }
        state.values.extend(values);
        change_facts(self.added, self.deleted, state);
        Ok(())
    }

    /// Removes the changes of values that have no result, for example increases of a function without a value.
    pub(super) fn retain_defined(&mut self, world: &World<'_>, state: &State) {
        self.numeric.retain(|target, change| new_value(world, state, target, change).is_ok());
    }

    pub(super) fn concern(&self, symbols: &FxHashSet<Symbol>) -> bool {
        let facts = self.added.iter().chain(&self.deleted);
        facts.chain(self.numeric.keys()).any(|(symbol, _)| symbols.contains(symbol))
    }

    pub(super) fn apply_facts(self, state: &mut State) {
        change_facts(self.added, self.deleted, state);
    }

    pub(super) fn is_neutral(&self) -> bool {
        let is_zero = |change: &Change| matches!(change, Change::Add(value) if value.is_zero());
        self.added.is_empty() && self.deleted.is_empty() && self.numeric.values().all(is_zero)
    }
}

fn new_value(
    world: &World<'_>,
    state: &State,
    target: &Ground,
    change: &Change,
) -> Result<BigRational, Undefined> {
    let old_value = || {
        let show = || Undefined::Function(world.show(target.0, &target.1));
        state.values.get(target).ok_or_else(show)
    };
    match change {
        Change::Assign(value) => Ok(value.clone()),
        Change::Add(value) => apply(Arithmetic::Add, old_value()?, value),
        Change::Scale(value) => apply(Arithmetic::Multiply, old_value()?, value),
    }
}

fn change_facts(added: FxHashSet<Ground>, deleted: FxHashSet<Ground>, state: &mut State) {
    for (predicate, arguments) in deleted {
        if let Some(tuples) = state.facts.get_mut(&predicate) {
            tuples.remove(&arguments);
        }
    }
    for (predicate, arguments) in added {
        state.facts.entry(predicate).or_default().insert(arguments);
    }
}

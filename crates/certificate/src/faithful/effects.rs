//! Compares the effects of a case (outcome of an action instance under a condition) and of an
//! operator on the variables and numbers of the task.

use std::collections::{BTreeMap, BTreeSet};

use crate::faithful::case::Case;
use crate::faithful::formula::{Formula, Known};
use crate::faithful::key::{CLOCK, Key};
use crate::faithful::linear::Linear;
use crate::faithful::translation::Translation;
use crate::model::Operator;

/// Upper limit on the number of partial states that are examined for one variable (see [`Variable::agrees`]).
/// If a truth value is open, a partial state is replaced by several.
const SPLIT_LIMIT: usize = 1_024;

#[derive(Clone, Copy)]
pub(super) struct Made<'m> {
    pub(super) operator: &'m Operator,
    pub(super) choice: &'m [u32],
}

pub(super) enum Mismatch {
    Differs(String),
    /// The comparison is undecided: either it is not proved that at most one of these atoms (the
    /// values of a variable) holds after the case, or the limit on partial states is reached.
    Unknown(String),
}

/// Compares the effects of a case with those of an operator, or with no effects if `operator` is
/// `None`. The clock is not compared.
pub(super) fn compare(
    task: &Translation<'_>,
    case: &Case,
    known: &Known,
    operator: Option<Made<'_>>,
) -> Result<(), Mismatch> {
    numbers(task, case, operator)?;
    let touched = case.truths.keys().chain(case.effects.iter().map(|(_, key, _)| key));
    let touched = touched.filter_map(|key| Some(task.names.fact(key)?.0));
    let mut variables: BTreeSet<u32> = touched.collect();
    if let Some(Made { operator, .. }) = operator {
        let conditional = operator.conditional.iter().flat_map(|conditional| &conditional.effects);
        variables.extend(operator.effects.iter().chain(conditional).map(|fact| fact.0));
    }
    for variable in variables {
        let comparison = Variable::new(task, case, operator.map(|operator| operator.operator), variable);
        let words = || task.model.variables[variable as usize].join(" or ");
        match comparison.agrees(known) {
            Some(true) => {}
            Some(false) => return Err(Mismatch::Differs(words())),
            None => return Err(Mismatch::Unknown(words())),
        }
    }
    Ok(())
}

fn numbers(task: &Translation<'_>, case: &Case, operator: Option<Made<'_>>) -> Result<(), Mismatch> {
    let fluents = (0..).zip(&task.names.fluents);
    // The clock is not compared by its value: `keeps_time` in `compare` checks it.
    for (number, key) in fluents.filter(|(_, key)| key.0 != CLOCK) {
        let unchanged = || task.invariant.settled(&Linear::fluent(key.clone()));
        let expected = case.changes.get(key).map_or_else(unchanged, |after| task.invariant.settled(after));
        let actual = operator.and_then(|Made { operator, choice }| {
            let (_, value) = operator.changes.iter().find(|(changed, _)| *changed == number)?;
            Some(task.value(value, choice, &task.model.sizes(operator)))
        });
        if actual.unwrap_or_else(unchanged) != expected {
            return Err(Mismatch::Differs(task.world.show(key)));
        }
    }
    Ok(())
}

struct Variable<'v> {
    task: &'v Translation<'v>,
    own: u32,
    case: &'v Case,
    effects: Vec<&'v (Formula, Key, bool)>,
    /// Atoms of the variable that the case may add or delete. The key is the value of the variable that represents the
    /// atom.
    touched: BTreeMap<u32, &'v Key>,
    certain: Option<u32>,
    conditional: Vec<(Formula, u32)>,
}

enum Outcome<'o> {
    Same,
    Other,
    Unknown,
    Open(Formula),
    OpenPart(&'o Formula),
}

/// A value of a variable; `None` if the value is unchanged or unknown.
type Value = Option<u32>;

impl<'v> Variable<'v> {
    fn new(task: &'v Translation<'v>, case: &'v Case, operator: Option<&'v Operator>, variable: u32) -> Self {
        let value = |key: &Key| task.names.fact(key).filter(|fact| fact.0 == variable).map(|fact| fact.1);
        let effects: Vec<_> = case.effects.iter().filter(|(_, key, _)| value(key).is_some()).collect();
        let touched = case.truths.keys().chain(effects.iter().map(|(_, key, _)| key));
        let touched = touched.filter_map(|key| Some((value(key)?, key))).collect();
        let assigned =
            |facts: &[(u32, u32)]| facts.iter().rev().find(|fact| fact.0 == variable).map(|fact| fact.1);
        let conditional = operator.into_iter().flat_map(|operator| &operator.conditional);
        let conditional = conditional
            .filter_map(|effect| Some((task.literals(&effect.condition, true), assigned(&effect.effects)?)))
            .collect();
        let certain = operator.and_then(|operator| assigned(&operator.effects));
        Self { task, own: variable, case, effects, touched, certain, conditional }
    }

    /// Returns `Some(true)` if the case and the operator agree in all states that satisfy `known`.
    /// Returns `Some(false)` if they differ in a partial state that extends `known`, and `None` if
    /// neither is proved.
    fn agrees(&self, known: &Known) -> Option<bool> {
        let structure = &self.task.names.structure;
        let mut open = vec![known.clone()];
        for _ in 0..SPLIT_LIMIT {
            let Some(known) = open.pop() else { return Some(true) };
            let outcome = self.outcome(&known);
            let leaf = match &outcome {
                Outcome::Same => continue,
                Outcome::Other => return Some(false),
                Outcome::Unknown => return None,
                Outcome::Open(leaf) => leaf,
                Outcome::OpenPart(leaf) => leaf,
            };
            open.extend(known.split(structure, std::iter::once(leaf)).ok()?);
        }
        open.is_empty().then_some(true)
    }

    fn outcome(&self, known: &Known) -> Outcome<'_> {
        let structure = &self.task.names.structure;
        let guards = self.effects.iter().map(|(guard, ..)| guard);
        for guard in guards.chain(self.conditional.iter().map(|(guard, _)| guard)) {
            if let Some(leaf) = known.open(structure, guard, &|_| true) {
                return Outcome::OpenPart(leaf);
            }
        }
        let holds = |guard: &Formula| known.decide(structure, guard) == Some(true);
        let last = self.conditional.iter().rev().find(|(guard, _)| holds(guard)).map(|(_, value)| *value);
        let actual: Value = last.or(self.certain);
        let current = self.current(known);
        let expected = match self.expected(known, current) {
            Ok(expected) => expected,
            Err(outcome) => return outcome,
        };
        if expected == actual {
            return Outcome::Same;
        }
        if let Some(current) = current {
            let equal = expected.unwrap_or(current) == actual.unwrap_or(current);
            return if equal { Outcome::Same } else { Outcome::Other };
        }
        let mut possible = self.possible(known);
        possible.next().map_or(Outcome::Unknown, |(_, key)| Outcome::Open(Formula::Atom(key.clone(), true)))
    }

    fn may_hold(&self, known: &Known, key: &Key) -> bool {
        self.task.invariant.may_hold(key) && known.atom(&self.task.names.structure, key) != Some(false)
    }

    fn possible(&self, known: &'v Known) -> impl Iterator<Item = (u32, &'v Key)> {
        // If one atom of the variable holds, the other atoms do not.
        let holding = known.holding(self.own);
        let held_atom = holding.and_then(|key| Some((self.task.names.fact(key)?.1, key)));
        let possible_atoms = if holding.is_some() { None } else { Some(self.task.possible(self.own)) };
        possible_atoms.into_iter().flatten().chain(held_atom).filter(|(_, key)| self.may_hold(known, key))
    }

    fn current(&self, known: &Known) -> Value {
        let structure = &self.task.names.structure;
        match self.possible(known).next() {
            None => Some(self.task.model.none(self.own)),
            Some((value, key)) if known.atom(structure, key) == Some(true) => Some(value),
            Some(_) => None,
        }
    }

    /// Returns the value of the variable after the case according to the PDDL files; `None` if it
    /// is unchanged. The error `Open` names a formula whose truth value is needed. `Unknown` means
    /// that it is not proved that at most one atom of the variable then holds.
    fn expected(&self, known: &Known, current: Value) -> Result<Value, Outcome<'_>> {
        let structure = &self.task.names.structure;
        let after = |key: &Key| {
            let effects = self.effects.iter().filter(|(_, atom, _)| atom == key);
            let mut active =
                effects.filter(|(guard, ..)| known.decide(structure, guard) == Some(true)).peekable();
            match active.peek() {
                Some(_) => Some(active.any(|(_, _, holds)| *holds)),
                None => self.case.truths.get(key).copied(),
            }
        };
        let no_atom = self.task.model.none(self.own);
        let (mut added, mut deleted) = (Vec::new(), None);
        let mut remains = self.possible(known).any(|(value, _)| !self.touched.contains_key(&value));
        for (value, key) in &self.touched {
            match after(key) {
                Some(true) => added.push(*value),
                Some(false) if self.may_hold(known, key) => deleted = Some(*key),
                None if self.may_hold(known, key) => remains = true,
                _ => {}
            }
        }
        match (&added[..], remains) {
            ([], false) => Ok(Some(no_atom)),
            ([], true) if deleted.is_none() => Ok(None),
            ([], true) => match (current, deleted) {
                (None, Some(key)) => Err(Outcome::Open(Formula::Atom(key.clone(), true))),
                // A different atom holds, which is not deleted.
                _ => Ok(None),
            },
            ([value], false) => Ok(Some(*value)),
            _ => Err(Outcome::Unknown),
        }
    }
}

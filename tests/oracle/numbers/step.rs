//! Semantics of one action in a state (definition, rules 1, 2, 4 and 6).

use num_traits::{One as _, Zero as _};

use super::ground::{Act, Instance, Moment, Test, Value};
use super::model::{Change, Number};

#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
    pub atoms: Vec<bool>,
    pub numbers: Vec<Option<Number>>,
    /// Sum of the durations of all previous actions.
    pub time: Number,
}

pub fn number(value: &Value, state: &State) -> Option<Number> {
    match value {
        Value::Known(value) => Some(value.clone()),
        Value::Undefined => None,
        Value::Fluent(fluent) => state.numbers[*fluent].clone(),
        Value::Sum(parts) => {
            parts.iter().try_fold(Number::zero(), |sum, part| Some(sum + number(part, state)?))
        }
        Value::Product(parts) => {
            parts.iter().try_fold(Number::one(), |product, part| Some(product * number(part, state)?))
        }
        Value::Minus(left, right) => Some(number(left, state)? - number(right, state)?),
        Value::Negative(inner) => Some(-number(inner, state)?),
        Value::Quotient(left, right) => {
            let (left, right) = (number(left, state)?, number(right, state)?);
            (!right.is_zero()).then(|| left / right)
        }
        Value::Time => Some(state.time.clone()),
    }
}

/// Returns the truth value of a condition. `None` if a comparison in the condition is undefined, even if the
/// other parts would decide it.
pub fn holds(test: &Test, state: &State) -> Option<bool> {
    match test {
        Test::Known(holds) => Some(*holds),
        Test::Atom(atom) => Some(state.atoms[*atom]),
        Test::Not(inner) => holds(inner, state).map(|inner| !inner),
        Test::Any(parts) => {
            let parts: Option<Vec<bool>> = parts.iter().map(|part| holds(part, state)).collect();
            parts.map(|parts| parts.contains(&true))
        }
        Test::Compare(relation, left, right) => {
            Some(relation.holds(&number(left, state)?, &number(right, state)?))
        }
        Test::Open(_, value) => number(value, state).map(|_| true),
    }
}

/// Returns `true` if all conditions are defined and hold.
pub fn all_hold(tests: &[Test], state: &State) -> bool {
    tests.iter().all(|test| holds(test, state) == Some(true))
}

pub fn execute(instance: &Instance, state: &State) -> Option<State> {
    let mut after = match &instance.end {
        None => happen(&[&instance.start], state)?,
        Some(end) if instance.duration.is_zero() => {
            // With duration 0, start and end are one happening: their conditions are evaluated in one state,
            // and they must not interfere.
            let next_state = happen(&[&instance.start, end], state)?;
            let (start_access, end_access) = (Access::of(&instance.start, state)?, Access::of(end, state)?);
            if start_access.interferes(&end_access) {
                return None;
            }
            next_state
        }
        Some(end) => {
            let between = happen(&[&instance.start], state)?;
            if !all_hold(&instance.over_all, &between) {
                return None;
            }
            happen(&[end], &between)?
        }
    };
    after.time += &instance.duration;
    Some(after)
}

fn active_acts<'a>(acts: &'a [Act], state: &State, active: &mut Vec<&'a Act>) -> Option<()> {
    for act in acts {
        if let Act::When(tests, inner) = act {
            let results: Option<Vec<bool>> = tests.iter().map(|test| holds(test, state)).collect();
            if results?.iter().all(|result| *result) {
                active_acts(inner, state, active)?;
            }
        } else {
            active.push(act);
        }
    }
    Some(())
}

enum Combined {
    Sum(Number),
    Factor(Number),
    Assigned(Number),
}

/// Evaluates the conditions of all moments in the state, then applies all effects at once. Returns `None` if
/// a condition does not hold, a value is undefined or effects conflict.
fn happen(moments: &[&Moment], state: &State) -> Option<State> {
    let mut acts = Vec::new();
    for moment in moments {
        if !all_hold(&moment.tests, state) {
            return None;
        }
        active_acts(&moment.acts, state, &mut acts)?;
    }
    let mut after = state.clone();
    let mut numbers: Vec<(usize, Combined)> = Vec::new();
    for act in &acts {
        match act {
            Act::Delete(atom) => after.atoms[*atom] = false,
            Act::Number(change, fluent, value) => {
                combine(&mut numbers, *change, *fluent, number(value, state)?)?;
            }
            Act::Add(_) | Act::When(..) => {}
        }
    }
    // Deletions come first, so an atom that is both added and deleted holds.
    for act in &acts {
        if let Act::Add(atom) = act {
            after.atoms[*atom] = true;
        }
    }
    for (fluent, combined) in numbers {
        let before = state.numbers[fluent].clone();
        after.numbers[fluent] = Some(match combined {
            Combined::Assigned(value) => value,
            Combined::Sum(sum) => before? + sum,
            Combined::Factor(factor) => before? * factor,
        });
    }
    Some(after)
}

/// Combines an effect with earlier simultaneous effects. Returns `None` if effects on the same number
/// conflict, and for a division by zero.
fn combine(
    numbers: &mut Vec<(usize, Combined)>,
    change: Change,
    fluent: usize,
    operand: Number,
) -> Option<()> {
    let added = match change {
        Change::Assign => Combined::Assigned(operand),
        Change::Increase => Combined::Sum(operand),
        Change::Decrease => Combined::Sum(-operand),
        Change::ScaleUp => Combined::Factor(operand),
        Change::ScaleDown if operand.is_zero() => return None,
        Change::ScaleDown => Combined::Factor(operand.recip()),
    };
    let Some((_, combined)) = numbers.iter_mut().find(|(number, _)| *number == fluent) else {
        numbers.push((fluent, added));
        return Some(());
    };
    match (combined, added) {
        (Combined::Sum(sum), Combined::Sum(operand)) => *sum += operand,
        (Combined::Factor(factor), Combined::Factor(operand)) => *factor *= operand,
        (Combined::Assigned(value), Combined::Assigned(second)) if *value == second => {}
        _ => return None,
    }
    Some(())
}

#[derive(Default)]
struct Access {
    read_atoms: Vec<usize>,
    read_numbers: Vec<usize>,
    adds: Vec<usize>,
    deletes: Vec<usize>,
    changes: Vec<(Change, usize)>,
}

impl Access {
    fn of(moment: &Moment, state: &State) -> Option<Self> {
        let mut access = Self::default();
        moment.tests.iter().for_each(|test| access.test(test));
        // Operands count as read even if the effect is not active (definition, rule 6).
        moment.acts.iter().for_each(|act| access.operands(act));
        let mut acts = Vec::new();
        active_acts(&moment.acts, state, &mut acts)?;
        for act in acts {
            match act {
                Act::Add(atom) => access.adds.push(*atom),
                Act::Delete(atom) => access.deletes.push(*atom),
                Act::Number(change, fluent, _) => access.changes.push((*change, *fluent)),
                Act::When(..) => {}
            }
        }
        Some(access)
    }

    fn operands(&mut self, act: &Act) {
        match act {
            Act::Add(_) | Act::Delete(_) => {}
            Act::Number(_, _, value) => self.value(value),
            Act::When(tests, inner) => {
                for test in tests {
                    self.test(test);
                }
                for act in inner {
                    self.operands(act);
                }
            }
        }
    }

    fn test(&mut self, test: &Test) {
        match test {
            Test::Known(_) => {}
            Test::Atom(atom) => self.read_atoms.push(*atom),
            Test::Not(inner) => self.test(inner),
            Test::Any(parts) => parts.iter().for_each(|part| self.test(part)),
            Test::Compare(_, left, right) => {
                self.value(left);
                self.value(right);
            }
            Test::Open(_, value) => self.value(value),
        }
    }

    fn value(&mut self, value: &Value) {
        match value {
            Value::Known(_) | Value::Undefined | Value::Time => {}
            Value::Fluent(fluent) => self.read_numbers.push(*fluent),
            Value::Sum(parts) | Value::Product(parts) => parts.iter().for_each(|part| self.value(part)),
            Value::Minus(left, right) | Value::Quotient(left, right) => {
                self.value(left);
                self.value(right);
            }
            Value::Negative(inner) => self.value(inner),
        }
    }

    fn interferes(&self, other: &Self) -> bool {
        let one_way = |writer: &Self, reader: &Self| {
            let written = writer.adds.iter().chain(&writer.deletes);
            let mut written = written;
            written.any(|atom| reader.read_atoms.contains(atom))
                || writer.adds.iter().any(|atom| reader.deletes.contains(atom))
                || writer.changes.iter().any(|(_, fluent)| reader.read_numbers.contains(fluent))
        };
        let sums = |change: Change| matches!(change, Change::Increase | Change::Decrease);
        let factors = |change: Change| matches!(change, Change::ScaleUp | Change::ScaleDown);
        let compatible =
            |first: Change, second: Change| sums(first) && sums(second) || factors(first) && factors(second);
        let clash = |(change, fluent): &(Change, usize)| {
            other.changes.iter().any(|(o, f)| f == fluent && !compatible(*change, *o))
        };
        one_way(self, other) || one_way(other, self) || self.changes.iter().any(clash)
    }
}

//! What one action does to a state (definition, 1, 2, 4 and 6).

use num_traits::{One as _, Zero as _};

use super::ground::{Act, Instance, Moment, Test, Value};
use super::model::{Change, Number};

/// The atoms and numbers that change.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
    pub atoms: Vec<bool>,
    pub numbers: Vec<Option<Number>>,
    /// The sum of durations so far.
    pub time: Number,
}

/// The value of an expression, if it has one.
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

/// Whether a condition holds; nothing where a comparison has no value.
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

/// Whether all of them hold and have values.
pub fn all_hold(tests: &[Test], state: &State) -> bool {
    tests.iter().all(|test| holds(test, state) == Some(true))
}

/// The state after an action, if it can be executed.
pub fn execute(instance: &Instance, state: &State) -> Option<State> {
    let mut after = match &instance.end {
        None => happen(&[&instance.start], state)?,
        Some(end) if instance.duration.is_zero() => {
            let happened = happen(&[&instance.start, end], state)?;
            let (one, other) = (Touch::of(&instance.start, state)?, Touch::of(end, state)?);
            if one.interferes(&other) {
                return None;
            }
            happened
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

/// Effects that are active in a state; nothing where a condition of one has no value.
fn active<'a>(acts: &'a [Act], state: &State, found: &mut Vec<&'a Act>) -> Option<()> {
    for act in acts {
        if let Act::When(tests, inner) = act {
            let met: Option<Vec<bool>> = tests.iter().map(|test| holds(test, state)).collect();
            if met?.iter().all(|met| *met) {
                active(inner, state, found)?;
            }
        } else {
            found.push(act);
        }
    }
    Some(())
}

/// What active numeric effects do to one number, taken together.
enum Together {
    Sum(Number),
    Factor(Number),
    Assigned(Number),
}

/// Evaluates all conditions in the state, then applies all effects at once.
fn happen(moments: &[&Moment], state: &State) -> Option<State> {
    let mut acts = Vec::new();
    for moment in moments {
        if !all_hold(&moment.tests, state) {
            return None;
        }
        active(&moment.acts, state, &mut acts)?;
    }
    let mut after = state.clone();
    let mut numbers: Vec<(usize, Together)> = Vec::new();
    for act in &acts {
        match act {
            Act::Delete(atom) => after.atoms[*atom] = false,
            Act::Number(change, fluent, value) => {
                note(&mut numbers, *change, *fluent, number(value, state)?)?;
            }
            Act::Add(_) | Act::When(..) => {}
        }
    }
    for act in &acts {
        if let Act::Add(atom) = act {
            after.atoms[*atom] = true;
        }
    }
    for (fluent, together) in numbers {
        let before = state.numbers[fluent].clone();
        after.numbers[fluent] = Some(match together {
            Together::Assigned(value) => value,
            Together::Sum(sum) => before? + sum,
            Together::Factor(factor) => before? * factor,
        });
    }
    Some(after)
}

/// Adds an effect to those on the same number; nothing where they contradict each other.
fn note(numbers: &mut Vec<(usize, Together)>, change: Change, fluent: usize, operand: Number) -> Option<()> {
    let new = match change {
        Change::Assign => Together::Assigned(operand),
        Change::Increase => Together::Sum(operand),
        Change::Decrease => Together::Sum(-operand),
        Change::ScaleUp => Together::Factor(operand),
        Change::ScaleDown if operand.is_zero() => return None,
        Change::ScaleDown => Together::Factor(operand.recip()),
    };
    let Some((_, known)) = numbers.iter_mut().find(|(other, _)| *other == fluent) else {
        numbers.push((fluent, new));
        return Some(());
    };
    match (known, new) {
        (Together::Sum(sum), Together::Sum(more)) => *sum += more,
        (Together::Factor(factor), Together::Factor(more)) => *factor *= more,
        (Together::Assigned(value), Together::Assigned(same)) if *value == same => {}
        _ => return None,
    }
    Some(())
}

/// What a happening reads and writes, for interference.
#[derive(Default)]
struct Touch {
    read_atoms: Vec<usize>,
    read_numbers: Vec<usize>,
    adds: Vec<usize>,
    deletes: Vec<usize>,
    changes: Vec<(Change, usize)>,
}

impl Touch {
    fn of(moment: &Moment, state: &State) -> Option<Self> {
        let mut touch = Self::default();
        moment.tests.iter().for_each(|test| touch.test(test));
        moment.acts.iter().for_each(|act| touch.operands(act));
        let mut acts = Vec::new();
        active(&moment.acts, state, &mut acts)?;
        for act in acts {
            match act {
                Act::Add(atom) => touch.adds.push(*atom),
                Act::Delete(atom) => touch.deletes.push(*atom),
                Act::Number(change, fluent, _) => touch.changes.push((*change, *fluent)),
                Act::When(..) => {}
            }
        }
        Some(touch)
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
        let one_way = |one: &Self, other: &Self| {
            let written = one.adds.iter().chain(&one.deletes);
            let mut written = written;
            written.any(|atom| other.read_atoms.contains(atom))
                || one.adds.iter().any(|atom| other.deletes.contains(atom))
                || one.changes.iter().any(|(_, fluent)| other.read_numbers.contains(fluent))
        };
        let sums = |change: Change| matches!(change, Change::Increase | Change::Decrease);
        let factors = |change: Change| matches!(change, Change::ScaleUp | Change::ScaleDown);
        let compatible =
            |one: Change, other: Change| sums(one) && sums(other) || factors(one) && factors(other);
        let clash = |(change, fluent): &(Change, usize)| {
            other.changes.iter().any(|(o, f)| f == fluent && !compatible(*change, *o))
        };
        one_way(self, other) || one_way(other, self) || self.changes.iter().any(clash)
    }
}

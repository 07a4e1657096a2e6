//! Changes of numbers: those of one happening together, in terms of the state before an action.

use crate::error::{Error, Place};
use crate::ground::effects::GroundChange;
use crate::ground::evaluate::Failure;
use crate::lifted::Rational;
use crate::quantity::{Linear, NumericId};
use pddl::ast::Assignment;

/// What numeric variables become; a list, because an operator changes few.
#[derive(Debug, Clone, Default)]
pub(crate) struct Numbers {
    /// Ascending by variable.
    changes: Vec<(NumericId, Linear<Rational>)>,
}

impl Numbers {
    pub(crate) fn get(&self, variable: NumericId) -> Option<&Linear<Rational>> {
        let position = self.changes.binary_search_by_key(&variable, |(own, _)| *own);
        position.ok().map(|position| &self.changes[position].1)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &(NumericId, Linear<Rational>)> {
        self.changes.iter()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    pub(crate) fn retain(&mut self, keep: &dyn Fn(NumericId) -> bool) {
        self.changes.retain(|(variable, _)| keep(*variable));
    }

    /// One variable that changes.
    pub(super) fn one(variable: NumericId, value: Linear<Rational>) -> Self {
        Self { changes: vec![(variable, value)] }
    }

    /// All numbers that change.
    pub(super) fn each(&mut self, change: &mut dyn FnMut(&mut Linear<Rational>)) {
        self.changes.iter_mut().for_each(|(_, value)| change(value));
    }

    /// Takes over the changes of other numbers.
    pub(super) fn complete(&mut self, earlier: Self) {
        for (variable, value) in earlier.changes {
            if self.get(variable).is_none() {
                self.insert(variable, value);
            }
        }
    }

    pub(super) fn insert(&mut self, variable: NumericId, value: Linear<Rational>) {
        match self.changes.binary_search_by_key(&variable, |(own, _)| *own) {
            Ok(position) => self.changes[position].1 = value,
            Err(position) => self.changes.insert(position, (variable, value)),
        }
    }
}

/// How a number changes; two changes of one way commute, unless both assign (0).
pub(super) fn way_of(assignment: Assignment) -> u8 {
    match assignment {
        Assignment::Assign => 0,
        Assignment::Increase | Assignment::Decrease => 1,
        Assignment::ScaleUp | Assignment::ScaleDown => 2,
    }
}

/// Whether changes of one number at one time go together: additions, scalings, and assignments of the same value do.
/// `Failure::Undefined` if they do not, which leaves the action inapplicable (PDDL 2.1, section 8).
fn reconcile(earlier: &GroundChange, later: &GroundChange) -> Result<(), Failure> {
    let (
        GroundChange::Number { assignment: kind, operand: known, .. },
        GroundChange::Number { assignment, operand, place, .. },
    ) = (earlier, later)
    else {
        return Ok(());
    };
    match (known, operand) {
        _ if way_of(*kind) != way_of(*assignment) => Err(Failure::Undefined),
        (Some(known), Some(value)) if way_of(*kind) == 0 && known != value => {
            let is_constant =
                |value: &Linear<Rational>| value.coefficients.is_empty() && value.quantity.tables.is_empty();
            if is_constant(known) && is_constant(value) {
                return Err(Failure::Undefined);
            }
            Err(Failure::Error(Error::Unsupported {
                construct: "two different values assigned to one number at one time".into(),
                instead: "one `assign` of each number".into(),
                place: *place,
            }))
        }
        _ => Ok(()),
    }
}

/// What numeric variables become, in terms of the state before the action; `before` are the changes that
/// the action has made already.
pub(super) fn numbers<'c>(
    changes: impl Iterator<Item = &'c GroundChange>,
    before: &Numbers,
) -> Result<Numbers, Failure> {
    let mut changed = Numbers::default();
    let mut last: Vec<(NumericId, &GroundChange)> = Vec::new();
    for change in changes {
        let GroundChange::Number { variable, assignment, operand, place, .. } = change else { continue };
        match last.iter_mut().find(|(known, _)| known == variable) {
            Some((_, earlier)) => {
                reconcile(earlier, change)?;
                *earlier = change;
            }
            None => last.push((*variable, change)),
        }
        let mut operand = operand.clone().ok_or(Failure::Undefined)?;
        substitute(&mut operand, before);
        let current = || {
            let old = changed.get(*variable).or_else(|| before.get(*variable));
            old.cloned().unwrap_or_else(|| Linear::variable(*variable))
        };
        let value = match assignment {
            Assignment::Assign => operand,
            Assignment::Increase => sum(current(), &operand),
            Assignment::Decrease => sum(current(), &operand.negated()),
            Assignment::ScaleUp | Assignment::ScaleDown => {
                scaled(current(), &operand, *assignment == Assignment::ScaleDown, *place)?
            }
        };
        changed.insert(*variable, value);
    }
    Ok(changed)
}

fn sum(mut left: Linear<Rational>, right: &Linear<Rational>) -> Linear<Rational> {
    left.add(right);
    left
}

fn scaled(
    mut value: Linear<Rational>,
    factor: &Linear<Rational>,
    inverse: bool,
    place: Place,
) -> Result<Linear<Rational>, Failure> {
    if !factor.coefficients.is_empty() || !factor.quantity.tables.is_empty() {
        return Err(Failure::Error(Error::NonLinear { place }));
    }
    let factor = factor.quantity.constant.clone();
    if inverse && factor == Rational::from_integer(0) {
        return Err(Failure::Undefined);
    }
    value.scale(&if inverse { factor.recip() } else { factor });
    Ok(value)
}

pub(super) fn substitute(linear: &mut Linear<Rational>, before: &Numbers) {
    if !linear.coefficients.iter().any(|(variable, _)| before.get(*variable).is_some()) {
        return;
    }
    let mut result = Linear { coefficients: Vec::new(), quantity: linear.quantity.clone() };
    for (variable, factor) in &linear.coefficients {
        let mut value = before.get(*variable).cloned().unwrap_or_else(|| Linear::variable(*variable));
        value.scale(factor);
        result.add(&value);
    }
    *linear = result;
}

//! Computes the state after the changes of an action, as expressions over the state before the action (regression).

use std::sync::Arc;

use crate::error::{Error, Place};
use crate::ground::evaluate::reads::{Reads, matches};
use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::numbers::Numbers;
use crate::ground::vocabulary::world::World;
use crate::lifted::Rational;
use crate::task::ForbiddenCombinations;
use crate::task::quantity::{Linear, NumericId};
use pddl::ast::Assignment;

#[derive(Clone)]
pub(super) enum GroundChange {
    Atom(AtomId, bool),
    Number {
        variable: NumericId,
        assignment: Assignment,
        /// Operand of the assignment. `None` if it is undefined; an operator with this change is then not
        /// instantiated.
        operand: Option<Linear<Rational>>,
        undefined: Arc<[ForbiddenCombinations]>,
        place: Place,
    },
}

impl GroundChange {
    pub(super) fn undefined(&self) -> &[ForbiddenCombinations] {
        match self {
            Self::Atom(..) => &[],
            Self::Number { undefined, .. } => undefined,
        }
    }

    pub(super) fn disturbs(&self, world: &World<'_>, reads: &Reads) -> bool {
        match self {
            Self::Atom(atom, _) => {
                let (predicate, arguments) = world.atom_key(*atom);
                reads.atoms.iter().any(|pattern| matches(pattern, predicate, arguments))
            }
            Self::Number { variable, .. } => {
                let (function, arguments) = world.numeric_key(*variable);
                reads.numbers.iter().any(|pattern| matches(pattern, function, arguments))
            }
        }
    }
}

pub(super) fn atoms<'c>(changes: impl Iterator<Item = &'c GroundChange>) -> (Vec<AtomId>, Vec<AtomId>) {
    let (mut adds, mut deletes) = (Vec::new(), Vec::new());
    for change in changes {
        if let GroundChange::Atom(atom, positive) = change {
            if *positive { &mut adds } else { &mut deletes }.push(*atom);
        }
    }
    deletes.retain(|atom| !adds.contains(atom));
    (adds, deletes)
}

/// Returns the kind of a numeric change: assignment (0), addition (1) or scaling (2). Changes of kind 1
/// commute with each other, and so do changes of kind 2.
pub(super) fn way_of(assignment: Assignment) -> u8 {
    match assignment {
        Assignment::Assign => 0,
        Assignment::Increase | Assignment::Decrease => 1,
        Assignment::ScaleUp | Assignment::ScaleDown => 2,
    }
}

/// Checks that two simultaneous changes of a number are compatible: both are additions, both are scalings, or
/// both assign equal values. Otherwise returns `Failure::Undefined`, which makes the action inapplicable
/// (PDDL 2.1, section 8). Two different assigned values that are not both constant are not supported.
fn reconcile(earlier: &GroundChange, later: &GroundChange) -> Result<(), Failure> {
    let (
        GroundChange::Number { assignment: kind, operand: first_value, .. },
        GroundChange::Number { assignment, operand, place, .. },
    ) = (earlier, later)
    else {
        return Ok(());
    };
    match (first_value, operand) {
        _ if way_of(*kind) != way_of(*assignment) => Err(Failure::Undefined),
        (Some(first_value), Some(value)) if way_of(*kind) == 0 && first_value != value => {
            let is_constant =
                |value: &Linear<Rational>| value.coefficients.is_empty() && value.quantity.tables.is_empty();
            if is_constant(first_value) && is_constant(value) {
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

/// Returns the changed numeric variables with their values after the changes, as expressions over the state
/// before the action. `before` holds the values after earlier changes of the action.
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
        // The result refers to the state before the action, so the results of earlier changes are
        // substituted.
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

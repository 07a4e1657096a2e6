//! Effects that occur simultaneously at the start or the end of an action instance.

use std::sync::Arc;

use crate::ground::evaluate::condition::residual_of_effect;
use crate::ground::evaluate::join::{each_binding, guards_of_exists};
use crate::ground::evaluate::reads::Reads;
use crate::ground::instantiate::change::{GroundChange, way_of};
use crate::ground::instantiate::frame::Operand;
use crate::ground::instantiate::instance_builder::{Apart, Build};
use crate::ground::vocabulary::atom::arguments;
use crate::ground::vocabulary::eval_error::{Failure, possible};
use crate::ground::vocabulary::partial_eval::Residual;
use crate::ground::vocabulary::world::World;
use crate::lifted::{Change, Effect};
use crate::task::ForbiddenCombinations;

#[derive(Clone)]
pub(super) struct SimultaneousEffects {
    pub(super) changes: Vec<(Residual, GroundChange)>,
}

impl SimultaneousEffects {
    pub(super) fn nothing() -> Self {
        Self { changes: Vec::new() }
    }

    pub(super) fn new(
        build: &mut Build<'_, '_>,
        effects: &[Effect],
        operands: &[Operand],
    ) -> Result<Self, Failure> {
        let mut changes = Vec::with_capacity(effects.len());
        for (effect, operand) in effects.iter().zip(operands) {
            if effect.bound.is_empty() {
                ground_effect(build, effect, operand, &mut changes)?;
                continue;
            }
            let guards = guards_of_exists(&effect.condition);
            let mut bindings = Vec::new();
            each_binding(build.world, &effect.bound, &guards, &mut build.binding, &mut |_, binding| {
                bindings.push(binding.clone());
                true
            })?;
            let outer_binding = std::mem::take(&mut build.binding);
            for binding in bindings {
                build.binding = binding;
                ground_effect(build, effect, operand, &mut changes)?;
            }
            build.binding = outer_binding;
        }
        Ok(Self { changes })
    }
}

fn ground_effect(
    build: &mut Build<'_, '_>,
    effect: &Effect,
    operand: &Operand,
    changes: &mut Vec<(Residual, GroundChange)>,
) -> Result<(), Failure> {
    let condition = residual_of_effect(build.world, &effect.condition, &mut build.binding)?;
    if condition != Residual::False {
        let change = ground_change(build, &effect.change, operand, condition == Residual::True)?;
        changes.push((condition, change));
    }
    Ok(())
}

fn ground_change(
    build: &mut Build<'_, '_>,
    change: &Change,
    operand: &Operand,
    certain: bool,
) -> Result<GroundChange, Failure> {
    Ok(match change {
        Change::Add(predicate, terms) | Change::Delete(predicate, terms) => {
            let atom = build.world.atom(*predicate, &arguments(terms, &build.binding));
            GroundChange::Atom(atom, matches!(change, Change::Add(..)))
        }
        Change::Assign { assignment, function, terms, expression, place } => {
            let arguments = arguments(terms, &build.binding);
            let variable = build.world.numeric(*function, &arguments, *place)?;
            let nothing: Arc<[ForbiddenCombinations]> = [].into();
            let Apart { operand, undefined } = match operand {
                Operand::Undefined => Apart { operand: None, undefined: nothing },
                Operand::Open(operand, undefined) => {
                    Apart { operand: Some(operand.clone()), undefined: undefined.clone() }
                }
                Operand::Closed if certain => {
                    Apart { operand: possible(build.open(expression))?, undefined: nothing }
                }
                Operand::Closed => build.open_apart(expression)?,
            };
            GroundChange::Number { variable, assignment: *assignment, operand, undefined, place: *place }
        }
    })
}

/// Returns the conditions under which two simultaneous sets of effects interfere: one set changes an atom or fluent
/// that the other reads, both set an atom to different values, or both change a number, except by two additions or two
/// scalings.
pub(super) fn clashes(
    world: &World<'_>,
    (first_reads, first): (&Reads, &SimultaneousEffects),
    (second_reads, second): (&Reads, &SimultaneousEffects),
) -> Vec<Residual> {
    let mut clashes = Vec::new();
    for (reads, moment) in [(first_reads, second), (second_reads, first)] {
        let disturbing = moment.changes.iter().filter(|(_, change)| change.disturbs(world, reads));
        clashes.extend(disturbing.map(|(condition, _)| condition.clone()));
    }
    for (one, earlier) in &first.changes {
        for (other, later) in &second.changes {
            let clash = match (earlier, later) {
                (GroundChange::Atom(atom, holds), GroundChange::Atom(same, positive)) => {
                    atom == same && holds != positive
                }
                (
                    GroundChange::Number { variable, assignment: way, .. },
                    GroundChange::Number { variable: same, assignment, .. },
                ) => variable == same && (way_of(*way) != way_of(*assignment) || way_of(*way) == 0),
                _ => false,
            };
            if clash {
                clashes.push(Residual::junction([one.clone(), other.clone()], true));
            }
        }
    }
    clashes
}

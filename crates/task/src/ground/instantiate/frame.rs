//! Design data that several instances of an action schema share.
//!
//! Suitable designs, forbidden combinations, durations and the effects that depend on designs are determined by
//! only a few parameters of the schema, the key parameters. For example, the battery use of a move depends on
//! its two places, but not on the item that the robot carries. The data are computed once for each combination
//! of objects for the key parameters.

use std::sync::Arc;

use crate::ground::evaluate::condition::residual;
use crate::ground::evaluate::expression::ground;
use crate::ground::evaluate::slots::Slots;
use crate::ground::instantiate::design_constraints::{admit_some, distinct};
use crate::ground::instantiate::instance_builder::{Apart, Build};
use crate::ground::instantiate::slot_split::{SplitSchema, open_operand};
use crate::ground::vocabulary::atom::{Binding, arguments};
use crate::ground::vocabulary::eval_error::{Failure, possible};
use crate::ground::vocabulary::operator::GroundSlots;
use crate::ground::vocabulary::partial_eval::Residual;
use crate::ground::vocabulary::world::World;
use crate::lifted::configuration::{SlotParameter, conjuncts};
use crate::lifted::{Effect, ObjectId, Rational};
use crate::number::dense;
use crate::task::ForbiddenCombinations;
use crate::task::quantity::{Linear, Quantity};

/// Data that all instances of an action schema share if they have the same objects for the key parameters. These
/// parameters occur in the duration, in the functions of the slots, or in conditions and operands of effects that
/// mention slots.
pub(super) struct SharedInstanceData<'a> {
    pub(super) designs: Slots<'a>,
    pub(super) slots: Arc<GroundSlots>,
    pub(super) forbidden: Arc<[ForbiddenCombinations]>,
    /// Residuals of the comparisons at the start that mention slots and depend on the state. Other start conditions on
    /// slots are part of `designs` or `forbidden`.
    pub(super) start: Vec<Residual>,
    pub(super) over_all: Vec<Residual>,
    pub(super) at_end: Vec<Residual>,
    pub(super) start_operands: Vec<Operand>,
    pub(super) end_operands: Vec<Operand>,
    pub(super) duration: Quantity<Rational>,
}

/// Operand of a numeric effect. If it mentions slots and its effect has no quantified variables, it is evaluated once
/// for all instances that share the data; otherwise separately for each instance.
pub(super) enum Operand {
    /// The operand mentions no slot, or the effect has quantified variables or is not numeric. The operand is
    /// evaluated separately for each instance.
    Closed,
    Undefined,
    /// The operand mentions slots. The second field holds the combinations of designs for which the operand is
    /// undefined; with them, only the conditional effect is undefined. For an unconditional effect, the field is empty,
    /// because the action is not applicable with such a combination (see [`SharedInstanceData::forbidden`]).
    Open(Linear<Rational>, Arc<[ForbiddenCombinations]>),
}

impl<'a> SharedInstanceData<'a> {
    /// Computes the shared data for the objects that `core` assigns to the key parameters. Returns `None` if no
    /// combination of designs is possible.
    pub(super) fn new(
        world: &mut World<'_>,
        outline: &SplitSchema<'a>,
        core: &Binding,
    ) -> Result<Option<Self>, Failure> {
        let mut binding = core.clone();
        let mut designs = Slots { parameters: outline.parameters, designs: Vec::new() };
        for position in 0..outline.parameters.len() {
            let suitable = suitable_designs(world, outline, dense(position), &mut binding)?;
            if suitable.is_empty() {
                return Ok(None);
            }
            designs.designs.push(suitable);
        }
        let mut build = Build { world, binding, slots: &designs, forbidden: Vec::new() };
        let start = build.open_conditions(&outline.start.open)?;
        let start_operands = operands(&mut build, &outline.schema.start_effects)?;
        let over_all = build.open_conditions(&outline.over_all.open)?;
        let at_end = build.open_conditions(&outline.at_end.open)?;
        let end_operands = operands(&mut build, &outline.schema.end_effects)?;
        let duration = match &outline.schema.duration {
            Some(duration) => build.static_quantity(duration, outline.schema)?,
            None => Quantity::constant(Rational::from_integer(0)),
        };
        // PDDL requires durations of at least 0.
        build.forbid_negative(&duration)?;
        let forbidden = distinct(build.forbidden);
        if !admit_some(&forbidden, &designs.sizes(), world.limits)? {
            return Ok(None);
        }
        let function = |slot: &SlotParameter| arguments(&[slot.function], core).first().copied();
        let slots = outline.parameters.iter().zip(&designs.designs);
        let slots: Option<_> = slots.map(|(slot, own)| Some((function(slot)?, own.clone()))).collect();
        let slots = slots.expect("invariant: the function of a slot is not a slot");
        Ok(Some(Self {
            designs,
            slots,
            forbidden,
            start,
            over_all,
            at_end,
            start_operands,
            end_operands,
            duration,
        }))
    }
}

fn operands(build: &mut Build<'_, '_>, effects: &[Effect]) -> Result<Vec<Operand>, Failure> {
    let mut operands = Vec::with_capacity(effects.len());
    for effect in effects {
        operands.push(match open_operand(effect, build.slots.parameters) {
            None => Operand::Closed,
            Some(expression) => {
                let Apart { operand, undefined } = if conjuncts(&effect.condition).is_empty() {
                    Apart { operand: possible(build.open(expression))?, undefined: [].into() }
                } else {
                    build.open_apart(expression)?
                };
                operand.map_or(Operand::Undefined, |operand| Operand::Open(operand, undefined))
            }
        });
    }
    Ok(operands)
}

/// Returns the designs of a slot for which no condition that mentions only this slot is false. The duration
/// and the operands of unconditional effects that mention only this slot must be defined, too.
fn suitable_designs(
    world: &mut World<'_>,
    outline: &SplitSchema<'_>,
    position: u32,
    binding: &mut Binding,
) -> Result<Vec<ObjectId>, Failure> {
    let parameter = outline.parameters[position as usize].parameter as usize;
    let (conditions, expressions) = outline.about(position);
    let mut designs = Vec::new();
    for design in outline.schema.parameters[parameter].candidates.iter() {
        binding[parameter] = Some(*design);
        let mut suits = true;
        for condition in &conditions {
            suits = suits && !matches!(residual(world, condition, binding)?, Residual::False);
        }
        for expression in &expressions {
            suits = suits && defined(ground(world, expression, binding))?;
        }
        if suits {
            designs.push(*design);
        }
    }
    binding[parameter] = None;
    Ok(designs)
}

fn defined<T>(value: Result<T, Failure>) -> Result<bool, Failure> {
    match value {
        Ok(_) => Ok(true),
        Err(Failure::Undefined) => Ok(false),
        Err(error) => Err(error),
    }
}

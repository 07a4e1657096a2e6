//! What the instances of a schema share: all that depends on the designs of its slots.
//!
//! Which designs suit, which combinations are forbidden, and what costs and consumptions are with each combination depends
//! on few parameters: how much a way drains a battery, but not how full the battery is. So it is worked out once
//! for each combination of those parameters, and the instances that agree in them share it.

use std::sync::Arc;

use crate::configuration::{
    SlotParameter, conjuncts, expression_terms, formula_terms, slots_of_expression, slots_of_formula,
};
use crate::ground::effects::possible;
use crate::ground::evaluate::{Binding, Failure, Row, Slots, World};
use crate::ground::instantiate::{Apart, Build, GroundSlots, admit_some};
use crate::ground::residual::Residual;
use crate::lifted::{Change, Effect, Expression, Formula, Lifted, ObjectId, Rational, Schema, Term};
use crate::quantity::{Linear, Quantity, SlotSet};
use crate::task::Forbidden;

/// A schema with what mentions its slots apart from the rest.
pub(super) struct Outline<'a> {
    pub(super) schema: &'a Schema,
    parameters: &'a [SlotParameter],
    /// The parameters on which the frame of an instance depends, ascending.
    key: Vec<u32>,
    pub(super) start: Conjuncts<'a>,
    pub(super) over_all: Conjuncts<'a>,
    pub(super) at_end: Conjuncts<'a>,
}

/// The conjuncts of a condition.
pub(super) struct Conjuncts<'a> {
    /// Those that mention no slot, apart from static atoms that relaxed reachability has settled.
    pub(super) closed: Vec<&'a Formula>,
    /// Those that do, with the positions of the slots.
    open: Vec<(&'a Formula, SlotSet)>,
}

/// What instances share that agree in the parameters of the key.
pub(super) struct Frame<'a> {
    pub(super) designs: Slots<'a>,
    pub(super) slots: Arc<GroundSlots>,
    pub(super) forbidden: Arc<[Forbidden]>,
    /// What is left of the open conjuncts.
    pub(super) start: Vec<Residual>,
    pub(super) over_all: Vec<Residual>,
    pub(super) at_end: Vec<Residual>,
    /// By the position of the effect.
    pub(super) start_operands: Vec<Operand>,
    pub(super) end_operands: Vec<Operand>,
    pub(super) duration: Quantity<Rational>,
}

/// The operand of an effect, as far as a frame knows it.
pub(super) enum Operand {
    /// It mentions no slot, or the effect has bound variables, or none.
    Closed,
    Undefined,
    /// With the combinations of designs for which it is undefined, if the effect has a condition.
    Open(Linear<Rational>, Arc<[Forbidden]>),
}

impl<'a> Conjuncts<'a> {
    fn new(lifted: &Lifted, condition: &'a Formula, slots: &[SlotParameter]) -> Self {
        let mut own = Self { closed: Vec::new(), open: Vec::new() };
        for conjunct in conjuncts(condition) {
            let mentioned = slots_of_formula(conjunct, slots);
            if !mentioned.is_empty() {
                own.open.push((conjunct, mentioned));
            } else if !settled(lifted, conjunct) {
                own.closed.push(conjunct);
            }
        }
        own
    }
}

/// Whether relaxed reachability decides a conjunct exactly.
fn settled(lifted: &Lifted, conjunct: &Formula) -> bool {
    match conjunct {
        Formula::Literal { predicate, .. } => {
            let predicate = &lifted.predicates[predicate.index()];
            !predicate.fluent && !predicate.derived
        }
        _ => false,
    }
}

impl<'a> Outline<'a> {
    pub(super) fn new(lifted: &Lifted, schema: &'a Schema, parameters: &'a [SlotParameter]) -> Self {
        let start = Conjuncts::new(lifted, &schema.start_condition, parameters);
        let over_all = Conjuncts::new(lifted, &schema.over_all, parameters);
        let at_end = Conjuncts::new(lifted, &schema.at_end, parameters);
        let mut key = Vec::new();
        let mut note = |term: Term| {
            if let Term::Parameter(parameter) = term
                && (parameter as usize) < schema.parameters.len()
                && parameters.iter().all(|slot| slot.parameter != parameter)
            {
                key.push(parameter);
            }
        };
        for slot in parameters {
            note(slot.function);
        }
        for (conjunct, _) in start.open.iter().chain(&over_all.open).chain(&at_end.open) {
            formula_terms(conjunct, &mut note);
        }
        let effects = schema.start_effects.iter().chain(&schema.end_effects);
        for expression in
            effects.filter_map(|effect| open_operand(effect, parameters)).chain(&schema.duration)
        {
            expression_terms(expression, &mut note);
        }
        key.sort_unstable();
        key.dedup();
        Self { schema, parameters, key, start, over_all, at_end }
    }

    /// The objects on which the frame of an instance depends.
    pub(super) fn key(&self, binding: &Binding) -> Row {
        self.key.iter().filter_map(|parameter| binding[*parameter as usize]).collect()
    }

    /// The conditions and expressions that mention one slot and no other.
    fn about(&self, position: u32) -> (Vec<&'a Formula>, Vec<&'a Expression>) {
        let only = SlotSet::from_slice(&[position]);
        let open = self.start.open.iter().chain(&self.over_all.open).chain(&self.at_end.open);
        let conditions = open.filter(|(_, mentioned)| *mentioned == only).map(|(conjunct, _)| *conjunct);
        let effects = self.schema.start_effects.iter().chain(&self.schema.end_effects);
        let unconditional = effects.filter(|effect| conjuncts(&effect.condition).is_empty());
        let expressions = unconditional.filter_map(|effect| open_operand(effect, self.parameters));
        let expressions = expressions.chain(&self.schema.duration);
        let expressions = expressions.filter(|e| slots_of_expression(e, self.parameters) == only);
        (conditions.collect(), expressions.collect())
    }
}

/// The operand of a numeric effect without bound variables, if it mentions slots.
fn open_operand<'a>(effect: &'a Effect, parameters: &[SlotParameter]) -> Option<&'a Expression> {
    match &effect.change {
        Change::Assign { expression, .. }
            if effect.bound.is_empty() && !slots_of_expression(expression, parameters).is_empty() =>
        {
            Some(expression)
        }
        _ => None,
    }
}

impl<'a> Frame<'a> {
    /// The frame of an instance; none if no combination of designs suits.
    pub(super) fn new(
        world: &mut World<'_>,
        outline: &Outline<'a>,
        core: &Binding,
    ) -> Result<Option<Self>, Failure> {
        let mut binding = core.clone();
        let mut designs = Slots { parameters: outline.parameters, designs: Vec::new() };
        for position in 0..outline.parameters.len() {
            let suitable = suitable_designs(world, outline, position as u32, &mut binding)?;
            if suitable.is_empty() {
                return Ok(None);
            }
            designs.designs.push(suitable);
        }
        let mut build = Build { world, binding, slots: &designs, forbidden: Vec::new() };
        let start = build.open_conditions(&outline.start.open)?;
        let start_operands = build.operands(&outline.schema.start_effects)?;
        let over_all = build.open_conditions(&outline.over_all.open)?;
        let at_end = build.open_conditions(&outline.at_end.open)?;
        let end_operands = build.operands(&outline.schema.end_effects)?;
        let duration = match &outline.schema.duration {
            Some(duration) => build.static_quantity(duration, outline.schema)?,
            None => Quantity::constant(Rational::from_integer(0)),
        };
        build.forbid_negative(&duration);
        let forbidden = build.forbidden;
        if !admit_some(&forbidden, &designs.sizes()) {
            return Ok(None);
        }
        let function = |slot: &SlotParameter| World::arguments(&[slot.function], core).first().copied();
        let slots = outline.parameters.iter().zip(&designs.designs);
        let slots: Option<_> = slots.map(|(slot, own)| Some((function(slot)?, own.clone()))).collect();
        let slots = slots.expect("invariant: the function of a slot is no slot");
        let forbidden = forbidden.into();
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

impl Build<'_, '_> {
    fn operands(&mut self, effects: &[Effect]) -> Result<Vec<Operand>, Failure> {
        let mut operands = Vec::with_capacity(effects.len());
        for effect in effects {
            operands.push(match open_operand(effect, self.slots.parameters) {
                None => Operand::Closed,
                Some(expression) => {
                    let Apart { operand, undefined } = if conjuncts(&effect.condition).is_empty() {
                        Apart { operand: possible(self.open(expression))?, undefined: [].into() }
                    } else {
                        self.open_apart(expression)?
                    };
                    operand.map_or(Operand::Undefined, |operand| Operand::Open(operand, undefined))
                }
            });
        }
        Ok(operands)
    }
}

/// The candidates of one slot for which everything that depends on this slot alone is true and defined.
fn suitable_designs(
    world: &mut World<'_>,
    outline: &Outline<'_>,
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
            suits = suits && !matches!(world.residual(condition, binding)?, Residual::False);
        }
        for expression in &expressions {
            suits = suits && defined(world.ground(expression, binding))?;
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

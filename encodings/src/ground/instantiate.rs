//! Instances of schemas to ground operators, the designs of their slots still open.
//!
//! A durative action is composed into one step: conditions of its middle and end that its start effects
//! provide are dropped, those that they destroy make the instance impossible, and numeric conditions and effects of the
//! end are rewritten in terms of the state before the start (sequential execution of PDDL 2.1, section 8).

use std::collections::BTreeMap;

use crate::configuration::{SlotParameter, conjuncts, slots_of_expression, slots_of_formula};
use crate::error::{Error, File, Place};
use crate::ground::evaluate::{
    AtomId, Binding, Failure, Residual, Slots, World, compare, for_each_combination,
};
use crate::ground::metric::GroundObjective;
use crate::ground::normal_form::{GroundCondition, condition};
use crate::ground::reach::Reached;
use crate::lifted::{Effect, Expression, Formula, Lifted, ObjectId, Rational, Schema, Term};
use crate::limits::Limits;
use crate::pddl::ast::{Assignment, Span};
use crate::quantity::{Linear, NumericId, Quantity, SlotSet};
use crate::task::{Argument, Forbidden};

/// An operator over atoms, with exact rationals.
#[derive(Debug, Clone)]
pub(crate) struct GroundOperator {
    pub(crate) schema: u32,
    pub(crate) arguments: Vec<Argument>,
    /// The function and the designs that suit this operator, for each slot.
    pub(crate) slots: Vec<(ObjectId, Vec<ObjectId>)>,
    pub(crate) forbidden: Vec<Forbidden>,
    /// Each function that the action requires, with the argument that is its design.
    pub(crate) configuration: Vec<(ObjectId, Argument)>,
    pub(crate) condition: GroundCondition,
    pub(crate) adds: Vec<AtomId>,
    pub(crate) deletes: Vec<AtomId>,
    pub(crate) numeric_effects: BTreeMap<NumericId, Linear<Rational>>,
    pub(crate) cost: Quantity<Rational>,
    pub(crate) duration: Quantity<Rational>,
}

/// The task over atoms.
pub(crate) struct GroundTask<'a> {
    pub(crate) world: World<'a>,
    pub(crate) operators: Vec<GroundOperator>,
    /// None if the goal is false whatever happens.
    pub(crate) goal: Option<GroundCondition>,
    pub(crate) objective: GroundObjective,
}

/// Turns every reached instance into an operator.
///
/// # Errors
/// All expressions and conditions that the planner does not handle.
pub(crate) fn instantiate<'a>(
    lifted: &'a Lifted,
    designs: &[Vec<SlotParameter>],
    slots: &[Vec<SlotParameter>],
    reached: &'a Reached,
    limits: &Limits,
) -> Result<GroundTask<'a>, Vec<Error>> {
    let mut world = World::new(lifted, &reached.atoms);
    let (mut operators, mut errors) = (Vec::new(), Vec::new());
    for (((schema, slots), instances), index) in
        lifted.schemas.iter().zip(slots).zip(&reached.instances).zip(0..)
    {
        for binding in instances {
            if operators.len().is_multiple_of(256) && limits.reached() {
                return Err(vec![Error::Interrupted]);
            }
            match operator(&mut world, schema, index, slots, binding) {
                Ok(mut operator) => {
                    operator.configuration =
                        configuration(&operator.arguments, &designs[index as usize], binding);
                    operators.push(operator);
                }
                Err(Failure::Undefined) => {}
                Err(Failure::Error(error)) => {
                    errors.push(error);
                    break;
                }
            }
        }
    }
    let goal = match world.residual(&lifted.goal, &Vec::new()).and_then(|goal| condition(&[goal])) {
        Ok(goal) => Some(goal),
        Err(Failure::Undefined) => None,
        Err(Failure::Error(error)) => {
            errors.push(error);
            None
        }
    };
    if errors.is_empty() {
        Ok(GroundTask { world, operators, goal, objective: GroundObjective::default() })
    } else {
        Err(errors)
    }
}

/// One instance. `Failure::Undefined` says that it can never be applied.
fn operator(
    world: &mut World<'_>,
    schema: &Schema,
    index: u32,
    parameters: &[SlotParameter],
    core: &Binding,
) -> Result<GroundOperator, Failure> {
    let mut binding = core.clone();
    let mut slots = Slots { parameters, designs: Vec::new() };
    for (slot, position) in parameters.iter().zip(0..) {
        let designs = suitable_designs(world, schema, parameters, position, &mut binding)?;
        if designs.is_empty() {
            return Err(Failure::Undefined);
        }
        slots.designs.push(designs);
        binding[slot.parameter as usize] = None;
    }
    let mut build = Build { world, binding, slots, forbidden: Vec::new() };
    let start = build.conditions(&schema.start_condition)?;
    let (start_adds, start_deletes) = build.atoms(&schema.start_effects);
    let start_numeric = build.numeric(&schema.start_effects, &BTreeMap::new())?;
    let middle = build.conditions(&schema.middle_condition)?;
    let (mut adds, mut deletes) = build.atoms(&schema.end_effects);
    let mut numeric_effects = build.numeric(&schema.end_effects, &start_numeric)?;

    let mut parts = start;
    for part in middle {
        parts.push(after_start(part, &start_adds, &start_deletes, &start_numeric));
    }
    adds.extend(start_adds.iter().filter(|atom| !deletes.contains(atom)).copied().collect::<Vec<_>>());
    deletes.extend(start_deletes);
    adds.sort_unstable();
    adds.dedup();
    deletes.sort_unstable();
    deletes.dedup();
    deletes.retain(|atom| !adds.contains(atom));
    for (variable, value) in start_numeric {
        numeric_effects.entry(variable).or_insert(value);
    }
    let duration = match &schema.duration {
        Some(duration) => build.static_quantity(duration, schema)?,
        None => Quantity::constant(Rational::from_integer(0)),
    };
    let condition = condition(&parts)?;
    Ok(GroundOperator {
        schema: index,
        arguments: build.arguments(),
        slots: build.functions()?,
        forbidden: build.forbidden,
        configuration: Vec::new(),
        condition,
        adds,
        deletes,
        numeric_effects,
        cost: Quantity::constant(Rational::from_integer(0)),
        duration,
    })
}

fn configuration(
    arguments: &[Argument],
    designs: &[SlotParameter],
    core: &Binding,
) -> Vec<(ObjectId, Argument)> {
    let function = |term: Term| World::arguments(&[term], core).first().copied();
    designs
        .iter()
        .filter_map(|design| Some((function(design.function)?, arguments[design.parameter as usize])))
        .collect()
}

/// The candidates of one slot for which everything that depends on this slot alone is true and defined.
fn suitable_designs(
    world: &mut World<'_>,
    schema: &Schema,
    parameters: &[SlotParameter],
    position: u16,
    binding: &mut Binding,
) -> Result<Vec<ObjectId>, Failure> {
    let only = SlotSet::from_slice(&[position]);
    let parameter = parameters[position as usize].parameter as usize;
    let all = conjuncts(&schema.start_condition).into_iter().chain(conjuncts(&schema.middle_condition));
    let conditions: Vec<_> = all.filter(|c| slots_of_formula(c, parameters) == only).collect();
    let effects = schema.start_effects.iter().chain(&schema.end_effects).filter_map(|effect| match effect {
        Effect::Assign { expression, .. } => Some(expression),
        _ => None,
    });
    let expressions: Vec<_> =
        effects.chain(&schema.duration).filter(|e| slots_of_expression(e, parameters) == only).collect();
    let mut designs = Vec::new();
    for design in &schema.parameters[parameter].candidates {
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

struct Build<'w, 'a> {
    world: &'w mut World<'a>,
    binding: Binding,
    slots: Slots<'w>,
    forbidden: Vec<Forbidden>,
}

impl Build<'_, '_> {
    /// The conjuncts that remain; combinations of designs that break a static one are forbidden.
    fn conditions(&mut self, formula: &Formula) -> Result<Vec<Residual>, Failure> {
        let mut parts = Vec::new();
        for conjunct in conjuncts(formula) {
            let mentioned = slots_of_formula(conjunct, self.slots.parameters);
            if mentioned.is_empty() {
                parts.push(self.world.residual(conjunct, &self.binding)?);
            } else if let Formula::Compare(comparison, left, right, place) = conjunct {
                let (left, right) = (self.open(left)?, self.open(right)?);
                let static_part = left.coefficients.is_empty() && right.coefficients.is_empty();
                match compare(*comparison, left, right, *place) {
                    residual if static_part => self.forbid(&mentioned, &residual),
                    residual => parts.push(residual),
                }
            } else if mentioned.len() > 1 {
                self.forbid_unless(conjunct, &mentioned)?;
            }
        }
        Ok(parts)
    }

    fn open(&mut self, expression: &Expression) -> Result<Linear<Rational>, Failure> {
        let forbidden = &mut self.forbidden;
        let mut undefined = |slots: &SlotSet, combination: SlotSet| forbid(forbidden, slots, combination);
        self.world.open(expression, &mut self.binding, &self.slots, &mut undefined)
    }

    /// Forbids the combinations of designs for which a static comparison fails.
    fn forbid(&mut self, mentioned: &SlotSet, residual: &Residual) {
        match residual {
            Residual::And(parts) => parts.iter().for_each(|part| self.forbid(mentioned, part)),
            Residual::False => self.forbid_where(mentioned, &|_| true),
            Residual::Compare { linear, strict, .. } => {
                let sizes: Vec<_> = self.slots.designs.iter().map(Vec::len).collect();
                self.forbid_where(mentioned, &|choice| {
                    let value = linear.quantity.at(choice, &sizes);
                    value < Rational::from_integer(0) || (*strict && value == Rational::from_integer(0))
                });
            }
            _ => {}
        }
    }

    fn forbid_where(&mut self, mentioned: &SlotSet, fails: &dyn Fn(&[u16]) -> bool) {
        let mut choice = vec![0; self.slots.designs.len()];
        let forbidden = &mut self.forbidden;
        for_each_combination(mentioned, &self.slots, &mut self.binding, &mut |_, combination| {
            for (slot, design) in mentioned.iter().zip(combination) {
                choice[*slot as usize] = *design;
            }
            if fails(&choice) {
                forbid(forbidden, mentioned, SlotSet::from_slice(combination));
            }
        });
    }

    /// Forbids the combinations of designs for which a static condition over several slots fails.
    fn forbid_unless(&mut self, conjunct: &Formula, mentioned: &SlotSet) -> Result<(), Failure> {
        let (world, forbidden) = (&mut *self.world, &mut self.forbidden);
        let mut failure = None;
        for_each_combination(mentioned, &self.slots, &mut self.binding, &mut |binding, combination| {
            match world.residual(conjunct, binding) {
                Ok(Residual::False) => forbid(forbidden, mentioned, SlotSet::from_slice(combination)),
                Ok(_) => {}
                Err(error) => failure = Some(error),
            }
        });
        failure.map_or(Ok(()), Err)
    }

    fn atoms(&mut self, effects: &[Effect]) -> (Vec<AtomId>, Vec<AtomId>) {
        let (mut adds, mut deletes) = (Vec::new(), Vec::new());
        for effect in effects {
            match effect {
                Effect::Add(predicate, terms) => {
                    adds.push(self.world.atom(*predicate, World::arguments(terms, &self.binding)));
                }
                Effect::Delete(predicate, terms) => {
                    deletes.push(self.world.atom(*predicate, World::arguments(terms, &self.binding)));
                }
                Effect::Assign { .. } => {}
            }
        }
        (adds, deletes)
    }

    /// What numeric variables become, in terms of the state before the action; `before` are the changes that
    /// the action has made already.
    fn numeric(
        &mut self,
        effects: &[Effect],
        before: &BTreeMap<NumericId, Linear<Rational>>,
    ) -> Result<BTreeMap<NumericId, Linear<Rational>>, Failure> {
        let mut changed: BTreeMap<NumericId, Linear<Rational>> = BTreeMap::new();
        for effect in effects {
            let Effect::Assign { assignment, function, terms, expression, place } = effect else { continue };
            let variable = self.world.numeric(*function, World::arguments(terms, &self.binding), *place)?;
            let mut operand = self.open(expression)?;
            substitute(&mut operand, before);
            let current = || {
                let old = changed.get(&variable).or_else(|| before.get(&variable));
                old.cloned().unwrap_or_else(|| Linear::variable(variable))
            };
            let value = match assignment {
                Assignment::Assign => operand,
                Assignment::Increase => sum(current(), &operand),
                Assignment::Decrease => sum(current(), &operand.negated()),
                Assignment::ScaleUp | Assignment::ScaleDown => {
                    scaled(current(), &operand, *assignment == Assignment::ScaleDown, *place)?
                }
            };
            changed.insert(variable, value);
        }
        Ok(changed)
    }

    fn static_quantity(
        &mut self,
        expression: &Expression,
        schema: &Schema,
    ) -> Result<Quantity<Rational>, Failure> {
        let linear = self.open(expression)?;
        if linear.coefficients.is_empty() {
            return Ok(linear.quantity);
        }
        Err(Failure::Error(Error::Unsupported {
            construct: format!("a duration of `{}` that depends on the state", schema.name),
            instead: "a duration over functions that no action changes".into(),
            place: expression_place(expression),
        }))
    }

    fn arguments(&self) -> Vec<Argument> {
        let slot =
            |parameter: usize| self.slots.parameters.iter().position(|s| s.parameter as usize == parameter);
        self.binding
            .iter()
            .enumerate()
            .filter_map(|(parameter, object)| match object {
                Some(object) => Some(Argument::Object(*object)),
                None => slot(parameter).map(|position| Argument::Slot(position as u16)),
            })
            .collect()
    }

    fn functions(&self) -> Result<Vec<(ObjectId, Vec<ObjectId>)>, Failure> {
        let function = |term: Term| World::arguments(&[term], &self.binding).first().copied();
        let pairs = self.slots.parameters.iter().zip(&self.slots.designs);
        pairs
            .map(|(slot, designs)| Ok((function(slot.function).ok_or(Failure::Undefined)?, designs.clone())))
            .collect()
    }
}

fn forbid(forbidden: &mut Vec<Forbidden>, slots: &SlotSet, combination: SlotSet) {
    match forbidden.iter_mut().find(|rule| rule.slots == *slots) {
        Some(rule) if rule.combinations.contains(&combination) => {}
        Some(rule) => rule.combinations.push(combination),
        None => forbidden.push(Forbidden { slots: slots.clone(), combinations: vec![combination] }),
    }
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
    let factor = factor.quantity.constant;
    if inverse && factor == Rational::from_integer(0) {
        return Err(Failure::Undefined);
    }
    value.scale(&if inverse { factor.recip() } else { factor });
    Ok(value)
}

fn substitute(linear: &mut Linear<Rational>, before: &BTreeMap<NumericId, Linear<Rational>>) {
    let variables: Vec<_> = linear.coefficients.iter().map(|(variable, _)| *variable).collect();
    let mut result = linear.clone();
    result.coefficients.clear();
    for (variable, factor) in &linear.coefficients {
        let mut value = before.get(variable).cloned().unwrap_or_else(|| Linear::variable(*variable));
        value.scale(factor);
        result.add(&value);
    }
    if variables.iter().any(|variable| before.contains_key(variable)) {
        *linear = result;
    }
}

/// A condition of the middle or end of a durative action in terms of the state before its start.
fn after_start(
    residual: Residual,
    adds: &[AtomId],
    deletes: &[AtomId],
    numeric: &BTreeMap<NumericId, Linear<Rational>>,
) -> Residual {
    let recur = |parts: Vec<Residual>| {
        parts.into_iter().map(|part| after_start(part, adds, deletes, numeric)).collect()
    };
    match residual {
        Residual::And(parts) => Residual::And(recur(parts)),
        Residual::Or(parts) => Residual::Or(recur(parts)),
        Residual::Literal { atom, positive } if adds.contains(&atom) || deletes.contains(&atom) => {
            if adds.contains(&atom) == positive { Residual::True } else { Residual::False }
        }
        Residual::Compare { mut linear, strict, place } => {
            substitute(&mut linear, numeric);
            Residual::Compare { linear, strict, place }
        }
        other => other,
    }
}

fn expression_place(expression: &Expression) -> Place {
    match expression {
        Expression::Function(_, _, place)
        | Expression::Product(_, place)
        | Expression::Quotient(_, _, place) => *place,
        Expression::Negate(inner) => expression_place(inner),
        Expression::Sum(parts) if !parts.is_empty() => expression_place(&parts[0]),
        Expression::Sum(_) | Expression::Number(_) | Expression::TotalTime => {
            Place { file: File::Domain, span: Span::default() }
        }
    }
}

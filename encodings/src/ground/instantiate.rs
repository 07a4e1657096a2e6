//! Instances of schemas to ground operators, the designs of their slots still open.
//!
//! A durative action is composed into one step: conditions of its middle and end that its start effects
//! provide are dropped, those that they destroy make the instance impossible, and numeric conditions and effects of the
//! end are rewritten in terms of the state before the start (sequential execution of PDDL 2.1, section 8).
//!
//! Conditional effects on atoms stay as they are. An instance whose numbers (cost among them) change under a
//! condition becomes one operator for each case, and so does one whose start effects are conditional.

use std::collections::BTreeSet;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::configuration::{SlotParameter, depends_on_own_start};
use crate::error::{Error, File, Place};
use crate::ground::admit::admit_some;
use crate::ground::derived;
use crate::ground::effects::{Middle, Moment, cases, clashes, possible};
use crate::ground::evaluate::{AtomId, Binding, Failure, Row, Slots, World, for_each_combination};
use crate::ground::events::{Conflicts, Timeline, Timing};
use crate::ground::frame::{Frame, Outline};
use crate::ground::metric::GroundObjective;
use crate::ground::normal_form::{GroundCondition, GroundLiteral};
use crate::ground::numbers::Numbers;
use crate::ground::reach::Reached;
use crate::ground::reads::Reads;
use crate::ground::residual::{Residual, compare};
use crate::lifted::{Effect, Expression, Formula, Lifted, ObjectId, Rational, Schema, Term};
use crate::limits::Limits;
use crate::number::dense;
use crate::quantity::{Linear, Quantity, SlotSet};
use crate::task::{Argument, Forbidden};
use pddl::ast::Span;

/// The function and the designs that suit an operator, for each slot.
pub(crate) type GroundSlots = [(ObjectId, Vec<ObjectId>)];

/// An operator over atoms, with exact rationals.
#[derive(Debug, Clone)]
pub(crate) struct GroundOperator {
    pub(crate) schema: u32,
    pub(crate) arguments: Vec<Argument>,
    pub(crate) slots: Arc<GroundSlots>,
    pub(crate) forbidden: Arc<[Forbidden]>,
    /// Each function that the action requires, with the argument that is its design.
    pub(crate) configuration: Vec<(ObjectId, Argument)>,
    pub(crate) condition: GroundCondition,
    pub(crate) adds: Vec<AtomId>,
    pub(crate) deletes: Vec<AtomId>,
    /// After `adds` and `deletes`, those of one entry at once, deletes first.
    pub(crate) conditional: Vec<GroundConditional>,
    pub(crate) numeric_effects: Numbers,
    /// By objective.
    pub(crate) costs: Vec<Quantity<Rational>>,
    pub(crate) duration: Quantity<Rational>,
    /// Set if this is no action but a wait until that time.
    pub(crate) wait: Option<Rational>,
    /// Each time with whether a moment later is meant, until all durations are known.
    pub(crate) timing: Timing<(Rational, bool)>,
}

/// Atoms that change if a conjunction holds before the operator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct GroundConditional {
    pub(crate) condition: Vec<GroundLiteral>,
    pub(crate) adds: Vec<AtomId>,
    pub(crate) deletes: Vec<AtomId>,
}

/// The task over atoms.
pub(crate) struct GroundTask<'a> {
    pub(crate) world: World<'a>,
    pub(crate) operators: Vec<GroundOperator>,
    /// None if the goal is false whatever happens.
    pub(crate) goal: Option<GroundCondition>,
    pub(crate) objectives: Vec<GroundObjective>,
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
    let mut world = World::new(lifted, reached);
    world.limits = limits.clone();
    let timeline = Timeline::new(&mut world, &lifted.events);
    // Growing would move operators that are large and many; most instances become one.
    let mut operators = Vec::with_capacity(reached.instances.iter().map(Vec::len).sum());
    let mut errors = Vec::new();
    for (((schema, slots), instances), index) in
        lifted.schemas.iter().zip(slots).zip(&reached.instances).zip(0_usize..)
    {
        if depends_on_own_start(lifted, schema) {
            errors.push(Error::Unsupported {
                construct: format!(
                    "a derived predicate in `{}` that its own start effects or timed literals may change",
                    schema.name
                ),
                instead: "the condition of the derived predicate in its place".into(),
                place: schema.place,
            });
            continue;
        }
        let outline = Outline::new(lifted, schema, slots);
        let mut frames: FxHashMap<Row, Option<Arc<Frame>>> = FxHashMap::default();
        for binding in limits.watch(instances) {
            let binding = binding.map_err(|interrupted| vec![interrupted.into()])?;
            let frame = match frames.entry(outline.key(binding)) {
                Entry::Occupied(known) => Ok(known.get().clone()),
                Entry::Vacant(new) => match Frame::new(&mut world, &outline, binding) {
                    Ok(frame) => Ok(new.insert(frame.map(Arc::new)).clone()),
                    Err(error) => Err(error),
                },
            };
            let cases = frame.and_then(|frame| match frame {
                Some(frame) => {
                    let designs = &designs[index];
                    instance(&mut world, &outline, designs, &frame, timeline.as_ref(), binding)
                }
                None => Ok(Vec::new()),
            });
            match cases {
                Ok(mut cases) => operators.append(&mut cases),
                Err(Failure::Undefined) => {}
                Err(Failure::Error(error)) => {
                    errors.push(error);
                    break;
                }
            }
        }
    }
    let mut binding = vec![None; lifted.goal_variables];
    let at_rest = timeline.as_ref().map_or(Residual::True, Timeline::at_rest);
    let goal = world.residual(&lifted.goal, &mut binding).and_then(|goal| world.condition(&[goal, at_rest]));
    let goal = match goal.and_then(|goal| world.instantiate_axioms().map(|()| goal)) {
        Ok(goal) => Some(goal),
        Err(Failure::Undefined) => None,
        Err(Failure::Error(error)) => {
            errors.push(error);
            None
        }
    };
    if !errors.is_empty() {
        return Err(errors);
    }
    operators.extend(timeline.iter().flat_map(|timeline| timeline.waits(dense(lifted.schemas.len()))));
    if let Some(timeline) = &timeline {
        timeline.settle(&mut operators);
    }
    let mut task = GroundTask { world, operators, goal, objectives: Vec::new() };
    derived::simplify(&mut task, limits).map_err(|interrupted| vec![interrupted.into()])?;
    Ok(task)
}

/// The cases of one instance. `Failure::Undefined` says that it can never be applied.
fn instance(
    world: &mut World<'_>,
    outline: &Outline<'_>,
    designs: &[SlotParameter],
    frame: &Frame,
    timeline: Option<&Timeline>,
    core: &Binding,
) -> Result<Vec<GroundOperator>, Failure> {
    let mut build = Build { world, binding: core.clone(), slots: &frame.designs, forbidden: Vec::new() };
    let mut before = build.conditions(&outline.start.closed, &frame.start)?;
    let start = build.moment(&outline.schema.start_effects, &frame.start_operands)?;
    let over_all = build.conditions(&outline.over_all.closed, &frame.over_all)?;
    let at_end = build.conditions(&outline.at_end.closed, &frame.at_end)?;
    let end = build.moment(&outline.schema.end_effects, &frame.end_operands)?;
    let mut forbidden = frame.forbidden.clone();
    if !build.forbidden.is_empty() {
        let mut all = frame.forbidden.to_vec();
        for rule in &build.forbidden {
            for combination in &rule.combinations {
                forbid(&mut all, &rule.slots, combination.clone());
            }
        }
        if !admit_some(&all, &frame.designs.sizes(), &build.world.limits)? {
            return Ok(Vec::new());
        }
        forbidden = all.into();
    }
    let arguments = build.arguments(outline.schema);
    let template = GroundOperator {
        schema: outline.schema.action,
        configuration: configuration(&arguments, designs, core),
        arguments,
        slots: frame.slots.clone(),
        forbidden,
        condition: GroundCondition::default(),
        adds: Vec::new(),
        deletes: Vec::new(),
        conditional: Vec::new(),
        numeric_effects: Numbers::default(),
        costs: Vec::new(),
        duration: frame.duration.clone(),
        wait: None,
        timing: Timing::free(),
    };
    let lifted = build.world.lifted;
    if let Some(joint) = &outline.schema.joint {
        let (first, second) = outline.schema.end_effects.split_at(joint.start_effects);
        let (first_reads, second_reads) =
            (reads(lifted, &joint.start, first, core), reads(lifted, &joint.end, second, core));
        let (own, others) = frame.end_operands.split_at(joint.start_effects);
        let first = build.moment(first, own)?;
        let second = build.moment(second, others)?;
        let clashes = clashes(build.world, (&first_reads, &first), (&second_reads, &second));
        before.extend(clashes.iter().map(Residual::negated));
    }
    let untimed = Middle { over_all: &over_all, at_end: &at_end, passage: None };
    let mut operators = Vec::new();
    let Some(timeline) = timeline else {
        let cases = cases(outline.schema, &before, &start, &untimed, &end)?;
        // Most instances are one operator, to which the template goes.
        let templates = std::iter::repeat_n(template, cases.len());
        for (case, template) in std::iter::zip(cases, templates) {
            operators.extend(possible(case.operator(build.world, template))?);
        }
        return Ok(operators);
    };
    let schema = outline.schema;
    let at_start = reads(lifted, &schema.start_condition, &schema.start_effects, core);
    let mut later = reads(lifted, &schema.at_end, &schema.end_effects, core);
    let nothing = Moment::nothing();
    let is_instant = schema.duration.is_none() || schema.joint.is_some();
    let conflicts = if is_instant {
        later.condition(lifted, &schema.start_condition, core);
        Conflicts::new(build.world, timeline, (&later, &end), (&at_start, &nothing))
    } else {
        Conflicts::new(build.world, timeline, (&at_start, &start), (&later, &end))
    };
    for passage in timeline.passages(&frame.duration, &conflicts) {
        let middle = Middle { passage: Some(&passage), ..untimed };
        let template = GroundOperator { timing: passage.0.timing(), ..template.clone() };
        for case in cases(schema, &before, &start, &middle, &end)? {
            operators.extend(possible(case.operator(build.world, template.clone()))?);
        }
    }
    Ok(operators)
}

/// What a happening reads.
fn reads(lifted: &Lifted, condition: &Formula, effects: &[Effect], binding: &Binding) -> Reads {
    let mut reads = Reads::default();
    reads.condition(lifted, condition, binding);
    reads.effects(lifted, effects, binding);
    reads
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

/// An expression of a conditional effect.
pub(super) struct Apart {
    /// None where it is undefined.
    pub(super) operand: Option<Linear<Rational>>,
    /// The combinations of designs for which it is undefined.
    pub(super) undefined: Arc<[Forbidden]>,
}

/// An instance under construction.
pub(super) struct Build<'w, 'a> {
    pub(super) world: &'w mut World<'a>,
    pub(super) binding: Binding,
    pub(super) slots: &'w Slots<'w>,
    pub(super) forbidden: Vec<Forbidden>,
}

impl Build<'_, '_> {
    /// What is left of conjuncts that mention no slot, after what is left of those that do.
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    fn conditions(&mut self, closed: &[&Formula], open: &[Residual]) -> Result<Vec<Residual>, Failure> {
        let mut parts = Vec::with_capacity(open.len() + closed.len());
        parts.extend_from_slice(open);
        for conjunct in closed {
            parts.push(self.world.residual(conjunct, &mut self.binding)?);
        }
        Ok(parts)
    }

    /// What is left of conjuncts that mention slots; combinations of designs that break a static one are forbidden.
    pub(super) fn open_conditions(&mut self, open: &[(&Formula, SlotSet)]) -> Result<Vec<Residual>, Failure> {
        let mut parts = Vec::new();
        for (conjunct, mentioned) in open {
            if let Formula::Compare(comparison, left, right, _) = conjunct {
                let (left, right) = (self.open(left)?, self.open(right)?);
                let static_part = left.coefficients.is_empty() && right.coefficients.is_empty();
                match compare(*comparison, left, right) {
                    residual if static_part => self.forbid(mentioned, &residual)?,
                    residual => parts.push(residual),
                }
            } else if mentioned.len() > 1 {
                self.forbid_unless(conjunct, mentioned)?;
            }
        }
        Ok(parts)
    }

    /// The expression, or nothing where it is undefined, and apart the combinations of designs for which it is.
    pub(super) fn open_apart(&mut self, expression: &Expression) -> Result<Apart, Failure> {
        let own = std::mem::take(&mut self.forbidden);
        let operand = possible(self.open(expression));
        let undefined = std::mem::replace(&mut self.forbidden, own);
        Ok(Apart { operand: operand?, undefined: undefined.into() })
    }

    pub(super) fn open(&mut self, expression: &Expression) -> Result<Linear<Rational>, Failure> {
        let forbidden = &mut self.forbidden;
        let mut undefined = |slots: &SlotSet, combination: SlotSet| forbid(forbidden, slots, combination);
        self.world.open(expression, &mut self.binding, self.slots, &mut undefined)
    }

    /// Forbids the combinations of designs for which a static comparison fails.
    fn forbid(&mut self, mentioned: &SlotSet, residual: &Residual) -> Result<(), Failure> {
        match residual {
            Residual::And(parts) => parts.iter().try_for_each(|part| self.forbid(mentioned, part)),
            Residual::False => self.forbid_where(mentioned, &|_| true),
            Residual::Compare { linear, strict } => {
                let sizes = self.slots.sizes();
                self.forbid_where(mentioned, &|choice| {
                    let value = linear.quantity.at(choice, &sizes);
                    value < Rational::from_integer(0) || (*strict && value == Rational::from_integer(0))
                })
            }
            _ => Ok(()),
        }
    }

    fn forbid_where(&mut self, mentioned: &SlotSet, fails: &dyn Fn(&[u32]) -> bool) -> Result<(), Failure> {
        let mut choice = vec![0; self.slots.designs.len()];
        let forbidden = &mut self.forbidden;
        let limits = &self.world.limits;
        for_each_combination(mentioned, self.slots, &mut self.binding, limits, &mut |_, combination| {
            for (slot, design) in mentioned.iter().zip(combination) {
                choice[*slot as usize] = *design;
            }
            if fails(&choice) {
                forbid(forbidden, mentioned, SlotSet::from_slice(combination));
            }
            Ok(())
        })
    }

    /// Forbids the combinations of designs with which the action would end before it begins.
    pub(super) fn forbid_negative(&mut self, duration: &Quantity<Rational>) -> Result<(), Failure> {
        let zero = Rational::from_integer(0);
        let least = duration.tables.iter().filter_map(|table| table.values.iter().min());
        if least.fold(duration.constant.clone(), |sum, value| sum + value) >= zero {
            return Ok(());
        }
        let slots: BTreeSet<u32> =
            duration.tables.iter().flat_map(|table| table.slots.iter().copied()).collect();
        let sizes = self.slots.sizes();
        self.forbid_where(&slots.into_iter().collect(), &|choice| duration.at(choice, &sizes) < zero)
    }

    /// Forbids the combinations of designs for which a static condition over several slots fails.
    fn forbid_unless(&mut self, conjunct: &Formula, mentioned: &SlotSet) -> Result<(), Failure> {
        let (world, forbidden) = (&mut *self.world, &mut self.forbidden);
        let limits = world.limits.clone();
        for_each_combination(
            mentioned,
            self.slots,
            &mut self.binding,
            &limits,
            &mut |binding, combination| {
                if matches!(world.residual(conjunct, &mut binding.clone())?, Residual::False) {
                    forbid(forbidden, mentioned, SlotSet::from_slice(combination));
                }
                Ok(())
            },
        )
    }

    pub(super) fn static_quantity(
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

    fn arguments(&self, schema: &Schema) -> Vec<Argument> {
        let slot =
            |parameter: usize| self.slots.parameters.iter().position(|s| s.parameter as usize == parameter);
        self.binding[..schema.parameters.len()]
            .iter()
            .enumerate()
            .filter_map(|(parameter, object)| match object {
                Some(object) => Some(Argument::Object(*object)),
                None => slot(parameter).map(|position| Argument::Slot(dense(position))),
            })
            .collect()
    }
}

pub(super) fn forbid(forbidden: &mut Vec<Forbidden>, slots: &SlotSet, combination: SlotSet) {
    match forbidden.iter_mut().find(|rule| rule.slots == *slots) {
        Some(rule) if rule.combinations.contains(&combination) => {}
        Some(rule) => rule.combinations.push(combination),
        None => forbidden.push(Forbidden { slots: slots.clone(), combinations: vec![combination] }),
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

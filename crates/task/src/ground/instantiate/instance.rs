//! Instantiates an action schema under a binding of its parameters.

use std::sync::Arc;

use crate::compile::is_violation_count;
use crate::ground::evaluate::normal_form::Definitions;
use crate::ground::evaluate::reads::Reads;
use crate::ground::instantiate::conditional_effects::{Middle, cases};
use crate::ground::instantiate::design_constraints::{admit_some, distinct, forbid};
use crate::ground::instantiate::frame::SharedInstanceData;
use crate::ground::instantiate::instance_builder::Build;
use crate::ground::instantiate::simultaneous_effects::{SimultaneousEffects, clashes};
use crate::ground::instantiate::slot_split::SplitSchema;
use crate::ground::instantiate::timeline::Timeline;
use crate::ground::instantiate::timeline_windows::{Conflicts, TimelineWindow};
use crate::ground::vocabulary::atom::{Binding, arguments};
use crate::ground::vocabulary::condition::GroundCondition;
use crate::ground::vocabulary::eval_error::{Failure, possible};
use crate::ground::vocabulary::numbers::Numbers;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::partial_eval::Residual;
use crate::ground::vocabulary::world::World;
use crate::lifted::configuration::SlotParameter;
use crate::lifted::{Change, Effect, Formula, Joint, Lifted, ObjectId, Schema, Term};
use crate::task::timing::Timing;
use crate::task::{Argument, ForbiddenCombinations};

pub(super) struct Instantiation<'a> {
    pub(super) world: World<'a>,
    pub(super) definitions: Definitions,
    pub(super) timeline: Option<Timeline>,
}

impl<'a> Instantiation<'a> {
    pub(super) fn new(mut world: World<'a>) -> Self {
        let timeline = Timeline::new(&mut world);
        Self { world, definitions: Definitions::default(), timeline }
    }

    /// Returns one operator for each possible combination of a timeline window and a case. If the instance is never
    /// applicable, returns `Failure::Undefined` or an empty list.
    pub(super) fn operators(
        &mut self,
        outline: &SplitSchema<'_>,
        frame: &SharedInstanceData,
        core: &Binding,
    ) -> Result<Vec<GroundOperator>, Failure> {
        let Self { world, definitions, timeline } = self;
        let schema = outline.schema;
        let mut build = Build { world, binding: core.clone(), slots: &frame.designs, forbidden: Vec::new() };
        let mut before = build.conditions(&outline.start.closed, &frame.start)?;
        let start = SimultaneousEffects::new(&mut build, &schema.start_effects, &frame.start_operands)?;
        let over_all = build.conditions(&outline.over_all.closed, &frame.over_all)?;
        let at_end = build.conditions(&outline.at_end.closed, &frame.at_end)?;
        let end = SimultaneousEffects::new(&mut build, &schema.end_effects, &frame.end_operands)?;
        let Some(forbidden) = forbidden(&build, frame)? else { return Ok(Vec::new()) };
        let template = template(&build, outline, frame, forbidden);
        if let Some(joint) = &schema.joint {
            before.extend(joint_clashes(&mut build, schema, joint, frame)?.iter().map(Residual::negated));
        }
        let untimed = Middle { over_all: &over_all, at_end: &at_end, passage: None };
        let mut operators = Vec::new();
        let Some(timeline) = timeline else {
            let cases = cases(schema, &before, &start, &untimed, &end)?;
            // Most instances have a single operator, which takes the template without a copy.
            let templates = std::iter::repeat_n(template, cases.len());
            for (case, template) in std::iter::zip(cases, templates) {
                operators.extend(possible(case.operator(world, definitions, template))?);
            }
            return Ok(operators);
        };
        let conflicts = conflicts(world, timeline, schema, (&start, &end), core);
        let limits = world.limits;
        for passage in limits.watch(TimelineWindow::all(timeline, &frame.duration, &conflicts)) {
            let passage = passage?;
            let middle = Middle { passage: Some(&passage), ..untimed };
            let template = GroundOperator { timing: passage.0.timing(), ..template.clone() };
            for case in cases(schema, &before, &start, &middle, &end)? {
                operators.extend(possible(case.operator(world, definitions, template.clone()))?);
            }
        }
        Ok(operators)
    }
}

fn forbidden(
    build: &Build<'_, '_>,
    frame: &SharedInstanceData,
) -> Result<Option<Arc<[ForbiddenCombinations]>>, Failure> {
    if build.forbidden.is_empty() {
        return Ok(Some(frame.forbidden.clone()));
    }
    let mut forbidden = frame.forbidden.to_vec();
    for rule in &build.forbidden {
        for combination in &rule.combinations {
            forbid(&mut forbidden, &rule.slots, combination.clone());
        }
    }
    let forbidden = distinct(forbidden);
    let is_admissible = admit_some(&forbidden, &frame.designs.sizes(), build.world.limits)?;
    Ok(is_admissible.then_some(forbidden))
}

fn template(
    build: &Build<'_, '_>,
    outline: &SplitSchema<'_>,
    frame: &SharedInstanceData,
    forbidden: Arc<[ForbiddenCombinations]>,
) -> GroundOperator {
    let arguments = build.arguments(outline.schema);
    GroundOperator {
        schema: outline.schema.action,
        configuration: configuration(&arguments, outline.designs, &build.binding),
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
    }
}

fn configuration(
    values: &[Argument],
    designs: &[SlotParameter],
    binding: &Binding,
) -> Vec<(ObjectId, Argument)> {
    let function = |term: Term| arguments(&[term], binding).first().copied();
    designs
        .iter()
        .filter_map(|design| Some((function(design.function)?, values[design.parameter as usize])))
        .collect()
}

fn joint_clashes(
    build: &mut Build<'_, '_>,
    schema: &Schema,
    joint: &Joint,
    frame: &SharedInstanceData,
) -> Result<Vec<Residual>, Failure> {
    let lifted = build.world.lifted;
    let (first, second) = schema.end_effects.split_at(joint.start_effects);
    // By definition, preferences read nothing. So the effects that count violations do not interfere.
    let reads_of = |condition: &Formula, effects: &[Effect]| {
        let mut reads = reads(lifted, condition, &[], &build.binding);
        for effect in effects.iter().filter(|effect| !counts_violations(lifted, effect)) {
            reads.effects(lifted, std::slice::from_ref(effect), &build.binding);
        }
        reads
    };
    let (first_reads, second_reads) = (reads_of(&joint.start, first), reads_of(&joint.end, second));
    let (first_operands, second_operands) = frame.end_operands.split_at(joint.start_effects);
    let first = SimultaneousEffects::new(build, first, first_operands)?;
    let second = SimultaneousEffects::new(build, second, second_operands)?;
    Ok(clashes(build.world, (&first_reads, &first), (&second_reads, &second)))
}

fn counts_violations(lifted: &Lifted, effect: &Effect) -> bool {
    match &effect.change {
        Change::Assign { function, .. } => is_violation_count(&lifted.functions[function.index()].name),
        Change::Add(..) | Change::Delete(..) => false,
    }
}

fn conflicts(
    world: &World<'_>,
    timeline: &Timeline,
    schema: &Schema,
    (start, end): (&SimultaneousEffects, &SimultaneousEffects),
    binding: &Binding,
) -> Conflicts {
    let lifted = world.lifted;
    let at_start = reads(lifted, &schema.start_condition, &schema.start_effects, binding);
    let mut later = reads(lifted, &schema.at_end, &schema.end_effects, binding);
    let is_instant = schema.duration.is_none() || schema.joint.is_some();
    if is_instant {
        later.condition(lifted, &schema.start_condition, binding);
        Conflicts::new(world, timeline, (&later, end), (&at_start, &SimultaneousEffects::nothing()))
    } else {
        Conflicts::new(world, timeline, (&at_start, start), (&later, end))
    }
}

fn reads(lifted: &Lifted, condition: &Formula, effects: &[Effect], binding: &Binding) -> Reads {
    let mut reads = Reads::default();
    reads.condition(lifted, condition, binding);
    reads.effects(lifted, effects, binding);
    reads
}

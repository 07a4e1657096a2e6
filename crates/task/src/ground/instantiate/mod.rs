//! Instantiates action schemas: each schema and binding becomes ground operators (none, one or several) whose
//! slots are still open.
//!
//! A durative action becomes a single step (sequential execution of PDDL 2.1, section 8). Conditions on its
//! middle and end that its start effects make true are dropped; conditions that its start effects make false
//! make the instance impossible. Numeric conditions and effects of the end are rewritten over the state
//! before the start.
//!
//! Conditional end effects on atoms are kept. An instance with conditional numeric effects (including costs) or
//! conditional start effects is split into one operator for each combination of truth values.
//!
//! `slot_split` separates the parts of a schema that mention slots. `frame` caches data of instances with
//! equal key parameters. `simultaneous_effects` evaluates the effects of a start or an end.
//! `timeline_windows` enumerates the possible positions of an action between timed initial literals, and
//! `conditional_effects` splits each position into operators.

mod axioms;
mod change;
mod conditional_effects;
mod design_constraints;
mod frame;
mod instance;
mod instance_builder;
mod simultaneous_effects;
mod slot_split;
mod timeline;
mod timeline_windows;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::error::{Error, Errors};
use crate::ground::evaluate::condition::residual;
use crate::ground::instantiate::axioms::instantiate_axioms;
use crate::ground::instantiate::frame::SharedInstanceData;
use crate::ground::instantiate::instance::Instantiation;
use crate::ground::instantiate::slot_split::SplitSchema;
use crate::ground::instantiate::timeline::Timeline;
use crate::ground::vocabulary::atom::Row;
use crate::ground::vocabulary::condition::GroundCondition;
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::partial_eval::Residual;
use crate::ground::vocabulary::task::GroundTask;
use crate::ground::vocabulary::world::World;
use crate::lifted::Schema;
use crate::lifted::configuration::{SlotParameter, depends_on_own_start};
use crate::number::dense;

/// Converts every reached instance to operators, the goal to a condition, and the axioms of all derived atoms
/// in use to rules. `designs` holds the design parameters of each schema, and `slots` those of them that are
/// slots.
///
/// # Errors
/// Returns the first error of each action schema and of the goal, for example an unsupported expression, or an error
/// if the deadline passes or the run is interrupted.
pub fn instantiate<'a>(
    world: World<'a>,
    designs: &[Vec<SlotParameter>],
    slots: &[Vec<SlotParameter>],
) -> Result<GroundTask<'a>, Errors> {
    let mut errors = Vec::new();
    let mut instantiation = Instantiation::new(world);
    let mut operators = operators(&mut instantiation, designs, slots, &mut errors)?;
    let goal = match goal(&mut instantiation) {
        Ok(goal) => Some(goal),
        Err(Failure::Undefined) => None,
        Err(Failure::Error(error)) => {
            errors.push(error);
            None
        }
    };
    if !errors.is_empty() {
        return Err(errors.into());
    }
    let Instantiation { world, definitions, timeline } = instantiation;
    if let Some(timeline) = &timeline {
        operators.extend(timeline.waits(dense(world.lifted.schemas.len())));
        timeline.settle(&mut operators);
    }
    Ok(GroundTask { world, operators, axioms: definitions.axioms, goal, objectives: Vec::new() })
}

fn operators(
    instantiation: &mut Instantiation<'_>,
    designs: &[Vec<SlotParameter>],
    slots: &[Vec<SlotParameter>],
    errors: &mut Vec<Error>,
) -> Result<Vec<GroundOperator>, Errors> {
    let (lifted, reached) = (instantiation.world.lifted, instantiation.world.reached);
    // The exact capacity avoids moving many large operators; most instances have a single operator.
    let mut operators = Vec::with_capacity(reached.instances.iter().map(Vec::len).sum());
    let parameters = designs.iter().zip(slots);
    for ((schema, (designs, slots)), instances) in
        lifted.schemas.iter().zip(parameters).zip(&reached.instances)
    {
        if depends_on_own_start(lifted, schema) {
            errors.push(own_start(schema));
            continue;
        }
        let outline = SplitSchema::new(lifted, schema, designs, slots);
        let mut frames: FxHashMap<Row, Option<Arc<SharedInstanceData>>> = FxHashMap::default();
        for binding in instantiation.world.limits.watch(instances) {
            let binding = binding?;
            let frame = match frames.entry(outline.key(binding)) {
                Entry::Occupied(known) => Ok(known.get().clone()),
                Entry::Vacant(new) => {
                    match SharedInstanceData::new(&mut instantiation.world, &outline, binding) {
                        Ok(frame) => Ok(new.insert(frame.map(Arc::new)).clone()),
                        Err(error) => Err(error),
                    }
                }
            };
            let cases = frame.and_then(|frame| match frame {
                Some(frame) => instantiation.operators(&outline, &frame, binding),
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
    Ok(operators)
}

fn own_start(schema: &Schema) -> Error {
    Error::Unsupported {
        construct: format!(
            "a derived predicate in `{}` that its own start effects or timed literals may change",
            schema.name
        ),
        instead: "the condition of the derived predicate in its place".into(),
        place: schema.place,
    }
}

fn goal(instantiation: &mut Instantiation<'_>) -> Result<GroundCondition, Failure> {
    let Instantiation { world, definitions, timeline } = instantiation;
    let lifted = world.lifted;
    let mut binding = vec![None; lifted.goal_variables];
    let at_rest = timeline.as_ref().map_or(Residual::True, Timeline::at_rest);
    let goal = residual(world, &lifted.goal, &mut binding)?;
    let goal = definitions.condition(world, &[goal, at_rest])?;
    instantiate_axioms(world, definitions)?;
    Ok(goal)
}

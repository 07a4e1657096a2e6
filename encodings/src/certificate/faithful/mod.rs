//! Whether a written task stands for its PDDL files, checked without grounding them again.
//!
//! What is needed is a simulation [1]: the initial state of the files is that of the task, and whatever an action does
//! in a state of the files, an operator with some choice of designs does in the task's, for no more cost; the goal of the files
//! implies that of the task. Then no plan of the files is cheaper than what the argument says of plans of the task. The
//! task may allow more than the files, and leave out what does not matter to it.
//!
//! All instances of all actions are gone through: [`instances`] enumerates them by joins over what never changes,
//! [`meaning`] says what each requires and does, and [`compare`] looks for the operator. A variable of the task stands for
//! atoms of which at most one holds: that is true at first, and every instance keeps it so. Instances that require an atom that is
//! out of reach, even if nothing is ever deleted, do not count.
//!
//! Covered are conjunctions of literals, equality and linear comparisons, and disjunctions of which what never changes leaves one
//! part; unconditional effects; actions with and
//! without a fixed duration, one after another; metrics to be minimized. Of everything else this says that it is not
//! covered. Shared with grounding is the syntax tree and nothing else.
//!
//! [1] R. Milner: An algebraic definition of simulation between programs, IJCAI 1971.

mod compare;
mod instances;
mod linear;
mod meaning;
mod world;

use num_traits::Zero;
use rustc_hash::FxHashSet;

use crate::certificate::model::Model;
use crate::certificate::shape;
use crate::certificate::write::TASK_FORMAT;
use crate::pddl::ast::{Domain, Problem};
use compare::Comparison;
use meaning::Meaning;
use world::{Key, World};

/// With more instances, nothing is checked.
const INSTANCE_LIMIT: usize = 400_000;
/// Of so many instances the meaning is kept once it is known.
const KEPT: usize = 20_000;

/// What came of the comparison of a task with its files.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Faithful {
    /// It stands for them.
    Yes {
        /// Instances of actions that may be executed.
        instances: usize,
        /// Those of them that change nothing that the task knows.
        idle: usize,
        /// As [`crate::Task::is_timed`].
        timed: bool,
    },
    /// Something is not covered.
    Unknown(String),
    /// The first thing that differs.
    No(String),
}

/// Why there is no answer yet.
pub(super) enum Obstacle {
    /// Not covered.
    Unknown(String),
    /// Wrong.
    Wrong(String),
}

/// Compares a written task with the files.
pub fn faithful(domain: &Domain, problem: &Problem, task: &str) -> Faithful {
    let model: Model = match serde_json::from_str(task) {
        Ok(model) => model,
        Err(error) => return Faithful::No(error.to_string()),
    };
    let formed = model.format == TASK_FORMAT;
    if let Err(reason) =
        shape::task(&model).and_then(|()| formed.then_some(()).ok_or("another format".into()))
    {
        return Faithful::No(reason);
    }
    match simulates(domain, problem, &model) {
        Ok((instances, idle, timed)) => Faithful::Yes { instances, idle, timed },
        Err(Obstacle::Unknown(reason)) => Faithful::Unknown(reason),
        Err(Obstacle::Wrong(reason)) => Faithful::No(reason),
    }
}

/// An instance: the action, and its arguments as objects.
struct Instance {
    action: usize,
    arguments: Vec<u32>,
    requires: Vec<Key>,
    adds: Vec<Key>,
    takes_time: bool,
    /// Worked out again where there are many instances.
    meaning: Option<Meaning>,
}

fn simulates(domain: &Domain, problem: &Problem, model: &Model) -> Result<(usize, usize, bool), Obstacle> {
    let world = World::new(domain, problem).map_err(Obstacle::Unknown)?;
    let comparison = Comparison::new(&world, model)?;
    let mut all = Vec::new();
    for (action, schema) in domain.actions.iter().enumerate() {
        for arguments in instances::of(&world, schema).map_err(Obstacle::Unknown)? {
            if let Some(meaning) = Meaning::of(&world, schema, &arguments).map_err(Obstacle::Unknown)? {
                let adds = meaning.truths.iter().filter(|(_, holds)| **holds).map(|(key, _)| key.clone());
                let (adds, requires) = (adds.collect(), meaning.positive.iter().cloned().collect());
                let takes_time = meaning.duration.as_ref().is_some_and(|duration| !duration.is_zero());
                let meaning = (all.len() < KEPT).then_some(meaning);
                all.push(Instance { action, arguments, requires, adds, takes_time, meaning });
            }
            if all.len() > INSTANCE_LIMIT {
                return Err(Obstacle::Unknown(format!("more than {INSTANCE_LIMIT} instances of actions")));
            }
        }
    }
    let reached = reach(&world, &mut all);
    // Without a metric, this is what says what plans are measured by.
    if problem.metric.is_none() && comparison.timed != all.iter().any(|instance| instance.takes_time) {
        return Err(Obstacle::Unknown("whether plans are measured by time or by length".into()));
    }
    comparison.initial()?;
    comparison.goal(&reached)?;
    let mut idle = 0;
    for Instance { action, arguments, meaning, .. } in &mut all {
        let schema = &domain.actions[*action];
        let meaning = match meaning.take() {
            Some(kept) => Some(kept),
            None => Meaning::of(&world, schema, arguments).map_err(Obstacle::Unknown)?,
        };
        if let Some(meaning) = meaning {
            idle += usize::from(!comparison.instance(schema, arguments, &meaning)?);
        }
    }
    Ok((all.len(), idle, comparison.timed))
}

/// The atoms that may ever hold if nothing is deleted; instances that need others are dropped.
fn reach(world: &World<'_>, all: &mut Vec<Instance>) -> FxHashSet<Key> {
    let mut reached: FxHashSet<Key> = world.initial_atoms().collect();
    let mut open: Vec<usize> = (0..all.len()).collect();
    loop {
        let before = open.len();
        open.retain(|at| {
            let instance = &all[*at];
            let enabled = instance.requires.iter().all(|key| reached.contains(key));
            if enabled {
                reached.extend(instance.adds.iter().cloned());
            }
            !enabled
        });
        if open.len() == before {
            break;
        }
    }
    all.retain(|instance| instance.requires.iter().all(|key| reached.contains(key)));
    reached
}

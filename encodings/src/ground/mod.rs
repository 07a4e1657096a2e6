//! Lifted task to ground task.
//!
//! Relaxed reachability (a Datalog program on the rule engine, after Helmert [1]) yields the instances of each
//! schema, without its separable design parameters; each instance becomes one operator with slots; mutex groups become
//! finite-domain variables; all numbers become exact integers.
//!
//! [1] M. Helmert: Concise finite-domain representations for PDDL planning tasks, Artificial Intelligence 173, 2009.

mod admit;
mod derived;
mod effects;
pub(crate) mod evaluate;
pub(crate) mod events;
mod finish;
mod frame;
mod instantiate;
mod integers;
mod intervals;
mod join;
mod metric;
mod mutex;
mod normal_form;
mod numbers;
mod prune;
pub(crate) mod reach;
pub(crate) mod reads;
mod relaxed;
pub(crate) mod residual;

use crate::configuration::{SlotParameter, design_parameters, slot_parameters};
use crate::error::Error;
use crate::ground::reach::Reached;
use crate::lifted::Lifted;
use crate::limits::Limits;
use crate::normalize::{normalize, zero};
use crate::number::Int;
use crate::task::Task;
use crate::task_number::TaskNumber;
use pddl::ast::{Domain, Metric, Name, Problem};

/// How the domain's symbols are to be read.
#[derive(Debug, Clone)]
pub struct Config {
    /// Predicates `(p DESIGN FUNCTION)` that say which design solves which function.
    pub solves: Vec<Name>,
    /// What plans are measured by, the most important first, in place of the metric of the problem; none for that metric.
    pub objectives: Vec<Metric>,
    /// When to give up.
    pub limits: Limits,
}

impl Default for Config {
    /// The names of the Metaplan paper and of the files of kas-lab.
    fn default() -> Self {
        Self {
            solves: ["fd_solve_f", "fd_solves_f", "inferred-SolvesF", "solvesF"].map(Name::new).to_vec(),
            objectives: Vec::new(),
            limits: Limits::none(),
        }
    }
}

/// Grounds a domain and a problem that have passed `pddl::check`.
///
/// # Errors
/// Every construct that the planner does not handle, with its place.
pub fn ground(domain: &Domain, problem: &Problem, config: &Config) -> Result<Task, Vec<Error>> {
    ground_for(domain, problem, config, &Generality::default())
}

/// What a ground task is to be good for beside the problem that it is made of.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Generality {
    /// If given, numbers of the initial state may be others, too, that are integers when multiplied by this: nothing is
    /// concluded from those of the problem.
    pub(crate) numbers: Option<Int>,
}

/// Grounds a problem so that other initial states can take the place of its own.
pub(crate) fn ground_for<N: TaskNumber>(
    domain: &Domain,
    problem: &Problem,
    config: &Config,
    generality: &Generality,
) -> Result<Task<N>, Vec<Error>> {
    let mut lifted = normalize(domain, problem, &config.objectives)?;
    zero::split(&mut lifted)?;
    events::begin(&mut lifted);
    let designs: Vec<_> =
        lifted.schemas.iter().map(|schema| design_parameters(&lifted, schema, &config.solves)).collect();
    let slots: Vec<_> = lifted
        .schemas
        .iter()
        .zip(&designs)
        .map(|(schema, designs)| slot_parameters(&lifted, schema, designs))
        .collect();
    ground_lifted(&lifted, &designs, &slots, generality, &config.limits).map(|(task, _)| task)
}

/// Grounds a lifted task. For each schema: its design parameters, and those of them that become slots.
///
/// # Errors
/// As [`ground`].
pub(crate) fn ground_lifted<N: TaskNumber>(
    lifted: &Lifted,
    designs: &[Vec<SlotParameter>],
    slots: &[Vec<SlotParameter>],
    generality: &Generality,
    limits: &Limits,
) -> Result<(Task<N>, Reached), Vec<Error>> {
    let reached = reach::reach(lifted, slots, limits).map_err(|error| vec![error])?;
    let mut ground = instantiate::instantiate(lifted, designs, slots, &reached, limits)?;
    metric::attach_costs(lifted, &mut ground, limits)?;
    if limits.reached() {
        return Err(vec![Error::Interrupted]);
    }
    let unreachable =
        prune::prune(lifted, &mut ground, generality, limits).map_err(|error| vec![error.into()])?;
    let task =
        finish::finish(lifted, ground, unreachable, generality, limits).map_err(|error| vec![error])?;
    Ok((task, reached))
}

//! Grounding: converts the lifted task to a ground task with finite-domain variables and numbers of one type
//! (usually integers).
//!
//! Relaxed reachability, a Datalog program after Helmert \[1\], computes the reachable instances of each action
//! schema. Design parameters that can be chosen independently are slots and are not instantiated. Each instance
//! becomes operators with slots, mutex groups become finite-domain variables, and all numbers become integers
//! by scaling (or remain exact rationals if the caller requests this).
//!
//! The passes exchange the types in the module `vocabulary`:
//!
//! | pass | from | to |
//! |---|---|---|
//! | `relaxed_reachability` | `Lifted`, slots | `RelaxedReachability`: instances of schemas, atoms that can hold |
//! | `instantiate` | the `World` of these instances and atoms | `GroundTask`: operators, rules and a goal over atoms |
//! | `derived` | constant derived atoms, and those with a single rule | truth values, or the rule bodies in their place |
//! | `metric` | metrics | operator costs and objectives |
//! | `prune` | operators and rules | the relevant and reachable ones, or the reason why the goal is unreachable |
//! | `finalize` | `GroundTask` | `Task`: finite-domain variables for atoms, integers for rationals |
//!
//! \[1\] M. Helmert: Concise finite-domain representations for PDDL planning tasks, Artificial Intelligence 173, 2009.

mod config;
mod derived;
pub mod evaluate;
mod finalize;
mod instantiate;
mod metric;
mod prune;
mod relaxed_reachability;
#[cfg(test)]
mod tests;
pub mod vocabulary;

use crate::compile::{PlanSemantics, compile};
use crate::error::{Error, Errors};
use crate::lifted::Lifted;
use crate::lifted::configuration::{SlotParameter, design_parameters, slot_parameters};
use crate::limits::Limits;
use crate::normalize::{duration, events, normalize, undefined_fluents, zero_duration};
use crate::task::Task;
use crate::task::number::TaskNumber;
use pddl::ast::{Domain, Problem};
use tracing::field::Empty;
use tracing::info_span;

pub use config::Generality;
pub use config::GroundConfig;
use vocabulary::reached::RelaxedReachability;
use vocabulary::world::World;

/// Grounds a domain and a problem that have passed `pddl::check`.
///
/// ```
/// use metaplan_task::ground::{GroundConfig, ground};
/// # use pddl::{Source, read};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let domain = Source::new("d", "(define (domain d) (:requirements :typing :numeric-fluents) (:types place)
/// #   (:predicates (at ?p - place) (way ?a ?b - place)) (:functions (time) (energy))
/// #   (:action walk :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
/// #     :effect (and (not (at ?a)) (at ?b) (increase (time) 5) (increase (energy) 1)))
/// #   (:action ride :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
/// #     :effect (and (not (at ?a)) (at ?b) (increase (time) 1) (increase (energy) 4))))");
/// # let problem = Source::new("p", "(define (problem p) (:domain d) (:objects a b c - place)
/// #   (:init (at a) (way a b) (way b c) (= (time) 0) (= (energy) 0)) (:goal (at c)) (:metric minimize (time)))");
/// let (domain, problem, _warnings) = read(&domain, &problem)?;
/// let task = ground(&domain, &problem, &GroundConfig::default())?;
/// assert!(task.is_timed());
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Returns unsupported constructs with their source locations (of each action schema at least the first one), or an
/// error if a number of the metric has no initial value, numbers overflow, the deadline passes or the run is
/// interrupted.
pub fn ground(domain: &Domain, problem: &Problem, config: &GroundConfig) -> Result<Task, Errors> {
    let measures_ends = config.objectives.len() <= 1;
    ground_for(domain, problem, config, &Generality { measures_ends, ..Generality::default() })
}

/// Grounds a problem to a task with numbers of type `N`. The ground task is also valid for other initial numbers, as
/// specified by `generality`.
///
/// # Errors
/// See [`ground`].
pub fn ground_for<N: TaskNumber>(
    domain: &Domain,
    problem: &Problem,
    config: &GroundConfig,
    generality: &Generality,
) -> Result<Task<N>, Errors> {
    let GroundConfig { objectives, limits, .. } = config;
    let plain = info_span!("compile")
        .in_scope(|| compile(domain, problem, objectives, PlanSemantics::Sequence, limits))?;
    let errors = duration::changed_by_start(&plain.domain);
    if !errors.is_empty() {
        return Err(errors.into());
    }
    let lifted =
        || info_span!("normalize").in_scope(|| normalize(&plain.domain, &plain.problem, &plain.objectives));
    let grounded = ground_normal(lifted()?, config, generality);
    match grounded {
        Err(errors) if generality.numbers.is_none() && errors.iter().any(Error::is_value_missing) => {
            let mut lifted = lifted()?;
            undefined_fluents::guard(&mut lifted);
            ground_normal(lifted, config, generality)
        }
        grounded => grounded,
    }
}

fn ground_normal<N: TaskNumber>(
    mut lifted: Lifted,
    config: &GroundConfig,
    generality: &Generality,
) -> Result<Task<N>, Errors> {
    zero_duration::split(&mut lifted)?;
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

/// Grounds a lifted task. `designs` holds the design parameters of each schema, and `slots` those of them
/// that become slots. Also returns the result of relaxed reachability.
///
/// # Errors
/// See [`ground`].
pub fn ground_lifted<N: TaskNumber>(
    lifted: &Lifted,
    designs: &[Vec<SlotParameter>],
    slots: &[Vec<SlotParameter>],
    generality: &Generality,
    limits: &Limits,
) -> Result<(Task<N>, RelaxedReachability), Errors> {
    let span = info_span!("ground", operators = Empty, variables = Empty).entered();
    let reached = info_span!("reach").in_scope(|| relaxed_reachability::reach(lifted, slots, limits))?;
    let world = World::new(lifted, &reached, limits);
    let instantiate = info_span!("instantiate", operators = Empty).entered();
    let mut ground = instantiate::instantiate(world, designs, slots)?;
    instantiate.record("operators", ground.operators.len());
    drop(instantiate);
    info_span!("derived").in_scope(|| derived::simplify(&mut ground))?;
    info_span!("metric").in_scope(|| metric::attach_costs(&mut ground, generality))?;
    if limits.reached() {
        return Err(vec![Error::Interrupted].into());
    }
    let unreachable = info_span!("prune").in_scope(|| prune::prune(&mut ground, generality))?;
    let task = info_span!("finish").in_scope(|| finalize::finish(ground, unreachable, generality))?;
    span.record("operators", task.operators.len()).record("variables", task.variables.len());
    Ok((task, reached))
}

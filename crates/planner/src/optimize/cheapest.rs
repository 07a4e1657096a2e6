//! Selects the algorithm that finds a cheapest plan of a task.

use task::plan::solution::{Improvement, Proof, Solution, Status};
use task::task::Task;
use tracing::info_span;

use crate::optimize::branch_and_bound::minimise;
use crate::optimize::config::Config;
use crate::optimize::hidden_steps::{evaluations, with_evaluations, without_hidden_steps};
use crate::optimize::optimizer_run::Run;
use crate::optimize::solve::solve;
use crate::optimize::unbounded_metric::shortest_then_best;

/// Finds a cheapest plan of a task, or the best plan known at a limit. Calls `report` for better plans, for a plan
/// that a search proves cheapest, and if the SAT solver raises the lower bound. If actions can reduce the cost, the
/// result is instead a plan with the fewest steps, and the cheapest of these; `report` is then not called.
///
/// Fluents of the metric with state-dependent changes may be unsupported, e.g. if an action may improve the metric. In
/// this case, only the remaining part of the metric is minimised, the result has no lower bound, and `report` is not
/// called.
///
/// ```
/// use metaplan_planner::{Config, Engine, GroundConfig, Status, ground, optimize};
/// # use metaplan_planner::pddl::{Source, read};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let domain = Source::new("d", "(define (domain d) (:requirements :typing :numeric-fluents) (:types place)
/// #   (:predicates (at ?p - place) (way ?a ?b - place)) (:functions (time) (energy))
/// #   (:action walk :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
/// #     :effect (and (not (at ?a)) (at ?b) (increase (time) 5) (increase (energy) 1)))
/// #   (:action ride :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
/// #     :effect (and (not (at ?a)) (at ?b) (increase (time) 1) (increase (energy) 4))))");
/// # let problem = Source::new("p", "(define (problem p) (:domain d) (:objects a b c - place)
/// #   (:init (at a) (way a b) (way b c) (= (time) 0) (= (energy) 0)) (:goal (at c)) (:metric minimize (time)))");
/// # let (domain, problem, _warnings) = read(&domain, &problem)?;
/// let task = ground(&domain, &problem, &GroundConfig::default())?;
/// let by_search = Config::default().with_engine(Engine::Search);
/// let solution = optimize(&task, &by_search, &mut |better| println!("{} steps", better.horizon));
/// assert_eq!(solution.status, Status::Optimal);
/// assert_eq!(solution.plan.map(|plan| plan.cost.to_string()).as_deref(), Some("2"));
/// # Ok(())
/// # }
/// ```
pub fn optimize(task: &Task, config: &Config, report: &mut dyn FnMut(Improvement)) -> Solution {
    let evaluations = evaluations(task);
    let mut report = |improvement: Improvement| {
        report(Improvement { horizon: improvement.horizon.saturating_sub(evaluations), ..improvement });
    };
    without_hidden_steps(task, best(task, &with_evaluations(task, config), &mut report))
}

/// Like [`optimize`], but evaluations of preferences count as steps.
fn best(task: &Task, config: &Config, report: &mut dyn FnMut(Improvement)) -> Solution {
    if task.objective.rest.is_empty() {
        return cheapest(task, config, report);
    }
    if let Some(solution) = minimise(task, config, report) {
        return solution;
    }
    let mut solution = cheapest(task, config, &mut |_| {});
    // The search considered only the part of the metric that operator costs represent.
    (solution.lower_bound, solution.unbounded) = (None, None);
    solution.statistics.history.clear();
    if matches!(solution.status, Status::Optimal | Status::Feasible) {
        (solution.status, solution.proof, solution.horizon) = (Status::Feasible, None, 0);
    }
    solution
}

fn cheapest(task: &Task, config: &Config, report: &mut dyn FnMut(Improvement)) -> Solution {
    let _span = info_span!("optimize", operators = task.operators.len()).entered();
    let run = Run::new(task, config, report);
    if let Some(reason) = &task.unreachable {
        return run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Relaxation(reason.clone())));
    }
    if task.operators.iter().any(|operator| operator.cost.minimum() < 0) {
        return shortest_then_best(run);
    }
    solve(run)
}

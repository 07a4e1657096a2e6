//! Multiple objectives: lexicographic optimisation, or the Pareto front of two objectives.
//!
//! The optimal value of an objective becomes a budget for later objectives: a numeric variable that each
//! operator reduces by its cost. Each query is thus a task with a single objective and an ordinary proof. The
//! Pareto front is enumerated by the ε-constraint method \[1\]: the best plan by objective A, the best by B
//! among these plans, and then the next plan by A that is strictly better by B.
//!
//! \[1\] Y. Haimes, L. Lasdon, D. Wismer: On a bicriterion formulation of the problems of integrated system
//! identification and system optimization, IEEE Trans. SMC 1(3), 1971.

use task::context::Context;
use task::number::{Int, Rational};
use task::plan::ground::GroundPlan;
use task::plan::solution::{Improvement, Solution, Status};
use task::plan::{Exact, decode};
use task::task::quantity::{Linear, NumericId, Quantity};
use task::task::{NumericEffect, Operator, Task};

use crate::optimize::cheapest::optimize;
use crate::optimize::config::Config;

/// A solution with its values under all objectives: a point of the Pareto front, a lexicographically optimal
/// plan, or the result of a query that did not finish.
#[derive(Debug, Clone)]
pub struct Point {
    /// The solution with its plan. The cost of the plan is its cost under the first objective. Lower bound and
    /// statistics are those of the search for the first objective, but an unchecked claim or a contradiction of a later
    /// search is included. Without a proof for a later objective, there is no proof.
    pub solution: Solution,
    /// Value of the plan under each objective; empty if there is no plan.
    pub values: Vec<Exact>,
}

/// The Pareto front of two objectives, or a part of it.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Front {
    /// Points in the order of the first objective, best first. If no plan is found, a single point without a plan.
    pub points: Vec<Point>,
    /// `Optimal` if the front is proved complete; `Unsolvable` if it is proved that there is no plan; `Feasible` if
    /// there may be further points. If no plan was found for other reasons, the status of the first query.
    pub status: Status,
}

/// Finds a lexicographically optimal plan: optimal under the first objective, among these plans optimal under the
/// second objective, and so on. Also returns its values under all objectives, which are empty if there is no plan. At a
/// limit, returns the best known plan, if there is one, with the status `Feasible`. Each objective has its own search;
/// `report` receives costs and bounds under the objective of the current search.
///
/// ```
/// use metaplan_planner::pddl::{ast::Direction, read_objective};
/// use metaplan_planner::{Config, GroundConfig, ground, lexicographic};
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
/// let objective = |text: &str| read_objective(Direction::Minimize, &Source::new("objective", text), &domain, &problem);
/// let objectives = vec![objective("(time)")?, objective("(energy)")?];
/// let task = ground(&domain, &problem, &GroundConfig::default().with_objectives(objectives))?;
/// let point = lexicographic(&task, &Config::default(), &mut |_| {});
/// assert_eq!(point.values.iter().map(ToString::to_string).collect::<Vec<_>>(), ["2", "8"]);
/// # Ok(())
/// # }
/// ```
pub fn lexicographic(task: &Task, config: &Config, report: &mut dyn FnMut(Improvement)) -> Point {
    let order: Vec<usize> = (0..=task.others.len()).collect();
    in_order(task, &order, &[], config, report)
}

/// Enumerates the Pareto front of the first two objectives until it is complete or a limit is reached. For each pair of
/// values, only one plan is returned. The searches for each point call `report` as [`lexicographic`] does.
///
/// # Panics
/// The task has fewer than two objectives.
///
/// ```
/// use metaplan_planner::pddl::{ast::Direction, read_objective};
/// use metaplan_planner::{Config, GroundConfig, Status, ground, pareto};
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
/// let objective = |text: &str| read_objective(Direction::Minimize, &Source::new("objective", text), &domain, &problem);
/// let objectives = vec![objective("(time)")?, objective("(energy)")?];
/// let task = ground(&domain, &problem, &GroundConfig::default().with_objectives(objectives))?;
/// let front = pareto(&task, &Config::default(), &mut |_| {});
/// assert_eq!((front.status, front.points.len()), (Status::Optimal, 3));
/// # Ok(())
/// # }
/// ```
pub fn pareto(task: &Task, config: &Config, report: &mut dyn FnMut(Improvement)) -> Front {
    let mut points = Vec::new();
    let mut budgets: Vec<(usize, Int)> = Vec::new();
    loop {
        let point = in_order(task, &[0, 1], &budgets, config, report);
        match (point.solution.status, &point.solution.ground) {
            (Status::Optimal, Some(plan)) => {
                let by_second = cost_by(task, 1, plan).and_then(|cost| cost.checked_sub(1));
                points.push(point);
                // A cost that overflows cannot become a budget, so further points may be missed.
                let Some(budget) = by_second else { return Front { points, status: Status::Feasible } };
                budgets = vec![(1, budget)];
            }
            (Status::Unsolvable, _) if points.is_empty() => {
                return Front { points: vec![point], status: Status::Unsolvable };
            }
            (Status::Unsolvable, _) => {
                // An external solver may claim wrongly that there are no further points.
                let is_proved = point.solution.statistics.unchecked.is_none();
                let status = if is_proved { Status::Optimal } else { Status::Feasible };
                return Front { points, status };
            }
            (status, _) => {
                points.extend((point.solution.plan.is_some() || points.is_empty()).then_some(point));
                let status = if points.len() > 1 || points[0].solution.plan.is_some() {
                    Status::Feasible
                } else {
                    status
                };
                return Front { points, status };
            }
        }
    }
}

/// Optimises the objectives in the given order. The cost found for each becomes a budget (maximum cost) for the later
/// ones. Stops at the first objective under which optimality is not proved. `budgets` are initial budgets: pairs of the
/// index of an objective and the maximum cost.
fn in_order(
    task: &Task,
    order: &[usize],
    budgets: &[(usize, Int)],
    config: &Config,
    report: &mut dyn FnMut(Improvement),
) -> Point {
    let context = Context::new(task, &config.limits);
    let mut budgets = budgets.to_vec();
    let mut best: Option<Solution> = None;
    for objective in order {
        let mut narrowed = task.clone();
        for (limited, budget) in &budgets {
            limit(&mut narrowed, *limited, *budget);
        }
        swap_objective(&mut narrowed, *objective);
        let solution = optimize(&narrowed, config, report);
        let Some(plan) = &solution.ground else {
            // The best known plan remains valid, but its optimality under the remaining objectives is not
            // proved.
            let partial = best.map(|solution| Solution { status: Status::Feasible, proof: None, ..solution });
            return finish(context, partial.unwrap_or(solution));
        };
        let spent = cost_by(task, *objective, plan);
        budgets.extend(spent.map(|spent| (*objective, spent)));
        // A cost that overflows cannot become a budget for later objectives.
        let proved = solution.status == Status::Optimal && spent.is_some();
        best = Some(match best {
            None => solution,
            Some(mut first) => {
                let (statistics, later) = (&mut first.statistics, solution.statistics);
                // An unchecked claim of an external solver about any objective must be visible in the proof.
                let proof = if later.unchecked.is_some() { solution.proof } else { first.proof };
                statistics.unchecked = statistics.unchecked.take().or(later.unchecked);
                statistics.contradiction = statistics.contradiction.take().or(later.contradiction);
                Solution {
                    status: if proved { first.status } else { Status::Feasible },
                    proof: proof.filter(|_| proved),
                    plan: solution.plan,
                    ground: solution.ground,
                    ..first
                }
            }
        });
        if !proved {
            break;
        }
    }
    finish(context, best.unwrap_or_else(|| optimize(task, config, report)))
}

fn finish(context: Context<'_>, mut solution: Solution) -> Point {
    let task = context.task;
    let mut values = Vec::new();
    if let Some(plan) = &solution.ground {
        let objectives = std::iter::once(&task.objective).chain(&task.others);
        values.extend(
            objectives
                .enumerate()
                .map(|(position, objective)| objective.metric(&exact_cost_by(task, position, plan))),
        );
        if let Some(cost) = cost_by(task, 0, plan) {
            let plan = GroundPlan { steps: plan.steps.clone(), cost };
            let decoded = decode(context, &plan);
            // Some fluents of a metric are evaluated only in the last state; `decode` includes them.
            values[0] = decoded.cost.clone();
            (solution.plan, solution.ground) = (Some(decoded), Some(plan));
        }
    }
    Point { solution, values }
}

fn cost(operator: &Operator, objective: usize) -> &Quantity<Int> {
    objective.checked_sub(1).map_or(&operator.cost, |other| &operator.others[other])
}

fn costs_by(task: &Task, objective: usize, plan: &GroundPlan) -> impl Iterator<Item = Int> {
    plan.steps.iter().map(move |step| {
        let operator = &task.operators[step.operator.index()];
        cost(operator, objective).at(&step.choice, &operator.sizes())
    })
}

fn cost_by(task: &Task, objective: usize, plan: &GroundPlan) -> Option<Int> {
    costs_by(task, objective, plan).try_fold(0, Int::checked_add)
}

fn exact_cost_by(task: &Task, objective: usize, plan: &GroundPlan) -> Rational {
    costs_by(task, objective, plan).map(Rational::from_integer).sum()
}

/// Limits the cost of plans under an objective to `budget`, by an additional numeric variable.
fn limit(task: &mut Task, objective: usize, budget: Int) {
    let variable = NumericId::of(task.initial.numbers.len());
    task.initial.numbers.push(budget);
    task.number_names.push("the budget of another objective".to_owned());
    let always = task.operators.iter().all(|operator| cost(operator, objective).minimum() >= 0);
    for operator in &mut task.operators {
        let cost = cost(operator, objective).clone();
        if cost.is_zero() {
            continue;
        }
        let mut remaining = Linear::constant(0);
        remaining.quantity = cost;
        let mut remaining = remaining.negated();
        remaining.add(&Linear::variable(variable));
        // With non-negative costs, an exceeded budget stays exceeded, so each step may require that the budget
        // suffices.
        if always {
            operator.condition.comparisons.push(remaining.clone());
        }
        operator.numeric_effects.push(NumericEffect { variable, value: remaining });
    }
    task.goal.comparisons.push(Linear::variable(variable));
}

fn swap_objective(task: &mut Task, objective: usize) {
    let Some(index) = objective.checked_sub(1) else { return };
    std::mem::swap(&mut task.objective, &mut task.others[index]);
    for operator in &mut task.operators {
        std::mem::swap(&mut operator.cost, &mut operator.others[index]);
    }
}

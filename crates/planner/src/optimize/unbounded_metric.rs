//! Treats a metric that may have no best value: minimises the number of steps, and then the metric.

use search::bounds::Bounds;
use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::plan::decode;
use task::plan::ground::{GroundPlan, GroundStep, cost, pass};
use task::plan::solution::{Improvement, MetricUnbounded, Proof, Solution, Status};
use task::task::number::TaskNumber;
use task::task::quantity::Quantity;
use task::task::{Objective, Operator, Task};

use crate::optimize::config::Config;
use crate::optimize::optimizer_run::{Best, Run, StrategyOutcome};
use crate::optimize::prover::within;
use crate::optimize::sat_budget::SatBudget;
use crate::optimize::solve::solve;

/// Minimises the number of steps, and then the metric among the plans with this number of steps. If
/// the minimum number of steps is not proved, the result has no plan.
pub(super) fn shortest_then_best(original: Run<'_>) -> Solution {
    let lowest = original.task.operators.iter().map(|operator| operator.cost.minimum()).min().unwrap_or(0);
    let by_steps = with_costs(original.task, |_| Quantity::constant(1));
    let context = original.context();
    let mut silent = |_: Improvement| {};
    let shortest = solve(Run::new(&by_steps, original.config, &mut silent));
    // Waits count as steps, although they are not part of decoded plans.
    let plan = match (&shortest.ground, shortest.status) {
        (Some(plan), Status::Optimal) => plan.clone(),
        // The plan need not have the fewest steps, and its metric was not minimised, so it is not returned.
        (Some(_), _) => return unknown(shortest),
        (None, _) => return Solution { lower_bound: None, ..shortest },
    };
    let steps = plan.steps.len();
    // Subtracting `lowest` from every cost makes the costs non-negative. This does not change the order of
    // the plans, because all plans within this horizon have the same number of steps.
    let shifted = with_costs(original.task, |operator| {
        let mut cost = operator.cost.clone();
        // Neither the constant of a quantity nor its minimum exceeds `QUANTITY_LIMIT` in magnitude, so the
        // subtraction never saturates.
        cost.constant = cost.constant.saturating_sub(lowest);
        cost
    });
    let config = Config { horizon: Some(steps), ..original.config.clone() };
    let mut run = Run::new(&shifted, &config, &mut silent);
    run.statistics = original.statistics;
    run.statistics.unchecked.clone_from(&shortest.statistics.unchecked);
    let Some(shifted_cost) = cost(&shifted, &plan.steps) else { return unknown(shortest) };
    let mut best = Best { plan: GroundPlan { cost: shifted_cost, ..plan }, lower: 0 };
    let outcome = minimise_within(&mut run, steps, &mut best).unwrap_or(StrategyOutcome::Interrupted);
    let is_proved = matches!(outcome, StrategyOutcome::Exhausted) && run.statistics.unchecked.is_none();
    let proof = is_proved.then_some(Proof::Sat { step_bound: steps });
    let mut plan = best.plan;
    let statistics = run.statistics;
    let Some(by_metric) = cost(original.task, &plan.steps) else { return unknown(shortest) };
    plan.cost = by_metric;
    let unbounded = if can_repeat_reward(context, &plan.steps) {
        MetricUnbounded::Proved
    } else {
        MetricUnbounded::Suspected
    };
    Solution {
        status: Status::Feasible,
        plan: Some(decode(context, &plan)),
        ground: Some(plan),
        lower_bound: None,
        horizon: steps,
        proof,
        unbounded: Some(unbounded),
        statistics,
    }
}

/// Minimises the metric of the plans with at most `steps` steps, beginning with the plan in `best`.
fn minimise_within(run: &mut Run<'_>, steps: usize, best: &mut Best) -> Result<StrategyOutcome, Interrupted> {
    let bounds = Bounds::new(run.context())?;
    let mut extent = run.extent(&bounds, best.plan.below(), best)?;
    extent.allowed.truncate(steps);
    Ok(within(run, &bounds, &extent, best, SatBudget::UNLIMITED))
}

fn unknown(by_steps: Solution) -> Solution {
    Solution { status: Status::Unknown, plan: None, ground: None, lower_bound: None, proof: None, ..by_steps }
}

fn with_costs(task: &Task, cost: impl Fn(&Operator) -> Quantity<Int>) -> Task {
    let mut task = task.clone();
    for operator in &mut task.operators {
        operator.cost = cost(operator);
    }
    task.objective = Objective::sum();
    task
}

/// Returns `true` if an action that improves the metric is applicable in a state of the plan and does not
/// change the state. Such an action can be repeated without bound. At a limit, returns `false`.
pub fn can_repeat_reward<N: TaskNumber>(context: Context<'_, N>, plan: &[GroundStep]) -> bool {
    let Context { task, limits } = context;
    let Some(states) = pass(task, &task.initial, plan) else { return false };
    states.iter().any(|state| {
        task.operators.iter().filter(|operator| operator.cost.minimum() < N::zero()).any(|operator| {
            operator.admitted_combinations().take_while(|_| !limits.reached()).any(|choice| {
                operator.cost.at(&choice, &operator.sizes()) < N::zero()
                    && operator.applicable(state, &choice)
                    && task.successor(operator, state, &choice).as_ref() == Some(state)
            })
        })
    })
}

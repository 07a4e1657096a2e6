//! The bounded reading of a metric that actions improve: fewest steps first, then the metric.

use std::cell::OnceCell;

use crate::bounds::Bounds;
use crate::ground_plan::{GroundStep, cost, pass};
use crate::limits::{Interrupted, Limits};
use crate::number::Int;
use crate::optimize::{Best, Config, Run, Tightened, optimize};
use crate::plan::decode;
use crate::quantity::Quantity;
use crate::solution::{Improvement, Proof, Solution, Status, Unbounded};
use crate::task::Task;
use crate::task_number::TaskNumber;

impl Run<'_> {
    /// For a metric that actions improve: fewest steps first, then the best metric among those plans.
    pub(super) fn bounded_reading(self) -> Solution {
        let lowest = self.task.operators.iter().map(|operator| operator.cost.minimum()).min().unwrap_or(0);
        let by_steps = self.task.with_costs(|_| Quantity::constant(1));
        let mut silent = |_: Improvement| {};
        let shortest = optimize(&by_steps, self.config, &mut silent);
        // Waits are steps, too, which a plan in names does not show.
        let steps = match (&shortest.ground, shortest.status) {
            (Some(plan), Status::Optimal) => plan.steps.len(),
            // The plan that there may be is measured by its steps, not by the metric: of no use to the user.
            (Some(_), _) => return unknown(shortest),
            (None, _) => return Solution { lower_bound: None, ..shortest },
        };
        // Every plan of the task with this horizon has exactly this many steps, so a constant for each step
        // changes nothing but the sign of the costs.
        let shifted = self.task.with_costs(|operator| {
            let mut cost = operator.cost.clone();
            // The numbers of a quantity, and so its least value, stay below `QUANTITY_LIMIT`: nothing is cut off.
            cost.constant = cost.constant.saturating_sub(lowest);
            cost
        });
        let config = Config { horizon: Some(steps), ..self.config.clone() };
        let mut run = Run {
            task: &shifted,
            config: &config,
            report: &mut silent,
            statistics: self.statistics,
            bounds: None,
            symmetry: OnceCell::new(),
        };
        let Ok(bounds) = Bounds::new(&shifted, &self.config.limits) else {
            return unknown(shortest);
        };
        let plan = match run.first_plan(&bounds) {
            Ok(plan) => plan,
            Err(solution) => return *solution,
        };
        let mut best = Best { plan, lower: 0 };
        let tightened = match run.extent(&bounds, best.plan.below(), &best) {
            Ok(mut extent) => {
                extent.allowed.truncate(steps);
                run.within(&bounds, &extent, &mut best, false)
            }
            Err(Interrupted) => Tightened::Interrupted,
        };
        let is_proved = matches!(tightened, Tightened::Exhausted) && run.statistics.unchecked.is_none();
        let proof = is_proved.then_some(Proof::Sat { step_bound: steps });
        let mut plan = best.plan;
        let statistics = run.statistics;
        let Some(by_metric) = cost(self.task, &plan.steps) else { return unknown(shortest) };
        plan.cost = by_metric;
        let unbounded = if self.task.can_repeat_reward(&plan.steps, &self.config.limits) {
            Unbounded::Proved
        } else {
            Unbounded::Suspected
        };
        Solution {
            status: Status::Feasible,
            plan: Some(decode(self.task, &plan, &self.config.limits)),
            ground: Some(plan),
            lower_bound: None,
            horizon: steps,
            proof,
            unbounded: Some(unbounded),
            statistics,
        }
    }
}

/// What is left of an answer by the number of steps where nothing is known by the metric.
fn unknown(by_steps: Solution) -> Solution {
    Solution { status: Status::Unknown, plan: None, ground: None, lower_bound: None, proof: None, ..by_steps }
}

impl Task {
    /// The same task with other costs, and a metric of their plain sum.
    fn with_costs(&self, cost: impl Fn(&crate::task::Operator) -> Quantity<Int>) -> Self {
        let mut task = self.clone();
        for operator in &mut task.operators {
            operator.cost = cost(operator);
        }
        task.objective = crate::task::Objective::sum();
        task
    }
}

#[expect(private_bounds, reason = "nobody else has numbers of tasks")]
impl<N: TaskNumber> Task<N> {
    /// Whether some action that improves the metric is applicable in a state on the way, and leaves it as it is; no if a
    /// limit is reached before one is found.
    pub(crate) fn can_repeat_reward(&self, plan: &[GroundStep], limits: &Limits) -> bool {
        let Some(states) = pass(self, &self.initial, plan) else { return false };
        states.iter().any(|state| {
            self.operators.iter().filter(|operator| operator.cost.minimum() < N::zero()).any(|operator| {
                operator.choices().take_while(|_| !limits.reached()).any(|choice| {
                    operator.cost.at(&choice, &operator.sizes()) < N::zero()
                        && operator.applicable(state, &choice)
                        && self.successor(operator, state, &choice).as_ref() == Some(state)
                })
            })
        })
    }
}

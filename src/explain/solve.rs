//! Computes the best plan for a mission, with all or with some of its designs.

use std::borrow::Cow;

use pddl::ast::{Domain, Problem};
use planner::{Config, Limits, Status, optimize};

use crate::explain::parts::BestPlan;
use crate::mapek::PlannedStep;
use crate::message::Errors;
use crate::mission::{Mission, ground_with};
use crate::number;

/// Computes the best plan for a mission in its current situation, in at most half of the remaining time. At a limit,
/// returns the best plan found until then.
///
/// # Errors
/// The mission cannot be planned for.
pub fn best(mission: &Mission, limits: &Limits) -> Result<BestPlan, Errors> {
    solve(mission, limits, &|problem| mission.allow(problem, &|_| None))
}

/// Computes the best plan for a variant of a mission, in at most half of the remaining time. `vary` changes the filled
/// problem and returns its domain.
pub(super) fn solve<'m>(
    mission: &'m Mission,
    limits: &Limits,
    vary: &dyn Fn(&mut Problem) -> Cow<'m, Domain>,
) -> Result<BestPlan, Errors> {
    if limits.reached() {
        return Ok(BestPlan::default());
    }
    let (mut problem, _) = mission.filled()?;
    let domain = vary(&mut problem);
    // Half of the remaining time is reserved for later queries.
    let limits = &limits.half();
    let task = match ground_with(mission, &domain, &problem, &[], limits) {
        Ok(task) => task,
        Err(_) if limits.reached() => return Ok(BestPlan::default()),
        Err(errors) => return Err(errors),
    };
    let config = Config::default().with_limits(limits.clone());
    let solution = optimize(&task, &config, &mut |_| {});
    let proved = matches!(solution.status, Status::Optimal | Status::Unsolvable);
    let steps = solution.plan.iter().flat_map(|plan| &plan.steps);
    let steps = steps.map(|step| PlannedStep::new(mission, step)).collect();
    Ok(BestPlan { cost: solution.plan.map(|plan| number::of_plan(&plan.cost)), proved, steps })
}

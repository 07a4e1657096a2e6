//! Finds a first plan by SAT: formulas with increasing horizons (numbers of steps).

use std::time::Instant;

use encodings::encode::StepSemantics;
use encodings::sat::Answer;
use search::bounds::Bounds;
use task::plan::ground::GroundPlan;
use task::plan::solution::{Proof, Solution, Status};
use task::task::Task;

use crate::optimize::optimizer_run::Run;
use crate::optimize::sat_budget::{FORMULA_LIMIT, SatBudget};

/// Formulas with increasing horizons and without a cost limit. Several formulas are solved in turns \[1\].
///
/// \[1\] J. Rintanen, K. Heljanko, I. Niemelä: Planning as satisfiability: parallel plans and
/// algorithms for plan search, Artificial Intelligence 170, 2006, section 6.
pub(super) struct HorizonSchedule {
    open: Vec<usize>,
    next: Option<usize>,
    /// Upper bound on the number of steps of a shortest plan, or the configured horizon if it is smaller.
    /// `usize::MAX` if there is neither.
    most: usize,
    refuted: usize,
}

pub(super) enum FirstPlanOutcome {
    Plan(GroundPlan),
    /// There is no plan of any length, or no plan within the configured horizon.
    Refuted(Box<Solution>),
    Paused,
    /// No further formula can be solved, for example because a limit was reached, or the cost of a plan overflows.
    Over,
}

impl HorizonSchedule {
    pub(super) fn new(run: &Run<'_>) -> Self {
        let states = states(run.task).map_or(usize::MAX, |n| n.saturating_sub(1));
        let max_horizon = run.config.horizon.unwrap_or(usize::MAX).min(states);
        Self { open: Vec::new(), next: Some(0), most: max_horizon, refuted: 0 }
    }

    /// Adds the next horizon unless its formula would be too large. Then solves the formulas of all undecided
    /// horizons, each within the budget, until one of them yields a plan.
    pub(super) fn advance(
        &mut self,
        run: &mut Run<'_>,
        bounds: &Bounds,
        allowance: SatBudget,
    ) -> FirstPlanOutcome {
        if let Some(horizon) = self.next.take()
            && horizon.saturating_mul(run.task.operators.len()) <= FORMULA_LIMIT
        {
            self.open.push(horizon);
            let longer = horizon.saturating_add(1).saturating_add(horizon / 4).min(self.most);
            self.next = (horizon < self.most).then_some(longer);
        }
        for horizon in std::mem::take(&mut self.open) {
            match decide(run, bounds, horizon, allowance) {
                (_, Some(plan)) => return FirstPlanOutcome::Plan(plan),
                (Answer::Unsatisfiable, None) => self.refuted = self.refuted.max(horizon),
                // A plan whose cost overflows cannot be used. Other plans are not tried.
                (Answer::Satisfiable, None) => return FirstPlanOutcome::Over,
                (Answer::Interrupted, None) => {
                    // With an unlimited budget, an interruption means that the formula cannot be built, or that an
                    // external solver failed.
                    if run.config.limits.reached() || allowance.conflicts == u64::MAX {
                        return FirstPlanOutcome::Over;
                    }
                    self.open.push(horizon);
                }
            }
        }
        if self.open.is_empty() && self.next.is_none() {
            if self.refuted < self.most {
                return FirstPlanOutcome::Over;
            }
            return FirstPlanOutcome::Refuted(Box::new(self.refuted(run)));
        }
        FirstPlanOutcome::Paused
    }

    fn refuted(&self, run: &Run<'_>) -> Solution {
        let horizon = self.most;
        let bounded = states(run.task).is_some_and(|states| horizon.saturating_add(1) >= states);
        if bounded {
            run.without_plan(Status::Unsolvable, horizon, Some(Proof::Sat { step_bound: horizon }))
        } else {
            run.without_plan(Status::UnsolvableWithinHorizon, horizon, None)
        }
    }
}

/// Finds a first plan without a budget. Without a plan, returns a solution as an error: a proof that there is no plan
/// (within the horizon), or the status `Unknown`.
pub(super) fn first_plan(run: &mut Run<'_>, bounds: &Bounds) -> Result<GroundPlan, Box<Solution>> {
    let mut first = HorizonSchedule::new(run);
    loop {
        match first.advance(run, bounds, SatBudget::UNLIMITED) {
            FirstPlanOutcome::Plan(plan) => return Ok(plan),
            FirstPlanOutcome::Refuted(solution) => return Err(solution),
            FirstPlanOutcome::Paused if first.open.is_empty() => {}
            FirstPlanOutcome::Paused | FirstPlanOutcome::Over => {
                return Err(Box::new(run.without_plan(Status::Unknown, first.refuted, None)));
            }
        }
    }
}

fn decide(
    run: &mut Run<'_>,
    bounds: &Bounds,
    horizon: usize,
    allowance: SatBudget,
) -> (Answer, Option<GroundPlan>) {
    let started = Instant::now();
    let window = bounds.window(run.context(), None, Some(horizon));
    let semantics = run.semantics(StepSemantics::ExistsStep);
    let encoding =
        window.ok().and_then(|window| run.encoding(&window.allowed, None, semantics, allowance.clauses));
    run.statistics.encode = run.statistics.encode.saturating_add(started.elapsed());
    encoding.map_or((Answer::Interrupted, None), |encoding| {
        let mut live = run.live(allowance.conflicts(encoding.formula.clause_count()));
        run.call(&mut live, &encoding, &[])
    })
}

/// Returns the number of states, counting unreachable ones. A shortest plan has fewer steps, because it
/// visits no state twice. Returns `None` if the task has numeric variables or the number overflows.
fn states(task: &Task) -> Option<usize> {
    if !task.initial.numbers.is_empty() {
        return None;
    }
    let sizes = task.variables[..task.basic].iter().map(|variable| variable.values.len());
    sizes.into_iter().try_fold(1_usize, usize::checked_mul)
}

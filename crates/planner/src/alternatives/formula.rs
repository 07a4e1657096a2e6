//! Enumerates further cheapest plans with the SAT solver.
//!
//! The formula describes the plans with at most the optimal cost. The formula has as many steps as such plans can
//! have, but at most the configured horizon. If neither a bound nor a horizon is known, it has as many steps as the
//! first plan. The formula is solved repeatedly; each time, the plans found before are excluded.
//!
//! The choices that all cheapest plans share are the backbone of this formula \[1\]. Candidates are the
//! choices of the first plan. The solver is queried for a plan that differs from the first plan in at least
//! one candidate. If there is such a plan, the candidates in which it differs are removed. If the query is
//! unsatisfiable, all remaining candidates are shared. Interchangeable designs or objects count as different.
//!
//! \[1\] J. Marques-Silva, M. Janota, I. Lynce: On computing backbones of propositional theories, ECAI 2010.

use encodings::encode::{CostEncoding, CostLimit, Encoding, PlanConstraints, StepSemantics, VariableMeaning};
use encodings::sat::{Answer, Backend, Lit, Solver};
use search::bounds::Bounds;
use task::context::Context;
use task::plan::decode;
use task::plan::ground::{GroundPlan, GroundStep, replay};
use task::task::Task;

use crate::alternatives::choices::{Alternatives, Choice, forced, shares};
use crate::optimize::Config;

/// Finds further cheapest plans by solving a formula repeatedly. Returns `None` if the formula cannot be built
/// within the limits.
pub(super) fn by_formula(
    context: Context<'_>,
    bounds: &Bounds,
    first: &GroundPlan,
    max_plans: usize,
    config: &Config,
) -> Option<Alternatives> {
    let task = context.task;
    let window = bounds.window(context, Some(first.cost), config.horizon).ok()?;
    let is_complete = window.steps.is_some_and(|steps| steps <= window.allowed.len());
    // Unsatisfiability reported by an external solver is not verified.
    let complete = is_complete && !matches!(config.backend, Backend::Program { .. });
    let allowed = if is_complete || config.horizon.is_some() {
        window.allowed
    } else {
        bounds.window(context, Some(first.cost), Some(first.steps.len())).ok()?.allowed
    };
    let cost = CostLimit { limit: first.cost, bounds, counting: CostEncoding::Sum };
    let plans = PlanConstraints {
        allowed: &allowed,
        cost: Some(cost),
        semantics: StepSemantics::Sequential,
        max_clauses: usize::MAX,
    };
    let encoding = Encoding::with_equals(context, plans)?;
    let mut solver = config.backend.start(&config.limits, u64::MAX);
    for clause in config.limits.watch(encoding.formula.clauses()) {
        solver.add_clause(clause.ok()?.1);
    }
    let mut run = Run { task, encoding, solver };
    let plan =
        |steps: &[GroundStep]| decode(context, &GroundPlan { steps: steps.to_vec(), cost: first.cost });
    let mut sequences = vec![first.steps.clone()];
    // Plans that differ only in waits are equal for users.
    let mut plans = vec![plan(&first.steps)];
    let mut exhausted = false;
    // Assumption literal that activates the exclusion of the known plans.
    let exclusion = run.encoding.formula.fresh(VariableMeaning::Others);
    while plans.len() <= max_plans && !exhausted {
        if let Some(last_plan) = sequences.last() {
            run.exclude(last_plan, exclusion);
        }
        match run.solve(&[exclusion]) {
            (Answer::Satisfiable, Some(steps)) => {
                let decoded = plan(&steps);
                sequences.push(steps);
                if !plans.contains(&decoded) {
                    plans.push(decoded);
                }
            }
            (Answer::Unsatisfiable, _) => exhausted = true,
            _ => break,
        }
    }
    // If the task has waits (steps that only advance the time), several operators can represent one action, and an
    // action can have different positions in equal plans. So plans cannot be compared step by step.
    let has_waits = task.operators.iter().any(|operator| operator.wait.is_some());
    let choices = if complete && !has_waits { run.forced(&first.steps, &sequences) } else { None };
    let forced = choices.map(|choices| forced(task, &first.steps, &choices));
    plans.remove(0);
    Some(Alternatives { plans, complete: complete && exhausted, forced })
}

struct Run<'a> {
    task: &'a Task,
    encoding: Encoding<'a>,
    solver: Box<dyn Solver>,
}

impl Run<'_> {
    fn exclude(&mut self, plan: &[GroundStep], literal: Lit) {
        let mut clause = self.encoding.blocking_clause(plan);
        clause.push(!literal);
        self.solver.add_clause(&clause);
    }

    fn solve(&mut self, assumptions: &[Lit]) -> (Answer, Option<Vec<GroundStep>>) {
        let answer = self.solver.solve(assumptions);
        if answer != Answer::Satisfiable {
            return (answer, None);
        }
        let steps = self.encoding.decode(self.solver.as_ref());
        let is_plan = replay(self.task, &steps).is_some();
        debug_assert!(is_plan, "the encoding admits a sequence that is not a plan");
        (answer, is_plan.then_some(steps))
    }

    /// Returns the choices of the first plan that all cheapest plans share. Returns `None` if a query has no
    /// result, for example at a limit. The plans in `known` reduce the candidates before the first query.
    fn forced(&mut self, first: &[GroundStep], known: &[Vec<GroundStep>]) -> Option<Vec<Choice>> {
        let mut choices = Choice::all(first);
        for plan in known {
            choices.retain(|choice| self.shares(first, plan, *choice));
        }
        while !choices.is_empty() {
            let selector = self.encoding.formula.fresh(VariableMeaning::Others);
            let differs =
                choices.iter().map(|choice| !self.encoding.choice(first, (choice.step, choice.slot)));
            let clause: Vec<_> = differs.chain([!selector]).collect();
            self.solver.add_clause(&clause);
            match self.solve(&[selector]) {
                (Answer::Satisfiable, Some(plan)) => {
                    choices.retain(|choice| self.shares(first, &plan, *choice));
                }
                (Answer::Unsatisfiable, _) => break,
                _ => return None,
            }
        }
        Some(choices)
    }

    fn shares(&self, first: &[GroundStep], plan: &[GroundStep], choice: Choice) -> bool {
        plan.get(choice.step).is_some_and(|other| shares(self.task, &first[choice.step], other, choice.slot))
    }
}

//! State of one optimizer run: SAT queries, the best known plan, bounds, and the resulting solution.

use std::cell::OnceCell;
use std::time::Instant;

use encodings::encode::{CostLimit, Encoding, PlanConstraints, StepSemantics, Symmetry};
use encodings::sat::{Answer, Backend, Lit, Solver};
use search::bounds::Bounds;
use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::plan::ground::{GroundPlan, GroundStep, cost, pass};
use task::plan::solution::{Improvement, Moment, Proof, Solution, Statistics, Status};
use task::plan::{decode, metric};
use task::task::Task;
use tracing::field::{Empty, debug};
use tracing::info_span;

use crate::optimize::config::Config;

/// A rise of the lower bound is recorded if it is more than 1/`REPORT_STEP` of the bound recorded last, or if
/// the bound reaches the cost of the best plan.
const REPORT_STEP: Int = 100;

pub(super) struct Run<'a> {
    pub(super) task: &'a Task,
    pub(super) config: &'a Config,
    pub(super) report: &'a mut dyn FnMut(Improvement),
    pub(super) statistics: Statistics,
    started: Instant,
    noted: Option<(Option<Int>, Int)>,
    symmetry: OnceCell<Symmetry>,
}

pub(super) struct Best {
    pub(super) plan: GroundPlan,
    pub(super) lower: Int,
}

/// Plans that a formula covers: their maximum cost, and the operators that are allowed at each step.
pub(super) struct FormulaScope {
    pub(super) limit: Int,
    pub(super) allowed: Vec<Vec<bool>>,
    /// Proved upper bound on the number of steps of all plans within the cost limit. `None` if no bound is proved
    /// or the formula has fewer steps.
    pub(super) step_bound: Option<usize>,
}

impl FormulaScope {
    pub(super) fn size(&self) -> usize {
        self.allowed.iter().map(|row| row.iter().filter(|flag| **flag).count()).sum()
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum StrategyOutcome {
    /// The formula has no plan that is within its cost limit and cheaper than the best known plan.
    Exhausted,
    Interrupted,
}

pub(super) struct IncrementalSolver {
    pub(super) solver: Box<dyn Solver>,
    known: usize,
    /// Number of conflicts that have been added to the statistics.
    conflicts: u64,
}

impl<'a> Run<'a> {
    pub(super) fn new(task: &'a Task, config: &'a Config, report: &'a mut dyn FnMut(Improvement)) -> Self {
        let statistics = Statistics { operators: task.operators.len(), ..Statistics::default() };
        Self {
            task,
            config,
            report,
            statistics,
            started: Instant::now(),
            noted: None,
            symmetry: OnceCell::new(),
        }
    }

    pub(super) fn context(&self) -> Context<'a> {
        Context::new(self.task, &self.config.limits)
    }

    /// Records a contradiction between the results of two components of the planner. Panics in debug builds,
    /// because it is a bug.
    pub(super) fn report_internal_contradiction(&mut self, what: &str) {
        debug_assert!(false, "{what}");
        self.statistics.contradiction = Some(what.to_owned());
    }

    /// Adds the cost of the best plan and the lower bound to the history if the cost has changed, or if the bound has
    /// risen enough (see [`REPORT_STEP`]) or to the cost.
    pub(super) fn note(&mut self, cost: Option<Int>, lower: Int) {
        let is_news = self.noted.is_none_or(|(previous, bound)| {
            let rise = lower.saturating_sub(bound);
            previous != cost || rise > bound / REPORT_STEP || rise > 0 && cost == Some(lower)
        });
        if !is_news {
            return;
        }
        self.noted = Some((cost, lower));
        self.statistics.history.push(Moment {
            time: self.started.elapsed(),
            cost: cost.map(|cost| metric(self.task, &cost)),
            lower_bound: metric(self.task, &lower),
        });
    }

    pub(super) fn announce(&mut self, best: &Best, horizon: usize) {
        self.note(Some(best.plan.cost), best.lower);
        let improvement = Improvement {
            cost: metric(self.task, &best.plan.cost),
            lower_bound: metric(self.task, &best.lower),
            horizon,
        };
        (self.report)(improvement);
    }

    /// Returns the step semantics of formulas. With a horizon, they are sequential; otherwise, the configured
    /// semantics takes precedence over `unless_given`.
    pub(super) fn semantics(&self, unless_given: StepSemantics) -> StepSemantics {
        match self.config.horizon {
            Some(_) => StepSemantics::Sequential,
            None => self.config.semantics.unwrap_or(unless_given),
        }
    }

    /// Encodes the task as a formula. Returns `None` if the formula cannot be built within the limits, for example
    /// with at most `max_clauses` clauses.
    pub(super) fn encoding(
        &self,
        allowed: &[Vec<bool>],
        cost: Option<CostLimit<'_>>,
        semantics: StepSemantics,
        max_clauses: usize,
    ) -> Option<Encoding<'a>> {
        let span = info_span!("encode", steps = allowed.len(), variables = Empty, clauses = Empty).entered();
        let plans = PlanConstraints { allowed, cost, semantics, max_clauses };
        let encoding = Encoding::new(self.context(), plans, &self.symmetry)?;
        let formula = &encoding.formula;
        span.record("variables", formula.variables()).record("clauses", formula.clause_count());
        Some(encoding)
    }

    /// Returns the scope of a formula for plans with a cost of at most `limit`. The number of steps of the formula
    /// is the proved step bound, but at most the configured horizon. Without a step bound, the formula has as many
    /// steps as the horizon or, without a horizon, about twice as many as the best plan.
    pub(super) fn extent(
        &self,
        bounds: &Bounds,
        limit: Int,
        best: &Best,
    ) -> Result<FormulaScope, Interrupted> {
        let window = bounds.window(self.context(), Some(limit), self.config.horizon)?;
        let complete = |steps: &usize| *steps <= window.allowed.len();
        let step_bound = window.steps.filter(complete);
        let allowed = if window.steps.is_some() {
            window.allowed
        } else {
            // Without a step bound, a longer formula can find plans, but not prove optimality.
            let longer = self
                .config
                .horizon
                .unwrap_or_else(|| best.plan.steps.len().saturating_mul(2).saturating_add(4));
            bounds.window(self.context(), Some(limit), Some(longer))?.allowed
        };
        Ok(FormulaScope { limit, allowed, step_bound })
    }

    pub(super) fn live(&self, budget: u64) -> IncrementalSolver {
        IncrementalSolver {
            solver: self.config.backend.start(&self.config.limits, budget),
            known: 0,
            conflicts: 0,
        }
    }

    /// Adds the missing clauses of a formula to a solver, and solves it under assumptions. If the
    /// formula is satisfiable, also returns the decoded plan, unless it is not executable or its
    /// cost overflows.
    pub(super) fn call(
        &mut self,
        live: &mut IncrementalSolver,
        encoding: &Encoding<'_>,
        assumptions: &[Lit],
    ) -> (Answer, Option<GroundPlan>) {
        let started = Instant::now();
        let formula = &encoding.formula;
        let span = info_span!("solve", clauses = formula.clause_count(), conflicts = Empty, answer = Empty)
            .entered();
        for item in self.config.limits.watch(formula.clauses_from(live.known)) {
            let Ok((_, clause)) = item else { return (Answer::Interrupted, None) };
            live.solver.add_clause(clause);
        }
        live.known = formula.clause_count();
        if formula.variables() >= self.statistics.variables {
            self.statistics.variables = formula.variables();
            self.statistics.clauses = formula.clause_count();
            self.statistics.families = formula.counts();
        }
        let answer = live.solver.solve(assumptions);
        let conflicts = live.solver.conflicts();
        let new_conflicts = conflicts.saturating_sub(live.conflicts);
        self.statistics.calls = self.statistics.calls.saturating_add(1);
        self.statistics.conflicts = self.statistics.conflicts.saturating_add(new_conflicts);
        live.conflicts = conflicts;
        span.record("conflicts", new_conflicts).record("answer", debug(answer));
        if let Some(reason) = live.solver.failure() {
            self.statistics.failure = Some(reason.to_owned());
        }
        // A model of an external program is verified by executing the plan. The program's claim of unsatisfiability
        // is not verified.
        if let (Answer::Unsatisfiable, Backend::Program { command, arguments }) =
            (answer, &self.config.backend)
        {
            let words: Vec<&str> = std::iter::once(command).chain(arguments).map(String::as_str).collect();
            self.statistics.unchecked = Some(words.join(" "));
        }
        self.statistics.solve = self.statistics.solve.saturating_add(started.elapsed());
        let plan = if answer == Answer::Satisfiable {
            self.check(encoding.decode(live.solver.as_ref()))
        } else {
            None
        };
        (answer, plan)
    }

    /// Returns the plan of decoded steps. The formula should admit only plans; this check detects errors of the
    /// encoding. Returns `None` if the plan is not executable or its cost overflows.
    fn check(&mut self, steps: Vec<GroundStep>) -> Option<GroundPlan> {
        if pass(self.task, &self.task.initial, &steps).is_none() {
            self.report_internal_contradiction("a formula admits a sequence of actions that is not a plan");
            return None;
        }
        // A plan whose cost overflows cannot be compared with other plans.
        cost(self.task, &steps).map(|cost| GroundPlan { steps, cost })
    }

    /// Returns the solution of the run. After an internal contradiction, the solution claims no proof and no lower
    /// bound.
    pub(super) fn finish(
        self,
        status: Status,
        plan: Option<&GroundPlan>,
        lower: Option<Int>,
        horizon: usize,
        proof: Option<Proof>,
    ) -> Solution {
        let context = self.context();
        let doubtful = self.statistics.contradiction.is_some();
        let status = match status {
            Status::Optimal if doubtful => Status::Feasible,
            Status::Unsolvable if doubtful => Status::Unknown,
            other => other,
        };
        let (lower, proof) = if doubtful { (None, None) } else { (lower, proof) };
        let mut statistics = self.statistics;
        if matches!(proof, Some(Proof::Bound | Proof::Search | Proof::Relaxation(_))) {
            statistics.unchecked = None;
        }
        Solution {
            status,
            plan: plan.map(|plan| decode(context, plan)),
            ground: plan.cloned(),
            lower_bound: lower.map(|lower| metric(self.task, &lower)),
            horizon,
            proof,
            unbounded: None,
            statistics,
        }
    }

    pub(super) fn without_plan(&self, status: Status, horizon: usize, proof: Option<Proof>) -> Solution {
        Solution {
            status,
            plan: None,
            ground: None,
            lower_bound: None,
            horizon,
            proof,
            unbounded: None,
            statistics: self.statistics.clone(),
        }
    }
}

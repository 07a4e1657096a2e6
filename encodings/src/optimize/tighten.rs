//! Cheaper and cheaper plans from one solver, until there is none.

use std::time::Instant;

use crate::encode::Encoding;
use crate::ground_plan::{GroundPlan, GroundStep, cost, pass};
use crate::optimize::{Best, Run, Tightened};
use crate::sat::{Answer, Backend, Lit, Solver};

/// A solver that has the clauses of a formula, up to some position.
pub(super) struct Live {
    pub(super) solver: Box<dyn Solver>,
    known: usize,
    conflicts: u64,
}

impl Run<'_> {
    /// A solver without clauses that gives up at a limit, or after learning `budget` clauses.
    pub(super) fn live(&self, budget: u64) -> Live {
        Live { solver: self.config.backend.start(&self.config.limits, budget), known: 0, conflicts: 0 }
    }

    /// Decides a formula under assumptions, by a solver that may know a part of it; a plan comes with the answer that it is
    /// satisfiable.
    pub(super) fn call(
        &mut self,
        live: &mut Live,
        encoding: &Encoding<'_>,
        assumptions: &[Lit],
    ) -> (Answer, Option<GroundPlan>) {
        let started = Instant::now();
        let formula = &encoding.formula;
        for item in self.config.limits.watch(formula.clauses_from(live.known)) {
            let Ok((_, clause)) = item else { return (Answer::Interrupted, None) };
            live.solver.add_clause(clause);
        }
        live.known = formula.len();
        if formula.variables() >= self.statistics.variables {
            self.statistics.variables = formula.variables();
            self.statistics.clauses = formula.len();
            self.statistics.families = formula.counts();
        }
        let answer = live.solver.solve(assumptions);
        let conflicts = live.solver.conflicts();
        let more = conflicts.saturating_sub(live.conflicts);
        self.statistics.calls = self.statistics.calls.saturating_add(1);
        self.statistics.conflicts = self.statistics.conflicts.saturating_add(more);
        live.conflicts = conflicts;
        if let Some(reason) = live.solver.failure() {
            self.statistics.failure = Some(reason.to_owned());
        }
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

    /// A plan of the solver, replayed. That it is applicable is what the encoding is for; that it is, is checked.
    fn check(&mut self, steps: Vec<GroundStep>) -> Option<GroundPlan> {
        if pass(self.task, &self.task.initial, &steps).is_none() {
            self.contradicted("a formula admits a sequence of actions that is not a plan");
            return None;
        }
        // A plan whose cost does not fit is none that the rest can reckon with.
        cost(self.task, &steps).map(|cost| GroundPlan { steps, cost })
    }

    /// Asks for cheaper and cheaper plans of a formula until there is none. The solver keeps what it has learnt: a lower limit is
    /// one more clause. It gives up after learning `budget` clauses.
    pub(super) fn tighten(&mut self, mut encoding: Encoding<'_>, best: &mut Best, budget: u64) -> Tightened {
        let mut live = self.live(budget);
        loop {
            let better = match self.call(&mut live, &encoding, &[]) {
                (Answer::Unsatisfiable, _) => return Tightened::Exhausted,
                (_, None) => return Tightened::Interrupted,
                (_, Some(better)) => better,
            };
            best.plan = better;
            self.announce(best, encoding.horizon());
            encoding.tighten(best.plan.below());
        }
    }
}

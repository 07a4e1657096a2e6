//! `BatSat` \[1\] back end, a port of `MiniSat` \[2\] to Rust. Callbacks count learnt clauses and
//! stop the solver at a limit.
//!
//! \[1\] S. Cruanes, M. Hara: `BatSat`, <https://github.com/c-cube/batsat>.
//! \[2\] N. Eén, N. Sörensson: An extensible SAT-solver, SAT 2003.

use std::cell::Cell;

use batsat::{Callbacks, ClauseKind, SolverInterface as _, lbool};
use task::limits::Limits;

use crate::sat::solver::{Answer, Lit, Solver};

/// Number of decisions of the solver between two checks of the limits.
const CLOCK_INTERVAL: u32 = 64;

pub(super) struct Batsat {
    solver: batsat::Solver<Watch>,
    buffer: Vec<batsat::Lit>,
    core: Vec<Lit>,
}

struct Watch {
    limits: Limits,
    budget: u64,
    conflicts: u64,
    decisions: Cell<u32>,
    stopped: Cell<bool>,
}

impl Callbacks for Watch {
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    fn on_new_clause(&mut self, _: &[batsat::Lit], kind: ClauseKind) {
        self.conflicts += u64::from(kind == ClauseKind::Learnt);
    }

    fn stop(&self) -> bool {
        let decisions = self.decisions.get().wrapping_add(1);
        self.decisions.set(decisions);
        // Reading the clock at every decision would slow the solver down.
        if self.conflicts > self.budget || (decisions % CLOCK_INTERVAL == 1 && self.limits.reached()) {
            self.stopped.set(true);
        }
        self.stopped.get()
    }
}

impl Batsat {
    pub(super) fn new(limits: &Limits, budget: u64) -> Self {
        let watch = Watch {
            limits: limits.clone(),
            budget,
            conflicts: 0,
            decisions: Cell::new(0),
            stopped: Cell::new(false),
        };
        let solver = batsat::Solver::new(batsat::SolverOpts::default(), watch);
        Self { solver, buffer: Vec::new(), core: Vec::new() }
    }

    fn translate(&mut self, literals: &[Lit]) {
        self.buffer.clear();
        for literal in literals {
            let variable = self.solver.var_of_int(literal.variable());
            self.buffer.push(batsat::Lit::new(variable, literal.is_positive()));
        }
    }
}

impl Solver for Batsat {
    fn add_clause(&mut self, clause: &[Lit]) {
        self.translate(clause);
        // The result is ignored, because `solve` reports a contradiction as well.
        let _ = self.solver.add_clause_reuse(&mut self.buffer);
    }

    fn solve(&mut self, assumptions: &[Lit]) -> Answer {
        self.translate(assumptions);
        self.core.clear();
        let answer = self.solver.solve_limited(&self.buffer);
        if answer == lbool::TRUE {
            Answer::Satisfiable
        } else if answer == lbool::FALSE {
            // The reported core is a clause of negated assumptions.
            let core = self.solver.unsat_core().iter();
            self.core.extend(core.map(|literal| Lit::new(literal.var().idx(), !literal.sign())));
            Answer::Unsatisfiable
        } else {
            Answer::Interrupted
        }
    }

    fn core(&self) -> &[Lit] {
        &self.core
    }

    fn value(&self, variable: u32) -> bool {
        self.solver.get_model().get(variable as usize).is_some_and(|value| *value == lbool::TRUE)
    }

    fn conflicts(&self) -> u64 {
        self.solver.cb().conflicts
    }
}

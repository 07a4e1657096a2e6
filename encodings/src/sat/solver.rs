//! Literals, answers, and the trait that all SAT solvers implement.

/// A literal: a variable or its negation. Variables are numbered from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Lit(u32);

impl Lit {
    /// The positive literal of variable 0, which every formula fixes to true.
    pub(crate) const TRUE: Self = Self(0);

    pub(crate) fn positive(variable: u32) -> Self {
        Self(variable << 1)
    }

    pub fn new(variable: u32, positive: bool) -> Self {
        if positive { Self::positive(variable) } else { !Self::positive(variable) }
    }

    pub(crate) fn variable(self) -> u32 {
        self.0 >> 1
    }

    /// Returns a dense index of the literal, from 0. The two literals of a variable have adjacent
    /// indices.
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }

    pub(crate) fn is_positive(self) -> bool {
        self.0 & 1 == 0
    }

    /// Converts to a DIMACS literal: variables are numbered from 1, and negation is the sign.
    ///
    /// # Panics
    /// The variable has a number of 2^31 − 1 or more.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "fewer than 2^31 - 1 variables are held in memory with their clauses"
    )]
    pub fn dimacs(self) -> i32 {
        let number = i32::try_from(self.variable()).expect("invariant: fewer than 2^31 variables") + 1;
        if self.is_positive() { number } else { -number }
    }
}

impl std::ops::Not for Lit {
    type Output = Self;

    fn not(self) -> Self {
        Self(self.0 ^ 1)
    }
}

/// Answer of a solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    Satisfiable,
    Unsatisfiable,
    /// The deadline, an interruption or the conflict budget stopped the solver, or an external program
    /// failed; the solver should not be used again.
    Interrupted,
}

/// An incremental SAT solver.
pub trait Solver {
    /// Adds a clause. Variables need no declaration.
    fn add_clause(&mut self, clause: &[Lit]);
    /// Decides whether all added clauses are satisfiable together with the assumptions. The
    /// assumptions apply to this call only.
    fn solve(&mut self, assumptions: &[Lit]) -> Answer;
    /// Returns the failed assumptions of the last call, if its answer was `Unsatisfiable`. They are a subset
    /// of the assumptions that is inconsistent with the clauses, unordered and not necessarily minimal. If a
    /// built-in solver finds that the clauses alone are unsatisfiable, the subset is empty; external programs
    /// always return all assumptions.
    fn core(&self) -> &[Lit];
    /// Returns the value of a variable in the assignment that the last call of `solve` has found; `false` if the
    /// variable has no value in it. Meaningful only if that call answered `Satisfiable`.
    fn value(&self, variable: u32) -> bool;
    /// Returns the number of learnt clauses over all calls, one per conflict; 0 if the solver does
    /// not report them.
    fn conflicts(&self) -> u64;
    /// Returns the reason for an interruption that was not caused by a limit, e.g. a crash of an
    /// external solver. `None` if there was no such interruption.
    fn failure(&self) -> Option<&str> {
        None
    }
}

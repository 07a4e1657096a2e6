//! Common part of all solvers: literals, answers, and the trait.

/// A literal: a variable, counted from 0, or its negation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Lit(u32);

impl Lit {
    /// The first variable, which formulas fix to true.
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

    /// Dense index of the literal, from 0.
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }

    pub(crate) fn is_positive(self) -> bool {
        self.0 & 1 == 0
    }

    /// DIMACS literal: variables count from 1, negation is the sign.
    ///
    /// # Panics
    /// From 2^31 variables.
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
    /// A limit was reached; the solver must not be used again.
    Interrupted,
}

/// An incremental SAT solver.
pub trait Solver {
    /// Adds a clause; its variables need no declaration.
    fn add_clause(&mut self, clause: &[Lit]);
    /// Decides all added clauses together with the assumptions, which hold for this call only.
    fn solve(&mut self, assumptions: &[Lit]) -> Answer;
    /// Failed assumptions of the last call, if its answer was `Unsatisfiable`: a subset of the
    /// assumptions that is inconsistent with the clauses, unordered and not necessarily minimal.
    /// Empty if the clauses alone are unsatisfiable.
    fn core(&self) -> &[Lit];
    /// Value of a variable in the last assignment.
    fn value(&self, variable: u32) -> bool;
    /// Number of learnt clauses, one per conflict; 0 if the solver does not report it.
    fn conflicts(&self) -> u64;
    /// Reason of an interruption that was not caused by a limit.
    fn failure(&self) -> Option<&str> {
        None
    }
}

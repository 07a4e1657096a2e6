//! Conflict budgets of the SAT solver.

/// In a formula with so many clauses a conflict takes twice as long as in a small one, about.
const LARGE: usize = 50_000;

/// What the SAT solver may spend on a formula.
#[derive(Debug, Clone, Copy)]
pub(super) struct SatBudget {
    pub(super) clauses: usize,
    /// In a formula that is not large.
    pub(super) conflicts: u64,
}

impl SatBudget {
    /// So many conflicts: each takes longer in a large formula.
    pub(super) fn conflicts(self, clauses: usize) -> u64 {
        let factor = (clauses / LARGE).saturating_add(1);
        if self.conflicts == u64::MAX {
            return u64::MAX;
        }
        self.conflicts.checked_div(factor as u64).unwrap_or(self.conflicts)
    }

    /// As much as it takes.
    pub(super) const UNLIMITED: Self = Self { clauses: usize::MAX, conflicts: u64::MAX };
}

/// Formulas with more operator variables than this are not built.
pub(super) const FORMULA_LIMIT: usize = 30_000_000;

//! Budgets of the SAT solver.

/// Number of clauses above which conflicts become noticeably slower.
const LARGE: usize = 50_000;

#[derive(Debug, Clone, Copy)]
pub(super) struct SatBudget {
    pub(super) clauses: usize,
    /// Maximum number of conflicts for a formula with fewer than [`LARGE`] clauses; `u64::MAX` for
    /// no limit.
    pub(super) conflicts: u64,
}

impl SatBudget {
    pub(super) fn conflicts(self, clauses: usize) -> u64 {
        let factor = (clauses / LARGE).saturating_add(1);
        if self.conflicts == u64::MAX {
            return u64::MAX;
        }
        self.conflicts.checked_div(factor as u64).unwrap_or(self.conflicts)
    }

    pub(super) const UNLIMITED: Self = Self { clauses: usize::MAX, conflicts: u64::MAX };
}

pub(super) const FORMULA_LIMIT: usize = 30_000_000;

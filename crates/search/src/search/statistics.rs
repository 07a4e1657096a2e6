//! Statistics of a heuristic search.

use task::plan::solution::Statistics;

/// Counters of a heuristic search.
#[derive(Debug, Clone, Copy, Default)]
pub struct SearchStatistics {
    /// Number of expanded states.
    pub expanded: u64,
    /// Number of generated states.
    pub generated: u64,
    /// Number of evaluated states.
    pub evaluated: u64,
}

impl SearchStatistics {
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            expanded: self.expanded.saturating_add(other.expanded),
            generated: self.generated.saturating_add(other.generated),
            evaluated: self.evaluated.saturating_add(other.evaluated),
        }
    }

    /// Adds the increase since the earlier counters `before` to the statistics of the planner.
    pub fn add_to(self, before: Self, statistics: &mut Statistics) {
        let add =
            |sum: &mut u64, now: u64, before: u64| *sum = sum.saturating_add(now.saturating_sub(before));
        add(&mut statistics.expanded, self.expanded, before.expanded);
        add(&mut statistics.generated, self.generated, before.generated);
        add(&mut statistics.evaluated, self.evaluated, before.evaluated);
    }
}

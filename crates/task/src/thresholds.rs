//! Task sizes at which parts of a search begin.

/// Sizes at which parts of the search begin that small tasks do without. Answers do not depend on them: tests lower them, so that small
/// tasks, of which the answer is known by brute force, reach every pruning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Thresholds {
    /// Number of stored states without a plan after which A\* is joined by a greedy search, and then by stubborn sets, the exchange of
    /// objects and landmarks, where nothing else takes turns with it. `Config::head_start` of the planner is the number for
    /// the planner as a whole.
    pub states: usize,
    /// Number of stored states at which A\* first compares its progress with the memory that there is.
    pub progress: usize,
    /// Work, in steps of a computer, after which the search that is behind the other one gets half as much.
    pub behind: u64,
    /// Number of states after which stubborn sets are given up if they leave out too little.
    pub stubborn: u64,
    /// Number of evaluated states after which the satisficing search looks for pairs of facts.
    pub pairs: u64,
    /// Number of labels that are not dominated above which a front is a tree, and above which a leaf of that tree is split.
    pub front: usize,
    /// Number of labels at which the graph of all cheapest plans is first searched for enough plans.
    pub alternatives: usize,
    /// Number of situations after which the greedy search and the search for sequential plans take turns with the exact search, where
    /// actions overlap.
    pub concurrent: usize,
    /// Length of the first turn of the greedy search, in situations; those of the other searches are in proportion.
    pub turn: usize,
    /// Number of sequences after which the exhaustive search takes turns with others, where durations are chosen, and the length of the
    /// first turn.
    pub chosen: u64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            states: 20_000,
            progress: 200_000,
            behind: 6_000_000_000,
            stubborn: 1_000,
            pairs: 3_000,
            front: 24,
            alternatives: 50_000,
            concurrent: 10_000,
            turn: 5_000,
            chosen: 300,
        }
    }
}

impl Thresholds {
    /// Everything begins at once, and stubborn sets are never given up.
    pub const NONE: Self = Self {
        states: 0,
        progress: 0,
        behind: 0,
        stubborn: u64::MAX,
        pairs: 0,
        front: 0,
        alternatives: 0,
        concurrent: 0,
        turn: 0,
        chosen: 0,
    };
}

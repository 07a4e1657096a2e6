//! Task sizes at which parts of a search begin.

/// Sizes from which optional parts of the search are active. Answers do not depend on them. Tests
/// lower them, so that small tasks, whose answers are known by brute force, reach every pruning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Thresholds {
    /// Number of stored states without a plan after which A\* is joined by a greedy search, and
    /// then by stubborn sets, object symmetries and landmarks, if no other component takes turns
    /// with it. `Config::head_start` of the planner is the corresponding number for the planner as
    /// a whole.
    pub states: usize,
    /// Number of stored states at which A\* first compares its progress with the available memory.
    pub progress: usize,
    /// Work, in work units, after which the lagging search gets half of its share.
    pub behind: u64,
    /// Number of states after which stubborn sets are disabled if they prune too little.
    pub stubborn: u64,
    /// Number of evaluated states after which the satisficing search computes h² mutexes.
    pub pairs: u64,
    /// Number of non-dominated labels above which a front is stored as a tree, and above which a
    /// leaf of this tree is split.
    pub front: usize,
    /// Number of labels at which the graph of all optimal plans is first searched for alternatives.
    pub alternatives: usize,
    /// Number of nodes after which the greedy search and the search for sequential plans take turns
    /// with the exact temporal search.
    pub concurrent: usize,
    /// Length of the first turn of the greedy search in nodes; turns of the other searches are
    /// proportional.
    pub turn: usize,
    /// Number of sequences after which the exhaustive search with chosen durations takes turns with
    /// others, and length of its first turn.
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
    /// All parts are active from the start, and stubborn sets are never disabled.
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

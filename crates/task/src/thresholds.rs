//! Thresholds at which optional parts of a search are switched on or off.

/// Thresholds at which optional parts of a search are switched on or off: numbers of states, nodes or labels, or
/// amounts of work. They affect the running time, not the correctness of the answers. Tests use other thresholds
/// ([`Thresholds::NONE`]), so that small tasks, whose answers are known by brute force, exercise every pruning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Thresholds {
    /// Number of states that A\* stores before further components support it: LM-cut, stubborn sets, object symmetries
    /// and, if no plan is known, a greedy search that may store equally many states. Applies only if no satisficing
    /// search or SAT solver alternates with A\*. For the whole planner, `Config::head_start` has the corresponding
    /// role.
    pub states: usize,
    /// Number of stored states at which A\* first estimates whether its memory will suffice.
    pub progress: usize,
    /// Number of work units after which, of two alternating A\* searches, a search whose lower bound lags behind gets
    /// only half of its share.
    pub behind: u64,
    /// Number of work units of each alternating A\* search after which abstractions are computed for online cost
    /// partitioning.
    pub partitioning: u64,
    /// Number of states after which stubborn sets are disabled if they have pruned too little.
    pub stubborn: u64,
    /// Number of evaluated states after which the satisficing search computes h² mutexes.
    pub pairs: u64,
    /// Number of non-dominated labels above which a Pareto front is stored as a tree. Also the limit on the
    /// number of labels in a leaf of this tree.
    pub front: usize,
    /// Number of labels after which the graph of all optimal plans is first searched for alternative plans.
    pub alternatives: usize,
    /// Work of the exact temporal search, about the number of its expanded and generated nodes, after which
    /// incomplete searches alternate with it.
    pub concurrent: usize,
    /// Maximum number of bits of the temporal unit (common denominator of all times) with which times are 128-bit
    /// integers. With a larger unit, or if 128 bits do not suffice, times are wider integers. The maximum does not
    /// apply if the planner chooses durations.
    pub narrow_times: u64,
    /// Number of successors that the greedy temporal search generates in its first turn. Its later turns, and the turns
    /// of the searches with which it alternates, are multiples of this number.
    pub turn: usize,
    /// Number of sequences (partial plans) that the exhaustive search with chosen durations evaluates before
    /// other searches alternate with it.
    pub chosen: u64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            states: 20_000,
            progress: 200_000,
            behind: 6_000_000_000,
            partitioning: 200_000_000,
            stubborn: 1_000,
            pairs: 3_000,
            front: 24,
            alternatives: 50_000,
            concurrent: 10_000,
            narrow_times: u64::MAX,
            turn: 5_000,
            chosen: 300,
        }
    }
}

impl Thresholds {
    /// Thresholds with which all optional parts of the search are used from the start, times are the wider integers
    /// (unless the planner chooses durations), and stubborn sets are never disabled.
    pub const NONE: Self = Self {
        states: 0,
        progress: 0,
        behind: 0,
        partitioning: 0,
        stubborn: u64::MAX,
        pairs: 0,
        front: 0,
        alternatives: 0,
        concurrent: 0,
        narrow_times: 0,
        turn: 0,
        chosen: 0,
    };
}

//! Reasons why a solution has no certificate.

use ::task::task::{Operator, Task};
use search::search::{NoLabels, STATE_LIMIT};

pub(super) const MAX_DENOMINATOR_BITS: u64 = 1 << 20;

/// Reason why a solution has no certificate.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoCertificate {
    /// The solution is neither proved optimal nor proved unsolvable.
    #[error("nothing is proved for plans of any length")]
    Unproved,
    /// The task has several objectives.
    #[error("certificates support a single objective")]
    SeveralObjectives,
    /// Fluents of the metric change by amounts that depend on the state.
    #[error("the metric reads {fluents}, which actions change by amounts that depend on the state")]
    StateDependentMetric {
        /// The fluents in PDDL.
        fluents: String,
    },
    /// An action has a negative cost.
    #[error("`{action}` can improve the metric")]
    Improvement {
        /// Name of the action.
        action: String,
    },
    /// An effect multiplies a number by a fraction. The values of the number then have no common denominator, or
    /// numbers have different scales.
    #[error("{action} multiplies a number by a fraction")]
    Fraction {
        /// The action, as the message names it.
        action: String,
    },
    /// The common denominator of the numbers has too many bits.
    #[error("the common denominator of the numbers has more than {bits} bits", bits = MAX_DENOMINATOR_BITS)]
    Denominator,
    /// A limit on time or memory was reached, or the run was interrupted.
    #[error("a limit was reached before the states of the argument were collected")]
    Limit,
    /// The argument would need too many states.
    #[error("the argument needs more than {states} states", states = STATE_LIMIT)]
    States,
    /// The actions have too many combinations of designs.
    #[error("the actions have too many combinations of designs")]
    Combinations,
    /// The search that collects the states of the argument has proved nothing.
    #[error(
        "the search that collects the states of the argument has proved nothing; the reason is not known exactly; \
         candidates: too little memory, or a number that became too large"
    )]
    Inconclusive,
}

impl From<NoLabels> for NoCertificate {
    fn from(reason: NoLabels) -> Self {
        match reason {
            NoLabels::Limit => Self::Limit,
            NoLabels::States => Self::States,
            NoLabels::Combinations => Self::Combinations,
            NoLabels::Inconclusive => Self::Inconclusive,
        }
    }
}

pub(super) fn action_name<N>(task: &Task<N>, operator: &Operator<N>) -> String {
    task.schema_names.get(operator.schema as usize).cloned().unwrap_or_default()
}

//! What can be wrong with derivations.

use crate::rule::RuleIdentity;

/// Why derivations are not accepted: the first thing that is wrong. Facts are given as text.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// A rule negates, or aggregates over, what depends on its own conclusion.
    #[error("the rules are not stratified at rule {0}")]
    Unstratified(RuleIdentity),
    /// A step does not follow from those before it.
    #[error("step {step}, {fact}: {reason}")]
    Step {
        /// Its position, counted from 0.
        step: usize,
        /// What it concludes.
        fact: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Something is stated, and no step says so.
    #[error("{0} is stated, and missing")]
    MissingStatement(String),
    /// A rule concludes something that no step says.
    #[error("{fact} follows by rule {rule}, and is missing")]
    MissingConclusion {
        /// What follows.
        fact: String,
        /// By which rule.
        rule: RuleIdentity,
    },
    /// Names that may be one are compared by a rule, not by what is known to differ.
    #[error("a rule asks whether names differ that may be one")]
    Difference,
    /// A rule, or an aggregate in it, has more matches than are gone through.
    #[error("rule {0} has too many matches")]
    TooMany(RuleIdentity),
    /// The facts contradict each other.
    #[error("the knowledge is inconsistent: {0}")]
    Inconsistent(String),
}

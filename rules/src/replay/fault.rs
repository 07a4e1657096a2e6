//! Faults of derivations.

use crate::rule::RuleIdentity;

/// Reason for which a derivation is rejected: its first fault. Facts are given as text.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The rules are not stratified: a rule negates or aggregates a relation that depends on its own conclusion.
    /// The reported rule is such a rule, or its body depends on one.
    #[error("the rules are not stratified at rule {0}")]
    Unstratified(RuleIdentity),
    /// A step does not follow from earlier steps.
    #[error("step {step}, {fact}: {reason}")]
    Step {
        /// Position of the step, counted from 0.
        step: usize,
        /// Fact of the step.
        fact: String,
        /// Description of the fault.
        reason: String,
    },
    /// A stated fact has no step.
    #[error("{0} is stated, but missing")]
    MissingStatement(String),
    /// A conclusion of a rule has no step.
    #[error("{fact} follows by rule {rule}, but is missing")]
    MissingConclusion {
        /// Missing fact.
        fact: String,
        /// Rule that derives it.
        rule: RuleIdentity,
    },
    /// A rule tests whether two names differ, although they may be equal.
    #[error("a rule tests whether names differ that may denote one individual")]
    Difference,
    /// A rule, or an aggregate in it, has too many matches to enumerate.
    #[error("rule {0} has too many matches")]
    TooMany(RuleIdentity),
    /// The facts are contradictory. The text is a fact with a contradiction, or the violated integrity constraint.
    #[error("the knowledge is inconsistent: {0}")]
    Inconsistent(String),
}

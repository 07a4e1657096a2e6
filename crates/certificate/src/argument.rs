//! The JSON format of an argument, i.e. of the optimality proof in a certificate.

use crate::integer::Integer;
use serde::{Deserialize, Serialize};

/// Required value of the field [`Argument::format`].
pub const ARGUMENT_FORMAT: &str = "metaplan-argument/1";

/// A proof that no plan is cheaper than the claimed cost or, without a claimed cost, that there is no plan. All costs
/// and numbers are in the integer units of the task.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Argument {
    /// [`ARGUMENT_FORMAT`].
    pub format: String,
    /// Lower bounds on the remaining cost of states (admissible heuristics).
    pub potentials: Vec<Potential>,
    /// Lower bounds on the value that a numeric variable must have so that the goal can be reached.
    pub needs: Vec<Need>,
    /// The labels: states with the cost of reaching them. They cover (dominate) each reachable
    /// state that costs less than the claim, unless a potential or a need prunes the state. No
    /// label is a goal state that costs less than the claim. Without a claim, these statements hold
    /// regardless of costs.
    pub labels: Vec<Label>,
}

/// A lower bound on the remaining cost of a state, as a function of the values of a few variables
/// (a pattern).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Potential {
    /// The variables of the pattern, as indices in the task.
    pub pattern: Vec<u32>,
    /// The bound in cost units for each combination of values; the last variable varies fastest.
    /// `null` means that no goal state is reachable.
    pub values: Vec<Option<Integer>>,
}

/// A lower bound on the value that a numeric variable must have so that the goal can be reached. It
/// is a function of the values of a few variables (a pattern).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Need {
    /// The numeric variable, as an index in the task.
    pub number: u32,
    /// The variables of the pattern, as in [`Potential::pattern`].
    pub pattern: Vec<u32>,
    /// The bound for each combination of values, ordered as in [`Potential::values`]. 0 means that the number is
    /// not restricted, and `null` that no goal state is reachable.
    pub values: Vec<Option<Integer>>,
}

/// A state without its derived variables, and the cost of reaching the state: (values, numbers, cost).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label(pub Vec<u32>, pub Vec<Integer>, pub Integer);

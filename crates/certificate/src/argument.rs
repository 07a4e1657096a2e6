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
    /// Lower bounds on the value that a numeric variable needs for reaching the goal.
    pub needs: Vec<Need>,
    /// States that cover (dominate) every reachable state with a cost below the claim that no
    /// potential or need prunes. None of these labels is a goal state with a smaller cost than
    /// claimed.
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

/// A lower bound on the value of a numeric variable that is needed to reach the goal, as a function
/// of a few variables.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Need {
    /// The numeric variable, as an index in the task.
    pub number: u32,
    /// The variables of the pattern, as in [`Potential::pattern`].
    pub pattern: Vec<u32>,
    /// The bound for each combination of values; ordered as in [`Potential::values`]. `null` means
    /// that no goal state is reachable.
    pub values: Vec<Option<Integer>>,
}

/// A reached state without its derived variables, and the cost of reaching the state: (values,
/// numbers, cost).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label(pub Vec<u32>, pub Vec<Integer>, pub Integer);

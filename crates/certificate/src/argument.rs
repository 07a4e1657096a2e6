//! The argument (optimality proof) of a certificate: its JSON format.

use crate::integer::Integer;
use serde::{Deserialize, Serialize};

/// Value of [`Argument::format`].
pub const ARGUMENT_FORMAT: &str = "metaplan-argument/1";

/// A proof that no plan is cheaper than the claim. All costs and numbers are in the integer units
/// of the task.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Argument {
    /// [`ARGUMENT_FORMAT`].
    pub format: String,
    /// Lower bounds on the remaining cost (admissible heuristics).
    pub potentials: Vec<Potential>,
    /// Lower bounds on the resources that a state needs to reach the goal.
    pub needs: Vec<Need>,
    /// States that cover the reachable states with a cost below the claim. None of them is a goal
    /// state with a smaller cost than claimed.
    pub labels: Vec<Label>,
}

/// A lower bound on the remaining cost, as a function of a few variables (a pattern).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Potential {
    /// The variables, by position in the task.
    pub pattern: Vec<u32>,
    /// For each combination of values, the last variable varying fastest, the bound in cost
    /// units; `null` if no goal state is reachable.
    pub values: Vec<Option<Integer>>,
}

/// A lower bound on the required value of a numeric variable, as a function of a few variables.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Need {
    /// The numeric variable, by position in the task.
    pub number: u32,
    /// The variables of the pattern, as in [`Potential::pattern`].
    pub pattern: Vec<u32>,
    /// For each combination of values the bound, as in [`Potential::values`].
    pub values: Vec<Option<Integer>>,
}

/// A reached state without its derived variables, and the cost of reaching it: (values, numbers,
/// cost).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label(pub Vec<u32>, pub Vec<Integer>, pub Integer);

//! The argument of a certificate as it is written.

use crate::integer::Integer;
use serde::{Deserialize, Serialize};

/// The format of an argument.
pub const ARGUMENT_FORMAT: &str = "metaplan-argument/1";

/// Why no plan is cheaper. All costs and numbers are in the units of the task.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Argument {
    /// [`ARGUMENT_FORMAT`].
    pub format: String,
    /// Lower bounds on what is still to be paid.
    pub potentials: Vec<Potential>,
    /// Lower bounds on what must be left of numbers.
    pub needs: Vec<Need>,
    /// The states that a cheaper plan would have to pass; none of them is a goal state that is cheaper than claimed.
    pub labels: Vec<Label>,
}

/// A lower bound on what is still to be paid, by the values of a few variables.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Potential {
    /// The variables, by position in the task.
    pub pattern: Vec<u32>,
    /// For each combination of values, the last variable varying fastest; null where no goal state is within reach.
    pub values: Vec<Option<Integer>>,
}

/// A lower bound on what must be left of a number, by the values of a few variables.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Need {
    /// The number, by position in the task.
    pub number: u32,
    /// As in [`Potential::pattern`].
    pub pattern: Vec<u32>,
    /// As in [`Potential::values`].
    pub values: Vec<Option<Integer>>,
}

/// A state, derived variables left out, and what was paid on the way to it: values, numbers, costs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label(pub Vec<u32>, pub Vec<Integer>, pub Integer);

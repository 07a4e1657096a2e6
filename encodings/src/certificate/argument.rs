//! The argument of a certificate as it is written.

use crate::certificate::integer::Integer;
use serde::{Deserialize, Serialize};

/// Why no plan is cheaper.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Argument {
    pub(super) format: String,
    pub(super) potentials: Vec<Potential>,
    pub(super) needs: Vec<Need>,
    pub(super) labels: Vec<Label>,
}

/// A lower bound on what is still to be paid, by the values of a few variables.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Potential {
    pub(super) pattern: Vec<u32>,
    /// For each combination of values, the last variable varying fastest; null where no goal state is within reach.
    pub(super) values: Vec<Option<Integer>>,
}

/// A lower bound on what must be left of a number, by the values of a few variables.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Need {
    pub(super) number: u32,
    pub(super) pattern: Vec<u32>,
    /// As in [`Potential::values`].
    pub(super) values: Vec<Option<Integer>>,
}

/// A state, derived variables left out, and what was paid on the way to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Label(pub(super) Vec<u32>, pub(super) Vec<Integer>, pub(super) Integer);

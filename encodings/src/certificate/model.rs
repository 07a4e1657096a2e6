//! A ground task as a certificate writes it: plain lists of numbers.

use crate::certificate::integer::Integer;
use serde::{Deserialize, Serialize};

/// A variable, counted from 0, and one of its values.
pub(super) type Fact = (u32, u32);

/// A ground task. What many operators have in common is listed once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Model {
    pub(super) format: String,
    pub(super) objects: Vec<String>,
    pub(super) schemas: Vec<String>,
    /// The values of each finite-domain variable; the last value of a variable holds where none of its atoms does.
    pub(super) variables: Vec<Vec<String>>,
    /// The variables from here on are derived.
    pub(super) basic: usize,
    pub(super) values: Vec<u32>,
    pub(super) numbers: Vec<Integer>,
    /// The numeric fluents that they are, and how many times their values.
    pub(super) fluents: Vec<String>,
    pub(super) number_scale: Integer,
    /// The designs that may fill each slot, as objects.
    pub(super) slots: Vec<Vec<u32>>,
    /// Lists of slots that operators fill, each with the designs that suit.
    pub(super) uses: Vec<Vec<(u32, Vec<u32>)>>,
    pub(super) exclusions: Vec<Vec<Exclusion>>,
    pub(super) tables: Vec<Vec<Integer>>,
    pub(super) operators: Vec<Operator>,
    /// In the order of evaluation.
    pub(super) axioms: Vec<Layer>,
    pub(super) goal: Condition,
    pub(super) objective: Objective,
    /// Durations are this many times the values of the files.
    pub(super) time_scale: Integer,
}

/// Combinations of designs (positions in lists of suitable designs) that are not admitted for some slots of an operator.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Exclusion {
    pub(super) slots: Vec<u32>,
    pub(super) combinations: Vec<Vec<u32>>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Operator {
    pub(super) schema: u32,
    pub(super) arguments: Vec<Argument>,
    /// Positions in `Model::uses` and `Model::exclusions`.
    pub(super) uses: u32,
    pub(super) exclusions: u32,
    pub(super) condition: Condition,
    pub(super) effects: Vec<Fact>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) conditional: Vec<Conditional>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) changes: Vec<(u32, Linear)>,
    pub(super) cost: Quantity,
    pub(super) duration: Quantity,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) wait: Option<Integer>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Argument {
    Object(u32),
    Slot(u32),
}

/// All facts, one literal of every clause, and every comparison ≥ 0.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Condition {
    pub(super) facts: Vec<Fact>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) clauses: Vec<Vec<Literal>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) comparisons: Vec<Linear>,
}

/// A fact, and whether it or its negation is meant.
pub(super) type Literal = (Fact, bool);

/// Effects under a condition; later ones prevail over earlier ones.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Conditional {
    pub(super) condition: Vec<Literal>,
    pub(super) effects: Vec<Fact>,
}

/// A constant plus tables over slots of the operator, by position in `Model::tables`, the last slot varying fastest.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Quantity {
    pub(super) constant: Integer,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) tables: Vec<(Vec<u32>, u32)>,
}

/// Numbers times factors, plus a quantity.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Linear {
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) factors: Vec<(u32, Integer)>,
    pub(super) quantity: Quantity,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Layer {
    /// The fact that holds where the body does.
    pub(super) rules: Vec<(Fact, Condition)>,
    pub(super) recursive: bool,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Objective {
    /// Costs are this many times the metric,
    pub(super) scale: Integer,
    /// which has this added (in costs),
    pub(super) offset: Integer,
    /// and the opposite sign if it is maximized.
    pub(super) maximize: bool,
}

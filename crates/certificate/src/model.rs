//! The JSON format of a ground task in a certificate: plain lists of numbers.

use crate::integer::Integer;
use serde::{Deserialize, Serialize};

/// Value of [`Model::format`].
pub const TASK_FORMAT: &str = "metaplan-task/1";

/// A variable, counted from 0, and one of its values.
pub type Fact = (u32, u32);

/// A ground task. Parts that many operators share are listed once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// The constant [`TASK_FORMAT`].
    pub format: String,
    /// The objects of the problem; other parts refer to them by position.
    pub objects: Vec<String>,
    /// The names of the actions.
    pub schemas: Vec<String>,
    /// The values of each finite-domain variable; the last value means that no atom of the
    /// variable holds.
    pub variables: Vec<Vec<String>>,
    /// Number of basic variables; all later variables are derived.
    pub basic: usize,
    /// The initial value of each variable.
    pub values: Vec<u32>,
    /// The initial value of each number.
    pub numbers: Vec<Integer>,
    /// The numeric fluent of each number.
    pub fluents: Vec<String>,
    /// Numbers are this many times the values of the files.
    pub number_scale: Integer,
    /// The designs that may fill each slot, as objects.
    pub slots: Vec<Vec<u32>>,
    /// Lists of slots that operators fill, each with its suitable designs.
    pub uses: Vec<Vec<(u32, Vec<u32>)>>,
    /// Lists of excluded combinations of designs.
    pub exclusions: Vec<Vec<Exclusion>>,
    /// Values by designs; quantities refer to them.
    pub tables: Vec<Vec<Integer>>,
    /// All operators.
    pub operators: Vec<Operator>,
    /// The axiom layers in the order of evaluation.
    pub axioms: Vec<Layer>,
    /// The goal condition.
    pub goal: Condition,
    /// The relation of costs to the metric.
    pub objective: Objective,
    /// Durations are this many times the values of the files.
    pub time_scale: Integer,
}

/// Combinations of designs (positions in lists of suitable designs) that are excluded for some
/// slots of an operator.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exclusion {
    /// Positions in the list of slots of the operator.
    pub slots: Vec<u32>,
    /// For each slot a position in its list of suitable designs.
    pub combinations: Vec<Vec<u32>>,
}

/// A ground operator, parameterised by the designs in its slots.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Operator {
    /// Position in [`Model::schemas`]; the position after the last one is a wait.
    pub schema: u32,
    /// One argument for each parameter of the action.
    pub arguments: Vec<Argument>,
    /// Position in [`Model::uses`].
    pub uses: u32,
    /// Position in [`Model::exclusions`].
    pub exclusions: u32,
    /// The precondition.
    pub condition: Condition,
    /// The unconditional effects; later effects override earlier ones.
    pub effects: Vec<Fact>,
    /// The conditional effects.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub conditional: Vec<Conditional>,
    /// New values of numbers, in terms of the numbers before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<(u32, Linear)>,
    /// The cost.
    pub cost: Quantity,
    /// The duration, scaled by [`Model::time_scale`].
    pub duration: Quantity,
    /// For a wait, the time at which it ends, from the start of the plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wait: Option<Integer>,
}

/// An argument of an action.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Argument {
    /// An object, by position.
    Object(u32),
    /// The design that fills a slot of the operator, by position.
    Slot(u32),
}

/// A conjunction of facts, clauses, and comparisons with 0.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// The facts; all must hold.
    pub facts: Vec<Fact>,
    /// The clauses; of each, one literal must hold.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clauses: Vec<Vec<Literal>>,
    /// Linear expressions that must be at least 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<Linear>,
}

/// A fact and its required truth value.
pub type Literal = (Fact, bool);

/// Effects under a condition; later effects override earlier ones.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditional {
    /// The literals that must hold before.
    pub condition: Vec<Literal>,
    /// The effects, later ones overriding earlier ones.
    pub effects: Vec<Fact>,
}

/// A constant plus tables over slots of the operator, by position in [`Model::tables`], the last
/// slot varying fastest.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// The part that does not depend on designs.
    pub constant: Integer,
    /// Slots, by position, and the table over them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<(Vec<u32>, u32)>,
}

/// A linear expression over numbers, plus a quantity.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Linear {
    /// Numbers, by position, and their factors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub factors: Vec<(u32, Integer)>,
    /// The added quantity.
    pub quantity: Quantity,
}

/// Rules of derived variables that are evaluated together.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// The rules: head and body.
    pub rules: Vec<(Fact, Condition)>,
    /// `true` if the rules of the layer may depend on each other.
    pub recursive: bool,
}

/// The relation of costs to the metric of the files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Objective {
    /// Costs are this many times the metric.
    pub scale: Integer,
    /// The constant part of the metric, in costs.
    pub offset: Integer,
    /// `true` if the metric is maximised; costs then have the opposite sign.
    pub maximize: bool,
}

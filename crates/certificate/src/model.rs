//! A ground task as a certificate writes it: plain lists of numbers.

use crate::integer::Integer;
use serde::{Deserialize, Serialize};

/// The format of a task.
pub const TASK_FORMAT: &str = "metaplan-task/1";

/// A variable, counted from 0, and one of its values.
pub type Fact = (u32, u32);

/// A ground task. What many operators have in common is listed once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// [`TASK_FORMAT`].
    pub format: String,
    /// The objects of the problem; other parts refer to them by position.
    pub objects: Vec<String>,
    /// The names of the actions.
    pub schemas: Vec<String>,
    /// The values of each finite-domain variable; the last value of a variable holds where none of its atoms does.
    pub variables: Vec<Vec<String>>,
    /// The variables from here on are derived.
    pub basic: usize,
    /// The value of each variable at first.
    pub values: Vec<u32>,
    /// What each number is at first.
    pub numbers: Vec<Integer>,
    /// The numeric fluents that they are, and how many times their values.
    pub fluents: Vec<String>,
    /// So many times the values of the files are numbers.
    pub number_scale: Integer,
    /// The designs that may fill each slot, as objects.
    pub slots: Vec<Vec<u32>>,
    /// Lists of slots that operators fill, each with the designs that suit.
    pub uses: Vec<Vec<(u32, Vec<u32>)>>,
    /// Lists of combinations of designs that operators do not admit.
    pub exclusions: Vec<Vec<Exclusion>>,
    /// Values by designs; quantities refer to them.
    pub tables: Vec<Vec<Integer>>,
    /// Everything that a step of a plan can do.
    pub operators: Vec<Operator>,
    /// In the order of evaluation.
    pub axioms: Vec<Layer>,
    /// What holds in the end.
    pub goal: Condition,
    /// What costs are in terms of the metric.
    pub objective: Objective,
    /// Durations are this many times the values of the files.
    pub time_scale: Integer,
}

/// Combinations of designs (positions in lists of suitable designs) that are not admitted for some slots of an operator.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exclusion {
    /// Positions in the list of slots of the operator.
    pub slots: Vec<u32>,
    /// For each slot a position in its list of suitable designs.
    pub combinations: Vec<Vec<u32>>,
}

/// A step that a plan can have, whatever the designs that it runs with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Operator {
    /// Position in [`Model::schemas`]; one after the last is a wait.
    pub schema: u32,
    /// One for each parameter of the action.
    pub arguments: Vec<Argument>,
    /// Positions in `Model::uses` and `Model::exclusions`.
    pub uses: u32,
    /// Position in [`Model::exclusions`].
    pub exclusions: u32,
    /// What has to hold before.
    pub condition: Condition,
    /// What holds after, later ones prevailing.
    pub effects: Vec<Fact>,
    /// What holds after, if something holds before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub conditional: Vec<Conditional>,
    /// What numbers become, in terms of the numbers before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<(u32, Linear)>,
    /// What is paid.
    pub cost: Quantity,
    /// How long it takes.
    pub duration: Quantity,
    /// If it is a wait: until when, from the start of the plan.
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

/// All facts, one literal of every clause, and every comparison ≥ 0.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// All of them hold.
    pub facts: Vec<Fact>,
    /// Of each, one holds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clauses: Vec<Vec<Literal>>,
    /// Each is at least 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<Linear>,
}

/// A fact, and whether it or its negation is meant.
pub type Literal = (Fact, bool);

/// Effects under a condition; later ones prevail over earlier ones.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditional {
    /// All of them hold before.
    pub condition: Vec<Literal>,
    /// What holds after, later ones prevailing.
    pub effects: Vec<Fact>,
}

/// A constant plus tables over slots of the operator, by position in `Model::tables`, the last slot varying fastest.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// What does not depend on designs.
    pub constant: Integer,
    /// Slots, by position, and the table over them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<(Vec<u32>, u32)>,
}

/// Numbers times factors, plus a quantity.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Linear {
    /// Numbers, by position, and their factors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub factors: Vec<(u32, Integer)>,
    /// What is added.
    pub quantity: Quantity,
}

/// Rules of derived variables that are evaluated together.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// The fact that holds where the body does.
    pub rules: Vec<(Fact, Condition)>,
    /// Whether the rules of the layer may depend on each other.
    pub recursive: bool,
}

/// How costs relate to the metric of the files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Objective {
    /// Costs are this many times the metric,
    pub scale: Integer,
    /// which has this added (in costs),
    pub offset: Integer,
    /// and the opposite sign if it is maximized.
    pub maximize: bool,
}

//! The JSON format of a ground task in a certificate. References between its parts are indices.

use crate::integer::Integer;
use serde::{Deserialize, Serialize};

/// Required value of the field [`Model::format`].
pub const TASK_FORMAT: &str = "metaplan-task/1";

/// A fact: the index of a variable and one of its values.
pub type Fact = (u32, u32);

/// A ground task. Lists that many operators share are stored once, and operators refer to them by
/// index.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// The format identifier, [`TASK_FORMAT`].
    pub format: String,
    /// The names of the objects of the problem; other parts refer to them by index.
    pub objects: Vec<String>,
    /// The names of the action schemas.
    pub schemas: Vec<String>,
    /// The values of each finite-domain variable, as texts of atoms. The last value means that no
    /// atom of the variable holds.
    pub variables: Vec<Vec<String>>,
    /// Number of basic variables, which come first; all later variables are derived.
    pub basic: usize,
    /// The initial value of each variable, as an index into its values. [`crate::check()`] ignores the values of
    /// derived variables, because they follow from the rules.
    pub values: Vec<u32>,
    /// The initial value of each number (numeric variable), scaled by `number_scale`.
    pub numbers: Vec<Integer>,
    /// The text of the numeric fluent that each number represents.
    pub fluents: Vec<String>,
    /// Factor by which numbers in the task are greater than in the PDDL files; it makes them
    /// integers.
    pub number_scale: Integer,
    /// The designs that can be chosen for each slot (parameter that is a design), as indices of
    /// objects.
    pub slots: Vec<Vec<u32>>,
    /// Lists of slots that operators fill. Each entry is a slot with its suitable designs, as
    /// positions in the slot's list of designs.
    pub uses: Vec<Vec<(u32, Vec<u32>)>>,
    /// Lists of excluded combinations of designs; operators refer to these lists.
    pub exclusions: Vec<Vec<Exclusion>>,
    /// Tables of values that depend on designs; quantities refer to these tables.
    pub tables: Vec<Vec<Integer>>,
    /// The operators, including waits.
    pub operators: Vec<Operator>,
    /// The axiom layers in the order of evaluation.
    pub axioms: Vec<Layer>,
    /// The goal condition.
    pub goal: Condition,
    /// The conversion between costs and the metric.
    pub objective: Objective,
    /// Factor by which durations in the task are greater than in the PDDL files; it makes them
    /// integers.
    pub time_scale: Integer,
}

/// Combinations of designs that are excluded for some slots of an operator.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exclusion {
    /// The concerned slots, as positions in the operator's list of slots ([`Model::uses`]).
    pub slots: Vec<u32>,
    /// The excluded combinations. Each contains, for each concerned slot, a position in its list of
    /// suitable designs.
    pub combinations: Vec<Vec<u32>>,
}

/// A ground operator whose cost, duration and numeric parts depend on the designs chosen for its
/// slots.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Operator {
    /// Index of the action schema in [`Model::schemas`]; the index after the last schema denotes a
    /// wait.
    pub schema: u32,
    /// An argument for each parameter of the action schema.
    pub arguments: Vec<Argument>,
    /// Index of the operator's list of slots in [`Model::uses`].
    pub uses: u32,
    /// Index of the operator's list of exclusions in [`Model::exclusions`].
    pub exclusions: u32,
    /// The precondition.
    pub condition: Condition,
    /// The unconditional effects; later effects override earlier ones.
    pub effects: Vec<Fact>,
    /// The conditional effects.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub conditional: Vec<Conditional>,
    /// The new values of changed numbers, in terms of the numbers before the operator: (index of
    /// the number, value).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<(u32, Linear)>,
    /// The cost that the operator adds, scaled by [`Objective::scale`].
    pub cost: Quantity,
    /// The duration, scaled by [`Model::time_scale`].
    pub duration: Quantity,
    /// For a wait operator, the time at which the wait ends, measured from the start of the plan
    /// and scaled by [`Model::time_scale`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wait: Option<Integer>,
}

/// An argument of an operator.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Argument {
    /// An object, as an index into [`Model::objects`].
    Object(u32),
    /// The design chosen for a slot, given by the position of the slot in the operator's list of
    /// slots.
    Slot(u32),
}

/// A conjunction of facts, clauses, and numeric comparisons with 0.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// The facts, all of which must hold.
    pub facts: Vec<Fact>,
    /// The clauses (disjunctions); at least one literal of each must hold.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clauses: Vec<Vec<Literal>>,
    /// Linear expressions that must be at least 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<Linear>,
}

/// A fact with its required truth value.
pub type Literal = (Fact, bool);

/// A conditional effect of an operator. Later effects override earlier ones.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditional {
    /// The literals that must hold in the state before the operator.
    pub condition: Vec<Literal>,
    /// The assigned values; later ones override earlier ones.
    pub effects: Vec<Fact>,
}

/// A constant plus entries of tables. The designs chosen for the slots of an operator select the
/// entry of each table; the last slot varies fastest.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// The summand that does not depend on designs.
    pub constant: Integer,
    /// For each table, the slots that select the entry (positions in the operator's list of slots),
    /// and the index in [`Model::tables`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<(Vec<u32>, u32)>,
}

/// A linear expression over numbers, plus a quantity that depends on designs.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Linear {
    /// The summands: index of a number, and its factor.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub factors: Vec<(u32, Integer)>,
    /// The added constant and design-dependent part.
    pub quantity: Quantity,
}

/// An axiom layer: rules of derived variables that are evaluated together, to the least fixpoint.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// The rules: the derived fact (head), and the condition (body).
    pub rules: Vec<(Fact, Condition)>,
    /// Whether the rules of the layer may depend on each other.
    pub recursive: bool,
}

/// The conversion between costs of the task and the metric of the PDDL files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Objective {
    /// Factor by which costs are greater than the metric; it makes them integers.
    pub scale: Integer,
    /// Constant that is added to the sum of the operator costs, in cost units: the value of the metric in
    /// the initial state, negated if the metric is maximised.
    pub offset: Integer,
    /// Whether the metric is maximised; costs then have the opposite sign.
    pub maximize: bool,
}

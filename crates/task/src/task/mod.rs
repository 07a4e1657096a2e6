//! The ground task: variables, operators, states, and quantities over slots.

pub mod common_denominator;
mod dense_ids;
mod ground;
pub mod number;
pub mod object_symmetry;
pub mod quantity;
pub mod table_map;
pub mod timing;

pub use ground::{
    Argument, Axiom, Condition, ConditionalEffect, ForbiddenCombinations, Layer, Literal, NumericEffect,
    Operator, Slot, SlotUse, State, Variable,
};
pub use ground::{Fact, Objective, OperatorId, SlotId, Task, VariableId};
pub use quantity::NumericId;

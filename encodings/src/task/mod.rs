//! The ground task and its parts: variables, operators and states; quantities over slots, and the numbers in them.

pub(crate) mod common_denominator;
mod dense_ids;
pub(crate) mod exchange;
mod ground;
pub(crate) mod number;
pub(crate) mod quantity;
pub(crate) mod table_map;
pub(crate) mod timing;

pub(crate) use ground::{
    Argument, Axiom, Condition, ConditionalEffect, Forbidden, Layer, Literal, NumericEffect, Operator, Slot,
    SlotUse, State, Variable,
};
pub use ground::{Fact, Objective, OperatorId, SlotId, Task, VariableId};
pub(crate) use quantity::NumericId;

//! Operators over atoms, with open design slots.

use std::sync::Arc;

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::condition::{GroundCondition, GroundLiteral};
use crate::ground::vocabulary::numbers::Numbers;
use crate::lifted::{ObjectId, Rational};
use crate::task::quantity::Quantity;
use crate::task::timing::Timing;
use crate::task::{Argument, ForbiddenCombinations};

/// The function and the designs that suit an operator, for each slot.
pub type GroundSlots = [(ObjectId, Vec<ObjectId>)];

/// An operator over atoms, with exact rationals.
#[derive(Debug, Clone)]
pub struct GroundOperator {
    pub(crate) schema: u32,
    pub(crate) arguments: Vec<Argument>,
    pub(crate) slots: Arc<GroundSlots>,
    pub(crate) forbidden: Arc<[ForbiddenCombinations]>,
    /// Each function that the action requires, with the argument that is its design.
    pub(crate) configuration: Vec<(ObjectId, Argument)>,
    pub(crate) condition: GroundCondition,
    pub(crate) adds: Vec<AtomId>,
    pub(crate) deletes: Vec<AtomId>,
    /// After `adds` and `deletes`, those of one entry at once, deletes first.
    pub(crate) conditional: Vec<GroundConditional>,
    pub(crate) numeric_effects: Numbers,
    /// By objective.
    pub(crate) costs: Vec<Quantity<Rational>>,
    pub(crate) duration: Quantity<Rational>,
    /// Set if this is not an action but a wait until that time.
    pub(crate) wait: Option<Rational>,
    /// Each time with whether a moment later is meant, until all durations are known.
    pub(crate) timing: Timing<(Rational, bool)>,
}

/// Atoms that change if a conjunction holds before the operator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroundConditional {
    pub(crate) condition: Vec<GroundLiteral>,
    pub(crate) adds: Vec<AtomId>,
    pub(crate) deletes: Vec<AtomId>,
}

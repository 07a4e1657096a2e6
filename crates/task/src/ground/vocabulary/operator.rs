//! Operators over atoms, with open design slots.

use std::sync::Arc;

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::condition::{GroundCondition, GroundLiteral};
use crate::ground::vocabulary::numbers::Numbers;
use crate::lifted::{ObjectId, Rational};
use crate::task::quantity::Quantity;
use crate::task::timing::Timing;
use crate::task::{Argument, ForbiddenCombinations};

/// Function and suitable designs of each slot.
pub type GroundSlots = [(ObjectId, Vec<ObjectId>)];

/// An operator over atoms, with exact rationals.
#[derive(Debug, Clone)]
pub struct GroundOperator {
    pub(crate) schema: u32,
    pub(crate) arguments: Vec<Argument>,
    pub(crate) slots: Arc<GroundSlots>,
    pub(crate) forbidden: Arc<[ForbiddenCombinations]>,
    /// Required functions with the arguments that are their designs.
    pub(crate) configuration: Vec<(ObjectId, Argument)>,
    pub(crate) condition: GroundCondition,
    pub(crate) adds: Vec<AtomId>,
    pub(crate) deletes: Vec<AtomId>,
    /// Conditional effects after `adds` and `deletes`. Those of an entry are simultaneous,
    /// deletions first.
    pub(crate) conditional: Vec<GroundConditional>,
    pub(crate) numeric_effects: Numbers,
    /// Costs by objective.
    pub(crate) costs: Vec<Quantity<Rational>>,
    pub(crate) duration: Quantity<Rational>,
    /// Set for a wait instead of an action: the time of its end.
    pub(crate) wait: Option<Rational>,
    /// Times, each with a flag whether a moment later is meant, until all durations are known.
    pub(crate) timing: Timing<(Rational, bool)>,
}

/// Changes of atoms if a conjunction holds before the operator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroundConditional {
    pub(crate) condition: Vec<GroundLiteral>,
    pub(crate) adds: Vec<AtomId>,
    pub(crate) deletes: Vec<AtomId>,
}

//! Ground operators over atoms, in which the designs of slots are still open.

use std::sync::Arc;

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::condition::{GroundCondition, GroundLiteral};
use crate::ground::vocabulary::numbers::Numbers;
use crate::lifted::{ObjectId, Rational};
use crate::task::quantity::Quantity;
use crate::task::timing::Timing;
use crate::task::{Argument, ForbiddenCombinations};

/// For each slot: its function and the designs that are suitable for it.
pub type GroundSlots = [(ObjectId, Vec<ObjectId>)];

/// A ground operator over atoms, with exact rational numbers.
#[derive(Debug, Clone)]
pub struct GroundOperator {
    pub(crate) schema: u32,
    pub(crate) arguments: Vec<Argument>,
    pub(crate) slots: Arc<GroundSlots>,
    pub(crate) forbidden: Arc<[ForbiddenCombinations]>,
    /// Functions that the action requires, each with the argument that is its design.
    pub(crate) configuration: Vec<(ObjectId, Argument)>,
    pub(crate) condition: GroundCondition,
    pub(crate) adds: Vec<AtomId>,
    pub(crate) deletes: Vec<AtomId>,
    /// Conditional effects, which apply after `adds` and `deletes`: first the deletions of all entries, then their
    /// additions.
    pub(crate) conditional: Vec<GroundConditional>,
    pub(crate) numeric_effects: Numbers,
    pub(crate) costs: Vec<Quantity<Rational>>,
    pub(crate) duration: Quantity<Rational>,
    /// Time of the end if the operator is a wait; `None` if it is an action.
    pub(crate) wait: Option<Rational>,
    /// Lower bounds on the times of start and end that follow from timed events. If the flag is `true`, the bound
    /// is one moment (a very short time) later. The length of the moment is determined once all durations are
    /// known.
    pub(crate) timing: Timing<(Rational, bool)>,
}

/// A conditional effect of an operator: changes of atoms if a conjunction holds before the operator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroundConditional {
    pub(crate) condition: Vec<GroundLiteral>,
    pub(crate) adds: Vec<AtomId>,
    pub(crate) deletes: Vec<AtomId>,
}

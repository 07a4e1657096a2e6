//! Cases, i.e. outcomes of an action instance under a condition, and simultaneous effects.

use std::collections::BTreeMap;

use crate::faithful::formula::{Formula, Known};
use crate::faithful::key::Key;
use crate::faithful::length::Length;
use crate::faithful::linear::Linear;
use crate::faithful::timeline::Passage;
use pddl::ast::Assignment;

/// An outcome of an action instance under a condition on the state before it. Cases may overlap;
/// together they cover all executions of the instance.
#[derive(Debug)]
pub(super) struct Case {
    pub(super) known: Known,
    /// The truth values of the atoms that start effects or events change, and of the timeline's own
    /// atoms (phase and `waited`).
    pub(super) truths: BTreeMap<Key, bool>,
    /// Conditional effects on atoms at the end: (condition, atom, `true` if added). An atom that is
    /// both added and deleted holds.
    pub(super) effects: Vec<(Formula, Key, bool)>,
    pub(super) changes: BTreeMap<Key, Linear>,
    pub(super) length: Option<Length>,
    pub(super) passage: Passage,
}

#[derive(Default)]
pub(super) struct Moment {
    pub(super) atoms: Vec<(Formula, Key, bool)>,
    /// Effects on numeric fluents: (condition, kind of assignment, fluent, value). The value is
    /// `None` if it is undefined.
    pub(super) numbers: Vec<(Formula, Assignment, Key, Option<Linear>)>,
}

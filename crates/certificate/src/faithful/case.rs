//! Outcomes of an action instance under a condition, and simultaneous effects.

use std::collections::BTreeMap;

use crate::faithful::formula::{Formula, Known};
use crate::faithful::key::Key;
use crate::faithful::length::Length;
use crate::faithful::linear::Linear;
use crate::faithful::timeline::Passage;
use pddl::ast::Assignment;

/// One outcome of the conditions of an instance. Cases may overlap; together they cover all
/// executions.
#[derive(Debug)]
pub(super) struct Case {
    /// Facts that hold before.
    pub(super) known: Known,
    /// Truth values of atoms after the start effects.
    pub(super) truths: BTreeMap<Key, bool>,
    /// Conditional effects on atoms at the end: (condition, atom, added). An atom that is both
    /// added and deleted holds.
    pub(super) effects: Vec<(Formula, Key, bool)>,
    /// Values of the changed fluents afterwards.
    pub(super) changes: BTreeMap<Key, Linear>,
    /// The duration; `None` for instantaneous actions and waits.
    pub(super) length: Option<Length>,
    pub(super) passage: Passage,
}

/// Simultaneous conditional effects.
#[derive(Default)]
pub(super) struct Moment {
    pub(super) atoms: Vec<(Formula, Key, bool)>,
    /// Effects on fluents; the value is `None` if it is undefined.
    pub(super) numbers: Vec<(Formula, Assignment, Key, Option<Linear>)>,
}

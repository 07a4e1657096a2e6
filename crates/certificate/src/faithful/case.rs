//! What comes of an instance, and what takes place at once.

use std::collections::BTreeMap;

use crate::faithful::formula::{Formula, Known};
use crate::faithful::key::Key;
use crate::faithful::length::Length;
use crate::faithful::linear::Linear;
use crate::faithful::timeline::Passage;
use pddl::ast::Assignment;

/// One way in which the conditions of an instance can turn out. Cases may overlap; together they are all.
#[derive(Debug)]
pub(super) struct Case {
    /// What holds before.
    pub(super) known: Known,
    /// What has become of atoms at the start.
    pub(super) truths: BTreeMap<Key, bool>,
    /// What becomes of atoms at the end, each under a condition; what is both added and deleted holds.
    pub(super) effects: Vec<(Formula, Key, bool)>,
    /// Fluents that have these values afterwards.
    pub(super) changes: BTreeMap<Key, Linear>,
    /// None for an instantaneous action, and for a wait.
    pub(super) length: Option<Length>,
    pub(super) passage: Passage,
}

/// Effects that take place at once, each under a condition.
#[derive(Default)]
pub(super) struct Moment {
    pub(super) atoms: Vec<(Formula, Key, bool)>,
    /// A value is missing where it is undefined.
    pub(super) numbers: Vec<(Formula, Assignment, Key, Option<Linear>)>,
}

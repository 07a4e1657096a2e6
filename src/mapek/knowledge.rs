//! Knowledge: what the loop believes and what it has asked for. All of it, and nothing else, makes two loops equal.
//!
//! While an action is under way, values that it increases or decreases change with its progress; its other effects
//! take place when it has succeeded.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use num_rational::BigRational;

use super::answer::Effect;
use super::sequence::Numbers;
use super::step::PlannedStep;
use crate::knowledge::Fault;
use crate::mission::Mission;

/// Everything that the loop knows.
#[derive(Debug, Clone)]
pub struct Knowledge {
    /// Knowledge base and problem, as they are believed to be.
    pub(super) mission: Mission,
    /// The text of the goal, if it is not the problem's.
    pub(super) goal: Option<String>,
    /// The designs that are available, by local name.
    pub(super) available: BTreeSet<String>,
    /// Objectives that have a status, with it.
    pub(super) statuses: BTreeMap<String, Vec<String>>,
    /// The axioms and rules that what is known violates.
    pub(super) violated: BTreeSet<String>,
    /// Why it is not known what follows, as was said last.
    pub(super) fault: Option<Fault>,
    /// Function to the design that it has.
    pub(super) configuration: BTreeMap<String, String>,
    /// What is still to be requested, if there is a plan.
    pub(super) plan: Option<VecDeque<PlannedStep>>,
    /// The action that was requested and has not ended.
    pub(super) running: Option<Running>,
    /// Whether the goal was seen to hold.
    pub(super) reached: bool,
    /// Why no plan is looked for until something changes.
    pub(super) stuck: bool,
    /// Whether the plan at hand may not be the best, since time was up.
    pub(super) unproved: bool,
    /// The last step that failed, and how often in a row.
    pub(super) failures: Option<(PlannedStep, u32)>,
    /// Designs that have come back, or a word for facts that have changed, without another plan being looked for.
    pub(super) hopes: BTreeSet<String>,
    /// When the last of them came.
    pub(super) hoped: Duration,
    /// How many actions were requested.
    pub(super) actions: u64,
    /// How many effects there were.
    pub(super) effects: u64,
    /// Effects that are not acknowledged.
    pub(super) outstanding: BTreeMap<u64, Effect>,
    /// How many lines were handled.
    pub(super) lines: u64,
    /// The numbers of the lines that had one and were taken over.
    pub(super) numbers: Numbers,
    /// The time of the last line, since the start of the mission.
    pub(super) now: Duration,
}

/// An action that was requested and has not ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Running {
    /// The number of the request.
    pub(super) action: u64,
    /// The action as it runs now.
    pub(super) step: PlannedStep,
    /// How much is done, from 0 to 1.
    pub(super) progress: BigRational,
    /// Whether it was asked to end.
    pub(super) cancelling: bool,
    /// Whether it was asked to stand still.
    pub(super) suspended: bool,
}

impl Knowledge {
    pub(super) fn new(mission: Mission) -> Self {
        Self {
            mission,
            goal: None,
            available: BTreeSet::new(),
            statuses: BTreeMap::new(),
            violated: BTreeSet::new(),
            fault: None,
            configuration: BTreeMap::new(),
            plan: None,
            running: None,
            reached: false,
            stuck: false,
            unproved: false,
            failures: None,
            hopes: BTreeSet::new(),
            hoped: Duration::ZERO,
            actions: 0,
            effects: 0,
            outstanding: BTreeMap::new(),
            lines: 0,
            numbers: Numbers::default(),
            now: Duration::ZERO,
        }
    }

    /// The mission as it is believed to be.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// The designs that are available, by local name.
    pub fn available(&self) -> &BTreeSet<String> {
        &self.available
    }

    /// Objectives in error, by local name, with their statuses.
    pub fn statuses(&self) -> &BTreeMap<String, Vec<String>> {
        &self.statuses
    }

    /// Function to the design that it has.
    pub fn configuration(&self) -> &BTreeMap<String, String> {
        &self.configuration
    }

    /// The number of the action that is under way, and the action as it runs now.
    pub fn running(&self) -> Option<(u64, &PlannedStep)> {
        self.running.as_ref().map(|running| (running.action, &running.step))
    }

    /// Whether the action that is under way was asked to end.
    pub fn cancelling(&self) -> bool {
        self.running.as_ref().is_some_and(|running| running.cancelling)
    }

    /// Whether the action that is under way was asked to stand still.
    pub fn suspended(&self) -> bool {
        self.running.as_ref().is_some_and(|running| running.suspended)
    }

    /// What is still to be requested, if there is a plan.
    pub fn plan(&self) -> Option<impl Iterator<Item = &PlannedStep>> {
        self.plan.as_ref().map(VecDeque::iter)
    }

    /// Effects that were asked for and are not acknowledged, in their order.
    pub fn outstanding(&self) -> impl Iterator<Item = &Effect> {
        self.outstanding.values()
    }

    /// How many lines were handled.
    pub fn lines(&self) -> u64 {
        self.lines
    }

    /// The greatest number of a line that was taken over.
    pub fn sequence(&self) -> Option<u64> {
        self.numbers.greatest()
    }

    /// The time of the last line, since the start of the mission.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Whether the goal was seen to hold and nothing has changed since.
    pub fn reached(&self) -> bool {
        self.reached
    }
}

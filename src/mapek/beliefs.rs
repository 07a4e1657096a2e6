//! The loop's knowledge of the situation: what it believes and what it has asked for. All of it, and nothing else, makes two loops
//! equal. All stations of the loop share it.
//!
//! While an action is under way, values that it increases or decreases change with its progress; its other effects
//! take place when it has succeeded.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use num_rational::BigRational;
use pddl::ast::{Domain, Problem};
use pddl::validate::{Options, Verdict, Violation, advance, validate};

use crate::knowledge::Fault;
use crate::mapek::answer::{Command, Effect};
use crate::mapek::filter::FilterStates;
use crate::mapek::receipts::Receipts;
use crate::mapek::resume::{resume, resumed_goal};
use crate::mapek::sequence::Numbers;
use crate::mapek::step::{PlannedStep, plan_text};
use crate::mission::Mission;

/// Everything that the loop knows.
#[derive(Debug, Clone)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
pub struct Beliefs {
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
    /// Function to the design that it has: the one that was acknowledged last.
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
    /// The next search for a plan after one that was cut short, if nothing else happens.
    pub(super) retry: Option<Retry>,
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
    /// Acknowledgements so far, by function.
    pub(super) receipts: Receipts,
    /// For each outstanding effect, when it was asked for last and how often.
    pub(super) waits: BTreeMap<u64, Wait>,
    /// Whether the robot has ever reported that an action has started or progressed.
    pub(super) reports_actions: bool,
    /// How many lines were handled.
    pub(super) lines: u64,
    /// The numbers of the lines that had one and were taken over.
    pub(super) numbers: Numbers,
    /// The time of the last line, since the start of the mission.
    pub(super) now: Duration,
    /// Memory of the filters of what is measured and of what components report.
    pub(super) filters: FilterStates,
}

/// An action that was requested and has not ended.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
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
    /// Whether it stands still only until planning has decided what becomes of it.
    pub(super) provisional: bool,
    /// The number of the effect that requested it.
    pub(super) request: u64,
    /// When it was requested or last reported.
    pub(super) heard: Duration,
    /// Number of deadlines that have passed since then.
    pub(super) overdue: u32,
    /// Whether its start or progress was reported.
    pub(super) started: bool,
    /// Whether its progress was reported.
    pub(super) progressed: bool,
    /// Whether it was suspended and resumed.
    pub(super) resumed: bool,
    /// Functions with the designs that the action was told to use last.
    pub(super) instructed: Vec<(String, String)>,
}

/// A search for a plan that is to be repeated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Retry {
    /// Time since the start of the mission at which it is repeated.
    pub(super) at: Duration,
    /// Number of searches in a row that were cut short.
    pub(super) attempt: u32,
}

/// How long an effect has been outstanding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Wait {
    /// When it was asked for last, since the start of the mission.
    pub(super) since: Duration,
    /// How often it was repeated.
    pub(super) repeats: u32,
}

/// What is about to be done, as a task and its plan.
#[derive(Debug, Clone)]
pub struct Outlook {
    /// The domain; what is left of the action under way comes first in it.
    pub domain: Domain,
    /// The situation as it is believed, with what the knowledge base contributes, and the goal.
    pub problem: Problem,
    /// The action under way, if there is one, and what is still to be requested.
    pub steps: Vec<PlannedStep>,
    /// The number that the request of the first of these steps has, or will have.
    pub first: u64,
    /// Whether it was requested.
    pub is_under_way: bool,
}

impl Beliefs {
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
            retry: None,
            failures: None,
            hopes: BTreeSet::new(),
            hoped: Duration::ZERO,
            actions: 0,
            effects: 0,
            outstanding: BTreeMap::new(),
            receipts: Receipts::default(),
            waits: BTreeMap::new(),
            reports_actions: false,
            lines: 0,
            numbers: Numbers::default(),
            now: Duration::ZERO,
            filters: FilterStates::default(),
        }
    }

    /// The mission as it is believed to be.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// The goal, if it is another one than the problem's.
    pub fn goal(&self) -> Option<&str> {
        self.goal.as_deref()
    }

    /// The designs that are available, by local name.
    pub fn available(&self) -> &BTreeSet<String> {
        &self.available
    }

    /// Objectives in error, by local name, with their statuses.
    pub fn statuses(&self) -> &BTreeMap<String, Vec<String>> {
        &self.statuses
    }

    /// Function to the design that it has: the one that was acknowledged last. What was asked for since then is
    /// [pending](Self::pending).
    pub fn configuration(&self) -> &BTreeMap<String, String> {
        &self.configuration
    }

    /// Functions with the design that was asked for and is not acknowledged.
    pub fn pending(&self) -> impl Iterator<Item = (&str, &str)> {
        self.outstanding.values().filter_map(|effect| match &effect.command {
            Command::Reconfigure { function, to, .. } => Some((function.as_str(), to.as_str())),
            _ => None,
        })
    }

    /// Returns `true` if a reconfiguration of the function was asked for and never answered, be it outstanding or superseded:
    /// the function may then have another design than the one that was acknowledged last.
    pub fn is_unsettled(&self, function: &str) -> bool {
        self.pending().any(|(own, _)| own == function) || self.receipts.has_superseded(function)
    }

    /// The design that a function has or is about to get; none where it is not certain.
    pub(super) fn expected(&self, function: &str) -> Option<&str> {
        if let Some((_, design)) = self.pending().find(|(own, _)| *own == function) {
            return Some(design);
        }
        let design = self.configuration.get(function).map(String::as_str);
        design.filter(|_| !self.receipts.has_superseded(function))
    }

    /// The number of the action that is under way, and the action as it runs now.
    pub fn running(&self) -> Option<(u64, &PlannedStep)> {
        self.running.as_ref().map(|running| (running.action, &running.step))
    }

    /// Share of the action under way that is done, from 0 to 1.
    pub(crate) fn progress(&self) -> Option<&BigRational> {
        self.running.as_ref().map(|running| &running.progress)
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

    /// What is about to be done, if there is a plan.
    pub fn outlook(&self) -> Option<Outlook> {
        let plan = self.plan.as_ref()?;
        let (domain, problem) = self.left();
        let (domain, running) = (domain.into_owned(), self.running.as_ref());
        let first = running.map_or(self.actions + 1, |running| running.action);
        let steps = running.map(|running| &running.step).into_iter().chain(plan).cloned().collect();
        Some(Outlook { domain, problem, steps, first, is_under_way: running.is_some() })
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

    /// The numbers of lines that are missing below the greatest one, as ranges with both ends: these lines were on their way, or were
    /// refused.
    pub fn missing(&self) -> Vec<[u64; 2]> {
        self.numbers.missing()
    }

    /// The time of the last line, since the start of the mission.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Whether the goal was seen to hold and nothing has changed since.
    pub fn reached(&self) -> bool {
        self.reached
    }

    /// Whether a design can be used, as far as is known; all can without a knowledge base.
    pub(super) fn is_available(&self, design: &str) -> bool {
        self.mission.knowledge().is_none() || self.available.contains(design) || self.mission.provides(design)
    }

    /// The designs of the steps that are still to be requested.
    pub(super) fn planned(&self) -> impl Iterator<Item = &String> {
        let steps = self.plan.iter().flatten();
        steps.flat_map(|step| step.configuration.iter().map(|(_, design)| design))
    }

    /// The problem as it is believed now, with what the knowledge base contributes.
    pub(super) fn filled(&self) -> Problem {
        let mut problem = self.mission.problem().clone();
        self.mission.fill(&mut problem);
        problem
    }

    /// What is left to be done: the domain, in which the action under way comes first, and the filled problem.
    fn left(&self) -> (Cow<'_, Domain>, Problem) {
        let (domain, mut problem) = (self.mission.domain(), self.filled());
        match &self.running {
            Some(running) => {
                problem.goal = resumed_goal(&problem.goal);
                (Cow::Owned(resume(domain, &running.step, &running.progress)), problem)
            }
            None => (Cow::Borrowed(domain), problem),
        }
    }

    /// What the validator says of the plan, the action under way included.
    pub(super) fn verdict(&self) -> Verdict {
        let running = self.running.iter().map(|running| &running.step);
        let steps = running.chain(self.plan.iter().flatten());
        let (domain, problem) = self.left();
        validate(&domain, &problem, &plan_text(steps), &Options::default())
    }

    /// Why what is left of the action under way cannot be done.
    pub(super) fn obstacle(&self, running: &Running) -> Option<String> {
        let (domain, problem) = self.left();
        let violation = advance(&domain, &problem, &running.step.to_plan_step(), false).err()?;
        Some(violation.message.clone())
    }

    /// Why the plan, with what is left of the action under way, does not fit the situation as it is believed.
    pub fn violation(&self) -> Option<String> {
        self.verdict().violation.map(|violation| self.mission.spoken(&sentence(&violation)))
    }
}

/// What is wrong with a plan.
fn sentence(violation: &Violation) -> String {
    let unmet = violation.unmet.first().map(|unmet| format!(": {}", unmet.condition)).unwrap_or_default();
    format!("the plan does not fit the situation: {}{unmet}", violation.message)
}

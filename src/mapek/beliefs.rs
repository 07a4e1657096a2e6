//! Shared state of the loop: the believed situation, the plan and outstanding effects. After a deliberation, this is
//! the whole state of the loop, apart from caches.
//!
//! While an action is under way, numeric values that the action only increases or decreases change with its
//! progress. The other effects of the action take place when it succeeds.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use num_rational::BigRational;
use pddl::ast::{ActionBody, Domain, Problem};
use pddl::validate::{Options, PlanText, Violation, advance, advance_each, metric_of, validate};

use crate::knowledge::Fault;
use crate::mapek::answer::{Command, Effect};
use crate::mapek::filter::FilterStates;
use crate::mapek::receipts::Receipts;
use crate::mapek::resume::{Remainder, resume, resumed_goal, without_companions};
use crate::mapek::sequence::Numbers;
use crate::mapek::step::{PlannedStep, plan_text};
use crate::mission::Mission;

/// State of the adaptation loop: the believed situation, the current plan, and outstanding effects.
#[derive(Debug, Clone)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
pub struct Beliefs {
    pub(super) mission: Mission,
    pub(super) goal: Option<String>,
    pub(super) available: BTreeSet<String>,
    pub(super) statuses: BTreeMap<String, Vec<String>>,
    pub(super) violated: BTreeSet<String>,
    /// Fault that stopped the reasoning, as last reported; `None` if the conclusions are complete.
    pub(super) fault: Option<Fault>,
    pub(super) configuration: BTreeMap<String, String>,
    pub(super) plan: Option<VecDeque<PlannedStep>>,
    pub(super) running: Option<Running>,
    pub(super) reached: bool,
    /// Whether planning has failed and pauses until something changes or another search is due.
    pub(super) stuck: bool,
    pub(super) unproved: bool,
    pub(super) retry: Option<Retry>,
    pub(super) failures: Option<(PlannedStep, u32)>,
    /// Names of designs that are available again, and one entry for all other changes after which a better
    /// plan may exist or be found.
    pub(super) improvement_causes: BTreeSet<String>,
    /// Time at which the last entry of `improvement_causes` was added, since the start of the mission.
    pub(super) improvement_since: Duration,
    pub(super) actions: u64,
    pub(super) effects: u64,
    pub(super) outstanding: BTreeMap<u64, Effect>,
    pub(super) receipts: Receipts,
    pub(super) waits: BTreeMap<u64, Wait>,
    pub(super) reports_actions: bool,
    pub(super) lines: u64,
    /// Whether an accepted line stated its time, so that time advances with lines only.
    pub(super) has_times: bool,
    pub(super) numbers: Numbers,
    pub(super) now: Duration,
    /// Time of the last line or timer that was not refused, since the start of the mission.
    pub(super) considered: Duration,
    pub(super) filters: FilterStates,
}

#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
pub(super) struct Running {
    pub(super) action: u64,
    pub(super) step: PlannedStep,
    /// Completed share of the action, from 0 to 1.
    pub(super) progress: BigRational,
    /// Increases of functions by the present progress (negative for decreases). The keys are the texts of the
    /// functions.
    pub(super) applied: BTreeMap<String, BigRational>,
    pub(super) cancelling: bool,
    pub(super) suspended: bool,
    /// Whether the action is suspended only until planning has finished.
    pub(super) provisional: bool,
    pub(super) request: u64,
    /// Time of the request, the resumption, the acknowledgement of the cancellation or the last report, whichever was
    /// last, since the start of the mission.
    pub(super) last_report: Duration,
    /// Backoff factor: 0 after a report, 1 after the first missed deadline, then doubled by each further one.
    pub(super) overdue: u32,
    pub(super) started: bool,
    pub(super) progressed: bool,
    pub(super) resumed: bool,
    pub(super) sent_configuration: Vec<(String, String)>,
}

impl Running {
    pub(super) fn remainder(&self) -> Remainder<'_> {
        let Self { step, progress, applied, started, .. } = self;
        Remainder { step, progress, applied, has_started: *started }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Retry {
    pub(super) at: Duration,
    pub(super) attempt: u32,
}

/// Start of the wait for the acknowledgement of an effect, since the start of the mission, and number of repetitions of
/// the effect because the wait was too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Wait {
    pub(super) since: Duration,
    pub(super) repeats: u32,
}

/// The remaining mission as a planning task with its plan.
#[derive(Debug, Clone)]
pub struct Outlook {
    /// Domain of the mission. If an action is under way, the domain forces plans to begin with its remainder.
    pub domain: Domain,
    /// The believed problem, filled from the knowledge base, with the current goal. If an action is under way, the goal
    /// also requires the end of its remainder.
    pub problem: Problem,
    /// The action under way, if any, followed by the remaining steps of the plan.
    pub steps: Vec<PlannedStep>,
    /// Action number of the first step in `steps`.
    pub first: u64,
    /// Whether the first step is under way.
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
            improvement_causes: BTreeSet::new(),
            improvement_since: Duration::ZERO,
            actions: 0,
            effects: 0,
            outstanding: BTreeMap::new(),
            receipts: Receipts::default(),
            waits: BTreeMap::new(),
            reports_actions: false,
            lines: 0,
            has_times: false,
            numbers: Numbers::default(),
            now: Duration::ZERO,
            considered: Duration::ZERO,
            filters: FilterStates::default(),
        }
    }

    /// The mission in its believed state.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Returns the text of the current goal; `None` for the goal of the problem file.
    pub fn goal(&self) -> Option<&str> {
        self.goal.as_deref()
    }

    /// Local names of available designs.
    pub fn available(&self) -> &BTreeSet<String> {
        &self.available
    }

    /// Objectives in error by local name, with their statuses.
    pub fn statuses(&self) -> &BTreeMap<String, Vec<String>> {
        &self.statuses
    }

    /// Returns the believed design of each function: usually the design that was acknowledged or observed last. Omits
    /// functions whose design is unknown. Later requests are [pending](Self::pending).
    pub fn configuration(&self) -> &BTreeMap<String, String> {
        &self.configuration
    }

    /// Returns the function and the requested design of each outstanding reconfiguration. A reconfiguration is
    /// outstanding until it is acknowledged, has failed, is abandoned, or is superseded, or until a report of an
    /// action implies its arrival.
    pub fn pending(&self) -> impl Iterator<Item = (&str, &str)> {
        self.outstanding.values().filter_map(|effect| match &effect.command {
            Command::Reconfigure { function, to, .. } => Some((function.as_str(), to.as_str())),
            _ => None,
        })
    }

    /// Returns `true` if a reconfiguration of the function is outstanding, or was superseded or abandoned and neither
    /// it nor a later one was answered. The function's actual design may then differ from the believed one.
    pub fn is_unsettled(&self, function: &str) -> bool {
        self.pending().any(|(name, _)| name == function) || self.receipts.has_superseded(function)
    }

    /// Returns the requested design of a function if a reconfiguration is pending, and the believed design otherwise;
    /// `None` if the design is unknown or uncertain.
    pub(super) fn expected(&self, function: &str) -> Option<&str> {
        if let Some((_, design)) = self.pending().find(|(name, _)| *name == function) {
            return Some(design);
        }
        let design = self.configuration.get(function).map(String::as_str);
        design.filter(|_| !self.receipts.has_superseded(function))
    }

    /// Returns the number of the action under way, and the action with its current designs.
    pub fn running(&self) -> Option<(u64, &PlannedStep)> {
        self.running.as_ref().map(|running| (running.action, &running.step))
    }

    pub(crate) fn remainder(&self) -> Option<Remainder<'_>> {
        self.running.as_ref().map(Running::remainder)
    }

    /// Returns `true` if the action under way is being cancelled.
    pub fn cancelling(&self) -> bool {
        self.running.as_ref().is_some_and(|running| running.cancelling)
    }

    /// Returns `true` if the action under way is suspended.
    pub fn suspended(&self) -> bool {
        self.running.as_ref().is_some_and(|running| running.suspended)
    }

    /// Remaining steps of the plan, without the action under way.
    pub fn plan(&self) -> Option<impl Iterator<Item = &PlannedStep>> {
        self.plan.as_ref().map(VecDeque::iter)
    }

    /// Returns the remaining mission with its plan, or `None` without a plan.
    pub fn outlook(&self) -> Option<Outlook> {
        let plan = self.plan.as_ref()?;
        let (domain, problem) = self.remaining_mission();
        let (domain, running) = (domain.into_owned(), self.running.as_ref());
        let first = running.map_or(self.actions + 1, |running| running.action);
        let steps = running.map(|running| &running.step).into_iter().chain(plan).cloned().collect();
        Some(Outlook { domain, problem, steps, first, is_under_way: running.is_some() })
    }

    /// Effects that still await an acknowledgement, and the cancellation of the action under way, in the order of their
    /// numbers.
    pub fn outstanding(&self) -> impl Iterator<Item = &Effect> {
        self.outstanding.values()
    }

    /// Number of received lines, including refused ones. Timers are not counted.
    pub fn lines(&self) -> u64 {
        self.lines
    }

    /// Returns `true` if an accepted line stated its time. Time then advances with lines only.
    pub fn has_times(&self) -> bool {
        self.has_times
    }

    /// Greatest sequence number of an accepted line.
    pub fn sequence(&self) -> Option<u64> {
        self.numbers.greatest()
    }

    /// Returns the gaps between sequence numbers of accepted lines, as inclusive ranges; if there are more than 255, the
    /// last 255. The missing lines have not arrived yet, or were refused.
    pub fn missing(&self) -> Vec<[u64; 2]> {
        self.numbers.missing()
    }

    /// Time of the last line or timer, since the start of the mission.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Returns `true` if the goal was reached, and no later change required a new plan.
    pub fn reached(&self) -> bool {
        self.reached
    }

    /// Returns `true` if a design is believed to be available: according to the knowledge base, or to the problem if
    /// that decides. Without a knowledge base, all designs are available.
    pub(super) fn is_available(&self, design: &str) -> bool {
        self.mission.knowledge().is_none() || self.available.contains(design) || self.mission.provides(design)
    }

    pub(super) fn planned_designs(&self) -> impl Iterator<Item = &String> {
        let steps = self.plan.iter().flatten();
        steps.flat_map(|step| step.configuration.iter().map(|(_, design)| design))
    }

    pub(super) fn filled(&self) -> Arc<Problem> {
        self.mission.current()
    }

    /// Returns the domain and the filled problem of the remaining mission. If an action is under way, plans must begin
    /// with its remainder.
    fn remaining_mission(&self) -> (Cow<'_, Domain>, Problem) {
        let (domain, mut problem) = (self.mission.domain(), Arc::unwrap_or_clone(self.filled()));
        match self.remainder() {
            Some(remainder) => {
                problem.goal = resumed_goal(&problem.goal);
                let (domain, problem) = resume(domain, Cow::Owned(problem), &remainder);
                (Cow::Owned(domain), problem.into_owned())
            }
            None => (Cow::Borrowed(domain), problem),
        }
    }

    pub(super) fn remaining_plan(&self) -> PlanText {
        let running = self.running.iter().map(|running| &running.step);
        plan_text(running.chain(self.plan.iter().flatten()))
    }

    /// Sets the duration and the cost of the next step to those in the believed situation. If the metric is missing or
    /// undefined, the cost is not changed.
    pub(super) fn reassess(&self, step: &mut PlannedStep) {
        let problem = self.filled();
        let (before, advances) = advance_each(self.mission.domain(), &problem, &[step.to_plan_step()]);
        if let Some(Ok(change)) = advances.into_iter().next() {
            step.duration = change.duration;
            if let (Some(before), Some(after)) = (before, change.metric) {
                step.cost = after - before;
            }
        }
    }

    /// Returns the metric value of the action under way with the remaining plan. `None` if they are not valid, or if
    /// the metric is missing or undefined.
    pub(super) fn metric(&self) -> Option<BigRational> {
        let (domain, problem) = self.remaining_mission();
        metric_of(&domain, &problem, &self.remaining_plan())
    }

    /// Returns the value that planning minimises without a metric, for a plan that begins with the action under way: the
    /// total time if actions have durations, and otherwise the number of steps. `None` if the plan is not valid.
    pub(super) fn default_metric(&self, plan: &PlanText) -> Option<BigRational> {
        let (domain, problem) = self.remaining_mission();
        let verdict = validate(&domain, &problem, plan, &loop_options());
        let is_timed = domain.actions.iter().any(|action| matches!(action.body, ActionBody::Durative { .. }));
        let steps = || BigRational::from_integer(plan.steps.len().into());
        verdict.valid.then(|| if is_timed { verdict.total_time } else { steps() })
    }

    pub(super) fn obstacle(&self, running: &Running) -> Option<String> {
        let (domain, problem) = self.remaining_mission();
        let violation = advance(&domain, &problem, &running.step.to_plan_step(), false).err()?;
        Some(without_companions(&violation.message))
    }

    /// Returns the reason why the action under way and the remaining plan are not executable in the believed situation,
    /// or do not reach the goal. Returns `None` if they are valid.
    pub fn violation(&self) -> Option<String> {
        let (domain, problem) = self.remaining_mission();
        let verdict = validate(&domain, &problem, &self.remaining_plan(), &loop_options());
        verdict.violation.map(|violation| self.mission.spoken(&without_companions(&sentence(&violation))))
    }
}

/// The loop's plans state no durations: the validator computes them from the believed situation.
fn loop_options() -> Options {
    Options::default().with_chosen_durations(true)
}

fn sentence(violation: &Violation) -> String {
    let unmet = violation.unmet.first().map(|unmet| format!(": {}", unmet.condition)).unwrap_or_default();
    format!("the plan does not fit the situation: {}{unmet}", violation.message)
}

//! Decides after changes whether a new plan is needed, has it computed, and adopts it (Algorithm 1 of the paper, see
//! [`crate::mapek`]).
//!
//! The paper plans whenever the available designs have changed or an objective is in error. Here, the loss of designs
//! alone is no reason to drop a plan that is still valid and uses none of them. If such a plan was optimal, it still
//! is, because losing alternatives cannot improve the optimum. If the action under way loses a design, the designs of
//! this action and of the remaining steps are chosen again together, see [`crate::mapek::resume`]. If no plan
//! continues the action, or another plan is better, the action is suspended or cancelled, see
//! [`crate::mapek::interrupt`].

use std::time::Duration;

use num_rational::BigRational;
use pddl::ast::Direction;

use crate::mapek::analyze::{Findings, error, missing_conclusions};
use crate::mapek::answer::Answer;
use crate::mapek::ask::{Outcome, Question};
use crate::mapek::beliefs::{Beliefs, Retry, Running};
use crate::mapek::effects::{cancel, must_be_sent, reconfigure, resume_suspended, suspend};
use crate::mapek::interrupt::{Interruption, weigh};
use crate::mapek::monitor::Changes;
use crate::mapek::plan::Planner;
use crate::mapek::react::trouble;
use crate::mapek::settings::Settings;
use crate::mapek::step::{PlannedStep, plan_text};
use crate::number;

/// Number of consecutive failures of one step after which the plan is dropped and planning pauses.
const MAX_FAILURES: u32 = 3;

/// Minimum base of the pauses after searches without a proved outcome. The base is the time limit of a search if that
/// is longer. The first pause is twice the base. Each further pause is twice the previous one, at most [`MAX_RETRY`].
const MIN_RETRY: Duration = Duration::from_secs(10);

const MAX_RETRY: Duration = Duration::from_secs(3600);

/// Entry of `Beliefs::improvement_causes`, among the names of designs, that represents all other changes.
const FACTS: &str = "facts";

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Need {
    /// The action under way could not continue unchanged. Other designs for it, or its suspension, were requested.
    Interrupted,
    Must,
    Better,
}

#[derive(Debug)]
pub(super) struct Adaptation<'a> {
    pub(super) beliefs: &'a mut Beliefs,
    pub(super) planner: &'a mut Planner,
    pub(super) settings: &'a Settings,
}

impl Adaptation<'_> {
    pub(super) fn adapt(&mut self, changes: Changes, findings: Findings, answers: &mut Vec<Answer>) {
        let is_observed = changes.observed;
        self.decide(changes, findings, answers);
        // A function was reported with a design that the loop has not requested, and the action under way continues
        // with it. The robot may still wait for the design that was requested before, so the reported design is
        // requested. A deliberation that lacks a plan (`is_missing`) must not change the beliefs.
        if is_observed && !self.planner.is_missing {
            self.configure_again(answers);
        }
    }

    fn decide(&mut self, mut changes: Changes, findings: Findings, answers: &mut Vec<Answer>) {
        // Usually, lost designs do not count: with fewer alternatives, a missing plan stays missing.
        let may_gain = !findings.lost.is_empty() && self.beliefs.mission.may_gain_by_loss();
        self.record_improvement_causes(&findings, &changes, may_gain);
        let is_change = changes.facts
            || changes.ended
            || may_gain
            || !changes.reasons.is_empty()
            || !findings.gained.is_empty();
        if self.stop_after_failures(&changes, &findings, answers) {
            return;
        }
        let interruptions = std::mem::take(&mut changes.interruptions);
        if let Some(running) = self.beliefs.running.clone() {
            // The report of the action's end leads to the next plan, which is the first one for these changes.
            if running.cancelling {
                if is_change {
                    self.beliefs.failures = None;
                }
                return;
            }
            if !interruptions.is_empty() {
                self.replan(interruptions, Need::Interrupted, answers);
                return;
            }
            // A suspended action still cannot continue until something improves, so planning again before that is
            // useless.
            let is_news = is_change || !running.suspended;
            if let Some(reason) = trouble(self.beliefs, &running, changes.facts).filter(|_| is_news) {
                self.replan(vec![reason], Need::Must, answers);
                return;
            }
        }
        // The domain need not mention availability. Therefore, the designs of the plan are checked here.
        let lost: Vec<&String> =
            self.beliefs.planned_designs().filter(|design| !self.beliefs.is_available(design)).collect();
        if let Some(design) = lost.first() {
            changes.reasons.push(format!("{design}, which the plan uses, is not available any more"));
        }
        changes.reasons.extend(interruptions);
        // An objective may have recovered since.
        let errors: Vec<String> =
            self.beliefs.statuses.iter().map(|(objective, statuses)| error(objective, statuses)).collect();
        changes.reasons.extend(findings.errors.into_iter().filter(|sentence| errors.contains(sentence)));
        // Conditions, axioms and the goal can read the availability of designs that no step uses.
        let is_validated = changes.facts || !findings.lost.is_empty() || !findings.gained.is_empty();
        // After the goal is reached, there is no plan, and the validator checks the goal alone.
        if self.beliefs.reached && changes.reasons.is_empty() && is_validated {
            let is_undone = self.beliefs.violation().is_some();
            changes.reasons.extend(is_undone.then(|| "the goal does not hold any more".to_owned()));
        }
        if changes.reasons.is_empty() && is_validated && self.beliefs.plan.is_some() {
            changes.reasons.extend(self.beliefs.violation());
        }
        if changes.reasons.is_empty() && self.beliefs.stuck && is_change {
            changes.reasons.push("the situation has changed, and there is no plan".to_owned());
        }
        if changes.reasons.is_empty() && self.beliefs.stuck && self.is_retry_due() {
            changes.reasons.push("the last search for a plan stopped at a limit".to_owned());
        }
        if changes.reasons.is_empty() {
            if !findings.lost.is_empty() && self.beliefs.plan.is_some() {
                let because = "it uses none of the designs that are not available any more".to_owned();
                answers.push(Answer::PlanKept { because });
            }
            self.improve(answers);
        } else {
            self.beliefs.reached = false;
            self.replan(changes.reasons, Need::Must, answers);
        }
    }

    /// Drops the plan after too many consecutive failures of one step. Returns `false` if there were fewer, or if
    /// something else has changed since the last deliberation, so that another plan may succeed.
    fn stop_after_failures(
        &mut self,
        changes: &Changes,
        findings: &Findings,
        answers: &mut Vec<Answer>,
    ) -> bool {
        let is_due =
            |(_, count): &mut (PlannedStep, u32)| *count >= MAX_FAILURES && !changes.reasons.is_empty();
        let Some((step, count)) = self.beliefs.failures.take_if(is_due) else { return false };
        if changes.news > 1 || changes.reasons.len() > 1 || !findings.is_empty() {
            return false;
        }
        let because = format!("`{}` has failed {count} times in a row", step.summary());
        answers.push(Answer::PlanNone { status: "failed", because, blocking: Vec::new() });
        self.beliefs.plan = None;
        self.beliefs.stuck = true;
        self.beliefs.retry = None;
        true
    }

    fn record_improvement_causes(&mut self, findings: &Findings, changes: &Changes, may_gain: bool) {
        let improvement_causes = &mut self.beliefs.improvement_causes;
        improvement_causes.retain(|design| !findings.lost.contains(design));
        let before = improvement_causes.len();
        improvement_causes.extend(findings.gained.iter().cloned());
        let is_change = changes.predicates || changes.values || may_gain;
        improvement_causes.extend(is_change.then(|| FACTS.to_owned()));
        // A plan that is not proved optimal may be improved: a changed situation may be easier to search.
        let is_news = changes.facts || !findings.gained.is_empty() || !findings.lost.is_empty();
        improvement_causes.extend((is_news && self.beliefs.unproved).then(|| FACTS.to_owned()));
        if improvement_causes.len() > before {
            self.beliefs.improvement_since = self.beliefs.now;
        }
    }

    /// Decides about an action under way that was suspended only until planning has finished. Resumes the action if it
    /// is not being cancelled, its designs are available, and its remainder is executable. Otherwise, it stays
    /// suspended.
    pub(super) fn release(&mut self, answers: &mut Vec<Answer>) {
        let Some(mut running) =
            self.beliefs.running.clone().filter(|running_action| running_action.provisional)
        else {
            return;
        };
        running.provisional = false;
        if !running.cancelling && self.can_go_on(&running) {
            reconfigure(self.beliefs, &mut running, answers);
            resume_suspended(self.beliefs, &mut running, answers);
        }
        self.beliefs.running = Some(running);
    }

    /// Searches for a better plan if a repeated search is due, or if the settle time has passed since the last entry of
    /// `improvement_causes` was added. Does not search without a plan, or while conclusions are missing.
    fn improve(&mut self, answers: &mut Vec<Answer>) {
        let has_plan = self.beliefs.plan.is_some() && !self.beliefs.reached;
        if !has_plan {
            self.beliefs.improvement_causes.clear();
        } else if self.beliefs.fault.is_some() {
            // Without conclusions, the available designs are unknown.
        } else if self.is_retry_due() {
            self.replan(vec!["the plan may not be the best".to_owned()], Need::Better, answers);
        } else if !self.beliefs.improvement_causes.is_empty()
            && self.beliefs.now >= self.beliefs.improvement_since.saturating_add(self.settings.settle)
        {
            self.replan(vec!["there may be a better plan".to_owned()], Need::Better, answers);
        }
    }

    fn is_retry_due(&self) -> bool {
        self.beliefs.retry.is_some_and(|scheduled| scheduled.at <= self.beliefs.now)
    }

    fn schedule_retry(&mut self, attempt: u32, outcome: &Outcome) {
        if outcome.proved || self.beliefs.fault.is_some() {
            return;
        }
        let limit = self.settings.time_limit.unwrap_or(MIN_RETRY);
        let pause = limit.max(MIN_RETRY).saturating_mul(2_u32.saturating_pow(attempt + 1)).min(MAX_RETRY);
        let at = self.beliefs.now.saturating_add(pause);
        self.beliefs.retry = Some(Retry { at, attempt: attempt + 1 });
    }

    /// Searches for a plan for the reasons `because`, and adopts it unless it is the current plan. With
    /// [`Need::Better`], the plan is adopted only if its benefit is sufficient. With the other needs, the action under
    /// way may be cancelled or suspended instead. Decides nothing if a search is necessary and the planner may not
    /// search.
    pub(super) fn replan(&mut self, because: Vec<String>, need: Need, answers: &mut Vec<Answer>) {
        let is_necessary = need != Need::Better;
        let reason = because.first().cloned().unwrap_or_default();
        answers.push(Answer::PlanRequested { because });
        self.beliefs.improvement_causes.clear();
        // A search before the scheduled time has another reason, and starts with the initial time limit.
        let retry = self.beliefs.retry.take().filter(|scheduled| scheduled.at <= self.beliefs.now);
        let attempt = retry.map_or(0, |scheduled| scheduled.attempt);
        self.planner.attempt = attempt;
        let mut outcome = self.plan(true);
        // The absence of a plan for an outdated situation is no reason for a decision, unless the situation changes
        // faster than searches end.
        let is_ignored = self.planner.prepared.is_outdated && !self.planner.prepared.accepts_absence();
        self.planner.is_missing |= is_ignored && outcome.steps.is_none();
        if self.planner.is_missing {
            return;
        }
        let is_decided = is_necessary && self.interrupt(&reason, need, &mut outcome, answers);
        if self.planner.is_missing {
            return;
        }
        // The interruption may have found that the absence of a plan is not proved.
        self.schedule_retry(attempt, &outcome);
        if is_decided {
            return;
        }
        let Some(steps) = &outcome.steps else {
            self.report_no_plan(is_necessary, outcome, answers);
            return;
        };
        self.beliefs.stuck = false;
        if self.is_current(steps) {
            self.beliefs.unproved = !outcome.proved;
            self.update_costs(steps);
            let because =
                if outcome.proved { "it is still the best" } else { "no better one was found in time" };
            answers.push(Answer::PlanKept { because: because.to_owned() });
            self.configure_again(answers);
        } else if let Some(because) = (!is_necessary).then(|| self.insufficient_benefit(&outcome)).flatten() {
            answers.push(Answer::PlanKept { because });
        } else {
            self.adopt(outcome, answers);
        }
    }

    fn configure_again(&mut self, answers: &mut Vec<Answer>) {
        let Some(mut running) = self.beliefs.running.take() else { return };
        let is_active = !running.suspended && !running.cancelling;
        // If no design must be sent, the objectives in the knowledge base are up to date.
        if is_active
            && running.step.configuration.iter().any(|pair| must_be_sent(self.beliefs, &running, pair))
        {
            reconfigure(self.beliefs, &mut running, answers);
        }
        self.beliefs.running = Some(running);
    }

    /// Decides whether to cancel or suspend the action under way. Compares `going_on`, a plan that begins with the
    /// remainder of the action, with a plan after its cancellation. Unless `need` is [`Need::Interrupted`], an action
    /// that can continue is interrupted only if it is proved that no plan continues it. If there is neither plan, the
    /// absence of `going_on` remains proved only if that of the other plan is. Returns `true` if the action was
    /// interrupted, or if the decision needs a plan that the planner may not search for.
    fn interrupt(
        &mut self,
        reason: &str,
        need: Need,
        going_on: &mut Outcome,
        answers: &mut Vec<Answer>,
    ) -> bool {
        let Some(running) = self.beliefs.running.clone() else { return false };
        let can_go_on = goes_on_with(&running, going_on) || self.can_go_on(&running);
        let is_refuted = going_on.steps.is_none() && (going_on.proved || going_on.was_proved);
        if need != Need::Interrupted && can_go_on && !is_refuted {
            return false;
        }
        let without = self.plan(false);
        if self.planner.is_missing {
            return true;
        }
        let gained = benefit(self.beliefs, self.settings, &going_on.cost, &without.cost);
        if going_on.steps.is_none() && without.steps.is_none() && going_on.proved && !without.proved {
            going_on.proved = false;
            going_on.because.clone_from(&without.because);
            going_on.blocking.clear();
        }
        match weigh(reason, can_go_on, going_on, without, gained) {
            Interruption::None => false,
            Interruption::Cancel { because } => {
                // The plan after the cancellation is the first one for the changes that have led to it.
                self.beliefs.failures = None;
                cancel(self.beliefs, running, because, answers);
                true
            }
            Interruption::Suspend { reason, status, because, blocking } => {
                suspend(self.beliefs, running, reason, answers);
                answers.push(Answer::PlanNone { status, because, blocking });
                true
            }
        }
    }

    fn can_go_on(&self, running: &Running) -> bool {
        let designs = running.step.configuration.iter();
        designs.into_iter().all(|(_, design)| self.beliefs.is_available(design))
            && self.beliefs.obstacle(running).is_none()
    }

    /// Plans from the believed situation. With `goes_on`, the first step is the remainder of the action under way;
    /// otherwise, the action is treated as cancelled. The outcome has no plan if conclusions are missing, or if the
    /// plan found uses an unavailable design.
    pub(super) fn plan(&mut self, goes_on: bool) -> Outcome {
        self.planner.prepared.is_outdated = false;
        if let Some(fault) = &self.beliefs.fault {
            return Outcome::no_plan(false, missing_conclusions(fault));
        }
        let problem = self.beliefs.filled();
        let running = self.beliefs.running.as_ref().filter(|_| goes_on);
        let steps = running.is_some() || self.beliefs.running.is_none();
        let old: Option<Vec<PlannedStep>> =
            self.beliefs.plan.as_ref().filter(|_| steps).map(|plan| plan.iter().cloned().collect());
        let question = Question {
            mission: &self.beliefs.mission,
            problem: &problem,
            goal: self.beliefs.goal(),
            running,
            old: old.as_deref(),
            stay_close: self.settings.stay_close,
        };
        let outcome = self.planner.plan(&question);
        let unavailable = |step: &PlannedStep| {
            step.configuration
                .iter()
                .find(|(_, design)| !self.beliefs.is_available(design))
                .map(|(_, d)| d.clone())
        };
        match outcome.steps.iter().flatten().find_map(unavailable) {
            // The domain need not require that designs are available. Therefore, the planner may choose an unavailable
            // one.
            Some(design) => Outcome {
                steps: None,
                proved: false,
                because: format!("the plan uses {design}, which is not available"),
                ..outcome
            },
            None => outcome,
        }
    }

    fn is_current(&self, steps: &[PlannedStep]) -> bool {
        let key = |step: &PlannedStep| (step.action.clone(), step.arguments.clone());
        let Some(plan) = &self.beliefs.plan else { return false };
        let running = self.beliefs.running.iter().map(|running| &running.step);
        running.chain(plan).map(key).eq(steps.iter().map(key))
    }

    fn update_costs(&mut self, steps: &[PlannedStep]) {
        let present = steps.iter().skip(usize::from(self.beliefs.running.is_some()));
        for (step, present) in self.beliefs.plan.iter_mut().flatten().zip(present) {
            step.duration.clone_from(&present.duration);
            step.cost.clone_from(&present.cost);
        }
    }

    /// Returns the reason to keep the current plan. Returns `None` if the benefit of `outcome` is sufficient, or if a
    /// metric value cannot be computed.
    fn insufficient_benefit(&self, outcome: &Outcome) -> Option<String> {
        let (current_metric, metric) = if self.beliefs.mission.problem().metric.is_some() {
            (self.beliefs.metric()?, outcome.cost.clone())
        } else {
            let current_plan = self.beliefs.remaining_plan();
            let plan = plan_text(outcome.steps.iter().flatten());
            (self.beliefs.default_metric(&current_plan)?, self.beliefs.default_metric(&plan)?)
        };
        if benefit(self.beliefs, self.settings, &current_metric, &metric).is_some() {
            return None;
        }
        let gain = gain(self.beliefs, &current_metric, &metric);
        let (benefit, minimum) = (number::decimal(&gain), number::decimal(&self.settings.minimum_benefit));
        Some(format!("the benefit of another plan is {benefit}, the minimum is {minimum}"))
    }

    fn adopt(&mut self, outcome: Outcome, answers: &mut Vec<Answer>) {
        let Outcome { steps, proved, .. } = outcome;
        self.beliefs.unproved = !proved;
        let steps = steps.unwrap_or_default();
        let cost = steps.iter().map(|step| step.cost.clone()).sum();
        answers.push(Answer::PlanFound { cost, optimal: proved, steps: steps.clone() });
        let mut steps: std::collections::VecDeque<PlannedStep> = steps.into();
        if let Some(mut running) = self.beliefs.running.take() {
            if let Some(first) = steps.pop_front() {
                running.step = first;
            }
            reconfigure(self.beliefs, &mut running, answers);
            resume_suspended(self.beliefs, &mut running, answers);
            self.beliefs.running = Some(running);
        }
        self.beliefs.plan = Some(steps);
    }

    fn report_no_plan(&mut self, is_necessary: bool, outcome: Outcome, answers: &mut Vec<Answer>) {
        if !is_necessary {
            let because = format!("no better one was found: {}", outcome.because);
            answers.push(Answer::PlanKept { because });
            return;
        }
        let status = if outcome.proved { "unsolvable" } else { "unknown" };
        answers.push(Answer::PlanNone { status, because: outcome.because, blocking: outcome.blocking });
        self.beliefs.plan = None;
        self.beliefs.stuck = true;
    }
}

/// Returns `true` if the plan `going_on` keeps the present designs of the action under way. The planner has simulated
/// the remainder of the action, so the remainder is then executable.
fn goes_on_with(running: &Running, going_on: &Outcome) -> bool {
    let first = going_on.steps.as_ref().and_then(|steps| steps.first());
    first.is_some_and(|first| first.configuration == running.step.configuration)
}

/// Improvement from the metric value `metric` to the value `other`; negative if `other` is worse.
fn gain(beliefs: &Beliefs, metric: &BigRational, other: &BigRational) -> BigRational {
    let declared = beliefs.mission.problem().metric.as_ref();
    let maximize = declared.is_some_and(|metric| metric.direction == Direction::Maximize);
    if maximize { other - metric } else { metric - other }
}

/// Returns the [`gain`] from `metric` to `other`, or `None` if it is not positive or below the minimum benefit.
fn benefit(
    beliefs: &Beliefs,
    settings: &Settings,
    metric: &BigRational,
    other: &BigRational,
) -> Option<BigRational> {
    let is_enough = |gain: &BigRational| *gain > BigRational::default() && *gain >= settings.minimum_benefit;
    Some(gain(beliefs, metric, other)).filter(is_enough)
}

//! From what has changed to whether a plan is needed, and to the plan: Algorithm 1 of the paper.
//!
//! The paper plans when the available designs have changed or an objective is in error. Here a plan that is still valid and
//! that uses none of the lost designs is kept, because it is still the best: of fewer choices none is better. Where a
//! design of the action under way is lost, that action and the rest of the plan are configured anew together, see
//! [`crate::mapek::resume`]; if that is impossible or bad, the action is suspended or cancelled, see [`crate::mapek::interrupt`].

use std::time::Duration;

use num_rational::BigRational;
use pddl::ast::Direction;

use crate::mapek::analyze::{Findings, unknown};
use crate::mapek::answer::Answer;
use crate::mapek::ask::{Ask, Outcome};
use crate::mapek::beliefs::{Beliefs, Retry, Running};
use crate::mapek::effects::{cancel, reconfigure, resume_suspended, suspend};
use crate::mapek::interrupt::{Interruption, weigh};
use crate::mapek::monitor::Changes;
use crate::mapek::plan::Planner;
use crate::mapek::react::trouble;
use crate::mapek::settings::Settings;
use crate::mapek::step::PlannedStep;
use crate::number;

/// How often one step may fail in a row before something has to change.
const FAILURES: u32 = 3;

/// Least time limit that a pause after a search is a multiple of, and the longest pause.
const MIN_RETRY: Duration = Duration::from_secs(10);
const MAX_RETRY: Duration = Duration::from_secs(3600);

/// What stands among designs for facts that have changed.
const FACTS: &str = "facts";

/// Why a plan is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Need {
    /// The action under way could not go on as it was, and a safe effect was asked for.
    Upset,
    /// The plan at hand cannot be kept.
    Must,
    /// There may be a better one.
    Better,
}

/// The station between what has changed and a plan that fits: it decides, and the planner makes the plans.
#[derive(Debug)]
pub(super) struct Adapting<'a> {
    pub(super) beliefs: &'a mut Beliefs,
    pub(super) planner: &'a mut Planner,
    pub(super) settings: &'a Settings,
}

impl Adapting<'_> {
    /// Reacts to what has changed and to what the analysis has found in it, up to a plan.
    pub(super) fn adapt(&mut self, changes: Changes, findings: Findings, answers: &mut Vec<Answer>) {
        let is_observed = changes.observed;
        self.decide(changes, findings, answers);
        // The action goes on with the design that was observed, and may wait for the one before.
        if is_observed && !self.planner.is_missing {
            self.configure_again(answers);
        }
    }

    fn decide(&mut self, mut changes: Changes, findings: Findings, answers: &mut Vec<Answer>) {
        self.chances(&findings, &changes);
        let is_change = changes.facts || !changes.must.is_empty() || !findings.gained.is_empty();
        if self.gave_up(&changes, answers) {
            return;
        }
        let upset = std::mem::take(&mut changes.upset);
        if let Some(running) = self.beliefs.running.clone() {
            if running.cancelling {
                return;
            }
            if !upset.is_empty() {
                self.replan(upset, Need::Upset, answers);
                return;
            }
            // A suspended action is in trouble as long as nothing changes for the better.
            let is_news = is_change || !running.suspended;
            if let Some(reason) = trouble(self.beliefs, &running, changes.facts).filter(|_| is_news) {
                self.replan(vec![reason], Need::Must, answers);
                return;
            }
        }
        let lost: Vec<&String> =
            self.beliefs.planned().filter(|design| !self.beliefs.is_available(design)).collect();
        if let Some(design) = lost.first() {
            changes.must.push(format!("{design}, which the plan uses, is not available any more"));
        }
        changes.must.extend(upset);
        changes.must.extend(findings.errors);
        if self.beliefs.reached && changes.must.is_empty() && changes.facts {
            let is_undone = self.beliefs.violation().is_some();
            changes.must.extend(is_undone.then(|| "the goal does not hold any more".to_owned()));
        }
        if changes.must.is_empty() && changes.facts && self.beliefs.plan.is_some() {
            changes.must.extend(self.beliefs.violation());
        }
        if changes.must.is_empty() && self.beliefs.stuck && is_change {
            changes.must.push("the situation has changed, and there is no plan".to_owned());
        }
        if changes.must.is_empty() && self.beliefs.stuck && self.is_retry_due() {
            changes.must.push("the last search for a plan was cut short".to_owned());
        }
        if changes.must.is_empty() {
            if !findings.lost.is_empty() && self.beliefs.plan.is_some() {
                let because = "it uses none of the designs that are not available any more".to_owned();
                answers.push(Answer::PlanKept { because });
            }
            self.improve(answers);
        } else {
            self.beliefs.reached = false;
            self.replan(changes.must, Need::Must, answers);
        }
    }

    /// After the same failure again and again no plan is looked for until something else happens.
    fn gave_up(&mut self, changes: &Changes, answers: &mut Vec<Answer>) -> bool {
        match &self.beliefs.failures {
            Some((step, count)) if *count >= FAILURES && !changes.must.is_empty() => {
                let because = format!("`{}` has failed {count} times in a row", step.summary());
                answers.push(Answer::PlanNone { status: "failed", because, blocking: Vec::new() });
                self.beliefs.failures = None;
                self.beliefs.plan = None;
                self.beliefs.stuck = true;
                true
            }
            _ => false,
        }
    }

    /// Notes what may lead to a better plan.
    fn chances(&mut self, findings: &Findings, changes: &Changes) {
        let hopes = &mut self.beliefs.hopes;
        hopes.retain(|design| !findings.lost.contains(design));
        let before = hopes.len();
        hopes.extend(findings.gained.iter().cloned());
        hopes.extend((changes.predicates || changes.values).then(|| FACTS.to_owned()));
        // Time was up when the plan was made, and now the question is another one.
        let is_news = changes.facts || !findings.gained.is_empty() || !findings.lost.is_empty();
        hopes.extend((is_news && self.beliefs.unproved).then(|| FACTS.to_owned()));
        if hopes.len() > before {
            self.beliefs.hoped = self.beliefs.now;
        }
    }

    /// Lets the action under way go on if it stands still only until it was decided what becomes of it, and it can go on.
    pub(super) fn release(&mut self, answers: &mut Vec<Answer>) {
        let Some(mut running) = self.beliefs.running.clone().filter(|own| own.provisional) else { return };
        running.provisional = false;
        if !running.cancelling && self.can_go_on(&running) {
            reconfigure(self.beliefs, &mut running, answers);
            resume_suspended(self.beliefs, &mut running, answers);
        }
        self.beliefs.running = Some(running);
    }

    /// Looks for a better plan if there may be one, and there has been for long enough.
    fn improve(&mut self, answers: &mut Vec<Answer>) {
        let has_plan = self.beliefs.plan.is_some() && !self.beliefs.reached;
        if !has_plan {
            self.beliefs.hopes.clear();
        } else if self.beliefs.fault.is_some() {
            // It is not known what there is to hope for.
        } else if self.is_retry_due() {
            self.replan(vec!["the plan may not be the best".to_owned()], Need::Better, answers);
        } else if !self.beliefs.hopes.is_empty()
            && self.beliefs.now >= self.beliefs.hoped.saturating_add(self.settings.settle)
        {
            self.replan(vec!["there may be a better plan".to_owned()], Need::Better, answers);
        }
    }

    /// Whether it is time to repeat a search that was cut short.
    fn is_retry_due(&self) -> bool {
        self.beliefs.retry.is_some_and(|own| own.at <= self.beliefs.now)
    }

    /// Repeats a search that was cut short later, with twice the time; nothing is searched where it is not known what follows.
    fn schedule_retry(&mut self, attempt: u32, outcome: &Outcome) {
        if outcome.proved || self.beliefs.fault.is_some() {
            return;
        }
        let limit = self.settings.time_limit.unwrap_or(MIN_RETRY);
        let pause = limit.max(MIN_RETRY).saturating_mul(2_u32.saturating_pow(attempt + 1)).min(MAX_RETRY);
        let at = self.beliefs.now.saturating_add(pause);
        self.beliefs.retry = Some(Retry { at, attempt: attempt + 1 });
    }

    /// Looks for a plan, and adopts it if it must, or if it is better by enough.
    pub(super) fn replan(&mut self, because: Vec<String>, need: Need, answers: &mut Vec<Answer>) {
        let must = need != Need::Better;
        let reason = because.first().cloned().unwrap_or_default();
        answers.push(Answer::PlanRequested { because });
        self.beliefs.hopes.clear();
        // A search for another reason begins with the ordinary time limit.
        let retry = self.beliefs.retry.take().filter(|own| own.at <= self.beliefs.now);
        let attempt = retry.map_or(0, |own| own.attempt);
        self.planner.attempt = attempt;
        let outcome = self.plan(true);
        if self.planner.is_missing {
            return;
        }
        self.schedule_retry(attempt, &outcome);
        if must && self.interrupt(&reason, need, &outcome, answers) {
            return;
        }
        let Some(steps) = &outcome.steps else {
            self.without_plan(must, outcome, answers);
            return;
        };
        self.beliefs.stuck = false;
        if self.is_current(steps) {
            self.beliefs.unproved = !outcome.proved;
            let because =
                if outcome.proved { "it is still the best" } else { "no better one was found in time" };
            answers.push(Answer::PlanKept { because: because.to_owned() });
            self.configure_again(answers);
        } else if let Some(because) = (!must).then(|| self.not_worth_it(&outcome)).flatten() {
            answers.push(Answer::PlanKept { because });
        } else {
            self.adopt(outcome, answers);
        }
    }

    /// Gives the functions of the action under way their designs where they have lost them.
    fn configure_again(&mut self, answers: &mut Vec<Answer>) {
        let Some(mut running) = self.beliefs.running.take() else { return };
        if !running.suspended && !running.cancelling {
            reconfigure(self.beliefs, &mut running, answers);
        }
        self.beliefs.running = Some(running);
    }

    /// Cancels or suspends the action under way if that is better than `going_on`, the plan that begins with what is left of
    /// it. Returns whether it did.
    fn interrupt(&mut self, reason: &str, need: Need, going_on: &Outcome, answers: &mut Vec<Answer>) -> bool {
        let Some(running) = self.beliefs.running.clone() else { return false };
        let can_go_on = self.can_go_on(&running);
        if need != Need::Upset && can_go_on && (going_on.steps.is_some() || !going_on.proved) {
            return false;
        }
        let without = self.plan(false);
        if self.planner.is_missing {
            return true;
        }
        let gained = benefit(self.beliefs, self.settings, &going_on.cost, &without.cost);
        match weigh(reason, can_go_on, going_on, without, gained) {
            Interruption::None => false,
            Interruption::Cancel { because } => {
                cancel(self.beliefs, running, because, answers);
                true
            }
            Interruption::Suspend { status, because, blocking } => {
                suspend(self.beliefs, running, reason, answers);
                answers.push(Answer::PlanNone { status, because, blocking });
                true
            }
        }
    }

    /// Whether the designs of an action are available, and what is left of it can be done with them.
    fn can_go_on(&self, running: &Running) -> bool {
        let designs = running.step.configuration.iter();
        designs.into_iter().all(|(_, design)| self.beliefs.is_available(design))
            && self.beliefs.obstacle(running).is_none()
    }

    /// The best plan, with what is left of the action under way as its first step or as though there was none.
    pub(super) fn plan(&mut self, goes_on: bool) -> Outcome {
        if let Some(fault) = &self.beliefs.fault {
            let (because, cost) = (unknown(fault), BigRational::default());
            return Outcome { steps: None, cost, proved: false, because, blocking: Vec::new() };
        }
        let problem = self.beliefs.filled();
        let running = self.beliefs.running.as_ref().filter(|_| goes_on);
        let steps = running.is_some() || self.beliefs.running.is_none();
        let old: Option<Vec<PlannedStep>> =
            self.beliefs.plan.as_ref().filter(|_| steps).map(|plan| plan.iter().cloned().collect());
        let ask = Ask {
            mission: &self.beliefs.mission,
            problem: &problem,
            running,
            old: old.as_deref(),
            stay_close: self.settings.stay_close,
        };
        let outcome = self.planner.plan(&ask);
        let unavailable = |step: &PlannedStep| {
            step.configuration
                .iter()
                .find(|(_, design)| !self.beliefs.is_available(design))
                .map(|(_, d)| d.clone())
        };
        match outcome.steps.iter().flatten().find_map(unavailable) {
            // The domain does not ask for what the knowledge base says.
            Some(design) => Outcome {
                steps: None,
                proved: false,
                because: format!("the plan uses {design}, which is not available"),
                ..outcome
            },
            None => outcome,
        }
    }

    /// Whether these are the action under way and the plan at hand.
    fn is_current(&self, steps: &[PlannedStep]) -> bool {
        let key = |step: &PlannedStep| (step.action.clone(), step.arguments.clone());
        let Some(plan) = &self.beliefs.plan else { return false };
        let running = self.beliefs.running.iter().map(|running| &running.step);
        running.chain(plan).map(key).eq(steps.iter().map(key))
    }

    /// Why a plan that need not be adopted is not.
    fn not_worth_it(&self, outcome: &Outcome) -> Option<String> {
        let kept = self.beliefs.verdict().metric?;
        if benefit(self.beliefs, self.settings, &kept, &outcome.cost).is_some() {
            return None;
        }
        let gain = gain(self.beliefs, &kept, &outcome.cost);
        let (benefit, minimum) = (number::decimal(&gain), number::decimal(&self.settings.minimum_benefit));
        Some(format!("the benefit of another plan is {benefit}, the minimum is {minimum}"))
    }

    /// Takes a plan over; the action under way gets its designs.
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

    /// There is no plan, and the action under way goes on.
    fn without_plan(&mut self, must: bool, outcome: Outcome, answers: &mut Vec<Answer>) {
        let status = if outcome.proved { "unsolvable" } else { "unknown" };
        answers.push(Answer::PlanNone { status, because: outcome.because, blocking: outcome.blocking });
        if must {
            self.beliefs.plan = None;
            self.beliefs.stuck = true;
        }
    }
}

/// By how much another metric is better than one; below zero if it is worse.
fn gain(beliefs: &Beliefs, metric: &BigRational, other: &BigRational) -> BigRational {
    let declared = beliefs.mission.problem().metric.as_ref();
    let maximize = declared.is_some_and(|metric| metric.direction == Direction::Maximize);
    if maximize { other - metric } else { metric - other }
}

/// The same, if it is more than nothing and at least the minimum benefit.
fn benefit(
    beliefs: &Beliefs,
    settings: &Settings,
    metric: &BigRational,
    other: &BigRational,
) -> Option<BigRational> {
    let is_enough = |gain: &BigRational| *gain > BigRational::default() && *gain >= settings.minimum_benefit;
    Some(gain(beliefs, metric, other)).filter(is_enough)
}

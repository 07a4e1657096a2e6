//! From what has changed to whether a plan is needed, and to the plan: Algorithm 1 of the paper.
//!
//! The paper plans when the available designs have changed or an objective is in error. Here a plan that is still valid and
//! that uses none of the lost designs is kept, because it is still the best: of fewer choices none is better. Where a
//! design of the action under way is lost, that action and the rest of the plan are configured anew together, see
//! [`super::resume`]; if that is impossible or bad, the action is suspended or cancelled, see [`super::interrupt`].

use pddl::validate::{Options, Verdict, Violation, advance, validate};

use super::Loop;
use super::analyze::{Findings, unknown};
use super::answer::Answer;
use super::knowledge::Running;
use super::monitor::{Base, Changes};
use super::number;
use super::plan::{Ask, Outcome};
use super::step::{PlannedStep, plan_text};

/// How often one step may fail in a row before something has to change.
const FAILURES: u32 = 3;

/// What stands among designs for facts that have changed.
const FACTS: &str = "facts";

impl Loop {
    /// Reacts to what has changed, up to a plan.
    pub(super) fn adapt(&mut self, mut changes: Changes, answers: &mut Vec<Answer>) {
        if changes.base > Base::Nothing {
            self.contradict(answers);
        }
        let findings =
            if changes.base == Base::Watched { self.analyze(answers) } else { Findings::default() };
        self.chances(&findings, &changes);
        let is_change = changes.facts || !changes.must.is_empty() || !findings.gained.is_empty();
        if self.gave_up(&changes, answers) {
            return;
        }
        if let Some(running) = self.knowledge.running.clone() {
            if running.cancelling {
                return;
            }
            // A suspended action is in trouble as long as nothing changes for the better.
            let is_news = is_change || !running.suspended;
            if let Some(reason) = self.trouble(&running, &changes).filter(|_| is_news) {
                self.replan(vec![reason], true, answers);
                return;
            }
        }
        let lost: Vec<&String> = self.planned().filter(|design| !self.is_available(design)).collect();
        if let Some(design) = lost.first() {
            changes.must.push(format!("{design}, which the plan uses, is not available any more"));
        }
        changes.must.extend(findings.errors);
        if changes.must.is_empty() && changes.facts && self.knowledge.plan.is_some() {
            changes.must.extend(self.violation());
        }
        if changes.must.is_empty() && self.knowledge.stuck && is_change {
            changes.must.push("the situation has changed, and there is no plan".to_owned());
        }
        if changes.must.is_empty() {
            if !findings.lost.is_empty() && self.knowledge.plan.is_some() {
                let because = "it uses none of the designs that are not available any more".to_owned();
                answers.push(Answer::PlanKept { because });
            }
            self.improve(answers);
        } else {
            self.knowledge.reached = false;
            self.replan(changes.must, true, answers);
        }
    }

    /// After the same failure again and again no plan is looked for until something else happens.
    fn gave_up(&mut self, changes: &Changes, answers: &mut Vec<Answer>) -> bool {
        match &self.knowledge.failures {
            Some((step, count)) if *count >= FAILURES && !changes.must.is_empty() => {
                let because = format!("`{}` has failed {count} times in a row", step.summary());
                answers.push(Answer::PlanNone { status: "failed", because, blocking: Vec::new() });
                self.knowledge.failures = None;
                self.knowledge.plan = None;
                self.knowledge.stuck = true;
                true
            }
            _ => false,
        }
    }

    /// Notes what may lead to a better plan.
    fn chances(&mut self, findings: &Findings, changes: &Changes) {
        let hopes = &mut self.knowledge.hopes;
        hopes.retain(|design| !findings.lost.contains(design));
        let before = hopes.len();
        hopes.extend(findings.gained.iter().cloned());
        hopes.extend(changes.predicates.then(|| FACTS.to_owned()));
        // Time was up when the plan was made, and now the question is another one.
        let is_news = changes.facts || !findings.gained.is_empty() || !findings.lost.is_empty();
        hopes.extend((is_news && self.knowledge.unproved).then(|| FACTS.to_owned()));
        if hopes.len() > before {
            self.knowledge.hoped = self.knowledge.now;
        }
    }

    pub(super) fn is_available(&self, design: &str) -> bool {
        self.knowledge.mission.knowledge().is_none() || self.knowledge.available.contains(design)
    }

    /// The designs of the steps that are still to be requested.
    fn planned(&self) -> impl Iterator<Item = &String> {
        let steps = self.knowledge.plan.iter().flatten();
        steps.flat_map(|step| step.configuration.iter().map(|(_, design)| design))
    }

    /// Why the action under way cannot go on as it is.
    fn trouble(&self, running: &Running, changes: &Changes) -> Option<String> {
        let lost = running.step.configuration.iter().find(|(_, design)| !self.is_available(design));
        if let Some((_, design)) = lost {
            return Some(format!(
                "{design}, which action {} uses, is not available any more",
                running.action
            ));
        }
        if !changes.facts {
            return None;
        }
        self.obstacle(running).map(|obstacle| format!("action {}: {obstacle}", running.action))
    }

    /// What the validator says of the plan, the action under way included.
    fn verdict(&self) -> Verdict {
        let running = self.knowledge.running.iter().map(|running| &running.step);
        let steps = running.chain(self.knowledge.plan.iter().flatten());
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
        self.verdict().violation.map(|violation| sentence(&violation))
    }

    /// Looks for a better plan if there may be one, and there has been for long enough.
    fn improve(&mut self, answers: &mut Vec<Answer>) {
        let has_plan = self.knowledge.plan.is_some() && !self.knowledge.reached;
        if !has_plan {
            self.knowledge.hopes.clear();
        } else if self.knowledge.fault.is_some() {
            // It is not known what there is to hope for.
        } else if !self.knowledge.hopes.is_empty()
            && self.knowledge.now >= self.knowledge.hoped + self.settings.settle
        {
            self.replan(vec!["there may be a better plan".to_owned()], false, answers);
        }
    }

    /// Looks for a plan, and adopts it if it must, or if it is better by enough.
    pub(super) fn replan(&mut self, because: Vec<String>, must: bool, answers: &mut Vec<Answer>) {
        let reason = because.first().cloned().unwrap_or_default();
        answers.push(Answer::PlanRequested { because });
        self.knowledge.hopes.clear();
        let outcome = self.plan(true);
        if must && self.interrupt(&reason, &outcome, answers) {
            return;
        }
        let Some(steps) = &outcome.steps else {
            self.without_plan(must, outcome, answers);
            return;
        };
        self.knowledge.stuck = false;
        if self.is_current(steps) {
            answers.push(Answer::PlanKept { because: "it is still the best".to_owned() });
        } else if let Some(because) = (!must).then(|| self.not_worth_it(&outcome)).flatten() {
            answers.push(Answer::PlanKept { because });
        } else {
            self.adopt(outcome, answers);
        }
    }

    /// The best plan, with what is left of the action under way as its first step or as though there was none.
    pub(super) fn plan(&mut self, goes_on: bool) -> Outcome {
        if let Some(fault) = &self.knowledge.fault {
            let (because, cost) = (unknown(fault), num_rational::BigRational::default());
            return Outcome { steps: None, cost, proved: false, because, blocking: Vec::new() };
        }
        let problem = self.filled();
        let running = self.knowledge.running.as_ref().filter(|_| goes_on);
        let steps = running.is_some() || self.knowledge.running.is_none();
        let old: Option<Vec<PlannedStep>> =
            self.knowledge.plan.as_ref().filter(|_| steps).map(|plan| plan.iter().cloned().collect());
        let ask = Ask {
            mission: &self.knowledge.mission,
            problem: &problem,
            running,
            old: old.as_deref(),
            stay_close: self.settings.stay_close,
        };
        let outcome = self.planner.plan(&ask);
        let unavailable = |step: &PlannedStep| {
            step.configuration.iter().find(|(_, design)| !self.is_available(design)).map(|(_, d)| d.clone())
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
        let Some(plan) = &self.knowledge.plan else { return false };
        let running = self.knowledge.running.iter().map(|running| &running.step);
        running.chain(plan).map(key).eq(steps.iter().map(key))
    }

    /// Why a plan that need not be adopted is not.
    fn not_worth_it(&self, outcome: &Outcome) -> Option<String> {
        let kept = self.verdict().metric?;
        if self.benefit(&kept, &outcome.cost).is_some() {
            return None;
        }
        let benefit = self.gain(&kept, &outcome.cost);
        let (benefit, minimum) = (number::decimal(&benefit), number::decimal(&self.settings.minimum_benefit));
        Some(format!("the benefit of another plan is {benefit}, the minimum is {minimum}"))
    }

    /// Takes a plan over; the action under way gets its designs.
    fn adopt(&mut self, outcome: Outcome, answers: &mut Vec<Answer>) {
        let Outcome { steps, proved, .. } = outcome;
        self.knowledge.unproved = !proved;
        let steps = steps.unwrap_or_default();
        let cost = steps.iter().map(|step| step.cost.clone()).sum();
        answers.push(Answer::PlanFound { cost, optimal: proved, steps: steps.clone() });
        let mut steps: std::collections::VecDeque<PlannedStep> = steps.into();
        if let Some(mut running) = self.knowledge.running.take() {
            if let Some(first) = steps.pop_front() {
                running.step = first;
            }
            self.reconfigure(running.action, &running.step.clone(), answers);
            self.resume_suspended(&mut running, answers);
            self.knowledge.running = Some(running);
        }
        self.knowledge.plan = Some(steps);
    }

    /// There is no plan, and the action under way goes on.
    fn without_plan(&mut self, must: bool, outcome: Outcome, answers: &mut Vec<Answer>) {
        let status = if outcome.proved { "unsolvable" } else { "unknown" };
        answers.push(Answer::PlanNone { status, because: outcome.because, blocking: outcome.blocking });
        if must {
            self.knowledge.plan = None;
            self.knowledge.stuck = true;
        }
    }
}

/// What is wrong with a plan.
fn sentence(violation: &Violation) -> String {
    let unmet = violation.unmet.first().map(|unmet| format!(": {}", unmet.condition)).unwrap_or_default();
    format!("the plan does not fit the situation: {}{unmet}", violation.message)
}

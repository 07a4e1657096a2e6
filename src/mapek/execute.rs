//! Execute: actions are requested one by one, each with its configuration: Algorithm 2 of the paper.
//!
//! Before each request the rest of the plan is validated against the state as it is believed, and the knowledge base hears
//! which functions are objectives now and which designs are grounded for them.

use super::Loop;
use super::answer::{Answer, Command, Effect};
use super::knowledge::Running;
use super::step::PlannedStep;

impl Loop {
    /// Requests the next action if none is under way.
    pub(super) fn execute(&mut self, answers: &mut Vec<Answer>) {
        // A plan that does not fit is replaced once; one that still does not fit is none.
        for attempt in 0..2 {
            let is_known = self.knowledge.fault.is_none();
            if self.knowledge.running.is_some() || self.knowledge.stuck || self.knowledge.reached || !is_known
            {
                return;
            }
            let is_planned = self.knowledge.plan.is_some();
            let violation = self.violation();
            let next = self.knowledge.plan.as_mut().filter(|_| violation.is_none());
            if let Some(step) = next.and_then(std::collections::VecDeque::pop_front) {
                self.request(step, answers);
                return;
            }
            match violation {
                None => {
                    self.finish(answers);
                    return;
                }
                Some(because) if attempt == 0 => {
                    let because = if is_planned { because } else { "there is no plan".to_owned() };
                    self.replan(vec![because], true, answers);
                }
                Some(because) => {
                    answers.push(Answer::PlanNone { status: "unknown", because, blocking: Vec::new() });
                    self.knowledge.plan = None;
                    self.knowledge.stuck = true;
                }
            }
        }
    }

    fn finish(&mut self, answers: &mut Vec<Answer>) {
        self.knowledge.reached = true;
        self.knowledge.plan = None;
        self.objectives(None, answers);
        answers.push(Answer::GoalReached);
    }

    pub(super) fn request(&mut self, step: PlannedStep, answers: &mut Vec<Answer>) {
        self.knowledge.actions += 1;
        let action = self.knowledge.actions;
        self.reconfigure(action, &step, answers);
        self.effect(action, Command::Request { step: step.clone() }, answers);
        let progress = num_rational::BigRational::from_integer(0.into());
        self.knowledge.running =
            Some(Running { action, step, progress, cancelling: false, suspended: false });
    }

    /// Gives functions the designs of a step, and the knowledge base its objectives.
    pub(super) fn reconfigure(&mut self, action: u64, step: &PlannedStep, answers: &mut Vec<Answer>) {
        for (function, design) in &step.configuration {
            let from = self.knowledge.configuration.insert(function.clone(), design.clone());
            if from.as_ref() != Some(design) {
                let command = Command::Reconfigure { function: function.clone(), from, to: design.clone() };
                self.effect(action, command, answers);
            }
        }
        self.objectives(Some(step), answers);
    }

    /// Asks the managed system for something.
    pub(super) fn effect(&mut self, action: u64, command: Command, answers: &mut Vec<Answer>) {
        self.knowledge.effects += 1;
        let number = self.knowledge.effects;
        let outstanding = &mut self.knowledge.outstanding;
        let is_replaced = |old: &Effect| command.replaces(&old.command, old.action == action);
        let supersedes: Vec<u64> =
            outstanding.values().filter(|old| is_replaced(old)).map(|old| old.number).collect();
        outstanding.retain(|number, _| !supersedes.contains(number));
        let effect = Effect { number, action, command, repeated: false, supersedes };
        outstanding.insert(number, effect.clone());
        answers.push(Answer::Effect(effect));
    }

    /// Makes the functions of a step, and no others, the objectives of the knowledge base, grounded as the step says.
    fn objectives(&mut self, step: Option<&PlannedStep>, answers: &mut Vec<Answer>) {
        let wanted = step.map_or(&[][..], |step| &step.configuration);
        let Some(knowledge) = self.knowledge.mission.knowledge_mut() else { return };
        if let Err(error) = knowledge.pursue_in_time(wanted) {
            answers.push(Answer::Error { code: error.code.clone(), message: error.message.clone() });
        }
        self.contradict(answers);
        self.analyze(answers);
    }
}

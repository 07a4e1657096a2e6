//! Baseline strategies for comparison with the adaptation loop. Each baseline lacks a capability of the loop.
//!
//! All strategies receive the same observations as the loop, request actions in the same way, and use the same planner.
//! They differ in when they plan and in how they choose designs:
//!
//! - *none* executes its first plan, and stops when an action fails;
//! - *failure* plans actions and designs together again after an action has failed, as PLANTA does \[1\];
//! - *greedy* chooses the design of each function separately: the admissible design with the best metric of the next
//!   action. It chooses at each request of an action, and when a running action loses a design. MROS chooses similarly:
//!   the design of greatest utility among those that no failure or measurement excludes \[2\]. The task is planned
//!   again when an action has failed;
//! - *random* works as *greedy*, but chooses a random admissible design.
//!
//! All baselines except *none* also plan again if no step is left, the goal is not reached, and other designs are
//! available than at the last planning.
//!
//! [`Admission`] defines which designs are admissible. If a function has no admissible design, the action keeps the
//! planned design if that is available, and otherwise gets an available one; the action may become possible later. If
//! the action is impossible with the chosen designs but possible with the designs of its plan, the planned designs are
//! used.
//!
//! \[1\] Rezende Silva et al., PLANTA, 2025. \[2\] Bozhinoski et al., MROS, Advanced Robotics 36, 2022.

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use num_rational::BigRational;
use pddl::ast::{Direction, Problem};
use pddl::validate::{advance, metric_after};

use crate::mapek::{Answer, Event, Loop, Observation, PlannedStep};
use crate::mission::Mission;
use crate::simulate::admissible::Admission;

/// A control strategy of a simulated robot: the adaptation loop or a baseline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strategy {
    /// The adaptation loop.
    Joint,
    /// Executes its first plan, and stops when an action fails.
    None,
    /// Chooses for each function a random design with which the next action is possible.
    Random,
    /// Chooses for each function separately the cheapest design with which the next action is
    /// possible.
    Greedy,
    /// Plans actions and designs together again when an action has failed.
    Failure,
}

impl Strategy {
    /// All strategies, the loop first.
    pub const ALL: [Self; 5] = [Self::Joint, Self::Failure, Self::Greedy, Self::Random, Self::None];

    /// Returns the name of the strategy.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::None => "none",
            Self::Random => "random",
            Self::Greedy => "greedy",
            Self::Failure => "failure",
        }
    }

    fn chooses_designs(self) -> bool {
        matches!(self, Self::Random | Self::Greedy)
    }
}

/// A running strategy. All strategies use a [`Loop`] for their knowledge about the robot and for its planner; only
/// `joint` lets the loop decide.
#[derive(Debug)]
pub(super) struct Controller {
    strategy: Strategy,
    control: Loop,
    plan: VecDeque<PlannedStep>,
    random: fastrand::Rng,
    gave_up: bool,
    planned_with: BTreeSet<String>,
    pub(super) plans: usize,
}

impl Controller {
    pub(super) fn new(strategy: Strategy, control: Loop, seed: u64) -> Self {
        let random = fastrand::Rng::with_seed(seed ^ 0x5eed);
        Self {
            strategy,
            control,
            plan: VecDeque::new(),
            random,
            gave_up: false,
            planned_with: BTreeSet::new(),
            plans: 0,
        }
    }

    pub(super) fn is_done(&self) -> bool {
        self.gave_up
    }

    pub(super) fn start(&mut self) -> Vec<Answer> {
        if self.strategy == Strategy::Joint {
            let answers = self.control.start();
            self.count(&answers);
            return answers;
        }
        let mut answers = Vec::new();
        self.replan();
        self.go_on(&mut answers);
        answers
    }

    pub(super) fn handle(&mut self, event: Event, now: Duration) -> Vec<Answer> {
        let is_failure = matches!(event, Event::Failed { .. });
        let observation = Observation::from(event);
        if self.strategy == Strategy::Joint {
            let answers = self.control.handle(&observation, now);
            self.count(&answers);
            return answers;
        }
        self.control.observe(&observation, now);
        let mut answers = Vec::new();
        if is_failure && self.strategy == Strategy::None {
            self.gave_up = true;
        } else if is_failure {
            self.replan();
        }
        if self.strategy.chooses_designs() {
            self.replace_lost(&mut answers);
        }
        self.go_on(&mut answers);
        answers
    }

    fn count(&mut self, answers: &[Answer]) {
        let _ = self.control.decision(answers);
        self.plans += answers.iter().filter(|answer| matches!(answer, Answer::PlanRequested { .. })).count();
    }

    fn replan(&mut self) {
        self.plans += 1;
        self.planned_with.clone_from(self.control.beliefs().available());
        self.plan = self.control.plan_anew().unwrap_or_default().into();
    }

    /// Requests the next action of the plan if no action is running. Plans again first if the plan is empty, the goal
    /// is not reached, and the available designs have changed since the last planning; never with [`Strategy::None`].
    fn go_on(&mut self, answers: &mut Vec<Answer>) {
        if self.gave_up || self.control.beliefs().running().is_some() {
            return;
        }
        if let Some(step) = self.plan.pop_front() {
            let step =
                if self.strategy.chooses_designs() { self.choose(&step, false, |_| true) } else { step };
            self.control.request_now(step, answers);
        } else if self.strategy != Strategy::None
            && self.planned_with != *self.control.beliefs().available()
            && !self.control.is_goal()
        {
            // A plan may exist if the availability of designs changes.
            self.replan();
            if let Some(step) = self.plan.pop_front() {
                // The plan is not empty, so the recursive call requests the step and does not plan again.
                self.plan.push_front(step);
                self.go_on(answers);
            }
        }
    }

    /// Returns `step` with designs chosen by the strategy for those functions for which `concerns`
    /// returns `true`. `is_running` is `true` if the step is the action under way.
    fn choose(
        &mut self,
        step: &PlannedStep,
        is_running: bool,
        concerns: impl Fn(&str) -> bool,
    ) -> PlannedStep {
        let beliefs = self.control.beliefs();
        let remainder = beliefs.remainder().filter(|_| is_running);
        let mission = beliefs.mission();
        let mut problem = mission.problem().clone();
        mission.fill(&mut problem);
        let mut chosen = step.clone();
        let functions = step.configuration.iter().map(|(function, _)| function.as_str());
        let functions: Vec<&str> = functions.filter(|function| concerns(function)).collect();
        for (index, function) in functions.iter().enumerate() {
            let designs = self.control.designs_for(function);
            // Conditions on the later functions are ignored until their designs are chosen.
            let undecided = &functions[index + 1..];
            let admission = Admission::new(mission.domain(), &problem, &chosen, remainder, undecided);
            let admits = |design: &&String| admission.admits(&chosen.with_design(function, design));
            let admissible: Vec<String> = designs.iter().filter(admits).cloned().collect();
            // Without an admissible design, the design of the plan has the best chance to become
            // possible.
            let is_kept = admissible.is_empty()
                && chosen
                    .design(function)
                    .is_some_and(|design| designs.iter().any(|candidate| candidate == design));
            if is_kept {
                continue;
            }
            let designs = if admissible.is_empty() { designs } else { admissible };
            let design = match self.strategy {
                Strategy::Random if !designs.is_empty() => {
                    Some(designs[self.random.usize(..designs.len())].clone())
                }
                Strategy::Random => None,
                _ => cheapest(mission, &problem, (&chosen, function), &designs),
            };
            if let Some(design) = design {
                chosen = chosen.with_design(function, &design);
            }
        }
        // Designs that are chosen one after the other may be impossible together. Then those of the
        // plan are used if they are possible.
        let whole = Admission::new(mission.domain(), &problem, step, remainder, &[]);
        if !whole.admits(&chosen) && whole.admits(step) { step.clone() } else { chosen }
    }

    fn replace_lost(&mut self, answers: &mut Vec<Answer>) {
        let beliefs = self.control.beliefs();
        let Some((_, step)) = beliefs.running() else { return };
        let step = step.clone();
        let available = beliefs.available().clone();
        let is_lost =
            |function: &str| step.design(function).is_some_and(|design| !available.contains(design));
        if step.configuration.iter().any(|(function, _)| is_lost(function)) {
            let chosen = self.choose(&step, true, is_lost);
            self.control.reconfigure_now(chosen, answers);
        }
    }
}

/// Returns the design with which the action alone has the best metric, even if the action is not possible with it. Of
/// equal designs, returns the first. Returns `None` if no cost is defined.
fn cheapest(
    mission: &Mission,
    problem: &Problem,
    (step, function): (&PlannedStep, &str),
    designs: &[String],
) -> Option<String> {
    let maximize = problem.metric.as_ref().is_some_and(|metric| metric.direction == Direction::Maximize);
    let cost = |design: &String| -> Option<BigRational> {
        let step = step.with_design(function, design).to_plan_step();
        let advance = advance(mission.domain(), problem, &step, true).ok()?;
        let mut after = problem.clone();
        advance.apply(&mut after.init);
        let cost = metric_after(mission.domain(), &after, &advance.duration)?;
        Some(if maximize { -cost } else { cost })
    };
    let costs = designs.iter().filter_map(|design| Some((cost(design)?, design)));
    costs.min_by(|left, right| left.0.cmp(&right.0)).map(|(_, design)| design.clone())
}

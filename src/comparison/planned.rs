//! Plans by situation, each made once; what they cost to find; and the way to decide that follows them.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use probabilistic::Error;

use crate::comparison::coadaptation::Coadaptation;
use crate::comparison::nominal::after;
use crate::comparison::play::{Measures, play};
use crate::comparison::process::{Action, Risk, State, Valuation};
use crate::comparison::referee::Referee;
use crate::message::Errors;

/// A plan from a situation, and what it cost to find it.
#[derive(Debug, Clone, Default)]
pub struct Planned {
    /// What to do; none if there is no plan.
    pub actions: Option<Vec<Action>>,
    /// Variables of the largest formula.
    pub variables: u64,
    /// Its clauses.
    pub clauses: u64,
    /// How long it took.
    pub time: Stages,
}

/// How long the parts of an answer took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stages {
    /// To build what is solved: the process, or the ground task and its formulas.
    pub build: Duration,
    /// To solve it.
    pub solve: Duration,
    /// To read out what to do.
    pub extract: Duration,
}

impl Stages {
    /// All of it.
    pub fn total(&self) -> Duration {
        self.build + self.solve + self.extract
    }
}

/// Finds plans; asked once for each situation.
pub type PlanFinder<'a> = dyn FnMut(&Valuation) -> Result<Planned, Errors> + 'a;

/// What both sides take.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Costs {
    /// Of the process.
    pub states: usize,
    /// Of the process.
    pub transitions: usize,
    /// What the policies of single objectives decide, in all states that they get to.
    pub decisions: usize,
    /// The process, for all objectives together.
    pub process: Stages,
    /// The greatest memory in megabytes until the process was solved, with what the planner has left.
    pub process_memory: Option<u64>,
    /// How many plans were made.
    pub plans: usize,
    /// The first one (cold).
    pub first_plan: Stages,
    /// The greatest memory in megabytes while the first one was made.
    pub plan_memory: Option<u64>,
    /// The other ones together (warm).
    pub more_plans: Duration,
    /// Of the largest formula.
    pub variables: u64,
    /// Of the largest formula.
    pub clauses: u64,
}

/// Why a comparison has no result.
#[derive(Debug)]
pub enum NoResult {
    /// Of the process.
    Process(Error),
    /// Of the planner.
    Planner(Errors),
}

impl From<Error> for NoResult {
    fn from(error: Error) -> Self {
        Self::Process(error)
    }
}

impl From<Errors> for NoResult {
    fn from(messages: Errors) -> Self {
        Self::Planner(messages)
    }
}

/// Plans by situation, each made once. The collision flag does not matter to a plan.
pub(super) struct PlanTable<'a, 'b> {
    pub(super) planner: &'a mut PlanFinder<'b>,
    pub(super) plans: BTreeMap<Valuation, Option<Vec<Action>>>,
    pub(super) costs: Costs,
}

impl PlanTable<'_, '_> {
    /// The plan from a situation.
    pub(super) fn plan(&mut self, situation: &Valuation) -> Result<Option<Vec<Action>>, Errors> {
        let key = Valuation { hit: false, ..*situation };
        if let Some(known) = self.plans.get(&key) {
            return Ok(known.clone());
        }
        let planned = (self.planner)(&key)?;
        if self.costs.plans == 0 {
            self.costs.first_plan = planned.time;
        } else {
            self.costs.more_plans += planned.time.total();
        }
        self.costs.plans += 1;
        self.costs.variables = self.costs.variables.max(planned.variables);
        self.costs.clauses = self.costs.clauses.max(planned.clauses);
        self.plans.insert(key, planned.actions.clone());
        Ok(planned.actions)
    }

    /// Follows plans, and makes a new one wherever the state is not the one that the last plan expects.
    pub(super) fn play(&mut self, referee: &Referee<'_>) -> Result<Measures, NoResult> {
        // What the plan in force wants to do in each state that it expects.
        let mut expected: BTreeMap<Valuation, Action> = BTreeMap::new();
        let mut failure = None;
        let unexpected = RefCell::new(BTreeSet::new());
        let mission = referee.mission;
        let mut decide = |state: State, _: u32| {
            let situation = Valuation { hit: false, ..state.situation() };
            if situation.failed || situation.place == mission.goal {
                return None;
            }
            if let Some(action) = expected.get(&situation) {
                return Some(action.number());
            }
            match self.plan(&situation) {
                Ok(Some(plan)) => {
                    if situation != Valuation::start(mission, referee.risk) {
                        unexpected.borrow_mut().insert(situation);
                    }
                    follow(mission, situation, &plan, referee.risk, &mut expected);
                }
                Ok(None) => return None,
                Err(messages) => failure = Some(messages),
            }
            expected.get(&situation).map(|action| action.number())
        };
        let replans =
            |state: State| unexpected.borrow().contains(&Valuation { hit: false, ..state.situation() });
        let (process, reserve) = (referee.exact(), referee.reserve());
        let measures = play(&process, false, referee.penalty, reserve, &replans, &mut decide);
        if let Some(messages) = failure {
            return Err(messages.into());
        }
        Ok(measures?)
    }
}

/// Notes what a plan does in each state that it expects.
fn follow(
    mission: &Coadaptation,
    mut at: Valuation,
    plan: &[Action],
    risk: Risk,
    expected: &mut BTreeMap<Valuation, Action>,
) {
    for action in plan {
        if expected.contains_key(&at) {
            return;
        }
        expected.insert(at, *action);
        at = after(mission, at, *action, risk);
    }
}

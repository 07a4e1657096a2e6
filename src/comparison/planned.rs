//! Plans of the planner, cached by state of the process, with their computational costs, and the
//! decision rule that follows these plans.

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

/// A plan from a state of the process, and the effort of computing the plan.
#[derive(Debug, Clone, Default)]
pub struct Planned {
    /// Actions of the plan. `None` if there is no plan, or if a step of the plan has no action of the process in its
    /// state ([`Tasked`](crate::comparison::Tasked)). If the problem declares places and configurations, such steps are
    /// omitted.
    pub actions: Option<Vec<Action>>,
    /// Number of variables of the largest formula.
    pub variables: u64,
    /// Number of clauses of the largest formula.
    pub clauses: u64,
    /// Time of planning, by stage.
    pub time: Stages,
}

/// Running times by stage, for model checking or for a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stages {
    /// Time of building the process, or the ground task with its formulas.
    pub build: Duration,
    /// Time of solving the process, or of search and SAT solving.
    pub solve: Duration,
    /// Time of extracting the policy or the plan from the solution.
    pub extract: Duration,
}

impl Stages {
    /// Returns the sum of the stages.
    pub fn total(&self) -> Duration {
        self.build + self.solve + self.extract
    }
}

/// Callback that computes a plan from a state of the process. It is called at most once for states that differ only
/// in the collision flag.
pub type PlanFinder<'a> = dyn FnMut(&Valuation) -> Result<Planned, Errors> + 'a;

/// Computational costs of model checking and of planning.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Costs {
    /// Number of states of the process.
    pub states: usize,
    /// Number of transitions of the process.
    pub transitions: usize,
    /// Number of decisions of the policies for single objectives, in all states that the policies
    /// reach.
    pub decisions: usize,
    /// Running times of model checking, for all objectives together.
    pub process: Stages,
    /// Peak memory in megabytes while the process was explored and solved, after the first plan. Includes memory
    /// that the planner has not released. `None` if the platform does not report it.
    pub process_memory: Option<u64>,
    /// Number of computed plans.
    pub plans: usize,
    /// Running times of the first plan, with cold caches.
    pub first_plan: Stages,
    /// Peak memory in megabytes during the first plan. `None` if the platform does not report it.
    pub plan_memory: Option<u64>,
    /// Total time of all further plans, with warm caches.
    pub more_plans: Duration,
    /// Number of variables of the largest formula.
    pub variables: u64,
    /// Number of clauses of the largest formula.
    pub clauses: u64,
}

/// Reason why a comparison has no result.
#[derive(Debug)]
pub enum NoResult {
    /// The process cannot be built or solved.
    Process(Error),
    /// The planner rejects the mission.
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

/// Cache of plans by state of the process. The collision flag is ignored, because plans do not
/// depend on it.
pub(super) struct PlanTable<'a, 'b> {
    pub(super) planner: &'a mut PlanFinder<'b>,
    pub(super) plans: BTreeMap<Valuation, Option<Vec<Action>>>,
    pub(super) costs: Costs,
}

impl PlanTable<'_, '_> {
    pub(super) fn plan(&mut self, situation: &Valuation) -> Result<Option<Vec<Action>>, Errors> {
        let key = Valuation { hit: false, ..*situation };
        if let Some(plan) = self.plans.get(&key) {
            return Ok(plan.clone());
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

    /// Evaluates the decision rule that follows computed plans. A new plan is computed in every state that no earlier
    /// plan expects.
    pub(super) fn play(&mut self, referee: &Referee<'_>) -> Result<Measures, NoResult> {
        // Next action of a computed plan, by the state in which the plan expects to execute it.
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

/// Adds to `expected` the state before each action of a plan, with this action. Stops at a state
/// that is already present.
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

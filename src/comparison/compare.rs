//! Both approaches in one referee: policies of model checking, and plans with and without re-planning, are played in the
//! same decision process, and measured exactly there.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use num_rational::BigRational;
use probabilistic::Error;
use probabilistic::explore::{Bounds, explore};

use crate::comparison::coadaptation::Coadaptation;
use crate::comparison::hindsight::{self, Hindsight, LossReport, Spent};
use crate::comparison::play::{Measures, play};
use crate::comparison::process::{Action, Process, REWARDS, Risk, Situation, State};
use crate::comparison::published::{published, shortest_routes};
use crate::comparison::referee::Referee;
use crate::comparison::route::best_on_route;
use crate::message::Message;

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
pub type Planner<'a> = dyn FnMut(&Situation) -> Result<Planned, Vec<Message>> + 'a;

/// Hears of the candidates that have been measured, and of what was taken until then.
pub type Report<'a> = dyn FnMut(&[Candidate], &Costs) + 'a;

/// How a comparison is made.
#[derive(Clone)]
pub struct Config<'a> {
    /// What is uncertain in the referee.
    pub risk: Risk,
    /// The time that a failed mission costs; ten times the fastest plan's if not given.
    pub penalty: Option<f64>,
    /// The priority of the published procedure: time (0), energy (1) or safety (2).
    pub priority: usize,
    /// More states than this are an error.
    pub states: usize,
    /// Tells the greatest memory in megabytes since it was last asked, where that is known.
    pub memory: &'a dyn Fn() -> Option<u64>,
}

/// One way to decide, and what comes of it.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Which kind it is: `a` to `f`.
    pub kind: char,
    /// What it is.
    pub name: String,
    /// What comes of it.
    pub measures: Measures,
}

/// What both sides take.
#[derive(Debug, Clone, Default)]
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

/// The table.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The rows.
    pub candidates: Vec<Candidate>,
    /// The vertices of the front of time and probability of success without collision, where each time is finite.
    pub front: Vec<[f64; 2]>,
    /// Bounds on time and energy that no way to decide gets below, even one that knows beforehand what will be lost.
    pub hindsight: [Hindsight; 2],
    /// The penalty for failed missions.
    pub penalty: f64,
    /// Why re-planning cannot be worse than the best policy, where that is known without computing it.
    pub no_price: Option<&'static str>,
    /// What the loss of the component does, step by step.
    pub loss: Option<LossReport>,
    /// What both sides take.
    pub costs: Costs,
}

impl Comparison {
    /// The penalised time of a kind of candidate.
    fn penalised(&self, kind: char) -> Option<f64> {
        self.candidates.iter().find(|candidate| candidate.kind == kind)?.measures.penalised_time
    }

    /// The penalised time that the plan with re-planning takes above the best policy: the price of determinism.
    pub fn price_of_determinism(&self) -> Option<f64> {
        Some(self.penalised('c')? - self.penalised('a')?)
    }

    /// The penalised time that the plan without re-planning takes above the best policy: the price of the open loop.
    pub fn price_of_open_loop(&self) -> Option<f64> {
        Some(self.penalised('b')? - self.penalised('a')?)
    }

    /// The penalised time that re-planning saves.
    pub fn value_of_replanning(&self) -> Option<f64> {
        Some(self.penalised('b')? - self.penalised('c')?)
    }
}

/// Compares all candidates. The planner is asked for the plan at the start, and wherever re-planning is needed. What is there
/// is reported whenever there is more.
///
/// # Errors
/// The planner's, or a limit on states.
pub fn compare(
    mission: &Coadaptation,
    config: &Config<'_>,
    planner: &mut Planner<'_>,
    report: &mut Report<'_>,
) -> Result<Comparison, Failure> {
    // The planner comes first, so that its memory can be told from that of the process.
    (config.memory)();
    let mut memo = Memo { planner, plans: BTreeMap::new(), costs: Costs::default() };
    let first = memo.plan(&Situation::start(mission, config.risk))?;
    memo.costs.plan_memory = (config.memory)();
    report(&[], &memo.costs);
    let started = Instant::now();
    let process = Process::<f64>::new(mission, config.risk, &REWARDS);
    let bounds = Bounds { states: config.states, ..Bounds::default() };
    let explored = explore(&process, &bounds)?;
    memo.costs.process.build = started.elapsed();
    memo.costs.states = explored.mdp.states();
    memo.costs.transitions = explored.mdp.transition_count();
    report(&[], &memo.costs);
    let fastest = first.as_ref().map(|plan| time_of(mission, plan));
    let penalty = config.penalty.unwrap_or_else(|| 10.0 * fastest.unwrap_or(1000.0).max(1.0));
    let referee = Referee { mission, risk: config.risk, penalty, process, explored };
    let mut candidates = Vec::new();
    let started = Instant::now();
    let policies = referee.policies();
    let (front, vertices) = referee.front();
    memo.costs.process.solve = started.elapsed();
    memo.costs.process_memory = (config.memory)();
    let started = Instant::now();
    let decisions: usize = policies.iter().map(|(_, policy)| referee.decisions(policy).len()).sum();
    memo.costs.process.extract = started.elapsed();
    memo.costs.decisions = decisions;
    let mut anticipating = None;
    for (name, policy) in policies.into_iter().chain(vertices) {
        let measures = referee.play_policy(&policy)?;
        candidates.push(Candidate { kind: 'a', name, measures });
        report(&candidates, &memo.costs);
        anticipating.get_or_insert(policy);
    }
    if let Some(plan) = &first {
        let measures = referee.play_plan(plan)?;
        candidates.push(Candidate { kind: 'b', name: "our plan, open loop".to_owned(), measures });
        report(&candidates, &memo.costs);
        let measures = memo.play(&referee)?;
        candidates.push(Candidate { kind: 'c', name: "our plan, re-planning".to_owned(), measures });
        report(&candidates, &memo.costs);
    }
    if let Some(found) = published(mission, config.priority) {
        let measures = referee.play_plan(&found.actions(mission))?;
        candidates.push(Candidate { kind: 'd', name: "published procedure".to_owned(), measures });
        report(&candidates, &memo.costs);
    }
    if let Some(route) = shortest_routes(mission, 1).first()
        && let Some(plan) = best_on_route(mission, route)
    {
        let measures = referee.play_plan(&plan)?;
        let name = "fixed shortest route, best configurations".to_owned();
        candidates.push(Candidate { kind: 'e', name, measures });
        report(&candidates, &memo.costs);
    }
    let loss = match &first {
        Some(plan) if mission.loss.is_some() => {
            Some(hindsight::report(&referee, plan, anticipating.as_deref().unwrap_or_default(), &mut memo)?)
        }
        _ => None,
    };
    let hindsight = [(Spent::Time, penalty), (Spent::Energy, f64::INFINITY)]
        .map(|(spent, penalty)| hindsight::hindsight(mission, config.risk, penalty, spent));
    let no_price = referee.no_price();
    let mut comparison =
        Comparison { candidates, front, hindsight, penalty, no_price, loss, costs: memo.costs };
    // A plan that is best by another metric, or too dear for the rounded battery, has a price all the same.
    let price = comparison.price_of_determinism();
    comparison.no_price = no_price.filter(|_| price.is_some_and(|price| price.abs() <= 1e-9 * penalty));
    Ok(comparison)
}

/// Why a comparison has no result.
#[derive(Debug)]
pub enum Failure {
    /// Of the process.
    Process(Error),
    /// Of the planner.
    Planner(Vec<Message>),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Process(error)
    }
}

impl From<Vec<Message>> for Failure {
    fn from(messages: Vec<Message>) -> Self {
        Self::Planner(messages)
    }
}

/// The time of a plan on which nothing goes wrong.
pub(super) fn time_of(mission: &Coadaptation, plan: &[Action]) -> f64 {
    use probabilistic::Number;
    let (mut configuration, mut time) = (mission.initial, 0.0);
    for action in plan {
        match action {
            Action::Change(new) => {
                time +=
                    mission.switches[configuration][*new].as_ref().map_or(0.0, |switch| switch.time.to_f64());
                configuration = *new;
            }
            Action::Move(arc) => {
                time += mission.arcs[*arc].by[configuration].as_ref().map_or(0.0, |t| t.time.to_f64());
            }
        }
    }
    time
}

/// Plans by situation, each made once. The collision flag does not matter to a plan.
pub(super) struct Memo<'a, 'b> {
    planner: &'a mut Planner<'b>,
    plans: BTreeMap<Situation, Option<Vec<Action>>>,
    pub costs: Costs,
}

impl Memo<'_, '_> {
    /// The plan from a situation.
    pub fn plan(&mut self, situation: &Situation) -> Result<Option<Vec<Action>>, Vec<Message>> {
        let key = Situation { hit: false, ..*situation };
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
    fn play(&mut self, referee: &Referee<'_>) -> Result<Measures, Failure> {
        // What the plan in force wants to do in each state that it expects.
        let mut expected: BTreeMap<Situation, Action> = BTreeMap::new();
        let mut failure = None;
        let unexpected = RefCell::new(BTreeSet::new());
        let mission = referee.mission;
        let mut decide = |state: State, _: u32| {
            let situation = Situation { hit: false, ..state.situation() };
            if situation.failed || situation.place == mission.goal {
                return None;
            }
            if let Some(action) = expected.get(&situation) {
                return Some(action.number());
            }
            match self.plan(&situation) {
                Ok(Some(plan)) => {
                    if situation != Situation::start(mission, referee.risk) {
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
            |state: State| unexpected.borrow().contains(&Situation { hit: false, ..state.situation() });
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
    mut at: Situation,
    plan: &[Action],
    risk: Risk,
    expected: &mut BTreeMap<Situation, Action>,
) {
    for action in plan {
        if expected.contains_key(&at) {
            return;
        }
        expected.insert(at, *action);
        at = after(mission, at, *action, risk);
    }
}

/// The state after an action on which nothing goes wrong.
pub(super) fn after(mission: &Coadaptation, at: Situation, action: Action, risk: Risk) -> Situation {
    let levels = |energy: &BigRational| if risk.battery { mission.levels(energy) } else { 0 };
    match action {
        Action::Change(new) => {
            let energy = mission.switches[at.configuration][new].as_ref().map_or(0, |s| levels(&s.energy));
            Situation { configuration: new, battery: at.battery.saturating_sub(energy), ..at }
        }
        Action::Move(arc) => {
            let arc = &mission.arcs[arc];
            let energy = arc.by[at.configuration].as_ref().map_or(0, |t| levels(&t.energy));
            Situation { place: arc.to, battery: at.battery.saturating_sub(energy), ..at }
        }
    }
}

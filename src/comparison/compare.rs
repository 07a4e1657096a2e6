//! Evaluates all candidates exactly in one Markov decision process: policies computed by model checking, plans
//! with and without replanning, the published procedure, and the shortest route.

use std::collections::BTreeMap;
use std::time::Instant;

use probabilistic::explore::{Bounds, explore};

use crate::comparison::coadaptation::Coadaptation;
use crate::comparison::hindsight::{self, Hindsight, LossReport, Spent};
use crate::comparison::nominal::time_of;
use crate::comparison::planned::{Costs, NoResult, PlanFinder, PlanTable};
use crate::comparison::play::Measures;
use crate::comparison::process::{Process, REWARDS, Risk, Valuation};
use crate::comparison::published::{Priority, published, shortest_routes};
use crate::comparison::referee::Referee;
use crate::comparison::route::best_on_route;

/// Callback that receives the candidates already evaluated, and the computational costs up to now.
pub type Listener<'a> = dyn FnMut(&[Candidate], &Costs) + 'a;

/// Settings of a comparison.
#[derive(Clone)]
pub struct Config<'a> {
    /// Optional parts of the process in which all candidates are evaluated: sources of uncertainty, and the battery.
    pub risk: Risk,
    /// Time added if a mission does not reach the goal. `None` for ten times the time that the first plan takes if
    /// nothing fails (at least 10; 10,000 if there is no plan).
    pub penalty: Option<f64>,
    /// Priority of the published procedure.
    pub priority: Priority,
    /// Maximum number of states of the process.
    pub states: usize,
    /// Returns the peak memory in megabytes since its previous call, if the platform reports it.
    pub memory: &'a dyn Fn() -> Option<u64>,
}

/// A decision rule (policy or plan) with its values.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Kind of the candidate: policy (`a`), plan without (`b`) or with replanning (`c`), published
    /// procedure (`d`), or shortest route (`e`).
    pub kind: char,
    /// Description of the candidate for the table.
    pub name: String,
    /// Exact values of the candidate in the process in which all candidates are evaluated.
    pub measures: Measures,
}

/// Result of a comparison: the evaluated candidates, bounds and costs.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Comparison {
    /// The evaluated decision rules.
    pub candidates: Vec<Candidate>,
    /// Vertices of the Pareto front, each with expected time and probability of success without
    /// collision. Only vertices with a finite time are included.
    pub front: Vec<[f64; 2]>,
    /// Lower bounds on the time and on the energy that any decision rule needs to reach the goal, even a
    /// clairvoyant one.
    pub hindsight: [Hindsight; 2],
    /// Time added if a mission does not reach the goal.
    pub penalty: f64,
    /// Reason why the plan with replanning cannot be worse than the best policy, if this follows without
    /// computation. `None` also if the computed price of determinism is not 0.
    pub no_price: Option<&'static str>,
    /// Total times if the component is lost, for each number of moves before the loss. `None` if the mission
    /// defines no loss or has no plan.
    pub loss: Option<LossReport>,
    /// Computational costs of model checking and of planning.
    pub costs: Costs,
}

impl Comparison {
    fn penalised(&self, kind: char) -> Option<f64> {
        self.candidates.iter().find(|candidate| candidate.kind == kind)?.measures.penalised_time
    }

    /// Returns the price of determinism: the penalised time of the plan with replanning minus that of the best
    /// policy. Returns `None` if one of these times is missing or infinite.
    pub fn price_of_determinism(&self) -> Option<f64> {
        Some(self.penalised('c')? - self.penalised('a')?)
    }

    /// Returns the price of the open loop: the penalised time of the plan without replanning minus that of the best
    /// policy. Returns `None` if one of these times is missing or infinite.
    pub fn price_of_open_loop(&self) -> Option<f64> {
        Some(self.penalised('b')? - self.penalised('a')?)
    }

    /// Returns the penalised time that replanning saves. Returns `None` if the penalised time with or without
    /// replanning is missing or infinite.
    pub fn value_of_replanning(&self) -> Option<f64> {
        Some(self.penalised('b')? - self.penalised('c')?)
    }
}

/// Evaluates and compares all candidates. `planner` is called for the start, and once for each other state that needs
/// a new plan. `report` is called after the first plan, after the exploration of the process, and after each
/// candidate.
///
/// # Errors
/// Errors of the planner, or the process has too many states or cannot be solved.
pub fn compare(
    mission: &Coadaptation,
    config: &Config<'_>,
    planner: &mut PlanFinder<'_>,
    report: &mut Listener<'_>,
) -> Result<Comparison, NoResult> {
    // The first call resets the peak memory. The planner runs before the process is built, so that its peak
    // does not include the memory of the process.
    (config.memory)();
    let mut memo = PlanTable { planner, plans: BTreeMap::new(), costs: Costs::default() };
    let first = memo.plan(&Valuation::start(mission, config.risk))?;
    memo.costs.plan_memory = (config.memory)();
    report(&[], &memo.costs);
    let started = Instant::now();
    let process = Process::<f64>::new(mission, config.risk, &REWARDS);
    let bounds = Bounds::default().with_states(config.states);
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
    // A plan that minimises another metric, or that exceeds the rounded battery, has a price even
    // in a deterministic process.
    let price = comparison.price_of_determinism();
    comparison.no_price = no_price.filter(|_| price.is_some_and(|price| price.abs() <= 1e-9 * penalty));
    Ok(comparison)
}

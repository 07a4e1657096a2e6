//! From a ground task to a cheapest plan, and to the reason why there is no cheaper one.
//!
//! A quick search yields a first plan. Then the formula "a plan of at most B steps that costs less" is tightened until it is
//! unsatisfiable, where B is the step bound: by dynamic programming over projections, no plan with more steps is cheaper than the
//! best known. Only then is the answer called optimal. Where no step bound exists (free cycles), the search's own
//! exhaustion may serve; otherwise the answer is a plan that is not proved optimal.

use std::time::Instant;

use crate::bounds::Bounds;
use crate::encode::{CostLimit, Encoding, Semantics};
use crate::limits::Limits;
use crate::plan::{GroundPlan, GroundStep, decode, metric, replay};
use crate::quantity::Quantity;
use crate::sat::{Answer, Backend};
use crate::search::{Found, search};
use crate::solution::{Improvement, Proof, Solution, Statistics, Status, Unbounded};
use crate::task::Task;
use crate::ties;

/// Formulas with more operator variables than this are not built.
const FORMULA_LIMIT: usize = 30_000_000;
/// What the quick search has proved, the SAT solver may spend this many conflicts on proving again…
const CONFIRM_CONFLICTS: u64 = 1_000;
/// … if the formula has at most this many operator variables.
const CONFIRM_SIZE: usize = 5_000;
/// Formulas with at most this many operator variables are solved once more without the help of bounds.
const CONFIRM_LIMIT: usize = 400;

/// What the user asks of the optimizer.
#[derive(Debug, Clone)]
pub struct Config {
    /// Only plans with at most this many steps count.
    pub horizon: Option<usize>,
    /// Whether a quick search looks for a first plan; otherwise the SAT solver finds it, horizon by horizon.
    pub quick_search: bool,
    /// How many operators stand at a step of the formulas; with a horizon, which counts actions, always one. If not
    /// given, several while a first plan is looked for, and one for the proof that there is no cheaper one.
    pub semantics: Option<Semantics>,
    /// The SAT solver.
    pub backend: Backend,
    /// When to stop.
    pub limits: Limits,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            horizon: None,
            quick_search: true,
            semantics: None,
            backend: Backend::default(),
            limits: Limits::none(),
        }
    }
}

/// Finds a cheapest plan; `report` hears of every improvement.
pub fn optimize(task: &Task, config: &Config, report: &mut dyn FnMut(Improvement)) -> Solution {
    let mut run = Run { task, config, report, statistics: Statistics::default(), bounds: None };
    run.statistics.operators = task.operators.len();
    if let Some(reason) = &task.unreachable {
        return run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Relaxation(reason.clone())));
    }
    if task.operators.iter().any(|operator| operator.cost.minimum() < 0) {
        return run.bounded_reading();
    }
    run.solve()
}

struct Run<'a> {
    task: &'a Task,
    config: &'a Config,
    report: &'a mut dyn FnMut(Improvement),
    statistics: Statistics,
    bounds: Option<Bounds>,
}

/// What tightening the cost limit came to.
enum Tightened {
    /// No plan within the formula's steps is cheaper than the incumbent.
    Exhausted,
    /// A limit was reached.
    Interrupted,
}

impl Run<'_> {
    fn finish(
        self,
        status: Status,
        plan: Option<&GroundPlan>,
        lower: Option<i64>,
        horizon: usize,
        proof: Option<Proof>,
    ) -> Solution {
        Solution {
            status,
            plan: plan.map(|plan| decode(self.task, plan)),
            ground: plan.cloned(),
            lower_bound: lower.map(|lower| metric(self.task, lower)),
            horizon,
            proof,
            unbounded: None,
            statistics: self.statistics,
        }
    }

    fn solve(mut self) -> Solution {
        let started = Instant::now();
        let bounds = Bounds::new(self.task, &self.config.limits);
        let Some(lower) = bounds.estimate(&self.task.initial) else {
            let reason =
                "no path leads to the goal in a projection of the task to one or two of its variables";
            return self.finish(Status::Unsolvable, None, None, 0, Some(Proof::Relaxation(reason.into())));
        };
        let found = if self.config.quick_search {
            search(self.task, &bounds, &self.config.limits)
        } else {
            Found::Unknown(None)
        };
        self.statistics.search = started.elapsed();
        let within =
            |plan: &GroundPlan| self.config.horizon.is_none_or(|horizon| plan.steps.len() <= horizon);
        let (incumbent, exact) = match found {
            Found::None => return self.finish(Status::Unsolvable, None, None, 0, Some(Proof::Search)),
            Found::Optimal(plan) if within(&plan) => {
                (Some(ties::choose(self.task, &bounds, &self.config.limits, plan)), true)
            }
            Found::Unknown(Some(plan)) if within(&plan) => (Some(plan), false),
            Found::Optimal(_) | Found::Unknown(_) => (None, false),
        };
        let incumbent = match incumbent {
            Some(plan) => plan,
            None => match self.first_plan(&bounds) {
                Ok(plan) => plan,
                Err(solution) => return *solution,
            },
        };
        self.bounds = Some(bounds);
        self.improve(incumbent, lower, exact)
    }

    /// Improves a first plan to a cheapest one. `exact` says that the search has proved it cheapest already.
    fn improve(mut self, mut incumbent: GroundPlan, lower: i64, exact: bool) -> Solution {
        let Some(bounds) = self.bounds.take() else {
            return self.finish(Status::Feasible, Some(&incumbent), None, 0, None);
        };
        self.announce(&incumbent, lower, incumbent.steps.len());
        if incumbent.cost <= lower {
            let proof = self.confirm(&incumbent).unwrap_or(Proof::Bound);
            return self.conclude(&incumbent, lower, 0, Some(proof));
        }
        let window = bounds.window(self.task, Some(incumbent.cost - 1), self.config.horizon);
        let bound = window.steps;
        let allowed = if bound.is_some() {
            window.allowed
        } else {
            // Without a step bound longer plans are worth a try, though they prove nothing.
            let longer = self.config.horizon.unwrap_or(2 * incumbent.steps.len() + 4);
            bounds.window(self.task, Some(incumbent.cost - 1), Some(longer)).allowed
        };
        let horizon = allowed.len();
        let complete = bound.is_some_and(|bound| bound <= horizon);
        let (unproved, budget) =
            if exact { (Some(Proof::Search), CONFIRM_CONFLICTS) } else { (None, u64::MAX) };
        let size: usize = allowed.iter().map(|row| row.iter().filter(|flag| **flag).count()).sum();
        if size > if exact { CONFIRM_SIZE } else { FORMULA_LIMIT } {
            return self.conclude(&incumbent, lower, horizon, unproved);
        }
        let tightened = self.tighten(&bounds, &allowed, &mut incumbent, lower, budget);
        let proof = match (tightened, bound) {
            (Tightened::Exhausted, Some(step_bound)) if complete => Some(Proof::Sat { step_bound }),
            _ => unproved,
        };
        self.conclude(&incumbent, lower, horizon, proof)
    }

    /// That a plan's cost equals a lower bound is proof enough. On small tasks the SAT solver has to find the same on
    /// a formula that knows nothing of bounds, with as many steps as the cheapest operator allows.
    fn confirm(&mut self, incumbent: &GroundPlan) -> Option<Proof> {
        let cheapest =
            self.task.operators.iter().map(|operator| operator.cost.minimum()).min().filter(|c| *c > 0)?;
        let limit = incumbent.cost - 1;
        let steps = usize::try_from(limit / cheapest).ok()?;
        if steps.saturating_mul(self.task.operators.len()) > CONFIRM_LIMIT {
            return None;
        }
        let started = Instant::now();
        let allowed = vec![vec![true; self.task.operators.len()]; steps];
        let bounds = Bounds::trivial(self.task);
        let cost = CostLimit { limit, bounds: &bounds };
        let encoding = Encoding::new(
            self.task,
            &allowed,
            Some(cost),
            self.semantics(Semantics::Sequential),
            &self.config.limits,
        );
        self.statistics.encode += started.elapsed();
        let (answer, _) = self.call(&encoding?, u64::MAX);
        debug_assert_ne!(answer, Answer::Satisfiable, "a plan is cheaper than the lower bound");
        (answer == Answer::Unsatisfiable).then_some(Proof::Sat { step_bound: steps })
    }

    fn conclude(self, incumbent: &GroundPlan, lower: i64, horizon: usize, proof: Option<Proof>) -> Solution {
        let horizon = horizon.max(incumbent.steps.len());
        match proof {
            Some(proof) => {
                self.finish(Status::Optimal, Some(incumbent), Some(incumbent.cost), horizon, Some(proof))
            }
            None => self.finish(Status::Feasible, Some(incumbent), Some(lower), horizon, None),
        }
    }

    fn semantics(&self, unless_given: Semantics) -> Semantics {
        match self.config.horizon {
            Some(_) => Semantics::Sequential,
            None => self.config.semantics.unwrap_or(unless_given),
        }
    }

    fn announce(&mut self, plan: &GroundPlan, lower: i64, horizon: usize) {
        let improvement = Improvement {
            cost: metric(self.task, plan.cost),
            lower_bound: metric(self.task, lower),
            horizon,
        };
        (self.report)(improvement);
    }

    /// Asks for cheaper and cheaper plans until there is none.
    fn tighten(
        &mut self,
        bounds: &Bounds,
        allowed: &[Vec<bool>],
        incumbent: &mut GroundPlan,
        lower: i64,
        budget: u64,
    ) -> Tightened {
        let started = Instant::now();
        let limit = CostLimit { limit: incumbent.cost - 1, bounds };
        let encoding = Encoding::new(
            self.task,
            allowed,
            Some(limit),
            self.semantics(Semantics::Sequential),
            &self.config.limits,
        );
        self.statistics.encode += started.elapsed();
        let Some(mut encoding) = encoding else { return Tightened::Interrupted };
        loop {
            let better = match self.call(&encoding, budget) {
                (Answer::Unsatisfiable, _) => return Tightened::Exhausted,
                (_, None) => return Tightened::Interrupted,
                (_, Some(better)) => better,
            };
            *incumbent = better;
            self.announce(incumbent, lower, allowed.len());
            encoding.tighten(incumbent.cost - 1);
        }
    }

    /// A plan of the solver, replayed. That it is applicable is what the encoding is for; that it is, is checked.
    fn check(&self, steps: Vec<GroundStep>) -> Option<GroundPlan> {
        let replayed = replay(self.task, &steps);
        debug_assert!(replayed.is_some(), "the encoding admits a sequence that is no plan");
        let (_, cost) = replayed?;
        Some(GroundPlan { steps, cost })
    }

    /// Solves a formula; a plan comes with the answer that it is satisfiable.
    fn call(&mut self, encoding: &Encoding<'_>, budget: u64) -> (Answer, Option<GroundPlan>) {
        let started = Instant::now();
        let formula = &encoding.formula;
        let mut solver = self.config.backend.start(&self.config.limits, budget);
        for (_, clause) in formula.clauses() {
            solver.add_clause(clause);
        }
        if formula.variables() >= self.statistics.variables {
            self.statistics.variables = formula.variables();
            self.statistics.clauses = formula.len();
            self.statistics.families = formula.counts();
        }
        let answer = solver.solve();
        self.statistics.calls += 1;
        self.statistics.conflicts += solver.conflicts();
        if let Some(reason) = solver.failure() {
            self.statistics.failure = Some(reason.to_owned());
        }
        self.statistics.solve += started.elapsed();
        let plan =
            if answer == Answer::Satisfiable { self.check(encoding.decode(solver.as_ref())) } else { None };
        (answer, plan)
    }

    /// Any plan, with few steps: longer and longer formulas without a cost limit.
    fn first_plan(&mut self, bounds: &Bounds) -> Result<GroundPlan, Box<Solution>> {
        let most = self.config.horizon.unwrap_or(usize::MAX).min(self.states().map_or(usize::MAX, |n| n - 1));
        let mut horizon = 0;
        loop {
            let started = Instant::now();
            let window = bounds.window(self.task, None, Some(horizon));
            let encoding = Encoding::new(
                self.task,
                &window.allowed,
                None,
                self.semantics(Semantics::ExistsStep),
                &self.config.limits,
            );
            self.statistics.encode += started.elapsed();
            let answer =
                encoding.map_or((Answer::Interrupted, None), |encoding| self.call(&encoding, u64::MAX));
            match answer {
                (_, Some(plan)) => return Ok(plan),
                (Answer::Unsatisfiable, None) if horizon < most => {
                    horizon = (horizon + 1 + horizon / 4).min(most);
                    if horizon.saturating_mul(self.task.operators.len()) <= FORMULA_LIMIT {
                        continue;
                    }
                    return Err(Box::new(self.without_plan(Status::Unknown, horizon, None)));
                }
                (Answer::Unsatisfiable, None) => {
                    let bounded = self.states().is_some_and(|states| horizon + 1 >= states);
                    let solution = if bounded {
                        self.without_plan(
                            Status::Unsolvable,
                            horizon,
                            Some(Proof::Sat { step_bound: horizon }),
                        )
                    } else {
                        self.without_plan(Status::UnsolvableWithinHorizon, horizon, None)
                    };
                    return Err(Box::new(solution));
                }
                (Answer::Satisfiable | Answer::Interrupted, None) => {
                    return Err(Box::new(self.without_plan(Status::Unknown, horizon, None)));
                }
            }
        }
    }

    fn without_plan(&self, status: Status, horizon: usize, proof: Option<Proof>) -> Solution {
        Solution {
            status,
            plan: None,
            ground: None,
            lower_bound: None,
            horizon,
            proof,
            unbounded: None,
            statistics: self.statistics.clone(),
        }
    }

    /// How many states the task has at most, if that is few: a shortest plan visits none twice.
    fn states(&self) -> Option<usize> {
        if !self.task.initial.numbers.is_empty() {
            return None;
        }
        let sizes = self.task.variables[..self.task.basic].iter().map(|variable| variable.values.len());
        sizes.into_iter().try_fold(1_usize, usize::checked_mul)
    }

    /// For a metric that actions improve: fewest steps first, then the best metric among those plans.
    fn bounded_reading(self) -> Solution {
        let lowest = self.task.operators.iter().map(|operator| operator.cost.minimum()).min().unwrap_or(0);
        let by_steps = self.task.with_costs(|_| Quantity::constant(1));
        let mut silent = |_: Improvement| {};
        let shortest = optimize(&by_steps, self.config, &mut silent);
        let steps = match (&shortest.plan, shortest.status) {
            (Some(plan), Status::Optimal) => plan.steps.len(),
            // The plan that there may be is measured by its steps, not by the metric: of no use to the user.
            (Some(_), _) => {
                return Solution {
                    status: Status::Unknown,
                    plan: None,
                    ground: None,
                    lower_bound: None,
                    ..shortest
                };
            }
            (None, _) => return Solution { lower_bound: None, ..shortest },
        };
        // Every plan of the task with this horizon has exactly this many steps, so a constant for each step
        // changes nothing but the sign of the costs.
        let shifted = self.task.with_costs(|operator| {
            let mut cost = operator.cost.clone();
            cost.constant -= lowest;
            cost
        });
        let config = Config { horizon: Some(steps), ..self.config.clone() };
        let mut run = Run {
            task: &shifted,
            config: &config,
            report: &mut silent,
            statistics: self.statistics,
            bounds: None,
        };
        let bounds = Bounds::new(&shifted, &self.config.limits);
        let mut plan = match run.first_plan(&bounds) {
            Ok(plan) => plan,
            Err(solution) => return *solution,
        };
        let allowed = bounds.window(&shifted, Some(plan.cost - 1), Some(steps));
        let mut rows = allowed.allowed;
        rows.truncate(steps);
        let tightened = run.tighten(&bounds, &rows, &mut plan, 0, u64::MAX);
        let proof = matches!(tightened, Tightened::Exhausted).then_some(Proof::Sat { step_bound: steps });
        let statistics = run.statistics;
        plan.cost += lowest * steps as i64;
        let unbounded =
            if self.task.can_repeat_reward(&plan.steps) { Unbounded::Proved } else { Unbounded::Suspected };
        Solution {
            status: Status::Feasible,
            plan: Some(decode(self.task, &plan)),
            ground: Some(plan),
            lower_bound: None,
            horizon: steps,
            proof,
            unbounded: Some(unbounded),
            statistics,
        }
    }
}

impl Task {
    /// The same task with other costs, and a metric of their plain sum.
    fn with_costs(&self, cost: impl Fn(&crate::task::Operator) -> Quantity<i64>) -> Self {
        let mut task = self.clone();
        for operator in &mut task.operators {
            operator.cost = cost(operator);
        }
        task.objective = crate::task::Objective::sum();
        task
    }

    /// Whether some action that improves the metric is applicable in a state on the way, and leaves it as it is.
    fn can_repeat_reward(&self, plan: &[GroundStep]) -> bool {
        let Some((states, _)) = replay(self, plan) else { return false };
        states.iter().any(|state| {
            self.operators.iter().filter(|operator| operator.cost.minimum() < 0).any(|operator| {
                operator.choices().any(|choice| {
                    operator.cost.at(&choice, &operator.sizes()) < 0
                        && operator.applicable(state, &choice)
                        && self.successor(operator, state, &choice) == *state
                })
            })
        })
    }
}

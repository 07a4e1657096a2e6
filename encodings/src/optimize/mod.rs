//! From a ground task to a cheapest plan, and to the reason why there is no cheaper one.
//!
//! A quick search yields a first plan. Then come formulas "a plan of at most B steps that costs at most L", where B is the step
//! bound for L: by dynamic programming over projections, no plan that costs so little has more steps. L begins near the lower bound,
//! because the formula is small there, and what is unsatisfiable raises that bound; a formula that has a plan yields a cheapest
//! one, by one of two strategies. Only then is the answer called optimal. Where no step bound exists (free cycles), the search's own
//! exhaustion may serve; otherwise the answer is a plan that is not proved optimal.

mod bounded;
mod cores;
#[cfg(test)]
mod tests;
mod tighten;

use std::cell::OnceCell;
use std::time::Instant;

use crate::bounds::Bounds;
use crate::encode::{CostLimit, Counting, Encoding, Semantics, Symmetry};
use crate::ground_plan::GroundPlan;
use crate::limits::{Interrupted, Limits};
use crate::number::Int;
use crate::plan::{decode, metric};
use crate::sat::{Answer, Backend};
use crate::search::{Found, search};
use crate::solution::{Improvement, Proof, Solution, Statistics, Status};
use crate::task::Task;
use crate::ties;

/// Formulas with more operator variables than this are not built.
const FORMULA_LIMIT: usize = 30_000_000;
/// What the quick search has proved, the SAT solver may spend this many conflicts on proving again…
const CONFIRM_CONFLICTS: u64 = 1_000;
/// … if the formula has at most this many operator variables.
const CONFIRM_SIZE: usize = 5_000;
/// The first formula is for plans within this part of the gap between the lower bound and the best plan known; each further one
/// for twice as much of it.
const STAGES: Int = 8;
/// Formulas with at most this many operator variables are solved once more without the help of bounds.
const CONFIRM_LIMIT: usize = 400;
/// Costs from here on, as products of decimals have them once they are integers, make no formula small.
const CONFIRM_COST: Int = 1 << 64;

/// How the SAT solver is made to find a cheapest plan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Strategy {
    /// The one that is faster in general.
    #[default]
    Auto,
    /// Cheaper and cheaper plans, until there is none.
    Tighten,
    /// A lower bound that rises with each contradiction among assumptions about what a plan does not pay, until a plan costs as
    /// much. Where the number of steps of a cheapest plan has no bound, it is as `Tighten`.
    Cores,
}

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
    /// How the SAT solver is made to find a cheapest plan.
    pub strategy: Strategy,
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
            strategy: Strategy::default(),
            backend: Backend::default(),
            limits: Limits::none(),
        }
    }
}

/// Finds a cheapest plan; `report` hears of every improvement.
pub fn optimize(task: &Task, config: &Config, report: &mut dyn FnMut(Improvement)) -> Solution {
    let mut run = Run {
        task,
        config,
        report,
        statistics: Statistics::default(),
        bounds: None,
        symmetry: OnceCell::new(),
    };
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
    /// Found out when it is first needed.
    symmetry: OnceCell<Symmetry>,
}

/// What is known of the cheapest plan.
struct Best {
    /// The cheapest so far.
    plan: GroundPlan,
    /// No plan is cheaper than this.
    lower: Int,
}

/// What a formula covers.
struct Extent {
    /// Plans that cost at most so much.
    limit: Int,
    /// For each step, whether each operator can be there.
    allowed: Vec<Vec<bool>>,
    /// That no such plan has more steps is known.
    step_bound: Option<usize>,
}

impl Extent {
    /// How many operator variables the formula has.
    fn size(&self) -> usize {
        self.allowed.iter().map(|row| row.iter().filter(|flag| **flag).count()).sum()
    }
}

/// What a strategy came to within a formula.
enum Tightened {
    /// None of its plans within its limit is cheaper than the best one.
    Exhausted,
    /// A limit was reached.
    Interrupted,
}

impl<'a> Run<'a> {
    /// Notes that two parts of the planner contradict each other. It fails loudly where that is tested.
    fn contradicted(&mut self, what: &str) {
        debug_assert!(false, "{what}");
        self.statistics.contradiction = Some(what.to_owned());
    }

    fn finish(
        self,
        status: Status,
        plan: Option<&GroundPlan>,
        lower: Option<Int>,
        horizon: usize,
        proof: Option<Proof>,
    ) -> Solution {
        let doubtful = self.statistics.contradiction.is_some();
        let status = match status {
            Status::Optimal if doubtful => Status::Feasible,
            Status::Unsolvable if doubtful => Status::Unknown,
            other => other,
        };
        let (lower, proof) = if doubtful { (None, None) } else { (lower, proof) };
        let mut statistics = self.statistics;
        if matches!(proof, Some(Proof::Bound | Proof::Search | Proof::Relaxation(_))) {
            statistics.unchecked = None;
        }
        Solution {
            status,
            plan: plan.map(|plan| decode(self.task, plan, &self.config.limits)),
            ground: plan.cloned(),
            lower_bound: lower.map(|lower| metric(self.task, &lower)),
            horizon,
            proof,
            unbounded: None,
            statistics,
        }
    }

    fn solve(mut self) -> Solution {
        let started = Instant::now();
        let Ok(bounds) = Bounds::new(self.task, &self.config.limits) else {
            return self.finish(Status::Unknown, None, None, 0, None);
        };
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
    fn improve(mut self, incumbent: GroundPlan, lower: Int, exact: bool) -> Solution {
        let mut best = Best { plan: incumbent, lower };
        let Some(bounds) = self.bounds.take() else {
            return self.finish(Status::Feasible, Some(&best.plan), None, 0, None);
        };
        self.announce(&best, best.plan.steps.len());
        if best.plan.cost <= lower {
            let proof = self.confirm(&best.plan).unwrap_or(Proof::Bound);
            return self.conclude(&best, 0, Some(proof));
        }
        let unproved = exact.then_some(Proof::Search);
        let mut stage = if exact { Int::MAX } else { best.plan.cost.saturating_sub(lower) / STAGES };
        loop {
            let limit = best.plan.below().min(lower.saturating_add(stage));
            let Ok(extent) = self.extent(&bounds, limit, &best) else {
                return self.conclude(&best, 0, unproved);
            };
            let horizon = extent.allowed.len();
            if extent.step_bound.is_none() && stage < Int::MAX {
                // That there is no such plan would prove nothing.
                stage = Int::MAX;
                continue;
            }
            let is_small = extent.size() <= CONFIRM_SIZE && limit < CONFIRM_COST;
            if exact && !is_small || extent.size() > FORMULA_LIMIT {
                return self.conclude(&best, horizon, unproved);
            }
            let tightened = self.within(&bounds, &extent, &mut best, exact);
            if exact && best.plan.cost <= limit {
                self.contradicted("a formula has a cheaper plan than the one that the search calls cheapest");
            }
            match (tightened, extent.step_bound) {
                (Tightened::Exhausted, Some(step_bound)) => {
                    best.lower = best.plan.cost.min(limit.saturating_add(1));
                    if best.lower == best.plan.cost {
                        // What the search has proved does not come to rest on the word of a program.
                        let proof = unproved.filter(|_| self.statistics.unchecked.is_some());
                        let proof = proof.unwrap_or(Proof::Sat { step_bound });
                        return self.conclude(&best, horizon, Some(proof));
                    }
                    self.announce(&best, horizon);
                    stage = stage.saturating_mul(2).max(1);
                }
                _ => return self.conclude(&best, horizon, unproved),
            }
        }
    }

    /// Decides whether there is a plan that costs at most the limit of an extent, and finds a cheapest one.
    fn within(&mut self, bounds: &Bounds, extent: &Extent, best: &mut Best, exact: bool) -> Tightened {
        let cores = !exact && extent.step_bound.is_some() && self.config.strategy == Strategy::Cores;
        let started = Instant::now();
        let counting = if cores { Counting::Apart } else { Counting::Sum };
        let cost = CostLimit { limit: extent.limit, bounds, counting };
        let semantics = self.semantics(Semantics::Sequential);
        let encoding = self.encoding(&extent.allowed, Some(cost), semantics);
        self.statistics.encode = self.statistics.encode.saturating_add(started.elapsed());
        let Some(encoding) = encoding else { return Tightened::Interrupted };
        if cores {
            self.raise(encoding, extent.limit, best)
        } else {
            self.tighten(encoding, best, if exact { CONFIRM_CONFLICTS } else { u64::MAX })
        }
    }

    /// None if a limit was reached.
    fn encoding(
        &self,
        allowed: &[Vec<bool>],
        cost: Option<CostLimit<'_>>,
        semantics: Semantics,
    ) -> Option<Encoding<'a>> {
        Encoding::new(self.task, allowed, cost, semantics, &self.symmetry, &self.config.limits)
    }

    /// What plans that cost at most so much can look like.
    fn extent(&self, bounds: &Bounds, limit: Int, best: &Best) -> Result<Extent, Interrupted> {
        let limits = &self.config.limits;
        let window = bounds.window(self.task, Some(limit), self.config.horizon, limits)?;
        let complete = |steps: &usize| *steps <= window.allowed.len();
        let step_bound = window.steps.filter(complete);
        let allowed = if window.steps.is_some() {
            window.allowed
        } else {
            // Without a step bound longer plans are worth a try, though they prove nothing.
            let longer = self
                .config
                .horizon
                .unwrap_or_else(|| best.plan.steps.len().saturating_mul(2).saturating_add(4));
            bounds.window(self.task, Some(limit), Some(longer), limits)?.allowed
        };
        Ok(Extent { limit, allowed, step_bound })
    }

    /// That a plan's cost equals a lower bound is proof enough. On small tasks the SAT solver has to find the same on
    /// a formula that knows nothing of bounds, with as many steps as the cheapest operator allows.
    fn confirm(&mut self, incumbent: &GroundPlan) -> Option<Proof> {
        let cheapest =
            self.task.operators.iter().map(|operator| operator.cost.minimum()).min().filter(|c| *c > 0)?;
        let limit = incumbent.below();
        let steps = usize::try_from(limit.checked_div(cheapest)?).ok()?;
        if steps.saturating_mul(self.task.operators.len()) > CONFIRM_LIMIT || limit >= CONFIRM_COST {
            return None;
        }
        let started = Instant::now();
        let allowed = vec![vec![true; self.task.operators.len()]; steps];
        let bounds = Bounds::trivial(self.task, &self.config.limits).ok()?;
        let cost = CostLimit { limit, bounds: &bounds, counting: Counting::Sum };
        let encoding = self.encoding(&allowed, Some(cost), self.semantics(Semantics::Sequential));
        self.statistics.encode = self.statistics.encode.saturating_add(started.elapsed());
        let mut live = self.live(u64::MAX);
        let (answer, _) = self.call(&mut live, &encoding?, &[]);
        if answer == Answer::Satisfiable {
            self.contradicted("a formula has a plan that is cheaper than the lower bound");
        }
        let is_confirmed = answer == Answer::Unsatisfiable && self.statistics.unchecked.is_none();
        is_confirmed.then_some(Proof::Sat { step_bound: steps })
    }

    fn conclude(self, best: &Best, horizon: usize, proof: Option<Proof>) -> Solution {
        let horizon = horizon.max(best.plan.steps.len());
        let plan = Some(&best.plan);
        match proof {
            Some(proof) => self.finish(Status::Optimal, plan, Some(best.plan.cost), horizon, Some(proof)),
            None => self.finish(Status::Feasible, plan, Some(best.lower), horizon, None),
        }
    }

    fn semantics(&self, unless_given: Semantics) -> Semantics {
        match self.config.horizon {
            Some(_) => Semantics::Sequential,
            None => self.config.semantics.unwrap_or(unless_given),
        }
    }

    fn announce(&mut self, best: &Best, horizon: usize) {
        let improvement = Improvement {
            cost: metric(self.task, &best.plan.cost),
            lower_bound: metric(self.task, &best.lower),
            horizon,
        };
        (self.report)(improvement);
    }

    /// Any plan, with few steps: longer and longer formulas without a cost limit.
    fn first_plan(&mut self, bounds: &Bounds) -> Result<GroundPlan, Box<Solution>> {
        let most = self
            .config
            .horizon
            .unwrap_or(usize::MAX)
            .min(self.states().map_or(usize::MAX, |n| n.saturating_sub(1)));
        let mut horizon = 0;
        loop {
            let started = Instant::now();
            let window = bounds.window(self.task, None, Some(horizon), &self.config.limits);
            let encoding = window.ok().and_then(|window| {
                self.encoding(&window.allowed, None, self.semantics(Semantics::ExistsStep))
            });
            self.statistics.encode = self.statistics.encode.saturating_add(started.elapsed());
            let answer = encoding.map_or((Answer::Interrupted, None), |encoding| {
                let mut live = self.live(u64::MAX);
                self.call(&mut live, &encoding, &[])
            });
            match answer {
                (_, Some(plan)) => return Ok(plan),
                (Answer::Unsatisfiable, None) if horizon < most => {
                    horizon = horizon.saturating_add(1).saturating_add(horizon / 4).min(most);
                    if horizon.saturating_mul(self.task.operators.len()) <= FORMULA_LIMIT {
                        continue;
                    }
                    return Err(Box::new(self.without_plan(Status::Unknown, horizon, None)));
                }
                (Answer::Unsatisfiable, None) => {
                    let bounded = self.states().is_some_and(|states| horizon.saturating_add(1) >= states);
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
}

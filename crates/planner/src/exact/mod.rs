//! Planning with exact rationals, for tasks whose numbers do not fit fixed-size integers.
//!
//! If an action multiplies a number by one half, no scale makes all numbers integers. The common denominator
//! of many measured numbers can exceed any machine integer. So the search computes with rationals. Its
//! heuristics ignore numeric variables and use scaled costs rounded down to integers, so they stay admissible.

mod integer_scaling;

use std::time::Instant;

use num_bigint::BigInt;
use num_integer::Integer;
use num_rational::BigRational;
use num_traits::{One, ToPrimitive, Zero};
use search::bounds::Bounds;
use search::search::{Heuristic, SearchOutcome, search_states};
use task::context::Context;
use task::error::Errors;
use task::ground::{Generality, GroundConfig, ground_for};
use task::limits::Interrupted;
use task::number::{Int, Rational, dense};
use task::plan::ground::{GroundPlan, cost};
use task::plan::solution::{MetricUnbounded, Proof, Solution, Statistics, Status};
use task::plan::{Plan, decode, metric};
use task::task::quantity::{Linear, NumericId, Quantity};
use task::task::timing::Timing;
use task::task::{Condition, NumericEffect, Objective, Operator, State, Task};

use crate::exact::integer_scaling::Integral;
use crate::optimize::hidden_steps::{with_evaluations, without_hidden_steps};
use crate::optimize::{Config, can_repeat_reward};
use pddl::ast::{Domain, Problem};

const STATE_LIMIT: usize = 2_000_000;
const COST_BITS: u64 = 90;

/// A ground task with exact rational numbers.
#[derive(Debug, Clone)]
pub struct ExactTask(pub Task<Rational>);

/// Grounds a domain and a problem that have passed `pddl::check`, with rational numbers of any size. Plan
/// such a task with [`optimize_exact`]. If [`task::ground`] also accepts the task, planning with its result is
/// faster and supports more kinds of proofs.
///
/// # Errors
/// Returns unsupported constructs with their source locations (of each action schema at least the first one), or an
/// error if a number of the metric has no initial value or a limit is reached.
pub fn ground_exact(domain: &Domain, problem: &Problem, config: &GroundConfig) -> Result<ExactTask, Errors> {
    ground_for(domain, problem, config, &Generality::default()).map(ExactTask)
}

impl ExactTask {
    /// Returns `true` if the costs are durations, and `false` if they count actions. Only meaningful for a problem
    /// without metric.
    pub fn is_timed(&self) -> bool {
        self.0.is_measured_by_time(&Rational::one())
    }
}

/// Finds a cheapest plan by heuristic search, or the best plan known at a limit. Of the configuration, only
/// the horizon and the limits are used.
///
/// If a cheapest plan is longer than the horizon, the result is a best plan within the horizon, if there is
/// one; its status is not optimal. If actions can improve the metric, the result is a plan with the fewest
/// steps, and the best metric among these plans.
pub fn optimize_exact(task: &ExactTask, config: &Config) -> Solution {
    let started = Instant::now();
    let task = &task.0;
    let config = &with_evaluations(task, config);
    let mut solution = match &task.unreachable {
        Some(reason) => answer(Status::Unsolvable, None, Some(Proof::Relaxation(reason.clone()))),
        None if task.operators.iter().any(|operator| operator.cost.minimum().is_negative()) => {
            fewest_steps(task, config)
        }
        None => cheapest(task, config),
    };
    solution.statistics.operators = task.operators.len();
    solution.statistics.search = started.elapsed();
    without_hidden_steps(task, solution)
}

fn cheapest(task: &Task<Rational>, config: &Config) -> Solution {
    let context = Context::new(task, &config.limits);
    let outcome = explore(context);
    let show = |plan: &GroundPlan<Rational>| decode(context, plan);
    let too_long =
        |plan: &GroundPlan<Rational>| config.horizon.is_some_and(|horizon| plan.steps.len() > horizon);
    match (outcome, config.horizon) {
        (ExactOutcome::Known(solution), _) => *solution,
        (ExactOutcome::Optimal(plan), _) if !too_long(&plan) => {
            let lower = Some(metric(task, &plan.cost));
            let solution = answer(Status::Optimal, Some(show(&plan)), Some(Proof::Search));
            Solution { lower_bound: lower, horizon: plan.steps.len(), ..solution }
        }
        (ExactOutcome::Optimal(plan), Some(horizon)) => within(context, horizon, None, &plan.cost),
        (ExactOutcome::Unknown(plan, lower), Some(horizon)) => {
            within(context, horizon, plan.filter(|plan| !too_long(plan)), &lower)
        }
        (ExactOutcome::Optimal(plan), None) => answer(Status::Feasible, Some(show(&plan)), None),
        (ExactOutcome::Unknown(plan, lower), None) => {
            let status = if plan.is_some() { Status::Feasible } else { Status::Unknown };
            let lower = Some(metric(task, &lower));
            Solution { lower_bound: lower, ..answer(status, plan.as_ref().map(show), None) }
        }
    }
}

/// Finds a best plan with at most `horizon` steps, or the best plan known at a limit: `incumbent`, which has at most
/// `horizon` steps, or a cheaper one. `lower` is a lower bound on the cost of all plans.
fn within(
    context: Context<'_, Rational>,
    horizon: usize,
    incumbent: Option<GroundPlan<Rational>>,
    lower: &Rational,
) -> Solution {
    let shorter = with_horizon(context.task, horizon);
    let (status, plan, proof, horizon) = match explore(Context { task: &shorter, ..context }) {
        ExactOutcome::Optimal(plan) => (Status::Feasible, Some(plan), None, horizon),
        ExactOutcome::Known(solution) => (Status::UnsolvableWithinHorizon, None, solution.proof, horizon),
        ExactOutcome::Unknown(plan, _) => {
            let best = plan.into_iter().chain(incumbent).min_by(|a, b| a.cost.cmp(&b.cost));
            (if best.is_some() { Status::Feasible } else { Status::Unknown }, best, None, 0)
        }
    };
    let show = |plan: &GroundPlan<Rational>| decode(context, plan);
    let solution = answer(status, plan.as_ref().map(show), proof);
    Solution { lower_bound: Some(metric(context.task, lower)), horizon, ..solution }
}

fn fewest_steps(task: &Task<Rational>, config: &Config) -> Solution {
    let nothing = |solution: Solution| Solution { lower_bound: None, ..solution };
    let unknown = || nothing(answer(Status::Unknown, None, None));
    let context = Context::new(task, &config.limits);
    let by_steps = with_costs(task.clone(), |_| Quantity::constant(Rational::one()));
    let shortest = match explore(Context { task: &by_steps, ..context }) {
        ExactOutcome::Optimal(plan) => plan,
        ExactOutcome::Known(solution) => return nothing(*solution),
        ExactOutcome::Unknown(..) => return unknown(),
    };
    let steps = shortest.steps.len();
    if config.horizon.is_some_and(|horizon| steps > horizon) {
        let solution = answer(Status::UnsolvableWithinHorizon, None, Some(Proof::Search));
        return Solution { horizon: config.horizon.unwrap_or(steps), ..nothing(solution) };
    }
    // Subtracting the least cost from every cost makes the costs non-negative. This does not change the order
    // of the plans, because all plans considered have the same number of steps.
    let least = task.operators.iter().map(|operator| operator.cost.minimum()).min().unwrap_or_default();
    let shifted = with_costs(with_horizon(task, steps), |operator| {
        let mut cost = operator.cost.clone();
        cost.constant = cost.constant - &least;
        cost
    });
    let (plan, proof) = match explore(Context { task: &shifted, ..context }) {
        ExactOutcome::Optimal(plan) => (plan, Some(Proof::Search)),
        ExactOutcome::Unknown(Some(plan), _) => (plan, None),
        ExactOutcome::Known(_) | ExactOutcome::Unknown(None, _) => (shortest, None),
    };
    let Some(by_metric) = cost(task, &plan.steps) else { return unknown() };
    let plan = GroundPlan { cost: by_metric, ..plan };
    let proved = can_repeat_reward(context, &plan.steps);
    Solution {
        horizon: steps,
        unbounded: Some(if proved { MetricUnbounded::Proved } else { MetricUnbounded::Suspected }),
        ..nothing(answer(Status::Feasible, Some(decode(context, &plan)), proof))
    }
}

enum ExactOutcome {
    Optimal(GroundPlan<Rational>),
    /// It is proved that there is no plan; the solution contains the proof.
    Known(Box<Solution>),
    /// Best plan found before a limit was reached, and a lower bound on the cost of every plan.
    Unknown(Option<GroundPlan<Rational>>, Rational),
}

fn explore(context: Context<'_, Rational>) -> ExactOutcome {
    let limits = context.limits;
    let prepared = Integral::of(context)
        .and_then(|integral| Ok((RoundedBounds::new(Context::new(&integral.task, limits))?, integral)));
    let Ok((bounds, Integral { task, cost_scale })) = prepared else {
        return ExactOutcome::Unknown(None, Rational::zero());
    };
    let unscaled = |cost: Rational| cost / cost_scale.clone();
    let original = |plan: GroundPlan<Rational>| GroundPlan { cost: unscaled(plan.cost), ..plan };
    let unsolvable = |proof| ExactOutcome::Known(Box::new(answer(Status::Unsolvable, None, Some(proof))));
    let Some(lower) = bounds.estimate(&task.initial) else {
        let reason = "no path leads to the goal in a projection of the task to one or two of its variables";
        return unsolvable(Proof::Relaxation(reason.into()));
    };
    match search_states(Context::new(&task, limits), &bounds, STATE_LIMIT) {
        SearchOutcome::Optimal(plan) => ExactOutcome::Optimal(original(plan)),
        SearchOutcome::None => unsolvable(Proof::Search),
        SearchOutcome::Unknown(plan) => ExactOutcome::Unknown(plan.map(original), unscaled(lower)),
    }
}

fn answer(status: Status, plan: Option<Plan>, proof: Option<Proof>) -> Solution {
    Solution {
        status,
        plan,
        ground: None,
        lower_bound: None,
        horizon: 0,
        proof,
        unbounded: None,
        statistics: Statistics::default(),
    }
}

fn with_costs(
    mut task: Task<Rational>,
    cost: impl Fn(&Operator<Rational>) -> Quantity<Rational>,
) -> Task<Rational> {
    for operator in &mut task.operators {
        operator.cost = cost(operator);
    }
    task.objective = Objective { scale: 1, offset: Rational::zero(), maximize: false, rest: Vec::new() };
    task
}

/// Restricts the task to plans with at most `horizon` steps: each step, including waits, consumes
/// one unit of an additional numeric variable.
fn with_horizon(task: &Task<Rational>, horizon: usize) -> Task<Rational> {
    let mut task = task.clone();
    let steps_left = NumericId(dense(task.initial.numbers.len()));
    task.number_names.push("steps left".to_owned());
    task.initial.numbers.push(Rational::from_big(BigRational::from_integer(horizon.into())));
    let mut after = Linear::variable(steps_left);
    after.quantity.constant = -Rational::one();
    for operator in &mut task.operators {
        operator.condition.comparisons.push(after.clone());
        operator.numeric_effects.push(NumericEffect { variable: steps_left, value: after.clone() });
    }
    task
}

/// Lower bounds for a task with rational numbers. They are computed on a copy of the task without numeric
/// variables, in which the costs are scaled and rounded down to integers.
pub struct RoundedBounds {
    pub(crate) bounds: Bounds,
    /// Value of one unit of the integer costs.
    pub(crate) unit: Rational,
}

impl RoundedBounds {
    fn new(context: Context<'_, Rational>) -> Result<Self, Interrupted> {
        Self::of(context, Bounds::new)
    }

    pub(crate) fn of_projections(context: Context<'_, Rational>) -> Result<Self, Interrupted> {
        Self::of(context, Bounds::of_projections)
    }

    fn of(
        context: Context<'_, Rational>,
        bounds: impl FnOnce(Context<'_>) -> Result<Bounds, Interrupted>,
    ) -> Result<Self, Interrupted> {
        let task = context.task;
        let costs: Vec<BigRational> =
            task.operators.iter().map(|operator| operator.cost.minimum().to_big()).collect();
        let factor = factor(&costs);
        let rounded = |cost: &BigRational| {
            let rounded = (cost * &factor).floor().to_integer().to_i128();
            rounded.map_or(0, |rounded| rounded.max(0))
        };
        let operators = task.operators.iter().zip(&costs);
        let bare = Task {
            object_names: Vec::new(),
            schema_names: Vec::new(),
            variables: task.variables.clone(),
            basic: task.basic,
            exclusive: task.exclusive.clone(),
            number_names: Vec::new(),
            number_scale: 1,
            number_multiples: Vec::new(),
            axioms: Vec::new(),
            slots: Vec::new(),
            operators: operators.map(|(operator, cost)| bare_operator(operator, rounded(cost))).collect(),
            initial: without_numbers(&task.initial),
            goal: bare_condition(&task.goal),
            objective: Objective::sum(),
            others: Vec::new(),
            time_scale: 1,
            unreachable: None,
        };
        Ok(Self {
            bounds: bounds(Context::new(&bare, context.limits))?,
            unit: Rational::from_big(factor.recip()),
        })
    }
}

impl Heuristic<Rational> for RoundedBounds {
    fn estimate(&self, state: &State<Rational>) -> Option<Rational> {
        let rounded = self.bounds.estimate(&without_numbers(state))?;
        Some(Rational::from_integer(rounded) * &self.unit)
    }
}

/// Returns a scaling factor for costs. The factor is the least common denominator if this denominator and the scaled
/// costs have at most `COST_BITS` bits. Otherwise, it is a common denominator of only the first costs, or a power of
/// two for which the greatest cost has about `COST_BITS` bits.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "numbers have fewer than 2^63 bits, and the greater length is what the smaller one is taken from"
)]
fn factor(costs: &[BigRational]) -> BigRational {
    let largest = costs.iter().max().cloned().unwrap_or_default();
    let max_cost = BigInt::one() << COST_BITS;
    let mut common = BigInt::one();
    for cost in costs {
        common = common.lcm(cost.denom());
        if common > max_cost {
            break;
        }
    }
    let common = BigRational::from_integer(common);
    if &largest * &common <= BigRational::from_integer(max_cost.clone()) {
        return common;
    }
    // A number below 2^a divided by a number of at least 2^(b - 1) is below 2^(a - b + 1), so the scaled cost
    // has at most `COST_BITS` bits.
    let (numerator, denominator) = (largest.numer().bits(), largest.denom().bits());
    let unit = BigInt::one();
    if denominator + COST_BITS > numerator {
        BigRational::from_integer(unit << (denominator + COST_BITS - numerator - 1))
    } else {
        BigRational::new(unit.clone(), unit << (numerator + 1 - denominator - COST_BITS))
    }
}

fn without_numbers(state: &State<Rational>) -> State {
    State { values: state.values.clone(), numbers: Vec::new() }
}

fn bare_condition(condition: &Condition<Rational>) -> Condition {
    let (facts, clauses) = (condition.facts.clone(), condition.clauses.clone());
    Condition { facts, clauses, ..Condition::default() }
}

fn bare_operator(operator: &Operator<Rational>, cost: Int) -> Operator {
    Operator {
        schema: operator.schema,
        arguments: Vec::new(),
        configuration: Vec::new(),
        slots: [].into(),
        forbidden: [].into(),
        condition: bare_condition(&operator.condition),
        effects: operator.effects.clone(),
        conditional: operator.conditional.clone(),
        numeric_effects: Vec::new(),
        cost: Quantity::constant(cost),
        others: Vec::new(),
        duration: Quantity::constant(0),
        wait: None,
        timing: Timing::free(),
    }
}

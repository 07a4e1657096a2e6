//! Checks properties of a model. By default, small models are solved in exact rationals as long as this is cheap, and
//! other models in doubles with guaranteed bounds.

mod answer;
mod ask;
mod bounded;
mod filters;
mod longrun;
mod multi;
mod named;
mod options;
mod outcome;
mod paths;
mod query;
mod state;
mod steps;
mod table;
mod validate;
mod vector;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::error::Error;
use crate::explore::{Exploration, Explored, explore};
use crate::fraction::Fraction;
use crate::number::Number;
use crate::prism::ast::{BinaryOp, Expr, ExprKind, Model};
use crate::prism::{Names, Packed, Program, Remembered, Settings};
use crate::property::{Declarations, Path, Property, RewardPath, Steps};
use crate::solve::NONE;
use crate::solve::work::DEFAULT_BUDGET;
use named::expand_references;
use query::Query;
use state::is_of_states;
use validate::{expressions_of, properties_in, steps_of, validate};

pub use answer::{Answer, Listed, Outcome, Precision, Quantity};
pub use options::{Exactness, Options};
pub use table::{PolicyTable, Row};

/// Number of transitions from which on a model is explored in doubles instead of rationals, by default.
const MAX_EXACT_TRANSITIONS: usize = 150_000;

/// Returns the default budget of exact arithmetic for one property of a model with this number of
/// transitions, in work units of about 1 ns.
fn budget(transitions: usize) -> u64 {
    let transitions = u64::try_from(transitions).unwrap_or(u64::MAX);
    transitions.saturating_mul(500).max(3_000_000)
}

/// The result of checking a property, with statistics.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Report {
    /// The result of the property.
    pub outcome: Outcome,
    /// The variables of the model: each with its name, and `true` for a Boolean variable.
    pub variables: Vec<(String, bool)>,
    /// Number of explored states. These are all reachable states or, if a single property is checked,
    /// possibly fewer: exploration stops at states at which this property is decided.
    pub states: usize,
    /// Number of choices, summed over all states.
    pub choices: usize,
    /// Number of transitions.
    pub transitions: usize,
    /// Number of states without an enabled choice; each of them got a self-loop.
    pub deadlocks: usize,
    /// The policy that attains the result, if it was requested and computed.
    pub policy: Option<PolicyTable>,
    /// Time for exploring the model.
    pub build: Duration,
    /// Time for solving the property.
    pub solve: Duration,
}

/// Checks a property of a model.
///
/// ```
/// use metaplan_probabilistic::check::{Answer, Options, Outcome, check};
/// use metaplan_probabilistic::{prism, property};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let model = prism::parse("dtmc module m s:[0..2] init 0; [] s=0 -> 1/3:(s'=1) + 2/3:(s'=2); endmodule")?;
/// let report = check(&model, &property::parse("P=? [ F s=1 ]")?, &Options::default())?;
/// let Outcome::Value(Answer::Finite(quantity)) = report.outcome else { panic!("a probability is finite") };
/// assert!(quantity.lower <= 1.0 / 3.0 && quantity.upper >= 1.0 / 3.0);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// An error in the model, the property, the constants or the policy, an exceeded limit, or a cancelled
/// exploration or computation.
pub fn check(model: &Model, property: &Property, options: &Options<'_>) -> Result<Report, Error> {
    let reports = check_all(model, [property], options)?;
    reports.into_iter().next().unwrap_or_else(|| Err(Error::Property(Vec::new().into())))
}

/// Checks several properties of a model. The properties share the exploration of the model.
///
/// # Errors
/// An error in the model, the constants or the declarations, an exceeded limit, or a cancelled exploration. An
/// error in the policy or in a single property is returned instead of the report for the property.
pub fn check_all<'p>(
    model: &Model,
    properties: impl IntoIterator<Item = &'p Property>,
    options: &Options<'_>,
) -> Result<Vec<Result<Report, Error>>, Error> {
    let start = Instant::now();
    let joined = join(model, &options.declarations);
    let properties =
        properties.into_iter().map(|property| expand_references(property, &joined, &options.declarations));
    let properties: Vec<_> = properties.collect();
    let max_starts = options.bounds.states;
    let program = Program::<f64>::within(&joined, &options.settings, max_starts)
        .map_err(|error| blame(error, model, &joined, &options.settings))?;
    let (mut required, mut refused) = (Vec::new(), Vec::new());
    for property in &properties {
        let reward_numbers = property.as_ref().map_err(Clone::clone).and_then(|property| {
            let reward_numbers = required_rewards(&program.reward_names, property, options)?;
            validate(&program, property).map(|()| reward_numbers)
        });
        refused.push(reward_numbers.map(|reward_numbers| required.extend(reward_numbers)).err());
    }
    // If all properties are invalid, the model need not be explored.
    if !refused.iter().any(Option::is_none) {
        return Ok(refused.into_iter().flatten().map(Err).collect());
    }
    required.sort_unstable();
    required.dedup();
    // One of several properties may need states that are reached only through states at which another property
    // is decided.
    let end = match &properties[..] {
        [Ok(only)] => end_of(only, &program.names, options),
        _ => None,
    };
    let program = program.with_rewards(&required).stopping(end.as_ref());
    let exact = if options.exactness == Exactness::Never {
        None
    } else {
        let exact = Program::<Fraction>::within(&joined, &options.settings, max_starts)?;
        Some(exact.with_rewards(&required).stopping(end.as_ref()))
    };
    let mut processes = Processes::explore(&program, exact.as_ref(), options)?;
    if options.evaluate.is_none() {
        processes.forget_numbers();
    }
    let build = start.elapsed();
    let mut reports = Vec::new();
    for (property, refused) in properties.iter().zip(refused) {
        let (Ok(property), None) = (property, &refused) else {
            reports.extend(refused.map(Err));
            continue;
        };
        let start = Instant::now();
        let report = processes.report(&program, exact.as_ref(), property, options, &required);
        reports.push(report.map(|report| Report { build, solve: start.elapsed(), ..report }));
    }
    Ok(reports)
}

/// Returns a condition on states at which the property is decided, so that exploration can stop there. Returns
/// `None` if no such condition is known. Also returns `None` if a policy is requested or given, or a secondary
/// reward is set, because a policy continues after such a state.
fn end_of(property: &Property, names: &Names, options: &Options<'_>) -> Option<Expr> {
    if options.policy || options.evaluate.is_some() || options.secondary.is_some() {
        return None;
    }
    // Before a lower bound on the number of steps, reaching the goal does not decide the property.
    let lasts = |steps: &Option<Box<Steps>>| steps.as_ref().is_none_or(|steps| steps.least.is_none());
    let not = |inner: &Expr| Expr { kind: ExprKind::Not(Box::new(inner.clone())), place: inner.place };
    let end = match property {
        Property::Probability(_, Path::Until(left, right, steps)) if lasts(steps) => {
            right.clone().op(BinaryOp::Or, not(left))
        }
        Property::Probability(_, Path::Globally(goal, steps)) if lasts(steps) => not(goal),
        Property::Reward(_, _, RewardPath::Reach(goal)) => goal.clone(),
        _ => return None,
    };
    is_of_states(&end, names).then_some(end)
}

fn join(model: &Model, declarations: &Declarations) -> Model {
    let mut joined = model.clone();
    joined.constants.extend(declarations.constants.iter().cloned());
    joined.labels.extend(declarations.labels.iter().cloned());
    joined
}

/// Attributes an error in `joined` to the model if `model` alone is invalid, otherwise to the
/// declarations of the property file.
fn blame(error: Error, model: &Model, joined: &Model, settings: &Settings) -> Error {
    let Error::Model(problems) = error else { return error };
    let declared = joined.constants.len() > model.constants.len() || joined.labels.len() > model.labels.len();
    if !declared {
        return Error::Model(problems);
    }
    let is_model_constant = |name: &String| model.constants.iter().any(|constant| constant.name == *name);
    let model_settings: Settings = settings
        .iter()
        .filter(|(name, _)| is_model_constant(name))
        .map(|(k, v)| (k.clone(), v.clone()))
        .collect();
    match Program::<f64>::new(model, &model_settings) {
        Err(Error::Model(problems)) => Error::Model(problems),
        _ => Error::Property(problems),
    }
}

struct Processes {
    exact: Option<Explored<Packed, Fraction>>,
    doubles: Option<Explored<Packed, f64>>,
    /// The budget of exact arithmetic for each property, in work units.
    budget: u64,
}

impl Processes {
    /// Explores in rationals up to [`MAX_EXACT_TRANSITIONS`] transitions and continues in doubles
    /// if the model is larger. With [`Exactness::Always`], only rationals are used; if `exact` is
    /// `None`, only doubles.
    fn explore(
        program: &Program<f64>,
        exact: Option<&Program<Fraction>>,
        options: &Options<'_>,
    ) -> Result<Self, Error> {
        let bounds = &options.bounds;
        let Some(exact) = exact else {
            return Ok(Self {
                exact: None,
                doubles: Some(explore(&Remembered::new(program), bounds)?),
                budget: 0,
            });
        };
        if options.exactness == Exactness::Always {
            return Ok(Self {
                exact: Some(explore(&Remembered::new(exact), bounds)?),
                doubles: None,
                budget: u64::MAX,
            });
        }
        let exact = Remembered::new(exact);
        let mut exploration = Exploration::new(&exact, bounds)?;
        if exploration.run(&exact, bounds, MAX_EXACT_TRANSITIONS)? {
            let budget = budget(exploration.explored.mdp.transition_count());
            return Ok(Self { exact: Some(exploration.explored), doubles: None, budget });
        }
        let doubles = match exploration.rounded() {
            Some(mut rounded) => {
                drop(exploration);
                rounded.run(&Remembered::new(program), bounds, usize::MAX)?;
                rounded.explored
            }
            // A number is out of range for doubles. The exploration in doubles reports the place of
            // this number in the model.
            None => explore(&Remembered::new(program), bounds)?,
        };
        Ok(Self { exact: None, doubles: Some(doubles), budget: 0 })
    }

    fn forget_numbers(&mut self) {
        self.exact.iter_mut().for_each(|explored| explored.states.forget_numbers());
        self.doubles.iter_mut().for_each(|explored| explored.states.forget_numbers());
    }

    fn report(
        &mut self,
        program: &Program<f64>,
        exact: Option<&Program<Fraction>>,
        property: &Property,
        options: &Options<'_>,
        computed_rewards: &[usize],
    ) -> Result<Report, Error> {
        if let (Some(program), Some(explored)) = (exact, &self.exact) {
            let mut query = Query::new(program, explored, options, computed_rewards, self.budget)?;
            query.doubles = Some(explored.mdp.to_f64());
            if let Some(answer) = query.answer(property)? {
                return Ok(report(program, explored, answer, options));
            }
            if query.work.borrow().is_cancelled() {
                return Err(Error::Interrupted { states: explored.mdp.states() });
            }
        }
        if self.doubles.is_none() {
            let rounded = self.exact.as_ref().and_then(Explored::rounded);
            self.doubles =
                Some(rounded.map_or_else(|| explore(&Remembered::new(program), &options.bounds), Ok)?);
        }
        let explored = self.doubles.as_ref().expect("invariant: explored just now");
        let answer = Query::new(program, explored, options, computed_rewards, 0)?.answer(property)?;
        // Doubles cost nothing, so that only the caller stops a computation in doubles.
        let answer = answer.ok_or(Error::Interrupted { states: explored.mdp.states() })?;
        let wide = options.precision.is_some_and(|precision| !answer.0.is_within(precision));
        if let Some(exact) = exact.filter(|_| wide) {
            let budget = DEFAULT_BUDGET.saturating_mul(10);
            if self.exact.is_none() {
                self.exact = Some(explore(&Remembered::new(exact), &options.bounds)?);
            }
            if self.budget < budget {
                let usual = std::mem::replace(&mut self.budget, budget);
                let report = self.report(program, Some(exact), property, options, computed_rewards);
                self.budget = usual;
                return report;
            }
        }
        Ok(report(program, explored, answer, options))
    }
}

fn report<N: Number>(
    program: &Program<N>,
    explored: &Explored<Packed, N>,
    (outcome, policy): outcome::Attained,
    options: &Options<'_>,
) -> Report {
    let mdp = &explored.mdp;
    Report {
        outcome,
        variables: program
            .variables
            .iter()
            .map(|variable| (variable.name.clone(), variable.is_bool))
            .collect(),
        states: mdp.states(),
        choices: mdp.choice_count(),
        transitions: mdp.transition_count(),
        deadlocks: explored.deadlocks,
        policy: policy.filter(|_| options.policy).map(|policy| policy_table(program, explored, &policy)),
        build: Duration::ZERO,
        solve: Duration::ZERO,
    }
}

fn required_rewards(
    names: &[String],
    property: &Property,
    options: &Options<'_>,
) -> Result<Vec<usize>, Error> {
    let mut required = Vec::new();
    let mut parts = vec![property];
    while let Some(part) = parts.pop() {
        if let Property::Multi(nested) = part {
            parts.extend(nested);
        }
        let name = match part {
            Property::Reward(_, name, _) => Some(name),
            Property::Probability(_, path) => steps_of(path).and_then(|steps| steps.reward.as_ref()),
            _ => None,
        };
        if let Some(name) = name {
            required.push(query::structure(names, name.as_deref())?);
        }
        for expression in expressions_of(part) {
            properties_in(expression, &mut parts);
        }
    }
    if let Some(name) = &options.secondary {
        required.push(query::structure(names, Some(name))?);
    }
    Ok(required)
}

/// Lists the choice of a policy in each state that is reachable from an initial state under the
/// policy. States in which the policy has no choice are omitted.
fn policy_table<N: Number>(
    program: &Program<N>,
    explored: &Explored<Packed, N>,
    policy: &[u32],
) -> PolicyTable {
    let names = program.variables.iter().map(|variable| (variable.name.clone(), variable.is_bool)).collect();
    let mut table = PolicyTable { variables: names, rows: Vec::new() };
    let mut visited = vec![false; explored.mdp.states()];
    let mut queue: VecDeque<usize> = (0..explored.starts).collect();
    visited[..explored.starts].fill(true);
    let mut values = Vec::new();
    while let Some(state) = queue.pop_front() {
        let choice = policy[state];
        if choice == NONE {
            continue;
        }
        let choice = choice as usize;
        program.unpack(&explored.states[state], &mut values);
        table.rows.push(Row {
            values: values.clone(),
            action: program.action_name(explored.mdp.action(choice)).to_owned(),
            choice: choice
                .checked_sub(explored.mdp.choices(state).start)
                .expect("invariant: a choice of the state"),
        });
        for target in explored.mdp.targets(choice) {
            if !std::mem::replace(&mut visited[*target as usize], true) {
                queue.push_back(*target as usize);
            }
        }
    }
    table
}

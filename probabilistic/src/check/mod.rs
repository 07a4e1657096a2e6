//! A model and a property to an answer: explored in doubles, and once more in rationals where the model is small.

mod answer;
mod options;
mod query;
mod steps;
mod table;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use num_rational::BigRational;

use crate::error::Error;
use crate::explore::{Explored, explore};
use crate::number::Number;
use crate::prism::ast::Model;
use crate::prism::{Packed, Program};
use crate::property::Property;
use crate::solve::{NONE, Work};

pub use answer::{Answer, Outcome, Quantity};
pub use options::{Exactness, Options};
pub use table::{PolicyTable, Row};

/// Transitions up to which a model is solved in rationals unless asked otherwise.
const SMALL: usize = 150_000;

/// What exact arithmetic may cost a model with so many transitions unless it was asked for, in units of about a nanosecond.
fn budget(transitions: usize) -> u64 {
    let transitions = u64::try_from(transitions).unwrap_or(u64::MAX);
    transitions.saturating_mul(500).saturating_add(10_000_000)
}

/// What came out.
#[derive(Debug, Clone)]
pub struct Report {
    /// The answer.
    pub outcome: Outcome,
    /// States.
    pub states: usize,
    /// Choices in all states.
    pub choices: usize,
    /// Transitions.
    pub transitions: usize,
    /// States without choice, which got a loop.
    pub deadlocks: usize,
    /// The policy, if it was wanted and there is one.
    pub policy: Option<PolicyTable>,
    /// The time to explore.
    pub build: Duration,
    /// The time to solve.
    pub solve: Duration,
}

/// Checks a property.
///
/// # Errors
/// Everything that is wrong with model, property, constants or policy, or that a limit was reached.
pub fn check(model: &Model, property: &Property, options: &Options<'_>) -> Result<Report, Error> {
    let start = Instant::now();
    // Probabilities must sum to one as they are written: the first pass decides that in doubles.
    let program = Program::<f64>::new(model, &options.settings)?;
    let wanted = wanted_rewards(&program.reward_names, property, options)?;
    let program = program.with_rewards(&wanted);
    query::validate(&program, property)?;
    let explored = explore(&program, &options.bounds)?;
    let small = options.exactness == Exactness::Auto && explored.mdp.transition_count() <= SMALL;
    let mut build = start.elapsed();
    let mut report = Report {
        outcome: Outcome::Truth(false, None),
        states: explored.mdp.states(),
        choices: explored.mdp.choice_count(),
        transitions: explored.mdp.transition_count(),
        deadlocks: explored.deadlocks,
        policy: None,
        build,
        solve: Duration::ZERO,
    };
    let start = Instant::now();
    let mut spent = Duration::ZERO;
    let most = if small { budget(explored.mdp.transition_count()) } else { u64::MAX };
    if small || options.exactness == Exactness::Always {
        let again = Instant::now();
        let exact = Program::<BigRational>::new(model, &options.settings)?.with_rewards(&wanted);
        let states = explore(&exact, &options.bounds)?;
        spent = again.elapsed();
        build = build.saturating_add(spent);
        // A policy of the doubles is a good start where both have the same choices.
        let same = states.mdp.choice_count() == explored.mdp.choice_count()
            && states.mdp.transition_count() == explored.mdp.transition_count();
        let doubles = same.then(|| states.mdp.to_f64());
        let found = query::Query {
            program: &exact,
            explored: &states,
            wanted: &wanted,
            doubles,
            work: Work::new(most).into(),
        }
        .answer(property, options)?;
        if let Some((outcome, policy)) = found {
            report.outcome = outcome;
            report.policy = policy.filter(|_| options.policy).map(|p| policy_table(&exact, &states, &p));
            report.build = build;
            report.solve = start.elapsed().saturating_sub(spent);
            return Ok(report);
        }
    }
    let found = query::Query {
        program: &program,
        explored: &explored,
        wanted: &wanted,
        doubles: None,
        work: Work::new(0).into(),
    }
    .answer(property, options)?;
    if let Some((outcome, policy)) = found {
        report.outcome = outcome;
        report.policy = policy.filter(|_| options.policy).map(|p| policy_table(&program, &explored, &p));
    }
    report.build = build;
    report.solve = start.elapsed().saturating_sub(spent);
    Ok(report)
}

/// The reward structures that a property and the ties of its policy need, by number.
fn wanted_rewards(names: &[String], property: &Property, options: &Options<'_>) -> Result<Vec<usize>, Error> {
    let mut wanted = Vec::new();
    let mut parts = vec![property];
    while let Some(part) = parts.pop() {
        match part {
            Property::Reward(_, name, _) => wanted.push(query::structure(names, name.as_deref())?),
            Property::Multi(more) => parts.extend(more),
            Property::Probability(..) => {}
        }
    }
    if let Some(name) = &options.secondary {
        wanted.push(query::structure(names, Some(name))?);
    }
    wanted.sort_unstable();
    wanted.dedup();
    Ok(wanted)
}

/// What a policy does in each state that it can get to.
fn policy_table<N: Number>(
    program: &Program<N>,
    explored: &Explored<Packed, N>,
    policy: &[u32],
) -> PolicyTable {
    let names = program.variables.iter().map(|variable| (variable.name.clone(), variable.is_bool)).collect();
    let mut table = PolicyTable { variables: names, rows: Vec::new() };
    let mut seen = vec![false; explored.mdp.states()];
    let mut queue = VecDeque::from([0_usize]);
    seen[0] = true;
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
            if !std::mem::replace(&mut seen[*target as usize], true) {
                queue.push_back(*target as usize);
            }
        }
    }
    table
}

//! Evaluates a decision rule (a policy, a plan or a planner) exactly in the decision process.

use std::cell::RefCell;

use fixedbitset::FixedBitSet;
use probabilistic::explore::{Bounds, Choices, Explored, Generator, explore};
use probabilistic::policy::conditioned;
use probabilistic::solve::{Solution, solve};
use probabilistic::{Direction, Error, Mdp, Number, Problem};

use crate::comparison::process::{Process, State};

/// Decision rule: returns the number of the action in a state. The second argument is the number of executed steps, 0
/// if steps are not counted. `None` or an impossible action ends the mission.
pub type Decide<'a> = dyn FnMut(State, u32) -> Option<u32> + 'a;

struct FixedProcess<'a, 'b, N> {
    process: &'a Process<N>,
    decide: RefCell<&'a mut Decide<'b>>,
    counts: bool,
}

impl<N: Number> Generator<N> for FixedProcess<'_, '_, N> {
    type State = (State, u32);

    fn initial(&self) -> (State, u32) {
        (self.process.initial(), 0)
    }

    fn rewards(&self) -> usize {
        self.process.rewards()
    }

    fn successors(
        &self,
        (state, step): &(State, u32),
        choices: &mut Choices<(State, u32), N>,
    ) -> Result<(), Error> {
        let mut available = Choices::default();
        self.process.successors(state, &mut available)?;
        let Some(action) = (self.decide.borrow_mut())(*state, *step) else { return Ok(()) };
        // An impossible action ends the mission.
        let Some((transitions, rewards)) = available.find(action) else { return Ok(()) };
        let next = if self.counts { step + 1 } else { 0 };
        for (target, probability) in transitions {
            choices.to((*target, next), probability.clone());
        }
        choices.end(action, rewards.iter().cloned());
        Ok(())
    }
}

/// Values of a decision rule. Expected values are sums over the whole mission, until the goal or a failure. Infinite or
/// undefined ones are `None` or NaN.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Measures {
    /// Probability of reaching the goal.
    pub goal: f64,
    /// Probability of reaching the goal with a battery level of at least the reserve.
    pub goal_with_reserve: f64,
    /// Probability of reaching the goal without a collision.
    pub goal_without_collision: f64,
    /// Probability that no collision happens during the mission.
    pub no_collision: f64,
    /// Expected number of collisions.
    pub collisions: f64,
    /// Expected time. `None` if the mission may never end.
    pub time: Option<f64>,
    /// Expected energy. `None` if the mission may never end.
    pub energy: Option<f64>,
    /// Expected number of reconfigurations.
    pub reconfigurations: Option<f64>,
    /// Expected time of missions that reach the goal. `None` if no mission does.
    pub time_if_successful: Option<f64>,
    /// Expected energy of missions that reach the goal. `None` if no mission does.
    pub energy_if_successful: Option<f64>,
    /// Expected time plus the penalty for missions that do not reach the goal.
    pub penalised_time: Option<f64>,
    /// Expected number of visits to states in which a new plan is needed.
    pub replans: f64,
    /// Number of states that are reachable with the decision rule. If steps are counted, a state counts once for each
    /// number of steps.
    pub states: usize,
}

/// Evaluates a decision rule, in doubles if its values cannot be computed within the budget of exact arithmetic. `process`
/// must have all rewards of `REWARDS`. With `counts`, steps are counted, so that
/// decisions can depend on their number. `penalty` is the time added if a mission does not reach the goal. `reserve` is
/// the battery level for [`Measures::goal_with_reserve`]. `replans` is called after all decisions are made, and returns
/// `true` for states in which a new plan was needed.
pub fn play<N: Number>(
    process: &Process<N>,
    counts: bool,
    penalty: f64,
    reserve: u32,
    replans: &dyn Fn(State) -> bool,
    decide: &mut Decide<'_>,
) -> Result<Measures, Error> {
    let played = FixedProcess { process, decide: RefCell::new(decide), counts };
    let chain = explore(&played, &Bounds::default())?;
    let is_goal = |state: State| process.is_goal(state);
    if let Some(measures) = measure(&is_goal, &chain, penalty, reserve, replans) {
        return Ok(measures);
    }
    let doubles = |values: &Vec<N>| values.iter().map(Number::to_f64).collect();
    let rewards: Vec<Vec<f64>> = chain.rewards.iter().map(doubles).collect();
    let Explored { mdp, starts, states, deadlocks, .. } = chain;
    let rounded = Explored { mdp: mdp.to_f64(), starts, states, rewards, deadlocks };
    let imprecise = Error::Imprecise { precision: MAX_WIDTH };
    measure(&is_goal, &rounded, penalty, reserve, replans).ok_or(imprecise)
}

/// Greatest width of the bounds on a value in doubles, relative to the value if it is above 1.
const MAX_WIDTH: f64 = 1e-6;

/// Returns `None` if exact arithmetic exceeds its budget, or if the bounds on a value are wider than [`MAX_WIDTH`].
fn measure<N: Number>(
    is_goal: &dyn Fn(State) -> bool,
    chain: &Explored<(State, u32), N>,
    penalty: f64,
    reserve: u32,
    replans: &dyn Fn(State) -> bool,
) -> Option<Measures> {
    let n = chain.mdp.states();
    let set = |holds: &dyn Fn(State) -> bool| {
        let mut set = FixedBitSet::with_capacity(n);
        chain.states.iter().enumerate().for_each(|(number, (state, _))| set.set(number, holds(*state)));
        set
    };
    let goal = set(is_goal);
    let above_reserve = set(&|state| is_goal(state) && state.situation().battery >= reserve);
    let safe_goal = set(&|state| is_goal(state) && !state.situation().hit);
    let hit = set(&|state| state.situation().hit);
    let mut end = FixedBitSet::with_capacity(n);
    for state in 0..n {
        // Exploration marks states without a decision by a deadlock action.
        let stays = chain.mdp.choices(state).all(|c| chain.mdp.action(c) == probabilistic::explore::DEADLOCK);
        end.set(state, stays);
    }
    // State 0 is the initial state.
    let is_narrow = |solution: &Solution<N>| {
        solution.bounds(0).is_none_or(|(lower, upper)| upper - lower <= MAX_WIDTH * upper.max(1.0))
    };
    let value = |mdp: &Mdp<N>, rewards: Option<&[N]>, terminal: &FixedBitSet| {
        solve(Problem::new(mdp, Direction::Max, rewards, terminal), None).filter(is_narrow)
    };
    // The inner result is `None` if the value is infinite.
    let first = |rewards: Option<&[N]>, terminal: &FixedBitSet| {
        let solution = value(&chain.mdp, rewards, terminal)?;
        Some((!solution.infinite.contains(0)).then(|| solution.values[0].to_f64()))
    };
    let probability = |terminal: &FixedBitSet| Some(first(None, terminal)?.unwrap_or(0.0));
    let reached = value(&chain.mdp, None, &goal)?.values;
    let success = reached[0].to_f64();
    let policy: Vec<u32> = (0..n).map(|state| chain.mdp.choices(state).start as u32).collect();
    let if_successful = |reward: usize| {
        // A conditional expectation needs a condition of positive probability.
        if success <= 0.0 {
            return Some(None);
        }
        // Conditioning on success reweights each transition by the success probability of its
        // target.
        let (mdp, origin) = conditioned(&chain.mdp, &policy, &reached, &goal);
        let rewards: Vec<N> = origin.iter().map(|c| chain.rewards[reward][*c as usize].clone()).collect();
        let solution = value(&mdp, Some(&rewards), &goal)?;
        Some(Some(solution.values[0].to_f64()))
    };
    let sum = |reward: usize| first(Some(&chain.rewards[reward]), &end);
    let mut visits = vec![N::zero(); chain.mdp.choice_count()];
    for (number, (state, _)) in chain.states.iter().enumerate() {
        if !end.contains(number) && replans(*state) {
            chain.mdp.choices(number).for_each(|choice| visits[choice] = N::one());
        }
    }
    let time = sum(0)?;
    Some(Measures {
        goal: success,
        goal_with_reserve: probability(&above_reserve)?,
        goal_without_collision: probability(&safe_goal)?,
        no_collision: 1.0 - probability(&hit)?,
        collisions: sum(2)?.unwrap_or(f64::NAN),
        time,
        energy: sum(1)?,
        reconfigurations: sum(3)?,
        time_if_successful: if_successful(0)?,
        energy_if_successful: if_successful(1)?,
        penalised_time: time.map(|time| time + penalty * (1.0 - success)),
        replans: first(Some(&visits), &end)?.unwrap_or(f64::NAN),
        states: n,
    })
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;

    use super::*;
    use crate::comparison::coadaptation::{Arc, Coadaptation, Configuration, Traversal};
    use crate::comparison::process::{Action, REWARDS, Risk};

    /// The budget of exact arithmetic does not suffice for the long fractions of the values.
    #[test]
    fn long_plans_have_the_values_of_the_formulas() {
        const MOVES: usize = 300;
        let decimal = |text: &str| probabilistic::number::parse_decimal(text).expect("a decimal");
        let traversal = Traversal {
            time: BigRational::one(),
            energy: BigRational::zero(),
            success: decimal("0.987654321"),
            hit: decimal("0.012345679"),
        };
        let arc = |from: usize| Arc { from, to: from + 1, by: vec![Some(traversal.clone())] };
        let configuration = Configuration { name: "fd".to_owned(), components: Vec::new(), available: true };
        let mission = Coadaptation {
            places: (0..=MOVES).map(|place| format!("p{place}")).collect(),
            start: 0,
            goal: MOVES,
            configurations: vec![configuration],
            initial: 0,
            arcs: (0..MOVES).map(arc).collect(),
            switches: vec![vec![None]],
            battery: None,
            loss: None,
        };
        let process = Process::<BigRational>::new(&mission, Risk::all(&mission), &REWARDS);
        let mut decide = |_: State, step: u32| Some(Action::Move(step as usize).number());
        let measures = play(&process, true, 1000.0, 0, &|_| false, &mut decide).expect("measures");
        // A move fails with probability 1 - s. Otherwise there is a collision with probability h.
        let (s, h) = (0.987_654_321_f64, 0.012_345_679_f64);
        let sum = |ratio: f64| (1.0 - ratio.powi(MOVES as i32)) / (1.0 - ratio);
        let (success, safe) = (s.powi(MOVES as i32), (s * (1.0 - h)).powi(MOVES as i32));
        let time = sum(s);
        for (value, expected) in [
            (Some(measures.goal), success),
            (Some(measures.goal_with_reserve), success),
            (Some(measures.goal_without_collision), safe),
            (Some(measures.no_collision), safe + (1.0 - s) * sum(s * (1.0 - h))),
            (Some(measures.collisions), s * h * time),
            (measures.time, time),
            (measures.time_if_successful, MOVES as f64),
            (measures.penalised_time, time + 1000.0 * (1.0 - success)),
        ] {
            let value = value.expect("a number");
            assert!((value - expected).abs() <= 1e-9 * expected, "{value}, not {expected}: {measures:?}");
        }
    }
}

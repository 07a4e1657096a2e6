//! The decision process in which all candidates are evaluated, and its optimal policies.

use fixedbitset::FixedBitSet;
use num_rational::BigRational;
use probabilistic::explore::{DEADLOCK, Explored, Generator};
use probabilistic::pareto::{Objective, Pareto};
use probabilistic::policy::with_secondary;
use probabilistic::solve::{NONE, Solution, solve};
use probabilistic::{Direction, Error, Problem};

use crate::comparison::coadaptation::Coadaptation;
use crate::comparison::play::{Measures, play};
use crate::comparison::process::{Action, Process, REWARDS, Risk, State, Valuation};

/// Name of the objective that a policy optimises, and the policy: the number of the chosen choice for each state.
pub type NamedPolicy = (String, Vec<u32>);

pub struct Referee<'a> {
    pub mission: &'a Coadaptation,
    pub risk: Risk,
    pub penalty: f64,
    pub process: Process<f64>,
    pub explored: Explored<State, f64>,
}

impl Referee<'_> {
    pub fn set(&self, holds: impl Fn(Valuation) -> bool) -> FixedBitSet {
        let mut set = FixedBitSet::with_capacity(self.explored.mdp.states());
        for (number, state) in self.explored.states.iter().enumerate() {
            set.set(number, holds(state.situation()));
        }
        set
    }

    pub fn goal(&self) -> FixedBitSet {
        self.set(|s| s.place == self.mission.goal && !s.failed)
    }

    pub fn safe_goal(&self) -> FixedBitSet {
        self.set(|s| s.place == self.mission.goal && !s.failed && !s.hit)
    }

    pub fn problem<'p>(
        &'p self,
        direction: Direction,
        reward: Option<usize>,
        terminal: &'p FixedBitSet,
    ) -> Problem<'p, f64> {
        let rewards = reward.map(|reward| &self.explored.rewards[reward][..]);
        Problem::new(&self.explored.mdp, direction, rewards, terminal)
    }

    /// Returns the policies that are found for four objectives: penalised time, probability of reaching the
    /// goal, probability of reaching it without collision, and energy. The last three break ties by time.
    pub fn policies(&self) -> Vec<NamedPolicy> {
        let (goal, safe) = (self.goal(), self.safe_goal());
        let mut policies = Vec::new();
        let reachable = solve(self.problem(Direction::Max, None, &goal), None);
        if let Some(reachable) = &reachable {
            let solution = self.penalised(&goal, reachable);
            policies.extend(solution.map(|s| ("best policy by penalised time".to_owned(), s.policy)));
        }
        let probabilities = [
            ("best policy by P(goal), then time", &goal, reachable.clone()),
            ("best policy by P(goal, no collision), then time", &safe, None),
        ];
        for (name, target, precomputed) in probabilities {
            let problem = self.problem(Direction::Max, None, target);
            let solution = precomputed.or_else(|| solve(problem, None));
            let better = solution.and_then(|s| with_secondary(&problem, &s, &self.explored.rewards[0]));
            policies.extend(better.map(|s| (name.to_owned(), s.policy)));
        }
        let problem = self.problem(Direction::Min, Some(1), &goal);
        if let Some(solution) = solve(problem, None).filter(|solution| !solution.infinite.contains(0)) {
            let better = with_secondary(&problem, &solution, &self.explored.rewards[0]).unwrap_or(solution);
            policies.push(("best policy by energy, then time".to_owned(), better.policy));
        }
        policies
    }

    /// Minimises the expected time until `goal` or a state without a path to the goal is reached. Such a state adds
    /// the penalty. `reachable` has the greatest probability of reaching the goal for each state.
    pub fn penalised(&self, goal: &FixedBitSet, reachable: &Solution<f64>) -> Option<Solution<f64>> {
        let n = self.explored.mdp.states();
        let mut terminal = goal.clone();
        let mut worth = vec![0.0; n];
        for (state, worth) in worth.iter_mut().enumerate() {
            // The goal cannot be reached from such a state, so the penalty is due.
            if reachable.values[state] <= 0.0 {
                terminal.insert(state);
                *worth = self.penalty;
            }
        }
        let problem =
            Problem { terminal_values: Some(&worth), ..self.problem(Direction::Min, Some(0), &terminal) };
        solve(problem, None)
    }

    /// Returns the vertices of the Pareto front of expected time and probability of success without collision, and a
    /// policy for each vertex. Both lists are empty if the front cannot be computed.
    pub fn front(&self) -> (Vec<[f64; 2]>, Vec<NamedPolicy>) {
        let objectives = [
            Objective { rewards: Some(self.explored.rewards[0].clone()), target: self.goal() },
            Objective { rewards: None, target: self.safe_goal() },
        ];
        let vertices = Pareto::new(&self.explored.mdp, &objectives).and_then(|pareto| pareto.vertices(None));
        let vertices = vertices.unwrap_or_default();
        let front = vertices.iter().map(|vertex| [vertex.losses[0], 1.0 - vertex.losses[1]]).collect();
        let name =
            |number: usize| format!("vertex {} of the front of time and P(goal, no collision)", number + 1);
        let inner = vertices.into_iter().enumerate().map(|(number, vertex)| (name(number), vertex.policy));
        (front, inner.collect())
    }

    pub fn exact(&self) -> Process<BigRational> {
        Process::new(self.mission, self.risk, &REWARDS)
    }

    pub fn reserve(&self) -> u32 {
        self.mission.battery.filter(|_| self.risk.battery).map_or(0, |battery| battery.reserve)
    }

    pub fn decision(&self, policy: &[u32], situation: Valuation) -> Option<Action> {
        let state = State::from(situation);
        let number = self.explored.states.number(self.process.code(&state), &state)?;
        let choice = policy.get(number).filter(|choice| **choice != NONE)?;
        Some(Action::from_number(self.explored.mdp.action(*choice as usize)))
    }

    /// Returns each state that a policy reaches before the mission ends, with the action of the policy in this
    /// state.
    pub fn decisions(&self, policy: &[u32]) -> Vec<(Valuation, Action)> {
        let mdp = &self.explored.mdp;
        let mut visited = FixedBitSet::with_capacity(mdp.states());
        let (mut queue, mut decisions, mut at) = (vec![0_usize], Vec::new(), 0);
        visited.insert(0);
        while let Some(state) = queue.get(at).copied() {
            at += 1;
            let choice = policy[state];
            // The mission has ended.
            if choice == NONE || mdp.action(choice as usize) == DEADLOCK {
                continue;
            }
            let action = Action::from_number(mdp.action(choice as usize));
            decisions.push((self.explored.states[state].situation(), action));
            queue.extend(
                mdp.targets(choice as usize).iter().map(|t| *t as usize).filter(|t| !visited.put(*t)),
            );
        }
        decisions
    }

    pub fn play_policy(&self, policy: &[u32]) -> Result<Measures, Error> {
        let mut decide = |state: State, _: u32| self.decision(policy, state.situation()).map(Action::number);
        // Values are computed in rationals, although the policy was computed in floating-point
        // numbers.
        play(&self.exact(), false, self.penalty, self.reserve(), &|_| false, &mut decide)
    }

    /// Evaluates a plan, action by action. Each action needs the configuration that the changes before it lead to.
    /// After a failed change the next action cannot be executed, which ends the mission.
    pub fn play_plan(&self, plan: &[Action]) -> Result<Measures, Error> {
        let mut configuration = self.mission.initial;
        let steps = plan.iter().map(|action| {
            let before = configuration;
            if let Action::Change(new) = action {
                configuration = *new;
            }
            (before, *action)
        });
        let steps: Vec<(usize, Action)> = steps.collect();
        let mut decide = |state: State, step: u32| {
            let (before, action) = steps.get(step as usize)?;
            (state.situation().configuration == *before).then(|| action.number())
        };
        // The action of a plan depends on the number of steps.
        play(&self.exact(), true, self.penalty, self.reserve(), &|_| false, &mut decide)
    }

    /// Returns the reason why the price of determinism is 0, if there is one. If only the collision flag is
    /// uncertain, and no transition depends on it, the fastest plan is an optimal policy.
    pub fn no_price(&self) -> Option<&'static str> {
        use num_traits::One;
        let certain = |probability: &BigRational| probability.is_one();
        let moves = self.mission.arcs.iter().flat_map(|arc| arc.by.iter().flatten());
        let moves_certain =
            !self.risk.failures || moves.into_iter().all(|traversal| certain(&traversal.success));
        let switches = self.mission.switches.iter().flatten().flatten();
        let is_deterministic =
            moves_certain && !self.risk.loss && switches.into_iter().all(|switch| certain(&switch.success));
        is_deterministic.then_some(
            "nothing but the collision flag is uncertain, and neither the time nor any move depends on it",
        )
    }
}

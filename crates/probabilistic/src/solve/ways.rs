//! Solves components of at most 64 states by shortest paths if each choice leads either out of the component
//! or to a single other state of it. In both cases, the choice may also loop.
//!
//! Reconfigurations that succeed, or that are repeated until they succeed, have this form. Nearly all
//! components of a co-adaptation process consist of them. The best values are propagated from the choices
//! that leave the component (Dijkstra 1959). Only least rewards and greatest probabilities need this; the
//! other values are 0 or infinite. No system of equations is solved, and the only rounding errors are those
//! of a few sums and quotients.

use crate::mdp::dense;
use crate::number::{Number, count, is_whole};
use crate::solve::local::NONE;
use crate::solve::problem::{Direction, Run};

/// Upper limit on the number of states of a component that is solved by shortest paths, because the next state
/// is found by linear search.
const MAX_STATES: usize = 64;

#[derive(Debug)]
pub struct PathBuffers<N> {
    /// For each state of the component, the best known value with its choice.
    best: Vec<Option<(N, u32)>>,
    settled: Vec<bool>,
    steps: Vec<Step<N>>,
    /// The choices that leave the component: local state, choice, and `true` if all successors
    /// reach a terminal state with probability 1.
    exits: Vec<(u32, u32, bool)>,
    /// Greatest error of the value of a choice that leaves the component.
    error: f64,
    /// Greatest error of a choice that leaves the component with value 0.
    zero_error: f64,
    /// Whether all summands are small integers, so that sums are exact.
    whole: bool,
}

#[derive(Debug, Clone)]
struct Step<N> {
    from: u32,
    to: u32,
    choice: u32,
    cost: N,
    /// Whether the cost was computed by a division, and is therefore possibly rounded.
    divided: bool,
}

impl<N> Default for PathBuffers<N> {
    fn default() -> Self {
        Self {
            best: Vec::new(),
            settled: Vec::new(),
            steps: Vec::new(),
            exits: Vec::new(),
            error: 0.0,
            zero_error: 0.0,
            whole: true,
        }
    }
}

impl<N: Number> Run<'_, N> {
    /// Solves a component by shortest paths. Returns `false` without an effect if the component
    /// does not qualify: a choice can both leave the component and lead to another state in it, or
    /// can lead to several other states in it; there are more than [`MAX_STATES`] states; or
    /// choices are restricted and all policies have to be considered.
    pub fn shortest_paths(&mut self, component: &[u32], buffers: &mut PathBuffers<N>) -> bool {
        let by_choice = self.sure_by_choice();
        // With restricted choices, the component may not be strongly connected by the allowed
        // choices.
        if component.len() > MAX_STATES || !by_choice && self.problem.allowed.is_some() {
            return false;
        }
        for (number, state) in component.iter().enumerate() {
            self.position[*state as usize] = dense(number);
        }
        let fits = self.scan(component, buffers);
        for state in component {
            self.position[*state as usize] = NONE;
        }
        if !fits {
            return false;
        }
        match (self.problem.rewards.is_some(), by_choice) {
            (false, true) => self.greatest_probability(component, buffers),
            (true, true) => self.least_reward(component, buffers),
            // The component is strongly connected, so from each state some policy never leaves it. The greatest
            // expected reward is therefore infinite.
            (true, false) => component.iter().for_each(|state| {
                self.solution.infinite.insert(*state as usize);
            }),
            // Staying in the component reaches the goal with probability 0, the least possible
            // value.
            (false, false) => {
                for step in &buffers.steps {
                    self.solution.policy[component[step.from as usize] as usize] = step.choice;
                }
            }
        }
        true
    }

    /// Collects in `buffers` the steps (choices that lead to another state of the component) and the
    /// exits (choices that leave the component). Returns `false` if a choice can do both, or can lead
    /// to several other states of the component.
    fn scan(&self, component: &[u32], buffers: &mut PathBuffers<N>) -> bool {
        buffers.steps.clear();
        buffers.exits.clear();
        for (from, state) in component.iter().enumerate() {
            for choice in self.problem.choices(*state as usize) {
                let (mut to, mut leaves, mut sure) = (NONE, false, true);
                for target in self.problem.mdp.targets(choice) {
                    let position = self.position[*target as usize];
                    if position == NONE {
                        leaves = true;
                        sure &= self.solution.sure.contains(*target as usize);
                    } else if position != dense(from) {
                        if to != NONE {
                            return false;
                        }
                        to = position;
                    }
                }
                match (to, leaves) {
                    (NONE, false) => {} // The choice only loops.
                    (NONE, true) => buffers.exits.push((dense(from), dense(choice), sure)),
                    (_, true) => return false,
                    (to, false) => {
                        let (cost, divided) = self.step_cost(*state, choice);
                        buffers.steps.push(Step {
                            from: dense(from),
                            to,
                            choice: dense(choice),
                            cost,
                            divided,
                        });
                    }
                }
            }
        }
        true
    }

    /// Returns the expected cost of a step that is repeated until it succeeds, and `true` if the
    /// cost was computed by a division.
    fn step_cost(&self, state: u32, choice: usize) -> (N, bool) {
        let reward = self.problem.reward(choice);
        if reward.is_zero() || self.problem.mdp.targets(choice).len() == 1 {
            return (reward, false);
        }
        let success = self.problem.mdp.transitions(choice).find(|(target, _)| *target != state as usize);
        (success.map_or(reward.clone(), |(_, probability)| reward.over(probability)), true)
    }

    fn greatest_probability(&mut self, component: &[u32], buffers: &mut PathBuffers<N>) {
        buffers.begin(component.len());
        for (from, choice, sure) in &buffers.exits {
            if *sure {
                buffers.best[*from as usize] = Some((N::one(), *choice));
            }
        }
        if buffers.best.iter().any(Option::is_some) {
            buffers.spread(Direction::Max);
            let is_one = self.sure_is_one();
            for (state, best) in component.iter().zip(&buffers.best) {
                let Some((_, choice)) = best else { continue };
                self.solution.sure.insert(*state as usize);
                if is_one {
                    self.solution.values[*state as usize] = N::one();
                    self.solution.policy[*state as usize] = *choice;
                }
            }
            if is_one && buffers.best.iter().all(Option::is_some) {
                return;
            }
            if is_one {
                // The probabilities of the states with a value in `best` are known to be 1. Only the other
                // states are solved below: they cannot reach an exit from which a terminal state is
                // reached with probability 1.
                buffers.exits.retain(|(from, ..)| buffers.best[*from as usize].is_none());
                buffers.steps.retain(|step| buffers.best[step.from as usize].is_none());
            }
        }
        buffers.begin(component.len());
        self.leave(component, buffers, false);
        buffers.spread(Direction::Max);
        self.write(component, buffers);
    }

    fn least_reward(&mut self, component: &[u32], buffers: &mut PathBuffers<N>) {
        buffers.begin(component.len());
        self.leave(component, buffers, true);
        buffers.spread(Direction::Min);
        for (state, best) in component.iter().zip(&buffers.best) {
            match best {
                Some(_) => self.solution.sure.insert(*state as usize),
                None => self.solution.infinite.insert(*state as usize),
            }
        }
        self.write(component, buffers);
    }

    /// Evaluates the choices that leave the component, and stores the best such choice of each state in
    /// `buffers`. With `must_be_sure`, only choices count after which a terminal state is reached with
    /// probability 1.
    fn leave(&mut self, component: &[u32], buffers: &mut PathBuffers<N>, must_be_sure: bool) {
        for (from, choice, _) in &buffers.exits {
            let state = component[*from as usize] as usize;
            let Some((value, error)) = self.single_choice(state, *choice as usize, must_be_sure) else {
                continue;
            };
            buffers.error = buffers.error.max(error);
            if value.is_zero() {
                buffers.zero_error = buffers.zero_error.max(error);
            }
            buffers.whole &= !N::EXACT && is_whole(value.to_f64());
            let best = &mut buffers.best[*from as usize];
            if best.as_ref().is_none_or(|(incumbent, _)| better(self.problem.direction, &value, incumbent)) {
                *best = Some((value, *choice));
            }
        }
    }

    fn write(&mut self, component: &[u32], buffers: &PathBuffers<N>) {
        for (state, best) in component.iter().zip(&buffers.best) {
            let Some((value, choice)) = best else { continue };
            let state = *state as usize;
            if !N::EXACT {
                // Each step of a path adds a cost, which may have been rounded by a division.
                let sums = 3.0 * count(component.len()) * f64::EPSILON * value.to_f64();
                let rounding = if buffers.whole { 0.0 } else { sums };
                self.solution.errors[state] =
                    if value.is_zero() { buffers.zero_error } else { buffers.error + rounding };
            }
            self.solution.values[state] = value.clone();
            self.solution.policy[state] = *choice;
        }
    }
}

fn better<N: Number>(direction: Direction, value: &N, incumbent: &N) -> bool {
    match direction {
        Direction::Min => value < incumbent,
        Direction::Max => value > incumbent,
    }
}

impl<N: Number> PathBuffers<N> {
    fn begin(&mut self, states: usize) {
        self.best.clear();
        self.best.resize(states, None);
        self.settled.clear();
        self.settled.resize(states, false);
        (self.error, self.zero_error) = (0.0, 0.0);
        // A path has fewer than `MAX_STATES` steps, so the sum of its costs is an exact integer.
        let whole = |step: &Step<N>| {
            let cost = step.cost.to_f64();
            !step.divided && is_whole(cost) && is_whole(cost * count(MAX_STATES))
        };
        self.whole = !N::EXACT && self.steps.iter().all(whole);
    }

    /// Propagates the best values backwards along the steps (choices that lead to another state of the
    /// component), starting from the state with the best value (Dijkstra).
    fn spread(&mut self, direction: Direction) {
        loop {
            let mut next: Option<(usize, &N)> = None;
            for (number, best) in self.best.iter().enumerate() {
                let Some((value, _)) = best.as_ref().filter(|_| !self.settled[number]) else { continue };
                if next.is_none_or(|(_, incumbent)| better(direction, value, incumbent)) {
                    next = Some((number, value));
                }
            }
            let Some((settled, value)) = next.map(|(number, value)| (number, value.clone())) else { return };
            self.settled[settled] = true;
            for step in self.steps.iter().filter(|step| step.to as usize == settled) {
                let from = step.from as usize;
                if self.settled[from] {
                    continue;
                }
                let value = if step.cost.is_zero() { value.clone() } else { value.plus(&step.cost) };
                if self.best[from].as_ref().is_none_or(|(incumbent, _)| better(direction, &value, incumbent))
                {
                    self.best[from] = Some((value, step.choice));
                }
            }
        }
    }
}

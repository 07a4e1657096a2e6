//! A small component whose choices either leave it or lead to one of its states for sure, to its values: by shortest ways.
//!
//! Reconfigurations that work, or that are tried until they work, are of this kind, and they are nearly all of the
//! components of a co-adaptation process. The best value spreads from the choices that leave (Dijkstra 1959), so that no
//! equations have to be solved, and the only errors are those of a few sums.

use crate::mdp::dense;
use crate::number::{Number, count, is_whole};
use crate::solve::local::NONE;
use crate::solve::problem::{Direction, Run};

/// States up to which the next best state is looked for one by one.
const SMALL: usize = 64;

/// Buffers.
#[derive(Debug)]
pub struct Ways<N> {
    /// The best value so far, and the choice, for each state of the component.
    best: Vec<Option<(N, u32)>>,
    settled: Vec<bool>,
    steps: Vec<Step<N>>,
    /// Choices that leave: state, choice, whether they do so for good.
    exits: Vec<(u32, u32, bool)>,
    /// The greatest error of what leaving choices are worth.
    error: f64,
    /// The greatest one among those that are worth nothing.
    zero_error: f64,
    /// Whether all sums are of whole numbers.
    whole: bool,
}

#[derive(Debug, Clone)]
struct Step<N> {
    from: u32,
    to: u32,
    choice: u32,
    cost: N,
    /// Whether the cost was divided, and so perhaps rounded.
    divided: bool,
}

impl<N> Default for Ways<N> {
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
    /// Solves a component of this kind; false, and nothing is done, if it is of another kind.
    pub fn ways(&mut self, component: &[u32], ways: &mut Ways<N>) -> bool {
        let by_choice = self.sure_by_choice();
        // Where choices are restricted, the component may not hang together by those that are left.
        if component.len() > SMALL || !by_choice && self.problem.allowed.is_some() {
            return false;
        }
        for (number, state) in component.iter().enumerate() {
            self.position[*state as usize] = dense(number);
        }
        let fits = self.scan(component, ways);
        for state in component {
            self.position[*state as usize] = NONE;
        }
        if !fits {
            return false;
        }
        match (self.problem.rewards.is_some(), by_choice) {
            (false, true) => self.greatest_probability(component, ways),
            (true, true) => self.least_reward(component, ways),
            // One can go round for ever, from each state.
            (true, false) => component.iter().for_each(|state| {
                self.solution.infinite.insert(*state as usize);
            }),
            (false, false) => {
                for step in &ways.steps {
                    self.solution.policy[component[step.from as usize] as usize] = step.choice;
                }
            }
        }
        true
    }

    /// Sorts the choices; false if one is of another kind.
    fn scan(&self, component: &[u32], ways: &mut Ways<N>) -> bool {
        ways.steps.clear();
        ways.exits.clear();
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
                    (NONE, false) => {} // It stays where it is.
                    (NONE, true) => ways.exits.push((dense(from), dense(choice), sure)),
                    (_, true) => return false,
                    (to, false) => {
                        let (cost, divided) = self.step_cost(*state, choice);
                        ways.steps.push(Step { from: dense(from), to, choice: dense(choice), cost, divided });
                    }
                }
            }
        }
        true
    }

    /// What it takes to get along a step that is tried until it works; whether that was divided.
    fn step_cost(&self, state: u32, choice: usize) -> (N, bool) {
        let reward = self.problem.reward(choice);
        if reward.is_zero() || self.problem.mdp.targets(choice).len() == 1 {
            return (reward, false);
        }
        let works = self.problem.mdp.transitions(choice).find(|(target, _)| *target != state as usize);
        (works.map_or(reward.clone(), |(_, probability)| reward.over(probability)), true)
    }

    fn greatest_probability(&mut self, component: &[u32], ways: &mut Ways<N>) {
        ways.begin(component.len());
        for (from, choice, sure) in &ways.exits {
            if *sure {
                ways.best[*from as usize] = Some((N::one(), *choice));
            }
        }
        if ways.best.iter().any(Option::is_some) {
            ways.spread(Direction::Max);
            let known = self.sure_is_one();
            for (state, best) in component.iter().zip(&ways.best) {
                let Some((_, choice)) = best else { continue };
                self.solution.sure.insert(*state as usize);
                if known {
                    self.solution.values[*state as usize] = N::one();
                    self.solution.policy[*state as usize] = *choice;
                }
            }
            if known && ways.best.iter().all(Option::is_some) {
                return;
            }
            if known {
                // The rest cannot get to what is sure.
                ways.exits.retain(|(from, ..)| ways.best[*from as usize].is_none());
                ways.steps.retain(|step| ways.best[step.from as usize].is_none());
            }
        }
        ways.begin(component.len());
        self.leave(component, ways, false);
        ways.spread(Direction::Max);
        self.write(component, ways);
    }

    fn least_reward(&mut self, component: &[u32], ways: &mut Ways<N>) {
        ways.begin(component.len());
        self.leave(component, ways, true);
        ways.spread(Direction::Min);
        for (state, best) in component.iter().zip(&ways.best) {
            match best {
                Some(_) => self.solution.sure.insert(*state as usize),
                None => self.solution.infinite.insert(*state as usize),
            }
        }
        self.write(component, ways);
    }

    /// What the choices that leave are worth.
    fn leave(&mut self, component: &[u32], ways: &mut Ways<N>, must_be_sure: bool) {
        for (from, choice, _) in &ways.exits {
            let state = component[*from as usize] as usize;
            let Some((value, error)) = self.single_choice(state, *choice as usize, must_be_sure) else {
                continue;
            };
            ways.error = ways.error.max(error);
            if value.is_zero() {
                ways.zero_error = ways.zero_error.max(error);
            }
            ways.whole &= !N::EXACT && is_whole(value.to_f64());
            let best = &mut ways.best[*from as usize];
            if best.as_ref().is_none_or(|(known, _)| better(self.problem.direction, &value, known)) {
                *best = Some((value, *choice));
            }
        }
    }

    fn write(&mut self, component: &[u32], ways: &Ways<N>) {
        for (state, best) in component.iter().zip(&ways.best) {
            let Some((value, choice)) = best else { continue };
            let state = *state as usize;
            if !N::EXACT {
                // Each step of the way adds once, and may divide and round its cost.
                let sums = 3.0 * count(component.len()) * f64::EPSILON * value.to_f64();
                let rounding = if ways.whole { 0.0 } else { sums };
                self.solution.errors[state] =
                    if value.is_zero() { ways.zero_error } else { ways.error + rounding };
            }
            self.solution.values[state] = value.clone();
            self.solution.policy[state] = *choice;
        }
    }
}

fn better<N: Number>(direction: Direction, value: &N, known: &N) -> bool {
    match direction {
        Direction::Min => value < known,
        Direction::Max => value > known,
    }
}

impl<N: Number> Ways<N> {
    fn begin(&mut self, states: usize) {
        self.best.clear();
        self.best.resize(states, None);
        self.settled.clear();
        self.settled.resize(states, false);
        (self.error, self.zero_error) = (0.0, 0.0);
        let whole = |step: &Step<N>| !step.divided && is_whole(step.cost.to_f64() * count(SMALL));
        self.whole = !N::EXACT && self.steps.iter().all(whole);
    }

    /// Lets the best values spread along the steps, best first.
    fn spread(&mut self, direction: Direction) {
        loop {
            let mut next: Option<(usize, &N)> = None;
            for (number, best) in self.best.iter().enumerate() {
                let Some((value, _)) = best.as_ref().filter(|_| !self.settled[number]) else { continue };
                if next.is_none_or(|(_, known)| better(direction, value, known)) {
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
                if self.best[from].as_ref().is_none_or(|(known, _)| better(direction, &value, known)) {
                    self.best[from] = Some((value, step.choice));
                }
            }
        }
    }
}

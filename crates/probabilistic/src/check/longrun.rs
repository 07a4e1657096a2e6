//! Infinite-horizon properties: Büchi objectives, total rewards, and long-run averages.
//!
//! With probability 1 a path eventually stays in an end component (de Alfaro, "Formal Verification
//! of Probabilistic Systems", 1997). In an end component a policy can visit all states infinitely
//! often.

use fixedbitset::FixedBitSet;

use crate::check::ask::{Checked, refusal, within_budget};
use crate::check::paths::{Valued, inverse};
use crate::check::query::Query;
use crate::check::vector::{Span, Vector};
use crate::graph::components;
use crate::mdp::{Mdp, dense};
use crate::number::Number;
use crate::prism::ast::ModelKind;
use crate::solve::{Direction, NONE, Problem, solve_within};

struct Ends {
    /// For each state the index of its end component, or [`NONE`] outside all end components.
    block: Vec<u32>,
    count: usize,
    /// The choices whose targets all lie in the end component of their state.
    alive: FixedBitSet,
}

impl<N: Number> Query<'_, N> {
    fn no_given_policy(&self) -> Checked<()> {
        match self.evaluated {
            None => Ok(()),
            Some(_) => Err(refusal("Q403", "policies are not evaluated for long-run properties")),
        }
    }

    /// Computes for each state the optimal probability of visiting a state of `goal` infinitely
    /// often.
    pub fn repeatedly(&self, direction: Direction, goal: &FixedBitSet) -> Checked<Valued<N>> {
        self.no_given_policy()?;
        let mut good = FixedBitSet::with_capacity(self.mdp().states());
        match direction {
            Direction::Max => {
                let ends = end_components(self.mdp(), &self.every());
                let mut visited = vec![false; ends.count];
                for state in goal.ones().filter(|state| ends.block[*state] != NONE) {
                    visited[ends.block[state] as usize] = true;
                }
                for (state, block) in ends.block.iter().enumerate() {
                    good.set(state, *block != NONE && visited[*block as usize]);
                }
                self.solved(self.problem(Direction::Max, None, &good)).map(without_policy)
            }
            // The minimum is the complement of the greatest probability of eventually avoiding the
            // goal forever.
            Direction::Min => {
                let ends = end_components(self.mdp(), &inverse(goal.clone()));
                for (state, block) in ends.block.iter().enumerate() {
                    good.set(state, *block != NONE);
                }
                let away = self.solved(self.problem(Direction::Max, None, &good))?;
                Ok(away.vector.complement().into())
            }
        }
    }

    pub fn total(&self, direction: Direction, rewards: &[N]) -> Checked<Valued<N>> {
        self.no_given_policy()?;
        if direction == Direction::Min || self.program.kind == ModelKind::Dtmc {
            // A total is finite only if the path is eventually without rewards forever. So the goal is to reach
            // a state from which a policy avoids all further rewards.
            let free = self.free_forever(rewards);
            return self.solved(self.problem(Direction::Min, Some(rewards), &free)).map(without_policy);
        }
        let mdp = self.mdp();
        let ends = end_components(mdp, &self.every());
        let mut infinite = FixedBitSet::with_capacity(mdp.states());
        for state in (0..mdp.states()).filter(|state| ends.block[*state] != NONE) {
            let pays = mdp.choices(state).any(|c| ends.alive.contains(c) && !rewards[c].is_zero());
            infinite.set(state, pays);
        }
        // From a state that can reach a state of infinite value, the value is infinite, too.
        reach_back(mdp, &mut infinite);
        let merged = EcQuotient::new(mdp, &ends, rewards, &infinite)?;
        let problem = Problem::new(&merged.mdp, Direction::Max, Some(&merged.rewards), &merged.end);
        let solution = within_budget(solve_within(problem, None, &mut self.work.borrow_mut()))?;
        let solved = Vector::solved(solution, Span::Positive);
        let place = |state: usize| merged.place[state] as usize;
        let finite = |state: &usize| !infinite.contains(*state);
        let values = (0..mdp.states())
            .map(|state| if finite(&state) { solved.values[place(state)].clone() } else { N::zero() });
        let values = values.collect();
        let errors =
            (0..mdp.states()).map(|state| if finite(&state) { solved.error(place(state)) } else { 0.0 });
        let errors = if N::EXACT { Vec::new() } else { errors.collect() };
        Ok(Vector { values, errors, infinite, span: Span::Positive }.into())
    }

    /// Returns the states from which a policy can avoid all nonzero rewards forever (a greatest
    /// fixpoint).
    fn free_forever(&self, rewards: &[N]) -> FixedBitSet {
        let (mdp, mut free) = (self.mdp(), self.every());
        let incoming = Incoming::new(mdp);
        // The choices without a reward whose targets are all free, and their number for each state.
        let mut usable = FixedBitSet::with_capacity(mdp.choice_count());
        usable.extend((0..mdp.choice_count()).filter(|choice| rewards[*choice].is_zero()));
        let count = |state| mdp.choices(state).filter(|choice| usable.contains(*choice)).count();
        let mut counts: Vec<usize> = (0..mdp.states()).map(count).collect();
        let mut queue: Vec<usize> = (0..mdp.states()).filter(|state| counts[*state] == 0).collect();
        while let Some(state) = queue.pop() {
            free.set(state, false);
            for choice in incoming.of(state) {
                if usable.contains(choice) {
                    usable.set(choice, false);
                    let owner = mdp.owner(choice);
                    counts[owner] = counts[owner].saturating_sub(1);
                    if counts[owner] == 0 {
                        queue.push(owner);
                    }
                }
            }
        }
        free
    }

    /// Computes for each state of a Markov chain the long-run average reward per step.
    ///
    /// In each bottom strongly connected component, one state is chosen. The average in a component is the
    /// expected reward between two visits of the chosen state, divided by the expected number of steps between
    /// these visits (renewal theorem). The value of a state is the mean of the components' averages, weighted
    /// by the probabilities of reaching them.
    pub fn long_run(&self, rewards: &[N]) -> Checked<Valued<N>> {
        self.no_given_policy()?;
        let mdp = self.mdp();
        let ends = end_components(mdp, &self.every());
        let mut chosen = FixedBitSet::with_capacity(mdp.states());
        let mut is_represented = vec![false; ends.count];
        for (state, block) in ends.block.iter().enumerate() {
            if *block != NONE && !std::mem::replace(&mut is_represented[*block as usize], true) {
                chosen.insert(state);
            }
        }
        let ones = vec![N::one(); mdp.choice_count()];
        let sums = self.solved(self.problem(Direction::Max, Some(rewards), &chosen))?.vector;
        let steps = self.solved(self.problem(Direction::Max, Some(&ones), &chosen))?.vector;
        let mut averages = vec![N::zero(); mdp.states()];
        let mut error = 0.0_f64;
        for state in chosen.ones() {
            let choice = mdp.choices(state).start;
            let (mut sum, mut time) = (rewards[choice].clone(), N::one());
            let (mut sum_error, mut time_error) = (0.0, 0.0);
            for (target, probability) in mdp.transitions(choice) {
                sum = sum.plus(&probability.times(&sums.values[target]));
                time = time.plus(&probability.times(&steps.values[target]));
                sum_error += probability.to_f64() * sums.error(target);
                time_error += probability.to_f64() * steps.error(target);
            }
            let average = sum.over(&time);
            if !N::EXACT {
                let rounding = 16.0 + 4.0 * crate::number::count(mdp.targets(choice).len());
                let (value, duration) = (average.to_f64(), time.to_f64());
                let least_duration = (duration - time_error).max(f64::MIN_POSITIVE);
                error = error
                    .max((sum_error + value * time_error) / least_duration + rounding * f64::EPSILON * value);
            }
            averages[state] = average;
        }
        let problem =
            Problem { terminal_values: Some(&averages), ..Problem::new(mdp, Direction::Max, None, &chosen) };
        let solution = within_budget(solve_within(problem, None, &mut self.work.borrow_mut()))?;
        let mut vector = Vector::solved(solution, Span::Positive);
        for bound in &mut vector.errors {
            *bound += error;
        }
        Ok(vector.into())
    }
}

fn without_policy<N>(values: Valued<N>) -> Valued<N> {
    Valued { policy: None, ..values }
}

fn reach_back<N: Number>(mdp: &Mdp<N>, set: &mut FixedBitSet) {
    let incoming = Incoming::new(mdp);
    let mut queue: Vec<usize> = set.ones().collect();
    while let Some(state) = queue.pop() {
        for choice in incoming.of(state) {
            let owner = mdp.owner(choice);
            if !set.put(owner) {
                queue.push(owner);
            }
        }
    }
}

/// For each state, the choices that lead to it. With this index, a step of a fixpoint iteration need not scan all
/// states.
struct Incoming {
    starts: Vec<usize>,
    choices: Vec<u32>,
}

impl Incoming {
    fn new<N: Number>(mdp: &Mdp<N>) -> Self {
        let mut starts = vec![0_usize; mdp.states().saturating_add(1)];
        for target in (0..mdp.choice_count()).flat_map(|choice| mdp.targets(choice)) {
            starts[*target as usize] = starts[*target as usize].saturating_add(1);
        }
        let mut end = 0_usize;
        for start in &mut starts {
            end = end.saturating_add(*start);
            *start = end;
        }
        // Choices are inserted from last to first, so each start moves down to the first choice to its state.
        let mut choices = vec![0_u32; mdp.transition_count()];
        for choice in (0..mdp.choice_count()).rev() {
            for target in mdp.targets(choice) {
                let at = &mut starts[*target as usize];
                *at = at.saturating_sub(1);
                choices[*at] = dense(choice);
            }
        }
        Self { starts, choices }
    }

    fn of(&self, state: usize) -> impl Iterator<Item = usize> {
        let range = self.starts[state]..self.starts[state.saturating_add(1)];
        self.choices[range].iter().map(|choice| *choice as usize)
    }
}

fn end_components<N: Number>(mdp: &Mdp<N>, inside: &FixedBitSet) -> Ends {
    let n = mdp.states();
    let within = |choice: usize| mdp.targets(choice).iter().all(|target| inside.contains(*target as usize));
    let mut alive = FixedBitSet::with_capacity(mdp.choice_count());
    for state in inside.ones() {
        mdp.choices(state).filter(|choice| within(*choice)).for_each(|choice| alive.insert(choice));
    }
    let mut component = vec![0_u32; n];
    loop {
        let (mut first, mut edges) = (vec![0_usize], Vec::new());
        for state in 0..n {
            for choice in mdp.choices(state).filter(|choice| alive.contains(*choice)) {
                edges.extend_from_slice(mdp.targets(choice));
            }
            first.push(edges.len());
        }
        let edges_of = |state: u32| {
            let state = state as usize;
            &edges[first[state]..first[state.saturating_add(1)]]
        };
        for (number, members) in components(n, edges_of).iter().enumerate() {
            for state in members {
                component[*state as usize] = dense(number);
            }
        }
        let leaves = |choice: &usize| {
            let source = component[mdp.owner(*choice)];
            mdp.targets(*choice).iter().any(|target| component[*target as usize] != source)
        };
        let leaving: Vec<usize> = alive.ones().filter(leaves).collect();
        if leaving.is_empty() {
            break;
        }
        for choice in leaving {
            alive.set(choice, false);
        }
    }
    let (mut block, mut count) = (vec![NONE; n], 0_usize);
    let mut numbers = vec![NONE; n];
    for state in 0..n {
        if mdp.choices(state).any(|choice| alive.contains(choice)) {
            let number = &mut numbers[component[state] as usize];
            if *number == NONE {
                *number = dense(count);
                count = count.saturating_add(1);
            }
            block[state] = *number;
        }
    }
    Ends { block, count, alive }
}

/// The end-component quotient of an MDP, without the states of infinite value. Each end component
/// becomes one state with an additional choice to stop.
struct EcQuotient<N> {
    mdp: Mdp<N>,
    rewards: Vec<N>,
    /// For each original state its index in the quotient, or [`NONE`] for a state of infinite
    /// value.
    place: Vec<u32>,
    end: FixedBitSet,
}

impl<N: Number> EcQuotient<N> {
    fn new(mdp: &Mdp<N>, ends: &Ends, rewards: &[N], infinite: &FixedBitSet) -> Checked<Self> {
        let mut place = vec![NONE; mdp.states()];
        let mut members: Vec<Vec<usize>> = Vec::new();
        let mut of_block = vec![NONE; ends.count];
        for state in infinite.zeroes().take_while(|state| *state < mdp.states()) {
            let number = match ends.block[state] {
                NONE => dense(members.len()),
                block if of_block[block as usize] != NONE => of_block[block as usize],
                block => {
                    of_block[block as usize] = dense(members.len());
                    dense(members.len())
                }
            };
            place[state] = number;
            match members.get_mut(number as usize) {
                Some(block_members) => block_members.push(state),
                None => members.push(vec![state]),
            }
        }
        let stop = members.len();
        let mut merged = Mdp::default();
        let mut kept_rewards = Vec::new();
        for states in &members {
            for state in states {
                for choice in mdp.choices(*state).filter(|choice| !ends.alive.contains(*choice)) {
                    for (target, probability) in mdp.transitions(choice) {
                        merged.push_transition(place[target], probability.clone());
                    }
                    merged.end_choice(mdp.action(choice))?;
                    kept_rewards.push(rewards[choice].clone());
                }
            }
            if states.first().is_some_and(|state| ends.block[*state] != NONE) {
                merged.push_transition(dense(stop), N::one());
                merged.end_choice(0)?;
                kept_rewards.push(N::zero());
            }
            merged.end_state();
        }
        merged.push_transition(dense(stop), N::one());
        merged.end_choice(0)?;
        kept_rewards.push(N::zero());
        merged.end_state();
        let mut end = FixedBitSet::with_capacity(merged.states());
        end.insert(stop);
        Ok(Self { mdp: merged, rewards: kept_rewards, place, end })
    }
}

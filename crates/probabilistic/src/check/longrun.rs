//! What happens for ever: states that are visited again and again, rewards without end, averages in the long run.
//!
//! A path stays in an end component from some day on, with probability 1 (de Alfaro, "Formal Verification of
//! Probabilistic Systems", 1997), and a policy can visit all of an end component again and again.

use fixedbitset::FixedBitSet;

use crate::check::ask::{Asked, refusal, worked};
use crate::check::paths::{Valued, inverse};
use crate::check::query::Query;
use crate::check::vector::{Span, Vector};
use crate::graph::components;
use crate::mdp::{Mdp, dense};
use crate::number::Number;
use crate::prism::ast::ModelKind;
use crate::solve::{Direction, NONE, Problem, solve_within};

/// The maximal end components of a process.
struct Ends {
    /// For each state the number of its end component, [`NONE`] outside.
    block: Vec<u32>,
    /// How many there are.
    count: usize,
    /// The choices that stay in them.
    alive: FixedBitSet,
}

impl<N: Number> Query<'_, N> {
    fn no_given_policy(&self) -> Asked<()> {
        match self.given {
            None => Ok(()),
            Some(_) => Err(refusal("Q403", "a policy is not evaluated for what happens for ever")),
        }
    }

    /// The probabilities of visiting some states again and again.
    pub fn repeatedly(&self, direction: Direction, goal: &FixedBitSet) -> Asked<Valued<N>> {
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
            // The opposite: to stay away from some day on.
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

    /// Expected rewards that are summed for ever.
    pub fn total(&self, direction: Direction, rewards: &[N]) -> Asked<Valued<N>> {
        self.no_given_policy()?;
        if direction == Direction::Min || self.program.kind == ModelKind::Dtmc {
            // A sum is finite if, from some day on, nothing is paid any more.
            let free = self.free_for_ever(rewards);
            return self.solved(self.problem(Direction::Min, Some(rewards), &free)).map(without_policy);
        }
        let mdp = self.mdp();
        let ends = end_components(mdp, &self.every());
        let mut infinite = FixedBitSet::with_capacity(mdp.states());
        for state in (0..mdp.states()).filter(|state| ends.block[*state] != NONE) {
            let pays = mdp.choices(state).any(|c| ends.alive.contains(c) && !rewards[c].is_zero());
            infinite.set(state, pays);
        }
        reach_back(mdp, &mut infinite);
        let merged = Merged::new(mdp, &ends, rewards, &infinite)?;
        let problem = Problem::new(&merged.mdp, Direction::Max, Some(&merged.rewards), &merged.end);
        let solution = worked(solve_within(problem, None, &mut self.work.borrow_mut()))?;
        let found = Vector::solved(solution, Span::Positive);
        let place = |state: usize| merged.place[state] as usize;
        let finite = |state: &usize| !infinite.contains(*state);
        let values = (0..mdp.states())
            .map(|state| if finite(&state) { found.values[place(state)].clone() } else { N::zero() });
        let values = values.collect();
        let errors =
            (0..mdp.states()).map(|state| if finite(&state) { found.error(place(state)) } else { 0.0 });
        let errors = if N::EXACT { Vec::new() } else { errors.collect() };
        Ok(Vector { values, errors, infinite, span: Span::Positive }.into())
    }

    /// The states in which one can go on for ever without being paid.
    fn free_for_ever(&self, rewards: &[N]) -> FixedBitSet {
        let mdp = self.mdp();
        let mut free = self.every();
        loop {
            let stays = |state: usize| {
                mdp.choices(state).any(|choice| {
                    rewards[choice].is_zero()
                        && mdp.targets(choice).iter().all(|t| free.contains(*t as usize))
                })
            };
            let lost: Vec<usize> = free.ones().filter(|state| !stays(*state)).collect();
            if lost.is_empty() {
                return free;
            }
            for state in lost {
                free.set(state, false);
            }
        }
    }

    /// Average rewards of a step of a Markov chain in the long run.
    ///
    /// In each closed component one state is chosen. From one visit of it to the next, the rewards and the steps have
    /// expected sums, and their quotient is the average (the renewal theorem); how often each component is ended up in
    /// is a question of reachability.
    pub fn long_run(&self, rewards: &[N]) -> Asked<Valued<N>> {
        self.no_given_policy()?;
        let mdp = self.mdp();
        let ends = end_components(mdp, &self.every());
        let mut chosen = FixedBitSet::with_capacity(mdp.states());
        let mut known = vec![false; ends.count];
        for (state, block) in ends.block.iter().enumerate() {
            if *block != NONE && !std::mem::replace(&mut known[*block as usize], true) {
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
                let (own, long) = (average.to_f64(), time.to_f64());
                let shorter = (long - time_error).max(f64::MIN_POSITIVE);
                error = error.max((sum_error + own * time_error) / shorter + rounding * f64::EPSILON * own);
            }
            averages[state] = average;
        }
        let problem =
            Problem { terminal_values: Some(&averages), ..Problem::new(mdp, Direction::Max, None, &chosen) };
        let solution = worked(solve_within(problem, None, &mut self.work.borrow_mut()))?;
        let mut vector = Vector::solved(solution, Span::Positive);
        for own in &mut vector.errors {
            *own += error;
        }
        Ok(vector.into())
    }
}

fn without_policy<N>(found: Valued<N>) -> Valued<N> {
    Valued { policy: None, ..found }
}

/// Adds all states from which the set can be reached.
fn reach_back<N: Number>(mdp: &Mdp<N>, set: &mut FixedBitSet) {
    loop {
        let reaches =
            |state: &usize| mdp.successors(*state).iter().any(|target| set.contains(*target as usize));
        let more: Vec<usize> = set.zeroes().filter(reaches).collect();
        if more.is_empty() {
            return;
        }
        set.extend(more);
    }
}

/// The maximal end components within some states.
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
            let own = component[mdp.owner(*choice)];
            mdp.targets(*choice).iter().any(|target| component[*target as usize] != own)
        };
        let lost: Vec<usize> = alive.ones().filter(leaves).collect();
        if lost.is_empty() {
            break;
        }
        for choice in lost {
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

/// A process whose end components are single states, in which one can stop.
struct Merged<N> {
    mdp: Mdp<N>,
    rewards: Vec<N>,
    /// For each state of the other process its number here.
    place: Vec<u32>,
    /// Where it stops.
    end: FixedBitSet,
}

impl<N: Number> Merged<N> {
    /// Leaves out the states whose value is infinite.
    fn new(mdp: &Mdp<N>, ends: &Ends, rewards: &[N], infinite: &FixedBitSet) -> Asked<Self> {
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
                Some(known) => known.push(state),
                None => members.push(vec![state]),
            }
        }
        let stop = members.len();
        let mut merged = Mdp::default();
        let mut kept = Vec::new();
        for states in &members {
            for state in states {
                for choice in mdp.choices(*state).filter(|choice| !ends.alive.contains(*choice)) {
                    for (target, probability) in mdp.transitions(choice) {
                        merged.push_transition(place[target], probability.clone());
                    }
                    merged.end_choice(mdp.action(choice))?;
                    kept.push(rewards[choice].clone());
                }
            }
            if states.first().is_some_and(|state| ends.block[*state] != NONE) {
                merged.push_transition(dense(stop), N::one());
                merged.end_choice(0)?;
                kept.push(N::zero());
            }
            merged.end_state();
        }
        merged.push_transition(dense(stop), N::one());
        merged.end_choice(0)?;
        kept.push(N::zero());
        merged.end_state();
        let mut end = FixedBitSet::with_capacity(merged.states());
        end.insert(stop);
        Ok(Self { mdp: merged, rewards: kept, place, end })
    }
}

//! Solves a problem on a Markov decision process: computes an optimal policy and the value of each state. In
//! doubles, it also bounds the errors of the values.
//!
//! The strongly connected components of the graph are solved in reverse topological order. The values of an
//! acyclic part (e.g. a battery that is never recharged) therefore result from a single sweep. Inside a
//! component:
//!
//! 1. Values 0, 1 and ∞ follow from the graph alone (Forejt et al., "Automated Verification
//!    Techniques for Probabilistic Systems", SFM 2011, section 4).
//! 2. End components are merged, so that the equations have a unique solution (Haddad and Monmege,
//!    TCS 735, 2018; for zero-reward end components: Bertsekas and Tsitsiklis, Math. OR 16(3),
//!    1991).
//! 3. Policy iteration solves the Markov chain of each policy directly.
//! 4. In doubles, the error of the result is bounded by a certificate (`certify`) or by another method
//!    (`doubles`).
//!
//! Small components of a simple form are solved by shortest paths instead (`ways`).

pub(crate) mod certify;
pub(crate) mod chain;
mod component;
mod doubles;
mod interval;
mod iterate;
pub(crate) mod local;
mod problem;
mod quotient;
mod users;
mod ways;
pub(crate) mod work;

use fixedbitset::FixedBitSet;

use crate::graph::visit_components;
use crate::mdp::dense;
use crate::number::{Number, is_whole};

use problem::{Run, UNDERFLOW_BOUND};

pub use local::NONE;
pub use problem::{Direction, Problem, Solution};
pub(crate) use work::Work;

struct TooMuchWork;

/// Solves a problem. Returns `None` if exact arithmetic exceeds its default budget.
///
/// `hint` is an initial policy for policy iteration, for example the policy of a solution in
/// doubles.
pub fn solve<N: Number>(problem: Problem<'_, N>, hint: Option<&[u32]>) -> Option<Solution<N>> {
    solve_within(problem, hint, &mut Work::new(work::DEFAULT_BUDGET))
}

/// Solves a problem within the given budget of exact arithmetic. Returns `None` if the budget is
/// exceeded, or if the caller has cancelled the computation.
pub(crate) fn solve_within<N: Number>(
    problem: Problem<'_, N>,
    hint: Option<&[u32]>,
    work: &mut Work<'_>,
) -> Option<Solution<N>> {
    let mut run = Run { work: *work, ..begin(problem, hint) };
    let outcome = run.solve_components();
    work.continue_from(&run.work);
    outcome.map(|()| run.solution)
}

/// Computes a good policy without bounding its error; the policy may not be optimal. Returns `None`
/// if exact arithmetic exceeds its default budget.
pub(crate) fn draft<N: Number>(problem: Problem<'_, N>) -> Option<Vec<u32>> {
    let mut run = Run { draft: true, ..begin(problem, None) };
    run.solve_components()?;
    Some(run.solution.policy)
}

fn begin<'a, N: Number>(problem: Problem<'a, N>, hint: Option<&'a [u32]>) -> Run<'a, N> {
    let n = problem.mdp.states();
    let values = (0..n).map(|state| problem.worth(state)).collect();
    let solution = Solution {
        values,
        errors: if N::EXACT { Vec::new() } else { vec![0.0; n] },
        infinite: FixedBitSet::with_capacity(n),
        sure: problem.terminal.clone(),
        policy: vec![NONE; n],
    };
    let mut run = Run {
        problem,
        solution,
        hint,
        position: vec![NONE; n],
        work: Work::new(work::DEFAULT_BUDGET),
        draft: false,
    };
    run.solution.sure.grow(n);
    run
}

impl<N: Number> Run<'_, N> {
    /// Solves all strongly connected components, each after its successors. Returns `None` if exact
    /// arithmetic exceeds its budget, or if the caller has cancelled the computation.
    fn solve_components(&mut self) -> Option<()> {
        let (mut local, mut path_buffers) = (local::Local::new(), ways::PathBuffers::default());
        let problem = self.problem;
        let successors = |state: u32| {
            if problem.is_sink(state as usize) { &[] } else { problem.mdp.successors(state as usize) }
        };
        let visited = visit_components(problem.mdp.states(), successors, |component| {
            match component {
                [state] if problem.is_sink(*state as usize) => self.sink(*state as usize),
                [state] => self.single(*state as usize),
                _ if self.shortest_paths(component, &mut path_buffers) => {}
                _ => self.component(component, &mut local).ok_or(TooMuchWork)?,
            }
            let is_spent = N::EXACT && self.work.is_spent();
            if is_spent || self.work.poll(component.len()).is_none() { Err(TooMuchWork) } else { Ok(()) }
        });
        visited.ok()
    }

    fn sink(&mut self, state: usize) {
        if self.problem.rewards.is_some() && !self.problem.terminal.contains(state) {
            self.solution.infinite.insert(state);
        }
    }

    /// Solves a state that is a component by itself. Apart from the state itself, all its
    /// successors are solved already.
    fn single(&mut self, state: usize) {
        let (mut sure_choice, mut all_sure) = (NONE, true);
        for choice in self.problem.choices(state) {
            let mut leaves = false;
            let targets_sure = self.problem.mdp.targets(choice).iter().all(|target| {
                leaves |= *target as usize != state;
                *target as usize == state || self.solution.sure.contains(*target as usize)
            });
            // A choice that only loops does not reach a terminal state.
            match targets_sure && leaves {
                true if sure_choice == NONE => sure_choice = dense(choice),
                true => {}
                false => all_sure = false,
            }
        }
        let by_choice = self.sure_by_choice();
        let is_sure = sure_choice != NONE && (by_choice || all_sure);
        if is_sure {
            self.solution.sure.insert(state);
        } else if self.problem.rewards.is_some() {
            self.solution.infinite.insert(state);
            return;
        }
        if is_sure && self.sure_is_one() {
            self.solution.values[state] = N::one();
            self.solution.policy[state] = sure_choice;
            return;
        }
        let must_be_sure = by_choice && self.problem.rewards.is_some();
        let mut best: Option<(N, u32, f64)> = None;
        let mut error = 0.0_f64;
        let problem = self.problem;
        for choice in problem.choices(state) {
            if let Some((value, spread)) = self.single_choice(state, choice, must_be_sure) {
                error = error.max(spread);
                let better = best.as_ref().is_none_or(|(incumbent, ..)| match self.problem.direction {
                    Direction::Min => value < *incumbent,
                    Direction::Max => value > *incumbent,
                });
                if better {
                    best = Some((value, dense(choice), spread));
                }
            }
        }
        if let Some((value, choice, spread)) = best {
            if !N::EXACT {
                // Values are never negative. So a least value of 0 has only the error of the selected choice.
                // A greatest value of 0 may result from a value that underflowed.
                let is_least = self.problem.direction == Direction::Min && value.is_zero();
                self.solution.errors[state] = if is_least { spread } else { error };
            }
            self.solution.values[state] = value;
            self.solution.policy[state] = choice;
        }
    }

    /// Returns the value of a choice whose successors, except the state itself, are solved already, and an upper
    /// limit on the error of the value. With `must_be_sure`, returns `None` for a choice after which a terminal
    /// state is not reached with probability 1. With rewards, also returns `None` for a choice that never leaves
    /// the state.
    fn single_choice(&mut self, state: usize, choice: usize, must_be_sure: bool) -> Option<(N, f64)> {
        let mdp = self.problem.mdp;
        let (mut sum, mut leaving, mut looping) = (self.problem.reward(choice), N::zero(), false);
        let mut whole = !N::EXACT && is_whole(sum.to_f64());
        let (mut error, mut terms, mut tiny, mut unsure) = (0.0_f64, 4.0, false, false);
        for (target, probability) in mdp.transitions(choice) {
            if target == state {
                looping = true;
                continue;
            }
            if must_be_sure && !self.solution.sure.contains(target) {
                return None;
            }
            let value = &self.solution.values[target];
            sum = sum.plus(&probability.times(value));
            leaving = leaving.plus(probability);
            terms += 2.0;
            if !N::EXACT {
                unsure |= self.solution.errors[target] > 0.0;
                error += probability.to_f64() * self.solution.errors[target];
                tiny |= !value.is_zero();
                whole &= is_whole(value.to_f64());
            }
            // If the budget is exceeded, `solve_components` notices this after the state.
            let _ = self.work.spend(&sum, 2);
        }
        if leaving.is_zero() {
            // The state is never left. Without rewards this is permitted, and the value is 0.
            return self.problem.rewards.is_none().then(|| (N::zero(), 0.0));
        }
        if looping {
            sum = sum.over(&leaving);
            error /= leaving.to_f64();
        }
        // The sum of rounded probabilities may be slightly more than 1.
        error *= 1.0 + terms * f64::EPSILON;
        error += if error > 0.0 || unsure { f64::MIN_POSITIVE } else { 0.0 };
        let size = sum.to_f64();
        // A choice with one successor, whose reward and value are integers, causes no rounding error.
        if whole && error == 0.0 && terms < 7.0 && !looping && is_whole(size) {
            return Some((sum, 0.0));
        }
        error += if tiny && size < UNDERFLOW_BOUND { UNDERFLOW_BOUND } else { 0.0 };
        Some((sum, error + terms * f64::EPSILON * size))
    }
}

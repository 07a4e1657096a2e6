//! A process and what is asked of it to the value of each state, with bounds, and a policy.
//!
//! The components of the graph are solved in reverse topological order, so that what an acyclic part (a battery
//! that only falls) is worth comes from one exact sweep. Inside a component: first what holds by the shape of the
//! graph alone (values 0, 1 and ∞; Forejt et al., "Automated Verification Techniques for Probabilistic Systems", SFM
//! 2011, section 4), then end components are merged so that the equations have one solution (Haddad and Monmege,
//! TCS 735, 2018; zero-reward end components: Bertsekas and Tsitsiklis, Math. OR 16(3), 1991), then policy
//! iteration with direct solution of each chain, then a certificate of its error (`certify`).

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

use problem::{Run, TINY};

pub use local::NONE;
pub use problem::{Direction, Problem, Solution};
pub(crate) use work::Work;

/// Exact arithmetic takes too long.
struct TooMuchWork;

/// Solves a problem; none where exact arithmetic takes too long.
///
/// `hint` is a policy to start from, as a solution in doubles has it.
pub fn solve<N: Number>(problem: Problem<'_, N>, hint: Option<&[u32]>) -> Option<Solution<N>> {
    solve_within(problem, hint, &mut Work::new(work::MOST))
}

/// Solves a problem within a budget of exact arithmetic; none where that does not suffice.
pub(crate) fn solve_within<N: Number>(
    problem: Problem<'_, N>,
    hint: Option<&[u32]>,
    work: &mut Work,
) -> Option<Solution<N>> {
    let mut run = Run { work: *work, ..begin(problem, hint) };
    let done = run.all();
    *work = run.work;
    done.map(|()| run.solution)
}

/// A good policy, which need not be the best one.
pub(crate) fn draft<N: Number>(problem: Problem<'_, N>) -> Option<Vec<u32>> {
    let mut run = Run { draft: true, ..begin(problem, None) };
    run.all()?;
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
    let mut run =
        Run { problem, solution, hint, position: vec![NONE; n], work: Work::new(work::MOST), draft: false };
    run.solution.sure.grow(n);
    run
}

impl<N: Number> Run<'_, N> {
    /// Solves all components, each after those that it leads to.
    fn all(&mut self) -> Option<()> {
        let (mut local, mut ways) = (local::Local::new(), ways::Ways::default());
        let problem = self.problem;
        let successors = |state: u32| {
            if problem.is_sink(state as usize) { &[] } else { problem.mdp.successors(state as usize) }
        };
        let visited = visit_components(problem.mdp.states(), successors, |component| {
            match component {
                [state] if problem.is_sink(*state as usize) => self.sink(*state as usize),
                [state] => self.single(*state as usize),
                _ if self.ways(component, &mut ways) => {}
                _ => self.component(component, &mut local).ok_or(TooMuchWork)?,
            }
            if N::EXACT && self.work.is_spent() { Err(TooMuchWork) } else { Ok(()) }
        });
        visited.ok()
    }

    /// A state at which it ends, well or badly.
    fn sink(&mut self, state: usize) {
        if self.problem.rewards.is_some() && !self.problem.terminal.contains(state) {
            self.solution.infinite.insert(state);
        }
    }

    /// A state that is a component by itself: at most loops, and everything else is known.
    fn single(&mut self, state: usize) {
        let (mut sure, mut all_sure) = (NONE, true);
        for choice in self.problem.choices(state) {
            let mut leaves = false;
            let good = self.problem.mdp.targets(choice).iter().all(|target| {
                leaves |= *target as usize != state;
                *target as usize == state || self.solution.sure.contains(*target as usize)
            });
            match good && leaves {
                true if sure == NONE => sure = dense(choice),
                true => {}
                false => all_sure = false,
            }
        }
        let by_choice = self.sure_by_choice();
        let is_sure = sure != NONE && (by_choice || all_sure);
        if is_sure {
            self.solution.sure.insert(state);
        } else if self.problem.rewards.is_some() {
            self.solution.infinite.insert(state);
            return;
        }
        if is_sure && self.sure_is_one() {
            self.solution.values[state] = N::one();
            self.solution.policy[state] = sure;
            return;
        }
        let must_be_sure = by_choice && self.problem.rewards.is_some();
        let mut best: Option<(N, u32, f64)> = None;
        let mut error = 0.0_f64;
        let problem = self.problem;
        for choice in problem.choices(state) {
            if let Some((value, spread)) = self.single_choice(state, choice, must_be_sure) {
                error = error.max(spread);
                let better = best.as_ref().is_none_or(|(known, ..)| match self.problem.direction {
                    Direction::Min => value < *known,
                    Direction::Max => value > *known,
                });
                if better {
                    best = Some((value, dense(choice), spread));
                }
            }
        }
        if let Some((value, choice, own)) = best {
            if !N::EXACT {
                // Nothing is less than zero, so that only the error of what is zero counts there.
                self.solution.errors[state] = if value.is_zero() { own } else { error };
            }
            self.solution.values[state] = value;
            self.solution.policy[state] = choice;
        }
    }

    /// What a choice is worth, with the error of that; none for one that is never made.
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
            // What the budget does not pay for is noticed when the state is done.
            let _ = self.work.spend(&sum, 2);
        }
        if leaving.is_zero() {
            // It stays for ever: worth nothing where that is allowed.
            return self.problem.rewards.is_none().then(|| (N::zero(), 0.0));
        }
        if looping {
            sum = sum.over(&leaving);
            error /= leaving.to_f64();
        }
        // Probabilities that are rounded may sum to a little more than one.
        error *= 1.0 + terms * f64::EPSILON;
        error += if error > 0.0 || unsure { f64::MIN_POSITIVE } else { 0.0 };
        let size = sum.to_f64();
        // Deterministic choices with whole rewards carry no error of their own.
        if whole && error == 0.0 && terms < 7.0 && !looping && is_whole(size) {
            return Some((sum, 0.0));
        }
        error += if tiny && size < TINY { TINY } else { 0.0 };
        Some((sum, error + terms * f64::EPSILON * size))
    }
}

//! Probabilities of reaching a goal while an accumulated reward stays within a bound.
//!
//! All rewards are nonnegative integers. The equations are solved for each budget (remaining
//! reward) from 0 to the bound. Choices without reward keep the budget. Choices with a reward lead
//! to values of a smaller budget, which are already computed.
//!
//! Reference: Hartmanns, Junges, Katoen and Quatmann, "Multi-Cost Bounded Reachability in MDP",
//! TACAS 2018.

use std::collections::VecDeque;

use fixedbitset::FixedBitSet;
use num_traits::{Signed, ToPrimitive};

use crate::check::ask::{Checked, property_error, refusal, within_budget};
use crate::check::paths::Valued;
use crate::check::query::Query;
use crate::check::vector::{Span, Vector};
use crate::graph::visit_components;
use crate::mdp::{Mdp, dense};
use crate::number::{Number, count};
use crate::prism::ast::Steps;
use crate::solve::{Direction, Problem, Work, solve_within};

/// Upper limit (exclusive) on the greatest whole number within the bound on an accumulated reward.
const MAX_BUDGET: usize = 100_000;
/// Upper limit on the number of values of smaller budgets that are stored at the same time: 4 GB of doubles.
const MAX_VALUES: usize = 500_000_000;

impl<N: Number> Query<'_, N> {
    /// Computes for each state the minimal or maximal probability of reaching a terminal state of `problem`.
    /// Until then, the reward structure `name` must accumulate at most the bound in `steps`.
    ///
    /// Returns an error if a policy is given, or if there is a lower bound on the reward. An upper bound must
    /// be nonnegative (for `<`: positive), the greatest whole number within it must be below [`MAX_BUDGET`], and
    /// all rewards must be nonnegative whole numbers. Without any bound, solves `problem` itself.
    pub fn until_within_reward(
        &self,
        problem: Problem<'_, N>,
        name: Option<&str>,
        steps: &Steps,
    ) -> Checked<Valued<N>> {
        if self.evaluated.is_some() || steps.least.is_some() {
            return Err(refusal(
                "Q403",
                "only upper bounds on rewards are supported, and only without a given policy",
            ));
        }
        let Some(bound) = &steps.most else { return self.solved(problem) };
        let limit = self.constant(&bound.limit)?;
        let place = bound.limit.place;
        let out_of_range = || property_error("Q503", place, "the bound must be at least 0 and below 100,000");
        if limit.is_negative() || bound.strict && !limit.is_positive() {
            return Err(out_of_range().into());
        }
        let whole = if bound.strict {
            limit.ceil() - num_rational::BigRational::from_integer(1.into())
        } else {
            limit.floor()
        };
        let budgets = whole.to_usize().filter(|budget| *budget < MAX_BUDGET).ok_or_else(out_of_range)?;
        let earned = whole_rewards(self.rewards(name)?)?;
        let layers = Layers::new(self.mdp(), problem, &earned)?;
        let n = self.mdp().states();
        // A choice with a greater reward reads no value.
        let greatest = earned.iter().filter(|reward| **reward <= budgets).max().copied().unwrap_or(0);
        if greatest.saturating_mul(n) > MAX_VALUES {
            let text = "the rewards up to the bound are too large for this number of states: the values would need \
                        more than 4 GB";
            return Err(property_error("Q503", place, text).into());
        }
        // Values for the last budgets (remaining rewards), the smallest budget first. No usable choice has
        // a reward above `greatest`, so at most `greatest` older vectors are read.
        let mut previous: VecDeque<Vec<N>> = VecDeque::new();
        let mut vector = Vector::exactly(vec![N::zero(); n], Span::Probability);
        let mut error = 0.0_f64;
        let sweep = Sweep::new(&layers, problem, &earned);
        let widest = layers.paid.iter().map(|choice| self.mdp().targets(*choice).len()).max().unwrap_or(0);
        // Exact arithmetic is slower, so the callback is called after fewer transitions.
        let entries = self.mdp().transition_count().saturating_mul(if N::EXACT { 64 } else { 1 });
        for budget in 0..=budgets {
            within_budget(self.work.borrow_mut().poll(entries))?;
            // The oldest vector is no longer read, so its memory is reused.
            let oldest = if previous.len() > greatest { previous.pop_front() } else { None };
            let mut values = oldest.unwrap_or_else(|| vec![N::zero(); n]);
            if let Some(sweep) = &sweep {
                within_budget(sweep.layer(&mut values, &previous, budget, &mut self.work.borrow_mut()))?;
                error += sweep.error;
                previous.push_back(values);
                continue;
            }
            let mut worth = vec![N::zero(); layers.mdp.states()];
            for state in problem.terminal.ones() {
                worth[state] = N::one();
            }
            for (number, choice) in layers.paid.iter().enumerate() {
                let Some(before) = budget.checked_sub(earned[*choice]) else { continue };
                let age = budget.saturating_sub(before);
                let values = &previous[previous.len().saturating_sub(age)];
                worth[n.saturating_add(number)] = self
                    .mdp()
                    .transitions(*choice)
                    .fold(N::zero(), |sum, (target, p)| sum.plus(&p.times(&values[target])));
            }
            let layer = Problem {
                mdp: &layers.mdp,
                direction: problem.direction,
                rewards: None,
                terminal: &layers.ends,
                terminal_values: Some(&worth),
                blocked: problem.blocked.map(|_| &layers.blocked),
                allowed: None,
            };
            let solution = within_budget(solve_within(layer, None, &mut self.work.borrow_mut()))?;
            let layer_error = solution.errors.iter().fold(0.0_f64, |most, error| most.max(*error));
            // The sums over the targets of choices with a reward cause rounding errors, too.
            error += layer_error + (256.0 + count(widest)) * f64::EPSILON;
            values = solution.values;
            values.truncate(n);
            previous.push_back(values);
        }
        vector.values = previous.pop_back().unwrap_or_default();
        vector.errors.fill(error);
        Ok(vector.into())
    }
}

fn whole_rewards<N: Number>(rewards: &[N]) -> Checked<Vec<usize>> {
    let whole = |reward: &N| {
        let value = reward.to_f64();
        let exact = reward.to_rational().is_none_or(|exact| exact.is_integer());
        (exact && value.fract() == 0.0).then(|| value.to_usize()).flatten()
    };
    let integers: Option<Vec<usize>> = rewards.iter().map(whole).collect();
    integers.ok_or_else(|| {
        refusal("Q403", "bounds on a reward are supported only if all rewards are whole numbers")
    })
}

/// The process for a single budget: each choice with a reward leads to a terminal state of its own.
struct Layers<N> {
    mdp: Mdp<N>,
    /// The choices with a reward. The choice at index `i` leads to the additional state `n + i`,
    /// where `n` is the number of original states.
    paid: Vec<usize>,
    ends: FixedBitSet,
    blocked: FixedBitSet,
}

/// Computes the values of a budget in one backward pass. This requires that choices without reward
/// form no cycle; the states are then ordered topologically.
struct Sweep<'a, N> {
    problem: Problem<'a, N>,
    earned: &'a [usize],
    /// The states that are neither terminal nor blocked, in topological order: successors by choices without
    /// reward come first.
    order: Vec<u32>,
    /// Upper limit on the rounding error that a single budget adds.
    error: f64,
}

impl<'a, N: Number> Sweep<'a, N> {
    /// Sorts the states topologically. Returns `None` if choices without reward form a cycle. Choices that only
    /// loop in their state do not count as cycles.
    fn new(layers: &Layers<N>, problem: Problem<'a, N>, earned: &'a [usize]) -> Option<Self> {
        let mdp = problem.mdp;
        let n = mdp.states();
        let ends = |state: u32| state as usize >= n || problem.is_sink(state as usize);
        let successors = |state: u32| if ends(state) { &[] } else { layers.mdp.successors(state as usize) };
        let mut order = Vec::new();
        let mut depths = vec![0_u32; layers.mdp.states()];
        let (mut deepest, mut widest) = (0_u32, 0_usize);
        let visited = visit_components(layers.mdp.states(), successors, |component| {
            let [state] = *component else { return Err(()) };
            if ends(state) {
                return Ok(());
            }
            let mut depth = 0;
            for choice in problem.choices(state as usize) {
                let targets = mdp.targets(choice);
                widest = widest.max(targets.len());
                // With a choice without reward to itself and other states, the value would depend
                // on itself.
                if earned[choice] == 0
                    && targets.contains(&state)
                    && targets.iter().any(|target| *target != state)
                {
                    return Err(());
                }
            }
            for target in successors(state).iter().filter(|target| **target != state) {
                depth = depth.max(depths[*target as usize]);
            }
            depths[state as usize] = depth.saturating_add(1);
            deepest = deepest.max(depth.saturating_add(1));
            order.push(state);
            Ok(())
        });
        visited.ok()?;
        // Each sum rounds its products, its probabilities and itself, and inherits the errors of
        // its operands.
        let error = if N::EXACT { 0.0 } else { f64::from(deepest) * (count(widest) + 4.0) * f64::EPSILON };
        Some(Self { problem, earned, order, error })
    }

    /// Computes the values for `budget` in place from the values for smaller budgets in `previous`.
    /// Returns `None` if exact arithmetic exceeds its budget of work.
    fn layer(
        &self,
        values: &mut [N],
        previous: &VecDeque<Vec<N>>,
        budget: usize,
        work: &mut Work<'_>,
    ) -> Option<()> {
        let mdp = self.problem.mdp;
        for (state, value) in values.iter_mut().enumerate() {
            *value = if self.problem.terminal.contains(state) { N::one() } else { N::zero() };
        }
        for state in &self.order {
            let mut best: Option<N> = None;
            for choice in self.problem.choices(*state as usize) {
                let from: Option<&[N]> = match self.earned[choice] {
                    0 if mdp.targets(choice) == [*state] => None,
                    0 => Some(&*values),
                    earned if earned > budget => None,
                    earned => Some(&previous[previous.len().saturating_sub(earned)]),
                };
                let value = from.map_or_else(N::zero, |from| {
                    mdp.transitions(choice)
                        .fold(N::zero(), |sum, (target, p)| sum.plus(&p.times(&from[target])))
                });
                work.spend(&value, mdp.targets(choice).len())?;
                let is_better = best.as_ref().is_none_or(|best| match self.problem.direction {
                    Direction::Min => value < *best,
                    Direction::Max => value > *best,
                });
                if is_better {
                    best = Some(value);
                }
            }
            values[*state as usize] = best.unwrap_or_else(N::zero);
        }
        Some(())
    }
}

impl<N: Number> Layers<N> {
    fn new(mdp: &Mdp<N>, problem: Problem<'_, N>, earned: &[usize]) -> Checked<Self> {
        let n = mdp.states();
        let mut result = Mdp::default();
        let mut paid = Vec::new();
        for state in 0..n {
            for choice in mdp.choices(state) {
                if earned[choice] > 0 {
                    result.push_transition(dense(n.saturating_add(paid.len())), N::one());
                    paid.push(choice);
                } else {
                    for (target, probability) in mdp.transitions(choice) {
                        result.push_transition(dense(target), probability.clone());
                    }
                }
                result.end_choice(mdp.action(choice))?;
            }
            result.end_state();
        }
        for number in 0..paid.len() {
            result.push_transition(dense(n.saturating_add(number)), N::one());
            result.end_choice(0)?;
            result.end_state();
        }
        let mut ends = problem.terminal.clone();
        ends.grow(result.states());
        ends.insert_range(n..);
        let mut blocked = problem.blocked.cloned().unwrap_or_default();
        blocked.grow(result.states());
        Ok(Self { mdp: result, paid, ends, blocked })
    }
}

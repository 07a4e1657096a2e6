//! Computes the Pareto front of two objectives, and the optimum of one objective under a bound on the other.
//!
//! Each objective is a loss to be minimised: an expected cost until a target is reached, or the probability of
//! missing a target. Until the first target is reached, a weighted sum of both losses is minimised. Afterwards
//! only one objective remains, and its optimal value is the terminal value of the state (Etessami et al., LMCS
//! 4(4:8), 2008). The weights are normals of the segments between known vertices. So each minimum is a new
//! vertex, or proves that the segment belongs to the front (Forejt, Kwiatkowska and Parker, ATVA 2012). Each
//! vertex is attained by a policy whose memory is the set of reached targets.

use std::cell::RefCell;
use std::collections::VecDeque;

use fixedbitset::FixedBitSet;

use crate::mdp::Mdp;
use crate::number::Number;
use crate::policy::{choices_of, conserving};
use crate::solve::work::DEFAULT_BUDGET;
use crate::solve::{Direction, NONE, Problem, Solution, Work, solve_within};

/// Error: exact arithmetic exceeds its budget, or the caller has cancelled the computation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exhausted;

/// An objective of a multi-objective problem.
#[derive(Debug, Clone)]
pub struct Objective<N> {
    /// The cost of each choice; the objective is the least expected sum of costs until the target is reached.
    /// With `None`, the objective is the greatest probability of reaching the target.
    pub rewards: Option<Vec<N>>,
    /// The states in which the objective is reached.
    pub target: FixedBitSet,
}

/// A policy and its loss in each objective.
#[derive(Debug, Clone)]
pub struct Point<N> {
    /// The two losses: expected cost, or probability of missing the target.
    pub losses: [N; 2],
    /// Upper limit on the absolute error of each loss; 0 if arithmetic is exact.
    pub errors: [f64; 2],
    /// For each state, the choice of the policy until the first target is reached.
    pub policy: Vec<u32>,
}

/// The minimum of the first loss under an upper limit on the second loss.
///
/// In doubles, the limit may be exceeded by 10^-12 (relative to the limit if the limit is above 1).
#[derive(Debug, Clone)]
pub struct Constrained<N> {
    /// The minimum over randomised policies.
    pub randomised: Bounded<N>,
    /// The least loss found over deterministic policies whose memory is the set of reached targets, and `true` if it
    /// is proved that no such policy is better (in doubles: by more than the bounds permit). `None` if no such
    /// policy within the limit was found.
    pub deterministic: Option<(Bounded<N>, bool)>,
}

/// The result of minimising the first loss under an upper limit on the second loss.
#[derive(Debug, Clone)]
pub enum Optimum<N> {
    /// Policies within the limit.
    Found(Constrained<N>),
    /// No policy with finite losses was found within the limit.
    Infeasible {
        /// `true` if no such policy exists. In doubles, the computed losses may be too inaccurate for a proof.
        proved: bool,
    },
}

/// A loss with its bounds. If arithmetic is exact, the bounds are unused.
#[derive(Debug, Clone)]
pub struct Bounded<N> {
    /// The loss.
    pub value: N,
    /// Lower bound on the loss.
    pub lower: f64,
    /// Upper bound on the loss.
    pub upper: f64,
}

const MAX_VERTICES: usize = 2000;
const MAX_BRANCHES: usize = 3000;

/// A problem with two objectives in the same process, prepared for optimisation.
#[derive(Debug)]
pub struct Pareto<'a, N> {
    mdp: &'a Mdp<N>,
    objectives: &'a [Objective<N>; 2],
    /// For each objective, its least loss in each state if the other objective is ignored. Unspecified in
    /// states of infinite cost.
    alone: [Vec<N>; 2],
    alone_errors: [f64; 2],
    /// The states in at least one of the two targets, without the blocked states.
    terminal: FixedBitSet,
    /// The states in which an expected cost is still to be paid and is infinite under every policy.
    blocked: FixedBitSet,
    has_costs: bool,
    work: RefCell<Work<'a>>,
}

impl<'a, N: Number> Pareto<'a, N> {
    /// Prepares the optimisation of two objectives by solving each objective alone.
    ///
    /// # Errors
    /// Exact arithmetic exceeds its budget.
    pub fn new(mdp: &'a Mdp<N>, objectives: &'a [Objective<N>; 2]) -> Result<Self, Exhausted> {
        Self::within(mdp, objectives, &mut Work::new(DEFAULT_BUDGET))
    }

    pub(crate) fn within(
        mdp: &'a Mdp<N>,
        objectives: &'a [Objective<N>; 2],
        work: &mut Work<'a>,
    ) -> Result<Self, Exhausted> {
        let n = mdp.states();
        let mut terminal = FixedBitSet::with_capacity(n);
        let mut blocked = FixedBitSet::with_capacity(n);
        let (mut alone, mut alone_errors) = ([Vec::new(), Vec::new()], [0.0, 0.0]);
        let has_costs = objectives.iter().any(|objective| objective.rewards.is_some());
        for (number, objective) in objectives.iter().enumerate() {
            terminal.union_with(&objective.target);
            work.refill();
            let solution = solve_within(problem(mdp, objective), None, work).ok_or(Exhausted)?;
            alone[number] = match objective.rewards {
                Some(_) => solution.values,
                None => solution.values.iter().map(|value| N::one().minus(value)).collect(),
            };
            alone_errors[number] = solution.errors.iter().fold(0.0, |most: f64, error| most.max(*error));
            blocked.union_with(&solution.infinite);
        }
        // A state in which one cost is infinite need not be avoided after the target of this cost is reached.
        let avoided: Vec<usize> = blocked.ones().collect();
        for state in avoided {
            let pending = objectives.iter().any(|o| o.rewards.is_some() && !o.target.contains(state));
            blocked.set(state, pending);
        }
        terminal.difference_with(&blocked);
        Ok(Self { mdp, objectives, alone, alone_errors, terminal, blocked, has_costs, work: (*work).into() })
    }

    /// Returns the counters of the work that the computations have spent.
    pub(crate) fn work(&self) -> Work<'a> {
        *self.work.borrow()
    }

    /// Returns the value of each state as a terminal state, for one objective: its loss from this state on if
    /// the other objective is ignored.
    fn worth(&self, objective: usize) -> Vec<N> {
        let target = &self.objectives[objective].target;
        let terminal_value = |state: usize| {
            if target.contains(state) { N::zero() } else { self.alone[objective][state].clone() }
        };
        (0..self.mdp.states()).map(terminal_value).collect()
    }

    /// Minimises the weighted sum of both losses over the allowed choices. Returns the solution and the set of
    /// all optimal choices.
    fn solve(
        &self,
        weights: &[N; 2],
        allowed: Option<&FixedBitSet>,
    ) -> Result<(Solution<N>, FixedBitSet), Exhausted> {
        let mix = |values: [&N; 2]| values[0].times(&weights[0]).plus(&values[1].times(&weights[1]));
        let worths = [self.worth(0), self.worth(1)];
        let zero = N::zero();
        let mut worth: Vec<N> = (0..self.mdp.states()).map(|s| mix([&worths[0][s], &worths[1][s]])).collect();
        let rewards: Option<Vec<N>> = self.has_costs.then(|| {
            let reward = |number: usize, choice: usize| {
                self.objectives[number].rewards.as_ref().map_or(&zero, |rewards| &rewards[choice])
            };
            (0..self.mdp.choice_count()).map(|choice| mix([reward(0, choice), reward(1, choice)])).collect()
        });
        if !self.has_costs {
            // Both objectives are probabilities: a path may avoid both targets forever, and then loses both. So
            // the weighted sum of the probabilities is maximised, which is 0 for such a path, instead of
            // minimising the losses.
            let total = weights[0].plus(&weights[1]);
            for worth in &mut worth {
                *worth = total.minus(worth);
            }
        }
        let problem = Problem {
            mdp: self.mdp,
            direction: if self.has_costs { Direction::Min } else { Direction::Max },
            rewards: rewards.as_deref(),
            terminal: &self.terminal,
            terminal_values: Some(&worth),
            blocked: Some(&self.blocked),
            allowed,
        };
        let mut work = self.work.borrow_mut();
        work.refill();
        let solution = solve_within(problem, None, &mut work).ok_or(Exhausted)?;
        let optimal_choices = conserving(&problem, &solution);
        Ok((solution, optimal_choices))
    }

    /// Computes both losses of a policy from the first initial state on. After the first target is
    /// reached, the other objective is pursued optimally.
    fn point(&self, policy: Vec<u32>) -> Result<Point<N>, Exhausted> {
        let allowed = choices_of(self.mdp, &policy);
        let unit = [[N::one(), N::zero()], [N::zero(), N::one()]];
        let (mut losses, mut errors) = ([N::zero(), N::zero()], [0.0; 2]);
        for (number, weights) in unit.iter().enumerate() {
            let (solution, _) = self.solve(weights, Some(&allowed))?;
            let value = solution.values[0].clone();
            losses[number] = if self.has_costs { value } else { N::one().minus(&value) };
            if !N::EXACT {
                // Complements of probabilities are rounded twice more: in the terminal values and
                // in the result.
                errors[number] = solution.errors[0] + self.alone_errors[number] + 2.0 * f64::EPSILON;
            }
        }
        Ok(Point { losses, errors, policy })
    }

    /// Returns the lexicographic optimum whose primary objective has the index `first`. Returns `None` if no
    /// policy makes both losses finite.
    fn extreme(&self, first: usize, allowed: Option<&FixedBitSet>) -> Result<Option<Point<N>>, Exhausted> {
        let unit = |number: usize| {
            let mut weights = [N::zero(), N::zero()];
            weights[number] = N::one();
            weights
        };
        let (best, optimal_choices) = self.solve(&unit(first), allowed)?;
        if best.infinite.contains(0) {
            return Ok(None);
        }
        let secondary = usize::from(first == 0);
        let (second, _) = self.solve(&unit(secondary), Some(&optimal_choices))?;
        // Where the second probability is 0, the second policy may be any that preserves the first value, for example one
        // that always waits and never attains it.
        let is_free =
            |state: usize| second.policy[state] == NONE || !self.has_costs && second.values[state].is_zero();
        let choice = |state: usize| if is_free(state) { best.policy[state] } else { second.policy[state] };
        self.point((0..best.policy.len()).map(choice).collect()).map(Some)
    }

    /// Returns the vertices of the Pareto front, ordered by increasing first loss. Only the choices in
    /// `allowed` are used; `None` allows all choices. The list is empty if no policy makes both losses finite.
    /// Vertices are missing if there are more than 2,000, or in doubles if they hardly improve on their
    /// neighbours.
    ///
    /// # Errors
    /// Exact arithmetic exceeds its budget.
    pub fn vertices(&self, allowed: Option<&FixedBitSet>) -> Result<Vec<Point<N>>, Exhausted> {
        let Some(first) = self.extreme(0, allowed)? else { return Ok(Vec::new()) };
        let Some(last) = self.extreme(1, allowed)? else { return Ok(Vec::new()) };
        let mut done = Vec::new();
        let mut open = vec![last];
        let mut at = first;
        while let Some(next) = open.last() {
            // The weights are the normal of the segment between two vertices: a point beyond the segment has a
            // smaller weighted loss.
            let weights = [at.losses[1].minus(&next.losses[1]), next.losses[0].minus(&at.losses[0])];
            let flat = weights.iter().any(|w| !clearly_positive(w));
            let between = if flat || done.len().saturating_add(open.len()) > MAX_VERTICES {
                None
            } else {
                let (solution, _) = self.solve(&weights, allowed)?;
                let point = self.point(solution.policy)?;
                let worth =
                    |p: &Point<N>| p.losses[0].times(&weights[0]).plus(&p.losses[1].times(&weights[1]));
                let gain = worth(&at).minus(&worth(&point));
                let enough = N::EXACT || gain.to_f64() > 1e-9 * worth(&at).to_f64().abs().max(1e-300);
                (N::zero() < gain && enough).then_some(point)
            };
            if let Some(point) = between {
                open.push(point);
            } else {
                let next = open.pop();
                if flat && done.is_empty() && open.is_empty() {
                    // A single point is optimal for both objectives.
                    return Ok(vec![at]);
                }
                done.push(std::mem::replace(&mut at, next.ok_or(Exhausted)?));
            }
        }
        done.push(at);
        Ok(done)
    }

    /// Minimises the first loss under an upper limit on the second loss. With more than 2,000 vertices, the values
    /// may be above the minimum, also in exact arithmetic.
    ///
    /// # Errors
    /// Exact arithmetic exceeds its budget.
    pub fn constrained(&self, limit: &N) -> Result<Optimum<N>, Exhausted> {
        let vertices = self.vertices(None)?;
        let Some((value, segment)) = lower_hull(&vertices, limit) else {
            let proved = vertices.is_empty() || self.is_infeasible(limit, None)?;
            return Ok(Optimum::Infeasible { proved });
        };
        let lower = self.below(&vertices, segment, limit, None)?;
        let randomised = Bounded { value, lower, upper: above(&vertices, segment, limit) };
        let deterministic = self.deterministic(limit)?;
        Ok(Optimum::Found(Constrained { randomised, deterministic }))
    }

    /// Returns `true` if the second loss of every policy with the allowed choices is proved to exceed the limit. Call it
    /// only if no known vertex satisfies the limit; in exact arithmetic this is a proof.
    fn is_infeasible(&self, limit: &N, allowed: Option<&FixedBitSet>) -> Result<bool, Exhausted> {
        Ok(N::EXACT || self.least(&[N::zero(), N::one()], allowed)? > kept_limit(limit.to_f64()).next_up())
    }

    /// Lower bound on the weighted sum of both losses over all policies with the allowed choices.
    fn least(&self, weights: &[N; 2], allowed: Option<&FixedBitSet>) -> Result<f64, Exhausted> {
        let (solution, _) = self.solve(weights, allowed)?;
        let [first, second] = weights.each_ref().map(Number::to_f64);
        let value = solution.values[0].to_f64();
        let least = if self.has_costs { value } else { first + second - value };
        let error = solution.errors[0] + first * self.alone_errors[0] + second * self.alone_errors[1];
        Ok(least - error - 16.0 * f64::EPSILON * (least.abs() + first + second))
    }

    /// Lower bound on the first loss of every randomised policy within the limit. The bound follows from the
    /// least weighted loss; the weights are the normal of `segment`. Returns 0 in exact arithmetic, in which
    /// the bound is not used.
    fn below(
        &self,
        vertices: &[Point<N>],
        segment: Option<(usize, usize)>,
        limit: &N,
        allowed: Option<&FixedBitSet>,
    ) -> Result<f64, Exhausted> {
        if N::EXACT {
            return Ok(0.0);
        }
        let weights = segment.map_or([N::one(), N::zero()], |(left, right)| {
            let (a, b) = (&vertices[left].losses, &vertices[right].losses);
            [a[1].minus(&b[1]), b[0].minus(&a[0])]
        });
        let least = self.least(&weights, allowed)?;
        let [first, second] = weights.each_ref().map(Number::to_f64);
        let spent = second * kept_limit(limit.to_f64());
        let rounding = 16.0 * f64::EPSILON * (least.abs() + spent);
        Ok(((least - spent - rounding) / first).next_down().max(0.0))
    }

    /// Searches for the best deterministic policy within the limit, by branch and bound. A node branches over
    /// the choices of a state in which the policies of two neighbouring vertices differ. The lower bound of a
    /// node is the optimum of randomised policies with its allowed choices. Returns the loss of the best policy
    /// found, and `true` if it is proved that no policy is better (in doubles: by more than the bounds permit);
    /// `None` if no policy within the limit was found. The search ends after [`MAX_BRANCHES`] nodes.
    fn deterministic(&self, limit: &N) -> Result<Option<(Bounded<N>, bool)>, Exhausted> {
        let mut best: Option<N> = None;
        // Bounds on the first loss: the lower bound holds in all pruned nodes.
        let (mut lower, mut upper) = (f64::INFINITY, f64::INFINITY);
        // The first loss of the policy that gives the upper bound.
        let mut kept: Option<N> = None;
        // Lower bound on the first loss in the nodes in which it is not decided whether a policy is within the limit.
        let mut undecided = f64::INFINITY;
        let mut choices = FixedBitSet::with_capacity(self.mdp.choice_count());
        choices.insert_range(..);
        let mut open = vec![choices];
        let mut remaining_nodes = 0..MAX_BRANCHES;
        // Without some vertices, `lower_hull` gives no lower bound, so that a pruned node may have the optimum.
        let mut is_complete = true;
        while let Some(allowed) = open.pop() {
            if remaining_nodes.next().is_none() {
                return Ok(best.map(|value| (Bounded { value, lower: 0.0, upper }, false)));
            }
            let vertices = self.vertices(Some(&allowed))?;
            is_complete &= vertices.len() <= MAX_VERTICES;
            for vertex in vertices.iter().filter(|vertex| keeps(&vertex.losses[1], limit)) {
                // In doubles, the loss of a policy is an upper bound only if the policy is proved to be within
                // the limit.
                if vertex.losses[1].to_f64() + vertex.errors[1] <= kept_limit(limit.to_f64()) {
                    let bound = (vertex.losses[0].to_f64() + vertex.errors[0]).next_up();
                    if bound < upper {
                        (upper, kept) = (bound, Some(vertex.losses[0].clone()));
                    }
                }
                if best.as_ref().is_none_or(|best| vertex.losses[0] < *best) {
                    best = Some(vertex.losses[0].clone());
                }
            }
            let Some((bound, segment)) = lower_hull(&vertices, limit) else {
                if !vertices.is_empty() && !self.is_infeasible(limit, Some(&allowed))? {
                    undecided = undecided.min(self.below(&vertices, None, limit, Some(&allowed))?);
                }
                continue;
            };
            let improves = best.as_ref().is_none_or(|best| bound.clearly_less(best));
            let state = segment
                .filter(|_| improves)
                .and_then(|(left, right)| self.difference(&vertices[left].policy, &vertices[right].policy));
            let Some(state) = state else {
                lower = lower.min(self.below(&vertices, segment, limit, Some(&allowed))?);
                continue;
            };
            for choice in self.mdp.choices(state).filter(|choice| allowed.contains(*choice)) {
                let mut restricted = allowed.clone();
                for alternative in self.mdp.choices(state) {
                    restricted.set(alternative, alternative == choice);
                }
                open.push(restricted);
            }
        }
        Ok(best.map(|value| {
            // In doubles, the best policy may exceed the limit, and its loss may then be below all bounds.
            let keeps_limit = || kept.is_some_and(|kept| !value.clearly_less(&kept));
            let proved = is_complete && (N::EXACT || value.to_f64() <= undecided && keeps_limit());
            let lower = lower.min(undecided).min(upper).min(value.to_f64());
            (Bounded { value, lower, upper }, proved)
        }))
    }

    /// Returns the first state, in breadth-first order under `policy` before a target is reached,
    /// in which the two policies choose differently. Returns `None` if there is no such state.
    fn difference(&self, policy: &[u32], other: &[u32]) -> Option<usize> {
        let mut visited = FixedBitSet::with_capacity(self.mdp.states());
        let mut queue = VecDeque::from([0]);
        visited.insert(0);
        while let Some(state) = queue.pop_front() {
            if policy[state] == NONE || self.terminal.contains(state) {
                continue;
            }
            if policy[state] != other[state] {
                return Some(state);
            }
            for target in self.mdp.targets(policy[state] as usize) {
                if !visited.put(*target as usize) {
                    queue.push_back(*target as usize);
                }
            }
        }
        None
    }
}

fn problem<'p, N: Number>(mdp: &'p Mdp<N>, objective: &'p Objective<N>) -> Problem<'p, N> {
    let direction = if objective.rewards.is_some() { Direction::Min } else { Direction::Max };
    Problem::new(mdp, direction, objective.rewards.as_deref(), &objective.target)
}

fn clearly_positive<N: Number>(value: &N) -> bool {
    if N::EXACT { N::zero() < *value } else { value.to_f64() > 1e-12 }
}

fn keeps<N: Number>(loss: &N, limit: &N) -> bool {
    if N::EXACT { loss <= limit } else { loss.to_f64() <= kept_limit(limit.to_f64()) }
}

/// Returns the limit on a loss plus the tolerance for rounding errors of doubles.
fn kept_limit(limit: f64) -> f64 {
    limit + 1e-12 * limit.max(1.0)
}

/// Upper bound on the first loss of a mixture (randomisation) of the two vertices of `segment`. The mixture is
/// chosen so that its second loss is within `limit`. Without a segment, the bound is that of the first vertex.
/// Infinite if, because of rounding errors, it is not proved that the second loss is within the limit.
fn above<N: Number>(vertices: &[Point<N>], segment: Option<(usize, usize)>, limit: &N) -> f64 {
    let worst = |point: &Point<N>, number: usize| point.losses[number].to_f64() + point.errors[number];
    let limit = limit.to_f64();
    let (left, right) = segment.unwrap_or((0, 0));
    let (a, b) = (&vertices[left], &vertices[right]);
    // The limit itself may be rounded, so it is decreased by the rounding error.
    let strict = limit - 2.0 * f64::EPSILON * limit.max(1.0);
    let limit = if worst(b, 1) <= strict { strict } else { kept_limit(limit) };
    if worst(b, 1) > limit {
        return f64::INFINITY;
    }
    let share = ((worst(a, 1) - limit) / (worst(a, 1) - worst(b, 1))).clamp(0.0, 1.0);
    let share = if left == right { 1.0 } else { share };
    let bound = worst(a, 0) * (1.0 - share) + worst(b, 0) * share;
    bound + 16.0 * f64::EPSILON * (worst(a, 0) + worst(b, 0))
}

/// Returns the least first loss of a mixture of vertices whose mixed second loss is within the limit. Also
/// returns the indices of the two mixed vertices, unless the first vertex satisfies the limit. Returns `None`
/// if no vertex satisfies the limit.
fn lower_hull<N: Number>(vertices: &[Point<N>], limit: &N) -> Option<(N, Option<(usize, usize)>)> {
    // The vertices are ordered by increasing first and decreasing second loss.
    let right = vertices.iter().position(|vertex| keeps(&vertex.losses[1], limit))?;
    let Some(left) = right.checked_sub(1) else {
        return Some((vertices[right].losses[0].clone(), None));
    };
    let (a, b) = (&vertices[left].losses, &vertices[right].losses);
    let share = a[1].minus(limit).over(&a[1].minus(&b[1]));
    let value = a[0].plus(&share.times(&b[0].minus(&a[0])));
    Some((value, Some((left, right))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Answers the question for the least first loss with a second loss of at most 1000. Each loss has an error of 1e-4.
    /// Each pair is a policy with its two losses.
    fn best(policies: &[[f64; 2]]) -> (Bounded<f64>, bool) {
        let mut mdp = Mdp::default();
        for _ in policies {
            mdp.push_transition(1, 1.0);
            mdp.end_choice(0).expect("few choices");
        }
        mdp.end_state();
        mdp.push_transition(1, 1.0);
        mdp.end_choice(0).expect("few choices");
        mdp.end_state();
        let mut target = FixedBitSet::with_capacity(2);
        target.insert(1);
        let objectives = [0, 1].map(|number| {
            let rewards = policies.iter().map(|losses| losses[number]).chain([0.0]).collect();
            Objective { rewards: Some(rewards), target: target.clone() }
        });
        let mut pareto = Pareto::new(&mdp, &objectives).expect("doubles");
        pareto.alone_errors = [1e-4; 2];
        pareto.deterministic(&1000.0).expect("doubles").expect("a policy within the limit")
    }

    #[test]
    fn a_policy_that_may_be_within_the_limit_prevents_a_proof() {
        let (bounded, proved) = best(&[[0.0, 1_000.000_05], [5.0, 10.0]]);
        assert!(bounded.lower <= 0.0 && bounded.upper >= 5.0 && !proved, "{bounded:?}");
        // The first policy is worse, or certainly beyond the limit.
        assert!(best(&[[6.0, 1_000.000_05], [5.0, 10.0]]).1);
        assert!(best(&[[0.0, 1_000.1], [5.0, 10.0]]).1);
    }

    #[test]
    fn a_policy_that_may_exceed_the_limit_is_not_proved_optimal() {
        let (bounded, proved) = best(&[[1.0, 1000.0], [5.0, 10.0]]);
        assert!(bounded.lower <= bounded.value && bounded.upper >= 5.0 && !proved, "{bounded:?}");
    }
}
